// What recorded and live pages share: colours, canvases, numbers in words, and the painters of all figures.
"use strict";

const $ = (id) => document.getElementById(id);
const clamp = (v, lo, hi) => Math.max(lo, Math.min(hi, v));

// ---- numbers as people write them

const powerOfTen = (exponent) =>
  "10" + String(exponent).replace("-", "⁻").replace(/\d/g, (digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]);

function number(v, digits = 3) {
  const size = Math.abs(v);
  if (v === 0 || !Number.isFinite(v) || (size >= 1e-3 && size < 1e5)) {
    return String(Number(v.toPrecision(digits))).replace("-", "−");
  }
  const [mantissa, exponent] = v.toExponential(digits - 1).split("e").map(Number);
  const factor = mantissa === 1 ? "" : mantissa === -1 ? "−" : String(mantissa).replace("-", "−") + "×";
  return factor + powerOfTen(exponent);
}

// The smallest of 1, 2, 5 times a power of ten that is not below `least`.
function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((d) => d * power).find((s) => s >= least * (1 - 1e-9));
}

// ---- colours: roles of the style sheet

const palette = {};
function readPalette() {
  const style = getComputedStyle(document.documentElement);
  const surfaces = ["ground", "panel", "ink", "quiet", "faint", "rule"];
  const hues = ["blue", "red", "green", "amber", "purple", "teal", "brown", "pink"];
  for (const name of [...surfaces, ...hues]) palette[name] = style.getPropertyValue("--" + name).trim();
}
const color = (role, accent) => palette[role === "accent" ? accent : role]
  || (role[0] === "#" ? role : palette.ink);

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

// A canvas in CSS pixels, whatever the screen's resolution.
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

// ---- figures

const fontOfWords = "14px system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif";
const fontOfAxes = "11px system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif";
const besideWords = 11;   // pixels from a point to the words beside it

function pointsOf(figure) {
  switch (figure.k) {
    case "line": return figure.n;
    case "spring": case "arrow": case "ground": case "cone": return 2;
    case "cuboid": return 4;
    default: return 1;
  }
}
const numbersAfterPoints = { disc: 1, circle: 1, arc: 3, cone: 2 };

