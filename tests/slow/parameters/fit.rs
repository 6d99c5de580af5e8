//! Fits: what made the data is found, as well as the covariance says.

use dynamics::analysis::{Fit, Loss};
use dynamics::model::Model;
use dynamics::prelude::*;

use super::models::Oscillator;

/// Numbers of mean 0 and variance 1: sums of twelve even ones.
struct Noise(u64);

impl Noise {
    fn even(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.even()).sum::<f64>() - 6.0
    }
}

const TRUE: [f64; 5] = [2.0, 1.2, 50.0, 0.3, 0.0];
const SIGMA: f64 = 0.004;

/// x of the closed form at 60 times, with noise.
fn measured(sigma: f64, seed: u64) -> Vec<(f64, f64)> {
    let mut noise = Noise(seed);
    (1..=60)
        .map(|k| 0.05 * f64::from(k))
        .map(|t| (t, Oscillator::closed(TRUE, t)[0] + sigma * noise.normal()))
        .collect()
}

fn first() -> (Oscillator, <Oscillator as Model>::State) {
    let guess = Oscillator { mass: 2.0, damping: 0.5, stiffness: 42.0 };
    let start = guess.state().x(0.25).build().unwrap();
    (guess, start)
}

const FOUND: [&str; 3] = ["damping", "stiffness", "x"];

#[test]
fn data_without_noise_give_back_what_made_them() {
    let (guess, start) = first();
    let fit = guess.fit(start).find(FOUND).data("x", measured(0.0, 0)).tolerance(1e-11).run().unwrap();
    for (name, value) in [("damping", 1.2), ("stiffness", 50.0), ("x", 0.3)] {
        let found = fit.get(name).unwrap();
        assert!((found.value / value - 1.0).abs() < 1e-8, "{fit}");
    }
    assert!(!fit.to_string().contains("lacks something"), "{fit}");
    assert!(fit.rank == 3 && fit.iterations < 20 && fit.residuals[0].explained > 1.0 - 1e-12, "{fit}");
    assert_eq!(fit.get("damping").unwrap().unit, "N*s/m");
    assert_eq!(fit.get("x").unwrap().unit, "m");
    assert!(fit.get("mass").is_none());
}

/// The scatter of 120 fits is that of the covariance: of each, of pairs, with the noise given and not.
#[test]
fn the_covariance_is_that_of_many_experiments() {
    let (guess, start) = first();
    let fit = |seed: u64, given: bool| {
        let data = measured(SIGMA, seed);
        let fit = guess.fit(start).find(FOUND).tolerance(1e-8);
        if given {
            fit.data_with("x", SIGMA, data).run().unwrap()
        } else {
            fit.data("x", data).run().unwrap()
        }
    };
    let values = |fit: &Fit| [fit.found[0].value, fit.found[1].value, fit.found[2].value];
    let all: Vec<Fit> = (1..=120).map(|seed| fit(seed, true)).collect();
    let count = all.len() as f64;
    let mean = all.iter().map(values).fold([0.0; 3], |s, v| [0, 1, 2].map(|i| s[i] + v[i] / count));
    let scatter = |i: usize, j: usize| {
        all.iter().map(values).map(|v| (v[i] - mean[i]) * (v[j] - mean[j])).sum::<f64>() / (count - 1.0)
    };
    let told = &all[0].covariance;
    for i in 0..3 {
        let ratio = (scatter(i, i) / told[(i, i)]).sqrt();
        // Standard deviations of 120 experiments are known to 6.5 %.
        assert!((ratio - 1.0).abs() < 0.2, "{}: {ratio}\n{}", FOUND[i], all[0]);
        let bias = (mean[i] - [1.2, 50.0, 0.3][i]) / (told[(i, i)] / count).sqrt();
        assert!(bias.abs() < 4.0, "{}: off by {bias} standard errors of the mean", FOUND[i]);
        for j in 0..i {
            let correlation = scatter(i, j) / (scatter(i, i) * scatter(j, j)).sqrt();
            assert!((correlation - all[0].correlation[(i, j)]).abs() < 0.25);
        }
    }
    // χ² has the mean of its degrees of freedom, and a residual of neighbours that is none.
    let reduced = all.iter().filter_map(Fit::reduced_chi_squared).sum::<f64>() / count;
    assert!((reduced - 1.0).abs() < 0.08, "{reduced}");
    let neighbours = all.iter().map(|fit| fit.residuals[0].neighbours).sum::<f64>() / count;
    assert!(neighbours.abs() < 0.1, "{neighbours}");
    // Without the noise given it is found from what is left.
    let (with, without) = (fit(7, true), fit(7, false));
    let ratio = without.covariance[(0, 0)] / with.covariance[(0, 0)] / with.reduced_chi_squared().unwrap();
    assert!((ratio - 1.0).abs() < 1e-3 && !without.absolute, "{ratio}");
    assert!((without.residuals[0].rms / SIGMA - 1.0).abs() < 0.3);
}

