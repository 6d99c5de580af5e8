//! Joints in motion: a body that a joint holds in the world against the same body in minimal coordinates; wheels against closed forms.

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
                self.body(q).potential_energy(self.gravity)
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

/// A free body with Euler parameters and a joint to the world, beside the same body in minimal coordinates. The numbers are the coordinates and rates
/// with which it starts.
macro_rules! joint {
    ($module:ident, $joint:ident, $rows:literal, [$($c:ident: $q:expr, $u:expr);*], |$s:ident, $v:ident| $frame:expr) => {
        mod $module {
            use super::*;

            held!(Jointed, [place: [_; 3], e: [_; 4]], |s, q| Frame::new(Vec3::from(q.place), EulerParameters::new(q.e).rotation()), {
                #[holonomic]
                fn unit(&self, q: &Coordinates<Self>) -> Expr {
                    EulerParameters::new(q.e).norm_constraint()
                }
                #[holonomic]
                fn joint(&self, q: &Coordinates<Self>) -> [Expr; $rows] {
                    let frame = self.body(q).frame.frame(self.corner, Mat3::IDENTITY);
                    Joint::$joint(Frame::new(self.anchor, self.axes), frame)
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
                let (place, rotation, w) = (at.origin(), at.rotation().value(), at.angular_velocity_in_body().value());
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

joint!(revolute, revolute, 5, [a: 0.3, 1.0], |s, q| Frame::new(s.anchor, s.axes * Mat3::rotation_z(q.a)));
joint!(prismatic, prismatic, 5, [x: 0.2, -0.5], |s, q| Frame::new(s.anchor, s.axes).frame(vec3(0.0, 0.0, q.x), Mat3::IDENTITY));
joint!(cylindrical, cylindrical, 4, [x: 0.2, -0.5; a: 0.3, 2.0], |s, q| {
    Frame::new(s.anchor, s.axes).frame(vec3(0.0, 0.0, q.x), Mat3::rotation_z(q.a))
});
joint!(planar, planar, 3, [x: 0.2, -0.5; y: 0.1, 0.8; a: 0.3, 2.0], |s, q| {
    Frame::new(s.anchor, s.axes).frame(vec3(q.x, q.y, 0.0), Mat3::rotation_z(q.a))
});
joint!(universal, universal, 4, [a: 0.3, 1.2; b: -0.8, 0.9], |s, q| {
    let quarter = core::f64::consts::FRAC_PI_2;
    Frame::new(s.anchor, s.axes * Mat3::rotation_z(q.a) * Mat3::rotation_x(-quarter) * Mat3::rotation_z(q.b))
});
joint!(spherical, spherical_rows, 3, [a: 0.3, 1.2; b: -0.4, 0.9; c: 0.5, -1.0], |s, q| {
    Frame::new(s.anchor, s.axes * Mat3::euler(EulerSequence::Zyx, [q.a, q.b, q.c]))
});
