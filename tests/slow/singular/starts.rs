//! Starts in change points.

use super::*;

fn flat(model: &Parallelogram, rates: [f64; 3]) -> State<Parallelogram> {
    let mut state = model.start(model.incline, 0.0);
    state.u.copy_from_slice(&rates);
    state
}

/// In line, the velocities say on which branch the mechanism is, and the motion goes on there: with weights
/// its accelerations there are not those of least norm.
#[test]
fn a_flat_start_goes_on_along_its_velocities() {
    for (weight, incline) in [(0.0, 0.0), (2.0, 0.0), (2.0, 0.4)] {
        let model = Parallelogram::new(weight, incline);
        let truth = model.truth(incline, -1.0, 1.5);
        for formulation in
            [Formulation::Projected, Formulation::Augmented, Formulation::Baumgarte { alpha: 5.0, beta: 5.0 }]
        {
            for tolerance in [1e-6, 1e-8, 1e-10, 1e-12] {
                let start = flat(&model, [-1.0, 0.0, -1.0]);
                let run =
                    model.simulate(start).until(1.5).tolerance(tolerance).formulation(formulation).run();
                let end =
                    run.unwrap_or_else(|error| panic!("{weight} {formulation} {tolerance:e}: {error}")).end();
                let error = (end.crank() - truth).abs().max((end.rocker() - end.crank()).abs());
                assert!(
                    error < 10.0 * tolerance + 2e-11,
                    "{weight} {incline} {formulation} {tolerance:e}: {error:e}"
                );
            }
        }
    }
}

/// The other branch: the antiparallelogram, whose rates are as 1 : 2/(1 − b/a) : 1 + 2(b/a)/(1 − b/a).
#[test]
fn a_flat_start_with_the_rates_of_the_antiparallelogram_becomes_one() {
    let model = Parallelogram::new(2.0, 0.0);
    let start = flat(&model, [-1.0, 10.0 / 3.0, 13.0 / 3.0]);
    let run = |start, until: f64| model.simulate(start).until(until).tolerance(1e-11).run().unwrap();
    let end = run(start, 0.9).end();
    // By another way: back from there to beside the position.
    let (back, soon) = (run(end, 0.05).end(), run(start, 0.05).end());
    assert!((back.q - soon.q).norm() < 1e-8 && (back.u - soon.u).norm() < 1e-7, "{back:?} {soon:?}");
    assert!((end.crank() - end.rocker()).abs() > 1.0, "{end:?}");
    let energy = |state| model.kinetic_energy(state) + model.potential_energy(state);
    assert!((energy(&end) - energy(&start)).abs() < 1e-9);
}

/// At rest in line, weights can open it either way.
#[test]
fn a_flat_start_at_rest_under_weights_is_refused() {
    let model = Parallelogram::new(2.0, 0.0);
    let error = model.simulate(flat(&model, [0.0; 3])).until(1.0).run().unwrap_err();
    let SimulationErrorKind::SingularStart { rows, coordinates } = error.kind else { panic!("{error}") };
    assert!(rows.contains("closure.x") && coordinates.contains("coupler"), "{error}");
    assert_eq!(error.time, 0.0);
    assert!(error.to_string().contains("singular position"), "{error}");
    // Without weights it stays.
    let model = Parallelogram::new(0.0, 0.0);
    let end = model.simulate(flat(&model, [0.0; 3])).until(1.0).run().unwrap().end();
    assert_eq!(end.q.norm(), 0.0);
}
