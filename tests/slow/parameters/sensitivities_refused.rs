//! Where sensitivities do not exist, or jump: an error that says so, and none where there is only a corner.

use dynamics::analysis::{SensitivityError, VariableError};
use dynamics::prelude::*;

use super::difference;
use super::models::{BALL, Oscillator};

#[test]
fn names_that_are_none_say_what_may_have_been_meant() {
    let model = Oscillator::PLAIN;
    let start = model.state().x(0.3).build().unwrap();
    let asked = || model.sensitivities(start).until(1.0);
    let error = asked().by(["stifness"]).run().err().unwrap();
    assert_eq!(error.to_string(), "there is no parameter or start `stifness`; did you mean `stiffness`?");
    let error = asked().by(["mass", "mass"]).run().err().unwrap();
    assert_eq!(error, SensitivityError::Variable(VariableError::Twice { name: "mass".into() }));
    assert_eq!(asked().run().err().unwrap(), SensitivityError::NoVariables);
    let error = model.sensitivities(start).by(["mass"]).run().err().unwrap();
    assert_eq!(error, SensitivityError::NoEnd);
    let error = asked().by(["mass"]).output_times([0.5, 1.5]).run().err().unwrap();
    assert_eq!(error, SensitivityError::OutOfRange { time: 1.5, start: 0.0, end: 1.0 });
    let found = asked().by(["mass"]).run().unwrap();
    assert_eq!(
        found.series("x", "damping").unwrap_err(),
        SensitivityError::NotAsked { name: "damping".into() }
    );
    assert!(matches!(
        found.series("pul", "mass"),
        Err(SensitivityError::UnknownQuantity { nearest: Some(n), .. })
        if n == "pull"
    ));
    let error = Oscillator { mass: 0.0, ..model }
        .sensitivities(start)
        .by(["damping"])
        .until(1.0)
        .run()
        .err()
        .unwrap();
    assert!(matches!(error, SensitivityError::Motion(_)), "{error}");
}

#[test]
fn resets_are_refused_with_their_time() {
    let start = BALL.state().height(1.0).build().unwrap();
    let asked = BALL.sensitivities(start).by(["g"]).until(1.0);
    let error = asked
        .with(|s| s.on_event("low", Direction::Falling, |state| state.u[0] = -state.u[0]))
        .run()
        .err()
        .unwrap();
    let SensitivityError::Jump { time, what } = &error else { panic!("{error}") };
    assert!((time - (1.0_f64 / 9.81).sqrt()).abs() < 1e-9 && what == "low", "{error}");
}

/// The accelerations of the soft floor have a corner, and no jump: the sensitivities are those of
/// differences, across two landings.
#[test]
fn corners_of_forces_are_none() {
    let start = BALL.state().height(1.0).build().unwrap();
    let found =
        BALL.sensitivities(start).by(["g", "stiffness", "height"]).until(1.4).tolerance(1e-11).run().unwrap();
    let last = found.matrix(found.times().len() - 1).unwrap();
    let moved = |k: usize, h: f64| {
        let (mut model, mut start) = (BALL, start);
        match k {
            0 => model.g += h,
            1 => model.stiffness += h,
            _ => start.q[0] += h,
        }
        model.simulate(start).until(1.4).tolerance(1e-13).run().unwrap().end().height()
    };
    for (k, h) in [1e-3, 0.1, 1e-4].into_iter().enumerate() {
        let (by, expected) = (last[(0, k)], difference(h, |h| moved(k, h)));
        assert!((by / expected - 1.0).abs() < 1e-6, "{k}: {by} {expected}");
    }
}

/// A block on a floor that rubs: where it turns round, its acceleration jumps.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, stiffness: N / m, rub: N)]
struct Block {
    mass: f64,
    stiffness: f64,
    rub: f64,
}

#[dynamics]
impl Block {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.x.powi(2)
    }
    #[force]
    fn friction(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.rub * q.x.dt().signum())
    }
}

