//! Nonlinear modes: how a mode of small motions continues to large ones.
//!
//! An equilibrium of a conservative system has a family of closed motions for every natural frequency of
//! which no other one is a whole multiple (ω_j ≠ n ω_k). The family begins with the linear mode and is
//! ordered by energy (A. M. Lyapunov, *The General Problem of the Stability of Motion*, 1892; J. Moser, Comm.
//! Pure Appl. Math. 29 (1976) 727). Its frequency over its energy is the backbone curve of forced vibration.
//! The family is followed in s = √(E − E₀), because amplitudes are proportional to s at first. Each
//! closed motion is predicted by a secant and corrected by shooting with the energy held (`periodic/`;
//! G. Kerschen et al., Mech. Syst. Signal Process. 23 (2009) 170; M. Peeters et al., ibid. 195). If the
//! energy has a maximum on the family, the computation ends there and says so.
//!
//! At internal resonances the motion of another frequency joins. A closed motion that is too far from the
//! secant belongs to another family and is rejected.

mod error;
mod show;

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::f64::consts::TAU;

use dynamics_runtime::constrain::{project_positions, project_velocities, with_workspace};
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::names;
use dynamics_runtime::model::{ModelState, Powers, Vector};
use dynamics_runtime::simulate::Simulate;
use nalgebra::DVector;

pub use error::BackboneError;

use super::equilibria::{judge, scales};
use super::linearize::{Mode, linearize};
use super::periodic::{PeriodicError, PeriodicOrbit, Shooting};

/// Energy of the first motion, as a share of the last. Its amplitude is a thousandth of the largest, so that
/// the linear mode is a good first guess. At smaller energies rounding of the energy would count.
const FIRST_ENERGY_SHARE: f64 = 1e-6;
/// A closed motion farther from the secant than this share of the step belongs to another family. A larger
/// value may jump to it near an internal resonance, a smaller one needs shorter steps in bends.
const MAX_DEVIATION_FROM_SECANT: f64 = 0.5;
/// Shortest step in s = √(E − E₀), as a share of the last s. If a shorter one would be needed, the
/// family ends or turns.
const MIN_STEP_SHARE: f64 = 1e-4;

/// The real part of the eigenvalue of an undamped mode, relative to its frequency: rounding leaves
/// 10⁻¹⁶, and 10⁻⁸ where two frequencies meet, which begins no family.
const MAX_RELATIVE_DAMPING: f64 = 1e-9;
/// Largest relative difference between the period of a motion and its prediction. It excludes motions with a
/// multiple of the period.
const MAX_PERIOD_CHANGE: f64 = 0.1;

/// The last motion is reached within this share of its s.
const END_TOLERANCE: f64 = 1e-12;
/// Steps shorter than this, as lengths in coordinates, count as this long where deviations are compared with
/// them: shooting is accurate to less.
const MIN_SECANT: f64 = 1e-6;
/// The first amplitude of the linear mode, in the smallest scale of a coordinate. It is then adapted to the
/// energy.
const FIRST_AMPLITUDE: f64 = 1e-3;
/// Least number of motions that a family is asked for.
const MIN_POINTS: usize = 4;
/// Number of motions unless given.
const DEFAULT_POINTS: usize = 40;

/// A family of closed motions with its options, before it is followed.
#[must_use = "a nonlinear mode is not followed until `.run()`"]
pub struct Backbone<'m, M: Simulate> {
    model: &'m M,
    rest: M::State,
    mode: usize,
    energy: f64,
    points: usize,
}

impl<'m, M: Simulate> Backbone<'m, M> {
    pub(crate) fn new(model: &'m M, rest: M::State, mode: usize) -> Self {
        Self { model, rest, mode, energy: f64::NAN, points: DEFAULT_POINTS }
    }
}

/// A family of closed motions, from a linear mode on.
#[derive(Clone, Debug, PartialEq)]
pub struct BackboneCurve<S: ModelState> {
    /// The linear mode with which it begins.
    pub mode: Mode,
    /// The energy in the equilibrium, E₀.
    pub rest_energy: f64,
    /// The unit of energies: `J` or `ft*lb`, empty where the model has no units.
    pub energy_unit: &'static str,
    /// Its motions, by growing distance from the equilibrium along the family.
    pub points: Vec<BackbonePoint<S>>,
}

/// One closed motion of a family.
#[derive(Clone, Debug, PartialEq)]
pub struct BackbonePoint<S: ModelState> {
    /// Energy function, relative to that of the equilibrium.
    pub energy: f64,
    /// 2π over the period, in rad/s.
    pub frequency: f64,
    /// The motion, with its multipliers.
    pub orbit: PeriodicOrbit<S>,
}

