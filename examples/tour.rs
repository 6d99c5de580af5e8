//! A tour: the double pendulum, from its energies to equations, to a motion, to the error of the methods
//! against their cost.
//!
//!     T = ½ m₁ |ṙ₁|² + ½ m₂ |ṙ₂|²,        V = g (m₁ y₁ + m₂ y₂)
//!
//! `cargo run --release --example tour`

mod common;
use std::time::Instant;

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;
use dynamics::simulate::Flow;

/// Two bobs on massless rods, swinging in a vertical plane.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta1: rad, theta2: rad)]
#[units(m1: kg, m2: kg, l1: m, l2: m, g: m / s^2)]
struct DoublePendulum {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    g: f64,
}

#[dynamics]
impl DoublePendulum {
    fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l1 * vec2(q.theta1.sin(), -q.theta1.cos())
    }
    fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob1(q) + self.l2 * vec2(q.theta2.sin(), -q.theta2.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m1 * self.bob1(q).dt().norm_squared() + 0.5 * self.m2 * self.bob2(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
    }
}

/// (θ₁, θ₂) after 5 s and after 10 s from (2π/3, −π/18) at rest with unit masses and lengths and g = 9.8,
/// from Taylor series in 260-bit arithmetic; the same problem in Cartesian coordinates agrees to 54 digits.
const AFTER_5: [f64; 2] = [-0.440_219_745_366_664_76, 7.049_578_950_150_24];
const AFTER_10: [f64; 2] = [-0.792_596_116_598_799_5, -2.469_494_509_759_272];

/// One run: what it cost and how far from the reference it ended.
struct Run {
    evaluations: f64,
    microseconds: f64,
    error: f64,
}

fn main() -> common::Outcome {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.8 };
    let start = model
        .state()
        .theta1(2.0 * std::f64::consts::PI / 3.0)
        .theta2(-std::f64::consts::PI / 18.0)
        .build()?;
    let mut files = common::Files::of("tour");

    heading("the equations, derived while this program was compiled");
    println!("{}", DoublePendulum::EQUATIONS.trim_end());
    heading("what the compiler found out about the model");
    println!("{}", DoublePendulum::REPORT.trim_end());

    heading("ten seconds of motion");
    let motion = model.simulate(start).until(10.0).tolerance(1e-12).run()?;
    println!("{}", motion.summary());
    heading("the same, with what repeating the motion tells of its accuracy");
    println!("{}", motion.verify());
    println!("distance from 30 reference digits after 10 s: {:.1e} rad", error(&motion.end(), AFTER_10));
    assert!(error(&motion.end(), AFTER_10) < 1e-7);
    motion.plot(files.path("angles.svg"))?;
    motion.plot_energy(files.path("energy.svg"))?;
    motion.write_csv(files.path("motion.csv"))?;

    heading("error against cost: the first five seconds by five methods");
    let tolerances = || (2..=13).map(|k| 10f64.powi(-k));
    let all = [
        (
            "RK4, fixed steps",
            methods::Any::from(methods::Rk4),
            (7..=16).map(|k| 5.0 / 2f64.powi(k)).collect(),
        ),
        ("Dormand–Prince 5(4)", methods::DormandPrince5.into(), tolerances().collect()),
        ("DOP853", methods::Dop853.into(), tolerances().collect()),
        ("Verner 9(8)", methods::Verner9.into(), tolerances().collect()),
        ("Taylor series", methods::Taylor::default().into(), tolerances().collect::<Vec<_>>()),
    ];
    let panel = |title| Panel::new(Axis::log(title), Axis::log("error after 5 s in rad"));
    let (mut by_work, mut by_time) = (panel("evaluations of the accelerations"), panel("time in µs"));
    println!("{:22}{:>14}{:>14}{:>14}", "µs to an error of", "1e-3", "1e-6", "1e-9");
    for (name, method, settings) in all {
        let runs: Vec<Run> =
            settings.iter().map(|e| measure(&model, start, &method, *e)).collect::<Result<_, _>>()?;
        let cost = |error| time_to(error, &runs).map_or("–".to_string(), |t| format!("{t:.0}"));
        println!("{name:22}{:>14}{:>14}{:>14}", cost(1e-3), cost(1e-6), cost(1e-9));
        by_work = by_work.curve(name, runs.iter().map(|r| (r.evaluations, r.error)));
        by_time = by_time.curve(name, runs.iter().map(|r| (r.microseconds, r.error)));
    }
    Chart::new("Double pendulum over 5 s: error against cost")
        .panel(by_work)
        .panel(by_time)
        .panel_height(300.0)
        .write_svg(files.path("error_against_cost.svg"))?;
    motion.animate(files.path("double_pendulum.html"))?;
    files.list();
    Ok(())
}

fn heading(title: &str) {
    println!("\n── {title} {}", "─".repeat(90usize.saturating_sub(title.chars().count() + 4)));
}

/// The larger error of the two angles.
fn error(end: &State<DoublePendulum>, reference: [f64; 2]) -> f64 {
    (end.theta1() - reference[0]).abs().max((end.theta2() - reference[1]).abs())
}

/// Runs a method with a step size (RK4) or a tolerance; the time is the shortest of several runs that keep
/// nothing.
fn measure(
    model: &DoublePendulum,
    start: State<DoublePendulum>,
    method: &methods::Any<DoublePendulum>,
    setting: f64,
) -> Result<Run, Box<dyn std::error::Error>> {
    let simulation = || {
        let simulation = model.simulate(start).until(5.0).method(method).max_steps(1_000_000);
        if method.is_adaptive() { simulation.tolerance(setting) } else { simulation.fixed_step(setting) }
    };
    let motion = simulation().run()?;
    let mut shortest = f64::INFINITY;
    for _ in 0..10 {
        let clock = Instant::now();
        simulation().run_with(|_| Flow::Continue)?;
        shortest = shortest.min(clock.elapsed().as_secs_f64());
    }
    let evaluations = motion.summary().evaluations as f64;
    Ok(Run { evaluations, microseconds: 1e6 * shortest, error: error(&motion.end(), AFTER_5) })
}

/// Time at which a method's curve reaches an error, between its two nearest runs on logarithmic scales.
fn time_to(error: f64, runs: &[Run]) -> Option<f64> {
    let pair = runs.windows(2).find(|pair| pair[0].error >= error && pair[1].error < error)?;
    let part = (pair[0].error / error).ln() / (pair[0].error / pair[1].error).ln();
    Some(pair[0].microseconds * (pair[1].microseconds / pair[0].microseconds).powf(part))
}
