//! Corners of what holds by a rule: belts and floors whose speed or place jumps. What sticks slips, what rests is hit or falls, and nothing else is refused.

use dynamics::prelude::*;

const FORMULATIONS: [Formulation; 5] = [
    Formulation::Projected,
    Formulation::Embedded,
    Formulation::Augmented,
    Formulation::BaumgarteTied,
    Formulation::Baumgarte { alpha: 5.0, beta: 5.0 },
];

/// A parcel on belts: their speed changes in an instant, or from belt to belt.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, limit: N, first: m / s, then: m / s, at: s, seam: m)]
struct Parcel {
    mass: f64,
    limit: f64,
    first: f64,
    then: f64,
    at: f64,
    seam: f64,
}

#[dynamics]
impl Parcel {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        let belt = if q.t < self.at && q.x < self.seam { self.first } else { self.then };
        q.x.dt() - belt
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.limit * q.slip(Self::stick))
    }
    #[event]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.limit - q.reaction(Self::stick).abs()
    }
    #[event]
    fn passes(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.seam
    }
}

impl Parcel {
    /// Place and speed, from what sticks to the first belt at 0: phases of constant acceleration, each to where its slip is zero or the belt another one.
    fn truth(&self, end: f64) -> (f64, f64) {
        let (mut t, mut x, mut u, mut is_first) = (0.0, 0.0, self.first, true);
        while t < end {
            let belt = if is_first { self.first } else { self.then };
            let a = if u == belt { 0.0 } else { (belt - u).signum() * self.limit / self.mass };
            let caught = if a == 0.0 { f64::INFINITY } else { (belt - u) / a };
            // The seam is left where it was met, so that the other root is meant.
            let away = self.seam - x;
            let root = |sign: f64| if a == 0.0 { away / u } else { (sign * (u * u + 2.0 * a * away).sqrt() - u) / a };
            let met = [root(1.0), root(-1.0)].into_iter().filter(|s| *s > 1e-12).fold(f64::INFINITY, f64::min);
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

const NEVER: f64 = 1e300;

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

/// Friction has no impulse: what sticks slips where the belt's speed jumps, and is caught where the slip is over.
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
                let run = parcel.simulate(start).until(end).method(methods::Rk4).fixed_step(h).formulation(formulation);
                let motion = run.stick_slip("stick", "grip").run().unwrap_or_else(|e| panic!("{case}: {e}"));
                let errors = [motion.end().x() - x, motion.end().x_rate() - u];
                assert!(errors.iter().all(|e| e.abs() < 1e-9), "{case}: {errors:?}");
            }
        }
    }
}

/// What other methods do at corners is the same.
#[test]
fn methods_of_all_kinds_pass_corners() {
    let parcel = Parcel { mass: 1.0, limit: 2.0, first: 1.0, then: 0.3, at: NEVER, seam: 0.6 };
    let lift = Lift { speed: 0.5, ..LIFT };
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
        let run = parcel.simulate(start).until(3.0).tolerance(1e-8).method(method).stick_slip("stick", "grip");
        let motion = run.run().unwrap_or_else(|e| panic!("{method}: {e}"));
        assert!((motion.end().x() - x).abs() < 1e-6, "{method}: {}", motion.end().x());
    }
    let fixed: [methods::Any<Parcel>; 2] = [methods::Radau5.into(), methods::GeneralizedAlpha { rho: 0.8 }.into()];
    for method in &fixed {
        let run = parcel.simulate(start).until(3.0).method(method).fixed_step(0.013).stick_slip("stick", "grip");
        let motion = run.run().unwrap_or_else(|e| panic!("{method}: {e}"));
        assert!((motion.end().x() - x).abs() < 1e-4, "{method}: {}", motion.end().x());
    }
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

