//! Samples near a place where rows become tangent to each other.
//!
//! Three rods between three beads on one line hold the middle one in its place, but to second order only: Φ
//! has a double root there. Newton's method halves the distance with every step. Φ is its square, and is
//! zero to rounding while dependent rows still look independent. The remainder of such a row without its part
//! along the others, (1 − P)Φ_q, is zero at the root as well, and of first order. Together with Φ it has
//! a simple root, which is found to rounding (deflation; Leykin, Verschelde and Zhao 2006).

use super::manifold;
use super::newton::{ON_MANIFOLD, Plane, Projection, solve};
use super::orthogonal::{Basis, norm};
use super::sample::{Sample, random};

/// Largest remainder of a row that may be tangent to others, where Φ is up to 1e-12. The remainder is about
/// the distance to the place of tangency, which may be 1e-6 where Φ² is 1e-12.
const SUSPECT_REST: f64 = 1e-4;
/// Largest remainder of a row that repeats others. It is about the distance to the manifold, 1e-12.
const REPEATED_REST: f64 = 1e-10;
/// Distance, relative to the coordinates' sizes, beyond which a root is not the one that the state
/// approached.
const FARTHEST_ROOT: f64 = 1e-2;
/// Most steps of the Gauss–Newton method towards the root.
const MOST_ITERATIONS: usize = 40;
/// |f| at which the root is found to rounding, about 5 ε.
const AT_ROOT: f64 = 1e-15;
/// Regularisation of SᵀS relative to its largest element. It keeps directions that S does not contain at
/// rest, and is below the squares of slopes that count, 1e-8.
const REGULARIZATION: f64 = 1e-12;
/// Step of central differences, relative to the coordinates' sizes. Their error is about its square, 1e-10.
const DIFFERENCE: f64 = 1e-5;
/// Largest remainder of tangent rows at the root. Central differences have an error of 1e-10.
const LARGEST_REST_AT_ROOT: f64 = 1e-9;
/// Smallest slope, relative to the largest, that holds a direction at the root. What is not clearly above the
/// error of differences holds nothing.
const LEAST_HOLDING_SLOPE: f64 = 1e-4;
/// Distance from a place of tangency, relative to the coordinates' sizes, at which a regular state is
/// searched.
const ASIDE: f64 = 0.1;
/// Random directions in which it is searched. One that leads to a regular state is enough.
const DIRECTIONS: u64 = 12;

/// Most times that the coordinates of a row are drawn until it holds, is not tangent and is independent. With
/// nine windows one draw in 25 succeeds, for each of the rows that close a window.
const MOST_DRAWS: u64 = 128;

/// A place where rows are tangent.
pub(super) struct Tangent {
    /// The place, to rounding.
    pub(super) sample: Sample,
    /// The rows that lose their own direction there.
    pub(super) rows: Vec<usize>,
    /// Coordinates less the dimension of the set of states in which Φ = 0 around it: more than the rank of
    /// Φ_q.
    pub(super) held: usize,
}

impl Projection<'_> {
    /// A state on the manifold in which no row is tangent, by one row after another: some of its coordinates
    /// are thrown anew until it holds, none of the rows so far is tangent, and it is independent of them, if
    /// it can be. The throws of all rows add up then; those of a start for all rows at once would multiply.
    pub(super) fn row_by_row(&self, mut state: Sample, start: u64) -> Option<Sample> {
        let mut buffer = Vec::new();
        let mut rank = 0;
        for (row, coordinates) in self.chosen.iter().enumerate().map(|(i, r)| (i, &self.rows.jacobian[*r])) {
            let part = Self::new(self.rows, &self.chosen[..=row], self.scale.clone());
            let mut thrown = |throw: u64| {
                let mut next = state.clone();
                let random = |kind: u64, j: usize| {
                    random((0xb00 + start) * MOST_DRAWS + throw, (3 * row as u64 + kind) << 32 | j as u64)
                };
                let chosen = coordinates.iter().map(|(j, _)| *j).filter(|j| throw > 0 && random(0, *j) < 0.5);
                chosen.for_each(|j| next.q[j] = self.scale[j] * (2.0 * random(1, j) - 1.0));
                let residual = part.descend(&mut next, &mut buffer)?;
                let there = residual.iter().all(|x| x.abs() <= ON_MANIFOLD);
                (there && part.is_regular(&next)).then_some(next)
            };
            let mut found = None;
            for next in (0..MOST_DRAWS).filter_map(&mut thrown) {
                let own = manifold::rank(self.rows, &next, &part.chosen);
                if found.as_ref().is_none_or(|(most, _)| own > *most) {
                    found = Some((own, next));
                }
                if own > rank {
                    break;
                }
            }
            (rank, state) = found?;
        }
        Some(state)
    }

    /// Whether at a state on the manifold no row is near to being tangent.
    pub(super) fn is_regular(&self, state: &Sample) -> bool {
        TangencySystem::beside(self, state).is_none()
    }

    /// The place near a state on the manifold where rows are tangent; `None` without such a place.
    pub(super) fn tangent(&self, state: &Sample) -> Option<Tangent> {
        let mut search = TangencySystem::beside(self, state)?;
        let mut place = state.clone();
        let mut values = search.values(&place);
        for _ in 0..MOST_ITERATIONS {
            if norm(&values) <= AT_ROOT {
                break;
            }
            let slopes = search.slopes(&place);
            let step = least(&slopes, &values)?;
            let mut next = place.clone();
            next.q.iter_mut().zip(&step).zip(&self.scale).for_each(|((q, s), d)| *q += s * d);
            let there = search.values(&next);
            // Not a number is not less either.
            if norm(&there) < norm(&values) {
                (place, values) = (next, there);
            } else {
                break;
            }
        }
        let moved = place
            .q
            .iter()
            .zip(&state.q)
            .zip(&self.scale)
            .all(|((a, b), d)| (a - b).abs() <= FARTHEST_ROOT * d);
        let (own, left) = values.split_at(self.chosen.len());
        if !moved || norm(own) > ON_MANIFOLD || norm(left) > LARGEST_REST_AT_ROOT {
            return None;
        }
        let held = rank(&search.slopes(&place));
        let rows = search.tangent.iter().map(|i| self.chosen[*i]).collect();
        Some(Tangent { sample: place, rows, held })
    }

    /// A state on the manifold, not far from a place where rows are tangent, at which none is: the place is
    /// then a singular position on the way, as change points and dead points are, and says nothing of the
    /// mechanism as such. Newton's method ends in such places from whole regions of starts where rows repeat
    /// others: of x y = 0 and y² = 0 it halves x and y with every step. So it is kept away from the place.
    pub(super) fn beside(&self, place: &Tangent) -> Option<Sample> {
        let mut buffer = Vec::new();
        let mut basis = Basis::default();
        let there = self.local(&place.sample, &mut buffer);
        there.jacobian.iter().enumerate().for_each(|(i, row)| drop(basis.add(i, row)));
        let free = basis.complement(self.scale.len());
        (0..DIRECTIONS).find_map(|k| {
            let mut direction = vec![0.0; self.scale.len()];
            for (i, axis) in free.iter().enumerate() {
                let part = 2.0 * random(0xa00 + k, i as u64) - 1.0;
                direction.iter_mut().zip(axis).for_each(|(s, d)| *s += part * d);
            }
            let length = norm(&direction);
            direction.iter_mut().for_each(|d| *d /= length);
            let mut state = place.sample.clone();
            let moved = state.q.iter_mut().zip(&direction).zip(&self.scale);
            moved.for_each(|((q, d), s)| *q += ASIDE * s * d);
            let plane = Plane { from: place.sample.q.clone(), direction, distance: ASIDE };
            let residual = self.on(plane).descend(&mut state, &mut buffer)?;
            let there = residual.iter().all(|x| x.abs() <= ON_MANIFOLD);
            let near =
                state.q.iter().zip(&place.sample.q).zip(&self.scale).all(|((a, b), d)| (a - b).abs() <= *d);
            (there && near && self.is_regular(&state)).then_some(state)
        })
    }
}

