//! Belts whose speed jumps under what sticks to them: it slips, for friction has no impulse.

use dynamics::prelude::*;

use super::parcel::Parcel;
use super::{FORMULATIONS, NEVER};

impl Parcel {
    /// Place and speed, from what sticks to the first belt at 0: phases of constant acceleration, each to
    /// where its slip is zero or the belt another one.
    fn truth(&self, end: f64) -> (f64, f64) {
        let (mut t, mut x, mut u, mut is_first) = (0.0, 0.0, self.first, true);
        while t < end {
            let belt = if is_first { self.first } else { self.then };
            let a = if u == belt { 0.0 } else { (belt - u).signum() * self.limit / self.mass };
            let caught = if a == 0.0 { f64::INFINITY } else { (belt - u) / a };
            // The seam is left where it was met, so that the other root is meant.
            let away = self.seam - x;
            let root = |sign: f64| {
                if a == 0.0 { away / u } else { (sign * (u * u + 2.0 * a * away).sqrt() - u) / a }
            };
            let met =
                [root(1.0), root(-1.0)].into_iter().filter(|s| *s > 1e-12).fold(f64::INFINITY, f64::min);
            let met = if t < self.at { met } else { f64::INFINITY };
            let jumps = if t < self.at { self.at - t } else { f64::INFINITY };
            let h = caught.min(met).min(jumps).min(end - t);
            (x, u) = (x + u * h + 0.5 * a * h * h, if h == caught { belt } else { u + a * h });
            t = if h == jumps { self.at } else { t + h };
            is_first = if h == met { !is_first } else { is_first && t < self.at };
        }
        (x, u)
    }
}

const BELTS: [(f64, f64, (f64, f64), f64); 9] = [
    (0.4, -1.0, (1.0, NEVER), 5.0),
    (2.0, -1.0, (1.0, NEVER), 5.0),
    (0.4, 0.2, (1.2345, NEVER), 5.0),
    (2.0, 3.0, (0.7, NEVER), 5.0),
    (2.0, 0.9999, (0.7, NEVER), 5.0),
    (0.4, 0.3, (NEVER, 0.6), 3.0),
    (2.0, 3.0, (NEVER, 0.6), 3.0),
    (2.0, 0.3, (NEVER, 0.6), 3.0),
    // Back over the seam, and on the first belt again.
    (2.0, -0.5, (NEVER, 0.6), 2.0),
];

/// Friction has no impulse: what sticks slips where the belt's speed jumps, and is caught where the slip is
/// over.
#[test]
fn what_sticks_to_a_belt_slips_where_its_speed_jumps() {
    for (limit, then, (at, seam), end) in BELTS {
        let parcel = Parcel { mass: 1.0, limit, first: 1.0, then, at, seam };
        let (x, u) = parcel.truth(end);
        let start = parcel.state().x_rate(1.0).build().unwrap();
        for formulation in FORMULATIONS {
            for tolerance in [1e-6, 1e-10] {
                let case = format!("{limit} {then} {at} {seam} {formulation} {tolerance:e}");
                let run = parcel.simulate(start).until(end).tolerance(tolerance).formulation(formulation);
                let motion = run.stick_slip("stick", "grip").run().unwrap_or_else(|e| panic!("{case}: {e}"));
                let errors = [motion.end().x() - x, motion.end().x_rate() - u];
                assert!(errors.iter().all(|e| e.abs() < 30.0 * tolerance), "{case}: {errors:?}");
                let jumps = motion.events().iter().map(|e| (e.after.x_rate() - e.before.x_rate()).abs());
                assert!(jumps.fold(0.0, f64::max) < 1e-6, "{case}: friction has no impulse");
                let passes = motion.events().iter().filter(|event| event.name == "passes").count();
                let crossings = if seam == NEVER {
                    0
                } else if then < 0.0 {
                    2
                } else {
                    1
                };
                assert_eq!(passes, crossings, "{case}");
                let drift = motion.constraint_drift();
                assert!(drift.iter().all(|row| row.velocity_residual < 1e-6), "{case}: {drift:?}");
            }
        }
    }
}

