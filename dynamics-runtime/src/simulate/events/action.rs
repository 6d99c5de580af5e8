//! What an event may do to a motion: change its state, hit, engage and release constraints.

use alloc::boxed::Box;
use alloc::vec::Vec;

use dynamics_view::suggest;

use crate::constrain::assemble::CONSISTENT;
use crate::error::SolveError;
use crate::integrate::StepOptions;
use crate::model::{Constraint, ConstraintKind, Known, ModelState, SimulationModel, Vector};
use crate::simulate::events::contact_corner;
use crate::simulate::failure::event_action::EventActionError;
use crate::simulate::stabilization::{PlaceError, Stabilization};

/// What a constraint took in an impact: a jump of the velocities, M Δu = Φ_qᵀΛ, with all constraints that act
/// in it together.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact {
    /// The constraint.
    pub constraint: &'static str,
    /// Whether it held before: it was not hit, but others were.
    pub held: bool,
    /// Φ̇ (or A q̇ + b) of its rows just before.
    pub approach: Vec<f64>,
    /// Λ of its rows: multiplier times time.
    pub impulse: Vec<f64>,
    /// Its share −½ Λᵀ Φ_q(q̇⁺ + q̇⁻) of the kinetic energy ½ q̇ᵀMq̇ before less that after; negative where a
    /// moving constraint strikes.
    pub energy_lost: f64,
}

/// Friction that changes accelerations by no more than this part of 1 + |q̈| decides nothing at the instant
/// at which its contact lifts off.
const NEGLIGIBLE: f64 = 1e-9;
/// Permitted errors by which a contact may be met late.
const MET: f64 = 100.0;
/// See [`MET`]: without a tolerance, and at most, in parts of the size of what the contact involves.
const FIXED: f64 = 1e-3;

/// The time before and after an instant, in parts of 1 + |t|, between which what changes has jumped.
const JUMP_INTERVAL: f64 = 1e-9;

/// How a constraint is struck.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Blow {
    /// By the law of its contact.
    Contact,
    /// With this coefficient of restitution.
    Rebound(f64),
    /// It stops, pushed or pulled, and holds.
    Hold,
}

impl From<PlaceError> for EventActionError {
    fn from(error: PlaceError) -> Self {
        match error {
            PlaceError::State(error) => Self::State(Box::new(error)),
            PlaceError::Solve(error) => Self::Solve(error),
        }
    }
}

impl From<SolveError> for EventActionError {
    fn from(error: SolveError) -> Self {
        Self::Solve(error)
    }
}

crate::error::sentence_for_debugging!(EventActionError);

