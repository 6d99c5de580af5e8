//! The library on jets: kinematics against the transport theorem, bodies against clouds of points, solids
//! against integrals.

use super::*;
use crate::math::{cos, sin};
use crate::{EulerSequence, Expr, Mat3, Vec2, Vec3, vec2, vec3};

/// Coordinates with rates and accelerations that are nothing special.
fn coordinate(k: usize) -> Expr {
    let k = k as f64;
    Expr::coordinate(0.3 + 0.7 * sin(1.3 * k), 0.9 * cos(2.1 * k) - 0.2, 0.8 * sin(0.7 * k + 1.0))
}

fn frame() -> Frame {
    let place = vec3(coordinate(1), coordinate(2), coordinate(3));
    Frame::new(place, Mat3::euler(EulerSequence::Zyx, [coordinate(4), coordinate(5), coordinate(6)]))
}

fn close(a: Vec3, b: Vec3, what: &str) {
    let error = (a - b).value().norm();
    assert!(error < 1e-13, "{what}: {:?} and {:?} differ by {error:e}", a.value(), b.value());
}

#[test]
fn transport_theorem() {
    let (frame, point) = (frame(), vec3(coordinate(7), coordinate(8), coordinate(9)));
    let seen = frame.vector(frame.velocity_in(point));
    close(seen + frame.carried_velocity(point), point.dt(), "velocity");
    // r̈ = seen + ö + ω̇×r + ω×(ω×r) + 2ω×v
    let (omega, arm) = (frame.angular_velocity(), point - frame.origin());
    let carried = frame.origin().dt().dt() + omega.dt().cross(arm) + omega.cross(omega.cross(arm));
    let coriolis = 2.0 * omega.cross(seen);
    close(frame.vector(frame.acceleration_in(point)) + carried + coriolis, point.dt().dt(), "acceleration");
    close(frame.point(frame.coordinates_of(point)), point, "there and back");
    close(frame.vector(frame.components_of(point)), point, "there and back of a vector");
    close(frame.vector(frame.angular_velocity_in_body()), omega, "angular velocity in both components");
}

#[test]
fn frames_in_frames() {
    let (inner, point) = (Mat3::rotation_x(coordinate(11)), vec3(0.3, coordinate(12), -0.2));
    let place = vec3(1.0, 0.0, coordinate(13));
    let outer = frame();
    close(outer.frame(place, inner).point(point), outer.point(place + inner * point), "a point");
    let sum = outer.angular_velocity() + outer.vector(inner.angular_velocity());
    close(outer.frame(place, inner).angular_velocity(), sum, "angular velocities add");
    close(Frame::world().frame(place, inner).x(), inner.column(0), "the world");
    close(
        Frame::at(place).point(point) + Frame::turned(inner).y(),
        place + point + inner.column(1),
        "shorter forms",
    );
}

#[test]
fn planar_frames_are_frames_in_space() {
    let flat = PlanarFrame::new(vec2(coordinate(1), coordinate(2)), coordinate(3));
    let space = Frame::new(vec3(coordinate(1), coordinate(2), 0.0), Mat3::rotation_z(coordinate(3)));
    let point = vec2(coordinate(4), coordinate(5));
    let up = |v: Vec2| vec3(v.x, v.y, 0.0);
    close(up(flat.point(point)), space.point(up(point)), "point");
    close(up(flat.coordinates_of(point)), space.coordinates_of(up(point)), "coordinates");
    close(up(flat.velocity_in(point)), space.velocity_in(up(point)), "velocity");
    close(up(flat.acceleration_in(point)), space.acceleration_in(up(point)), "acceleration");
    close(up(flat.carried_velocity(point)), space.carried_velocity(up(point)), "carried velocity");
    close(
        up(flat.x()) + flat.angular_velocity() * Vec3::Z,
        space.x() + space.angular_velocity(),
        "axis and rate",
    );
    close(up(flat.y() + flat.origin()), space.y() + space.origin(), "axis and origin");
    let (next, in_space) =
        (flat.frame(point, coordinate(6)), space.frame(up(point), Mat3::rotation_z(coordinate(6))));
    close(up(next.point(vec2(0.2, 0.5))), in_space.point(vec3(0.2, 0.5, 0.0)), "the next frame");
    assert!((next.angle() - coordinate(3) - coordinate(6)).value().abs() < 1e-15);
    close(up(PlanarFrame::world().vector(point)), up(point), "the world");

    let (body, solid) = (
        PlanarBody::new(2.0, vec2(0.3, -0.1), 0.7, flat),
        RigidBody::new(2.0, vec3(0.3, -0.1, 0.0), Mat3::diagonal(1.0, 1.0, 0.7), space),
    );
    let same =
        |a: Expr, b: Expr, what: &str| assert!((a - b).value().abs() < 1e-14, "{what}: {a:?} and {b:?}");
    same(body.kinetic_energy(), solid.kinetic_energy(), "kinetic energy");
    same(
        body.potential_energy(vec2(0.4, -9.8)),
        solid.potential_energy(vec3(0.4, -9.8, 1.0)),
        "potential energy",
    );
    same(body.angular_momentum(point), solid.angular_momentum(up(point)).z, "angular momentum");
    close(up(body.momentum()), solid.momentum(), "momentum");
    let (planar, spatial) = (body.moment(1.7).power(), solid.moment(vec3(0.3, 0.2, 1.7)).power());
    assert!((planar - spatial).abs() < 1e-14, "{planar} and {spatial}");
}

