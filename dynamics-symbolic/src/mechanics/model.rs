//! What a model declares.

use super::picture::Picture;
use crate::graph::{Graph, NodeId, Origin, Symbol};

/// A model as declared: an expression graph and the roles of its nodes.
///
/// `Symbol::Coordinate(i)` and `Symbol::Rate(i)` belong to `coordinates[i]`, `Symbol::Input(i)` to
/// `inputs[i]`, `Symbol::Parameter(i)` to `parameters[i]`, `FunctionId(i)` to `functions[i]`.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Name of the struct.
    pub name: String,
    /// All expressions.
    pub graph: Graph,
    /// Generalized coordinates, arrays flattened, in the order of q.
    pub coordinates: Vec<Coordinate>,
    /// Generalized speeds, arrays flattened; together with the constraints that always hold they determine
    /// all velocities.
    pub speeds: Vec<Speed>,
    /// Inputs, arrays flattened.
    pub inputs: Vec<Input>,
    /// Scalar parameters; arrays, vectors, matrices flattened.
    pub parameters: Vec<Parameter>,
    /// Smooth parameter functions.
    pub functions: Vec<Function>,
    /// Energies and dissipation functions.
    pub energies: Vec<Energy>,
    /// Rigid bodies whose energies are among them and whose frames are reached by known steps. The equations
    /// that are derived from them are the same, and often shorter.
    pub bodies: Vec<Body>,
    /// Assumptions of bodies and frames. Some can be checked only during a run. They are not part of the
    /// derivation.
    pub assumptions: Vec<Assumption>,
    /// Applied forces.
    pub forces: Vec<Force>,
    /// Constraints, the holonomic ones first; their components in this order are the rows of Φ_q and of λ:
    /// `Symbol::Multiplier(i)`.
    pub constraints: Vec<Constraint>,
    /// Named results.
    pub outputs: Vec<Output>,
    /// Functions whose zero crossings are located.
    pub events: Vec<Event>,
    /// Nominal values of parameters, by index: what numeric checks may use. Not part of the derivation.
    pub nominal: Vec<(u32, f64)>,
    /// Rotations by three coordinates as angles. Not part of the derivation.
    pub angle_sets: Vec<AngleSet>,
    /// Declared names of parameters and functions that something outside of the derivation reads, such as a
    /// drawing: they are used.
    pub read_elsewhere: Vec<String>,
    /// What it shows of itself; `None` where it shows nothing. Not part of the derivation.
    pub picture: Option<Picture>,
}

macro_rules! named {
    ($($(#[$doc:meta])* $name:ident),*) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Eq)]
        pub struct $name {
            /// The user's name, array elements as `theta[3]`, vector components as `axis.x`, matrix elements
            /// as `inertia[0, 1]`.
            pub name: String,
            /// Unit as text for reports, empty where unknown or 1.
            pub unit: String,
            /// Where it was declared.
            pub origin: Origin,
        }
    )*};
}
named! {
    /// A generalized coordinate.
    Coordinate,
    /// A quantity supplied while the model runs.
    Input,
    /// A scalar parameter.
    Parameter,
    /// A smooth function among the parameters.
    Function
}

/// A generalized speed w = Y(q,t) q̇ + y(q,t), which need not be the derivative of anything.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Speed {
    /// The user's name, array elements as `w[0]`.
    pub name: String,
    /// Unit as text for reports, empty where unknown or 1.
    pub unit: String,
    /// Its value, linear in the velocities.
    pub node: NodeId,
    /// Where it was declared.
    pub origin: Origin,
}

/// Three coordinates by which something turns, each about the axes that the turns before it left: a 3-1-3
/// set.
///
/// Where the first and the last axis fall on one line the three tell no orientations apart (gimbal lock): at
/// middle angles of 0, ±π, .. where both have one number, else at ±π/2, ..
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct AngleSet {
    /// Indices of the coordinates, in the order of the turns.
    pub angles: [u32; 3],
    /// The axes, 1 to 3.
    pub axes: [u8; 3],
}

/// A step from one frame to the next.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FrameStep {
    /// To an origin with these coordinates in the frame before, axes parallel.
    Shift([NodeId; 3]),
    /// Axes turned about the origin.
    Turn {
        /// Carries components in the new frame into components in the frame before.
        rotation: [[NodeId; 3]; 3],
        /// The angular velocity of the new frame against the one before, in the new frame's components.
        rate: [NodeId; 3],
    },
}

/// A rigid body with kinetic energy ½ m v² + ½ ω·I ω, v the velocity of its center of mass.
#[derive(Clone, Debug)]
pub struct Body {
    /// From the world to its frame.
    pub steps: Vec<FrameStep>,
    /// Mass.
    pub mass: NodeId,
    /// Center of mass in the frame.
    pub center: [NodeId; 3],
    /// Inertia about the center of mass, in the frame's axes.
    pub inertia: [[NodeId; 3]; 3],
    /// Its kinetic energy, a part of T.
    pub kinetic: NodeId,
    /// Gravity in the world, and the potential energy −m g·r that it gives, a part of V.
    pub weight: Option<([NodeId; 3], NodeId)>,
}

