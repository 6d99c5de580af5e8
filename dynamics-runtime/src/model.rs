//! The traits of a model: names, sizes and evaluations, one trait per capability.
//!
//! The code that `#[dynamics]` emits implements them. A hand-written implementation is as good; tests use
//! such to check the runtime without the macros.

mod active_set;
mod check;
mod constraints;
mod kinks;
mod lane_evaluation;
mod static_traits;
// Public for dynamics-analysis alone.
#[cfg(feature = "alloc")]
#[doc(hidden)]
pub mod names;
#[cfg(feature = "alloc")]
mod portable;
mod vector;

use core::fmt::{self, Debug};
use core::ops::Index;

pub use crate::declaration::{
    AngleSet, Assumption, AssumptionKind, AssumptionViolation, Block, ConservedKind, ConservedQuantity,
    Constraint, ConstraintKind, Expansion, Quantity, SolverKind, UnitDimension,
};
pub use active_set::ActiveSet;
#[cfg(feature = "alloc")]
pub(crate) use check::{parameter_not_finite, violated_assumption};
pub use constraints::{Constraints, NoMatrix, NoRows, Solved, Terms, Workspace};
pub use kinks::{Branches, Kink, MAX_KINKS};
pub use lane_evaluation::{LaneEvaluation, LaneValues, OwnValues, SharedValues};
#[cfg(feature = "alloc")]
pub use portable::{Portable, PrintedInC, PrintedInWgsl, ProgramsInC, ProgramsInWgsl};
pub(crate) use static_traits::StaticTraits;
pub use vector::{InputValues, Square, Vector};

use crate::error::{SingularMassMatrix, SolveError};
use crate::lanes::Lanes;

/// State of a model: time t, generalized coordinates q, generalized velocities u = q̇ and inputs.
///
/// The derive macro generates one such type per model, with an accessor for every name; generic code uses
/// this trait.
pub trait ModelState: Copy + PartialEq + Debug + Send + Sync + 'static {
    /// q and u: `SVector<f64, N>`.
    type Vector: Vector;
    /// Input values: `SVector<f64, M>`.
    type Inputs: Vector;
    /// Assembles a state.
    fn new(t: f64, q: Self::Vector, u: Self::Vector, inputs: Self::Inputs) -> Self;
    /// Time.
    fn t(&self) -> f64;
    /// Generalized coordinates.
    fn q(&self) -> &Self::Vector;
    /// Generalized velocities q̇.
    fn u(&self) -> &Self::Vector;
    /// Input values.
    fn inputs(&self) -> &Self::Inputs;
    /// Generalized coordinates, to be changed.
    fn q_mut(&mut self) -> &mut Self::Vector;
    /// Generalized velocities, to be changed.
    fn u_mut(&mut self) -> &mut Self::Vector;
    /// Input values, to be changed.
    fn inputs_mut(&mut self) -> &mut Self::Inputs;
    /// Which switched constraints hold.
    fn active_set(&self) -> ActiveSet;
    /// Which switched constraints hold, to be changed. Switching changes no velocity: where a constraint
    /// engages in motion, that is an impact.
    fn active_set_mut(&mut self) -> &mut ActiveSet;
    /// Holds branches of the model's choices independently of the values, for a step that ends where they
    /// change.
    fn hold(&mut self, _branches: Branches) {}
}

/// A model, of whatever kind, whose functions take coordinates.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not declared as a model; put `#[derive(Dynamics)]` and `#[coordinates(..)]` on \
        the struct",
    label = "has no coordinates"
)]
pub trait Described {
    /// Time jets of the coordinates, inputs and time: what the model's functions take as `q`.
    type Coordinates;

    /// The name of the struct.
    const NAME: &'static str;
    /// The documentation of the struct.
    const DOCUMENTATION: &'static str = "";
    /// The documentation of its fields, as far as they have some: name and text.
    const FIELD_DOCUMENTATION: &'static [(&'static str, &'static str)] = &[];
}

