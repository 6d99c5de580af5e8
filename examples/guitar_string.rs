//! A string between two pegs, in full: L = Σ ½ mᵢ (ṡᵢ² + ẇᵢ²) − Σ h (T ε + ½ EA ε²), ε the stretch.
//!
//! Small swings have the tones ω_k = 2 √(T/(m h)) sin(k π/2N), nearly whole multiples of the first. A large
//! swing lengthens the string, its tension grows, and the tone is higher: ω = ω₁ (1 + 3/32 EA/T (π a/l)²)
//! for a sine of height a (Kirchhoff's string as Duffing's oscillator).
//!
//! Source: Kirchhoff, Vorlesungen über Mechanik (1876), §29; Rayleigh, Theory of Sound, §128 and §136.

mod common;

use core::f64::consts::PI;

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// Nodes move along the string, s, and across it, w.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.nodes], w: [m; self.nodes])]
#[units(pitch: m, ea: N, tension: N, mass: kg, damping: N * s / m)]
struct GuitarString {
    nodes: usize,
    pitch: f64,
    ea: f64,
    tension: f64,
    mass: Vec<f64>,
    damping: f64,
}

#[dynamics]
impl GuitarString {
    /// Nodes 0 and nodes + 1 are the pegs.
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let x = self.pitch * i as f64;
        if i == 0 || i == self.nodes + 1 { vec2(x, 0.0) } else { vec2(x + q.s[i - 1], q.w[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.mass[i] * (q.s[i].dt().powi(2) + q.w[i].dt().powi(2))).sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..=self.nodes {
            let stretch = (self.place(q, e + 1) - self.place(q, e)).norm() / self.pitch - 1.0;
            sum += self.pitch * (self.tension * stretch + 0.5 * self.ea * stretch.powi(2));
        }
        sum
    }
    #[dissipation]
    fn air(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.damping * q.w[i].dt().powi(2)).sum()
    }
    #[output]
    fn mean_height(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| q.w[i] / (self.nodes as f64 + 1.0)).sum()
    }
    /// The string for drawings, heights twenty times as large.
    fn drawn(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(self.place(q, i).x, 20.0 * self.place(q, i).y)
    }
    #[output]
    fn drawing(&self, q: &Coordinates<Self>) -> Vec<Vec2> {
        (0..self.nodes + 2).map(|i| self.drawn(q, i)).collect()
    }
}

fn main() -> common::Outcome {
    let (elements, length, tension, rho) = (64, 0.65, 70.0, 3.9e-4);
    let (nodes, pitch) = (elements - 1, length / elements as f64);
    let mass = vec![rho * pitch; nodes];
    let string = GuitarString { nodes, pitch, ea: 9.8e3, tension, mass, damping: 0.0 };
    let along = |i: usize| i as f64 * PI / elements as f64;
    let tones = string.modes(&string.state().build()?, 4)?;
    for (k, tone) in (1..).zip(&tones) {
        let exact = 2.0 * (tension / rho).sqrt() / pitch * (0.5 * along(k)).sin();
        println!("tone {k}: {:.2} Hz", tone.frequency() / (2.0 * PI));
        assert!((tone.frequency() / exact - 1.0).abs() < 1e-9);
    }

    // The pitch of large swings, by the times at which the string passes its line.
    let kirchhoff = |height: f64| 3.0 / 32.0 * string.ea / tension * (PI * height / length).powi(2);
    let mut pitches = Vec::new();
    for height in [1e-3, 2e-3, 3e-3, 4e-3] {
        let stretched = move |i: usize| -height * height * PI / (8.0 * length) * (2.0 * along(i)).sin();
        let sine = (1..elements).map(|i| height * along(i).sin());
        let start = string.state().w(sine).s((1..elements).map(stretched)).build()?;
        let motion = string.simulate(start).until(0.0155).tolerance(1e-8).record(Every::time(2e-5)).run()?;
        let height_at = |t: f64| motion.output("mean_height", t);
        let mut passed = Vec::new();
        for (before, after) in motion.frames().zip(motion.frames().skip(1)) {
            let (a, b) = (height_at(before.t)?, height_at(after.t)?);
            if a * b <= 0.0 {
                passed.push(before.t - a * (after.t - before.t) / (b - a));
            }
        }
        let omega = PI * (passed.len() - 1) as f64 / (passed[passed.len() - 1] - passed[0]);
        let rise = omega / tones[0].frequency() - 1.0;
        println!("{} mm: {rise:.6} higher, by Kirchhoff {:.6}", 1e3 * height, kirchhoff(height));
        assert!((rise / kirchhoff(height) - 1.0).abs() < 0.05);
        pitches.push((1e3 * height, 1e3 * rise));
    }

    // Plucked at a fifth of its length: the fifth tone is silent.
    let plucked = GuitarString { damping: 1.5e-4, ..string.clone() };
    let corner = |part: f64| 3e-3 * (part / 0.2).min((1.0 - part) / 0.8);
    let start = plucked.state().w((1..elements).map(|i| corner(i as f64 / elements as f64))).build()?;
    let motion = plucked.simulate(start).until(0.012).tolerance(1e-7).run()?;
    let loudness = |k: usize| {
        let part = |w: &[f64]| (1..elements).map(|i| w[i - 1] * (k as f64 * along(i)).sin()).sum::<f64>();
        motion.frames().filter_map(|frame| Some(part(frame.state?.w()).abs())).fold(0.0, f64::max)
    };
    assert!(loudness(5) < 0.02 * loudness(4) && loudness(5) < 0.02 * loudness(6));
    println!("\n{}", motion.summary());

    let mut files = common::Files::of("guitar_string");
    let parabola = (0..=40).map(|k| (0.1 * f64::from(k), 1e3 * kirchhoff(1e-4 * f64::from(k))));
    let panel = Panel::new(Axis::new("height of the swing in mm"), Axis::new("pitch raised by, in 1/1000"));
    Chart::from(panel.points("simulated", pitches).line("Kirchhoff", parabola))
        .write_svg(files.path("pitch.svg"))?;
    motion.space_time("w")?.write_svg(files.path("space_time.svg"))?;
    motion.animate(files.path("string.html"))?;
    files.list();
    Ok(())
}
