//! What holds only where the constraints hold: states with Φ = 0 are approached from random starts, and the
//! rows of Φ_q and A are examined there.
//!
//! With nominal values of all parameters that the constraints read, a set that no start satisfies is
//! contradictory. Without them random values are tried. What holds in all states found then holds for the
//! model, and nothing follows if none is found.

use crate::check::unused::Reads;
use crate::graph::{Graph, NodeId, Symbol, Tape};
use crate::mechanics::Model;

use super::newton::{Projection, ProjectionEnd};
use super::orthogonal::{Basis, fraction, norm};
use super::rows::ConstraintRows;
use super::sample::{Sample, random};

/// Random starts of Newton's method.
const STARTS: u64 = 16;
/// States on the manifold after which no further start is made. What holds in all of them is taken to hold on
/// the branch; more states take time and make coincidences rarer.
const ENOUGH_STATES: usize = 5;
/// Further starts where rows are tangent in states that were found, and in none all are independent: such
/// states attract Newton's method. A row of N windows has 3ᴺ branches, and random starts with N = 7 all end
/// on ones with flat windows. So these starts satisfy one row after another, each on a branch without tangent
/// rows.
const STARTS_ROW_BY_ROW: u64 = 4;
/// Distance from the manifold, relative to the size of the parameters, beyond which Newton's method has not
/// just converged slowly: no state satisfies the rows.
const LEAST_GAP: f64 = 1e-3;
/// Residual of a row, relative to the largest residual, up to which the row counts as satisfied where a
/// descent ended. Rows above it are named as excluding each other.
const MISSED_ROWS: f64 = 1e-2;
/// Ratio of the distance |Φ|/‖Φ_q‖ at the closest approach to the residual by the slopes that the last
/// descent began with, beyond which the row is flat there. Value over slope is then no distance: random
/// models reported 2.4e5. The residual is reported instead.
const LARGEST_DISTANCE_RATIO: f64 = 1e2;
/// Most rows that are projected onto the manifold. A step takes R³ operations.
pub(super) const MOST_PROJECTED_ROWS: usize = 60;
/// Ratio of a gradient to the largest one nearby, at distances up to [`AWAY`], below which it counts as
/// vanished. Where Newton's method found Φ² = 0, Φ is 1e-6, and the gradient of Φ² is as small.
const VANISHED_GRADIENT: f64 = 1e-2;
/// Largest step to the places where gradients are compared, as a part of the coordinates' sizes.
const AWAY: f64 = 0.03;
/// Step to both sides of a state, as a part of the coordinates' sizes, between which gradients are compared.
/// Where they are opposite, the row has a kink in between.
const BESIDE_KINK: f64 = 1e-3;
/// Value of a row, relative to what its terms change it by, up to which it is zero where the others hold.
/// States are on the manifold to 1e-12.
const LARGEST_CONSTANT: f64 = 1e-8;

/// Size of a term, relative to the row or sum that it belongs to, up to which it is rounding or the error of
/// a state that satisfies Φ² = 0 to 1e-12: coefficients below it take no part in a relation, and offsets
/// that differ by less agree.
const NEGLIGIBLE: f64 = 1e-6;

/// The manifold of some rows.
#[derive(Clone, Debug, Default)]
pub(super) struct SampledManifold {
    /// States on it.
    pub(super) samples: Vec<Sample>,
    /// At each of them, the number of coordinates less the dimension of the manifold.
    pub(super) held: Vec<usize>,
    /// At each of them, whether rows are tangent.
    places: Vec<bool>,
    /// Rows that at some of them have no direction of their own, though they hold positions that the others
    /// leave free.
    pub(super) tangent: Vec<usize>,
    /// Rows whose gradient vanishes at all of them.
    pub(super) vanishing: Vec<usize>,
    /// Where none was found, at nominal values: the rows that exclude each other, and how far each is missed
    /// by at the closest approach.
    pub(super) nowhere: Option<Vec<(usize, f64)>>,
    /// Whether all parameters that the rows read have nominal values.
    pub(super) nominal: bool,
}

