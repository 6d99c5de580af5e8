//! Sweeps: every run in its place, whoever made it; failures beside the others.

use dynamics::analysis::{SweepError, VariableError};
use dynamics::model::Model;
use dynamics::prelude::*;

use super::models::Oscillator;

fn model() -> (Oscillator, <Oscillator as Model>::State) {
    let model = Oscillator::PLAIN;
    let start = model.state().x(0.3).build().unwrap();
    (model, start)
}

#[test]
fn every_run_stands_where_the_grid_has_it() {
    let (model, start) = model();
    let sweep = model.sweep(start).over("stiffness", [40.0, 50.0, 60.0]).over("x_rate", [0.0, 1.0]);
    let sweep = sweep
        .run(["x", "x_rate"], |model, start| {
            let end = model.simulate(start).until(1.0).tolerance(1e-11).run()?.end();
            Ok([end.x(), end.x_rate()])
        })
        .unwrap();
    assert_eq!(sweep.results.len(), 6);
    for (k, result) in sweep.results.iter().enumerate() {
        let [stiffness, rate] = sweep.at(k)[..] else { panic!() };
        let closed = Oscillator::closed([2.0, 1.2, stiffness, 0.3, rate], 1.0);
        let found = result.as_ref().unwrap();
        assert!((0..2).all(|i| (found[i] - closed[i]).abs() < 1e-9), "{k}: {found:?} {closed:?}");
    }
    assert_eq!(sweep.at(3), [50.0, 1.0]);
    let units: Vec<&str> = sweep.axes.iter().map(|axis| axis.unit.as_str()).collect();
    assert_eq!(units, ["N/m", "m/s"]);
}

#[test]
fn runs_that_fail_stand_beside_the_others() {
    let (model, start) = model();
    let sweep = model
        .sweep(start)
        .over("mass", [1.0, 0.0, 2.0])
        .run(["x"], |model, start| Ok([model.simulate(start).until(1.0).run()?.end().x()]));
    let sweep = sweep.unwrap();
    let failed: Vec<usize> = sweep.failures().map(|(k, _)| k).collect();
    assert_eq!(failed, [1]);
    let failure = sweep.results[1].as_ref().unwrap_err();
    assert!(
        failure.time == Some(0.0) && failure.state == [0.3, 0.0] && failure.message.contains("`x`"),
        "{failure}"
    );
    let csv = sweep.to_csv();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 4);
    assert_eq!(lines[0], "mass [kg],x,error");
    assert!(lines[1].starts_with("1,0.") && lines[1].ends_with(','), "{csv}");
    assert!(lines[2].starts_with("0,,") && lines[2].len() > 10, "{csv}");
}

#[test]
fn grids_that_make_no_sense_are_refused() {
    let (model, start) = model();
    let run =
        |sweep: dynamics::analysis::Sweeping<'_, Oscillator>| sweep.run(["x"], |_, _| Ok([0.0])).unwrap_err();
    assert_eq!(run(model.sweep(start)), SweepError::NoAxis);
    assert_eq!(run(model.sweep(start).over("mass", [])), SweepError::Empty { name: "mass".into() });
    let error = run(model.sweep(start).over("mass", [1.0]).over("mass", [2.0]));
    assert_eq!(error, SweepError::Variable(VariableError::Twice { name: "mass".into() }));
    let error = run(model.sweep(start).over("mass", [1.0, f64::INFINITY]));
    assert!(matches!(error, SweepError::Variable(VariableError::NotFinite { .. })), "{error}");
    let error = run(model.sweep(start).over("masss", [1.0]));
    assert_eq!(error.to_string(), "there is no parameter or start `masss`; did you mean `mass`?");
    let many = || (0..70_000).map(f64::from);
    let error = run(model.sweep(start).over("mass", many()).over("x", many()));
    assert_eq!(error, SweepError::TooMany);
}

/// The same bytes, whether one core made all runs or several shared them; runs that fail among them.
#[cfg(feature = "parallel")]
#[test]
fn one_core_and_four_write_the_same_bytes() {
    let (model, start) = model();
    let csv = |threads: usize| {
        let masses = (0..40).map(|k| 0.05 * f64::from(k));
        let sweep =
            model.sweep(start).over("mass", masses).over("x", (0..10).map(f64::from)).threads(threads);
        let run = |model: &Oscillator, start| Ok([model.simulate(start).until(2.0).run()?.end().x()]);
        sweep.run(["x"], run).unwrap().to_csv()
    };
    let one = csv(1);
    assert_eq!(one.lines().count(), 401);
    for threads in [2, 4, 7] {
        assert_eq!(one, csv(threads), "{threads} threads");
    }
}

#[test]
fn places_beyond_the_grid_are_none() {
    let (model, start) = model();
    let sweep =
        model.sweep(start).over("damping", [1.0, 2.0]).run(["c"], |model, _| Ok([model.damping])).unwrap();
    assert_eq!(sweep.at(1), [2.0]);
    assert!(sweep.at(2)[0].is_nan());
}
