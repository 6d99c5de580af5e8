//! Integrators for q̈ = a(t, q, u), u = q̇: one method per file. Steps do not allocate.
//!
//! A [`Stepper`] drives a [`Scheme`] (the method) over a [`System`] (the equations). It chooses the step
//! size, repeats rejected steps, tests for stiffness and gives the dense output of accepted steps. It needs
//! neither `alloc` nor `std`.
//!
//! # Files, in the order of a step
//!
//! | file | what it does |
//! |---|---|
//! | `system` | the traits of a system: accelerations, projection, discontinuities, momenta, series |
//! | `scheme`, `method`, `choice` | the trait of a method; methods by name, and the models they suit |
//! | `step`, `phase` | options, tolerances and errors of steps; states, nodes and their arithmetic |
//! | `stepper` | the loop of attempts: accepts, repeats or rejects a step |
//! | `stepper/first_step` | the size of the first step |
//! | `stepper/switching`, `discontinuity` | steps that end where q̈ is not smooth |
//! | `explicit/`, `implicit/`, `geometric/` | the methods: an attempt, its error, its interpolant |
//! | `gragg_bulirsch_stoer`, `taylor` | likewise: extrapolation, Taylor series |
//! | `side_by_side` | many motions at once, each with its own step |
//! | `compensated_summation`, `differences` | sums without rounding errors; Jacobians by differences |
//! | `stepper/singularity_crossing` | steps across positions where constraints nearly lose rank |
//! | `tables` | coefficients as slices, for states whose length is not in their type |
//! | `controller` | the size of the next step from the error of the last ones |
//! | `dense` | interpolants by the ends of a step, and their trait |
//! | `events/` | zero crossings of functions along an interpolant |
//! | `stepper/truncation` | steps that are cut short at events or taken back; restarts |
//! | `stepper/replay`, `stepper/defect_control` | recorded steps made again; accuracy of interpolants |
//!
//! Extrapolation and Taylor series are one method each, and so have no folder of their own.
//!
//! # Methods
//!
//! | method | order | dense output | evaluations per step | error estimate |
//! |---|---|---|---|---|
//! | [`Rk4`] | 4 | quintic Hermite, 4 | 4 | none: fixed step |
//! | [`DormandPrince5`] | 5 | 4 | 6 (+ 1 reused) | embedded 4th order |
//! | [`Dop853`] | 8 | 7 | 12 (+ 3 for dense output) | embedded 5th and 3rd order |
//! | [`Tsit5`] | 5 | 4 | 6 (+ 1 reused) | embedded 4th order |
//! | [`Verner9`] | 9 | 8 | 16 (+ 4 for dense output) | embedded 8th order |
//! | [`GraggBulirschStoer`] | 14 | 11 | 13 × 4 + 1 (+ 14 × 4 for dense output) | six columns, 12th order |
//! | [`Radau5`] | 5 | 3 (u), 4 (q) | 3 per Newton iteration, 1 or 2 more | filtered, 3rd order |
//! | [`Esdirk4`] | 4 | quintic Hermite, 4 | 5 per round of Newton iterations | filtered, 3rd order |
//! | [`SemiImplicitEuler`] | 1 | quintic Hermite, 1 | 1 | none: fixed step |
//! | [`StormerVerlet`], [`Rattle`] | 2 | quintic Hermite, 2 | 1 | none: fixed step; symplectic |
//! | [`Composition4`], to [`Composition8`] | 4, 6, 8 | quintic, 4 | 5, 9, 17 | none: fixed; symplectic |
//! | [`Gauss4`], [`Gauss6`] | 4, 6 | quintic, 4 | 2, 3 per iteration, 1 more | none: fixed; symplectic |
//! | [`GeneralizedAlpha`] | 2 | quintic Hermite, 2 | 1 per iteration (+ 1) | parabola through q̈, 3rd order |
//! | [`EnergyMidpoint`] | 2 | quintic Hermite, 2 | 1 per iteration, 1 more | none: fixed step; keeps energy |
//! | [`ExplicitEuler`] | 1 | quintic Hermite, 1 | 1 | none: fixed step; for teaching |
//! | [`Heun`] | 2 | quintic Hermite, 2 | 2 | none: fixed step; for teaching |
//! | [`AdamsBashforth2`], to [`AdamsBashforth4`] | 2, 3, 4 | quintic, the same | 1 | none: fixed; for teaching |
//! | [`Taylor`] | by tolerance, to 30 | the same | 1, and a series | last two terms |
//!
//! Implicit methods evaluate in each of their iterations. 13 × 4 are thirteen groups of four states that are
//! evaluated side by side. (+ 1) is needed only with constraints.
//!
//! The second-order structure is used where it is free: the velocity part of every stage derivative *is* the
//! stage velocity, so only accelerations are evaluated.

#[macro_use]
mod dense;

// Users name these types as those of `methods`.
#[cfg(feature = "alloc")]
#[doc(hidden)]
pub mod choice;
mod compensated_summation;
mod controller;
mod differences;
mod discontinuity;
mod events;
pub(crate) mod explicit;
mod geometric;
mod gragg_bulirsch_stoer;
mod implicit;
mod method;
mod phase;
mod scheme;
#[cfg(feature = "alloc")]
pub(crate) mod side_by_side;
mod step;
mod stepper;
mod system;
// Public for dynamics-families alone.
#[doc(hidden)]
pub mod tables;
mod taylor;

pub use controller::{Controller, ControllerSettings};
pub use dense::{Dense, Hermite, Nested};
#[cfg(feature = "alloc")]
pub(crate) use differences::{by_state, increment};
pub use events::{Crossing, Direction, Scan, ScanError, root, sample_position};
pub use explicit::{
    AdamsBashforth, AdamsBashforth2, AdamsBashforth3, AdamsBashforth4, Dop853, DormandPrince5, ExplicitEuler,
    Heun, Rk4, TableauRow, Tsit5, Verner9, verner9_table,
};
pub use geometric::{
    Composition, Composition4, Composition6, Composition8, EnergyMidpoint, Gauss, Gauss4, Gauss6, Rattle,
    SemiImplicitEuler, StormerVerlet,
};
pub use gragg_bulirsch_stoer::{FourPointHermite, GraggBulirschStoer};
pub use implicit::{Collocation, Esdirk4, GeneralizedAlpha, Radau5, RadauInterpolant};
pub use method::Method;
pub use phase::{Phase, Stages, StepNode};
#[cfg(feature = "alloc")]
pub(crate) use phase::{plus_scaled, zip};
pub use scheme::Scheme;
#[cfg(feature = "alloc")]
pub use side_by_side::{LANE_METHOD, LaneMethod};
pub use step::{Step, StepError, StepFlags, StepOptions, Tolerances};
pub use stepper::Stepper;
#[cfg(feature = "alloc")]
pub(crate) use system::one_by_one;
pub use system::{
    Accelerations, BranchHold, Canonical, Expandable, OfPositions, ProjectedEnd, Stabilized, Switching,
    System,
};
#[cfg(feature = "alloc")]
pub(crate) use taylor::ORDERS as TAYLOR_ORDERS;
pub use taylor::{Series, Taylor};
