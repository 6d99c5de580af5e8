//! A process that is killed at any moment, again and again: what it leaves goes on to the undisturbed file,
//! byte for byte. `KILLS=100` before the command makes a hundred.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use dynamics::ensembles::{Ensemble, Grid, OpenEnsemble};

use super::double_pendulum::DoublePendulum;
use super::{Folder, MODEL, bytes, start};

/// The file that a child is to write.
const FILE: &str = "DYNAMICS_ENSEMBLE_FILE";

/// 200 runs in 100 blocks; some of those with m1 = 0 fail.
fn ensemble() -> Ensemble<'static, DoublePendulum> {
    let angles = (0..20).map(|k| 0.14 * f64::from(k));
    let grid = Grid::new().over("theta1", angles).over("m1", (0..10).map(|k| 0.1 * f64::from(k)));
    MODEL.ensemble(start(), grid).until(0.2).tolerance(1e-6).block(2)
}

/// What a child does; as a test it does nothing.
#[test]
fn child() {
    if let Some(path) = std::env::var_os(FILE) {
        ensemble().to(PathBuf::from(path)).run().unwrap();
    }
}

fn begin(path: &Path) -> Child {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["kills::child", "--exact"]).env(FILE, path).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().unwrap()
}

#[test]
fn killed_runs_go_on_to_the_undisturbed_file() {
    let kills: u64 = std::env::var("KILLS").map_or(6, |text| text.parse().expect("a number of kills"));
    let folder = Folder::new("kills");
    let whole = folder.path("whole.csv");
    let begun = std::time::Instant::now();
    assert!(begin(&whole).wait().unwrap().success());
    let taken = begun.elapsed();
    let mut random = 9_u64;
    let (mut killed, mut kept_blocks, mut round) = (0, 0, 0);
    while killed < kills {
        let path = folder.path(&format!("runs{round}.csv"));
        round += 1;
        loop {
            let mut child = begin(&path);
            // A moment within the time of an undisturbed run, or a little more: then it ends.
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let part = (random >> 32) as f64 / f64::from(u32::MAX);
            std::thread::sleep(taken.mul_f64(1.1 * part));
            if let Some(status) = child.try_wait().unwrap() {
                assert!(status.success());
                break;
            }
            child.kill().unwrap();
            child.wait().unwrap();
            killed += 1;
            let blocks = std::fs::read_dir(folder.path(&format!("runs{}.csv.blocks", round - 1)));
            kept_blocks += blocks.map_or(0, Iterator::count);
        }
        assert_eq!(bytes(&path), bytes(&whole), "after {killed} kills");
        let plan = |path: &Path| bytes(format!("{}.plan.txt", path.display()));
        assert_eq!(plan(&path), plan(&whole), "after {killed} kills");
    }
    // Nothing is left over beside the files.
    let is_left = |name: &String| name.contains(".part") || name.contains(".blocks");
    assert!(!folder.names().iter().any(is_left), "{:?}", folder.names());
    // Kills met runs in the middle.
    assert!(kept_blocks > 0);
    println!("{killed} kills over {round} files, which had left {kept_blocks} blocks");
}
