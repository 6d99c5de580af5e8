//! A single-cylinder four-stroke engine with a flywheel: a slider-crank driven by gas pressure.

use std::f64::consts::PI;

use dynamics::prelude::*;

/// A single-cylinder engine: a slider-crank driven by the pressure of its gas.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad, phi: rad, x: m)]
#[inputs(pressure: Pa)]
#[units(
    crank: m, rod: m, bore: m, flywheel: kg * m^2, rod_mass: kg, rod_inertia: kg * m^2, piston: kg,
    load: N * m * s
)]
#[nominal(
    crank = 0.04,
    rod = 0.14,
    bore = 0.08,
    flywheel = 0.3,
    rod_mass = 0.5,
    rod_inertia = 1.5e-3,
    piston = 0.4,
    load = 0.1
)]
pub struct Engine {
    pub crank: f64,
    pub rod: f64,
    pub bore: f64,
    /// Of crank and flywheel.
    pub flywheel: f64,
    pub rod_mass: f64,
    /// About the centre of mass.
    pub rod_inertia: f64,
    pub piston: f64,
    pub load: f64,
}

#[dynamics]
impl Engine {
    fn crank_pin(&self, q: &Coordinates<Self>) -> Vec2 {
        self.crank * vec2(q.theta.cos(), q.theta.sin())
    }
    fn along_rod(&self, q: &Coordinates<Self>, part: f64) -> Vec2 {
        self.crank_pin(q) + part * self.rod * vec2(q.phi.cos(), -q.phi.sin())
    }
    fn piston_pin(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, 0.0)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.flywheel * q.theta.dt().powi(2)
            + 0.5 * self.rod_mass * self.along_rod(q, 0.3).dt().norm_squared()
            + 0.5 * self.rod_inertia * q.phi.dt().powi(2)
            + 0.5 * self.piston * q.x.dt().powi(2)
    }
    /// The rod ends at the piston pin.
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.piston_pin(q) - self.along_rod(q, 1.0)
    }
    #[force]
    fn gas(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -0.25 * PI * self.bore.powi(2) * q.pressure)
    }
    #[dissipation]
    fn brake(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.load * q.theta.dt().powi(2)
    }
    /// Force of the rod on the piston pin; the cylinder wall bears its y-component.
    #[output]
    fn pin_force(&self, q: &Coordinates<Self>) -> Vec2 {
        q.reaction(Self::closure)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (pin, piston, r) = (self.crank_pin(q), self.piston_pin(q), 0.5 * self.bore);
        let head = self.crank + self.rod + 0.035;
        let thrust = q.reaction(Self::closure).y;
        Drawing::new()
            .color(Color::Faint)
            .line([0.06, r], [head, r])
            .line([0.06, -r], [head, -r])
            .line([head, r], [head, -r])
            .circle([0.0, 0.0], 0.055)
            .plain()
            .line([0.0, 0.0], pin)
            .disc(pin, 0.005)
            .fill(Color::Blue)
            .rectangle(piston, 0.04, 2.0 * r, 0.0)
            .line(pin, piston)
            .color(Color::Red)
            .arrow(piston, piston + vec2(0.0, 5e-5 * thrust))
    }
}
