#[path = "../tests/common/mod.rs"]
mod common;
use common::mechanisms::*;
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::mechanics::*;
fn main() {
    for nominal in [false, true] {
        let m = andrews();
        let p = m.parameters.clone();
        let mut model = m.closed();
        if nominal {
            model.nominal = p.iter().enumerate().map(|(i, x)| (i as u32, *x)).collect();
        }
        let a = dynamics_symbolic::check::constraints::analyse(&model);
        println!("{} samples {:?} rank {} {:?}", a.samples.len(), a.looked_at, a.rank, a.findings);
        let c = compile(model).unwrap();
        if let Solution::Unrolled(u) = &c.equations.constraints.as_ref().unwrap().solution {
            println!("{:?} {}", u.elimination, c.programs.accelerations.cost.total());
        }
    }
    let t = std::time::Instant::now();
    let m = n_four_bar(40).closed();
    let a = dynamics_symbolic::check::constraints::analyse(&m);
    println!("analyse {:?} {:?}", t.elapsed(), a.looked_at);
    let mut m2 = m.clone();
    let e = derive(&mut m2).unwrap();
    let t = std::time::Instant::now();
    let f = dynamics_symbolic::check::derived(&mut m2, &e, &a);
    println!("derived {:?} {}", t.elapsed(), f.len());
    let t = std::time::Instant::now();
    let f = dynamics_symbolic::check::conserved(&mut m2, &e);
    println!("conserved {:?} {}", t.elapsed(), f.len());
    let t = std::time::Instant::now();
    let f = dynamics_symbolic::check::declared(&mut m2);
    println!("declared {:?} {}", t.elapsed(), f.len());
    let t = std::time::Instant::now();
    let r = dynamics_symbolic::text::report(&m2, &e, &a, &[], None);
    println!("report {:?} {}", t.elapsed(), r.len());
    let t = std::time::Instant::now();
    let (q, _) = dynamics_symbolic::text::equations(&mut m2, &e);
    println!("equations {:?} {}", t.elapsed(), q.len());
}
