//! Models with two indices twice: with counts, and with literal counts and one index.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

use dynamics::prelude::*;

use super::harness::{check_alone, compare};

/// A model on a grid, and the same one on an array, from one text. Both have `w` as a helper.
macro_rules! twice {
    (
        $(#[$attribute:meta])*
        $family:ident: ($($coordinates:tt)*) { $($counts:tt)* } { $($own:tt)* }
        $literal:ident: ($($unrolled:tt)*) { $($literal_own:tt)* }
        { $($fields:tt)* }
        { $($body:tt)* }
    ) => {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates($($coordinates)*)]
        $(#[$attribute])*
        pub struct $family {
            $($counts)*
            $($fields)*
        }

        #[dynamics]
        impl $family {
            $($own)*
            $($body)*
        }

        #[derive(Clone, Debug, Dynamics)]
        #[coordinates($($unrolled)*)]
        $(#[$attribute])*
        pub struct $literal {
            $($fields)*
        }

        #[dynamics]
        impl $literal {
            $($literal_own)*
            $($body)*
        }
    };
}

twice! {
    #[inputs(blow: N)]
    #[units(pitch: m, tension: N / m, mass: kg, air: N * s / m)]
    Drum: (w: [[m; self.columns]; self.rows]) { pub rows: usize, pub columns: usize, } {
        fn rows(&self) -> usize {
            self.rows
        }
        fn columns(&self) -> usize {
            self.columns
        }
        fn w(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
            q.w[i][j]
        }
    }
    Drum5x4: (w: [m; 20]) {
        fn rows(&self) -> usize {
            5
        }
        fn columns(&self) -> usize {
            4
        }
        fn w(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
            q.w[i * 4 + j]
        }
    }
    { pub pitch: f64, pub tension: f64, pub mass: f64, pub air: f64 }
    {
        fn height(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
            if i == 0 || j == 0 || i == self.rows() + 1 || j == self.columns() + 1 {
                Expr::ZERO
            } else {
                self.w(q, i - 1, j - 1)
            }
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.rows())
                .map(|i| {
                    (0..self.columns()).map(|j| 0.5 * self.mass * self.w(q, i, j).dt().powi(2)).sum::<Expr>()
                })
                .sum()
        }
        #[potential]
        fn stretched_area(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.rows() + 1 {
                for j in 0..self.columns() + 1 {
                    let w = self.height(q, i, j);
                    let a = (self.height(q, i + 1, j) - w) / self.pitch;
                    let b = (self.height(q, i, j + 1) - w) / self.pitch;
                    sum += self.tension * self.pitch.powi(2) * ((1.0 + a * a + b * b).sqrt() - 1.0);
                }
            }
            sum
        }
        #[dissipation]
        fn drag(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.rows() {
                let mut row = Expr::ZERO;
                for j in 1..self.columns() {
                    row += (self.w(q, i, j).dt() - self.w(q, i, j - 1).dt()).powi(2);
                }
                sum += 0.5 * self.air * row;
            }
            sum
        }
        #[force]
        fn wind(&self, q: &Coordinates<Self>) -> Force {
            let mut sum = Force::along(self.w(q, 1, self.columns() - 1), q.blow);
            for i in 0..self.rows() {
                sum += (2..self.columns()).map(|j| Force::along(self.w(q, i, j), q.blow * i as f64)).sum();
            }
            sum
        }
        #[output]
        fn middle(&self, q: &Coordinates<Self>) -> Expr {
            self.w(q, 2, 1) - self.w(q, self.rows() - 1, 0)
        }
    }
}

fn drum(rows: usize, columns: usize) -> Drum {
    Drum { rows, columns, pitch: 0.3, tension: 2.0, mass: 0.4, air: 0.1 }
}

#[test]
fn drum_with_air_and_wind() {
    let literal = Drum5x4 { pitch: 0.3, tension: 2.0, mass: 0.4, air: 0.1 };
    compare(&drum(5, 4), &literal, 0.3);
}

/// Below, at and above the columns of a block.
#[test]
fn drums_of_many_sizes() {
    for (rows, columns) in [(3, 3), (9, 255), (4, 256), (3, 257), (300, 4), (5, 600)] {
        check_alone(&drum(rows, columns), 0.3);
    }
}

twice! {
    Torus: (cart: _, w: [[_; self.columns]; self.rows], s: [_; self.rows]) {
        pub rows: usize,
        pub columns: usize,
        pub mass: Vec<f64>,
    } {
        fn rows(&self) -> usize {
            self.rows
        }
        fn columns(&self) -> usize {
            self.columns
        }
        fn row_mass(&self, i: usize) -> f64 {
            self.mass[i]
        }
        fn w(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
            q.w[i][j]
        }
    }
    Torus4x5: (cart: _, w: [_; 20], s: [_; 4]) {
        fn rows(&self) -> usize {
            4
        }
        fn columns(&self) -> usize {
            5
        }
        fn row_mass(&self, i: usize) -> f64 {
            1.0 + i as f64
        }
        fn w(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
            q.w[i * 5 + j]
        }
    }
    { pub k: f64, pub m: f64 }
    {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = 0.5 * self.m * q.cart.dt().powi(2);
            for i in 0..self.rows() {
                sum += 0.5 * self.m * q.s[i].dt().powi(2);
                for j in 0..self.columns() {
                    sum += 0.5 * self.row_mass(i) * self.w(q, i, j).dt().powi(2);
                }
            }
            sum
        }
        /// Rows and columns close to rings.
        #[potential]
        fn rings(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.rows() {
                for j in 0..self.columns() {
                    let a = self.w(q, (i + 1) % self.rows(), j) - self.w(q, i, j);
                    let b = self.w(q, i, (j + 1) % self.columns()) - self.w(q, i, j);
                    sum += self.k * (a * a + (b * b) * (b * b) + (a * b).cos());
                }
            }
            sum
        }
        /// Every node hangs on the cart, on a node of its row, and on those of the first column.
        #[potential]
        fn ties(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for j in 0..self.columns() {
                for i in 0..self.rows() {
                    let place = self.w(q, i, j);
                    sum += self.k * ((place - q.cart).powi(2) + (place - q.s[i] * (0.01 * j as f64)).cos());
                    sum += self.k * (place - self.w(q, i, 0)).powi(4);
                }
            }
            sum + (0..self.rows()).map(|i| self.k * (q.s[i] - self.w(q, i, 2)).powi(2)).sum::<Expr>()
        }
    }
}