fn largest(residual: &[f64]) -> f64 {
    residual.iter().fold(0.0, |most, x| most.max(x.abs()))
}

/// The rows that are missed where a descent comes closest, and by how much.
fn missed(stuck: Vec<(Projection, Sample, Vec<f64>)>, size: f64) -> Vec<(usize, f64)> {
    let approaches = stuck.into_iter().map(|(projection, state, residual)| {
        let before: Vec<f64> = residual.iter().map(|x| x.abs() * size).collect();
        let is_distance = |x: &f64| x.is_finite() && *x <= LARGEST_DISTANCE_RATIO * largest(&before);
        let closest = projection.closest(state).filter(|distances| distances.iter().all(is_distance));
        let closest = closest.unwrap_or(before);
        (projection.chosen, closest)
    });
    let closest = approaches.min_by(|(_, a), (_, b)| largest(a).total_cmp(&largest(b)));
    let Some((rows, residual)) = closest else { return Vec::new() };
    let missed = MISSED_ROWS * largest(&residual);
    let far = rows.into_iter().zip(residual).filter(|(_, x)| *x > missed);
    far.collect()
}

/// A row that depends on others at every sample.
#[derive(Clone, Debug)]
pub(super) struct RowDependence {
    pub(super) row: usize,
    /// Those that take part at some sample.
    pub(super) others: Vec<usize>,
    /// Coefficients n/d where they are the same at all samples.
    pub(super) constant: Option<Vec<(usize, (i64, i64))>>,
    /// Whether velocities can satisfy the row together with the others.
    pub(super) consistent: bool,
}

/// The rows in a given order at every sample.
pub(super) struct SampledRanks {
    /// Smallest and largest rank met.
    pub(super) rank: (usize, usize),
    /// Rows that depend on those before them at every sample.
    pub(super) dependent: Vec<RowDependence>,
    /// Rows that are in a relation at some sample: their multipliers are not unique there.
    pub(super) entangled: Vec<usize>,
}

impl SampledManifold {
    /// Finds states in which the rows `chosen` hold.
    pub(super) fn of(model: &Model, rows: &ConstraintRows, chosen: &[usize]) -> Self {
        let nodes: Vec<NodeId> = chosen.iter().map(|r| rows.values[*r]).collect();
        let reads = Reads::of(model, &nodes);
        let given = |i: u32| model.nominal.iter().any(|(p, _)| *p == i);
        let parameters = 0..model.parameters.len() as u32;
        let needed: Vec<u32> = parameters.filter(|i| reads.symbol(Symbol::Parameter(*i))).collect();
        let nominal = !reads.any_function() && needed.iter().all(|i| given(*i));
        let size = typical_length(model, &needed);
        let mut found = Self { nominal, ..Self::default() };
        let mut closest: Option<f64> = None;
        let mut stuck = Vec::new();
        let mut evidence = 0;
        // A declared repetition means a branch on which it holds, which may take more starts to find.
        let mut sought = model.constraints.iter().any(|c| c.redundant);
        let mut independent = false;
        for start in 0..STARTS + STARTS_ROW_BY_ROW {
            let enough = found.samples.len() >= ENOUGH_STATES && !sought;
            if start < STARTS && enough {
                continue;
            }
            if start >= STARTS && (independent || found.tangent.is_empty()) {
                break;
            }
            let scale = coordinate_scales(model, size * [1.0, 0.4, 2.5][start as usize % 3]);
            let state = start_state(model, &scale, start, if nominal { 0 } else { start });
            let projection = Projection::new(rows, chosen, scale);
            let end = match start < STARTS {
                true => projection.from(state, start),
                false => projection
                    .row_by_row(state, start)
                    .map_or(ProjectionEnd::Stuck(None), ProjectionEnd::OnManifold),
            };
            match end {
                // A state with a slope that is not finite decides nothing.
                ProjectionEnd::OnManifold(sample)
                    if slopes(rows, &sample, chosen).iter().flatten().all(|x| x.is_finite()) =>
                {
                    let sample = found.settled(&projection, rows, sample);
                    let rank = rank(rows, &sample, chosen);
                    sought &= rank == chosen.len();
                    independent |= rank == chosen.len();
                    found.samples.push(sample);
                }
                ProjectionEnd::OnManifold(_) => {}
                ProjectionEnd::Stuck(Some((residual, state))) => {
                    evidence += 1;
                    let worst = largest(&residual) * size;
                    closest = Some(closest.map_or(worst, |least| least.min(worst)));
                    stuck.push((projection, state, residual));
                }
                ProjectionEnd::Stuck(None) => {}
            }
        }
        // A small distance may mean slow convergence, as near a singular state.
        if found.samples.is_empty() && nominal && evidence >= STARTS / 2 {
            let apart = closest.is_some_and(|distance| distance > LEAST_GAP * size);
            found.nowhere = apart.then(|| missed(stuck, size));
        }
        let scale = coordinate_scales(model, size);
        let gone = |r: &usize| {
            !found.samples.is_empty() && found.samples.iter().all(|s| vanishes(rows, s, &scale, *r))
        };
        found.vanishing = chosen.iter().copied().filter(gone).collect();
        found
    }

