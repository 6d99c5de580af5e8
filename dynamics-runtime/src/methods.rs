//! The methods that [`Simulation::method`](crate::simulate::Simulation::method) takes, with their options.
//!
//! Each is a type, so that a program contains only the code of the methods that it names and of those that
//! are chosen automatically. The headers of [`crate::integrate`] have their formulas, orders and sources.
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
