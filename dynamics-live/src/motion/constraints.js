// Constraints of a motion: accelerations by the general solver, projection, impacts.
//
// Everything goes by the printed programs where these apply; the general solver takes over where a guard fails,
// where rows repeat each other, and where forces depend on reactions. The parts correspond to
// `dynamics-runtime/src/constrain/`: `project.rs`, `correct.rs`, `friction.rs`, `impact.rs`.

/** Most Newton steps of a projection. From a drift of 10⁻³ four are enough. */
const MAX_NEWTON_STEPS = 25;
/** Distance, in parts of 1 + |q|, at which constraints count as satisfied where they cannot all be. */
const ADMISSIBLE_DISTANCE = 1e-9;
/** Largest violation with which a start counts as consistent, in parts of its size. */
const CONSISTENT = 1e-6;
/** Φ_q a = γ counts as contradictory where the best a leaves a residual above this part of the size of γ. */
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
/** Up to so many reactions that a force reads all patterns of their signs are tried. */
const MAX_EXHAUSTIVE_REACTIONS = 6;
/** Solutions that differ by less than this part of their size are the same. */
const SAME_SOLUTION = 1e-7;
/** Rounding error of a reaction, in parts of the sum of its terms. */
const REACTION_ROUNDING = 16 * Number.EPSILON;
/** Most pivots of Murty's method in an impact. */
const MAX_SIDE_CHANGES = 256;

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

  /**
   * Factors the equations of the rows for which `holds(row)`. False where they cannot be factored; `undefined`
   * where M or Q is not finite, as in models without constraints.
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
    const failure = this.factored.factor(this.mass, this.jacobian, holds, this.tolerance, this.usual_lengths);
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
    return system.has("friction") ? this.solve_friction(t, q, u, a, l) : this.solve_for(this.force, a, l);
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

  /**
   * Forces that depend on the reactions of the same instant: G(λ) = λ − λ₀ − S Q(λ) = 0 by Newton's method
   * from the frictionless reactions and from every pattern of their signs. Coulomb's law need not have a
   * solution, and may have several.
   */
  solve_friction(t, q, u, a, l) {
    const { system, factored } = this,
      { n, r } = system,
      unit = new Float64Array(n),
      none = new Float64Array(r);
    const problem = {
      t,
      q,
      u,
      unforced: new Float64Array(r),
      by_force: new Float64Array(r * n),
      read: [],
      force: new Float64Array(n),
      by_multipliers: new Float64Array(n * r),
    };
    factored.solve(unit, this.gamma, a, problem.unforced);
    for (let j = 0; j < n; j++) {
      unit[j] = 1;
      factored.solve(unit, none, a, l);
      unit[j] = 0;
      for (let i = 0; i < r; i++) problem.by_force[i * n + j] = l[i];
    }
    this.evaluate_friction(problem, none);
    if (!all_finite(problem.force)) problem.force.set(this.force);
    const frictionless = none.map(
      (_, i) => problem.unforced[i] + dot(problem.by_force, i * n, problem.force, 0, n),
    );
    for (const signs of [[1, 1], [-1, 1], [1, -1], [-1, -1], null]) {
      const at =
        signs === null
          ? frictionless
          : frictionless.map((x, i) => signs[0] * (1 + Math.abs(x)) * (i % 2 === 0 ? 1 : signs[1]));
      this.evaluate_friction(problem, at);
      this.add_read_rows(problem);
    }
    // Which reactions Q reads may depend on them, as with a threshold: rows are added until Q settles.
    for (let turn = 0; turn <= r; turn++) {
      const assumed = problem.read.length === 0 ? none : this.find_reactions(problem, frictionless);
      if (assumed === null) return false;
      this.evaluate_friction(problem, assumed);
      const force = problem.force.slice();
      if (!this.solve_for(force, a, l)) return false;
      this.evaluate_friction(problem, l);
      const size = SAME_SOLUTION * Math.max(max_abs(force), max_abs(problem.force));
      if (force.every((x, j) => Math.abs(x - problem.force[j]) <= size)) return true;
      if (!this.add_read_rows(problem)) break;
    }
    return system.fail({ kind: "friction_unsolved", row: this.most_loaded(problem, frictionless) });
  }

  evaluate_friction({ t, q, u, force, by_multipliers }, l) {
    const out = this.system.value("friction", t, q, u, undefined, l),
      { n, r } = this.system;
    for (let i = 0; i < n; i++) force[i] = out[i];
    for (let i = 0; i < n * r; i++) by_multipliers[i] = out[n + i];
  }

  /** Adds the rows with ∂Q/∂λ ≠ 0 in the last evaluation; returns whether there were new ones. */
  add_read_rows({ read, by_multipliers }) {
    const { n, r } = this.system,
      before = read.length;
    for (let row = 0; row < r; row++) {
      if (!this.holds(row) || read.includes(row)) continue;
      for (let j = 0; j < n; j++) {
        if (by_multipliers[j * r + row] !== 0) {
          read.push(row);
          break;
        }
      }
    }
    return read.length > before;
  }

  most_loaded({ read }, l) {
    return read.reduce((most, row) => (Math.abs(l[row]) > Math.abs(l[most]) ? row : most), read[0] ?? 0);
  }

  /** The reactions that fulfil the equations with friction; `null` where there are none, or several. */
  find_reactions(problem, frictionless) {
    const { system, factored } = this,
      { read } = problem,
      row = this.most_loaded(problem, frictionless);
    const undecided = read.find((own) => !factored.is_unique(own));
    if (undecided !== undefined) {
      system.fail({ kind: "reaction_not_unique", row: undecided });
      return null;
    }
    const patterns = 1 << Math.min(read.length, MAX_EXHAUSTIVE_REACTIONS),
      largest = max_abs(frictionless);
    const found = { first: null, negative: false, count: 0 };
    const record = (solution) => {
      if (solution === null) return;
      const { l, negative } = solution,
        size = SAME_SOLUTION * Math.max(...read.map((i) => Math.abs(l[i])), 1e-300);
      if (found.first === null) Object.assign(found, { first: l, negative, count: 1 });
      else if (read.every((i) => Math.abs(l[i] - found.first[i]) <= size)) found.negative &&= negative;
      else found.count = 2;
    };
    for (let pattern = 0; pattern <= patterns && found.count < 2; pattern++) {
      const start = frictionless.slice();
      for (let i = 0; pattern > 0 && i < read.length; i++) {
        const size = Math.max(Math.abs(start[read[i]]), 1e-3 * largest, Number.MIN_VALUE);
        start[read[i]] = ((pattern - 1) >> (i % MAX_EXHAUSTIVE_REACTIONS)) & 1 ? -size : size;
      }
      record(this.newton_friction(problem, start));
    }
    if (found.count === 0) {
      // Laws that are not linear in the reactions: damped steps from the frictionless ones.
      for (const relaxation of [1, 0.5, 0.1]) {
        const near = this.relax_friction(problem, frictionless.slice(), relaxation);
        if (near !== null) record(this.newton_friction(problem, near));
        if (found.count > 0) break;
      }
    }
    if (found.count === 1 && !found.negative) return found.first;
    system.fail({ kind: "friction", row, solutions: found.count });
    return null;
  }

  /** λ₀ + S Q(λ) − λ of the rows that are read, and Newton's matrix; false where it is not finite. */
  friction_residual(problem, l, right, matrix) {
    const { n, r } = this.system,
      { read, by_force, by_multipliers, unforced, force } = problem,
      k = read.length;
    this.evaluate_friction(problem, l);
    for (let i = 0; i < k; i++) {
      const influence = read[i] * n;
      right[i] = unforced[read[i]] + dot(by_force, influence, force, 0, n) - l[read[i]];
      for (let j = 0; j < k; j++) {
        let by = 0;
        for (let x = 0; x < n; x++) by += by_force[influence + x] * by_multipliers[x * r + read[j]];
        matrix[i * k + j] = (i === j ? 1 : 0) - by;
      }
    }
    return all_finite(right);
  }

  newton_friction(problem, l) {
    const { n } = this.system,
      { read, by_force, unforced, force } = problem,
      k = read.length;
    const right = new Float64Array(k),
      matrix = new Float64Array(k * k),
      step = new Float64Array(k);
    for (let turn = 0; turn < MAX_NEWTON_STEPS; turn++) {
      if (!this.friction_residual(problem, l, right, matrix)) return null;
      const largest = Math.max(...read.map((row) => Math.abs(l[row])));
      const rounding =
        REACTION_ROUNDING *
        Math.max(
          ...read.map((row) => {
            let terms = Math.abs(unforced[row]);
            for (let j = 0; j < n; j++) terms += Math.abs(by_force[row * n + j] * force[j]);
            return terms;
          }),
        );
      const lu = factor_lu(matrix, k),
        residual = max_abs(right);
      if (residual <= Math.max(rounding, 1e-13 * largest)) return { l, negative: lu.negative };
      if (!(lu.least > 1e-14)) return null;
      solve_lu(matrix, k, lu, right, step);
      for (let i = 0; i < k; i++) l[read[i]] += step[i];
      if (
        max_abs(step) <= Math.max(rounding, 1e-15 * largest) &&
        residual <= SAME_SOLUTION * Math.max(rounding / REACTION_ROUNDING, largest)
      ) {
        return { l, negative: lu.negative };
      }
    }
    return null;
  }

  /** The limit of λ ← λ + ω (λ₀ + S Q(λ) − λ), near enough for Newton's method. */
  relax_friction(problem, l, relaxation) {
    const { read } = problem,
      k = read.length,
      right = new Float64Array(k),
      matrix = new Float64Array(k * k);
    for (let turn = 0; turn < 100; turn++) {
      if (!this.friction_residual(problem, l, right, matrix)) return null;
      if (norm(right) <= 1e-6 * Math.max(...read.map((row) => Math.abs(l[row])))) return l;
      for (let i = 0; i < k; i++) l[read[i]] += relaxation * right[i];
    }
    return null;
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
    this.force.fill(0);
    this.factored.solve(this.force, right, delta, impulses);
    return true;
  }

  /** −Φ of the rows that hold, or −Φ̇, into `right`; its largest size, NaN where a row is not finite. */
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
    const { sensitivity } = this;
    this.noise = 0;
    if (sensitivity > 0 && Number.isFinite(sensitivity)) {
      if (this.mean_sensitivity === 0) this.mean_sensitivity = sensitivity;
      this.latest_sensitivity = sensitivity;
      const amplified = Math.max(sensitivity / this.mean_sensitivity, 1);
      this.noise = Number.EPSILON * (1 + max_abs(q)) * amplified * (1 + amplified * max_abs(u));
    }
    return true;
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

  // ---- impacts

  /**
   * Changes the velocities by an impact on the rows `hits`, [{ row, restitution, side }], by Poisson's
   * hypothesis in two phases. `side` is ±1 for contacts, whose impulse only pushes, and 0 for other rows.
   * Rows that hold and are not hit keep holding. Returns false where no impulses fulfil the conditions.
   */
  impact(t, q, u, hits) {
    const { system } = this,
      { n, r } = system,
      total = new Float64Array(r),
      after = u.slice();
    const hit_of = new Int32Array(r).fill(-1),
      open = new Set();
    hits.forEach(({ row }, i) => (hit_of[row] = i));
    let restoring = false;
    const acts = (row) => {
      const hit = hit_of[row];
      if (hit < 0) return system.holds(row);
      const { side, restitution } = hits[hit];
      return !open.has(hit) && !(restoring && side === 0 && restitution !== 0);
    };
    const compress = () => {
      const before = system.value("velocity_residual", t, q, after).slice(),
        right = new Float64Array(r);
      const delta = new Float64Array(n),
        impulses = new Float64Array(r),
        next = new Float64Array(n);
      open.clear();
      hits.forEach(({ side, row }, i) => side !== 0 && side * before[row] >= 0 && open.add(i));
      for (let turn = 0; turn < MAX_SIDE_CHANGES; turn++) {
        for (let row = 0; row < r; row++) right[row] = acts(row) ? -before[row] : 0;
        if (!this.correct_rows(t, q, after, right, delta, impulses, acts)) return false;
        for (let i = 0; i < n; i++) next[i] = after[i] + delta[i];
        const rates = system.value("velocity_residual", t, q, next),
          size = max_abs(rates) + max_abs(before);
        const wrong = hits.findIndex(
          ({ side, row }, i) =>
            side !== 0 && (open.has(i) ? side * rates[row] < -1e-12 * size : side * impulses[row] < 0),
        );
        if (wrong >= 0) {
          if (!open.delete(wrong)) open.add(wrong);
          continue;
        }
        after.set(next);
        for (let row = 0; row < r; row++) total[row] += impulses[row];
        return true;
      }
      return system.fail({ kind: "impact_undecided", row: hits[0].row });
    };
    if (!compress()) return false;
    if (hits.some(({ restitution }) => restitution !== 0)) {
      restoring = true;
      const returned = new Float64Array(r),
        delta = new Float64Array(n),
        impulses = new Float64Array(r);
      hits.forEach(({ row, restitution }) => (returned[row] = restitution * total[row]));
      const held = (row) => {
        const hit = hit_of[row];
        return hit < 0 ? system.holds(row) : hits[hit].side === 0 && hits[hit].restitution === 0;
      };
      const factored = this.factor(t, q, after, held);
      if (!factored)
        return factored === undefined ? system.fail({ kind: "impact_undecided", row: hits[0].row }) : false;
      this.force.fill(0);
      this.evaluate_jacobian_force(returned);
      this.factored.solve(this.force, new Float64Array(r), delta, impulses);
      for (let i = 0; i < n; i++) after[i] += delta[i];
      for (let row = 0; row < r; row++) total[row] += returned[row] + impulses[row];
      if (!compress()) return false;
    }
    u.set(after);
    this.total_impulses = total;
    return true;
  }

  /** Φ_qᵀ Λ, into `force`. */
  evaluate_jacobian_force(impulses) {
    const { n, r } = this.system;
    for (let row = 0; row < r; row++) {
      for (let j = 0; j < n; j++) this.force[j] += impulses[row] * this.jacobian[row * n + j];
    }
  }
}
