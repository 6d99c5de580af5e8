//! What is derived from a model. All nodes live in the model's graph.

use crate::algebra::Unrolled;
use crate::calculus::ZeroDenominator;
use crate::graph::{Dependence, Graph, NodeId};

use super::model::Model;

/// Why equations could not be derived.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Underivable {
    /// A pivot of M is identically zero: the coordinate's index.
    Singular(usize),
    /// M is too large to be emitted, by so many operations or nodes, and nothing solves the equations without
    /// it.
    TooLarge(usize),
    /// A denominator in an output or event is identically zero once the accelerations are put in.
    ZeroDenominator,
}

impl From<ZeroDenominator> for Underivable {
    fn from(_: ZeroDenominator) -> Self {
        Self::ZeroDenominator
    }
}

/// How M and the Coriolis terms were derived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivation {
    /// T = Σ ½ w vᵀv with every v a true time derivative: M = JᵀWJ, c = Jᵀ(W v̇₀).
    VelocityForm,
    /// p = ∂L/∂q̇ by a reverse sweep, M = ∂p/∂q̇ by forward sweeps, Coriolis as directional derivative of p
    /// along q̇ minus ∂L/∂q.
    Momenta,
    /// Part of T in velocity form, the rest by momenta.
    Mixed,
    /// Rigid bodies that hang on one another: M from composite inertias, Q by velocities and accelerations
    /// outward and forces inward; what else there is in T as above.
    Bodies,
}

/// A pivot of M = LDLᵀ, to be compared with the diagonal element that it came from; where the forces in rods
/// are solved for, a pivot of their system, or an inertia that it divides by, compared with itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pivot {
    /// Index of the coordinate.
    pub coordinate: usize,
    /// The pivot Dᵢ.
    pub pivot: NodeId,
    /// Mᵢᵢ, or the diagonal element of the rods' system.
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

/// What kind of quantity is conserved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConservedKind {
    /// T + V.
    Energy,
    /// Σ q̇ᵢ ∂L/∂q̇ᵢ − L where that is not T + V (Jacobi's integral).
    EnergyFunction,
    /// A constant combination of the momenta ∂L/∂q̇ᵢ.
    Momentum,
}

/// A quantity that no motion changes.
#[derive(Clone, Debug)]
pub struct ConservedQuantity {
    /// What it is.
    pub kind: ConservedKind,
    /// Its name, unit and value.
    pub quantity: Named,
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

/// Derivatives of the equations before they are solved, at given q̈ and λ, whose symbols they contain; N
/// coordinates, R rows, W inputs. With
///
/// ```text
/// r = M q̈ − Q − Φ_qᵀλ (N), joined by Φ̈ = Φ_q q̈ − γ (R)
/// ```
///
/// they are what small motions beside a motion are made of. They need no solution: they are there where rows
/// repeat each other, too.
#[derive(Clone, Debug)]
pub struct Variations {
    /// ∂r/∂q, (N + R)×N.
    pub by_q: Vec<Vec<NodeId>>,
    /// ∂r/∂q̇, (N + R)×N.
    pub by_u: Vec<Vec<NodeId>>,
    /// ∂r/∂w, (N + R)×W.
    pub by_inputs: Vec<Vec<NodeId>>,
    /// ∂(Φ_q q̇ + Φ_t)/∂q joined by ∂(A q̇ + b)/∂q, R×N.
    pub velocity_by_q: Vec<Vec<NodeId>>,
}

impl Variations {
    /// One matrix after the other, by rows.
    #[must_use]
    pub fn all(&self) -> Vec<NodeId> {
        [&self.by_q, &self.by_u, &self.by_inputs, &self.velocity_by_q]
            .into_iter()
            .flatten()
            .flatten()
            .copied()
            .collect()
    }
}

/// Why there are no derivatives of q̈.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoDerivatives {
    /// The number of nodes when deriving them was given up.
    TooLarge(usize),
    /// q̈ is found by the general solver, at run time.
    General,
    /// M is left out, and q̈ found without it.
    NoMassMatrix,
}

