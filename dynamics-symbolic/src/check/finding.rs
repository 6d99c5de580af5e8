//! What the checks find, with the values that a message needs; the wording is the caller's.

mod constraints;

use crate::graph::Origin;

pub use constraints::{Combination, ConstraintFinding};

/// A mistake in a model.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Finding {
    /// A declared coordinate, parameter, input or function that nothing reads.
    Unused {
        /// `coordinate`, `parameter`, `input`, `function`.
        what: &'static str,
        /// Its name.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// M has no inverse at any state: a direction of motion without inertia.
    NoInertia {
        /// The null direction as text, for example `x - 2 y`; a single name where one coordinate has none.
        direction: String,
        /// Declarations of the coordinates involved.
        origins: Vec<Origin>,
    },
    /// An output or event divides by an expression that is zero on every motion.
    ZeroDenominator,
    /// A smooth parameter function is differentiated more often than it can: three times.
    TooManyDerivatives {
        /// Its name.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// More operations than rustc can be trusted with.
    TooLarge {
        /// Function that is too large.
        function: String,
        /// Its operations.
        operations: usize,
        /// The limit.
        limit: usize,
    },
    /// A kinetic energy that is not a polynomial of second degree in the velocities; `#[lagrangian]` would
    /// take it.
    NotQuadratic {
        /// Name of the function.
        name: String,
        /// Its declaration.
        origin: Origin,
        /// Velocities in it are chosen, and not by velocities: a position has branches.
        chooses: bool,
    },
    /// An energy that jumps where a choice by place, or a position chosen by time, changes.
    EnergyJumps {
        /// Name of the function.
        name: String,
        /// Its declaration.
        origin: Origin,
        /// A potential, or the part of a Lagrangian that is left at rest.
        at_rest: bool,
    },
    /// Something that its role cannot have: accelerations in an energy, velocities in a potential, inputs
    /// whose rates would be needed.
    Contains {
        /// The role: `kinetic energy`, `potential energy`, `Lagrangian`, `dissipation function`, `force`.
        role: &'static str,
        /// Name of the function.
        name: String,
        /// What it contains: `accelerations`, `velocities`, `inputs`.
        what: &'static str,
        /// Why it cannot.
        reason: &'static str,
        /// Its declaration.
        origin: Origin,
    },
    /// Something that is declared and changes nothing.
    NoEffect {
        /// The role: `kinetic energy`, `potential energy`, `Lagrangian`, `dissipation function`, `force`,
        /// `event`.
        role: &'static str,
        /// Name of the function.
        name: String,
        /// What it lacks, for example `does not depend on any coordinate`.
        reason: &'static str,
        /// Its declaration.
        origin: Origin,
    },
    /// A direction of motion in which the kinetic energy is negative: a sign is wrong somewhere, or a nominal
    /// value.
    NegativeInertia {
        /// The direction as text, as in [`Finding::NoInertia`].
        direction: String,
        /// Whether it was found at the nominal values; otherwise it is so for positive parameters of any
        /// size.
        nominal: bool,
        /// Declarations of the coordinates involved.
        origins: Vec<Origin>,
    },
    /// A frame turned by a matrix that is no rotation where the constraints hold.
    NotKeptARotation {
        /// Name of the function.
        name: String,
        /// The coordinates that it is made of.
        of: Vec<String>,
        /// Where the frame is made.
        origin: Origin,
    },
    /// A speed that is not linear in the velocities.
    SpeedNotLinear {
        /// Its name, array elements as `w[0]`.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// More or fewer speeds than the constraints leave velocities free.
    SpeedsCount {
        /// How many are declared.
        speeds: usize,
        /// How many there have to be.
        needed: usize,
        /// Number of coordinates.
        coordinates: usize,
        /// Independent rows of constraints that always hold.
        rank: usize,
        /// Declaration of the first.
        origin: Origin,
    },
    /// A speed that follows from others and the constraints, so that some velocities follow from none.
    SpeedDependent {
        /// Its name.
        name: String,
        /// The speeds and constraint rows that it follows from.
        of: Vec<String>,
        /// Its declaration.
        origin: Origin,
    },
    /// A mistake in the constraints.
    Constraint(ConstraintFinding),
}
