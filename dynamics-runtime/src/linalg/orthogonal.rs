//! Complete orthogonal decomposition of a set of vectors, the rows of a matrix A (r×n), with its rank decided
//! by pivoting.
//!
//! Householder with pivoting: Aᵀ P = Q [R₁ R₂; 0 0], R₁ k×k upper triangular, k the rank. Then, from the
//! right, [R₁ R₂] = [T 0] Vᵀ with T lower triangular. So A = P V [Tᵀ 0; 0 0] Qᵀ: the first k columns of Q
//! span the row space, the others its null space, and least-squares solutions of both A x = b and Aᵀ y = c,
//! of least norm, cost two triangular solves. At full rank it is
//! plain QR. Below, the result does not depend on which of the dependent rows count as redundant, unless some
//! are declared redundant: these come last.
//!
//! Cost: 2nr² operations. Golub & Van Loan, Matrix Computations, 4th ed., §5.4–5.5. Stability: backward
//! stable; the rank found this way can exceed the numerical rank in matrices contrived to that end (Kahan's).

use super::rows::{add_scaled, dot, norm, swap_rows, two_rows};
use super::workspace::{Indices, WorkspaceSlices};

/// Turns x into (β, v₂, …) with H x = β e₁, H = I − τ v vᵀ, v₁ = 1; returns τ.
fn reflector(x: &mut [f64]) -> f64 {
    let Some((first, rest)) = x.split_first_mut() else { return 0.0 };
    // Also a tiny tail is reflected: leaving it out would be an error of A.
    let tail = norm(rest);
    if tail == 0.0 {
        return 0.0;
    }
    let beta = -norm(&[*first, tail]).copysign(*first);
    let tau = (beta - *first) / beta;
    let scale = 1.0 / (*first - beta);
    rest.iter_mut().for_each(|x| *x *= scale);
    *first = beta;
    tau
}

/// H x for the reflector (1, v₂, …), stored as `v` with anything in its first place.
#[inline]
fn reflect(v: &[f64], tau: f64, x: &mut [f64]) {
    let along = tau * (x[0] + dot(&v[1..], &x[1..]));
    x[0] -= along;
    add_scaled(&mut x[1..], -along, &v[1..]);
}

/// A row that is declared redundant is chosen before the others if its remaining length times this is larger
/// than theirs. 1 would exchange rows of equal length from one state to the next, 0 would keep nearly
/// dependent rows.
const REDUNDANT_ROW_WEIGHT: f64 = 0.5;

/// A row whose unit vector has at most this component in the null space of Aᵀ is independent of the others.
/// The component is 0 or of the order of the coefficients of the dependency; rounding is far below.
const INDEPENDENT_ROW_COMPONENT: f64 = 1e-8;

/// The decomposition.
pub(crate) struct Orthogonal<'w> {
    /// Number of rows of A.
    r: usize,
    /// Number of columns of A.
    n: usize,
    /// The rank k.
    pub(crate) rank: usize,
    /// First pivot over the smallest admitted one: an estimate of the condition of A; 1 without pivots.
    pub(crate) condition: f64,
    /// R by columns, below it the reflectors of Q.
    a: &'w mut [f64],
    tau: &'w mut [f64],
    /// T by rows, beside it the reflectors of V; k×r.
    c: &'w mut [f64],
    tau_right: &'w mut [f64],
    /// Row of A at each place.
    order: Indices<'w>,
    /// Some rows are declared redundant.
    pub(crate) has_redundant_rows: bool,
}

/// Length of the workspace of a decomposition besides A.
pub(crate) const fn workspace_len(r: usize) -> usize {
    r * r + 3 * r
}

impl<'w> Orthogonal<'w> {
    /// Decomposes A, whose rows should be of about equal length: a pivot below `tolerance` times the first
    /// one counts as zero. `redundant`: the rows that are declared redundant.
    pub(crate) fn new(
        a: &'w mut [f64],
        (r, n): (usize, usize),
        redundant: &dyn Fn(usize) -> bool,
        tolerance: f64,
        workspace: &mut WorkspaceSlices<'w>,
    ) -> Self {
        let (tau, tau_right) = (workspace.take(r), workspace.take(r));
        let order = workspace.indices(r);
        let c = workspace.zeros(r * r);
        let has_redundant_rows = (0..r).any(redundant);
        let mut it = Self { r, n, rank: 0, condition: 1.0, a, tau, c, tau_right, order, has_redundant_rows };
        it.reduce_left(redundant, tolerance);
        it.reduce_right();
        it
    }

