//! What it took to keep the constraints of a run, as the summary reports it.

use crate::simulate::stabilization::near_singular::DriftInfluence;

/// Counts of what it took to keep the constraints of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StabilizationCounts {
    /// Evaluations by the general solver where generated code did not apply: a pivot was too small, a
    /// constraint was released.
    pub general: u64,
    /// First time at which generated code did not apply although all constraints held.
    pub general_at: Option<f64>,
    /// Those among them at which a switched constraint was released. The general solver is the only route
    /// there.
    pub released: u64,
    /// Evaluations at which the Jacobian had a lower rank than it has rows that hold, so that multipliers are
    /// not unique.
    pub dependent: u64,
    /// First time at which the rank was lower.
    pub dependent_at: Option<f64>,
    /// Steps whose end was projected.
    pub projected: u64,
    /// Largest size of such a move, in parts of what the tolerance permits per step.
    pub largest_move: f64,
    /// How often the embedded formulation chose anew which coordinates are dependent: at a state where a
    /// block of dependent ones of the generated code had degraded, so that the general solver chose its own
    /// pivots. 0 where there is no generated code: then it always does.
    pub repartitions: u64,
    /// How often a contact without a [`rest_speed`](crate::simulate::Contact::rest_speed) was hit too slowly
    /// to rebound and counted as at rest.
    pub rests: u64,
    /// The largest speed, |Φ̇|, at which one did.
    pub fastest_rest: f64,
    /// Worst conditioning of the constraints that the general solver met, and its time.
    pub conditioning: Option<(f64, f64)>,
    /// Largest influence of drift on the direction of the motion. It is measured for formulations that let
    /// constraints drift, at the ends of steps that may be near a singular position, and of every fourth to
    /// thirteenth of the other steps.
    pub turned: Option<DriftInfluence>,
}

impl StabilizationCounts {
    /// Notes a contact that came to rest although it approached, or moved away, with this speed.
    pub(super) fn note_rest(&mut self, speed: f64) {
        self.rests += 1;
        self.fastest_rest = self.fastest_rest.max(speed.abs());
    }

    /// Adds the evaluations of the pilot run, which precedes the run.
    pub(crate) fn add_evaluations(&mut self, before: &Self) {
        self.general += before.general;
        self.released += before.released;
        self.dependent += before.dependent;
    }

    /// Notes the size of the move that projected the end of a step.
    #[inline]
    pub(crate) fn note_move(&mut self, size: f64) {
        self.projected += 1;
        if size > self.largest_move {
            self.largest_move = size;
        }
    }
}
