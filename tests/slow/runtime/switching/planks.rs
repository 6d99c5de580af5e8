//! Planks on two points or three: impacts of several contacts at once, rocking, reactions that are not
//! unique.

use super::*;

/// A plank of mass m and moment of inertia j over a floor that it touches at x = −a, 0 and a, under a torque
/// −m g a t.
struct Plank<const R: usize> {
    j: f64,
    load: f64,
}

const ENDS: [f64; 3] = [-1.0, 1.0, 0.0];

impl<const R: usize> Held<2, R, R> for Plank<R> {
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::from_diagonal(&SVector::from([1.0, self.j]))
    }
    fn force(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::from([-9.81, -self.load * s.t])
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        0.5 * (s.u[0] * s.u[0] + self.j * s.u[1] * s.u[1]) + 9.81 * s.q[0]
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, R> {
        SVector::from_fn(|row, _| s.q[0] + ENDS[row] * s.q[1].sin())
    }
    fn phi_q(&self, s: &PlainState<2, 0>) -> SMatrix<f64, R, 2> {
        SMatrix::from_fn(|row, j| if j == 0 { 1.0 } else { ENDS[row] * s.q[1].cos() })
    }
    fn right(&self, s: &PlainState<2, 0>) -> SVector<f64, R> {
        SVector::from_fn(|row, _| ENDS[row] * s.q[1].sin() * s.u[1] * s.u[1])
    }
}
type TwoEnds = Plank<2>;
type ThreePoints = Plank<3>;
held!(TwoEnds, 2 coordinates ["y", "theta"], 2 + 0 = 2 rows ["left", "right"],
    [switched("left", ConstraintKind::Holonomic, 0, 0), switched("right", ConstraintKind::Holonomic, 1, 1)],
    friction false, events []);
held!(ThreePoints, 2 coordinates ["y", "theta"], 3 + 0 = 3 rows ["left", "right", "middle"],
    [switched("left", ConstraintKind::Holonomic, 0, 0), switched("right", ConstraintKind::Holonomic, 1, 1),
        switched("middle", ConstraintKind::Holonomic, 2, 2)],
    friction false, events []);

/// Rocking on its left end it hits with the right one at the rate w. With j > m a² the left end parts: Λ = 2
/// a w/(1/m + a²/j), and no impulse pulls at it; with j < m a² it presses, Λ = (1 − j/m a²) m a w/2, and all
/// energy is lost.
#[test]
fn an_end_that_rests_pushes_in_an_impact_and_does_not_pull() {
    for (j, parts) in [(4.0, true), (0.3, false)] {
        let plank = TwoEnds { j, load: 0.0 };
        let tilt: f64 = 0.2;
        let start = released(at_rest_or_not([tilt.sin(), tilt], [0.0, 0.0]), [1]);
        let w = (2.0 * 9.81 * tilt.sin() / (1.0 + j)).sqrt();
        for formulation in [Formulation::Projected, Formulation::BaumgarteTied] {
            let run = plank.simulate(start).until(1.0).tolerance(1e-11).formulation(formulation);
            let motion = run.contact("left", 0.0).contact("right", 0.0).run().unwrap();
            let event = &motion.events()[0];
            assert_eq!((event.name.as_str(), event.before.active_set.holds(0)), ("right contact", true));
            assert!((event.before.u[1] + w).abs() < 1e-8);
            let impulse = |name| {
                event.impacts.iter().find(|hit| hit.constraint == name).map(|hit| (hit.held, hit.impulse[0]))
            };
            let (hit, lost) = (impulse("right").unwrap(), event.energy_lost());
            assert!(!hit.0);
            if parts {
                let expected = 2.0 * w / (1.0 + 1.0 / j);
                assert!(impulse("left").is_none() && (hit.1 - expected).abs() < 1e-8, "{event:?}");
                assert!(
                    (event.after.u[0] - 0.6 * w).abs() < 1e-8 && (event.after.u[1] + 0.6 * w).abs() < 1e-8
                );
                assert!(
                    !event.after.active_set.holds(0)
                        && event.after.active_set.holds(1)
                        && (lost - expected * w).abs() < 1e-8
                );
            } else {
                let left = impulse("left").unwrap();
                assert!(left.0 && (left.1 - 0.5 * (1.0 - j) * w).abs() < 1e-8, "{event:?}");
                assert!((hit.1 - 0.5 * (1.0 + j) * w).abs() < 1e-8 && event.after.active_set.all_hold());
                assert!((lost - 0.5 * (1.0 + j) * w * w).abs() < 1e-8 && motion.end().u.amax() < 1e-9);
            }
            assert_eq!(
                motion.summary().impacts,
                motion.events().iter().filter(|event| !event.impacts.is_empty()).count()
            );
        }
    }
}

