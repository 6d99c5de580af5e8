//! Interpolants within one step: θ = 0 is its start, θ = 1 its end.

use super::{Phase, StepNode};
use crate::integrate::phase::zip;
use crate::model::Vector;

/// The solution within one step.
pub trait Dense<V: Vector> {
    /// q and u at t₀ + θ h.
    fn at(&self, theta: f64) -> Phase<V>;
    /// Their derivatives by θ, for defect control; `None` for interpolants that it does not check.
    fn slope(&self, _theta: f64) -> Option<Phase<V>> {
        None
    }
}

/// The nested form of Hairer's codes: r₁ + θ(r₂ + (1−θ)(r₃ + θ(r₄ + (1−θ)(r₅ + …)))), used alike for q and u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nested<V, const K: usize>(pub [Phase<V>; K]);

impl<V: Vector, const K: usize> Nested<V, K> {
    /// r₂, r₃ and r₄, from states and derivatives at both ends of a step of size h.
    #[inline(always)]
    pub(crate) fn ends(start: &StepNode<V>, end: &StepNode<V>, h: f64) -> [Phase<V>; 3] {
        let change = zip(&end.y, &start.y, |y1, y0| y1 - y0);
        let bend = zip(&start.derivative(), &change, |k, d| h * k - d);
        let twist = zip(&zip(&change, &end.derivative(), |d, k| d - h * k), &bend, |x, b| x - b);
        [change, bend, twist]
    }
}

impl<V: Vector, const K: usize> Dense<V> for Nested<V, K> {
    fn at(&self, theta: f64) -> Phase<V> {
        let mut out = self.0[K - 1];
        for j in (0..K - 1).rev() {
            let factor = if j % 2 == 0 { theta } else { 1.0 - theta };
            for i in 0..V::LEN {
                out.q[i] = self.0[j].q[i] + factor * out.q[i];
                out.u[i] = self.0[j].u[i] + factor * out.u[i];
            }
        }
        out
    }

    fn slope(&self, theta: f64) -> Option<Phase<V>> {
        let (mut out, mut slope) = (self.0[K - 1], Phase::zeros());
        for j in (0..K - 1).rev() {
            let (factor, sign) = if j % 2 == 0 { (theta, 1.0) } else { (1.0 - theta, -1.0) };
            slope = zip(&out, &slope, |out, slope| sign * out + factor * slope);
            out = zip(&self.0[j], &out, |r, out| r + factor * out);
        }
        Some(slope)
    }
}

/// The quintic that has the given q, q̇ and q̈ at both ends; u is its derivative.
///
/// Local error O(h⁶) in q and O(h⁵) in u for exact ends; an end that errs by O(hᵖ⁺¹) leaves O(hᵖ) in u. It
/// costs no evaluation because second-order systems know q̈ at both ends.
///
/// Far from the origin of q, or in short steps, the part of q₁ − q₀ that does not follow from u and q̈ at the
/// ends is rounding of q. The derivative would divide it by h: u at |q| = 10⁸ would have an error of
/// 3·10⁻⁸/h. Such a part is kept in q alone, and u is the cubic through its own ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hermite<V> {
    h: f64,
    start: Phase<V>,
    /// h²/2·q̈ at the start.
    second: V,
    /// Coefficients of θ³, θ⁴, θ⁵.
    higher: [V; 3],
    /// The part of q₁ − q₀ that is rounding.
    rounding: V,
}

/// Whether a difference of the positions x and y is no more than their rounding: a few units in the last
/// place, since each part of a step rounds them.
#[inline(always)]
pub(super) fn is_rounding(difference: f64, x: f64, y: f64) -> bool {
    difference.abs() <= 2.0 * f64::EPSILON * x.abs().max(y.abs())
}

/// The quintic from 0 to 1 with slope and curvature 0 at both ends: it blends a difference of the ends into a
/// step.
#[inline(always)]
pub(super) fn smootherstep(theta: f64) -> f64 {
    theta * theta * theta * (10.0 + theta * (6.0 * theta - 15.0))
}

