//! How far constraints are from losing rank, and who would lose it.

use alloc::vec;
use alloc::vec::Vec;

use super::assemble::{beside_on_constraints, weigh};
use super::gradients::{Gradients, mass};
use super::held::{active, active_rows};
use super::with_workspace;
use crate::declaration::Involved;
use crate::linalg::Svd;
use crate::math;
use crate::model::{Constraints, Known, ModelState, Vector};

/// Singular values below this part of the largest are zero for a count of rank: a position is itself known to
/// √ε at best where they vanish.
const RANK: f64 = 1e-7;

/// The singular values of Φ_q, with coordinates measured by √Mᵢᵢ and the rows of a constraint by the longest
/// of them, at a state.
///
/// Constraints that repeat others have fewer than rows: what counts is the rank that they have beside the
/// state.
pub(crate) struct Weakness {
    /// Largest over smallest of as many singular values as the constraints have independent rows elsewhere;
    /// infinite where one is 0.
    pub(crate) condition: f64,
    /// The rows that nearly depend on each other.
    pub(crate) rows: Involved,
    /// The coordinates that they nearly leave open.
    pub(crate) coordinates: Involved,
}

/// [`Weakness`] at a state; of nobody where nothing holds or a value is not finite.
pub(crate) fn weakness<M: Constraints>(model: &M, state: &M::State) -> Weakness {
    of(model, state, None)
}

/// [`Weakness`] against another state of the motion: rows of a constraint are measured by what the longest of
/// them is there, if it is longer. Scaled by itself a single row has length 1 wherever it has any, up to the
/// position where its gradient vanishes.
pub(crate) fn weakness_against<M: Constraints>(model: &M, usual: &M::State, state: &M::State) -> Weakness {
    of(model, state, Some(usual))
}

fn of<M: Constraints>(model: &M, state: &M::State, usual: Option<&M::State>) -> Weakness {
    let none = |of| Involved::ranked(of, core::iter::empty());
    let nobody = || Weakness { condition: 1.0, rows: none(M::ROWS), coordinates: none(M::COORDINATES) };
    if M::IS_FREE {
        return nobody();
    }
    weakest(model, state, usual).unwrap_or_else(nobody)
}

/// [`Weakness::condition`] alone, of many states.
pub(crate) fn condition<M: Constraints>(model: &M, state: &M::State) -> f64 {
    if M::IS_FREE {
        return 1.0;
    }
    let found = GradientSvd::new(model, state, None).and_then(|frame| {
        let full = independent_rows(model, state, &frame);
        Some(frame.spread(&frame.order(), full)?.condition())
    });
    found.unwrap_or(1.0)
}

fn weakest<M: Constraints>(model: &M, state: &M::State, usual: Option<&M::State>) -> Option<Weakness> {
    let frame = GradientSvd::new(model, state, usual)?;
    let order = frame.order();
    let full = independent_rows(model, state, &frame);
    let spread = frame.spread(&order, full)?;
    let Spread { largest, least, weak } = spread;
    let vanishes = |j: usize| frame.sigma[j] <= RANK * largest;
    // Where more than one is lost, all who take part.
    let lost: Vec<usize> = match order[..full].iter().copied().filter(|j| vanishes(*j)).collect::<Vec<_>>() {
        none if none.is_empty() => vec![weak],
        some => some,
    };
    let in_rows = |i: usize| lost.iter().map(|j| math::powi(frame.svd().right(*j)[i], 2)).sum::<f64>();
    let rows = Involved::ranked(M::ROWS, frame.rows.iter().enumerate().map(|(i, row)| (*row, in_rows(i))));
    let n = M::Vector::LEN;
    let mut shares = vec![0.0; n];
    if least > 1e-12 * largest && !vanishes(weak) {
        shares.iter_mut().zip(frame.svd().column(weak)).for_each(|(out, x)| *out = x / least);
    } else {
        // Rounding says nothing of the direction: what the others leave open.
        let held = |i: usize, j: &usize| math::powi(frame.svd().column(*j)[i] / frame.sigma[*j], 2);
        let strong = || order.iter().filter(|j| !vanishes(**j));
        shares
            .iter_mut()
            .enumerate()
            .for_each(|(i, out)| *out = 1.0 - strong().map(|j| held(i, j)).sum::<f64>());
    }
    let coordinates = Involved::ranked(M::COORDINATES, shares.iter().copied().enumerate());
    Some(Weakness { condition: spread.condition(), rows, coordinates })
}

/// Rank of the constraints where their manifold is regular: the number of rows, unless some are declared to
/// repeat others.
fn independent_rows<M: Constraints>(model: &M, state: &M::State, here: &GradientSvd) -> usize {
    if !M::CONSTRAINTS.iter().any(|constraint| constraint.redundant) {
        return here.rows.len();
    }
    let rank_here = here.rank();
    let beside = with_workspace::<M, _>(|workspace| beside_on_constraints(model, state, workspace));
    let beside = beside.and_then(|beside| GradientSvd::new(model, &beside, None));
    beside.map_or(rank_here, |beside| beside.rank().max(rank_here))
}

/// The largest singular value, and the least of as many as there are independent rows, with its index.
struct Spread {
    largest: f64,
    least: f64,
    weak: usize,
}

impl Spread {
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
    unit: f64,
}

/// Φ_q of the rows that hold at a state, at the positions of another, coordinates measured by √Mᵢᵢ.
fn scaled<M: Constraints>(model: &M, at: &M::State, held: &M::State) -> Vec<f64> {
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
        let mut a = scaled(model, state, state);
        let elsewhere = usual.map(|usual| scaled(model, usual, state));
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
        let unit = if usual.is_some() { 1.0 } else { 0.0 };
        Some(Self { rows, a, v, sigma, unit })
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

    /// Of `full` singular values in this order; `None` where nothing holds.
    fn spread(&self, order: &[usize], full: usize) -> Option<Spread> {
        let weak = *order.get(full.checked_sub(1)?)?;
        Some(Spread { largest: math::max(self.sigma[order[0]], self.unit), least: self.sigma[weak], weak })
    }

    fn rank(&self) -> usize {
        let largest = self.sigma.iter().copied().fold(0.0, f64::max);
        self.sigma.iter().filter(|sigma| **sigma > RANK * largest).count()
    }
}
