//! Integrators for q̈ = a(t, q, u), u = q̇: one method per file, none of them allocates.
//!
//! A [`Stepper`] drives a [`Scheme`] (the method) over a [`System`] (what is integrated): it chooses the
//! step, repeats rejected steps, watches for stiffness and hands out the dense output of the step just made.
//! It needs neither `alloc` nor `std`.
//!
//! | method | order | dense output | evaluations per step | error estimate |
//! |---|---|---|---|---|
//! | [`Rk4`] | 4 | quintic Hermite, 4 | 4 | none: fixed step |
//! | [`DormandPrince5`] | 5 | 4 | 6 (+ 1 reused) | embedded 4th order |
//! | [`Dop853`] | 8 | 7 | 12 (+ 3 for dense output) | embedded 5th and 3rd order |
//! | [`Tsit5`] | 5 | 4 | 6 (+ 1 reused) | embedded 4th order |
//! | [`Verner9`] | 9 | 8 | 16 (+ 4 for dense output) | embedded 8th order |
//! | [`GraggBulirschStoer`] | 14 | 11 | 13 of four states side by side and 1 (+ 14 of four for dense output) | six columns of seven, 12th order |
//! | [`Radau5`] | 5 | 3 (u), 4 (q) | implicit: 3 per Newton iteration, 1 or 2 more | filtered, 3rd order |
//! | [`Esdirk4`] | 4 | quintic Hermite, 4 | implicit: 5 per round of Newton iterations | filtered, 3rd order |
//! | [`SemiImplicitEuler`] | 1 | quintic Hermite, 1 | 1 | none: fixed step |
//! | [`StormerVerlet`], [`Rattle`] | 2 | quintic Hermite, 2 | 1 | none: fixed step; symplectic |
//! | [`Composition4`], [`Composition6`], [`Composition8`] | 4, 6, 8 | quintic Hermite, 4 | 5, 9, 17 | none: fixed step; symplectic |
//! | [`Gauss4`], [`Gauss6`] | 4, 6 | quintic Hermite, 4 | implicit: 2, 3 per iteration, 1 more | none: fixed step; symplectic |
//! | [`GeneralizedAlpha`] | 2 | quintic Hermite, 2 | implicit: 1 per iteration, 1 more with constraints | parabola through q̈, 3rd order |
//! | [`EnergyMidpoint`] | 2 | quintic Hermite, 2 | implicit: 1 per iteration, 1 more | none: fixed step; keeps energy |
//! | [`Taylor`] | by tolerance, to 30 | the same | 1, and a series | last two terms |
//!
//! The second-order structure is used where it is free: the velocity part of every stage derivative *is* the
//! stage velocity, so only accelerations are evaluated.

mod root;
#[macro_use]
mod dense;

#[cfg(feature = "alloc")]
pub mod choice;
mod compensated_summation;
mod composition;
mod controller;
mod differences;
mod discontinuity;
mod dop853;
mod dop853_table;
mod dormand_prince5;
mod energy_midpoint;
mod esdirk4;
mod event;
mod first_step;
mod fixed_point;
mod gauss;
mod generalized_alpha;
mod gragg_bulirsch_stoer;
pub(crate) mod linear;
mod radau5;
mod rk4;
mod rough_powers;
mod semi_implicit_euler;
mod stepper;
mod stormer_verlet;
mod tableau;
mod taylor;
#[cfg(test)]
pub(crate) mod trees;
mod tsit5;
mod verner9;
pub mod verner9_table;

use core::fmt;

use crate::lanes::{Lanes, Wide};
use crate::model::{MOST_SERIES_ORDER, Vector};

