//! Conditioning along a motion: of the mass matrix, and of the constraints near singular positions.

use alloc::vec::Vec;

use crate::constrain::conditioning::{constrained_condition_number, mass_condition_number};
use crate::constrain::gradients::mass;
use crate::constrain::rank_margin::{RankMargin, gradient_condition, rank_margin};
use crate::constrain::{TopContributors, with_workspace};
use crate::golden_section::golden_section_maximum;
use crate::integrate::Tolerances;
use crate::linalg::max_abs;
use crate::model::{ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::trajectory::motion::{Motion, Sampler};
use crate::simulate::trajectory::record::Record;
use crate::simulate::verification::singular_point_validation::missed_by;

/// The worst conditioning of the mass matrix that a motion met.
///
/// The number is κ = ‖S‖₁ ‖S⁻¹‖₁ of S = M scaled to a unit diagonal,
/// Sᵢⱼ = Mᵢⱼ/√|Mᵢᵢ Mⱼⱼ|. So it does not depend on units and sizes of the coordinates, which
/// do not change the digits that LDLᵀ loses either. Accelerations lose at most about log₁₀ κ of their
/// sixteen digits. Source: van der Sluis, Numer. Math. 14 (1969) 14: no other scaling of rows and columns
/// makes κ much smaller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditioning {
    /// Largest κ over the accepted states: 1 for a diagonal M, infinite for a singular one, NaN where M is
    /// not a number. Coordinates without any inertia, which constraints carry along, are left out. Where M
    /// alone would lose half of the digits, as where there are more coordinates than velocities (four Euler
    /// parameters of a body), κ is that of the inertia of the velocities that the constraints leave.
    pub largest: f64,
    /// When it was met first.
    pub time: f64,
    /// How many of how many accepted states were looked at: not all, where that would take longer than the
    /// run did.
    pub looked_at: (usize, usize),
}

/// Singular positions are searched only in models of up to so many coordinates: the condition number of the
/// constraints takes 30 n³ operations at every quarter of a step.
const MAX_COORDINATES: usize = 32;
/// The condition number of M is computed so many times for each evaluation of the accelerations in the run,
/// divided by the square n² of the number of coordinates. One takes as long as n²/8 evaluations, measured
/// on a chain of 45 masses, whose accelerations take time in proportion to n. So all together take as long as
/// the run. A smaller value looks at fewer states.
const CONDITIONS_PER_EVALUATION: f64 = 8.0;
/// Number of states whose condition number is computed however long that takes.
const MIN_STATES: usize = 8;
/// κ of M from which on the inertia on the constrained velocities is used instead: M alone would lose half
/// of the digits.
const CONSTRAINED_CONDITION: f64 = 1e8;
/// Parts of every step at whose ends the conditioning of the constraints is computed.
const PARTS_PER_STEP: usize = 4;
/// A peak of the condition number above this is a singular position that the motion passed. A smaller value
/// counts near misses of ordinary mechanisms, a larger one misses positions between the quarters of a step.
const PASSED_CONDITION: f64 = 1e4;
/// Constraints that miss a singular position by fewer permitted errors than this cannot be told from those
/// that have it: the steps do not decide whether the motion turns round.
const MISSED_ERRORS: f64 = 100.0;

/// Where a motion has been nearest to a singular position of its constraints, or in one.
#[derive(Clone, Debug, PartialEq)]
pub struct NearestSingularPosition {
    /// Largest over smallest singular value of Φ_q, coordinates measured by √Mᵢᵢ and the rows of a
    /// constraint by the longest of them.
    pub condition: f64,
    /// When.
    pub time: f64,
    /// The rows that come to depend on each other there.
    pub rows: TopContributors,
    /// The coordinates that they come to leave open there.
    pub coordinates: TopContributors,
    /// How many singular positions the motion has passed: places where the conditioning is above 10⁴
    /// between states where it is not.
    pub passed: usize,
    /// The first of them in which the constraints do not hold: by how much they miss it, in lengths of
    /// coordinates, up to a hundred permitted errors, and when. Branches cross in a singular position and
    /// avoid each other in a near miss. The steps do not decide whether the motion goes on or turns round
    /// there.
    pub missed: Option<(f64, f64)>,
}

