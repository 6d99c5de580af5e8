//! Curves whose branches touch, and others.

#![allow(unreachable_pub, missing_docs, dead_code)]
mod curves;
mod others;
mod probe;

use curves::*;
use dynamics::methods::Any;
use dynamics::prelude::*;

fn methods<M: Simulate>() -> Vec<Any<M>> {
    vec![methods::Dop853.into(), methods::Verner9.into(), methods::Taylor::default().into(), methods::Radau5.into()]
}

const FORMULATIONS: [Formulation; 5] = [
    Formulation::Projected,
    Formulation::Embedded,
    Formulation::Augmented,
    Formulation::BaumgarteTied,
    Formulation::Baumgarte { alpha: 10.0, beta: 10.0 },
];

fn scene(k: usize, pull: f64) -> Scene {
    let turn = 0.7 + 0.61 * k as f64;
    let place = [0.3 * (1.7 * k as f64).sin(), 0.4 * (0.9 + 2.3 * k as f64).cos()];
    let along = if k % 5 == 0 { [1.0, 0.0] } else { [turn.cos(), turn.sin()] };
    Scene { mass: 0.5 + 0.03 * (k % 17) as f64, pull: [0.3 * pull, -0.8 * pull], place, along }
}

fn stress<C: Curve>(name: &str, span: (f64, f64), rate: f64, end: f64) {
    let only: Vec<String> = std::env::var("ONLY").map(|s| s.split(',').map(Into::into).collect()).unwrap_or_default();
    if !only.is_empty() && !only.iter().any(|o| o == name) { return; }
    let starts: usize = std::env::var("STARTS").ok().and_then(|s| s.parse().ok()).unwrap_or(20);
    let pick = |var: &str, text: &str| std::env::var(var).map_or(true, |v| text.contains(&v));
    let tols: Vec<i32> = std::env::var("TOLS").map(|s| s.split(',').map(|t| t.parse().unwrap()).collect()).unwrap_or((4..=12).collect());
    let verbose = std::env::var("VERBOSE").is_ok();
    let mut total = [0usize; 5];
    for formulation in FORMULATIONS {
        for method in methods::<C::Bead>() {
            let label = format!("{formulation} {method}");
            if !pick("FORM", &label) { continue; }
            let mut line = format!("{name:11} {label:45}");
            for &digits in &tols {
                let tolerance = 10f64.powi(-digits);
                let mut counts = [0usize; 5];
                for k in 0..starts {
                    let scene = scene(k, if k % 3 == 0 { 0.0 } else { 0.4 });
                    let model = C::bead(&scene);
                    let part = (k as f64 * 0.618).fract();
                    let at = (span.0 + (span.1 - span.0) * part, rate * (0.8 + 0.4 * (k as f64 * 0.37).fract()));
                    let truth = C::truth(&scene, at, end);
                    let start = C::start(&model, &scene, at);
                    let run = model.simulate(start).until(end).method(&method).formulation(formulation).tolerance(tolerance).max_steps(20000).run();
                    match run {
                        Ok(motion) => {
                            let place = scene.out(truth);
                            let off = (0..2).map(|i| (motion.end().q()[i] - place[i]).abs()).fold(0.0, f64::max);
                            let bound = 1e3 * tolerance.powf(0.8) + 1e-6;
                            let words = motion.summary().to_string();
                            let warns = words.contains("\n  warning ");
                            let kind = match (off < bound, warns) { (true, false) => 0, (true, true) => 1, (false, true) => 3, (false, false) => 4 };
                            counts[kind] += 1;
                            if verbose && kind > 0 {
                                let warning = words.lines().filter(|l| l.trim_start().starts_with("warning")).collect::<Vec<_>>().join(" | ");
                                println!("   {k} {label} 1e-{digits}: off {off:e} warns {warns} {:?} {warning}", motion.summary().nearest.map(|n| (n.condition, n.time, n.passed)));
                            }
                        }
                        Err(error) => {
                            counts[2] += 1;
                            if verbose { println!("   {k} {label} 1e-{digits}: t {} {}", error.time, error.kind); }
                        }
                    }
                }
                (0..5).for_each(|i| total[i] += counts[i]);
                let [a, b, c, d, e] = counts;
                line += &format!(" {digits}:{a}/{b}/{c}/{d}/{}", if e > 0 { format!("**{e}**") } else { "0".into() });
            }
            println!("{line}");
        }
    }
    println!("{name}: right {} right-warned {} err {} wrong-warned {} WRONG {}", total[0], total[1], total[2], total[3], total[4]);
}

#[test]
fn all() {
    stress::<tacnode::At>("tacnode", (-0.9, -0.4), 1.0, 2.0);
    stress::<inside::At>("inside", (-0.9, -0.4), 1.0, 2.0);
    stress::<outside::At>("outside", (-0.9, -0.4), 1.0, 2.0);
    stress::<osculating::At>("osculating", (-0.9, -0.4), 1.0, 2.0);
    stress::<rose::At>("rose", (-0.7, -0.3), 0.7, 2.0);
    stress::<trifolium::At>("trifolium", (0.1, 0.3), 0.5, 2.0);
    stress::<lemniscate::At>("lemniscate", (0.8, 1.2), 1.0, 1.5);
    stress::<node::At>("node", (-1.3, -1.1), 0.8, 1.0);
    stress::<acute::At>("acute", (-0.9, -0.4), 1.0, 2.0);
}
