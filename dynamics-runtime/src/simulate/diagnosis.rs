//! Failure diagnosis: the mechanical cause of a failure, where the integrator reports only its symptom.
//!
//! A step size that collapses, a mass matrix that is singular, constraints that drift may have one of several
//! causes: a constraint with a corner or a gap, gimbal lock, friction, inertia that vanishes, a singular
//! position, accelerations that grow without bounds. [`explain`] tests them in this order at the state of the
//! failure, and returns the first that applies. The tests look along the straight path of the last velocity,
//! so that a cause further away is not seen.

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
use crate::declaration::UnitDimension;
use crate::error::SolveError;
use crate::integrate::{Method, StepOptions, Tolerances};
use crate::linalg::max_abs;
use crate::model::{ActiveSet, Constraints, ModelState, Quantity, StaticTraits, Vector};
use crate::simulate::failure::{CrossingSettings, JumpingQuantity, SimulationErrorKind as Kind};
use crate::simulate::options::formulation::Formulation;

/// Tolerance at which DOP853 passes change points from every approach that was tried.
const CROSSING_TOLERANCE: f64 = 1e-9;
/// Tightest tolerance at which it passed all of those that were tried.
const TIGHTEST_CROSSING_TOLERANCE: f64 = 1e-12;
/// Inertia counts as vanished where the least one is below this part of that at the start.
const VANISHED_INERTIA_SHARE: f64 = 1e-5;
/// Values beyond this are an overflow: no motion reaches them in any unit, and forces with third or higher
/// powers of such values overflow soon after.
const OVERFLOW_SIZE: f64 = 1e60;
/// Longest look back along the path, in parts of the time since the start.
const LOOK_BACK_SHARE: f64 = 0.01;
/// Accelerations grow without bounds where they decrease by this factor at least, so many times in a row,
/// each time at four times the distance. Those that grow as the inverse square root of the distance decrease
/// by 2.
const DECAY_PER_LOOK: f64 = 1.5;
const DECAYS_IN_A_ROW: u32 = 5;
/// Condition number of the constraints from which on a singular position is the cause, and not vanished
/// inertia. A smaller value attributes vanished inertia to constraints that are only badly conditioned; a
/// larger one names inertia where the position is the cause.
const CAUSE_CONDITION: f64 = 1e5;

/// How a run was made. The error of a singular position names other settings that pass it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunMethod {
    method: Method,
    tightest_tolerance: f64,
    has_fixed_step: bool,
    /// Whether the formulation projects drift back onto the constraints.
    is_exact: bool,
}

impl RunMethod {
    pub(crate) fn of(method: Method, options: &StepOptions, formulation: Option<Formulation>) -> Self {
        let Tolerances { absolute, relative } = options.tolerances;
        let tightest_tolerance = if relative > 0.0 { absolute.min(relative) } else { absolute };
        Self {
            method,
            tightest_tolerance,
            has_fixed_step: options.fixed.is_some(),
            is_exact: formulation.is_none_or(Formulation::is_exact),
        }
    }

    /// Settings that pass change points where these did not: long steps of an explicit method whose stages
    /// need not end at the change point, a tolerance above rounding, and constraints without drift, which
    /// would contradict each other where they repeat each other. `None` where these settings are those of the
    /// run.
    pub(crate) fn crossing_settings(self) -> Option<CrossingSettings> {
        let is_dop853 = matches!(self.method, Method::Dop853);
        let least =
            if is_dop853 || self.has_fixed_step { CROSSING_TOLERANCE } else { TIGHTEST_CROSSING_TOLERANCE };
        let tolerance = (self.tightest_tolerance < least || self.has_fixed_step).then_some(least);
        let method = (!is_dop853).then_some(Method::Dop853);
        let formulation = (!self.is_exact).then_some(Formulation::Projected);
        let other = tolerance.is_some() || method.is_some() || formulation.is_some();
        other.then_some(CrossingSettings { method, tolerance, fixed: self.has_fixed_step, formulation })
    }
}

