//! Conserved quantities: the energy function, momenta of ignorable coordinates, and of constant combinations
//! of coordinates.
//!
//! ṗ = ∂L/∂q + applied forces = Q + (∂p/∂q)q̇ + ∂p/∂t. A constant vector c with cᵀṗ ≡ 0 makes cᵀp constant;
//! such vectors are the null space of ṗ sampled at random points, modulo 2⁶¹ − 31, and every one is verified
//! by the fingerprint of cᵀṗ. Combinations with parameters as coefficients are not looked for.
//!
//! All this holds between the switches of choices. What decides a choice in L or in the place where a force
//! acts has to be invariant as well, along t for the energy, along c for a momentum: otherwise the quantity
//! may jump where the choice switches. With constraints Φ_q c = 0 as well, and for the energy that none of
//! them moves.

use crate::calculus::{directional, gradient};
use crate::graph::{Dependence, Fingerprint, NodeId, Number, Sampler, Symbol};
use crate::mechanics::{
    ConservedKind, ConservedQuantity, ConstraintEquations, EnergyRole, Equations, ForceTerm, Model, Named,
};

use super::choices::deciders;
use super::constraints::exact::{Echelon, Outcome, SparseVector};
use super::modular::{combination, integers, null_space_of};
use super::units::{Dimension, Exponent, System, Unit};

/// Finds what is conserved, the energy first.
pub fn conserved(model: &mut Model, equations: &Equations) -> Vec<ConservedQuantity> {
    let mut found: Vec<ConservedQuantity> = energy(model, equations).into_iter().collect();
    let rates = momentum_rates(model, equations);
    let mut slopes = choice_slopes(model);
    // The reactions Φ_qᵀλ do not act along directions that no constraint restricts.
    let entries = |row: &Vec<NodeId>| {
        row.iter().copied().enumerate().filter(|(_, x)| !model.graph.is_zero(*x)).collect()
    };
    slopes.extend(equations.constraints.iter().flat_map(|c| c.jacobian.iter().map(entries)));
    for c in constant_directions(model, &rates, &slopes) {
        let names: Vec<&str> = model.coordinates.iter().map(|c| c.name.as_str()).collect();
        let name = format!("momentum of {}", combination(&c, &names));
        let unit = momentum_unit(model, &c);
        let node = combine(model, &c, &equations.momenta);
        // A momentum that is a plain number says nothing.
        if !model.graph.is_constant(node) && !switches_in_time(model, &[node]) {
            let quantity = Named { name, unit, node };
            found.push(ConservedQuantity { kind: ConservedKind::Momentum, quantity });
        }
    }
    found
}

/// dE/dt = Σ powers where neither time nor inputs enter L.
fn energy(model: &mut Model, equations: &Equations) -> Option<ConservedQuantity> {
    let places = places(model);
    let switched = switches_in_time(model, &places);
    let g = &model.graph;
    let power = equations.powers.iter().fold(Fingerprint::ZERO, |sum, p| sum.add(g.fingerprint(p.node)));
    let node = equations.energy_function;
    let open = g.dependence(node).on(Dependence::INPUTS) || driven(model) || switched;
    let moved = |c: &ConstraintEquations| c.velocity_offset.iter().any(|o| !g.is_zero(*o));
    let moved = equations.constraints.as_ref().is_some_and(moved);
    if power != Fingerprint::ZERO || open || moved || g.is_constant(node) {
        return None;
    }
    let natural =
        equations.energies.is_none_or(|(t, v)| g.fingerprint(t).add(g.fingerprint(v)) == g.fingerprint(node));
    let (kind, name) = match natural {
        true => (ConservedKind::Energy, "energy"),
        false => (ConservedKind::EnergyFunction, "energy function"),
    };
    let unit = system(model).map_or(String::new(), |s| Dimension::ENERGY.text(s));
    Some(ConservedQuantity { kind, quantity: Named { name: name.to_owned(), unit, node } })
}

/// Whether an energy contains inputs, so that they do work when they change.
fn driven(model: &Model) -> bool {
    model.energies.iter().any(|e| model.graph.dependence(e.node).on(Dependence::INPUTS))
}

/// T, V, L, and the places where forces act: a jump of theirs is a jump of energy or momentum. Magnitudes may
/// jump.
fn places(model: &Model) -> Vec<NodeId> {
    let energies = model.energies.iter().filter(|e| e.role != EnergyRole::Dissipation).map(|e| e.node);
    let terms = model.forces.iter().flat_map(|f| &f.terms);
    let acted = terms.flat_map(|term| match term {
        ForceTerm::At { point, .. } => point.clone(),
        ForceTerm::Along { expression, .. } => vec![*expression],
    });
    energies.chain(acted).collect()
}

/// Whether time decides a choice, even where it does nothing else.
fn switches_in_time(model: &mut Model, roots: &[NodeId]) -> bool {
    let g = &mut model.graph;
    let deciders = deciders(g, roots);
    let rates = directional(g, &deciders, &mut |g, s| (s == Symbol::Time).then(|| g.one()));
    rates.into_iter().any(|rate| g.fingerprint(rate) != Fingerprint::ZERO)
}

/// Gradients by the coordinates of what decides the choices in L and in the places of forces.
fn choice_slopes(model: &mut Model) -> Vec<Vec<(usize, NodeId)>> {
    let coordinates: Vec<Symbol> = (0..model.coordinates.len() as u32).map(Symbol::Coordinate).collect();
    let places = places(model);
    let g = &mut model.graph;
    let one = g.one();
    let deciders = deciders(g, &places);
    let slopes = |d: NodeId| gradient(g, &[(d, one)], &coordinates).into_iter().enumerate().collect();
    deciders.into_iter().map(slopes).collect()
}

