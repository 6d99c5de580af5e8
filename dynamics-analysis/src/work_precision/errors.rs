//! Ends of motions and their differences.

use alloc::vec::Vec;

use dynamics_runtime::constrain;
use dynamics_runtime::model::{ActiveSet, ModelState, Vector};
use dynamics_runtime::simulate::Simulate;

/// The part of a state that an error is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorOf {
    /// Generalized coordinates.
    Positions,
    /// Generalized velocities.
    Velocities,
    /// The larger of the two.
    State,
    /// Multipliers of constraints.
    Multipliers,
    /// The energy function.
    Energy,
}

/// Errors of one run, or the uncertainties of a reference, each in its own unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Largest of any coordinate.
    pub positions: f64,
    /// Largest of any velocity.
    pub velocities: f64,
    /// Largest of any multiplier; `None` without constraints.
    pub multipliers: Option<f64>,
    /// Of the energy function.
    pub energy: f64,
}

impl Errors {
    /// The error of a part; NaN where it is not known, `None` where there is no such part.
    #[must_use]
    pub fn of(&self, part: ErrorOf) -> Option<f64> {
        match part {
            ErrorOf::Positions => Some(self.positions),
            ErrorOf::Velocities => Some(self.velocities),
            // If velocities were not measured, positions alone count.
            ErrorOf::State if self.velocities.is_nan() => Some(self.positions),
            ErrorOf::State => Some(self.positions.max(self.velocities)),
            ErrorOf::Multipliers => self.multipliers,
            ErrorOf::Energy => Some(self.energy),
        }
    }

    pub(super) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        self.zip(self, |x, _| f(x))
    }

    pub(super) fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            positions: f(self.positions, other.positions),
            velocities: f(self.velocities, other.velocities),
            multipliers: self.multipliers.zip(other.multipliers).map(|(a, b)| f(a, b)),
            energy: f(self.energy, other.energy),
        }
    }
}

/// The end of a motion, with all quantities that are compared.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct End {
    pub(super) q: Vec<f64>,
    pub(super) u: Vec<f64>,
    pub(super) multipliers: Vec<f64>,
    pub(super) energy: f64,
    /// Inputs and active constraints, on which multipliers and energy depend, too. Ends of which only q and u
    /// are known take them from the reference.
    pub(super) inputs: Vec<f64>,
    pub(super) modes: ActiveSet,
}

impl End {
    pub(super) fn of<M: Simulate>(model: &M, state: &M::State) -> Self {
        let multipliers = match model.constants() {
            Ok(constants) if !M::ROWS.is_empty() => {
                let solved = constrain::solve_once(model, &constants, state);
                solved.map_or_else(
                    |_| alloc::vec![f64::NAN; M::ROWS.len()],
                    |solved| solved.multipliers.as_slice().to_vec(),
                )
            }
            _ => Vec::new(),
        };
        let (q, u) = (state.q().as_slice().to_vec(), state.u().as_slice().to_vec());
        let (inputs, modes) = (state.inputs().as_slice().to_vec(), state.active_set());
        Self { q, u, multipliers, energy: model.energy_function(state), inputs, modes }
    }

    /// The largest differences from another end.
    pub(super) fn errors(&self, other: &Self) -> Errors {
        Errors {
            positions: largest(&self.q, &other.q),
            velocities: largest(&self.u, &other.u),
            multipliers: (!self.multipliers.is_empty())
                .then(|| largest(&self.multipliers, &other.multipliers)),
            energy: (self.energy - other.energy).abs(),
        }
    }

    /// The largest magnitudes: the differences from zero.
    pub(super) fn size(&self) -> Errors {
        let zero = |v: &Vec<f64>| alloc::vec![0.0; v.len()];
        let [q, u, multipliers] = [&self.q, &self.u, &self.multipliers].map(zero);
        self.errors(&Self { q, u, multipliers, energy: 0.0, ..self.clone() })
    }
}

/// The largest |difference|; NaN if any is NaN.
pub(super) fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |most, x| if x > most || x.is_nan() { x } else { most })
}
