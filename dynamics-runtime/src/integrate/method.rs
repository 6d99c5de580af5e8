//! The methods by name.

use crate::model::MAX_SERIES_ORDER;
use core::fmt;

/// The integration methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Method {
    /// The classical Runge–Kutta method of order 4, fixed step.
    Rk4,
    /// Dormand and Prince's method of order 5(4).
    DormandPrince5,
    /// Dormand and Prince's method of order 8(5,3).
    Dop853,
    /// Tsitouras's method of order 5(4).
    Tsit5,
    /// Verner's method of order 9(8).
    Verner9,
    /// Gragg's, Bulirsch's and Stoer's extrapolation of order 14(12), its columns side by side.
    GraggBulirschStoer,
    /// Radau IIA of order 5, implicit.
    Radau5,
    /// A diagonally implicit Runge–Kutta method of order 4(3).
    Esdirk4,
    /// Taylor series of adaptive order and step.
    Taylor,
    /// The semi-implicit Euler method, fixed step.
    SemiImplicitEuler,
    /// Störmer's and Verlet's method, fixed step.
    StormerVerlet,
    /// The same with holonomic constraints, fixed step.
    Rattle,
    /// Five Verlet steps of order 4, fixed step.
    Composition4,
    /// Nine Verlet steps of order 6, fixed step.
    Composition6,
    /// Seventeen Verlet steps of order 8, fixed step.
    Composition8,
    /// Gauss's collocation of order 4, implicit, fixed step.
    Gauss4,
    /// Gauss's collocation of order 6, implicit, fixed step.
    Gauss6,
    /// The midpoint rule that keeps the energy, implicit, fixed step.
    EnergyMidpoint,
    /// The generalized-α method with adjustable damping, implicit.
    GeneralizedAlpha,
    /// Euler's method, fixed step, for teaching.
    ExplicitEuler,
    /// Heun's method of order 2, fixed step, for teaching.
    Heun,
    /// Adams's and Bashforth's multistep method of order 2, fixed step, for teaching.
    AdamsBashforth2,
    /// The same of order 3.
    AdamsBashforth3,
    /// The same of order 4.
    AdamsBashforth4,
    /// No integration: positions from constraints that leave no degree of freedom ([`crate::kinematics`]).
    PositionAnalysis,
}

impl Method {
    /// Whether it is for stiff motions: implicit, with an error estimate without stiff components that have
    /// decayed.
    #[must_use]
    pub const fn is_for_stiff(self) -> bool {
        matches!(self, Self::Radau5 | Self::Esdirk4 | Self::GeneralizedAlpha)
    }

    /// Smallest tolerance at which truncation, and not rounding, determines the error estimate: iterations of
    /// implicit methods leave rounding errors of their own, weights of extrapolation multiply them.
    #[must_use]
    pub const fn finest_tolerance(self) -> f64 {
        if self.is_for_stiff() || matches!(self, Self::GraggBulirschStoer) { 1e-13 } else { 1e-14 }
    }

    /// Order of the step; of the interpolant for [`Method::PositionAnalysis`]; the highest one of Taylor
    /// series.
    #[must_use]
    pub const fn order(self) -> u32 {
        match self {
            Self::PositionAnalysis => 5,
            Self::SemiImplicitEuler | Self::ExplicitEuler => 1,
            Self::StormerVerlet | Self::Rattle | Self::EnergyMidpoint | Self::GeneralizedAlpha => 2,
            Self::Heun | Self::AdamsBashforth2 => 2,
            Self::AdamsBashforth3 => 3,
            Self::AdamsBashforth4 | Self::Rk4 | Self::Composition4 | Self::Gauss4 | Self::Esdirk4 => 4,
            Self::Composition6 | Self::Gauss6 => 6,
            Self::DormandPrince5 | Self::Tsit5 | Self::Radau5 => 5,
            Self::Dop853 | Self::Composition8 => 8,
            Self::Verner9 => 9,
            Self::GraggBulirschStoer => 14,
            Self::Taylor => MAX_SERIES_ORDER as u32,
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::PositionAnalysis => "Newton–Raphson on positions",
            Self::Rk4 => "RK4 (order 4)",
            Self::DormandPrince5 => "Dormand–Prince 5(4)",
            Self::Dop853 => "DOP853 (order 8)",
            Self::Tsit5 => "Tsitouras 5(4)",
            Self::Verner9 => "Verner 9(8)",
            Self::GraggBulirschStoer => "Gragg–Bulirsch–Stoer 14(12)",
            Self::Radau5 => "Radau IIA (order 5, implicit)",
            Self::Esdirk4 => "ESDIRK 4(3) (implicit)",
            Self::Taylor => "Taylor series",
            Self::SemiImplicitEuler => "semi-implicit Euler (order 1)",
            Self::StormerVerlet => "Störmer–Verlet (order 2)",
            Self::Rattle => "RATTLE (order 2)",
            Self::Composition4 => "composition of order 4",
            Self::Composition6 => "composition of order 6",
            Self::Composition8 => "composition of order 8",
            Self::Gauss4 => "Gauss (order 4, implicit)",
            Self::Gauss6 => "Gauss (order 6, implicit)",
            Self::EnergyMidpoint => "energy-conserving midpoint (order 2, implicit)",
            Self::GeneralizedAlpha => "generalized-α (order 2, implicit)",
            Self::ExplicitEuler => "Euler (order 1)",
            Self::Heun => "Heun (order 2)",
            Self::AdamsBashforth2 => "Adams–Bashforth (order 2)",
            Self::AdamsBashforth3 => "Adams–Bashforth (order 3)",
            Self::AdamsBashforth4 => "Adams–Bashforth (order 4)",
        })
    }
}
