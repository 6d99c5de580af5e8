//! Fits that cannot be: an error with what is wrong, and no numbers that look like a result.

use dynamics::analysis::{FitError, Loss, SensitivityError, VariableError};
use dynamics::model::Model;
use dynamics::prelude::*;

use super::models::{Angle, Oscillator};

fn data(count: u32) -> Vec<(f64, f64)> {
    let p = [2.0, 1.2, 50.0, 0.3, 0.0];
    (1..=count).map(|k| 0.05 * f64::from(k)).map(|t| (t, Oscillator::closed(p, t)[0])).collect()
}

fn asked() -> (Oscillator, <Oscillator as Model>::State) {
    let model = Oscillator { mass: 2.2, damping: 1.0, stiffness: 48.0 };
    let start = model.state().x(0.3).build().unwrap();
    (model, start)
}

/// Mass, damping and stiffness scaled together move alike.
#[test]
fn what_cannot_be_told_apart_is_named() {
    let (model, start) = asked();
    let error =
        model.fit(start).find(["mass", "damping", "stiffness"]).data("x", data(60)).run().unwrap_err();
    let FitError::Indistinguishable { groups, values, chi_squared } = &error else { panic!("{error}") };
    assert_eq!(*groups, [["mass", "damping", "stiffness"]]);
    // The search came to the valley: ratios are those of the data.
    let value = |name: &str| values.iter().find(|(n, _)| n == name).unwrap().1;
    assert!((value("stiffness") / value("mass") - 25.0).abs() < 1e-3 && *chi_squared < 1e-10);
    assert!(
        error.to_string().contains("do not tell `mass`, `damping`, `stiffness` apart; hold some of them"),
        "{error}"
    );
    // A force among the data tells the scale.
    let motion = Oscillator::PLAIN;
    let motion = motion.simulate(motion.state().x(0.3).build().unwrap()).until(3.0).run().unwrap();
    let pull = data(60).into_iter().map(|(t, _)| (t, motion.output("pull", t).unwrap()));
    let fit = model.fit(start).find(["mass", "damping", "stiffness"]).data("x", data(60)).data("pull", pull);
    let fit = fit.run().unwrap();
    assert!((fit.get("mass").unwrap().value - 2.0).abs() < 1e-6, "{fit}");
}

#[test]
fn what_has_no_influence_is_named() {
    let angle = Angle { mass: 0.4, length: 1.3, g: 9.81, push: 0.0 };
    let start = angle.state().theta(0.8).build().unwrap();
    let motion = angle.simulate(start).until(3.0).run().unwrap();
    let data: Vec<_> = (1..40).map(|k| 0.07 * f64::from(k)).map(|t| (t, motion.at(t).theta())).collect();
    let error = angle.fit(start).find(["mass", "length"]).data("theta", data.clone()).run().unwrap_err();
    assert!(matches!(&error, FitError::Indistinguishable { groups, .. } if *groups == [["mass"]]), "{error}");
    let error = angle.fit(start).find(["g", "length"]).data("theta", data).run().unwrap_err();
    assert!(
        matches!(&error, FitError::Indistinguishable { groups, .. } if *groups == [["g", "length"]]),
        "{error}"
    );
}

#[test]
fn data_that_make_no_sense_are_refused_with_their_row() {
    let (model, start) = asked();
    let fit = || model.fit(start).find(["damping", "stiffness"]);
    let mut broken = data(20);
    broken[7].1 = f64::NAN;
    let error = fit().data("x", broken).run().unwrap_err();
    assert!(
        matches!(&error, FitError::NotANumber { name, row: 7, value, .. } if name == "x" && value.is_nan()),
        "{error}"
    );
    let mut early = data(20);
    early[3].0 = -0.1;
    let error = fit().data("x", early).run().unwrap_err();
    assert!(matches!(error, FitError::BeforeStart { row: 3, time: -0.1, start: 0.0, .. }), "{error}");
    let error = fit().data("x", data(2)).run().unwrap_err();
    assert_eq!(error, FitError::TooFewData { data: 2, unknowns: 2, noise: true });
    let error = fit().data_with("x", 0.1, data(1)).run().unwrap_err();
    assert_eq!(error, FitError::TooFewData { data: 1, unknowns: 2, noise: false });
    assert!(matches!(fit().data("x", []).run().unwrap_err(), FitError::NoData { .. }));
    assert_eq!(fit().run().unwrap_err(), FitError::NoSeries);
    assert_eq!(
        fit().data("x", [(0.0, 0.3), (0.0, 0.3), (0.0, 0.3)]).run().unwrap_err(),
        FitError::OneInstant { time: 0.0 }
    );
    assert!(matches!(
        fit().data_with("x", 0.0, data(20)).run().unwrap_err(),
        FitError::Noise { sigma: 0.0, .. }
    ));
    let error = fit().data_with("x", 0.1, data(20)).data("pull", data(20)).run().unwrap_err();
    assert_eq!(error, FitError::NoiseOfSome { without: "pull".into() });
}

