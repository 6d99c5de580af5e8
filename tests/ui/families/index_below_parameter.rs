use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(s: [m; self.nodes])]
struct Chain {
    nodes: usize,
    mass: f64,
    k: Vec<f64>,
}

#[dynamics]
impl Chain {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.mass * q.s[i].dt().powi(2)).sum()
    }

    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        (1..self.nodes).map(|i| 0.5 * self.k[i - 2] * (q.s[i] - q.s[i - 1]).powi(2)).sum()
    }
}

fn main() {}
