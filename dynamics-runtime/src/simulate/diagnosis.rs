//! What a failure comes from, where what the method met says less: a constraint with a corner, inertia that
//! vanishes, a singular position.

pub(crate) mod friction_breakdown;
pub(crate) mod gimbal_lock;
pub(crate) mod singular_position;

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::constrain::active_set::active_rows;
use crate::constrain::gradients::mass;
use crate::constrain::inertia::{LeastInertia, least_inertia, unit_inertias};
use crate::constrain::nearby::{self, at_time};
use crate::constrain::rank_margin::gradient_condition;
use crate::constrain::{Gradients, TopContributors, solve_once, with_workspace};
use crate::error::SolveError;
use crate::integrate::{Method, StepOptions, Tolerances};
use crate::linalg::max_abs;
use crate::model::{Constraints, Known, ModelState, Modes, Quantity, Vector};
use crate::simulate::failure::{CrossingSettings, JumpingQuantity, SimulationErrorKind as Kind};
use crate::simulate::options::formulation::Formulation;

/// The tolerance at which DOP853 goes over change points in whatever way they are met.
const PASSES: f64 = 1e-9;
/// The tightest one at which it does wherever that was tried.
const TIGHTEST: f64 = 1e-12;
/// Part of the least inertia at the start below which a motion has run into a place where it has none.
const VANISHED: f64 = 1e-5;
/// No motion comes here, in whatever unit; and what forces make of such values, as third powers of them and
/// more, is infinite soon after.
const BEYOND: f64 = 1e60;
/// Part of the time since the start that is looked back at most.
const BACK: f64 = 0.01;
/// By which accelerations become smaller each time, and how often, where they grow without bounds: those by
/// the inverse square root of a distance do by 2.
const SHRINKS: f64 = 1.5;
const IN_A_ROW: u32 = 5;
/// Conditioning of constraints from which on it, and not the inertia of what they leave, is looked at.
const WEAK: f64 = 1e5;

/// How a motion was made, for what is said where it cannot go on: would another way have gone on?
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunMethod {
    method: Method,
    tightest: f64,
    fixed: bool,
    /// Whether what drifts is put back onto the constraints.
    exact: bool,
}

impl RunMethod {
    pub(crate) fn of(method: Method, options: &StepOptions, formulation: Option<Formulation>) -> Self {
        let Tolerances { absolute, relative } = options.tolerances;
        let tightest = if relative > 0.0 { absolute.min(relative) } else { absolute };
        Self {
            method,
            tightest,
            fixed: options.fixed.is_some(),
            exact: formulation.is_none_or(Formulation::is_exact),
        }
    }

    /// How change points are gone over where this way did not: in long steps of an explicit method whose
    /// stages lie anywhere, as a tolerance that rounding does not count against permits them, and with
    /// constraints that have not drifted: they contradict each other where they should repeat each other.
    /// `None` where that is what was done.
    pub(crate) fn over(self) -> Option<CrossingSettings> {
        let explicit = matches!(self.method, Method::Dop853);
        let least = if explicit || self.fixed { PASSES } else { TIGHTEST };
        let tolerance = (self.tightest < least || self.fixed).then_some(least);
        let method = (!explicit).then_some(Method::Dop853);
        let formulation = (!self.exact).then_some(Formulation::Projected);
        let other = tolerance.is_some() || method.is_some() || formulation.is_some();
        other.then_some(CrossingSettings { method, tolerance, fixed: self.fixed, formulation })
    }
}

