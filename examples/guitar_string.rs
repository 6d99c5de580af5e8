//! A string between two pegs, in full: L = Σ ½ mᵢ (ṡᵢ² + ẇᵢ²) − Σ h (T ε + ½ EA ε²), ε the stretch.
//!
//! Small swings have the tones ω_k = 2 √(T/(m h)) sin(k π/2N), nearly whole multiples of the first. A large
//! swing lengthens the string, its tension grows, and the tone is higher: ω = ω₁ (1 + 3/32 EA/T (π a/l)²)
//! for a sine of height a (Kirchhoff's string as Duffing's oscillator). A bead in the middle lowers the odd
//! tones; the even ones have a node there.
//!
//! Source: Kirchhoff, Vorlesungen über Mechanik (1876), §29; Fletcher, Rossing, The Physics of Musical
//! Instruments (1998), §2.14 and §5.5; Rayleigh, Theory of Sound, §136.

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
    /// Mass by node.
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
        let mut sum = Expr::ZERO;
        for i in 0..self.nodes {
            sum += 0.5 * self.mass[i] * (q.s[i].dt().powi(2) + q.w[i].dt().powi(2));
        }
        sum
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
        let place = self.place(q, i);
        vec2(place.x, 20.0 * place.y)
    }
    #[output]
    fn drawing(&self, q: &Coordinates<Self>) -> Vec<Vec2> {
        (0..self.nodes + 2).map(|i| self.drawn(q, i)).collect()
    }
}

fn main() -> common::Outcome {
    let (elements, length, tension, rho) = (64, 0.65, 70.0, 3.9e-4);
    let pitch = length / elements as f64;
    let string = GuitarString {
        nodes: elements - 1,
        pitch,
        ea: 9.8e3,
        tension,
        mass: vec![rho * pitch; elements - 1],
        damping: 0.0,
    };
    println!("{}", GuitarString::REPORT);
    let rest = string.state().build()?;
    let tones = string.modes(&rest, 5)?;
    for (k, tone) in (1..).zip(&tones) {
        let exact = 2.0 * (tension / rho).sqrt() / pitch * (0.5 * f64::from(k) * PI / elements as f64).sin();
        println!(
            "tone {k}: {:.3} Hz, ratio {:.5}",
            tone.frequency() / (2.0 * PI),
            tone.frequency() / tones[0].frequency()
        );
        assert!((tone.frequency() / exact - 1.0).abs() < 1e-9);
    }

    // A bead in the middle: the even tones have a node there.
    let mut beaded = string.clone();
    beaded.mass[elements / 2 - 1] += 0.2 * rho * length;
    let lowered = beaded.modes(&rest, 4)?;
    for (k, (own, plain)) in lowered.iter().zip(&tones).enumerate() {
        let ratio = own.frequency() / plain.frequency();
        println!("with a bead, tone {}: {ratio:.6} of what it was", k + 1);
        assert!(if k % 2 == 0 { ratio < 0.95 } else { (ratio - 1.0).abs() < 1e-9 });
    }

    // The pitch of large swings, by the times at which the string passes its line.
    let along = |i: usize| i as f64 * PI / elements as f64;
    let mut pitches = Vec::new();
    for height in [0.5e-3, 2e-3, 4e-3] {
        let stretched = move |i: usize| -height * height * PI / (8.0 * length) * (2.0 * along(i)).sin();
        let start = string
            .state()
            .w((1..elements).map(|i| height * along(i).sin()))
            .s((1..elements).map(stretched))
            .build()?;
        let motion = string.simulate(start).until(0.025).tolerance(1e-8).record(Every::time(2e-5)).run()?;
        let mut passed = Vec::new();
        let mut last = (0.0, motion.output("mean_height", 0.0)?);
        for frame in motion.frames().skip(1) {
            let now = (frame.t, motion.output("mean_height", frame.t)?);
            if last.1 * now.1 <= 0.0 {
                passed.push(last.0 - last.1 * (now.0 - last.0) / (now.1 - last.1));
            }
            last = now;
        }
        let omega = PI * (passed.len() - 1) as f64 / (passed[passed.len() - 1] - passed[0]);
        let rise = omega / tones[0].frequency() - 1.0;
        let exact = 3.0 / 32.0 * string.ea / tension * (PI * height / length).powi(2);
        println!(
            "swing of {} mm: {:+.2} cent, Kirchhoff {:+.2}",
            1e3 * height,
            1200.0 * (1.0 + rise).log2(),
            1200.0 * (1.0 + exact).log2()
        );
        assert!((rise / exact - 1.0).abs() < 0.05);
        pitches.push((1e3 * height, 1e3 * rise));
    }

    // Plucked at a fifth of its length: the fifth tone is silent.
    let mut plucked = string.clone();
    plucked.damping = 1.5e-4;
    let shape = |i: usize| {
        let part = i as f64 / elements as f64;
        3e-3 * (part / 0.2).min((1.0 - part) / 0.8)
    };
    let start = plucked.state().w((1..elements).map(shape)).build()?;
    let motion = plucked.simulate(start).until(0.02).tolerance(1e-7).run()?;
    let loudness = |k: usize| {
        let part = |w: &[f64]| (1..elements).map(|i| w[i - 1] * (k as f64 * along(i)).sin()).sum::<f64>();
        let largest = motion.frames().filter_map(|frame| frame.state).map(|state| part(state.w()).abs());
        largest.fold(0.0, f64::max)
    };
    assert!(loudness(5) < 0.1 * loudness(4) && loudness(5) < 0.1 * loudness(6));
    println!("\n{}", motion.summary());

    let mut files = common::Files::of("guitar_string");
    let sounds = (1..=12).map(|k| (k as f64, loudness(k) / loudness(1)));
    Chart::new("A string: its pitch over the height of the swing, and its tones when plucked at one fifth")
        .panel(
            Panel::new(Axis::new("height in mm"), Axis::new("pitch raised by, in 1/1000")).curve("", pitches),
        )
        .panel(Panel::new(Axis::new("tone"), Axis::log("height over that of the first")).points("", sounds))
        .write_svg(files.path("string.svg"))?;
    motion.space_time("w")?.write_svg(files.path("space_time.svg"))?;
    motion.animate(files.path("string.html"))?;
    files.list();
    Ok(())
}
