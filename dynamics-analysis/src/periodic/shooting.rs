//! Closed motions by shooting.
//!
//! The period is divided into K segments of equal length, one by default. The unknowns are the states xₖ at
//! their starts, and the period T if the equations do not prescribe it. Every segment must end where the next
//! begins, and the last where the first begins, except for whole turns:
//!
//! ```text
//! φ(xₖ, T/K) − xₖ₊₁ = 0        φ(x_{K−1}, T/K) − x₀ − turns = 0
//! ```
//!
//! Newton's method with the exact derivatives ∂φ/∂x of the variational equations and ∂φ/∂T = (q̇, q̈)/K;
//! steps are halved until the residuals decrease. In an autonomous system any state of the motion is a start,
//! so steps do not go along the motion (phase condition). If energy is conserved, closed motions come in
//! families: one is chosen by its energy, its period or a coordinate of its start. There is then one equation
//! more than unknowns, but they are consistent. They are solved by least squares, whose singular values say
//! whether the motion is isolated. Several segments are for motions that diverge within a period (multiple
//! shooting: Stoer & Bulirsch, *Introduction to Numerical Analysis*, §7.3.5; Seydel, *Practical Bifurcation
//! and Stability Analysis*, §7.4).

mod newton;

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use dynamics_runtime::model::{ModelState, Quantity, Vector};
use dynamics_runtime::simulate::Simulate;
use nalgebra::DVector;

use super::floquet::{self, Floquet};
use super::{
    DEFAULT_MAX_STEPS, DEFAULT_TOLERANCE, PeriodicError, check, check_period, finite, index, positive,
};

/// Default limit on Newton iterations.
const DEFAULT_MAX_ITERATIONS: usize = 60;

/// A condition that chooses one member of a family of closed motions.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Hold {
    /// The energy function has this value.
    Energy(f64),
    /// The coordinate of this index has this value at the start.
    Coordinate(usize, f64),
}

/// A search for a closed motion, with its options.
#[must_use = "a search does nothing until `.run()`"]
pub struct Shooting<'m, M: Simulate> {
    model: &'m M,
    guesses: Vec<M::State>,
    period: f64,
    segments: usize,
    hold_period: bool,
    energy: Option<f64>,
    coordinate: Option<(String, f64)>,
    turns: Vec<(String, f64)>,
    tolerance: f64,
    most_steps: usize,
    most_iterations: usize,
}

/// A closed motion with its stability.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicOrbit<S: ModelState> {
    /// A state of it.
    pub start: S,
    /// Its period.
    pub period: f64,
    /// The states at which the segments start, the first at `start`.
    pub nodes: Vec<S>,
    /// Multipliers and verdict.
    pub floquet: Floquet,
    /// How often the motion itself repeats within the period; up to six times are detected. It is more than 1
    /// if a multiple of its period was given, and 1 if time appears in the equations.
    pub repeats: usize,
    /// Newton iterations made.
    pub iterations: usize,
    /// The last correction, relative to the range of each coordinate: the error of the start, besides that of
    /// the integration.
    pub correction: f64,
    /// Largest over smallest singular value of the equations: the amplification of residuals in the start.
    pub conditioning: f64,
    /// The coordinates.
    pub coordinates: &'static [Quantity],
}

/// One line for each coordinate, then the multipliers.
impl<S: ModelState> fmt::Display for PeriodicOrbit<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, coordinate) in self.coordinates.iter().enumerate() {
            let (q, u) = (self.start.q().as_slice()[i], self.start.u().as_slice()[i]);
            writeln!(
                f,
                "{:<16}{q:>20.12e} {}, moves by {u:.12e} per second",
                coordinate.name, coordinate.unit
            )?;
        }
        writeln!(f, "{}", self.floquet)?;
        if self.repeats > 1 {
            writeln!(f, "the motion repeats {} times within this period", self.repeats)?;
        }
        write!(
            f,
            "{} iterations, last correction {:.1e}, conditioning {:.1e}",
            self.iterations, self.correction, self.conditioning
        )
    }
}

impl<'m, M: Simulate> Shooting<'m, M> {
    pub(crate) fn new(model: &'m M, guess: M::State, period: f64) -> Self {
        Self {
            model,
            guesses: alloc::vec![guess],
            period,
            segments: 1,
            hold_period: false,
            energy: None,
            coordinate: None,
            turns: Vec::new(),
            tolerance: DEFAULT_TOLERANCE,
            most_steps: DEFAULT_MAX_STEPS,
            most_iterations: DEFAULT_MAX_ITERATIONS,
        }
    }

    /// Divides the period into so many segments of equal length, for motions that diverge within it.
    pub fn segments(mut self, segments: usize) -> Self {
        self.segments = segments;
        self
    }

