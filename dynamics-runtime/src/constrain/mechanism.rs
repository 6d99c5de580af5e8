//! Questions about the constraints of a model: reactions by name, degrees of freedom.

use alloc::vec::Vec;
use core::fmt;

use super::{Embedding, FactoredEquations, Gradients, check_inputs, holds, solve_once, with_workspace};
use crate::error::SolveError;
use crate::linalg::add_scaled;
use crate::model::{Constraints, ModelState, Vector};

/// The reaction of a constraint.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstraintReaction<V> {
    /// Name of the constraint.
    pub name: &'static str,
    /// λ of its rows, conjugate to its components: a force where Φ is a length, and the force at a point
    /// where Φ is a vector between points. 0 while the constraint is released.
    pub multipliers: Vec<f64>,
    /// Φ_qᵀλ, the generalized force on each coordinate.
    pub generalized_force: V,
    /// Whether the constraints determine it. Where they repeat each other, other distributions of the
    /// reactions are possible; the one of least norm is given.
    pub unique: bool,
}

/// One line: `rope  λ = 12.3456`, and `not unique` where other constraints repeat it.
impl<V> fmt::Display for ConstraintReaction<V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<16}λ =", self.name)?;
        for (i, multiplier) in self.multipliers.iter().enumerate() {
            // Minus zero is zero.
            write!(f, "{}{:>14.6e}", if i == 0 { " " } else { ", " }, multiplier + 0.0)?;
        }
        f.write_str(if self.unique { "" } else { "  not unique" })
    }
}

/// See [`Mechanism::multipliers`](crate::mechanism::Mechanism::multipliers).
pub fn multipliers<M: Constraints>(model: &M, state: &M::State) -> Result<M::Rows, SolveError> {
    let multipliers = solve_once(model, &model.constants()?, state)?.multipliers;
    check_inputs::<M>(state, multipliers.as_slice())?;
    Ok(multipliers)
}

/// See [`Mechanism::reactions`](crate::mechanism::Mechanism::reactions).
pub fn reactions<M: Constraints>(
    model: &M,
    state: &M::State,
) -> Result<Vec<ConstraintReaction<M::Vector>>, SolveError> {
    let multipliers = multipliers(model, state)?;
    let unique = unique_rows(model, state)?;
    Ok(with_workspace::<M, _>(|workspace| {
        let gradients = Gradients::of(model, state, workspace);
        let reaction = |constraint: &crate::model::Constraint| {
            let rows = constraint.first..constraint.first + constraint.rows;
            let mut generalized_force = M::Vector::zeros();
            for row in rows.clone() {
                add_scaled(generalized_force.as_mut_slice(), multipliers[row], gradients.row(row));
            }
            ConstraintReaction {
                name: constraint.name,
                multipliers: multipliers.as_slice()[rows.clone()].to_vec(),
                generalized_force,
                unique: unique[rows].iter().all(|x| *x),
            }
        };
        M::CONSTRAINTS.iter().map(reaction).collect()
    }))
}

/// See [`Mechanism::degrees_of_freedom`](crate::mechanism::Mechanism::degrees_of_freedom).
pub(crate) fn degrees_of_freedom<M: Constraints>(model: &M, state: &M::State) -> Result<usize, SolveError> {
    let embedding = with_workspace::<M, _>(|workspace| Embedding::new(model, state, workspace))?;
    Ok(M::Vector::LEN - embedding.dependent_velocities().count())
}

/// Whether each row's multiplier is the same in all solutions.
fn unique_rows<M: Constraints>(model: &M, state: &M::State) -> Result<Vec<bool>, SolveError> {
    let active_set = state.active_set();
    with_workspace::<M, _>(|workspace| {
        let Some(mut factored) =
            FactoredEquations::new(model, state, &|row| holds::<M>(active_set, row), false, workspace)?
        else {
            return Ok(alloc::vec![false; M::Rows::LEN]);
        };
        Ok((0..M::Rows::LEN).map(|row| factored.system.is_unique(row)).collect())
    })
}
