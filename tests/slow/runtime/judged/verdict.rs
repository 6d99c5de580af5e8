//! What a motion is off by, and what its summary says of it.
#![allow(unreachable_pub, reason = "of one test")]

use std::collections::BTreeMap;
use std::fmt;

use dynamics_runtime::integrate::Method;
use dynamics_runtime::methods::{self, Any};
use dynamics_runtime::model::{ModelState as _, Vector as _};
use dynamics_runtime::simulate::{Motion, Simulate};

use super::models::{Dice, Scene};

/// More tolerances than these are to be told of.
const MUCH: f64 = 10.0;
/// Places of a motion at which its error is looked at.
const PLACES: usize = 16;

/// A motion with its true error, in tolerances.
pub struct Judged {
    pub name: &'static str,
    pub method: String,
    pub by_default: bool,
    pub tolerance: f64,
    pub steps: u64,
    pub evaluations: u64,
    /// Largest true error at the places, and what two references differ by.
    pub error: f64,
    pub uncertain: f64,
    /// What half steps show at most.
    pub shown: f64,
    pub warnings: Vec<String>,
    /// A plain line that tells an error.
    pub told: Option<String>,
}

/// Runs a scene with a random tolerance and method.
pub fn judge<M: Simulate>(scene: &Scene<M>, dice: &mut Dice) -> Option<Judged> {
    let tolerance = dice.power(1e-12, 1e-4);
    let method = if dice.unit() < 0.6 { None } else { named_method(scene.stiff, tolerance, dice) };
    let simulation =
        scene.model.simulate(scene.start).until(scene.until).tolerance(tolerance).max_steps(40_000);
    let simulation = match &method {
        Some(method) => simulation.method(method),
        None => simulation,
    };
    let motion = simulation.run().ok()?;
    let summary = motion.verify();
    let (error, uncertain) = true_error(scene, &motion, tolerance)?;
    let text = summary.to_string();
    let told = text.lines().find(|line| line.contains("global error")).map(str::to_owned);
    Some(Judged {
        name: scene.name,
        method: summary.method.to_string(),
        by_default: method.is_none(),
        tolerance,
        steps: summary.steps,
        evaluations: summary.evaluations,
        error,
        uncertain,
        shown: summary.accuracy.step_doubling_at_most.unwrap_or(f64::NAN),
        warnings: summary.warnings().iter().map(ToString::to_string).collect(),
        told,
    })
}

/// A method by hand, where it does not take too many steps: explicit ones on what is stiff, those of low
/// order and implicit ones at tight tolerances.
fn named_method<M: Simulate>(stiff: bool, tolerance: f64, dice: &mut Dice) -> Option<Any<M>> {
    let choices: [Any<M>; 6] = [
        methods::Dop853.into(),
        methods::Verner9.into(),
        methods::DormandPrince5.into(),
        methods::Tsit5.into(),
        methods::GraggBulirschStoer.into(),
        methods::Radau5.into(),
    ];
    let pick = dice.below(6);
    let too_many_steps = match pick {
        5 => tolerance < 1e-9,
        2 | 3 => stiff && tolerance > 1e-11 || tolerance < 1e-9,
        _ => stiff && tolerance > 1e-11,
    };
    (!too_many_steps).then(|| choices[pick].clone())
}

/// The error of a motion at some of its steps, and what two references differ by, in permitted errors.
fn true_error<M: Simulate>(scene: &Scene<M>, motion: &Motion<'_, M>, tolerance: f64) -> Option<(f64, f64)> {
    let states: Vec<M::State> = motion.steps().collect();
    let last = states.len() - 1;
    let mut picked: Vec<usize> = (1..=PLACES).map(|k| k * last / PLACES).filter(|k| *k > 0).collect();
    picked.dedup();
    let references: [Any<M>; 2] = if scene.stiff {
        [methods::Radau5.into(), methods::Dop853.into()]
    } else if motion.method() == Method::Dop853 {
        [methods::Verner9.into(), methods::GraggBulirschStoer.into()]
    } else {
        [methods::Dop853.into(), methods::GraggBulirschStoer.into()]
    };
    let mut at = [scene.start, scene.start];
    let (mut worst, mut uncertain) = (0.0f64, 0.0f64);
    for index in picked {
        let state = states[index];
        for ((reference, method), tight) in at.iter_mut().zip(&references).zip([1e-13f64, 3e-13]) {
            let tight = if scene.stiff { tight.max(1e-3 * tolerance) } else { tight };
            let run = scene.model.simulate(*reference).until(state.t()).tolerance(tight).max_steps(400_000);
            let run = run.method(method).run().ok()?;
            *reference = run.end();
        }
        worst = worst.max(apart(&state, &at[0], tolerance));
        uncertain = uncertain.max(apart(&at[1], &at[0], tolerance));
    }
    Some((worst, uncertain))
}

/// The largest difference of two states, in permitted errors.
pub fn apart<S: dynamics_runtime::model::ModelState>(a: &S, b: &S, tolerance: f64) -> f64 {
    let pairs = [(a.q(), b.q()), (a.u(), b.u())];
    let pairs = pairs.into_iter().flat_map(|(x, y)| x.as_slice().iter().copied().zip(y.as_slice().to_vec()));
    pairs.map(|(x, y)| (x - y).abs() / (tolerance * (1.0 + x.abs().max(y.abs())))).fold(0.0, f64::max)
}

