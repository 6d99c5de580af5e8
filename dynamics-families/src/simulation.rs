//! The builder of a simulation: one method for each option, then `.run()`.

use core::sync::atomic::AtomicBool;
use std::path::PathBuf;
use std::sync::Arc;

use dynamics_runtime::integrate::Tolerances;
use dynamics_runtime::simulate::{DEFAULT_MAX_STEPS, DEFAULT_TOLERANCE, OptionError};

use crate::constraints::{Rows, row_name, rows_at};
use crate::continuation::{self, EquilibriumBranch};
use crate::dispersion::{self, FamilyBranch};
use crate::equations::{Equations, Law};
use crate::error::FamilyError;
use crate::failure::{FamilyErrorKind, check_state};
use crate::file::FrameFile;
use crate::mass::Mass;
use crate::methods::FamilyMethod;
use crate::model::{FamilyModel, FamilyState, Sizes, View};
use crate::modes::{self, FamilyMode};
use crate::motion::FamilyMotion;
use crate::record::{Every, Recorder};
use crate::run::{Plan, Run};
use crate::statics::{self, FamilyEquilibrium};
use crate::step_bound;

/// Fixed steps may be longer than the bound by rounding: the bound itself is a step.
const BOUND_ROUNDING: f64 = 1e-9;
/// Radius of the half disc of h λ, on the side of decay, in which RK4 is stable.
const RK4_HALF_DISC: f64 = 2.6;
/// How far a start may be off the constraints, in parts of the size of positions, and of velocities.
const MOST_OFF: f64 = 1e-6;

/// Values of inputs: an array with a number for each, a number for one input, or a `Vec`.
pub trait InputRow {
    /// Writes the values. The error is their number where there are more or fewer.
    ///
    /// # Errors
    /// Another number of values than of inputs.
    fn write(self, inputs: &mut [f64]) -> Result<(), usize>;
}

impl<const N: usize> InputRow for [f64; N] {
    fn write(self, inputs: &mut [f64]) -> Result<(), usize> {
        if inputs.len() != N {
            return Err(N);
        }
        inputs.copy_from_slice(&self);
        Ok(())
    }
}

impl InputRow for f64 {
    fn write(self, inputs: &mut [f64]) -> Result<(), usize> {
        [self].write(inputs)
    }
}

impl InputRow for Vec<f64> {
    fn write(self, inputs: &mut [f64]) -> Result<(), usize> {
        if inputs.len() != self.len() {
            return Err(self.len());
        }
        inputs.copy_from_slice(&self);
        Ok(())
    }
}

