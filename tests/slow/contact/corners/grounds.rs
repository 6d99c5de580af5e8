//! Grounds that change their height or their slope at places: what slides falls off, is struck, or is told
//! which face it meets.

use dynamics::prelude::*;

use super::{FORMULATIONS, NEVER, in_all_ways};

/// A block on a ground that changes its height and its slope at places.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, g: m / s^2, edge: m, high: m, bend: m)]
struct Ground {
    mass: f64,
    g: f64,
    edge: f64,
    high: f64,
    bend: f64,
    slope: f64,
}

#[dynamics]
impl Ground {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        let height = if q.x < self.edge { 0.0 } else { self.high };
        q.y - height - self.slope * (q.x - self.bend).max(0.0)
    }
}

const GROUND: Ground = Ground { mass: 2.0, g: 10.0, edge: NEVER, high: 0.0, bend: NEVER, slope: 0.0 };

fn on_the_ground(ground: &Ground, restitution: f64, check: impl Fn(&str, f64, &Motion<'_, Ground>)) {
    let start = ground.state().x_rate(1.0).build().unwrap();
    in_all_ways(ground, (start, 1.5), ("floor", restitution), check);
}

/// Off an edge, or off a ground that bends down more steeply than it falls, it flies.
#[test]
fn what_slides_off_an_edge_falls() {
    for e in [0.0, 0.4] {
        on_the_ground(&Ground { edge: 0.5, high: -0.5, ..GROUND }, e, |case, tolerance, motion| {
            let state = motion.at(0.7);
            let errors = [state.x() - 0.7, state.y() + 0.2];
            assert!(errors.iter().all(|e| e.abs() < 30.0 * tolerance), "{case}: {errors:?}");
            let [opens, hit, ..] = motion.events() else { panic!("{case}: {:?}", motion.events()) };
            let times = [opens.time() - 0.5, hit.time() - 0.5 - 0.1f64.sqrt()];
            assert!(
                times.iter().all(|e| e.abs() < 30.0 * tolerance) && opens.impacts.is_empty(),
                "{case}: {times:?}"
            );
            assert!(
                (hit.after.y_rate() - e * 10.0 * 0.1f64.sqrt()).abs() < 100.0 * tolerance,
                "{case}: {hit:?}"
            );
        });
        on_the_ground(&Ground { bend: 0.5, slope: -2.0, ..GROUND }, e, |case, tolerance, motion| {
            let errors = [motion.at(0.7).x() - 0.7, motion.at(0.7).y() + 0.2];
            assert!(errors.iter().all(|e| e.abs() < 30.0 * tolerance), "{case}: {errors:?}");
            // y = −5 τ² meets −2 τ.
            assert!((motion.events()[1].time() - 0.9).abs() < 30.0 * tolerance, "{case}");
        });
    }
}

/// Where the ground bends up it strikes, across the face that is met: u⁺ = u − (1 + e)(n·u) n.
#[test]
fn where_the_ground_bends_up_it_strikes() {
    let slope = 0.5f64;
    let (cos, sin) = ((1.0 + slope * slope).sqrt().recip(), slope / (1.0 + slope * slope).sqrt());
    for e in [0.0, 0.4] {
        on_the_ground(&Ground { bend: 0.5, slope, ..GROUND }, e, |case, tolerance, motion| {
            let struck = &motion.events()[0];
            assert!((struck.time() - 0.5).abs() < 30.0 * tolerance, "{case}: {struck:?}");
            let (u, v) = (1.0 - (1.0 + e) * sin * sin, (1.0 + e) * sin * cos);
            let errors = [struck.after.x_rate() - u, struck.after.y_rate() - v];
            assert!(errors.iter().all(|e| e.abs() < 100.0 * tolerance), "{case}: {errors:?}");
            if e == 0.0 {
                // Up the slope and down again, and on the flat as fast as it came down.
                let along = cos * 0.2 - 0.5 * 10.0 * sin * 0.04;
                assert!((motion.at(0.7).x() - 0.5 - along * cos).abs() < 30.0 * tolerance, "{case}");
            } else {
                assert!((motion.at(0.53).x() - 0.5 - u * 0.03).abs() < 30.0 * tolerance, "{case}");
                assert!((motion.at(0.53).y() - v * 0.03 + 0.0045).abs() < 30.0 * tolerance, "{case}");
            }
        });
    }
}

/// A step up is met from the side, sliding or flying: the error says so.
#[test]
fn a_step_that_is_met_from_the_side_is_named() {
    let ground = Ground { edge: 0.5, high: 0.5, ..GROUND };
    let sliding = ground.state().x_rate(1.0).build().unwrap();
    let flying = ground.state().y(0.2).x_rate(3.0).release("floor").build().unwrap();
    for (start, time) in [(sliding, 0.5), (flying, 0.5 / 3.0)] {
        for formulation in FORMULATIONS {
            let run = || ground.simulate(start).until(1.5).formulation(formulation).contact("floor", 0.3);
            for run in
                [run().tolerance(1e-6), run().tolerance(1e-10), run().method(methods::Rk4).fixed_step(0.013)]
            {
                let error = run.run().unwrap_err();
                let message = error.to_string();
                assert!(
                    message.contains("meets a step from the side") && message.contains("of its own"),
                    "{message}"
                );
                assert!((error.time - time).abs() < 1e-5, "{formulation}: {message}");
                assert!(error.state.y() > -1e-6, "{formulation}: {message}");
            }
        }
    }
}

/// A ball over a valley whose sides stand at a right angle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, g: m / s^2)]
struct Valley {
    mass: f64,
    g: f64,
}

#[dynamics]
impl Valley {
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
        q.y - q.x.abs()
    }
}

