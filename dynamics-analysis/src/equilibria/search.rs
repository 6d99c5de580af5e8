//! Equilibria from many starts.

use alloc::borrow::ToOwned;
use alloc::string::String;
use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};
use core::fmt;

use dynamics_runtime::constrain::assemble::positions_of;
use dynamics_runtime::constrain::at_time;
use dynamics_runtime::model::{Constraints, ModelState, Vector};

use super::statics::{model_terms, scales};
use super::{Equilibrium, EquilibriumError, EquilibriumOptions, find_holding};
use crate::displacement::fastest;
use crate::linearize::indices;
use crate::random_numbers::RandomNumbers;

/// Equilibria are sorted by coordinates in units of the inverse of this, so that rounding does not change
/// their order.
const SORTED_RESOLUTION: f64 = 1e9;
/// Velocities of one steady motion differ by at most this share of the fastest.
const SAME_VELOCITY: f64 = 1e-6;
/// Positions of one equilibrium differ by at most this share of their scale, in addition to ten times their
/// uncertainties. Equilibria closer than that, beside a fold, are reported as one.
const SAME_POSITION: f64 = 1e-7;
/// Angles within this distance of −π, in rad, are given as π: rounding would otherwise choose the sign.
const HALF_TURN_TOLERANCE: f64 = 1e-9;
/// Mass, forces and constraints that change by at most this share of their largest element in a full turn do
/// not depend on the number of turns. Sines of angles that are larger by 2π differ by some 10⁻¹⁶.
const PERIOD_TOLERANCE: f64 = 1e-12;

/// A search for equilibria with its options, before it runs.
#[must_use = "a search does nothing until `.run()`"]
pub struct EquilibriumSearch<'m, M: Constraints> {
    model: &'m M,
    around: M::State,
    starts: Vec<M::State>,
    random: usize,
    seed: u64,
    ranges: Vec<(String, [f64; 2])>,
    spread: Option<f64>,
    frozen: bool,
    moving: bool,
    held: Vec<String>,
}

impl<'m, M: Constraints> EquilibriumSearch<'m, M> {
    pub(crate) fn new(model: &'m M, around: M::State) -> Self {
        let (starts, ranges) = (Vec::new(), Vec::new());
        let (frozen, moving, held) = (false, false, Vec::new());
        Self { model, around, starts, random: 0, seed: 0, ranges, spread: None, frozen, moving, held }
    }

    /// For steady motions.
    pub(crate) fn moving(mut self) -> Self {
        self.moving = true;
        self
    }

    /// For rolling systems: the independent velocities that are kept in all starts, as for
    /// [`Analyze::steady_in`](crate::Analyze::steady_in). In searches for rest this has no effect.
    pub fn holding(mut self, independent: &[&str]) -> Self {
        self.held = independent.iter().map(|name| (*name).to_owned()).collect();
        self
    }

    /// Starts, instead of the state that the search was opened with.
    pub fn from(mut self, starts: impl IntoIterator<Item = M::State>) -> Self {
        self.starts.extend(starts);
        self
    }

    /// Adds this number of random starts, the same for the same seed. Angles on which the model depends with
    /// period 2π are chosen anywhere, other coordinates in their ranges. All starts are then moved onto the
    /// constraints. In searches for steady motions, coordinates without a range keep their values.
    pub fn random(mut self, count: usize) -> Self {
        self.random = count;
        self
    }

    /// The seed of the random starts; 0 unless given.
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The range of a coordinate in random starts; an array's name means all of its elements.
    pub fn within(mut self, coordinate: &str, range: [f64; 2]) -> Self {
        self.ranges.push((coordinate.to_owned(), range));
        self
    }

    /// The range of all coordinates that have none of their own: this distance to both sides of the given
    /// state.
    pub fn spread(mut self, distance: f64) -> Self {
        self.spread = Some(distance);
        self
    }

    /// Searches for the balance at this instant: forces and constraints are frozen at the time t. Without
    /// this, models in which they change with time are refused. Moving constraints are refused in any case,
    /// because nothing is at rest.
    pub fn at(mut self, t: f64) -> Self {
        self.frozen = true;
        self.around = at_time(&self.around, t);
        self.starts.iter_mut().for_each(|start| *start = at_time(start, t));
        self
    }

