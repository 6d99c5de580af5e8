//! Newton's method for the closure conditions of shooting.
//!
//! The equations have two kinds. The gaps g(x) between the end of each segment and the start of the next are
//! minimised in the least-squares sense. The phase condition and the held values c(x) = 0 are fulfilled
//! exactly, so that a step keeps what is held: step = p + N y with C p = −c, N the null space of C, and y
//! from ‖g + J (p + N y)‖ = min by singular values. All unknowns are in the scales of the coordinates.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::constrain::at_time;
use dynamics_runtime::model::{ModelState, Vector};
use dynamics_runtime::simulate::Simulate;
use nalgebra::{DMatrix, DVector};

use super::Hold;
use crate::displacement::moved_along;
use crate::periodic::PeriodicError;
use crate::periodic::corners::slope;
use crate::periodic::flow::Flow;
use crate::periodic::frame::{Frame, direction, sizes, stacked};
use crate::periodic::symmetry::{Conserved, is_autonomous};

/// Largest gap or miss of a held value, relative to the ranges of the coordinates, with which a motion counts
/// as closed after steps no longer reduce it.
const MAX_CLOSURE_ERROR: f64 = 1e-8;
/// Largest relative change of the period by one step. Longer steps may lead to a multiple of the period.
const MAX_PERIOD_CHANGE: f64 = 0.3;
/// Most halvings of a step. If none reduces the residuals enough, the search ends.
const MAX_STEP_HALVINGS: usize = 10;
/// Part of the linear decrease that an accepted step must reach (Armijo's condition).
const MIN_DECREASE: f64 = 0.1;
/// Size of a step, relative to the ranges, at which the search has converged. Further steps are rounding of
/// the integration.
const CONVERGED_STEP: f64 = 1e-10;
/// Size of a step from which on an iteration that no longer reduces it has reached the error of integration.
const STALLED_STEP: f64 = 1e-7;
/// Ratio of two steps above which they no longer decrease.
const STALLED_STEP_RATIO: f64 = 0.3;
/// Reach of the motion, relative to that of the guess, at which the search has ended at rest. A larger value
/// refuses small closed motions, a smaller one accepts the rest as one.
const REST_REACH: f64 = 1e-4;
/// Singular values of the held conditions up to this part of the largest count as zero. It lies above the
/// errors of the differences of the energy.
const RANK_TOLERANCE_OF_CONDITIONS: f64 = 1e-9;
/// Singular values of the gaps up to this many tolerances of the integration, relative to the largest, count
/// as zero. The derivatives of the shots are known to about this error. A smaller value would call members of
/// a family isolated.
const RANK_TOLERANCE_IN_TOLERANCES: f64 = 100.0;
/// Least rank tolerance of the gaps. It is the rounding of the derivatives at the finest tolerances.
const MIN_RANK_TOLERANCE: f64 = 1e-10;
/// Step of differences of the energy function, in the scales of the coordinates, by the formula of order 6.
const ENERGY_STEP: f64 = 0.01;
/// Largest number of repeats within the period that is detected. Each costs a part of a shot.
const MAX_REPEATS: usize = 6;
/// Closure error after a part of the period, relative to the ranges, at which the motion repeats. As the
/// closure error of a motion (`floquet.rs`).
const REPEAT_CLOSURE_ERROR: f64 = 1e-6;

pub(super) struct ShootingOptions<'a> {
    pub(super) segments: usize,
    pub(super) hold_period: bool,
    pub(super) holds: &'a [Hold],
    pub(super) advance: &'a DVector<f64>,
    pub(super) tolerance: f64,
    pub(super) most_steps: usize,
    pub(super) most_iterations: usize,
}

pub(super) struct ShootingSolution<S> {
    pub(super) nodes: Vec<S>,
    pub(super) period: f64,
    pub(super) iterations: usize,
    pub(super) correction: f64,
    pub(super) conditioning: f64,
    sizes: DVector<f64>,
}

/// The shots of all segments, with their gaps and the derivatives by the unknowns.
struct Shots<S> {
    nodes: Vec<S>,
    frames: Vec<Frame>,
    period: f64,
    /// The gaps between segments, scaled.
    misses: DVector<f64>,
    /// Derivatives of the gaps by the unknowns.
    jacobian: DMatrix<f64>,
    /// The phase condition and the held values: residuals, and derivatives by the unknowns.
    conditions: (DVector<f64>, DMatrix<f64>),
    passed: Vec<S>,
}

