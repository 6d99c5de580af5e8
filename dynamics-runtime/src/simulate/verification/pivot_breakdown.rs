//! Pivot breakdown: which pivot of the generated code vanished where the general solver took over.
//!
//! Generated code computes dependent coordinates from constraints by blocks of Φ_q. The block nearest to
//! being singular names the rows and coordinates. Pivots outside of these blocks are not seen.

use alloc::vec;
use alloc::vec::Vec;
use core::fmt;

use nalgebra::DMatrix;

use crate::constrain::gradients::Gradients;
use crate::constrain::workspace_len;
use crate::math;
use crate::model::{Block, Quantity, SimulationModel, Vector};
use crate::simulate::trajectory::motion::Motion;
use crate::wording::names;

/// A block is named where its determinant is below this part of the product of its column or row norms. The
/// guards of generated code trigger at 10⁻² and less.
const SMALL_DETERMINANT: f64 = 2e-2;

/// Coordinates that no longer follow from their constraints where generated code, which has it that way, was
/// left for the general solver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PivotBreakdown {
    /// Rows of the constraints.
    pub rows: Vec<&'static str>,
    /// The coordinates that follow from them elsewhere.
    pub coordinates: Vec<&'static str>,
}

impl fmt::Display for PivotBreakdown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        names(f, &self.coordinates)?;
        f.write_str(" from ")?;
        names(f, &self.rows)
    }
}

impl<M: SimulationModel> Motion<'_, M> {
    /// The block that was nearest to being singular when generated code was left first; `None` where none was
    /// near it.
    pub(crate) fn pivot_breakdown(&self) -> Option<PivotBreakdown> {
        let time = self.trajectory.stabilization.general_at.filter(|_| !M::BLOCKS.is_empty())?;
        let (from, to) = (self.start_time(), self.end_time());
        let state = self.at(time.clamp(math::min(from, to), math::max(from, to)));
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let mut workspace = vec![0.0; workspace_len(n, r)];
        let at = weakest_block(M::BLOCKS, Gradients::of(self.model(), &state, &mut workspace).rows, n)?;
        let of = |all: &'static [Quantity], some: &[usize]| some.iter().map(|i| all[*i].name).collect();
        Some(PivotBreakdown { rows: of(M::ROWS, at.rows), coordinates: of(M::COORDINATES, at.coordinates) })
    }
}

/// The block that is nearest to being singular, if it is near it; Φ_q by rows of n.
fn weakest_block(blocks: &'static [Block], jacobian: &[f64], n: usize) -> Option<&'static Block> {
    let ratio = |block: &Block| {
        let entries =
            block.rows.iter().flat_map(|row| block.coordinates.iter().map(move |j| jacobian[row * n + j]));
        let determinant =
            DMatrix::from_row_iterator(block.rows.len(), block.coordinates.len(), entries).determinant();
        let column = |j: &usize| norm(jacobian.iter().skip(*j).step_by(n));
        let row = |i: &usize| norm(&jacobian[i * n..(i + 1) * n]);
        let by_columns: f64 = block.coordinates.iter().map(column).product();
        determinant.abs() / math::max(by_columns, block.rows.iter().map(row).product())
    };
    let ratios = blocks.iter().map(|block| (block, ratio(block)));
    // A block of zeros gives 0/0, and is singular.
    let ratios = ratios.map(|(block, ratio)| (block, if ratio.is_nan() { 0.0 } else { ratio }));
    ratios
        .min_by(|(_, a), (_, b)| a.total_cmp(b))
        .filter(|(_, ratio)| *ratio < SMALL_DETERMINANT)
        .map(|(block, _)| block)
}

fn norm<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    math::sqrt(values.into_iter().map(|x| x * x).sum())
}
