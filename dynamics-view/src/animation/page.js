"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (id) => document.getElementById(id);
  const last = data.frames - 1;
  const several = data.films.length > 1;
  const space = data.spatial ? makeSpace(data) : null;
  const { axes, numbersOf, ...painter } = makePaint(space);

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

  function drawPicture() {
    const { pen, width, height } = prepare(picture);
    painter.aim(room.view(pen, width, height), width, height);
    const spacing = space ? painter.drawFloor(pen, data.origin, data.quantum)
      : painter.drawGrid(pen, width, height, data.origin, data.quantum);
    const hint = space ? " · drag to turn, scroll or pinch to zoom" : "";
    $("scale").textContent = spacing ? "grid " + asLength(spacing) + hint : "";
    for (const film of films) drawTraces(pen, film);
    painter.paint(pen, films.flatMap(piecesOf));
  }

  // The numbers of a film now: between two instants of the same scene they are interpolated.
  function current(film) {
    const k = Math.min(Math.floor(frame), last), part = frame - k;
    const scene = film.scenes[film.order[k]];
    if (!scene) return null;
    const a = film.local[k];
    const between = part > 0 && k < last && film.order[k + 1] === film.order[k];
    const value = (column) => {
      if (typeof column === "number") return column;
      const v = column[a];
      return between ? v + part * (column[a + 1] - v) : v;
    };
    return { scene, instant: a, value };
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
  const edge = { left: 58, right: 10, top: 8, bottom: 8 };

  function drawStrip() {
    if (!strip.length) return;
    const { pen, width, height } = prepare(plot);
    let lo = Infinity, hi = -Infinity;
    for (const curve of strip) for (const v of curve.values) { if (v < lo) lo = v; if (v > hi) hi = v; }
    if (!(lo <= hi)) { lo = -1; hi = 1; }
    if (lo === hi) { const half = Math.abs(lo) / 2 || 1; lo -= half; hi += half; }
    pen.font = "11px system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif";
    // A thousandth of the axis is as fine as a label says: what rounding left of 0 is 0.
    const labels = [lo, hi].map((v) => number(Math.abs(v) < 5e-4 * (hi - lo) ? 0 : v, 3));
    edge.left = Math.max(40, ...labels.map((label) => pen.measureText(label).width + 12));
    const x = (k) => edge.left + (width - edge.left - edge.right) * (last ? k / last : 0);
    const y = (v) => height - edge.bottom - (height - edge.top - edge.bottom) * (v - lo) / (hi - lo);
    pen.strokeStyle = palette.rule;
    pen.lineWidth = 1;
    pen.strokeRect(edge.left + 0.5, edge.top - 3.5, width - edge.left - edge.right - 1,
      height - edge.top - edge.bottom + 7);
    if (lo < 0 && hi > 0) {
      pen.beginPath(); pen.moveTo(edge.left, y(0)); pen.lineTo(width - edge.right, y(0)); pen.stroke();
    }
    pen.fillStyle = palette.quiet;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    pen.fillText(labels[1], edge.left - 6, y(hi) + 3);
    pen.fillText(labels[0], edge.left - 6, y(lo) - 3);
    if (lo < 0 && hi > 0 && Math.min(y(0) - y(hi), y(lo) - y(0)) > 18) pen.fillText("0", edge.left - 6, y(0));
    // Events: a small sign at the upper edge and a faint line, those that can be told apart.
    let mark = -Infinity;
    pen.strokeStyle = pen.fillStyle = palette.faint;
    pen.setLineDash([2, 3]);
    pen.beginPath();
    // Many of them stay at the edge.
    const foot = data.events.length > width / 16 ? edge.top + 3 : height - edge.bottom + 4;
    for (const [place] of data.events) {
      if (Math.abs(x(place) - mark) < 2) continue;
      mark = x(place);
      pen.moveTo(mark, edge.top - 4); pen.lineTo(mark, foot);
    }
    pen.stroke();
    pen.lineWidth = 1.6;
    pen.lineJoin = "round";
    for (const curve of strip) {
      pen.strokeStyle = palette[curve.color];
      pen.setLineDash([[], [7, 4], [2, 3]][curve.dash % 3]);
      pen.beginPath();
      let down = false;
      curve.values.forEach((v, k) => {
        if (Number.isNaN(v)) { down = false; return; }
        if (down) pen.lineTo(x(k), y(v)); else pen.moveTo(x(k), y(v));
        down = true;
      });
      pen.stroke();
    }
    pen.setLineDash([]);
    pen.strokeStyle = palette.ink;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(x(frame), edge.top - 4);
    pen.lineTo(x(frame), height - edge.bottom + 4);
    pen.stroke();
    strip.forEach((curve) => {
      const v = interpolated(curve.values);
      pen.fillStyle = palette[curve.color];
      if (!Number.isNaN(v)) { pen.beginPath(); pen.arc(x(frame), y(v), 3, 0, 2 * Math.PI); pen.fill(); }
      curve.shown.textContent = Number.isNaN(v) ? "–"
        : number(known(v, curve), 4) + (curve.unit ? " " + curve.unit : "");
    });
  }

  // Without the digits that the page does not know: values are multiples of a unit, which is 1 where they
  // stand still.
  function known(v, curve) {
    const decimals = -Math.ceil(Math.log10(curve.unit_of_values));
    return decimals > 0 && decimals <= 100 ? Number(v.toFixed(decimals)) : v;
  }

  function interpolated(values) {
    const k = Math.min(Math.floor(frame), last), part = frame - k;
    return part > 0 && k < last ? values[k] + part * (values[k + 1] - values[k]) : values[k];
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
    frame = Math.max(0, Math.min(last, k));
    $("scrub").value = last ? frame / last : 0;
    if (!playing) $("scrub").setAttribute("aria-valuetext", time(frame) + " " + timeUnit);
    $("time").textContent = "t = " + time(frame) + " / " + time(last) + (timeUnit && " " + timeUnit);
    refresh();
  }

  function setPlaying(value) {
    playing = value && last > 0;
    $("sign").setAttribute("d", playing ? "M6 5h4v14H6zM14 5h4v14h-4z" : "M7 4.5v15l12.5-7.5z");
    $("play").setAttribute("aria-label", playing ? "pause" : "play");
    before = null;
    if (playing) { if (frame >= last) seek(0); requestAnimationFrame(tick); }
  }

  function tick(now) {
    if (!playing) return;
    // A page that was hidden goes on where it was.
    const passed = before === null ? 0 : Math.min(now - before, 100) / 1000;
    before = now;
    let next = frame + passed * speed / step;
    if (next >= last) {
      if (!looping) { seek(last); setPlaying(false); return; }
      next = last > 0 ? next % last : 0;
    }
    seek(next);
    requestAnimationFrame(tick);
  }

  function setLooping(value) {
    looping = value;
    $("loop").setAttribute("aria-pressed", String(value));
  }

  const factors = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20];
  for (const factor of factors) {
    const speed = number(Number((factor * data.speed).toPrecision(6)), 3) + " ×";
    const option = new Option(speed, String(factor), factor === 1, factor === 1);
    $("speed").append(option);
  }
  function faster(by) {
    const k = Math.max(0, Math.min(factors.length - 1, $("speed").selectedIndex + by));
    $("speed").selectedIndex = k;
    speed = data.speed * factors[k];
  }

  $("play").addEventListener("click", () => setPlaying(!playing));
  picture.addEventListener("click", () => { if (!turnable?.dragged) setPlaying(!playing); });
  const turnable = space ? makeTurnable(picture, space, drawPicture) : null;
  $("loop").addEventListener("click", () => setLooping(!looping));
  $("speed").addEventListener("change", () => faster(0));
  $("scrub").addEventListener("input", (event) => {
    setPlaying(false);
    seek(event.target.valueAsNumber * last);
  });

  const scrubPlot = (event) => {
    const box = plot.getBoundingClientRect();
    setPlaying(false);
    seek(last * (event.clientX - box.left - edge.left) / (box.width - edge.left - edge.right));
  };
  plot.addEventListener("pointerdown", (event) => {
    plot.setPointerCapture(event.pointerId);
    scrubPlot(event);
  });
  plot.addEventListener("pointermove", (event) => { if (event.buttons) scrubPlot(event); });

  document.addEventListener("keydown", (event) => {
    const within = (selector) => event.target.closest?.(selector);
    // What a focused control does with its keys is its own affair.
    if (event.ctrlKey || event.metaKey || event.altKey || within("select, summary")
      || (event.key === " " && within("button"))) return;
    const far = event.shiftKey ? last / 10 : last / 100;
    const jump = (k) => { setPlaying(false); seek(k); };
    const actions = {
      " ": () => setPlaying(!playing), k: () => setPlaying(!playing),
      l: () => setLooping(!looping), L: () => setLooping(!looping),
      ArrowLeft: () => jump(frame - far), ArrowRight: () => jump(frame + far),
      ",": () => jump(Math.ceil(frame) - 1), ".": () => jump(Math.floor(frame) + 1),
      Home: () => jump(0), End: () => jump(last),
      "+": () => faster(1), "=": () => faster(1), "-": () => faster(-1),
    };
    if (space) {
      for (const [key, look] of Object.entries(keysOfSpace(space))) {
        actions[key] = () => { look(); drawPicture(); };
      }
    }
    const action = actions[event.key];
    if (action) { event.preventDefault(); action(); }
  });

  // ---- names, and the start

  function key(name, tint) {
    const [item, line, value] = ["span", "i", "b"].map((tag) => document.createElement(tag));
    item.className = "key";
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
      const { item, line, value } = key(name, "faint");
      line.style.borderTopStyle = "dotted";
      const count = data.events.filter((event) => event[1] === name).length;
      value.textContent = count > 1 ? count + " times" : "";
      $("curves").append(item);
    }
  }

  readPalette();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readPalette(); refresh(); });
  new ResizeObserver(refresh).observe($("stage"));
  seek(0);
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) setPlaying(true);
})();