impl<V: Vector> Hermite<V> {
    /// From the states and accelerations at both ends of a step of size h.
    #[must_use]
    pub fn new(start: Phase<V>, a0: &V, end: &Phase<V>, a1: &V, h: f64) -> Self {
        let mut second = V::zeros();
        let (mut higher, mut rounding) = ([V::zeros(); 3], V::zeros());
        for i in 0..V::LEN {
            second[i] = 0.5 * h * h * a0[i];
            // Position, slope and curvature at θ = 1 less those of the quadratic part.
            let mut position = end.q[i] - start.q[i] - h * start.u[i] - second[i];
            let slope = h * end.u[i] - h * start.u[i] - 2.0 * second[i];
            let curvature = h * h * a1[i] - 2.0 * second[i];
            // q₁ less this part makes q a polynomial of degree 4.
            let excess = position - 0.5 * slope + curvature / 12.0;
            if is_rounding(excess, start.q[i], end.q[i]) {
                (rounding[i], position) = (excess, position - excess);
            }
            higher[0][i] = 10.0 * position - 4.0 * slope + 0.5 * curvature;
            higher[1][i] = -15.0 * position + 7.0 * slope - curvature;
            higher[2][i] = 6.0 * position - 3.0 * slope + 0.5 * curvature;
        }
        Self { h, start, second, higher, rounding }
    }

    /// From the ends of a step of size h.
    #[must_use]
    pub fn between(start: &StepNode<V>, end: &StepNode<V>, h: f64) -> Self {
        Self::new(start.y, &start.a, &end.y, &end.a, h)
    }
}

/// The dense output of a [`Scheme`](super::Scheme) by the ends of its step alone: [`Hermite`].
macro_rules! quintic {
    ($vector:ty) => {
        type Dense = crate::integrate::Hermite<$vector>;

        fn dense<D: crate::integrate::System<$vector>>(
            &mut self,
            _: &mut D,
            start: &crate::integrate::StepNode<$vector>,
            end: &crate::integrate::StepNode<$vector>,
            h: f64,
        ) -> Result<Self::Dense, D::Error> {
            Ok(crate::integrate::Hermite::between(start, end, h))
        }

        fn dense_from_ends<D: crate::integrate::System<$vector>>(
            &mut self,
            _: &mut D,
            start: &crate::integrate::StepNode<$vector>,
            end: &crate::integrate::StepNode<$vector>,
            h: f64,
            _: &crate::integrate::Tolerances,
        ) -> Result<Option<Self::Dense>, D::Error> {
            Ok(Some(crate::integrate::Hermite::between(start, end, h)))
        }
    };
}

impl<V: Vector> Hermite<V> {
    /// q̈ at θ.
    pub(crate) fn acceleration(&self, theta: f64) -> V {
        let Self { h, second, higher: [c3, c4, c5], .. } = self;
        let mut a = V::zeros();
        for i in 0..V::LEN {
            let bend = 6.0 * c3[i] + theta * (12.0 * c4[i] + theta * 20.0 * c5[i]);
            a[i] = (2.0 * second[i] + theta * bend) / (h * h);
        }
        a
    }
}

