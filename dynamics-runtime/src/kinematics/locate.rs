//! Locates the singular position that a path leads to, and classifies it.
//!
//! Along the path the smallest singular value σ of the scaled Jacobian goes to zero. At both kinds of
//! singular positions t and q are smooth functions of σ: at a lock-up t* − t ∼ σ², at a
//! bifurcation ∼ σ. They are extrapolated to σ = 0, and the result is polished by Gauss–Newton on
//!
//! ```text
//! Φ(q, t) = 0        σ(q, t) = 0        and at a bifurcation        wᵀ(Φ_t + Φ_q q̇) = 0
//! ```
//!
//! with w the left singular vector of σ. At a lock-up wᵀΦ_t ≠ 0: no velocity follows the drive. At a
//! bifurcation Φ_t lies in the range of Φ_q. Derivatives of σ and of the last equation are central
//! differences with frozen singular vectors. They have ten digits, so that every iteration gains ten digits.
//! Source: W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM 2000, ch. 3
//! and 4.

use alloc::vec;
use alloc::vec::Vec;

use super::jacobian_svd::{JacobianSvd, PathScaling};
use super::trace::{PathPoint, PathTracer};
use crate::constrain::TopContributors;
use crate::constrain::nearby::at_time;
use crate::linalg::Svd;
use crate::math;
use crate::model::{Constraints, ModelState, Vector};

/// A path is suspected to lead to a singular position where its smallest singular value has fallen to this
/// part of its largest value.
pub(super) const SUSPECT_RATIO: f64 = 1e-3;
/// Most points of the extrapolation: polynomials of degree four.
const EXTRAPOLATED_POINTS: usize = 5;
/// |wᵀΦ_t| above this part of the largest ‖Φ_t‖ on the path is a lock-up. At a bifurcation the
/// extrapolation leaves about 10⁻⁸.
const DRIVE_SHARE: f64 = 1e-5;
/// At a located position σ is below this part of the largest singular value.
const SINGULAR_RATIO: f64 = 1e-7;
/// Singular values below this part of the largest count for the loss of rank there.
const LOST_RATIO: f64 = 1e-5;
/// At a polished position the constraints hold within this part of the size of the coordinates. Near misses
/// do not: links that are nearly in line miss the singular position by the square of their angle.
const RESIDUAL_ROUNDING: f64 = 64.0 * f64::EPSILON;
/// The same for a position that is only extrapolated.
const EXTRAPOLATED_RESIDUAL: f64 = 1e-9;

/// A located singular position.
#[derive(Clone, Debug)]
pub(super) struct SingularPoint<S> {
    pub(super) state: S,
    pub(super) locks_up: bool,
    pub(super) loss: usize,
    pub(super) rows: TopContributors,
    pub(super) coordinates: TopContributors,
}

