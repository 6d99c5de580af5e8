//! AdamsBashforth: the explicit multistep methods of Adams and Bashforth, orders 2 to 4, for teaching.
//!
//! * **Problem**: none that another method would not solve better. They show what memory gains and costs: one
//!   evaluation per step at any order, but a start by another method, equal steps, and a region of stability
//!   that shrinks with the order. Without events [`Rk4`](crate::integrate::Rk4), with four evaluations in a
//!   step four times as long, is about as accurate as order 4 and stable for steps twice as long per
//!   evaluation; with events or changing steps it is far better.
//! * **Formula**: the polynomial through the last p derivatives y′ₙ, y′ₙ₋₁, .. is integrated over
//!   the step, yₙ₊₁ = yₙ + h Σⱼ γⱼ ∇ʲy′ₙ for j < p, with backward differences ∇ and γ
//!   = 1, 1/2, 5/12, 3/8. A step that is shorter than those before it, h = θ times theirs, has γ₀ = θ,
//!   γ₁ = θ²/2, γ₂ = θ³/6 + θ²/4, γ₃ = (θ⁴/4 + θ³ + θ²)/6.
//! * **Start**: p − 1 steps by the classical Runge–Kutta method of order 4
//!   ([`Rk4`](crate::integrate::Rk4)): at the start, after events and other restarts, and after steps of
//!   another size.
//! * **Order** p; local error O(hᵖ⁺¹); no error estimate, hence a fixed step.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)).
//! * **Stability**: real axis to −1, −6/11 and −3/10 for p = 2, 3, 4; imaginary axis: nothing (but the
//!   growth per step is only 1 + h⁴ω⁴/4), ±0.72 and ±0.43.
//! * **Constraints**: derivatives are those of the projected ends of steps.
//! * **Cost**: 1 evaluation of q̈ per step, 4 per step of the start.
//! * **Source**: Bashforth, Adams, *An attempt to test the theories of capillary action*, Cambridge 1883;
//!   Hairer, Nørsett, Wanner, *Solving ODE I*, §III.1; stability: Hairer, Wanner, *Solving ODE II*, §V.1.

use crate::integrate::explicit::tableau::{TableauRow, advance, unrolled_stages};
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, Step, StepNode, System, Tolerances};
use crate::model::Vector;

/// Steps whose sizes differ by no more than this part are equal: their times are rounded.
const SAME_STEP_PART: f64 = 1e-6;

// The classical Runge–Kutta method, which makes the first steps.
const C: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
const A2: TableauRow<1> = [(0, 0.5)];
const A3: TableauRow<1> = [(1, 0.5)];
const A4: TableauRow<1> = [(2, 1.0)];
const B: TableauRow<4> = [(0, 1.0 / 6.0), (1, 1.0 / 3.0), (2, 1.0 / 3.0), (3, 1.0 / 6.0)];

/// The method of Adams and Bashforth of order `P`, 2 to 4, for teaching.
#[derive(Clone, Copy, Debug)]
pub struct AdamsBashforth<V, const P: usize> {
    /// Derivatives: at the start of the step, and at those of the steps before it or the other stages of the
    /// Runge–Kutta method.
    k: [Phase<V>; 4],
    /// What the next step continues from.
    last: Option<History<V>>,
    /// The same for the step made last, which may be repeated with another end.
    before: Option<History<V>>,
}

/// Order 2.
pub type AdamsBashforth2<V> = AdamsBashforth<V, 2>;
/// Order 3.
pub type AdamsBashforth3<V> = AdamsBashforth<V, 3>;
/// Order 4.
pub type AdamsBashforth4<V> = AdamsBashforth<V, 4>;

/// Equal steps that were made one after the other.
#[derive(Clone, Copy, Debug)]
struct History<V> {
    /// Where the last of them ended.
    t: f64,
    y: Phase<V>,
    /// Their size.
    h: f64,
    /// Derivatives at their starts, the latest first, and how many of them there are.
    derivatives: [Phase<V>; 3],
    count: usize,
}

impl<V: Vector> History<V> {
    /// Whether a step goes on from here.
    fn ends_at(&self, start: &StepNode<V>) -> bool {
        self.t == start.t && self.y == start.y
    }

    /// The size of a step in those of the past.
    fn part(&self, h: f64) -> f64 {
        let part = h / self.h;
        // A part of exactly 1 makes equal steps independent of the rounding of their times.
        if (part - 1.0).abs() <= SAME_STEP_PART { 1.0 } else { part }
    }
}

/// γⱼ for a step of θ times the size of those before it.
fn weights(theta: f64) -> [f64; 4] {
    let square = theta * theta;
    [theta, square / 2.0, square * (theta / 6.0 + 0.25), square * (theta * (theta / 4.0 + 1.0) + 1.0) / 6.0]
}

