//! Kernels in single precision, on the card or the software driver that is there.

use std::env;

use dynamics::gpu::{SingleGpu, SingleGpuError, kernel_in_wgsl};
use dynamics::lanes::limit_vectors;
use dynamics::model::ModelState;
use dynamics::prelude::*;
use dynamics::simulate::ends;

/// Two masses on springs, of which one is on a pendulum that a motor turns; with what single precision has
/// functions for.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(wgsl))]
#[coordinates(x: m, theta: rad)]
#[inputs(torque: N * m)]
#[units(cart: kg, bob: kg, length: m, g: m / s^2, stiffness: N / m, damping: kg / s)]
struct Cart {
    cart: f64,
    bob: f64,
    length: f64,
    g: f64,
    stiffness: f64,
    damping: f64,
}

#[dynamics]
impl Cart {
    fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x + self.length * q.theta.sin(), -self.length * q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.cart * q.x.dt().powi(2) + 0.5 * self.bob * self.tip(q).dt().norm_squared()
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.bob * self.g * self.tip(q).y + 0.5 * self.stiffness * q.x.powi(2)
    }
    #[dissipation]
    fn damping(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * q.x.dt().powi(2)
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.theta, q.torque * (-0.3 * q.x.dt().powi(2) / (self.length * self.g)).exp())
    }
}

/// A rod between two points.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(wgsl))]
#[coordinates(x: m, y: m)]
#[units(mass: kg, length: m, g: m / s^2)]
struct Rod {
    mass: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl Rod {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2) + q.y.powi(2) - self.length.powi(2)
    }
}

/// A particle that a constant of nature moves, too small for single precision.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(wgsl))]
#[coordinates(x)]
struct Small {
    mass: f64,
}

#[dynamics]
impl Small {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        1e-60 * q.x.powi(4)
    }
}

/// The card; `None`, with a line, where there is none.
fn card() -> Option<SingleGpu> {
    match SingleGpu::first() {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            assert!(env::var_os("DYNAMICS_WGPU").is_none(), "DYNAMICS_WGPU is set, but: {error}");
            assert!(error.to_string().contains("the runs can be made by the processor"), "{error}");
            eprintln!("skipped: {error}");
            None
        }
    }
}

fn carts(count: usize) -> Vec<(Cart, State<Cart>)> {
    let one = |i: usize| {
        let x = i as f64 / count as f64;
        let model = Cart {
            cart: 1.0 + x,
            bob: 0.5 + 0.3 * x,
            length: 0.8 + 0.2 * x,
            g: 9.81,
            stiffness: 20.0 + 10.0 * x,
            damping: 0.2 * x,
        };
        let start = model.state().at_time(0.5 * x).x(0.3 * x).theta(1.5 - x).theta_rate(0.4);
        let start = start.torque(0.2 - 0.1 * x).build().unwrap();
        (model, start)
    };
    (0..count).map(one).collect()
}

/// The ends are those of double precision to some 1e-4, at the ends' times exactly, and the error that is
/// told is that of the runs that were repeated.
#[test]
fn ends_are_near_those_of_doubles() {
    let Some(gpu) = card() else { return };
    limit_vectors(128);
    let points = carts(300);
    let until = |i: usize| 2.0 + 0.01 * i as f64;
    let run = |i: usize, tolerance: f64| {
        let (model, start) = &points[i];
        model.simulate(*start).until(until(i)).tolerance(tolerance)
    };
    let done = gpu.ends((0..points.len()).map(|i| run(i, 1e-5))).unwrap();
    assert_eq!(done.on_device, points.len(), "on {}", gpu.name());
    let exact = ends((0..points.len()).map(|i| run(i, 1e-10)));
    let mut errors = Vec::new();
    for (i, (end, exact)) in done.ends.iter().zip(&exact).enumerate() {
        let (end, exact) = (end.as_ref().unwrap(), exact.as_ref().unwrap());
        assert_eq!(end.t(), until(i));
        assert_eq!(end.torque(), points[i].1.torque());
        let differences = [
            end.x() - exact.x(),
            end.theta() - exact.theta(),
            end.x_rate() - exact.x_rate(),
            end.theta_rate() - exact.theta_rate(),
        ];
        errors.push(differences.into_iter().fold(0.0f64, |largest, x| largest.max(x.abs())));
    }
    let largest = errors.iter().copied().fold(0.0, f64::max);
    assert!(largest < 5e-4 && largest > 1e-8, "{largest:e}");
    let measured = done.measured_error.unwrap();
    let repeated = errors.iter().step_by(points.len().div_ceil(16)).copied().fold(0.0, f64::max);
    assert_eq!(measured.runs, 16);
    assert!((measured.absolute - repeated).abs() < 1e-7, "{measured:?} {repeated:e}");
    assert!(measured.relative > 0.0 && measured.relative < 1e-2, "{measured:?}");
}

