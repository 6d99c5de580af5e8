//! Models on the explicit Runge–Kutta methods of the crate [`ode_solvers`](https://docs.rs/ode_solvers): its
//! `System` for [`FirstOrder`].
//!
//! The state vector is a `DVector`, or an `SVector` of 2N elements, of which a wrong number does not compile.
//! A reference is given away, so that what came back can be read with [`FirstOrder::state`]. Ask for sparse
//! output where you want the end: the last point of the dense output of version 0.6.2 is extrapolated over
//! the whole last step, however far that goes, and returned as a success.
//!
//! ```
//! # use dynamics_runtime as dynamics;
//! # use dynamics::{adapters::FirstOrder, simulate::Simulate};
//! use dynamics::adapters::ode_solvers::solvers::{DVector, Dop853, OutputType};
//!
//! # fn run<M: Simulate>(model: &M, start: M::State) -> Result<M::State, Box<dyn std::error::Error>> {
//! let system = FirstOrder::new(model, start)?;
//! let y = DVector::from_vec(system.initial());
//! let mut solver = Dop853::new(&system, 0.0, 10.0, 0.1, y, 1e-10, 1e-10);
//! solver.set_output(OutputType::Sparse);
//! solver.integrate()?;
//! let (times, places) = solver.results().get();
//! let end = system.state(times[times.len() - 1], places[places.len() - 1].as_slice())?;
//! # Ok(end)
//! # }
//! ```

#[doc(no_inline)]
pub use ::ode_solvers as solvers;
use ::ode_solvers::{DVector, SVector, System};

use super::FirstOrder;
use crate::model::Vector;
use crate::simulate::Simulate;

impl<M: Simulate> System<f64, DVector<f64>> for &FirstOrder<'_, M> {
    fn system(&self, t: f64, y: &DVector<f64>, rate: &mut DVector<f64>) {
        self.rate(t, y.as_slice(), rate.as_mut_slice());
    }
}

impl<M: Simulate, const EQUATIONS: usize> System<f64, SVector<f64, EQUATIONS>> for &FirstOrder<'_, M> {
    fn system(&self, t: f64, y: &SVector<f64, EQUATIONS>, rate: &mut SVector<f64, EQUATIONS>) {
        const {
            assert!(
                EQUATIONS == 2 * M::Vector::LEN,
                "the state vector has q and q̇: twice as many elements as coordinates"
            )
        };
        self.rate(t, y.as_slice(), rate.as_mut_slice());
    }
}
