//! Projection of random states onto the manifold Φ = 0, by the Levenberg–Marquardt method.
//!
//! Solves min ½|WΦ(q)|² with steps δ = D²Jᵀ(J D²Jᵀ + μI)⁻¹(−WΦ), J = WΦ_q; W gives every row the length 1 at
//! the start, D the coordinates their size. With μ ≤ |WΦ| it converges fast also where rows are redundant on
//! the manifold, where Newton's own step does not exist (Yamashita and Fukushima 2001). Where it gets stuck
//! away from the manifold, the coordinates of the rows that do not hold are thrown anew.

use core::cmp::Ordering;

use crate::graph::{NodeId, Tape};

use super::orthogonal::norm;
use super::rows::ConstraintRows;
use super::sample::{Sample, random};

/// Most iterations of one descent. Convergence is quadratic on regular manifolds and takes one bit an
/// iteration where Φ² = 0: Φ² is 1e-12 after 20 of them.
const MOST_ITERATIONS: usize = 60;
/// Damping μ of the first step, relative to the weighted rows. It is reduced to |WΦ| where that is smaller.
const FIRST_DAMPING: f64 = 1e-2;
/// Damping after a step that failed, at least. It is 45 ε, above the rounding of J D²Jᵀ.
const LEAST_DAMPING: f64 = 1e-14;
/// Damping above which a descent ends: steps are then too short to change the state.
const LARGEST_DAMPING: f64 = 1e8;
/// Least damping of a step relative to the largest element of J D²Jᵀ: about 5 ε, so that Cholesky's method
/// does not fail where rows are redundant.
const REGULARIZATION: f64 = 1e-15;
/// Residual of a row, relative to the largest, above which its coordinates are drawn anew.
const UNSATISFIED: f64 = 1e-3;
/// Most descents from one start; before each but the first the coordinates of unsatisfied rows are drawn
/// anew. More of them find rarer branches and take time.
const MOST_DESCENTS: u64 = 6;
/// Descents to a closest approach, each with the weights of where the one before ended.
const REFINEMENTS: usize = 8;
/// Largest |WΦ| of a state on the manifold. Newton's method halves the distance from Φ² = 0 each time, so
/// that Φ itself is 1e-6 there.
pub(super) const ON_MANIFOLD: f64 = 1e-12;

/// How a projection ended.
pub(super) enum ProjectionEnd {
    /// On the manifold.
    OnManifold(Sample),
    /// Away from it: |WΦ| of every row, and where. Not evidence of anything where a value was not finite on
    /// the way.
    Stuck(Option<(Vec<f64>, Sample)>),
}

/// The holonomic rows among some, ready to be evaluated.
pub(super) struct Projection<'r> {
    pub(super) rows: &'r ConstraintRows,
    pub(super) chosen: Vec<usize>,
    tape: Tape,
    /// Typical size of each coordinate.
    pub(super) scale: Vec<f64>,
    /// One more row, if any.
    plane: Option<Plane>,
}

/// The plane at a distance from a place, in a direction; both relative to the coordinates' sizes.
#[derive(Clone)]
pub(super) struct Plane {
    pub(super) from: Vec<f64>,
    pub(super) direction: Vec<f64>,
    pub(super) distance: f64,
}

/// Φ and Φ_q D at a state.
pub(super) struct LocalRows {
    values: Vec<f64>,
    pub(super) jacobian: Vec<Vec<f64>>,
}

impl LocalRows {
    /// What gives every row the length 1.
    pub(super) fn weights(&self) -> Vec<f64> {
        let length = |row: &Vec<f64>| norm(row);
        self.jacobian.iter().map(length).map(|l| if l > 0.0 { 1.0 / l } else { 1.0 }).collect()
    }

    /// WΦ.
    pub(super) fn weighted(&self, weight: &[f64]) -> Vec<f64> {
        self.values.iter().zip(weight).map(|(v, w)| v * w).collect()
    }
}

impl<'r> Projection<'r> {
    pub(super) fn new(rows: &'r ConstraintRows, chosen: &[usize], scale: Vec<f64>) -> Self {
        let chosen: Vec<usize> = chosen.iter().copied().filter(|r| *r < rows.holonomic).collect();
        let slopes = chosen.iter().flat_map(|r| rows.jacobian[*r].iter().map(|(_, node)| *node));
        let nodes: Vec<NodeId> = slopes.chain(chosen.iter().map(|r| rows.values[*r])).collect();
        Self { rows, tape: Tape::new(&rows.graph, &nodes), chosen, scale, plane: None }
    }

    pub(super) fn local(&self, state: &Sample, buffer: &mut Vec<f64>) -> LocalRows {
        self.tape.run(&self.rows.graph, state, buffer);
        let mut values: Vec<f64> = self.chosen.iter().map(|r| buffer[self.rows.values[*r].index()]).collect();
        let row = |r: &usize| {
            let mut dense = vec![0.0; self.scale.len()];
            self.rows.jacobian[*r]
                .iter()
                .for_each(|(j, node)| dense[*j] = buffer[node.index()] * self.scale[*j]);
            dense
        };
        let mut jacobian: Vec<Vec<f64>> = self.chosen.iter().map(row).collect();
        if let Some(Plane { from, direction, distance }) = &self.plane {
            let along = |((q, at), (d, s)): ((&f64, &f64), (&f64, &f64))| (q - at) / s * d;
            let far: f64 = state.q.iter().zip(from).zip(direction.iter().zip(&self.scale)).map(along).sum();
            values.push(far - distance);
            jacobian.push(direction.clone());
        }
        LocalRows { values, jacobian }
    }

