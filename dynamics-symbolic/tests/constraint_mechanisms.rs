//! What the checks say of whole mechanisms: freedom, loops, samples that are where the constraints hold, and
//! no mistakes found where there are none.

use crate::common;

use common::Builder;
use common::constrained::{HOLONOMIC, NONHOLONOMIC, constrain, particles};
use common::mechanisms::{Mechanism, andrews, cartesian_chain, four_bar, n_four_bar, slider_crank};
use dynamics_symbolic::check::constraints::{Analysis, RankScope, analyse};
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::graph::{NodeId, Symbol};
use dynamics_symbolic::mechanics::{ConstraintKind, EnergyRole, Model};

/// The mechanism with its constraints, with nominal values or without.
fn model(mut mechanism: Mechanism, nominal: bool) -> Model {
    constrain(&mut mechanism.builder, "closure", HOLONOMIC, &mechanism.residual);
    if nominal {
        for (i, value) in mechanism.parameters.iter().enumerate() {
            mechanism.builder.nominal(i as u32, *value);
        }
    }
    for c in &mut mechanism.builder.model.coordinates {
        let length = c.name.starts_with('x')
            || c.name.starts_with('y')
            || c.name.ends_with(".x")
            || c.name.ends_with(".y");
        c.unit = if length { "m".into() } else { "rad".into() };
    }
    mechanism.builder.model
}

fn sound(model: &Model) -> Analysis {
    let analysis = analyse(model);
    assert_eq!(analysis.findings, [], "{}", model.name);
    analysis
}

#[test]
fn mechanisms_are_sound_and_their_samples_satisfy_them() {
    let all: [fn() -> Mechanism; 5] =
        [andrews, slider_crank, four_bar, || cartesian_chain(5), || n_four_bar(2)];
    for mechanism in all {
        for nominal in [true, false] {
            let model = model(mechanism(), nominal);
            let analysis = sound(&model);
            assert_eq!((analysis.rank, analysis.redundant), (analysis.rows, false), "{}", model.name);
            assert!(
                !nominal || analysis.rank_scope == RankScope::Nominal,
                "{} {:?}",
                model.name,
                analysis.rank_scope
            );
            let nodes: Vec<_> = model.constraints[0].components.iter().map(|(_, node)| *node).collect();
            for sample in &analysis.samples {
                let values = model.graph.evaluate(&nodes, sample);
                let worst = nodes.iter().fold(0.0f64, |m, n| m.max(values[n.index()].abs()));
                assert!(worst < 1e-10, "{}: {worst:e}", model.name);
            }
        }
    }
}

#[test]
fn large_models_are_looked_at_in_general_only() {
    let analysis = sound(&model(n_four_bar(40), true));
    assert_eq!((analysis.rows, analysis.rank, analysis.rank_scope), (242, 242, RankScope::TooMany));
}

