//! Simulations and the motions that they compute.
//!
//! `model.simulate(start)` ([`Simulate`]) opens a [`Simulation`], which takes the options and runs; the
//! result is a [`Motion`]: the accepted steps, and from them every state in between, outputs, energies,
//! events, the account of work, the costs.
//!
//! A motion keeps for each step only its start. The interpolant of a step is computed again where it is asked
//! for, with the same stages that made the step, and so has the method's own dense order; a run pays for it
//! only where events are watched.

mod atlas;
mod causes;
mod change;
mod conditioning;
mod crawl;
mod creep;
mod doubts;
mod drift;
mod driver;
mod edges;
mod error;
mod estimate;
mod fallen;
mod formulation;
mod functions;
mod guard;
mod halves;
mod jumps;
mod kept;
mod kinks;
mod leave;
mod locking;
mod missed;
pub(crate) mod numbers;
mod outgrown;
mod pace;
mod plant;
mod positions;
pub(crate) mod progress;
pub(crate) mod query;
pub(crate) mod record;
mod run;
mod second;
mod sides;
mod simulate;
mod singular;
mod sizes;
mod slide;
mod summary;
mod touching;
mod unseen;
mod upkeep;
mod watch;
mod work;
mod zeno;

pub use crate::integrate::{Direction, Method};
pub use atlas::{
    Atlas, AtlasError, AtlasErrorKind, AtlasMotion, AtlasSimulation, AtlasSummary, ChartChange, ChartError,
    Compared, Leg, Placed,
};
pub use change::{Change, ChangeError, Impact};
pub use conditioning::{Conditioning, Nearest};
pub use doubts::{BelowRounding, Doubts, Unchecked};
pub use drift::ConstraintDrift;
pub(crate) use driver::AnyDriver;
pub(crate) use error::suggest;
pub use error::{Jumping, Met, MotionError, OptionError, Over, SimulationError, SimulationErrorKind};
pub use estimate::{GlobalError, Largest, Shift};
pub use fallen::Vanished;
pub use formulation::Formulation;
pub use guard::Contact;
pub use locking::Locking;
pub use outgrown::Outgrown;
pub use pace::Turned;
pub(crate) use plant::{InputLaw, with_inputs};
pub use query::{Motion, Sampler};
pub use record::{Counts, EventRecord};
pub use second::SecondRun;
pub use simulate::{Simulate, Simulation};
pub use sizes::FewDigits;
pub use summary::{Drift, Summary};
pub use unseen::Unseen;
pub use upkeep::Upkept;
pub use watch::Flow;
pub use work::{WorkAccount, WorkRow};
