//! Models of one scene beside each other, derived: what their reports count is what a comparison says they
//! cost, and units are kept apart.

use std::time::Duration;

use dynamics::analysis::{LadderError, Rung, compare};
use dynamics::prelude::*;

/// A pendulum in its angle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(m: kg, l: m, g: m / s^2)]
struct Angle {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Angle {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * self.bob(q).y
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        self.m * (self.l * q.theta.dt().powi(2) + self.g * q.theta.cos())
    }
    #[output]
    fn height(&self, q: &Coordinates<Self>) -> Expr {
        self.bob(q).y
    }
}

/// The same pendulum in Cartesian coordinates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, g: m / s^2)]
struct Cartesian {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Cartesian {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        (q.x.powi(2) + q.y.powi(2)).sqrt() - self.l
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        -q.reaction(Self::rod)
    }
    /// Of another unit than the height of the other model.
    #[output]
    fn height(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
}

fn models() -> (Angle, Cartesian) {
    (Angle { m: 2.0, l: 0.7, g: 9.81 }, Cartesian { m: 2.0, l: 0.7, g: 9.81 })
}

/// Operations of the accelerations per call, as a report lists them.
fn counted(report: &str) -> usize {
    let line =
        report.lines().find(|line| line.starts_with("accelerations ")).expect("the report counts them");
    line.split_whitespace().nth(1).and_then(|count| count.parse().ok()).expect("a count")
}

#[test]
fn minimal_and_redundant_coordinates_agree_and_cost_what_their_reports_count() {
    let (angle, cartesian) = models();
    let found = compare("pendulum")
        .rung(Rung::new("angle", &angle, angle.state().theta(1.0).build().unwrap()))
        .rung(Rung::new(
            "Cartesian",
            &cartesian,
            cartesian.state().x(0.7 * 1f64.sin()).y(-0.7 * 1f64.cos()).build().unwrap(),
        ))
        .outputs(["tension"])
        .until(5.0)
        .effort(Duration::ZERO)
        .run()
        .unwrap();
    let output = &found.outputs()[0];
    assert_eq!((output.name.as_str(), output.unit.as_str()), ("tension", "N"));
    let [own, full] = found.rungs() else { panic!("two rungs") };
    assert_eq!(own.operations, Some(counted(Angle::REPORT)));
    assert_eq!(full.operations, Some(counted(Cartesian::REPORT)));
    assert_eq!((own.coordinates, own.constraints, full.coordinates, full.constraints), (1, 0, 2, 1));
    assert_eq!(own.work(), own.operations.map(|count| count as f64 * own.evaluations as f64));
    let difference = found.difference("angle", "tension").unwrap();
    assert!(difference.bound() < 1e-5, "{difference:?}");
    let verdict = found.sufficient(1e-5).unwrap();
    assert_eq!(verdict.rung, "angle");
    assert!(verdict.work_ratio.is_some_and(|ratio| ratio > 1.0), "{verdict}");
    assert!(verdict.to_string().ends_with(" times its operations"), "{verdict}");
}

#[test]
fn outputs_in_different_units_are_not_compared() {
    let (angle, cartesian) = models();
    let start = cartesian.state().y(-0.7).build().unwrap();
    let refused = compare("pendulum")
        .rung(Rung::new("angle", &angle, angle.state().build().unwrap()))
        .rung(Rung::new("Cartesian", &cartesian, start))
        .until(5.0)
        .run()
        .unwrap_err();
    assert!(matches!(&refused, LadderError::Units { output, .. } if output == "height"), "{refused}");
}
