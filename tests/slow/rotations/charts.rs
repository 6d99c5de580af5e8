//! Rotations in every chart, against one another and against Euler's equations: accelerations, and motions.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

use dynamics::prelude::*;
use proptest::prelude::*;

/// A heavy body that turns about a fixed point, its orientation in one of the charts, with a moment on it.
macro_rules! top {
    ($($Name:ident $euler:ident $Sequence:ident)*) => {$(
        /// A heavy body that turns about a fixed point.
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(angles: [rad; 3])]
        pub struct $Name {
            /// Mass.
            pub m: f64,
            /// Center of mass in the body.
            pub center: Vec3<f64>,
            /// Inertia about it.
            pub inertia: Mat3<f64>,
            /// Weight per mass.
            pub gravity: Vec3<f64>,
            /// A moment.
            pub moment: Vec3<f64>,
        }
        #[dynamics]
        impl $Name {
            fn body(&self, q: &Coordinates<Self>) -> RigidBody {
                let frame = Frame::turned(Mat3::$euler(EulerSequence::$Sequence, q.angles));
                RigidBody::new(self.m, self.center, self.inertia, frame)
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).kinetic_energy()
            }
            #[potential]
            fn weight(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).potential_energy(self.gravity)
            }
            #[force]
            fn motor(&self, q: &Coordinates<Self>) -> Force {
                self.body(q).moment(self.moment)
            }
        }
        impl $Name {
            /// The model and its state, unless the chart is singular within this measure.
            fn placed(case: &Case, conditioning: f64) -> Option<(Self, State<Self>)> {
                let Case { m, center, inertia, gravity, moment, .. } = case.clone();
                let model = Self { m, center, inertia, gravity, moment };
                let read = if stringify!($euler) == "euler" {
                    case.rotation.to_euler(EulerSequence::$Sequence)
                } else {
                    case.rotation.to_euler_space(EulerSequence::$Sequence)
                };
                let read = read.expect("a rotation");
                if read.conditioning < conditioning {
                    return None;
                }
                // ω is linear in the rates: one after another is 1.
                let state =
                    |rates| model.state().angles(read.angles).angles_rate(rates).build().expect("finite");
                let omega = |rates: [f64; 3]| {
                    let q = Self::coordinates_with(&state(rates), &nalgebra::SVector::zeros(), &[]);
                    model.body(&q).frame.angular_velocity_in_body().value()
                };
                let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(omega);
                let matrix = nalgebra::Matrix3::from_columns(&columns.map(nalgebra::Vector3::from));
                let rates = matrix.lu().solve(&case.omega.into()).expect("the chart is regular");
                let state = state(rates.into());
                Some((model, state))
            }
        }
        impl Chart for $Name {
            fn angular_acceleration(case: &Case) -> Option<Vec3<f64>> {
                let (model, state) = Self::placed(case, 0.1)?;
                let accelerations = model.accelerations(&state).expect("the chart is regular");
                let q = Self::coordinates_with(&state, &accelerations, &[]);
                Some(model.body(&q).frame.angular_velocity_in_body().rate())
            }
            fn later(case: &Case) -> Option<(Mat3<f64>, Vec3<f64>)> {
                let (model, state) = Self::placed(case, 0.5)?;
                let motion = model.simulate(state).until(WHILE).tolerance(1e-13).run().expect("the chart is \
                    regular nearby");
                let q = Self::coordinates_with(&motion.end(), &nalgebra::SVector::zeros(), &[]);
                let frame = model.body(&q).frame;
                Some((frame.rotation().value(), frame.angular_velocity_in_body().value()))
            }
        }
    )*};
}

/// What every chart has to agree about.
#[derive(Clone, Debug)]
struct Case {
    rotation: Mat3<f64>,
    /// In the body.
    omega: Vec3<f64>,
    m: f64,
    center: Vec3<f64>,
    inertia: Mat3<f64>,
    gravity: Vec3<f64>,
    moment: Vec3<f64>,
}

trait Chart {
    /// ω̇ in the body; none next to where the chart is singular.
    fn angular_acceleration(case: &Case) -> Option<Vec3<f64>>;

    /// Rotation and ω in the body a while later; none where the chart is singular nearby.
    fn later(case: &Case) -> Option<(Mat3<f64>, Vec3<f64>)>;
}

