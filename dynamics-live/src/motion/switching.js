// Switching functions: where within a step the accelerations stop being smooth, because a branch of |x|, max, …
// changes, or a smooth function goes on with another piece.
//
// Under step control a step that passes such a place is made again to end there, as
// `dynamics-runtime/src/integrate/discontinuity.rs` has it. Programs do not hold branches. So the accelerations
// at the start of a step behind a change are evaluated a little ahead, on the branch that the step is to take.

/** Part of a step at which its branches are determined: its start may lie a rounding error before a change. */
const BRANCH_LOOKUP_PART = 1e-9;
/** A change nearer to the end of a step than this part is its end. */
const SWITCHING_END_RESOLUTION = 1e-13;
/** Attempts to end one step at a change. */
const MAX_SWITCHING_ATTEMPTS = 5;
/** Parts of a step at whose ends the functions are sampled. */
const SWITCHING_PANELS = 4;
/** After sliding along a change so many steps are controlled by their error alone. */
const STEPS_WITHOUT_SWITCHING = 32;

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
    if (this.suspended > 0) this.suspended--;
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
          this.suspended = STEPS_WITHOUT_SWITCHING;
        } else {
          stepper.restart_step_size();
        }
      }
    }
    this.signs = signs;
    this.intervals = Array.from(values, (x, i) =>
      this.of[i] == null ? null : (system.f[this.of[i]]?.piece(x) ?? null),
    );
  }

  /** The part of a step at which its branches are determined. */
  lookup(h) {
    return Math.max(BRANCH_LOOKUP_PART, 4 * Number.EPSILON * Math.max(Math.abs(this.stepper.t / h), 1));
  }

  /** The part of the step just tried at which the first change lies; null where there is none before its end. */
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
      const found = follow(column, interval === null ? this.signs[i] : 1, (theta) => value(at(theta)[i]));
      if (found.length > 0) first = Math.min(first, found[0][0]);
    }
    if (!(first < 1 - SWITCHING_END_RESOLUTION) || stepper.t + first * h === stepper.t) return null;
    this.attempts++;
    return first;
  }
}

/** A smooth function of x that is positive within an interval and zero at its ends. */
function within_interval(x, [lower, upper]) {
  if (!Number.isFinite(lower)) return Number.isFinite(upper) ? upper - x : 1;
  return Number.isFinite(upper) ? (x - lower) * ((upper - x) / (upper - lower)) : x - lower;
}
