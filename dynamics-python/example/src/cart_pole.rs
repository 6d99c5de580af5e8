//! A cart swings its pole up and catches it.

use dynamics::prelude::*;

/// A cart with a pole, and a motor that pushes the cart.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, theta: rad)]
#[inputs(force: N)]
#[units(cart: kg, bob: kg, length: m, g: m / s^2)]
pub struct CartPole {
    pub cart: f64,
    pub bob: f64,
    pub length: f64,
    pub g: f64,
}

#[dynamics]
impl CartPole {
    fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x + self.length * q.theta.sin(), self.length * q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.cart * q.x.dt().powi(2) + 0.5 * self.bob * self.tip(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.bob * self.g * self.tip(q).y
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.force)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (cart, tip) = (vec2(q.x, 0.0), self.tip(q));
        Drawing::new()
            .ground([-2.0, -0.1], [2.0, -0.1])
            .tail("tip", tip, 1.0)
            .fill(Color::Faint)
            .rectangle(cart, 0.4, 0.2, 0.0)
            .line(cart, tip)
            .disc(tip, 0.06)
            .color(Color::Red)
            .arrow(cart, cart + vec2(0.03 * q.force, 0.0))
    }
}
