//! A wheel in a gimbal, and the acceleration of a point on its rim (after problem P1.4 of Schmerr's
//! textbook).
//!
//! The outer ring turns by ψ about the vertical, the inner ring by ϑ about an axis of the outer one, the
//! wheel by φ in the inner one. Seen from the inner ring, which turns with w = (ϑ̇, ψ̇ sin ϑ, ψ̇ cos
//! ϑ), the point moves in a circle. The transport theorem gives its acceleration:
//!
//!     a = a_rel + ẇ × r + w × (w × r) + 2 w × v_rel
//!
//! A weight on the axle does not tip a fast wheel over: the wheel precesses. No bearing has friction, so p_φ
//! of the wheel and p_ψ of the whole are conserved.

mod common;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

/// A wheel in a gimbal, with a weight on its axle. The weight does not tip a fast wheel over: the whole turns
/// about the vertical instead. Take the start without spin, or put more weight on the axle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(outer: rad, inner: rad, spin: rad)]
#[units(mass: kg, radius: m, rings: kg, weight: kg, arm: m, g: m / s^2)]
struct Gimbal {
    mass: f64,
    radius: f64,
    /// Mass of either ring.
    rings: f64,
    /// A weight on the axle, at this distance.
    weight: f64,
    arm: f64,
    g: f64,
}

