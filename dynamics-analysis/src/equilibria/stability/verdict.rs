//! Verdicts of stability.

use alloc::vec::Vec;

use dynamics_runtime::model::Quantity;
use nalgebra::Complex;

use super::Eigenvalue;

/// Whether an equilibrium, or a steady motion, is stable, and on what evidence.
#[derive(Clone, Debug, PartialEq)]
pub struct Stability {
    /// The verdict.
    pub verdict: StabilityVerdict,
    /// ω², the least eigenvalue of the stiffness relative to the mass matrix, in 1/s², without gyroscopic
    /// terms and damping. It is negative if a mode diverges. `None` if nonholonomic constraints leave no such
    /// matrix.
    pub least_omega_squared: Option<f64>,
    /// The largest real part of an eigenvalue, in 1/s; not a number where nothing is left to move.
    pub abscissa: f64,
    /// The error that rounding may cause in it.
    pub uncertainty: f64,
    /// The change of the worst eigenvalue relative to that of the matrix: 1 at best, 10⁸ where two
    /// eigenvalues meet.
    pub conditioning: f64,
    /// The eigenvalues σ of small motions e^{σt}, in 1/s, by growing real part.
    pub eigenvalues: Vec<Complex<f64>>,
    /// Cyclic coordinates: they were left out, with their momenta held if these are conserved.
    pub ignorable: Vec<Quantity>,
}

/// What becomes of small disturbances.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StabilityVerdict {
    /// They stay small: energy is conserved, and least in this position (Dirichlet).
    Stable,
    /// They die out: all eigenvalues have negative real parts.
    AsymptoticallyStable,
    /// They stay small, and some may not die out: energy never grows and has its minimum here, but to first
    /// order no damper acts on one of the modes (Kelvin, Tait & Chetaev). Neglected terms may damp it.
    PartlyDamped {
        /// Its frequency, in rad/s.
        frequency: f64,
        /// The coordinate that moves most in it.
        coordinate: &'static str,
    },
    /// To first order they stay small, by gyroscopic forces alone: energy is not least here, and any damping
    /// will in the end destroy it (Thomson & Tait).
    GyroscopicallyStabilised,
    /// Linear theory does not decide.
    Marginal(Undecided),
    /// They grow without oscillation: a real eigenvalue is positive.
    Divergence {
        /// The eigenvalue, in 1/s.
        growth: f64,
        /// The coordinate that moves most.
        coordinate: &'static str,
    },
    /// They oscillate and grow.
    Flutter {
        /// The real part, in 1/s.
        growth: f64,
        /// The imaginary part, in rad/s.
        frequency: f64,
        /// The coordinate that moves most.
        coordinate: &'static str,
    },
}

/// Why linear theory does not decide.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Undecided {
    /// The stiffness vanishes along a direction, within its uncertainty: a buckling load, a fold, a continuum
    /// of equilibria.
    NothingResists {
        /// The coordinate that moves most in it.
        coordinate: &'static str,
    },
    /// A mode is neither damped nor driven to first order, and it is not known whether energy is conserved or
    /// never grows. Neglected terms decide.
    Swings {
        /// Its frequency, in rad/s.
        frequency: f64,
    },
    /// Two frequencies meet, to rounding: at the edge of flutter.
    FrequenciesMeet {
        /// The frequency, in rad/s.
        frequency: f64,
        /// The relative change of the eigenvalue over that of the matrix.
        conditioning: f64,
    },
}

impl Stability {
    pub(super) fn new(
        verdict: StabilityVerdict,
        least_omega_squared: Option<f64>,
        spectrum: &[Eigenvalue],
    ) -> Self {
        let worst = spectrum.iter().max_by(|x, y| x.value.re.total_cmp(&y.value.re));
        let mut eigenvalues: Vec<Complex<f64>> = spectrum.iter().map(|one| one.value).collect();
        eigenvalues.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
        Self {
            verdict,
            least_omega_squared,
            abscissa: worst.map_or(f64::NAN, |one| one.value.re),
            uncertainty: worst.map_or(0.0, |one| one.uncertainty),
            conditioning: spectrum.iter().map(|one| one.conditioning).fold(1.0, f64::max),
            eigenvalues,
            ignorable: Vec::new(),
        }
    }

    /// Whether small disturbances stay small: [`StabilityVerdict::Stable`],
    /// [`StabilityVerdict::PartlyDamped`] or [`StabilityVerdict::AsymptoticallyStable`]. For
    /// [`Self::ignorable`] coordinates this holds for their rates. The coordinates themselves drift: another
    /// push gives another rate.
    #[must_use]
    pub fn is_stable(&self) -> bool {
        matches!(
            self.verdict,
            StabilityVerdict::Stable
                | StabilityVerdict::PartlyDamped { .. }
                | StabilityVerdict::AsymptoticallyStable
        )
    }

    /// Whether some disturbances certainly grow: [`StabilityVerdict::Divergence`] or
    /// [`StabilityVerdict::Flutter`].
    #[must_use]
    pub fn is_unstable(&self) -> bool {
        matches!(self.verdict, StabilityVerdict::Divergence { .. } | StabilityVerdict::Flutter { .. })
    }
}
