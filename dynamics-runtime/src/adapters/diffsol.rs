//! Models on the solvers of the crate [`diffsol`](https://docs.rs/diffsol): BDF, SDIRK and explicit methods,
//! with the model's exact Jacobian.
//!
//! [`builder`] is diffsol's own builder with right-hand side, Jacobian and start filled in; tolerances and
//! all else are set on it:
//!
//! ```
//! # use dynamics_runtime as dynamics;
//! # use dynamics::{adapters::FirstOrder, simulate::Simulate};
//! use dynamics::adapters::diffsol::builder;
//! use dynamics::adapters::diffsol::solvers::{NalgebraLU, NalgebraMat, OdeSolverMethod, Vector};
//!
//! # fn run<M: Simulate>(model: &M, start: M::State) -> Result<M::State, Box<dyn std::error::Error>> {
//! let system = FirstOrder::new(model, start)?;
//! let problem = builder::<NalgebraMat<f64>, _>(&system).rtol(1e-8).atol([1e-8]).build()?;
//! let mut solver = problem.bdf::<NalgebraLU<f64>>()?;
//! solver.solve(10.0)?;
//! let end = system.state(solver.state().t, &solver.state().y.clone_as_vec())?;
//! # Ok(end)
//! # }
//! ```

#[doc(no_inline)]
pub use ::diffsol as solvers;
use ::diffsol::{Closure, ConstantClosure, Matrix, OdeBuilder};

use super::FirstOrder;
use crate::simulate::Simulate;

/// A builder whose problem is the motion of a model from its start, with matrices of type `Mat`.
#[allow(clippy::type_complexity, reason = "the closures have no names")]
pub fn builder<'a, Mat: Matrix<T = f64>, M: Simulate>(
    system: &'a FirstOrder<'_, M>,
) -> OdeBuilder<
    Mat,
    Closure<
        Mat,
        impl Fn(&[f64], &[f64], f64, &mut [f64]) + 'a,
        impl Fn(&[f64], &[f64], f64, &[f64], &mut [f64]) + 'a,
    >,
    ConstantClosure<Mat, impl Fn(&[f64], f64, &mut [f64]) + 'a>,
> {
    let initial = system.initial();
    let equations = initial.len();
    OdeBuilder::<Mat>::new()
        .t0(system.start_time())
        .rhs_implicit(
            move |y: &[f64], _: &[f64], t: f64, rate: &mut [f64]| system.rate(t, y, rate),
            move |y: &[f64], _: &[f64], t: f64, v: &[f64], along: &mut [f64]| {
                system.rate_along(t, y, v, along)
            },
        )
        .init(move |_: &[f64], _: f64, y: &mut [f64]| y.copy_from_slice(&initial), equations)
}
