//! The terms of an objective and their derivatives at a state.

use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::constrain::solve_once;
use dynamics_runtime::model::{ModelState, Parameters, Vector};
use dynamics_runtime::simulate::Simulate;
use nalgebra::{DMatrix, DVector};

use super::super::equations::{by_parameter, differences, not_solved};
use super::super::sensitivity::variational_equations::VariationalEquations;
use super::super::sensitivity::{MeasuredQuantity, OUTPUT_STEP};
use super::super::sensitivity_error::SensitivityError;
use crate::linearize::scales;

/// A term of an objective, as it was given.
pub(super) enum Term {
    End { quantity: String, weight: f64 },
    At { quantity: String, weight: f64, time: f64 },
    Integral { quantity: String, weight: f64 },
    Squares { quantity: String, weight: f64, points: Vec<(f64, f64)> },
}

/// A weighted sum of coordinates, velocities and outputs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct WeightedSum {
    /// Weights of q and q̇.
    state: DVector<f64>,
    /// Weights of the outputs.
    outputs: DVector<f64>,
}

/// A term at an instant.
pub(super) struct Instant {
    pub(super) time: f64,
    quantity: MeasuredQuantity,
    weight: f64,
    /// The measured value of a squared difference; `None` for a linear term.
    from: Option<f64>,
}

/// An objective with names resolved.
pub(super) struct ParsedObjective {
    /// By growing time.
    pub(super) instants: Vec<Instant>,
    pub(super) integrand: Option<WeightedSum>,
}

impl ParsedObjective {
    /// Resolves names and checks weights and points.
    pub(super) fn of<M: Simulate>(terms: &[Term], end: f64) -> Result<Self, SensitivityError> {
        let mut plan = Self { instants: Vec::new(), integrand: None };
        let weighed = |name: &str, weight: f64| {
            let quantity = MeasuredQuantity::of::<M>(name)?;
            if !weight.is_finite() {
                return Err(SensitivityError::Weight { name: name.into(), weight });
            }
            Ok(quantity)
        };
        // Terms at instants become a list by time; integrals become one weighted sum.
        for term in terms {
            match term {
                Term::End { quantity: name, weight } => {
                    let (quantity, weight) = (weighed(name, *weight)?, *weight);
                    plan.instants.push(Instant { time: end, quantity, weight, from: None });
                }
                Term::At { quantity: name, weight, time } => {
                    let (quantity, weight, time) = (weighed(name, *weight)?, *weight, *time);
                    plan.instants.push(Instant { time, quantity, weight, from: None });
                }
                Term::Integral { quantity: name, weight } => {
                    let quantity = weighed(name, *weight)?;
                    plan.integrand.get_or_insert_with(WeightedSum::none::<M>).add::<M>(quantity, *weight);
                }
                Term::Squares { quantity: name, weight, points } => {
                    let (quantity, weight) = (weighed(name, *weight)?, *weight);
                    if points.is_empty() {
                        return Err(SensitivityError::NoObjective);
                    }
                    for (row, (time, value)) in points.iter().enumerate() {
                        if !(time.is_finite() && value.is_finite()) {
                            let (name, time, value) = (name.clone(), *time, *value);
                            return Err(SensitivityError::NotANumber { name, row, time, value });
                        }
                        plan.instants.push(Instant { time: *time, quantity, weight, from: Some(*value) });
                    }
                }
            }
        }
        if plan.instants.is_empty() && plan.integrand.is_none() {
            return Err(SensitivityError::NoObjective);
        }
        plan.instants.sort_by(|a, b| a.time.total_cmp(&b.time));
        Ok(plan)
    }
}

