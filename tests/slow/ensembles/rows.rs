//! Rows have the bits of runs alone, in the order of the inputs.

use dynamics::analysis::RunFailure;
use dynamics::ensembles::{EnsembleTable, Grid, OpenEnsemble, Points, Samples};
use dynamics::prelude::*;
use dynamics::simulate::ends;

use super::double_pendulum::DoublePendulum;
use super::{MODEL, ensemble, start};

fn bits(table: &EnsembleTable) -> Vec<Vec<u64>> {
    table.rows().map(|(_, row)| row.iter().map(|x| x.to_bits()).collect()).collect()
}

#[test]
fn rows_in_lanes_have_the_bits_of_runs_alone() {
    let table = ensemble().run().unwrap();
    assert_eq!(table.len(), 300);
    assert!(table.report().way.starts_with("side by side"), "{}", table.report());
    let mut failed = table.failed().iter().peekable();
    for (run, row) in table.rows() {
        let [theta1, m2, theta2, height] = row[..] else { panic!() };
        assert_eq!((theta1, m2), (0.25 * (run / 25) as f64, 0.1 * (run % 25) as f64));
        let model = DoublePendulum { m2, ..MODEL };
        let start = model.state().theta1(theta1).build();
        match failed.next_if(|failure| failure.run == run) {
            None => {
                let alone = ends([model.simulate(start.unwrap()).until(0.5).tolerance(1e-7)]);
                let end = *alone[0].as_ref().unwrap();
                assert_eq!(theta2.to_bits(), end.theta2().to_bits(), "run {run}");
                assert_eq!(height.to_bits(), (-end.theta1().cos()).to_bits(), "run {run}");
            }
            Some(failure) => {
                assert!(m2 == 0.0 && theta2.is_nan() && height.is_nan(), "run {run}");
                assert!(failure.message.contains("DoublePendulum") && !failure.message.contains('\n'));
            }
        }
    }
    assert_eq!(table.failed().len(), 12);
    let names: Vec<&str> = table.columns().iter().map(|column| column.name.as_str()).collect();
    let units: Vec<&str> = table.columns().iter().map(|column| column.unit.as_str()).collect();
    assert_eq!(names, ["theta1", "m2", "theta2_end", "height"]);
    assert_eq!(units, ["rad", "kg", "rad", ""]);
}

/// The number of threads and the length of blocks change no bit.
#[test]
fn rows_do_not_depend_on_who_made_them() {
    let known = bits(&ensemble().run().unwrap());
    for block in [1, 7, 299, 300, 1024] {
        assert_eq!(bits(&ensemble().block(block).run().unwrap()), known, "blocks of {block}");
    }
    #[cfg(feature = "parallel")]
    for threads in [1, 2, 5] {
        let on = dynamics::ensembles::Cores::threads(threads);
        assert_eq!(bits(&ensemble().on(on).run().unwrap()), known, "{threads} threads");
    }
}

#[test]
fn rows_of_sweeps_are_the_same() {
    let (lengths, angles) = ([0.5, 1.0, 2.0], [0.1, 1.0, 2.5]);
    let sweep = MODEL.sweep(start()).over("l1", lengths).over("theta1", angles);
    let sweep = sweep.ends(["theta2"], |_, run| run.until(1.0), |_, end| [end.theta2()]).unwrap();
    let inputs = Grid::new().over("l1", lengths).over("theta1", angles);
    let table = MODEL.ensemble(start(), inputs).until(1.0).run().unwrap();
    let ends = table.column("end_theta2").unwrap();
    for (run, result) in sweep.results.iter().enumerate() {
        assert_eq!(result.as_ref().unwrap()[0].to_bits(), ends[run].to_bits());
    }
    // Without a choice the last state is kept.
    let names: Vec<&str> = table.columns()[2..].iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["end_t", "end_theta1", "end_theta2", "end_theta1_rate", "end_theta2_rate"]);
    assert!(table.column("end_t").unwrap().iter().all(|t| *t == 1.0));
}

