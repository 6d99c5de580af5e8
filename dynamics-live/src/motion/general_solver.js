// Linear algebra that finds the rank of constraints: a complete orthogonal decomposition, singular values,
// and the general solver of the equations of motion with constraints. The theory of the solver is in
// `dynamics-runtime/src/constrain/system.rs`:
//
//   M a − Φ_qᵀ λ = Q        Φ_q a = γ        M n×n, Φ_q m×n of any rank k
//
// Coordinates are scaled by 1/√Mᵢᵢ and rows to unit length. The rank is decided by pivoting, and λ is
// the one of least norm.

/** A row repeats others where its distance from their span is below this part of its length. */
const RANK_TOLERANCE = 1e-8;
/** A row that may repeat others is chosen before them if its length times this is larger than theirs. */
const REDUNDANT_ROW_WEIGHT = 0.5;
/**
 * Rows that may repeat others come last only where the lengths of all rows differ by less than this factor.
 */
const COMPARABLE_LENGTHS = 30;
/** A light coordinate that outweighs the others of its rows by more is scaled down to this factor, ... */
const MAX_LIGHT_DOMINANCE = 1e3;
/** ... unless it outweighs them by so much that it has practically no inertia. */
const MIN_MASSLESS_DOMINANCE = 1e9;

/** Turns x[from..to] into (β, v₂, …) with H x = β e₁, H = I − τ v vᵀ, v₁ = 1; returns τ. */
function reflector(x, from, to) {
  if (from >= to) return 0;
  const first = x[from],
    tail = norm(x, from + 1, to);
  if (tail === 0) return 0;
  const size = Math.hypot(first, tail),
    beta = first < 0 ? size : -size,
    scale = 1 / (first - beta);
  for (let i = from + 1; i < to; i++) x[i] *= scale;
  x[from] = beta;
  return (beta - first) / beta;
}

/** H x of `count` elements of x, for a reflector that stands in v. */
function reflect(v, from_v, tau, x, from_x, count) {
  let along = x[from_x];
  for (let i = 1; i < count; i++) along += v[from_v + i] * x[from_x + i];
  along *= tau;
  x[from_x] -= along;
  for (let i = 1; i < count; i++) x[from_x + i] -= along * v[from_v + i];
}

/**
 * Complete orthogonal decomposition of the rows of a matrix, with its rank.
 *
 * Aᵀ P = Q [R₁ R₂; 0 0], then [R₁ R₂] = [T 0] Vᵀ: the first `rank` columns of Q span the row
 * space.
 */
class Orthogonal {
  constructor(most_rows, columns) {
    this.n = columns;
    this.tau = new Float64Array(most_rows);
    this.tau_right = new Float64Array(most_rows);
    this.order = new Int32Array(most_rows);
    this.c = new Float64Array(most_rows * most_rows);
    this.w = new Float64Array(most_rows);
    this.rank = 0;
    this.r = 0;
  }

  /**
   * Decomposes r rows of about equal length; a pivot below `tolerance` times the first counts as zero. Rows
   * for which `redundant(row)` are chosen last, so that the same rows lead from one state to the next.
   */
  decompose(a, r, tolerance, redundant = null) {
    this.a = a;
    this.r = r;
    this.rank = 0;
    this.has_redundant_rows = false;
    for (let i = 0; i < r; i++) {
      this.order[i] = i;
      if (redundant !== null && redundant(i)) this.has_redundant_rows = true;
    }
    this.reduce_left(tolerance, redundant);
    if (this.rank < r) this.reduce_right();
  }

  /**
   * The longest of the rows that are left, and its length, of those that may repeat others or of the rest.
   */
  longest(redundant, repeating) {
    const { a, n, r, rank: k, order } = this;
    let [row, size] = [k, 0];
    for (let i = k; i < r; i++) {
      if (this.has_redundant_rows && redundant(order[i]) !== repeating) continue;
      const length = norm(a, i * n + k, (i + 1) * n);
      if (length > size) [row, size] = [i, length];
    }
    return [row, size];
  }

  reduce_left(tolerance, redundant) {
    const { a, n, r, tau, order } = this;
    let first = 0;
    while (this.rank < Math.min(r, n)) {
      const k = this.rank;
      let [row, size] = this.longest(redundant, false);
      if (this.has_redundant_rows) {
        const instead = this.longest(redundant, true);
        if (REDUNDANT_ROW_WEIGHT * instead[1] > size || size <= tolerance * first) [row, size] = instead;
      }
      if (k === 0) first = size;
      if (!(size > tolerance * first)) break;
      if (row !== k) {
        for (let j = 0; j < n; j++) [a[k * n + j], a[row * n + j]] = [a[row * n + j], a[k * n + j]];
        [order[k], order[row]] = [order[row], order[k]];
      }
      tau[k] = reflector(a, k * n + k, (k + 1) * n);
      for (let i = k + 1; i < r; i++) reflect(a, k * n + k, tau[k], a, i * n + k, n - k);
      this.rank++;
    }
  }

