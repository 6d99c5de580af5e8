//! The path of a motion on both sides of a place where branches meet: its states at given distances, and its
//! extrapolation from before the place.
//!
//! States between the nodes of the run are integrated anew from the nearest node that is farther from the
//! place, by the classical Runge–Kutta method of order 4 with projection, because nodes near the place are
//! less accurate.

use alloc::vec::Vec;

use crate::integrate::{Phase, StepNode, plus_scaled};
use crate::linalg::norm;
use crate::model::{Constraints, ModelState, Vector};
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::monitors::branch_identification::degenerate_rows::{
    DegenerateRowSet, DegenerateRows,
};
use crate::{constrain, math};

/// Distances before the place through which the polynomial of degree 2n − 1 is laid.
const EXTRAPOLATION_NODES: usize = 4;
/// Runge–Kutta steps per distance.
const STEPS_PER_DISTANCE: f64 = 4.0;
/// Most Runge–Kutta steps to one state. A state that needs more is not found, and nothing is decided there.
const MAX_STEPS: f64 = 400.0;
/// Most corrections of the time of the place by the gradients on both sides.
const MAX_REFINEMENTS: u32 = 4;
/// Largest difference of the powers on both sides of the place, for which they are the same.
const MAX_POWER_DIFFERENCE: f64 = 0.5;
/// Largest difference of the gradients by two degrees of extrapolation, in parts of their length, for which
/// they decide. Gradients of neighbouring branches differ by twice their length.
const MAX_PREDICTION_DIFFERENCE: f64 = 0.25;
/// Largest difference of the gradient of the motion from the extrapolated one, in parts of its length, for
/// which the motion is on its own branch.
const MAX_BRANCH_DIFFERENCE: f64 = 0.5;

/// The path around one place. See this file's head.
pub(crate) struct BranchPath<'p, 'r, 'm, M: Constraints> {
    rhs: &'p RightHandSide<'r, 'm, M>,
    path_nodes: &'p [StepNode<M::Vector>],
    /// Time of the place, and the gradient that vanishes there.
    at: f64,
    degenerate: DegenerateRows,
    direction: f64,
    degenerates: &'p mut DegenerateRowSet<M>,
}

impl<'p, 'r, 'm, M: Constraints> BranchPath<'p, 'r, 'm, M> {
    pub(crate) fn new(
        rhs: &'p RightHandSide<'r, 'm, M>,
        path_nodes: &'p [StepNode<M::Vector>],
        (at, degenerate): (f64, DegenerateRows),
        degenerates: &'p mut DegenerateRowSet<M>,
    ) -> Self {
        let direction = (path_nodes[path_nodes.len() - 1].t - path_nodes[0].t).signum();
        Self { rhs, path_nodes, at, degenerate, direction, degenerates }
    }

