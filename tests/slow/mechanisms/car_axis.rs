//! The car axis: a moving constraint and a small mass; Schneider, Test Set for IVP Solvers (Mazzia, Magherini
//! & Iavernaro).

#[path = "../../models/car_axis.rs"]
mod axis;

use dynamics::prelude::*;

use crate::support::*;

use axis::{CarAxis, model, start};

/// M, Q, Φ_q and γ written from the published equations.
fn by_hand(model: &CarAxis, s: &State<CarAxis>) -> Kkt {
    let w = model.frequency;
    let (yb, yb1, yb2) = (
        model.bump * (w * s.t).sin(),
        model.bump * w * (w * s.t).cos(),
        -model.bump * w * w * (w * s.t).sin(),
    );
    let xb = (model.length.powi(2) - yb * yb).sqrt();
    let xb1 = -yb * yb1 / xb;
    let xb2 = -(yb1 * yb1 + yb * yb2) / xb - (yb * yb1).powi(2) / xb.powi(3);
    let spring = |x: f64, y: f64| {
        let length = x.hypot(y);
        [-(length - model.rest) * x / length, -(length - model.rest) * y / length]
    };
    let ([lx, ly], [rx, ry]) = (spring(s.xl(), s.yl()), spring(s.xr() - xb, s.yr() - yb));
    let weight = model.mass * model.g;
    let m = model.mass;
    let mass = [[m, 0.0, 0.0, 0.0], [0.0, m, 0.0, 0.0], [0.0, 0.0, m, 0.0], [0.0, 0.0, 0.0, m]];
    let (dx, dy) = (s.xl() - s.xr(), s.yl() - s.yr());
    let (du, dv) = (s.xl_rate() - s.xr_rate(), s.yl_rate() - s.yr_rate());
    Kkt::new(
        mass,
        [lx, ly - weight, rx, ry - weight],
        [[xb, yb, 0.0, 0.0], [2.0 * dx, 2.0 * dy, -2.0 * dx, -2.0 * dy]],
        [
            -2.0 * (s.xl_rate() * xb1 + s.yl_rate() * yb1) - s.xl() * xb2 - s.yl() * yb2,
            -2.0 * (du * du + dv * dv),
        ],
    )
}

#[test]
fn the_derived_equations_are_those_by_hand() {
    let model = model();
    let start = start(&model);
    let mut random = Random(2);
    for k in 0..50 {
        let mut around = start;
        around.t = 0.06 * f64::from(k);
        let state = near(&model, &around, &mut random, (0.2, 2.0)).unwrap();
        Kkt::of(&model, &state).assert_equals(&by_hand(&model, &state), 1e-13);
        assert_agreement(&model, &state, &by_hand(&model, &state));
    }
}

const REFERENCE: Reference<'_> = Reference {
    t: 3.0,
    q: &[0.049345578427524032, 0.496989460230008107, 1.041742524885426115, 0.373911027265365820],
    u: &[-0.077058368403592084, 0.007446866592068416, 0.017556815753741734, 0.770341043779601063],
    multipliers: &[-0.004736886590853327, -0.001104680331259566],
};

/// 25 digits by two formulations; what is published to 21 digits is right to 12.5 in the positions, 9.2 in
/// the velocities.
#[test]
fn end_values_in_every_formulation() {
    use Formulation::*;
    let model = model();
    let references = [REFERENCE];
    keeps(
        &model,
        start(&model),
        &references,
        &[
            promise(Projected, 1e-6, [1e-4; 3], [1e-12; 2]),
            promise(Embedded, 1e-6, [1e-4; 3], [1e-12; 2]),
            promise(Projected, 1e-9, [1e-7; 3], [1e-12; 2]),
            promise(Embedded, 1e-9, [1e-7; 3], [1e-12; 2]),
            promise(Projected, 1e-12, [1e-10; 3], [1e-12; 2]),
            promise(Embedded, 1e-12, [1e-10; 3], [1e-12; 2]),
            promise(Augmented, 1e-9, [1e-6; 3], [1e-7; 2]),
            promise(Augmented, 1e-12, [1e-9; 3], [1e-10; 2]),
            promise(BaumgarteTied, 1e-9, [1e-6; 3], [1e-7; 2]),
        ],
    );
    embeds_as_it_projects(&model, start(&model), &references, 3.0);
}

#[test]
fn implicit_end_values() {
    use Formulation::*;
    let model = model();
    let references = [REFERENCE];
    let promises = [
        promise(Projected, 1e-6, [1e-4; 3], [1e-12; 2]),
        promise(Projected, 1e-8, [1e-6, 1e-5, 1e-6], [1e-12; 2]),
        promise(Embedded, 1e-8, [1e-6, 1e-5, 1e-6], [1e-12; 2]),
        promise(Projected, 1e-10, [1e-8, 1e-7, 1e-8], [1e-12; 2]),
    ];
    keeps_with(methods::Radau5, &model, start(&model), &references, &promises);
}

/// With fixed steps, order 2 of multipliers too.
#[test]
fn end_values_by_generalized_alpha() {
    let model = model();
    for rho in [0.2, 0.8] {
        let bounds = (5e-4, [1e-4, 1e-2, 2e-3]);
        keeps_order_2(methods::GeneralizedAlpha { rho }, &model, start(&model), &[REFERENCE], bounds);
    }
}

#[test]
fn end_values_by_series() {
    use Formulation::*;
    let model = model();
    let references = [REFERENCE];
    let promises = [
        promise(Projected, 1e-6, [1e-6, 1e-5, 1e-5], [1e-14; 2]),
        promise(Projected, 1e-8, [1e-8, 1e-7, 1e-7], [1e-14; 2]),
        promise(Embedded, 1e-8, [1e-8, 1e-7, 1e-7], [1e-14; 2]),
        promise(Projected, 1e-12, [1e-12, 1e-11, 1e-12], [1e-14; 2]),
        promise(Augmented, 1e-12, [1e-11, 1e-10, 1e-10], [1e-11; 2]),
    ];
    keeps_with(methods::Taylor { order: None }, &model, start(&model), &references, &promises);
}

/// The road works on the bar: dE/dt is the power of the moving constraint, −λ Φ_t, and of the moving right
/// spring, −∂L/∂t.
#[test]
fn the_work_of_the_road_is_accounted_for() {
    let model = model();
    let motion = model.simulate(start(&model)).until(3.0).tolerance(1e-11).run().unwrap();
    assert!(CarAxis::POWERS.iter().any(|p| p.name == "upright"), "{:?}", CarAxis::POWERS);
    assert!(motion.verify().energy_drift < 1e-8, "{}", motion.verify());
    let change = model.energy_function(&motion.end()) - model.energy_function(&motion.start());
    assert!(change.abs() > 1e-4, "the road does work: {change}");
}
