//! A bead on a wavy wire, smooth and rough. The friction depends on the reaction of the same instant.
//!
//!     L = ½ m (ẋ² + ẏ²) − m g y,        Φ = y − a cos k x = 0
//!     F = −μ |λ| ‖∇Φ‖ v/|v|
//!
//! λ and q̈ are solved for together. The program checks three facts. On the smooth wire the reaction is m
//! (g cos α + κ v²) at slope angle α and curvature κ. Without gravity the rough wire slows the bead by
//! e^{−μ·(angle turned)}, at any speed and for any shape. With gravity the bead comes to rest where the
//! slope is less than μ.

mod common;
use dynamics::error::StateError;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;
use dynamics::simulate::Flow;

/// A bead slides along a wavy wire; the arrow is the push of the wire. On the smooth wire energy is
/// conserved, and the push is m (g cos α + κ v²): largest in the trough, least near the crests. Raise k:
/// the push grows with the curvature κ.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[inputs(direction)]
#[units(mass: kg, g: m / s^2, a: m, k: 1 / m)]
struct Bead {
    mass: f64,
    g: f64,
    /// The wave: half its height, and its wave number.
    a: f64,
    k: f64,
    mu: f64,
}

#[dynamics]
impl Bead {
    fn bead(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    fn slope(&self, q: &Coordinates<Self>) -> Expr {
        -self.a * self.k * (self.k * q.x).sin()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bead(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn wire(&self, q: &Coordinates<Self>) -> Expr {
        q.y - self.a * (self.k * q.x).cos()
    }
    /// ‖∇Φ‖ times the unit tangent is (1, slope). The direction of sliding is held between its reversals.
    #[force]
    fn friction(&self, q: &Coordinates<Self>) -> Force {
        let size = self.mu * q.reaction(Self::wire).abs();
        Force::at(self.bead(q), -size * q.direction * vec2(1.0, self.slope(q)))
    }
    /// The wire's push on the bead, upward where positive.
    #[output]
    fn push(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::wire) * (1.0 + self.slope(q).powi(2)).sqrt()
    }
    #[event]
    fn turning_point(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let bead = self.bead(q);
        let push = q.reaction(Self::wire) / (2.5 * self.mass * self.g) * vec2(-self.slope(q), 1.0);
        Drawing::new()
            .color(Color::Faint)
            .curve(-0.7, 2.7, 400, |x| [x, self.a * (self.k * x).cos()])
            .plain()
            .disc(bead, 0.05)
            .color(Color::Red)
            .arrow(bead, bead + push)
    }
}

impl Bead {
    /// Slope angle of the wire.
    fn angle(&self, x: f64) -> f64 {
        (-self.a * self.k * (self.k * x).sin()).atan()
    }
    /// Curvature, positive where the wire bends upward.
    fn curvature(&self, x: f64) -> f64 {
        -self.a * self.k * self.k * (self.k * x).cos() * self.angle(x).cos().powi(3)
    }
    /// Angle through which the wire turns between two places.
    fn turned(&self, from: f64, to: f64) -> f64 {
        // It turns monotonically between crests and troughs' flanks, where sin k x = ±1.
        let quarter = std::f64::consts::FRAC_PI_2 / self.k;
        let flanks = (-99..100)
            .filter(|i| i % 2 != 0)
            .map(|i| f64::from(i) * quarter)
            .filter(|x| (from..to).contains(x));
        let places: Vec<f64> = std::iter::once(from).chain(flanks).chain([to]).collect();
        places.windows(2).map(|p| (self.angle(p[1]) - self.angle(p[0])).abs()).sum()
    }
    fn start(&self, x: f64, speed: f64) -> Result<State<Self>, StateError> {
        let angle = self.angle(x);
        let (rate, climb) = (speed * angle.cos(), speed * angle.sin());
        let direction = if rate < 0.0 { -1.0 } else { 1.0 };
        self.state()
            .x(x)
            .y(self.a * (self.k * x).cos())
            .x_rate(rate)
            .y_rate(climb)
            .direction(direction)
            .build()
    }
}

fn speed(state: &State<Bead>) -> f64 {
    state.x_rate().hypot(state.y_rate())
}

/// The live page of the smooth wire. The closure that turns the friction round is no part of a page.
pub(crate) fn live() -> common::Page {
    let smooth = Bead { mass: 0.1, g: 9.81, a: 0.5, k: 2.0, mu: 0.0 };
    let trough = std::f64::consts::FRAC_PI_2;
    Ok(smooth
        .live(smooth.start(0.3, 0.0)?)
        .title("Bead on a smooth wire")
        .first_start("let go near the crest")
        .start("small swing", smooth.start(trough - 0.3, 0.0)?)
        .start("nearly over the crest", smooth.start(trough, 4.4)?)
        .range("g", 1.0, 25.0)
        .range("a", 0.1, 0.6)
        .range("k", 1.0, 4.0)
        .hold(["mass", "mu", "direction"])
        .tolerance(1e-9)
        .plot(["push", "x"])
        .finish()?)
}

fn main() -> common::Outcome {
    let smooth = Bead { mass: 0.1, g: 9.81, a: 0.5, k: 2.0, mu: 0.0 };

    // Over the crests of the smooth wire: what the wire pushes with follows from speed and curvature.
    let run = smooth.simulate(smooth.start(-3.0, 4.0)?).until(1.5).tolerance(1e-10).run()?;
    println!("{}\n", run.summary());
    assert!(run.verify().energy_drift < 1e-9);
    let mut worst = 0.0_f64;
    for state in run.sample(common::times(1.5, 600)) {
        let (angle, curvature) = (smooth.angle(state.x()), smooth.curvature(state.x()));
        let law = smooth.mass * (smooth.g * angle.cos() + curvature * speed(&state).powi(2));
        worst = worst.max((run.outputs_of(&state)[0] - law).abs());
    }
    println!("smooth: the wire pushes with m (g cos α + κ v²), to {worst:.0e} N");
    assert!(worst < 1e-7);

    // In free fall the rough wire takes a share of the speed that depends on the angle turned alone.
    let weightless = Bead { g: 0.0, mu: 0.2, ..smooth.clone() };
    let run = weightless.simulate(weightless.start(-3.0, 4.0)?).until(3.0).tolerance(1e-11).run()?;
    let mut worst = 0.0_f64;
    for state in run.sample(common::times(3.0, 300)) {
        let law = 4.0 * (-weightless.mu * weightless.turned(-3.0, state.x())).exp();
        worst = worst.max((speed(&state) / law - 1.0).abs());
    }
    let end = run.end();
    let turned = weightless.turned(-3.0, end.x()).to_degrees();
    println!(
        "rough, without gravity: {:.3} m/s after {turned:.0}° of turns, e^(−μ·angle) to {worst:.0e}",
        speed(&end)
    );
    assert!(worst < 1e-8);

    // With gravity it swings in a trough until it stops on a slope that friction can hold.
    let rough = Bead { mu: 0.2, ..smooth.clone() };
    let model = rough.clone();
    let settle = rough
        .simulate(rough.start(0.4, 0.0)?)
        .until(30.0)
        .tolerance(1e-10)
        .on_event("turning_point", Direction::Any, move |state: &mut State<Bead>| {
            // At rest it slides on, downhill, only where the slope is steeper than friction can hold.
            let slope = model.angle(state.x()).tan();
            state.set_direction(-slope.signum());
            if slope.abs() <= model.mu { Flow::Stop } else { Flow::Continue }
        })
        .run()?;
    println!("\n{}", settle.summary());
    let rest = settle.end();
    let slope = rough.angle(rest.x()).tan();
    println!("it stops at x = {:.4} m, on a slope of {slope:.4} (μ = {})", rest.x(), rough.mu);
    assert!(slope.abs() <= rough.mu && speed(&rest) < 1e-9);
    // What friction took is what the energy lost.
    assert!(settle.verify().energy_drift < 1e-7);

    let mut files = common::Files::of("bead_on_wire");
    let end_time = settle.end_time();
    let sample = || settle.sample(common::times(end_time, 1500));
    Chart::new("A bead on a rough wire")
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("x in m"))
                .line("bead", sample().map(|s| (s.t, s.x()))),
        )
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("push of the wire in weights"))
                .line("push", sample().map(|s| (s.t, settle.outputs_of(&s)[0] / (rough.mass * rough.g)))),
        )
        .write_svg(files.path("bead.svg"))?;
    settle.animation().title("A bead on a rough wire").speed(0.5).write_html(files.path("bead.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