    /// The power of the distance with which the gradient vanishes. `None` if both sides do not agree, as so
    /// near that the time of the place is not accurate enough, or if gradients are shorter than `least`.
    pub(crate) fn power(&mut self, distance: f64, least: f64) -> Option<f64> {
        for _ in 0..MAX_REFINEMENTS {
            let [far, before, after, beyond] = self.lengths(distance)?;
            if !(before > least && after > least) {
                return None;
            }
            let powers =
                [math::ln(far / before), math::ln(beyond / after)].map(|x| x / core::f64::consts::LN_2);
            let power = 0.5 * (powers[0] + powers[1]);
            if (powers[0] - powers[1]).abs() <= MAX_POWER_DIFFERENCE {
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

    /// Lengths of the gradient at −2, −1, 1 and 2 distances from the place.
    fn lengths(&mut self, distance: f64) -> Option<[f64; 4]> {
        let mut lengths = [0.0; 4];
        for (length, side) in lengths.iter_mut().zip([-2.0, -1.0, 1.0, 2.0]) {
            let y = self.phase_at(side, distance)?;
            *length = norm(self.gradient(side, distance, &y).as_slice());
        }
        Some(lengths)
    }

    /// Whether the motion behind the place is on the branch on which it was before; `None` if that cannot be
    /// decided.
    pub(crate) fn stays_on_branch(&mut self, distance: f64) -> Option<bool> {
        let mut nodes = Vec::with_capacity(EXTRAPOLATION_NODES);
        for k in 1..=EXTRAPOLATION_NODES {
            nodes.push((-(k as f64), self.phase_at(-(k as f64), distance)?));
        }
        let [septic, quintic] =
            [EXTRAPOLATION_NODES, EXTRAPOLATION_NODES - 1].map(|n| self.extrapolated(&nodes[..n], distance));
        let met = self.phase_at(1.0, distance)?;
        let [septic, quintic, met] = [septic, quintic, met].map(|y| self.gradient(1.0, distance, &y));
        let difference = |a: &M::Vector, b: &M::Vector| norm(plus_scaled(a, -1.0, b).as_slice());
        let size = norm(septic.as_slice());
        let decided = difference(&septic, &quintic) <= MAX_PREDICTION_DIFFERENCE * size && size > 0.0;
        decided.then(|| difference(&septic, &met) <= MAX_BRANCH_DIFFERENCE * size)
    }

    /// The gradient, in weighted coordinates.
    fn gradient(&mut self, side: f64, distance: f64, y: &Phase<M::Vector>) -> M::Vector {
        let state = self.rhs.state(self.time(side, distance), &y.q, &y.u);
        self.degenerates.gradient(self.rhs.model, self.rhs.constants, &state, self.degenerate)
    }

    fn time(&self, side: f64, distance: f64) -> f64 {
        self.at + self.direction * side * distance
    }

    /// The phase `side` distances behind the place, or before it if negative, integrated from the nearest
    /// node that is farther from the place.
    fn phase_at(&mut self, side: f64, distance: f64) -> Option<Phase<M::Vector>> {
        let t = self.time(side, distance);
        let beyond = |node: &&StepNode<M::Vector>| (node.t - t) * self.direction * side >= 0.0;
        let ends = if side < 0.0 { &self.path_nodes[0] } else { &self.path_nodes[self.path_nodes.len() - 1] };
        let time_to = |node: &&StepNode<M::Vector>| (node.t - t).abs();
        let from = self
            .path_nodes
            .iter()
            .filter(beyond)
            .min_by(|a, b| time_to(a).total_cmp(&time_to(b)))
            .unwrap_or(ends);
        let steps = (t - from.t).abs() / distance * STEPS_PER_DISTANCE;
        if steps.is_nan() || steps > MAX_STEPS {
            return None;
        }
        let steps = steps as u32 + 1;
        let (mut y, h) = (from.y, (t - from.t) / f64::from(steps));
        for k in 0..steps {
            y = self.step(from.t + h * f64::from(k), &y, h)?;
        }
        Some(y)
    }

    /// One Runge–Kutta step of order 4, whose end is projected.
    fn step(&mut self, t: f64, y: &Phase<M::Vector>, h: f64) -> Option<Phase<M::Vector>> {
        let ahead = |k: &Phase<M::Vector>, h: f64| Phase {
            q: plus_scaled(&y.q, h, &k.q),
            u: plus_scaled(&y.u, h, &k.u),
        };
        let one = self.derivative(t, y)?;
        let two = self.derivative(t + 0.5 * h, &ahead(&one, 0.5 * h))?;
        let three = self.derivative(t + 0.5 * h, &ahead(&two, 0.5 * h))?;
        let four = self.derivative(t + h, &ahead(&three, h))?;
        let mut end = *y;
        for (k, weight) in [(one, 1.0), (two, 2.0), (three, 2.0), (four, 1.0)] {
            end.q = plus_scaled(&end.q, h * weight / 6.0, &k.q);
            end.u = plus_scaled(&end.u, h * weight / 6.0, &k.u);
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
    fn extrapolated(&self, nodes: &[(f64, Phase<M::Vector>)], distance: f64) -> Phase<M::Vector> {
        let (rate, mut out) = (self.direction * distance, nodes[0].1);
        for i in 0..M::Vector::LEN {
            let twice = nodes.iter().flat_map(|node| [node, node]);
            let places: Vec<f64> = twice.clone().map(|(place, _)| *place).collect();
            let mut values: Vec<f64> = twice.map(|(_, y)| y.q[i]).collect();
            for order in 1..places.len() {
                for k in (order..places.len()).rev() {
                    let difference = places[k] - places[k - order];
                    let slope = || rate * nodes[k / 2].1.u[i];
                    values[k] =
                        if difference == 0.0 { slope() } else { (values[k] - values[k - 1]) / difference };
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