/// A rigid body is a cloud of points that are fixed in its frame: everything that it says is a sum over them.
#[test]
fn a_rigid_body_is_a_cloud_of_points() {
    let cloud: [(f64, [f64; 3]); 5] = [
        (0.5, [0.1, 0.2, -0.3]),
        (0.9, [-0.4, 0.6, 0.2]),
        (0.3, [0.8, -0.1, 0.5]),
        (1.1, [0.0, -0.5, -0.2]),
        (0.2, [-0.7, -0.9, 0.4]),
    ];
    let frame = frame();
    let mass: f64 = cloud.iter().map(|(m, _)| m).sum();
    let center = cloud.iter().map(|(m, r)| *m * Vec3::from(*r)).sum::<Vec3<f64>>() / mass;
    let mut inertia = Mat3::ZERO;
    for (m, r) in cloud {
        inertia += Inertia::offset(m, Vec3::from(r) - center);
    }
    let body = RigidBody::new(mass, center, inertia, frame);
    let (gravity, about) = (vec3(0.3, -0.2, -9.81), vec3(coordinate(20), 0.7, coordinate(21)));
    let moment = vec3(0.4, -1.1, 0.6);
    let (mut kinetic, mut potential, mut power) = (Expr::ZERO, Expr::ZERO, 0.0);
    let (mut momentum, mut angular) = (Vec3::ZERO, Vec3::ZERO);
    for (m, r) in cloud {
        let place = frame.point(Vec3::from(r));
        kinetic += 0.5 * m * place.dt().norm_squared();
        potential -= m * gravity.dot(place);
        momentum += m * place.dt();
        angular += (place - about).cross(m * place.dt());
    }
    power += moment.dot(frame.angular_velocity()).value();
    let same =
        |a: Expr, b: Expr, what: &str| assert!((a - b).value().abs() < 1e-13, "{what}: {a:?} and {b:?}");
    same(body.kinetic_energy(), kinetic, "kinetic energy");
    same(body.potential_energy(gravity), potential, "potential energy");
    close(body.momentum(), momentum, "momentum");
    close(body.angular_momentum(about), angular, "angular momentum");
    close(body.angular_velocity(), frame.angular_velocity(), "angular velocity");
    assert!((body.moment(moment).power() - power).abs() < 1e-13, "power of a moment");
    // The theorem of Steiner and Huygens, and an inertia that is turned.
    let turn = Mat3::axis_angle(vec3(1.0, 2.0, -0.5), 0.8);
    let omega = vec3(0.3, -0.4, 0.9);
    let turned = omega.dot(Inertia::turned(inertia, turn) * omega);
    let in_body = turn.transpose() * omega;
    same(turned, in_body.dot(inertia * in_body), "turned inertia");
}

