//! Long chains solved through velocities that are made of one another: the same accelerations and pivots as
//! through M, in as many operations as there are joints.

use crate::common;

use common::{Builder, chain, relative_chain};
use dynamics_symbolic::algebra::Factors;
use dynamics_symbolic::compile::{Compiled, compile};
use dynamics_symbolic::graph::{Graph, NodeId};
use dynamics_symbolic::mechanics::{EnergyRole, Model, Pivot};

/// A trunk of bodies with two branches, every body with a mass beside its joint and an inertia of its own.
fn tree(trunk: usize, branch: usize) -> Model {
    let mut b = Builder::new("Tree");
    let bodies = trunk + 2 * branch;
    let theta = b.coordinates("theta", bodies);
    let (m, l, r, j) = (
        b.parameters("m", bodies),
        b.parameters("l", bodies),
        b.parameters("r", bodies),
        b.parameters("J", bodies),
    );
    let g = b.parameter("g");
    let zero = b.g().zero();
    let (mut kinetic, mut potential) = (zero, zero);
    let mut ends = Vec::new();
    for i in 0..bodies {
        let before = match i {
            0 => [zero; 2],
            _ if i == trunk + branch => ends[trunk - 1],
            _ => ends[i - 1],
        };
        let (s, c) = (b.sin(theta[i]), b.cos(theta[i]));
        let [centre, end] = [r[i], l[i]].map(|arm| {
            let (x, y) = (b.mul(arm, s), b.mul(arm, c));
            [b.add(before[0], x), b.sub(before[1], y)]
        });
        ends.push(end);
        let (slide, turn) = (b.kinetic(m[i], &centre), b.kinetic(j[i], &[theta[i]]));
        let both = b.add(slide, turn);
        kinetic = b.add(kinetic, both);
        let weight = b.mul(m[i], g);
        let height = b.mul(weight, centre[1]);
        potential = b.add(potential, height);
    }
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    b.energy("gravity", EnergyRole::Potential, potential);
    b.model
}

/// A cart from which two chains of n points hang, one of them branching at its first point.
fn fork(n: usize) -> Model {
    let mut b = Builder::new("Fork");
    let x = b.coordinate("x");
    let theta = b.coordinates("theta", 3 * n);
    let (m, l, cart, g) =
        (b.parameters("m", 3 * n), b.parameters("l", 3 * n), b.parameter("cart"), b.parameter("g"));
    let zero = b.g().zero();
    let (mut kinetic, mut potential) = (b.kinetic(cart, &[x]), zero);
    let mut ends: Vec<[NodeId; 2]> = Vec::new();
    for i in 0..3 * n {
        let before = match i {
            _ if i % n > 0 => ends[i - 1],
            _ if i == 2 * n => ends[0],
            _ => [x, zero],
        };
        let (s, c) = (b.sin(theta[i]), b.cos(theta[i]));
        let (right, down) = (b.mul(l[i], s), b.mul(l[i], c));
        let end = [b.add(before[0], right), b.sub(before[1], down)];
        ends.push(end);
        let part = b.kinetic(m[i], &end);
        kinetic = b.add(kinetic, part);
        let weight = b.mul(m[i], g);
        let height = b.mul(weight, end[1]);
        potential = b.add(potential, height);
    }
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    b.energy("gravity", EnergyRole::Potential, potential);
    b.model
}

fn operations(c: &Compiled) -> usize {
    c.programs.accelerations.cost.total()
}

/// M q̈ − Q, and pivots less those of M eliminated in the same order: exactly zero, as fingerprints see it.
fn check(name: &str, mut c: Compiled) {
    let (e, g) = (&c.equations, &mut c.model.graph);
    let product = |g: &mut Graph, row: &[NodeId]| {
        row.iter().zip(&e.accelerations).fold(g.zero(), |sum, (m, a)| {
            let term = g.mul(*m, *a);
            g.add(sum, term)
        })
    };
    for (i, (row, force)) in e.mass_matrix.iter().zip(&e.generalized_force).enumerate() {
        let left = product(g, row);
        assert_eq!(g.fingerprint(left), g.fingerprint(*force), "{name}, row {i}");
    }
    // What rods hold has pivots of its own.
    let held =
        |p: &Pivot| g.fingerprint(p.diagonal) == g.fingerprint(e.mass_matrix[p.coordinate][p.coordinate]);
    if !e.pivots.iter().all(held) {
        return;
    }
    let order: Vec<usize> = e.pivots.iter().map(|p| p.coordinate).collect();
    for (at, pivot) in e.pivots.iter().enumerate() {
        let i = pivot.coordinate;
        assert_eq!(
            g.fingerprint(pivot.diagonal),
            g.fingerprint(e.mass_matrix[i][i]),
            "{name}, inertia of {i}"
        );
        // What is left of the inertia of i when everything before it has adapted: the last pivot of those
        // rows and columns.
        let rows: Vec<usize> = order[..at].iter().copied().chain([i]).collect();
        let part: Vec<Vec<NodeId>> =
            rows.iter().map(|r| rows.iter().map(|k| e.mass_matrix[*r][*k]).collect()).collect();
        if rows.len() <= 4 {
            let last = last_pivot(g, &part);
            assert_eq!(g.fingerprint(pivot.pivot), g.fingerprint(last), "{name}, pivot of {i}");
        }
    }
}

/// The pivot of the last row by elimination in the order given.
fn last_pivot(g: &mut Graph, m: &[Vec<NodeId>]) -> NodeId {
    let mut rows = m.to_vec();
    let n = rows.len();
    for k in 0..n - 1 {
        for i in k + 1..n {
            let factor = g.div(rows[i][k], rows[k][k]).expect("regular");
            let above = rows[k].clone();
            for (entry, above) in rows[i].iter_mut().zip(above).skip(k + 1) {
                let product = g.mul(factor, above);
                *entry = g.sub(*entry, product);
            }
        }
    }
    rows[n - 1][n - 1]
}

#[test]
fn chains_and_trees_have_the_accelerations_and_pivots_of_m() {
    for (name, model) in [
        ("chain", chain(14)),
        ("short chain", chain(2)),
        ("fork", fork(5)),
        ("relative chain", relative_chain(14)),
        ("tree", tree(6, 6)),
        ("short tree", tree(1, 1)),
    ] {
        check(name, compile(model).expect("a good model"));
    }
}

#[test]
fn operations_grow_with_the_number_of_joints() {
    let slope = |name: &str, model: &dyn Fn(usize) -> Model, most: usize| {
        let [short, long] = [16, 24].map(|n| operations(&compile(model(n)).expect("a good model")));
        assert!((long - short) / 8 <= most, "{name}: {short} and {long}");
    };
    slope("chain", &chain, 25);
    slope("fork", &|n| fork(n / 3), 30);
    slope("relative chain", &relative_chain, 85);
    slope("tree", &|n| tree(n - 2 * (n / 3), n / 3), 120);
}

/// What M takes: the velocities of a short chain are not worth their own quantities.
#[test]
fn short_chains_are_solved_through_m() {
    let mut c = compile(chain(1)).expect("a good model");
    let (e, g) = (&c.equations, &mut c.model.graph);
    let factors = Factors::new(g, &e.mass_matrix).expect("regular");
    assert_eq!(factors.solve(g, &e.generalized_force), e.accelerations);
}
