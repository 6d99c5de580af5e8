//! Friction that has no solution.

use super::*;

/// A rod that is pushed over a rough floor by its own motion, as chalk over a board: Painlevé 1895.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, theta: rad)]
#[units(mass: kg, half: m, g: m / s^2)]
struct Chalk {
    mass: f64,
    half: f64,
    g: f64,
    mu: f64,
}

#[dynamics]
impl Chalk {
    fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y) - self.half * vec2(q.theta.cos(), q.theta.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
            + 0.5 * self.mass * self.half.powi(2) / 3.0 * q.theta.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        self.tip(q).y
    }
    #[force]
    fn friction(&self, q: &Coordinates<Self>) -> Force {
        let tip = self.tip(q);
        Force::at(tip, vec2(-self.mu * q.reaction(Self::floor) * tip.dt().x.signum(), 0.0))
    }
}

fn sliding(model: &Chalk, theta: f64, rate: f64, slide: f64) -> State<Chalk> {
    let (s, c) = theta.sin_cos();
    let (u, v) = (slide - model.half * s * rate, model.half * c * rate);
    let builder = model.state().x(model.half * c).y(model.half * s).theta(theta);
    builder.x_rate(u).y_rate(v).theta_rate(rate).build().unwrap()
}

/// m times the vertical acceleration of the tip per newton of the floor: 1 + 3 cos θ (cos θ ∓ μ sin θ),
/// positive without friction.
fn answer(model: &Chalk, theta: f64, slide: f64) -> f64 {
    1.0 + 3.0 * theta.cos() * (theta.cos() + model.mu * theta.sin() * slide.signum())
}

/// The normal force by hand: the tip's free acceleration, cancelled by what answers it.
fn normal(model: &Chalk, theta: f64, rate: f64, slide: f64) -> f64 {
    model.mass * (model.g - model.half * theta.sin() * rate * rate) / answer(model, theta, slide)
}

#[test]
fn outside_of_the_paradox_the_normal_force_is_the_one_by_hand() {
    let model = Chalk { mass: 2.0, half: 0.7, g: 9.81, mu: 1.7 };
    for (theta, rate, slide) in [(0.2, 0.3, -1.0), (1.4, -0.5, -2.0), (FRAC_PI_4, 1.0, 1.0), (0.7, 0.2, 0.4)]
    {
        assert!(answer(&model, theta, slide) > 0.0);
        let state = sliding(&model, theta, rate, slide);
        let solved = solve_once(&model, &model.constants().unwrap(), &state).unwrap();
        let expected = normal(&model, theta, rate, slide);
        assert!((solved.multipliers[0] / expected - 1.0).abs() < 1e-12, "{solved:?} instead of {expected}");
    }
}

/// Above μ = 4/3 there are angles at which a growing push of the floor lets the tip go down: 1 + 3 cos θ
/// (cos θ − μ sin θ) < 0.
#[test]
fn in_the_paradox_there_is_no_answer_and_the_error_says_so() {
    let rough = Chalk { mass: 2.0, half: 0.7, g: 9.81, mu: 1.7 };
    let steep = f64::atan(2.0);
    assert!(answer(&rough, steep, -1.0) < 0.0);
    let state = sliding(&rough, steep, 0.1, -1.0);
    let error = solve_once(&rough, &rough.constants().unwrap(), &state).unwrap_err();
    assert!(matches!(error, SolveError::Friction { row: "floor", .. }), "{error}");
    assert!(error.to_string().contains("Painlevé"), "{error}");
    let run = rough.simulate(state).until(1.0).run().unwrap_err();
    assert!(
        matches!(run.kind, SimulationErrorKind::Solve(SolveError::Friction { row: "floor", .. })),
        "{run}"
    );
    assert_eq!(run.time, 0.0);
    // The threshold: at 4/3 no angle is in it, just above tan θ = 2 is.
    for (mu, inside) in [(4.0 / 3.0 - 1e-6, false), (4.0 / 3.0 + 1e-6, true)] {
        let model = Chalk { mu, ..rough.clone() };
        let state = sliding(&model, steep, 0.1, -1.0);
        assert_eq!(solve_once(&model, &model.constants().unwrap(), &state).is_err(), inside, "μ = {mu}");
    }
}

/// A motion that slides toward the paradox ends before it or in it, and says so; up to there every normal
/// force is the one by hand.
#[test]
fn sliding_into_the_paradox_ends_the_motion() {
    let model = Chalk { mass: 2.0, half: 0.7, g: 9.81, mu: 1.7 };
    let start = sliding(&model, 0.35, 3.0, -30.0);
    assert!(answer(&model, 0.35, -1.0) > 0.0);
    let error = model.simulate(start).until(2.0).tolerance(1e-10).run().unwrap_err();
    let theta = error.state.theta();
    assert!(answer(&model, theta, -1.0) < 0.05 || error.state.x_rate() > -0.1, "{error}");
    let motion = error.motion(&model).unwrap();
    for state in motion.steps() {
        let slide = state.x_rate() + model.half * state.theta().sin() * state.theta_rate();
        // Both sides times what answers a push: that vanishes at the end, and the push grows beyond all
        // bounds.
        let answer = answer(&model, state.theta(), slide);
        let expected = answer * normal(&model, state.theta(), state.theta_rate(), slide);
        let found = answer * motion.multipliers_of(&state)[0];
        assert!((found - expected).abs() < 1e-8 * 19.62, "{found} instead of {expected} at {state:?}");
    }
}

/// What stops a rod is said, by every method: friction that brings it to rest, or a floor whose push
/// grows without bounds.
#[test]
fn a_rod_that_stops_says_what_stops_it() {
    let methods: [methods::Any<Chalk>; 4] =
        [methods::Dop853.into(), methods::Tsit5.into(), methods::Radau5.into(), methods::Esdirk4.into()];
    // It slides into the paradox at full speed, and comes to rest before it.
    for (mu, theta, rate, slide, rests) in
        [(3.0, 0.35, 3.0, -30.0, false), (0.7, 1.9, 0.5, -2.5, true), (1.2, 1.0, -1.0, 2.0, true)]
    {
        let model = Chalk { mass: 2.0, half: 0.7, g: 9.81, mu };
        let start = sliding(&model, theta, rate, slide);
        for method in &methods {
            let run = model.simulate(start).until(1.0).tolerance(1e-8).method(method).max_steps(3000);
            let error = run.run().unwrap_err();
            let state = &error.state;
            let slips = state.x_rate() + model.half * state.theta().sin() * state.theta_rate();
            let case = format!("{mu} {method}: {error}");
            match &error.kind {
                SimulationErrorKind::RestsOnJump { .. }
                | SimulationErrorKind::TooManySteps { slides_at: Some(_), .. } => {
                    assert!(rests && slips.abs() < 1e-5, "{case}");
                }
                SimulationErrorKind::FrictionGrows { row: "floor", ahead, .. } => {
                    assert!(!rests && slips.abs() > 10.0 && *ahead < 1e-3, "{case}");
                    assert!(
                        answer(&model, state.theta(), slips) < 1e-3 && case.contains("Painlevé"),
                        "{case}"
                    );
                }
                SimulationErrorKind::Solve(SolveError::Friction { row: "floor", .. }) => {
                    assert!(!rests, "{case}")
                }
                _ => panic!("{case}"),
            }
        }
    }
}
