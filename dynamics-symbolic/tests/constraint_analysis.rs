//! What the analysis of constraints says of rows together: repetitions, contradictions, integrability, on
//! systems where the answer is known.

use crate::common;

use common::Builder;
use common::constrained::{HOLONOMIC, NONHOLONOMIC, constrain, particles};
use dynamics_symbolic::check::Finding;
use dynamics_symbolic::check::constraints::{
    Analysis, Combination, ConstraintFinding as Fault, RankScope, analyse,
};
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::graph::{NodeId, Origin, Symbol, Unary};
use dynamics_symbolic::mechanics::{ConstraintKind, EnergyRole, Model};

fn sound(model: &Model) -> Analysis {
    let analysis = analyse(model);
    assert_eq!(analysis.findings, []);
    analysis
}

fn faults(model: &Model) -> Vec<Fault> {
    let one = |f: Finding| match f {
        Finding::Constraint(fault) => fault,
        other => panic!("{other:?}"),
    };
    analyse(model).findings.into_iter().map(one).collect()
}

fn repeats(name: &str, of: Combination, on_manifold: bool, origin: u32) -> Vec<Fault> {
    vec![Fault::Repeats { name: name.into(), of, on_manifold, origin: Origin(origin) }]
}

fn constant(text: &str) -> Combination {
    Combination::Constant(text.into())
}

fn of(names: &[&str]) -> Combination {
    Combination::Of(names.iter().map(|n| (*n).to_owned()).collect())
}

/// x² + y² − l², with l a new parameter.
fn circle(b: &mut Builder, x: NodeId, y: NodeId) -> NodeId {
    let l = b.parameter("l");
    let (square, ll) = (b.norm_squared(&[x, y]), b.mul(l, l));
    b.sub(square, ll)
}

#[test]
fn a_pendulum_is_sound_and_its_samples_are_on_the_circle() {
    let (mut b, q) = particles(&["x", "y"]);
    let rod = circle(&mut b, q[0], q[1]);
    constrain(&mut b, "rod", HOLONOMIC, &[rod]);
    for nominal in [false, true] {
        let analysis = sound(&b.model);
        assert_eq!((analysis.rows, analysis.rank, analysis.redundant), (1, 1, false));
        assert_eq!(analysis.rank_scope, if nominal { RankScope::Nominal } else { RankScope::Random });
        assert!(!analysis.samples.is_empty() && analysis.not_unique.is_empty());
        for s in &analysis.samples {
            let (x, y, l) = (s.q[0], s.q[1], s.parameters[0]);
            assert!((x.hypot(y) - l).abs() < 1e-11 && (!nominal || l == 100.0), "{s:?}");
        }
        b.nominal(0, 100.0);
    }
}

#[test]
fn a_repeated_row_is_named_with_its_combination() {
    let (mut b, q) = particles(&["x", "y", "z"]);
    let pin: Vec<NodeId> = (0..3).map(|i| b.linear(&[1 + i, 2, 3 - i * i], &q, i)).collect();
    let far = b.sub(pin[0], pin[2]);
    let near = b.sub(q[0], q[1]);
    constrain(&mut b, "pin", HOLONOMIC, &[pin[0], pin[2]]);
    constrain(&mut b, "closure", HOLONOMIC, &[near, far]);
    assert_eq!(faults(&b.model), repeats("closure[1]", constant("pin[0] - pin[1]"), false, 1001));
    b.model.constraints[1].redundant = true;
    let analysis = sound(&b.model);
    assert_eq!((analysis.rank, analysis.redundant), (3, true));
    assert_eq!((analysis.not_unique, analysis.superfluous), (vec![0, 1, 3], vec![3]));
}

#[test]
fn multiples_are_repetitions() {
    let (mut b, q) = particles(&["x", "y"]);
    let row = b.linear(&[2, -4], &q, 6);
    let half = b.linear(&[1, -2], &q, 3);
    let k = b.parameter("k");
    let scaled = b.mul(k, half);
    constrain(&mut b, "rail", HOLONOMIC, &[row]);
    constrain(&mut b, "guide", HOLONOMIC, &[half]);
    assert_eq!(faults(&b.model), repeats("guide", constant("rail/2"), false, 1001));
    b.model.constraints.pop();
    constrain(&mut b, "guide", HOLONOMIC, &[scaled]);
    assert_eq!(faults(&b.model), repeats("guide", of(&["rail"]), false, 1001));
}

