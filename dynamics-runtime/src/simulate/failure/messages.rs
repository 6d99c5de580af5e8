//! Texts of simulation errors.

use alloc::string::String;
use core::fmt;

use crate::constrain::TopContributors;
use crate::declaration::UnitDimension;
use crate::error::SolveError;
use crate::simulate::failure::gimbal_lock::GimbalLock;
use crate::simulate::failure::{
    CrossingSettings, JumpingQuantity, SimulationErrorKind, SingularPositionCause,
};
use crate::wording::Rounded;

pub(super) fn too_many_steps(
    limit: &u64,
    stiff_at: &Option<f64>,
    slides_at: &Option<f64>,
    gain: &Option<f64>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    match (stiff_at, slides_at, gain) {
        (_, Some(t), _) => write!(
            f,
            "it takes more than {limit} steps: from t = {} on the motion slides along a jump of its \
             accelerations, which lead to it from both sides; let what sticks there be a switched \
             constraint, or smooth the jump",
            Rounded(*t)
        ),
        (_, _, Some(gain)) => write!(
            f,
            "more than {limit} steps; gains of {gain:e} take drift back within {:.0e}, which may keep \
             steps short: lower the gains of `Formulation::Baumgarte`, choose `Formulation::Projected`, \
             which has none, or raise `.max_steps(..)`",
            1.0 / gain
        ),
        (None, _, _) => write!(f, "more than {limit} steps; raise `.max_steps(..)` or loosen the tolerance"),
        (Some(t), _, _) => write!(
            f,
            "more than {limit} steps; the problem is stiff at t = {}: stability, not accuracy, \
             bounds the step of this explicit method; use methods::Radau5",
            Rounded(*t)
        ),
    }
}

pub(super) fn events_accumulate(
    event: &str,
    at: &f64,
    squeezed: &bool,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    match squeezed {
        true => write!(
            f,
            "event `{event}` happens in ever shorter time and ever faster, without end before about t = \
             {}: what lies between contacts that approach each other is squeezed; let what moves stop \
             before, make a contact compliant, or end the motion before",
            Rounded(*at)
        ),
        _ => {
            let else_stop = "let its action return `Flow::Stop` once the speed is small, and go on from \
                             there without it";
            let remedy = remedy_for_unilateral(event).unwrap_or_else(|| else_stop.into());
            let at = Rounded(*at);
            write!(
                f,
                "event `{event}` happens in ever shorter time and accumulates at about t = {at}; \
                 {remedy}"
            )
        }
    }
}

pub(super) fn steps_vanish(
    at: &f64,
    coordinates: &TopContributors,
    rows: &TopContributors,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(
        f,
        "steps become ever shorter and do not reach t = {}, where accelerations grow without bounds",
        Rounded(*at)
    )?;
    if !coordinates.is_empty() {
        write!(f, ", of {coordinates} most")?;
    }
    if !rows.is_empty() {
        write!(f, ", held by {rows}")?;
    }
    f.write_str(
        "; a length or distance that vanishes does this, as d - x in a force by 1/(d - \
         x)^2: keep it above 0, as by a stop, or end the motion before, by an event or \
         `.until(..)`",
    )
}

pub(super) fn event_repeats(event: &str, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match remedy_for_unilateral(event) {
        Some(remedy) => write!(f, "event `{event}` happens again at once, without end; {remedy}"),
        None => write!(
            f,
            "the reset at event `{event}` leaves the motion at rest where it happens again at once; \
             end the simulation there with `Flow::Stop`, or give the reset a speed that leads away"
        ),
    }
}

pub(super) fn singular_position(
    rows: &TopContributors,
    coordinates: &TopContributors,
    condition: &f64,
    cause: &SingularPositionCause,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(
        f,
        "singular position: {} here, which leaves {coordinates} open (conditioning \
         {condition:.1e}), so that the motion cannot be continued; ",
        rows.rank_loss()
    )?;
    if let Some(crossing) = &cause.crossing {
        write!(f, "{crossing}; if the mechanism cannot move on here, ")?;
    }
    f.write_str(
        "change dimensions or start so that it is passed at a distance, or end the motion \
         before. The method met: ",
    )?;
    match &cause.kind {
        // Here no contradiction is what it comes from.
        SimulationErrorKind::Solve(SolveError::OffConstraint { what, row, residual, distance }) => write!(
            f,
            "no {what} on the constraints were found near the end of a step: `{row}` is still \
             missed by {residual:e} (a distance of {distance:e})"
        ),
        kind => fmt::Display::fmt(kind, f),
    }
}