/// A step, and the singular values that it was computed with.
struct Solved {
    step: DVector<f64>,
    /// Largest and smallest singular value.
    most: f64,
    least: f64,
    /// Singular values up to this one count as zero: the motion is then not isolated.
    floor: f64,
    /// The right singular vector of the smallest singular value: the direction of a family of closed motions,
    /// if there is one.
    along: DVector<f64>,
}

impl<S> Shots<S> {
    /// The step that fulfils the conditions exactly and minimises the gaps under them.
    fn solve(&self, tolerance: f64) -> Option<Solved> {
        let (off, rows) = &self.conditions;
        let n = self.jacobian.ncols();
        let (particular, free, independent) = if rows.nrows() == 0 {
            (DVector::zeros(n), DMatrix::identity(n, n), true)
        } else {
            let svd = rows.clone().svd(true, true);
            let (most, least) = (svd.singular_values.max(), svd.singular_values.min());
            let particular = svd.solve(&-off, RANK_TOLERANCE_OF_CONDITIONS * most).ok()?;
            let v = svd.v_t?;
            let projector = DMatrix::identity(n, n) - v.tr_mul(&v);
            let eigen = projector.symmetric_eigen();
            let kept: Vec<usize> = (0..n).filter(|k| eigen.eigenvalues[*k] > 0.5).collect();
            (
                particular,
                eigen.eigenvectors.select_columns(&kept),
                least > RANK_TOLERANCE_OF_CONDITIONS * most,
            )
        };
        if free.ncols() == 0 {
            // The conditions determine all unknowns.
            let along = DVector::zeros(n);
            return Some(Solved { step: particular, most: 1.0, least: 1.0, floor: 0.0, along });
        }
        let svd = (&self.jacobian * &free).svd(true, true);
        let (most, least) = (svd.singular_values.max(), svd.singular_values.min());
        let floor = (RANK_TOLERANCE_IN_TOLERANCES * tolerance).max(MIN_RANK_TOLERANCE) * most;
        let left = -(&self.misses + &self.jacobian * &particular);
        let step = particular + &free * svd.solve(&left, floor).ok()?;
        let v = svd.v_t?;
        let along = &free * v.row(v.nrows() - 1).transpose();
        Some(Solved { step, most, least: if independent { least } else { 0.0 }, floor, along })
    }

    /// The sum of squares of all residuals.
    fn merit(&self) -> f64 {
        self.misses.norm_squared() + self.conditions.0.norm_squared()
    }

    /// The largest residual.
    fn worst(&self) -> f64 {
        self.misses.amax().max(if self.conditions.0.is_empty() { 0.0 } else { self.conditions.0.amax() })
    }
}

struct ShootingProblem<'a, 'm, M: Simulate> {
    flow: Flow<'m, M>,
    options: &'a ShootingOptions<'a>,
    holds: Vec<Hold>,
    sizes: DVector<f64>,
    autonomous: bool,
    /// Whether the period is an unknown.
    free: bool,
    /// Names of the quantities that are conserved along the motion through the guess.
    conserved: Vec<&'static str>,
    /// Whether the motion may belong to a family of which no member was chosen. Then its energy is held.
    is_family: bool,
    /// The reach of the motion through the guess, scaled.
    reach: f64,
    /// Whether there is no phase condition, because a held coordinate selects the starting point.
    no_phase_condition: bool,
}

/// Searches a closed motion near the guesses.
pub(super) fn search<M: Simulate>(
    model: &M,
    guesses: &[M::State],
    period: f64,
    options: &ShootingOptions<'_>,
) -> Result<ShootingSolution<M::State>, PeriodicError> {
    let (mut problem, nodes) = ShootingProblem::new(model, guesses, period, options)?;
    let of_coordinate = problem.holds.iter().any(|hold| matches!(hold, Hold::Coordinate(..)));
    let may_be_isolated = problem.autonomous && problem.conserved.is_empty() && of_coordinate;
    match problem.search(nodes.clone(), period) {
        // A held coordinate selects a member of a family, or the starting point on an isolated motion. First
        // try the former, then the latter.
        Err(error) if may_be_isolated => {
            problem.no_phase_condition = true;
            problem.search(nodes, period).map_err(|_| error)
        }
        found => found,
    }
}

/// The largest distance of a motion from its start, scaled.
fn reach<S: ModelState>(passed: &[S], sizes: &DVector<f64>) -> f64 {
    let Some(first) = passed.first().map(stacked) else { return 0.0 };
    passed.iter().map(|state| (stacked(state) - &first).component_div(sizes).amax()).fold(0.0, f64::max)
}