pub use composition::{Composition, Composition4, Composition6, Composition8};
pub use controller::{Controller, ControllerSettings};
pub use dense::{Dense, Hermite, Nested};
#[cfg(feature = "alloc")]
pub(crate) use differences::{by_state, increment};
pub use dop853::Dop853;
pub use dormand_prince5::DormandPrince5;
pub use energy_midpoint::EnergyMidpoint;
pub use esdirk4::Esdirk4;
pub use event::{Crossing, Direction, Scan, ScanError, place};
pub use gauss::{Gauss, Gauss4, Gauss6};
pub use generalized_alpha::GeneralizedAlpha;
pub use gragg_bulirsch_stoer::{GraggBulirschStoer, Knots};
pub use radau5::{Between, Collocation, Radau5};
pub use rk4::Rk4;
pub use root::root;
pub use semi_implicit_euler::SemiImplicitEuler;
pub use stepper::{Step, StepError, StepFlags, StepOptions, Stepper};
pub use stormer_verlet::{Rattle, StormerVerlet};
#[cfg(feature = "alloc")]
pub(crate) use tableau::zip;
pub use tableau::{Row, Tolerances};
#[cfg(feature = "alloc")]
pub(crate) use taylor::ORDERS as TAYLOR_ORDERS;
pub use taylor::{Series, Taylor};
pub use tsit5::Tsit5;
pub use verner9::Verner9;

/// A point (q, u) of phase space, or a derivative (q̇, u̇) there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase<V> {
    /// Generalized coordinates, or q̇ in a derivative.
    pub q: V,
    /// Generalized velocities, or q̈ in a derivative.
    pub u: V,
}

impl<V: Vector> Phase<V> {
    /// Both parts zero.
    #[must_use]
    pub fn zeros() -> Self {
        Self { q: V::zeros(), u: V::zeros() }
    }

    /// Whether every element is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let finite = |v: &V| v.as_slice().iter().all(|x| x.is_finite());
        finite(&self.q) && finite(&self.u)
    }
}

/// Four phases side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stages<V: Vector> {
    /// Generalized coordinates; q̇ in derivatives.
    pub q: V::Wide,
    /// Generalized velocities; q̈ in derivatives.
    pub u: V::Wide,
}

impl<V: Vector> Stages<V> {
    /// All zero.
    #[inline(always)]
    #[must_use]
    pub fn zeros() -> Self {
        Self { q: V::Wide::zeros(), u: V::Wide::zeros() }
    }
    /// The phase in one lane.
    #[inline(always)]
    #[must_use]
    pub fn of(&self, lane: usize) -> Phase<V> {
        let mut phase = Phase::<V>::zeros();
        for i in 0..V::LEN {
            phase.q[i] = self.q.as_slice()[i].to_array()[lane];
            phase.u[i] = self.u.as_slice()[i].to_array()[lane];
        }
        phase
    }
    /// Puts a phase into one lane.
    #[inline(always)]
    pub fn put(&mut self, lane: usize, phase: &Phase<V>) {
        let set = |lanes: &mut Lanes, x| {
            let mut array = lanes.to_array();
            array[lane] = x;
            *lanes = Lanes::new(array);
        };
        for i in 0..V::LEN {
            set(&mut self.q.as_mut_slice()[i], phase.q[i]);
            set(&mut self.u.as_mut_slice()[i], phase.u[i]);
        }
    }
}

/// [`System::derivatives`] of stages that cannot be evaluated at once.
#[inline(always)]
pub(crate) fn one_by_one<V: Vector, S: System<V> + ?Sized>(
    system: &mut S,
    t: Lanes,
    y: &Stages<V>,
    derivatives: &mut Stages<V>,
) -> Result<(), S::Error> {
    for (lane, t) in t.to_array().into_iter().enumerate() {
        derivatives.put(lane, &system.derivative(t, &y.of(lane))?);
    }
    Ok(())
}