/// Sizes and types of a model: what `#[derive(Dynamics)]` generates from the struct alone.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not declared as a model; put `#[derive(Dynamics)]` and `#[coordinates(..)]` on \
        the struct",
    label = "has no coordinates"
)]
pub trait Model: Described + Sized {
    /// `SVector<f64, N>` for N generalized coordinates.
    type Vector: Vector;
    /// `SMatrix<f64, N, N>`.
    type Matrix: Copy + PartialEq + Debug + Index<(usize, usize), Output = f64>;
    /// `SVector<f64, M>` for M inputs.
    type Inputs: Vector;
    /// The state type with the model's own names.
    type State: ModelState<Vector = Self::Vector, Inputs = Self::Inputs>;

    /// Time jets at a state, with accelerations q̈ and multipliers λ as given: what helper functions,
    /// outputs and drawings are called with. Multipliers may be left out (`&[]`): reactions are then NaN.
    fn coordinates_with(
        state: &Self::State,
        accelerations: &Self::Vector,
        multipliers: &[f64],
    ) -> Self::Coordinates;
}

/// The state type of a model: time, generalized coordinates and velocities, inputs, each with its name.
pub type State<M> = <M as Model>::State;

/// Coordinates, velocities or accelerations of several states side by side.
pub type WideOf<M, L> = <<M as Model>::Vector as Vector>::Wide<L>;

/// What the functions of a model take as `q`: time jets of its coordinates, inputs and time.
pub type Coordinates<M> = <M as Described>::Coordinates;

/// The equations of motion M(q,t) q̈ = Q(q,q̇,t) and what is derived from them, the units of all quantities
/// included.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no equations of motion; put `#[dynamics]` on the `impl` block with its energies",
    label = "no `#[dynamics] impl` for this"
)]
pub trait Dynamics: Model {
    /// The generalized coordinates in the order of q, arrays flattened.
    const COORDINATES: &'static [Quantity];
    /// The inputs in order.
    const INPUTS: &'static [Quantity];
    /// The scalar parameters in order, arrays, vectors and matrices flattened; smooth functions are not
    /// listed.
    const PARAMETERS: &'static [Quantity];

    /// Values that depend on parameters alone, computed once per model.
    type Constants: Copy + Send + Sync;

    /// Whether the parameters alone decide that energy is conserved, and which momenta are: names of the
    /// conserved quantities in the order of [`Dynamics::conserved`].
    const CONSERVED: &'static [ConservedQuantity];

    /// Operations of one evaluation of q̈ by the generated code, as the model's report counts them; `None`
    /// where there is no straight-line code.
    const OPERATIONS: Option<usize> = None;

    /// The generalized speeds of `#[speeds(..)]` in order, arrays flattened; each is an output as well.
    const SPEEDS: &'static [Quantity] = &[];
    /// The number of elements of each declared speed in order, 1 or the length of its array. Their sum is the
    /// number of [`Dynamics::SPEEDS`]. It may be empty if no speed is an array.
    const SPEED_LENGTHS: &'static [usize] = &[];
    /// The generalized speeds w = Y(q,t) q̇ + y(q,t) at a state, written to `values` in the order of
    /// [`Dynamics::SPEEDS`].
    fn speeds(&self, _state: &Self::State, _values: &mut [f64]) {}
    /// Y, S×N by rows, then y, S, at a state with N coordinates and S speeds, written to `values`.
    fn speed_equations(&self, _state: &Self::State, _values: &mut [f64]) {}

    /// Sets of three angles among the coordinates, which may have gimbal lock.
    const ANGLE_SETS: &'static [AngleSet] = &[];

