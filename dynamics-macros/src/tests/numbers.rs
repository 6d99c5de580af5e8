//! Integers and constants: Rust's value, or an error.

use dynamics_symbolic::graph::{Bindings, FunctionId, Symbol};

use super::try_model;

const DECLARATION: &str = "#[coordinates(x)] struct M { m: f64 }";

/// The errors of a model with this constant output, or its value.
fn output(extra: &str, body: &str) -> Result<f64, Vec<(String, String)>> {
    let implementation = format!(
        "impl M {{
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {{ 0.5 * self.m * q.x.dt().powi(2) }}
            {extra}
            #[output] fn result(&self, q: &Coordinates<Self>) -> Expr {{ q.x * ({body}) }}
        }}"
    );
    let compiled = try_model(DECLARATION, &implementation)?.compiled;
    let node = compiled.model.outputs[0].components[0].1;
    Ok(compiled.model.graph.evaluate(&[node], &One)[node.index()])
}

/// Everything is 1.
struct One;
impl Bindings for One {
    fn symbol(&self, _: Symbol) -> f64 {
        1.0
    }
    fn smooth(&self, _: FunctionId, _: u8, _: f64) -> f64 {
        1.0
    }
}

/// The same text for rustc and for the elaborator.
macro_rules! same_as_rust {
    ($($body:expr),* $(,)?) => {
        $(assert_eq!(output("", stringify!($body)), Ok($body), "{}", stringify!($body));)*
    };
}

#[test]
#[allow(clippy::cast_lossless, clippy::unnecessary_cast, trivial_numeric_casts)]
fn casts_and_methods_of_integers_are_those_of_rust() {
    same_as_rust!(
        (300_i32 as u8) as f64,
        (200_i32 as i8) as f64,
        (-1_i32 as i64) as f64,
        (-1_i32 as u32) as f64,
        (70_000_usize as u16) as f64,
        (40_000_u16 as i16) as f64,
        (5_000_000_000_i64 as i32) as f64,
        (3_000_000_000_u32 as i32) as f64,
        9_007_199_254_740_993_i64 as f64 - 9_007_199_254_740_992.0,
        if 6_usize.is_multiple_of(3) { 1.0 } else { 2.0 },
        7_u32.div_ceil(2) as f64,
        (-7_i32).rem_euclid(3) as f64,
        (-7_i32).div_euclid(3) as f64,
        (3_usize.abs_diff(5)) as f64,
        (3_usize.saturating_sub(5)) as f64 + 1.0,
        250_u8.saturating_add(20) as f64,
        (-3_i32).signum() as f64,
        9_i32.clamp(2, 5) as f64,
        2_i32.pow(10) as f64,
        f64::midpoint(1.0, 4.0),
    );
}

#[test]
fn what_the_type_does_not_hold_is_an_error_at_the_operation() {
    for (body, place) in [
        ("(0_usize - 1) as f64", "-"),
        ("(250_u8 + 10) as f64", "+"),
        ("(100_i8 * 2) as f64", "*"),
        ("(i32::pow(2, 3) as f64)", "i32::pow"),
        ("(2_i32.pow(31)) as f64", "pow"),
        ("(2_147_483_647 + 1) as f64", "+"),
        ("(-1_i32) as usize as f64", "as"),
        ("5_000_000_000_u64 as usize as f64", "as"),
        ("0.1f32 as f64", "0.1f32"),
        ("f64::from(0.1_f32)", "0.1_f32"),
        ("f64::from(0.1 as f32)", "f32"),
        ("2 * self.m", "*"),
        ("f64::sin(q.x)", "q.x"),
    ] {
        let places: Vec<String> = output("", body).unwrap_err().into_iter().map(|(place, _)| place).collect();
        assert_eq!(places[0], place, "{body}");
    }
}

#[test]
fn the_type_is_inferred_as_rustc_does() {
    // An index, an argument, an annotation, a loop's bound: what follows, and what came before.
    for extra in [
        "fn f(&self, i: usize) -> f64 { (i - 1) as f64 }",
        "fn f(&self, i: u8) -> f64 { let j = i; (j - 1) as f64 }",
        "fn f(&self, i: i32) -> f64 \
         { let n: usize = 0; let mut s = i as f64; for k in 0..1 { s += (n + k - 1) as f64; } s }",
        "fn f(&self, i: i32) -> f64 \
         { let a = [1.0, 2.0]; let k = 0; let j = k - 1; a[k] + i as f64 + j as f64 }",
        "fn f(&self, _i: i32) -> f64 \
         { let a = [1.0]; let mut s = 0.0;
             for (k, v) in a.iter().enumerate() { s += *v * (k - 1) as f64; } s }",
    ] {
        let errors = output(extra, "self.f(0)").unwrap_err();
        assert_eq!(errors.len(), 1, "{extra}: {errors:?}");
        assert_eq!(errors[0].0, "-", "{extra}");
    }
    for (extra, value) in [
        ("fn f(&self, i: i32) -> f64 { (i - 1) as f64 }", -1.0),
        ("fn f(&self, i: usize) -> f64 { i as f64 - 1.0 }", -1.0),
        ("fn f(&self, i: usize) -> f64 { if i > 0 && i - 1 < 2 { 1.0 } else { 2.0 } }", 2.0),
        ("fn f(&self, _i: i32) -> f64 { let mut s = 0.0; for k in 0..3 { s += (k - 1) as f64; } s }", 0.0),
    ] {
        assert_eq!(output(extra, "self.f(0)"), Ok(value), "{extra}");
    }
}

/// What a path outside of the block stands for is not known: it is std's, and that is asserted; or it is
/// refused.
#[test]
fn paths_outside_of_the_block_are_asserted_or_refused() {
    let taken = |path: &str| -> Vec<(String, f64)> {
        let implementation = format!(
            "impl M {{
                const E: f64 = 2.1e11;
                #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {{
                    0.5 * self.m * {path} * q.x.dt().powi(2)
                }}
            }}"
        );
        let model = try_model(DECLARATION, &implementation).expect("accepted");
        model.constants.taken.into_iter().map(|taken| (taken.text, taken.value)).collect()
    };
    let pi = core::f64::consts::PI;
    for (path, text) in [
        ("PI", "PI"),
        ("std::f64::consts::PI", "std::f64::consts::PI"),
        ("consts::PI", "consts::PI"),
        ("k::PI", "k::PI"),
        ("steel::consts::PI", "steel::consts::PI"),
    ] {
        assert_eq!(taken(path), [(text.to_owned(), pi)]);
    }
    assert_eq!(taken("f64::EPSILON"), [("f64::EPSILON".to_owned(), f64::EPSILON)]);
    assert_eq!(taken("E").len(), 1, "not the block's");
    assert_eq!(taken("Self::E"), []);
    assert_eq!(taken("M::E"), []);
    for path in ["Steel::E", "G", "GRAVITY", "steel::GRAVITY", "f64::MAX"] {
        assert!(output("", path).is_err(), "{path}");
    }
}

/// The block's own constants are followed, those of a function shadow all others.
#[test]
fn constants_of_the_block_and_of_functions_are_the_users() {
    assert_eq!(output("const E: f64 = 2.0; const TAU: f64 = 3.0 * Self::E;", "Self::TAU"), Ok(6.0));
    assert_eq!(output("fn f(&self) -> f64 { const PI: f64 = 3.0; PI }", "self.f()"), Ok(3.0));
    assert_eq!(output("fn f(&self) -> f64 { let PI = 3.0; PI }", "self.f()"), Ok(3.0));
}
