//! How a simulation keeps its constraints.

use alloc::format;
use alloc::string::ToString;
use core::fmt;

/// How a simulation keeps the constraints of its model. All of them solve M q̈ = Q + Φ_qᵀλ, Φ_q q̈ = γ at
/// every evaluation; they differ in what becomes of the errors that every step leaves in Φ and Φ̇.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Formulation {
    /// Index-1 equations as they are: Φ̈ = 0, so that errors of Φ̇ stay and those of Φ grow with time. Drift
    /// is reported, and ends the simulation where it exceeds
    /// [`Simulation::drift_limit`](crate::simulate::Simulation::drift_limit).
    Augmented,
    /// Φ̈ + 2αΦ̇ + β²Φ = 0: errors fade at the rates −α ± √(α² − β²), equally fast at α = β. A method takes
    /// them for motions, so h·|rate| has to stay within its region of stability: 2.8 for RK4, 3.3 for
    /// Dormand–Prince 5(4), 6.1 for DOP853 on the real axis; rows of nonholonomic constraints get A q̈ = γ −
    /// 2α(A q̇ + b). In a run back in time α counts negative, so that errors fade there too. Source:
    /// Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1.
    Baumgarte {
        /// α, 1/time.
        alpha: f64,
        /// β, 1/time.
        beta: f64,
    },
    /// Baumgarte with gains tied to the step h: α = 3/(4h), β = 1/h, taken at the start of each step and held
    /// during it. Then the step maps (Φ, hΦ̇) by [[½, ¼], [−1, −½]], which is nilpotent: errors are gone
    /// after two steps of one size, whatever that is, and as nothing is fed back within the step, neither its
    /// stability nor its order suffer. (Fed back at every stage, gains of 1/h bring the order of any
    /// Runge–Kutta method down to that of its stages.) What is left is the drift of the last two steps. Where
    /// steps become much shorter, as they end at an event or where accelerations are not smooth, gains follow
    /// them no faster than time goes on: velocities that take back in no time what has drifted would be the
    /// larger error.
    BaumgarteTied,
    /// After every accepted step positions are projected onto Φ = 0 along M⁻¹Φ_qᵀ and velocities onto Φ̇ = 0
    /// (Gauss's least constraint), to rounding level. Costs one correction or two per step, and needs no
    /// gains. Source: Lubich, BIT 31 (1991) 545; Eich, SIAM J. Numer. Anal. 30 (1993) 1467.
    Projected,
    /// Minimal coordinates, those of every state: wherever accelerations are evaluated, and after every step,
    /// positions and velocities are put onto the constraints. What leads are the directions that the
    /// constraints leave free there, and what depends on them, along M⁻¹Φ_qᵀ, is solved for: loop by loop by
    /// generated code, and where one of its blocks has degraded by pivots that the general solver chooses
    /// anew, which is counted. A motion is as accurate as one of minimal coordinates at the same tolerance,
    /// on links in up to four times the time of [`Projected`](Self::Projected); no force and no input sees a
    /// state that the constraints exclude, but beside singular positions, where rounding would decide where
    /// they lie. What leads for longer is less accurate where it turns round within few steps: some of the
    /// coordinates themselves (Wehage, Haug, J. Mech. Des. 104 (1982) 247, as
    /// [`Embedding`](crate::constrain::Embedding) chooses them) up to two thousand times, directions that
    /// were free at the start of the step (Potra, Yen, Mech. Struct. Mach. 19 (1991) 77) up to seventy times.
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
