// Constraints of a motion: accelerations by the general solver, projection, impacts.
//
// Everything goes by the printed programs where these apply; the general solver takes over where a guard
// fails, where rows repeat each other, and where forces depend on reactions. The parts correspond to
// `dynamics-runtime/src/constrain/`: `project.rs`, `correct.rs`, `friction.rs`, `impact.rs`.

/** Most Newton steps of a projection. From a drift of 10⁻³ four are enough. */
const MAX_NEWTON_STEPS = 25;
/** Distance, in parts of 1 + |q|, at which constraints count as satisfied where they cannot all be. */
const ADMISSIBLE_DISTANCE = 1e-9;
/** Largest violation with which a start counts as consistent, in parts of its size. */
const CONSISTENT = 1e-6;
/**
 * Φ_q a = γ counts as contradictory where the best a leaves a residual above this part of the size of γ.
 */
const CONTRADICTION_TOLERANCE = 1e-6;
/** This part of ‖a‖ is added to the size of γ in that test: at rest γ is rounding only. */
const ROUNDING_PER_ACCELERATION = 1e-6;
/** Curvature of constraints up to which redundant rows are recognised at a distance from the manifold. */
const REDUNDANT_ROW_CURVATURE = 100;
/** Rows that differ by more than this part of their length count as independent. */
const MAX_REDUNDANCY_TOLERANCE = 0.1;
/** A row is compared with its usual length where it is shorter than this part of the longest row, or of 1. */
const SHORT_LENGTH_RATIO = 1e-6;
/** A row has vanished where its length is below this part of its usual length. */
const VANISHED_LENGTH_RATIO = 1e-8;
/** Displacement at which usual lengths are measured, in parts of 1 + |q|. */
const NEARBY_DISTANCE = 1e-3;
/** Length of a vanished row, in parts of its usual length, in the distance from its constraint. */
const VANISHED_ROW_LENGTH = 1e-4;

class Constraints {
  constructor(system) {
    const { n, r } = system;
    this.system = system;
    this.factored = new FactoredSystem(n, r);
    this.mass = new Float64Array(n * n);
    this.force = new Float64Array(n);
    this.jacobian = new Float64Array(r * n);
    this.gamma = new Float64Array(r);
    this.gamma_terms = new Float64Array(r);
    this.usual_lengths = new Float64Array(r);
    this.right = new Float64Array(r);
    this.delta = new Float64Array(n);
    this.impulses = new Float64Array(r);
    this.tolerance = RANK_TOLERANCE;
    /** Sensitivity of the projections so far: their corrections over the violations, the geometric mean. */
    this.mean_sensitivity = 0;
    const rows = system.model.rows ?? [],
      flagged = rows.some((row) => row.redundant !== undefined);
    /** Rows may repeat each other: the model says so, or has no solution of its own for that reason. */
    this.redundant = flagged
      ? rows.some((row) => row.redundant)
      : !system.has("accelerations") && !system.has("friction");
    this.is_redundant_row = this.redundant ? (row) => !flagged || rows[row].redundant === true : null;
    this.friction = new ReactionForces(this);
    this.margin = new RankMargin(this);
    this.sensitivity = 0;
    this.latest_sensitivity = 0;
    this.noise = 0;
    this.takes_limits = true;
    this.has_positions = system.holonomic > 0;
    this.holds = (row) => system.holds(row);
    this.all_hold = () => true;
    this.position_rows = (row) => row < system.holonomic && system.holds(row);
  }

  // ---- M, Q, Φ_q, γ

