//! Bricard's loop of six hinges from rigid bodies and joints, with its redundancy named; R. Bricard, J. Math.
//! Pures Appl. 3 (1897) 113, problem A04 of M. González, D. Dopico, U. Lugrís and J. Cuadrado, Multibody
//! Syst. Dyn. 16 (2006) 83.
//!
//! Five rods on six hinges that each stand at right angles to the next: by counting 30 freedoms less 30 rows,
//! and it moves all the same. The reference values come from two routes in multi-precision arithmetic, two
//! angles with a closed condition and five with four equations.

use crate::singular_values;

use dynamics::model::Vector;
use dynamics::prelude::*;
use singular_values::{jacobian, rank};

/// Time; the ends P1 to P4 of the rods.
const REFERENCE: [(f64, [[f64; 3]; 4]); 6] = [
    (
        0.25,
        [
            [0.9980925022593227, 0.0, -0.06173618820209059],
            [0.9400569683411281, -0.9983080639607659, -0.058146448166343664],
            [0.9980925022593227, -1.0599397988411123, 0.9382638117979094],
            [0.0, -0.9983080639607659, 0.9418535518633564],
        ],
    ),
    (
        0.5,
        [
            [0.9682836791067772, 0.0, -0.2498533905622331],
            [0.7747178080392334, -0.979815047655669, -0.19990615895344271],
            [0.9682836791067772, -1.224625159436334, 0.7501466094377669],
            [0.0, -0.979815047655669, 0.8000938410465572],
        ],
    ),
    (
        1.0,
        [
            [0.5105014611872197, 0.0, -0.8598768854468142],
            [0.27448131926462305, -0.886707938734672, -0.46233000268737606],
            [0.5105014611872197, -1.6491675993948063, 0.14012311455318582],
            [0.0, -0.886707938734672, 0.537669997312624],
        ],
    ),
    (
        2.0,
        [
            [-0.9693403447776516, 0.0, -0.24572198922202326],
            [-0.7781353730332908, -0.9803526834432565, -0.1972526706171706],
            [-0.9693403447776516, -1.2212468949563149, 0.7542780107797667],
            [0.0, -0.9803526834432565, 0.8027473293828293],
        ],
    ),
    (
        5.0,
        [
            [0.9999999977380489, 0.0, -6.7259959681881e-05],
            [0.999932742302117, -0.9999999977383531, -6.7255436083961e-05],
            [0.9999999977380489, -1.0000672576978828, 0.9999327400403181],
            [0.0, -0.9999999977383531, 0.999932744563916],
        ],
    ),
    (
        10.0,
        [
            [0.9999999638063494, 0.0, -0.000269048880078693],
            [0.9997309873038354, -0.9999999638258172, -0.000268976512249305],
            [0.9999999638063494, -1.0002690126961633, 0.9997309511199213],
            [0.0, -0.9999999638258172, 0.9997310234877507],
        ],
    ),
];

/// Links on links: an angle for each hinge but the last, which closes the loop.
mod by_angles {
    use super::*;
    use core::f64::consts::FRAC_PI_2;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(turn: [rad; 5])]
    #[units(mass: kg, length: m, side: m, gravity: m / s^2)]
    #[nominal(length = 1.0)]
    pub(super) struct Linkage {
        mass: f64,
        length: f64,
        side: f64,
        gravity: f64,
    }

    #[dynamics]
    impl Linkage {
        /// Links in the world's axes as they stand at the start: each frame at the hinge that carries the
        /// link.
        fn links(&self, q: &Coordinates<Self>) -> [Frame; 5] {
            let l = self.length;
            let first = Frame::turned(Mat3::rotation_y(q.turn[0]));
            let second = first.frame(l * Vec3::X, Mat3::rotation_z(q.turn[1]));
            let third = second.frame(-l * Vec3::Y, Mat3::rotation_x(q.turn[2]));
            let fourth = third.frame(l * Vec3::Z, Mat3::rotation_y(q.turn[3]));
            let fifth = fourth.frame(-l * Vec3::X, Mat3::rotation_z(q.turn[4]));
            [first, second, third, fourth, fifth]
        }
        pub(super) fn ends(&self, q: &Coordinates<Self>) -> [Vec3; 4] {
            let [_, second, third, fourth, fifth] = self.links(q);
            [second.origin(), third.origin(), fourth.origin(), fifth.origin()]
        }
        fn rods(&self, q: &Coordinates<Self>) -> [RigidBody; 5] {
            let (m, l, a) = (self.mass, self.length, self.side);
            let [first, second, third, fourth, fifth] = self.links(q);
            let (x, y, z) =
                (Inertia::cuboid(m, l, a, a), Inertia::cuboid(m, a, l, a), Inertia::cuboid(m, a, a, l));
            [
                RigidBody::new(m, 0.5 * l * Vec3::X, x, first),
                RigidBody::new(m, -0.5 * l * Vec3::Y, y, second),
                RigidBody::new(m, 0.5 * l * Vec3::Z, z, third),
                RigidBody::new(m, -0.5 * l * Vec3::X, x, fourth),
                RigidBody::new(m, 0.5 * l * Vec3::Y, y, fifth),
            ]
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for rod in self.rods(q) {
                sum += rod.kinetic_energy();
            }
            sum
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for rod in self.rods(q) {
                sum += rod.potential_energy(-self.gravity * Vec3::Y);
            }
            sum
        }
        /// The last hinge, along x.
        #[holonomic]
        #[redundant]
        fn closure(&self, q: &Coordinates<Self>) -> [Expr; 5] {
            let toward_x = Mat3::rotation_y(FRAC_PI_2);
            let [_, _, _, _, last] = self.links(q);
            Joint::revolute(
                Frame::new(self.length * Vec3::Z, toward_x),
                last.frame(self.length * Vec3::Y, toward_x),
            )
        }
    }

    pub(super) const LINKAGE: Linkage = Linkage { mass: 1.0, length: 1.0, side: 0.1, gravity: 9.81 };
}

