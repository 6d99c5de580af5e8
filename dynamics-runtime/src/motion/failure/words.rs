//! What failures of simulations say.

use alloc::string::String;
use core::fmt;

use crate::error::SolveError;
use crate::motion::failure::{Jumping, Over, SimulationErrorKind};
use crate::wording::Rounded;

impl fmt::Display for SimulationErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Option(error) => error.fmt(f),
            Self::SingularMassMatrix(error) => error.fmt(f),
            Self::Solve(error) => error.fmt(f),
            Self::AccelerationNotFinite { coordinate } => {
                write!(
                    f,
                    "the acceleration of `{coordinate}` is not finite; keep the motion away from where a \
                     force or a length has no finite value, or, if it does not come there, tighten the \
                     tolerance"
                )
            }
            Self::InputNotFinite { input } => {
                write!(f, "the inputs closure gave no finite value for `{input}`")
            }
            Self::StepSizeTooSmall { coordinate } => write!(
                f,
                "the step size collapsed, the error of `{coordinate}` stays above the tolerance: the motion \
                 has a singularity or a jump here; loosen the tolerance (tighten it where it is above 1e-3: \
                 the motion may have been lost before), or make the jump an event"
            ),
            Self::StepNotSolved { coordinate } => write!(
                f,
                "the equations of an implicit step do not converge, least of all for `{coordinate}`; make a \
                 fixed step shorter, smooth a force that jumps or make the jump an event"
            ),
            Self::StepDisplaced { coordinate } => write!(
                f,
                "putting the end of this step back onto the constraints, or what its stages disagree by, \
                 would move it, `{coordinate}` most, by a large part of the way that it had come; make the \
                 fixed step shorter, or give a tolerance instead"
            ),
            Self::TooManySteps { limit, slides_at: Some(t), .. } => write!(
                f,
                "it takes more than {limit} steps: from t = {} on the motion slides along a jump of its \
                 accelerations, which lead to it from both sides; let what sticks there be a switched \
                 constraint, or smooth the jump",
                Rounded(*t)
            ),
            Self::TooManySteps { limit, gain: Some(gain), .. } => write!(
                f,
                "more than {limit} steps; gains of {gain:e} take drift back within {:.0e}, which may keep \
                 steps short: lower the gains of `Formulation::Baumgarte`, choose `Formulation::Projected`, \
                 which has none, or raise `.max_steps(..)`",
                1.0 / gain
            ),
            Self::TooManySteps { limit, stiff_at: None, .. } => {
                write!(f, "more than {limit} steps; raise `.max_steps(..)` or loosen the tolerance")
            }
            Self::TooManySteps { limit, stiff_at: Some(t), .. } => write!(
                f,
                "more than {limit} steps; the problem is stiff at t = {}: stability, not accuracy, \
                 bounds the step of this explicit method; use methods::Radau5",
                Rounded(*t)
            ),
            Self::Cancelled => write!(f, "cancelled"),
            Self::EventNotANumber { event } => write!(f, "the function of event `{event}` is not a number"),
            Self::EventUnresolved { event } => write!(
                f,
                "the function of event `{event}` changes too fast to be followed through a step; limit steps \
                 with `.max_step(..)`, or give the event a smoother function"
            ),
            Self::StepsVanish { at, coordinates, rows } => {
                write!(
                    f,
                    "steps become ever shorter and do not reach t = {}, where accelerations grow without \
                     bounds, of {coordinates} most",
                    Rounded(*at)
                )?;
                if !rows.is_empty() {
                    write!(f, ", held by {rows}")?;
                }
                f.write_str(
                    "; a length or distance that vanishes does this, as d - x in a force by 1/(d - \
                    x)^2: keep it above 0, as by a stop, or end the motion before, by an event or \
                    `.until(..)`",
                )
            }
            Self::EventsAccumulate { event, at, squeezed: true } => write!(
                f,
                "event `{event}` happens in ever shorter time and ever faster, without end before about t = \
                 {}: what lies between contacts that approach each other is squeezed; let what moves stop \
                 before, make a contact compliant, or end the motion before",
                Rounded(*at)
            ),
            Self::EventsAccumulate { event, at, .. } => {
                let else_stop = "let its action return `Flow::Stop` once the speed is small, and go on from \
                    there without it";
                let way_out = guard_way_out(event).unwrap_or_else(|| else_stop.into());
                let at = Rounded(*at);
                write!(
                    f,
                    "event `{event}` happens in ever shorter time and accumulates at about t = {at}; \
                    {way_out}"
                )
            }
            Self::EventRepeats { event } => match guard_way_out(event) {
                Some(way_out) => write!(f, "event `{event}` happens again at once, without end; {way_out}"),
                None => write!(
                    f,
                    "the reset at event `{event}` leaves the motion at rest where it happens again at once; \
                     end the simulation there with `Flow::Stop`, or give the reset a speed that leads away"
                ),
            },
            Self::EventAction { event, error } => write!(f, "at event `{event}`: {error}"),
            Self::Start(error) => write!(f, "the start is not on the constraints: {error}"),
            Self::Drift { what, row, residual, distance, limit } => write!(
                f,
                "constraint `{row}` has drifted in its {what} to {residual:e}, a distance of {distance:e} \
                 where {limit:e} is the limit; choose `Formulation::Projected`, tighten the tolerance, or \
                 raise `.drift_limit(..)`"
            ),
            Self::Overflow { coordinate, order, value, .. } => write!(
                f,
                "the motion grows beyond all numbers: {}`{coordinate}` is {value:.1e}; end it before, or \
                 look for what feeds it, as a force or a damper of the wrong sign, or a start or a parameter \
                 that is far off",
                ["", "the velocity of ", "the acceleration of "][usize::from(*order).min(2)]
            ),
            Self::SingularPosition { rows, coordinates, condition, met } => {
                write!(
                    f,
                    "singular position: {} here, which leaves {coordinates} open (conditioning \
                     {condition:.1e}), so that the motion cannot be continued; ",
                    rows.rank_loss()
                )?;
                if let Some(over) = &met.over {
                    write!(f, "{over}; if the mechanism cannot move on here, ")?;
                }
                f.write_str(
                    "change dimensions or start so that it is passed at a distance, or end the motion \
                     before. The method met: ",
                )?;
                match &met.kind {
                    // Here no contradiction is what it comes from.
                    Self::Solve(SolveError::OffConstraint { what, row, residual, distance }) => write!(
                        f,
                        "no {what} on the constraints were found near the end of a step: `{row}` is still \
                         missed by {residual:e} (a distance of {distance:e})"
                    ),
                    kind => kind.fmt(f),
                }
            }
            Self::InertiaVanishes { coordinates, share, .. } => write!(
                f,
                "the mass matrix becomes singular on the motions that are left: nothing that moves with \
                 {coordinates} has inertia here ({share:.1e} of the least at the start), and velocities grow \
                 without bounds; give it a positive mass, or end the motion before"
            ),
            Self::RestsOnJump { coordinates, cause } => write!(
                f,
                "the motion comes to rest on a jump of its accelerations, of {coordinates}, which lead to it \
                 from both sides, as friction does; let what sticks there be a switched constraint, or \
                 smooth the jump. The method met: {cause}"
            ),
            Self::RestsInCorner { row, leads_away: true } => write!(
                f,
                "the motion starts at rest in a corner of constraint `{row}`, from which accelerations lead \
                 away on both sides: to which it goes is open; start beside it, or smooth it"
            ),
            Self::RestsInCorner { row, .. } => write!(
                f,
                "the motion starts at rest in a corner of constraint `{row}`, to which accelerations lead \
                 back from both sides: what holds it there lies between the gradients of the two; smooth it, \
                 or let each side be a `(switched)` constraint, with a `.contact(..)` of its own where it is \
                 one of the ground"
            ),
            Self::FrictionGrows { row, ahead, cause } => write!(
                f,
                "the reaction of `{row}` and friction by it grow without bounds: {ahead:.1e} ahead the \
                 equations with friction have no answer (Painlevé's paradox), and the rigid model ends here; \
                 make the contact compliant, or end the motion before. The method met: {cause}"
            ),
            Self::GimbalLock { at, cause } => {
                let [first, _, last] = at.names;
                write!(
                    f,
                    "gimbal lock: {}, where `{first}` and `{last}` turn about one axis; use Euler parameters \
                     (`#[coordinates(e: [_; 4])]`, `EulerParameters::new(q.e).rotation()` and its \
                     `norm_constraint()` under `#[holonomic]`), change charts (`ChartSwitching`), or take a set whose \
                     middle angle stays away from its singular values, such as {}. The method met: {cause}",
                    at.describe(),
                    at.other_set()
                )
            }
            Self::NoInertia { coordinates, parameters, .. } => {
                let have = if coordinates.count() == 1 { "has" } else { "have" };
                write!(
                    f,
                    "the mass matrix is singular: {coordinates} {have} no inertia at this state; give what \
                     moves with "
                )?;
                f.write_str(if coordinates.count() == 1 {
                    "it a positive mass"
                } else {
                    "them a positive mass"
                })?;
                if matches!(parameters.unit(), "m" | "ft") {
                    f.write_str(", and a lever that is not 0")?;
                }
                match parameters.count() {
                    0 => Ok(()),
                    1 => write!(f, " (parameter {parameters} is 0)"),
                    _ => write!(f, " (parameters {parameters} are 0)"),
                }
            }
            Self::ConstraintJumps { row, what: Jumping::Velocities, jump, .. } => write!(
                f,
                "constraint `{row}` has a corner here: what it asks of the velocities jumps by {jump:.3e}, \
                 which takes an impact and no force; smooth it, or let each side be a `(switched)` \
                 constraint, the one released and the other engaged by `.on_event_with(..)` at the corner, \
                 or, on the ground, each with a `.contact(..)` of its own; what friction holds slips there \
                 by `.stick_slip(..)`"
            ),
            Self::ConstraintJumps { row, what: Jumping::Positions, jump, .. } if is_turn(*jump) => write!(
                f,
                "constraint `{row}` has a gap here: its residual jumps by {jump:.3e}, a turn, as an angle by \
                 `atan2` does; write it without the angle: `y.atan2(x) - a` is zero where `y * a.cos() - x * \
                 a.sin()` is"
            ),
            Self::ConstraintJumps { row, what: Jumping::Positions, jump, .. } => write!(
                f,
                "constraint `{row}` has a gap here: its residual jumps by {jump:.3e}, and no motion leads \
                 across; make it continuous"
            ),
            Self::ContactJumps { row, gap } => write!(
                f,
                "the gap of contact `{row}` jumps to {gap:.3e} here, below zero: the body meets a step from \
                 the side, and how that is hit the gap does not say; declare the face of the step as a \
                 `(switched)` constraint with a `.contact(..)` of its own"
            ),
            Self::SingularStart { rows, coordinates } => write!(
                f,
                "the start is a singular position: {} there, which leaves {coordinates} open, so that \
                 accelerations are not determined; start beside it, or with velocities along a branch",
                rows.rank_loss()
            ),
            Self::BranchUndetermined { rows, coordinates, condition } => write!(
                f,
                "singular position: {} here, which leaves {coordinates} open (conditioning {condition:.1e}); \
                 on which branch the mechanism goes on, if on any, what its constraints have drifted would \
                 decide; choose `Formulation::Projected`",
                rows.rank_loss()
            ),
            Self::BranchesTouch { rows, at, changed } => write!(
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
            ),
            Self::SlipsBack { constraint, slip, at, sticks: true, .. } => write!(
                f,
                "constraint `{constraint}` is released and comes to rest, or is at rest, where its friction \
                 holds it: it sticks, and friction by its side would drive it ({slip:e} at t = {}); let it \
                 stick and break away with `.stick_slip(\"{constraint}\", ..)`, or engage it by an event \
                 where its slip is zero",
                Rounded(*at)
            ),
            Self::SlipsBack { constraint, side, slip, at, .. } => write!(
                f,
                "constraint `{constraint}` is released to the side of {} values and begins to slip to the \
                 other ({slip:e} at t = {}), where its friction would drive it; let it stick and break away \
                 with `.stick_slip(\"{constraint}\", ..)`, or engage it by an event where its slip is zero, \
                 or release it with `release_to(\"{constraint}\", {})` where it slips that way",
                if *side < 0.0 { "falling" } else { "growing" },
                Rounded(*at),
                -side
            ),
            Self::Penetration { row, residual } => write!(
                f,
                "contact `{row}` is open on the wrong side, its residual is {residual:e}; place it where the \
                 residual is 0 or positive"
            ),
            Self::BadReset { event, name: "t" } => {
                write!(
                    f,
                    "the reset at event `{event}` moved time; change coordinates, velocities or inputs only"
                )
            }
            Self::BadReset { event, name } => {
                write!(f, "the reset at event `{event}` left `{name}` not finite")
            }
        }
    }
}

impl fmt::Display for Over {
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

/// What helps where the event of a contact or of stick and slip is without end; `None` for other events.
fn guard_way_out(event: &str) -> Option<String> {
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

/// Whether a jump is one of an angle, by whole turns.
fn is_turn(jump: f64) -> bool {
    let turns = jump.abs() / core::f64::consts::TAU;
    let part = turns % 1.0;
    (0.5..100.0).contains(&turns) && part.min(1.0 - part) < 1e-6
}
