//! A further target language is one implementation of `Target`: here C, as far as programs need it.

use crate::common;

use common::{Builder, zoo};
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::graph::{Binary, Comparison, Number, Symbol, Unary};
use dynamics_symbolic::mechanics::{EnergyRole, Model};
use dynamics_symbolic::text::{Level, Style, Target, Text, lines};

struct C;

impl Target for C {
    fn number(&self, n: Number) -> Text {
        // 1/3 is 0 in C.
        match n {
            Number::Rational(n, 1) => {
                Text::new(format!("{n}.0"), if n < 0 { Level::Sum } else { Level::Atom })
            }
            Number::Rational(n, d) => Text::new(format!("{n}.0/{d}.0"), Level::Product),
            Number::Float(x) => Text::new(format!("{x:e}"), if x < 0.0 { Level::Sum } else { Level::Atom }),
        }
    }
    fn symbol(&self, _: &Model, symbol: Symbol) -> Text {
        Text::atom(match symbol {
            Symbol::Time => "t".to_owned(),
            Symbol::Coordinate(i) => format!("q[{i}]"),
            Symbol::Rate(i) => format!("u[{i}]"),
            Symbol::Acceleration(i) => format!("a[{i}]"),
            Symbol::Input(i) => format!("w[{i}]"),
            Symbol::Parameter(i) => format!("p[{i}]"),
            Symbol::Multiplier(i) => format!("lambda[{i}]"),
            Symbol::Mode(i) => format!("mode[{i}]"),
        })
    }
    fn smooth(&self, name: &str, order: u8, argument: &Text) -> Text {
        Text::atom(format!("{name}({order}, {})", argument.text))
    }
    fn unary(&self, f: Unary, a: &Text) -> Text {
        let name = match f {
            Unary::Ln => "log".to_owned(),
            Unary::Abs => "fabs".to_owned(),
            Unary::Signum => return Text::atom(format!("copysign(1.0, {})", a.text)),
            other => format!("{other:?}").to_lowercase(),
        };
        Text::atom(format!("{name}({})", a.text))
    }
    fn binary(&self, f: Binary, a: &Text, b: &Text) -> Text {
        let name = match f {
            Binary::Atan2 => "atan2",
            Binary::Powf => "pow",
            Binary::Hypot => "hypot",
            Binary::Min => "fmin",
            Binary::Max => "fmax",
        };
        Text::atom(format!("{name}({}, {})", a.text, b.text))
    }
    fn select(
        &self,
        comparison: Comparison,
        [left, right]: [&Text; 2],
        then: &Text,
        otherwise: &Text,
    ) -> Text {
        let sign = match comparison {
            Comparison::Less => "<",
            Comparison::LessEqual => "<=",
            Comparison::Equal => "==",
        };
        let sides = [left, right].map(|t| self.fit(t, Level::Sum));
        let text = format!("{} {sign} {} ? {} : {}", sides[0], sides[1], then.text, otherwise.text);
        Text::new(text, Level::Choice)
    }
    fn assign(&self, name: &Text, value: &Text) -> String {
        format!("const double {} = {};", name.text, value.text)
    }
}

fn program(model: Model, style: Style<'_>) -> (Vec<String>, Vec<String>) {
    let c = compile(model).expect("a sound model");
    let (body, results) = lines(&C, &c.model, &c.programs.accelerations, style);
    (body.into_iter().map(|l| l.text).collect(), results.into_iter().map(|r| r.text).collect())
}

#[test]
fn a_pendulum_in_c() {
    let mut b = Builder::new("Pendulum");
    let (theta, l, g) = (b.coordinate("theta"), b.parameter("l"), b.parameter("g"));
    let (s, c) = (b.sin(theta), b.cos(theta));
    let place = [b.mul(l, s), b.mul(l, c)];
    let one = b.g().one();
    let t = b.kinetic(one, &place);
    let height = b.mul(g, place[1]);
    let v = b.neg(height);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    b.energy("gravity", EnergyRole::Potential, v);
    let style = Style { inline: 0, inline_angle: 0, prefixes: ["c", "v"] };
    let (body, results) = program(b.model, style);
    for line in &body {
        assert!(line.starts_with("const double ") && line.ends_with(';'), "{line}");
        // One operation per line.
        let value = line.split(" = ").nth(1).expect("an assignment").trim_end_matches(';');
        assert!(value.matches(['*', '/', '+']).count() <= 1, "{line}");
    }
    assert!(body.iter().any(|l| l.ends_with("= sin(q[0]);")));
    assert!(results[0].starts_with(['v', '-']), "{results:?}");
}

#[test]
fn every_operation_has_a_form() {
    let style = Style { inline: 60, inline_angle: 20, prefixes: ["c", "v"] };
    let (body, _) = program(zoo(), style);
    let all = body.join("\n");
    for word in ["track(1, q[0])", "pow(", "hypot(", "log(", "cbrt(", " ? ", "atan("] {
        assert!(all.contains(word), "{word} in\n{all}");
    }
    let parentheses = |c: char| all.matches(c).count();
    assert_eq!(parentheses('('), parentheses(')'));
}
