//! Published problems of bodies in space, written with frames and bodies, to their published end values.
//!
//! The reference values were computed in multi-precision arithmetic by two independent routes; they are
//! rounded to `f64` here.

use dynamics::prelude::*;
use dynamics::simulate::SimulationError;

use crate::parametrised;
use crate::rolling_disk as disk;

/// Largest absolute difference.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    // A NaN is as far away as can be.
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, |m, x| if x <= m { m } else { x })
}

/// Largest difference of the rotations of two quadruples of Euler parameters.
fn apart(rotation: Mat3<f64>, e: [f64; 4]) -> f64 {
    (rotation - Mat3::euler_parameters(e))
        .to_array()
        .into_iter()
        .flatten()
        .fold(0.0, |m, x: f64| if x.abs() <= m { m } else { x.abs() })
}

/// A free body next to a turn about its intermediate axis flips over and over (Dzhanibekov); L. D. Landau and
/// E. M. Lifshitz, *Mechanics*, §37, and M. S. Ashbaugh, C. C. Chicone and R. H. Cushman, J. Dyn. Diff. Eq. 3
/// (1991) 67.
mod free_body {
    use super::*;

    /// In Euler parameters.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(e: [_; 4])]
    struct Parametrised {
        inertia: Vec3<f64>,
    }
    #[dynamics]
    impl Parametrised {
        fn rotation(&self, q: &Coordinates<Self>) -> Mat3 {
            EulerParameters::new(q.e).rotation()
        }
        fn inertia(&self) -> Mat3<f64> {
            let [a, b, c] = self.inertia.to_array();
            Mat3::diagonal(a, b, c)
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            self.rotation(q).rotational_energy(self.inertia())
        }
        #[holonomic]
        fn unit(&self, q: &Coordinates<Self>) -> Expr {
            EulerParameters::new(q.e).norm_constraint()
        }
    }

