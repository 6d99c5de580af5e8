//! What lands, rebounds and lifts off, stiff or with rods, by methods of every kind beside an explicit one at
//! a tight tolerance.

use dynamics::prelude::*;

const FORMULATIONS: [Formulation; 4] =
    [Formulation::Projected, Formulation::Embedded, Formulation::BaumgarteTied, Formulation::Augmented];

/// Rebounds below a millimetre per second are none.
fn law(restitution: f64) -> Contact {
    Contact { rest_speed: Some(1e-3), ..Contact::from(restitution) }
}

/// Two masses with a damped spring between them fall on the lower one.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y: m, z: m)]
#[units(foot: kg, mass: kg, g: m / s^2, rate: N / m, damping: N * s / m, long: m)]
struct Hopper {
    foot: f64,
    mass: f64,
    g: f64,
    rate: f64,
    damping: f64,
    long: f64,
}

#[dynamics]
impl Hopper {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.foot * q.y.dt().powi(2) + self.mass * q.z.dt().powi(2))
    }
    #[potential]
    fn energy(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.foot * q.y + self.mass * q.z) + 0.5 * self.rate * (q.z - q.y - self.long).powi(2)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * (q.z - q.y).dt().powi(2)
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
}

/// After each impact something dies out within 30 µs or less, in which the foot is back on the floor. Methods
/// that can step over it do not.
#[test]
fn what_is_stiff_rebounds() {
    for (rate, damping, restitution) in [(1e4, 10.0, 0.5), (1e4, 10.0, 0.0), (1e6, 1e4, 0.6), (1e6, 1e4, 0.0)]
    {
        let hopper = Hopper { foot: 0.3, mass: 1.0, g: 9.81, rate, damping, long: 1.0 };
        let start = hopper.state().y(0.5).z(1.5).release("floor").build().unwrap();
        let run = |method: &methods::Any<Hopper>, tolerance: f64| {
            let run = hopper.simulate(start).until(0.5).method(method).tolerance(tolerance);
            let motion = run.contact("floor", law(restitution)).run();
            motion.unwrap_or_else(|e| panic!("{rate:e} {restitution} {method} {tolerance:e}: {e}"))
        };
        let reference = run(&methods::Dop853.into(), 1e-12);
        for method in [methods::Any::from(methods::Radau5), methods::Esdirk4.into()] {
            for tolerance in [1e-5, 1e-7, 1e-9] {
                let motion = run(&method, tolerance);
                let (end, wanted) = (motion.end(), reference.end());
                let errors =
                    [end.y() - wanted.y(), end.z() - wanted.z(), 1e-2 * (end.z_rate() - wanted.z_rate())];
                let case = format!("{rate:e} {restitution} {method} {tolerance:e}");
                assert!(errors.iter().all(|e| e.abs() < 30.0 * tolerance), "{case}: {errors:?}");
                assert_eq!(motion.events().len(), reference.events().len(), "{case}");
            }
        }
    }
}

/// Corrections that are nothing but the rounding of stiff forces are no failure of Newton's method: nothing
/// moves here but what falls.
#[test]
fn what_is_stiff_falls_with_fixed_steps() {
    for rate in [1e6, 1e8, 1e10] {
        let hopper = Hopper { foot: 0.3, mass: 1.0, g: 9.81, rate, damping: 1e-2 * rate, long: 1.0 };
        let start = hopper.state().y(0.5).z(1.5).release("floor").build().unwrap();
        for h in [1e-3, 1e-2] {
            let run = hopper.simulate(start).until(0.3).method(methods::Radau5).fixed_step(h);
            let end = run.contact("floor", 0.0).run().unwrap_or_else(|e| panic!("{rate:e} {h}: {e}")).end();
            assert!((end.y() - (0.5 - 4.905 * 0.09)).abs() < 1e-8, "{rate:e} {h}: {}", end.y());
        }
    }
}

/// Two masses at the ends of a rod, which land on one end, fall over and lie flat; there may be a wall.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, v: m, w: m)]
#[units(mass: kg, g: m / s^2, long: m, wall: m)]
#[nominal(long = 1.0)]
struct Dumbbell {
    mass: f64,
    g: f64,
    long: f64,
    wall: f64,
}

#[dynamics]
impl Dumbbell {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (vec2(q.x, q.y).dt().norm_squared() + vec2(q.v, q.w).dt().norm_squared())
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (q.y + q.w)
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x - q.v, q.y - q.w).norm() - self.long
    }
    #[holonomic(switched)]
    fn first(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[holonomic(switched)]
    fn second(&self, q: &Coordinates<Self>) -> Expr {
        q.w
    }
    #[holonomic(switched)]
    fn side(&self, q: &Coordinates<Self>) -> Expr {
        self.wall - q.v
    }
}