  /** Evaluates the terms of the general solver; rows that have vanished become zero. */
  evaluate_terms(t, q, u) {
    const { system } = this,
      { n, r } = system;
    this.read_terms(t, q, u);
    this.usual_lengths.fill(0);
    let [least, most] = [Infinity, 1];
    for (let i = 0; i < r; i++) {
      const size = max_abs(this.jacobian, i * n, (i + 1) * n);
      [least, most] = [Math.min(least, size), Math.max(most, size)];
    }
    if (!(least < SHORT_LENGTH_RATIO * most)) return;
    const here = Float64Array.from({ length: r }, (_, i) => norm(this.jacobian, i * n, (i + 1) * n));
    const beside = q.map((x, i) => x + NEARBY_DISTANCE * (1 + Math.abs(x)) * (1 + (0.37 * i) / n));
    this.read_terms(t + NEARBY_DISTANCE * (1 + Math.abs(t)), beside, u);
    for (let i = 0; i < r; i++)
      this.usual_lengths[i] = norm(this.jacobian, i * n, (i + 1) * n) / NEARBY_DISTANCE;
    this.read_terms(t, q, u);
    for (let i = 0; i < r; i++) {
      if (here[i] <= VANISHED_LENGTH_RATIO * this.usual_lengths[i]) this.jacobian.fill(0, i * n, (i + 1) * n);
    }
  }

  read_terms(t, q, u) {
    const { n, r } = this.system,
      out = this.system.value("terms", t, q, u);
    let at = 0;
    for (const part of [this.mass, this.force, this.jacobian, this.gamma]) {
      for (let i = 0; i < part.length; i++) part[i] = out[at + i];
      at += part.length;
    }
    for (let i = 0; i < r; i++) {
      this.gamma_terms[i] = 0;
      for (let j = 0; j < n; j++) this.gamma_terms[i] += Math.abs(this.jacobian[i * n + j]) * u[j] * u[j];
    }
  }

  /** |residual|/‖gradient‖ of a row, after `evaluate_terms`. */
  distance(row, residual) {
    const { n } = this.system,
      length = norm(this.jacobian, row * n, (row + 1) * n);
    if (residual === 0) return 0;
    return Math.abs(residual) / (length === 0 ? VANISHED_ROW_LENGTH * this.usual_lengths[row] : length);
  }

  /** Whether a row is missed by more than this part of its size. */
  is_missed(t, q, u, row, residual, part) {
    this.evaluate_terms(t, q, u);
    return this.distance(row, residual) > part * this.size_along(t, q, u, row, q);
  }

  /** (A q̇ + b)/‖A‖ of a row, or Φ̇/‖Φ_q‖. */
  slip_velocity(t, q, u, row) {
    const slip = this.system.value("velocity_residual", t, q, u)[row];
    this.evaluate_terms(t, q, u);
    return Math.sign(slip) * this.distance(row, slip);
  }

  /** The side to which a row slips, ±1; 0 where it slips by no more than a start may violate it. */
  slip_side(t, q, u, row) {
    const slip = this.slip_velocity(t, q, u, row);
    return Math.abs(slip) > CONSISTENT * this.size_along(t, q, u, row, u) ? Math.sign(slip) : 0;
  }

  /**
   * The size of what a row involves, of coordinates or velocities `values`: of each the model's own size and
   * the largest value of the same unit together. As `size_along` in
   * `dynamics-runtime/src/constrain/assemble.rs`.
   */
  size_along(t, q, u, row, values) {
    const { system } = this,
      { n } = system,
      { coordinates } = system.model,
      gradient = system.value("jacobian", t, q, u).subarray(row * n, (row + 1) * n),
      steepness = norm(gradient);
    if (!(steepness > 0)) return 1 + max_abs(values);
    let sum = 0;
    for (let i = 0; i < n; i++) {
      if (gradient[i] === 0) continue;
      let largest = 0;
      for (let j = 0; j < n; j++)
        if (coordinates[j].unit === coordinates[i].unit) largest = Math.max(largest, Math.abs(values[j]));
      sum += Math.abs(gradient[i]) * (system.own_size(i) + largest);
    }
    return sum / steepness;
  }

  /**
   * Factors the equations of the rows for which `holds(row)`. False where they cannot be factored;
   * `undefined` where M or Q is not finite, as in models without constraints.
   */
  factor(t, q, u, holds) {
    this.evaluate_terms(t, q, u);
    if (!all_finite(this.mass) || !all_finite(this.force)) return undefined;
    const { system } = this,
      { r } = system;
    for (let row = 0; row < r; row++) {
      if (holds(row) && !Number.isFinite(this.gamma[row]))
        return system.fail({ kind: "constraint_not_finite", row });
    }
    this.tolerance = this.redundant ? this.redundancy_tolerance(t, q, u, holds) : RANK_TOLERANCE;
    const failure = this.factored.factor(
      this.mass,
      this.jacobian,
      holds,
      this.tolerance,
      this.usual_lengths,
      this.is_redundant_row,
    );
    return failure === null ? true : system.fail(failure);
  }

