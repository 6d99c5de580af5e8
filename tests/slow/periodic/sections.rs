//! Poincaré sections.

use std::f64::consts::TAU;

use dynamics::analysis::PeriodicError;
use dynamics::output::Chart;
use dynamics::prelude::*;
use dynamics::simulate::Direction;

use crate::double_pendulum::DoublePendulum;
use crate::models::{Duffing, Pendulum, VanDerPol};

static STOP: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(true);

#[test]
fn a_cycle_crosses_in_one_point() {
    let model = VanDerPol { mu: 1.0 };
    let start = model.state().x(0.5).build().unwrap();
    let section = model
        .poincare(start)
        .section(|s| s.x(), Direction::Rising)
        .skip(20)
        .points(10)
        .until(500.0)
        .run()
        .unwrap();
    assert_eq!(section.points.len(), 10);
    let first = section.points[0];
    for pair in section.points.windows(2) {
        assert!((pair[1].t - pair[0].t - 6.663_286_859_323_13).abs() < 1e-8);
        assert!(pair[1].x().abs() < 1e-12 && pair[1].x_rate() > 0.0);
        assert!((pair[1].x_rate() - first.x_rate()).abs() < 1e-8);
    }
    // It is a guess that is a solution.
    let back = section.closest_return(1).unwrap();
    let orbit = model.periodic(back.state, back.period).run().unwrap();
    assert!(orbit.iterations <= 4 && (orbit.period - back.period).abs() < 1e-8, "{orbit}");
}

#[test]
fn a_driven_oscillator_once_a_period() {
    let model = Duffing { alpha: -1.0, beta: 1.0, delta: 0.25, gamma: 0.4, omega: 1.0 };
    let start = model.state().x(1.0).build().unwrap();
    let section = model.poincare(start).every(TAU).skip(50).points(400).run().unwrap();
    assert_eq!(section.points.len(), 400);
    assert!(section.points.iter().enumerate().all(|(k, s)| (s.t - TAU * (k + 51) as f64).abs() < 1e-9));
    // A strange attractor: no two points alike, and in it an unstable cycle that the nearest return leads to.
    let back = section.closest_return(1).unwrap();
    assert!(back.miss > 1e-6 && back.miss < 0.2, "{back:?}");
    let orbit = model.periodic(back.state, back.period).run().unwrap();
    assert!(orbit.floquet.is_unstable(), "{orbit}");
    let chart = Chart::from(section.panel("x").unwrap()).to_svg();
    assert!(chart.starts_with("<svg") && section.panel("y").is_none());
}

#[test]
fn angles_are_folded_and_turns_counted() {
    let model = Pendulum { m: 1.0, l: 1.0, g: 9.81 };
    let start = model.state().theta_rate(9.0).build().unwrap();
    let section = model.poincare(start).section(|s| s.theta().cos(), Direction::Falling).fold("theta", TAU);
    let section = section.points(5).until(20.0).run().unwrap();
    assert!(section.points.iter().all(|s| (s.theta() - TAU / 4.0).abs() < 1e-9), "{section:?}");
    let back = section.closest_return(1).unwrap();
    assert!(back.turns == [("theta", TAU)] && back.miss < 1e-4, "{back:?}");
    let orbit =
        model.periodic(back.state, back.period).hold("theta", TAU / 4.0).advance("theta", TAU).run().unwrap();
    assert!((orbit.period - back.period).abs() < 1e-7);
}

/// Folding by what is no period of the model would lay points on each other that are not alike; and a motion
/// that an event ends has fewer points than were asked for.
#[test]
fn folds_that_are_none_and_motions_that_end_are_said() {
    let model = Pendulum { m: 1.0, l: 1.0, g: 9.81 };
    let start = model.state().theta_rate(9.0).build().unwrap();
    for by in [3.0, TAU / 2.0] {
        let section =
            model.poincare(start).section(|s| (0.5 * s.theta()).sin(), Direction::Any).fold("theta", by);
        let said = section.points(5).until(20.0).run().unwrap_err();
        assert!(matches!(said, PeriodicError::NotAlike { turned: "theta", .. }), "{said}");
    }
    let section = model.poincare(start).every(0.1).points(50);
    let ended =
        section.simulated(|run| run.event("over", |s| s.theta() - 12.0).stop_at("over", Direction::Rising));
    let said = ended.run().unwrap_err();
    let PeriodicError::BrokenOff { points, found, .. } = &said else { panic!("{said}") };
    assert!(*points > 3 && *points < 50 && found.len() == *points, "{said}");
}

/// Held to x = 0 by a spring that an angle stiffens: on the section nobody sees the angle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, theta, z)]
struct Stiffened {
    mass: f64,
    spring: f64,
    stiffened: f64,
    g: f64,
}

#[dynamics]
impl Stiffened {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec3(q.x, q.theta, q.z).dt().norm_squared()
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.spring * q.x.powi(2)
            + 0.5 * self.stiffened * (q.x * q.theta).powi(2)
            + self.mass * self.g * q.z
    }
}