fn torus(rows: usize, columns: usize) -> Torus {
    let mass = (0..rows).map(|i| 1.0 + i as f64).collect();
    Torus { rows, columns, mass, k: 0.8, m: 1.4 }
}

#[test]
fn torus_with_ties_to_other_coordinates() {
    compare(&torus(4, 5), &Torus4x5 { k: 0.8, m: 1.4 }, 0.7);
    for (rows, columns) in [(3, 300), (40, 7)] {
        check_alone(&torus(rows, columns), 0.7);
    }
}

twice! {
    Plate: (w: [[_; self.columns + 1]; self.rows], v: [[_; self.columns]; self.rows + 2]) {
        pub rows: usize,
        pub columns: usize,
    } {
        fn rows(&self) -> usize {
            self.rows
        }
        fn columns(&self) -> usize {
            self.columns
        }
        fn w(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
            q.w[i][j]
        }
        fn v(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
            q.v[i][j]
        }
    }
    Plate3x4: (w: [_; 15], v: [_; 20]) {
        fn rows(&self) -> usize {
            3
        }
        fn columns(&self) -> usize {
            4
        }
        fn w(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
            q.w[i * 5 + j]
        }
        fn v(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
            q.v[i * 4 + j]
        }
    }
    { pub k: f64, pub m: f64 }
    {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.rows() {
                for j in 0..=self.columns() {
                    sum += 0.5 * self.m * self.w(q, i, j).dt().powi(2);
                }
            }
            for i in 0..self.rows() + 2 {
                for j in 0..self.columns() {
                    sum += 0.5 * self.m * self.v(q, i, j).dt().powi(2);
                }
            }
            sum
        }
        /// Bending reaches three nodes; both fields are coupled.
        #[potential]
        fn bending(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.rows() {
                for j in 2..self.columns() {
                    let bent = self.w(q, i, j) - 2.0 * self.w(q, i, j - 1) + self.w(q, i, j - 2);
                    let other = self.v(q, i + 2, j - 1) - 2.0 * self.v(q, i + 1, j) + self.v(q, i, j - 2);
                    sum += self.k * (bent.powi(2) + (other + bent).cos());
                }
            }
            sum
        }
        #[potential]
        fn base(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.rows() {
                sum += self.k * self.w(q, i, self.columns()).powi(2);
                for j in 0..self.columns() {
                    sum += self.k * (self.w(q, i, j).powi(2) + (self.v(q, i, j) + self.v(q, i + 2, j)).powi(2));
                }
            }
            sum
        }
    }
}

#[test]
fn two_fields_of_different_lengths() {
    let (k, m) = (0.6, 1.3);
    compare(&Plate { rows: 3, columns: 4, k, m }, &Plate3x4 { k, m }, 0.5);
    for (rows, columns) in [(2, 256), (30, 30), (1, 259), (260, 3)] {
        check_alone(&Plate { rows, columns, k, m }, 0.5);
    }
}