/// The equations of motion M q̈ = Q and what is derived from them; N coordinates.
#[derive(Clone, Debug)]
pub struct Equations {
    /// How they were derived.
    pub derivation: Derivation,
    /// M(q,t), N×N, symmetric; without rows where it is left out as too large to be emitted.
    pub mass_matrix: Vec<Vec<NodeId>>,
    /// M q̈ with symbols for q̈ where M itself is left out: columns of M follow one by one. Empty elsewhere.
    pub mass_product: Vec<NodeId>,
    /// Q(q,q̇,t).
    pub generalized_force: Vec<NodeId>,
    /// q̈ = M⁻¹Q; empty where there are constraints, whose [`Solution`] has it.
    pub accelerations: Vec<NodeId>,
    /// Pivots met on the way; none where there are constraints, whose solution has guards.
    pub pivots: Vec<Pivot>,
    /// ∂L/∂q̇.
    pub momenta: Vec<NodeId>,
    /// q̇·∂L/∂q̇ − L.
    pub energy_function: NodeId,
    /// T and V; `None` for models that give L directly.
    pub energies: Option<(NodeId, NodeId)>,
    /// Power of every force, every dissipation function, and `explicit time` where L contains t or inputs;
    /// dE/dt is their sum.
    pub powers: Vec<Named>,
    /// Conserved quantities: the energy function, momenta of ignorable coordinates and of constant
    /// combinations.
    pub conserved: Vec<ConservedQuantity>,
    /// Derivatives of q̈, or why there are none.
    pub jacobians: Result<Jacobians, NoDerivatives>,
    /// Outputs, flattened, with accelerations replaced by their values.
    pub outputs: Vec<Named>,
    /// Events, with accelerations replaced by their values.
    pub events: Vec<Named>,
    /// Whether an output was declared in terms of accelerations or multipliers, so that evaluating it can
    /// meet a singular M.
    pub outputs_use_accelerations: bool,
    /// Likewise for events.
    pub events_use_accelerations: bool,
    /// The generalized speeds; `None` without any.
    pub speeds: Option<SpeedEquations>,
    /// What follows from the constraints; `None` without any. Where there are some, outputs, events and
    /// powers keep the symbols of accelerations and multipliers: the solution is put in at run time.
    pub constraints: Option<ConstraintEquations>,
}

impl Equations {
    /// What stands for M: its elements, or where it is left out M q̈.
    pub fn inertia(&self) -> impl Iterator<Item = &NodeId> {
        self.mass_matrix.iter().flatten().chain(&self.mass_product)
    }

    /// Whether M is left out.
    #[must_use]
    pub fn leaves_out_mass_matrix(&self) -> bool {
        !self.mass_product.is_empty()
    }

    /// Whether Q contains velocities, by themselves or through reactions. If not, M is constant: one that
    /// moves brings Coriolis terms.
    #[must_use]
    pub fn has_velocity_forces(&self, g: &Graph) -> bool {
        let moving = Dependence::RATES.with(Dependence::MULTIPLIERS).with(Dependence::ACCELERATIONS);
        self.generalized_force.iter().any(|force| g.dependence(*force).on(moving))
    }
}

impl Equations {
    /// Whether M depends on parameters alone.
    #[must_use]
    pub fn has_constant_mass(&self, g: &Graph) -> bool {
        // M q̈ stands for an M that is left out.
        let constant = Dependence::PARAMETERS.with(Dependence::ACCELERATIONS);
        self.inertia().all(|id| g.dependence(*id).within(constant))
    }

    /// Whether time stands in M, Q or the constraints.
    #[must_use]
    pub fn has_explicit_time(&self, g: &Graph) -> bool {
        let of_rows = self.constraints.iter().flat_map(|c| {
            let rows = c.residual.iter().chain(&c.velocity_residual).chain(&c.gamma);
            rows.chain(c.jacobian.iter().flatten())
        });
        let free = self.inertia().chain(&self.generalized_force);
        free.chain(of_rows).any(|id| g.dependence(*id).on(Dependence::TIME))
    }
}

