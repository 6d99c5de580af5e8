//! A single-cylinder four-stroke engine with a flywheel: a slider-crank driven by gas pressure.
//!
//!     T = ½ J θ̇² + ½ m_r |ṙ_G|² + ½ J_r φ̇² + ½ m_p ẋ²
//!     crank pin + rod − piston pin = 0        load torque −c θ̇
//!
//! Crank angle, rod angle and piston place are three coordinates. The rod joins them by two constraints.
//! Their multipliers are the force of the rod on the piston pin; its y-component is the side thrust on the
//! cylinder wall. The gas is a law of pressure over the crank angle: intake, compression, expansion, exhaust.

mod common;
use std::f64::consts::{PI, TAU};

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad, phi: rad, x: m)]
#[inputs(pressure: Pa)]
#[units(
    crank: m, rod: m, bore: m, flywheel: kg * m^2, rod_mass: kg, rod_inertia: kg * m^2, piston: kg,
    load: N * m * s
)]
#[nominal(
    crank = 0.04,
    rod = 0.14,
    bore = 0.08,
    flywheel = 0.3,
    rod_mass = 0.5,
    rod_inertia = 1.5e-3,
    piston = 0.4,
    load = 0.1
)]
struct Engine {
    crank: f64,
    rod: f64,
    bore: f64,
    /// Of crank and flywheel.
    flywheel: f64,
    rod_mass: f64,
    /// About the centre of mass.
    rod_inertia: f64,
    piston: f64,
    load: f64,
}

#[dynamics]
impl Engine {
    fn crank_pin(&self, q: &Coordinates<Self>) -> Vec2 {
        self.crank * vec2(q.theta.cos(), q.theta.sin())
    }
    fn along_rod(&self, q: &Coordinates<Self>, part: f64) -> Vec2 {
        self.crank_pin(q) + part * self.rod * vec2(q.phi.cos(), -q.phi.sin())
    }
    fn piston_pin(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, 0.0)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.flywheel * q.theta.dt().powi(2)
            + 0.5 * self.rod_mass * self.along_rod(q, 0.3).dt().norm_squared()
            + 0.5 * self.rod_inertia * q.phi.dt().powi(2)
            + 0.5 * self.piston * q.x.dt().powi(2)
    }
    /// The rod ends at the piston pin.
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.piston_pin(q) - self.along_rod(q, 1.0)
    }
    #[force]
    fn gas(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -0.25 * PI * self.bore.powi(2) * q.pressure)
    }
    #[dissipation]
    fn brake(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.load * q.theta.dt().powi(2)
    }
    /// Force of the rod on the piston pin; the cylinder wall bears its y-component.
    #[output]
    fn pin_force(&self, q: &Coordinates<Self>) -> Vec2 {
        q.reaction(Self::closure)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (pin, piston, r) = (self.crank_pin(q), self.piston_pin(q), 0.5 * self.bore);
        let head = self.crank + self.rod + 0.035;
        let thrust = q.reaction(Self::closure).y;
        Drawing::new()
            .color(Color::Faint)
            .line([0.06, r], [head, r])
            .line([0.06, -r], [head, -r])
            .line([head, r], [head, -r])
            .circle([0.0, 0.0], 0.055)
            .plain()
            .line([0.0, 0.0], pin)
            .disc(pin, 0.005)
            .fill(Color::Blue)
            .rectangle(piston, 0.04, 2.0 * r, 0.0)
            .line(pin, piston)
            .color(Color::Red)
            .arrow(piston, piston + vec2(0.0, 5e-5 * thrust))
    }
}

/// Pressure above the atmosphere's: 1 bar in the intake, polytropic compression 9:1 and expansion from 35
/// bar.
fn pressure(model: &Engine, theta: f64) -> f64 {
    let atmosphere = 1e5;
    let stroke = 2.0 * model.crank;
    let clearance = stroke / 8.0;
    let sin = model.crank / model.rod * theta.sin();
    // Height of the gas above the piston.
    let height = clearance + model.crank * (1.0 - theta.cos()) + model.rod * (1.0 - (1.0 - sin * sin).sqrt());
    let polytropic = |p: f64, from: f64| p * (from / height).powf(1.3);
    let absolute = match theta.rem_euclid(2.0 * TAU) {
        cycle if (PI..TAU).contains(&cycle) => polytropic(atmosphere, clearance + stroke),
        cycle if (TAU..3.0 * PI).contains(&cycle) => polytropic(35.0 * atmosphere, clearance),
        _ => atmosphere,
    };
    absolute - atmosphere
}

