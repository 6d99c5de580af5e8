//! Poincaré sections: a motion where it passes through a surface, or at equal intervals of time.
//!
//! The motion is that of [`Simulate::simulate`], whose steps end where the section function is zero: points
//! lie on the section as exactly as events do. A point that nearly returns to itself is a guess for a closed
//! motion: [`Section::closest_return`].

use alloc::boxed::Box;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use dynamics_runtime::model::{ModelState, Quantity, Vector};
use dynamics_runtime::simulate::{Direction, Flow, Simulate, Simulation};
use dynamics_view::{Axis, Panel};

use super::frame::stacked;
use super::symmetry::{EQUAL_ACCELERATIONS, MIN_ACCELERATION_SCALE};
use super::{PeriodicError, check, index, positive};
use crate::displacement::displaced;

/// Distance from the section at which the equations are compared for folding, in parts of the fold and of the
/// mean time between points. It is no simple fraction, so no term of the equations vanishes there by
/// symmetry.
const COMPARISON_PHASE: f64 = 0.137_035_9;

/// The name of the event of a section function.
const SECTION_EVENT_NAME: &str = "section";

/// Default number of points at equal intervals.
const DEFAULT_STROBE_POINTS: usize = 1000;
/// Most points at equal intervals: their times alone take nearly a gigabyte.
const MAX_STROBE_POINTS: usize = 100_000_000;
/// Default tolerance of the simulation.
const DEFAULT_TOLERANCE: f64 = 1e-10;
/// Points at which the equations are compared for folding. More find rarer differences and take longer.
const FOLD_COMPARISONS: usize = 12;
/// Least range of a coordinate or velocity as a scale of returns, relative to its largest value. Below it the
/// range may be rounding.
const MIN_RELATIVE_RANGE: f64 = 1e-6;
/// Range up to which a coordinate or velocity counts as constant; its scale is then 1.
const CONSTANT_RANGE: f64 = 1e-12;

/// A function of the state.
type Function<'m, S> = dyn Fn(&S) -> f64 + 'm;

/// Further options of the simulation.
type SectionRunSetup<'m, M> = dyn for<'s> Fn(Simulation<'s, M>) -> Simulation<'s, M> + 'm;

enum SectionKind<'m, S> {
    /// Not given yet.
    None,
    /// Zeros of a function.
    Function(Box<Function<'m, S>>, Direction),
    /// Zeros of an event of the model.
    Event(String, Direction),
    /// Equal intervals.
    Every(f64),
}

/// A section, with its options.
#[must_use = "nothing is computed until `.run()`"]
pub struct Poincare<'m, M: Simulate> {
    model: &'m M,
    start: M::State,
    kind: SectionKind<'m, M::State>,
    /// Number of sections that were given; only one is allowed.
    given: usize,
    skip: usize,
    points: Option<usize>,
    until: Option<f64>,
    tolerance: f64,
    /// Coordinates to fold, and their periods.
    folds: Vec<(String, f64)>,
    options: Option<Box<SectionRunSetup<'m, M>>>,
}

/// Points of a motion on a section.
#[derive(Clone, Debug, PartialEq)]
pub struct Section<S: ModelState> {
    /// The states, in the order of time. Folded coordinates lie within half a period on either side of 0.
    pub points: Vec<S>,
    /// Folded coordinates by index, and their periods.
    folded: Vec<(usize, f64)>,
    /// The multiple of the period that was subtracted at each point, for each folded coordinate.
    subtracted: Vec<Vec<f64>>,
    pub(crate) coordinates: &'static [Quantity],
}

/// A point that nearly returns to itself: a guess for a closed motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Return<S> {
    /// The point.
    pub state: S,
    /// Time until it comes back.
    pub period: f64,
    /// The largest distance from closing, relative to the range of each coordinate and velocity.
    pub miss: f64,
    /// Coordinates that are further by whole turns then: for [`super::Shooting::advance`].
    pub turns: Vec<(&'static str, f64)>,
}

impl<'m, M: Simulate> Poincare<'m, M> {
    pub(crate) fn new(model: &'m M, start: M::State) -> Self {
        let (skip, points, tolerance) = (0, None, DEFAULT_TOLERANCE);
        Self {
            model,
            start,
            kind: SectionKind::None,
            given: 0,
            skip,
            points,
            until: None,
            tolerance,
            folds: Vec::new(),
            options: None,
        }
    }

