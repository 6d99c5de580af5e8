//! What cannot be is refused, by name and with a remedy.

use dynamics::ensembles::{EnsembleError, Grid, InputError, OpenEnsemble, Points, Samples};
use dynamics::prelude::*;

use super::double_pendulum::DoublePendulum;
use super::{Folder, MODEL, ensemble, start};

fn error(inputs: impl dynamics::ensembles::Inputs) -> String {
    MODEL.ensemble(start(), inputs).until(0.1).run().unwrap_err().to_string()
}

#[test]
fn names_are_checked() {
    let text = error(Grid::new().over("theta3", [1.0]));
    assert_eq!(text, "there is no parameter or start `theta3`; did you mean `theta1`?");
    let text = error(Grid::new().over("m1", [1.0]).over("m1", [2.0]));
    assert!(text.contains("`m1` is named twice"), "{text}");
    let kept = MODEL.ensemble(start(), Grid::new().over("m1", [1.0])).until(0.1);
    let text = kept.keep_ends(["m1"], |_, end| [end.t()]).run().unwrap_err().to_string();
    assert!(text.contains("two columns are named `m1`"), "{text}");
    let table = MODEL.ensemble(start(), Grid::new().over("m1", [1.0])).until(0.1).run().unwrap();
    let text = table.column("end_theta3").unwrap_err().to_string();
    assert!(text.contains("did you mean `end_theta1`") && text.contains("`end_t`"), "{text}");
}

#[test]
fn inputs_are_checked() {
    assert!(error(Grid::new()).contains("nothing varies"));
    assert!(error(Grid::new().over("m1", [])).contains("`m1` has no values"));
    assert!(error(Grid::new().over("m1", [1.0, f64::NAN])).contains("`m1` cannot be NaN"));
    assert!(error(Points::new(["m1", "m2"], [[1.0]])).contains("point 0 has 1 values for 2 names"));
    assert!(error(Points::new(["m1"], [[f64::INFINITY]])).contains("`m1` cannot be inf"));
    assert!(error(Points::new(["m1"], [] as [[f64; 1]; 0])).contains("no runs"));
    assert!(error(Samples::sobol(4).uniform("m1", 2.0, 1.0)).contains("between 2 and 1"));
    let correlated = Samples::sobol(16).correlated(["m1", "m2"], [1.0, 1.0], [[1.0, 0.5], [0.5, 1.0]]);
    assert!(error(correlated.for_importance()).contains("`m1`, `m2` are correlated"));
    let axis = || (0..1 << 20).map(f64::from);
    let many = Grid::new().over("m1", axis()).over("m2", axis()).over("l1", axis());
    let refused = MODEL.ensemble(start(), many).until(0.1).run().unwrap_err();
    assert!(matches!(refused, EnsembleError::Input(InputError::TooMany)), "{refused}");
}

#[test]
fn options_are_checked() {
    let folder = Folder::new("refused");
    let text = ensemble().to(folder.path("runs.xlsx")).run().unwrap_err().to_string();
    assert!(text.contains("runs.xlsx") && text.contains("`.csv`, `.npy` or `.parquet`"), "{text}");
    let text = ensemble().to(folder.path("runs")).run().unwrap_err().to_string();
    assert!(text.contains("`.csv`"), "{text}");
    let text = ensemble().shard(0, 2).run().unwrap_err().to_string();
    assert!(text.contains("a shard needs a file") && text.contains(".to("), "{text}");
    let text = ensemble().to(folder.path("runs.csv")).shard(2, 2).run().unwrap_err().to_string();
    assert!(text.contains("no shard 2 of 2") && text.contains("from 0"), "{text}");
    assert!(matches!(ensemble().block(0).run(), Err(EnsembleError::EmptyBlock)));
    let computed = ensemble().compute(["x"], |_, _| [1.0]).run().unwrap_err().to_string();
    assert!(computed.contains("`.until(..)` does nothing with `.compute(..)`"), "{computed}");
    let without_end = MODEL.ensemble(start(), Grid::new().over("m1", [1.0])).run().unwrap();
    assert!(without_end.failed()[0].message.contains(".until("), "{:?}", without_end.failed());
    let beside = folder.path("file");
    std::fs::write(&beside, "").unwrap();
    let text = ensemble().to(beside.join("runs.csv")).run().unwrap_err().to_string();
    assert!(text.contains("file"), "{text}");
    assert_eq!(folder.names(), ["file"]);
}

#[test]
fn the_first_failure_ends_all_on_request() {
    let folder = Folder::new("fail-fast");
    let path = folder.path("runs.csv");
    let error = ensemble().fail_fast().to(&path).run().unwrap_err();
    let EnsembleError::Run { run, message } = &error else { panic!("{error}") };
    assert!(run % 25 == 0 && message.contains("DoublePendulum"), "{error}");
    assert!(!path.exists());
    let none: Grid = Grid::new().over("m1", [1.0, 2.0]);
    let fine = MODEL.ensemble(start(), none).until(0.1).fail_fast().run().unwrap();
    assert!(fine.failed().is_empty());
}

#[test]
fn statistics_are_checked() {
    let table = ensemble().run().unwrap();
    let text = table.importance("height").unwrap_err().to_string();
    assert!(text.contains("for_importance"), "{text}");
    assert!(matches!(table.quantile("height", 1.5), Err(EnsembleError::Probability { .. })));
    assert!(matches!(table.quantile("heigth", 0.5), Err(EnsembleError::NoColumn { .. })));
    // Failed runs do not count.
    assert_eq!(table.mean("height").unwrap().runs, 288);
    let kept = |_: &DoublePendulum, end: State<DoublePendulum>| [1.0 / end.theta2_rate()];
    let infinite = MODEL.ensemble(start(), Grid::new().over("m1", [1.0, 2.0])).until(0.1);
    let infinite = infinite.keep_ends(["x"], kept).run().unwrap();
    let text = infinite.mean("x").unwrap_err().to_string();
    assert!(text.contains("`x` has no finite value in run 0"), "{text}");
}

/// A number that is not finite is no failure: importance refuses it as means do.
#[test]
fn importance_refuses_numbers_that_are_not_finite() {
    let samples = Samples::random(64, 1).uniform("m1", 1.0, 2.0).uniform("m2", 1.0, 2.0);
    let of = |model: &DoublePendulum, _: State<DoublePendulum>| [(1.5 - model.m1).sqrt()];
    let table = MODEL.ensemble(start(), samples.for_importance()).compute(["x"], of).run().unwrap();
    let (mean, importance) = (table.mean("x").unwrap_err(), table.importance("x").unwrap_err());
    assert!(matches!(importance, EnsembleError::NotFinite { .. }), "{importance}");
    assert_eq!(mean.to_string(), importance.to_string());
}
