//! Charts that change: tumbling through the poles in three angles whose reference is turned in time, beside
//! Euler parameters; and models whose charts are not of one motion.

use crate::parametrised;

use dynamics::prelude::*;
use dynamics::simulate::{ChartError, ChartSwitching, ChartSwitchingErrorKind, Compared};
use parametrised::Parametrised;

/// A heavy body that turns about a fixed point, in angles with a reference.
macro_rules! heavy {
    ($($Name:ident $Sequence:ident $rotation:ident)*) => {$(
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(angles: [rad; 3])]
        #[units(m: kg, length: m, inertia: kg * m^2, g: m / s^2, reference: rad)]
        struct $Name {
            m: f64,
            length: f64,
            inertia: Vec3<f64>,
            g: f64,
            /// Turn of what the angles are measured from.
            reference: f64,
        }
        #[dynamics]
        impl $Name {
            fn body(&self, q: &Coordinates<Self>) -> RigidBody {
                let [a, b, c] = self.inertia.to_array();
                let turned =
                    Mat3::$rotation(self.reference) * Mat3::euler(EulerSequence::$Sequence, q.angles);
                RigidBody::new(self.m, self.length * Vec3::Y, Mat3::diagonal(a, b, c), Frame::turned(turned))
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).kinetic_energy()
            }
            #[potential]
            fn weight(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).potential_energy(-self.g * Vec3::Z)
            }
            #[output]
            fn axis(&self, q: &Coordinates<Self>) -> Vec3 {
                self.body(q).frame.y()
            }
            #[output]
            fn spin(&self, q: &Coordinates<Self>) -> Vec3 {
                self.body(q).frame.angular_velocity()
            }
            #[event]
            fn level(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).frame.y().z
            }
        }
        impl Heavy for $Name {
            fn new(g: f64, inertia: [f64; 3]) -> Self {
                Self { m: 15.0, length: 1.0, inertia: inertia.into(), g, reference: 0.0 }
            }
            fn atlas(self) -> ChartSwitching<Self> {
                ChartSwitching::new(self)
                    .turning("angles[1]", |model, turn| model.reference = turn)
                    .expect("a set with a reference")
            }
            fn start(&self, rotation: Mat3<f64>, omega: Vec3<f64>) -> State<Self> {
                let read = rotation.to_euler(EulerSequence::$Sequence).expect("a rotation");
                // ω is linear in the rates.
                let state =
                    |rates| self.state().angles(read.angles).angles_rate(rates).build().expect("finite");
                let of = |rates: [f64; 3]| {
                    let q = Self::coordinates_with(&state(rates), &nalgebra::SVector::zeros(), &[]);
                    nalgebra::Vector3::from(self.body(&q).frame.angular_velocity().value())
                };
                let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(of);
                let columns = nalgebra::Matrix3::from_columns(&columns);
                let rates = columns.lu().solve(&omega.into()).expect("regular");
                state(rates.into())
            }
            fn rotation(&self, q: &Coordinates<Self>) -> Mat3<f64> {
                self.body(q).frame.rotation().value()
            }
        }
    )*};
}

trait Heavy: Simulate + Clone {
    fn new(g: f64, inertia: [f64; 3]) -> Self;
    fn atlas(self) -> ChartSwitching<Self>;
    fn start(&self, rotation: Mat3<f64>, omega: Vec3<f64>) -> State<Self>;
    fn rotation(&self, q: &Coordinates<Self>) -> Mat3<f64>;
}

heavy! {
    Xyz Xyz rotation_y
    Xzy Xzy rotation_z
    Yxz Yxz rotation_x
    Yzx Yzx rotation_z
    Zxy Zxy rotation_x
    Zyx Zyx rotation_y
    Xyx Xyx rotation_y
    Xzx Xzx rotation_z
    Yxy Yxy rotation_x
    Yzy Yzy rotation_z
    Zxz Zxz rotation_x
    Zyz Zyz rotation_y
}

impl Parametrised {
    fn run(
        g: f64,
        inertia: [f64; 3],
        rotation: Mat3<f64>,
        omega: Vec3<f64>,
        times: &[f64],
        tolerance: f64,
    ) -> Vec<Mat3<f64>> {
        let model = Self { m: 15.0, length: 1.0, inertia: inertia.into(), g };
        let e = rotation.to_euler_parameters().expect("a rotation");
        let v = Vec3::new(e[1], e[2], e[3]);
        // ė₀ = −½ v·ω, v̇ = ½(e₀ω − v×ω), with ω in the world.
        let rate = 0.5 * (e[0] * omega - v.cross(omega));
        let rates = [-0.5 * v.dot(omega), rate.x, rate.y, rate.z];
        let start = model.state().e(e).e_rate(rates).build().expect("a unit quadruple");
        let end = times[times.len() - 1];
        let motion =
            model.simulate(start).until(end).tolerance(tolerance).run().expect("no place is singular");
        let at = |t: &f64| model.body(&motion.coordinates_at(*t)).frame.rotation().value();
        times.iter().map(at).collect()
    }
}

