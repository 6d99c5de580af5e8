//! What simulations have and pages cannot: closures. The compiler refuses them with words of their own.

use dynamics_runtime::model::{Portable, SimulationModel};
use dynamics_runtime::simulate::Direction;

use crate::live::Live;

/// What a closure that a page could run would return. There is none: a page runs without Rust.
#[diagnostic::on_unimplemented(
    message = "a live page cannot run a closure: it has no Rust",
    label = "a closure of Rust is given here",
    note = "inputs are sliders of a page: set their values in the start, and leave this call out",
    note = "events are declared: `.contact(..)`, `.stick_slip(..)`, `.stop_at(..)`",
    note = "or show the recorded motion: `motion.animate(..)`"
)]
pub trait HeldByPages {}

impl<M: SimulationModel + Portable> Live<'_, M> {
    /// Pages have no laws of inputs: inputs are sliders.
    #[doc(hidden)]
    pub fn inputs<R: HeldByPages>(self, _: impl Fn(f64, &M::State) -> R) -> Self {
        self
    }

    /// Pages have no functions of resets: contacts and stops are declared.
    #[doc(hidden)]
    pub fn on_event<R: HeldByPages>(self, _: &str, _: Direction, _: impl FnMut(&mut M::State) -> R) -> Self {
        self
    }

    /// Pages have the events of the model alone.
    #[doc(hidden)]
    pub fn event<R: HeldByPages>(self, _: &str, _: impl Fn(&M::State) -> R) -> Self {
        self
    }
}
