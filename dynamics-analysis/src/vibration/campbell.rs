//! Eigenvalues of a rotor over its speed: the Campbell diagram.
//!
//! Whirl goes forward where the orbit of a mode in the plane (x, y), x = Re(X e^{iωt}), y = Re(Y e^{iωt}),
//! turns as the rotor does: −2 Im(X̄ Y)/(|X|² + |Y|²) is 1 for a circle forward, −1 for one backward, 0 where
//! nothing turns (G. Genta, *Dynamics of Rotating Systems*, §2.4, §4.3). At a critical speed Ω of order k, Im
//! σ = k Ω, the number of modes above the line k Ω changes. At the onset of instability the number of growing
//! modes changes. Both numbers are counted, so that modes need not be followed through crossings, and the
//! speeds are bisected to the last digit. If a mode crosses a line and comes back between two neighbouring
//! speeds, or two modes cross it there in opposite directions, they are missed. A mode counts as growing if
//! its growth is larger than rounding may cause ([`Mode::conditioning`]).

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use dynamics_view::{Axis, Chart, Mark, Panel, Series};
use nalgebra::Complex;

use super::VibrationError;
use super::control::EIGENVALUE_ROUNDING_FACTOR;
use crate::linearize::{Linearization, LinearizeError, Mode};

/// Relative distance up to which eigenvalues count as equal. Equal eigenvalues have a plane of mode shapes,
/// of which none is distinguished, so their whirl is undetermined.
const EQUAL_EIGENVALUES: f64 = 1e-8;
/// Relative distance up to which critical speeds count as one. Rounding splits the crossing of two equal
/// frequencies by less.
const EQUAL_SPEEDS: f64 = 1e-10;
/// A mode belongs to a critical speed if its frequency is this near to the line of the order, relative to it.
const ON_ORDER_LINE: f64 = 10.0 * EQUAL_SPEEDS;
/// Largest |whirl| of a mode without direction: motion along a line, up to rounding of the mode shape.
const NO_WHIRL: f64 = 1e-6;
/// Relative distance from an onset at which modes are counted on both sides. It must exceed the error of the
/// bisected onset; modes that change between both sides would confuse the counts.
const ONSET_SIDE_DISTANCE: f64 = 1e-6;
/// Distance above an onset at speed 0, in rad/s.
const MIN_ONSET_DISTANCE: f64 = 1e-12;
/// Width of the interval at which bisection ends, in roundings of the speed.
const BISECTION_ROUNDINGS: f64 = 4.0;
/// Conditioning used for modes whose conditioning is infinite: about 1/√ε, as of a defective pair.
const CONDITIONING_OF_DEFECTIVE: f64 = 1e8;
/// Least Σ|X|² + |Y|² of a mode that moves in the planes; the largest element of the shape is 1.
const MIN_MOTION_IN_PLANES: f64 = 1e-16;

/// A mode at a speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotorMode {
    /// σ, in 1/s; of a pair the one with positive imaginary part.
    pub eigenvalue: Complex<f64>,
    /// From −1, a backward circle, to 1, a forward circle. `None` if nothing moves in the planes, or if two
    /// modes with the same eigenvalue leave it undetermined.
    pub whirl: Option<f64>,
    /// Bound of the rounding of the real part, in 1/s.
    rounding: f64,
}

impl RotorMode {
    /// `forward`, `backward`, or neither.
    #[must_use]
    pub fn direction(&self) -> &'static str {
        match self.whirl {
            Some(whirl) if whirl > NO_WHIRL => "forward",
            Some(whirl) if whirl < -NO_WHIRL => "backward",
            _ => "neither way",
        }
    }

    fn grows(&self) -> bool {
        self.eigenvalue.re > self.rounding
    }
}

/// A speed at which an unbalance, or another excitation of this order, meets the frequency of a mode. Two
/// modes with the same frequency have one entry each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CriticalSpeed {
    /// Ω, in rad/s.
    pub speed: f64,
    /// k: the excitation has k cycles per revolution.
    pub order: f64,
    /// The mode.
    pub mode: RotorMode,
}

