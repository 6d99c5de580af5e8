//! M q̈ − Φ_qᵀλ = Q, Φ_q q̈ = γ solved on the graph, beside a dense solution of the whole matrix with
//! pivoting.

use crate::common;

use common::mechanisms::{Mechanism, andrews, cartesian_chain, folded, four_bar, n_four_bar, slider_crank};
use common::{Builder, Values};
use dynamics_symbolic::algebra::{
    ConstrainedEquations, Elimination, Guard, NotUnrolled, Solver, States, Unrolled, unroll,
};
use dynamics_symbolic::calculus::{directional, gradient};
use dynamics_symbolic::graph::{Bindings, Graph, NodeId, Symbol};
use dynamics_symbolic::mechanics::derive;
use dynamics_symbolic::schedule::{Staging, schedule};
use proptest::prelude::*;

/// The system of a mechanism, with values on its manifold.
struct System {
    graph: Graph,
    mass: Vec<Vec<NodeId>>,
    force: Vec<NodeId>,
    residual: Vec<NodeId>,
    jacobian: Vec<Vec<NodeId>>,
    gamma: Vec<NodeId>,
    numbers: Vec<usize>,
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
        let values = Values {
            q: place,
            u: vec![0.0; n],
            p: parameters,
            lambda: vec![0.0; residual.len()],
            ..Values::default()
        };
        let rows = residual.len();
        let mut system = Self {
            graph,
            mass: equations.mass_matrix,
            force: equations.generalized_force,
            residual,
            numbers: (0..rows).collect(),
            jacobian,
            gamma,
            values,
        };
        system.close();
        system
    }

    fn constrained(&self) -> ConstrainedEquations<'_> {
        let Self { mass, force, jacobian, gamma, numbers, .. } = self;
        ConstrainedEquations { mass, force, jacobian, gamma, numbers }
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

/// The largest relative difference of q̈ and λ from the dense solution, in either norm; `None` where a guard
/// calls for the general solver.
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

fn unrolled(system: &mut System) -> Result<Unrolled, NotUnrolled> {
    let mut graph = std::mem::take(&mut system.graph);
    let found = unroll(&mut graph, &system.constrained(), &States::default(), 20_000);
    system.graph = graph;
    found.map(|(unrolled, _)| unrolled)
}

/// Operations per call of q̈, λ and guards; of a correction and its guards.
fn operations(system: &System, found: &Unrolled) -> (usize, usize) {
    let cost = |results: &[&[NodeId]], guards: &[Guard]| {
        let guards = guards.iter().flat_map(|guard| [guard.pivot, guard.scale]);
        let results: Vec<NodeId> = results.concat().into_iter().chain(guards).collect();
        schedule(&system.graph, "program", &results, Staging::Hoisted).cost.total()
    };
    let solution = cost(&[&found.accelerations, &found.multipliers], &found.guards);
    (solution, cost(&[&found.correction], &found.correction_guards))
}

