//! What a model with families brings along for programs in other languages.

use dynamics_runtime::model::Quantity;
use dynamics_runtime::smooth::SmoothFunction;

use crate::model::FamilyModel;

/// A model with families whose loops run outside of Rust, too: as a page in a browser.
///
/// `#[dynamics]` implements it for every model with families. The texts are constants; a program that does
/// not use them does not contain them.
pub trait PortableFamily: FamilyModel {
    /// A function of the counts and of the numbered parameters that returns all loops in JavaScript; empty
    /// where [`NOT_PORTABLE`](Self::NOT_PORTABLE) says why.
    const JAVASCRIPT: &'static str;
    /// The equations of motion in MathML, one paragraph for every range of indices.
    const MATHML: &'static str;
    /// The symbols of fields, inputs and scalar parameters in MathML, in this order.
    const SYMBOLS: &'static [&'static str];
    /// What a page cannot do with the model, in words.
    const NOT_PORTABLE: &'static [&'static str];
    /// The outputs that could be followed as expressions, which pages have: the names of their components,
    /// as `tip.x`.
    const SHOWN: &'static [&'static str];
    /// Whether the picture shows anything of space.
    const SPATIAL: bool;
    /// The scalar parameters.
    const PARAMETERS: &'static [Quantity];
    /// The names of the counts.
    const COUNTS: &'static [&'static str];
    /// The names of the numbered parameters.
    const NUMBERED: &'static [&'static str];
    /// Names of the model's smooth functions.
    const FUNCTIONS: &'static [&'static str];
    /// The values of the scalar parameters.
    fn parameters(&self) -> Vec<f64>;
    /// The counts.
    fn counts(&self) -> Vec<usize>;
    /// The numbered parameters.
    fn numbered(&self) -> Vec<&[f64]>;
    /// The model's smooth functions in the order of [`FUNCTIONS`](Self::FUNCTIONS).
    fn smooth_functions(&self) -> Vec<&dyn SmoothFunction>;
}
