//! A bicycle without hands rights itself between its weave speed and its capsize speed.
//!
//!     M q̈ + v C₁ q̇ + (g K₀ + v² K₂) q = 0,        q = (lean, steer)
//!
//! The model is nonlinear: four rigid bodies and wheels that roll (F. J. W. Whipple, Q. J. Pure Appl. Math.
//! 30 (1899) 312). Its linearisation at straight running gives the weave speed 4.292 m/s and the capsize
//! speed 6.024 m/s of J. P. Meijaard et al., Proc. R. Soc. A 463 (2007) 1955.

#[path = "../tests/models/bicycle.rs"]
mod bicycle;
mod common;

use bicycle::{Bicycle, model};
use dynamics::analysis::LinearizeError;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// The eigenvalues of lean and steer, by growing real part.
fn eigenvalues(bicycle: &Bicycle, speed: f64) -> Result<Vec<(f64, f64)>, LinearizeError> {
    let linear = bicycle.linearize_in(&bicycle.running(speed), &["roll", "steer", "rear"])?;
    let all = linear.eigenvalues()?;
    // Place, yaw, the wheels' angles and the speed only count what happens.
    Ok(all.iter().filter(|x| x.norm() > 0.0).map(|x| (x.re, x.im)).collect())
}

/// The speed between two at which the fastest growth of an eigenvalue, of a pair or of a real one, changes
/// its sign.
fn critical(bicycle: &Bicycle, of_pair: bool, mut between: [f64; 2]) -> Result<f64, LinearizeError> {
    let growth = |speed: f64| -> Result<f64, LinearizeError> {
        let found = eigenvalues(bicycle, speed)?;
        let kind = found.into_iter().filter(|(_, im)| (*im != 0.0) == of_pair);
        Ok(kind.map(|(re, _)| re).fold(f64::NEG_INFINITY, f64::max))
    };
    let sign = growth(between[0])?.signum();
    while between[1] - between[0] > 1e-12 {
        let middle = 0.5 * (between[0] + between[1]);
        if middle == between[0] || middle == between[1] {
            break;
        }
        between[usize::from(growth(middle)?.signum() != sign)] = middle;
    }
    Ok(0.5 * (between[0] + between[1]))
}

/// Speed (m/s), lean and steer (°) of a turn.
type Turn = (f64, f64, f64);

/// The steady turns that begin where straight running capsizes, each found from the two before (P.
/// Basu-Mandal, A. Chatterjee & J. M. Papadopoulos, Proc. R. Soc. A 463 (2007) 1983).
fn turns(bicycle: &Bicycle, capsize: f64) -> Result<Vec<Turn>, Box<dyn std::error::Error>> {
    let (mut found, mut place, mut before) = (Vec::new(), [0.019, 0.0055], [0.0; 2]);
    for k in 1..=70 {
        let speed = capsize - 1e-3 * f64::from(k * k);
        let start = bicycle.state().roll(place[0]).steer(place[1]).pitch_guess(0.0);
        let start = start.rear_rate(-speed / bicycle.radius[0]).roll_rate(0.0).steer_rate(0.0).assemble()?;
        let turn = bicycle.steady_in(&start, &["roll", "steer", "rear"])?.state;
        let here = [turn.roll(), turn.steer()];
        assert!(here[0] > before[0] * 0.5 && here[1] > before[1], "it leans and steers to the same side");
        (place, before) = ([0, 1].map(|i| 2.0 * here[i] - before[i]), here);
        found.push((speed, here[0].to_degrees(), here[1].to_degrees()));
    }
    Ok(found)
}

/// Draws the eigenvalues of lean and steer over the speed.
fn draw_eigenvalues(bicycle: &Bicycle, critical: [f64; 2], files: &mut common::Files) -> common::Outcome {
    let speeds: Vec<f64> = (0..=200).map(|k| 0.05 * f64::from(k)).collect();
    let (mut growth, mut swing) = (Vec::new(), Vec::new());
    for speed in speeds {
        for (re, im) in eigenvalues(bicycle, speed)? {
            growth.push((speed, re));
            if im > 0.0 {
                swing.push((speed, im));
            }
        }
    }
    growth.retain(|(_, re)| *re > -11.0);
    Chart::new("A bicycle without hands: eigenvalues beside straight running")
        .panel(
            Panel::new(Axis::new("speed in m/s"), Axis::new("in 1/s"))
                .points("growth", growth)
                .points("frequency", swing)
                .instants("weave and capsize speed", critical),
        )
        .panel_height(420.0)
        .write_svg(files.path("eigenvalues.svg"))?;
    Ok(())
}

