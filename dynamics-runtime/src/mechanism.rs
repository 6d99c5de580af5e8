//! Questions about the constraints of a model: reactions, degrees of freedom, kinematic analysis.

use alloc::vec::Vec;

use crate::constrain::compare::{Comparison, compare};
use crate::constrain::mechanism::degrees_of_freedom;
use crate::constrain::{self, ConstraintReaction};
use crate::error::SolveError;
use crate::kinematics::Analysis;
use crate::simulate::Simulate;

/// Questions about the constraints of a model at a state; implemented for every model.
pub trait Mechanism: Simulate {
    /// λ at a state, by rows. Those of least norm where constraints repeat each other.
    ///
    /// # Errors
    /// No mass matrix on the motions that the constraints leave, contradictory constraints, constraints that
    /// are not finite, friction without a solution, an input that they depend on and that was not set.
    fn multipliers(&self, state: &Self::State) -> Result<Self::Rows, SolveError> {
        constrain::multipliers(self, state)
    }

    /// What each constraint does, in the order of declaration, the holonomic ones first. Each is printed as a
    /// line: `for reaction in model.reactions(&state)? { println!("{reaction}"); }`.
    ///
    /// # Errors
    /// As [`Mechanism::multipliers`].
    fn reactions(&self, state: &Self::State) -> Result<Vec<ConstraintReaction<Self::Vector>>, SolveError> {
        constrain::reactions(self, state)
    }

    /// Coordinates less independent constraints that hold at a state: the dimension of the admissible
    /// velocities.
    ///
    /// # Errors
    /// A constraint that is not finite.
    fn degrees_of_freedom(&self, state: &Self::State) -> Result<usize, SolveError> {
        degrees_of_freedom(self, state)
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

    /// Opens a kinematic analysis. All coordinates of `guess` are guesses; those of the positions that fulfil
    /// the constraints near it are taken. Its time is where the motion begins; its velocities are not looked
    /// at.
    fn kinematics(&self, guess: Self::State) -> Analysis<'_, Self> {
        Analysis::new(self, guess)
    }
}

impl<M: Simulate> Mechanism for M {}
