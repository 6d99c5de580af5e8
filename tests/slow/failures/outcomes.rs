//! Where methods fail: each case reports itself with time, state and constraint, and none returns a wrong
//! answer as a success. The outcomes are those of derived models; the runtime's own cases, on models written
//! by hand, are in `dynamics-runtime/tests/`.

use core::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use dynamics::constrain::solve_once;
use dynamics::error::{SolveError, StateError};
use dynamics::kinematics::KinematicsErrorKind;
use dynamics::prelude::*;
use dynamics::simulate::{OptionError, SimulationErrorKind};

/// A pendulum in Cartesian coordinates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, length: m, g: m / s^2)]
struct Pendulum {
    mass: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl Pendulum {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.bob(q).norm_squared() - self.length.powi(2))
    }
}

fn pendulum() -> Pendulum {
    Pendulum { mass: 1.0, length: 1.0, g: 9.81 }
}

mod starts {
    use super::*;

    /// What is eliminated by the constraint leaves a divisor of either sign.
    #[test]
    fn negative_inertia_is_refused_beside_constraints() {
        let model = Pendulum { mass: -1.0, ..pendulum() };
        let start = model.state().x(0.6).y(-0.8).build().unwrap();
        let error = model.simulate(start).until(1.0).run().unwrap_err();
        assert!(error.to_string().contains("has negative inertia at this state"), "{error}");
        assert_eq!(error.time, 0.0);
    }

