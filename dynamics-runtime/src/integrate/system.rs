//! What is integrated: one trait per capability of a system q̈ = a(t, q, u), u = q̇.
//!
//! | trait | what the stepper and the methods ask |
//! |---|---|
//! | [`Accelerations`] | q̈, its Jacobians |
//! | [`Stabilized`] | projection onto the constraints |
//! | [`Switching`] | discontinuities of q̈ and the branches that a step holds |
//! | [`Canonical`] | momenta, mass matrix, energy |
//! | [`Expandable`] | Taylor series of the motion |
//!
//! All methods but [`Accelerations::accelerations`] have a default: a system without the capability. Symbols:
//! Φ(q, t) = 0 holonomic constraints, A q̇ + b = 0 all rows at the level of velocities, M the mass matrix.

use crate::integrate::phase::{Phase, Stages, StepNode};
use crate::integrate::step::Tolerances;
use crate::lanes::Lanes;
use crate::model::Vector;

/// q̈ = a(t, q, u): what every method asks for.
pub trait Accelerations<V: Vector> {
    /// Why q̈ does not exist at a state.
    type Error;
    /// The system has no constraints. The stepper then does not compile what concerns constraints.
    const IS_UNCONSTRAINED: bool = false;
    /// The accelerations have no branches. The stepper then does not compile what concerns discontinuities.
    const IS_SMOOTH: bool = false;
    /// q̈ at time t for coordinates q and velocities u = q̇.
    fn accelerations(&mut self, t: f64, q: &V, u: &V) -> Result<V, Self::Error>;
    /// (q̇, q̈) at a stage. q̇ is u, unless constraints determine some velocities: then it is the velocity
    /// at which q̈ was evaluated.
    #[inline(always)]
    fn derivative(&mut self, t: f64, y: &Phase<V>) -> Result<Phase<V>, Self::Error> {
        let u = self.accelerations(t, &y.q, &y.u)?;
        Ok(Phase { q: y.u, u })
    }
    /// Writes (q̇, q̈) at several stages side by side, each as [`Accelerations::derivative`] returns it.
    /// The default calls that function for each.
    #[inline(always)]
    fn derivatives<L: Lanes>(
        &mut self,
        t: L,
        y: &Stages<V, L>,
        derivatives: &mut Stages<V, L>,
    ) -> Result<(), Self::Error> {
        one_by_one(self, t, y, derivatives)
    }
    /// ∂q̈/∂q and ∂q̈/∂q̇ at a point, N×N by rows, for implicit methods. The default takes
    /// differences.
    fn jacobian(&mut self, at: &StepNode<V>, by_q: &mut [f64], by_u: &mut [f64]) -> Result<(), Self::Error> {
        crate::integrate::differences::by_state(at, by_q, by_u, |y| self.accelerations(at.t, &y.q, &y.u))
    }
    /// Whether M q̈ contains velocities, as far as is known: Coriolis terms of a mass matrix that depends on
    /// q, dampers, gyroscopic forces.
    #[inline(always)]
    fn has_velocity_forces(&self) -> bool {
        true
    }
    /// Called before every attempt with the start of the step and its signed size. Where the accelerations
    /// depend on the step size (stabilization with gains that follow the step), it updates those of the
    /// start, which are the first stage.
    #[inline(always)]
    fn begin_attempt(&mut self, _start: &mut StepNode<V>, _h: f64) -> Result<(), Self::Error> {
        Ok(())
    }
    /// Called when the step that was tried last is accepted.
    #[inline(always)]
    fn accept_step(&mut self) {}
}

