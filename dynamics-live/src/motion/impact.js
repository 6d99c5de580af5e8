// Impacts: the jump of velocities when constraints take hold at once, by Poisson's hypothesis in two phases.
//
// Compression brings the rates of the rows that hit to zero and keeps those that hold; restitution returns to
// each hit its part of the impulse that it took. Contacts push and do not pull, 0 ≤ Λ ⟂ Φ̇⁺ ≥ 0,
// by principal pivoting (Murty). See `dynamics-runtime/src/constrain/impact.rs`.

/** Most pivots of Murty's method in an impact. */
const MAX_SIDE_CHANGES = 256;
/** Distance |Φ̇|/‖Φ_q‖, in parts of 1 + |q̇|, at which a row counts as at rest after an impact. */
const REST_TOLERANCE = 1e-9;
/** A released contact closes where Φ̇ is below zero by this part of the velocities: less is rounding. */
const CLOSING_ROUNDING = 1e-12;

// ---- impacts

/**
 * Changes the velocities by an impact on the rows `hits`, [{ row, restitution, side }], by Poisson's
 * hypothesis in two phases. `side` is ±1 for contacts, whose impulse only pushes, and 0 for other rows.
 * Rows that hold and are not hit keep holding. Returns false where no impulses fulfil the conditions.
 */
function impact(constraints, t, q, u, hits) {
  const { system } = constraints,
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
  const solve_complementarity = () => {
    const before = system.value("velocity_residual", t, q, after).slice(),
      right = new Float64Array(r);
    const delta = new Float64Array(n),
      impulses = new Float64Array(r),
      next = new Float64Array(n);
    open.clear();
    hits.forEach(({ side, row }, i) => side !== 0 && side * before[row] >= 0 && open.add(i));
    for (let turn = 0; turn < MAX_SIDE_CHANGES; turn++) {
      for (let row = 0; row < r; row++) right[row] = acts(row) ? -before[row] : 0;
      if (!constraints.correct_rows(t, q, after, right, delta, impulses, acts)) return false;
      for (let i = 0; i < n; i++) next[i] = after[i] + delta[i];
      const rates = system.value("velocity_residual", t, q, next),
        size = max_abs(rates) + max_abs(before);
      const wrong = hits.findIndex(
        ({ side, row }, i) =>
          side !== 0 &&
          (open.has(i) ? side * rates[row] < -CLOSING_ROUNDING * size : side * impulses[row] < 0),
      );
      if (wrong >= 0) {
        if (!open.delete(wrong)) open.add(wrong);
        continue;
      }
      if (!check_at_rest(next, rates)) return false;
      after.set(next);
      for (let row = 0; row < r; row++) total[row] += impulses[row];
      return true;
    }
    return system.fail({ kind: "impact_undecided", row: hits[0].row });
  };
  // The rows that act have come to rest: rows that others repeat may be missed.
  const check_at_rest = (velocities, rates) => {
    constraints.evaluate_terms(t, q, velocities);
    for (let row = 0; row < r; row++) {
      if (!acts(row)) continue;
      const [residual, distance] = [rates[row], constraints.distance(row, rates[row])];
      if (distance <= REST_TOLERANCE * (1 + max_abs(velocities))) continue;
      return system.fail({ kind: "off_constraint", what: "velocities", row, residual, distance });
    }
    return true;
  };
  // Proves by Farkas' lemma that no velocities keep all contacts apart: the residual that the best ones leave
  // on all rows together is a combination of rows that does not depend on velocities. Where every contact
  // closes in it, all other velocities leave as much. The failure stays as it is where there is no proof.
  const prove_squeezed = () => {
    const undecided = system.failure,
      before = system.value("velocity_residual", t, q, after).slice(),
      right = new Float64Array(r),
      best = new Float64Array(n);
    if (!["impact_undecided", "off_constraint"].includes(undecided.kind)) return false;
    open.clear();
    for (let row = 0; row < r; row++) right[row] = acts(row) ? -before[row] : 0;
    if (!constraints.correct_rows(t, q, after, right, best, new Float64Array(r), acts)) return false;
    for (let i = 0; i < n; i++) best[i] += after[i];
    const rates = system.value("velocity_residual", t, q, best),
      tolerance = REST_TOLERANCE * (1 + max_abs(best));
    constraints.evaluate_terms(t, q, best);
    let [worst, largest] = [null, tolerance];
    for (const { row, side } of hits) {
      if (side === 0) continue;
      const distance = constraints.distance(row, rates[row]);
      // NaN proves nothing.
      if (Number.isNaN(distance) || (side * rates[row] > 0 && distance > tolerance))
        return system.fail(undecided);
      if (distance > largest) [worst, largest] = [row, distance];
    }
    return system.fail(worst === null ? undecided : { kind: "impact_squeezes", row: worst });
  };
  const compress = () => solve_complementarity() || prove_squeezed();
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
    const factored = constraints.factor(t, q, after, held);
    if (!factored)
      return factored === undefined ? system.fail({ kind: "impact_undecided", row: hits[0].row }) : false;
    constraints.force.fill(0);
    add_constraint_forces(constraints, returned);
    constraints.factored.solve(constraints.force, new Float64Array(r), delta, impulses);
    for (let i = 0; i < n; i++) after[i] += delta[i];
    for (let row = 0; row < r; row++) total[row] += returned[row] + impulses[row];
    if (!compress()) return false;
  }
  u.set(after);
  return true;
}

/** Φ_qᵀ Λ, into `force`. */
function add_constraint_forces(constraints, impulses) {
  const { n, r } = constraints.system;
  for (let row = 0; row < r; row++) {
    for (let j = 0; j < n; j++) constraints.force[j] += impulses[row] * constraints.jacobian[row * n + j];
  }
}
