//! What an action at an event may do: change the state, and strike, engage and release constraints.
//!
//! Impacts are instantaneous: M Δq̇ = Φ_qᵀΛ. All contacts that touch take part in them.
//! [`constrain::impact`] solves them, by Poisson's hypothesis; which contacts touch, and which hits are too
//! slow to rebound, is decided in `stabilization/contacts.rs`. Unilateral constraints use the same functions
//! (`unilateral.rs`). `run/event_handling.rs` calls the actions and restarts the motion.
//!
//! [`constrain::impact`]: crate::constrain::impact

use alloc::boxed::Box;
use alloc::vec::Vec;

use dynamics_view::suggest;

use crate::constrain::assemble::CONSISTENT;
use crate::integrate::StepOptions;
use crate::model::{Constraint, ConstraintKind, ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::events::contact_corner;
use crate::simulate::failure::event_action::EventActionError;
use crate::simulate::stabilization::{ConsistencyError, Stabilization};

/// The part of a constraint in an impact, M Δq̇ = Φ_qᵀΛ, in which several constraints may take part.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact {
    /// The constraint.
    pub constraint: &'static str,
    /// Whether it held before: others were hit, and it took an impulse with them.
    pub held: bool,
    /// Φ̇ (or A q̇ + b) of its rows just before.
    pub approach: Vec<f64>,
    /// Λ of its rows: multiplier times time.
    pub impulse: Vec<f64>,
    /// Its share −½ Λᵀ Φ_q(q̇⁺ + q̇⁻) of the loss of kinetic energy ½ q̇ᵀMq̇; negative
    /// where a moving constraint strikes.
    pub energy_lost: f64,
}

/// Change of accelerations by friction, in parts of 1 + |q̈|, below which the side of a slip does not
/// matter. At the instant at which its contact lifts off, friction is zero up to the accuracy of that
/// instant.
const NEGLIGIBLE_FRICTION: f64 = 1e-9;
/// Largest violation of a contact at its impact, in permitted errors of the step: if another contact was hit
/// first within the step, this one is met late.
const MAX_LATE_CONTACT: f64 = 100.0;
/// The same in parts of the size of the contact: the bound of fixed steps, which have no tolerance, and an
/// upper bound of the others.
const MAX_LATE_CONTACT_SIZE: f64 = 1e-3;

/// Half the time, in parts of 1 + |t|, across which a function is compared to find a jump at an instant.
/// Smooth functions change by about this part of their rate, far below the bounds of a jump.
const JUMP_HALF_WIDTH: f64 = 1e-9;

/// Rate |Φ̇| of a row after an impact, in parts of the largest speed in it, that is zero up to rounding.
const AT_REST_RATE: f64 = 1e-10;

/// How a constraint is struck.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ImpactKind {
    /// By the law of its contact.
    ContactLaw,
    /// With this coefficient of restitution.
    Restitution(f64),
    /// It stops, pushed or pulled, and holds from then on.
    Capture,
}

impl From<ConsistencyError> for EventActionError {
    fn from(error: ConsistencyError) -> Self {
        match error {
            ConsistencyError::State(error) => Self::State(Box::new(error)),
            ConsistencyError::Solve(error) => Self::Solve(error),
        }
    }
}

crate::error::sentence_for_debugging!(EventActionError);

/// The state at an event, which an action may change, and the constraints, which it may strike, engage and
/// release.
///
/// A change that is not possible (an unknown name, a constraint engaged where it is violated) ends the
/// simulation with an error at this event. Changes after it are not made.
pub struct EventAction<'c, M: SimulationModel> {
    model: &'c M,
    constants: &'c M::Constants,
    /// The state at the event, before the first action there.
    instant: M::State,
    state: &'c mut M::State,
    stabilization: &'c mut Stabilization<M>,
    /// Options of the steps that end at the events; `None` where no step does.
    steps: Option<StepOptions>,
    impacts: Vec<Impact>,
    error: Option<EventActionError>,
}

