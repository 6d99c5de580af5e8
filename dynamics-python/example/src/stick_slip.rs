//! A block on a running belt, held by a spring. It rides along until the spring tears it off, and slips back.

use std::f64::consts::TAU;

use dynamics::prelude::*;

/// A block on a running belt, held by a spring: it rides along until the spring tears it off, and slips back.
/// This is how a violin string sounds and a brake squeals. Run the belt faster, or make both frictions equal,
/// and it stops squealing.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, stiffness: N / m, g: m / s^2, belt: m / s)]
pub struct Block {
    pub mass: f64,
    pub stiffness: f64,
    pub g: f64,
    /// Speed of the belt.
    pub belt: f64,
    /// Friction at rest and in motion.
    pub static_mu: f64,
    pub kinetic_mu: f64,
}

#[dynamics]
impl Block {
    fn weight(&self) -> f64 {
        self.mass * self.g
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.x.powi(2)
    }
    /// It can be integrated, to x − v t, and that is meant: the block sticks wherever it is.
    #[nonholonomic(switched, integrable)]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() - self.belt
    }
    #[force]
    fn sliding(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.kinetic_mu * self.weight() * q.slip(Self::grip))
    }
    #[event]
    fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
        self.static_mu * self.weight() - q.reaction(Self::grip).abs()
    }
    /// Force of the belt on the block.
    #[output]
    fn friction(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::grip) - self.kinetic_mu * self.weight() * q.slip(Self::grip)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (block, foot) = (vec2(q.x, 0.05), vec2(q.x, 0.012));
        let mut drawing = Drawing::new()
            .color(Color::Faint)
            .line([-0.3, 0.0], [0.5, 0.0])
            .line([-0.3, -0.08], [0.5, -0.08])
            .arc([-0.3, -0.04], 0.04, 0.25 * TAU, 0.75 * TAU)
            .arc([0.5, -0.04], 0.04, -0.25 * TAU, 0.25 * TAU);
        // Cleats, so that the belt is seen to run.
        let run = (self.belt * q.t).value().rem_euclid(0.1);
        for k in 0..8 {
            let x = 0.1 * f64::from(k) + run - 0.3;
            drawing = drawing.line([x, 0.0], [x, -0.02]);
        }
        drawing
            .plain()
            .line([-0.3, 0.02], [-0.3, 0.12])
            .spring([-0.3, 0.05], block - vec2(0.05, 0.0))
            .fill(Color::Blue)
            .rectangle(block, 0.1, 0.1, 0.0)
            .color(Color::Red)
            .width(3.0)
            .arrow(foot, foot + 0.3 / self.weight() * vec2(self.friction(q), 0.0))
    }
}