    /// In angles, singular where the body's y axis points along z.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(angles: [rad; 3])]
    struct Angles {
        inertia: Vec3<f64>,
    }
    #[dynamics]
    impl Angles {
        fn rotation(&self, q: &Coordinates<Self>) -> Mat3 {
            Mat3::euler(EulerSequence::Zxy, q.angles)
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b, c] = self.inertia.to_array();
            self.rotation(q).rotational_energy(Mat3::diagonal(a, b, c))
        }
    }

    /// Time; Euler parameters; angular velocity in the body.
    const REFERENCE: [(f64, [f64; 4], [f64; 3]); 4] = [
        (
            10.0,
            [0.2831520338890999, 0.013711114847520597, -0.9572258061687667, -0.057928292212516906],
            [-0.11732638371977284, 0.9930939128215622, 0.06774333993527673],
        ),
        (
            50.0,
            [0.38097970919210356, -0.00999999210217757, -0.924489842150399, -0.008543600095214113],
            [0.025364086281474532, 0.9996787799723998, 0.014666706888892777],
        ),
        (
            100.0,
            [-0.6908093457250456, 0.05954519522921255, -0.6855582094995326, -0.22191610795939173],
            [0.4469607977065771, 0.8945541041845934, 0.25805422859449895],
        ),
        (
            200.0,
            [-7.249624123418155e-05, 0.49366128767406803, 0.011499935689147074, 0.8695782191818178],
            [0.024519198199601914, -0.9996998594176397, 0.014179692995634775],
        ),
    ];
    const OMEGA: [f64; 3] = [0.001, 1.0, 0.001];

    macro_rules! follow {
        ($Model:ident, $model:ident, $simulation:expr, $bounds:expr) => {{
            let bounds = $bounds;
            let motion = $simulation.until(200.0).run().expect("nothing stops a free body");
            for ((t, e, w), bound) in REFERENCE.into_iter().zip(bounds) {
                let state = motion.at(t);
                let accelerations = $model.accelerations(&state).expect("the chart is regular there");
                let rotation =
                    $model.rotation(&$Model::coordinates_with(&state, &accelerations, &[f64::NAN]));
                let (omega, r) = (rotation.angular_velocity_in_body().value(), rotation.value());
                let error = distance(&omega.to_array(), &w).max(apart(r, e));
                assert!(error < bound, "t = {t}: {error:.1e}");
                let momentum = r * Vec3::new(omega.x, 2.0 * omega.y, 3.0 * omega.z);
                let drift = distance(&momentum.to_array(), &[0.001, 2.0, 0.003]);
                assert!(drift < 1e-10, "momentum drifts by {drift:.1e}");
            }
        }};
    }

    #[test]
    fn flips_on_time() {
        let model = Parametrised { inertia: Vec3::new(1.0, 2.0, 3.0) };
        let rates = [0.0, 0.5 * OMEGA[0], 0.5 * OMEGA[1], 0.5 * OMEGA[2]];
        let start = model.state().e([1.0, 0.0, 0.0, 0.0]).e_rate(rates).build().expect("a unit quadruple");
        // Each pass by the intermediate axis shifts the next by what it missed over 0.001, the angular
        // velocity with which it leaves that: 10⁷ times the tolerance at last, and ten digits of the
        // reference where a method keeps fourteen.
        follow!(Parametrised, model, model.simulate(start).tolerance(1e-13), [5e-12, 5e-8, 5e-6, 2e-6]);
        let series = model.simulate(start).method(methods::Taylor::default()).tolerance(1e-14);
        follow!(Parametrised, model, series, [1e-13, 5e-11, 2e-10, 1e-10]);
    }

    #[test]
    fn flips_on_time_in_angles() {
        let model = Angles { inertia: Vec3::new(1.0, 2.0, 3.0) };
        // The axes are those of the coordinates at the start: rates of z, x and y.
        let start = model.state().angles_rate([OMEGA[2], OMEGA[0], OMEGA[1]]).build().expect("finite");
        follow!(Angles, model, model.simulate(start).tolerance(1e-13), [2e-11, 1e-9, 3e-7, 1e-7]);
    }
}

/// The heavy top of O. Brüls and A. Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002: its axis passes
/// within 7.24e-7 rad of straight down, at t = 0.3726 for the first time.
mod heavy_top {
    use super::parametrised::Parametrised;
    use super::*;