impl<'c, M: SimulationModel> EventAction<'c, M> {
    pub(crate) fn new(
        model: &'c M,
        constants: &'c M::Constants,
        instant: M::State,
        state: &'c mut M::State,
        stabilization: &'c mut Stabilization<M>,
    ) -> Self {
        Self {
            model,
            constants,
            instant,
            state,
            stabilization,
            steps: None,
            impacts: Vec::new(),
            error: None,
        }
    }

    /// An action at the end of a step with these options.
    pub(crate) fn at_end_of_steps(self, options: &StepOptions) -> Self {
        Self { steps: Some(*options), ..self }
    }

    /// Largest violation of a contact at its impact, in parts of its size.
    fn permitted_gap(&mut self, constraint: &Constraint) -> f64 {
        let Some(StepOptions { fixed, tolerances, .. }) = self.steps else { return CONSISTENT };
        let size = self.stabilization.size_of(self.model, self.state, constraint);
        let adaptive = MAX_LATE_CONTACT * (tolerances.relative + tolerances.absolute / size);
        if fixed.is_some() {
            MAX_LATE_CONTACT_SIZE
        } else {
            adaptive.clamp(CONSISTENT, MAX_LATE_CONTACT_SIZE)
        }
    }

    /// The state at the event, before the first action there.
    pub(crate) fn instant(&self) -> &M::State {
        &self.instant
    }

    /// The state at the event, with the changes so far.
    pub fn state(&self) -> &M::State {
        self.state
    }

    /// The state, to be changed as [`on_event`](crate::simulate::Simulation::on_event) changes it.
    pub fn state_mut(&mut self) -> &mut M::State {
        self.state
    }

