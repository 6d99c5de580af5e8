//! Equations that are those of the model's own functions along the constraints only.
//!
//! Where a constraint says that Euler parameters have the norm 1, the macro leaves out of angular velocities
//! what is zero on every motion. M, Q and p across the constraint are then others, and so is λ of the norm;
//! q̈ is not.

use crate::compare::{BY_DIFFERENCES, EXACT, Force, Judge};
use crate::{Emitted, Own};

/// What the second route has found.
pub(crate) struct Tangential<'a> {
    pub(crate) momenta: &'a [f64],
    /// M by rows, and what its entries may be off by.
    pub(crate) mass: (&'a [f64], &'a [f64]),
    pub(crate) forces: &'a [Force],
}

impl Judge<'_> {
    /// p, and M q̈ − Q with the emitted q̈, less what the rows of Φ_q span.
    pub(crate) fn along_the_constraints(&mut self, emitted: &Emitted, own: &Own, found: &Tangential) {
        let n = self.shape.coordinates;
        let across = orthonormal(&emitted.jacobian, n);
        let off: Vec<f64> = emitted.momenta.iter().zip(found.momenta).map(|(a, b)| a - b).collect();
        let scale = found.momenta.iter().fold(0.0_f64, |s, p| s.max(p.abs()));
        for (i, off) in less(off, &across).into_iter().enumerate() {
            self.near(&format!("momentum along the constraints [{i}]"), off, 0.0, scale, EXACT, 0.0);
        }
        let Ok((a, _)) = &emitted.solved else { return };
        if own.given_along != own.forces.len() || a.iter().any(|a| a.abs() > 1e6) {
            self.report.undecided += 1;
            return;
        }
        let row =
            |of: &[f64], i: usize| -> f64 { of[n * i..n * (i + 1)].iter().zip(a).map(|(m, a)| m * a).sum() };
        let left: Vec<f64> = (0..n).map(|i| row(found.mass.0, i) - found.forces[i].value).collect();
        let spread: f64 = found.mass.1.iter().sum::<f64>() * a.iter().fold(0.0_f64, |s, a| s.max(a.abs()))
            + found.forces.iter().map(|force| force.spread).sum::<f64>();
        let scale = found.forces.iter().map(|force| force.scale + force.value.abs()).fold(0.0, f64::max);
        for (i, left) in less(left, &across).into_iter().enumerate() {
            self.near(
                &format!("equation along the constraints [{i}]"),
                left,
                0.0,
                scale,
                BY_DIFFERENCES,
                spread,
            );
        }
    }
}

/// Unit vectors at right angles that span these rows.
fn orthonormal(rows: &[f64], n: usize) -> Vec<Vec<f64>> {
    let mut found: Vec<Vec<f64>> = Vec::new();
    for row in rows.chunks(n) {
        let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let before = length(row);
        // Twice, as rounding wants it.
        let rest = less(less(row.to_vec(), &found), &found);
        let after = length(&rest);
        if after > 1e-9 * before {
            found.push(rest.into_iter().map(|x| x / after).collect());
        }
    }
    found
}

/// What is left of a vector without its parts along these.
fn less(mut vector: Vec<f64>, along: &[Vec<f64>]) -> Vec<f64> {
    for direction in along {
        let part: f64 = vector.iter().zip(direction).map(|(a, b)| a * b).sum();
        vector.iter_mut().zip(direction).for_each(|(x, d)| *x -= part * d);
    }
    vector
}
