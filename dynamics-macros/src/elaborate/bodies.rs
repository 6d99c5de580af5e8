//! Rigid bodies whose energies a model adds up: by which steps their frames are reached, for the engine to
//! derive from.
//!
//! Like the turns of a rotation, what a place is made of is looked up by its elements: a vector that a known
//! rotation carried into the world, added to another place. So frames of frames are found however they were
//! written; a place of unknown making is a shift in the world.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use dynamics_symbolic::graph::NodeId;
use dynamics_symbolic::mechanics::{Body, FrameStep};
use syn::Ident;

use super::Elaborator;
use super::calls::Argument;
use super::rotations::{Rows, Turn};
use super::values::{Record, Scalar, Value};
use crate::syntax::Role;

/// The elements of a vector.
type Vector = [NodeId; 3];

/// What is known of vectors, by their elements.
#[derive(Clone, Debug, Default)]
pub(super) struct Places {
    /// Products of a known rotation and a vector.
    carried: BTreeMap<Vector, (Rc<Rows>, Vector)>,
    /// Sums of a place and such a product.
    sums: BTreeMap<Vector, (Vector, Rc<Rows>, Vector)>,
}

/// Bodies whose energies were asked for.
#[derive(Clone, Debug, Default)]
pub(super) struct Bodies {
    kinetic: Vec<(Vec<NodeId>, Body)>,
    weights: Vec<(Vec<NodeId>, Vector, NodeId)>,
}

