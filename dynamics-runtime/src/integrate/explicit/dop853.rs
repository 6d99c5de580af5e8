//! DOP853: Dormand–Prince 8(5,3).
//!
//! * **Problem**: smooth, not stiff, tolerances from about 10⁻⁴ down to rounding.
//! * **Formula**: twelve stages of order 8; two embedded results of order 5 and 3 give the error estimate
//!   ‖e₅‖² / √(‖e₅‖² + 0.01 ‖e₃‖²), which behaves like order 7 and is not fooled where e₅ vanishes by chance.
//! * **Order** 8; error estimate 7.
//! * **Dense output**: order 7, with three further stages that are evaluated only when it is asked for.
//! * **Stability**: real axis to −6.1.
//! * **Cost**: 12 evaluations of q̈ per step, 15 with dense output.
//! * **Source**: Hairer, Nørsett, Wanner, *Solving ODE I*, 2nd ed., §II.5, §II.6, §II.10; code `dop853.f`.

use crate::integrate::explicit::dop853_table::*;
use crate::integrate::explicit::tableau::{embedded_method, stages, stiffness, sum, sum_by, unrolled_stages};
use crate::integrate::phase::{scaled, zip};
use crate::integrate::{ControllerSettings, Method, Nested, Phase, Scheme, StepNode, System, Tolerances};
use crate::math;
use crate::model::Vector;

/// Dormand and Prince's method of order 8(5,3).
#[derive(Clone, Copy, Debug)]
pub struct Dop853<V> {
    k: [Phase<V>; 16],
    /// The state of the twelfth stage, at the end of the step.
    last: Phase<V>,
    h: f64,
}

/// The rows of the stages 1 to 11, and of 13 to 15 for dense output.
const ROWS: [&[(usize, f64)]; 14] =
    [&A1, &A2, &A3, &A4, &A5, &A6, &A7, &A8, &A9, &A10, &A11, &A13, &A14, &A15];

impl<V: Vector> Dop853<V> {
    /// The end of the step from its stages, and its error.
    #[inline(always)]
    fn end_and_error(&self, y: &Phase<V>, tolerances: &Tolerances) -> (Phase<V>, f64) {
        let (h, k) = (self.h, &self.k);
        let slope = sum(&B, k);
        let end = zip(y, &slope, |y, k| y + h * k);
        let e5 = tolerances.square_sum(&sum(&E5, k), y, &end);
        let e3 = tolerances.square_sum(&zip(&slope, &sum(&B3, k), |b, b3| b - b3), y, &end);
        let both = e5 + 0.01 * e3;
        let error = if both > 0.0 {
            h.abs() * e5 / math::sqrt((2 * V::LEN) as f64 * both)
        } else {
            // 0 when both estimates vanish, NaN when they are NaN.
            both
        };
        (end, error)
    }
}

impl<V: Vector> Scheme<V> for Dop853<V> {
    const METHOD: Method = Method::Dop853;
    const IS_EXPLICIT: bool = true;
    const ORDER: u32 = 8;
    const ERROR_ORDER: u32 = 7;
    // Hairer's choices in DOP853. β = 0.02 rejects a third fewer steps and still costs 3 % more for the same
    // error, in the mean over double pendulum, Kepler, Hénon–Heiles and Arenstorf at 1e-3 to 1e-12; β = 0.08
    // costs twice as much.
    const CONTROL: Option<ControllerSettings> =
        Some(ControllerSettings { safety: 0.9, beta: 0.0, shrink: 0.333, grow: 6.0 });
    const WEIGHTS: &'static [f64] = &WEIGHTS;
    const STABILITY_BORDER: f64 = 6.1;
    const EVENT_PANELS: usize = 8;
    const DEFECT_SAMPLES: &'static [f64] = &[0.6, 0.92];
    type Dense = Nested<V, 8>;
    embedded_method!(V, rows ROWS, 12 stages of 16, E5, [D4, D5, D6, D7]);

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
            9: A9, 10: A10, 11: A11
        ]);
        Ok(self.end_and_error(y, tolerances))
    }
}
