//! Models with families of coordinates: strings, bars, beams and lattices of any size.
//!
//! A family is an array of coordinates whose length is known when the program runs. The macro derives one
//! element of a sum and emits loops over elements; this crate moves what the loops describe. States lie on
//! the heap, one field after the other.
//!
//! [`model`] has the trait that the macro implements. A hand-written implementation is as good.
//! [`SimulateFamilies`] opens simulations, and has the longest step, equilibria, modes and waves.
//!
//! # Files
//!
//! | file | what it does |
//! |---|---|
//! | `simulation` | the builder of a simulation and its checks |
//! | `run` | the loop over steps: frames, limits, values that are not finite |
//! | `state` | states on the heap, and how they are given by name |
//! | `loops`, `generated` | what generated code is made of |
//! | `integrate/` | methods: Störmer–Verlet and its compositions, Runge–Kutta, implicit ones |
//! | `drift` | a drift and a kick in one pass over memory |
//! | `equations`, `mass` | accelerations from forces; M and its factors |
//! | `constraints`, `reaction` | multipliers, corrections onto constraints; reactions by name |
//! | `step_bound` | the longest step of a method |
//! | `record`, `file` | frames in memory and in files |
//! | `portable` | what live pages get of a model |
//! | `motion`, `summary`, `failure`, `error` | what a run leaves |
//! | `output` | tables, animations, pictures of a field over place and time |
//! | `tangent` | the matrix of implicit steps, equilibria and modes |
//! | `statics`, `continuation`, `modes`, `dispersion` | equilibria, branches of them, frequencies, waves |
//! | `linalg/` | banded matrices with a border |

mod constraints;
mod continuation;
mod dispersion;
mod drift;
mod equations;
mod error;
mod failure;
mod file;
#[doc(hidden)]
pub mod generated;
mod integrate;
mod linalg;
#[doc(hidden)]
pub mod loops;
mod mass;
#[doc(hidden)]
pub mod measured;
pub mod methods;
pub mod model;
mod modes;
mod motion;
mod output;
pub mod portable;
pub mod reaction;
mod record;
mod run;
mod simulation;
pub mod state;
mod statics;
mod step_bound;
mod summary;
mod tangent;

pub use constraints::ConstraintSummary;
pub use continuation::EquilibriumBranch;
pub use dispersion::FamilyBranch;
pub use error::FamilyError;
pub use failure::{FamilyErrorKind, FamilyMotionError};
pub use methods::FamilyMethod;
pub use modes::FamilyMode;
pub use motion::{FamilyMotion, Frame};
pub use record::Every;
pub use simulation::{FamilySimulation, InputRow, SimulateFamilies};
pub use statics::FamilyEquilibrium;
pub use summary::{FamilySummary, FamilyWarning, ShortWaves};
