"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const last = data.frames - 1;
  const several = data.films.length > 1;
  const space = data.spatial ? makeSpace(data) : null, sight = space ?? makePlane();
  const { axes, numbersOf, ...painter } = makePaint(sight);

  // ---- data: differences back to values; a missing value is NaN

  const summed = (differences) => {
    let value = 0;
    return Float64Array.from(differences, (d) => (d === null ? NaN : (value += d)));
  };

  const films = data.films.map((film) => {
    const scenes = film.reel.scenes.map((scene) => {
      const columns = scene.columns.map((c) => (Array.isArray(c) ? summed(c) : c === null ? NaN : c));
      return { ...scene, numbers: scene.places.map((place) => columns[place]) };
    });
    // Scene of every instant, and how many instants of that scene went before.
    const order = film.reel.order || new Array(data.frames).fill(0);
    const seen = scenes.map(() => 0);
    const local = order.map((scene) => seen[scene]++);
    return { ...film, scenes, order, local, traces: tracesOf(scenes, order, local) };
  });

  // Where each traced point is at every instant, whatever the scene.
  function tracesOf(scenes, order, local) {
    const traces = new Map();
    scenes.forEach((scene, id) => {
      let number = 0;
      for (const figure of scene.figures) {
        if (figure.k === "trace") {
          if (!traces.has(figure.name)) {
            const gaps = () => new Float64Array(order.length).fill(NaN);
            traces.set(figure.name, Array.from({ length: axes }, gaps));
          }
          const track = traces.get(figure.name);
          order.forEach((scene_id, frame) => {
            if (scene_id === id) track.forEach((column, axis) => {
              column[frame] = at(scene.numbers[number + axis], local[frame]);
            });
          });
        }
        number += numbersOf(figure);
      }
    });
    return traces;
  }

  function at(column, k) { return typeof column === "number" ? column : column[k]; }

  const strip = data.strip.map((curve) => ({
    ...curve, values: summed(curve.values).map((v) => curve.lo + curve.unit_of_values * v),
  }));

  // ---- state of the player

  let frame = 0;              // where we are, a fraction of instants
  let playing = false;
  let looping = true;
  let speed = data.speed;     // seconds of the motion per second of playing
  let before = null;          // clock of the last picture while playing
  const step = Math.abs(data.step);

  // ---- the picture

  const picture = $("picture");
  const room = makeRoom({ films, space, half: data.half, at, numbersOf });

  // What can stay in the middle: the traced points, or all that moves where there are none.
  const traced = films.flatMap((film) => [...film.traces].map(([name, track]) => ({ film, name, track })));
  const named = ({ film, name }) => (several && film.label ? `${name} (${film.label})` : name);
  const look = makeLook({
    canvas: picture, sight, names: traced.length ? traced.map(named) : films.length ? ["the middle"] : [],
    refresh: () => drawPicture(),
  });
  const followable = () => (traced.length
    ? traced.map(({ film, track }) => {
      const now = current(film);
      return now && track.map((column) => between(column, now.part, Math.floor(frame)));
    }) : [middleNow()]);

  function drawPicture() {
    const { pen, width, height } = prepare(picture);
    look.follow(followable);
    painter.aim(room.view(pen, width, height), width, height);
    const spacing = space ? painter.drawFloor(pen, data.origin, data.quantum)
      : painter.drawGrid(pen, width, height, data.origin, data.quantum, data.length_unit);
    $("scale").textContent = spacing ? "grid " + asLength(spacing) : "";
    for (const film of films) drawTraces(pen, film);
    painter.paint(pen, films.flatMap(piecesOf));
  }

  // Between two instants of a column.
  function between(column, part, k) {
    return part > 0 ? column[k] + part * (column[k + 1] - column[k]) : column[k];
  }

  // The mean of the points that move.
  function middleNow() {
    const sum = [0, 0];
    let count = 0;
    for (const film of films) {
      const now = current(film);
      let first = 0;
      for (const figure of now?.scene.figures ?? []) {
        for (let k = 0; k < pointsOf(figure) && figure.k !== "text"; k++) {
          const place = first + axes * k, columns = now.scene.numbers.slice(place, place + 2);
          const point = columns.map(now.value), stands = columns.every((c) => typeof c === "number");
          if (stands || point.some(Number.isNaN)) continue;
          point.forEach((x, axis) => { sum[axis] += x; });
          count++;
        }
        first += numbersOf(figure);
      }
    }
    return count ? sum.map((x) => x / count) : null;
  }

  // The numbers of a film now: between two instants of the same scene they are interpolated.
  function current(film) {
    const k = Math.min(Math.floor(frame), last), part = frame - k;
    const scene = film.scenes[film.order[k]];
    if (!scene) return null;
    const a = film.local[k];
    const share = k < last && film.order[k + 1] === film.order[k] ? part : 0;
    const value = (column) => (typeof column === "number" ? column : between(column, share, a));
    return { scene, instant: a, part: share, value };
  }

  // What is to be painted of a film now: figures, as pieces of the plane.
  function piecesOf(film) {
    const now = current(film);
    if (!now) return [];
    const pieces = [];
    let number = 0, word = 0;
    for (const figure of now.scene.figures) {
      const count = numbersOf(figure);
      const v = [];
      for (let k = 0; k < count; k++) v.push(now.value(now.scene.numbers[number + k]));
      number += count;
      let words = figure.k === "text" ? now.scene.words[word++] : "";
      if (Array.isArray(words)) words = words[now.instant];
      if (v.some(Number.isNaN)) continue;
      pieces.push(...painter.piecesOf(figure, v, film.color, words));
    }
    return pieces;
  }

  function drawTraces(pen, film) {
    const now = current(film);
    if (!now) return;
    let number = 0;
    for (const figure of now.scene.figures) {
      if (figure.k === "trace") {
        const trace = film.traces.get(figure.name), whole = figure.s == null;
        painter.drawTrace(pen, figure, film.color, {
          at: (k) => trace.map((column) => column[k]),
          first: 0, end: Math.floor(frame),
          head: trace.map((_, axis) => now.value(now.scene.numbers[number + axis])),
          reach: whole || !step ? null : Math.max(0, Math.ceil(figure.s / step)),
          perSecond: step ? data.speed / step : 1,
        });
      }
      number += numbersOf(figure);
    }
  }

  // ---- the strip of plots

  const plot = $("plot");
  // Instants along the plot, with the times of round numbers below.
  const moment = (k) => data.start + data.step * k;
  const units = new Set(strip.map((curve) => curve.unit));
  let extent = { left: 0, wide: 1 };   // where the plot is on its canvas

  function drawStrip() {
    if (!strip.length) return;
    const drawing = prepare(plot), { pen, width, height } = drawing;
    const [lo, hi] = [moment(0), moment(last)].sort((a, b) => a - b);
    const { power, of } = labelsOf({ lo, hi });
    const round = hi > lo ? ticks(lo, hi, Math.max(2, width / 90)) : [lo];
    const marks = round.map((t) => (hi > lo ? (t - data.start) / data.step : 0)).sort((a, b) => a - b);
    const { X, Y } = drawAxes(drawing,
      { lo: 0, hi: last || 1, marks, label: (k) => of(moment(k)), unit: scaled(power, data.time_unit) },
      { ...range, unit: units.size === 1 ? strip[0].unit : "" });
    extent = { left: drawing.left, wide: width - drawing.left - EDGE.right };
    clipped(drawing, () => {
      markEvents(pen, X, width, height);
      for (const curve of strip) strokeColumn(pen, curve, curve.values, X, Y);
      pen.strokeStyle = palette.ink;
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(X(frame), EDGE.top - 4);
      pen.lineTo(X(frame), height - EDGE.bottom + 4);
      pen.stroke();
      for (const curve of strip) {
        const v = interpolated(curve.values);
        pen.fillStyle = palette[curve.color];
        if (!Number.isNaN(v)) { pen.beginPath(); pen.arc(X(frame), Y(v), 3, 0, 2 * Math.PI); pen.fill(); }
        curve.shown.textContent = Number.isNaN(v) ? "–"
          : number(known(v, curve), 4) + (curve.unit ? " " + curve.unit : "");
      }
    });
  }

  // The range of all curves with some room.
  const range = (() => {
    let lo = Infinity, hi = -Infinity;
    for (const curve of strip) for (const v of curve.values) { if (v < lo) lo = v; if (v > hi) hi = v; }
    if (!(lo <= hi)) [lo, hi] = [-1, 1];
    if (lo === hi) { const half = Math.abs(lo) / 2 || 1; lo -= half; hi += half; }
    return { lo: lo - 0.05 * (hi - lo), hi: hi + 0.05 * (hi - lo) };
  })();

  // Events: a dotted line, those that can be told apart; many of them stay at the upper edge.
  function markEvents(pen, X, width, height) {
    const foot = data.events.length > width / 16 ? EDGE.top + 5 : height - EDGE.bottom;
    let mark = -Infinity;
    pen.strokeStyle = palette.quiet;
    pen.lineWidth = 1;
    pen.setLineDash([2, 3]);
    pen.beginPath();
    for (const [place] of data.events) {
      if (Math.abs(X(place) - mark) < 2) continue;
      mark = X(place);
      pen.moveTo(mark, EDGE.top - 4); pen.lineTo(mark, foot);
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  // Without the digits that the page does not know: values are multiples of a unit, which is 1 where they
  // stand still.
  function known(v, curve) {
    const decimals = -Math.ceil(Math.log10(curve.unit_of_values));
    return decimals > 0 && decimals <= 100 ? Number(v.toFixed(decimals)) : v;
  }

  function interpolated(values) {
    const k = Math.min(Math.floor(frame), last), part = frame - k;
    return between(values, k < last ? part : 0, k);
  }

  const asLength = (v) => number(v) + (data.length_unit && " " + data.length_unit);

  // Times of very short and very long motions count in a power of ten.
  const span = step * last, latest = Math.max(Math.abs(data.start), Math.abs(data.start + data.step * last));
  const timePower = span > 0 && (latest < 1e-2 || latest >= 1e6) ? Math.floor(Math.log10(latest)) : 0;
  const timeDigits = Math.max(0, Math.min(12, 3 + timePower - Math.floor(Math.log10(span || 1) + 1e-9)));
  const timeUnit = [timePower && "×" + powerOfTen(timePower), data.time_unit].filter(Boolean).join(" ");
  const time = (k) => ((data.start + data.step * k) / 10 ** timePower).toFixed(timeDigits).replace("-", "−");

  // ---- what the viewer does

  const refresh = () => { drawPicture(); drawStrip(); };

  function seek(k) {
    frame = clamp(k, 0, last);
    const unit = timeUnit && " " + timeUnit, [now, end] = [time(frame), time(last)];
    transport.place(last ? frame / last : 0, `t = ${now} / ${end}${unit}`, now + unit);
    refresh();
  }

  function setPlaying(value) {
    playing = value && last > 0;
    transport.show(playing);
    if (playing) { if (frame >= last) seek(0); requestAnimationFrame(tick); }
  }

  function tick(clock) {
    if (!playing) return;
    let next = frame + transport.passed(clock) * speed / step;
    if (next >= last) {
      if (!looping) { seek(last); setPlaying(false); return; }
      next %= last;
    }
    seek(next);
    requestAnimationFrame(tick);
  }

  function setLooping(value) {
    looping = value;
    $("loop").setAttribute("aria-pressed", String(value));
  }
  $("loop").addEventListener("click", () => setLooping(!looping));

  const jump = (k) => { setPlaying(false); seek(k); };
  const toggle = () => setPlaying(!playing), repeat = () => setLooping(!looping);
  const transport = makeTransport({
    toggle, again: () => seek(0), seek: (part) => jump(part * last),
    // A single step ends at an instant.
    step: (by) => jump(by === 1 ? Math.floor(frame) + 1 : by === -1 ? Math.ceil(frame) - 1 : frame + by),
    far: (more) => (more ? last / 10 : last / 100),
    hurry: (factor) => { speed = data.speed * factor; },
    keys: { ...look.keys, l: repeat, L: repeat, Home: () => jump(0), End: () => jump(last) },
  });
  transport.offer(data.speed);
  picture.addEventListener("click", () => { if (!look.dragged) toggle(); });

  const scrubPlot = (event) => {
    const box = plot.getBoundingClientRect();
    setPlaying(false);
    seek(last * (event.clientX - box.left - extent.left) / extent.wide);
  };
  plot.addEventListener("pointerdown", (event) => {
    plot.setPointerCapture(event.pointerId);
    scrubPlot(event);
  });
  plot.addEventListener("pointermove", (event) => { if (event.buttons) scrubPlot(event); });

  // ---- names, and the start

  function key(name, tint) {
    const [item, line, value] = ["span", "i", "b"].map((tag) => document.createElement(tag));
    line.style.borderColor = "var(--" + tint + ")";
    item.append(line, name, value);
    return { item, line, value };
  }

  if (several || films.some((film) => film.label)) {
    for (const film of films) $("films").append(key(film.label || "–", film.color).item);
  }
  if (strip.length) {
    $("strip").hidden = false;
    for (const curve of strip) {
      const { item, line, value } = key(curve.name, curve.color);
      line.style.borderTopStyle = ["solid", "dashed", "dotted"][curve.dash % 3];
      curve.shown = value;
      $("curves").append(item);
    }
    for (const name of new Set(data.events.map((event) => event[1]))) {
      const { item, line, value } = key(name, "quiet");
      line.style.borderTopStyle = "dotted";
      const count = data.events.filter((event) => event[1] === name).length;
      value.textContent = count > 1 ? count + " times" : "";
      $("curves").append(item);
    }
  }

  $("hint").textContent = `drag to ${space ? "turn" : "move"} it, scroll or pinch to zoom`;
  picture.addEventListener("pointerdown", () => $("hint").classList.add("gone"));
  setTimeout(() => $("hint").classList.add("gone"), 9000);
  watchScheme(refresh);
  new ResizeObserver(refresh).observe($("stage"));
  seek(0);
  if (!reducedMotion()) setPlaying(true);
})();