impl<M: Constraints> PathTracer<'_, M> {
    /// The singular position that the last points of a path lead to; `None` where they lead to none.
    pub(super) fn locate(&self, path: &[PathPoint<M>]) -> Option<SingularPoint<M::State>> {
        let points = falling(path);
        if points.len() < 3 {
            return None;
        }
        let sigma: Vec<f64> = points.iter().map(|point| point.svd.least()).collect();
        let at_zero = |value: &dyn Fn(&PathPoint<M>) -> f64| {
            extrapolate(&sigma, &points.iter().map(value).collect::<Vec<_>>())
        };
        let mut state = at_time(&points[0].state, at_zero(&|point| point.state.t()));
        for i in 0..M::Vector::LEN {
            state.q_mut()[i] = at_zero(&|point| point.state.q()[i]);
        }
        let driven = at_zero(&|point| self.drive(point).0);
        // The largest ‖Φ_t‖ on the path: a drive that reverses just there has none at the position.
        let drive = points.iter().map(|point| self.drive(point).1).fold(0.0, f64::max);
        let guess = driven.abs() > DRIVE_SHARE * drive;
        let last = points[points.len() - 1].state;
        let with_velocities = |locks_up: bool| {
            let mut state = state;
            for i in 0..M::Vector::LEN {
                state.u_mut()[i] = if locks_up { last.u()[i] } else { at_zero(&|point| point.state.u()[i]) };
            }
            state
        };
        // Both kinds are tried, the likely one first: where several directions are lost, w is any of several
        // vectors.
        let kinds =
            [guess, !guess].map(|locks_up| (locks_up, self.polish(with_velocities(locks_up), locks_up)));
        let exact = kinds.iter().any(|(_, polished)| polished.is_some());
        let found = kinds.into_iter().find_map(|(locks_up, polished)| {
            let (state, svd) = match polished {
                Some(polished) => polished,
                None if exact => return None,
                None => {
                    let state = with_velocities(locks_up);
                    (state, JacobianSvd::new(&self.scaling, self.model, &state).ok()?)
                }
            };
            let relative_residual = if exact { RESIDUAL_ROUNDING } else { EXTRAPOLATED_RESIDUAL };
            let is_singular = svd.least() <= SINGULAR_RATIO * svd.largest();
            let fits = self.relative_residual(&state, &svd) <= relative_residual
                && self.is_locked(&state, &svd, drive) == locks_up;
            (is_singular && fits).then_some((state, svd, locks_up))
        });
        let (state, svd, locks_up) = found?;
        let (ahead, span) = (state.t() - last.t(), last.t() - points[0].state.t());
        if ahead * span < -1e-9 * span * span || ahead.abs() > 2.0 * span.abs() {
            return None;
        }
        let (right, left) = svd.weakest_vectors();
        Some(SingularPoint {
            state,
            locks_up,
            loss: (M::Vector::LEN - svd.rank(LOST_RATIO)).max(1),
            rows: TopContributors::ranked(
                M::ROWS,
                self.scaling.rows.iter().copied().zip(left.iter().copied()),
            ),
            coordinates: TopContributors::ranked(M::COORDINATES, right.iter().copied().enumerate()),
        })
    }

    /// Residual of the constraints in parts of the size of the coordinates.
    fn relative_residual(&self, state: &M::State, svd: &JacobianSvd) -> f64 {
        let residual = scaled(&self.scaling, self.model.residual(state).as_slice(), &svd.scales);
        math::sqrt(dot(&residual, &residual)) / self.scaling.scale(state.q().as_slice())
    }

    /// Whether no velocity follows the drive at a singular position: Φ_t is outside of the range of Φ_q by
    /// more than [`DRIVE_SHARE`] of what it was on the path.
    fn is_locked(&self, state: &M::State, svd: &JacobianSvd, drive: f64) -> bool {
        let mut at_rest = *state;
        *at_rest.u_mut() = M::Vector::zeros();
        let rates = scaled(&self.scaling, self.model.velocity_residual(&at_rest).as_slice(), &svd.scales);
        svd.beyond_range(LOST_RATIO, &rates) > DRIVE_SHARE * drive.max(math::sqrt(dot(&rates, &rates)))
    }

    /// |wᵀΦ_t| and ‖Φ_t‖, in scaled rows.
    fn drive(&self, point: &PathPoint<M>) -> (f64, f64) {
        let mut at_rest = point.state;
        *at_rest.u_mut() = M::Vector::zeros();
        let (_, left) = point.svd.weakest_vectors();
        let rates =
            scaled(&self.scaling, self.model.velocity_residual(&at_rest).as_slice(), &point.svd.scales);
        (dot(&left, &rates).abs(), math::sqrt(dot(&rates, &rates)))
    }

    /// Gauss–Newton on the equations of the singular position; `None` where it does not converge. Near a near
    /// miss it may converge to the least residual.
    fn polish(&self, mut state: M::State, locks_up: bool) -> Option<(M::State, JacobianSvd)> {
        let n = M::Vector::LEN;
        let m = self.scaling.rows.len();
        let equations = m + if locks_up { 1 } else { 2 };
        // Time is measured by how far the mechanism moves in it.
        let scale = self.scaling.scale(state.q().as_slice());
        let pace = self.scaling.length(state.u().as_slice()).max(1e-3 * scale);
        let mut last = f64::INFINITY;
        for _ in 0..12 {
            // Right-hand side: −Φ, −σ and, at a bifurcation, −wᵀ(Φ_t + Φ_q q̇).
            let svd = JacobianSvd::new(&self.scaling, self.model, &state).ok()?;
            let functions = SingularFunctions::new(self, state, &svd);
            let mut a = vec![0.0; equations * (n + 1)];
            let mut right = scaled(&self.scaling, self.model.residual(&state).as_slice(), &svd.scales);
            right.extend([functions.sigma(&state), functions.driven(&state)]);
            right.truncate(equations);
            right.iter_mut().for_each(|x| *x = -*x);
            // Matrix: derivatives by the scaled coordinates, then by time.
            let jacobian = self.scaling.jacobian(self.model, &state, &svd.scales);
            for j in 0..=n {
                let column = &mut a[j * equations..][..equations];
                let unit = if j < n { self.scaling.weights[j] } else { pace };
                if j < n {
                    column[..m].copy_from_slice(&jacobian[j * m..][..m]);
                } else {
                    let mut at_rest = state;
                    *at_rest.u_mut() = M::Vector::zeros();
                    let rates = self.model.velocity_residual(&at_rest);
                    let rates = scaled(&self.scaling, rates.as_slice(), &svd.scales);
                    column[..m].iter_mut().zip(rates).for_each(|(out, rate)| *out = rate / unit);
                }
                let [sigma, driven] = functions.slopes(&state, j).map(|slope| slope / unit);
                column[m..].copy_from_slice(&[sigma, driven][..equations - m]);
            }
            // The step of least length.
            let (mut v, mut sigma) = (vec![0.0; (n + 1) * (n + 1)], vec![0.0; n + 1]);
            let mut step = vec![0.0; n + 1];
            let newton = Svd::new(equations, &mut a, &mut v, &mut sigma);
            newton.solve(&right, 1e-9 * newton.largest(), 0.0, &mut step);
            let length = math::sqrt(dot(&step, &step)) / scale;
            for (j, step) in step[..n].iter().enumerate() {
                state.q_mut()[j] += step / self.scaling.weights[j];
            }
            state = at_time(&state, state.t() + step[n] / pace);
            if length <= 1e-14 || (length <= 1e-11 && length >= 0.5 * last) {
                let svd = JacobianSvd::new(&self.scaling, self.model, &state).ok()?;
                return Some((state, svd));
            }
            if length.is_nan() || length >= 2.0 * last {
                return None;
            }
            last = length;
        }
        None
    }
}

