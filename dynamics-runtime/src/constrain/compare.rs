//! Accelerations and reactions at one state by every formulation. The formulations share nothing but M, Q,
//! Φ_q and γ, so that their agreement verifies them.
//!
//! | formulation | solves | needs |
//! |---|---|---|
//! | general solver (null space) | ZᵀMZ, complete orthogonal decomposition | M positive definite on the null space |
//! | generated code (order) | the order of elimination found at compile time | that it exists, all constraints hold |
//! | augmented matrix by LU | [M −Φ_qᵀ; Φ_q 0] at once, with full pivoting | independent rows |
//! | range space by Cholesky | Φ_q M⁻¹ Φ_qᵀ λ = γ − Φ_q M⁻¹ Q | M positive definite, independent rows |
//! | partition by LU | dependent accelerations eliminated by Φ_D | the same as null space |

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;

use nalgebra::{DMatrix, DVector};

use super::system::scale_coordinates;
use super::{
    ConstrainedAccelerations, ConstrainedAccelerationsOf, Embedding, SolvedOf, gradients, holds,
    solve_general, with_workspace,
};
use crate::error::SolveError;
use crate::model::{Constraints, ModelState, Solved, SolverKind, Terms, Vector};

/// The result of one formulation at a state.
#[derive(Clone, Debug, PartialEq)]
pub struct FormulationResult<V, R> {
    /// Its name.
    pub name: String,
    /// q̈ and λ, or the reason why it does not apply here.
    pub solved: Result<Solved<V, R>, String>,
    /// How far q̈ is from the reference, as [`Comparison`] measures it; 0 where it does not apply.
    pub accelerations: f64,
    /// How far Φ_qᵀλ is from the reference; likewise.
    pub reactions: f64,
}

/// Accelerations and reactions at a state by every formulation, the first of which is the reference: the
/// general null-space solver.
///
/// Distances are taken with coordinates scaled by the square roots of their inertias, and relative to the
/// largest of accelerations, forces and reactions in that scale: they are free of units, and meaningful at
/// rest. Reactions are compared as generalized forces Φ_qᵀλ, which are unique even where multipliers are not.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison<V, R> {
    /// All formulations, those that do not apply included.
    pub formulations: Vec<FormulationResult<V, R>>,
    /// Whether the multipliers are unique.
    pub unique: bool,
    /// Rank of Φ_q, and number of rows that hold.
    pub rank: (usize, usize),
}

impl<V, R> Comparison<V, R> {
    /// The greatest distance of accelerations or reactions from the reference.
    #[must_use]
    pub fn disagreement(&self) -> f64 {
        self.formulations
            .iter()
            .fold(0.0, |most, f| crate::math::max(most, crate::math::max(f.accelerations, f.reactions)))
    }

    /// How many formulations apply.
    #[must_use]
    pub fn applicable(&self) -> usize {
        self.formulations.iter().filter(|f| f.solved.is_ok()).count()
    }
}

impl<V, R> fmt::Display for Comparison<V, R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.formulations.iter().map(|x| x.name.chars().count()).max().unwrap_or(0).max(11);
        writeln!(f, "{:width$}  accelerations  reactions", "formulation")?;
        for (i, x) in self.formulations.iter().enumerate() {
            match &x.solved {
                Ok(_) if i == 0 => writeln!(f, "{:width$}  reference      reference", x.name)?,
                Ok(_) => writeln!(f, "{:width$}  {:<13.1e}  {:<.1e}", x.name, x.accelerations, x.reactions)?,
                Err(reason) => writeln!(f, "{:width$}  {reason}", x.name)?,
            }
        }
        let (rank, rows) = self.rank;
        if self.unique {
            write!(f, "rank {rank} of {rows} rows: the multipliers are unique")
        } else {
            write!(
                f,
                "rank {rank} of {rows} rows: the multipliers are not unique, those of least norm are given"
            )
        }
    }
}