#[test]
fn the_marked_constraint_is_the_one_that_repeats() {
    let (mut b, q) = particles(&["x", "y"]);
    let row = b.linear(&[1, 1], &q, 2);
    constrain(&mut b, "first", HOLONOMIC, &[row]).redundant = true;
    constrain(&mut b, "second", HOLONOMIC, &[row]);
    assert_eq!(sound(&b.model).superfluous, [0]);
    b.model.constraints[0].redundant = false;
    assert_eq!(faults(&b.model), repeats("second", constant("first"), false, 1001));
}

#[test]
fn redundant_said_in_vain_is_an_error() {
    let (mut b, q) = particles(&["x", "y"]);
    let rod = circle(&mut b, q[0], q[1]);
    constrain(&mut b, "rod", HOLONOMIC, &[rod]).redundant = true;
    let in_vain = [Fault::RedundantInVain { name: "rod".into(), origin: Origin(1000) }];
    assert_eq!(faults(&b.model), in_vain);
    // At some places of the wall it would be the rod's tangent: nobody knows as long as the parameters are
    // not.
    let d = b.parameter("d");
    let wall = b.sub(q[0], d);
    constrain(&mut b, "wall", HOLONOMIC, &[wall]);
    sound(&b.model);
    b.nominal(0, 2.0);
    b.nominal(1, 1.0);
    assert_eq!(faults(&b.model), in_vain);
}

#[test]
fn rows_with_one_gradient_and_different_constants_contradict_each_other() {
    let (mut b, q) = particles(&["x", "y"]);
    let [a, c] = ["a", "c"].map(|n| b.parameter(n));
    let (left, right) = (b.sub(q[0], a), b.sub(q[0], c));
    constrain(&mut b, "left", HOLONOMIC, &[left]);
    // Marking it as redundant does not help.
    constrain(&mut b, "right", HOLONOMIC, &[right]).redundant = true;
    let with = constant("left");
    assert_eq!(faults(&b.model), [Fault::Contradicts { name: "right".into(), with, origin: Origin(1001) }]);
}

#[test]
fn velocities_that_cannot_be_are_contradictions() {
    let (mut b, q) = particles(&["x", "y"]);
    let (x, v) = (b.sin(q[0]), b.dt(q[0]));
    let (slow, time) = (b.mul(x, v), b.g().symbol(Symbol::Time));
    let fast = b.sub(v, time);
    constrain(&mut b, "slow", NONHOLONOMIC, &[slow]);
    constrain(&mut b, "fast", NONHOLONOMIC, &[fast]);
    let with = of(&["slow"]);
    assert_eq!(faults(&b.model), [Fault::Contradicts { name: "fast".into(), with, origin: Origin(1001) }]);
    let (mut b, q) = particles(&["x", "y"]);
    let time = b.g().symbol(Symbol::Time);
    let (lift, rate) = (b.sub(q[0], time), b.dt(q[0]));
    constrain(&mut b, "lift", HOLONOMIC, &[lift]);
    constrain(&mut b, "brake", NONHOLONOMIC, &[rate]);
    let with = constant("lift.dt()");
    assert_eq!(faults(&b.model), [Fault::Contradicts { name: "brake".into(), with, origin: Origin(1001) }]);
}

#[test]
fn a_nonholonomic_row_that_is_the_rate_of_a_holonomic_one_repeats_it() {
    let (mut b, q) = particles(&["x", "y"]);
    let rod = circle(&mut b, q[0], q[1]);
    let rate = b.dt(rod);
    constrain(&mut b, "rod", HOLONOMIC, &[rod]);
    constrain(&mut b, "rolling", NONHOLONOMIC, &[rate]);
    assert_eq!(faults(&b.model), repeats("rolling", constant("rod.dt()"), false, 1001));
}