    macro_rules! top {
        ($Name:ident $Sequence:ident) => {
            /// In three angles.
            #[derive(Clone, Debug, Dynamics)]
            #[coordinates(angles: [rad; 3])]
            #[units(m: kg, length: m, inertia: kg * m^2, g: m / s^2)]
            struct $Name {
                m: f64,
                length: f64,
                inertia: Vec3<f64>,
                g: f64,
            }
            #[dynamics]
            impl $Name {
                fn body(&self, q: &Coordinates<Self>) -> RigidBody {
                    let [a, b, c] = self.inertia.to_array();
                    let frame = Frame::turned(Mat3::euler(EulerSequence::$Sequence, q.angles));
                    RigidBody::new(self.m, self.length * Vec3::Y, Mat3::diagonal(a, b, c), frame)
                }
                #[kinetic]
                fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                    self.body(q).kinetic_energy()
                }
                #[potential]
                fn weight(&self, q: &Coordinates<Self>) -> Expr {
                    self.body(q).potential_energy(-self.g * Vec3::Z)
                }
            }
        };
    }
    // Singular where the axis, y, points along z; singular where it points along x.
    top!(Vertical Zxy);
    top!(Level Xzy);

    /// Free in space, held by a ball and socket.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(place: [m; 3], e: [_; 4])]
    #[units(m: kg, length: m, inertia: kg * m^2, g: m / s^2)]
    struct Held {
        m: f64,
        length: f64,
        inertia: Vec3<f64>,
        g: f64,
    }
    #[dynamics]
    impl Held {
        fn body(&self, q: &Coordinates<Self>) -> RigidBody {
            let [a, b, c] = self.inertia.to_array();
            let frame = Frame::new(Vec3::from(q.place), EulerParameters::new(q.e).rotation());
            RigidBody::new(self.m, Vec3::ZERO, Mat3::diagonal(a, b, c), frame)
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            self.body(q).kinetic_energy()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.body(q).potential_energy(-self.g * Vec3::Z)
        }
        #[holonomic]
        fn unit(&self, q: &Coordinates<Self>) -> Expr {
            EulerParameters::new(q.e).norm_constraint()
        }
        #[holonomic]
        fn socket(&self, q: &Coordinates<Self>) -> Vec3 {
            Joint::spherical(Frame::world(), self.body(q).frame.frame(-self.length * Vec3::Y, Mat3::IDENTITY))
        }
    }

    /// Time; center of mass; Euler parameters.
    const REFERENCE: [(f64, [f64; 3], [f64; 4]); 4] = [
        (
            0.1,
            [0.421296658925402, 0.894571974345593, -0.1491647005618996],
            [0.3318229126083008, 0.17733805666693703, 0.914975159138728, -0.14582601443088863],
        ),
        (
            0.5,
            [-0.7024682970565856, -0.021165184702323328, -0.7114002576517344],
            [0.5845606240694147, -0.7006628954122065, 0.3843257530228944, 0.1401930788004352],
        ),
        (
            1.0,
            [0.17334396409838604, 0.6400885920705688, -0.7484907911335813],
            [0.7329439806796637, -0.2782857193376127, 0.5318246113341626, -0.3201761427362493],
        ),
        (
            2.0,
            [-0.15041682274564175, -0.7241655916368956, -0.6730222695604441],
            [0.12294713504153347, -0.49107989255002704, 0.35043003034362097, -0.7879868875504856],
        ),
    ];
    const SPIN: f64 = 150.0;
    const PRECESSION: f64 = -4.61538;

    macro_rules! parts {
        ($Name:ident) => {
            $Name { m: 15.0, length: 1.0, inertia: Vec3::new(0.234375, 0.46875, 0.234375), g: 9.81 }
        };
    }

    macro_rules! follow {
        ($Name:ident, $model:ident, $motion:expr, $bound:expr) => {{
            let motion = $motion;
            let errors = REFERENCE.map(|(t, place, e)| {
                let state = motion.at(t);
                let accelerations = $model.accelerations(&state).expect("the chart is regular there");
                let q = $Name::coordinates_with(&state, &accelerations, &[f64::NAN; 4]);
                let body = $model.body(&q);
                let error = distance(&body.center_of_mass().value().to_array(), &place);
                error.max(apart(body.frame.rotation().value(), e))
            });
            assert!(errors.iter().all(|error| *error < $bound), "{}: {errors:?}", stringify!($Name));
        }};
    }

    #[test]
    fn in_angles_that_are_regular_along_the_way() {
        let model = parts!(Level);
        let start = model.state().angles_rate([0.0, PRECESSION, SPIN]).build().expect("finite");
        let motion =
            model.simulate(start).until(2.0).tolerance(1e-13).run().expect("nothing is singular there");
        follow!(Level, model, motion, 1e-11);
    }

    #[test]
    fn in_euler_parameters() {
        let model = parts!(Parametrised);
        let start = model.state().e([1.0, 0.0, 0.0, 0.0]).e_rate([0.0, 0.0, 0.5 * SPIN, 0.5 * PRECESSION]);
        let start = start.build().expect("a unit quadruple");
        let motion =
            model.simulate(start).until(2.0).tolerance(1e-13).run().expect("nothing is singular there");
        follow!(Parametrised, model, motion, 1e-10);
    }

    #[test]
    fn in_a_socket() {
        let model = parts!(Held);
        let start = model.state().place([0.0, 1.0, 0.0]).place_rate([-PRECESSION, 0.0, 0.0]);
        let start = start.e([1.0, 0.0, 0.0, 0.0]).e_rate([0.0, 0.0, 0.5 * SPIN, 0.5 * PRECESSION]);
        let start = start.build().expect("a unit quadruple");
        let motion =
            model.simulate(start).until(2.0).tolerance(1e-13).run().expect("nothing is singular there");
        follow!(Held, model, motion, 3e-7);
        let series = model.simulate(start).method(methods::Taylor::default()).tolerance(1e-14);
        follow!(Held, model, series.until(2.0).run().expect("nothing is singular there"), 2e-9);
    }

    /// Angles about the vertical meet their singular place: whatever comes back as a motion is right.
    #[test]
    fn in_angles_that_are_singular_on_the_way() {
        let model = parts!(Vertical);
        for (tolerance, bound) in [(1e-6, 1e-4), (1e-9, 1e-6)] {
            let start = model.state().angles_rate([PRECESSION, 0.0, SPIN]).build().expect("finite");
            match model.simulate(start).until(0.5).tolerance(tolerance).run() {
                // A report is right, too.
                Err(SimulationError { time, .. }) => {
                    assert!((time - 0.3726).abs() < 0.01, "it ended at {time}")
                }
                Ok(motion) => {
                    let state = motion.at(0.5);
                    let accelerations = model.accelerations(&state).expect("regular there");
                    let body = model.body(&Vertical::coordinates_with(&state, &accelerations, &[]));
                    let error = distance(&body.center_of_mass().value().to_array(), &REFERENCE[1].1);
                    assert!(error < bound, "tolerance {tolerance:e}: off by {error:.1e}");
                    // It is named: which angle of which set, how near and when.
                    let summary = motion.verify();
                    let locking = summary.gimbal_lock.unwrap_or_else(|| panic!("{summary}"));
                    assert_eq!((locking.names[1], locking.set.to_string().as_str()), ("angles[1]", "3-1-2"));
                    assert!((locking.distance - 7.24e-7).abs() < 0.05 * 7.24e-7, "{summary}");
                    assert!((locking.time - 0.3726).abs() < 1e-4 && locking.doubtful, "{summary}");
                    assert!(
                        summary.to_string().contains("warning      gimbal lock at t = 0.37"),
                        "{summary}"
                    );
                }
            }
        }
    }
}