/// What can be asked of every model with families.
pub trait SimulateFamilies: FamilyModel {
    /// Opens a simulation from a start state; options follow, [`FamilySimulation::run`] runs it.
    fn simulate(&self, start: Self::State) -> FamilySimulation<'_, Self> {
        FamilySimulation::new(self, start)
    }

    /// The longest step of leapfrog ([`StormerVerlet`](crate::methods::StormerVerlet)) at a state: 2/ω with a
    /// bound ω of the largest frequency, no estimate. Uniform bars attain it. Infinite where nothing
    /// oscillates.
    ///
    /// ω² is at most the largest Σⱼ |kᵢⱼ| / (mᵢᵢ − Σⱼ |mᵢⱼ|) of a row. Where M is not dominant on its
    /// diagonal, ω is enclosed by the signs of pivots. With large deflections the bound changes along the
    /// motion.
    ///
    /// # Errors
    /// Where the state belongs to another model, where M is not positive definite, and where a tangent that
    /// is not symmetric leaves no bound.
    fn longest_step(&self, state: &Self::State) -> Result<f64, FamilyError<Self>> {
        let failed = |kind: FamilyErrorKind| FamilyError::before(kind, state.t());
        let ends = self.ends().map_err(|error| failed(error.into()))?;
        check_state::<Self>(state, &ends).map_err(failed)?;
        let rows = rows_at(self, state, state.u(), &ends).map_err(failed)?;
        let multipliers = rows.as_ref().map_or(&[][..], |rows| &rows.multipliers);
        step_bound::longest_step(self, state, state.inputs(), &ends, multipliers).map_err(failed)
    }

    /// The equilibrium that Newton's method with a line search finds from a guess, with the inputs of the
    /// guess; its velocities do not count. The result says how many displacements are unstable, counted by
    /// the pivots of K.
    ///
    /// # Errors
    /// Where the iteration does not converge, where K is singular on the way, and where an input has no
    /// value.
    fn equilibrium(&self, guess: &Self::State) -> Result<FamilyEquilibrium<Self::State>, FamilyError<Self>> {
        statics::equilibrium(self, guess)
    }

    /// The branch of equilibria from the one near a guess, while the input with this name goes from its value
    /// in the guess to `until`: past limit loads, where the input turns back, by pseudo-arclength
    /// continuation. At most `most` points. Every point says how many displacements are unstable; a change of
    /// their number is a critical point.
    ///
    /// # Errors
    /// An input that is not declared, models with constraints, and a guess from which no equilibrium is
    /// found. What ends the branch early is in [`EquilibriumBranch::ended`], with the points before it.
    fn follow(
        &self,
        guess: &Self::State,
        input: &str,
        until: f64,
        most: usize,
    ) -> Result<EquilibriumBranch<Self::State>, FamilyError<Self>> {
        continuation::follow(self, guess, input, until, most)
    }

    /// The `count` lowest modes of vibration about a state, rising, without damping. They are counted: none
    /// is missed. At a state that is no equilibrium they are those of the tangent there.
    ///
    /// # Errors
    /// Where the tangent is not symmetric, and where modes do not converge.
    fn modes(&self, state: &Self::State, count: usize) -> Result<Vec<FamilyMode>, FamilyError<Self>> {
        modes::modes(self, state, count)
    }

    /// Waves between the ends that go on by `phase` radians from node to node, `[phase]`: frequency and group
    /// velocity of every branch, one for each family, by rising frequency.
    ///
    /// They follow from the rows of M and of the tangent stiffness of the node in the middle, at this state
    /// and without damping; ordinary coordinates and nodes more than 33 away are held. The nodes of the
    /// middle half have to be alike, as those of a uniform bar under a uniform stretch.
    ///
    /// # Errors
    /// Where the model has constraints or grids, where the nodes of the middle half are not alike, where the
    /// tangent is not symmetric, where a wave grows (ω² < 0), where M is not positive definite, and where a
    /// family has fewer than three nodes.
    fn dispersion(
        &self,
        state: &Self::State,
        phase: impl AsRef<[f64]>,
    ) -> Result<Vec<FamilyBranch>, FamilyError<Self>> {
        dispersion::dispersion(self, state, phase.as_ref())
    }
}

impl<M: FamilyModel> SimulateFamilies for M {}

/// A simulation with its options, before it runs.
#[must_use = "a simulation does nothing until `.run()`"]
pub struct FamilySimulation<'m, M: FamilyModel> {
    model: &'m M,
    start: M::State,
    end: Option<f64>,
    method: Option<FamilyMethod>,
    tolerances: Option<(Tolerances, bool)>,
    fixed: Option<f64>,
    first: Option<f64>,
    most: Option<f64>,
    max_steps: u64,
    every: Option<Every>,
    folder: Option<PathBuf>,
    law: Option<Law<'m, M::State>>,
    cancel: Option<&'m AtomicBool>,
    threads: usize,
}

impl<'m, M: FamilyModel> FamilySimulation<'m, M> {
    fn new(model: &'m M, start: M::State) -> Self {
        Self {
            model,
            start,
            end: None,
            method: None,
            tolerances: None,
            fixed: None,
            first: None,
            most: None,
            max_steps: DEFAULT_MAX_STEPS,
            every: None,
            folder: None,
            law: None,
            cancel: None,
            threads: 1,
        }
    }