/// A failure with its mechanical cause, as far as the state shows one.
///
/// `h`: the step that was tried, or the last one where constraints have drifted.
pub(crate) fn explain<M: Constraints>(
    model: &M,
    start: &M::State,
    state: &M::State,
    (kind, h): (Kind, f64),
    run_method: RunMethod,
) -> Kind {
    let has_many_steps = matches!(kind, Kind::TooManySteps { .. } | Kind::StepsVanish { .. });
    if !(has_many_steps || is_unspecific(&kind)) {
        return kind;
    }
    if let Some((coordinate, order, value)) = largest_overflow(model, state) {
        return Kind::Overflow {
            coordinate: M::COORDINATES[coordinate].name,
            order,
            value,
            cause: Box::new(kind),
        };
    }
    // Corners of constraints. A step of fixed length has the corner somewhere in it, and its path is not
    // quite straight.
    let reach = match kind {
        Kind::StepDisplaced { .. } | Kind::Drift { .. } => 2.0 * h,
        // The corner lies within the distance that the projection missed.
        Kind::Solve(SolveError::OffConstraint { distance, .. }) => 10.0 * distance,
        _ => 0.0,
    };
    if let Some(RowDiscontinuity { row, what, jump, .. }) = find_discontinuity(model, state, reach) {
        return Kind::ConstraintJumps { row: M::ROWS[row].name, what, jump, cause: Box::new(kind) };
    }
    // Gimbal lock.
    let kind = gimbal_lock::explain(model, state, kind);
    if matches!(kind, Kind::GimbalLock { .. }) {
        return kind;
    }
    // Friction.
    let unexplained = matches!(kind, Kind::TooManySteps { stiff_at: None, slides_at: None, .. });
    let step_collapsed =
        matches!(kind, Kind::StepSizeTooSmall { .. } | Kind::StepNotSolved { .. } | Kind::StepsVanish { .. });
    // Near a singular position accelerations jump, too.
    let singular = || singular_position::explain(model, start, state, (kind.copy(), h), run_method);
    if (unexplained || step_collapsed)
        && let Some(cause) = friction_breakdown::explain(model, state, &kind)
        && core::mem::discriminant(&singular()) == core::mem::discriminant(&kind)
    {
        // Steps across a pole and back look like a jump.
        let pole = matches!(cause, Kind::RestsOnJump { .. })
            .then(|| growth_to_infinity(model, start, state))
            .flatten();
        return pole.unwrap_or(cause);
    }
    // Inertia that vanishes. A singular mass matrix has already named its coordinate.
    let names_coordinate = matches!(kind, Kind::SingularMassMatrix(_));
    if !(has_many_steps || names_coordinate)
        && let Some((coordinates, share)) = vanished_inertia(model, start, state)
    {
        return Kind::InertiaVanishes { coordinates, share, cause: Box::new(kind) };
    }
    // Singular positions, and accelerations that grow without bounds.
    let kind = explain_singular_mass_matrix(
        model,
        state,
        singular_position::explain(model, start, state, (kind, h), run_method),
    );
    match kind {
        Kind::StepSizeTooSmall { .. } => growth_to_infinity(model, start, state).unwrap_or(kind),
        kind => kind,
    }
}

/// The largest element of a state or its accelerations above [`OVERFLOW_SIZE`]: coordinate, order of the
/// derivative, value.
fn largest_overflow<M: Constraints>(model: &M, state: &M::State) -> Option<(usize, u8, f64)> {
    let accelerations = accelerations(model, state).unwrap_or_else(M::Vector::zeros);
    let parts = [(0, state.q()), (1, state.u()), (2, &accelerations)];
    let elements = parts
        .into_iter()
        .flat_map(|(order, part)| part.as_slice().iter().enumerate().map(move |(i, x)| (i, order, *x)));
    elements
        .filter(|(_, _, x)| !x.is_nan())
        .max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
        .filter(|(_, _, x)| x.abs() > OVERFLOW_SIZE)
}

fn accelerations<M: Constraints>(model: &M, state: &M::State) -> Option<M::Vector> {
    let constants = model.constants().ok()?;
    Some(solve_once(model, &constants, state).ok()?.accelerations)
}

/// Accelerations that grow as a power of the distance on the straight path to a state, as 1/r² does, and do
/// not jump. Back along the path, at distances four times as long each, they decrease every time.
fn growth_to_infinity<M: Constraints>(model: &M, start: &M::State, state: &M::State) -> Option<Kind> {
    let accelerations_here = accelerations(model, state)?;
    let at = state.t();
    let (mut last_size, mut in_a_row) = (max_abs(accelerations_here.as_slice()), 0);
    let span = at - start.t();
    let mut distance = (f64::EPSILON * at.abs().max(span.abs())).copysign(span);
    while distance.abs() < LOOK_BACK_SHARE * span.abs() {
        let mut earlier = at_time(state, at - distance);
        (0..M::Vector::LEN).for_each(|i| earlier.q_mut()[i] -= distance * state.u()[i]);
        let size = max_abs(accelerations(model, &earlier)?.as_slice());
        in_a_row = if size * DECAY_PER_LOOK <= last_size { in_a_row + 1 } else { 0 };
        if in_a_row == DECAYS_IN_A_ROW {
            let coordinates = TopContributors::ranked(
                M::COORDINATES,
                accelerations_here.as_slice().iter().copied().enumerate(),
            );
            return Some(Kind::StepsVanish {
                at,
                coordinates,
                rows: TopContributors::ranked(M::ROWS, core::iter::empty()),
            });
        }
        last_size = size;
        distance *= 4.0;
    }
    None
}

