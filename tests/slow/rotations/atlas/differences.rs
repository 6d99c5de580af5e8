//! What acts otherwise in another chart is seen wherever it acts; rounding is no difference.

use super::*;

/// A body in angles and one in Euler parameters, whose mass matrix the constraint alone makes regular, and
/// two inputs of different size.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(yaw: rad, pitch: rad, roll: rad, e: [_; 4], s)]
#[inputs(motor, push)]
struct Pair {
    inertia: Vec3<f64>,
    mass: f64,
    spring: f64,
    reference: f64,
}
#[dynamics]
impl Pair {
    fn frame(&self, q: &Coordinates<Self>) -> Frame {
        Frame::turned(
            Mat3::rotation_y(self.reference) * Mat3::euler(EulerSequence::Zyx, [q.yaw, q.pitch, q.roll]),
        )
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let [a, b, c] = self.inertia.to_array();
        let other = Frame::turned(EulerParameters::new(q.e).rotation());
        self.frame(q).rotation().rotational_energy(Mat3::diagonal(a, b, c))
            + other.rotation().rotational_energy(Mat3::diagonal(a, b, c))
            + 0.5 * self.mass * q.s.dt().powi(2)
    }
    #[potential]
    fn bent(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.spring * q.pitch.powi(2)
    }
    #[force]
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        let [a, b, c] = self.inertia.to_array();
        let body = RigidBody::new(self.mass, Vec3::ZERO, Mat3::diagonal(a, b, c), self.frame(q));
        body.moment(q.motor * Vec3::X) + Force::along(q.s, q.push)
    }
    #[holonomic]
    fn unit(&self, q: &Coordinates<Self>) -> Expr {
        EulerParameters::new(q.e).norm_constraint()
    }
}

#[test]
fn a_singular_mass_matrix_hides_nothing() {
    let model = Pair { inertia: Vec3::new(2.0, 3.0, 4.0), mass: 1.0, spring: 0.0, reference: 0.0 };
    let run = |model: Pair, small: f64| {
        let atlas =
            ChartSwitching::new(model).turning("pitch", |model, turn| model.reference = turn).expect("a set");
        let start =
            atlas.charts()[0].state().pitch(0.3).pitch_rate(1.0).yaw_rate(0.2).e([1.0, 0.0, 0.0, 0.0]);
        let start = start.e_rate([0.0, 0.2, 0.1, 0.0]).motor(0.0).push(0.0).build().expect("of norm 1");
        let law = move |_: f64, state: &State<Pair>| [small * state.pitch(), 1e6];
        let motion = atlas.simulate(start).until(3.0).with(|run, _| run.tolerance(1e-8).inputs(law)).run();
        motion.map(|motion| motion.changes().len()).map_err(|error| match error.kind {
            ChartSwitchingErrorKind::Chart(ChartError::Disagree { what, name, .. }) => (what, name),
            _ => panic!("{error}"),
        })
    };
    assert_eq!(run(model.clone(), 0.0), Ok(2));
    assert_eq!(run(model.clone(), 1e-3), Err((Compared::Input, "motor")));
    assert_eq!(run(Pair { spring: 0.1, ..model }, 0.0), Err((Compared::AngularAcceleration, "pitch")));
}

/// What acts only in a band of an angle, or for a time, and not where a part begins: along the angle, which
/// is another axis in another chart, or about an axis of the body.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(yaw: rad, pitch: rad, roll: rad)]
#[inputs(motor: N * m)]
struct Pushed {
    inertia: Vec3<f64>,
    band: f64,
    pulse: f64,
    begin: f64,
    end: f64,
    framed: f64,
    reference: f64,
}
#[dynamics]
impl Pushed {
    fn body(&self, q: &Coordinates<Self>) -> RigidBody {
        let [a, b, c] = self.inertia.to_array();
        let turned =
            Mat3::rotation_y(self.reference) * Mat3::euler(EulerSequence::Zyx, [q.yaw, q.pitch, q.roll]);
        RigidBody::new(1.0, Vec3::ZERO, Mat3::diagonal(a, b, c), Frame::turned(turned))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).kinetic_energy()
    }
    #[force]
    fn in_a_band(&self, q: &Coordinates<Self>) -> Force {
        let inside = if q.yaw < 1.75 {
            Expr::ZERO
        } else if q.yaw < 2.05 {
            Expr::ONE
        } else {
            Expr::ZERO
        };
        Force::along(q.yaw, self.band * inside)
    }
    #[force]
    fn for_a_time(&self, q: &Coordinates<Self>) -> Force {
        let begun = if q.t < self.begin { Expr::ZERO } else { Expr::ONE };
        let over = if q.t < self.end { Expr::ZERO } else { Expr::ONE };
        Force::along(q.yaw, self.pulse * (begun - over))
    }
    #[force]
    fn by_the_frame(&self, q: &Coordinates<Self>) -> Force {
        let inside = if self.body(q).frame.x().x < -0.2 { Expr::ONE } else { Expr::ZERO };
        self.body(q).moment((q.motor + self.framed * inside) * Vec3::X)
    }
    #[output]
    fn axis(&self, q: &Coordinates<Self>) -> Vec3 {
        self.body(q).frame.x()
    }
}