#[test]
fn samples_scatter_as_the_covariance_says_and_are_the_same_again() {
    let (guess, start) = first();
    let asked = guess.fit(start).find(FOUND).data("x", measured(SIGMA, 5)).tolerance(1e-8);
    let (fit, sampled) = asked.resample(80, 42).unwrap();
    assert_eq!(sampled.failures(), 0);
    let covariance = sampled.covariance().unwrap();
    for (i, fitted) in fit.found.iter().enumerate() {
        let (error, sampled_error) = (fitted.standard_error.unwrap(), covariance[(i, i)].sqrt());
        assert!((sampled_error / error - 1.0).abs() < 0.3, "{}: {sampled_error} {error}", fitted.name);
        let [low, high] = sampled.interval(&fitted.name, 0.95).unwrap();
        assert!(low < fitted.value && fitted.value < high);
        assert!(((high - low) / (3.92 * error) - 1.0).abs() < 0.4);
    }
    let again = asked.resample(80, 42).unwrap().1;
    assert_eq!(sampled, again);
    assert_ne!(sampled, asked.resample(80, 43).unwrap().1);
}

/// Outputs, velocities and coordinates together, each with its noise; times in any order.
#[test]
fn several_quantities_with_noise_of_their_own() {
    let (guess, start) = first();
    let model = Oscillator::PLAIN;
    let motion =
        model.simulate(model.state().x(0.3).build().unwrap()).until(2.0).tolerance(1e-11).run().unwrap();
    let times = || (0..=40).rev().map(|k| 0.05 * f64::from(k));
    let mut noise = Noise(3);
    let pull: Vec<_> =
        times().map(|t| (t, motion.output("pull", t).unwrap() + 0.2 * noise.normal())).collect();
    let rate: Vec<_> = times().map(|t| (t, motion.at(t).x_rate() + 0.01 * noise.normal())).collect();
    let asked = guess.fit(start).find(["mass", "damping", "stiffness", "x"]);
    let fit = asked.data_with("pull", 0.2, pull).data_with("x_rate", 0.01, rate).run().unwrap();
    for (name, value) in [("mass", 2.0), ("damping", 1.2), ("stiffness", 50.0), ("x", 0.3)] {
        let found = fit.get(name).unwrap();
        assert!(((found.value - value) / found.standard_error.unwrap()).abs() < 4.0, "{fit}");
    }
    assert_eq!((fit.residuals[0].unit.as_str(), fit.residuals[1].unit.as_str()), ("N", "m/s"));
    assert!((0.5..1.6).contains(&fit.reduced_chi_squared().unwrap()), "{fit}");
}

#[test]
fn what_lies_on_its_bound_has_no_error_and_the_others_theirs() {
    let (guess, start) = first();
    let fit = guess.fit(start).find(["stiffness", "x"]).find_within("damping", [0.0, 0.8]);
    let fit = fit.data("x", measured(SIGMA, 9)).run().unwrap();
    let damping = fit.get("damping").unwrap();
    assert!(damping.value == 0.8 && damping.standard_error.is_none(), "{fit}");
    assert!(fit.get("stiffness").unwrap().standard_error.is_some() && fit.rank == 2);
    // The wrong damping leaves what is no noise, and the fit says so.
    assert!(
        fit.residuals[0].neighbours > 0.5 && fit.to_string().contains("the model lacks something"),
        "{fit}"
    );
}

