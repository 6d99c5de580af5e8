//! Change points at tolerances close to rounding: what rounding throws along the direction that constraints
//! lose there is taken back where a step ends, and is no error of it. 21 of these 24 motions were refused at
//! 1e-12, all of them at 1e-13, after as many steps as were permitted.

use dynamics::methods::Any;
use dynamics::prelude::*;

use super::change_points::{FourBar, turned};
use super::fixed_steps::{Scene, scene_until};

const TIME: f64 = 20.0;

fn scenes() -> Vec<Scene> {
    (0..24)
        .map(|k| scene_until(TIME, 0.0, 1.0, (0.6 + 0.03 * k as f64, 1.5 + 0.17 * (k % 7) as f64)))
        .collect()
}

/// Runs all, to within a bound of the motion by the crank alone, each in no more steps than that.
fn pass(scenes: &[Scene], method: impl Into<Any<FourBar>>, (tolerance, bound): (f64, f64), most: u64) {
    let method = method.into();
    for formulation in [Formulation::Projected, Formulation::Embedded] {
        let (mut worst, mut steps, mut drift) = (0.0f64, 0, 0.0f64);
        for (k, scene) in scenes.iter().enumerate() {
            let run = scene.model.simulate(scene.start).until(TIME).method(&method).formulation(formulation);
            let motion = run.tolerance(tolerance).max_steps(most).run();
            let motion =
                motion.unwrap_or_else(|error| panic!("{k} {method} {formulation} {tolerance:e}: {error}"));
            let end = motion.end();
            let off = (end.crank() - scene.crank).abs().max(turned(end.rocker(), scene.rocker));
            assert!(off < bound, "{k} {method} {formulation} {tolerance:e}: {off:e}");
            (worst, steps) = (worst.max(off), steps + motion.counts().steps + motion.counts().rejected);
            let energy = |state: &State<FourBar>| scene.model.energy_function(state);
            let drifts = motion.steps().map(|state| (energy(&state) - energy(&scene.start)).abs());
            drift = drifts.fold(drift, f64::max);
            assert!(drift < bound, "{k} {method} {formulation} {tolerance:e}: {drift:e}");
        }
        println!("{method} {formulation} {tolerance:e}: off {worst:.1e}, energy {drift:.1e}, {steps} steps");
    }
}

#[test]
fn explicit_methods_pass_change_points_at_tight_tolerances() {
    let scenes = scenes();
    for (tolerance, bound) in [(1e-10, 2e-8), (1e-11, 3e-9), (1e-12, 5e-10), (1e-13, 1e-10)] {
        pass(&scenes, methods::Dop853, (tolerance, bound), 2000);
        pass(&scenes, methods::Verner9, (tolerance, bound), 2000);
    }
}
