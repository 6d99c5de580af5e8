//! Step size control by a PI controller.
//!
//! From the scaled error norms of this step and the one before, εₙ and εₙ₋₁, the next step is
//!
//! ```text
//! hₙ₊₁ = hₙ · clamp(safety · εₙ^(−α) · εₙ₋₁^β),    α = 1/(p + 1) − 0.75 β
//! ```
//!
//! with p the order of the error estimate. β > 0 keeps the step from oscillating where stability, not
//! accuracy, bounds it; β < 0 extrapolates a growing error, which suits steps that are long compared with the
//! times in which the motion changes. Source: Hairer, Nørsett, Wanner, *Solving Ordinary Differential
//! Equations I*, §II.4; Gustafsson, ACM TOMS 17 (1991) 533.

use crate::math;

/// Constants of the controller that suit a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerSettings {
    /// Factor below 1 that avoids narrow rejections.
    pub safety: f64,
    /// Weight β of the error before; 0 is integral control, below 0 it extrapolates.
    pub beta: f64,
    /// Smallest factor from one step to the next.
    pub shrink: f64,
    /// Largest factor from one step to the next.
    pub grow: f64,
}

/// Errors below this count as this large in the next step, and before the first step: that of `dopri5.f`.
const MIN_PREVIOUS_ERROR: f64 = 1e-4;

/// State of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    settings: ControllerSettings,
    alpha: f64,
    /// Error of the last accepted step.
    previous: f64,
    /// The last step was rejected.
    rejected: bool,
}

impl Controller {
    /// For a method whose error estimate has the given order.
    #[must_use]
    pub fn new(settings: ControllerSettings, error_order: u32) -> Self {
        Self {
            settings,
            alpha: 1.0 / f64::from(error_order + 1) - 0.75 * settings.beta,
            previous: MIN_PREVIOUS_ERROR,
            rejected: false,
        }
    }

    /// Whether a step with this error norm is accepted, and the factor for the next step size.
    pub fn judge(&mut self, error: f64) -> (bool, f64) {
        let Self { settings, alpha, .. } = *self;
        // An exact step has the error 0 and the largest factor.
        let integral = math::powf(error.max(1e-300), alpha);
        if error <= 1.0 {
            let wanted = settings.safety * math::powf(self.previous, settings.beta) / integral;
            let factor = wanted.clamp(settings.shrink, settings.grow);
            self.previous = error.max(MIN_PREVIOUS_ERROR);
            // After a rejection the step does not grow at once: it would be rejected again.
            let factor = if self.rejected { factor.min(1.0) } else { factor };
            self.rejected = false;
            (true, factor)
        } else {
            self.rejected = true;
            (false, (settings.safety / integral).clamp(settings.shrink, 1.0))
        }
    }

    /// Notes a step that was rejected because it could not be evaluated.
    pub fn failed(&mut self) {
        self.rejected = true;
    }

    /// Forgets the history, after a discontinuity.
    pub fn restart(&mut self) {
        self.previous = MIN_PREVIOUS_ERROR;
        self.rejected = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: ControllerSettings =
        ControllerSettings { safety: 0.9, beta: 0.04, shrink: 0.2, grow: 10.0 };

    #[test]
    fn follows_the_power_law_of_the_order() {
        let mut plain = Controller::new(ControllerSettings { beta: 0.0, ..SETTINGS }, 4);
        let (accepted, factor) = plain.judge(1.0 / 32.0);
        assert!(accepted);
        assert!((factor - 1.8).abs() < 1e-12, "0.9·32^(1/5) = 1.8, got {factor}");
        let (accepted, factor) = plain.judge(32.0);
        assert!(!accepted);
        assert!((factor - 0.45).abs() < 1e-12);
    }

    #[test]
    fn does_not_grow_just_after_a_rejection_and_stays_in_its_bounds() {
        let mut control = Controller::new(SETTINGS, 4);
        assert_eq!(control.judge(1e30), (false, 0.2));
        assert_eq!(control.judge(0.0), (true, 1.0));
        assert_eq!(control.judge(0.0), (true, 10.0));
    }
}
