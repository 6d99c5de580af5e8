//! How an event function leaves zero at the start of a step.
//!
//! After an impact the function is zero up to rounding, and what counts is where it goes: a bounce may be
//! over within a millionth of the next step. So it is looked at from 2⁻⁴⁵ of the step on, at doubling
//! distances, until its growth is regular: doubled three times over where it leaves with a slope, more where
//! it leaves tangentially. Rounding noise is not regular, but may look so by chance: what is below it does
//! not count.

/// How a function leaves zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Departure {
    /// With a slope; at θ it has a value of that sign.
    Slope { theta: f64, value: f64 },
    /// With slope zero; at θ it has a value of the sign to which it bends.
    Tangent { theta: f64, value: f64 },
    /// It turns back before it is seen on the side to which it left, which has this sign.
    Hidden { sign: f64 },
    /// It does not move.
    Constant,
}

impl Departure {
    /// Whether it is seen on the positive side.
    pub(crate) fn is_seen_to_rise(self) -> bool {
        matches!(self, Self::Slope { value, .. } | Self::Tangent { value, .. } if value > 0.0)
    }
}

/// First distance, 2⁻⁴⁵ of the step.
const NEAREST: f64 = 1.0 / 35_184_372_088_832.0;
/// Last distance: what happens later is the ordinary scan's.
const FARTHEST: f64 = 0.125;

/// Looks at `g`, which is `start` (zero up to rounding) at θ = 0, and whose changes up to `noise` are
/// rounding.
pub(crate) fn leave<E>(
    start: f64,
    noise: f64,
    mut g: impl FnMut(f64) -> Result<f64, E>,
) -> Result<Departure, E> {
    let mut theta = NEAREST;
    let mut past = [0.0; 2];
    while theta <= FARTHEST {
        let value = g(theta)?;
        let moved = value - start;
        let [a, b] = [past[1] / past[0], moved / past[1]];
        past = [past[1], moved];
        let slope = (1.6..2.4).contains(&a) && (1.6..2.4).contains(&b);
        let tangent = a > 3.0 && b > 3.0 && a.is_finite();
        theta *= 2.0;
        if !(slope || tangent) || moved.abs() <= noise {
            continue;
        }
        return Ok(match seen(0.5 * theta, value, moved.signum(), g)? {
            Some((theta, value)) if slope => Departure::Slope { theta, value },
            Some((theta, value)) => Departure::Tangent { theta, value },
            None => Departure::Hidden { sign: moved.signum() },
        });
    }
    Ok(Departure::Constant)
}

/// The first place from θ on where the function has the sign to which it moves: at the start it may be on the
/// other side by rounding.
fn seen<E>(
    mut theta: f64,
    mut value: f64,
    sign: f64,
    mut g: impl FnMut(f64) -> Result<f64, E>,
) -> Result<Option<(f64, f64)>, E> {
    loop {
        if value * sign > 0.0 {
            return Ok(Some((theta, value)));
        }
        theta *= 2.0;
        if theta > FARTHEST {
            return Ok(None);
        }
        value = g(theta)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(g: impl Fn(f64) -> f64) -> Departure {
        leave(g(0.0), 0.0, |theta| Ok::<f64, ()>(g(theta))).unwrap()
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
        let look = |noise| leave(0.0, noise, |theta| Ok::<f64, ()>(g(theta))).unwrap();
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
