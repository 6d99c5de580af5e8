//! Singular positions: where constraints lose rank a motion goes on as it has to, or says what it met: rows,
//! coordinates, conditioning.

#[path = "../../models/neutral.rs"]
mod neutral;
#[path = "../../models/three_cranks.rs"]
mod three_cranks;
mod touching;
use dynamics::constrain::solve_once;
use dynamics::prelude::*;
use dynamics::simulate::SimulationErrorKind;

mod between_methods;
mod between_steps;
mod change_points;
mod fixed_steps;
mod hit_to_rounding;
mod lock_ups;
mod missed;
mod passing;
mod starts;
mod summaries;
mod tight;
mod way_over;

/// A parallelogram of three bars by their angles, a : b : a over a ground of b.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad, coupler: rad, rocker: rad)]
#[units(inertia: kg * m^2, a: m, b: m, weight: N, incline: rad)]
struct Parallelogram {
    inertia: f64,
    a: f64,
    b: f64,
    /// Of every bar, in its middle.
    weight: f64,
    /// Direction of the ground.
    incline: f64,
}

#[dynamics]
impl Parallelogram {
    fn along(&self, length: f64, angle: Expr) -> Vec2 {
        length * vec2(angle.cos(), angle.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.crank.dt().powi(2) + q.coupler.dt().powi(2) + q.rocker.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        let pin = self.along(self.a, q.crank);
        let (coupler, rocker) = (0.5 * self.along(self.b, q.coupler), 0.5 * self.along(self.a, q.rocker));
        self.weight * (0.5 * pin.y + (pin + coupler).y + rocker.y)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.along(self.a, q.crank) + self.along(self.b, q.coupler)
            - self.along(self.a, q.rocker)
            - self.b * vec2(self.incline.cos(), self.incline.sin())
    }
}

/// The same on its branch, coupler along the ground: one angle, no constraint.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad)]
#[units(inertia: kg * m^2, a: m, weight: N)]
struct Branch {
    inertia: f64,
    a: f64,
    weight: f64,
}

#[dynamics]
impl Branch {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.inertia * q.crank.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * self.weight * self.a * q.crank.sin()
    }
}

impl Parallelogram {
    fn new(weight: f64, incline: f64) -> Self {
        Self { inertia: 1.0, a: 0.5, b: 0.8, weight, incline }
    }
    fn start(&self, crank: f64, rate: f64) -> State<Self> {
        let builder = self.state().crank(crank).coupler(self.incline).rocker(crank);
        builder.crank_rate(rate).rocker_rate(rate).build().unwrap()
    }
    /// The crank's angle in the motion on the branch.
    fn truth(&self, crank: f64, rate: f64, t: f64) -> f64 {
        let branch = Branch { inertia: self.inertia, a: self.a, weight: self.weight };
        let start = branch.state().crank(crank).crank_rate(rate).build().unwrap();
        branch.simulate(start).until(t).tolerance(1e-13).run().unwrap().end().crank()
    }
}
