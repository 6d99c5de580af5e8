//! The expression graph: hash-consed, append-only, every node known by its value at two random points modulo
//! 2⁶¹ − 31.
//!
//! Equal fingerprints are one node, so zeros, constants, negations and sin² + cos² are found without rewrite
//! rules. Invariant: only `arena.rs` creates ids; a node's children have smaller ids than the node.

mod arena;
mod build;
mod eval;
mod fingerprint;
mod functions;
mod id;
mod node;
mod number;
mod sample;

pub use arena::Graph;
pub use eval::Bindings;
pub(crate) use eval::Tape;
pub use fingerprint::Fingerprint;
pub(crate) use fingerprint::P as MODULUS;
pub use id::{FunctionId, NodeId, Origin};
pub use node::{Binary, Comparison, Dependence, Node, Symbol, Unary};
pub use number::Number;
pub use sample::Sampler;
