//! Models with families of coordinates: strings, bars, beams and lattices of any size.
//!
//! A family is an array of coordinates whose length is known when the program runs. The macro derives one
//! element of a sum and emits loops over elements; this crate moves what the loops describe. States lie on
//! the heap, one field after the other.
//!
//! [`model`] has the trait that the macro implements. A hand-written implementation is as good.

#[doc(hidden)]
pub mod loops;
pub mod model;
pub mod state;