/// A rod that is too short for where its end is held.
#[test]
fn what_no_state_satisfies_is_contradictory_at_nominal_values() {
    let (mut b, q) = particles(&["x", "y"]);
    let rod = circle(&mut b, q[0], q[1]);
    let d = b.parameter("d");
    let wall = b.sub(q[0], d);
    constrain(&mut b, "rod", HOLONOMIC, &[rod]);
    constrain(&mut b, "wall", HOLONOMIC, &[wall]);
    b.nominal(0, 1.0);
    assert_ne!(analyse(&b.model).rank_scope, RankScope::Nowhere, "d is not known");
    b.nominal(1, 3.0);
    let found = faults(&b.model);
    let [Fault::Unsatisfiable { missed, .. }] = &found[..] else { panic!("{found:?}") };
    let [(rod, of_rod), (wall, of_wall)] = &missed[..] else { panic!("{missed:?}") };
    assert_eq!([rod, wall], ["rod", "wall"]);
    // A compromise between both: Φ/|Φ_q| of the rod is (x² − 1)/2x, 3 − x of the wall, and they are equal at
    // 3 x² − 6 x − 1 = 0.
    let x = 1.0 + (4.0f64 / 3.0).sqrt();
    assert!((of_wall - (3.0 - x)).abs() < 1e-3 && (of_rod - of_wall).abs() < 1e-3, "{of_rod} {of_wall}");
    b.model.nominal[1].1 = 0.5;
    assert_eq!(sound(&b.model).rank_scope, RankScope::Nominal);
}

/// The end of a crank cannot be as high: its height is flat where it comes closest.
#[test]
fn what_is_out_of_reach_is_missed_by_a_length() {
    let (mut b, q) = particles(&["x", "y"]);
    let (l, d) = (b.parameter("l"), b.parameter("d"));
    let sine = b.sin(q[0]);
    let height = b.mul(l, sine);
    let row = b.sub(height, d);
    constrain(&mut b, "height", HOLONOMIC, &[row]);
    b.nominal(0, 1.0);
    b.nominal(1, 1.5);
    let found = faults(&b.model);
    let [Fault::Unsatisfiable { missed, .. }] = &found[..] else { panic!("{found:?}") };
    assert!(missed[0].1 > 0.1 && missed[0].1 < 10.0, "{missed:?}");
}

/// (x² + y² − l²)(x + 3l): its gradient is another one than that of the rod, but not where both are zero.
#[test]
fn a_repetition_on_the_manifold_is_found() {
    let (mut b, q) = particles(&["x", "y"]);
    let rod = circle(&mut b, q[0], q[1]);
    let l = b.g().symbol(Symbol::Parameter(0));
    let three = b.ratio(3, 1);
    let shift = b.mul(three, l);
    let factor = b.add(q[0], shift);
    let twice = b.mul(rod, factor);
    constrain(&mut b, "rod", HOLONOMIC, &[rod]);
    constrain(&mut b, "again", HOLONOMIC, &[twice]);
    assert_eq!(faults(&b.model), repeats("again", of(&["rod"]), true, 1001));
    b.nominal(0, 2.0);
    assert_eq!(faults(&b.model), repeats("again", of(&["rod"]), true, 1001));
    b.model.constraints[1].redundant = true;
    let analysis = sound(&b.model);
    assert_eq!((analysis.rank, analysis.superfluous), (1, vec![1]));
}

