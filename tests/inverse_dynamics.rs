//! Forces that a motion needs: zero for what a model does by itself, reactions and forces that depend on them included, and M q̈ − Q by entries for any other.

use dynamics::prelude::*;

/// A block on a floor, with friction by the reaction; it carries a pendulum.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, theta: rad)]
#[inputs(push: N)]
#[units(m: kg, bob: kg, l: m, g: m / s^2)]
struct Block {
    m: f64,
    bob: f64,
    l: f64,
    g: f64,
    friction: f64,
}
#[dynamics]
impl Block {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y) + self.l * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.bob * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m * q.y + self.bob * self.bob(q).y)
    }
    #[holonomic]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[force]
    fn rubbing(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.push - self.friction * q.reaction(Self::floor))
    }
}

const BLOCK: Block = Block { m: 2.0, bob: 0.5, l: 0.3, g: 9.81, friction: 0.2 };

#[test]
fn what_a_model_does_by_itself_needs_nothing() {
    let state = BLOCK.state().theta(0.7).theta_rate(-2.0).x_rate(1.5).push(3.0).build().expect("on the floor");
    let solved =
        dynamics::constrain::solve_once(&BLOCK, &BLOCK.constants().expect("regular"), &state).expect("one solution");
    let nothing = BLOCK.inverse_dynamics_with(&state, &solved.accelerations, &solved.multipliers);
    assert!(nothing.norm() < 1e-14 * 25.0, "{nothing:?}");
    assert!(solved.multipliers[0] > 20.0);
    // Without reactions they are part of what is needed: the floor's, and friction along with it.
    let all = BLOCK.inverse_dynamics(&state, &solved.accelerations);
    let floor = solved.multipliers[0];
    for (found, wanted) in all.iter().zip([-BLOCK.friction * floor, floor, 0.0]) {
        assert!((found - wanted).abs() < 1e-13 * floor, "{all:?}");
    }
}

#[test]
fn any_accelerations() {
    let state = BLOCK.state().theta(0.7).theta_rate(-2.0).x_rate(1.5).push(3.0).build().expect("on the floor");
    let a = [0.4, -1.1, 6.0];
    let found = BLOCK.inverse_dynamics(&state, &a.into());
    // By hand: d/dt of p, less ∂L/∂q and the push.
    let (s, c) = 0.7_f64.sin_cos();
    let bob = [a[0] + BLOCK.l * (c * a[2] - s * 4.0), a[1] + BLOCK.l * (s * a[2] + c * 4.0) + BLOCK.g];
    let wanted = [
        BLOCK.m * a[0] + BLOCK.bob * bob[0] - 3.0,
        BLOCK.m * (a[1] + BLOCK.g) + BLOCK.bob * bob[1],
        BLOCK.bob * BLOCK.l * (c * bob[0] + s * bob[1]),
    ];
    for (found, wanted) in found.iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-13 * 25.0, "{found} for {wanted}");
    }
}
