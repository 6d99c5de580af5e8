//! Live pages: the programs in JavaScript and the scripts that move them in an engine without a browser, and
//! whole pages in a browser.

mod bits;
#[cfg(unix)]
mod browser;
mod constants;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
mod drawings;
mod engine;
mod families;
#[path = "../snapshots/models.rs"]
mod models;
mod motions;
mod player;
#[path = "../snapshots/random_states.rs"]
mod random_states;
mod rust;
#[cfg(unix)]
mod shown;

use dynamics::model::{Energies, PrintedInC, SimulationModel};
use random_states::{Visit, every_model};

/// Compares the programs of each model.
struct Compare(Vec<usize>);

impl Visit for Compare {
    fn visit<M: SimulationModel + PrintedInC>(&mut self, model: &M) {
        self.0.push(bits::compare(model, bits::alone));
    }
    fn visit_with_energies<M: SimulationModel + PrintedInC + Energies>(&mut self, model: &M) {
        self.0.push(bits::compare(model, bits::energies));
    }
}

#[test]
fn programs_have_the_bits_of_rust() {
    let mut compared = Compare(Vec::new());
    every_model(&mut compared);
    let Compare(compared) = compared;
    eprintln!("{} numbers of {} models", compared.iter().sum::<usize>(), compared.len());
    assert!(compared.iter().all(|&numbers| numbers > 1000), "{compared:?}");
}
