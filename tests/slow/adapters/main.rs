//! Derived models on solvers of others: the first-order system is the model's, and what comes back agrees
//! with this library's own motions.
#![allow(clippy::float_cmp, reason = "the very same numbers are expected")]

use dynamics::adapters::{AdapterError, FirstOrder};
use dynamics::error::SolveError;
use dynamics::model::Vector;
use dynamics::prelude::*;

/// A driven pendulum on a cart.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, theta: rad)]
#[inputs(push: N)]
#[units(cart: kg, bob: kg, length: m, g: m / s^2)]
struct CartPole {
    cart: f64,
    bob: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl CartPole {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, 0.0) + self.length * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.cart * q.x.dt().powi(2) + 0.5 * self.bob * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.bob * self.g * self.place(q).y
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.push)
    }
}

/// A bob on a rod, in Cartesian coordinates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, g: m / s^2)]
struct Rod {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Rod {
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
}

/// A fall into a centre, where there are no accelerations: V = −k/x.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, strength: N * m^2)]
struct Fall {
    mass: f64,
    strength: f64,
}

#[dynamics]
impl Fall {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn well(&self, q: &Coordinates<Self>) -> Expr {
        -self.strength / q.x
    }
}

/// Inertia that vanishes at x = 0.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg / m^2, k: N / m)]
struct Vanishing {
    mass: f64,
    k: f64,
}

#[dynamics]
impl Vanishing {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.powi(2) * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * q.x.powi(2)
    }
}

const CART_POLE: CartPole = CartPole { cart: 1.0, bob: 0.4, length: 0.7, g: 9.81 };
const ROD: Rod = Rod { m: 1.0, l: 1.0, g: 9.81 };

fn cart_pole() -> State<CartPole> {
    CART_POLE.state().theta(1.2).x_rate(0.3).push(0.8).build().unwrap()
}

fn hanging_out() -> State<Rod> {
    ROD.state().x(1.0).build().unwrap()
}