/// What an assumption assumes of some values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssumptionKind {
    /// One value: a mass, not negative.
    Mass,
    /// One value: a moment of inertia, not negative.
    Moment,
    /// Nine values by rows: an inertia matrix that some body has.
    Inertia,
    /// Nine values by rows: a matrix that turns or mirrors, RᵀR = 1.
    Rotation,
    /// Three values: an axis divided by its length, whose square neither overflows nor vanishes.
    Axis,
    /// Twice nine values by rows: the rotations of two frames that are one.
    Weld,
}

/// An assumption without which the equations describe no body.
#[derive(Clone, Debug)]
pub struct Assumption {
    /// What.
    pub kind: AssumptionKind,
    /// Of which values.
    pub nodes: Vec<NodeId>,
    /// The user's names of what they are made of.
    pub of: Vec<String>,
    /// The user's function in which.
    pub within: String,
    /// Whether the parameters alone decide it.
    pub constant: bool,
    /// Where the model makes it.
    pub origin: Origin,
}

/// What an energy function means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnergyRole {
    /// T.
    Kinetic,
    /// V.
    Potential,
    /// L directly.
    Lagrangian,
    /// Rayleigh's D; generalized force −∂D/∂q̇.
    Dissipation,
}

/// An energy function.
#[derive(Clone, Debug)]
pub struct Energy {
    /// The user's name.
    pub name: String,
    /// Its meaning.
    pub role: EnergyRole,
    /// Its value.
    pub node: NodeId,
    /// Where it was declared.
    pub origin: Origin,
}

/// One term of a force.
#[derive(Clone, Debug)]
pub enum ForceTerm {
    /// A force vector at a point, components in the world frame, equally many of each.
    At {
        /// Position of the point.
        point: Vec<NodeId>,
        /// The force.
        vector: Vec<NodeId>,
    },
    /// A magnitude that is work-conjugate to an expression.
    Along {
        /// The expression e(q, t).
        expression: NodeId,
        /// The magnitude; its power is magnitude·ė.
        magnitude: NodeId,
    },
}

/// An applied force: the sum of its terms.
#[derive(Clone, Debug)]
pub struct Force {
    /// The user's name.
    pub name: String,
    /// The terms.
    pub terms: Vec<ForceTerm>,
    /// Where it was declared.
    pub origin: Origin,
}

/// What a constraint restricts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintKind {
    /// Φ(q, t) = 0.
    Holonomic,
    /// A(q, t) q̇ + b(q, t) = 0.
    Nonholonomic {
        /// The user says that it, or a combination of it with others, can be integrated.
        integrable: bool,
    },
}

/// A constraint: each component is zero on every motion.
#[derive(Clone, Debug)]
pub struct Constraint {
    /// The user's name.
    pub name: String,
    /// What it restricts.
    pub kind: ConstraintKind,
    /// Scalar components: suffix (`""`, `.x`, `[2]`, `[2].x`) and value, a row each.
    pub components: Vec<(String, NodeId)>,
    /// The unit of each component as text, empty where unknown or 1.
    pub units: Vec<String>,
    /// The user says that it repeats others.
    pub redundant: bool,
    /// It is switched on and off while the model runs; the switched constraints in order have the modes
    /// `Symbol::Mode(0)`, ….
    pub switched: bool,
    /// Where it was declared.
    pub origin: Origin,
}

impl Constraint {
    /// Whether it restricts coordinates.
    #[must_use]
    pub fn is_holonomic(&self) -> bool {
        self.kind == ConstraintKind::Holonomic
    }
}

impl Model {
    /// The constraint of a row, with the component's suffix and value.
    #[must_use]
    pub fn row(&self, row: usize) -> Option<(&Constraint, &str, NodeId)> {
        let all = self
            .constraints
            .iter()
            .flat_map(|c| c.components.iter().map(move |(s, node)| (c, s.as_str(), *node)));
        all.into_iter().nth(row)
    }

    /// The name of a row: `closure.x`.
    #[must_use]
    pub fn row_name(&self, row: u32) -> String {
        self.row(row as usize).map_or_else(|| row.to_string(), |(c, suffix, _)| format!("{}{suffix}", c.name))
    }

    /// The name of the switched constraint with this mode.
    #[must_use]
    pub fn mode_name(&self, mode: u32) -> String {
        let mut switched = self.constraints.iter().filter(|c| c.switched);
        switched.nth(mode as usize).map_or_else(|| mode.to_string(), |c| c.name.clone())
    }
}

/// A named result; may contain accelerations and multipliers.
#[derive(Clone, Debug)]
pub struct Output {
    /// The user's name.
    pub name: String,
    /// Scalar components: suffix (`""`, `.x`, `[2]`) and value.
    pub components: Vec<(String, NodeId)>,
    /// Unit as text, empty where unknown or 1.
    pub unit: String,
    /// Where it was declared.
    pub origin: Origin,
}

/// A function whose zero crossings are located; may contain accelerations and multipliers.
#[derive(Clone, Debug)]
pub struct Event {
    /// The user's name.
    pub name: String,
    /// Its value.
    pub node: NodeId,
    /// Where it was declared.
    pub origin: Origin,
}

/// The symbols q or q̇ of n coordinates.
pub(super) fn symbols(n: usize, kind: fn(u32) -> Symbol) -> Vec<Symbol> {
    (0..n as u32).map(kind).collect()
}

/// Makes their nodes, in order, where there are none yet.
pub(super) fn make_symbols(g: &mut Graph, n: usize, kind: fn(u32) -> Symbol) {
    for symbol in symbols(n, kind) {
        g.symbol(symbol);
    }
}
