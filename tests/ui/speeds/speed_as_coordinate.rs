use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[speeds(v: m / s, spin: rad / s)]
#[units(m: kg, j: kg * m^2)]
struct Sleigh {
    m: f64,
    j: f64,
}

#[dynamics]
impl Sleigh {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
            + 0.5 * self.j * q.phi.dt().powi(2)
            + 0.5 * self.m * q.v.powi(2)
    }
    #[nonholonomic]
    fn edge(&self, q: &Coordinates<Self>) -> Expr {
        q.y.dt() * q.phi.cos() - q.x.dt() * q.phi.sin()
    }
    #[kinematic]
    fn v(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() * q.phi.cos() + q.y.dt() * q.phi.sin()
    }
    #[kinematic]
    fn spin(&self, q: &Coordinates<Self>) -> Expr {
        q.phi.dt()
    }
}

fn main() {}