impl<V: Vector> Dense<V> for Hermite<V> {
    fn at(&self, theta: f64) -> Phase<V> {
        let Self { h, start, second, higher: [c3, c4, c5], rounding } = self;
        let (mut out, blend) = (*start, smootherstep(theta));
        // Slices, since an index into a vector is a function call without optimisation.
        let [start, second, c3, c4, c5, rounding] =
            [&start.u, second, c3, c4, c5, rounding].map(Vector::as_slice);
        let (q, u) = (out.q.as_mut_slice(), out.u.as_mut_slice());
        for i in 0..V::LEN {
            let cubic = c3[i] + theta * (c4[i] + theta * c5[i]);
            q[i] += theta * (h * start[i] + theta * (second[i] + theta * cubic)) + rounding[i] * blend;
            let slope = 3.0 * c3[i] + theta * (4.0 * c4[i] + theta * 5.0 * c5[i]);
            u[i] += theta * (2.0 * second[i] + theta * slope) / h;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    type V = SVector<f64, 1>;

    fn phase(q: f64, u: f64) -> Phase<V> {
        Phase { q: V::new(q), u: V::new(u) }
    }

    #[test]
    fn hermite_reproduces_a_quintic_and_its_derivative() {
        let value = |t: f64| 1.0 + t * (2.0 + t * (-3.0 + t * (0.5 + t * (4.0 - 2.0 * t))));
        let slope = |t: f64| 2.0 + t * (-6.0 + t * (1.5 + t * (16.0 - 10.0 * t)));
        let curvature = |t: f64| -6.0 + t * (3.0 + t * (48.0 - 40.0 * t));
        let (t0, h) = (-0.3, 0.8);
        let end = phase(value(t0 + h), slope(t0 + h));
        let dense = Hermite::new(
            phase(value(t0), slope(t0)),
            &V::new(curvature(t0)),
            &end,
            &V::new(curvature(t0 + h)),
            h,
        );
        for theta in [0.0, 0.1, 0.5, 0.77, 1.0] {
            let (y, t) = (dense.at(theta), t0 + theta * h);
            assert!((y.q[0] - value(t)).abs() < 1e-14);
            assert!((y.u[0] - slope(t)).abs() < 1e-13);
            assert!((dense.acceleration(theta)[0] - curvature(t)).abs() < 1e-12);
        }
    }

    /// Where rounding of q₁ − q₀ is all that is known of it, u has its own digits: at 10⁸ a step of 10⁻³ had
    /// left five of them.
    #[test]
    fn rounding_of_positions_is_none_of_velocities() {
        for (origin, h, permitted) in
            [(0.0, 0.1, 1e-9), (1e8, 0.1, 1e-6), (1e8, 1e-3, 1e-14), (-1e12, 1e-3, 1e-14)]
        {
            let knot = |t: f64| StepNode { t, y: phase(origin + t.sin(), t.cos()), a: V::new(-t.sin()) };
            let (start, end) = (knot(0.7), knot(0.7 + h));
            let dense = Hermite::between(&start, &end, h);
            for theta in [0.1, 0.3, 0.5, 0.8] {
                let (y, t) = (dense.at(theta), 0.7 + theta * h);
                assert!((y.u[0] - t.cos()).abs() < permitted, "{origin:e}, {h}: {:e}", y.u[0] - t.cos());
                assert!(
                    (dense.acceleration(theta)[0] + t.sin()).abs() < 30.0 * permitted / h,
                    "{origin:e}, {h}"
                );
                assert!((y.q[0] - (origin + t.sin())).abs() < 1e-9 + 4e-16 * origin.abs(), "{origin:e}, {h}");
            }
            assert!((dense.at(1.0).q[0] - end.y.q[0]).abs() <= f64::EPSILON * end.y.q[0].abs());
        }
    }

    #[test]
    fn slopes_of_the_nested_form_are_those_of_its_values() {
        let dense =
            Nested([phase(1.0, 2.0), phase(3.0, 4.0), phase(9.0, 9.0), phase(7.0, 5.0), phase(-2.0, 3.0)]);
        for theta in [0.0, 0.3, 0.8, 1.0] {
            let [a, b] = [theta - 1e-5, theta + 1e-5].map(|theta| dense.at(theta));
            let slope = dense.slope(theta).unwrap();
            assert!((slope.q[0] - (b.q[0] - a.q[0]) / 2e-5).abs() < 1e-8);
            assert!((slope.u[0] - (b.u[0] - a.u[0]) / 2e-5).abs() < 1e-8);
        }
    }

    #[test]
    fn nested_form_meets_its_ends() {
        let dense = Nested([phase(1.0, 2.0), phase(3.0, 4.0), phase(9.0, 9.0), phase(7.0, 5.0)]);
        assert_eq!(dense.at(0.0), phase(1.0, 2.0));
        assert_eq!(dense.at(1.0), phase(4.0, 6.0));
        // 1 + ½(3 + ½(9 + ½·7))
        assert_eq!(dense.at(0.5).q[0], 1.0 + 0.5 * (3.0 + 0.5 * (9.0 + 0.5 * 7.0)));
    }
}
