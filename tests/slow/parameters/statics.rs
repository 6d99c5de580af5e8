//! Equilibria and natural frequencies by parameters, against closed forms; folds and equal frequencies.

use dynamics::analysis::{EquilibriumError, FrequencyChange, LinearizeError, SensitivityError};
use dynamics::prelude::*;

use super::models::{Angle, Oscillator, once, twice};
use super::shaken::{STILL, Shaken};
use super::turned_hoop::TurnedHoop;

#[test]
fn a_pushed_pendulum_leans_as_tan_theta_says() {
    let (mass, length, g, push) = (0.4_f64, 1.3_f64, 9.81, 0.9);
    let theta = (push / (mass * g)).atan();
    let by_push = theta.cos().powi(2) / (mass * g);
    let angle = Angle { mass, length, g, push };
    let state = angle.equilibrium(&angle.state().theta(0.1).build().unwrap()).unwrap().state;
    let by = |name| angle.equilibrium_by(&state, name).unwrap();
    assert!((by("push").by[0] / by_push - 1.0).abs() < 1e-10, "{}", by("push").by);
    assert!((by("mass").by[0] + by_push * push / mass).abs() < 1e-10);
    assert!(by("length").by[0].abs() < 1e-10 && by("push").conditioning < 5.0);
    macro_rules! check {
        ($module:ident) => {{
            let bob = $module::Bob { mass, length, g, push };
            let start = bob.state().x(0.5).y(-1.2).build().unwrap();
            let state = bob.equilibrium(&start).unwrap().state;
            let by = |name| bob.equilibrium_by(&state, name).unwrap().by;
            let (sin, cos) = theta.sin_cos();
            for (found, expected) in [
                (by("push"), [length * cos * by_push, length * sin * by_push]),
                (by("length"), [sin, -cos]),
                (by("g"), [-length * cos * by_push * push / g, -length * sin * by_push * push / g]),
            ] {
                for i in 0..2 {
                    assert!(
                        (found[i] - expected[i]).abs() < 1e-9,
                        "{}: {found} {expected:?}",
                        stringify!($module)
                    );
                }
            }
        }};
    }
    check!(once);
    check!(twice);
}

/// cos θ = g/(R Ω²) aside, where ω² = Ω² − (g/R)²/Ω²: the equilibrium moves with the speed, and stiffness
/// with it.
#[test]
fn frequencies_follow_their_equilibrium() {
    let (g, radius, speed) = (9.81, 0.5, 7.0_f64);
    let hoop = TurnedHoop { drag: 0.0, m: 0.1, g, radius, speed };
    let theta = (g / (radius * speed * speed)).acos();
    let state = hoop.equilibrium(&hoop.state().theta(theta + 0.05).build().unwrap()).unwrap().state;
    let by = hoop.equilibrium_by(&state, "speed").unwrap().by[0];
    let expected = 2.0 * g / (radius * speed.powi(3) * theta.sin());
    assert!((by / expected - 1.0).abs() < 1e-10, "{by} {expected}");
    let found = hoop.frequencies_by(&state, "speed").unwrap();
    let expected = 2.0 * speed + 2.0 * (g / radius).powi(2) / speed.powi(3);
    assert!((found[0].square_by / expected - 1.0).abs() < 1e-9, "{found:?} {expected}");
    let none = hoop.frequencies_by(&state, "m").unwrap();
    assert!(none[0].square_by.abs() < 1e-9, "{none:?}");
}

/// Two masses on springs of their own and one between them.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 2])]
#[units(mass: kg, spring: N / m, between: N / m, drag: N * s / m)]
struct Pair {
    mass: [f64; 2],
    spring: f64,
    between: f64,
    drag: f64,
}

#[dynamics]
impl Pair {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass[0] * q.x[0].dt().powi(2) + 0.5 * self.mass[1] * q.x[1].dt().powi(2)
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.spring * (q.x[0].powi(2) + q.x[1].powi(2)) + 0.5 * self.between * (q.x[0] - q.x[1]).powi(2)
    }
    #[dissipation]
    fn air(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.drag * q.x[0].dt().powi(2)
    }
}

#[test]
fn frequencies_of_a_pair_and_how_equal_ones_part() {
    let pair = Pair { mass: [2.0, 2.0], spring: 30.0, between: 5.0, drag: 0.0 };
    let rest = pair.state().build().unwrap();
    let found = pair.frequencies_by(&rest, "between").unwrap();
    let squares: Vec<f64> = found.iter().map(|f| f.square).collect();
    assert!((squares[0] - 15.0).abs() < 1e-12 && (squares[1] - 20.0).abs() < 1e-12);
    // Both masses move alike in the first: half of the second's part.
    let near = |x: f64, y: f64| assert!((x - y).abs() < 1e-10, "{x} {y}");
    near(found[0].square_by, 0.0);
    near(found[1].square_by, 1.0);
    near(found[1].frequency_by, 0.5 / 20f64.sqrt());
    for (change, square) in pair.frequencies_by(&rest, "mass[1]").unwrap().iter().zip([15.0, 20.0]) {
        near(change.square_by, -square * 0.25);
        assert_eq!(change.multiplicity, 1);
    }
    // Uncoupled, both are equal: each in its own way along each parameter.
    let apart = Pair { between: 0.0, ..pair.clone() };
    let ways = |name| apart.frequencies_by(&rest, name).unwrap();
    let of = |found: &[FrequencyChange]| [found[0].square_by, found[1].square_by];
    let [first, second] = of(&ways("between"));
    near(first, 0.0);
    near(second, 1.0);
    let [first, second] = of(&ways("mass[0]"));
    near(first, -7.5);
    near(second, 0.0);
    assert!(ways("between").iter().all(|change| change.multiplicity == 2));
}

