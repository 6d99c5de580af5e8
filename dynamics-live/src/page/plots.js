// Plots: quantities over time, and the phase plane.
"use strict";
const WINDOW = 12 * RATE;   // instants in a plot over time: twelve seconds of playing
const HUES = ["blue", "amber", "green", "purple", "red", "teal", "brown", "pink"];

// Curves over time: { color, width, of: (instant) => value }. The axis glides to the range of what is seen.
class TimePlot {
  constructor(canvas, player, curves, unit, least = 1e-6) {
    Object.assign(this, { canvas, player, curves, unit, least, range: null });
  }

  draw() {
    const drawing = prepare(this.canvas), { player, curves } = this;
    if (!(drawing.width > 1)) return;
    const end = Math.max(player.head, player.first + WINDOW);
    const from = Math.max(player.first, Math.floor(end - WINDOW));
    const to = Math.min(player.last, Math.ceil(player.head));
    const values = curves.map(({ of }) => {
      const column = new Float64Array(Math.max(0, to - from + 1));
      for (let k = from; k <= to; k++) column[k - from] = of(player.instant(k));
      return column;
    });
    const { lo, hi } = this.follow(values);
    const x = { lo: player.time(end - WINDOW), hi: player.time(end), unit: "s" };
    const { X, Y } = drawAxes(drawing, x, { lo, hi, unit: this.unit, ...this.axis });
    clipped(drawing, () => {
      this.markEvents(drawing.pen, X, x);
      const across = (k) => X(player.time(from + k));
      curves.forEach((curve, i) => strokeColumn(drawing.pen, curve, values[i], across, Y));
    });
  }
  // Events: a sign at the upper edge each.
  markEvents(pen, X, x) {
    pen.strokeStyle = palette.quiet;
    pen.lineWidth = 1;
    pen.beginPath();
    for (const { t } of this.player.events) {
      if (t >= x.lo && t <= x.hi) { pen.moveTo(X(t), EDGE.top - 4); pen.lineTo(X(t), EDGE.top + 5); }
    }
    pen.stroke();
  }
  follow(values) {
    let lo = Infinity, hi = -Infinity;
    for (const column of values) {
      for (const v of column) {
        if (!Number.isFinite(v)) continue;
        lo = Math.min(lo, v);
        hi = Math.max(hi, v);
      }
    }
    if (!(lo <= hi)) [lo, hi] = [-1, 1];
    // What changes by rounding alone stands still.
    const least = this.least * Math.max(Math.abs(lo), Math.abs(hi));
    if (!(hi - lo > least)) { const half = Math.abs(lo) / 2 || 1; lo -= half; hi += half; }
    const room = 0.06 * (hi - lo), goal = { lo: lo - room, hi: hi + room }, { range } = this;
    const far = !range || lo < range.lo || hi > range.hi || range.hi - range.lo > 8 * (hi - lo);
    const glide = (side) => range[side] + 0.15 * (goal[side] - range[side]);
    this.range = far ? goal : { lo: glide("lo"), hi: glide("hi") };
    return this.range;
  }
}

// The largest residual on an axis of powers of ten.
class ResidualPlot extends TimePlot {
  constructor(canvas, player) {
    const of = ({ residual }) => Math.log10(Math.max(residual, 1e-17));
    super(canvas, player, [{ color: "green", of }], "");
    this.axis = { marks: [-16, -12, -8, -4, 0], label: powerOfTen };
  }
  follow() { return { lo: -17, hi: 1 }; }
}

// Velocity over coordinate; of angles that repeat, one turn.
class PhasePlot {
  constructor(canvas, player) {
    Object.assign(this, { canvas, player, which: MODEL.phase ?? 0, range: null });
  }
  choose(which) { this.which = which; this.range = null; }
  forget() { this.range = null; }

  draw() {
    const drawing = prepare(this.canvas), { player, which: i } = this, coordinate = MODEL.coordinates[i];
    if (!(drawing.width > 1)) return;
    const turn = 2 * Math.PI, wrap = player.repeats[i] ? (v) => v - turn * Math.round(v / turn) : (v) => v;
    const to = Math.min(Math.floor(player.head), player.last), from = Math.max(player.first, to - 30 * RATE);
    const range = this.follow(i, from, to, wrap), full = player.repeats[i] && range.far > 1.5;
    const quarters = [-2, -1, 0, 1, 2].map((k) => k * Math.PI / 2);
    const x = full ? { lo: -Math.PI, hi: Math.PI, marks: quarters, label: partOfPi, unit: "rad" }
      : { lo: range.x[0], hi: range.x[1], unit: coordinate.unit };
    const { X, Y } = drawAxes(drawing, x, { lo: -range.most, hi: range.most, unit: rateUnit(coordinate) });
    const { pen } = drawing, now = player.now;
    clipped(drawing, () => {
      pen.strokeStyle = palette.purple;
      pen.lineWidth = 1.4;
      // Twelve parts, the older the fainter.
      for (let part = 0; part < 12; part++) {
        const at = (share) => from + Math.floor((to - from) * share / 12);
        pen.globalAlpha = 0.18 + 0.7 * ((part + 1) / 12) ** 2;
        this.stroke(pen, i, at(part), at(part + 1), wrap, X, Y);
      }
      pen.globalAlpha = 1;
      pen.fillStyle = palette.red;
      pen.beginPath();
      pen.arc(X(wrap(now[i])), Y(now[N + i]), 4.5, 0, 2 * Math.PI);
      pen.fill();
    });
  }
  stroke(pen, i, from, to, wrap, X, Y) {
    pen.beginPath();
    let last = null;
    for (let k = from; k <= to; k++) {
      const { y } = this.player.instant(k), v = wrap(y[i]);
      if (last === null || Math.abs(v - last) > Math.PI && wrap(4) !== 4) pen.moveTo(X(v), Y(y[N + i]));
      else pen.lineTo(X(v), Y(y[N + i]));
      last = v;
    }
    pen.stroke();
  }
  // The range only grows until another start is taken.
  follow(i, from, to, wrap) {
    const range = (this.range ??= { lo: Infinity, hi: -Infinity, speed: 0, far: 0, seen: -1 });
    for (let k = Math.max(from, range.seen + 1); k <= to; k++) {
      const { y } = this.player.instant(k), v = wrap(y[i]);
      range.lo = Math.min(range.lo, v);
      range.hi = Math.max(range.hi, v);
      range.far = Math.max(range.far, Math.abs(v));
      range.speed = Math.max(range.speed, Math.abs(y[N + i]));
      range.seen = k;
    }
    let { lo, hi } = range;
    if (!(hi > lo)) { const half = Math.abs(lo) || 1; lo -= half; hi += half; }
    const room = 0.08 * (hi - lo);
    range.x = [lo - room, hi + room];
    range.most = 1.15 * range.speed || 1;
    return range;
  }
}
const partOfPi = (v) => ["−π", "−π/2", "0", "π/2", "π"][Math.round(2 * v / Math.PI) + 2];
