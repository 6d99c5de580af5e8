//! Stiff derived models with implicit methods: few steps, right answers, exact Jacobians where there are inputs, and drift at rounding level.

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
const SPRING_END: [f64; 4] = [0.2750944764827108, -0.9614174924338752, -4.175584765727972, -1.1947781965930147];

#[test]
fn a_stiff_spring_swings_like_a_rod() {
    let start = SPRING.state().x(1.0).build().unwrap();
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        let motion = SPRING.simulate(start).until(10.0).tolerance(tolerance).method(methods::Radau5).run().unwrap();
        let (end, summary) = (motion.end(), motion.summary());
        let found = [end.q[0], end.q[1], end.u[0], end.u[1]];
        let error = found.iter().zip(SPRING_END).fold(0.0f64, |most, (x, exact)| most.max((x - exact).abs()));
        println!("{tolerance:e}: {} steps, {} evaluations, error {error:.1e}", summary.steps, summary.evaluations);
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
    assert!(motion.counts().steps < 500, "{}", motion.summary());
}

/// Without a method asked for, the explicit one that begins says that the motion is stiff and the implicit one goes on: records of both parts are
/// interpolated by their own method, events go on, and the summary names both.
#[test]
fn a_run_goes_over_to_an_implicit_method_where_it_is_stiff() {
    let start = SPRING.state().x(1.0).build().unwrap();
    let run = || SPRING.simulate(start).until(10.0).tolerance(1e-5).event("lowest", |s: &State<Spring>| s.x());
    let motion = run().run().unwrap();
    let (end, summary) = (motion.end(), motion.summary());
    println!("{summary}");
    let found = [end.q[0], end.q[1], end.u[0], end.u[1]];
    let error = found.iter().zip(SPRING_END).fold(0.0f64, |most, (x, exact)| most.max((x - exact).abs()));
    assert!(error < 3e-4, "{error:e}\n{summary}");
    let (from, method) = summary.switched.expect("it is stiff");
    assert!(from > 0.0 && from < 0.5 && method == Method::Radau5 && summary.method == Method::Dop853);
    assert_eq!(motion.switched(), summary.switched);
    let text = summary.to_string();
    assert!(text.contains("Radau") && text.contains("DOP853") && !text.contains("warning"), "{text}");
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
    let explicit = SPRING.simulate(start).until(0.2).tolerance(1e-5).method(methods::Dop853).run().unwrap().summary();
    assert!(explicit.switched.is_none() && explicit.to_string().contains("use methods::Radau5"), "{explicit}");
    // Limits count the steps of both.
    let error = run().max_steps(600).run().unwrap_err();
    let partial = error.motion(&SPRING).unwrap();
    assert!(partial.counts().steps + partial.counts().rejected <= 600 && partial.switched().is_some(), "{error}");
}
