//! Slip direction: released friction constraints for which no rule follows the direction of the slip.
//!
//! A released nonholonomic constraint of one row has a side, the sign of A q̇ + b, by which friction brakes.
//! If the slip reverses and nothing updates the side (no
//! [`stick_slip`](crate::simulate::Simulation::stick_slip), no event that engages it), friction drives the
//! motion and does positive work. The motion then ends at the reversal. It does not end where the
//! accelerations are the same for both sides.
//!
//! Each step is checked at its end and at parts of it, on the quintic through its ends. A suspected reversal
//! is confirmed on the method's interpolant. The monitor is `run/monitors/slip_reversal.rs`. The side of
//! constraints with a rule is set in `unilateral.rs`, and that of starts and after actions in [`align_side`].

use crate::integrate::{Dense, Hermite, Step, Tolerances};
use crate::model::{ActiveSet, Constraint, ConstraintKind, ModelState, SimulationModel};
use crate::simulate::events::unilateral::UnilateralConstraint;
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::stabilization::Stabilization;

/// A released constraint without a rule, with its index among the switched ones.
pub(crate) type SlipDirection = (&'static Constraint, usize);

/// A constraint that slips against its side.
pub(crate) struct SlipReversal {
    pub(crate) constraint: &'static Constraint,
    /// The side by which friction acts.
    pub(crate) side: f64,
    /// A q̇ + b at the time `at`.
    pub(crate) slip: f64,
    /// Part of the step at which the slip passes zero.
    pub(crate) theta: f64,
    /// Time at which it was found to slip against its side.
    pub(crate) at: f64,
    /// Whether the slip would reverse on the other side, too: the constraint sticks.
    pub(crate) sticks: bool,
}

/// Parts of a step at which the slip is checked. A reversal that ends before the next part is not seen.
const PROBED_PARTS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// Bisections of the part of a step in which a slip reverses: to 2⁻⁵⁰ of the step, which is rounding.
const REVERSAL_BISECTIONS: usize = 48;

/// The released nonholonomic constraints of one row that have no stick–slip rule.
pub(crate) fn without_rule<'g, M: SimulationModel>(
    active_set: ActiveSet,
    unilaterals: impl Iterator<Item = &'g UnilateralConstraint> + Clone,
) -> impl Iterator<Item = SlipDirection> {
    let slips = |c: &&Constraint| c.kind == ConstraintKind::Nonholonomic && c.rows == 1;
    let released =
        move |c: &'static Constraint| Some((c, c.switched.filter(|switch| !active_set.holds(*switch))?));
    let has_rule = move |c: &Constraint| unilaterals.clone().any(|unilateral| unilateral.constraint == c);
    M::CONSTRAINTS.iter().filter(slips).filter_map(released).filter(move |(c, _)| !has_rule(c))
}

/// After an action, sets the side of a constraint that slipped before and slips still to the sign of its
/// velocity, unless the action itself chose the side.
pub(crate) fn align_side<M: SimulationModel>(
    model: &M,
    stabilization: &mut Stabilization<M>,
    (constraint, switch): SlipDirection,
    before: ActiveSet,
    state: &mut M::State,
) {
    if before.side(switch) == state.active_set().side(switch)
        && let Some(side) = stabilization.slip_side(model, state, constraint)
    {
        state.active_set_mut().release(switch, side);
    }
}

/// The first of [`PROBED_PARTS`], by index, at which a constraint slips against its side and the side
/// matters, on the quintic through the ends of the step.
pub(crate) fn find_suspect<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    step: &Step<M::Vector>,
    slipping: SlipDirection,
) -> Option<usize> {
    let Step { start, end, h, .. } = step;
    let between = Hermite::between(start, end, *h);
    (0..PROBED_PARTS.len()).find(|part| {
        let theta = PROBED_PARTS[*part];
        let y = if theta < 1.0 { between.at(theta) } else { end.y };
        let state = rhs.state(start.t + theta * h, &y.q, &y.u);
        slip_against_side(rhs, &state, slipping).is_some() && side_matters(rhs, &state, slipping.1)
    })
}

/// The reversal of a suspected constraint before a part of the step, if the interpolant of the step confirms
/// it.
pub(crate) fn locate_reversal<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    step: &Step<M::Vector>,
    dense: &dyn Dense<M::Vector>,
    tolerances: &Tolerances,
    slipping: SlipDirection,
    part: usize,
) -> Option<SlipReversal> {
    let (constraint, switch) = slipping;
    let side = rhs.active_set.side(switch);
    let found = rhs.state_within(dense, step, tolerances, PROBED_PARTS[part]);
    let slip = slip_against_side(rhs, &found, slipping)?;
    let (mut low, mut high) =
        (part.checked_sub(1).map_or(0.0, |before| PROBED_PARTS[before]), PROBED_PARTS[part]);
    for _ in 0..REVERSAL_BISECTIONS {
        let theta = 0.5 * (low + high);
        let state = rhs.state_within(dense, step, tolerances, theta);
        let agrees = rhs.model.velocity_residual(&state)[constraint.first] * side > 0.0;
        *(if agrees { &mut low } else { &mut high }) = theta;
    }
    let at_zero = rhs.state_within(dense, step, tolerances, low);
    let rate = slip / (found.t() - at_zero.t());
    let RightHandSide { model, constants, stabilization, .. } = rhs;
    // It sticks if, released to the other side, it would be driven back to this one.
    let sticks = stabilization
        .slip_rate_change_on_other_side(model, constants, &at_zero, slipping)
        .is_some_and(|change| side * (rate + change) > 0.0);
    Some(SlipReversal { constraint, side, slip, theta: low, at: found.t(), sticks })
}

/// The slip of a constraint that slips against its side by more than a start may violate it.
fn slip_against_side<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    state: &M::State,
    (constraint, switch): SlipDirection,
) -> Option<f64> {
    let (slip, side) =
        (rhs.model.velocity_residual(state)[constraint.first], state.active_set().side(switch));
    if slip * side >= 0.0 {
        return None;
    }
    rhs.stabilization.slip_side(rhs.model, state, constraint).map(|_| slip)
}

/// Whether accelerations depend on the side to which a constraint was released.
fn side_matters<M: SimulationModel>(
    rhs: &mut RightHandSide<'_, '_, M>,
    state: &M::State,
    switch: usize,
) -> bool {
    let RightHandSide { model, constants, stabilization, .. } = rhs;
    stabilization.side_matters(model, constants, state, switch, 0.0)
}