/// The motion until `end`, from 1500 revolutions per minute.
fn run(model: &Engine, end: f64) -> Result<Motion<'_, Engine>, Box<dyn std::error::Error>> {
    let start = model.state().theta(0.0).theta_rate(1500.0 * TAU / 60.0).x_guess(0.2).assemble()?;
    let law = move |_: f64, s: &State<Engine>| -> [f64; 1] { [pressure(model, s.theta())] };
    Ok(model.simulate(start).until(end).tolerance(1e-8).max_step(1e-3).inputs(law).run()?)
}

/// Mean of ω over the angle and (ω_max − ω_min)/ω_mean, in the last `cycles` cycles of the motion.
fn speed(motion: &Motion<Engine>, cycles: f64) -> (f64, f64) {
    let first = motion.end().theta() - cycles * 2.0 * TAU;
    let steps: Vec<_> = motion.steps().filter(|s| s.theta() >= first).collect();
    let (mut area, mut angle) = (0.0, 0.0);
    for pair in steps.windows(2) {
        let turned = pair[1].theta() - pair[0].theta();
        area += 0.5 * (pair[0].theta_rate() + pair[1].theta_rate()) * turned;
        angle += turned;
    }
    let rates = steps.iter().map(|s| s.theta_rate());
    let (least, most) = rates.fold((f64::INFINITY, 0.0_f64), |(a, b), w| (a.min(w), b.max(w)));
    (area / angle, (most - least) * angle / area)
}

fn main() -> common::Outcome {
    let model = Engine {
        crank: 0.04,
        rod: 0.14,
        bore: 0.08,
        flywheel: 0.3,
        rod_mass: 0.5,
        rod_inertia: 1.5e-3,
        piston: 0.4,
        load: 0.1,
    };
    println!("{}", Engine::REPORT);
    let end = 24.0;
    let motion = run(&model, end)?;
    println!("{}\n{}", motion.summary(), motion.work());

    // What the gas gives in a cycle is what the brake takes: ∫ c ω dθ = ∮ p dV.
    let volume = |theta: f64| {
        let sin = model.crank / model.rod * theta.sin();
        -0.25 * PI * model.bore.powi(2) * (model.crank * theta.cos() + model.rod * (1.0 - sin * sin).sqrt())
    };
    let parts = 200_000;
    let at = |k: u32| 2.0 * TAU * f64::from(k) / f64::from(parts);
    let work: f64 = (0..parts)
        .map(|k| pressure(&model, 0.5 * (at(k) + at(k + 1))) * (volume(at(k + 1)) - volume(at(k))))
        .sum();
    let (mean, fluctuation) = speed(&motion, 4.0);
    let expected = work / (model.load * 2.0 * TAU);
    println!(
        "{work:.1} J per cycle: {:.0} rpm, by the balance of work {:.0} rpm",
        mean * 60.0 / TAU,
        expected * 60.0 / TAU
    );
    assert!((mean / expected - 1.0).abs() < 1e-3);

    // The flywheel smooths in proportion to its inertia.
    let heavy = Engine { flywheel: 0.6, ..model.clone() };
    let (_, smoother) = speed(&run(&heavy, 2.0 * end)?, 4.0);
    println!(
        "speed fluctuates by {:.2} %, with twice the flywheel by {:.2} %",
        100.0 * fluctuation,
        100.0 * smoother
    );
    assert!((smoother / fluctuation - 0.5).abs() < 0.05);

    let mut files = common::Files::of("engine");
    let cycle = 2.0 * TAU / mean;
    let history: Vec<_> =
        motion.sample((0..=2000).map(|k| end - 2.0 * cycle * (1.0 - f64::from(k) / 2000.0))).collect();
    let panel = |title| Panel::new(Axis::new("time in s"), Axis::new(title));
    let force = |i: usize| history.iter().map(|s| (s.t, motion.outputs_of(s)[i])).collect::<Vec<_>>();
    Chart::new("Two cycles of an engine")
        .panel(panel("gas pressure in bar").line("p", history.iter().map(|s| (s.t, 1e-5 * s.pressure()))))
        .panel(panel("ω in rad/s").line("ω", history.iter().map(|s| (s.t, s.theta_rate()))))
        .panel(
            panel("rod on piston pin in N")
                .line("along the cylinder", force(0))
                .line("side thrust", force(1)),
        )
        .write_svg(files.path("cycles.svg"))?;
    let last = run(&model, 0.4)?;
    last.animation().plot(["pin_force.y"]).speed(0.02).write_html(files.path("engine.html"))?;
    files.list();
    Ok(())
}
