// Rank of the constraints: how near they are to losing it, and accelerations where they have lost it.

/** Singular values of Φ_q below this part of the largest count as zero. */
const SINGULAR_VALUE_TOLERANCE = 1e-7;
/** Condition from which on a position is singular: accelerations there are limits along a branch. */
const BRANCH_LIMIT_CONDITION = 1e6;
/**
 * Time to either side of a singular position at which a limit is evaluated, in parts of that of the motion.
 */
const SIDE_INTERVAL = 1e-3;
/** Relative difference up to which accelerations of both sides agree. */
const MAX_SIDE_DIFFERENCE = 0.05;
/**
 * A limit replaces the accelerations of least norm where they differ by more than this part of their size.
 */
const BRANCH_LIMIT_DIFFERENCE = 1e-5;

class RankMargin {
  constructor(constraints) {
    this.constraints = constraints;
    this.system = constraints.system;
    const rows = this.system.model.rows ?? [];
    /** The constraint of each row: rows of one constraint are called `closure.x`, `closure.y`. */
    this.constraint_of = rows.map(({ name }) => name.split(/[.[]/)[0]);
  }

  /**
   * The accelerations in a singular position: their limit along the branch of the velocities, from both sides
   * and two distances. Those of least norm belong to no branch.
   */
  take_limit(t, q, u, a, l) {
    const { system, constraints } = this,
      { rank } = constraints.factored.rows,
      active = constraints.factored.m;
    const { condition, names } = this.at(t, q, u);
    if (condition < BRANCH_LIMIT_CONDITION) return true;
    const undetermined = () => system.fail({ kind: "branch_undetermined", rank, active, names });
    const speed = max_abs(u),
      force = max_abs(a),
      found = a.slice(),
      carried = l.slice();
    // At rest and without forces it stays; where forces begin to move it branches are open.
    if (speed === 0) return force === 0 || undetermined();
    const tau = SIDE_INTERVAL * Math.min(1 / speed, speed / force),
      other = l.slice();
    const at = (by) => {
      const there_q = q.map((x, i) => x + by * (u[i] + 0.5 * by * found[i]));
      const there_u = u.map((x, i) => x + by * found[i]),
        there = found.slice();
      const fits =
        constraints.project_positions(t + by, there_q, there_u) &&
        constraints.project_velocities(t + by, there_q, there_u);
      return fits && system.accelerate(t + by, there_q, there_u, there, other) ? there : null;
    };
    const mean = (by) => {
      const before = at(-by),
        after = at(by);
      if (before === null || after === null) return null;
      const difference = max_abs(before.map((x, i) => after[i] - x));
      return { mean: before.map((x, i) => 0.5 * (x + after[i])), difference };
    };
    const count = system.evaluations;
    constraints.takes_limits = false;
    const near = mean(tau),
      far = near === null ? null : mean(2 * tau);
    constraints.takes_limits = true;
    system.evaluations = count;
    l.set(carried);
    a.set(found);
    if (far === null) return undetermined();
    // Errors of the means grow as τ²: Richardson extrapolation.
    const limit = near.mean.map((x, i) => (4 * x - far.mean[i]) / 3),
      size = max_abs(limit);
    const permitted = MAX_SIDE_DIFFERENCE * Math.max(size, force, speed * speed);
    const apart = max_abs(near.mean.map((x, i) => x - far.mean[i]));
    if (!(apart <= permitted && near.difference <= permitted) || !Number.isFinite(size))
      return undetermined();
    const difference = max_abs(limit.map((x, i) => x - found[i]));
    if (difference > BRANCH_LIMIT_DIFFERENCE * (force + speed * speed)) a.set(limit);
    return true;
  }

  /**
   * How far the constraints are from losing rank: largest over smallest singular value of Φ_q, coordinates
   * scaled by √Mᵢᵢ, the rows of a constraint by the longest of them; and the names of the rows that
   * would depend on each other. Of redundant rows as many count as are independent nearby.
   */
  at(t, q, u) {
    const { constraints } = this,
      { n, r } = this.system,
      found = this.singular_values_at(t, q, u);
    if (found === null) return { condition: 1, names: [] };
    const { sigma, left, active } = found,
      order = Array.from(sigma.keys()).sort((i, j) => sigma[j] - sigma[i]);
    const rank_of = (values) => values.filter((x) => x > SINGULAR_VALUE_TOLERANCE * max_abs(values)).length;
    let expected = sigma.length;
    if (constraints.redundant) {
      const beside = q.map((x, i) => x + NEARBY_DISTANCE * (1 + Math.abs(x)) * (1 + (0.37 * i) / n)),
        kept = constraints.right.slice();
      const there = constraints.project_positions(t, beside, u)
        ? this.singular_values_at(t, beside, u)
        : null;
      constraints.right.set(kept);
      expected = Math.max(rank_of(sigma), there === null ? 0 : rank_of(there.sigma));
    }
    const least = order[expected - 1],
      shares = Array.from(left[least], (x, i) => [active[i], x * x]);
    const top = shares.filter(([, share]) => share > 0.01).sort((x, y) => y[1] - x[1]);
    const names = top.slice(0, 3).map(([row]) => this.system.model.rows?.[row]?.name ?? `row ${row}`);
    return { condition: sigma[least] > 0 ? sigma[order[0]] / sigma[least] : Infinity, names };
  }

  singular_values_at(t, q, u) {
    const { constraints } = this,
      { n, r } = this.system,
      active = [];
    constraints.evaluate_terms(t, q, u);
    for (let row = 0; row < r; row++) if (constraints.holds(row)) active.push(row);
    const rows = new Float64Array(active.length * n),
      longest = new Map();
    active.forEach((row, i) => {
      for (let j = 0; j < n; j++) {
        const inertia = Math.abs(constraints.mass[j * n + j]);
        rows[i * n + j] = constraints.jacobian[row * n + j] / (inertia > 0 ? Math.sqrt(inertia) : 1);
      }
      const of = this.constraint_of[row];
      longest.set(of, Math.max(longest.get(of) ?? 0, norm(rows, i * n, (i + 1) * n)));
    });
    if (active.length === 0 || !all_finite(rows)) return null;
    active.forEach((row, i) => {
      const length = longest.get(this.constraint_of[row]);
      for (let j = 0; j < n; j++) rows[i * n + j] /= length || 1;
    });
    return { ...singular_values(rows, active.length, n), active };
  }
}
