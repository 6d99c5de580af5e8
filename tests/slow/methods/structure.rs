//! Methods that preserve something, on derived models: canonical variables where the mass matrix moves,
//! constraints, and refusals.

use dynamics::model::Vector;
use dynamics::prelude::*;
use dynamics::simulate::{OptionError, SimulationErrorKind};

use crate::double_pendulum;
use crate::kepler;

use double_pendulum::DoublePendulum;
use kepler::Kepler;

const PENDULUM: DoublePendulum = DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };

/// A bob on a rod, in space; it may be damped.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, z: m)]
#[units(m: kg, l: m, g: m / s^2)]
struct Bob {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Bob {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec3(q.x, q.y, q.z).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.z
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        vec3(q.x, q.y, q.z).norm() - self.l
    }
}

/// A mass on a spring and a damper, pushed by an input.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[inputs(push: N)]
#[units(m: kg, k: N / m, c: N * s / m)]
struct Damped {
    m: f64,
    k: f64,
    c: f64,
}

#[dynamics]
impl Damped {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * q.x.powi(2)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.c * q.x.dt().powi(2)
    }
    #[force]
    fn hand(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.push)
    }
}

/// A skate that glides on an inclined plane.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, psi: rad)]
#[units(m: kg, j: kg * m^2, pull: m / s^2)]
struct Skate {
    m: f64,
    j: f64,
    pull: f64,
}

#[dynamics]
impl Skate {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.j * q.psi.dt().powi(2)
    }
    #[potential]
    fn slope(&self, q: &Coordinates<Self>) -> Expr {
        -self.m * self.pull * q.x
    }
    #[nonholonomic]
    fn edge(&self, q: &Coordinates<Self>) -> Expr {
        q.y.dt() * q.psi.cos() - q.x.dt() * q.psi.sin()
    }
}

/// Largest |E − E₀| within the first tenth of a run and within all of it.
fn energy_errors<M: Simulate>(
    model: &M,
    start: M::State,
    method: impl Into<methods::Any<M>>,
    (h, steps): (f64, u32),
) -> (f64, f64) {
    let (before, end) = (model.energy_function(&start), h * f64::from(steps));
    let (mut early, mut all) = (0.0f64, 0.0f64);
    let method = method.into();
    let name = method.to_string();
    let run = model.simulate(start).until(end).fixed_step(h).method(method);
    run.run_with(|state| {
        let error = (model.energy_function(state) - before).abs();
        all = all.max(error);
        if state.t() <= 0.1 * end {
            early = early.max(error);
        }
    })
    .unwrap();
    println!("{} by {name}: {early:.2e}, {all:.2e}", M::NAME);
    (early, all)
}

/// ṗ from Hamilton's equations is what the momenta of a motion do.
#[test]
fn momentum_rates_are_those_of_the_momenta() {
    fn check<M: Simulate>(model: &M, start: M::State) {
        let a = model.accelerations(&start).unwrap();
        let rates = model.momentum_rates(&start).expect("its mass matrix moves");
        let moved = |h: f64| {
            let mut state = M::State::new(start.t() + h, *start.q(), *start.u(), *start.inputs());
            for i in 0..a.as_slice().len() {
                state.q_mut()[i] += h * (start.u()[i] + 0.5 * h * a[i]);
                state.u_mut()[i] += h * a[i];
            }
            model.momenta(&state)
        };
        let h = 1e-5;
        let (ahead, behind) = (moved(h), moved(-h));
        for i in 0..a.as_slice().len() {
            let slope = (ahead[i] - behind[i]) / (2.0 * h);
            assert!(
                (slope - rates[i]).abs() < 1e-7 * (1.0 + slope.abs()),
                "{}: {slope} {}",
                M::NAME,
                rates[i]
            );
        }
    }
    let start = PENDULUM.state().theta1(0.7).theta2(-1.1).theta1_rate(1.5).theta2_rate(-2.0).build().unwrap();
    check(&PENDULUM, start);
    let damped = Damped { m: 2.0, k: 30.0, c: 0.7 };
    let start = damped.state().x(0.3).x_rate(-1.0).push(2.0).build().unwrap();
    check(&damped, start);
    const { assert!(DoublePendulum::VELOCITY_FORCES && Damped::VELOCITY_FORCES) };
    const { assert!(!DoublePendulum::CONSTANT_MASS && Damped::CONSTANT_MASS && Bob::CONSTANT_MASS) };
    const { assert!(!Kepler::VELOCITY_FORCES && !Bob::VELOCITY_FORCES && !Skate::VELOCITY_FORCES) };
}

