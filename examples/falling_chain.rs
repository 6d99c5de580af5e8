//! A chain falls: beads on rods that do not stretch, |rᵢ₊₁ − rᵢ| = l.
//!
//! A chain hangs between two pins close together, in the shape of the discrete catenary. One end is let go.
//! Its tip falls faster than a stone: the rods that come to rest at the bend hand their energy on. An ideal
//! folded chain needs 0.847213 of the time of free fall, and its tip would be infinitely fast at the end.
//!
//! Source: Calkin, March, Am. J. Phys. 57 (1989) 154; Tomaszewski, Pieranski, Geminard, Am. J. Phys. 74
//! (2006)
//! 776.

mod common;

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A chain with one end at the origin; the other is free.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.beads], y: [m; self.beads])]
#[units(pitch: m, mass: kg, g: m / s^2)]
struct Chain {
    beads: usize,
    pitch: f64,
    mass: f64,
    g: f64,
}

#[dynamics]
impl Chain {
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(0.0, 0.0) } else { vec2(q.x[i - 1], q.y[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (1..=self.beads).map(|i| 0.5 * self.mass * self.bead(q, i).dt().norm_squared()).sum()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads).map(|i| self.mass * self.g * q.y[i]).sum()
    }
    /// A row for every rod; its multiplier is minus the tension.
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        (0..self.beads).map(|i| (self.bead(q, i + 1) - self.bead(q, i)).norm() - self.pitch).collect()
    }
    /// What the pin carries.
    #[output]
    fn support(&self, q: &Coordinates<Self>) -> Expr {
        -q.reaction(Self::rod)[0]
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        q.reaction(Self::rod).iter().map(|&reaction| -reaction).collect()
    }
}

/// The shape of a hanging chain: every rod pulls with the same horizontal force H, and a bead's weight more
/// than the one before. The slopes follow from H, which is the one with the right span.
fn catenary(chain: &Chain, span: f64) -> (Vec<f64>, Vec<f64>) {
    let n = chain.beads as f64;
    let places = |h: f64| {
        let (mut x, mut y) = (0.0, 0.0);
        let rods = (0..chain.beads).map(|i| {
            // The vertical force: as much of it on either side of the middle.
            let v = chain.mass * chain.g * (i as f64 - 0.5 * (n - 1.0));
            (x, y) = (x + chain.pitch * h / h.hypot(v), y + chain.pitch * v / h.hypot(v));
            (x, y)
        });
        rods.unzip::<f64, f64, Vec<_>, Vec<_>>()
    };
    let (mut low, mut high) = (1e-9, 1e3);
    for _ in 0..200 {
        let middle = f64::midpoint(low, high);
        if places(middle).0[chain.beads - 1] < span { low = middle } else { high = middle }
    }
    places(low)
}

fn main() -> common::Outcome {
    let beads = 60;
    let chain = Chain { beads, pitch: 1.0 / beads as f64, mass: 1.0 / beads as f64, g: 9.81 };
    println!("{}\n{}", Chain::EQUATIONS, Chain::REPORT);
    let (x, y) = catenary(&chain, 0.1);
    let start = chain.state().x(x).y(y).assemble()?;
    let free_fall = (2.0 / chain.g).sqrt();
    let run = chain.simulate(start).until(free_fall).tolerance(1e-10).record(Every::Frames(901));
    let motion = run.run()?;
    println!("{}", motion.summary());

    let tip = |state: &ChainState| -state.y()[beads - 1];
    let falls = motion.frames().filter_map(|frame| frame.state.map(|state| (frame.t, tip(state))));
    let falls: Vec<(f64, f64)> = falls.collect();
    let deepest = falls.iter().copied().fold((0.0, 0.0), |most, at| if at.1 > most.1 { at } else { most });
    let part = deepest.0 / (2.0 * deepest.1 / chain.g).sqrt();
    println!("the tip is {:.3} m below after {part:.4} of the time of free fall", deepest.1);
    // Faster than a stone, and slower than an ideal chain, which has no width.
    assert!(deepest.1 > 0.97 && part > 0.847_213 && part < 0.9);
    assert!(motion.summary().energy_drift.is_some_and(|drift| drift < 1e-7));
    let pull = motion.frames().map(|frame| (frame.t, frame.outputs[0] / chain.g)).collect::<Vec<_>>();
    let strongest = pull.iter().fold(0.0f64, |most, (_, pull)| most.max(*pull));
    println!("the pin carries {strongest:.1} times the weight of the chain");
    // At rest it carried half of the weight; it is strongest when the tip whips round.
    assert!((pull[0].1 - 0.5).abs() < 0.02 && strongest > 5.0);

    let mut files = common::Files::of("falling_chain");
    let stone = falls.iter().map(|(t, _)| (*t, 0.5 * chain.g * t * t)).collect::<Vec<_>>();
    Chart::new("A chain that falls from one pin: its tip is faster than a stone")
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("way of the tip in m"))
                .line("chain", falls)
                .line("free fall", stone),
        )
        .panel(Panel::new(Axis::new("time in s"), Axis::new("pull at the pin in weights")).line("pull", pull))
        .write_svg(files.path("fall.svg"))?;
    motion.animate(files.path("fall.html"))?;
    files.list();
    Ok(())
}
