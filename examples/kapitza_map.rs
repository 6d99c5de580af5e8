//! Where a pendulum stands upright on a shaken pivot: the map over amplitude and frequency, by Floquet
//! multipliers.
//!
//!     l θ̈ = (g − A Ω² cos Ωt) sin θ,        θ from the upright
//!
//! Near the upright this is Mathieu's equation with a = −4g/(lΩ²) and q = 2A/l. The pendulum stands where
//! a₀(q) < a < b₁(q). Below the first curve it falls over (μ = 1). Beyond the second, at large
//! amplitudes, it swings more and more at half the frequency (μ = −1). For small amplitudes the first
//! curve is Kapitza's A²Ω² = 2gl. A. B. Pippard, Eur. J. Phys. 8 (1987) 203; Butikov, Am. J. Phys. 69
//! (2001) 755.

mod common;
use dynamics::analysis::{FloquetVerdict, PeriodicError, Threshold};
use dynamics::output::{Animation, Axis, Chart, Mark, Panel, Series};
use dynamics::prelude::*;
use dynamics::simulate::Direction;
use std::f64::consts::TAU;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(mass: kg, length: m, amplitude: m, frequency: rad / s, g: m / s^2)]
struct Shaken {
    mass: f64,
    length: f64,
    amplitude: f64,
    frequency: f64,
    g: f64,
}

#[dynamics]
impl Shaken {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(0.0, self.amplitude * (self.frequency * q.t).cos())
            + self.length * vec2(q.theta.sin(), q.theta.cos())
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let pivot = vec2(0.0, self.amplitude * (self.frequency * q.t).cos());
        Drawing::new().line(pivot, self.bob(q)).dot(pivot).dot(self.bob(q)).tail("bob", self.bob(q), 0.4)
    }
    #[event]
    fn level(&self, q: &Coordinates<Self>) -> Expr {
        q.theta.cos()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y
    }
}

/// a₀(q), or b₁(q): the least eigenvalue of the tridiagonal matrix of Fourier coefficients (Abramowitz &
/// Stegun 20.2), by bisection on Sturm's count.
fn characteristic(q: f64, even: bool) -> f64 {
    let diagonal = |k: u32| {
        if even {
            f64::from(2 * k).powi(2)
        } else {
            f64::from(2 * k + 1).powi(2) - if k == 0 { q } else { 0.0 }
        }
    };
    let beside = |k: u32| if even && k == 0 { 2.0 * q * q } else { q * q };
    let is_below = |x: f64| {
        let mut pivot = diagonal(0) - x;
        (0..30).any(|k| {
            let negative = pivot < 0.0;
            pivot = diagonal(k + 1) - x - beside(k) / pivot;
            negative
        })
    };
    let (mut low, mut high) = (-100.0, 2.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if is_below(middle) { high = middle } else { low = middle }
    }
    low
}

/// Points of the map: amplitude in lengths of the rod, frequency in natural frequencies.
type Region = Vec<(f64, f64)>;

/// Amplitudes and frequencies at which the pendulum stands, falls over, and swings out.
fn regions(length: f64, g: f64) -> Result<[Region; 3], Box<dyn std::error::Error>> {
    let natural = (g / length).sqrt();
    let mut regions: [Region; 3] = Default::default();
    let mut undecided = 0;
    for i in 1..=48 {
        for k in 1..=48 {
            let (part, speed) = (0.7 * f64::from(i) / 48.0, 16.0 * f64::from(k) / 48.0);
            let model = Shaken { mass: 0.1, length, amplitude: part * length, frequency: speed * natural, g };
            let judged = model.floquet(&model.state().build()?, TAU / model.frequency)?;
            let (a, q) = (-4.0 / speed.powi(2), 2.0 * part);
            let stands = characteristic(q, true) < a && a < characteristic(q, false);
            let region = match judged.verdict {
                FloquetVerdict::StableToFirstOrder => 0,
                FloquetVerdict::Unstable { threshold: Threshold::Fold, .. } => 1,
                FloquetVerdict::Unstable { threshold: Threshold::Flip, .. } => 2,
                // On a border, to the digits that there are.
                _ => {
                    undecided += 1;
                    continue;
                }
            };
            assert_eq!(stands, region == 0, "A/l = {part}, Ω/ω = {speed}: {judged}");
            regions[region].push((part, speed));
        }
    }
    let [stands, falls, swings] = &regions;
    println!(
        "{} points stand, {} fall over, {} swing out, {undecided} on a border",
        stands.len(),
        falls.len(),
        swings.len()
    );
    assert!(stands.len() > 500 && falls.len() > 300 && swings.len() > 100);
    Ok(regions)
}

