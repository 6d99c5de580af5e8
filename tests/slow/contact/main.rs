//! Contact, friction, switched constraints, and accelerations that jump.

mod corners;
mod friction;
mod kinks;
#[path = "../../models/parcel.rs"]
mod parcel;
mod rebounds;
mod switching;
#[path = "../../models/wheelset.rs"]
mod wheelset;
