//! The expression graph: hash-consed, append-only. Every node carries its value at two random points modulo
//! 2⁶¹ − 31, its fingerprint.
//!
//! Equal fingerprints are one node. So zeros, constants, negations and sin² + cos² = 1 are found without
//! rewrite rules. Sines and cosines have values on a rational point of the circle that is additive in the
//! angle. Literals are exact rationals. A choice has the value w a + (1 − w) b of its branches, with a
//! random w of what decides. Other functions are opaque atoms.
//!
//! The first representative of a value wins, with four exceptions:
//!
//! * a form that can cancel gives way to one that cannot;
//! * a form with more kinds of symbols (q̈ − q̈ + q) gives way to one with fewer;
//! * anything but a choice gives way to a choice, because 0 · NaN of the branch that is not taken is not 0;
//! * anything gives way to a number.
//!
//! Constructors keep numbers outside of parameters, and parameters outside of the rest.
//!
//! Invariants: only `arena.rs` creates ids. A node's children have smaller ids than the node. A symbol has
//! one node, also in forms that are made afresh, because gradients ask for it. The one hash map cannot be
//! iterated.

mod arena;
mod build;
mod eval;
mod fingerprint;
mod functions;
mod id;
mod node;
mod node_map;
mod number;
mod sample;

pub use arena::Graph;
pub use eval::Bindings;
pub(crate) use eval::Tape;
pub use fingerprint::Fingerprint;
pub(crate) use fingerprint::P as MODULUS;
pub use id::{FunctionId, NodeId, Origin};
pub use node::{Binary, Comparison, Dependence, Node, Symbol, Unary};
pub(crate) use node_map::NodeMap;
pub use number::Number;
pub use sample::Sampler;