/// Said in a left-handed frame, with its center and inertia in that, a body is the same body.
#[test]
fn a_body_in_a_mirrored_frame_is_the_same_body() {
    let exchange: Mat3<f64> = Mat3::from([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
    let inertia: Mat3<f64> = Mat3::from([[0.5, 0.1, -0.05], [0.1, 0.7, 0.02], [-0.05, 0.02, 0.9]]);
    let center: Vec3<f64> = Vec3::new(0.1, 0.4, -0.1);
    let body = RigidBody::new(0.7, center, inertia, frame());
    // The last two mirror nothing.
    for mirror in
        [exchange, Mat3::diagonal(1.0, -1.0, 1.0), Mat3::diagonal(-1.0, -1.0, 1.0), Mat3::IDENTITY.value()]
    {
        let left = Frame::new(body.frame.origin(), body.frame.rotation() * mirror);
        let turned = mirror.transpose() * inertia * mirror;
        let other = RigidBody::new(0.7, mirror.transpose() * center, turned, left);
        let about = vec3(coordinate(20), 0.7, coordinate(21));
        close(other.angular_velocity(), body.angular_velocity(), "angular velocity");
        close(
            left.vector(left.angular_velocity_in_body()),
            body.angular_velocity(),
            "angular velocity in its axes",
        );
        close(other.angular_momentum(about), body.angular_momentum(about), "angular momentum");
        close(other.angular_momentum(about).dt(), body.angular_momentum(about).dt(), "its rate");
        close(other.momentum(), body.momentum(), "momentum");
        assert!((other.kinetic_energy() - body.kinetic_energy()).value().abs() < 1e-14, "kinetic energy");
        let moment = vec3(0.4, -1.1, 0.6);
        assert!(
            (other.moment(moment).power() - body.moment(moment).power()).abs() < 1e-13,
            "power of a moment"
        );
    }
}

/// Components along the unit vectors, put together again, are the derivatives of the point.
#[test]
fn curvilinear_coordinates() {
    let (r, theta, phi) = (1.5 + coordinate(1), coordinate(2), coordinate(3));
    let polar = Polar::new(r, theta);
    let flat = |v: Vec2| vec3(v.x, v.y, 0.0);
    let along = |v: Vec2| flat(v.x * polar.radial() + v.y * polar.transverse());
    close(along(polar.velocity()), flat(polar.point().dt()), "polar velocity");
    close(along(polar.acceleration()), flat(polar.point().dt().dt()), "polar acceleration");
    let round = Cylindrical::new(r, theta, phi);
    let along = |v: Vec3| v.x * round.radial() + v.y * round.transverse() + v.z * Vec3::Z;
    close(along(round.velocity()), round.point().dt(), "cylindrical velocity");
    close(along(round.acceleration()), round.point().dt().dt(), "cylindrical acceleration");
    let ball = Spherical::new(r, theta, phi);
    let along = |v: Vec3| v.x * ball.radial() + v.y * ball.polar() + v.z * ball.azimuthal();
    close(along(ball.velocity()), ball.point().dt(), "spherical velocity");
    close(along(ball.acceleration()), ball.point().dt().dt(), "spherical acceleration");
    close(ball.radial().cross(ball.polar()), ball.azimuthal(), "right-handed");
}

#[test]
fn euler_parameters() {
    let (s, c) = (0.5 * coordinate(1)).sin_cos();
    let n = vec3(coordinate(2), coordinate(3), coordinate(4)).normalize();
    let e = EulerParameters::new([c, s * n.x, s * n.y, s * n.z]);
    assert!(e.norm_constraint().value().abs() < 1e-15 && e.norm_constraint().rate().abs() < 1e-15);
    let r = Mat3::axis_angle(n, coordinate(1));
    close(e.rotation() * vec3(1.0, 2.0, 3.0), r * vec3(1.0, 2.0, 3.0), "rotation");
    close(e.angular_velocity(), r.angular_velocity(), "angular velocity");
    close(e.angular_velocity_in_body(), r.transpose() * r.angular_velocity(), "angular velocity in the body");
}

/// Solids are filled with points: midpoints of a fine grid, weighed by what is inside.
#[test]
fn solids_against_sums_over_a_grid() {
    const N: usize = 80;
    let solid =
        |name: &str, inertia: Mat3, center: f64, size: [f64; 3], inside: &dyn Fn(f64, f64, f64) -> bool| {
            let at = |i: usize, k: usize| size[k] * ((i as f64 + 0.5) / N as f64 - 0.5);
            let (mut count, mut moments) = (0.0, [0.0; 3]);
            let mut first = 0.0;
            for (i, j, k) in (0..N).flat_map(|i| (0..N).flat_map(move |j| (0..N).map(move |k| (i, j, k)))) {
                let (x, y, z) = (at(i, 0), at(j, 1), at(k, 2));
                if inside(x, y, z) {
                    count += 1.0;
                    first += z;
                    let z = z - center;
                    moments =
                        [moments[0] + y * y + z * z, moments[1] + z * z + x * x, moments[2] + x * x + y * y];
                }
            }
            assert!((first / count - center).abs() < 2e-3 * size[2], "{name}: center {}", first / count);
            let inertia = inertia.value();
            for (k, moment) in moments.iter().enumerate() {
                let (sum, formula) = (2.0 * moment / count, inertia[(k, k)]);
                assert!((sum - formula).abs() < 5e-3 * formula, "{name}, axis {k}: {formula} is {sum}");
            }
            assert!(
                (inertia - Mat3::diagonal(inertia[(0, 0)], inertia[(1, 1)], inertia[(2, 2)])).to_array()
                    == [[0.0; 3]; 3]
            );
        };
    let m = 2.0;
    solid("cuboid", Inertia::cuboid(m, 1.0, 2.0, 3.0), 0.0, [1.0, 2.0, 3.0], &|_, _, _| true);
    solid("cylinder", Inertia::cylinder(m, 0.5, 3.0), 0.0, [1.0, 1.0, 3.0], &|x, y, _| x * x + y * y < 0.25);
    solid("tube", Inertia::tube(m, 0.3, 0.5, 0.4), 0.0, [1.0, 1.0, 0.4], &|x, y, _| {
        (0.09..0.25).contains(&(x * x + y * y))
    });
    solid("sphere", Inertia::sphere(m, 0.5), 0.0, [1.0; 3], &|x, y, z| x * x + y * y + z * z < 0.25);
    let wall = 0.485 * 0.485..0.25;
    solid("shell", Inertia::shell(m, 0.4925), 0.0, [1.0; 3], &|x, y, z| {
        wall.contains(&(x * x + y * y + z * z))
    });
    // The tip is up at z = 1, the base at z = −1.
    let cone = |x: f64, y: f64, z: f64| x * x + y * y < (0.25 * (1.0 - z)).powi(2);
    solid("cone", Inertia::cone(m, 0.5, 2.0), -0.5, [1.0, 1.0, 2.0], &cone);
    // The flat side is down.
    let hemisphere = |x: f64, y: f64, z: f64| x * x + y * y + (z + 0.25) * (z + 0.25) < 0.25;
    solid("hemisphere", Inertia::hemisphere(m, 0.5), -0.0625, [1.0, 1.0, 0.5], &hemisphere);
    // Its axis along y here, the flat side down, as the grid finds centers on z.
    let turn = Mat3::from_columns(Vec3::Z, Vec3::X, Vec3::Y);
    let half_cylinder = |x: f64, _: f64, z: f64| x * x + (z + 0.25) * (z + 0.25) < 0.25;
    let turned = Inertia::turned(Inertia::half_cylinder(m, 0.5, 1.2), turn);
    let center = 2.0 / (3.0 * core::f64::consts::PI) - 0.25;
    solid("half cylinder", turned, center, [1.0, 1.2, 0.5], &half_cylinder);
    let ring = Inertia::ring(m, 0.4925);
    solid("ring", ring, 0.0, [1.0, 1.0, 1e-3], &|x, y, _| wall.contains(&(x * x + y * y)));
    // Isosceles, the tip up: its axes are principal.
    let triangle = Inertia::triangle(m, vec3(-0.5, 0.0, 0.0), vec3(0.5, 0.0, 0.0), vec3(0.0, 0.0, 2.0));
    let inside = |x: f64, _: f64, z: f64| x.abs() < 0.25 * (1.0 - z);
    solid("triangle", triangle, -1.0 / 3.0, [1.0, 1e-3, 2.0], &inside);
    let ellipsoid = |x: f64, y: f64, z: f64| x * x + (y / 1.5).powi(2) + (z / 0.5).powi(2) < 1.0;
    solid("ellipsoid", Inertia::ellipsoid(m, 1.0, 1.5, 0.5), 0.0, [2.0, 3.0, 1.0], &ellipsoid);
    let thin = Inertia::cuboid(m, 0.7, 1.1, 0.0).value();
    assert_eq!(Inertia::plate(m, 0.7, 1.1).value(), thin);
    let (rod, cuboid) = (Inertia::rod(m, 1.7).value(), Inertia::cuboid(m, 0.0, 0.0, 1.7).value());
    assert!((0..3).all(|i| (rod[(i, i)] - cuboid[(i, i)]).abs() < 1e-15), "{rod:?} and {cuboid:?}");
}
