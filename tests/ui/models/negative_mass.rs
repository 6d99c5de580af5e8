use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, angle)]
struct Sled {
    length: f64,
}

#[dynamics]
impl Sled {
    fn plate(&self, q: &Coordinates<Self>) -> PlanarBody {
        let frame = PlanarFrame::new(vec2(q.x, 0.0), q.angle);
        PlanarBody::new(-2.0, vec2(self.length, 0.0), 0.3, frame)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.plate(q).kinetic_energy()
    }
}

fn main() {}
