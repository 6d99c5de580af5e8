//! Statistics against closed forms.

use std::f64::consts::PI;

use dynamics::ensembles::{EnsembleTable, ImportanceDesign, OpenEnsemble, Samples};

use super::double_pendulum::DoublePendulum;
use super::{MODEL, start};

/// T. Ishigami & T. Homma, 1990: sin x₁ + a sin² x₂ + b x₃⁴ sin x₁, of inputs between −π and
/// π.
fn ishigami([x1, x2, x3]: [f64; 3]) -> f64 {
    x1.sin() + A * x2.sin().powi(2) + B * x3.powi(4) * x1.sin()
}

const A: f64 = 7.0;
const B: f64 = 0.1;

fn table(samples: ImportanceDesign) -> EnsembleTable {
    let of = |model: &DoublePendulum, _| [ishigami([model.l1, model.l2, model.g])];
    MODEL.ensemble(start(), samples).compute(["y"], of).run().unwrap()
}

fn cube(samples: Samples) -> Samples {
    ["l1", "l2", "g"].into_iter().fold(samples, |samples, name| samples.uniform(name, -PI, PI))
}

#[test]
fn importance_is_that_of_ishigamis_function() {
    let of_first = 0.5 * (1.0 + B * PI.powi(4) / 5.0).powi(2);
    let of_second = A * A / 8.0;
    let of_both = B * B * PI.powi(8) * 8.0 / 225.0;
    let variance = of_first + of_second + of_both;
    let first_order = [of_first / variance, of_second / variance, 0.0];
    let total = [(of_first + of_both) / variance, of_second / variance, of_both / variance];
    let table = table(cube(Samples::sobol(4096)).for_importance());
    assert_eq!(table.len(), 4096 * 5);
    let found = table.importance("y").unwrap();
    assert!((found.variance / variance - 1.0).abs() < 1e-2, "{found}");
    assert_eq!((found.groups, found.left_out), (4096, 0));
    for (i, input) in found.inputs.iter().enumerate() {
        assert!((input.first_order - first_order[i]).abs() < 1e-2, "{found}");
        assert!((input.total - total[i]).abs() < 1e-2, "{found}");
        let within = |[low, high]: [f64; 2], x: f64| low < x && x < high && high - low < 0.2;
        assert!(within(input.first_order_interval, first_order[i]), "{found}");
        assert!(within(input.total_interval, total[i]), "{found}");
    }
    assert_eq!(found.inputs[0].input, "l1");
}

/// Over forty seeds the 95 % intervals enclose the closed forms about as often as they say. A bootstrap is
/// not exact, so the bound is wide: 3 × 40 × 2 intervals, of which 12 should miss.
#[test]
fn intervals_enclose_the_closed_forms() {
    let of_first = 0.5 * (1.0 + B * PI.powi(4) / 5.0).powi(2);
    let (of_second, of_both) = (A * A / 8.0, B * B * PI.powi(8) * 8.0 / 225.0);
    let variance = of_first + of_second + of_both;
    let first_order = [of_first / variance, of_second / variance, 0.0];
    let total = [(of_first + of_both) / variance, of_second / variance, of_both / variance];
    let mut missed = 0;
    for seed in 0..40 {
        let found = table(cube(Samples::random(256, seed)).for_importance()).importance("y").unwrap();
        for (i, input) in found.inputs.iter().enumerate() {
            let misses = |[low, high]: [f64; 2], x: f64| usize::from(x < low || high < x);
            missed += misses(input.first_order_interval, first_order[i]);
            missed += misses(input.total_interval, total[i]);
        }
    }
    assert!((3..=28).contains(&missed), "{missed} of 240 missed");
}

/// A linear function of normal inputs: each has its part of the variance, alone and in total.
#[test]
fn importance_of_a_linear_function() {
    let samples =
        Samples::sobol(2048).normal("m1", 1.0, 0.1).normal("m2", 5.0, 0.2).log_uniform("g", 1.0, 2.0);
    let of = |model: &DoublePendulum, _| [3.0 * model.m1 - 2.0 * model.m2];
    let table = MODEL.ensemble(start(), samples.for_importance()).compute(["y"], of).run().unwrap();
    let found = table.importance("y").unwrap();
    let (a, b) = (0.09, 0.16);
    for (input, part) in found.inputs.iter().zip([a / (a + b), b / (a + b), 0.0]) {
        assert!((input.first_order - part).abs() < 1e-2 && (input.total - part).abs() < 1e-2, "{found}");
    }
    let constant = |_: &DoublePendulum, _| [2.0];
    let samples = cube(Samples::sobol(64)).for_importance();
    let table = MODEL.ensemble(start(), samples).compute(["y"], constant).run().unwrap();
    let error = table.importance("y").unwrap_err().to_string();
    assert!(error.contains("the same in all runs"), "{error}");
}

/// Groups with a run that failed are left out and counted.
#[test]
fn failed_runs_leave_their_group_out() {
    let of = |model: &DoublePendulum, _| {
        let y = ishigami([model.l1, model.l2, model.g]);
        if model.l1 > 3.0 { Err(dynamics::analysis::RunFailure::new("too long")) } else { Ok([y]) }
    };
    let samples = cube(Samples::sobol(1024)).for_importance();
    let table = MODEL.ensemble(start(), samples).compute(["y"], of).run().unwrap();
    let found = table.importance("y").unwrap();
    assert!(found.left_out > 20 && found.groups + found.left_out == 1024, "{found}");
    assert!(found.to_string().contains("groups were left out"), "{found}");
}

#[test]
fn quantiles_and_means_of_normal_samples() {
    let samples = Samples::sobol(1 << 13).normal("m1", 3.0, 0.5);
    let of = |model: &DoublePendulum, _| [model.m1];
    let table = MODEL.ensemble(start(), samples).compute(["m"], of).run().unwrap();
    let mean = table.mean("m").unwrap();
    assert!((mean.value - 3.0).abs() < 1e-3 && (mean.deviation - 0.5).abs() < 1e-3, "{mean}");
    let quantile = table.quantile("m", 0.975).unwrap();
    assert!((quantile.value - 3.979_981_992).abs() < 5e-3, "{quantile}");
    assert!(quantile.low < 3.98 && 3.98 < quantile.high && quantile.coverage >= 0.95, "{quantile}");
    let sure = table.quantile_with("m", 0.975, 0.999).unwrap();
    assert!(sure.low < quantile.low && quantile.high < sure.high, "{sure}");
}