/// Fixed steps end at the corner, too, and go on from there.
#[test]
fn fixed_steps_end_where_the_belt_jumps() {
    for (limit, then, (at, seam), end) in BELTS {
        let parcel = Parcel { mass: 1.0, limit, first: 1.0, then, at, seam };
        let (x, u) = parcel.truth(end);
        let start = parcel.state().x_rate(1.0).build().unwrap();
        for formulation in FORMULATIONS {
            for h in [0.013, 0.1] {
                let case = format!("{limit} {then} {at} {seam} {formulation} {h}");
                let run = parcel
                    .simulate(start)
                    .until(end)
                    .method(methods::Rk4)
                    .fixed_step(h)
                    .formulation(formulation);
                let motion = run.stick_slip("stick", "grip").run().unwrap_or_else(|e| panic!("{case}: {e}"));
                let errors = [motion.end().x() - x, motion.end().x_rate() - u];
                assert!(errors.iter().all(|e| e.abs() < 1e-9), "{case}: {errors:?}");
            }
        }
    }
}

/// What other methods do at corners is the same.
#[test]
fn methods_of_all_kinds_slip() {
    let parcel = Parcel { mass: 1.0, limit: 2.0, first: 1.0, then: 0.3, at: NEVER, seam: 0.6 };
    let (x, _) = parcel.truth(3.0);
    let adaptive: [methods::Any<Parcel>; 6] = [
        methods::DormandPrince5.into(),
        methods::Tsit5.into(),
        methods::Verner9.into(),
        methods::Radau5.into(),
        methods::Esdirk4.into(),
        methods::Taylor::default().into(),
    ];
    let start = parcel.state().x_rate(1.0).build().unwrap();
    for method in &adaptive {
        let run =
            parcel.simulate(start).until(3.0).tolerance(1e-8).method(method).stick_slip("stick", "grip");
        let motion = run.run().unwrap_or_else(|e| panic!("{method}: {e}"));
        assert!((motion.end().x() - x).abs() < 1e-6, "{method}: {}", motion.end().x());
    }
    let fixed: [methods::Any<Parcel>; 2] =
        [methods::Radau5.into(), methods::GeneralizedAlpha { rho: 0.8 }.into()];
    for method in &fixed {
        let run =
            parcel.simulate(start).until(3.0).method(method).fixed_step(0.013).stick_slip("stick", "grip");
        let motion = run.run().unwrap_or_else(|e| panic!("{method}: {e}"));
        assert!((motion.end().x() - x).abs() < 1e-4, "{method}: {}", motion.end().x());
    }
}

/// A belt that stops for less than a step shakes what sticks to it off, where the two ends of that have
/// conditions of their own.
#[test]
fn a_pulse_within_a_fixed_step_is_seen() {
    let parcel = Pulsed { mass: 1.0, speed: 1.0, limit: 2.0, at: 1.03, until: 1.05 };
    let start = parcel.state().x_rate(1.0).build().unwrap();
    // Down for 0.02 s, up again for as long: half of what the belt lost.
    let truth = 2.0 - 2.0 * 0.5 * 2.0 * 0.02 * 0.02;
    for formulation in FORMULATIONS {
        let run =
            parcel.simulate(start).until(2.0).method(methods::Rk4).fixed_step(0.1).formulation(formulation);
        let motion = run.stick_slip("stick", "grip").run().unwrap_or_else(|e| panic!("{formulation}: {e}"));
        assert!((motion.end().x() - truth).abs() < 1e-9, "{formulation}: {}", motion.end().x());
    }
}

/// A parcel on a belt that stands still for a moment.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, speed: m / s, limit: N, at: s, until: s)]
struct Pulsed {
    mass: f64,
    speed: f64,
    limit: f64,
    at: f64,
    until: f64,
}

#[dynamics]
impl Pulsed {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() - if q.t > self.at && q.t < self.until { 0.0 } else { self.speed }
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.limit * q.slip(Self::stick))
    }
    #[event]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.limit - q.reaction(Self::stick).abs()
    }
}

/// A parcel on a conveyor that ends: what bears it and what carries it along go in one instant.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, g: m / s^2, speed: m / s, edge: m, deep: m)]
struct Conveyor {
    mass: f64,
    g: f64,
    mu: f64,
    speed: f64,
    edge: f64,
    deep: f64,
}

#[dynamics]
impl Conveyor {
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
        q.y + if q.x < self.edge { 0.0 } else { self.deep }
    }
    #[nonholonomic(switched, integrable)]
    fn belt(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() - if q.x < self.edge { self.speed } else { 0.0 }
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.mu * q.reaction(Self::ground) * q.slip(Self::belt))
    }
    #[event]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.mu * q.reaction(Self::ground) - q.reaction(Self::belt).abs()
    }
}

