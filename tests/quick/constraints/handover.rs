//! Switched constraints that are never on together: they take over from each other, or exclude each other.
//! Each runs on generated code of its own.

use core::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use dynamics::prelude::*;

/// A Geneva drive of four slots: the wheel is turned by the crank's pin in a slot, and locked while the pin
/// is out.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad, wheel: rad)]
#[units(crank_inertia: kg * m^2, wheel_inertia: kg * m^2, distance: m)]
#[nominal(distance = 0.1)]
struct Geneva {
    crank_inertia: f64,
    wheel_inertia: f64,
    distance: f64,
}

#[dynamics]
impl Geneva {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.crank_inertia * q.crank.dt().powi(2) + 0.5 * self.wheel_inertia * q.wheel.dt().powi(2)
    }
    /// The pin stands in one of the slots, at 45° to the lock's positions.
    #[holonomic(switched)]
    fn slot(&self, q: &Coordinates<Self>) -> Expr {
        let arm = self.distance * 0.5f64.sqrt();
        let (x, y) = (arm * q.crank.cos() - self.distance, arm * q.crank.sin());
        (2.0 * (y.atan2(-x) + q.wheel - 0.25 * PI)).sin()
    }
    #[holonomic(switched)]
    fn lock(&self, q: &Coordinates<Self>) -> Expr {
        (2.0 * q.wheel).sin()
    }
    #[event]
    fn entry(&self, q: &Coordinates<Self>) -> Expr {
        q.crank.cos() - 0.5f64.sqrt()
    }
}

/// Where both hold the slot begins to move the wheel from rest: the rows touch there, and no motion has both.
#[test]
fn a_geneva_drive_runs_on_generated_code() {
    let model = Geneva { crank_inertia: 0.02, wheel_inertia: 0.01, distance: 0.1 };
    let constants = model.constants().unwrap();
    let start = model.state().crank(PI).crank_rate(10.0).release("slot").build().unwrap();
    let engaged =
        model.state().crank(0.3).wheel_guess(0.5).crank_rate(8.0).release("lock").assemble().unwrap();
    for state in [start, engaged] {
        assert!(model.solve_unrolled(&constants, &state).is_some());
    }
    // While it is engaged, 2 T = (J + j β'²) θ̇² with β' = dβ/dθ of the wheel: the time by the midpoint rule.
    let ratio = |t: f64| {
        let l = 0.5f64.sqrt();
        l * (t.cos() - l) / (1.0 + l * l - 2.0 * l * t.cos())
    };
    let n = 20_000;
    let step = FRAC_PI_2 / f64::from(n);
    let one =
        |k: i32| step / 10.0 * (1.0 + 0.5 * ratio(-FRAC_PI_4 + (f64::from(k) + 0.5) * step).powi(2)).sqrt();
    let turn = (0..n).map(one).sum::<f64>() + 0.15 * PI;
    let run = model
        .simulate(start)
        .until(2.0 * turn)
        .tolerance(1e-10)
        .on_event_with("entry", Direction::Rising, |c| {
            c.release("lock");
            c.engage("slot");
        })
        .on_event_with("entry", Direction::Falling, |c| {
            c.release("slot");
            c.engage("lock");
        });
    let motion = run.run().unwrap_or_else(|e| panic!("{e}"));
    let end = motion.end();
    assert!((end.crank() - 5.0 * PI).abs() < 1e-7 && (end.crank_rate() - 10.0).abs() < 1e-7, "{end:?}");
    assert!((end.wheel().abs() - PI).abs() < 1e-7, "{end:?}");
    assert!(Geneva::REPORT.contains("generated code"), "{}", Geneva::REPORT);
}

/// A block between two stops, both coordinates pushed alike.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, half: m, push: N)]
struct Stops {
    mass: f64,
    half: f64,
    push: f64,
}

#[dynamics]
impl Stops {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[potential]
    fn pushing(&self, q: &Coordinates<Self>) -> Expr {
        -self.push * (q.x + q.y)
    }
    #[holonomic(switched)]
    fn right(&self, q: &Coordinates<Self>) -> Expr {
        self.half - q.x
    }
    #[holonomic(switched)]
    fn left(&self, q: &Coordinates<Self>) -> Expr {
        self.half + q.x
    }
}

#[test]
fn end_stops_run_on_generated_code() {
    let model = Stops { mass: 2.0, half: 0.5, push: 3.0 };
    let constants = model.constants().unwrap();
    // On the right stop: it pushes back with all of the force, toward growing Φ.
    let held = model.state().x(0.5).release("left").build().unwrap();
    let solved = model.solve_unrolled(&constants, &held).expect("generated code");
    assert_eq!((solved.accelerations[0], solved.accelerations[1]), (0.0, 1.5));
    assert_eq!((solved.multipliers[0], solved.multipliers[1]), (3.0, 0.0));
    let flying = model.state().x_rate(1.0).release("left").release("right").build().unwrap();
    let solved = model.solve_unrolled(&constants, &flying).expect("generated code");
    assert_eq!((solved.accelerations[0], solved.multipliers[0]), (1.5, 0.0));
    // Between the stops without a push: a wave of straight lines.
    let free = Stops { push: 0.0, ..model };
    let start = free.state().x_rate(1.0).release("left").release("right").build().unwrap();
    let run = free.simulate(start).contact("left", 1.0).contact("right", 1.0).until(10.3).tolerance(1e-9);
    let motion = run.run().unwrap_or_else(|e| panic!("{e}"));
    for k in 0..100 {
        let t = 0.103 * f64::from(k);
        let wave = 0.5 - ((t + 0.5).rem_euclid(2.0) - 1.0).abs();
        assert!((motion.at(t).x() - wave).abs() < 1e-9, "{t}: {} for {wave}", motion.at(t).x());
    }
}
