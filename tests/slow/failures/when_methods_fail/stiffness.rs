//! Forces that act much faster than the motion.

use dynamics::methods::{self, Any};
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

use super::charts;
use super::models::{CHAOTIC, Guided, KEPLER, KICKED, Kicked, Sprung, chaotic_start};

/// An explicit method follows what has long died away: its steps are as long as stability permits, whatever
/// the accuracy.
#[test]
fn explicit_methods_crawl_where_stability_bounds_their_steps() {
    let dampings = [1.0, 10.0, 100.0, 1e3, 1e4];
    let list: [Any<Guided>; 2] = [methods::DormandPrince5.into(), methods::Radau5.into()];
    let mut curves: Vec<Vec<(f64, f64)>> = Vec::new();
    for method in &list {
        let mut curve = Vec::new();
        for damping in dampings {
            let model = Guided::stiff(damping);
            let motion =
                model.simulate(model.on_guide()).until(10.0).tolerance(1e-6).method(method).run().unwrap();
            assert!(Guided::error(&motion) < 1e-4, "{method} {damping}: {:e}", Guided::error(&motion));
            curve.push((damping, motion.summary().steps as f64));
            let warned = motion.verify().to_string().contains("use methods::Radau5");
            assert_eq!(
                warned,
                damping >= 1e3 && method.method() == Method::DormandPrince5,
                "{}",
                motion.verify()
            );
        }
        curves.push(curve);
    }
    let [explicit, implicit] = [&curves[0], &curves[1]].map(|curve| curve[4].1 / curve[1].1);
    assert!(explicit > 100.0 && implicit < 5.0, "{curves:?}");
    // By itself the library goes over.
    let model = Guided::stiff(1e4);
    let chosen = model.simulate(model.on_guide()).until(10.0).tolerance(1e-6).run().unwrap();
    assert!(
        chosen.switched().is_some_and(|(t, method)| t < 1.0 && method == Method::Radau5),
        "{}",
        chosen.verify()
    );

    // At small tolerances, too, where steps of high order stay clear of the border of stability.
    let bob = Sprung { mass: 1.0, stiffness: 1e8, damping: 2e4, length: 1.0, g: 9.81 };
    for tolerance in [1e-6, 1e-7, 1e-9, 1e-10] {
        // Both of them, so that the two have the same absolute one: otherwise trial steps of each say how
        // small the motion is.
        let run =
            || bob.simulate(bob.state().x(1.0).build().unwrap()).until(10.0).tolerances(tolerance, tolerance);
        let (chosen, implicit) = (run().run().unwrap(), run().method(methods::Radau5).run().unwrap());
        assert!(chosen.switched().is_some_and(|(t, _)| t < 1.0), "{tolerance:e}: {}", chosen.verify());
        assert!(chosen.counts().steps < implicit.counts().steps + 2000, "{tolerance:e}: {}", chosen.verify());
    }
    // What needs its steps is left to its method, however many they are.
    let swinging = CHAOTIC.simulate(chaotic_start()).until(200.0).tolerance(1e-9).run().unwrap();
    assert!(swinging.switched().is_none() && swinging.counts().steps > 2500, "{}", swinging.verify());

    let panel = Panel::new(Axis::log("damping in N·s/m"), Axis::log("steps"));
    let panel =
        list.iter().zip(curves).fold(panel, |panel, (method, curve)| panel.curve(method.to_string(), curve));
    charts::is_current("stiffness", &Chart::new("Steps to t = 10 at tolerance 1e-6").panel(panel));
}

/// Stages of Radau IIA are of order 3, its step of order 5; where forces are stiff the stages decide.
#[test]
fn implicit_methods_lose_order_where_forces_are_stiff() {
    let error = |damping: f64, h: f64| {
        let model = Guided::critical(damping);
        let motion = model.simulate(model.on_guide()).until(10.0).fixed_step(h).method(methods::Radau5);
        let motion = motion.estimate_error().run().unwrap();
        let (exact, estimate) = (Guided::error(&motion), motion.global_error().unwrap().coordinates.error);
        // The estimate assumes the order of the step, and is right for the lower one to a factor.
        assert!(
            estimate > 0.5 * exact && estimate < 2.0 * exact,
            "{damping} {h}: {estimate:e} for {exact:e}"
        );
        exact
    };
    let steps = [0.5, 0.25, 0.125, 0.0625];
    let order = |damping: f64| (error(damping, steps[1]) / error(damping, steps[3])).log2() / 2.0;
    let orders = [1.0, 1e6].map(order);
    println!("orders {orders:.2?}, errors {:?}", steps.map(|h| error(1e3, h)));
    assert!(orders[0] > 4.5 && orders[1] < 4.0, "{orders:?}");
    let panel = Panel::new(Axis::log("step in s"), Axis::log("largest error of x in m"));
    let curve = |damping: f64| steps.map(|h| (h, error(damping, h)));
    let panel = panel.curve("damping 1 N·s/m", curve(1.0)).curve("damping 10⁶ N·s/m", curve(1e6));
    charts::is_current("order_reduction", &Chart::new("Radau IIA of order 5 with fixed steps").panel(panel));
}

