// Switching functions: where within a step the accelerations stop being smooth, because a branch of |x|, max,
// … changes, or a smooth function goes on with another piece.
//
// Under step control a step that passes such a place is made again to end there, as
// `dynamics-runtime/src/integrate/discontinuity.rs` has it. Programs do not hold branches. So a stage that
// lies behind a change is evaluated where its way back crosses the change, still on the branch of the start:
// for a stage at a distance τ behind this errs by τ q⃛, which is nothing in the step that ends there. The
// accelerations at the start of the next step are evaluated a little ahead, on the branch that it is to take.

/**
 * Part of a step at which its branches are determined: its start may lie a rounding error before a change.
 */
const BRANCH_LOOKUP_PART = 1e-9;
/** A change nearer to the end of a step than this part is its end. */
const SWITCHING_END_RESOLUTION = 1e-13;
/** Attempts to end one step at a change. */
const MAX_SWITCHING_ATTEMPTS = 5;
/** Parts of a step at whose ends the functions are sampled. */
const SWITCHING_PANELS = 4;
/** After sliding along a change so many steps are controlled by their error alone. */
const STEPS_WITHOUT_SWITCHING = 32;
/** Sliding that is found after more steps without it is another one. */
const STEPS_BETWEEN_SLIDES = 8;

class SwitchingFunctions {
  constructor(stepper) {
    this.stepper = stepper;
    this.system = stepper.system;
    this.count = this.system.has("kinks") ? this.system.bound.kinks.results : 0;
    this.of = this.system.programs.kink_functions ?? [];
    this.out = new Float64Array(2 * stepper.n);
    this.restart();
  }

  /** Forgets where the motion was. */
  restart() {
    this.signs = null;
    this.suspended = 0;
    this.attempts = 0;
    /** Whether stages are evaluated on the branches of the start. */
    this.holding = false;
    /** How often in a row sliding was found, and the coordinate whose acceleration jumps most there. */
    this.slides = 0;
    this.jump = 0;
    this.free_steps = 0;
  }

  get is_active() {
    return this.count > 0 && this.suspended === 0;
  }

  values(t, q, u) {
    return this.system.value("kinks", t, q, u).slice();
  }

  /** The pieces of smooth functions, and the signs of the others, a little ahead of the start of a step. */
  begin_step(h) {
    this.attempts = 0;
    this.holding = false;
    if (this.suspended > 0) this.suspended--;
    else if (++this.free_steps > STEPS_BETWEEN_SLIDES) this.slides = 0;
    if (!this.is_active) return;
    const { stepper, system } = this,
      { t, q, u, a, l } = stepper;
    const part = this.lookup(h),
      by = part * h;
    const ahead = () =>
      this.values(
        t + by,
        q.map((x, i) => x + by * u[i]),
        u.map((x, i) => x + by * a[i]),
      );
    const signs_of = (values) => values.map((x, i) => (this.of[i] == null ? sign_of(x) : 1));
    const values = ahead(),
      signs = signs_of(values);
    if (this.signs !== null && signs.some((sign, i) => sign !== this.signs[i])) {
      // Behind a change the accelerations are those of the new branches, unless these lead back.
      const q_ahead = q.map((x, i) => x + by * u[i]),
        u_ahead = u.map((x, i) => x + by * a[i]);
      const new_a = a.slice(),
        new_l = l.slice();
      if (system.accelerate(t + by, q_ahead, u_ahead, new_a, new_l)) {
        const old_a = a.slice();
        a.set(new_a);
        l.set(new_l);
        const again = signs_of(ahead());
        if (again.some((sign, i) => sign !== signs[i])) {
          a.set(old_a);
          this.note_slide(old_a, new_a);
        } else {
          stepper.restart_step_size();
        }
      }
    }
    this.signs = signs;
    this.holding = this.is_active && signs.some((_, i) => this.of[i] == null);
    this.intervals = Array.from(values, (x, i) =>
      this.of[i] == null ? null : (system.f[this.of[i]]?.piece(x) ?? null),
    );
  }

