//! Mechanical systems as energies, forces and constraints in ordinary Rust, with solver code that is
//! specialised at compile time.
//!
//! You write *positions, energies, forces*. The macros derive the equations of motion while your crate is
//! compiled, check the model, and emit straight-line code without allocation for exactly that system; the
//! runtime integrates it, monitors its conserved quantities and animates it.
//!
//! ```
//! use dynamics::prelude::*;
//!
//! /// Two bobs on massless rods, swinging in a vertical plane.
//! #[derive(Clone, Debug, Dynamics)]
//! #[coordinates(theta1: rad, theta2: rad)]
//! #[units(m1: kg, m2: kg, l1: m, l2: m, g: m / s^2)]
//! pub struct DoublePendulum {
//!     pub m1: f64,
//!     pub m2: f64,
//!     pub l1: f64,
//!     pub l2: f64,
//!     pub g: f64,
//! }
//!
//! #[dynamics]
//! impl DoublePendulum {
//!     fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
//!         self.l1 * vec2(q.theta1.sin(), -q.theta1.cos())
//!     }
//!     fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
//!         self.bob1(q) + self.l2 * vec2(q.theta2.sin(), -q.theta2.cos())
//!     }
//!     #[kinetic]
//!     fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
//!         0.5 * self.m1 * self.bob1(q).dt().norm_squared()
//!             + 0.5 * self.m2 * self.bob2(q).dt().norm_squared()
//!     }
//!     #[potential]
//!     fn gravity(&self, q: &Coordinates<Self>) -> Expr {
//!         self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
//!     }
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
//! let start = model.state().theta1(2.0).theta2_rate(0.5).build()?; // the rest is 0
//! let motion = model.simulate(start).until(10.0).tolerance(1e-10).run()?;
//! println!("{}", motion.summary()); // method, steps, evaluations, time, drift of the energy
//! assert!(motion.summary().energy_drift < 1e-8);
//! println!("{}", DoublePendulum::EQUATIONS); // and REPORT, LATEX, LISTING
//! # Ok(())
//! # }
//! ```
//!
//! `docs/guide/` is a book to learn from, `docs/reference/` lists every function, option and result,
//! `examples/README.md` is a gallery. The feature `analysis` (default) adds equilibria, vibration and fits.
//! With the feature `progress` long runs show a bar; without `std` the crate is `no_std`, and without `alloc`
//! it does not allocate.
#![cfg_attr(not(feature = "std"), no_std)]

#[cfg(feature = "analysis")]
#[doc(inline)]
pub use dynamics_analysis as analysis;
#[cfg(feature = "ensembles")]
#[doc(inline)]
pub use dynamics_ensembles as ensembles;
#[cfg(feature = "export")]
#[doc(inline)]
pub use dynamics_export as export;
#[cfg(feature = "families")]
#[doc(inline)]
pub use dynamics_families as families;
#[cfg(feature = "fmi")]
#[doc(inline)]
pub use dynamics_fmi as fmi;
#[cfg(any(feature = "cuda", feature = "wgpu"))]
#[doc(inline)]
pub use dynamics_gpu as gpu;
#[cfg(feature = "live")]
#[doc(inline)]
pub use dynamics_live as live;
pub use dynamics_macros::{Dynamics, dynamics};
#[cfg(feature = "alloc")]
pub use dynamics_runtime::{
    CubicSpline, MeshError, SplineError, adapters, kinematics, mechanism, methods, output, simulate,
};
pub use dynamics_runtime::{
    Cylindrical, EulerAngles, EulerParameters, EulerSequence, Expr, Force, Frame, Inertia, Joint,
    MassProperties, Mat3, NotARotation, PlanarBody, PlanarFrame, PlanarJoint, Polar, PrincipalAxes,
    RigidBody, SmoothFunction, Spherical, TimeDerivative, UnphysicalInertia, Vec2, Vec3, constrain, error,
    integrate, model, unconstrained, vec2, vec3,
};
// Users find these words in the root. Hidden, so that the documentation gives every name one path.
#[cfg(feature = "alloc")]
#[doc(hidden)]
pub use dynamics_runtime::spline;
#[doc(hidden)]
pub use dynamics_runtime::{
    attitude, bodies, derivative, expr, force, mass_properties, matrix, rotation, smooth, vector,
};
// Needed by generated code and by tests: what jets, series and numbers are made of.
#[doc(hidden)]
pub use dynamics_runtime::{lanes, math, reaction, scalar, series, sin_cos};