impl<M: SimulationModel> Motion<'_, M> {
    /// Whether singular positions are searched: only with constraints and up to 32 coordinates, because it
    /// would cost more than the run.
    pub(crate) fn checks_singular_positions(&self) -> bool {
        M::IS_CONSTRAINED && M::COORDINATES.len() <= MAX_COORDINATES && self.is_repeatable()
    }

    /// Times and conditioning of the constraints at the quarters of the step that leaves a record.
    pub(crate) fn add_conditions(
        &self,
        sampler: &mut Sampler<'_, '_, M>,
        index: usize,
        out: &mut Vec<(f64, f64)>,
    ) {
        let Record { state, h, .. } = &self.trajectory.records[index];
        let parts = if *h == 0.0 { 1 } else { PARTS_PER_STEP };
        let times = (0..parts).map(|k| state.t() + h * k as f64 / PARTS_PER_STEP as f64);
        out.extend(times.map(|t| (t, gradient_condition(self.model(), &sampler.at(t)))));
    }

    /// The nearest approach to a singular position: of quarters of all steps, refined where the conditioning
    /// peaks between them.
    pub(crate) fn nearest(&self, conditions: &[(f64, f64)]) -> Option<NearestSingularPosition> {
        if M::IS_UNCONSTRAINED || conditions.is_empty() {
            return None;
        }
        let mut sampler = self.sampler();
        let mut worst =
            conditions.iter().copied().fold((self.start_time(), 0.0), |a, b| if b.1 > a.1 { b } else { a });
        let (mut passed, mut missed) = (0, None);
        for i in 1..conditions.len().saturating_sub(1) {
            let [before, here, after] = [conditions[i - 1], conditions[i], conditions[i + 1]];
            // Only peaks, and no constant values.
            if here.1 < before.1 || here.1 <= after.1 || here.1 < 1.01 * before.1.min(after.1) {
                continue;
            }
            let mut value = |t: f64| gradient_condition(self.model(), &sampler.at(t));
            let top = golden_section_maximum(before.0, after.0, &mut value);
            let top = if top.1 >= here.1 { top } else { here };
            if top.1 > PASSED_CONDITION {
                passed += 1;
                missed = missed.or_else(|| self.singular_position_missed(&sampler.at(top.0)));
            }
            worst = if top.1 > worst.1 { top } else { worst };
        }
        let RankMargin { condition, rows, coordinates } = rank_margin(self.model(), &sampler.at(worst.0));
        Some(NearestSingularPosition { condition, time: worst.0, rows, coordinates, passed, missed })
    }

    /// By how much the constraints miss the singular position near a state, and when, if the tolerance does
    /// not resolve that.
    fn singular_position_missed(&self, state: &M::State) -> Option<(f64, f64)> {
        let Tolerances { absolute, relative } = self.trajectory.tolerances;
        let permitted = absolute + relative * max_abs(state.q().as_slice());
        missed_by(self.model(), state).filter(|by| *by <= MISSED_ERRORS * permitted).map(|by| (by, state.t()))
    }

    pub(crate) fn conditioning(&self) -> Conditioning {
        with_workspace::<M, _>(|workspace| self.conditioning_with(workspace))
    }

    fn conditioning_with(&self, workspace: &mut [f64]) -> Conditioning {
        let records = &self.trajectory.records;
        let n = M::COORDINATES.len().max(1);
        let affordable = CONDITIONS_PER_EVALUATION * self.counts().evaluations as f64 / (n * n) as f64;
        // The condition number is computed again only where M has changed.
        let (mut last, mut condition) = (Vec::new(), 1.0);
        let mut at = |index: usize| {
            let state = self.complete(records[index].state);
            if !M::CONSTANT_MASS || last.is_empty() {
                let mass = mass(self.model(), &state, workspace);
                if last != mass {
                    condition = mass_condition_number(M::COORDINATES.len(), mass, M::IS_CONSTRAINED);
                    last.clear();
                    last.extend_from_slice(mass);
                }
            }
            if M::IS_CONSTRAINED && condition > CONSTRAINED_CONDITION {
                constrained_condition_number(self.model(), &state)
            } else {
                condition
            }
        };
        let mut worst = (0, at(0));
        let mut looked_at = 1;
        let mut consider = |index: usize, worst: &mut (usize, f64)| {
            let largest = at(index);
            // NaN is worse than any value.
            if !worst.1.is_nan() && (largest.is_nan() || largest > worst.1) {
                *worst = (index, largest);
            }
            looked_at += 1;
        };
        let every = records.len().div_ceil(MIN_STATES.max(affordable as usize)).max(1);
        (1..records.len()).filter(|index| index % every == 0).for_each(|index| consider(index, &mut worst));
        if every > 1 {
            // Around the worst of those, some states that were left out.
            let around = worst.0.saturating_sub(every - 1)..(worst.0 + every).min(records.len());
            let step = around.len().div_ceil(MIN_STATES);
            around.step_by(step).for_each(|index| consider(index, &mut worst));
        }
        let (index, largest) = worst;
        let time = records[index].state.t();
        Conditioning { largest, time, looked_at: (looked_at.min(records.len()), records.len()) }
    }
}