    /// The value of the scalar parameter with this index in [`Dynamics::PARAMETERS`]; `None` where there is
    /// none, or where the model does not implement this. Starts and runs report a parameter that is not
    /// finite by its name.
    fn parameter(&self, _index: usize) -> Option<f64> {
        None
    }
    /// Computes the values that depend on parameters alone.
    fn constants(&self) -> Result<Self::Constants, SingularMassMatrix>;
    /// q̈ at a state, from constants computed before.
    fn accelerations_with(
        &self,
        constants: &Self::Constants,
        state: &Self::State,
    ) -> Result<Self::Vector, SolveError>;
    /// Whether [`Dynamics::accelerations_in_lanes`] is implemented: for straight-line code without choices
    /// that is not too long.
    const HAS_LANES: bool = false;
    /// How many parameters, constants and inputs [`Dynamics::accelerations_in_lanes`] reads. It must take all
    /// of them from `values`: many runs of several models are evaluated with one of the models.
    const LANE_VALUES: usize = 0;
    /// Writes the parameters, constants and inputs that [`Dynamics::accelerations_in_lanes`] reads, in its
    /// order: those of one run among several that are made side by side.
    fn lane_values(&self, _constants: &Self::Constants, _state: &Self::State, _values: &mut [f64]) {}
    /// Writes q̈ of several states (q, u) side by side at the times t, each with the same bits as
    /// [`Dynamics::accelerations_with`] has them. `values` says whether parameters and inputs are those of
    /// this model and of `state` ([`SharedValues`]) or each state has its own ([`OwnValues`]). Returns false,
    /// and the written values are invalid, where that code does not apply to all states, or there is none:
    /// the caller then evaluates each state alone. It is inlined: call it by [`LaneEvaluation`].
    #[inline(always)]
    fn accelerations_in_lanes<L: Lanes, P: LaneValues<L>>(
        &self,
        _constants: &Self::Constants,
        _state: &Self::State,
        _values: &P,
        _t: L,
        _states: [&WideOf<Self, L>; 2],
        _accelerations: &mut WideOf<Self, L>,
    ) -> bool {
        false
    }
    /// q̈ at a state.
    fn accelerations(&self, state: &Self::State) -> Result<Self::Vector, SolveError> {
        self.accelerations_with(&self.constants()?, state)
    }
    /// ∂q̈/∂q and ∂q̈/∂q̇ at a state, N×N by rows, for constant inputs and with the active
    /// constraints; `false` where no code for them was generated or they do not exist: callers then take
    /// differences.
    #[inline]
    fn acceleration_derivatives(&self, _state: &Self::State, _by_q: &mut [f64], _by_u: &mut [f64]) -> bool {
        false
    }
    /// Mass matrix M(q,t), N×N, symmetric.
    fn mass_matrix(&self, state: &Self::State) -> Self::Matrix;
    /// Generalized force Q(q,q̇,t): everything on the right-hand side.
    fn generalized_force(&self, state: &Self::State) -> Self::Vector;
    /// Generalized momenta ∂L/∂q̇.
    fn momenta(&self, state: &Self::State) -> Self::Vector;
    /// Whether Q contains velocities: Coriolis terms of a mass matrix that moves, dampers, gyroscopic forces.
    /// True where that is not known.
    const VELOCITY_FORCES: bool = true;
    /// Whether M depends on parameters alone. False where that is not known.
    const CONSTANT_MASS: bool = false;
    /// Whether M, Q or the constraints contain time. True where that is not known.
    const EXPLICIT_TIME: bool = true;
    /// Rates of the momenta, ṗ = ∂L/∂q + applied forces, without constraints. `None` where there is no
    /// code for them, as where M is constant.
    #[inline]
    fn momentum_rates(&self, _state: &Self::State) -> Option<Self::Vector> {
        None
    }
    /// Energy function E = q̇·∂L/∂q̇ − L; equals T + V where the coordinates do not contain time
    /// explicitly.
    fn energy_function(&self, state: &Self::State) -> f64;
    /// Values of the conserved quantities, written to `values` in the order of [`Dynamics::CONSERVED`].
    fn conserved(&self, state: &Self::State, values: &mut [f64]);

    /// Assumptions about bodies and frames that depend on values, so that the macro cannot check them.
    const ASSUMPTIONS: &'static [Assumption] = &[];
    /// Calls `visit` with the values of each assumption in order, at a state. Those that depend on parameters
    /// alone do not use the state.
    fn assumptions(&self, _state: &Self::State, _visit: &mut dyn FnMut(&[f64])) {}