  /** Rows that repeat each other on the manifold differ beside it by the order of the distance. */
  redundancy_tolerance(t, q, u, holds) {
    const { system } = this;
    const largest = (values, at) => {
      let most = 0;
      for (let row = 0; values !== null && row < values.length; row++) {
        const distance = holds(row) ? this.distance(row, values[row]) : 0;
        if (distance < Infinity) most = Math.max(most, distance);
      }
      return most / (1 + max_abs(at));
    };
    const distance = Math.max(
      largest(system.value("residual", t, q, u), q),
      largest(system.value("velocity_residual", t, q, u), u),
    );
    return Math.min(Math.max(REDUNDANT_ROW_CURVATURE * distance, RANK_TOLERANCE), MAX_REDUNDANCY_TOLERANCE);
  }

  // ---- accelerations by the general solver

  /** q̈ and λ at a state. */
  solve(t, q, u, a, l) {
    const { system } = this,
      factored = this.factor(t, q, u, this.holds);
    if (factored === undefined) {
      a.fill(NaN);
      l.fill(NaN);
      return true;
    }
    if (!factored) return false;
    if (system.has("friction")) return this.friction.solve(t, q, u, a, l);
    if (!this.solve_for(this.force, a, l)) return false;
    const { m, rows } = this.factored;
    const loses_rank = rows.rank < m && m === system.r && !this.redundant && this.takes_limits;
    return loses_rank ? this.margin.take_limit(t, q, u, a, l) : true;
  }

  /** The same for given applied forces, with the equations factored. */
  solve_for(force, a, l) {
    const { factored, system } = this,
      residual = factored.solve(force, this.gamma, a, l);
    const size =
      residual.gamma_norm +
      factored.size_of_rows(this.gamma_terms) +
      ROUNDING_PER_ACCELERATION * residual.acceleration_norm;
    if (residual.norm <= Math.max(CONTRADICTION_TOLERANCE, 100 * this.tolerance) * size) return true;
    const { row, residual: missed } = residual;
    return system.fail({ kind: "contradiction", row, residual: missed, rank: factored.rows.rank });
  }

  // ---- corrections and projection

  /** δ of least M-norm with Φ_q δ = right, into `delta`; false where it does not exist. */
  correct(t, q, u, right, delta, positions) {
    const { system } = this,
      { n, correction } = system;
    if (correction !== null) {
      const out = system.call(correction, t, q, u, undefined, right);
      if (system.is_admitted(correction, n)) {
        for (let i = 0; i < n; i++) delta[i] = out[i];
        return true;
      }
    }
    this.by_general_solver = true;
    return this.correct_rows(
      t,
      q,
      u,
      right,
      delta,
      this.impulses,
      positions ? this.position_rows : this.holds,
    );
  }

  /** The same by the general solver, for the rows for which `holds(row)`, with the impulses. */
  correct_rows(t, q, u, right, delta, impulses, holds) {
    const factored = this.factor(t, q, u, holds);
    if (factored === undefined) {
      delta.fill(NaN);
      impulses.fill(NaN);
      return true;
    }
    if (!factored) return false;
    // A state on the constraints fulfils all rows, redundant ones included.
    this.factored.rows.has_redundant_rows = false;
    this.force.fill(0);
    this.factored.solve(this.force, right, delta, impulses);
    return true;
  }

  /**
   * −Φ of the rows that hold, or −Φ̇, into `right`; its largest size, NaN where a row is not finite.
   */
  residual(t, q, u, positions) {
    const { system, right } = this,
      { r } = system;
    const values = system.value(positions ? "residual" : "velocity_residual", t, q, u);
    let largest = 0;
    for (let row = 0; row < r; row++) {
      const applies = system.holds(row) && (!positions || row < system.holonomic);
      right[row] = applies ? -values[row] : 0;
      if (!Number.isFinite(right[row])) {
        system.fail({ kind: "constraint_not_finite", row });
        return NaN;
      }
      largest = Math.max(largest, Math.abs(right[row]));
    }
    return largest;
  }

