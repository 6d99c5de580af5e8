//! Motions that are solved from constraints instead of being integrated.

use alloc::string::ToString;
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

use crate::integrate::{StepFlags, Tolerances};
use crate::model::{ModelState, SimulationModel};
use crate::simulate::options::formulation::Formulation;
use crate::simulate::options::output_times::every;
use crate::simulate::stabilization::StabilizationCounts;
use crate::simulate::trajectory::motion::{Motion, Sampler};
use crate::simulate::trajectory::record::{Counts, Record, Trajectory};

/// Gauss–Legendre nodes in 0..1 and weights, order 10: Abramowitz & Stegun, table 25.4.
const GAUSS: [(f64, f64); 5] = [
    (0.046910077030668004, 0.11846344252809454),
    (0.23076534494715845, 0.23931433524968324),
    (0.5, 0.28444444444444444),
    (0.7692346550528415, 0.23931433524968324),
    (0.953089922969332, 0.11846344252809454),
];

impl<'m, M: SimulationModel> Motion<'m, M> {
    /// The motion of solved states with their accelerations, in order and at least one.
    pub(crate) fn of_positions(
        model: &'m M,
        constants: M::Constants,
        states: Vec<(M::State, M::Vector)>,
        interval: Option<f64>,
        counts: Counts,
    ) -> Self {
        let times: Vec<f64> = states.iter().map(|(state, _)| state.t()).collect();
        let step = |i: usize| times.get(i + 1).map_or(0.0, |next| next - times[i]);
        let record = |(i, (state, accelerations))| Record {
            state,
            accelerations,
            h: step(i),
            flags: StepFlags::default(),
            mean_sensitivity: None,
            correction_time: 0.0,
        };
        let reason = "because the constraints leave no freedom".to_string();
        let (start, end) = (times[0], times[times.len() - 1]);
        let trajectory = Trajectory {
            erased_method: None,
            relay: None,
            reason: reason.clone(),
            // No error is estimated, and states are always projected onto the constraints.
            tolerances: Tolerances { absolute: f64::INFINITY, relative: 0.0 },
            records: states.into_iter().enumerate().map(record).collect(),
            output_times: interval.map(|interval| every(start, end, interval)),
            events: Vec::new(),
            counts,
            has_law: false,
            formulation: Some((Formulation::Projected, reason)),
            stabilization: StabilizationCounts::default(),
            masked_events: Vec::new(),
            consistent: true,
            error: None,
            fixed: false,
        };
        Self::new(model, constants, None, Arc::new(trajectory))
    }
}

impl<M: SimulationModel> Sampler<'_, '_, M> {
    /// Adds the works of the step of a record by Gauss–Legendre quadrature on `parts` parts of it, where
    /// stages are not known.
    pub(crate) fn meter_by_quadrature(&mut self, index: usize, parts: u32, work: &mut [f64]) -> bool {
        let motion = self.motion();
        let Record { state, h, .. } = motion.trajectory.records[index];
        let mut powers = vec![0.0; work.len()];
        let part = h / f64::from(parts);
        for i in 0..parts {
            for (node, weight) in GAUSS {
                motion.model().powers(&self.at(state.t() + (f64::from(i) + node) * part), &mut powers);
                work.iter_mut().zip(&powers).for_each(|(work, power)| *work += part * weight * power);
            }
        }
        true
    }
}
