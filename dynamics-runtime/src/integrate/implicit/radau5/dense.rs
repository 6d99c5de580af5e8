//! States within a step of Radau5.

use crate::integrate::implicit::radau5::table::C;
use crate::integrate::phase::zip;
use crate::integrate::{Dense, Hermite, Phase, Tolerances};
use crate::model::Vector;

/// States within a step of [`Radau5`](crate::integrate::Radau5): by the quintic through q, q̇, q̈ at both
/// ends where it agrees with the collocation polynomial to the permitted error of that, else by the
/// collocation polynomial. The quintic has order 4 in u, the polynomial order 3. But the quintic depends on
/// accelerations, in which small errors of stiff components are large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RadauInterpolant<V> {
    /// The quintic.
    Quintic(Hermite<V>),
    /// The polynomial through the stages.
    Collocation(Collocation<V>),
}

impl<V: Vector> RadauInterpolant<V> {
    /// `permitted`: the tolerances of the error estimate, which has the order of the collocation polynomial.
    pub(super) fn choose(
        quintic: Hermite<V>,
        stages: Collocation<V>,
        end: &Phase<V>,
        permitted: &Tolerances,
    ) -> Self {
        let near = |theta: f64| {
            let apart = zip(&quintic.at(theta), &stages.at(theta), |a, b| a - b);
            permitted.norm(&apart, &stages.start, end) <= 1.0
        };
        if near(C[0]) && near(C[1]) { Self::Quintic(quintic) } else { Self::Collocation(stages) }
    }
}

impl<V: Vector> Dense<V> for RadauInterpolant<V> {
    fn at(&self, theta: f64) -> Phase<V> {
        match self {
            Self::Quintic(quintic) => quintic.at(theta),
            Self::Collocation(stages) => stages.at(theta),
        }
    }
}

/// The cubic that is 0 at the start of a step and has given values at the nodes: coefficients of θ, θ(θ −
/// c₁), θ(θ − c₁)(θ − c₂).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cubic<V>([V; 3]);

impl<V: Vector> Cubic<V> {
    pub(super) fn new(z: &[V; 3]) -> Self {
        let mut d = [V::zeros(); 3];
        for l in 0..V::LEN {
            let first = z[0][l] / C[0];
            let second = (z[1][l] - z[0][l]) / (C[1] - C[0]);
            let third = (z[2][l] - z[1][l]) / (C[2] - C[1]);
            d[0][l] = first;
            d[1][l] = (second - first) / C[1];
            d[2][l] = (third - second) / (C[2] - C[0]) - d[1][l];
        }
        Self(d)
    }

    /// Its change from the end of the step to θ = 1 + `by`.
    pub(super) fn beyond(&self, by: f64) -> V {
        let theta = 1.0 + by;
        let mut change = V::zeros();
        for l in 0..V::LEN {
            let at = |x: f64| x * (self.0[0][l] + (x - C[0]) * (self.0[1][l] + (x - C[1]) * self.0[2][l]));
            change[l] = at(theta) - at(1.0);
        }
        change
    }
}

/// The collocation polynomial of u, of order 3, and its integral for q.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collocation<V> {
    start: Phase<V>,
    /// Coefficients of θ to θ³.
    u: [V; 3],
    /// Coefficients of θ to θ⁴.
    q: [V; 4],
}

impl<V: Vector> Collocation<V> {
    pub(super) fn new(start: Phase<V>, velocities: &Cubic<V>, end: &Phase<V>, h: f64) -> Self {
        let Cubic(d) = velocities;
        let (mut u, mut q) = ([V::zeros(); 3], [V::zeros(); 4]);
        for l in 0..V::LEN {
            u[0][l] = d[0][l] - C[0] * d[1][l] + C[0] * C[1] * d[2][l];
            u[1][l] = d[1][l] - (C[0] + C[1]) * d[2][l];
            u[2][l] = d[2][l];
            (0..3).for_each(|k| q[k + 1][l] = h / (k + 2) as f64 * u[k][l]);
            // The integral ends at the end of the step. If that was projected, the difference is linear in θ.
            q[0][l] = end.q[l] - start.q[l] - (q[1][l] + q[2][l] + q[3][l]);
        }
        Self { start, u, q }
    }
}

impl<V: Vector> Dense<V> for Collocation<V> {
    fn at(&self, theta: f64) -> Phase<V> {
        let Self { start, u, q } = self;
        let mut y = *start;
        for l in 0..V::LEN {
            y.u[l] += theta * (u[0][l] + theta * (u[1][l] + theta * u[2][l]));
            y.q[l] += theta * (q[0][l] + theta * (q[1][l] + theta * (q[2][l] + theta * q[3][l])));
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::implicit::radau5::{Radau5, Scheme, StepNode};
    use core::convert::Infallible;
    use nalgebra::SVector;

    type V = SVector<f64, 1>;

    /// A step of h = 0.1 of q̈ = −q from (1, 0), its end off by `off` in u, made again: evaluations, and
    /// whether its ends tell the interpolant.
    fn made_again(off: f64) -> (u32, bool) {
        let mut evaluations = 0;
        let mut oscillator = |_: f64, q: &V, _: &V| {
            evaluations += 1;
            Ok::<V, Infallible>(-q)
        };
        let knot = |t: f64, off: f64| {
            let (sine, cosine) = t.sin_cos();
            StepNode { t, y: Phase { q: V::new(cosine), u: V::new(off - sine) }, a: V::new(-cosine) }
        };
        let (start, end) = (knot(0.0, 0.0), knot(0.1, off));
        let found =
            Radau5::<V>::new().dense_from_ends(&mut oscillator, &start, &end, 0.1, &Tolerances::both(1e-6));
        let is_accurate = found.expect("it is defined").is_some_and(|found| {
            let RadauInterpolant::Quintic(quintic) = found else { panic!("the ends tell no stages") };
            (quintic.at(0.4).q[0] - 0.04f64.cos()).abs() < 1e-9
        });
        (evaluations, is_accurate)
    }

    #[test]
    fn ends_tell_the_interpolant_where_it_solves_the_equations_of_the_stages() {
        assert_eq!(made_again(0.0), (2, true));
        // Permitted are 1e-5 of the estimate at tolerance 1e-6.
        assert_eq!(made_again(1e-3), (1, false));
        assert_eq!(made_again(f64::NAN), (1, false));
    }
}