    /// What a start may miss is a part of its own size, whatever the unit of length.
    #[test]
    fn starts_are_judged_by_their_size() {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(x: m, y: m)]
        #[units(mass: kg, length: m)]
        struct Sling {
            mass: f64,
            length: f64,
        }
        #[dynamics]
        impl Sling {
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
            }
            #[holonomic]
            fn rod(&self, q: &Coordinates<Self>) -> Expr {
                vec2(q.x, q.y).norm() - self.length
            }
        }
        for length in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
            let model = Sling { mass: 1.0, length };
            let at = |x: f64, y: f64| model.state().x(length * x).y(length * y);
            for (speed, off) in [(1e-6, 1e-2), (1.0, 1e-2), (1e6, 1e-2), (1.0, 1e-3)] {
                let u = speed * length;
                at(0.6, -0.8).x_rate(0.8 * u).y_rate(0.6 * u).build().unwrap();
                at(0.6 + 1e-8, -0.8).x_rate(0.8 * u).y_rate((0.6 + 1e-8) * u).build().unwrap();
                let error = at(0.6 + off, -0.8).build().unwrap_err();
                assert!(
                    matches!(error, StateError::ConstraintViolated { row: "rod", .. }),
                    "{length}: {error}"
                );
                let error = at(0.6, -0.8).x_rate((0.8 + off) * u).y_rate(0.6 * u).build();
                // What turns round has no speed: it misses by a part of its size, per second.
                let Err(error) = error else {
                    assert!(off * u < 3e-6 * length, "{length} {speed}");
                    continue;
                };
                assert!(
                    matches!(error, StateError::VelocityViolated { row: "rod", .. }),
                    "{length}: {error}"
                );
            }
        }
    }

    /// A motion can be continued from any of its states, from those without speed too.
    #[test]
    fn what_turns_round_is_a_start() {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(x, y)]
        struct Swing {
            g: f64,
        }
        #[dynamics]
        impl Swing {
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * vec2(q.x, q.y).dt().norm_squared()
            }
            #[potential]
            fn weight(&self, q: &Coordinates<Self>) -> Expr {
                self.g * q.y
            }
            #[holonomic]
            fn rod(&self, q: &Coordinates<Self>) -> Expr {
                vec2(q.x, q.y).norm() - 1.0
            }
            #[event]
            fn turns(&self, q: &Coordinates<Self>) -> Expr {
                q.y * q.x.dt() - q.x * q.y.dt()
            }
        }
        let swing = Swing { g: 9.81 };
        let start = swing.state().x(0.6).y(-0.8).x_rate(0.4).y_rate(0.3).build().unwrap();
        let baumgarte = Formulation::Baumgarte { alpha: 5.0, beta: 5.0 };
        for formulation in [
            Formulation::Projected,
            Formulation::Embedded,
            Formulation::BaumgarteTied,
            baumgarte,
            Formulation::Augmented,
        ] {
            for tolerance in [1e-7, 1e-9] {
                let run = |from| swing.simulate(from).tolerance(tolerance).formulation(formulation);
                let motion = run(start).until(9.0).run().unwrap();
                assert!(motion.events().len() > 6);
                for event in motion.events() {
                    run(event.after)
                        .until(event.time() + 0.1)
                        .run()
                        .unwrap_or_else(|e| panic!("{formulation}: {e}"));
                }
            }
        }
    }

    #[test]
    fn positions_off_the_constraint_are_refused() {
        let error = pendulum().state().x(1.0).y(0.1).build().unwrap_err();
        let StateError::ConstraintViolated { row, residual, distance, .. } = error else { panic!("{error}") };
        assert_eq!(row, "rod");
        assert!((residual - 0.005).abs() < 1e-15);
        assert!((distance - 0.005 / 1.0_f64.hypot(0.1)).abs() < 1e-15);
        assert!(error.to_string().contains("`rod`"), "{error}");
    }

    #[test]
    fn velocities_off_the_constraint_are_refused() {
        let error = pendulum().state().x(0.6).y(-0.8).x_rate(1.0).build().unwrap_err();
        let StateError::VelocityViolated { row, residual, .. } = error else { panic!("{error}") };
        assert_eq!((row, residual), ("rod", 0.6));
    }

    #[test]
    fn a_state_that_was_moved_off_is_refused_by_the_run() {
        let model = pendulum();
        let mut start = model.state().x(1.0).build().unwrap();
        start.q[0] = 1.1;
        let error = model.simulate(start).until(1.0).run().unwrap_err();
        let SimulationErrorKind::Start(why) = &error.kind else { panic!("{error}") };
        assert!(matches!(**why, StateError::ConstraintViolated { row: "rod", .. }), "{error}");
        assert_eq!((error.time, error.state.x()), (0.0, 1.1));
    }

    /// Blamed on the parameter by whatever comes first, not on the constraint or force that contains it.
    #[test]
    fn a_parameter_that_is_not_a_number_is_named() {
        for value in [f64::NAN, f64::INFINITY] {
            let named = |what: &dyn std::fmt::Display| {
                assert!(what.to_string().contains("parameter `length`"), "{what}");
                assert!(what.to_string().contains(&format!("is {value}; give a finite number")), "{what}");
            };
            let model = Pendulum { length: value, ..pendulum() };
            let error = model.state().x(1.0).build().unwrap_err();
            assert!(
                matches!(error, StateError::NotFinite { what: "parameter", name: "length", .. }),
                "{error}"
            );
            named(&error);
            named(&model.state().x(1.0).assemble().unwrap_err());
            // A start of the model as it was.
            let start = pendulum().state().x(1.0).build().unwrap();
            let error = model.simulate(start).until(1.0).run().unwrap_err();
            let parameter =
                |option: &_| matches!(option, OptionError::ParameterNotFinite { name: "length", .. });
            assert!(
                matches!(&error.kind, SimulationErrorKind::Option(option) if parameter(option)),
                "{error}"
            );
            named(&error.kind);
            let Err(error) = model.kinematics(start).until(1.0).run() else { panic!("went through") };
            assert!(
                matches!(&error.kind, KinematicsErrorKind::Option(option) if parameter(option)),
                "{error}"
            );
            named(&error.kind);
        }
    }

    #[test]
    fn given_values_that_cannot_be_completed_say_what_keeps_them_apart() {
        let error = pendulum().state().x(1.25).assemble().unwrap_err();
        let StateError::NotAssembled { row, given, .. } = error else { panic!("{error}") };
        assert_eq!(row, "rod");
        assert_eq!(given.to_string(), "`x`");
    }
}

