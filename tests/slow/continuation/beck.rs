//! Beck's column, a cantilever under a load that follows its end: P = 20.0509536 EI/L² (M. Beck, ZAMP 3
//! (1952) 225; V. V. Bolotin, *Nonconservative Problems of the Theory of Elastic Stability*).
//!
//! Displacements are made of w″ = Σ aₖ Pₖ(2x − 1), Legendre's polynomials integrated twice from the clamped
//! end: with ten of them the beam is there to twelve digits.

use dynamics::analysis::{SpecialKind, continuation};
use dynamics::prelude::*;

/// How many shapes.
const N: usize = 10;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: [_; 10])]
struct Beck {
    mass: [f64; 100],
    bending: [f64; 100],
    turning: [f64; 100],
    /// Deflection and slope of the end.
    end: [f64; 10],
    slope: [f64; 10],
    load: f64,
}

#[dynamics]
impl Beck {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..10 {
            for j in 0..10 {
                sum += 0.5 * self.mass[10 * i + j] * q.a[i].dt() * q.a[j].dt();
            }
        }
        sum
    }
    /// ½∫w″² − ½P∫w′².
    #[potential]
    fn bending(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..10 {
            for j in 0..10 {
                let stiffness = self.bending[10 * i + j] - self.load * self.turning[10 * i + j];
                sum += 0.5 * stiffness * q.a[i] * q.a[j];
            }
        }
        sum
    }
    /// The load turns with the end: −P w′ across.
    #[force]
    fn across(&self, q: &Coordinates<Self>) -> Force {
        let (mut deflection, mut slope) = (Expr::ZERO, Expr::ZERO);
        for i in 0..10 {
            deflection += self.end[i] * q.a[i];
            slope += self.slope[i] * q.a[i];
        }
        Force::along(deflection, -self.load * slope)
    }
}

/// Nodes and weights of Gauss and Legendre on [0, 1].
fn gauss(count: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (count as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..60 {
            let p = legendre(count + 1, x);
            slope = count as f64 * (x * p[count] - p[count - 1]) / (x * x - 1.0);
            x -= p[count] / slope;
        }
        (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).collect()
}

/// P₀ … of x.
fn legendre(count: usize, x: f64) -> Vec<f64> {
    let mut p = vec![1.0, x];
    for k in 2..count.max(2) {
        let n = k as f64;
        p.push(((2.0 * n - 1.0) * x * p[k - 1] - (n - 1.0) * p[k - 2]) / n);
    }
    p
}

/// w, w′ and w″ of all shapes: ∫Pₖ = (Pₖ₊₁ − Pₖ₋₁)/(2k + 1), from −1, and half for each integration over x in
/// [0, 1].
fn shapes(x: f64) -> [[f64; N]; 3] {
    let p = legendre(N + 3, 2.0 * x - 1.0);
    // ∫P₀ = P₀ + P₁.
    let once = |k: usize| if k == 0 { p[0] + p[1] } else { (p[k + 1] - p[k - 1]) / (2 * k + 1) as f64 };
    let twice = |k: usize| match k {
        0 => once(0) + once(1),
        _ => (once(k + 1) - once(k - 1)) / (2 * k + 1) as f64,
    };
    [
        core::array::from_fn(|k| 0.25 * twice(k)),
        core::array::from_fn(|k| 0.5 * once(k)),
        core::array::from_fn(|k| p[k]),
    ]
}

fn column(load: f64) -> Beck {
    let nodes = gauss(N + 4);
    let of = |derivative: usize| {
        let product = |i: usize, j: usize| -> f64 {
            nodes.iter().map(|(x, w)| w * shapes(*x)[derivative][i] * shapes(*x)[derivative][j]).sum()
        };
        core::array::from_fn(|k| product(k / N, k % N))
    };
    let [end, slope, _] = shapes(1.0);
    Beck { mass: of(0), bending: of(2), turning: of(1), end, slope, load }
}

#[test]
fn becks_column_flutters_at_the_published_load() {
    let unloaded = column(0.0);
    let rest = unloaded.state().build().unwrap();
    // Without a load: the cantilever.
    let found = unloaded.linearize(&rest).unwrap().modes().unwrap();
    for (mode, wanted) in found.iter().zip([3.516_015_268_500_151, 22.034_491_564_666_77]) {
        assert!((mode.frequency() / wanted - 1.0).abs() < 1e-10, "{} {wanted}", mode.frequency());
    }
    let family = |load: f64| Beck { load, ..unloaded.clone() };
    let branch = continuation(family).from(&rest, 0.0).until(0.0..=25.0).run().unwrap();
    let first = branch.special.first().unwrap();
    let SpecialKind::FrequenciesMeet { frequency } = first.kind else { panic!("{branch}") };
    assert!((first.parameter / 20.050_953_618_973_76 - 1.0).abs() < 1e-10, "{first:?}");
    assert!((frequency / 11.015_557_640_922_874 - 1.0).abs() < 1e-6, "{first:?}");
    // Statics sees nothing: a load that follows does not let it lean.
    assert_eq!(branch.branch_points().count() + branch.folds().count(), 0, "{branch}");
}
