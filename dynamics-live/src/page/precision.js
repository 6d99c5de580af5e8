// Error against cost: every method at several accuracies from the present start, beside a reference, computed
// a few milliseconds in each frame.
"use strict";
const TINTS = { euler: "quiet", rk4: "green", dp5: "blue", dop853: "purple", midpoint: "amber" };
const TOLERANCES = [1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13];
const STEPS = [0.05, 0.02, 0.01, 0.005, 0.002, 0.001];   // parts of the pace
// Most evaluations of a run, and of a reference. One that needs more gives way to the implicit method, and
// where that does not get there either, the horizon is shortened.
const MOST_EVALUATIONS = 5e4, MOST_OF_REFERENCE = 3e5;
const SETTLING = 250;           // milliseconds without a change before the runs begin
const compared = Object.keys(METHODS).filter((id) => !METHODS[id].teaching);

class Precision {
  constructor(canvas, player) {
    Object.assign(this, { canvas, player, shadow: new Motion(PROGRAMS, MODEL), hits: [] });
    this.stale();
  }
  stale() {
    Object.assign(this, { jobs: [], wanted: true, since: performance.now(), span: undefined, stiff: false });
    Object.assign(this, { runs: [], reference: null, band: 0, words: "", shortened: 0, running: false });
  }
  get busy() { return this.wanted || this.jobs.length > 0; }
  plan() {
    const { player } = this, { t, q, u, m } = player.start;
    this.wanted = false;
    this.start = { t, q: Float64Array.from(q), u: Float64Array.from(u), m: Array.from(m) };
    this.span ??= Math.min(5 * player.pace, player.end - t);
    const best = this.stiff ? "midpoint" : "dop853";
    const accuracies = this.stiff ? [this.span / 8000, this.span / 4000] : [1e-14, 1e-13];
    this.jobs = accuracies.map((accuracy) => ({ method: best, accuracy, reference: true }));
    const steps = STEPS.map((h) => Number((h * player.pace).toPrecision(3)));
    for (const method of compared) {
      for (const accuracy of METHODS[method].fixed ? steps : TOLERANCES) this.jobs.push({ method, accuracy });
    }
  }
  begin() {
    const { shadow, player } = this, { t, q, u, m } = this.start;
    shadow.p.set(player.motion.p);
    const refusal = shadow.refresh() ?? shadow.start(t, q, u, player.w, m);
    shadow.evaluations = 0;
    this.running = true;
    return !refusal;
  }
  // Works until `deadline`; true where there is something new to draw.
  work(deadline) {
    if (this.wanted) {
      if (performance.now() - this.since < SETTLING || this.player.held) return false;
      this.plan();
    }
    let news = false;
    while (this.jobs.length && performance.now() < deadline) {
      const [job] = this.jobs, { shadow } = this, end = this.start.t + this.span;
      const most = job.reference ? MOST_OF_REFERENCE : MOST_EVALUATIONS;
      let fine = this.running || this.begin();
      while (fine && shadow.t < end && shadow.evaluations < most && performance.now() < deadline) {
        fine = shadow.step(job.method, job.accuracy, end);
      }
      if (fine && shadow.t < end && shadow.evaluations < most) return news;
      this.running = false;
      this.jobs.shift();
      this.finish(job, fine && shadow.t >= end, fine);
      news = true;
    }
    return news;
  }
  finish(job, done, fine) {
    const { shadow } = this, cost = shadow.evaluations, state = Float64Array.from(shadow.q);
    if (!job.reference) this.runs.push({ ...job, cost, error: done ? this.distance(state) : Infinity });
    else if (done && this.reference) this.band = Math.max(this.distance(state), 1e-16 * this.size());
    else if (done) this.reference = state;
    else if (fine && !this.stiff && METHODS.midpoint) this.restart({ stiff: true });
    else this.shorten(shadow.t - this.start.t);
  }
  restart(change) {
    Object.assign(this, { reference: null, band: 0, runs: [] }, change);
    this.plan();
  }
  // The horizon ends where the reference did, rounded down; without any way there is nothing to compare.
  shorten(reached) {
    const span = reached > 0 ? roundStep(0.2 * reached) : 0;
    if (span > 1e-9 * this.player.pace && this.shortened < 4) {
      this.restart({ span, shortened: this.shortened + 1 });
      return;
    }
    this.jobs = [];
    this.words = "no reference can be computed from here";
  }
  // Coordinates of one unit are compared in it, others by their size.
  get unit() {
    const [{ unit }] = MODEL.coordinates;
    return MODEL.coordinates.every((coordinate) => coordinate.unit === unit) ? unit : null;
  }
  distance(state) {
    const whole = this.unit === null;
    let most = 0;
    for (let i = 0; i < N; i++) {
      const size = whole ? Math.max(Math.abs(this.reference[i]), Math.abs(this.start.q[i])) || 1 : 1;
      const off = Math.abs(state[i] - this.reference[i]) / size;
      most = Number.isNaN(off) ? Infinity : Math.max(most, off);
    }
    return most;
  }
  size() { return this.unit === null ? 1 : Math.max(...Array.from(this.reference, Math.abs), 1e-300); }

