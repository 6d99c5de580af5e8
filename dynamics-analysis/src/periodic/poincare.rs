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
use super::symmetry::{ROUNDING, SAME};
use super::{PeriodicError, check, index, positive};

/// Where equations are compared, in parts of the period of a coordinate: no fraction of any.
const COMPARISON_PHASE: f64 = 0.137_035_9;

/// The name under which a section function is an event.
const NAME: &str = "section";

/// Points at equal intervals unless their number is given.
const EVERY: usize = 1000;
/// Most of these: their times alone take nearly a gigabyte.
const MOST_RETURNS: usize = 100_000_000;

/// A function of the state.
type Function<'m, S> = dyn Fn(&S) -> f64 + 'm;

/// Further options of the simulation.
type SectionRunSetup<'m, M> = dyn for<'s> Fn(Simulation<'s, M>) -> Simulation<'s, M> + 'm;

enum SectionKind<'m, S> {
    /// Not said yet.
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
    /// Sections that were given.
    given: usize,
    skip: usize,
    points: Option<usize>,
    until: Option<f64>,
    tolerance: f64,
    turns: Vec<(String, f64)>,
    options: Option<Box<SectionRunSetup<'m, M>>>,
}

/// Points of a motion on a section.
#[derive(Clone, Debug, PartialEq)]
pub struct Section<S: ModelState> {
    /// The states, in the order of time; coordinates that were folded lie within half of what they are folded
    /// by on either side of 0.
    pub points: Vec<S>,
    /// Coordinates that were folded, by index, and by what.
    folded: Vec<(usize, f64)>,
    /// What was taken from them at each point.
    taken: Vec<Vec<f64>>,
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
        let (skip, points, tolerance) = (0, None, 1e-10);
        Self {
            model,
            start,
            kind: SectionKind::None,
            given: 0,
            skip,
            points,
            until: None,
            tolerance,
            turns: Vec::new(),
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
        self.turns.push((coordinate.into(), period));
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
        for (name, period) in &self.turns {
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
            SectionKind::Function(function, direction) => self.cross(Some(function), NAME, *direction)?,
            SectionKind::Event(name, direction) => self.cross(None, name, *direction)?,
        };
        for (coordinate, period) in &folded {
            self.check_fold(&points, *coordinate, *period)?;
        }
        Ok(fold(points, folded, M::COORDINATES))
    }

    /// That the equations are the same a period of a coordinate further.
    fn check_fold(&self, points: &[M::State], coordinate: usize, by: f64) -> Result<(), PeriodicError> {
        let n = M::Vector::LEN;
        let (mut changes, mut largest) = (alloc::vec![0.0; n], alloc::vec![0.0; n]);
        let last = points.last().map_or(self.start.t(), ModelState::t);
        let apart = (last - self.start.t()) / points.len().max(1) as f64;
        for point in points.iter().step_by(points.len().div_ceil(12).max(1)).chain([&self.start]) {
            // Beside the section, on which what depends on the coordinate may vanish, also by another that is
            // zero there, and goes through it; constraints hold it there.
            let mut beside = *point;
            if M::ROWS.is_empty() {
                let moved = point.u().as_slice().iter().map(|u| COMPARISON_PHASE * apart * u);
                beside.q_mut().as_mut_slice().iter_mut().zip(moved).for_each(|(q, by)| *q += by);
                beside.q_mut()[coordinate] += COMPARISON_PHASE * by;
            }
            let mut further = beside;
            further.q_mut()[coordinate] += by;
            let [Ok(here), Ok(there)] = [&beside, &further].map(|state| self.model.accelerations(state))
            else {
                continue;
            };
            for (i, (a, b)) in here.as_slice().iter().zip(there.as_slice()).enumerate() {
                changes[i] = f64::max(changes[i], (a - b).abs());
                largest[i] = f64::max(largest[i], a.abs().max(b.abs()));
            }
        }
        let most = largest.iter().fold(0.0, |most: f64, x| most.max(*x));
        let part =
            |i: usize| if changes[i] > 0.0 { changes[i] / largest[i].max(ROUNDING * most) } else { 0.0 };
        match (0..n).max_by(|i, j| part(*i).total_cmp(&part(*j))) {
            Some(worst) if part(worst) > SAME => Err(PeriodicError::NotAlike {
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

    fn strobe(&self, period: f64) -> Result<Vec<M::State>, PeriodicError> {
        positive("the interval", period)?;
        let wanted = self.points.unwrap_or(EVERY);
        let total = self.skip.checked_add(wanted).filter(|total| *total <= MOST_RETURNS);
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
        let on_it = function.is_some_and(|function| function(&self.start) == 0.0);
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
        let result = run.run_with(|state| {
            if let Some(function) = function {
                let value = function(state);
                range = [range[0].min(value), range[1].max(value)];
            }
        });
        match result {
            // Of a crossing at the start nothing says whether it was before or is to come.
            Err(_) if points.iter().all(|point| point.t() == self.start.t()) && on_it => {
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

/// Points as errors carry them.
fn kept<S: ModelState>(points: &[S]) -> Vec<Vec<f64>> {
    points
        .iter()
        .map(|point| [&[point.t()][..], point.q().as_slice(), point.u().as_slice()].concat())
        .collect()
}

fn fold<S: ModelState>(
    mut points: Vec<S>,
    folded: Vec<(usize, f64)>,
    coordinates: &'static [Quantity],
) -> Section<S> {
    let mut taken = Vec::with_capacity(points.len());
    for point in &mut points {
        let turns = folded.iter().map(|(i, period)| {
            let turns = (point.q()[*i] / period).round() * period;
            point.q_mut()[*i] -= turns;
            turns
        });
        taken.push(turns.collect());
    }
    Section { points, folded, taken, coordinates }
}

impl<S: ModelState> Section<S> {
    /// The point that comes nearest to itself after so many crossings; `None` where there are not as many
    /// points.
    #[must_use]
    pub fn closest_return(&self, crossings: usize) -> Option<Return<S>> {
        let vectors: Vec<_> = self.points.iter().map(stacked).collect();
        let n = <S::Vector as Vector>::LEN;
        // By the range of each; of what does not change, 1.
        let size = |i: usize| {
            let range = vectors
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x[i]), high.max(x[i])]);
            let most = range[0].abs().max(range[1].abs());
            let reach = (range[1] - range[0]).max(1e-6 * most);
            if reach > 1e-12 { reach } else { 1.0 }
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
            let whole = self.taken[best + crossings][k] - self.taken[best][k];
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
        let Quantity { name, unit } = self.coordinates[i];
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
