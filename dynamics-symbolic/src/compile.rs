//! The engine's driver: one line per pass.

use crate::check::Finding;
use crate::mechanics::{Equations, Model};
use crate::schedule::Program;

/// Programs of a model, one per function that the runtime's traits ask for. Results are flattened row by row.
#[derive(Clone, Debug)]
pub struct Programs {
    /// q̈ (N), then for every pivot Dᵢ and Mᵢᵢ. Staged: what depends on parameters alone is hoisted.
    pub accelerations: Program,
    /// M, N×N by rows.
    pub mass_matrix: Program,
    /// Q (N).
    pub generalized_force: Program,
    /// ∂L/∂q̇ (N).
    pub momenta: Program,
    /// E.
    pub energy_function: Program,
    /// T; only without `#[lagrangian]`.
    pub kinetic_energy: Option<Program>,
    /// V; only without `#[lagrangian]`.
    pub potential_energy: Option<Program>,
    /// Conserved quantities.
    pub conserved: Program,
    /// Powers.
    pub powers: Program,
    /// q̈ (N), ∂q̈/∂q (N×N by rows), ∂q̈/∂q̇ (N×N by rows), then Dᵢ and Mᵢᵢ for every pivot.
    pub state_jacobian: Program,
    /// ∂q̈/∂w (N×W by rows), then Dᵢ and Mᵢᵢ for every pivot.
    pub input_jacobian: Program,
    /// ∂q̈/∂p (N×P by rows), then Dᵢ and Mᵢᵢ for every pivot.
    pub parameter_jacobian: Program,
    /// Outputs, then, where any of them uses accelerations, Dᵢ and Mᵢᵢ for every pivot.
    pub outputs: Program,
    /// Events, likewise.
    pub events: Program,
}

/// A model with everything that was derived from it.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// The model; its graph holds all nodes.
    pub model: Model,
    /// The derived equations.
    pub equations: Equations,
    /// The programs to emit.
    pub programs: Programs,
    /// Degrees of freedom, conserved quantities, structure, cost.
    pub report: String,
    /// The derived program as stable text with operation counts.
    pub listing: String,
    /// Readable equations.
    pub equations_text: String,
    /// The equations in LaTeX.
    pub latex: String,
}

/// Derives, checks and schedules a model.
///
/// # Errors
/// Everything that the checks found.
pub fn compile(model: Model) -> Result<Compiled, Vec<Finding>> {
    let _ = model;
    Err(Vec::new())
}
