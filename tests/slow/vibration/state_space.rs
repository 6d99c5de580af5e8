//! A, B, C, D against hand results, and against differences of the nonlinear model's own outputs.

use dynamics::analysis::{LinearizeError, SignalUnavailable, VibrationError};
use dynamics::prelude::*;

use crate::models::{CartPole, Oscillator, RodCart};

use crate::bicycle_model as bicycle;

#[test]
fn matrices_of_an_oscillator() {
    let model = Oscillator { m: 3.0, c: 0.6, k: 12.0 };
    let space = model.space();
    let names = |signals: &[dynamics::analysis::Signal]| {
        signals.iter().map(|s| format!("{}|{}", s.name, s.unit)).collect::<Vec<_>>()
    };
    assert_eq!(names(&space.states), ["x|m", "x_rate|m/s"]);
    assert_eq!(names(&space.inputs), ["force|N", "base|m", "base_rate|m/s", "x|N"]);
    assert_eq!(
        names(&space.outputs),
        ["to_ground|N", "felt|m/s^2", "x|m", "x_rate|m/s", "x_acceleration|m/s^2"]
    );
    let wanted = |rows: usize, columns: usize, values: &[f64]| {
        nalgebra::DMatrix::from_row_slice(rows, columns, values)
    };
    let close =
        |a: &nalgebra::DMatrix<f64>, b: nalgebra::DMatrix<f64>| assert!((a - &b).amax() < 1e-15, "{a} {b}");
    close(&space.a, wanted(2, 2, &[0.0, 1.0, -4.0, -0.2]));
    close(&space.b, wanted(2, 4, &[0.0, 0.0, 0.0, 0.0, 1.0 / 3.0, 4.0, 0.2, 1.0 / 3.0]));
    close(&space.c, wanted(5, 2, &[12.0, 0.6, -4.0, -0.2, 1.0, 0.0, 0.0, 1.0, -4.0, -0.2]));
    let third = 1.0 / 3.0;
    close(
        &space.d,
        wanted(
            5,
            4,
            &[
                0.0, -12.0, -0.6, 0.0, third, 4.0, 0.2, third, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, third,
                4.0, 0.2, third,
            ],
        ),
    );
}

/// Outputs, reactions and accelerations among them, of states beside the reference, on the constraints,
/// against C and D: two routes that share no derivative.
#[test]
fn outputs_with_reactions_against_differences() {
    let model = RodCart { cart: 2.0, bob: 0.7, length: 0.5, g: 9.81 };
    let state = |angle: f64, rate: f64, x: f64, x_rate: f64, force: f64| {
        let (sin, cos) = angle.sin_cos();
        let built = model.state().x(x).bob_x(x + 0.5 * sin).bob_y(-0.5 * cos);
        let built = built.x_rate(x_rate).bob_x_rate(x_rate + 0.5 * rate * cos).bob_y_rate(0.5 * rate * sin);
        built.force(force).build().unwrap()
    };
    let space = model.state_space(&state(0.0, 0.0, 0.2, 0.0, 0.0)).unwrap();
    let outputs = |s: &State<RodCart>| {
        let mut values = [0.0; 4];
        model.outputs(s, &mut values).unwrap();
        values
    };
    let names: Vec<&str> = space.states.iter().map(|s| s.name.as_str()).collect();
    // x and bob_x are independent where the rod hangs; bob_x = x + ½ sin θ.
    assert_eq!(names, ["x", "bob_x", "x_rate", "bob_x_rate"]);
    let h = 1e-4;
    let along = |column: usize, d: f64| match column {
        0 => state((-d / 0.5f64).asin(), 0.0, 0.2 + d, 0.0, 0.0),
        1 => state((d / 0.5f64).asin(), 0.0, 0.2, 0.0, 0.0),
        2 => state(0.0, -d / 0.5, 0.2, d, 0.0),
        _ => state(0.0, d / 0.5, 0.2, 0.0, 0.0),
    };
    let mut largest = 0.0f64;
    for column in 0..4 {
        let (plus, minus) = (outputs(&along(column, h)), outputs(&along(column, -h)));
        for row in 0..4 {
            let wanted = (plus[row] - minus[row]) / (2.0 * h);
            assert!(
                (space.c[(row, column)] - wanted).abs() < 3e-6 * (1.0 + wanted.abs()),
                "{row} {column}: {} {wanted}",
                space.c[(row, column)]
            );
            largest = largest.max(wanted.abs());
        }
    }
    assert!(largest > 10.0);
    for row in 0..4 {
        let wanted = (outputs(&state(0.0, 0.0, 0.2, 0.0, h))[row]
            - outputs(&state(0.0, 0.0, 0.2, 0.0, -h))[row])
            / (2.0 * h);
        assert!((space.d[(row, 0)] - wanted).abs() < 1e-8, "{row}: {} {wanted}", space.d[(row, 0)]);
    }
}

