//! The extent of balance along directions with almost no stiffness.
//!
//! If a singular value of K vanishes, K does not bound the error of the position: at a critical load forces
//! begin with the third power, and within 10⁻⁵ of it they are only rounding. So the direction is
//! followed, with the stiff directions kept in balance (Lyapunov & Schmidt: M. Golubitsky & D. G. Schaeffer,
//! *Singularities and Groups in Bifurcation Theory* I, chapter VII), until the residual force is larger than
//! rounding. If it never is, there is a continuum of equilibria. If it is on one side only, the forces have
//! faded below rounding, like e^(−x) and 1 − tanh²x: a smooth function does not vanish over an interval
//! otherwise. The same holds if forces are independent of the direction nearby, but not at other places along
//! it. Far from its well even the stiffness of −e^(−x²) underflows.

use dynamics_runtime::constrain::{project_positions, with_workspace};
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraints, Kink, MOST_KINKS, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use super::EquilibriumError;
use super::factors::BalancedSvd;
use super::rounding::FORCE_NOISE_FACTOR;
use super::statics::{Statics, scales};

/// Singular values below this part of the largest are examined.
const SOFT: f64 = 1e-6;
/// So are those along which rounding of forces would move the position by more than this.
const UNSURE: f64 = 1e-3;
/// The first and the last distance, in the scales of the coordinates.
const FIRST: f64 = 1e-13;
const LAST: f64 = 2.0;
/// Distances are doubled, but increase by no more than this.
const STRIDE: f64 = 0.05;
/// If the force vanishes at all of these distances, it vanishes everywhere nearby. The last two may lead to
/// zero, where anything is possible.
const SOFT_PROBES: [f64; 6] = [-0.05, 0.05, -0.4, 0.4, -1.0, 1.0];
/// Other positions that are sampled if the force vanishes nearby: powers of ten of a coordinate, and how many
/// in each.
const DECADES: [i32; 2] = [-9, 9];
const EACH: i32 = 4;
/// Corrections of the stiff directions at each distance.
const CORRECTIONS: usize = 6;
/// Forces above this multiple of their rounding are significant.
const TOLD: f64 = 4.0;

/// The extent over which a force is only rounding.
enum Side {
    /// The extent, and whether the model kept its branches on the way.
    Ends(f64, bool),
    /// As far as the search went.
    Never,
}

/// The index of the largest.
fn largest(values: impl Iterator<Item = f64>) -> usize {
    values.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
}

/// The intervals in which the model keeps its branches.
fn pieces<M: Constraints>(model: &M, state: &M::State) -> [[f64; 2]; MOST_KINKS] {
    let mut kinks = [Kink::NONE; MOST_KINKS];
    model.kinks(state, &mut kinks);
    kinks.map(|kink| kink.smooth)
}

/// The start of a direction that is followed.
pub(super) struct Soft<'a, M: Constraints> {
    pub(super) model: &'a M,
    pub(super) state: &'a M::State,
    pub(super) statics: &'a Statics<M::Rows>,
    pub(super) factors: &'a BalancedSvd,
    pub(super) noise: &'a DVector<f64>,
}