  reduce_right() {
    const { a, n, r, c, tau_right, rank } = this;
    c.fill(0);
    for (let i = 0; i < rank; i++) for (let p = i; p < r; p++) c[i * r + p] = a[p * n + i];
    for (let i = 0; i < rank; i++) {
      tau_right[i] = reflector(c, i * r + i, (i + 1) * r);
      for (let l = i + 1; l < rank; l++) reflect(c, i * r + i, tau_right[i], c, l * r + i, r - i);
    }
  }

  /** Qᵀ x, in place. */
  rotate(x) {
    const { a, n, tau, rank } = this;
    for (let j = 0; j < rank; j++) reflect(a, j * n + j, tau[j], x, j, n - j);
  }

  /** Q x, in place. */
  rotate_back(x) {
    const { a, n, tau, rank } = this;
    for (let j = rank - 1; j >= 0; j--) reflect(a, j * n + j, tau[j], x, j, n - j);
  }

  /** Qᵀ M Q of a symmetric M, in place; w: n numbers. */
  rotate_symmetric(m, w) {
    const { a, n, tau, rank } = this;
    for (let j = 0; j < rank; j++) {
      const v = j * n + j,
        count = n - j;
      for (let i = 0; i < n; i++) reflect(a, v, tau[j], m, i * n + j, count);
      for (let l = 0; l < n; l++) w[l] = m[j * n + l];
      for (let i = 1; i < count; i++) for (let l = 0; l < n; l++) w[l] += a[v + i] * m[(j + i) * n + l];
      for (let l = 0; l < n; l++) m[j * n + l] -= tau[j] * w[l];
      for (let i = 1; i < count; i++)
        for (let l = 0; l < n; l++) m[(j + i) * n + l] -= tau[j] * a[v + i] * w[l];
    }
  }

  /** The y that fits A x = b best, x = Q (y, ·); b becomes b − A x. */
  fit(b, y) {
    const { a, n, r, c, tau_right, rank: k, order, w } = this;
    for (let p = 0; p < r; p++) w[p] = b[order[p]];
    if (k === r || this.has_redundant_rows) {
      // The chosen rows are fulfilled exactly; a weighting would change from one state to the next.
      for (let i = 0; i < k; i++) y[i] = (w[i] - dot(a, i * n, y, 0, i)) / a[i * n + i];
      b.fill(0);
      for (let p = k; p < r; p++) b[order[p]] = w[p] - dot(a, p * n, y, 0, k);
      return;
    }
    for (let i = 0; i < k; i++) reflect(c, i * r + i, tau_right[i], w, i, r - i);
    for (let i = k - 1; i >= 0; i--) {
      let later = 0;
      for (let l = i + 1; l < k; l++) later += c[l * r + i] * y[l];
      y[i] = (w[i] - later) / c[i * r + i];
    }
    w.fill(0, 0, k);
    this.spread(b);
  }

  /** The λ of least norm with Aᵀ λ = Q (f, 0). */
  least_norm(f, lambda) {
    const { a, n, r, c, rank: k, order, w } = this;
    if (k === r) {
      for (let i = k - 1; i >= 0; i--) {
        let later = 0;
        for (let l = i + 1; l < k; l++) later += a[l * n + i] * w[l];
        w[i] = (f[i] - later) / a[i * n + i];
        lambda[order[i]] = w[i];
      }
      return;
    }
    w.fill(0, 0, r);
    for (let i = 0; i < k; i++) w[i] = (f[i] - dot(c, i * r, w, 0, i)) / c[i * r + i];
    this.spread(lambda);
  }

  /** P V w. */
  spread(out) {
    const { r, c, tau_right, rank: k, order, w } = this;
    for (let i = k - 1; i >= 0; i--) reflect(c, i * r + i, tau_right[i], w, i, r - i);
    for (let p = 0; p < r; p++) out[order[p]] = w[p];
  }

  /** Whether row i of A is independent of the others, so that its λ is unique. */
  is_independent(i) {
    const { r, c, tau_right, rank: k, order, w } = this;
    if (k === r) return true;
    for (let p = 0; p < r; p++) w[p] = order[p] === i ? 1 : 0;
    for (let j = 0; j < k; j++) reflect(c, j * r + j, tau_right[j], w, j, r - j);
    return norm(w, k, r) <= 1e-8;
  }
}

/**
 * The equations of a constrained system at one state, factored once for any number of right-hand sides.
 */
