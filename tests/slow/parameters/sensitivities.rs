//! Sensitivities of motions against closed forms, against differences of whole motions, and in other
//! coordinates.

use dynamics::analysis::Sensitivities;
use dynamics::constrain::{project_velocities, with_workspace};
use dynamics::model::Vector as _;
use dynamics::model::{Model, Parameters};
use dynamics::prelude::*;

use super::difference;
use super::double_pendulum::DoublePendulum;
use super::models::{Angle, Oscillator, once, twice};
use super::rolling_disk::{DISK, Disk};

/// The largest difference between two curves, as a part of the largest of them.
fn off(one: &[(f64, f64)], other: impl Fn(f64) -> f64) -> f64 {
    assert!(one.len() > 1);
    let largest = one.iter().map(|(_, x)| x.abs()).fold(0.0, f64::max);
    assert!(largest > 0.0);
    one.iter().map(|(t, x)| (x - other(*t)).abs() / largest).fold(0.0, f64::max)
}

#[test]
fn a_damped_oscillator_has_the_derivatives_of_its_closed_form() {
    let model = Oscillator::PLAIN;
    let start = model.state().x(0.3).x_rate(-0.4).build().unwrap();
    let p = [2.0, 1.2, 50.0, 0.3, -0.4];
    let by = ["mass", "damping", "stiffness", "x", "x_rate"];
    for (tolerance, within) in [(1e-6, 1e-5), (1e-9, 1e-8), (1e-12, 2e-11)] {
        let found = model.sensitivities(start).by(by).until(4.0).tolerance(tolerance).run().unwrap();
        assert!(found.exact);
        for (k, name) in by.iter().enumerate() {
            for (i, quantity) in ["x", "x_rate"].iter().enumerate() {
                let closed = |t: f64| {
                    difference(if p[k] == 0.0 { 2e-4 } else { 2e-4 * p[k] }, |h| {
                        let mut p = p;
                        p[k] += h;
                        Oscillator::closed(p, t)[i]
                    })
                };
                let off = off(&found.series(quantity, name).unwrap(), closed);
                assert!(off < within, "∂{quantity}/∂{name} at {tolerance}: {off:e}");
            }
        }
    }
}

/// Outputs contain the parameter itself, too.
#[test]
fn outputs_follow_state_and_parameter() {
    let model = Oscillator::PLAIN;
    let start = model.state().x(0.3).build().unwrap();
    let by = ["damping", "stiffness", "x"];
    let found = model.sensitivities(start).by(by).until(3.0).tolerance(1e-12).run().unwrap();
    let p = [2.0, 1.2, 50.0, 0.3, 0.0];
    for (name, k) in by.iter().zip([1, 2, 3]) {
        let closed = |of: usize, t: f64| {
            difference(if p[k] == 0.0 { 2e-4 } else { 2e-4 * p[k] }, |h| {
                let mut p = p;
                p[k] += h;
                let [x, v] = Oscillator::closed(p, t);
                [p[2] * x + p[1] * v, p[1] * v * v][of]
            })
        };
        for (of, output) in ["pull", "power"].iter().enumerate() {
            let off = off(&found.series(output, name).unwrap(), |t| closed(of, t));
            assert!(off < 1e-9, "∂{output}/∂{name}: {off:e}");
        }
    }
}

#[test]
fn a_double_pendulum_has_the_differences_of_its_motions() {
    let model = DoublePendulum { m1: 1.0, m2: 0.7, l1: 1.0, l2: 0.8, g: 9.81 };
    let start = model.state().theta1(1.2).theta2(-0.4).theta1_rate(0.5).build().unwrap();
    let times: Vec<f64> = (0..=8).map(|k| 0.25 * f64::from(k)).collect();
    let by = ["m1", "m2", "l1", "l2", "g", "theta1", "theta2_rate"];
    let asked = model.sensitivities(start).by(by).until(2.0).tolerance(1e-12).output_times(times.clone());
    let found = asked.run().unwrap();
    assert_eq!(found.times(), times);
    for (k, name) in by.iter().enumerate() {
        let moved = |h: f64, t: f64| {
            let (mut model, mut start) = (model.clone(), start);
            match k {
                0..5 => assert!(model.set_parameter(k, model.parameter(k).unwrap() + h)),
                5 => start.q[0] += h,
                _ => start.u[1] += h,
            }
            model.simulate(start).until(2.0).tolerance(1e-13).run().unwrap().at(t).q[1]
        };
        let off = off(&found.series("theta2", name).unwrap(), |t| difference(2e-3, |h| moved(h, t)));
        assert!(off < 2e-8, "∂theta2/∂{name}: {off:e}");
    }
}

