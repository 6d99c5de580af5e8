//! All mistakes of a phase at once, each once, at its own tokens; and what is no mistake.

use super::{model, try_model};

const DECLARATION: &str = "#[coordinates(x, y, angle: [_; 3])] struct M { m: f64, k: [f64; 3] }";

/// A model with one more function.
fn with(functions: &str) -> Result<(), Vec<(String, String)>> {
    let implementation = format!(
        "impl M {{
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {{
                let mut sum = q.x.dt().powi(2) + q.y.dt().powi(2);
                for a in q.angle {{ sum += a.dt().powi(2); }}
                0.5 * self.m * sum
            }}
            #[potential] fn potential(&self, q: &Coordinates<Self>) -> Expr {{
                q.x * (self.k[0] + self.k[1] + self.k[2])
            }}
            {functions}
        }}"
    );
    try_model(DECLARATION, &implementation).map(|_| ())
}

/// Places of the errors of an output.
fn places(body: &str) -> Vec<String> {
    let function = format!("#[output] fn result(&self, q: &Coordinates<Self>) -> Expr {{ {body} }}");
    with(&function).err().unwrap_or_default().into_iter().map(|(place, _)| place).collect()
}

#[test]
fn all_mistakes_are_reported_each_at_its_own_tokens() {
    assert_eq!(
        places("q.z + self.n + strange + q.x.sine() * (-1.0).sqrt()"),
        ["z", "n", "strange", "sine", "sqrt"]
    );
}

#[test]
fn a_mistake_in_a_loop_or_a_helper_is_one_mistake() {
    assert_eq!(places("let mut s = Expr::ZERO; for i in 0..3 { s += q.angle[i] * q.z; } s"), ["z"]);
    assert_eq!(places("let mut s = Expr::ZERO; for i in 0..9 { s += q.angle[i]; } s"), ["i"]);
    let helper = "fn helper(&self, q: &Coordinates<Self>) -> Expr { q.z }
        #[output] fn result(&self, q: &Coordinates<Self>) -> Expr { self.helper(q) + self.helper(q).sin() }";
    assert_eq!(with(helper).unwrap_err().len(), 1);
}

#[test]
fn what_follows_from_a_mistake_is_silent() {
    for body in [
        "let a = q.z; let (b, c) = a; let v = vec2(b, c); v.dot(v).sqrt() + a[3].x.dt()",
        "let mut a = q.z; a += 1.0; a[2] = 3.0; if a > 1.0 { a } else { vec2(a, a) }",
        "let mut s = Expr::ZERO; for i in q.z { s += q.angle[i]; } s",
        "if q.z > 0.0 { q.x } else { q.y }",
        "match q.z { 0 => q.x, _ => q.y }",
    ] {
        assert_eq!(places(body), ["z"], "{body}");
    }
}

#[test]
fn operators_are_underlined_themselves() {
    for (body, place) in [
        ("q.x + vec2(q.x, q.y)", "+"),
        ("q.x ^ 2", "^"),
        ("q.x * (1 / 2) as f64", "/"),
        ("q.x % 1.0", "%"),
        ("q.x / 0.0", "/"),
    ] {
        assert_eq!(places(body), [place], "{body}");
    }
}

#[test]
fn the_second_derivative_is_the_last() {
    assert_eq!(places("q.x.dt().dt()"), [""; 0]);
    assert_eq!(places("q.x.dt().dt().dt()"), ["dt"]);
}

#[test]
fn engine_findings_come_back_to_their_declaration() {
    let declaration = "#[coordinates(x, y)] struct M { m: f64, unread: [f64; 2] }";
    let implementation = "impl M { #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    } }";
    let errors = try_model(declaration, implementation).unwrap_err();
    assert_eq!(errors.iter().map(|(place, _)| place.as_str()).collect::<Vec<_>>(), ["unread"]);
}

#[test]
fn what_only_a_drawing_reads_is_used() {
    let declaration = "#[coordinates(x)] struct M { m: f64, radius: f64, colour: Colour }";
    let implementation = "impl M {
        #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr { 0.5 * self.m * q.x.dt().powi(2) }
        fn size(&self) -> f64 { self.radius * 2.0 }
        #[drawing] fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
            let mut drawing = Drawing::new();
            while drawing.len() < 3 { drawing.push(disc(q.x.value(), self.size(), &self.colour)); }
            drawing
        }
    }";
    model(declaration, implementation);
}

#[test]
fn helpers_that_no_role_calls_may_hold_any_rust() {
    let helper = "fn table(&self) -> Vec<String> { (0..3).map(|i| format!(\"{i}\")).collect() }";
    assert_eq!(with(helper), Ok(()));
}

#[test]
fn pointers_to_smooth_functions_are_smooth_functions() {
    let held =
        ["Box<dyn SmoothFunction>", "std::sync::Arc<Track>", "Rc<cams::Track>", "&'static Track", "Track"];
    let refused = [
        "Box<f64>",
        "Arc<[f64]>",
        "Rc<Vec<f64>>",
        "&'static str",
        "Vector3<f32>",
        "fn(f64) -> f64",
        "Box<Box<u8>>",
    ];
    let implementation =
        "impl M { #[lagrangian] fn first(&self, q: &Coordinates<Self>) -> Expr { 0.5 * q.x.dt().powi(2) }
        #[lagrangian] fn second(&self, q: &Coordinates<Self>) -> Expr { -self.f.at(q.x) } }";
    for (types, accepted) in [(&held[..], true), (&refused[..], false)] {
        for ty in types {
            let item = format!("#[coordinates(x)] struct M {{ f: {ty} }}");
            assert_eq!(super::try_model(&item, implementation).is_ok(), accepted, "{ty}");
        }
    }
}