/// Where segments start: as given, or along the motion through the guess.
fn nodes<M: Simulate>(
    flow: &mut Flow<'_, M>,
    guesses: &[M::State],
    period: f64,
    segments: usize,
) -> Result<Vec<M::State>, PeriodicError> {
    let time = |k: usize| guesses[0].t() + period * k as f64 / segments as f64;
    if guesses.len() == segments {
        let mut nodes: Vec<M::State> =
            guesses.iter().enumerate().map(|(k, guess)| at_time(guess, time(k))).collect();
        // Constraints that move hold at the time of each node.
        for node in nodes.iter_mut().filter(|_| !M::ROWS.is_empty()) {
            flow.project(node)?;
        }
        return Ok(nodes);
    }
    let none = DMatrix::zeros(2 * M::Vector::LEN, 0);
    let mut nodes = alloc::vec![guesses[0]];
    for k in 1..segments {
        let next = flow.integrate(&nodes[k - 1], &none, time(k), &mut |_| ())?.state;
        nodes.push(next);
    }
    Ok(nodes)
}

impl<'a, 'm, M: Simulate> ShootingProblem<'a, 'm, M> {
    /// The problem, and the states at which the segments start.
    fn new(
        model: &'m M,
        guesses: &[M::State],
        period: f64,
        options: &'a ShootingOptions<'a>,
    ) -> Result<(Self, Vec<M::State>), PeriodicError> {
        let mut flow = Flow::new(model, options.tolerance, options.most_steps)?;
        let nodes = nodes(&mut flow, guesses, period, options.segments)?;
        let mut passed = Vec::new();
        let none = DMatrix::zeros(2 * M::Vector::LEN, 0);
        for node in &nodes {
            passed.push(*node);
            flow.integrate(node, &none, node.t() + period / options.segments as f64, &mut |state| {
                passed.push(*state)
            })?;
        }
        let sizes = sizes::<M>(&passed, period);
        let autonomous = is_autonomous(&mut flow, &passed, period, options.advance)?;
        let free = autonomous && !options.hold_period;
        // If no member of a family was chosen, one is found with the energy of the guess. The error then
        // shows it.
        let conserved = Conserved::along(model, &passed, autonomous).quantities;
        let conserved: Vec<_> = conserved.iter().map(|of| of.name).collect();
        let is_family = free && options.holds.is_empty() && !conserved.is_empty();
        let mut holds = options.holds.to_vec();
        holds.extend(is_family.then(|| Hold::Energy(model.energy_function(&nodes[0]))));
        let reach = reach(&passed, &sizes);
        let no_phase_condition = false;
        let problem = Self {
            flow,
            options,
            holds,
            sizes,
            autonomous,
            free,
            conserved,
            is_family,
            reach,
            no_phase_condition,
        };
        Ok((problem, nodes))
    }

    /// Newton's method from these nodes.
    fn search(
        &mut self,
        nodes: Vec<M::State>,
        period: f64,
    ) -> Result<ShootingSolution<M::State>, PeriodicError> {
        let mut shots = self.shoot(nodes, period)?;
        let mut because = None;
        let mut correction = f64::INFINITY;
        let mut iteration = 0;
        loop {
            let Some(solved) = shots.solve(self.options.tolerance) else {
                return Err(self.not_found(&shots, iteration, because));
            };
            let (size, worst) = (solved.step.amax(), shots.worst());
            // Converged: the step is small, or it no longer decreases near the error of integration.
            let settled = size <= CONVERGED_STEP
                || correction <= STALLED_STEP && size >= STALLED_STEP_RATIO * correction;
            let next = if settled && worst <= MAX_CLOSURE_ERROR || iteration == self.options.most_iterations {
                None
            } else {
                self.descend(&shots, &solved.step, &mut because)
            };
            if let Some(next) = next {
                (shots, correction) = (next, size);
                iteration += 1;
                continue;
            }
            if worst > MAX_CLOSURE_ERROR {
                return Err(self.not_found(&shots, iteration, because));
            }
            if self.autonomous && reach(&shots.passed, &self.sizes) <= REST_REACH * self.reach {
                return Err(PeriodicError::Rests { at: stacked(&shots.nodes[0]).as_slice().into() });
            }
            let solved = self.check_isolated(&mut shots, solved)?;
            return Ok(ShootingSolution {
                iterations: iteration,
                correction: size,
                conditioning: solved.most / solved.least.max(f64::MIN_POSITIVE),
                period: shots.period,
                sizes: self.sizes.clone(),
                nodes: shots.nodes,
            });
        }
    }