    /// Searches from each start, and gives each equilibrium once.
    ///
    /// # Errors
    /// Invalid options. If no start leads to an equilibrium, the reason of the first start.
    pub fn run(self) -> Result<EquilibriumSet<M::State>, EquilibriumError> {
        let periodic = periodic(self.model, &self.around);
        let mut starts: Vec<M::State> =
            self.starts.iter().map(|start| at_time(start, self.around.t())).collect();
        if starts.is_empty() {
            starts.push(self.around);
        }
        let mut found = EquilibriumSet {
            equilibria: Vec::new(),
            hits: Vec::new(),
            failures: Vec::new(),
            random: self.random,
            found_once: 0,
        };
        let ranges = if self.random > 0 { self.ranges(&periodic)? } else { Vec::new() };
        let asked = EquilibriumOptions { frozen: self.frozen, moving: self.moving };
        let held: Vec<&str> = self.held.iter().map(String::as_str).collect();
        let held = indices::<M>(&held)?;
        let find = |start: &M::State| find_holding(self.model, start, asked, &held);
        for start in starts {
            found.add(find(&start), &periodic);
        }
        let (given, mut numbers) = (found.hits.len(), RandomNumbers(self.seed));
        for _ in 0..self.random {
            let mut start = self.around;
            start
                .q_mut()
                .as_mut_slice()
                .iter_mut()
                .zip(&ranges)
                .for_each(|(q, range)| *q = numbers.within(*range));
            let placed = positions_of(self.model, start, &alloc::vec![false; M::Vector::LEN]);
            found.add(placed.map_err(Into::into).and_then(|start| find(&start)), &periodic);
        }
        found.found_once = found.hits[given..].iter().filter(|hits| **hits == 1).count();
        found.sorted()
    }

    /// The range of random values of every coordinate.
    fn ranges(&self, periodic: &[bool]) -> Result<Vec<[f64; 2]>, EquilibriumError> {
        let usual = |p: &bool| (*p && !self.moving).then_some([-PI, PI]);
        let mut ranges: Vec<Option<[f64; 2]>> = periodic.iter().map(usual).collect();
        if let Some(distance) = self.spread {
            if !(distance.is_finite() && distance > 0.0) {
                return Err(EquilibriumError::Range {
                    name: "spread".to_owned(),
                    range: [-distance, distance],
                });
            }
            for (range, q) in ranges.iter_mut().zip(self.around.q().as_slice()) {
                *range = range.or(Some([q - distance, q + distance]));
            }
        }
        for (name, range) in &self.ranges {
            if !(range[0].is_finite() && range[1].is_finite() && range[0] < range[1]) {
                return Err(EquilibriumError::Range { name: name.clone(), range: *range });
            }
            let is_meant = |known: &str| {
                known == name || known.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('['))
            };
            let mut any = false;
            for (own, _) in ranges.iter_mut().zip(M::COORDINATES).filter(|(_, q)| is_meant(q.name)) {
                (*own, any) = (Some(*range), true);
            }
            if !any {
                return Err(EquilibriumError::UnknownCoordinate { name: name.clone() });
            }
        }
        if self.moving {
            let stay = |(range, q): (Option<[f64; 2]>, &f64)| range.unwrap_or([*q; 2]);
            return Ok(ranges.into_iter().zip(self.around.q().as_slice()).map(stay).collect());
        }
        let missing = ranges.iter().position(Option::is_none);
        missing.map_or(Ok(()), |i| Err(EquilibriumError::NoRange { coordinate: M::COORDINATES[i].name }))?;
        Ok(ranges.into_iter().flatten().collect())
    }
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct EquilibriumSet<S: ModelState> {
    /// Each equilibrium once, by growing coordinates; angles on which the model depends with period 2π
    /// within (−π, π].
    pub equilibria: Vec<Equilibrium<S>>,
    /// The number of starts that led to each.
    pub hits: Vec<usize>,
    /// Why other starts led to none.
    pub failures: Vec<EquilibriumError>,
    random: usize,
    found_once: usize,
}

impl<S: ModelState> EquilibriumSet<S> {
    /// The estimated share of random starts that would lead to equilibria that were not found. It is the
    /// share of starts whose equilibrium was found only once (I. J. Good, Biometrika 40 (1953) 237); `None`
    /// without random starts. No search of this kind proves that it found all.
    #[must_use]
    pub fn unseen(&self) -> Option<f64> {
        (self.random > 0).then(|| self.found_once as f64 / self.random as f64)
    }

    /// Adds the result of a start: a new equilibrium, a hit of a known one, or a failure.
    fn add(&mut self, result: Result<Equilibrium<S>, EquilibriumError>, periodic: &[bool]) {
        let mut one = match result {
            Ok(one) => one,
            Err(error) => return self.failures.push(error),
        };
        for (q, _) in
            one.state.q_mut().as_mut_slice().iter_mut().zip(periodic).filter(|(_, periodic)| **periodic)
        {
            *q = principal(*q);
        }
        match self.equilibria.iter().position(|known| same(known, &one, periodic)) {
            Some(known) => {
                self.hits[known] += 1;
                if one.conditioning < self.equilibria[known].conditioning {
                    self.equilibria[known] = one;
                }
            }
            None => {
                self.equilibria.push(one);
                self.hits.push(1);
            }
        }
    }