fn main() -> common::Outcome {
    let bicycle = model();
    let (weave, capsize) = (critical(&bicycle, true, [2.0, 5.0])?, critical(&bicycle, false, [5.5, 7.0])?);
    println!("weave speed {weave:.10} m/s, capsize speed {capsize:.10} m/s");
    assert!((weave - 4.292_382_536_341_11).abs() < 1e-9 && (capsize - 6.024_262_015_388_37).abs() < 1e-9);

    // Pushed sideways at a speed between them it wavers, and runs upright again, in another direction and a
    // little faster than before.
    let pushed = |speed: f64, push: f64| {
        let [rear, front] = bicycle.radius.map(|radius| -speed / radius);
        bicycle.state().x_rate(speed).rear_rate(rear).front_rate(front).roll_rate(push).build()
    };
    let stable = bicycle.simulate(pushed(5.0, 0.3)?).until(10.0).tolerance(1e-10).run()?;
    println!("{}", stable.summary());
    let end = stable.end();
    let speed = |state: &State<Bicycle>| state.x_rate().hypot(state.y_rate());
    println!(
        "after 10 s it leans by {:.1e}°, has turned by {:.2}°, and runs at {:.6} m/s instead of 5",
        end.roll().to_degrees(),
        end.yaw().to_degrees(),
        speed(&end)
    );
    assert!(end.roll().abs() < 0.02 && end.steer().abs() < 0.02 && speed(&end) > 5.0);
    assert!(stable.summary().energy_drift < 1e-7);
    // Too slow it weaves, wider and wider; a small push is enough.
    let weaving = bicycle.simulate(pushed(3.5, 0.02)?).until(3.0).tolerance(1e-10).run()?;
    let widest = |motion: &Motion<Bicycle>, [from, to]: [f64; 2]| {
        motion
            .sample((0..=400).map(|k| from + (to - from) * f64::from(k) / 400.0))
            .map(|s| s.roll().abs())
            .fold(0.0, f64::max)
    };
    let (early, late) = (widest(&weaving, [0.0, 1.0]), widest(&weaving, [2.0, 3.0]));
    println!(
        "at 3.5 m/s it leans by {:.2}° at most in the first second, by {:.2}° in the third",
        early.to_degrees(),
        late.to_degrees()
    );
    assert!(late > 1.5 * early);

    let turns = turns(&bicycle, capsize)?;
    let last = turns.last().ok_or("slow turns")?;
    println!(
        "turns without hands go from {capsize:.3} m/s down to {:.3} m/s, where it leans by {:.2}° and steers \
         by {:.2}°",
        last.0, last.1, last.2
    );
    let mut files = common::Files::of("bicycle");
    let over = |value: fn(&(f64, f64, f64)) -> f64| {
        turns.iter().map(|turn| (turn.0, value(turn))).collect::<Vec<_>>()
    };
    Chart::new("Turns without hands")
        .panel(
            Panel::new(Axis::new("speed of the rear wheel in m/s"), Axis::new("in °"))
                .line("lean", over(|turn| turn.1))
                .line("steer", over(|turn| turn.2))
                .instants("capsize speed", [capsize]),
        )
        .write_svg(files.path("turns.svg"))?;
    draw_eigenvalues(&bicycle, [weave, capsize], &mut files)?;
    let of = |motion: &Motion<Bicycle>, until: f64, value: fn(&State<Bicycle>) -> f64| {
        motion.sample(common::times(until, 600)).map(|s| (s.t, value(&s).to_degrees())).collect::<Vec<_>>()
    };
    Chart::new("Pushed sideways")
        .panel(
            Panel::new(Axis::new("t in s"), Axis::new("at 5 m/s, in °"))
                .line("lean", of(&stable, 10.0, |s| s.roll()))
                .line("steer", of(&stable, 10.0, |s| s.steer()))
                .line("yaw", of(&stable, 10.0, |s| s.yaw())),
        )
        .panel(
            Panel::new(Axis::new("t in s"), Axis::new("at 3.5 m/s, in °"))
                .line("lean", of(&weaving, 3.0, |s| s.roll()))
                .line("steer", of(&weaving, 3.0, |s| s.steer())),
        )
        .write_svg(files.path("motion.svg"))?;
    stable.animation().plot(["roll", "steer"]).write_html(files.path("riding.html"))?;
    files.list();
    Ok(())
}
