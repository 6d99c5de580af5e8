//! Constraints by index against the same constraints with a literal count: Φ, Φ̇, γ, Φ_q, and the stiffness
//! of multipliers by differences.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

use dynamics::families::model::{FamilyModel, FamilyState, RowValues, View};
use dynamics::model::{Constraints, ModelState, Vector};
use dynamics::prelude::*;
use nalgebra::DMatrix;

use super::harness::{Numbers, assert_close, matrix, random, twice};

/// What the rows of a model have at a state.
struct Rows {
    residual: Vec<f64>,
    velocity_residual: Vec<f64>,
    gamma: Vec<f64>,
    jacobian: DMatrix<f64>,
}

fn rows<M: FamilyModel>(model: &M, at: View<'_>) -> Rows {
    let count = model.row_ends().last().copied().expect("rows");
    let mut pairs = Vec::new();
    model.row_pattern(&mut |row, unknown| pairs.push((row, unknown)));
    let [mut residual, mut velocity_residual, mut gamma] = [0; 3].map(|_| vec![f64::NAN; count]);
    let mut entries = vec![f64::NAN; pairs.len()];
    model.rows(
        at,
        RowValues {
            residual: &mut residual,
            velocity_residual: &mut velocity_residual,
            gamma: &mut gamma,
            jacobian: &mut entries,
        },
    );
    let mut jacobian = DMatrix::zeros(count, at.q.len());
    pairs.iter().zip(&entries).for_each(|(&at, entry)| jacobian[at] += entry);
    // What is not wanted is left alone.
    let mut again = vec![f64::NAN; pairs.len()];
    let none = || &mut [][..];
    model.rows(
        at,
        RowValues { residual: none(), velocity_residual: none(), gamma: none(), jacobian: &mut again },
    );
    assert_eq!(again, entries);
    Rows { residual, velocity_residual, gamma, jacobian }
}

/// The rows of both; in the order of the family, where those of the literal model are `order`.
#[track_caller]
fn compare<F: FamilyModel, L: Constraints>(family: &F, literal: &L, order: &[usize]) {
    let mut numbers = Numbers::new(5);
    for _ in 0..5 {
        let state = random(family, &mut numbers, 1.0);
        let view = state.view();
        let fill = |values: &[f64]| {
            let mut vector = L::Vector::zeros();
            vector.as_mut_slice().copy_from_slice(values);
            vector
        };
        let unrolled = L::State::new(view.t, fill(view.q), fill(view.u), L::Inputs::zeros());
        let own = rows(family, view);
        let sorted = |values: &[f64]| order.iter().map(|&row| values[row]).collect::<Vec<_>>();
        let holonomic = literal.residual(&unrolled);
        let mut residual = holonomic.as_slice().to_vec();
        residual.resize(order.len(), 0.0);
        assert_close("Φ", &own.residual, &sorted(&residual), 1e-13);
        let velocity = literal.velocity_residual(&unrolled);
        assert_close("Φ̇", &own.velocity_residual, &sorted(velocity.as_slice()), 1e-13);
        assert_close("γ", &own.gamma, &sorted(literal.gamma(&unrolled).as_slice()), 1e-12);
        let known = literal.jacobian(&unrolled);
        let known = DMatrix::from_fn(order.len(), view.q.len(), |i, j| known[(order[i], j)]);
        assert_close("Φ_q", own.jacobian.as_slice(), known.as_slice(), 1e-13);
        check_stiffness(family, view, &numbers.vec(order.len(), 1.0));
    }
}

