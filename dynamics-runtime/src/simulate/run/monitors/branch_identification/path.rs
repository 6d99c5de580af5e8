//! A motion on both sides of a place at which it comes near to another branch: states at given times, and its
//! continuation from before.

use alloc::vec::Vec;

use crate::integrate::{Phase, StepNode};
use crate::linalg::norm;
use crate::model::{Constraints, ModelState, Vector};
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::monitors::branch_identification::degenerate_rows::{
    DegenerateRowSet, DegenerateRows,
};
use crate::{constrain, math};

/// Distances before the place at which the motion is read.
const NODES: usize = 4;
/// Steps of Runge and Kutta's method in each of them.
const STEPS: f64 = 4.0;
/// Most of them.
const MOST: f64 = 400.0;
/// How often it is looked for the place.
const REFINED: u32 = 4;
/// Difference of the powers on both sides of the place that are one.
const SAME: f64 = 0.5;
/// Part of its length by which the gradients that two degrees foretell may differ.
const AGREE: f64 = 0.25;
/// Part of its length by which the gradient that is met may differ from what is foretold.
const KEEPS: f64 = 0.5;

pub(crate) struct BranchPath<'p, 'r, 'm, M: Constraints> {
    rhs: &'p RightHandSide<'r, 'm, M>,
    knots: &'p [StepNode<M::Vector>],
    /// When the motion is in the place, and what vanishes there.
    at: f64,
    degenerate: DegenerateRows,
    direction: f64,
    degenerates: &'p mut DegenerateRowSet<M>,
}

impl<'p, 'r, 'm, M: Constraints> BranchPath<'p, 'r, 'm, M> {
    pub(crate) fn new(
        rhs: &'p RightHandSide<'r, 'm, M>,
        knots: &'p [StepNode<M::Vector>],
        (at, degenerate): (f64, DegenerateRows),
        degenerates: &'p mut DegenerateRowSet<M>,
    ) -> Self {
        let direction = (knots[knots.len() - 1].t - knots[0].t).signum();
        Self { rhs, knots, at, degenerate, direction, degenerates }
    }

    /// The power of the distance with which the gradient vanishes on both sides; `None` where they do not
    /// agree, as so near that it is not known well enough where the place is. Gradients shorter than `least`
    /// say nothing.
    pub(crate) fn power(&mut self, distance: f64, least: f64) -> Option<f64> {
        for _ in 0..REFINED {
            let [far, before, after, beyond] = self.lengths(distance)?;
            if !(before > least && after > least) {
                return None;
            }
            let powers =
                [math::ln(far / before), math::ln(beyond / after)].map(|x| x / core::f64::consts::LN_2);
            let power = 0.5 * (powers[0] + powers[1]);
            if (powers[0] - powers[1]).abs() <= SAME {
                return Some(power);
            }
            if power.is_nan() || power < 0.5 {
                return None;
            }
            // Lengths c (D ± δ)^p at a distance D from where it was taken to be.
            let ratio = math::powf(before / after, 1.0 / power);
            self.at += self.direction * distance * ((ratio - 1.0) / (ratio + 1.0)).clamp(-0.5, 0.5);
        }
        None
    }

    /// Of the gradient, two distances and one before the place, and one and two behind it.
    fn lengths(&mut self, distance: f64) -> Option<[f64; 4]> {
        let mut lengths = [0.0; 4];
        for (length, side) in lengths.iter_mut().zip([-2.0, -1.0, 1.0, 2.0]) {
            let y = self.state(side, distance)?;
            *length = norm(self.gradient(side, distance, &y).as_slice());
        }
        Some(lengths)
    }

    /// Whether the motion behind the place is on the branch on which it was before; `None` where that cannot
    /// be decided.
    pub(crate) fn keeps(&mut self, distance: f64) -> Option<bool> {
        let mut nodes = Vec::with_capacity(NODES);
        for k in 1..=NODES {
            nodes.push((-(k as f64), self.state(-(k as f64), distance)?));
        }
        let [septic, quintic] = [NODES, NODES - 1].map(|n| self.continued(&nodes[..n], distance));
        let met = self.state(1.0, distance)?;
        let [septic, quintic, met] = [septic, quintic, met].map(|y| self.gradient(1.0, distance, &y));
        let apart = |a: &M::Vector, b: &M::Vector| norm(sum(a, b, -1.0).as_slice());
        let size = norm(septic.as_slice());
        let decided = apart(&septic, &quintic) <= AGREE * size && size > 0.0;
        decided.then(|| apart(&septic, &met) <= KEEPS * size)
    }

