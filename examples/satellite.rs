//! A satellite that turns by its reaction wheels.
//!
//!     hub and wheels: Σ (I ω + J (Ω + ω·a) a) = H, a constant vector of the world
//!
//! Nothing acts from outside. The motors between hub and wheels move momentum to and fro. The satellite turns
//! through 130° about an oblique axis and stops there, with H in the wheels as before. The law is that of
//! Wie, Weiss and Arapostathis (J. Guidance 12 (1989) 375): torque −k ε − d ω with the vector ε of the
//! Euler parameters of the error. Four Euler parameters have no singular attitude.

mod common;
use dynamics::error::SolveError;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(e: [_; 4], wheels: [rad; 3])]
#[inputs(motors: [N * m; 3])]
#[units(mass: kg, size: m, wheel: kg, radius: m)]
struct Satellite {
    mass: f64,
    size: [f64; 3],
    wheel: f64,
    radius: f64,
}

#[dynamics]
impl Satellite {
    fn hub(&self, q: &Coordinates<Self>) -> RigidBody {
        let [a, b, c] = self.size;
        let frame = Frame::turned(EulerParameters::new(q.e).rotation());
        RigidBody::new(self.mass, Vec3::ZERO, Inertia::cuboid(self.mass, a, b, c), frame)
    }
    /// A wheel about each axis of the hub, through its middle.
    fn wheel(&self, q: &Coordinates<Self>, k: usize) -> RigidBody {
        let quarter = core::f64::consts::FRAC_PI_2;
        let mount = match k {
            0 => Mat3::rotation_y(quarter),
            1 => Mat3::rotation_x(-quarter),
            _ => Mat3::rotation_z(0.0),
        };
        let frame = self.hub(q).frame.frame(Vec3::ZERO, mount * Mat3::rotation_z(q.wheels[k]));
        RigidBody::new(self.wheel, Vec3::ZERO, Inertia::cylinder(self.wheel, self.radius, 0.0), frame)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = self.hub(q).kinetic_energy();
        for k in 0..3 {
            sum += self.wheel(q, k).kinetic_energy();
        }
        sum
    }
    #[holonomic]
    fn unit(&self, q: &Coordinates<Self>) -> Expr {
        EulerParameters::new(q.e).norm_constraint()
    }
    #[force]
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        let [x, y, z] = q.motors;
        Force::along(q.wheels[0], x) + Force::along(q.wheels[1], y) + Force::along(q.wheels[2], z)
    }
    #[output]
    fn momentum(&self, q: &Coordinates<Self>) -> Vec3 {
        let mut sum = self.hub(q).angular_momentum(Vec3::ZERO);
        for k in 0..3 {
            sum += self.wheel(q, k).angular_momentum(Vec3::ZERO);
        }
        sum
    }
    /// Of the hub, in its axes.
    #[output]
    fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
        self.hub(q).frame.angular_velocity_in_body()
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (frame, [a, b, c]) = (self.hub(q).frame, self.size);
        let mut drawing = Drawing::new().cuboid(frame, Vec3::ZERO, self.size).color(Color::Blue);
        for side in [-1.0, 1.0] {
            drawing = drawing.cuboid(
                frame,
                vec3(0.0, side * (0.5 * b + 0.9 * a), 0.0),
                [0.8 * a, 1.6 * a, 0.02 * a],
            );
        }
        let tip = frame.point(vec3(0.0, 0.0, 1.4 * c));
        drawing
            .color(Color::Red)
            .cylinder(frame.point(vec3(0.0, 0.0, 0.5 * c)), tip, 0.03 * a)
            .trace("antenna", tip)
    }
}

fn main() -> common::Outcome {
    let satellite = Satellite { mass: 60.0, size: [0.6, 0.5, 0.8], wheel: 2.0, radius: 0.12 };
    let [a, b, c] = satellite.size;
    let inertia = Inertia::cuboid(satellite.mass, a, b, c).value();
    let target = Mat3::axis_angle(Vec3::new(0.48, -0.64, 0.6), 130_f64.to_radians()).value();

    // Critically damped in the small, all axes alike.
    let frequency = 0.4;
    let rotation = |s: &State<Satellite>| {
        EulerParameters::new(std::array::from_fn(|i| s.e(i).into())).rotation().value()
    };
    let reading = |s: &State<Satellite>| -> Result<[f64; 6], SolveError> {
        let mut outputs = [0.0; 6];
        satellite.outputs(s, &mut outputs).map(|()| outputs)
    };
    let missing = |s: &State<Satellite>| (target.transpose() * rotation(s)).to_axis_angle();
    let control = |_: f64, s: &State<Satellite>| -> [f64; 3] {
        let (Ok((axis, angle)), Ok([.., x, y, z])) = (missing(s), reading(s)) else { return [f64::NAN; 3] };
        let error = axis * (0.5 * angle).sin();
        let push = error * (2.0 * frequency * frequency) + Vec3::new(x, y, z) * (2.0 * frequency);
        // What the motor gives to the wheel it takes from the hub.
        (inertia * push).to_array()
    };
    let start = satellite.state().e([1.0, 0.0, 0.0, 0.0]).wheels_rate([40.0, -25.0, 60.0]).build()?;
    let until = 100.0;
    let motion = satellite.simulate(start).until(until).tolerance(1e-11).inputs(control).run()?;
    println!("{}", motion.summary());

    let [first, last] = [reading(&motion.at(0.0))?, reading(&motion.end())?];
    let momentum = |o: [f64; 6]| Vec3::new(o[0], o[1], o[2]);
    let drift = (momentum(last) - momentum(first)).norm() / momentum(first).norm();
    let (_, left) = missing(&motion.end())?;
    let still = Vec3::new(last[3], last[4], last[5]).norm();
    println!(
        "angular momentum drifts by {drift:.1e} of itself; {left:.1e} rad are missing, it turns with \
         {still:.1e} rad/s"
    );
    assert!(drift < 1e-9 && left.abs() < 1e-5 && still < 1e-5);

    // At rest H stands in the wheels alone, in the axes of the hub as it now is.
    let spin = 0.5 * satellite.wheel * satellite.radius.powi(2);
    let held = target.transpose() * momentum(first);
    let wheels = motion.end();
    let apart = (0..3).map(|k| (spin * wheels.wheels_rate(k) - held.to_array()[k]).abs()).fold(0.0, f64::max);
    println!("the wheels hold it to {apart:.1e} N m s");
    assert!(apart < 1e-4 * held.norm());

    let mut files = common::Files::of("satellite");
    let samples: Vec<_> = motion.sample(common::times(until, 800)).collect();
    let panel = |title| Panel::new(Axis::new("time in s"), Axis::new(title));
    let error = samples.iter().filter_map(|s| Some((s.t, missing(s).ok()?.1.to_degrees())));
    let mut rates = panel("wheels in rad/s");
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        rates = rates.line(name, samples.iter().map(|s| (s.t, s.wheels_rate(k))));
    }
    Chart::new("A satellite turns by its wheels")
        .panel(panel("still to turn, in degrees").line("angle", error))
        .panel(rates)
        .write_svg(files.path("slew.svg"))?;
    Animation::new().add(&motion, "").speed(8.0).write_html(files.path("satellite.html"))?;
    files.list();
    Ok(())
}