#[test]
fn the_report_counts_freedom_and_loops() {
    let report = |mechanism: Mechanism| {
        let compiled = compile(model(mechanism, true)).unwrap_or_else(|found| panic!("{found:?}"));
        compiled.report
    };
    for (text, line) in [
        (
            report(four_bar()),
            "degrees of freedom  1; 3 coordinates, 2 independent rows of constraints, where they hold",
        ),
        (report(four_bar()), "loops               1: closure for coupler, rocker"),
        (report(slider_crank()), "constraints         closure: 2 rows, holonomic, fixed"),
        (report(andrews()), "loops               3: "),
        (report(andrews()), "reactions           all unique"),
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
}

/// Constraints on velocities that leave no freedom drive it from wherever it starts: positions are not theirs
/// to say.
#[test]
fn velocities_that_are_given_move_a_model_by_simulation() {
    let (mut b, q) = particles(&["x"]);
    let (rate, speed) = (b.dt(q[0]), b.parameter("speed"));
    let row = b.sub(rate, speed);
    constrain(&mut b, "motor", ConstraintKind::Nonholonomic { integrable: true }, &[row]);
    let report = compile(b.model).unwrap_or_else(|found| panic!("{found:?}")).report;
    let words = report.split_whitespace().collect::<Vec<_>>().join(" ");
    let said = "degrees of freedom 0 in velocities, 1 in positions: constraints on velocities say how it \
        moves, from wherever it starts; `simulate` follows them";
    assert!(words.contains(said), "{report}");
    assert!(!words.contains("kinematics"), "{report}");
}

/// A row from the coordinates.
type Row = fn(&mut Builder, &[NodeId]) -> NodeId;

/// The report of a mass on a plane with these constraints: name, row, whether it is switched.
fn report_of(constraints: &[(&str, Row, bool)]) -> String {
    let (mut b, q) = particles(&["x", "y"]);
    for (name, row, switched) in constraints {
        let row = row(&mut b, &q);
        constrain(&mut b, name, HOLONOMIC, &[row]).switched = *switched;
    }
    compile(b.model).unwrap_or_else(|found| panic!("{found:?}")).report
}

#[test]
fn the_report_says_what_constraints_leave_when_they_are_on_and_off() {
    let floor = |_: &mut Builder, q: &[NodeId]| q[1];
    let drive = |b: &mut Builder, q: &[NodeId]| {
        let (speed, t) = (b.parameter("speed"), b.model.graph.symbol(Symbol::Time));
        let way = b.mul(speed, t);
        b.sub(q[0], way)
    };
    let wall = |_: &mut Builder, q: &[NodeId]| q[0];
    for (text, lines) in [
        (
            report_of(&[("floor", floor, true)]),
            &["degrees of freedom  1 with all constraints on, 2 with the switched ones released; 2 \
                 coordinates, 1 independent"][..],
        ),
        // Switched constraints drive nothing: they let go.
        (
            report_of(&[("floor", floor, true), ("wall", wall, true)]),
            &["degrees of freedom  0 with all constraints on, 2 with the switched ones released; 2 \
                 coordinates, 2 independent"],
        ),
        (
            report_of(&[("floor", floor, false), ("drive", drive, false)]),
            &[
                "degrees of freedom  0: the constraints alone say how it moves",
                "all coordinates from the constraints",
            ],
        ),
        (
            report_of(&[("floor", floor, false)]),
            &["single rows         1: floor for y", "no pivot can vanish"],
        ),
    ] {
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        for line in lines {
            assert!(words(&text).contains(&words(line)), "{line}\n{text}");
        }
        assert!(!text.contains("loops "), "nothing closes here:\n{text}");
    }
}

/// Where motions are likely to begin: at the origin, where that is possible; beside it, where a row has no
/// direction there.
#[test]
fn likely_states_are_the_nearest_to_the_origin_in_which_rows_have_directions() {
    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-11);
    // z = x y: a saddle through the origin.
    let (mut b, q) = particles(&["x", "y", "z"]);
    let (product, saddle) = (b.mul(q[0], q[1]), q[2]);
    let row = b.sub(saddle, product);
    constrain(&mut b, "saddle", HOLONOMIC, &[row]);
    let found = sound(&b.model).likely;
    assert!(found.as_ref().is_some_and(|state| state.q == [0.0; 3]), "{found:?}");
    // Four numbers of unit length: one of them is 1, and the others are exactly 0.
    let (mut b, e) = particles(&["e0", "e1", "e2", "e3"]);
    let (square, one) = (b.norm_squared(&e), b.ratio(1, 1));
    let norm = b.sub(square, one);
    constrain(&mut b, "norm", HOLONOMIC, &[norm]);
    let likely = |b: &Builder| {
        let Analysis { likely, passed, .. } = sound(&b.model);
        likely.into_iter().chain(passed).collect::<Vec<_>>()
    };
    for (k, state) in likely(&b)[..4].iter().enumerate() {
        let others = (0..4).filter(|j| *j != k);
        assert!((state.q[k] - 1.0).abs() < 1e-11 && others.clone().all(|j| state.q[j] == 0.0), "{state:?}");
    }
    // A rod: along either axis, as long as the parameter says that stands in the same state.
    let (mut b, q) = particles(&["x", "y"]);
    let l = b.parameter("l");
    let (square, ll) = (b.norm_squared(&q), b.mul(l, l));
    let rod = b.sub(square, ll);
    constrain(&mut b, "rod", HOLONOMIC, &[rod]);
    let found = likely(&b);
    let l = |k: usize| found[k].parameters[0];
    assert!(near(&found[0].q, &[l(0), 0.0]) && near(&found[1].q, &[0.0, l(1)]), "{found:?}");
}

/// What rolls or glides may head anywhere, so that a quarter of a turn on is looked at, too; other angles of
/// a mechanism are what its loops make of them.
#[test]
fn headings_are_turned() {
    let mut b = Builder::new("Sleigh");
    let q: Vec<NodeId> = ["x", "y", "heading"].iter().map(|n| b.coordinate(n)).collect();
    b.model.coordinates[2].unit = "rad".into();
    let one = b.ratio(1, 1);
    let t = b.kinetic(one, &q);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    let (sin, cos) = (b.sin(q[2]), b.cos(q[2]));
    let rates: Vec<NodeId> = (0..2).map(|i| b.g().symbol(Symbol::Rate(i))).collect();
    let (along, across) = (b.mul(sin, rates[0]), b.mul(cos, rates[1]));
    let edge = b.sub(across, along);
    constrain(&mut b, "edge", NONHOLONOMIC, &[edge]);
    let analysis = sound(&b.model);
    assert_eq!(analysis.likely.iter().map(|s| s.q.as_slice()).collect::<Vec<_>>(), [[0.0; 3]]);
    let turned = [0.0, 0.0, core::f64::consts::FRAC_PI_2];
    assert!(analysis.passed.iter().any(|s| s.q == turned), "{:?}", analysis.passed);
    // Held by a row of positions it is not free to choose. (And what is left can be integrated, which is
    // said.)
    let row = b.sub(q[2], q[0]);
    constrain(&mut b, "held", HOLONOMIC, &[row]);
    // Rows of positions come first.
    b.model.constraints.swap(0, 1);
    let analysis = analyse(&b.model);
    assert!(!analysis.passed.iter().any(|s| s.q[2] == turned[2]), "{:?}", analysis.passed);
}
