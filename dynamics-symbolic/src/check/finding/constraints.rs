//! What the checks of constraints find.

use crate::graph::Origin;

/// A mistake in the constraints. Rows are named with their component: `closure[1].x`.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ConstraintFinding {
    /// A row that contains something that has no place in it: accelerations, reactions, inputs, modes.
    Contains {
        /// Name of the row.
        name: String,
        /// What it contains: `accelerations`, `reactions`, `inputs`, `modes`.
        what: &'static str,
        /// Why it cannot.
        reason: &'static str,
        /// Its declaration.
        origin: Origin,
    },
    /// A holonomic row that contains velocities; it is a nonholonomic one.
    HolonomicWithVelocities {
        /// Name of the row.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// A nonholonomic row that contains no velocities; it is a holonomic one.
    NonholonomicWithoutVelocities {
        /// Name of the row.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// A nonholonomic row that is not linear in the velocities.
    NotLinear {
        /// Name of the row.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// A row that is zero in every state.
    AlwaysZero {
        /// Name of the row.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// A row that involves no coordinate and no velocity: it restricts nothing, or holds never.
    WithoutCoordinate {
        /// Name of the row.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// A row that holds wherever others hold.
    Repeats {
        /// Name of the row.
        name: String,
        /// What it repeats.
        of: Combination,
        /// Whether it does so only where the constraints hold, rather than everywhere.
        on_manifold: bool,
        /// Its declaration.
        origin: Origin,
    },
    /// A row that touches others where the constraints hold, as the third of three rods between beads on one
    /// line does: it holds positions that they leave free, but no velocities.
    Tangent {
        /// Name of the row.
        name: String,
        /// What its gradient is a combination of.
        to: Combination,
        /// Its declaration.
        origin: Origin,
    },
    /// A row that cannot hold together with others.
    Contradicts {
        /// Name of the row.
        name: String,
        /// What it differs from by something that does not depend on the motion.
        with: Combination,
        /// Its declaration.
        origin: Origin,
    },
    /// Newton's method finds no state in which all constraints hold, from any of several starts at the
    /// nominal values.
    Unsatisfiable {
        /// The rows that are missed at the closest approach found, and by how much, as distances: |Φ| /
        /// ‖Φ_q‖.
        missed: Vec<(String, f64)>,
        /// Declaration of the last of them.
        origin: Origin,
    },
    /// More independent rows than coordinates: at least one of them is too much.
    TooMany {
        /// Number of rows that are not marked as redundant.
        rows: usize,
        /// Number of coordinates.
        coordinates: usize,
        /// The first row that is too much.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// A constraint that is marked as redundant and repeats nothing.
    RedundantInVain {
        /// Name of the constraint.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// Nonholonomic rows that can be integrated, wholly or partly.
    Integrable {
        /// How many independent combinations can be.
        integrable: usize,
        /// Of how many nonholonomic rows that share coordinates.
        of: usize,
        /// The rows that take part in them.
        names: Vec<String>,
        /// Whether the rows leave no velocity free: then they can be integrated whatever they are, but hardly
        /// ever in closed form.
        determined: bool,
        /// Declaration of the first.
        origin: Origin,
    },
    /// A constraint that is marked as integrable and is not.
    IntegrableInVain {
        /// Name of the constraint.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// A row whose gradient vanishes wherever it holds, as that of Φ² does, or is infinite, as that of a
    /// root: no force can hold it.
    GradientVanishes {
        /// Name of the row.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// A direction of motion that the constraints leave free and no kinetic energy moves.
    FreeWithoutInertia {
        /// The direction as text, as in [`Finding::NoInertia`](crate::check::Finding::NoInertia).
        direction: String,
        /// Declarations of the coordinates involved.
        origins: Vec<Origin>,
    },
}

/// A linear combination of rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Combination {
    /// With constant rational coefficients, as text: `pin[0] - pin[2]`.
    Constant(String),
    /// With coefficients that depend on parameters or the state: the rows that take part.
    Of(Vec<String>),
}
