//! Sets of constraints that degenerate where they hold, beside ranks at states that are known in closed form.

use crate::common;

use common::Builder;
use common::constrained::{HOLONOMIC, constrain, particles};
use dynamics_symbolic::check::Finding;
use dynamics_symbolic::check::constraints::{Combination, ConstraintFinding as Fault, RankScope, analyse};
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::graph::{NodeId, Origin};
use dynamics_symbolic::mechanics::Solution;

/// Beads in a plane, as x[0], y[0], x[1], .., the first one pinned.
fn beads(n: usize) -> (Builder, Vec<[NodeId; 2]>) {
    let names: Vec<String> = (0..n).flat_map(|i| [format!("x[{i}]"), format!("y[{i}]")]).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let (mut b, q) = particles(&names);
    let places: Vec<[NodeId; 2]> = q.chunks(2).map(|c| [c[0], c[1]]).collect();
    constrain(&mut b, "pin", HOLONOMIC, &places[0]);
    (b, places)
}

/// |a − b|² − (n l)².
fn rod(b: &mut Builder, ends: [[NodeId; 2]; 2], n: i128) -> NodeId {
    let l = b.model.graph.symbol(dynamics_symbolic::graph::Symbol::Parameter(0));
    let (dx, dy) = (b.sub(ends[0][0], ends[1][0]), b.sub(ends[0][1], ends[1][1]));
    let square = b.norm_squared(&[dx, dy]);
    let n = b.ratio(n, 1);
    let nl = b.mul(n, l);
    let right = b.mul(nl, nl);
    b.sub(square, right)
}

/// Beads on one line, a rod between any two of them.
fn in_line(n: usize, nominal: bool) -> Builder {
    let (mut b, places) = beads(n);
    b.parameter("l");
    if nominal {
        b.nominal(0, 0.5);
    }
    let pairs = |far: usize| (0..n - far).map(move |i| (i, i + far));
    let rods = |b: &mut Builder, far: usize| -> Vec<NodeId> {
        pairs(far).map(|(i, j)| rod(b, [places[i], places[j]], far as i128)).collect()
    };
    let near = rods(&mut b, 1);
    constrain(&mut b, "near", HOLONOMIC, &near);
    let far: Vec<NodeId> = (2..n).flat_map(|k| rods(&mut b, k)).collect();
    constrain(&mut b, "far", HOLONOMIC, &far);
    b
}

