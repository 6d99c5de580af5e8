//! The equations of motion of a run: q̈ = M⁻¹ (Q + Jᵀλ) with the inputs of the moment. Evaluations allocate
//! nothing.

use dynamics_runtime::simulate::OptionError;

use crate::constraints::{ConstraintSummary, Rows};
use crate::drift::{DriftAndKick, drift};
use crate::failure::FamilyErrorKind;
use crate::mass::Mass;
use crate::model::{FamilyModel, FamilyState, Multipliers, View};

/// Input values by time and state, written to a slice. The error is another number of values.
pub(crate) type Law<'m, S> = Box<dyn Fn(f64, &S, &mut [f64]) -> Result<(), usize> + Send + Sync + 'm>;

/// A model with what a run needs to evaluate it.
pub(crate) struct Equations<'r, 'm, M: FamilyModel> {
    pub(crate) model: &'m M,
    pub(crate) mass: &'r Mass,
    law: Option<&'r Law<'m, M::State>>,
    /// The inputs of the last evaluation; those of the start where there is no law.
    pub(crate) inputs: Vec<f64>,
    /// What the law is called with.
    seen: Option<M::State>,
    memory: Vec<f64>,
    /// The constraints, where the model has some.
    pub(crate) rows: Option<Box<Rows>>,
    /// The largest correction back onto the constraints, in parts of the size of the coordinates.
    pub(crate) correction: f64,
    /// Evaluations of Q.
    pub(crate) evaluations: u64,
    /// How many threads share an evaluation.
    pub(crate) threads: usize,
}

/// All nodes.
const ALL: [usize; 2] = [0, usize::MAX];

impl<'r, 'm, M: FamilyModel> Equations<'r, 'm, M> {
    pub(crate) fn new(
        model: &'m M,
        mass: &'r Mass,
        law: Option<&'r Law<'m, M::State>>,
        start: &M::State,
    ) -> Result<Self, FamilyErrorKind> {
        let needs_memory = M::VELOCITY_FORCES || matches!(mass, Mass::Banded(_));
        let memory = vec![0.0; if needs_memory { 2 * start.q().len() } else { 0 }];
        let seen = law.is_some().then(|| start.clone());
        let rows = Rows::of_model(model, mass, start.ends())?.map(Box::new);
        let inputs = start.inputs().to_vec();
        Ok(Self { model, mass, law, inputs, seen, memory, rows, correction: 0.0, evaluations: 0, threads: 1 })
    }

    /// λ of the last evaluation of the accelerations.
    pub(crate) fn multipliers(&self) -> Multipliers {
        match &self.rows {
            Some(rows) => Multipliers::new(rows.multipliers.clone(), rows.ends.clone()),
            None => Multipliers::default(),
        }
    }

    /// Moves the end of a step onto the constraints; the largest correction is kept.
    pub(crate) fn project_end(
        &mut self,
        t: f64,
        q: &mut [f64],
        u: &mut [f64],
    ) -> Result<(), FamilyErrorKind> {
        let Some(rows) = &mut self.rows else { return Ok(()) };
        let projection = rows.project(self.model, t, q, u, &self.inputs)?;
        self.correction = self.correction.max(projection.off);
        Ok(())
    }

    /// What a run says of its constraints, with the multipliers at this state.
    pub(crate) fn constraint_summary(&mut self, t: f64, q: &[f64], u: &[f64]) -> Option<ConstraintSummary> {
        self.rows.as_ref()?;
        let mut a = vec![0.0; q.len()];
        let solved = self.accelerations(t, q, u, &mut a);
        let (rows, correction) = (self.rows.as_ref()?, self.correction);
        Some(ConstraintSummary {
            rows: rows.multipliers.len(),
            system: rows.describe(),
            correction,
            residual: if solved.is_ok() { rows.residual_of(&a) } else { f64::NAN },
        })
    }

