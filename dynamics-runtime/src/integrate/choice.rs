//! The methods that a simulation can be given, with their options.

use crate::integrate::{self, Scheme};
use crate::model::Vector;

/// A method with its options. Implement it for a [`Scheme`] of your own to use that in simulations.
pub trait Choice: Copy + Send + Sync + 'static {
    /// The method for phase vectors of this kind.
    type Scheme<V: Vector>: Scheme<V> + Send + Sync + 'static;
    /// Whether it needs [`Expandable::series`](integrate::Expandable::series).
    const NEEDS_SERIES: bool = false;
    /// The models for which the method has the properties of its documentation.
    const SUITS: Suits = Suits::Any;
    /// An option that has to be in a range: its name, its value, whether it is in the range, and the range in
    /// words, for models with constraints or without.
    fn option(&self, _constrained: bool) -> Option<(&'static str, f64, bool, &'static str)> {
        None
    }
    /// The method with these options.
    fn scheme<V: Vector>(&self) -> Self::Scheme<V>;
}

/// The models for which a method has its properties. A simulation returns an error for others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Suits {
    /// All.
    Any,
    /// All, with their constraints kept by projection.
    Projected,
    /// Those without constraints.
    Unconstrained,
    /// Those without constraints that conserve their energy.
    Conservative,
    /// Those without constraints whose M is constant and whose forces have no velocities.
    Separable,
    /// Those whose M is constant and whose forces have no velocities, with holonomic constraints or without.
    SeparableHolonomic,
}

/// Methods without options.
macro_rules! plain {
    ($($(#[$meaning:meta])* $name:ident $(: $suits:ident)?)*) => {$(
        $(#[$meaning])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        pub struct $name;

        impl Choice for $name {
            type Scheme<V: Vector> = integrate::$name<V>;
            $(const SUITS: Suits = Suits::$suits;)?
            #[inline]
            fn scheme<V: Vector>(&self) -> Self::Scheme<V> {
                Scheme::new()
            }
        }
    )*};
}

plain! {
    /// The classical Runge–Kutta method of order 4, with a fixed step: [`integrate::Rk4`].
    Rk4
    /// Dormand and Prince's method of order 5(4): [`integrate::DormandPrince5`].
    DormandPrince5
    /// Dormand and Prince's method of order 8(5,3): [`integrate::Dop853`].
    Dop853
    /// Tsitouras's method of order 5(4): [`integrate::Tsit5`].
    Tsit5
    /// Verner's method of order 9(8): [`integrate::Verner9`].
    Verner9
    /// Gragg's, Bulirsch's and Stoer's extrapolation of order 14(12), its columns side by side:
    /// [`integrate::GraggBulirschStoer`]. The fastest where accelerations take long and the model has code
    /// for four states at once ([`Dynamics::HAS_LANES`](crate::model::Dynamics::HAS_LANES)).
    GraggBulirschStoer
    /// The semi-implicit Euler method, with a fixed step, for real time: [`integrate::SemiImplicitEuler`].
    SemiImplicitEuler
    /// Störmer's and Verlet's method, symplectic, with a fixed step: [`integrate::StormerVerlet`]. For models
    /// without constraints whose mass matrix is constant and whose forces have no velocities.
    StormerVerlet: Separable
    /// The same with holonomic constraints: [`integrate::Rattle`]. Ends with an error at change points,
    /// positions where constraints lose rank; [`Dop853`] passes them.
    Rattle: SeparableHolonomic
    /// Störmer–Verlet composed to order 4: [`integrate::Composition4`].
    Composition4: Separable
    /// Störmer–Verlet composed to order 6: [`integrate::Composition6`].
    Composition6: Separable
    /// Störmer–Verlet composed to order 8: [`integrate::Composition8`].
    Composition8: Separable
    /// Gauss's collocation of order 4, symplectic, implicit, with a fixed step: [`integrate::Gauss4`]. For
    /// models without constraints.
    Gauss4: Unconstrained
    /// Gauss's collocation of order 6: [`integrate::Gauss6`].
    Gauss6: Unconstrained
    /// The midpoint rule that keeps the energy, implicit, with a fixed step: [`integrate::EnergyMidpoint`].
    /// For models without constraints that conserve it.
    EnergyMidpoint: Conservative
    /// Radau IIA of order 5, for stiff problems: [`integrate::Radau5`].
    Radau5
    /// A diagonally implicit method of order 4(3), for stiff problems at moderate accuracy:
    /// [`integrate::Esdirk4`].
    Esdirk4
    /// Euler's method, with a fixed step, for teaching: [`integrate::ExplicitEuler`]. An oscillation grows at
    /// every step size; [`SemiImplicitEuler`] costs the same and keeps it bounded.
    ExplicitEuler
    /// Heun's method of order 2, with a fixed step, for teaching: [`integrate::Heun`].
    Heun
    /// The multistep method of Adams and Bashforth of order 2, with a fixed step, for teaching:
    /// [`integrate::AdamsBashforth`].
    AdamsBashforth2
    /// The same of order 3.
    AdamsBashforth3
    /// The same of order 4.
    AdamsBashforth4
}

/// Taylor series of adaptive order and step: [`integrate::Taylor`]. For models whose motions the generated
/// code can expand ([`crate::model::Dynamics::SERIES`]), with inputs that are held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Taylor {
    /// The order of all steps, 4 to 30; chosen by the tolerance where it is not given.
    pub order: Option<usize>,
}

impl Choice for Taylor {
    type Scheme<V: Vector> = integrate::Taylor<V>;
    const NEEDS_SERIES: bool = true;
    fn option(&self, _: bool) -> Option<(&'static str, f64, bool, &'static str)> {
        let order = self.order?;
        let admissible = integrate::TAYLOR_ORDERS.contains(&order);
        Some(("order", order as f64, admissible, "an order from 4 to 30, or none"))
    }
    #[inline]
    fn scheme<V: Vector>(&self) -> Self::Scheme<V> {
        integrate::Taylor::of_order(self.order)
    }
}

/// The generalized-α method, implicit, which damps oscillations that are faster than its steps:
/// [`integrate::GeneralizedAlpha`]. For stiff and flexible models with constraints or without, with fixed
/// steps as a rule; constraints are kept by projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeneralizedAlpha {
    /// ρ∞, from 0 to 1: the factor by which a step damps infinitely fast oscillations. 1 damps nothing and is
    /// not for models with constraints, 0 all of it at once.
    pub rho: f64,
}

impl Default for GeneralizedAlpha {
    /// ρ∞ = 0.8.
    fn default() -> Self {
        Self { rho: 0.8 }
    }
}

impl Choice for GeneralizedAlpha {
    type Scheme<V: Vector> = integrate::GeneralizedAlpha<V>;
    const SUITS: Suits = Suits::Projected;
    fn option(&self, constrained: bool) -> Option<(&'static str, f64, bool, &'static str)> {
        let (good, admissible) = match constrained {
            false => ((0.0..=1.0).contains(&self.rho), "a factor from 0 to 1"),
            true => (
                (0.0..1.0).contains(&self.rho),
                "a factor from 0 to below 1, as nothing else damps errors of multipliers",
            ),
        };
        Some(("rho", self.rho, good, admissible))
    }
    #[inline]
    fn scheme<V: Vector>(&self) -> Self::Scheme<V> {
        integrate::GeneralizedAlpha::damping(self.rho)
    }
}
