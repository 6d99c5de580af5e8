//! States within a step: the quintic through q, q̇ and q̈ at both ends, as the ordinary runtime has it.

use crate::integrate::Point;

/// The quintic at the part s of a step of size h, from both ends with their accelerations.
pub(crate) fn quintic(s: f64, h: f64, ends: [(&Point, &Vec<f64>); 2], into: &mut Point) {
    let [(start, a0), (end, a1)] = ends;
    let polynomial = |c: [f64; 6]| c.iter().rev().fold(0.0, |sum, c| sum * s + c);
    let slope = |c: [f64; 6]| (1..6).rev().fold(0.0, |sum, k| sum * s + k as f64 * c[k]);
    let bases = [
        // Of q₁ − q₀; h u₀, h u₁; h² a₀, h² a₁.
        [0.0, 0.0, 0.0, 10.0, -15.0, 6.0],
        [0.0, 1.0, 0.0, -6.0, 8.0, -3.0],
        [0.0, 0.0, 0.0, -4.0, 7.0, -3.0],
        [0.0, 0.0, 0.5, -1.5, 1.5, -0.5],
        [0.0, 0.0, 0.0, 0.5, -1.0, 0.5],
    ];
    let (value, rate) = (bases.map(polynomial), bases.map(slope));
    for i in 0..into.q.len() {
        let parts = [end.q[i] - start.q[i], h * start.u[i], h * end.u[i], h * h * a0[i], h * h * a1[i]];
        let sum = |weights: [f64; 5]| weights.iter().zip(&parts).map(|(w, part)| w * part).sum::<f64>();
        into.q[i] = start.q[i] + sum(value);
        into.u[i] = sum(rate) / h;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quintic_is_exact_for_polynomials_of_order_five() {
        let at = |t: f64| Point { t, q: vec![t.powi(5) - t], u: vec![5.0 * t.powi(4) - 1.0] };
        let a = |t: f64| vec![20.0 * t.powi(3)];
        let (start, end) = (at(0.5), at(2.0));
        let mut middle = at(0.0);
        quintic(0.4, 1.5, [(&start, &a(0.5)), (&end, &a(2.0))], &mut middle);
        let exact = at(1.1);
        assert!((middle.q[0] - exact.q[0]).abs() < 1e-13 && (middle.u[0] - exact.u[0]).abs() < 1e-13);
    }
}
