//! The stage loop of explicit methods, linear combinations of stages, and the stiffness estimate.

use crate::integrate::phase::zip;
use crate::integrate::{Phase, System};
use crate::math;
use crate::model::Vector;

/// The entries of one row of a Butcher tableau that are not zero: (stage, coefficient).
pub type TableauRow<const K: usize> = [(usize, f64); K];

/// Σⱼ aⱼ kⱼ.
#[inline(always)]
pub(crate) fn sum<V: Vector, const K: usize>(row: &TableauRow<K>, k: &[Phase<V>]) -> Phase<V> {
    zip_sum(row, k, Phase::zeros(), |_, sum| sum)
}

/// combine(y, Σⱼ aⱼ kⱼ), element by element.
#[inline(always)]
fn zip_sum<V: Vector, const K: usize>(
    row: &TableauRow<K>,
    k: &[Phase<V>],
    mut y: Phase<V>,
    combine: impl Fn(f64, f64) -> f64,
) -> Phase<V> {
    let (q, u) = (y.q.as_mut_slice(), y.u.as_mut_slice());
    for i in 0..V::LEN {
        let (mut of_q, mut of_u) = (0.0, 0.0);
        for &(j, a) in row {
            of_q += a * k[j].q.as_slice()[i];
            of_u += a * k[j].u.as_slice()[i];
        }
        q[i] = combine(q[i], of_q);
        u[i] = combine(u[i], of_u);
    }
    y
}

/// y + h Σⱼ aⱼ kⱼ.
#[inline(always)]
pub(crate) fn advance<V: Vector, const K: usize>(
    y: &Phase<V>,
    h: f64,
    row: &TableauRow<K>,
    k: &[Phase<V>],
) -> Phase<V> {
    zip_sum(row, k, *y, |y, sum| y + h * sum)
}

/// Σⱼ aⱼ kⱼ with the bits of [`sum`], for a row as data: compiled once for all rows.
#[inline(never)]
pub(crate) fn sum_by<V: Vector>(row: &[(usize, f64)], k: &[Phase<V>]) -> Phase<V> {
    let mut out = Phase::<V>::zeros();
    let (q, u) = (out.q.as_mut_slice(), out.u.as_mut_slice());
    for &(j, a) in row {
        let (of_q, of_u) = (k[j].q.as_slice(), k[j].u.as_slice());
        for i in 0..V::LEN {
            q[i] += a * of_q[i];
            u[i] += a * of_u[i];
        }
    }
    out
}

/// The stage loop of an explicit method from y at t: stages by number, each by its row from those before it.
/// Returns the state of the last one. It is unrolled, row by row without the zeros; [`stages`] is the same as
/// a loop, with equal bits.
macro_rules! unrolled_stages {
    (
        $system:ident, ($t:expr, $y:expr, $h:expr), $nodes:ident, $k:ident,
        [$($stage:literal: $row:ident),+]
    ) => {{
        $(
            let at = $crate::integrate::explicit::tableau::advance($y, $h, &$row, $k);
            $k[$stage] = $system.derivative($t + $nodes[$stage] * $h, &at)?;
        )+
        at
    }};
}
pub(super) use unrolled_stages;

/// The rows of a tableau as data, with the nodes of the method and the index of the stage that the first of
/// them makes.
pub(crate) type TableauRows<'a> = (&'a [&'a [(usize, f64)]], &'a [f64], usize);

/// Stages of an explicit method from y at t, each from those before it, by rows as data. Returns the state of
/// the last one. Its bits are those of [`unrolled_stages`]. It is compiled once for all methods; the part of
/// a step outside the evaluations is slower.
#[inline(never)]
pub(crate) fn stages<V: Vector, S: System<V>>(
    system: &mut S,
    (t, y, h): (f64, &Phase<V>, f64),
    (rows, nodes, first): TableauRows<'_>,
    k: &mut [Phase<V>],
) -> Result<Phase<V>, S::Error> {
    let mut at = *y;
    for (stage, row) in (first..).zip(rows) {
        at = zip(y, &sum_by(row, k), |y, sum| y + h * sum);
        k[stage] = system.derivative(t + nodes[stage] * h, &at)?;
    }
    Ok(at)
}

