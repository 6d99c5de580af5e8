//! How far constraints drift along a motion.

use alloc::string::String;
use alloc::vec::Vec;

use crate::constrain::active_set::active_rows;
use crate::model::{ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::trajectory::motion::Motion;

/// Drift of one row of the constraints over the accepted states at which it was active, in the row's own
/// units.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstraintDrift {
    /// The row, `closure.x`.
    pub row: &'static str,
    /// The unit of Φ, or of A q̇ + b.
    pub unit: String,
    /// Largest |Φ|; 0 for rows of nonholonomic constraints. NaN where a value is not a number.
    pub residual: f64,
    /// Largest |Φ̇| or |A q̇ + b|.
    pub velocity_residual: f64,
    /// Time of the largest residual; of the largest velocity residual for nonholonomic rows.
    pub time: f64,
}

impl<M: SimulationModel> Motion<'_, M> {
    /// The largest |Φ| and |Φ̇| of every row over the accepted states at which its constraint was active.
    #[must_use]
    pub fn constraint_drift(&self) -> Vec<ConstraintDrift> {
        if M::IS_UNCONSTRAINED {
            return Vec::new();
        }
        let start = self.start_time();
        let new = |row: &crate::model::Quantity| ConstraintDrift {
            row: row.name,
            unit: row.unit.into(),
            residual: 0.0,
            velocity_residual: 0.0,
            time: start,
        };
        let mut drifts: Vec<ConstraintDrift> = M::ROWS.iter().map(new).collect();
        if drifts.is_empty() {
            return drifts;
        }
        for state in self.steps() {
            let (position, velocity) =
                (self.model().residual(&state), self.model().velocity_residual(&state));
            for row in active_rows::<M>(state.active_set(), false) {
                let drift = &mut drifts[row];
                let of_position = if row < M::Residual::LEN { position[row].abs() } else { 0.0 };
                let of_velocity = velocity[row].abs();
                let is_worst = if row < M::Residual::LEN {
                    worse(of_position, drift.residual)
                } else {
                    worse(of_velocity, drift.velocity_residual)
                };
                if is_worst {
                    drift.time = state.t();
                }
                keep_worse(&mut drift.residual, of_position);
                keep_worse(&mut drift.velocity_residual, of_velocity);
            }
        }
        drifts
    }
}

/// Whether a value is worse than another. NaN is worse than any.
fn worse(value: f64, than: f64) -> bool {
    value > than || (value.is_nan() && !than.is_nan())
}

fn keep_worse(worst: &mut f64, value: f64) {
    if worse(value, *worst) {
        *worst = value;
    }
}
