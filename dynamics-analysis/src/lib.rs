//! The analyses of `dynamics`.
//!
//! Two analyses compare many runs: which method is the fastest for a required accuracy
//! ([`Analyze::work_precision`]), and which model of a scene suffices for it ([`compare`]). The others use
//! exact derivatives: small motions about an equilibrium or a steady motion ([`Analyze::linearize`]),
//! equilibria over a parameter ([`continuation`]), periodic and chaotic motions ([`Analyze::periodic`]),
//! sensitivities and fits of parameters ([`Vary`]). Users depend on the façade crate, which re-exports this
//! crate as `dynamics::analysis`.
//!
//! ```text
//! let methods = [methods::Dop853.into(), methods::DormandPrince5.into()];
//! let study = model.work_precision(start).until(10.0).methods(methods).run()?;
//! println!("{study}");
//! study.write_html("work_precision.html")?;
//! ```

extern crate alloc;

mod analyze;
mod backbone;
mod continuation;
mod displacement;
mod equilibria;
mod ladder;
mod linearize;
mod page;
mod parameters;
mod periodic;
mod random_numbers;
mod runs;
mod show;
mod table;
mod vibration;
mod work_precision;

pub use analyze::Analyze;
pub use backbone::{Backbone, BackboneCurve, BackboneError, BackbonePoint};
pub use continuation::{
    Branch, BranchEnd, Buckling, Continuation, ContinuationError, CriticalLoad, Diagram, Family, FoldCurve,
    FoldCurves, HopfCurve, HopfCurves, OfFolds, OfHopfPoints, PlaneCurve, PointOnBranch, SpecialKind,
    SpecialPoint, StabilityClass, continuation, fold_curve, hopf_curve,
};
pub use equilibria::{
    Equilibrium, EquilibriumError, EquilibriumSearch, EquilibriumSet, Stability, StabilityVerdict, Undecided,
};
pub use ladder::{Compared, Comparison, Difference, Ladder, LadderError, Rung, RungReport, Verdict, compare};
pub use linearize::{Linearization, LinearizeError, Mode};
pub use page::Page;
pub use parameters::{
    EquilibriumChange, Fit, FitError, Fitted, Fitting, FrequencyChange, Gradient, Loss, Objective, Outlier,
    Resampled, Residuals, RunFailure, Sensitivities, Sensitivity, SensitivityError, Sweep, SweepAxis,
    SweepError, Sweeping, Variable, VariableError, Vary,
};
pub use periodic::{
    Exponent, ExponentSign, Floquet, FloquetVerdict, Lyapunov, LyapunovExponents, Multiplier, PeriodicError,
    PeriodicOrbit, Poincare, Return, Section, Shooting, Threshold, Trivial,
};
/// What `dynamics-ensembles` shares with sweeps.
#[doc(hidden)]
pub mod shared {
    pub use crate::parameters::grid_indices;
    pub use crate::parameters::parallel::{ProgressBar, cores, shared, side_by_side_length};
    pub use crate::random_numbers::RandomNumbers;
}
pub use work_precision::{
    Cost, ErrorOf, Errors, OutsideError, Point, Reference, RunMeasurement, Study, WorkPrecision,
    WorkPrecisionCurve, WorkPrecisionError,
};

/// Complex numbers: what the Fourier transforms take, and eigenvalues.
pub use nalgebra::Complex;
pub use vibration::{
    Banded, BandedModel, Campbell, CriticalSpeed, Excitation, FrequencyResponse, Gain, Load,
    LogarithmicDecrement, LowestModes, Lqr, LqrDesign, ModeAnimation, NormalModes, Onset, Peak, Reach,
    ResponseEstimate, RotorMode, ShockResponseSpectrum, Signal, SignalUnavailable, Spectrum, StateSpace,
    TimeResponse, VibrationError, Window, convolve, fourier_transform, frequencies,
    inverse_fourier_transform, lowest_modes,
};
