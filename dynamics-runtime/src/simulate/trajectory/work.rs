//! The work–energy account: E(end) − E(start) = Σ work of forces + Σ changes at resets.
//!
//! The work of every named power is integrated by the method itself, as if it were another state: W += h Σ
//! bᵢ Pᵢ over the stages of each step. So it has the order of the method, and the account closes to the
//! tolerance of the run. The closure error measures the errors of the motion and of the account together.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::fmt;

use crate::integrate::{Accelerations as _, Stabilized as _, Switching as _};
use crate::model::{ModelState, SimulationModel};
use crate::simulate::erased_method::{SharedMethod, StepReplay};
use crate::simulate::right_hand_side::state_on_branches;
use crate::simulate::trajectory::motion::{Motion, Sampler};

/// Parts of long steps for quadrature, as in position analysis: see `Motion::add_work`.
const QUADRATURE_PARTS: u32 = 4;
/// Relative rounding error of evaluated energies. Resets that change the energy by less are ignored.
const ENERGY_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Work of one force, or the energy that resets at one event brought.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkRow {
    /// Name of the force, of the dissipation, `explicit time`, or of the event.
    pub name: String,
    /// Work over the whole motion; positive where it brought energy.
    pub work: f64,
}

/// The work–energy account of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkAccount {
    /// Work of every power that the model names, in its order; then `changing inputs`, NaN, where a closure
    /// supplies inputs that are in the energies: their rates are not known.
    pub forces: Vec<WorkRow>,
    /// Energy change at resets, by event; of those that change it by more than rounding.
    pub resets: Vec<WorkRow>,
    /// Energy function at the start.
    pub energy_start: f64,
    /// Energy function at the end.
    pub energy_end: f64,
    /// E(end) − E(start) − all work: 0 for an exact motion.
    pub closure_error: f64,
    /// What the closure error is to be compared with: the largest of |T|, |V|, |E| met and of the works.
    pub scale: f64,
}

/// Energy along the accepted steps.
pub(crate) struct EnergyHistory {
    /// Time and E − E₀ − work up to there, not scaled.
    pub(crate) errors: Vec<(f64, f64)>,
    /// Largest of |½ q̇·∂L/∂q̇|, |E − ½ q̇·∂L/∂q̇| and |E|: of T and V for natural systems.
    pub(crate) scale: f64,
    pub(crate) account: WorkAccount,
}

impl<'m, M: SimulationModel> Motion<'m, M> {
    /// The work–energy account: the work of every force, energy changes at resets, and the error with which
    /// it closes.
    ///
    /// NaN where a motion was saved from a failed simulation without its inputs closure.
    #[must_use]
    pub fn work(&self) -> WorkAccount {
        self.energy_history(true, |_, _| {}).account
    }

    /// (t, (E − E₀ − work)/scale) at the accepted steps, for plots of the energy's drift; `work` is that of
    /// forces and resets up to there, `scale` the largest of |T|, |V|, |E| met.
    #[must_use]
    pub fn energy_errors(&self) -> Vec<(f64, f64)> {
        let history = self.energy_history(true, |_, _| {});
        let scale = if history.scale > 0.0 { history.scale } else { 1.0 };
        history.errors.into_iter().map(|(t, error)| (t, error / scale)).collect()
    }

    /// The energy along the record. With `works` the works of forces are integrated, which makes every step
    /// again; otherwise they are NaN. `visit` is called with each step while its interpolant is cached,
    /// because steps of implicit methods are as costly to repeat as they were.
    pub(crate) fn energy_history(
        &self,
        works: bool,
        mut visit: impl FnMut(&mut Sampler<'_, 'm, M>, usize),
    ) -> EnergyHistory {
        let records = &self.trajectory.records;
        let mut work = vec![0.0; M::POWERS.len()];
        let mut resets: Vec<WorkRow> = Vec::new();
        let mut errors = Vec::with_capacity(records.len());
        let mut scale = 0.0f64;
        let has_unknown_work = M::ENERGY_HAS_INPUTS && self.trajectory.has_law;
        let mut sampler = self.reader();
        let (mut first, mut energy, mut reset_energy, mut size) = (0.0, 0.0, 0.0, 0.0f64);
        for (index, record) in records.iter().enumerate() {
            let state = self.complete(record.state);
            let (before, size_before) = (energy, size);
            energy = self.model().energy_function(&state);
            size = self.energy_scale(&state, energy);
            match index.checked_sub(1) {
                None => first = energy,
                Some(last) if records[last].h == 0.0 => {
                    let change = energy - before;
                    // Sticking and elastic impacts change no energy; a smaller change is rounding of T and V.
                    if change.is_nan() || change.abs() > ENERGY_ROUNDING * size.max(size_before) {
                        reset_energy += change;
                        self.add_reset(&mut resets, state.t(), change);
                    }
                }
                Some(last) if works => self.add_work(&mut sampler, last, &mut work),
                Some(_) => work.fill(f64::NAN),
            }
            scale = scale.max(size);
            visit(&mut sampler, index);
            let has_unknown_work = if index > 0 && has_unknown_work { f64::NAN } else { 0.0 };
            errors.push((
                state.t(),
                energy - first - reset_energy - work.iter().sum::<f64>() - has_unknown_work,
            ));
        }
        let mut forces: Vec<WorkRow> = M::POWERS
            .iter()
            .zip(&work)
            .map(|(power, work)| WorkRow { name: power.name.into(), work: *work })
            .collect();
        if has_unknown_work {
            forces.push(WorkRow { name: "changing inputs".into(), work: f64::NAN });
        }
        let largest = forces.iter().chain(&resets).fold(scale, |s, row| s.max(row.work.abs()));
        let account = WorkAccount {
            forces,
            resets,
            energy_start: first,
            energy_end: energy,
            closure_error: errors.last().map_or(0.0, |(_, error)| *error),
            scale: largest,
        };
        EnergyHistory { errors, scale, account }
    }

