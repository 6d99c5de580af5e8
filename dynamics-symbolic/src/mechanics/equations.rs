//! What is derived from a model. All nodes live in the model's graph.

use crate::graph::NodeId;

/// How M and the Coriolis terms were derived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivation {
    /// T = Σ ½ w vᵀv with every v a true time derivative: M = JᵀWJ, c = Jᵀ(W v̇₀).
    VelocityForm,
    /// p = ∂L/∂q̇ by a reverse sweep, M = ∂p/∂q̇ by forward sweeps, Coriolis as directional derivative of p along q̇ minus ∂L/∂q.
    Momenta,
    /// Part of T in velocity form, the rest by momenta.
    Mixed,
}

/// A pivot of M = LDLᵀ, to be compared with the diagonal element that it came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pivot {
    /// Index of the coordinate.
    pub coordinate: usize,
    /// The pivot Dᵢ.
    pub pivot: NodeId,
    /// Mᵢᵢ.
    pub diagonal: NodeId,
}

/// A scalar with a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    /// The name, as shown to users.
    pub name: String,
    /// Unit as text, empty where unknown or 1.
    pub unit: String,
    /// Its value.
    pub node: NodeId,
}

/// Derivatives of q̈; N coordinates, W inputs, P parameters.
#[derive(Clone, Debug)]
pub struct Jacobians {
    /// ∂q̈ᵢ/∂qⱼ, N×N.
    pub by_q: Vec<Vec<NodeId>>,
    /// ∂q̈ᵢ/∂q̇ⱼ, N×N.
    pub by_u: Vec<Vec<NodeId>>,
    /// ∂q̈ᵢ/∂wⱼ, N×W.
    pub by_inputs: Vec<Vec<NodeId>>,
    /// ∂q̈ᵢ/∂pⱼ, N×P.
    pub by_parameters: Vec<Vec<NodeId>>,
}

/// The equations of motion M q̈ = Q and what is derived from them; N coordinates.
#[derive(Clone, Debug)]
pub struct Equations {
    /// How they were derived.
    pub derivation: Derivation,
    /// M(q,t), N×N, symmetric.
    pub mass_matrix: Vec<Vec<NodeId>>,
    /// Q(q,q̇,t).
    pub generalized_force: Vec<NodeId>,
    /// q̈ = M⁻¹Q.
    pub accelerations: Vec<NodeId>,
    /// Pivots met on the way.
    pub pivots: Vec<Pivot>,
    /// ∂L/∂q̇.
    pub momenta: Vec<NodeId>,
    /// q̇·∂L/∂q̇ − L.
    pub energy_function: NodeId,
    /// T and V; `None` for models that give L directly.
    pub energies: Option<(NodeId, NodeId)>,
    /// Power of every force, every dissipation function, and `explicit time` where L contains t or inputs; dE/dt is their sum.
    pub powers: Vec<Named>,
    /// Conserved quantities: the energy function, momenta of ignorable coordinates and of constant combinations.
    pub conserved: Vec<Named>,
    /// Derivatives of q̈, or how many nodes it had taken when deriving them was given up.
    pub jacobians: Result<Jacobians, usize>,
    /// Outputs, flattened, with accelerations replaced by their values.
    pub outputs: Vec<Named>,
    /// Events, with accelerations replaced by their values.
    pub events: Vec<Named>,
    /// Whether an output was declared in terms of accelerations, so that evaluating it can meet a singular M.
    pub outputs_use_accelerations: bool,
    /// Likewise for events.
    pub events_use_accelerations: bool,
}
