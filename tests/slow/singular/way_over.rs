//! Where one way of running a motion gives up at a position at which the mechanism can move on, the error
//! names another that passes it, and that does.

use dynamics::methods::Any;
use dynamics::prelude::*;
use dynamics::simulate::CrossingSettings;

use super::change_points::{FourBar, turned};
use super::fixed_steps::{Scene, scene_until};
use super::*;

/// Time enough for two or three of them.
const TIME: f64 = 4.0;
/// Steps enough for a hundred times as many.
const MOST: u64 = 20_000;

/// The starts of the neutral four-bar, which passes change points again and again.
fn scenes() -> impl Iterator<Item = (usize, Scene)> {
    (0..8).map(|k| (k, scene_until(TIME, 0.0, 1.0, (0.6 + 0.03 * k as f64, 1.5 + 0.17 * (k % 7) as f64))))
}

fn off(scene: &Scene, end: &State<FourBar>) -> f64 {
    (end.crank() - scene.crank).abs().max(turned(end.rocker(), scene.rocker))
}

/// Runs all scenes; those that are refused again, as their errors say. How many were.
fn refused(method: impl Into<Any<FourBar>>, tolerance: f64) -> usize {
    let method = method.into();
    let mut refused = 0;
    for (k, scene) in scenes() {
        let run = || scene.model.simulate(scene.start).until(TIME).max_steps(MOST);
        let error = match run().method(&method).tolerance(tolerance).run() {
            Ok(motion) => {
                assert!(off(&scene, &motion.end()) < 1e-4, "{k} {method} {tolerance:e}");
                continue;
            }
            Err(error) => error,
        };
        refused += 1;
        let text = error.to_string();
        let SimulationErrorKind::SingularPosition { cause, .. } = error.kind else {
            panic!("{k} {method} {tolerance:e}: {text}")
        };
        let Some(CrossingSettings { method: other, tolerance: looser, .. }) = cause.crossing else {
            panic!("{text}")
        };
        assert!(
            text.contains("go over such positions; if the mechanism cannot move on here, change"),
            "{text}"
        );
        assert!(other.is_some() || looser.is_some());
        assert_eq!(other.is_some(), text.contains("use methods::Dop853"), "{text}");
        assert_eq!(
            looser.is_some(),
            text.contains("tolerance of 1e-12") || text.contains("tolerance to 1e-9"),
            "{text}"
        );
        let again = run().method(methods::Dop853).tolerance(looser.unwrap_or(tolerance)).run();
        let end = again.unwrap_or_else(|error| panic!("{k} {method} {tolerance:e}: {error}")).end();
        assert!(off(&scene, &end) < 1e-4, "{k} {method} {tolerance:e}: {:e}", off(&scene, &end));
    }
    refused
}

/// Rounding counts for more than the tolerance: where it does, a looser one passes.
#[test]
fn tolerances_that_rounding_does_not_keep_there_are_to_be_loosened() {
    assert_eq!(refused(methods::Dop853, 1e-13), 0);
    assert!(refused(methods::Dop853, 1e-15) > 0, "nothing was tested");
}

/// What does not come past such a position is told after some thousand steps, not when all are used up:
/// 100,000 took seconds, and a million minutes.
#[test]
fn steps_that_crawl_are_given_up_soon() {
    let mut refused = 0;
    for k in 0..8 {
        let scene = scene_until(20.0, 0.0, 1.0, (0.6 + 0.03 * k as f64, 1.5 + 0.17 * k as f64));
        let run = scene.model.simulate(scene.start).until(20.0).method(methods::Dop853).tolerance(1e-15);
        match run.max_steps(12_000).run() {
            Ok(motion) => assert!(off(&scene, &motion.end()) < 1e-10, "{k}"),
            Err(error) => {
                let SimulationErrorKind::SingularPosition { cause, .. } = error.kind else {
                    panic!("{k}: {error}")
                };
                assert!(
                    !matches!(cause.kind, SimulationErrorKind::TooManySteps { .. }),
                    "{k}: {:?}",
                    cause.kind
                );
                refused += 1;
            }
        }
    }
    assert!(refused > 2, "nothing was tested: {refused}");
}

/// Two walls that meet at some millionths of a radian hold what lies between them; what rests along them
/// crawls nowhere, however long.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, z: m)]
#[units(mass: kg, damping: kg / s, rate: N / m)]
#[nominal(narrow = 3e-6)]
struct Wedge {
    mass: f64,
    narrow: f64,
    damping: f64,
    rate: f64,
}

#[dynamics]
impl Wedge {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec3(q.x, q.y, q.z).dt().norm_squared()
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.rate * q.z.powi(2)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * q.z.dt().powi(2)
    }
    #[holonomic]
    fn walls(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [q.y - self.narrow * q.x, q.y + self.narrow * q.x]
    }
}

#[test]
fn what_comes_to_rest_beside_a_singular_position_does_not_crawl() {
    let wedge = Wedge { mass: 1.0, narrow: 3e-6, damping: 0.4, rate: 1.0 };
    let start = wedge.state().z(1.0).build().unwrap();
    for tolerance in [1e-9, 1e-12] {
        let run = wedge.simulate(start).until(1e4).method(methods::Dop853).tolerance(tolerance);
        let motion = run.run().unwrap_or_else(|error| panic!("{tolerance:e}: {error}"));
        assert!(motion.counts().steps > 1024 && motion.end().z().abs() < tolerance, "{tolerance:e}");
    }
}

#[test]
fn other_methods_name_the_one_that_passes() {
    let refused = refused(methods::Radau5, 1e-9)
        + refused(methods::Taylor::default(), 1e-11)
        + refused(methods::Taylor::default(), 1e-13);
    assert!(refused > 0, "nothing was tested");
}

/// A study has a reference there; where the tightest one does not come to its end, another, and says which.
#[test]
fn studies_have_the_reference_that_passes() {
    let (_, scene) = scenes().next().expect("one of them");
    let study = |most: u64| {
        let study = scene.model.work_precision(scene.start).until(TIME).with(move |run| run.max_steps(most));
        study.methods([methods::Dop853.into()]).tolerances([1e-5, 1e-7]).run().unwrap()
    };
    let (tightest, other) = (study(MOST), study(600));
    assert!(!tightest.to_string().contains(" fails"), "{tightest}");
    let text = other.to_string();
    assert!(text.contains("Verner 9(8)") && text.contains(" fails"), "{text}");
    let uncertainty = [tightest, other].map(|study| study.uncertainty().positions);
    assert!(uncertainty[0] < 1e-10 && uncertainty[1] < 1e-9, "{uncertainty:?}");
}
