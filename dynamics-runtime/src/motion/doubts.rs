//! Why a motion may be further from the true one than its tolerance lets hope, as far as the motion itself shows it.
//!
//! A step control keeps the error of each step. Five things it does not see are looked for here, at the recorded steps: tolerances that are finer than the
//! rounding of the values they are kept for; energy that drifts by more than so many permitted errors can; forces that its stages miss (`unseen.rs`); what the motion makes of the errors; and, of stiff motions, what they add up to (`halves.rs`). For
//! the fourth a neighbour of the motion is followed, step by step from as near as a permitted error, and with g its growth in a step, in permitted errors,
//! Eₙ₊₁ = g Eₙ + 1 adds up what every step leaves. That takes as many steps as the motion. It is a rough measure, from four to
//! a thousand times the error, as steps make smaller errors than are permitted: [`Simulation::estimate_error`](super::Simulation::estimate_error) is the better one.

use core::fmt;

use super::query::Motion;
use super::simulate::Simulate;
use super::summary::{Grouped, Rounded};
use super::unseen::Unseen;
use crate::integrate::{Knot, Method, Phase, System as _, Tolerances};
use crate::model::{ModelState, Vector};

/// More permitted errors than this are warned of.
const MUCH: f64 = 1e3;
/// Foreseen ones, that is: the error of a step is a third of what is permitted at most, and often a hundredth.
const MUCH_FORESEEN: f64 = 3e3;
/// What half steps show is measured, and not foreseen, and what they show lasts.
const MUCH_SHOWN: f64 = 60.0;
/// More than so many mean that the neighbour got lost, as beside a singularity of the coordinates, and are no measure.
const FORESEEN: f64 = 1e8;
/// Permitted errors of fewer units in the last place are below rounding: the stages of a step make as many.
const UNITS: f64 = 10.0;
/// Errors that grow by this factor more than by adding up grow by the motion.
const GROWING: f64 = 10.0;
/// Part of the energy that may drift before that is warned of.
const DRIFT: f64 = 0.01;
/// Nearest neighbour, in parts of 1 + |value|: half the digits, so that neither rounding nor curvature counts.
const NEAREST: f64 = 1e-8;
/// Places at which the energy's change by permitted errors is looked at.
const PLACES: usize = 16;

/// A value whose permitted error is below its rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BelowRounding {
    /// The coordinate, or that whose velocity it is.
    pub name: &'static str,
    /// Whether it is a velocity.
    pub rate: bool,
    /// Its value.
    pub value: f64,
    /// When.
    pub time: f64,
    /// The error that was permitted in a step there.
    pub permitted: f64,
}

/// What makes the accuracy of a motion doubtful.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Doubts {
    /// The value that is furthest below rounding with its permitted error; `None` with a fixed step or where there is none.
    pub below_rounding: Option<BelowRounding>,
    /// Drift of the energy, less all work, over what the permitted errors of one step can change it by; `None` with a fixed step.
    pub energy: Option<f64>,
    /// Drift of the energy, less all work, in parts of its scale; `None` where it has none.
    pub energy_part: Option<f64>,
    /// The steps were as long as was asked for.
    pub fixed: bool,
    /// Roughly how large the error of the motion is at most, in permitted errors, were every step's as large as permitted; `None` with a fixed step, and where
    /// the motion is stiff or the method is for stiff ones.
    pub amplified: Option<f64>,
    /// How far the motion is from one in half steps, in permitted errors, where that lasts or at the end: as a rule most of its error. Of stiff motions and methods for those;
    /// `None` with a fixed step.
    pub halved: Option<f64>,
    /// The method has stages of too low an order to follow a stiff direction that turns.
    pub low_stages: bool,
    /// A force that is over between the stages of a step; `None` with a fixed step.
    pub unseen: Option<Unseen>,
    /// That is as much as a whole unit of a coordinate or the whole value, and more than adding up the errors of so many steps explains.
    pub overwhelmed: bool,
}

