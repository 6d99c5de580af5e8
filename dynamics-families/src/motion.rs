//! A computed motion: its frames, and what follows from them.

use core::fmt;
use std::sync::Arc;

use dynamics_view::suggest;

use crate::equations::Equations;
use crate::failure::FamilyMotionError;
use crate::integrate::Point;
use crate::integrate::hermite::quintic;
use crate::methods::FamilyMethod;
use crate::model::{EnergyParts, FamilyModel, FamilyState, Multipliers};
use crate::record::Record;

/// Times agree to this part of the motion.
const TIME_ROUNDING: f64 = 1e-12;

/// The motion of a model, as a simulation computed it: the states that were recorded.
pub struct FamilyMotion<'m, M: FamilyModel> {
    pub(crate) model: &'m M,
    pub(crate) record: Arc<Record<M>>,
}

impl<M: FamilyModel> fmt::Debug for FamilyMotion<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (start, end) = (self.start_time(), self.end_time());
        write!(f, "motion of {} from t = {start} to {end}, {} frames", M::NAME, self.record.frames.len())
    }
}

/// A recorded instant.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a, S> {
    /// Its time.
    pub t: f64,
    /// Its state; `None` where the states went to a file, beside start and end.
    pub state: Option<&'a S>,
    /// Its energies.
    pub energies: EnergyParts,
    /// Its scalar outputs, in the order of their declaration.
    pub outputs: &'a [f64],
}