    /// The surface on which this function of the state is zero, passed in this direction. The start should
    /// not lie on it.
    pub fn section(self, function: impl Fn(&M::State) -> f64 + 'm, direction: Direction) -> Self {
        self.of_kind(SectionKind::Function(Box::new(function), direction))
    }

    /// The surface of an event of the model, passed in this direction.
    pub fn event(self, name: &str, direction: Direction) -> Self {
        self.of_kind(SectionKind::Event(name.into(), direction))
    }

    /// Equal intervals of time (stroboscopic), such as the period of a drive.
    pub fn every(self, period: f64) -> Self {
        self.of_kind(SectionKind::Every(period))
    }

    fn of_kind(mut self, kind: SectionKind<'m, M::State>) -> Self {
        (self.kind, self.given) = (kind, self.given + 1);
        self
    }

    /// Leaves out the first points, while the motion comes near its attractor. Default 0.
    pub fn skip(mut self, points: usize) -> Self {
        self.skip = points;
        self
    }

    /// The number of points. If there are fewer, the error contains them. Default: 1000 for equal intervals,
    /// and for a surface all up to the end.
    pub fn points(mut self, points: usize) -> Self {
        self.points = Some(points);
        self
    }

    /// The end of the search for crossings of a surface. It is needed for surfaces, because a crossing may
    /// never happen.
    pub fn until(mut self, time: f64) -> Self {
        self.until = Some(time);
        self
    }

    /// Permitted error, as of [`Simulation::tolerance`](dynamics_runtime::simulate::Simulation::tolerance).
    /// Default 1e-10.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Folds a coordinate on which the model depends with this period, such as an angle with 2π, into half a
    /// period on either side of 0. Refused if the equations differ one period further.
    pub fn fold(mut self, coordinate: &str, period: f64) -> Self {
        self.folds.push((coordinate.into(), period));
        self
    }