#[dynamics]
impl Gimbal {
    fn outer(&self, q: &Coordinates<Self>) -> Frame {
        Frame::turned(Mat3::rotation_z(q.outer))
    }
    fn inner(&self, q: &Coordinates<Self>) -> Frame {
        self.outer(q).frame(Vec3::ZERO, Mat3::rotation_x(q.inner))
    }
    fn wheel(&self, q: &Coordinates<Self>) -> Frame {
        self.inner(q).frame(Vec3::ZERO, Mat3::rotation_z(q.spin))
    }
    fn rim(&self, q: &Coordinates<Self>) -> Vec3 {
        self.wheel(q).point(self.radius * Vec3::X)
    }
    fn load(&self, q: &Coordinates<Self>) -> Vec3 {
        self.inner(q).point(self.arm * Vec3::Z)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        // The outer ring stands upright, its axis along y.
        let upright = Inertia::turned(self.ring(1.5), Mat3::rotation_x(core::f64::consts::FRAC_PI_2));
        let wheel = Inertia::cylinder(self.mass, self.radius, 0.0);
        RigidBody::new(self.rings, Vec3::ZERO, upright, self.outer(q)).kinetic_energy()
            + RigidBody::new(self.rings, Vec3::ZERO, self.ring(1.25), self.inner(q)).kinetic_energy()
            + RigidBody::new(self.mass, Vec3::ZERO, wheel, self.wheel(q)).kinetic_energy()
            + 0.5 * self.weight * self.load(q).dt().norm_squared()
    }
    /// A thin ring, so many times as wide as the wheel.
    fn ring(&self, times: f64) -> Mat3 {
        Inertia::tube(self.rings, times * self.radius, times * self.radius, 0.0)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.weight * self.g * self.load(q).z
    }
    /// Of the point on the rim, in the axes of the inner ring.
    #[output]
    fn acceleration(&self, q: &Coordinates<Self>) -> Vec3 {
        self.inner(q).components_of(self.rim(q).dt().dt())
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let circle = |frame: Frame, times: f64, across: Vec3<f64>| {
            let (u, r) = (Vec3::new(1.0, 0.0, 0.0), times * self.radius);
            move |angle: f64| frame.point((u * angle.cos() + across * angle.sin()) * r)
        };
        let turn = std::f64::consts::TAU;
        let (outer, inner, wheel) = (self.outer(q), self.inner(q), self.wheel(q));
        let half = 0.06 * self.radius * Vec3::Z;
        Drawing::new()
            .color(Color::Faint)
            .cylinder([0.0, 0.0, -2.0 * self.radius], [0.0, 0.0, -1.5 * self.radius], 0.08 * self.radius)
            .plain()
            .width(3.0)
            .curve(0.0, turn, 72, circle(outer, 1.5, Vec3::new(0.0, 0.0, 1.0)))
            .color(Color::Blue)
            .curve(0.0, turn, 72, circle(inner, 1.25, Vec3::new(0.0, 1.0, 0.0)))
            .plain()
            .line(outer.point(-1.5 * self.radius * Vec3::X), inner.point(-1.25 * self.radius * Vec3::X))
            .line(outer.point(1.5 * self.radius * Vec3::X), inner.point(1.25 * self.radius * Vec3::X))
            .cylinder(inner.point(-0.3 * self.radius * Vec3::Z), self.load(q), 0.04 * self.radius)
            .cylinder(wheel.point(-half), wheel.point(half), self.radius)
            .color(Color::Red)
            .disc(self.rim(q), 0.07 * self.radius)
            .disc(self.load(q), 0.1 * self.radius)
            .tail("rim", self.rim(q), 0.05)
            .trace("load", self.load(q))
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let gimbal = Gimbal { mass: 2.0, radius: 0.1, rings: 0.3, weight: 0.4, arm: 0.14, g: 9.81 };
    let start = |spin: f64| gimbal.state().inner(1.1).spin_rate(spin).build();
    Ok(gimbal
        .live(start(60.0)?)
        .title("Wheel in a gimbal")
        .first_start("fast")
        .start("slow", start(15.0)?)
        .start("without spin", start(0.0)?)
        .range("mass", 0.5, 5.0)
        .range("weight", 0.0, 2.0)
        .range("arm", 0.05, 0.3)
        .range("rings", 0.05, 1.0)
        .hold(["radius", "g"])
        .method(methods::Dop853)
        .tolerance(1e-10)
        .plot(["outer", "inner"])
        .phase("inner")
        .finish()?)
}

fn main() -> common::Outcome {
    let gimbal = Gimbal { mass: 2.0, radius: 0.1, rings: 0.3, weight: 0.4, arm: 0.14, g: 9.81 };
    let (tilt, spin) = (1.1, 120.0);
    let start = gimbal.state().inner(tilt).spin_rate(spin).build()?;
    let motion = gimbal.simulate(start).until(5.0).tolerance(1e-12).run()?;
    println!("{}", motion.summary());

    // The closed form beside what the model says, all along the motion.
    let (mut apart, mut largest) = (0.0_f64, 0.0_f64);
    for s in motion.sample(common::times(5.0, 500)) {
        let [outer, inner, wheel]: [f64; 3] = gimbal.accelerations(&s)?.into();
        let ((sin, cos), (psi, theta, phi)) =
            (s.inner().sin_cos(), (s.outer_rate(), s.inner_rate(), s.spin_rate()));
        let w = Vec3::new(theta, psi * sin, psi * cos);
        let w_rate = Vec3::new(inner, outer * sin + psi * theta * cos, outer * cos - psi * theta * sin);
        let (along, across) =
            (Vec3::new(s.spin().cos(), s.spin().sin(), 0.0), Vec3::new(-s.spin().sin(), s.spin().cos(), 0.0));
        let (r, v) = (along * gimbal.radius, across * (gimbal.radius * phi));
        let relative = across * (gimbal.radius * wheel) - along * (gimbal.radius * phi * phi);
        let by_hand = relative + w_rate.cross(r) + w.cross(w.cross(r)) + w.cross(v) * 2.0;
        let mut found = [0.0; 3];
        gimbal.outputs(&s, &mut found)?;
        apart = apart.max((Vec3::from(found) - by_hand).norm());
        largest = largest.max(by_hand.norm());
    }
    println!(
        "the rim is accelerated by up to {largest:.1} m/s²; closed form and model differ by {apart:.1e} m/s²"
    );
    assert!(apart < 1e-11 * largest);

    // A fast wheel goes round with m g l/p_φ in the mean, and keeps its tilt but for a tremble.
    let momentum = 0.5 * gimbal.mass * gimbal.radius.powi(2) * spin;
    let expected = gimbal.weight * gimbal.g * gimbal.arm / momentum;
    let precession = motion.end().outer() / 5.0;
    let fall = motion.steps().map(|s| (s.inner() - tilt).abs()).fold(0.0, f64::max);
    println!(
        "it goes round with {precession:.4} rad/s, m g l/p_φ = {expected:.4}; it tips by {:.2}°",
        fall.to_degrees()
    );
    assert!((precession / expected - 1.0).abs() < 0.02 && fall < 0.03);

    let mut files = common::Files::of("gimbal");
    let samples: Vec<_> = motion.sample(common::times(1.0, 2000)).collect();
    let panel = |title| Panel::new(Axis::new("time in s"), Axis::new(title));
    Chart::new("A wheel in a gimbal, with a weight on its axle")
        .panel(panel("tilt ϑ in degrees").line("ϑ", samples.iter().map(|s| (s.t, s.inner().to_degrees()))))
        .panel(panel("ψ in degrees").line("ψ", samples.iter().map(|s| (s.t, s.outer().to_degrees()))))
        .write_svg(files.path("precession.svg"))?;
    Animation::new()
        .add(&motion, "")
        .plot(["outer", "inner"])
        .speed(0.25)
        .write_html(files.path("gimbal.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
