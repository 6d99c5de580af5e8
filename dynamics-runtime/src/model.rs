//! What a model is to the runtime: names, sizes and evaluations, one trait per capability.
//!
//! The traits are implemented by the code that `#[dynamics]` emits; a hand-written implementation is as good as
//! a generated one, and the tests use such to check the runtime by itself.

use core::fmt::{self, Debug};
use core::ops::{Index, IndexMut};

use nalgebra::SVector;

use crate::error::SingularMassMatrix;

/// A vector whose length is part of its type: `SVector<f64, N>`.
pub trait Vector:
    Copy + PartialEq + Debug + Send + Sync + 'static + Index<usize, Output = f64> + IndexMut<usize>
{
    /// Number of elements.
    const LEN: usize;
    /// All elements zero.
    fn zeros() -> Self;
    /// The elements in order.
    fn as_slice(&self) -> &[f64];
    /// The elements in order, to be changed.
    fn as_mut_slice(&mut self) -> &mut [f64];
}

impl<const N: usize> Vector for SVector<f64, N> {
    const LEN: usize = N;
    #[inline(always)]
    fn zeros() -> Self {
        SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; N]]))
    }
    #[inline(always)]
    fn as_slice(&self) -> &[f64] {
        &self.data.0[0]
    }
    #[inline(always)]
    fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.data.0[0]
    }
}

/// A named scalar of a model, with its unit as the user declared it or as it was inferred (`""` where unknown or 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// The name, array elements as `theta[3]`.
    pub name: &'static str,
    /// The unit, for example `m/s^2`.
    pub unit: &'static str,
}

/// State of a model: time t, generalized coordinates q, generalized velocities u = q̇ and inputs.
///
/// The derive macro generates one such type per model, with an accessor for every name; generic code uses this trait.
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
}

/// Sizes and types of a model: what `#[derive(Dynamics)]` knows from the struct alone.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not declared as a model; put `#[derive(Dynamics)]` and `#[coordinates(..)]` on the struct",
    label = "has no coordinates"
)]
pub trait Model: Sized {
    /// `SVector<f64, N>` for N generalized coordinates.
    type Vector: Vector;
    /// `SMatrix<f64, N, N>`.
    type Matrix: Copy + PartialEq + Debug + Index<(usize, usize), Output = f64>;
    /// `SVector<f64, M>` for M inputs.
    type Inputs: Vector;
    /// The state type with the model's own names.
    type State: ModelState<Vector = Self::Vector, Inputs = Self::Inputs>;
    /// Time jets of the coordinates, inputs and time: what the model's functions take as `q`.
    type Coordinates;

    /// The name of the struct.
    const NAME: &'static str;

    /// Time jets at a state, with accelerations q̈ as given: what helper functions, outputs and drawings are called with.
    fn coordinates_with(state: &Self::State, accelerations: &Self::Vector) -> Self::Coordinates;
}

/// The state type of a model: time, generalized coordinates and velocities, inputs, each with its name.
pub type State<M> = <M as Model>::State;

/// What the functions of a model take as `q`: time jets of its coordinates, inputs and time.
pub type Coordinates<M> = <M as Model>::Coordinates;

/// The equations of motion M(q,t) q̈ = Q(q,q̇,t) and what is derived from them, the units of all quantities included.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no equations of motion; put `#[dynamics]` on the `impl` block with its energies",
    label = "no `#[dynamics] impl` for this"
)]
pub trait Dynamics: Model {
    /// The generalized coordinates in the order of q, arrays flattened.
    const COORDINATES: &'static [Quantity];
    /// The inputs in order.
    const INPUTS: &'static [Quantity];
    /// The scalar parameters in order, arrays, vectors and matrices flattened; smooth functions are not listed.
    const PARAMETERS: &'static [Quantity];

    /// What depends on parameters alone, computed once per model.
    type Constants: Copy + Send + Sync;

    /// Whether the parameters alone decide that energy is conserved, and which momenta are: names of the conserved quantities
    /// in the order of [`Dynamics::conserved`].
    const CONSERVED: &'static [Quantity];

    /// Computes what depends on parameters alone.
    fn constants(&self) -> Result<Self::Constants, SingularMassMatrix>;
    /// q̈ at a state, from constants computed before.
    fn accelerations_with(
        &self,
        constants: &Self::Constants,
        state: &Self::State,
    ) -> Result<Self::Vector, SingularMassMatrix>;
    /// q̈ at a state.
    fn accelerations(&self, state: &Self::State) -> Result<Self::Vector, SingularMassMatrix> {
        self.accelerations_with(&self.constants()?, state)
    }
    /// Mass matrix M(q,t), N×N, symmetric.
    fn mass_matrix(&self, state: &Self::State) -> Self::Matrix;
    /// Generalized force Q(q,q̇,t): everything on the right-hand side.
    fn generalized_force(&self, state: &Self::State) -> Self::Vector;
    /// Generalized momenta ∂L/∂q̇.
    fn momenta(&self, state: &Self::State) -> Self::Vector;
    /// Energy function E = q̇·∂L/∂q̇ − L; equals T + V where the coordinates do not contain time explicitly.
    fn energy_function(&self, state: &Self::State) -> f64;
    /// Values of the conserved quantities, written to `values` in the order of [`Dynamics::CONSERVED`].
    fn conserved(&self, state: &Self::State, values: &mut [f64]);
}

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
    fn state_jacobian(&self, state: &Self::State) -> Result<StateJacobian<Self>, SingularMassMatrix>;
    /// ∂q̈/∂inputs at a state.
    fn input_jacobian(&self, state: &Self::State) -> Result<Self::InputJacobian, SingularMassMatrix>;
    /// ∂q̈/∂parameters at a state.
    fn parameter_jacobian(&self, state: &Self::State) -> Result<Self::ParameterJacobian, SingularMassMatrix>;
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

/// Power of everything that changes the energy function: dE/dt = Σ powers.
pub trait Powers: Dynamics {
    /// One entry per `#[force]` and per `#[dissipation]` function (by its name), and a last one, `explicit time`, where the Lagrangian
    /// contains time: −∂L/∂t.
    const POWERS: &'static [Quantity];
    /// Whether the energy function contains inputs. While they are held the powers are complete; the work of inputs that change
    /// contains their rates, which are not known.
    const ENERGY_HAS_INPUTS: bool = false;
    /// The powers at a state, written to `values`.
    fn powers(&self, state: &Self::State, values: &mut [f64]);
}

/// Named results that a model declares with `#[output]`; `OUTPUTS` is empty where it declares none.
pub trait Outputs: Dynamics {
    /// Scalars in order; components of vectors as `name.x`, elements of arrays as `name[0]`.
    const OUTPUTS: &'static [Quantity];
    /// The outputs at a state, written to `values`.
    fn outputs(&self, state: &Self::State, values: &mut [f64]) -> Result<(), SingularMassMatrix>;
}

/// Functions whose zero crossings are located, declared with `#[event]`; `EVENTS` is empty where there are none.
pub trait Events: Dynamics {
    /// The names of the event functions.
    const EVENTS: &'static [Quantity];
    /// Event functions at a state, written to `values`.
    fn events(&self, state: &Self::State, values: &mut [f64]) -> Result<(), SingularMassMatrix>;
}

/// How a model is drawn in animations: by its `#[drawing]` function, or, where it has none, by the points that its helper
/// functions return.
#[cfg(feature = "alloc")]
pub trait Draw: Model {
    /// The picture at one instant.
    fn draw(&self, coordinates: &Self::Coordinates) -> crate::output::Drawing;
}
