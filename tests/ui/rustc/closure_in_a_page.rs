use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Oscillator {
    m: f64,
    k: f64,
}

#[dynamics]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.k * q.x * q.y
    }
}

fn main() {
    let oscillator = Oscillator { m: 1.0, k: 1.0 };
    let start = oscillator.state().x(1.0).build().unwrap();
    let _ = oscillator.live(start).on_event("wall", Direction::Rising, |state| state.q[0] = 0.0);
}