/// With the rod once the solution is generated, with the rod twice it is not: both ways give what the angle
/// gives.
#[test]
fn constrained_coordinates_change_as_the_angle_does() {
    let angle = Angle { mass: 0.4, length: 1.3, g: 9.81, push: 0.5 };
    let theta = 0.9_f64;
    let (end, tolerance) = (3.0, 1e-11);
    let times: Vec<f64> = (0..=30).map(|k| 0.1 * f64::from(k)).collect();
    let start = angle.state().theta(theta).theta_rate(0.7).build().unwrap();
    let by = ["length", "mass", "push", "g"];
    let in_angle =
        angle.sensitivities(start).by(by).until(end).tolerance(tolerance).output_times(times.clone());
    let in_angle = in_angle.run().unwrap();
    macro_rules! check {
        ($module:ident, $exact:expr, $within:expr) => {{
            let bob = $module::Bob { mass: 0.4, length: 1.3, g: 9.81, push: 0.5 };
            let (sin, cos) = theta.sin_cos();
            let [x, y] = [1.3 * sin, -1.3 * cos];
            let start =
                bob.state().x(x).y(y).x_rate(1.3 * 0.7 * cos).y_rate(1.3 * 0.7 * sin).build().unwrap();
            let found =
                bob.sensitivities(start).by(by).until(end).tolerance(tolerance).output_times(times.clone());
            let found = found.run().unwrap();
            assert_eq!(found.exact, $exact);
            // What keeps its velocity while the rod grows turns more slowly: the start in angles moves with
            // it.
            let rate = in_angle_rate(&angle, in_angle.motion.start(), &times);
            for name in by {
                let extra = |t: f64| if name == "length" { -0.7 / 1.3 * rate(t) } else { 0.0 };
                for (quantity, output) in [("x", "place.x"), ("y", "place.y")] {
                    let expected = in_angle.series(output, name).unwrap();
                    let by_angle = |t: f64| {
                        let state = in_angle.motion.at(t);
                        let k = times.iter().position(|time| *time == t).unwrap();
                        let lever = if quantity == "x" {
                            1.3 * state.theta().cos()
                        } else {
                            1.3 * state.theta().sin()
                        };
                        expected[k].1 + lever * extra(t)
                    };
                    let off = off(&found.series(quantity, name).unwrap(), by_angle);
                    assert!(off < $within, "{}: ∂{quantity}/∂{name}: {off:e}", stringify!($module));
                }
                for k in 0..times.len() {
                    let (state, by) = (found.motion.at(times[k]), found.matrix(k).unwrap());
                    let column = by_names(&by_column(&found, name), by);
                    let left = state.x() * column[0] + state.y() * column[1]
                        - if name == "length" { 1.3 } else { 0.0 };
                    let size = column.iter().map(|x| x.abs()).fold(1.0, f64::max);
                    assert!(left.abs() < 1e-9 * size, "off the constraint by {left:e}");
                }
            }
        }};
    }
    check!(once, true, 1e-8);
    check!(twice, false, 1e-8);
}

/// ∂θ(t)/∂θ̇₀.
fn in_angle_rate(
    angle: &Angle,
    start: <Angle as Model>::State,
    times: &[f64],
) -> impl Fn(f64) -> f64 + use<> {
    let asked = angle.sensitivities(start).by(["theta_rate"]).until(3.0).tolerance(1e-11);
    let series =
        asked.output_times(times.iter().copied()).run().unwrap().series("theta", "theta_rate").unwrap();
    move |t| series.iter().find(|(time, _)| *time == t).unwrap().1
}

