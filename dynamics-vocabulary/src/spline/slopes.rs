//! The slopes mᵢ = f′(xᵢ) of the splines, from the continuity of f″ at the inner knots,
//!
//! ```text
//! hᵢ mᵢ₋₁ + 2(hᵢ₋₁ + hᵢ) mᵢ + hᵢ₋₁ mᵢ₊₁ = 3(hᵢ δᵢ₋₁ + hᵢ₋₁ δᵢ),    hᵢ = xᵢ₊₁ − xᵢ,   δᵢ = (yᵢ₊₁ − yᵢ)/hᵢ,
//! ```
//!
//! and one condition per end (de Boor, *A Practical Guide to Splines*, 2001, chapter IV, equations 8 to 15).

use alloc::vec::Vec;

/// A row of a tridiagonal system: below·m₋₁ + diagonal·m + above·m₊₁ = right.
#[derive(Clone, Copy)]
struct Row {
    below: f64,
    diagonal: f64,
    above: f64,
    right: f64,
}

/// h₀(2m₀ + m₁) = 3h₀δ₀, which says f″ = 0, and the same at the end; with the factor h₀ the rows are of one
/// size.
pub(super) fn natural(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let (h, d) = differences(knots, values);
    let last = h.len() - 1;
    let mut rows = inner_rows(&h, &d);
    rows.insert(0, Row { below: 0.0, diagonal: 2.0 * h[0], above: h[0], right: 3.0 * h[0] * d[0] });
    rows.push(Row { below: h[last], diagonal: 2.0 * h[last], above: 0.0, right: 3.0 * h[last] * d[last] });
    solve(rows)
}

/// m₀ and the last m as given.
pub(super) fn clamped(knots: &[f64], values: &[f64], [first, last]: [f64; 2]) -> Vec<f64> {
    let (h, d) = differences(knots, values);
    let mut rows = inner_rows(&h, &d);
    rows.insert(0, Row { below: 0.0, diagonal: 1.0, above: 0.0, right: first });
    rows.push(Row { below: 0.0, diagonal: 1.0, above: 0.0, right: last });
    solve(rows)
}

/// f‴ continuous at x₁: h₁m₀ + (h₀ + h₁)m₁ = ((3h₀ + 2h₁)h₁δ₀ + h₀²δ₁)/(h₀ + h₁), and its mirror image at the
/// end.
pub(super) fn not_a_knot(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let (h, d) = differences(knots, values);
    let end = |h0: f64, h1: f64, d0: f64, d1: f64| {
        let span = h0 + h1;
        // The factors are divided first, so that widely spaced knots do not overflow in squares.
        let right = (3.0 * h0 + 2.0 * h1) * (h1 / span) * d0 + h0 * (h0 / span) * d1;
        (h1, span, right)
    };
    let last = h.len() - 1;
    let mut rows = inner_rows(&h, &d);
    let (diagonal, above, right) = end(h[0], h[1], d[0], d[1]);
    rows.insert(0, Row { below: 0.0, diagonal, above, right });
    let (diagonal, below, right) = end(h[last], h[last - 1], d[last], d[last - 1]);
    rows.push(Row { below, diagonal, above: 0.0, right });
    solve(rows)
}

/// The continuity of f″ at the common end point closes the system to a cycle; its two corner elements are a
/// rank-1 change of a tridiagonal matrix (Sherman–Morrison).
pub(super) fn periodic(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let (h, d) = differences(knots, values);
    let last = h.len() - 1;
    // Unknowns m₀ … m_last; m of the last knot is m₀.
    let mut rows = inner_rows(&h, &d);
    let diagonal = 2.0 * (h[last] + h[0]);
    let right = 3.0 * (h[0] * d[last] + h[last] * d[0]);
    rows.insert(0, Row { below: 0.0, diagonal, above: h[last], right });
    let (corner_first, corner_last) = (h[0], rows[last].above);
    // A = B + u vᵀ with u = (γ, 0, …, corner_last), v = (1, 0, …, corner_first/γ); γ < 0 keeps B dominated by
    // its diagonal.
    let gamma = -diagonal;
    rows[0].diagonal -= gamma;
    rows[last].diagonal -= corner_first * corner_last / gamma;
    rows[last].above = 0.0;
    let mut column: Vec<Row> = rows.iter().map(|&row| Row { right: 0.0, ..row }).collect();
    (column[0].right, column[last].right) = (gamma, corner_last);
    let (particular, column) = (solve(rows), solve(column));
    let along = |x: &[f64]| x[0] + corner_first / gamma * x[last];
    let factor = along(&particular) / (1.0 + along(&column));
    let mut slopes: Vec<f64> = particular.iter().zip(&column).map(|(p, c)| p - factor * c).collect();
    slopes.push(slopes[0]);
    slopes
}

/// Widths hᵢ of the intervals and slopes δᵢ of the secants.
fn differences(knots: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let widths: Vec<f64> = knots.windows(2).map(|x| x[1] - x[0]).collect();
    let secants = values.windows(2).zip(&widths).map(|(y, h)| (y[1] - y[0]) / h).collect();
    (widths, secants)
}

/// Continuity of f″ at every inner knot.
fn inner_rows(h: &[f64], d: &[f64]) -> Vec<Row> {
    let row = |i: usize| Row {
        below: h[i],
        diagonal: 2.0 * (h[i - 1] + h[i]),
        above: h[i - 1],
        right: 3.0 * (h[i] * d[i - 1] + h[i - 1] * d[i]),
    };
    (1..h.len()).map(row).collect()
}

/// Gaussian elimination without pivoting, O(n).
///
/// All systems here allow it: their rows are dominated by the diagonal, except the first and the last of
/// `not_a_knot`. After its first row (h₁, h₀ + h₁) the second has the pivot h₀ + h₁ beside h₀, and every
/// following pivot pᵢ > 2hᵢ₋₁ + hᵢ is more than twice its neighbour hᵢ₋₁; the last is hₗ(1 − (hₗ + hₗ₊₁)/p)
/// with p > hₗ + hₗ₊₁, thus positive.
fn solve(mut rows: Vec<Row>) -> Vec<f64> {
    for i in 1..rows.len() {
        let (above, here) = (rows[i - 1], &mut rows[i]);
        let factor = here.below / above.diagonal;
        here.diagonal -= factor * above.above;
        here.right -= factor * above.right;
    }
    let mut next = 0.0;
    let mut solution: Vec<f64> = rows
        .iter()
        .rev()
        .map(|row| {
            next = (row.right - row.above * next) / row.diagonal;
            next
        })
        .collect();
    solution.reverse();
    solution
}