/// What single precision cannot do is refused before a run, by name; what the card cannot do, the processor
/// does.
#[test]
fn what_single_precision_lacks_is_said() {
    let constrained = kernel_in_wgsl::<Rod>().unwrap_err().to_string();
    assert_eq!(constrained, "Rod has no kernel in WGSL: it has constraints, which kernels do not hold");
    let small = kernel_in_wgsl::<Small>().unwrap_err().to_string();
    assert_eq!(
        small,
        "Small has no kernel in WGSL: single precision does not hold the number 4e-60 of its equations"
    );
    let Some(gpu) = card() else { return };
    let points = carts(3);
    let runs = || points.iter().map(|(model, start)| model.simulate(*start).until(1.0).tolerance(1e-9));
    let error = gpu.ends(runs()).unwrap_err();
    assert!(matches!(error, SingleGpuError::Tolerance { run: 0, tolerance: 1e-9 }));
    assert!(error.to_string().contains("ask for it with `.tolerance(1e-5)`"), "{error}");
    let rod = Rod { mass: 1.0, length: 1.0, g: 9.81 };
    let start = rod.state().x(1.0).build().unwrap();
    let done =
        gpu.ends([0.5, 1.0].into_iter().map(|end| rod.simulate(start).until(end).tolerance(1e-5))).unwrap();
    assert_eq!((done.on_device, done.ends.len()), (0, 2));
    assert!(done.ends.iter().all(Result::is_ok));
}

/// Backwards; and of many thousand attempts, with pauses: each way as the processor.
#[test]
fn long_runs_and_runs_back_are_those_of_doubles() {
    let Some(gpu) = card() else { return };
    let points = carts(7);
    for (span, most) in [(-1.5, f64::INFINITY), (3.0, 1e-3)] {
        let run = |i: usize, tolerance: f64| {
            let (model, start) = &points[i];
            model.simulate(*start).until(start.t() + span).max_step(most).tolerance(tolerance)
        };
        let done = gpu.ends((0..7).map(|i| run(i, 1e-5))).unwrap();
        assert_eq!(done.on_device, 7, "{span}");
        for (i, end) in done.ends.iter().enumerate() {
            let (end, exact) = (end.as_ref().unwrap(), run(i, 1e-9).run_with(|_| ()).unwrap());
            let off = (end.x() - exact.x()).abs().max((end.theta() - exact.theta()).abs());
            assert!(off < 1e-3 && end.t() == exact.t(), "{span} {i}: {off:e}");
        }
    }
}

/// A wheel that a force turns by its angle.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(wgsl))]
#[coordinates(angle: rad)]
#[units(inertia: kg * m^2, torque: N * m, omega: rad / s)]
struct Wheel {
    inertia: f64,
    torque: f64,
    omega: f64,
}

#[dynamics]
impl Wheel {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * q.angle.dt().powi(2)
    }
    #[force]
    fn ripple(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.angle, self.torque * (q.angle.sin() + (self.omega * q.t).sin()))
    }
}

/// Angles, times and numbers for which single precision has too few digits: the processor makes these runs.
#[test]
fn what_single_precision_does_not_hold_the_processor_makes() {
    let Some(gpu) = card() else { return };
    let model = Wheel { inertia: 1.0, torque: 0.5, omega: 150.0 };
    let tiny = Wheel { inertia: 1e-46, torque: 1e-46, omega: 150.0 };
    let wheels = [
        // The angle passes 8192 on its way; and 150 t does at t = 55.
        (&model, model.state().angle(8190.0).angle_rate(4.0).build().unwrap(), 5.0),
        (&model, model.state().at_time(50.0).angle_rate(1.0).build().unwrap(), 10.0),
        (&model, model.state().at_time(1e8).angle_rate(1.0).build().unwrap(), 1.0),
        (&tiny, tiny.state().angle_rate(1.0).build().unwrap(), 2.0),
        (&model, model.state().angle_rate(1.0).build().unwrap(), 2.0),
    ];
    let run = |i: usize, tolerance: f64| {
        let (model, start, span) = &wheels[i];
        model.simulate(*start).until(start.t() + span).tolerance(tolerance)
    };
    let done = gpu.ends((0..wheels.len()).map(|i| run(i, 1e-5))).unwrap();
    assert_eq!(done.on_device, 1);
    assert_eq!(done.measured_error.unwrap().runs, 1);
    for (i, end) in done.ends.iter().enumerate() {
        let (end, exact) = (end.as_ref().unwrap(), run(i, 1e-9).run_with(|_| ()).unwrap());
        assert!((end.angle() - exact.angle()).abs() < 2e-3, "{i}: {} {}", end.angle(), exact.angle());
    }
}

/// Several threads use one card.
#[test]
fn a_card_is_shared_by_threads() {
    let Some(gpu) = card() else { return };
    let points = carts(40);
    let ends = || {
        let runs = points.iter().map(|(model, start)| model.simulate(*start).until(1.5).tolerance(1e-5));
        let done = gpu.ends(runs).unwrap();
        assert_eq!(done.on_device, 40);
        done.ends.iter().map(|end| end.as_ref().unwrap().theta().to_bits()).collect::<Vec<u64>>()
    };
    let known = ends();
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..3).map(|_| scope.spawn(ends)).collect();
        threads.into_iter().for_each(|thread| assert_eq!(thread.join().unwrap(), known));
    });
}

/// Runs that fail have the error of the processor; those before and behind them end.
#[test]
fn a_run_that_fails_spoils_no_other() {
    let Some(gpu) = card() else { return };
    let points = carts(5);
    let runs = points.iter().enumerate().map(|(i, (model, start))| {
        let run = model.simulate(*start).until(3.0).tolerance(1e-5);
        if i == 2 { run.max_steps(2) } else { run }
    });
    let done = gpu.ends(runs).unwrap();
    assert_eq!(done.on_device, 4);
    let failed: Vec<bool> = done.ends.iter().map(Result::is_err).collect();
    assert_eq!(failed, [false, false, true, false, false]);
}
