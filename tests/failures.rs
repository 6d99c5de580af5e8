//! Where methods fail: each case reports itself with time, state and constraint, and none returns a wrong
//! answer as a success. The outcomes are those of derived models; the runtime's own cases, on models written
//! by hand, are in `dynamics-runtime/tests/`.

use core::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use dynamics::constrain::solve_once;
use dynamics::kinematics::KinematicsErrorKind;
use dynamics::motion::{OptionError, SimulationErrorKind};
use dynamics::prelude::*;

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

mod drift {
    use super::*;

    /// Nothing holds Φ = 0 where only Φ̈ = 0 is solved: at a loose tolerance the rod has grown by the limit
    /// long before 1,000 s.
    #[test]
    fn unstabilised_motion_ends_where_it_has_left_the_constraint() {
        let model = pendulum();
        let start = model.state().x(1.0).build().unwrap();
        let run =
            |formulation| model.simulate(start).until(1000.0).tolerance(1e-6).formulation(formulation).run();
        let error = run(Formulation::Augmented).unwrap_err();
        let SimulationErrorKind::Drift { row, residual, distance, limit, .. } = error.kind else {
            panic!("{error}")
        };
        assert_eq!(row, "rod");
        assert!(residual.abs() > 1e-4 && distance > limit, "{error}");
        assert!(error.time > 1.0 && error.time < 1000.0, "{error}");
        let motion = error.motion(&model).unwrap();
        assert_eq!(motion.end_time(), error.time);
        let drift = motion.summary().constraints[0].residual;
        assert!(drift > 1e-4, "{drift}");
        // What the tolerance promises is kept by the projection over the whole time.
        let kept = run(Formulation::Projected).unwrap().summary();
        assert!(
            kept.constraints[0].residual < 1e-12 && kept.constraints[0].velocity_residual < 1e-12,
            "{kept}"
        );
        // At a tight tolerance the drift stays small, grows with time, and is reported.
        let tight =
            model.simulate(start).until(1000.0).tolerance(1e-12).formulation(Formulation::Augmented).run();
        let tight = tight.unwrap().summary().constraints[0].residual;
        assert!(tight > 1e-10 && tight < 1e-3, "{tight:e}");
    }

    /// A sleigh on a spring to the origin, its knife in (x, y) and its centre of mass behind it.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m, heading: rad)]
    #[units(mass: kg, inertia: kg * m^2, behind: m, stiffness: N / m)]
    struct Sleigh {
        mass: f64,
        inertia: f64,
        behind: f64,
        stiffness: f64,
    }

