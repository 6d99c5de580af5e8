//! A block on a running belt, held by a spring. It rides along until the spring tears it off, and slips back.
//!
//!     m ẍ + k x = friction
//!     sticks: ẋ = v while |λ| ≤ μₛ m g        slips: friction = −μₖ m g · sign of (ẋ − v)
//!
//! This is how a violin string sounds and a brake squeals. The grip of the belt is a switched constraint on
//! the velocity, and its multiplier is the static friction. At the limit it lets go, until the slip is zero
//! again.

mod common;
use std::f64::consts::TAU;

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A block on a running belt, held by a spring: it rides along until the spring tears it off, and slips back.
/// This is how a violin string sounds and a brake squeals. Run the belt faster, or make both frictions equal,
/// and it stops squealing.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, stiffness: N / m, g: m / s^2, belt: m / s)]
struct Block {
    mass: f64,
    stiffness: f64,
    g: f64,
    /// Speed of the belt.
    belt: f64,
    /// Friction at rest and in motion.
    static_mu: f64,
    kinetic_mu: f64,
}

#[dynamics]
impl Block {
    fn weight(&self) -> f64 {
        self.mass * self.g
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.x.powi(2)
    }
    /// It can be integrated, to x − v t, and that is meant: the block sticks wherever it is.
    #[nonholonomic(switched, integrable)]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() - self.belt
    }
    #[force]
    fn sliding(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.kinetic_mu * self.weight() * q.slip(Self::grip))
    }
    #[event]
    fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
        self.static_mu * self.weight() - q.reaction(Self::grip).abs()
    }
    /// Force of the belt on the block.
    #[output]
    fn friction(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::grip) - self.kinetic_mu * self.weight() * q.slip(Self::grip)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (block, foot) = (vec2(q.x, 0.05), vec2(q.x, 0.012));
        let mut drawing = Drawing::new()
            .color(Color::Faint)
            .line([-0.3, 0.0], [0.5, 0.0])
            .line([-0.3, -0.08], [0.5, -0.08])
            .arc([-0.3, -0.04], 0.04, 0.25 * TAU, 0.75 * TAU)
            .arc([0.5, -0.04], 0.04, -0.25 * TAU, 0.25 * TAU);
        // Cleats, so that the belt is seen to run.
        let run = (self.belt * q.t).value().rem_euclid(0.1);
        for k in 0..8 {
            let x = 0.1 * f64::from(k) + run - 0.3;
            drawing = drawing.line([x, 0.0], [x, -0.02]);
        }
        drawing
            .plain()
            .line([-0.3, 0.02], [-0.3, 0.12])
            .spring([-0.3, 0.05], block - vec2(0.05, 0.0))
            .fill(Color::Blue)
            .rectangle(block, 0.1, 0.1, 0.0)
            .color(Color::Red)
            .width(3.0)
            .arrow(foot, foot + 0.3 / self.weight() * vec2(self.friction(q), 0.0))
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let block = Block { mass: 2.0, stiffness: 50.0, g: 9.81, belt: 0.1, static_mu: 0.6, kinetic_mu: 0.35 };
    Ok(block
        .live(block.state().x_rate(block.belt).build()?)
        .title("Stick and slip")
        .range("belt", 0.02, 1.0)
        .range("static_mu", 0.1, 1.0)
        .range("kinetic_mu", 0.1, 1.0)
        .range("stiffness", 10.0, 500.0)
        .range("mass", 0.5, 10.0)
        .hold(["g"])
        .stick_slip("grip", "breakaway")
        .plot(["x", "x_rate", "friction"])
        .finish()?)
}

fn main() -> common::Outcome {
    let block = Block { mass: 2.0, stiffness: 50.0, g: 9.81, belt: 0.1, static_mu: 0.6, kinetic_mu: 0.35 };
    let motion = block
        .simulate(block.state().x_rate(block.belt).build()?)
        .until(20.0)
        .tolerance(1e-10)
        .stick_slip("grip", "breakaway")
        .run()?;
    println!("{}\n{}\n", motion.summary(), motion.work());
    assert!(motion.verify().energy_drift < 1e-8);

    // While it slips it swings about μₖ m g/k at ω, from where it was torn off to the mirror image of that
    // place, where its speed is the belt's again; while it sticks it rides back.
    let omega = (block.stiffness / block.mass).sqrt();
    let (torn, centre) = (
        block.static_mu * block.weight() / block.stiffness,
        block.kinetic_mu * block.weight() / block.stiffness,
    );
    let caught = 2.0 * centre - torn;
    let slips = (TAU - 2.0 * ((torn - centre) * omega / block.belt).atan()) / omega;
    let sticks = (torn - caught) / block.belt;
    let reach = (torn - centre).hypot(block.belt / omega);

    let switches: Vec<_> = motion.events().iter().filter(|event| event.name == "grip slip").collect();
    assert_eq!(switches.len(), 14);
    for (k, event) in switches.iter().enumerate() {
        let lets_go = k % 2 == 0;
        let place = if lets_go { torn } else { caught };
        assert!((event.before.x() - place).abs() < 1e-8 && (event.before.x_rate() - block.belt).abs() < 1e-8);
        assert_eq!(event.after.is_engaged("grip")?, !lets_go);
    }
    // From the first time that it is torn off, all cycles are alike.
    for pair in switches.windows(2) {
        let lasts = pair[1].time() - pair[0].time();
        let law = if pair[0].after.is_engaged("grip")? { sticks } else { slips };
        assert!((lasts - law).abs() < 1e-7, "{lasts} {law}");
    }
    let period = switches[2].time() - switches[0].time();
    println!("period {period:.9} s; sticks {sticks:.6} s and slips {slips:.6} s in closed form");
    let cycle = |part: f64| motion.at(switches[0].time() + part * period);
    let places = common::times(1.0, 20_000).map(|part| cycle(part).x());
    let (least, most) = places.fold((f64::MAX, f64::MIN), |(least, most), x| (least.min(x), most.max(x)));
    println!(
        "between {least:.7} and {most:.7} m; μₖ m g/k ∓ √((x₁ − μₖ m g/k)² + (v/ω)²): {:.7}, {:.7}",
        centre - reach,
        centre + reach
    );
    assert!((centre - reach - least).abs() < 1e-7 && (centre + reach - most).abs() < 1e-7);

    let mut files = common::Files::of("stick_slip");
    let instants: Vec<_> = motion.sample(common::times(8.0, 4000)).collect();
    let panel = |title| Panel::new(Axis::new("time in s"), Axis::new(title));
    let over_time =
        |value: &dyn Fn(&State<Block>) -> f64| instants.iter().map(|s| (s.t, value(s))).collect::<Vec<_>>();
    Chart::new("A block on a belt")
        .panel(panel("x in m").line("block", over_time(&|s| s.x())))
        .panel(
            panel("velocity in m/s")
                .line("block", over_time(&|s| s.x_rate()))
                .line("belt", [(0.0, block.belt), (8.0, block.belt)]),
        )
        .panel(
            panel("friction / weight")
                .line("belt on block", over_time(&|s| motion.outputs_of(s)[0] / block.weight())),
        )
        .panel(
            Panel::new(Axis::new("x in m"), Axis::new("velocity in m/s"))
                .line("cycle", instants.iter().map(|s| (s.x(), s.x_rate()))),
        )
        .write_svg(files.path("stick_slip.svg"))?;
    let film = motion.animation().title("A block on a belt").plot(["x", "x_rate"]);
    film.speed(0.5).write_html(files.path("stick_slip.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