/// Data without noise leave what motions are off by, at any tolerance; and what made them may be zero.
#[test]
fn data_without_noise_settle_where_unknowns_are_zero() {
    let guess = Oscillator { mass: 2.0, damping: 0.5, stiffness: 42.0 };
    for (tolerance, made_with) in
        [(1e-7, 0.0), (1e-8, 1.2), (1e-9, 0.0), (1e-9, 1.2), (1e-11, 0.0), (1e-12, 1.2)]
    {
        let p = [2.0, made_with, 50.0, 0.3, 0.0];
        let data = |scale: f64| {
            (1..=60).map(|k| 0.05 * f64::from(k)).map(move |t| (t, scale * Oscillator::closed(p, t)[0]))
        };
        let start = guess.state().x(0.25).x_rate(0.1).build().unwrap();
        let fit = guess.fit(start).find(["damping", "stiffness", "x", "x_rate"]).tolerance(tolerance);
        let fit = fit
            .data("x", data(1.0))
            .run()
            .unwrap_or_else(|error| panic!("{tolerance}, {made_with}: {error}"));
        for (name, value) in [("damping", made_with), ("stiffness", 50.0), ("x", 0.3), ("x_rate", 0.0)] {
            let found = fit.get(name).unwrap().value;
            assert!(
                (found - value).abs() < 1e2 * tolerance * value.max(1.0),
                "{name} at {tolerance}: {found}"
            );
        }
        let bounded = guess.fit(guess.state().x(0.25).build().unwrap()).find(["stiffness", "x"]);
        let bounded =
            bounded.find_within("damping", [0.0, 5.0]).tolerance(tolerance).data("x", data(1.0)).run();
        assert!((bounded.unwrap().get("damping").unwrap().value - made_with).abs() < 1e2 * tolerance);
    }
}

/// Motions much smaller than their units are computed as finely as others.
#[test]
fn small_motions_are_fitted_as_well_as_large_ones() {
    for scale in [1e-9, 1e-6, 1.0, 1e6] {
        let (guess, _) = first();
        let start = guess.state().x(0.25 * scale).build().unwrap();
        let data = measured(0.0, 0).into_iter().map(|(t, x)| (t, scale * x));
        let fit = guess.fit(start).find(FOUND).data("x", data).run().unwrap();
        for (name, value) in [("damping", 1.2), ("stiffness", 50.0), ("x", 0.3 * scale)] {
            assert!((fit.get(name).unwrap().value / value - 1.0).abs() < 1e-7, "{scale}: {fit}");
        }
    }
}

#[test]
fn intervals_ask_for_a_part_between_none_and_all() {
    let (guess, start) = first();
    let sampled = guess.fit(start).find(FOUND).data("x", measured(SIGMA, 5)).resample(3, 1).unwrap().1;
    assert!([-0.5, 1.5, f64::NAN].iter().all(|part| sampled.interval("x", *part).is_none()));
    assert!(sampled.interval("x", 0.0).is_some_and(|[low, high]| low == high));
}

/// x of the closed form from another start, with noise.
fn measured_from(p: [f64; 5], sigma: f64, seed: u64) -> Vec<(f64, f64)> {
    let mut noise = Noise(seed);
    let times = (1..=60).map(|k| 0.05 * f64::from(k));
    times.map(|t| (t, Oscillator::closed(p, t)[0] + sigma * noise.normal())).collect()
}