impl<'m, M: FamilyModel> FamilyMotion<'m, M> {
    /// The model that moved.
    #[must_use]
    pub fn model(&self) -> &'m M {
        self.model
    }

    /// The state at the start.
    #[must_use]
    pub fn start(&self) -> &M::State {
        &self.record.start
    }

    /// The state at the end.
    #[must_use]
    pub fn end(&self) -> &M::State {
        &self.record.end
    }

    /// Time of the start.
    #[must_use]
    pub fn start_time(&self) -> f64 {
        self.record.start.t()
    }

    /// Time of the end.
    #[must_use]
    pub fn end_time(&self) -> f64 {
        self.record.end.t()
    }

    /// The method.
    #[must_use]
    pub fn method(&self) -> FamilyMethod {
        self.record.method
    }

    /// The recorded instants in the order of the motion, start and end included.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = Frame<'_, M::State>> + DoubleEndedIterator {
        (0..self.record.frames.len()).map(|index| self.frame(index))
    }

    fn frame(&self, index: usize) -> Frame<'_, M::State> {
        let frame = &self.record.frames[index];
        let last = self.record.frames.len() - 1;
        let state = frame.state.as_ref().or_else(|| match index {
            0 => Some(&self.record.start),
            index if index == last => Some(&self.record.end),
            _ => None,
        });
        Frame { t: frame.t, state, energies: frame.energies, outputs: &frame.outputs }
    }

    /// The state at time t.
    ///
    /// Where t is the time of a frame, to 10⁻¹² of the motion, it is the state of that frame. Between the
    /// ends of one step, as they are all recorded by `Every::steps(1)`, it is the quintic through q, q̇ and
    /// q̈ at both, with inputs between those of both: its error is O(h⁶), above that of methods of order 6
    /// and 8 with long steps. Elsewhere it is an error: frames that are further apart say
    /// nothing about waves between them. [`FamilyMotion::nearest`] gives the nearest frame.
    ///
    /// # Errors
    /// Times outside the motion, and between frames that are not the ends of one step.
    pub fn at(&self, t: f64) -> Result<M::State, FamilyMotionError> {
        let (before, after) = self.around(t)?;
        let frames = &self.record.frames;
        let not_recorded =
            || FamilyMotionError::NotRecorded { time: t, before: frames[before].t, after: frames[after].t };
        let states = (self.frame(before).state, self.frame(after).state);
        let (Some(start), Some(end)) = states else { return Err(not_recorded()) };
        if before == after {
            return Ok(start.clone());
        }
        match (frames[before].step, frames[after].step) {
            (Some(first), Some(second)) if first + 1 == second => Ok(self.between(start, end, t)),
            _ => Err(not_recorded()),
        }
    }

    /// The frame whose time is nearest.
    ///
    /// # Errors
    /// Times outside the motion.
    pub fn nearest(&self, t: f64) -> Result<Frame<'_, M::State>, FamilyMotionError> {
        let (before, after) = self.around(t)?;
        let frames = &self.record.frames;
        let is_first = (t - frames[before].t).abs() <= (frames[after].t - t).abs();
        Ok(self.frame(if is_first { before } else { after }))
    }

    /// The frames on both sides of a time; twice the same where it is one's own.
    fn around(&self, t: f64) -> Result<(usize, usize), FamilyMotionError> {
        let (start, end) = (self.start_time(), self.end_time());
        let direction = if end < start { -1.0 } else { 1.0 };
        let rounding = TIME_ROUNDING * (start.abs().max(end.abs()));
        let frames = &self.record.frames;
        let behind = frames.partition_point(|frame| (frame.t - t) * direction < -rounding);
        let is_hit = |index: usize| frames.get(index).is_some_and(|frame| (frame.t - t).abs() <= rounding);
        if is_hit(behind) {
            return Ok((behind, behind));
        }
        if behind == 0 || behind == frames.len() || t.is_nan() {
            return Err(FamilyMotionError::OutOfRange { time: t, start, end });
        }
        Ok((behind - 1, behind))
    }

    /// A state between both ends of a step.
    fn between(&self, start: &M::State, end: &M::State, t: f64) -> M::State {
        let (a0, a1) = (self.accelerations_of(start), self.accelerations_of(end));
        let point = |state: &M::State| Point { t: state.t(), q: state.q().to_vec(), u: state.u().to_vec() };
        let mut middle = point(start);
        let h = end.t() - start.t();
        let s = (t - start.t()) / h;
        quintic(s, h, [(&point(start), &a0), (&point(end), &a1)], &mut middle);
        let inputs = start.inputs().iter().zip(end.inputs()).map(|(x, y)| x + s * (y - x)).collect();
        M::State::new(t, middle.q, middle.u, inputs, start.ends().clone())
    }

    /// q̈ at a state, with the inputs of the state.
    #[must_use]
    pub fn accelerations_of(&self, state: &M::State) -> Vec<f64> {
        self.solution_at(state).0
    }

    /// q̈ and λ at a state; not a number where they do not exist.
    fn solution_at(&self, state: &M::State) -> (Vec<f64>, Multipliers) {
        let mut a = vec![0.0; state.q().len()];
        let solved = Equations::new(self.model, &self.record.mass, None, state).and_then(|mut equations| {
            equations.accelerations(state.t(), state.q(), state.u(), &mut a)?;
            Ok(equations.multipliers())
        });
        match solved {
            Ok(multipliers) => (a, multipliers),
            Err(_) => (vec![f64::NAN; state.q().len()], Multipliers::default()),
        }
    }

    /// The multipliers λ of a constraint at a state, named by its function, all rows of one component after
    /// the other: generalized forces that push toward growing values of the constraint. `None` where no
    /// constraint has the name.
    #[must_use]
    pub fn multipliers_of(&self, name: &str, state: &M::State) -> Option<Vec<f64>> {
        M::ROWS.iter().find(|field| field.name == name)?;
        Some(self.solution_at(state).1.of_name::<M>(name))
    }

    /// T and V at a state, with the inputs of the state.
    #[must_use]
    pub fn energies_of(&self, state: &M::State) -> EnergyParts {
        self.model.energies(state.view())
    }

    /// A scalar output at time t, as [`FamilyMotion::at`] has the state.
    ///
    /// # Errors
    /// As for [`FamilyMotion::at`]; where there is no scalar output of this name.
    pub fn output(&self, name: &str, t: f64) -> Result<f64, FamilyMotionError> {
        let index = Self::output_index(name, false)?;
        let (before, after) = self.around(t)?;
        if before == after {
            // Kept with every frame, whether its state is or not.
            let place = M::OUTPUTS[..index].iter().filter(|output| !output.numbered).count();
            return Ok(self.record.frames[before].outputs[place]);
        }
        let values = self.values_of(index, &self.at(t)?);
        Ok(values.first().copied().unwrap_or(f64::NAN))
    }

    /// A numbered output at time t, a value for every index.
    ///
    /// # Errors
    /// As for [`FamilyMotion::at`]; where there is no numbered output of this name.
    pub fn numbered_output(&self, name: &str, t: f64) -> Result<Vec<f64>, FamilyMotionError> {
        let index = Self::output_index(name, true)?;
        Ok(self.values_of(index, &self.at(t)?))
    }

    /// The index of an output of this kind.
    pub(crate) fn output_index(name: &str, numbered: bool) -> Result<usize, FamilyMotionError> {
        let Some(index) = M::OUTPUTS.iter().position(|output| output.name == name) else {
            let suggestion = suggest(name, M::OUTPUTS.iter().map(|output| output.name));
            return Err(FamilyMotionError::UnknownOutput { name: name.to_string(), suggestion });
        };
        let output = &M::OUTPUTS[index];
        match output.numbered == numbered {
            true => Ok(index),
            false => Err(FamilyMotionError::OtherOutput { name: output.name, numbered: output.numbered }),
        }
    }

    /// The values of an output at a state.
    pub(crate) fn values_of(&self, index: usize, state: &M::State) -> Vec<f64> {
        let (accelerations, multipliers) = self.solution_at(state);
        self.model.output(index, &M::coordinates(state, &accelerations, multipliers))
    }
}