    /// The gradient, in weighted coordinates.
    fn gradient(&mut self, side: f64, distance: f64, y: &Phase<M::Vector>) -> M::Vector {
        let state = self.rhs.state(self.time(side, distance), &y.q, &y.u);
        self.degenerates.gradient(self.rhs.model, self.rhs.constants, &state, self.degenerate)
    }

    fn time(&self, side: f64, distance: f64) -> f64 {
        self.at + self.direction * side * distance
    }

    /// The motion so many distances behind the place, or before it, from the state beyond that is nearest:
    /// what lies nearer to the place is less certain.
    fn state(&mut self, side: f64, distance: f64) -> Option<Phase<M::Vector>> {
        let t = self.time(side, distance);
        let beyond = |knot: &&StepNode<M::Vector>| (knot.t - t) * self.direction * side >= 0.0;
        let ends = if side < 0.0 { &self.knots[0] } else { &self.knots[self.knots.len() - 1] };
        let near = |knot: &&StepNode<M::Vector>| (knot.t - t).abs();
        let from =
            self.knots.iter().filter(beyond).min_by(|a, b| near(a).total_cmp(&near(b))).unwrap_or(ends);
        let steps = (t - from.t).abs() / distance * STEPS;
        if steps.is_nan() || steps > MOST {
            return None;
        }
        let steps = steps as u32 + 1;
        let (mut y, h) = (from.y, (t - from.t) / f64::from(steps));
        for k in 0..steps {
            y = self.step(from.t + h * f64::from(k), &y, h)?;
        }
        Some(y)
    }

    /// A step of Runge and Kutta's method, of order 4, whose end is put onto the constraints.
    fn step(&mut self, t: f64, y: &Phase<M::Vector>, h: f64) -> Option<Phase<M::Vector>> {
        let ahead = |k: &Phase<M::Vector>, h: f64| Phase { q: sum(&y.q, &k.q, h), u: sum(&y.u, &k.u, h) };
        let one = self.derivative(t, y)?;
        let two = self.derivative(t + 0.5 * h, &ahead(&one, 0.5 * h))?;
        let three = self.derivative(t + 0.5 * h, &ahead(&two, 0.5 * h))?;
        let four = self.derivative(t + h, &ahead(&three, h))?;
        let mut end = *y;
        for (k, weight) in [(one, 1.0), (two, 2.0), (three, 2.0), (four, 1.0)] {
            end.q = sum(&end.q, &k.q, h * weight / 6.0);
            end.u = sum(&end.u, &k.u, h * weight / 6.0);
        }
        let (model, constants) = (self.rhs.model, self.rhs.constants);
        let mut state = self.rhs.state(t + h, &end.q, &end.u);
        constrain::project_positions(model, constants, &mut state, &mut self.degenerates.workspace).ok()?;
        constrain::project_velocities(model, constants, &mut state, &mut self.degenerates.workspace).ok()?;
        Some(Phase { q: *state.q(), u: *state.u() })
    }

    fn derivative(&mut self, t: f64, y: &Phase<M::Vector>) -> Option<Phase<M::Vector>> {
        let state = self.rhs.state(t, &y.q, &y.u);
        let solved = constrain::accelerate(
            self.rhs.model,
            self.rhs.constants,
            &state,
            &mut self.degenerates.workspace,
        )
        .ok()?;
        Some(Phase { q: y.u, u: solved.accelerations })
    }

    /// The polynomial through positions and velocities at nodes, in distances from the place, one distance
    /// behind it: Newton's divided differences with every node twice.
    fn continued(&self, nodes: &[(f64, Phase<M::Vector>)], distance: f64) -> Phase<M::Vector> {
        let (rate, mut out) = (self.direction * distance, nodes[0].1);
        for i in 0..M::Vector::LEN {
            let twice = nodes.iter().flat_map(|node| [node, node]);
            let places: Vec<f64> = twice.clone().map(|(place, _)| *place).collect();
            let mut values: Vec<f64> = twice.map(|(_, y)| y.q[i]).collect();
            for order in 1..places.len() {
                for k in (order..places.len()).rev() {
                    let apart = places[k] - places[k - order];
                    let slope = || rate * nodes[k / 2].1.u[i];
                    values[k] = if apart == 0.0 { slope() } else { (values[k] - values[k - 1]) / apart };
                }
            }
            let (mut value, mut slope) = (0.0, 0.0);
            for (place, coefficient) in places.iter().zip(&values).rev() {
                slope = slope * (1.0 - place) + value;
                value = value * (1.0 - place) + coefficient;
            }
            (out.q[i], out.u[i]) = (value, slope / rate);
        }
        out
    }
}

/// x + factor · y.
fn sum<V: Vector>(x: &V, y: &V, factor: f64) -> V {
    let mut out = *x;
    (0..V::LEN).for_each(|i| out[i] += factor * y[i]);
    out
}