/// A speed at which a mode becomes unstable or stable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onset {
    /// Ω.
    pub speed: f64,
    /// Whether it grows above this speed.
    pub unstable_above: bool,
    /// The mode.
    pub mode: RotorMode,
}

/// Eigenvalues over speeds, with critical speeds and onsets of instability.
#[derive(Clone, Debug, PartialEq)]
pub struct Campbell {
    /// The speeds, ascending.
    pub speeds: Vec<f64>,
    /// The modes at each of them.
    pub modes: Vec<Vec<RotorMode>>,
    /// The orders of the excitation.
    pub orders: Vec<f64>,
    /// Critical speeds, by order, then speed.
    pub critical: Vec<CriticalSpeed>,
    /// Onsets of instability, and ends.
    pub onsets: Vec<Onset>,
}

/// The rotor: its linear equations at a speed, and the planes in which whirl is measured.
struct CampbellModel<'a, F> {
    planes: &'a [(&'a str, &'a str)],
    at: F,
}

impl Campbell {
    /// The diagram over `speeds` in rad/s, ascending and not negative; convert revolutions per minute.
    /// `orders` are the k of the excitation (1 is unbalance). `planes` are pairs of coordinates (x, y) in
    /// which whirl is measured; the rotor turns from x to y at positive speeds. `at` returns the linear
    /// equations at a speed.
    ///
    /// # Errors
    /// Whatever the closure returns; names that are not coordinates; speeds and orders that are not positive
    /// and ascending numbers.
    pub fn new<E: Into<VibrationError>>(
        speeds: &[f64],
        orders: &[f64],
        planes: &[(&str, &str)],
        mut at: impl FnMut(f64) -> Result<Linearization, E>,
    ) -> Result<Self, VibrationError> {
        if speeds.len() < 2 {
            return Err(VibrationError::TooFew { what: "speeds", count: speeds.len(), needed: 2 });
        }
        let must_be = "a finite number, larger than the one before, and not negative";
        for (k, value) in speeds.iter().enumerate() {
            if !(value.is_finite() && *value >= 0.0 && (k == 0 || *value > speeds[k - 1])) {
                return Err(VibrationError::Value { what: "a speed", value: *value, must_be });
            }
        }
        if let Some(value) = orders.iter().find(|k| !(k.is_finite() && **k > 0.0)) {
            return Err(VibrationError::Value {
                what: "an order",
                value: *value,
                must_be: "a positive number",
            });
        }
        let mut study = CampbellModel { planes, at: |speed: f64| at(speed).map_err(Into::into) };
        let modes = speeds.iter().map(|speed| study.modes(*speed)).collect::<Result<Vec<_>, _>>()?;
        let mut found = Self {
            speeds: speeds.into(),
            modes,
            orders: orders.into(),
            critical: Vec::new(),
            onsets: Vec::new(),
        };
        for order in orders {
            found.find_critical(&mut study, *order)?;
        }
        found.find_onsets(&mut study)?;
        Ok(found)
    }

