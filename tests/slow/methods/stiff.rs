//! Stiff derived models with implicit methods: few steps, right answers, exact Jacobians where there are
//! inputs, and drift at rounding level.

use dynamics::integrate::Method;
use dynamics::prelude::*;

/// A bob on a stiff, strongly damped spring.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, k: N / m, c: N * s / m, l: m, g: m / s^2)]
struct Spring {
    m: f64,
    k: f64,
    c: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Spring {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn stretch(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (self.bob(q).norm() - self.l).powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.c * self.bob(q).norm().dt().powi(2)
    }
}

const SPRING: Spring = Spring { m: 1.0, k: 1e8, c: 2e4, l: 1.0, g: 9.81 };

/// By a Taylor method of order 20 at tolerance 1e-15.
const SPRING_END: [f64; 4] =
    [0.2750944764827108, -0.9614174924338752, -4.175584765727972, -1.1947781965930147];

#[test]
fn a_stiff_spring_swings_like_a_rod() {
    let start = SPRING.state().x(1.0).build().unwrap();
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        let motion =
            SPRING.simulate(start).until(10.0).tolerance(tolerance).method(methods::Radau5).run().unwrap();
        let (end, summary) = (motion.end(), motion.verify());
        let found = [end.q[0], end.q[1], end.u[0], end.u[1]];
        let error = found.iter().zip(SPRING_END).fold(0.0f64, |most, (x, exact)| most.max((x - exact).abs()));
        println!(
            "{tolerance:e}: {} steps, {} evaluations, error {error:.1e}",
            summary.steps, summary.evaluations
        );
        assert!(error < 30.0 * tolerance + 2e-8, "{error:e} at {tolerance:e}");
        assert_eq!(summary.method, Method::Radau5);
        assert!(summary.steps < 5000 && summary.stiff_at.is_none(), "{summary}");
        // States between the steps, from steps that are made again.
        let inside = motion.at(9.99);
        assert!((inside.q().norm() - 1.0).abs() < 1e-6 + 10.0 * tolerance, "{inside:?}");
    }
}

/// A mass that a stiff controller holds to a path: the force is an input that depends on the state.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[inputs(push: N)]
#[units(m: kg)]
struct Cart {
    m: f64,
}

#[dynamics]
impl Cart {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.push)
    }
}

#[test]
fn a_stiff_controller_is_part_of_the_jacobian() {
    let model = Cart { m: 2.0 };
    let start = model.state().x(1.0).build().unwrap();
    let law = |t: f64, s: &State<Cart>| [1e8 * (t.cos() - s.x()) + 2e5 * (-t.sin() - s.x_rate())];
    let run = model.simulate(start).inputs(law).until(10.0).tolerance(1e-6).method(methods::Radau5).run();
    let motion = run.unwrap();
    // The path is left by m ẍ/k.
    assert!((motion.end().x() - 10f64.cos() * (1.0 + 2e-8)).abs() < 1e-6);
    // Without what the law adds, Newton's iterations would diverge for every step above 1e-5.
    assert!(motion.counts().steps < 500, "{}", motion.verify());
}

