//! Runs that were ended go on; files of other plans are refused by what differs.

use std::path::Path;

use dynamics::ensembles::{EnsembleError, EnsembleTable, Grid, Inputs, OpenEnsemble, Points, Samples};
use dynamics::prelude::*;

use super::double_pendulum::DoublePendulum;
use super::{Folder, MODEL, bytes, ensemble, grid, start};

/// The shard 0 of 1 is all runs, and its folder keeps the blocks: they become those of an ended run.
fn blocks_of_ended_run(path: &Path) {
    ensemble().to(path).shard(0, 1).run().unwrap();
    let folder = |ending: &str| format!("{}.{ending}", path.display());
    std::fs::rename(folder("0-of-1"), folder("blocks")).unwrap();
}

#[test]
fn an_ended_run_goes_on_where_it_stopped() {
    let folder = Folder::new("resume");
    let (whole, path) = (folder.path("whole.csv"), folder.path("runs.csv"));
    ensemble().to(&whole).run().unwrap();
    blocks_of_ended_run(&path);
    let block = |k: usize| folder.path(&format!("runs.csv.blocks/{k:09}.block"));
    // Two are missing, one was cut off, one has a wrong bit, one is another block.
    std::fs::remove_file(block(3)).unwrap();
    std::fs::remove_file(block(18)).unwrap();
    let cut = bytes(block(5));
    std::fs::write(block(5), &cut[..cut.len() - 3]).unwrap();
    let mut changed = bytes(block(7));
    changed[200] ^= 1;
    std::fs::write(block(7), &changed).unwrap();
    std::fs::copy(block(1), block(2)).unwrap();
    let table = ensemble().to(&path).run().unwrap();
    // The last block has 12 runs.
    assert_eq!((table.report().made, table.report().damaged_blocks), (4 * 16 + 12, 3));
    assert!(table.report().to_string().contains("224 were in files; 3 damaged blocks"), "{}", table.report());
    assert_eq!(bytes(&path), bytes(&whole));
    assert_eq!(bytes(folder.path("runs.csv.plan.txt")), bytes(folder.path("whole.csv.plan.txt")));
    assert!(!folder.path("runs.csv.blocks").exists());
}

#[test]
fn other_plans_are_refused_by_what_differs() {
    let folder = Folder::new("plans");
    let path = folder.path("runs.csv");
    let heavier = DoublePendulum { m1: 2.0, ..MODEL };
    let shaken = MODEL.state().theta2_rate(0.5).build().unwrap();
    let angle = |_: &DoublePendulum, end: State<DoublePendulum>| [end.theta2(), 0.0];
    let with = |model: &DoublePendulum, start, until: f64, tolerance: f64| {
        let kept = model.ensemble(start, grid()).until(until).tolerance(tolerance).block(16);
        kept.keep_ends(["theta2_end [rad]", "height"], angle).to(&path).run().unwrap_err()
    };
    let of_first_block = |error: EnsembleError| match error {
        EnsembleError::OtherPlan { differences, .. } => {
            differences.into_iter().map(|difference| difference.name).collect::<Vec<_>>()
        }
        other => panic!("{other}"),
    };
    // While there are blocks, and when the file is complete.
    for is_complete in [false, true] {
        if is_complete {
            ensemble().to(&path).run().unwrap();
        } else {
            blocks_of_ended_run(&path);
        }
        let error = with(&MODEL, start(), 0.5, 1e-8);
        let text = error.to_string();
        assert!(text.contains("`option tolerance` is 1e-7 1e-7 there and 1e-8 1e-8 here"), "{text}");
        assert!(text.contains("runs.csv") && text.contains("write to another file"), "{text}");
        assert_eq!(of_first_block(with(&MODEL, start(), 0.75, 1e-7)), ["option until"]);
        assert_eq!(of_first_block(with(&heavier, start(), 0.5, 1e-7)), ["equations", "parameter m1"]);
        assert_eq!(of_first_block(with(&MODEL, shaken, 0.5, 1e-7)), ["equations", "start theta2_rate"]);
        let names = |ensemble: dynamics::ensembles::Ensemble<'_, DoublePendulum>| {
            of_first_block(ensemble.to(&path).run().unwrap_err())
        };
        assert_eq!(names(ensemble().block(8)), ["runs of a block"]);
        assert_eq!(names(ensemble().label("2")), ["label"]);
        assert_eq!(names(ensemble().options(|_, run| run.max_step(0.1))), ["option max_step"]);
        let stops = names(ensemble().options(|_, run| {
            run.event("top", |state| state.theta1() - 3.0).stop_at("top", Direction::Rising)
        }));
        assert_eq!(stops, ["option event top", "option at top, Rising"]);
        assert_eq!(
            names(
                ensemble().keep_ends(["other"], |_: &DoublePendulum, end: State<DoublePendulum>| [end.t()])
            ),
            ["keeps"]
        );
        let angles = Grid::new().over("theta1", [0.0, 1.0]).over("m2", [1.0, 2.0]);
        let other = MODEL.ensemble(start(), angles).until(0.5).tolerance(1e-7).block(16);
        let found = names(other.keep_ends(["theta2_end [rad]", "height"], angle));
        assert!(
            found.iter().any(|name| name == "inputs: varies theta1") && found.contains(&"runs".into()),
            "{found:?}"
        );
    }
}

