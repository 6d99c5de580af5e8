//! Forces, inertia, stiffness and damping of one element of every sum.

use std::collections::BTreeMap;

use crate::calculus::directional;
use crate::graph::{Dependence, Graph, NodeId, Origin, Symbol};
use crate::mechanics::{EnergyRole, ForceTerm};

use super::index_free::drop_index;
use super::model::{Axis, FamilyModel, NodeIndex, Rounds, TermKind};
use super::rows::{self, RowElement};
use super::slopes::{entries, slopes};
use super::springs;

/// What one round adds to the equations of motion; nodes of the model's graph, coordinates by their numbers
/// among the locals.
#[derive(Clone, Debug, Default)]
pub struct Element {
    /// When it is added.
    pub rounds: Rounds,
    /// The functions that it comes from.
    pub functions: Vec<String>,
    /// Q, where it is not zero.
    pub forces: Vec<(usize, NodeId)>,
    /// M, both halves, where it is not zero.
    pub mass: Vec<(usize, usize, NodeId)>,
    /// −∂Q/∂q, where it is not zero.
    pub stiffness: Vec<(usize, usize, NodeId)>,
    /// −∂Q/∂u, where it is not zero.
    pub damping: Vec<(usize, usize, NodeId)>,
    /// T, where it has one.
    pub kinetic: Option<NodeId>,
    /// V, where it has one.
    pub potential: Option<NodeId>,
    /// The power of forces and of dissipation, where it has some.
    pub power: Option<NodeId>,
}

/// A model's elements, and what holds of all of them.
#[derive(Clone, Debug)]
pub struct Derived {
    /// The elements, those with rounds first, in the order of their ranges.
    pub elements: Vec<Element>,
    /// The rows of the constraints, in their order.
    pub rows: Vec<RowElement>,
    /// Whether T + V is conserved.
    pub conservative: bool,
    /// Whether T + V changes by the power of the elements alone.
    pub balanced: bool,
    /// Whether Q contains velocities.
    pub velocity_forces: bool,
    /// Whether M is diagonal.
    pub diagonal: bool,
}

/// Why a model with families has no equations of motion yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NoElement {
    /// The mass matrix is not constant.
    MassMoves {
        /// The kinetic energy.
        function: String,
        /// Where it was declared.
        origin: Origin,
    },
    /// The kinetic energy is no quadratic function of the velocities.
    NotQuadratic {
        /// The kinetic energy.
        function: String,
        /// Where it was declared.
        origin: Origin,
    },
}

