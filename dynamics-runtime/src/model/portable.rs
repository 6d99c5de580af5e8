//! What a model brings along for programs in other languages.

use alloc::vec::Vec;

use dynamics_vocabulary::smooth::{Pieces, SmoothFunction};

use super::Dynamics;

/// A model whose programs run outside of Rust, too: as a page in a browser.
///
/// `#[dynamics]` implements it for every model. The texts are constants; a program that does not use them
/// does not contain them.
pub trait Portable: Dynamics {
    /// All programs as one object of JavaScript; empty where [`NOT_PORTABLE`](Self::NOT_PORTABLE) says why.
    const JAVASCRIPT: &'static str;
    /// The equations of motion in MathML, one paragraph each.
    const MATHML: &'static str;
    /// The symbols of coordinates, inputs and parameters in MathML, in this order.
    const SYMBOLS: &'static [&'static str];
    /// What a page cannot do with the model, in words.
    const NOT_PORTABLE: &'static [&'static str];
    /// Whether the picture shows anything of space.
    const SPATIAL: bool;
    /// Whether there is a program of places where accelerations are not smooth.
    const HAS_KINKS: bool;
    /// Whether there are programs of kinetic and potential energy.
    const HAS_ENERGIES: bool;
    /// Names of the model's smooth functions.
    const FUNCTIONS: &'static [&'static str];
    /// The model's smooth functions in the order of [`FUNCTIONS`](Self::FUNCTIONS).
    fn smooth_functions(&self) -> Vec<&dyn SmoothFunction>;
    /// Their pieces; `None` for those that are not made of polynomials.
    fn pieces(&self) -> Vec<Option<Pieces>> {
        self.smooth_functions().into_iter().map(SmoothFunction::pieces).collect()
    }
}