/// A generator whose values have changed behind an unchanged plan.
struct Changed(f64);

impl Inputs for Changed {
    fn names(&self) -> Vec<String> {
        vec!["theta1".into()]
    }
    fn count(&self) -> usize {
        40
    }
    fn point(&self, run: usize, values: &mut [f64]) {
        values[0] = self.0 * run as f64;
    }
    fn plan(&self) -> Vec<(String, String)> {
        vec![("inputs".into(), "multiples".into())]
    }
}

#[test]
fn generators_that_have_changed_are_noticed() {
    let folder = Folder::new("changed");
    let path = folder.path("runs.csv");
    let with = |by: f64| MODEL.ensemble(start(), Changed(by)).until(0.01).label("one").block(8).to(&path);
    with(0.01).shard(0, 1).run().unwrap();
    let error = with(0.02).shard(0, 1).run().unwrap_err().to_string();
    assert!(error.contains("`input 0 of run 4` is 0.04 there and 0.08 here"), "{error}");
}

#[test]
fn files_of_unknown_origin_are_not_overwritten() {
    let folder = Folder::new("unknown");
    let path = folder.path("runs.csv");
    std::fs::write(&path, "my own\n").unwrap();
    let error = ensemble().to(&path).run().unwrap_err();
    assert!(matches!(error, EnsembleError::Unknown { .. }), "{error}");
    assert_eq!(bytes(&path), b"my own\n");
}

/// Swapped axes, names and samples give the same lines in another order, and other runs.
#[test]
fn the_order_of_inputs_is_part_of_the_plan() {
    let folder = Folder::new("order");
    let axis = || [0.1, 0.2, 0.3];
    // The first run, of which the plan has the equations, is the same.
    let list = [[0.1, 0.1], [0.3, 0.4], [0.5, 0.6]];
    let samples = |names: [&str; 2]| {
        names.into_iter().fold(Samples::sobol(8).unscrambled(), |all, name| all.uniform(name, 0.0, 1.0))
    };
    let pairs: [[Box<dyn Inputs>; 2]; 3] = [
        [
            Box::new(Grid::new().over("theta1", axis()).over("theta2", axis())),
            Box::new(Grid::new().over("theta2", axis()).over("theta1", axis())),
        ],
        [
            Box::new(Points::new(["theta1", "theta2"], list)),
            Box::new(Points::new(["theta2", "theta1"], list)),
        ],
        [Box::new(samples(["theta1", "theta2"])), Box::new(samples(["theta2", "theta1"]))],
    ];
    for (k, pair) in pairs.iter().enumerate() {
        let path = folder.path(&format!("runs{k}.csv"));
        let of = |inputs| MODEL.ensemble(start(), Borrowed(inputs)).until(0.01).block(2).to(&path);
        let [one, other] = [&*pair[0], &*pair[1]];
        let refused = |error: EnsembleError| {
            let text = error.to_string();
            assert!(text.contains("`order` is `inputs: varies theta1` before"), "{text}");
        };
        of(one).shard(0, 1).run().unwrap();
        refused(of(other).shard(0, 1).run().unwrap_err());
        of(one).run().unwrap();
        refused(of(other).run().unwrap_err());
    }
}

struct Borrowed<'i>(&'i dyn Inputs);

