//! The surface of design: models as users write them compile, and what is generated has the promised names.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

use dynamics::prelude::*;

/// Two bobs on massless rods, swinging in a vertical plane.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta1: rad, theta2: rad)]
#[units(m1: kg, m2: kg, l1: m, l2: m, g: m / s^2)]
pub struct DoublePendulum {
    pub m1: f64,
    pub m2: f64,
    pub l1: f64,
    pub l2: f64,
    pub g: f64,
}

#[dynamics]
impl DoublePendulum {
    fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l1 * vec2(q.theta1.sin(), -q.theta1.cos())
    }
    fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob1(q) + self.l2 * vec2(q.theta2.sin(), -q.theta2.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m1 * self.bob1(q).dt().norm_squared() + 0.5 * self.m2 * self.bob2(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
    }
}

#[test]
fn the_first_model() {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let start = model.state().theta1(2.0).theta2_rate(0.5).build().unwrap();
    assert_eq!(
        (start.theta1(), start.theta2(), start.theta1_rate(), start.theta2_rate()),
        (2.0, 0.0, 0.0, 0.5)
    );
    let jets = DoublePendulum::coordinates_with(&start, &Default::default(), &[]);
    assert_eq!(model.bob1(&jets).x.value(), 2f64.sin());
}

#[test]
fn it_evaluates() {
    let model = DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let s = model.state().theta1(0.4).theta2(1.1).theta1_rate(0.3).theta2_rate(-0.7).build().unwrap();
    let a = model.accelerations(&s).unwrap();
    let m = model.mass_matrix(&s);
    let q = model.generalized_force(&s);
    assert!((m * a - q).norm() < 1e-13, "{a} {m} {q}");
    assert!((m[(0, 0)] - 2.3).abs() < 1e-15);
    assert!((m[(0, 1)] - 1.3 * 0.8 * (0.7f64).cos()).abs() < 1e-15);
    let j = model.state_jacobian(&s).unwrap();
    assert!((j.accelerations - a).norm() < 1e-13);
}
