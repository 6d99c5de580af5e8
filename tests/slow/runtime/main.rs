//! Motions of models written by hand that take long: warnings judged, estimated errors, switched constraints.

#[path = "../../../dynamics-runtime/tests/common/mod.rs"]
mod common;
mod constrained_motion;
mod doubts;
mod global_error;
mod judged;
mod references;
mod structure;
mod switching;
