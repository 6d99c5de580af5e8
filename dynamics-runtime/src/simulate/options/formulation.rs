//! The formulation of a simulation: how it keeps its constraints. `stabilization.rs` carries it out.

use alloc::format;
use alloc::string::ToString;
use core::fmt;

/// How a simulation keeps the constraints of its model. All formulations solve M q̈ = Q + Φ_qᵀλ, Φ_q
/// q̈ = γ at every evaluation. They differ in how they treat the errors that steps leave in Φ and Φ̇.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Formulation {
    /// Index-1 equations without stabilization: Φ̈ = 0, so that errors of Φ̇ remain and those of Φ grow
    /// with time. Drift is reported, and ends the simulation where it exceeds
    /// [`Simulation::drift_limit`](crate::simulate::Simulation::drift_limit).
    Augmented,
    /// Φ̈ + 2αΦ̇ + β²Φ = 0: errors fade at the rates −α ± √(α² − β²), equally fast at
    /// α = β. The method integrates these rates, so h·|rate| has to stay within its region of stability:
    /// 2.8 for RK4, 3.3 for Dormand–Prince 5(4), 6.1 for DOP853 on the real axis. Rows of nonholonomic
    /// constraints get A q̈ = γ − 2α(A q̇ + b). In a run backwards in time α counts negative, so that
    /// errors fade there too. Source: Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1.
    Baumgarte {
        /// α, 1/time.
        alpha: f64,
        /// β, 1/time.
        beta: f64,
    },
    /// Baumgarte with gains tied to the step h: α = 3/(4h), β = 1/h, with a correction that is computed at
    /// the start of each step and constant within it. The step then maps (Φ, hΦ̇) by [[½, ¼], [−1,
    /// −½]], which is nilpotent: errors vanish after two steps of one size. Nothing is fed back within the
    /// step, so its stability and order do not suffer. (Fed back at every stage, gains of 1/h would reduce
    /// the order of any Runge–Kutta method to that of its stages.) The drift of the last two steps remains.
    /// Where steps become much shorter, as at an event or where accelerations are not smooth, the gains grow
    /// more slowly: velocities that correct the drift in a very short step would be the larger error.
    BaumgarteTied,
    /// After every step, positions are projected onto Φ = 0 along M⁻¹Φ_qᵀ and velocities onto Φ̇ = 0
    /// (Gauss's least constraint), to rounding level. This costs one or two corrections per step, and needs
    /// no gains. Source: Lubich, BIT 31 (1991) 545; Eich, SIAM J. Numer. Anal. 30 (1993) 1467.
    Projected,
    /// Minimal coordinates, chosen anew at every state: positions and velocities are projected wherever
    /// accelerations are evaluated, and after every step. The independent coordinates are the directions that
    /// the constraints leave free at the state. The dependent ones, along M⁻¹Φ_qᵀ, are solved for loop
    /// by loop by generated code. Where one of its blocks has degraded the general solver chooses new pivots,
    /// which is counted.
    ///
    /// A motion is as accurate as one of minimal coordinates at the same tolerance, and takes up to four
    /// times as long as [`Projected`](Self::Projected) on chains of links. Forces and inputs are evaluated at
    /// states that fulfil the constraints, except near singular positions, where rounding would decide the
    /// state. Independent coordinates that are kept for longer are less accurate where they turn round within
    /// few steps: up to two thousand times if they are some of the coordinates (Wehage, Haug, J. Mech. Des.
    /// 104 (1982) 247, as [`Embedding`](crate::constrain::Embedding) chooses them), up to seventy times if
    /// they are the free directions at the start of the step (Potra, Yen, Mech. Struct. Mach. 19 (1991) 77).
    /// Source: Hairer, Lubich, Wanner, Geometric Numerical Integration, IV.4 and IV.5.
    Embedded,
}

impl Formulation {
    /// Whether Φ and Φ̇ are at rounding level after every step.
    #[must_use]
    pub const fn is_exact(self) -> bool {
        matches!(self, Self::Projected | Self::Embedded)
    }
}

impl fmt::Display for Formulation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&match self {
            Self::Augmented => "augmented".to_string(),
            Self::Baumgarte { alpha, beta } => format!("Baumgarte, α = {alpha}, β = {beta}"),
            Self::BaumgarteTied => "Baumgarte, gains tied to the step".to_string(),
            Self::Projected => "projected".to_string(),
            Self::Embedded => "embedded".to_string(),
        })
    }
}