/// A double pendulum, whose M moves with its angles.
#[test]
fn gauss_is_symplectic_where_the_mass_matrix_moves() {
    let start = PENDULUM.state().theta1(1.2).theta2(-0.6).build().unwrap();
    let span = (0.02, 20_000);
    let (early, rk4) = energy_errors(&PENDULUM, start, methods::Rk4, span);
    assert!(rk4 > 5.0 * early, "{early:e} {rk4:e}");
    for method in [methods::Any::from(methods::Gauss4), methods::Gauss6.into()] {
        let (early, all) = energy_errors(&PENDULUM, start, method, span);
        assert!(all < 1.3 * early && all < 0.1 * rk4, "{early:e} {all:e} {rk4:e}");
    }
    let (_, midpoint) = energy_errors(&PENDULUM, start, methods::EnergyMidpoint, (0.02, 2_000));
    assert!(midpoint < 1e-10, "{midpoint:e}");
    // Against a reference: order 6.
    let exact = PENDULUM.simulate(start).until(1.0).tolerance(1e-14).run().unwrap().end();
    let error = |h: f64| {
        let motion = PENDULUM.simulate(start).until(1.0).fixed_step(h).method(methods::Gauss6).run().unwrap();
        (motion.end().q - exact.q).norm()
    };
    let (coarse, fine) = (error(0.05), error(0.025));
    assert!((coarse / fine).log2() > 5.5 && fine < 1e-6, "{coarse:e} {fine:e}");
}

/// RATTLE on a spherical pendulum: on the constraints, order 2, energy and the momentum about the vertical
/// kept, and back to the start.
#[test]
fn rattle_keeps_constraints_energy_and_momentum() {
    let model = Bob { m: 2.0, l: 1.5, g: 9.81 };
    let start = model.state().x(1.5).y_rate(1.2).build().unwrap();
    let (early, all) = energy_errors(&model, start, methods::Rattle, (0.02, 20_000));
    assert!(all < 1.02 * early && all < 0.05, "{early:e} {all:e}");
    let run = |h: f64, start, end: f64| {
        model.simulate(start).until(end).fixed_step(h).method(methods::Rattle).run().unwrap()
    };
    let motion = run(0.02, start, 20.0);
    let about = |s: &State<Bob>| s.x() * s.y_rate() - s.y() * s.x_rate();
    for state in motion.steps() {
        assert!(model.residual(&state)[0].abs() < 1e-14 && model.velocity_residual(&state)[0].abs() < 1e-13);
        assert!((about(&state) - about(&start)).abs() < 1e-12);
    }
    let back = run(0.02, motion.end(), 0.0).end();
    assert!((back.q - start.q).norm() < 1e-10, "{:e}", (back.q - start.q).norm());
    let exact = model.simulate(start).until(2.0).tolerance(1e-13).run().unwrap().end();
    let error = |h: f64| (run(h, start, 2.0).end().q - exact.q).norm();
    let order = (error(0.01) / error(0.005)).log2();
    assert!((order - 2.0).abs() < 0.1, "{order}");
    // What projects an RK4 step onto the constraints loses energy all along.
    let (early, all) = energy_errors(&model, start, methods::Rk4, (0.02, 20_000));
    assert!(all > 5.0 * early, "{early:e} {all:e}");
}

#[test]
fn verlet_and_its_compositions_run_derived_models() {
    let model = Kepler { mu: 1.0 };
    let start = model.state().x(0.8).y_rate(1.5f64.sqrt()).build().unwrap();
    for (method, h) in [
        (methods::Any::from(methods::StormerVerlet), 0.07),
        (methods::Composition4.into(), 0.15),
        (methods::Composition6.into(), 0.3),
        (methods::Composition8.into(), 0.4),
        (methods::SemiImplicitEuler.into(), 0.03),
    ] {
        let (early, all) = energy_errors(&model, start, method, (h, 20_000));
        assert!(all < 1.02 * early && all < 0.02, "{early:e} {all:e}");
    }
    let motion =
        model.simulate(start).until(10.0).fixed_step(0.01).method(methods::StormerVerlet).run().unwrap();
    assert_eq!(motion.counts().evaluations, motion.counts().steps + 1, "one evaluation a step");
    // The semi-implicit Euler method promises nothing that a damper could take.
    let damped = Damped { m: 1.0, k: 1.0, c: 0.5 };
    let start = damped.state().x(1.0).push(0.0).build().unwrap();
    let run = damped.simulate(start).until(5.0).fixed_step(0.001).method(methods::SemiImplicitEuler);
    let omega = (1.0f64 - 0.0625).sqrt();
    let exact = (-1.25f64).exp() * ((5.0 * omega).cos() + 0.25 / omega * (5.0 * omega).sin());
    assert!((run.run().unwrap().end().x() - exact).abs() < 1e-3);
}

