//! What is steady now, and is not later: a push that is yet to come, and what turns until a weight takes
//! hold. And what is only stiff, and stays.

use dynamics::analysis::EquilibriumError;
use dynamics::prelude::*;

/// A sleigh on one skate below its mass, on a plane that falls along −y; pushed along the skate at a time.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[units(m: kg, gyration: m, g: m / s^2, push: N, time: s, lasts: s)]
struct Sleigh {
    m: f64,
    gyration: f64,
    g: f64,
    push: f64,
    time: f64,
    lasts: f64,
}
#[dynamics]
impl Sleigh {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (vec2(q.x, q.y).dt().norm_squared() + (self.gyration * q.phi.dt()).powi(2))
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        let late = (q.t - self.time) / self.lasts;
        Force::at(vec2(q.x, q.y), self.push * (-late.powi(2)).exp() * vec2(q.phi.cos(), q.phi.sin()))
    }
    #[nonholonomic]
    fn skate(&self, q: &Coordinates<Self>) -> Expr {
        q.phi.cos() * q.y.dt() - q.phi.sin() * q.x.dt()
    }
}
const LEVEL: Sleigh = Sleigh { m: 1.0, gyration: 0.3, g: 0.0, push: 0.0, time: 10.0, lasts: 0.2 };

/// A wheel that is turned, with a mass beside it; pushed at a time.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(turn: rad, x: m)]
#[units(inertia: kg * m^2, m: kg, k: N / m, push: N, time: s, lasts: s)]
struct Wheel {
    inertia: f64,
    m: f64,
    k: f64,
    push: f64,
    time: f64,
    lasts: f64,
}
#[dynamics]
impl Wheel {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * q.turn.dt().powi(2) + 0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * q.x.powi(2)
    }
    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        let late = (q.t - self.time) / self.lasts;
        Force::along(q.x, self.push * (-late.powi(2)).exp())
    }
}

/// Two atoms, a millionth apart.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(m: kg, well: J, far: m)]
struct Atoms {
    m: f64,
    well: f64,
    far: f64,
}
#[dynamics]
impl Atoms {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn well(&self, q: &Coordinates<Self>) -> Expr {
        let near = (self.far / q.x).powi(6);
        self.well * (near.powi(2) - 2.0 * near)
    }
}

#[test]
fn pushes_that_are_yet_to_come_are_seen_of_what_moves() {
    // The first steps along the motion see it, or the times that are looked at after.
    let is_later = |error: &EquilibriumError| {
        matches!(
            error,
            EquilibriumError::DependsOnTime { .. } | EquilibriumError::NotSteady { name: "x", .. }
        )
    };
    for time in [0.8, 10.0, 60.0] {
        let sleigh = Sleigh { push: 1.0, time, ..LEVEL };
        let error =
            sleigh.steady(&sleigh.state().x_rate(1.0).build().unwrap()).expect_err("a push along the skate");
        assert!(is_later(&error), "{time}: {error}");
        let wheel = Wheel { inertia: 1.0, m: 1.0, k: 1.0, push: 1.0, time, lasts: 0.2 };
        let error = wheel
            .steady(&wheel.state().turn_rate(0.7).build().unwrap())
            .expect_err("a push beside the wheel");
        assert!(is_later(&error), "{time}: {error}");
    }
    // Without one time stands in the model, and changes nothing.
    let one = LEVEL.steady(&LEVEL.state().x_rate(1.0).build().unwrap()).unwrap();
    assert!(one.contains_time && one.state.x_rate() == 1.0, "{one}");
}

#[test]
fn what_turns_toward_a_weight_is_not_steady() {
    // φ̇ stays, v̇ = −g sin φ: nothing accelerates across the slope, and a little later it does.
    let slope = Sleigh { g: 9.81, ..LEVEL };
    let turning = slope.state().x_rate(1.0).phi_rate(0.3).build().unwrap();
    let error = slope.steady(&turning).unwrap_err();
    assert!(
        matches!(error, EquilibriumError::NotSteady { .. } | EquilibriumError::Derivatives(_)),
        "{error}"
    );
    assert!(slope.stability(&turning).is_err());
    // Straight across it goes on.
    let across = slope.steady(&slope.state().x_rate(1.0).build().unwrap()).unwrap();
    assert!(across.state.x_rate() == 1.0 && across.state.phi() == 0.0, "{across}");
}

#[test]
fn what_is_stiff_is_at_rest_all_the_same() {
    // ω² = 72 well/(m far²): 10⁷ rad/s, so that the rounding of forces would move it far within a hundredth
    // of a second.
    for far in [1e-6, 1.0, 1e6] {
        let atoms = Atoms { m: 1.0, well: 1.0, far };
        let one = atoms.equilibrium(&atoms.state().x(1.05 * far).build().unwrap()).unwrap();
        assert!((one.state.x() / far - 1.0).abs() < 1e-14, "{far}: {one}");
        let judged = atoms.stability(&one.state).unwrap_or_else(|error| panic!("{far}: {error}"));
        let omega = judged.eigenvalues[0].im.abs();
        assert!((omega * far / 72f64.sqrt() - 1.0).abs() < 1e-12, "{far}: {judged}");
    }
}