/// Counts.
#[derive(Clone, Copy, Default)]
pub struct Row {
    pub motions: usize,
    pub beyond: usize,
    pub silent: usize,
    pub alarms: usize,
    /// Told plainly of more than ten tolerances, and within.
    pub overtold: usize,
    pub undecided: usize,
}

/// All motions of a study.
#[derive(Default)]
pub struct Table {
    pub rows: BTreeMap<String, Row>,
    pub errors: Vec<(bool, f64, f64, u64)>,
    /// Sum of the logarithms of evaluations by default, and their count.
    pub cost: (f64, f64),
    pub notes: Vec<String>,
    pub alarms: BTreeMap<String, usize>,
}

impl Judged {
    /// Warnings that say something of the accuracy. That steps are short because a motion is stiff is none.
    fn doubts(&self) -> bool {
        self.warnings.iter().any(|warning| !warning.starts_with("stiff"))
    }
}

impl Table {
    pub fn add(&mut self, seed: u64, judged: Judged) {
        let (beyond, undecided) = (judged.error > MUCH, judged.uncertain > 0.3 * judged.error.max(MUCH));
        let told = judged.told.is_some() || judged.doubts();
        let silent = beyond && !undecided && !told;
        let alarm = !beyond && !undecided && judged.doubts();
        for key in [
            judged.name.to_owned(),
            format!("by {}{}", if judged.by_default { "default: " } else { "" }, judged.method),
            "all".into(),
        ] {
            let row = self.rows.entry(key).or_default();
            row.motions += 1;
            row.undecided += usize::from(undecided);
            row.beyond += usize::from(beyond && !undecided);
            row.silent += usize::from(silent);
            row.alarms += usize::from(alarm);
            row.overtold += usize::from(!beyond && !undecided && judged.told.is_some());
        }
        if judged.by_default {
            self.cost = (self.cost.0 + (judged.evaluations as f64).ln(), self.cost.1 + 1.0);
        }
        if !undecided {
            self.errors.push((judged.by_default, judged.error, judged.shown, judged.steps));
        }
        if alarm {
            for warning in &judged.warnings {
                let words: Vec<&str> = warning.split_whitespace().take(4).collect();
                *self.alarms.entry(words.join(" ")).or_default() += 1;
            }
        }
        if silent || alarm || undecided {
            let what = match (undecided, silent) {
                (true, _) => "undecided",
                (false, true) => "silent",
                (false, false) => "alarm",
            };
            self.notes.push(format!(
                "{what} #{seed} {} by {} at {:.1e}: {:.1} true (± {:.1}), {:.1} shown, {} steps {:?} {:?}",
                judged.name,
                judged.method,
                judged.tolerance,
                judged.error,
                judged.uncertain,
                judged.shown,
                judged.steps,
                judged.warnings,
                judged.told
            ));
        }
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for note in &self.notes {
            writeln!(f, "{note}")?;
        }
        writeln!(
            f,
            "| motions | count | beyond 10 tolerances | of these silent | false alarms | told more than is \
             true | undecided |\n|---|---|---|---|---|---|---|"
        )?;
        for (name, row) in &self.rows {
            writeln!(
                f,
                "| {name} | {} | {} | {} | {} | {} | {} |",
                row.motions, row.beyond, row.silent, row.alarms, row.overtold, row.undecided
            )?;
        }
        writeln!(f, "alarms by kind: {:?}", self.alarms)?;
        writeln!(f, "evaluations by default, geometric mean {:.1}", (self.cost.0 / self.cost.1).exp())?;
        for by_default in [true, false] {
            let mut errors: Vec<f64> =
                self.errors.iter().filter(|e| e.0 == by_default).map(|e| e.1).collect();
            errors.sort_by(f64::total_cmp);
            let at =
                |part: f64| errors.get((part * errors.len() as f64) as usize).copied().unwrap_or(f64::NAN);
            writeln!(
                f,
                "default {by_default}: errors in tolerances, quantiles 25 % {:.2}, 50 % {:.2}, 75 % {:.2}, \
                 90 % {:.1}, 95 % {:.1}",
                at(0.25),
                at(0.5),
                at(0.75),
                at(0.9),
                at(0.95)
            )?;
            let mut ratios: Vec<f64> =
                self.errors.iter().filter(|e| e.0 == by_default && e.1 > 1.0).map(|e| e.2 / e.1).collect();
            ratios.sort_by(f64::total_cmp);
            let at =
                |part: f64| ratios.get((part * ratios.len() as f64) as usize).copied().unwrap_or(f64::NAN);
            writeln!(
                f,
                "  shown over true, of those beyond 1: 2 % {:.2}, 5 % {:.2}, 25 % {:.2}, 50 % {:.2}, 75 % \
                 {:.2}, 95 % {:.2}, 98 % {:.2}",
                at(0.02),
                at(0.05),
                at(0.25),
                at(0.5),
                at(0.75),
                at(0.95),
                at(0.98)
            )?;
        }
        Ok(())
    }
}
