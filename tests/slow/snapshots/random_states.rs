//! The models of `models.rs` with values, and random states of them: for tests that compare printed programs
//! with those in Rust.

use dynamics::model::{Energies, ModelState, PrintedInC, SimulationModel, Vector};
use dynamics::prelude::*;

use crate::models::*;
// The prelude has one, too.
use crate::models::{Contact, RigidBody};

/// States of each model.
pub(crate) const STATES: usize = 1000;

/// What is done with each model.
pub(crate) trait Visit {
    fn visit<M: SimulationModel + PrintedInC>(&mut self, model: &M);
    /// A model that has kinetic and potential energy.
    fn visit_with_energies<M: SimulationModel + PrintedInC + Energies>(&mut self, model: &M) {
        self.visit(model);
    }
}

/// Visits all models.
pub(crate) fn every_model(visitor: &mut impl Visit) {
    let track = CubicSpline::natural(&[-4.0, -1.0, 0.5, 2.0, 4.0], &[0.3, -0.2, 0.9, 0.1, 0.4]).unwrap();
    visitor.visit_with_energies(&Pendulum { m: 0.7, l: 1.3, g: 9.81, c: 0.2 });
    visitor.visit_with_energies(&DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 });
    visitor.visit_with_energies(&CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 });
    visitor.visit_with_energies(&SphericalPendulum { m: 0.4, l: 1.2, g: 9.81 });
    let (mass, length) = ([0.5, 0.4, 0.3, 0.2], [0.8, 0.7, 0.6, 0.5]);
    visitor.visit_with_energies(&Chain { cart: 2.0, mass, length, g: 9.81 });
    visitor.visit_with_energies(&Bead { m: 0.3, g: 9.81, track });
    visitor.visit_with_energies(&DrivenPivot { m: 0.2, l: 0.5, g: 9.81, amplitude: 0.03, omega: 40.0 });
    visitor.visit_with_energies(&Masses { m: [1.0, 2.0, 0.5], k: 30.0, c: 0.4 });
    visitor.visit_with_energies(&Contact { m: 0.5, k: 200.0, c: 1.0, gap: 0.1 });
    let (magnetic, electric) = ([0.1, 0.7, -0.4].into(), [0.3, 0.0, 0.2].into());
    visitor.visit(&Particle { mass: 1.7, charge: 0.8, magnetic, electric });
    visitor.visit_with_energies(&RigidBody { inertia: Mat3::diagonal(1.0, 2.0, 2.5) });
    visitor.visit_with_energies(&Ball { mass: 0.145, k: 8.8e-4, g: 9.81 });
    visitor.visit_with_energies(&Tube { m: 0.2, hub: 1.5 });
    visitor.visit_with_energies(&CartesianPendulum { m: 0.7, l: 1.3, g: 9.81 });
    visitor.visit_with_energies(&SliderCrank { m: [1.0, 2.0, 3.0], r: 0.5, l: 1.5, g: 9.81 });
    visitor.visit_with_energies(&Sleigh { m: 2.0, inertia: 0.3, ahead: 0.4 });
    visitor.visit_with_energies(&Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 });
}

/// Random states of a model, the same in every run.
pub(crate) fn random_states<M: SimulationModel>() -> Vec<M::State> {
    let mut numbers = Numbers::new(M::NAME);
    (0..STATES).map(|_| random_state::<M>(&mut numbers)).collect()
}

fn random_state<M: SimulationModel>(numbers: &mut Numbers) -> M::State {
    let (mut q, mut u) = (M::Vector::zeros(), M::Vector::zeros());
    q.as_mut_slice().iter_mut().for_each(|x| *x = numbers.between(-3.0, 3.0));
    u.as_mut_slice().iter_mut().for_each(|x| *x = numbers.between(-5.0, 5.0));
    let mut inputs = M::Inputs::zeros();
    inputs.as_mut_slice().iter_mut().for_each(|x| *x = numbers.between(-2.0, 2.0));
    M::State::new(numbers.between(0.0, 10.0), q, u, inputs)
}

/// Random numbers that depend on a name alone (SplitMix64).
pub(crate) struct Numbers(u64);

impl Numbers {
    pub(crate) fn new(name: &str) -> Self {
        Self(name.bytes().fold(0x9e37_79b9_7f4a_7c15, |seed, byte| {
            (seed ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        }))
    }

    /// Uniform between two numbers.
    pub(crate) fn between(&mut self, lo: f64, hi: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let bits = (z ^ (z >> 31)) >> 11;
        lo + (hi - lo) * bits as f64 / (1u64 << 53) as f64
    }
}
