use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Pendulum {
    m: f64,
    g: f64,
    l: f64,
}

#[dynamics]
impl Pendulum {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.gg * q.y
    }

    #[holonomic(switched)]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2) + q.y.powi(2) - self.l.powi(2)
    }

    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::rod) + q.slip(Self::rod)
    }
}

fn main() {
    let p = Pendulum { m: 1.0, g: 1.0, l: 1.0 };
    let s = p.state().x(1.0).release("rod").build().unwrap();
    let m = p.simulate(s).until(1.0).contact("rod", 0.5).run().unwrap();
    println!("{}", m.coordinates_of(&s).reaction(Pendulum::rod));
}