/// Stages of order 2 follow a stiff direction that turns with order 2: every error is within its tolerance
/// and takes energy away. Half steps show what that adds up to.
#[test]
fn low_stages_lose_what_a_stiff_direction_turns() {
    let spring = super::models::STIFF;
    let start = spring.state().x(1.0).build().unwrap();
    // By a Taylor method of order 20 at tolerance 1e-15.
    let end = [0.2750944764827108, -0.9614174924338752, -4.175584765727972, -1.1947781965930147];
    let run = |method: &Any<Sprung>, tolerance: f64| {
        let motion = spring.simulate(start).until(10.0).tolerance(tolerance).method(method).run().unwrap();
        let state = motion.end();
        let found = [state.q[0], state.q[1], state.u[0], state.u[1]];
        let times = |(x, exact): (f64, f64)| (x - exact).abs() / (tolerance * (1.0 + exact.abs()));
        let error = found.into_iter().zip(end).map(times).fold(0.0, f64::max);
        let summary = motion.verify();
        println!(
            "{method} {tolerance:e}: {error:.1} times, {:.1} shown",
            summary.accuracy.step_doubling.unwrap()
        );
        (error, summary.accuracy.step_doubling.unwrap(), summary.to_string())
    };
    for tolerance in [1e-4, 1e-5, 1e-6] {
        let (error, shown, said) = run(&methods::Esdirk4.into(), tolerance);
        assert!(error > 60.0 && shown > 0.5 * error, "{error} {shown} at {tolerance:e}");
        assert!(
            said.contains("warning      global error about") && said.contains("use methods::Radau5"),
            "{said}"
        );
        let (error, shown, said) = run(&methods::Radau5.into(), tolerance);
        assert!(
            error < 20.0 && shown < 100.0 && !said.contains("warning      global error"),
            "{error} {shown} at {tolerance:e}: {said}"
        );
    }
}

/// Radau IIA takes the energy out of what swings faster than its steps: often what is wanted, seldom what is
/// true.
#[test]
fn implicit_methods_damp_what_oscillates() {
    let spring = super::models::SPRING;
    let start = spring.state().x(1.0).push(0.0).build().unwrap();
    let run =
        |h: f64| spring.simulate(start).until(1000.0).fixed_step(h).method(methods::Radau5).run().unwrap();
    let long = run(1.5);
    assert!(long.energy_at(1000.0) < 0.4 * long.energy_at(0.0), "{}", long.verify());
    assert!(long.verify().to_string().contains("shorten the fixed step"), "{}", long.verify());
    let short = run(0.1);
    assert!((short.energy_at(1000.0) / short.energy_at(0.0) - 1.0).abs() < 1e-4, "{}", short.verify());
    assert!(!short.verify().to_string().contains("warning"), "{}", short.verify());
    // With step control a tolerance is kept, and the energy with it.
    let kept = spring.simulate(start).until(100.0).tolerance(1e-8).method(methods::Radau5).run().unwrap();
    assert!(kept.verify().energy_drift < 1e-5, "{}", kept.verify());
}

/// The generalized-α method damps by the factor that it is given, more the faster something swings; with 1,
/// nothing. Its phase errs in all cases.
#[test]
fn generalized_alpha_damps_by_the_factor_it_is_given() {
    let spring = super::models::SPRING;
    let start = spring.state().x(1.0).push(0.0).build().unwrap();
    let run = |rho: f64, h: f64| {
        let method = methods::GeneralizedAlpha { rho };
        spring.simulate(start).until(1000.0).fixed_step(h).method(method).run().unwrap()
    };
    let left = |motion: &Motion<'_, _>| motion.energy_at(1000.0) / motion.energy_at(0.0);
    let kept: Vec<f64> = [0.0, 0.5, 0.8].map(|rho| left(&run(rho, 0.5))).to_vec();
    println!("{kept:?}");
    assert!(kept[0] < 1e-6 && kept[1] < 0.1 && kept[2] < 0.9 && kept.is_sorted(), "{kept:?}");
    let damped = run(0.5, 0.5);
    assert!(damped.verify().to_string().contains("shorten the fixed step"), "{}", damped.verify());
    assert!((left(&run(1.0, 0.5)) - 1.0).abs() < 0.1);
    let short = run(0.8, 0.01);
    assert!((left(&short) - 1.0).abs() < 1e-4, "{}", short.verify());
    assert!(!short.verify().to_string().contains("warning"), "{}", short.verify());
}

