//! Every direction that the constraints leave free has inertia: M is positive definite on the null space of
//! Φ_q and A.
//!
//! A coordinate without inertia is no mistake where the constraints determine its acceleration, nor is
//! negative inertia of a part that is taken away from a body that it is fixed to.

use crate::check::Finding;
use crate::check::inertia::{involved, named};
use crate::check::modular::{combination, integers, null_space};
use crate::check::unused::Reads;
use crate::graph::{Fingerprint, NodeId, Sampler, Symbol};
use crate::mechanics::{ConstraintEquations, EnergyRole, Equations, Model};

use super::analysis::Analysis;
use super::exact::{Echelon, SparseVector};
use super::manifold::evaluate;
use super::orthogonal::Basis;
use super::sample::Sample;
use crate::check::finding::ConstraintFinding;

/// Free directions without inertia or with a negative one.
pub(in crate::check) fn inertia(
    model: &Model,
    equations: &Equations,
    analysis: &Analysis,
    found: &mut Vec<Finding>,
) {
    let Some(constraints) = &equations.constraints else { return };
    let before = found.len();
    in_every_state(model, equations, constraints, found);
    if found.len() == before {
        where_they_hold(model, equations, constraints, analysis, found);
    }
}

/// M and Φ_q above each other have full rank in general; with them [M −Φ_qᵀ; Φ_q 0] has that of M and Φ_q,
/// unless M is indefinite.
fn in_every_state(
    model: &Model,
    equations: &Equations,
    constraints: &ConstraintEquations,
    found: &mut Vec<Finding>,
) {
    let n = model.coordinates.len();
    // M, then Φ_q: (column, entry) by rows, without zeros.
    let entries = |row: &Vec<NodeId>| -> Vec<(usize, NodeId)> {
        row.iter().copied().enumerate().filter(|(_, x)| !model.graph.is_zero(*x)).collect()
    };
    let rows: Vec<Vec<(usize, NodeId)>> =
        equations.mass_matrix.iter().chain(&constraints.jacobian).map(entries).collect();
    let nodes: Vec<NodeId> = rows.iter().flatten().map(|(_, x)| *x).collect();
    let sampler = Sampler::new(&model.graph, &nodes);
    let at = |point: u64| -> Vec<SparseVector> {
        let mut values = sampler.at(point).into_iter();
        let mut value = |(j, _): &(usize, NodeId)| (*j, values.next().expect("a value for every node"));
        let mut row = |row: &Vec<(usize, NodeId)>| {
            row.iter().map(&mut value).filter(|(_, x)| *x != Fingerprint::ZERO).collect()
        };
        rows.iter().map(&mut row).collect()
    };
    let here = at(0);
    if rank(here.iter().cloned()) == n {
        // Row i of M with column i of Φ_q behind it: n + rank Φ_q, where the free directions have inertia.
        let mut upper = here[..n].to_vec();
        for (r, row) in here[n..].iter().enumerate() {
            row.iter().for_each(|(i, x)| upper[*i].push((n + r, *x)));
        }
        let whole = rank(upper.into_iter().chain(here[n..].iter().cloned()));
        let held = rank(here[n..].iter().cloned());
        if whole < n + held {
            let direction =
                format!("a combination of {}", named(model, |i| !slopes_are_zero(model, constraints, i)));
            let origins = involved(model, |i| !slopes_are_zero(model, constraints, i));
            found.push(Finding::Constraint(ConstraintFinding::FreeWithoutInertia { direction, origins }));
        }
        return;
    }
    let dense = |row: SparseVector| {
        let mut all = vec![Fingerprint::ZERO; n];
        row.into_iter().for_each(|(j, x)| all[j] = x);
        all
    };
    let everywhere = null_space((0..3).flat_map(at).map(dense).collect(), n);
    let constant: Vec<Vec<i64>> = everywhere.iter().filter_map(|v| integers(v)).collect();
    let names: Vec<&str> = model.coordinates.iter().map(|c| c.name.as_str()).collect();
    let mut report = |direction: String, origins| {
        found.push(Finding::Constraint(ConstraintFinding::FreeWithoutInertia { direction, origins }));
    };
    for direction in &constant {
        report(combination(direction, &names), involved(model, |i| direction[i] != 0));
    }
    let here = null_space(here.into_iter().map(dense).collect(), n);
    if constant.len() < here.len() {
        let varying =
            |i: usize| !constant.iter().any(|c| c[i] != 0) && here.iter().any(|v| v[i] != Fingerprint::ZERO);
        let text = format!("a combination of {} that depends on state or parameters", named(model, varying));
        report(text, involved(model, varying));
    }
}

fn slopes_are_zero(model: &Model, constraints: &ConstraintEquations, i: usize) -> bool {
    constraints.jacobian.iter().all(|row| model.graph.is_zero(row[i]))
}

fn rank(rows: impl Iterator<Item = SparseVector>) -> usize {
    let mut echelon = Echelon::default();
    rows.enumerate().for_each(|(i, row)| drop(echelon.add(i, &row, Fingerprint::ZERO)));
    echelon.rank()
}

/// Component of a direction, relative to its largest, up to which a coordinate counts as at rest.
const AT_REST: f64 = 1e-6;

