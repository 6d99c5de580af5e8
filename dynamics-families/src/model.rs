//! What the macro emits for a model with families, and what the methods of this crate need of a model.
//!
//! All coordinates of a model lie in one slice q, one *field* after the other in the order of
//! `#[coordinates(..)]`: a family of n nodes takes n places, an ordinary coordinate takes one. Velocities,
//! accelerations and forces have the same order.

use core::any::TypeId;
use core::fmt::Debug;

pub use dynamics_runtime::model::{Described, Quantity};

/// A declared coordinate: a family, or an ordinary coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The user's name.
    pub name: &'static str,
    /// Its unit as text, empty where unknown or 1.
    pub unit: &'static str,
    /// How many nodes it has.
    pub length: Length,
}

/// How many nodes a field has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// An ordinary coordinate.
    One,
    /// A family: this parameter, plus a constant.
    Count {
        /// The parameter.
        count: &'static str,
        /// What is added to it.
        plus: i64,
    },
    /// A grid: rows of nodes.
    Grid {
        /// The number of rows: a parameter, and what is added to it.
        rows: (&'static str, i64),
        /// The number of nodes in each, likewise.
        columns: (&'static str, i64),
    },
}

/// Where every field ends in q, and how long the rows of grids are. Read as a slice it has the ends.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sizes {
    ends: Vec<usize>,
    columns: Vec<usize>,
}

impl Sizes {
    /// No fields yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { ends: Vec::new(), columns: Vec::new() }
    }

    /// Adds a field of `rows` times `columns` nodes; 1 column where nodes have one index.
    ///
    /// # Errors
    /// Where there are more coordinates than memory can address.
    pub fn push(&mut self, field: &'static str, rows: usize, columns: usize) -> Result<(), SizeError> {
        // Twelve vectors of this length take less than half of the address space.
        const MOST: usize = usize::MAX / 256;
        let end = rows.checked_mul(columns).and_then(|nodes| nodes.checked_add(self.unknowns()));
        match end.filter(|end| *end <= MOST) {
            Some(end) => {
                self.ends.push(end);
                self.columns.push(columns);
                Ok(())
            }
            None => Err(SizeError::TooManyNodes { field, rows, columns }),
        }
    }

    /// The number of coordinates.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.ends.last().copied().unwrap_or(0)
    }

    /// Where a field lies in q.
    #[must_use]
    pub fn range(&self, field: usize) -> core::ops::Range<usize> {
        let start = if field == 0 { 0 } else { self.ends[field - 1] };
        start..self.ends[field]
    }

    /// How many nodes a row of a field has; 1 where its nodes have one index.
    #[must_use]
    pub fn columns(&self, field: usize) -> usize {
        self.columns[field]
    }
}

impl core::ops::Deref for Sizes {
    type Target = [usize];
    fn deref(&self) -> &[usize] {
        &self.ends
    }
}

/// Fields whose nodes have one index.
impl From<Vec<usize>> for Sizes {
    fn from(ends: Vec<usize>) -> Self {
        Self { columns: vec![1; ends.len()], ends }
    }
}

/// A named result of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutputDeclaration {
    /// The user's name.
    pub name: &'static str,
    /// Its unit as text, empty where unknown or 1.
    pub unit: &'static str,
    /// Whether the function returns a `Vec`: a value for every index.
    pub numbered: bool,
}

/// Rows of constraints that belong together: one component of a constraint, in all rounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowField {
    /// The name of the user's function.
    pub name: &'static str,
    /// Which component of what it returns: empty, `.x`.
    pub component: &'static str,
    /// Its unit as text, empty where unknown or 1.
    pub unit: &'static str,
    /// Which constraint, in the order of the rows.
    pub constraint: usize,
    /// Whether there is a row for every index.
    pub numbered: bool,
    /// Whether it restricts coordinates, and not velocities alone.
    pub holonomic: bool,
}

/// Multipliers λ of all rows at a state; empty where no solution is at hand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Multipliers {
    pub(crate) values: Vec<f64>,
    pub(crate) ends: Vec<usize>,
}

/// What rows of constraints have at a state; R rows. What is empty is not wanted.
#[derive(Debug)]
pub struct RowValues<'a> {
    /// Φ, R; 0 for nonholonomic rows.
    pub residual: &'a mut [f64],
    /// Φ̇ = Φ_q q̇ + Φ_t, or A q̇ + b; R.
    pub velocity_residual: &'a mut [f64],
    /// γ with Φ_q q̈ = γ; R.
    pub gamma: &'a mut [f64],
    /// Entries of Φ_q and A, in the order of [`FamilyModel::row_pattern`].
    pub jacobian: &'a mut [f64],
}

