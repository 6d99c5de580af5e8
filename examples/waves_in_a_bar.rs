//! Waves in a bar, by lumped masses and by finite elements: ρA s'' = (EA s')'.
//!
//! A pulse runs along a bar that is clamped at its left end and free at its right end. It is reflected there:
//! with its sign at the free end, against its sign at the clamped end. Where the section changes, a part
//! goes on and a part returns. The exact answer is d'Alembert's; the step times the speed of sound over the
//! length of an element is the Courant number.
//!
//! Source: Schmerr, Engineering Dynamics 2.0 (2019), chapter 9; Hughes, The Finite Element Method (1987),
//! chapter 9.

mod common;

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A bar whose elements have their mass at their ends.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.elements])]
#[units(length: m, ea: N, rho: kg / m)]
struct Lumped {
    elements: usize,
    length: f64,
    /// Stiffness by element.
    ea: Vec<f64>,
    /// Mass per length by element.
    rho: Vec<f64>,
}

#[dynamics]
impl Lumped {
    fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    /// Node 0 is clamped.
    fn node(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.s[i - 1] }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                let (a, b) = (self.node(q, e).dt(), self.node(q, e + 1).dt());
                0.25 * self.rho[e] * self.h() * (a * a + b * b)
            })
            .sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..self.elements {
            let strain = (self.node(q, e + 1) - self.node(q, e)) / self.h();
            sum += 0.5 * self.ea[e] * self.h() * strain.powi(2);
        }
        sum
    }
    #[output]
    fn wall(&self, q: &Coordinates<Self>) -> Expr {
        self.ea[0] / self.h() * q.s[0]
    }
}

/// The same bar in finite elements: velocities are linear between nodes.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.elements])]
#[units(length: m, ea: N, rho: kg / m)]
struct Consistent {
    elements: usize,
    length: f64,
    ea: f64,
    rho: f64,
}

#[dynamics]
impl Consistent {
    fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    fn node(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.s[i - 1] }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                let (a, b) = (self.node(q, e).dt(), self.node(q, e + 1).dt());
                self.rho * self.h() / 6.0 * (a * a + a * b + b * b)
            })
            .sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| 0.5 * self.ea / self.h() * (self.node(q, e + 1) - self.node(q, e)).powi(2))
            .sum()
    }
}

/// Speed of sound in m/s of the bars here.
const SPEED: f64 = 5000.0;
const EA: f64 = 2.5e6;
const RHO: f64 = EA / (SPEED * SPEED);
const LENGTH: f64 = 1.0;

/// The pulse that runs to the right from t = 0 on, with its reflections: s = F(x − ct) − F(−x − ct), where
/// F is the pulse on the bar, F(y + 2l) = −F(y), and nothing on the left of the bar.
fn exact(x: f64, t: f64) -> f64 {
    let pulse = |y: f64| 1e-3 * (-((y - 0.35 * LENGTH) / (0.05 * LENGTH)).powi(2)).exp();
    let wave = |y: f64| match y.rem_euclid(4.0 * LENGTH) / LENGTH {
        y if y < 1.0 => pulse(y * LENGTH),
        y if (2.0..3.0).contains(&y) => -pulse((y - 2.0) * LENGTH),
        _ => 0.0,
    };
    wave(x - SPEED * t) - wave(-x - SPEED * t)
}

/// The greatest error at the nodes after the pulse has run along the bar three times, over the pulse's
/// height.
fn error(s: &[f64], t: f64) -> f64 {
    let n = s.len();
    let x = |i: usize| LENGTH * (i + 1) as f64 / n as f64;
    s.iter().enumerate().map(|(i, s)| (s - exact(x(i), t)).abs()).fold(0.0, f64::max) / 1e-3
}

