//! Units of outputs: declared ones, and moments, which have the dimension of energies.

use super::{model, try_model};

/// An arm with a damped bearing, held by a constraint on its angle and driven by a motor.
fn arm(units: &str, output: &str) -> [String; 2] {
    let declaration = format!(
        "#[coordinates(theta: rad, phi: rad)] #[inputs(motor: N * m)]
         #[units(inertia: kg * m^2, c: N * m * s {units})] struct Arm {{ inertia: f64, c: f64 }}"
    );
    let implementation = format!(
        "impl Arm {{
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {{
                0.5 * self.inertia * (q.theta.dt().powi(2) + q.phi.dt().powi(2))
            }}
            #[dissipation] fn bearing(&self, q: &Coordinates<Self>) -> Expr
            {{ 0.5 * self.c * q.theta.dt().powi(2) }}
            #[force] fn drive(&self, q: &Coordinates<Self>) -> Force {{ Force::along(q.theta, q.motor) }}
            #[holonomic] fn gear(&self, q: &Coordinates<Self>) -> Expr {{ q.phi - 2.0 * q.theta }}
            #[output] fn shown(&self, q: &Coordinates<Self>) -> Expr {{ {output} }}
        }}"
    );
    [declaration, implementation]
}

fn unit(units: &str, output: &str) -> String {
    let [declaration, implementation] = arm(units, output);
    model(&declaration, &implementation).compiled.equations.outputs[0].unit.clone()
}

#[test]
fn moments_are_told_in_newton_metres() {
    for (output, expected) in [
        ("q.reaction(Self::gear)", "N*m"),
        ("self.inertia * q.theta.dt().dt()", "N*m"),
        ("q.motor - self.c * q.theta.dt()", "N*m"),
        ("0.5 * self.inertia * q.theta.dt().powi(2)", "J"),
        ("self.c * q.theta.dt()", "J"),
        ("q.motor * q.theta.dt()", "W"),
    ] {
        assert_eq!(unit("", output), expected, "{output}");
    }
}

#[test]
fn units_of_outputs_can_be_declared() {
    assert_eq!(unit(", shown: N * m", "self.c * q.theta.dt()"), "N*m");
    let [declaration, implementation] = arm(", shown: N", "self.c * q.theta.dt()");
    let errors = try_model(&declaration, &implementation).expect_err("a force is no moment");
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert_eq!(errors[0].0, "shown");
    assert!(
        errors[0].1.starts_with("`shown` is in `J`, but what `#[units(..)]` says of it is in `N`"),
        "{errors:?}"
    );
}
