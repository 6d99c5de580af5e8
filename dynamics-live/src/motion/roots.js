// Zeros of functions along a step: samples, refinement where two zeros may hide, and location.

/** Accuracy of crossings, in parts of the step. */
const CROSSING_RESOLUTION = 1e-12;

function sign_of(value) {
  return value > 0 ? 1 : value < 0 ? -1 : 0;
}

/** The part of a step of a sample: nearly equidistant, but not quite, so that no oscillation hides. */
function sample_position(part, parts) {
  if (part === 0 || part === parts) return part / parts;
  const turns = part * 0.618033988749895;
  return (part + 0.4 * (turns - Math.floor(turns) - 0.5)) / parts;
}

/**
 * Samples with further ones where a function comes near zero between three of them and turns back: the vertex
 * of the parabola through these, twice.
 */
function refined(column, g) {
  const out = [column[0]];
  for (let k = 1; k < column.length; k++) {
    const a = column[Math.max(k - 2, 0)],
      b = column[k - 1],
      c = column[k];
    const d = column[Math.min(k + 1, column.length - 1)];
    let best = null;
    for (const [x, y, z] of [
      [a, b, c],
      [b, c, d],
    ]) {
      if (x[0] === y[0] || y[0] === z[0] || sign_of(b[1]) !== sign_of(c[1])) continue;
      const first = (y[1] - x[1]) / (y[0] - x[0]),
        second = (z[1] - y[1]) / (z[0] - y[0]);
      const bend = (second - first) / (z[0] - x[0]),
        vertex = 0.5 * (x[0] + y[0]) - (0.5 * first) / bend;
      // A minimum of |g| inside of this part that comes near zero.
      if (!(vertex > b[0] && vertex < c[0]) || bend * b[1] <= 0) continue;
      const value = x[1] + first * (vertex - x[0]) + bend * (vertex - x[0]) * (vertex - y[0]);
      if (Math.abs(value) < 0.5 * Math.min(Math.abs(b[1]), Math.abs(c[1])) || value * b[1] < 0) best = vertex;
    }
    if (best !== null) {
      let middle = [best, g(best)];
      if (middle[1] * b[1] > 0) {
        const first = (middle[1] - b[1]) / (middle[0] - b[0]),
          second = (c[1] - middle[1]) / (c[0] - middle[0]);
        const bend = (second - first) / (c[0] - b[0]),
          again = 0.5 * (b[0] + middle[0]) - (0.5 * first) / bend;
        if (again > b[0] && again < c[0]) middle = [again, g(again)];
      }
      out.push(middle);
    }
    out.push(c);
  }
  return out;
}

/**
 * The crossings (θ, direction) of a function that is followed from sample to sample from a known sign on.
 */
function follow(column, sign, g, resolution = CROSSING_RESOLUTION) {
  const found = [];
  for (let k = 1; k < column.length; k++) {
    const to = column[k],
      now = sign_of(to[1]);
    if (now === 0 || now === sign) continue;
    if (sign !== 0) {
      const from = column[k - 1];
      found.push([sign_of(from[1]) === sign ? illinois(g, from, to, resolution) : from[0], now]);
    }
    sign = now;
  }
  return found;
}

/** A root between two points of different signs by the Illinois method; the end beyond the crossing. */
function illinois(g, [a, ga], [b, gb], resolution) {
  for (let turn = 0; turn < 100 && b - a > resolution; turn++) {
    let x = b - (gb * (b - a)) / (gb - ga);
    // Every third step halves the interval, so that it ends even where the function jumps.
    if (!(x > a && x < b) || turn % 3 === 2) x = 0.5 * (a + b);
    if (x === a || x === b) break;
    const value = g(x);
    if (value === 0) return x;
    if (sign_of(value) === sign_of(gb)) {
      [b, gb] = [x, value];
      ga *= 0.5;
    } else {
      [a, ga] = [x, value];
      gb *= 0.5;
    }
  }
  return b;
}