/// Directional differences of the rates, centred.
fn by_differences<M: Simulate>(system: &FirstOrder<'_, M>, t: f64, y: &[f64], v: &[f64]) -> Vec<f64> {
    let h = 1e-6;
    let moved = |by: f64| {
        let y: Vec<f64> = y.iter().zip(v).map(|(y, v)| y + by * v).collect();
        let mut rate = vec![0.0; y.len()];
        system.rate(t, &y, &mut rate);
        rate
    };
    moved(h).iter().zip(moved(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_first_order_system_is_the_models() {
    let start = cart_pole();
    let system = FirstOrder::new(&CART_POLE, start).unwrap();
    let y = system.initial();
    assert_eq!((system.start_time(), system.len(), y.as_slice()), (0.0, 4, &[0.0, 1.2, 0.3, 0.0][..]));
    let mut rate = [0.0; 4];
    system.rate(0.0, &y, &mut rate);
    let a = CART_POLE.accelerations(&start).unwrap();
    assert_eq!(rate, [0.3, 0.0, a[0], a[1]]);
    assert_eq!(system.state(0.0, &y).unwrap(), start);

    let driven =
        FirstOrder::new(&CART_POLE, start).unwrap().inputs(|t, state| [2.0 * t - 3.0 * state.theta()]);
    driven.rate(0.5, &y, &mut rate);
    let mut pushed = start;
    pushed.t = 0.5;
    pushed.inputs_mut()[0] = 1.0 - 3.0 * 1.2;
    assert_eq!(driven.state(0.5, &y).unwrap(), pushed);
    let a = CART_POLE.accelerations(&pushed).unwrap();
    assert_eq!(rate[2..], [a[0], a[1]]);
    let number = FirstOrder::new(&CART_POLE, start).unwrap().inputs(|t, state| 2.0 * t - 3.0 * state.theta());
    assert_eq!(number.state(0.5, &y).unwrap(), pushed);

    // Held inputs: the generated derivatives. A law: what it adds is in the differences.
    for (system, accuracy) in [(&system, 1e-8), (&driven, 1e-5)] {
        for v in [[1.0, 0.0, 0.0, 0.0], [0.2, -0.7, 0.5, 1.1], [0.0, 0.0, 0.0, 1.0]] {
            let mut along = [0.0; 4];
            system.rate_along(0.5, &y, &v, &mut along);
            let differences = by_differences(system, 0.5, &y, &v);
            assert!(largest(&along, &differences) < accuracy, "{along:?} {differences:?}");
        }
    }
}

#[test]
fn what_is_no_state_is_said() {
    let system = FirstOrder::new(&CART_POLE, cart_pole()).unwrap();
    assert_eq!(system.state(0.0, &[0.0; 3]).unwrap_err(), AdapterError::Length { given: 3, needed: 4 });
    let mut rate = [0.0; 4];
    system.rate(0.0, &[0.0; 3], &mut rate);
    assert!(rate.iter().all(|x| x.is_nan()));
    let mut short = [0.0; 3];
    system.rate(0.0, &[0.0; 4], &mut short);
    assert!(short.iter().all(|x| x.is_nan()));
    system.rate_along(0.0, &[0.0; 4], &[0.0; 3], &mut rate);
    assert!(rate.iter().all(|x| x.is_nan()));
    let error = system.state(1.5, &[0.0, 0.0, 0.0, f64::NAN]).unwrap_err();
    assert!(
        matches!(error, AdapterError::NotFinite { name: "theta", rate: true, failure: None, .. }),
        "{error}"
    );
    assert!(error.to_string().contains("the velocity of `theta` is not finite at t = 1.5"), "{error}");

    // Without a value of its input nothing moves.
    let start = CART_POLE.state().theta(1.2).build().unwrap();
    let system = FirstOrder::new(&CART_POLE, start).unwrap();
    system.rate(0.0, &system.initial(), &mut rate);
    let error = system.state(0.1, &rate).unwrap_err();
    assert_eq!(error, AdapterError::Input { time: 0.1, input: "push" });
    let given = FirstOrder::new(&CART_POLE, start).unwrap().inputs(|_, _| [0.0]);
    assert!(matches!(given.state(0.1, &rate), Err(AdapterError::NotFinite { .. })));
    let none = CartPole { length: f64::NAN, ..CART_POLE };
    let error = FirstOrder::new(&none, start).unwrap_err().to_string();
    assert_eq!(error, "parameter `length` is NaN; give a finite number");

    let singular = Vanishing { mass: 1.0, k: 1.0 };
    let start = singular.state().x(1.0).build().unwrap();
    let system = FirstOrder::new(&singular, start).unwrap();
    let mut rate = [0.0; 2];
    system.rate(2.0, &[0.0, 1.0], &mut rate);
    assert!(rate.iter().all(|x| x.is_nan()));
    assert!(matches!(system.failure(), Some((2.0, SolveError::SingularMassMatrix(_)))));
    let said = system.state(2.5, &[f64::NAN; 2]).unwrap_err().to_string();
    assert!(said.contains("the model had no accelerations at t = 2: "), "{said}");
}

/// RK4 by hand, for a solver that nobody has written an adapter for.
fn by_hand<M: Simulate>(system: &FirstOrder<'_, M>, end: f64, steps: usize) -> Vec<f64> {
    let (mut y, h) = (system.initial(), end / steps as f64);
    let moved =
        |y: &[f64], k: &[f64], by: f64| -> Vec<f64> { y.iter().zip(k).map(|(y, k)| y + by * k).collect() };
    for step in 0..steps {
        let t = h * step as f64;
        let slope = |t: f64, y: &[f64]| {
            let mut rate = vec![0.0; y.len()];
            system.rate(t, y, &mut rate);
            rate
        };
        let k1 = slope(t, &y);
        let k2 = slope(t + 0.5 * h, &moved(&y, &k1, 0.5 * h));
        let k3 = slope(t + 0.5 * h, &moved(&y, &k2, 0.5 * h));
        let k4 = slope(t + h, &moved(&y, &k3, h));
        for i in 0..y.len() {
            y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    y
}

fn own_end<M: Simulate>(model: &M, start: M::State, end: f64) -> Vec<f64> {
    let end = model.simulate(start).until(end).tolerance(1e-13).run().unwrap().end();
    [end.q().as_slice(), end.u().as_slice()].concat()
}

#[test]
fn any_solver_moves_it() {
    let system = FirstOrder::new(&CART_POLE, cart_pole()).unwrap();
    assert!(largest(&by_hand(&system, 2.0, 4000), &own_end(&CART_POLE, cart_pole(), 2.0)) < 1e-11);
}

/// Drift of a bob in Cartesian coordinates from its rod's length.
#[test]
fn nothing_holds_constraints_on_other_solvers() {
    let system = FirstOrder::new(&ROD, hanging_out()).unwrap();
    let drift = |steps: usize, end: f64| {
        let state = system.state(end, &by_hand(&system, end, steps)).unwrap();
        ROD.residual(&state)[0].abs()
    };
    // With the steps as good as before, later is worse; better steps make it less.
    let (soon, late, fine) = (drift(100, 2.0), drift(1000, 20.0), drift(2000, 20.0));
    assert!(late > 20.0 * soon && fine < late / 8.0, "{soon:e} {late:e} {fine:e}");
    let own = ROD.simulate(hanging_out()).until(20.0).tolerance(1e-6).run().unwrap();
    assert!(ROD.residual(&own.end())[0].abs() < 1e-12 && late > 1e-8, "{late:e}");
}

#[cfg(feature = "ode_solvers")]
mod with_ode_solvers {
    use dynamics::adapters::ode_solvers::solvers::{DVector, Dop853, OutputType, SVector};

    use super::*;

    fn end_of<M: Simulate>(system: &FirstOrder<'_, M>, end: f64, tolerance: f64) -> Result<M::State, String> {
        let y = DVector::from_vec(system.initial());
        let mut solver = Dop853::new(system, system.start_time(), end, end, y, tolerance, tolerance);
        solver.set_output(OutputType::Sparse);
        solver.integrate().map_err(|error| error.to_string())?;
        let (times, places) = solver.results().get();
        let (t, y) = (times.last().ok_or("no output")?, places.last().ok_or("no output")?);
        system.state(*t, y.as_slice()).map_err(|error| error.to_string())
    }

    #[test]
    fn free_and_constrained_models_end_where_ours_do() {
        let system = FirstOrder::new(&CART_POLE, cart_pole()).unwrap();
        let end = end_of(&system, 5.0, 1e-12).unwrap();
        let own = CART_POLE.simulate(cart_pole()).until(5.0).tolerance(1e-13).run().unwrap().end();
        assert_eq!(end.t, 5.0);
        assert!((end.q - own.q).amax() < 1e-9 && (end.u - own.u).amax() < 1e-9, "{end:?} {own:?}");

        let system = FirstOrder::new(&ROD, hanging_out()).unwrap();
        let end = end_of(&system, 5.0, 1e-12).unwrap();
        let own = ROD.simulate(hanging_out()).until(5.0).tolerance(1e-13).run().unwrap().end();
        assert!((end.q - own.q).amax() < 1e-8 && (end.u - own.u).amax() < 1e-8, "{end:?} {own:?}");
    }

    #[test]
    fn fixed_vectors_do_as_vectors_on_the_heap() {
        let system = FirstOrder::new(&CART_POLE, cart_pole()).unwrap();
        let y = SVector::<f64, 4>::from_column_slice(&system.initial());
        let mut solver = Dop853::new(&system, 0.0, 5.0, 5.0, y, 1e-12, 1e-12);
        solver.set_output(OutputType::Sparse);
        solver.integrate().unwrap();
        let end = end_of(&system, 5.0, 1e-12).unwrap();
        assert_eq!(solver.y_out().last().unwrap().as_slice(), [end.q.as_slice(), end.u.as_slice()].concat());
    }

    #[test]
    fn a_motion_that_ends_is_no_success() {
        // It reaches the centre at t = π/(2√2) and cannot be continued.
        let fall = Fall { mass: 1.0, strength: 1.0 };
        let system = FirstOrder::new(&fall, fall.state().x(1.0).build().unwrap()).unwrap();
        let error = end_of(&system, 2.0, 1e-8).unwrap_err();
        assert!(!error.is_empty(), "{error}");
    }
}

#[cfg(feature = "diffsol")]
mod with_diffsol {
    use dynamics::adapters::diffsol::builder;
    use dynamics::adapters::diffsol::solvers::{
        FaerLU, FaerMat, NalgebraLU, NalgebraMat, OdeSolverMethod, OdeSolverStopReason, Vector as _,
    };

    use super::*;

    /// Steps a solver to the end.
    macro_rules! end_of {
        ($solver:expr, $system:expr, $end:expr) => {{
            let mut solver = $solver.unwrap();
            solver.set_stop_time($end).unwrap();
            while !matches!(solver.step().unwrap(), OdeSolverStopReason::TstopReached) {}
            let state = solver.state();
            $system.state(state.t, &state.y.clone_as_vec()).unwrap()
        }};
    }

    /// A spring pendulum, not so stiff that diffsol's Newton iterations give up, as they do at 10⁶ N/m.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(mass: kg, stiffness: N / m, damping: N * s / m, length: m, g: m / s^2)]
    struct StiffSpring {
        mass: f64,
        stiffness: f64,
        damping: f64,
        length: f64,
        g: f64,
    }

    #[dynamics]
    impl StiffSpring {
        fn stretch(&self, q: &Coordinates<Self>) -> Expr {
            (q.x.powi(2) + q.y.powi(2)).sqrt() - self.length
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * (q.x.dt().powi(2) + q.y.dt().powi(2))
        }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr {
            self.mass * self.g * q.y
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.stiffness * self.stretch(q).powi(2)
        }
        #[dissipation]
        fn damper(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.damping * self.stretch(q).dt().powi(2)
        }
    }

    #[test]
    fn explicit_and_implicit_methods_end_where_ours_do() {
        let system = FirstOrder::new(&CART_POLE, cart_pole()).unwrap();
        let problem = builder::<NalgebraMat<f64>, _>(&system).rtol(1e-9).atol([1e-9]).build().unwrap();
        let own = CART_POLE.simulate(cart_pole()).until(5.0).tolerance(1e-13).run().unwrap().end();
        let ends = [
            ("tsit45", end_of!(problem.tsit45(), system, 5.0), 1e-6),
            ("esdirk34", end_of!(problem.esdirk34::<NalgebraLU<f64>>(), system, 5.0), 1e-4),
            ("bdf", end_of!(problem.bdf::<NalgebraLU<f64>>(), system, 5.0), 1e-4),
        ];
        for (name, end, bound) in ends {
            assert!(
                (end.q - own.q).amax() < bound && (end.u - own.u).amax() < bound,
                "{name}: {end:?} {own:?}"
            );
        }
        let problem = builder::<FaerMat<f64>, _>(&system).rtol(1e-9).atol([1e-9]).build().unwrap();
        let end = end_of!(problem.bdf::<FaerLU<f64>>(), system, 5.0);
        assert!((end.q - own.q).amax() < 1e-4);
    }

    #[test]
    fn stiff_models_run_on_their_exact_jacobian() {
        let model = StiffSpring { mass: 1.0, stiffness: 1e4, damping: 2e2, length: 1.0, g: 9.81 };
        let start = model.state().x(1.0).build().unwrap();
        let system = FirstOrder::new(&model, start).unwrap();
        let problem = builder::<NalgebraMat<f64>, _>(&system).rtol(1e-6).atol([1e-6]).build().unwrap();
        let end = end_of!(problem.tr_bdf2::<NalgebraLU<f64>>(), system, 1.0);
        let own =
            model.simulate(start).until(1.0).method(methods::Radau5).tolerance(1e-10).run().unwrap().end();
        assert!((end.q - own.q).amax() < 1e-4 && (end.u - own.u).amax() < 1e-3, "{end:?} {own:?}");
    }
}
