//! How large a motion is, and what absolute tolerance that asks for.
//!
//! A tolerance is given once, for all units. Of a coordinate of some metres 1e-9 is nine digits, of one that
//! stays within a micrometre it is three. So where `.tolerance(..)` is given, or nothing, the absolute
//! tolerance is the tolerance times ten times the size of the motion, where that is less than 1 in its unit:
//! the largest |value| that any coordinate of one unit has, or any velocity of one, at the start or in the
//! first steps; of several units the smallest. What all of one unit have in common counts, not each
//! coordinate: one that hardly moves beside others, or is zero but for rounding, needs no digits of its own.
//! A unit in which nothing moves says nothing.
//!
//! Below rounding nothing can be asked for: what the last place of the state makes of the accelerations, in a
//! step.
//!
//! The tolerances of a run stay as they are chosen at its start, so that its steps can be made again. What
//! stays small later on is told in the summary.

use alloc::vec::Vec;
use core::fmt;

use crate::integrate::{Accelerations as _, Tolerances};
use crate::math;
use crate::model::{Constraints, Dynamics, Model, ModelState, Quantity, Vector};
use crate::simulate::events::location::Flow;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::sinks::Sink;
use crate::simulate::trajectory::record::{EventRecord, Record};
use crate::wording::Rounded;