fn apart(a: Mat3<f64>, b: Mat3<f64>) -> f64 {
    (a - b).to_array().into_iter().flatten().fold(0.0, |m: f64, x| if x.abs() <= m { m } else { x.abs() })
}

const TUMBLING: [f64; 3] = [10.0, 6.0, 14.0];
const TIMES: [f64; 5] = [0.5, 1.0, 2.5, 5.0, 10.0];

/// How far the rotation is from that of Euler parameters at [`TIMES`], how far these are from themselves at
/// another tolerance, and how often charts changed.
fn followed<M: Heavy>(rotation: Mat3<f64>, omega: Vec3<f64>) -> (f64, f64, usize) {
    let (g, inertia) = (1.5, TUMBLING);
    let model = M::new(g, inertia);
    let start = model.start(rotation, omega);
    let atlas = model.atlas();
    let motion =
        atlas.simulate(start).until(10.0).with(|run, _| run.tolerance(1e-12)).run().expect("no chart locks");
    let right =
        [1e-13, 1e-11].map(|tolerance| Parametrised::run(g, inertia, rotation, omega, &TIMES, tolerance));
    let at = |t: &f64| motion.at(*t).model.rotation(&motion.coordinates_at(*t));
    let largest = |m: f64, x: f64| if x <= m { m } else { x };
    let error = TIMES.iter().zip(&right[0]).map(|(t, right)| apart(at(t), *right)).fold(0.0, largest);
    let spread = right[0].iter().zip(&right[1]).map(|(a, b)| apart(*a, *b)).fold(0.0, largest);
    (error, spread, motion.changes().len())
}

/// Every set, tumbling with weight through whatever poles it has.
#[test]
fn every_set_tumbles_through_its_poles() {
    let rotation = Mat3::euler(EulerSequence::Zyx, [0.4, 0.8, -0.6]);
    let mut all = 0;
    macro_rules! each {
        ($($Name:ident)*) => {$(
            let mut changed = 0;
            for omega in [Vec3::new(2.0, -1.5, 1.0), Vec3::new(-1.0, 2.5, 3.5), Vec3::new(3.0, 0.5, -2.5)] {
                let (error, spread, changes) = followed::<$Name>(rotation, omega);
                println!("{}: {error:.1e} beside {spread:.1e} after {changes} changes", stringify!($Name));
                assert!(error < spread.max(1e-10) && spread < 1e-7, "{}: {error:.1e} beside \
                    {spread:.1e}", stringify!($Name));
                changed += changes;
            }
            assert!(changed > 0, "{}: no chart is changed", stringify!($Name));
            all += changed;
        )*};
    }
    each!(Xyz Xzy Yxz Yzx Zxy Zyx Xyx Xzx Yxy Yzy Zxz Zyz);
    assert!(all > 50, "{all} changes");
}

/// The heavy top of Brüls and Cardona passes within 7.24e-7 rad of where its 3-1-2 set locks, at t = 0.3726:
/// the published digits, to where angles that do not lock at all have them.
#[test]
fn the_heavy_top_passes_its_pole() {
    let model = Zxy {
        m: 15.0,
        length: 1.0,
        inertia: Vec3::new(0.234375, 0.46875, 0.234375),
        g: 9.81,
        reference: 0.0,
    };
    let start = model.state().angles_rate([-4.61538, 0.0, 150.0]).build().expect("finite");
    let atlas = model.atlas();
    let motion =
        atlas.simulate(start).until(2.0).with(|run, _| run.tolerance(1e-13)).run().expect("no chart locks");
    let reference = [
        (0.1, [0.421296658925402, 0.894571974345593, -0.1491647005618996]),
        (0.5, [-0.7024682970565856, -0.021165184702323328, -0.7114002576517344]),
        (1.0, [0.17334396409838604, 0.6400885920705688, -0.7484907911335813]),
        (2.0, [-0.15041682274564175, -0.7241655916368956, -0.6730222695604441]),
    ];
    for (t, wanted) in reference {
        for (name, wanted) in ["axis.x", "axis.y", "axis.z"].into_iter().zip(wanted) {
            let error = (motion.output(name, t).expect("it reaches there") - wanted).abs();
            assert!(error < 1e-11, "t = {t}: {name} is off by {error:.1e}");
        }
    }
    let summary = motion.verify();
    println!("{summary}");
    assert!(summary.energy_drift < 1e-11 && summary.changes.len() >= 2, "{summary}");
    let text = summary.to_string();
    assert!(text.contains("the 3-1-2 set of `angles[1]`") && !text.contains("gimbal lock"), "{text}");
    assert!(summary.segments.iter().all(|segment| segment.gimbal_lock.is_none()), "{text}");
}

