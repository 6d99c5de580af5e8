//! What the clock shows says nothing of corners: the same happens a million seconds later, where neighbouring
//! times are 1e-10 s apart.

use dynamics::prelude::*;

use super::{FORMULATIONS, NEVER};

/// A block on a belt over a hill, whose speed changes in an instant or at a place. Its contact bends all the
/// time, and has no corner.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, g: m / s^2, limit: N, bend: 1 / m, speed: m / s, then: m / s, at: s, seam: m)]
struct Hill {
    mass: f64,
    g: f64,
    limit: f64,
    bend: f64,
    speed: f64,
    then: f64,
    at: f64,
    seam: f64,
}

#[dynamics]
impl Hill {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic(switched)]
    fn ground(&self, q: &Coordinates<Self>) -> Expr {
        q.y + self.bend * q.x.powi(2)
    }
    #[nonholonomic(switched, integrable)]
    fn belt(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() - if q.t < self.at && q.x < self.seam { self.speed } else { self.then }
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.limit * q.slip(Self::belt))
    }
    #[event]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.limit - q.reaction(Self::belt).abs()
    }
}

#[test]
fn what_bends_has_no_corner_at_late_times() {
    let hill =
        Hill { mass: 1.5, g: 10.0, limit: 20.0, bend: 1.0, speed: 1.0, then: 0.2, at: NEVER, seam: NEVER };
    for formulation in FORMULATIONS {
        let told = |at: f64, seam: f64, begin: f64, then: f64| {
            let hill = Hill { at: begin + at, seam, then, ..hill };
            let start = hill.state().at_time(begin).x(-0.5).y(-0.25).x_rate(1.0).y_rate(1.0).build().unwrap();
            let run = hill.simulate(start).until(begin + 0.9).tolerance(1e-8).formulation(formulation);
            let motion = run.contact("ground", 0.3).stick_slip("belt", "grip").run();
            let motion = motion.unwrap_or_else(|e| panic!("{formulation} {begin:e}: {e}"));
            let impacts = motion.events().iter().filter(|event| !event.impacts.is_empty()).count();
            assert_eq!(impacts, 0, "{formulation} {begin:e}: {:?}", motion.events());
            let names: Vec<String> = motion.events().iter().map(|event| event.name.to_string()).collect();
            assert!(motion.end().is_engaged("ground").unwrap(), "{formulation} {begin:e}");
            (names, motion.end().x())
        };
        for (at, seam, then) in [(0.55, NEVER, 0.2), (NEVER, 0.1, 0.2), (0.55, NEVER, 1.5)] {
            let (first, x) = told(at, seam, 0.0, then);
            assert!(!first.is_empty());
            for begin in [1e3, 1e5, 1e6] {
                let (names, late) = told(at, seam, begin, then);
                assert_eq!(names, first, "{formulation} {at} {seam} {begin:e}");
                assert!((late - x).abs() < 1e-6, "{formulation} {at} {seam} {begin:e}: {late} {x}");
            }
        }
    }
}
