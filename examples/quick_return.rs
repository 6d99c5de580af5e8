//! Whitworth's quick-return mechanism of a shaping machine: slow forth under load, fast back.
//!
//!     crank pin = pivot + s (sin φ, cos φ)        arm's end + link = ram        crank − Ω t = 0
//!
//! The pin of the crank slides in the slot of an arm, which swings about a pivot below. The arm drives the
//! ram through a link. A cutting force acts on the ram on its way forth. Everything is solved from the
//! constraints. The multiplier of the drive is the torque of the motor.

mod common;
use std::f64::consts::{PI, TAU};

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// Whitworth's quick-return mechanism of a shaping machine: slow forth under the load of the cut, fast back.
/// The crank turns steadily: 240° for the way forth, 120° for the way back. Lengthen the crank's radius,
/// and the way back gets faster; then look at the torque of the motor.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad, arm: rad, slide: m, link: rad, ram: m)]
#[units(
    radius: m, depth: m, length: m, link_length: m, height: m, inertia: kg * m^2, block: kg, mass: kg, cut: N,
    edge: m / s, omega: rad / s
)]
#[nominal(
    radius = 0.1,
    depth = 0.2,
    length = 0.45,
    link_length = 0.2,
    height = 0.22,
    inertia = 0.05,
    block = 0.5,
    mass = 10.0,
    cut = 800.0,
    edge = 0.02,
    omega = 6.0
)]
struct QuickReturn {
    radius: f64,
    /// Of the arm's pivot below the crankshaft.
    depth: f64,
    /// Of the arm.
    length: f64,
    link_length: f64,
    /// Of the ram's way above the crankshaft.
    height: f64,
    inertia: f64,
    block: f64,
    mass: f64,
    cut: f64,
    /// Speed over which the cut sets in.
    edge: f64,
    omega: f64,
}

#[dynamics]
impl QuickReturn {
    fn pin(&self, q: &Coordinates<Self>) -> Vec2 {
        self.radius * vec2(q.crank.cos(), q.crank.sin())
    }
    fn along_arm(&self, q: &Coordinates<Self>, s: Expr) -> Vec2 {
        vec2(0.0, -self.depth) + s * vec2(q.arm.sin(), q.arm.cos())
    }
    fn arm_end(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(self.length * q.arm.sin(), self.length * q.arm.cos() - self.depth)
    }
    fn tool(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.ram, self.height)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.crank.dt().powi(2) + q.arm.dt().powi(2))
            + 0.5 * self.block * self.along_arm(q, q.slide).dt().norm_squared()
            + 0.05 * self.inertia * q.link.dt().powi(2)
            + 0.5 * self.mass * q.ram.dt().powi(2)
    }
    #[holonomic]
    fn slot(&self, q: &Coordinates<Self>) -> Vec2 {
        self.along_arm(q, q.slide) - self.pin(q)
    }
    #[holonomic]
    fn bearing(&self, q: &Coordinates<Self>) -> Vec2 {
        self.arm_end(q) + self.link_length * vec2(q.link.cos(), q.link.sin()) - self.tool(q)
    }
    #[holonomic]
    fn drive(&self, q: &Coordinates<Self>) -> Expr {
        q.crank - self.omega * q.t
    }
    /// The tool cuts while the ram moves to the left.
    #[force]
    fn cutting(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.ram, 0.5 * self.cut * (1.0 - (q.ram.dt() / self.edge).tanh()))
    }
    #[output]
    fn torque(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::drive)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let pivot = vec2(0.0, -self.depth);
        Drawing::new()
            .pivot(Vec2::ZERO)
            .pivot(pivot)
            .color(Color::Faint)
            .circle(Vec2::ZERO, self.radius)
            .line([-0.4, self.height - 0.02], [0.6, self.height - 0.02])
            .plain()
            .fill(Color::Blue)
            .rectangle(self.pin(q), 0.04, 0.025, 0.5 * PI - q.arm)
            .rectangle(self.tool(q), 0.2, 0.04, 0.0)
            .line(Vec2::ZERO, self.pin(q))
            .line(pivot, self.arm_end(q))
            .line(self.arm_end(q), self.tool(q))
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let model = QuickReturn {
        radius: 0.1,
        depth: 0.2,
        length: 0.45,
        link_length: 0.2,
        height: 0.22,
        inertia: 0.05,
        block: 0.5,
        mass: 10.0,
        cut: 800.0,
        edge: 0.02,
        omega: 3.0,
    };
    let start = model.state().arm_guess(0.4).slide_guess(0.2).ram_guess(0.4).assemble()?;
    Ok(model
        .live(start)
        .title("Quick return")
        .range("radius", 0.03, 0.14)
        .range("depth", 0.17, 0.3)
        .range("cut", 0.0, 2000.0)
        .range("mass", 1.0, 50.0)
        .range("omega", 0.5, 8.0)
        .hold(["length", "link_length", "height", "inertia", "block", "edge"])
        .plot(["ram", "ram_rate", "torque"])
        .phase("ram")
        .finish()?)
}

