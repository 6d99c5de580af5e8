//! Sizes of the derived programs, exactly: a change that costs or saves operations has to show here.

use crate::common;

use common::{arm, chain, double_pendulum, kepler, relative_chain, spherical_pendulum};
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::graph::NodeId;
use dynamics_symbolic::mechanics::Model;
use dynamics_symbolic::schedule::{Staging, schedule};

/// Operations of M (lower triangle) and Q together; per call once hoisted; accelerations per call; state
/// Jacobian per call.
fn sizes(model: Model) -> [usize; 4] {
    let c = compile(model).expect("a good model");
    let e = &c.equations;
    let triangle = e.mass_matrix.iter().enumerate().flat_map(|(i, row)| &row[..=i]);
    let roots: Vec<NodeId> = triangle.chain(&e.generalized_force).copied().collect();
    let all = schedule(&c.model.graph, "terms", &roots, Staging::Inline).cost.total();
    let call = schedule(&c.model.graph, "terms", &roots, Staging::Hoisted).cost.total();
    let jacobian = c.programs.jacobians.as_ref().map_or(0, |j| j.state.cost.total());
    [all, call, c.programs.accelerations.cost.total(), jacobian]
}

#[test]
fn operation_counts_are_known() {
    let table: [(&str, Model, [usize; 4]); 8] = [
        // One root and one division, the Jacobian included.
        ("Kepler", kepler(), [13, 13, 13, 25]),
        ("spherical pendulum", spherical_pendulum(), [18, 13, 16, 37]),
        ("double pendulum", double_pendulum(), [33, 20, 30, 74]),
        // Solved for the tensions of the rods.
        ("chain 5", chain(5), [190, 137, 104, 1196]),
        ("chain 10", chain(10), [530, 377, 214, 6526]),
        ("7 links, relative angles", relative_chain(7), [498, 467, 691, 2925]),
        ("8 links, relative angles", relative_chain(8), [619, 584, 900, 4079]),
        ("arm 4", arm(4), [1186, 1108, 1165, 3354]),
    ];
    let found: Vec<(&str, [usize; 4])> =
        table.iter().map(|(name, model, _)| (*name, sizes(model.clone()))).collect();
    let expected: Vec<(&str, [usize; 4])> = table.iter().map(|(name, _, sizes)| (*name, *sizes)).collect();
    assert_eq!(found, expected);
}

/// What the derivation promises at most: a cart with ten links 760 operations for M and Q, 400 per call once
/// parameters are hoisted; seven links in relative angles 600.
#[test]
fn the_promised_sizes_are_kept() {
    let [all, call, ..] = sizes(chain(10));
    assert!(all <= 760 && call <= 400, "{all} {call}");
    let [all, ..] = sizes(relative_chain(7));
    assert!(all <= 600, "{all}");
}