#[test]
fn models_that_do_not_suit_are_refused_with_the_way_out() {
    fn refused<M: Simulate>(model: &M, start: M::State, method: impl Into<methods::Any<M>>, words: &str) {
        let error = model.simulate(start).until(1.0).fixed_step(0.01).method(method).run().unwrap_err();
        assert!(matches!(error.kind, SimulationErrorKind::Option(OptionError::Unsuited { .. })), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
    let start = PENDULUM.state().theta1(2.0).build().unwrap();
    refused(&PENDULUM, start, methods::StormerVerlet, "contain velocities; use methods::Gauss4");
    let bob = Bob { m: 2.0, l: 1.5, g: 9.81 };
    let start = bob.state().x(1.5).build().unwrap();
    refused(&bob, start, methods::StormerVerlet, "it has constraints; use methods::Rattle");
    refused(&bob, start, methods::Gauss6, "it has constraints; use methods::Rattle");
    refused(&bob, start, methods::EnergyMidpoint, "it has constraints; use methods::Rattle");
    let embedded = bob.simulate(start).until(1.0).fixed_step(0.01).method(methods::Rattle);
    let error = embedded.formulation(Formulation::Embedded).run().unwrap_err();
    assert!(error.to_string().contains("leave that out"), "{error}");
    let damped = Damped { m: 1.0, k: 1.0, c: 0.5 };
    let start = damped.state().x(1.0).push(0.0).build().unwrap();
    refused(&damped, start, methods::EnergyMidpoint, "its energy is not conserved; use methods::Gauss4");
    refused(&damped, start, methods::Composition6, "contain velocities");
    let skate = Skate { m: 1.0, j: 0.5, pull: 2.0 };
    let start = skate.state().psi_rate(1.0).build().unwrap();
    refused(&skate, start, methods::Rattle, "nonholonomic constraints; use methods::Dop853");
}

/// Neither steps on constraints nor those in canonical variables allocate: a run without a record allocates
/// as often, however long it is.
#[test]
fn steps_of_derived_models_do_not_allocate() {
    fn check<M: Simulate>(model: &M, start: M::State, method: impl Into<methods::Any<M>>) {
        let method = method.into();
        let observed = |end: f64| {
            let mut states = 0_u64;
            let simulation = model.simulate(start).until(end).fixed_step(0.01).method(&method);
            let info = allocation_counter::measure(|| {
                simulation.run_with(|_| states += 1).unwrap();
            });
            (states, info.count_total)
        };
        let ((few, short), (many, long)) = (observed(0.5), observed(10.0));
        assert!(many > 10 * few);
        assert_eq!(short, long, "{method}");
    }
    let bob = Bob { m: 2.0, l: 1.5, g: 9.81 };
    check(&bob, bob.state().x(1.5).y_rate(1.2).build().unwrap(), methods::Rattle);
    let start = PENDULUM.state().theta1(1.2).theta2(-0.6).build().unwrap();
    check(&PENDULUM, start, methods::Gauss6);
    check(&PENDULUM, start, methods::EnergyMidpoint);
}

/// A step so long that its end cannot be put onto the constraints is an error.
#[test]
fn rattle_refuses_steps_that_leave_the_constraints() {
    let model = Bob { m: 2.0, l: 1.5, g: 9.81 };
    let start = model.state().x(1.5).y_rate(8.0).build().unwrap();
    let error = model.simulate(start).until(10.0).fixed_step(0.5).method(methods::Rattle).run().unwrap_err();
    println!("{error}");
    assert!(matches!(error.kind, SimulationErrorKind::Solve(_)), "{error}");
}
