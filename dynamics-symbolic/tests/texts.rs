//! The texts of a model: what they say by eye (a few in full), and that it is true (all of them read back and
//! evaluated).

use crate::common;

use std::collections::BTreeMap;

use common::mechanisms::{andrews, cartesian_chain, slider_crank};
use common::reader::{Names, evaluate};
use common::{Builder, Values, arm, chain, double_pendulum, relative_chain, zoo};
use dynamics_symbolic::compile::{Compiled, compile};
use dynamics_symbolic::graph::{Bindings, NodeId, Symbol, Unary};
use dynamics_symbolic::mechanics::{ConstraintEquations, EnergyRole, Guarded, Model, Solution};

fn compiled(model: Model) -> Compiled {
    compile(model).unwrap_or_else(|found| panic!("{found:?}"))
}

pub(crate) fn models() -> [Model; 12] {
    let held = [rod_pendulum(), slider_crank().closed(), andrews().closed(), cartesian_chain(4).closed()];
    let free = [
        double_pendulum(),
        chain(1),
        chain(3),
        chain(10),
        relative_chain(3),
        relative_chain(6),
        arm(2),
        zoo(),
    ];
    let mut all = free.into_iter().chain(held);
    core::array::from_fn(|_| all.next().expect("twelve"))
}

/// A bob at (x, y) on a rod.
fn rod_pendulum() -> Model {
    let mut b = Builder::new("RodPendulum");
    let place = [b.coordinate("x"), b.coordinate("y")];
    let [m, l, g] = ["m", "l", "g"].map(|n| b.parameter(n));
    let kinetic = b.kinetic(m, &place);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let h = b.mul(m, place[1]);
    let gravity = b.mul(g, h);
    b.energy("gravity", EnergyRole::Potential, gravity);
    let (square, l2) = (b.norm_squared(&place), b.mul(l, l));
    let rod = b.sub(square, l2);
    b.holonomic("rod", &[rod]);
    b.model
}

/// Values at some random-looking point.
pub(crate) fn values(model: &Model) -> Values {
    let mut state = 0.37;
    let mut next = || {
        state = (state * 977.0_f64 + 0.123).fract();
        state + 0.2
    };
    let n = model.coordinates.len();
    let mut list = |n: usize| (0..n).map(|_| next()).collect::<Vec<f64>>();
    Values {
        t: 0.7,
        q: list(n),
        u: list(n),
        a: list(n),
        w: list(model.inputs.len()),
        p: list(model.parameters.len()),
        lambda: list(12),
    }
}

pub(crate) fn names(model: &Model, v: &Values) -> Names {
    let mut names = Names::from([("t".to_owned(), v.t)]);
    for (i, c) in model.coordinates.iter().enumerate() {
        names.insert(c.name.clone(), v.q[i]);
        names.insert(format!("{}'", c.name), v.u[i]);
        names.insert(format!("{}''", c.name), v.a[i]);
    }
    for row in 0..model.constraints.iter().map(|c| c.components.len()).sum::<usize>() {
        names.insert(format!("lambda[{}]", model.row_name(row as u32)), v.lambda[row]);
    }
    names.extend(model.inputs.iter().map(|i| i.name.clone()).zip(v.w.iter().copied()));
    names.extend(model.parameters.iter().map(|p| p.name.clone()).zip(v.p.iter().copied()));
    names
}

/// What every label of the listing stands for, by the equations themselves.
fn labels(c: &Compiled) -> BTreeMap<String, NodeId> {
    let (e, q) = (&c.equations, c.model.coordinates.iter().map(|c| c.name.clone()).collect::<Vec<_>>());
    let jacobians = e.jacobians.as_ref().expect("small enough");
    let mut out = BTreeMap::new();
    for (i, a) in q.iter().enumerate() {
        out.extend(e.accelerations.get(i).map(|x| (format!("{a}''"), *x)));
        out.insert(format!("Q[{a}]"), e.generalized_force[i]);
        out.insert(format!("p[{a}]"), e.momenta[i]);
        for (j, b) in q.iter().enumerate() {
            out.insert(format!("M[{a}, {b}]"), e.mass_matrix[i][j]);
            out.insert(format!("d {a}'' / d {b}"), jacobians.by_q[i][j]);
            out.insert(format!("d {a}'' / d {b}'"), jacobians.by_u[i][j]);
        }
        for (j, p) in c.model.parameters.iter().enumerate() {
            out.insert(format!("d {a}'' / d {}", p.name), jacobians.by_parameters[i][j]);
        }
        for (j, w) in c.model.inputs.iter().enumerate() {
            out.insert(format!("d {a}'' / d {}", w.name), jacobians.by_inputs[i][j]);
        }
    }
    out.extend(e.constraints.iter().flat_map(|c| constraint_labels(&q, c)));
    out.extend(e.pivots.iter().map(|p| (format!("pivot[{}]", q[p.coordinate]), p.pivot)));
    out.insert("E".into(), e.energy_function);
    if let Some((t, v)) = e.energies {
        out.extend([("T".to_owned(), t), ("V".to_owned(), v)]);
    }
    out.extend(e.powers.iter().map(|p| (format!("power of {}", p.name), p.node)));
    let named = e.conserved.iter().map(|c| &c.quantity).chain(&e.outputs).chain(&e.events);
    out.extend(named.map(|n| (n.name.clone(), n.node)));
    out
}