#[test]
fn names_and_bounds_that_make_no_sense_are_refused() {
    let (model, start) = asked();
    let fit = || model.fit(start).data("x", data(20));
    assert_eq!(fit().run().unwrap_err(), FitError::NothingToFind);
    let error = fit().find(["stifness"]).run().unwrap_err();
    assert!(matches!(
        &error,
        FitError::Variable(VariableError::Unknown { nearest: Some(n), .. })
        if n == "stiffness"
    ));
    let error = model.fit(start).find(["mass"]).data("y", data(20)).run().unwrap_err();
    assert!(matches!(error, FitError::Motion(SensitivityError::UnknownQuantity { .. })), "{error}");
    for bounds in [[50.0, 60.0], [60.0, 40.0], [f64::NAN, 60.0]] {
        let error = fit().find_within("stiffness", bounds).run().unwrap_err();
        assert!(matches!(error, FitError::Bounds { first: 48.0, .. }), "{error}");
    }
    let massless = Oscillator { mass: 0.0, ..model.clone() };
    let error = massless.fit(start).find(["stiffness"]).data("x", data(20)).run().unwrap_err();
    assert!(matches!(error, FitError::FirstValues { .. }), "{error}");
}

/// What was found before is in the error.
#[test]
fn a_search_that_is_cut_short_is_no_result() {
    let (model, start) = asked();
    let error =
        model.fit(start).find(["damping", "stiffness"]).data("x", data(60)).iterations(1).run().unwrap_err();
    let FitError::NotSettled { iterations: 1, so_far } = &error else { panic!("{error}") };
    assert!(so_far.found.len() == 2 && so_far.chi_squared > 0.0);
}

/// One datum that is off by a thousand, or by what no square holds: an error that names it, and no numbers
/// that look like a result.
#[test]
fn a_datum_that_is_far_off_is_named() {
    let (model, start) = asked();
    for (row, by) in [(3, 1e3), (59, -1e3), (40, 1e12)] {
        let mut broken = data(60);
        broken[row].1 += by;
        match model.fit(start).find(["damping", "stiffness", "x"]).data("x", broken.clone()).run() {
            Ok(fit) => {
                assert_eq!(fit.outlier().map(|outlier| outlier.row), Some(row), "{fit}");
                assert!(fit.to_string().contains(&format!("row {row} of `x` (t = ")), "{fit}");
            }
            Err(FitError::Outlier { outlier, .. }) => assert_eq!(outlier.row, row, "{by}: {outlier}"),
            Err(error) => panic!("{row} {by}: {error}"),
        }
        for loss in [Loss::HUBER, Loss::CAUCHY] {
            let fit =
                model.fit(start).find(["damping", "stiffness", "x"]).data("x", broken.clone()).loss(loss);
            let fit = fit.run().unwrap_or_else(|error| panic!("{row} {by} {loss:?}: {error}"));
            // The mass is a tenth more than that of the data.
            let found = fit.get("stiffness").unwrap();
            let off = (found.value - 55.0).abs();
            assert!(off < 1e-4 || off < 4.0 * found.standard_error.unwrap(), "{row} {by}: {fit}");
            assert!(fit.residuals[0].weights[row] < 1e-6 && fit.residuals[0].weights.len() == 60, "{fit}");
        }
    }
    let mut broken = data(20);
    broken[7].1 = 1e160;
    for loss in [Loss::Squares, Loss::CAUCHY] {
        let error =
            model.fit(start).find(["damping", "stiffness"]).data("x", broken.clone()).loss(loss).run();
        let error = error.unwrap_err();
        assert!(matches!(error, FitError::TooLarge { row: 7, value: 1e160, .. }), "{error}");
    }
    for limit in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = model
            .fit(start)
            .find(["damping"])
            .data("x", data(20))
            .loss(Loss::Huber(limit))
            .run()
            .unwrap_err();
        assert!(matches!(error, FitError::Loss { .. }), "{error}");
    }
}

/// Wherever the outlier lies and whatever the search comes to by it, also where unknowns cannot be told apart
/// at its end: the datum, its time, how far off it is, and what helps.
#[test]
fn what_an_outlier_leads_to_names_it() {
    let (model, start) = asked();
    let mut refused = 0;
    for (row, by) in [(0, -1e3), (3, 1e3), (20, 1e3), (40, 1e3), (59, -1e3)] {
        for find in [&["damping", "stiffness"][..], &["damping", "stiffness", "x"]] {
            let mut broken = data(60);
            broken[row].1 += by;
            let Err(error) = model.fit(start).find(find).data("x", broken).run() else { continue };
            let FitError::Outlier { outlier, .. } = &error else { panic!("{row} {by}: {error}") };
            assert!(outlier.row == row && outlier.times > 1e3 && outlier.part > 0.5, "{row} {by}: {error}");
            let said = error.to_string();
            assert!(said.starts_with(&format!("row {row} of `x` (t = ")), "{said}");
            assert!(said.contains(" m off, ") && said.contains("`.loss(Loss::CAUCHY)`"), "{said}");
            refused += 1;
        }
    }
    assert!(refused > 0, "no search failed");
}

/// A first value at which nothing can be simulated is blamed itself, and not the tolerance.
#[test]
fn first_values_without_a_motion_are_named() {
    let (model, start) = asked();
    for stiffness in [1e160, -1e160] {
        let far = Oscillator { stiffness, ..model.clone() };
        let error = far.fit(start).find(["damping", "stiffness"]).data("x", data(20)).run().unwrap_err();
        let said = error.to_string();
        assert!(matches!(&error, FitError::FirstValues { values, .. } if values[1].1 == stiffness), "{said}");
        assert!(
            said.contains("first values `damping` = 1, `stiffness` = ") && said.contains("e160; begin"),
            "{said}"
        );
        assert!(said.contains("the acceleration of `x` is ") && !said.contains("tolerance"), "{said}");
    }
    let far = model.state().x(1e160).build().unwrap();
    let error = model.fit(far).find(["stiffness", "x"]).data("x", data(20)).run().unwrap_err();
    assert!(error.to_string().contains("`x` = 1e160; begin with values"), "{error}");
}
