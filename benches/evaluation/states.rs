//! The states at which accelerations are timed and counted.

use dynamics::model::ModelState;

/// States per pass, so that no branch predictor learns them.
pub(crate) const STATES: usize = 64;

/// The state number `k`: angles and rates of moderate size, none special.
fn value(k: usize, i: usize, n: usize, rate: bool) -> f64 {
    let frequency = if rate { 78.233 } else { 12.9898 };
    let noise = (frequency * (k * n + i + 1) as f64).sin();
    (if rate { 0.2 - 0.05 * i as f64 } else { 0.3 + 0.1 * i as f64 }) + 0.3 * noise
}

/// States of a model without loops.
pub(crate) fn states<S: ModelState, const N: usize>() -> Vec<S>
where
    S::Vector: From<[f64; N]>,
    S::Inputs: Default,
{
    (0..STATES)
        .map(|k| {
            let q: [f64; N] = std::array::from_fn(|i| value(k, i, N, false));
            let u: [f64; N] = std::array::from_fn(|i| value(k, i, N, true));
            S::new(0.0, q.into(), u.into(), S::Inputs::default())
        })
        .collect()
}

/// States near one where the mechanism is put together. Loops need not be closed to evaluate accelerations.
pub(crate) fn states_near<S: ModelState, const N: usize>(place: &[f64; N], by: f64) -> Vec<S>
where
    S::Vector: From<[f64; N]>,
    S::Inputs: Default,
{
    let noise = |k: usize, i: usize, frequency: f64| (frequency * (k * N + i + 1) as f64).sin();
    (0..STATES)
        .map(|k| {
            let q: [f64; N] = std::array::from_fn(|i| place[i] + by * noise(k, i, 12.9898));
            let u: [f64; N] = std::array::from_fn(|i| 0.2 - 0.05 * i as f64 + by * noise(k, i, 78.233));
            S::new(0.0, q.into(), u.into(), S::Inputs::default())
        })
        .collect()
}
