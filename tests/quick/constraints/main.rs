//! Constraints of derived models: singular positions, switched constraints, contacts, angles that lock.

#[path = "../../models/turning_trammel.rs"]
mod turning_trammel;

mod gimbal_lock;
mod handover;
mod one_row;
mod together;
mod trammel;