    /// A state on the manifold, or the place beside it where rows are tangent, with what is held there.
    fn settled(&mut self, projection: &Projection, rows: &ConstraintRows, sample: Sample) -> Sample {
        let place = match projection.tangent(&sample).map(|place| (projection.beside(&place), place)) {
            Some((None, place)) => place,
            found => {
                let sample = found.and_then(|(regular, _)| regular).unwrap_or(sample);
                self.places.push(false);
                self.held.push(rank(rows, &sample, &projection.chosen));
                return sample;
            }
        };
        self.places.push(true);
        self.held.push(place.held);
        self.tangent.extend(place.rows);
        self.tangent.sort_unstable();
        self.tangent.dedup();
        place.sample
    }

    /// Keeps the states in which no row is tangent to others.
    pub(super) fn leave_out_tangent(&mut self) {
        let mut places = core::mem::take(&mut self.places).into_iter();
        let (samples, held) = (core::mem::take(&mut self.samples), core::mem::take(&mut self.held));
        let regular = samples.into_iter().zip(held).filter(|_| !places.next().unwrap_or(false));
        (self.samples, self.held) = regular.unzip();
        self.places = vec![false; self.samples.len()];
        self.tangent.clear();
    }

    /// Looks at rows in the given order at every sample; rows without a gradient are left out.
    pub(super) fn ranks(&self, rows: &ConstraintRows, order: &[usize]) -> Option<SampledRanks> {
        let order: Vec<usize> = order.iter().copied().filter(|r| !self.vanishing.contains(r)).collect();
        let all: Vec<RowsAtSample> = self.samples.iter().map(|s| RowsAtSample::of(rows, s, &order)).collect();
        let first = all.first()?;
        let rank = all.iter().fold((usize::MAX, 0), |(low, high), at| (low.min(at.rank), high.max(at.rank)));
        let everywhere = |r: &usize| all.iter().all(|at| at.dependent.iter().any(|d| d.row == *r));
        let rows_found: Vec<usize> = first.dependent.iter().map(|d| d.row).filter(everywhere).collect();
        let dependent = rows_found.into_iter().map(|r| join(r, &all)).collect();
        let mut entangled: Vec<usize> = all.iter().flat_map(RowsAtSample::entangled).collect();
        entangled.sort_unstable();
        entangled.dedup();
        Some(SampledRanks { rank, dependent, entangled })
    }
}

/// The rows at one sample.
struct RowsAtSample {
    rank: usize,
    dependent: Vec<Relation>,
}

