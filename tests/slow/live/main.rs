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
mod rust;
#[cfg(unix)]
mod shown;

use dynamics::prelude::*;
use models::*;
// The prelude has one, too.
use models::{Contact, RigidBody};

#[test]
fn programs_have_the_bits_of_rust() {
    let track = CubicSpline::natural(&[-4.0, -1.0, 0.5, 2.0, 4.0], &[0.3, -0.2, 0.9, 0.1, 0.4]).unwrap();
    let compared = [
        bits::compare(&Pendulum { m: 0.7, l: 1.3, g: 9.81, c: 0.2 }, bits::energies),
        bits::compare(&DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 }, bits::energies),
        bits::compare(&CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 }, bits::energies),
        bits::compare(&SphericalPendulum { m: 0.4, l: 1.2, g: 9.81 }, bits::energies),
        bits::compare(
            &Chain { cart: 2.0, mass: [0.5, 0.4, 0.3, 0.2], length: [0.8, 0.7, 0.6, 0.5], g: 9.81 },
            bits::energies,
        ),
        bits::compare(&Bead { m: 0.3, g: 9.81, track }, bits::energies),
        bits::compare(&DrivenPivot { m: 0.2, l: 0.5, g: 9.81, amplitude: 0.03, omega: 40.0 }, bits::energies),
        bits::compare(&Masses { m: [1.0, 2.0, 0.5], k: 30.0, c: 0.4 }, bits::energies),
        bits::compare(&Contact { m: 0.5, k: 200.0, c: 1.0, gap: 0.1 }, bits::energies),
        bits::compare(
            &Particle {
                mass: 1.7,
                charge: 0.8,
                magnetic: [0.1, 0.7, -0.4].into(),
                electric: [0.3, 0.0, 0.2].into(),
            },
            bits::alone,
        ),
        bits::compare(&RigidBody { inertia: Mat3::diagonal(1.0, 2.0, 2.5) }, bits::energies),
        bits::compare(&Ball { mass: 0.145, k: 8.8e-4, g: 9.81 }, bits::energies),
        bits::compare(&Tube { m: 0.2, hub: 1.5 }, bits::energies),
        bits::compare(&CartesianPendulum { m: 0.7, l: 1.3, g: 9.81 }, bits::energies),
        bits::compare(&SliderCrank { m: [1.0, 2.0, 3.0], r: 0.5, l: 1.5, g: 9.81 }, bits::energies),
        bits::compare(&Sleigh { m: 2.0, inertia: 0.3, ahead: 0.4 }, bits::energies),
        bits::compare(&Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 }, bits::energies),
    ];
    eprintln!("{} numbers of {} models", compared.iter().sum::<usize>(), compared.len());
    assert!(compared.iter().all(|&numbers| numbers > 1000), "{compared:?}");
}
