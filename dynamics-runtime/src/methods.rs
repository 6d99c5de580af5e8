//! The methods that [`Simulation::method`](crate::simulate::Simulation::method) takes, with their options.
//!
//! Each is a type of its own, so that a program contains the code of those it names and of those that are
//! chosen by themselves, and of no others. What they do, their order and their source stand in the headers of
//! [`crate::integrate`].
//!
//! ```
//! # use dynamics_runtime as dynamics;
//! use dynamics::methods;
//! # fn show<C: methods::Choice>(_: C) {}
//! // model.simulate(start).until(10.0).method(methods::Dop853).run()?
//! show(methods::Dop853);
//! ```

pub use crate::integrate::choice::*;
pub use crate::simulate::AnyMethod as Any;