impl Instant {
    /// The value of the term, and the weighted sum that has its derivative.
    pub(super) fn read<M: Simulate + Parameters + Clone>(
        &self,
        along: &VariationalEquations<'_, '_, M>,
        state: &M::State,
    ) -> Result<(f64, WeightedSum), SensitivityError> {
        let mut one = WeightedSum::none::<M>();
        one.add::<M>(self.quantity, 1.0);
        let value = one.value(along, state)?;
        let (part, slope) = match self.from {
            Some(from) => ((value - from).powi(2), 2.0 * (value - from)),
            None => (value, 1.0),
        };
        one.state *= self.weight * slope;
        one.outputs *= self.weight * slope;
        Ok((self.weight * part, one))
    }
}

/// Derivatives of a weighted sum at a state.
pub(super) struct SumDerivatives {
    /// By q and q̇, 2N.
    pub(super) state: DVector<f64>,
    /// By the parameter of each column; 0 for elements of the start.
    pub(super) parameters: DVector<f64>,
    /// Whether no differences entered.
    pub(super) exact: bool,
}

impl WeightedSum {
    fn none<M: Simulate>() -> Self {
        Self { state: DVector::zeros(2 * M::Vector::LEN), outputs: DVector::zeros(M::OUTPUTS.len()) }
    }

    fn add<M: Simulate>(&mut self, quantity: MeasuredQuantity, weight: f64) {
        match quantity {
            MeasuredQuantity::Position(i) => self.state[i] += weight,
            MeasuredQuantity::Velocity(i) => self.state[M::Vector::LEN + i] += weight,
            MeasuredQuantity::Output(i) => self.outputs[i] += weight,
        }
    }

    /// Whether it contains outputs, which may have corners and jumps.
    pub(super) fn has_outputs(&self) -> bool {
        self.outputs.iter().any(|weight| *weight != 0.0)
    }

    fn of_state<S: ModelState>(&self, state: &S) -> f64 {
        let all = state.q().as_slice().iter().chain(state.u().as_slice());
        all.zip(self.state.iter()).map(|(x, weight)| x * weight).sum()
    }

    /// The part of the outputs, with the model of the motion or a changed one.
    fn of_outputs<M: Simulate>(&self, model: &M, state: &M::State) -> Result<f64, SensitivityError> {
        if !self.has_outputs() {
            return Ok(0.0);
        }
        let mut values = alloc::vec![0.0; M::OUTPUTS.len()];
        model.outputs(state, &mut values).map_err(|error| not_solved::<M>(state, error))?;
        // Outputs without a weight need not be finite.
        let weighted = values.iter().zip(self.outputs.iter()).filter(|(_, weight)| **weight != 0.0);
        let value: f64 = weighted.map(|(x, weight)| x * weight).sum();
        if value.is_finite() { Ok(value) } else { Err(SensitivityError::NotFinite { time: state.t() }) }
    }

    pub(super) fn value<M: Simulate + Parameters + Clone>(
        &self,
        along: &VariationalEquations<'_, '_, M>,
        state: &M::State,
    ) -> Result<f64, SensitivityError> {
        Ok(self.of_state(state) + self.of_outputs(along.motion.model(), state)?)
    }

    /// The derivatives; `a` is A of the variational equations there.
    pub(super) fn derivatives<M: Simulate + Parameters + Clone>(
        &self,
        along: &VariationalEquations<'_, '_, M>,
        state: &M::State,
        a: &DMatrix<f64>,
    ) -> Result<SumDerivatives, SensitivityError> {
        let parameters = DVector::zeros(along.parameters.len());
        let mut found = SumDerivatives { state: self.state.clone(), parameters, exact: true };
        if !self.has_outputs() {
            return Ok(found);
        }
        let (of_outputs, exact) = self.of_outputs_by_state(along, state, a)?;
        found.state += of_outputs;
        found.exact = exact;
        let none = DVector::zeros(1);
        for (k, parameter) in along.parameters.iter().enumerate() {
            let Some(parameter) = parameter else { continue };
            let value = |model: &M| Ok(DVector::from_element(1, self.of_outputs(model, state)?));
            found.parameters[k] = by_parameter(along.motion.model(), *parameter, &none, value)?[0];
            found.exact = false;
        }
        Ok(found)
    }