/// Two circles about one point: gradients are parallel in every state, and none is on both.
#[test]
fn rows_with_parallel_gradients_that_vanish_on_other_sets_contradict_each_other() {
    let (mut b, q) = particles(&["x", "y"]);
    let l = b.parameter("l");
    let square = b.norm_squared(&q);
    let norm = b.g().unary(Unary::Sqrt, square);
    let (rod, ll) = (b.sub(norm, l), b.mul(l, l));
    constrain(&mut b, "rod", HOLONOMIC, &[rod]);
    let with_square = |b: &mut Builder, k: i128| {
        b.model.constraints.truncate(1);
        let factor = b.ratio(k, 1);
        let far = b.mul(factor, ll);
        let circle = b.sub(square, far);
        constrain(b, "circle", HOLONOMIC, &[circle]);
    };
    for nominal in [None, Some(1.0), Some(1e-3), Some(400.0)] {
        nominal.into_iter().for_each(|value| {
            b.model.nominal.clear();
            b.nominal(0, value);
        });
        with_square(&mut b, 4);
        let contradicts =
            Fault::Contradicts { name: "circle".into(), with: of(&["rod"]), origin: Origin(1001) };
        assert_eq!(faults(&b.model), [contradicts], "{nominal:?}");
        with_square(&mut b, 1);
        assert_eq!(faults(&b.model), repeats("circle", of(&["rod"]), true, 1001), "{nominal:?}");
    }
}

#[test]
fn more_rows_than_coordinates_are_too_many() {
    let (mut b, q) = particles(&["x"]);
    let [a, c] = ["a", "c"].map(|n| b.parameter(n));
    let (line, square) = (b.sub(q[0], a), b.norm_squared(&q));
    let parabola = b.sub(square, c);
    constrain(&mut b, "line", HOLONOMIC, &[line]);
    assert_eq!(sound(&b.model).rank, 1, "driven throughout is sound");
    constrain(&mut b, "parabola", HOLONOMIC, &[parabola]);
    let too_many =
        || Fault::TooMany { rows: 2, coordinates: 1, name: "parabola".into(), origin: Origin(1001) };
    assert_eq!(faults(&b.model), [too_many()]);
    b.nominal(0, 2.0);
    b.nominal(1, 5.0);
    assert_eq!(faults(&b.model), [too_many()]);
    b.model.nominal[1].1 = 4.0;
    assert_eq!(faults(&b.model), repeats("parabola", of(&["line"]), true, 1001));
}

#[test]
fn a_gradient_that_vanishes_on_the_manifold_is_found() {
    let (mut b, q) = particles(&["x", "y"]);
    let rod = circle(&mut b, q[0], q[1]);
    let square = b.mul(rod, rod);
    constrain(&mut b, "rod", HOLONOMIC, &[square]);
    let gone = [Fault::GradientVanishes { name: "rod".into(), origin: Origin(1000) }];
    assert_eq!(faults(&b.model), gone);
    b.nominal(0, 0.3);
    assert_eq!(faults(&b.model), gone);
    let (mut b, q) = particles(&["x", "y"]);
    let rod = circle(&mut b, q[0], q[1]);
    let distance = b.g().unary(Unary::Abs, rod);
    constrain(&mut b, "rod", HOLONOMIC, &[distance]);
    assert_eq!(faults(&b.model), gone, "it turns round");
}

#[test]
fn switched_constraints_may_exclude_each_other_but_not_what_always_holds() {
    let (mut b, q) = particles(&["x", "y"]);
    let (low, high) = (b.linear(&[1, 0], &q, 0), b.linear(&[1, 0], &q, -1));
    constrain(&mut b, "floor", HOLONOMIC, &[low]).switched = true;
    constrain(&mut b, "ceiling", HOLONOMIC, &[high]).switched = true;
    let analysis = sound(&b.model);
    assert_eq!((analysis.rank, analysis.redundant, analysis.rank_scope), (1, false, RankScope::Excluding));
    b.model.constraints[0].switched = false;
    let with = constant("floor");
    assert_eq!(faults(&b.model), [Fault::Contradicts { name: "ceiling".into(), with, origin: Origin(1001) }]);
}

/// ẋ sin ψ − ẏ cos ψ = 0 is the knife edge; ẋ − r φ̇ cos ψ = ẏ − r φ̇ sin ψ = 0 the upright disk.
fn disk() -> (Builder, Vec<NodeId>, Vec<NodeId>) {
    let (mut b, q) = particles(&["x", "y", "phi", "psi"]);
    let r = b.parameter("r");
    let v: Vec<NodeId> = q.iter().map(|x| b.dt(*x)).collect();
    let (s, c) = (b.sin(q[3]), b.cos(q[3]));
    let (rc, rs) = (b.mul(r, c), b.mul(r, s));
    let (fx, fy) = (b.mul(rc, v[2]), b.mul(rs, v[2]));
    let rows = vec![b.sub(v[0], fx), b.sub(v[1], fy)];
    (b, v, rows)
}