/// A count or the length of a numbered parameter that does not suit the model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SizeError {
    /// A count is too small: the ends of the model, which differ from its middle, would meet.
    #[error("`{count}` is {value}; this model needs at least {least}")]
    TooFew {
        /// The parameter.
        count: &'static str,
        /// Its value.
        value: usize,
        /// The smallest value that is possible.
        least: usize,
    },
    /// A numbered parameter has not as many elements as are read.
    #[error("`{parameter}` has {length} elements; the model reads `{parameter}[{last}]`")]
    TooShort {
        /// The parameter.
        parameter: &'static str,
        /// Its length.
        length: usize,
        /// The last index that is read.
        last: usize,
    },
    /// A field has more nodes than memory can address.
    #[error("`{field}` has {rows} times {columns} nodes, which is more than memory can hold")]
    TooManyNodes {
        /// The field.
        field: &'static str,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
    },
    /// The coordinates are more than memory can address.
    #[error("`{count}` is {value}, which is more than memory can hold")]
    TooMany {
        /// The parameter.
        count: &'static str,
        /// Its value.
        value: usize,
    },
}

/// A state on slices.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Time.
    pub t: f64,
    /// Coordinates.
    pub q: &'a [f64],
    /// Velocities.
    pub u: &'a [f64],
    /// Inputs.
    pub inputs: &'a [f64],
}

/// T and V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyParts {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Potential energy.
    pub potential: f64,
}

impl EnergyParts {
    /// T + V.
    #[must_use]
    pub fn total(self) -> f64 {
        self.kinetic + self.potential
    }
}

/// Where nodes are.
#[derive(Clone, Debug, PartialEq)]
pub struct Places {
    /// The helper that says so.
    pub function: &'static str,
    /// Points (x, y, z) in order, of a grid row by row.
    pub points: Vec<[f64; 3]>,
    /// How many points a row of a grid has; `None` where nodes have one index.
    pub columns: Option<usize>,
}

/// Where entries of a matrix go, as (row, column, value). Entries of one place are added.
pub type Entries<'a> = dyn FnMut(usize, usize, f64) + 'a;

/// Where entries of a matrix along a diagonal go, as (row, column, values): value k belongs to row + k and
/// column + k. Entries of one place are added.
pub type Runs<'a> = dyn FnMut(usize, usize, &[f64]) + 'a;

/// Where pairs of a row and a coordinate go.
pub type Pairs<'a> = dyn FnMut(usize, usize) + 'a;

/// A state of a model with families: t, q, u and inputs on the heap. The derive generates one such type per
/// model, with an accessor for every name.
pub trait FamilyState: Clone + PartialEq + Debug + Send + Sync + 'static {
    /// Assembles a state; NaN for inputs that are not set.
    fn new(t: f64, q: Vec<f64>, u: Vec<f64>, inputs: Vec<f64>, sizes: Sizes) -> Self;
    /// Time.
    fn t(&self) -> f64;
    /// Coordinates, one field after the other.
    fn q(&self) -> &[f64];
    /// Velocities, likewise.
    fn u(&self) -> &[f64];
    /// Input values.
    fn inputs(&self) -> &[f64];
    /// Where every field ends in q.
    fn ends(&self) -> &Sizes;
    /// All of it, to be changed: t, q, u, inputs.
    fn parts_mut(&mut self) -> (&mut f64, &mut [f64], &mut [f64], &mut [f64]);
    /// The same on slices.
    fn view(&self) -> View<'_> {
        View { t: self.t(), q: self.q(), u: self.u(), inputs: self.inputs() }
    }
}