  /** The accelerations lead back from both sides of a change: a while without the handling. */
  note_slide(one, other) {
    const apart = one.map((x, i) => Math.abs(x - other[i]));
    this.jump = apart.indexOf(max_abs(apart));
    this.suspended = STEPS_WITHOUT_SWITCHING;
    this.free_steps = 0;
    this.slides++;
  }

  /** q̈ and λ at a stage, on the branches of the start of the step where these are held. */
  accelerate(t, q, u, a, l) {
    const { system, stepper } = this;
    const back = this.holding ? this.way_back(t, q, u) : 0;
    if (back === 0) return system.accelerate(t, q, u, a, l);
    const before_q = q.map((x, i) => x - back * u[i]),
      before_u = u.map((x, i) => x - back * stepper.a[i]);
    return system.accelerate(t - back, before_q, before_u, a, l);
  }

  /** The time by which a state lies behind the nearest place on the branches of the start; 0 on them. */
  way_back(t, q, u) {
    const { stepper, signs, of } = this,
      { a } = stepper;
    const at = (back) =>
      this.values(
        t - back,
        q.map((x, i) => x - back * u[i]),
        u.map((x, i) => x - back * a[i]),
      );
    const whole = t - stepper.t;
    let values = at(0),
      back = 0;
    // The zeros by secants; where a value does not lead back to zero, the start of the step.
    for (let turn = 0; turn < 4; turn++) {
      const off = (_, i) => of[i] == null && values[i] * signs[i] < 0;
      if (!values.some(off) || back === whole) return back;
      const by = 1e-4 * (whole - back),
        before = at(back + by);
      let more = 0;
      for (let i = 0; i < this.count; i++) {
        if (!off(0, i)) continue;
        const part = values[i] / (values[i] - before[i]);
        const own = part > 0 && Number.isFinite(part) ? part * by * (1 + 1e-9) : whole - back;
        if (Math.abs(own) > Math.abs(more)) more = own;
      }
      back = Math.abs(back + more) < Math.abs(whole) ? back + more : whole;
      values = at(back);
    }
    return back;
  }

  /** The smallest part of a step that the rounding of time resolves. */
  resolution(h) {
    return 4 * Number.EPSILON * Math.max(Math.abs(this.stepper.t / h), 1);
  }

  /** The part of a step at which its branches are determined. */
  lookup(h) {
    return Math.max(BRANCH_LOOKUP_PART, this.resolution(h));
  }

  /**
   * The part of the step just tried at which the first change lies; null where there is none before its end.
   */
  first_change(to, h) {
    if (!this.is_active || this.signs === null || this.attempts >= MAX_SWITCHING_ATTEMPTS) return null;
    const { stepper, out } = this,
      { n } = stepper,
      from = this.lookup(h);
    const at = (theta) => {
      quintic(stepper, stepper.next, h, theta, n, out);
      return this.values(stepper.t + theta * h, out.subarray(0, n), out.subarray(n));
    };
    const thetas = [from];
    for (let part = 1; part <= SWITCHING_PANELS; part++) thetas.push(sample_position(part, SWITCHING_PANELS));
    const samples = thetas.map(at);
    let first = Infinity;
    for (let i = 0; i < this.count; i++) {
      const interval = this.intervals[i];
      if (this.of[i] != null && interval === null) continue;
      const value = (x) => (interval === null ? x : within_interval(x, interval));
      const column = refined(
        thetas.map((theta, k) => [theta, value(samples[k][i])]),
        (theta) => value(at(theta)[i]),
      );
      const value_at = (theta) => value(at(theta)[i]);
      const found = follow(column, interval === null ? this.signs[i] : 1, value_at, this.resolution(h));
      if (found.length > 0) first = Math.min(first, found[0][0]);
    }
    if (
      !(first < 1 - Math.max(this.resolution(h), SWITCHING_END_RESOLUTION)) ||
      stepper.t + first * h === stepper.t
    )
      return null;
    this.attempts++;
    return first;
  }
}

/** A smooth function of x that is positive within an interval and zero at its ends. */
function within_interval(x, [lower, upper]) {
  if (!Number.isFinite(lower)) return Number.isFinite(upper) ? upper - x : 1;
  return Number.isFinite(upper) ? (x - lower) * ((upper - x) / (upper - lower)) : x - lower;
}