/// Minimal coordinates and a constraint: one response.
#[test]
fn constraints_change_no_response() {
    let pole = CartPole { cart: 2.0, bob: 0.7, length: 0.5, g: 9.81 };
    let rod = RodCart { cart: 2.0, bob: 0.7, length: 0.5, g: 9.81 };
    let hanging =
        pole.state_space(&pole.state().theta(std::f64::consts::PI).force(0.0).build().unwrap()).unwrap();
    let on_rod = rod.state_space(&rod.state().bob_y(-0.5).force(0.0).build().unwrap()).unwrap();
    for frequency in [0.3, 4.0, 7.0] {
        let a = hanging.frequency_response("force", "x", &[frequency]).unwrap().values[0];
        let b = on_rod.frequency_response("force", "x", &[frequency]).unwrap().values[0];
        let pushed = on_rod.frequency_response("x", "x", &[frequency]).unwrap().values[0];
        assert!((a - b).norm() < 1e-13 * a.norm() && (b - pushed).norm() < 1e-15, "{a} {b}");
        // By hand: (M + m) ẍ + m l φ̈ = F, ẍ + l φ̈ + g φ = 0.
        let s = -frequency * frequency;
        let wanted = (0.5 * s + 9.81) / (s * ((2.7) * (0.5 * s + 9.81) - 0.7 * 0.5 * s));
        assert!((a.re - wanted).abs() < 1e-13 * wanted.abs() && a.im.abs() < 1e-13 * wanted.abs());
    }
}

mod redundant {
    use super::*;

    /// A mass on a rail that says so twice.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[inputs(lift: N)]
    #[units(m: kg, k: N / m)]
    pub(super) struct Rail {
        pub(super) m: f64,
        pub(super) k: f64,
    }
    #[dynamics]
    impl Rail {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * (q.x.powi(2) + q.y.powi(2))
        }
        #[force]
        fn crane(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.y, q.lift)
        }
        #[holonomic]
        fn rail(&self, q: &Coordinates<Self>) -> Expr {
            q.y
        }
        #[holonomic]
        #[redundant]
        fn again(&self, q: &Coordinates<Self>) -> Expr {
            2.0 * q.y
        }
        #[output]
        fn one(&self, q: &Coordinates<Self>) -> Expr {
            q.reaction(Self::rail)
        }
        #[output]
        fn both(&self, q: &Coordinates<Self>) -> Expr {
            q.reaction(Self::rail) + 2.0 * q.reaction(Self::again)
        }
    }
}

#[test]
fn reactions_that_are_not_unique_are_no_outputs_but_what_is_unique_of_them() {
    let model = redundant::Rail { m: 2.0, k: 8.0 };
    let space = model.state_space(&model.state().lift(0.0).build().unwrap()).unwrap();
    let found = space.frequency_response("lift", "both", &[1.0]).unwrap().values[0];
    assert!((found.re + 1.0).abs() < 1e-14 && found.im == 0.0, "{found}");
    let refused = space.frequency_response("lift", "one", &[1.0]).unwrap_err();
    assert_eq!(refused, VibrationError::NoRow { name: "one".into(), why: SignalUnavailable::NotUnique });
    assert!(refused.to_string().contains("not unique"));
}

