//! The methods that [`FamilySimulation::method`](crate::FamilySimulation::method) takes.
//!
//! Those of the ordinary runtime have the same names; not all of them suit states on the heap.
//!
//! ```
//! # use dynamics_families as dynamics;
//! use dynamics::{FamilyMethod, methods};
//!
//! assert_eq!(FamilyMethod::from(methods::Dop853), FamilyMethod::Dop853);
//! ```

use core::fmt;

pub use dynamics_runtime::methods::{
    Composition4, Composition6, Composition8, Dop853, DormandPrince5, GeneralizedAlpha, Rk4, StormerVerlet,
};
use dynamics_runtime::simulate::Method;

/// The implicit midpoint rule, fixed step, order 2. Symplectic; keeps linear and quadratic invariants. Stable
/// at any step for linear models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ImplicitMidpoint;

/// Newmark's method with constant average acceleration (β = 1/4, γ = 1/2), implicit, fixed step, order 2.
/// Stable at any step for linear models, without damping of its own. Source: Newmark, J. Eng. Mech. Div. ASCE
/// 85 (1959) 67.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Newmark;

/// A method for models with families.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FamilyMethod {
    /// Störmer's and Verlet's method (leapfrog), fixed step.
    StormerVerlet,
    /// Five Verlet steps of order 4, fixed step.
    Composition4,
    /// Nine Verlet steps of order 6, fixed step.
    Composition6,
    /// Seventeen Verlet steps of order 8, fixed step.
    Composition8,
    /// The classical Runge–Kutta method of order 4, fixed step.
    Rk4,
    /// Dormand and Prince's method of order 5(4).
    DormandPrince5,
    /// Dormand and Prince's method of order 8(5,3).
    Dop853,
    /// The implicit midpoint rule, fixed step.
    ImplicitMidpoint,
    /// Newmark's method with constant average acceleration, implicit, fixed step.
    Newmark,
    /// The generalized-α method, implicit, fixed step.
    GeneralizedAlpha {
        /// ρ∞, from 0 to 1: the factor by which a step damps infinitely fast oscillations.
        rho: f64,
    },
}

impl FamilyMethod {
    /// Order of the step.
    #[must_use]
    pub const fn order(self) -> u32 {
        match self {
            Self::StormerVerlet | Self::ImplicitMidpoint | Self::Newmark | Self::GeneralizedAlpha { .. } => 2,
            Self::Composition4 | Self::Rk4 => 4,
            Self::DormandPrince5 => 5,
            Self::Composition6 => 6,
            Self::Composition8 | Self::Dop853 => 8,
        }
    }

    /// Whether the method estimates its error, so that it chooses its steps.
    #[must_use]
    pub const fn is_adaptive(self) -> bool {
        matches!(self, Self::DormandPrince5 | Self::Dop853)
    }

    /// Whether the method needs Q without velocities: its steps are kicks and drifts.
    pub(crate) const fn is_splitting(self) -> bool {
        matches!(self, Self::StormerVerlet | Self::Composition4 | Self::Composition6 | Self::Composition8)
    }

    /// Whether steps solve equations.
    pub(crate) const fn is_implicit(self) -> bool {
        matches!(self, Self::ImplicitMidpoint | Self::Newmark | Self::GeneralizedAlpha { .. })
    }

    /// h ω up to which oscillations without damping stay bounded; infinite for implicit methods.
    pub(crate) const fn stability_border(self) -> f64 {
        match self {
            Self::StormerVerlet => 2.0,
            Self::Composition4 => 2.7,
            Self::Composition6 => 2.5,
            Self::Composition8 => 3.1,
            // 2 √2.
            Self::Rk4 => 2.828_427_124_746_19,
            // Not on the imaginary axis from 0 on, but oscillations decay or grow by less than a step's
            // error.
            Self::DormandPrince5 => 3.25,
            Self::Dop853 => 6.1,
            Self::ImplicitMidpoint | Self::Newmark | Self::GeneralizedAlpha { .. } => f64::INFINITY,
        }
    }
}

impl fmt::Display for FamilyMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = match self {
            Self::StormerVerlet => Method::StormerVerlet,
            Self::Composition4 => Method::Composition4,
            Self::Composition6 => Method::Composition6,
            Self::Composition8 => Method::Composition8,
            Self::Rk4 => Method::Rk4,
            Self::DormandPrince5 => Method::DormandPrince5,
            Self::Dop853 => Method::Dop853,
            Self::GeneralizedAlpha { .. } => Method::GeneralizedAlpha,
            Self::ImplicitMidpoint => return f.pad("implicit midpoint (order 2)"),
            Self::Newmark => return f.pad("Newmark (order 2, implicit)"),
        };
        fmt::Display::fmt(&known, f)
    }
}

macro_rules! from {
    ($($name:ident)*) => {$(
        impl From<$name> for FamilyMethod {
            fn from(_: $name) -> Self {
                Self::$name
            }
        }
    )*};
}

from! {
    StormerVerlet Composition4 Composition6 Composition8 Rk4 DormandPrince5 Dop853 ImplicitMidpoint Newmark
}

impl From<GeneralizedAlpha> for FamilyMethod {
    fn from(GeneralizedAlpha { rho }: GeneralizedAlpha) -> Self {
        Self::GeneralizedAlpha { rho }
    }
}
