// Functions that printed programs call, with the conventions of `dynamics-vocabulary/src/math.rs`.
//
// Sine and cosine have the bits of `dynamics-simd/src/lanes/sines.rs` without fused products: reduction by
// three parts of π/2, fdlibm's polynomials by Estrin's scheme. Every operation is written in the order of
// the Rust code, because another order rounds differently. All other functions are those of the JavaScript
// engine.

/** The cosine that belongs to the sine which `sin_cos` returned last. In a variable it would be boxed. */
const cosine = new Float64Array(1);

/** Largest |x| that is reduced here; beyond, the engine's functions, as Rust takes those of the platform. */
const LARGEST_REDUCED = 1048576;

/** sin x; leaves cos x in `cosine[0]`. */
function sin_cos(x) {
  if (!(x >= -LARGEST_REDUCED && x <= LARGEST_REDUCED)) {
    cosine[0] = Math.cos(x);
    return Math.sin(x);
  }
  // k = round(2x/π); 1.5·2⁵² leaves the nearest integer. Then x = kπ/2 + r − c.
  const k = x * 0.6366197723675814 + 6755399441055744 - 6755399441055744;
  const first = x - k * 1.5707963267341256,
    w = k * 6.077100506303966e-11,
    second = first - w;
  const rest = k * 2.0222662487959506e-21 - (first - second - w);
  const r = second - rest,
    c = rest - (second - r);
  const z = r * r,
    v = z * r,
    zz = z * z;
  // sin(r − c)
  const of_c = c * (z * -0.5 + 1);
  const of_sine =
    zz * (zz * 1.58969099521155e-10 + (z * -2.5050760253406863e-8 + 2.7557313707070068e-6)) +
    (z * -0.0001984126982985795 + 0.00833333333332249);
  const s = r - (of_c - z * v * of_sine - v * -0.16666666666666632);
  // cos(r − c)
  const half = 0.5 * r,
    less = 1 - half * r,
    added = half * r + (less - 1);
  const of_cosine =
    zz *
      (zz * (z * -1.1359647557788195e-11 + 2.087572321298175e-9) +
        (z * -2.7557314351390663e-7 + 2.480158728947673e-5)) +
    (z * -0.001388888888887411 + 0.0416666666666666);
  const e = less - (added - r * c - zz * of_cosine);
  switch (k & 3) {
    case 0:
      cosine[0] = e;
      return s;
    case 1:
      cosine[0] = -s;
      return e;
    case 2:
      cosine[0] = -e;
      return -s;
    default:
      cosine[0] = s;
      return -e;
  }
}

function sin(x) {
  return sin_cos(x);
}
function cos(x) {
  sin_cos(x);
  return cosine[0];
}

/** The pair by the engine's own functions: for models with `sin_cos = accurate`. */
function accurate_sin_cos(x) {
  cosine[0] = Math.cos(x);
  return Math.sin(x);
}

const { tan, asin, acos, atan, atan2, sinh, cosh, tanh, exp, sqrt, cbrt, hypot, abs, floor, ceil } = Math;
const ln = Math.log;

/**
 * xʸ. JavaScript has NaN for a base of 1 with an infinite or NaN exponent, and for −1 with an infinite
 * one.
 */
function powf(x, y) {
  if (x === 1 || (x === -1 && (y === Infinity || y === -Infinity))) return 1;
  return Math.pow(x, y);
}

/** xⁿ by repeated squaring, in the order of `powi` in Rust. */
function powi(x, n) {
  let remaining = Math.abs(n),
    square = x,
    product = 1;
  while (remaining !== 0) {
    if (remaining % 2 === 1) product *= square;
    remaining = Math.floor(remaining / 2);
    square *= square;
  }
  return n < 0 ? 1 / product : product;
}

/** 1 for x ≥ +0, −1 for x ≤ −0, NaN for NaN. */
function signum(x) {
  if (x > 0) return 1;
  if (x < 0) return -1;
  return x === 0 ? (1 / x > 0 ? 1 : -1) : x;
}

/** The lesser, the first where they are equal; NaN if either is. */
function min(a, b) {
  return a <= b ? a : b < a ? b : NaN;
}

/** The greater, the first where they are equal; NaN if either is. */
function max(a, b) {
  return a >= b ? a : b > a ? b : NaN;
}

/** ab + c, with two roundings. */
function mul_add(a, b, c) {
  return a * b + c;
}

/**
 * The derivative of some order of a polynomial Σ c_k dᵏ at d.
 *
 * The factors k(k−1)… stand inside Horner's scheme, as in `CubicSpline`.
 */
function polynomial(c, d, order) {
  let sum = 0;
  for (let k = c.length - 1; k >= order; k--) {
    let factor = 1;
    for (let j = 0; j < order; j++) factor *= k - j;
    sum = sum * d + factor * c[k];
  }
  return sum;
}

/** x moved by whole periods into the domain of a periodic function, with the roundings of `CubicSpline`. */
function wrapped_into([first, last], x) {
  const past = (x - first) % (last - first),
    inside = past < 0 ? last + past : first + past;
  return inside < first ? first : inside > last ? last : inside;
}

/**
 * A smooth function of the model, (x, order) => derivative of that order, from its pieces.
 *
 * Piece i stands in powers of x − knots[i]. Beyond the first and the last knot the function is continued as
 * `outside` says: `linear`, `periodic`, or not at all, which is NaN. As `dynamics-vocabulary/src/spline.rs`.
 */
function piecewise({ knots, coefficients, outside }) {
  const pieces = knots.length - 1,
    domain = [knots[0], knots[pieces]],
    [first, last] = domain;
  // The piece of x in the domain, the one on the right at an inner knot.
  const piece_of = (x) => {
    let low = 0,
      high = pieces;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (x >= knots[middle]) low = middle;
      else high = middle;
    }
    return low;
  };
  const inside = (x, order) => {
    const piece = piece_of(x);
    return polynomial(coefficients[piece], x - knots[piece], order);
  };
  const derivative = (x, order) => {
    if (first <= x && x <= last) return inside(x, order);
    if (!Number.isFinite(x)) return NaN;
    if (outside === "periodic") return inside(wrapped_into(domain, x), order);
    if (outside !== "linear") return NaN;
    if (order > 1) return 0;
    const end = x < first ? first : last,
      slope = inside(end, 1);
    return order === 1 ? slope : inside(end, 0) + slope * (x - end);
  };
  // The interval around x in which all derivatives are continuous.
  derivative.piece = (x) => {
    const at = outside === "periodic" ? wrapped_into(domain, x) : x;
    if (at < first) return [-Infinity, first];
    if (at > last) return [last, Infinity];
    if (Number.isNaN(at)) return [-Infinity, Infinity];
    const piece = piece_of(at);
    return [knots[piece] + (x - at), knots[piece + 1] + (x - at)];
  };
  derivative.domain = domain;
  return derivative;
}

/** A number as Rust's `{:e}` has it. */
function scientific(x, digits) {
  if (!Number.isFinite(x)) return Number.isNaN(x) ? "NaN" : x > 0 ? "inf" : "-inf";
  return x.toExponential(digits).replace("e+", "e");
}

/** A number with seven digits, with a power of ten where it is very large or small. */
function rounded(x) {
  const short = Number(x.toPrecision(7)),
    size = Math.abs(short);
  return short === 0 || (size >= 1e-4 && size < 1e7) ? String(short) : scientific(short);
}