/// Five bodies that are free in space but for six hinges.
mod by_joints {
    use super::*;
    use core::f64::consts::FRAC_PI_2;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(place: [m; 15], e: [_; 20])]
    #[units(mass: kg, length: m, side: m, gravity: m / s^2)]
    #[nominal(length = 1.0)]
    pub(super) struct Linkage {
        mass: f64,
        length: f64,
        side: f64,
        gravity: f64,
    }

    #[dynamics]
    impl Linkage {
        fn parameters(&self, q: &Coordinates<Self>, i: usize) -> EulerParameters {
            EulerParameters::new([q.e[4 * i], q.e[4 * i + 1], q.e[4 * i + 2], q.e[4 * i + 3]])
        }
        /// The axis of a rod as it stands at the start.
        fn axis(&self, i: usize) -> Vec3 {
            match i {
                0 => 1.0 * Vec3::X,
                1 => -1.0 * Vec3::Y,
                2 => 1.0 * Vec3::Z,
                3 => -1.0 * Vec3::X,
                _ => 1.0 * Vec3::Y,
            }
        }
        fn rod(&self, q: &Coordinates<Self>, i: usize) -> RigidBody {
            let (m, l, a) = (self.mass, self.length, self.side);
            let inertia = match i {
                0 | 3 => Inertia::cuboid(m, l, a, a),
                2 => Inertia::cuboid(m, a, a, l),
                _ => Inertia::cuboid(m, a, l, a),
            };
            let place = vec3(q.place[3 * i], q.place[3 * i + 1], q.place[3 * i + 2]);
            RigidBody::new(m, Vec3::ZERO, inertia, Frame::new(place, self.parameters(q, i).rotation()))
        }
        /// Turned so that z is the axis of hinge i: y, z, x, and so on.
        fn hinge(&self, i: usize) -> Mat3<f64> {
            match i % 3 {
                0 => Mat3::rotation_x(-FRAC_PI_2),
                1 => Mat3::diagonal(1.0, 1.0, 1.0),
                _ => Mat3::rotation_y(FRAC_PI_2),
            }
        }
        fn joint(&self, q: &Coordinates<Self>, i: usize) -> [Expr; 5] {
            let (a, b) = (self.rod(q, i - 1).frame, self.rod(q, i).frame);
            let half = 0.5 * self.length;
            Joint::revolute(
                a.frame(half * self.axis(i - 1), self.hinge(i)),
                b.frame(-half * self.axis(i), self.hinge(i)),
            )
        }
        pub(super) fn ends(&self, q: &Coordinates<Self>) -> [Vec3; 4] {
            let half = 0.5 * self.length;
            [
                self.rod(q, 0).frame.point(half * self.axis(0)),
                self.rod(q, 1).frame.point(half * self.axis(1)),
                self.rod(q, 2).frame.point(half * self.axis(2)),
                self.rod(q, 3).frame.point(half * self.axis(3)),
            ]
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..5 {
                sum += self.rod(q, i).kinetic_energy();
            }
            sum
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..5 {
                sum += self.rod(q, i).potential_energy(-self.gravity * Vec3::Y);
            }
            sum
        }
        #[holonomic]
        fn unit(&self, q: &Coordinates<Self>) -> [Expr; 5] {
            [
                self.parameters(q, 0).norm_constraint(),
                self.parameters(q, 1).norm_constraint(),
                self.parameters(q, 2).norm_constraint(),
                self.parameters(q, 3).norm_constraint(),
                self.parameters(q, 4).norm_constraint(),
            ]
        }
        #[holonomic]
        fn first(&self, q: &Coordinates<Self>) -> [Expr; 5] {
            let rod = self.rod(q, 0).frame;
            let hinge = self.hinge(0);
            Joint::revolute(Frame::turned(hinge), rod.frame(-0.5 * self.length * self.axis(0), hinge))
        }
        #[holonomic]
        fn hinges(&self, q: &Coordinates<Self>) -> [[Expr; 5]; 4] {
            [self.joint(q, 1), self.joint(q, 2), self.joint(q, 3), self.joint(q, 4)]
        }
        #[holonomic]
        #[redundant]
        fn last(&self, q: &Coordinates<Self>) -> [Expr; 5] {
            let rod = self.rod(q, 4).frame;
            let hinge = self.hinge(5);
            Joint::revolute(
                rod.frame(0.5 * self.length * self.axis(4), hinge),
                Frame::new(self.length * Vec3::Z, hinge),
            )
        }
    }

    pub(super) const LINKAGE: Linkage = Linkage { mass: 1.0, length: 1.0, side: 0.1, gravity: 9.81 };
}

