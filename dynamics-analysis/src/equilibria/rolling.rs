//! Steady motions under nonholonomic constraints: independent velocities that stay constant.
//!
//! ```text
//! v̇(z, v) = 0        for z, with v given
//! ```
//!
//! An example is the lean of a disk that rolls in a circle, with its turning and its spin given. The
//! dependent velocities and their rates follow from the constraints. These rates need not vanish: the contact
//! point of a disk goes round. The equations are EᵀM E v̇ = 0 of small motions (`linearize.rs`), whose
//! stiffness is their exact derivative by z at held v. They do not determine position and heading, so the
//! shortest steps are taken. J. P. Meijaard et al., Proc. R. Soc. A 463 (2007) 1955; Yu. I. Neimark &
//! N. A. Fufaev, *Dynamics of Nonholonomic Systems*, chapter VI.

use alloc::vec::Vec;

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::constrain::at_time;
use dynamics_runtime::constrain::reactions;
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use super::rounding::FORCE_NOISE_FACTOR;
use super::statics::excess;
use super::{Equilibrium, EquilibriumError, conditioning, sample_times, vector};
use crate::displacement::{displaced, project, size_in_scales};
use crate::linearize::{
    Linearization, LinearizeError, ModelDerivatives, Tangent, assemble, linearize, scales,
};

/// Largest number of Newton iterations for one choice of velocities.
const MAX_ITERATIONS: usize = 60;
/// From corrections of this length on, in the scales of the coordinates, full steps are taken until they are
/// no longer halved.
const CONVERGED_CORRECTION: f64 = 1e-7;
/// Largest number of corrections of the dependent coordinates on the way back to the constraints. They
/// converge quadratically.
const MAX_DEPENDENT_CORRECTIONS: usize = 12;
/// Columns of the stiffness below this share of the largest element belong to coordinates that no force
/// depends on, such as the position and the heading. They are differences of terms along the motion and are
/// known to fewer digits than other elements.
const ZERO_COLUMN_SHARE: f64 = 1e-9;
/// Longest step, in the scales of the coordinates, if forces need not decrease: a fifth of a radian.
const MAX_UNCHECKED_STEP: f64 = 0.2;
/// Singular values of the stiffness below this share of the largest are zero: position and heading are not
/// determined.
const ZERO_SINGULAR_VALUE_SHARE: f64 = 1e-11;

/// Longest step, in the scales of the coordinates, if forces have to decrease.
const MAX_CHECKED_STEP: f64 = 0.5;
/// Smallest share of a Newton step that is tried.
const MIN_STEP_SHARE: f64 = 1e-6;
/// Largest final projection, after the dependent coordinates were corrected.
const MAX_PROJECTION: f64 = 1e-6;

/// A model with the coordinates that are preferred as independent ones.
struct Rolling<'m, M: Constraints> {
    model: &'m M,
    constants: M::Constants,
    preferred: Vec<usize>,
}

/// The equations of small motions at a state.
struct RollingEquations {
    linear: Linearization,
    tangent: Tangent,
    /// EᵀM E v̇.
    force: DVector<f64>,
}

/// The steady motion near the state of a rolling system. The velocities of `held` coordinates are kept, or of
/// the first of [`velocity_choices`] that leads to a steady motion if there are none.
pub(super) fn find<M: Constraints>(
    model: &M,
    start: &M::State,
    held: &[usize],
) -> Result<Equilibrium<M::State>, EquilibriumError> {
    let constants = model.constants().map_err(SolveError::from)?;
    let mut rolling = Rolling { model, constants, preferred: held.to_vec() };
    let all =
        if held.is_empty() { velocity_choices::<M>(start).to_vec() } else { alloc::vec![held.to_vec()] };
    let mut why = None;
    for preferred in all {
        rolling.preferred = preferred;
        // Coordinates that are independent at the start remain so.
        let rates = rolling.equations(start)?.tangent.rates;
        if let Some(dependent) = held.iter().find(|i| !rates.contains(i)) {
            return Err(LinearizeError::Dependent { name: M::COORDINATES[*dependent].name }.into());
        }
        rolling.preferred = rates;
        for must_decrease in [true, false] {
            match rolling.search(start, must_decrease) {
                Ok(found) => return Ok(found),
                Err(error) => why = why.or(Some(error)),
            }
        }
    }
    Err(why.unwrap_or(EquilibriumError::NotSteady { name: M::COORDINATES[0].name, left: f64::NAN }))
}

