// Dragging a point of a motion: the least change of the coordinates that brings it somewhere.
//
// Damped least squares in the norm ‖δ‖² = Σ Mᵢᵢ δᵢ², so that light bodies follow before heavy
// ones and units do not matter. Under constraints δ stays in their tangent space, and the result is put onto
// them.

/** Damping, in parts of the trace of J Jᵀ: it keeps the change small where the point cannot move on. */
const DRAG_DAMPING = 1e-4;
/** Most linear steps of one drag, and the largest change of a coordinate in one, in parts of 1 + |q|. */
const MOST_DRAG_STEPS = 30,
  LARGEST_DRAG_STEP = 0.3;
/** A contact into which a mechanism sinks by more than this part of its size closes. */
const SUNK_GAP = 1e-12;

/** Where the results of a point begin in the program `points`, and how many it has. */
function place_of_point(motion, point) {
  const dimensions =
    motion.programs.points.dimensions ?? motion.model.points.map(({ dimension }) => dimension);
  let at = 0;
  for (let i = 0; i < point; i++) at += dimensions[i];
  return [at, dimensions[point]];
}

/** The position of a point at a state. */
function position_of_point(motion, point, t = motion.t, q = motion.q) {
  const [at, dimension] = place_of_point(motion, point),
    out = motion.system.value("points", t, q, motion.u);
  return Array.from(out.subarray(at, at + dimension));
}

/** ∂x/∂q of a point, by rows: printed, or by central differences. */
function jacobian_of_point(motion, point, t, q) {
  const { n, system } = motion,
    [at, dimension] = place_of_point(motion, point);
  const printed = system.value("points_jacobian", t, q, motion.u);
  if (printed !== null) return printed.slice(at * n, (at + dimension) * n);
  const jacobian = new Float64Array(dimension * n),
    moved = q.slice();
  for (let j = 0; j < n; j++) {
    const by = 1e-6 * (1 + Math.abs(q[j]));
    moved[j] = q[j] + by;
    const ahead = position_of_point(motion, point, t, moved);
    moved[j] = q[j] - by;
    const behind = position_of_point(motion, point, t, moved);
    moved[j] = q[j];
    for (let i = 0; i < dimension; i++) jacobian[i * n + j] = (ahead[i] - behind[i]) / (2 * by);
  }
  return jacobian;
}

/** Mᵢᵢ of the coordinates. Where M is not printed, T tells it: it is quadratic in each velocity. */
function inertias(motion, t, q) {
  const { n, system, u } = motion,
    mass = system.value("mass_matrix", t, q, u) ?? system.value("terms", t, q, u);
  if (mass !== null) return Float64Array.from({ length: n }, (_, i) => Math.abs(mass[i * n + i]));
  const unit = new Float64Array(n),
    energy = (i, rate) => {
      unit[i] = rate;
      const value = system.value("kinetic_energy", t, q, unit)?.[0] ?? 0;
      unit[i] = 0;
      return value;
    };
  return Float64Array.from({ length: n }, (_, i) =>
    Math.abs(energy(i, 1) + energy(i, -1) - 2 * energy(i, 0)),
  );
}

/** 1/√Mᵢᵢ of the coordinates; those without inertia get the largest of the others, or 1. */
function inertia_scales(motion, t, q) {
  const scale = inertias(motion, t, q).map((x) => (x > 0 && Number.isFinite(x) ? 1 / Math.sqrt(x) : 0));
  const largest = max_abs(scale) || 1;
  return scale.map((s) => (s > 0 ? s : largest));
}

/**
 * The least δ with J δ = e as nearly as damping permits, within Φ_q δ = 0 where there are constraints.
 * `positions`: only holonomic rows restrict it.
 */
function least_change(motion, t, q, jacobian, e, positions, damping = DRAG_DAMPING) {
  const { n, r, system } = motion,
    scale = inertia_scales(motion, t, q),
    count = e.length;
  const own = jacobian.map((x, k) => x * scale[k % n]);
  if (r > 0) {
    const rows = system.value("jacobian", t, q, motion.u),
      active = [];
    for (let row = 0; row < r; row++)
      if (system.holds(row) && (!positions || row < system.holonomic)) active.push(row);
    const a = new Float64Array(active.length * n);
    active.forEach((row, i) => {
      for (let j = 0; j < n; j++) a[i * n + j] = rows[row * n + j] * scale[j];
      const length = norm(a, i * n, (i + 1) * n) || 1;
      for (let j = 0; j < n; j++) a[i * n + j] /= length;
    });
    const space = new Orthogonal(active.length, n);
    space.decompose(a, active.length, 1e-7);
    for (let i = 0; i < count; i++) {
      const part = own.subarray(i * n, (i + 1) * n);
      space.rotate(part);
      part.fill(0, 0, space.rank);
      space.rotate_back(part);
    }
  }
  const square = new Float64Array(count * count),
    weights = new Float64Array(count);
  let trace = 0;
  for (let i = 0; i < count; i++) {
    for (let j = 0; j < count; j++) square[i * count + j] = dot(own, i * n, own, j * n, n);
    trace += square[i * count + i];
  }
  if (!(trace > 0)) return new Float64Array(n);
  for (let i = 0; i < count; i++) square[i * count + i] += damping * trace;
  solve_lu(square, count, factor_lu(square, count), e, weights);
  const delta = new Float64Array(n);
  for (let i = 0; i < count; i++)
    for (let j = 0; j < n; j++) delta[j] += scale[j] * own[i * n + j] * weights[i];
  return delta;
}

