// Events of a motion: zero crossings on the interpolant of a step, contacts, sticking and slipping, stops.
//
// A unilateral constraint has one function that is positive while it stays as it is, and it switches where
// that falls through zero, as `dynamics-runtime/src/simulate/events/unilateral.rs` has it:
//
// | constraint | while it holds | while it is released |
// |---|---|---|
// | contact | λ: lifts off | Φ: impact, rebound or hold |
// | stick–slip | the breakaway event: slips | ±(A q̇ + b) on the side to which it slips: sticks |
//
// A crossing is located on the interpolant. The step is then made again to end there, corrected by secants,
// so that the end is that of the method and not of its interpolant.

/** Rounding error of an event function, in parts of its size. */
const EVENT_ROUNDING = 4 * Number.EPSILON;
/** Most events that are kept; the oldest are dropped. */
const MOST_EVENTS_KEPT = 10000;
/** Times in a row that actions may happen at one instant. */
const MAX_ACTIONS_AT_ONE_INSTANT = 16;
/**
 * Largest value in a step of a unilateral constraint that others hold at zero. Above it a function that does
 * not leave zero regularly moves.
 */
const AT_REST_VALUE = 1e-11;
/** Values up to this part of the largest one in the step are zero at a state that an action left. */
const AT_ZERO = 1e-13;
/** First part of a step at which a function is looked at that leaves zero; the last one. */
const FIRST_THETA = 1 / 35184372088832,
  LAST_THETA = 0.125;

Object.assign(FAILURES, {
  event_repeats: ({ name, contact }) =>
    `event \`${name}\` happens again at once, without end; ${remedy_for_repetition(contact)}`,
  event_not_a_number: ({ name }) => `the function of event \`${name}\` is not a number`,
  stopped: ({ name, t }) => `the motion ends at event \`${name}\`, t = ${rounded(t)}`,
});

/** What helps where a unilateral constraint switches without end. */
function remedy_for_repetition(contact) {
  return contact === undefined
    ? `it neither sticks nor slips: let it break away at no less than the friction with which it slips`
    : `give \`.contact("${contact}", ..)\` a larger \`rest_speed\`, below which it closes instead of ` +
        `rebounding`;
}

class EventLocator {
  constructor(motion) {
    const { model, system } = motion;
    this.motion = motion;
    // The program may have more results: pivots of the accelerations that events read.
    const named = system.has("events") ? (model.events ?? []) : [],
      rows = model.rows ?? [];
    this.model_events = named.length;
    this.stops = new Map((model.stops ?? []).map((stop) => [stop.event ?? stop, stop.direction ?? 0]));
    this.names = named.map(({ name }) => name);
    const unilateral =
      (kind) =>
      ({ row, event, restitution, rest_speed }) => ({
        kind,
        row,
        event,
        mode: system.row_mode[row],
        restitution: restitution ?? 0,
        rest_speed: rest_speed ?? null,
        fastest_hit: 0,
        last_side: 1,
        lifted_at: NaN,
        grazes_until: -Infinity,
        /** The reaction a little after the instant at which sticking breaks away. */
        reaction_ahead: null,
      });
    this.unilaterals = [
      ...(model.contacts ?? []).map(unilateral("contact")),
      ...(model.stick_slip ?? []).map(unilateral("slip")),
    ];
    for (const { row, kind } of this.unilaterals)
      this.names.push(`${rows[row]?.name ?? `row ${row}`} ${kind}`);
    this.rules = this.unilaterals.length > 0 ? new UnilateralRules(motion, this.unilaterals) : null;
    this.count = this.names.length;
    this.values = new Float64Array(this.count);
    /** The signs of the functions; 0 where one is zero and has to be seen to leave it. */
    this.signs = new Float64Array(this.count);
    this.zeno = [];
    this.out = new Float64Array(2 * motion.n);
    this.at_one_instant = 0;
    this.last_action = NaN;
  }

  // ---- values

  is_held({ mode }) {
    return this.motion.m[mode] === 0;
  }

