//! Ensembles: the bits of single runs, whoever makes them; files that go on after a kill; shards; statistics
//! against closed forms.

mod cards;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
mod files;
mod kills;
#[cfg(feature = "mpi")]
mod ranks;
mod refused;
mod resume;
mod rows;
mod shards;
mod statistics;

use std::path::{Path, PathBuf};

use double_pendulum::DoublePendulum;
use dynamics::ensembles::{Ensemble, Grid, OpenEnsemble};
use dynamics::prelude::*;

const MODEL: DoublePendulum = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };

fn start() -> State<DoublePendulum> {
    MODEL.state().build().unwrap()
}

/// 12 × 25 starts; with m2 = 0 none of them moves.
fn grid() -> Grid {
    let angles = (0..12).map(|k| 0.25 * f64::from(k));
    Grid::new().over("theta1", angles).over("m2", (0..25).map(|k| 0.1 * f64::from(k)))
}

/// 300 runs in blocks of 16, of which those with a mass of 0 fail.
fn ensemble() -> Ensemble<'static, DoublePendulum> {
    let kept = MODEL.ensemble(start(), grid()).until(0.5).tolerance(1e-7).block(16);
    kept.keep_ends(["theta2_end [rad]", "height"], |model: &DoublePendulum, end: State<DoublePendulum>| {
        [end.theta2(), -model.l1 * end.theta1().cos()]
    })
}

/// A folder of a test of its own, empty.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("dynamics-ensembles-{test}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// The names in the folder, in order.
    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn bytes(path: impl AsRef<Path>) -> Vec<u8> {
    std::fs::read(path.as_ref()).unwrap()
}