/// Outputs, energy and events know of no chart: they go on where it changes, table and page included.
#[test]
fn what_is_seen_goes_on() {
    let model = Zxz::new(1.5, TUMBLING);
    let start = model.start(Mat3::euler(EulerSequence::Zyx, [0.4, 0.8, -0.6]), Vec3::new(-1.0, 2.5, 3.5));
    let atlas = model.atlas();
    let motion =
        atlas.simulate(start).until(10.0).with(|run, _| run.tolerance(1e-10)).run().expect("no chart locks");
    assert!(motion.changes().len() > 2, "{}", motion.verify());
    let mut jumps = 0;
    for pair in motion.segments().windows(2) {
        let [before, after] = [&pair[0].motion, &pair[1].motion];
        let t = after.start_time();
        assert_eq!(before.end_time(), t);
        for (a, b) in before.outputs_at(t).iter().zip(after.outputs_at(t)) {
            assert!((a - b).abs() < 1e-13, "an output jumps from {a} to {b} at t = {t}");
        }
        let energies = [before.energy_at(t), after.energy_at(t)];
        assert!((energies[0] - energies[1]).abs() < 1e-12 * energies[0].abs(), "{energies:?}");
        jumps += usize::from((before.end().q[0] - after.start().q[0]).abs() > 0.1);
        // What a state means is known from its chart.
        let placed = motion.at(t);
        assert_eq!((placed.chart, placed.state), (pair[1].chart, after.start()));
    }
    assert!(jumps > 0, "the angles themselves are not those of before");
    // Crossings of the level are those of Euler parameters, each met once.
    let times: Vec<f64> = (0..=4000).map(|k| 0.0025 * f64::from(k)).collect();
    let rotation = Mat3::euler(EulerSequence::Zyx, [0.4, 0.8, -0.6]);
    let heights = Parametrised::run(1.5, TUMBLING, rotation, Vec3::new(-1.0, 2.5, 3.5), &times, 1e-12);
    let heights: Vec<f64> = heights.iter().map(|r| r.column(1).z).collect();
    let crossings: Vec<f64> =
        (1..heights.len()).filter(|k| heights[k - 1] * heights[*k] < 0.0).map(|k| times[k]).collect();
    let found: Vec<f64> = motion.events().map(|event| event.time()).collect();
    assert_eq!(found.len(), crossings.len(), "{found:?} instead of {crossings:?}");
    assert!(
        found.iter().zip(&crossings).all(|(a, b)| (b - a) >= 0.0 && (b - a) < 0.0025),
        "{found:?}, {crossings:?}"
    );
    assert!(found.len() > 3);
    // The table says in which chart its angles are; the chart has a line for each change.
    let table = motion.to_csv();
    assert!(table.starts_with("chart,t [s],"), "{}", table.lines().next().unwrap_or_default());
    assert_eq!(
        table.lines().count(),
        1 + motion.segments().iter().map(|segment| segment.motion.steps().len()).sum::<usize>()
    );
    assert!(motion.outputs_chart().to_svg().contains("change of chart"));
    let page = motion.animation().to_html().expect("a page");
    assert!(page.contains("axis.x") && !page.contains("angles[0]"));
    // Outside there is nothing.
    assert!(
        motion.at(-1.0).state.q[0].is_nan()
            && motion.at(11.0).state.q[0].is_nan()
            && motion.output("axis.x", 11.0).is_err()
    );
}

