//! Simulations and the motions that they compute.
//!
//! `model.simulate(start)` ([`Simulate`]) opens a [`Simulation`], which takes the options and runs. The
//! result is a [`Motion`]: the accepted steps, and from them every state in between, outputs, energies,
//! events, the work of forces, and costs.
//!
//! A motion keeps the start of each step. The interpolant of a step is computed again where it is needed,
//! from the same stages, and so has the order of the method's dense output. A run computes interpolants only
//! where events are watched.

// Where to look, for whoever changes this folder:
//
// | question | file below `simulate/` |
// |---|---|
// | which options are there, and how are they checked? | `simulation.rs`, `simulation/check.rs` |
// | in which order does a run happen? | `simulation/execution.rs`, then `run.rs` |
// | where is a step rejected? | `integrate/stepper.rs`; the run gets accepted steps |
// | where does the tolerance reach the constraints? | `stabilization.rs`, `stabilization/projection.rs` |
// | what happens when a constraint loses rank? | `stabilization/singular_start.rs`, `run/monitors/` |
// | what happens at an event? | the table in `events.rs` |
// | how is a Zeno accumulation found? | `events/zeno.rs` |
// | which direction has contact friction? | `events/slip_direction.rs`, `events/unilateral.rs` |
// | where are forces that jump treated? | `right_hand_side/switching_functions.rs` |
// | where do I add a failure mode? | `run/monitors.rs`, `failure.rs` |
// | where do I add a warning? | `summary/checks.rs`, `verification/` |

pub(crate) mod charts;
pub(crate) mod device;
pub(crate) mod diagnosis;
pub(crate) mod ensemble;
pub(crate) mod erased_method;
pub(crate) mod events;
pub(crate) mod failure;
pub(crate) mod options;
pub(crate) mod pilot_run;
pub(crate) mod right_hand_side;
pub(crate) mod run;
pub(crate) mod simulation;
pub(crate) mod stabilization;
pub(crate) mod summary;
pub(crate) mod trajectory;
pub(crate) mod verification;

pub use crate::integrate::{Direction, Method};
pub use charts::{
    ChartChange, ChartError, ChartState, ChartSwitching, ChartSwitchingError, ChartSwitchingErrorKind,
    ChartSwitchingMotion, ChartSwitchingSimulation, ChartSwitchingSummary, Compared, Segment,
};
pub use device::{Batch, Device, DeviceEnds, Outcome, RunNumbers, can_be_on_device, ends_on};
pub use ensemble::ends;
pub use erased_method::AnyMethod;
pub use events::action::{EventAction, Impact};
pub use events::rules::Flow;
pub use failure::event_action::EventActionError;
pub use failure::gimbal_lock::GimbalLock;
pub use failure::{
    CrossingSettings, JumpingQuantity, MotionError, OptionError, SimulationErrorKind, SingularPositionCause,
};
pub use options::contact::Contact;
// Public for dynamics-families alone.
#[doc(hidden)]
pub use options::defaults::{DEFAULT_MAX_STEPS, DEFAULT_TOLERANCE};
pub use options::formulation::Formulation;
pub use pilot_run::FewDigits;
pub(crate) use right_hand_side::{InputLaw, with_inputs};
pub use simulation::{Simulate, Simulation};
pub use stabilization::StabilizationCounts;
pub use stabilization::near_singular::DriftInfluence;
pub use summary::warning::Warning;
pub use summary::{Drift, Summary};
pub use trajectory::error::SimulationError;
pub use trajectory::global_error::ReferenceSettings;
pub use trajectory::global_error::{ErrorFinding, EventShift, GlobalError, LargestDifference};
pub use trajectory::motion::{Motion, Sampler};
pub use trajectory::motion_record::MotionRecord;
pub use trajectory::record::{Counts, EventRecord};
pub use trajectory::work::{WorkAccount, WorkRow};
pub use verification::accuracy_diagnostics::{AccuracyDiagnostics, BelowRounding, Unchecked};
pub use verification::conditioning::{Conditioning, NearestSingularPosition};
pub use verification::constraint_drift::ConstraintDrift;
pub use verification::missed_instability::MissedInstability;
pub use verification::pivot_breakdown::PivotBreakdown;
pub use verification::undersampled_force::UndersampledForce;