  /** Moves q to Φ(q, t) = 0, to rounding level. */
  project_positions(t, q, u) {
    if (!this.has_positions) return true;
    const { delta } = this;
    this.by_general_solver = false;
    let largest = this.residual(t, q, u, true),
      halvings = 0;
    for (let turn = 0; !(largest === 0); turn++) {
      if (largest !== largest) return false;
      if (turn === MAX_NEWTON_STEPS) {
        return halvings >= 8 ? this.vanishing_gradient(t, q, u) : this.off_constraint(t, q, u, true);
      }
      if (!this.correct(t, q, u, this.right, delta, true)) return false;
      this.sensitivity = Math.max(this.sensitivity, max_abs(delta) / largest);
      let change = 0;
      for (let i = 0; i < q.length; i++) change = max(change, Math.abs(delta[i]) / (1 + Math.abs(q[i])));
      for (let i = 0; i < q.length; i++) q[i] += delta[i];
      const before = largest;
      largest = this.residual(t, q, u, true);
      if (largest !== largest) return false;
      if (!Number.isFinite(change) || (turn > 0 && largest > 10 * before && change > 1e-3)) {
        return this.off_constraint(t, q, u, true);
      }
      if (largest / before >= 0.2 && largest / before < 0.3) halvings++;
      if (change === 0 && halvings >= 8) return this.vanishing_gradient(t, q, u);
      // Quadratic convergence predicts the next correction: rounding is not corrected.
      if (change * (largest / before) <= 2 * Number.EPSILON || (change <= 1e-7 && largest >= 0.5 * before))
        break;
    }
    return !this.by_general_solver || this.is_admissible(t, q, u, true);
  }

  /** Changes u to Φ_q u + Φ_t = 0 and A u + b = 0. */
  project_velocities(t, q, u) {
    const { delta } = this;
    this.by_general_solver = false;
    // The second pass removes the rounding errors of a large first one.
    for (let pass = 0; pass < 2; pass++) {
      const largest = this.residual(t, q, u, false);
      if (largest !== largest) return false;
      if (largest === 0) break;
      if (!this.correct(t, q, u, this.right, delta, false)) return false;
      this.sensitivity = Math.max(this.sensitivity, max_abs(delta) / largest);
      let change = 0;
      for (let i = 0; i < u.length; i++) change = max(change, Math.abs(delta[i]) / (1 + Math.abs(u[i])));
      for (let i = 0; i < u.length; i++) u[i] += delta[i];
      if (!Number.isFinite(change)) return this.off_constraint(t, q, u, false);
      if (change <= 1e-4) break;
    }
    return !this.by_general_solver || this.is_admissible(t, q, u, false);
  }

  /** Positions, then velocities. `noise` is then the error that rounding leaves in the velocities. */
  project(t, q, u) {
    this.sensitivity = 0;
    if (!this.project_positions(t, q, u) || !this.project_velocities(t, q, u)) return false;
    this.latest_sensitivity =
      this.sensitivity > 0 && Number.isFinite(this.sensitivity) ? this.sensitivity : 0;
    this.noise = this.projection_noise(q, u);
    return true;
  }

  /**
   * Φ is known to ε(1 + |q|). Where corrections are A times as large as in the mean, positions are wrong by
   * A times that along the direction that is nearly lost, and velocities by A²|q̇| times that.
   */
  projection_noise(q, u) {
    const { sensitivity } = this;
    if (!(sensitivity > 0 && Number.isFinite(sensitivity))) return 0;
    if (this.mean_sensitivity === 0) this.mean_sensitivity = sensitivity;
    const amplified = Math.max(sensitivity / this.mean_sensitivity, 1);
    return Number.EPSILON * (1 + max_abs(q)) * amplified * (1 + amplified * max_abs(u));
  }

