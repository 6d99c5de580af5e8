//! The stiff flyball governor; IFToMM problem A05, González et al. 2006.

#[path = "../../models/governor.rs"]
mod flyball;

use core::f64::consts::PI;

use dynamics::prelude::*;

use crate::support::*;

use flyball::{Governor, model};

fn state(model: &Governor, [psi, s, b]: [f64; 3], [dpsi, ds, db]: [f64; 3]) -> State<Governor> {
    let builder = model.state().psi(psi).slider(psi).arm([psi; 2]).s(s).b([b; 2]);
    builder.psi_rate(dpsi).slider_rate(dpsi).arm_rate([dpsi; 2]).s_rate(ds).b_rate([db; 2]).build().unwrap()
}

/// t, (ψ, s, b), (ψ̇, ṡ, ḃ), T + V; two precisions agree to 31 digits, a model with independent rods to 30.
const REFERENCE: &[(f64, [f64; 3], [f64; 3], f64)] = &[
    (
        0.1,
        [0.622106681402687571, 0.523836475569575694, 0.496173869075900256],
        [6.103717808830862765, 0.459271810436133879, -0.522673929753980212],
        237.411567985615655,
    ),
    (
        0.5,
        [2.807679488367901602, 0.743249424786325722, 0.259491381543413121],
        [5.103415421971535298, 0.052119780175358373, -0.053905218498742484],
        237.411518921963598,
    ),
    (
        1.0,
        [5.586346965869005428, 0.501420922379567652, 0.521833301625546230],
        [6.271125741876554791, -0.122151492897728940, 0.140885579479526949],
        237.411481701668274,
    ),
    (
        2.0,
        [11.173267075661249066, 0.505909294296703709, 0.516663797364598735],
        [6.236223614435971452, -0.240783146983646534, 0.276926188572188530],
        237.411407448797868,
    ),
];

#[test]
fn the_published_energies_and_stiff_motion() {
    use Formulation::*;
    let model = model();
    for (t, q, u, energy) in REFERENCE {
        let state = state(&model, *q, *u);
        assert!((model.energy_function(&state) - energy).abs() < 1e-9, "t = {t}");
    }
    let start = state(&model, [0.0, 0.5, PI / 6.0], [2.0 * PI, 0.0, 0.0]);
    let states: Vec<_> = REFERENCE.iter().map(|(t, q, u, _)| (*t, state(&model, *q, *u))).collect();
    let torques: Vec<_> = states.iter().map(|(_, s)| torques(&model, s)).collect();
    let references: Vec<Reference<'_>> = states
        .iter()
        .zip(&torques)
        .map(|((t, s), multipliers)| Reference { t: *t, q: s.q.as_slice(), u: s.u.as_slice(), multipliers })
        .collect();
    // The eigenvalue −8.1e3/s bounds the step of an explicit method, not its error.
    let bounds = [
        promise(Projected, 1e-9, [1e-7; 3], [1e-12; 2]),
        promise(BaumgarteTied, 1e-9, [1e-7; 3], [1e-10; 2]),
    ];
    keeps(&model, start, &references, &bounds);
    // By itself a run goes over to Radau IIA: an eighth of the evaluations, and velocities to 4e-12 in place
    // of 2e-13.
    keeps(&model, start, &references, &[promise(Projected, 1e-13, [1e-13, 1e-11, 2e-11], [1e-12; 2])]);
    let explicit = [promise(Projected, 1e-13, [1e-13, 1e-11, 2e-12], [1e-12; 2])];
    keeps_with(methods::Dop853, &model, start, &references, &explicit);
    let implicit =
        [promise(Projected, 1e-6, [1e-4; 3], [1e-12; 2]), promise(Projected, 1e-9, [1e-7; 3], [1e-12; 2])];
    keeps_with(methods::Radau5, &model, start, &references, &implicit);
    embeds_as_it_projects(&model, start, &references, 3.0);
}

/// The torques of key and hinges, by the angular momentum of what they drive: λ = d/dt (J ψ̇) of each, with
/// ψ̈ of the whole.
fn torques(model: &Governor, state: &State<Governor>) -> [f64; 3] {
    let (b, db, spin) = (state.b(0), state.b_rate(0), state.psi_rate());
    let at = |part: f64| model.offset + part * model.l * b.cos();
    let inertia = model.rod * at(0.5).powi(2) + model.ball * at(1.0).powi(2);
    let inertia = inertia + model.across * b.cos().powi(2) + model.along * b.sin().powi(2);
    let by_b = -b.sin() * model.l * (model.rod * at(0.5) + 2.0 * model.ball * at(1.0))
        + (model.along - model.across) * (2.0 * b).sin();
    // Nothing turns the whole: (2 J + J_shaft + J_collar) ψ̈ = −2 J′ ḃ ψ̇.
    let turn = -2.0 * by_b * db * spin / (2.0 * inertia + model.shaft_inertia + model.collar_inertia);
    let arm = inertia * turn + by_b * db * spin;
    [model.collar_inertia * turn, arm, arm]
}

#[test]
fn formulations_agree_at_random_states() {
    let model = model();
    let around = state(&model, [0.3, 0.55, 0.5], [6.0, 0.3, 0.2]);
    let mut random = Random(8);
    for _ in 0..30 {
        let state = near(&model, &around, &mut random, (0.2, 0.5)).unwrap();
        assert_agreement(&model, &state, &Kkt::of(&model, &state));
    }
    let solved = dynamics::constrain::solve_once(&model, &model.constants().unwrap(), &around).unwrap();
    assert!(relative(solved.multipliers.as_slice(), &torques(&model, &around)) < 1e-9);
}