/// Name, mechanism, coordinates that can lead, how many of these are at a dead point where the mechanism is
/// put together, size.
type Reference = (&'static str, Mechanism, Vec<Vec<usize>>, usize, (usize, usize));

fn references() -> Vec<Reference> {
    let each = |n: usize| (0..n).map(|i| vec![i]).collect::<Vec<_>>();
    vec![
        // At Θ = 0 crank and arm are aligned: everything that the point E leads is at a dead point.
        ("Andrews", andrews(), each(7), 5, (353, 196)),
        ("slider-crank", slider_crank(), each(3), 0, (71, 40)),
        ("four-bar", four_bar(), each(3), 0, (102, 54)),
        (
            "Cartesian double pendulum",
            cartesian_chain(2),
            vec![vec![0, 2], vec![0, 3], vec![1, 2], vec![1, 3]],
            0,
            (57, 41),
        ),
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
    let expected: Vec<(&str, (usize, usize))> =
        references().into_iter().map(|(name, .., size)| (name, size)).collect();
    assert_eq!(found, expected);
}

/// The largest relative difference of the chosen solution, and of the correction, from the dense ones; `None`
/// where a guard calls for the general solver.
fn check(system: &System, found: &Unrolled) -> Option<f64> {
    let (own, others) = (margin(system, &found.guards), margin(system, &found.correction_guards));
    assert!((own - others).abs() <= 1e-9 * own, "the same guards: {own} {others}");
    if own <= 1.0 {
        return None;
    }
    let (m, j) = (system.matrix(&system.mass), system.matrix(&system.jacobian));
    let (a, lambda) = dense(&m, &system.at(&system.force), &j, &system.at(&system.gamma));
    let solution = difference(&system.at(&found.accelerations), &a)
        .max(difference(&system.at(&found.multipliers), &lambda));
    let (delta, _) = dense(&m, &vec![0.0; m.len()], &j, &system.values.lambda);
    Some(solution.max(difference(&system.at(&found.correction), &delta)))
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 40,
        rng_seed: proptest::test_runner::RngSeed::Fixed(7),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn the_chosen_solution_holds_at_random_states(numbers in prop::collection::vec(-3.0..3.0f64, 12)) {
        for (name, mechanism, ..) in references() {
            let mut system = System::of(mechanism);
            let found = unrolled(&mut system).expect("regular");
            system.shake(&numbers, 0.05);
            system.values.lambda.iter_mut().zip(&numbers).for_each(|(r, x)| *r = *x);
            let worst = check(&system, &found);
            prop_assert!(worst.is_some_and(|x| x < 1e-9), "{} {:?} {:?}", name, worst, system.values);
        }
    }
}

/// A random sparse system whose entries are all symbols of their own: no structure but that of the pattern.
fn random_system(n: usize, r: usize, pattern: &[u8], numbers: &[f64]) -> System {
    let mut graph = Graph::new();
    let mut values = Values { lambda: vec![0.0; r], ..Values::default() };
    let mut entry = |g: &mut Graph, value: f64| {
        values.q.push(value);
        g.symbol(Symbol::Coordinate(values.q.len() as u32 - 1))
    };
    let mut at = (0..).map(|k: usize| (pattern[k % pattern.len()], numbers[k % numbers.len()]));
    let mut next = move || at.next().expect("endless");
    let zero = graph.zero();
    // M = D + Σ v vᵀ over a few sparse v: definite.
    let mut mass = vec![vec![zero; n]; n];
    for (i, row) in mass.iter_mut().enumerate() {
        row[i] = entry(&mut graph, 1.0 + next().1.abs());
    }
    for i in 1..n {
        let (kind, x) = next();
        if kind % 3 == 0 {
            let j = usize::from(kind) % i;
            let (a, b) = (entry(&mut graph, x), entry(&mut graph, next().1));
            for (k, l, p, q) in [(i, i, a, a), (j, j, b, b), (i, j, a, b), (j, i, a, b)] {
                let product = graph.mul(p, q);
                mass[k][l] = graph.add(mass[k][l], product);
            }
        }
    }
    let jacobian: Vec<Vec<NodeId>> = (0..r)
        .map(|row| {
            (0..n)
                .map(|column| match next() {
                    (kind, x) if column == row || kind % 4 == 0 => entry(&mut graph, x + x.signum()),
                    _ => zero,
                })
                .collect()
        })
        .collect();
    let force = (0..n).map(|_| entry(&mut graph, next().1)).collect();
    let gamma = (0..r).map(|_| entry(&mut graph, next().1)).collect();
    System { graph, mass, force, residual: Vec::new(), jacobian, gamma, numbers: (0..r).collect(), values }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 60,
        rng_seed: proptest::test_runner::RngSeed::Fixed(11),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn random_sparse_systems_are_solved(
        n in 1usize..8,
        less in 0usize..5,
        pattern in prop::collection::vec(0u8..12, 61),
        numbers in prop::collection::vec(-2.0..2.0f64, 97),
    ) {
        let r = n.saturating_sub(less);
        let mut system = random_system(n, r, &pattern, &numbers);
        let leading: Vec<usize> = (r..n).collect();
        let solvers = all_solvers(&mut system, &[leading]);
        prop_assert!(!solvers.is_empty());
        for solver in &solvers {
            // Near-singular blocks are the guards' business; what they let pass has lost at most as many
            // digits as they allow.
            if let Some(worst) = compare(&mut system, solver) {
                prop_assert!(worst < 1e-6, "{} {:?}", worst, solver.elimination());
            }
        }
        let found = unrolled(&mut system).expect("generically regular");
        if let Some(worst) = check(&system, &found) {
            prop_assert!(worst < 1e-6, "{} {:?}", worst, found.elimination);
        }
    }
}

#[test]
fn repeated_rows_are_left_to_the_general_solver() {
    let mut system = System::of(slider_crank());
    system.jacobian.push(system.jacobian[0].clone());
    system.gamma.push(system.gamma[0]);
    system.numbers.push(system.numbers.len());
    assert_eq!(unrolled(&mut system).err(), Some(NotUnrolled::Redundant));
}

#[test]
fn a_coordinate_without_inertia_is_carried_by_the_others() {
    for way in 0..3 {
        let mut system = System::of(slider_crank());
        let zero = system.graph.zero();
        // The slider, or the rod.
        for (i, k) in (0..3).flat_map(|k| [(1 + way % 2, k), (k, 1 + way % 2)]) {
            system.mass[i][k] = zero;
        }
        system.shake(&[0.3, -0.8, 1.1], 0.05);
        let solver = match way {
            2 => Solver::by_blocks(&mut system.graph, &system.mass, &system.jacobian, &[0]),
            _ => Solver::together(&mut system.graph, &system.mass, &system.jacobian),
        };
        let worst = compare(&mut system, &solver.expect("the crank has inertia"));
        assert!(worst.is_some_and(|x| x < 1e-12), "{way} {worst:?}");
    }
}

/// The work for many loops in a row grows with their number.
#[test]
fn chains_of_loops_cost_in_proportion() {
    let size = |loops: usize| {
        let mut system = System::of(n_four_bar(loops));
        let found = unrolled(&mut system).expect("regular away from its dead points");
        let worst = check(&system, &found);
        assert!(worst.is_some_and(|x| x < 1e-9), "{loops}: {worst:?}");
        operations(&system, &found).0
    };
    let (few, many) = (size(4), size(12));
    assert!(many < 3 * few + few / 2, "{few} for 4, {many} for 12");
}

/// Toward a dead point of a partition either the guard calls for the general solver, or the digits are there:
/// nothing in between.
#[test]
fn guards_call_before_digits_are_lost() {
    // Crank and arm aligned at Θ = 0, for whatever the point E leads; rods of a pendulum upright or level;
    // crank and rod in line.
    type Case = (Mechanism, Vec<usize>, fn(&mut Values, f64));
    /// A double pendulum whose rods are 0.9 long, one at 0.7 from level or upright and the other at `e` from
    /// level.
    fn double(v: &mut Values, angles: [f64; 2]) {
        let (first, second) = (angles[0].sin_cos(), angles[1].sin_cos());
        let (x, y) = (0.9 * first.1, -0.9 * first.0);
        v.q = vec![x, y, x + 0.9 * second.1, y - 0.9 * second.0];
    }
    let cases: [Case; 6] = [
        (andrews(), vec![2], |v, e| v.q[1] = e),
        (cartesian_chain(1), vec![0], |v, e| (v.q[0], v.q[1]) = (0.9 * (1.0 - e * e).sqrt(), -0.9 * e)),
        (cartesian_chain(1), vec![1], |v, e| (v.q[0], v.q[1]) = (0.9 * e, -0.9 * (1.0 - e * e).sqrt())),
        (slider_crank(), vec![2], |v, e| (v.q[0], v.q[1]) = (e, -(0.5 * e.sin() / 1.2).asin())),
        // Two freedoms by x alone, of which one rod is level.
        (cartesian_chain(2), vec![0, 2], |v, e| double(v, [0.7, e])),
        (cartesian_chain(2), vec![0, 2], |v, e| double(v, [e, 0.7])),
    ];
    for (k, (mechanism, independent, near)) in cases.into_iter().enumerate() {
        let mut system = System::of(mechanism);
        system.values.u = (0..system.values.q.len()).map(|i| 0.3 + 0.1 * i as f64).collect();
        let (mass, jacobian) = (system.mass.clone(), system.jacobian.clone());
        let solver =
            Solver::by_blocks(&mut system.graph, &mass, &jacobian, &independent).expect("regular elsewhere");
        let (mut held, mut called) = (0, 0);
        for exponent in 0..40 {
            near(&mut system.values, 0.3 * 0.5f64.powi(exponent));
            match compare(&mut system, &solver) {
                Some(worst) => {
                    held += 1;
                    assert!(worst < 3e-10, "{k} at 2^-{exponent}: {worst:e}");
                }
                None => called += 1,
            }
        }
        near(&mut system.values, 0.0);
        assert!(compare(&mut system, &solver).is_none(), "{k}: guarded where it is singular");
        assert!(held > 4 && called > 20, "{k}: {held} {called}");
    }
}

/// Where the states say that a choice of independent coordinates comes near its dead point, another one of
/// nearly the same cost is taken.
#[test]
fn states_decide_between_choices_of_the_same_cost() {
    let leading = |elimination: &Elimination| match elimination {
        Elimination::Blocks(blocks) => {
            let dependent: Vec<usize> =
                blocks.iter().flat_map(|(_, columns)| columns.iter().copied()).collect();
            (0..3).filter(|c| !dependent.contains(c)).collect::<Vec<_>>()
        }
        Elimination::MinimumDegree | Elimination::Speeds => Vec::new(),
    };
    let mut system = System::of(four_bar());
    let found = unrolled(&mut system).expect("regular");
    assert_eq!(leading(&found.elimination), [0], "what is declared first, as nothing else is known");
    // Coupler and rocker nearly in line: the crank cannot lead there.
    let dead = System::of(four_bar());
    let mut values = dead.values.clone();
    (values.q[1], values.q[2]) = (0.8, 0.8 + 1e-6);
    let mut system = System::of(four_bar());
    let mut graph = std::mem::take(&mut system.graph);
    let (found, _) = unroll(
        &mut graph,
        &system.constrained(),
        &States { anywhere: &[&values], ..States::default() },
        20_000,
    )
    .expect("regular");
    assert_ne!(leading(&found.elimination), [0]);
}

/// Where motions are likely to begin, the likeliest first, whatever is taken has to apply, if anything does
/// that is not much longer.
#[test]
fn what_is_taken_applies_where_motions_begin() {
    // Coupler and rocker in line, exactly: the crank cannot lead. Crank and coupler in line: the rocker
    // cannot. Links that are all in line: nothing can.
    let at = |q: [f64; 3]| {
        let mut values = System::of(four_bar()).values;
        values.q = q.to_vec();
        values
    };
    let (crank, rocker, all) = (at([0.3, 0.8, 0.8]), at([0.8, 0.8, 0.3]), at([0.8; 3]));
    let taken = |states: &States| {
        let mut system = System::of(four_bar());
        let mut graph = std::mem::take(&mut system.graph);
        let (found, _) = unroll(&mut graph, &system.constrained(), states, 20_000).expect("regular");
        system.graph = graph;
        let margins = [&crank, &rocker, &all].map(|values| {
            system.values = values.clone();
            margin(&system, &found.guards) > 1.0
        });
        (found, margins)
    };
    let (_, nothing_known) = taken(&States::default());
    assert_eq!(nothing_known, [false, true, false]);
    let (_, of_crank) = taken(&States { likely: &[&crank], ..States::default() });
    assert!(of_crank[0], "{of_crank:?}");
    let (_, of_both) = taken(&States { likely: &[&crank, &rocker], ..States::default() });
    assert_eq!(of_both, [true, true, false], "the coupler leads, or all together");
    let (_, beside) = taken(&States { likely: &[&rocker], passed: &[&crank], ..States::default() });
    assert_eq!(
        beside,
        [true, true, false],
        "what is passed counts as well, as the coupler costs as much as the crank"
    );
    // Singular for every order: then it is as if nothing were known.
    let (found, _) = taken(&States { likely: &[&all], ..States::default() });
    assert_eq!(found.elimination, taken(&States::default()).0.elimination);
    // What is well conditioned elsewhere does not help where nothing begins.
    let elsewhere = at([1.3, 0.2, 1.1]);
    let (_, of_both) = taken(&States { anywhere: &[&elsewhere], likely: &[&crank, &rocker], passed: &[] });
    assert_eq!(of_both, [true, true, false]);
}

/// What is longer than can be emitted is none: then it is as if nothing were known of where motions begin,
/// and not the general solver everywhere.
#[test]
fn what_applies_where_motions_begin_has_to_be_affordable() {
    // The rod across the way of the slider: its angle does not follow from the slider's height.
    let mut across = System::of(slider_crank()).values;
    across.q = vec![0.0, core::f64::consts::FRAC_PI_2, 0.0];
    let taken = |likely: &[&dyn Bindings], limit: usize| {
        let system = System::of(slider_crank());
        let found = unroll(
            &mut system.graph.clone(),
            &system.constrained(),
            &States { likely, ..States::default() },
            limit,
        );
        found.map(|(found, _)| found.elimination)
    };
    let (shortest, applying) =
        (taken(&[], 20_000).expect("regular"), taken(&[&across], 20_000).expect("regular"));
    assert_ne!(shortest, applying);
    let Err(NotUnrolled::TooLarge(least)) = taken(&[], 0) else { panic!("nothing has no operations") };
    assert_eq!(taken(&[&across], least - 1), Err(NotUnrolled::TooLarge(least)));
    assert_eq!(taken(&[&across], least), Ok(shortest));
    assert_eq!(taken(&[&across], 2 * least), Ok(applying));
}

/// Inertia that is written with a cosine of a difference loses its digits where the links fold: the general
/// solver has the squares.
#[test]
fn folded_links_are_left_to_the_general_solver() {
    let mut system = System::of(folded());
    let found = unrolled(&mut system).expect("regular");
    assert!(check(&system, &found).is_some_and(|x| x < 1e-12));
    let mut lost = false;
    for exponent in 0..40 {
        // The second link back along the first.
        system.values.q[1] = std::f64::consts::PI - 0.5f64.powi(exponent);
        system.values.q[2] = 0.0;
        match check(&system, &found) {
            Some(worst) => assert!(worst < 1e-9, "2^-{exponent}: {worst:e}"),
            None => lost = true,
        }
    }
    assert!(lost, "the links fold");
}
