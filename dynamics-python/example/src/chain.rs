//! A cart that runs freely on a rail, with a chain of ten links.

use dynamics::prelude::*;

/// A cart that runs freely on a rail, with a chain of ten links. Nothing pushes horizontally, so the centre
/// of mass of cart and chain keeps its place, whatever the chain does. Drag a joint and let go.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, theta: [rad; 10])]
#[units(cart: kg, mass: kg, length: m, g: m / s^2)]
pub struct Chain {
    pub cart: f64,
    pub mass: [f64; 10],
    pub length: [f64; 10],
    pub g: f64,
}

#[dynamics]
impl Chain {
    /// The lower end of link i, where its mass is.
    fn joint(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let mut place = vec2(q.x, 0.0);
        for k in 0..i + 1 {
            place += self.length[k] * vec2(q.theta[k].sin(), -q.theta[k].cos());
        }
        place
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.cart * q.x.dt().powi(2);
        for i in 0..10 {
            sum += 0.5 * self.mass[i] * self.joint(q, i).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..10 {
            sum += self.mass[i] * self.g * self.joint(q, i).y;
        }
        sum
    }
    #[output]
    fn centre_of_mass(&self, q: &Coordinates<Self>) -> Expr {
        let (mut moment, mut mass) = (self.cart * q.x, self.cart);
        for i in 0..10 {
            moment += self.mass[i] * self.joint(q, i).x;
            mass += self.mass[i];
        }
        moment / mass
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let joints: Vec<_> = (0..10).map(|i| self.joint(q, i)).collect();
        let drawing = Drawing::new()
            .tail("end", joints[9], 1.5)
            .color(Color::Faint)
            .line([-1.0, -0.08], [2.0, -0.08])
            .plain()
            .fill(Color::Faint)
            .rectangle(vec2(q.x, 0.0), 0.3, 0.16, 0.0)
            .polyline(std::iter::once(vec2(q.x, 0.0)).chain(joints.iter().copied()));
        joints.into_iter().fold(drawing, |drawing, joint| drawing.disc(joint, 0.025))
    }
}
