//! The sides of released constraints that no rule follows.
//!
//! A released nonholonomic constraint of one row says to which side it slips, and friction by that side
//! brakes. Where the slip turns round and nobody says so (no
//! [`stick_slip`](crate::simulate::Simulation::stick_slip), no event that engages it) the same friction
//! drives: work out of nothing. Such a motion ends where it turns. Only where the side counts: what has
//! accelerations that are the same for either side slips as it likes.
//!
//! Every step is looked at where it ends and at places between, by the quintic through its ends; what that
//! finds is confirmed by the method's own interpolant.

use crate::integrate::{Dense, Hermite, Step, Tolerances};
use crate::model::{Constraint, ConstraintKind, ModelState, Modes, SimulationModel};
use crate::simulate::events::unilateral::UnilateralConstraint;
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::stabilization::Stabilization;

/// A released constraint without a rule, with its index among the switched ones.
pub(crate) type SlipDirection = (&'static Constraint, usize);

/// Where a constraint was found to slip against its side.
pub(crate) struct SlipReversal {
    pub(crate) constraint: &'static Constraint,
    /// The side by which it goes on rubbing.
    pub(crate) side: f64,
    /// A q̇ + b where that was found.
    pub(crate) slip: f64,
    /// Where the slip passes zero, in parts of the step.
    pub(crate) theta: f64,
    /// When it was found to slip against its side.
    pub(crate) at: f64,
    /// The other side would turn it round as well.
    pub(crate) sticks: bool,
}

/// Places within a step at which it is looked at.
const PLACES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// Halvings of the interval in which a slip turns round.
const HALVINGS: usize = 48;

/// The released nonholonomic constraints of one row that no unilateral constraint follows.
pub(crate) fn unfollowed<'g, M: SimulationModel>(
    modes: Modes,
    unilaterals: impl Iterator<Item = &'g UnilateralConstraint> + Clone,
) -> impl Iterator<Item = SlipDirection> {
    let slips = |c: &&Constraint| c.kind == ConstraintKind::Nonholonomic && c.rows == 1;
    let released =
        move |c: &'static Constraint| Some((c, c.switched.filter(|switch| !modes.holds(*switch))?));
    let followed = move |c: &Constraint| unilaterals.clone().any(|unilateral| unilateral.constraint == c);
    M::CONSTRAINTS.iter().filter(slips).filter_map(released).filter(move |(c, _)| !followed(c))
}

/// What slipped before a change and slips after it slips to the side of its velocity, to which the change may
/// have turned it; not where the change itself said the side.
pub(crate) fn turn<M: SimulationModel>(
    model: &M,
    stabilization: &mut Stabilization<M>,
    (constraint, switch): SlipDirection,
    before: Modes,
    state: &mut M::State,
) {
    if before.side(switch) == state.modes().side(switch)
        && let Some(side) = stabilization.slip_side(model, state, constraint)
    {
        state.modes_mut().release(switch, side);
    }
}

/// Whether a constraint slips against its side in a step, by the quintic through the ends of the step, and
/// the side counts there: at which place.
pub(crate) fn suspect<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    step: &Step<M::Vector>,
    slipping: SlipDirection,
) -> Option<usize> {
    let Step { start, end, h, .. } = step;
    let between = Hermite::between(start, end, *h);
    (0..PLACES.len()).find(|place| {
        let theta = PLACES[*place];
        let y = if theta < 1.0 { between.at(theta) } else { end.y };
        let state = rhs.state(start.t + theta * h, &y.q, &y.u);
        against(rhs, &state, slipping).is_some() && counts(rhs, &state, slipping.1)
    })
}

/// Where a constraint that is suspected to slip against its side at a place turns round, if the interpolant
/// of the step says so too.
pub(crate) fn turned<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    step: &Step<M::Vector>,
    dense: &dyn Dense<M::Vector>,
    tolerances: &Tolerances,
    slipping: SlipDirection,
    place: usize,
) -> Option<SlipReversal> {
    let (constraint, switch) = slipping;
    let side = rhs.modes.side(switch);
    let found = rhs.within(dense, step, tolerances, PLACES[place]);
    let slip = against(rhs, &found, slipping)?;
    let (mut low, mut high) = (place.checked_sub(1).map_or(0.0, |before| PLACES[before]), PLACES[place]);
    for _ in 0..HALVINGS {
        let theta = 0.5 * (low + high);
        let state = rhs.within(dense, step, tolerances, theta);
        let agrees = rhs.model.velocity_residual(&state)[constraint.first] * side > 0.0;
        *(if agrees { &mut low } else { &mut high }) = theta;
    }
    let at_zero = rhs.within(dense, step, tolerances, low);
    let rate = slip / (found.t() - at_zero.t());
    let RightHandSide { model, constants, stabilization, .. } = rhs;
    // Released to the other side, it would be driven to this one.
    let sticks = stabilization
        .change_of_side(model, constants, &at_zero, slipping)
        .is_some_and(|change| side * (rate + change) > 0.0);
    Some(SlipReversal { constraint, side, slip, theta: low, at: found.t(), sticks })
}

/// The slip of a constraint that slips against its side, by more than a start may.
fn against<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    state: &M::State,
    (constraint, switch): SlipDirection,
) -> Option<f64> {
    let (slip, side) = (rhs.model.velocity_residual(state)[constraint.first], state.modes().side(switch));
    if slip * side >= 0.0 {
        return None;
    }
    rhs.stabilization.slip_side(rhs.model, state, constraint).map(|_| slip)
}

/// Whether accelerations depend on the side to which a constraint was released.
fn counts<M: SimulationModel>(rhs: &mut RightHandSide<'_, '_, M>, state: &M::State, switch: usize) -> bool {
    let RightHandSide { model, constants, stabilization, .. } = rhs;
    stabilization.side_counts(model, constants, state, switch, 0.0)
}
