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

/// A model whose programs are printed in C99, too.
///
/// `#[dynamics]` implements it where `#[model(targets(c))]` stands on the struct: the text costs compile
/// time. A program that does not use it does not contain it.
#[diagnostic::on_unimplemented(
    message = "the programs of `{Self}` are not printed in C",
    label = "this model has no programs in C",
    note = "write `#[model(targets(c))]` on the struct, beside `#[derive(Dynamics)]`"
)]
pub trait PrintedInC: Portable {
    /// The texts.
    const C: ProgramsInC;
}

/// A model whose accelerations are printed in WGSL, too, the language of kernels for graphics cards of all
/// makers.
///
/// `#[dynamics]` implements it where `#[model(targets(wgsl))]` stands on the struct: the text costs compile
/// time. A program that does not use it does not contain it.
#[diagnostic::on_unimplemented(
    message = "the accelerations of `{Self}` are not printed in WGSL",
    label = "this model has no programs in WGSL",
    note = "write `#[model(targets(wgsl))]` on the struct, beside `#[derive(Dynamics)]`"
)]
pub trait PrintedInWgsl: Portable {
    /// The texts.
    const WGSL: ProgramsInWgsl;
}

/// Programs of a model as functions of WGSL, which computes with single precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramsInWgsl {
    /// `model_constants` and `model_accelerations`. Sines are those of a function `sin_cos` that is not here.
    pub programs: &'static str,
    /// Length of the array of constants.
    pub constants: usize,
    /// What stands against it, in words; then the text is empty.
    pub obstacles: &'static [&'static str],
}

/// Programs of a model as functions of C99.
///
/// The texts are templates: `@` stands for the suffix of numbers and of functions of `<math.h>`, which is
/// empty for doubles and `f` for floats. `dynamics::export` makes files of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramsInC {
    /// What all names begin with: the struct's name in small letters.
    pub name: &'static str,
    /// The header.
    pub header: &'static str,
    /// Functions that the programs call, but for smooth functions.
    pub support: &'static str,
    /// The functions that the header declares.
    pub programs: &'static str,
    /// Length of the array of constants.
    pub constants: usize,
    /// For each result of `_kinks` the number of the smooth function whose argument it is, in the order of
    /// [`Portable::FUNCTIONS`]; `None` for what changes its sign.
    pub kink_functions: &'static [Option<usize>],
    /// Whether there is a function `_directional`.
    pub directional: bool,
    /// Whether sines and cosines in Rust are those of the platform, by `#[model(sin_cos = accurate)]`.
    pub accurate: bool,
    /// What stands against it, in words; then the texts are empty.
    pub obstacles: &'static [&'static str],
}
