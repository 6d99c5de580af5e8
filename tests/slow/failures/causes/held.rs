//! Strings, shelves, trusses, presses and hoists: what holds, repeats others, or gives way.

use dynamics::error::StateError;

use super::*;

/// A ball on a string, which pulls and does not push.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, g: m / s^2)]
#[nominal(l = 1.0)]
struct OnString {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl OnString {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic(switched)]
    fn string(&self, q: &Coordinates<Self>) -> Expr {
        self.l - vec2(q.x, q.y).norm()
    }
}

/// At a speed of √(5 g l) at the bottom the tension is just zero at the top: the string neither slackens for
/// a time that anything resolves, nor pulls there. It swings on as on a rod.
#[test]
fn a_tension_that_grazes_zero_is_passed() {
    let model = OnString { m: 0.3, l: 1.0, g: 9.81 };
    let near: [f64; 9] = [-1e-8, -1e-9, -1e-10, -1e-12, 0.0, 1e-12, 1e-10, 1e-9, 1e-8];
    // A springy string bounces on without end below the speed that counts as none.
    let contacts = [0.0.into(), 0.5.into(), Contact { restitution: 0.9, rest_speed: Some(1e-4) }];
    for tolerance in [1e-6, 1e-8, 1e-10, 1e-12] {
        for contact in contacts {
            for off in near {
                let start = model.state().y(-1.0).x_rate(((5.0 + off) * 9.81).sqrt()).build().unwrap();
                let run =
                    |until: f64| model.simulate(start).until(until).tolerance(tolerance).max_steps(5000);
                let rod = run(3.0).run().unwrap().end();
                let case = format!("5 {off:+e}, {tolerance:e}, {contact:?}");
                let motion =
                    run(3.0).contact("string", contact).run().unwrap_or_else(|e| panic!("{case}: {e}"));
                let apart = (motion.end().q - rod.q).norm();
                assert!(apart < 1e-7 + 30.0 * tolerance, "{case}: {apart:e}");
            }
        }
    }
    // Farther below it slackens, and is caught.
    let start = model.state().y(-1.0).x_rate((4.99f64 * 9.81).sqrt()).build().unwrap();
    let motion = model.simulate(start).until(3.0).tolerance(1e-10).contact("string", 0.0).run().unwrap();
    assert!(motion.events().len() == 4 && motion.summary().energy_lost > 5e-5, "{}", motion.verify());
}

/// A bar whose ends run on a floor, and its middle on a shelf: that repeats the ends where the shelf is no
/// higher than the floor.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, tilt: rad)]
#[units(mass: kg, inertia: kg * m^2, half: m, shelf: m, g: m / s^2)]
#[nominal(half = 0.5, shelf = 0.0)]
struct Shelved {
    mass: f64,
    inertia: f64,
    half: f64,
    shelf: f64,
    g: f64,
}

#[dynamics]
impl Shelved {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.tilt.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn ends(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [q.y - self.half * q.tilt.sin(), q.y + self.half * q.tilt.sin()]
    }
    #[holonomic]
    #[redundant]
    fn middle(&self, q: &Coordinates<Self>) -> Expr {
        q.y - self.shelf
    }
}

/// What is declared to repeat others, and does at the nominal values, contradicts them at other values alone:
/// there a start says so.
#[test]
fn a_repetition_at_nominal_values_is_no_contradiction() {
    let model = Shelved { mass: 2.0, inertia: 0.1, half: 0.5, shelf: 0.0, g: 9.81 };
    let start = model.state().x_rate(0.3).build().unwrap();
    let motion = model.simulate(start).until(2.0).run().unwrap();
    assert!((motion.end().x() - 0.6).abs() < 1e-12 && motion.end().y().abs() < 1e-15);
    let raised = Shelved { shelf: 0.1, ..model };
    let error = raised.state().x_rate(0.3).assemble().unwrap_err();
    assert!(matches!(error, StateError::NotAssembled { .. }), "{error}");
}

/// A bob on three rods, one more than it takes.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, l: m, g: m / s^2)]
#[nominal(l = 1.0)]
struct Truss {
    mass: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Truss {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn sides(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        let bob = vec2(q.x, q.y);
        let place = vec2(self.l, 0.0);
        [
            (bob - place).norm_squared() - 2.0 * self.l.powi(2),
            (bob + place).norm_squared() - 2.0 * self.l.powi(2),
        ]
    }
    #[holonomic]
    #[redundant]
    fn middle(&self, q: &Coordinates<Self>) -> Expr {
        (vec2(q.x, q.y) - vec2(0.0, self.l)).norm_squared() - 4.0 * self.l.powi(2)
    }
}

/// What is missed counts beside what forces would do: 10⁻⁹⁶ m/s² of it, from velocities of 10⁻⁴⁸ m/s, is
/// none, though nothing moves.
#[test]
fn a_contradiction_is_larger_than_rounding() {
    let model = Truss { mass: 1.0, l: 1.0, g: 9.81 };
    let at_rest = model.state().y(-1.0).build().unwrap();
    let solve = |u: f64| {
        let mut state = at_rest;
        state.u[0] = u;
        solve_once(&model, &model.constants().unwrap(), &state)
    };
    for u in [0.0, 1e-48, 1e-20, 1e-8] {
        let solved = solve(u).unwrap_or_else(|e| panic!("{u:e}: {e}"));
        assert!(solved.accelerations.norm() < 1e-14, "{solved:?}");
    }
}

/// A block between a floor and a lid that comes down.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y: m)]
#[units(mass: kg, g: m / s^2, gap: m, speed: m / s)]
struct Press {
    mass: f64,
    g: f64,
    gap: f64,
    speed: f64,
}

#[dynamics]
impl Press {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.y.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[holonomic(switched)]
    fn lid(&self, q: &Coordinates<Self>) -> Expr {
        self.gap - self.speed * q.t - q.y
    }
}

/// The lid meets the floor at 5 s.
mod squeezed {
    use super::*;
    use dynamics::error::SolveError;
    use dynamics::simulate::EventActionError;

