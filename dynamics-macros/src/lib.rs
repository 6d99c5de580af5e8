//! The procedural macros of `dynamics`; use them through that crate.

mod assertions;
mod compile;
mod diagnostics;
mod elaborate;
mod emit;
mod expand;
mod library;
mod messages;
mod suggest;
mod syntax;

use proc_macro::TokenStream;

/// Declares a mechanical model: the struct's fields are its parameters, `#[coordinates(..)]` names its
/// generalized coordinates.
#[proc_macro_derive(Dynamics, attributes(coordinates, speeds, inputs, units, nominal, model))]
pub fn derive_dynamics(item: TokenStream) -> TokenStream {
    let here = proc_macro::Span::call_site();
    expand::derive_once(item.into(), [here.line(), here.column()]).into()
}

/// Describes a model by the energies, forces and outputs in its impl block, and derives its equations of
/// motion.
#[proc_macro_attribute]
pub fn dynamics(arguments: TokenStream, item: TokenStream) -> TokenStream {
    let here = proc_macro::Span::call_site();
    expand::attribute(arguments.into(), item.into(), [here.line(), here.column()]).into()
}

/// Roles of functions: `#[dynamics]` reads them and takes them off. Without it rustc would know none of them,
/// an error for each, while what is missing is one attribute, which the derive names.
macro_rules! roles {
    ($($(#[$text:meta])* $role:ident)*) => {
        $(
            $(#[$text])*
            #[proc_macro_attribute]
            pub fn $role(_: TokenStream, item: TokenStream) -> TokenStream {
                expand::role(stringify!($role), item.into()).into()
            }
        )*
    };
}

roles! {
    /// A kinetic energy, `Expr`: T is the sum over all functions with this role.
    kinetic
    /// A potential energy, `Expr`: V is the sum over all functions with this role.
    potential
    /// A Lagrangian, `Expr`, where T − V is not the natural form.
    lagrangian
    /// A Rayleigh function D, `Expr`: the generalized force is −∂D/∂q̇.
    dissipation
    /// Applied forces, `Force`.
    force
    /// What is zero on every motion, in terms of coordinates and time: `Expr`, a vector, or an array of them.
    /// `#[holonomic(switched)]` is engaged and released while the model runs.
    holonomic
    /// What is zero on every motion and linear in the velocities: `Expr`, a vector, or an array of them;
    /// `#[nonholonomic(integrable)]`, `#[nonholonomic(switched)]`.
    nonholonomic
    /// Beside `#[holonomic]` or `#[nonholonomic]`: it repeats other constraints, and that is meant.
    redundant
    /// What the generalized speed of the function's name is, linear in the velocities: `Expr`, a vector or an
    /// array, as `#[speeds(..)]` declares it.
    kinematic
    /// A named result, `Expr` or a vector.
    output
    /// A value whose zero crossings are located, `Expr`.
    event
    /// How the model is drawn.
    drawing
}

/// Where the struct's tokens and the impl's meet; called by generated code alone.
#[doc(hidden)]
#[proc_macro]
pub fn __model(input: TokenStream) -> TokenStream {
    expand::model(input.into()).into()
}

#[cfg(test)]
mod tests;