class FactoredSystem {
  constructor(n, r) {
    this.n = n;
    this.r = r;
    this.rows = new Orthogonal(r, n);
    this.jacobian = new Float64Array(r * n);
    this.mass = new Float64Array(n * n);
    this.scale = new Float64Array(n);
    this.weight = new Float64Array(r);
    this.active = new Int32Array(r);
    this.x = new Float64Array(n);
    this.y = new Float64Array(n);
    this.b = new Float64Array(r);
    this.m = 0;
  }

  /**
   * Factors M and the rows of Φ_q for which `holds(row)`. `usual_lengths`: lengths of rows that are zero
   * here. Returns null, or why it cannot be done.
   */
  factor(mass, jacobian, holds, tolerance, usual_lengths, redundant = null) {
    const { n, r, active, scale, weight, rows } = this,
      own = this.jacobian,
      m = this.mass;
    this.m = 0;
    for (let row = 0; row < r; row++) {
      if (!holds(row)) continue;
      const at = this.m * n;
      for (let j = 0; j < n; j++) {
        own[at + j] = jacobian[row * n + j];
        if (!Number.isFinite(own[at + j])) return { kind: "constraint_not_finite", row };
      }
      active[this.m++] = row;
    }
    this.scale_coordinates(mass);
    const largest = max_abs(scale);
    let [shortest, longest] = [Infinity, 0];
    for (let i = 0; i < this.m; i++) {
      for (let j = 0; j < n; j++) own[i * n + j] *= scale[j];
      const length = norm(own, i * n, (i + 1) * n),
        usual = usual_lengths[active[i]] * largest;
      if (length > 0) [shortest, longest] = [Math.min(shortest, length), Math.max(longest, length)];
      weight[i] = length > 0 ? 1 / length : usual > 0 && Number.isFinite(usual) ? 1 / usual : 1;
      for (let j = 0; j < n; j++) own[i * n + j] *= weight[i];
    }
    for (let i = 0; i < n; i++)
      for (let j = 0; j < n; j++) m[i * n + j] = scale[i] * mass[i * n + j] * scale[j];
    const inertia = max_abs(m);
    const comparable = redundant !== null && longest <= COMPARABLE_LENGTHS * shortest;
    rows.decompose(own, this.m, tolerance, comparable ? (i) => redundant(active[i]) : null);
    rows.rotate_symmetric(m, this.x);
    return this.factor_free(inertia);
  }

  /**
   * sⱼ = 1/√Mⱼⱼ; coordinates without inertia, or with almost none, get the size of their partners.
   */
  scale_coordinates(mass) {
    const { n, scale, m, jacobian } = this;
    const by_inertia = (l) => {
      const inertia = Math.abs(mass[l * n + l]);
      return inertia > 0 && Number.isFinite(inertia) ? 1 / Math.sqrt(inertia) : 0;
    };
    for (let j = 0; j < n; j++) scale[j] = by_inertia(j);
    for (let j = 0; j < n; j++) {
      let own = 0,
        others = 0;
      for (let i = 0; i < m; i++) {
        if (jacobian[i * n + j] === 0) continue;
        own = Math.max(own, Math.abs(jacobian[i * n + j]));
        for (let l = 0; l < n; l++) {
          if (l !== j) others = Math.max(others, Math.abs(jacobian[i * n + l]) * by_inertia(l));
        }
      }
      const massless = scale[j] === 0;
      if (own === 0) {
        if (massless) scale[j] = 1;
      } else if (massless) {
        scale[j] = others > 0 ? others / own : 1 / own;
      } else if (
        scale[j] * own > MAX_LIGHT_DOMINANCE * others &&
        scale[j] * own < MIN_MASSLESS_DOMINANCE * others
      ) {
        scale[j] = (MAX_LIGHT_DOMINANCE * others) / own;
      }
    }
  }

  /** Cholesky of ZᵀMZ, in place. */
  factor_free(inertia) {
    const { n, mass: m } = this,
      k = this.rows.rank;
    for (let j = k; j < n; j++) {
      for (let i = j; i < n; i++) {
        const rest = m[i * n + j] - dot(m, i * n + k, m, j * n + k, j - k);
        if (i === j) {
          if (rest <= PIVOT_TOLERANCE * inertia) return this.singular(j, rest);
          m[j * n + j] = Math.sqrt(rest);
        } else {
          m[i * n + j] = rest / m[j * n + j];
        }
      }
    }
    return null;
  }