    fn find_critical<F>(&mut self, study: &mut CampbellModel<'_, F>, order: f64) -> Result<(), VibrationError>
    where
        F: FnMut(f64) -> Result<Linearization, VibrationError>,
    {
        let above = |speed: f64, modes: &[RotorMode]| {
            modes.iter().filter(|mode| mode.eigenvalue.im > order * speed).count()
        };
        let mut last = f64::NEG_INFINITY;
        for (speed, modes) in self.changes(study, &above)? {
            // Modes of one frequency cross together. Rounding finds several speeds; the first counts.
            if speed - last <= EQUAL_SPEEDS * speed {
                continue;
            }
            last = speed;
            let off = |mode: &RotorMode| (mode.eigenvalue.im - order * speed).abs();
            let there = modes.into_iter().filter(|mode| off(mode) <= ON_ORDER_LINE * order * speed);
            self.critical.extend(there.map(|mode| CriticalSpeed { speed, order, mode }));
        }
        Ok(())
    }

    fn find_onsets<F>(&mut self, study: &mut CampbellModel<'_, F>) -> Result<(), VibrationError>
    where
        F: FnMut(f64) -> Result<Linearization, VibrationError>,
    {
        let growing = |_: f64, modes: &[RotorMode]| modes.iter().filter(|mode| mode.grows()).count();
        for (speed, modes) in self.changes(study, &growing)? {
            let next = study.modes(speed * (1.0 + ONSET_SIDE_DISTANCE) + MIN_ONSET_DISTANCE)?;
            let before = study.modes(speed * (1.0 - ONSET_SIDE_DISTANCE))?;
            let unstable_above = growing(speed, &next) > growing(speed, &before);
            // The slowest growing mode on the unstable side has just crossed. A mode that stays on the limit
            // of stability at all speeds does not grow there.
            let side = if unstable_above { &next } else { &before };
            let slowest = side
                .iter()
                .filter(|mode| mode.grows())
                .min_by(|x, y| x.eigenvalue.re.total_cmp(&y.eigenvalue.re));
            let Some(grown) = slowest.map(|mode| mode.eigenvalue) else { continue };
            let off = |mode: &RotorMode| (mode.eigenvalue - grown).norm();
            let Some(mode) = modes.into_iter().min_by(|x, y| off(x).total_cmp(&off(y))) else { continue };
            self.onsets.push(Onset { speed, unstable_above, mode });
        }
        Ok(())
    }

    /// The speeds at which a count changes, with the modes there, by bisection of all intervals whose ends
    /// have different counts.
    fn changes<F>(
        &self,
        study: &mut CampbellModel<'_, F>,
        count: &dyn Fn(f64, &[RotorMode]) -> usize,
    ) -> Result<Vec<(f64, Vec<RotorMode>)>, VibrationError>
    where
        F: FnMut(f64) -> Result<Linearization, VibrationError>,
    {
        let counts: Vec<usize> =
            self.speeds.iter().zip(&self.modes).map(|(speed, modes)| count(*speed, modes)).collect();
        let mut found = Vec::new();
        let mut open: Vec<([f64; 2], [usize; 2])> = (1..counts.len())
            .rev()
            .map(|k| ([self.speeds[k - 1], self.speeds[k]], [counts[k - 1], counts[k]]))
            .collect();
        while let Some(([low, high], [below, above])) = open.pop() {
            if below == above {
                continue;
            }
            let middle = 0.5 * (low + high);
            let modes = study.modes(middle)?;
            if middle == low || middle == high || high - low <= BISECTION_ROUNDINGS * f64::EPSILON * high {
                found.push((middle, modes));
                continue;
            }
            let between = count(middle, &modes);
            open.push(([middle, high], [between, above]));
            open.push(([low, middle], [below, between]));
        }
        Ok(found)
    }

    /// Two panels over the speed: frequencies with the lines of the orders, and growth rates. The series are
    /// the directions of whirl.
    #[must_use]
    pub fn chart(&self) -> Chart {
        let of = |direction: &'static str, value: fn(&RotorMode) -> f64| -> Vec<(f64, f64)> {
            let at = self.speeds.iter().zip(&self.modes);
            at.flat_map(|(speed, modes)| {
                let these = modes
                    .iter()
                    .filter(move |mode| mode.direction() == direction && mode.eigenvalue.im > 0.0);
                these.map(|mode| (*speed, value(mode)))
            })
            .collect()
        };
        let panel = |title: &str, value: fn(&RotorMode) -> f64| {
            let empty = Panel::new(Axis::new("speed in rad/s"), Axis::new(title));
            ["forward", "backward", "neither way"].into_iter().enumerate().fold(
                empty,
                |panel, (k, direction)| {
                    let points = of(direction, value);
                    if points.is_empty() {
                        panel
                    } else {
                        panel.series(Series::new(direction, points).mark(Mark::Points).sign(k))
                    }
                },
            )
        };
        let top = self.modes.iter().flatten().map(|mode| mode.eigenvalue.im).fold(0.0, f64::max);
        let last = self.speeds.last().copied().unwrap_or(0.0);
        let mut frequencies = panel("frequency in rad/s", |mode| mode.eigenvalue.im);
        for order in &self.orders {
            let end = last.min(1.1 * top / order);
            frequencies = frequencies
                .series(Series::new(format!("{order}×"), [(0.0, 0.0), (end, order * end)]).solid());
        }
        let onsets = self.onsets.iter().map(|onset| onset.speed);
        let growth = panel("growth in 1/s", |mode| mode.eigenvalue.re);
        Chart::new("Campbell diagram")
            .panel(frequencies.instants("critical", self.critical.iter().map(|critical| critical.speed)))
            .panel(if self.onsets.is_empty() { growth } else { growth.instants("onset", onsets) })
            .panel_height(300.0)
    }
}

impl<F: FnMut(f64) -> Result<Linearization, VibrationError>> CampbellModel<'_, F> {
    fn modes(&mut self, speed: f64) -> Result<Vec<RotorMode>, VibrationError> {
        let linear = (self.at)(speed)?;
        let modes = linear.modes()?;
        let mut found = Vec::new();
        for mode in &modes {
            let near = |other: &&Mode| {
                (other.eigenvalue - mode.eigenvalue).norm() <= EQUAL_EIGENVALUES * mode.frequency()
            };
            let alone = modes.iter().filter(near).count() == 1;
            let whirl = whirl(mode, self.planes)?.filter(|_| alone);
            let conditioning =
                if mode.conditioning.is_finite() { mode.conditioning } else { CONDITIONING_OF_DEFECTIVE };
            let rounding = EIGENVALUE_ROUNDING_FACTOR * f64::EPSILON * conditioning * mode.frequency();
            found.push(RotorMode { eigenvalue: mode.eigenvalue, whirl, rounding });
        }
        Ok(found)
    }
}