/// What is integrated: q̈ = a(t, q, u).
pub trait System<V: Vector> {
    /// Why q̈ does not exist at a state.
    type Error;
    /// Nothing holds it, so that what is about constraints below is neither asked nor compiled.
    const IS_FREE: bool = false;
    /// Its accelerations have no branches, so that what is about kinks and branches below is neither asked
    /// nor compiled.
    const IS_SMOOTH: bool = false;
    /// q̈ at time t for coordinates q and velocities u = q̇.
    fn accelerations(&mut self, t: f64, q: &V, u: &V) -> Result<V, Self::Error>;
    /// (q̇, q̈) at a stage. q̇ is u, unless the system says that u has to be another: velocities that
    /// constraints determine.
    #[inline(always)]
    fn derivative(&mut self, t: f64, y: &Phase<V>) -> Result<Phase<V>, Self::Error> {
        let u = self.accelerations(t, &y.q, &y.u)?;
        Ok(Phase { q: y.u, u })
    }
    /// Writes (q̇, q̈) at four stages side by side, as [`System::derivative`] has each of them, and by it
    /// where the system cannot evaluate them at once.
    #[inline(always)]
    fn derivatives(
        &mut self,
        t: Lanes,
        y: &Stages<V>,
        derivatives: &mut Stages<V>,
    ) -> Result<(), Self::Error> {
        one_by_one(self, t, y, derivatives)
    }
    /// ∂q̈/∂q and ∂q̈/∂q̇ at a point, N×N by rows, for methods that solve for their stages. By differences,
    /// where the system knows no better.
    fn jacobian(&mut self, at: &StepNode<V>, by_q: &mut [f64], by_u: &mut [f64]) -> Result<(), Self::Error> {
        differences::by_state(at, by_q, by_u, |y| self.accelerations(at.t, &y.q, &y.u))
    }
    /// Is told before every attempt where the step starts and how long it is, with its sign. Where the
    /// accelerations depend on the step, those of the start, its first stage, become those of this one.
    #[inline(always)]
    fn attempting(&mut self, _start: &mut StepNode<V>, _h: f64) -> Result<(), Self::Error> {
        Ok(())
    }
    /// Whether something holds it: constraints.
    #[inline(always)]
    fn is_held(&self) -> bool {
        false
    }
    /// Whether what holds it nearly loses a direction at one of the ends of a step, or between them.
    fn is_weak(&mut self, _start: &StepNode<V>, _end: &StepNode<V>) -> bool {
        false
    }
    /// Whether the ends of steps are settled.
    #[inline(always)]
    fn settles(&self) -> bool {
        false
    }
    /// Settles the stages of what follows too, or no longer: where what holds them nearly loses a direction,
    /// what they are off in it would be amplified. Whether it can.
    #[inline(always)]
    fn hold_stages(&mut self, _on: bool, _tolerances: &Tolerances) -> bool {
        false
    }
    /// Is asked where the error of a step is too large: what it becomes when the end `y` of the step is
    /// settled. `None`: it stays.
    #[inline(always)]
    fn lasting(
        &mut self,
        _t: f64,
        _y: &Phase<V>,
        _error: &Phase<V>,
    ) -> Result<Option<Phase<V>>, Self::Error> {
        Ok(None)
    }
    /// Puts the end of a step that is about to be accepted where it belongs: back onto the constraints.
    /// `None` where it stayed.
    #[inline(always)]
    fn settle(
        &mut self,
        _t: f64,
        _y: &mut Phase<V>,
        _tolerances: &Tolerances,
    ) -> Result<Option<Settled>, Self::Error> {
        Ok(None)
    }
    /// Where in a step (t, h), made with branches held, the accelerations first stop being smooth, as a part
    /// of it; `None` where they do not. The step is then made to end there. `fails`: its error is too large,
    /// for what such a place may be the reason. `path(θ)` interpolates.
    #[inline(always)]
    fn kink(&mut self, _step: (f64, f64), _fails: bool, _path: impl Fn(f64) -> Phase<V>) -> Option<f64> {
        None
    }
    /// Whether what lies between the ends of a step (q, q̇, q̈ there) is good enough to find them by, so that
    /// no dense output is made for it.
    #[inline(always)]
    fn finds_kinks_by_ends(&self) -> bool {
        false
    }
    /// Holds from here on the branches that the accelerations take just after the start of a step of size h,
    /// so that within it they are smooth, or no longer; those of the start become what they are on these
    /// branches.
    #[inline(always)]
    fn hold_branches(&mut self, _start: &mut StepNode<V>, _h: f64, _on: bool) -> Result<Hold, Self::Error> {
        Ok(Hold::Off)
    }
    /// No branch is held any more, and the next accelerations are those of a start.
    #[inline(always)]
    fn free_branches(&mut self) {}
    /// Is told that the step which was tried last is made.
    #[inline(always)]
    fn accepted(&mut self) {}
    /// Whether M q̈ contains velocities, as far as is known: Coriolis terms of a mass matrix that moves,
    /// dampers, gyroscopic forces.
    #[inline(always)]
    fn has_velocity_forces(&self) -> bool {
        true
    }
    /// Moves the position at t + h along M⁻¹Φ_qᵀ of the start of the step onto the holonomic constraints.
    #[inline(always)]
    fn hold_end(&mut self, _start: &StepNode<V>, _h: f64, _q: &mut V) -> Result<(), Self::Error> {
        Ok(())
    }
    /// Whether constraints hold, which [`System::across`] and [`System::onto_constraints`] know.
    #[inline(always)]
    fn is_constrained(&self) -> bool {
        false
    }
    /// The part of `v`, as of accelerations, that constraints do not permit, along M⁻¹Φ_qᵀ: what is left of v
    /// has Φ_q v = 0 and, unless `holonomic`, A v = 0.
    #[inline(always)]
    fn across(&mut self, _t: f64, _y: &Phase<V>, _v: &V, _holonomic: bool) -> Result<V, Self::Error> {
        Ok(V::zeros())
    }
    /// The change δ of positions along M⁻¹Φ_qᵀ with Φ_q δ = −Φ, and A δ = −`rate` (A q̇ + b) for rows that
    /// bind velocities.
    #[inline(always)]
    fn onto_constraints(&mut self, _t: f64, _y: &Phase<V>, _rate: f64) -> Result<V, Self::Error> {
        Ok(V::zeros())
    }
    /// p = ∂L/∂q̇ and ṗ = ∂L/∂q + forces. False, and nothing written, where they are not known.
    #[inline(always)]
    fn momenta(&mut self, _t: f64, _y: &Phase<V>, _p: &mut V, _rate: &mut V) -> Result<bool, Self::Error> {
        Ok(false)
    }
    /// M = ∂p/∂q̇, N×N by rows. Asked only of systems that know their momenta.
    #[inline(always)]
    fn mass_matrix(&mut self, _t: f64, _q: &V, _mass: &mut [f64]) -> Result<(), Self::Error> {
        Ok(())
    }
    /// What the motion conserves. `None` where that is not known.
    #[inline(always)]
    fn energy(&mut self, _t: f64, _y: &Phase<V>) -> Option<f64> {
        None
    }
    /// q̈ where the next step starts as a rule: what its series starts with may be found along with it.
    #[inline(always)]
    fn accelerations_ahead(&mut self, t: f64, y: &Phase<V>) -> Result<V, Self::Error> {
        self.accelerations(t, &y.q, &y.u)
    }
    /// Taylor coefficients of the motion through y at t, with q̈ = `a` there: x(t + s·scale) = Σ xₖ sᵏ. The
    /// first rows of `q` and `u` are those of y; the others are written, as many as there are. False, and
    /// nothing written, where the system has no series.
    #[inline(always)]
    fn series(
        &mut self,
        _t: f64,
        _y: &Phase<V>,
        _a: &V,
        _scale: f64,
        _q: &mut [V],
        _u: &mut [V],
    ) -> Result<bool, Self::Error> {
        Ok(false)
    }
    /// Whether the accelerations choose between expressions: a series is then that of the branch at its
    /// start.
    #[inline(always)]
    fn chooses(&self) -> bool {
        false
    }
}

