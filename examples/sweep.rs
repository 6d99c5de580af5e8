//! When does a double pendulum first flip? A picture over all angles from which it is released, with one run
//! for each point.
//!
//! A rod flips when it passes the top. Released at rest, none can flip if the energy does not suffice even
//! for the lower rod, which needs less: 2 cos θ₁ + cos θ₂ > 1 for equal bobs and rods. Outside of this
//! region the time is sensitive to the start (J. S. Heyl, *The Double Pendulum Fractal*, 2008, of uniform
//! bars). Each run ends with its first flip or after 10 s. Only the ends are wanted, so each core makes many
//! runs side by side (`.ends(..)`). With the feature `parallel` the grid is shared by all cores, and the
//! picture is the same for any number of them:
//!
//!     cargo run --release --features parallel,progress --example sweep -- 317
//!
//! makes 317 × 317 = 100,489 runs. It then runs a part of them on one core and says how much faster all
//! cores were.

mod common;
use std::f64::consts::PI;
use std::fmt::Write;

use dynamics::prelude::*;
use dynamics::simulate::Simulation;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta1: rad, theta2: rad)]
#[units(m: kg, l: m, g: m / s^2)]
struct DoublePendulum {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl DoublePendulum {
    fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l * vec2(q.theta1.sin(), -q.theta1.cos())
    }
    fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob1(q) + self.l * vec2(q.theta2.sin(), -q.theta2.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (self.bob1(q).dt().norm_squared() + self.bob2(q).dt().norm_squared())
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * (self.bob1(q).y + self.bob2(q).y)
    }
}

/// Longest run.
const LONGEST: f64 = 10.0;

/// A run ends where one of the angles reaches ±π.
fn to_first_flip<'m>(
    _: &'m DoublePendulum,
    run: Simulation<'m, DoublePendulum>,
) -> Simulation<'m, DoublePendulum> {
    run.until(LONGEST)
        .tolerance(1e-6)
        .event("upper", |state| state.theta1().powi(2) - PI * PI)
        .stop_at("upper", Direction::Rising)
        .event("lower", |state| state.theta2().powi(2) - PI * PI)
        .stop_at("lower", Direction::Rising)
}

/// When a run has flipped; infinite where it has not.
fn flip(_: &DoublePendulum, end: State<DoublePendulum>) -> [f64; 1] {
    [if end.t() < LONGEST { end.t() } else { f64::INFINITY }]
}

fn main() -> common::Outcome {
    let across: u32 = std::env::args().nth(1).map_or(Ok(100), |text| text.parse())?;
    let angle = |k: u32| PI * (f64::from(2 * k + 1) - f64::from(across)) / f64::from(across);
    let model = DoublePendulum { m: 1.0, l: 1.0, g: 9.81 };
    let sweep = model.sweep(model.state().build()?);
    let sweep = sweep.over("theta2", (0..across).rev().map(angle)).over("theta1", (0..across).map(angle));
    #[cfg(feature = "progress")]
    let sweep = sweep.progress();
    let begun = std::time::Instant::now();
    let sweep = sweep.ends(["flip"], to_first_flip, flip)?;
    let (runs, taken) = (sweep.results.len(), begun.elapsed().as_secs_f64());
    println!("{runs} runs in {taken:.2} s, {:.0} per second", runs as f64 / taken);

    let mut times = Vec::new();
    for (k, result) in sweep.results.iter().enumerate() {
        let [flip] = result.as_ref().map_err(Clone::clone)?;
        let [theta2, theta1] = sweep.at(k)[..] else { return Err("two axes".into()) };
        let bound = 2.0 * theta1.cos() + theta2.cos() > 1.0;
        assert!(
            !bound || flip.is_infinite(),
            "no energy to flip from {theta1}, {theta2}, and it does at {flip}"
        );
        times.push(*flip);
    }
    let flipped = times.iter().filter(|t| t.is_finite()).count();
    println!("{flipped} flip within {LONGEST} s, none of those that have not the energy");
    // Let go from the mirrored place, it moves as in the mirror.
    let differ = (0..runs).filter(|k| times[*k] != times[runs - 1 - *k]).count();
    println!("{differ} differ from their mirror image");
    assert!(differ == 0, "{differ} differ from their mirror image");

    #[cfg(feature = "parallel")]
    scaling(&model, across.clamp(20, 120))?;

    let mut files = common::Files::of("sweep");
    sweep.write_csv(files.path("flips.csv"))?;
    std::fs::write(files.path("flips.html"), page(&times, across))?;
    files.list();
    Ok(())
}