/// A row as a combination of those before it.
struct Relation {
    row: usize,
    coefficients: Vec<(usize, f64)>,
    /// Whether the offsets satisfy the same relation.
    consistent: bool,
}

impl RowsAtSample {
    fn of(rows: &ConstraintRows, sample: &Sample, order: &[usize]) -> Self {
        let dense = slopes(rows, sample, order);
        let offsets = offsets(rows, sample, order);
        let offset = |r: usize| order.iter().position(|s| *s == r).map_or(0.0, |at| offsets[at]);
        let mut basis = Basis::default();
        let mut dependent = Vec::new();
        for (r, row) in order.iter().zip(&dense) {
            let Some(coefficients) = basis.add(*r, row) else { continue };
            let size = norm(row);
            let coefficients: Vec<(usize, f64)> = coefficients
                .into_iter()
                .filter(|(s, c)| {
                    let other = order.iter().position(|o| o == s).map_or(0.0, |at| norm(&dense[at]));
                    c.abs() * other > NEGLIGIBLE * size
                })
                .collect();
            let terms = coefficients.iter().map(|(s, c)| c * offset(*s));
            let (sum, largest) =
                terms.fold((0.0, offset(*r).abs()), |(sum, large), x| (sum + x, f64::max(large, x.abs())));
            let consistent = (offset(*r) - sum).abs() <= NEGLIGIBLE * (largest + size);
            dependent.push(Relation { row: *r, coefficients, consistent });
        }
        Self { rank: basis.rank(), dependent }
    }

    fn entangled(&self) -> impl Iterator<Item = usize> {
        self.dependent.iter().flat_map(|d| d.coefficients.iter().map(|(s, _)| *s).chain([d.row]))
    }
}

/// What is known about a row from all samples.
fn join(row: usize, all: &[RowsAtSample]) -> RowDependence {
    let own = || all.iter().filter_map(|at| at.dependent.iter().find(|d| d.row == row));
    let mut others: Vec<usize> = own().flat_map(|d| d.coefficients.iter().map(|(s, _)| *s)).collect();
    others.sort_unstable();
    others.dedup();
    let at = |c: &[(usize, f64)], s: usize| c.iter().find(|(t, _)| *t == s).map_or(0.0, |(_, x)| *x);
    let constant = others.iter().map(|s| {
        let mut values = own().map(|d| at(&d.coefficients, *s));
        let first = values.next()?;
        let same = own().count() > 1 && values.all(|x| (x - first).abs() < NEGLIGIBLE * (1.0 + first.abs()));
        fraction(first).filter(|_| same).map(|f| (*s, f))
    });
    let constant = constant.collect();
    RowDependence { row, others, constant, consistent: own().all(|d| d.consistent) }
}

/// Whether the gradient of a row is far shorter at a state than at states around it, or turns round there, as
/// that of |Φ| does.
fn vanishes(rows: &ConstraintRows, sample: &Sample, scale: &[f64], r: usize) -> bool {
    let slope = slopes(rows, sample, &[r]).swap_remove(0);
    let to = |side: f64| {
        let mut there = sample.clone();
        let length = norm(&slope);
        for ((q, s), d) in there.q.iter_mut().zip(scale).zip(&slope) {
            *q += side * BESIDE_KINK * s * d / length;
        }
        slopes(rows, &there, &[r]).swap_remove(0)
    };
    let (ahead, behind) = (to(1.0), to(-1.0));
    let along: f64 = ahead.iter().zip(&behind).map(|(a, b)| a * b).sum();
    if along < -0.5 * norm(&ahead) * norm(&behind) {
        return true;
    }
    let here = norm(&slopes(rows, sample, &[r])[0]);
    let around = (0..3).map(|k| {
        let mut away = sample.clone();
        for (j, (q, s)) in away.q.iter_mut().zip(scale).enumerate() {
            *q += AWAY * s * (2.0 * random(0x3000 + k, j as u64) - 1.0);
        }
        norm(&slopes(rows, &away, &[r])[0])
    });
    here < VANISHED_GRADIENT * around.fold(0.0, f64::max)
}