#[test]
fn rolling_is_not_integrable() {
    let (mut b, v, rows) = disk();
    constrain(&mut b, "roll", NONHOLONOMIC, &rows);
    assert_eq!(sound(&b.model).integrable, Some(0));
    b.model.constraints.clear();
    let psi = b.g().symbol(Symbol::Coordinate(3));
    let (s, c) = (b.sin(psi), b.cos(psi));
    let (xs, yc) = (b.mul(v[0], s), b.mul(v[1], c));
    let edge = b.sub(xs, yc);
    constrain(&mut b, "edge", NONHOLONOMIC, &[edge]);
    assert_eq!(sound(&b.model).integrable, Some(0));
    b.model.constraints[0].kind = ConstraintKind::Nonholonomic { integrable: true };
    assert_eq!(faults(&b.model), [Fault::IntegrableInVain { name: "edge".into(), origin: Origin(1000) }]);
}

#[test]
fn what_can_be_integrated_is_counted_and_named() {
    let (mut b, v, mut rows) = disk();
    let time = b.g().symbol(Symbol::Time);
    let (steady, geared) = (b.add(v[3], time), b.linear(&[0, 0, 2, 1], &v, 0));
    constrain(&mut b, "roll", NONHOLONOMIC, &rows);
    constrain(&mut b, "turn", NONHOLONOMIC, &[geared]);
    // φ = −ψ/2 + const: then ẋ and ẏ are functions of ψ times ψ̇, all three can be integrated.
    let integrable = |n: usize, names: &[&str], origin: u32| Fault::Integrable {
        integrable: n,
        of: 3,
        determined: false,
        names: names.iter().map(|n| (*n).to_owned()).collect(),
        origin: Origin(origin),
    };
    assert_eq!(faults(&b.model), [integrable(3, &["roll[0]", "roll[1]", "turn"], 1000)]);
    // One drive alone can: ψ = −t²/2 + const.
    b.model.constraints.pop();
    constrain(&mut b, "turn", NONHOLONOMIC, &[steady]);
    assert_eq!(faults(&b.model), [integrable(1, &["turn"], 1001)]);
    b.model.constraints[1].kind = ConstraintKind::Nonholonomic { integrable: true };
    assert_eq!(sound(&b.model).integrable, Some(1));
    // A sum hides it from the eye, not from the brackets.
    b.model.constraints.clear();
    rows[0] = b.add(rows[0], steady);
    rows.push(steady);
    constrain(&mut b, "roll", NONHOLONOMIC, &rows);
    assert!(matches!(&faults(&b.model)[..], [Fault::Integrable { integrable: 1, of: 3, .. }]));
    b.model.constraints[0].switched = true;
    assert_eq!(
        sound(&b.model).integrable,
        Some(1),
        "a constraint that is switched holds a velocity, not a place"
    );
}

/// √(x² + y²) and its gradient are opaque to fingerprints: the numeric rank has to see that the row is a
/// differential.
#[test]
fn roots_are_integrated_numerically() {
    let (mut b, q) = particles(&["x", "y", "z"]);
    let square = b.norm_squared(&q[..2]);
    let r = b.g().unary(Unary::Sqrt, square);
    let (rate, z) = (b.dt(r), b.dt(q[2]));
    let product = b.mul(r, z);
    let exact = b.sub(rate, product);
    constrain(&mut b, "spiral", NONHOLONOMIC, &[exact]);
    assert!(matches!(&faults(&b.model)[..], [Fault::Integrable { integrable: 1, of: 1, .. }]), "ln r − z");
    b.model.constraints.clear();
    let y = b.dt(q[1]);
    let twisted = b.sub(exact, y);
    constrain(&mut b, "screw", NONHOLONOMIC, &[twisted]);
    assert_eq!(sound(&b.model).integrable, Some(0));
}