impl<V: Vector, E, F: FnMut(f64, &V, &V) -> Result<V, E>> System<V> for F {
    type Error = E;
    const IS_FREE: bool = true;
    const IS_SMOOTH: bool = true;
    #[inline(always)]
    fn accelerations(&mut self, t: f64, q: &V, u: &V) -> Result<V, E> {
        self(t, q, u)
    }
}

/// Whether branches of the accelerations are held: see [`System::hold_branches`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// They are.
    On,
    /// They are, and others than up to here.
    Changed,
    /// They are not, or there are none.
    Off,
    /// They are not, since the motion leaves neither side of a place where they change: it would have to
    /// slide along it.
    Slides,
}

/// q̈ = a(t, q): forces without velocities and a constant mass matrix, as symplectic methods want them.
///
/// ```
/// use dynamics_runtime::integrate::{OfPositions, Phase, StepOptions, Stepper, StormerVerlet, Tolerances};
/// use nalgebra::SVector;
/// type V = SVector<f64, 1>;
///
/// let mut oscillator = OfPositions(|_t: f64, q: &V| Ok::<V, core::convert::Infallible>(-q));
/// let start = Phase { q: V::new(1.0), u: V::new(0.0) };
/// let options = StepOptions { tolerances: Tolerances::both(1e-9), fixed: Some(0.1), first: None, most: f64::INFINITY };
/// let mut stepper = Stepper::<V, StormerVerlet<V>>::new(&mut oscillator, 0.0, start, 1e4, options).unwrap();
/// while stepper.now().t < 1e4 {
///     stepper.step(&mut oscillator, 1e4).unwrap();
/// }
/// let now = stepper.now().y;
/// assert!((now.q.norm_squared() + now.u.norm_squared() - 1.0).abs() < 0.003);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct OfPositions<F>(pub F);

