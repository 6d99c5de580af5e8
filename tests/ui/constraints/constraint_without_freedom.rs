use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y, psi)]
struct Bike {
    m: f64,
    length: f64,
    v: f64,
}

#[dynamics]
impl Bike {
    fn along(&self, angle: Expr) -> Vec2 {
        vec2(angle.cos(), angle.sin())
    }

    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2) + q.psi.dt().powi(2))
    }

    #[nonholonomic]
    fn wheels(&self, q: &Coordinates<Self>) -> Vec2 {
        let rear = vec2(q.x, q.y);
        let front = rear + self.length * self.along(q.psi);
        let steered = self.along(q.psi + q.t.sin());
        vec2(rear.dt().dot(self.along(q.psi).perp()), front.dt().dot(steered.perp()))
    }

    #[nonholonomic]
    fn motor(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).dt().dot(self.along(q.psi)) - self.v
    }
}

fn main() {}
