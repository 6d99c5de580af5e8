//! A gyrostat: a satellite that spins about its intermediate axis. A wheel on that axis keeps it from turning
//! over.
//!
//!     A ω̇₁ = ((B − C) ω₂ + h) ω₃,    C ω̇₃ = ((A − B) ω₂ − h) ω₁
//!     h = J (ω₂ + spin)
//!
//! These are Euler's equations with the momentum h of the wheel. For A < B < C the steady spin ω₂ = Ω is
//! stable if h > (C − B) Ω. The axis then wobbles with λ² = (h − (C − B) Ω)(h + (B − A) Ω)/(A
//! C). With less momentum it swings to ω₂ = 2 h/(C − B) − Ω and back; without a wheel it turns over
//! (P. C. Hughes, Spacecraft Attitude Dynamics, Wiley 1986, chapter 6).

mod common;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

/// A satellite spun about its intermediate axis, with a wheel on that axis. Without the wheel it tumbles like
/// the book; a wheel that turns fast enough with it keeps it upright. Compare the starts.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(e: [_; 4], wheel: rad)]
#[speeds(omega: [rad / s; 3], spin: rad / s)]
#[units(inertia: kg * m^2, j: kg * m^2)]
struct Gyrostat {
    /// Moments of inertia about the principal axes, that of the wheel about its axle apart.
    inertia: [f64; 3],
    /// Of the wheel about its axle, the second axis.
    j: f64,
}

#[dynamics]
impl Gyrostat {
    fn frame(&self, q: &Coordinates<Self>) -> Frame {
        Frame::turned(EulerParameters::new(q.e).rotation())
    }
    /// Components of the angular velocity along the body's axes.
    #[kinematic]
    fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
        self.frame(q).angular_velocity_in_body()
    }
    /// Of the wheel against the body.
    #[kinematic]
    fn spin(&self, q: &Coordinates<Self>) -> Expr {
        q.wheel.dt()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let (w, [a, b, c]) = (self.omega(q), self.inertia);
        0.5 * (a * w.x * w.x + b * w.y * w.y + c * w.z * w.z) + 0.5 * self.j * (w.y + self.spin(q)).powi(2)
    }
    #[holonomic]
    fn unit(&self, q: &Coordinates<Self>) -> Expr {
        EulerParameters::new(q.e).norm_constraint()
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let frame = self.frame(q);
        let along = |y: f64| frame.point(vec3(0.0, y, 0.0));
        let rim = frame.vector(vec3(q.wheel.sin(), 0.0, q.wheel.cos()));
        Drawing::new()
            .cuboid(frame, Vec3::ZERO, [0.9, 0.6, 0.3])
            .color(Color::Red)
            .cylinder(along(0.31), along(0.37), 0.28)
            .disc(along(0.38) + 0.22 * rim, 0.03)
            .plain()
            .trace("axle", along(0.6))
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let satellite = Gyrostat { inertia: [0.6, 1.0, 1.3], j: 0.05 };
    let start = |spin: f64| {
        let state = satellite.state().e([1.0, 0.0, 0.0, 0.0]);
        state.omega([0.02, 2.0, 0.02]).spin(spin).build()
    };
    Ok(satellite
        .live(start(0.0)?)
        .title("Satellite with a wheel")
        .first_start("the wheel rests in it")
        .start("a fast wheel", start(16.0)?)
        .start("a wheel that is too slow", start(6.0)?)
        .range("inertia[0]", 0.3, 1.5)
        .range("inertia[1]", 0.3, 1.5)
        .range("inertia[2]", 0.3, 1.5)
        .range("j", 0.01, 0.2)
        .method(methods::Dop853)
        .tolerance(1e-10)
        .phase("e[0]")
        .finish()?)
}

fn main() -> common::Outcome {
    let satellite = Gyrostat { inertia: [1.0, 2.0, 3.0], j: 0.05 };
    let ([a, b, c], turning, beside) = (satellite.inertia, 1.0, 1e-3);
    let threshold = (c - b) * turning;
    // The start in speeds: a turn about the second axis, a little beside it, with this momentum in the wheel.
    let spun = |momentum: f64| {
        let start = satellite.state().e([1.0, 0.0, 0.0, 0.0]);
        start.omega([beside, turning, 0.0]).spin(momentum / satellite.j - turning).build()
    };
    println!("{}", Gyrostat::REPORT);
    let mut lines = Vec::new();
    for (name, momentum) in
        [("wheel at rest", 0.0), ("wheel too slow", 0.7 * threshold), ("wheel fast enough", 2.0 * threshold)]
    {
        let motion = satellite.simulate(spun(momentum)?).until(60.0).tolerance(1e-11).run()?;
        assert!(motion.summary().energy_drift < 1e-8, "{}", motion.summary());
        // Speeds are outputs as well.
        let omega = |axis: usize, t: f64| motion.outputs_at(t)[axis];
        let along: Vec<(f64, f64)> = common::times(60.0, 1200).map(|t| (t, omega(1, t))).collect();
        let least = along.iter().map(|(_, y)| *y).fold(turning, f64::min);
        println!("{name}: the spin about the intermediate axis falls to {least:.6} rad/s");
        if momentum > threshold {
            // ω₁ = ε cos λt in the linear approximation.
            let wobble = ((momentum - (c - b) * turning) * (momentum + (b - a) * turning) / (a * c)).sqrt();
            let apart = common::times(60.0, 600).map(|t| (omega(0, t) - beside * (wobble * t).cos()).abs());
            let worst = apart.fold(0.0, f64::max);
            println!("it wobbles with {wobble:.6} rad/s, as the linear theory has it to {worst:.1e} rad/s");
            assert!(least > 0.999_99 && worst < 1e-7);
        } else {
            // Where ω₁ = 0, energy and angular momentum leave this beside Ω.
            let swung = 2.0 * momentum / (c - b) - turning;
            println!("energy and angular momentum say {swung:.6} rad/s");
            assert!((least - swung).abs() < 1e-3);
        }
        lines.push((name, along));
    }

    let mut files = common::Files::of("gyrostat");
    let panel = Panel::new(Axis::new("time in s"), Axis::new("spin about the intermediate axis in rad/s"));
    let panel = lines.into_iter().fold(panel, |panel, (name, line)| panel.line(name, line));
    Chart::new("A gyrostat").panel(panel).write_svg(files.path("spin.svg"))?;
    for (name, momentum) in [("turns_over.html", 0.0), ("held.html", 2.0 * threshold)] {
        let motion = satellite.simulate(spun(momentum)?).until(40.0).tolerance(1e-9).run()?;
        let film = Animation::new().add(&motion, "satellite").title("A gyrostat").plot(["omega[1]", "spin"]);
        film.speed(2.0).write_html(files.path(name))?;
    }
    files.live(live()?)?;
    files.list();
    Ok(())
}
