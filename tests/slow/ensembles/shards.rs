//! Shards, joined, are one run.

use std::path::PathBuf;

use dynamics::ensembles::{EnsembleError, merge, merge_shards};

use super::{Folder, bytes, ensemble};

#[test]
fn sixteen_shards_are_one_run() {
    let folder = Folder::new("shards");
    for ending in super::files::ENDINGS {
        let (whole, path) = (folder.path(&format!("whole.{ending}")), folder.path(&format!("runs.{ending}")));
        ensemble().to(&whole).run().unwrap();
        let mut runs = 0;
        // In any order.
        for rank in (0..16).rev() {
            let table = ensemble().to(&path).shard(rank, 16).run().unwrap();
            assert!(table.rows().all(|(run, _)| run / 16 % 16 == rank));
            runs += table.len();
        }
        assert_eq!(runs, 300);
        assert!(!path.exists());
        let merged = merge_shards(&path, 16).unwrap();
        assert!(merged.overlaps.is_empty() && merged.table.len() == 300);
        assert_eq!(bytes(&path), bytes(&whole), "{ending}");
        // Parquet has its plan in itself.
        if *ending != "parquet" {
            let plan = |name: &str| bytes(folder.path(&format!("{name}.{ending}.plan.txt")));
            assert_eq!(plan("runs"), plan("whole"));
        }
    }
}

fn shards(folder: &Folder, ranks: usize, made: impl IntoIterator<Item = usize>) -> Vec<PathBuf> {
    let of = |rank| {
        ensemble().to(folder.path("runs.csv")).shard(rank, ranks).run().unwrap();
        folder.path(&format!("runs.csv.{rank}-of-{ranks}"))
    };
    made.into_iter().map(of).collect()
}

#[test]
fn gaps_are_named() {
    let folder = Folder::new("gaps");
    shards(&folder, 4, [0, 2]);
    let error = merge_shards(folder.path("runs.csv"), 4).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("runs 16 to 31, 48 to 63"), "{text}");
    assert!(text.contains("run shard 1 of 4, shard 3 of 4 again"), "{text}");
    assert!(!folder.path("runs.csv").exists());
    // A shard that was ended goes on.
    std::fs::remove_file(folder.path("runs.csv.2-of-4/000000006.block")).unwrap();
    let error = merge_shards(folder.path("runs.csv"), 4).unwrap_err().to_string();
    assert!(error.contains("shard 2 of 4") && error.contains("80 to 127"), "{error}");
    shards(&folder, 4, [1, 2, 3]);
    merge_shards(folder.path("runs.csv"), 4).unwrap();
}

#[test]
fn overlaps_are_named() {
    let folder = Folder::new("overlaps");
    let mut all = shards(&folder, 2, [0, 1]);
    all.extend(shards(&folder, 3, [1]));
    let to = folder.path("merged.csv");
    let merged = merge(&all, &to).unwrap();
    // Every third block of sixteen runs, from the second.
    assert_eq!(merged.overlaps[..2], [(16, 31), (64, 79)]);
    // The same runs with other results.
    let other = folder.path("other.csv");
    ensemble()
        .keep_ends(["theta2_end [rad]", "height"], |_, end| [end.theta2(), 1.0])
        .to(&other)
        .shard(0, 4)
        .run()
        .unwrap();
    all.push(folder.path("other.csv.0-of-4"));
    let error = merge(&all, &to).unwrap_err();
    assert!(matches!(&error, EnsembleError::Overlap { runs: (0, 15), .. }), "{error}");
}

#[test]
fn shards_of_other_plans_are_not_joined() {
    let folder = Folder::new("plans-of-shards");
    let mut all = shards(&folder, 2, [0]);
    ensemble().until(0.6).to(folder.path("b.csv")).shard(1, 2).run().unwrap();
    all.push(folder.path("b.csv.1-of-2"));
    let error = merge(&all, folder.path("merged.csv")).unwrap_err().to_string();
    assert!(error.contains("`option until` is 0.6 there and 0.5 here"), "{error}");
    let nothing: [&str; 0] = [];
    assert!(merge(nothing, folder.path("merged.csv")).is_err());
    let error = merge([folder.path("none")], folder.path("merged.csv")).unwrap_err().to_string();
    assert!(error.contains("not a folder of blocks"), "{error}");
    let error = merge_shards(folder.path("c.csv"), 2).unwrap_err().to_string();
    assert!(error.contains("c.csv.0-of-2"), "{error}");
}