/// −∂(Φ_qᵀλ)/∂q against differences.
#[track_caller]
fn check_stiffness<M: FamilyModel>(model: &M, at: View<'_>, multipliers: &[f64]) {
    let n = at.q.len();
    let own = matrix(n, |add| model.row_stiffness(at, multipliers, add));
    let lambda = nalgebra::DVector::from_column_slice(multipliers);
    let mut q = at.q.to_vec();
    let h = 1e-5;
    let known = DMatrix::from_columns(
        &(0..n)
            .map(|k| {
                let kept = q[k];
                let mut reaction = |value: f64| {
                    q[k] = value;
                    rows(model, View { q: &q, ..at }).jacobian.transpose() * &lambda
                };
                let (ahead, back) = (reaction(kept + h), reaction(kept - h));
                q[k] = kept;
                (back - ahead) / (2.0 * h)
            })
            .collect::<Vec<_>>(),
    );
    assert!((&own - &known).amax() <= 1e-7 * (1.0 + known.amax()), "{own}{known}");
}

twice! {
    #[units(pitch: m, mass: kg, speed: m / s)]
    Chain: (x: [m; self.nodes], y: [m; self.nodes]) { pub pitch: f64, pub mass: f64, pub speed: f64 }
    Chain6: (x: [m; 6], y: [m; 6]) { pub pitch: f64, pub mass: f64, pub speed: f64 } = 6;
    {
        fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
            if i == 0 {
                vec2(self.speed * q.t, self.pitch)
            } else if i == self.n() + 1 {
                vec2(3.0 * self.pitch, self.pitch)
            } else {
                vec2(q.x[i - 1], q.y[i - 1])
            }
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n()).map(|i| 0.5 * self.mass * (q.x[i].dt().powi(2) + q.y[i].dt().powi(2))).sum()
        }
        #[holonomic]
        fn link(&self, q: &Coordinates<Self>) -> Vec<Expr> {
            (0..self.n() + 1)
                .map(|i| (self.bead(q, i + 1) - self.bead(q, i)).norm_squared() - self.pitch.powi(2))
                .collect()
        }
    }
}

/// Both ends have rounds of their own, and the first moves.
#[test]
fn chain_between_a_driven_and_a_fixed_pin() {
    let (pitch, mass, speed) = (0.4, 0.7, 1.1);
    compare(&Chain { nodes: 6, pitch, mass, speed }, &Chain6 { pitch, mass, speed }, &[0, 1, 2, 3, 4, 5, 6]);
}

twice! {
    #[units(mass: kg, length: m)]
    Mixed: (cart: m, x: [m; self.nodes], y: [m; self.nodes]) { pub mass: f64, pub length: f64 }
    Mixed4: (cart: m, x: [m; 4], y: [m; 4]) { pub mass: f64, pub length: f64 } = 4;
    {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let nodes: Expr =
                (0..self.n()).map(|i| 0.5 * self.mass * (q.x[i].dt().powi(2) + q.y[i].dt().powi(2))).sum();
            nodes + 0.5 * self.mass * q.cart.dt().powi(2)
        }
        /// A sum over all nodes and the cart: one row.
        #[holonomic]
        fn total(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = q.cart.powi(2) / self.length - self.length;
            for i in 0..self.n() {
                sum += (i as f64 + 1.0) * q.x[i] * (2.0 + q.cart / self.length);
            }
            sum
        }
        /// Two components of every round.
        #[holonomic]
        fn pair(&self, q: &Coordinates<Self>) -> Vec<Vec2> {
            (0..self.n() - 2)
                .map(|i| vec2(q.x[i + 1] - q.x[i] * (q.x[i] / self.length).cos(), q.y[i] - q.cart * q.x[i] / self.length))
                .collect()
        }
        /// Rows that restrict velocities.
        #[nonholonomic]
        fn skate(&self, q: &Coordinates<Self>) -> Vec<Expr> {
            (0..1).map(|i| q.y[self.n() - 1] * q.x[i].dt() - q.x[self.n() - 1] * q.y[i].dt() + self.length * q.cart.dt()).collect()
        }
    }
}

/// Rows of the family go component by component; those of the literal model round by round.
#[test]
fn sums_vectors_and_velocities() {
    let (mass, length) = (0.7, 1.3);
    let order = [0, 1, 3, 2, 4, 5];
    compare(&Mixed { nodes: 4, mass, length }, &Mixed4 { mass, length }, &order);
}