/// How long the charts are moved.
const WHILE: f64 = 0.1;

top! {
    BodyXyz euler Xyz
    BodyXzy euler Xzy
    BodyYxz euler Yxz
    BodyYzx euler Yzx
    BodyZxy euler Zxy
    BodyZyx euler Zyx
    BodyXyx euler Xyx
    BodyXzx euler Xzx
    BodyYxy euler Yxy
    BodyYzy euler Yzy
    BodyZxz euler Zxz
    BodyZyz euler Zyz
    SpaceXyz euler_space Xyz
    SpaceZxz euler_space Zxz
    SpaceYxz euler_space Yxz
    SpaceXzx euler_space Xzx
}

/// The same body in Euler parameters.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(e: [_; 4])]
pub struct Parametrised {
    /// Mass.
    pub m: f64,
    /// Center of mass in the body.
    pub center: Vec3<f64>,
    /// Inertia about it.
    pub inertia: Mat3<f64>,
    /// Weight per mass.
    pub gravity: Vec3<f64>,
    /// A moment.
    pub moment: Vec3<f64>,
}

#[dynamics]
impl Parametrised {
    fn body(&self, q: &Coordinates<Self>) -> RigidBody {
        RigidBody::new(self.m, self.center, self.inertia, Frame::turned(EulerParameters::new(q.e).rotation()))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).kinetic_energy()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).potential_energy(self.gravity)
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        self.body(q).moment(self.moment)
    }
    #[holonomic]
    fn unit(&self, q: &Coordinates<Self>) -> Expr {
        EulerParameters::new(q.e).norm_constraint()
    }
}

impl Parametrised {
    fn placed(case: &Case) -> (Self, State<Self>) {
        let Case { m, center, inertia, gravity, moment, .. } = case.clone();
        let model = Self { m, center, inertia, gravity, moment };
        let e = case.rotation.to_euler_parameters().expect("a rotation");
        let (w, v) = (case.omega, Vec3::new(e[1], e[2], e[3]));
        let rate = 0.5 * (e[0] * w + v.cross(w));
        let rates = [-0.5 * v.dot(w), rate.x, rate.y, rate.z];
        let state = model.state().e(e).e_rate(rates).build().expect("the norm is 1, its rate 0");
        (model, state)
    }
}

impl Chart for Parametrised {
    fn angular_acceleration(case: &Case) -> Option<Vec3<f64>> {
        let (model, state) = Self::placed(case);
        let accelerations = model.accelerations(&state).expect("the norm constraint is regular");
        let q = Self::coordinates_with(&state, &accelerations, &[]);
        Some(model.body(&q).frame.angular_velocity_in_body().rate())
    }
    fn later(case: &Case) -> Option<(Mat3<f64>, Vec3<f64>)> {
        let (model, state) = Self::placed(case);
        let motion = model.simulate(state).until(WHILE).tolerance(1e-13).run().expect("no place is singular");
        let q = Self::coordinates_with(&motion.end(), &nalgebra::SVector::zeros(), &[0.0]);
        let frame = model.body(&q).frame;
        Some((frame.rotation().value(), frame.angular_velocity_in_body().value()))
    }
}

/// Euler's equations about the fixed point, by hand: I ω̇ + ω×I ω = M.
fn by_euler(case: &Case) -> Vec3<f64> {
    let inertia = case.inertia + Inertia::offset(case.m, case.center).value();
    let back = case.rotation.transpose();
    let moment = back * case.moment + case.m * case.center.cross(back * case.gravity);
    let right = moment - case.omega.cross(inertia * case.omega);
    nalgebra::Matrix3::from(inertia).lu().solve(&right.into()).expect("a body has inertia").into()
}

