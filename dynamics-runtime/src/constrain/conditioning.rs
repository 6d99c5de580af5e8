//! Condition numbers of mass matrices: κ = ‖S‖₁ ‖S⁻¹‖₁ of M scaled to a unit diagonal.

use alloc::vec::Vec;

use super::gradients::mass;
use super::inertia::{projected_inertia, unit_inertias};
use super::with_workspace;
use crate::linalg::{Lu, WorkspaceSlices, lu, max_abs};
use crate::math;
use crate::model::{Constraints, StaticTraits};

/// κ of M at a state.
pub(crate) fn condition_number<M: Constraints>(model: &M, state: &M::State) -> f64 {
    with_workspace::<M, _>(|workspace| {
        mass_condition_number(M::COORDINATES.len(), mass(model, state, workspace), M::IS_CONSTRAINED)
    })
}

/// κ of the inertia on the velocities that the constraints leave: of P S P + b (1 − P), P the projection
/// onto these velocities, b their mean inertia.
pub(crate) fn constrained_condition_number<M: Constraints>(model: &M, state: &M::State) -> f64 {
    let n = M::COORDINATES.len();
    let mean = |mass: &[f64], has_constraints: usize| match n.saturating_sub(has_constraints) {
        0 => 1.0,
        free => (0..n).map(|i| mass[i * n + i]).sum::<f64>() / free as f64,
    };
    let projected = projected_inertia(model, state, &unit_inertias(model, state), mean);
    projected.map_or(f64::NAN, |projected| mass_condition_number(n, &projected, false))
}

/// κ of M by rows; exactly 1 where M is diagonal. Coordinates without any inertia are left out where there
/// are constraints, which determine them. M determines the accelerations of the others. Coordinates that M
/// does not couple are inverted apart.
pub(crate) fn mass_condition_number(n: usize, mass: &[f64], has_constraints: bool) -> f64 {
    if !max_abs(&mass[..n * n]).is_finite() {
        return f64::NAN;
    }
    let row = |i: usize| &mass[i * n..][..n];
    let mut left: Vec<usize> =
        (0..n).filter(|i| !has_constraints || row(*i).iter().any(|x| *x != 0.0)).collect();
    let (mut size, mut size_of_inverse) = (0.0, 0.0);
    let (mut block, mut memory) = (Vec::new(), Vec::new());
    while !left.is_empty() {
        // What M couples with the first one, by others too.
        block.clear();
        block.push(left.remove(0));
        let mut at = 0;
        while let Some(&i) = block.get(at) {
            left.retain(|&j| {
                let is_coupled = row(i)[j] != 0.0 || row(j)[i] != 0.0;
                if is_coupled {
                    block.push(j);
                }
                !is_coupled
            });
            at += 1;
        }
        block.sort_unstable();
        let norms = match block[..] {
            [i] if row(i)[i] != 0.0 => Some((1.0, 1.0)),
            _ => norms_of_block(|i, j| row(i)[j], &block, &mut memory),
        };
        let Some(norms) = norms else { return f64::INFINITY };
        (size, size_of_inverse) = (math::max(size, norms.0), math::max(size_of_inverse, norms.1));
    }
    if size == 0.0 { 1.0 } else { size * size_of_inverse }
}

