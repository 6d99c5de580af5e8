// One motion of a model: its state, what happens in its steps, and what lies between their ends.

/**
 * So often in a row accelerations are found to lead back to a jump before the motion counts as resting on it.
 */
const MOST_SLIDES = 3;
/** Condition of the constraints above which a failure has a singular position as its cause. */
const SINGULAR_CONDITION = 1e3;

/** What stands in the place of constraints and events where a model has none. */
const NO_CONSTRAINTS = {
  has_positions: false,
  project_positions: () => true,
  project_velocities: () => true,
};
const NO_EVENTS = {
  unilaterals: [],
  start() {},
  end_step: () => true,
  act_at_end: () => true,
  check_gaps: () => true,
};
const NO_SLIPS = { check_step: () => true };

/** Whether a program reads accelerations, by its text. */
function reads_accelerations({ run }) {
  return /\ba\[/.test(String(run));
}

/** Whether a motion has events. */
function has_events({ events = [], contacts = [], stick_slip = [] }) {
  return events.length + contacts.length + stick_slip.length > 0;
}

/** Whether vectors differ by a few roundings of their largest number at most. */
function is_rounding_apart(x, y) {
  const permitted = 16 * Number.EPSILON * Math.max(max_abs(x), 1);
  return x.every((value, i) => Math.abs(value - y[i]) <= permitted);
}

class Motion extends Stepper {
  /** `programs`: what the macro prints; `model`: names, units and values. */
  constructor(programs, model) {
    const system = new System(programs, model);
    system.constraints = system.r > 0 ? new Constraints(system) : NO_CONSTRAINTS;
    super(system);
    this.programs = programs;
    this.model = model;
    this.p = system.p;
    this.w = system.w;
    this.m = system.m;
    this.work_values = new Float64Array(programs.powers?.results ?? 0);
    this.other_a = new Float64Array(this.n);
    this.other_l = new Float64Array(this.r);
    /** The state of `other_a` without constraints; its time is NaN where they are not known. */
    this.other = { t: NaN, q: new Float64Array(this.n), u: new Float64Array(this.n) };
    this.readers = new Set();
    for (const [name, program] of Object.entries(programs)) {
      if (typeof program?.run !== "function") continue;
      if (program.reads_accelerations ?? reads_accelerations(program)) this.readers.add(name);
    }
    this.reason = null;
    this.ended = false;
    this.started = false;
    this.events = [];
    /** The end of the last step before an action at an event changed the state; null where none did. */
    this.jumped = null;
    this.slips = this.r > 0 ? new SlipDirections(this) : NO_SLIPS;
    this.locator = has_events(model) ? new EventLocator(this) : NO_EVENTS;
    this.refused = this.refresh();
  }

  get evaluations() {
    return this.system.evaluations;
  }

  set evaluations(count) {
    this.system.evaluations = count;
  }

  /**
   * Takes new values of parameters and inputs into account. The motion goes on from where it is, put back
   * onto its constraints. Returns null, or why the values are refused; the state is then as before.
   */
  refresh() {
    const { system } = this;
    system.hoist();
    this.other.t = NaN;
    this.plan = null;
    this.reason = null;
    const broken = system.broken_assumption(this.t, this.q, this.u, this.started);
    if (broken !== null) return system.words(broken);
    if (!this.started) return null;
    const q = this.q.slice(),
      u = this.u.slice(),
      m = this.m.slice();
    this.set_sides(this.t, q, u);
    if (this.place(this.t, q, u)) {
      this.q.set(q);
      this.u.set(u);
      this.begin_here();
      return null;
    }
    this.m.set(m);
    return system.words(system.failure);
  }

  /**
   * Starts at a state, which is put onto the constraints to rounding level. Returns null, or why this is no
   * start; the motion is then as before.
   */
  start(t, q, u, w = this.w, m = this.m) {
    const { system } = this,
      old_w = this.w.slice(),
      old_m = this.m.slice();
    const new_q = Float64Array.from(q),
      new_u = Float64Array.from(u);
    this.w.set(w);
    this.m.set(m);
    this.other.t = NaN;
    system.switch_modes();
    const failure =
      this.check_values(t, new_q, new_u) ??
      system.broken_assumption(t, new_q, new_u, true) ??
      (this.set_sides(t, new_q, new_u), this.fits(t, new_q, new_u) ? null : system.failure);
    if (failure !== null) {
      this.w.set(old_w);
      this.m.set(old_m);
      this.other.t = NaN;
      system.switch_modes();
      return system.words(failure);
    }
    this.t = t;
    this.q.set(new_q);
    this.u.set(new_u);
    this.started = true;
    this.ended = false;
    this.reason = null;
    this.work = 0;
    this.steps = 0;
    this.rejected = 0;
    this.evaluations = 0;
    this.events.length = 0;
    this.plan = null;
    this.begin_here();
    this.evaluations++;
    return null;
  }

  /** Whether a state is on the constraints to what is typed, and has accelerations; it is projected then. */
  fits(t, q, u) {
    const { system, r } = this;
    if (r > 0 && !system.constraints.check_start(t, q, u)) return false;
    return this.place(t, q, u);
  }

  /**
   * Puts a state onto the constraints; false where that or its accelerations fail, and where an open contact
   * is on the wrong side.
   */
  place(t, q, u) {
    const { system, n, r } = this;
    system.constraints.mean_sensitivity = 0;
    const a = new Float64Array(n),
      l = new Float64Array(r);
    const placed = (r === 0 || this.project_start(t, q, u)) && system.accelerate(t, q, u, a, l);
    system.evaluations--;
    if (!placed) {
      const { failure } = system;
      return system.fail(
        failure.kind === "branch_undetermined" ? { ...failure, kind: "singular_start" } : failure,
      );
    }
    for (let i = 0; i < n; i++) {
      if (!Number.isFinite(a[i])) return system.fail({ kind: "not_finite", coordinate: i, t, h: 0 });
    }
    if (!this.locator.check_gaps(t, q, u)) return false;
    this.a.set(a);
    this.l.set(l);
    return true;
  }

  /**
   * Projects a start. One that rounding alone would change stays as it is: a page that is opened by its own
   * address finds its start to the last digit.
   */
  project_start(t, q, u) {
    const given_q = q.slice(),
      given_u = u.slice();
    if (!this.system.constraints.project(t, q, u)) return false;
    if (is_rounding_apart(q, given_q) && is_rounding_apart(u, given_u)) {
      q.set(given_q);
      u.set(given_u);
    }
    return true;
  }

  check_values(t, q, u) {
    const { model } = this,
      bad = (what, names, values) => {
        const i = values.findIndex((x) => !Number.isFinite(x));
        return i < 0
          ? null
          : { kind: "state_not_finite", what, name: names[i]?.name ?? "", value: values[i] };
      };
    return (
      bad("time", [{ name: "t" }], [t]) ??
      bad("coordinate", model.coordinates, q) ??
      bad("velocity of", model.coordinates, u) ??
      bad("parameter", model.parameters ?? [], this.p) ??
      bad("input", model.inputs ?? [], this.w)
    );
  }

  /**
   * Released constraints of the velocities go to the side to which they slip, holonomic ones to the positive.
   */
  set_sides(t, q, u) {
    const { system } = this;
    for (let row = 0; row < system.r; row++) {
      const mode = system.row_mode[row];
      if (mode < 0 || this.m[mode] === 0) continue;
      if (row < system.holonomic) continue;
      const slip = system.value("velocity_residual", t, q, u)[row];
      if (Math.abs(slip) > 0) this.m[mode] = slip > 0 ? 1 : -1;
    }
  }

  /** The motion goes on from the present state as from a start: there is no step behind it. */
  begin_here() {
    const { from } = this;
    from.t = this.t0 = this.t;
    from.q.set(this.q);
    from.u.set(this.u);
    from.a.set(this.a);
    from.l.set(this.l);
    this.jumped = null;
    this.switching.restart();
    if (this.plan !== null) {
      this.plan.origin = this.t;
      this.plan.count = 0;
      this.plan.controller?.restart();
    }
    this.locator.start();
  }

  // ---- steps

  /**
   * One accepted step that does not pass `end`. Returns false where the motion cannot go on; `reason` then
   * says why, and the motion stands at the last accepted state.
   */
  step(method, accuracy, end = Infinity) {
    if (this.ended || !this.started) return false;
    this.reason = null;
    if (end === this.t) return true;
    if (this.plan === null || this.plan.method !== METHODS[method] || this.plan.accuracy !== accuracy) {
      this.plan = this.make_plan(METHODS[method], accuracy, end);
    }
    const made =
      this.make_step(end) &&
      this.locator.end_step() &&
      this.slips.check_step() &&
      this.locator.act_at_end() &&
      this.is_ahead();
    if (!made) this.reason = this.system.words(this.explain(this.system.failure));
    return made;
  }

  /**
   * Fails where the motion rests on a jump of its accelerations, to which these lead back from both sides.
   */
  is_ahead() {
    const { slides, jump } = this.switching;
    return slides < MOST_SLIDES || this.system.fail({ kind: "rests_on_jump", coordinate: jump });
  }

  /** The cause behind a failure of a method, where there is a better word for it. */
  explain(failure) {
    const { q, u, n } = this;
    if (["not_finite", "step_too_small", "step_not_solved", "time_not_resolved"].includes(failure.kind)) {
      for (const [order, values] of [
        [0, q],
        [1, u],
      ]) {
        for (let i = 0; i < n; i++) {
          if (Math.abs(values[i]) > 1e100)
            return { kind: "overflow", coordinate: i, order, value: values[i] };
        }
      }
    }
    const at_rank_loss = ["off_constraint", "contradiction", "step_too_small", "step_displaced"];
    if (this.r > 0 && at_rank_loss.includes(failure.kind)) {
      const { condition, names } = this.system.constraints.margin.at(this.t, q, u);
      if (condition >= SINGULAR_CONDITION) {
        return { kind: "singular_position", condition, names, cause: this.system.words(failure) };
      }
    }
    return failure;
  }

  /**
   * Work of all forces in the last step, by the weights of the method as if it were another state; where a
   * method has none, by Gauss's rule on the interpolant.
   */
  work_of_step(h) {
    const { system, stage, plan, r } = this;
    if (this.work_values.length === 0) return 0;
    let work = 0;
    if (plan.method.explicit) {
      const { c, weights, rows } = plan.method;
      for (let s = 0; s <= rows.length; s++) {
        if (weights[s] === 0) continue;
        work += weights[s] * this.power(this.t0 + c[s] * h, stage.q[s], stage.u[s], stage.k_u[s], stage.l[s]);
      }
      return h * work;
    }
    const out = new Float64Array(2 * this.n),
      count = system.evaluations;
    const a = new Float64Array(this.n),
      l = new Float64Array(r);
    for (const [theta, weight] of [
      [0.1127016653792583, 5 / 18],
      [0.5, 4 / 9],
      [0.8872983346207417, 5 / 18],
    ]) {
      const t = this.t0 + theta * h;
      this.at(t, out);
      const q = out.subarray(0, this.n),
        u = out.subarray(this.n);
      if (r > 0 && !system.accelerate(t, q, u, a, l)) return NaN;
      work += weight * this.power(t, q, u, a, l);
    }
    system.evaluations = count;
    return h * work;
  }

  power(t, q, u, a, l) {
    const values = this.system.value("powers", t, q, u, a, l);
    let sum = 0;
    for (let i = 0; i < values.length; i++) sum += values[i];
    return sum;
  }

  // ---- between the ends of a step, and what a state tells

  /** (q, u) at a time within the last step: the quintic through q, q̇ and q̈ of its ends. */
  at(t, out) {
    const { n, from } = this,
      h = this.t - this.t0,
      theta = h === 0 ? 1 : (t - this.t0) / h;
    if (theta < 1 && h !== 0) return quintic(from, this.jumped ?? this, h, theta, n, out);
    out.set(this.q);
    out.set(this.u, n);
    return out;
  }

  /**
   * T, V and E at the present state, or at another one, into three numbers; T and V are NaN where the model
   * has a Lagrangian of its own. E less `work` is constant on an exact motion.
   */
  energies(out, t = this.t, q = this.q, u = this.u) {
    const { system } = this,
      of = (name) => system.value(name, t, q, u)?.[0] ?? NaN;
    // What comes in one pass is asked for once.
    const both = system.value("energies", t, q, u);
    if (both !== null) {
      out[0] = both[0];
      out[1] = both[1];
      out[2] = out[0] + out[1];
      return out;
    }
    out[0] = of("kinetic_energy");
    out[1] = of("potential_energy");
    out[2] = system.has("energy_function") ? of("energy_function") : out[0] + out[1];
    return out;
  }

  /**
   * The results of a program at the present state, or at another one; null where the model has none. q̈ and
   * λ of another state are solved for where the program may read them. The next call overwrites the results.
   */
  value(program, t = this.t, q = this.q, u = this.u) {
    const { system } = this;
    if (!system.has(program)) return null;
    if (q === this.q && u === this.u && t === this.t)
      return system.call(system.bound[program], t, q, u, this.a, this.l);
    const needed = this.r > 0 || this.readers.has(program);
    const [a, l] = needed ? this.solve_at(t, q, u) : [system.no_a, system.no_l];
    return system.call(system.bound[program], t, q, u, a, l);
  }

  /** q̈ and λ at a state that is not of this motion; NaN where they do not exist. Not counted. */
  solve_at(t, q, u) {
    const { system, other } = this,
      same = (x, y) => x.every((value, i) => value === y[i]);
    // Programs of one instant ask for the same accelerations.
    if (this.r === 0 && other.t === t && same(other.q, q) && same(other.u, u))
      return [this.other_a, this.other_l];
    const count = system.evaluations;
    if (!system.accelerate(t, q, u, this.other_a, this.other_l)) {
      this.other_a.fill(NaN);
      this.other_l.fill(NaN);
    }
    system.evaluations = count;
    if (this.r === 0) {
      other.t = t;
      other.q.set(q);
      other.u.set(u);
    }
    return [this.other_a, this.other_l];
  }

  /** The largest violation of a constraint, as a distance: of positions, and of velocities. */
  residual() {
    const { system, t, q, u } = this;
    if (this.r === 0) return [0, 0];
    const at = system.constraints.has_positions ? system.constraints.worst_row(t, q, u, true)[2] : 0;
    return [at, system.constraints.worst_row(t, q, u, false)[2]];
  }
}