/// A rod that turns about its end on the floor, as it comes down: by hand, to all digits, however flat it
/// lies.
#[test]
fn accelerations_beside_a_level_rod_have_their_digits() {
    let (dumbbell, g, turns) = (Dumbbell { mass: 1.0, g: 9.81, long: 1.0, wall: 10.0 }, 9.81, -3.6f64);
    for exponent in 0..40 {
        let sine = 0.8 * 0.5f64.powi(exponent);
        let cosine = (1.0 - sine * sine).sqrt();
        // The middle of the rod stays on its vertical: ½ (1 + cos²) φ̈ = ½ sin cos φ̇² − g cos.
        let start = dumbbell.state().v(cosine).w(sine).release("second").release("side");
        let start = start
            .x_rate(0.5 * sine * turns)
            .v_rate(-0.5 * sine * turns)
            .w_rate(cosine * turns)
            .build()
            .unwrap();
        let faster = (0.5 * sine * cosine * turns * turns - g * cosine) / (0.5 * (1.0 + cosine * cosine));
        let wanted = cosine * faster - sine * turns * turns;
        let found = dumbbell.accelerations(&start).unwrap()[3];
        assert!((found - wanted).abs() < 1e-11 * wanted.abs(), "{sine:e}: {found} {wanted}");
    }
}

#[test]
fn what_falls_over_lies_flat() {
    // Starts, restitution, wall, end.
    for (angle, restitution, wall, end) in
        [(0.3f64, 0.0, 10.0, 0.5), (0.3, 0.5, 10.0, 1.2), (1.2, 0.0, 0.9, 0.9), (1.5, 0.3, 0.7, 0.9)]
    {
        let dumbbell = Dumbbell { mass: 1.0, g: 9.81, long: 1.0, wall };
        let (sine, cosine) = angle.sin_cos();
        let start = dumbbell.state().y(0.4).v(cosine).w(0.4 + sine);
        let start = start.release("first").release("second").release("side").build().unwrap();
        let run = |method: &methods::Any<Dumbbell>, formulation: Formulation, tolerance: f64| {
            let run = dumbbell
                .simulate(start)
                .until(end)
                .method(method)
                .formulation(formulation)
                .tolerance(tolerance);
            let run = run.contact("first", law(restitution)).contact("second", law(restitution));
            let motion = run.contact("side", restitution).run();
            motion
                .unwrap_or_else(|e| panic!("{angle} {restitution} {method} {formulation} {tolerance:e}: {e}"))
                .end()
        };
        let reference = run(&methods::Dop853.into(), Formulation::Projected, 1e-12);
        let methods: [methods::Any<Dumbbell>; 5] = [
            methods::Dop853.into(),
            methods::Tsit5.into(),
            methods::Radau5.into(),
            methods::Esdirk4.into(),
            methods::Taylor::default().into(),
        ];
        for (k, method) in methods.iter().enumerate() {
            // Series satisfy the constraints by themselves.
            let formulations = if k == 4 { &FORMULATIONS[..1] } else { &FORMULATIONS[..] };
            for formulation in formulations {
                for tolerance in [1e-5, 1e-7, 1e-9] {
                    let end = run(method, *formulation, tolerance);
                    let errors = [end.x() - reference.x(), end.y() - reference.y(), end.v() - reference.v()];
                    let case = format!("{angle} {restitution} {method} {formulation} {tolerance:e}");
                    assert!(errors.iter().all(|e| e.abs() < 300.0 * tolerance), "{case}: {errors:?}");
                }
            }
        }
    }
}

/// A body on a floor whose acceleration changes, with another one on a stiff and strongly damped spring above
/// it.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y: m, z: m)]
#[units(mass: kg, g: m / s^2, rises: m / s^2, turns: m / s^2, at: s, rate: N / m, damping: N * s / m)]
struct Carried {
    mass: f64,
    g: f64,
    rises: f64,
    turns: f64,
    at: f64,
    rate: f64,
    damping: f64,
}

#[dynamics]
impl Carried {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.y, q.z).dt().norm_squared()
    }
    #[potential]
    fn energy(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (q.y + q.z) + 0.5 * self.rate * (q.z - q.y).powi(2)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * (q.z - q.y).dt().powi(2)
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y - 0.5 * (self.rises * q.t.powi(2) + self.turns * (q.t - self.at).max(0.0).powi(2))
    }
}

/// A contact that opens by a stiff reaction opens a little early or late, and may close at once: implicit
/// methods have no step of length zero for that. Matrices of the contact that was closed do not count when it
/// is open, though the state is the same.
#[test]
fn contacts_of_what_is_stiff_open_and_close() {
    for (turns, opens) in [(-12.0, true), (-10.8, true), (-4.0, false)] {
        let carried = Carried { mass: 1.0, g: 9.81, rises: 1.0, turns, at: 0.5, rate: 1e6, damping: 1e4 };
        let start = carried.state().z(-9.81e-6).build().unwrap();
        let run = |method: &methods::Any<Carried>, tolerance: f64| {
            let run = carried.simulate(start).until(1.0).method(method).tolerance(tolerance);
            run.contact("floor", 0.0).run().unwrap_or_else(|e| panic!("{turns} {method} {tolerance:e}: {e}"))
        };
        let reference = run(&methods::Dop853.into(), 1e-11);
        assert_eq!(reference.events().is_empty(), !opens, "{turns}");
        for (method, tolerances) in [
            (methods::Any::from(methods::Radau5), [1e-4, 1e-6, 1e-8]),
            (methods::Esdirk4.into(), [1e-6, 1e-7, 1e-8]),
        ] {
            for tolerance in tolerances {
                let end = run(&method, tolerance).end();
                let errors = [end.y() - reference.end().y(), end.z() - reference.end().z()];
                assert!(
                    errors.iter().all(|e| e.abs() < 30.0 * tolerance),
                    "{turns} {method} {tolerance:e}: {errors:?}"
                );
            }
        }
    }
}