/// Φ and what is left of the rows that may be tangent.
struct TangencySystem<'p, 'r> {
    projection: &'p Projection<'r>,
    weight: Vec<f64>,
    /// The rows that are independent of those before them by far, by their place among the chosen.
    independent: Vec<usize>,
    tangent: Vec<usize>,
    buffer: Vec<f64>,
}

impl<'p, 'r> TangencySystem<'p, 'r> {
    fn beside(projection: &'p Projection<'r>, state: &Sample) -> Option<Self> {
        let mut buffer = Vec::new();
        let local = projection.local(state, &mut buffer);
        let mut search =
            Self { projection, weight: local.weights(), independent: vec![], tangent: vec![], buffer };
        let mut basis = Basis::default();
        for (i, row) in local.jacobian.iter().enumerate() {
            let left = norm(&basis.rest(row).0);
            if left > SUSPECT_REST {
                basis.add(i, row);
                search.independent.push(i);
            } else if left > REPEATED_REST {
                search.tangent.push(i);
            }
        }
        (!search.tangent.is_empty()).then_some(search)
    }

    fn values(&mut self, state: &Sample) -> Vec<f64> {
        let local = self.projection.local(state, &mut self.buffer);
        let mut basis = Basis::default();
        self.independent.iter().for_each(|i| drop(basis.add(*i, &local.jacobian[*i])));
        let left = self.tangent.iter().flat_map(|i| basis.rest(&local.jacobian[*i]).0);
        local.weighted(&self.weight).into_iter().chain(left).collect()
    }

    /// Derivatives by the coordinates in their sizes, by columns.
    fn slopes(&mut self, state: &Sample) -> Vec<Vec<f64>> {
        let mut beside = |j: usize, side: f64| {
            let mut there = state.clone();
            there.q[j] += side * DIFFERENCE * self.projection.scale[j];
            self.values(&there)
        };
        let column = |j: usize| {
            let (ahead, behind) = (beside(j, 1.0), beside(j, -1.0));
            ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * DIFFERENCE)).collect()
        };
        (0..state.q.len()).map(column).collect()
    }
}

/// The shortest δ with S δ = −f in the sense of least squares, S given by columns; directions that S does not
/// see stay where they are.
fn least(slopes: &[Vec<f64>], f: &[f64]) -> Option<Vec<f64>> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let mut normal: Vec<Vec<f64>> =
        (0..slopes.len()).map(|i| (0..=i).map(|j| dot(&slopes[i], &slopes[j])).collect()).collect();
    let largest = (0..slopes.len()).fold(0.0f64, |m, i| m.max(normal[i][i]));
    (0..slopes.len()).for_each(|i| normal[i][i] += REGULARIZATION * largest);
    let right: Vec<f64> = slopes.iter().map(|s| -dot(s, f)).collect();
    solve(normal, &right)
}

/// Rank of a matrix of differences, whose smallest entries are errors.
fn rank(columns: &[Vec<f64>]) -> usize {
    let largest = columns.iter().map(|c| norm(c)).fold(0.0, f64::max);
    let mut basis = Basis::default();
    for column in columns.iter().filter(|c| norm(c) > LEAST_HOLDING_SLOPE * largest) {
        if norm(&basis.rest(column).0) > LEAST_HOLDING_SLOPE {
            basis.add(0, column);
        }
    }
    basis.rank()
}
