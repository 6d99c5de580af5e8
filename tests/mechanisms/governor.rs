//! The stiff flyball governor; IFToMM problem A05, González et al. 2006.

use core::f64::consts::PI;

use dynamics::prelude::*;

use crate::support::*;

/// A shaft that carries two hinged rods with balls; spring-dampers from the rods' middles hold a slider that turns with it.
/// Shaft, slider and each rod have their own angle about the shaft; constraints make them turn as one.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(psi: rad, slider: rad, arm: [rad; 2], s: m, b: [rad; 2])]
#[units(
    ball: kg, rod: kg, collar: kg, l: m, offset: m, rest: m, k: N / m, c: N * s / m, g: m / s^2,
    shaft_inertia: kg * m^2, collar_inertia: kg * m^2, along: kg * m^2, across: kg * m^2
)]
struct Governor {
    ball: f64,
    rod: f64,
    collar: f64,
    l: f64,
    offset: f64,
    rest: f64,
    k: f64,
    c: f64,
    g: f64,
    shaft_inertia: f64,
    collar_inertia: f64,
    /// Moments of inertia of a rod about its axis and across it.
    along: f64,
    across: f64,
}

#[dynamics]
impl Governor {
    /// A point of rod i at the part `at` of its length: distance from the axis, and height.
    fn point(&self, q: &Coordinates<Self>, i: usize, at: f64) -> Vec2 {
        vec2(self.offset, self.l) + at * self.l * vec2(q.b[i].cos(), -q.b[i].sin())
    }
    fn spring(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        (self.point(q, i, 0.5) - vec2(self.offset, q.s)).norm()
    }
    #[kinetic]
    fn arms(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..2 {
            let spin = q.arm[i].dt();
            let (middle, end) = (self.point(q, i, 0.5), self.point(q, i, 1.0));
            sum += 0.5 * self.rod * (middle.dt().norm_squared() + (middle.x * spin).powi(2));
            sum += 0.5 * self.ball * (end.dt().norm_squared() + (end.x * spin).powi(2));
            sum += 0.5 * self.across * (q.b[i].dt().powi(2) + (spin * q.b[i].cos()).powi(2));
            sum += 0.5 * self.along * (spin * q.b[i].sin()).powi(2);
        }
        sum
    }
    #[kinetic]
    fn shaft(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.shaft_inertia * q.psi.dt().powi(2)
            + 0.5 * self.collar_inertia * q.slider.dt().powi(2)
            + 0.5 * self.collar * q.s.dt().powi(2)
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = self.collar * self.g * q.s;
        for i in 0..2 {
            sum += self.g * (self.rod * self.point(q, i, 0.5).y + self.ball * self.point(q, i, 1.0).y);
        }
        sum
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * ((self.spring(q, 0) - self.rest).powi(2) + (self.spring(q, 1) - self.rest).powi(2))
    }
    #[dissipation]
    fn dampers(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.c * (self.spring(q, 0).dt().powi(2) + self.spring(q, 1).dt().powi(2))
    }
    /// The collar's key and the hinges: −λ is the torque that each passes on.
    #[holonomic]
    fn key(&self, q: &Coordinates<Self>) -> Expr {
        q.slider - q.psi
    }
    #[holonomic]
    fn hinges(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [q.arm[0] - q.psi, q.arm[1] - q.psi]
    }
}

fn model() -> Governor {
    Governor {
        ball: 5.0,
        rod: 0.3,
        collar: 3.0,
        l: 1.0,
        offset: 0.05,
        rest: 0.5,
        k: 8e5,
        c: 4e4,
        g: 9.81,
        shaft_inertia: 0.3 * (0.01f64.powi(2) + 0.01f64.powi(2)) / 12.0,
        collar_inertia: 3.0 * (0.1f64.powi(2) + 0.1f64.powi(2)) / 12.0,
        along: 0.3 * (0.01f64.powi(2) + 0.01f64.powi(2)) / 12.0,
        across: 0.3 * (1.0 + 0.01f64.powi(2)) / 12.0,
    }
}

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
    let bounds = [promise(Projected, 1e-9, [1e-7; 3], [1e-12; 2]), promise(BaumgarteTied, 1e-9, [1e-7; 3], [1e-10; 2])];
    keeps(&model, start, &references, &bounds);
    let implicit = [promise(Projected, 1e-6, [1e-4; 3], [1e-12; 2]), promise(Projected, 1e-9, [1e-7; 3], [1e-12; 2])];
    keeps_with(methods::Radau5, &model, start, &references, &implicit);
    embeds_as_it_projects(&model, start, &references, 3.0);
}

/// The torques of key and hinges, by the angular momentum of what they drive: λ = d/dt (J ψ̇) of each, with ψ̈ of the whole.
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