    const PRESS: Press = Press { mass: 0.1, g: 9.81, gap: 1.0, speed: 0.2 };

    fn pressed(start: State<Press>, restitution: f64, tolerance: f64) -> SimulationError<Press> {
        let run = PRESS.simulate(start).until(6.0).tolerance(tolerance);
        run.contact("floor", restitution).contact("lid", restitution).run().unwrap_err()
    }

    #[test]
    fn a_block_that_does_not_bounce_is_pressed_to_the_floor() {
        let flying = PRESS.state().y(0.8).release("floor").release("lid").build().unwrap();
        let lying = PRESS.state().release("lid").build().unwrap();
        for (start, restitution) in [(lying, 0.0), (lying, 0.5), (lying, 1.0), (flying, 0.0), (flying, 0.5)] {
            for tolerance in [1e-6, 1e-10] {
                let error = pressed(start, restitution, tolerance);
                assert!((error.time - 5.0).abs() < 1e-12, "{error}");
                let SimulationErrorKind::EventAction { error: change, .. } = &error.kind else {
                    panic!("{error}")
                };
                assert!(
                    matches!(
                        **change,
                        EventActionError::Solve(SolveError::ImpactSqueezes { row: "lid", .. })
                    ),
                    "{error}"
                );
            }
        }
    }

    /// Its speed grows as the gap becomes less: no speed of rest helps.
    #[test]
    fn a_ball_that_bounces_is_squeezed_ever_faster() {
        let flying = PRESS.state().y(0.8).release("floor").release("lid").build().unwrap();
        for tolerance in [1e-6, 1e-10] {
            let error = pressed(flying, 1.0, tolerance);
            let SimulationErrorKind::EventsAccumulate { at, squeezed: true, .. } = error.kind else {
                panic!("{error}")
            };
            assert!((at - 5.0).abs() < 1e-5 && !error.to_string().contains("rest_speed"), "{error}");
        }
    }
}

/// A weight on a rope that is hauled in through a ring.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, length: m, speed: m / s, g: m / s^2)]
struct Hoist {
    mass: f64,
    length: f64,
    speed: f64,
    g: f64,
}

#[dynamics]
impl Hoist {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn rope(&self, q: &Coordinates<Self>) -> Expr {
        self.length - self.speed * q.t - vec2(q.x, q.y).norm()
    }
}

mod hauled_in {
    use super::*;

    const HOIST: Hoist = Hoist { mass: 1.0, length: 1.0, speed: 0.5, g: 9.81 };

    /// With some spin it turns ever faster, infinitely often before the rope is gone at 2 s.
    #[test]
    fn spin_has_no_end_before_the_rope_is_gone() {
        let start = HOIST.state().x(0.3).y_guess(-1.0).assemble().unwrap();
        for formulation in [Formulation::Projected, Formulation::Augmented] {
            let error =
                HOIST.simulate(start).until(3.0).tolerance(1e-8).formulation(formulation).run().unwrap_err();
            let SimulationErrorKind::StepsVanish { at, rows, coordinates } = error.kind else {
                panic!("{error}")
            };
            assert!((at - 2.0).abs() < 1e-6 && rows.contains("rope"), "{error}");
            assert!(coordinates.contains("x") && coordinates.contains("y"), "{error}");
            // It is not called so before it is clear, nor long after that.
            let steps = error.motion(&HOIST).unwrap().counts().steps;
            assert!((20_000..140_000).contains(&steps) && error.time > 1.9999, "{steps} {error}");
        }
    }

    /// Straight up it is the length at the ring that has the corner; also where the constraint drifts, and a
    /// step ends far beyond.
    #[test]
    fn the_corner_is_at_the_ring() {
        let start = HOIST.state().y(-1.0).assemble().unwrap();
        let drifting = [
            Formulation::BaumgarteTied,
            Formulation::Augmented,
            Formulation::Baumgarte { alpha: 5.0, beta: 5.0 },
        ];
        for formulation in drifting.into_iter().chain([Formulation::Projected, Formulation::Embedded]) {
            for tolerance in [1e-6, 1e-8, 1e-10] {
                let run = HOIST.simulate(start).until(3.0).tolerance(tolerance).formulation(formulation);
                let error = run.run().unwrap_err();
                let SimulationErrorKind::ConstraintJumps {
                    row: "rope",
                    what: JumpingQuantity::Velocities,
                    ..
                } = error.kind
                else {
                    panic!("{formulation} {tolerance:e}: {error}")
                };
                assert!(
                    (error.time - 2.0).abs() < 1e-4 && error.state.y().abs() < 1e-4,
                    "{formulation} {tolerance:e}: {error}"
                );
                // What comes before is right.
                let motion = error.motion(&HOIST).unwrap();
                assert!((motion.at(1.5).y() + 0.25).abs() < 1e-5, "{formulation} {tolerance:e}");
            }
            // An event before it that acts is not passed over.
            let run =
                HOIST.simulate(start).until(3.0).formulation(formulation).event("near", |s| s.y() + 0.1);
            let motion = run.stop_at("near", Direction::Rising).run().unwrap();
            assert!((motion.end_time() - 1.8).abs() < 1e-9, "{formulation}");
        }
    }
}