impl<V: Vector, E, F: FnMut(f64, &V) -> Result<V, E>> System<V> for OfPositions<F> {
    type Error = E;
    const IS_FREE: bool = true;
    const IS_SMOOTH: bool = true;
    #[inline(always)]
    fn accelerations(&mut self, t: f64, q: &V, _: &V) -> Result<V, E> {
        (self.0)(t, q)
    }
    #[inline(always)]
    fn has_velocity_forces(&self) -> bool {
        false
    }
}

/// How the end of a step was settled, as the norm of the error is measured (1: as much as the tolerance
/// permits).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// By how much it moved.
    pub by: f64,
    /// How far it was from where it belongs, along what holds it: less than it moved where that nearly loses
    /// a direction.
    pub violation: f64,
    /// What rounding errors make uncertain where it is settled: large near a position where what holds it
    /// nearly loses a direction.
    pub noise: f64,
}

/// Where a step starts: time, phase and the accelerations there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepNode<V> {
    /// Time.
    pub t: f64,
    /// q and u.
    pub y: Phase<V>,
    /// q̈.
    pub a: V,
}

impl<V: Vector> StepNode<V> {
    /// (q̇, q̈): the first stage of every method here.
    #[inline(always)]
    pub(crate) fn derivative(&self) -> Phase<V> {
        Phase { q: self.y.u, u: self.a }
    }
}

/// One integration method.
///
/// `attempt` makes a trial step and keeps its stages; `finish` evaluates q̈ at its end; `dense` builds the
/// interpolant. They are called in this order, each at most once per step.
pub trait Scheme<V: Vector>: Clone {
    /// Which method this is.
    const METHOD: Method;
    /// Order of the step.
    const ORDER: u32;
    /// Order that the error estimate behaves like: the step follows tolerance^(1/(this + 1)).
    const ERROR_ORDER: u32;
    /// Step control suited to the method; `None` where there is no error estimate.
    const CONTROL: Option<ControllerSettings>;
    /// Weights b of the step's quadrature, one per stage in the order of evaluation, the first for the start
    /// of the step; none where stages are no evaluations at states of the solution: sums over a step are then
    /// taken from the interpolant.
    const WEIGHTS: &'static [f64];
    /// |h λ| at the border of the region of stability on the negative real axis, for the stiffness test.
    const STABILITY_BORDER: f64;
    /// Number of parts in which a step is scanned for events.
    const SCAN: usize;
    /// Places within a step, as parts of it, at which dense output is held against the equations of motion:
    /// where what it is off changes fastest, away from its own nodes. None for methods with interpolants that
    /// they judge themselves, or that are as good as their steps, and for those without error estimate.
    const PROBES: &'static [f64] = &[];
    /// Whether it makes few and long steps: the first one from rest is then as long as the times of the
    /// mechanism permit, where others begin with short ones and soon have longer ones.
    const LONG_STEPS: bool = false;
    /// The interpolant.
    type Dense: Dense<V> + Send + Sync + 'static;

