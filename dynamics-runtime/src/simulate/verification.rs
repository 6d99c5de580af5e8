//! Verification of a motion after its run: accuracy, conditioning and drift, one check per file.

pub(crate) mod accuracy_diagnostics;
pub(crate) mod conditioning;
pub(crate) mod constraint_drift;
pub(crate) mod gimbal_lock;
pub(crate) mod global_error;
pub(crate) mod missed_instability;
pub(crate) mod pivot_breakdown;
pub(crate) mod reference_run;
pub(crate) mod singular_point_validation;
pub(crate) mod step_doubling;
pub(crate) mod stiffness;
pub(crate) mod undersampled_force;
