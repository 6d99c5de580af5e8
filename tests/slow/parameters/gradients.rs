//! Gradients by the adjoint equations against closed forms, the variational equations, and differences of
//! whole motions.

use dynamics::analysis::{Gradient, Objective, Sensitivities};
use dynamics::model::{Model, Parameters};
use dynamics::prelude::*;

use super::difference;
use super::double_pendulum::DoublePendulum;
use super::models::{Oscillator, once, twice};
use super::rolling_disk::DISK;

/// E lost = ∫ c ẋ² dt: the integral has a closed form beside the motion's.
#[test]
fn a_damped_oscillator_has_the_gradient_of_its_closed_form() {
    let model = Oscillator::PLAIN;
    let start = model.state().x(0.3).x_rate(-0.4).build().unwrap();
    let p = [2.0, 1.2, 50.0, 0.3, -0.4];
    let data = [(0.0, 0.2), (1.1, -0.1), (2.5, 0.05), (4.0, 0.1)];
    let objective = |p: [f64; 5]| {
        let energy = |t: f64| {
            let [x, v] = Oscillator::closed(p, t);
            0.5 * (p[0] * v * v + p[2] * x * x)
        };
        let squares: f64 = data.iter().map(|(t, y)| (Oscillator::closed(p, *t)[0] - y).powi(2)).sum();
        let [x, v] = Oscillator::closed(p, 4.0);
        let pull = |t: f64| p[2] * Oscillator::closed(p, t)[0] + p[1] * Oscillator::closed(p, t)[1];
        3.0 * v - 2.0 * x + 0.7 * pull(1.7) + 0.2 * (energy(0.0) - energy(4.0)) + 5.0 * squares
    };
    for (tolerance, within) in [(1e-6, 1e-5), (1e-9, 1e-8), (1e-12, 1e-10)] {
        let asked = model
            .objective(start)
            .end("x_rate", 3.0)
            .end("x", -2.0)
            .at(1.7, "pull", 0.7)
            .squares("x", 5.0, data);
        let found = asked.integral("power", 0.2).until(4.0).tolerance(tolerance).run().unwrap();
        assert!((found.value / objective(p) - 1.0).abs() < within, "{} {}", found.value, objective(p));
        assert_eq!(found.derivatives().len(), 5);
        for (k, by) in found.derivatives().iter().enumerate() {
            let closed = difference(2e-4 * p[k], |h| {
                let mut p = p;
                p[k] += h;
                objective(p)
            });
            assert!((by - closed).abs() < within * closed.abs(), "{k} at {tolerance}: {by} {closed}");
        }
        assert!(found.to_string().starts_with("J = ") && found.to_string().contains(" per N/m\n"), "{found}");
    }
}

/// Σ weight ∂quantity/∂variable at times, by the variational equations.
fn by_variations<M: Simulate + Parameters + Clone>(
    found: &Sensitivities<'_, M>,
    by: &str,
    terms: &[(f64, &str, f64)],
) -> f64 {
    let at = |(time, quantity, weight): &(f64, &str, f64)| {
        let series = found.series(quantity, by).unwrap();
        weight * series.iter().find(|(t, _)| t == time).unwrap().1
    };
    terms.iter().map(at).sum()
}