impl<M: Simulate> Motion<'_, M> {
    /// `drift` of the energy at most, of `scale`.
    pub(super) fn doubts(&self, drift: f64, scale: f64) -> Doubts {
        // What has grown beyond all numbers has no scale.
        let energy_part =
            (scale > 0.0 || scale.is_nan()).then_some(if scale.is_finite() { drift / scale } else { f64::INFINITY });
        let fixed = self.trajectory.fixed;
        if fixed || self.trajectory.driver.is_none() {
            return Doubts { energy_part: energy_part.filter(|_| fixed), fixed, ..Doubts::default() };
        }
        let permitted = self.permitted_energy();
        let (repeatable, stiff) = (self.is_repeatable(), self.is_stiff());
        let amplified = (repeatable && !stiff).then(|| self.amplified());
        let Tolerances { absolute, relative } = self.trajectory.tolerances;
        let adding_up = GROWING * self.counts().steps as f64;
        Doubts {
            below_rounding: self.below_rounding(),
            // What rounds the energy is no drift.
            energy: (permitted > 0.0).then(|| (drift - 1e3 * f64::EPSILON * scale).max(0.0) / permitted),
            energy_part,
            fixed,
            amplified,
            halved: (repeatable && stiff).then(|| self.apart_from_halves()).flatten(),
            low_stages: self.method() == Method::Esdirk4,
            unseen: repeatable.then(|| self.unseen(stiff)).flatten(),
            overwhelmed: amplified.is_some_and(|times| times * absolute.max(relative) > 1.0 && times > adding_up),
        }
    }

    fn below_rounding(&self) -> Option<BelowRounding> {
        let Tolerances { absolute, relative } = self.trajectory.tolerances;
        let mut worst: Option<(f64, BelowRounding)> = None;
        for record in &self.trajectory.records {
            for (rate, values) in [(false, record.state.q()), (true, record.state.u())] {
                for (i, value) in values.as_slice().iter().enumerate() {
                    let permitted = absolute + relative * value.abs();
                    let units = permitted / (f64::EPSILON * value.abs());
                    if units < worst.as_ref().map_or(UNITS, |(least, _)| *least) {
                        let name = M::COORDINATES[i].name;
                        let time = record.state.t();
                        worst = Some((units, BelowRounding { name, rate, value: *value, time, permitted }));
                    }
                }
            }
        }
        worst.map(|(_, found)| found)
    }

    /// By how much permitted errors of one step change the energy, at most, at some places of the motion.
    fn permitted_energy(&self) -> f64 {
        let records = &self.trajectory.records;
        let tolerances = &self.trajectory.tolerances;
        let mut most = 0.0f64;
        for record in records.iter().step_by(records.len().div_ceil(PLACES)) {
            let state = self.complete(record.state);
            let here = self.model().energy_function(&state);
            let mut sum = 0.0;
            for i in 0..2 * M::Vector::LEN {
                let mut moved = state;
                let part = match i.checked_sub(M::Vector::LEN) {
                    None => &mut moved.q_mut()[i],
                    Some(i) => &mut moved.u_mut()[i],
                };
                let permitted = tolerances.scale(*part, *part);
                let step = permitted.max(1e-6 * (1.0 + part.abs()));
                *part += step;
                sum += (self.model().energy_function(&moved) - here).abs() * permitted / step;
            }
            most = most.max(sum);
        }
        most
    }

    /// Stiff motions let differences grow and die within steps, which says nothing about what lasts.
    fn is_stiff(&self) -> bool {
        self.counts().stiff_at.is_some() || self.switched().is_some() || self.method().is_for_stiff()
    }

    /// The largest E of this file's header.
    fn amplified(&self) -> f64 {
        let tolerances = self.trajectory.tolerances;
        let (mut sum, mut most) = (0.0f64, 0.0f64);
        let mut apart: Option<Phase<M::Vector>> = None;
        for (index, record) in self.trajectory.records.iter().enumerate() {
            if record.h == 0.0 {
                continue;
            }
            let step = self.step(index);
            let (from, to) = (&step.start.y, &step.end.y);
            let before = nearby(from, apart.as_ref(), &tolerances);
            let after = self.neighbour(index, &step.start, &before).map(|end| minus(&end, to));
            // Each against the tolerances where it is: over a step there and back nothing may be gained.
            let size = |apart: &Phase<M::Vector>, at| tolerances.norm(apart, at, at);
            let growth = after.map_or(1.0, |after| size(&after, to) / size(&before, from));
            apart = after.filter(|_| growth > 0.0);
            sum = if growth.is_finite() { growth * sum + 1.0 } else { sum + 1.0 };
            most = most.max(sum);
        }
        most
    }

    /// Where the step that leaves a record ends if it starts nearby.
    fn neighbour(&self, index: usize, start: &Knot<M::Vector>, apart: &Phase<M::Vector>) -> Option<Phase<M::Vector>> {
        let driver = self.trajectory.driver_of(index)?;
        let mut plant = self.plant(index);
        let y = plus(&start.y, apart);
        let a = plant.accelerations(start.t, &y.q, &y.u).ok()?;
        let step = crate::integrate::Step { start: Knot { t: start.t, y, a }, ..self.step(index) };
        let (end, _) = driver.maker().end_of(&mut plant, &step, &self.trajectory.tolerances)?;
        end.is_finite().then_some(end)
    }
}