/// Into the corner itself, or along a side of it: two faces are hit, and one function does not say what each
/// gives.
#[test]
fn a_valley_is_two_contacts() {
    let valley = Valley { mass: 1.0, g: 10.0 };
    for (x, e) in [(0.0, 0.5), (0.0, 0.0), (1e-14, 0.5), (0.5, 0.0), (0.3, 0.0)] {
        for formulation in FORMULATIONS {
            let start = valley.state().x(x).y(2.0).release("ground").build().unwrap();
            let run = valley.simulate(start).until(2.0).formulation(formulation).contact("ground", e);
            let error = run.run().map(|motion| motion.end()).unwrap_err();
            let message = error.to_string();
            assert!(
                message.contains("`ground` has a corner here")
                    && message.contains("`.contact(..)` of its own"),
                "{x} {e} {formulation}: {message}"
            );
        }
    }
}

/// A bead on a ring that an arm leads round, by its angle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, push: N / m, r: m, speed: rad / s)]
#[nominal(r = 1.0, speed = 1.0)]
struct Led {
    mass: f64,
    push: f64,
    r: f64,
    speed: f64,
}

#[dynamics]
impl Led {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[holonomic]
    fn ring(&self, q: &Coordinates<Self>) -> Expr {
        q.x.hypot(q.y) - self.r
    }
    #[holonomic(switched)]
    fn arm(&self, q: &Coordinates<Self>) -> Expr {
        self.speed * q.t - q.y.atan2(q.x)
    }
    /// Against the arm.
    #[force]
    fn presses(&self, q: &Coordinates<Self>) -> Force {
        Force::at(vec2(q.x, q.y), self.push * vec2(-q.y, q.x))
    }
}

/// An angle that is cut is no step of the ground: the arm does not let go there.
#[test]
fn a_cut_angle_is_named() {
    let led = Led { mass: 1.0, push: 1.0, r: 1.0, speed: 1.0 };
    let start = led.state().x_guess(1.0).assemble().unwrap();
    for formulation in FORMULATIONS {
        let run = || led.simulate(start).until(7.0).formulation(formulation).tolerance(1e-6);
        for run in [run(), run().contact("arm", 0.0)] {
            let error = run.run().map(|motion| motion.end()).unwrap_err();
            let message = error.to_string();
            assert!(message.contains("a turn, as an angle by `atan2` does"), "{formulation}: {message}");
            assert!((error.time - core::f64::consts::PI).abs() < 1e-3, "{formulation}: {message}");
        }
    }
}
