use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y, z: [_; 5])]
struct Oscillator {
    m: f64,
    k: f64,
}

#[dynamics]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = q.x.dt().powi(2) + q.y.dt().powi(2);
        for i in 0..5 {
            sum += q.z[i].dt().powi(2);
        }
        0.5 * self.m * sum
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..5 {
            sum += q.z[i + 1] - q.z[i];
        }
        self.k * sum
    }
}

fn main() {}
