//! The pilot run: the size of a motion in its first steps, and the absolute tolerance for this size.
//!
//! One tolerance is given for all units. For a coordinate of some metres 1e-9 is nine digits, for one that
//! stays within a micrometre it is three. So with `.tolerance(..)`, or without any, the absolute tolerance is
//! the tolerance times ten times the size of the motion, where this size is below 0.1 in its unit. The size
//! of a unit is the largest |value| of all its coordinates, or of all its velocities, at the start and in the
//! first steps; of several units the smallest counts. A single coordinate that hardly moves beside others of
//! its unit, or is zero up to rounding, does not count, nor does a unit in which nothing moves.
//!
//! The absolute tolerance stays above the effect of rounding errors of the state on the velocities in one
//! step.
//!
//! The tolerances of a run do not change after its start, so that its steps can be repeated. Coordinates that
//! stay small later are reported by the summary ([`FewDigits`]). `simulation/execution.rs` makes the pilot
//! run; the tolerances enter the error norm in `integrate/step.rs`.

use alloc::vec::Vec;
use core::fmt;

use crate::integrate::{Accelerations as _, Tolerances};
use crate::math;
use crate::model::{Constraints, Dynamics, Model, ModelState, Quantity, Vector};
use crate::simulate::events::rules::Flow;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::sinks::Sink;
use crate::simulate::trajectory::record::Record;
use crate::wording::Rounded;

/// Size of a motion, in its unit, above which the absolute tolerance is the given tolerance. Smaller motions
/// get a proportionally smaller absolute tolerance.
const SMALL_MOTION: f64 = 0.1;
/// Most steps of a pilot run. They show how large a motion becomes that starts small or at rest.
const PILOT_STEPS: usize = 20;
/// Values below this part of the larger ones of their unit, or of 1, are zero up to rounding.
const ZERO_BY_ROUNDING: f64 = 1e-13;
/// Smallest absolute tolerance: some units in the last place of 1. Below it the error estimate is rounding.
const MIN_ABSOLUTE_TOLERANCE: f64 = 1e-15;
/// Smallest absolute tolerance in units of the velocity error that rounding causes in one step. At 1 the
/// error estimate would be rounding, and steps would be rejected without effect.
const MIN_TOLERANCE_IN_ROUNDINGS: f64 = 10.0;
/// A coordinate that stays below this many absolute tolerances is reported by the summary: it has at most
/// three digits.
const FEW_TOLERANCES: f64 = 1e3;
/// It is reported only where the absolute tolerance is this many times what the relative tolerance permits:
/// else the user asked for few digits.
const MORE_THAN_RELATIVE: f64 = 100.0;

/// The largest |qᵢ| and |q̇ᵢ| of the states of a motion.
#[derive(Clone, Debug)]
pub(crate) struct CoordinateSizes {
    q: Vec<f64>,
    u: Vec<f64>,
}

impl CoordinateSizes {
    pub(crate) fn of<M: Model>(state: &M::State) -> Self {
        let abs = |v: &M::Vector| v.as_slice().iter().map(|x| x.abs()).collect();
        Self { q: abs(state.q()), u: abs(state.u()) }
    }

    pub(crate) fn include<M: Model>(&mut self, state: &M::State) {
        for (sizes, values) in [(&mut self.q, state.q()), (&mut self.u, state.u())] {
            for (size, value) in sizes.iter_mut().zip(values.as_slice()) {
                *size = size.max(value.abs());
            }
        }
    }

    /// The size of each unit.
    fn by_unit<'a>(sizes: &'a [f64], names: &'static [Quantity]) -> impl Iterator<Item = f64> + 'a {
        let first = |i: &usize| names[..*i].iter().all(|name| name.unit != names[*i].unit);
        (0..names.len()).filter(first).map(move |i| largest_of_unit(sizes, names, i))
    }

    /// The smallest size of a unit, of coordinates and velocities; `None` where nothing moves.
    fn smallest<M: Dynamics>(&self) -> Option<f64> {
        let all = Self::by_unit(&self.q, M::COORDINATES).chain(Self::by_unit(&self.u, M::COORDINATES));
        all.filter(|size| *size > ZERO_BY_ROUNDING).reduce(f64::min)
    }

    /// Whether some unit has only small values, so that the first steps have to show how large they become.
    fn has_small<M: Dynamics>(&self) -> bool {
        let mut all = Self::by_unit(&self.q, M::COORDINATES).chain(Self::by_unit(&self.u, M::COORDINATES));
        all.any(|size| size < SMALL_MOTION)
    }

    /// The coordinates and velocities that stay within few absolute tolerances, and so have few digits.
    pub(crate) fn few_digits<M: Dynamics>(&self, tolerances: &Tolerances) -> Vec<FewDigits> {
        let Tolerances { absolute, relative } = *tolerances;
        let mut found = Vec::new();
        for (rate, sizes) in [(false, &self.q), (true, &self.u)] {
            for (i, &largest) in sizes.iter().enumerate() {
                let few =
                    largest < FEW_TOLERANCES * absolute && absolute > MORE_THAN_RELATIVE * relative * largest;
                let size = || largest_of_unit(sizes, M::COORDINATES, i).max(1.0);
                if few && largest > ZERO_BY_ROUNDING * size() {
                    found.push(FewDigits { name: M::COORDINATES[i].name, rate, largest, absolute });
                }
            }
        }
        found
    }
}

/// The largest size of the coordinates that have the unit of one of them.
fn largest_of_unit(sizes: &[f64], names: &[Quantity], of: usize) -> f64 {
    let alike = sizes.iter().zip(names).filter(|(_, name)| name.unit == names[of].unit);
    alike.fold(0.0, |largest, (size, _)| largest.max(*size))
}

