//! States, tables and failures as plain data, of any model.

use dynamics::model::{ActiveSet, Model, ModelState, Vector};

/// A state of some model: time, q, q̇, inputs, and which switched constraints hold.
#[derive(Clone, Debug)]
pub(crate) struct StateData {
    pub(crate) t: f64,
    pub(crate) q: Vec<f64>,
    pub(crate) u: Vec<f64>,
    pub(crate) inputs: Vec<f64>,
    pub(crate) active_set: ActiveSet,
}

impl StateData {
    /// Of a model's own state.
    pub(crate) fn of<S: ModelState>(state: &S) -> Self {
        Self {
            t: state.t(),
            q: state.q().as_slice().to_vec(),
            u: state.u().as_slice().to_vec(),
            inputs: state.inputs().as_slice().to_vec(),
            active_set: state.active_set(),
        }
    }

    /// Whether they are the same; inputs that were not set are the same in both.
    pub(crate) fn is(&self, other: &Self) -> bool {
        let same = |one: &[f64], other: &[f64]| {
            one.len() == other.len() && one.iter().zip(other).all(|(a, b)| a == b || a.is_nan() && b.is_nan())
        };
        self.t == other.t
            && same(&self.q, &other.q)
            && same(&self.u, &other.u)
            && same(&self.inputs, &other.inputs)
            && self.active_set == other.active_set
    }

    /// As the model's own state.
    pub(crate) fn typed<M: Model>(&self) -> M::State {
        let mut state = M::State::new(self.t, vector(&self.q), vector(&self.u), vector(&self.inputs));
        *state.active_set_mut() = self.active_set;
        state
    }
}

/// A vector of these elements; missing ones are NaN.
pub(crate) fn vector<V: Vector>(elements: &[f64]) -> V {
    let mut vector = V::zeros();
    for (i, element) in vector.as_mut_slice().iter_mut().enumerate() {
        *element = elements.get(i).copied().unwrap_or(f64::NAN);
    }
    vector
}

/// What is given to `state(..)`.
#[derive(Clone, Debug)]
pub(crate) struct GivenState {
    pub(crate) state: StateData,
    pub(crate) given_q: Vec<bool>,
    pub(crate) given_u: Vec<bool>,
    /// Generalized speeds, where some are given.
    pub(crate) speeds: Option<Vec<f64>>,
    /// Whether what is not given is solved for.
    pub(crate) assemble: bool,
    /// Released constraints whose side was given, by bits.
    pub(crate) sided: u32,
}

/// Numbers by rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Matrix {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    pub(crate) values: Vec<f64>,
}

/// What a table of a motion holds beside t, q and q̇.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Columns {
    pub(crate) outputs: bool,
    pub(crate) accelerations: bool,
    pub(crate) multipliers: bool,
    pub(crate) energy: bool,
}

/// A motion at several times. What was not asked for is empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct Table {
    pub(crate) t: Vec<f64>,
    pub(crate) q: Matrix,
    pub(crate) u: Matrix,
    pub(crate) inputs: Matrix,
    pub(crate) outputs: Matrix,
    pub(crate) accelerations: Matrix,
    pub(crate) multipliers: Matrix,
    pub(crate) energy: Vec<f64>,
}

/// An event that happened.
#[derive(Clone, Debug)]
pub(crate) struct EventData {
    pub(crate) name: String,
    pub(crate) rising: bool,
    pub(crate) before: StateData,
    pub(crate) after: StateData,
    pub(crate) energy_lost: f64,
    pub(crate) impacts: usize,
    pub(crate) stopped: bool,
}

/// Why a run ended before its end.
#[derive(Clone, Debug)]
pub(crate) struct Failure {
    /// The text of the error.
    pub(crate) text: String,
    /// The name of its kind: `StepSizeTooSmall`.
    pub(crate) kind: String,
    pub(crate) time: f64,
    pub(crate) step: f64,
    pub(crate) state: StateData,
    /// An option made no sense, so that nothing was computed.
    pub(crate) is_option: bool,
}

/// What can be evaluated at states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Evaluation {
    /// q̈, N.
    Accelerations,
    /// M, N×N.
    MassMatrix,
    /// Q, N.
    GeneralizedForce,
    /// ∂L/∂q̇, N.
    Momenta,
    /// E.
    Energy,
    /// Conserved quantities.
    Conserved,
    /// Outputs.
    Outputs,
    /// λ, R.
    Multipliers,
    /// Φ, H.
    Residual,
    /// Φ̇ joined by A q̇ + b, R.
    VelocityResidual,
    /// Φ_q joined by A, R×N.
    Jacobian,
    /// ∂q̈/∂q joined by ∂q̈/∂q̇, 2×N×N.
    Derivatives,
}

/// A linearised model as matrices.
#[derive(Clone, Debug)]
pub(crate) struct LinearData {
    pub(crate) coordinates: Vec<String>,
    pub(crate) mass: Matrix,
    pub(crate) damping: Matrix,
    pub(crate) stiffness: Matrix,
    pub(crate) input: Matrix,
    /// Natural frequencies in rad/s and damping ratios of the modes.
    pub(crate) modes: Vec<(f64, f64)>,
    pub(crate) text: String,
}
