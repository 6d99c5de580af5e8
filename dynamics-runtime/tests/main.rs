//! Methods, motions, constraints and driven mechanisms on models written by hand.

mod assembly;
mod between_steps;
mod common;
mod constrain;
mod events;
mod failures;
mod formulations;
mod generalized_alpha;
mod kinematics;
mod methods;
mod motion;
mod random_systems;
mod stiff;
