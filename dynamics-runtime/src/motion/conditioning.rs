//! How well the mass matrix determines the accelerations along a motion.

use nalgebra::DMatrix;

use super::query::Motion;
use super::simulate::Simulate;
use crate::math;
use crate::model::{Dynamics, ModelState};

/// The worst conditioning of the mass matrix that a motion met.
///
/// The number is κ = ‖S‖₁ ‖S⁻¹‖₁ of S = M scaled to a unit diagonal, Sᵢⱼ = Mᵢⱼ/√|Mᵢᵢ Mⱼⱼ|, so that units and sizes of the coordinates do
/// not enter: they do not change the digits that LDLᵀ loses either. Accelerations lose at most about log₁₀ κ of their sixteen digits. Source: van
/// der Sluis, Numer. Math. 14 (1969) 14, by whom no other scaling of the rows and columns makes κ much smaller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditioning {
    /// Largest κ over the accepted states: 1 for a diagonal M, infinite for a singular one, NaN where M is not a number.
    pub largest: f64,
    /// When it was met first.
    pub time: f64,
}

impl<M: Simulate> Motion<'_, M> {
    pub(super) fn conditioning(&self) -> Conditioning {
        let mut worst = Conditioning { largest: 0.0, time: self.start_time() };
        for state in self.steps() {
            let largest = condition_number(self.model(), &state);
            // A value that is not a number is worse than any.
            if largest.is_nan() || largest > worst.largest {
                worst = Conditioning { largest, time: state.t() };
            }
            if largest.is_nan() {
                break;
            }
        }
        worst
    }
}

fn condition_number<M: Dynamics>(model: &M, state: &M::State) -> f64 {
    let n = M::COORDINATES.len();
    let matrix = model.mass_matrix(state);
    let scale = |i: usize| if matrix[(i, i)] == 0.0 { 1.0 } else { matrix[(i, i)].abs() };
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] / math::sqrt(scale(i) * scale(j)));
    if scaled.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let size = norm(&scaled);
    scaled.try_inverse().map_or(f64::INFINITY, |inverse| size * norm(&inverse))
}

/// ‖A‖₁, the largest sum of absolute values in a column.
fn norm(matrix: &DMatrix<f64>) -> f64 {
    matrix.column_iter().map(|column| column.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
}