/// How many times faster all cores are than one, each measured three times on a grid of its own; and that
/// both write the same bytes.
#[cfg(feature = "parallel")]
fn scaling(model: &DoublePendulum, across: u32) -> common::Outcome {
    let cores = std::thread::available_parallelism()?.get();
    let angles = || (0..across).map(|k| PI * (f64::from(2 * k + 1) / f64::from(across) - 1.0));
    let with = |threads: usize| -> Result<(f64, String), Box<dyn std::error::Error>> {
        let mut best = (f64::INFINITY, String::new());
        for _ in 0..3 {
            let sweep = model.sweep(model.state().build()?).over("theta2", angles()).over("theta1", angles());
            let begun = std::time::Instant::now();
            let sweep = sweep.threads(threads).ends(["flip"], to_first_flip, flip)?;
            let taken = begun.elapsed().as_secs_f64();
            if taken < best.0 {
                best = (taken, sweep.to_csv());
            }
        }
        Ok(best)
    };
    let ((one, alone), (all, shared)) = (with(1)?, with(cores)?);
    assert!(alone == shared, "one core and {cores} write the same bytes");
    let (runs, times) = (across * across, one / all);
    let part = 100.0 * times / cores as f64;
    println!(
        "{runs} runs: {one:.3} s on one core, {all:.3} s on {cores}, {times:.2} times as fast ({part:.0} % \
         of {cores}), the same bytes"
    );
    Ok(())
}

/// Dark early, light late, white never: a cell for each start.
fn page(times: &[f64], across: u32) -> String {
    let shades = ["#26185f", "#3b4a8f", "#2f7b8e", "#27a67f", "#8fcb3f", "#f4df53"];
    let edges = [1.0, 1.5, 2.2, 3.5, 5.5, LONGEST];
    let mut cells = String::new();
    for (row, line) in times.chunks(across as usize).enumerate() {
        let shade = |t: &f64| edges.iter().position(|edge| t <= edge);
        let mut from = 0;
        while from < line.len() {
            let of = shade(&line[from]);
            let count = line[from..].iter().take_while(|t| shade(t) == of).count();
            if let Some(of) = of {
                let _ =
                    write!(cells, "<path d=\"M{from} {row}h{count}v1h-{count}z\" fill=\"{}\"/>", shades[of]);
            }
            from += count;
        }
    }
    let mut legend = String::new();
    let mut before = 0.0;
    for (shade, edge) in shades.iter().zip(edges) {
        let _ = write!(legend, "<span><i style=\"background:{shade}\"></i>{before}–{edge} s</span>");
        before = edge;
    }
    format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>First flips of a double \
         pendulum</title><style>\
         body{{font:16px/1.5 system-ui,'Segoe UI','DejaVu Sans',Arial,sans-serif;max-width:720px;\
         margin:1em auto;padding:0 1em;color:#222;background:#fff}}\
         svg{{width:100%;border:1px solid #999}}\
         i{{display:inline-block;width:1em;height:1em;margin:0 .3em 0 0;vertical-align:-.15em}}\
         span{{white-space:nowrap;margin-right:1em}}p.axis{{text-align:center;margin:.3em}}</style>\
         <h1>First flips of a double pendulum</h1>\
         <p>Let go at rest: θ₁ to the right, θ₂ upwards, both from −π to π. \
         White: no flip within {LONGEST} s.</p>\
         <svg viewBox=\"0 0 {across} {across}\" shape-rendering=\"crispEdges\" role=\"img\" \
         aria-label=\"time to the first flip\">{cells}</svg>\
         <p class=\"axis\">θ₁ from −π to π</p><p>{legend}</p></html>\n"
    )
}