#[test]
fn what_acts_only_on_the_way_is_seen() {
    let none = Pushed {
        inertia: Vec3::new(2.0, 3.0, 4.0),
        band: 0.0,
        pulse: 0.0,
        begin: 1.0,
        end: 1.3,
        framed: 0.0,
        reference: 0.0,
    };
    // A law in time, with steps that meet it.
    let run = |model: Pushed, law: fn(f64, &State<Pushed>) -> [f64; 1]| {
        let atlas =
            ChartSwitching::new(model).turning("pitch", |model, turn| model.reference = turn).expect("a set");
        let start =
            atlas.charts()[0].state().pitch(0.3).yaw_rate(1.0).pitch_rate(0.1).roll_rate(0.2).motor(0.0);
        let start = start.build().expect("finite");
        let run = atlas.simulate(start).until(6.0);
        let motion = run.with(|run, _| run.tolerance(1e-9).max_step(0.05).inputs(law)).run();
        motion.map(|motion| motion.changes().len()).map_err(|error| {
            let part = error.motion(&atlas).map_or(0.0, |motion| motion.end_time());
            match error.kind {
                ChartSwitchingErrorKind::Chart(ChartError::Disagree { what, name, time, .. }) => {
                    assert!(error.time == time && time > 0.0 && part >= time, "{time} of {part}");
                    (what, name, time)
                }
                _ => panic!("{error}"),
            }
        })
    };
    let idle = |_: f64, _: &State<Pushed>| [0.0];
    let angular = (Compared::AngularAcceleration, "pitch");
    // What is said by the frame is the same in both, also where steps end at its jumps.
    for model in [none.clone(), Pushed { framed: 0.5, ..none.clone() }] {
        let found = run(model, idle);
        assert!(found.is_ok(), "{found:?}");
    }
    let (what, name, time) =
        run(Pushed { band: 1.0, ..none.clone() }, idle).expect_err("a band of one chart");
    assert!((what, name) == angular && time > 0.2, "{what:?} of {name} at {time}");
    let (what, name, time) =
        run(Pushed { pulse: 1.0, ..none.clone() }, idle).expect_err("a pulse along an angle");
    assert!((what, name) == angular && (1.0..1.1).contains(&time), "{what:?} of {name} at {time}");
    let pulsed = |t: f64, state: &State<Pushed>| [if (1.0..1.3).contains(&t) { state.yaw() } else { 0.0 }];
    let (what, name, time) = run(none, pulsed).expect_err("a pulse of a law that reads an angle");
    assert!(
        (what, name) == (Compared::Input, "motor") && (1.0..1.1).contains(&time),
        "{what:?} of {name} at {time}"
    );
}

/// In steady spin, at rest, and hanging at rest, accelerations and inputs are zero but for rounding, which
/// differs from chart to chart and is no disagreement.
#[test]
fn rounding_alone_is_no_disagreement() {
    let atlas = ChartSwitching::new(CRAFT).turning("pitch", right).expect("a set with a reference");
    let law = |model: &Craft, state: &State<Craft>| {
        let q = Craft::coordinates_with(state, &nalgebra::SVector::zeros(), &[]);
        [0.2 * model.frame(&q).x().value().z]
    };
    for (pitch, rate) in [(0.0, 1.0), (0.0, 0.0), (0.3, 0.0)] {
        let start = CRAFT.state().yaw(0.7).pitch(pitch).yaw_rate(rate).motor(0.0).build().expect("finite");
        for driven in [false, true] {
            let run = atlas.simulate(start).until(5.0);
            let run = run
                .with(|run, model| if driven { run.inputs(move |_, state| law(model, state)) } else { run });
            let motion = run.run();
            assert!(motion.is_ok(), "pitch {pitch}, rate {rate}: {:?}", motion.err());
        }
    }
    let model = Zyx::new(9.81, TUMBLING);
    let hanging = model.start(Mat3::rotation_x(-core::f64::consts::FRAC_PI_2), Vec3::new(0.0, 0.0, 0.0));
    let atlas = model.atlas();
    let motion = atlas.simulate(hanging).until(5.0).run();
    assert!(motion.is_ok(), "{:?}", motion.err());
}
