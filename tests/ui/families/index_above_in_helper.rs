use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(s: [m; self.nodes])]
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

    fn place(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.s[i] }
    }

    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.k * (self.place(q, i + 1) - self.place(q, i)).powi(2)).sum()
    }
}

fn main() {}