/// Motions of this size and above are held to the tolerance as it stands.
const SMALL_MOTION: f64 = 0.1;
/// Steps that are made to see how large a motion becomes that starts small.
const STEPS: usize = 20;
/// Values below this part of the larger ones of their unit, or of 1, are zero but for rounding.
const ZERO: f64 = 1e-13;
/// Smallest absolute tolerance: some units in the last place of 1.
const LEAST_ABSOLUTE_TOLERANCE: f64 = 1e-15;
/// So many times what rounding moves velocities by in a step is no tolerance.
const ROUNDINGS: f64 = 10.0;
/// Fewer absolute tolerances than this in all of a motion are told of, where they are more by [`FEW_DIGITS`]
/// than the relative tolerance promises.
const FEW: f64 = 1e3;
const FEW_DIGITS: f64 = 100.0;

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

    pub(crate) fn add<M: Model>(&mut self, state: &M::State) {
        for (sizes, values) in [(&mut self.q, state.q()), (&mut self.u, state.u())] {
            for (size, value) in sizes.iter_mut().zip(values.as_slice()) {
                *size = size.max(value.abs());
            }
        }
    }

    /// The largest of each unit that is more than rounding.
    fn by_unit<'a>(sizes: &'a [f64], names: &'static [Quantity]) -> impl Iterator<Item = f64> + 'a {
        let first = |i: &usize| names[..*i].iter().all(|name| name.unit != names[*i].unit);
        let largest = move |i: usize| largest_of_unit(sizes, names, i);
        (0..names.len()).filter(first).map(largest).filter(|size| *size > ZERO)
    }

    /// The smallest size of a unit, of coordinates and velocities; `None` where nothing moves.
    fn smallest<M: Dynamics>(&self) -> Option<f64> {
        let all = Self::by_unit(&self.q, M::COORDINATES).chain(Self::by_unit(&self.u, M::COORDINATES));
        all.reduce(f64::min)
    }

    /// Whether some unit has only small values, so that it has to be seen how large they become.
    fn has_small<M: Dynamics>(&self) -> bool {
        let small = |sizes: &[f64]| {
            (0..sizes.len()).any(|i| largest_of_unit(sizes, M::COORDINATES, i) < SMALL_MOTION)
        };
        small(&self.q) || small(&self.u)
    }

    /// What stays within few absolute tolerances, and so has few digits.
    pub(crate) fn few_digits<M: Dynamics>(&self, tolerances: &Tolerances) -> Vec<FewDigits> {
        let Tolerances { absolute, relative } = *tolerances;
        let mut found = Vec::new();
        for (rate, sizes) in [(false, &self.q), (true, &self.u)] {
            for (i, &largest) in sizes.iter().enumerate() {
                let rounding = ZERO * largest_of_unit(sizes, M::COORDINATES, i).max(1.0);
                let few = largest < FEW * absolute && absolute > FEW_DIGITS * relative * largest;
                if few && largest > rounding {
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
    alike.fold(0.0, |most, (size, _)| most.max(*size))
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

/// Sees how large a motion becomes in its first steps, and keeps nothing else.
pub(crate) struct PilotRun<M: Model> {
    sizes: CoordinateSizes,
    left: usize,
    /// The last step: where it ended, and how long it was.
    last: Option<(M::State, f64)>,
}

impl<M: Constraints> PilotRun<M> {
    /// From a start; `None` where that is large enough for the tolerance as it stands, given what
    /// accelerations make of a start from rest.
    pub(crate) fn of(rhs: &mut RightHandSide<'_, '_, M>, start: &M::State) -> Option<Self> {
        let own = CoordinateSizes::of::<M>(start);
        if !own.has_small::<M>() {
            return None;
        }
        let mut sizes = own.clone();
        if let Ok(a) = rhs.accelerations(start.t(), start.q(), start.u()) {
            // What swings with amplitude q at q̈ = ω² q has velocities of ω q.
            for i in 0..M::Vector::LEN {
                sizes.u[i] = sizes.u[i].max(math::sqrt(a[i].abs() * sizes.q[i]));
            }
        }
        sizes.has_small::<M>().then_some(Self { sizes: own, left: STEPS, last: None })
    }

    /// The absolute tolerance that belongs to a tolerance, as far as has been seen.
    pub(crate) fn absolute(&self, rhs: &mut RightHandSide<'_, '_, M>, tolerance: f64) -> f64 {
        let (Some(size), Some((state, h))) = (self.sizes.smallest::<M>(), &self.last) else {
            return tolerance;
        };
        if size >= SMALL_MOTION {
            return tolerance;
        }
        let rounding = ROUNDINGS * rounding_of(rhs, state) * h.abs();
        (tolerance * size / SMALL_MOTION).max(LEAST_ABSOLUTE_TOLERANCE.max(rounding)).min(tolerance)
    }
}

/// What the last place of a state makes of its accelerations, at most.
fn rounding_of<M: Constraints>(rhs: &mut RightHandSide<'_, '_, M>, state: &M::State) -> f64 {
    let (t, q, u) = (state.t(), state.q(), state.u());
    let Ok(a) = rhs.accelerations(t, q, u) else { return f64::INFINITY };
    let mut most = 0.0f64;
    for sign in [-1.0, 1.0] {
        let mut moved = (*q, *u);
        for i in 0..M::Vector::LEN {
            // To either side in turn, so that differences move, too.
            let by = if i % 2 == 0 { sign } else { -sign } * f64::EPSILON;
            moved.0[i] += by * q[i];
            moved.1[i] += by * u[i];
        }
        let Ok(b) = rhs.accelerations(t, &moved.0, &moved.1) else { return f64::INFINITY };
        most = (0..M::Vector::LEN).fold(most, |most, i| most.max((a[i] - b[i]).abs()));
    }
    most
}

impl<M: Dynamics> Sink<M> for PilotRun<M> {
    fn step(
        &mut self,
        from: Record<M>,
        to: &M::State,
        _: &mut dyn FnMut(f64) -> Result<M::State, Kind>,
    ) -> Result<Flow, Kind> {
        self.sizes.add::<M>(to);
        self.last = Some((*to, from.h));
        self.left -= 1;
        // Sizes only grow: what is no longer small asks for nothing.
        let seen = self.left == 0 || !self.sizes.has_small::<M>();
        Ok(if seen { Flow::Stop } else { Flow::Continue })
    }

    fn stand(&mut self, _: Record<M>) {}

    fn event(&mut self, _: EventRecord<M::State>) {}
}