/// Whether a row that depends on others in every state, so that it is constant where these hold, is zero
/// nowhere among them: it contradicts them. Not where no state was found in which they hold, and not of rows
/// that bind velocities.
pub(super) fn misses(model: &Model, rows: &ConstraintRows, others: &[usize], row: usize) -> bool {
    if others.iter().chain([&row]).any(|r| *r >= rows.holonomic) {
        return false;
    }
    let found = SampledManifold::of(model, rows, others).samples;
    let off = |sample: &Sample| {
        let (value, slope) =
            (evaluate(&rows.graph, sample, &[rows.values[row]])[0], &slopes(rows, sample, &[row])[0]);
        let size = slope.iter().zip(&sample.q).map(|(d, q)| (d * q).abs()).fold(0.0, f64::max);
        value.abs() > LARGEST_CONSTANT * size
    };
    !found.is_empty() && found.iter().all(off)
}

/// Rank of some rows at a state.
pub(super) fn rank(rows: &ConstraintRows, sample: &Sample, chosen: &[usize]) -> usize {
    RowsAtSample::of(rows, sample, chosen).rank
}

/// Rows of Φ_q and A at a state.
pub(super) fn slopes(rows: &ConstraintRows, sample: &Sample, chosen: &[usize]) -> Vec<Vec<f64>> {
    let nodes: Vec<NodeId> =
        chosen.iter().flat_map(|r| rows.jacobian[*r].iter().map(|(_, node)| *node)).collect();
    let values = evaluate(&rows.graph, sample, &nodes);
    let mut values = values.into_iter();
    let row = |r: &usize| {
        let mut dense = vec![0.0; rows.coordinates];
        rows.jacobian[*r].iter().for_each(|(j, _)| dense[*j] = values.next().unwrap_or(f64::NAN));
        dense
    };
    chosen.iter().map(row).collect()
}

fn offsets(rows: &ConstraintRows, sample: &Sample, chosen: &[usize]) -> Vec<f64> {
    let nodes: Vec<NodeId> = chosen.iter().map(|r| rows.offset[*r]).collect();
    evaluate(&rows.graph, sample, &nodes)
}

/// Values of some nodes.
pub(super) fn evaluate(g: &Graph, sample: &Sample, nodes: &[NodeId]) -> Vec<f64> {
    let mut buffer = Vec::new();
    Tape::new(g, nodes).run(g, sample, &mut buffer);
    nodes.iter().map(|node| buffer[node.index()]).collect()
}

/// The middle of the sizes of the given parameters; 1 without any.
pub(super) fn typical_length(model: &Model, needed: &[u32]) -> f64 {
    let given = model.nominal.iter().filter(|(p, x)| needed.contains(p) && *x != 0.0 && x.is_finite());
    let mut sizes: Vec<f64> = given.map(|(_, x)| x.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).copied().unwrap_or(1.0)
}

/// Angles have the size of π, everything else of the parameters.
pub(super) fn coordinate_scales(model: &Model, size: f64) -> Vec<f64> {
    let angle = |unit: &str| unit == "rad";
    model.coordinates.iter().map(|c| if angle(&c.unit) { core::f64::consts::PI } else { size }).collect()
}

/// A random state; every other one at t = 0, where motions start.
fn start_state(model: &Model, scale: &[f64], start: u64, attempt: u64) -> Sample {
    let both = |kind: u64, i: usize| 2.0 * random(0x100 + 0x40 * start + kind, i as u64) - 1.0;
    Sample {
        time: if start.is_multiple_of(2) { 0.0 } else { random(0x80, start) },
        q: scale.iter().enumerate().map(|(i, s)| s * both(0, i)).collect(),
        u: (0..scale.len()).map(|i| both(1, i)).collect(),
        parameters: Sample::parameters(model, attempt),
    }
}
