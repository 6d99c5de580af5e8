//! Models whose nodes have two indices, against closed forms.

use dynamics::prelude::*;

/// A rectangular membrane on a square grid, its edge held; large deflections.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(w: [[m; self.columns]; self.rows])]
#[units(pitch: m, tension: N / m, mass: kg)]
struct Drum {
    rows: usize,
    columns: usize,
    pitch: f64,
    tension: f64,
    mass: f64,
}

#[dynamics]
impl Drum {
    /// Nodes 0 and rows + 1, and 0 and columns + 1, are the rim.
    fn height(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
        if i == 0 || j == 0 || i == self.rows + 1 || j == self.columns + 1 {
            Expr::ZERO
        } else {
            q.w[i - 1][j - 1]
        }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.rows {
            for j in 0..self.columns {
                sum += 0.5 * self.mass * q.w[i][j].dt().powi(2);
            }
        }
        sum
    }
    #[potential]
    fn stretched_area(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.rows + 1 {
            for j in 0..self.columns + 1 {
                let w = self.height(q, i, j);
                let (a, b) = (
                    (self.height(q, i + 1, j) - w) / self.pitch,
                    (self.height(q, i, j + 1) - w) / self.pitch,
                );
                sum += self.tension * self.pitch.powi(2) * ((1.0 + a * a + b * b).sqrt() - 1.0);
            }
        }
        sum
    }
}

/// ω² = (4 T/m)(sin²(p π/(2 (rows + 1))) + sin²(q π/(2 (columns + 1)))): values in many digits.
#[test]
fn small_motions_of_a_membrane_have_the_frequencies_of_the_closed_form() {
    let drum = Drum { rows: 7, columns: 10, pitch: 0.2, tension: 3.0, mass: 0.05 };
    let modes = drum.modes(&drum.state().build().expect("finite"), 70).expect("modes");
    let lowest = [
        3.74102917188651477077561953949,
        5.30886354683409140278032217989,
        6.32519007017770259550658305253,
        7.10993445998002020807563178187,
        7.36184503489937343088009954088,
        8.75007989587409935354102376294,
    ];
    for (mode, exact) in modes.iter().zip(lowest) {
        assert!((mode.frequency() / exact - 1.0).abs() < 1e-10, "{} {exact}", mode.frequency());
    }
    let highest = 21.5871420233224503961267651155;
    assert!((modes[69].frequency() / highest - 1.0).abs() < 1e-10, "{}", modes[69].frequency());
}