/// A failure with the cause that the state at which it happened shows.
///
/// `h`: the step that was tried or, where constraints have drifted, made last.
pub(crate) fn explain<M: Constraints>(
    model: &M,
    start: &M::State,
    state: &M::State,
    (kind, h): (Kind, f64),
    way: RunMethod,
) -> Kind {
    let creeps = matches!(kind, Kind::TooManySteps { .. } | Kind::StepsVanish { .. });
    if !(creeps || collapses(&kind)) {
        return kind;
    }
    if let Some((coordinate, order, value)) = beyond_numbers(model, state) {
        return Kind::Overflow {
            coordinate: M::COORDINATES[coordinate].name,
            order,
            value,
            cause: Box::new(kind),
        };
    }
    // A step that was not made shorter has the corner somewhere in it; the straight way is not quite its own.
    let reach = match kind {
        Kind::StepDisplaced { .. } | Kind::Drift { .. } => 2.0 * h,
        // It lies within what was missed.
        Kind::Solve(SolveError::OffConstraint { distance, .. }) => 10.0 * distance,
        _ => 0.0,
    };
    if let Some(RowDiscontinuity { row, what, jump, .. }) = corner(model, state, reach) {
        return Kind::ConstraintJumps { row: M::ROWS[row].name, what, jump, cause: Box::new(kind) };
    }
    let kind = gimbal_lock::explain(model, state, kind);
    if matches!(kind, Kind::GimbalLock { .. }) {
        return kind;
    }
    let unexplained = matches!(kind, Kind::TooManySteps { stiff_at: None, slides_at: None, .. });
    let collapsed =
        matches!(kind, Kind::StepSizeTooSmall { .. } | Kind::StepNotSolved { .. } | Kind::StepsVanish { .. });
    // Beside a singular position accelerations jump, too.
    let singular = || singular_position::explain(model, start, state, (kind.copy(), h), way);
    if (unexplained || collapsed)
        && let Some(cause) = friction_breakdown::explain(model, state, &kind)
        && core::mem::discriminant(&singular()) == core::mem::discriminant(&kind)
    {
        // Steps over a pole and back look like a jump.
        let pole =
            matches!(cause, Kind::RestsOnJump { .. }).then(|| unbounded(model, start, state)).flatten();
        return pole.unwrap_or(cause);
    }
    // A mass matrix that was found singular has named its coordinate.
    let says_so = matches!(kind, Kind::SingularMassMatrix(_));
    if !(creeps || says_so)
        && let Some((coordinates, share)) = vanished(model, start, state)
    {
        return Kind::InertiaVanishes { coordinates, share, cause: Box::new(kind) };
    }
    let kind = idle(model, state, singular_position::explain(model, start, state, (kind, h), way));
    match kind {
        Kind::StepSizeTooSmall { .. } => unbounded(model, start, state).unwrap_or(kind),
        kind => kind,
    }
}

/// The largest element of a state or its accelerations that is beyond all use: coordinate, order of the
/// derivative, value.
fn beyond_numbers<M: Constraints>(model: &M, state: &M::State) -> Option<(usize, u8, f64)> {
    let accelerations = accelerations(model, state).unwrap_or_else(M::Vector::zeros);
    let parts = [(0, state.q()), (1, state.u()), (2, &accelerations)];
    let all = parts
        .into_iter()
        .flat_map(|(order, part)| part.as_slice().iter().enumerate().map(move |(i, x)| (i, order, *x)));
    all.filter(|(_, _, x)| !x.is_nan())
        .max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
        .filter(|(_, _, x)| x.abs() > BEYOND)
}

fn accelerations<M: Constraints>(model: &M, state: &M::State) -> Option<M::Vector> {
    let constants = model.constants().ok()?;
    Some(solve_once(model, &constants, state).ok()?.accelerations)
}

/// Whether accelerations grow by a power of the distance on the straight way to a state, as by 1/r², and do
/// not jump there. Back along the way, in times four times as long each, they become smaller each time.
fn unbounded<M: Constraints>(model: &M, start: &M::State, state: &M::State) -> Option<Kind> {
    let here = accelerations(model, state)?;
    let at = state.t();
    let (mut last, mut in_a_row) = (max_abs(here.as_slice()), 0);
    let way = at - start.t();
    let mut by = (f64::EPSILON * at.abs().max(way.abs())).copysign(way);
    while by.abs() < BACK * way.abs() {
        let mut before = at_time(state, at - by);
        (0..M::Vector::LEN).for_each(|i| before.q_mut()[i] -= by * state.u()[i]);
        let size = max_abs(accelerations(model, &before)?.as_slice());
        in_a_row = if size * SHRINKS <= last { in_a_row + 1 } else { 0 };
        if in_a_row == IN_A_ROW {
            let coordinates =
                TopContributors::ranked(M::COORDINATES, here.as_slice().iter().copied().enumerate());
            return Some(Kind::StepsVanish {
                at,
                coordinates,
                rows: TopContributors::ranked(M::ROWS, core::iter::empty()),
            });
        }
        last = size;
        by *= 4.0;
    }
    None
}

