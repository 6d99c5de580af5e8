//! The order conditions of Runge–Kutta methods, for tests: Σ bᵢ φᵢ(τ) = 1/γ(τ) for every rooted tree τ with
//! at most as many vertices as the order.
//!
//! Of the tree whose root carries τ₁ … τₘ: φ = Π A φ(τⱼ), element by element, and γ = number of its
//! vertices · Π γ(τⱼ). There are 486 trees of up to nine vertices. Source: Butcher; Hairer, Nørsett, Wanner,
//! *Solving Ordinary Differential Equations I*, §II.2.

use crate::integrate::explicit::tableau::tests::assert_row_sums;
use crate::integrate::{Dense, Nested, Phase};
use nalgebra::SVector;
use std::vec::Vec;

struct Tree {
    vertices: u32,
    gamma: f64,
    /// φ of each stage.
    phi: Vec<f64>,
    /// A φ of each stage.
    carried: Vec<f64>,
}

/// The rows of a method, one per stage.
pub(crate) struct Tableau {
    rows: Vec<Vec<(usize, f64)>>,
    trees: Vec<Tree>,
}

impl Tableau {
    /// An explicit method; the first row is empty.
    pub(crate) fn new(rows: &[&[(usize, f64)]], nodes: &[f64]) -> Self {
        assert_row_sums(rows, nodes);
        let rows = rows.iter().map(|row| row.to_vec()).collect();
        let mut tableau = Self { rows, trees: Vec::new() };
        (1..10).for_each(|vertices| tableau.grow(vertices));
        let counts: Vec<usize> =
            (1..10).map(|n| tableau.trees.iter().filter(|tree| tree.vertices == n).count()).collect();
        assert_eq!(counts, [1, 1, 2, 4, 9, 20, 48, 115, 286]);
        tableau
    }

    /// Adds the trees of so many vertices.
    fn grow(&mut self, vertices: u32) {
        let stages = self.rows.len();
        let mut found = Vec::new();
        self.attach(vertices - 1, self.trees.len(), f64::from(vertices), std::vec![1.0; stages], &mut found);
        for (gamma, phi) in found {
            let carried = self.rows.iter().map(|row| row.iter().map(|&(j, a)| a * phi[j]).sum()).collect();
            self.trees.push(Tree { vertices, gamma, phi, carried });
        }
    }

    /// All ways to attach trees before `end`, with `left` vertices in total, to a root.
    fn attach(&self, left: u32, end: usize, gamma: f64, phi: Vec<f64>, found: &mut Vec<(f64, Vec<f64>)>) {
        if left == 0 {
            found.push((gamma, phi));
            return;
        }
        for (i, tree) in self.trees[..end].iter().enumerate().filter(|(_, tree)| tree.vertices <= left) {
            let phi = phi.iter().zip(&tree.carried).map(|(x, y)| x * y).collect();
            self.attach(left - tree.vertices, i + 1, gamma * tree.gamma, phi, found);
        }
    }

    /// Largest |Σ bᵢ φᵢ − θⁿ/γ| over the trees of n vertices.
    fn defect(&self, weights: &[(usize, f64)], vertices: u32, theta: f64) -> f64 {
        let of = |tree: &Tree| {
            let sum: f64 = weights.iter().map(|&(i, b)| b * tree.phi[i]).sum();
            (sum - theta.powi(vertices as i32) / tree.gamma).abs()
        };
        self.trees.iter().filter(|tree| tree.vertices == vertices).map(of).fold(0.0, f64::max)
    }

    /// The weights have this order, and no higher one.
    pub(crate) fn assert_orders(&self, weights: &[(usize, f64)], order: u32, rounding: f64) {
        for vertices in 1..=order {
            let defect = self.defect(weights, vertices, 1.0);
            assert!(defect < rounding, "{defect:e} with {vertices} vertices");
        }
        assert!(order == 9 || self.defect(weights, order + 1, 1.0) > 1e3 * rounding);
    }

    /// The differences of weights vanish to this order, and estimate something.
    pub(crate) fn assert_estimate(&self, differences: &[(usize, f64)], order: u32, rounding: f64) {
        for vertices in 1..=order {
            let defect = self.defect(differences, vertices, 0.0);
            assert!(defect < rounding, "{defect:e} with {vertices} vertices");
        }
        assert!(self.defect(differences, order + 1, 0.0) > 1e3 * rounding);
    }

    /// The dense output with these higher coefficients has this order; the end of the step is stage `last`.
    pub(crate) fn assert_dense(
        &self,
        weights: &[(usize, f64)],
        higher: &[&[(usize, f64)]],
        last: usize,
        order: u32,
        rounding: f64,
    ) {
        let of =
            |row: &[(usize, f64)], i: usize| row.iter().filter(|(j, _)| *j == i).map(|(_, x)| x).sum::<f64>();
        let at = |theta: f64| -> Vec<(usize, f64)> {
            let weight = |i: usize| {
                let (b, first, end) = (of(weights, i), f64::from(i == 0), f64::from(i == last));
                let mut out = [b, first - b, 2.0 * b - first - end, 0.0, 0.0, 0.0, 0.0, 0.0];
                higher.iter().enumerate().for_each(|(k, row)| out[3 + k] = of(row, i));
                let number = |x: f64| Phase { q: SVector::from([x]), u: SVector::from([0.0]) };
                let [a, b, c, d, e, f, g, h] = out.map(number);
                (i, Nested([number(0.0), a, b, c, d, e, f, g, h]).at(theta).q[0])
            };
            (0..self.rows.len()).map(weight).collect()
        };
        for theta in [0.1, 0.35, 0.5, 0.8, 0.95] {
            for vertices in 1..=order {
                let defect = self.defect(&at(theta), vertices, theta);
                assert!(defect < rounding, "{defect:e} with {vertices} vertices at {theta}");
            }
        }
    }
}

#[test]
fn the_classical_method_has_order_4() {
    let rows: [&[(usize, f64)]; 4] = [&[], &[(0, 0.5)], &[(1, 0.5)], &[(2, 1.0)]];
    let weights = [(0, 1.0 / 6.0), (1, 1.0 / 3.0), (2, 1.0 / 3.0), (3, 1.0 / 6.0)];
    let tableau = Tableau::new(&rows, &[0.0, 0.5, 0.5, 1.0]);
    tableau.assert_orders(&weights, 4, 1e-15);
}