/// The same for what the constraints add.
fn constraint_labels(q: &[String], c: &ConstraintEquations) -> Vec<(String, NodeId)> {
    let mut out = Vec::new();
    for (r, row) in c.rows.iter().enumerate() {
        let name = &row.name;
        out.extend(c.residual.get(r).map(|x| (name.clone(), *x)));
        out.push((format!("{name}'"), c.velocity_residual[r]));
        out.push((format!("offset[{name}]"), c.velocity_offset[r]));
        out.push((format!("gamma[{name}]"), c.gamma[r]));
        out.extend(q.iter().zip(&c.jacobian[r]).map(|(x, node)| (format!("J[{name}, {x}]"), *node)));
    }
    let derivatives = c.derivatives.as_ref().expect("small enough");
    let mut by = |of: &[String], x: &str, rows: &[Vec<NodeId>]| {
        for (name, row) in of.iter().zip(rows) {
            out.extend(q.iter().zip(row).map(|(b, node)| (format!("d {name} / d {b}{x}"), *node)));
        }
    };
    let reactions: Vec<String> = q.iter().map(|n| format!("reaction[{n}]")).collect();
    let gammas: Vec<String> = c.rows.iter().map(|row| format!("gamma[{}]", row.name)).collect();
    by(&reactions, "", &derivatives.reaction_by_q);
    by(&gammas, "", &derivatives.gamma_by_q);
    by(&gammas, "'", &derivatives.gamma_by_u);
    let Solution::Unrolled(u) = &c.solution else { panic!("{:?}", c.solution) };
    for (i, name) in q.iter().enumerate() {
        out.extend([(format!("{name}''"), u.accelerations[i]), (format!("delta[{name}]"), u.correction[i])]);
    }
    for (r, row) in c.rows.iter().enumerate() {
        out.push((format!("lambda[{}]", row.name), u.multipliers[r]));
    }
    out
}

/// What `pivot[..]`, `rod[..]` or `scale[..]` may stand for: a loop may have several guards of one name, a
/// rod inertia and a pivot.
fn guards(c: &Compiled, label: &str) -> Vec<NodeId> {
    let Some(Solution::Unrolled(u)) = c.equations.constraints.as_ref().map(|c| &c.solution) else {
        let both = c.equations.pivots.iter().flat_map(|p| {
            let name = &c.model.coordinates[p.coordinate].name;
            [(format!("pivot[{name}]"), p.pivot), (format!("rod[{name}]"), p.diagonal)]
        });
        return both.filter(|(own, _)| own == label).map(|(_, node)| node).collect();
    };
    let name = |of: Guarded| match of {
        Guarded::Coordinate(i) => c.model.coordinates[i].name.clone(),
        Guarded::Row(r) => c.model.row_name(r as u32),
    };
    let both = u.guards.iter().flat_map(|guard| {
        let name = name(guard.of);
        [(format!("pivot[{name}]"), guard.pivot), (format!("scale[{name}]"), guard.scale)]
    });
    both.filter(|(own, _)| own == label).map(|(_, node)| node).collect()
}

pub(crate) fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * (1.0 + a.abs() + b.abs())
}

/// Every line of the listing, read back, has the value that the graph has.
#[test]
fn listings_compute_what_they_say() {
    for model in models() {
        let c = compiled(model);
        let v = values(&c.model);
        let labels = labels(&c);
        let mut known = names(&c.model, &v);
        let mut checked = 0;
        for line in c.listing.lines() {
            let Some((left, right)) = line.trim().split_once(" = ") else {
                // A new program begins with its own temporaries.
                if !line.starts_with(' ') {
                    known = names(&c.model, &v);
                }
                continue;
            };
            let value = evaluate(right, &known);
            if line.starts_with("    ") {
                known.insert(left.to_owned(), value);
            } else {
                let mut nodes = guards(&c, left);
                nodes.extend(labels.get(left));
                let values = c.model.graph.evaluate(&nodes, &v);
                let expected: Vec<f64> = nodes.iter().map(|node| values[node.index()]).collect();
                assert!(expected.iter().any(|x| close(value, *x)), "{}: {line}: {expected:?}", c.model.name);
                checked += 1;
            }
        }
        assert!(checked > 5 * c.model.coordinates.len(), "{checked}");
    }
}