    /// States near the motion at equal parts of the period, from the start on, one guess for each segment. It
    /// is for motions of which no single shot stays near. Times are set by this function.
    pub fn through(mut self, states: impl IntoIterator<Item = M::State>) -> Self {
        let time = self.guesses[0].t();
        let states: Vec<M::State> = states.into_iter().collect();
        if !states.is_empty() {
            self.segments = states.len();
            self.guesses = states;
            self.guesses[0] = dynamics_runtime::constrain::at_time(&self.guesses[0], time);
        }
        self
    }

    /// Holds the period if the equations do not prescribe it: selects the member of a family with this
    /// period.
    pub fn hold_period(mut self) -> Self {
        self.hold_period = true;
        self
    }

    /// Selects the member of a family of closed motions with this value of the energy function.
    pub fn hold_energy(mut self, energy: f64) -> Self {
        self.energy = Some(energy);
        self
    }

    /// Selects the member of a family of closed motions that starts with this value of a coordinate: its
    /// amplitude if it starts at rest. If nothing is conserved, this selects the starting point on the
    /// motion.
    pub fn hold(mut self, coordinate: &str, value: f64) -> Self {
        self.coordinate = Some((coordinate.into(), value));
        self
    }

    /// A coordinate advances by this in a period: 2π for an angle that turns once.
    pub fn advance(mut self, coordinate: &str, by: f64) -> Self {
        self.turns.push((coordinate.into(), by));
        self
    }

    /// Permitted local error per step of state and tangent vectors. Default 1e-12.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Most steps of one shot. Default 200,000.
    pub fn max_steps(mut self, steps: usize) -> Self {
        self.most_steps = steps;
        self
    }

    /// Most iterations. Default 60.
    pub fn max_iterations(mut self, iterations: usize) -> Self {
        self.most_iterations = iterations;
        self
    }

    /// Searches the closed motion and computes its multipliers.
    ///
    /// # Errors
    /// If Newton's method does not converge, with the nearest motion; if there is a family of closed motions
    /// and none was chosen; if the search ends at rest; as [`Analyze::floquet`](crate::Analyze::floquet).
    pub fn run(self) -> Result<PeriodicOrbit<M::State>, PeriodicError> {
        check_period(self.period)?;
        positive("the tolerance", self.tolerance)?;
        if self.segments == 0 {
            return Err(PeriodicError::Option {
                what: "the number of segments",
                value: 0.0,
                needed: "at least 1",
            });
        }
        self.guesses.iter().try_for_each(|guess| check(self.model, guess))?;
        // The conditions that choose a member of a family, then the search, the multipliers and the repeats.
        let advance = self.advances()?;
        let mut holds = Vec::new();
        if let Some(energy) = self.energy {
            finite("the energy that is held", energy)?;
            holds.push(Hold::Energy(energy));
        }
        if let Some((name, value)) = &self.coordinate {
            finite("the coordinate that is held", *value)?;
            holds.push(Hold::Coordinate(index::<M>(name)?, *value));
        }
        let options = newton::ShootingOptions {
            segments: self.segments,
            hold_period: self.hold_period,
            holds: &holds,
            advance: &advance,
            tolerance: self.tolerance,
            most_steps: self.most_steps,
            most_iterations: self.most_iterations,
        };
        let found = newton::search(self.model, &self.guesses, self.period, &options)?;
        let limits = (self.tolerance, self.most_steps);
        let floquet = floquet::of_motion(self.model, &found.nodes, found.period, &advance, limits)?;
        let repeats =
            if floquet.autonomous { newton::repeats(self.model, &found, &advance, limits)? } else { 1 };
        Ok(PeriodicOrbit {
            start: found.nodes[0],
            period: found.period,
            floquet,
            repeats,
            iterations: found.iterations,
            correction: found.correction,
            conditioning: found.conditioning,
            nodes: found.nodes,
            coordinates: M::COORDINATES,
        })
    }

    /// The multipliers of the motion through the guess as it is, without a search. It is
    /// [`Analyze::floquet`](crate::Analyze::floquet) with [`Shooting::advance`], for known motions that go on
    /// turning.
    ///
    /// # Errors
    /// As [`Analyze::floquet`](crate::Analyze::floquet).
    pub fn judge(self) -> Result<Floquet, PeriodicError> {
        check_period(self.period)?;
        positive("the tolerance", self.tolerance)?;
        check(self.model, &self.guesses[0])?;
        let limits = (self.tolerance, self.most_steps);
        floquet::of_motion(self.model, &self.guesses[..1], self.period, &self.advances()?, limits)
    }

    fn advances(&self) -> Result<DVector<f64>, PeriodicError> {
        let mut advance = DVector::zeros(2 * M::Vector::LEN);
        for (name, by) in &self.turns {
            finite("what a coordinate advances by", *by)?;
            advance[index::<M>(name)?] += *by;
        }
        Ok(advance)
    }
}
