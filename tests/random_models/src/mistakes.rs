//! Valid models with one mistake.

use crate::random::Random;

/// What is written into a function of the model, and has to be one error.
const TERMS: &[&str] = &[
    "q.no_such_coordinate",
    "self.no_such_parameter",
    "no_such_variable",
    "self.no_such_helper(q)",
    "(1.0_f64).no_such_method()",
    "Self::NO_SUCH_CONSTANT",
    "no_such_function(1.0)",
    "vec2(1.0, 2.0).w",
    "vec2(1.0, 2.0)",
    "true",
    "[1.0, 2.0][2]",
    "q.t.dt().no_such()",
    "(|x: f64| x)(1.0)",
    "q.no_such_array[0]",
    "no_such::CONSTANT",
    "NO_SUCH_CONSTANT",
    "vec3(1.0, 2.0, 3.0).no_such()",
    "{ println!(\"{}\", 1.0); 1.0 }",
    "{ let unit = 1.0; unit.no_such() }",
    "Vec2::no_such(1.0)",
    "q.t.sin(1.0)",
    "if q.t { 1.0 } else { 2.0 }",
    "(1.0 + vec2(1.0, 2.0))",
    "q.reaction(Self::no_such_constraint)",
];

/// A model with one of the functions changed.
#[must_use]
pub fn with_mistake(text: &str, r: &mut Random) -> String {
    let body = format!("0.4 * {}", r.pick(TERMS));
    let name = "with_a_mistake";
    let function = format!(
        "    #[output]\n    fn {name}(&self, q: &::dynamics::prelude::Coordinates<Self>) -> \
         ::dynamics::prelude::Expr {{\n        {body} * q.t\n    }}\n"
    );
    // The last brace closes the block.
    let end = text.trim_end().len() - 1;
    format!("{}{function}}}\n", &text[..end])
}
