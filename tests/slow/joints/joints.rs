//! Joints in motion: a body that a joint holds in the world against the same body in minimal coordinates;
//! wheels against closed forms.

use dynamics::prelude::*;
use nalgebra::SVector;

const ANCHOR: Vec3<f64> = Vec3::new(0.4, 1.0, -0.6);
const CORNER: Vec3<f64> = Vec3::new(0.3, -0.5, 0.2);
const GRAVITY: Vec3<f64> = Vec3::new(0.7, -1.1, -9.3);

fn axes() -> Mat3<f64> {
    Mat3::euler(EulerSequence::Zyx, [0.4, -0.7, 1.2])
}

/// What every model of a held body is made of.
macro_rules! held {
    ($Name:ident, [$($coordinates:tt)*], |$s:ident, $q:ident| $frame:expr, { $($constraints:tt)* }) => {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates($($coordinates)*)]
        struct $Name {
            m: f64,
            inertia: Mat3<f64>,
            gravity: Vec3<f64>,
            anchor: Vec3<f64>,
            axes: Mat3<f64>,
            corner: Vec3<f64>,
        }
        #[dynamics]
        impl $Name {
            fn body(&self, q: &Coordinates<Self>) -> RigidBody {
                let ($s, $q) = (self, q);
                RigidBody::new(self.m, Vec3::ZERO, self.inertia, $frame)
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).kinetic_energy()
            }
            #[potential]
            fn weight(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).potential_energy(self.axes * self.gravity)
            }
            $($constraints)*
        }
        impl $Name {
            fn of_numbers() -> Self {
                Self {
                    m: 1.7,
                    inertia: Mat3::from([[1.0, 0.1, -0.2], [0.1, 1.5, 0.05], [-0.2, 0.05, 1.2]]),
                    gravity: GRAVITY,
                    anchor: ANCHOR,
                    axes: axes(),
                    corner: CORNER,
                }
            }
        }
    };
}

/// A free body with Euler parameters and a joint to the world, beside the same body in minimal coordinates.
/// The numbers are the coordinates and rates with which it starts.
macro_rules! joint {
    (
        $module:ident, |$a:ident, $b:ident| $joint:expr, $rows:literal,
        [$($c:ident: $q:expr, $u:expr);*],
        |$s:ident, $v:ident| $frame:expr
    ) => {
        mod $module {
            use super::*;

            held!(Jointed, [place: [_; 3], e: [_; 4]], |_s, q|
                Frame::new(Vec3::from(q.place), EulerParameters::new(q.e).rotation()), {
                #[holonomic]
                fn unit(&self, q: &Coordinates<Self>) -> Expr {
                    EulerParameters::new(q.e).norm_constraint()
                }
                #[holonomic]
                fn joint(&self, q: &Coordinates<Self>) -> [Expr; $rows] {
                    let $a = Frame::new(self.anchor, self.axes);
                    let $b = self.body(q).frame.frame(self.corner, Mat3::IDENTITY);
                    $joint
                }
            });
            held!(Minimal, [$($c),*], |$s, $v| $frame.frame(-$s.corner, Mat3::IDENTITY), {});

            #[test]
            fn moves_as_in_minimal_coordinates() {
                let (minimal, jointed) = (Minimal::of_numbers(), Jointed::of_numbers());
                let mut first = minimal.state().build().expect("finite");
                (first.q, first.u) = ([$($q),*].into(), [$($u),*].into());
                let frame = |model: &Minimal, state: &State<Minimal>| {
                    model.body(&Minimal::coordinates_with(state, &SVector::zeros(), &[])).frame
                };
                let at = frame(&minimal, &first);
                let (place, rotation, w) =
                    (at.origin(), at.rotation().value(), at.angular_velocity_in_body().value());
                let e = rotation.to_euler_parameters().expect("a rotation");
                let v = Vec3::new(e[1], e[2], e[3]);
                let rate = 0.5 * (e[0] * w + v.cross(w));
                let start = jointed
                    .state()
                    .place(place.value().to_array())
                    .place_rate(place.dt().value().to_array())
                    .e(e)
                    .e_rate([-0.5 * v.dot(w), rate.x, rate.y, rate.z])
                    .build()
                    .expect("the joint is closed");
                let one = minimal.simulate(first).until(1.5).tolerance(1e-12).run().expect("regular");
                let other = jointed.simulate(start).until(1.5).tolerance(1e-12).run().expect("regular");
                let mut moved = 0.0_f64;
                for t in [0.3, 0.6, 0.9, 1.2, 1.5] {
                    let a = frame(&minimal, &one.at(t));
                    let state = other.at(t);
                    let q = Jointed::coordinates_with(&state, &SVector::zeros(), &[0.0; 1 + $rows]);
                    let b = jointed.body(&q).frame;
                    let turned = (a.rotation().value() - b.rotation().value()).to_array();
                    let turned = turned.as_flattened().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                    let error = (a.origin().value() - b.origin().value()).norm() + turned;
                    assert!(error < 1e-9, "t = {t}: {error:e}");
                    moved = moved.max((a.origin().value() - place.value()).norm());
                }
                assert!(moved > 0.1, "{moved}");
            }
        }
    };
}