/// On a fixed line the knife edge slides along a known curve.
#[test]
fn holonomic_constraints_take_part_in_integrability() {
    let (mut b, v, _) = disk();
    let [x, y, psi] = [0, 1, 3].map(|i| b.g().symbol(Symbol::Coordinate(i)));
    let (s, c) = (b.sin(psi), b.cos(psi));
    let (xs, yc) = (b.mul(v[0], s), b.mul(v[1], c));
    let edge = b.sub(xs, yc);
    let line = b.sub(psi, x);
    constrain(&mut b, "line", HOLONOMIC, &[line]);
    constrain(&mut b, "edge", NONHOLONOMIC, &[edge]);
    assert!(matches!(&faults(&b.model)[..], [Fault::Integrable { integrable: 1, of: 1, .. }]));
    let _ = y;
}

/// Wojtyra's criterion: a beam on three supports, held sideways as well. The forces of the supports are not
/// unique, the one sideways is; and of a constraint that repeats itself, the sum.
#[test]
fn unique_reactions_are_told_from_others() {
    let (mut b, q) = particles(&["x", "y", "theta"]);
    let supports: Vec<NodeId> = [-1, 0, 1].iter().map(|i| b.linear(&[0, 1, *i], &q, 0)).collect();
    constrain(&mut b, "side", HOLONOMIC, &[q[0]]);
    constrain(&mut b, "supports", HOLONOMIC, &supports).redundant = true;
    let analysis = sound(&b.model);
    assert_eq!((analysis.rank, analysis.not_unique), (3, vec![1, 2, 3]));
    assert_eq!(analysis.joint, [1]);
    b.model.constraints.clear();
    constrain(&mut b, "left", HOLONOMIC, &supports[..1]);
    constrain(&mut b, "rest", HOLONOMIC, &supports[1..]).redundant = true;
    assert_eq!(sound(&b.model).joint, [0usize; 0]);
}

/// exp(10 x) − 1 is steep away from its zero and sound there; (x − y)³ is not.
#[test]
fn steep_rows_are_told_from_those_without_a_gradient() {
    let (mut b, q) = particles(&["x", "y"]);
    let (tenfold, one) = (b.linear(&[10, 0], &q, 0), b.ratio(1, 1));
    let power = b.g().unary(Unary::Exp, tenfold);
    let steep = b.sub(power, one);
    constrain(&mut b, "steep", HOLONOMIC, &[steep]);
    sound(&b.model);
    let d = b.sub(q[0], q[1]);
    let square = b.mul(d, d);
    let cube = b.mul(square, d);
    constrain(&mut b, "cube", HOLONOMIC, &[cube]);
    assert_eq!(faults(&b.model), [Fault::GradientVanishes { name: "cube".into(), origin: Origin(1001) }]);
}

