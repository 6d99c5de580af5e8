//! How fast gains that are tied to the step take back what has drifted, and what drift makes of a motion.

use crate::math;
use crate::simulate::options::formulation::Formulation;

/// Pace at which τ of tied gains shrinks, in parts of that of time.
const SHRINKS: f64 = 0.5;

/// Part of the first step that was tried below which τ does not begin.
const FIRST: f64 = 0.2;

/// The time τ of tied gains: the step, but where steps become shorter it follows them no faster than time
/// goes on. A step that is cut short, to a part r of the one before, would else have to take back in r of the
/// time what had drifted in that, and leave velocities wrong by 1/r of what they were; going on at τ it
/// multiplies what has drifted by the eigenvalues of [[1 − r²/2, r − ¾r²], [−r, 1 − 3r/2]], less than 1 for
/// all r to 1. With τ shrinking at half the pace of time, drift, which fades as e^(−¾∫dt/τ), falls with the
/// power 3/2 of τ, so that velocities that take it back in τ fall, too.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pace {
    /// Where the step starts that was tried last, and τ before it.
    start: Option<f64>,
    before: f64,
    pub(crate) now: f64,
    /// Of a step that is made again; 0 of others.
    pub(crate) recorded: f64,
}

impl Pace {
    /// τ of a step of length h from a time.
    pub(crate) fn of_step(&mut self, t: f64, h: f64) -> f64 {
        if self.recorded > 0.0 {
            return self.recorded;
        }
        if self.start != Some(t) {
            // An event at the very start may leave nothing of the first step.
            (self.start, self.before) = (Some(t), if self.now > 0.0 { self.now } else { FIRST * h });
        }
        self.now = math::max(h, self.before - SHRINKS * h);
        self.now
    }
}

/// The larger gain of Baumgarte's stabilization, where it may bound the steps of a run: a thousand and more,
/// on average from a tenth of the time in which it takes drift back to ten times that. Stability bounds them
/// so, or the noise that the gain makes of rounding.
pub(crate) fn bounding_gain(
    formulation: Option<Formulation>,
    [start, now]: [f64; 2],
    made: u64,
) -> Option<f64> {
    let Some(Formulation::Baumgarte { alpha, beta }) = formulation else { return None };
    let (gain, way) = (alpha.max(beta), (now - start).abs());
    let steps = way * gain / made as f64;
    (made >= 1000 && (0.1..10.0).contains(&steps)).then_some(gain)
}

/// What drift made of a motion: constraints that are missed by a little lead a little elsewhere, near
/// positions where they nearly lose rank by much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriftInfluence {
    /// Part of the velocity by which the way back to the constraints changes.
    pub part: f64,
    /// When.
    pub time: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is left of Φ and Φ̇ after steps of these lengths, from Φ = 1.
    fn left(steps: impl IntoIterator<Item = f64>) -> [f64; 2] {
        let (mut pace, mut t, [mut position, mut velocity]) = (Pace::default(), 0.0, [1.0, 0.0]);
        for h in steps {
            let tau = pace.of_step(t, h);
            let push = -(1.5 * velocity + position / tau) / tau;
            position += h * (velocity + 0.5 * h * push);
            velocity += h * push;
            t += h;
        }
        [position, velocity]
    }

    #[test]
    fn errors_are_gone_after_two_steps_of_one_size() {
        assert!(left([0.1, 0.1]).iter().all(|x| x.abs() < 1e-15));
    }

    #[test]
    fn steps_that_are_cut_short_make_no_error_larger() {
        // By once the length of the first step, velocities are no larger than taking it back in that makes
        // them.
        for short in [1e-2, 1e-5, 1e-9] {
            let [position, velocity] = left([1.0, short]);
            assert!(position.abs() < 1.0 && velocity.abs() < 2.0, "{short}: {position} {velocity}");
            let [position, velocity] = left([1.0, short, 1.0, 1.0, 1.0]);
            assert!(position.abs() < 0.1 && velocity.abs() < 0.1, "{short}: {position} {velocity}");
        }
        // However many follow each other.
        let many = (0..400).map(|k| if k == 0 { 1.0 } else { 0.05 });
        assert!(left(many).iter().all(|x| x.abs() < 1e-6));
    }

    #[test]
    fn a_first_step_of_no_length_has_finite_gains() {
        let mut pace = Pace::default();
        assert_eq!([1.0, 0.5, 0.0].map(|h| pace.of_step(0.0, h)), [1.0, 0.5, 0.2]);
    }

    #[test]
    fn a_step_that_is_tried_again_has_the_pace_of_its_start() {
        let mut pace = Pace::default();
        pace.of_step(0.0, 1.0);
        assert_eq!([0.5, 0.1, 0.5].map(|h| pace.of_step(1.0, h)), [0.75, 0.95, 0.75]);
        assert_eq!(pace.of_step(1.5, 0.5), 0.5);
        pace.recorded = 0.3;
        assert_eq!(pace.of_step(2.0, 0.1), 0.3);
    }
}