/// Compares all formulations at a state.
pub(crate) fn compare<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
) -> Result<Comparison<M::Vector, M::Rows>, SolveError> {
    let reference: ConstrainedAccelerationsOf<M> =
        with_workspace::<M, _>(|workspace| solve_general(model, state, workspace))?;
    let equations = DenseEquations::new(model, state, &reference);
    let mut formulations = Vec::new();
    let mut add = |name: String, solved: Result<SolvedOf<M>, String>| {
        let (accelerations, reactions) = match &solved {
            Ok(solved) => equations.distance::<M>(&reference, solved),
            Err(_) => (0.0, 0.0),
        };
        formulations.push(FormulationResult { name, solved, accelerations, reactions });
    };
    let ConstrainedAccelerations { accelerations, multipliers, .. } = reference;
    add("general solver (null space)".to_string(), Ok(Solved { accelerations, multipliers }));
    let name = match M::SOLVER {
        SolverKind::Unrolled { elimination } => alloc::format!("generated code ({elimination})"),
        _ => "generated code".to_string(),
    };
    add(name, solve_by_generated_code(model, constants, state));
    add("augmented matrix by LU".to_string(), equations.solve_augmented::<M>());
    add("range space by Cholesky".to_string(), equations.solve_range_space::<M>());
    let embedding = with_workspace::<M, _>(|workspace| Embedding::new(model, state, workspace))?;
    add("partition by LU".to_string(), equations.solve_partitioned(&embedding));
    let rank_and_rows = reference.diagnosis.map_or((0, 0), |d| (d.rank, d.active));
    Ok(Comparison { formulations, unique: reference.unique(), rank: rank_and_rows })
}

/// A pivot of the full-pivoting LU below this part of the largest makes the augmented matrix singular. Its
/// entries are scaled to 1, so that rounding leaves pivots of about 10⁻¹⁵ where it is singular.
const SINGULAR_PIVOT_RATIO: f64 = 1e-12;
/// The same of the diagonal of a Cholesky factor, which is the square root of a pivot.
const SINGULAR_CHOLESKY_RATIO: f64 = 1e-6;

/// q̈ and λ by the generated code, or why there are none.
fn solve_by_generated_code<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
) -> Result<SolvedOf<M>, String> {
    if let SolverKind::General { reason } = M::SOLVER {
        return Err(alloc::format!("none: {reason}"));
    }
    let reason_for_none = || {
        let why = if state.active_set().all_hold() {
            "a pivot is too small here"
        } else {
            "a constraint is released"
        };
        why.to_string()
    };
    model.solve_unrolled(constants, state).ok_or_else(reason_for_none)
}

/// The equations at a state as dense matrices, with the active rows only.
struct DenseEquations {
    n: usize,
    rows: Vec<usize>,
    mass: DMatrix<f64>,
    /// Q, at the reactions of the reference where it depends on them.
    force: DVector<f64>,
    jacobian: DMatrix<f64>,
    gamma: DVector<f64>,
    scale: Vec<f64>,
    /// The size that distances are relative to.
    size: f64,
}

impl DenseEquations {
    fn new<M: Constraints>(model: &M, state: &M::State, reference: &ConstrainedAccelerationsOf<M>) -> Self {
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let (mut mass, mut force) = (alloc::vec![0.0; n * n], alloc::vec![0.0; n]);
        let (mut jacobian, mut gamma) = (alloc::vec![0.0; r * n], alloc::vec![0.0; r]);
        let terms =
            &mut Terms { mass: &mut mass, force: &mut force, jacobian: &mut jacobian, gamma: &mut gamma };
        gradients::terms(model, state, terms, &mut alloc::vec![0.0; r]);
        if M::FRICTION {
            model.friction(state, &reference.multipliers, &mut force, &mut alloc::vec![0.0; n * r]);
        }
        let rows: Vec<usize> = (0..r).filter(|row| holds::<M>(state.active_set(), *row)).collect();
        let active_gradients: Vec<f64> =
            rows.iter().flat_map(|i| &jacobian[i * n..(i + 1) * n]).copied().collect();
        let mut scale = alloc::vec![0.0; n];
        scale_coordinates(&mass, &active_gradients, &mut scale);
        let mut equations = Self {
            n,
            mass: DMatrix::from_row_slice(n, n, &mass),
            force: DVector::from_vec(force),
            jacobian: DMatrix::from_row_slice(rows.len(), n, &active_gradients),
            gamma: DVector::from_iterator(rows.len(), rows.iter().map(|row| gamma[*row])),
            rows,
            scale,
            size: 0.0,
        };
        let reaction = equations.reaction(&reference.multipliers);
        let largest = |values: &[f64], power: i32| {
            let scaled =
                values.iter().zip(&equations.scale).map(|(x, s)| (x * crate::math::powi(*s, power)).abs());
            scaled.fold(0.0, crate::math::max)
        };
        let terms = [
            (reference.accelerations.as_slice(), -1),
            (equations.force.as_slice(), 1),
            (reaction.as_slice(), 1),
        ];
        equations.size =
            terms.iter().map(|(values, power)| largest(values, *power)).fold(0.0, crate::math::max);
        equations
    }

