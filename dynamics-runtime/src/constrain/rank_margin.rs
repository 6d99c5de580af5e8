//! How far constraints are from losing rank, and which rows and coordinates would be affected.
//!
//! The measure is the condition number of Φ_q, largest over smallest singular value, with coordinates scaled
//! by √Mᵢᵢ and the rows of a constraint by the longest of them. The left singular vector of the
//! smallest singular value names the rows that come to depend on each other, the right one the coordinates
//! that they leave open.

use alloc::vec;
use alloc::vec::Vec;

use super::active_set::{active, active_rows};
use super::assemble::{nearby_on_constraints, weigh};
use super::gradients::{Gradients, mass};
use super::{SINGULAR_VALUE_TOLERANCE, with_workspace};
use crate::declaration::TopContributors;
use crate::linalg::Svd;
use crate::math;
use crate::model::{Constraints, ModelState, StaticTraits, Vector};

/// A singular value up to this part of the largest is rounding, and its right singular vector too.
const ROUNDED_SINGULAR_VALUE: f64 = 1e-12;

/// Conditioning of Φ_q at a state, with coordinates scaled by √Mᵢᵢ and the rows of a constraint by the
/// longest of them.
///
/// Redundant constraints have fewer independent rows than rows. What counts is the rank that they have at a
/// nearby state.
pub(crate) struct RankMargin {
    /// Largest over smallest singular value, of as many as there are independent rows elsewhere. Infinite
    /// where one is 0.
    pub(crate) condition: f64,
    /// The rows that nearly depend on each other.
    pub(crate) rows: TopContributors,
    /// The coordinates that they nearly leave open.
    pub(crate) coordinates: TopContributors,
}

/// [`RankMargin`] at a state; 1 and no names where no constraint is active or a value is not finite.
pub(crate) fn rank_margin<M: Constraints>(model: &M, state: &M::State) -> RankMargin {
    margin_of(model, state, None)
}

/// [`RankMargin`] against another state of the motion. Rows of a constraint are divided by their greatest
/// length at either state. Scaled by itself, a single row has length 1 at every position but
/// the one where its gradient vanishes.
pub(crate) fn rank_margin_against<M: Constraints>(
    model: &M,
    usual: &M::State,
    state: &M::State,
) -> RankMargin {
    margin_of(model, state, Some(usual))
}

fn margin_of<M: Constraints>(model: &M, state: &M::State, usual: Option<&M::State>) -> RankMargin {
    let no_contributors = |of| TopContributors::ranked(of, core::iter::empty());
    let no_margin = || RankMargin {
        condition: 1.0,
        rows: no_contributors(M::ROWS),
        coordinates: no_contributors(M::COORDINATES),
    };
    if M::IS_UNCONSTRAINED {
        return no_margin();
    }
    margin_if_finite(model, state, usual).unwrap_or_else(no_margin)
}

/// [`RankMargin::condition`] without the names, for callers that evaluate many states.
pub(crate) fn gradient_condition<M: Constraints>(model: &M, state: &M::State) -> f64 {
    if M::IS_UNCONSTRAINED {
        return 1.0;
    }
    let found = GradientSvd::new(model, state, None).and_then(|gradient_svd| {
        let expected_rank = independent_rows(model, state, &gradient_svd);
        Some(gradient_svd.singular_range(&gradient_svd.order(), expected_rank)?.condition())
    });
    found.unwrap_or(1.0)
}

fn margin_if_finite<M: Constraints>(
    model: &M,
    state: &M::State,
    usual: Option<&M::State>,
) -> Option<RankMargin> {
    let gradient_svd = GradientSvd::new(model, state, usual)?;
    let order = gradient_svd.order();
    let expected_rank = independent_rows(model, state, &gradient_svd);
    let singular_range = gradient_svd.singular_range(&order, expected_rank)?;
    let SingularRange { largest, least, weak_index } = singular_range;
    let vanishes = |j: usize| gradient_svd.sigma[j] <= SINGULAR_VALUE_TOLERANCE * largest;
    // Rows: where several directions are lost, the contributions to all of them.
    let lost_directions: Vec<usize> =
        match order[..expected_rank].iter().copied().filter(|j| vanishes(*j)).collect::<Vec<_>>() {
            lost if lost.is_empty() => vec![weak_index],
            lost => lost,
        };
    let row_share = |i: usize| {
        lost_directions.iter().map(|j| math::powi(gradient_svd.svd().right(*j)[i], 2)).sum::<f64>()
    };
    let rows = TopContributors::ranked(
        M::ROWS,
        gradient_svd.rows.iter().enumerate().map(|(i, row)| (*row, row_share(i))),
    );
    // Coordinates: the right singular vector of the smallest singular value, if that is not rounding.
    let n = M::Vector::LEN;
    let mut shares = vec![0.0; n];
    if least > ROUNDED_SINGULAR_VALUE * largest && !vanishes(weak_index) {
        shares.iter_mut().zip(gradient_svd.svd().column(weak_index)).for_each(|(out, x)| *out = x / least);
    } else {
        // Otherwise the part of each coordinate that the other directions do not reach.
        let held =
            |i: usize, j: &usize| math::powi(gradient_svd.svd().column(*j)[i] / gradient_svd.sigma[*j], 2);
        let kept_directions = || order.iter().filter(|j| !vanishes(**j));
        shares
            .iter_mut()
            .enumerate()
            .for_each(|(i, out)| *out = 1.0 - kept_directions().map(|j| held(i, j)).sum::<f64>());
    }
    let coordinates = TopContributors::ranked(M::COORDINATES, shares.iter().copied().enumerate());
    Some(RankMargin { condition: singular_range.condition(), rows, coordinates })
}

