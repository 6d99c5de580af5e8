//! The monitors of a run: one file for each failure mode of a motion or its method.
//!
//! To add one: write its file, add it to the list below and a letter to `in_turn!` at the end of
//! `monitor.rs`, which serves exactly as many monitors as it has letters. Give its failure a kind in
//! [`crate::simulate::failure`].

pub(crate) mod branch_identification;
pub(crate) mod cancellation;
pub(crate) mod constraint_drift;
pub(crate) mod progress_report;
pub(crate) mod singular_stall;
pub(crate) mod sliding_mode;
pub(crate) mod slip_reversal;
pub(crate) mod step_limit;
pub(crate) mod step_size_collapse;
pub(crate) mod stiffness_detection;

use branch_identification::BranchIdentification;
use cancellation::Cancellation;
use constraint_drift::DriftMonitor;
use progress_report::ProgressReport;
use singular_stall::SingularStall;
use sliding_mode::SlidingMode;
use slip_reversal::SlipReversalMonitor;
use step_limit::StepLimit;
use step_size_collapse::StepSizeCollapse;
use stiffness_detection::StiffnessDetection;

/// All monitors, in the order in which they are asked. The first error counts.
pub(crate) type Monitors<M> = (
    // Before a step.
    StepSizeCollapse,
    SingularStall,
    SlidingMode,
    StepLimit,
    Cancellation,
    // A step that is not recorded yet.
    DriftMonitor,
    SlipReversalMonitor,
    // After a step.
    ProgressReport,
    BranchIdentification<M>,
    StiffnessDetection<M>,
);