/// Without a method asked for, the explicit one that begins says that the motion is stiff and the implicit
/// one goes on: records of both parts are interpolated by their own method, events go on, and the summary
/// names both.
#[test]
fn a_run_goes_over_to_an_implicit_method_where_it_is_stiff() {
    let start = SPRING.state().x(1.0).build().unwrap();
    let run =
        || SPRING.simulate(start).until(10.0).tolerance(1e-5).event("lowest", |s: &State<Spring>| s.x());
    let motion = run().run().unwrap();
    let (end, summary) = (motion.end(), motion.verify());
    println!("{summary}");
    let found = [end.q[0], end.q[1], end.u[0], end.u[1]];
    let error = found.iter().zip(SPRING_END).fold(0.0f64, |most, (x, exact)| most.max((x - exact).abs()));
    assert!(error < 3e-4, "{error:e}\n{summary}");
    let (from, method) = summary.switched.expect("it is stiff");
    assert!(
        from > 0.0 && from < 0.5 && method == Method::Radau5 && summary.method == Method::GraggBulirschStoer
    );
    assert_eq!(motion.switched(), summary.switched);
    let text = summary.to_string();
    assert!(
        text.contains("Radau") && text.contains("Gragg–Bulirsch–Stoer") && !text.contains("warning"),
        "{text}"
    );
    // DOP853 alone takes twenty-five thousand steps.
    assert!(summary.steps < 3000, "{summary}");

    // No step is lost or told twice where the methods meet.
    let times: Vec<f64> = motion.steps().map(|s| s.t()).collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    assert_eq!(times.len() as u64, summary.steps + 1);
    let alone = SPRING.simulate(start).until(10.0).tolerance(1e-10).method(methods::Radau5).run().unwrap();
    for t in [0.5 * from, 0.999 * from, from, from + 1e-4, 1.0, 3.3, 9.9] {
        let (a, b) = (motion.at(t), alone.at(t));
        assert!((a.q() - b.q()).norm() < 3e-4 && (a.u() - b.u()).norm() < 1e-3, "t = {t}: {a:?} {b:?}");
    }
    // Each of the swings of 10 s passes the lowest point once.
    let passes = motion.events().len();
    let crossings = (0..100_000).map(|k| alone.at(f64::from(k) * 1e-4).x()).collect::<Vec<_>>();
    assert_eq!(passes, crossings.windows(2).filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0)).count());

    // The same without a record; and none where a method was asked for.
    let last = run().run_with(|_| ()).unwrap();
    assert_eq!((last.q, last.u), (end.q, end.u));
    let explicit =
        SPRING.simulate(start).until(0.2).tolerance(1e-5).method(methods::Dop853).run().unwrap().verify();
    assert!(
        explicit.switched.is_none() && explicit.to_string().contains("use methods::Radau5"),
        "{explicit}"
    );
    // Limits count the steps of both.
    let error = run().max_steps(1200).run().unwrap_err();
    let partial = error.motion(&SPRING).unwrap();
    assert!(
        partial.counts().steps + partial.counts().rejected <= 1200 && partial.switched().is_some(),
        "{error}"
    );
}

/// A block on a belt that pulls a wagon behind it by a stiff damper and spring; a soft spring holds the wagon
/// back.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, z: m)]
#[units(mass: kg, k: N / m, c: N * s / m, soft: N / m, limit: N, slips: N, speed: m / s)]
struct Tow {
    mass: f64,
    k: f64,
    c: f64,
    soft: f64,
    limit: f64,
    slips: f64,
    speed: f64,
}

#[dynamics]
impl Tow {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (q.x.dt().powi(2) + q.z.dt().powi(2))
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.x - q.z).powi(2) + 0.5 * self.soft * q.z.powi(2)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.c * (q.x - q.z).dt().powi(2)
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() - self.speed
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.slips * q.slip(Self::stick))
    }
    #[event]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.limit - q.reaction(Self::stick).abs()
    }
}

impl Tow {
    /// When the block breaks away, which starts with the wagon at the speed of the belt: the stretch w = x −
    /// z is p + r t + Σ Cᵢ exp(λᵢ t).
    fn breaks_away(&self) -> f64 {
        let Self { mass, k, c, soft, limit, speed, .. } = *self;
        let rest = soft * speed / (k + soft);
        let from = -c * rest / (k + soft);
        let root = (c * c - 4.0 * mass * (k + soft)).sqrt();
        // The slow root without cancellation.
        let fast = -(c + root) / (2.0 * mass);
        let slow = (k + soft) / (mass * fast);
        let of_slow = (-rest + fast * from) / (slow - fast);
        let of_fast = -from - of_slow;
        let force = |t: f64| {
            let (a, b) = (of_slow * (slow * t).exp(), of_fast * (fast * t).exp());
            (
                k * (from + rest * t + a + b) + c * (rest + slow * a + fast * b),
                k * rest + (k * slow + c * slow * slow) * a,
            )
        };
        (0..60).fold(limit / (soft * speed), |t, _| t - (force(t).0 - limit) / force(t).1)
    }
}