impl Elaborator<'_> {
    /// Notes that `product` is a vector that a matrix carried, if it is known how that turns.
    pub(super) fn note_carried(&mut self, m: &Rc<Rows>, v: &[Scalar], product: &[Scalar]) {
        if let (Some(v), Some(product), Some(_)) = (nodes(v), nodes(product), self.turns(m)) {
            self.places.carried.entry(product).or_insert_with(|| (m.clone(), v));
        }
    }

    /// Notes what a sum of vectors is made of, if that is known of its second part.
    pub(super) fn note_sum(&mut self, a: &[Scalar], b: &[Scalar], sum: &[Scalar]) {
        let (Some(a), Some(b), Some(sum)) = (nodes(a), nodes(b), nodes(sum)) else { return };
        // A place to which nothing is added is not made of itself.
        if let Some((rows, v)) = self.places.carried.get(&b).cloned().filter(|_| sum != a) {
            self.places.sums.entry(sum).or_insert((a, rows, v));
        }
    }

    /// Notes an energy of a rigid body.
    pub(super) fn note_energy(&mut self, arguments: &[Argument], name: &Ident, energy: &Value) {
        let (Some((Value::Record(body), _)), Value::Scalar(energy)) = (arguments.first(), energy) else {
            return;
        };
        let key = all_nodes(body);
        match (self.role, arguments.get(1).map(|(gravity, _)| gravity)) {
            (Role::Kinetic, None) => {
                if let Some(body) = self.body(body, energy, name) {
                    self.bodies.kinetic.push((key, body));
                }
            }
            (Role::Potential, Some(Value::Vector(gravity))) => {
                if let Some(gravity) = nodes(gravity) {
                    self.bodies.weights.push((key, gravity, energy.node));
                }
            }
            _ => {}
        }
    }

    /// Hands what was noted to the model.
    pub(super) fn place_bodies(&mut self) {
        let Bodies { kinetic, mut weights } = core::mem::take(&mut self.bodies);
        for (key, mut body) in kinetic {
            if let Some(at) = weights.iter().position(|(other, ..)| *other == key) {
                let (_, gravity, energy) = weights.swap_remove(at);
                body.weight = Some((gravity, energy));
            }
            self.model.bodies.push(body);
        }
    }

    fn body(&mut self, record: &Record, energy: &Scalar, name: &Ident) -> Option<Body> {
        let [Value::Scalar(mass), Value::Vector(center), Value::Matrix(inertia), Value::Record(frame)] =
            &record.fields[..]
        else {
            return None;
        };
        let [Value::Vector(origin), Value::Matrix(rotation)] = &frame.fields[..] else { return None };
        Some(Body {
            steps: self.steps_to(nodes(origin)?, rotation, name)?,
            mass: mass.node,
            center: nodes(center)?,
            inertia: elements(inertia),
            kinetic: energy.node,
            weight: None,
        })
    }

    /// The steps from the world to a frame; `None` where a rotation is not made of turns by angles.
    fn steps_to(&mut self, origin: Vector, rotation: &Rc<Rows>, name: &Ident) -> Option<Vec<FrameStep>> {
        let turns = self.turns_that_matter(rotation)?;
        // The places on the way, each with the number of turns before it, the last one first.
        let (mut places, mut at, mut before) = (Vec::new(), origin, turns.len());
        let mut seen = BTreeSet::from([origin]);
        while let Some((base, rows, v)) = self.places.sums.get(&at).cloned() {
            // There and back again: two places may each be made of the other.
            if !seen.insert(base) {
                break;
            }
            let made_of = self.turns_that_matter(&rows)?;
            let same = made_of.len() <= before && made_of.iter().zip(&turns).all(|(a, b)| a.is(b));
            if !same || made_of.is_empty() {
                break;
            }
            before = made_of.len();
            places.push((before, v));
            at = base;
        }
        // The first place may be carried, too: 0 is not added.
        match self.places.carried.get(&at).cloned() {
            Some((rows, v)) => {
                let made_of = self.turns_that_matter(&rows)?;
                let same = made_of.len() <= before && made_of.iter().zip(&turns).all(|(a, b)| a.is(b));
                places.push(if same { (made_of.len(), v) } else { (0, at) });
            }
            None => places.push((0, at)),
        }
        let (mut steps, mut made) = (Vec::new(), 0);
        for (before, v) in places.into_iter().rev() {
            self.turn_up_to(&turns[made..before], &mut steps, name)?;
            made = before;
            if v.iter().any(|x| !self.model.graph.is_zero(*x)) {
                steps.push(FrameStep::Shift(v));
            }
        }
        self.turn_up_to(&turns[made..], &mut steps, name)?;
        Some(steps)
    }

    fn turn_up_to(&mut self, turns: &[Turn], steps: &mut Vec<FrameStep>, name: &Ident) -> Option<()> {
        for turn in turns {
            let rate = self.rate_of_angle(turn, name)?;
            steps.push(FrameStep::Turn { rotation: elements(turn.rows()), rate: rate.map(|x| x.node) });
        }
        Some(())
    }

    /// The turns of a rotation without those that turn nothing; `None` where they are not known.
    fn turns_that_matter(&self, rotation: &Rc<Rows>) -> Option<Vec<Turn>> {
        let graph = &self.model.graph;
        let is_identity = |rows: &Rows| {
            (0..3).all(|i| {
                (0..3).all(|j| {
                    if i == j { graph.is_one(rows[i][j].node) } else { graph.is_zero(rows[i][j].node) }
                })
            })
        };
        if is_identity(rotation) {
            return Some(Vec::new());
        }
        let turns = self.turns(rotation)?;
        Some(turns.iter().filter(|turn| !is_identity(turn.rows())).cloned().collect())
    }
}

fn nodes(v: &[Scalar]) -> Option<Vector> {
    match v {
        [x, y, z] => Some([x.node, y.node, z.node]),
        _ => None,
    }
}

fn elements(rows: &Rows) -> [Vector; 3] {
    rows.each_ref().map(|row| row.each_ref().map(|x| x.node))
}

/// All that a record is made of.
fn all_nodes(record: &Record) -> Vec<NodeId> {
    let mut found = Vec::new();
    for field in &record.fields {
        match field {
            Value::Scalar(s) => found.push(s.node),
            Value::Vector(v) => found.extend(v.iter().map(|x| x.node)),
            Value::Matrix(m) => found.extend(m.iter().flatten().map(|x| x.node)),
            Value::Record(inner) => found.extend(all_nodes(inner)),
            _ => {}
        }
    }
    found
}
