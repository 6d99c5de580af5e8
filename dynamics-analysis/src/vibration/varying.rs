//! Whether the rows of outputs and the columns of inputs are constant along the reference motion.
//!
//! Eigenvalues do not depend on cyclic coordinates, such as the angle of a steadily turning body. But an
//! output may contain its sine, and an input may push in a direction that turns with it. y = C x + D w then
//! has coefficients that change with time, and no frequency response. The equations are assembled again at
//! two later times of the motion, as for the eigenvalues (`linearize/steady.rs`). An output has constant
//! coefficients if its row is constant, and the rows of A of all states on which it depends.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, ModelState, Outputs, Vector};
use nalgebra::DMatrix;

use super::VibrationError;
use super::linear_equations::{StateSpaceMatrices, equations};
use crate::linearize::{
    COMPARISON_TIMES, LinearizeError, MAX_COEFFICIENT_CHANGE, Tangent, assemble, drop_rounding, state_after,
};

/// Least scale of a row, relative to the largest element of the matrix. Smaller rows are compared by this
/// scale, because they may be rounding of the large ones.
const MIN_ROW_SCALE: f64 = 1e-6;

/// The outputs and the inputs that change along the motion through a state.
pub(super) fn varying<M: Constraints + Outputs>(
    model: &M,
    state: &M::State,
    tangent: &Tangent,
    now: &StateSpaceMatrices,
) -> Result<(Vec<usize>, Vec<usize>), VibrationError> {
    let fastest = state.u().as_slice().iter().fold(1.0, |most: f64, u| most.max(u.abs()));
    let [mut outputs, mut inputs] = [Vec::new(), Vec::new()];
    for part in COMPARISON_TIMES {
        let (state, derivatives, tangent) =
            state_after(model, state, tangent, part / fastest).ok_or(LinearizeError::Ends)?;
        let (then, _) =
            equations(model, &state, &derivatives, &tangent, &assemble::<M>(&derivatives, &tangent))?;
        let [of_a, of_c] = [changed(&now.a, &then.a), changed(&now.c, &then.c)];
        let mut a = now.a.clone();
        drop_rounding(&mut a);
        let varies =
            |i: usize| of_c[i] || observed_states(&a, &now.c, i).into_iter().any(|state| of_a[state]);
        outputs.extend((0..now.c.nrows()).filter(|i| varies(*i)));
        let kept: Vec<usize> = (0..now.c.nrows()).filter(|i| !outputs.contains(i)).collect();
        let columns = |m: &DMatrix<f64>| m.transpose();
        let of_b = changed(&columns(&now.b), &columns(&then.b));
        let of_d = changed(&columns(&now.d.select_rows(&kept)), &columns(&then.d.select_rows(&kept)));
        inputs.extend((0..now.b.ncols()).filter(|j| of_b[*j] || of_d[*j]));
    }
    for found in [&mut outputs, &mut inputs] {
        found.sort_unstable();
        found.dedup();
    }
    Ok((outputs, inputs))
}

/// Whether each row changed. Elements that are not finite do not count for the scale.
fn changed(now: &DMatrix<f64>, then: &DMatrix<f64>) -> Vec<bool> {
    let least = MIN_ROW_SCALE
        * now.iter().filter(|x| x.is_finite()).fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
    let size = |i: usize| now.row(i).amax().max(then.row(i).amax()).max(least);
    (0..now.nrows()).map(|i| (now.row(i) - then.row(i)).amax() > MAX_COEFFICIENT_CHANGE * size(i)).collect()
}

/// The states on which output `i` depends, directly or through others.
fn observed_states(a: &DMatrix<f64>, c: &DMatrix<f64>, i: usize) -> Vec<usize> {
    let n = a.nrows();
    let mut found: Vec<usize> = (0..n).filter(|j| c[(i, *j)] != 0.0).collect();
    let mut next = 0;
    while let Some(state) = found.get(next).copied() {
        let more: Vec<usize> = (0..n).filter(|j| a[(state, *j)] != 0.0 && !found.contains(j)).collect();
        found.extend(more);
        next += 1;
    }
    found
}