#[test]
fn names_that_are_not_known_get_a_hint_and_moving_states_are_refused() {
    let model = Oscillator::damped(0.1);
    let space = model.space();
    let unknown = space.frequency_response("forse", "x", &[1.0]).unwrap_err();
    assert!(unknown.to_string().contains("did you mean `force`?"), "{unknown}");
    let unknown = space.frequency_response("force", "x_rat", &[1.0]).unwrap_err();
    assert!(unknown.to_string().contains("did you mean `x_rate`?"), "{unknown}");
    let beside = model.state().x(0.1).force(0.0).base(0.0).base_rate(0.0).build().unwrap();
    assert!(matches!(
        model.state_space(&beside),
        Err(VibrationError::Linearize(LinearizeError::Accelerates { .. }))
    ));
}

mod blown {
    use super::*;

    /// A bob on a rod, in the plane, blown aside against a spring.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[inputs(wind: N)]
    #[units(m: kg, k: N / m, length: m, g: m / s^2)]
    pub(super) struct Blown {
        pub(super) m: f64,
        pub(super) k: f64,
        pub(super) length: f64,
        pub(super) g: f64,
    }
    #[dynamics]
    impl Blown {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn potential(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * q.x.powi(2) + self.m * self.g * q.y
        }
        #[force]
        fn blow(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, q.wind)
        }
        #[holonomic]
        fn rod(&self, q: &Coordinates<Self>) -> Expr {
            q.x.powi(2) + q.y.powi(2) - self.length.powi(2)
        }
        #[output]
        fn tension(&self, q: &Coordinates<Self>) -> Expr {
            -2.0 * self.length * q.reaction(Self::rod)
        }
    }
}

/// T = m g cos θ + (F − k l sin θ) sin θ + m l θ̇²: beside an equilibrium ∂T/∂x = −k sin θ, ∂T/∂F = sin θ.
#[test]
fn the_tension_of_a_rod_that_leans() {
    let model = blown::Blown { m: 2.0, k: 30.0, length: 0.5, g: 9.81 };
    let start = model.state().x(0.2).y(-(0.25f64 - 0.04).sqrt()).wind(25.0).build().unwrap();
    let rest = model.equilibrium(&start).unwrap().state;
    let space = model.state_space(&rest).unwrap();
    assert_eq!(space.states[0].name, "x");
    let sin = rest.x() / 0.5;
    assert!(sin > 0.3);
    let row = space.c.row(0);
    assert!((row[0] + 30.0 * sin).abs() < 1e-7 && row[1].abs() < 1e-12, "{row} {}", -30.0 * sin);
    assert!((space.d[(0, 0)] - sin).abs() < 1e-12 && (space.d[(0, 1)] - sin).abs() < 1e-12);
}

mod corners {
    use super::*;

    /// A hanging mass; outputs with corners, at rest or elsewhere, and with none.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m)]
    #[inputs(force: N)]
    #[units(m: kg, k: N / m, g: m / s^2)]
    pub(super) struct Hung {
        pub(super) m: f64,
        pub(super) k: f64,
        pub(super) g: f64,
    }
    #[dynamics]
    impl Hung {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * q.x.dt().powi(2)
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * q.x.powi(2) - self.m * self.g * q.x
        }
        #[force]
        fn hand(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, q.force)
        }
        #[output]
        fn distance(&self, q: &Coordinates<Self>) -> Expr {
            q.x.abs()
        }
        #[output]
        fn swiftness(&self, q: &Coordinates<Self>) -> Expr {
            q.x.dt().abs()
        }
        #[output]
        fn drag(&self, q: &Coordinates<Self>) -> Expr {
            q.x.dt().abs() * q.x.dt() + 1e3 * q.x.dt().powi(2)
        }
        #[output]
        fn jerked(&self, q: &Coordinates<Self>) -> Expr {
            q.x.dt().dt().max(0.0 * q.x.dt().dt())
        }
    }
}