/// Whirl of a mode, summed over all planes: −2 Σ Im(X̄ Y)/Σ(|X|² + |Y|²).
fn whirl(mode: &Mode, planes: &[(&str, &str)]) -> Result<Option<f64>, VibrationError> {
    let (mut turning, mut size) = (0.0, 0.0);
    let of = |name: &str| {
        mode.of(name).ok_or_else(|| {
            let nearest = dynamics_view::suggest(name, mode.coordinates.iter().map(|q| q.name));
            VibrationError::Linearize(LinearizeError::UnknownCoordinate { name: name.into(), nearest })
        })
    };
    for (x, y) in planes {
        let (x, y) = (of(x)?, of(y)?);
        turning -= 2.0 * (x.conj() * y).im;
        size += x.norm_sqr() + y.norm_sqr();
    }
    Ok((size > MIN_MOTION_IN_PLANES && mode.eigenvalue.im > 0.0).then(|| turning / size))
}

/// A line for each critical speed and each onset.
impl fmt::Display for Campbell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut lines: Vec<String> = Vec::new();
        // A mode that grows from the first speed on has no onset.
        if let (Some(speed), true) =
            (self.speeds.first(), self.modes.first().is_some_and(|m| m.iter().any(RotorMode::grows)))
        {
            lines.push(format!("unstable at the first speed, {speed}, already"));
        }
        for CriticalSpeed { speed, order, mode } in &self.critical {
            lines.push(format!("critical speed of order {order}: {speed:.9} ({})", mode.direction()));
        }
        for Onset { speed, unstable_above, mode } in &self.onsets {
            let side = if *unstable_above { "above" } else { "below" };
            lines.push(format!(
                "unstable {side} {speed:.9}: whirls {} with {:.6} rad/s",
                mode.direction(),
                mode.eigenvalue.im
            ));
        }
        f.write_str(&lines.join("\n"))
    }
}