/// The functions that vanish at a singular position, with frozen singular vectors.
struct SingularFunctions<'t, 'm, M: Constraints> {
    tracer: &'t PathTracer<'m, M>,
    scales: &'t [f64],
    right: Vec<f64>,
    left: Vec<f64>,
    u: M::Vector,
}

impl<'t, 'm, M: Constraints> SingularFunctions<'t, 'm, M> {
    fn new(tracer: &'t PathTracer<'m, M>, state: M::State, svd: &'t JacobianSvd) -> Self {
        let (right, left) = svd.weakest_vectors();
        Self { tracer, scales: &svd.scales, right, left, u: *state.u() }
    }

    /// wᵀ Φ_q v, which is σ at the state of the singular vectors.
    fn sigma(&self, state: &M::State) -> f64 {
        let jacobian = self.tracer.scaling.jacobian(self.tracer.model, state, self.scales);
        let m = self.left.len();
        jacobian.chunks_exact(m).zip(&self.right).map(|(column, v)| v * dot(column, &self.left)).sum()
    }

    /// wᵀ (Φ_t + Φ_q q̇).
    fn driven(&self, state: &M::State) -> f64 {
        let mut state = *state;
        *state.u_mut() = self.u;
        let rates = self.tracer.model.velocity_residual(&state);
        dot(&self.left, &scaled(&self.tracer.scaling, rates.as_slice(), self.scales))
    }

    /// Their derivatives by coordinate j, or by time for j = n.
    fn slopes(&self, state: &M::State, j: usize) -> [f64; 2] {
        let n = M::Vector::LEN;
        let size = if j < n { state.q()[j] } else { state.t() };
        let epsilon = 6e-6 * (1.0 + size.abs());
        let beside = |sign: f64| {
            let mut beside = *state;
            if j < n {
                beside.q_mut()[j] += sign * epsilon;
                beside
            } else {
                at_time(state, state.t() + sign * epsilon)
            }
        };
        let (up, down) = (beside(1.0), beside(-1.0));
        [self.sigma(&up) - self.sigma(&down), self.driven(&up) - self.driven(&down)]
            .map(|d| d / (2.0 * epsilon))
    }
}

/// The last points of a path along which σ fell.
fn falling<M: Constraints>(path: &[PathPoint<M>]) -> &[PathPoint<M>] {
    let pairs = path.windows(2).rev().take(EXTRAPOLATED_POINTS - 1);
    let count = pairs.take_while(|pair| pair[1].svd.least() < 0.9 * pair[0].svd.least()).count();
    &path[path.len().saturating_sub(count + 1)..]
}

/// Values of active rows in their scales.
fn scaled(scaling: &PathScaling, values: &[f64], scales: &[f64]) -> Vec<f64> {
    scaling.rows.iter().zip(scales).map(|(row, scale)| values[*row] / scale).collect()
}

/// The polynomial through points (x, y), at x = 0 (Neville).
fn extrapolate(x: &[f64], y: &[f64]) -> f64 {
    let mut table = y.to_vec();
    for order in 1..x.len() {
        for i in 0..x.len() - order {
            table[i] = (x[i + order] * table[i] - x[i] * table[i + 1]) / (x[i + order] - x[i]);
        }
    }
    table[0]
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
