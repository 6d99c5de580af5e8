//! What decides where a double pendulum is: its starts, its lengths, its masses? The answer changes with
//! time.
//!
//! Each input is known to within a normal distribution: angles to 1°, lengths and masses to 1 %. Sobol
//! indices say which part of the variance of the lower bob's position is due to which input: *alone* if
//! nothing else varies with it, *with others* if everything does. At first lengths and angles decide, each
//! alone: the position is almost linear in them, so their parts with others sum to 1, and masses do not
//! matter. In the end chaos has mixed everything: these parts sum to more than 2, and the masses, which
//! matter through the motion only, have as large a part as the starts.
//!
//!     cargo run --release --features parallel,progress --example ensemble
//!
//! Where a program is killed it goes on at the next call: the table is written in blocks.

mod common;

use dynamics::ensembles::{EnsembleTable, Samples};
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

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

/// Instants at which the position is kept, and the distance between them in s.
const INSTANTS: usize = 60;
const INTERVAL: f64 = 0.2;

fn main() -> common::Outcome {
    let groups: usize = std::env::args().nth(1).map_or(Ok(256), |text| text.parse())?;
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let start = model.state().theta1(2.0).theta2(1.6).build()?;
    let degree = std::f64::consts::PI / 180.0;
    let samples = Samples::sobol(groups)
        .normal("theta1", start.theta1(), degree)
        .normal("theta2", start.theta2(), degree)
        .normal("l1", model.l1, 0.01 * model.l1)
        .normal("l2", model.l2, 0.01 * model.l2)
        .normal("m1", model.m1, 0.01 * model.m1)
        .normal("m2", model.m2, 0.01 * model.m2);

    let names: Vec<String> = (0..INSTANTS).map(|k| format!("x at {:.1} s [m]", time(k))).collect();
    let names: [&str; INSTANTS] = std::array::from_fn(|k| names[k].as_str());
    let mut files = common::Files::of("ensemble");
    let file = files.path("positions.csv");
    // Written anew by each run of the example; without this line the second one would read it.
    let _ = std::fs::remove_file(&file);
    let ensemble = model.ensemble(start, samples.for_importance());
    let ensemble = ensemble.until(time(INSTANTS - 1)).tolerance(1e-8);
    let ensemble = ensemble.keep(names, |motion| {
        let model = motion.model();
        std::array::from_fn(|k| {
            let state = motion.at(time(k));
            model.l1 * state.theta1().sin() + model.l2 * state.theta2().sin()
        })
    });
    #[cfg(feature = "progress")]
    let ensemble = ensemble.progress();
    let table = ensemble.to(&file).run()?;
    println!("{}", table.report());

    let (early, late) = (&names[2], &names[INSTANTS - 1]);
    let column = |name: &str| name.trim_end_matches(" [m]").to_owned();
    for name in [early, late] {
        println!("{}", table.importance(&column(name))?);
        println!("{}\n", table.quantile(&column(name), 0.95)?);
    }
    let parts = |name: &str| -> Result<[f64; 2], Box<dyn std::error::Error>> {
        let inputs = table.importance(&column(name))?.inputs;
        let masses = inputs.iter().filter(|input| input.input.starts_with('m'));
        Ok([inputs.iter().map(|input| input.total).sum(), masses.map(|input| input.total).sum()])
    };
    let ([first, of_masses], [last, of_masses_last]) = (parts(early)?, parts(late)?);
    println!("parts with others sum to {first:.3} at first, to {last:.3} in the end");
    println!("those of the masses to {of_masses:.4} at first, to {of_masses_last:.3} in the end");
    assert!((first - 1.0).abs() < 0.1 && of_masses < 0.01, "almost linear at first: {first}, {of_masses}");
    assert!(last > 1.5 && of_masses_last > 0.2, "mixed in the end: {last}, {of_masses_last}");

    chart(&table, &names.map(column))?.write_svg(files.path("importance.svg"))?;
    files.list();
    Ok(())
}

fn time(instant: usize) -> f64 {
    INTERVAL * instant as f64
}

/// The parts of the variance over time: of each input with others, and the sum of all inputs alone.
fn chart(table: &EnsembleTable, names: &[String]) -> Result<Chart, Box<dyn std::error::Error>> {
    let found = names.iter().map(|name| table.importance(name)).collect::<Result<Vec<_>, _>>()?;
    let mut with_others =
        Panel::new(Axis::new("t in s"), Axis::new("part of the variance, with others").range(0.0, 1.2));
    for (i, input) in found[0].inputs.iter().enumerate() {
        let points = found.iter().enumerate().map(|(k, of)| (time(k), of.inputs[i].total));
        with_others = with_others.line(&*input.input, points);
    }
    let sum = |(k, of): (usize, &dynamics::ensembles::Importance)| {
        (time(k), of.inputs.iter().map(|input| input.first_order).sum::<f64>())
    };
    let mut alone = Panel::new(Axis::new("t in s"), Axis::new("part of the variance, alone").range(0.0, 1.2));
    for (i, input) in found[0].inputs.iter().enumerate() {
        let points = found.iter().enumerate().map(|(k, of)| (time(k), of.inputs[i].first_order));
        alone = alone.line(&*input.input, points);
    }
    alone = alone.line("all alone", found.iter().enumerate().map(sum));
    Ok(Chart::new("What decides where the lower bob is").panel(with_others).panel(alone))
}