/** Contacts of a motion: [row, mode] of each. */
function contact_modes(motion) {
  return motion.locator.unilaterals
    .filter(({ kind }) => kind === "contact")
    .map(({ row, mode }) => [row, mode]);
}

/** Lets contacts hold at which `is_closed(row)`, and opens the others. */
function set_contacts(motion, is_closed) {
  for (const [row, mode] of contact_modes(motion)) motion.m[mode] = is_closed(row) ? 0 : 1;
  motion.system.switch_modes();
}

/** What is across a direction of unit length, of a vector or of rows that begin `stride` numbers apart. */
function across(direction, values, stride = 1) {
  const out = values.slice();
  for (let j = 0; j < stride; j++) {
    const part = direction.reduce((sum, x, i) => sum + x * values[i * stride + j], 0);
    direction.forEach((x, i) => { out[i * stride + j] -= x * part; });
  }
  return out;
}

/**
 * Brings a point as near to a target as it gets, or to the line through the target along a direction of unit
 * length: what a place of a picture of space shows. It leaves the mechanism at rest there. Contacts open
 * where that brings it nearer, and close where the mechanism would sink into them. Returns the distance that
 * is left; the motion is as before where the constraints cannot be fulfilled.
 */
Motion.prototype.drag = function (point, target, along = null) {
  const { n, r, t, system } = this,
    zero = new Float64Array(n),
    modes = this.m.slice(),
    closed = new Set();
  const away = (at) => {
    const position = position_of_point(this, point, t, at);
    const e = Float64Array.from(position, (x, i) => target[i] - x);
    return along ? across(along, e) : e;
  };
  const fulfil = () => set_contacts(this, (row) => closed.has(row));
  // Puts positions onto the constraints; contacts into which these sink are closed from here on.
  const place = (at) => {
    if (r === 0) return true;
    for (;;) {
      if (!system.constraints.project_positions(t, at, zero)) return false;
      const before = closed.size,
        gaps = system.value("residual", t, at, zero)?.slice();
      for (const [row] of contact_modes(this)) {
        const sinks = gaps[row] < 0 && system.constraints.is_missed(t, at, zero, row, gaps[row], SUNK_GAP);
        if (sinks) closed.add(row);
      }
      if (closed.size === before) return true;
      fulfil();
    }
  };
  fulfil();
  let at = { q: this.q.slice(), e: away(this.q) };
  for (let turn = 0, damping = DRAG_DAMPING; turn < MOST_DRAG_STEPS && damping < 1e6; turn++) {
    const full = jacobian_of_point(this, point, t, at.q), jacobian = along ? across(along, full, n) : full;
    const delta = least_change(this, t, at.q, jacobian, at.e, true, damping);
    let change = 0;
    for (let i = 0; i < n; i++) change = Math.max(change, Math.abs(delta[i]) / (1 + Math.abs(at.q[i])));
    const part = change > LARGEST_DRAG_STEP ? LARGEST_DRAG_STEP / change : 1,
      q = at.q.map((x, i) => x + part * delta[i]);
    const e = place(q) ? away(q) : null;
    // Out of reach a step goes too far: more damping turns it towards the steepest descent.
    if (e === null || !(norm(e) < norm(at.e))) {
      damping *= 10;
      continue;
    }
    at = { q, e };
    damping = Math.max(0.2 * damping, DRAG_DAMPING);
    if (!(change > 1e-9)) break;
  }
  const wanted = this.m.slice();
  this.m.set(modes);
  system.switch_modes();
  return this.start(t, at.q, this.rest(t, at.q), this.w, wanted) === null ? norm(at.e) : norm(away(this.q));
};

/** Velocities at which a mechanism rests: zero, but for constraints that move. */
Motion.prototype.rest = function (t, q) {
  const u = new Float64Array(this.n);
  if (this.r > 0) this.system.constraints.project_velocities(t, q, u);
  return u;
};

/**
 * Gives a point a velocity by the least velocities of the coordinates, and starts there. Contacts may open.
 */
Motion.prototype.throw_point = function (point, velocity) {
  const { t, q, system } = this,
    modes = this.m.slice(),
    v = Float64Array.from(velocity);
  const velocities = () => {
    const u = this.rest(t, q),
      delta = least_change(this, t, q, jacobian_of_point(this, point, t, q), v, false);
    for (let i = 0; i < u.length; i++) u[i] += delta[i];
    if (this.r > 0) system.constraints.project_velocities(t, q, u);
    return u;
  };
  set_contacts(this, () => false);
  let u = velocities();
  const rates = this.r > 0 ? system.value("velocity_residual", t, q, u).slice() : [];
  if (contact_modes(this).some(([row, mode]) => modes[mode] === 0 && rates[row] < 0)) {
    set_contacts(this, (row) => rates[row] < 0 && modes[system.row_mode[row]] === 0);
    u = velocities();
  }
  const wanted = this.m.slice();
  this.m.set(modes);
  system.switch_modes();
  return this.start(t, q, u, this.w, wanted);
};