/// A model with families: M q̈ = Q(q, q̇, t) with a constant mass matrix M, as loops over elements.
///
/// Slices have the lengths of the model's sizes. All evaluations take O(n) operations and allocate nothing.
pub trait FamilyModel: Described + Sized + Sync + 'static {
    /// The state with the model's own names.
    type State: FamilyState;
    /// The declared coordinates in order.
    const FIELDS: &'static [Field];
    /// The inputs in order.
    const INPUTS: &'static [Quantity];
    /// The outputs in order.
    const OUTPUTS: &'static [OutputDeclaration];
    /// Whether T + V is conserved: no forces, no dissipation, no explicit time, no inputs.
    const CONSERVATIVE: bool;
    /// Whether Q contains velocities.
    const VELOCITY_FORCES: bool;
    /// Whether M is diagonal.
    const DIAGONAL: bool;
    /// Whether M, ∂Q/∂q and ∂Q/∂u are symmetric at every state; where that is not known they are looked at.
    const SYMMETRIC: bool = false;
    /// Operations of the accelerations per node, all fields together.
    const OPERATIONS: usize;
    /// Degrees of freedom, structure, cost.
    const REPORT: &'static str;
    /// The equations of motion, a row for every range of indices.
    const EQUATIONS: &'static str;

    /// Where every field ends in q; the last is the number of coordinates. Checks counts, and lengths of
    /// numbered parameters.
    ///
    /// # Errors
    /// A count that is too small or too large, a numbered parameter that is too short.
    fn ends(&self) -> Result<Sizes, SizeError>;
    /// Q, written to `forces`.
    fn forces(&self, at: View<'_>, forces: &mut [f64]);
    /// Q times `scale`, element by element, written to `accelerations`: q̈ where M is diagonal and `scale`
    /// its inverse.
    fn scaled_forces(&self, at: View<'_>, scale: &[f64], accelerations: &mut [f64]);
    /// Adds h Q `scale` to the velocities, in one pass over memory. Only for models without velocity forces:
    /// Q is evaluated with no velocities.
    fn kick(&self, t: f64, q: &[f64], inputs: &[f64], scale: &[f64], h: f64, u: &mut [f64]);
    /// Whether Q at a node depends on nodes at most 32 away and on ordinary coordinates alone, so that parts
    /// of the model can be evaluated one by one.
    const LOCAL: bool = false;
    /// [`FamilyModel::forces`] by this many threads, where the model is [local](FamilyModel::LOCAL). The bits
    /// do not depend on their number.
    fn forces_by(&self, _threads: usize, at: View<'_>, forces: &mut [f64]) {
        self.forces(at, forces);
    }
    /// [`FamilyModel::scaled_forces`], likewise.
    fn scaled_forces_by(&self, _threads: usize, at: View<'_>, scale: &[f64], accelerations: &mut [f64]) {
        self.scaled_forces(at, scale, accelerations);
    }
    /// [`FamilyModel::kick`] of the nodes from `nodes[0]` to before `nodes[1]` of every field, likewise, with
    /// [q, inputs, scale]. Only for local models, unless all nodes are asked for. The first of them is a
    /// multiple of 256. What has no index comes with the last node.
    fn kick_by(
        &self,
        _threads: usize,
        _nodes: [usize; 2],
        t: f64,
        [q, inputs, scale]: [&[f64]; 3],
        h: f64,
        u: &mut [f64],
    ) {
        self.kick(t, q, inputs, scale, h, u);
    }
    /// T and V.
    fn energies(&self, at: View<'_>) -> EnergyParts;
    /// The entries of M, both halves.
    fn mass(&self, add: &mut Entries<'_>);
    /// The entries of −∂Q/∂q at a state.
    fn stiffness(&self, at: View<'_>, add: &mut Entries<'_>);
    /// The same along diagonals, many at a time: what steps of implicit methods ask for.
    fn stiffness_runs(&self, at: View<'_>, add: &mut Runs<'_>) {
        self.stiffness(at, &mut |row, column, value| add(row, column, &[value]));
    }
    /// The entries of −∂Q/∂u at a state; none without velocity forces.
    fn damping(&self, at: View<'_>, add: &mut Entries<'_>);
    /// Time jets at a state with these accelerations: what outputs and drawings are called with. Allocates.
    /// `multipliers` are what reactions are read from.
    fn coordinates(state: &Self::State, accelerations: &[f64], multipliers: Multipliers)
    -> Self::Coordinates;
    /// The values of an output, by its index in [`FamilyModel::OUTPUTS`]; none where there is no such.
    fn output(&self, index: usize, q: &Self::Coordinates) -> Vec<f64>;
    /// The rows of the constraints in order, the holonomic ones first: M q̈ = Q + Φ_qᵀλ, Φ_q q̈ = γ.
    const ROWS: &'static [RowField] = &[];
    /// Where the rows of every field end; the last is the number of rows.
    fn row_ends(&self) -> Vec<usize> {
        Vec::new()
    }
    /// Which entries Φ_q and A may have, as (row, coordinate). Entries of one place are added.
    fn row_pattern(&self, _visit: &mut Pairs<'_>) {}
    /// What the rows have at a state.
    fn rows(&self, _at: View<'_>, _into: RowValues<'_>) {}
    /// The entries of −∂(Φ_qᵀλ)/∂q at a state.
    fn row_stiffness(&self, _at: View<'_>, _multipliers: &[f64], _add: &mut Entries<'_>) {}
    /// The constraint with this function, by [`RowField::constraint`].
    fn constraint_of(_function: TypeId) -> Option<usize> {
        None
    }
    /// Where the nodes are, for drawings: what each helper gives that says so by index.
    fn places(&self, _q: &Self::Coordinates) -> Vec<Places> {
        Vec::new()
    }
}
