//! Constraints as the language declares them: what the macro emits against hand results and against the model's own functions on jets.
#![allow(missing_docs)]

use dynamics::prelude::*;

/// A mass point on a rod, in Cartesian coordinates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, g: m / s^2)]
pub struct Pendulum {
    pub m: f64,
    pub l: f64,
    pub g: f64,
}

#[dynamics]
impl Pendulum {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.place(q).norm_squared() - self.l.powi(2))
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        -q.reaction(Self::rod) * self.l
    }
}

#[test]
fn the_cartesian_pendulum() {
    let model = Pendulum { m: 2.0, l: 1.5, g: 9.81 };
    let (angle, rate) = (0.7_f64, 1.3_f64);
    let (s, c) = angle.sin_cos();
    let (l, g) = (model.l, model.g);
    let state = model.state().x(l * s).y(-l * c).x_rate(l * c * rate).y_rate(l * s * rate).build().unwrap();
    assert!(model.residual(&state)[0].abs() < 1e-15);
    assert!(model.velocity_residual(&state)[0].abs() < 1e-15);
    let (j, gamma) = (model.jacobian(&state), model.gamma(&state));
    assert!((j[(0, 0)] - l * s).abs() < 1e-15 && (j[(0, 1)] + l * c).abs() < 1e-15);
    assert!((gamma[0] + l * l * rate * rate).abs() < 1e-14);
    // θ̈ = −(g/l) sin θ, tension m(g cos θ + l θ̇²).
    let turning = -g / l * s;
    let a = model.accelerations(&state).unwrap();
    assert!((a[0] - l * (c * turning - s * rate * rate)).abs() < 1e-13, "{a}");
    assert!((a[1] - l * (s * turning + c * rate * rate)).abs() < 1e-13, "{a}");
    let mut outputs = [0.0];
    model.outputs(&state, &mut outputs).unwrap();
    assert!((outputs[0] - model.m * (g * c + l * rate * rate)).abs() < 1e-12, "{outputs:?}");
    assert_eq!(Pendulum::ROWS[0].name, "rod");
    assert_eq!(Pendulum::ROWS[0].unit, "m^2");
    assert_eq!(Pendulum::OUTPUTS[0].unit, "N");
}