/// ṗ as fingerprints can tell: (Q, transport) per coordinate.
fn momentum_rates(model: &mut Model, equations: &Equations) -> Vec<(NodeId, NodeId)> {
    let transport = directional(&mut model.graph, &equations.momenta, &mut |g, s| match s {
        Symbol::Coordinate(i) => Some(g.symbol(Symbol::Rate(i))),
        Symbol::Time => Some(g.one()),
        _ => None,
    });
    equations.generalized_force.iter().copied().zip(transport).collect()
}

/// Integer vectors c with cᵀṗ ≡ 0 and cᵀs ≡ 0 for the slopes s, by coordinate, of what decides choices and of
/// constraints.
fn constant_directions(
    model: &Model,
    rates: &[(NodeId, NodeId)],
    slopes: &[Vec<(usize, NodeId)>],
) -> Vec<Vec<i64>> {
    let n = rates.len();
    if n == 0 {
        return Vec::new();
    }
    let forces = rates.iter().map(|(q, _)| *q);
    let entries = slopes.iter().flatten().map(|(_, slope)| *slope);
    let nodes: Vec<NodeId> = forces.chain(rates.iter().map(|(_, t)| *t)).chain(entries).collect();
    let sampler = Sampler::new(&model.graph, &nodes);
    let sum = |values: &[Fingerprint]| -> Vec<SparseVector> {
        let momentum = (0..n).map(|i| (i, values[i].add(values[n + i]))).collect();
        let mut slope = values[2 * n..].iter();
        let mut value = |(j, _): &(usize, NodeId)| (*j, *slope.next().expect("a value for every node"));
        let slopes = slopes.iter().map(|row| row.iter().map(&mut value).collect());
        let mut rows: Vec<SparseVector> = core::iter::once(momentum).chain(slopes).collect();
        rows.iter_mut().for_each(|row| row.retain(|(_, x)| *x != Fingerprint::ZERO));
        rows
    };
    let rows = independent_rows(n, &mut |point| sum(&sampler.at(point)));
    if rows.len() == n {
        return Vec::new();
    }
    let values: Vec<Fingerprint> = nodes.iter().map(|id| model.graph.fingerprint(*id)).collect();
    let vanishing = sum(&values);
    let along = |c: &[i64], row: &SparseVector| {
        let term =
            |(j, value): &(usize, Fingerprint)| Fingerprint::number(Number::integer(c[*j])).mul(*value);
        row.iter().map(term).fold(Fingerprint::ZERO, Fingerprint::add)
    };
    let verified = |c: &Vec<i64>| vanishing.iter().all(|row| along(c, row) == Fingerprint::ZERO);
    let sparse = rows.into_iter().map(|row| row.into_iter().collect()).collect();
    null_space_of(sparse, n).iter().filter_map(|v| integers(v)).filter(verified).collect()
}

/// Independent rows among those of as many random points as it takes: at most n have something new, and after
/// two without nothing else comes.
fn independent_rows(n: usize, rows: &mut dyn FnMut(u64) -> Vec<SparseVector>) -> Vec<SparseVector> {
    let (mut echelon, mut found, mut idle) = (Echelon::default(), Vec::new(), 0);
    for point in 0..n as u64 + 2 {
        let before = found.len();
        for row in rows(point) {
            if echelon.add(found.len(), &row, Fingerprint::ZERO) == Outcome::Independent {
                found.push(row);
            }
        }
        idle = if found.len() > before { 0 } else { idle + 1 };
        if found.len() == n || idle == 2 {
            break;
        }
    }
    found
}

fn combine(model: &mut Model, c: &[i64], momenta: &[NodeId]) -> NodeId {
    let g = &mut model.graph;
    let mut sum = g.zero();
    for (c, p) in c.iter().zip(momenta) {
        let factor = g.integer(*c);
        let term = g.mul(factor, *p);
        sum = g.add(sum, term);
    }
    sum
}

/// The system of units that a model is written in; `None` where it declares no units.
pub(super) fn system(model: &Model) -> Option<System> {
    let texts = model.coordinates.iter().map(|c| &c.unit).chain(model.parameters.iter().map(|p| &p.unit));
    let mut declared = texts.chain(model.inputs.iter().map(|i| &i.unit)).filter(|t| !t.is_empty()).peekable();
    declared.peek()?;
    let own = declared.filter_map(|t| Unit::parse(t).ok().flatten()?.system).next();
    Some(own.unwrap_or(System::Si))
}

/// The unit of powers, empty where the model declares no units.
#[must_use]
pub fn power_unit(model: &Model) -> String {
    system(model).map_or(String::new(), |s| Dimension::POWER.text(s))
}

/// Energy·time over the coordinate's unit, where units are known and the combination has one.
fn momentum_unit(model: &Model, c: &[i64]) -> String {
    let Some(system) = system(model) else { return String::new() };
    let mut dimensions = c.iter().zip(&model.coordinates).filter(|(c, _)| **c != 0).map(|(_, q)| {
        if q.unit.is_empty() {
            Some(Dimension::ONE)
        } else {
            Unit::parse(&q.unit).ok().flatten().map(|u| u.dimension)
        }
    });
    let Some(Some(first)) = dimensions.next() else { return String::new() };
    if !dimensions.all(|d| d == Some(first)) {
        return String::new();
    }
    let action = Dimension::mechanical(2, 1, -1);
    let per = first.pow(Exponent::integer(-1)).and_then(|d| action.mul(&d));
    per.map_or(String::new(), |d| d.text(system))
}
