//! A gyroscope on a pivot, released with its axis at rest. It falls a little, and its axis moves in cusps.
//!
//!     T = ½ A (ϑ̇² + φ̇² sin²ϑ) + ½ C (ψ̇ + φ̇ cos ϑ)²,        V = m g l cos ϑ
//!
//! Both p_φ and p_ψ are conserved. The axis falls to where p_ψ² (cos ϑ₀ − cos ϑ) = 2 A m g l
//! sin²ϑ, a quadratic in cos ϑ, and returns. A fast gyroscope precesses with m g l/p_ψ in the mean. The
//! angles are singular only where the axis is upright, which it never is.

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A heavy top on a pivot, let go with its axis at rest. It falls a little, is turned aside, and its axis
/// moves in cusps. Take the other starts: pushed just right it precesses evenly, pushed backward it moves in
/// loops, and slow it tumbles.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(angles: [rad; 3])]
#[units(mass: kg, radius: m, thickness: m, arm: m, g: m / s^2)]
struct Gyroscope {
    mass: f64,
    radius: f64,
    thickness: f64,
    arm: f64,
    g: f64,
}

#[dynamics]
impl Gyroscope {
    fn rotor(&self, q: &Coordinates<Self>) -> RigidBody {
        let frame = Frame::turned(Mat3::euler(EulerSequence::Zxz, q.angles));
        let inertia = Inertia::cylinder(self.mass, self.radius, self.thickness);
        RigidBody::new(self.mass, self.arm * Vec3::Z, inertia, frame)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.rotor(q).kinetic_energy()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.rotor(q).potential_energy(-self.g * Vec3::Z)
    }
    /// The axis is at the end of its fall, or of its rise.
    #[event]
    fn turning(&self, q: &Coordinates<Self>) -> Expr {
        q.angles[1].dt()
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let frame = self.rotor(q).frame;
        let along = |z: f64| frame.point(vec3(0.0, 0.0, z));
        // A mark on the rotor shows its spin.
        let mark = frame.point(vec3(0.8 * self.radius, 0.0, self.arm + 0.5 * self.thickness));
        Drawing::new()
            .color(Color::Faint)
            .cone([0.0, 0.0, -1.2 * self.arm], [0.0; 3], 0.3 * self.radius)
            .cylinder([0.0; 3], along(1.4 * self.arm), 0.04 * self.radius)
            .plain()
            .cylinder(
                along(self.arm - 0.5 * self.thickness),
                along(self.arm + 0.5 * self.thickness),
                self.radius,
            )
            .color(Color::Red)
            .disc(mark, 0.12 * self.radius)
            .plain()
            .trace("tip", along(1.4 * self.arm))
    }
}

impl Gyroscope {
    /// The slow precession that goes on evenly at this tilt, where the spin ψ̇ of the rotor is given:
    /// (A − C) cos ϑ φ̇² − C ψ̇ φ̇ + m g l = 0.
    fn steady(&self, tilt: f64, spin: f64) -> f64 {
        let inertia = Inertia::cylinder(self.mass, self.radius, self.thickness).value();
        let (along, across) = (inertia[(2, 2)], inertia[(0, 0)] + self.mass * self.arm.powi(2));
        let moment = self.mass * self.g * self.arm;
        let half = 0.5 * along * spin;
        moment / (half + (half * half - (across - along) * tilt.cos() * moment).sqrt())
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let gyroscope = Gyroscope { mass: 0.3, radius: 0.04, thickness: 0.01, arm: 0.05, g: 9.81 };
    let tilt = 1.2_f64;
    let start = |push: f64, spin: f64| {
        gyroscope.state().angles([0.0, tilt, 0.0]).angles_rate([push, 0.0, spin]).build()
    };
    Ok(gyroscope
        .live(start(0.0, 120.0)?)
        .title("Heavy top")
        .first_start("let go: cusps")
        .start("steady", start(gyroscope.steady(tilt, 120.0), 120.0)?)
        .start("pushed on: waves", start(2.0, 120.0)?)
        .start("pushed back: loops", start(-4.0, 120.0)?)
        .start("slow", start(0.0, 45.0)?)
        .range("mass", 0.05, 2.0)
        .range("radius", 0.02, 0.08)
        .range("arm", 0.02, 0.15)
        .range("g", 0.0, 25.0)
        .hold(["thickness"])
        .method(methods::Dop853)
        .tolerance(1e-10)
        .plot(["angles[0]", "angles[1]"])
        .phase("angles[1]")
        .finish()?)
}

fn main() -> common::Outcome {
    let gyroscope = Gyroscope { mass: 0.3, radius: 0.04, thickness: 0.01, arm: 0.05, g: 9.81 };
    let (tilt, spin) = (1.2_f64, 180.0);
    let start = gyroscope.state().angles([0.0, tilt, 0.0]).angles_rate([0.0, 0.0, spin]).build()?;
    let motion = gyroscope.simulate(start).until(6.0).tolerance(1e-12).run()?;
    println!("{}", motion.summary());

    let inertia = Inertia::cylinder(gyroscope.mass, gyroscope.radius, gyroscope.thickness).value();
    let (along, across) = (inertia[(2, 2)], inertia[(0, 0)] + gyroscope.mass * gyroscope.arm.powi(2));
    let (momentum, moment) = (along * spin, gyroscope.mass * gyroscope.g * gyroscope.arm);
    // λ (u₀ − u) = 1 − u², the root between −1 and u₀.
    let (lambda, upper) = (momentum.powi(2) / (2.0 * across * moment), tilt.cos());
    let lower =
        2.0 * (lambda * upper - 1.0) / (lambda + (lambda * lambda - 4.0 * (lambda * upper - 1.0)).sqrt());
    let lowest: Vec<f64> = motion
        .events()
        .iter()
        .filter(|e| e.direction == Direction::Falling)
        .map(|e| e.after.angles(1))
        .collect();
    println!(
        "{} times it falls to {:.6}°, by the closed form {:.6}°",
        lowest.len(),
        lowest[0].to_degrees(),
        lower.acos().to_degrees()
    );
    assert!(lowest.len() > 20);
    assert!(lowest.iter().all(|theta| (theta.cos() - lower).abs() < 1e-10));

    let precession = motion.end().angles(0) / motion.end().t;
    println!("it precesses with {precession:.4} rad/s in the mean; m g l/p_ψ = {:.4}", moment / momentum);
    assert!((precession * momentum / moment - 1.0).abs() < 0.05);

    let mut files = common::Files::of("gyroscope");
    let samples = |until: f64| motion.sample(common::times(until, 3000));
    let degrees = |x: f64| x.to_degrees();
    Chart::new("A gyroscope that is let go")
        .panel(
            Panel::new(Axis::new("precession φ in degrees"), Axis::new("fall ϑ in degrees"))
                .line("axis", samples(1.5).map(|s| (degrees(s.angles(0)), degrees(s.angles(1)))))
                .line(
                    "lowest by the closed form",
                    [0.0, degrees(motion.at(1.5).angles(0))].map(|x| (x, degrees(lower.acos()))),
                ),
        )
        .panel_height(360.0)
        .write_svg(files.path("cusps.svg"))?;
    // The spin would be all that is seen of three angles.
    motion.animation().plot(["angles[1]"]).write_html(files.path("gyroscope.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