  /**
   * Projects a state between the ends of a step, unless rounding would change its velocities by more than the
   * projection does and than the tolerance permits.
   */
  project_between(t, q, u, { absolute, relative }) {
    const new_q = q.slice(),
      new_u = u.slice();
    this.sensitivity = 0;
    if (!this.project_positions(t, new_q, new_u) || !this.project_velocities(t, new_q, new_u)) return;
    if (this.sensitivity === 0) return;
    let change = absolute + relative * max_abs(new_u);
    for (let i = 0; i < u.length; i++) change = max(change, Math.abs(new_u[i] - u[i]));
    if (this.projection_noise(new_q, new_u) <= change) {
      q.set(new_q);
      u.set(new_u);
    }
  }

  /** A step was accepted: its sensitivity joins the mean. */
  accept_step() {
    if (this.latest_sensitivity > 0) {
      this.mean_sensitivity = Math.pow(this.mean_sensitivity, 0.9) * Math.pow(this.latest_sensitivity, 0.1);
      this.latest_sensitivity = 0;
    }
  }

  /** The row with the largest distance: [row, residual, distance]. */
  worst_row(t, q, u, positions) {
    this.evaluate_terms(t, q, u);
    this.residual(t, q, u, positions);
    let worst = [0, 0, 0];
    for (let row = 0; row < this.right.length; row++) {
      const distance = this.right[row] === 0 ? 0 : this.distance(row, this.right[row]);
      if (!(distance <= worst[2])) worst = [row, -this.right[row], distance];
    }
    return worst;
  }

  is_admissible(t, q, u, positions) {
    const [, , distance] = this.worst_row(t, q, u, positions);
    if (distance <= ADMISSIBLE_DISTANCE * (1 + max_abs(positions ? q : u))) return true;
    return this.off_constraint(t, q, u, positions);
  }

  off_constraint(t, q, u, positions) {
    const [row, residual, distance] = this.worst_row(t, q, u, positions);
    const what = positions ? "positions" : "velocities";
    return this.system.fail({ kind: "off_constraint", what, row, residual, distance });
  }

  vanishing_gradient(t, q, u) {
    const { n, holonomic } = this.system;
    this.evaluate_terms(t, q, u);
    let [row, least] = [0, Infinity];
    for (let i = 0; i < holonomic; i++) {
      const length = norm(this.jacobian, i * n, (i + 1) * n);
      if (this.holds(i) && length < least) [row, least] = [i, length];
    }
    return this.system.fail({ kind: "vanishing_gradient", row });
  }

  /** Whether a start fulfils the constraints to what is typed. */
  check_start(t, q, u) {
    for (const positions of [true, false]) {
      if (positions && !this.has_positions) continue;
      const [row, residual, distance] = this.worst_row(t, q, u, positions);
      // A rotation about a fixed point has no speed: positions count for velocities, too.
      const size = Math.max(max_abs(q), positions ? 1 : Math.max(max_abs(u), 1));
      if (!(distance <= CONSISTENT * size)) {
        const kind = positions ? "constraint_violated" : "velocity_violated";
        return this.system.fail({ kind, row, residual, distance });
      }
    }
    return true;
  }

  /** The part of a change of positions or velocities that the rows forbid, into `delta`. */
  inadmissible_part(t, q, u, change, delta, positions) {
    const { system, right } = this,
      { n, r } = system,
      jacobian = system.value("jacobian", t, q, u);
    for (let row = 0; row < r; row++) {
      const applies = system.holds(row) && (!positions || row < system.holonomic);
      right[row] = applies ? dot(jacobian, row * n, change, 0, n) : 0;
    }
    return this.correct(t, q, u, right, delta, positions);
  }

  /** The largest violation of a row, in permitted errors. */
  violation(t, q, u, absolute, relative) {
    this.evaluate_terms(t, q, u);
    let worst = 0;
    for (const positions of this.has_positions ? [true, false] : [false]) {
      const permitted = absolute + relative * max_abs(positions ? q : u);
      if (Number.isNaN(this.residual(t, q, u, positions))) return Infinity;
      for (let row = 0; row < this.right.length; row++) {
        worst = Math.max(worst, this.distance(row, this.right[row]) / permitted);
      }
    }
    return worst;
  }
}