/// Coordinates whose velocities may be kept: the angles, then those that move at the start, then whichever
/// the constraints leave independent.
fn velocity_choices<M: Constraints>(start: &M::State) -> [Vec<usize>; 3] {
    let angles = (0..M::Vector::LEN).filter(|i| M::COORDINATES[*i].is_angle()).collect();
    let moving = (0..M::Vector::LEN).filter(|i| start.u().as_slice()[*i] != 0.0).collect();
    [angles, moving, Vec::new()]
}

impl<M: Constraints> Rolling<'_, M> {
    fn equations(&self, state: &M::State) -> Result<RollingEquations, EquilibriumError> {
        let derivatives = ModelDerivatives::of(self.model, state)?;
        let tangent = Tangent::new(
            &derivatives.jacobian,
            derivatives.holonomic,
            &derivatives.mass,
            [self.preferred.as_slice(); 2],
        );
        let linear = assemble::<M>(&derivatives, &tangent);
        let force = &linear.mass * &linear.accelerations;
        Ok(RollingEquations { linear, tangent, force })
    }

    /// The state with its coordinates moved, back on the constraints, with the same independent velocities.
    fn moved(
        &self,
        state: &M::State,
        here: &RollingEquations,
        by: &DVector<f64>,
    ) -> Result<M::State, EquilibriumError> {
        let mut next = displaced(state, &(&here.tangent.positions * by));
        self.project(&mut next)?;
        let derivatives = ModelDerivatives::of(self.model, &next)?;
        let tangent = Tangent::new(
            &derivatives.jacobian,
            derivatives.holonomic,
            &derivatives.mass,
            [self.preferred.as_slice(); 2],
        );
        let missed = self.model.velocity_residual(&next);
        let held = active_rows::<M>(next.active_set(), false).map(|row| missed.as_slice()[row]);
        let change = tangent.particular(&DMatrix::from_iterator(tangent.row_count(), 1, held));
        next.u_mut().as_mut_slice().iter_mut().zip(change.iter()).for_each(|(u, d)| *u += d);
        Ok(next)
    }

    /// Projects onto the holonomic constraints by the dependent coordinates. The shortest projection would
    /// also move position and heading.
    fn project(&self, state: &mut M::State) -> Result<(), EquilibriumError> {
        for _ in 0..MAX_DEPENDENT_CORRECTIONS {
            let derivatives = ModelDerivatives::of(self.model, state)?;
            if derivatives.holonomic == 0 {
                break;
            }
            let rows = derivatives.jacobian.rows(0, derivatives.holonomic).into_owned();
            let tangent =
                Tangent::new(&rows, derivatives.holonomic, &derivatives.mass, [self.preferred.as_slice(); 2]);
            let residual = self.model.residual(state);
            let missed = active_rows::<M>(state.active_set(), true).map(|row| residual.as_slice()[row]);
            let change = tangent.particular(&DMatrix::from_iterator(derivatives.holonomic, 1, missed));
            let change = change.column(0).into_owned();
            *state = displaced(state, &change);
            if self.relative_change(state, &change) <= f64::EPSILON {
                break;
            }
        }
        // The rest is rounding. A longer way back means that the corrections failed.
        let taken = project(self.model, &self.constants, state)?;
        if taken.change > MAX_PROJECTION {
            let (row, distance) = (M::ROWS[0].name, taken.change);
            return Err(
                SolveError::OffConstraint { what: "positions", row, residual: distance, distance }.into()
            );
        }
        Ok(())
    }

    /// Newton's method. If `must_decrease`, steps are halved until forces become smaller. Otherwise they are
    /// only limited in length.
    fn search(
        &self,
        start: &M::State,
        must_decrease: bool,
    ) -> Result<Equilibrium<M::State>, EquilibriumError> {
        let mut state = self.moved(
            start,
            &self.equations(start)?,
            &DVector::zeros(self.equations(start)?.tangent.coordinates.len()),
        )?;
        let mut last = f64::INFINITY;
        for iterations in 0..MAX_ITERATIONS {
            let here = self.equations(&state)?;
            let newton = self.solve(&here, &here.force);
            let change = self.relative_change(&state, &(&here.tangent.positions * &newton));
            if change <= CONVERGED_CORRECTION
                && (change <= f64::EPSILON * f64::EPSILON || change > 0.5 * last)
            {
                return self.accept(state, &here, iterations, &newton);
            }
            // A share of the Newton step that fulfils the constraints and, if asked for, makes forces
            // smaller.
            last = if change <= CONVERGED_CORRECTION { change } else { f64::INFINITY };
            let longest = if must_decrease { MAX_CHECKED_STEP } else { MAX_UNCHECKED_STEP };
            let mut part = (longest / change).min(1.0);
            let norm = here.force.norm();
            state = loop {
                let next = self.moved(&state, &here, &(&newton * part));
                if let Ok(next) = next
                    && self.equations(&next).is_ok_and(|there| {
                        !must_decrease || change <= CONVERGED_CORRECTION || there.force.norm() < norm
                    })
                {
                    break next;
                }
                part *= 0.5;
                if part < MIN_STEP_SHARE {
                    return Err(self.not_steady(&here));
                }
            };
        }
        Err(self.not_steady(&self.equations(&state)?))
    }

    /// The shortest δz with K δz = force.
    fn solve(&self, here: &RollingEquations, force: &DVector<f64>) -> DVector<f64> {
        // Columns of coordinates that no force depends on, such as the position, are rounding and are set to
        // zero.
        let mut stiffness = here.linear.stiffness.clone();
        let most = stiffness.amax();
        stiffness
            .column_iter_mut()
            .filter(|column| column.amax() <= ZERO_COLUMN_SHARE * most)
            .for_each(|mut column| column.fill(0.0));
        let svd = stiffness.svd(true, true);
        let least = ZERO_SINGULAR_VALUE_SHARE * svd.singular_values.amax();
        svd.solve(force, least.max(f64::MIN_POSITIVE))
            .unwrap_or_else(|_| DVector::zeros(here.tangent.coordinates.len()))
    }

    /// The largest change of a coordinate, in its scale.
    fn relative_change(&self, state: &M::State, change: &DVector<f64>) -> f64 {
        size_in_scales(change, &scales(M::COORDINATES, state.q().as_slice()))
    }

    /// The steady motion at a state where the iteration converged. Its linearisation has to be steady, too.
    fn accept(
        &self,
        state: M::State,
        here: &RollingEquations,
        iterations: usize,
        last: &DVector<f64>,
    ) -> Result<Equilibrium<M::State>, EquilibriumError> {
        if let Some(reason) = linearize(self.model, &state, &[])?.unsteady {
            return Err(match reason {
                LinearizeError::Accelerates { .. } if here.force.amax() > 0.0 => self.not_steady(here),
                reason => reason.into(),
            });
        }
        let mut noise = here.force.abs();
        for sample in 0..4_u32 {
            let mut nearby = state;
            for (j, q) in nearby.q_mut().as_mut_slice().iter_mut().enumerate() {
                let sign = if (sample >> (j % 2)).is_multiple_of(2) { 1.0 } else { -1.0 };
                *q += sign * f64::from(1 + (sample + j as u32) % 4) * f64::EPSILON * *q;
            }
            let change = (self.equations(&nearby)?.force - &here.force).abs();
            noise.zip_apply(&change, |most, change| *most = most.max(change));
        }
        self.check_times(&state, here, &noise)?;
        let reach = self.solve(here, &noise).abs() + 3.0 * last.abs();
        let reach = here.tangent.positions.abs() * reach;
        let uncertainty: Vec<f64> = reach.iter().copied().collect();
        Ok(Equilibrium {
            reactions: reactions(self.model, &state)?,
            force_left: here.force.amax(),
            iterations,
            conditioning: conditioning::<M>(&state, &uncertainty),
            uncertainty: vector(&uncertainty),
            contains_time: M::EXPLICIT_TIME,
            coordinates: M::COORDINATES,
            state,
        })
    }

    /// Checks that no force changes with time, at the times at which balance is sampled elsewhere. It is
    /// checked at this position, not at the later ones of the motion.
    fn check_times(
        &self,
        state: &M::State,
        here: &RollingEquations,
        noise: &DVector<f64>,
    ) -> Result<(), EquilibriumError> {
        if !M::EXPLICIT_TIME {
            return Ok(());
        }
        let measures = |indices: &[usize], of: &[f64]| {
            DVector::from_iterator(indices.len(), indices.iter().map(|i| of[*i].abs()))
        };
        let places = measures(&here.tangent.coordinates, &scales(M::COORDINATES, state.q().as_slice()));
        let rates = measures(&here.tangent.rates, state.u().as_slice());
        let usual = here.linear.stiffness.abs() * places + here.linear.damping.abs() * rates;
        let allowed = (noise + usual * f64::EPSILON) * FORCE_NOISE_FACTOR;
        for after in sample_times() {
            let there = self.equations(&at_time(state, state.t() + after))?;
            if let Some((i, force)) = excess(&(&there.force - &here.force), &allowed) {
                let coordinate = M::COORDINATES[here.tangent.rates[i]].name;
                return Err(EquilibriumError::DependsOnTime { coordinate, force });
            }
        }
        Ok(())
    }

    /// The error if independent velocities change.
    fn not_steady(&self, here: &RollingEquations) -> EquilibriumError {
        let i = here.force.iamax();
        EquilibriumError::NotSteady { name: M::COORDINATES[here.tangent.rates[i]].name, left: here.force[i] }
    }
}
