//! Files read back as they were written, and are those of one run.

use dynamics::ensembles::{EnsembleError, EnsembleTable};

use super::{Folder, bytes, ensemble};

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
