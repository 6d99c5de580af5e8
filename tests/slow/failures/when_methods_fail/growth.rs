//! Errors that the motion lets grow.

use dynamics::methods::{self, Any};
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

use super::charts;
use super::models::kepler::Kepler;
use super::models::*;

/// Every digit of the tolerance is used up in the same time: about 3 s for this pendulum, whatever the
/// method.
#[test]
fn chaos_uses_up_digits_of_the_tolerance_one_by_one() {
    let mut panel = Panel::new(Axis::new("time in s"), Axis::log("error in parts of the motion"));
    let mut lost = Vec::new();
    // Drawn as long as the curve is the same on every machine.
    for (tolerance, drawn) in [(1e-5, 10.0), (1e-8, 15.0), (1e-11, 22.0)] {
        let run = CHAOTIC.simulate(chaotic_start()).until(40.0).tolerance(tolerance);
        let motion = run.method(methods::Dop853).estimate_error().run().unwrap();
        let estimate = motion.global_error().unwrap();
        let doubling = estimate.doubling_time.unwrap();
        assert!((0.5..1.3).contains(&doubling), "{estimate}");
        let end = estimate.lost_at.unwrap();
        assert!(motion.verify().to_string().contains("nothing later can be trusted"), "{}", motion.verify());
        assert!(end > drawn, "{estimate}");
        lost.push(end);
        let until = estimate.history.iter().copied().filter(|(t, _)| *t <= drawn).collect::<Vec<_>>();
        panel = panel.line(format!("tolerance {tolerance:e}"), charts::envelope(&until, 40));
        // A run without estimate warns, too.
        let plain =
            CHAOTIC.simulate(chaotic_start()).until(40.0).tolerance(tolerance).run().unwrap().verify();
        assert!(plain.to_string().contains("warning      global error about"), "{plain}");
    }
    println!("lost at {lost:.1?}");
    // Six digits, at ln 10/0.9 each or so.
    assert!(lost[0] < lost[1] && (6.0..20.0).contains(&(lost[2] - lost[0])), "{lost:?}");
    charts::is_current("chaos", &Chart::new("A double pendulum by DOP853: error against time").panel(panel));
}

/// What implicit methods make of chaos is told by half steps, also where the model could choose between
/// expressions (a buffer that is never reached).
#[test]
fn implicit_methods_tell_of_chaos_in_models_that_choose() {
    let run = || DUFFING.simulate(DUFFING.state().x(1.0).build().unwrap()).until(60.0);
    let exact = run().tolerance(1e-13).method(methods::Dop853).run().unwrap().end().x();
    let list: [Any<Kicked>; 2] = [methods::Radau5.into(), methods::Esdirk4.into()];
    for (method, tolerance) in
        list.iter().flat_map(|method| [1e-6, 1e-8].map(|tolerance| (method, tolerance)))
    {
        let motion = run().tolerance(tolerance).method(method).run().unwrap();
        let (times, summary) = ((motion.end().x() - exact).abs() / tolerance, motion.verify());
        let shown = summary.accuracy.step_doubling.unwrap();
        println!("{method} {tolerance:e}: {times:.0} permitted errors, half steps show {shown:.0}");
        assert!(times > 1e3 && shown > 0.2 * times, "{times} {summary}");
        assert!(summary.to_string().contains("warning      global error about"), "{summary}");
    }
}