// Painters of figures of the plane. `sight` is what the viewer chooses to see: of `makePlane`, or the eye of
// `makeSpace`. Places count from the middle of what is shown; `view` puts them onto the canvas.
const makePaint = (sight) => {
  const space = sight.project ? sight : null;
  const axes = space ? 3 : 2;   // numbers of a point
  const view = { scale: 1, x: 0, y: 0, marks: 1 };
  const px = (x) => view.x + view.scale * x;
  const py = (y) => view.y - view.scale * y;
  const numbersOf = (figure) => axes * pointsOf(figure) + (numbersAfterPoints[figure.k] ?? 0);

  // `fit` shows everything: its scale, and the place of the middle in pixels. Signs of fixed size shrink with
  // small pictures.
  function aim(fit, width, height) {
    Object.assign(view, sight.aim(fit, width, height));
    view.marks = clamp(Math.min(width, height) / 420, 0.6, 1);
  }

  const outline = (pen, v) => {
    pen.beginPath();
    for (let k = 0; k < v.length; k += 2) pen.lineTo(px(v[k]), py(v[k + 1]));
  };

  // Lines of a grid of the plane with their coordinates, and their spacing, in the model's lengths. `middle`:
  // what is in the middle of the view; `quantum`: lengths to a part of the view; `of`: the unit of lengths,
  // null for lines without numbers.
  function drawGrid(pen, width, height, middle, quantum, of = "") {
    const unit = view.scale / quantum;   // pixels per length of the model
    const spacing = roundStep(64 / unit);
    if (!(spacing > 0) || !Number.isFinite(spacing)) return null;
    const left = middle[0] - view.x / unit, bottom = middle[1] - (height - view.y) / unit;
    const lines = (from, pixels) => {
      const first = Math.ceil(from / spacing), last = Math.floor((from + pixels / unit) / spacing);
      return Array.from({ length: clamp(last - first + 1, 0, 200) || 0 }, (_, k) => (first + k) * spacing);
    };
    const [across, upright] = [lines(left, width), lines(bottom, height)];
    const X = (v) => Math.round((v - left) * unit) + 0.5;
    const Y = (v) => height - Math.round((v - bottom) * unit) - 0.5;
    pen.strokeStyle = palette.rule;
    pen.lineWidth = 1;
    pen.beginPath();
    for (const x of across.map(X)) { pen.moveTo(x, 0); pen.lineTo(x, height); }
    for (const y of upright.map(Y)) { pen.moveTo(0, y); pen.lineTo(width, y); }
    pen.stroke();
    // Small pictures have no room for numbers.
    if (of !== null && Math.min(width, height) >= 220) {
      labelGrid(pen, { across, upright, X, Y, width, height, spacing, of });
    }
    return spacing;
  }
  // Coordinates at the lower and the left edge; the last ones say their unit.
  function labelGrid(pen, { across, upright, X, Y, width, height, spacing, of }) {
    const most = Math.max(...[...across, ...upright].map(Math.abs));
    const digits = clamp(1 + Math.ceil(Math.log10(most / spacing)), 2, 12);
    const words = (v, last) => number(v, digits) + (last && of ? " " + of : "");
    pen.font = fontOfAxes;
    pen.fillStyle = palette.quiet;
    pen.textAlign = "left";
    pen.textBaseline = "bottom";
    let free = width - 4;
    across.slice().reverse().forEach((v) => {
      const text = words(v, free === width - 4), wide = pen.measureText(text).width, x = X(v) + 4;
      if (x + wide > free || x < 4) return;
      pen.fillText(text, x, height - 4);
      free = x - 14;
    });
    const seen = upright.filter((v) => Y(v) > 56 && Y(v) < height - 22);
    seen.forEach((v, k) => pen.fillText(words(v, k === seen.length - 1), 4, Y(v) - 2));
  }

  // The same for the level ground of space.
  function drawFloor(pen, middle, quantum) {
    const spacing = roundStep(space.size * quantum / 5);
    if (!(spacing > 0) || !Number.isFinite(spacing)) return null;
    const offset = middle.slice(0, 2).map((at) => (Math.ceil(at / spacing) * spacing - at) / quantum);
    pen.strokeStyle = palette.rule;
    pen.lineWidth = 1;
    for (const line of space.floor(spacing / quantum, offset)) { outline(pen, line); pen.stroke(); }
    return spacing;
  }

  // A figure as pieces of the plane, in the colour of its motion.
  const piecesOf = (figure, v, accent, words) =>
    (space ? space.pieces(figure, v) : [{ figure, v }]).map((piece) => ({ ...piece, accent, words }));

  // Of space, what is near covers what is far; of the plane, what comes later.
  function paint(pen, pieces) {
    if (space) pieces.sort((a, b) => a.depth - b.depth);
    pen.lineJoin = pen.lineCap = "round";
    for (const { figure, v, face, accent, words } of pieces) {
      pen.strokeStyle = pen.fillStyle = color(figure.c, accent);
      pen.lineWidth = figure.w ?? 2;
      pen.setLineDash(figure.d ? [6, 5] : []);
      if (face) drawFace(pen, face, color(figure.f ?? figure.c, accent));
      else draw[figure.k]?.(pen, v, figure, accent, words);
    }
    pen.setLineDash([]);
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

  const filled = (pen, figure, accent) => {
    if (!figure.f) return;
    const stroke = pen.fillStyle;
    pen.fillStyle = color(figure.f, accent);
    pen.fill();
    pen.fillStyle = stroke;
  };

  // The ends of a figure of two points on the canvas, and the way from one to the other.
  function ends(v) {
    const [ax, ay, bx, by] = [px(v[0]), py(v[1]), px(v[2]), py(v[3])];
    const length = Math.hypot(bx - ax, by - ay), by1 = length || 1;
    return { ax, ay, bx, by, length, ex: (bx - ax) / by1, ey: (by - ay) / by1 };
  }

  const draw = {
    line(pen, v, figure, accent) {
      outline(pen, v);
      if (figure.z) { pen.closePath(); filled(pen, figure, accent); }
      pen.stroke();
    },
    disc(pen, v, figure, accent) {
      const [x, y, r] = [px(v[0]), py(v[1]), Math.max(1.5, Math.abs(v[2]) * view.scale)];
      if (space) {
        const shade = pen.createRadialGradient(x - 0.35 * r, y - 0.4 * r, 0.1 * r, x, y, r);
        const hex = color(figure.c, accent);
        [[0, 1.35], [0.5, 1], [1, 0.6]].forEach(([stop, bright]) =>
          shade.addColorStop(stop, lit(hex, bright)));
        pen.fillStyle = shade;
      }
      pen.beginPath();
      pen.arc(x, y, r, 0, 2 * Math.PI);
      pen.fill();
    },
    circle(pen, v, figure, accent) {
      pen.beginPath();
      pen.arc(px(v[0]), py(v[1]), Math.abs(v[2]) * view.scale, 0, 2 * Math.PI);
      filled(pen, figure, accent);
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
      const { ax, ay, bx, by, length: measured, ex, ey } = ends(v), length = measured || 1;
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
      const { ax, ay, bx, by, length, ex, ey } = ends(v);
      if (length < 0.5) return;
      const head = Math.min(11 * view.marks, 0.6 * length);
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
    text(pen, v, figure, accent, words) {
      pen.font = fontOfWords;
      pen.textAlign = figure.b ? "left" : "center";
      pen.textBaseline = "middle";
      const shift = figure.b ? besideWords : 0;
      pen.save();
      pen.setLineDash([]);
      pen.strokeStyle = palette.panel;
      pen.lineWidth = 4;
      pen.strokeText(words, px(v[0]) + shift, py(v[1]) - shift);
      pen.restore();
      pen.fillText(words, px(v[0]) + shift, py(v[1]) - shift);
    },
    ground(pen, v) {
      const { ax, ay, bx, by, length: measured, ex, ey } = ends(v);
      const length = measured || 1, size = 9 * view.marks;
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

  // Traces are drawn in pieces that fade: one of limited length to nothing, a whole one to a quiet ground
  // after some seconds of playing, so that long motions do not bury the picture.
  //
  // `at(k)` is the place at instant k, `end` the last whole instant, `head` where the point is now; `reach`
  // counts instants, null for the whole trace from `first` on; `perSecond` instants pass in a second.
  function drawTrace(pen, figure, accent, { at, first, end, head, reach, perSecond }) {
    pen.strokeStyle = color(figure.c, accent);
    pen.lineWidth = 0.75 * (figure.w ?? 2);
    pen.setLineDash(figure.d ? [6, 5] : []);
    pen.lineCap = "butt";
    pen.lineJoin = "round";
    const whole = reach === null, span = whole ? end : reach, begin = Math.max(first, end - span);
    const length = whole ? 15 : Math.max(1, Math.ceil(span / 24));
    const seen = (point) => (space ? space.project(point) : point);
    const stroke = (from, to, opacity) => {
      pen.globalAlpha = opacity;
      pen.beginPath();
      let down = false;
      for (let k = from; k <= to; k++) {
        const [x, y] = seen(at(k));
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
      : 0.05 + 0.75 * Math.max(0, 1 - age / (span + 1));
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
    pen.globalAlpha = 1;
    pen.lineCap = "round";
    pen.setLineDash([]);
  }

  return { axes, view, px, py, numbersOf, aim, drawGrid, drawFloor, piecesOf, paint, drawTrace };
};
