//! Bodies on one another: joints in motion, trees of bodies, and bodies on which nothing acts from outside.

#[path = "../../models/arm7.rs"]
mod arm7;

mod arm;
mod isolated;
mod joints;