/// |ẋ| has no derivative at rest; |x| has none where x = 0, |ẋ| ẋ has one everywhere.
#[test]
fn outputs_with_corners_are_refused_there_and_only_there() {
    let at = |g: f64| {
        let model = corners::Hung { m: 2.0, k: 8.0, g };
        model.state_space(&model.state().x(2.0 * g / 8.0).force(0.0).build().unwrap()).unwrap()
    };
    let of = |g: f64, output: &str| {
        at(g).frequency_response("force", output, &[1.0]).map(|found| found.values[0].re)
    };
    assert!(
        (of(9.81, "distance").unwrap() - 1.0 / 6.0).abs() < 1e-15
            && (of(-9.81, "distance").unwrap() + 1.0 / 6.0).abs() < 1e-15
    );
    let corner =
        |name: &str| Err(VibrationError::NoRow { name: name.into(), why: SignalUnavailable::Corner });
    assert_eq!(of(0.0, "distance"), corner("distance"));
    assert_eq!(of(9.81, "swiftness"), corner("swiftness"));
    assert_eq!(of(9.81, "jerked"), corner("jerked"));
    assert_eq!(of(9.81, "drag"), Ok(0.0));
    assert!(of(0.0, "distance").unwrap_err().to_string().contains("corner"));
}

/// Rolling: the rows of rates and accelerations of the independent coordinates are those of A, by another way
/// through the equations.
#[test]
fn a_bicycle_in_state_space() {
    let model = bicycle::model();
    let space = model.state_space(&model.running(4.6)).unwrap();
    let linear = model.linearize(&model.running(4.6)).unwrap();
    assert_eq!(space.a, linear.state_matrix().unwrap());
    let row = |name: &str| space.outputs.iter().position(|s| s.name == name).unwrap();
    let size = space.a.amax();
    for (k, q) in linear.coordinates.iter().enumerate() {
        let rates = space.c.row(row(&format!("{}_rate", q.name)));
        assert!((rates - space.a.row(k)).amax() < 1e-12 * size, "{}", q.name);
    }
    for (k, q) in linear.velocities.iter().enumerate() {
        let found = row(&format!("{}_acceleration", q.name));
        let of = linear.coordinates.len() + k;
        assert!((space.c.row(found) - space.a.row(of)).amax() < 1e-12 * size, "{}", q.name);
        assert!((space.d.row(found) - space.b.row(of)).amax() < 1e-12 * space.b.amax());
    }
    // Every coordinate, dependent ones, too: its rate is the derivative of its place along the small motion,
    // its acceleration that of its rate.
    let along = |row: usize| (space.c.row(row) * &space.a, space.c.row(row) * &space.b);
    let mut largest = 0.0f64;
    for coordinate in linear.all {
        let rows = ["", "_rate", "_acceleration"].map(|suffix| row(&format!("{}{suffix}", coordinate.name)));
        for pair in rows.windows(2) {
            let (c, d) = along(pair[0]);
            assert!((space.c.row(pair[1]) - c).amax() < 1e-10 * size, "{}", coordinate.name);
            assert!((space.d.row(pair[1]) - d).amax() < 1e-10 * space.b.amax(), "{}", coordinate.name);
        }
        let is_free = linear.velocities.iter().any(|q| q.name == coordinate.name);
        largest = largest.max(if is_free {
            0.0
        } else {
            space.c.row(rows[2]).columns(0, linear.coordinates.len()).amax()
        });
    }
    assert!(largest > 1.0, "dependent coordinates accelerate with the places of the others");
    // Both wheels touch the ground: what the constraints hold does not accelerate away from them. A torque on
    // the steer is felt by the frame.
    let push = space.frequency_response("steer", "roll", &[3.0]).unwrap().values[0];
    let back = space.frequency_response("roll", "steer", &[3.0]).unwrap().values[0];
    assert!(push.norm() > 1e-4 && back.norm() > 1e-4);
    // At rest M and K would make them equal (Maxwell); rolling does not.
    assert!((push - back).norm() > 1e-3 * push.norm());
}