/// Beside an unstable rest steps grow until no method follows e^(λ h), least of all one that damps: the mass
/// stays on its hill in runs that keep their tolerance, in half steps as in whole ones.
#[test]
fn rests_that_are_unstable_are_not_stepped_over() {
    let hill = Kicked { damping: 0.0, force: 0.0, ..DUFFING };
    let list: [Any<Kicked>; 6] = [
        methods::Radau5.into(),
        methods::Esdirk4.into(),
        methods::Tsit5.into(),
        methods::Dop853.into(),
        methods::Verner9.into(),
        methods::Taylor::default().into(),
    ];
    let (mut stayed, mut told) = (0, 0);
    for from in [1e-6, 1e-14] {
        let run = || hill.simulate(hill.state().x(from).build().unwrap()).until(40.0);
        let exact = run().tolerance(1e-14).method(methods::Verner9).max_step(0.5).run().unwrap();
        assert!(exact.steps().any(|state| state.x() > 1.4), "it leaves");
        for (method, k) in list.iter().flat_map(|method| (3..=5).map(move |k| (method, k))) {
            let tolerance = 10f64.powi(-k);
            let motion = run().tolerance(tolerance).method(method).run().unwrap();
            let mut sampler = exact.sampler();
            let off =
                motion.steps().map(|state| (state.x() - sampler.at(state.t).x()).abs()).fold(0.0, f64::max);
            let summary = motion.verify();
            assert!(
                off < 1e3 * tolerance || summary.to_string().contains("warning"),
                "{method} {tolerance:e}: {off:e}\n{summary}"
            );
            stayed += u32::from(motion.steps().all(|state| state.x().abs() < 0.1));
            told += u32::from(summary.to_string().contains("an unstable motion is stepped over"));
            let watched = run().tolerance(tolerance).method(method).max_step(1.0).run().unwrap().verify();
            assert!(watched.accuracy.missed_instability.is_none(), "{method} {tolerance:e}\n{watched}");
        }
        // Steps of a size of their own are no better.
        let fixed = run().fixed_step(10.0).method(methods::Radau5).run().unwrap();
        assert!(
            fixed.end().x().abs() < 0.1 && fixed.verify().to_string().contains("shorten the fixed step"),
            "{}",
            fixed.verify()
        );
    }
    println!("{stayed} runs stayed, {told} were told of");
    // Few stay since absolute tolerances follow small motions; that what long steps make of growth is wrong
    // holds of more.
    assert!(stayed > 1 && told >= 2 * stayed, "{stayed} {told}");
    // What grows within steps that follow it is no doubt, nor is what dies.
    for model in [
        Kicked { stiffness: 1e8, damping: 2e4, cubic: 0.0, ..hill },
        Kicked { stiffness: 1e6, cubic: 0.0, ..hill },
    ] {
        for method in &list[..2] {
            let start = model.state().x(1e-3).build().unwrap();
            let summary =
                model.simulate(start).until(0.5).tolerance(1e-4).method(method).run().unwrap().verify();
            assert!(summary.accuracy.missed_instability.is_none(), "{summary}");
        }
    }
}

/// The nearer the encounter, the more every error before it is amplified by it.
#[test]
fn close_encounters_amplify_errors() {
    let list: [Any<Kepler>; 3] =
        [methods::DormandPrince5.into(), methods::Dop853.into(), methods::Verner9.into()];
    let distances = [0.5, 0.1, 0.01, 0.001];
    let mut panel = Panel::new(Axis::log("nearest distance"), Axis::log("error over tolerance"));
    for method in &list {
        let mut curve = Vec::new();
        for distance in distances {
            let simulation =
                KEPLER.simulate(apocentre(1.0 - distance)).until(20.0).tolerance(1e-9).method(method);
            let motion = simulation.estimate_error().run().unwrap();
            let ratio = motion.global_error().unwrap().ratio.unwrap();
            let summary = motion.verify().to_string();
            assert_eq!(summary.contains("warning"), ratio > 1e3, "{summary}");
            curve.push((distance, ratio));
        }
        assert!(curve[3].1 > 100.0 * curve[0].1 && curve[3].1 > 1e4, "{method} {curve:?}");
        panel = panel.curve(method.to_string(), curve);
    }
    let title = "Three revolutions in Kepler's problem at tolerance 1e-9";
    charts::is_current("close_encounters", &Chart::new(title).panel(panel));
    // A fixed step that does for the rest of the orbit throws the body out.
    let run = |h: f64| KEPLER.simulate(apocentre(0.99)).until(20.0).fixed_step(h).run().unwrap();
    let thrown = run(0.02);
    assert!(thrown.verify().energy_drift > 0.01, "{}", thrown.verify());
    assert!(thrown.verify().to_string().contains("shorten the fixed step"), "{}", thrown.verify());
}