fn words(report: &str) -> String {
    report.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Newton's method comes to within 1e-6 of the line, where the rods still look independent.
#[test]
fn rods_on_one_line_are_tangent() {
    for nominal in [false, true] {
        for n in 3..=5 {
            let mut b = in_line(n, nominal);
            let far = (n - 1) * (n - 2) / 2;
            let found = analyse(&b.model).findings;
            assert_eq!(found.len(), far, "{found:?}");
            for finding in &found {
                let Finding::Constraint(Fault::Tangent { name, origin, .. }) = finding else {
                    panic!("{finding:?}")
                };
                assert!(name.starts_with("far") && *origin == Origin(1002), "{finding:?}");
            }
            b.model.constraints[2].redundant = true;
            let analysis = analyse(&b.model);
            assert_eq!(analysis.findings, []);
            // On the line all rods have one direction: as many as beads less one are independent, beside the
            // pin.
            let rank = 2 + n - 1;
            assert_eq!((analysis.rank, analysis.least.all, analysis.rows), (rank, rank, 2 + n - 1 + far));
            let rods: Vec<usize> = (2..analysis.rows).collect();
            let tangent: Vec<usize> = (n + 1..analysis.rows).collect();
            assert_eq!((&analysis.not_unique, &analysis.tangent), (&rods, &tangent));
            // It turns about the pin: one freedom in positions, whatever velocities may be.
            assert_eq!((analysis.holonomic_rank, analysis.least.holonomic), (2 * n - 1, 2 * n - 1));
            for s in &analysis.samples {
                let l = s.parameters[0];
                for i in 1..n {
                    let (x, y) = (s.q[2 * i], s.q[2 * i + 1]);
                    let (x1, y1) = (s.q[2], s.q[3]);
                    assert!(
                        (x.hypot(y) - i as f64 * l).abs() < 1e-12 && (x * y1 - y * x1).abs() < 1e-12,
                        "{s:?}"
                    );
                }
            }
            let report = words(&compile(b.model).unwrap_or_else(|found| panic!("{found:?}")).report);
            let freedom = format!(
                "degrees of freedom {} in velocities, 1 in positions; {} coordinates, {rank} of",
                n - 1,
                2 * n
            );
            for said in
                [&freedom, "reactions unique: pin; not unique, the smallest are given: near, far", "far: "]
            {
                assert!(report.contains(said), "{said}\n{report}");
            }
            assert!(!report.contains("branches"), "{report}");
        }
    }
}

/// A bead between two fixed ends on a string of their distance: no reaction holds it across, those of the
/// ends along the string are shared.
#[test]
fn a_bead_on_a_tight_string_is_held_to_second_order() {
    let (mut b, places) = beads(3);
    let l = b.parameter("l");
    let two = b.ratio(2, 1);
    let whole = b.mul(two, l);
    let end = b.sub(places[2][0], whole);
    constrain(&mut b, "end", HOLONOMIC, &[end, places[2][1]]);
    let string = [[0, 1], [1, 2]].map(|[i, j]| rod(&mut b, [places[i], places[j]], 1));
    constrain(&mut b, "string", HOLONOMIC, &string).redundant = true;
    let analysis = analyse(&b.model);
    assert_eq!(analysis.findings, []);
    // Sideways the ends are pinned beside the string: pin[1] and end[1].
    assert_eq!((analysis.rank, analysis.least.all, analysis.not_unique), (5, 5, vec![0, 2, 4, 5]));
    assert_eq!((analysis.least.holonomic, analysis.tangent), (6, vec![5]));
    for s in &analysis.samples {
        assert!((s.q[2] - s.parameters[0]).abs() < 1e-13 && s.q[3].abs() < 1e-13, "{s:?}");
    }
}

/// A line touches the circle: where a bead is held by both it may move along, to first order.
#[test]
fn a_tangent_line_is_told_from_one_that_crosses() {
    let (mut b, q) = particles(&["x", "y", "z"]);
    let (l, h) = (b.parameter("l"), b.parameter("h"));
    let square = b.norm_squared(&q[..2]);
    let ll = b.mul(l, l);
    let circle = b.sub(square, ll);
    let line = b.sub(q[1], h);
    constrain(&mut b, "circle", HOLONOMIC, &[circle]);
    constrain(&mut b, "line", HOLONOMIC, &[line]);
    b.nominal(0, 2.0);
    b.nominal(1, 2.0);
    let to = Combination::Of(vec!["circle".into()]);
    let tangent = Fault::Tangent { name: "line".into(), to, origin: Origin(1001) };
    assert_eq!(analyse(&b.model).findings, [Finding::Constraint(tangent)]);
    // It is near to touch, and does not.
    for below in [1e-3, 1e-6, 1e-9] {
        b.model.nominal[1].1 = 2.0 * (1.0 - below);
        let analysis = analyse(&b.model);
        assert_eq!((analysis.rank, analysis.least.all, analysis.tangent.len()), (2, 2, 0), "{below}");
        assert_eq!(analysis.findings, []);
    }
}

/// A slider that is drawn in from its dead point: tangent at t = 0, where motions start, and at no other
/// time.
#[test]
fn a_dead_point_at_the_start_is_one_at_that_time() {
    let mut b = Builder::new("Drawn");
    let q: Vec<NodeId> = ["theta", "phi", "x"].iter().map(|name| b.coordinate(name)).collect();
    for c in &mut b.model.coordinates[..2] {
        c.unit = "rad".into();
    }
    let [crank, rod, speed] = ["crank", "rod", "speed"].map(|name| b.parameter(name));
    (0..3).for_each(|i| b.nominal(i, [0.1, 0.3, 0.05][i as usize]));
    let (s, c, sp, cp) = (b.sin(q[0]), b.cos(q[0]), b.sin(q[1]), b.cos(q[1]));
    let polar = |b: &mut Builder, length, s, c| (b.mul(length, c), b.mul(length, s));
    let ((px, py), (rx, ry)) = (polar(&mut b, crank, s, c), polar(&mut b, rod, sp, cp));
    let (along, up) = (b.add(px, rx), b.sub(py, ry));
    let gap = b.sub(along, q[2]);
    constrain(&mut b, "closure", HOLONOMIC, &[gap, up]);
    let time = b.g().symbol(dynamics_symbolic::graph::Symbol::Time);
    let (out, way) = (b.add(crank, rod), b.mul(speed, time));
    let place = b.sub(out, way);
    let drive = b.sub(q[2], place);
    constrain(&mut b, "drive", HOLONOMIC, &[drive]);
    let analysis = analyse(&b.model);
    assert_eq!((&analysis.findings[..], analysis.rank, analysis.least.all), (&[][..], 3, 2));
    let one = b.ratio(1, 1);
    let t = b.kinetic(one, &q);
    b.energy("kinetic", dynamics_symbolic::mechanics::EnergyRole::Kinetic, t);
    let report = words(&compile(b.model).unwrap_or_else(|found| panic!("{found:?}")).report);
    for said in [
        "degrees of freedom 0, but 1 in velocities at some times or on some branches; 3 coordinates, 2 of 3 \
         rows",
        "reactions all unique where all rows are independent; elsewhere unique: closure[1]; not unique, the \
         smallest are given: closure[0], drive",
        "drive: holonomic, moving degrees",
        "solved by generated code",
    ] {
        assert!(report.contains(said), "{said}\n{report}");
    }
}

/// A follower that rests on its stop until the cam takes it over: where both hold, cam and stop touch, and
/// neither time are both meant.
fn cam_and_stop() -> Builder {
    let mut b = Builder::new("Cam");
    let (theta, y) = (b.coordinate("theta"), b.coordinate("y"));
    b.model.coordinates[0].unit = "rad".into();
    let l = b.parameter("l");
    b.nominal(0, 0.3);
    let one = b.ratio(1, 1);
    let t = b.kinetic(one, &[theta, y]);
    b.energy("kinetic", dynamics_symbolic::mechanics::EnergyRole::Kinetic, t);
    let c = b.cos(theta);
    let lift = b.mul(l, c);
    let (on_cam, on_stop) = (b.sub(y, lift), b.sub(y, l));
    constrain(&mut b, "cam", HOLONOMIC, &[on_cam]).switched = true;
    constrain(&mut b, "stop", HOLONOMIC, &[on_stop]).switched = true;
    b
}

#[test]
fn switched_rows_that_take_over_from_each_other_are_no_finding() {
    let analysis = analyse(&cam_and_stop().model);
    assert_eq!(
        (&analysis.findings[..], &analysis.tangent[..], analysis.redundant),
        (&[][..], &[][..], false)
    );
    assert_eq!((analysis.rank, analysis.least.all, analysis.rank_scope), (2, 2, RankScope::Touching));
    let compiled = compile(cam_and_stop().model).unwrap_or_else(|found| panic!("{found:?}"));
    let derived = compiled.equations.constraints.expect("constraints");
    assert!(matches!(derived.solution, Solution::Unrolled(_)), "{:?}", derived.solution);
    assert_eq!((derived.released.len(), compiled.programs.jacobians.is_ok()), (3, true));
    assert!(compiled.programs.series.is_ok());
    for said in [
        "2 independent rows of constraints in general; where all hold at once switched ones touch each \
         other, and only there",
        "reactions all unique, but where all constraints hold at once",
        "code of its own for each of the 3 sets of switched constraints that may be released",
    ] {
        assert!(words(&compiled.report).contains(said), "{said}\n{}", compiled.report);
    }
    // One that is always on is on together with the other.
    let mut b = cam_and_stop();
    b.model.constraints[0].switched = false;
    let to = Combination::Constant("cam".into());
    let tangent = Fault::Tangent { name: "stop".into(), to, origin: Origin(1001) };
    assert_eq!(analyse(&b.model).findings, [Finding::Constraint(tangent)]);
}

/// Two end stops exclude each other: code for each of them, and for none.
#[test]
fn end_stops_have_code_of_their_own() {
    let (mut b, q) = particles(&["x", "y"]);
    let l = b.parameter("l");
    let square = b.mul(q[0], q[1]);
    b.energy("spring", dynamics_symbolic::mechanics::EnergyRole::Potential, square);
    let (right, left) = (b.sub(q[0], l), b.add(q[0], l));
    constrain(&mut b, "right", HOLONOMIC, &[right]).switched = true;
    constrain(&mut b, "left", HOLONOMIC, &[left]).switched = true;
    let compiled = compile(b.model).unwrap_or_else(|found| panic!("{found:?}"));
    let derived = compiled.equations.constraints.expect("constraints");
    let modes: Vec<&[usize]> = derived.released.iter().map(|r| &r.modes[..]).collect();
    assert_eq!(modes, [&[0, 1][..], &[0], &[1]]);
    for said in [
        "left: holonomic, fixed, switched on and off, excludes others",
        "1 of 2 rows of constraints independent in general; switched ones exclude each other",
        "code of its own for each of the 3 sets",
    ] {
        assert!(words(&compiled.report).contains(said), "{said}\n{}", compiled.report);
    }
}