/// Two runs from two starts, the second with a mass that is known to be another: what neither tells alone,
/// mass and stiffness, both tell together.
#[test]
fn experiments_share_parameters_and_have_starts_of_their_own() {
    let guess = Oscillator { mass: 1.0, damping: 0.5, stiffness: 42.0 };
    let start = |x: f64| guess.state().x(x).build().unwrap();
    let heavy = [5.0, 1.2, 50.0, -0.5, 0.0];
    let two = |sigma: f64, seed: u64| {
        let asked = guess.fit(start(0.25)).find(["mass", "damping", "stiffness", "x"]);
        let asked = asked.data_with("x", SIGMA, measured_from(TRUE, sigma, seed));
        let asked = asked.experiment(start(-0.4)).known("mass", 5.0).find(["x"]);
        asked.data_with("x", SIGMA, measured_from(heavy, sigma, seed + 1000)).tolerance(1e-10)
    };
    let alone = guess
        .fit(start(0.25))
        .find(["mass", "damping", "stiffness", "x"])
        .data("x", measured_from(TRUE, 0.0, 0));
    assert!(matches!(alone.run(), Err(dynamics::analysis::FitError::Indistinguishable { .. })));
    let fit = two(0.0, 0).run().unwrap();
    let truth =
        [("mass", 2.0), ("damping", 1.2), ("stiffness", 50.0), ("x", 0.3), ("x (experiment 2)", -0.5)];
    for (name, value) in truth {
        assert!((fit.get(name).unwrap().value / value - 1.0).abs() < 1e-8, "{fit}");
    }
    assert_eq!(fit.residuals.iter().map(|r| r.name.as_str()).collect::<Vec<_>>(), ["x", "x (experiment 2)"]);
    assert_eq!(fit.freedom, 115);
    // The scatter of forty is that of the covariance.
    let fits: Vec<Fit> = (1..=40).map(|seed| two(SIGMA, seed).run().unwrap()).collect();
    for (name, value) in truth {
        let off = |fit: &Fit| {
            (fit.get(name).unwrap().value - value) / fit.get(name).unwrap().standard_error.unwrap()
        };
        let mean_square = fits.iter().map(|fit| off(fit).powi(2)).sum::<f64>() / 40.0;
        assert!((0.5..1.7).contains(&mean_square), "{name}: {mean_square}");
    }
    let (_, sampled) = two(SIGMA, 7).resample(60, 1).unwrap();
    let interval = sampled.interval("x (experiment 2)", 0.95).unwrap();
    let error = fits[6].get("x (experiment 2)").unwrap().standard_error.unwrap();
    assert!((0.6..1.5).contains(&((interval[1] - interval[0]) / (4.0 * error))), "{interval:?} {error:e}");
}

/// Each experiment has a law of inputs, and an error of its own where it makes no sense.
#[test]
fn experiments_that_make_no_sense_are_refused() {
    use dynamics::analysis::{FitError, VariableError};
    let (guess, start) = first();
    let asked = || guess.fit(start).find(["damping"]).data("x", measured(0.0, 0)).experiment(start);
    assert_eq!(asked().run().unwrap_err(), FitError::NoSeries);
    assert_eq!(
        asked().known("x", 1.0).data("x", measured(0.0, 0)).run().unwrap_err(),
        FitError::NotAParameter { name: "x".into() }
    );
    assert_eq!(
        asked().find(["damping"]).data("x", measured(0.0, 0)).run().unwrap_err(),
        FitError::Variable(VariableError::Twice { name: "damping".into() })
    );
    let error = asked().data_with("x", 0.1, measured(0.0, 0)).run().unwrap_err();
    assert!(matches!(error, FitError::NoiseOfSome { .. }), "{error}");
    let mut later = start;
    later.t = 5.0;
    let error = guess.fit(start).find(["damping"]).data("x", measured(0.0, 0)).experiment(later);
    let error = error.data("x", measured(0.0, 0)).run().unwrap_err();
    assert!(matches!(&error, FitError::BeforeStart { name, .. } if name == "x (experiment 2)"), "{error}");
    // Known everywhere, it says nothing.
    let known =
        guess.fit(start).known("damping", 1.2).find(["damping", "stiffness"]).data("x", measured(0.0, 0));
    let error = known.run().unwrap_err();
    assert!(
        matches!(&error, FitError::Indistinguishable { groups, .. } if groups == &[["damping"]]),
        "{error}"
    );
}