/// Back to where it came from, through the same changes.
#[test]
fn backwards_in_time() {
    let model = Zyx::new(1.5, TUMBLING);
    let start = model.start(Mat3::euler(EulerSequence::Zyx, [0.4, 0.8, -0.6]), Vec3::new(2.0, -1.5, 1.0));
    let atlas = model.clone().atlas();
    let there =
        atlas.simulate(start).until(10.0).with(|run, _| run.tolerance(1e-12)).run().expect("no chart locks");
    let end = there.end();
    let turned = end.model.clone();
    assert!(there.changes().len() > 1);
    // Read anew in the chart that was given.
    let (rotation, omega) =
        (turned.body(&there.coordinates_at(10.0)).frame.rotation().value(), there.outputs_at(10.0));
    let mut back = model.start(rotation, Vec3::new(omega[3], omega[4], omega[5]));
    back.t = 10.0;
    let motion =
        atlas.simulate(back).until(0.0).with(|run, _| run.tolerance(1e-12)).run().expect("no chart locks");
    let first = motion.end();
    let found = first.model.rotation(&motion.coordinates_at(0.0));
    let error = apart(found, Mat3::euler(EulerSequence::Zyx, [0.4, 0.8, -0.6]));
    assert!(error < 1e-10 && motion.changes().len() > 1, "{error:.1e}");
}

/// In gimbal lock the angles cannot start, but the body can: the chart changes before the first step.
#[test]
fn a_start_in_gimbal_lock() {
    let model = Zxz::new(1.5, TUMBLING);
    let start = model.state().angles([0.3, 0.0, 0.4]).angles_rate([1.0, 0.5, 2.0]).build().expect("finite");
    let error = model.simulate(start).until(1.0).run().expect_err("the angles are locked").to_string();
    assert!(
        error.contains("gimbal lock")
            && error.contains("ChartSwitching")
            && error.contains("EulerParameters::new(q.e)"),
        "{error}"
    );
    let rotation = Mat3::rotation_z(0.7);
    // ω = ψ̇ z + ϑ̇ (x turned by the first angle) + φ̇ z.
    let omega = Vec3::new(0.5 * 0.3_f64.cos(), 0.5 * 0.3_f64.sin(), 3.0);
    let atlas = model.atlas();
    let motion =
        atlas.simulate(start).until(10.0).with(|run, _| run.tolerance(1e-12)).run().expect("no chart locks");
    assert_eq!(motion.changes()[0].time, 0.0);
    let right = Parametrised::run(1.5, TUMBLING, rotation, omega, &TIMES, 1e-12);
    for (t, right) in TIMES.into_iter().zip(right) {
        let error = apart(motion.at(t).model.rotation(&motion.coordinates_at(t)), right);
        assert!(error < 1e-10, "t = {t}: {error:.1e}");
    }
}

/// A body with a wheel and a motor, and with what must not be said by the angles: each where its parameter is
/// not 0.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(yaw: rad, pitch: rad, roll: rad, wheel: rad)]
#[inputs(motor: N * m)]
struct Craft {
    inertia: Vec3<f64>,
    rotor: f64,
    /// Turn of the reference about the right axis, and about a wrong one.
    reference: f64,
    misplaced: f64,
    spring: f64,
    shown: f64,
    seen: f64,
}
#[dynamics]
impl Craft {
    fn frame(&self, q: &Coordinates<Self>) -> Frame {
        let reference = Mat3::rotation_y(self.reference) * Mat3::rotation_x(self.misplaced);
        Frame::turned(reference * Mat3::euler(EulerSequence::Zyx, [q.yaw, q.pitch, q.roll]))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let [a, b, c] = self.inertia.to_array();
        let omega = self.frame(q).angular_velocity_in_body();
        self.frame(q).rotation().rotational_energy(Mat3::diagonal(a, b, c))
            + 0.5 * self.rotor * (omega.x + q.wheel.dt()).powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.spring * q.pitch.powi(2)
    }
    #[force]
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.wheel, q.motor)
    }
    #[output]
    fn forward(&self, q: &Coordinates<Self>) -> Vec3 {
        self.frame(q).x() + self.shown * q.roll * Vec3::X
    }
    #[event]
    fn passes(&self, q: &Coordinates<Self>) -> Expr {
        self.frame(q).x().z + self.seen * q.yaw
    }
}

const CRAFT: Craft = Craft {
    inertia: Vec3::new(2.0, 3.0, 4.0),
    rotor: 0.5,
    reference: 0.0,
    misplaced: 0.0,
    spring: 0.0,
    shown: 0.0,
    seen: 0.0,
};

fn right(model: &mut Craft, turn: f64) {
    model.reference = turn;
}

