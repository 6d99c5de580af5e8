//! What the engine's interpreter says of a model, beside what was emitted: the same equations, neither
//! scheduled nor written as Rust, and solved densely.

use std::collections::BTreeMap;

use crate::compare::{EXACT, Judge, SOLVED};
use crate::states::Point;
use crate::{Emitted, Slopes, Subject};

/// Values at one state, each with what rounding in the state does to it.
pub(crate) struct Interpreted {
    pub(crate) at: Point,
    /// Only along the constraints are M, Q and p those of the model's own functions.
    pub(crate) is_tangential: bool,
    quantities: BTreeMap<String, Vec<(f64, f64)>>,
}

/// Reads what stands in the glue; see `src/interpret.rs`.
pub(crate) fn read(text: &str) -> Vec<Interpreted> {
    let number = |text: &str| text.parse::<f64>().unwrap_or(f64::NAN);
    let list = |text: &str| text.split_whitespace().map(number).collect::<Vec<f64>>();
    let mut states: Vec<Interpreted> = Vec::new();
    for line in text.lines() {
        let (name, rest) = line.split_once(' ').unwrap_or((line, ""));
        if name == "state" {
            let mut parts = rest.split('|').map(list);
            let mut next = || parts.next().unwrap_or_default();
            let t = next().first().copied().unwrap_or(f64::NAN);
            let at = Point { t, q: next(), u: next(), inputs: next() };
            states.push(Interpreted { at, is_tangential: false, quantities: BTreeMap::new() });
        } else if let (Some(state), "tangential") = (states.last_mut(), name) {
            state.is_tangential = true;
        } else if let Some(state) = states.last_mut() {
            let pair = |text: &str| text.split_once('~').map(|(value, noise)| (number(value), number(noise)));
            state.quantities.insert(name.to_owned(), rest.split_whitespace().filter_map(pair).collect());
        }
    }
    states
}

/// An interpreted value is off by this many times what rounding in the state does to it.
const NOISES: f64 = 30.0;

impl Judge<'_> {
    /// Everything that was emitted at a state.
    pub(crate) fn beside_interpreter(&mut self, emitted: &Emitted, interpreted: &Interpreted) {
        let before = self.report.made;
        self.route = "by the interpreter";
        let energy = [emitted.energy];
        let mut pairs: Vec<(&str, &[f64], f64)> = vec![
            ("mass", &emitted.mass, EXACT),
            ("momenta", &emitted.momenta, EXACT),
            ("energy", &energy, EXACT),
            ("residual", &emitted.residual, EXACT),
            ("rates", &emitted.rates, EXACT),
            ("jacobian", &emitted.jacobian, EXACT),
            ("gamma", &emitted.gamma, EXACT),
        ];
        if let Ok((accelerations, multipliers)) = &emitted.solved {
            pairs.push(("accelerations", accelerations, SOLVED));
            pairs.push(("unrolled", accelerations, SOLVED));
            pairs.push(("multipliers", multipliers, SOLVED));
            pairs.push(("outputs", &emitted.outputs, SOLVED));
            pairs.push(("events", &emitted.events, SOLVED));
        }
        if emitted.solved.is_ok() || self.shape.rows == 0 {
            // Of forces that contain reactions these are sums, too.
            pairs.push(("force", &emitted.force, EXACT));
            pairs.push(("powers", &emitted.powers, EXACT));
        }
        for (name, values, tolerance) in pairs {
            self.quantity(name, values, interpreted, tolerance);
        }
        self.route = OWN;
        self.report.by_interpreter += self.report.made - before;
    }

    /// The derivatives of the accelerations.
    pub(crate) fn slopes_beside_interpreter(&mut self, model: &dyn Subject, interpreted: &Interpreted) {
        let Some(Slopes { by_q, by_u, by_input, by_parameter }) = model.slopes(&interpreted.at) else {
            return;
        };
        let before = self.report.made;
        self.route = "by the interpreter";
        for (name, values) in
            [("by_q", &by_q), ("by_u", &by_u), ("by_input", &by_input), ("by_parameter", &by_parameter)]
        {
            self.quantity(name, values, interpreted, SOLVED);
        }
        self.route = OWN;
        self.report.by_interpreter += self.report.made - before;
    }

    fn quantity(&mut self, name: &str, emitted: &[f64], interpreted: &Interpreted, tolerance: f64) {
        // What the engine does not have it did not emit either, or it is the general solver's.
        let Some(own) = interpreted.quantities.get(name) else { return };
        if emitted.len() != own.len() {
            let finding = format!("{name}: {} are emitted, the interpreter has {}", emitted.len(), own.len());
            self.report.findings.push(finding);
            return;
        }
        let scale = own.iter().map(|(value, _)| value.abs()).filter(|x| x.is_finite()).fold(0.0, f64::max);
        for (i, (emitted, (own, noise))) in emitted.iter().zip(own).enumerate() {
            if own.is_nan() {
                // Not determined: a multiplier of rows that repeat each other, and what is made of it.
                self.report.undecided += 1;
                continue;
            }
            self.near(&format!("{name} [{i}]"), *emitted, *own, scale, tolerance, NOISES * noise);
        }
    }
}

/// How the second route is called in findings.
pub(crate) const OWN: &str = "by its own functions";
