//! Fixed steps over change points. No tolerance judges them: a stage that lay beside such a position threw
//! the end of its step along the branch, by up to percents of the velocity, and the motion ended up to 0.35
//! rad off as a success.

use dynamics::model::Model;
use dynamics::prelude::*;
use dynamics::simulate::Motion;

use super::change_points::{FourBar, Neutral, turned};

const END: f64 = 20.0;

/// A neutral four-bar on one of its branches, with its motion by the crank alone.
pub(super) struct Scene {
    pub(super) model: FourBar,
    pub(super) start: State<FourBar>,
    pub(super) crank: f64,
    pub(super) rocker: f64,
}

fn scene(weight: f64, side: f64, at: (f64, f64)) -> Scene {
    scene_until(END, weight, side, at)
}

pub(super) fn scene_until(end: f64, weight: f64, side: f64, (angle, rate): (f64, f64)) -> Scene {
    let (a, b, c, d, inertia) = (0.3, 0.9, 0.5, 0.7, [1.0, 0.3, 1.4]);
    let branch = Neutral { inertia, a, b, c, d, weight, side };
    let place = |state: &State<Neutral>| {
        let q = <Neutral as Model>::coordinates_with(state, &Default::default(), &[]);
        [branch.coupler(&q).value(), branch.rocker(&q).value()]
    };
    let alone = branch.state().crank(angle).crank_rate(rate).build().unwrap();
    let truth = branch.simulate(alone).until(end).tolerance(1e-13).run().unwrap().end();
    let [coupler, rocker] = place(&alone);
    let model = FourBar { inertia, a, b, c, d, weight };
    let start = model.state().crank(angle).coupler_guess(coupler).rocker_guess(rocker).crank_rate(rate);
    Scene { start: start.assemble().unwrap(), model, crank: truth.crank(), rocker: place(&truth)[1] }
}

/// Per run: how it is called, and how far it ends off with whether it warns; or why it cannot go on.
type Runs = Vec<(String, Result<(f64, bool), String>)>;

fn explicit() -> [methods::Any<FourBar>; 3] {
    [methods::Rk4.into(), methods::DormandPrince5.into(), methods::Dop853.into()]
}

/// Runs it by some methods with steps of several lengths.
fn runs(formulation: Formulation, methods: &[methods::Any<FourBar>]) -> Runs {
    let scenes =
        [(0.0, 1.0, (1.0, 2.0)), (1.0, 1.0, (1.0, 4.0)), (0.0, -1.0, (0.7, -1.2)), (1.0, -1.0, (0.7, -2.4))];
    let mut runs = Vec::new();
    for (weight, side, at) in scenes {
        let scene = scene(weight, side, at);
        for h in [12, 21, 29, 32, 36].map(|k| 0.004 * 1.06_f64.powi(k)) {
            let run = || scene.model.simulate(scene.start).until(END).fixed_step(h).formulation(formulation);
            let judge = |motion: Motion<'_, FourBar>| {
                let end = motion.end();
                let off = (end.crank() - scene.crank).abs().max(turned(end.rocker(), scene.rocker));
                (off, motion.verify().to_string().contains("\n  warning "))
            };
            for method in methods {
                let outcome = run().method(method).run();
                runs.push((
                    format!("{weight} {side} {at:?} {} {h:.5}", method.method()),
                    outcome.map(judge).map_err(|e| e.to_string()),
                ));
            }
        }
    }
    runs
}

/// Steps that such a position would throw are made in parts, whose stages lie elsewhere.
#[test]
fn projected_and_embedded_fixed_steps_go_round_change_points() {
    for formulation in [Formulation::Projected, Formulation::Embedded] {
        let runs = runs(formulation, &explicit());
        let refused = runs.iter().filter(|(_, outcome)| outcome.is_err()).count();
        for (name, outcome) in &runs {
            println!("{formulation} {name}: {outcome:?}");
        }
        for (name, outcome) in &runs {
            if let Ok((off, warns)) = outcome {
                assert!(*off < 3e-3 && !warns, "{formulation} {name}: {off:e}");
            }
        }
        assert!(refused <= 1, "{formulation}: {refused}");
    }
}

/// Steps of Radau's method whose equations do not converge there are made in parts, too. The stages of the
/// other one lie too far beside the manifold for that: it says so.
#[test]
fn implicit_fixed_steps_pass_change_points_or_say_so() {
    for (name, outcome) in runs(Formulation::Projected, &[methods::Radau5.into()]) {
        let (off, warns) = outcome.unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(off < 1e-5 && !warns, "{name}: {off:e}");
    }
    for (name, outcome) in runs(Formulation::Projected, &[methods::Esdirk4.into()]) {
        match outcome {
            Ok((off, _)) => assert!(off < 1e-6, "{name}: {off:e}"),
            Err(error) => {
                assert!(error.contains("constraint `closure.x` loses its gradient here"), "{name}: {error}")
            }
        }
    }
}

/// Where constraints drift, drift turns the motion there: what it may, a summary says.
#[test]
fn drift_that_turns_motions_is_told() {
    for formulation in [Formulation::Baumgarte { alpha: 50.0, beta: 50.0 }, Formulation::BaumgarteTied] {
        let runs = runs(formulation, &explicit());
        let right =
            runs.iter().filter(|(_, outcome)| outcome.as_ref().is_ok_and(|(off, _)| *off < 3e-3)).count();
        let told =
            runs.iter().filter(|(_, outcome)| outcome.as_ref().map_or(true, |(_, warns)| *warns)).count();
        println!("{formulation}: {right} right, {told} told of {}", runs.len());
        for (name, outcome) in &runs {
            if let Ok((off, warns)) = outcome {
                assert!(*off < 3e-3 || *warns && *off < 0.2, "{formulation} {name}: {off:e}");
            }
        }
        assert!(right >= 4 && told >= 30, "{formulation}: {right} right, {told} told");
    }
}
