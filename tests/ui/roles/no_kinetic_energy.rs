use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Oscillator {
    m: f64,
    k: f64,
}

#[dynamics]
impl Oscillator {
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.k * q.x * q.y
    }
}

fn main() {}