/// Projection of states, stages and errors onto the constraints of a system. Default: no constraints.
pub trait Stabilized<V: Vector>: Accelerations<V> {
    /// Whether the system has constraints. [`Stabilized::inadmissible_component`] and
    /// [`Stabilized::constraint_correction`] are then implemented.
    #[inline(always)]
    fn has_constraints(&self) -> bool {
        false
    }
    /// Whether the constraint Jacobian nearly loses rank at one of the ends of a step or in its middle.
    fn is_near_rank_loss(&mut self, _start: &StepNode<V>, _end: &StepNode<V>) -> bool {
        false
    }
    /// Whether the ends of steps are projected.
    #[inline(always)]
    fn needs_projection(&self) -> bool {
        false
    }
    /// Switches the projection of stages on or off from here on: near rank loss, accelerations amplify the
    /// constraint violation of the stages. Returns whether the system can project stages.
    #[inline(always)]
    fn project_stages(&mut self, _on: bool, _tolerances: &Tolerances) -> bool {
        false
    }
    /// The part of an error that is left when the end `y` of the step is projected; `None` where nothing is
    /// projected. Called where the error of a step is too large.
    #[inline(always)]
    fn error_after_projection(
        &mut self,
        _t: f64,
        _y: &Phase<V>,
        _error: &Phase<V>,
    ) -> Result<Option<Phase<V>>, Self::Error> {
        Ok(None)
    }
    /// Projects the end of a step that is about to be accepted onto the constraints; `None` where nothing is
    /// projected.
    #[inline(always)]
    fn project(
        &mut self,
        _t: f64,
        _y: &mut Phase<V>,
        _tolerances: &Tolerances,
    ) -> Result<Option<ProjectedEnd>, Self::Error> {
        Ok(None)
    }
    /// Moves the position q at t + h along M⁻¹Φ_qᵀ of the start of the step onto the holonomic
    /// constraints.
    #[inline(always)]
    fn project_position(&mut self, _start: &StepNode<V>, _h: f64, _q: &mut V) -> Result<(), Self::Error> {
        Ok(())
    }
    /// The component of accelerations, velocities or displacements `v` along M⁻¹Φ_qᵀ that the
    /// constraints do not admit: the rest of v has Φ_q v = 0 and, unless `holonomic`, A v = 0.
    #[inline(always)]
    fn inadmissible_component(
        &mut self,
        _t: f64,
        _y: &Phase<V>,
        _v: &V,
        _holonomic: bool,
    ) -> Result<V, Self::Error> {
        Ok(V::zeros())
    }
    /// The change δ of positions along M⁻¹Φ_qᵀ with Φ_q δ = −Φ, and A δ = −`rate` (A q̇ + b)
    /// for nonholonomic rows.
    #[inline(always)]
    fn constraint_correction(&mut self, _t: f64, _y: &Phase<V>, _rate: f64) -> Result<V, Self::Error> {
        Ok(V::zeros())
    }
}

/// Discontinuities of the accelerations: places where q̈ or a derivative of it jumps because a branch
/// changes (kinks). Default: none.
pub trait Switching<V: Vector>: Accelerations<V> {
    /// The first kink within a step (t, h) that was made with held branches, as a part θ of the step; `None`
    /// where there is none. The step is then repeated to end there. `fails`: the error of the step is too
    /// large, which a kink may cause. `path(θ)` interpolates.
    #[inline(always)]
    fn locate_kink(
        &mut self,
        _step: (f64, f64),
        _fails: bool,
        _path: impl Fn(f64) -> Phase<V>,
    ) -> Option<f64> {
        None
    }
    /// Whether the quintic through q, q̇, q̈ at the ends of a step is accurate enough to locate kinks, so
    /// that no dense output is evaluated for it.
    #[inline(always)]
    fn is_hermite_enough_for_kinks(&self) -> bool {
        false
    }
    /// With `on`: holds from here on the branches that the accelerations take just after the start of a step
    /// of size h, so that they are smooth within it. Without: the values decide again. The accelerations of
    /// the start are updated.
    #[inline(always)]
    fn hold_branches(
        &mut self,
        _start: &mut StepNode<V>,
        _h: f64,
        _on: bool,
    ) -> Result<BranchHold, Self::Error> {
        Ok(BranchHold::Free)
    }
    /// Releases all branches. The next accelerations are those of a start.
    #[inline(always)]
    fn release_branches(&mut self) {}
}

