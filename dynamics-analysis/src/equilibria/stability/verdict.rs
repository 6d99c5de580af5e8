//! What is said of stability.

use alloc::vec::Vec;

use dynamics_runtime::model::Quantity;
use nalgebra::Complex;

use super::Eigenvalue;

/// Whether an equilibrium, or a steady motion, is stable, and on what evidence.
#[derive(Clone, Debug, PartialEq)]
pub struct Stability {
    /// The verdict.
    pub verdict: StabilityVerdict,
    /// ω², the least eigenvalue of the stiffness against the mass matrix, in 1/s², negative where something
    /// falls over: of a mode without gyroscopic terms and damping. `None` where nonholonomic constraints
    /// leave no such matrix.
    pub least_omega_squared: Option<f64>,
    /// The largest real part of an eigenvalue, in 1/s; not a number where nothing is left to move.
    pub abscissa: f64,
    /// How far that may be off for rounding.
    pub uncertainty: f64,
    /// How many times more the worst eigenvalue moves than the matrix: 1 at best, 10⁸ where two meet.
    pub conditioning: f64,
    /// The eigenvalues σ of small motions e^{σt}, in 1/s, by growing real part.
    pub eigenvalues: Vec<Complex<f64>>,
    /// Coordinates on which nothing depends: they were left out, with their momenta held where these are
    /// kept.
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
    /// They stay small, and not all of them are known to die out: energy never grows and is least in this
    /// position, but to first order a mode reaches no damper (Kelvin, Tait & Chetaev). What is neglected may
    /// damp it.
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
    /// They grow without swinging: a real eigenvalue is positive.
    Divergence {
        /// It, in 1/s.
        growth: f64,
        /// The coordinate that moves most.
        coordinate: &'static str,
    },
    /// They grow swinging.
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
    /// The stiffness vanishes along a direction, to what is known of it: a buckling load, a fold, equilibria
    /// side by side.
    NothingResists {
        /// The coordinate that moves most in it.
        coordinate: &'static str,
    },
    /// Something swings, to first order neither damped nor driven, and energy is not known to be conserved,
    /// or never to grow: what is neglected decides.
    Swings {
        /// Its frequency, in rad/s.
        frequency: f64,
    },
    /// Two frequencies meet, to rounding: at the edge of flutter.
    FrequenciesMeet {
        /// The frequency, in rad/s.
        frequency: f64,
        /// How many times more it moves than the matrix.
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
            uncertainty: worst.map_or(0.0, |one| one.unsure),
            conditioning: spectrum.iter().map(|one| one.conditioning).fold(1.0, f64::max),
            eigenvalues,
            ignorable: Vec::new(),
        }
    }

    /// Whether small disturbances stay small: [`StabilityVerdict::Stable`],
    /// [`StabilityVerdict::PartlyDamped`] or [`StabilityVerdict::AsymptoticallyStable`]. Of
    /// [`Self::ignorable`] coordinates this is said of their rates; they themselves go on for ever, at
    /// another rate for another push.
    #[must_use]
    pub fn is_stable(&self) -> bool {
        matches!(
            self.verdict,
            StabilityVerdict::Stable
                | StabilityVerdict::PartlyDamped { .. }
                | StabilityVerdict::AsymptoticallyStable
        )
    }

    /// Whether some grow for sure: [`StabilityVerdict::Divergence`] or [`StabilityVerdict::Flutter`].
    #[must_use]
    pub fn is_unstable(&self) -> bool {
        matches!(self.verdict, StabilityVerdict::Divergence { .. } | StabilityVerdict::Flutter { .. })
    }
}
