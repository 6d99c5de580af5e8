//! Elements of stiffness or damping that are only rounding: they would be 0 if their terms cancelled exactly.
//!
//! What remains of terms that cancel depends on how the model is written. A cyclic angle about the vertical
//! has stiffnesses of exactly 0 if only its rate appears, and of about 1e-17 if positions are rotated by it.
//! If coordinates change in their last bits, the remainder of terms that cancel changes by its own size. A
//! real stiffness, however weak, does not (after J. J. Moré & S. M. Wild, SIAM J. Sci. Comput. 33 (2011)
//! 1292).

use dynamics_runtime::model::{Constraints, ModelState, Vector};
use nalgebra::{DMatrix, DVector};

use crate::linearize::scales;

/// A force up to this many times its noise counts as zero. Noise is the largest change of the force in eight
/// moves of the coordinates by last bits, which underestimates the error of long sums and of ill-conditioned
/// terms. A smaller factor refuses equilibria of models whose terms cancel; a larger one accepts forces that
/// are small beside those that cancel.
pub(crate) const FORCE_NOISE_FACTOR: f64 = 1e3;
/// Elements above this share of the largest one, with inertia as the common unit, are never cleared. Rounding
/// of terms that cancel leaves about 10⁻¹⁶ times the size of these terms, so that terms up to 10⁶
/// times the largest element are allowed for.
const SUSPECT_SHARE: f64 = 1e-10;
/// An element up to this many times its largest change under moves by last bits is cleared. What is left of
/// terms that cancel changes by its own size, a real element by a share of about 10⁻¹⁴. A smaller value
/// leaves rounding that happened to change little, a larger one clears real elements of ill-conditioned
/// terms.
const CLEARED_CHANGES: f64 = 8.0;
/// Number of displaced states: with three sign patterns they are the eight combinations of signs.
const SAMPLE_COUNT: u32 = 8;
/// Largest displacement of a coordinate, in units of its last bit. More than a few bits are needed, because
/// sums with large terms absorb the last ones.
const MAX_LAST_BITS: u32 = 16;

/// Sets those elements of a matrix to 0 that are rounding. `inertias` of its rows and of its columns make
/// elements of different units comparable. `matrix_at` gives the matrix at another state, or `None`.
pub(super) fn clear_rounding<M: Constraints>(
    matrix: &mut DMatrix<f64>,
    inertias: [&DVector<f64>; 2],
    state: &M::State,
    matrix_at: impl Fn(&M::State) -> Option<DMatrix<f64>>,
) {
    let [of_rows, of_columns] =
        inertias.map(|of| of.map(|inertia| if inertia > 0.0 { inertia.sqrt() } else { 1.0 }));
    let size = |i: usize, j: usize| matrix[(i, j)].abs() / (of_rows[i] * of_columns[j]);
    let sizes = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), size);
    let most = if sizes.is_empty() { 0.0 } else { sizes.amax() };
    // The largest change of each small element. NaN marks the others.
    let mut changes = matrix
        .zip_map(&sizes, |x, size| if x != 0.0 && size <= SUSPECT_SHARE * most { 0.0 } else { f64::NAN });
    if changes.iter().all(|change| change.is_nan()) {
        return;
    }
    for there in (0..SAMPLE_COUNT).filter_map(|sample| matrix_at(&by_last_bits::<M>(state, sample))) {
        if there.shape() == matrix.shape() {
            changes.zip_zip_apply(matrix, &there, |change, x, y| {
                *change = if change.is_nan() { *change } else { change.max((x - y).abs()) };
            });
        }
    }
    matrix.zip_apply(&changes, |x, change| {
        if x.abs() <= CLEARED_CHANGES * change {
            *x = 0.0;
        }
    });
}

/// A state whose coordinates differ by some last bits. Those that are 0 differ by last bits of their scale.
fn by_last_bits<M: Constraints>(state: &M::State, sample: u32) -> M::State {
    let scales = scales(M::COORDINATES, state.q().as_slice());
    let mut nearby = *state;
    for (j, q) in nearby.q_mut().as_mut_slice().iter_mut().enumerate() {
        // Signs of a Walsh function, so that no two samples are alike, and different numbers of bits.
        let sign = if (sample >> (j % 3)).is_multiple_of(2) { 1.0 } else { -1.0 };
        let bits = f64::from(1 + (7 * sample + 5 * j as u32) % MAX_LAST_BITS);
        *q += sign * bits * f64::EPSILON * if *q == 0.0 { scales[j] } else { *q };
    }
    nearby
}
