// One motion of a model: its state, steps by a method, and what lies between their ends.
//
// Steps are made as `dynamics-runtime/src/integrate/stepper.rs` makes them: an attempt gives the end of a step
// and its error, the end is projected onto the constraints, q̈ is evaluated there, and the controller accepts
// the step or makes it smaller. Fixed steps have the bits of the library where sine and cosine have.

/** Rejections in a row before a step is given up. */
const MAX_REJECTIONS = 60;
/** A step that cannot be evaluated is repeated at this part of its size, ... */
const FAILED_STEP_PART = 0.25;
/** ... one whose equations were not solved at this part. */
const UNSOLVED_STEP_PART = 0.5;
/** A step below this part of |t| is given up. */
const RESOLVED_STEP_PART = 4 * Number.EPSILON;
/** Part of a step by which the last one may be longer to meet the limit. */
const LAST_STEP_STRETCH = 1e-2,
  FIXED_STEP_STRETCH = 1e-9;
/** A step shorter than this part of the proposed one was cut short. */
const CUT_SHORT_PART = 0.99;
/** Fixed steps whose ends differ by less than this part of them end at the same time. */
const SAME_TIME_PART = 1e-9;
/** The projection of an end may violate the constraints by this many permitted errors. */
const MAX_VIOLATION = 10;
/** Of a fixed step, the projection may move the end by no more than this part of its way. */
const MAX_DISPLACEMENT = 0.02;
/** Size of a motion above which the absolute tolerance is the given one. */
const SMALL_MOTION = 0.1;
/** Most steps of a pilot run, which shows how large a motion becomes. */
const PILOT_STEPS = 20;
/** Values below this part of the larger ones of their unit, or of 1, are zero up to rounding. */
const ZERO_BY_ROUNDING = 1e-13;

/** So many steps in a row are looked at for a motion that chatters. */
const CHATTER_STEPS = 100;

class Motion {
  /** `programs`: what the macro prints; `model`: names, units and values. */
  constructor(programs, model) {
    const system = new System(programs, model),
      { n, r } = system;
    this.programs = programs;
    this.model = model;
    this.system = system;
    system.constraints = new Constraints(system);
    this.n = n;
    this.r = r;
    this.p = system.p;
    this.w = system.w;
    this.m = system.m;
    this.t = 0;
    this.t0 = 0;
    this.q = new Float64Array(n);
    this.u = new Float64Array(n);
    this.a = new Float64Array(n);
    this.l = new Float64Array(r);
    this.from = {
      t: 0,
      q: new Float64Array(n),
      u: new Float64Array(n),
      a: new Float64Array(n),
      l: new Float64Array(r),
    };
    this.next = {
      q: new Float64Array(n),
      u: new Float64Array(n),
      a: new Float64Array(n),
      l: new Float64Array(r),
    };
    // Of every stage its state (q, u, λ) and its derivative (k_q, k_u).
    const vectors = (length) => Array.from({ length: MOST_STAGES }, () => new Float64Array(length));
    this.stage = { q: vectors(n), u: vectors(n), l: vectors(r), k_q: vectors(n), k_u: vectors(n) };
    this.error_q = new Float64Array(n);
    this.error_u = new Float64Array(n);
    this.work_values = new Float64Array(programs.powers?.results ?? 0);
    this.steps = 0;
    this.rejected = 0;
    this.reason = null;
    this.ended = false;
    this.started = false;
    this.work = 0;
    this.events = [];
    /** The end of the last step before an action at an event changed the state; null where none did. */
    this.jumped = null;
    this.locator = new EventLocator(this);
    this.plan = null;
    this.refused = this.refresh();
  }

  get evaluations() {
    return this.system.evaluations;
  }
  set evaluations(count) {
    this.system.evaluations = count;
  }

