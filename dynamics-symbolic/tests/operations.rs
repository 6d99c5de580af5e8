//! Sizes of the derived programs.

mod common;

use common::{arm, chain, double_pendulum, relative_chain};
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::mechanics::Model;
use dynamics_symbolic::schedule::{Staging, schedule};

#[test]
fn table() {
    let models: Vec<(&str, Model)> = vec![
        ("double pendulum", double_pendulum()),
        ("chain 5", chain(5)),
        ("chain 10", chain(10)),
        ("relative 7", relative_chain(7)),
        ("relative 8", relative_chain(8)),
        ("arm 7", arm(7)),
        ("chain 15", chain(15)),
        ("chain 20", chain(20)),
        ("chain 30", chain(30)),
    ];
    for (name, model) in models {
        let start = std::time::Instant::now();
        let c = compile(model).expect(name);
        let time = start.elapsed();
        let e = &c.equations;
        let mut roots = Vec::new();
        for i in 0..e.mass_matrix.len() {
            roots.extend(&e.mass_matrix[i][..=i]);
        }
        roots.extend(&e.generalized_force);
        let terms = schedule(&c.model.graph, "terms", &roots, Staging::Inline).cost.total();
        let staged = schedule(&c.model.graph, "terms", &roots, Staging::Hoisted);
        let p = &c.programs;
        println!(
            "{name}: {:?} terms {terms} staged {}+{} accelerations {}+{} jacobian {}+{} parameters {} constants {} graph {} {time:?}",
            e.derivation,
            staged.hoisted_cost.total(),
            staged.cost.total(),
            p.accelerations.hoisted_cost.total(),
            p.accelerations.cost.total(),
            p.jacobians.as_ref().map_or(0, |j| j.state.hoisted_cost.total()),
            p.jacobians.as_ref().map_or(0, |j| j.state.cost.total()),
            p.jacobians.as_ref().map_or(0, |j| j.parameters.cost.total()),
            p.accelerations.constants.len(),
            c.model.graph.len(),
        );
    }
}
