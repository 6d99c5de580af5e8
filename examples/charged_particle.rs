//! A proton in crossed electric and magnetic fields.
//!
//!     L = ½ m |ṙ|² + e ṙ·A − e φ,        A = ½ B × r,        φ = −E·r
//!
//! This is not T − V: the magnetic field enters with the velocity, so the Lagrangian is written directly.
//! Without E the proton circles with the radius m v / (e B) and the period 2π m / (e B). With E it drifts at
//! right angles to both, with E × B / B².

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A proton in a magnetic field goes in a circle. With an electric field across it drifts with E × B/B², at
/// right angles to both fields, whatever its start. Give it a velocity along the field, and the circle
/// becomes a helix.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, z: m)]
#[units(mass: kg, charge: C, magnetic: T, electric: V / m)]
struct Particle {
    mass: f64,
    charge: f64,
    magnetic: Vec3<f64>,
    electric: Vec3<f64>,
}

#[dynamics]
impl Particle {
    fn place(&self, q: &Coordinates<Self>) -> Vec3 {
        vec3(q.x, q.y, q.z)
    }
    #[lagrangian]
    fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
        let (place, velocity) = (self.place(q), self.place(q).dt());
        let vector_potential = 0.5 * self.magnetic.cross(place);
        let potential = -self.electric.dot(place);
        0.5 * self.mass * velocity.norm_squared() + self.charge * (velocity.dot(vector_potential) - potential)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let place = self.place(q);
        Drawing::new().axes(5e-3).trace("proton", place).dot(place)
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let proton = Particle {
        mass: 1.672_621_9e-27,
        charge: 1.602_176_6e-19,
        magnetic: Vec3::new(0.0, 0.0, 0.5),
        electric: Vec3::new(0.0, 1e4, 0.0),
    };
    let start = |along: f64, up: f64| proton.state().x_rate(along).z_rate(up).build();
    Ok(proton
        .live(start(1e5, 0.0)?)
        .title("Proton in crossed fields")
        .first_start("across the field")
        .start("as a helix", start(1e5, 1e4)?)
        .start("at rest", start(0.0, 0.0)?)
        .start("as fast as the drift", start(2e4, 0.0)?)
        .range("magnetic.x", -1.0, 1.0)
        .range("magnetic.y", -1.0, 1.0)
        .range("magnetic.z", -1.0, 1.0)
        .range("electric.x", -3e4, 3e4)
        .range("electric.y", -3e4, 3e4)
        .range("electric.z", -3e4, 3e4)
        .hold(["mass", "charge"])
        .method(methods::Dop853)
        .plot(["x_rate", "y_rate"])
        .finish()?)
}

fn main() -> common::Outcome {
    let zero = Vec3::new(0.0, 0.0, 0.0);
    let proton = Particle {
        mass: 1.672_621_9e-27,
        charge: 1.602_176_6e-19,
        magnetic: Vec3::new(0.0, 0.0, 0.5),
        electric: zero,
    };
    let b = proton.magnetic.z;
    let omega = proton.charge * b / proton.mass;
    let period = std::f64::consts::TAU / omega;

    // Without E: a circle, closed after one period, two radii wide after half of it.
    let speed = 1e5;
    let circle =
        proton.simulate(proton.state().x_rate(speed).build()?).until(period).tolerance(1e-12).run()?;
    let radius = proton.mass * speed / (proton.charge * b);
    assert!(f64::hypot(circle.end().x(), circle.end().y()) < 1e-9 * radius);
    let half = circle.at(0.5 * period);
    assert!((f64::hypot(half.x(), half.y()) / (2.0 * radius) - 1.0).abs() < 1e-9);
    println!("radius {:.4} mm, period {:.4} ns", radius * 1e3, period * 1e9);

    // With E along x, from rest but for a speed along B: the cycloid x = R (1 − cos ωt), y = R (sin ωt − ωt)
    // with R = E / (B ω).
    let crossed = Particle { electric: Vec3::new(2e4, 0.0, 0.0), ..proton.clone() };
    let cycloid =
        crossed.simulate(crossed.state().z_rate(2e4).build()?).until(6.0 * period).tolerance(1e-12).run()?;
    let drift = crossed.electric.cross(crossed.magnetic) / crossed.magnetic.norm_squared();
    let size = crossed.electric.x / (b * omega);
    for state in cycloid.steps() {
        let phase = omega * state.t;
        assert!((state.x() - size * (1.0 - phase.cos())).abs() < 1e-9 * size);
        assert!((state.y() - size * (phase.sin() - phase)).abs() < 1e-9 * size);
    }
    let mean = cycloid.end().y() / cycloid.end_time();
    assert!((mean / drift.y - 1.0).abs() < 1e-9);
    println!("drift {:.3} m/s, E × B / B² = {:.3} m/s", mean, drift.y);
    println!("\n{}", cycloid.summary());

    let mut files = common::Files::of("charged_particle");
    let path = |motion: &Motion<'_, Particle>| -> Vec<(f64, f64)> {
        motion.sample(common::times(motion.end_time(), 600)).map(|s| (s.y() * 1e3, s.x() * 1e3)).collect()
    };
    Chart::new("A proton in 0.5 T")
        .panel(
            Panel::new(Axis::new("y in mm"), Axis::new("x in mm"))
                .equal_axes()
                .line("E = 0, v = 10⁵ m/s", path(&circle))
                .line("E = 20 kV/m along x", path(&cycloid)),
        )
        .write_svg(files.path("paths.svg"))?;
    cycloid.animate(files.path("drift.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