    fn energy_scale(&self, state: &M::State, energy: f64) -> f64 {
        let momenta = self.model().momenta(state);
        let twice: f64 = (0..M::COORDINATES.len()).map(|i| momenta[i] * state.u()[i]).sum();
        (0.5 * twice).abs().max((energy - 0.5 * twice).abs()).max(energy.abs())
    }

    fn add_reset(&self, rows: &mut Vec<WorkRow>, t: f64, work: f64) {
        let at_reset = |e: &&crate::simulate::EventRecord<M::State>| e.time() == t && e.before != e.after;
        let name = self.events().iter().find(at_reset).map_or("reset", |event| &event.name);
        match rows.iter_mut().find(|row| row.name == name) {
            Some(row) => row.work += work,
            None => rows.push(WorkRow { name: name.into(), work }),
        }
    }

    /// Adds the work done during the step that leaves a record.
    fn add_work(&self, sampler: &mut Sampler<'_, '_, M>, index: usize, work: &mut [f64]) {
        if work.is_empty() {
            return;
        }
        let done = self.is_repeatable()
            && match self.trajectory.erased_method_of(index) {
                Some(erased_method) => self.meter(erased_method, sampler, index, work),
                // Steps of a position analysis are up to a radian of a crank long. On quarters of them the
                // quadrature error is about 10⁻¹² of the energy (slider-crank, Jansen's leg).
                None => sampler.meter_by_quadrature(index, 4, work),
            };
        if !done {
            work.fill(f64::NAN);
        }
    }

    /// Adds the work done during a step that a method made; false where it cannot be made again.
    fn meter(
        &self,
        erased_method: &SharedMethod<M>,
        sampler: &mut Sampler<'_, '_, M>,
        index: usize,
        work: &mut [f64],
    ) -> bool {
        let weights = erased_method.weights();
        if weights.is_empty() {
            // Five nodes are exact up to degree nine, enough for powers along the quintics of implicit
            // methods. Taylor series have higher orders and longer steps.
            let long = erased_method.needs_series();
            sampler.meter_by_quadrature(index, if long { QUADRATURE_PARTS } else { 1 }, work)
        } else if self.step(index).flags.between {
            // Its stages are off the constraints, and so are their reactions. Interpolated states are
            // projected.
            sampler.meter_by_quadrature(index, QUADRATURE_PARTS, work)
        } else {
            self.meter_by_stages(&mut *erased_method.step_replay(), weights, index, work)
        }
    }

    /// Makes a step again and sums h bᵢ Pᵢ over its stages; false where it cannot be made again.
    pub(crate) fn meter_by_stages(
        &self,
        step_replay: &mut dyn StepReplay<M>,
        weights: &'static [f64],
        index: usize,
        work: &mut [f64],
    ) -> bool {
        let mut step = self.step(index);
        let (mut rhs, tolerances) = (self.rhs(index), &self.trajectory.tolerances);
        rhs.project_stages(step.flags.stages, tolerances);
        if rhs.hold_branches(&mut step.start, step.h, step.flags.branches).is_err() {
            return false;
        }
        if rhs.begin_attempt(&mut step.start, step.h).is_err() {
            return false;
        }
        let (model, branches, h) = (rhs.model, rhs.held_branches, step.h);
        let (mut stages, mut powers) = (weights.iter().copied(), vec![0.0; work.len()]);
        let mut read = move |state: &M::State| {
            let weight = stages.next().unwrap_or(0.0);
            if weight == 0.0 {
                return;
            }
            model.powers(&state_on_branches::<M>(branches, state), &mut powers);
            for (work, power) in work.iter_mut().zip(&powers) {
                *work += h * weight * power;
            }
        };
        read(&rhs.state(step.start.t, &step.start.y.q, &step.start.y.u));
        rhs.listener = Some(Box::new(read));
        step_replay.attempt(&mut rhs, &step, tolerances)
    }
}

impl fmt::Display for WorkAccount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows = || self.forces.iter().chain(&self.resets);
        let widest = rows().map(|row| row.name.chars().count()).max().unwrap_or(0) + "work of ".len();
        let width = widest.max("energy at the start".len());
        let mut line = |name: &str, value: f64| writeln!(f, "  {name:<width$}  {value:>+24.12e}");
        line("energy at the start", self.energy_start)?;
        for row in &self.forces {
            line(&alloc::format!("work of {}", row.name), row.work)?;
        }
        for row in &self.resets {
            line(&alloc::format!("resets at {}", row.name), row.work)?;
        }
        line("energy at the end", self.energy_end)?;
        write!(f, "  {:<width$}  {:>+24.1e}  of {:.6e}", "not accounted for", self.closure_error, self.scale)
    }
}
