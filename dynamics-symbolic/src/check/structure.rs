//! What a solver, and a reader, can take advantage of: the pattern of M, decoupled parts, linearity,
//! ignorable coordinates.

use std::collections::BTreeSet;

use crate::graph::{Dependence, Fingerprint, NodeId, Sampler, Symbol};
use crate::mechanics::{EnergyRole, Equations, Model};

use super::quadratic::degree_at_most;
use super::unused::Reads;

/// Which elements of M are not zero.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// Only the diagonal.
    Diagonal,
    /// Blocks of these sizes, after sorting the coordinates.
    Blocks(Vec<usize>),
    /// Nothing beyond this many elements next to the diagonal.
    Banded(usize),
    /// Some zeros without such an order: number of zeros below the diagonal.
    Sparse(usize),
    /// No zeros.
    Dense,
    /// M is left out.
    LeftOut,
}

/// How far the equations are from linear ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Linearity {
    /// M constant, Q of first degree in q and q̇, coefficients constant.
    ConstantCoefficients,
    /// Linear with coefficients that depend on time.
    TimeDependent,
    /// Anything else.
    Nonlinear,
}

/// The structure of the equations of motion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Structure {
    /// Pattern of M.
    pub pattern: Pattern,
    /// What M depends on.
    pub mass: Dependence,
    /// What Q depends on.
    pub force: Dependence,
    /// What the constraints depend on.
    pub constraints: Dependence,
    /// Coordinates that can be solved apart from each other, by index, each group ascending.
    pub subsystems: Vec<Vec<usize>>,
    /// Linearity.
    pub linearity: Linearity,
    /// Coordinates that the energies do not contain (their rates may).
    pub ignorable: Vec<usize>,
    /// Whether L has terms of first degree in the velocities: gyroscopic forces, moving frames, magnetic
    /// fields.
    pub gyroscopic: bool,
}

impl Structure {
    /// Looks at a model's equations.
    #[must_use]
    pub fn of(model: &Model, equations: &Equations) -> Self {
        let g = &model.graph;
        let all = |nodes: &[NodeId]| nodes.iter().fold(Dependence::NONE, |d, n| d.with(g.dependence(*n)));
        let mass_nodes: Vec<NodeId> = equations.inertia().copied().collect();
        // What is linear in q̈ does not make M depend on it.
        let mass = all(&mass_nodes).without(Dependence::ACCELERATIONS);
        Self {
            pattern: pattern(model, equations),
            mass,
            force: all(&equations.generalized_force),
            constraints: model
                .constraints
                .iter()
                .flat_map(|c| &c.components)
                .fold(Dependence::NONE, |d, (_, node)| d.with(g.dependence(*node))),
            subsystems: subsystems(model, equations),
            linearity: linearity(model, equations, mass),
            ignorable: ignorable(model),
            gyroscopic: gyroscopic(model, equations),
        }
    }
}

