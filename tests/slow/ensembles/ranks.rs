//! Ranks of MPI: as many as there may be, the bytes are those of one process; a rank that dies loses its
//! block only. Needs `mpirun`, which `DYNAMICS_MPIRUN` names if it has another name.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

use dynamics::ensembles::{Ensemble, EnsembleError, EnsembleTable, Grid, Mpi, OpenEnsemble};

use super::double_pendulum::DoublePendulum;
use super::{Folder, MODEL, bytes, start};

/// The file that the ranks are to write; what they are to do besides.
const FILE: &str = "DYNAMICS_RANKS_FILE";
const TASK: &str = "DYNAMICS_RANKS_TASK";

/// 300 runs in 75 blocks; some of those with m1 = 0 fail.
fn ensemble() -> Ensemble<'static, DoublePendulum> {
    let angles = (0..20).map(|k| 0.14 * f64::from(k));
    let grid = Grid::new().over("theta1", angles).over("m1", (0..15).map(|k| 0.1 * f64::from(k)));
    MODEL.ensemble(start(), grid).until(0.2).tolerance(1e-6).block(4)
}

/// What a rank does; as a test it does nothing.
#[test]
fn rank() {
    let Some(path) = std::env::var_os(FILE).map(PathBuf::from) else { return };
    let mpi = Mpi::start().unwrap();
    let on = || ensemble().to(&path).on(&mpi);
    match std::env::var(TASK).as_deref() {
        Ok("die") => {
            let last = mpi.ranks() - 1;
            let rank = mpi.rank();
            let of = move |_: &DoublePendulum, start: dynamics::prelude::State<DoublePendulum>| {
                // So long that every rank gets blocks.
                std::thread::sleep(Duration::from_millis(2));
                if rank == last && start.theta1() > 1.0 {
                    std::process::abort();
                }
                [start.theta1()]
            };
            let angles = (0..300).map(|k| 0.01 * f64::from(k));
            let grid = Grid::new().over("theta1", angles);
            let _ = MODEL.ensemble(start(), grid).block(4).compute(["x"], of).to(&path).on(&mpi).run();
        }
        Ok("fail") => match on().fail_fast().run() {
            Err(EnsembleError::Run { .. } | EnsembleError::Rank { .. }) => println!("refused"),
            other => panic!("{other:?}"),
        },
        Ok("plan") => {
            // One rank has another plan, and refuses the folder of the others.
            std::thread::sleep(Duration::from_millis(if mpi.rank() == 1 { 300 } else { 0 }));
            let error = on().label(if mpi.rank() == 1 { "b" } else { "a" }).run().unwrap_err();
            assert!(
                matches!(error, EnsembleError::OtherPlan { .. } | EnsembleError::Rank { rank: 1 }),
                "{error}"
            );
            println!("refused");
        }
        Ok("names") => {
            // One rank asks for what is not there: the others do not wait for it.
            let name = if mpi.rank() == 1 { "theta9" } else { "theta1" };
            let grid = Grid::new().over(name, [0.1, 0.2]);
            let error = MODEL.ensemble(start(), grid).until(0.1).to(&path).on(&mpi).run().unwrap_err();
            assert!(matches!(error, EnsembleError::Variable(_) | EnsembleError::Rank { rank: 1 }), "{error}");
            println!("refused");
        }
        Ok("changed") => {
            // The file is complete, and of another plan than that of one rank.
            on().run().unwrap();
            let label = if mpi.rank() == 1 { on().label("b") } else { on() };
            let error = label.run().unwrap_err();
            assert!(
                matches!(error, EnsembleError::OtherPlan { .. } | EnsembleError::Rank { rank: 1 }),
                "{error}"
            );
            println!("refused");
        }
        _ => {
            let table = on().run().unwrap();
            assert!(table.len() == 300 && !table.failed().is_empty());
            // A second one in the same process: it is read.
            assert_eq!(on().run().unwrap().report().made, 0);
            let error = on().shard(0, 2).run().unwrap_err().to_string();
            assert!(error.contains("divides the runs by itself"), "{error}");
            assert!(matches!(ensemble().on(&mpi).run(), Err(EnsembleError::NoFile { .. })));
            assert!(Mpi::start().is_err());
        }
    }
}

fn run(ranks: usize, path: &Path, task: &str) -> Output {
    let mpirun = std::env::var("DYNAMICS_MPIRUN").unwrap_or_else(|_| "mpirun".into());
    let mut command = Command::new(mpirun);
    // As root and with more ranks than cores, as in containers.
    command.args(["--allow-run-as-root", "--oversubscribe", "-n", &ranks.to_string()]);
    command.args(["-x", FILE, "-x", TASK]).arg(std::env::current_exe().unwrap());
    command.args(["ranks::rank", "--exact", "--nocapture"]).env(FILE, path).env(TASK, task);
    command.output().expect("`mpirun` starts; `apt-get install openmpi-bin` installs it")
}

#[test]
fn ranks_write_the_bytes_of_one_process() {
    let folder = Folder::new("ranks");
    let whole = folder.path("whole.csv");
    let alone = ensemble().to(&whole).run().unwrap();
    for ranks in [1, 2, 4] {
        let path = folder.path(&format!("runs{ranks}.csv"));
        let output = run(ranks, &path, "write");
        assert!(output.status.success(), "{ranks}: {}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(bytes(&path), bytes(&whole), "{ranks} ranks");
        let read = EnsembleTable::read(&path).unwrap();
        assert_eq!(read.failed(), alone.failed());
    }
    assert!(!folder.names().iter().any(|name| name.contains("blocks") || name.contains("part")));
}

/// A rank dies in the middle: what the others had written stays, and one process makes the rest.
#[test]
fn a_rank_that_dies_loses_its_block_only() {
    let folder = Folder::new("dead-rank");
    let path = folder.path("runs.npy");
    let output = run(3, &path, "die");
    assert!(!output.status.success());
    let blocks = std::fs::read_dir(folder.path("runs.npy.blocks")).unwrap();
    let blocks =
        blocks.filter(|entry| entry.as_ref().unwrap().path().extension().is_some_and(|e| e == "block"));
    assert!(blocks.count() > 0);
    assert!(!path.exists());
    let angles = || Grid::new().over("theta1", (0..300).map(|k| 0.01 * f64::from(k)));
    let again = MODEL.ensemble(start(), angles()).block(4).compute(["x"], |_, start| [start.theta1()]);
    let again = again.to(&path).run().unwrap();
    assert!(again.report().made < 300 && again.report().damaged_blocks == 0, "{}", again.report());
    assert_eq!(again.column("x").unwrap(), again.column("theta1").unwrap());
}

/// An error of one rank ends all of them, none waits for ever.
#[test]
fn errors_end_all_ranks() {
    let folder = Folder::new("failing-ranks");
    for task in ["fail", "plan", "names", "changed"] {
        let path = folder.path(&format!("{task}.csv"));
        let output = run(3, &path, task);
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{task}: {text}{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(text.matches("refused").count(), 3, "{task}: {text}");
        assert_eq!(path.exists(), task == "changed");
    }
}
