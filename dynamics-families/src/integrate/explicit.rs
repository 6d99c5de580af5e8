//! Stages of explicit Runge–Kutta methods for q̈ = a(t, q, q̇), with accelerations alone in memory.
//!
//! The velocity part of a stage's derivative is the stage's velocity, u + h Σ aᵢⱼ kⱼ. Inserted into the
//! positions it leaves
//!
//! ```text
//! uᵢ = u + h Σ aᵢⱼ kⱼ        qᵢ = q + cᵢ h u + h² Σ (A²)ᵢⱼ kⱼ
//! ```
//!
//! which is the same method with half of its memory. Combinations are made block by block.

use dynamics_runtime::integrate::tables::{DOP853, DORMAND_PRINCE5, Embedded, SparseRow};

use crate::equations::Equations;
use crate::failure::FamilyErrorKind;
use crate::generated::BLOCK;
use crate::integrate::{FixedStep, Point};
use crate::methods::FamilyMethod;
use crate::model::FamilyModel;

/// Weights of accelerations: (stage, for velocities, for positions), and of u in the positions.
#[derive(Clone, Debug)]
pub(crate) struct Weights {
    pub(crate) terms: Vec<(usize, f64, f64)>,
    pub(crate) node: f64,
}

/// The classical method of order 4: the rows of its stages, and its weights.
const RK4: ([SparseRow; 4], SparseRow) = (
    [&[], &[(0, 0.5)], &[(1, 0.5)], &[(2, 1.0)]],
    &[(0, 1.0 / 6.0), (1, 1.0 / 3.0), (2, 1.0 / 3.0), (3, 1.0 / 6.0)],
);
/// Its nodes.
const RK4_NODES: [f64; 4] = [0.0, 0.5, 0.5, 1.0];

/// A tableau in the form of the head of this file.
#[derive(Clone, Debug)]
pub(crate) struct Tableau {
    pub(crate) rows: Vec<Weights>,
    pub(crate) result: Weights,
    /// Error estimates: the one that decides, and that of order 3 of DOP853.
    pub(crate) errors: Vec<Weights>,
    pub(crate) first_same_as_last: bool,
}

impl Tableau {
    /// The method, which has to be an explicit Runge–Kutta method.
    pub(crate) fn new(method: FamilyMethod) -> (Self, Option<&'static Embedded>) {
        match method {
            FamilyMethod::DormandPrince5 => (Self::embedded(&DORMAND_PRINCE5), Some(&DORMAND_PRINCE5)),
            FamilyMethod::Dop853 => (Self::embedded(&DOP853), Some(&DOP853)),
            _ => (Self::of(&RK4.0, &RK4_NODES, RK4.1, &[], false), None),
        }
    }

    fn embedded(table: &Embedded) -> Self {
        let mut errors = vec![dense(table.error, table.rows.len())];
        if let Some(third) = table.third_order {
            let (b, third) = (dense(table.weights, table.rows.len()), dense(third, table.rows.len()));
            errors.push(b.iter().zip(&third).map(|(b, third)| b - third).collect());
        }
        Self::of(table.rows, table.nodes, table.weights, &errors, table.first_same_as_last)
    }

    fn of(
        rows: &[SparseRow],
        nodes: &[f64],
        weights: SparseRow,
        errors: &[Vec<f64>],
        first_same_as_last: bool,
    ) -> Self {
        let stages = rows.len();
        let square: Vec<Vec<f64>> = rows.iter().map(|row| dense(row, stages)).collect();
        let weights_of = |row: &[f64], node: f64| {
            let position = |l: usize| (0..stages).map(|j| row[j] * square[j][l]).sum::<f64>();
            let terms = (0..stages)
                .map(|l| (l, row[l], position(l)))
                .filter(|&(_, velocity, position)| velocity != 0.0 || position != 0.0);
            Weights { terms: terms.collect(), node }
        };
        Self {
            rows: square.iter().zip(nodes).map(|(row, &node)| weights_of(row, node)).collect(),
            result: weights_of(&dense(weights, stages), 1.0),
            errors: errors.iter().map(|row| weights_of(row, 0.0)).collect(),
            first_same_as_last,
        }
    }
}

fn dense(row: SparseRow, stages: usize) -> Vec<f64> {
    let mut dense = vec![0.0; stages];
    row.iter().for_each(|&(stage, weight)| dense[stage] = weight);
    dense
}

/// The accelerations of the stages, and what they are evaluated at.
pub(crate) struct Stages {
    pub(crate) tableau: Tableau,
    pub(crate) k: Vec<Vec<f64>>,
    /// A stage; after the last one the end of the step.
    pub(crate) end: Point,
    /// Whether `k[0]` belongs to the start of the next step.
    pub(crate) has_first: bool,
}

