//! The linear equations of every order of a series with constraints, where generated code does not apply: a
//! pivot is too small, or a switched constraint is released.

use crate::constrain::{self, active_set};
use crate::math;
use crate::model::{Constraints, ModelState, Terms};

/// Smallest pivot for which λ counts as unique, of a matrix whose gradients have unit length. Smaller ones
/// leave λ fewer than seven digits, and every coefficient loses as many.
const MIN_PIVOT: f64 = 1e-9;

/// ⎡ M −Φ_qᵀ; Φ_q 0 ⎤ of N coordinates and R rows, factored with pivoting; `NR` is N + R. Rows that do not
/// hold have λ = 0.
#[derive(Clone, Debug)]
pub struct Equations<const NR: usize> {
    /// P A = L U of the scaled matrix.
    factors: [[f64; NR]; NR],
    order: [usize; NR],
    /// Unknowns and equations are scaled alike: by 1/√mass, and so that gradients have unit length; 0 for
    /// rows that do not hold.
    scale: [f64; NR],
}

impl<const NR: usize> Equations<NR> {
    /// Factors them; `None` where they have no unique solution. N·N, N·R, N and R are the sizes of the model.
    #[cold]
    #[inline(never)]
    #[must_use]
    pub fn new<M: Constraints, const N: usize, const R: usize>(model: &M, state: &M::State) -> Option<Self> {
        let (mut mass, mut jacobian) = ([[0.0; N]; N], [[0.0; N]; R]);
        let (mut force, mut gamma) = ([0.0; N], [0.0; R]);
        let mut terms = Terms {
            mass: mass.as_flattened_mut(),
            force: &mut force,
            jacobian: jacobian.as_flattened_mut(),
            gamma: &mut gamma,
        };
        model.terms(state, &mut terms);
        let mut equations =
            Self { factors: [[0.0; NR]; NR], order: core::array::from_fn(|i| i), scale: [1.0; NR] };
        let Self { factors, scale, .. } = &mut equations;
        for i in 0..N {
            // A coordinate without inertia of its own is not scaled.
            scale[i] = if mass[i][i] > 0.0 { 1.0 / math::sqrt(mass[i][i]) } else { 1.0 };
        }
        for r in 0..R {
            let squares: f64 =
                (0..N).map(|i| (jacobian[r][i] * scale[i]) * (jacobian[r][i] * scale[i])).sum();
            scale[N + r] =
                if active_set::holds::<M>(state.active_set(), r) { 1.0 / math::sqrt(squares) } else { 0.0 };
        }
        for i in 0..N {
            for j in 0..N {
                factors[i][j] = scale[i] * mass[i][j] * scale[j];
            }
            for r in 0..R {
                let gradient = scale[N + r] * jacobian[r][i] * scale[i];
                factors[N + r][i] = gradient;
                factors[i][N + r] = -gradient;
            }
        }
        (0..R).filter(|r| scale[N + r] == 0.0).for_each(|r| factors[N + r][N + r] = 1.0);
        equations.factor().then_some(equations)
    }

    /// Whether no pivot vanishes.
    fn factor(&mut self) -> bool {
        let (a, order) = (&mut self.factors, &mut self.order);
        for j in 0..NR {
            let larger = |best: usize, i: usize| if a[i][j].abs() > a[best][j].abs() { i } else { best };
            let row = (j + 1..NR).fold(j, larger);
            a.swap(j, row);
            order.swap(j, row);
            let pivot = a[j][j];
            let regular = pivot.abs() > MIN_PIVOT;
            if !regular {
                return false;
            }
            let (upper, lower) = a.split_at_mut(j + 1);
            for row in lower {
                row[j] /= pivot;
                let factor = row[j];
                row[j + 1..].iter_mut().zip(&upper[j][j + 1..]).for_each(|(x, u)| *x -= factor * u);
            }
        }
        true
    }

    /// q̈ and λ for right-hand sides.
    #[inline(never)]
    #[must_use]
    pub fn solve(&self, right: &[f64; NR]) -> [f64; NR] {
        let mut x = [0.0; NR];
        for i in 0..NR {
            let known: f64 = self.factors[i][..i].iter().zip(&x).map(|(l, x)| l * x).sum();
            x[i] = self.scale[self.order[i]] * right[self.order[i]] - known;
        }
        for i in (0..NR).rev() {
            let known: f64 = self.factors[i][i + 1..].iter().zip(&x[i + 1..]).map(|(u, x)| u * x).sum();
            x[i] = (x[i] - known) / self.factors[i][i];
        }
        (0..NR).for_each(|i| x[i] *= self.scale[i]);
        x
    }
}

/// λ at the start of a series; `None` where it does not exist.
#[inline]
#[must_use]
pub fn multipliers<M: Constraints>(model: &M, constants: &M::Constants, state: &M::State) -> Option<M::Rows> {
    match model.solve_unrolled(constants, state) {
        Some(solved) => Some(solved.multipliers),
        None => general(model, constants, state),
    }
}

/// λ by the general solver.
#[cold]
#[inline(never)]
fn general<M: Constraints>(model: &M, constants: &M::Constants, state: &M::State) -> Option<M::Rows> {
    let solved = constrain::solve_once(model, constants, state).ok()?;
    solved.unique().then_some(solved.multipliers)
}