/// All derivatives of values at instants, both ways; the largest difference in parts of the largest.
fn against_variations<M: Simulate + Parameters + Clone>(
    model: &M,
    start: M::State,
    end: f64,
    names: &[&str],
    terms: &[(f64, &str, f64)],
    tolerance: f64,
) -> (f64, bool) {
    let times: Vec<f64> = terms.iter().map(|term| term.0).collect();
    let all = model
        .sensitivities(start)
        .by(names)
        .until(end)
        .output_times(times)
        .tolerance(tolerance)
        .run()
        .unwrap();
    let asked = model.objective(start).by(names).until(end).tolerance(tolerance);
    let asked =
        terms.iter().fold(asked, |asked: Objective<'_, M>, (t, name, weight)| asked.at(*t, name, *weight));
    let found: Gradient<'_, M> = asked.run().unwrap();
    let expected: Vec<f64> = names.iter().map(|name| by_variations(&all, name, terms)).collect();
    let largest = expected.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let off =
        expected.iter().zip(found.derivatives()).map(|(a, b)| (a - b).abs() / largest).fold(0.0, f64::max);
    assert!(largest > 0.0);
    (off, found.exact)
}

#[test]
fn both_ways_agree_on_free_motions_forward_and_backward() {
    let model = DoublePendulum { m1: 1.0, m2: 0.7, l1: 1.0, l2: 0.8, g: 9.81 };
    let start = model.state().theta1(1.2).theta2(-0.4).theta1_rate(0.5).build().unwrap();
    let names = ["m1", "m2", "l1", "l2", "g", "theta1", "theta2", "theta1_rate", "theta2_rate"];
    for end in [2.0, -2.0] {
        let terms = [
            (0.0, "theta1", 0.3),
            (0.25 * end, "theta2", 1.0),
            (end, "theta2_rate", -0.5),
            (end, "theta1", 2.0),
        ];
        let (off, exact) = against_variations(&model, start, end, &names, &terms, 1e-12);
        assert!(exact && off < 1e-10, "{end}: {off:e}");
    }
}

/// With the rod once the solution is generated, with the rod twice it is not.
#[test]
fn both_ways_agree_under_constraints() {
    let names = ["mass", "length", "g", "push", "x", "y", "x_rate", "y_rate"];
    let terms = [(0.0, "y", 0.3), (1.3, "x", 1.0), (3.0, "y_rate", 1.0), (3.0, "x", -2.0)];
    macro_rules! check {
        ($module:ident, $exact:expr) => {{
            let bob = $module::Bob { mass: 0.4, length: 1.0, g: 9.81, push: 0.5 };
            let start = bob.state().x(0.6).y(-0.8).x_rate(0.8).y_rate(0.6).build().unwrap();
            let (off, exact) = against_variations(&bob, start, 3.0, &names, &terms, 1e-11);
            assert!(exact == $exact && off < 1e-9, "{off:e}");
        }};
    }
    check!(once, true);
    check!(twice, false);
    let start =
        DISK.state().lean(0.3).yaw(0.1).yaw_rate(0.4).lean_rate(0.1).spin_rate(1.5).assemble().unwrap();
    let names = ["r", "g", "lean", "spin_rate", "yaw_rate"];
    let (off, _) =
        against_variations(&DISK, start, 1.5, &names, &[(0.7, "yaw", 1.0), (1.5, "x", 1.0)], 1e-11);
    assert!(off < 1e-9, "{off:e}");
}

/// A bob on a rod, with what the rod bears, and a law that follows it.
mod borne {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[inputs(wind: N)]
    #[units(mass: kg, length: m, g: m / s^2)]
    struct Borne {
        mass: f64,
        length: f64,
        g: f64,
    }
    #[dynamics]
    impl Borne {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.mass * self.g * q.y
        }
        #[force]
        fn wind(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, q.wind)
        }
        #[holonomic]
        fn rod(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * (vec2(q.x, q.y).norm_squared() - self.length * self.length)
        }
        #[output]
        fn tension(&self, q: &Coordinates<Self>) -> Expr {
            self.length * q.reaction(Self::rod)
        }
        #[output]
        fn weighed(&self, q: &Coordinates<Self>) -> Expr {
            self.mass * q.x.dt().dt() + q.wind
        }
    }

    /// Integrals of reactions, accelerations and inputs, under a law, against differences of whole motions.
    #[test]
    fn integrals_of_reactions_and_of_inputs_that_follow_the_state_have_their_differences() {
        let model = Borne { mass: 0.4, length: 1.0, g: 9.81 };
        let start = model.state().x(0.6).y(-0.8).x_rate(0.8).y_rate(0.6).wind(0.0).build().unwrap();
        let of = |model: &Borne, start: <Borne as Model>::State, tolerance: f64, by: &[&str]| {
            let asked = model.objective(start).integral("tension", 1.0).integral("weighed", 0.5).until(2.0);
            let asked = asked.tolerance(tolerance).by(by);
            let found =
                asked.with(|s| s.inputs(|t, state| [0.3 * t.sin() - 0.2 * state.x_rate()])).run().unwrap();
            (found.value, found.derivatives().to_vec(), found.exact)
        };
        let (_, by, exact) = of(&model, start, 1e-11, &["mass", "g"]);
        assert!(!exact);
        let moved = |k: usize, h: f64| {
            let mut model = model.clone();
            assert!(model.set_parameter([0, 2][k], model.parameter([0, 2][k]).unwrap() + h));
            of(&model, start, 1e-12, &["g"]).0
        };
        for (k, by) in by.iter().enumerate() {
            let expected = difference([1e-3, 1e-2][k], |h| moved(k, h));
            assert!((by / expected - 1.0).abs() < 1e-8, "{k}: {by} {expected}");
        }
    }
}