  /** Names the coordinate that moves most in the direction without inertia. */
  singular(j, pivot) {
    const { n, mass: m, x, scale } = this,
      k = this.rows.rank;
    x.fill(0);
    x[j] = 1;
    for (let i = j - 1; i >= k; i--) {
      let later = 0;
      for (let l = i + 1; l <= j; l++) later += m[l * n + i] * x[l];
      x[i] = -later / m[i * n + i];
    }
    this.rows.rotate_back(x);
    let coordinate = 0;
    for (let i = 1; i < n; i++) if (Math.abs(x[i]) > Math.abs(x[coordinate])) coordinate = i;
    const negative = pivot < -PIVOT_TOLERANCE * max_abs(m);
    return {
      kind: "singular_mass_matrix",
      coordinate,
      pivot: pivot / (scale[coordinate] * scale[coordinate]),
      negative,
    };
  }

  /**
   * Solves for a and λ with the right-hand sides Q and γ. λ of rows that do not hold is 0. Returns by how
   * much Φ_q a = γ cannot be fulfilled, with the sizes that this is to be compared with.
   */
  solve(force, gamma, a, lambda) {
    const { n, m, active, weight, scale, mass, x, y, b, rows } = this,
      k = rows.rank;
    const left = b.subarray(0, m);
    for (let i = 0; i < m; i++) b[i] = weight[i] * gamma[active[i]];
    const gamma_norm = norm(left);
    rows.fit(left, y);
    const residual = { norm: norm(left), gamma_norm, acceleration_norm: 0, row: 0, residual: 0 };
    let worst = 0;
    for (let i = 1; i < m; i++) if (Math.abs(b[i]) > Math.abs(b[worst])) worst = i;
    if (m > 0) [residual.row, residual.residual] = [active[worst], -b[worst] / weight[worst]];
    for (let j = 0; j < n; j++) x[j] = scale[j] * force[j];
    const forced = norm(x);
    rows.rotate(x);
    for (let i = k; i < n; i++) {
      const known = dot(mass, i * n, y, 0, k),
        inner = dot(mass, i * n + k, y, k, i - k);
      y[i] = (x[i] - known - inner) / mass[i * n + i];
    }
    for (let i = n - 1; i >= k; i--) {
      let later = 0;
      for (let l = i + 1; l < n; l++) later += mass[l * n + i] * y[l];
      y[i] = (y[i] - later) / mass[i * n + i];
    }
    for (let i = 0; i < k; i++) x[i] = dot(mass, i * n, y, 0, n) - x[i];
    rows.least_norm(x, left);
    lambda.fill(0);
    for (let i = 0; i < m; i++) lambda[active[i]] = weight[i] * b[i];
    residual.acceleration_norm = Math.max(norm(y), forced);
    a.set(y);
    rows.rotate_back(a);
    for (let j = 0; j < n; j++) a[j] *= scale[j];
    return residual;
  }

  /** Norm of one value per row, rows at unit length. */
  size_of_rows(values) {
    for (let i = 0; i < this.m; i++) this.b[i] = this.weight[i] * values[this.active[i]];
    return norm(this.b, 0, this.m);
  }

  /** Whether the multiplier of a row is the same in all solutions. */
  is_unique(row) {
    for (let i = 0; i < this.m; i++) if (this.active[i] === row) return this.rows.is_independent(i);
    return true;
  }
}

/**
 * Singular values of a matrix of m rows by one-sided Jacobi rotations of its rows, which it overwrites.
 * `left[j]` is the left singular vector of `sigma[j]`; they are not sorted.
 */
function singular_values(a, m, n) {
  const left = Array.from({ length: m }, (_, i) =>
    Float64Array.from({ length: m }, (_, j) => (i === j ? 1 : 0)),
  );
  for (let sweep = 0, turned = true; turned && sweep < 40; sweep++) {
    turned = false;
    for (let i = 0; i < m; i++) {
      for (let j = i + 1; j < m; j++) {
        const x = dot(a, i * n, a, i * n, n),
          y = dot(a, j * n, a, j * n, n),
          both = dot(a, i * n, a, j * n, n);
        if (!(Math.abs(both) > 4 * Number.EPSILON * Math.sqrt(x * y))) continue;
        turned = true;
        const zeta = (y - x) / (2 * both),
          tan = (zeta < 0 ? -1 : 1) / (Math.abs(zeta) + Math.hypot(1, zeta));
        const c = 1 / Math.hypot(1, tan),
          s = c * tan;
        for (let k = 0; k < n; k++) {
          const [p, q] = [a[i * n + k], a[j * n + k]];
          [a[i * n + k], a[j * n + k]] = [c * p - s * q, s * p + c * q];
        }
        for (let k = 0; k < m; k++) {
          const [p, q] = [left[i][k], left[j][k]];
          [left[i][k], left[j][k]] = [c * p - s * q, s * p + c * q];
        }
      }
    }
  }
  return { sigma: Float64Array.from({ length: m }, (_, i) => norm(a, i * n, (i + 1) * n)), left };
}