impl<S: ModelState> BackboneCurve<S> {
    /// Pairs of neighbours between which the motion gains or loses stability, as far as multipliers say:
    /// indices of the second of each.
    #[must_use]
    pub fn changes(&self) -> Vec<usize> {
        let stable = |k: usize| self.points[k].orbit.floquet.is_stable();
        (1..self.points.len()).filter(|k| stable(*k) != stable(k - 1)).collect()
    }
}

/// A motion of the family: q and q̇ of its start, its period, and s = √(E − E₀).
#[derive(Clone)]
struct Member {
    start: DVector<f64>,
    period: f64,
    s: f64,
}

impl<M: Simulate + Powers> Backbone<'_, M> {
    /// Follows the family up to this energy, relative to that of the equilibrium.
    pub fn until(mut self, energy: f64) -> Self {
        self.energy = energy;
        self
    }

    /// The number of motions, at least four; 40 unless given. There are more if steps have to be shorter.
    pub fn points(mut self, count: usize) -> Self {
        self.points = count;
        self
    }

    /// Follows the family.
    ///
    /// # Errors
    /// An energy that is not positive, a mode that does not exist or does not swing, a model whose energy is
    /// not conserved. If the family could not be followed up to the energy, the error contains what was
    /// computed.
    pub fn run(self) -> Result<BackboneCurve<M::State>, BackboneError<M::State>> {
        if !(self.energy.is_finite() && self.energy > 0.0) || self.points < MIN_POINTS {
            return Err(BackboneError::Option { energy: self.energy, points: self.points });
        }
        let mode = self.linear_mode()?;
        let omega = mode.eigenvalue.im;
        let rest_energy = self.model.energy_function(&self.rest);
        let last = self.energy.sqrt();
        let mut curve =
            BackboneCurve { mode, rest_energy, energy_unit: names::energy_unit::<M>(), points: Vec::new() };
        let mut known: Vec<Member> = Vec::new();
        // The first motion, from the linear mode at a small energy.
        let first = last * FIRST_ENERGY_SHARE.sqrt();
        let guess = self.state_in_mode(&curve.mode, rest_energy, first)?;
        let resting = Member { start: joined(&self.rest), period: TAU / omega, s: 0.0 };
        match self.closed_motion(&guess, TAU / omega, rest_energy + first * first) {
            Ok(orbit) => self.add(&mut curve, &mut known, orbit),
            Err(reason) => return Err(stopped(curve, Some(reason))),
        }
        // The others, in steps of s, halved where none is found and lengthened after each success.
        let mut h = last / (self.points - 1) as f64;
        while let Some(here) = known.last().cloned() {
            if here.s >= last * (1.0 - END_TOLERANCE) {
                return Ok(curve);
            }
            let before = if known.len() < 2 { &resting } else { &known[known.len() - 2] };
            let s = (here.s + h).min(last);
            match self.next(before, &here, s, rest_energy) {
                Ok(orbit) => {
                    self.add(&mut curve, &mut known, orbit);
                    h = (1.5 * h).min(last / (self.points - 1) as f64);
                }
                Err(reason) => {
                    h *= 0.5;
                    if h < MIN_STEP_SHARE * last {
                        return Err(stopped(curve, reason));
                    }
                }
            }
        }
        Ok(curve)
    }

    /// The linear mode with which the family begins; an error unless energy is conserved and the mode
    /// oscillates.
    fn linear_mode(&self) -> Result<Mode, BackboneError<M::State>> {
        if !M::CONSERVED.iter().any(|quantity| quantity.kind.is_energy()) {
            return Err(BackboneError::NotConserved);
        }
        judge(self.model, &self.rest).map_err(BackboneError::Rest)?;
        let modes = linearize(self.model, &self.rest, &[]).and_then(|linear| linear.modes());
        let modes = modes.map_err(|error| BackboneError::Rest(error.into()))?;
        let count = modes.len();
        let mode =
            modes.into_iter().nth(self.mode).ok_or(BackboneError::NoMode { mode: self.mode, count })?;
        let oscillates =
            mode.eigenvalue.im > 0.0 && mode.eigenvalue.re.abs() <= MAX_RELATIVE_DAMPING * mode.eigenvalue.im;
        if oscillates { Ok(mode) } else { Err(BackboneError::DoesNotSwing { eigenvalue: mode.eigenvalue }) }
    }

    /// A state in the shape of the mode with an energy of about s².
    fn state_in_mode(
        &self,
        mode: &Mode,
        rest_energy: f64,
        s: f64,
    ) -> Result<M::State, BackboneError<M::State>> {
        let scales = scales(M::COORDINATES, self.rest.q().as_slice());
        let measure = scales.iter().fold(f64::INFINITY, |least: f64, x| least.min(*x));
        let mut size = FIRST_AMPLITUDE * measure;
        let mut state = self.rest;
        for _ in 0..4 {
            state = self.rest;
            // q = Re(shape e^{iωt}) and its rate at t = 0. A real shape begins at rest.
            for (i, x) in mode.shape.iter().enumerate() {
                state.q_mut().as_mut_slice()[i] += size * x.re;
                state.u_mut().as_mut_slice()[i] -= size * mode.eigenvalue.im * x.im;
            }
            self.project(&mut state).map_err(|error| BackboneError::Rest(error.into()))?;
            let energy = self.model.energy_function(&state) - rest_energy;
            if energy.is_nan() || energy <= 0.0 {
                return Err(BackboneError::NoEnergy { energy });
            }
            size *= s / energy.sqrt();
        }
        Ok(state)
    }

    /// Projects positions and velocities onto the constraints.
    fn project(&self, state: &mut M::State) -> Result<(), SolveError> {
        let constants = self.model.constants().map_err(SolveError::from)?;
        with_workspace::<M, _>(|workspace| {
            project_positions(self.model, &constants, state, workspace)?;
            project_velocities(self.model, &constants, state, workspace)
        })?;
        Ok(())
    }

    /// The closed motion of this energy near a guess.
    fn closed_motion(
        &self,
        guess: &M::State,
        period: f64,
        energy: f64,
    ) -> Result<PeriodicOrbit<M::State>, PeriodicError> {
        Shooting::new(self.model, *guess, period).hold_energy(energy).run()
    }

    /// The motion of the family at s, predicted by the secant through two others. The error is `None` if
    /// shooting found a motion of another family.
    fn next(
        &self,
        before: &Member,
        here: &Member,
        s: f64,
        rest_energy: f64,
    ) -> Result<PeriodicOrbit<M::State>, Option<PeriodicError>> {
        let part = (s - here.s) / (here.s - before.s);
        let step = (&here.start - &before.start) * part;
        let mut guess = self.state(&(&here.start + &step));
        self.project(&mut guess).map_err(PeriodicError::Solve)?;
        let period = here.period + part * (here.period - before.period);
        match self.closed_motion(&guess, period, rest_energy + s * s) {
            Ok(orbit) if belongs(here, &step, period, &orbit) => Ok(orbit),
            Ok(_) => Err(None),
            Err(error) => Err(Some(error)),
        }
    }

    fn state(&self, joined: &DVector<f64>) -> M::State {
        let n = M::Vector::LEN;
        let mut state = self.rest;
        state.q_mut().as_mut_slice().copy_from_slice(&joined.as_slice()[..n]);
        state.u_mut().as_mut_slice().copy_from_slice(&joined.as_slice()[n..]);
        state
    }

    /// Adds a motion to the family.
    fn add(
        &self,
        curve: &mut BackboneCurve<M::State>,
        known: &mut Vec<Member>,
        orbit: PeriodicOrbit<M::State>,
    ) {
        let energy = self.model.energy_function(&orbit.start) - curve.rest_energy;
        known.push(Member { start: joined(&orbit.start), period: orbit.period, s: energy.max(0.0).sqrt() });
        curve.points.push(BackbonePoint { energy, frequency: TAU / orbit.period, orbit });
    }
}