joint!(revolute, |a, b| Joint::revolute(a, b), 5, [a: 0.3, 1.0],
    |s, q| Frame::new(s.anchor, s.axes * Mat3::rotation_z(q.a)));
joint!(cylindrical, |a, b| Joint::cylindrical(a, b), 4, [x: 0.2, -0.5; a: 0.3, 2.0], |s, q| {
    Frame::new(s.anchor, s.axes).frame(vec3(0.0, 0.0, q.x), Mat3::rotation_z(q.a))
});
joint!(planar, |a, b| Joint::planar(a, b), 3, [x: 0.2, -0.5; y: 0.1, 0.8; a: 0.3, 2.0], |s, q| {
    Frame::new(s.anchor, s.axes).frame(vec3(q.x, q.y, 0.0), Mat3::rotation_z(q.a))
});
joint!(universal, |a, b| Joint::universal(a, b), 4, [a: 0.3, 1.2; b: -0.8, 0.9], |s, q| {
    let quarter = core::f64::consts::FRAC_PI_2;
    Frame::new(s.anchor, s.axes * Mat3::rotation_z(q.a) * Mat3::rotation_x(-quarter) * Mat3::rotation_z(q.b))
});
joint!(spherical, |a, b| Joint::spherical(a, b).to_array(), 3,
    [a: 0.3, 1.2; b: -0.4, 0.9; c: 0.5, -1.0], |s, q| {
    Frame::new(s.anchor, s.axes * Mat3::euler(EulerSequence::Zyx, [q.a, q.b, q.c]))
});
joint!(nut_in_euler_parameters, |a, b| Joint::screw(a, b, 0.4), 5, [a: 0.3, -9.0], |s, q| {
    let advance = 0.4 * q.a / core::f64::consts::TAU;
    Frame::new(s.anchor, s.axes).frame(vec3(0.0, 0.0, advance), Mat3::rotation_z(q.a))
});

mod screw {
    use super::*;

    // The nut tilts by two angles, which the joint holds at zero, and turns by the third.
    held!(Jointed, [place: [_; 3], angles: [rad; 3]], |s, q|
        Frame::new(Vec3::from(q.place), s.axes * Mat3::euler(EulerSequence::Xyz, q.angles)), {
        #[holonomic]
        fn joint(&self, q: &Coordinates<Self>) -> [Expr; 5] {
            let nut = self.body(q).frame.frame(self.corner, Mat3::IDENTITY);
            Joint::screw(Frame::new(self.anchor, self.axes), nut, 0.4)
        }
    });
    held!(Minimal, [a: rad], |s, q| {
        let advance = 0.4 * q.a / core::f64::consts::TAU;
        let thread = Frame::new(s.anchor, s.axes).frame(vec3(0.0, 0.0, advance), Mat3::rotation_z(q.a));
        thread.frame(-s.corner, Mat3::IDENTITY)
    }, {});

    #[test]
    fn a_nut_runs_along_its_thread() {
        let (minimal, jointed) = (Minimal::of_numbers(), Jointed::of_numbers());
        let first = minimal.state().a(0.3).a_rate(-9.0).build().expect("finite");
        let origin = |state: &State<Minimal>| {
            minimal.body(&Minimal::coordinates_with(state, &SVector::zeros(), &[])).frame.origin()
        };
        let place = origin(&first);
        let start = jointed
            .state()
            .place(place.value().to_array())
            .place_rate(place.dt().value().to_array())
            .angles([0.0, 0.0, 0.3])
            .angles_rate([0.0, 0.0, -9.0])
            .build()
            .expect("the nut is on the thread");
        let one = minimal.simulate(first).until(3.0).tolerance(1e-12).run().expect("regular");
        let other = jointed.simulate(start).until(3.0).tolerance(1e-12).run().expect("regular");
        for t in [0.5, 1.0, 2.0, 3.0] {
            let (a, b) = (one.at(t), other.at(t));
            let apart = (origin(&a).value() - Vec3::new(b.place(0), b.place(1), b.place(2))).norm()
                + (a.a() - b.angles(2)).abs();
            assert!(apart < 1e-9, "t = {t}: {apart:e}");
        }
        let turns = one.end().a().abs() / core::f64::consts::TAU;
        assert!(turns > 2.0, "{turns} turns");
    }
}

mod weld {
    use super::*;

    held!(Bolted, [place: [_; 3], e: [_; 4]], |_s, q|
        Frame::new(Vec3::from(q.place), EulerParameters::new(q.e).rotation()), {
        #[holonomic]
        fn unit(&self, q: &Coordinates<Self>) -> Expr {
            EulerParameters::new(q.e).norm_constraint()
        }
        #[holonomic]
        fn joint(&self, q: &Coordinates<Self>) -> [Expr; 6] {
            Joint::weld(
                Frame::new(self.anchor, self.axes),
                self.body(q).frame.frame(self.corner, Mat3::IDENTITY)
            )
        }
    });

