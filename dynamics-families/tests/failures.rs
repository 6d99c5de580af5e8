//! Errors name what failed, and leave what was computed.

use core::sync::atomic::AtomicBool;

use dynamics_families::model::FamilyState;
use dynamics_families::{FamilyErrorKind, SimulateFamilies, methods};

use crate::common::{GuitarString, Lattice, State, state};

/// Springs with −r³ tear: the motion grows beyond all numbers.
#[test]
fn what_grows_without_bounds_is_named_with_its_time() {
    let lattice = Lattice { masses: 40, alpha: 0.25 };
    let start = state(&lattice, |i| if i == 17 { -9.0 } else { 0.0 }, |_| 0.0);
    for run in [
        lattice.simulate(start.clone()).until(100.0).fixed_step(0.05),
        lattice.simulate(start.clone()).until(100.0),
        lattice.simulate(start.clone()).until(100.0).fixed_step(0.05).method(methods::Rk4),
    ] {
        let error = run.run().expect_err("grows");
        match &error.kind {
            FamilyErrorKind::AccelerationNotFinite { coordinate }
            | FamilyErrorKind::StepSizeTooSmall { coordinate } => {
                assert!(coordinate.starts_with("x["), "{coordinate}");
            }
            other => panic!("{other}"),
        }
        assert!(error.time > 0.0 && error.time < 20.0, "{}", error.time);
        let motion = error.motion(&lattice).expect("what was computed");
        assert_eq!(motion.end_time(), error.time);
        assert!(motion.end().q().iter().all(|q| q.is_finite()));
        assert!(motion.frames().len() > 1);
    }
}

#[test]
fn options_and_starts_are_checked() {
    let string = GuitarString::uniform(8);
    let start = state(&string, |_| 0.0, |_| 0.0);
    let text = |result: Result<_, dynamics_families::FamilyError<GuitarString>>| match result {
        Ok(()) => String::new(),
        Err(error) => error.to_string().replace("`GuitarString` was not simulated: ", ""),
    };
    let simulate = || string.simulate(start.clone()).until(1.0).inputs(|_, _| 0.0);
    let run = |simulation: dynamics_families::FamilySimulation<'_, _>| text(simulation.run().map(|_| ()));
    assert_eq!(run(string.simulate(start.clone())), "the end is not given; add `.until(t)`");
    assert_eq!(
        run(string.simulate(start.clone()).until(1.0)),
        "input `pluck` has no value; set it in the start state or give `.inputs(|t, state| ..)`"
    );
    assert!(run(simulate().inputs(|_, _| f64::NAN)).contains("no finite value for `pluck`"));
    assert!(run(simulate().inputs(|_, _| [0.0, 1.0])).contains("gave 2 values; the model has 1 inputs"));
    assert!(run(simulate().fixed_step(-1.0)).contains("`.fixed_step(-1)` is not possible"));
    assert!(run(simulate().tolerance(2.0)).contains("`.tolerance(2)` is not possible"));
    assert!(run(simulate().method(methods::Rk4)).contains("give `.fixed_step(h)`"));
    assert!(run(simulate().fixed_step(1e-3).method(methods::StormerVerlet)).contains("depend on velocities"));
    assert!(run(simulate().max_steps(3)).contains("more than 3 steps"));
    assert!(run(simulate().fixed_step(1.0)).contains("is too long for RK4"));
    let flag = AtomicBool::new(true);
    assert!(run(simulate().cancel(&flag)).ends_with("cancelled"));
    let short = state(&GuitarString::uniform(7), |_| 0.0, |_| 0.0);
    assert!(run(string.simulate(short).until(1.0)).contains("has 14 coordinates and the model 16"));
    let bad = state(&string, |i| if i == 11 { f64::NAN } else { 0.0 }, |_| 0.0);
    assert!(run(string.simulate(bad).until(1.0)).contains("the start is not finite: `w[3]`"));
    let massless = GuitarString { mass: vec![1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0], ..string.clone() };
    let error = massless.simulate(start.clone()).until(1.0).inputs(|_, _| 0.0).run().expect_err("massless");
    assert!(error.to_string().contains("not positive definite at `s[2]`"), "{error}");
    let few = GuitarString { mass: vec![1.0; 3], ..string.clone() };
    let error = few.simulate(start.clone()).until(1.0).run().expect_err("too short");
    assert!(error.to_string().contains("`mass` has 3 elements; the model reads `mass[7]`"), "{error}");
}

/// A state is what it was assembled from.
#[test]
fn no_time_means_no_motion() {
    let lattice = Lattice { masses: 4, alpha: 0.0 };
    let start: State = state(&lattice, |_| 1.0, |_| 0.0);
    let motion = lattice.simulate(start.clone()).until(0.0).run().expect("nothing to do");
    assert_eq!((motion.end(), motion.summary().steps), (&start, 0));
    assert_eq!(motion.start().t(), 0.0);
    assert!(motion.summary().to_string().contains("Lattice from t = 0 to 0"));
}

/// Inputs that end in the middle of the motion: what was computed before is there.
#[test]
fn inputs_that_are_lost_end_the_motion() {
    let string = GuitarString::uniform(8);
    let start = state(&string, |_| 0.0, |_| 0.0);
    let run =
        || string.simulate(start.clone()).until(1.0).inputs(|t, _| if t < 0.5 { 0.1 } else { f64::NAN });
    for run in [
        run(),
        run().fixed_step(0.01),
        run().fixed_step(0.01).method(methods::ImplicitMidpoint),
        run().fixed_step(0.01).method(methods::Newmark),
    ] {
        let error = run.run().expect_err("not finite");
        assert_eq!(error.kind, FamilyErrorKind::InputNotFinite { input: "pluck" });
        assert!(error.time > 0.4 && error.time < 0.5 + 1e-9, "{error}");
        let motion = error.motion(&string).expect("what was computed");
        assert_eq!(motion.end_time(), error.time);
        assert!(motion.end().q().iter().all(|q| q.is_finite()) && motion.end().q()[12] > 0.0);
    }
}
