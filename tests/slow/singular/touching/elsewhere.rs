//! Branches that touch where a drive leads along them or surfaces do, cusps, fixed steps, and RATTLE at
//! change points.

use dynamics::methods::Any;
use dynamics::prelude::*;
use dynamics::simulate::SimulationErrorKind as Kind;

use super::curves::{self, Curve};
use super::{DRIFTING, EXACT, STARTS, methods, neutral::Neutral, scene};

/// y² = x⁶, led along x.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Driven {
    mass: f64,
    rate: f64,
}

#[dynamics]
impl Driven {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[holonomic]
    fn drive(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.rate * q.t
    }
    #[holonomic]
    fn way(&self, q: &Coordinates<Self>) -> Expr {
        q.y.powi(2) - q.x.powi(6)
    }
}

#[test]
fn driven_motions_stay_on_their_branch_or_say_so() {
    let model = Driven { mass: 1.0, rate: 1.0 };
    let mut right = 0;
    for begin in [-1.0_f64, -0.83] {
        let start =
            model.state().at_time(begin).x(begin).y(begin.powi(3)).x_rate(1.0).y_rate(3.0 * begin * begin);
        let start = start.build().unwrap();
        for formulation in EXACT.into_iter().chain(DRIFTING) {
            for method in methods() {
                for tolerance in [1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12] {
                    let run = model.simulate(start).until(0.9).method(&method).formulation(formulation);
                    let Ok(motion) = run.tolerance(tolerance).run() else { continue };
                    right += 1;
                    let off = (motion.end().y() - 0.9_f64.powi(3)).abs();
                    assert!(off < 1e-2, "{begin} {formulation} {method} {tolerance:e}: {off:e}");
                }
            }
        }
    }
    assert!(right > 40, "{right}");
}

/// Surfaces z = y/5 ± h² that touch along h = x + 0.3 y² = 0.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y, z)]
struct Sheets {
    mass: f64,
    g: f64,
}

#[dynamics]
impl Sheets {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec3(q.x, q.y, q.z).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (q.z + 0.3 * q.y)
    }
    #[holonomic]
    fn way(&self, q: &Coordinates<Self>) -> Expr {
        (q.z - 0.2 * q.y).powi(2) - (q.x + 0.3 * q.y * q.y).powi(4)
    }
}

/// The upper one alone.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Sheet {
    mass: f64,
    g: f64,
}

#[dynamics]
impl Sheet {
    fn height(&self, q: &Coordinates<Self>) -> Expr {
        0.2 * q.y + (q.x + 0.3 * q.y * q.y).powi(2)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec3(q.x, q.y, self.height(q)).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (self.height(q) + 0.3 * q.y)
    }
}

#[test]
fn beads_stay_on_their_surface_or_say_so() {
    let (both, one) = (Sheets { mass: 1.0, g: 0.5 }, Sheet { mass: 1.0, g: 0.5 });
    let mut right = 0;
    for k in 0..4 {
        let (x, y) = (-0.8 + 0.07 * f64::from(k), 0.3 - 0.1 * f64::from(k));
        let alone = one.state().x(x).y(y).x_rate(0.9).y_rate(0.2).build().unwrap();
        let truth = one.simulate(alone).until(1.8).tolerance(1e-13).run().unwrap().end();
        let (h, rate) = (x + 0.3 * y * y, 0.9 + 0.6 * y * 0.2);
        let start =
            both.state().x(x).y(y).z(0.2 * y + h * h).x_rate(0.9).y_rate(0.2).z_rate(0.04 + 2.0 * h * rate);
        let start = start.build().unwrap();
        for formulation in EXACT {
            for method in methods() {
                for tolerance in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
                    let run = both.simulate(start).until(1.8).method(&method).formulation(formulation);
                    let Ok(motion) = run.tolerance(tolerance).max_steps(3000).run() else { continue };
                    right += 1;
                    let end = motion.end();
                    let off = (end.x() - truth.x()).abs().max((end.y() - truth.y()).abs());
                    assert!(off < 1e-2, "{k} {formulation} {method} {tolerance:e}: {off:e}");
                }
            }
        }
    }
    assert!(right > 80, "{right}");
}

/// No motion leads over a cusp: velocities would have to turn round. Runs came to rest in it.
#[test]
fn cusps_are_not_passed_in_silence() {
    for k in 0..STARTS {
        let scene = scene(k);
        let model = curves::cusp::At::bead(&scene);
        let start = curves::cusp::At::start(&model, &scene, (-0.9 + 0.05 * f64::from(k), 0.8));
        for formulation in EXACT {
            for method in methods() {
                for digits in [2, 3, 4, 6, 8, 10] {
                    let run = model.simulate(start).until(2.0).method(&method).formulation(formulation);
                    if let Ok(motion) = run.tolerance(10f64.powi(-digits)).max_steps(3000).run() {
                        let summary = motion.verify().to_string();
                        assert!(
                            summary.contains("\n  warning "),
                            "{k} {formulation} {method} 1e-{digits}: {summary}"
                        );
                    }
                }
            }
        }
    }
}

