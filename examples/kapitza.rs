//! A pendulum stands upright because its pivot is shaken up and down.
//!
//!     r = (0, a cos Ωt) + l (sin θ, cos θ),        L = ½ m |ṙ|² − m g y
//!     θ from the upright
//!
//! Averaged over the fast shaking, the upright is a minimum of the effective potential if a² Ω² > 2 g l
//! (Kapitza 1951). There it swings slowly at √(a² Ω² / 2 l² − g / l). Below the threshold it falls.

mod common;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

/// A pendulum stands upright on a pivot that is shaken up and down quickly. Push its bob aside: it swings
/// about the upright. Lower the amplitude or the frequency until a² Ω² < 2 g l, and it falls.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(mass: kg, length: m, amplitude: m, frequency: rad / s, g: m / s^2)]
struct Kapitza {
    mass: f64,
    length: f64,
    amplitude: f64,
    frequency: f64,
    g: f64,
}

#[dynamics]
impl Kapitza {
    fn pivot(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(0.0, self.amplitude * (self.frequency * q.t).cos())
    }
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        self.pivot(q) + self.length * vec2(q.theta.sin(), q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y
    }
    #[event]
    fn upright(&self, q: &Coordinates<Self>) -> Expr {
        q.theta
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (pivot, bob) = (self.pivot(q), self.bob(q));
        Drawing::new().tail("bob", bob, 1.0).pivot(pivot).line(pivot, bob).disc(bob, 0.015)
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let model = Kapitza { mass: 1.0, length: 0.2, amplitude: 0.02, frequency: 200.0, g: 9.81 };
    let start = |theta: f64| model.state().theta(theta).build();
    Ok(model
        .live(start(0.3)?)
        .title("Kapitza's pendulum")
        .first_start("near the upright")
        .start("far from it", start(1.2)?)
        .start("hanging", start(2.8)?)
        .range("length", 0.1, 0.4)
        .range("amplitude", 0.0, 0.04)
        .range("frequency", 50.0, 400.0)
        .range("g", 0.0, 25.0)
        .hold(["mass"])
        .method(methods::Dop853)
        .plot(["theta"])
        .finish()?)
}

fn main() -> common::Outcome {
    let (length, amplitude, g) = (0.3, 0.02, 9.81_f64);
    let threshold = (2.0 * g * length).sqrt() / amplitude;
    println!("threshold: {:.1} rad/s = {:.1} Hz", threshold, threshold / std::f64::consts::TAU);

    let fast = Kapitza { mass: 0.1, length, amplitude, frequency: 1.5 * threshold, g };
    let slow = Kapitza { frequency: 0.9 * threshold, ..fast.clone() };
    let start = fast.state().theta(0.1).build()?;
    let stands = fast.simulate(start).until(10.0).tolerance(1e-10).run()?;
    let falls = slow.simulate(start).until(10.0).tolerance(1e-10).run()?;
    let reach = |motion: &Motion<'_, Kapitza>| motion.steps().map(|s| s.theta().abs()).fold(0.0, f64::max);
    println!("at 1.5 times the threshold it leaves the upright by at most {:.2} rad", reach(&stands));
    println!("at 0.9 times the threshold it leaves it by {:.2} rad", reach(&falls));
    assert!(reach(&stands) < 0.11, "it stands");
    assert!(reach(&falls) > std::f64::consts::FRAC_PI_2, "it falls");

    // The slow swing about the upright, against the averaged equation, whose next terms are of order θ² and
    // (a/l)².
    let times: Vec<_> =
        stands.events().iter().filter(|e| e.direction == Direction::Rising).map(|e| e.time()).collect();
    let period = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    let effective = ((amplitude * fast.frequency / length).powi(2) / 2.0 - g / length).sqrt();
    println!(
        "slow swing: {:.3} rad/s, averaged equation {effective:.3} rad/s",
        std::f64::consts::TAU / period
    );
    assert!((std::f64::consts::TAU / period / effective - 1.0).abs() < 5e-3);

    let mut files = common::Files::of("kapitza");
    let history = |motion: &Motion<'_, Kapitza>, end: f64| -> Vec<(f64, f64)> {
        motion.sample(common::times(end, 4000)).map(|s| (s.t, s.theta())).collect()
    };
    let panel = || Panel::new(Axis::new("time in s"), Axis::new("θ from the upright in rad"));
    Chart::new("A pendulum with a shaken pivot")
        .panel(panel().line("1.5 times the threshold", history(&stands, 4.0)))
        .panel(panel().line("0.9 times the threshold", history(&falls, 4.0)))
        .write_svg(files.path("angle.svg"))?;
    Animation::new()
        .add(&stands, "stands")
        .add(&falls, "falls")
        .speed(0.25)
        .write_html(files.path("kapitza.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
