//! Dense output of the extrapolation: Hermite interpolation of degree 11 at both ends and two inner nodes.

use crate::integrate::dense::{is_rounding, smootherstep};
use crate::integrate::{Dense, Phase, StepNode};
use crate::model::Vector;

/// The nodes, as parts of the step.
const NODES: [f64; 4] = [0.0, 1.0, 1.0 / 3.0, 2.0 / 3.0];
/// Conditions: q, q̇ and q̈ at each of them.
const CONDITIONS: usize = 12;

/// The solution at an inner node, a third of a step from one of its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InnerNode<V> {
    /// q less q of that end.
    pub displacement: V,
    /// q̇ there.
    pub u: V,
    /// q̈ there.
    pub a: V,
}

/// The polynomial that has given q, q̇ and q̈ at both ends of a step and at thirds of it; u is its
/// derivative.
///
/// Newton's form with each node three times; divided differences of nodes that coincide are derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FourPointHermite<V> {
    h: f64,
    start: Phase<V>,
    /// Divided differences of q over θ, from the second order on.
    higher: [V; CONDITIONS - 2],
    /// The part of q₁ − q₀ that is rounding.
    rounding: V,
}

/// Divided differences of values, slopes and curvatures by θ at the [`NODES`].
#[inline(always)]
const fn differences(values: [f64; 4], slopes: [f64; 4], curvatures: [f64; 4]) -> [f64; CONDITIONS] {
    let mut column = [0.0; CONDITIONS];
    let mut j = 0;
    while j < CONDITIONS {
        column[j] = values[j / 3];
        j += 1;
    }
    let mut order = 1;
    while order < CONDITIONS {
        j = CONDITIONS;
        while j > order {
            j -= 1;
            let apart = NODES[j / 3] - NODES[(j - order) / 3];
            column[j] = match (apart == 0.0, order) {
                (true, 1) => slopes[j / 3],
                (true, _) => 0.5 * curvatures[j / 3],
                (false, _) => (column[j] - column[j - 1]) / apart,
            };
        }
        order += 1;
    }
    column
}

/// The last divided difference if q₁ − q₀ is 1 and everything else 0.
const LAST_DIFFERENCE_OF_DISTANCE: f64 =
    differences([0.0, 1.0, 0.0, 1.0], [0.0; 4], [0.0; 4])[CONDITIONS - 1];

impl<V: Vector> FourPointHermite<V> {
    /// From the ends of a step of size h and the nodes a third of it from its start and from its end. Times
    /// are not used.
    #[must_use]
    pub fn new([start, end]: [&StepNode<V>; 2], [first, second]: &[InnerNode<V>; 2], h: f64) -> Self {
        let (mut higher, mut rounding) = ([V::zeros(); CONDITIONS - 2], V::zeros());
        for i in 0..V::LEN {
            let slopes = [start.y.u[i], end.y.u[i], first.u[i], second.u[i]].map(|u| h * u);
            let curvatures = [start.a[i], end.a[i], first.a[i], second.a[i]].map(|a| h * h * a);
            let through = |distance: f64| {
                differences(
                    [0.0, distance, first.displacement[i], distance + second.displacement[i]],
                    slopes,
                    curvatures,
                )
            };
            let distance = end.y.q[i] - start.y.q[i];
            let mut column = through(distance);
            // q₁ − q₀ less this part makes the polynomial one degree lower.
            let excess = column[CONDITIONS - 1] / LAST_DIFFERENCE_OF_DISTANCE;
            if is_rounding(excess, start.y.q[i], end.y.q[i]) {
                (rounding[i], column) = (excess, through(distance - excess));
            }
            for (higher, found) in higher.iter_mut().zip(&column[2..]) {
                higher[i] = *found;
            }
        }
        Self { h, start: start.y, higher, rounding }
    }
}

impl<V: Vector> Dense<V> for FourPointHermite<V> {
    fn at(&self, theta: f64) -> Phase<V> {
        let Self { h, start, higher, rounding } = self;
        // The factor of θ² in q, and its slope.
        let mut rest = Phase { q: higher[CONDITIONS - 3], u: V::zeros() };
        for j in (2..CONDITIONS - 1).rev() {
            let (by, coefficients) = (theta - NODES[j / 3], higher[j - 2]);
            for i in 0..V::LEN {
                rest.u[i] = rest.q[i] + by * rest.u[i];
                rest.q[i] = coefficients[i] + by * rest.q[i];
            }
        }
        let (mut out, blend) = (*start, smootherstep(theta));
        for i in 0..V::LEN {
            out.q[i] += theta * (h * start.u[i] + theta * rest.q[i]) + rounding[i] * blend;
            out.u[i] += theta * (2.0 * rest.q[i] + theta * rest.u[i]) / h;
        }
        out
    }

    fn slope(&self, theta: f64) -> Option<Phase<V>> {
        let Self { h, start, higher, .. } = self;
        let mut slope = Phase::<V>::zeros();
        (0..V::LEN).for_each(|i| {
            // The factor of θ² in q, its slope and its curvature.
            let (mut rest, mut first, mut second) = (higher[CONDITIONS - 3][i], 0.0, 0.0);
            for j in (2..CONDITIONS - 1).rev() {
                let by = theta - NODES[j / 3];
                second = 2.0 * first + by * second;
                first = rest + by * first;
                rest = higher[j - 2][i] + by * rest;
            }
            slope.q[i] = h * start.u[i] + theta * (2.0 * rest + theta * first);
            slope.u[i] = (2.0 * rest + theta * (4.0 * first + theta * second)) / h;
        });
        Some(slope)
    }
}
