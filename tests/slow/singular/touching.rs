//! Constraints of one row whose branches cross, touch or end: a motion that goes on does so along its own
//! branch, whatever the formulation, the method and the tolerance, and says so where it cannot.
//!
//! Each curve is run by its row against the same motion by a parameter of the branch alone, which knows of no
//! other branch.

mod closures;
mod curves;
mod elsewhere;
use crate::neutral;

use curves::*;
use dynamics::methods::Any;
use dynamics::prelude::*;
use dynamics::simulate::SimulationErrorKind as Kind;

fn methods<M: Simulate>() -> [Any<M>; 4] {
    [
        methods::Dop853.into(),
        methods::Verner9.into(),
        methods::Taylor::default().into(),
        methods::Radau5.into(),
    ]
}

const EXACT: [Formulation; 2] = [Formulation::Projected, Formulation::Embedded];
const DRIFTING: [Formulation; 3] =
    [Formulation::Augmented, Formulation::BaumgarteTied, Formulation::Baumgarte { alpha: 10.0, beta: 10.0 }];
const STARTS: u32 = 4;

/// Turned, moved, of another mass, with and without weight.
fn scene(k: u32) -> Scene {
    let k = f64::from(k);
    let turn = 0.7 + 0.61 * k;
    let weight = if k % 3.0 == 0.0 { 0.0 } else { 0.4 };
    let along = if k % 5.0 == 0.0 { [1.0, 0.0] } else { [turn.cos(), turn.sin()] };
    let place = [0.3 * (1.7 * k).sin(), 0.4 * (0.9 + 2.3 * k).cos()];
    Scene { mass: 0.5 + 0.03 * k, pull: [0.3 * weight, -0.8 * weight], place, along }
}

/// Runs of a curve that ended right, and that were refused.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    right: usize,
    refused: usize,
}

/// Runs it from parameters in a range. What ends wrong without a word fails.
fn tally<C: Curve>((from, to): (f64, f64), rate: f64, end: f64, formulations: &[Formulation]) -> Tally {
    let mut tally = Tally::default();
    for k in 0..STARTS {
        let scene = scene(k);
        let model = C::bead(&scene);
        let part = |by: f64| (f64::from(k) * by).fract();
        let at = (from + (to - from) * part(0.618), rate * (0.8 + 0.4 * part(0.37)));
        let (truth, start) = (scene.out(C::truth(&scene, at, end)), C::start(&model, &scene, at));
        for formulation in formulations {
            for method in methods() {
                for tolerance in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
                    let run = model.simulate(start).until(end).method(&method).formulation(*formulation);
                    let case = format!("{k} {formulation} {method} {tolerance:e}");
                    match run.tolerance(tolerance).max_steps(3000).run() {
                        Ok(motion) => {
                            let off =
                                (0..2).map(|i| (motion.end().q()[i] - truth[i]).abs()).fold(0.0, f64::max);
                            let told = motion.verify().to_string().contains("\n  warning ");
                            assert!(off < 1e3 * tolerance.powf(0.8) + 1e-6 || told, "{case}: {off:e}");
                            tally.right += usize::from(off < 1e-2);
                        }
                        Err(error) => {
                            tally.refused += 1;
                            assert!(!error.kind.to_string().contains("contradict"), "{case}: {error}");
                        }
                    }
                }
            }
        }
    }
    println!("{tally:?}");
    tally
}

/// What is the least number of runs that end right, of 160; those of drifting formulations are refused as a
/// rule.
macro_rules! stays_on_its_branch {
    ($($name:ident, $curve:ty, $span:expr, $rate:literal, $end:literal, $least:literal;)*) => {$(
        #[test]
        fn $name() {
            let Tally { right, refused } = tally::<$curve>($span, $rate, $end, &EXACT);
            assert!(right >= $least && right + refused >= 155, "{right} right, {refused} refused");
            tally::<$curve>($span, $rate, $end, &DRIFTING);
        }
    )*};
}

stays_on_its_branch! {
    tacnode, curves::tacnode::At, (-0.9, -0.4), 1.0, 2.0, 120;
    circles_from_inside, curves::inside::At, (-0.9, -0.4), 1.0, 2.0, 105;
    circles_from_outside, curves::outside::At, (-0.9, -0.4), 1.0, 2.0, 105;
    sixth_power, curves::osculating::At, (-0.9, -0.4), 1.0, 2.0, 80;
    rose, curves::rose::At, (-0.7, -0.3), 0.7, 2.0, 45;
    trifolium, curves::trifolium::At, (0.1, 0.3), 0.5, 2.0, 120;
    // These cross.
    lemniscate, curves::lemniscate::At, (0.8, 1.2), 1.0, 1.5, 155;
    folium, curves::node::At, (-1.3, -1.1), 0.8, 1.0, 155;
    acute, curves::acute::At, (-0.9, -0.4), 1.0, 2.0, 130;
}

/// The motion up to there is right, and the error names place, row and what to do.
#[test]
fn what_touches_is_named_and_the_motion_before_it_is_right() {
    let (mut changed_over, mut named) = (0, 0);
    for k in 0..2 * STARTS {
        let scene = scene(k);
        let model = curves::osculating::At::bead(&scene);
        let at = (-0.6, 1.0);
        let start = curves::osculating::At::start(&model, &scene, at);
        let Err(error) = model.simulate(start).until(2.0).tolerance(1e-10).run() else { continue };
        let Kind::BranchesTouch { rows, at: time, changed } = error.kind else { panic!("{error}") };
        let message = error.to_string();
        assert!(
            rows.contains("way") && message.contains("`way` touch at t = ") && message.contains("by itself"),
            "{message}"
        );
        (named, changed_over) = (named + 1, changed_over + usize::from(changed));
        // Where its parameter, x, is 0.
        let truth = scene.out(curves::osculating::At::truth(&scene, at, time));
        assert!((0..2).all(|i| (truth[i] - scene.place[i]).abs() < 0.03), "{message}");
        let motion = error.motion(&model).unwrap();
        assert!(motion.end_time() <= time && motion.end_time() > time - 0.2, "{message}");
        for state in motion.steps().skip(1) {
            let known = scene.out(curves::osculating::At::truth(&scene, at, state.t()));
            assert!((0..2).all(|i| (known[i] - state.q()[i]).abs() < 1e-8), "{state:?}");
        }
    }
    assert!(named >= 4 && changed_over >= 1, "{named} {changed_over}");
}
