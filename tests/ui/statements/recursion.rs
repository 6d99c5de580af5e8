use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Oscillator {
    m: f64,
    k: f64,
}

#[dynamics]
impl Oscillator {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { q.x } else { self.place(q, i - 1) + q.y }
    }

    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.k * self.place(q, 3)
    }
}

fn main() {}