/// A difference in the direction of the last one, as large as permitted or as can be seen; all elements where there was none.
fn nearby<V: Vector>(from: &Phase<V>, last: Option<&Phase<V>>, tolerances: &Tolerances) -> Phase<V> {
    let mut apart = last.copied().unwrap_or_else(|| {
        let mut all = Phase::<V>::zeros();
        for (part, values) in [(&mut all.q, &from.q), (&mut all.u, &from.u)] {
            for (i, (x, value)) in part.as_mut_slice().iter_mut().zip(values.as_slice()).enumerate() {
                // No sum or difference of two elements vanishes.
                *x = tolerances.scale(*value, *value) * (1.0 + 0.1 * i as f64);
            }
        }
        all
    });
    let norm = tolerances.norm(&apart, from, from);
    let resolved = NEAREST / tolerances.absolute.max(tolerances.relative).max(f64::MIN_POSITIVE);
    let factor = resolved.max(1.0) / norm;
    for part in [&mut apart.q, &mut apart.u] {
        part.as_mut_slice().iter_mut().for_each(|x| *x *= factor);
    }
    apart
}

fn plus<V: Vector>(a: &Phase<V>, b: &Phase<V>) -> Phase<V> {
    crate::integrate::zip(a, b, |a, b| a + b)
}

fn minus<V: Vector>(a: &Phase<V>, b: &Phase<V>) -> Phase<V> {
    crate::integrate::zip(a, b, |a, b| a - b)
}

impl Doubts {
    /// The warnings, each line after an end of line. Where the error was estimated nothing is guessed of it.
    pub(super) fn write(&self, f: &mut fmt::Formatter<'_>, estimated: bool) -> fmt::Result {
        const WARNING: &str = "\n  warning      ";
        if let Some(BelowRounding { name, rate, value, time, permitted }) = &self.below_rounding {
            let what = if *rate { "the velocity of " } else { "" };
            let (time, value) = (Rounded(*time), Rounded(*value));
            write!(
                f,
                "{WARNING}tolerance below rounding: {permitted:.1e} permitted of {what}{name} = {value} at t = {time}; give a larger relative one"
            )?;
        }
        if let Some(unseen) = &self.unseen {
            f.write_str(WARNING)?;
            unseen.write(f)?;
        }
        if let Some(times) = self.energy.filter(|times| *times > MUCH) {
            write!(
                f,
                "{WARNING}energy drifts by {} times what the tolerance permits in a step; give a smaller one",
                Times(times)
            )?;
        }
        if let Some(part) = self.energy_part.filter(|part| *part > DRIFT) {
            let remedy = if self.fixed { "shorten the fixed step" } else { "give a smaller tolerance" };
            write!(f, "{WARNING}energy drifts by {:.1} % of its scale; {remedy}", 100.0 * part)?;
        }
        if let Some(times) = self.halved.filter(|times| *times > MUCH_SHOWN && !estimated) {
            let instead = if self.low_stages { "use methods::Radau5" } else { "give a smaller tolerance" };
            let measure = "`.estimate_error()` measures it";
            let so_far = "errors of steps add up: half steps go";
            write!(f, "{WARNING}{so_far} {} times the tolerance beside; {measure}, or {instead}", Times(times))?;
        }
        let too_much = |times: &f64| *times > MUCH_FORESEEN || self.overwhelmed;
        if let Some(times) = self.amplified.filter(|times| too_much(times) && !estimated) {
            let measure = "`.estimate_error()` measures it";
            match times {
                ..FORESEEN => write!(
                    f,
                    "{WARNING}errors of steps add up and grow, up to {} times the tolerance; {measure}",
                    Times(times)
                )?,
                _ => write!(f, "{WARNING}errors of steps add up and grow, further than can be foreseen; {measure}")?,
            }
        }
        Ok(())
    }
}

/// How many times, in few digits.
struct Times(f64);

impl fmt::Display for Times {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            ..1e3 => Grouped((self.0 / 10.0) as u64 * 10).fmt(f),
            ..1e5 => Grouped((self.0 / 100.0) as u64 * 100).fmt(f),
            _ => write!(f, "{:.0e}", self.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Times;
    use alloc::string::ToString;

    #[test]
    fn times_have_two_digits() {
        let cases = [(75.1, "70"), (134.9, "130"), (3456.0, "3,400"), (2.4e6, "2e6")];
        for (times, text) in cases {
            assert_eq!(Times(times).to_string(), text);
        }
    }
}
