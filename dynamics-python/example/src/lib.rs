//! Thirteen mechanisms as one Python module. Most are models of the folder `examples` of the library.

// Fields are documented where their names do not say enough, as in the library's examples.
#![allow(missing_docs)]

mod ball;
mod cart_pole;
mod chain;
mod charged_particle;
mod double_pendulum;
mod engine;
mod gyroscope;
mod roller_coaster;
mod rolling_coin;
mod satellite;
mod spring;
mod stick_slip;
mod tumbling_book;

dynamics_python::module!(
    /// Mechanisms whose equations of motion were derived when this module was compiled.
    mechanisms,
    ball::Ball,
    cart_pole::CartPole,
    chain::Chain,
    charged_particle::Particle,
    double_pendulum::DoublePendulum,
    engine::Engine,
    gyroscope::Gyroscope,
    roller_coaster::RollerCoaster,
    rolling_coin::Coin,
    satellite::Satellite,
    spring::Spring,
    stick_slip::Block,
    tumbling_book::Book,
);
