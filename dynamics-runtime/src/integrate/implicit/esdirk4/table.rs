//! The coefficients of ESDIRK4(3)6L[2]SA: Kennedy & Carpenter, NASA/TM–2016–219173, table 16.
//!
//! γ = ¼ and the nodes given, each row but the fifth follows from its two conditions of stage order 2, the
//! last one, which is the step itself, from the order, and the fifth from what order 4 asks for beyond that.

const ROOT_2: f64 = core::f64::consts::SQRT_2;

/// Number of stages; the first is the start.
pub(super) const STAGES: usize = 6;
/// The diagonal of A.
pub(super) const GAMMA: f64 = 0.25;
/// Nodes.
pub(super) const C: [f64; STAGES] = [0.0, 0.5, (2.0 - ROOT_2) / 4.0, 0.625, 1.04, 1.0];

const THIRD: f64 = (1.0 - ROOT_2) / 8.0;
const FOURTH: f64 = (5.0 - 7.0 * ROOT_2) / 64.0;
const FIFTH: f64 = (-13796.0 - 54539.0 * ROOT_2) / 125_000.0;
const LAST: f64 = (1181.0 - 987.0 * ROOT_2) / 13_782.0;

/// Runge–Kutta matrix; its last row is the weights of the step.
pub(super) const A: [[f64; STAGES]; STAGES] = [
    [0.0; STAGES],
    [GAMMA, GAMMA, 0.0, 0.0, 0.0, 0.0],
    [THIRD, THIRD, GAMMA, 0.0, 0.0, 0.0],
    [FOURTH, FOURTH, 7.0 * (1.0 + ROOT_2) / 32.0, GAMMA, 0.0, 0.0],
    [
        FIFTH,
        FIFTH,
        (506_605.0 + 132_109.0 * ROOT_2) / 437_500.0,
        166.0 * (-97.0 + 376.0 * ROOT_2) / 109_375.0,
        GAMMA,
        0.0,
    ],
    [
        LAST,
        LAST,
        47.0 * (-267.0 + 1783.0 * ROOT_2) / 273_343.0,
        -16.0 * (-22_922.0 + 3525.0 * ROOT_2) / 571_953.0,
        -15_625.0 * (97.0 + 376.0 * ROOT_2) / 90_749_876.0,
        GAMMA,
    ],
];

/// Weights of the formula of order 3.
const EMBEDDED: [f64; STAGES] = [
    -480_923_228_411.0 / 4_982_971_448_372.0,
    -480_923_228_411.0 / 4_982_971_448_372.0,
    6_709_447_293_961.0 / 12_833_189_095_359.0,
    3_513_175_791_894.0 / 6_748_737_351_361.0,
    -498_863_281_070.0 / 6_042_575_550_617.0,
    2_077_005_547_802.0 / 8_945_017_530_137.0,
];

/// The difference of both, of which the error estimate is made.
pub(super) const E: [f64; STAGES] = {
    let (mut e, mut i) = ([0.0; STAGES], 0);
    while i < STAGES {
        e[i] = A[STAGES - 1][i] - EMBEDDED[i];
        i += 1;
    }
    e
};

/// Stages before stage i whose polynomial, with the start, says where its iterations begin; of stage 1,
/// counted from 0, those of the step before.
const BEHIND: [&[usize]; STAGES] = [&[], &[1, 3, 5], &[1], &[1, 2], &[1, 2, 3], &[1, 3, 4]];

/// Weights with which the changes from the start to the stages are continued to θ, for the start of
/// iterations at stage i.
pub(super) fn continued(i: usize, theta: f64) -> [f64; STAGES] {
    let mut weights = [0.0; STAGES];
    for &j in BEHIND[i] {
        let others = BEHIND[i].iter().filter(|k| **k != j).map(|&k| (theta - C[k]) / (C[j] - C[k]));
        weights[j] = others.product::<f64>() * theta / C[j];
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::explicit::trees::Tableau;
    use nalgebra::{Complex, SMatrix, SVector};
    use std::vec::Vec;

    type Square = SMatrix<Complex<f64>, STAGES, STAGES>;

    fn sparse(row: &[f64; STAGES]) -> Vec<(usize, f64)> {
        row.iter().copied().enumerate().collect()
    }

    /// All rooted trees: order 4 of the step, order 3 of what is embedded in it.
    #[test]
    fn the_order_conditions_of_all_trees_hold() {
        let rows: Vec<Vec<(usize, f64)>> = A.iter().map(sparse).collect();
        let rows: Vec<&[(usize, f64)]> = rows.iter().map(Vec::as_slice).collect();
        let tableau = Tableau::new(&rows, &C);
        tableau.assert_orders(&sparse(&A[STAGES - 1]), 4, 1e-15);
        tableau.assert_orders(&sparse(&EMBEDDED), 3, 1e-15);
        tableau.assert_estimate(&sparse(&E), 3, 1e-15);
    }

    #[test]
    fn stages_have_order_2() {
        for (row, c) in A.iter().zip(C) {
            let moment: f64 = row.iter().zip(C).map(|(a, c)| a * c).sum();
            assert!((moment - 0.5 * c * c).abs() < 1e-16, "{c}");
        }
    }

    /// R(z) = 1 + z bᵀ(1 − zA)⁻¹1, of the step and of each stage.
    fn stability(z: Complex<f64>, weights: &[f64; STAGES]) -> Complex<f64> {
        let matrix = Square::from_fn(|i, j| Complex::from(f64::from(i == j)) - z * A[i][j]);
        let stages = matrix.lu().solve(&SVector::repeat(Complex::from(1.0))).unwrap();
        let sum: Complex<f64> = weights.iter().zip(stages.iter()).map(|(b, s)| s * *b).sum();
        Complex::from(1.0) + z * sum
    }

    /// |R| ≤ 1 on the imaginary axis, without poles in the left half plane as γ > 0, is A-stability; R(∞) =
    /// 0 is L-stability. What is embedded does not grow either.
    #[test]
    fn the_step_is_l_stable() {
        for k in -300..=300 {
            let y = 10f64.powf(f64::from(k) / 60.0);
            let square = stability(Complex::new(0.0, y), &A[STAGES - 1]).norm_sqr();
            assert!(square <= 1.0 + 2e-13, "{y}: {square}");
        }
        for far in [1e4, 1e6, 1e8] {
            let square = stability(Complex::new(-far, 0.0), &A[STAGES - 1]).norm_sqr();
            assert!(square < 100.0 / (far * far), "{far}: {square}");
        }
        assert!(stability(Complex::new(-1e8, 0.0), &EMBEDDED).norm_sqr() < 1.0);
    }

    /// A polynomial of the degree that the stages determine is continued exactly.
    #[test]
    fn iterations_begin_on_the_polynomial_through_stages() {
        for (i, behind) in BEHIND.iter().enumerate().skip(1) {
            let u = |theta: f64| theta.powi(behind.len() as i32) - 2.0 * theta;
            let theta = if i == 1 { 1.7 } else { C[i] };
            let found: f64 = continued(i, theta).iter().zip(C).map(|(w, c)| w * u(c)).sum();
            assert!((found - u(theta)).abs() < 1e-13, "{i}");
        }
    }
}