/// A four-bar linkage: crank, coupler and rocker by their angles.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad, coupler: rad, rocker: rad)]
#[units(inertia: kg * m^2, a: m, b: m, c: m, ground: m, incline: rad)]
struct FourBar {
    inertia: f64,
    a: f64,
    b: f64,
    c: f64,
    ground: f64,
    /// Direction of the ground, from bearing to bearing.
    incline: f64,
}

#[dynamics]
impl FourBar {
    fn along(&self, length: f64, angle: Expr) -> Vec2 {
        length * vec2(angle.cos(), angle.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.crank.dt().powi(2) + q.coupler.dt().powi(2) + q.rocker.dt().powi(2))
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.along(self.a, q.crank) + self.along(self.b, q.coupler)
            - self.along(self.c, q.rocker)
            - self.ground * vec2(self.incline.cos(), self.incline.sin())
    }
}

mod linkages {
    use super::*;

    /// The pin of the crank is 3.64 m from the rocker's bearing; coupler and rocker reach 2 m.
    #[test]
    fn a_linkage_that_cannot_close_says_by_how_much() {
        let model = FourBar { inertia: 1.0, a: 1.0, b: 1.0, c: 1.0, ground: 3.5, incline: 0.0 };
        let error =
            model.state().crank(FRAC_PI_2).rocker_guess(2.8).coupler_guess(-0.3).assemble().unwrap_err();
        let StateError::NotAssembled { row, residual, distance, given } = error else { panic!("{error}") };
        assert!(row.starts_with("closure"), "{row}");
        // At the closest approach both rods lie in the line between the pins, whose slope is 1/3.5: the gap
        // is 1.64 m, its larger part along x.
        let gap = 1.0_f64.hypot(3.5) - 2.0;
        assert_eq!(row, "closure.x");
        assert!((residual.abs() - gap * 3.5 / 1.0_f64.hypot(3.5)).abs() < 1e-6, "{residual}");
        assert!(distance > 0.0);
        assert_eq!(given.to_string(), "`crank`");
    }

    /// Whatever the guess: a state that is returned fulfils the constraints, and where none is found the
    /// error says which row is missed.
    #[test]
    fn bad_guesses_give_a_closed_linkage_or_an_error() {
        let model = FourBar { inertia: 1.0, a: 1.0, b: 3.0, c: 2.5, ground: 3.2, incline: 0.0 };
        let (mut closed, mut refused) = (0, 0);
        for i in 0..40 {
            for j in 0..40 {
                let guess = |k: i32| 0.157 * f64::from(k) + 1e3 * f64::from(k % 3);
                let builder = model.state().crank(1.0).coupler_guess(guess(i)).rocker_guess(guess(j));
                match builder.assemble() {
                    Ok(state) => {
                        closed += 1;
                        let residual = model.residual(&state);
                        assert!(
                            residual[0].abs().max(residual[1].abs()) < 1e-12,
                            "guess {i}, {j}: {residual}"
                        );
                        assert_eq!(state.crank(), 1.0);
                    }
                    Err(StateError::NotAssembled { .. } | StateError::SingularGuess { .. }) => refused += 1,
                    Err(error) => panic!("guess {i}, {j}: {error}"),
                }
            }
        }
        assert!(closed > 1500, "{closed} closed, {refused} refused");
    }
}

mod drift;

mod contradictions {
    use super::*;

    /// A bob on two rods from two pivots.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(mass: kg, left: m, right: m, apart: m, g: m / s^2)]
    struct TwoRods {
        mass: f64,
        left: f64,
        right: f64,
        apart: f64,
        g: f64,
    }

