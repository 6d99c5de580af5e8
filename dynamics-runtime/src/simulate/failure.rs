//! Errors of simulations and motions, as data. Their texts are in `messages.rs`.

pub(crate) mod event_action;
pub(crate) mod gimbal_lock;
pub(crate) mod messages;
pub(crate) mod motion_error;
pub(crate) mod option;

pub use crate::simulate::failure::motion_error::MotionError;
pub use crate::simulate::failure::option::OptionError;

use alloc::boxed::Box;
use alloc::string::String;

use crate::constrain::TopContributors;
use crate::error::{SingularMassMatrix, SolveError, StateError};
use crate::integrate::Method;
use crate::simulate::failure::event_action::EventActionError;
use crate::simulate::failure::gimbal_lock::GimbalLock;
use crate::simulate::options::formulation::Formulation;

/// The kinds of failure, with the values needed to act.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationErrorKind {
    /// An option makes no sense; nothing was computed.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The mass matrix has no inverse.
    #[error(transparent)]
    SingularMassMatrix(SingularMassMatrix),
    /// Constraints and forces have no common solution.
    #[error(transparent)]
    Solve(SolveError),
    /// An acceleration is infinite or not a number, however short the step.
    #[error(
        "the acceleration of `{coordinate}` is not finite; keep the motion away from where a force or a \
         length has no finite value, or, if it does not come there, tighten the tolerance"
    )]
    AccelerationNotFinite {
        /// The coordinate.
        coordinate: &'static str,
    },
    /// The inputs closure returned an infinite value or not a number.
    #[error("the inputs closure gave no finite value for `{input}`")]
    InputNotFinite {
        /// The input.
        input: &'static str,
    },
    /// The tolerance asks for steps below the resolution of time: the motion has a singularity or a jump
    /// here.
    #[error(
        "the step size collapsed, the error of `{coordinate}` stays above the tolerance: a value or a force \
         becomes infinite here, or something jumps, or the tolerance is below the rounding of this method; \
         end the motion before, make the jump an event, or loosen the tolerance (tighten it where it is \
         above 1e-3: the motion may have been lost before)"
    )]
    StepSizeTooSmall {
        /// The coordinate with the largest error.
        coordinate: &'static str,
    },
    /// The equations of an implicit method have no solution that its iterations find, however short the step;
    /// with a fixed step, at that step.
    #[error(
        "the equations of an implicit step do not converge, least of all for `{coordinate}`; make a fixed \
         step shorter, smooth a force that jumps or make the jump an event"
    )]
    StepNotSolved {
        /// The coordinate that is corrected most.
        coordinate: &'static str,
    },
    /// The constraints would have moved the end of a fixed step by more than a fiftieth of the way that the
    /// step had come, or its stages beside a singular position disagreed by as much, in whatever parts it was
    /// made: they would decide the motion.
    #[error(
        "putting the end of this step back onto the constraints, or what its stages disagree by, would move \
         it, `{coordinate}` most, by a large part of the way that it had come; make the fixed step shorter, \
         or give a tolerance instead"
    )]
    StepDisplaced {
        /// The coordinate that would have been moved most.
        coordinate: &'static str,
    },
    /// More steps, rejected ones included, than `.max_steps(..)` permits; or, where the motion slides, it
    /// would take twice as many as are left.
    #[error(fmt = messages::too_many_steps)]
    TooManySteps {
        /// The limit.
        limit: u64,
        /// When the problem was found stiff, if it was.
        stiff_at: Option<f64>,
        /// When the motion was found to slide along a place where accelerations jump, if it was.
        slides_at: Option<f64>,
        /// The larger gain of Baumgarte's stabilization, where it was found to bound the steps.
        gain: Option<f64>,
    },
    /// The flag given to `.cancel(..)` was raised, or the function given to `.cancel_when(..)` returned true.
    #[error("cancelled")]
    Cancelled,
    /// An event function is not a number.
    #[error("the function of event `{event}` is not a number")]
    EventNotANumber {
        /// The event.
        event: String,
    },
    /// An event function changes faster than it can be followed within a step.
    #[error(
        "the function of event `{event}` changes too fast to be followed through a step; limit steps with \
         `.max_step(..)`, or give the event a smoother function"
    )]
    EventUnresolved {
        /// The event.
        event: String,
    },
    /// An event happens again and again in ever shorter time (Zeno's paradox: a ball that comes to rest by
    /// bouncing).
    #[error(fmt = messages::events_accumulate)]
    EventsAccumulate {
        /// The event.
        event: String,
        /// The time that they approach.
        at: f64,
        /// A contact is hit ever faster: what lies between contacts that approach each other is squeezed.
        squeezed: bool,
    },
    /// Steps become shorter and shorter and come to no end before the time that they approach: accelerations
    /// grow without bounds there.
    #[error(fmt = messages::steps_vanish)]
    StepsVanish {
        /// That time: extrapolated, or that of the last state.
        at: f64,
        /// The coordinates that accelerate most at the last state.
        coordinates: TopContributors,
        /// The rows of the constraints that hold them with most; of nobody where nothing holds.
        rows: TopContributors,
    },
    /// The reset of an event left the motion at rest there, and it goes on in the same direction: the event
    /// happens again at once.
    #[error(fmt = messages::event_repeats)]
    EventRepeats {
        /// The event.
        event: String,
    },
    /// What an action at an event wanted to do to constraints is not possible.
    #[error("at event `{event}`: {error}")]
    EventAction {
        /// The event.
        event: String,
        /// Why.
        error: Box<EventActionError>,
    },
    /// The start does not fulfil the constraints.
    #[error("the start is not on the constraints: {0}")]
    Start(Box<StateError>),
    /// A constraint has drifted further than `.drift_limit(..)` permits.
    #[error(
        "constraint `{row}` has drifted in its {what} to {residual:e}, a distance of {distance:e} where \
         {limit:e} is the limit; choose `Formulation::Projected`, tighten the tolerance, or raise \
         `.drift_limit(..)`"
    )]
    Drift {
        /// `positions` or `velocities`.
        what: &'static str,
        /// Its row, `closure.x`.
        row: &'static str,
        /// Φ there; Φ̇ or A q̇ + b where velocities have drifted.
        residual: f64,
        /// |residual|/‖Φ_q‖, or /‖A‖.
        distance: f64,
        /// The largest distance permitted there.
        limit: f64,
    },
    /// The motion grows without bounds, to where sums and products of its values are beyond all numbers.
    #[error(
        "the motion grows beyond all numbers: {}`{coordinate}` is {value:.1e}; end it before, or look for \
         what feeds it, as a force or a damper of the wrong sign, or a start or a parameter that is far off",
        ["", "the velocity of ", "the acceleration of "][usize::from(*.order).min(2)]
    )]
    Overflow {
        /// The coordinate that is the largest, or whose velocity or acceleration is.
        coordinate: &'static str,
        /// Of which derivative by time the value is: 0 of the coordinate, 1 of its velocity, 2 of its
        /// acceleration.
        order: u8,
        /// Its value.
        value: f64,
        /// What the method met.
        cause: Box<SimulationErrorKind>,
    },
    /// The motion cannot go on from here, and constraints lose rank here or just ahead: a singular position.
    #[error(fmt = messages::singular_position)]
    SingularPosition {
        /// The rows that depend on each other there.
        rows: TopContributors,
        /// The coordinates that they leave open there.
        coordinates: TopContributors,
        /// Largest over smallest singular value of Φ_q at the last state.
        condition: f64,
        /// The failure of the method, and settings that may pass the position.
        cause: Box<SingularPositionCause>,
    },
    /// The motion has run into a place where the mass matrix is singular, or loses its sign, on the motions
    /// that constraints leave: what has no inertia moves without bounds.
    #[error(
        "the mass matrix becomes singular on the motions that are left: nothing that moves with \
         {coordinates} has inertia here ({share:.1e} of the least at the start), and velocities grow without \
         bounds; give it a positive mass, or end the motion before"
    )]
    InertiaVanishes {
        /// The coordinates that have no inertia left together.
        coordinates: TopContributors,
        /// The least inertia at the last state, over the least at the start; negative beyond the place.
        share: f64,
        /// What the method met.
        cause: Box<SimulationErrorKind>,
    },
    /// Friction, or another force that jumps, has brought the motion to rest: the accelerations on either
    /// side of the jump lead back to it.
    #[error(
        "the motion comes to rest on a jump of its accelerations, of {coordinates}, which lead to it from \
         both sides, as friction does; let what sticks there be a switched constraint, or smooth the jump. \
         The method met: {cause}"
    )]
    RestsOnJump {
        /// The coordinates whose accelerations jump, in the order of by how much.
        coordinates: TopContributors,
        /// What the method met.
        cause: Box<SimulationErrorKind>,
    },
    /// The motion starts at rest in a corner of a constraint, and accelerations do not say to which side it
    /// goes.
    #[error(fmt = messages::rests_in_corner)]
    RestsInCorner {
        /// The row.
        row: &'static str,
        /// They lead away from it on both sides; otherwise back to it from both.
        leads_away: bool,
    },
    /// A reaction grows without bounds toward a place just ahead, from which on the equations with friction
    /// have no answer (Painlevé's paradox).
    #[error(
        "the reaction of `{row}` and friction by it grow without bounds: {ahead:.1e} ahead the equations \
         with friction have no answer (Painlevé's paradox), and the rigid model ends here; make the contact \
         compliant, or end the motion before. The method met: {cause}"
    )]
    FrictionGrows {
        /// The reaction that decides there, `floor`.
        row: &'static str,
        /// The time that velocities as they are take to get there.
        ahead: f64,
        /// What the method met.
        cause: Box<SimulationErrorKind>,
    },
    /// Three angles lock: what they turn has orientations beside this one that they cannot tell apart, and
    /// rates and accelerations without bounds.
    #[error(fmt = messages::gimbal_lock)]
    GimbalLock {
        /// The angles, and how near they are to locking.
        at: Box<GimbalLock>,
        /// What the method met.
        cause: Box<SimulationErrorKind>,
    },
    /// Coordinates have no inertia at all, and what holds them does not decide how they accelerate.
    #[error(fmt = messages::no_inertia)]
    NoInertia {
        /// The coordinates.
        coordinates: TopContributors,
        /// Parameters that are 0 and may be the inertia that is missing: those of a unit of mass, or of no
        /// known unit; where there is none, lengths, for masses without a lever turn nothing.
        parameters: TopContributors,
        /// What the method met.
        cause: Box<SimulationErrorKind>,
    },
    /// A constraint is not differentiable just where the motion stands, and asks for a jump that no force can
    /// make.
    #[error(fmt = messages::constraint_jumps)]
    ConstraintJumps {
        /// Its row.
        row: &'static str,
        /// Of what.
        what: JumpingQuantity,
        /// By how much what the row asks for changes there: its Φ̇ (or A q̇ + b) at the velocity of the
        /// motion, or its Φ.
        jump: f64,
        /// What the method met.
        cause: Box<SimulationErrorKind>,
    },
    /// The gap of a contact jumps to below zero: the body has met a step from the side, and the function of
    /// the contact does not say how.
    #[error(
        "the gap of contact `{row}` jumps to {gap:.3e} here, below zero: the body meets a step from the \
         side, and how that is hit the gap does not say; declare the face of the step as a `(switched)` \
         constraint with a `.contact(..)` of its own"
    )]
    ContactJumps {
        /// Its row.
        row: &'static str,
        /// Φ just behind.
        gap: f64,
    },
    /// The start is a singular position, and what is given does not determine how the motion goes on.
    #[error(
        "the start is a singular position: {} there, which leaves {coordinates} open, so that accelerations \
         are not determined; start beside it, or with velocities along a branch",
        .rows.rank_loss()
    )]
    SingularStart {
        /// The rows that depend on each other there.
        rows: TopContributors,
        /// The coordinates that they leave open there.
        coordinates: TopContributors,
    },
    /// A motion whose constraints drift is so near to a singular position, where branches of the mechanism
    /// meet, that its drift decides on which of them it goes on.
    #[error(
        "singular position: {} here, which leaves {coordinates} open (conditioning {condition:.1e}); on \
         which branch the mechanism goes on, if on any, what its constraints have drifted would decide; \
         choose `Formulation::Projected`",
        .rows.rank_loss()
    )]
    BranchUndetermined {
        /// The rows that depend on each other there.
        rows: TopContributors,
        /// The coordinates in which the branches differ.
        coordinates: TopContributors,
        /// Largest over smallest singular value of Φ_q.
        condition: f64,
    },
    /// Branches of constraints have a tangent in common on the way of the motion, as y² = x⁴ where x = 0.
    /// The motion has gone on along another branch than its own, or that is not decided. Up to there it is
    /// right.
    #[error(fmt = messages::branches_touch)]
    BranchesTouch {
        /// The row whose gradient vanishes there, or the rows that depend on each other.
        rows: TopContributors,
        /// When.
        at: f64,
        /// It is known that steps went over to another branch.
        changed: bool,
    },
    /// A released constraint begins to slip against the side to which it was released, and its friction,
    /// which goes by that side, would drive it.
    #[error(fmt = messages::slips_back)]
    SlipsBack {
        /// The constraint.
        constraint: &'static str,
        /// The side to which it is released, ±1.
        side: f64,
        /// A q̇ + b a little later.
        slip: f64,
        /// When that is.
        at: f64,
        /// Friction would bring it back from the other side as well: it sticks, and no side of its is right.
        sticks: bool,
    },
    /// A contact is open on the side where it is not free.
    #[error(
        "contact `{row}` is open on the wrong side, its residual is {residual:e}; place it where the \
         residual is 0 or positive"
    )]
    Penetration {
        /// The row of the contact.
        row: &'static str,
        /// Φ < 0 there.
        residual: f64,
    },
    /// The reset of an event left a value that is infinite or not a number, or moved time.
    #[error(fmt = messages::bad_reset)]
    BadReset {
        /// The event.
        event: String,
        /// The coordinate, velocity or input; `t` where time was moved.
        name: &'static str,
    },
}