    /// Checks that the closed motion is isolated, without the energy that was held for a family.
    fn check_isolated(
        &self,
        shots: &mut Shots<M::State>,
        mut solved: Solved,
    ) -> Result<Solved, PeriodicError> {
        if self.is_family {
            let (misses, rows) = &shots.conditions;
            let given = rows.nrows() - 1;
            shots.conditions = (misses.rows(0, given).into_owned(), rows.rows(0, given).into_owned());
            solved = shots.solve(self.options.tolerance).unwrap_or(solved);
        }
        if !self.is_family && solved.least > solved.floor {
            return Ok(solved);
        }
        let frame = &shots.frames[0];
        let coordinate = frame.name::<M>(solved.along.rows(0, frame.len()).iamax());
        Err(PeriodicError::NotIsolated {
            coordinate,
            ratio: solved.least / solved.most,
            conserved: self.conserved.clone(),
            remedies: self.remedies(coordinate),
            period: shots.period,
            at: stacked(&shots.nodes[0]).as_slice().into(),
        })
    }

    /// Conditions that could choose one of a family of closed motions and are not set yet.
    fn remedies(&self, coordinate: &str) -> Vec<String> {
        let holds_energy = self.options.holds.iter().any(|hold| matches!(hold, Hold::Energy(_)));
        let holds_coordinate = self.options.holds.iter().any(|hold| matches!(hold, Hold::Coordinate(..)));
        let energy = (!holds_energy && !self.conserved.is_empty()).then(|| String::from(".hold_energy(..)"));
        let coordinate = (!holds_coordinate).then(|| alloc::format!(".hold(\"{coordinate}\", ..)"));
        let period = (!self.options.hold_period && self.autonomous).then(|| String::from(".hold_period()"));
        energy.into_iter().chain(coordinate).chain(period).collect()
    }

    /// Integrates all segments with their variations and assembles gaps and derivatives.
    fn shoot(&mut self, nodes: Vec<M::State>, period: f64) -> Result<Shots<M::State>, PeriodicError> {
        let count = nodes.len();
        let frames: Vec<Frame> = nodes
            .iter()
            .map(|node| Frame::at(self.flow.model, node, None))
            .collect::<Result<_, PeriodicError>>()?;
        let m = frames[0].len();
        let columns = m * count + usize::from(self.free);
        let (mut misses, mut jacobian) = (DVector::zeros(m * count), DMatrix::zeros(m * count, columns));
        let mut passed = Vec::new();
        for k in 0..count {
            let next = (k + 1) % count;
            let until = nodes[0].t() + period * (k + 1) as f64 / count as f64;
            passed.push(nodes[k]);
            let arrived =
                self.flow.integrate(&nodes[k], &frames[k].basis, until, &mut |state| passed.push(*state))?;
            let wanted = stacked(&nodes[next])
                + if next == 0 { self.options.advance.clone() } else { self.options.advance * 0.0 };
            let (here, there) = (frames[k].rows(), frames[next].rows());
            let off = stacked(&arrived.state) - wanted;
            let part = frames[next].read(&arrived.tangents);
            let along = direction(&mut self.flow, &arrived.state)?;
            for (i, row) in there.iter().enumerate() {
                let size = self.sizes[*row];
                misses[k * m + i] = off[*row] / size;
                for (j, column) in here.iter().enumerate() {
                    jacobian[(k * m + i, k * m + j)] += part[(i, j)] * self.sizes[*column] / size;
                }
                jacobian[(k * m + i, next * m + i)] -= 1.0;
                if self.free {
                    jacobian[(k * m + i, columns - 1)] = along[*row] * period / count as f64 / size;
                }
            }
        }
        let conditions = self.conditions(&nodes[0], &frames[0], columns)?;
        Ok(Shots { nodes, frames, period, misses, jacobian, conditions, passed })
    }

    /// The phase condition (steps are orthogonal to the motion) and the held values, with derivatives.
    fn conditions(
        &mut self,
        start: &M::State,
        frame: &Frame,
        columns: usize,
    ) -> Result<(DVector<f64>, DMatrix<f64>), PeriodicError> {
        let m = frame.len();
        let phase = self.autonomous && !self.no_phase_condition;
        let count = usize::from(phase) + self.holds.len();
        let (mut misses, mut rows) = (DVector::zeros(count), DMatrix::zeros(count, columns));
        let mut row = 0;
        if phase {
            let along = direction(&mut self.flow, start)?;
            let scaled =
                DVector::from_iterator(m, frame.rows().into_iter().map(|i| along[i] / self.sizes[i]));
            let size = scaled.norm().max(f64::MIN_POSITIVE);
            (0..m).for_each(|j| rows[(row, j)] = scaled[j] / size);
            row += 1;
        }
        for hold in &self.holds {
            let (miss, gradient) = self.held(hold, start, frame);
            misses[row] = miss;
            (0..m).for_each(|j| rows[(row, j)] = gradient[j]);
            row += 1;
        }
        Ok((misses, rows))
    }

