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

    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.rows {
            for j in 0..self.columns {
                sum += 0.5 * self.k * (q.w[i][j + 1] - q.w[i][j]).powi(2);
            }
        }
        sum
    }
}

fn main() {}
