//! A double pendulum as a functional mock-up unit (FMI 3.0), and an importer of thirty lines in C that moves
//! it by Co-Simulation, beside the same pendulum in Rust.
//!
//!     r₁ = l₁ (sin θ₁, −cos θ₁),   r₂ = r₁ + l₂ (sin θ₂, −cos θ₂)
//!     L = ½ m₁ |ṙ₁|² + ½ m₂ |ṙ₂|² − g (m₁ y₁ + m₂ y₂)
//!
//! Nothing brakes the pendulum, so the unit's output `energy` has to stay what it was, whatever the steps
//! between which the importer asks for values. Its angles are those of Rust until the pendulum's chaos has
//! made radians of the tolerance.

mod common;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// Two bobs on massless rods.
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

/// An importer: it takes steps of 0.02 s and prints the time and the variables whose references it is given.
const IMPORTER: &str = r#"
#include "fmi3Functions.h"
#include <stdio.h>
#include <stdlib.h>

int main(int count, char **words)
{
  fmi3Instance x = fmi3InstantiateCoSimulation("one", words[1], NULL, fmi3False, fmi3False, fmi3False,
    fmi3False, NULL, 0, NULL, NULL, NULL);
  fmi3Status status = fmi3EnterInitializationMode(x, fmi3False, 0.0, 0.0, fmi3False, 0.0);
  status |= fmi3ExitInitializationMode(x);
  for (int step = 0; (step <= 500) && (status == fmi3OK); step++) {
    bool event, stop, early;
    double t = 0.02*step;
    printf("%.17g", t);
    for (int i = 2; i < count; i++) {
      const fmi3ValueReference reference = (fmi3ValueReference)atoi(words[i]);
      double value = 0.0;
      status |= fmi3GetFloat64(x, &reference, 1, &value, 1);
      printf(" %.17g", value);
    }
    printf("\n");
    status |= fmi3DoStep(x, t, 0.02*(step + 1) - t, fmi3True, &event, &stop, &early, &t);
  }
  fmi3FreeInstance(x);
  return status;
}
"#;

/// The value of an attribute in a text of XML, behind some words.
fn attribute<'a>(text: &'a str, behind: &str, name: &str) -> Result<&'a str, Box<dyn Error>> {
    let (_, rest) = text.split_once(behind).ok_or("the words are there")?;
    let (_, rest) = rest.split_once(&format!("{name}=\"")).ok_or("the attribute is there")?;
    Ok(rest.split('"').next().unwrap_or_default())
}

/// Compiles the sources of a folder with the importer, and runs it: the rows that it prints.
fn run(folder: &Path, sources: &[String], arguments: &[&str]) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let done = |output: Output| match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    };
    fs::write(folder.join("importer.c"), IMPORTER)?;
    let mut command = Command::new("cc");
    command.current_dir(folder).args(["-std=c99", "-O2", "importer.c"]).args(sources);
    done(command.args(["-o", "importer", "-lm"]).output()?)?;
    let text = done(Command::new(folder.join("importer")).args(arguments).output()?)?;
    let row = |line: &str| line.split(' ').map(str::parse).collect::<Result<Vec<f64>, _>>();
    Ok(text.lines().map(row).collect::<Result<_, _>>()?)
}

fn main() -> common::Outcome {
    let mut files = common::Files::of("double_pendulum_fmu");
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let start = model.state().theta1(2.0).theta2(2.5).build()?;

    let unit = model.fmu(start).tolerance(1e-10).method(methods::Dop853);
    unit.write(files.path("double_pendulum.fmu"))?;
    let folder = files.path("sources");
    fs::create_dir_all(&folder)?;
    let (mut sources, mut description) = (Vec::new(), String::new());
    for file in unit.files()? {
        if file.name == "modelDescription.xml" {
            description = String::from_utf8(file.bytes)?;
        } else if let Some(name) = file.name.strip_prefix("sources/") {
            fs::write(folder.join(name), file.bytes)?;
            sources.extend(name.ends_with(".c").then(|| name.to_owned()));
        }
    }
    if Command::new("cc").arg("--version").output().is_err() {
        println!("there is no compiler of C here: the unit is written, and nothing is compared");
        files.list();
        return Ok(());
    }
    let token = attribute(&description, "<fmiModelDescription", "instantiationToken")?;
    let reference = |name: &str| attribute(&description, &format!("name=\"{name}\""), "valueReference");
    let rows = run(&folder, &sources, &[token, reference("theta2")?, reference("energy")?])?;

    let motion = model.simulate(start).until(10.0).tolerance(1e-12).run()?;
    let first = rows[0][2];
    let lost = rows.iter().map(|row| (row[2] - first).abs()).fold(0.0, f64::max);
    let apart = |row: &Vec<f64>| (row[1] - motion.at(row[0]).theta2()).abs();
    let early = rows.iter().filter(|row| row[0] <= 3.0).map(apart).fold(0.0, f64::max);
    println!("energy of the unit: {first} J, kept to {lost:.1e} J over ten seconds");
    println!("its second angle is off that of Rust by at most {early:.1e} rad in three seconds");
    assert!(lost < 1e-7 && early < 1e-6, "the unit moves as Rust does");

    let grown = rows.iter().map(|row| [row[0], apart(row)]).filter(|[_, off]| *off > 0.0);
    Chart::new("A chaotic motion by Co-Simulation")
        .panel(
            Panel::new(Axis::new("time in s"), Axis::log("difference of the second angle in rad"))
                .line("unit beside Rust", grown.map(|[t, off]| (t, off))),
        )
        .write_svg(files.path("difference.svg"))?;
    files.list();
    Ok(())
}