    /// How many kinks [`Dynamics::kinks`] writes, at most [`MAX_KINKS`].
    const KINKS: usize = 0;
    /// Whether these are all kinks: `false` for models with more than [`MAX_KINKS`], and where choices depend
    /// on accelerations.
    const KINKS_ARE_ALL: bool = true;
    /// Where the accelerations are not smooth, by the model's own expressions (`if`, min, max, abs, signum,
    /// pieces of functions).
    fn kinks(&self, _state: &Self::State, _kinks: &mut [Kink]) {}

    /// Whether [`Dynamics::series`] expands motions, and if not, why.
    const SERIES: Expansion = Expansion::None { reason: "its equations were written by hand" };
    /// The memory of series, `()` where there are none; it belongs to one model and its constants.
    type Series: Default;
    /// q̈ at a state, as [`Dynamics::accelerations_with`] has it, and in `memory` the other values from
    /// which a series through this state starts.
    #[inline]
    fn begin_series(
        &self,
        constants: &Self::Constants,
        state: &Self::State,
        _memory: &mut Self::Series,
    ) -> Result<Self::Vector, SolveError> {
        self.accelerations_with(constants, state)
    }
    /// Taylor coefficients of the motion through a state with these accelerations, inputs and active set
    /// held: x(t + s·scale) = Σ xₖ sᵏ. Rows k of q and u get the coefficients k; as many orders as
    /// there are rows, at most [`MAX_SERIES_ORDER`]. Called only where [`Dynamics::SERIES`] is
    /// [`Expansion::Generated`]. Returns false where no series exists at this state, since constraints depend
    /// on each other.
    fn series(
        &self,
        _constants: &Self::Constants,
        _state: &Self::State,
        _accelerations: &Self::Vector,
        _scale: f64,
        _rows: [&mut [Self::Vector]; 2],
        _memory: &mut Self::Series,
    ) -> bool {
        false
    }
}

/// Highest order of a Taylor series of a motion.
pub const MAX_SERIES_ORDER: usize = 30;

/// Kinetic and potential energy apart: models without a `#[lagrangian]`.
pub trait Energies: Dynamics {
    /// T(q,q̇,t).
    fn kinetic_energy(&self, state: &Self::State) -> f64;
    /// V(q,t).
    fn potential_energy(&self, state: &Self::State) -> f64;
}

/// Exact derivatives of the accelerations, by the implicit function theorem.
pub trait Linearize: Dynamics {
    /// ∂q̈/∂inputs, `SMatrix<f64, N, M>`.
    type InputJacobian: Copy + PartialEq + Debug + Index<(usize, usize), Output = f64>;
    /// ∂q̈/∂parameters, `SMatrix<f64, N, P>`.
    type ParameterJacobian: Copy + PartialEq + Debug + Index<(usize, usize), Output = f64>;
    /// q̈, ∂q̈/∂q and ∂q̈/∂q̇ at a state.
    fn state_jacobian(&self, state: &Self::State) -> Result<StateJacobian<Self>, SolveError>;
    /// ∂q̈/∂inputs at a state.
    fn input_jacobian(&self, state: &Self::State) -> Result<Self::InputJacobian, SolveError>;
    /// ∂q̈/∂parameters at a state.
    fn parameter_jacobian(&self, state: &Self::State) -> Result<Self::ParameterJacobian, SolveError>;
}

/// q̈ and its derivatives with respect to the state.
pub struct StateJacobian<M: Model> {
    /// q̈.
    pub accelerations: M::Vector,
    /// ∂q̈/∂q, N×N, row i column j = ∂q̈ᵢ/∂qⱼ.
    pub by_q: M::Matrix,
    /// ∂q̈/∂q̇, N×N, row i column j = ∂q̈ᵢ/∂q̇ⱼ.
    pub by_u: M::Matrix,
}

// By hand, because a derive would ask the same of the model.
impl<M: Model> Clone for StateJacobian<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M: Model> Copy for StateJacobian<M> {}