/// The border at one amplitude, to ten digits.
fn border(length: f64, g: f64) -> common::Outcome {
    let natural = (g / length).sqrt();
    let model = |frequency: f64| Shaken { mass: 0.1, length, amplitude: 0.2 * length, frequency, g };
    let excess = |frequency: f64| -> Result<f64, PeriodicError> {
        let model = model(frequency);
        let start = model.state().build().map_err(PeriodicError::State)?;
        Ok(model.floquet(&start, TAU / frequency)?.monodromy.trace() - 2.0)
    };
    let (mut low, mut high) = (5.0 * natural, 9.0 * natural);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if excess(middle)? > 0.0 { low = middle } else { high = middle }
    }
    let theory = 2.0 * natural / (-characteristic(0.4, true)).sqrt();
    println!(
        "A = 0.2 l: stands from {low:.9} rad/s, Mathieu {theory:.9}, Kapitza {:.3}",
        (2.0 * g * length).sqrt() / (0.2 * length)
    );
    assert!((low / theory - 1.0).abs() < 1e-9);
    Ok(())
}

/// Draws the regions with their borders.
fn draw_map([stands, falls, swings]: [Region; 3], files: &mut common::Files) -> common::Outcome {
    let curve = |even: bool| {
        let at = move |k: i32| 0.7 * f64::from(k) / 400.0;
        let speed = move |part: f64| 2.0 / (-characteristic(2.0 * part, even)).sqrt();
        (1..=400).map(move |k| (at(k), speed(at(k)))).filter(|(_, speed)| *speed < 16.5).collect::<Vec<_>>()
    };
    let averaged = (1..=400)
        .map(|k| 0.7 * f64::from(k) / 400.0)
        .map(|part| (part, 2f64.sqrt() / part))
        .filter(|(_, speed)| *speed < 16.5);
    let panel = Panel::new(
        Axis::new("amplitude / length").range(0.0, 0.71),
        Axis::new("frequency / frequency of the hanging pendulum").range(0.0, 16.3),
    );
    let series = |name: &str, points: Vec<(f64, f64)>| Series::new(name, points).mark(Mark::Points);
    let panel = panel
        .series(series("stands", stands).sign(0))
        .series(series("falls over", falls).sign(2))
        .series(series("swings out", swings).sign(1))
        .series(Series::new("Mathieu a₀(q)", curve(true)).solid().color(Color::Ink))
        .series(Series::new("Mathieu b₁(q)", curve(false)).solid().color(Color::Purple))
        .series(Series::new("averaged: A²Ω² = 2gl", averaged).dashed().color(Color::Amber));
    Chart::new("Where a pendulum stands on a shaken pivot")
        .panel(panel)
        .panel_height(460.0)
        .write_svg(files.path("map.svg"))?;
    Ok(())
}

fn main() -> common::Outcome {
    let (length, g) = (0.3, 9.81_f64);
    let natural = (g / length).sqrt();
    let regions = regions(length, g)?;
    border(length, g)?;

    // One motion of each region, let go 0.02 rad beside the upright, until it is level.
    let of = |part: f64, speed: f64| Shaken {
        mass: 0.1,
        length,
        amplitude: part * length,
        frequency: speed * natural,
        g,
    };
    let models = [of(0.2, 11.0), of(0.2, 5.0), of(0.6, 12.0)];
    let from = |model: &Shaken| model.state().theta(0.02).build();
    let motions = (
        models[0].simulate(from(&models[0])?).until(3.0).run()?,
        models[1].simulate(from(&models[1])?).until(3.0).stop_at("level", Direction::Any).run()?,
        models[2].simulate(from(&models[2])?).until(3.0).stop_at("level", Direction::Any).run()?,
    );
    let reach = |motion: &Motion<'_, Shaken>| {
        motion.sample(common::times(motion.end_time(), 6000)).map(|s| s.theta().abs()).fold(0.0, f64::max)
    };
    let [near, over, out] = [reach(&motions.0), reach(&motions.1), reach(&motions.2)];
    println!("let go at 0.02 rad they reach {near:.3}, {over:.3} and {out:.3} rad");
    assert!(near < 0.05 && over > 1.5 && out > 1.5);

    let mut files = common::Files::of("kapitza_map");
    draw_map(regions, &mut files)?;
    let film = Animation::new()
        .add(&motions.0, "stands")
        .add(&motions.1, "falls over")
        .add(&motions.2, "swings out");
    film.speed(0.15).write_html(files.path("three.html"))?;
    files.list();
    Ok(())
}
