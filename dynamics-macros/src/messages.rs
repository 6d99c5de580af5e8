//! The one catalogue of wording: lower case, *problem; remedy*, the user's names in backticks, no full stop.
//!
//! Every entry has a case under `tests/ui/` whose file is named after it; a test holds that.

use std::fmt::{self, Display};

/// A message of the catalogue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Message {
    /// Its entry.
    pub(crate) id: &'static str,
    text: String,
}

impl Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

macro_rules! catalogue {
    ($($name:ident($($argument:ident),*) $text:literal;)*) => {
        $(pub(crate) fn $name($($argument: impl Display),*) -> Message {
            Message { id: stringify!($name), text: format!($text) }
        })*
        /// All entries.
        pub(crate) const ENTRIES: &[&str] = &[$(stringify!($name)),*];
    };
}

catalogue! {
    // The struct.
    generic_model() "a model cannot be generic; its derived program is concrete `f64`";
    unnamed_fields() "a model's parameters need names; write a struct with named fields";
    parameter_type(ty) "a parameter cannot be `{ty}`; use `f64`, an array, `Vec2<f64>`, `Vec3<f64>`, `Mat3<f64>`, or a type with the `SmoothFunction` trait";
    parameter_without_f64(ty) "a parameter is made of `f64`; write `{ty}<f64>`";
    array_of_functions() "arrays of smooth functions are not supported; give each function a field of its own";
    length_not_literal(length) "`{length}` has no value while the macro runs; write the length as a literal such as `5`";
    length_zero() "an array of length 0 holds nothing; leave it out";
    too_many_parameters(limit) "more than {limit} scalars in one model; check the array lengths";
    no_coordinates(name) "`{name}` has no coordinates; name them with `#[coordinates(theta: rad, x: m)]`";
    attribute_twice(name) "`#[{name}(..)]` is given twice; put all entries into one";
    attribute_without_list(name, example) "`{name}` needs its entries; write `{example}`";
    attribute_entry(form) "this entry cannot be read; write {form}";
    attribute_of_unknown_field(attribute, name, hint) "`{attribute}` names `{name}`, which is no field of the struct{hint}";
    entry_twice(attribute, name) "`{attribute}` names `{name}` twice; keep one entry";
    nominal_of_function(name) "`{name}` is a smooth function, which has no nominal value; leave it out";
    nominal_shape(name, form) "the nominal value of `{name}` has another shape than the field; write {form}";
    model_argument() "`model` takes one argument; write `#[model(crate = path::to::dynamics)]`";
    keyword_as_name(name, what) "`{name}` is a keyword of Rust; choose another name for the {what}";
    reserved_name(name, what) "`{name}` cannot be {what}: the state has something of that name already; choose another name";
    duplicate_name(name, other) "`{name}` is {other} already; choose another name";
    rate_name(name, coordinate) "`{name}` is the name of the rate of `{coordinate}`; choose another name";
    nested_too_deeply() "this is nested too deeply or chained too long; split it into several `let`s or functions";

    // The impl block and its roles.
    trait_impl() "`#[dynamics]` belongs on the struct's own `impl` block; move it off the trait impl";
    macro_in_model(name) "the macro call `{name}!` cannot be followed; write its code out";
    constraint_role(name) "`#[{name}]` is not supported yet; choose coordinates that satisfy the constraint by themselves";
    role_with_arguments(name) "`#[{name}]` takes no arguments; write it bare";
    role_twice(name, function) "`{function}` is marked `#[{name}]` twice; remove one";
    two_roles(function, first, second) "`{function}` is both `#[{first}]` and `#[{second}]`; give each role its own function";
    duplicate_role(name, first) "`#[{name}]` is already on `{first}`; a model has only one";
    misspelt_role(name, role) "no role is called `{name}`; did you mean `#[{role}]`?";
}