/// Both sides of every equation, read back, have the value that M, Q, T and V have.
#[test]
fn equations_say_what_is_derived() {
    for model in models() {
        let c = compiled(model);
        let v = values(&c.model);
        let e = &c.equations;
        let labels = labels(&c);
        let nodes: Vec<NodeId> = labels.values().copied().collect();
        let expected = c.model.graph.evaluate(&nodes, &v);
        let mut known = names(&c.model, &v);
        let text = c.equations_text.replace("\n    ", " ");
        let statements: Vec<(&str, &str)> = text.lines().filter_map(|l| l.split_once(" = ")).collect();
        let (constraints, statements): (Vec<_>, Vec<_>) =
            statements.iter().partition(|(l, _)| l.contains(": "));
        // Definitions follow their uses.
        let defined = |left: &str| left.starts_with('w') && left[1..].bytes().all(|b| b.is_ascii_digit());
        for (left, right) in statements.iter().filter(|(left, _)| defined(left)) {
            let value = evaluate(right, &known);
            known.insert((*left).to_owned(), value);
        }
        for (row, (left, right)) in constraints.iter().enumerate() {
            let (name, formula) = left.split_once(": ").expect("they were chosen so");
            assert_eq!((name, *right), (c.model.row_name(row as u32).as_str(), "0"));
            let value = evaluate(formula, &known);
            assert!(close(value, expected[labels[name].index()]), "{}: {left}", c.model.name);
        }
        assert_eq!(constraints.len(), e.constraints.as_ref().map_or(0, |c| c.rows.len()));
        let reaction = |i: usize| -> f64 {
            let rows = e.constraints.iter().flat_map(|c| &c.jacobian).zip(&v.lambda);
            rows.map(|(row, lambda)| expected[row[i].index()] * lambda).sum()
        };
        let mut row = 0;
        for (left, right) in statements.iter().filter(|(left, _)| !defined(left)) {
            if *left == "M q''" {
                continue;
            }
            let right = evaluate(right, &known);
            if let Some(i) = c.model.coordinates.iter().position(|q| *left == format!("R[{}]", q.name)) {
                assert!(close(right, reaction(i)), "{}: {left}", c.model.name);
                continue;
            }
            if let Some(node) = labels.get(*left).filter(|_| !left.ends_with('\'')) {
                assert!(close(right, expected[node.index()]), "{}: {left}", c.model.name);
                continue;
            }
            let force = expected[e.generalized_force[row].index()] + reaction(row);
            let inertia: f64 = (0..v.a.len()).map(|j| expected[e.mass_matrix[row][j].index()] * v.a[j]).sum();
            let left = evaluate(left, &known);
            assert!(
                close(left, inertia) && close(right, force),
                "{}: row {row}: {left} {inertia} {right} {force}",
                c.model.name
            );
            row += 1;
        }
        assert!(row == 0 || row == v.a.len(), "all rows or none");
        assert!(c.equations_text.contains("M[") != (row > 0));
    }
}

#[test]
fn the_double_pendulum_reads_like_a_textbook() {
    let expected = "\
DoublePendulum: equations of motion

(m1 + m2) l1^2 theta1'' + m2 l1 l2 cos(theta1 - theta2) theta2''
    = -(m1 + m2) l1 g sin(theta1) - m2 l1 l2 sin(theta1 - theta2) theta2'^2
m2 l1 l2 cos(theta1 - theta2) theta1'' + m2 l2^2 theta2''
    = m2 l1 l2 sin(theta1 - theta2) theta1'^2 - m2 l2 g sin(theta2)

energies

T = m2 l1 l2 cos(theta1 - theta2) theta1' theta2' + 0.5 (m1 + m2) l1^2 theta1'^2
    + 0.5 m2 l2^2 theta2'^2
V = -(m1 + m2) l1 g cos(theta1) - m2 l2 g cos(theta2)
";
    assert_eq!(compiled(double_pendulum()).equations_text, expected);
}