/// A belt that stops for less than a step shakes what sticks to it off, where the two ends of that have conditions of their own.
#[test]
fn a_pulse_within_a_fixed_step_is_seen() {
    let parcel = Pulsed { mass: 1.0, speed: 1.0, limit: 2.0, at: 1.03, until: 1.05 };
    let start = parcel.state().x_rate(1.0).build().unwrap();
    // Down for 0.02 s, up again for as long: half of what the belt lost.
    let truth = 2.0 - 2.0 * 0.5 * 2.0 * 0.02 * 0.02;
    for formulation in FORMULATIONS {
        let run = parcel.simulate(start).until(2.0).method(methods::Rk4).fixed_step(0.1).formulation(formulation);
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
    for formulation in FORMULATIONS {
        for tolerance in [1e-6, 1e-10] {
            let case = format!("{lift:?} {restitution} {formulation} {tolerance:e}");
            let run = lift.simulate(start).until(2.0).tolerance(tolerance).formulation(formulation);
            let motion = run.contact("floor", restitution).run().unwrap_or_else(|e| panic!("{case}: {e}"));
            check(&case, tolerance, &motion);
        }
        for h in [0.007, 0.04] {
            let case = format!("{lift:?} {restitution} {formulation} {h}");
            let run = lift.simulate(start).until(2.0).method(methods::Rk4).fixed_step(h).formulation(formulation);
            let motion = run.contact("floor", restitution).run().unwrap_or_else(|e| panic!("{case}: {e}"));
            check(&case, 1e-9, &motion);
        }
    }
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
            assert!((motion.at(1.05).y() - flying).abs() < 30.0 * tolerance, "{case}: {}", motion.at(1.05).y());
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

/// What rests on a floor that starts to sink faster than it falls, falls; and so does what rests where the floor is gone.
#[test]
fn a_floor_that_sinks_lets_fall() {
    for e in [0.0, 0.5] {
        on_the_lift(&Lift { speed: -1.0, ..LIFT }, e, |case, tolerance, motion| {
            assert!((motion.at(1.1).y() + 0.05).abs() < 30.0 * tolerance, "{case}: {}", motion.at(1.1).y());
            let hit = &motion.events()[1];
            assert!((hit.time() - 1.2).abs() < 30.0 * tolerance && motion.events()[0].impacts.is_empty(), "{case}");
            assert!((hit.after.y_rate() - (e - 1.0)).abs() < 100.0 * tolerance, "{case}: {hit:?}");
        });
        on_the_lift(&Lift { speed: 0.0, still: 1.0, drop: 0.3, ..LIFT }, e, |case, tolerance, motion| {
            assert!((motion.at(1.1).y() + 0.05).abs() < 30.0 * tolerance, "{case}: {}", motion.at(1.1).y());
            let hit = &motion.events()[1];
            assert!((hit.time() - 1.0 - 0.06f64.sqrt()).abs() < 30.0 * tolerance, "{case}: {hit:?}");
            assert!((hit.after.y_rate() - e * 10.0 * 0.06f64.sqrt()).abs() < 100.0 * tolerance, "{case}: {hit:?}");
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
    for formulation in FORMULATIONS {
        for tolerance in [1e-6, 1e-10] {
            let case = format!("{ground:?} {restitution} {formulation} {tolerance:e}");
            let run = ground.simulate(start).until(1.5).tolerance(tolerance).formulation(formulation);
            let motion = run.contact("floor", restitution).run().unwrap_or_else(|e| panic!("{case}: {e}"));
            check(&case, tolerance, &motion);
        }
        for h in [0.007, 0.04] {
            let case = format!("{ground:?} {restitution} {formulation} {h}");
            let run = ground.simulate(start).until(1.5).method(methods::Rk4).fixed_step(h).formulation(formulation);
            let motion = run.contact("floor", restitution).run().unwrap_or_else(|e| panic!("{case}: {e}"));
            check(&case, 1e-9, &motion);
        }
    }
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
            assert!(times.iter().all(|e| e.abs() < 30.0 * tolerance) && opens.impacts.is_empty(), "{case}: {times:?}");
            assert!((hit.after.y_rate() - e * 10.0 * 0.1f64.sqrt()).abs() < 100.0 * tolerance, "{case}: {hit:?}");
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
            for run in [run().tolerance(1e-6), run().tolerance(1e-10), run().method(methods::Rk4).fixed_step(0.013)] {
                let error = run.run().unwrap_err();
                let message = error.to_string();
                assert!(message.contains("meets a step from the side") && message.contains("of its own"), "{message}");
                assert!((error.time - time).abs() < 1e-5, "{formulation}: {message}");
                assert!(error.state.y() > -1e-6, "{formulation}: {message}");
            }
        }
    }
}

/// A table with two feet on a floor that starts to rise, and one that slides over an edge with its front foot.
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

/// A foot that leaves the ground tips the table about the other one: at first it falls with g m b²/(j + m b²) by the middle.
#[test]
fn a_foot_over_an_edge_tips_the_table() {
    let table = Table { edge: 0.5, ..TABLE };
    let start = table.state().x_rate(1.0).build().unwrap();
    for formulation in FORMULATIONS {
        for tolerance in [1e-6, 1e-10] {
            let case = format!("{formulation} {tolerance:e}");
            let run = table.simulate(start).until(0.2).tolerance(tolerance).formulation(formulation);
            let motion = run.contact("rear", 0.0).contact("front", 0.0).run().unwrap_or_else(|e| panic!("{case}: {e}"));
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

/// Into the corner itself, or along a side of it: two faces are hit, and one function does not say what each gives.
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
                message.contains("`ground` has a corner here") && message.contains("`.contact(..)` of its own"),
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
            let errors = [flies.x() - 0.65, flies.y() + 0.0125, motion.end().x() - x, motion.end().y() + 0.05];
            assert!(errors.iter().all(|e| e.abs() < 30.0 * tolerance), "{case}: {errors:?}");
            let hit = motion.events().iter().find(|event| !event.impacts.is_empty()).unwrap();
            assert!((hit.time() - lands).abs() < 30.0 * tolerance, "{case}: {}", hit.time());
            assert!(motion.end().is_engaged("belt").unwrap() && motion.end().x_rate().abs() < 1e-9, "{case}");
        }
    }
}
