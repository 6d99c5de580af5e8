//! Explicit methods: tables of Runge–Kutta methods as data, one stage loop over them ([`tableau`]), and the
//! multistep methods of Adams and Bashforth.

mod adams_bashforth;
mod dop853;
pub(super) mod dop853_table;
pub(super) mod dormand_prince5;
mod euler;
mod heun;
mod rk4;
pub(crate) mod tableau;
#[cfg(test)]
pub(crate) mod trees;
mod tsit5;
mod verner9;
// Public for dynamics-analysis alone.
#[doc(hidden)]
pub mod verner9_table;

pub use adams_bashforth::{AdamsBashforth, AdamsBashforth2, AdamsBashforth3, AdamsBashforth4};
pub use dop853::Dop853;
pub use dormand_prince5::DormandPrince5;
pub use euler::ExplicitEuler;
pub use heun::Heun;
pub use rk4::Rk4;
pub use tableau::TableauRow;
pub use tsit5::Tsit5;
pub use verner9::Verner9;