/// Fixed steps, which no tolerance judges; their own errors are at most a hundredth here.
#[test]
fn fixed_steps_stay_on_their_branch_or_say_so() {
    let mut right = 0;
    for k in 0..STARTS {
        let scene = scene(k);
        let model = curves::inside::At::bead(&scene);
        let at = (-0.9 + 0.05 * f64::from(k), 1.0);
        let start = curves::inside::At::start(&model, &scene, at);
        let truth = scene.out(curves::inside::At::truth(&scene, at, 2.0));
        let methods: [Any<_>; 3] = [methods::Rk4.into(), methods::Dop853.into(), methods::Esdirk4.into()];
        for formulation in EXACT {
            for method in &methods {
                for h in [0.03, 0.01, 0.003] {
                    let run = model.simulate(start).until(2.0).method(method).formulation(formulation);
                    let Ok(motion) = run.fixed_step(h).run() else { continue };
                    right += 1;
                    let off = (0..2).map(|i| (motion.end().q()[i] - truth[i]).abs()).fold(0.0, f64::max);
                    assert!(off < 1e-2, "{k} {formulation} {method} {h}: {off:e}");
                }
            }
        }
    }
    assert!(right > 10, "{right}");
}

/// y² = x⁶ with steps of which one or two are taken within the place: of 1,600 runs nine went over to the
/// other branch as a success.
#[test]
fn long_steps_stay_on_their_branch_or_say_so() {
    let (mut right, mut refused) = (0, 0);
    for k in 0..60 {
        let scene = scene(k);
        let model = curves::osculating::At::bead(&scene);
        let part = |by: f64| (f64::from(k) * by).fract();
        let at = (0.5 * part(0.618) - 0.9, 0.8 + 0.4 * part(0.37));
        let start = curves::osculating::At::start(&model, &scene, at);
        let truth = scene.out(curves::osculating::At::truth(&scene, at, 2.0));
        let methods: [Any<_>; 2] = [methods::Rk4.into(), methods::Dop853.into()];
        for formulation in EXACT {
            for method in &methods {
                for h in [0.1, 0.05] {
                    let run = model.simulate(start).until(2.0).method(method).formulation(formulation);
                    let Ok(motion) = run.fixed_step(h).run() else {
                        refused += 1;
                        continue;
                    };
                    right += 1;
                    let off = (0..2).map(|i| (motion.end().q()[i] - truth[i]).abs()).fold(0.0, f64::max);
                    assert!(off < 0.02, "{k} {formulation} {method} {h}: {off:e}");
                }
            }
        }
    }
    println!("{right} right, {refused} refused");
    assert!(right > 60, "{right}");
}

/// RATTLE moves the end of a step along the gradients where it starts, which does not lead to the constraints
/// beside a change point: it says what that is, and what passes.
#[test]
fn rattle_names_change_points() {
    let model = Neutral { inertia: 1.0, lengths: [0.3, 0.9, 0.5, 0.7] };
    let mut named = 0;
    for (crank, rate) in [(1.0, -1.0), (1.0, -2.3), (0.83, -1.0), (0.83, -2.3)] {
        let start = model
            .state()
            .crank(crank)
            .coupler_guess(0.5)
            .rocker_guess(1.5)
            .crank_rate(rate)
            .assemble()
            .unwrap();
        for h in [0.1, 0.03, 0.01, 0.003] {
            let Err(error) = model.simulate(start).until(6.0).method(methods::Rattle).fixed_step(h).run()
            else {
                continue;
            };
            let message = error.to_string();
            let Kind::SingularPosition { rows, .. } = error.kind else { panic!("{message}") };
            assert!(rows.contains("closure.x") && message.contains("use methods::Dop853"), "{message}");
            assert!(!message.contains("contradict"), "{message}");
            named += 1;
        }
    }
    assert!(named >= 8, "{named}");
}

/// A ball on a rope that may be slack, beside something that oscillates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y, beside)]
struct Slack {
    mass: f64,
    stiffness: f64,
    rope: f64,
}

#[dynamics]
impl Slack {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec3(q.x, q.y, q.beside).dt().norm_squared()
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.beside.powi(2)
    }
    #[holonomic(switched)]
    fn rope(&self, q: &Coordinates<Self>) -> Expr {
        self.rope * self.rope - q.x.powi(2) - q.y.powi(2)
    }
}

/// Gradients of what does not hold say nothing: that of a slack rope vanishes where it is fixed, and stays
/// so.
#[test]
fn what_is_released_touches_nothing() {
    let model = Slack { mass: 1.0, stiffness: 4.0, rope: 1.0 };
    let start = model.state().x(0.0).y(0.0).beside(1.0).release("rope").build().unwrap();
    for formulation in EXACT {
        for method in methods() {
            let run = model.simulate(start).until(20.0).method(&method).formulation(formulation);
            let motion =
                run.tolerance(1e-8).run().unwrap_or_else(|error| panic!("{formulation} {method}: {error}"));
            let off = (motion.end().beside() - 40f64.cos()).abs();
            assert!(off < 1e-5, "{formulation} {method}: {off:e}");
        }
    }
}