    /// With the options that it has by itself.
    fn new() -> Self;
    /// Whether the next one says how long every step is: errors that are permitted are then no matter of the
    /// controller.
    const PROPOSES: bool = false;
    /// The size of the step that starts here, positive, where the method knows it before it tries; `h` is
    /// what the step before suggests, with its sign.
    #[inline(always)]
    fn propose<S: System<V>>(
        &mut self,
        _system: &mut S,
        _start: &StepNode<V>,
        _h: f64,
        _tolerances: &Tolerances,
    ) -> Option<f64> {
        None
    }
    /// Drops what it remembers of steps before: the motion goes on from another state, or by other forces.
    #[inline(always)]
    fn forget(&mut self) {}
    /// Tries a step of size h. Returns the new phase and the scaled norm of the local error estimate (0
    /// without estimate).
    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error>;
    /// As [`Scheme::attempt`], to the same bits, of a step that is made once more. Steps are inlined where
    /// motions are made, and are most of what a method is to a compiler; here what is short may be slower.
    #[inline(always)]
    fn attempt_again<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        self.attempt(system, start, h, tolerances)
    }
    /// Is told of a step that was made before and is to be tried once more, all of it (1) or its first part:
    /// what is known of it may start its iterations. Whether these may end elsewhere, so that it is only what
    /// it was where it ends where it did.
    #[inline(always)]
    fn retrace(&mut self, _step: &Step<V>, _part: f64) -> bool {
        false
    }
    /// q̈ at the end of the step just tried.
    fn finish<S: System<V>>(&mut self, system: &mut S, end_t: f64, end: &Phase<V>) -> Result<V, S::Error>;
    /// The interpolant of the step just finished; may evaluate further stages.
    fn dense<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        end: &StepNode<V>,
        h: f64,
    ) -> Result<Self::Dense, S::Error>;
    /// The interpolant of a step that was made before, where its ends tell it, so that nothing has to be
    /// tried once more.
    #[inline(always)]
    fn by_ends<S: System<V>>(
        &mut self,
        _system: &mut S,
        _start: &StepNode<V>,
        _end: &StepNode<V>,
        _h: f64,
        _tolerances: &Tolerances,
    ) -> Result<Option<Self::Dense>, S::Error> {
        Ok(None)
    }
    /// Stage derivatives of the step just tried, in the order of evaluation, to find what is not finite.
    fn stages(&self) -> &[Phase<V>];
    /// The vector whose norm `attempt` returned, unscaled, to name the coordinate that forces small steps.
    fn error_vector(&self) -> Phase<V>;
    /// What the stages of the step just tried disagree by, unscaled: the error, where it is estimated.
    fn disagreement(&self) -> Phase<V> {
        self.error_vector()
    }
    /// Whether the equations of the last attempt are solved: always, for methods without any. Where they are
    /// not, the attempt's results mean nothing.
    #[inline(always)]
    fn converged(&self) -> bool {
        true
    }
    /// Is told of every step that is accepted, with its end as it was settled.
    #[inline(always)]
    fn accepted(&mut self, _step: &Step<V>) {}
    /// Has the last word on the next step: the step control wants it `factor` times as long as the one tried
    /// last, which had this error.
    #[inline(always)]
    fn pace(&mut self, factor: f64, _error: f64) -> f64 {
        factor
    }
    /// Estimate |h λ| of the dominant eigenvalue from two stages at the end of the step; `None` where they
    /// coincide.
    fn stiffness(&self, h: f64, end: &StepNode<V>) -> Option<f64>;
}

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
    /// No integration: positions solved from constraints that leave no freedom ([`crate::kinematics`]).
    PositionAnalysis,
}

impl Method {
    /// Whether it is for stiff motions: implicit, with a step control that does not see what is stiff and has
    /// died away.
    #[must_use]
    pub const fn is_for_stiff(self) -> bool {
        matches!(self, Self::Radau5 | Self::Esdirk4 | Self::GeneralizedAlpha)
    }

    /// Order of the step; of the interpolant where positions are solved instead of integrated; the highest
    /// one of Taylor series.
    #[must_use]
    pub const fn order(self) -> u32 {
        match self {
            Self::PositionAnalysis => 5,
            Self::SemiImplicitEuler => 1,
            Self::StormerVerlet | Self::Rattle | Self::EnergyMidpoint | Self::GeneralizedAlpha => 2,
            Self::Rk4 | Self::Composition4 | Self::Gauss4 | Self::Esdirk4 => 4,
            Self::Composition6 | Self::Gauss6 => 6,
            Self::DormandPrince5 | Self::Tsit5 | Self::Radau5 => 5,
            Self::Dop853 | Self::Composition8 => 8,
            Self::Verner9 => 9,
            Self::GraggBulirschStoer => 14,
            Self::Taylor => MOST_SERIES_ORDER as u32,
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
        })
    }
}
