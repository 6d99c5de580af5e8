//! Many runs of a model of `dynamics`: over grids and samples, on all cores, into files that go on after a
//! kill, with quantiles and the importance of inputs.
//!
//! Users depend on the façade crate, which re-exports this crate as `dynamics::ensembles`.
//!
//! ```text
//! let samples = Samples::sobol(4096).uniform("theta1", 1.0, 2.0).normal("l2", 1.0, 0.01);
//! let done = model.ensemble(start, samples.for_importance()).until(5.0).to("runs.npy").run()?;
//! println!("{}", done.quantile("end_theta2", 0.95)?);
//! println!("{}", done.importance("end_theta2")?);
//! ```

// Where to look, for whoever changes this crate:
//
// | question | file below `src/` |
// |---|---|
// | what varies between runs? | `inputs/`, one kind a file |
// | what do results depend on? | `ensemble/planning.rs`, `equations.rs`, `plan.rs` |
// | in which order does an ensemble happen? | `ensemble/execution.rs` |
// | how is a run made, and what is kept? | `runs.rs` |
// | who makes which block? | `places.rs`, `places/` |
// | what is a block, and when is it damaged? | `blocks.rs` |
// | how do blocks become one file? | `assembly.rs`, `files/`; of several machines: `shards.rs` |
// | what do the rows say? | `table.rs`, `statistics/` |

mod assembly;
mod blocks;
mod description;
mod ensemble;
mod equations;
mod error;
mod files;
mod hash;
mod inputs;
mod places;
mod plan;
mod report;
mod rows;
mod runs;
mod shards;
mod statistics;
mod table;
mod whole_file;

pub use ensemble::{Ensemble, KeptNumbers, OpenEnsemble};
pub use error::EnsembleError;
pub use inputs::{Grid, ImportanceDesign, InputError, Inputs, Points, Samples};
#[cfg(feature = "mpi")]
pub use places::Mpi;
pub use places::{Cores, Place, PlaceFor};
pub use plan::PlanDifference;
pub use report::EnsembleReport;
pub use rows::{EnsembleColumn, FailedRun};
pub use shards::{Merged, merge, merge_shards};
pub use statistics::{Importance, ImportanceOfInput, Mean, Quantile};
pub use table::EnsembleTable;
