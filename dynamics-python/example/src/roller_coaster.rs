//! A cart on a roller coaster whose track is a smooth curve through surveyed points.

use dynamics::prelude::*;

/// A cart rides a track with a loop; the arrow is its velocity. Its speed depends on the height alone. Look
/// at the force of the rail in the loop, then begin slower or lower: where that force turns negative, only a
/// second rail holds the cart.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: m)]
#[units(mass: kg, g: m / s^2, end: m)]
pub struct RollerCoaster {
    pub mass: f64,
    pub g: f64,
    /// Where the track ends.
    pub end: f64,
    pub x: CubicSpline,
    pub y: CubicSpline,
}

#[dynamics]
impl RollerCoaster {
    fn cart(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(self.x.at(q.s), self.y.at(q.s))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.cart(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.cart(q).y
    }
    /// Force of the rail on the cart, along its normal (to the left of the direction of travel).
    #[output]
    fn rail(&self, q: &Coordinates<Self>) -> Expr {
        let velocity = self.cart(q).dt();
        let normal = velocity.perp() / velocity.norm();
        self.mass * normal.dot(velocity.dt() + vec2(0.0, self.g))
    }
    #[output]
    fn speed(&self, q: &Coordinates<Self>) -> Expr {
        self.cart(q).dt().norm()
    }
    #[event]
    fn end_of_track(&self, q: &Coordinates<Self>) -> Expr {
        q.s - self.end
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let cart = self.cart(q);
        let [first, last] = self.x.domain();
        Drawing::new()
            .color(Color::Faint)
            .curve(first, last, 400, |s| [self.x.derivatives(s)[0], self.y.derivatives(s)[0]])
            .plain()
            .disc(cart, 0.8)
            .color(Color::Red)
            .arrow(cart, cart + 0.5 * cart.dt())
    }
}
