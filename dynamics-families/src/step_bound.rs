//! A bound of the largest frequency, and with it of the steps of explicit methods.
//!
//! For K x = λ M x let i be the place of the largest |xᵢ|. Row i gives
//!
//! ```text
//! |λ| (mᵢᵢ − Σ |mᵢⱼ|) ≤ Σ |kᵢⱼ|       hence  ω² ≤ maxᵢ Σⱼ |kᵢⱼ| / (mᵢᵢ − Σⱼ |mᵢⱼ|)
//! ```
//!
//! with sums over j ≠ i on the left: Gershgorin's theorem for a pencil. With unknowns in other units, x = W
//! y, the same holds; wᵢ = 1/√mᵢᵢ is tried as well. The bound is attained in the limit by uniform bars, of
//! lumped masses (h = length of an element / c) and of consistent ones (that over √3). Where M is not
//! dominant on its diagonal, the largest eigenvalue is enclosed by the signs of pivots of K − λ M.
//!
//! Constraints only lower the largest frequency (Courant), so that the bound holds with them, too; K then
//! contains −∂(Jᵀλ)/∂q.

use std::sync::Arc;

use crate::failure::FamilyErrorKind;
use crate::linalg::bordered::{Bordered, Factors, Kind};
use crate::linalg::order::Layout;
use crate::model::{Entries, FamilyModel, FamilyState, Length, Sizes, View};

/// Relative width at which the enclosure by counts ends.
const ENCLOSURE: f64 = 1e-6;

/// A bound of ω² at a state: no frequency is above its root.
pub(crate) fn largest_frequency_squared<M: FamilyModel>(
    model: &M,
    at: View<'_>,
    ends: &Sizes,
    multipliers: &[f64],
) -> Result<f64, FamilyErrorKind> {
    let all = |add: &mut Entries<'_>| {
        model.stiffness(at, add);
        if !multipliers.is_empty() {
            model.row_stiffness(at, multipliers, add);
        }
    };
    // The band of a grid is wide, and the bound needs sums over rows alone.
    if M::DIAGONAL && M::FIELDS.iter().any(|field| matches!(field.length, Length::Grid { .. })) {
        return unassembled(model, &all, ends);
    }
    let mut pattern = |visit: &mut dyn FnMut(usize, usize)| {
        all(&mut |i, j, _| visit(i, j));
        model.mass(&mut |i, j, _| visit(i, j));
    };
    let Ok(layout) = Layout::new(ends, &mut pattern) else {
        return unassembled(model, &all, ends);
    };
    let layout = Arc::new(layout);
    let (mut mass, mut stiffness) = (Bordered::new(&layout), Bordered::new(&layout));
    model.mass(&mut |i, j, value| {
        mass.add(i, j, value);
    });
    all(&mut |i, j, value| {
        stiffness.add(i, j, value);
    });
    let n = layout.unknown.len();
    let mut diagonal = vec![0.0; n];
    mass.for_each_row(|i, entry, _| diagonal[i] = entry);
    if let Some(place) =
        diagonal.iter().position(|mass| mass.partial_cmp(&0.0) != Some(core::cmp::Ordering::Greater))
    {
        let coordinate = crate::mass::coordinate_name::<M>(ends, layout.unknown[place]);
        return Err(FamilyErrorKind::MassNotPositive { coordinate });
    }
    let plain = vec![1.0; n];
    let scaled: Vec<f64> = diagonal.iter().map(|mass| 1.0 / mass.sqrt()).collect();
    let bounds = [plain, scaled].map(|weights| by_rows(&mass, &stiffness, &weights));
    let bound = bounds.into_iter().flatten().fold(f64::INFINITY, f64::min);
    if bound.is_finite() { Ok(bound) } else { by_counts(&mass, &stiffness, &layout) }
}

/// The bound by rows, with weights of the unknowns; none where M is not dominant.
fn by_rows(mass: &Bordered, stiffness: &Bordered, weights: &[f64]) -> Option<f64> {
    let mut inertia = vec![0.0; weights.len()];
    mass.for_each_row(|i, diagonal, others| {
        inertia[i] = diagonal * weights[i] - others.map(|(j, entry)| entry.abs() * weights[j]).sum::<f64>();
    });
    if !inertia.iter().all(|&inertia| inertia > 0.0) {
        return None;
    }
    let mut bound = 0.0f64;
    stiffness.for_each_row(|i, diagonal, others| {
        let sum =
            others.map(|(j, entry)| entry.abs() * weights[j]).sum::<f64>() + diagonal.abs() * weights[i];
        bound = bound.max(sum / inertia[i]);
    });
    bound.is_finite().then_some(bound)
}

