//! Assertions of generated code about constants, types and functions, at compile time.

use crate::expr::Expr;
use crate::vector::{Vec2, Vec3};

/// A constant of std's, which `found` was taken for.
///
/// # Panics
/// Where it is another number: the build stops with `remedy`.
#[track_caller]
pub const fn expect_std(found: f64, expected: f64, remedy: &str) {
    expect(found.to_bits() == expected.to_bits(), remedy);
}

/// Largest relative difference of a constant from its value in the equations: sums and products are exact
/// there and rounded at run time.
const CONSTANT_ROUNDING: f64 = 1e-12;

/// A constant of the model and the number that its equations have for it.
///
/// # Panics
/// Where they differ by more than rounding: the build stops with `remedy`.
#[track_caller]
pub const fn expect_near(found: f64, derived: f64, remedy: &str) {
    expect((found - derived).abs() <= CONSTANT_ROUNDING * found.abs(), remedy);
}

/// What has to hold of a constant.
///
/// # Panics
/// Where it does not: the build stops with `remedy`.
#[track_caller]
pub const fn expect(holds: bool, remedy: &str) {
    assert!(holds, "{}", remedy);
}

/// Holds of a type and itself.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not the library's `{Library}`, which the macro takes it for by its name; choose \
        another name",
    label = "another type of this name"
)]
pub trait SameType<Library> {}

impl<T> SameType<T> for T {}

/// A type of the library, which a path was taken for: the build stops where it is another one.
pub const fn expect_type<T: SameType<Library>, Library>() {}

/// The library's `vec2`, which a path was taken for: numbers and expressions mixed, as few other functions
/// take them. The name is all that rustc shows of the cause.
pub const fn the_name_vec2_is_the_librarys_choose_another(_: fn(f64, Expr) -> Vec2) {}

/// The same of `vec3`.
pub const fn the_name_vec3_is_the_librarys_choose_another(_: fn(f64, Expr, f64) -> Vec3) {}

#[cfg(test)]
mod tests {
    use super::{expect_near, expect_std};

    /// Rounding is no difference.
    const _: () = expect_near(0.1 + 0.2, 0.3, "");
    const _: () = expect_near(0.0, 0.0, "");
    const _: () = expect_std(core::f64::consts::PI, 2.0 * core::f64::consts::FRAC_PI_2, "");

    #[test]
    #[should_panic(expected = "choose another")]
    fn another_number_stops_the_build() {
        expect_near(3.0, core::f64::consts::PI, "choose another");
    }
}