/// What an action at an event works on: the state, and the constraints that can be hit, engaged and released.
///
/// What cannot be done (a name that is not known, a constraint engaged where it does not hold) ends the
/// simulation with an error at this event; the changes after it are not made.
pub struct EventAction<'c, M: SimulationModel> {
    model: &'c M,
    constants: &'c M::Constants,
    /// The state at the event, before the first action there.
    instant: M::State,
    state: &'c mut M::State,
    stabilization: &'c mut Stabilization<M>,
    /// What the steps are made to that end at the events; `None` where none do.
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

    /// At the end of steps of these options.
    pub(crate) fn after(self, options: &StepOptions) -> Self {
        Self { steps: Some(*options), ..self }
    }

    /// By which part of its size a constraint may be met late, where steps end at events.
    fn permitted(&mut self, constraint: &Constraint) -> f64 {
        let Some(StepOptions { fixed, tolerances, .. }) = self.steps else { return CONSISTENT };
        let size = self.stabilization.length(self.model, self.state, constraint);
        let adaptive = MET * (tolerances.relative + tolerances.absolute / size);
        if fixed.is_some() { FIXED } else { adaptive.clamp(CONSISTENT, FIXED) }
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

    /// The impacts so far: what was hit, and with it what held and took an impulse.
    pub fn impacts(&self) -> &[Impact] {
        &self.impacts
    }

    /// Whether a switched constraint holds.
    ///
    /// # Errors
    /// Where there is no constraint of this name, or it is not one that can be switched.
    pub fn holds(&self, name: &str) -> Result<bool, EventActionError> {
        self.switched(name).map(|(_, index)| self.state.modes().holds(index))
    }

    /// λ of a constraint at the state as it is now, by rows; 0 where it does not hold. Empty where there is
    /// none: that ends the simulation.
    pub fn reaction(&mut self, name: &str) -> Vec<f64> {
        self.attempt(|change| {
            let constraint = find::<M>(name)?;
            let solved = change.stabilization.reactions(change.model, change.constants, change.state)?;
            Ok(rows_of(constraint, solved.as_slice()))
        })
        .unwrap_or_default()
    }

    /// An impact on a constraint, switched or not, by Poisson's hypothesis: what its rows take while they are
    /// stopped they give back e times, with the coefficient of restitution e. Where nothing else is hit that
    /// is Newton's Φ̇⁺ = −e Φ̇⁻. A released holonomic constraint of one row pushes only, to where Φ is
    /// positive: hit while Φ grows it ends the simulation.
    ///
    /// Constraints that hold go on holding, except for contacts declared with
    /// [`contact`](crate::simulate::Simulation::contact): they do not pull here either, but part where the
    /// impact opens them, and those that are closed but released are hit along by their own law. See
    /// [`constrain::impact`](crate::constrain::impact).
    pub fn impact(&mut self, name: &str, restitution: f64) {
        self.attempt(|change| {
            let constraint = find::<M>(name)?;
            if let Some((row, residual)) = change.far(constraint, CONSISTENT) {
                return Err(EventActionError::ImpactApart { row, residual });
            }
            let pushes = constraint.kind == ConstraintKind::Holonomic && constraint.rows == 1;
            let free = constraint.switched.is_some_and(|switch| !change.state.modes().holds(switch));
            let least = CONSISTENT * change.stabilization.speed(change.model, change.state, constraint);
            if pushes && free && change.stabilization.slip(change.model, change.state, constraint) > least {
                let rate = change.model.velocity_residual(change.state)[constraint.first];
                return Err(EventActionError::ImpactAway { row: M::ROWS[constraint.first].name, rate });
            }
            change.strike(constraint, Blow::Rebound(restitution))
        });
    }

    /// A contact is met where its gap falls to zero, and closes; neither where that jumps nor in an edge.
    pub(crate) fn meet(&mut self, constraint: &'static Constraint) {
        self.attempt(|change| {
            if let Some((row, residual)) = change.far(constraint, CONSISTENT) {
                // Only in a corner a gap jumps: where it is another one on the other branch.
                if contact_corner::jumps(change.model, change.state, constraint.first, residual) {
                    return Err(EventActionError::ContactJumps { row, residual });
                }
                change.lift(constraint)?;
            }
            let later = change.beside(JUMP_INTERVAL);
            if M::HAS_KINKS
                && contact_corner::is_hit(
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

    /// What is met late, for where another one was met the step ended elsewhere, to within its tolerance, is
    /// put onto its ground.
    fn lift(&mut self, constraint: &'static Constraint) -> Result<(), EventActionError> {
        let permitted = self.permitted(constraint);
        if let Some((row, residual)) = self.far(constraint, permitted) {
            return Err(EventActionError::ContactMissed { row, residual });
        }
        let mut there = *self.state;
        constraint.switched.iter().for_each(|switch| there.modes_mut().engage(*switch));
        self.stabilization.lift(self.model, &mut there)?;
        *self.state.q_mut() = *there.q();
        Ok(())
    }

    /// A contact that closes rebounds or holds by its own law, together with those that touch at the same
    /// instant. One that is back although it moves away has rebounded too slowly for that to be seen: it has
    /// come to rest.
    pub(crate) fn close(&mut self, constraint: &'static Constraint) {
        self.attempt(|change| {
            let index = position_of::<M>(constraint);
            let rates = change.model.velocity_residual(change.state);
            let is_back = rates[constraint.first] > 0.0
                && (change.is_unresolved(constraint) && change.stabilization.rests_unresolved(index, &rates)
                    || change.stabilization.rests_unseen(index, &rates));
            change.strike(constraint, if is_back { Blow::Hold } else { Blow::Contact })
        });
    }

    /// Whether a contact moves away no faster than velocities are known to.
    fn is_unresolved(&mut self, constraint: &Constraint) -> bool {
        let steps = self.steps.filter(|steps| steps.fixed.is_none());
        let part = steps.map_or(CONSISTENT, |steps| steps.tolerances.relative);
        self.stabilization.slip(self.model, self.state, constraint).abs()
            <= part * self.stabilization.speed(self.model, self.state, constraint)
    }

    /// Whether what a released constraint of one row slips on jumps here, and its slip with it from this side
    /// to the other: nothing has come to rest there.
    pub(crate) fn leaps_from(&mut self, constraint: &'static Constraint, side: f64) -> bool {
        let mut slip = |part: f64| {
            let beside = self.beside(part);
            self.stabilization.slip(self.model, &beside, constraint)
        };
        let (before, after) = (slip(-JUMP_INTERVAL), slip(JUMP_INTERVAL));
        let least = CONSISTENT * self.stabilization.speed(self.model, self.state, constraint);
        (after - before).abs() > least && -side * after > least
    }

    /// The state a little later, or earlier, by a part of 1 + |t|. As a new one it holds no branches.
    fn beside(&self, part: f64) -> M::State {
        let (t, mut q, u) = (self.state.t(), *self.state.q(), *self.state.u());
        let by = part * (1.0 + t.abs());
        (0..M::Vector::LEN).for_each(|i| q[i] += by * u[i]);
        let mut beside = M::State::new(t + by, q, u, *self.state.inputs());
        *beside.modes_mut() = self.state.modes();
        beside
    }

    /// The side to which a constraint of one row that breaks away goes, where its reaction jumps here:
    /// against the one that comes. `None` where it does not.
    pub(crate) fn side_ahead(&mut self, constraint: &'static Constraint) -> Option<f64> {
        let ahead = self.beside(JUMP_INTERVAL);
        let mut reaction = |state: &M::State| {
            let solved = self.stabilization.reactions(self.model, self.constants, state).ok()?;
            Some(solved[constraint.first])
        };
        let (now, ahead) = (reaction(self.state)?, reaction(&ahead)?);
        // What comes continuously is what is here.
        ((ahead - now).abs() > 0.5 * ahead.abs()).then(|| -ahead.signum())
    }

    /// Lets a constraint hold whose slip has just fallen to zero: nothing jumps but for rounding, and that is
    /// no impact. Contacts that hold go on holding.
    pub(crate) fn catch(&mut self, name: &str) {
        self.attempt(|change| {
            let (constraint, index) = change.switched(name)?;
            change.check_place(constraint)?;
            if !change.state.modes().holds(index) {
                change.state.modes_mut().engage(index);
                change.stabilization.impact(
                    change.model,
                    change.state,
                    &[(position_of::<M>(constraint), 0.0)],
                )?;
            }
            Ok(())
        });
    }

    /// Lets a switched constraint hold from here on, after a plastic impact that stops its rows, pushing or
    /// pulling. Contacts take part as in [`EventAction::impact`].
    pub fn engage(&mut self, name: &str) {
        self.attempt(|change| {
            let (constraint, index) = change.switched(name)?;
            change.check_place(constraint)?;
            if !change.state.modes().holds(index) {
                change.strike(constraint, Blow::Hold)?;
            }
            Ok(())
        });
    }

    /// Releases a switched constraint that holds: a holonomic one to the side where Φ grows, a nonholonomic
    /// one of one row to the side from which its reaction held it back, against the sign of λ. Several rows,
    /// or λ = 0 where the side counts (friction by it acts), name no side: that ends the simulation, and
    /// [`EventAction::release_to`] is what to use.
    pub fn release(&mut self, name: &str) {
        self.attempt(|change| {
            let (constraint, index) = change.switched(name)?;
            if !change.state.modes().holds(index) {
                return Ok(());
            }
            let side = match constraint.kind {
                ConstraintKind::Holonomic => 1.0,
                ConstraintKind::Nonholonomic => {
                    let solved =
                        change.stabilization.reactions(change.model, change.constants, change.state)?;
                    match solved[constraint.first] {
                        reaction if constraint.rows == 1 && reaction.abs() > 0.0 => -reaction.signum(),
                        // Nothing held it, and nothing will brake it: either side is right.
                        _ if constraint.rows == 1
                            && !change.stabilization.side_counts(
                                change.model,
                                change.constants,
                                change.state,
                                index,
                                NEGLIGIBLE,
                            ) =>
                        {
                            1.0
                        }
                        _ => return Err(EventActionError::NoSide { constraint: constraint.name }),
                    }
                }
            };
            change.state.modes_mut().release(index, side);
            Ok(())
        });
    }

    /// Whether a constraint that holds has no reaction, and has accelerations that are the same for either
    /// side once it is released, but for what the place of an event leaves of them.
    pub(crate) fn slips_either_way(&mut self, constraint: &'static Constraint) -> bool {
        let (model, constants, first) = (self.model, self.constants, constraint.first);
        let either = |change: &mut Self| {
            let idle = change.stabilization.reactions(model, constants, change.state)?[first] == 0.0;
            let mut counts =
                |switch| change.stabilization.side_counts(model, constants, change.state, switch, NEGLIGIBLE);
            Ok(idle && constraint.switched.is_some_and(|switch| !counts(switch)))
        };
        self.attempt(either).unwrap_or(false)
    }

    /// Releases a switched constraint to a side: that of growing Φ (or A q̇ + b) where `side` is not
    /// negative.
    pub fn release_to(&mut self, name: &str, side: f64) {
        self.attempt(|change| {
            let (_, index) = change.switched(name)?;
            change.state.modes_mut().release(index, side);
            Ok(())
        });
    }

    /// Does nothing after the first error, and keeps it.
    fn attempt<R>(&mut self, act: impl FnOnce(&mut Self) -> Result<R, EventActionError>) -> Option<R> {
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

    /// One impact on a constraint and on all contacts that touch: none of those pulls, and those that end at
    /// rest hold.
    fn strike(&mut self, constraint: &'static Constraint, blow: Blow) -> Result<(), EventActionError> {
        if let Blow::Rebound(value) = blow
            && !(0.0..=1.0).contains(&value)
        {
            return Err(EventActionError::Restitution { value });
        }
        let index = position_of::<M>(constraint);
        let held = self.state.modes();
        let touching = self.stabilization.touching(self.model, self.state, held)?;
        let (start, before) = (*self.state, self.model.velocity_residual(self.state));
        let mut hits = Vec::with_capacity(touching.len() + 1);
        match blow {
            Blow::Rebound(restitution) => hits.push((index, restitution)),
            Blow::Hold => {
                constraint.switched.iter().for_each(|switch| self.state.modes_mut().engage(*switch));
                hits.push((index, 0.0));
            }
            Blow::Contact => hits.push((index, self.stabilization.restitution(index, &before))),
        }
        for contact in touching.iter().copied().filter(|contact| *contact != index) {
            let holds = M::CONSTRAINTS[contact].switched.is_none_or(|switch| held.holds(switch));
            hits.push((contact, if holds { 0.0 } else { self.stabilization.restitution(contact, &before) }));
        }
        let closing =
            |contact: usize| contact == index && blow == Blow::Contact || touching.contains(&contact);
        let contacts = hits
            .iter()
            .map(|hit| hit.0)
            .filter(|hit| closing(*hit) && !(*hit == index && blow == Blow::Hold));
        let contacts: Vec<(usize, usize)> =
            contacts.filter_map(|hit| Some((hit, M::CONSTRAINTS[hit].switched?))).collect();
        // Rocking comes to rest as bouncing does: where all are slow they hold, and nothing parts any more.
        let settles = blow == Blow::Contact
            && contacts
                .iter()
                .all(|(hit, switch)| held.holds(*switch) || self.stabilization.is_slow(*hit, &before));
        for (_, switch) in &contacts {
            match settles {
                true => self.state.modes_mut().engage(*switch),
                false => self.state.modes_mut().release(*switch, 1.0),
            }
        }
        let jump = self.stabilization.impact(self.model, self.state, &hits)?;
        // What was at rest takes its part of the impact of others, and has no speed but for the rounding of
        // that.
        let fastest = hits.iter().map(|hit| before[M::CONSTRAINTS[hit.0].first].abs()).fold(0.0, f64::max);
        for (contact, switch) in contacts {
            if self.rests(&start, M::CONSTRAINTS[contact].first, fastest) {
                self.state.modes_mut().engage(switch);
            }
        }
        self.record(&start, constraint, before.as_slice(), jump.impulses.as_slice());
        Ok(())
    }

    /// Whether a row is at rest after an impact, but for rounding; `fastest`: the largest rate of those that
    /// were hit with it.
    fn rests(&mut self, before: &M::State, row: usize, fastest: f64) -> bool {
        let rate = self.model.velocity_residual(self.state)[row];
        let gradients = self.stabilization.gradients(self.model, self.state);
        let speeds =
            before.u().as_slice().iter().zip(self.state.u().as_slice()).map(|(a, b)| a.abs().max(b.abs()));
        let largest =
            gradients.row(row).iter().zip(speeds).map(|(x, speed)| x.abs() * speed).fold(0.0, f64::max);
        rate.abs() <= 1e-10 * largest.max(fastest)
    }

    /// Records what was struck, and what else took an impulse with it.
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
                    && constraint.switched.is_none_or(|switch| start.modes().holds(switch)),
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

    /// A holonomic constraint can hold only where its Φ is 0.
    fn check_place(&mut self, constraint: &'static Constraint) -> Result<(), EventActionError> {
        match self.far(constraint, CONSISTENT) {
            Some((row, residual)) => Err(EventActionError::EngagedApart { row, residual }),
            None => Ok(()),
        }
    }

    /// The row of a released holonomic constraint that is missed most, and its Φ, if it is missed by more
    /// than this part of its size.
    fn far(&mut self, constraint: &'static Constraint, part: f64) -> Option<(&'static str, f64)> {
        let holds = constraint.switched.is_none_or(|switch| self.state.modes().holds(switch));
        match constraint.kind {
            ConstraintKind::Holonomic if !holds => {
                self.stabilization.apart(self.model, self.state, constraint, part)
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
