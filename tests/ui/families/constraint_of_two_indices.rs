use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(w: [[m; self.columns]; self.rows])]
struct Drum {
    rows: usize,
    columns: usize,
    mass: f64,
    k: f64,
}

#[dynamics]
impl Drum {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.rows)
            .map(|i| (0..self.columns).map(|j| 0.5 * self.mass * q.w[i][j].dt().powi(2)).sum::<Expr>())
            .sum()
    }

    #[holonomic]
    fn flat(&self, q: &Coordinates<Self>) -> Expr {
        self.k * (0..self.rows).map(|i| (0..self.columns).map(|j| q.w[i][j]).sum::<Expr>()).sum::<Expr>()
    }
}

fn main() {}
