//! A million revolutions: q̈ = −μ q/|q|³ in steps of a fixed size.
//!
//! Methods that preserve the structure of the motion make energy errors that stay bounded. With RK4 the
//! errors grow with every revolution, until the orbit is a different one. The size of the errors depends on
//! order and step: a higher order pays if the steps are short.
//!
//! Where the method makes no error, rounding remains. This is shown on an orbit with e = 0.9 for 100,000
//! revolutions. By Brouwer's law, rounding without bias grows with the root of the time. The smallest errors
//! of a method of fixed order have a bias, and grow with the time.

mod common;

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// Two bodies that attract each other: the motion of one about the other.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub struct Kepler {
    /// Gravitational parameter.
    pub mu: f64,
}

#[dynamics]
impl Kepler {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravitation(&self, q: &Coordinates<Self>) -> Expr {
        -self.mu / vec2(q.x, q.y).norm()
    }
}

/// Largest |E − E₀|/|E₀| in each decade of revolutions.
type Errors = Vec<(f64, f64)>;

/// So many revolutions with so many steps each, and a little, so that every phase is met.
fn errors(
    model: &Kepler,
    method: &methods::Any<Kepler>,
    steps: f64,
    revolutions: f64,
) -> Result<Errors, Box<dyn std::error::Error>> {
    let start = model.state().x(0.8).y_rate(1.5f64.sqrt()).build()?;
    let (energy, turn) = (model.energy_function(&start), std::f64::consts::TAU);
    let mut found: Errors = Vec::new();
    let mut limit = 10.0;
    let mut worst = 0.0f64;
    let run =
        model.simulate(start).until(turn * revolutions).fixed_step(turn / (steps + 0.618)).method(method);
    run.max_steps(u64::MAX).run_with(|state| {
        if state.t > turn * limit {
            found.push((limit, std::mem::take(&mut worst)));
            limit *= 10.0;
        }
        worst = worst.max(((model.energy_function(state) - energy) / energy).abs());
    })?;
    found.push((limit, worst));
    Ok(found)
}

/// Largest |E − E₀| up to each of some numbers of revolutions, of an orbit with e = 0.9 and E₀ = −½, at the
/// smallest tolerance that there is.
fn rounding(
    model: &Kepler,
    method: &methods::Any<Kepler>,
    revolutions: f64,
) -> Result<Errors, Box<dyn std::error::Error>> {
    let start = model.state().x(0.1).y_rate(19f64.sqrt()).build()?;
    let (energy, turn) = (model.energy_function(&start), std::f64::consts::TAU);
    let (mut found, mut worst, mut mark) = (Errors::new(), 0.0f64, 1.0);
    model
        .simulate(start)
        .until(turn * revolutions)
        .tolerance(1e-15)
        .method(method)
        .max_steps(u64::MAX)
        .run_with(|state| {
            worst = worst.max((model.energy_function(state) - energy).abs());
            if state.t >= turn * mark {
                found.push((mark, worst));
                mark *= 10f64.sqrt();
            }
        })?;
    Ok(found)
}

/// The second picture: rounding alone, and what adds up.
fn brouwer(model: &Kepler) -> Result<Panel, Box<dyn std::error::Error>> {
    let mut panel = Panel::new(Axis::log("revolutions"), Axis::log("energy error"));
    for (method, name, revolutions, bias) in [
        (methods::Any::from(methods::Dop853), "DOP853", 1.01e4, true),
        (methods::Verner9.into(), "Verner 9(8)", 1.01e4, true),
        (methods::Taylor { order: Some(16) }.into(), "Taylor series of order 16", 1.01e5, false),
    ] {
        let found = rounding(model, &method, revolutions)?;
        let text: Vec<String> = found.iter().step_by(2).map(|(_, error)| format!("{error:.1e}")).collect();
        println!("{name:28} tolerance 1e-15, 1, 10, 100, … revolutions: {}", text.join("  "));
        let [before, last] = [found[found.len() - 5].1, found[found.len() - 1].1];
        if bias {
            assert!(last > 50.0 * before, "errors of steps add up: {before:e} to {last:e}");
        } else {
            assert!(found[6].1 < 0.5e-13, "rounding in 1,000 revolutions: {:e}", found[6].1);
            assert!(last < 30.0 * before, "rounding errors walk at random: {before:e} to {last:e}");
        }
        panel = panel.line(name, found);
    }
    let law = |power: f64, first: f64| [(1.0, first), (1e5, first * 1e5f64.powf(power))].to_vec();
    Ok(panel.line("∝ √t", law(0.5, 1e-15)).line("∝ t", law(1.0, 1e-15)))
}

fn main() -> common::Outcome {
    let model = Kepler { mu: 1.0 };
    let revolutions = 1e6;
    let mut panel = Panel::new(Axis::log("revolutions"), Axis::log("energy error"));
    for (method, steps) in [
        (methods::Any::from(methods::Rk4), 96.0),
        (methods::StormerVerlet.into(), 96.0),
        (methods::Composition4.into(), 20.0),
        (methods::Composition6.into(), 16.0),
        (methods::Composition8.into(), 16.0),
        (methods::Gauss6.into(), 12.0),
    ] {
        let found = errors(&model, &method, steps, revolutions)?;
        let text: Vec<String> = found.iter().map(|(_, error)| format!("{error:.2e}")).collect();
        println!("{:28} {steps:3} steps a revolution: {}", method.to_string(), text.join("  "));
        let (first, last) = (found[0].1, found[found.len() - 1].1);
        if method.method() == Method::Rk4 {
            assert!(last > 1e3 * first, "RK4 loses the orbit: {first:e} to {last:e}");
        } else {
            assert!(last < 1.1 * first, "{method} keeps its energy error: {first:e} to {last:e}");
        }
        panel = panel.line(method.to_string(), found);
    }
    let mut files = common::Files::of("long_motions");
    Chart::new("Energy error of a Kepler orbit, e = 0.2")
        .panel(panel)
        .write_svg(files.path("long_motions.svg"))?;
    let title = "Rounding: energy error of a Kepler orbit, e = 0.9, smallest tolerance";
    Chart::new(title).panel(brouwer(&model)?).write_svg(files.path("rounding.svg"))?;
    files.list();
    Ok(())
}
