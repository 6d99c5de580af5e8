//! The two modes of a double pendulum, followed to large swings.
//!
//!     ω² = (2 ∓ √2) g/l with θ₂ = ±√2 θ₁
//!     then closed motions of growing energy, each by shooting from the last
//!
//! Families of closed motions begin with the linear modes (A. M. Lyapunov, 1892). Frequencies fall as the
//! energy grows. Where multipliers leave the unit circle, neighbours move away from the motion, although the
//! motion itself does not show it. Beyond that begins the chaos of [double_pendulum](double_pendulum.rs).

#[path = "../tests/models/double_pendulum.rs"]
#[allow(dead_code)]
mod bobs;
mod common;

use bobs::DoublePendulum;
use dynamics::analysis::{BackboneCurve, Page};
use dynamics::output::{Axis, Panel};
use dynamics::prelude::*;

type Curve = BackboneCurve<State<DoublePendulum>>;

/// A family up to an energy, or as far as it goes.
fn family(model: &DoublePendulum, mode: usize, energy: f64) -> Result<Curve, Box<dyn std::error::Error>> {
    let rest = model.state().build()?;
    match model.nonlinear_mode(&rest, mode).until(energy).points(60).run() {
        Ok(curve) => Ok(curve),
        Err(error) => {
            println!("mode {}: {error}\n", mode + 1);
            error.curve().cloned().ok_or_else(|| error.into())
        }
    }
}

fn main() -> common::Outcome {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let [slow, fast] = [family(&model, 0, 24.0)?, family(&model, 1, 24.0)?];
    for (curve, square) in [(&slow, 2.0 - 2f64.sqrt()), (&fast, 2.0 + 2f64.sqrt())] {
        println!("{curve}\n");
        let linear = (square * model.g / model.l1).sqrt();
        assert!((curve.points[0].frequency / linear - 1.0).abs() < 1e-5, "it begins with the linear mode");
        assert!(
            curve.points.windows(2).all(|pair| pair[1].frequency < pair[0].frequency),
            "it goes slower, farther out"
        );
    }

    let mut files = common::Files::of("double_pendulum_modes");
    let frequencies = Panel::new(Axis::new("energy above rest in J"), Axis::new("frequency in rad/s"));
    let frequencies = fast.lines("fast mode", slow.lines("slow mode", frequencies));
    let mut page = Page::new("Modes of a double pendulum, from small to large").panels(
        "Frequency over energy",
        "Closed motions that begin with the two linear modes. Stable: no disturbance grows, to first order.",
        [frequencies],
    );
    for (name, curve) in [("slow", &slow), ("fast", &fast)] {
        let mut panel = Panel::new(Axis::new("first angle in °"), Axis::new("second angle in °"));
        let count = curve.points.len();
        for k in [count / 8, count / 3, 2 * count / 3, count - 1] {
            let point = &curve.points[k];
            let start = point.orbit.start;
            let motion = model.simulate(start).until(start.t + point.orbit.period).tolerance(1e-11).run()?;
            let end = motion.end();
            assert!(
                (end.theta1() - start.theta1()).abs().max((end.theta2() - start.theta2()).abs()) < 1e-6,
                "it closes"
            );
            let path = motion.sample((0..=300).map(|i| start.t + point.orbit.period * f64::from(i) / 300.0));
            let path: Vec<_> = path.map(|s| (s.theta1().to_degrees(), s.theta2().to_degrees())).collect();
            panel = panel.line(format!("{:.2} J", point.energy), path);
        }
        page = page.panels(
            &format!("The {name} mode"),
            "One angle over the other, in closed motions of four energies: a straight line while the motion \
             is small.",
            [panel],
        );
    }
    page.write_html(files.path("modes.html"))?;

    // The last stable motion of the fast mode, three times round.
    let stable = fast.points.iter().rfind(|point| point.orbit.floquet.is_stable());
    let shown = stable.ok_or("some of the fast mode is stable")?;
    let start = shown.orbit.start;
    let motion = model.simulate(start).until(start.t + 6.0 * shown.orbit.period).tolerance(1e-10).run()?;
    motion.animation().plot(["theta1", "theta2"]).write_html(files.path("fast_mode.html"))?;
    files.list();
    Ok(())
}