pub(super) fn rests_in_corner(row: &str, leads_away: &bool, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match leads_away {
        true => write!(
            f,
            "the motion starts at rest in a corner of constraint `{row}`, from which accelerations lead \
             away on both sides: to which it goes is open; start beside it, or smooth it"
        ),
        _ => write!(
            f,
            "the motion starts at rest in a corner of constraint `{row}`, to which accelerations lead \
             back from both sides: what holds it there lies between the gradients of the two; smooth it, \
             or let each side be a `(switched)` constraint, with a `.contact(..)` of its own where it is \
             one of the ground"
        ),
    }
}

pub(super) fn gimbal_lock(
    at: &GimbalLock,
    cause: &SimulationErrorKind,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    let [first, _, last] = at.names;
    write!(
        f,
        "gimbal lock: {}, where `{first}` and `{last}` turn about one axis; use Euler parameters \
         (`#[coordinates(e: [_; 4])]`, `EulerParameters::new(q.e).rotation()` and its \
         `norm_constraint()` under `#[holonomic]`), change charts (`ChartSwitching`), or take a set whose \
         middle angle stays away from its singular values, such as {}. The method met: {cause}",
        at.describe(),
        at.alternative_set()
    )
}

pub(super) fn no_inertia(
    coordinates: &TopContributors,
    parameters: &TopContributors,
    _cause: &SimulationErrorKind,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    let have = if coordinates.count() == 1 { "has" } else { "have" };
    write!(
        f,
        "the mass matrix is singular: {coordinates} {have} no inertia at this state; give what \
         moves with "
    )?;
    f.write_str(if coordinates.count() == 1 { "it a positive mass" } else { "them a positive mass" })?;
    if parameters.dimension() == UnitDimension::LENGTH {
        f.write_str(", and a lever that is not 0")?;
    }
    match parameters.count() {
        0 => Ok(()),
        1 => write!(f, " (parameter {parameters} is 0)"),
        _ => write!(f, " (parameters {parameters} are 0)"),
    }
}

pub(super) fn constraint_jumps(
    row: &str,
    what: &JumpingQuantity,
    jump: &f64,
    _cause: &SimulationErrorKind,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    match what {
        JumpingQuantity::Velocities => write!(
            f,
            "constraint `{row}` has a corner here: what it asks of the velocities jumps by {jump:.3e}, \
             which takes an impact and no force; smooth it, or let each side be a `(switched)` \
             constraint, the one released and the other engaged by `.on_event_with(..)` at the corner, \
             or, on the ground, each with a `.contact(..)` of its own; what friction holds slips there \
             by `.stick_slip(..)`"
        ),
        JumpingQuantity::Positions if is_turn(*jump) => write!(
            f,
            "constraint `{row}` has a gap here: its residual jumps by {jump:.3e}, a turn, as an angle by \
             `atan2` does; write it without the angle: `y.atan2(x) - a` is zero where `y * a.cos() - x * \
             a.sin()` is"
        ),
        JumpingQuantity::Positions => write!(
            f,
            "constraint `{row}` has a gap here: its residual jumps by {jump:.3e}, and no motion leads \
             across; make it continuous"
        ),
    }
}

pub(super) fn branches_touch(
    rows: &TopContributors,
    at: &f64,
    changed: &bool,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(
        f,
        "branches of {} {rows} touch at t = {}, where {}: {}; declare the branch that is meant by \
         itself (`y - x.powi(2)` in place of `y.powi(2) - x.powi(4)`), choose a tolerance of 1e-6 to \
         1e-9, whose steps may go over the place, or end the motion before",
        if rows.count() == 1 { "constraint" } else { "constraints" },
        Rounded(*at),
        if rows.count() == 1 { "its gradient vanishes" } else { "they depend on each other" },
        match changed {
            true =>
                "they have a tangent in common, and steps beside it ended on another branch than \
                 that of the motion",
            false => {
                "on which of them the motion goes on, if on any, is not decided (one that only \
                 becomes short, to 1e-5 of what it was, may look the same: divide the row by its \
                 size)"
            }
        }
    )
}

