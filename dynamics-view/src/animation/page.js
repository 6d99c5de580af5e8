"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (id) => document.getElementById(id);
  const last = data.frames - 1;
  const several = data.films.length > 1;
  const space = data.spatial ? makeSpace(data) : null;
  const axes = space ? 3 : 2;   // numbers of a point
  const numbersAfterPoints = { disc: 1, circle: 1, arc: 3, cone: 2 };
  const numbersOf = (figure) => axes * pointsOf(figure) + (numbersAfterPoints[figure.k] ?? 0);

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

  function pointsOf(figure) {
    switch (figure.k) {
      case "line": return figure.n;
      case "spring": case "arrow": case "ground": case "cone": return 2;
      case "cuboid": return 4;
      default: return 1;
    }
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

  // ---- colours

  let palette = {};
  function readPalette() {
    const style = getComputedStyle(document.documentElement);
    const surfaces = ["ground", "panel", "ink", "quiet", "faint", "rule"];
    const hues = ["blue", "red", "green", "amber", "purple", "teal", "brown", "pink"];
    for (const name of [...surfaces, ...hues]) {
      palette[name] = style.getPropertyValue("--" + name).trim();
    }
  }
  const color = (role, film) => palette[role === "accent" ? film.color : role]
    || (role[0] === "#" ? role : palette.ink);

  // ---- canvases, in CSS pixels whatever the screen's resolution

  function prepare(canvas) {
    const { width, height } = canvas.getBoundingClientRect();
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    return { pen, width, height };
  }

  // ---- the picture

  const picture = $("picture");
  let view = { scale: 1, x: 0, y: 0, marks: 1 };
  const room = makeRoom({ films, space, half: data.half, at, pointsOf, numbersOf });

  function drawPicture() {
    const { pen, width, height } = prepare(picture);
    const { scale, x, y } = room.view(pen, width, height), zoom = space ? space.zoom : 1;
    // Signs of fixed size shrink with small pictures; what is made larger grows about the middle.
    view = {
      scale: scale * zoom, x: width / 2 + zoom * (x - width / 2), y: height / 2 + zoom * (y - height / 2),
      marks: Math.max(0.6, Math.min(1, Math.min(width, height) / 420)),
    };
    if (space) drawFloor(pen); else drawGrid(pen, width, height);
    pen.lineJoin = pen.lineCap = "round";
    for (const film of films) drawTraces(pen, film);
    const pieces = films.flatMap(piecesOf);
    // Of space, what is near covers what is far; of the plane, what comes later.
    if (space) pieces.sort((a, b) => a.depth - b.depth);
    for (const piece of pieces) paint(pen, piece);
    pen.setLineDash([]);
  }

  function roundStep(least) {
    const power = 10 ** Math.floor(Math.log10(least));
    return [1, 2, 5, 10].map((d) => d * power).find((s) => s >= least * (1 - 1e-9));
  }

  function drawGrid(pen, width, height) {
    const unit = view.scale / data.quantum;   // pixels per length of the model
    const spacing = roundStep(64 / unit);
    if (!(spacing > 0) || !Number.isFinite(spacing)) return;
    pen.strokeStyle = palette.rule;
    pen.lineWidth = 1;
    pen.beginPath();
    const left = data.origin[0] - view.x / unit, bottom = data.origin[1] - (height - view.y) / unit;
    for (let k = Math.ceil(left / spacing), n = 0; n < 200; k++, n++) {
      const x = Math.round((k * spacing - left) * unit) + 0.5;
      if (x > width) break;
      pen.moveTo(x, 0); pen.lineTo(x, height);
    }
    for (let k = Math.ceil(bottom / spacing), n = 0; n < 200; k++, n++) {
      const y = height - Math.round((k * spacing - bottom) * unit) - 0.5;
      if (y < 0) break;
      pen.moveTo(0, y); pen.lineTo(width, y);
    }
    pen.stroke();
    $("scale").textContent = "grid " + asLength(spacing);
  }

  function drawFloor(pen) {
    const length = space.size * data.quantum, spacing = roundStep(length / 5);
    if (!(spacing > 0) || !Number.isFinite(spacing)) return;
    const offset = data.origin.slice(0, 2).map((origin) =>
      (Math.ceil(origin / spacing) * spacing - origin) / data.quantum);
    pen.strokeStyle = palette.rule;
    pen.lineWidth = 1;
    for (const line of space.floor(spacing / data.quantum, offset)) { outline(pen, line); pen.stroke(); }
    $("scale").textContent = "grid " + asLength(spacing) + " · drag to turn, scroll or pinch to zoom";
  }

  const px = (x) => view.x + view.scale * x;
  const py = (y) => view.y - view.scale * y;

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
      const parts = space ? space.pieces(figure, v) : [{ figure, v }];
      for (const piece of parts) pieces.push({ ...piece, film, words });
    }
    return pieces;
  }

  function paint(pen, { figure, v, face, film, words }) {
    pen.strokeStyle = pen.fillStyle = color(figure.c, film);
    pen.lineWidth = figure.w ?? 2;
    pen.setLineDash(figure.d ? [6, 5] : []);
    if (face) drawFace(pen, face, color(figure.f ?? figure.c, film));
    else draw[figure.k]?.(pen, v, figure, film, words);
  }

  // A colour in more or less light.
  function lit(hex, bright) {
    const parts = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})/i.exec(hex);
    if (!parts) return hex;
    const glare = Math.max(0, bright - 1);
    return "rgb(" + parts.slice(1).map((part) => {
      const value = parseInt(part, 16) * Math.min(bright, 1);
      return Math.round(value + glare * (255 - value));
    }).join(",") + ")";
  }

  function drawFace(pen, face, hex) {
    pen.fillStyle = lit(hex, face.bright);
    // Seams between faces of a round side would show.
    pen.strokeStyle = face.edges ? lit(hex, 0.5) : pen.fillStyle;
    pen.lineWidth = face.edges ? 1 : 0.7;
    outline(pen, face.flat);
    pen.closePath();
    pen.fill();
    pen.stroke();
  }

  const outline = (pen, v) => {
    pen.beginPath();
    for (let k = 0; k < v.length; k += 2) pen.lineTo(px(v[k]), py(v[k + 1]));
  };
  const filled = (pen, figure, film) => {
    if (!figure.f) return;
    const stroke = pen.fillStyle;
    pen.fillStyle = color(figure.f, film);
    pen.fill();
    pen.fillStyle = stroke;
  };

  const draw = {
    line(pen, v, figure, film) {
      outline(pen, v);
      if (figure.z) { pen.closePath(); filled(pen, figure, film); }
      pen.stroke();
    },
    disc(pen, v, figure, film) {
      const [x, y, r] = [px(v[0]), py(v[1]), Math.max(1.5, Math.abs(v[2]) * view.scale)];
      if (space) {
        const shade = pen.createRadialGradient(x - 0.35 * r, y - 0.4 * r, 0.1 * r, x, y, r);
        const hex = color(figure.c, film);
        [[0, 1.35], [0.5, 1], [1, 0.6]].forEach(([stop, bright]) =>
          shade.addColorStop(stop, lit(hex, bright)));
        pen.fillStyle = shade;
      }
      pen.beginPath();
      pen.arc(x, y, r, 0, 2 * Math.PI);
      pen.fill();
    },
    circle(pen, v, figure, film) {
      pen.beginPath();
      pen.arc(px(v[0]), py(v[1]), Math.abs(v[2]) * view.scale, 0, 2 * Math.PI);
      filled(pen, figure, film);
      pen.stroke();
    },
    // Angles count in 1/10,000 rad; up is up, so they run against the canvas.
    arc(pen, v) {
      pen.beginPath();
      pen.arc(px(v[0]), py(v[1]), Math.abs(v[2]) * view.scale, -v[3] / 1e4, -v[4] / 1e4, v[4] > v[3]);
      pen.stroke();
    },
    dot(pen, v) {
      pen.beginPath();
      pen.arc(px(v[0]), py(v[1]), 7 * view.marks, 0, 2 * Math.PI);
      pen.fill();
    },
    spring(pen, v, figure) {
      const [ax, ay, bx, by] = [px(v[0]), py(v[1]), px(v[2]), py(v[3])];
      const length = Math.hypot(bx - ax, by - ay) || 1;
      const [ex, ey] = [(bx - ax) / length, (by - ay) / length];
      const straight = 0.1 * length, half = 8 * view.marks, turns = 2 * figure.n;
      pen.beginPath();
      pen.moveTo(ax, ay);
      pen.lineTo(ax + straight * ex, ay + straight * ey);
      for (let k = 0; k < turns; k++) {
        const s = straight + (length - 2 * straight) * (k + 0.5) / turns, side = k % 2 ? -half : half;
        pen.lineTo(ax + s * ex - side * ey, ay + s * ey + side * ex);
      }
      pen.lineTo(bx - straight * ex, by - straight * ey);
      pen.lineTo(bx, by);
      pen.stroke();
    },
    arrow(pen, v) {
      const [ax, ay, bx, by] = [px(v[0]), py(v[1]), px(v[2]), py(v[3])];
      const length = Math.hypot(bx - ax, by - ay);
      if (length < 0.5) return;
      const head = Math.min(11 * view.marks, 0.6 * length);
      const [ex, ey] = [(bx - ax) / length, (by - ay) / length];
      pen.beginPath();
      pen.moveTo(ax, ay);
      pen.lineTo(bx - 0.8 * head * ex, by - 0.8 * head * ey);
      pen.stroke();
      pen.beginPath();
      pen.moveTo(bx, by);
      pen.lineTo(bx - head * ex - 0.45 * head * ey, by - head * ey + 0.45 * head * ex);
      pen.lineTo(bx - head * ex + 0.45 * head * ey, by - head * ey - 0.45 * head * ex);
      pen.fill();
    },
    text(pen, v, figure, film, words) {
      pen.font = room.fontOfWords;
      pen.textAlign = figure.b ? "left" : "center";
      pen.textBaseline = "middle";
      const shift = figure.b ? room.besideWords : 0;
      pen.save();
      pen.setLineDash([]);
      pen.strokeStyle = palette.panel;
      pen.lineWidth = 4;
      pen.strokeText(words, px(v[0]) + shift, py(v[1]) - shift);
      pen.restore();
      pen.fillText(words, px(v[0]) + shift, py(v[1]) - shift);
    },
    ground(pen, v) {
      const [ax, ay, bx, by] = [px(v[0]), py(v[1]), px(v[2]), py(v[3])];
      const length = Math.hypot(bx - ax, by - ay) || 1, size = 9 * view.marks;
      const [ex, ey] = [(bx - ax) / length, (by - ay) / length];
      pen.beginPath();
      pen.moveTo(ax, ay);
      pen.lineTo(bx, by);
      pen.stroke();
      pen.lineWidth = 1;
      pen.beginPath();
      for (let s = size / 2; s <= length; s += size) {
        pen.moveTo(ax + s * ex, ay + s * ey);
        pen.lineTo(ax + (s - size) * ex - size * ey, ay + (s - size) * ey + size * ex);
      }
      pen.stroke();
    },
    pivot(pen, v) {
      const [x, y, r] = [px(v[0]), py(v[1]), 5 * view.marks];
      pen.beginPath();
      pen.arc(x, y, r, 0, 2 * Math.PI);
      pen.save();
      pen.fillStyle = palette.panel;
      pen.fill();
      pen.restore();
      pen.stroke();
    },
    trace() {},
  };

  function drawTraces(pen, film) {
    const now = current(film);
    if (!now) return;
    let number = 0;
    for (const figure of now.scene.figures) {
      if (figure.k === "trace") {
        const trace = film.traces.get(figure.name);
        const head = trace.map((_, axis) => now.value(now.scene.numbers[number + axis]));
        pen.strokeStyle = color(figure.c, film);
        pen.lineWidth = 0.75 * (figure.w ?? 2);
        pen.setLineDash(figure.d ? [6, 5] : []);
        pen.lineCap = "butt";
        drawTrace(pen, trace, head, figure.s);
      }
      number += numbersOf(figure);
    }
    pen.globalAlpha = 1;
    pen.lineCap = "round";
    pen.setLineDash([]);
  }

  // Traces are drawn in pieces that fade: one of limited length to nothing, a whole one to a quiet ground
  // after some seconds of playing, so that long motions do not bury the picture.
  function drawTrace(pen, track, head, seconds) {
    const end = Math.floor(frame), whole = seconds == null, perSecond = step ? data.speed / step : 1;
    const reach = whole || !step ? end : Math.max(0, Math.ceil(seconds / step));
    const begin = Math.max(0, end - reach), length = whole ? 15 : Math.max(1, Math.ceil(reach / 24));
    const seen = (point) => (space ? space.project(point) : point);
    const stroke = (from, to, opacity) => {
      pen.globalAlpha = opacity;
      pen.beginPath();
      let down = false;
      for (let k = from; k <= to; k++) {
        const [x, y] = seen(track.map((column) => column[k]));
        if (Number.isNaN(x) || Number.isNaN(y)) { down = false; continue; }
        if (down) pen.lineTo(px(x), py(y)); else pen.moveTo(px(x), py(y));
        down = true;
      }
      if (to === end && down && !head.some(Number.isNaN)) {
        const [x, y] = seen(head);
        pen.lineTo(px(x), py(y));
      }
      pen.stroke();
    };
    const opacity = (age) => whole ? 0.16 + 0.44 * Math.exp(-age / perSecond / 6)
      : 0.05 + 0.75 * Math.max(0, 1 - age / (reach + 1));
    let from = begin;
    if (whole) {
      const settled = length * Math.floor((end - 18 * perSecond) / length);
      if (settled > begin) { stroke(begin, settled, 0.16); from = settled; }
    }
    // The pieces keep their places while time goes on: nothing flickers.
    for (;;) {
      const to = Math.min(end, length * (Math.floor(from / length) + 1));
      stroke(from, to, opacity(end - (from + to) / 2));
      if (to >= end) break;
      from = to;
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

  // ---- numbers and times as people write them

  const powerOfTen = (exponent) =>
    "10" + String(exponent).replace("-", "⁻").replace(/\d/g, (digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]);

  function number(v, digits = 3) {
    const size = Math.abs(v);
    if (v === 0 || (size >= 1e-3 && size < 1e5)) {
      return String(Number(v.toPrecision(digits))).replace("-", "−");
    }
    const [mantissa, exponent] = v.toExponential(digits - 1).split("e").map(Number);
    const factor = mantissa === 1 ? "" : mantissa === -1 ? "−" : String(mantissa).replace("-", "−") + "×";
    return factor + powerOfTen(exponent);
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
  picture.addEventListener("click", () => { if (!dragged) setPlaying(!playing); });

  // One finger or the mouse turns what is of space, two fingers or the wheel make it larger, a double click
  // puts it back.
  const held = new Map();
  let dragged = false;
  if (space) {
    const apart = () => { const [a, b] = [...held.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
    picture.classList.add("turns");
    picture.addEventListener("pointerdown", (event) => {
      if (!held.size) dragged = false;
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
      picture.setPointerCapture(event.pointerId);
    });
    picture.addEventListener("pointermove", (event) => {
      const from = held.get(event.pointerId);
      if (!from) return;
      const to = { x: event.clientX, y: event.clientY }, moved = Math.hypot(to.x - from.x, to.y - from.y);
      // A finger never holds still.
      if (!dragged && moved < 4) return;
      dragged = true;
      const before = held.size === 2 ? apart() : 0;
      held.set(event.pointerId, to);
      if (held.size === 1) space.turn((to.x - from.x) / 120, (to.y - from.y) / 120);
      else if (held.size === 2 && before > 0) space.magnify(apart() / before);
      drawPicture();
    });
    for (const end of ["pointerup", "pointercancel"]) {
      picture.addEventListener(end, (event) => held.delete(event.pointerId));
    }
    picture.addEventListener("wheel", (event) => {
      event.preventDefault();
      space.magnify(Math.exp(-0.0015 * event.deltaY * (event.deltaMode ? 30 : 1)));
      drawPicture();
    }, { passive: false });
    picture.addEventListener("dblclick", () => { space.reset(); drawPicture(); });
  }
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
    const look = (action) => () => { action(); drawPicture(); };
    if (space) Object.assign(actions, {
      a: look(() => space.turn(-0.1, 0)), d: look(() => space.turn(0.1, 0)),
      w: look(() => space.turn(0, -0.1)), s: look(() => space.turn(0, 0.1)),
      z: look(() => space.magnify(1.1)), x: look(() => space.magnify(1 / 1.1)), 0: look(() => space.reset()),
    });
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
