//! A mode on the model's own drawing.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::f64::consts::TAU;

use dynamics_runtime::constrain::{project_positions, with_workspace};
use dynamics_runtime::model::names;
use dynamics_runtime::model::{Constraints, Draw, ModelState, Outputs, Vector};
use dynamics_view::{Drawing, Film};
use nalgebra::{Complex, DVector};

use super::VibrationError;
use crate::linearize::Mode;

/// A mode as a film: two periods of q + Re(amplitude · shape e^{iωt}), without its damping, so that it can be
/// seen. Positions are projected onto the constraints, which small motions violate to second order.
#[derive(Debug)]
pub struct ModeFilm<'m, M: Constraints> {
    model: &'m M,
    rest: M::State,
    shape: DVector<Complex<f64>>,
    frequency: f64,
    amplitude: f64,
    account: String,
}

impl<'m, M: Constraints + Outputs + Draw> ModeFilm<'m, M> {
    pub(crate) fn new(
        model: &'m M,
        rest: M::State,
        mode: &Mode,
        amplitude: f64,
    ) -> Result<Self, VibrationError> {
        let frequency = mode.eigenvalue.im;
        if frequency <= 0.0 {
            return Err(VibrationError::NoOscillation { eigenvalue: mode.eigenvalue });
        }
        if !(amplitude.is_finite() && amplitude > 0.0) {
            return Err(VibrationError::Value {
                what: "the amplitude",
                value: amplitude,
                must_be: "a positive number",
            });
        }
        if mode.shape.len() != M::Vector::LEN {
            let shapes = [(mode.shape.len(), 1), (M::Vector::LEN, 1)].into();
            return Err(VibrationError::Shapes { shapes });
        }
        Ok(Self { model, rest, shape: mode.shape.clone(), frequency, amplitude, account: mode.to_string() })
    }

    /// The deviation at a time.
    fn state(&self, t: f64) -> M::State {
        let mut state = self.rest;
        let turn = Complex::from_polar(self.amplitude, self.frequency * t);
        for (i, shape) in self.shape.iter().enumerate() {
            state.q_mut().as_mut_slice()[i] += (shape * turn).re;
            state.u_mut().as_mut_slice()[i] += (shape * turn * Complex::new(0.0, self.frequency)).re;
        }
        let mut held = state;
        // What cannot be put back is shown as the linear motion that it is.
        let constants = self.model.constants().ok();
        let back = constants.map(|constants| {
            with_workspace::<M, _>(|memory| project_positions(self.model, &constants, &mut held, memory))
        });
        if back.is_some_and(|back| back.is_ok()) { held } else { state }
    }
}

impl<M: Constraints + Outputs + Draw> Film for ModeFilm<'_, M> {
    fn title(&self) -> String {
        M::NAME.to_string()
    }

    fn method(&self) -> String {
        format!("a mode of {:.6} rad/s", self.frequency)
    }

    fn summary(&self) -> String {
        format!("{}\nshown with amplitude {} and without its damping", self.account, self.amplitude)
    }

    fn span(&self) -> [f64; 2] {
        [0.0, 2.0 * TAU / self.frequency]
    }

    fn time_unit(&self) -> String {
        names::time_unit::<M>().to_string()
    }

    fn length_unit(&self) -> String {
        names::length_unit::<M>().to_string()
    }

    fn quantities(&self) -> Vec<(String, String)> {
        names::coordinates::<M>().map(|column| (column.name, column.unit)).collect()
    }

    fn play(&self, times: &[f64], show: &mut dyn FnMut(&Drawing, &[f64])) {
        for t in times {
            let state = self.state(*t);
            let coordinates = M::coordinates_with(&state, &M::Vector::zeros(), &[]);
            show(&self.model.draw(&coordinates), state.q().as_slice());
        }
    }
}
