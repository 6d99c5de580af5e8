//! Functions that programs call, with the conventions of `dynamics-vocabulary/src/math.rs` and, for sines, of
//! `dynamics-simd/src/lanes/sines.rs` without fused products: every operation is written in the order of the
//! Rust code, because another order rounds differently.

/// Names that programs call, what these need besides, and the text. There `$` stands for the model's prefix,
/// `%%` for it in capitals.
const FUNCTIONS: &[(&str, &[&str], &str)] = &[
    ("sin_cos", &[], include_str!("sin_cos.c")),
    (
        "sin",
        &["sin_cos"],
        "static real $_sin(real x)\n{\n  real cosine;\n  return $_sin_cos(x, &cosine);\n}\n",
    ),
    (
        "cos",
        &["sin_cos"],
        "static real $_cos(real x)\n{\n  real cosine;\n  (void)$_sin_cos(x, &cosine);\n  \
         return cosine;\n}\n",
    ),
    (
        "signum",
        &[],
        "/* 1 for x >= +0, -1 for x <= -0, NaN for NaN. */\n\
         static real $_signum(real x)\n{\n  return isnan(x) ? x : copysign@(1.0@, x);\n}\n",
    ),
    (
        "min",
        &[],
        "/* The lesser, the first where they are equal; NaN if either is. */\n\
         static real $_min(real a, real b)\n{\n  \
         return (a <= b) ? a : ((b < a) ? b : (real)NAN);\n}\n",
    ),
    (
        "max",
        &[],
        "/* The greater, the first where they are equal; NaN if either is. */\n\
         static real $_max(real a, real b)\n{\n  \
         return (a >= b) ? a : ((b > a) ? b : (real)NAN);\n}\n",
    ),
];

/// Bounds of pivots that stand for rounding are larger in floats, as their last place is, by 2²⁹.
const BOUND: &str = "/* A bound of pivots: in floats at least 1e-13*2^29, as their last place is larger. */\n\
                     #define $_bound(x) (((sizeof(real) < 8) && ((x) < 5.4e-5@)) ? 5.4e-5@ : (x))\n";

/// What the functions of a text call.
pub(super) fn support(name: &str, text: &str) -> String {
    let called = |function: &str, text: &str| text.contains(&format!("{name}_{function}("));
    let mut wanted: Vec<&str> = Vec::new();
    for (function, needs, _) in FUNCTIONS {
        if called(function, text) {
            wanted.push(function);
            wanted.extend(*needs);
        }
    }
    let bound = called("bound", text).then_some(BOUND);
    let functions = FUNCTIONS.iter().filter(|(function, ..)| wanted.contains(function));
    let all = bound.into_iter().chain(functions.map(|(_, _, text)| *text));
    all.map(|text| format!("{}\n", text.replace("%%", &name.to_uppercase()).replace('$', name))).collect()
}
