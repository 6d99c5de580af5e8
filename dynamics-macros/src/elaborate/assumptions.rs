//! Assumptions of the equations about bodies and frames: masses that are not negative, inertia that a body
//! can have, matrices that rotate or mirror.
//!
//! Assumptions about numbers are checked here, at nominal values too. Those that hold for all values
//! (rotations by angles, Euler parameters with a norm constraint, inertia of solids) are not checked again.
//! The rest is emitted for the runtime, which checks them at starts and names the values that they contain.

use std::collections::BTreeSet;
use std::rc::Rc;

use dynamics_symbolic::graph::{Bindings, Dependence, FunctionId, Node, NodeId, Symbol};
use dynamics_symbolic::mechanics::{Assumption, AssumptionKind};
use syn::Ident;

use super::Elaborator;
use super::calls::Argument;
use super::rotations::Rows;
use super::values::{Scalar, Value};
use crate::diagnostics::Place;
use crate::messages::{self, Message};
use crate::syntax::Role;

/// An assumption before all constraints are read.
#[derive(Clone, Debug)]
pub(super) struct NotedAssumption {
    assumption: Assumption,
    /// Euler parameters by whose norm it holds.
    by_norm: Option<[Scalar; 4]>,
}

/// Assumptions of bodies and frames, and the inertias of solids.
#[derive(Clone, Debug, Default)]
pub(super) struct Assumptions {
    noted: Vec<NotedAssumption>,
    solids: BTreeSet<Vec<NodeId>>,
}

/// Errors of rounding, relative to the largest element, up to which an inertia matrix is symmetric and a
/// rotation orthonormal. It equals `ROUNDING` of `dynamics_vocabulary::mass_properties`.
const ROUNDING: f64 = 1e-9;
/// Largest excess of a principal moment over the sum of the others, relative to the largest element. Thin
/// plates have none, and data of six digits miss that by their last. As in
/// `dynamics_vocabulary::mass_properties`.
const THIN_PLATE_EXCESS: f64 = 1e-5;
/// Largest element of RᵀR − 1 with which a matrix is orthonormal at one of the [`TRIALS`]: rounding of a
/// product of some rotations.
const ORTHONORMAL: f64 = 1e-12;
/// Random states and parameters at which a matrix has to be orthonormal to count as orthonormal everywhere.
/// No other matrix is so by chance.
const TRIALS: u64 = 4;