impl Inputs for Borrowed<'_> {
    fn names(&self) -> Vec<String> {
        self.0.names()
    }
    fn count(&self) -> usize {
        self.0.count()
    }
    fn point(&self, run: usize, values: &mut [f64]) {
        self.0.point(run, values);
    }
    fn plan(&self) -> Vec<(String, String)> {
        self.0.plan()
    }
}

#[test]
fn generators_that_have_changed_are_noticed_in_complete_files() {
    let folder = Folder::new("changed-file");
    let path = folder.path("runs.csv");
    let with = |by: f64| MODEL.ensemble(start(), Changed(by)).until(0.01).block(8).to(&path);
    with(0.01).run().unwrap();
    assert_eq!(with(0.01).run().unwrap().report().made, 0);
    let error = with(0.02).run().unwrap_err().to_string();
    assert!(error.contains("`input 0 of run 4` is 0.04 there and 0.08 here"), "{error}");
}

/// A whole block of another plan is no damage that would be repaired in silence.
#[test]
fn blocks_of_other_plans_are_errors() {
    let folder = Folder::new("other-block");
    let (path, other) = (folder.path("runs.csv"), folder.path("other.csv"));
    blocks_of_ended_run(&path);
    ensemble().label("other").to(&other).shard(0, 1).run().unwrap();
    let block = "000000003.block";
    std::fs::copy(folder.path("other.csv.0-of-1").join(block), folder.path("runs.csv.blocks").join(block))
        .unwrap();
    let error = ensemble().to(&path).run().unwrap_err();
    assert!(matches!(error, EnsembleError::OtherPlan { .. }), "{error}");
    assert!(error.to_string().contains(block) && error.to_string().contains("digest"), "{error}");
    assert!(!path.exists());
}

/// Blocks beside a file that is complete are removed only if they are its own.
#[test]
fn blocks_of_another_plan_stay() {
    let folder = Folder::new("foreign-blocks");
    let (path, other) = (folder.path("runs.csv"), folder.path("other.csv"));
    ensemble().label("other").to(&other).run().unwrap();
    blocks_of_ended_run(&path);
    std::fs::copy(&other, &path).unwrap();
    std::fs::copy(folder.path("other.csv.plan.txt"), folder.path("runs.csv.plan.txt")).unwrap();
    let read = ensemble().label("other").to(&path).run().unwrap();
    assert_eq!(read.report().made, 0);
    assert!(folder.path("runs.csv.blocks/000000018.block").exists());
    // And its own are.
    std::fs::remove_file(&path).unwrap();
    let table = ensemble().to(&path).run().unwrap();
    assert_eq!(table.report().made, 0);
    assert!(!folder.path("runs.csv.blocks").exists());
    blocks_of_ended_run(&path);
    assert_eq!(ensemble().to(&path).run().unwrap().report().made, 0);
    assert!(!folder.path("runs.csv.blocks").exists());
}

/// A plan that was cut off when the power failed is written again, and blocks are not made again.
#[test]
fn plans_that_were_cut_off_are_missing() {
    let folder = Folder::new("cut-plan");
    let path = folder.path("runs.csv");
    for length in [0, 20, 400] {
        blocks_of_ended_run(&path);
        let plan = folder.path("runs.csv.blocks/plan.txt");
        let whole = bytes(&plan);
        std::fs::write(&plan, &whole[..length]).unwrap();
        let table = ensemble().to(&path).run().unwrap();
        assert_eq!((table.report().made, table.report().damaged_blocks), (0, 0), "{length}");
        assert!(!folder.path("runs.csv.blocks").exists());
        // That beside a table says nothing of it.
        std::fs::write(folder.path("runs.csv.plan.txt"), &whole[..length]).unwrap();
        let error = EnsembleTable::read(&path).unwrap_err();
        assert!(matches!(error, EnsembleError::Unknown { .. }), "{error}");
        std::fs::remove_file(&path).unwrap();
    }
}

/// Failures that are in files already end an ensemble, too.
#[test]
fn failures_in_files_end_all_on_request() {
    let folder = Folder::new("fail-fast-again");
    let path = folder.path("runs.csv");
    let refused = || {
        let error = ensemble().fail_fast().to(&path).run().unwrap_err();
        assert!(matches!(error, EnsembleError::Run { run: 0, .. }), "{error}");
    };
    blocks_of_ended_run(&path);
    refused();
    ensemble().to(&path).run().unwrap();
    refused();
}