/// Three parallel cranks of equal length on one coupler: redundant while they stay parallel, rigid where one
/// is folded over. Without nominal values the lengths differ and nothing repeats.
#[test]
fn branches_on_which_rows_repeat_others_are_reported_and_may_be_marked() {
    let mut b = Builder::new("Parallel");
    let q: Vec<NodeId> = (0..4).map(|i| b.coordinate(&format!("angle[{i}]"))).collect();
    for c in &mut b.model.coordinates {
        c.unit = "rad".into();
    }
    let l = b.parameters("l", 3);
    let mut rows = Vec::new();
    let end = |b: &mut Builder, i: usize| {
        let (s, c) = (b.sin(q[i]), b.cos(q[i]));
        [b.mul(l[i], c), b.mul(l[i], s)]
    };
    let (s, c) = (b.sin(q[3]), b.cos(q[3]));
    let first = end(&mut b, 0);
    for (i, at) in [(1, 1), (2, 2)] {
        let own = end(&mut b, i);
        let along = b.ratio(at, 1);
        for (k, direction) in [c, s].into_iter().enumerate() {
            // First end + at·coupler − (own end + at·base).
            let arm = b.mul(along, direction);
            let sum = b.add(first[k], arm);
            let gap = b.sub(sum, own[k]);
            rows.push(if k == 0 { b.sub(gap, along) } else { gap });
        }
    }
    constrain(&mut b, "closure", HOLONOMIC, &rows);
    let general = sound(&b.model);
    assert_eq!((general.rank, general.rank_scope == RankScope::Nominal), (4, false));
    (0..3).for_each(|i| b.nominal(i, 0.7));
    let analysis = analyse(&b.model);
    assert_eq!((analysis.least.all, analysis.rank_scope), (3, RankScope::Nominal));
    b.model.constraints[0].redundant = true;
    let marked = sound(&b.model);
    assert_eq!((marked.least.all, marked.rank, marked.branch_meant, marked.redundant), (3, 4, true, true));
    let one = b.ratio(1, 1);
    let t = b.kinetic(one, &q);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    let report = compile(b.model).unwrap_or_else(|found| panic!("{found:?}")).report;
    let words = report.split_whitespace().collect::<Vec<_>>().join(" ");
    for said in [
        "degrees of freedom 1 where rows repeat others, 0 on other branches; 4 coordinates, 3 of 4 rows of \
         constraints independent",
        "repeats others on some branches",
        "solved by the general rank-revealing solver, at run time: rows repeat others",
    ] {
        assert!(words.contains(said), "{said}\n{report}");
    }
    assert!(!words.contains("hold it still"), "{report}");
}

/// A car with n trailers: axles that do not slip, hitched at their middles. Its growth vector is the longest
/// there is, so that brackets of brackets up to the depth n + 2 are needed to see that nothing can be
/// integrated.
#[test]
fn trailers_need_deep_brackets() {
    for trailers in 0..=3 {
        let mut names = vec!["x".to_owned(), "y".to_owned()];
        names.extend((0..=trailers).map(|i| format!("theta[{i}]")));
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (mut b, q) = particles(&names);
        let mut place = [q[0], q[1]];
        let rows: Vec<NodeId> = (0..=trailers)
            .map(|i| {
                let (s, c) = (b.sin(q[2 + i]), b.cos(q[2 + i]));
                if i > 0 {
                    place = [b.sub(place[0], c), b.sub(place[1], s)];
                }
                let (u, v) = (b.dt(place[0]), b.dt(place[1]));
                let (us, vc) = (b.mul(u, s), b.mul(v, c));
                b.sub(us, vc)
            })
            .collect();
        constrain(&mut b, "axles", NONHOLONOMIC, &rows);
        assert_eq!(sound(&b.model).integrable, Some(0), "{trailers} trailers");
    }
}

/// A ball that rolls on a plane, in Euler angles ψ, θ, φ: two rows on five coordinates.
#[test]
fn a_rolling_ball_is_not_integrable_and_neither_is_one_that_does_not_spin() {
    let (mut b, q) = particles(&["x", "y", "psi", "theta", "phi"]);
    let v: Vec<NodeId> = q.iter().map(|x| b.dt(*x)).collect();
    let (sp, cp, st, ct) = (b.sin(q[2]), b.cos(q[2]), b.sin(q[3]), b.cos(q[3]));
    // ω = (θ̇ cos ψ + φ̇ sin ψ sin θ, θ̇ sin ψ − φ̇ cos ψ sin θ, ψ̇ + φ̇ cos θ).
    let spin = b.mul(v[4], st);
    let (a, c) = (b.mul(v[3], cp), b.mul(spin, sp));
    let wx = b.add(a, c);
    let (a, c) = (b.mul(v[3], sp), b.mul(spin, cp));
    let wy = b.sub(a, c);
    let turned = b.mul(v[4], ct);
    let wz = b.add(v[2], turned);
    let rows = [b.sub(v[0], wy), b.add(v[1], wx)];
    constrain(&mut b, "roll", NONHOLONOMIC, &rows);
    assert_eq!(sound(&b.model).integrable, Some(0));
    constrain(&mut b, "no_spin", NONHOLONOMIC, &[wz]);
    assert_eq!(sound(&b.model).integrable, Some(0));
}
