//! Problems with known end values, from their Lagrangians.
//!
//! The end values were computed in multiple precision by two formulations and hold to all digits printed.

#[path = "../../../tests/models/arenstorf.rs"]
mod arenstorf;
#[path = "../../../tests/models/double_pendulum.rs"]
mod double_pendulum;
#[path = "../../../tests/models/kepler.rs"]
mod kepler;

use dynamics::prelude::*;

pub(crate) use arenstorf::Arenstorf;
pub(crate) use double_pendulum::DoublePendulum;
pub(crate) use kepler::Kepler;

/// A model with its start at t = 0, and q and u at the end.
pub(crate) struct Problem<M: Simulate> {
    pub(crate) name: &'static str,
    pub(crate) model: M,
    pub(crate) start: M::State,
    pub(crate) end: f64,
    pub(crate) reference: [f64; 4],
}

/// Levien, Tan, Am. J. Phys. 61 (1993) 1038.
pub(crate) fn double_pendulum() -> Problem<DoublePendulum> {
    use std::f64::consts::PI;
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.8 };
    Problem {
        name: "double pendulum, 5 s",
        start: model.state().theta1(2.0 * PI / 3.0).theta2(-PI / 18.0).build().expect("finite values"),
        model,
        end: 5.0,
        reference: [-0.44021974536666475, 7.049578950150241, -3.52113897832026, -3.9088281777737452],
    }
}

pub(crate) fn kepler() -> Problem<Kepler> {
    let model = Kepler { mu: 1.0 };
    Problem {
        name: "Kepler, e = 0.9, t = 20",
        start: model.state().x(0.1).y_rate(19f64.sqrt()).build().expect("finite values"),
        model,
        end: 20.0,
        reference: [-1.2952662509875743, 0.4003938963792322, -0.6775390924707566, -0.12708381542786862],
    }
}

pub(crate) fn arenstorf() -> Problem<Arenstorf> {
    let model = Arenstorf { mu: 0.012277471 };
    Problem {
        name: "Arenstorf, one period",
        start: model.state().x(0.994).y_rate(-2.0015851063790825).build().expect("finite values"),
        model,
        end: 17.065216560157964,
        reference: [0.994, 0.0, 0.0, -2.0015851063790825],
    }
}