    /// Sets the inputs for a time and a state.
    pub(crate) fn set_inputs(&mut self, t: f64, q: &[f64], u: &[f64]) -> Result<(), FamilyErrorKind> {
        let (Some(law), Some(seen)) = (self.law, self.seen.as_mut()) else { return Ok(()) };
        let (time, positions, velocities, _) = seen.parts_mut();
        *time = t;
        positions.copy_from_slice(q);
        velocities.copy_from_slice(u);
        law(t, seen, &mut self.inputs)
            .map_err(|given| FamilyErrorKind::InputCount { given, needed: M::INPUTS.len() })?;
        match self.inputs.iter().position(|input| !input.is_finite()) {
            None => Ok(()),
            Some(input) => Err(FamilyErrorKind::InputNotFinite { input: M::INPUTS[input].name }),
        }
    }

    /// The error for the first input that has no value, if there is one.
    pub(crate) fn check_inputs(&self) -> Result<(), OptionError> {
        match self.inputs.iter().position(|input| !input.is_finite()) {
            Some(input) if self.law.is_none() => {
                Err(OptionError::InputWithoutValue { input: M::INPUTS[input].name })
            }
            _ => Ok(()),
        }
    }

    /// q̈, written to `a`.
    pub(crate) fn accelerations(
        &mut self,
        t: f64,
        q: &[f64],
        u: &[f64],
        a: &mut [f64],
    ) -> Result<(), FamilyErrorKind> {
        self.set_inputs(t, q, u)?;
        self.evaluations += 1;
        let at = View { t, q, u, inputs: &self.inputs };
        let memory = if matches!(self.mass, Mass::Banded(_)) { &mut self.memory[..q.len()] } else { &mut [] };
        self.mass.accelerations(self.model, self.threads, at, a, memory);
        match &mut self.rows {
            Some(rows) => rows.constrain(self.model, at, a),
            None => Ok(()),
        }
    }

    /// Q, written to `forces`.
    pub(crate) fn forces(
        &mut self,
        t: f64,
        q: &[f64],
        u: &[f64],
        forces: &mut [f64],
    ) -> Result<(), FamilyErrorKind> {
        self.set_inputs(t, q, u)?;
        self.evaluations += 1;
        self.model.forces_by(self.threads, View { t, q, u, inputs: &self.inputs }, forces);
        Ok(())
    }

    /// q += `by` u, then u += `h` q̈ at the time t: in one pass over memory where the model can. The bits are
    /// the same.
    pub(crate) fn drift_and_kick(
        &mut self,
        t: f64,
        q: &mut [f64],
        u: &mut [f64],
        ends: &[usize],
        [by, h]: [f64; 2],
    ) -> Result<(), FamilyErrorKind> {
        match (self.mass, self.law) {
            (Mass::Diagonal(inverse), None) if M::LOCAL && !M::VELOCITY_FORCES => {
                self.evaluations += 1;
                let step = DriftAndKick { t, drift: by, kick: h, inputs: &self.inputs, scale: inverse };
                step.apply(self.model, self.threads, ends, q, u);
                Ok(())
            }
            _ => {
                drift(self.threads, q, u, by);
                self.kick(t, q, h, u)
            }
        }
    }

    /// u += h q̈, in one pass where the model can.
    pub(crate) fn kick(&mut self, t: f64, q: &[f64], h: f64, u: &mut [f64]) -> Result<(), FamilyErrorKind> {
        if let (Mass::Diagonal(inverse), false) = (self.mass, M::VELOCITY_FORCES) {
            self.set_inputs(t, q, u)?;
            self.evaluations += 1;
            self.model.kick_by(self.threads, ALL, t, [q, &self.inputs, inverse], h, u);
            return Ok(());
        }
        self.set_inputs(t, q, u)?;
        self.evaluations += 1;
        let (a, ordered) = self.memory.split_at_mut(q.len());
        let at = View { t, q, u, inputs: &self.inputs };
        self.mass.accelerations(self.model, self.threads, at, a, ordered);
        u.iter_mut().zip(&*a).for_each(|(u, a)| *u += h * a);
        Ok(())
    }
}
