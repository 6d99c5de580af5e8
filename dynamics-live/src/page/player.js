// What moves: the motion, what of it has been recorded, and the instant that is shown. Knows no document.
"use strict";
const N = MODEL.coordinates.length;
const RATE = 60;      // instants recorded per second of playing
// Instants that can be scrubbed through: one minute of playing, less where they would take more than 64 MB.
const KEPT = Math.min(Math.max(Math.floor(2e6 / N), 60), 3600);
const MOST_TURNED = 60;   // coordinates up to which angles that repeat are looked for

const HAS_ENERGY = Boolean(PROGRAMS.energy_function || PROGRAMS.kinetic_energy && PROGRAMS.potential_energy);
const ENERGY_UNIT = MODEL.conserved.find(({ kind }) => /energy/i.test(kind))?.unit
  ?? MODEL.powers.find(({ unit }) => unit)?.unit.replace(/^W$/, "J") ?? "J";
const rateUnit = (coordinate) => (coordinate.unit ? coordinate.unit + "/s" : "1/s");
// The library's name of a velocity: `theta_rate`, of an element `theta_rate[3]`.
const rateName = ({ name }) => name.replace(/^[^[]*/, "$&_rate");

// A time in which coordinates go through their own range, from some steps of a motion; 0 where they rest or
// where `milliseconds` were too few to tell.
function characteristicTime(motion, method, accuracy, milliseconds) {
  const until = performance.now() + milliseconds, begin = motion.t;
  const lo = motion.q.slice(), hi = motion.q.slice(), way = new Float64Array(N);
  const gone = [];
  let last = motion.q.slice(), steps = 0;
  for (; steps < 400 && performance.now() < until; steps++) {
    if (!motion.step(method, accuracy, Infinity)) break;
    const { q } = motion;
    for (let i = 0; i < N; i++) {
      lo[i] = Math.min(lo[i], q[i]);
      hi[i] = Math.max(hi[i], q[i]);
      way[i] += Math.abs(q[i] - last[i]);
    }
    last = q.slice();
    gone.push({ t: motion.t, way: way.slice() });
  }
  const passed = motion.t - begin, size = (i) => Math.max(Math.abs(lo[i]), Math.abs(hi[i]));
  // Until when a coordinate moves; what comes to rest is followed long after that by long steps.
  const moving = (i) => gone.find((then) => then.way[i] >= 0.9 * way[i]).t - begin;
  // Among many nodes, those that move far less than the others count as standing still.
  let least = Infinity, moves = false, noise = 0;
  if (PROGRAMS.family) for (let i = 0; i < N; i++) noise = Math.max(noise, 1e-6 * size(i));
  for (let i = 0; i < N; i++) {
    // Rounding moves what stands still.
    const moved = way[i] > Math.max(1e-6 * size(i), noise);
    moves ||= moved;
    // A coordinate that never turned back tells nothing of its range.
    const range = hi[i] - lo[i];
    if (moved && way[i] > 1.2 * range) least = Math.min(least, range * moving(i) / (0.9 * way[i]));
  }
  if (least < Infinity) return least;
  // What flies off goes ever faster through its steps; only many steps in a short time say that it is fast.
  return moves && steps >= 60 && passed < 0.03 ? passed : 0;
}

// Which angles the model does not tell from those one turn on: an angle against a spring is none.
function repeatingAngles(motion) {
  const names = ["accelerations", "terms", "residual", "potential_energy", "energy_function"];
  if (N > MOST_TURNED) return MODEL.coordinates.map(() => false);
  const { t, u } = motion;
  const values = (q) => names.flatMap((name) => Array.from(motion.system.value(name, t, q, u) ?? []));
  const here = values(motion.q);
  return MODEL.coordinates.map(({ angle }, i) => {
    if (!angle) return false;
    const q = Float64Array.from(motion.q);
    q[i] += 2 * Math.PI;
    const same = (v, w) => Number.isNaN(w) || Math.abs(v - w) <= 1e-7 * (Math.abs(w) + 1);
    return values(q).every((v, k) => same(v, here[k]));
  });
}

// Seconds of the motion in a second of playing: 1 where that can be watched. `length` is that of the motion.
function chosenPace(time, length) {
  if (length < Infinity) return length >= 2 && length <= 120 ? 1 : roundStep(length / 20);
  return !(time > 0) || !Number.isFinite(time) || (time > 0.03 && time < 20) ? 1 : roundStep(time / 4);
}

class Player {
  constructor() {
    this.motion = new Motion(PROGRAMS, MODEL);
    this.speed = 1;
    this.pace = 1;
    this.method = MODEL.method;
    this.accuracy = this.usualAccuracy(this.method);
    this.playing = false;
    this.held = false;        // a finger moves the model
    this.start = null;        // { t, q, u, m }
    this.begun = null;        // where the last step began
    this.w = this.motion.w;
    this.w.forEach((value, i) => { if (Number.isNaN(value)) this.w[i] = 0; });
    this.energies = new Float64Array(3);
    this.channels = channelsOf(this.motion);
    this.now = new Float64Array(2 * N);
    this.listeners = [];
    this.reason = null;
    this.refused = null;      // why there is no motion at all, in words
    this.repeats = MODEL.coordinates.map(() => false);
  }

  // Chooses the pace and finds the angles that repeat, from the present start.
  settlePace(shadow) {
    const { t, q, u, m } = this.start;
    shadow.p.set(this.motion.p);
    if (shadow.refresh() ?? shadow.start(t, q, u, this.w, m)) return;
    this.repeats = repeatingAngles(shadow);
    const { fixed } = METHODS[this.method], open = fixed && MODEL.accuracy === null;
    const accuracy = fixed && !open ? this.accuracy : Math.max(this.accuracy, 1e-6);
    // A step that nobody gave is a part of the pace, which has to be found first.
    const time = open ? characteristicTime(shadow, "dp5", 1e-6, 150)
      : characteristicTime(shadow, this.method, accuracy, 150);
    this.pace = chosenPace(time, this.end - t);
  }
  // The accuracy of a method for which none was chosen.
  usualAccuracy(method, anew = false) {
    if (!anew && method === MODEL.method && MODEL.accuracy !== null) return MODEL.accuracy;
    if (!METHODS[method].fixed) return PROGRAMS.family ? 1e-6 : 1e-8;
    // Half of the longest step, where there is one.
    const longest = this.motion.longest_step?.(method) ?? Infinity;
    return Number(Math.min(0.01 * this.pace, 0.5 * longest).toPrecision(3));
  }
  // The tolerance or the step. A step that is longer than the longest one of the method at the present state
  // and parameters is taken shorter; the one that was wanted comes back as soon as it is short enough.
  get accuracy() { return this.taken; }
  set accuracy(wanted) { this.wanted = this.taken = wanted; }
  limitStep() {
    const { method, wanted } = this;
    const tooLong = METHODS[method].fixed && this.motion.longest_step?.(method) < wanted;
    this.taken = tooLong ? Math.min(wanted, this.usualAccuracy(method, true)) : wanted;
  }

  // `what`: "start", "parameters" or "method", after which nothing that was computed ahead holds.
  changed(what) { for (const listener of this.listeners) listener(what); }
  get dt() { return this.pace / RATE; }
  get last() { return this.first + this.instants.length - 1; }
  time(k = this.head) { return this.start.t + k * this.dt; }
  instant(k) { return this.instants[k - this.first]; }
  // The time up to which the motion is followed. A start that the viewer chose at or after that has as long a
  // motion before it as the model's own.
  get end() {
    const { t } = this.start, end = MODEL.until ?? Infinity;
    return t < end ? end : t + (end - MODEL.starts[0].t);
  }

  // A new start, with inputs where it has some; the text of a refusal, or null. A refused start leaves
  // everything as it was.
  begin(start) {
    const { motion } = this, turn = 2 * Math.PI, before = Float64Array.from(this.w);
    if (start.w) this.w.set(start.w);
    const q = start.q.map((x, i) => (this.repeats[i] ? x - turn * Math.round(x / turn) : x));
    const refusal = this.place(start.t, q, Float64Array.from(start.u), start.m, start.chosen);
    if (refusal) {
      this.w.set(before);
      if (this.start && !this.refused) this.resume();
      return refusal;
    }
    this.refused = null;
    this.limitStep();
    this.start = {
      t: start.t, q: Float64Array.from(motion.q), u: Float64Array.from(motion.u), m: Array.from(motion.m),
    };
    this.instants = [];
    this.first = 0;
    this.head = 0;
    this.events = [];
    this.reason = null;
    this.balance();
    this.record(this.start.t);
    this.changed("start");
    return null;
  }

  // Stands at a start that is refused: nothing moves until there is another one, or other parameters.
  stand({ t, q, u, m }, refusal) {
    this.start = { t, q: Float64Array.from(q), u: Float64Array.from(u), m: Array.from(m) };
    const energy = { T: NaN, V: NaN, E: NaN }, y = Float64Array.from([...q, ...u]);
    const channels = new Float64Array(this.channels.length).fill(NaN);
    const instant = { y, t, begun: null, m: this.start.m, energy, drift: NaN, residual: NaN, channels };
    this.instants = [instant];
    this.first = this.head = this.scale = 0;
    this.events = [];
    this.reason = this.refused = refusal;
    this.onRecord?.(instant);
    this.changed("start");
  }

  // Starts the motion at a state that is first put onto the constraints where it is off them. There a
  // coordinate that was `chosen` keeps its value as nearly as they permit.
  place(t, q, u, m, chosen) {
    const { motion } = this, refusal = motion.start(t, q, u, this.w, m);
    if (!refusal || !MODEL.rows.length) return refusal;
    const { system } = motion, modes = Array.from(motion.m), rest = new Float64Array(N), wanted = q[chosen];
    motion.m.set(m);
    system.switch_modes();
    let placed = true;
    for (let turn = 0; placed && turn < (chosen === undefined ? 1 : 12); turn++) {
      if (turn && Math.abs(q[chosen] - wanted) <= 1e-9 * (1 + Math.abs(wanted))) break;
      if (turn) q[chosen] = wanted;
      placed = system.constraints.project_positions(t, q, rest);
    }
    placed &&= system.constraints.project_velocities(t, q, u);
    const second = placed ? motion.start(t, q, u, this.w, m) : refusal;
    if (second) {
      motion.m.set(modes);
      system.switch_modes();
    }
    return second;
  }

  // The energy account begins anew: drifts count from the energy now.
  balance() {
    const energy = this.energy(this.motion.t, this.motion.q, this.motion.u);
    this.reference = energy.E - this.motion.work;
    this.scale = sizeOf(energy);
  }
  energy(t, q, u) {
    const [T, V, E] = this.motion.energies(this.energies, t, q, u);
    return { T, V, E };
  }

  // Where the motion stands, as `resume` takes it up; `energy` is what it would have there without any error.
  here() {
    const { t, q, u, m, work } = this.motion;
    return { t, q: q.slice(), u: u.slice(), m: Array.from(m), energy: this.reference + work };
  }

  // Records the instant at time `t`, which the last step has reached; `begun` is where that step began.
  record(t, begun = this.here()) {
    const { motion } = this, y = new Float64Array(2 * N);
    if (t < motion.t) motion.at(t, y);
    else { y.set(motion.q); y.set(motion.u, N); }
    const q = y.subarray(0, N), u = y.subarray(N), energy = this.energy(t, q, u);
    // Errors are those of the method at the end of its step, not those of the interpolation.
    const exact = t < motion.t ? this.energy(motion.t, motion.q, motion.u) : energy;
    this.scale = Math.max(this.scale, sizeOf(energy));
    const instant = {
      y, t, begun, m: Array.from(motion.m), energy, drift: exact.E - motion.work - this.reference,
      residual: Math.max(...motion.residual()), channels: null,
    };
    instant.channels = Float64Array.from(this.channels, (channel) => channel.of(instant));
    this.instants.push(instant);
    if (this.instants.length > KEPT) {
      this.instants.shift();
      this.first++;
      const kept = this.events.findIndex((event) => event.t >= this.instants[0].t);
      this.events.splice(0, kept < 0 ? this.events.length : kept);
    }
    this.onRecord?.(instant);
  }
  // One more instant: "more", "late" where `deadline` passed before it was reached, or "ended".
  advance(deadline) {
    const { motion } = this, t = this.time(this.last + 1);
    if (this.reason) return "ended";
    if (t > this.end + 1e-9 * this.dt) {
      this.reason = `the motion was to be followed for ${number(this.end - this.start.t)} s`;
      return "ended";
    }
    // Without errors, as in free flight, steps would grow without end; events are found to parts of a step.
    const end = Math.min(this.end, t + 10 * this.pace);
    while (motion.t < t) {
      this.begun = this.here();
      const before = motion.events[motion.events.length - 1];
      if (!motion.step(this.method, this.accuracy, end)) {
        this.reason = motion.reason || "the motion cannot go on";
        return "ended";
      }
      const seen = motion.events.lastIndexOf(before) + 1;
      this.events.push(...motion.events.slice(seen));
      if (performance.now() > deadline && motion.t < t) return "late";
    }
    this.record(t, this.begun);
    return "more";
  }

  // Goes on from the instant that is shown.
  cut() {
    const k = Math.max(this.first, Math.floor(this.head + 1e-6));
    if (k < this.last) this.resume(k);
  }
  // Puts the motion to a recorded instant; returns what refuses it, or null. The last step before it is made
  // again to end there: a state between steps is interpolated, and not as exact.
  resume(k = this.last) {
    const { y, m, t, begun } = this.instant(k), { motion } = this;
    this.instants.length = k - this.first + 1;
    this.events = this.events.filter((event) => event.t <= t);
    this.head = Math.min(this.head, k);
    let refusal = this.place(begun.t, begun.q.slice(), begun.u.slice(), begun.m), made = !refusal;
    while (made && motion.t < t) made = motion.step(this.method, this.accuracy, t);
    if (!made) refusal = this.place(t, y.slice(0, N), y.slice(N), m);
    this.reason = refusal;
    // Works begin at zero again.
    this.reference = begun.energy;
    this.begun = begun;
    return refusal;
  }

  // Changes parameters, inputs or the method under the motion, which goes on from where it is. What refuses
  // is undone and returned.
  change(what, act) {
    if (this.refused) return this.changeRefused(what, act);
    const k = Math.max(this.first, Math.floor(this.head + 1e-6)), { motion } = this;
    const refused = this.resume(k), p = Float64Array.from(motion.p), w = Float64Array.from(this.w);
    if (refused) return refused;
    act();
    const refusal = what === "method" ? null : motion.refresh();
    if (refusal) {
      motion.p.set(p);
      this.w.set(w);
      motion.refresh();
      this.resume();
      return refusal;
    }
    // The state was put onto the constraints of the new parameters.
    const { t } = this.instants.pop();
    if (what !== "method") {
      this.balance();
      this.fitStart();
    }
    this.limitStep();
    this.record(t);
    this.changed(what);
    return null;
  }

  // The same where the start is refused: other values may be what it needs.
  changeRefused(what, act) {
    act();
    const refusal = this.motion.refresh() ?? this.begin(this.start);
    this.limitStep();
    if (refusal) this.stand(this.start, refusal);
    else this.changed(what);
    return what === "method" ? null : refusal;
  }

  // Puts the start onto the constraints of new parameters, where they permit.
  fitStart() {
    const { constraints } = this.motion.system, { t } = this.start;
    const q = this.start.q.slice(), u = this.start.u.slice();
    if (!MODEL.rows.length || !constraints.project_positions(t, q, u)) return;
    if (constraints.project_velocities(t, q, u)) Object.assign(this.start, { q, u });
  }

  // The state between the two instants about the head.
  show() {
    const k = Math.min(Math.floor(this.head), this.last), part = this.head - k;
    const a = this.instant(k).y, b = this.instant(Math.min(k + 1, this.last)).y;
    for (let i = 0; i < 2 * N; i++) this.now[i] = a[i] + part * (b[i] - a[i]);
    return this.now;
  }
  get shown() { return this.instant(Math.min(Math.round(this.head), this.last)); }
  seek(k) { this.head = Math.max(this.first, Math.min(this.last, k)); }

  // Moves the head by `seconds` of playing and computes what is missing. Returns the part of the way that
  // was reached.
  play(seconds, deadline) {
    const goal = this.head + seconds * this.speed * RATE;
    let state = "more";
    while (this.last < Math.ceil(goal) && state === "more") {
      state = this.advance(deadline);
      if (performance.now() > deadline && this.last < Math.ceil(goal) && state === "more") state = "late";
    }
    const from = this.head;
    this.head = Math.max(this.first, Math.min(goal, this.last));
    return { ended: state === "ended", reached: goal > from ? (this.head - from) / (goal - from) : 1 };
  }
}

// The largest of the energies that are known.
const sizeOf = ({ T, V, E }) => Math.max(...[T, V, E].map((x) => Math.abs(x) || 0));

// What can be plotted over time, by the names of MODEL.plots.
function channelsOf(motion) {
  const known = new Map(), split = ({ t, y }) => [t, y.subarray(0, N), y.subarray(N)];
  const add = (name, unit, of) => known.set(name, { name, unit, of });
  // Of quantities with the same name the last one counts.
  for (const program of ["powers", "conserved", "outputs"]) {
    if (!PROGRAMS[program]) continue;
    MODEL[program].forEach(({ name, unit }, k) =>
      add(name, unit, (instant) => motion.value(program, ...split(instant))[k]));
  }
  MODEL.rows.forEach(({ name, unit }, row) =>
    add(`lambda[${name}]`, unit, (instant) => motion.solve_at(...split(instant))[1][row]));
  add("potential energy", ENERGY_UNIT, ({ energy }) => energy.V);
  add("kinetic energy", ENERGY_UNIT, ({ energy }) => energy.T);
  add("energy", ENERGY_UNIT, ({ energy }) => energy.E);
  MODEL.coordinates.forEach((coordinate, i) => {
    add(rateName(coordinate), rateUnit(coordinate), ({ y }) => y[N + i]);
    add(coordinate.name, coordinate.unit, ({ y }) => y[i]);
  });
  // An index beyond the length of a numbered output has nothing to plot.
  return MODEL.plots.map((name) => known.get(name)).filter(Boolean);
}