fn main() -> common::Outcome {
    let n = 200;
    let lumped = Lumped { elements: n, length: LENGTH, ea: vec![EA; n], rho: vec![RHO; n] };
    let consistent = Consistent { elements: n, length: LENGTH, ea: EA, rho: RHO };
    println!("{}\n{}", Consistent::EQUATIONS, Consistent::REPORT);

    // A pulse that runs to the right.
    let places = move || (1..=n).map(move |i| LENGTH * i as f64 / n as f64);
    let rates = |h: f64| places().map(move |x| (exact(x, h) - exact(x, -h)) / (2.0 * h)).collect::<Vec<_>>();
    let start_of = |h: f64| lumped.state().s(places().map(|x| exact(x, 0.0))).s_rate(rates(h)).build();

    // The bound is attained: one element in a step, and the scheme moves waves without any error.
    let longest = lumped.longest_step(&start_of(1e-6)?)?;
    assert!((longest * SPEED / (LENGTH / n as f64) - 1.0).abs() < 1e-12);
    let passes = 3.0 * LENGTH / SPEED;
    let mut errors = [Vec::new(), Vec::new()];
    for courant in [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0] {
        let h = courant * longest;
        let steps = (passes / h).round();
        let end = steps * h;
        let motion = lumped.simulate(start_of(h)?).until(end).fixed_step(h).record(Every::Last).run()?;
        errors[0].push((courant, error(motion.end().s(), motion.end().t())));
        // Finite elements allow a step that is shorter by the root of three, and waves run too fast in them.
        let start = consistent.state().s(places().map(|x| exact(x, 0.0))).s_rate(rates(h)).build()?;
        if h <= consistent.longest_step(&start)? {
            let motion = consistent.simulate(start).until(end).fixed_step(h).record(Every::Last).run()?;
            errors[1].push((courant, error(motion.end().s(), motion.end().t())));
        }
    }
    for (name, errors) in ["lumped", "consistent"].iter().zip(&errors) {
        println!("{name} masses: error {:.1e} at Courant number {}", errors[0].1, errors[0].0);
    }
    let (_, at_one) = errors[0][errors[0].len() - 1];
    println!("lumped masses: error {at_one:.1e} at Courant number 1");
    assert!(at_one < 1e-10 && errors[0][4].1 > 1e3 * at_one);
    // A step that is too long is refused before it runs.
    let refused = lumped.simulate(start_of(longest)?).until(1e-3).fixed_step(1.001 * longest).run();
    println!("\n{}", refused.err().ok_or("the step is too long")?);

    // The section changes in the middle: impedance √(EA ρ) doubles with the area.
    let mut stepped = lumped.clone();
    for e in n / 2..n {
        stepped.ea[e] *= 2.0;
        stepped.rho[e] *= 2.0;
    }
    let h = 0.5 * longest;
    let start = stepped.state().s(places().map(|x| exact(x, 0.0))).s_rate(rates(h)).build()?;
    let motion = stepped
        .simulate(start)
        .until(0.4 * LENGTH / SPEED)
        .fixed_step(h)
        .record(Every::time(0.1 * LENGTH / SPEED))
        .run()?;
    let s = motion.end().s();
    let (returned, passed) = (
        s[..n / 2].iter().copied().fold(0.0, f64::min) / 1e-3,
        s[n / 2..].iter().copied().fold(0.0, f64::max) / 1e-3,
    );
    println!("at the step of the section {returned:.4} returns, {passed:.4} goes on");
    assert!((returned + 1.0 / 3.0).abs() < 2e-3 && (passed - 2.0 / 3.0).abs() < 2e-3);
    println!("\n{}", motion.summary());

    let mut files = common::Files::of("waves_in_a_bar");
    let mut shapes = Panel::new(Axis::new("x in m"), Axis::new("displacement in mm"));
    for frame in motion.frames() {
        let Some(state) = frame.state else { continue };
        let points = places().zip(state.s().iter().map(|s| 1e3 * s).collect::<Vec<_>>());
        shapes = shapes.line(format!("{:.0} µs", 1e6 * frame.t), points);
    }
    let mut chart = Panel::new(Axis::new("Courant number"), Axis::log("error after three passes"));
    for (name, errors) in ["lumped masses", "finite elements"].into_iter().zip(errors) {
        chart = chart.line(name, errors);
    }
    Chart::new("A pulse in a bar whose section doubles at 0.5 m, and what a step costs in a uniform one")
        .panel(shapes)
        .panel(chart)
        .write_svg(files.path("waves.svg"))?;
    files.list();
    Ok(())
}
