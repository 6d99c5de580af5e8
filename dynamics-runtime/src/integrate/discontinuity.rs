//! When steps end at discontinuities of the accelerations (kinks).
//!
//! A method of order p has this order only where the accelerations have p derivatives. Where a branch changes
//! within a step (`if`, `abs`, pieces of a spline), the error is of first or second order, and the error
//! estimate, made for p derivatives, may miss it altogether. So a step that passes a kink is repeated to end
//! just behind it. Within the step the branches of its start are held, since stages also lie beyond the kink:
//! accelerations of the other branch would spoil them.
//!
//! This file counts attempts and decides when the handling is suspended; `stepper/switching.rs` repeats the
//! steps, and [`Switching`](crate::integrate::Switching) locates the kinks.
//!
//! Source: Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*, §II.6.

/// Attempts to end one step at a kink. The interpolant that locates it becomes more accurate the nearer the
/// end of the step is to the kink, so that a few attempts are enough. Each costs a step.
const MAX_KINK_ATTEMPTS: u32 = 5;
/// A step that ends at a kink before this part of the proposed step is premature, if no branch changes there
/// after all. Beyond the border of stability an explicit step swings through branches, and its interpolant
/// shows kinks that the motion does not meet (`steps_that_only_seem_to_pass_a_branch_do_not_creep` in
/// `tests/slow/failures/when_methods_fail/stiffness.rs`).
const PREMATURE_PART: f64 = 1e-2;
/// After premature steps the next one is at most so many times as long as the last.
const GROWTH_AFTER_PREMATURE: f64 = 10.0;
/// So many premature steps in a row limit the next one. A single one may have met the end of a piece of a
/// spline.
const PREMATURE_IN_A_ROW: u32 = 3;
/// After sliding motion was found, so many steps are controlled by their error alone. A larger number costs
/// small steps along the kink, a smaller one frequent attempts to leave it.
const STEPS_WITHOUT_HANDLING: u32 = 32;

/// The state of the handling from one step to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DiscontinuityHandling {
    /// Attempts to end the present step at a kink.
    attempts: u32,
    /// Steps for which the handling is still suspended.
    suspended_steps: u32,
    /// The next step of fixed size is to end at a kink.
    is_next_requested: bool,
    /// The present step of fixed size is to end at a kink.
    is_requested: bool,
    /// Length of the last step, if it was made to end at a kink.
    last_length: Option<f64>,
    /// Premature steps in a row.
    premature_steps: u32,
}

impl DiscontinuityHandling {
    /// Requests that the next step ends at a kink although its size is fixed.
    pub(super) fn request(&mut self) {
        self.is_next_requested = true;
    }

    /// Begins a new step.
    pub(super) fn begin_step(&mut self) {
        self.attempts = 0;
        self.is_requested = core::mem::take(&mut self.is_next_requested);
    }

    /// Whether this step ends at a kink although its size is fixed.
    pub(super) fn is_requested(&self) -> bool {
        self.is_requested
    }

    /// Whether branches are held and kinks looked for.
    pub(super) fn is_active(&self) -> bool {
        self.suspended_steps == 0
    }

    /// Whether another attempt to end this step at a kink may be made.
    pub(super) fn has_attempts_left(&self) -> bool {
        self.is_active() && self.attempts < MAX_KINK_ATTEMPTS
    }

    /// Counts an attempt.
    pub(super) fn count_attempt(&mut self) {
        self.attempts += 1;
    }

    /// Suspends the handling: the motion slides along the kink, no side of it can be held.
    pub(super) fn suspend(&mut self) {
        self.suspended_steps = STEPS_WITHOUT_HANDLING;
    }

    /// The length of the next step, from the proposed one, where no branch changed since the last step.
    pub(super) fn limit_growth(&mut self, proposed: f64) -> f64 {
        let premature = self.last_length.filter(|length| *length < PREMATURE_PART * proposed);
        self.premature_steps = if premature.is_some() { self.premature_steps + 1 } else { 0 };
        premature
            .filter(|_| self.premature_steps >= PREMATURE_IN_A_ROW)
            .map_or(proposed, |length| GROWTH_AFTER_PREMATURE * length)
    }

    /// Notes an accepted step of length h.
    pub(super) fn accept_step(&mut self, h: f64) {
        self.last_length = (self.attempts > 0).then_some(h);
        self.suspended_steps = self.suspended_steps.saturating_sub(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_a_motion_slides_steps_are_left_to_the_error_for_a_while() {
        let mut handling = DiscontinuityHandling::default();
        handling.suspend();
        for _ in 0..STEPS_WITHOUT_HANDLING {
            handling.begin_step();
            assert!(!handling.has_attempts_left());
            handling.accept_step(1.0);
        }
        assert!(handling.has_attempts_left());
        (0..MAX_KINK_ATTEMPTS).for_each(|_| handling.count_attempt());
        assert!(!handling.has_attempts_left());
    }
}
