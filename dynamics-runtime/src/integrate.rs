//! Integrators for q̈ = a(t, q, u), u = q̇: one method per file, none of them allocates.
//!
//! A [`Stepper`] drives a [`Scheme`] (the method) over a [`System`] (what is integrated): it chooses the
//! step, repeats rejected steps, watches for stiffness and hands out the dense output of the step just made.
//! It needs neither `alloc` nor `std`.
//!
//! | method | order | dense output | evaluations per step | error estimate |
//! |---|---|---|---|---|
//! | [`Rk4`] | 4 | quintic Hermite, 4 | 4 | none: fixed step |
//! | [`DormandPrince5`] | 5 | 4 | 6 (+ 1 reused) | embedded 4th order |
//! | [`Dop853`] | 8 | 7 | 12 (+ 3 for dense output) | embedded 5th and 3rd order |
//! | [`Tsit5`] | 5 | 4 | 6 (+ 1 reused) | embedded 4th order |
//! | [`Verner9`] | 9 | 8 | 16 (+ 4 for dense output) | embedded 8th order |
//! | [`GraggBulirschStoer`] | 14 | 11 | 13 of four states side by side and 1 (+ 14 of four for dense output) | six columns of seven, 12th order |
//! | [`Radau5`] | 5 | 3 (u), 4 (q) | implicit: 3 per Newton iteration, 1 or 2 more | filtered, 3rd order |
//! | [`Esdirk4`] | 4 | quintic Hermite, 4 | implicit: 5 per round of Newton iterations | filtered, 3rd order |
//! | [`SemiImplicitEuler`] | 1 | quintic Hermite, 1 | 1 | none: fixed step |
//! | [`StormerVerlet`], [`Rattle`] | 2 | quintic Hermite, 2 | 1 | none: fixed step; symplectic |
//! | [`Composition4`], [`Composition6`], [`Composition8`] | 4, 6, 8 | quintic Hermite, 4 | 5, 9, 17 | none: fixed step; symplectic |
//! | [`Gauss4`], [`Gauss6`] | 4, 6 | quintic Hermite, 4 | implicit: 2, 3 per iteration, 1 more | none: fixed step; symplectic |
//! | [`GeneralizedAlpha`] | 2 | quintic Hermite, 2 | implicit: 1 per iteration, 1 more with constraints | parabola through q̈, 3rd order |
//! | [`EnergyMidpoint`] | 2 | quintic Hermite, 2 | implicit: 1 per iteration, 1 more | none: fixed step; keeps energy |
//! | [`Taylor`] | by tolerance, to 30 | the same | 1, and a series | last two terms |
//!
//! The second-order structure is used where it is free: the velocity part of every stage derivative *is* the
//! stage velocity, so only accelerations are evaluated.

mod root;
#[macro_use]
mod dense;

// Users name these types as those of `methods`.
#[cfg(feature = "alloc")]
#[doc(hidden)]
pub mod choice;
mod compensated_summation;
mod composition;
mod controller;
mod differences;
mod discontinuity;
mod dop853;
mod dop853_table;
mod dormand_prince5;
mod energy_midpoint;
mod esdirk4;
mod event;
mod first_step;
mod fixed_point;
mod gauss;
mod generalized_alpha;
mod gragg_bulirsch_stoer;
pub(crate) mod linear;
mod method;
mod phase;
mod radau5;
mod rk4;
mod rough_powers;
mod scheme;
mod semi_implicit_euler;
mod step;
mod stepper;
mod stormer_verlet;
mod system;
mod tableau;
mod taylor;
#[cfg(test)]
pub(crate) mod trees;
mod tsit5;
mod verner9;
// Public for dynamics-analysis alone.
#[doc(hidden)]
pub mod verner9_table;

pub use composition::{Composition, Composition4, Composition6, Composition8};
pub use controller::{Controller, ControllerSettings};
pub use dense::{Dense, Hermite, Nested};
#[cfg(feature = "alloc")]
pub(crate) use differences::{by_state, increment};
pub use dop853::Dop853;
pub use dormand_prince5::DormandPrince5;
pub use energy_midpoint::EnergyMidpoint;
pub use esdirk4::Esdirk4;
pub use event::{Crossing, Direction, Scan, ScanError, place};
pub use gauss::{Gauss, Gauss4, Gauss6};
pub use generalized_alpha::GeneralizedAlpha;
pub use gragg_bulirsch_stoer::{GraggBulirschStoer, Knots};
pub use method::Method;
pub use phase::{Phase, Stages, StepNode};
pub use radau5::{Between, Collocation, Radau5};
pub use rk4::Rk4;
pub use root::root;
pub use scheme::Scheme;
pub use semi_implicit_euler::SemiImplicitEuler;
pub use step::{Step, StepError, StepFlags, StepOptions, Tolerances};
pub use stepper::Stepper;
pub use stormer_verlet::{Rattle, StormerVerlet};
#[cfg(feature = "alloc")]
pub(crate) use system::one_by_one;
pub use system::{
    Accelerations, Canonical, Expandable, Hold, OfPositions, Settled, Stabilized, Switching, System,
};
pub use tableau::TableauRow;
#[cfg(feature = "alloc")]
pub(crate) use tableau::zip;
#[cfg(feature = "alloc")]
pub(crate) use taylor::ORDERS as TAYLOR_ORDERS;
pub use taylor::{Series, Taylor};
pub use tsit5::Tsit5;
pub use verner9::Verner9;