#[test]
fn whole_motions_have_the_bits_of_runs_alone() {
    let points = Points::new(["theta1", "theta2_rate"], [[0.3, 0.0], [2.0, 1.0], [-1.0, 0.5]]);
    let table = MODEL
        .ensemble(start(), points)
        .until(2.0)
        .options(|_, run| run.event("down", |state| state.theta1()))
        .keep(["swings", "lowest"], |motion: &Motion<'_, DoublePendulum>| {
            let lowest = motion.sample((0..=20).map(|k| 0.1 * f64::from(k)));
            [motion.events().len() as f64, lowest.map(|s| s.theta1()).fold(f64::INFINITY, f64::min)]
        })
        .run()
        .unwrap();
    assert!(table.report().way.contains("`.keep(..)` needs whole motions"), "{}", table.report());
    for (run, row) in table.rows() {
        let start = MODEL.state().theta1(row[0]).theta2_rate(row[1]).build().unwrap();
        let motion = MODEL.simulate(start).until(2.0).event("down", |state| state.theta1()).run().unwrap();
        assert_eq!(row[2], motion.events().len() as f64);
        let lowest = motion.sample((0..=20).map(|k| 0.1 * f64::from(k)));
        let lowest = lowest.map(|s| s.theta1()).fold(f64::INFINITY, f64::min);
        assert_eq!(row[3].to_bits(), lowest.to_bits(), "run {run}");
    }
}

/// Why runs are made one by one stands in the report: the option by its name.
#[test]
fn the_report_says_why_runs_are_made_one_by_one() {
    let inputs = || Grid::new().over("theta1", [0.1, 0.2]);
    let table = MODEL.ensemble(start(), inputs()).until(0.1).options(|_, run| run.method(methods::Dop853));
    let table = table.run().unwrap();
    assert!(table.report().to_string().contains("one by one: the option is set: `.method(..)`"));
    let computed = MODEL.ensemble(start(), inputs()).compute(["twice"], |_, start| [2.0 * start.theta1()]);
    let computed = computed.run().unwrap();
    assert_eq!(computed.column("twice").unwrap(), [0.2, 0.4]);
    assert!(computed.report().to_string().contains("`.compute(..)`"));
    // Errors of runs are failures by `?`.
    let run =
        |model: &DoublePendulum, start| Ok([model.simulate(start).until(-1.0 / model.m1).run()?.end().t()]);
    let backwards = MODEL.ensemble(start(), Grid::new().over("m1", [1.0, f64::MIN_POSITIVE]));
    let backwards = backwards.compute(["t"], run).run().unwrap();
    assert_eq!(backwards.column("t").unwrap()[0], -1.0);
    assert_eq!(backwards.failed().len(), 1);
}

/// Failures in words of one's own, and values that no run can have.
#[test]
fn failures_are_rows_with_their_reason() {
    let kept = |_: &DoublePendulum, end: State<DoublePendulum>| {
        if end.theta1() > 0.0 { Ok([1.0]) } else { Err(RunFailure::new("it hangs\nto the left")) }
    };
    let samples = Samples::random(4, 1).distributed("theta1", |p| if p < 0.9 { -0.5 } else { 0.5 });
    let table = MODEL.ensemble(start(), samples).until(0.01).keep_ends(["x"], kept).run().unwrap();
    assert!(table.failed().iter().all(|failure| failure.message == "it hangs"), "{:?}", table.failed());
    assert!(!table.failed().is_empty());
    let samples = Samples::sobol(4).distributed("theta1", |p| if p < 0.5 { f64::NAN } else { 0.5 });
    let table = MODEL.ensemble(start(), samples).until(0.01).run().unwrap();
    assert_eq!(table.failed().len(), 2);
    let message = &table.failed()[0].message;
    assert_eq!(message, "`theta1` cannot be NaN; give finite numbers");
}