  /**
   * Takes new values of parameters and inputs into account. The motion goes on from where it is, put back onto
   * its constraints. Returns null, or why the values are refused; the state is then as before.
   */
  refresh() {
    const { system } = this;
    system.hoist();
    this.plan = null;
    this.reason = null;
    const broken = system.broken_assumption(this.t, this.q, this.u, this.started);
    if (broken !== null) return system.words(broken);
    if (!this.started) return null;
    const q = this.q.slice(),
      u = this.u.slice();
    if (this.place(this.t, q, u)) {
      this.q.set(q);
      this.u.set(u);
      this.begin_here();
      return null;
    }
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
    system.switch_modes();
    const failure =
      this.check_values(t, new_q, new_u) ??
      system.broken_assumption(t, new_q, new_u, true) ??
      (this.set_sides(t, new_q, new_u), this.fits(t, new_q, new_u) ? null : system.failure);
    if (failure !== null) {
      this.w.set(old_w);
      this.m.set(old_m);
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
    this.kinks = undefined;
    this.begin_here();
    this.evaluations++;
    return null;
  }

  /** Whether a state is on the constraints to what is typed, and has accelerations; it is projected then. */
  fits(t, q, u) {
    const { system, r } = this;
    if (r > 0 && !system.constraints.check_start(t, q, u)) return false;
    return this.place(t, q, u) && this.locator.check_gaps(t, q, u);
  }

  /** Puts a state onto the constraints; false where that or its accelerations fail. */
  place(t, q, u) {
    const { system, n, r } = this,
      { constraints } = system;
    constraints.mean_sensitivity = 0;
    const a = new Float64Array(n),
      l = new Float64Array(r);
    const placed = (r === 0 || constraints.project(t, q, u)) && system.accelerate(t, q, u, a, l);
    system.evaluations--;
    if (!placed) return false;
    for (let i = 0; i < n; i++) {
      if (!Number.isFinite(a[i])) return system.fail({ kind: "not_finite", coordinate: i, t, h: 0 });
    }
    this.a.set(a);
    this.l.set(l);
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

  /** Released constraints of the velocities go to the side to which they slip, holonomic ones to the positive. */
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
    if (this.plan !== null) {
      this.plan.origin = this.t;
      this.plan.count = 0;
      this.plan.controller?.restart();
    }
    this.locator.start();
  }

  // ---- steps

  /**
   * One accepted step that does not pass `end`. Returns false where the motion cannot go on; `reason` then says
   * why, and the motion stands at the last accepted state.
   */
  step(method, accuracy, end = Infinity) {
    if (this.ended || !this.started) return false;
    this.reason = null;
    if (end === this.t) return true;
    if (this.plan === null || this.plan.method !== METHODS[method] || this.plan.accuracy !== accuracy) {
      this.plan = this.make_plan(METHODS[method], accuracy, end);
    }
    const made = this.make_step(end) && this.locator.after_step() && this.is_ahead();
    if (!made) this.reason = this.system.words(this.explain(this.system.failure));
    return made;
  }

  /**
   * Fails where the motion chatters on a jump of its accelerations, to which these lead back from both sides: a
   * switching function that changes its sign in most of many steps in a row, under step control.
   */
  is_ahead() {
    const { system, plan } = this;
    if (!system.has("kinks") || plan === null || plan.fixed) return true;
    const values = system.value("kinks", this.t, this.q, this.u, this.a, this.l);
    this.kinks ??= Array.from(values, (value) => ({ sign: Math.sign(value), steps: 0, changes: 0 }));
    for (let i = 0; i < values.length; i++) {
      const kink = this.kinks[i],
        sign = Math.sign(values[i]);
      if (sign !== kink.sign) kink.changes++;
      kink.sign = sign;
      if (++kink.steps < CHATTER_STEPS) continue;
      const chatters = kink.changes > 0.4 * CHATTER_STEPS;
      [kink.steps, kink.changes] = [0, 0];
      if (chatters) return system.fail({ kind: "rests_on_jump", coordinate: this.fastest() });
    }
    return true;
  }

  /** The coordinate with the largest acceleration. */
  fastest() {
    let most = 0;
    for (let i = 1; i < this.n; i++) if (Math.abs(this.a[i]) > Math.abs(this.a[most])) most = i;
    return most;
  }

  /** How steps are made from here on: tolerances, the controller, and the first step size. */
  make_plan(method, accuracy, end) {
    const { fixed, control, error_order } = method;
    const plan = {
      method,
      accuracy,
      fixed: fixed === true,
      absolute: accuracy,
      relative: accuracy,
      h: accuracy,
      controller: control ? new Controller(control, error_order) : null,
      origin: this.t,
      count: 0,
    };
    if (!plan.fixed) {
      plan.absolute = this.absolute_tolerance(plan, end);
      plan.h = this.first_step(plan, end);
    }
    return plan;
  }

  /** q̈ at a stage; false where it fails. */
  derivative(s, t) {
    const { q, u, l, k_q, k_u } = this.stage;
    k_q[s].set(u[s]);
    return this.system.accelerate(t, q[s], u[s], k_u[s], l[s]);
  }

  /** y + h Σ w k into a state, with the operations in the order of the library. */
  combine(to_q, to_u, h, { stages, weights }) {
    const { n, q, u } = this,
      { k_q, k_u } = this.stage,
      count = stages.length;
    for (let i = 0; i < n; i++) {
      let of_q = 0,
        of_u = 0;
      for (let j = 0; j < count; j++) {
        of_q += weights[j] * k_q[stages[j]][i];
        of_u += weights[j] * k_u[stages[j]][i];
      }
      to_q[i] = q[i] + h * of_q;
      to_u[i] = u[i] + h * of_u;
    }
  }

  /** Σ w k into (error_q, error_u). */
  sum({ stages, weights }) {
    const { n, error_q, error_u } = this,
      { k_q, k_u } = this.stage,
      count = stages.length;
    for (let i = 0; i < n; i++) {
      let of_q = 0,
        of_u = 0;
      for (let j = 0; j < count; j++) {
        of_q += weights[j] * k_q[stages[j]][i];
        of_u += weights[j] * k_u[stages[j]][i];
      }
      error_q[i] = of_q;
      error_u[i] = of_u;
    }
  }

  /** Σ (eᵢ/scaleᵢ)² of (e_q, e_u) for a step between two states. */
  square_sum(plan, e_q, e_u, to_q, to_u, from_q = this.q, from_u = this.u) {
    const { absolute, relative } = plan;
    let of_q = 0,
      of_u = 0;
    for (let i = 0; i < this.n; i++) {
      const r = e_q[i] / (absolute + relative * Math.max(Math.abs(from_q[i]), Math.abs(to_q[i])));
      of_q += r * r;
    }
    for (let i = 0; i < this.n; i++) {
      const r = e_u[i] / (absolute + relative * Math.max(Math.abs(from_u[i]), Math.abs(to_u[i])));
      of_u += r * r;
    }
    return of_q + of_u;
  }

  norm(plan, e_q, e_u, to_q, to_u, from_q, from_u) {
    return Math.sqrt(this.square_sum(plan, e_q, e_u, to_q, to_u, from_q, from_u) / (2 * this.n));
  }

  /** End and signed size of the next step. */
  next_time(end) {
    const { plan } = this,
      left = end - this.t,
      stretch = plan.fixed ? FIXED_STEP_STRETCH : LAST_STEP_STRETCH;
    if (Math.abs(left) <= plan.h * (1 + stretch)) return [end, left];
    const sign = left < 0 ? -1 : 1;
    const to = plan.fixed ? plan.origin + (plan.count + 1) * (sign * plan.h) : this.t + sign * plan.h;
    return [to, to - this.t];
  }

  /** Makes one step, ending at `end` at the latest. */
  make_step(end) {
    const { plan, system } = this;
    for (let failures = 0; ;) {
      const [to, h] = this.next_time(end);
      if (to === this.t) return system.fail({ kind: "time_not_resolved", t: this.t, h: plan.h });
      let failure = this.attempt(to, h);
      if (failure === null) {
        if (this.judge(Math.abs(h))) {
          this.commit(to, h);
          return true;
        }
        failure = { kind: "step_too_small", coordinate: this.worst(), t: this.t, h };
      } else {
        plan.h = (failure.kind === "step_not_solved" ? UNSOLVED_STEP_PART : FAILED_STEP_PART) * Math.abs(h);
        if (plan.controller) plan.controller.rejected = true;
      }
      failures++;
      this.rejected++;
      if (plan.fixed || plan.h <= RESOLVED_STEP_PART * Math.abs(this.t) || failures > MAX_REJECTIONS) {
        if (plan.fixed) plan.h = plan.accuracy;
        else this.plan = null;
        return system.fail(failure);
      }
    }
  }

  /** Whether a step of this size is accepted; chooses the size of the next one. */
  judge(h) {
    const { plan } = this;
    if (plan.controller === null) return true;
    const accepted = plan.controller.judge(this.error),
      next = h * plan.controller.factor;
    plan.h = accepted && h < CUT_SHORT_PART * plan.h ? Math.max(next, plan.h) : next;
    return accepted;
  }

  /**
   * Tries a step: its end is in `next`, its error in `error`. Returns null, or why the end cannot be reached.
   */
  attempt(to, h) {
    const { plan, system, next, n, r } = this,
      { method } = plan;
    const { q, u, l, k_q, k_u } = this.stage;
    q[0].set(this.q);
    u[0].set(this.u);
    l[0].set(this.l);
    k_q[0].set(this.u);
    k_u[0].set(this.a);
    this.error = 0;
    const failure = method.explicit
      ? this.attempt_explicit(method, h)
      : method.kind === "midpoint"
        ? this.attempt_midpoint(h)
        : this.attempt_semi_implicit(h);
    if (failure !== null) return failure;
    if (!Number.isFinite(this.error) || !all_finite(next.q) || !all_finite(next.u)) {
      return { kind: "not_finite", coordinate: this.not_finite_coordinate(), t: this.t, h };
    }
    let projected = false;
    if (r > 0) {
      // If the error is too large, only the part that projection leaves counts.
      if (this.error > 1 && !this.share_after_projection(to)) return system.failure;
      if (this.error <= 1 || plan.fixed) {
        const displaced = this.project_end(to, h);
        if (displaced !== null) return displaced;
        projected = true;
      }
    }
    if (method.first_same_as_last && !projected) {
      next.a.set(k_u[6]);
      next.l.set(this.last_l);
    } else if (!system.accelerate(to, next.q, next.u, next.a, next.l)) {
      return system.failure;
    }
    for (let i = 0; i < n; i++) {
      if (!Number.isFinite(next.a[i])) return { kind: "not_finite", coordinate: i, t: this.t, h };
    }
    return null;
  }

  attempt_explicit(method, h) {
    const { plan, system, stage, next, t } = this,
      { rows, c, result, error, third } = method;
    for (let s = 1; s <= rows.length; s++) {
      this.combine(stage.q[s], stage.u[s], h, rows[s - 1]);
      if (!this.derivative(s, t + c[s] * h)) return system.failure;
    }
    this.combine(next.q, next.u, h, result);
    if (method.first_same_as_last) {
      const last = rows.length + 1;
      stage.q[last].set(next.q);
      stage.u[last].set(next.u);
      if (!this.derivative(last, t + c[last] * h)) return system.failure;
      this.last_l = stage.l[last];
    }
    if (plan.fixed) return null;
    this.sum(error);
    if (third === undefined) {
      this.error = Math.abs(h) * this.norm(plan, this.error_q, this.error_u, next.q, next.u);
      return null;
    }
    // Two estimates: ‖e₅‖²/√(‖e₅‖² + 0.01 ‖e₃‖²).
    const of_fifth = this.square_sum(plan, this.error_q, this.error_u, next.q, next.u);
    this.difference_from_result(result, third);
    const of_third = this.square_sum(plan, this.third_q, this.third_u, next.q, next.u);
    const both = of_fifth + 0.01 * of_third;
    this.error = both > 0 ? (Math.abs(h) * of_fifth) / Math.sqrt(2 * this.n * both) : both;
    return null;
  }

  /** The slope of the result less that of the embedded result of order three. */
  difference_from_result(result, third) {
    this.third_q ??= new Float64Array(this.n);
    this.third_u ??= new Float64Array(this.n);
    const { k_q, k_u } = this.stage,
      total = (k, i, { stages, weights }) => {
        let sum = 0;
        for (let j = 0; j < stages.length; j++) sum += weights[j] * k[stages[j]][i];
        return sum;
      };
    for (let i = 0; i < this.n; i++) {
      this.third_q[i] = total(k_q, i, result) - total(k_q, i, third);
      this.third_u[i] = total(k_u, i, result) - total(k_u, i, third);
    }
  }

  /** u₁ = u₀ + h a₀, q₁ = q₀ + h u₁. */
  attempt_semi_implicit(h) {
    const { next, n, q, u, a } = this;
    for (let i = 0; i < n; i++) {
      next.u[i] = u[i] + h * a[i];
      next.q[i] = q[i] + h * next.u[i];
    }
    return null;
  }

  /**
   * The implicit midpoint rule: u₁ = u₀ + h a(t + h/2, (y₀ + y₁)/2), q₁ = q₀ + h (u₀ + u₁)/2.
   *
   * A fixed-point iteration on u₁ to rounding. Where it diverges, as for stiff forces, Newton's method with the
   * derivatives of q̈ by differences, whose matrix is factored once for the step.
   */
  attempt_midpoint(h) {
    const { next, q, u, a, n, stage } = this,
      end = new Float64Array(n);
    for (let i = 0; i < n; i++) end[i] = u[i] + h * a[i];
    const first = end.slice();
    let failure = this.iterate_midpoint(h, end, null);
    if (failure !== null) {
      end.set(first);
      const newton = this.midpoint_newton(h, end);
      failure = newton === null ? failure : this.iterate_midpoint(h, end, newton);
    }
    if (failure !== null) return failure;
    for (let i = 0; i < n; i++) {
      next.u[i] = end[i];
      next.q[i] = q[i] + 0.5 * h * (u[i] + end[i]);
    }
    stage.k_q[1].set(stage.u[1]);
    return null;
  }

  /** Iterates on the velocities `end`; `newton` gives the matrix of simplified Newton steps, if they are. */
  iterate_midpoint(h, end, newton) {
    const { q, u, n, system } = this,
      progress = new FixedPoint(),
      miss = new Float64Array(n);
    const step = new Float64Array(n),
      rounding = (4 * Number.EPSILON * max_abs(q)) / Math.abs(h);
    for (;;) {
      if (!this.midpoint_stage(h, end)) return system.failure;
      const slope = this.stage.k_u[1];
      let correction = 0,
        change = 0;
      for (let i = 0; i < n; i++) miss[i] = u[i] + h * slope[i] - end[i];
      if (newton === null) step.set(miss);
      else solve_lu(newton.matrix, n, newton.lu, miss, step);
      for (let i = 0; i < n; i++) {
        end[i] += step[i];
        correction = max(correction, Math.abs(step[i]));
        change = Math.max(change, Math.abs(end[i] - u[i]), 1e-2 * Math.abs(end[i]));
      }
      const part = (x) => (x === 0 ? 0 : x / change),
        status = progress.judge(part(correction), part(rounding));
      if (status === "converged") return null;
      if (status === "diverged") {
        let coordinate = 0;
        for (let i = 1; i < n; i++) if (Math.abs(step[i]) > Math.abs(step[coordinate])) coordinate = i;
        return { kind: "step_not_solved", coordinate, t: this.t, h };
      }
    }
  }

  /** q̈ at the middle of a step that ends with the velocities `end`. */
  midpoint_stage(h, end) {
    const { stage, q, u, n } = this;
    for (let i = 0; i < n; i++) {
      stage.u[1][i] = 0.5 * (u[i] + end[i]);
      stage.q[1][i] = q[i] + 0.25 * h * (u[i] + end[i]);
    }
    return this.system.accelerate(this.t + 0.5 * h, stage.q[1], stage.u[1], stage.k_u[1], stage.l[1]);
  }

  /** 1 − h (∂a/∂u/2 + h ∂a/∂q/4), factored; null where it cannot be evaluated. */
  midpoint_newton(h, end) {
    const { n } = this,
      matrix = new Float64Array(n * n),
      largest = max_abs(end);
    if (!this.midpoint_stage(h, end)) return null;
    const here = this.stage.k_u[1].slice(),
      moved = end.slice();
    for (let j = 0; j < n; j++) {
      // Twice the increment of the velocity of the end moves that of the middle by one.
      const by = difference_increment(end[j], largest);
      moved[j] = end[j] + by;
      if (!this.midpoint_stage(h, moved)) return null;
      moved[j] = end[j];
      const there = this.stage.k_u[1];
      for (let i = 0; i < n; i++) matrix[i * n + j] = (i === j ? 1 : 0) - (h * (there[i] - here[i])) / by;
    }
    const lu = factor_lu(matrix, n);
    return lu.least > 1e-14 ? { matrix, lu } : null;
  }

  /** Reduces the error to the part that is left when the end of the step is projected. */
  share_after_projection(to) {
    const { plan, system, next, n } = this,
      { constraints } = system;
    if (plan.controller === null) return true;
    const left_q = this.error_q.slice(),
      left_u = this.error_u.slice(),
      part = new Float64Array(n);
    const whole = this.norm(plan, left_q, left_u, next.q, next.u);
    if (!constraints.inadmissible_part(to, next.q, next.u, this.error_q, part, true)) return false;
    if (system.holonomic > 0) for (let i = 0; i < n; i++) left_q[i] -= part[i];
    if (!constraints.inadmissible_part(to, next.q, next.u, this.error_u, part, false)) return false;
    for (let i = 0; i < n; i++) left_u[i] -= part[i];
    const left = this.norm(plan, left_q, left_u, next.q, next.u);
    if (left < whole) this.error *= left / whole;
    return true;
  }

  /** Projects the end of a step. Returns null, or why it cannot be accepted. */
  project_end(to, h) {
    const { plan, system, next, n } = this,
      { constraints } = system;
    const before_q = next.q.slice(),
      before_u = next.u.slice();
    if (!constraints.project(to, next.q, next.u)) return system.failure;
    const moved_q = before_q.map((x, i) => next.q[i] - x),
      moved_u = before_u.map((x, i) => next.u[i] - x);
    if (plan.fixed) {
      const speed = 0.5 * (max_abs(this.u) + max_abs(next.u));
      const far_q = max_abs(moved_q) > MAX_DISPLACEMENT * speed * Math.abs(h);
      if (!far_q && !(max_abs(moved_u) > MAX_DISPLACEMENT * speed)) return null;
      // From rest there is no way yet to compare with, and rounding is no displacement.
      const way = Math.max(max_abs(this.a) * h * h, 1e-12 * (1 + max_abs(next.q)));
      if (max_abs(moved_q) <= way && max_abs(moved_u) * Math.abs(h) <= way) return null;
      const moved = far_q ? moved_q : moved_u;
      let coordinate = 0;
      for (let i = 1; i < n; i++) if (Math.abs(moved[i]) > Math.abs(moved[coordinate])) coordinate = i;
      return { kind: "step_displaced", coordinate, t: this.t, h };
    }
    // Near a singular position a small violation causes a large move: the violation counts.
    const by = this.norm(plan, moved_q, moved_u, next.q, next.u, before_q, before_u);
    let violation = by;
    if (by > 1) {
      const found = constraints.violation(to, before_q, before_u, plan.absolute, plan.relative);
      violation = Math.min(Math.max(found, by / 1e6), by);
    }
    this.error = Math.max(this.error, violation / MAX_VIOLATION);
    return null;
  }

  /** Accepts the step: the motion stands at its end. */
  commit(to, h) {
    const { from, next, plan, system } = this;
    if (plan.fixed) {
      const planned = plan.origin + (plan.count + 1) * (h < 0 ? -plan.h : plan.h);
      if ((planned - to) * Math.sign(h) <= SAME_TIME_PART * plan.h) plan.count++;
    }
    from.t = this.t0 = this.t;
    for (const part of ["q", "u", "a", "l"]) {
      const old = from[part];
      from[part] = this[part];
      this[part] = next[part];
      next[part] = old;
    }
    this.t = to;
    this.steps++;
    if (this.r > 0) system.constraints.accept_step();
    this.step_work = this.work_of_step(h);
    this.work += this.step_work;
  }

  /** Takes the step just accepted back. */
  undo() {
    const { from, next, plan } = this;
    for (const part of ["q", "u", "a", "l"]) {
      const old = next[part];
      next[part] = this[part];
      this[part] = from[part];
      from[part] = old;
    }
    this.t = this.t0;
    this.steps--;
    this.work -= this.step_work;
    if (plan.fixed) [plan.origin, plan.count] = [this.t, 0];
  }

  /** Makes the step that was taken back again, to end at another time; false where it fails. */
  repeat(to) {
    const h = to - this.t,
      failure = this.attempt(to, h);
    if (failure !== null) return this.system.fail(failure);
    this.commit(to, h);
    if (this.plan.fixed) [this.plan.origin, this.plan.count] = [this.t, 0];
    return true;
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

  /** The coordinate whose error is the largest against its scale. */
  worst() {
    const { plan, n, q, u, error_q, error_u } = this,
      { absolute, relative } = plan;
    let [worst, most] = [0, -1];
    for (let i = 0; i < n; i++) {
      const of_q = Math.abs(error_q[i]) / (absolute + relative * Math.abs(q[i]));
      const of_u = Math.abs(error_u[i]) / (absolute + relative * Math.abs(u[i]));
      if (Math.max(of_q, of_u) > most) [worst, most] = [i, Math.max(of_q, of_u)];
    }
    return worst;
  }

  not_finite_coordinate() {
    const { stage, n, plan } = this,
      count = plan.method.explicit ? plan.method.rows.length + 1 : 2;
    for (let s = 0; s < count; s++) {
      for (let i = 0; i < n; i++) {
        if (!Number.isFinite(stage.k_u[s][i]) || !Number.isFinite(stage.k_q[s][i])) return i;
      }
    }
    let most = 0;
    for (let i = 1; i < n; i++) {
      if (Math.abs(stage.k_u[count - 1][i]) > Math.abs(stage.k_u[count - 1][most])) most = i;
    }
    return most;
  }

  /** The cause behind a failure of a method, where there is a better word for it. */
  explain(failure) {
    const { q, u, n } = this;
    if (["not_finite", "step_too_small"].includes(failure.kind)) {
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
      const lost = this.rank_loss();
      if (lost !== null) return { kind: "singular_position", ...lost, cause: this.system.words(failure) };
    }
    return failure;
  }

  /** The row that nearly depends on the others at the present state, or null. */
  rank_loss() {
    const { system, t, q, u } = this,
      { constraints } = system,
      { factored } = constraints;
    if (!constraints.factor(t, q, u, constraints.holds)) return null;
    const { rows, active, m } = factored,
      { rank } = rows;
    // The last pivot, rows at unit length: how far the last row is from the span of the others.
    const pivot = rank > 0 ? Math.abs(rows.a[(rank - 1) * system.n + rank - 1]) : 0;
    if (rank === m && pivot > 1e-3) return null;
    if (constraints.redundant && pivot > 1e-3) return null;
    return { row: active[rows.order[Math.min(rank, m - 1)]], rank: rank === m ? m - 1 : rank, active: m };
  }

  // ---- step sizes

  /** The first step, as `dynamics-runtime/src/integrate/stepper/first_step.rs` chooses it. */
  first_step(plan, end) {
    const { system, stage, n, q, u, a, t } = this,
      direction = end < t ? -1 : 1,
      most = Math.abs(end - t);
    const d0 = this.norm(plan, q, u, q, u),
      d1 = this.norm(plan, u, a, q, u);
    const has_scale = d0 >= 1e-10 && d1 >= 1e-10 && Number.isFinite(d0 / d1);
    let h = Math.min(has_scale ? (0.01 * d0) / d1 : 1e-6, most);
    const change_q = new Float64Array(n),
      change_u = new Float64Array(n);
    for (let trial = 0; trial < 4; trial++) {
      for (let i = 0; i < n; i++) {
        stage.q[1][i] = q[i] + direction * h * u[i];
        stage.u[1][i] = u[i] + direction * h * a[i];
      }
      let d2 = NaN;
      if (system.accelerate(t + direction * h, stage.q[1], stage.u[1], stage.k_u[1], stage.l[1])) {
        for (let i = 0; i < n; i++) {
          change_q[i] = stage.u[1][i] - u[i];
          change_u[i] = stage.k_u[1][i] - a[i];
        }
        d2 = this.norm(plan, change_q, change_u, q, u) / h;
      }
      if (!Number.isFinite(d2)) {
        h *= 1e-2;
        continue;
      }
      const curvature = Math.max(d1, d2);
      const fine =
        curvature <= 1e-15 ? Math.max(h * 1e-3, 1e-6) : Math.pow(0.01 / curvature, 1 / plan.method.order);
      return Math.min(fine, 100 * h, most);
    }
    return h;
  }

  /**
   * The absolute tolerance for a small motion: the given one times ten times the size of the motion, which up
   * to twenty steps show, as `dynamics-runtime/src/simulate/pilot_run.rs` has it.
   */
  absolute_tolerance(plan, end) {
    const { n, system, model } = this,
      tolerance = plan.relative;
    const sizes = { q: this.q.map(Math.abs), u: this.u.map(Math.abs) };
    const units = model.coordinates.map(({ unit }) => unit ?? "");
    const by_unit = ({ q, u }) => {
      const all = [];
      for (const values of [q, u]) {
        units.forEach((unit, i) => {
          if (units.indexOf(unit) !== i) return;
          all.push(Math.max(...values.filter((_, j) => units[j] === unit)));
        });
      }
      return all;
    };
    const has_small = (own) => by_unit(own).some((size) => size < SMALL_MOTION);
    if (!has_small(sizes)) return tolerance;
    system.evaluations++;
    const expected = {
      q: sizes.q,
      u: sizes.u.map((x, i) => Math.max(x, Math.sqrt(Math.abs(this.a[i]) * sizes.q[i]))),
    };
    if (!has_small(expected)) return tolerance;
    // The pilot run, after which everything is as before.
    const kept = this.save(),
      trial = { ...plan, controller: new Controller(plan.method.control, plan.method.error_order) };
    this.plan = trial;
    trial.h = this.first_step(trial, end);
    let h = 0;
    for (let steps = 0; steps < PILOT_STEPS && has_small(sizes) && this.t !== end; steps++) {
      if (!this.make_step(end)) break;
      h = this.t - this.t0;
      for (let i = 0; i < n; i++) {
        sizes.q[i] = Math.max(sizes.q[i], Math.abs(this.q[i]));
        sizes.u[i] = Math.max(sizes.u[i], Math.abs(this.u[i]));
      }
    }
    const moving = by_unit(sizes).filter((size) => size > ZERO_BY_ROUNDING);
    const size = moving.length > 0 && h !== 0 ? Math.min(...moving) : SMALL_MOTION;
    const rounding = size < SMALL_MOTION ? 10 * this.rounding_of_accelerations() * Math.abs(h) : 0;
    this.restore(kept);
    if (!(size < SMALL_MOTION)) return tolerance;
    return Math.min(Math.max((tolerance * size) / SMALL_MOTION, 1e-15, rounding), tolerance);
  }

  /** The largest change of the accelerations by changes of the state in its last place. */
  rounding_of_accelerations() {
    const { system, n, t, q, u } = this,
      a = new Float64Array(n),
      b = new Float64Array(n),
      l = new Float64Array(this.r);
    if (!system.accelerate(t, q, u, a, l)) return Infinity;
    let largest = 0;
    for (const sign of [-1, 1]) {
      const factor = (i) => (i % 2 === 0 ? sign : -sign) * Number.EPSILON;
      if (
        !system.accelerate(
          t,
          q.map((x, i) => x + factor(i) * x),
          u.map((x, i) => x + factor(i) * x),
          b,
          l,
        )
      )
        return Infinity;
      for (let i = 0; i < n; i++) largest = Math.max(largest, Math.abs(a[i] - b[i]));
    }
    return largest;
  }

  /** A copy of what a trial changes, for `restore`. Evaluations are not taken back. */
  save() {
    const { from } = this,
      copy = ({ q, u, a, l }) => ({ q: q.slice(), u: u.slice(), a: a.slice(), l: l.slice() });
    const { constraints } = this.system;
    return {
      t: this.t,
      now: copy(this),
      from: { t: from.t, ...copy(from) },
      plan: this.plan,
      work: this.work,
      steps: this.steps,
      rejected: this.rejected,
      sensitivity: constraints.mean_sensitivity,
    };
  }

  restore(kept) {
    const set = (to, { q, u, a, l }) => {
      to.q.set(q);
      to.u.set(u);
      to.a.set(a);
      to.l.set(l);
    };
    this.t = kept.t;
    this.t0 = this.from.t = kept.from.t;
    set(this, kept.now);
    set(this.from, kept.from);
    this.plan = kept.plan;
    [this.work, this.steps, this.rejected] = [kept.work, kept.steps, kept.rejected];
    this.system.constraints.mean_sensitivity = kept.sensitivity;
  }

  // ---- between the ends of a step, and what a state tells

  /** (q, u) at a time within the last step: the quintic through q, q̇ and q̈ of its ends. */
  at(t, out) {
    const { n, from } = this,
      h = this.t - this.t0,
      theta = h === 0 ? 1 : (t - this.t0) / h;
    const to = this.jumped ?? this;
    if (theta >= 1 || h === 0) {
      out.set(this.q);
      out.set(this.u, n);
      return out;
    }
    const blend = theta * theta * theta * (10 + theta * (6 * theta - 15));
    for (let i = 0; i < n; i++) {
      const second = 0.5 * h * h * from.a[i];
      let position = to.q[i] - from.q[i] - h * from.u[i] - second,
        rounding = 0;
      const slope = h * to.u[i] - h * from.u[i] - 2 * second,
        curvature = h * h * to.a[i] - 2 * second;
      // A part of q₁ − q₀ that is rounding belongs to q alone: u would divide it by h.
      const excess = position - 0.5 * slope + curvature / 12;
      if (Math.abs(excess) <= 2 * Number.EPSILON * Math.max(Math.abs(from.q[i]), Math.abs(to.q[i]))) {
        [rounding, position] = [excess, position - excess];
      }
      const c3 = 10 * position - 4 * slope + 0.5 * curvature,
        c4 = -15 * position + 7 * slope - curvature;
      const c5 = 6 * position - 3 * slope + 0.5 * curvature,
        cubic = c3 + theta * (c4 + theta * c5);
      out[i] = from.q[i] + theta * (h * from.u[i] + theta * (second + theta * cubic)) + rounding * blend;
      out[n + i] =
        from.u[i] + (theta * (2 * second + theta * (3 * c3 + theta * (4 * c4 + theta * 5 * c5)))) / h;
    }
    return out;
  }

  /**
   * T, V and E at the present state, or at another one, into three numbers; T and V are NaN where the model has
   * a Lagrangian of its own. E less `work` is constant on an exact motion.
   */
  energies(out, t = this.t, q = this.q, u = this.u) {
    const { system } = this,
      of = (name) => system.value(name, t, q, u)?.[0] ?? NaN;
    out[0] = of("kinetic_energy");
    out[1] = of("potential_energy");
    out[2] = system.has("energy_function") ? of("energy_function") : out[0] + out[1];
    return out;
  }

  /**
   * The results of a program at the present state, or at another one; null where the model has none. With
   * constraints, q̈ and λ of another state are solved for. The next call overwrites the results.
   */
  value(program, t = this.t, q = this.q, u = this.u) {
    const { system } = this;
    if (!system.has(program)) return null;
    if (q === this.q && u === this.u && t === this.t)
      return system.call(system.bound[program], t, q, u, this.a, this.l);
    const [a, l] = this.solve_at(t, q, u);
    return system.call(system.bound[program], t, q, u, a, l);
  }

  /** q̈ and λ at a state that is not of this motion; NaN where they do not exist. Not counted. */
  solve_at(t, q, u) {
    const { system } = this;
    this.other_a ??= new Float64Array(this.n);
    this.other_l ??= new Float64Array(this.r);
    if (this.r > 0) {
      const count = system.evaluations;
      if (!system.accelerate(t, q, u, this.other_a, this.other_l)) {
        this.other_a.fill(NaN);
        this.other_l.fill(NaN);
      }
      system.evaluations = count;
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