    /// End time; may lie before the start: the motion then runs backwards in time.
    pub fn until(mut self, t: f64) -> Self {
        self.end = Some(t);
        self
    }

    /// Permitted error of each step, absolute (in the unit of each coordinate and velocity) and relative
    /// alike. Default 1e-9.
    ///
    /// The absolute tolerance of small motions is smaller. Where the coordinates of all fields of one unit,
    /// or their velocities, have stayed below 0.1, it is the tolerance times ten times the largest of them,
    /// but no less than a millionth of the tolerance.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerances = Some((Tolerances::both(tolerance), true));
        self
    }

    /// Permitted error of each step, absolute + relative·|value|, for coordinates and velocities. The
    /// absolute tolerance is not scaled with the size of the motion.
    pub fn tolerances(mut self, absolute: f64, relative: f64) -> Self {
        self.tolerances = Some((Tolerances { absolute, relative }, false));
        self
    }

    /// Overrides the choice of the method: one of [`crate::methods`].
    ///
    /// Without it: DOP853 for tolerances below 1e-6, else Dormand–Prince 5(4). With a fixed step
    /// Störmer–Verlet where energy is conserved and forces have no velocities, else RK4.
    pub fn method(mut self, method: impl Into<FamilyMethod>) -> Self {
        self.method = Some(method.into());
        self
    }

    /// Makes all steps this long (the last one shorter where it has to be); no error is estimated. An
    /// explicit method refuses a step beyond its stability at the start.
    pub fn fixed_step(mut self, h: f64) -> Self {
        self.fixed = Some(h);
        self
    }

    /// Length of the first step; chosen from the problem where it is not given.
    pub fn first_step(mut self, h: f64) -> Self {
        self.first = Some(h);
        self
    }

    /// Longest step, for inputs or forces that change within a time that the state does not show.
    pub fn max_step(mut self, h: f64) -> Self {
        self.most = Some(h);
        self
    }

    /// Most steps, rejected ones included. Default 1,000,000.
    pub fn max_steps(mut self, steps: u64) -> Self {
        self.max_steps = steps;
        self
    }

    /// When states are kept. Default: 300 frames, fewer where they would take more than 256 MiB of memory.
    pub fn record(mut self, every: Every) -> Self {
        self.every = Some(every);
        self
    }

    /// Writes the frames to a folder as they come, `t.npy`, `q.npy`, `u.npy` and `energies.npy`, which
    /// `numpy.load` reads; q and u have a row for each frame. What the files contained is lost. A run that
    /// breaks off leaves what it had. In memory stay the start, the end, and scalars of all frames.
    pub fn to_file(mut self, folder: impl Into<PathBuf>) -> Self {
        self.folder = Some(folder.into());
        self
    }

    /// Input values as a function of time and state. Called at every evaluation, so it should depend on its
    /// arguments alone. The state is copied for it, which takes about as long as adding two vectors. With
    /// Störmer–Verlet and its compositions the velocities that it sees are half a step old: let it depend
    /// on time and positions there.
    pub fn inputs<R: InputRow>(mut self, law: impl Fn(f64, &M::State) -> R + Send + Sync + 'm) -> Self {
        self.law = Some(Box::new(move |t, state, inputs| law(t, state).write(inputs)));
        self
    }

    /// Ends the simulation with an error as soon as the flag is set, by another thread or a signal handler.
    pub fn cancel(mut self, flag: &'m AtomicBool) -> Self {
        self.cancel = Some(flag);
        self
    }

    /// How many threads share an evaluation of the forces, and a drift of the coordinates. Default 1. Worth
    /// it for 20,000 nodes and more. The bits do not depend on it. Needs the feature `parallel`; without it,
    /// and where forces depend on nodes far away, one thread does all.
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = threads.max(1);
        self
    }

    /// Runs the simulation.
    ///
    /// # Errors
    /// Options that make no sense, steps that are too long for the method, and everything that ends the
    /// motion before its time. [`FamilyError::motion`] has what was computed.
    pub fn run(mut self) -> Result<FamilyMotion<'m, M>, FamilyError<M>> {
        let begun = std::time::Instant::now();
        let time = self.start.t();
        let failed = |kind: FamilyErrorKind| FamilyError::before(kind, time);
        let ends = self.model.ends().map_err(|error| failed(error.into()))?;
        check_state::<M>(&self.start, &ends).map_err(failed)?;
        let end = self.check_numbers().map_err(|error| failed(error.into()))?;
        let (method, reason) = self.choose().map_err(failed)?;
        let mass = Mass::new(self.model, &ends)
            .map_err(|problem| failed(FamilyErrorKind::of_mass::<M>(problem, &ends)))?;
        let mass = Arc::new(mass);
        let law = self.law.take();
        let mut equations = Equations::new(self.model, &mass, law.as_ref(), &self.start).map_err(failed)?;
        equations.threads = self.threads;
        equations.check_inputs().map_err(|error| failed(error.into()))?;
        equations.set_inputs(time, self.start.q(), self.start.u()).map_err(failed)?;
        self.start.parts_mut().3.copy_from_slice(&equations.inputs);
        self.place_on_constraints(&mut equations).map_err(failed)?;
        if !M::ROWS.is_empty() {
            let (q, u) = (self.start.q(), self.start.u());
            equations.accelerations(time, q, u, &mut vec![0.0; q.len()]).map_err(failed)?;
        }
        let multipliers = equations.rows.as_ref().map_or(&[][..], |rows| &rows.multipliers);
        let longest =
            step_bound::longest_step(self.model, &self.start, &equations.inputs, &ends, multipliers);
        // Without a bound a step is taken as it is; what then grows without bounds ends the run.
        let longest = longest.ok();
        if let (Some(step), Some(longest)) = (self.fixed, longest) {
            self.check_stability(method, step, longest, &ends).map_err(failed)?;
        }
        let file = match &self.folder {
            None => None,
            Some(folder) => Some(
                FrameFile::create(folder, self.start.q().len())
                    .map_err(|error| failed(FamilyErrorKind::File { message: error.to_string() }))?,
            ),
        };
        let (tolerances, scaled) = self.tolerances.unwrap_or((Tolerances::both(DEFAULT_TOLERANCE), true));
        let plan = Plan {
            end,
            method,
            reason,
            tolerances,
            scaled,
            fixed: self.fixed,
            first: self.first,
            most: self.most.unwrap_or(f64::INFINITY),
            max_steps: self.max_steps,
            cancel: self.cancel,
            longest,
            begun,
        };
        let kept_by_default = match self.folder {
            None => Every::for_memory(self.start.q().len()),
            Some(_) => Every::default(),
        };
        let every = self.every.unwrap_or(kept_by_default);
        let recorder = Recorder::new(every, &self.start, end, file);
        Run::new(equations, recorder, plan, &self.start)
            .go(&mass)
            .map(|record| FamilyMotion { model: self.model, record: Arc::new(record) })
    }

    /// Checks what a run checks before its first step and without inputs as functions: counts, options, the
    /// start, the mass matrix, and a fixed step against its bound. The bound is returned where there is one:
    /// the longest step of the chosen method.
    ///
    /// # Errors
    /// As for [`FamilySimulation::run`].
    #[doc(hidden)]
    pub fn check_beginning(&self) -> Result<Option<f64>, FamilyError<M>> {
        let failed = |kind: FamilyErrorKind| FamilyError::before(kind, self.start.t());
        let ends = self.model.ends().map_err(|error| failed(error.into()))?;
        check_state::<M>(&self.start, &ends).map_err(failed)?;
        self.check_numbers().map_err(|error| failed(error.into()))?;
        let (method, _) = self.choose().map_err(failed)?;
        Mass::new(self.model, &ends)
            .map_err(|problem| failed(FamilyErrorKind::of_mass::<M>(problem, &ends)))?;
        let longest = step_bound::longest_step(self.model, &self.start, self.start.inputs(), &ends, &[]);
        let Ok(longest) = longest else { return Ok(None) };
        let step = self.fixed.unwrap_or(0.0);
        self.check_stability(method, step, longest, &ends).map_err(failed)?;
        Ok(Some(longest * 0.5 * method.stability_border()))
    }

    /// Moves the start onto the constraints, off which it may be by a little.
    fn place_on_constraints(&mut self, equations: &mut Equations<'_, '_, M>) -> Result<(), FamilyErrorKind> {
        let Some(rows) = &mut equations.rows else { return Ok(()) };
        let (t, q, u, _) = self.start.parts_mut();
        let found = rows.project(self.model, *t, q, u, &equations.inputs)?;
        let violated = |rows: &Rows, row: usize, rate: bool| {
            Err(FamilyErrorKind::StartViolates { row: row_name::<M>(&rows.ends, row), rate })
        };
        if found.off > MOST_OFF {
            return violated(rows, found.row, false);
        }
        if found.rate_moved > MOST_OFF * found.speed {
            let (t, q, u) = (self.start.t(), self.start.q(), self.start.u());
            let mut a = vec![0.0; q.len()];
            equations.accelerations(t, q, u, &mut a)?;
            if let Some(rows) = &equations.rows
                && found.rate_moved > MOST_OFF * (found.speed + rows.natural_speed(&a))
            {
                return violated(rows, found.rate_row, true);
            }
        }
        Ok(())
    }

    /// Options that are numbers; the end.
    fn check_numbers(&self) -> Result<f64, OptionError> {
        let end = self.end.ok_or(OptionError::NoEnd)?;
        let number = |option, value: f64, good: bool, admissible| match good {
            true => Ok(()),
            false => Err(OptionError::Number { option, value, admissible }),
        };
        number("until", end, end.is_finite(), "a finite time")?;
        for (option, value) in
            [("fixed_step", self.fixed), ("first_step", self.first), ("max_step", self.most)]
        {
            if let Some(value) = value {
                number(option, value, value > 0.0 && value.is_finite(), "a positive time")?;
            }
        }
        if let Some((Tolerances { absolute, relative }, scaled)) = self.tolerances {
            if self.fixed.is_some() {
                let option = if scaled { "tolerance" } else { "tolerances" };
                return Err(OptionError::FixedStepExcludes { option });
            }
            let good = |x: f64| (1e-14..1.0).contains(&x);
            if scaled {
                number("tolerance", relative, good(relative), "a number from 1e-14 to below 1")?;
            } else if !(absolute >= 0.0 && absolute.is_finite() && good(relative)) {
                let admissible = "0 or more, and a number from 1e-14 to below 1";
                return Err(OptionError::Tolerances { absolute, relative, admissible });
            }
        }
        if self.fixed.is_some() {
            for (option, value) in [("first_step", self.first), ("max_step", self.most)] {
                if value.is_some() {
                    return Err(OptionError::FixedStepExcludes { option });
                }
            }
        }
        match self.every.unwrap_or_default() {
            Every::Time(interval) => {
                let count = (end - self.start.t()).abs() / interval;
                let good = interval > 0.0 && interval.is_finite() && count < 1e9;
                number("record(Every::time", interval, good, "a positive time, for at most 1e9 frames")?;
            }
            Every::Frames(frames) => {
                number("record(Every::Frames", frames as f64, frames >= 2, "at least 2")?;
            }
            Every::Steps(steps) => number("record(Every::steps", steps as f64, steps > 0, "at least 1")?,
            Every::Last => {}
        }
        Ok(end)
    }

    /// The method, and why that.
    fn choose(&self) -> Result<(FamilyMethod, String), FamilyErrorKind> {
        let Some(method) = self.method else { return Ok(self.choose_by_model()) };
        if method.is_splitting() && M::VELOCITY_FORCES {
            return Err(FamilyErrorKind::Unsuited {
                method,
                reason: "its forces depend on velocities",
                remedy: "choose methods::Rk4 or an adaptive method",
            });
        }
        if !M::ROWS.is_empty() && (method.is_splitting() || method.is_implicit()) {
            return Err(FamilyErrorKind::Unsuited {
                method,
                reason: "it has constraints",
                remedy: "choose methods::Rk4 or an adaptive method",
            });
        }
        if let FamilyMethod::GeneralizedAlpha { rho } = method
            && !(0.0..=1.0).contains(&rho)
        {
            let (option, admissible) = ("rho", "a factor from 0 to 1");
            return Err(OptionError::Number { option, value: rho, admissible }.into());
        }
        if self.fixed.is_none() && !method.is_adaptive() {
            return Err(FamilyErrorKind::NeedsFixedStep { method });
        }
        Ok((method, String::from("as asked for")))
    }

    fn choose_by_model(&self) -> (FamilyMethod, String) {
        let reason = String::from;
        match self.fixed {
            Some(_) if !M::ROWS.is_empty() => {
                (FamilyMethod::Rk4, reason("because steps are fixed and constraints hold"))
            }
            Some(_) if M::CONSERVATIVE && !M::VELOCITY_FORCES => {
                (FamilyMethod::StormerVerlet, reason("because steps are fixed and energy is conserved"))
            }
            Some(_) => (FamilyMethod::Rk4, reason("because steps are fixed and energy is not conserved")),
            None => {
                let relative =
                    self.tolerances.map_or(DEFAULT_TOLERANCE, |(tolerances, _)| tolerances.relative);
                if relative < 1e-6 {
                    (FamilyMethod::Dop853, format!("because the tolerance {relative:e} is below 1e-6"))
                } else {
                    (
                        FamilyMethod::DormandPrince5,
                        format!("because tolerance {relative:e} asks for few digits"),
                    )
                }
            }
        }
    }

    /// A fixed step that is too long for an explicit method.
    fn check_stability(
        &self,
        method: FamilyMethod,
        step: f64,
        longest: f64,
        ends: &Sizes,
    ) -> Result<(), FamilyErrorKind> {
        let mut bound = longest * 0.5 * method.stability_border();
        if M::VELOCITY_FORCES && method == FamilyMethod::Rk4 {
            let at = View { inputs: self.start.inputs(), ..self.start.view() };
            if let Some(damping) = step_bound::largest_damping(self.model, at, ends) {
                // |λ| of λ² + d λ + ω² = 0.
                let omega = 2.0 / longest;
                let largest = 0.5 * damping + (0.25 * damping * damping + omega * omega).sqrt();
                bound = bound.min(RK4_HALF_DISC / largest);
            }
        }
        if step > bound * (1.0 + BOUND_ROUNDING) {
            return Err(FamilyErrorKind::StepTooLong { method, step, longest: bound });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::RK4_HALF_DISC;

    /// |1 + z + z²/2 + z³/6 + z⁴/24| ≤ 1 in the half disc.
    #[test]
    fn rk4_is_stable_in_the_half_disc() {
        for k in 0..=1000 {
            for r in 1..=100 {
                let angle = core::f64::consts::FRAC_PI_2 * (1.0 + k as f64 / 1000.0);
                let radius = RK4_HALF_DISC * r as f64 / 100.0;
                let (x, y) = (radius * angle.cos(), radius * angle.sin());
                // Horner's rule in complex numbers.
                let (mut a, mut b) = (1.0, 0.0);
                for divisor in [4.0, 3.0, 2.0, 1.0] {
                    (a, b) = (1.0 + (a * x - b * y) / divisor, (a * y + b * x) / divisor);
                }
                assert!(a * a + b * b <= 1.0 + 1e-12, "{x} {y}");
            }
        }
    }
}