/// It rocks from end to end, each time at three fifths of the rate, and is at rest after rates below a
/// thousandth of the first.
#[test]
fn a_plank_that_rocks_comes_to_rest() {
    let plank = TwoEnds { j: 4.0, load: 0.0 };
    let tilt: f64 = 0.2;
    let start = released(at_rest_or_not([tilt.sin(), tilt], [0.0, 0.0]), [1]);
    let run = plank.simulate(start).until(4.0).tolerance(1e-10);
    let motion = run.contact("left", 0.0).contact("right", 0.0).run().unwrap();
    let rates: Vec<f64> = motion.events().iter().map(|event| event.before.u[1].abs()).collect();
    // 0.6ⁿ ≤ 1e-3 first for n = 14 against the right end's first rate, n = 15 against the left one's, which
    // was 0.6 of that.
    assert!(rates.len() == 15, "{rates:?}");
    assert!(rates.windows(2).all(|pair| (pair[1] / pair[0] - 0.6).abs() < 1e-5), "{rates:?}");
    let end = motion.end();
    assert!(end.active_set.all_hold() && end.q.amax() < 1e-12 && end.u.amax() < 1e-12, "{end:?}");
    assert!((motion.summary().energy_lost - 9.81 * tilt.sin()).abs() < 1e-8);
}

/// Starts on one end or in flight, tilted by much or by no more than rounding, with every kind of rebound:
/// hops of single ends accumulate while the other one falls, and rocking dies away. Each run goes on to its
/// end, no end sinks into the floor, and the account of energy closes.
#[test]
fn planks_come_to_rest_from_every_start() {
    let mut rest = 0;
    for (j, e, tilt, drop) in plank_starts() {
        let (plank, case) = (TwoEnds { j, load: 0.0 }, format!("j = {j}, e = {e}, tilt {tilt}, drop {drop}"));
        let off: &[usize] = if drop > 0.0 { &[0, 1] } else { &[1] };
        let start = released(at_rest_or_not([tilt.sin() + drop, tilt], [0.0, 0.0]), off.iter().copied());
        let run = plank.simulate(start).until(6.0).consistent_output().contact("left", e).contact("right", e);
        let motion = run.run().unwrap_or_else(|error| panic!("{case}: {error}"));
        for k in 0..=40 {
            let q = motion.at(0.15 * f64::from(k)).q;
            assert!(q[0] - q[1].sin().abs() > -1e-8, "{case}: {q:?}");
        }
        let (end, lost) = (motion.end(), motion.summary().energy_lost);
        assert!((plank.energy(&end) + lost - plank.energy(&start)).abs() < 1e-6, "{case}: {lost}");
        if end.active_set.all_hold() {
            assert!(end.q.amax() < 1e-12 && end.u.amax() < 1e-12, "{case}: {end:?}");
            rest += 1;
        }
        assert!(end.active_set.all_hold() || plank.energy(&end) < 0.1, "{case}: {end:?}");
    }
    assert!(rest > 70, "{rest}");
}