/// ‖S‖₁ and ‖S⁻¹‖₁ of a block, scaled to a unit diagonal; `None` where it is singular.
fn norms_of_block(
    entry: impl Fn(usize, usize) -> f64,
    block: &[usize],
    memory: &mut Vec<f64>,
) -> Option<(f64, f64)> {
    let k = block.len();
    memory.clear();
    memory.resize(k * k + lu::workspace_len(k) + 3 * k, 0.0);
    let mut workspace = WorkspaceSlices::new(memory);
    let (scaled, scale) = (workspace.take(k * k), workspace.take(k));
    let (unit, column) = (workspace.take(k), workspace.take(k));
    for (scale, &i) in scale.iter_mut().zip(block) {
        *scale = if entry(i, i) == 0.0 { 1.0 } else { entry(i, i).abs() };
    }
    for (a, &i) in block.iter().enumerate() {
        for (b, &j) in block.iter().enumerate() {
            scaled[a * k + b] = entry(i, j) / math::sqrt(scale[a] * scale[b]);
        }
    }
    let sum = |column: &mut dyn Iterator<Item = &f64>| column.map(|x| x.abs()).sum::<f64>();
    let size = (0..k).map(|b| sum(&mut scaled[b..].iter().step_by(k))).fold(0.0, f64::max);
    let factors = Lu::new(scaled, k, &mut workspace);
    let mut size_of_inverse = 0.0;
    for b in 0..k {
        (0..k).for_each(|a| unit[a] = if a == b { 1.0 } else { 0.0 });
        factors.solve(unit, column);
        size_of_inverse = math::max(size_of_inverse, sum(&mut column.iter()));
    }
    (factors.least > 0.0).then_some((size, size_of_inverse))
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::mass_condition_number;

    /// κ by the inverse of the whole matrix.
    fn by_inverse(mass: &DMatrix<f64>) -> f64 {
        let root = |i: usize| mass[(i, i)].abs().sqrt();
        let scaled = DMatrix::from_fn(mass.nrows(), mass.nrows(), |i, j| mass[(i, j)] / (root(i) * root(j)));
        let norm = |a: &DMatrix<f64>| a.column_iter().map(|c| c.lp_norm(1)).fold(0.0, f64::max);
        norm(&scaled) * norm(&scaled.lu().try_inverse().unwrap())
    }

    fn verdict(mass: &DMatrix<f64>, has_constraints: bool) -> f64 {
        mass_condition_number(mass.nrows(), mass.as_slice(), has_constraints)
    }

    /// Blocks of all sizes, whose coordinates stand in any order; full, banded and diagonal matrices.
    #[test]
    fn coordinates_that_are_not_coupled_are_inverted_apart() {
        for n in 1..12 {
            for groups in 1..=n {
                for step in [1, 5, 7] {
                    let group = |i: usize| i * step % n % groups;
                    let far = |i: usize, j: usize| groups % 3 == 2 && i.abs_diff(j) > 2 * groups;
                    let mass = DMatrix::from_fn(n, n, |i, j| match group(i) == group(j) && !far(i, j) {
                        true if i == j => 10f64.powi(i as i32 % 5 - 2) * (2.0 + n as f64),
                        true => {
                            ((i * j + i + j) as f64).sin() * 10f64.powf(0.5 * ((i % 5 + j % 5) as f64 - 4.0))
                        }
                        false => 0.0,
                    });
                    let (found, exact) = (verdict(&mass, false), by_inverse(&mass));
                    assert!((found / exact - 1.0).abs() < 1e-12, "{found} {exact} {mass}");
                    assert_eq!(verdict(&mass, true), found);
                }
            }
        }
        let diagonal = DMatrix::from_fn(9, 9, |i, j| if i == j { 0.1 + i as f64 } else { 0.0 });
        assert_eq!(verdict(&diagonal, false), 1.0);
    }

    #[test]
    fn singular_matrices_and_coordinates_without_inertia_are_told() {
        let mut mass = DMatrix::identity(4, 4);
        mass[(2, 2)] = 0.0;
        assert_eq!((verdict(&mass, false), verdict(&mass, true)), (f64::INFINITY, 1.0));
        // A coordinate that has inertia only together with another one.
        (mass[(2, 3)], mass[(3, 2)]) = (0.5, 0.5);
        assert!((verdict(&mass, true) - 1.5 * 6.0).abs() < 1e-12, "{}", verdict(&mass, true));
        assert_eq!(verdict(&DMatrix::from_element(3, 3, 2.0), true), f64::INFINITY);
        mass[(0, 1)] = f64::NAN;
        assert!(verdict(&mass, true).is_nan());
    }
}