    /// Gives the simulation further options: an inputs law, a method, contacts. Its end, tolerance and output
    /// are set here.
    pub fn simulated(
        mut self,
        options: impl for<'s> Fn(Simulation<'s, M>) -> Simulation<'s, M> + 'm,
    ) -> Self {
        self.options = Some(Box::new(options));
        self
    }

    /// Follows the motion.
    ///
    /// # Errors
    /// A section that is crossed less often than requested; a simulation that fails; invalid options.
    pub fn run(self) -> Result<Section<M::State>, PeriodicError> {
        positive("the tolerance", self.tolerance)?;
        check(self.model, &self.start)?;
        if self.points == Some(0) {
            return Err(PeriodicError::Option {
                what: "the number of points",
                value: 0.0,
                needed: "at least 1",
            });
        }
        let mut folded = Vec::new();
        for (name, period) in &self.folds {
            positive("what a coordinate is folded by", *period)?;
            folded.push((index::<M>(name)?, *period));
        }
        if self.given > 1 {
            let needed = "1: one of `.section(..)`, `.event(..)` and `.every(..)`, once";
            return Err(PeriodicError::Option {
                what: "the number of sections",
                value: self.given as f64,
                needed,
            });
        }
        let points = match &self.kind {
            SectionKind::None => {
                let needed = "given by `.section(..)`, `.event(..)` or `.every(..)`";
                return Err(PeriodicError::Option { what: "the section", value: f64::NAN, needed });
            }
            SectionKind::Every(period) => self.strobe(*period)?,
            SectionKind::Function(function, direction) => {
                self.cross(Some(function), SECTION_EVENT_NAME, *direction)?
            }
            SectionKind::Event(name, direction) => self.cross(None, name, *direction)?,
        };
        for (coordinate, period) in &folded {
            self.check_fold(&points, *coordinate, *period)?;
        }
        Ok(fold(points, folded, M::COORDINATES))
    }

    /// Checks that the equations are the same one period of the coordinate further.
    fn check_fold(&self, points: &[M::State], coordinate: usize, by: f64) -> Result<(), PeriodicError> {
        let n = M::Vector::LEN;
        let (mut changes, mut largest) = (alloc::vec![0.0; n], alloc::vec![0.0; n]);
        let last = points.last().map_or(self.start.t(), ModelState::t);
        let apart = (last - self.start.t()) / points.len().max(1) as f64;
        for point in
            points.iter().step_by(points.len().div_ceil(FOLD_COMPARISONS).max(1)).chain([&self.start])
        {
            // Compare off the section, because terms with the coordinate, or with another one that is zero on
            // the section, may vanish on it. With constraints the state cannot be moved freely.
            let mut nearby = *point;
            if M::ROWS.is_empty() {
                let moved = point.u().as_slice().iter().map(|u| COMPARISON_PHASE * apart * u);
                nearby = displaced(point, moved);
                nearby.q_mut()[coordinate] += COMPARISON_PHASE * by;
            }
            let mut further = nearby;
            further.q_mut()[coordinate] += by;
            let [Ok(here), Ok(there)] = [&nearby, &further].map(|state| self.model.accelerations(state))
            else {
                continue;
            };
            for (i, (a, b)) in here.as_slice().iter().zip(there.as_slice()).enumerate() {
                changes[i] = f64::max(changes[i], (a - b).abs());
                largest[i] = f64::max(largest[i], a.abs().max(b.abs()));
            }
        }
        let most = largest.iter().fold(0.0, |most: f64, x| most.max(*x));
        let part = |i: usize| {
            if changes[i] > 0.0 { changes[i] / largest[i].max(MIN_ACCELERATION_SCALE * most) } else { 0.0 }
        };
        match (0..n).max_by(|i, j| part(*i).total_cmp(&part(*j))) {
            Some(worst) if part(worst) > EQUAL_ACCELERATIONS => Err(PeriodicError::NotAlike {
                turned: M::COORDINATES[coordinate].name,
                by,
                coordinate: M::COORDINATES[worst].name,
                change: part(worst),
            }),
            _ => Ok(()),
        }
    }

    fn simulation(&self, end: f64) -> Simulation<'_, M> {
        let run = self.model.simulate(self.start);
        let run =
            self.options.as_ref().map_or_else(|| self.model.simulate(self.start), |options| options(run));
        run.until(end).tolerance(self.tolerance).max_steps(u64::MAX)
    }

    /// Points at equal intervals of time.
    fn strobe(&self, period: f64) -> Result<Vec<M::State>, PeriodicError> {
        positive("the interval", period)?;
        let wanted = self.points.unwrap_or(DEFAULT_STROBE_POINTS);
        let total = self.skip.checked_add(wanted).filter(|total| *total <= MAX_STROBE_POINTS);
        let Some(total) = total else {
            let (value, needed) = (self.skip as f64 + wanted as f64, "at most a hundred million");
            return Err(PeriodicError::Option {
                what: "the number of points, with those that are left out,",
                value,
                needed,
            });
        };
        let times: Vec<f64> = (1..=total).map(|k| self.start.t() + period * k as f64).collect();
        let end = times.last().copied().unwrap_or(self.start.t());
        let mut points = Vec::new();
        let mut seen = 0;
        let run = self.simulation(end);
        let result = run.output_times(times).run_with(|state| {
            seen += 1;
            if seen > self.skip {
                points.push(*state);
            }
        });
        match result {
            Ok(_) if seen < total => {
                let reason = "an event ends it".into();
                Err(PeriodicError::BrokenOff { points: points.len(), reason, found: kept(&points) })
            }
            Ok(_) => Ok(points),
            Err(error) => Err(PeriodicError::BrokenOff {
                points: points.len(),
                reason: error.to_string(),
                found: kept(&points),
            }),
        }
    }

    /// Points at zeros of a section function, or of the event of this name if there is no function.
    fn cross(
        &self,
        function: Option<&Function<'m, M::State>>,
        name: &str,
        direction: Direction,
    ) -> Result<Vec<M::State>, PeriodicError> {
        let until = self.until.unwrap_or(f64::NAN);
        if !until.is_finite() || until <= self.start.t() {
            let what = "the time up to which a section is looked for, `.until(..)`,";
            return Err(PeriodicError::Option { what, value: until, needed: "after the start" });
        }
        // A crossing is an event of the simulation, which records the state. After enough points it ends the
        // run.
        let starts_on_section = function.is_some_and(|function| function(&self.start) == 0.0);
        let (mut points, mut seen) = (Vec::<M::State>::new(), 0);
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        let mut run = self.simulation(until);
        if let Some(function) = function {
            run = run.event(name, function);
        }
        let (points_of_run, skip, wanted) = (&mut points, self.skip, self.points.unwrap_or(usize::MAX));
        let seen_of_run = &mut seen;
        let run = run.on_event(name, direction, move |state: &mut M::State| {
            *seen_of_run += 1;
            if *seen_of_run > skip {
                points_of_run.push(*state);
            }
            if points_of_run.len() == wanted { Flow::Stop } else { Flow::Continue }
        });
        // The range of the function is for the error of a section that is not crossed.
        let result = run.run_with(|state| {
            if let Some(function) = function {
                let value = function(state);
                range = [range[0].min(value), range[1].max(value)];
            }
        });
        match result {
            // It is unknown whether a crossing at the start is one before or after it.
            Err(_) if points.iter().all(|point| point.t() == self.start.t()) && starts_on_section => {
                let (what, needed) =
                    ("the section function at the start", "other than 0; start a little before, or beside");
                Err(PeriodicError::Option { what, value: 0.0, needed })
            }
            Err(error) => Err(PeriodicError::BrokenOff {
                points: points.len(),
                reason: error.to_string(),
                found: kept(&points),
            }),
            Ok(_) if points.len() < self.points.unwrap_or(1) => {
                Err(PeriodicError::NeverCrossed { points: seen, until, range, found: kept(&points) })
            }
            Ok(_) => Ok(points),
        }
    }
}