/// What depends on the folded coordinate may vanish on the section with another; what falls beside it is
/// large.
#[test]
fn folds_are_judged_beside_the_section() {
    let model = Stiffened { mass: 1.0, spring: 1.0, stiffened: 1.0, g: 9.81e6 };
    let start = model.state().x(0.5).theta(0.2).theta_rate(1.0).build().unwrap();
    let section = model.poincare(start).section(|s| s.x(), Direction::Rising).points(4).until(200.0);
    let said = section.fold("theta", TAU).run().unwrap_err();
    assert!(matches!(said, PeriodicError::NotAlike { turned: "theta", .. }), "{said}");
}

#[test]
fn a_swing_of_little_energy_lies_on_a_curve() {
    // θ₁ = 0 rising: of a regular motion the points lie on a closed curve, and energy is that of the start on
    // all of them.
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let start = model.state().theta1(0.2).theta2(0.1).build().unwrap();
    let section = model
        .poincare(start)
        .section(|s| s.theta1(), Direction::Rising)
        .points(50)
        .until(1000.0)
        .run()
        .unwrap();
    use dynamics::model::Dynamics;
    let energy = model.energy_function(&start);
    assert!(
        section
            .points
            .iter()
            .all(|s| (model.energy_function(s) - energy).abs() < 1e-7 && s.theta1().abs() < 1e-11)
    );
}

#[test]
fn a_section_that_is_not_crossed_says_how_near_it_was() {
    let model = Pendulum { m: 1.0, l: 1.0, g: 9.81 };
    let start = model.state().theta(0.5).build().unwrap();
    let said =
        model.poincare(start).section(|s| s.theta() - 1.0, Direction::Any).until(5.0).run().unwrap_err();
    let PeriodicError::NeverCrossed { points: 0, range: [low, high], .. } = said else { panic!("{said}") };
    assert!((low + 1.5).abs() < 0.05 && (high + 0.5).abs() < 1e-6, "{low} {high}");
    for said in [
        model.poincare(start).run().unwrap_err(),
        model.poincare(start).every(1.0).points(0).run().unwrap_err(),
        model.poincare(start).section(|s| s.theta(), Direction::Any).every(1.0).until(9.0).run().unwrap_err(),
        model.poincare(start).section(|s| s.theta(), Direction::Any).run().unwrap_err(),
        model.poincare(start).every(0.0).run().unwrap_err(),
        model.poincare(start).every(1.0).fold("theta", -1.0).run().unwrap_err(),
    ] {
        assert!(matches!(said, PeriodicError::Option { .. }), "{said}");
    }
    for points in [usize::MAX, 1_000_000_000] {
        let said = model.poincare(start).every(1.0).points(points).skip(2).run().unwrap_err();
        assert!(matches!(said, PeriodicError::Option { .. }), "{said}");
    }
    // What was found comes with the error: θ = 0 rising, three times.
    let section = model.poincare(start).section(|s| s.theta(), Direction::Rising);
    let said = section.points(10).until(6.0).run().unwrap_err();
    let PeriodicError::NeverCrossed { points: 3, found, .. } = said else { panic!("{said}") };
    assert!(
        found.len() == 3 && found.iter().all(|p| p.len() == 3 && p[1].abs() < 1e-12 && p[2] > 0.0),
        "{found:?}"
    );
    // Options reach the simulation: this one is cancelled.
    let said = model.poincare(start).every(1.0).simulated(|run| run.cancel(&STOP)).run().unwrap_err();
    assert!(matches!(said, PeriodicError::BrokenOff { points: 0, .. }), "{said}");
    let said = model.poincare(start).event("nothing", Direction::Any).until(1.0).run().unwrap_err();
    assert!(matches!(said, PeriodicError::BrokenOff { points: 0, .. }), "{said}");
}

#[test]
fn without_a_number_all_crossings_are_taken() {
    let model = Pendulum { m: 1.0, l: 1.0, g: 9.81 };
    let start = model.state().theta(0.5).build().unwrap();
    let section = model.poincare(start).section(|s| s.theta(), Direction::Rising).until(100.0).run().unwrap();
    // A period of 2.0378 s.
    assert_eq!(section.points.len(), 49);
    let once = model.poincare(start).every(0.01).run().unwrap();
    assert_eq!(once.points.len(), 1000);
}

#[test]
fn a_start_on_the_section_is_its_first_point() {
    let model = Pendulum { m: 1.0, l: 1.0, g: 9.81 };
    let start = model.state().theta_rate(1.0).build().unwrap();
    let section =
        |direction| model.poincare(start).section(|s| s.theta(), direction).points(3).until(10.0).run();
    let rising = section(Direction::Rising).unwrap();
    assert_eq!((rising.points.len(), rising.points[0].t()), (3, 0.0));
    // A period lies between.
    let [first, second] = [rising.points[1].t(), rising.points[2].t() - rising.points[1].t()];
    assert!(first > 2.0 && (first - second).abs() < 1e-8);
    // The other way it is crossed later.
    let falling = section(Direction::Falling).unwrap();
    assert!(falling.points.len() == 3 && (falling.points[0].t() - 0.5 * first).abs() < 1e-8);
}