/// Momenta and energy, for structure-preserving methods. Default: not known.
pub trait Canonical<V: Vector>: Accelerations<V> {
    /// p = ∂L/∂q̇ and ṗ = ∂L/∂q + forces. Returns false and writes nothing where they are not
    /// known.
    #[inline(always)]
    fn momenta(&mut self, _t: f64, _y: &Phase<V>, _p: &mut V, _rate: &mut V) -> Result<bool, Self::Error> {
        Ok(false)
    }
    /// M = ∂p/∂q̇, N×N by rows. Called only for systems whose momenta are known.
    #[inline(always)]
    fn mass_matrix(&mut self, _t: f64, _q: &V, _mass: &mut [f64]) -> Result<(), Self::Error> {
        Ok(())
    }
    /// The energy that the motion conserves. `None` where it is not known.
    #[inline(always)]
    fn energy(&mut self, _t: f64, _y: &Phase<V>) -> Option<f64> {
        None
    }
}

/// Taylor series of the motion. Default: not known.
pub trait Expandable<V: Vector>: Accelerations<V> {
    /// q̈ at the end of a step, where the next one usually starts. The system may keep intermediate values
    /// for the series of that step.
    #[inline(always)]
    fn accelerations_at_next_start(&mut self, t: f64, y: &Phase<V>) -> Result<V, Self::Error> {
        self.accelerations(t, &y.q, &y.u)
    }
    /// Taylor coefficients of the motion through y at t, with q̈ = `a` there: x(t + s·scale) = Σ xₖ
    /// sᵏ. The first rows of `q` and `u` are those of y; all others are written. Returns false and writes
    /// nothing where the system has no series.
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
    /// Whether the accelerations choose between expressions (`if`, min, max, abs, signum). A series is then
    /// that of the branch at its start.
    #[inline(always)]
    fn has_choices(&self) -> bool {
        false
    }
}

/// A system that methods integrate: [`Accelerations`] and the four further capabilities. Implement
/// [`Accelerations`] for your own system, and the others by empty blocks where it has none of them.
pub trait System<V: Vector>: Stabilized<V> + Switching<V> + Canonical<V> + Expandable<V> {}

impl<V: Vector, S: Stabilized<V> + Switching<V> + Canonical<V> + Expandable<V>> System<V> for S {}

impl<V: Vector, E, F: FnMut(f64, &V, &V) -> Result<V, E>> Accelerations<V> for F {
    type Error = E;
    const IS_UNCONSTRAINED: bool = true;
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

/// The state of the branches of the accelerations after [`Switching::hold_branches`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BranchHold {
    /// Branches are held: the same as before, or for the first time.
    Same,
    /// Branches are held, and they differ from those held before.
    Changed,
    /// No branch is held, or there are none.
    Free,
    /// No branch is held, since the accelerations of both sides lead back to the discontinuity: sliding
    /// motion (Filippov).
    Sliding,
}

/// q̈ = a(t, q): forces without velocities and a constant mass matrix, as symplectic methods need them.
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
    const IS_UNCONSTRAINED: bool = true;
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

/// How the end of a step was projected. All sizes are in permitted errors: 1 is what the tolerance permits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedEnd {
    /// How far the projection moved the state.
    pub by: f64,
    /// How far the state was from the constraints. It moves farther than this where the constraint Jacobian
    /// nearly loses rank.
    pub violation: f64,
    /// The uncertainty of the projected state from rounding. It is large near rank loss.
    pub noise: f64,
}

/// [`Accelerations::derivatives`] of some stages, one after the other.
#[inline(always)]
pub(crate) fn one_by_one<V: Vector, L: Lanes, S: Accelerations<V> + ?Sized>(
    system: &mut S,
    t: L,
    y: &Stages<V, L>,
    derivatives: &mut Stages<V, L>,
) -> Result<(), S::Error> {
    for lane in 0..L::COUNT {
        derivatives.put(lane, &system.derivative(t.lane(lane), &y.of(lane))?);
    }
    Ok(())
}
