// Dense linear algebra for a few dozen unknowns: norms and LU. Matrices are Float64Arrays by rows.

/** A pivot of M below this part of its diagonal element is rounding. */
const PIVOT_TOLERANCE = 1e-13;

/** Largest absolute value of a part of a vector; NaN where an element is NaN. */
function max_abs(x, from = 0, to = x.length) {
  let most = 0;
  for (let i = from; i < to; i++) {
    const size = Math.abs(x[i]);
    if (size > most || size !== size) most = size;
    if (most !== most) return NaN;
  }
  return most;
}

/** Euclidean norm of a part of a vector, without overflow. */
function norm(x, from = 0, to = x.length) {
  let square = 0;
  for (let i = from; i < to; i++) square += x[i] * x[i];
  if (square >= 1e-250 && square < 1e250) return Math.sqrt(square);
  const size = max_abs(x, from, to);
  if (size === 0 || !Number.isFinite(size)) return size;
  square = 0;
  for (let i = from; i < to; i++) square += (x[i] / size) * (x[i] / size);
  return size * Math.sqrt(square);
}

/** Σ aᵢ bᵢ of `count` elements of two vectors from the given places on. */
function dot(a, from_a, b, from_b, count) {
  let sum = 0;
  for (let i = 0; i < count; i++) sum += a[from_a + i] * b[from_b + i];
  return sum;
}

function all_finite(x) {
  for (let i = 0; i < x.length; i++) if (!Number.isFinite(x[i])) return false;
  return true;
}

/**
 * LU with row scaling and partial pivoting, in place. Returns the exchanges, the least scaled pivot and the
 * sign of the determinant.
 */
function factor_lu(a, n) {
  const order = new Int32Array(n),
    scale = new Float64Array(n);
  let least = Infinity,
    negative = false;
  for (let i = 0; i < n; i++) [order[i], scale[i]] = [i, max_abs(a, i * n, (i + 1) * n) || 1];
  for (let k = 0; k < n; k++) {
    let pivot = k;
    for (let i = k + 1; i < n; i++) {
      if (Math.abs(a[i * n + k]) / scale[i] > Math.abs(a[pivot * n + k]) / scale[pivot]) pivot = i;
    }
    if (pivot !== k) {
      for (let j = 0; j < n; j++) [a[k * n + j], a[pivot * n + j]] = [a[pivot * n + j], a[k * n + j]];
      [order[k], order[pivot]] = [order[pivot], order[k]];
      [scale[k], scale[pivot]] = [scale[pivot], scale[k]];
      negative = !negative;
    }
    const size = Math.abs(a[k * n + k]) / scale[k];
    if (!(size >= least)) least = size;
    if (a[k * n + k] < 0) negative = !negative;
    for (let i = k + 1; i < n; i++) {
      const factor = (a[i * n + k] /= a[k * n + k]);
      if (factor !== 0) for (let j = k + 1; j < n; j++) a[i * n + j] -= factor * a[k * n + j];
    }
  }
  return { order, least, negative };
}

/** Solves with the factors of `factor_lu`. */
function solve_lu(a, n, { order }, b, x) {
  for (let i = 0; i < n; i++) x[i] = b[order[i]] - dot(a, i * n, x, 0, i);
  for (let i = n - 1; i >= 0; i--) x[i] = (x[i] - dot(a, i * n + i + 1, x, i + 1, n - 1 - i)) / a[i * n + i];
}
