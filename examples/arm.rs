//! An arm of seven hinges that follows a plan, by computed torques.
//!
//!     τ = M(q) (q̈_d + 2 ω ė + ω² e) − Q(q, q̇),        e = q_d − q
//!     ⇒        ë + 2 ω ė + ω² e = 0
//!
//! M and Q come from the model itself, so the torques remove all coupling. An error at the start decays as
//! e₀ (1 + ω t) e^{−ω t} in every joint by itself. A load in the hand that the model does not know of
//! breaks this.

#[path = "../tests/models/arm7.rs"]
mod arm7;
mod common;
use arm7::{Arm, arm};
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

const DURATION: f64 = 3.0;
const OMEGA: f64 = 6.0;

/// Angle, rate and acceleration of a joint that goes from one angle to another and rests there: 10 s³ − 15
/// s⁴ + 6 s⁵.
fn planned(t: f64, from: f64, to: f64) -> [f64; 3] {
    let (s, way) = ((t / DURATION).clamp(0.0, 1.0), to - from);
    [
        from + way * s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s),
        way / DURATION * 30.0 * (s * (1.0 - s)).powi(2),
        way / DURATION.powi(2) * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s),
    ]
}

fn main() -> common::Outcome {
    let (known, home) = (arm(), [0.4, 0.3, -0.5, 0.8, 0.2, -0.6, 0.1]);
    let goal = [-1.2, 1.1, 0.7, -1.3, 1.0, 0.9, -2.0];
    let control = |t: f64, s: &State<Arm>| -> [f64; 7] {
        let wanted = std::array::from_fn::<f64, 7, _>(|i| {
            let [angle, rate, acceleration] = planned(t, home[i], goal[i]);
            acceleration + 2.0 * OMEGA * (rate - s.angles_rate(i)) + OMEGA * OMEGA * (angle - s.angles(i))
        });
        let mut loose = *s;
        loose.inputs = [0.0; 7].into();
        let torques =
            known.mass_matrix(&loose) * nalgebra::SVector::from(wanted) - known.generalized_force(&loose);
        torques.into()
    };
    // Not where the plan begins.
    let offset: [f64; 7] = std::array::from_fn(|i| 0.3 - 0.08 * i as f64);
    let start = known.state().angles(std::array::from_fn(|i| home[i] - offset[i])).build()?;
    let motion = known.simulate(start).until(DURATION).tolerance(1e-10).inputs(control).run()?;
    println!("{}", motion.summary());

    let error = |s: &State<Arm>, i: usize| planned(s.t, home[i], goal[i])[0] - s.angles(i);
    let closed_form = |t: f64, i: usize| offset[i] * (1.0 + OMEGA * t) * (-OMEGA * t).exp();
    let mut apart = 0.0_f64;
    for s in motion.sample(common::times(DURATION, 300)) {
        // The plan starts at rest, and so does the arm: all of the error is that of the angles.
        apart = (0..7).map(|i| (error(&s, i) - closed_form(s.t, i)).abs()).fold(apart, f64::max);
    }
    println!("errors die away as e₀ (1 + ω t) e^(−ω t), to {apart:.1e} rad");
    assert!(apart < 1e-7);

    // A load of half the last link's mass, which the torques do not know of.
    let mut loaded = known.clone();
    loaded.masses[6] *= 1.5;
    let misled = loaded.simulate(start).until(DURATION).tolerance(1e-10).inputs(control).run()?;
    let sags = (0..7).map(|i| error(&misled.end(), i).abs()).fold(0.0, f64::max);
    println!("with a load that is not in the model it ends {:.2}° beside the plan", sags.to_degrees());
    assert!(sags > 1e-3);
    println!(
        "\naccelerations: {}",
        Arm::LISTING.lines().find(|l| l.starts_with("accelerations")).unwrap_or_default()
    );

    let mut files = common::Files::of("arm");
    let samples: Vec<_> = motion.sample(common::times(DURATION, 600)).collect();
    let panel = |title| Panel::new(Axis::new("time in s"), Axis::new(title));
    let (mut errors, mut torques) = (panel("error in degrees"), panel("torque in N·m"));
    for i in [0, 1, 3, 6] {
        let name = format!("joint {}", i + 1);
        errors = errors.line(&name, samples.iter().map(|s| (s.t, error(s, i).to_degrees())));
        torques = torques.line(&name, samples.iter().map(|s| (s.t, control(s.t, s)[i])));
    }
    Chart::new("Seven joints follow a plan")
        .panel(errors)
        .panel(torques)
        .write_svg(files.path("errors.svg"))?;
    motion.animate(files.path("arm.html"))?;
    files.list();
    Ok(())
}
