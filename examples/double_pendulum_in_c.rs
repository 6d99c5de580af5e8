//! A double pendulum as a program in C, for a controller, beside the same pendulum in Rust.
//!
//!     r₁ = l₁ (sin θ₁, −cos θ₁),   r₂ = r₁ + l₂ (sin θ₂, −cos θ₂)
//!     L = ½ m₁ |ṙ₁|² + ½ m₂ |ṙ₂|² − g (m₁ y₁ + m₂ y₂)
//!
//! The pendulum is chaotic: small differences double in less than a second, and one in the last bit would be
//! one of radians before a minute has passed. With the library's sines the program in C has the bits of Rust:
//! after a minute both agree to the last digit. In floats the motion soon is another one.

mod common;
use std::error::Error;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// Two bobs on massless rods. The text in C is made on request.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
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

/// Whether a program answers.
fn is_there(name: &str) -> bool {
    let mut command = Command::new(name);
    command.arg("--version").stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// Builds the program of a folder by its `Makefile` and runs it: the rows that it prints.
fn run(folder: &Path) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let done = |output: Output| match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    };
    done(Command::new("make").arg("-s").current_dir(folder).output()?)?;
    let text = done(Command::new(folder.join("example")).output()?)?;
    let row = |line: &str| line.split(' ').map(str::parse).collect::<Result<Vec<f64>, _>>();
    Ok(text.lines().map(row).collect::<Result<_, _>>()?)
}

fn main() -> common::Outcome {
    let mut files = common::Files::of("double_pendulum_in_c");
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let start = model.state().theta1(2.0).theta2(2.5).build()?;
    let (step, end) = (1.0 / 1024.0, 60.0);

    let text = || model.in_c().start(start).step(step).duration(end);
    let (doubles, floats) = (files.path("double"), files.path("single"));
    text().library_sines().write(&doubles)?;
    text().single_precision().write(&floats)?;

    let motion = model.simulate(start).until(end).method(methods::Rk4).fixed_step(step).run()?;
    let rust = motion.end();
    println!("Rust after {end} s:   {:?} rad", rust.q.as_slice());
    if !is_there("cc") || !is_there("make") {
        println!(
            "there is no compiler of C with `make` here: the texts are written, and nothing is compared"
        );
        files.list();
        return Ok(());
    }
    let (in_doubles, in_floats) = (run(&doubles)?, run(&floats)?);
    let last = &in_doubles[in_doubles.len() - 1];
    println!("C after {end} s:      {:?} rad", &last[1..3]);
    if !dynamics::sin_cos::FUSED {
        assert_eq!([rust.q.as_slice(), rust.u.as_slice()].concat(), last[1..], "the same bits");
    }
    let apart = |rows: &[Vec<f64>]| -> Vec<[f64; 2]> {
        rows.iter().zip(&in_doubles).map(|(row, double)| [row[0], (row[2] - double[2]).abs()]).collect()
    };
    let differences = apart(&in_floats);
    let lost = differences.iter().find(|[_, off]| *off > 1.0);
    println!("the motion in floats is off by more than 1 rad after {:.1} s", lost.map_or(f64::NAN, |x| x[0]));
    assert!(lost.is_some_and(|[t, _]| *t < 30.0), "floats leave the motion early");

    let grown: Vec<[f64; 2]> = differences.into_iter().filter(|[_, off]| *off > 0.0).collect();
    Chart::new("A chaotic motion in floats")
        .panel(
            Panel::new(Axis::new("time in s"), Axis::log("difference of the second angle in rad"))
                .line("floats beside doubles", grown.iter().map(|[t, off]| (*t, *off))),
        )
        .write_svg(files.path("floats.svg"))?;
    files.list();
    Ok(())
}
