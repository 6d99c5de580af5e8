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

use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraints, Kink, MAX_KINKS, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use super::EquilibriumError;
use super::balanced_svd::BalancedSvd;
use super::rounding::FORCE_NOISE_FACTOR;
use super::statics::{Statics, scales};
use crate::displacement::{displaced, projected, size_in_scales};

/// Directions whose singular value of the balanced K is below this share of the largest are soft and are
/// followed. A larger value follows directions that K describes well, which costs time. A smaller one trusts
/// K within 10⁻⁵ of a critical load, where forces of third order matter.
const SOFT_SINGULAR_VALUE: f64 = 1e-6;
/// Directions along which rounding of forces would move the position by more than this, in the scales of the
/// coordinates, are followed, too.
const MAX_TRUSTED_DISPLACEMENT: f64 = 1e-3;
/// The first distance along a soft direction, in the scales of the coordinates: about a thousand rounding
/// units.
const FIRST_DISTANCE: f64 = 1e-13;
/// The last distance, in the scales of the coordinates. If the force is only rounding up to here, the
/// direction counts as a continuum of equilibria.
const LAST_DISTANCE: f64 = 2.0;
/// Distances are doubled, but grow by no more than this, so that a force over a twentieth of the scale is not
/// passed over.
const MAX_DISTANCE_STEP: f64 = 0.05;
/// If the force vanishes at all of these distances, it vanishes everywhere nearby. The last two may reduce a
/// coordinate to zero, where forces may be singular.
const NEARBY_PROBES: [f64; 6] = [-0.05, 0.05, -0.4, 0.4, -1.0, 1.0];
/// If the force vanishes nearby, positions far away are sampled: values of the leading coordinate between
/// these powers of ten of its unit, to both sides of zero.
const FAR_DECADES: [i32; 2] = [-9, 9];
/// Number of these positions in each decade: neighbours differ by a factor of 1.8. A force that acts over a
/// narrower interval than that is missed.
const FAR_PROBES_PER_DECADE: i32 = 4;
/// Largest number of corrections of the stiff directions at each distance. They converge linearly with a
/// fixed matrix, and end as soon as they are not halved.
const MAX_CORRECTIONS: usize = 6;
/// Forces above this multiple of their noise are significant. The factor is smaller than that of balance,
/// because a force that is taken for rounding would extend the uncertainty of the position.
const SIGNIFICANT_FORCE_FACTOR: f64 = 4.0;

/// How far a force is only rounding, to one side of a position.
enum RoundingExtent {
    /// Up to this distance. The second value says whether the model kept its branches up to the first
    /// significant force.
    Ends(f64, bool),
    /// As far as the search went.
    Unbounded,
}

/// The index of the largest value.
fn largest(values: impl Iterator<Item = f64>) -> usize {
    values.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
}

/// The intervals in which each switching function of the model keeps its branch.
fn smooth_intervals<M: Constraints>(model: &M, state: &M::State) -> [[f64; 2]; MAX_KINKS] {
    let mut kinks = [Kink::NONE; MAX_KINKS];
    model.kinks(state, &mut kinks);
    kinks.map(|kink| kink.smooth)
}

/// An equilibrium with the factors of its stiffness, from which soft directions are followed.
pub(super) struct SoftDirections<'a, M: Constraints> {
    pub(super) model: &'a M,
    pub(super) state: &'a M::State,
    pub(super) statics: &'a Statics<M::Rows>,
    pub(super) factors: &'a BalancedSvd,
    pub(super) noise: &'a DVector<f64>,
}