    /// The set in ascending order of coordinates, or the first failure if it is empty.
    fn sorted(mut self) -> Result<Self, EquilibriumError> {
        if self.equilibria.is_empty() {
            if let Some(error) = self.failures.into_iter().next() {
                return Err(error);
            }
            return Ok(Self {
                equilibria: Vec::new(),
                hits: Vec::new(),
                failures: Vec::new(),
                random: 0,
                found_once: 0,
            });
        }
        let mut order: Vec<usize> = (0..self.hits.len()).collect();
        let key = |i: &usize| {
            self.equilibria[*i].state.q().as_slice().iter().map(|q| (q * SORTED_RESOLUTION).round() + 0.0)
        };
        order.sort_by(|i, j| {
            key(i)
                .zip(key(j))
                .map(|(a, b)| a.total_cmp(&b))
                .find(|o| o.is_ne())
                .unwrap_or(core::cmp::Ordering::Equal)
        });
        let mut all: Vec<Option<(Equilibrium<S>, usize)>> =
            self.equilibria.into_iter().zip(self.hits).map(Some).collect();
        (self.equilibria, self.hits) = order.into_iter().filter_map(|i| all[i].take()).unzip();
        Ok(self)
    }
}

/// A line for each equilibrium, their number, and the estimated share of starts that lead to others.
impl<S: ModelState> fmt::Display for EquilibriumSet<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (one, hits) in self.equilibria.iter().zip(&self.hits) {
            let values = one.coordinates.iter().zip(one.state.q().as_slice());
            for (i, (coordinate, value)) in values.enumerate() {
                write!(f, "{}{} = {:.10}", if i == 0 { "" } else { ", " }, coordinate.name, value + 0.0)?;
                let rate = one.state.u().as_slice()[i];
                if rate != 0.0 {
                    write!(f, " (moves by {rate:.6e} per second)")?;
                }
            }
            writeln!(f, "  (from {hits} starts)")?;
        }
        write!(f, "{} equilibria, {} starts led to none", self.equilibria.len(), self.failures.len())?;
        match self.unseen() {
            Some(unseen) => write!(f, "; about {:.1} % of random starts may lead to others", 100.0 * unseen),
            None => Ok(()),
        }
    }
}

/// Whether two results are one equilibrium, within their uncertainties.
fn same<S: ModelState>(a: &Equilibrium<S>, b: &Equilibrium<S>, periodic: &[bool]) -> bool {
    let scales = scales(a.coordinates, a.state.q().as_slice());
    let rates = a.state.u().as_slice().iter().zip(b.state.u().as_slice());
    let fastest = fastest(&a.state);
    rates.into_iter().all(|(u, w)| (u - w).abs() <= SAME_VELOCITY * fastest)
        && (0..scales.len()).all(|i| {
            let apart = (a.state.q().as_slice()[i] - b.state.q().as_slice()[i]).abs();
            let apart = if periodic[i] { apart.min((apart - TAU).abs()) } else { apart };
            let uncertain = a.uncertainty.as_slice()[i] + b.uncertainty.as_slice()[i];
            apart <= SAME_POSITION * scales[i] + 10.0 * uncertain
        })
}

/// The angle within (−π, π]. An angle that is −π to rounding becomes π.
fn principal(angle: f64) -> f64 {
    let turned = angle - TAU * ((angle + PI) / TAU).floor();
    if turned <= -PI + HALF_TURN_TOLERANCE { turned + TAU } else { turned }
}

/// Coordinates that are angles (rad, or without unit) on which mass, forces and constraints depend with
/// period 2π: at three random states, a turn leaves all of them as they are, to rounding.
pub(crate) fn periodic<M: Constraints>(model: &M, around: &M::State) -> Vec<bool> {
    let mut found: Vec<bool> = M::COORDINATES.iter().map(|q| q.is_angle() || q.unit.is_empty()).collect();
    let read = |state: &M::State| {
        let [mass, force, jacobian, gamma] = model_terms(model, state);
        let (positions, rates) = (model.residual(state), model.velocity_residual(state));
        [mass, force, jacobian, gamma, positions.as_slice().to_vec(), rates.as_slice().to_vec()]
    };
    let mut numbers = RandomNumbers(0x5eed);
    for _ in 0..3 {
        let mut state = *around;
        state.q_mut().as_mut_slice().iter_mut().for_each(|q| *q += numbers.within([-1.0, 1.0]));
        state.u_mut().as_mut_slice().iter_mut().for_each(|u| *u += numbers.within([-1.0, 1.0]));
        let here = read(&state);
        for (j, found) in found.iter_mut().enumerate().filter(|(_, found)| **found) {
            let mut turned = state;
            turned.q_mut().as_mut_slice()[j] += TAU;
            *found = here.iter().zip(&read(&turned)).all(|(a, b)| {
                let size = a.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                a.iter().zip(b).all(|(x, y)| (x - y).abs() <= PERIOD_TOLERANCE * size)
            });
        }
    }
    found
}
