//! Results print themselves: what a program shows while one works with it names what it is about.

use dynamics::prelude::*;

/// A mass on a spring that a force pushes.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[inputs(push: N)]
#[units(mass: kg, stiffness: N / m, damping: N * s / m)]
struct Slider {
    mass: f64,
    stiffness: f64,
    damping: f64,
}

#[dynamics]
impl Slider {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt() * q.x.dt()
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.x * q.x
    }
    #[force]
    fn damper(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.push - self.damping * q.x.dt())
    }
    #[output]
    fn place(&self, q: &Coordinates<Self>) -> Expr {
        q.x
    }
}

#[test]
fn results_print_what_they_are_about() {
    let slider = Slider { mass: 2.0, stiffness: 8.0, damping: 0.0 };
    let rest = slider.state().push(0.0).build().unwrap();
    let linear = slider.linearize(&rest).unwrap();
    let text = linear.to_string();
    assert!(text.contains("small motions in x [m]") && text.contains("K =  8.000000e0"), "{text}");
    let space = slider.state_space(&rest).unwrap();
    let text = space.to_string();
    assert!(text.contains("inputs  push [N]") && text.contains("outputs place [m]"), "{text}");
    let changes = slider.frequencies_by(&rest, "stiffness").unwrap();
    // ω = √(k/m), ∂ω/∂k = 1/(2 √(k m)).
    let text = changes[0].to_string();
    assert!(text.starts_with("ω = 2.000000000e0") && text.contains("1.250000e-1"), "{text}");
    let change = slider.equilibrium_by(&rest, "stiffness").unwrap().to_string();
    assert!(change.contains("x [m]"), "{change}");
}
