//! Dormand–Prince 5(4).
//!
//! * **Problem**: smooth, not stiff, tolerances to about 10⁻⁴; below, [`Dop853`](crate::integrate::Dop853)
//!   needs fewer evaluations.
//! * **Formula**: seven stages, the last at the end of the step and reused as the first of the next (FSAL);
//!   the 5th-order result is kept, the difference from the embedded 4th-order one is the error estimate.
//! * **Order** 5; error estimate 4.
//! * **Dense output**: Shampine's continuous extension of order 4, no further evaluation, continuously
//!   differentiable.
//! * **Stability**: real axis to −3.3.
//! * **Cost**: 6 evaluations of q̈ per step.
//! * **Source**: Dormand, Prince, J. Comp. Appl. Math. 6 (1980) 19; Shampine, Math. Comp. 46 (1986) 135;
//!   coefficients as in Hairer, Nørsett, Wanner, *Solving ODE I*, table II.5.2 and §II.6.

use crate::integrate::explicit::tableau::{
    TableauRow, embedded_method, stages, stiffness, sum, sum_by, unrolled_stages,
};
use crate::integrate::phase::scaled;
use crate::integrate::{ControllerSettings, Method, Nested, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

pub(in crate::integrate) const C: [f64; 7] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
pub(in crate::integrate) const A2: TableauRow<1> = [(0, 0.2)];
pub(in crate::integrate) const A3: TableauRow<2> = [(0, 3.0 / 40.0), (1, 9.0 / 40.0)];
pub(in crate::integrate) const A4: TableauRow<3> = [(0, 44.0 / 45.0), (1, -56.0 / 15.0), (2, 32.0 / 9.0)];
pub(in crate::integrate) const A5: TableauRow<4> =
    [(0, 19372.0 / 6561.0), (1, -25360.0 / 2187.0), (2, 64448.0 / 6561.0), (3, -212.0 / 729.0)];
pub(in crate::integrate) const A6: TableauRow<5> = [
    (0, 9017.0 / 3168.0),
    (1, -355.0 / 33.0),
    (2, 46732.0 / 5247.0),
    (3, 49.0 / 176.0),
    (4, -5103.0 / 18656.0),
];
/// Weights of the 5th-order result; also the row of the seventh stage.
pub(in crate::integrate) const B: TableauRow<5> =
    [(0, 35.0 / 384.0), (2, 500.0 / 1113.0), (3, 125.0 / 192.0), (4, -2187.0 / 6784.0), (5, 11.0 / 84.0)];
/// B minus the weights of the 4th-order result.
pub(in crate::integrate) const E: TableauRow<6> = [
    (0, 71.0 / 57600.0),
    (2, -71.0 / 16695.0),
    (3, 71.0 / 1920.0),
    (4, -17253.0 / 339200.0),
    (5, 22.0 / 525.0),
    (6, -1.0 / 40.0),
];
/// Shampine's dense output.
const D: TableauRow<6> = [
    (0, -12715105075.0 / 11282082432.0),
    (2, 87487479700.0 / 32700410799.0),
    (3, -10690763975.0 / 1880347072.0),
    (4, 701980252875.0 / 199316789632.0),
    (5, -1453857185.0 / 822651844.0),
    (6, 69997945.0 / 29380423.0),
];

/// Dormand and Prince's method of order 5(4).
#[derive(Clone, Copy, Debug)]
pub struct DormandPrince5<V> {
    k: [Phase<V>; 7],
    /// The state of the sixth stage, at the end of the step like the seventh.
    last: Phase<V>,
    h: f64,
}

impl<V: Vector> Scheme<V> for DormandPrince5<V> {
    const METHOD: Method = Method::DormandPrince5;
    const IS_EXPLICIT: bool = true;
    const ORDER: u32 = 5;
    const ERROR_ORDER: u32 = 4;
    // Hairer's choices in DOPRI5.
    const CONTROL: Option<ControllerSettings> =
        Some(ControllerSettings { safety: 0.9, beta: 0.04, shrink: 0.2, grow: 10.0 });
    const WEIGHTS: &'static [f64] =
        &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
    const STABILITY_BORDER: f64 = 3.25;
    const EVENT_PANELS: usize = 4;
    const DEFECT_SAMPLES: &'static [f64] = &[0.25, 0.75];
    type Dense = Nested<V, 5>;
    embedded_method!(V, first_same_as_last);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::explicit::trees::Tableau;

    #[test]
    fn the_order_conditions_of_all_trees_hold() {
        let tableau = Tableau::new(&[&[], &A2, &A3, &A4, &A5, &A6, &B], &C);
        tableau.assert_orders(&B, 5, 1e-15);
        tableau.assert_estimate(&E, 4, 1e-15);
        tableau.assert_dense(&B, &[&D], 6, 4, 1e-15);
        assert!(
            (DormandPrince5::<nalgebra::SVector<f64, 1>>::WEIGHTS.iter().sum::<f64>() - 1.0).abs() < 1e-15
        );
    }
}
