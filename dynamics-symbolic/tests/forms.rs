//! Shorter forms are other forms of the same: equal modulo p at the random points, equal in numbers to
//! rounding, and shorter.

use crate::common;

use common::mechanisms::{andrews, four_bar, slider_crank};
use common::{Values, double_pendulum, relative_chain};
use dynamics_symbolic::calculus::{collect_terms, share_parts};
use dynamics_symbolic::graph::{Graph, NodeId, Number, Symbol, Unary};
use dynamics_symbolic::mechanics::{Model, derive};
use proptest::prelude::*;

fn numbers(g: &Graph, nodes: &[NodeId], values: &Values) -> Vec<f64> {
    let all = g.evaluate(nodes, values);
    nodes.iter().map(|x| all[x.index()]).collect()
}

/// Checks that `new` are forms of `old`.
fn same(g: &Graph, old: &[NodeId], new: &[NodeId], values: &Values) {
    assert_eq!(old.len(), new.len());
    for (a, b) in old.iter().zip(new) {
        assert_eq!(g.fingerprint(*a), g.fingerprint(*b));
    }
    let (a, b) = (numbers(g, old, values), numbers(g, new, values));
    let size = a.iter().fold(1.0f64, |m, x| m.max(x.abs()));
    assert!(a.iter().zip(&b).all(|(x, y)| (x - y).abs() <= 1e-12 * size), "{a:?} {b:?}");
}

#[test]
fn inertia_and_forces_of_mechanisms_become_shorter() {
    let models: [(Model, usize, bool); 5] = [
        (andrews().builder.model, 7, true),
        (slider_crank().builder.model, 3, true),
        (four_bar().builder.model, 3, true),
        // Written as shortly as can be already.
        (double_pendulum(), 2, false),
        (relative_chain(3), 3, false),
    ];
    for (mut model, n, much) in models {
        let name = model.name.clone();
        let equations = derive(&mut model).expect("regular");
        let g = &mut model.graph;
        let values = Values {
            q: (0..n).map(|i| 0.3 + 0.2 * i as f64).collect(),
            u: (0..n).map(|i| 0.5 - 0.1 * i as f64).collect(),
            p: (0..model.parameters.len()).map(|i| 1.0 + 0.01 * i as f64).collect(),
            ..Values::default()
        };
        let roots = [equations.mass_matrix.concat(), equations.generalized_force].concat();
        let before = g.weight(&roots);
        let collected = collect_terms(g, &roots, &[]).nodes;
        same(g, &roots, &collected, &values);
        let between = g.weight(&collected);
        let shared = share_parts(g, &collected);
        same(g, &roots, &shared, &values);
        let after = g.weight(&shared);
        assert!(between <= before && after <= between, "{name}: {before} {between} {after}");
        assert!(!much || 4 * after < 3 * before, "{name}: {before} {after}");
    }
}

/// A sum of products that hides what it is.
#[test]
fn what_is_constant_is_seen_to_be() {
    let mut g = Graph::new();
    let [x, m, a] = [Symbol::Coordinate(0), Symbol::Parameter(0), Symbol::Parameter(1)].map(|s| g.symbol(s));
    let (s, c) = (g.unary(Unary::Sin, x), g.unary(Unary::Cos, x));
    // m + a s², then + a c².
    let (ss, cc) = (g.mul(s, s), g.mul(c, c));
    let (first, second) = (g.mul(a, ss), g.mul(a, cc));
    let sum = g.add(m, first);
    let sum = g.add(sum, second);
    assert!(!g.is_constant(sum));
    let collected = collect_terms(&mut g, &[sum], &[sum]);
    assert!(g.is_constant(collected.nodes[0]));
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 60,
        rng_seed: proptest::test_runner::RngSeed::Fixed(3),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Random expressions, operation by operation: whatever is done to them, their values stay.
    #[test]
    fn values_stay(steps in prop::collection::vec((0u8..7, 0usize..64, 0usize..64), 5..40)) {
        let mut g = Graph::new();
        let mut nodes: Vec<NodeId> = (0..3)
            .flat_map(|i| [Symbol::Coordinate(i), Symbol::Rate(i), Symbol::Parameter(i)])
            .map(|s| g.symbol(s))
            .collect();
        nodes.push(g.number(Number::ratio(3, 2)));
        for (operation, a, b) in steps {
            let (a, b) = (nodes[a % nodes.len()], nodes[b % nodes.len()]);
            nodes.push(match operation {
                0 | 1 => g.add(a, b),
                2 => g.sub(a, b),
                3 | 4 => g.mul(a, b),
                5 => g.unary(Unary::Sin, a),
                _ => g.unary(Unary::Cos, a),
            });
        }
        let values = Values {
            q: vec![0.3, -0.7, 1.1],
            u: vec![0.2, 0.9, -0.4],
            p: vec![1.2, 0.6, -0.8],
            ..Values::default()
        };
        let roots = nodes.split_off(nodes.len() - 4);
        // What grows without bound is no model's.
        prop_assume!(numbers(&g, &roots, &values).iter().all(|x| x.abs() < 1e3));
        let before = g.weight(&roots);
        let collected = collect_terms(&mut g, &roots, &[]).nodes;
        let shared = share_parts(&mut g, &collected);
        prop_assert!(g.weight(&shared) <= before);
        same(&g, &roots, &shared, &values);
    }
}
