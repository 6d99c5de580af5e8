// Axes of plots, and curves in them.
"use strict";
const EDGE = { left: 44, right: 14, top: 20, bottom: 22 };

// The power of ten that axis labels leave to the unit.
function powerOf(lo, hi) {
  const most = Math.max(Math.abs(lo), Math.abs(hi));
  return most > 0 && Number.isFinite(most) && (most < 1e-2 || most >= 1e4) ? Math.floor(Math.log10(most)) : 0;
}
const scaled = (power, unit) => [power && "×" + powerOfTen(power), unit].filter(Boolean).join(" ");

function ticks(lo, hi, most) {
  const step = roundStep((hi - lo) / most), first = Math.ceil(lo / step - 1e-9), marks = [];
  for (let k = first; k * step <= hi + 1e-9 * step && marks.length < 20; k++) marks.push(k * step);
  return marks;
}

// How an axis labels its values: as many digits as tell neighbours apart, without a power that its unit has.
function labelsOf({ lo, hi, label }) {
  if (label) return { power: 0, of: label };
  const power = powerOf(lo, hi), span = hi - lo, most = Math.max(Math.abs(lo), Math.abs(hi));
  const digits = clamp(2 + Math.ceil(Math.log10(most / span)), 3, 9);
  return { power, of: (v) => number(Math.abs(v) < 1e-9 * span ? 0 : v / 10 ** power, digits) };
}

// Grid, labels and units of axes { lo, hi, unit, marks, label }; returns where values are on the canvas, and
// leaves the left edge of the plot in `drawing`.
function drawAxes(drawing, x, y) {
  const { pen, width, height } = drawing, [below, beside] = [labelsOf(x), labelsOf(y)];
  pen.font = fontOfAxes;
  const upright = y.marks ?? ticks(y.lo, y.hi, Math.max(2, height / 38));
  const left = Math.max(EDGE.left, ...upright.map((v) => pen.measureText(beside.of(v)).width + 10));
  const across = x.marks ?? ticks(x.lo, x.hi, Math.max(2, (width - left) / 70));
  const X = (v) => left + (width - left - EDGE.right) * (v - x.lo) / (x.hi - x.lo);
  const Y = (v) => height - EDGE.bottom - (height - EDGE.bottom - EDGE.top) * (v - y.lo) / (y.hi - y.lo);
  const line = (x0, y0, x1, y1) => { pen.moveTo(x0, y0); pen.lineTo(x1, y1); };
  pen.strokeStyle = palette.rule;
  pen.lineWidth = 1;
  pen.beginPath();
  for (const v of across.map((v) => Math.round(X(v)) + 0.5)) line(v, EDGE.top, v, height - EDGE.bottom);
  for (const v of upright.map((v) => Math.round(Y(v)) + 0.5)) line(left, v, width - EDGE.right, v);
  pen.stroke();
  pen.fillStyle = palette.quiet;
  pen.textAlign = "center";
  pen.textBaseline = "top";
  // The unit stands at the end of its axis, in place of a label that it would meet.
  const unit = scaled(below.power, x.unit), free = width - pen.measureText(unit).width - 10;
  let taken = 0;
  for (const v of across) {
    const text = below.of(v), half = pen.measureText(text).width / 2;
    if (X(v) + half > free || X(v) - half < taken) continue;
    pen.fillText(text, X(v), height - EDGE.bottom + 5);
    taken = X(v) + half + 6;
  }
  pen.textAlign = "right";
  pen.fillText(unit, width - 2, height - EDGE.bottom + 5);
  pen.textBaseline = "middle";
  for (const v of upright) pen.fillText(beside.of(v), left - 5, Y(v));
  pen.textAlign = "left";
  pen.textBaseline = "top";
  pen.fillText(scaled(beside.power, y.unit), 4, 1);
  drawing.left = left;
  return { X, Y };
}

function clipped({ pen, width, height, left }, paint) {
  pen.save();
  pen.beginPath();
  pen.rect(left, EDGE.top - 5, width - left - EDGE.right + 5, height - EDGE.top - EDGE.bottom + 10);
  pen.clip();
  pen.lineJoin = pen.lineCap = "round";
  paint();
  pen.restore();
}

// A curve through values at instants; what is no number is a gap.
function strokeColumn(pen, curve, column, X, Y) {
  pen.strokeStyle = palette[curve.color];
  pen.lineWidth = curve.width ?? 1.6;
  pen.setLineDash([[], [7, 4], [2, 3]][(curve.dash ?? 0) % 3]);
  pen.beginPath();
  let down = false;
  column.forEach((v, k) => {
    if (!Number.isFinite(v)) { down = false; return; }
    if (down) pen.lineTo(X(k), Y(v)); else pen.moveTo(X(k), Y(v));
    down = true;
  });
  pen.stroke();
  pen.setLineDash([]);
}
