//! What is integrated.

use crate::integrate::phase::{Phase, Stages, StepNode};
use crate::integrate::step::Tolerances;
use crate::lanes::Lanes;
use crate::model::Vector;

/// q̈ = a(t, q, u): what every method asks for.
pub trait Accelerations<V: Vector> {
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
    /// Writes (q̇, q̈) at four stages side by side, as [`Accelerations::derivative`] has each of them, and by
    /// it where the system cannot evaluate them at once.
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
        crate::integrate::differences::by_state(at, by_q, by_u, |y| self.accelerations(at.t, &y.q, &y.u))
    }
    /// Whether M q̈ contains velocities, as far as is known: Coriolis terms of a mass matrix that moves,
    /// dampers, gyroscopic forces.
    #[inline(always)]
    fn has_velocity_forces(&self) -> bool {
        true
    }
    /// Is told before every attempt where the step starts and how long it is, with its sign. Where the
    /// accelerations depend on the step, those of the start, its first stage, become those of this one.
    #[inline(always)]
    fn attempting(&mut self, _start: &mut StepNode<V>, _h: f64) -> Result<(), Self::Error> {
        Ok(())
    }
    /// Is told that the step which was tried last is made.
    #[inline(always)]
    fn accepted(&mut self) {}
}

/// What holds a system, constraints: how it is put back onto them. Nothing, by default.
pub trait Stabilized<V: Vector>: Accelerations<V> {
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
    /// Moves the position at t + h along M⁻¹Φ_qᵀ of the start of the step onto the holonomic constraints.
    #[inline(always)]
    fn hold_end(&mut self, _start: &StepNode<V>, _h: f64, _q: &mut V) -> Result<(), Self::Error> {
        Ok(())
    }
    /// Whether constraints hold, which [`Stabilized::across`] and [`Stabilized::onto_constraints`] know.
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
}

/// Accelerations with branches: places where they are not smooth. None, by default.
pub trait Switching<V: Vector>: Accelerations<V> {
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
}

/// Momenta and energy, for methods that preserve something. Not known, by default.
pub trait Canonical<V: Vector>: Accelerations<V> {
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
}

/// Taylor series of the motion. Not known, by default.
pub trait Expandable<V: Vector>: Accelerations<V> {
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

/// What is integrated: accelerations, and whatever of the other capabilities a system has. A system of one's
/// own implements [`Accelerations`], and the others by empty blocks.
pub trait System<V: Vector>: Stabilized<V> + Switching<V> + Canonical<V> + Expandable<V> {}

impl<V: Vector, S: Stabilized<V> + Switching<V> + Canonical<V> + Expandable<V>> System<V> for S {}

impl<V: Vector, E, F: FnMut(f64, &V, &V) -> Result<V, E>> Accelerations<V> for F {
    type Error = E;
    const IS_FREE: bool = true;
    const IS_SMOOTH: bool = true;
    #[inline(always)]
    fn accelerations(&mut self, t: f64, q: &V, u: &V) -> Result<V, E> {
        self(t, q, u)
    }
}

impl<V: Vector, E, F: FnMut(f64, &V, &V) -> Result<V, E>> Stabilized<V> for F {}
impl<V: Vector, E, F: FnMut(f64, &V, &V) -> Result<V, E>> Switching<V> for F {}
impl<V: Vector, E, F: FnMut(f64, &V, &V) -> Result<V, E>> Canonical<V> for F {}
impl<V: Vector, E, F: FnMut(f64, &V, &V) -> Result<V, E>> Expandable<V> for F {}

/// Whether branches of the accelerations are held: see [`Switching::hold_branches`].
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
/// # use dynamics_runtime as dynamics;
/// use dynamics::integrate::{OfPositions, Phase, StepOptions, Stepper, StormerVerlet, Tolerances};
/// use nalgebra::SVector;
/// type V = SVector<f64, 1>;
///
/// let mut oscillator = OfPositions(|_t: f64, q: &V| Ok::<V, core::convert::Infallible>(-q));
/// let start = Phase { q: V::new(1.0), u: V::new(0.0) };
/// let tolerances = Tolerances::both(1e-9);
/// let options = StepOptions { tolerances, fixed: Some(0.1), first: None, most: f64::INFINITY };
/// let mut stepper = Stepper::<V, StormerVerlet<V>>::new(&mut oscillator, 0.0, start, 1e4, options).unwrap();
/// while stepper.now().t < 1e4 {
///     stepper.step(&mut oscillator, 1e4).unwrap();
/// }
/// let now = stepper.now().y;
/// assert!((now.q.norm_squared() + now.u.norm_squared() - 1.0).abs() < 0.003);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct OfPositions<F>(pub F);

impl<V: Vector, E, F: FnMut(f64, &V) -> Result<V, E>> Accelerations<V> for OfPositions<F> {
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

impl<V: Vector, E, F: FnMut(f64, &V) -> Result<V, E>> Stabilized<V> for OfPositions<F> {}
impl<V: Vector, E, F: FnMut(f64, &V) -> Result<V, E>> Switching<V> for OfPositions<F> {}
impl<V: Vector, E, F: FnMut(f64, &V) -> Result<V, E>> Canonical<V> for OfPositions<F> {}
impl<V: Vector, E, F: FnMut(f64, &V) -> Result<V, E>> Expandable<V> for OfPositions<F> {}

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

/// [`Accelerations::derivatives`] of stages that cannot be evaluated at once.
#[inline(always)]
pub(crate) fn one_by_one<V: Vector, S: Accelerations<V> + ?Sized>(
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