/// A law that asks the model where the body is goes on; angular momentum about all axes is what it was.
#[test]
fn a_wheel_with_a_law() {
    let atlas = ChartSwitching::new(CRAFT).turning("pitch", right).expect("a set with a reference");
    let start = CRAFT
        .state()
        .yaw_rate(0.4)
        .pitch_rate(1.0)
        .roll_rate(0.3)
        .wheel_rate(5.0)
        .motor(0.0)
        .build()
        .expect("finite");
    let law = |model: &Craft, state: &State<Craft>| {
        let q = Craft::coordinates_with(state, &nalgebra::SVector::zeros(), &[]);
        [0.2 * model.frame(&q).x().value().z]
    };
    let run = atlas.simulate(start).until(10.0);
    let motion = run
        .with(|run, model| run.tolerance(1e-11).inputs(move |_, state| law(model, state)))
        .run()
        .expect("no chart locks");
    assert!(motion.changes().len() > 2, "{}", motion.verify());
    let momentum = |t: f64| {
        let (at, q) = (motion.at(t), motion.coordinates_at(t));
        let frame = at.model.frame(&q);
        let omega = frame.angular_velocity_in_body().value();
        let wheel = 0.5 * (omega.x + at.state.wheel_rate());
        frame.rotation().value() * Vec3::new(2.0 * omega.x + wheel, 3.0 * omega.y, 4.0 * omega.z)
    };
    let first = momentum(0.0);
    for t in [1.0, 3.0, 7.0, 10.0] {
        let drift = (momentum(t) - first).norm();
        assert!(drift < 1e-9, "t = {t}: the momentum drifts by {drift:.1e}");
    }
    // One that reads the angles does not.
    let run = atlas.simulate(start).until(10.0);
    let error = run.with(|run, _| run.inputs(|_, state| [state.pitch()])).run().expect_err("the law jumps");
    let ChartSwitchingErrorKind::Chart(ChartError::Disagree { what: Compared::Input, name: "motor", .. }) =
        error.kind
    else {
        panic!("{error}");
    };
    assert!(error.to_string().contains("have the law ask the model"), "{error}");
    let motion = error.motion(&atlas).expect("a part was run");
    // Seen where the charts first differ; the part that was run is in hand.
    assert!(
        motion.end_time() > 0.1 && error.time < motion.end_time(),
        "{} of {}",
        error.time,
        motion.end_time()
    );
}

/// Instants late in time are known less closely than the distance to locking: a chart changes all the same,
/// once each time.
#[test]
fn late_in_time() {
    let model = Zxz::new(0.0, TUMBLING);
    let mut start =
        model.state().angles([0.0, 1.5, 0.0]).angles_rate([300.0, 1000.0, 0.0]).build().expect("finite");
    let changes = [0.0, 1e9].map(|time| {
        start.t = time;
        let atlas = model.clone().atlas();
        let run = atlas.simulate(start).until(time + 0.03).with(|run, _| run.tolerance(1e-6).max_steps(2000));
        run.run().map(|motion| motion.changes().len()).unwrap_or_else(|error| panic!("{error}"))
    });
    assert!(changes[0] > 3 && changes[0].abs_diff(changes[1]) <= 1, "{changes:?}");
}

/// A motion goes on from where another one ended, in the chart of that place.
#[test]
fn goes_on_from_a_place() {
    let model = Zyx::new(1.5, TUMBLING);
    let start = model.start(Mat3::euler(EulerSequence::Zyx, [0.4, 0.8, -0.6]), Vec3::new(2.0, -1.5, 1.0));
    let atlas = model.atlas();
    let whole =
        atlas.simulate(start).until(10.0).with(|run, _| run.tolerance(1e-12)).run().expect("no chart locks");
    let turned =
        whole.segments().iter().find(|segment| segment.chart == 1).expect("a part in the turned chart");
    let time = 0.5 * (turned.motion.start_time() + turned.motion.end_time());
    let place = whole.at(time);
    let rest =
        atlas.resume(&place).until(10.0).with(|run, _| run.tolerance(1e-12)).run().expect("no chart locks");
    assert_eq!((rest.segments()[0].chart, rest.start_time()), (1, time));
    let wanted: Vec<f64> = whole.changes().iter().map(|change| change.time).filter(|t| *t > time).collect();
    let found: Vec<f64> = rest.changes().iter().map(|change| change.time).collect();
    assert!(
        found.len() == wanted.len() && found.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-8),
        "{found:?}"
    );
    for (a, b) in whole.outputs_at(10.0).iter().zip(rest.outputs_at(10.0)) {
        assert!((a - b).abs() < 1e-9, "{a} and {b}");
    }
    // Of an atlas without that chart it is no place.
    let single = ChartSwitching::new(place.model.clone());
    let error = single.resume(&place).until(10.0).run().expect_err("another atlas").to_string();
    assert!(error.contains("resume a motion with the chart switching that made it"), "{error}");
}

mod differences;
mod refusals;