    #[dynamics]
    impl Sleigh {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let centre = vec2(q.x, q.y) + self.behind * vec2(q.heading.cos(), q.heading.sin());
            0.5 * self.mass * centre.dt().norm_squared() + 0.5 * self.inertia * q.heading.dt().powi(2)
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.stiffness * (q.x.powi(2) + q.y.powi(2))
        }
        #[nonholonomic]
        fn knife(&self, q: &Coordinates<Self>) -> Expr {
            q.y.dt() * q.heading.cos() - q.x.dt() * q.heading.sin()
        }
    }

    /// A knife has no position to drift in; what it slips ends the run all the same.
    #[test]
    fn a_knife_that_slips_ends_an_unstabilised_motion() {
        let model = Sleigh { mass: 1.0, inertia: 0.3, behind: 0.2, stiffness: 2.0 };
        let start = model.state().x(1.0).x_rate(0.5).heading_rate(2.0).build().unwrap();
        let run =
            |formulation| model.simulate(start).until(2000.0).tolerance(1e-3).formulation(formulation).run();
        let error = run(Formulation::Augmented).unwrap_err();
        let SimulationErrorKind::Drift { what, row, distance, limit, .. } = error.kind else {
            panic!("{error}")
        };
        assert_eq!((what, row), ("velocities", "knife"));
        // cos² + sin² = 1: the distance is the slip, and the limit is relative to the size of the sleigh and
        // its velocities.
        let there = &error.state;
        let (sine, cosine) = there.heading().sin_cos();
        let size = model.behind + there.x_rate().abs().max(there.y_rate().abs());
        let expected = 1e-3 * size * (sine.abs() + cosine.abs());
        assert!(distance > limit && distance < 10.0 * limit, "{error}");
        assert!((limit / expected - 1.0).abs() < 1e-12, "{limit} {expected}");
        assert!(error.time > 0.1 && error.time < 1000.0, "{error}");
        let kept = run(Formulation::Projected).unwrap().summary();
        assert!(kept.constraints[0].velocity_residual < 1e-12, "{kept}");
    }

    /// Gains beyond the region of stability of the method: errors of the constraint grow from step to step.
    #[test]
    fn gains_too_large_for_a_fixed_step_end_the_motion() {
        let model = pendulum();
        let start = model.state().x(1.0).build().unwrap();
        let run = |gain: f64| {
            let formulation = Formulation::Baumgarte { alpha: gain, beta: gain };
            model
                .simulate(start)
                .until(10.0)
                .method(methods::Rk4)
                .fixed_step(0.01)
                .formulation(formulation)
                .run()
        };
        let good = run(50.0).unwrap().summary().constraints[0].residual;
        assert!(good < 1e-5, "{good:e}");
        let error = run(400.0).unwrap_err();
        assert!(matches!(error.kind, SimulationErrorKind::Drift { row: "rod", .. }), "{error}");
        assert!(error.time < 1.0, "{error}");
    }

    /// With step control the same gains give the motion, and cost steps.
    #[test]
    fn gains_too_large_for_the_motion_cost_steps() {
        let model = pendulum();
        let start = model.state().x(1.0).build().unwrap();
        let run = |gain: f64| {
            let formulation = Formulation::Baumgarte { alpha: gain, beta: gain };
            model.simulate(start).until(2.0).tolerance(1e-8).formulation(formulation).run().unwrap()
        };
        let (mild, strong) = (run(10.0), run(1000.0));
        assert!(strong.summary().steps > 10 * mild.summary().steps, "{}", strong.summary());
        assert!((strong.end().q - mild.end().q).norm() < 1e-6);
    }

    /// Gains may also be too small to hold anything.
    #[test]
    fn gains_of_zero_are_no_stabilisation() {
        let model = pendulum();
        let start = model.state().x(1.0).build().unwrap();
        let formulation = Formulation::Baumgarte { alpha: 0.0, beta: 0.0 };
        let error =
            model.simulate(start).until(1000.0).tolerance(1e-6).formulation(formulation).run().unwrap_err();
        assert!(matches!(error.kind, SimulationErrorKind::Drift { row: "rod", .. }), "{error}");
        let formulation = Formulation::Baumgarte { alpha: -1.0, beta: 1.0 };
        let error = model.simulate(start).until(1.0).formulation(formulation).run().unwrap_err();
        assert!(matches!(error.kind, SimulationErrorKind::Option(_)), "{error}");
    }
}

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
        let SimulationErrorKind::SingularPosition { rows, coordinates, met, .. } = error.kind else {
            panic!("{error}")
        };
        assert!(rows.count() == 2 && coordinates.names().eq(["y"]));
        let SimulationErrorKind::Solve(SolveError::Contradiction { row, rank, .. }) = met.kind else {
            panic!("{met:?}")
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

mod friction {
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
        for (theta, rate, slide) in
            [(0.2, 0.3, -1.0), (1.4, -0.5, -2.0), (FRAC_PI_4, 1.0, 1.0), (0.7, 0.2, 0.4)]
        {
            assert!(answer(&model, theta, slide) > 0.0);
            let state = sliding(&model, theta, rate, slide);
            let solved = solve_once(&model, &model.constants().unwrap(), &state).unwrap();
            let expected = normal(&model, theta, rate, slide);
            assert!(
                (solved.multipliers[0] / expected - 1.0).abs() < 1e-12,
                "{solved:?} instead of {expected}"
            );
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
}

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