    /// Aᵀ P = Q R, the longest remaining column first.
    fn reduce_left(&mut self, redundant: &dyn Fn(usize) -> bool, tolerance: f64) {
        let (r, n) = (self.r, self.n);
        let mut first = 0.0;
        while self.rank < r.min(n) {
            let k = self.rank;
            let length = |i: usize| norm(&self.a[i * n + k..(i + 1) * n]);
            let longest = |redundant_ones: bool| {
                let rows = (k..r)
                    .filter(|i| redundant_ones == (self.has_redundant_rows && redundant(self.order.get(*i))));
                let lengths = rows.map(|i| (i, length(i)));
                lengths.fold((k, 0.0), |best: (usize, f64), next| if next.1 > best.1 { next } else { best })
            };
            let (mut row, mut size) = longest(false);
            if self.has_redundant_rows {
                let instead = longest(true);
                if REDUNDANT_ROW_WEIGHT * instead.1 > size || size <= tolerance * first {
                    (row, size) = instead;
                }
            }
            if k == 0 {
                first = size;
            }
            if size <= tolerance * first {
                break;
            }
            // Redundant rows that were chosen do not come in the order of length.
            self.condition = self.condition.max(first / size);
            swap_rows(self.a, n, k, row);
            self.order.swap(k, row);
            self.tau[k] = reflector(&mut self.a[k * n + k..(k + 1) * n]);
            for i in k + 1..r {
                let (v, x) = two_rows(self.a, n, k, i);
                reflect(&v[k..], self.tau[k], &mut x[k..]);
            }
            self.rank += 1;
        }
    }

    /// [R₁ R₂] = [T 0] Vᵀ, by reflectors on the rows of R.
    fn reduce_right(&mut self) {
        let (r, n) = (self.r, self.n);
        if self.rank == r {
            // At full rank T is R₁, and V is not needed.
            return;
        }
        for i in 0..self.rank {
            for p in i..r {
                self.c[i * r + p] = self.a[p * n + i];
            }
        }
        for i in 0..self.rank {
            self.tau_right[i] = reflector(&mut self.c[i * r + i..(i + 1) * r]);
            for l in i + 1..self.rank {
                let (v, x) = two_rows(self.c, r, i, l);
                reflect(&v[i..], self.tau_right[i], &mut x[i..]);
            }
        }
    }

    /// Qᵀ x, in place.
    pub(crate) fn rotate(&self, x: &mut [f64]) {
        let n = self.n;
        for j in 0..self.rank {
            reflect(&self.a[j * n + j..(j + 1) * n], self.tau[j], &mut x[j..]);
        }
    }

    /// Q x, in place.
    pub(crate) fn rotate_back(&self, x: &mut [f64]) {
        let n = self.n;
        for j in (0..self.rank).rev() {
            reflect(&self.a[j * n + j..(j + 1) * n], self.tau[j], &mut x[j..]);
        }
    }

    /// Qᵀ M Q of a symmetric M (n×n), in place, with a workspace of n numbers.
    pub(crate) fn rotate_symmetric(&self, m: &mut [f64], w: &mut [f64]) {
        let n = self.n;
        for j in 0..self.rank {
            let v = &self.a[j * n + j..(j + 1) * n];
            let tau = self.tau[j];
            m.chunks_exact_mut(n).for_each(|row| reflect(v, tau, &mut row[j..]));
            // The same from the left: M −= τ v (vᵀM).
            w.copy_from_slice(&m[j * n..(j + 1) * n]);
            for (i, v) in v.iter().enumerate().skip(1) {
                add_scaled(w, *v, &m[(j + i) * n..(j + i + 1) * n]);
            }
            add_scaled(&mut m[j * n..(j + 1) * n], -tau, w);
            for (i, v) in v.iter().enumerate().skip(1) {
                add_scaled(&mut m[(j + i) * n..(j + i + 1) * n], -tau * v, w);
            }
        }
    }

    /// The y (k numbers, in the rotated frame: x = Q (y, ·)) that fits A x = b best; `b` (r numbers) becomes
    /// what is left over, b − A x. `w`: a workspace of r numbers. Where rows are declared redundant, the
    /// chosen rows are fulfilled exactly: off the constraint manifold the others differ from the rows that
    /// they repeat, and a weighting would change from one state to the next, like a force that is not smooth.
    pub(crate) fn fit(&self, b: &mut [f64], y: &mut [f64], w: &mut [f64]) {
        let (r, k) = (self.r, self.rank);
        for (p, w) in w.iter_mut().enumerate() {
            *w = b[self.order.get(p)];
        }
        if k == r || self.has_redundant_rows {
            // R₁ᵀ y = P b: column i of R₁ lies at the start of row i.
            for i in 0..k {
                let column = &self.a[i * self.n..];
                y[i] = (w[i] - dot(&column[..i], &y[..i])) / column[i];
            }
            b.fill(0.0);
            (k..r).for_each(|p| {
                b[self.order.get(p)] = w[p] - dot(&self.a[p * self.n..p * self.n + k], &y[..k])
            });
            return;
        }
        for i in 0..k {
            reflect(&self.c[i * r + i..(i + 1) * r], self.tau_right[i], &mut w[i..]);
        }
        // Tᵀ y = the first k.
        for i in (0..k).rev() {
            let later: f64 = (i + 1..k).map(|l| self.c[l * r + i] * y[l]).sum();
            y[i] = (w[i] - later) / self.c[i * r + i];
        }
        w[..k].fill(0.0);
        self.spread(w, b);
    }