/// At small tolerances error estimates hold steps inside the border of stability, where Hairer's test does
/// not look. Steps that were asked to be short are not stiff, nor are those of what oscillates.
#[test]
fn stiffness_is_told_at_small_tolerances() {
    let guided = Guided::stiff(1e4);
    let list: [Any<Guided>; 4] = [
        methods::Tsit5.into(),
        methods::DormandPrince5.into(),
        methods::Dop853.into(),
        methods::Verner9.into(),
    ];
    for (method, k) in list.iter().flat_map(|method| [8, 10, 12].map(|k| (method, k))) {
        let run = || guided.simulate(guided.on_guide()).until(1.0).tolerance(10f64.powi(-k));
        let summary = run().method(method).run().unwrap().verify();
        assert!(summary.steps > 1000 && summary.to_string().contains("stiff"), "1e-{k}: {summary}");
        assert_eq!(
            summary.accuracy.hidden_stiffness.is_some(),
            summary.stiff_at.is_none(),
            "1e-{k}: {summary}"
        );
    }
    // Where rounding decides what error estimates say, one step is nothing like the next; and in short runs.
    let bob = Sprung { mass: 1.0, stiffness: 1e8, damping: 2e4, length: 1.0, g: 9.81 };
    let list: [(Any<Sprung>, i32, f64); 5] = [
        (methods::Tsit5.into(), 10, 0.01),
        (methods::Verner9.into(), 13, 0.01),
        (methods::GraggBulirschStoer.into(), 10, 0.1),
        (methods::GraggBulirschStoer.into(), 11, 0.01),
        (methods::Dop853.into(), 6, 0.1),
    ];
    for (method, k, until) in &list {
        let run =
            || bob.simulate(bob.state().x(1.0).build().unwrap()).until(*until).tolerance(10f64.powi(-k));
        let (summary, implicit) =
            (run().method(method).run().unwrap().verify(), run().method(methods::Radau5).run().unwrap());
        assert!(summary.steps > 20 * implicit.counts().steps, "{method} 1e-{k}: {summary}");
        assert!(summary.to_string().contains("stiff"), "{method} 1e-{k}: {summary}");
    }
    let start = KEPLER.state().x(1.0).y_rate(1.0).build().unwrap();
    for k in [4, 8, 12] {
        let run = || KEPLER.simulate(start).until(20.0).tolerance(10f64.powi(-k));
        for motion in [run().max_step(0.01).run(), run().method(methods::Tsit5).run(), run().run()] {
            let summary = motion.unwrap().verify();
            assert!(summary.accuracy.hidden_stiffness.is_none(), "1e-{k}: {summary}");
        }
    }
}

/// Steps beyond the border of stability swing, and between their ends they seem to pass where a force sets
/// in: there is nothing where they are made to end, and the next one seems to pass it again.
#[test]
fn steps_that_only_seem_to_pass_a_branch_do_not_creep() {
    let model = Kicked { stiffness: 1e6, damping: 1e4, omega: 1e4, kick: 0.0, buffer: 0.0, ..KICKED };
    let start = model.state().x(-1.0).build().unwrap();
    let list: [Any<Kicked>; 3] =
        [methods::Dop853.into(), methods::Verner9.into(), methods::GraggBulirschStoer.into()];
    for (method, tolerance) in
        list.iter().flat_map(|method| [1e-6, 1e-9].map(|tolerance| (method, tolerance)))
    {
        let motion = model.simulate(start).until(0.5).tolerance(tolerance).method(method).run().unwrap();
        println!("{method} {tolerance:e}: {:?}", motion.counts());
        assert!(motion.counts().steps < 4000 && motion.end().x().abs() < tolerance, "{}", motion.verify());
        assert!(motion.verify().to_string().contains("stiff from t = "), "{}", motion.verify());
    }
}
