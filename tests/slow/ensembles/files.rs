//! Files read back as they were written, and are those of one run.

use dynamics::analysis::RunFailure;
use dynamics::ensembles::{EnsembleError, EnsembleTable, Grid, OpenEnsemble, merge};
use dynamics::prelude::*;

use super::double_pendulum::DoublePendulum;
use super::{Folder, MODEL, bytes, ensemble, start};

#[cfg(not(feature = "parquet"))]
pub(super) const ENDINGS: &[&str] = &["csv", "npy"];
#[cfg(feature = "parquet")]
pub(super) const ENDINGS: &[&str] = &["csv", "npy", "parquet"];

fn assert_same(a: &EnsembleTable, b: &EnsembleTable, what: &str) {
    let all = |table: &EnsembleTable| -> Vec<(usize, Vec<u64>)> {
        table.rows().map(|(run, row)| (run, row.iter().map(|x| x.to_bits()).collect())).collect()
    };
    assert_eq!(all(a), all(b), "{what}");
    assert_eq!(a.failed(), b.failed(), "{what}");
    assert_eq!(a.columns(), b.columns(), "{what}");
    assert_eq!(a.plan(), b.plan(), "{what}");
}

#[test]
fn files_read_back() {
    let folder = Folder::new("read");
    let in_memory = ensemble().run().unwrap();
    for ending in ENDINGS {
        let path = folder.path(&format!("runs.{ending}"));
        let written = ensemble().to(&path).run().unwrap();
        assert_same(&written, &in_memory, ending);
        let read = EnsembleTable::read(&path).unwrap();
        assert_same(&read, &in_memory, ending);
        assert_eq!(read.report().read_from.as_ref(), Some(&path));
        // Once more: it is complete, and read.
        let before = bytes(&path);
        let again = ensemble().to(&path).run().unwrap();
        assert_eq!(again.report().made, 0, "{ending}");
        assert_same(&again, &in_memory, ending);
        assert_eq!(bytes(&path), before, "{ending}");
        // Written from the table.
        let copy = folder.path(&format!("copy.{ending}"));
        read.write(&copy).unwrap();
        assert_eq!(bytes(&copy), before, "{ending}");
    }
    let left: Vec<String> =
        folder.names().into_iter().filter(|name| name.contains("part") || name.contains("blocks")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn tables_have_heads_rows_and_reasons() {
    let folder = Folder::new("heads");
    let path = folder.path("runs.csv");
    ensemble().to(&path).run().unwrap();
    let text = String::from_utf8(bytes(&path)).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "theta1 [rad],m2 [kg],theta2_end [rad],height,error");
    assert_eq!(lines.len(), 301);
    assert!(lines[1].starts_with("0,0,,,") && lines[1].contains("DoublePendulum"), "{}", lines[1]);
    assert!(lines[2].ends_with(','), "{}", lines[2]);
    let plan = String::from_utf8(bytes(folder.path("runs.csv.plan.txt"))).unwrap();
    for line in [
        "model = DoublePendulum",
        "parameter m1 = 1",
        "option until = 0.5",
        "start theta2_rate = 0",
        "theta1 = input, [rad]",
        "height = kept, []",
        "runs = 300",
        "failed = 12",
    ] {
        assert!(plan.lines().any(|known| known == line), "{line}\n{plan}");
    }
    assert!(!plan.contains("parameter m2"), "{plan}");
}

#[test]
fn damaged_files_are_not_read() {
    let folder = Folder::new("damaged");
    for ending in ENDINGS {
        let path = folder.path(&format!("runs.{ending}"));
        ensemble().to(&path).run().unwrap();
        let whole = bytes(&path);
        for length in [0, 40, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..length]).unwrap();
            let error = EnsembleTable::read(&path).unwrap_err();
            assert!(matches!(error, EnsembleError::Unreadable { .. }), "{ending} {length}: {error}");
        }
    }
    let error = EnsembleTable::read(folder.path("none.csv")).unwrap_err().to_string();
    assert!(error.contains("none.csv") && error.contains("no such file"), "{error}");
}