/// The same in numbers, at states in which the constraints hold: there Φ_q may have a lower rank than in
/// general. And no free direction has negative inertia.
fn where_they_hold(
    model: &Model,
    equations: &Equations,
    constraints: &ConstraintEquations,
    analysis: &Analysis,
    found: &mut Vec<Finding>,
) {
    // The sign of a Lagrangian given directly is the user's own affair: −L has the same motions.
    let direct = model.energies.iter().any(|e| e.role == EnergyRole::Lagrangian);
    let worst = |s: &Sample| least_inertia(model, equations, constraints, analysis, s);
    let Some(all) =
        analysis.samples.iter().map(worst).collect::<Option<Vec<_>>>().filter(|all| !all.is_empty())
    else {
        return;
    };
    let names = |direction: &[f64]| -> Vec<bool> {
        let largest = direction.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        direction.iter().map(|x| x.abs() > AT_REST * largest).collect()
    };
    let moves: Vec<bool> =
        all.iter().map(|(_, d)| names(d)).fold(vec![false; model.coordinates.len()], |sum, d| {
            sum.iter().zip(d).map(|(a, b)| *a || b).collect()
        });
    let many = moves.iter().filter(|m| **m).count() > 1;
    let list = named(model, |i| moves[i]);
    let direction = if many { format!("a combination of {list}") } else { list };
    let origins = involved(model, |i| moves[i]);
    if all.iter().all(|(ratio, _)| ratio.abs() < ABSENT_INERTIA) {
        found.push(Finding::Constraint(ConstraintFinding::FreeWithoutInertia { direction, origins }));
    } else if !direct && all.iter().all(|(ratio, _)| *ratio < -ABSENT_INERTIA) {
        let nominal = is_given(model, equations);
        if nominal || has_negative_element(model, equations, &analysis.samples, &moves) {
            found.push(Finding::NegativeInertia { direction, nominal, origins });
        }
    }
}

/// Whether there are nominal values of all parameters that M reads. Others are guessed, and what was guessed
/// of an inertia matrix is rarely one of a body.
fn is_given(model: &Model, equations: &Equations) -> bool {
    let mass: Vec<NodeId> = equations.mass_matrix.iter().flatten().copied().collect();
    let reads = Reads::of(model, &mass);
    let given = |i: u32| model.nominal.iter().any(|(p, _)| *p == i);
    (0..model.parameters.len() as u32).all(|i| given(i) || !reads.symbol(Symbol::Parameter(i)))
}

/// How often parameters without nominal values are guessed. Only an element that is negative every time is
/// reported, so that more guesses make false reports rarer.
const PARAMETER_GUESSES: u64 = 8;

/// Whether one of the coordinates that move has a negative element on the diagonal of M, however positive
/// parameters are guessed: then a sign is wrong.
fn has_negative_element(model: &Model, equations: &Equations, samples: &[Sample], moves: &[bool]) -> bool {
    let diagonal: Vec<NodeId> = equations.mass_matrix.iter().enumerate().map(|(i, row)| row[i]).collect();
    let guesses = samples.iter().flat_map(|sample| {
        (0..PARAMETER_GUESSES)
            .map(|attempt| Sample { parameters: Sample::parameters(model, attempt), ..sample.clone() })
    });
    let all: Vec<Vec<f64>> = guesses.map(|guess| evaluate(&model.graph, &guess, &diagonal)).collect();
    (0..moves.len()).any(|i| moves[i] && all.iter().all(|values| values[i] < 0.0))
}

/// Ratio of a pivot of NᵀMN to the largest element of M up to which a direction has no inertia. It lies
/// above the error of states on the manifold, 1e-12.
const ABSENT_INERTIA: f64 = 1e-11;

/// The least pivot of NᵀMN relative to the largest element of M, N an orthonormal basis of the free
/// directions, and its direction; `None` where nothing is free, or a pivot is not a number, as where M
/// contains the root of what is negative there.
fn least_inertia(
    model: &Model,
    equations: &Equations,
    constraints: &ConstraintEquations,
    analysis: &Analysis,
    sample: &Sample,
) -> Option<(f64, Vec<f64>)> {
    let n = model.coordinates.len();
    let mass: Vec<NodeId> = equations.mass_matrix.iter().flatten().copied().collect();
    let m = evaluate(&model.graph, sample, &mass);
    let slopes: Vec<NodeId> = constraints.jacobian.iter().flatten().copied().collect();
    let slopes = evaluate(&model.graph, sample, &slopes);
    let mut basis = Basis::default();
    for (r, row) in slopes.chunks(n.max(1)).enumerate().filter(|(r, _)| !analysis.superfluous.contains(r)) {
        basis.add(r, row);
    }
    let free = basis.complement(n);
    let largest = m.iter().fold(0.0f64, |l, x| l.max(x.abs()));
    if free.is_empty() || !largest.is_finite() || largest == 0.0 || slopes.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let times = |v: &[f64]| -> Vec<f64> { m.chunks(n).map(|row| dot(row, v)).collect() };
    // Gram–Schmidt in the metric M: each direction without its part along those before.
    let mut done: Vec<(Vec<f64>, Vec<f64>, f64)> = Vec::new();
    let mut least = (f64::INFINITY, Vec::new());
    for v in free {
        let mut own = v;
        for (w, mw, square) in &done {
            let along = dot(&own, mw) / square;
            own.iter_mut().zip(w).for_each(|(x, y)| *x -= along * y);
        }
        let image = times(&own);
        let square = dot(&own, &image);
        let ratio = square / (largest * dot(&own, &own));
        if ratio.is_nan() {
            return None;
        }
        if ratio < least.0 {
            least = (ratio, own.clone());
        }
        if ratio.abs() > ABSENT_INERTIA {
            done.push((own, image, square));
        }
    }
    Some(least)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
