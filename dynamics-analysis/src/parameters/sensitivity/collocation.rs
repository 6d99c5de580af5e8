//! Gauss collocation for linear equations ẋ = A(t) x + b(t).
//!
//! With s nodes the roots cᵢ of the Legendre polynomial P_s on [0, 1], order 2s, A-stable (Hairer, Nørsett
//! & Wanner, *Solving Ordinary Differential Equations I*, §II.7; Hairer & Wanner, II, §IV.5). The stages
//! solve kᵢ = A(tᵢ) (x + h Σ aᵢⱼ kⱼ) + b(tᵢ), linear equations, without iterations. No node lies
//! at an end of the step, where another branch of the model may begin. Steps are taken with five nodes; the
//! difference from four nodes, of order 8, estimates their error.

use alloc::vec::Vec;

use nalgebra::{DMatrix, DVector};

/// Safety factor of the step size control.
const SAFETY: f64 = 0.9;
/// Smallest and largest factor from one step to the next.
const STEP_FACTORS: [f64; 2] = [0.2, 4.0];
/// Factor of a step after one without a solution of the stages.
pub(in super::super) const FACTOR_WITHOUT_SOLUTION: f64 = 0.2;
/// Largest factor after a step that was not accepted.
pub(in super::super) const MAX_FACTOR_AFTER_REJECTION: f64 = 0.9;

/// The factor of the next step, for an error in tolerances. The difference of both formulas is of order h⁹.
pub(in super::super) fn step_factor(error: f64) -> f64 {
    let [smallest, largest] = STEP_FACTORS;
    if error > 0.0 { (SAFETY * error.powf(-1.0 / 9.0)).clamp(smallest, largest) } else { largest }
}

/// A and b at a node.
pub(in super::super) type AtNode = (DMatrix<f64>, DMatrix<f64>);

/// Nodes cᵢ, aᵢⱼ by rows, weights bⱼ.
pub(in super::super) struct Gauss {
    pub(in super::super) nodes: Vec<f64>,
    inner: DMatrix<f64>,
    pub(in super::super) weights: DVector<f64>,
}

/// P_k(2 c − 1) for k = 0, …, s.
fn legendre(s: usize, c: f64) -> Vec<f64> {
    let x = 2.0 * c - 1.0;
    let mut p = alloc::vec![1.0, x];
    for k in 1..s {
        let next = ((2 * k + 1) as f64 * x * p[k] - k as f64 * p[k - 1]) / (k + 1) as f64;
        p.push(next);
    }
    p
}

impl Gauss {
    /// With s nodes.
    pub(in super::super) fn new(s: usize) -> Self {
        let root = |i: usize| {
            let mut c = 0.5 - 0.5 * (core::f64::consts::PI * (i as f64 + 0.75) / (s as f64 + 0.5)).cos();
            for _ in 0..20 {
                let (p, x) = (legendre(s, c), 2.0 * c - 1.0);
                let slope = 2.0 * s as f64 * (x * p[s] - p[s - 1]) / (x * x - 1.0);
                c -= p[s] / slope;
            }
            c
        };
        let nodes: Vec<f64> = (0..s).map(root).collect();
        // ∫₀ᶜ of the polynomial through the nodes: by Legendre polynomials, whose integrals are differences
        // of their neighbours, and which are orthogonal under the weights.
        let values: Vec<Vec<f64>> = nodes.iter().map(|c| legendre(s, *c)).collect();
        let weights = DVector::from_fn(s, |j, _| {
            let (c, p) = (nodes[j], values[j][s - 1]);
            4.0 * c * (1.0 - c) / (s as f64 * p).powi(2)
        });
        let integral = |k: usize, c: f64| {
            let p = legendre(k + 1, c);
            if k == 0 { c } else { (p[k + 1] - p[k - 1]) / (2.0 * (2 * k + 1) as f64) }
        };
        let inner = DMatrix::from_fn(s, s, |i, j| {
            let of = |k: usize| (2 * k + 1) as f64 * values[j][k] * integral(k, nodes[i]);
            weights[j] * (0..s).map(of).sum::<f64>()
        });
        Self { nodes, inner, weights }
    }

    /// x at the end of a step; A and b at the nodes. `None` where the stages have no solution.
    pub(in super::super) fn step(&self, x: &DMatrix<f64>, h: f64, at: &[AtNode]) -> Option<DMatrix<f64>> {
        self.with_stages(x, h, at).map(|(end, _)| end)
    }

    /// As [`Gauss::step`], with x at the nodes.
    pub(in super::super) fn with_stages(
        &self,
        x: &DMatrix<f64>,
        h: f64,
        at: &[AtNode],
    ) -> Option<(DMatrix<f64>, Vec<DMatrix<f64>>)> {
        let (n, s) = (x.nrows(), self.nodes.len());
        let mut system = DMatrix::identity(n * s, n * s);
        let mut right = DMatrix::zeros(n * s, x.ncols());
        for (i, (a, b)) in at.iter().enumerate() {
            for j in 0..s {
                let factor = h * self.inner[(i, j)];
                let mut block = system.view_mut((n * i, n * j), (n, n));
                block.zip_apply(a, |x, a| *x -= factor * a);
            }
            right.rows_mut(n * i, n).copy_from(&(a * x + b));
        }
        let stages = system.lu().solve(&right)?;
        let mut end = x.clone();
        for j in 0..s {
            end += stages.rows(n * j, n) * (h * self.weights[j]);
        }
        let at_node = |i: usize| {
            let mut there = x.clone();
            (0..s).for_each(|j| there += stages.rows(n * j, n) * (h * self.inner[(i, j)]));
            there
        };
        end.iter().all(|x| x.is_finite()).then(|| (end, (0..s).map(at_node).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ẍ + x = sin 2t: x = (1 + ⅔) … in closed form, for the order of each number of nodes.
    #[test]
    fn the_order_is_twice_the_nodes() {
        let end = 2.0_f64;
        let exact = end.cos() + 2.0 / 3.0 * end.sin() - (2.0 * end).sin() / 3.0;
        for (s, counts) in [(2, [16, 32]), (3, [8, 16]), (4, [4, 8]), (5, [2, 4])] {
            let gauss = Gauss::new(s);
            let error = counts.map(|count| {
                let h = end / f64::from(count);
                let mut x = DMatrix::from_column_slice(2, 1, &[1.0, 0.0]);
                for k in 0..count {
                    let at = |c: &f64| {
                        let t = h * (f64::from(k) + c);
                        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -1.0, 0.0]);
                        (a, DMatrix::from_column_slice(2, 1, &[0.0, (2.0 * t).sin()]))
                    };
                    x = gauss.step(&x, h, &gauss.nodes.iter().map(at).collect::<Vec<_>>()).unwrap();
                }
                (x[0] - exact).abs()
            });
            let order = (error[0] / error[1]).log2();
            assert!((order - 2.0 * s as f64).abs() < 0.35, "{s} nodes: order {order}, errors {error:?}");
        }
    }
}