/// A top that stands upright and spins: stable above 2 √(A m g l)/C; H. Goldstein, *Classical Mechanics*,
/// §5.7.
mod sleeping_top {
    use super::*;

    /// In Cardan's angles, regular at the vertical.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(angles: [rad; 3])]
    #[units(m: kg, g: m / s^2, l: m, across: kg * m^2, along: kg * m^2)]
    struct Top {
        m: f64,
        g: f64,
        l: f64,
        /// Moment of inertia about the tip.
        across: f64,
        along: f64,
    }
    #[dynamics]
    impl Top {
        fn body(&self, q: &Coordinates<Self>) -> RigidBody {
            let (center, frame) =
                (self.l * Vec3::Z, Frame::turned(Mat3::euler(EulerSequence::Xyz, q.angles)));
            let inertia = Mat3::diagonal(self.across, self.across, self.along);
            RigidBody::new(self.m, center, inertia - Inertia::offset(self.m, center), frame)
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            self.body(q).kinetic_energy()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.body(q).potential_energy(-self.g * Vec3::Z)
        }
    }

    /// Eigenvalues of small motions next to upright, from the exact Jacobians.
    fn eigenvalues(spin: f64) -> Vec<nalgebra::Complex<f64>> {
        let model = Top { m: 0.5, g: 9.81, l: 0.1, across: 0.05, along: 0.01 };
        let state = model.state().angles_rate([0.0, 0.0, spin]).build().expect("finite");
        let jacobian = model.state_jacobian(&state).expect("the chart is regular there");
        let mut matrix = nalgebra::SMatrix::<f64, 6, 6>::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&jacobian.by_q);
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&jacobian.by_u);
        // Upright the spin is decoupled: its pair is zero.
        let keep = [0, 1, 3, 4];
        let matrix = nalgebra::SMatrix::<f64, 4, 4>::from_fn(|i, j| matrix[(keep[i], keep[j])]);
        let schur =
            nalgebra::linalg::Schur::try_new(matrix, f64::EPSILON, 10_000).expect("the iteration settles");
        schur.complex_eigenvalues().iter().copied().collect()
    }

    #[test]
    fn frequencies() {
        for (spin, [fast, slow]) in [
            (50.0, [8.897435053981015, 1.1025649460189846]),
            (60.0, [11.117616632769595, 0.8823833672304058]),
            (70.0, [13.260191690355816, 0.7398083096441848]),
            (100.0, [19.496841580230765, 0.5031584197692336]),
        ] {
            let found = eigenvalues(spin);
            for wanted in [fast, slow] {
                let near = found.iter().map(|e| (e - nalgebra::Complex::new(0.0, wanted)).norm());
                let error = near.fold(f64::INFINITY, f64::min);
                assert!(error < 1e-12 * fast, "spin {spin}: no eigenvalue next to {wanted}i: {found:?}");
            }
        }
    }

    #[test]
    fn threshold() {
        let critical = 31.32091952673165;
        let growth = |spin| eigenvalues(spin).iter().fold(0.0, |most: f64, e| most.max(e.re));
        // Next to where two pairs meet, growth is the root of what is missing.
        let (below, above) = (growth(critical * (1.0 - 1e-6)), growth(critical * (1.0 + 1e-6)));
        assert!(above < 1e-6 && below > 1e-3, "growth {below:.1e} below, {above:.1e} above");
    }
}