#[test]
fn a_pendulum_on_a_rod_reads_like_a_textbook() {
    let expected = "\
RodPendulum: equations of motion

m x'' = 2 x lambda[rod]
m y'' = 2 y lambda[rod] - m g

constraints

rod: x^2 - l^2 + y^2 = 0

energies

T = 0.5 m x'^2 + 0.5 m y'^2
V = m g y
";
    let c = compiled(rod_pendulum());
    assert_eq!(c.equations_text, expected);
    assert!(c.latex.contains("2 x \\, \\lambda_{\\mathrm{rod}}"), "{}", c.latex);
    assert!(c.latex.contains("&= 0 \\qquad (\\mathrm{rod})"), "{}", c.latex);
}

#[test]
fn latex_is_balanced() {
    for model in models() {
        let latex = compiled(model).latex;
        let count = |what: &str| latex.matches(what).count();
        assert_eq!(count("{"), count("}"));
        assert_eq!(count("\\left(") + count("\\left|"), count("\\right)") + count("\\right|"));
        assert_eq!((count("\\begin{align*}"), count("\\end{align*}")), (1, 1));
        for line in latex.lines().filter(|l| l.starts_with("  ")) {
            assert!(line.contains('&'), "{line}");
        }
    }
}

#[test]
fn the_report_says_what_matters() {
    let c = compiled(chain(3));
    for line in [
        "degrees of freedom  4: x, theta[0] ... theta[2]",
        "mass matrix         4 x 4, full, depends on coordinates, 4 of 10 elements constant",
        "equations           nonlinear, time does not enter",
        "ignorable           1: x",
        "conserved           energy",
        "                    momentum of x",
    ] {
        assert!(c.report.lines().any(|l| l == line), "{line}\n{}", c.report);
    }
    let zoo = compiled(zoo()).report;
    for line in ["inputs              1: push", "forces              1: gust", "conserved           nothing"]
    {
        assert!(zoo.lines().any(|l| l == line), "{line}\n{zoo}");
    }
    assert!(zoo.contains("time enters explicitly, driven by inputs"), "{zoo}");
}

#[test]
fn the_same_model_gives_the_same_texts() {
    let [a, b] = [(), ()].map(|()| compiled(chain(4)));
    assert_eq!(a.report, b.report);
    assert_eq!(a.equations_text, b.equations_text);
    assert_eq!(a.latex, b.latex);
    assert_eq!(a.mathml, b.mathml);
    assert_eq!(a.listing, b.listing);
}

/// The bindings of the tests know every symbol that a model has.
#[test]
fn values_cover_all_symbols() {
    let c = compiled(zoo());
    let v = values(&c.model);
    assert!(v.symbol(Symbol::Input(0)).is_finite() && v.symbol(Symbol::Acceleration(3)).is_finite());
}

/// Friction switches where the velocity changes sign, attraction divides by the distance: the report says
/// both.
#[test]
fn the_report_warns_of_switches_and_singularities() {
    let mut b = Builder::new("Comet");
    let (x, m, k) = (b.coordinate("x"), b.parameter("m"), b.parameter("k"));
    let t = b.kinetic(m, &[x]);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    let attraction = b.g().div(k, x).expect("not zero");
    let v = b.neg(attraction);
    b.energy("attraction", EnergyRole::Potential, v);
    let u = b.dt(x);
    let lost = b.g().unary(Unary::Abs, u);
    let lost = b.mul(k, lost);
    b.energy("friction", EnergyRole::Dissipation, lost);
    let report = compiled(b.model).report;
    assert!(report.contains("not smooth where    x' = 0; steps end there\n"), "{report}");
    assert!(report.contains("divides by          x"), "{report}");
    assert!(!report.contains("roots and logs"), "{report}");
}

/// Deep graphs do not exhaust the stack of a thread.
#[test]
fn deep_expressions_are_written() {
    let mut b = Builder::new("Deep");
    let (x, m) = (b.coordinate("x"), b.parameter("m"));
    let t = b.kinetic(m, &[x]);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    let mut v = x;
    for i in 0..3000 {
        v = b.g().unary([Unary::Atan, Unary::Tanh][i % 2], v);
        v = b.add(v, m);
    }
    b.energy("tower", EnergyRole::Potential, v);
    let run = || {
        compile(b.model.clone())
            .map(|c| [&c.listing, &c.report, &c.equations_text, &c.latex, &c.mathml].map(String::len))
    };
    let small = std::thread::Builder::new().stack_size(512 * 1024);
    let result =
        std::thread::scope(|s| small.spawn_scoped(s, run).expect("a thread").join().expect("no panic"));
    let [listing, report, equations, latex, mathml] = result.unwrap_or_else(|found| panic!("{found:?}"));
    assert!(
        listing > 500
            && report > 500
            && (1000..30_000).contains(&equations)
            && (1000..30_000).contains(&latex)
            && (1000..180_000).contains(&mathml)
    );
}