    /// The model that moves.
    pub fn model(&self) -> &'c M {
        self.model
    }

    /// The impacts so far: the constraints that were hit, and those that held and took an impulse with them.
    pub fn impacts(&self) -> &[Impact] {
        &self.impacts
    }

    /// Whether a switched constraint holds.
    ///
    /// # Errors
    /// Where there is no constraint of this name, or it is not one that can be switched.
    pub fn holds(&self, name: &str) -> Result<bool, EventActionError> {
        self.switched(name).map(|(_, index)| self.state.active_set().holds(index))
    }

    /// λ of a constraint at the current state, by rows; 0 where it does not hold. Empty where λ cannot be
    /// found, which ends the simulation.
    pub fn reaction(&mut self, name: &str) -> Vec<f64> {
        self.apply(|change| {
            let constraint = find::<M>(name)?;
            let solved = change.stabilization.reactions(change.model, change.constants, change.state)?;
            Ok(rows_of(constraint, solved.as_slice()))
        })
        .unwrap_or_default()
    }

    /// An impact on a constraint, switched or not, with the coefficient of restitution e, by Poisson's
    /// hypothesis: the impulse of restitution is e times that of compression. For a single hit that is
    /// Newton's law Φ̇⁺ = −e Φ̇⁻. A released holonomic constraint of one row only pushes, towards
    /// positive Φ: an impact on it while Φ grows ends the simulation.
    ///
    /// Constraints that hold continue to hold, except for contacts declared with
    /// [`contact`](crate::simulate::Simulation::contact): these do not pull, and open if the impact opens
    /// them. Contacts that touch but are released are hit, too, with their own restitution. See
    /// [`constrain::impact`](crate::constrain::impact).
    pub fn impact(&mut self, name: &str, restitution: f64) {
        self.apply(|change| {
            let constraint = find::<M>(name)?;
            if let Some((row, residual)) = change.missed_row(constraint, CONSISTENT) {
                return Err(EventActionError::ImpactApart { row, residual });
            }
            let pushes = constraint.kind == ConstraintKind::Holonomic && constraint.rows == 1;
            let free = constraint.switched.is_some_and(|switch| !change.state.active_set().holds(switch));
            let least =
                CONSISTENT * change.stabilization.velocity_size(change.model, change.state, constraint);
            if pushes
                && free
                && change.stabilization.slip_velocity(change.model, change.state, constraint) > least
            {
                let rate = change.model.velocity_residual(change.state)[constraint.first];
                return Err(EventActionError::ImpactAway { row: M::ROWS[constraint.first].name, rate });
            }
            change.apply_impact(constraint, ImpactKind::Restitution(restitution))
        });
    }

    /// Closes a contact whose gap has fallen to zero. An error where the gap has jumped to its value, or
    /// where the contact is hit in an edge.
    pub(crate) fn close_at_gap_zero(&mut self, constraint: &'static Constraint) {
        self.apply(|change| {
            if let Some((row, residual)) = change.missed_row(constraint, CONSISTENT) {
                // A gap jumps only at a kink, on whose branches it differs.
                if contact_corner::gap_jumps(change.model, change.state, constraint.first, residual) {
                    return Err(EventActionError::ContactJumps { row, residual });
                }
                change.project_onto_contact(constraint)?;
            }
            let later = change.state_after(JUMP_HALF_WIDTH);
            if M::HAS_KINKS
                && contact_corner::is_hit_in_edge(
                    change.model,
                    change.stabilization,
                    [change.state, &later],
                    constraint,
                )
            {
                return Err(EventActionError::ContactEdge { row: M::ROWS[constraint.first].name });
            }
            Ok(())
        });
        self.close(constraint);
    }

    /// Projects a contact that is met late onto its ground, if its violation is permitted.
    fn project_onto_contact(&mut self, constraint: &'static Constraint) -> Result<(), EventActionError> {
        let permitted = self.permitted_gap(constraint);
        if let Some((row, residual)) = self.missed_row(constraint, permitted) {
            return Err(EventActionError::ContactMissed { row, residual });
        }
        let mut there = *self.state;
        constraint.switched.iter().for_each(|switch| there.active_set_mut().engage(*switch));
        self.stabilization.project_positions(self.model, &mut there)?;
        *self.state.q_mut() = *there.q();
        Ok(())
    }

    /// Closes a contact by its law, together with those that touch at the same instant: it rebounds or holds.
    /// One that is at zero again although it moves away has rebounded too slowly to be seen, and comes to
    /// rest.
    pub(crate) fn close(&mut self, constraint: &'static Constraint) {
        self.apply(|change| {
            let index = position_of::<M>(constraint);
            let rates = change.model.velocity_residual(change.state);
            let is_back = rates[constraint.first] > 0.0
                && (change.is_unresolved(constraint) && change.stabilization.rests_unresolved(index, &rates)
                    || change.stabilization.rests_after_hidden_hop(index, &rates));
            change
                .apply_impact(constraint, if is_back { ImpactKind::Capture } else { ImpactKind::ContactLaw })
        });
    }

    /// Whether a contact moves away no faster than the tolerance resolves velocities.
    fn is_unresolved(&mut self, constraint: &Constraint) -> bool {
        let steps = self.steps.filter(|steps| steps.fixed.is_none());
        let part = steps.map_or(CONSISTENT, |steps| steps.tolerances.relative);
        self.stabilization.slip_velocity(self.model, self.state, constraint).abs()
            <= part * self.stabilization.velocity_size(self.model, self.state, constraint)
    }

    /// Whether the slip of a released constraint of one row jumps here from this side to the other, as the
    /// speed of a belt may. The slip has then not come to rest.
    pub(crate) fn slip_jumps_away(&mut self, constraint: &'static Constraint, side: f64) -> bool {
        let mut slip = |part: f64| {
            let displaced = self.state_after(part);
            self.stabilization.slip_velocity(self.model, &displaced, constraint)
        };
        let (before, after) = (slip(-JUMP_HALF_WIDTH), slip(JUMP_HALF_WIDTH));
        let least = CONSISTENT * self.stabilization.velocity_size(self.model, self.state, constraint);
        (after - before).abs() > least && -side * after > least
    }

    /// The state later by a part of 1 + |t|, or earlier if that is negative. It holds no branches.
    fn state_after(&self, part: f64) -> M::State {
        let (t, mut q, u) = (self.state.t(), *self.state.q(), *self.state.u());
        let shift = part * (1.0 + t.abs());
        (0..M::Vector::LEN).for_each(|i| q[i] += shift * u[i]);
        let mut displaced = M::State::new(t + shift, q, u, *self.state.inputs());
        *displaced.active_set_mut() = self.state.active_set();
        displaced
    }

    /// The side to which a constraint of one row breaks away if its reaction jumps here: against the reaction
    /// behind the jump. `None` where it does not jump.
    pub(crate) fn breakaway_side(&mut self, constraint: &'static Constraint) -> Option<f64> {
        let ahead = self.state_after(JUMP_HALF_WIDTH);
        let mut reaction = |state: &M::State| {
            let solved = self.stabilization.reactions(self.model, self.constants, state).ok()?;
            Some(solved[constraint.first])
        };
        let (now, ahead) = (reaction(self.state)?, reaction(&ahead)?);
        // A change of less than half is no jump: the reaction here decides.
        ((ahead - now).abs() > 0.5 * ahead.abs()).then(|| -ahead.signum())
    }

    /// Engages a constraint whose slip has just fallen to zero. Velocities change by rounding alone, which is
    /// not recorded as an impact. Contacts that hold continue to hold.
    pub(crate) fn engage_without_impact(&mut self, name: &str) {
        self.apply(|change| {
            let (constraint, index) = change.switched(name)?;
            change.check_engageable(constraint)?;
            if !change.state.active_set().holds(index) {
                change.state.active_set_mut().engage(index);
                change.stabilization.impact(
                    change.model,
                    change.state,
                    &[(position_of::<M>(constraint), 0.0)],
                )?;
            }
            Ok(())
        });
    }

    /// Engages a switched constraint, with a plastic impact that stops its rows, pushing or pulling. Contacts
    /// take part as in [`EventAction::impact`].
    pub fn engage(&mut self, name: &str) {
        self.apply(|change| {
            let (constraint, index) = change.switched(name)?;
            change.check_engageable(constraint)?;
            if !change.state.active_set().holds(index) {
                change.apply_impact(constraint, ImpactKind::Capture)?;
            }
            Ok(())
        });
    }

    /// Releases a switched constraint that holds: a holonomic one to the side where Φ grows, a nonholonomic
    /// one of one row against the sign of λ. Several rows, or λ = 0 where friction depends on the side,
    /// determine no side. That ends the simulation; use [`EventAction::release_to`].
    pub fn release(&mut self, name: &str) {
        self.apply(|change| {
            let (constraint, index) = change.switched(name)?;
            if !change.state.active_set().holds(index) {
                return Ok(());
            }
            let side = match constraint.kind {
                ConstraintKind::Holonomic => 1.0,
                ConstraintKind::Nonholonomic => {
                    let solved =
                        change.stabilization.reactions(change.model, change.constants, change.state)?;
                    match solved[constraint.first] {
                        reaction if constraint.rows == 1 && reaction.abs() > 0.0 => -reaction.signum(),
                        // Without a reaction and without friction either side is right.
                        _ if constraint.rows == 1
                            && !change.stabilization.side_matters(
                                change.model,
                                change.constants,
                                change.state,
                                index,
                                NEGLIGIBLE_FRICTION,
                            ) =>
                        {
                            1.0
                        }
                        _ => return Err(EventActionError::NoSide { constraint: constraint.name }),
                    }
                }
            };
            change.state.active_set_mut().release(index, side);
            Ok(())
        });
    }

    /// Whether a constraint that holds has no reaction, and accelerations after its release are the same for
    /// either side, up to [`NEGLIGIBLE_FRICTION`].
    pub(crate) fn slips_either_way(&mut self, constraint: &'static Constraint) -> bool {
        let (model, constants, first) = (self.model, self.constants, constraint.first);
        let either = |change: &mut Self| {
            let idle = change.stabilization.reactions(model, constants, change.state)?[first] == 0.0;
            let mut counts = |switch| {
                change.stabilization.side_matters(model, constants, change.state, switch, NEGLIGIBLE_FRICTION)
            };
            Ok(idle && constraint.switched.is_some_and(|switch| !counts(switch)))
        };
        self.apply(either).unwrap_or(false)
    }

    /// Releases a switched constraint to a side: that of growing Φ (or A q̇ + b) where `side` is not
    /// negative.
    pub fn release_to(&mut self, name: &str, side: f64) {
        self.apply(|change| {
            let (_, index) = change.switched(name)?;
            change.state.active_set_mut().release(index, side);
            Ok(())
        });
    }

    /// Makes a change, unless an earlier one has failed. Keeps the first error.
    fn apply<R>(&mut self, act: impl FnOnce(&mut Self) -> Result<R, EventActionError>) -> Option<R> {
        if self.error.is_some() {
            return None;
        }
        act(self).map_err(|error| self.error = Some(error)).ok()
    }

    fn switched(&self, name: &str) -> Result<(&'static Constraint, usize), EventActionError> {
        let constraint = find::<M>(name)?;
        match constraint.switched {
            Some(index) => Ok((constraint, index)),
            None => Err(EventActionError::NotSwitched { constraint: constraint.name }),
        }
    }

    /// One impact on a constraint and on all contacts that touch. Contacts do not pull, and those that end at
    /// rest hold.
    fn apply_impact(
        &mut self,
        constraint: &'static Constraint,
        impact_kind: ImpactKind,
    ) -> Result<(), EventActionError> {
        if let ImpactKind::Restitution(value) = impact_kind
            && !(0.0..=1.0).contains(&value)
        {
            return Err(EventActionError::Restitution { value });
        }
        // What is hit, with its restitution: the constraint itself, then the contacts that touch.
        let index = position_of::<M>(constraint);
        let held = self.state.active_set();
        let touching = self.stabilization.touching_contacts(self.model, self.state, held)?;
        let (start, before) = (*self.state, self.model.velocity_residual(self.state));
        let mut hits = Vec::with_capacity(touching.len() + 1);
        match impact_kind {
            ImpactKind::Restitution(restitution) => hits.push((index, restitution)),
            ImpactKind::Capture => {
                constraint.switched.iter().for_each(|switch| self.state.active_set_mut().engage(*switch));
                hits.push((index, 0.0));
            }
            ImpactKind::ContactLaw => hits.push((index, self.stabilization.restitution(index, &before))),
        }
        for contact in touching.iter().copied().filter(|contact| *contact != index) {
            let holds = M::CONSTRAINTS[contact].switched.is_none_or(|switch| held.holds(switch));
            hits.push((contact, if holds { 0.0 } else { self.stabilization.restitution(contact, &before) }));
        }
        let closing = |contact: usize| {
            contact == index && impact_kind == ImpactKind::ContactLaw || touching.contains(&contact)
        };
        let contacts = hits
            .iter()
            .map(|hit| hit.0)
            .filter(|hit| closing(*hit) && !(*hit == index && impact_kind == ImpactKind::Capture));
        let contacts: Vec<(usize, usize)> =
            contacts.filter_map(|hit| Some((hit, M::CONSTRAINTS[hit].switched?))).collect();
        // A rocking body comes to rest as a bouncing one does: if all contacts are slow, all hold.
        let all_come_to_rest = impact_kind == ImpactKind::ContactLaw
            && contacts
                .iter()
                .all(|(hit, switch)| held.holds(*switch) || self.stabilization.is_slow(*hit, &before));
        for (_, switch) in &contacts {
            match all_come_to_rest {
                true => self.state.active_set_mut().engage(*switch),
                false => self.state.active_set_mut().release(*switch, 1.0),
            }
        }
        let jump = self.stabilization.impact(self.model, self.state, &hits)?;
        // Contacts that are at rest after the impact hold. Rounding is relative to the fastest hit.
        let fastest = hits.iter().map(|hit| before[M::CONSTRAINTS[hit.0].first].abs()).fold(0.0, f64::max);
        for (contact, switch) in contacts {
            if self.is_at_rest(&start, M::CONSTRAINTS[contact].first, fastest) {
                self.state.active_set_mut().engage(switch);
            }
        }
        self.record(&start, constraint, before.as_slice(), jump.impulses.as_slice());
        Ok(())
    }

    /// Whether a row is at rest after an impact, up to rounding. `fastest` is the largest rate of the rows
    /// that were hit.
    fn is_at_rest(&mut self, before: &M::State, row: usize, fastest: f64) -> bool {
        let rate = self.model.velocity_residual(self.state)[row];
        let gradients = self.stabilization.gradients(self.model, self.state);
        let speeds =
            before.u().as_slice().iter().zip(self.state.u().as_slice()).map(|(a, b)| a.abs().max(b.abs()));
        let largest =
            gradients.row(row).iter().zip(speeds).map(|(x, speed)| x.abs() * speed).fold(0.0, f64::max);
        rate.abs() <= AT_REST_RATE * largest.max(fastest)
    }

    /// Records the constraint that was struck, and those that took an impulse with it.
    fn record(&mut self, start: &M::State, struck: &'static Constraint, before: &[f64], impulses: &[f64]) {
        let gradients = self.stabilization.gradients(self.model, start);
        let (u, v) = (start.u().as_slice(), self.state.u().as_slice());
        let twice_mean =
            |row: usize| gradients.row(row).iter().zip(u.iter().zip(v)).map(|(x, (u, v))| x * (u + v));
        let rate = |row: usize| twice_mean(row).sum::<f64>();
        for constraint in M::CONSTRAINTS {
            let rows = constraint.first..constraint.first + constraint.rows;
            if constraint != struck && impulses[rows.clone()].iter().all(|impulse| *impulse == 0.0) {
                continue;
            }
            self.impacts.push(Impact {
                constraint: constraint.name,
                held: constraint != struck
                    && constraint.switched.is_none_or(|switch| start.active_set().holds(switch)),
                approach: rows_of(constraint, before),
                impulse: rows_of(constraint, impulses),
                energy_lost: 0.0
                    - rows
                        .filter(|row| impulses[*row] != 0.0)
                        .map(|row| 0.5 * impulses[row] * rate(row))
                        .sum::<f64>(),
            });
        }
    }

    /// Refuses to engage a holonomic constraint where Φ is not 0.
    fn check_engageable(&mut self, constraint: &'static Constraint) -> Result<(), EventActionError> {
        match self.missed_row(constraint, CONSISTENT) {
            Some((row, residual)) => Err(EventActionError::EngagedApart { row, residual }),
            None => Ok(()),
        }
    }

    /// The row of a released holonomic constraint that is violated most, and its Φ, if that is above this
    /// part of its size.
    fn missed_row(&mut self, constraint: &'static Constraint, part: f64) -> Option<(&'static str, f64)> {
        let holds = constraint.switched.is_none_or(|switch| self.state.active_set().holds(switch));
        match constraint.kind {
            ConstraintKind::Holonomic if !holds => {
                self.stabilization.missed_row(self.model, self.state, constraint, part)
            }
            _ => None,
        }
    }

    /// The impacts, or why the changes cannot be made.
    pub(crate) fn finish(self) -> Result<Vec<Impact>, EventActionError> {
        self.error.map_or(Ok(self.impacts), Err)
    }
}

/// The constraint of a name.
pub(crate) fn find<M: SimulationModel>(name: &str) -> Result<&'static Constraint, EventActionError> {
    M::CONSTRAINTS.iter().find(|constraint| constraint.name == name).ok_or_else(|| {
        let suggestion = suggest(name, M::CONSTRAINTS.iter().map(|constraint| constraint.name));
        EventActionError::UnknownConstraint { name: name.into(), suggestion }
    })
}

/// The index of a constraint of the model.
fn position_of<M: SimulationModel>(constraint: &Constraint) -> usize {
    M::CONSTRAINTS.iter().position(|known| known == constraint).expect("found in this very list")
}

fn rows_of(constraint: &Constraint, rows: &[f64]) -> Vec<f64> {
    rows[constraint.first..constraint.first + constraint.rows].to_vec()
}
