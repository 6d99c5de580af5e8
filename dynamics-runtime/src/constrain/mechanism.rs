//! What holds a model together: reactions by name, degrees of freedom, formulations side by side.

use alloc::vec::Vec;
use core::fmt;

use super::compare::{Comparison, compare};
use super::{Embedding, Factored, Gradients, check_inputs, holds, solve_once, with_workspace};
use crate::error::SolveError;
use crate::linalg::add_scaled;
use crate::model::{Constraints, ModelState, Vector};

/// What a constraint does to a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstraintReaction<V> {
    /// Name of the constraint.
    pub name: &'static str,
    /// λ of its rows, conjugate to its components: a force where Φ is a length, and, where Φ is a vector
    /// between points, the force there. 0 while the constraint is released.
    pub multipliers: Vec<f64>,
    /// Φ_qᵀλ, the generalized force on each coordinate.
    pub generalized_force: V,
    /// Whether the constraints determine it. Where they repeat each other it may be shared out in other ways;
    /// least norm is given.
    pub unique: bool,
}

/// One line: `rope  λ = 12.3456` and, where other constraints repeat it, that it is shared out.
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

/// Questions about the constraints of a model at a state; implemented for every model.
pub trait Mechanism: Constraints {
    /// λ at a state, by rows. Those of least norm where constraints repeat each other.
    ///
    /// # Errors
    /// No mass matrix on the motions that the constraints leave, contradictory constraints, constraints that
    /// are not finite, friction without a solution, an input that they depend on and that was not set.
    fn multipliers(&self, state: &Self::State) -> Result<Self::Rows, SolveError> {
        let multipliers = solve_once(self, &self.constants()?, state)?.multipliers;
        check_inputs::<Self>(state, multipliers.as_slice())?;
        Ok(multipliers)
    }

    /// What each constraint does, in the order of declaration, the holonomic ones first. Each is printed as a
    /// line: `for reaction in model.reactions(&state)? { println!("{reaction}"); }`.
    ///
    /// # Errors
    /// As [`Mechanism::multipliers`].
    fn reactions(&self, state: &Self::State) -> Result<Vec<ConstraintReaction<Self::Vector>>, SolveError> {
        let multipliers = Mechanism::multipliers(self, state)?;
        let unique = unique_rows(self, state)?;
        Ok(with_workspace::<Self, _>(|workspace| {
            let gradients = Gradients::of(self, state, workspace);
            let reaction = |constraint: &crate::model::Constraint| {
                let rows = constraint.first..constraint.first + constraint.rows;
                let mut generalized_force = Self::Vector::zeros();
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
            Self::CONSTRAINTS.iter().map(reaction).collect()
        }))
    }

    /// Coordinates less independent constraints that hold at a state: the dimension of the admissible
    /// velocities.
    ///
    /// # Errors
    /// A constraint that is not finite.
    fn degrees_of_freedom(&self, state: &Self::State) -> Result<usize, SolveError> {
        let embedding = with_workspace::<Self, _>(|workspace| Embedding::new(self, state, workspace))?;
        Ok(Self::Vector::LEN - embedding.dependent_velocities().count())
    }

    /// Accelerations and reactions by every formulation, and how far they are apart.
    ///
    /// ```text
    /// formulation                       accelerations  reactions
    /// general solver (null space)       reference      reference
    /// generated code (minimum degree)   2.2e-16        1.1e-16
    /// ```
    ///
    /// # Errors
    /// As [`Mechanism::multipliers`], of the general solver.
    fn compare_formulations(
        &self,
        state: &Self::State,
    ) -> Result<Comparison<Self::Vector, Self::Rows>, SolveError> {
        compare(self, &self.constants()?, state)
    }
}

impl<M: Constraints> Mechanism for M {}

/// Whether each row's multiplier is the same in all solutions.
fn unique_rows<M: Constraints>(model: &M, state: &M::State) -> Result<Vec<bool>, SolveError> {
    let modes = state.modes();
    with_workspace::<M, _>(|workspace| {
        let Some(mut factored) =
            Factored::new(model, state, &|row| holds::<M>(modes, row), false, workspace)?
        else {
            return Ok(alloc::vec![false; M::Rows::LEN]);
        };
        Ok((0..M::Rows::LEN).map(|row| factored.system.is_unique(row)).collect())
    })
}
