// Steps of a motion by a method.
//
// Steps are made as `dynamics-runtime/src/integrate/stepper.rs` makes them: an attempt gives the end of a
// step and its error, the end is projected onto the constraints, q̈ is evaluated there, and the controller
// accepts the step or makes it smaller. Fixed steps have the bits of the library where sine and cosine have.

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
const SAME_TIME_PART = 1e-6;
/** The projection of an end may violate the constraints by this many permitted errors. */
const MAX_VIOLATION = 10;
/** A projection that moves the end by so many times the violation shows a singular position nearby, ... */
const AMPLIFIED_MOVE = 2;
/** ... if it moves the end by more than this many permitted errors. */
const SIGNIFICANT_MOVE = 1;
/** A projection whose second-order part is larger, in permitted errors, is not treated as a straight move. */
const MAX_CURVATURE = 0.1;
/** Largest ratio of a move to the violation that caused it. */
const MAX_MOVE_PER_VIOLATION = 1e6;
/** Of a fixed step, the projection may move the end by no more than this part of its way. */
const MAX_DISPLACEMENT = 0.02;
/** Uncertainty of an end from rounding that counts as a disagreement of the stages, in permitted errors. */
const UNCERTAIN_END = 100;
/** Projecting the stages has helped if it makes the error smaller than this part of it; else it pauses. */
const HELPFUL_ERROR_PART = 0.1,
  ATTEMPTS_WITHOUT_STAGE_PROJECTION = 4;
/** Permitted errors of fixed steps, by which moves of their ends are judged: the library's default. */
const TOLERANCE_OF_FIXED_STEPS = 1e-9;

/**
 * (q, u) at a part θ of a step of size h: the quintic through q, q̇ and q̈ of its ends.
 *
 * A part of q₁ − q₀ that is rounding belongs to q alone; u would divide it by h.
 */
function quintic(from, to, h, theta, n, out) {
  const blend = theta * theta * theta * (10 + theta * (6 * theta - 15));
  for (let i = 0; i < n; i++) {
    const second = 0.5 * h * h * from.a[i];
    let position = to.q[i] - from.q[i] - h * from.u[i] - second,
      rounding = 0;
    const slope = h * to.u[i] - h * from.u[i] - 2 * second,
      curvature = h * h * to.a[i] - 2 * second;
    const excess = position - 0.5 * slope + curvature / 12;
    if (Math.abs(excess) <= 2 * Number.EPSILON * Math.max(Math.abs(from.q[i]), Math.abs(to.q[i]))) {
      [rounding, position] = [excess, position - excess];
    }
    const c3 = 10 * position - 4 * slope + 0.5 * curvature,
      c4 = -15 * position + 7 * slope - curvature;
    const c5 = 6 * position - 3 * slope + 0.5 * curvature,
      cubic = c3 + theta * (c4 + theta * c5);
    out[i] = from.q[i] + theta * (h * from.u[i] + theta * (second + theta * cubic)) + rounding * blend;
    const bend = 3 * c3 + theta * (4 * c4 + theta * 5 * c5);
    out[n + i] = from.u[i] + (theta * (2 * second + theta * bend)) / h;
  }
  return out;
}

/** What stands in the place of switching functions where accelerations are smooth. */
function smooth(system) {
  return {
    slides: 0,
    restart() {},
    begin_step() {},
    first_change: () => null,
    accelerate: (t, q, u, a, l) => system.accelerate(t, q, u, a, l),
  };
}

