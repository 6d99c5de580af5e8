use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(s: [m; self.nodes])]
#[model(targets(c))]
struct Chain {
    nodes: usize,
    mass: f64,
    k: f64,
}

#[dynamics]
impl Chain {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.mass * q.s[i].dt().powi(2)).sum()
    }

    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes - 1).map(|i| 0.5 * self.k * (q.s[i + 1] - q.s[i]).powi(2)).sum()
    }
}

fn main() {}