/// Points as errors contain them: time, coordinates, then velocities of each.
fn kept<S: ModelState>(points: &[S]) -> Vec<Vec<f64>> {
    points
        .iter()
        .map(|point| [&[point.t()][..], point.q().as_slice(), point.u().as_slice()].concat())
        .collect()
}

/// Folds coordinates into half a period on either side of 0.
fn fold<S: ModelState>(
    mut points: Vec<S>,
    folded: Vec<(usize, f64)>,
    coordinates: &'static [Quantity],
) -> Section<S> {
    let mut subtracted = Vec::with_capacity(points.len());
    for point in &mut points {
        let turns = folded.iter().map(|(i, period)| {
            let turns = (point.q()[*i] / period).round() * period;
            point.q_mut()[*i] -= turns;
            turns
        });
        subtracted.push(turns.collect());
    }
    Section { points, folded, subtracted, coordinates }
}

impl<S: ModelState> Section<S> {
    /// The point that comes nearest to itself after so many crossings; `None` where there are not as many
    /// points.
    #[must_use]
    pub fn closest_return(&self, crossings: usize) -> Option<Return<S>> {
        let vectors: Vec<_> = self.points.iter().map(stacked).collect();
        let n = <S::Vector as Vector>::LEN;
        // The scale of each coordinate and velocity is its range.
        let size = |i: usize| {
            let range = vectors
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x[i]), high.max(x[i])]);
            let most = range[0].abs().max(range[1].abs());
            let reach = (range[1] - range[0]).max(MIN_RELATIVE_RANGE * most);
            if reach > CONSTANT_RANGE { reach } else { 1.0 }
        };
        let sizes: Vec<f64> = (0..2 * n).map(size).collect();
        let miss = |k: usize| {
            let off = |i: usize| {
                let off = vectors[k + crossings][i] - vectors[k][i];
                let period = self.folded.iter().find(|(index, _)| *index == i).map(|(_, period)| *period);
                (off - period.map_or(0.0, |period| (off / period).round() * period)).abs() / sizes[i]
            };
            (0..2 * n).map(off).fold(0.0, f64::max)
        };
        let last = self.points.len().checked_sub(crossings).filter(|_| crossings > 0)?;
        let best = (0..last).min_by(|a, b| miss(*a).total_cmp(&miss(*b)))?;
        let turns = self.folded.iter().enumerate().map(|(k, (i, period))| {
            let whole = self.subtracted[best + crossings][k] - self.subtracted[best][k];
            let off = vectors[best + crossings][*i] - vectors[best][*i];
            (self.coordinates[*i].name, whole + (off / period).round() * period)
        });
        Some(Return {
            state: self.points[best],
            period: self.points[best + crossings].t() - self.points[best].t(),
            miss: miss(best),
            turns: turns.collect(),
        })
    }

    /// Axes with a coordinate across and its velocity upward, and the points on them; `None` where there is
    /// no such coordinate.
    #[must_use]
    pub fn panel(&self, coordinate: &str) -> Option<Panel> {
        let i = self.coordinates.iter().position(|q| q.name == coordinate)?;
        let Quantity { name, unit, .. } = self.coordinates[i];
        let of = |unit: &str| if unit.is_empty() { String::new() } else { alloc::format!(" in {unit}") };
        let across = alloc::format!("{name}{}", of(unit));
        let upward = alloc::format!(
            "rate of {name}{}",
            of(&if unit.is_empty() { String::new() } else { alloc::format!("{unit}/s") })
        );
        let points = self.points.iter().map(|s| (s.q().as_slice()[i], s.u().as_slice()[i]));
        Some(Panel::new(Axis::new(across), Axis::new(upward)).dots("", points))
    }
}
