//! A driven pendulum that never repeats: its strange attractor, and how fast neighbours separate on it.
//!
//!     θ̈ + θ̇/Q + sin θ = F cos Ωt,        Q = 2, F = 1.5, Ω = 2/3
//!
//! Seen once in each period of the drive, the motion stays on a set of points that is neither a curve nor an
//! area. G. L. Baker & J. P. Gollub, *Chaotic Dynamics*, chapters 3 to 5.

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;
use std::f64::consts::TAU;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
struct Driven {
    quality: f64,
    force: f64,
    frequency: f64,
}

#[dynamics]
impl Driven {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.theta.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        -q.theta.cos()
    }
    #[dissipation]
    fn friction(&self, q: &Coordinates<Self>) -> Expr {
        0.5 / self.quality * q.theta.dt().powi(2)
    }
    #[force]
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.theta, self.force * (self.frequency * q.t).cos())
    }
}

fn main() -> common::Outcome {
    let model = Driven { quality: 2.0, force: 1.5, frequency: 2.0 / 3.0 };
    let period = TAU / model.frequency;
    let start = model.state().theta(0.2).build()?;
    let section =
        model.poincare(start).every(period).fold("theta", TAU).skip(50).points(4000).tolerance(1e-8).run()?;
    println!("{} points, once a period of {period:.4} s", section.points.len());

    let exponents = model.lyapunov(start).settle(20.0 * period).during(500.0 * period).run()?;
    println!("Lyapunov exponents:\n{exponents}");
    println!(
        "dimension of the section, by Kaplan and Yorke: {:.3}",
        exponents.kaplan_yorke().unwrap_or(f64::NAN)
    );
    assert_eq!(exponents.is_chaotic(), Some(true));
    // What friction takes is what volumes lose: the exponents' sum is −1/Q.
    assert!(
        (exponents.divergence + 0.5).abs() < 1e-12
            && exponents.sum_defect().is_some_and(|off| off.abs() < 1e-6)
    );

    // In the attractor lie closed motions that repel: the motion comes near them now and then.
    let back = section.closest_return(1).ok_or("the section has points")?;
    let mut search = model.periodic(back.state, back.period);
    for (coordinate, by) in &back.turns {
        search = search.advance(coordinate, *by);
    }
    let orbit = search.run()?;
    println!("\na closed motion in it, from a return that misses by {:.1e}:\n{orbit}", back.miss);
    assert!(orbit.floquet.is_unstable());

    let of = |k: usize| exponents.running.iter().map(move |(t, values)| (*t, values[k]));
    let fixed = |s: &State<Driven>| ((s.theta() + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0, s.theta_rate());
    let points = section.points.iter().map(fixed);
    let attractor = Panel::new(Axis::new("θ in rad").range(-3.2, 3.2), Axis::new("rate of θ in rad/s"));
    let mut files = common::Files::of("poincare");
    Chart::new("A driven pendulum, once a period")
        .panel(
            attractor.dots("the motion", points).points("a closed motion that repels", [fixed(&orbit.start)]),
        )
        .panel_height(480.0)
        .write_svg(files.path("attractor.svg"))?;
    Chart::new("Lyapunov exponents, as the run goes on")
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("exponents in 1/s"))
                .line("largest", of(0))
                .line("other", of(1)),
        )
        .write_svg(files.path("exponents.svg"))?;
    files.list();
    Ok(())
}
