#[path = "../tests/common/mod.rs"]
mod common;
use common::mechanisms::*;
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::mechanics::*;
use std::time::Instant;
fn main() {
    for (name, m) in [
        ("andrews", andrews()),
        ("slider", slider_crank()),
        ("four", four_bar()),
        ("chain10", cartesian_chain(10)),
        ("chain40", cartesian_chain(40)),
        ("n4", n_four_bar(1)),
        ("n4 5", n_four_bar(5)),
        ("n4 40", n_four_bar(40)),
    ] {
        let Mechanism { mut builder, residual, .. } = m;
        builder.holonomic("closure", &residual);
        let t = Instant::now();
        let mut model = builder.model.clone();
        let e = derive(&mut model).unwrap();
        let d = t.elapsed();
        println!(
            "{name}: n {} r {} derive {:?} graph {} sol {} jac {:?} der {:?}",
            e.mass_matrix.len(),
            residual.len(),
            d,
            model.graph.len(),
            match &e.constraints.as_ref().unwrap().solution {
                Solution::Unrolled(u) => format!("{:?}", u.elimination).chars().take(60).collect::<String>(),
                Solution::General(g) => format!("{g:?}"),
            },
            e.jacobians.as_ref().map(|_| ()).err(),
            e.constraints.as_ref().unwrap().derivatives.as_ref().map(|_| ()).err()
        );
        let t = Instant::now();
        match compile(builder.model) {
            Ok(c) => {
                println!("   compile {:?}", t.elapsed());
                for p in c.programs.all() {
                    if p.cost.total() > 0 {
                        print!(" {} {}", p.name, p.cost.total());
                    }
                }
                println!();
            }
            Err(f) => println!("   {f:?} {:?}", t.elapsed()),
        }
    }
}
