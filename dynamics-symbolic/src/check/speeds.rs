//! Speeds w = Y(q,t) q̇ + y(q,t): each linear in the velocities, and all of them, together with the
//! constraints that always hold, as many as there are velocities, and independent: then the velocities follow
//! from them, at all but singular places.
//!
//! Rank is asked modulo 2⁶¹ − 31 at a random point: what depends on others there does so everywhere. Where
//! the constraints repeat each other only where they hold, the speeds are looked at beside as many of their
//! rows as are independent there.

use crate::calculus::gradient;
use crate::graph::{Dependence, Fingerprint, Graph, NodeId, Sampler, Symbol};
use crate::mechanics::{Model, Speed};

use super::Finding;
use super::constraints::Analysis;
use super::constraints::contents::FOREIGN;
use super::constraints::exact::{Echelon, Outcome, SparseVector};
use super::constraints::linear::{is_rate, steady_slope};
use super::quadratic::degree_at_most;

/// Speeds that are none, one by one.
pub(super) fn declared(model: &Model, found: &mut Vec<Finding>) {
    for Speed { name, node, origin, .. } in &model.speeds {
        let (name, origin) = (name.clone(), *origin);
        let on = |what| model.graph.dependence(*node).on(what);
        if let Some((_, what, _)) = FOREIGN.into_iter().find(|(what, ..)| on(*what)) {
            let reason = "a speed is made of velocities, coordinates and time";
            found.push(Finding::Contains { role: "speed", name, what, reason, origin });
        } else if !on(Dependence::RATES) {
            found.push(Finding::NoEffect {
                role: "speed",
                name,
                reason: "does not contain any velocity",
                origin,
            });
        } else if !degree_at_most(model, &[*node], 1, &is_rate) && !steady_slope(model, *node) {
            found.push(Finding::SpeedNotLinear { name, origin });
        }
    }
}

/// Speeds that do not determine the velocities.
pub(super) fn together(model: &Model, analysis: &Analysis, found: &mut Vec<Finding>) {
    let Some(first) = model.speeds.first() else { return };
    let (n, speeds, rank) = (model.coordinates.len(), model.speeds.len(), analysis.always.all);
    let needed = n.saturating_sub(rank);
    if speeds != needed {
        return found.push(Finding::SpeedsCount {
            speeds,
            needed,
            coordinates: n,
            rank,
            origin: first.origin,
        });
    }
    let (names, rows) = rows(model);
    let mut echelon = Echelon::default();
    for (k, row) in rows.iter().enumerate() {
        let Outcome::Dependent { coefficients, .. } = echelon.add(k, row, Fingerprint::ZERO) else {
            continue;
        };
        // Rows of constraints that repeat each other are the constraints' own matter.
        let Some(speed) = k.checked_sub(rows.len() - speeds) else { continue };
        let of = coefficients
            .iter()
            .filter(|(other, _)| *other != k)
            .map(|(other, _)| names[*other].clone())
            .collect();
        let (name, origin) = (model.speeds[speed].name.clone(), model.speeds[speed].origin);
        // In general the constraints hold more than where they hold; then what lies in their rows here may be
        // free there.
        if echelon.rank() < rank + speed + 1 {
            return found.push(Finding::SpeedDependent { name, of, origin });
        }
    }
}

/// The names and the gradients by the velocities, at a random point, of the constraints that always hold,
/// then of the speeds.
fn rows(model: &Model) -> (Vec<String>, Vec<SparseVector>) {
    let mut g = model.graph.clone();
    let n = model.coordinates.len() as u32;
    let (mut names, mut nodes) = (Vec::new(), Vec::new());
    let mut differentiate = |g: &mut Graph, node: NodeId, by: fn(u32) -> Symbol| {
        let (symbols, one): (Vec<Symbol>, _) = ((0..n).map(by).collect(), g.one());
        nodes.extend(gradient(g, &[(node, one)], &symbols));
    };
    for constraint in model.constraints.iter().filter(|c| !c.switched) {
        let holonomic = constraint.is_holonomic();
        for (suffix, node) in &constraint.components {
            names.push(format!("{}{suffix}{}", constraint.name, if holonomic { ".dt()" } else { "" }));
            differentiate(&mut g, *node, if holonomic { Symbol::Coordinate } else { Symbol::Rate });
        }
    }
    for speed in &model.speeds {
        names.push(speed.name.clone());
        differentiate(&mut g, speed.node, Symbol::Rate);
    }
    let values = Sampler::new(&g, &nodes).at(0);
    let sparse = |row: &[Fingerprint]| -> SparseVector {
        row.iter().copied().enumerate().filter(|(_, x)| *x != Fingerprint::ZERO).collect()
    };
    (names, values.chunks(n.max(1) as usize).map(sparse).collect())
}