    /// The residual of a held value and its derivatives, both divided by the largest derivative.
    fn held(&self, hold: &Hold, state: &M::State, frame: &Frame) -> (f64, DVector<f64>) {
        let rows = frame.rows();
        let gradient = match hold {
            Hold::Coordinate(index, _) => {
                DVector::from_fn(frame.len(), |k, _| frame.basis[(*index, k)] * self.sizes[rows[k]])
            }
            Hold::Energy(_) => DVector::from_fn(frame.len(), |k, _| {
                let along = frame.basis.column(k) * self.sizes[rows[k]];
                slope(ENERGY_STEP, |by| self.flow.model.energy_function(&moved_along(state, &along, by)))
            }),
        };
        let miss = match hold {
            Hold::Coordinate(index, value) => state.q()[*index] - value,
            Hold::Energy(value) => self.flow.model.energy_function(state) - value,
        };
        let size = gradient.amax().max(f64::MIN_POSITIVE);
        (miss / size, gradient / size)
    }

    /// The shots after a step, halved until the residuals decrease; `None` if they do not.
    fn descend(
        &mut self,
        shots: &Shots<M::State>,
        step: &DVector<f64>,
        because: &mut Option<Box<PeriodicError>>,
    ) -> Option<Shots<M::State>> {
        let m = shots.frames[0].len();
        let of_period = if self.free { step[step.len() - 1] } else { 0.0 };
        let mut part = (MAX_PERIOD_CHANGE / of_period.abs().max(f64::MIN_POSITIVE)).min(1.0);
        for _ in 0..MAX_STEP_HALVINGS {
            let period = shots.period * (1.0 + part * of_period);
            match self.moved(shots, &(step.rows(0, m * shots.nodes.len()) * part), period) {
                Ok(next) if next.merit() <= (1.0 - MIN_DECREASE * part) * shots.merit() => {
                    return Some(next);
                }
                Ok(_) => {}
                Err(error) => *because = Some(Box::new(error)),
            }
            part *= 0.5;
        }
        None
    }

    /// The shots from nodes moved by a step.
    fn moved(
        &mut self,
        shots: &Shots<M::State>,
        by: &DVector<f64>,
        period: f64,
    ) -> Result<Shots<M::State>, PeriodicError> {
        let (m, count) = (shots.frames[0].len(), shots.nodes.len());
        let mut nodes = Vec::with_capacity(count);
        for (k, node) in shots.nodes.iter().enumerate() {
            let rows = shots.frames[k].rows();
            let change = DVector::from_fn(m, |j, _| by[k * m + j] * self.sizes[rows[j]]);
            let time = shots.nodes[0].t() + period * k as f64 / count as f64;
            nodes.push(shots.frames[k].moved(&mut self.flow, &at_time(node, time), &change)?);
        }
        self.shoot(nodes, period)
    }

    /// The error of a search that did not converge.
    fn not_found(
        &self,
        shots: &Shots<M::State>,
        iterations: usize,
        because: Option<Box<PeriodicError>>,
    ) -> PeriodicError {
        let m = shots.frames[0].len();
        let at = shots.misses.iamax();
        let coordinate = shots.frames[at / m].name::<M>(at % m);
        PeriodicError::NoConvergence {
            iterations,
            coordinate,
            miss: shots.worst(),
            period: shots.period,
            at: stacked(&shots.nodes[0]).as_slice().into(),
            because,
        }
    }
}

/// How often a closed motion repeats within its period, up to [`MAX_REPEATS`].
pub(super) fn repeats<M: Simulate>(
    model: &M,
    found: &ShootingSolution<M::State>,
    advance: &DVector<f64>,
    (tolerance, most_steps): (f64, usize),
) -> Result<usize, PeriodicError> {
    let mut flow = Flow::new(model, tolerance, most_steps)?;
    let none = DMatrix::zeros(2 * M::Vector::LEN, 0);
    let start = &found.nodes[0];
    for parts in (2..=MAX_REPEATS).rev() {
        let until = start.t() + found.period / parts as f64;
        // If no single shot reaches the part of the period, repeats are not detected.
        let Ok(arrived) = flow.integrate(start, &none, until, &mut |_| ()) else { continue };
        let off = stacked(&arrived.state) - stacked(start) - advance / parts as f64;
        if off.component_div(&found.sizes).amax() <= REPEAT_CLOSURE_ERROR {
            return Ok(parts);
        }
    }
    Ok(1)
}