/// A chain of many springs and masses, each of its own.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 6])]
#[units(masses: kg, springs: N / m, dampers: N * s / m, short: m)]
struct Chain {
    masses: [f64; 6],
    springs: [f64; 6],
    dampers: [f64; 6],
    short: f64,
}

#[dynamics]
impl Chain {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..6 {
            sum += 0.5 * self.masses[i] * q.x[i].dt().powi(2);
        }
        sum
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.springs[0] * q.x[0].powi(2);
        for i in 1..6 {
            sum += 0.5
                * self.springs[i]
                * (q.x[i] - q.x[i - 1]).powi(2)
                * (1.0 + (q.x[i] - q.x[i - 1]).powi(2) / self.short.powi(2));
        }
        sum
    }
    #[dissipation]
    fn dampers(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..6 {
            sum += 0.5 * self.dampers[i] * q.x[i].dt().powi(2);
        }
        sum
    }
}

/// One way back serves them all: thirty take about the steps of one, and so are the derivatives.
#[test]
fn many_parameters_take_the_steps_of_one() {
    let value = |k: usize, size: f64| size * (1.0 + 0.3 * (1.7 * k as f64).sin());
    let of = |size: f64| core::array::from_fn(|k| value(k, size));
    let model = Chain { masses: of(1.0), springs: of(40.0), dampers: of(0.3), short: 2.0 };
    let start = model.state().x(core::array::from_fn(|k| 0.1 * (0.9 * k as f64).cos())).build().unwrap();
    let points: Vec<(f64, f64)> =
        (1..=10).map(|k| (0.15 * f64::from(k), 0.02 * (2.1 * f64::from(k)).sin())).collect();
    let asked = || {
        model
            .objective(start)
            .squares("x[5]", 1.0, points.clone())
            .end("x[3]", 0.1)
            .until(1.5)
            .tolerance(1e-10)
    };
    let all = asked().run().unwrap();
    assert_eq!(all.derivatives().len(), 31);
    let names = ["masses[4]", "springs[0]", "dampers[5]", "x[4]", "x_rate[2]"];
    for name in names {
        let one = asked().by([name]).run().unwrap();
        assert!(all.steps < 2 * one.steps, "{name}: {} {}", all.steps, one.steps);
        let (one, all) = (one.get(name).unwrap(), all.get(name).unwrap());
        assert!((one / all - 1.0).abs() < 1e-8, "{name}: {one} {all}");
    }
    let times: Vec<f64> = points.iter().map(|point| point.0).collect();
    let forward =
        model.sensitivities(start).by(names).until(1.5).output_times(times).tolerance(1e-10).run().unwrap();
    for name in names {
        let last = forward.series("x[5]", name).unwrap();
        let squares: f64 = (last.iter().zip(&points))
            .map(|((t, by), (_, y))| 2.0 * by * (forward.motion.at(*t).q[5] - y))
            .sum();
        let expected = squares + 0.1 * forward.series("x[3]", name).unwrap().last().unwrap().1;
        let found = all.get(name).unwrap();
        assert!((found / expected - 1.0).abs() < 1e-8, "{name}: {found} {expected}");
    }
}

