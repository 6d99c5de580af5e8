//! Models with families of coordinates, whose number is known when the program runs.
//!
//! Energies of such models are sums over an index. What is derived is one element of each sum: its forces,
//! its inertia, its stiffness. The graph holds an element's own symbols: `s[i]` and `s[i + 1]` are two
//! coordinates of it, wherever i is. A back end prints loops over i. The nodes of a grid have two indices,
//! and their elements two loops, one inside the other.
//!
//! Flow: `model`, `slopes` ← `rows`, `index_free`, `springs` ← `derive` ← `shift` ← `dispersion` ← `text`;
//! `derive` ← `gathering` ← `javascript`; `derive` ← `verify`. `verify` compares the elements, put
//! together, with the same model unrolled at small counts, which went through the whole pipeline of ordinary
//! models.

mod derive;
mod dispersion;
mod gathering;
mod index_free;
mod javascript;
mod model;
mod rows;
mod shift;
mod slopes;
mod springs;
mod text;
mod verify;

pub use derive::{Derived, Element, Gathering, NoElement, derive};
pub use gathering::{Given, buffers, gathered, is_cheap};
pub use javascript::{FamilyPortability, javascript};
pub use model::{
    Anchor, Axis, FamilyConstraint, FamilyModel, Field, Local, Multiplier, NodeIndex, Range, Rounds, RowPart,
    Shown, ShownPart, Source, Term, TermKind,
};
pub use rows::{RowElement, RowTerm};
pub use shift::interior_forces;
pub use text::{FamilyEquations, equations, operations, report};
pub use verify::{Mismatch, verify};
