use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Oscillator(f64, f64);

#[dynamics]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.0 * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.1 * q.x * q.y
    }
}

fn main() {}
