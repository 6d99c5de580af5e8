//! Restart after a zero crossing: the side to which an event function leaves zero at the start of a step.
//!
//! After an impact the function is zero up to rounding, and its next sign decides: a bounce may be over
//! within a millionth of the next step. So the function is evaluated at doubling distances from 2⁻⁴⁵ of
//! the step on, until its change grows regularly twice in a row: by a factor of 2 where it leaves with a
//! slope, of more than 3 where it leaves tangentially (4 for a parabola). Rounding noise may look regular by
//! chance, so changes below the noise do not count. What happens behind an eighth of the step is left to the
//! scan in `location.rs`.

use crate::integrate::Direction;
use crate::simulate::failure::SimulationErrorKind as Kind;

/// The sign of a function at the start of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SignState {
    /// 1 or −1.
    Sign(f64),
    /// It is zero at the start of the motion.
    ZeroAtStart,
    /// It is zero after a reset at a crossing in this direction.
    JustFired(Direction),
    /// It is zero for another reason.
    Zero,
}

/// How a function leaves zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Departure {
    /// With a slope; at θ its value has the sign of the slope.
    Slope { theta: f64, value: f64 },
    /// Without a slope; at θ its value has the sign of its curvature.
    Tangent { theta: f64, value: f64 },
    /// Towards this sign, but it turns back before its value has that sign.
    Hidden { sign: f64 },
    /// It does not change, or not regularly.
    Constant,
}

impl Departure {
    /// Whether it was seen with a positive value.
    pub(crate) fn is_seen_to_rise(self) -> bool {
        matches!(self, Self::Slope { value, .. } | Self::Tangent { value, .. } if value > 0.0)
    }
}

/// First part of a step at which the function is evaluated, 2⁻⁴⁵: 128 units in the last place of the
/// step.
const FIRST_THETA: f64 = 1.0 / 35_184_372_088_832.0;
/// Last part of a step at which it is evaluated. The scan of the step follows it from there.
const LAST_THETA: f64 = 0.125;
/// Ratios of successive changes, at doubling distances, of a function with a slope. Curvature and rounding
/// move them off 2; 3 and more is a tangent.
const SLOPE_GROWTH: core::ops::Range<f64> = 1.6..2.4;
/// Least ratio of successive changes of a function without a slope, whose change grows with the square at
/// least.
const MIN_TANGENT_GROWTH: f64 = 3.0;

/// How `g` leaves zero. At θ = 0 it is `start`, which is zero up to rounding; changes up to `noise` are
/// rounding.
pub(crate) fn departure_from_zero(
    start: f64,
    noise: f64,
    g: &mut dyn FnMut(f64) -> Result<f64, Kind>,
) -> Result<Departure, Kind> {
    let mut theta = FIRST_THETA;
    let mut last_changes = [0.0; 2];
    while theta <= LAST_THETA {
        let value = g(theta)?;
        let change = value - start;
        let [first, second] = [last_changes[1] / last_changes[0], change / last_changes[1]];
        last_changes = [last_changes[1], change];
        let slope = SLOPE_GROWTH.contains(&first) && SLOPE_GROWTH.contains(&second);
        let tangent = first > MIN_TANGENT_GROWTH && second > MIN_TANGENT_GROWTH && first.is_finite();
        theta *= 2.0;
        if !(slope || tangent) || change.abs() <= noise {
            continue;
        }
        return Ok(match first_seen(0.5 * theta, value, change.signum(), g)? {
            Some((theta, value)) if slope => Departure::Slope { theta, value },
            Some((theta, value)) => Departure::Tangent { theta, value },
            None => Departure::Hidden { sign: change.signum() },
        });
    }
    Ok(Departure::Constant)
}

/// The first part of the step from θ on at which the function has the sign to which it moves. By rounding it
/// may start on the other side of zero.
fn first_seen(
    mut theta: f64,
    mut value: f64,
    sign: f64,
    g: &mut dyn FnMut(f64) -> Result<f64, Kind>,
) -> Result<Option<(f64, f64)>, Kind> {
    loop {
        if value * sign > 0.0 {
            return Ok(Some((theta, value)));
        }
        theta *= 2.0;
        if theta > LAST_THETA {
            return Ok(None);
        }
        value = g(theta)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(g: impl Fn(f64) -> f64) -> Departure {
        departure_from_zero(g(0.0), 0.0, &mut |theta| Ok(g(theta))).unwrap()
    }

    #[test]
    fn slopes_are_seen_through_offsets_and_short_flights() {
        assert!(matches!(look(|x| 3.0 * x), Departure::Slope { value, .. } if value > 0.0));
        assert!(matches!(look(|x| -3.0 * x + 1e-16), Departure::Slope { value, .. } if value < 0.0));
        // Up and down again within 10⁻⁸ of the step.
        assert!(matches!(
            look(|x| 1e-8 * x - x * x),
            Departure::Slope { theta, value } if value > 0.0 && theta < 1e-8
        ));
        // The same above an offset that rounds away a part of it.
        assert!(matches!(look(|x| (5.0 + 1e-3 * x) - 5.0), Departure::Slope { value, .. } if value > 0.0));
        assert!(matches!(look(|x| 1e-6 * x - x * x - 1e-9), Departure::Hidden { sign: 1.0 }));
    }

    /// Steps of rounding that double a few times by chance, before a slope of zero bends upwards.
    #[test]
    fn rounding_that_looks_regular_is_no_slope() {
        let g = |x: f64| if x < 1e-9 { -1e-3 * x } else { x * x };
        let look = |noise| departure_from_zero(0.0, noise, &mut |theta| Ok(g(theta))).unwrap();
        assert!(matches!(look(0.0), Departure::Slope { value, .. } if value < 0.0));
        assert!(matches!(look(1e-12), Departure::Tangent { value, .. } if value > 0.0));
    }

    #[test]
    fn rest_is_tangential_and_a_constant_is_constant() {
        assert!(matches!(look(|x| -x * x), Departure::Tangent { value, .. } if value < 0.0));
        assert!(matches!(look(|x| x * x * x), Departure::Tangent { value, .. } if value > 0.0));
        assert_eq!(look(|_| 0.0), Departure::Constant);
    }
}