#[test]
fn what_has_no_derivative_is_refused() {
    let damped = Pair { mass: [2.0, 2.0], spring: 30.0, between: 5.0, drag: 0.1 };
    let rest = damped.state().build().unwrap();
    let error = damped.frequencies_by(&rest, "between").unwrap_err();
    assert!(matches!(error, SensitivityError::NotConservative { part } if part > 1e-3), "{error}");
    // At the critical speed the bottom of the hoop is a pitchfork: nothing resists, but for what rounding
    // leaves.
    for radius in (0..40).map(|k| 0.1 + 0.037 * f64::from(k)) {
        let hoop = TurnedHoop { drag: 0.0, m: 0.13, g: 9.81, radius, speed: (9.81_f64 / radius).sqrt() };
        let error = hoop.equilibrium_by(&hoop.state().build().unwrap(), "speed").unwrap_err();
        assert!(matches!(error, SensitivityError::Fold { coordinate: "theta", .. }), "{error}");
    }
    let oscillator = Oscillator::PLAIN;
    let aside = oscillator.state().x(0.1).build().unwrap();
    let error = oscillator.equilibrium_by(&aside, "stiffness").unwrap_err();
    assert!(
        matches!(error, SensitivityError::Linearize(LinearizeError::Accelerates { name: "x", .. })),
        "{error}"
    );
    let error = oscillator.equilibrium_by(&oscillator.state().build().unwrap(), "x").unwrap_err();
    assert!(matches!(error, SensitivityError::Variable(_)), "{error}");
}

/// A mass on a spring beside a wheel on another, each in units of its own.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, theta: rad)]
#[units(mass: kg, inertia: kg * m^2, spring: N / m, wire: N * m / rad, moment: N * m, drag: N * m * s / rad)]
struct Beside {
    mass: f64,
    inertia: f64,
    spring: f64,
    wire: f64,
    moment: f64,
    drag: f64,
}

#[dynamics]
impl Beside {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2) + 0.5 * self.inertia * q.theta.dt().powi(2)
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.spring * q.x.powi(2) + 0.5 * self.wire * q.theta.powi(2) - self.moment * q.theta
    }
    #[dissipation]
    fn air(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.drag * q.theta.dt().powi(2)
    }
}

/// A soft coordinate beside a stiff one is no fold, and its damping is not hidden by the size of the other's
/// terms.
#[test]
fn what_is_small_in_its_unit_counts() {
    for (mass, spring, wire) in [(1.0, 1e6, 1e-3), (1.0, 1e9, 1e-2), (1e6, 1e12, 1e-3)] {
        let soft = Beside { mass, inertia: 1e-3, spring, wire, moment: 0.2 * wire, drag: 0.0 };
        let state = soft.state().theta(0.2).build().unwrap();
        let change = soft.equilibrium_by(&state, "moment").unwrap();
        assert!((change.by[1] * wire - 1.0).abs() < 1e-9 && change.by[0] == 0.0, "{change:?}");
        assert!((1.0..5.0).contains(&change.conditioning), "{change:?}");
        let first = soft.frequencies_by(&state, "wire").unwrap()[0];
        assert!(
            (first.square / (wire / 1e-3) - 1.0).abs() < 1e-9 && (first.square_by / 1e3 - 1.0).abs() < 1e-9
        );
        // 2 ζ ω = 2 ω: damped as strongly as it can be and still swing.
        let damped = Beside { drag: 2.0 * (wire * 1e-3).sqrt(), ..soft };
        let error = damped.frequencies_by(&state, "wire").unwrap_err();
        assert!(
            matches!(error, SensitivityError::NotConservative { part } if (part - 2.0).abs() < 1e-9),
            "{error}"
        );
    }
}

#[test]
fn forces_that_change_with_time_leave_no_equilibrium_to_change() {
    let refused = |model: &Shaken, x: f64, name: &str| {
        let error = model.equilibrium_by(&model.state().x(x).build().unwrap(), name).unwrap_err();
        let of_time = matches!(
            error,
            SensitivityError::Equilibrium(EquilibriumError::DependsOnTime { coordinate: "x", .. })
        );
        assert!(of_time, "{name}: {error}");
    };
    // In balance at t = 0 alone: by cos 2t at x = 0.5, by sin 3t at 0.
    refused(&Shaken { even: 0.5, ..STILL }, 0.5, "stiffness");
    refused(&Shaken { even: 0.5, ..STILL }, 0.5, "even");
    refused(&Shaken { odd: 0.3, load: 0.3, cubic: 1.0, ..STILL }, 0.0, "pull");
    // In balance at all times, but with no other value of the parameter.
    refused(&STILL, 0.0, "even");
    refused(&STILL, 0.0, "odd");
    refused(&STILL, 0.0, "late");
    // What does not shake it has a derivative, though time stands in the model.
    let by = STILL.equilibrium_by(&STILL.state().build().unwrap(), "pull").unwrap();
    assert!((by.by[0] - 1.0).abs() < 1e-12, "{by:?}");
}
