//! Verner9: Verner's "most efficient" pair 9(8).
//!
//! * **Problem**: smooth, not stiff, tolerances from about 10⁻⁹ down to rounding: where
//!   [`Dop853`](crate::integrate::Dop853) makes many steps.
//! * **Formula**: sixteen stages of order 9; one embedded result of order 8 gives the error estimate.
//! * **Order** 9; error estimate 8.
//! * **Dense output**: order 8, continuously differentiable, with four further stages that are evaluated only
//!   when it is asked for. Verner gives their rows (and five more for order 9); its weights follow from the
//!   order conditions.
//! * **Stability**: real axis to −4.5.
//! * **Cost**: 16 evaluations of q̈ per step, 20 with dense output.
//! * **Source**: Verner, Numer. Algorithms 53 (2010) 383, and the tables of coefficients that accompany it.

use crate::integrate::explicit::tableau::{
    advance, embedded_method, stages, stiffness, sum, sum_by, unrolled_stages,
};
use crate::integrate::explicit::verner9_table::*;
use crate::integrate::phase::scaled;
use crate::integrate::{ControllerSettings, Method, Nested, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// Verner's method of order 9(8).
#[derive(Clone, Copy, Debug)]
pub struct Verner9<V> {
    k: [Phase<V>; 21],
    /// The state of the sixteenth stage, at the end of the step.
    last: Phase<V>,
    h: f64,
}

/// The rows of the stages 1 to 15, and of 17 to 20 for dense output.
const ROWS: [&[(usize, f64)]; 19] =
    [&A1, &A2, &A3, &A4, &A5, &A6, &A7, &A8, &A9, &A10, &A11, &A12, &A13, &A14, &A15, &A17, &A18, &A19, &A20];

impl<V: Vector> Verner9<V> {
    /// The end of the step from its stages, and its error.
    #[inline(always)]
    fn end_and_error(&self, y: &Phase<V>, tolerances: &Tolerances) -> (Phase<V>, f64) {
        let (h, k) = (self.h, &self.k);
        let end = advance(y, h, &B, k);
        let error = h.abs() * tolerances.norm(&sum(&E, k), y, &end);
        (end, error)
    }
}

impl<V: Vector> Scheme<V> for Verner9<V> {
    const METHOD: Method = Method::Verner9;
    const IS_EXPLICIT: bool = true;
    const ORDER: u32 = 9;
    const ERROR_ORDER: u32 = 8;
    const CONTROL: Option<ControllerSettings> =
        Some(ControllerSettings { safety: 0.9, beta: 0.0, shrink: 0.333, grow: 6.0 });
    const WEIGHTS: &'static [f64] = &WEIGHTS;
    // At the border of stability (4.5) the error estimate grows steeply: steps oscillate around it, and most
    // lie below.
    const STABILITY_BORDER: f64 = 4.1;
    const EVENT_PANELS: usize = 8;
    const DEFECT_SAMPLES: &'static [f64] = &[0.2, 0.6];
    type Dense = Nested<V, 9>;
    embedded_method!(V, rows ROWS, 16 stages of 21, E, [D4, D5, D6, D7, D8]);

    #[inline(always)]
    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        let StepNode { t, y, .. } = start;
        self.h = h;
        let k = &mut self.k;
        k[0] = start.derivative();
        self.last = unrolled_stages!(system, (t, y, h), C, k, [
            1: A1, 2: A2, 3: A3, 4: A4, 5: A5, 6: A6, 7: A7, 8: A8,
            9: A9, 10: A10, 11: A11, 12: A12, 13: A13, 14: A14, 15: A15
        ]);
        Ok(self.end_and_error(y, tolerances))
    }
}