impl Elaborator<'_> {
    /// What a call of the library takes for granted of its arguments.
    pub(super) fn note_assumptions(
        &mut self,
        record: &str,
        function: &Ident,
        arguments: &[Argument],
        value: &Value,
    ) {
        // What the library does with what it was given is noted where it was given.
        if self.frame().of.is_some() {
            return;
        }
        let energetic = ["kinetic_energy", "potential_energy", "momentum", "angular_momentum"];
        match (record, function.to_string().as_str()) {
            ("Frame", "new" | "turned" | "frame") => {
                if let Some((Value::Matrix(rotation), place)) = arguments.last() {
                    self.note_rotation(rotation, *place);
                }
            }
            ("RigidBody" | "PlanarBody", name) if energetic.contains(&name) => {
                let Some((Value::Record(body), place)) = arguments.first() else { return };
                if let Value::Scalar(mass) = &body.fields[0] {
                    self.note(AssumptionKind::Mass, vec![mass.node], *place);
                }
                match &body.fields[2] {
                    Value::Scalar(moment) => self.note(AssumptionKind::Moment, vec![moment.node], *place),
                    Value::Matrix(inertia) => self.note_inertia(inertia, *place),
                    _ => {}
                }
            }
            // Rows on rotations that are regular at one attitude are zero at another, too.
            ("Joint", "weld") if self.holds_always() => {
                let frame = |(value, _): &Argument| match value {
                    Value::Record(frame) => match &frame.fields[1] {
                        Value::Matrix(rotation) => nodes(rotation),
                        _ => Vec::new(),
                    },
                    _ => Vec::new(),
                };
                let both: Vec<NodeId> = arguments.iter().flat_map(frame).collect();
                if let (18, Some((_, place))) = (both.len(), arguments.last()) {
                    self.note(AssumptionKind::Weld, both, *place);
                }
            }
            // Squares of lengths: with a mass that is one they are those of a body.
            ("Inertia", name) if name != "offset" && name != "turned" => {
                if let (Value::Matrix(inertia), Some((Value::Scalar(mass), place))) =
                    (value, arguments.first())
                {
                    self.assumptions.solids.insert(nodes(inertia));
                    self.note(AssumptionKind::Mass, vec![mass.node], *place);
                }
            }
            _ => {}
        }
    }

    /// What `rotational_energy` takes for granted of the inertia.
    pub(super) fn note_inertia(&mut self, inertia: &Rows, place: Place) {
        let nodes = nodes(inertia);
        if self.frame().of.is_none() && !self.assumptions.solids.contains(&nodes) {
            self.note(AssumptionKind::Inertia, nodes, place);
        }
    }

    /// Whether what is elaborated is a constraint that always holds.
    fn holds_always(&self) -> bool {
        let function = self.frames.first().and_then(|frame| frame.function);
        let options = function.map(|index| self.implementation.functions[index].options);
        self.role == Role::Holonomic && options.is_some_and(|options| !options.switched)
    }

    /// That an axis has been divided by its length.
    pub(super) fn note_axis(&mut self, unit: &[Scalar; 3], place: Place) {
        self.note(AssumptionKind::Axis, unit.iter().map(|x| x.node).collect(), place);
    }

    fn note_rotation(&mut self, rotation: &Rc<Rows>, place: Place) {
        let Some(turns) = self.turns(rotation) else {
            return self.note(AssumptionKind::Rotation, nodes(rotation), place);
        };
        for turn in turns.iter() {
            if !turn.is_by_angle() {
                self.note(AssumptionKind::Rotation, nodes(turn.rows()), place);
                // Whether a constraint holds their norm is known when all are elaborated.
                if let Some(noted) =
                    self.assumptions.noted.iter_mut().find(|n| n.assumption.nodes == nodes(turn.rows()))
                {
                    noted.by_norm = turn.euler_parameters().cloned();
                }
            }
        }
    }

    fn note(&mut self, kind: AssumptionKind, nodes: Vec<NodeId>, place: Place) {
        let graph = &self.model.graph;
        let depends = nodes.iter().fold(Dependence::NONE, |all, node| all.with(graph.dependence(*node)));
        let unknown = Dependence::INPUTS.with(Dependence::RATES).with(Dependence::ACCELERATIONS);
        let known = self
            .assumptions
            .noted
            .iter()
            .any(|noted| noted.assumption.nodes == nodes && noted.assumption.kind == kind);
        if known || depends.on(unknown.with(Dependence::MULTIPLIERS)) {
            return;
        }
        let function = self.frames.iter().rev().find_map(|frame| frame.function);
        let within =
            function.map(|index| self.implementation.functions[index].name.to_string()).unwrap_or_default();
        let constant = depends.within(Dependence::PARAMETERS);
        let origin = self.origins.add(self.diagnostics.shown_at(place));
        let assumption = Assumption { kind, of: self.made_of(&nodes), nodes, within, constant, origin };
        self.assumptions.noted.push(NotedAssumption { assumption, by_norm: None });
    }

    /// Declared names that nodes are made of, each once.
    fn made_of(&self, nodes: &[NodeId]) -> Vec<String> {
        let model = &self.model;
        let mut names: Vec<String> = Vec::new();
        for id in model.graph.cone(nodes) {
            let name = match model.graph.node(id) {
                Node::Symbol(Symbol::Parameter(i)) => &model.parameters[i as usize].name,
                Node::Symbol(Symbol::Coordinate(i)) => &model.coordinates[i as usize].name,
                Node::Smooth { function, .. } => &model.functions[function.0 as usize].name,
                _ => continue,
            };
            // Elements of what was declared as one.
            let whole = name.split(['[', '.']).next().unwrap_or(name);
            if !names.iter().any(|known| known == whole) {
                names.push(whole.to_owned());
            }
        }
        names
    }

    /// Reports what numbers alone refute, and hands the model what the run has to show.
    pub(super) fn place_assumptions(&mut self) {
        for NotedAssumption { assumption, by_norm } in core::mem::take(&mut self.assumptions).noted {
            let values = self.at_nominal_values(&assumption.nodes);
            let graph = &self.model.graph;
            let decided =
                assumption.nodes.iter().all(|node| graph.dependence(*node).within(Dependence::NONE));
            if decided || values.iter().all(|value| !value.is_nan()) {
                if let Some(message) = refuted(assumption.kind, &values, &assumption.within) {
                    let place = self
                        .origins
                        .place(assumption.origin)
                        .unwrap_or_else(|| self.declaration.name.span().into());
                    self.diagnostics.error(place, &message);
                } else if decided {
                    continue;
                }
            }
            let turns = assumption.kind == AssumptionKind::Rotation
                && self.is_orthonormal_everywhere(&assumption.nodes);
            if !turns && !by_norm.is_some_and(|e| self.have_unit_norm(&e)) {
                self.model.assumptions.push(assumption);
            }
        }
    }

    /// NaN where something has no nominal value.
    fn at_nominal_values(&self, nodes: &[NodeId]) -> Vec<f64> {
        let given = |symbol| match symbol {
            Symbol::Parameter(i) => {
                self.model.nominal.iter().find(|(p, _)| *p == i).map_or(f64::NAN, |(_, x)| *x)
            }
            _ => f64::NAN,
        };
        self.values(nodes, &given)
    }

    fn values(&self, nodes: &[NodeId], symbol: &dyn Fn(Symbol) -> f64) -> Vec<f64> {
        let values = self.model.graph.evaluate(nodes, &SymbolValues(symbol));
        nodes.iter().map(|node| values[node.index()]).collect()
    }

    /// Whether RᵀR = 1 at random values, which it is not by chance.
    fn is_orthonormal_everywhere(&self, rotation: &[NodeId]) -> bool {
        (0..TRIALS).all(|trial| defect(&self.values(rotation, &random(trial))) < ORTHONORMAL)
    }
}

