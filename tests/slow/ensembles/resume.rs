//! Runs that were ended go on; files of other plans are refused by what differs.

use std::path::Path;

use dynamics::ensembles::{EnsembleError, Grid, Inputs, OpenEnsemble};
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
            found.iter().any(|name| name == "varies theta1") && found.contains(&"runs".into()),
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