fn plank_starts() -> Vec<(f64, f64, f64, f64)> {
    let mut starts = vec![
        (1.7, 0.6, 0.7e-15, 0.0),
        (2.5, 0.45, 0.7e-15, 0.0),
        (0.61, 0.45, 0.1, 1e-10),
        (0.37, 0.9, 0.5, 1e-10),
    ];
    for j in [0.3, 1.0, 1.1, 4.0] {
        for e in [0.0, 0.3, 0.8] {
            for tilt in [0.2, 1e-9, 1e-15] {
                starts.extend([(j, e, tilt, 0.0), (j, e, tilt, 0.7)]);
            }
        }
    }
    starts
}

/// Dropped level it hits with both ends at once and rises level: one impact, in which each end takes half,
/// whatever j.
#[test]
fn ends_that_hit_together_rebound_together() {
    for (j, e) in [(4.0, 0.0), (4.0, 0.5), (4.0, 1.0), (0.3, 0.0), (0.3, 0.5), (0.3, 1.0)] {
        let plank = TwoEnds { j, load: 0.0 };
        let start = released(at_rest_or_not([1.0, 0.0], [0.0, 0.0]), [0, 1]);
        let motion =
            plank.simulate(start).until(3.0).tolerance(1e-11).contact("left", e).contact("right", e).run();
        let motion = motion.unwrap_or_else(|error| panic!("{j} {e}: {error}"));
        let [first, second] = &motion.events()[..2] else { panic!("two events") };
        let v = (2.0f64 * 9.81).sqrt();
        assert!((first.time() - v / 9.81).abs() < 1e-9 && first.time() == second.time());
        let impulses: Vec<_> =
            first.impacts.iter().map(|hit| (hit.constraint, hit.held, hit.impulse[0])).collect();
        assert_eq!((impulses.len(), second.impacts.len()), (2, 0), "{first:?}");
        assert!(
            impulses.iter().all(|(_, held, impulse)| !held && (impulse - 0.5 * (1.0 + e) * v).abs() < 1e-8)
        );
        assert!((second.after.u[0] - e * v).abs() < 1e-8 && second.after.u[1].abs() < 1e-12, "{second:?}");
        assert!((first.energy_lost() - 0.5 * v * v * (1.0 - e * e)).abs() < 1e-7);
        let end = motion.end();
        assert!(end.q[1].abs() < 1e-9 && motion.verify().energy_drift < 1e-8, "{end:?}");
        if e < 1.0 {
            assert!(end.active_set.all_hold() && end.q[0].abs() < 1e-14 && end.u.amax() < 1e-12, "{end:?}");
        } else {
            assert!((plank.energy(&end) - 9.81).abs() < 1e-7);
        }
    }
}

/// Three points that bear a plank: which of them lifts off is not for the reactions of least norm to say. The
/// left one would at t = 2/3 by those; without the middle one it does at t = 1.
#[test]
fn reactions_that_are_not_unique_let_no_contact_lift_off() {
    let plank = ThreePoints { j: 4.0, load: 9.81 };
    let run = |until| {
        let run = plank.simulate(at_rest_or_not([0.0, 0.0], [0.0, 0.0])).until(until);
        run.contact("left", 0.0).contact("right", 0.0).contact("middle", 0.0).run()
    };
    assert!(run(0.6).unwrap().events().is_empty());
    let error = run(0.95).unwrap_err();
    let kind = SimulationErrorKind::Solve(SolveError::ReactionNotUnique { row: "left" });
    assert_eq!(error.kind, kind, "{error}");
    assert!(error.time <= 2.0 / 3.0);
    let plank = TwoEnds { j: 4.0, load: 9.81 };
    let run = plank.simulate(at_rest_or_not([0.0, 0.0], [0.0, 0.0])).until(1.01);
    let motion = run.contact("left", 0.0).contact("right", 0.0).run().unwrap();
    assert!((motion.events()[0].time() - 1.0).abs() < 1e-8 && motion.events()[0].name == "left contact");
}
