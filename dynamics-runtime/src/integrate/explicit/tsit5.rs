//! Tsit5: Tsitouras 5(4).
//!
//! * **Problem**: smooth, not stiff, tolerances to about 10⁻⁴, as
//!   [`DormandPrince5`](crate::integrate::DormandPrince5), whose place it takes where its error per
//!   evaluation is the smaller one; below, [`Dop853`](crate::integrate::Dop853) needs fewer evaluations.
//! * **Formula**: seven stages, the last at the end of the step and reused as the first of the next (FSAL).
//!   Of the simplifying assumptions only the first column's is made: the freedom that is left makes the error
//!   terms of order 6 small. The 5th-order result is kept.
//! * **Order** 5; error estimate 4.
//! * **Dense output**: order 4, no further evaluation, continuously differentiable.
//! * **Stability**: real axis to −3.5.
//! * **Cost**: 6 evaluations of q̈ per step.
//! * **Source**: Tsitouras, Comput. Math. Appl. 62 (2011) 770; coefficients from its multi-precision values,
//!   rounded to the nearest `f64`.

use crate::integrate::explicit::tableau::{
    TableauRow, embedded_method, stages, stiffness, sum, sum_by, unrolled_stages,
};
use crate::integrate::phase::scaled;
use crate::integrate::{ControllerSettings, Method, Nested, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

const C: [f64; 7] = [0.0, 0.161, 0.327, 0.9, 0.9800255409045097, 1.0, 1.0];
const A2: TableauRow<1> = [(0, 0.161)];
const A3: TableauRow<2> = [(0, -0.008480655492356989), (1, 0.335480655492357)];
const A4: TableauRow<3> = [(0, 2.8971530571054935), (1, -6.359448489975075), (2, 4.3622954328695815)];
const A5: TableauRow<4> =
    [(0, 5.325864828439257), (1, -11.748883564062828), (2, 7.4955393428898365), (3, -0.09249506636175525)];
const A6: TableauRow<5> = [
    (0, 5.86145544294642),
    (1, -12.92096931784711),
    (2, 8.159367898576159),
    (3, -0.071584973281401),
    (4, -0.028269050394068383),
];
/// Weights of the 5th-order result; also the row of the seventh stage.
const B: TableauRow<6> = [
    (0, 0.09646076681806523),
    (1, 0.01),
    (2, 0.4798896504144996),
    (3, 1.379008574103742),
    (4, -3.290069515436081),
    (5, 2.324710524099774),
];
/// Weights of the 4th-order result less B.
const E: TableauRow<7> = [
    (0, -0.0017800110522257714),
    (1, -0.0008164344596567469),
    (2, 0.007880878010261995),
    (3, -0.1447110071732629),
    (4, 0.5823571654525552),
    (5, -0.45808210592918697),
    (6, 0.015151515151515152),
];
/// Dense output: the coefficients of θ⁴ in Tsitouras's weights; the rest follows from both ends.
const D: TableauRow<7> = [
    (0, -1.0530884977290216),
    (1, 0.1017),
    (2, 2.490627285651253),
    (3, -16.548102889244902),
    (4, 47.37952196281928),
    (5, -34.87065786149661),
    (6, 2.5),
];

/// Tsitouras's method of order 5(4).
#[derive(Clone, Copy, Debug)]
pub struct Tsit5<V> {
    k: [Phase<V>; 7],
    /// The state of the sixth stage, at the end of the step like the seventh.
    last: Phase<V>,
    h: f64,
}

impl<V: Vector> Scheme<V> for Tsit5<V> {
    const METHOD: Method = Method::Tsit5;
    const IS_EXPLICIT: bool = true;
    const ORDER: u32 = 5;
    const ERROR_ORDER: u32 = 4;
    const CONTROL: Option<ControllerSettings> =
        Some(ControllerSettings { safety: 0.9, beta: 0.04, shrink: 0.2, grow: 10.0 });
    const WEIGHTS: &'static [f64] = &[B[0].1, B[1].1, B[2].1, B[3].1, B[4].1, B[5].1];
    const STABILITY_BORDER: f64 = 3.5;
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
        tableau.assert_orders(&B, 5, 3e-14);
        tableau.assert_estimate(&E, 4, 1e-14);
        tableau.assert_dense(&B, &[&D], 6, 4, 1e-14);
    }
}