proptest! {
    /// Angular velocities in the body are no true velocities, and every chart writes them differently: all
    /// give the acceleration of Euler's equations.
    #[test]
    fn every_chart_moves_alike(
        angles in proptest::array::uniform3(-3.0..3.0_f64),
        omega in proptest::array::uniform3(-2.0..2.0_f64),
        center in proptest::array::uniform3(-0.5..0.5_f64),
        moment in proptest::array::uniform3(-1.0..1.0_f64),
        axes in proptest::array::uniform3(-3.0..3.0_f64),
    ) {
        let case = case(angles, omega, center, moment, axes);
        let expected = by_euler(&case);
        macro_rules! compare {
            ($($Name:ident)*) => {$(
                if let Some(found) = $Name::angular_acceleration(&case) {
                    // Next to where a chart is singular it loses digits: at most a factor of a hundred is let
                    // in.
                    let error = (found - expected).norm();
                    prop_assert!(error < 1e-11 * (1.0 + expected.norm()), "{}: {:?} instead of \
                        {:?}", stringify!($Name), found, expected);
                }
            )*};
        }
        compare!(BodyXyz BodyXzy BodyYxz BodyYzx BodyZxy BodyZyx
            BodyXyx BodyXzx BodyYxy BodyYzy BodyZxz BodyZyz);
        compare!(SpaceXyz SpaceZxz SpaceYxz SpaceXzx Parametrised);
    }
}

fn case(angles: [f64; 3], omega: [f64; 3], center: [f64; 3], moment: [f64; 3], axes: [f64; 3]) -> Case {
    let turned = Mat3::euler(EulerSequence::Zxz, axes);
    Case {
        rotation: Mat3::euler(EulerSequence::Zyx, angles),
        omega: Vec3::from(omega),
        m: 1.3,
        center: Vec3::from(center),
        inertia: turned * Mat3::diagonal(0.5, 0.8, 1.1) * turned.transpose(),
        gravity: Vec3::new(0.5, -1.0, -9.0),
        moment: Vec3::from(moment),
    }
}

/// The same by Euler's equations and Ṙ = R ω×, in steps of the classical Runge–Kutta method: no chart at all.
fn later_by_euler(case: &Case) -> (Mat3<f64>, Vec3<f64>) {
    let rates = |rotation: Mat3<f64>, omega: Vec3<f64>| {
        (rotation * Mat3::skew(omega), by_euler(&Case { rotation, omega, ..case.clone() }))
    };
    let (mut rotation, mut omega) = (case.rotation, case.omega);
    let steps = 400;
    let h = WHILE / f64::from(steps);
    for _ in 0..steps {
        let (a, p) = rates(rotation, omega);
        let (b, r) = rates(rotation + a * (0.5 * h), omega + p * (0.5 * h));
        let (c, s) = rates(rotation + b * (0.5 * h), omega + r * (0.5 * h));
        let (d, t) = rates(rotation + c * h, omega + s * h);
        rotation += (a + (b + c) * 2.0 + d) * (h / 6.0);
        omega += (p + (r + s) * 2.0 + t) * (h / 6.0);
    }
    (rotation, omega)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Body-fixed and space-fixed sequences and Euler parameters in motion, against no chart at all.
    #[test]
    fn every_chart_arrives_at_the_same_place(
        angles in proptest::array::uniform3(-3.0..3.0_f64),
        omega in proptest::array::uniform3(-2.0..2.0_f64),
        center in proptest::array::uniform3(-0.5..0.5_f64),
        moment in proptest::array::uniform3(-1.0..1.0_f64),
        axes in proptest::array::uniform3(-3.0..3.0_f64),
    ) {
        let case = case(angles, omega, center, moment, axes);
        let (rotation, omega) = later_by_euler(&case);
        let mut arrived = 0;
        macro_rules! compare {
            ($($Name:ident)*) => {$(
                if let Some((r, w)) = $Name::later(&case) {
                    let difference = (r - rotation).to_array();
                    let apart = difference.as_flattened().iter()
                        .fold(0.0, |most: f64, x| most.max(x.abs()));
                    let error = apart + (w - omega).norm();
                    prop_assert!(error < 1e-9, "{}: {error:e} off", stringify!($Name));
                    arrived += 1;
                }
            )*};
        }
        compare!(BodyXyz BodyXzy BodyYxz BodyYzx BodyZxy BodyZyx
            BodyXyx BodyXzx BodyYxy BodyYzy BodyZxz BodyZyz);
        compare!(SpaceXyz SpaceZxz SpaceYxz SpaceXzx Parametrised);
        prop_assert!(arrived >= 4, "{arrived} charts are regular here");
    }
}
