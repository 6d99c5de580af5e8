//! The matrices of the stages and their factors.

use crate::integrate::implicit::radau5::table::*;
use crate::integrate::implicit::radau5::{MATRIX_COUNT, Radau5, SAME_STEP_PART};
use crate::integrate::{Phase, StepNode, System};
use crate::linalg::elimination::{Matrices, factor, factor_blocks, factor_complex, reciprocal};
use crate::model::Vector;

/// ∂a/∂q, ∂a/∂u and the factored matrices: real, complex in two parts, and that of all stages, which is three
/// times as large each way.
#[inline(always)]
pub(super) fn split<V: Vector>(matrices: &mut Matrices<V, MATRIX_COUNT>) -> [&mut [f64]; 6] {
    let (small, large) = matrices.all().split_at_mut(5 * V::LEN * V::LEN);
    let mut parts = small.chunks_exact_mut(V::LEN * V::LEN).chain([large]);
    core::array::from_fn(|_| parts.next().expect("six matrices"))
}

impl<V: Vector> Radau5<V> {
    /// Factors γ/h − ∂a/∂u − (h/γ) ∂a/∂q and the same with the complex eigenvalue; false where one is
    /// singular.
    pub(super) fn factor_transformed(&mut self, h: f64) -> bool {
        if self.factored_for != 0.0 && (h / self.factored_for - 1.0).abs() <= SAME_STEP_PART {
            return true;
        }
        let n = V::LEN;
        let [by_q, by_u, real, re, im, _] = split(&mut self.matrices);
        let by_gamma = h / GAMMA;
        let (inverse_re, inverse_im) = reciprocal(ALPHA / h, BETA / h);
        for i in 0..n * n {
            real[i] = -by_u[i] - by_gamma * by_q[i];
            re[i] = -by_u[i] - inverse_re * by_q[i];
            im[i] = -inverse_im * by_q[i];
        }
        for i in 0..n {
            real[i * n + i] += GAMMA / h;
            re[i * n + i] += ALPHA / h;
            im[i * n + i] += BETA / h;
        }
        let exchanges = factor(real).zip(factor_complex(re, im));
        self.factored_for = if exchanges.is_some() { h } else { 0.0 };
        if let Some((of_real, of_complex)) = exchanges {
            self.exchanges = [of_real, of_complex];
        }
        exchanges.is_some()
    }

    /// Factors what Newton's method itself has: row block i of the derivative of A⁻¹Zᵘ/h − a is (A⁻¹)ᵢⱼ/h −
    /// δᵢⱼ ∂a/∂u − h aᵢⱼ ∂a/∂q, with the derivatives at stage i.
    pub(super) fn factor_stages<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
    ) -> Result<bool, S::Error> {
        let n = V::LEN;
        // The Jacobians of the stages are evaluated in the memory of the complex matrix.
        self.factored_for = 0.0;
        for i in 0..3 {
            let y = self.stage(start, h, i);
            let Phase { u: a, .. } = self.k[i + 1];
            let [_, _, _, by_q, by_u, large] = split(&mut self.matrices);
            system.jacobian(&StepNode { t: start.t + C[i] * h, y, a }, by_q, by_u)?;
            for row in 0..n {
                let large = &mut large[(i * n + row) * 3 * n..][..3 * n];
                for j in 0..3 {
                    for column in 0..n {
                        large[j * n + column] = -h * A[i][j] * by_q[row * n + column];
                    }
                    large[j * n + row] += A_INVERSE[i][j] / h;
                }
                for column in 0..n {
                    large[i * n + column] -= by_u[row * n + column];
                }
            }
        }
        let [_, _, _, _, _, large] = split(&mut self.matrices);
        let exchanges = factor_blocks(large);
        self.stage_exchanges = exchanges.unwrap_or(self.stage_exchanges);
        Ok(exchanges.is_some())
    }

    /// Factors the real matrix, which the error estimate needs, alone.
    pub(super) fn factor_filter(&mut self, h: f64) -> bool {
        let n = V::LEN;
        let [by_q, by_u, real, ..] = split(&mut self.matrices);
        for i in 0..n * n {
            real[i] = -by_u[i] - h / GAMMA * by_q[i];
        }
        (0..n).for_each(|i| real[i * n + i] += GAMMA / h);
        let exchanges = factor(real);
        self.exchanges[0] = exchanges.unwrap_or(self.exchanges[0]);
        exchanges.is_some()
    }
}