/// A coordinate or a velocity that stays within a thousand absolute tolerances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FewDigits {
    /// The coordinate, or that whose velocity it is.
    pub name: &'static str,
    /// Whether it is a velocity.
    pub rate: bool,
    /// Its largest |value| at the ends of steps.
    pub largest: f64,
    /// The absolute tolerance.
    pub absolute: f64,
}

impl fmt::Display for FewDigits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, rate, largest, absolute } = *self;
        let of = if rate { "the velocity of " } else { "" };
        let times = largest / absolute;
        write!(f, "{of}{name} stays within {}, ", Rounded(largest))?;
        match times {
            1.0.. => write!(f, "{times:.0} times the absolute tolerance")?,
            _ => f.write_str("less than the absolute tolerance")?,
        }
        f.write_str("; for more digits of it give `.tolerances(absolute, relative)`")
    }
}

/// Sink of a pilot run: keeps the sizes of its states and nothing else.
pub(crate) struct PilotRun<M: Model> {
    sizes: CoordinateSizes,
    steps_left: usize,
    /// The end of the last step, and its length.
    last: Option<(M::State, f64)>,
}

impl<M: Constraints> PilotRun<M> {
    /// A pilot run from a start; `None` where the start is large enough for the given tolerance. The
    /// accelerations count, too: they tell the velocities of a start from rest.
    pub(crate) fn start(rhs: &mut RightHandSide<'_, '_, M>, start: &M::State) -> Option<Self> {
        let own = CoordinateSizes::of::<M>(start);
        if !own.has_small::<M>() {
            return None;
        }
        let mut sizes = own.clone();
        if let Ok(a) = rhs.accelerations(start.t(), start.q(), start.u()) {
            // An oscillation of amplitude q with q̈ = ω² q has velocities ω q = √(q̈ q).
            for i in 0..M::Vector::LEN {
                sizes.u[i] = sizes.u[i].max(math::sqrt(a[i].abs() * sizes.q[i]));
            }
        }
        sizes.has_small::<M>().then_some(Self { sizes: own, steps_left: PILOT_STEPS, last: None })
    }

    /// The absolute tolerance for a given tolerance, by the sizes so far.
    pub(crate) fn absolute_tolerance(&self, rhs: &mut RightHandSide<'_, '_, M>, tolerance: f64) -> f64 {
        let (Some(size), Some(last)) = (self.sizes.smallest::<M>(), &self.last) else {
            return tolerance;
        };
        scaled_tolerance(tolerance, size, || smallest_tolerance(rhs, last))
    }

    /// The absolute tolerances of all coordinates, then of all velocities: each by the size of its own unit.
    pub(crate) fn tolerances_by_unit(&self, rhs: &mut RightHandSide<'_, '_, M>, tolerance: f64) -> Vec<f64> {
        let floor = self.last.as_ref().map_or(tolerance, |last| smallest_tolerance(rhs, last));
        let of_unit = |sizes: &[f64], i: usize| match largest_of_unit(sizes, M::COORDINATES, i) {
            size if size > ZERO_BY_ROUNDING => scaled_tolerance(tolerance, size, || floor),
            _ => tolerance,
        };
        let all = [&self.sizes.q, &self.sizes.u].into_iter();
        all.flat_map(|sizes| (0..sizes.len()).map(|i| of_unit(sizes, i))).collect()
    }
}

/// A tolerance for a motion of a size, above a floor.
fn scaled_tolerance(tolerance: f64, size: f64, floor: impl FnOnce() -> f64) -> f64 {
    if size >= SMALL_MOTION {
        return tolerance;
    }
    (tolerance * size / SMALL_MOTION).max(floor()).min(tolerance)
}

/// The absolute tolerance at which the error estimate of a step to this state, of this length, is rounding.
fn smallest_tolerance<M: Constraints>(
    rhs: &mut RightHandSide<'_, '_, M>,
    (state, h): &(M::State, f64),
) -> f64 {
    let rounding = MIN_TOLERANCE_IN_ROUNDINGS * rounding_of_accelerations(rhs, state) * h.abs();
    MIN_ABSOLUTE_TOLERANCE.max(rounding)
}

/// The largest change of the accelerations by changes of the state in its last place.
fn rounding_of_accelerations<M: Constraints>(rhs: &mut RightHandSide<'_, '_, M>, state: &M::State) -> f64 {
    let (t, q, u) = (state.t(), state.q(), state.u());
    let Ok(a) = rhs.accelerations(t, q, u) else { return f64::INFINITY };
    let mut largest = 0.0f64;
    for sign in [-1.0, 1.0] {
        let mut displaced = (*q, *u);
        for i in 0..M::Vector::LEN {
            // Neighbours move to opposite sides, so that differences of coordinates change, too.
            let factor = if i % 2 == 0 { sign } else { -sign } * f64::EPSILON;
            displaced.0[i] += factor * q[i];
            displaced.1[i] += factor * u[i];
        }
        let Ok(b) = rhs.accelerations(t, &displaced.0, &displaced.1) else { return f64::INFINITY };
        largest = (0..M::Vector::LEN).fold(largest, |largest, i| largest.max((a[i] - b[i]).abs()));
    }
    largest
}

impl<M: Dynamics> Sink<M> for PilotRun<M> {
    fn step(
        &mut self,
        from: Record<M>,
        to: &M::State,
        _: &mut dyn FnMut(f64) -> Result<M::State, Kind>,
    ) -> Result<Flow, Kind> {
        self.sizes.include::<M>(to);
        self.last = Some((*to, from.h));
        self.steps_left -= 1;
        // Sizes only grow: once nothing is small the pilot run is finished.
        let is_finished = self.steps_left == 0 || !self.sizes.has_small::<M>();
        Ok(if is_finished { Flow::Stop } else { Flow::Continue })
    }
}