/// A thin disk that rolls without slipping; O. M. O'Reilly, Nonlinear Dynamics 10 (1996) 287, and C. Le Saux,
/// R. I. Leine and C. Glocker, J. Nonlinear Sci. 15 (2005) 27.
mod rolling_disk {
    use super::disk::DISK;
    use super::*;
    use core::f64::consts::FRAC_PI_2;

    /// x, y, yaw, lean, spin.
    const REFERENCE: [(f64, [f64; 5]); 4] = [
        (
            1.0,
            [
                1.6276306901647655,
                -0.3760591258456893,
                -0.4500127992257251,
                0.8100727249172117,
                1.976396838797484,
            ],
        ),
        (
            5.0,
            [4.45231498010988, -5.959707906346224, -1.500688605394226, 0.5414095127855042, 9.417505737727993],
        ),
        (
            10.0,
            [
                -1.5921296014073956,
                -10.331596344993283,
                -3.0301117783634925,
                0.598986618103901,
                18.848384199649146,
            ],
        ),
        (
            20.0,
            [
                0.34487247261547105,
                0.020049974367354513,
                -6.217654518548638,
                0.7287408754430973,
                37.792365354023154,
            ],
        ),
    ];

    #[test]
    fn general_motion() {
        let (lean, yaw_rate, lean_rate, spin_rate) = (0.5_f64, 0.3, 0.2, 1.5);
        let start = DISK.state().lean(lean).yaw_rate(yaw_rate).lean_rate(lean_rate).spin_rate(spin_rate);
        let start = start.x_rate(yaw_rate * lean.sin() + spin_rate).y_rate(-lean_rate * lean.cos());
        let start = start.build().expect("it rolls");
        let motion = DISK.simulate(start).until(20.0).tolerance(1e-13).run().expect("it does not fall flat");
        for (t, wanted) in REFERENCE {
            let error = distance(motion.at(t).q.as_slice(), &wanted);
            assert!(error < 1e-10, "t = {t}: {error:.1e}");
        }
    }

