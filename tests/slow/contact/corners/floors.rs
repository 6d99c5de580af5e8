//! Floors that start to move, or stop, under what rests on them: it is struck, or falls.

use dynamics::prelude::*;

use super::{FORMULATIONS, NEVER, in_all_ways};

/// A ball on a floor that moves up or down from an instant on, and stops at another.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y: m)]
#[units(mass: kg, g: m / s^2, speed: m / s, at: s, still: s, drop: m)]
struct Lift {
    mass: f64,
    g: f64,
    speed: f64,
    at: f64,
    still: f64,
    drop: f64,
}

#[dynamics]
impl Lift {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.y.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        let moved = self.speed * ((q.t - self.at).max(0.0) - (q.t - self.still).max(0.0));
        let dropped = if q.t < self.still { Expr::ZERO } else { Expr::from(self.drop) };
        q.y - moved + dropped
    }
}

const LIFT: Lift = Lift { mass: 2.0, g: 10.0, speed: 1.0, at: 1.0, still: NEVER, drop: 0.0 };

fn on_the_lift(lift: &Lift, restitution: f64, check: impl Fn(&str, f64, &Motion<'_, Lift>)) {
    let speed = if lift.at < 0.0 { lift.speed } else { 0.0 };
    let start = lift.state().y(-lift.at.min(0.0) * lift.speed).y_rate(speed).build().unwrap();
    in_all_ways(lift, (start, 2.0), ("floor", restitution), check);
}

/// A floor that starts to rise strikes what rests on it, by the contact's own law: u⁺ = v (1 + e).
#[test]
fn a_floor_that_starts_to_rise_strikes() {
    for e in [0.0, 0.5, 1.0] {
        on_the_lift(&LIFT, e, |case, tolerance, motion| {
            let struck = &motion.events()[0];
            assert!((struck.time() - 1.0).abs() < 1e-12, "{case}: {}", struck.time());
            assert_eq!(struck.impacts.len(), 1, "{case}");
            assert!((struck.impacts[0].impulse[0] - 2.0 * (1.0 + e)).abs() < 1e-9, "{case}: {struck:?}");
            assert!((struck.after.y_rate() - (1.0 + e)).abs() < 1e-9, "{case}: {struck:?}");
            let flying = if e == 0.0 { 0.05 } else { (1.0 + e) * 0.05 - 5.0 * 0.0025 };
            assert!(
                (motion.at(1.05).y() - flying).abs() < 30.0 * tolerance,
                "{case}: {}",
                motion.at(1.05).y()
            );
            if e < 1.0 {
                let permitted = if e > 0.0 { 1e-6 } else { 30.0 * tolerance };
                assert!((motion.end().y() - 1.0).abs() < permitted, "{case}: {}", motion.end().y());
                assert!(motion.end().is_engaged("floor").unwrap(), "{case}");
            }
            let drift = motion.constraint_drift();
            assert!(drift.iter().all(|row| row.velocity_residual < 1e-6), "{case}: {drift:?}");
        });
    }
}

/// What rests on a floor that starts to sink faster than it falls, falls; and so does what rests where the
/// floor is gone.
#[test]
fn a_floor_that_sinks_lets_fall() {
    for e in [0.0, 0.5] {
        on_the_lift(&Lift { speed: -1.0, ..LIFT }, e, |case, tolerance, motion| {
            assert!((motion.at(1.1).y() + 0.05).abs() < 30.0 * tolerance, "{case}: {}", motion.at(1.1).y());
            let hit = &motion.events()[1];
            assert!(
                (hit.time() - 1.2).abs() < 30.0 * tolerance && motion.events()[0].impacts.is_empty(),
                "{case}"
            );
            assert!((hit.after.y_rate() - (e - 1.0)).abs() < 100.0 * tolerance, "{case}: {hit:?}");
        });
        on_the_lift(&Lift { speed: 0.0, still: 1.0, drop: 0.3, ..LIFT }, e, |case, tolerance, motion| {
            assert!((motion.at(1.1).y() + 0.05).abs() < 30.0 * tolerance, "{case}: {}", motion.at(1.1).y());
            let hit = &motion.events()[1];
            assert!((hit.time() - 1.0 - 0.06f64.sqrt()).abs() < 30.0 * tolerance, "{case}: {hit:?}");
            assert!(
                (hit.after.y_rate() - e * 10.0 * 0.06f64.sqrt()).abs() < 100.0 * tolerance,
                "{case}: {hit:?}"
            );
        });
    }
}

/// A floor that stops under what it carries lets it fly on.
#[test]
fn a_floor_that_stops_lets_fly() {
    for e in [0.0, 0.5] {
        on_the_lift(&Lift { at: -1.0, still: 1.0, ..LIFT }, e, |case, tolerance, motion| {
            assert!((motion.at(1.1).y() - 2.05).abs() < 30.0 * tolerance, "{case}: {}", motion.at(1.1).y());
            let hit = &motion.events()[1];
            assert!((hit.time() - 1.2).abs() < 30.0 * tolerance, "{case}: {}", hit.time());
            assert!((hit.after.y_rate() - e).abs() < 100.0 * tolerance, "{case}: {hit:?}");
        });
    }
}

/// What other methods do at corners is the same, estimates of errors included.
#[test]
fn methods_of_all_kinds_strike() {
    let lift = Lift { speed: 0.5, ..LIFT };
    let start = lift.state().build().unwrap();
    let adaptive: [methods::Any<Lift>; 5] = [
        methods::Tsit5.into(),
        methods::Verner9.into(),
        methods::Radau5.into(),
        methods::Esdirk4.into(),
        methods::Taylor::default().into(),
    ];
    for method in &adaptive {
        let run = lift.simulate(start).until(1.05).tolerance(1e-8).method(method).contact("floor", 0.5);
        let motion = run.estimate_error().run().unwrap_or_else(|e| panic!("{method}: {e}"));
        let y = 0.75 * 0.05 - 5.0 * 0.0025;
        assert!((motion.end().y() - y).abs() < 1e-6, "{method}: {}", motion.end().y());
        let error = motion.global_error().unwrap();
        assert!(error.coordinates.error < 1e-6 && error.unmatched.is_none(), "{method}: {error:?}");
    }
}

/// A table with two feet on a floor that starts to rise, and one that slides over an edge with its front
/// foot.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, a: rad)]
#[units(mass: kg, inertia: kg * m^2, half: m, g: m / s^2, speed: m / s, at: s, edge: m, deep: m)]
struct Table {
    mass: f64,
    inertia: f64,
    half: f64,
    g: f64,
    speed: f64,
    at: f64,
    edge: f64,
    deep: f64,
}

#[dynamics]
impl Table {
    fn over(&self, q: &Coordinates<Self>, side: f64) -> Expr {
        let foot = vec2(q.x, q.y) + side * self.half * vec2(q.a.cos(), q.a.sin());
        let low = if foot.x < self.edge { Expr::ZERO } else { Expr::from(self.deep) };
        foot.y + low - self.speed * (q.t - self.at).max(0.0)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.a.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic(switched)]
    fn rear(&self, q: &Coordinates<Self>) -> Expr {
        self.over(q, -1.0)
    }
    #[holonomic(switched)]
    fn front(&self, q: &Coordinates<Self>) -> Expr {
        self.over(q, 1.0)
    }
}

const TABLE: Table =
    Table { mass: 3.0, inertia: 0.2, half: 0.4, g: 10.0, speed: 0.0, at: NEVER, edge: NEVER, deep: 0.5 };

/// Feet that stand on what starts to rise are struck together.
#[test]
fn feet_are_struck_together() {
    for e in [0.0, 0.5] {
        let table = Table { speed: 1.0, at: 0.7, ..TABLE };
        let start = table.state().x_rate(0.3).build().unwrap();
        for formulation in FORMULATIONS {
            for tolerance in [1e-6, 1e-10] {
                let case = format!("{e} {formulation} {tolerance:e}");
                let run = table.simulate(start).until(1.5).tolerance(tolerance).formulation(formulation);
                let run = run.contact("rear", e).contact("front", e);
                let motion = run.run().unwrap_or_else(|error| panic!("{case}: {error}"));
                let struck = &motion.events()[0];
                let impulses: Vec<f64> = struck.impacts.iter().map(|impact| impact.impulse[0]).collect();
                assert!(impulses.len() == 2, "{case}: {struck:?}");
                assert!(impulses.iter().all(|x| (x - 1.5 * (1.0 + e)).abs() < 1e-6), "{case}: {impulses:?}");
                let permitted = if e > 0.0 { 1e-5 } else { 30.0 * tolerance };
                let end = motion.end();
                assert!((end.y() - 0.8).abs() < permitted && end.a().abs() < permitted, "{case}: {end:?}");
            }
        }
    }
}

/// A foot that leaves the ground tips the table about the other one: at first it falls with g m b²/(j + m b²)
/// by the middle.
#[test]
fn a_foot_over_an_edge_tips_the_table() {
    let table = Table { edge: 0.5, ..TABLE };
    let start = table.state().x_rate(1.0).build().unwrap();
    for formulation in FORMULATIONS {
        for tolerance in [1e-6, 1e-10] {
            let case = format!("{formulation} {tolerance:e}");
            let run = table.simulate(start).until(0.2).tolerance(tolerance).formulation(formulation);
            let motion = run
                .contact("rear", 0.0)
                .contact("front", 0.0)
                .run()
                .unwrap_or_else(|e| panic!("{case}: {e}"));
            let [opens] = motion.events() else { panic!("{case}: {:?}", motion.events()) };
            assert!(opens.name == "front contact" && (opens.time() - 0.1).abs() < 30.0 * tolerance, "{case}");
            let left = motion.end().is_engaged("rear").unwrap() && !motion.end().is_engaged("front").unwrap();
            let (m, j, b) = (3.0, 0.2, 0.4);
            let sinks = motion.accelerations_at(0.1 + 1e-6)[1];
            assert!(left && (sinks + 10.0 * m * b * b / (j + m * b * b)).abs() < 1e-3, "{case}: {sinks}");
            let energy = motion.energy_at(0.2) - motion.energy_at(0.0);
            assert!(energy.abs() < 100.0 * tolerance, "{case}: {energy}");
        }
    }
}
