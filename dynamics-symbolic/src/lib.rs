//! The engine of `dynamics`: from energies and forces, as an expression graph, to the programs that a solver
//! runs.
//!
//! The engine contains no tokens and no spans. Whoever builds a model tags its declarations with opaque
//! [`Origin`](graph::Origin)s, and every finding returns them. It can be used from a procedural macro, a
//! build script or at run time alike.
//!
//! Flow: [`graph`] ← [`calculus`] ← [`mechanics`] ← [`check`]; [`graph`] ← [`algebra`], [`schedule`];
//! [`schedule`] ← [`series`], [`text`].

pub mod algebra;
pub mod calculus;
pub mod check;
pub mod compile;
pub mod families;
pub mod graph;
pub mod mechanics;
pub mod schedule;
pub mod series;
pub mod text;
