//! Constraints: their rows, their reactions with units, and mistakes about them.

use dynamics_symbolic::graph::{Node, Symbol};
use dynamics_symbolic::mechanics::ConstraintKind;

use super::models::CONSTRAINED;
use super::{model, try_model};

const DECLARATION: &str = "#[coordinates(x: m, y: m)] #[units(m: kg)] struct M { m: f64, l: f64 }";

/// A model with more functions.
fn with(functions: &str) -> Result<crate::compile::CompiledModel, Vec<(String, String)>> {
    let implementation = format!(
        "impl M {{
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {{
                0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
            }}
            {functions}
        }}"
    );
    try_model(DECLARATION, &implementation)
}

/// Places of the errors.
fn places(functions: &str) -> Vec<String> {
    with(functions).err().unwrap_or_default().into_iter().map(|(place, _)| place).collect()
}

const ROD: &str = "#[holonomic] fn rod(&self, q: &Coordinates<Self>) -> Expr \
     { q.x.powi(2) + q.y.powi(2) - self.l.powi(2) }";

/// A model with a rod and an output.
fn output(body: &str) -> String {
    format!("{ROD} #[output] fn result(&self, q: &Coordinates<Self>) -> Expr {{ {body} }}")
}

#[test]
fn holonomic_rows_come_first_whatever_the_order_of_declaration() {
    let compiled = model(CONSTRAINED.0, CONSTRAINED.1).compiled;
    let listed: Vec<_> =
        compiled.model.constraints.iter().map(|c| (&*c.name, c.switched, c.redundant)).collect();
    assert_eq!(listed, [("floor", false, true), ("roll", true, false)]);
    assert_eq!(compiled.model.constraints[1].kind, ConstraintKind::Nonholonomic { integrable: true });
    assert_eq!(compiled.model.row_name(1), "floor.y");
    let grip = compiled.model.outputs[0].components[0].1;
    assert!(matches!(compiled.model.graph.node(grip), Node::Symbol(Symbol::Multiplier(2))));
}

#[test]
fn a_reaction_times_its_constraint_is_work() {
    let compiled = model(CONSTRAINED.0, CONSTRAINED.1).compiled;
    let units: Vec<&[String]> = compiled.model.constraints.iter().map(|c| &*c.units).collect();
    assert_eq!(units, [&["m", "m"][..], &["m/s"]]);
    // A rolling contact's reaction is a force: power over velocity.
    assert_eq!(compiled.model.outputs[0].unit, "N");
    let unit_of = |body: &str| with(&output(body)).map(|m| m.compiled.model.outputs[0].unit.clone());
    assert_eq!(unit_of("q.reaction(Self::rod) * q.x"), Ok("N".into()));
    let errors = with(&output("q.reaction(Self::rod) + q.x")).map(|_| ()).unwrap_err();
    assert_eq!(errors.len(), 1);
    assert!(errors[0].1.contains("`+` combines"), "{errors:?}");
}

#[test]
fn mistakes_are_reported_at_their_own_tokens() {
    for (functions, at) in [
        (output("q.reaction(Self::rood)"), "rood"),
        (output("q.reaction(Self::kinetic)"), "kinetic"),
        (output("q.reaction(rod)"), "rod"),
        (output("q.reaction(self.rod(q))"), "self.rod(q)"),
        (output("q.reaction()"), "reaction"),
        (output("q.slip(Self::rod)"), "rod"),
        (output("q.reaction(Self::rod).dt()"), "dt"),
        (
            format!(
                "{ROD} #[potential] fn v(&self, q: &Coordinates<Self>) -> Expr {{ q.reaction(Self::rod) }}"
            ),
            "reaction",
        ),
        (ROD.replace("holonomic", "holonomic(fixed)"), "fixed"),
        (ROD.replace("holonomic", "holonomic(integrable)"), "integrable"),
        (ROD.replace("holonomic", "holonomic(switched, redundant)"), "redundant"),
        (ROD.replace("#[holonomic]", "#[holonomic] #[redundant(meant)]"), "redundant(meant)"),
        (ROD.replace("#[holonomic]", "#[redundant]"), "redundant"),
        (ROD.replace("-> Expr", "-> Force"), "fn rod(&self, q: &Coordinates<Self>) -> Force"),
        (
            ROD.replace("-> Expr", "-> [Expr; 0]")
                .replace("q.x.powi(2) + q.y.powi(2) - self.l.powi(2)", "[]"),
            "-> [Expr; 0]",
        ),
    ] {
        let found = places(&functions);
        assert!(found.iter().any(|place| place == at) && found.len() <= 2, "{functions}: {found:?}");
    }
}