  draw() {
    const drawing = prepare(this.canvas), { pen, width, height } = drawing;
    if (!(width > 1)) return;
    this.hits = [];
    const { x, y } = this.ranges(), place = drawAxes(drawing, x, y);
    pen.fillStyle = palette.quiet;
    if (this.words) { pen.textAlign = "center"; pen.fillText(this.words, width / 2, height / 2); return; }
    clipped(drawing, () => {
      if (this.band) {
        const top = place.Y(Math.log10(this.band));
        pen.fillStyle = palette.rule;
        pen.fillRect(drawing.left, top, width, height);
      }
      for (const method of compared) this.drawMethod(pen, method, place, y);
    });
  }
  ranges() {
    const finite = this.runs.filter(({ error }) => error > 0 && Number.isFinite(error));
    const costs = finite.map(({ cost }) => Math.log10(cost));
    const errors = finite.map(({ error }) => Math.log10(error));
    const bottom = this.band ? Math.log10(this.band) : -14;
    const top = Math.min(bottom + 20, Math.max(bottom + 10, ...errors));
    const every = (lo, hi, step) => {
      const marks = [];
      for (let k = Math.ceil(lo / step) * step; k <= hi; k += step) marks.push(k);
      return marks;
    };
    const axis = (lo, hi, step, unit) => ({ lo, hi, unit, marks: every(lo, hi, step), label: powerOfTen });
    return {
      x: axis(Math.min(1.6, ...costs) - 0.2, Math.max(4.6, ...costs) + 0.2, 1, "evaluations"),
      y: axis(bottom - 1, top + 1, 3, this.unit ?? "relative"),
    };
  }
  drawMethod(pen, method, { X, Y }, y) {
    const runs = this.runs.filter((run) => run.method === method).map((run) => {
      const failed = !Number.isFinite(run.error);
      const error = clamp(Math.log10(run.error), y.lo + 0.3, y.hi - 0.3);
      return { ...run, failed, X: X(Math.log10(Math.max(run.cost, 1))), Y: Y(error) };
    });
    const chosen = method === this.player.method, mine = chosen ? this.nearest(method) : null;
    pen.strokeStyle = pen.fillStyle = palette[TINTS[method] ?? "teal"];
    pen.lineWidth = chosen ? 2.5 : 1.5;
    pen.beginPath();
    for (const run of runs) if (!run.failed) pen.lineTo(run.X, run.Y);
    pen.stroke();
    for (const run of runs) {
      this.hits.push(run);
      this.drawRun(pen, run, run.accuracy === mine);
    }
  }
  // A cross for a run that failed; hollow where the reference itself is not known better.
  drawRun(pen, run, mine) {
    pen.beginPath();
    if (run.failed) {
      for (const side of [-4, 4]) {
        pen.moveTo(run.X - 4, run.Y - side);
        pen.lineTo(run.X + 4, run.Y + side);
      }
      pen.stroke();
      return;
    }
    pen.arc(run.X, run.Y, mine ? 5.5 : 3.5, 0, 2 * Math.PI);
    const own = pen.fillStyle;
    if (run.error <= this.band) pen.fillStyle = palette.panel;
    pen.fill();
    pen.fillStyle = own;
    pen.lineWidth = mine ? 2 : 1.5;
    if (mine) pen.strokeStyle = palette.ink;
    pen.stroke();
    pen.strokeStyle = own;
  }
  nearest(method) {
    const apart = ({ accuracy }) => Math.abs(Math.log(accuracy / this.player.accuracy));
    const runs = this.runs.filter((run) => run.method === method).sort((a, b) => apart(a) - apart(b));
    return runs[0]?.accuracy;
  }
  // The run under a finger, or undefined.
  runAt(x, y) {
    const apart = (run) => Math.hypot(run.X - x, run.Y - y);
    const [best] = this.hits.slice().sort((a, b) => apart(a) - apart(b));
    return best && apart(best) < 30 ? best : undefined;
  }
}
