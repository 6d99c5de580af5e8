//! M q̈ − Φ_qᵀλ = Q, Φ_q q̈ = γ solved on the graph, beside a dense solution of the whole matrix with pivoting.

mod common;

use common::mechanisms::{Mechanism, andrews, cartesian_chain, four_bar, slider_crank};
use common::{Builder, Values};
use dynamics_symbolic::algebra::{Constrained, Guard, Solver, Stuck, Unrolled, unroll};
use dynamics_symbolic::calculus::{directional, gradient};
use dynamics_symbolic::graph::{Graph, NodeId, Symbol};
use dynamics_symbolic::mechanics::derive;
use dynamics_symbolic::schedule::{Staging, schedule};

/// The system of a mechanism, with values on its manifold.
struct System {
    graph: Graph,
    mass: Vec<Vec<NodeId>>,
    force: Vec<NodeId>,
    residual: Vec<NodeId>,
    jacobian: Vec<Vec<NodeId>>,
    gamma: Vec<NodeId>,
    values: Values,
}

impl System {
    fn of(mechanism: Mechanism) -> Self {
        let Mechanism { builder: Builder { mut model }, residual, parameters, place } = mechanism;
        let equations = derive(&mut model).expect("regular without its constraints");
        let n = model.coordinates.len();
        let mut graph = model.graph;
        let symbols: Vec<Symbol> = (0..n as u32).map(Symbol::Coordinate).collect();
        let one = graph.one();
        let jacobian = residual.iter().map(|r| gradient(&mut graph, &[(*r, one)], &symbols)).collect();
        let moved = |g: &mut Graph, roots: &[NodeId]| {
            directional(g, roots, &mut |g, s| match s {
                Symbol::Coordinate(i) => Some(g.symbol(Symbol::Rate(i))),
                _ => None,
            })
        };
        let rates = moved(&mut graph, &residual);
        let gamma = moved(&mut graph, &rates).into_iter().map(|x| graph.neg(x)).collect();
        let values =
            Values { q: place, u: vec![0.0; n], p: parameters, lambda: vec![0.0; residual.len()], ..Values::default() };
        let mut system = Self {
            graph,
            mass: equations.mass_matrix,
            force: equations.generalized_force,
            residual,
            jacobian,
            gamma,
            values,
        };
        system.close();
        system
    }

    fn constrained(&self) -> Constrained<'_> {
        Constrained { mass: &self.mass, force: &self.force, jacobian: &self.jacobian, gamma: &self.gamma }
    }

    fn at(&self, nodes: &[NodeId]) -> Vec<f64> {
        let values = self.graph.evaluate(nodes, &self.values);
        nodes.iter().map(|x| values[x.index()]).collect()
    }

    fn matrix(&self, rows: &[Vec<NodeId>]) -> Vec<Vec<f64>> {
        rows.iter().map(|row| self.at(row)).collect()
    }

    /// Newton's method with the smallest corrections, onto the manifold.
    fn close(&mut self) {
        for _ in 0..20 {
            let (phi, j) = (self.at(&self.residual), self.matrix(&self.jacobian));
            let identity: Vec<Vec<f64>> = (0..self.values.q.len())
                .map(|i| (0..self.values.q.len()).map(|k| f64::from(u8::from(i == k))).collect())
                .collect();
            let opposite: Vec<f64> = phi.iter().map(|x| -x).collect();
            let (step, _) = dense(&identity, &vec![0.0; self.values.q.len()], &j, &opposite);
            self.values.q.iter_mut().zip(step).for_each(|(q, d)| *q += d);
        }
        let left = self.at(&self.residual).iter().fold(0.0f64, |m, x| m.max(x.abs()));
        assert!(left < 1e-13, "not on the manifold: {left:e}");
    }

    /// Another state on the manifold, near the first; velocities need not be admissible for the algebra.
    fn shake(&mut self, numbers: &[f64], size: f64) {
        let n = self.values.q.len();
        for i in 0..n {
            self.values.q[i] += size * (numbers[i % numbers.len()] + 0.1 * i as f64).sin();
            self.values.u[i] = (3.0 * numbers[i % numbers.len()] + i as f64).sin();
        }
        self.close();
    }
}

/// a and λ with M a − Jᵀλ = Q, J a = γ, by Gaussian elimination with pivoting.
fn dense(m: &[Vec<f64>], q: &[f64], j: &[Vec<f64>], gamma: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (n, r) = (m.len(), j.len());
    let mut a = vec![vec![0.0; n + r + 1]; n + r];
    for i in 0..n {
        a[i][..n].copy_from_slice(&m[i]);
        a[i][n + r] = q[i];
        for k in 0..r {
            a[i][n + k] = -j[k][i];
            a[n + k][i] = j[k][i];
            a[n + k][n + r] = gamma[k];
        }
    }
    for k in 0..n + r {
        let pivot = (k..n + r).max_by(|x, y| a[*x][k].abs().total_cmp(&a[*y][k].abs())).expect("not empty");
        a.swap(k, pivot);
        let (done, rest) = a.split_at_mut(k + 1);
        for row in rest {
            let factor = row[k] / done[k][k];
            if factor != 0.0 {
                row[k..].iter_mut().zip(&done[k][k..]).for_each(|(x, p)| *x -= factor * p);
            }
        }
    }
    let mut x = vec![0.0; n + r];
    for k in (0..n + r).rev() {
        let known: f64 = (k + 1..n + r).map(|i| a[k][i] * x[i]).sum();
        x[k] = (a[k][n + r] - known) / a[k][k];
    }
    let lambda = x.split_off(n);
    (x, lambda)
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(1e-300f64, |m, x| m.max(x.abs()));
    a.iter().zip(b).fold(0.0f64, |m, (x, y)| m.max((x - y).abs())) / size
}