/// Three runs, of which the second fails.
fn three(reason: &'static str, name: &str) -> dynamics::ensembles::Ensemble<'static, DoublePendulum> {
    let of = move |_: &DoublePendulum, start: State<DoublePendulum>| match start.theta1() {
        0.5 => Err(RunFailure::new(reason)),
        theta1 => Ok([theta1]),
    };
    let grid = Grid::new().over("theta1", [0.0, 0.5, 1.0]);
    MODEL.ensemble(start(), grid).block(2).compute([name], of)
}

/// Names and reasons of all kinds read back.
#[test]
fn every_name_and_every_reason_reads_back() {
    let folder = Folder::new("names");
    let names = ["E = T+V", "# of flips", "a \\ b", "a, \"b\"", "x [m = n]", "plan"];
    for (k, name) in names.into_iter().enumerate() {
        for (l, reason) in ["", "y = 0", "# plan", "a \\n b, \"c\""].into_iter().enumerate() {
            let in_memory = three(reason, name).run().unwrap();
            assert_eq!(in_memory.failed().len(), 1);
            assert!(!in_memory.failed()[0].message.is_empty());
            for ending in ENDINGS {
                let path = folder.path(&format!("{k}-{l}.{ending}"));
                three(reason, name).to(&path).run().unwrap();
                assert_same(&EnsembleTable::read(&path).unwrap(), &in_memory, ending);
            }
        }
    }
}

/// The columns that say which runs failed have names that no other column may have.
#[test]
fn names_of_columns_of_failures_are_refused() {
    let folder = Folder::new("reserved");
    for ending in ENDINGS {
        let (taken, free) = match *ending {
            "csv" => ("error", "error [m]"),
            "npy" => ("failed", "error"),
            _ => ("failed_because", "failed"),
        };
        let path = folder.path(&format!("runs.{ending}"));
        let text = three("it broke", taken).to(&path).run().unwrap_err().to_string();
        assert!(text.contains(&format!("`{taken}`")) && text.contains("another name"), "{text}");
        let in_memory = three("it broke", taken).run().unwrap();
        assert!(matches!(in_memory.write(&path), Err(EnsembleError::ColumnReserved { .. })));
        assert!(!path.exists());
        three("it broke", free).to(&path).run().unwrap();
        assert_eq!(EnsembleTable::read(&path).unwrap().failed().len(), 1);
    }
}

/// Files of other plans and of unknown origin are never overwritten, whoever writes.
#[test]
fn other_files_are_not_overwritten() {
    let folder = Folder::new("overwrite");
    for ending in ENDINGS {
        let path = folder.path(&format!("runs.{ending}"));
        three("it broke", "x").label("a").to(&path).run().unwrap();
        let before = bytes(&path);
        let other = three("it broke", "x").label("b").run().unwrap();
        let shard = folder.path(&format!("b.{ending}"));
        three("it broke", "x").label("b").to(&shard).shard(0, 1).run().unwrap();
        let shards = || [folder.path(&format!("b.{ending}.0-of-1"))];
        for error in [other.write(&path).unwrap_err(), merge(shards(), &path).unwrap_err()] {
            let text = error.to_string();
            assert!(text.contains("`label` is a there and b here"), "{text}");
        }
        assert_eq!(bytes(&path), before);
        // The same plan may be written again.
        EnsembleTable::read(&path).unwrap().write(&path).unwrap();
        assert_eq!(bytes(&path), before);
        let mine = folder.path(&format!("mine.{ending}"));
        std::fs::write(&mine, "my own\n").unwrap();
        assert!(other.write(&mine).is_err() && merge(shards(), &mine).is_err());
        assert_eq!(bytes(&mine), b"my own\n");
    }
    let left: Vec<String> = folder.names().into_iter().filter(|name| name.contains(".part")).collect();
    assert!(left.is_empty(), "{left:?}");
}
