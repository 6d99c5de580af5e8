// The first step, and the absolute tolerance of small motions, as the library chooses them.

/** Size of a motion above which the absolute tolerance is the given one. */
const SMALL_MOTION = 0.1;
/** Most steps of a pilot run, which shows how large a motion becomes. */
const PILOT_STEPS = 20;
/** Values below this part of the larger ones of their unit, or of 1, are zero up to rounding. */
const ZERO_BY_ROUNDING = 1e-13;

// ---- step sizes

/** The first step, as `dynamics-runtime/src/integrate/stepper/first_step.rs` chooses it. */
function first_step(stepper, plan, end) {
  const { system, stage, n, q, u, a, t } = stepper,
    direction = end < t ? -1 : 1,
    most = Math.abs(end - t);
  const d0 = stepper.norm(plan, q, u, q, u),
    d1 = stepper.norm(plan, u, a, q, u);
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
      d2 = stepper.norm(plan, change_q, change_u, q, u) / h;
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
function absolute_tolerance(stepper, plan, end) {
  const { n, system, model } = stepper,
    tolerance = plan.relative;
  const sizes = { q: stepper.q.map(Math.abs), u: stepper.u.map(Math.abs) };
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
    u: sizes.u.map((x, i) => Math.max(x, Math.sqrt(Math.abs(stepper.a[i]) * sizes.q[i]))),
  };
  if (!has_small(expected)) return tolerance;
  // The pilot run, after which everything is as before.
  const kept = stepper.save(),
    trial = { ...plan, controller: new Controller(plan.method.control, plan.method.error_order) };
  stepper.plan = trial;
  trial.h = first_step(stepper, trial, end);
  let h = 0;
  for (let steps = 0; steps < PILOT_STEPS && has_small(sizes) && stepper.t !== end; steps++) {
    if (!stepper.make_step(end)) break;
    h = stepper.t - stepper.t0;
    for (let i = 0; i < n; i++) {
      sizes.q[i] = Math.max(sizes.q[i], Math.abs(stepper.q[i]));
      sizes.u[i] = Math.max(sizes.u[i], Math.abs(stepper.u[i]));
    }
  }
  const moving = by_unit(sizes).filter((size) => size > ZERO_BY_ROUNDING);
  const size = moving.length > 0 && h !== 0 ? Math.min(...moving) : SMALL_MOTION;
  const rounding = size < SMALL_MOTION ? 10 * rounding_of_accelerations(stepper) * Math.abs(h) : 0;
  stepper.restore(kept);
  stepper.switching.restart();
  if (!(size < SMALL_MOTION)) return tolerance;
  return Math.min(Math.max((tolerance * size) / SMALL_MOTION, 1e-15, rounding), tolerance);
}

/** The largest change of the accelerations by changes of the state in its last place. */
function rounding_of_accelerations(stepper) {
  const { system, n, t, q, u } = stepper,
    a = new Float64Array(n),
    b = new Float64Array(n),
    l = new Float64Array(stepper.r);
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