/// NIST's certified regressions y = b₁ (1 − e^{−b₂ t}), Misra1a and BoxBOD, by the motion that they are: a
/// body that a damper brings to rest, b₂ = c/m and b₁ = ẋ₀/b₂. In these unknowns BoxBOD's farther start leads
/// to the least, too, where in b₁ and b₂ both MINPACK's method and ours settle on a plateau.
#[test]
fn certified_regressions_are_found_through_a_motion() {
    let misra =
        [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0];
    let misra = misra.into_iter().zip([
        10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78,
    ]);
    let misra: Vec<(f64, f64)> = misra.collect();
    let boxes = vec![(1.0, 109.0), (2.0, 149.0), (3.0, 149.0), (5.0, 191.0), (7.0, 213.0), (10.0, 224.0)];
    let of = |b: [f64; 2], data: &[(f64, f64)]| {
        let guess = Oscillator { mass: 1.0, damping: b[1], stiffness: 0.0 };
        let start = guess.state().x_rate(b[0] * b[1]).build().unwrap();
        guess.fit(start).find(["damping", "x_rate"]).data("x", data.to_vec()).tolerance(1e-11).run()
    };
    for (first, data, values, error, squares) in [
        ([500.0, 1e-4], &misra, [238.942_129_18, 5.501_564_318_1e-4], 7.266_868_843_6e-6, 0.124_551_388_94),
        ([250.0, 5e-4], &misra, [238.942_129_18, 5.501_564_318_1e-4], 7.266_868_843_6e-6, 0.124_551_388_94),
        ([100.0, 0.75], &boxes, [213.809_408_89, 0.547_237_485_42], 0.104_559_932_37, 1_168.008_876_6),
        ([1.0, 1.0], &boxes, [213.809_408_89, 0.547_237_485_42], 0.104_559_932_37, 1_168.008_876_6),
    ] {
        let fit = of(first, data).unwrap();
        let (damping, rate) = (fit.get("damping").unwrap(), fit.get("x_rate").unwrap());
        assert!((damping.value - values[1]).abs() < 1e-5 * error, "{first:?} {fit}");
        assert!((rate.value / damping.value / values[0] - 1.0).abs() < 1e-6, "{first:?} {fit}");
        assert!((damping.standard_error.unwrap() / error - 1.0).abs() < 1e-5, "{first:?} {fit}");
        assert!((fit.chi_squared / squares - 1.0).abs() < 1e-9, "{first:?} {fit}");
    }
}

/// Of data with normal noise robust losses find what least squares do, with standard errors little larger; of
/// those of which a tenth are off by 50 to 100 σ they still find it within their errors, which are those of
/// the good ones.
#[test]
fn outliers_do_not_decide_robust_fits() {
    let (guess, start) = first();
    let run = |data: &[(f64, f64)], loss: Loss, given: bool| {
        let fit = guess.fit(start).find(FOUND).loss(loss);
        let data = data.iter().copied();
        if given { fit.data_with("x", SIGMA, data).run() } else { fit.data("x", data).run() }.unwrap()
    };
    for (loss, given) in [(Loss::HUBER, false), (Loss::CAUCHY, true), (Loss::CAUCHY, false)] {
        // How far off, in standard errors: squares of three unknowns in so many measurements.
        let (mut of_clean, mut of_broken, count) = (0.0, 0.0, 3);
        for seed in 0..count {
            let clean = measured(SIGMA, 77 + seed);
            let mut broken = clean.clone();
            for k in 0..6 {
                broken[10 * k + 3].1 += SIGMA * (50.0 + 8.0 * k as f64) * if k % 2 == 0 { 1.0 } else { -0.7 };
            }
            let plain = run(&clean, Loss::Squares, given);
            for (data, sum) in [(&clean, &mut of_clean), (&broken, &mut of_broken)] {
                let fit = run(data, loss, given);
                for (name, value) in [("damping", 1.2), ("stiffness", 50.0), ("x", 0.3)] {
                    let (found, usual) = (fit.get(name).unwrap(), plain.get(name).unwrap());
                    let (error, usual) = (found.standard_error.unwrap(), usual.standard_error.unwrap());
                    *sum += ((found.value - value) / error).powi(2);
                    assert!((0.5..2.0).contains(&(error / usual)), "{loss:?} {given} {seed}: {fit}");
                }
                let light = (0..6).filter(|k| fit.residuals[0].weights[10 * k + 3] < 0.1).count();
                assert!(data == &clean || light == 6, "{fit}");
            }
        }
        let (clean, broken) = (of_clean / 3.0 / count as f64, of_broken / 3.0 / count as f64);
        assert!(clean < 2.5 && broken < 4.0, "{loss:?} {given}: {clean} {broken}");
    }
}