/// Derives all elements. Adds nodes to the graph.
///
/// # Errors
/// A kinetic energy whose mass matrix is not constant.
pub fn derive(model: &mut FamilyModel) -> Result<Derived, Vec<NoElement>> {
    drop_index(model);
    let mut groups: BTreeMap<Rounds, Vec<usize>> = BTreeMap::new();
    for (k, term) in model.terms.iter().enumerate() {
        groups.entry(term.rounds).or_default().push(k);
    }
    let (mut elements, mut errors, mut homogeneous) = (Vec::new(), Vec::new(), true);
    // What has no rounds comes last: it is added to what the loops have written.
    let once = groups.remove(&Rounds::Once);
    for (rounds, terms) in groups.into_iter().chain(once.map(|terms| (Rounds::Once, terms))) {
        let mut element = Element { rounds, ..Element::default() };
        for k in terms {
            errors.extend(add(model, &mut element, k, &mut homogeneous));
        }
        let n = model.locals.len();
        let g = &mut model.model.graph;
        springs::shorten(g, &mut element.forces);
        element.stiffness = slopes(g, &element.forces, Symbol::Coordinate, n);
        element.damping = slopes(g, &element.forces, Symbol::Rate, n);
        elements.push(element);
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let rows = rows::derive(model);
    let g = &model.model.graph;
    let on = |id: NodeId, of: Dependence| g.dependence(id).on(of);
    let acts = |k: &TermKind| match k {
        TermKind::Force(_) | TermKind::Energy(EnergyRole::Dissipation, _) => true,
        TermKind::Energy(_, id) => on(*id, Dependence::TIME.with(Dependence::INPUTS)),
    };
    let moves = |k: &TermKind| match k {
        TermKind::Energy(EnergyRole::Dissipation, _) | TermKind::Force(_) => false,
        TermKind::Energy(_, id) => on(*id, Dependence::TIME.with(Dependence::INPUTS)),
    };
    let velocity_forces = elements.iter().flat_map(|e| &e.forces).any(|(_, q)| on(*q, Dependence::RATES));
    Ok(Derived {
        conservative: homogeneous
            && !model.terms.iter().any(|term| acts(&term.kind))
            && !rows.iter().flat_map(|row| &row.components).any(|term| term.moves),
        balanced: homogeneous && !model.terms.iter().any(|term| moves(&term.kind)),
        velocity_forces,
        diagonal: elements.iter().flat_map(|e| &e.mass).all(|(a, b, _)| a == b),
        elements,
        rows,
    })
}

/// Adds a term to its element. A kinetic energy that has more than squares of velocities, as that of a moving
/// frame, is not `homogeneous`: T + V is not conserved then.
fn add(
    model: &mut FamilyModel,
    element: &mut Element,
    k: usize,
    homogeneous: &mut bool,
) -> Option<NoElement> {
    let n = model.locals.len();
    let term = &model.terms[k];
    let (function, origin) = (term.function.clone(), term.origin);
    let g = &mut model.model.graph;
    if !element.functions.contains(&function) {
        element.functions.push(function.clone());
    }
    let one = g.one();
    let forces = match &term.kind {
        TermKind::Energy(EnergyRole::Dissipation, id) => {
            let minus = g.integer(-1);
            let forces = entries(g, &[(*id, minus)], Symbol::Rate, n);
            add_power(g, &mut element.power, &forces);
            forces
        }
        TermKind::Force(terms) => {
            let mut seeded = Vec::new();
            for term in terms {
                match term {
                    ForceTerm::At { point, vector } => {
                        seeded.extend(point.iter().copied().zip(vector.iter().copied()));
                    }
                    ForceTerm::Along { expression, magnitude } => seeded.push((*expression, *magnitude)),
                }
            }
            let forces = entries(g, &seeded, Symbol::Coordinate, n);
            add_power(g, &mut element.power, &forces);
            forces
        }
        TermKind::Energy(role, id) => {
            // L = T − V, −V or L.
            let lagrangian = if *role == EnergyRole::Potential { g.neg(*id) } else { *id };
            let momenta = entries(g, &[(lagrangian, one)], Symbol::Rate, n);
            let mass = slopes(g, &momenta, Symbol::Rate, n);
            let mut own_mass = Vec::new();
            for (a, b, m) in mass {
                // `slopes` has −∂p/∂u.
                let m = g.neg(m);
                if g.dependence(m).on(Dependence::RATES) {
                    return Some(NoElement::NotQuadratic { function, origin });
                }
                if !g.dependence(m).within(Dependence::PARAMETERS) {
                    return Some(NoElement::MassMoves { function, origin });
                }
                add_entry(g, &mut element.mass, a, b, m);
                own_mass.push((a, b, m));
            }
            // p·u, which is 2 T where T has squares of velocities alone.
            let mut power = g.zero();
            for (a, p) in &momenta {
                let rate = g.symbol(Symbol::Rate(*a as u32));
                let term = g.mul(*p, rate);
                power = g.add(power, term);
            }
            let (slot, sign) = match role {
                EnergyRole::Potential => (&mut element.potential, *id),
                EnergyRole::Kinetic => {
                    let twice = g.add(*id, *id);
                    *homogeneous &= g.fingerprint(power) == g.fingerprint(twice);
                    (&mut element.kinetic, *id)
                }
                _ => {
                    // T = ½ uᵀM u, V = p·u − L − T, so that terms with u alone, whose forces do no work, are
                    // in neither.
                    let mut kinetic = g.zero();
                    for (a, b, m) in &own_mass {
                        let (u, v) = (g.symbol(Symbol::Rate(*a as u32)), g.symbol(Symbol::Rate(*b as u32)));
                        let product = g.mul(u, v);
                        let term = g.mul(*m, product);
                        kinetic = g.add(kinetic, term);
                    }
                    let half = g.number(crate::graph::Number::Rational(1, 2));
                    let kinetic = g.mul(half, kinetic);
                    let rest = g.sub(power, *id);
                    let potential = g.sub(rest, kinetic);
                    element.kinetic = Some(match element.kinetic {
                        Some(known) => g.add(known, kinetic),
                        None => kinetic,
                    });
                    (&mut element.potential, potential)
                }
            };
            *slot = Some(match *slot {
                Some(known) => g.add(known, sign),
                None => sign,
            });
            // Q = ∂L/∂q − ∂p/∂q·u − ∂p/∂t.
            let mut forces = entries(g, &[(lagrangian, one)], Symbol::Coordinate, n);
            let nodes: Vec<NodeId> = momenta.iter().map(|(_, p)| *p).collect();
            let moved = directional(g, &nodes, &mut |g, symbol| match symbol {
                Symbol::Coordinate(i) => Some(g.symbol(Symbol::Rate(i))),
                Symbol::Time => Some(g.one()),
                _ => None,
            });
            for ((a, _), rate) in momenta.iter().zip(moved) {
                let minus = g.neg(rate);
                add_force(g, &mut forces, *a, minus);
            }
            forces
        }
    };
    for (a, q) in forces {
        add_force(g, &mut element.forces, a, q);
    }
    None
}

/// Σ Q u.
fn add_power(g: &mut Graph, power: &mut Option<NodeId>, forces: &[(usize, NodeId)]) {
    for (a, q) in forces {
        let rate = g.symbol(Symbol::Rate(*a as u32));
        let term = g.mul(*q, rate);
        *power = Some(match *power {
            Some(known) => g.add(known, term),
            None => term,
        });
    }
}

fn add_force(g: &mut Graph, forces: &mut Vec<(usize, NodeId)>, a: usize, q: NodeId) {
    match forces.iter_mut().find(|(known, _)| *known == a) {
        Some((_, sum)) => *sum = g.add(*sum, q),
        None => forces.push((a, q)),
    }
    forces.retain(|(_, q)| !g.is_zero(*q));
}

fn add_entry(g: &mut Graph, all: &mut Vec<(usize, usize, NodeId)>, a: usize, b: usize, m: NodeId) {
    match all.iter_mut().find(|(i, j, _)| (*i, *j) == (a, b)) {
        Some((.., sum)) => *sum = g.add(*sum, m),
        None => all.push((a, b, m)),
    }
    all.retain(|(.., m)| !g.is_zero(*m));
}

/// How the forces of an element with rounds come to its nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gathering {
    /// One loop, nodes with one index: every node gathers what the rounds beside it give.
    Line,
    /// Two loops, and all nodes are `[i + k][j + l]` of grids: likewise.
    Grid,
    /// Every round adds to its nodes, as at the edges of a grid.
    Added,
}