/// Symbols by a function; smooth functions have no values here.
struct SymbolValues<'a>(&'a dyn Fn(Symbol) -> f64);

impl Bindings for SymbolValues<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        (self.0)(symbol)
    }
    fn smooth(&self, _: FunctionId, _: u8, _: f64) -> f64 {
        f64::NAN
    }
}

/// Values between −1 and 1, the same in every run (SplitMix64).
fn random(trial: u64) -> impl Fn(Symbol) -> f64 {
    move |symbol| {
        let number = match symbol {
            Symbol::Parameter(i) => 2 * u64::from(i) + 1,
            Symbol::Coordinate(i) => 2 * u64::from(i) + 2,
            _ => 0,
        };
        let mut x = (number * TRIALS + trial + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

fn nodes(rows: &[[Scalar; 3]; 3]) -> Vec<NodeId> {
    rows.iter().flatten().map(|x| x.node).collect()
}

/// What is wrong with these numbers.
fn refuted(kind: AssumptionKind, values: &[f64], within: &str) -> Option<Message> {
    match kind {
        AssumptionKind::Mass | AssumptionKind::Moment => {
            let what = if kind == AssumptionKind::Mass { "mass" } else { "moment of inertia" };
            (values[0] < 0.0).then(|| messages::negative_mass(what, within, messages::number(values[0])))
        }
        AssumptionKind::Inertia => unphysical(values).map(|why| messages::unphysical_inertia(within, why)),
        AssumptionKind::Axis => {
            let off = (values.iter().map(|x| x * x).sum::<f64>() - 1.0).abs();
            (off > ROUNDING || off.is_nan()).then(|| messages::not_an_axis(within))
        }
        // Which attitude is meant the start says.
        AssumptionKind::Weld => None,
        AssumptionKind::Rotation => {
            let by = defect(values);
            // Not a number is no small one.
            (by > ROUNDING || by.is_nan()).then(|| messages::not_a_rotation(within, format!("{by:.1e}")))
        }
    }
}

/// Why no body has this inertia I: second moments of its mass, ½ tr I − I, are not negative along any axis,
/// which is the triangle inequality of the principal moments.
fn unphysical(m: &[f64]) -> Option<String> {
    let at = |i: usize, j: usize| m[3 * i + j];
    let scale = m.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        if (at(i, j) - at(j, i)).abs() > ROUNDING * scale {
            return Some(format!(
                "is not symmetric, its elements ({i}, {j}) and ({j}, {i}) are {} and {}",
                messages::number(at(i, j)),
                messages::number(at(j, i))
            ));
        }
    }
    let half = 0.5 * (at(0, 0) + at(1, 1) + at(2, 2));
    let second = |i: usize, j: usize| {
        if i == j { half + 0.5 * THIN_PLATE_EXCESS * scale - at(i, j) } else { -0.5 * (at(i, j) + at(j, i)) }
    };
    let minor = |i: usize, j: usize| second(i, i) * second(j, j) - second(i, j) * second(i, j);
    let cofactor = |a: usize, b: usize| second(1, a) * second(2, b) - second(1, b) * second(2, a);
    let determinant =
        second(0, 0) * cofactor(1, 2) - second(0, 1) * cofactor(0, 2) + second(0, 2) * cofactor(0, 1);
    let negative = |x: f64, degree: i32| x < -ROUNDING * scale.powi(degree);
    let bad = (0..3).any(|i| negative(second(i, i), 1))
        || [(0, 1), (0, 2), (1, 2)].into_iter().any(|(i, j)| negative(minor(i, j), 2))
        || negative(determinant, 3);
    bad.then(|| "has a principal moment that is negative or exceeds the sum of the others".to_owned())
}

/// The largest element of RᵀR − 1; NaN where there is one.
fn defect(m: &[f64]) -> f64 {
    let product = |i: usize, j: usize| (0..3).map(|k| m[3 * k + i] * m[3 * k + j]).sum::<f64>();
    let mut largest = 0.0;
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        let by = (product(i, j) - f64::from(u8::from(i == j))).abs();
        largest = if by > largest || by.is_nan() { by } else { largest };
        if largest.is_nan() {
            break;
        }
    }
    largest
}
