//! Smooth functions as tables: knots, and a cubic polynomial between each two of them.

use dynamics_runtime::smooth::{Outside, Pieces};

use crate::source::{elements, suffix};

/// The derivative of some order at x, with the roundings of `CubicSpline` in Rust; NaN where it is not known.
const EVALUATION: &str = "\
/* Derivative of some order of a cubic polynomial at d; factors stand inside of Horner's scheme. */
static real $_polynomial(const real *c, real d, int order)
{
  real sum = 0.0@;
  int power;
  int j;
  for (power = 3; power >= order; power--) {
    real factor = 1.0@;
    for (j = 0; j < order; j++) {
      factor *= (real)(power - j);
    }
    sum = sum*d + factor*c[power];
  }
  return sum;
}

/* The same at x in the domain, from the piece on its right. */
static real $_inside(const real *knots, const real (*c)[4], int pieces, real x, int order)
{
  int low = 0;
  int high = pieces;
  while (high - low > 1) {
    const int middle = (low + high)/2;
    if (x >= knots[middle]) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return $_polynomial(c[low], x - knots[low], order);
}

/* The same anywhere. Outside of the domain: 0 not known, 1 straight lines, 2 it repeats itself. */
static real $_smooth(const real *knots, const real (*c)[4], int pieces, int outside, real x,
  int order)
{
  const real first = knots[0];
  const real last = knots[pieces];
  real value = (real)NAN;
  if ((first <= x) && (x <= last)) {
    value = $_inside(knots, c, pieces, x, order);
  } else if (!isfinite(x)) {
    value = (real)NAN;
  } else if (outside == 2) {
    const real past = fmod@(x - first, last - first);
    const real moved = (past < 0.0@) ? (last + past) : (first + past);
    const real at = (moved < first) ? first : ((moved > last) ? last : moved);
    value = $_inside(knots, c, pieces, at, order);
  } else if ((outside == 1) && (order > 1)) {
    value = 0.0@;
  } else if (outside == 1) {
    const real end = (x < first) ? first : last;
    const real slope = $_inside(knots, c, pieces, end, 1);
    value = (order == 1) ? slope : ($_inside(knots, c, pieces, end, 0) + slope*(x - end));
  } else {
    value = (real)NAN;
  }
  return value;
}

";

/// Tables and functions of those that programs call.
pub(crate) fn functions(name: &str, programs: &str, all: &[Pieces], single: bool) -> String {
    let called = |(i, _): &(usize, &Pieces)| programs.contains(&format!("{name}_function_{i}("));
    let texts: String = all.iter().enumerate().filter(called).map(|of| function(name, of, single)).collect();
    if texts.is_empty() {
        return texts;
    }
    EVALUATION.replace('$', name).replace('@', suffix(single)) + &texts
}

fn function(name: &str, (i, pieces): (usize, &Pieces), single: bool) -> String {
    let Pieces { knots, coefficients, outside } = pieces;
    let rows: Vec<String> = coefficients
        .iter()
        .map(|row| format!("  {{ {} }}", elements(row.iter().copied(), single).trim_start()))
        .collect();
    let outside = match outside {
        Outside::Unknown => 0,
        Outside::Linear => 1,
        Outside::Periodic => 2,
    };
    format!(
        "static const real {name}_knots_{i}[{}] = {{\n{}\n}};\n\
         static const real {name}_coefficients_{i}[{}][4] = {{\n{}\n}};\n\
         static real {name}_function_{i}(real x, int order)\n{{\n  \
         return {name}_smooth({name}_knots_{i}, {name}_coefficients_{i}, {}, {outside}, x, order);\n}}\n\n",
        knots.len(),
        elements(knots.iter().copied(), single),
        coefficients.len(),
        rows.join(",\n"),
        coefficients.len(),
    )
}