  /** Values of all functions at a state with its q̈ and λ. */
  evaluate(t, q, u, a, l, values = this.values) {
    const { system } = this.motion;
    const own = system.value("events", t, q, u, a, l);
    for (let i = 0; i < this.model_events; i++) values[i] = own[i];
    this.unilaterals.forEach((one, k) => {
      const { kind, row, event, mode } = one;
      let value;
      if (kind === "contact") {
        value = this.is_held(one) ? l[row] : system.value("residual", t, q, u)[row];
        if (this.is_held(one) && t <= one.grazes_until) value = Math.abs(value) + Number.MIN_VALUE;
      } else {
        value = this.is_held(one)
          ? own[event]
          : system.value("velocity_residual", t, q, u)[row] * this.motion.m[mode];
      }
      values[this.model_events + k] = value;
    });
    return values;
  }

  /** The same at the present state. */
  evaluate_here(values) {
    const { t, q, u, a, l } = this.motion;
    return this.evaluate(t, q, u, a, l, values);
  }

  /** The same at a part of the last step. */
  evaluate_within(theta, values) {
    const { motion } = this,
      { n } = motion;
    if (theta >= 1) return this.evaluate_here(values);
    const { from } = motion;
    if (theta <= 0) return this.evaluate(from.t, from.q, from.u, from.a, from.l, values);
    const t = motion.t0 + theta * (motion.t - motion.t0);
    motion.at(t, this.out);
    const q = this.out.subarray(0, n),
      u = this.out.subarray(n),
      [a, l] = motion.solve_at(t, q, u);
    return this.evaluate(t, q, u, a, l, values);
  }

  /** Whether no contact is open on the side where it is not free. */
  check_gaps(t, q, u) {
    const { system } = this.motion;
    for (const one of this.unilaterals) {
      if (one.kind !== "contact" || this.is_held(one)) continue;
      const residual = system.value("residual", t, q, u)[one.row];
      if (residual < 0 && system.constraints.is_missed(t, q, u, one.row, residual, CONSISTENT))
        return system.fail({ kind: "penetration", row: one.row, residual });
    }
    return true;
  }

  /** The motion starts at the present state. */
  start() {
    if (this.count === 0) return;
    for (const one of this.unilaterals) {
      [one.fastest_hit, one.last_side] = [0, 1];
      [one.lifted_at, one.grazes_until, one.reaction_ahead] = [NaN, -Infinity, null];
    }
    this.zeno = this.unilaterals.map(() => new Zeno());
    this.sizes = new Float64Array(this.count);
    this.found = { passive: [], acting: null };
    [this.at_one_instant, this.last_action] = [0, NaN];
    this.motion.jumped = null;
    this.evaluate_here();
    for (let i = 0; i < this.count; i++) this.signs[i] = sign_of(this.values[i]);
    this.unilaterals.forEach((one, k) => {
      const i = this.model_events + k;
      // A closed contact that would pull, and an open one at zero up to rounding, decide in the first step.
      if (this.values[i] < 0) this.signs[i] = 0;
    });
    this.pending = this.unilaterals.some(
      (one, k) => this.is_held(one) && this.values[this.model_events + k] < 0,
    );
  }

  // ---- crossings of a step

  /** Finds the events of the step just made, which ends at the first one that acts. False where it fails. */
  end_step() {
    this.found = { passive: [], acting: null };
    if (this.count === 0) return true;
    const { motion } = this;
    motion.jumped = null;
    if (this.pending) {
      // The start itself cannot stay as it is.
      motion.undo();
      this.found.acting = [];
      return true;
    }
    const found = this.scan();
    if (found === null) return false;
    const at = found.findIndex((crossing) => this.acts(crossing)),
      time = ({ index, theta, direction }) => ({ index, direction, t: this.time_of(theta) });
    if (at < 0) {
      this.found.passive = found.map(time);
      return true;
    }
    const first = found[at],
      passive = found.slice(0, at).map(time);
    if (this.end_at(first) === null) return false;
    this.found.passive = passive.map((event) => ({ ...event, t: Math.min(event.t, motion.t) }));
    // Everything that crosses at this instant acts together.
    this.found.acting = found.filter(
      (crossing) => this.acts(crossing) && Math.abs(crossing.theta - first.theta) <= 1e-9,
    );
    return true;
  }