/// A circle whose row fades with time.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Fading {
    mass: f64,
    rate: f64,
}

#[dynamics]
impl Fading {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[holonomic]
    fn way(&self, q: &Coordinates<Self>) -> Expr {
        (-self.rate * q.t).exp() * (q.x.powi(2) + q.y.powi(2) - 1.0)
    }
}

#[test]
fn what_only_fades_touches_nothing() {
    let model = Fading { mass: 1.0, rate: 1.0 };
    let start = model.state().x(1.0).y(0.0).x_rate(0.0).y_rate(1.0).build().unwrap();
    for formulation in EXACT {
        for method in methods() {
            let run = model.simulate(start).until(20.0).method(&method).formulation(formulation);
            let motion =
                run.tolerance(1e-8).run().unwrap_or_else(|error| panic!("{formulation} {method}: {error}"));
            let off = (motion.end().x() - 20f64.cos()).abs();
            assert!(off < 1e-4, "{formulation} {method}: {off:e}");
        }
    }
}

/// A bead that comes down a track e^(5x), is turned round by a spring where it is flat, and goes up again:
/// the gradient is 5e-7 of its longest there, and nothing vanishes.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Follower {
    mass: f64,
    stiffness: f64,
    rate: f64,
}

#[dynamics]
impl Follower {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.x.powi(2)
    }
    #[holonomic]
    fn track(&self, q: &Coordinates<Self>) -> Expr {
        (self.rate * q.x).exp() - q.y
    }
}

#[test]
fn what_is_only_scaled_touches_nothing() {
    let model = Follower { mass: 1.0, stiffness: 1e6, rate: 5.0 };
    let (x, down): (f64, f64) = (2.6, -2e3);
    let height = (5.0 * x).exp();
    let start = model.state().x(x).y(height).y_rate(down).x_rate(down / (5.0 * height)).build().unwrap();
    let energy = 0.5 * down * down * (1.0 + (5.0 * height).powi(-2)) + 5e5 * x * x;
    let mut back = 0;
    for formulation in EXACT {
        for method in methods() {
            for digits in [6, 8] {
                let run = model.simulate(start).until(400.0).method(&method).formulation(formulation);
                let run = run.tolerance(10f64.powi(-digits)).max_steps(6000).run();
                let motion =
                    run.unwrap_or_else(|error| panic!("{formulation} {method} 1e-{digits}: {error}"));
                let (q, u) = (*motion.end().q(), *motion.end().u());
                let off = 0.5 * (u[0] * u[0] + u[1] * u[1]) + 5e5 * q[0] * q[0] - energy;
                assert!(off.abs() < 0.05 * energy, "{formulation} {method} 1e-{digits}: {off:e}");
                back += usize::from(motion.steps().any(|state| state.x() < -1.0) && q[1] > 100.0);
            }
        }
    }
    assert!(back >= 16, "{back}");
}

/// A bead on an ellipse.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Slim {
    mass: f64,
    half: f64,
    g: f64,
}

#[dynamics]
impl Slim {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.x
    }
    #[holonomic]
    fn way(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2) + (q.y / self.half).powi(2) - 1.0
    }
}

/// Both sides of a slim ellipse are near to each other, and are one branch.
#[test]
fn slim_ellipses_touch_nothing() {
    let mut run_on = 0;
    for (k, half) in [0.03, 0.01, 0.003, 0.001].into_iter().enumerate() {
        for until in [1.7, 2.9, 3.3, 4.1, 5.2] {
            let model = Slim { mass: 1.0, half, g: 0.3 };
            let (sine, cosine) = (0.4 + 0.3 * k as f64).sin_cos();
            let start =
                model.state().x(cosine).y(half * sine).x_rate(-sine).y_rate(half * cosine).build().unwrap();
            let energy = 0.5 * (sine * sine + half * half * cosine * cosine) + model.g * cosine;
            for formulation in EXACT {
                for digits in [4, 5, 6, 8] {
                    let run = model.simulate(start).until(until).formulation(formulation);
                    match run.tolerance(10f64.powi(-digits)).run() {
                        Ok(motion) => {
                            run_on += 1;
                            let (q, u) = (*motion.end().q(), *motion.end().u());
                            let off = 0.5 * (u[0] * u[0] + u[1] * u[1]) + model.g * q[0] - energy;
                            let told = motion.verify().to_string().contains("\n  warning ");
                            assert!(
                                off.abs() < 0.05 || told,
                                "{half} {until} {formulation} 1e-{digits}: {off:e}"
                            );
                        }
                        Err(error) => {
                            let touches = matches!(error.kind, Kind::BranchesTouch { .. });
                            assert!(!touches, "{half} {until} {formulation} 1e-{digits}: {error}");
                        }
                    }
                }
            }
        }
    }
    assert!(run_on >= 140, "{run_on}");
}
