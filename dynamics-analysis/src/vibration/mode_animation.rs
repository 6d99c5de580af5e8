//! A mode shape, animated on the model's own drawing: q + Re(amplitude · shape e^{iωt}).

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::f64::consts::TAU;

use dynamics_runtime::model::names;
use dynamics_runtime::model::{Constraints, Draw, ModelState, Outputs, Vector};
use dynamics_view::{Drawing, Film};
use nalgebra::{Complex, DVector};

use super::VibrationError;
use crate::displacement::projected;
use crate::linearize::Mode;

/// An animation of a mode: two periods of q + Re(amplitude · shape e^{iωt}), without its damping. Positions
/// are projected onto the constraints, which small motions violate to second order.
#[derive(Debug)]
pub struct ModeAnimation<'m, M: Constraints> {
    model: &'m M,
    rest: M::State,
    shape: DVector<Complex<f64>>,
    frequency: f64,
    amplitude: f64,
    /// The mode in words, for the page of the animation.
    description: String,
}

impl<'m, M: Constraints + Outputs + Draw> ModeAnimation<'m, M> {
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
        Ok(Self {
            model,
            rest,
            shape: mode.shape.clone(),
            frequency,
            amplitude,
            description: mode.to_string(),
        })
    }

    /// The state at a time; if its position cannot be projected, that of the linear motion.
    fn state(&self, t: f64) -> M::State {
        let mut state = self.rest;
        let phasor = Complex::from_polar(self.amplitude, self.frequency * t);
        for (i, shape) in self.shape.iter().enumerate() {
            state.q_mut().as_mut_slice()[i] += (shape * phasor).re;
            state.u_mut().as_mut_slice()[i] += (shape * phasor * Complex::new(0.0, self.frequency)).re;
        }
        let constants = self.model.constants().ok();
        constants.and_then(|constants| projected(self.model, &constants, state).ok()).unwrap_or(state)
    }
}

impl<M: Constraints + Outputs + Draw> Film for ModeAnimation<'_, M> {
    fn title(&self) -> String {
        M::NAME.to_string()
    }

    fn method(&self) -> String {
        format!("a mode of {:.6} rad/s", self.frequency)
    }

    fn summary(&self) -> String {
        format!("{}\nshown with amplitude {} and without its damping", self.description, self.amplitude)
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