/// Items of [`Scheme`](crate::integrate::Scheme) that explicit methods with an embedded result share. Their
/// types have the fields `k` (derivatives of the stages), `last` (state of the last stage before the result)
/// and `h`. Their modules have the nodes of the stages as `C`.
///
/// * `first_same_as_last`: seven stages by the rows C, A2 to A6 and B of the method's table. The seventh is
///   the end of the step and the first stage of the next. E has the weights of the error, D those of dense
///   output.
/// * `rows ROWS, s stages of k, E, [D, ..]`: s stages make the step; k derivatives are kept, those for dense
///   output included. ROWS has the rows of the stages, then of those for dense output. The stage between them
///   is the end of the step and has no row. E has the weights of the error. D are the weights of the
///   interpolant's coefficients from the fourth on. The method has a function `end_and_error`.
macro_rules! embedded_method {
    ($vector:ident, first_same_as_last) => {
        embedded_method!(@common $vector, 7, 7, 5, E);

        #[inline(always)]
        fn attempt<S: System<$vector>>(
            &mut self,
            system: &mut S,
            start: &StepNode<$vector>,
            h: f64,
            tolerances: &Tolerances,
        ) -> Result<(Phase<$vector>, f64), S::Error> {
            let StepNode { t, y, .. } = start;
            self.h = h;
            let k = &mut self.k;
            k[0] = start.derivative();
            self.last = unrolled_stages!(system, (t, y, h), C, k, [1: A2, 2: A3, 3: A4, 4: A5, 5: A6]);
            let end = unrolled_stages!(system, (t, y, h), C, k, [6: B]);
            let error = h.abs() * tolerances.norm(&sum(&E, k), y, &end);
            Ok((end, error))
        }

        fn replay_attempt<S: System<$vector>>(
            &mut self,
            system: &mut S,
            start: &StepNode<$vector>,
            h: f64,
            tolerances: &Tolerances,
        ) -> Result<(Phase<$vector>, f64), S::Error> {
            let StepNode { t, y, .. } = start;
            self.h = h;
            self.k[0] = start.derivative();
            let k = &mut self.k;
            self.last = stages(system, (*t, y, h), (&[&A2, &A3, &A4, &A5, &A6], &C, 1), k)?;
            let end = stages(system, (*t, y, h), (&[&B], &C, 6), k)?;
            let error = h.abs() * tolerances.norm(&sum_by(&E, k), y, &end);
            Ok((end, error))
        }

        #[inline(always)]
        fn finish<S: System<$vector>>(
            &mut self,
            _: &mut S,
            _: f64,
            _: &Phase<$vector>,
        ) -> Result<$vector, S::Error> {
            Ok(self.k[6].u)
        }

        fn dense<S: System<$vector>>(
            &mut self,
            _: &mut S,
            start: &StepNode<$vector>,
            end: &StepNode<$vector>,
            h: f64,
        ) -> Result<Self::Dense, S::Error> {
            let [change, bend, twist] = <Self::Dense>::ends(start, end, h);
            Ok(Nested([start.y, change, bend, twist, scaled(h, &sum_by(&D, &self.k))]))
        }
    };
    (
        $vector:ident, rows $rows:ident, $stages:literal stages of $kept:literal, $error:ident,
        [$($dense:ident),+]
    ) => {
        embedded_method!(@common $vector, $kept, $stages, $stages - 1, $error);

        fn replay_attempt<S: System<$vector>>(
            &mut self,
            system: &mut S,
            start: &StepNode<$vector>,
            h: f64,
            tolerances: &Tolerances,
        ) -> Result<(Phase<$vector>, f64), S::Error> {
            let StepNode { t, y, .. } = start;
            self.h = h;
            self.k[0] = start.derivative();
            self.last = stages(system, (*t, y, h), (&$rows[..$stages - 1], &C, 1), &mut self.k)?;
            Ok(self.end_and_error(y, tolerances))
        }

        fn dense<S: System<$vector>>(
            &mut self,
            system: &mut S,
            start: &StepNode<$vector>,
            end: &StepNode<$vector>,
            h: f64,
        ) -> Result<Self::Dense, S::Error> {
            let StepNode { t, y, .. } = start;
            let k = &mut self.k;
            k[$stages] = end.derivative();
            stages(system, (*t, y, h), (&$rows[$stages - 1..], &C, $stages + 1), k)?;
            let [change, bend, twist] = <Self::Dense>::ends(start, end, h);
            let higher = |row: &[(usize, f64)]| scaled(h, &sum_by(row, k));
            Ok(Nested([*y, change, bend, twist, $(higher(&$dense)),+]))
        }
    };
    (@common $vector:ident, $kept:expr, $stages:expr, $last:expr, $error:ident) => {
        fn new() -> Self {
            Self { k: [Phase::zeros(); $kept], last: Phase::zeros(), h: 0.0 }
        }

        fn stages(&self) -> &[Phase<$vector>] {
            &self.k[..$stages]
        }

        fn error_vector(&self) -> Phase<$vector> {
            scaled(self.h, &sum(&$error, &self.k))
        }

        fn stiffness(&self, h: f64, end: &StepNode<$vector>) -> Option<f64> {
            stiffness(h, (&end.y, &end.a), (&self.last, &self.k[$last].u))
        }
    };
}
pub(super) use embedded_method;

/// |h λ| of the dominant eigenvalue λ, from two nearby states (y, q̈) at the same time; `None` where they
/// coincide.
///
/// Hairer's test compares derivatives by the Euclidean norm of all of (q, u); a fast oscillator would then
/// look stiff by a mere choice of units, because there u is ω times q. For q̈ = a(q, u) an eigensolution
/// has |Δu| = |λ| |Δq| and |Δa| = |λ| |Δu|, so min(|Δa|/|Δu|, √(|Δa|/|Δq|)) is |λ| again, whatever the units.
pub(crate) fn stiffness<V: Vector>(h: f64, (x, a): (&Phase<V>, &V), (y, b): (&Phase<V>, &V)) -> Option<f64> {
    let (q, u, acceleration) = (distance(&x.q, &y.q), distance(&x.u, &y.u), distance(a, b));
    (q > 0.0 && u > 0.0).then(|| h.abs() * (acceleration / u).min(math::sqrt(acceleration / q)))
}

/// √Σ(xᵢ − yᵢ)².
fn distance<V: Vector>(x: &V, y: &V) -> f64 {
    let squares = x.as_slice().iter().zip(y.as_slice()).map(|(x, y)| (x - y) * (x - y));
    math::sqrt(squares.sum())
}

#[cfg(test)]
pub(crate) mod tests {
    /// Every row of a Runge–Kutta method sums to its node: Σⱼ aᵢⱼ = cᵢ.
    pub(crate) fn assert_row_sums(rows: &[&[(usize, f64)]], nodes: &[f64]) {
        assert_eq!(rows.len(), nodes.len());
        for (row, c) in rows.iter().zip(nodes) {
            let sum: f64 = row.iter().map(|(_, a)| a).sum();
            let size: f64 = row.iter().map(|(_, a)| a.abs()).sum();
            assert!((sum - c).abs() <= 4.0 * f64::EPSILON * size.max(1.0), "row sum {sum}, node {c}");
        }
    }
}