impl<M: Constraints> SoftDirections<'_, M> {
    /// The uncertainty of the independent coordinates along all soft directions.
    pub(super) fn reach(&self) -> Result<DVector<f64>, EquilibriumError> {
        use RoundingExtent::{Ends, Unbounded};

        let mut reach = DVector::zeros(self.statics.stiffness.ncols());
        let sigma = &self.factors.svd.singular_values;
        let (Some(u), Some(v_t)) = (&self.factors.svd.u, &self.factors.svd.v_t) else { return Ok(reach) };
        let scales = scales(M::COORDINATES, self.state.q().as_slice());
        for k in 0..sigma.len() {
            let left = u.column(k).component_mul(&self.factors.rows);
            let along = v_t.row(k).transpose().component_mul(&self.factors.columns);
            let all = &self.statics.tangent.positions * &along;
            let size = size_in_scales(&all, &scales);
            // If K is zero, all directions are soft.
            let is_soft = sigma[k] <= SOFT_SINGULAR_VALUE * sigma.amax()
                || left.abs().dot(self.noise) / sigma[k] * size > MAX_TRUSTED_DISPLACEMENT;
            if !is_soft || size <= 0.0 || !size.is_finite() {
                continue;
            }
            let extent = match self.extents(&left, &(&along / size), k)? {
                // A continuum of equilibria, unless forces act far away.
                [Unbounded, Unbounded] if self.depends_far_away(&(&all / size))? => {
                    return Err(self.faded(&all, &scales));
                }
                [Unbounded, Unbounded] => 0.0,
                // An isolated equilibrium.
                [Ends(a, _), Ends(b, _)] => a.max(b),
                // Forces act to one side only, without a change of branch: to the other side they have faded.
                [Ends(_, true), _] | [_, Ends(_, true)] => return Err(self.faded(&all, &scales)),
                // Another branch of the model begins to one side.
                [Ends(a, _), _] | [_, Ends(a, _)] => a,
            };
            reach += along.abs() * (extent / size);
        }
        Ok(reach)
    }

    /// The error if forces have faded below rounding along a direction.
    fn faded(&self, all: &DVector<f64>, scales: &[f64]) -> EquilibriumError {
        let i = largest(all.iter().zip(scales).map(|(x, scale)| x.abs() / scale));
        EquilibriumError::Faded { coordinate: M::COORDINATES[i].name, value: self.state.q().as_slice()[i] }
    }

    /// Whether no force changes nearby along the direction `all`, but one changes far away, without a change
    /// of branch in between. The search goes along a straight line without corrections, so that it leaves a
    /// curved continuum of equilibria at once.
    fn depends_far_away(&self, all: &DVector<f64>) -> Result<bool, EquilibriumError> {
        let moved = |s: f64| displaced(self.state, &(all * s));
        let here = self.statics.force_nearby(self.model, self.state)?;
        // A force that is not finite gives no information.
        let changes = |nearby: &M::State| -> bool {
            let Ok(there) = self.statics.force_nearby(self.model, nearby) else { return false };
            let change = (&there - &here).abs();
            let exceeds = |factor: f64, noise: &DVector<f64>| {
                change.iter().zip(noise.iter()).any(|(change, noise)| *change > factor * noise)
            };
            exceeds(SIGNIFICANT_FORCE_FACTOR, self.noise)
                // Large coordinates are rounded more coarsely.
                && self
                    .statics
                    .noise_of_sums(self.model, nearby)
                    .is_ok_and(|noise| exceeds(FORCE_NOISE_FACTOR, &noise))
        };
        if NEARBY_PROBES[..4].iter().any(|s| changes(&moved(*s))) {
            return Ok(false);
        }
        let i = all.iamax();
        let (from, along) = (self.state.q().as_slice()[i], all[i]);
        let intervals_here = smooth_intervals(self.model, self.state);
        let sizes = (FAR_PROBES_PER_DECADE * FAR_DECADES[0]..=FAR_PROBES_PER_DECADE * FAR_DECADES[1])
            .map(|k| 10.0_f64.powf(f64::from(k) / f64::from(FAR_PROBES_PER_DECADE)));
        let places = sizes.flat_map(|size| [size, -size]).map(|place| moved((place - from) / along));
        Ok(places
            .into_iter()
            .any(|nearby| changes(&nearby) && smooth_intervals(self.model, &nearby) == intervals_here))
    }

    /// How far the force along a direction is only rounding, to both sides.
    fn extents(
        &self,
        left: &DVector<f64>,
        along: &DVector<f64>,
        own: usize,
    ) -> Result<[RoundingExtent; 2], EquilibriumError> {
        // The residual counts as rounding, too.
        let least =
            SIGNIFICANT_FORCE_FACTOR * left.abs().dot(self.noise).max(left.dot(&self.statics.force).abs());
        let stiff = self.factors.inverse_without(SOFT_SINGULAR_VALUE, own);
        // Cyclic coordinates are soft. A few probes recognise them, without a search.
        let mut vanishes = true;
        for s in NEARBY_PROBES {
            let force = if vanishes { self.force_along(left, &(along * s), &stiff)? } else { None };
            vanishes &= force.is_some_and(|(force, _)| force.abs() <= least);
        }
        if vanishes {
            return Ok([RoundingExtent::Unbounded, RoundingExtent::Unbounded]);
        }
        let here = smooth_intervals(self.model, self.state);
        let side = |sign: f64| -> Result<RoundingExtent, EquilibriumError> {
            let (mut s, mut reach) = (FIRST_DISTANCE, 0.0);
            while s <= LAST_DISTANCE {
                match self.force_along(left, &(along * (sign * s)), &stiff)? {
                    Some((force, _)) if force.abs() <= least => reach = s,
                    Some((_, there)) => {
                        return Ok(RoundingExtent::Ends(reach, smooth_intervals(self.model, &there) == here));
                    }
                    None => return Ok(RoundingExtent::Ends(reach, false)),
                }
                s = (2.0 * s).min(s + MAX_DISTANCE_STEP);
            }
            Ok(RoundingExtent::Unbounded)
        };
        Ok([side(1.0)?, side(-1.0)?])
    }

    /// The force along a direction at a displacement `by`, with the stiff directions in balance, and that
    /// position. `None` if it is not found.
    fn force_along(
        &self,
        left: &DVector<f64>,
        by: &DVector<f64>,
        stiff: &DMatrix<f64>,
    ) -> Result<Option<(f64, M::State)>, EquilibriumError> {
        let constants = self.model.constants().map_err(SolveError::from)?;
        let mut step = by.clone();
        let mut last = f64::INFINITY;
        for _ in 0..MAX_CORRECTIONS {
            let all = &self.statics.tangent.positions * &step;
            let Ok(nearby) = projected(self.model, &constants, displaced(self.state, &all)) else {
                return Ok(None);
            };
            let Ok(there) = Statics::of(self.model, &nearby, &self.statics.tangent.coordinates) else {
                return Ok(None);
            };
            if there.tangent.coordinates != self.statics.tangent.coordinates {
                return Ok(None);
            }
            let correction = stiff * &there.force;
            let size = correction.amax();
            if size == 0.0 || size >= 0.5 * last {
                return Ok(Some((left.dot(&there.force), nearby)));
            }
            last = size;
            step -= correction;
        }
        Ok(None)
    }
}