fn by_column<M: Simulate + Parameters + Clone>(found: &Sensitivities<'_, M>, name: &str) -> usize {
    found.variables().iter().position(|v| v.name::<M>() == name).unwrap()
}

fn by_names(column: &usize, matrix: &nalgebra::DMatrix<f64>) -> Vec<f64> {
    matrix.column(*column).iter().copied().collect()
}

/// Rolling leaves families of starts: they move as velocities are put onto the constraints.
#[test]
fn a_rolling_disk_has_the_differences_of_its_motions() {
    let start =
        DISK.state().lean(0.3).yaw(0.1).yaw_rate(0.4).lean_rate(0.1).spin_rate(1.5).assemble().unwrap();
    let found = DISK.sensitivities(start).by(["r", "g", "lean"]).until(1.5).tolerance(1e-11).run().unwrap();
    let end = found.times().len() - 1;
    for (column, name) in ["r", "g", "lean"].iter().enumerate() {
        let moved = |h: f64, i: usize| {
            let (mut model, mut start) = (DISK, start);
            match column {
                0 => model.r += h,
                1 => model.g += h,
                _ => start.q[3] += h,
            }
            let constants = model.constants().unwrap();
            with_workspace::<Disk, _>(|memory| project_velocities(&model, &constants, &mut start, memory))
                .unwrap();
            model.simulate(start).until(1.5).tolerance(1e-12).run().unwrap().end().q[i]
        };
        for i in 0..5 {
            let (by, expected) = (found.matrix(end).unwrap()[(i, column)], difference(1e-3, |h| moved(h, i)));
            assert!((by - expected).abs() < 1e-7 * (1.0 + expected.abs()), "{name}, {i}: {by} {expected}");
        }
    }
    assert_eq!(found.matrix(end).unwrap().shape(), (2 * nalgebra::SVector::<f64, 5>::LEN, 3));
}

/// A torque that follows the angle, as a law of inputs, and as a spring of the model.
mod law {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(theta: rad)]
    #[inputs(torque: N * m)]
    #[units(inertia: kg * m^2, spring: N * m)]
    struct Shaft {
        inertia: f64,
        spring: f64,
    }
    #[dynamics]
    impl Shaft {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.inertia * q.theta.dt().powi(2)
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            self.spring * (1.0 - q.theta.cos())
        }
        #[force]
        fn drive(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.theta, q.torque)
        }
    }

    fn asked(model: &Shaft) -> dynamics::analysis::Sensitivity<'_, Shaft> {
        let start = model.state().theta(1.1).torque(0.0).build().unwrap();
        model.sensitivities(start).by(["theta", "inertia"]).until(3.0).tolerance(1e-11)
    }

    #[test]
    fn what_follows_the_state_is_differentiated_with_it() {
        let (held, led) = (Shaft { inertia: 0.5, spring: 3.0 }, Shaft { inertia: 0.5, spring: 1.0 });
        let one = asked(&held).run().unwrap();
        let other = asked(&led).with(|simulation| simulation.inputs(|_, state| [-2.0 * state.theta().sin()]));
        let other = other.output_times(one.times().to_vec()).run().unwrap();
        assert!(one.exact && !other.exact);
        for by in ["theta", "inertia"] {
            let expected = one.series("theta", by).unwrap();
            let at = |t: f64| expected.iter().find(|(time, _)| *time == t).unwrap().1;
            let off = off(&other.series("theta", by).unwrap(), at);
            assert!(off < 1e-8, "{by}: {off:e}");
        }
    }
}

