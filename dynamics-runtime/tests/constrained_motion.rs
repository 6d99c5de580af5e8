//! Motions of constrained models: drift by formulation, reactions, and runs that leave their constraints and say so.

mod common;

use common::constrained::Rod;
use common::*;
use dynamics_runtime::model::Constraints;
use dynamics_runtime::motion::{Formulation, Method, Motion, Simulate};

const ROD: Rod = Rod { m: 2.0, l: 1.5, g: 9.81 };

/// On the rod at an angle from the lowest point, moving with angular velocity ω.
fn on_rod(theta: f64, omega: f64) -> PlainState<2, 0> {
    let (s, c) = theta.sin_cos();
    at_rest_or_not([ROD.l * s, -ROD.l * c], [ROD.l * omega * c, ROD.l * omega * s])
}

const ALL: [Formulation; 5] = [
    Formulation::Augmented,
    Formulation::Baumgarte { alpha: 5.0, beta: 5.0 },
    Formulation::BaumgarteTied,
    Formulation::Projected,
    Formulation::Embedded,
];

#[test]
fn every_formulation_follows_the_pendulum() {
    let minimal = Pendulum { m: ROD.m, l: ROD.l, g: ROD.g };
    let exact = minimal.simulate(at_rest_or_not([2.0], [0.5])).until(10.0).tolerance(1e-13).run().unwrap();
    for method in [Method::DormandPrince5, Method::Dop853] {
        for formulation in ALL {
            let run =
                ROD.simulate(on_rod(2.0, 0.5)).until(10.0).tolerance(1e-9).method(method).formulation(formulation);
            let motion = run.run().unwrap();
            for t in [0.3, 2.0, 5.5, 10.0] {
                let (state, theta) = (motion.at(t), exact.at(t));
                let wanted = on_rod(theta.q[0], theta.u[0]);
                let error = (state.q - wanted.q).amax().max((state.u - wanted.u).amax());
                assert!(error < 2e-6, "{method} {formulation} at {t}: {error:e}");
                // λ = −tension/l for Φ = ½(x² + y² − l²).
                let tension = minimal_tension(&exact, t);
                let lambda = motion.reaction_at("rod", t).unwrap()[0];
                assert!((lambda + tension / ROD.l).abs() < 1e-4, "{formulation} at {t}: {lambda} {tension}");
            }
        }
    }
}

fn minimal_tension(exact: &Motion<'_, Pendulum>, t: f64) -> f64 {
    exact.output("tension", t).unwrap()
}

/// 1,000 s: what is projected stays, what is not drifts, and each says how far.
#[test]
fn drift_over_a_thousand_seconds() {
    let run = |formulation| {
        let run = ROD.simulate(on_rod(2.0, 0.0)).until(1000.0).tolerance(1e-9).formulation(formulation);
        run.run().unwrap().summary()
    };
    let [augmented, gains, tied, projected, embedded] = ALL.map(run);
    let drift = |summary: &dynamics_runtime::motion::Summary| {
        let rod = &summary.constraints[0];
        (rod.residual, rod.velocity_residual)
    };
    for summary in [&augmented, &gains, &tied, &projected, &embedded] {
        println!("{summary}\n");
    }
    for summary in [&projected, &embedded] {
        assert!(drift(summary).0 < 1e-12 && drift(summary).1 < 1e-12, "{summary}");
    }
    assert!(embedded.upkept.repartitions > 1000, "{embedded}");
    assert!(drift(&augmented).0 > 1e-7, "{augmented}");
    for summary in [&gains, &tied] {
        let (position, velocity) = drift(summary);
        assert!(position < 1e-8 && velocity < 1e-7 && position > 1e-14, "{summary}");
    }
}

/// However long a constrained run is, it allocates a fixed number of times.
#[test]
fn constrained_steps_do_not_allocate() {
    for formulation in ALL {
        let observed = |end: f64| {
            let mut states = 0_u64;
            let simulation = ROD.simulate(on_rod(2.0, 0.5)).until(end).formulation(formulation);
            let info = allocation_counter::measure(|| {
                simulation.run_with(|_| states += 1).unwrap();
            });
            (states, info.count_total)
        };
        let ((few, short), (many, long)) = (observed(1.0), observed(30.0));
        assert!(many > 20 * few, "{formulation}: {few} {many}");
        assert_eq!(short, long, "{formulation}");
    }
}

/// Gains tied to the step take an error back in two steps, down to what the curvature of the constraint leaves of it.
#[test]
fn tied_gains_take_an_error_back_in_two_steps() {
    let off = 1e-6;
    let mut start = on_rod(0.5 * core::f64::consts::PI, 0.0);
    start.q[0] += off / ROD.l;
    for h in [1e-2, 1e-3, -1e-3] {
        let run = ROD.simulate(start).until(6.0 * h).method(Method::Rk4).fixed_step(f64::abs(h));
        let motion = run.formulation(Formulation::BaumgarteTied).run().unwrap();
        let residuals: Vec<f64> = motion.steps().map(|state| ROD.residual(&state)[0]).collect();
        // [½, ¼; −1, −½] halves Φ, and then leaves nothing.
        assert!((residuals[1] / off - 0.5).abs() < 1e-2, "{h}: {residuals:?}");
        assert!(residuals[2..].iter().all(|residual| residual.abs() < 1e-3 * off), "{h}: {residuals:?}");
        // What lies between two steps is the step's own.
        let middle = ROD.residual(&motion.at(0.5 * h))[0];
        assert!(middle < off && middle > 0.5 * off, "{h}: {middle:e}");
    }
    // Where the step is chosen it is not the push of the step before that chooses it.
    for method in [Method::DormandPrince5, Method::Dop853] {
        let run = ROD.simulate(start).until(1.0).tolerance(1e-9).method(method);
        let motion = run.formulation(Formulation::BaumgarteTied).run().unwrap();
        let drift = ROD.residual(&motion.end())[0];
        assert!(drift.abs() < 1e-8 && motion.counts().steps < 100, "{method}: {drift:e}, {}", motion.summary());
    }
}