/// A singular mass matrix with all coordinates that have no inertia at all, and the parameters that may be
/// why; as it is where that says no more.
pub(crate) fn idle<M: Constraints>(model: &M, state: &M::State, kind: Kind) -> Kind {
    match &kind {
        Kind::SingularMassMatrix(error) | Kind::Solve(SolveError::SingularMassMatrix(error))
            if !error.negative => {}
        _ => return kind,
    }
    let kind = gimbal_lock::explain(model, state, kind);
    let n = M::Vector::LEN;
    let rows = with_workspace::<M, _>(|workspace| {
        let mass = mass(model, state, workspace);
        let empty = |row: &[f64]| if row.iter().all(|x| *x == 0.0) { 1.0 } else { 0.0 };
        mass.chunks_exact(n).map(empty).collect::<Vec<f64>>()
    });
    // A unit that can be neither one of inertia nor of a lever is no reason; without units any parameter may
    // be. Levers are one where no inertia is 0.
    let inert =
        |unit: &str| unit.is_empty() || ["kg", "slug", "lb"].iter().any(|mass| unit.starts_with(mass));
    let lever = |unit: &str| matches!(unit, "m" | "ft");
    let zeros = |may: fn(&str) -> bool| {
        let zero = move |(i, named): (usize, &Quantity)| {
            (i, if model.parameter(i) == Some(0.0) && may(named.unit) { 1.0 } else { 0.0 })
        };
        TopContributors::ranked(M::PARAMETERS, M::PARAMETERS.iter().enumerate().map(zero))
    };
    let coordinates = TopContributors::ranked(M::COORDINATES, rows.iter().copied().enumerate());
    let parameters = Some(zeros(inert)).filter(|some| !some.is_empty()).unwrap_or_else(|| zeros(lever));
    let says_more = coordinates.count() > 1 || !(coordinates.is_empty() || parameters.is_empty());
    if !says_more || matches!(kind, Kind::GimbalLock { .. }) {
        return kind;
    }
    Kind::NoInertia { coordinates, parameters, cause: Box::new(kind) }
}

/// Whether a failure is one that looks the same whatever it comes from.
fn collapses(kind: &Kind) -> bool {
    match kind {
        Kind::StepSizeTooSmall { .. }
        | Kind::StepNotSolved { .. }
        | Kind::StepDisplaced { .. }
        | Kind::AccelerationNotFinite { .. }
        | Kind::SingularMassMatrix(_)
        | Kind::Drift { .. } => true,
        Kind::Solve(error) => matches!(
            error,
            SolveError::Contradiction { .. }
                | SolveError::OffConstraint { .. }
                | SolveError::VanishingGradient { .. }
                | SolveError::BranchUndetermined { .. }
                | SolveError::ConstraintNotFinite { .. }
        ),
        _ => false,
    }
}

/// The coordinates that have no inertia left on the motions that the constraints leave, and how much it is
/// against the start.
fn vanished<M: Constraints>(model: &M, start: &M::State, state: &M::State) -> Option<(TopContributors, f64)> {
    let scale = unit_inertias(model, start);
    let usual = least_inertia(model, start, &scale)?.least;
    let LeastInertia { least, coordinates } = least_inertia(model, state, &scale)?;
    let share = least / usual;
    (usual > 0.0 && share <= VANISHED && gradient_condition(model, state) < WEAK)
        .then_some((coordinates, share))
}

/// A row that is not differentiable on a way.
pub(crate) struct RowDiscontinuity {
    pub(crate) row: usize,
    pub(crate) what: JumpingQuantity,
    pub(crate) jump: f64,
    /// Where, just before it.
    pub(crate) at: f64,
}

/// How far ahead and back constraints are looked at, in parts of the time in which coordinates change by
/// their size.
const AROUND: f64 = 1e-7;
/// Halvings of that: what is smooth becomes 10⁻¹² of itself.
const HALVINGS: usize = 40;
/// Part of what the velocity of a row is made of from which on a jump is one.
const JUMPS: f64 = 1e-4;
/// The same of a jump of positions, far above what rounding leaves.
const ROUNDED: f64 = 1e-11;