/// A singular mass matrix with all coordinates that have no inertia at all, and parameters that may be the
/// reason. The failure stays as it is where this adds nothing.
pub(crate) fn explain_singular_mass_matrix<M: Constraints>(model: &M, state: &M::State, kind: Kind) -> Kind {
    match &kind {
        Kind::SingularMassMatrix(error) | Kind::Solve(SolveError::SingularMassMatrix(error))
            if !error.negative => {}
        _ => return kind,
    }
    let kind = gimbal_lock::explain(model, state, kind);
    let n = M::Vector::LEN;
    let without_inertia = with_workspace::<M, _>(|workspace| {
        let mass = mass(model, state, workspace);
        let is_empty = |row: &[f64]| if row.iter().all(|x| *x == 0.0) { 1.0 } else { 0.0 };
        mass.chunks_exact(n).map(is_empty).collect::<Vec<f64>>()
    });
    // Parameters that are 0: masses and moments of inertia, or without units any parameter. Where no such
    // parameter is 0, lengths, for a mass without a lever arm has no moment of inertia.
    let is_inertia = |named: &Quantity| named.unit.is_empty() || named.dimension.is_inertia();
    let is_lever = |named: &Quantity| named.dimension == UnitDimension::LENGTH;
    let zero_parameters = |has_kind: fn(&Quantity) -> bool| {
        let share = move |(i, named): (usize, &Quantity)| {
            (i, if model.parameter(i) == Some(0.0) && has_kind(named) { 1.0 } else { 0.0 })
        };
        TopContributors::ranked(M::PARAMETERS, M::PARAMETERS.iter().enumerate().map(share))
    };
    let coordinates = TopContributors::ranked(M::COORDINATES, without_inertia.iter().copied().enumerate());
    let parameters = Some(zero_parameters(is_inertia))
        .filter(|some| !some.is_empty())
        .unwrap_or_else(|| zero_parameters(is_lever));
    let says_more = coordinates.count() > 1 || !(coordinates.is_empty() || parameters.is_empty());
    if !says_more || matches!(kind, Kind::GimbalLock { .. }) {
        return kind;
    }
    Kind::NoInertia { coordinates, parameters, cause: Box::new(kind) }
}