/// The largest distance of the rods' ends from the reference, at each of its times up to the end of a motion.
macro_rules! errors {
    ($Model:path, $model:ident, $motion:ident) => {{
        let reached = REFERENCE.into_iter().filter(|(t, _)| *t <= $motion.end().t());
        let error = |(t, ends): (f64, [[f64; 3]; 4])| {
            let jets = <$Model>::coordinates_with(&$motion.at(t), &Vector::zeros(), &[]);
            let found = $model.ends(&jets).map(|end| end.value().to_array());
            let apart = found.as_flattened().iter().zip(ends.as_flattened()).map(|(x, y)| (x - y).abs());
            // A NaN is as far away as can be.
            (t, apart.fold(0.0, |most, x| if x <= most { most } else { x }))
        };
        reached.map(error).collect::<Vec<_>>()
    }};
}

fn in_one_line(report: &str) -> String {
    report.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// What summaries say of a motion on redundant constraints.
#[track_caller]
fn names_redundancy(summary: &str) {
    assert!(summary.contains("constraints repeat each other") && summary.contains("not unique"), "{summary}");
}

/// 30 freedoms, 30 rows of hinges of which 29 are independent, and one freedom: the report says it, and every
/// reaction that it is shared out.
#[test]
fn bodies_in_hinges() {
    use by_joints::{LINKAGE, Linkage};
    let report = in_one_line(Linkage::REPORT);
    for said in
        ["last: 5 rows, holonomic, fixed, 1 of them repeat others", "34 on others", "reactions unique: none"]
    {
        assert!(report.contains(said), "{said}\n{report}");
    }
    let (mut e, model) = ([0.0; 20], LINKAGE);
    (0..5).for_each(|i| e[4 * i] = 1.0);
    let place = [0.5, 0.0, 0.0, 1.0, -0.5, 0.0, 1.0, -1.0, 0.5, 0.5, -1.0, 1.0, 0.0, -0.5, 1.0];
    let start = model.state().place(place).e(e).build().expect("the cube closes");
    assert_eq!((rank(&jacobian(&model, &start)), model.degrees_of_freedom(&start)), (34, Ok(1)));
    assert!(model.reactions(&start).expect("reactions").iter().all(|reaction| !reaction.unique));
    let motion = model.simulate(start).until(2.0).tolerance(1e-11).run().expect("one freedom");
    names_redundancy(&motion.verify().to_string());
    for (t, error) in errors!(Linkage, model, motion) {
        assert!(error < 1e-9, "t = {t}: {error:.1e}");
    }
}

/// The same in five angles, for two swings.
#[test]
fn links_on_links() {
    use by_angles::{LINKAGE, Linkage};
    let report = in_one_line(Linkage::REPORT);
    for said in [
        "closure: 5 rows, holonomic, fixed, 1 of them repeat others",
        "4 on others",
        "reactions unique: none",
    ] {
        assert!(report.contains(said), "{said}\n{report}");
    }
    let model = LINKAGE;
    let start = model.state().build().expect("the cube closes");
    assert_eq!((rank(&jacobian(&model, &start)), model.degrees_of_freedom(&start)), (4, Ok(1)));
    let motion = model.simulate(start).until(10.0).tolerance(1e-12).run().expect("one freedom");
    names_redundancy(&motion.verify().to_string());
    for (t, error) in errors!(Linkage, model, motion) {
        assert!(error < 1e-9, "t = {t}: {error:.1e}");
    }
    let drift = motion.verify().energy_drift;
    assert!(drift < 1e-11, "energy drifts by {drift:.1e}");
}