/// The constraint that asks for a jump of positions or velocities where a motion stands, or within `reach` of
/// it on the straight way on and back.
fn corner<M: Constraints>(model: &M, state: &M::State, reach: f64) -> Option<RowDiscontinuity> {
    if M::IS_FREE {
        return None;
    }
    let pace = |(q, u): (&f64, &f64)| u.abs() / (1.0 + q.abs());
    let fastest = state.q().as_slice().iter().zip(state.u().as_slice()).map(pace).fold(1.0, f64::max);
    // Farther than by a part of their size, coordinates are elsewhere; and where time resolves no less than
    // that, nothing is known.
    let (least, most) = (1e3 * f64::EPSILON * state.t().abs(), 0.5 / fastest);
    if least > most {
        return None;
    }
    let reach = reach.abs().min(most).max(AROUND / fastest).max(least);
    let beside = |tau: f64| {
        let mut beside = at_time(state, state.t() + tau);
        (0..M::Vector::LEN).for_each(|i| beside.q_mut()[i] += tau * state.u()[i]);
        beside
    };
    // Where gradients vanish here, not all of them do there.
    let sizes = sizes(model, &[beside(-reach), beside(reach), nearby::nearby_state::<M>(state)]);
    corner_on(model, state.modes(), (-reach, reach), beside, &sizes, least)
}

/// The first constraint with a corner on the way of a step, θ from 0 to 1.
pub(crate) fn find_discontinuity_within<M: Constraints>(
    model: &M,
    way: impl Fn(f64) -> M::State,
) -> Option<RowDiscontinuity> {
    let middle = way(0.5);
    let sizes = sizes(model, &[way(0.0), way(1.0), nearby::nearby_state::<M>(&middle)]);
    let least = 1e3 * f64::EPSILON * middle.t().abs();
    corner_on(model, middle.modes(), (0.0, 1.0), way, &sizes, least)
}

/// A corner of a constraint on a way; `sizes`: see [`sizes`], `least`: the time that is resolved.
fn corner_on<M: Constraints>(
    model: &M,
    modes: Modes,
    (from, to): (f64, f64),
    way: impl Fn(f64) -> M::State,
    (rates, sizes): &(M::Rows, M::Rows),
    least: f64,
) -> Option<RowDiscontinuity> {
    for row in active_rows::<M>(modes, false) {
        if row < M::Residual::LEN
            && let Some((at, jump)) = jump(from, to, |tau| model.residual(&way(tau))[row])
            && jump.abs() > ROUNDED * sizes[row] + least * rates[row]
        {
            return Some(RowDiscontinuity { row, what: JumpingQuantity::Positions, jump, at });
        }
        if let Some((at, jump)) = jump(from, to, |tau| model.velocity_residual(&way(tau))[row])
            && jump.abs() > JUMPS * rates[row]
        {
            return Some(RowDiscontinuity { row, what: JumpingQuantity::Velocities, jump, at });
        }
    }
    None
}

/// What is left of the change of a function where the half of an interval in which it changes more is halved
/// again and again, and where that is: nothing, unless it jumps.
fn jump(from: f64, to: f64, f: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    let [mut from, mut to] = [from, to].map(|x| (x, f(x)));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (from.0 + to.0);
        let middle = (middle, f(middle));
        let first = (middle.1 - from.1).abs() > (to.1 - middle.1).abs();
        if first { to = middle } else { from = middle }
    }
    Some((from.0, to.1 - from.1)).filter(|(_, jump)| jump.is_finite())
}

/// What the velocity of each row is made of, Σⱼ |Φ_q,ᵢⱼ q̇ⱼ| + |Φ̇ᵢ|, and its position, Σⱼ |Φ_q,ᵢⱼ|
/// (1 + |qⱼ|): the most of what they are at some states.
fn sizes<M: Constraints>(model: &M, states: &[M::State]) -> (M::Rows, M::Rows) {
    let (mut rates, mut sizes) = (M::Rows::zeros(), M::Rows::zeros());
    for state in states {
        let (q, u, residual) = (state.q().as_slice(), state.u().as_slice(), model.velocity_residual(state));
        with_workspace::<M, _>(|workspace| {
            let gradients = Gradients::alone(model, state, workspace);
            for row in 0..M::Rows::LEN {
                let sum = |of: &[f64], more: f64| -> f64 {
                    gradients.row(row).iter().zip(of).map(|(x, of)| x.abs() * (more + of.abs())).sum()
                };
                rates[row] = rates[row].max(residual[row].abs() + sum(u, 0.0));
                sizes[row] = sizes[row].max(sum(q, 1.0));
            }
        });
    }
    (rates, sizes)
}