/// A millionth of a metre is a newton here, and 25 ms of the growing pull: the instant is as accurate as the
/// motion all the same, in the event that acts and in the one that tells of it.
#[test]
fn stiff_reactions_are_met_where_the_motion_has_them() {
    for (k, c) in [(1e4, 400.0), (1e4, 2000.0), (1e6, 2e4)] {
        let tow = Tow { mass: 1.0, k, c, soft: 40.0, limit: 10.0, slips: 6.0, speed: 1.0 };
        let start = tow.state().x_rate(1.0).z_rate(1.0).build().unwrap();
        let run = |method: &methods::Any<Tow>, tolerance: f64, until: f64| {
            let run = tow.simulate(start).until(until).method(method).tolerance(tolerance);
            run.stick_slip("stick", "grip")
                .run()
                .unwrap_or_else(|e| panic!("{k:e} {c} {method} {tolerance:e}: {e}"))
        };
        let breaks = tow.breaks_away();
        let reference = run(&methods::Radau5.into(), 1e-11, 3.0);
        let times = |motion: &dynamics::simulate::Motion<'_, Tow>| {
            let slips = motion.events().iter().filter(|event| event.name == "stick slip");
            slips.map(|event| event.time()).collect::<Vec<f64>>()
        };
        let wanted = times(&reference);
        assert!(wanted.len() == 4 && (wanted[0] - breaks).abs() < 1e-9, "{k:e} {c}: {wanted:?} {breaks}");
        for method in [methods::Any::from(methods::Radau5), methods::Esdirk4.into()] {
            for tolerance in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
                let case = format!("{k:e} {c} {method} {tolerance:e}");
                let motion = run(&method, tolerance, 3.0);
                let found = times(&motion);
                assert_eq!(found.len(), wanted.len(), "{case}");
                let late = found.iter().zip(&wanted).map(|(found, wanted)| (found - wanted) / tolerance);
                let late: Vec<f64> = late.collect();
                assert!(late.iter().all(|late| late.abs() < 10.0), "{case}: {late:?} tolerances");
                let told = motion.events().iter().find(|event| event.name == "grip").unwrap();
                assert_eq!(told.time(), found[0], "{case}");
            }
        }
        // Constant-step methods and explicit ones find it likewise, where they are accurate at all.
        let alpha = run(&methods::GeneralizedAlpha { rho: 0.8 }.into(), 1e-5, 0.3);
        assert!((times(&alpha)[0] - breaks).abs() < 1e-4, "{k:e} {c}: {:?} {breaks}", times(&alpha));
    }
}

/// The same where nothing acts: the time that is reported is the method's, not its interpolant's, and the
/// motion is what it is without the event.
#[test]
fn stiff_reactions_that_are_only_watched_are_met_likewise() {
    let mut worst = 0.0_f64;
    for (k, c) in [(1e4, 400.0), (1e4, 2000.0), (1e6, 2e4)] {
        let tow = Tow { mass: 1.0, k, c, soft: 40.0, limit: 10.0, slips: 6.0, speed: 1.0 };
        let start = tow.state().x_rate(1.0).z_rate(1.0).build().unwrap();
        let breaks = tow.breaks_away();
        for method in [methods::Any::from(methods::Radau5), methods::Esdirk4.into()] {
            for tolerance in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
                let run = tow.simulate(start).until(1.5 * breaks).method(&method).tolerance(tolerance);
                let motion = run.run().unwrap_or_else(|e| panic!("{k:e} {c} {method} {tolerance:e}: {e}"));
                let [told] = motion.events() else { panic!("{k:e} {c} {method} {tolerance:e}") };
                let late = (told.time() - breaks) / tolerance;
                worst = worst.max(late.abs());
                println!("{k:e} {c} {method} {tolerance:e}: {late:.2} tolerances, {:?}", motion.counts());
                // The state is that of the instant, and none of a step that was made to find it is left.
                let state = &told.before;
                assert!(
                    (state.t() - told.time()).abs() == 0.0
                        && (motion.end_time() - 1.5 * breaks).abs() < 1e-12
                );
                let times: Vec<f64> = motion.steps().map(|state| state.t()).collect();
                assert!(
                    times.is_sorted() && !times.contains(&told.time()),
                    "{k:e} {c} {method} {tolerance:e}"
                );
            }
        }
    }
    println!("{worst} tolerances at most");
    assert!(worst < 2.0, "{worst}");
}