/// A fixed step among the options: sensitivities, gradients and fits are those of such motions, within their
/// errors.
#[test]
fn motions_of_a_fixed_step_have_them_too() {
    let model = Oscillator::PLAIN;
    let start = model.state().x(0.3).build().unwrap();
    let closed = |t: f64| difference(0.05, |h| Oscillator::closed([2.0, 1.2, 50.0 + h, 0.3, 0.0], t)[0]);
    let forward = model.sensitivities(start).by(["stiffness"]).until(2.05).output_times([2.05]);
    let forward = forward.with(|s| s.method(methods::Rk4).fixed_step(0.01)).run().unwrap();
    let back = model.objective(start).end("x", 1.0).until(2.05);
    let back = back.with(|s| s.method(methods::Rk4).fixed_step(0.01)).run().unwrap();
    let (one, other) = (forward.series("x", "stiffness").unwrap()[0].1, back.get("stiffness").unwrap());
    assert!((one / closed(2.05) - 1.0).abs() < 1e-5, "{one} {}", closed(2.05));
    assert!((one / other - 1.0).abs() < 1e-8, "{one} {other}");
    // Tolerances of their own are those of the equations beside the motion, and data may be smaller than 1.
    let fixed = |tolerance: f64| {
        let asked = model.objective(start).end("x", 1.0).until(2.05).tolerance(tolerance);
        asked.with(|s| s.method(methods::Rk4).fixed_step(0.01)).run()
    };
    assert!((fixed(1e-12).unwrap().get("stiffness").unwrap() / other - 1.0).abs() < 1e-8);
    for tolerance in [-1.0, 0.0, f64::NAN] {
        let error = fixed(tolerance).err().unwrap_or_else(|| panic!("{tolerance} was taken")).to_string();
        assert!(error.contains("give a tolerance above 0"), "{error}");
    }
    let data: Vec<(f64, f64)> = (1..=40)
        .map(|k| 0.05 * f64::from(k))
        .map(|t| (t, Oscillator::closed([2.0, 1.2, 50.0, 0.3, 0.0], t)[0]))
        .collect();
    let guess = Oscillator { stiffness: 45.0, ..Oscillator::PLAIN };
    for tolerance in [None, Some(1e-10)] {
        let fit = guess.fit(start).find(["stiffness"]).data("x", data.clone());
        let fit = fit.with(|s| s.method(methods::Rk4).fixed_step(0.01));
        let fit = tolerance.into_iter().fold(fit, |fit, tolerance| fit.tolerance(tolerance)).run();
        let found = fit.unwrap().get("stiffness").unwrap().value;
        assert!((found - 50.0).abs() < 1e-4, "{found}");
    }
}

/// An output that grows by e within a hundredth of a parameter's size: differences are as short as they have
/// to be.
#[test]
fn outputs_that_are_sharp_in_a_parameter_keep_their_digits() {
    for width in [0.1, 0.025, 0.01, 0.007, 0.003] {
        let model = Gate { mass: 1.0, level: 0.7, width };
        let start = model.state().x(0.3).build().unwrap();
        let found = model.objective(start).end("open", 1.0).by(["level"]).until(0.4).run().unwrap();
        let forward = model.sensitivities(start).by(["level"]).until(0.4).output_times([0.4]).run().unwrap();
        let exact = (0.7 / width).exp() / width;
        let both = [found.get("level").unwrap(), forward.series("open", "level").unwrap()[0].1];
        assert!(both.iter().all(|by| (by / exact - 1.0).abs() < 2e-10), "{width}: {both:?} {exact}");
    }
}

/// What flows through a gate.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Gate {
    mass: f64,
    level: f64,
    width: f64,
}

#[dynamics]
impl Gate {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[output]
    fn open(&self, _q: &Coordinates<Self>) -> Expr {
        Expr::from(1.0) * (self.level / self.width).exp()
    }
}