fn main() -> common::Outcome {
    let model = QuickReturn {
        radius: 0.1,
        depth: 0.2,
        length: 0.45,
        link_length: 0.2,
        height: 0.22,
        inertia: 0.05,
        block: 0.5,
        mass: 10.0,
        cut: 800.0,
        edge: 0.02,
        omega: 6.0,
    };
    let turn = TAU / model.omega;
    let start = model.state().arm_guess(0.4).slide_guess(0.2).ram_guess(0.4).assemble()?;
    let motion = model.kinematics(start).until(2.0 * turn).every(turn / 720.0).run()?;
    println!("{}\n{}\n", motion.summary(), motion.work());

    let mut worst = 0.0f64;
    for now in motion.states() {
        let (s, c) = now.crank().sin_cos();
        let (x, y) = (model.radius * c, model.radius * s + model.depth);
        let ram = {
            let (end_x, end_y) = (model.length * x / x.hypot(y), model.length * y / x.hypot(y) - model.depth);
            end_x + (model.link_length.powi(2) - (model.height - end_y).powi(2)).sqrt()
        };
        worst = worst.max((now.arm() - x.atan2(y)).abs()).max((now.slide() - x.hypot(y)).abs());
        worst = worst.max((now.ram() - ram).abs());
    }
    println!("against the closed form: {worst:.1e}");
    assert!(worst < 1e-14);
    // The arm turns round where the pin's circle touches it: sin ψ = radius/depth = ½, so 240° there, 120°
    // back.
    let states: Vec<State<QuickReturn>> = motion.sample(common::times(turn, 720)).collect();
    let forth = states.iter().filter(|now| now.arm_rate() < 0.0).count() as f64 / 721.0;
    println!(
        "the arm swings forth for {:.1}° of the turn, back for {:.1}°",
        360.0 * forth,
        360.0 * (1.0 - forth)
    );
    assert!((forth - 2.0 / 3.0).abs() < 2e-3);
    // The motor gives what the tool takes: the energy is what it was after a turn.
    let account = motion.work();
    assert!((account.energy_end - account.energy_start).abs() < 1e-10 * account.scale);
    assert!(account.closure_error.abs() < 1e-8 * account.scale);

    let mut files = common::Files::of("quick_return");
    let panel = |title| Panel::new(Axis::new("crank in degrees"), Axis::new(title));
    let curve = |value: &dyn Fn(&State<QuickReturn>) -> f64| -> Vec<(f64, f64)> {
        states.iter().map(|now| (now.crank() * 180.0 / PI, value(now))).collect()
    };
    Chart::new("A shaping machine")
        .panel(panel("ram in m").line("place", curve(&|s| s.ram())))
        .panel(panel("ram in m/s").line("velocity", curve(&|s| s.ram_rate())))
        .panel(panel("torque in N·m").line("motor", curve(&|s| motion.outputs_of(s)[0])))
        .write_svg(files.path("stroke.svg"))?;
    let film = motion.animation().title("A shaping machine").plot(["ram_rate"]);
    film.speed(0.5).write_html(files.path("quick_return.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