/// The largest eigenvalue from above, by the number of eigenvalues below a shift.
fn by_counts(mass: &Bordered, stiffness: &Bordered, layout: &Arc<Layout>) -> Result<f64, FamilyErrorKind> {
    if !stiffness.is_symmetric() {
        return Err(FamilyErrorKind::NotSymmetric {
            matrix: "tangent stiffness",
            remedy: "so there is no bound of its frequencies; choose an adaptive or an implicit method",
        });
    }
    let n = layout.unknown.len();
    let mut shifted = Bordered::new(layout);
    let mut factors = Factors::new(layout, Kind::Symmetric);
    let mut all_below = |shift: f64| {
        shifted.clear();
        shifted.add_multiple(1.0, stiffness);
        shifted.add_multiple(-shift, mass);
        factors.factor(&shifted, Kind::Symmetric).is_ok() && factors.negative == n
    };
    let mut above = f64::MIN_POSITIVE;
    stiffness.for_each_row(|_, diagonal, _| above = above.max(diagonal.abs()));
    let mut heaviest = f64::MIN_POSITIVE;
    mass.for_each_row(|_, diagonal, _| heaviest = heaviest.max(diagonal));
    above /= heaviest;
    let mut doublings = 0;
    while !all_below(above) {
        above *= 4.0;
        doublings += 1;
        if doublings > 500 {
            return Err(FamilyErrorKind::Singular {
                matrix: "mass matrix",
                coordinate: String::new(),
                remedy: "give each node a positive mass",
            });
        }
    }
    let mut below = if doublings == 0 { 0.0 } else { above / 4.0 };
    while above - below > ENCLOSURE * above {
        let middle = 0.5 * (above + below);
        if all_below(middle) { above = middle } else { below = middle }
    }
    Ok(above)
}

/// The bound by rows of a diagonal M where K is no banded matrix: sums of sizes of its entries as they come,
/// with the same weights.
fn unassembled<M: FamilyModel>(
    model: &M,
    stiffness: &dyn Fn(&mut Entries<'_>),
    ends: &Sizes,
) -> Result<f64, FamilyErrorKind> {
    if !M::DIAGONAL {
        return Err(FamilyErrorKind::NotBanded { matrix: "mass matrix" });
    }
    let n = ends.unknowns();
    let (mut masses, mut diagonal, mut sums) = (vec![0.0; n], vec![0.0; n], vec![[0.0; 2]; n]);
    model.mass(&mut |i, _, value| masses[i] += value);
    let positive = |mass: &f64| *mass > 0.0 && mass.is_finite();
    if let Some(unknown) = masses.iter().position(|mass| !positive(mass)) {
        let coordinate = crate::mass::coordinate_name::<M>(ends, unknown);
        return Err(FamilyErrorKind::MassNotPositive { coordinate });
    }
    stiffness(&mut |i, j, value| {
        if i == j {
            diagonal[i] += value;
        } else {
            let weight = (masses[i] / masses[j]).sqrt();
            sums[i] = [sums[i][0] + value.abs(), sums[i][1] + value.abs() * weight];
        }
    });
    let bounds = [0, 1].map(|weights| {
        let rows = masses.iter().zip(diagonal.iter().zip(&sums));
        rows.map(|(mass, (diagonal, sum))| (f64::abs(*diagonal) + sum[weights]) / mass).fold(0.0, f64::max)
    });
    Ok(bounds[0].min(bounds[1]))
}

/// The same for damping: a bound of the eigenvalues of M⁻¹ D, by rows; none where M is not dominant.
pub(crate) fn largest_damping<M: FamilyModel>(model: &M, at: View<'_>, ends: &Sizes) -> Option<f64> {
    let n = ends.unknowns();
    let (mut inertia, mut sums) = (vec![0.0; n], vec![0.0; n]);
    model.mass(&mut |i, j, value| inertia[i] += if i == j { value } else { -value.abs() });
    model.damping(at, &mut |i, _, value| sums[i] += value.abs());
    if !inertia.iter().all(|&inertia| inertia > 0.0) {
        return None;
    }
    Some(sums.iter().zip(&inertia).map(|(sum, inertia)| sum / inertia).fold(0.0, f64::max))
}

/// The longest step of leapfrog at a state, 2/ω; infinite where nothing oscillates.
pub(crate) fn longest_step<M: FamilyModel>(
    model: &M,
    state: &M::State,
    inputs: &[f64],
    ends: &Sizes,
    multipliers: &[f64],
) -> Result<f64, FamilyErrorKind> {
    let at = View { inputs, ..state.view() };
    let square = largest_frequency_squared(model, at, ends, multipliers)?;
    Ok(if square > 0.0 { 2.0 / square.sqrt() } else { f64::INFINITY })
}