    /// The λ (r numbers) of least norm with Aᵀ λ = Q (f, 0); `f` has k numbers. `w`: a workspace of r
    /// numbers.
    pub(crate) fn least_norm(&self, f: &[f64], lambda: &mut [f64], w: &mut [f64]) {
        let (r, k) = (self.r, self.rank);
        if k == r {
            for i in (0..k).rev() {
                let later: f64 = (i + 1..k).map(|l| self.a[l * self.n + i] * w[l]).sum();
                w[i] = (f[i] - later) / self.a[i * self.n + i];
                lambda[self.order.get(i)] = w[i];
            }
            return;
        }
        w.fill(0.0);
        for i in 0..k {
            let row = &self.c[i * r..(i + 1) * r];
            w[i] = (f[i] - dot(&row[..i], &w[..i])) / row[i];
        }
        self.spread(w, lambda);
    }

    /// Whether row i of A is independent of the others: the λᵢ of Aᵀλ = c is then the same in all solutions
    /// (Wojtyra, Mech. Mach. Theory 40, 2005, 1061–1077). `w`: a workspace of r numbers.
    pub(crate) fn is_independent(&self, i: usize, w: &mut [f64]) -> bool {
        let (r, k) = (self.r, self.rank);
        if k == r {
            return true;
        }
        // The component of eᵢ in the null space of Aᵀ, which the last columns of P V span.
        (0..r).for_each(|p| w[p] = if self.order.get(p) == i { 1.0 } else { 0.0 });
        for j in 0..k {
            reflect(&self.c[j * r + j..(j + 1) * r], self.tau_right[j], &mut w[j..]);
        }
        norm(&w[k..r]) <= INDEPENDENT_ROW_COMPONENT
    }

    /// P V w.
    fn spread(&self, w: &mut [f64], out: &mut [f64]) {
        let (r, k) = (self.r, self.rank);
        for i in (0..k).rev() {
            reflect(&self.c[i * r + i..(i + 1) * r], self.tau_right[i], &mut w[i..]);
        }
        for (p, w) in w.iter().enumerate() {
            out[self.order.get(p)] = *w;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_decomposition_puts_the_rows_together_again() {
        // A small tail beside a large head, a row that repeats another, and one that nearly does.
        let rows = [[1.0, 1e-9, 0.0], [0.6, 0.0, 0.8], [1.0, 1e-9, 0.0], [0.6, 1e-5, 0.8]];
        let (mut a, mut work) = (rows.concat(), [0.0; workspace_len(4)]);
        let it = Orthogonal::new(&mut a, (4, 3), &|_| false, 1e-8, &mut WorkspaceSlices::new(&mut work));
        assert!(it.rank == 3 && it.condition > 1e4, "{} {}", it.rank, it.condition);
        for row in rows {
            // Rows lie in the span of the first columns of Q, and keep their length.
            let mut turned = row;
            it.rotate(&mut turned);
            assert!((norm(&turned) - norm(&row)).abs() < 1e-15);
            it.rotate_back(&mut turned);
            assert!(turned.iter().zip(row).all(|(x, y)| (x - y).abs() < 1e-15), "{turned:?}");
        }
        let x = [0.3, -0.7, 0.2];
        let mut b = rows.map(|row| dot(&row, &x));
        let (mut y, mut w) = ([0.0; 3], [0.0; 4]);
        it.fit(&mut b, &mut y, &mut w);
        it.rotate_back(&mut y);
        assert!(y.iter().zip(x).all(|(y, x)| (y - x).abs() < 1e-10) && norm(&b) < 1e-15, "{y:?} {b:?}");
        assert!(
            !it.is_independent(0, &mut w) && !it.is_independent(2, &mut w) && it.is_independent(3, &mut w)
        );
    }

    #[test]
    fn a_small_tail_is_reflected_away_exactly() {
        for tail in [1e-3, 1e-9, 1e-17, 1e-200] {
            let x = [1.0, tail];
            let mut v = x;
            let tau = reflector(&mut v);
            let mut y = x;
            reflect(&v, tau, &mut y);
            assert!(y[1].abs() <= 1e-15 * tail && (y[0].abs() - 1.0).abs() < 1e-6, "{tail}: {y:?}");
        }
    }
}