/// The smallest ratio of a pivot to what it may be at least, over all guards; above 1 all hold.
fn margin(system: &System, guards: &[Guard]) -> f64 {
    let ratio = |guard: &Guard| {
        let values = system.at(&[guard.pivot, guard.scale]);
        values[0].abs() / (guard.tolerance * values[1].abs())
    };
    guards.iter().map(ratio).fold(f64::INFINITY, f64::min)
}

/// The largest relative difference of q̈ and λ from the dense solution, in either norm; `None` where a guard calls for the general solver.
fn compare(system: &mut System, solver: &Solver) -> Option<f64> {
    let (force, gamma) = (system.force.clone(), system.gamma.clone());
    let (by_graph, reactions) = solver.solve(&mut system.graph, &force, &gamma);
    if margin(system, solver.guards()) <= 1.0 {
        return None;
    }
    let (m, j) = (system.matrix(&system.mass), system.matrix(&system.jacobian));
    let (a, lambda) = dense(&m, &system.at(&force), &j, &system.at(&gamma));
    Some(difference(&system.at(&by_graph), &a).max(difference(&system.at(&reactions), &lambda)))
}

/// Both ways, the second for every choice of one independent coordinate that is regular.
fn all_solvers(system: &mut System, independent: &[Vec<usize>]) -> Vec<Solver> {
    let mut solvers: Vec<Solver> =
        Solver::together(&mut system.graph, &system.mass, &system.jacobian).into_iter().collect();
    for set in independent {
        solvers.extend(Solver::by_blocks(&mut system.graph, &system.mass, &system.jacobian, set));
    }
    solvers
}

fn unrolled(system: &mut System) -> Result<Unrolled, Stuck> {
    let mut graph = std::mem::take(&mut system.graph);
    let found = unroll(&mut graph, &system.constrained(), &[], 20_000);
    system.graph = graph;
    found.map(|(unrolled, _)| unrolled)
}

/// Operations per call of q̈, λ and guards.
fn operations(system: &System, found: &Unrolled) -> usize {
    let guards = found.guards.iter().flat_map(|guard| [guard.pivot, guard.scale]);
    let results: Vec<NodeId> = found.accelerations.iter().chain(&found.multipliers).copied().chain(guards).collect();
    schedule(&system.graph, "accelerations", &results, Staging::Hoisted).cost.total()
}

/// Name, mechanism, coordinates that can lead, how many of these are at a dead point where the mechanism is put together, size.
type Reference = (&'static str, Mechanism, Vec<Vec<usize>>, usize, usize);

fn references() -> Vec<Reference> {
    let each = |n: usize| (0..n).map(|i| vec![i]).collect::<Vec<_>>();
    vec![
        // At Θ = 0 crank and arm are aligned: everything that the point E leads is at a dead point.
        ("Andrews", andrews(), each(7), 5, 446),
        ("slider-crank", slider_crank(), each(3), 0, 79),
        ("four-bar", four_bar(), each(3), 0, 110),
        ("Cartesian double pendulum", cartesian_chain(2), vec![vec![0, 2], vec![0, 3], vec![1, 2], vec![1, 3]], 0, 57),
    ]
}

#[test]
fn every_way_agrees_with_the_dense_solution() {
    for (name, mechanism, sets, dead, _) in references() {
        let mut system = System::of(mechanism);
        let solvers = all_solvers(&mut system, &sets);
        assert_eq!(solvers.len(), sets.len() + 1, "{name}");
        let found: Vec<Option<f64>> = solvers.iter().map(|solver| compare(&mut system, solver)).collect();
        let guarded = found.iter().filter(|x| x.is_none()).count();
        assert_eq!(guarded, dead, "{name}: {found:?}");
        assert!(found.iter().flatten().all(|x| *x < 1e-10), "{name}: {found:?}");
    }
}

#[test]
fn sizes_are_known() {
    let mut found = Vec::new();
    for (name, mechanism, ..) in references() {
        let mut system = System::of(mechanism);
        let unrolled = unrolled(&mut system).expect("regular");
        found.push((name, operations(&system, &unrolled)));
    }
    let expected: Vec<(&str, usize)> = references().into_iter().map(|(name, .., size)| (name, size)).collect();
    assert_eq!(found, expected);
}