    /// The same rows and one more.
    pub(super) fn on(&self, plane: Plane) -> Self {
        Self {
            plane: Some(plane),
            chosen: self.chosen.clone(),
            scale: self.scale.clone(),
            tape: self.tape.clone(),
            rows: self.rows,
        }
    }

    /// From a random state onto the manifold.
    pub(super) fn from(&self, mut state: Sample, start: u64) -> ProjectionEnd {
        let mut buffer = Vec::new();
        if self.chosen.is_empty() {
            return ProjectionEnd::OnManifold(state);
        }
        let mut last = None;
        for throw in 0..MOST_DESCENTS {
            let Some(residual) = self.descend(&mut state, &mut buffer) else {
                return ProjectionEnd::Stuck(None);
            };
            let worst = residual.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            if worst <= ON_MANIFOLD {
                return ProjectionEnd::OnManifold(state);
            }
            let stuck = state.clone();
            for (r, own) in self.chosen.iter().zip(&residual) {
                if own.abs() > UNSATISFIED * worst {
                    for (j, _) in &self.rows.jacobian[*r] {
                        let x = random(0x900 + 16 * start + throw, *j as u64);
                        state.q[*j] = self.scale[*j] * (2.0 * x - 1.0);
                    }
                }
            }
            last = Some((residual, stuck));
        }
        ProjectionEnd::Stuck(last)
    }

    /// From where a projection was stuck to where rows are least far away as distances go, |Φ|/‖Φ_q‖ by their
    /// gradients there, by the coordinates' sizes: what each is missed by, in coordinates. Rows that are not
    /// satisfied there exclude each other, as their gradients depend on each other.
    pub(super) fn closest(&self, mut state: Sample) -> Option<Vec<f64>> {
        let mut buffer = Vec::new();
        for _ in 0..REFINEMENTS {
            self.descend(&mut state, &mut buffer)?;
        }
        let LocalRows { values, jacobian } = self.local(&state, &mut buffer);
        let slope =
            |row: &Vec<f64>| norm(&row.iter().zip(&self.scale).map(|(x, s)| x / s).collect::<Vec<f64>>());
        Some(values.iter().zip(&jacobian).map(|(value, row)| value.abs() / slope(row)).collect())
    }

    /// One descent; WΦ at its end, `None` where a value was not finite.
    pub(super) fn descend(&self, state: &mut Sample, buffer: &mut Vec<f64>) -> Option<Vec<f64>> {
        let mut local = self.local(state, buffer);
        let weight = local.weights();
        let mut residual = local.weighted(&weight);
        // As small as the residual, unless such a step failed.
        let (mut damping, mut failed) = (FIRST_DAMPING, false);
        for _ in 0..MOST_ITERATIONS {
            let size = norm(&residual);
            if !size.is_finite() {
                return None;
            }
            if size <= 0.1 * ON_MANIFOLD || damping > LARGEST_DAMPING {
                break;
            }
            let used = if failed { damping } else { f64::min(damping, size) };
            let step = self.step(&local, &weight, &residual, used)?;
            let mut next = state.clone();
            next.q.iter_mut().zip(&step).zip(&self.scale).for_each(|((q, s), d)| *q += s * d);
            let there = self.local(&next, buffer);
            let new = there.weighted(&weight);
            failed = norm(&new).partial_cmp(&size) != Some(Ordering::Less);
            if failed {
                damping = f64::max(10.0 * used, LEAST_DAMPING);
            } else {
                (*state, local, residual) = (next, there, new);
                damping = 0.2 * used;
            }
        }
        Some(residual)
    }

    /// −D Jᵀ(J Jᵀ + μI)⁻¹WΦ over D, with J = WΦ_q D.
    fn step(&self, local: &LocalRows, weight: &[f64], residual: &[f64], damping: f64) -> Option<Vec<f64>> {
        let rows: Vec<Vec<f64>> =
            local.jacobian.iter().zip(weight).map(|(row, w)| row.iter().map(|x| x * w).collect()).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let mut normal: Vec<Vec<f64>> =
            (0..rows.len()).map(|i| (0..=i).map(|j| dot(&rows[i], &rows[j])).collect()).collect();
        let largest = (0..rows.len()).fold(0.0f64, |m, i| m.max(normal[i][i]));
        (0..rows.len()).for_each(|i| normal[i][i] += f64::max(damping, REGULARIZATION * largest));
        let multipliers = solve(normal, residual)?;
        let mut step = vec![0.0; self.scale.len()];
        for (row, y) in rows.iter().zip(multipliers) {
            step.iter_mut().zip(row).for_each(|(s, x)| *s -= x * y);
        }
        Some(step)
    }
}

/// Cholesky's method for a matrix given by its lower triangle.
pub(super) fn solve(mut a: Vec<Vec<f64>>, right: &[f64]) -> Option<Vec<f64>> {
    let n = a.len();
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = a[i][j] - (0..j).map(|k| a[i][k] * a[j][k]).sum::<f64>();
            a[i][j] = if i == j { sum.sqrt() } else { sum / a[j][j] };
        }
        if a[i][i].is_nan() || a[i][i] <= 0.0 {
            return None;
        }
    }
    let mut x = right.to_vec();
    for i in 0..n {
        x[i] = (x[i] - (0..i).map(|k| a[i][k] * x[k]).sum::<f64>()) / a[i][i];
    }
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|k| a[k][i] * x[k]).sum::<f64>()) / a[i][i];
    }
    x.iter().all(|x| x.is_finite()).then_some(x)
}