    /// Φ_qᵀλ.
    fn reaction<R: Vector>(&self, multipliers: &R) -> DVector<f64> {
        let active_gradients =
            DVector::from_iterator(self.rows.len(), self.rows.iter().map(|row| multipliers[*row]));
        self.jacobian.transpose() * active_gradients
    }

    /// Distances of accelerations and of reactions from the reference, relative to the size of both.
    fn distance<M: Constraints>(
        &self,
        reference: &ConstrainedAccelerationsOf<M>,
        solved: &SolvedOf<M>,
    ) -> (f64, f64) {
        let (a, b) = (reference.accelerations.as_slice(), solved.accelerations.as_slice());
        let difference = self.reaction(&reference.multipliers) - self.reaction(&solved.multipliers);
        let accelerations =
            (0..self.n).map(|i| ((a[i] - b[i]) / self.scale[i]).abs()).fold(0.0, crate::math::max);
        let reactions =
            (0..self.n).map(|i| (difference[i] * self.scale[i]).abs()).fold(0.0, crate::math::max);
        if self.size > 0.0 {
            (accelerations / self.size, reactions / self.size)
        } else {
            (accelerations, reactions)
        }
    }

    /// q̈ and λ of all rows from λ of the active ones.
    fn result<M: Constraints>(&self, a: &DVector<f64>, lambda: &DVector<f64>) -> SolvedOf<M> {
        let mut solved = Solved { accelerations: M::Vector::zeros(), multipliers: M::Rows::zeros() };
        solved.accelerations.as_mut_slice().copy_from_slice(a.as_slice());
        self.rows.iter().zip(lambda.iter()).for_each(|(row, lambda)| solved.multipliers[*row] = *lambda);
        solved
    }

    /// Φ̂ = W Φ S in scaled coordinates with rows at unit length, and W.
    fn balanced(&self) -> (DMatrix<f64>, Vec<f64>) {
        let mut jacobian = self.jacobian.clone();
        for (mut column, s) in jacobian.column_iter_mut().zip(&self.scale) {
            column *= *s;
        }
        // A zero row, at a change point, stays zero.
        let weight = |length: f64| if length > 0.0 { 1.0 / length } else { 1.0 };
        let weights: Vec<f64> = jacobian.row_iter().map(|row| weight(row.norm())).collect();
        for (mut row, weight) in jacobian.row_iter_mut().zip(&weights) {
            row *= *weight;
        }
        (jacobian, weights)
    }

