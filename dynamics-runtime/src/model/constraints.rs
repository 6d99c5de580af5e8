//! The constraints of a model: rows, their evaluations, and the code that solves for accelerations with them.
//!
//! From a `#[holonomic]` function to a projected row:
//!
//! 1. `Elaborator::constraint` (`dynamics-macros/src/elaborate/constraints.rs`) makes its value a row.
//! 2. `ConstraintTerms::of` (`dynamics-symbolic/src/mechanics/constraints.rs`) derives Φ̇, Φ_q and γ.
//! 3. `Emission::constraints` (`dynamics-macros/src/emit/traits/constraints.rs`) emits them as methods of
//!    [`Constraints`]: `residual`, `velocity_residual`, `jacobian`, `gamma`.
//! 4. `RightHandSide::project_end` (`simulate/right_hand_side.rs`) projects the end of a step, by
//!    `project_positions` and `project_velocities` (`constrain/project.rs`), which call these methods.

use core::any::TypeId;
use core::fmt::Debug;
use core::ops::Index;

use nalgebra::SVector;

use super::{Dynamics, Kink, Vector};
use crate::declaration::{Block, Constraint, Quantity, SolverKind};

/// q̈ and λ of a model with N coordinates and R rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solved<V, R> {
    /// q̈.
    pub accelerations: V,
    /// λ; 0 for rows of released constraints.
    pub multipliers: R,
}

/// Where [`Constraints::terms`] writes; matrices by rows. N coordinates, R rows.
#[derive(Debug)]
pub struct Terms<'a> {
    /// M, N×N.
    pub mass: &'a mut [f64],
    /// Q, N; without what depends on multipliers where [`Constraints::FRICTION`] (there
    /// [`Constraints::friction`] gives all of it).
    pub force: &'a mut [f64],
    /// Φ_q joined by A, R×N.
    pub jacobian: &'a mut [f64],
    /// γ, R.
    pub gamma: &'a mut [f64],
}

/// Memory that solvers work in, without allocation: an array whose length the generated code computes by
/// [`crate::constrain::workspace_len`].
pub trait Workspace {
    /// All zero.
    fn new() -> Self;
    /// The memory.
    fn as_mut_slice(&mut self) -> &mut [f64];
}

impl<const K: usize> Workspace for [f64; K] {
    #[inline]
    fn new() -> Self {
        [0.0; K]
    }
    #[inline]
    fn as_mut_slice(&mut self) -> &mut [f64] {
        self
    }
}

/// The constraints of a model; a model without any has no rows. Signs:
///
/// ```text
/// M(q,t) q̈ = Q(q,q̇,t) + Φ_qᵀ λ        Φ_q q̈ = γ        reaction = +Φ_qᵀ λ
/// γ = −(Φ_q q̇)_q q̇ − 2 Φ_qt q̇ − Φ_tt    rows A q̇ + b = 0 join Φ_q with their own γ
/// ```
///
/// R rows in all: the holonomic constraints first, H rows, then the nonholonomic ones, K rows; within each
/// kind in the order of declaration. Switched constraints have their rows whether they hold or not.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no equations of motion; put `#[dynamics]` on the `impl` block with its energies",
    label = "no `#[dynamics] impl` for this"
)]
pub trait Constraints: Dynamics {
    /// One number per row: `SVector<f64, R>`.
    type Rows: Vector;
    /// One number per holonomic row: `SVector<f64, H>`.
    type Residual: Vector;
    /// `SMatrix<f64, R, N>`.
    type Jacobian: Copy + PartialEq + Debug + Index<(usize, usize), Output = f64>;
    /// `SMatrix<f64, K, N>`.
    type VelocityJacobian: Copy + PartialEq + Debug + Index<(usize, usize), Output = f64>;
    /// `SVector<f64, K>`.
    type VelocityOffset: Vector;
    /// `[f64; workspace_len(N, R)]`.
    type Workspace: Workspace;

