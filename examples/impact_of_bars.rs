//! Longitudinal impact of two bars: ρA s'' = EA s', and a contact between their ends.
//!
//! A bar of length l hits an equal one at rest with the speed v. Waves run from the contact into both bars,
//! with the force ½ v √(EA ρA). They return from the free ends as tension, and at 2 l/c the bars part: the
//! first one stands still, the second one has the speed v. A shorter bar that hits a longer one stops as
//! well; the longer one carries a wave, and flies on with v l₁/l₂ in the mean.
//!
//! Source: Saint-Venant (1867); Goldsmith, Impact (1960), chapter 2; Schmerr, Engineering Dynamics 2.0
//! (2019), chapter 9.

mod common;

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// Two bars on one line, in finite elements with the averaged mass.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: [m; self.first + 1], b: [m; self.second + 1])]
#[units(h: m, ea: N, rho: kg / m, gap: m, contact: N / m, drawn: s)]
struct Bars {
    /// Elements of the bar that comes, and of the one that is hit.
    first: usize,
    second: usize,
    /// Length of an element.
    h: f64,
    ea: f64,
    rho: f64,
    gap: f64,
    /// Stiffness of the contact.
    contact: f64,
    /// A velocity times this is its height in the drawing.
    drawn: f64,
}

#[dynamics]
impl Bars {
    /// Of an element whose ends move with u and v; the averaged mass.
    fn inertia(&self, u: Expr, v: Expr) -> Expr {
        self.rho * self.h / 24.0 * (5.0 * u * u + 2.0 * u * v + 5.0 * v * v)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let first = (0..self.first).map(|e| self.inertia(q.a[e].dt(), q.a[e + 1].dt())).sum::<Expr>();
        first + (0..self.second).map(|e| self.inertia(q.b[e].dt(), q.b[e + 1].dt())).sum::<Expr>()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        let first = (0..self.first).map(|e| (q.a[e + 1] - q.a[e]).powi(2)).sum::<Expr>();
        let second = (0..self.second).map(|e| (q.b[e + 1] - q.b[e]).powi(2)).sum::<Expr>();
        0.5 * self.ea / self.h * (first + second)
    }
    /// How deep the ends press into each other; 0 where they are apart.
    fn depth(&self, q: &Coordinates<Self>) -> Expr {
        (q.a[self.first] - q.b[0] - self.gap).max(0.0)
    }
    #[potential]
    fn pressed(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.contact * self.depth(q).powi(2)
    }
    #[output]
    fn force(&self, q: &Coordinates<Self>) -> Expr {
        self.contact * self.depth(q)
    }
    #[output]
    fn momentum_of_first(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.first).map(|e| 0.5 * self.rho * self.h * (q.a[e] + q.a[e + 1]).dt()).sum()
    }
    /// Nodes for drawings, with their velocities upwards: a wave is a step.
    fn first_bar(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(self.h * (i as f64 - self.first as f64) + q.a[i], self.drawn * q.a[i].dt())
    }
    fn second_bar(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(self.h * i as f64 + self.gap + q.b[i], self.drawn * q.b[i].dt())
    }
    #[output]
    fn first_drawn(&self, q: &Coordinates<Self>) -> Vec<Vec2> {
        (0..=self.first).map(|i| self.first_bar(q, i)).collect()
    }
    #[output]
    fn second_drawn(&self, q: &Coordinates<Self>) -> Vec<Vec2> {
        (0..=self.second).map(|i| self.second_bar(q, i)).collect()
    }
}

fn main() -> common::Outcome {
    let (h, ea, rho, speed) = (0.005, 2.5e6, 0.1, 5000.0);
    let mut files = common::Files::of("impact_of_bars");
    let mut forces = Panel::new(Axis::new("time in ms"), Axis::new("force in the contact in N"));
    let mut momenta = Panel::new(Axis::new("time in ms"), Axis::new("momentum of the first"));
    for (first, second) in [(200, 200), (100, 200)] {
        let model = Bars { first, second, h, ea, rho, gap: 5e-5, contact: 0.2 * ea / h, drawn: 0.2 };
        let start = model.state().a_rate(vec![1.0; first + 1]).build()?;
        let motion = model.simulate(start).until(7e-4).tolerance(1e-8).record(Every::time(1e-6)).run()?;
        let mut curves = [const { Vec::new() }; 2];
        for frame in motion.frames() {
            for (curve, name) in curves.iter_mut().zip(["force", "momentum_of_first"]) {
                curve.push((1e3 * frame.t, motion.output(name, frame.t)?));
            }
        }
        let [force, mut own] = curves;
        let total = own[0].1;
        own.iter_mut().for_each(|(_, momentum)| *momentum /= total);
        // The time for which the force is above half of v Z/2.
        let touching: Vec<_> = force.iter().filter(|(_, force)| *force > 0.25 * ea / speed).collect();
        let (contact, expected) = (1e-3 * touching.len() as f64, 2e3 * first as f64 * h / speed);
        let middle = &touching[touching.len() / 4..3 * touching.len() / 4];
        let mean = middle.iter().map(|(_, force)| force).sum::<f64>() / middle.len() as f64;
        let left = own[own.len() - 1].1;
        println!("{first} and {second} elements: in contact for {contact:.3} ms, 2 l/c = {expected:.3} ms");
        println!("  force {mean:.1} N, v Z/2 = {:.1} N; {left:.4} of the momentum stays", 0.5 * ea / speed);
        assert!((contact / expected - 1.0).abs() < 0.02 && (mean / (0.5 * ea / speed) - 1.0).abs() < 0.02);
        assert!(left.abs() < 0.02);
        println!("{}", motion.summary());
        let name = format!("{} m on {} m", first as f64 * h, second as f64 * h);
        forces = forces.line(name.clone(), force);
        momenta = momenta.line(name, own);
        motion.animate(files.path(&format!("impact_{first}_{second}.html")))?;
    }
    Chart::new("Bars part when the waves are back from their free ends")
        .panel(forces)
        .panel(momenta)
        .write_svg(files.path("impact.svg"))?;
    files.list();
    Ok(())
}