#[test]
fn forces_that_jump_are_refused_and_before_they_do_they_are_not() {
    let block = Block { mass: 1.0, stiffness: 4.0, rub: 0.1 };
    let start = block.state().x(1.0).x_rate(-0.1).build().unwrap();
    let error = block.sensitivities(start).by(["rub"]).until(2.0).run().err().unwrap();
    let SensitivityError::Jump { time, .. } = error else { panic!("{error}") };
    assert!((1.4..1.6).contains(&time), "{time}");
    // Until then ẍ + 4 x = 0.1: ∂x/∂rub = (1 − cos 2t)/4.
    let found = block.sensitivities(start).by(["rub"]).until(1.0).tolerance(1e-11).run().unwrap();
    let (t, by) = *found.series("x", "rub").unwrap().last().unwrap();
    assert!(t == 1.0 && (by - 0.25 * (1.0 - 2f64.cos())).abs() < 1e-9, "{by}");
}

/// A bob on a rod of which two parameters tell the length: one of them alone cannot change.
mod contradiction {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(mass: kg, g: m / s^2, one: m, other: m)]
    #[nominal(one = 1.3, other = 1.3)]
    struct Twice {
        mass: f64,
        g: f64,
        one: f64,
        other: f64,
    }
    #[dynamics]
    impl Twice {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.mass * self.g * q.y
        }
        #[holonomic]
        fn rod(&self, q: &Coordinates<Self>) -> Expr {
            vec2(q.x, q.y).norm() - self.one
        }
        #[holonomic]
        #[redundant]
        fn again(&self, q: &Coordinates<Self>) -> Expr {
            vec2(q.x, q.y).norm_squared() - self.other * self.other
        }
    }

    #[test]
    fn a_parameter_of_one_of_two_equal_rods_is_refused() {
        let model = Twice { mass: 1.0, g: 9.81, one: 1.3, other: 1.3 };
        let start = model.state().x(0.5).y(-1.2).build().unwrap();
        let error = model.sensitivities(start).by(["one"]).until(1.0).run().err().unwrap();
        assert!(matches!(error, SensitivityError::Contradicts { parameter: Some("one"), .. }), "{error}");
        assert!(model.sensitivities(start).by(["g", "x"]).until(1.0).run().is_ok());
    }
}

/// What a rod that was let go does is that of a free bob: of released constraints there is no generated
/// solution.
mod released {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(mass: kg, g: m / s^2, length: m, drag: N * s / m)]
    struct Thrown {
        mass: f64,
        g: f64,
        length: f64,
        drag: f64,
    }
    #[dynamics]
    impl Thrown {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.mass * self.g * q.y
        }
        #[dissipation]
        fn air(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.drag * vec2(q.x, q.y).dt().norm_squared()
        }
        #[holonomic(switched)]
        fn rod(&self, q: &Coordinates<Self>) -> Expr {
            vec2(q.x, q.y).norm() - self.length
        }
    }

    #[test]
    fn released_constraints_hold_nothing() {
        let model = Thrown { mass: 2.0, g: 9.81, length: 1.0, drag: 0.6 };
        let start = model.state().x(0.6).y(-0.8).x_rate(3.0).release("rod").build().unwrap();
        let by = ["drag", "length", "x_rate"];
        let found = model.sensitivities(start).by(by).until(2.0).tolerance(1e-11).run().unwrap();
        let x = |drag: f64, rate: f64| 0.6 + rate * 2.0 / drag * (1.0 - (-drag).exp());
        let last = |by: &str| found.series("x", by).unwrap().last().unwrap().1;
        // With t = 2 and m = 2, (c/m) t = c.
        let expected = difference(1e-4, |h| x(0.6 + h, 3.0));
        assert!((last("drag") / expected - 1.0).abs() < 1e-9, "{} {expected}", last("drag"));
        assert!((last("x_rate") / (x(0.6, 1.0) - 0.6) - 1.0).abs() < 1e-10);
        assert_eq!(last("length"), 0.0);
    }
}