    /// By q and q̇ alone.
    pub(super) fn by_state<M: Simulate + Parameters + Clone>(
        &self,
        along: &VariationalEquations<'_, '_, M>,
        state: &M::State,
        a: &DMatrix<f64>,
    ) -> Result<DVector<f64>, SensitivityError> {
        Ok(&self.state + self.of_outputs_by_state(along, state, a)?.0)
    }

    /// The derivatives of the outputs by q and q̇, and whether they are exact.
    fn of_outputs_by_state<M: Simulate + Parameters + Clone>(
        &self,
        along: &VariationalEquations<'_, '_, M>,
        state: &M::State,
        a: &DMatrix<f64>,
    ) -> Result<(DVector<f64>, bool), SensitivityError> {
        match self.generated(along, state, a) {
            Some(by) => Ok((by, true)),
            None => Ok((self.by_differences(along, state)?, false)),
        }
    }

    /// The derivatives of the outputs by q and q̇ from generated code; `None` if there is none, or if the
    /// outputs depend on reactions or on a law of inputs.
    fn generated<M: Simulate + Parameters + Clone>(
        &self,
        along: &VariationalEquations<'_, '_, M>,
        state: &M::State,
        a: &DMatrix<f64>,
    ) -> Option<DVector<f64>> {
        let (y, n, r, w) = (M::OUTPUTS.len(), M::Vector::LEN, M::Rows::LEN, M::Inputs::LEN);
        let motion = along.motion;
        let solved = solve_once(motion.model(), motion.constants(), state).ok()?;
        let mut values = alloc::vec![0.0; y * (3 * n + r + w)];
        if !motion.model().output_variations(state, &solved.accelerations, &solved.multipliers, &mut values) {
            return None;
        }
        let weighted: Vec<usize> = (0..y).filter(|i| self.outputs[*i] != 0.0).collect();
        let mut rest = values.as_slice();
        let [by_q, by_u, by_accelerations, by_lambda, by_inputs] = [n, n, n, r, w].map(|columns| {
            let (matrix, after) = rest.split_at(y * columns);
            rest = after;
            let weighed =
                |j: usize| weighted.iter().map(|i| self.outputs[*i] * matrix[i * columns + j]).sum::<f64>();
            DVector::from_fn(columns, |j, _| weighed(j))
        });
        let follows = motion.has_law() && by_inputs.iter().any(|x| *x != 0.0);
        if follows || by_lambda.iter().any(|x| *x != 0.0) {
            return None;
        }
        let mut found = DVector::zeros(2 * n);
        found.rows_mut(0, n).copy_from(&by_q);
        found.rows_mut(n, n).copy_from(&by_u);
        found += a.rows(n, n).tr_mul(&by_accelerations);
        found.iter().all(|x| x.is_finite()).then_some(found)
    }

    /// The derivatives of the outputs by q and q̇ by differences.
    fn by_differences<M: Simulate + Parameters + Clone>(
        &self,
        along: &VariationalEquations<'_, '_, M>,
        state: &M::State,
    ) -> Result<DVector<f64>, SensitivityError> {
        let n = M::Vector::LEN;
        let sizes = [state.q().as_slice(), state.u().as_slice()].map(|of| scales(M::COORDINATES, of));
        let none = DVector::zeros(1);
        let mut found = DVector::zeros(2 * n);
        for j in 0..2 * n {
            let value = |by: f64| {
                let mut moved = *state;
                let vector = if j < n { moved.q_mut() } else { moved.u_mut() };
                vector[j % n] += by;
                let moved = if along.motion.has_law() { along.motion.complete(moved) } else { moved };
                Ok(DVector::from_element(1, self.of_outputs(along.motion.model(), &moved)?))
            };
            found[j] = differences(OUTPUT_STEP * sizes[j / n][j % n], &none, value)?[0];
        }
        Ok(found)
    }
}
