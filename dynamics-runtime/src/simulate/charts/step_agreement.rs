//! Agreement of charts at the end of every step: forces that act in a range of angles, or for a time, show
//! only there.

use alloc::vec::Vec;

use crate::model::{ModelState, Vector};
use crate::simulate::charts::ChartSwitching;
use crate::simulate::charts::agreement::{CLOSURE_TOLERANCE, ChartPair};
use crate::simulate::charts::error::{ChartError, Compared};
use crate::simulate::simulation::{Simulate, Simulation};
use crate::simulate::trajectory::motion::Motion;

/// The other chart is not evaluated nearer to locking than this, in rad, where its values are mostly
/// rounding.
const MIN_LOCK_ANGLE: f64 = 0.02;
/// A disagreement must also exist at this part of a step before or after the end of the step. Steps end where
/// functions jump, and there rounding selects the side.
const STEP_END_PROBE: f64 = 1e-3;

/// The largest size of each quantity along the motion, by which its rounding is measured.
struct QuantitySizes(Vec<(Compared, &'static str, f64)>);

impl QuantitySizes {
    fn record_size(&mut self, pair: &ChartPair) {
        let known = self.0.iter_mut().find(|(what, name, _)| (*what, *name) == (pair.what, pair.name));
        match known {
            Some((_, _, size)) if pair.size > *size => *size = pair.size,
            None if pair.size.is_finite() => self.0.push((pair.what, pair.name, pair.size)),
            _ => {}
        }
    }

    fn differs(&self, pair: &ChartPair) -> bool {
        let known = self.0.iter().find(|(what, name, _)| (*what, *name) == (pair.what, pair.name));
        pair.differs(known.map_or(0.0, |(_, _, size)| *size))
    }
}

/// A part of a motion and the chart that it is compared with.
pub(crate) struct StepComparison<'b, 'a, M: Simulate> {
    pub(crate) switching: &'b ChartSwitching<M>,
    pub(crate) motion: &'b Motion<'a, M>,
    pub(crate) charts: [usize; 2],
    /// The simulation in the other chart, for its inputs.
    pub(crate) other: Simulation<'a, M>,
}

impl<M: Simulate + Clone> StepComparison<'_, '_, M> {
    /// Compares both charts at the end of every step.
    pub(crate) fn compare_near(&self) -> Result<(), ChartError> {
        let records = &self.motion.trajectory.records;
        let mut sizes = QuantitySizes(Vec::new());
        // At rest or in equilibrium many quantities are zero; at a displaced state they are not.
        let regular_state_near =
            records.first().and_then(|first| self.switching.regular_state_near(self.charts, &first.state));
        for pair in regular_state_near.map(|states| self.compared_quantities(states)).unwrap_or_default() {
            sizes.record_size(&pair);
        }
        let mut suspects = Vec::new();
        for (k, record) in records.iter().enumerate() {
            let Some(states) = self.in_both_charts(record.state) else { continue };
            for pair in self.compared_quantities(states) {
                sizes.record_size(&pair);
                if sizes.differs(&pair) {
                    suspects.push((k, pair));
                }
            }
        }
        for (k, pair) in suspects {
            if sizes.differs(&pair) && self.persists(k, &pair, &sizes) {
                let (what, name, values) = (pair.what, pair.name, pair.values);
                return Err(ChartError::Disagree { what, name, values, time: records[k].state.t() });
            }
        }
        Ok(())
    }

    /// Whether a disagreement at the end of step k also exists right before or after it.
    fn persists(&self, k: usize, found: &ChartPair, sizes: &QuantitySizes) -> bool {
        let records = &self.motion.trajectory.records;
        let here = &records[k].state;
        let neighbours = [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|i| records.get(i));
        let mut moved =
            neighbours.map(|next| next.state.t() - here.t()).filter(|step| *step != 0.0).peekable();
        // A motion of one instant has no neighbouring state.
        moved.peek().is_none()
            || moved.any(|step| {
                let mut state = self.motion.at(here.t() + STEP_END_PROBE * step);
                *state.inputs_mut() = *here.inputs();
                let compared_quantities = self
                    .in_both_charts(state)
                    .map(|states| self.compared_quantities(states))
                    .unwrap_or_default();
                compared_quantities
                    .iter()
                    .any(|pair| (pair.what, pair.name) == (found.what, found.name) && sizes.differs(pair))
            })
    }

    /// A state in both charts; `None` where one of them is near locking.
    fn in_both_charts(&self, here: M::State) -> Option<[M::State; 2]> {
        let mut there = here;
        for (k, reference) in self.switching.references.iter().enumerate() {
            let turned = self.charts.map(|chart| chart >> k & 1 == 1);
            if turned[0] != turned[1] {
                reference.re_express(&mut there, turned[0], turned[1]).ok()?;
            }
        }
        let far =
            |state: &M::State| self.switching.references.iter().all(|at| at.distance(state) > MIN_LOCK_ANGLE);
        (far(&here) && far(&there)).then_some([here, there])
    }

    /// The compared quantities: the inputs of the closure in each chart, and everything else with the inputs
    /// of this part.
    fn compared_quantities(&self, [here, there]: [M::State; 2]) -> Vec<ChartPair> {
        let (own, others) = (self.motion.complete(here), self.other.complete(there));
        let mut same = there;
        *same.inputs_mut() = *own.inputs();
        let inputs = M::INPUTS.iter().enumerate().map(|(i, quantity)| {
            let values = [&own, &others].map(|state| state.inputs().as_slice()[i]);
            let size = values[0].abs().max(values[1].abs());
            ChartPair {
                what: Compared::Input,
                name: quantity.name,
                values,
                rounding: CLOSURE_TOLERANCE,
                size,
            }
        });
        inputs.chain(self.switching.compared_quantities(self.charts, &[own, same])).collect()
    }
}