    /// On a circle it leans alike all the way and comes back to where it was.
    #[test]
    fn steady_circle() {
        let (x_rate, yaw_rate, spin_rate) = (0.759821250373635, -0.07665017533365781, 0.7665017533365781);
        let start =
            DISK.state().lean(0.08726646259971647).x_rate(x_rate).yaw_rate(yaw_rate).spin_rate(spin_rate);
        let start = start.build().expect("it rolls");
        let period = 81.97222354455046;
        let motion =
            DISK.simulate(start).until(period).tolerance(1e-13).run().expect("it does not fall flat");
        let quarter = motion.at(0.25 * period);
        let wanted =
            [9.912844257252342, -9.912844257252342, -FRAC_PI_2, 0.08726646259971647, 10.0 * FRAC_PI_2];
        assert!(distance(quarter.q.as_slice(), &wanted) < 1e-9);
        let end = motion.end();
        assert!(distance(&[end.x(), end.y(), end.lean()], &[0.0, 0.0, wanted[3]]) < 1e-8);
    }

    /// Straight on it is stable where spin² > 1/3, turning on the spot where yaw rate² > 4/5: where the
    /// square of the fastest eigenvalue of small motions passes 0.
    #[test]
    fn thresholds() {
        let square = |rate_squared: f64, straight: bool| {
            let rate = rate_squared.sqrt();
            let start = if straight {
                DISK.state().x_rate(rate).spin_rate(rate).build()
            } else {
                DISK.state().yaw_rate(rate).build()
            };
            // In velocities that go round with the disk.
            let linear = DISK.linearize_in(&start.expect("it rolls"), &["yaw", "lean", "spin"]);
            let linear = linear.expect("it is regular upright");
            let eigenvalues = linear.eigenvalues().expect("steady");
            eigenvalues
                .into_iter()
                .map(|x| x * x)
                .max_by(|x, y| x.norm().total_cmp(&y.norm()))
                .expect("it leans")
                .re
        };
        for (critical, straight) in [(1.0 / 3.0, true), (0.8, false)] {
            let (mut a, mut b) = (0.5 * critical, 1.7 * critical);
            let (mut at_a, mut at_b) = (square(a, straight), square(b, straight));
            assert!(at_a > 0.1 && at_b < -0.1, "straight {straight}: {at_a} below, {at_b} above");
            for _ in 0..20 {
                let next = b - at_b * (b - a) / (at_b - at_a);
                if next == b || next.is_nan() {
                    break;
                }
                (a, at_a) = (b, at_b);
                (b, at_b) = (next, square(next, straight));
            }
            assert!((b / critical - 1.0).abs() < 1e-12, "straight {straight}: {b} instead of {critical}");
        }
    }

    /// The motions beside them say the same: a small lean stays small, or it does not.
    #[test]
    fn motions_on_both_sides_of_the_thresholds() {
        let largest_lean = |x_rate: f64, yaw_rate: f64| {
            let start = DISK
                .state()
                .lean(1e-7)
                .x_rate(x_rate)
                .spin_rate(x_rate - yaw_rate * 1e-7_f64.sin())
                .yaw_rate(yaw_rate);
            let motion = DISK.simulate(start.build().expect("it rolls")).until(60.0).tolerance(1e-12).run();
            let motion = motion.expect("it leans little");
            (0..600).map(|k| motion.at(0.1 * f64::from(k)).lean().abs()).fold(0.0, f64::max)
        };
        for (critical, straight) in [(1.0 / 3.0, true), (0.8, false)] {
            let at = |factor: f64| {
                let rate = (critical * factor).sqrt();
                if straight { largest_lean(rate, 0.0) } else { largest_lean(0.0, rate) }
            };
            let (below, above) = (at(0.95), at(1.05));
            assert!(above < 1e-5 && below > 1e-2, "straight {straight}: {below:e} below, {above:e} above");
        }
    }
}
