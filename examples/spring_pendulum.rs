//! A bob on an elastic thread that bounces and swings.
//!
//!     r̈ = r θ̇² + g cos θ − (k/m)(r − l),        r θ̈ = −2 ṙ θ̇ − g sin θ
//!
//! Bouncing modulates the length of the pendulum. If it is twice as fast as the swinging, √(k/m) = 2
//! √(g/r₀), a bob that only bounces gives its energy to the swing and takes it back (Vitt and Gorelik
//! 1933). Otherwise it goes on bouncing.

mod common;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

/// A bob on an elastic thread bounces and swings. The spring is tuned so that the bounce is twice as fast as
/// the swing: watch the bounce turn into a swing and back. Change the stiffness, and it goes on bouncing.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(r: m, theta: rad)]
#[units(mass: kg, stiffness: N / m, length: m, g: m / s^2)]
struct SpringPendulum {
    mass: f64,
    stiffness: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl SpringPendulum {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        q.r * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * (q.r - self.length).powi(2)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let bob = self.bob(q);
        Drawing::new().pivot([0.0, 0.0]).trace("bob", bob).spring([0.0, 0.0], bob).disc(bob, 0.06)
    }
}

/// Bounces about equilibrium, almost straight down, with a spring of `ratio` times m g / l.
fn bounce(ratio: f64) -> SpringPendulum {
    let (mass, length, g) = (1.0, 1.0, 9.81);
    SpringPendulum { mass, stiffness: ratio * mass * g / length, length, g }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let model = bounce(3.0);
    let rest = model.length + model.mass * model.g / model.stiffness;
    let start = |r: f64, theta: f64| model.state().r(r).theta(theta).build();
    Ok(model
        .live(start(rest + 0.2, 0.01)?)
        .title("Spring pendulum")
        .first_start("bouncing, almost straight down")
        .start("swinging", start(rest, 0.5)?)
        .start("large", start(rest + 0.3, 2.0)?)
        .range("mass", 0.2, 5.0)
        .range("stiffness", 5.0, 200.0)
        .range("length", 0.3, 2.0)
        .range("g", 0.0, 25.0)
        .method(methods::Dop853)
        .tolerance(1e-10)
        .plot(["r", "theta"])
        .phase("theta")
        .finish()?)
}

fn main() -> common::Outcome {
    // k/m = 4 g/r₀ with r₀ = l + m g/k gives k = 3 m g/l.
    let models = [("at resonance, k = 3 m g/l", bounce(3.0)), ("off resonance, k = 8 m g/l", bounce(8.0))];
    let mut files = common::Files::of("spring_pendulum");
    let mut chart = Chart::new("A bob that only bounces, and its swing");
    let mut swings = Vec::new();
    for (name, model) in &models {
        let equilibrium = model.length + model.mass * model.g / model.stiffness;
        let start = model.state().r(equilibrium + 0.2).theta(0.01).build()?;
        let motion = model.simulate(start).until(60.0).tolerance(1e-11).run()?;
        let swing = motion.steps().map(|s| s.theta().abs()).fold(0.0, f64::max);
        println!("{name}: the swing grows from 0.01 rad to {swing:.3} rad");
        assert!(motion.summary().energy_drift < 1e-9);
        swings.push(swing);

        let samples: Vec<_> = motion.sample(common::times(60.0, 3000)).collect();
        chart = chart.panel(
            Panel::new(Axis::new("time in s"), Axis::new("rad, m"))
                .line(format!("θ {name}"), samples.iter().map(|s| (s.t, s.theta())))
                .line("r − r₀", samples.iter().map(|s| (s.t, s.r() - equilibrium))),
        );
        if *name == models[0].0 {
            Animation::new()
                .add(&motion, "")
                .plot(["r", "theta"])
                .write_html(files.path("resonance.html"))?;
        }
    }
    assert!(swings[0] > 0.25, "resonance moves the energy of the bounce into the swing");
    assert!(swings[1] < 0.02, "off resonance the bob only bounces");

    chart.write_svg(files.path("swing.svg"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