impl<M: Constraints> Soft<'_, M> {
    /// The uncertainty of the independent coordinates along all soft directions.
    pub(super) fn reach(&self) -> Result<DVector<f64>, EquilibriumError> {
        let mut reach = DVector::zeros(self.statics.stiffness.ncols());
        let sigma = &self.factors.svd.singular_values;
        let (Some(u), Some(v_t)) = (&self.factors.svd.u, &self.factors.svd.v_t) else { return Ok(reach) };
        let scales = scales(M::COORDINATES, self.state.q().as_slice());
        for k in 0..sigma.len() {
            let left = u.column(k).component_mul(&self.factors.rows);
            let along = v_t.row(k).transpose().component_mul(&self.factors.columns);
            let all = &self.statics.tangent.positions * &along;
            let size = all.iter().zip(&scales).fold(0.0, |most: f64, (x, scale)| most.max(x.abs() / scale));
            // A K of zeros alone is soft altogether.
            let is_soft =
                sigma[k] <= SOFT * sigma.amax() || left.abs().dot(self.noise) / sigma[k] * size > UNSURE;
            if !is_soft || size <= 0.0 || !size.is_finite() {
                continue;
            }
            let sides = self.sides(&left, &(&along / size), k)?;
            let far = match sides {
                [Side::Never, Side::Never] if self.depends_far_away(&(&all / size))? => {
                    return Err(self.faded(&all, &scales));
                }
                [Side::Never, Side::Never] => 0.0,
                [Side::Ends(a, _), Side::Ends(b, _)] => a.max(b),
                [Side::Ends(_, true), _] | [_, Side::Ends(_, true)] => return Err(self.faded(&all, &scales)),
                [Side::Ends(a, _), _] | [_, Side::Ends(a, _)] => a,
            };
            reach += along.abs() * (far / size);
        }
        Ok(reach)
    }

    fn faded(&self, all: &DVector<f64>, scales: &[f64]) -> EquilibriumError {
        let i = largest(all.iter().zip(scales).map(|(x, scale)| x.abs() / scale));
        EquilibriumError::Faded { coordinate: M::COORDINATES[i].name, value: self.state.q().as_slice()[i] }
    }

    /// Whether no force changes nearby, as all coordinates move by parts of `all`, but one changes far away,
    /// without a branch change in between. The search is straight, without corrections: it leaves a curve of
    /// equilibria at once.
    fn depends_far_away(&self, all: &DVector<f64>) -> Result<bool, EquilibriumError> {
        let moved = |s: f64| {
            let mut beside = *self.state;
            beside.q_mut().as_mut_slice().iter_mut().zip(all.iter()).for_each(|(q, d)| *q += s * d);
            beside
        };
        let here = self.statics.force_beside(self.model, self.state)?;
        // A force that is not finite gives no information.
        let changes = |beside: &M::State| -> bool {
            let Ok(there) = self.statics.force_beside(self.model, beside) else { return false };
            let change = (&there - &here).abs();
            change.iter().zip(self.noise.iter()).any(|(change, noise)| *change > TOLD * noise)
                // Large coordinates round more.
                && self.statics.noise_of_sums(self.model, beside).is_ok_and(|noise| {
                    change.iter().zip(noise.iter()).any(|(change, noise)| *change > FORCE_NOISE_FACTOR * noise)
                })
        };
        if SOFT_PROBES[..4].iter().any(|s| changes(&moved(*s))) {
            return Ok(false);
        }
        let i = all.iamax();
        let (from, along) = (self.state.q().as_slice()[i], all[i]);
        let pieces_here = pieces(self.model, self.state);
        let sizes =
            (EACH * DECADES[0]..=EACH * DECADES[1]).map(|k| 10.0_f64.powf(f64::from(k) / f64::from(EACH)));
        let places = sizes.flat_map(|size| [size, -size]).map(|place| moved((place - from) / along));
        Ok(places.into_iter().any(|beside| changes(&beside) && pieces(self.model, &beside) == pieces_here))
    }

    /// The extent to both sides over which the force along a direction is only rounding.
    fn sides(
        &self,
        left: &DVector<f64>,
        along: &DVector<f64>,
        own: usize,
    ) -> Result<[Side; 2], EquilibriumError> {
        // The residual counts as rounding, too.
        let least = TOLD * left.abs().dot(self.noise).max(left.dot(&self.statics.force).abs());
        let stiff = self.factors.without(SOFT, own);
        // Cyclic coordinates are usually soft, and recognised at once.
        let mut never = true;
        for s in SOFT_PROBES {
            let force = if never { self.left(left, &(along * s), &stiff)? } else { None };
            never &= force.is_some_and(|(force, _)| force.abs() <= least);
        }
        if never {
            return Ok([Side::Never, Side::Never]);
        }
        let here = pieces(self.model, self.state);
        let side = |sign: f64| -> Result<Side, EquilibriumError> {
            let (mut s, mut reach) = (FIRST, 0.0);
            while s <= LAST {
                match self.left(left, &(along * (sign * s)), &stiff)? {
                    Some((force, _)) if force.abs() <= least => reach = s,
                    Some((_, there)) => return Ok(Side::Ends(reach, pieces(self.model, &there) == here)),
                    None => return Ok(Side::Ends(reach, false)),
                }
                s = (2.0 * s).min(s + STRIDE);
            }
            Ok(Side::Never)
        };
        Ok([side(1.0)?, side(-1.0)?])
    }

    /// The force in a direction at a distance, with the stiff directions in balance, and that position;
    /// `None` if it is not found.
    fn left(
        &self,
        left: &DVector<f64>,
        by: &DVector<f64>,
        stiff: &DMatrix<f64>,
    ) -> Result<Option<(f64, M::State)>, EquilibriumError> {
        let constants = self.model.constants().map_err(SolveError::from)?;
        let mut step = by.clone();
        let mut last = f64::INFINITY;
        for _ in 0..CORRECTIONS {
            let mut beside = *self.state;
            let all = &self.statics.tangent.positions * &step;
            beside.q_mut().as_mut_slice().iter_mut().zip(all.iter()).for_each(|(q, d)| *q += d);
            let placed = with_workspace::<M, _>(|memory| {
                project_positions(self.model, &constants, &mut beside, memory)
            });
            let Some(there) = placed
                .ok()
                .and_then(|_| Statics::of(self.model, &beside, &self.statics.tangent.coordinates).ok())
            else {
                return Ok(None);
            };
            if there.tangent.coordinates != self.statics.tangent.coordinates {
                return Ok(None);
            }
            let correction = stiff * &there.force;
            let size = correction.amax();
            if size == 0.0 || size >= 0.5 * last {
                return Ok(Some((left.dot(&there.force), beside)));
            }
            last = size;
            step -= correction;
        }
        Ok(None)
    }
}
