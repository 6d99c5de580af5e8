//! A bead in a smooth tube that turns in a horizontal plane at a constant rate Ω.
//!
//!     L = ½ m (ṙ² + Ω² r²),        r̈ = Ω² r,        r(t) = r₀ cosh Ω t
//!
//! The position r (cos Ωt, sin Ωt) contains time. So the energy function E = q̇ ∂L/∂q̇ − L = ½ m
//! (ṙ² − Ω² r²) is not the energy T + V. E is conserved, while T grows by the work of whatever turns
//! the tube.

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A bead in a smooth tube that turns in a horizontal plane at a constant rate. Nothing pushes it outward,
/// yet it leaves as r₀ cosh Ωt. Its energy grows by the work of the torque; what is kept is the energy
/// function E. Push it inward so that it just reaches the middle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(r: m)]
#[units(mass: kg, omega: rad / s)]
struct Tube {
    mass: f64,
    omega: f64,
}

#[dynamics]
impl Tube {
    /// Of half of the tube.
    const LENGTH: f64 = 2.0;

    fn bead(&self, q: &Coordinates<Self>) -> Vec2 {
        let angle = self.omega * q.t;
        q.r * vec2(angle.cos(), angle.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bead(q).dt().norm_squared()
    }
    /// Torque that keeps the tube turning: the rate of the bead's angular momentum.
    #[output]
    fn torque(&self, q: &Coordinates<Self>) -> Expr {
        (self.mass * self.bead(q).cross(self.bead(q).dt())).dt()
    }
    /// Either end of the tube.
    #[event]
    fn mouth(&self, q: &Coordinates<Self>) -> Expr {
        q.r.powi(2) - Self::LENGTH.powi(2)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let bead = self.bead(q);
        let angle = self.omega * q.t;
        let end = 2.1 * vec2(angle.cos(), angle.sin());
        Drawing::new()
            .trace("bead", bead)
            .color(Color::Faint)
            .width(6.0)
            .line(-end, end)
            .plain()
            .pivot([0.0, 0.0])
            .disc(bead, 0.06)
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let tube = Tube { mass: 0.2, omega: 3.0 };
    let start = |r: f64, rate: f64| tube.state().r(r).r_rate(rate).build();
    Ok(tube
        .live(start(0.05, 0.0)?)
        .title("Bead in a rotating tube")
        .first_start("at rest in the tube")
        .start("pushed inward", start(1.5, -4.4)?)
        .start("pushed through", start(1.5, -5.0)?)
        .range("mass", 0.05, 1.0)
        .range("omega", 0.2, 6.0)
        .tolerance(1e-10)
        .plot(["r", "torque"])
        .stop_at("mouth", Direction::Rising)
        .finish()?)
}

fn main() -> common::Outcome {
    let tube = Tube { mass: 0.2, omega: 3.0 };
    let (r0, length) = (0.05, Tube::LENGTH);
    let start = tube.state().r(r0).build()?;
    let motion =
        tube.simulate(start).until(10.0).tolerance(1e-12).stop_at("mouth", Direction::Rising).run()?;
    println!("{}\n{}", Tube::REPORT, motion.summary());

    let leaves = motion.end_time();
    assert!((leaves - (length / r0).acosh() / tube.omega).abs() < 1e-10);
    println!("the bead leaves the tube after {leaves:.6} s = arcosh(l/r₀)/Ω");
    let cosh = |t: f64| r0 * (tube.omega * t).cosh();
    let times = || common::times(leaves, 400);
    for state in motion.sample(times()) {
        assert!((state.r() - cosh(state.t)).abs() < 1e-10);
    }

    // The work of the torque by Simpson's rule, against the change of T.
    let h = leaves / 400.0;
    let torques: Vec<f64> = motion.sample(times()).map(|s| motion.outputs_of(&s)[0]).collect();
    let work: f64 =
        torques.windows(3).step_by(2).map(|m| h / 3.0 * (m[0] + 4.0 * m[1] + m[2]) * tube.omega).sum();
    let gained = tube.kinetic_energy(&motion.end()) - tube.kinetic_energy(&motion.start());
    println!("kinetic energy gained {gained:.6} J, work of the torque {work:.6} J");
    println!("energy function {:.6} J, then {:.6} J", motion.energy_at(0.0), motion.energy_at(leaves));
    assert!((work - gained).abs() < 1e-7 * gained);
    assert!(motion.summary().energy_drift < 1e-10);

    let mut files = common::Files::of("rotating_tube");
    Chart::new("A bead in a turning tube")
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("r in m"))
                .line("r₀ cosh Ωt", times().map(|t| (t, cosh(t))))
                .points("computed", motion.sample(times().step_by(20)).map(|s| (s.t, s.r()))),
        )
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("J"))
                .line("T", motion.sample(times()).map(|s| (s.t, tube.kinetic_energy(&s))))
                .line("E = q̇ ∂L/∂q̇ − L", motion.sample(times()).map(|s| (s.t, tube.energy_function(&s)))),
        )
        .write_svg(files.path("bead.svg"))?;
    motion.animate(files.path("bead.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
