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

    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.nodes {
            for j in 0..self.nodes {
                for l in 0..self.nodes {
                    sum += 0.5 * self.k * (q.s[i] - q.s[j] + q.s[l]).powi(2);
                }
            }
        }
        sum
    }
}

fn main() {}