  /** Tells the events of the step, and applies the actions at its end. False where the motion ends. */
  act_at_end() {
    const { passive, acting } = this.found;
    for (const { index, t, direction } of passive) this.record(index, t, direction, "event");
    if (acting !== null) {
      this.pending = false;
      return this.act(acting);
    }
    if (this.count > 0) this.signs.set(this.signs_at_end);
    return true;
  }

  time_of(theta) {
    return this.motion.t0 + theta * (this.motion.t - this.motion.t0);
  }

  acts({ index, direction }) {
    if (index >= this.model_events) return direction < 0;
    const wanted = this.stops.get(index);
    return wanted !== undefined && (wanted === 0 || wanted === direction);
  }

  /** The crossings of the last step up to the first one that acts, in order; null where a function is NaN. */
  scan() {
    const { motion, count } = this,
      { panels } = motion.plan.method;
    const thetas = Array.from({ length: panels + 1 }, (_, part) => sample_position(part, panels));
    const samples = thetas.map((theta) => this.evaluate_within(theta, new Float64Array(count)));
    const scratch = new Float64Array(count),
      found = [];
    this.signs_at_end = this.signs.slice();
    this.sizes = new Float64Array(count);
    for (let i = 0; i < count; i++) {
      for (const values of samples) this.sizes[i] = Math.max(this.sizes[i], Math.abs(values[i]));
      const g = (theta) => this.evaluate_within(theta, scratch)[i];
      let column = thetas.map((theta, k) => [theta, samples[k][i]]),
        sign = this.signs[i];
      if (column.some(([, value]) => Number.isNaN(value))) {
        motion.system.fail({ kind: "event_not_a_number", name: this.names[i] });
        return null;
      }
      if (sign === 0) {
        const start = this.departure(i, column[0][1], g);
        if (start.crossing) found.push({ index: i, theta: 0, direction: -1 });
        sign = start.sign;
        if (start.theta > 0)
          column = [[start.theta, start.value], ...column.filter(([theta]) => theta > start.theta)];
      }
      for (const [theta, direction] of follow(refined(column, g), sign, g))
        found.push({ index: i, theta, direction });
      this.signs_at_end[i] = sign_of(column[column.length - 1][1]) || sign;
    }
    found.sort((a, b) => a.theta - b.theta);
    return found;
  }

  /** How a function leaves zero at the start of a step. */
  departure(index, start, g) {
    const unilateral = index >= this.model_events,
      noise = this.rounding_near_start(this.is_open_gap(index));
    const found = departure_from_zero(start, noise, g);
    if (found.kind === "seen") {
      const crossing = unilateral && found.value < 0,
        one = this.unilateral(index);
      if (crossing && one.kind === "slip" && this.is_held(one)) {
        g(found.theta);
        one.reaction_ahead = this.motion.other_l[one.row];
      }
      return {
        crossing,
        sign: crossing ? 0 : Math.sign(found.value),
        theta: found.theta,
        value: found.value,
      };
    }
    if (unilateral && found.kind === "hidden") return { crossing: found.sign > 0, sign: 0, theta: 0 };
    // It does not leave zero regularly: an open contact falls where it is seen below zero.
    return { crossing: false, sign: unilateral && this.sizes[index] > AT_REST_VALUE ? 1 : 0, theta: 0 };
  }

  /** Rounding error of a function near the start of the last step. A gap depends on positions alone. */
  rounding_near_start(is_gap) {
    const { from } = this.motion,
      t = Math.abs(from.t),
      [q, u, a] = [max_abs(from.q), max_abs(from.u), max_abs(from.a)];
    return EVENT_ROUNDING * (is_gap ? q + t * u : q + u + t * Math.max(u, a));
  }