/// Σⱼ γⱼ ∇ʲ as weights of the values themselves: ∇ʲf₀ = Σᵢ (−1)ⁱ (j over i) fᵢ.
fn by_value<const P: usize>(gamma: [f64; 4]) -> [f64; 4] {
    const BINOMIALS: [[f64; 4]; 4] =
        [[1.0, 0.0, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0], [1.0, -2.0, 1.0, 0.0], [1.0, -3.0, 3.0, -1.0]];
    let mut weights = [0.0; 4];
    for (gamma, row) in gamma.iter().zip(&BINOMIALS).take(P) {
        weights.iter_mut().zip(row).for_each(|(weight, binomial)| *weight += gamma * binomial);
    }
    weights
}

impl<V: Vector, const P: usize> AdamsBashforth<V, P> {
    /// The past of a step that starts here: that of the step to be made, or of the one that is repeated.
    fn past(&self, start: &StepNode<V>, h: f64) -> Option<History<V>> {
        let past = [self.last, self.before].into_iter().flatten().find(|past| past.ends_at(start))?;
        let part = past.part(h);
        (past.count + 1 >= P && part > 0.0 && part <= 1.0).then_some(past)
    }
}

// `IS_EXPLICIT` is false: all stages but those of the first steps are starts of steps, which lie on the
// constraints.
impl<V: Vector, const P: usize> Scheme<V> for AdamsBashforth<V, P> {
    const METHOD: Method = match P {
        2 => Method::AdamsBashforth2,
        3 => Method::AdamsBashforth3,
        4 => Method::AdamsBashforth4,
        _ => panic!("the orders are 2, 3 and 4"),
    };
    const ORDER: u32 = P as u32;
    const ERROR_ORDER: u32 = P as u32;
    const CONTROL: Option<ControllerSettings> = None;
    const WEIGHTS: &'static [f64] = &[];
    const STABILITY_BORDER: f64 = match P {
        2 => 1.0,
        3 => 6.0 / 11.0,
        _ => 0.3,
    };
    const EVENT_PANELS: usize = 4;
    quintic!(V);

    fn new() -> Self {
        Self { k: [Phase::zeros(); 4], last: None, before: None }
    }

    fn forget_history(&mut self) {
        (self.last, self.before) = (None, None);
    }

    #[inline(always)]
    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        _: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        let StepNode { t, y, .. } = start;
        let past = self.past(start, h);
        let k = &mut self.k;
        k[0] = start.derivative();
        let Some(past) = past else {
            unrolled_stages!(system, (t, y, h), C, k, [1: A2, 2: A3, 3: A4]);
            return Ok((advance(y, h, &B, k), 0.0));
        };
        k[1..].copy_from_slice(&past.derivatives);
        let [w0, w1, w2, w3] = by_value::<P>(weights(past.part(h)));
        // In steps of the past, for which the weights are.
        let end = match P {
            2 => advance(y, past.h, &[(0, w0), (1, w1)], k),
            3 => advance(y, past.h, &[(0, w0), (1, w1), (2, w2)], k),
            _ => advance(y, past.h, &[(0, w0), (1, w1), (2, w2), (3, w3)], k),
        };
        Ok((end, 0.0))
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.k
    }

    fn accept_step(&mut self, step: &Step<V>) {
        let StepNode { t, y, .. } = step.end;
        let equal = self.last.filter(|past| past.ends_at(&step.start) && past.part(step.h) == 1.0);
        let (h, count, older) = match equal {
            // The size of the first of them, so that roundings of times do not add up.
            Some(past) => (past.h, (past.count + 1).min(3), past.derivatives),
            None => (step.h, 1, [Phase::zeros(); 3]),
        };
        self.before = self.last;
        self.last = Some(History { t, y, h, derivatives: [self.k[0], older[0], older[1]], count });
    }
}

#[cfg(test)]
mod tests {
    use super::{by_value, weights};

    #[test]
    fn weights_of_whole_steps_are_those_of_the_tables() {
        let close = |found: [f64; 4], expected: [f64; 4]| {
            found.iter().zip(expected).for_each(|(x, y)| assert!((x - y).abs() < 1e-15, "{found:?}"));
        };
        close(by_value::<2>(weights(1.0)), [1.5, -0.5, 0.0, 0.0]);
        close(by_value::<3>(weights(1.0)), [23.0, -16.0, 5.0, 0.0].map(|w| w / 12.0));
        close(by_value::<4>(weights(1.0)), [55.0, -59.0, 37.0, -9.0].map(|w| w / 24.0));
    }

    /// Polynomials below the order are integrated exactly, from 0 to θ, by their values at 0, −1, −2,
    /// −3.
    #[test]
    fn weights_of_parts_of_steps_integrate_polynomials() {
        fn check<const P: usize>() {
            for theta in [0.1, 0.5, 0.9, 1.0] {
                let weights = by_value::<P>(weights(theta));
                for power in 0..P as i32 {
                    let sum: f64 = (0..P).map(|i| weights[i] * (-(i as f64)).powi(power)).sum();
                    let exact = theta.powi(power + 1) / f64::from(power + 1);
                    assert!((sum - exact).abs() < 1e-14, "order {P}, power {power}, part {theta}: {sum}");
                }
            }
        }
        check::<2>();
        check::<3>();
        check::<4>();
    }
}
