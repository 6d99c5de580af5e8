//! Error against cost, as a table and as a chart.

use std::time::Instant;

use dynamics::prelude::*;

use crate::problems::Problem;

/// Runs of one setting; the fastest counts.
const ROUNDS: usize = 7;

/// One run: what it cost and how far from the reference it ended.
pub(crate) struct Run {
    pub(crate) evaluations: f64,
    pub(crate) microseconds: f64,
    pub(crate) error: f64,
}

/// The runs of one solver on one problem, from coarse to fine.
pub(crate) struct Curve {
    pub(crate) solver: &'static str,
    pub(crate) runs: Vec<Run>,
}

impl Curve {
    /// (evaluations, µs) at which the curve reaches an error: between its two nearest runs on logarithmic scales.
    fn cost(&self, error: f64) -> Option<(f64, f64)> {
        let pair = self.runs.windows(2).find(|pair| pair[0].error >= error && pair[1].error < error)?;
        let part = (pair[0].error / error).ln() / (pair[0].error / pair[1].error).ln();
        let between = |x: f64, y: f64| x * (y / x).powf(part);
        Some((between(pair[0].evaluations, pair[1].evaluations), between(pair[0].microseconds, pair[1].microseconds)))
    }
}

/// Tolerances from coarse to fine.
pub(crate) fn tolerances() -> impl Iterator<Item = f64> {
    (2..=14).map(|k| 10f64.powi(-k))
}

/// Largest |difference| of (q, u) from the reference.
pub(crate) fn distance(end: [f64; 4], reference: [f64; 4]) -> f64 {
    end.iter().zip(reference).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

/// Times a solver that returns its evaluations and where it ended.
pub(crate) fn measure(reference: [f64; 4], solve: impl Fn() -> (u64, [f64; 4])) -> Run {
    let mut microseconds = f64::INFINITY;
    let mut result = (0, [f64::NAN; 4]);
    for _ in 0..ROUNDS {
        let clock = Instant::now();
        result = solve();
        microseconds = microseconds.min(clock.elapsed().as_secs_f64() * 1e6);
    }
    Run { evaluations: result.0 as f64, microseconds, error: distance(result.1, reference) }
}

/// The three methods of this crate.
pub(crate) fn methods<M: Simulate>(problem: &Problem<M>) -> Vec<Curve>
where
    M::Vector: Into<[f64; 2]>,
{
    let Problem { model, start, end, reference, halvings: (coarse, fine), .. } = problem;
    let run = |method: &methods::Any<M>, setting: f64| {
        let simulation = || {
            let simulation = model.simulate(*start).until(*end).method(method);
            if method.is_adaptive() { simulation.tolerance(setting) } else { simulation.fixed_step(setting) }
        };
        measure(*reference, || {
            let motion = simulation().run().expect("a regular problem");
            let ([q1, q2], [u1, u2]) = ((*motion.end().q()).into(), (*motion.end().u()).into());
            (motion.counts().evaluations, [q1, q2, u1, u2])
        })
    };
    let steps = (*coarse..=*fine).map(|k| end / 2f64.powi(k));
    vec![
        Curve { solver: "RK4, fixed steps", runs: steps.map(|h| run(&methods::Rk4.into(), h)).collect() },
        Curve {
            solver: "Dormand–Prince 5(4)",
            runs: tolerances().map(|e| run(&methods::DormandPrince5.into(), e)).collect(),
        },
        Curve { solver: "DOP853", runs: tolerances().map(|e| run(&methods::Dop853.into(), e)).collect() },
    ]
}

/// Prints what each solver needs for some errors and adds a panel of its curves.
pub(crate) fn report(chart: Chart, problem: &str, curves: &[Curve]) -> Chart {
    let errors = [1e-2, 1e-4, 1e-6, 1e-8];
    println!("\n{problem}: evaluations and µs to an error of");
    println!("{:28}{}", "", errors.map(|e| format!("{e:>20.0e}")).concat());
    for curve in curves {
        let cells = errors.map(|error| match curve.cost(error) {
            Some((evaluations, microseconds)) => format!("{evaluations:>10.0}{microseconds:>10.1}"),
            None => format!("{:>20}", "–"),
        });
        println!("{:28}{}", curve.solver, cells.concat());
    }
    let panel = Panel::new(Axis::log(format!("time in µs: {problem}")), Axis::log("error"));
    let line = |panel: Panel, curve: &Curve| {
        panel.curve(curve.solver, curve.runs.iter().map(|run| (run.microseconds, run.error)))
    };
    chart.panel(curves.iter().fold(panel, line))
}