    /// The constraints in the order of their rows.
    const CONSTRAINTS: &'static [Constraint];
    /// The rows by name, `closure.x`, with the unit of Φ or of A q̇ + b.
    const ROWS: &'static [Quantity];
    /// The solver of q̈ and λ.
    const SOLVER: SolverKind;
    /// Which coordinates are eliminated by which rows, in order; empty where the generated code does not
    /// eliminate coordinates.
    const BLOCKS: &'static [Block] = &[];
    /// Whether applied forces depend on reactions.
    const FRICTION: bool = false;
    /// Whether M comes from a kinetic energy, so that negative inertia of an admissible motion is an error.
    const KINETIC: bool = false;

    /// Φ(q,t), zero on every motion.
    fn residual(&self, state: &Self::State) -> Self::Residual;
    /// Φ̇ = Φ_q q̇ + Φ_t joined by A q̇ + b, zero on every motion.
    fn velocity_residual(&self, state: &Self::State) -> Self::Rows;
    /// Φ_q joined by A.
    fn jacobian(&self, state: &Self::State) -> Self::Jacobian;
    /// A alone: the nonholonomic rows.
    fn velocity_jacobian(&self, state: &Self::State) -> Self::VelocityJacobian;
    /// b alone: the nonholonomic rows.
    fn velocity_offset(&self, state: &Self::State) -> Self::VelocityOffset;
    /// γ.
    fn gamma(&self, state: &Self::State) -> Self::Rows;
    /// M, Q, Φ_q and γ at once.
    fn terms(&self, state: &Self::State, terms: &mut Terms<'_>);
    /// Q and ∂Q/∂λ (N×R by rows) where applied forces depend on reactions; called only where
    /// [`Constraints::FRICTION`].
    fn friction(
        &self,
        _state: &Self::State,
        _multipliers: &Self::Rows,
        _force: &mut [f64],
        _by_multipliers: &mut [f64],
    ) {
    }
    /// How many kinks [`Constraints::reaction_kinks`] writes, at most [`MAX_KINKS`](super::MAX_KINKS).
    const REACTION_KINKS: usize = 0;
    /// Where the accelerations are not smooth because of reactions: |λ| in a friction force.
    fn reaction_kinks(&self, _state: &Self::State, _multipliers: &Self::Rows, _kinks: &mut [Kink]) {}
    /// q̈ and λ by the generated code; `None` where it does not apply (a pivot is too small, a constraint is
    /// released) or does not exist. It evaluates the active set of the state. Models without constraints
    /// give q̈ alone.
    fn solve_unrolled(
        &self,
        constants: &Self::Constants,
        state: &Self::State,
    ) -> Option<Solved<Self::Vector, Self::Rows>>;
    /// q̈ alone, as [`Constraints::solve_unrolled`] has it, where that is less work.
    #[inline]
    fn accelerate_unrolled(&self, constants: &Self::Constants, state: &Self::State) -> Option<Self::Vector> {
        self.solve_unrolled(constants, state).map(|solved| solved.accelerations)
    }
    /// δ with M δ = Φ_qᵀμ for some μ, Φ_q δ = `right`, by the generated code; `None` as for
    /// [`Constraints::solve_unrolled`].
    fn correct_unrolled(
        &self,
        constants: &Self::Constants,
        state: &Self::State,
        right: &Self::Rows,
    ) -> Option<Self::Vector>;
    /// ∂(Φ_qᵀλ)/∂q (N×N), ∂γ/∂q (R×N), ∂γ/∂q̇ (R×N), by rows one after the other; NaN for a model that is too
    /// large for them.
    fn constraint_derivatives(&self, state: &Self::State, multipliers: &Self::Rows, values: &mut [f64]);
    /// M q̈ − Q − Φ_qᵀλ at given q̈ and λ, N, by code of its own. `false` where none was generated:
    /// [`Constraints::inverse_dynamics_with`] does without.
    #[inline]
    fn inverse_unrolled(
        &self,
        _state: &Self::State,
        _accelerations: &Self::Vector,
        _multipliers: &Self::Rows,
        _values: &mut [f64],
    ) -> bool {
        false
    }
    /// Inverse dynamics: the generalized forces, work-conjugate to the coordinates, that have to come on top
    /// of the model's own for these accelerations, M(q,t) q̈ − Q(q,q̇,t). Inputs have the values that they
    /// have in the state: with motors at 0 it is what the motors have to give. Reactions of constraints are
    /// part of it (and forces that depend on reactions are those without any);
    /// [`Constraints::inverse_dynamics_with`] takes reactions that are known.
    ///
    /// Of bodies that hang on one another by one recursion outward and one inward: operations in proportion
    /// to the joints, and M is not formed.
    #[inline]
    fn inverse_dynamics(&self, state: &Self::State, accelerations: &Self::Vector) -> Self::Vector {
        self.inverse_dynamics_with(state, accelerations, &Self::Rows::zeros())
    }
    /// The generalized forces that have to come on top of the model's own and of reactions with these
    /// multipliers for these accelerations, M q̈ − Q − Φ_qᵀλ: zero for q̈ and λ of a motion. NaN where forces
    /// depend on reactions and no code was generated for it.
    fn inverse_dynamics_with(
        &self,
        state: &Self::State,
        accelerations: &Self::Vector,
        multipliers: &Self::Rows,
    ) -> Self::Vector {
        let mut needed = Self::Vector::zeros();
        if self.inverse_unrolled(state, accelerations, multipliers, needed.as_mut_slice()) {
            return needed;
        }
        let (mass, force, jacobian) =
            (self.mass_matrix(state), self.generalized_force(state), self.jacobian(state));
        let (a, lambda) = (accelerations.as_slice(), multipliers.as_slice());
        for (i, needed) in needed.as_mut_slice().iter_mut().enumerate() {
            let carried: f64 = (0..a.len()).map(|j| mass[(i, j)] * a[j]).sum();
            let held: f64 = (0..lambda.len()).map(|row| jacobian[(row, i)] * lambda[row]).sum();
            *needed = if Self::FRICTION { f64::NAN } else { carried - force.as_slice()[i] - held };
        }
        needed
    }
    /// Derivatives of the equations before they are solved, at given q̈ and λ: with r = M q̈ − Q − Φ_qᵀλ (N)
    /// joined by Φ̈ = Φ_q q̈ − γ (R), ∂r/∂q ((N + R)×N), ∂r/∂q̇ ((N + R)×N), ∂r/∂w ((N + R)×W) for W inputs,
    /// then the derivatives of [`Constraints::velocity_residual`] by q (R×N); by rows, one after the other.
    /// `false` where no code for them was generated.
    #[inline]
    fn variations(
        &self,
        _state: &Self::State,
        _accelerations: &Self::Vector,
        _multipliers: &Self::Rows,
        _values: &mut [f64],
    ) -> bool {
        false
    }
    /// Derivatives of the outputs (Y of them, as [`Outputs::OUTPUTS`](super::Outputs::OUTPUTS) has them) at
    /// given q̈ and λ: ∂y/∂q, ∂y/∂q̇, ∂y/∂q̈ (each Y×N), ∂y/∂λ (Y×R), ∂y/∂w (Y×W for W inputs); by rows, one
    /// after the other. `false` where no code for them was generated.
    #[inline]
    fn output_variations(
        &self,
        _state: &Self::State,
        _accelerations: &Self::Vector,
        _multipliers: &Self::Rows,
        _values: &mut [f64],
    ) -> bool {
        false
    }
    /// The constraint whose function has this type: index into [`Constraints::CONSTRAINTS`].
    fn constraint_of(function: TypeId) -> Option<usize>;
}

/// No constraint rows.
pub type NoRows = SVector<f64, 0>;
/// A matrix without rows.
pub type NoMatrix<const N: usize> = nalgebra::SMatrix<f64, 0, N>;