impl Element {
    /// How its forces come to the nodes; `None` without rounds or forces.
    #[must_use]
    pub fn gathering(&self, model: &FamilyModel) -> Option<Gathering> {
        let mut nodes = self.forces.iter().map(|(a, _)| model.locals[*a]).peekable();
        nodes.peek()?;
        let moves = |index: NodeIndex, of: Axis| matches!(index, NodeIndex::Round(axis, _) if axis == of);
        match self.rounds {
            Rounds::Once => None,
            Rounds::Over(_) if nodes.all(|node| node.column.is_none()) => Some(Gathering::Line),
            Rounds::Nested(..)
                if nodes.all(|node| {
                    moves(node.index, Axis::First)
                        && node.column.is_some_and(|column| moves(column, Axis::Second))
                }) =>
            {
                Some(Gathering::Grid)
            }
            _ => Some(Gathering::Added),
        }
    }

    /// How far below and above the index of an axis the nodes are to which a round gives forces.
    #[must_use]
    pub fn reach(&self, model: &FamilyModel, axis: Axis) -> Option<(i64, i64)> {
        let nodes = self.forces.iter().map(|(a, _)| model.locals[*a]);
        let indices = nodes.flat_map(|node| [Some(node.index), node.column]).flatten();
        let offsets = indices.filter_map(|index| match index {
            NodeIndex::Round(of, k) if of == axis => Some(k),
            _ => None,
        });
        offsets.fold(None, |reach, k| Some(reach.map_or((k, k), |(a, b): (i64, i64)| (a.min(k), b.max(k)))))
    }
}
