//! Mechanisms of micrometres and of kilometres: what decides at starts, contacts and slips knows their size,
//! and all of them behave alike.

use dynamics::error::StateError;
use dynamics::prelude::*;
use dynamics::simulate::{EventActionError, Flow, SimulationErrorKind as Kind};

/// Two masses at the ends of a rod that fall onto a rough floor, which falls away from a place on.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, v: m, w: m)]
#[units(mass: kg, g: m / s^2, long: m)]
#[nominal(long = 1.0)]
struct Dumbbell {
    mass: f64,
    g: f64,
    long: f64,
    mu: f64,
}

#[dynamics]
impl Dumbbell {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (vec2(q.x, q.y).dt().norm_squared() + vec2(q.v, q.w).dt().norm_squared())
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (q.y + q.w)
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x - q.v, q.y - q.w).norm() - self.long
    }
    #[holonomic(switched)]
    fn first(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[holonomic(switched)]
    fn second(&self, q: &Coordinates<Self>) -> Expr {
        q.w
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.mu * q.reaction(Self::first) * q.slip(Self::stick))
    }
    #[event]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.mu * q.reaction(Self::first) - q.reaction(Self::stick).abs()
    }
}

/// A micrometre and a kilometre, or nearly: powers of two scale without rounding.
const SIZES: [f64; 4] = [1.0 / 1_048_576.0, 1.0 / 1024.0, 1.0, 1024.0];

/// With gravity in proportion, motions of all sizes take the same time.
fn dumbbell(size: f64) -> Dumbbell {
    Dumbbell { mass: 1.0, g: 9.81 * size, long: size, mu: 0.3 }
}

/// A start tilted by an angle above the floor, with a miss of the rod.
fn start(model: &Dumbbell, off: f64) -> Result<State<Dumbbell>, StateError> {
    let (size, (sine, cosine)) = (model.long, 0.3f64.sin_cos());
    let start = model.state().y(0.4 * size).v(cosine * size * (1.0 + off)).w((0.4 + sine) * size);
    start.x_rate(0.5 * size).v_rate(0.5 * size).release("first").release("second").release("stick").build()
}

#[test]
fn starts_are_judged_by_their_size() {
    for size in SIZES {
        let model = dumbbell(size);
        for off in [1e-4, -1e-5, 1e-3] {
            let error = start(&model, off).unwrap_err();
            assert!(
                matches!(error, StateError::ConstraintViolated { row: "rod", .. }),
                "{size:e} {off:e}: {error}"
            );
        }
        assert!(start(&model, 1e-8).is_ok(), "{size:e}");
    }
}

/// It lands on one end, slips, falls over, and comes to rest, at the same times and, in parts of its size,
/// places.
#[test]
fn motions_of_all_sizes_are_alike() {
    let run = |size: f64, method: &methods::Any<Dumbbell>| {
        let model = dumbbell(size);
        let start = start(&model, 0.0).unwrap();
        let run = model.simulate(start).until(1.5).method(method).tolerances(1e-9 * size, 1e-9);
        let law = |restitution: f64| Contact { rest_speed: Some(1e-3 * size), ..Contact::from(restitution) };
        let run = run.contact("first", law(0.3)).contact("second", law(0.3)).stick_slip("stick", "grip");
        let motion = run.run().unwrap_or_else(|e| panic!("{size:e} {method}: {e}"));
        let events: Vec<(String, f64)> = motion.events().iter().map(|e| (e.name.clone(), e.time())).collect();
        (events, motion.end().q.map(|q| q / size), motion.end().u.map(|u| u / size))
    };
    for method in [methods::Any::from(methods::Dop853), methods::Tsit5.into(), methods::Radau5.into()] {
        let (events, q, u) = run(1.0, &method);
        assert!(events.len() > 8 && q[1].abs().max(q[3].abs()) < 1e-8, "{method}: {events:?} {q:?}");
        for size in SIZES {
            let (found, there, speeds) = run(size, &method);
            assert_eq!(found.len(), events.len(), "{method} {size:e}: {found:?} {events:?}");
            for ((name, time), (other, wanted)) in found.iter().zip(&events) {
                assert!(
                    name == other && (time - wanted).abs() < 1e-8,
                    "{method} {size:e}: {name} {time} {wanted}"
                );
            }
            let apart = (there - q).amax().max((speeds - u).amax());
            assert!(apart < 1e-7, "{method} {size:e}: {apart:e}");
        }
    }
}

/// Actions that hit or engage what is a part of 10⁻⁴ of the size away are refused at every size, with what is
/// missed; those that are off by rounding are not.
#[test]
fn changes_are_judged_by_their_size() {
    for size in SIZES {
        let model = dumbbell(size);
        let start = start(&model, 0.0).unwrap();
        let run = |height: f64| {
            let run = model.simulate(start).until(0.5).tolerances(1e-9 * size, 1e-9);
            let run = run.event("near", move |s| s.y() - height * size);
            run.on_event_with("near", Direction::Falling, |change| {
                change.impact("first", 0.5);
                Flow::Stop
            })
            .run()
        };
        let error = run(1e-4).unwrap_err();
        let Kind::EventAction { error, .. } = &error.kind else { panic!("{size:e}: {error}") };
        let EventActionError::ImpactApart { row: "first", residual } = **error else {
            panic!("{size:e}: {error}")
        };
        assert!((residual / size - 1e-4).abs() < 1e-8, "{size:e}: {residual:e}");
        assert!(run(1e-8).unwrap().events().iter().any(|event| !event.impacts.is_empty()), "{size:e}");
    }
}

/// Drift ends a run by its part of the mechanism. By parts of 1 m a micrometre's lost its rod without a word.
#[test]
fn drift_is_judged_by_its_size() {
    let mut ends = Vec::new();
    for size in SIZES {
        let model = Dumbbell { g: 0.0, ..dumbbell(size) };
        let start = model.state().v(size).y_rate(-2.0 * size).w_rate(2.0 * size);
        let start = start.release("first").release("second").release("stick").build().unwrap();
        let run = model.simulate(start).until(100.0).method(methods::Rk4).fixed_step(0.1);
        let error = run.formulation(Formulation::Augmented).run().unwrap_err();
        let Kind::Drift { row: "rod", distance, limit, .. } = error.kind else { panic!("{size:e}: {error}") };
        assert!(distance > limit && limit > 5e-4 * size && limit < 6e-3 * size, "{size:e}: {error}");
        ends.push(error.time);
    }
    // Of what is larger than a metre coordinates count alone, so that limits are up to two times tighter.
    assert!(ends[0] > 1.0 && ends[1] == ends[0] && ends[2] == ends[0] && ends[3] > 0.3 * ends[0], "{ends:?}");
}