  /**
   * Makes the last step again to end at a crossing. Returns the part of the step, 0 where the motion then
   * stands at its start; null where it fails.
   */
  end_at({ index, theta }) {
    const { motion } = this,
      from = motion.t0,
      h = motion.t - from,
      values = new Float64Array(this.count);
    const g = (x) => this.evaluate_within(x, values)[index];
    const near = Math.max(theta - 1e-4, 0),
      far = Math.min(theta + 1e-4, 1);
    let slope = (g(far) - g(near)) / (far - near),
      best = null,
      last = null,
      current = 1;
    motion.undo();
    if (theta <= 0 || from + theta * h === from) return 0;
    for (let trial = 0; trial < 4; trial++) {
      if (trial > 0) motion.undo();
      if (!motion.repeat(from + theta * h)) {
        if (best === null) return null;
        current = NaN;
        break;
      }
      current = theta;
      const miss = this.evaluate_here(values)[index];
      if (best === null || Math.abs(miss) < Math.abs(best.miss)) best = { theta, miss };
      if (last !== null && theta !== last.theta) slope = (miss - last.miss) / (theta - last.theta);
      last = { theta, miss };
      const better = theta - miss / slope;
      if (!(better > 0 && better <= 1) || Math.abs(better - theta) <= CROSSING_RESOLUTION) break;
      theta = better;
    }
    if (current !== best.theta) {
      if (!Number.isNaN(current)) motion.undo();
      if (!motion.repeat(from + best.theta * h)) return null;
    }
    return best.theta;
  }

  // ---- actions

  /** Applies the actions of crossings at the present state, and goes on from the state that they leave. */
  act(crossings) {
    const { motion } = this,
      { system } = motion,
      energy = new Float64Array(3);
    if (motion.t === this.last_action) this.at_one_instant++;
    else [this.at_one_instant, this.last_action] = [0, motion.t];
    const stop = crossings.find(({ index }) => index < this.model_events);
    const before = motion.energies(energy)[2],
      jumped = this.copy_end(),
      fired = new Set(crossings.map(({ index }) => index));
    const values = new Float64Array(this.count),
      instant = this.copy_instant(),
      speeds = this.speeds_of_hits(crossings);
    if (this.at_one_instant >= MAX_ACTIONS_AT_ONE_INSTANT)
      return this.repeats(crossings[0]?.index ?? this.model_events);
    for (const { index, direction } of crossings) {
      if (index < this.model_events) this.record(index, motion.t, direction, "stop");
      else if (!this.act_on(index, instant)) return false;
    }
    // Constraints that cannot stay as they are switch, too: contacts that would pull, sticking that breaks
    // away.
    const most = 2 * this.unilaterals.length;
    for (let turn = 0; this.unilaterals.length > 0; turn++) {
      this.evaluate_here(values);
      const untenable = this.unilaterals.findIndex(
        (one, k) =>
          this.is_held(one) &&
          values[this.model_events + k] < 0 &&
          !(Math.abs(values[this.model_events + k]) <= AT_ZERO * this.sizes[this.model_events + k]),
      );
      if (untenable < 0) break;
      if (turn >= most) return this.repeats(this.model_events + untenable);
      fired.add(this.model_events + untenable);
      if (!this.act_on(this.model_events + untenable, this.copy_instant())) return false;
    }
    motion.jumped = jumped;
    motion.switching.restart();
    motion.work += motion.energies(energy)[2] - before || 0;
    const h = motion.t - motion.t0;
    if (motion.plan !== null) {
      [motion.plan.origin, motion.plan.count] = [motion.t, 0];
      motion.plan.controller?.restart();
    }
    this.evaluate_here(values);
    for (let i = 0; i < this.count; i++) {
      const switched =
        i >= this.model_events &&
        (fired.has(i) || motion.m[this.unilateral(i).mode] !== instant.m[this.unilateral(i).mode]);
      this.signs[i] = this.sign_after_action(i, values[i], fired.has(i), switched);
    }
    if (stop !== undefined) {
      motion.ended = true;
      motion.reason = system.words({ kind: "stopped", name: this.names[stop.index], t: motion.t });
    }
    return this.note_hits(speeds, h);
  }

  /** Switches a unilateral constraint, and makes the state consistent. False where that fails. */
  act_on(index, instant) {
    const { motion } = this,
      modes = motion.m.slice(),
      what = this.rules.switch(this.unilateral(index), instant);
    if (what === null) return false;
    if (what !== "") this.record(index, motion.t, -1, what);
    motion.slips.align(modes);
    return this.settle();
  }

