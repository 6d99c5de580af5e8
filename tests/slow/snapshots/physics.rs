//! What every model has to obey, whatever its listing says.

use dynamics::model::{Constraints, ModelState, Powers, Vector};

/// |a − b| ≤ 10⁻¹²·(1 + scale).
#[track_caller]
pub(crate) fn near(a: f64, b: f64, scale: f64, what: &str) {
    assert!((a - b).abs() <= 1e-12 * (1.0 + scale.abs()), "{what}: {a} instead of {b}");
}

/// As [`balanced`], with reactions: M q̈ = Q + Φ_qᵀλ, Φ_q q̈ = γ, multipliers as expected.
#[track_caller]
pub(crate) fn held<M: Constraints + Powers>(
    model: &M,
    state: &M::State,
    expected: &[f64],
    multipliers: &[f64],
) {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    assert_eq!((expected.len(), multipliers.len()), (n, r));
    let constants = model.constants().expect("constants exist");
    let solved = dynamics::constrain::solve_once(model, &constants, state).expect("a regular state");
    let (mass, force, jacobian) =
        (model.mass_matrix(state), model.generalized_force(state), model.jacobian(state));
    let gamma = model.gamma(state);
    for i in 0..n {
        let reaction: f64 = (0..r).map(|k| jacobian[(k, i)] * solved.multipliers[k]).sum();
        let inertial: f64 = (0..n).map(|j| mass[(i, j)] * solved.accelerations[j]).sum();
        near(inertial, force[i] + reaction, inertial.abs() + reaction.abs() + 1.0, "M q̈ = Q + Φ_qᵀλ");
        near(solved.accelerations[i], expected[i], expected[i], M::COORDINATES[i].name);
    }
    for k in 0..r {
        let turned: f64 = (0..n).map(|i| jacobian[(k, i)] * solved.accelerations[i]).sum();
        let constraint = M::CONSTRAINTS.iter().rfind(|c| c.first <= k).expect("every row belongs to one");
        if constraint.switched.is_none_or(|index| state.active_set().holds(index)) {
            near(turned, gamma[k], turned.abs() + 1.0, "Φ_q q̈ = γ");
        }
        near(solved.multipliers[k], multipliers[k], multipliers[k], M::ROWS[k].name);
    }
    accounted(model, state, &solved.accelerations);
}

/// Accelerations as expected, M q̈ = Q, the rate of the energy function is the sum of the powers, and what is
/// said to be conserved has no rate. Rates are central differences along the motion.
#[track_caller]
pub(crate) fn balanced<M: Powers>(model: &M, state: &M::State, expected: &[f64]) {
    let n = M::Vector::LEN;
    assert_eq!(expected.len(), n);
    let a = model.accelerations(state).expect("a regular state");
    let (mass, force) = (model.mass_matrix(state), model.generalized_force(state));
    for i in 0..n {
        near(a[i], expected[i], expected[i], M::COORDINATES[i].name);
        let terms: Vec<f64> = (0..n).map(|j| mass[(i, j)] * a[j]).collect();
        let scale = terms.iter().fold(force[i].abs(), |s, x| s + x.abs());
        near(terms.iter().sum(), force[i], scale, "M q̈ = Q");
    }
    accounted(model, state, &a);
}

/// The rate of the energy function is the sum of the powers, and what is said to be conserved has no rate.
#[track_caller]
fn accounted<M: Powers>(model: &M, state: &M::State, a: &M::Vector) {
    let mut powers = vec![0.0; M::POWERS.len()];
    model.powers(state, &mut powers);
    let (power, largest) = (powers.iter().sum::<f64>(), powers.iter().fold(0f64, |m, p| m.max(p.abs())));
    let energy = rate(state, a, |s| model.energy_function(s));
    let scale = 1.0 + largest + model.energy_function(state).abs();
    assert!((energy - power).abs() <= 1e-8 * scale, "dE/dt = {energy}, the powers sum to {power}");

    let value = |s: &M::State, i: usize| {
        let mut values = vec![f64::NAN; M::CONSERVED.len()];
        model.conserved(s, &mut values);
        values[i]
    };
    for (i, quantity) in M::CONSERVED.iter().enumerate() {
        let drift = rate(state, a, |s| value(s, i));
        let scale = 1.0 + value(state, i).abs();
        assert!(drift.abs() <= 1e-8 * scale, "{} is conserved, but has the rate {drift}", quantity.name);
    }
}

/// df/dt along the motion through `state`: ∂f/∂t + ∂f/∂q·q̇ + ∂f/∂q̇·q̈, a difference of sixth order.
fn rate<S: ModelState>(state: &S, a: &S::Vector, f: impl Fn(&S) -> f64) -> f64 {
    let h = 1e-3;
    let at = |k: f64| {
        let mut s = S::new(state.t() + k * h, *state.q(), *state.u(), *state.inputs());
        for i in 0..S::Vector::LEN {
            s.q_mut()[i] += k * h * state.u()[i];
            s.u_mut()[i] += k * h * a[i];
        }
        f(&s)
    };
    let d = |k: f64| at(k) - at(-k);
    (45.0 * d(1.0) - 9.0 * d(2.0) + d(3.0)) / (60.0 * h)
}