pub(super) fn slips_back(
    constraint: &str,
    side: &f64,
    slip: &f64,
    at: &f64,
    sticks: &bool,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    match sticks {
        true => write!(
            f,
            "constraint `{constraint}` is released and comes to rest, or is at rest, where its friction \
             holds it: it sticks, and friction by its side would drive it ({slip:e} at t = {}); let it \
             stick and break away with `.stick_slip(\"{constraint}\", ..)`, or engage it by an event \
             where its slip is zero",
            Rounded(*at)
        ),
        _ => write!(
            f,
            "constraint `{constraint}` is released to the side of {} values and begins to slip to the \
             other ({slip:e} at t = {}), where its friction would drive it; let it stick and break away \
             with `.stick_slip(\"{constraint}\", ..)`, or engage it by an event where its slip is zero, \
             or release it with `release_to(\"{constraint}\", {})` where it slips that way",
            if *side < 0.0 { "falling" } else { "growing" },
            Rounded(*at),
            -side
        ),
    }
}

pub(super) fn bad_reset(event: &str, name: &str, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match name {
        "t" => write!(
            f,
            "the reset at event `{event}` moved time; change coordinates, velocities or inputs only"
        ),
        name => write!(f, "the reset at event `{event}` left `{name}` not finite"),
    }
}

impl fmt::Display for CrossingSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let instead = if self.fixed { " in place of the fixed step" } else { "" };
        match (self.method, self.tolerance) {
            (Some(method), None) => write!(f, "use methods::{method:?}")?,
            (Some(method), Some(tolerance)) => {
                write!(f, "use methods::{method:?} with a tolerance of {tolerance:e}{instead}")?
            }
            (None, Some(tolerance)) if self.fixed => write!(f, "give a tolerance of {tolerance:e}{instead}")?,
            (None, Some(tolerance)) => write!(f, "loosen the tolerance to {tolerance:e}")?,
            (None, None) => {}
        }
        if let Some(other) = self.formulation {
            let and = if self.method.is_some() || self.tolerance.is_some() { " and " } else { "" };
            write!(f, "{and}choose `Formulation::{other:?}`")?;
        }
        f.write_str(if self.method.is_some() {
            ", whose steps go over such positions"
        } else {
            ", so that steps go over such positions"
        })
    }
}

/// The remedy where the event of a contact or of stick and slip repeats without end; `None` for other events.
/// Such events are named after their constraint: `floor contact`, `belt slip`.
fn remedy_for_unilateral(event: &str) -> Option<String> {
    match event.rsplit_once(' ')? {
        (name, "contact") => Some(alloc::format!(
            "give `.contact(\"{name}\", ..)` a larger `rest_speed`, below which it closes instead of \
             rebounding"
        )),
        (_, "slip") => {
            let text = "it neither sticks nor slips: let it break away at no less than the friction with \
                        which it slips";
            Some(text.into())
        }
        _ => None,
    }
}

/// Whether a jump is that of an angle, by whole turns.
fn is_turn(jump: f64) -> bool {
    let turns = jump.abs() / core::f64::consts::TAU;
    let part = turns % 1.0;
    (0.5..100.0).contains(&turns) && part.min(1.0 - part) < 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::declaration::Quantity;

    /// Accelerations at the last state may be zero, infinite or not a number.
    #[test]
    fn steps_that_vanish_have_no_empty_names() {
        const OF: [Quantity; 2] = [Quantity::without_unit("x"), Quantity::without_unit("y")];
        let named = |shares: [f64; 2]| TopContributors::ranked(&OF, shares.into_iter().enumerate());
        for (accelerations, forces, said) in [
            ([1.0, 0.0], [0.0, 2.0], "without bounds, of `x` most, held by `y`; "),
            ([f64::INFINITY, 3.0], [f64::NAN, 0.0], "without bounds, of `x` most; "),
            ([0.0, 0.0], [1.0, 0.0], "without bounds, held by `x`; "),
            ([f64::NAN, f64::NAN], [0.0, 0.0], "without bounds; "),
        ] {
            let (coordinates, rows) = (named(accelerations), named(forces));
            let text = SimulationErrorKind::StepsVanish { at: 1.5, coordinates, rows }.to_string();
            assert!(text.contains(said), "{text}");
        }
    }
}