    /// A start with the origins one and the body turned by this against the frame to which it is bolted.
    fn start(turned: Mat3<f64>) -> Result<(), String> {
        let model = Bolted::of_numbers();
        let attitude = axes() * turned;
        let (place, e) = (ANCHOR - attitude * CORNER, attitude.to_euler_parameters().expect("a rotation"));
        let state = model.state().place(place.to_array()).e(e).build().map_err(|e| e.to_string())?;
        model.accelerations(&state).map(|_| ()).map_err(|e| e.to_string())
    }

    #[test]
    fn frames_are_one_and_not_otherwise() {
        start(Mat3::rotation_x(0.0)).expect("the frames are one");
        let pi = core::f64::consts::PI;
        let quarters = (0..64).map(|i| {
            Mat3::euler(EulerSequence::Zyx, [i % 4, i / 4 % 4, i / 16].map(|k| f64::from(k) * 0.5 * pi))
        });
        let quarters =
            quarters.filter(|turned| turned.column(0).x + turned.column(1).y + turned.column(2).z < 2.9);
        let halves = (0..300).map(|i| {
            let tilt = Mat3::euler(EulerSequence::Zyx, [0.1 * f64::from(i), 0.7 * f64::from(i), 0.3]);
            tilt * Mat3::rotation_x(pi) * tilt.transpose()
        });
        for turned in quarters.chain(halves) {
            let refused = start(turned).expect_err("the frames are turned against one another");
            assert!(refused.contains("constraint `joint[") && refused.contains("does not hold"), "{refused}");
        }
        // The one other attitude at which the rows are zero, and regular: by θ about w = (3, 5, 7)/10 with
        // cot θ/2 = |w|.
        let w = Vec3::new(0.3, 0.5, 0.7);
        let other = Mat3::axis_angle(w, 2.0 * (1.0 / w.norm()).atan()).value();
        let refused = start(other).expect_err("the rows hold, and the frames are not one");
        assert!(refused.contains("the weld of two frames in `joint`, given by `e`, `axes`"), "{refused}");
        assert!(refused.contains("turned against one another by 1.66"), "{refused}");
    }
}

mod wheels {
    use super::*;

    /// A motor with its pinion drives a wheel; the wheel's drum a belt to a shaft; the shaft's pinion a rack.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(pinion: rad, wheel: rad, shaft: rad, rack: m)]
    #[inputs(torque: N * m)]
    #[units(inertia: kg * m^2, m: kg, radii: m)]
    struct Train {
        inertia: [f64; 3],
        m: f64,
        radii: [f64; 5],
    }

    #[dynamics]
    impl Train {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let [a, b, c] = self.inertia;
            let turning = a * q.pinion.dt().powi(2) + b * q.wheel.dt().powi(2) + c * q.shaft.dt().powi(2);
            0.5 * turning + 0.5 * self.m * q.rack.dt().powi(2)
        }
        #[holonomic]
        fn mesh(&self, q: &Coordinates<Self>) -> Expr {
            Joint::gear(q.pinion, self.radii[0], q.wheel, self.radii[1])
        }
        #[holonomic]
        fn belt(&self, q: &Coordinates<Self>) -> Expr {
            Joint::belt(q.wheel, self.radii[2], q.shaft, self.radii[3])
        }
        #[holonomic]
        fn toothed(&self, q: &Coordinates<Self>) -> Expr {
            Joint::rack(q.rack, q.shaft, self.radii[4])
        }
        #[force]
        fn motor(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.pinion, q.torque)
        }
    }

    #[test]
    fn a_train_moves_by_its_ratios() {
        let (inertia, m, radii) = ([0.02, 0.3, 0.1], 4.0, [0.03, 0.12, 0.05, 0.1, 0.04]);
        let model = Train { inertia, m, radii };
        let start = model.state().torque(0.7).build().expect("all is at zero");
        let motion = model.simulate(start).until(2.0).tolerance(1e-12).run().expect("regular");
        // Per turn of the pinion.
        let wheel = -radii[0] / radii[1];
        let shaft = wheel * radii[2] / radii[3];
        let rack = shaft * radii[4];
        let reduced = inertia[0] + inertia[1] * wheel * wheel + inertia[2] * shaft * shaft + m * rack * rack;
        let turned = 0.5 * (0.7 / reduced) * 4.0;
        let end = motion.end();
        for (found, expected) in [
            (end.pinion(), turned),
            (end.wheel(), wheel * turned),
            (end.shaft(), shaft * turned),
            (end.rack(), rack * turned),
        ] {
            assert!((found - expected).abs() < 1e-10 * expected.abs(), "{found} for {expected}");
        }
    }
}
