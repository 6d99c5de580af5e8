//! Analyses of derived models: equilibria and their stability, branches, vibration, parameters, comparisons.

#[path = "../../models/ziegler.rs"]
mod ziegler;

mod corners;
mod hopf;
mod ladder;
mod later;
mod linearize_apart;
mod rotor;
mod routh;
mod steady;
mod words;