    #[dynamics]
    impl TwoRods {
        fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
            vec2(q.x, q.y)
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * self.bob(q).dt().norm_squared()
        }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr {
            self.mass * self.g * self.bob(q).y
        }
        #[holonomic]
        fn first(&self, q: &Coordinates<Self>) -> Expr {
            self.bob(q).norm() - self.left
        }
        #[holonomic]
        fn second(&self, q: &Coordinates<Self>) -> Expr {
            (self.bob(q) - vec2(self.apart, 0.0)).norm() - self.right
        }
    }

    /// The rods reach for each other over a gap of 0.5 m.
    #[test]
    fn rods_that_do_not_meet_are_refused() {
        let model = TwoRods { mass: 1.0, left: 1.0, right: 1.0, apart: 2.5, g: 9.81 };
        let error = model.state().x_guess(1.2).y_guess(-0.1).assemble().unwrap_err();
        let StateError::NotAssembled { residual, given, .. } = error else { panic!("{error}") };
        assert!((residual.abs() - 0.25).abs() < 1e-6, "{error}");
        assert!(given.is_empty());
        // A length of zero has no gradient.
        let error = model.state().assemble().unwrap_err();
        assert_eq!(error, StateError::GradientNotFinite { row: "first" }, "{error}");
    }

    /// Stretched in one line, the rods hold the bob; the linearised constraints do not. Neither falls it nor
    /// does it hover with a growing velocity.
    #[test]
    fn stretched_rods_lock_the_bob() {
        let model = TwoRods { mass: 1.0, left: 1.0, right: 1.0, apart: 2.0, g: 9.81 };
        let start = model.state().x(1.0).build().unwrap();
        let error = model.simulate(start).until(1.0).run().unwrap_err();
        let SimulationErrorKind::SingularStart { rows, coordinates } = error.kind else { panic!("{error}") };
        assert!(error.time == 0.0 && rows.count() == 2 && coordinates.names().eq(["y"]), "{error}");
        let moving = model.state().x(1.0).y_rate(0.5).build().unwrap();
        let error = model.simulate(moving).until(1.0).run().unwrap_err();
        let SimulationErrorKind::SingularPosition { rows, coordinates, cause, .. } = error.kind else {
            panic!("{error}")
        };
        assert!(rows.count() == 2 && coordinates.names().eq(["y"]));
        let SimulationErrorKind::Solve(SolveError::Contradiction { row, rank, .. }) = cause.kind else {
            panic!("{cause:?}")
        };
        assert!(row == "first" || row == "second");
        assert_eq!((rank, error.time), (1, 0.0));
    }

    /// Two rods that meet leave nothing free: the bob stays, and its weight is carried.
    #[test]
    fn two_rods_carry_the_bob() {
        let model = TwoRods { mass: 2.0, left: 1.0, right: 1.0, apart: 1.2, g: 9.81 };
        let start = model.state().x_guess(0.6).y_guess(-1.0).assemble().unwrap();
        assert!((start.y() + 0.8).abs() < 1e-15);
        let motion = model.simulate(start).until(10.0).run().unwrap();
        assert!((motion.end().y() + 0.8).abs() < 1e-14 && motion.end().y_rate().abs() < 1e-14);
        // Each carries m g/(2·0.8).
        let lambda = motion.multipliers_at(10.0);
        assert!(
            (lambda[0] + 19.62 / 1.6).abs() < 1e-12 && (lambda[1] + 19.62 / 1.6).abs() < 1e-12,
            "{lambda}"
        );
    }
}

mod gradients {
    use super::*;

    /// A bead on a circle that is written as a graph: it has no slope at its ends.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(mass: kg, radius: m, g: m / s^2)]
    struct Graph {
        mass: f64,
        radius: f64,
        g: f64,
    }