/// What a model and a run need: `use dynamics::prelude::*;`.
///
/// Traits stand here `as _` if only their methods are called. Everything else is reached by module: charts
/// and animations in [`output`], errors of states in [`error`], results and errors of runs in [`simulate`],
/// traits for generic code in [`model`], mechanisms that inputs drive in [`kinematics`], equilibria,
/// vibration, parameters and studies in [`analysis`], further words of models in [the root](crate).
pub mod prelude {
    // Macros, and the attributes of a model's functions: here their documentation is found by editors.
    pub use dynamics_macros::{
        Dynamics, dissipation, drawing, dynamics, event, force, holonomic, kinematic, kinetic, lagrangian,
        nonholonomic, output, potential, redundant,
    };
    // Words of models.
    #[cfg(feature = "alloc")]
    pub use dynamics_runtime::CubicSpline;
    pub use dynamics_runtime::model::{Coordinates, State};
    #[cfg(feature = "alloc")]
    pub use dynamics_runtime::output::{Color, Drawing};
    pub use dynamics_runtime::{
        EulerParameters, EulerSequence, Expr, Force, Frame, Inertia, Joint, Mat3, PlanarBody, PlanarFrame,
        PlanarJoint, RigidBody, Vec2, Vec3, vec2, vec3,
    };
    // Words of runs.
    #[cfg(feature = "alloc")]
    pub use dynamics_runtime::methods;
    #[cfg(feature = "alloc")]
    pub use dynamics_runtime::simulate::{Contact, Direction, Formulation, Method, Motion, Simulate};
    // Methods of models, states, jets and numbers.
    #[cfg(feature = "analysis")]
    pub use dynamics_analysis::{Analyze as _, Vary as _};
    #[cfg(feature = "ensembles")]
    pub use dynamics_ensembles::OpenEnsemble as _;
    #[cfg(feature = "export")]
    pub use dynamics_export::ExportC as _;
    #[cfg(feature = "families")]
    pub use dynamics_families::model::{FamilyModel as _, FamilyState as _};
    #[cfg(feature = "families")]
    pub use dynamics_families::{Every, SimulateFamilies as _};
    #[cfg(feature = "fmi")]
    pub use dynamics_fmi::ExportFmu as _;
    #[cfg(all(feature = "live", feature = "families"))]
    pub use dynamics_live::{FamilyLive, OpenFamilyLive as _};
    #[cfg(feature = "live")]
    pub use dynamics_live::{Live, OpenLive as _};
    pub use dynamics_runtime::math::F64Ext as _;
    #[cfg(feature = "alloc")]
    pub use dynamics_runtime::mechanism::Mechanism as _;
    pub use dynamics_runtime::model::{
        Constraints as _, Described as _, Dynamics, Energies as _, Events as _, Linearize as _, Model as _,
        ModelState as _, Outputs as _, Parameters as _, Powers as _,
    };
    #[cfg(feature = "alloc")]
    pub use dynamics_runtime::model::{Draw as _, Portable as _};
    pub use dynamics_runtime::{SmoothFunction as _, TimeDerivative as _};
}

/// What generated code refers to. Not for use by hand: it changes without notice.
#[doc(hidden)]
pub mod __private {
    pub use core::any::TypeId;
    pub use core::clone::Clone;
    pub use core::cmp::PartialEq;
    pub use core::fmt::Debug;
    pub use core::marker::Copy;
    pub use core::ops::{Fn, FnMut};
    pub use core::option::Option;
    pub use core::prelude::v1::derive;
    pub use core::primitive::{bool, f64, isize, str, u8, u32, usize};
    pub use core::result::Result::{self, Err, Ok};
    pub use core::{assert, fmt, unreachable};
    pub use dynamics_macros::__model;
    pub use dynamics_runtime as library;
    pub use dynamics_runtime::constrain::{solve_once, workspace_len};
    pub use dynamics_runtime::error::{SingularMassMatrix, SolveError, StateError};
    pub use dynamics_runtime::generated::{
        Complete, OnlyOneDynamicsImplPerModel, acceleration_by_parameters, acceleration_derivatives, expect,
        expect_near, expect_std, expect_type, matrix, name_singular, no_derivatives, released, singular,
        singular_in_lanes, solved_or_nan, table, the_name_vec2_is_the_librarys_choose_another,
        the_name_vec3_is_the_librarys_choose_another, vector,
    };
    pub use dynamics_runtime::lanes::Lanes;
    pub use dynamics_runtime::model::{
        ActiveSet, AngleSet, Assumption, AssumptionKind, Block, Branches, ConservedKind, ConservedQuantity,
        Constraint, ConstraintKind, Constraints, Described, Dynamics, Energies, Events, Expansion, Kink,
        LaneValues, Linearize, Model, ModelState, Outputs, Parameters, Powers, Quantity, Solved, SolverKind,
        StateJacobian, Terms, UnitDimension, Vector, WideOf,
    };
    #[cfg(feature = "alloc")]
    pub use dynamics_runtime::model::{
        Draw, Portable, PrintedInC, PrintedInWgsl, ProgramsInC, ProgramsInWgsl,
    };
    #[cfg(feature = "alloc")]
    pub use dynamics_runtime::output::{Drawing, Places, Point};
    pub use dynamics_runtime::reaction::{Reaction, Reactions, type_of};
    /// What models with families refer to.
    #[cfg(feature = "families")]
    pub mod families {
        pub use core::iter::IntoIterator;
        pub use dynamics_families::loops::{self, output_values};
        pub use dynamics_families::model::{
            EnergyParts, Entries, FamilyModel, FamilyState, Field, Length, Multipliers, OutputDeclaration,
            Pairs, Places, RowField, RowValues, Runs, SizeError, Sizes, View,
        };
        pub use dynamics_families::portable::PortableFamily;
        pub use dynamics_families::reaction::FamilyReaction;
        pub use dynamics_families::state::{FamilyStateError, GivenState, Values};
        pub use std::vec::Vec;
    }
    #[cfg(feature = "alloc")]
    pub use dynamics_runtime::generated::Vec;
    pub use dynamics_runtime::series::{self, expand, expand_constrained};
    pub use dynamics_runtime::unconstrained;
    pub use dynamics_runtime::{Expr, SmoothFunction, math, sin_cos};
    pub use nalgebra::{ArrayStorage, SMatrix, SVector};

    /// Keeps its items where the façade has the feature `alloc`.
    #[cfg(feature = "alloc")]
    #[doc(hidden)]
    #[macro_export]
    macro_rules! __if_alloc {
        ($($item:item)*) => { $($item)* };
    }
    /// Drops its items: the façade lacks the feature `alloc`.
    #[cfg(not(feature = "alloc"))]
    #[doc(hidden)]
    #[macro_export]
    macro_rules! __if_alloc {
        ($($item:item)*) => {};
    }
    pub use crate::__if_alloc as if_alloc;
}
