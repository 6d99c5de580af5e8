//! Whether charts describe one model: the same accelerations, energy, outputs and events at the same place.

use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use crate::constrain::conditioning::condition_number;
use crate::model::{ModelState, Vector};
use crate::simulate::charts::ChartSwitching;
use crate::simulate::charts::error::{ChartError, Compared};
use crate::simulate::simulation::Simulate;
use crate::simulate::trajectory::motion::Motion;

/// Rounding errors that may add up in a compared quantity, in units of one.
const ADDED_ROUNDINGS: f64 = 1e4;
/// Condition number of the mass matrix up to which it enlarges the tolerance. Larger ones come from
/// constraints or from locking, and would accept any difference.
const MAX_CONDITION: f64 = 1e8;
/// The same for the energy, which is not divided by the mass matrix.
const MAX_CONDITION_OF_ENERGY: f64 = 1e3;
/// Relative tolerance for values of the user's closures.
pub(crate) const CLOSURE_TOLERANCE: f64 = 1e-6;
/// Displacement, in rad, of the state at which charts are compared: in equilibrium or at rest many quantities
/// are zero, and zeros prove nothing.
const DISPLACEMENT: f64 = 0.3;

/// A quantity in two charts.
pub(crate) struct ChartPair {
    pub(crate) what: Compared,
    pub(crate) name: &'static str,
    pub(crate) values: [f64; 2],
    /// Relative tolerance for rounding.
    pub(crate) rounding: f64,
    /// The size that rounding is relative to.
    pub(crate) size: f64,
}

impl ChartPair {
    /// Whether the values differ by more than rounding, of the size here or of one met elsewhere.
    pub(crate) fn differs(&self, size: f64) -> bool {
        let [a, b] = self.values;
        // NaN must be NaN in both charts.
        let differs = if a.is_nan() && b.is_nan() { 0.0 } else { (a - b).abs() };
        differs > self.rounding * self.size.max(size) || differs.is_nan()
    }
}

impl<M: Simulate + Clone> ChartSwitching<M> {
    /// Compares two charts near a state of the first one. Returns where, in both; `None` of a state that is
    /// not a number.
    pub(crate) fn compare_near(
        &self,
        from: usize,
        to: usize,
        state: &M::State,
    ) -> Result<Option<[M::State; 2]>, ChartError> {
        // `None` for a NaN state, which the run reports.
        let Some(states) = self.regular_state_near([from, to], state) else { return Ok(None) };
        if let Some(ChartPair { what, name, values, .. }) =
            self.compared_quantities([from, to], &states).into_iter().find(|pair| pair.differs(0.0))
        {
            return Err(ChartError::Disagree { what, name, values, time: state.t() });
        }
        Ok(Some(states))
    }

    /// The displaced state that is farthest from locking in both charts, expressed in both; `None` for a NaN
    /// state.
    pub(crate) fn regular_state_near(
        &self,
        [from, to]: [usize; 2],
        state: &M::State,
    ) -> Option<[M::State; 2]> {
        let displaced_state = [1.0, -1.0, 2.0, -2.0, 3.0, -3.0]
            .map(|times| self.displaced_state(from, to, state, times * DISPLACEMENT));
        let regular = |states: &[M::State; 2]| {
            let distances =
                states.iter().flat_map(|state| self.references.iter().map(|at| at.distance(state)));
            distances.fold(f64::INFINITY, f64::min)
        };
        displaced_state.into_iter().flatten().max_by(|a, b| regular(a).total_cmp(&regular(b)))
    }

    /// A displaced state in both charts.
    fn displaced_state(&self, from: usize, to: usize, state: &M::State, by: f64) -> Option<[M::State; 2]> {
        let mut here = *state;
        let rotation = |i: usize| self.references.iter().any(|at| at.set.angles.contains(&i));
        let largest = |values: &[f64], of_turns: bool| {
            let of_kind = values.iter().enumerate().filter(|(i, _)| rotation(*i) == of_turns);
            of_kind.fold(0.0, |most: f64, (_, x)| most.max(x.abs()))
        };
        let (other, rate) = (largest(state.q().as_slice(), false), largest(state.u().as_slice(), true));
        for (i, q) in here.q_mut().as_mut_slice().iter_mut().enumerate() {
            *q += if rotation(i) { 0.5 * by } else { by * (0.2 * q.abs() + 0.1 * other) };
        }
        for (i, u) in here.u_mut().as_mut_slice().iter_mut().enumerate() {
            *u += if rotation(i) { 0.3 * rate } else { 0.1 * *u };
        }
        let mut there = here;
        for (k, reference) in self.references.iter().enumerate() {
            here.q_mut().as_mut_slice()[reference.set.angles[1]] += 0.5 * by;
            there.q_mut().as_mut_slice()[reference.set.angles[1]] += 0.5 * by;
            let turned = [from, to].map(|chart| chart >> k & 1 == 1);
            if turned[0] != turned[1] {
                reference.re_express(&mut there, turned[0], turned[1]).ok()?;
            }
        }
        Some([here, there])
    }

