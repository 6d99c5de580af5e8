//! [`Analyze`], the trait with the analyses of every model. One trait, so that there is one name to import.
//! Each method calls the module that does the work.

use dynamics_runtime::model::Draw;
use dynamics_runtime::simulate::Simulate;

use crate::equilibria::{self, Equilibrium, EquilibriumError, EquilibriumSearch, Stability};
use crate::linearize::{self, Linearization, LinearizeError, Mode};
use crate::periodic::{self, Floquet, Lyapunov, PeriodicError, Poincare, Shooting};
use crate::vibration::{self, ModeAnimation, StateSpace, VibrationError};
use crate::{Backbone, WorkPrecision};

/// The analyses of a model. Every model that can be simulated has them. Analyses that take parameters by name
/// are in [`Vary`](crate::Vary).
pub trait Analyze: Simulate {
    /// The equilibrium that the search finds from the position of a state, usually the nearest. Velocities of
    /// the state are ignored; its inputs and switched constraints are kept.
    ///
    /// # Errors
    /// No equilibrium nearby, forces or constraints that change with time, a force that jumps, a model
    /// without derivatives.
    fn equilibrium(&self, start: &Self::State) -> Result<Equilibrium<Self::State>, EquilibriumError> {
        equilibria::equilibrium(self, start)
    }