  /** The sign of a function at a state that an action left; 0 where it has to be seen to leave zero. */
  sign_after_action(index, value, fired, switched) {
    const one = this.unilateral(index),
      size = this.sizes[index],
      at_zero = Math.abs(value) <= AT_ZERO * size;
    // A constraint that slips to the other side since a jump is away from zero.
    if (one?.kind === "slip" && !this.is_held(one) && value > CONSISTENT * size) return 1;
    return fired || at_zero || (switched && this.is_open_gap(index)) ? 0 : sign_of(value);
  }

  /** The functions of unilateral constraints that cross zero, with the speed |Φ̇| of contacts. */
  speeds_of_hits(crossings) {
    const { t, q, u, system } = this.motion,
      own = crossings.filter(({ index }) => index >= this.model_events);
    const rates = own.length > 0 ? system.value("velocity_residual", t, q, u).slice() : [];
    const speed = ({ kind, row }) => (kind === "contact" ? Math.abs(rates[row]) : 0);
    return new Map(own.map(({ index }) => [index - this.model_events, speed(this.unilateral(index))]));
  }

  /** Fails where the events of a unilateral constraint accumulate. */
  note_hits(speeds, h) {
    const { motion } = this;
    for (let k = 0; k < this.unilaterals.length; k++) {
      const one = this.unilaterals[k];
      if (one.kind === "contact" && this.is_held(one)) this.zeno[k] = new Zeno();
      const found =
        !speeds.has(k) || (one.kind === "contact" && this.is_held(one))
          ? null
          : this.zeno[k].note_event(motion.t, h, speeds.get(k));
      if (found === null) continue;
      const contact = this.contact_name(one);
      return motion.system.fail({
        kind: "events_accumulate",
        name: this.names[this.model_events + k],
        contact,
        ...found,
      });
    }
    return true;
  }

  /** The name of the constraint of a contact; undefined for sticking. */
  contact_name(one) {
    return one?.kind === "contact" ? this.motion.model.rows[one.row].name : undefined;
  }

  /** What switching at an instant is compared with. */
  copy_instant() {
    return { u: this.motion.u.slice(), m: this.motion.m.slice() };
  }

  unilateral(index) {
    return this.unilaterals[index - this.model_events];
  }

  is_open_gap(index) {
    const one = this.unilateral(index);
    return one?.kind === "contact" && !this.is_held(one);
  }

  /** The end of the last step before an action, for the interpolant. */
  copy_end() {
    const { q, u, a } = this.motion;
    return { q: q.slice(), u: u.slice(), a: a.slice() };
  }

  repeats(index) {
    const contact = this.contact_name(this.unilateral(index));
    return this.motion.system.fail({ kind: "event_repeats", name: this.names[index], contact });
  }

  /** Makes the present state consistent with the constraints that hold, and evaluates it. */
  settle() {
    const { motion } = this,
      { system, t, q, u } = motion;
    system.switch_modes();
    if (motion.r > 0 && !system.constraints.project(t, q, u)) return false;
    return system.accelerate(t, q, u, motion.a, motion.l);
  }

  record(index, t, direction, what) {
    const { events } = this.motion;
    events.push({ index, name: this.names[index], t, direction, what });
    if (events.length > MOST_EVENTS_KEPT) events.splice(0, events.length - MOST_EVENTS_KEPT);
  }
}

/**
 * How a function leaves zero: evaluated at doubling distances until its change grows regularly twice in a
 * row, by 2 with a slope, by more than 3 without. As `dynamics-runtime/src/simulate/events/restart.rs`.
 */
function departure_from_zero(start, noise, g) {
  let last = [0, 0];
  for (let theta = FIRST_THETA; theta <= LAST_THETA;) {
    const value = g(theta),
      change = value - start,
      first = last[1] / last[0],
      second = change / last[1];
    last = [last[1], change];
    const regular = (x) => x >= 1.6 && x < 2.4;
    const slope = regular(first) && regular(second),
      tangent = first > 3 && second > 3 && Number.isFinite(first);
    theta *= 2;
    if (!(slope || tangent) || Math.abs(change) <= noise) continue;
    const sign = Math.sign(change);
    let [at, seen] = [0.5 * theta, value];
    while (!(seen * sign > 0)) {
      at *= 2;
      if (at > LAST_THETA) return { kind: "hidden", sign };
      seen = g(at);
    }
    return { kind: "seen", theta: at, value: seen };
  }
  return { kind: "constant" };
}