/// Rank of the constraints where their manifold is regular: the number of rows, unless some are declared
/// redundant.
fn independent_rows<M: Constraints>(model: &M, state: &M::State, here: &GradientSvd) -> usize {
    if !M::CONSTRAINTS.iter().any(|constraint| constraint.redundant) {
        return here.rows.len();
    }
    let rank_here = here.rank();
    let nearby_state = with_workspace::<M, _>(|workspace| nearby_on_constraints(model, state, workspace));
    let nearby_state = nearby_state.and_then(|nearby_state| GradientSvd::new(model, &nearby_state, None));
    nearby_state.map_or(rank_here, |nearby_state| nearby_state.rank().max(rank_here))
}

/// The largest singular value, and the smallest of as many as there are independent rows, with its index.
struct SingularRange {
    largest: f64,
    least: f64,
    weak_index: usize,
}

impl SingularRange {
    fn condition(&self) -> f64 {
        if self.least > 0.0 { self.largest / self.least } else { f64::INFINITY }
    }
}

/// Singular value decomposition of Φ_qᵀ in scaled coordinates and rows.
struct GradientSvd {
    rows: Vec<usize>,
    a: Vec<f64>,
    v: Vec<f64>,
    sigma: Vec<f64>,
    /// 1, the length of a usual row, where rows are scaled by usual lengths; otherwise 0. The largest
    /// singular value counts as no smaller.
    scale: f64,
}

/// Φ_q at `at` of the rows that are active in `held`, coordinates scaled by √Mᵢᵢ.
fn scaled_gradients<M: Constraints>(model: &M, at: &M::State, held: &M::State) -> Vec<f64> {
    let n = M::Vector::LEN;
    with_workspace::<M, _>(|workspace| {
        let mut weights: Vec<f64> = mass(model, at, workspace).iter().step_by(n + 1).copied().collect();
        weigh(&mut weights);
        let gradients = Gradients::alone(model, at, workspace);
        let rows = active_rows::<M>(held.active_set(), false);
        rows.flat_map(|row| gradients.row(row).iter().zip(&weights).map(|(x, weight)| x / weight)).collect()
    })
}

impl GradientSvd {
    /// Decomposes Φ_qᵀ. Rows are divided by their greatest length at either state, if there is a `usual` one.
    fn new<M: Constraints>(model: &M, state: &M::State, usual: Option<&M::State>) -> Option<Self> {
        let n = M::Vector::LEN;
        let rows: Vec<usize> = active_rows::<M>(state.active_set(), false).collect();
        let mut a = scaled_gradients(model, state, state);
        let elsewhere = usual.map(|usual| scaled_gradients(model, usual, state));
        let mut first = 0;
        for constraint in active::<M>(state.active_set(), false) {
            let of_constraint = first..first + constraint.rows * n;
            let length = |row: &[f64]| math::sqrt(row.iter().map(|x| x * x).sum());
            let longest =
                |a: &[f64]| a[of_constraint.clone()].chunks_exact(n).map(length).fold(0.0, f64::max);
            let longest = math::max(longest(&a), elsewhere.as_deref().map_or(0.0, longest));
            if longest > 0.0 {
                a[of_constraint.clone()].iter_mut().for_each(|x| *x /= longest);
            }
            first = of_constraint.end;
        }
        if rows.is_empty() || a.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let m = rows.len();
        let (mut v, mut sigma) = (vec![0.0; m * m], vec![0.0; m]);
        Svd::new(n, &mut a, &mut v, &mut sigma);
        let scale = if usual.is_some() { 1.0 } else { 0.0 };
        Some(Self { rows, a, v, sigma, scale })
    }

    fn svd(&self) -> Svd<'_> {
        Svd { a: &self.a, v: &self.v, sigma: &self.sigma, m: self.a.len() / self.sigma.len() }
    }

    /// Indices of the singular values, the largest first.
    fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.sigma.len()).collect();
        order.sort_by(|i, j| self.sigma[*j].total_cmp(&self.sigma[*i]));
        order
    }

    /// The range of the first `expected_rank` singular values in this order; `None` where no constraint is
    /// active.
    fn singular_range(&self, order: &[usize], expected_rank: usize) -> Option<SingularRange> {
        let weak_index = *order.get(expected_rank.checked_sub(1)?)?;
        Some(SingularRange {
            largest: math::max(self.sigma[order[0]], self.scale),
            least: self.sigma[weak_index],
            weak_index,
        })
    }

    /// Number of singular values above rounding.
    fn rank(&self) -> usize {
        let largest = self.sigma.iter().copied().fold(0.0, f64::max);
        self.sigma.iter().filter(|sigma| **sigma > SINGULAR_VALUE_TOLERANCE * largest).count()
    }
}
