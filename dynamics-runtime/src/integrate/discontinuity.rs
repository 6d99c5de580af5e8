//! Steps that end where accelerations are not smooth.
//!
//! A method of order p promises it only where the accelerations have p derivatives. Where a branch changes
//! within a step (`if`, `abs`, pieces of a spline) the error falls with the first or second power of its
//! size, and its estimate, made for p derivatives, may miss it altogether. So a step that passed such a place
//! is made again to end just behind it, and within it branches are held as they are at its start: stages,
//! too, stand beyond the place, and what they would find there is no derivative of what lies before it.
//! Source: Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*, §II.6.

/// Attempts to end one step at such a place: the interpolant that finds it is more accurate the nearer the
/// end of the step is.
const MOST_ATTEMPTS: u32 = 5;
/// Steps in a row that were ended before this part of what was proposed, where nothing changed after all, say
/// that interpolants are wrong, as they are far beyond the border of stability: the next one is no longer
/// than so many lengths of the last. One alone may have met the end of a piece of a spline.
const MISLED: (f64, f64) = (1e-2, 10.0);
const IN_A_ROW: u32 = 3;
/// For so many steps the control by the error has to do then.
const PAUSE: u32 = 32;

/// What is remembered from one landing to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Landing {
    attempts: u32,
    pause: u32,
    /// The next step, and this one, end there although their size is fixed.
    next: bool,
    now: bool,
    /// The length of the step before, if it was made to end there.
    ended: Option<f64>,
    /// How many in a row were ended far too early, as it seems.
    misled: u32,
}

impl Landing {
    /// The next step is to end there, although its size is fixed.
    pub(super) fn ask(&mut self) {
        self.next = true;
    }

    /// A new step begins.
    pub(super) fn begin(&mut self) {
        self.attempts = 0;
        self.now = core::mem::take(&mut self.next);
    }

    /// Whether this step ends there although its size is fixed.
    pub(super) fn is_asked(&self) -> bool {
        self.now
    }

    /// Whether branches are to be held.
    pub(super) fn is_on(&self) -> bool {
        self.pause == 0
    }

    /// Whether another attempt is to be made.
    pub(super) fn is_worth_trying(&self) -> bool {
        self.is_on() && self.attempts < MOST_ATTEMPTS
    }

    /// An attempt is made.
    pub(super) fn attempt(&mut self) {
        self.attempts += 1;
    }

    /// The motion slides along such a place: there is no side of it to go on to.
    pub(super) fn slides(&mut self) {
        self.pause = PAUSE;
    }

    /// How long the next step is, of which this was proposed, where branches are as they were before it.
    pub(super) fn unchanged(&mut self, proposed: f64) -> f64 {
        let early = self.ended.filter(|ended| *ended < MISLED.0 * proposed);
        self.misled = if early.is_some() { self.misled + 1 } else { 0 };
        early.filter(|_| self.misled >= IN_A_ROW).map_or(proposed, |ended| MISLED.1 * ended)
    }

    /// The step is made, of length h.
    pub(super) fn made(&mut self, h: f64) {
        self.ended = (self.attempts > 0).then_some(h);
        self.pause = self.pause.saturating_sub(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_a_motion_slides_steps_are_left_to_the_error_for_a_while() {
        let mut landing = Landing::default();
        landing.slides();
        for _ in 0..PAUSE {
            landing.begin();
            assert!(!landing.is_worth_trying());
            landing.made(1.0);
        }
        assert!(landing.is_worth_trying());
        (0..MOST_ATTEMPTS).for_each(|_| landing.attempt());
        assert!(!landing.is_worth_trying());
    }
}