    /// Accelerations, energy, outputs and events of the model in both charts.
    pub(crate) fn compared_quantities(&self, charts: [usize; 2], states: &[M::State; 2]) -> Vec<ChartPair> {
        let models = charts.map(|chart| &self.charts[chart]);
        let in_both_charts = [0, 1].map(|k| (models[k], &states[k]));
        let conditioning = in_both_charts.map(|(model, state)| condition_number(model, state));
        let conditioning = conditioning[0].max(conditioning[1]);
        let mut compared_quantities = Vec::new();
        let mut add = |what, name, values: [f64; 2], scale: f64| {
            // The condition number of a mass matrix that is regular only with its constraints, as that of
            // Euler parameters, is no measure of rounding.
            let worst = if what == Compared::Energy { MAX_CONDITION_OF_ENERGY } else { MAX_CONDITION };
            let rounding = ADDED_ROUNDINGS * f64::EPSILON * (1.0 + conditioning.min(worst));
            let size = scale.max(values[0].abs()).max(values[1].abs());
            compared_quantities.push(ChartPair { what, name, values, rounding, size });
        };
        // Where there are no accelerations the run reports why.
        if let [Ok(a), Ok(b)] = in_both_charts.map(|(model, state)| model.accelerations(state)) {
            let accelerations = [a, b];
            for (k, reference) in self.references.iter().enumerate() {
                let spins = [0, 1].map(|c| {
                    reference.angular_motion(&states[c], accelerations[c].as_slice(), charts[c] >> k & 1 == 1)
                });
                let size = spins
                    .iter()
                    .map(|[omega, alpha]| omega.norm_squared().max(alpha.norm()))
                    .fold(0.0, f64::max);
                for i in 0..3 {
                    add(
                        Compared::AngularAcceleration,
                        reference.names[1],
                        spins.map(|[_, alpha]| alpha.to_array()[i]),
                        size,
                    );
                }
            }
            let rotation = |i: usize| self.references.iter().any(|at| at.set.angles.contains(&i));
            for (i, coordinate) in M::COORDINATES.iter().enumerate().filter(|(i, _)| !rotation(*i)) {
                add(Compared::Acceleration, coordinate.name, accelerations.map(|a| a.as_slice()[i]), 0.0);
            }
        }
        let energies = in_both_charts.map(|(model, state)| model.energy_function(state));
        let doubled = in_both_charts.map(|(model, state)| {
            state
                .u()
                .as_slice()
                .iter()
                .zip(model.momenta(state).as_slice())
                .map(|(u, p)| (u * p).abs())
                .sum::<f64>()
        });
        add(Compared::Energy, "energy", energies, doubled[0].max(doubled[1]));
        let outputs = in_both_charts.map(|(model, state)| {
            let mut values = vec![f64::NAN; M::OUTPUTS.len()];
            model.outputs(state, &mut values).is_ok().then_some(values)
        });
        let events = in_both_charts.map(|(model, state)| {
            let mut values = vec![f64::NAN; M::EVENTS.len()];
            model.events(state, &mut values).is_ok().then_some(values)
        });
        for (what, quantities, values) in
            [(Compared::Output, M::OUTPUTS, outputs), (Compared::Event, M::EVENTS, events)]
        {
            let [Some(a), Some(b)] = values else { continue };
            for (i, quantity) in quantities.iter().enumerate() {
                // Components that vanish are rounding of others with the same unit.
                let alike = quantities.iter().zip(&a).filter(|(other, _)| other.unit == quantity.unit);
                let size = alike
                    .fold(1e-3, |most: f64, (_, x)| if x.is_finite() { most.max(x.abs()) } else { most });
                add(what, quantity.name, [a[i], b[i]], size);
            }
        }
        compared_quantities
    }
}

/// Checks that inputs are continuous: a closure that reads the angles themselves makes them jump. The size of
/// each input is its largest value in both parts.
pub(crate) fn same_inputs<M: Simulate>(
    before: &Motion<'_, M>,
    after: &Motion<'_, M>,
) -> Result<(), ChartError> {
    let (from, to) = (before.end(), after.start());
    for (k, quantity) in M::INPUTS.iter().enumerate() {
        let of = |state: &M::State| state.inputs().as_slice()[k];
        let (a, b) = (of(&from), of(&to));
        let size = before.steps().chain(after.steps()).map(|state| of(&state).abs()).fold(0.0, f64::max);
        let differs = (a - b).abs();
        if differs > CLOSURE_TOLERANCE * size || differs.is_nan() {
            let (what, name) = (Compared::Input, quantity.name);
            return Err(ChartError::Disagree { what, name, values: [a, b], time: from.t() });
        }
    }
    Ok(())
}

/// Whether functions of events, given with the simulation, have the same values in both charts.
pub(crate) fn same_functions(functions: &[Vec<(String, f64)>; 2], time: f64) -> Result<(), ChartError> {
    for ((event, a), (_, b)) in functions[0].iter().zip(&functions[1]) {
        let differs = if a.is_nan() && b.is_nan() { 0.0 } else { (a - b).abs() };
        // A function near zero is rounding of its terms.
        if differs > CLOSURE_TOLERANCE * a.abs().max(b.abs()).max(1e-6) || differs.is_nan() {
            return Err(ChartError::EventDisagrees { event: event.clone(), values: [*a, *b], time });
        }
    }
    Ok(())
}