class Stepper {
  constructor(system) {
    const { n, r } = system,
      state = () => ({
        q: new Float64Array(n),
        u: new Float64Array(n),
        a: new Float64Array(n),
        l: new Float64Array(r),
      });
    this.system = system;
    this.n = n;
    this.r = r;
    this.t = 0;
    this.t0 = 0;
    Object.assign(this, state());
    /** The start of the last step. */
    this.from = { t: 0, ...state() };
    /** The end of the present attempt. */
    this.next = state();
    // Of every stage its state (q, u, λ) and its derivative (k_q, k_u), which lie one behind the other.
    const vectors = (length) => Array.from({ length: MOST_STAGES }, () => new Float64Array(length));
    this.slopes = new Float64Array(MOST_STAGES * 2 * n);
    const part = (from) => (_, s) => this.slopes.subarray(2 * n * s + from, 2 * n * s + from + n);
    const parts = (from) => Array.from({ length: MOST_STAGES }, part(from));
    this.stage = { q: vectors(n), u: vectors(n), l: vectors(r), k_q: parts(0), k_u: parts(n) };
    this.error_q = new Float64Array(n);
    this.error_u = new Float64Array(n);
    this.third_q = new Float64Array(n);
    this.third_u = new Float64Array(n);
    this.slope_q = new Float64Array(n);
    this.slope_u = new Float64Array(n);
    this.midpoint = new ImplicitMidpoint(this);
    this.switching = system.has("kinks") ? new SwitchingFunctions(this) : smooth(system);
    this.steps = 0;
    this.rejected = 0;
    this.work = 0;
    this.plan = null;
  }

  /** How steps are made from here on: tolerances, the controller, and the first step size. */
  make_plan(method, accuracy, end) {
    const { fixed, control, error_order } = method,
      tolerance = fixed ? TOLERANCE_OF_FIXED_STEPS : accuracy;
    const plan = {
      method,
      accuracy,
      fixed: fixed === true,
      absolute: tolerance,
      relative: tolerance,
      h: accuracy,
      controller: control ? new Controller(control, error_order) : null,
      origin: this.t,
      count: 0,
      crossing: this.r > 0 ? new SingularityCrossing() : null,
      attempts_without_stage_projection: 0,
    };
    if (!plan.fixed) {
      plan.absolute = absolute_tolerance(this, plan, end);
      plan.h = first_step(this, plan, end);
    }
    return plan;
  }

  /** q̇ and q̈ at a stage, put onto the constraints where stages are projected; false where it fails. */
  derivative(s, t) {
    const { q, u, l, k_q, k_u } = this.stage;
    if (this.projects_stages) this.system.constraints.project_between(t, q[s], u[s], this.plan);
    k_q[s].set(u[s]);
    return this.switching.accelerate(t, q[s], u[s], k_u[s], l[s]);
  }

  /** y + h Σ w k into a state, with the operations in the order of the library. */
  combine(to_q, to_u, h, { stages, weights }) {
    const { n, q, u, slopes } = this,
      width = 2 * n,
      count = stages.length;
    for (let i = 0; i < n; i++) {
      let of_q = 0,
        of_u = 0;
      for (let j = 0; j < count; j++) {
        const at = stages[j] * width + i,
          weight = weights[j];
        of_q += weight * slopes[at];
        of_u += weight * slopes[at + n];
      }
      to_q[i] = q[i] + h * of_q;
      to_u[i] = u[i] + h * of_u;
    }
  }