#[test]
fn what_follows_from_a_lost_constraint_is_silent() {
    let lost = output("q.reaction(Self::rod) + q.slip(Self::rod)").replace("q.x.powi(2)", "q.z.powi(2)");
    assert_eq!(places(&lost), ["z"]);
}

#[test]
fn a_helper_may_ask_where_its_callers_may() {
    let helper = "fn tension(&self, q: &Coordinates<Self>) -> Expr { q.reaction(Self::rod) * self.l }";
    assert!(with(&format!("{helper} {}", output("self.tension(q)"))).is_ok());
    let spring = "#[potential] fn v(&self, q: &Coordinates<Self>) -> Expr { self.tension(q) * q.x }";
    assert_eq!(places(&format!("{helper} {ROD} {spring}")), ["reaction"]);
}

/// N windows in a row in absolute coordinates, the model of IFToMM problem A02.
fn windows(n: usize, nominal: &str) -> [String; 2] {
    let (rods, standing, between) = (2 * n + 1, n + 1, 2 * n);
    let declaration = format!(
        "#[coordinates(x: [m; {rods}], y: [m; {rods}], angle: [rad; {rods}])] {nominal} struct Windows \
         {{ m: f64, l: f64, g: f64 }}"
    );
    let implementation = format!(
        "impl Windows {{
            fn centre(&self, q: &Coordinates<Self>, rod: usize) -> Vec2 {{ vec2(q.x[rod], q.y[rod]) }}
            fn half(&self, q: &Coordinates<Self>, rod: usize) -> Vec2 {{
                0.5 * self.l * vec2(q.angle[rod].cos(), q.angle[rod].sin())
            }}
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {{
                let mut sum = Expr::ZERO;
                for rod in 0..{rods} {{
                    sum += 0.5 * self.m * self.centre(q, rod).dt().norm_squared()
                        + self.m * (self.l * q.angle[rod].dt()).powi(2) / 24.0;
                }}
                sum
            }}
            #[potential] fn gravity(&self, q: &Coordinates<Self>) -> Expr {{
                let mut sum = Expr::ZERO;
                for rod in 0..{rods} {{ sum += self.m * self.g * q.y[rod]; }}
                sum
            }}
            #[holonomic] fn ground(&self, q: &Coordinates<Self>) -> [Vec2; {standing}] {{
                let mut joints = [Vec2::ZERO; {standing}];
                for i in 0..{standing} {{
                    joints[i] = self.centre(q, i) - self.half(q, i) - vec2(i as f64 * self.l, 0.0);
                }}
                joints
            }}
            #[holonomic] fn corner(&self, q: &Coordinates<Self>) -> [Vec2; {between}] {{
                let mut joints = [Vec2::ZERO; {between}];
                for j in 0..{n} {{
                    let beam = {standing} + j;
                    let (top, next) = (self.centre(q, j) + self.half(q, j), self.centre(q, j + 1) +
                    self.half(q, j + 1));
                    joints[2 * j] = self.centre(q, beam) - self.half(q, beam) - top;
                    joints[2 * j + 1] = self.centre(q, beam) + self.half(q, beam) - next;
                }}
                joints
            }}
        }}"
    );
    [declaration, implementation]
}

/// On most of their 3ᴺ branches some windows are flat and rows tangent; random starts with N = 7 and more
/// end on no others. One window turns, and the others with it. Where some are flat velocities are freer,
/// which is told second. Above 60 rows no state is looked for.
#[test]
fn windows_have_one_degree_of_freedom() {
    for n in [1, 6, 7, 8, 9, 10] {
        for nominal in ["#[nominal(l = 1.0)]", ""] {
            let [declaration, implementation] = windows(n, nominal);
            let report = model(&declaration, &implementation).compiled.report;
            let lines = report.lines().skip_while(|line| !line.starts_with("degrees of freedom"));
            let said = lines.take(4).flat_map(str::split_whitespace).collect::<Vec<_>>().join(" ");
            let (coordinates, rows) = (6 * n + 3, 6 * n + 2);
            let (start, independent) = match n {
                1 | 10 => ("1; ", format!("{coordinates} coordinates, {rows} independent rows")),
                _ => ("1, but ", format!("of the assembly, {rows} on others, where they hold, ")),
            };
            let freedom = said.strip_prefix("degrees of freedom ").expect("a line");
            assert!(freedom.starts_with(start) && freedom.contains(&independent), "{n} {nominal}: {said}");
        }
    }
}