impl Stages {
    pub(crate) fn new(tableau: Tableau, n: usize) -> Self {
        let k = vec![vec![0.0; n]; tableau.rows.len()];
        Self { tableau, k, end: Point { t: 0.0, q: vec![0.0; n], u: vec![0.0; n] }, has_first: false }
    }

    /// Writes `y` plus the weighted stages to `end`.
    fn combine(k: &[Vec<f64>], weights: &Weights, y: &Point, h: f64, end: &mut Point) {
        let n = y.q.len();
        let mut from = 0;
        while from < n {
            let to = n.min(from + BLOCK);
            let block = from..to;
            let (q, u) = (&mut end.q[block.clone()], &mut end.u[block.clone()]);
            sums(k, weights, from, q, u);
            let drift = weights.node * h;
            for (((q, u), &q0), &u0) in q.iter_mut().zip(u).zip(&y.q[block.clone()]).zip(&y.u[block]) {
                *q = q0 + (drift * u0 + h * h * *q);
                *u = u0 + h * *u;
            }
            from = to;
        }
    }

    /// The first stage, where it is not known.
    pub(crate) fn start<M: FamilyModel>(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &Point,
    ) -> Result<(), FamilyErrorKind> {
        if !self.has_first {
            equations.accelerations(y.t, &y.q, &y.u, &mut self.k[0])?;
            self.has_first = true;
        }
        Ok(())
    }

    /// All stages of a step of size h, and its end.
    pub(crate) fn attempt<M: FamilyModel>(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &Point,
        h: f64,
    ) -> Result<(), FamilyErrorKind> {
        self.start(equations, y)?;
        let last = self.k.len();
        for i in 1..last {
            let (before, rest) = self.k.split_at_mut(i);
            let row = &self.tableau.rows[i];
            Self::combine(before, row, y, h, &mut self.end);
            let t = y.t + row.node * h;
            if self.tableau.first_same_as_last && i + 1 == last {
                equations.project_end(t, &mut self.end.q, &mut self.end.u)?;
            }
            equations.accelerations(t, &self.end.q, &self.end.u, &mut rest[0])?;
        }
        // The last stage of a method that reuses it stands at the end already.
        if !self.tableau.first_same_as_last {
            Self::combine(&self.k, &self.tableau.result, y, h, &mut self.end);
            equations.project_end(y.t + h, &mut self.end.q, &mut self.end.u)?;
        }
        Ok(())
    }

    /// Goes on from the end of the step.
    pub(crate) fn accept(&mut self, y: &mut Point) {
        core::mem::swap(&mut y.q, &mut self.end.q);
        core::mem::swap(&mut y.u, &mut self.end.u);
        self.has_first = self.tableau.first_same_as_last;
        if self.has_first {
            let last = self.k.len() - 1;
            self.k.swap(0, last);
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        8 * (self.k.len() + 2) * self.end.q.len()
    }
}

/// Σ of the weighted accelerations of a block that begins at `from`: for positions and for velocities.
#[inline]
pub(crate) fn sums(k: &[Vec<f64>], weights: &Weights, from: usize, q: &mut [f64], u: &mut [f64]) {
    q.fill(0.0);
    u.fill(0.0);
    let length = q.len();
    for &(stage, velocity, position) in &weights.terms {
        let k = &k[stage][from..from + length];
        for ((q, u), k) in q.iter_mut().zip(u.iter_mut()).zip(k) {
            *q += position * k;
            *u += velocity * k;
        }
    }
}

impl<M: FamilyModel> FixedStep<M> for Stages {
    fn begin(&mut self, _: &mut Equations<'_, '_, M>, _: &mut Point, _: f64) -> Result<(), FamilyErrorKind> {
        Ok(())
    }

    fn advance(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &mut Point,
        h: f64,
        _: f64,
    ) -> Result<(), FamilyErrorKind> {
        self.attempt(equations, y, h)?;
        self.accept(y);
        Ok(())
    }

    fn state(
        &mut self,
        _: &mut Equations<'_, '_, M>,
        y: &Point,
        _: f64,
        into: &mut Point,
    ) -> Result<(), FamilyErrorKind> {
        into.copy_from(y);
        Ok(())
    }

    fn restart(&mut self) {
        self.has_first = false;
    }

    fn bytes(&self) -> usize {
        Stages::bytes(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Σ of the weights of positions is 1/2 for the result and cᵢ²/2 for stages of order 2 or more.
    #[test]
    fn positions_have_half_the_square_of_the_time() {
        for method in [FamilyMethod::Rk4, FamilyMethod::DormandPrince5, FamilyMethod::Dop853] {
            let (tableau, _) = Tableau::new(method);
            let sum = |weights: &Weights| weights.terms.iter().map(|term| term.2).sum::<f64>();
            assert!((sum(&tableau.result) - 0.5).abs() < 1e-14);
            assert!(tableau.errors.iter().all(|error| sum(error).abs() < 1e-14));
        }
    }
}