/// The failure of a method at a singular position, and settings that may pass it.
#[derive(Clone, Debug, PartialEq)]
pub struct SingularPositionCause {
    /// Why it did not go on.
    pub kind: SimulationErrorKind,
    /// Settings that pass the position, if the mechanism can move on there; `None` where the run had them.
    pub crossing: Option<CrossingSettings>,
}

/// Settings that pass singular positions at which a mechanism can move on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossingSettings {
    /// Another method.
    pub method: Option<Method>,
    /// A tolerance that is looser than what was asked for, or one instead of a fixed step.
    pub tolerance: Option<f64>,
    /// The tolerance is given in place of a fixed step.
    pub fixed: bool,
    /// Another formulation: one that leaves no drift, by which the rows contradict each other there.
    pub formulation: Option<Formulation>,
}

/// The quantity that a constraint requires to jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JumpingQuantity {
    /// Positions: Φ has a gap there.
    Positions,
    /// Velocities: Φ has a corner there, or A or b a gap.
    Velocities,
}

impl SimulationErrorKind {
    /// A clone by code that is compiled once; derived code is inlined.
    #[inline(never)]
    pub(crate) fn copy(&self) -> Self {
        self.clone()
    }
}

impl From<SolveError> for SimulationErrorKind {
    fn from(error: SolveError) -> Self {
        match error {
            SolveError::SingularMassMatrix(error) => Self::SingularMassMatrix(error),
            error => Self::Solve(error),
        }
    }
}