/// Whether a failure has the same symptom for several causes.
fn is_unspecific(kind: &Kind) -> bool {
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

/// The coordinates that have no inertia left on the velocities that the constraints leave, and its ratio to
/// that at the start.
fn vanished_inertia<M: Constraints>(
    model: &M,
    start: &M::State,
    state: &M::State,
) -> Option<(TopContributors, f64)> {
    let scale = unit_inertias(model, start);
    let inertia_at_start = least_inertia(model, start, &scale)?.least;
    let LeastInertia { least, coordinates } = least_inertia(model, state, &scale)?;
    let share = least / inertia_at_start;
    (inertia_at_start > 0.0
        && share <= VANISHED_INERTIA_SHARE
        && gradient_condition(model, state) < CAUSE_CONDITION)
        .then_some((coordinates, share))
}

/// A jump of a row along a path, of Φ itself or of its velocity (a corner of Φ).
pub(crate) struct RowDiscontinuity {
    pub(crate) row: usize,
    pub(crate) what: JumpingQuantity,
    pub(crate) jump: f64,
    /// The parameter of the path just before it.
    pub(crate) at: f64,
}

/// Distance on the path, ahead and back, in which corners are searched, in parts of the time in which
/// coordinates change by their size.
const CORNER_REACH: f64 = 1e-7;
/// Halvings of the interval. The change of a smooth function shrinks to 2⁻⁴⁰ ≈ 10⁻¹² of itself.
const BISECTIONS: usize = 40;
/// A velocity jumps where the change that remains exceeds this part of the terms of the row's velocity.
const VELOCITY_JUMP_SHARE: f64 = 1e-4;
/// The same for positions, in parts of the terms of the row's residual. It is far above rounding.
const POSITION_JUMP_ROUNDING: f64 = 1e-11;

/// A constraint that requires a jump of positions or velocities at a state, or within the time `reach` on the
/// straight path ahead and back.
fn find_discontinuity<M: Constraints>(model: &M, state: &M::State, reach: f64) -> Option<RowDiscontinuity> {
    if M::IS_UNCONSTRAINED {
        return None;
    }
    let relative_speed = |(q, u): (&f64, &f64)| u.abs() / (1.0 + q.abs());
    let fastest =
        state.q().as_slice().iter().zip(state.u().as_slice()).map(relative_speed).fold(1.0, f64::max);
    // Beyond half of the time in which coordinates change by their size the path is meaningless. Where the
    // resolution of time exceeds that, nothing can be tested.
    let (time_resolution, longest_reach) = (1e3 * f64::EPSILON * state.t().abs(), 0.5 / fastest);
    if time_resolution > longest_reach {
        return None;
    }
    let reach = reach.abs().min(longest_reach).max(CORNER_REACH / fastest).max(time_resolution);
    let displaced = |tau: f64| {
        let mut displaced = at_time(state, state.t() + tau);
        (0..M::Vector::LEN).for_each(|i| displaced.q_mut()[i] += tau * state.u()[i]);
        displaced
    };
    // Gradients that vanish here do not all vanish at the nearby state.
    let row_sizes =
        row_sizes(model, &[displaced(-reach), displaced(reach), nearby::nearby_state::<M>(state)]);
    find_discontinuity_on(model, state.active_set(), (-reach, reach), displaced, &row_sizes, time_resolution)
}

/// The first constraint with a jump on the path of a step, θ from 0 to 1.
pub(crate) fn find_discontinuity_within<M: Constraints>(
    model: &M,
    path: impl Fn(f64) -> M::State,
) -> Option<RowDiscontinuity> {
    let middle = path(0.5);
    let row_sizes = row_sizes(model, &[path(0.0), path(1.0), nearby::nearby_state::<M>(&middle)]);
    let time_resolution = 1e3 * f64::EPSILON * middle.t().abs();
    find_discontinuity_on(model, middle.active_set(), (0.0, 1.0), path, &row_sizes, time_resolution)
}

/// A corner of a constraint on a way; `row_sizes`: see [`row_sizes`], `least`: the time that is resolved.
fn find_discontinuity_on<M: Constraints>(
    model: &M,
    active_set: ActiveSet,
    (from, to): (f64, f64),
    path: impl Fn(f64) -> M::State,
    (rates, row_sizes): &(M::Rows, M::Rows),
    time_resolution: f64,
) -> Option<RowDiscontinuity> {
    for row in active_rows::<M>(active_set, false) {
        if row < M::Residual::LEN
            && let Some((at, jump)) = locate_jump(from, to, |tau| model.residual(&path(tau))[row])
            && jump.abs() > POSITION_JUMP_ROUNDING * row_sizes[row] + time_resolution * rates[row]
        {
            return Some(RowDiscontinuity { row, what: JumpingQuantity::Positions, jump, at });
        }
        if let Some((at, jump)) = locate_jump(from, to, |tau| model.velocity_residual(&path(tau))[row])
            && jump.abs() > VELOCITY_JUMP_SHARE * rates[row]
        {
            return Some(RowDiscontinuity { row, what: JumpingQuantity::Velocities, jump, at });
        }
    }
    None
}

/// Bisection towards a jump of a function: the half interval with the larger change is kept. Returns where it
/// ends, and the change that remains, which goes to 0 unless the function jumps.
fn locate_jump(from: f64, to: f64, f: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    let [mut from, mut to] = [from, to].map(|x| (x, f(x)));
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (from.0 + to.0);
        let middle = (middle, f(middle));
        let in_first_half = (middle.1 - from.1).abs() > (to.1 - middle.1).abs();
        if in_first_half { to = middle } else { from = middle }
    }
    Some((from.0, to.1 - from.1)).filter(|(_, jump)| jump.is_finite())
}

/// Sizes of each row: of the terms of its velocity, Σⱼ |Φ_q,ᵢⱼ q̇ⱼ| + |Φ̇ᵢ|, and of its
/// residual, Σⱼ |Φ_q,ᵢⱼ| (1 + |qⱼ|). The largest over the given states.
fn row_sizes<M: Constraints>(model: &M, states: &[M::State]) -> (M::Rows, M::Rows) {
    let (mut rates, mut row_sizes) = (M::Rows::zeros(), M::Rows::zeros());
    for state in states {
        let (q, u, residual) = (state.q().as_slice(), state.u().as_slice(), model.velocity_residual(state));
        with_workspace::<M, _>(|workspace| {
            let gradients = Gradients::alone(model, state, workspace);
            for row in 0..M::Rows::LEN {
                let sum = |values: &[f64], offset: f64| -> f64 {
                    gradients
                        .row(row)
                        .iter()
                        .zip(values)
                        .map(|(x, values)| x.abs() * (offset + values.abs()))
                        .sum()
                };
                rates[row] = rates[row].max(residual[row].abs() + sum(u, 0.0));
                row_sizes[row] = row_sizes[row].max(sum(q, 1.0));
            }
        });
    }
    (rates, row_sizes)
}
