//! Baumgarte's gains: how fast tied gains correct the drift, and whether fixed gains bound the steps.
//!
//! Tied gains add −(3/2 Φ̇ + Φ/τ)/τ throughout a step ([`Formulation::BaumgarteTied`]); this file
//! chooses τ. The accelerations are found in [`Stabilization::set_step_correction`].
//!
//! [`Stabilization::set_step_correction`]: crate::simulate::stabilization::Stabilization::set_step_correction

use crate::math;
use crate::simulate::options::formulation::Formulation;

/// Largest rate |dτ/dt| at which τ of tied gains shrinks. Drift fades as e^(−¾∫dt/τ), with this rate
/// as τ^(3/2). So Φ/τ, the velocity that corrects it, falls with τ. Above 3/4 that velocity would grow.
const MAX_SHRINK_RATE: f64 = 0.5;

/// Least τ of the first step, in parts of its first attempted length. An event at the very start may leave a
/// first step of almost no length, and gains of 1/h would be unbounded.
const MIN_PART_OF_FIRST_STEP: f64 = 0.2;

/// The correction time τ of tied gains. It is the step size h, except where steps become shorter: then τ
/// shrinks no faster than [`MAX_SHRINK_RATE`].
///
/// A step that is cut to the part r of the one before would otherwise have to correct in r of the time what
/// had drifted before, and its velocities would be wrong by 1/r of their former error. With τ unchanged,
/// (Φ, τΦ̇) is multiplied by [[1 − r²/2, r − ¾r²], [−r, 1 − 3r/2]], whose eigenvalues are
/// below 1 for all r up to 1.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CorrectionTime {
    /// Start time of the last attempted step, and τ before that step.
    step_start: Option<f64>,
    before_step: f64,
    pub(crate) tau: f64,
    /// τ of a step that is repeated, 0 in a run.
    pub(crate) replayed: f64,
}

impl CorrectionTime {
    /// τ of a step of length h that starts at t.
    pub(crate) fn of_step(&mut self, t: f64, h: f64) -> f64 {
        if self.replayed > 0.0 {
            return self.replayed;
        }
        if self.step_start != Some(t) {
            (self.step_start, self.before_step) =
                (Some(t), if self.tau > 0.0 { self.tau } else { MIN_PART_OF_FIRST_STEP * h });
        }
        self.tau = math::max(h, self.before_step - MAX_SHRINK_RATE * h);
        self.tau
    }
}

/// The larger gain of Baumgarte's stabilization, where it may be what bounds the steps of a run: after at
/// least a thousand steps whose mean length is between a tenth of 1/gain and ten times that. Either stability
/// bounds the steps so, or the rounding noise that the gain amplifies. The message about too many steps names
/// it.
pub(crate) fn bounding_gain(
    formulation: Option<Formulation>,
    [start, now]: [f64; 2],
    steps_made: u64,
) -> Option<f64> {
    let Some(Formulation::Baumgarte { alpha, beta }) = formulation else { return None };
    let (gain, elapsed) = (alpha.max(beta), (now - start).abs());
    let mean_step_times_gain = elapsed * gain / steps_made as f64;
    (steps_made >= 1000 && (0.1..10.0).contains(&mean_step_times_gain)).then_some(gain)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Φ and Φ̇ after steps of these lengths, from Φ = 1.
    fn drift_after(steps: impl IntoIterator<Item = f64>) -> [f64; 2] {
        let (mut correction_time, mut t, [mut position, mut velocity]) =
            (CorrectionTime::default(), 0.0, [1.0, 0.0]);
        for h in steps {
            let tau = correction_time.of_step(t, h);
            let push = -(1.5 * velocity + position / tau) / tau;
            position += h * (velocity + 0.5 * h * push);
            velocity += h * push;
            t += h;
        }
        [position, velocity]
    }

    #[test]
    fn errors_are_gone_after_two_steps_of_one_size() {
        assert!(drift_after([0.1, 0.1]).iter().all(|x| x.abs() < 1e-15));
    }

    #[test]
    fn steps_that_are_cut_short_make_no_error_larger() {
        // Velocities are no larger than a correction within the length of the first step makes
        // them.
        for short in [1e-2, 1e-5, 1e-9] {
            let [position, velocity] = drift_after([1.0, short]);
            assert!(position.abs() < 1.0 && velocity.abs() < 2.0, "{short}: {position} {velocity}");
            let [position, velocity] = drift_after([1.0, short, 1.0, 1.0, 1.0]);
            assert!(position.abs() < 0.1 && velocity.abs() < 0.1, "{short}: {position} {velocity}");
        }
        // However many follow each other.
        let many = (0..400).map(|k| if k == 0 { 1.0 } else { 0.05 });
        assert!(drift_after(many).iter().all(|x| x.abs() < 1e-6));
    }

    #[test]
    fn a_first_step_of_no_length_has_finite_gains() {
        let mut correction_time = CorrectionTime::default();
        assert_eq!([1.0, 0.5, 0.0].map(|h| correction_time.of_step(0.0, h)), [1.0, 0.5, 0.2]);
    }

    #[test]
    fn a_step_that_is_tried_again_has_the_pace_of_its_start() {
        let mut correction_time = CorrectionTime::default();
        correction_time.of_step(0.0, 1.0);
        assert_eq!([0.5, 0.1, 0.5].map(|h| correction_time.of_step(1.0, h)), [0.75, 0.95, 0.75]);
        assert_eq!(correction_time.of_step(1.5, 0.5), 0.5);
        correction_time.replayed = 0.3;
        assert_eq!(correction_time.of_step(2.0, 0.1), 0.3);
    }
}