    fn balanced_mass(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.n, self.n, |i, j| self.scale[i] * self.mass[(i, j)] * self.scale[j])
    }

    /// [M −Φ_qᵀ; Φ_q 0] (a, λ) = (Q, γ).
    fn solve_augmented<M: Constraints>(&self) -> Result<SolvedOf<M>, String> {
        let (n, m) = (self.n, self.rows.len());
        let (jacobian, weights) = self.balanced();
        let mut matrix = DMatrix::zeros(n + m, n + m);
        matrix.view_mut((0, 0), (n, n)).copy_from(&self.balanced_mass());
        matrix.view_mut((0, n), (n, m)).copy_from(&-jacobian.transpose());
        matrix.view_mut((n, 0), (m, n)).copy_from(&jacobian);
        let right = DVector::from_fn(n + m, |i, _| match i.checked_sub(n) {
            None => self.scale[i] * self.force[i],
            Some(i) => weights[i] * self.gamma[i],
        });
        let lu = matrix.full_piv_lu();
        let pivots = lu.u().diagonal().abs();
        // Also false for NaN.
        let regular = pivots.min() > SINGULAR_PIVOT_RATIO * pivots.max();
        if !regular {
            return Err("does not apply: the augmented matrix is singular here".to_string());
        }
        let x = lu.solve(&right).ok_or("does not apply: the augmented matrix is singular here")?;
        let a = DVector::from_fn(n, |i, _| self.scale[i] * x[i]);
        let lambda = DVector::from_fn(m, |i, _| weights[i] * x[n + i]);
        Ok(self.result::<M>(&a, &lambda))
    }

    /// Φ_q M⁻¹ Φ_qᵀ λ = γ − Φ_q M⁻¹ Q, a = M⁻¹ (Q + Φ_qᵀ λ).
    fn solve_range_space<M: Constraints>(&self) -> Result<SolvedOf<M>, String> {
        let (jacobian, weights) = self.balanced();
        let mass =
            self.balanced_mass().cholesky().ok_or("does not apply: the mass matrix is singular here")?;
        let inertia = mass.l_dirty().diagonal().abs();
        if inertia.min() <= SINGULAR_CHOLESKY_RATIO * inertia.max() {
            return Err("does not apply: the mass matrix is singular here".to_string());
        }
        let force = DVector::from_fn(self.n, |i, _| self.scale[i] * self.force[i]);
        let by_rows = mass.solve(&jacobian.transpose());
        let schur = (&jacobian * &by_rows).cholesky();
        let singular = "does not apply: rows repeat each other here";
        let schur = schur.ok_or(singular)?;
        let pivots = schur.l_dirty().diagonal().abs();
        if !self.rows.is_empty() && pivots.min() <= SINGULAR_CHOLESKY_RATIO * pivots.max() {
            return Err(singular.to_string());
        }
        let free = mass.solve(&force);
        let gamma = DVector::from_fn(self.rows.len(), |i, _| weights[i] * self.gamma[i]);
        let lambda = schur.solve(&(gamma - &jacobian * &free));
        let a = free + by_rows * &lambda;
        let a = DVector::from_fn(self.n, |i, _| self.scale[i] * a[i]);
        let lambda = DVector::from_fn(self.rows.len(), |i, _| weights[i] * lambda[i]);
        Ok(self.result::<M>(&a, &lambda))
    }

    /// a_D = Φ_D⁻¹ (γ − Φ_I a_I), a_I from M projected onto the independent coordinates; λ on the chosen
    /// rows from the dependent equations.
    fn solve_partitioned<M: Constraints>(&self, embedding: &Embedding<M>) -> Result<SolvedOf<M>, String> {
        let dependent: Vec<usize> = embedding.dependent_velocities().collect();
        let independent: Vec<usize> = (0..self.n).filter(|i| !dependent.contains(i)).collect();
        let chosen_rows: Vec<usize> = embedding.chosen_rows().collect();
        let positions: Vec<usize> =
            chosen_rows.iter().filter_map(|row| self.rows.iter().position(|x| x == row)).collect();
        let (jacobian, weights) = self.balanced();
        let dependent_block =
            DMatrix::from_fn(positions.len(), dependent.len(), |i, j| jacobian[(positions[i], dependent[j])]);
        let independent_block = DMatrix::from_fn(positions.len(), independent.len(), |i, j| {
            jacobian[(positions[i], independent[j])]
        });
        let gamma =
            DVector::from_fn(positions.len(), |i, _| weights[positions[i]] * self.gamma[positions[i]]);
        let singular = "does not apply: the block of the dependent coordinates is singular here";
        let offset_on_dependent =
            solution(dependent_block.clone(), DMatrix::from_column_slice(gamma.len(), 1, gamma.as_slice()))
                .ok_or(singular)?;
        let by_independent = -solution(dependent_block.clone(), independent_block).ok_or(singular)?;
        // All accelerations from the independent ones: â = c + B â_I.
        let mut basis = DMatrix::zeros(self.n, independent.len());
        let mut offset = DVector::zeros(self.n);
        for (i, row) in dependent.iter().enumerate() {
            basis.row_mut(*row).copy_from(&by_independent.row(i));
            offset[*row] = offset_on_dependent[i];
        }
        independent.iter().enumerate().for_each(|(j, row)| basis[(*row, j)] = 1.0);
        // The projected equations BᵀM̂B â_I = Bᵀ(Q̂ − M̂ c).
        let mass = self.balanced_mass();
        let force = DVector::from_fn(self.n, |i, _| self.scale[i] * self.force[i]);
        let reduced = basis.transpose() * &mass * &basis;
        let right = basis.transpose() * (&force - &mass * &offset);
        let independent_accelerations = reduced
            .cholesky()
            .ok_or("does not apply: no inertia on the motions that are left")?
            .solve(&right);
        let a = offset + basis * independent_accelerations;
        let reaction = &mass * &a - force;
        let dependent_reaction = DMatrix::from_fn(dependent.len(), 1, |i, _| reaction[dependent[i]]);
        let on_rows = solution(dependent_block.transpose(), dependent_reaction).ok_or(singular)?;
        let mut lambda = DVector::zeros(self.rows.len());
        positions.iter().zip(on_rows.iter()).for_each(|(place, x)| lambda[*place] = weights[*place] * x);
        let a = DVector::from_fn(self.n, |i, _| self.scale[i] * a[i]);
        Ok(self.result::<M>(&a, &lambda))
    }
}

/// A⁻¹ B; also for an A without rows, for which nalgebra's decomposition panics.
fn solution(a: DMatrix<f64>, b: DMatrix<f64>) -> Option<DMatrix<f64>> {
    if a.is_empty() { Some(b) } else { a.full_piv_lu().solve(&b) }
}
