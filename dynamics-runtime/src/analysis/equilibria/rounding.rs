//! Derivatives that are rounding: elements of stiffness or damping that would be 0 if their terms cancelled exactly.
//!
//! How a model is written decides what is left: an angle about the vertical on which nothing depends has stiffnesses of exactly 0 where only its rate is written, and some 1e-17 where positions are
//! turned by it. What is left of terms that cancel changes as much as its own size where coordinates move by their last bits; a stiffness, however weak, does not (after J. J. Moré & S. M. Wild, SIAM J.
//! Sci. Comput. 33 (2011) 1292).

use nalgebra::{DMatrix, DVector};

use crate::analysis::linearize::scales;
use crate::model::{Constraints, ModelState, Vector};

/// Elements above this part of the largest are not looked at, all by units of inertia: rounding is smaller by far.
const SUSPECT: f64 = 1e-10;
/// Elements up to this many times what they change by are rounding.
const CHANGES: f64 = 8.0;
/// How often they are looked at beside, and how many last bits away at most.
const SAMPLES: u32 = 8;
const BITS: u32 = 16;

/// Sets the elements to 0 that are rounding: F×C matrices, by inertias of the rows and of the columns; `beside` gives them at another state, where it can.
pub(super) fn clear_rounding<M: Constraints, const K: usize>(
    matrices: &mut [DMatrix<f64>; K],
    [of_rows, of_columns]: [&DVector<f64>; 2],
    state: &M::State,
    beside: impl Fn(&M::State) -> Option<[DMatrix<f64>; K]>,
) {
    let root = |inertia: f64| if inertia > 0.0 { inertia.sqrt() } else { 1.0 };
    let weight = |i: usize, j: usize| 1.0 / (root(of_rows[i]) * root(of_columns[j]));
    let weighed = |m: &DMatrix<f64>| DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)].abs() * weight(i, j));
    let mut noise = matrices.clone();
    let mut suspects = 0;
    for (matrix, noise) in matrices.iter().zip(&mut noise) {
        let sizes = weighed(matrix);
        let most = if sizes.is_empty() { 0.0 } else { sizes.amax() };
        // NaN marks what is no suspect, and stays.
        noise.zip_apply(&sizes, |x, size| *x = if *x != 0.0 && size <= SUSPECT * most { 0.0 } else { f64::NAN });
        suspects += noise.iter().filter(|x| !x.is_nan()).count();
    }
    if suspects == 0 {
        return;
    }
    for there in (0..SAMPLES).filter_map(|sample| beside(&by_last_bits::<M>(state, sample))) {
        for ((noise, here), there) in noise.iter_mut().zip(matrices.iter()).zip(&there) {
            if there.shape() == here.shape() {
                noise.zip_zip_apply(here, there, |noise, x, y| {
                    *noise = if noise.is_nan() { *noise } else { f64::max(*noise, (x - y).abs()) };
                });
            }
        }
    }
    for (matrix, noise) in matrices.iter_mut().zip(&noise) {
        matrix.zip_apply(noise, |x, noise| {
            if x.abs() <= CHANGES * noise {
                *x = 0.0;
            }
        });
    }
}

/// A state whose coordinates differ by some last bits, those that are 0 by bits of what they are measured by.
fn by_last_bits<M: Constraints>(state: &M::State, sample: u32) -> M::State {
    let scales = scales(M::COORDINATES, state.q().as_slice());
    let mut beside = *state;
    for (j, q) in beside.q_mut().as_mut_slice().iter_mut().enumerate() {
        // Signs of a Walsh function, so that no two samples are alike, and different numbers of bits.
        let sign = if (sample >> (j % 3)).is_multiple_of(2) { 1.0 } else { -1.0 };
        let bits = f64::from(1 + (7 * sample + 5 * j as u32) % BITS);
        *q += sign * bits * f64::EPSILON * if *q == 0.0 { scales[j] } else { *q };
    }
    beside
}