    /// A search from many starts. Options follow; [`EquilibriumSearch::run`] runs it. All starts have the
    /// inputs, the time and the switched constraints of this state.
    fn equilibria(&self, around: Self::State) -> EquilibriumSearch<'_, Self> {
        EquilibriumSearch::new(self, around)
    }

    /// A steady motion with the velocities of a state: the coordinates are adjusted until nothing
    /// accelerates. Velocities other than 0 must belong to cyclic coordinates, such as the angle of a driven
    /// hoop or the spin of a top. A rolling system keeps its independent velocities, those of angles if
    /// possible. For a disk these are its turning and its spin; the lean is found.
    ///
    /// # Errors
    /// As [`Analyze::equilibrium`], and a motion that does not stay steady.
    fn steady(&self, start: &Self::State) -> Result<Equilibrium<Self::State>, EquilibriumError> {
        equilibria::steady(self, start)
    }

    /// As [`Analyze::steady`] for rolling systems, with the choice of the independent velocities that are
    /// kept, by the names of their coordinates. For turns of a bicycle at a given speed these are `["roll",
    /// "steer", "rear"]`, the first two of them 0.
    ///
    /// # Errors
    /// Also if a name is not a coordinate, or its velocity depends on the others.
    fn steady_in(
        &self,
        start: &Self::State,
        independent: &[&str],
    ) -> Result<Equilibrium<Self::State>, EquilibriumError> {
        equilibria::steady_in(self, start, independent)
    }

    /// A search for steady motions from many starts. All starts have the velocities of this state (for
    /// rolling systems, the independent ones). Random starts differ in the coordinates that have a range
    /// ([`EquilibriumSearch::within`]). Give ranges to the unknown coordinates, such as the lean, and none to
    /// cyclic ones, such as the position.
    fn steady_motions(&self, around: Self::State) -> EquilibriumSearch<'_, Self> {
        EquilibriumSearch::new(self, around).moving()
    }

    /// Whether an equilibrium or a steady motion is stable. The criterion is the energy if it is conserved,
    /// otherwise the eigenvalues of small motions. The verdict says if linear theory does not decide. Cyclic
    /// coordinates are left out, with their momenta held.
    ///
    /// # Errors
    /// A state that is neither, and a model that cannot be linearised.
    fn stability(&self, state: &Self::State) -> Result<Stability, EquilibriumError> {
        equilibria::judge(self, state)
    }

    /// The linear equations of small motions about the motion through a state. The library chooses the
    /// independent coordinates.
    ///
    /// # Errors
    /// A state that is not on the constraints or singular, forces that depend on reactions, a model too large
    /// for exact derivatives.
    fn linearize(&self, state: &Self::State) -> Result<Linearization, LinearizeError> {
        linearize::linearize(self, state, &[])
    }

    /// As [`Analyze::linearize`], with these coordinates among the independent ones, and their
    /// velocities among the independent velocities as far as the nonholonomic constraints leave them: names
    /// as in [`Dynamics::COORDINATES`](dynamics_runtime::model::Dynamics::COORDINATES).
    ///
    /// # Errors
    /// Also where a name is not a coordinate, or the constraints do not leave all of the coordinates
    /// independent.
    fn linearize_in(
        &self,
        state: &Self::State,
        independent: &[&str],
    ) -> Result<Linearization, LinearizeError> {
        linearize::linearize(self, state, independent)
    }

    /// The linear model about an equilibrium or a steady motion, with inputs and outputs by name.
    ///
    /// # Errors
    /// A model that cannot be linearised, a state that is neither, and outputs without exact derivatives.
    fn state_space(&self, state: &Self::State) -> Result<StateSpace, VibrationError> {
        vibration::of_model(self, state)
    }

    /// A mode of small motions about this state, animated on the model's own drawing. The result is a
    /// [`Film`](dynamics_view::Film) for an [`Animation`](dynamics_view::Animation). It shows two periods of
    /// q + Re(`amplitude` · shape e^{iωt}), without damping.
    ///
    /// # Errors
    /// A mode that does not oscillate, or an amplitude that is not positive.
    fn mode_animation(
        &self,
        state: &Self::State,
        mode: &Mode,
        amplitude: f64,
    ) -> Result<ModeAnimation<'_, Self>, VibrationError>
    where
        Self: Draw,
    {
        ModeAnimation::new(self, *state, mode, amplitude)
    }

    /// The Floquet multipliers of the motion through a state, which must close after the period: an
    /// equilibrium under periodic coefficients, or a known closed motion. If time appears in the equations,
    /// the period must be one of theirs.
    ///
    /// # Errors
    /// A motion that does not close, equations that do not repeat, a model without derivatives, motions that
    /// end or diverge.
    fn floquet(&self, start: &Self::State, period: f64) -> Result<Floquet, PeriodicError> {
        periodic::floquet_of(self, start, period)
    }

    /// A search for the closed motion near the one through a state. Options follow; [`Shooting::run`] runs
    /// it. If time appears in the equations, the period is kept, and must be one of theirs or a multiple.
    /// Otherwise it is a first guess.
    fn periodic(&self, guess: Self::State, period: f64) -> Shooting<'_, Self> {
        Shooting::new(self, guess, period)
    }

    /// A computation of Lyapunov exponents along the motion from a state. Options follow; [`Lyapunov::run`]
    /// runs it.
    fn lyapunov(&self, start: Self::State) -> Lyapunov<'_, Self> {
        Lyapunov::new(self, start)
    }

    /// A section through the motion from a state. Options follow; [`Poincare::run`] runs it.
    fn poincare(&self, start: Self::State) -> Poincare<'_, Self> {
        Poincare::new(self, start)
    }

    /// A nonlinear mode: the family of closed motions that begins with a linear mode about an equilibrium.
    /// Modes are numbered from 0 by growing frequency. Options follow; [`Backbone::run`] runs it. Each energy
    /// must belong to one motion of the family. So it is an error if a momentum is conserved, too (two free
    /// masses), or if directions are equivalent (a pendulum that can swing in any direction). If another
    /// frequency is a whole multiple of this one, the family may not exist, and the result may involve both
    /// modes.
    fn nonlinear_mode(&self, equilibrium: &Self::State, mode: usize) -> Backbone<'_, Self> {
        Backbone::new(self, *equilibrium, mode)
    }

    /// Begins a study of methods on this model, from a start state. Options follow; [`WorkPrecision::run`]
    /// runs it.
    fn work_precision(&self, start: Self::State) -> WorkPrecision<'_, Self> {
        WorkPrecision::new(self, start)
    }
}

impl<M: Simulate> Analyze for M {}