/// It flies as fast as it was carried, lands on the ground that stands still, and slides to rest there.
#[test]
fn a_parcel_is_thrown_off_a_conveyor() {
    let conveyor = Conveyor { mass: 2.0, g: 10.0, mu: 0.5, speed: 1.0, edge: 0.6, deep: 0.05 };
    let start = conveyor.state().x_rate(1.0).build().unwrap();
    // Lands after 0.1 s, slides for 0.2 s.
    let (x, lands) = (0.6 + 0.1 + 0.1, 0.7);
    for formulation in FORMULATIONS {
        for tolerance in [1e-6, 1e-10] {
            let case = format!("{formulation} {tolerance:e}");
            let run = conveyor.simulate(start).until(1.5).tolerance(tolerance).formulation(formulation);
            let motion = run.contact("ground", 0.0).stick_slip("belt", "grip").run();
            let motion = motion.unwrap_or_else(|e| panic!("{case}: {e}"));
            let flies = motion.at(0.65);
            let errors =
                [flies.x() - 0.65, flies.y() + 0.0125, motion.end().x() - x, motion.end().y() + 0.05];
            assert!(errors.iter().all(|e| e.abs() < 30.0 * tolerance), "{case}: {errors:?}");
            let hit = motion.events().iter().find(|event| !event.impacts.is_empty()).unwrap();
            assert!((hit.time() - lands).abs() < 30.0 * tolerance, "{case}: {}", hit.time());
            assert!(motion.end().is_engaged("belt").unwrap() && motion.end().x_rate().abs() < 1e-9, "{case}");
        }
    }
}

/// A parcel that is led past a place from which an angle is taken that it is pushed by; beside that place its
/// belt changes, where the angle is cut at a turn.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y: m)]
#[units(mass: kg, limit: N, push: N, first: m / s, then: m / s, aside: m)]
struct Bearing {
    mass: f64,
    limit: f64,
    push: f64,
    first: f64,
    then: f64,
    aside: f64,
}

#[dynamics]
impl Bearing {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.y.dt().powi(2)
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.y.dt() - if q.y < 0.0 { self.first } else { self.then }
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.y, -self.limit * q.slip(Self::stick))
    }
    /// By the sine of the angle, which is not cut.
    #[force]
    fn pushes(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.y, self.push * q.y.atan2(-self.aside).sin())
    }
    #[event]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.limit - q.reaction(Self::stick).abs()
    }
}

/// Where an angle is cut in the instant in which the belt changes, it is the belt that counts.
#[test]
fn a_cut_angle_hides_no_corner() {
    let bearing = Bearing { mass: 1.0, limit: 2.0, push: 0.3, first: 1.0, then: 0.2, aside: 1.0 };
    let start = bearing.state().y(-0.5).y_rate(1.0).build().unwrap();
    // Without the angle: it slips from y = 0 on, braked by the limit less what it is pushed by, y/√(y² + 1)
    // of that.
    let smooth = Smooth { mass: 1.0, limit: 2.0, push: 0.3, aside: 1.0 };
    let slips = smooth.state().y_rate(1.0).build().unwrap();
    let reference = smooth.simulate(slips).until(0.3).tolerance(1e-12).run().unwrap().end();
    for formulation in FORMULATIONS {
        for tolerance in [1e-6, 1e-10] {
            let run = bearing.simulate(start).until(0.8).tolerance(tolerance).formulation(formulation);
            let motion =
                run.stick_slip("stick", "grip").run().unwrap_or_else(|e| panic!("{formulation}: {e}"));
            let errors = [motion.end().y() - reference.y(), motion.end().y_rate() - reference.y_rate()];
            assert!(
                errors.iter().all(|e| e.abs() < 30.0 * tolerance),
                "{formulation} {tolerance:e}: {errors:?}"
            );
        }
    }
}

/// The same while it slips, pushed without an angle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y: m)]
#[units(mass: kg, limit: N, push: N, aside: m)]
struct Smooth {
    mass: f64,
    limit: f64,
    push: f64,
    aside: f64,
}

#[dynamics]
impl Smooth {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.y.dt().powi(2)
    }
    #[force]
    fn slips(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.y, self.push * (q.y / q.y.hypot(self.aside)) - self.limit)
    }
}