    #[dynamics]
    impl Graph {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr {
            self.mass * self.g * q.y
        }
        #[holonomic]
        fn curve(&self, q: &Coordinates<Self>) -> Expr {
            q.y - (self.radius.powi(2) - q.x * q.x).sqrt()
        }
    }

    #[test]
    fn where_the_graph_of_a_circle_ends_the_motion_ends() {
        let model = Graph { mass: 1.0, radius: 1.0, g: 9.81 };
        let start = model.state().x(0.0).y(1.0).x_rate(0.5).build().unwrap();
        let error = model.simulate(start).until(10.0).run().unwrap_err();
        assert!(error.state.x() > 0.99 && error.state.x() <= 1.0, "{error}");
        // Up to there it is right: v² = v₀² + 2 g (1 − y).
        let (x, y) = (error.state.x(), error.state.y());
        assert!((x.hypot(y) - 1.0).abs() < 1e-6, "{error}");
        let speed = error.state.x_rate().hypot(error.state.y_rate());
        assert!((speed.powi(2) / (0.25 + 2.0 * 9.81 * (1.0 - y)) - 1.0).abs() < 1e-3, "{error}");
        assert!(error.motion(&model).unwrap().end_time() > 0.1);
    }
}

mod friction;

/// A driven slider-crank whose slider an input loads; the guide repeats the second row of the closure, so
/// that the general solver is asked.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad, phi: rad, x: m)]
#[inputs(load: N)]
#[units(crank: m, rod: m, slider: kg, omega: rad / s)]
#[nominal(crank = 0.1, rod = 0.3, omega = 10.0)]
struct LoadedCrank {
    crank: f64,
    rod: f64,
    slider: f64,
    omega: f64,
}

#[dynamics]
impl LoadedCrank {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.slider * q.x.dt().powi(2)
    }
    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -q.load)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        let pin = self.crank * vec2(q.theta.cos(), q.theta.sin());
        vec2(q.x, 0.0) - pin - self.rod * vec2(q.phi.cos(), -q.phi.sin())
    }
    #[holonomic]
    #[redundant]
    fn guide(&self, q: &Coordinates<Self>) -> Expr {
        self.rod * q.phi.sin() - self.crank * q.theta.sin()
    }
    #[holonomic]
    fn drive(&self, q: &Coordinates<Self>) -> Expr {
        q.theta - self.omega * q.t
    }
}

#[test]
fn an_input_that_only_loads_a_driven_mechanism_is_asked_for_with_the_reactions_alone() {
    let model = LoadedCrank { crank: 0.1, rod: 0.3, slider: 0.5, omega: 10.0 };
    let start = model.state().x_guess(0.4).assemble().unwrap();
    let motion = model.kinematics(start).until(1.0).run().unwrap_or_else(|e| panic!("{e}"));
    // In closed form.
    let (s, c) = 7.0_f64.sin_cos();
    let root = (0.09 - 0.01 * s * s).sqrt();
    assert!((motion.at(0.7).x() - (0.1 * c + root)).abs() < 1e-14);
    let speed = -s - 0.1 * s * c / root;
    assert!((motion.at(0.7).x_rate() - speed).abs() < 1e-12);
    let error = motion.reaction_at("drive", 0.7).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the reactions depend on inputs, and `load` has no value; set it in the state"
    );
    assert_eq!(model.reactions(&motion.at(0.7)).unwrap_err(), SolveError::InputNotSet { input: "load" });

    let loaded = model.state().x_guess(0.4).load(20.0).assemble().unwrap();
    let motion = model.kinematics(loaded).until(1.0).run().unwrap_or_else(|e| panic!("{e}"));
    let (drive, a) = (motion.reaction_at("drive", 0.7).unwrap()[0], motion.accelerations_at(0.7)[2]);
    // The drive gives what the load takes and the slider gains.
    assert!((drive * 10.0 - (0.5 * a + 20.0) * speed).abs() < 1e-11, "{drive}");
}
