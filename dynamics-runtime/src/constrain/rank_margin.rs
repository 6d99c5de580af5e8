//! How far constraints are from losing rank, and who would lose it.

use alloc::vec;
use alloc::vec::Vec;

use super::active_set::{active, active_rows};
use super::assemble::{nearby_on_constraints, weigh};
use super::gradients::{Gradients, mass};
use super::with_workspace;
use crate::declaration::TopContributors;
use crate::linalg::Svd;
use crate::math;
use crate::model::{Constraints, Known, ModelState, Vector};

/// Singular values below this part of the largest are zero for a count of rank: a position is itself known to
/// √ε at best where they vanish.
const RANK_TOLERANCE: f64 = 1e-7;

/// The singular values of Φ_q, with coordinates measured by √Mᵢᵢ and the rows of a constraint by the longest
/// of them, at a state.
///
/// Constraints that repeat others have fewer than rows: what counts is the rank that they have beside the
/// state.
pub(crate) struct RankMargin {
    /// Largest over smallest of as many singular values as the constraints have independent rows elsewhere;
    /// infinite where one is 0.
    pub(crate) condition: f64,
    /// The rows that nearly depend on each other.
    pub(crate) rows: TopContributors,
    /// The coordinates that they nearly leave open.
    pub(crate) coordinates: TopContributors,
}

/// [`RankMargin`] at a state; of nobody where nothing holds or a value is not finite.
pub(crate) fn rank_margin<M: Constraints>(model: &M, state: &M::State) -> RankMargin {
    margin_of(model, state, None)
}

/// [`RankMargin`] against another state of the motion: rows of a constraint are measured by what the longest of
/// them is there, if it is longer. Scaled by itself a single row has length 1 wherever it has any, up to the
/// position where its gradient vanishes.
pub(crate) fn rank_margin_against<M: Constraints>(
    model: &M,
    usual: &M::State,
    state: &M::State,
) -> RankMargin {
    margin_of(model, state, Some(usual))
}

fn margin_of<M: Constraints>(model: &M, state: &M::State, usual: Option<&M::State>) -> RankMargin {
    let no_one = |margin_of| TopContributors::ranked(margin_of, core::iter::empty());
    let nobody = || RankMargin { condition: 1.0, rows: no_one(M::ROWS), coordinates: no_one(M::COORDINATES) };
    if M::IS_FREE {
        return nobody();
    }
    margin_if_finite(model, state, usual).unwrap_or_else(nobody)
}

/// [`RankMargin::condition`] alone, of many states.
pub(crate) fn gradient_condition<M: Constraints>(model: &M, state: &M::State) -> f64 {
    if M::IS_FREE {
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
    let vanishes = |j: usize| gradient_svd.sigma[j] <= RANK_TOLERANCE * largest;
    // Where more than one is lost, all who take part.
    let lost: Vec<usize> =
        match order[..expected_rank].iter().copied().filter(|j| vanishes(*j)).collect::<Vec<_>>() {
            no_one if no_one.is_empty() => vec![weak_index],
            some => some,
        };
    let in_rows = |i: usize| lost.iter().map(|j| math::powi(gradient_svd.svd().right(*j)[i], 2)).sum::<f64>();
    let rows = TopContributors::ranked(
        M::ROWS,
        gradient_svd.rows.iter().enumerate().map(|(i, row)| (*row, in_rows(i))),
    );
    let n = M::Vector::LEN;
    let mut shares = vec![0.0; n];
    if least > 1e-12 * largest && !vanishes(weak_index) {
        shares.iter_mut().zip(gradient_svd.svd().column(weak_index)).for_each(|(out, x)| *out = x / least);
    } else {
        // Rounding says nothing of the direction: what the others leave open.
        let held =
            |i: usize, j: &usize| math::powi(gradient_svd.svd().column(*j)[i] / gradient_svd.sigma[*j], 2);
        let strong = || order.iter().filter(|j| !vanishes(**j));
        shares
            .iter_mut()
            .enumerate()
            .for_each(|(i, out)| *out = 1.0 - strong().map(|j| held(i, j)).sum::<f64>());
    }
    let coordinates = TopContributors::ranked(M::COORDINATES, shares.iter().copied().enumerate());
    Some(RankMargin { condition: singular_range.condition(), rows, coordinates })
}

/// Rank of the constraints where their manifold is regular: the number of rows, unless some are declared to
/// repeat others.
fn independent_rows<M: Constraints>(model: &M, state: &M::State, here: &GradientSvd) -> usize {
    if !M::CONSTRAINTS.iter().any(|constraint| constraint.redundant) {
        return here.rows.len();
    }
    let rank_here = here.rank();
    let nearby_state = with_workspace::<M, _>(|workspace| nearby_on_constraints(model, state, workspace));
    let nearby_state = nearby_state.and_then(|nearby_state| GradientSvd::new(model, &nearby_state, None));
    nearby_state.map_or(rank_here, |nearby_state| nearby_state.rank().max(rank_here))
}

/// The largest singular value, and the least of as many as there are independent rows, with its index.
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

/// Φ_qᵀ, scaled and decomposed.
struct GradientSvd {
    rows: Vec<usize>,
    a: Vec<f64>,
    v: Vec<f64>,
    sigma: Vec<f64>,
    /// What the largest singular value counts as at least.
    least_largest: f64,
}

/// Φ_q of the rows that hold at a state, at the positions of another, coordinates measured by √Mᵢᵢ.
fn scaled_gradients<M: Constraints>(model: &M, at: &M::State, held: &M::State) -> Vec<f64> {
    let n = M::Vector::LEN;
    with_workspace::<M, _>(|workspace| {
        let mut weights: Vec<f64> = mass(model, at, workspace).iter().step_by(n + 1).copied().collect();
        weigh(&mut weights);
        let gradients = Gradients::alone(model, at, workspace);
        let rows = active_rows::<M>(held.modes(), false);
        rows.flat_map(|row| gradients.row(row).iter().zip(&weights).map(|(x, weight)| x / weight)).collect()
    })
}

impl GradientSvd {
    /// With the lengths of rows as they are at a `usual` state, where they are longer there.
    fn new<M: Constraints>(model: &M, state: &M::State, usual: Option<&M::State>) -> Option<Self> {
        let n = M::Vector::LEN;
        let rows: Vec<usize> = active_rows::<M>(state.modes(), false).collect();
        let mut a = scaled_gradients(model, state, state);
        let elsewhere = usual.map(|usual| scaled_gradients(model, usual, state));
        let mut first = 0;
        for constraint in active::<M>(state.modes(), false) {
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
        let least_largest = if usual.is_some() { 1.0 } else { 0.0 };
        Some(Self { rows, a, v, sigma, least_largest })
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

    /// Of `expected_rank` singular values in this order; `None` where nothing holds.
    fn singular_range(&self, order: &[usize], expected_rank: usize) -> Option<SingularRange> {
        let weak_index = *order.get(expected_rank.checked_sub(1)?)?;
        Some(SingularRange {
            largest: math::max(self.sigma[order[0]], self.least_largest),
            least: self.sigma[weak_index],
            weak_index,
        })
    }

    fn rank(&self) -> usize {
        let largest = self.sigma.iter().copied().fold(0.0, f64::max);
        self.sigma.iter().filter(|sigma| **sigma > RANK_TOLERANCE * largest).count()
    }
}
