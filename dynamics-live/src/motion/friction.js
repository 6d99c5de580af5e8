// Forces that depend on the reactions of the same instant: Coulomb friction, worm gears, rollers that wedge.
//
//   M a = Q(λ) + Φ_qᵀλ        Φ_q a = γ
//
// With the frictionless system factored, reactions to a given force F are λ = λ₀ + S F, so that
// G(λ) = λ − λ₀ − S Q(λ) = 0 is solved. See `dynamics-runtime/src/constrain/friction.rs`.

/** Up to so many reactions that a force reads all patterns of their signs are tried. */
const MAX_EXHAUSTIVE_REACTIONS = 6;
/** Solutions that differ by less than this part of their size are the same. */
const SAME_SOLUTION = 1e-7;
/** Rounding error of a reaction, in parts of the sum of its terms. */
const REACTION_ROUNDING = 16 * Number.EPSILON;
/** Most Newton steps from one start. Piecewise linear laws take two. */
const MAX_FRICTION_STEPS = 25;

class ReactionForces {
  /** Works with the equations that `constraints` has factored. */
  constructor(constraints) {
    this.constraints = constraints;
    this.system = constraints.system;
  }

  /**
   * Forces that depend on the reactions of the same instant: G(λ) = λ − λ₀ − S Q(λ) = 0 by Newton's
   * method from the frictionless reactions and from every pattern of their signs. Coulomb's law need not have
   * a solution, and may have several.
   */
  solve(t, q, u, a, l) {
    const { system, constraints } = this,
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
    constraints.factored.solve(unit, constraints.gamma, a, problem.unforced);
    for (let j = 0; j < n; j++) {
      unit[j] = 1;
      constraints.factored.solve(unit, none, a, l);
      unit[j] = 0;
      for (let i = 0; i < r; i++) problem.by_force[i * n + j] = l[i];
    }
    this.evaluate(problem, none);
    if (!all_finite(problem.force)) problem.force.set(constraints.force);
    const frictionless = none.map(
      (_, i) => problem.unforced[i] + dot(problem.by_force, i * n, problem.force, 0, n),
    );
    for (const signs of [[1, 1], [-1, 1], [1, -1], [-1, -1], null]) {
      const at =
        signs === null
          ? frictionless
          : frictionless.map((x, i) => signs[0] * (1 + Math.abs(x)) * (i % 2 === 0 ? 1 : signs[1]));
      this.evaluate(problem, at);
      this.add_read_rows(problem);
    }
    // Which reactions Q reads may depend on them, as with a threshold: rows are added until Q settles.
    for (let turn = 0; turn <= r; turn++) {
      const assumed = problem.read.length === 0 ? none : this.find_reactions(problem, frictionless);
      if (assumed === null) return false;
      this.evaluate(problem, assumed);
      const force = problem.force.slice();
      if (!constraints.solve_for(force, a, l)) return false;
      this.evaluate(problem, l);
      const size = SAME_SOLUTION * Math.max(max_abs(force), max_abs(problem.force));
      if (force.every((x, j) => Math.abs(x - problem.force[j]) <= size)) return true;
      if (!this.add_read_rows(problem)) break;
    }
    return system.fail({ kind: "friction_unsolved", row: this.most_loaded(problem, frictionless) });
  }

  evaluate({ t, q, u, force, by_multipliers }, l) {
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
      if (!this.system.holds(row) || read.includes(row)) continue;
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
    const { system, constraints } = this,
      { read } = problem,
      row = this.most_loaded(problem, frictionless);
    const undecided = read.find((own) => !constraints.factored.is_unique(own));
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
      record(this.newton(problem, start));
    }
    if (found.count === 0) {
      // Laws that are not linear in the reactions: damped steps from the frictionless ones.
      for (const relaxation of [1, 0.5, 0.1]) {
        const near = this.relax(problem, frictionless.slice(), relaxation);
        if (near !== null) record(this.newton(problem, near));
        if (found.count > 0) break;
      }
    }
    if (found.count === 1 && !found.negative) return found.first;
    system.fail({ kind: "friction", row, solutions: found.count });
    return null;
  }

  /** λ₀ + S Q(λ) − λ of the rows that are read, and Newton's matrix; false where it is not finite. */
  residual(problem, l, right, matrix) {
    const { n, r } = this.system,
      { read, by_force, by_multipliers, unforced, force } = problem,
      k = read.length;
    this.evaluate(problem, l);
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

  newton(problem, l) {
    const { n } = this.system,
      { read, by_force, unforced, force } = problem,
      k = read.length;
    const right = new Float64Array(k),
      matrix = new Float64Array(k * k),
      step = new Float64Array(k);
    for (let turn = 0; turn < MAX_FRICTION_STEPS; turn++) {
      if (!this.residual(problem, l, right, matrix)) return null;
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
  relax(problem, l, relaxation) {
    const { read } = problem,
      k = read.length,
      right = new Float64Array(k),
      matrix = new Float64Array(k * k);
    for (let turn = 0; turn < 100; turn++) {
      if (!this.residual(problem, l, right, matrix)) return null;
      if (norm(right) <= 1e-6 * Math.max(...read.map((row) => Math.abs(l[row])))) return l;
      for (let i = 0; i < k; i++) l[read[i]] += relaxation * right[i];
    }
    return null;
  }
}