  /** Σ w k into (error_q, error_u), or into other vectors. */
  sum({ stages, weights }, of_q = this.error_q, of_u = this.error_u) {
    const { n, slopes } = this,
      width = 2 * n,
      count = stages.length;
    for (let i = 0; i < n; i++) {
      let sum_q = 0,
        sum_u = 0;
      for (let j = 0; j < count; j++) {
        const at = stages[j] * width + i,
          weight = weights[j];
        sum_q += weight * slopes[at];
        sum_u += weight * slopes[at + n];
      }
      of_q[i] = sum_q;
      of_u[i] = sum_u;
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
    const { plan, system, r } = this,
      { crossing } = plan;
    let retries = 0,
      failures = 0,
      chosen = null;
    crossing?.begin_step();
    this.switching.holding = false;
    if (!plan.fixed) {
      this.limit = end;
      this.switching.begin_step(this.next_time(end)[1]);
    }
    for (;;) {
      let [to, h] = chosen ?? this.next_time(end);
      chosen = null;
      if (retries > 0) {
        to = this.retry_end(h, retries, end);
        h = to - this.t;
      }
      if (to === this.t) return system.fail(this.unresolved());
      let failure = this.attempt(to, h);
      const change = failure === null && !plan.fixed ? this.switching.first_change(to, h) : null;
      if (change !== null) {
        chosen = [this.t + change * h, change * h];
        this.rejected++;
        continue;
      }
      if (r > 0 && plan.fixed) {
        const verdict = this.judge_crossing(retries, h, failure);
        if (verdict === "best") failure ??= this.check_disagreement(h);
        else if (verdict !== "accept") {
          retries = verdict;
          this.rejected++;
          continue;
        }
      }
      if (failure === null) {
        if (r > 0 && !plan.fixed) {
          const { error, noise } = this;
          if (crossing.needs_retry(retries, to, error, noise)) {
            retries++;
            this.rejected++;
            continue;
          }
          const better = crossing.better_end(retries, to, error, noise);
          if (better !== null) {
            [chosen, retries] = [[better, better - this.t], 0];
            this.rejected++;
            continue;
          }
        }
        if (this.judge(Math.abs(h))) {
          this.commit(to, h);
          return true;
        }
        failure = { kind: "step_too_small", coordinate: this.worst(), t: this.t, h };
      } else {
        plan.h = (failure.kind === "step_not_solved" ? UNSOLVED_STEP_PART : FAILED_STEP_PART) * Math.abs(h);
        if (plan.controller) plan.controller.rejected = true;
      }
      retries = 0;
      failures++;
      this.rejected++;
      if (plan.fixed || plan.h <= RESOLVED_STEP_PART * Math.abs(this.t) || failures > MAX_REJECTIONS) {
        if (plan.fixed) plan.h = plan.accuracy;
        else this.plan = null;
        return system.fail(failure);
      }
    }
  }

  /** The failure of a step that time does not resolve. */
  unresolved() {
    const { plan, t } = this,
      kind = plan.fixed ? "time_not_resolved" : "step_too_small";
    return { kind, coordinate: this.worst(), t, h: plan.h };
  }

  /** Chooses the size of the next step anew, behind a change of the accelerations. */
  restart_step_size() {
    const { plan } = this,
      proposed = first_step(this, plan, this.limit);
    plan.h = Math.min(plan.h, proposed);
    plan.controller.restart();
  }

  /** The end of a retry of a step of size h. */
  retry_end(h, retry, end) {
    const { plan } = this;
    if (!plan.fixed) return this.t + h * powi(RETRY_FACTOR, retry);
    const [part, behind] = RETRY_ENDS[retry - 1],
      to = this.t + part * h + Math.sign(h) * behind * plan.accuracy;
    return (end - to) * Math.sign(h) < 0 ? end : to;
  }

  /** Judges an attempt at a fixed step of a constrained system. */
  judge_crossing(retries, h, failure) {
    const { plan, next, q, u, a, t, n } = this,
      { crossing, method } = plan;
    if (failure === null) {
      if (!method.explicit) return "accept";
      return crossing.judge(retries, this.disagreement, () => this.is_near_rank_loss(t + h, next.q, next.u));
    }
    if (failure.kind === "not_finite") return "accept";
    const ahead_q = q.map((x, i) => x + h * u[i]),
      ahead_u = u.map((x, i) => x + h * a[i]);
    return crossing.judge(retries, Infinity, () => this.is_near_rank_loss(t + h, ahead_q, ahead_u));
  }

  /** Whether the constraint Jacobian nearly loses rank at an end of a step, or in its middle. */
  is_near_rank_loss(to, end_q, end_u) {
    const { q, u, t, system } = this,
      middle = (x, y) => x.map((from, i) => 0.5 * (from + y[i]));
    const places = [
      [t, q, u],
      [0.5 * (t + to), middle(q, end_q), middle(u, end_u)],
      [to, end_q, end_u],
    ];
    return places.some(
      ([at, x, v]) => system.constraints.margin.at(at, x, v).condition >= NEARLY_SINGULAR_CONDITION,
    );
  }

  /** An error where the stages of a fixed step disagree by a considerable part of its way. */
  check_disagreement(h) {
    const { next, apart } = this;
    if (apart === null) return null;
    const coordinate = this.displaced(apart.q, apart.u, next, h);
    return coordinate < 0 ? null : { kind: "step_displaced", coordinate, t: this.t, h };
  }

  /**
   * The coordinate that a move displaced most, if by more than a fiftieth of the way of a step; else −1.
   */
  displaced(moved_q, moved_u, end, h) {
    const way = Math.max(Math.abs(h), this.plan.fixed ? this.plan.accuracy : 0);
    const speed = 0.5 * (max_abs(this.u) + max_abs(end.u));
    const far_in_q = max_abs(moved_q) > MAX_DISPLACEMENT * speed * way;
    if (!far_in_q && !(max_abs(moved_u) > MAX_DISPLACEMENT * speed)) return -1;
    const moved = far_in_q ? moved_q : moved_u;
    let coordinate = 0;
    for (let i = 1; i < moved.length; i++)
      if (Math.abs(moved[i]) > Math.abs(moved[coordinate])) coordinate = i;
    return coordinate;
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

  /** Tries a step: its end is in `next`, its error in `error`. Returns null, or why it cannot be reached. */
  attempt(to, h) {
    const { plan, system, next, n, r } = this,
      { method } = plan;
    const { q, u, l, k_q, k_u } = this.stage;
    let projected = false;
    this.projects_stages = false;
    this.noise = 0;
    if (plan.attempts_without_stage_projection > 0) plan.attempts_without_stage_projection--;
    for (let error_before = 0; ;) {
      q[0].set(this.q);
      u[0].set(this.u);
      l[0].set(this.l);
      k_q[0].set(this.u);
      k_u[0].set(this.a);
      this.error = 0;
      const failure = this.attempt_by_method(h);
      if (failure !== null) return failure;
      if (!Number.isFinite(this.error) || !all_finite(next.q) || !all_finite(next.u)) {
        return { kind: "not_finite", coordinate: this.not_finite_coordinate(), t: this.t, h };
      }
      if (r === 0) break;
      // A large error may come from stages off the constraints: once more with projected stages.
      if (this.projects_stages) {
        const still_large = this.error > HELPFUL_ERROR_PART * error_before;
        plan.attempts_without_stage_projection = still_large ? ATTEMPTS_WITHOUT_STAGE_PROJECTION : 0;
      } else if (
        this.error > OFF_CONSTRAINT_ERROR &&
        plan.attempts_without_stage_projection === 0 &&
        !plan.fixed
      ) {
        [error_before, this.projects_stages] = [this.error, true];
        continue;
      }
      // If the error is too large, only the part that projection leaves counts.
      if (this.error > 1 && !plan.fixed && !this.share_after_projection(to)) return system.failure;
      this.disagreement = plan.fixed ? this.stage_disagreement(h) : this.error;
      if (this.error > 1 && !plan.fixed) break;
      if (!this.project_end(to)) return system.failure;
      projected = true;
      const { by, violation, q: moved_q, u: moved_u } = this.moved;
      if (by > SIGNIFICANT_MOVE) {
        if (by > AMPLIFIED_MOVE * violation && !this.projects_stages && method.explicit) {
          [error_before, this.projects_stages] = [Infinity, true];
          continue;
        }
        const displaced = plan.fixed ? this.displaced(moved_q, moved_u, next, h) : -1;
        if (displaced >= 0) return { kind: "step_displaced", coordinate: displaced, t: this.t, h };
      }
      this.error = Math.max(this.error, this.projection_error());
      if (this.noise > UNCERTAIN_END) this.disagreement = Math.max(this.disagreement, this.noise);
      break;
    }
    if (method.first_same_as_last && !projected) {
      next.a.set(k_u[6]);
      next.l.set(l[6]);
    } else if (!this.switching.accelerate(to, next.q, next.u, next.a, next.l)) {
      return system.failure;
    }
    for (let i = 0; i < n; i++) {
      if (!Number.isFinite(next.a[i])) return { kind: "not_finite", coordinate: i, t: this.t, h };
    }
    return null;
  }

  attempt_by_method(h) {
    const { method } = this.plan;
    if (method.explicit) return this.attempt_explicit(method, h);
    if (method.attempt) return method.attempt(this, h);
    return method.kind === "midpoint" ? this.midpoint.attempt(h) : this.attempt_semi_implicit(h);
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
    }
    if (plan.fixed) return null;
    this.sum(error);
    if (third === undefined) {
      this.error = Math.abs(h) * this.norm(plan, this.error_q, this.error_u, next.q, next.u);
      return null;
    }
    // Two estimates: ‖e₅‖²/√(‖e₅‖² + 0.01 ‖e₃‖²).
    const of_fifth = this.square_sum(plan, this.error_q, this.error_u, next.q, next.u);
    const { third_q, third_u, slope_q, slope_u } = this;
    this.sum(result, slope_q, slope_u);
    this.sum(third, third_q, third_u);
    for (let i = 0; i < this.n; i++) {
      third_q[i] = slope_q[i] - third_q[i];
      third_u[i] = slope_u[i] - third_u[i];
    }
    const of_third = this.square_sum(plan, third_q, third_u, next.q, next.u);
    const both = of_fifth + 0.01 * of_third;
    this.error = both > 0 ? (Math.abs(h) * of_fifth) / Math.sqrt(2 * this.n * both) : both;
    return null;
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
   * The disagreement of the stages of RK4 in permitted errors: the difference of the two middle stages, and
   * that of their sum from the stages at the ends. Other methods of fixed steps have none.
   */
  stage_disagreement(h) {
    const { plan, n, next, stage } = this,
      { k_q, k_u } = stage;
    this.apart = null;
    if (plan.method !== METHODS.rk4) return 0;
    const apart = (k) =>
      Float64Array.from({ length: n }, (_, i) => {
        const middle = k[2][i] - k[1][i],
          ends = k[0][i] - k[1][i] - k[2][i] + k[3][i];
        return (h / 6) * max(Math.abs(middle), Math.abs(ends));
      });
    this.apart = { q: apart(k_q), u: apart(k_u) };
    return this.norm(plan, this.apart.q, this.apart.u, next.q, next.u);
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

  /** Projects the end of a step; false where that fails. `moved` has by how much, in permitted errors. */
  project_end(to) {
    const { plan, system, next } = this,
      { constraints } = system,
      { absolute, relative } = plan;
    const before_q = next.q.slice(),
      before_u = next.u.slice();
    if (!constraints.project(to, next.q, next.u)) return false;
    const q = before_q.map((x, i) => next.q[i] - x),
      u = before_u.map((x, i) => next.u[i] - x);
    const by = this.norm(plan, q, u, next.q, next.u, before_q, before_u);
    // Near a singular position a small violation causes a large move: the violation counts.
    let violation = by;
    if (by > SIGNIFICANT_MOVE) {
      const found = constraints.violation(to, before_q, before_u, absolute, relative);
      violation = Math.min(Math.max(found, by / MAX_MOVE_PER_VIOLATION), by);
    }
    this.moved = { by, violation, q, u };
    this.noise = constraints.noise / (absolute + relative * max_abs(next.u));
    return true;
  }

  /**
   * The error that the projection of the end adds, 1 where it is just permitted. Near rank loss a move along
   * the direction in which the start of the step would be projected is no error of the step; the rest of it
   * is.
   */
  projection_error() {
    const { plan, system, next, n, q, u, t, moved } = this,
      { constraints } = system;
    const violated = moved.violation / MAX_VIOLATION;
    if (violated <= 1 || plan.fixed || this.noise <= 1) return violated;
    const is_curved = moved.by * moved.by * Math.max(plan.absolute, plan.relative) > MAX_CURVATURE;
    if (is_curved || !this.is_near_rank_loss(t, next.q, next.u)) return violated;
    const part = new Float64Array(n),
      rest_q = moved.q.slice(),
      rest_u = moved.u.slice();
    if (!constraints.inadmissible_part(t, q, u, moved.q, part, true)) return violated;
    for (let i = 0; i < n; i++) rest_q[i] -= part[i];
    if (!constraints.inadmissible_part(t, q, u, moved.u, part, false)) return violated;
    for (let i = 0; i < n; i++) rest_u[i] -= part[i];
    return Math.min(violated, this.norm(plan, rest_q, rest_u, next.q, next.u));
  }

  /** Accepts the step: the motion stands at its end. */
  commit(to, h) {
    const { from, next, plan, system } = this;
    if (plan.fixed) {
      const planned = plan.origin + (plan.count + 1) * (h < 0 ? -plan.h : plan.h);
      if ((planned - to) * Math.sign(h) <= SAME_TIME_PART * plan.h) plan.count++;
      if (Math.abs(h) >= (1 - SAME_TIME_PART) * plan.h) plan.crossing?.update_usual();
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
    plan.method.accept?.(this);
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
}
