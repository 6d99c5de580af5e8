//! The coefficients of Radau IIA of order 5, with the matrices that diagonalise A⁻¹: code `radau5.f`.

/// √6.
const SQRT_6: f64 = 2.449489742783178;

/// Nodes.
pub(super) const C: [f64; 3] = [(4.0 - SQRT_6) / 10.0, (4.0 + SQRT_6) / 10.0, 1.0];
/// Runge–Kutta matrix A.
pub(super) const A: [[f64; 3]; 3] = [
    [(88.0 - 7.0 * SQRT_6) / 360.0, (296.0 - 169.0 * SQRT_6) / 1800.0, (-2.0 + 3.0 * SQRT_6) / 225.0],
    [(296.0 + 169.0 * SQRT_6) / 1800.0, (88.0 + 7.0 * SQRT_6) / 360.0, (-2.0 - 3.0 * SQRT_6) / 225.0],
    [(16.0 - SQRT_6) / 36.0, (16.0 + SQRT_6) / 36.0, 1.0 / 9.0],
];
/// A⁻¹.
pub(super) const A_INVERSE: [[f64; 3]; 3] = [
    [2.0 + SQRT_6 / 2.0, -1.2 + 29.0 * SQRT_6 / 30.0, 0.4 - 4.0 * SQRT_6 / 15.0],
    [-1.2 - 29.0 * SQRT_6 / 30.0, 2.0 - SQRT_6 / 2.0, 0.4 + 4.0 * SQRT_6 / 15.0],
    [-1.0 + 8.0 * SQRT_6 / 3.0, -1.0 - 8.0 * SQRT_6 / 3.0, 5.0],
];
/// The real eigenvalue of A⁻¹.
pub(super) const GAMMA: f64 = 3.637834252744496;
/// The real part of the complex eigenvalue of A⁻¹.
pub(super) const ALPHA: f64 = 2.6810828736277523;
/// Its imaginary part.
pub(super) const BETA: f64 = 3.0504301992474105;
/// T⁻¹ A⁻¹ T = diag(γ, [[α, −β], [β, α]]).
pub(super) const T: [[f64; 3]; 3] = [
    [0.09123239487089295, -0.1412552950209542, -0.030029194105147424],
    [0.241717932707107, 0.20412935229379994, 0.3829421127572619],
    [0.966048182615093, 1.0, 0.0],
];
/// T⁻¹.
pub(super) const T_INVERSE: [[f64; 3]; 3] = [
    [4.325579890063155, 0.33919925181580984, 0.5417705399358749],
    [-4.178718591551905, -0.32768282076106237, 0.47662355450055044],
    [-0.5028726349457868, 2.571926949855605, -0.5960392048282249],
];
/// Weights of the stages in the error estimate.
pub(super) const E: [f64; 3] = [-(13.0 + 7.0 * SQRT_6) / 3.0, (-13.0 + 7.0 * SQRT_6) / 3.0, -1.0 / 3.0];

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| rows[i][j])
    }

    /// C(3), B(5) and the stiff end determine the method.
    #[test]
    fn collocation_conditions_hold() {
        for k in 1..=3 {
            for (i, row) in A.iter().enumerate() {
                let sum: f64 = row.iter().zip(C).map(|(a, c)| a * c.powi(k - 1)).sum();
                assert!((sum - C[i].powi(k) / f64::from(k)).abs() < 1e-15, "row {i}, power {k}");
            }
        }
        for k in 1..=5 {
            let sum: f64 = A[2].iter().zip(C).map(|(b, c)| b * c.powi(k - 1)).sum();
            assert!((sum - 1.0 / f64::from(k)).abs() < 1e-15, "power {k}");
        }
    }

    #[test]
    fn the_transformation_diagonalises_the_inverse() {
        let inverse = matrix(&A).try_inverse().unwrap();
        let found = matrix(&T_INVERSE) * inverse * matrix(&T);
        let wanted = Matrix3::new(GAMMA, 0.0, 0.0, 0.0, ALPHA, -BETA, 0.0, BETA, ALPHA);
        assert!((found - wanted).abs().max() < 2e-13, "{found}");
        assert!((matrix(&A_INVERSE) - inverse).abs().max() < 1e-13);
        assert!((matrix(&T) * matrix(&T_INVERSE) - Matrix3::identity()).abs().max() < 1e-14);
    }

    /// γ₀ y₀ + Σ eᵢ(yᵢ − y₀) has to be exact of order 3 as −f₀: Σ eᵢ cᵢᵏ = −1, 0, 0 for k = 1, 2, 3 up to the
    /// filter.
    #[test]
    fn the_error_estimate_vanishes_up_to_order_three() {
        let moment = |k: i32| -> f64 { E.iter().zip(C).map(|(e, c)| e * c.powi(k)).sum() };
        assert!((moment(1) + 1.0).abs() < 1e-14 && moment(2).abs() < 1e-14 && moment(3).abs() < 1e-14);
        assert!(moment(4).abs() > 1e-3);
    }
}