/// Backwards, and stiff: the implicit method hands its motion on.
#[test]
fn backwards_and_stiff_motions_have_them_too() {
    let stiff = Oscillator { mass: 1.0, damping: 1e4, stiffness: 1e4 };
    let start = stiff.state().x(1.0).build().unwrap();
    let found = stiff.sensitivities(start).by(["stiffness"]).until(2.0).tolerance(1e-8).run().unwrap();
    // x ≈ e^{−kt/c} with corrections of order k m/c².
    let decay = |c: f64, k: f64, t: f64| {
        let root = (0.25 * c * c - k).sqrt();
        let (slow, fast) = (-k / (0.5 * c + root), -0.5 * c - root);
        (fast * (slow * t).exp() - slow * (fast * t).exp()) / (fast - slow)
    };
    let off_stiff =
        off(&found.series("x", "stiffness").unwrap(), |t| difference(10.0, |h| decay(1e4, 1e4 + h, t)));
    assert!(off_stiff < 1e-5, "{off_stiff:e}");
    assert!(found.steps < 2000, "{}", found.steps);

    let model = Oscillator::PLAIN;
    let start = model.state().x(0.3).build().unwrap();
    let found = model.sensitivities(start).by(["stiffness"]).until(-1.0).tolerance(1e-11).run().unwrap();
    let closed = |t: f64| difference(0.05, |h| Oscillator::closed([2.0, 1.2, 50.0 + h, 0.3, 0.0], t)[0]);
    assert!(off(&found.series("x", "stiffness").unwrap(), closed) < 1e-9);
}

/// A parameter near zero has no size of its own to take steps by: its derivatives are those at zero.
#[test]
fn parameters_near_zero_have_the_derivatives_of_zero() {
    let end = 1.0;
    let (omega, x) = (5.0_f64, 0.3);
    let (sin, cos) = (omega * end).sin_cos();
    let position = x * (sin / omega - end * cos) / 4.0;
    let pull = 50.0 * position - x * omega * sin;
    for damping in [0.0, 1e-16, 1e-13, 1e-10] {
        let model = Oscillator { damping, ..Oscillator::PLAIN };
        let start = model.state().x(x).build().unwrap();
        let found = model.sensitivities(start).by(["damping"]).until(end).output_times([end]).run().unwrap();
        for (name, expected) in [("x", position), ("pull", pull)] {
            let value = found.series(name, "damping").unwrap()[0].1;
            assert!((value / expected - 1.0).abs() < 1e-8, "{name} at {damping}: {value} {expected}");
        }
    }
    let by = |push: f64| {
        let bob = twice::Bob { mass: 1.0, length: 1.0, g: 9.81, push };
        let start = bob.state().x(0.6).y(-0.8).build().unwrap();
        let found = bob.sensitivities(start).by(["push"]).until(end).output_times([end]).run().unwrap();
        assert!(!found.exact);
        found.series("x", "push").unwrap()[0].1
    };
    let expected = by(0.0);
    for push in [1e-16, 1e-13, 1e-10] {
        assert!((by(push) / expected - 1.0).abs() < 1e-8, "{push}: {} {expected}", by(push));
    }
}

/// A ball among waves that are a thousandth of a thousandth long.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Waves {
    mass: f64,
    aside: f64,
}

#[dynamics]
impl Waves {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn waves(&self, q: &Coordinates<Self>) -> Expr {
        1e-6 * (1e6 * (q.x - self.aside)).cos()
    }
    #[output]
    fn slope(&self, q: &Coordinates<Self>) -> Expr {
        (1e6 * (q.x - self.aside)).sin()
    }
}

/// A parameter that is zero says nothing of the step that differences of outputs and equilibria may take.
#[test]
fn parameters_that_are_zero_may_belong_to_something_small() {
    let model = Waves { mass: 1.0, aside: 0.0 };
    let start = model.state().x(0.4e-6).build().unwrap();
    let found = model.sensitivities(start).by(["aside"]).until(1e-9).output_times([0.0]).run().unwrap();
    let value = found.series("slope", "aside").unwrap()[0].1;
    assert!((value / (-1e6 * 0.4_f64.cos()) - 1.0).abs() < 1e-8, "{value}");
    let trough = model.state().x(1e-6 * std::f64::consts::PI).build().unwrap();
    let by = model.equilibrium_by(&trough, "aside").unwrap().by[0];
    assert!((by - 1.0).abs() < 1e-8, "{by}");
}