impl<M: Model> PartialEq for StateJacobian<M> {
    fn eq(&self, other: &Self) -> bool {
        self.accelerations == other.accelerations && self.by_q == other.by_q && self.by_u == other.by_u
    }
}

impl<M: Model> Debug for StateJacobian<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("StateJacobian")
            .field("accelerations", &self.accelerations)
            .field("by_q", &self.by_q)
            .field("by_u", &self.by_u)
            .finish()
    }
}

/// Parameters that can be changed, and the derivatives of the accelerations by them: for sweeps,
/// sensitivities and fits. Every derived model implements it.
///
/// ```
/// # use dynamics_runtime as dynamics;
/// use dynamics::model::Parameters;
///
/// /// The same model with one parameter changed; `None` where there is none of this name.
/// fn with<M: Parameters + Clone>(model: &M, name: &str, value: f64) -> Option<M> {
///     let index = M::PARAMETERS.iter().position(|parameter| parameter.name == name)?;
///     model.with_parameter(index, value)
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not let its parameters be changed; put `#[dynamics]` on the `impl` block with \
        its energies, or implement `Parameters`",
    label = "no `Parameters` for this"
)]
pub trait Parameters: Dynamics {
    /// Sets the scalar parameter with this index in [`Dynamics::PARAMETERS`]; false where there is none. The
    /// value is not checked here: simulations do that.
    fn set_parameter(&mut self, index: usize, value: f64) -> bool;

    /// The model with one parameter changed; `None` where there is none with this index.
    fn with_parameter(&self, index: usize, value: f64) -> Option<Self>
    where
        Self: Clone,
    {
        let mut changed = self.clone();
        changed.set_parameter(index, value).then_some(changed)
    }

    /// ∂q̈/∂parameters at a state, N×P by rows, with the active constraints; `false` where no code for
    /// them was generated or they do not exist: callers then take differences of the equations.
    #[inline]
    fn acceleration_by_parameters(&self, _state: &Self::State, _values: &mut [f64]) -> bool {
        false
    }
}

/// Power of everything that changes the energy function: dE/dt = Σ powers.
pub trait Powers: Dynamics {
    /// One entry per `#[force]` and per `#[dissipation]` function (by its name), and a last one,
    /// `explicit time`, where the Lagrangian contains time: −∂L/∂t.
    const POWERS: &'static [Quantity];
    /// Whether the energy function contains inputs. For constant inputs the powers are complete. The work of
    /// varying inputs contains their rates, which are not known.
    const ENERGY_HAS_INPUTS: bool = false;
    /// The powers at a state, written to `values`.
    fn powers(&self, state: &Self::State, values: &mut [f64]);
}

/// Named results that a model declares with `#[output]`; `OUTPUTS` is empty where it declares none.
pub trait Outputs: Dynamics {
    /// Scalars in order; components of vectors as `name.x`, elements of arrays as `name[0]`.
    const OUTPUTS: &'static [Quantity];
    /// The outputs at a state, written to `values`.
    fn outputs(&self, state: &Self::State, values: &mut [f64]) -> Result<(), SolveError>;
}

/// Functions whose zero crossings are located, declared with `#[event]`; `EVENTS` is empty where there are
/// none.
pub trait Events: Dynamics {
    /// The names of the event functions.
    const EVENTS: &'static [Quantity];
    /// Event functions at a state, written to `values`.
    fn events(&self, state: &Self::State, values: &mut [f64]) -> Result<(), SolveError>;
}

/// All traits that a simulation needs: powers, outputs, events and constraints. Every derived model
/// implements them.
pub trait SimulationModel: Powers + Outputs + Events + Constraints {}

impl<M: Powers + Outputs + Events + Constraints> SimulationModel for M {}

/// The drawing of a model in animations: by its `#[drawing]` function, or, without one, by the points that
/// its helper functions return.
#[cfg(feature = "alloc")]
pub trait Draw: Model {
    /// The picture at one instant.
    fn draw(&self, coordinates: &Self::Coordinates) -> dynamics_view::Drawing;
}
