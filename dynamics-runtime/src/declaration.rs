//! The declarations of a model: plain records, without evaluations.
//!
//! Errors name them, and the traits of [`model`](crate::model) have constants of them, so they stand below
//! both. Users find them in `model`.

mod angle_set;
mod assumption;
mod constraint;
mod top_contributors;
mod unit_dimension;

pub use angle_set::AngleSet;
pub use assumption::{Assumption, AssumptionKind, AssumptionViolation};
pub use constraint::{Block, Constraint, ConstraintKind, SolverKind};
pub use top_contributors::TopContributors;
pub use unit_dimension::UnitDimension;

/// A named scalar of a model, with its unit as the user declared it or as it was inferred (`""` where unknown
/// or 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// The name, array elements as `theta[3]`.
    pub name: &'static str,
    /// The unit, for example `m/s^2`.
    pub unit: &'static str,
    /// What it measures: the dimension of the unit.
    pub dimension: UnitDimension,
}

impl Quantity {
    /// A quantity without unit.
    #[must_use]
    pub const fn without_unit(name: &'static str) -> Self {
        Self { name, unit: "", dimension: UnitDimension::Other }
    }

    /// Whether it is an angle, declared or inferred in rad.
    #[must_use]
    pub const fn is_angle(&self) -> bool {
        matches!(self.dimension, UnitDimension::Angle)
    }
}

/// What kind of quantity is conserved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ConservedKind {
    /// The energy T + V.
    Energy,
    /// The energy function Σ q̇ᵢ ∂L/∂q̇ᵢ − L where that is not T + V (Jacobi's integral).
    EnergyFunction,
    /// A constant combination of the momenta ∂L/∂q̇ᵢ.
    Momentum,
}

impl ConservedKind {
    /// Whether it is the energy, or the energy function in its place.
    #[must_use]
    pub const fn is_energy(self) -> bool {
        matches!(self, Self::Energy | Self::EnergyFunction)
    }
}

/// A quantity that no motion of a model changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConservedQuantity {
    /// What it is.
    pub kind: ConservedKind,
    /// `energy`, `energy function`, `momentum of phi`.
    pub name: &'static str,
    /// Its unit, `""` where unknown or 1.
    pub unit: &'static str,
}

/// Whether motions of a model can be expanded into Taylor series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expansion {
    /// By the model's own code.
    Generated {
        /// Whether some value is a choice (`if`, min, max, abs, signum): a series is that of the branch at
        /// its start.
        chooses: bool,
    },
    /// There is no code for it.
    None {
        /// Why, in words: `it has constraints`.
        reason: &'static str,
    },
}