/// The error of a family that could not be followed to its end.
fn stopped<S: ModelState>(curve: BackboneCurve<S>, reason: Option<PeriodicError>) -> BackboneError<S> {
    let energy = curve.points.last().map_or(0.0, |last| last.energy);
    BackboneError::Stopped { energy, reason: reason.map(Box::new), curve: Box::new(curve) }
}

/// q and q̇ of a state in one vector.
fn joined<S: ModelState>(state: &S) -> DVector<f64> {
    let all: Vec<f64> = state.q().as_slice().iter().chain(state.u().as_slice()).copied().collect();
    DVector::from_vec(all)
}

/// Whether a motion is near the secant, and so belongs to the same family.
fn belongs<S: ModelState>(here: &Member, step: &DVector<f64>, period: f64, orbit: &PeriodicOrbit<S>) -> bool {
    let deviation = joined(&orbit.start) - &here.start - step;
    let n = step.len() / 2;
    // Velocities are divided by the frequency, so that they compare with coordinates.
    let rate = TAU / period;
    let size = |x: &DVector<f64>| x.rows(0, n).norm().hypot(x.rows(n, n).norm() / rate);
    size(&deviation) <= MAX_DEVIATION_FROM_SECANT * size(step).max(MIN_SECANT)
        && (orbit.period / period - 1.0).abs() < MAX_PERIOD_CHANGE
}