/// Generalized speeds w = Y q̇ + y; N coordinates, S speeds.
#[derive(Clone, Debug)]
pub struct SpeedEquations {
    /// w, S.
    pub values: Vec<NodeId>,
    /// Y = ∂w/∂q̇, S×N.
    pub jacobian: Vec<Vec<NodeId>>,
    /// y = w at rest, S.
    pub offset: Vec<NodeId>,
    /// BᵀM B, S×S, where the equations are solved for ẇ because that takes fewer operations; else why they
    /// are not.
    pub inertia: Result<Vec<Vec<NodeId>>, NoSpeedForm>,
}

/// Why equations are not solved for the rates of the declared speeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoSpeedForm {
    /// Constraints are switched or marked as redundant.
    Constraints,
    /// In coordinates, too, they are left to the general solver.
    General,
    /// They could fail where those in coordinates do not.
    Unsafe,
    /// That takes no fewer operations.
    Longer,
}

/// What follows from the constraints; N coordinates, R rows, the first H of them holonomic. λ of a row is
/// `Symbol::Multiplier`.
#[derive(Clone, Debug)]
pub struct ConstraintEquations {
    /// The rows by name, `closure.x`; values Φ or A q̇ + b.
    pub rows: Vec<Named>,
    /// H.
    pub holonomic: usize,
    /// Φ(q,t), H.
    pub residual: Vec<NodeId>,
    /// Φ_q q̇ + Φ_t, joined by A q̇ + b; R.
    pub velocity_residual: Vec<NodeId>,
    /// Φ_q joined by A, R×N.
    pub jacobian: Vec<Vec<NodeId>>,
    /// Φ_t joined by b, R.
    pub velocity_offset: Vec<NodeId>,
    /// γ with Φ_q q̈ = γ, R.
    pub gamma: Vec<NodeId>,
    /// Q without the forces that contain reactions, N; Q itself where there are none.
    pub free_force: Vec<NodeId>,
    /// ∂Q/∂λ, N×R, where applied forces contain reactions; Q itself then contains multipliers.
    pub force_by_multipliers: Option<Vec<Vec<NodeId>>>,
    /// What implicit methods need, or how many nodes it had taken when deriving it was given up.
    pub derivatives: Result<ConstraintDerivatives, usize>,
    /// How q̈ and λ are found.
    pub solution: Solution,
    /// Likewise, on the graph, with some switched constraints released: all of them, and as many other sets
    /// as there is room for.
    pub released: Vec<Released>,
}

impl Released {
    /// What its programs are called after: `_without_floor_and_wall`.
    #[must_use]
    pub fn suffix(&self, model: &Model) -> String {
        let names: Vec<String> = self.modes.iter().map(|mode| model.mode_name(*mode as u32)).collect();
        format!("_without_{}", names.join("_and_"))
    }
}

/// The solution where some switched constraints are released.
#[derive(Clone, Debug)]
pub struct Released {
    /// Which, by their modes, ascending.
    pub modes: Vec<usize>,
    /// The solution; multipliers of the released rows are 0.
    pub unrolled: Unrolled,
}

/// Derivatives of the reaction and of γ; N coordinates, R rows.
#[derive(Clone, Debug)]
pub struct ConstraintDerivatives {
    /// ∂(Φ_qᵀλ)/∂q, N×N.
    pub reaction_by_q: Vec<Vec<NodeId>>,
    /// ∂γ/∂q, R×N.
    pub gamma_by_q: Vec<Vec<NodeId>>,
    /// ∂γ/∂q̇, R×N.
    pub gamma_by_u: Vec<Vec<NodeId>>,
}

/// How the equations M q̈ − Φ_qᵀλ = Q, Φ_q q̈ = γ are solved.
#[derive(Clone, Debug)]
pub enum Solution {
    /// On the graph.
    Unrolled(Box<Unrolled>),
    /// At run time, by the general rank-revealing solver; says why.
    General(General),
}

/// Why equations with constraints are left to the general solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum General {
    /// Rows are redundant, in every state or on the manifold.
    Redundant,
    /// Applied forces depend on the reactions.
    Friction,
    /// Every order of elimination meets a pivot that is zero in every state.
    NoPivots,
    /// The unrolled solution would take this many operations.
    TooLarge(usize),
}