/// Groups that `coupled`, which is symmetric, connects, each ascending, by their first members.
fn components(coupled: &[BTreeSet<usize>]) -> Vec<Vec<usize>> {
    let mut seen = vec![false; coupled.len()];
    let mut groups = Vec::new();
    for start in 0..coupled.len() {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        let (mut group, mut at) = (vec![start], 0);
        while at < group.len() {
            for j in &coupled[group[at]] {
                if !seen[*j] {
                    seen[*j] = true;
                    group.push(*j);
                }
            }
            at += 1;
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

fn pattern(model: &Model, equations: &Equations) -> Pattern {
    if equations.leaves_out_mass_matrix() {
        return Pattern::LeftOut;
    }
    let (m, n) = (&equations.mass_matrix, equations.mass_matrix.len());
    let couples = |i: usize, j: usize| !model.graph.is_zero(m[i][j]);
    let below = || (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
    let zeros = below().filter(|(i, j)| !couples(*i, *j)).count();
    let band = below().filter(|(i, j)| couples(*i, *j)).map(|(i, j)| i - j).max().unwrap_or(0);
    let of = |i: usize| (0..n).filter(|j| couples(i, *j) || couples(*j, i)).collect();
    let blocks = components(&(0..n).map(of).collect::<Vec<_>>());
    if band == 0 {
        Pattern::Diagonal
    } else if blocks.len() > 1 {
        Pattern::Blocks(blocks.iter().map(Vec::len).collect())
    } else if zeros == 0 {
        Pattern::Dense
    } else if 2 * band < n {
        Pattern::Banded(band)
    } else {
        Pattern::Sparse(zeros)
    }
}

fn subsystems(model: &Model, equations: &Equations) -> Vec<Vec<usize>> {
    let n = model.coordinates.len();
    let reads: Vec<Reads> = (0..n)
        .map(|i| {
            let mut nodes = equations.mass_matrix.get(i).cloned().unwrap_or_default();
            nodes.extend(equations.mass_product.get(i));
            nodes.push(equations.generalized_force[i]);
            Reads::of(model, &nodes)
        })
        .collect();
    let mut coupled = vec![BTreeSet::new(); n];
    let mut couple = |i: usize, j: usize| {
        coupled[i].insert(j);
        coupled[j].insert(i);
    };
    for row in constraint_reads(model) {
        let own: Vec<usize> = row.coordinates().into_iter().collect();
        own.windows(2).for_each(|pair| couple(pair[0], pair[1]));
    }
    for (i, row) in equations.mass_matrix.iter().enumerate() {
        (0..n).filter(|j| !model.graph.is_zero(row[*j])).for_each(|j| couple(i, j));
    }
    for (i, reads) in reads.iter().enumerate() {
        reads.coordinates().into_iter().for_each(|j| couple(i, j));
    }
    components(&coupled)
}

/// What each row of the constraints reads.
fn constraint_reads(model: &Model) -> Vec<Reads> {
    let rows = model.constraints.iter().flat_map(|c| &c.components);
    rows.map(|(_, node)| Reads::of(model, &[*node])).collect()
}

fn linearity(model: &Model, equations: &Equations, mass: Dependence) -> Linearity {
    let q = &equations.generalized_force;
    let moves = |s: Symbol| matches!(s, Symbol::Coordinate(_) | Symbol::Rate(_) | Symbol::Multiplier(_));
    let rows = model.constraints.iter().flat_map(|c| &c.components).map(|(_, node)| *node);
    let q = &q.iter().copied().chain(rows).collect::<Vec<NodeId>>();
    if mass.on(Dependence::COORDINATES.with(Dependence::RATES)) || !degree_at_most(model, q, 1, &moves) {
        return Linearity::Nonlinear;
    }
    let sampler = Sampler::new(&model.graph, q);
    // Q(x) − Q(x′) of a linear system depends on time only through its coefficients.
    let at = |state: u64, time: u64| {
        sampler.with(&mut |s| match s {
            Symbol::Time | Symbol::Input(_) => sampler.random(s, time),
            s if moves(s) => sampler.random(s, state),
            s => sampler.random(s, 0),
        })
    };
    let slope =
        |time: u64| at(0, time).iter().zip(at(1, time)).map(|(a, b)| a.sub(b)).collect::<Vec<Fingerprint>>();
    let steady = !mass.on(Dependence::TIME.with(Dependence::INPUTS)) && slope(0) == slope(1);
    if steady { Linearity::ConstantCoefficients } else { Linearity::TimeDependent }
}

fn ignorable(model: &Model) -> Vec<usize> {
    let nodes: Vec<NodeId> =
        model.energies.iter().filter(|e| e.role != EnergyRole::Dissipation).map(|e| e.node).collect();
    let reads = Reads::of(model, &nodes);
    // A constraint on a coordinate acts on its momentum.
    let held: BTreeSet<usize> = constraint_reads(model).iter().flat_map(Reads::coordinates).collect();
    let free = |i: &u32| !reads.symbol(Symbol::Coordinate(*i)) && !held.contains(&(*i as usize));
    (0..model.coordinates.len() as u32).filter(free).map(|i| i as usize).collect()
}

fn gyroscopic(model: &Model, equations: &Equations) -> bool {
    let sampler = Sampler::new(&model.graph, &equations.momenta);
    let at_rest = sampler.with(&mut |s| match s {
        Symbol::Rate(_) => Fingerprint::ZERO,
        s => sampler.random(s, 0),
    });
    at_rest.iter().any(|p| *p != Fingerprint::ZERO)
}
