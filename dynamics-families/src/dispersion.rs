//! Waves between the ends: frequencies of a wave that goes on by a phase κ from node to node.
//!
//! With displacements a e^{i(κj − ωt)} at node j the rows of a node far from the ends become small Hermitian
//! matrices
//!
//! ```text
//! K(κ) = Σ_d K_d e^{iκd}     M(κ) = Σ_d M_d e^{iκd}     K(κ) a = ω² M(κ) a
//! ```
//!
//! with K_d, M_d what couples a node to the one d further. There is a branch for every field. Its group
//! velocity is dω/dκ = aᴴ(K' − ω²M')a / (2 ω aᴴMa), the speed of energy; where ω = 0 it is the limit for long
//! waves. Source: Brillouin, *Wave Propagation in Periodic Structures* (1946), chapters 2 to 4; Lancaster,
//! *On eigenvalues of matrices dependent on a parameter*, Numer. Math. 6 (1964) 377.

use dynamics_runtime::simulate::OptionError;

use crate::error::FamilyError;
use crate::failure::{FamilyErrorKind, check_state};
use crate::linalg::hermitian::{Complex, Square};
use crate::linalg::order::FAR_NODES;
use crate::mass::coordinate_name;
use crate::model::{FamilyModel, FamilyState, Length, Sizes};

/// Relative difference up to which rows of two nodes are alike: places along a long string are rounded.
const ALIKE: f64 = 1e-6;
/// Relative distance of squares of frequencies up to which branches meet.
const MEETING: f64 = 1e-9;
/// Rounding of ω² in parts of the largest one.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// One of the waves with a given phase per node; there is one for every field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FamilyBranch {
    /// ω, in radians per unit of time, not negative. Its square is known to the rounding of the largest one;
    /// where K has first differences alone, as of bars and strings, to its own.
    pub frequency: f64,
    /// dω/dκ, in nodes per unit of time: the speed at which energy moves. Times the distance of two nodes it
    /// is a speed. At ω = 0 it is that of long waves. NaN where rounding hides it.
    pub group_velocity: f64,
}

/// The waves of this phase per node, by rising frequency.
pub(crate) fn dispersion<M: FamilyModel>(
    model: &M,
    state: &M::State,
    phases: &[f64],
) -> Result<Vec<FamilyBranch>, FamilyError<M>> {
    let failed = |kind: FamilyErrorKind| FamilyError::before(kind, state.t());
    let ends = model.ends().map_err(|error| failed(error.into()))?;
    check_state::<M>(state, &ends).map_err(failed)?;
    let grid = M::FIELDS.iter().any(|field| matches!(field.length, Length::Grid { .. }));
    for (there, of) in [(!M::ROWS.is_empty(), "constraints"), (grid, "grids")] {
        if there {
            return Err(failed(FamilyErrorKind::WavesUnsupported { of }));
        }
    }
    let &[phase] = phases else {
        return Err(failed(FamilyErrorKind::PhaseCount { given: phases.len(), needed: 1 }));
    };
    if !phase.is_finite() {
        let admissible = "a finite phase, in radians per node";
        return Err(failed(OptionError::Number { option: "dispersion", value: phase, admissible }.into()));
    }
    let nodes = Nodes::new::<M>(&ends).ok_or_else(|| failed(FamilyErrorKind::NoInterior))?;
    let stiffness = RowsBetween::new(&nodes, &mut |add| model.stiffness(state.view(), add));
    if !stiffness.is_finite() {
        let missing = state.inputs().iter().position(|input| !input.is_finite());
        return Err(failed(match missing {
            Some(input) => OptionError::InputWithoutValue { input: M::INPUTS[input].name }.into(),
            None => FamilyErrorKind::AccelerationNotFinite { coordinate: nodes.name::<M>(&ends, 0, 0) },
        }));
    }
    let mass = RowsBetween::new(&nodes, &mut |add| model.mass(add));
    for rows in [&stiffness, &mass] {
        if let Some((field, node)) = rows.odd_one(&nodes) {
            let coordinate = nodes.name::<M>(&ends, field, node);
            return Err(failed(FamilyErrorKind::NodesDiffer { coordinate }));
        }
    }
    if !stiffness.is_symmetric(&nodes) {
        let remedy = "so its waves are not real; simulate a short wave instead";
        return Err(failed(FamilyErrorKind::NotSymmetric { matrix: "tangent stiffness", remedy }));
    }
    let symbols = [&stiffness, &mass].map(|rows| [0, 1, 2].map(|order| rows.symbol(phase, order)));
    let waves = Waves::new(&symbols, &stiffness).map_err(|field| {
        failed(FamilyErrorKind::MassNotPositive { coordinate: nodes.name::<M>(&ends, field, 0) })
    })?;
    let grows = |square: f64| failed(FamilyErrorKind::WaveGrows { phase, rate: (-square).sqrt() });
    waves.branches(&symbols, phase).map_err(grows)
}

/// The nodes between the ends: of every family those of its middle half, and at least one.
struct Nodes {
    /// Index in q of the first of these nodes, by family.
    first: Vec<usize>,
    /// How many they are, by family.
    count: Vec<usize>,
    /// Which unknowns they are: family and node, by index in q.
    ends: Sizes,
    families: Vec<usize>,
    /// The number of the first of them, by family.
    number: Vec<usize>,
}

impl Nodes {
    /// `None` where a family has fewer than three nodes.
    fn new<M: FamilyModel>(ends: &Sizes) -> Option<Self> {
        let begin = |field: usize| if field == 0 { 0 } else { ends[field - 1] };
        let count = |field: usize| match M::FIELDS[field].length {
            Length::Count { count, .. } => Some(count),
            Length::One | Length::Grid { .. } => None,
        };
        let families: Vec<usize> = (0..M::FIELDS.len()).filter(|field| count(*field).is_some()).collect();
        let (mut all, mut counts, mut number) = (Vec::new(), Vec::new(), Vec::new());
        for &field in &families {
            // Families of one count are numbered alike.
            let beside = families.iter().filter(|other| count(**other) == count(field));
            let shortest = beside.map(|other| ends[*other] - begin(*other)).min()?;
            if shortest < 3 {
                return None;
            }
            let margin = (shortest / 4).max(1);
            all.push(begin(field) + margin);
            counts.push(shortest - 2 * margin);
            number.push(margin);
        }
        Some(Self { first: all, count: counts, ends: ends.clone(), families, number })
    }

    /// The family, its place among the families, and the number of the node of an unknown.
    fn of(&self, unknown: usize) -> Option<(usize, usize)> {
        let field = self.ends.partition_point(|&end| end <= unknown);
        let family = self.families.binary_search(&field).ok()?;
        let begin = if field == 0 { 0 } else { self.ends[field - 1] };
        Some((family, unknown - begin))
    }

    /// The middle of a family, counted from the first of these nodes.
    fn middle(&self, family: usize) -> usize {
        self.count[family] / 2
    }

    fn name<M: FamilyModel>(&self, ends: &Sizes, family: usize, node: usize) -> String {
        coordinate_name::<M>(ends, self.first[family] + node)
    }
}

/// Entries of a matrix in the rows of these nodes, by offset of the other node.
struct RowsBetween {
    families: usize,
    reach: usize,
    /// By family of the row, node, family of the column, offset.
    entries: Vec<Vec<f64>>,
    middle: Vec<usize>,
}

type Add<'a> = dyn FnMut(&mut dyn FnMut(usize, usize, f64)) + 'a;

impl RowsBetween {
    fn new(nodes: &Nodes, entries: &mut Add<'_>) -> Self {
        let families = nodes.families.len();
        // Row and column, where the column is near; what is further belongs to the border, which is held.
        let place = |i: usize, j: usize| {
            let ((row, node), (column, other)) = (nodes.of(i)?, nodes.of(j)?);
            let node_in = node.checked_sub(nodes.number[row]).filter(|node| *node < nodes.count[row])?;
            let offset = other as i64 - nodes.number[column] as i64 - node_in as i64;
            (offset.unsigned_abs() <= FAR_NODES as u64).then_some((row, node_in, column, offset))
        };
        let mut reach = 0;
        entries(&mut |i, j, value| {
            if let (Some((.., offset)), true) = (place(i, j), value != 0.0) {
                reach = reach.max(offset.unsigned_abs() as usize);
            }
        });
        let width = 2 * reach + 1;
        let mut all: Vec<Vec<f64>> =
            nodes.count.iter().map(|count| vec![0.0; count * families * width]).collect();
        entries(&mut |i, j, value| {
            if let (Some((row, node, column, offset)), true) = (place(i, j), value != 0.0) {
                let at = (node * families + column) * width;
                all[row][at + (offset + reach as i64) as usize] += value;
            }
        });
        let middle = (0..families).map(|family| nodes.middle(family)).collect();
        Self { families, reach, entries: all, middle }
    }

    fn width(&self) -> usize {
        2 * self.reach + 1
    }

    /// What couples a node of a family to those of another, by offset.
    fn block(&self, row: usize, node: usize, column: usize) -> &[f64] {
        let at = (node * self.families + column) * self.width();
        &self.entries[row][at..at + self.width()]
    }

    fn middle(&self, row: usize, column: usize) -> &[f64] {
        self.block(row, self.middle[row], column)
    }

    fn is_finite(&self) -> bool {
        self.entries.iter().flatten().all(|entry| entry.is_finite())
    }

    /// A node whose row is not that of the middle.
    fn odd_one(&self, nodes: &Nodes) -> Option<(usize, usize)> {
        for row in 0..self.families {
            for column in 0..self.families {
                let middle = self.middle(row, column);
                let size = middle.iter().fold(0.0f64, |size, entry| size.max(entry.abs()));
                for node in 0..nodes.count[row] {
                    let own = self.block(row, node, column);
                    let alike = |(own, other): (&f64, &f64)| (own - other).abs() <= ALIKE * size;
                    if !own.iter().zip(middle).all(alike) {
                        return Some((row, node));
                    }
                }
            }
        }
        None
    }

    fn is_symmetric(&self, nodes: &Nodes) -> bool {
        (0..nodes.families.len()).all(|row| {
            (0..=row).all(|column| {
                let (own, other) = (self.middle(row, column), self.middle(column, row));
                let size = own.iter().chain(other).fold(0.0f64, |size, entry| size.max(entry.abs()));
                own.iter().zip(other.iter().rev()).all(|(own, other)| (own - other).abs() <= ALIKE * size)
            })
        })
    }

    /// The derivative of the matrix by the phase, of this order. Sums that vanish for κ = 0 do so without
    /// rounding, so that long waves keep their digits.
    fn symbol(&self, phase: f64, order: i32) -> Square {
        let mut all = Square::new(self.families);
        for row in 0..self.families {
            for column in 0..=row {
                let block = self.middle(row, column);
                let total: f64 = block.iter().sum();
                let size: f64 = block.iter().map(|entry| entry.abs()).sum();
                let mut sum = Complex::default();
                if order == 0 && total.abs() > 4.0 * f64::EPSILON * size {
                    sum.re = total;
                }
                for (entry, d) in block.iter().zip(-(self.reach as i64)..) {
                    let (d, angle) = (d as f64, d as f64 * phase);
                    let factor = match order {
                        // e^{iφ} − 1.
                        0 => Complex::new(-2.0 * (0.5 * angle).sin().powi(2), angle.sin()),
                        1 => Complex::turned(angle) * Complex::new(0.0, d),
                        _ => Complex::turned(angle).scaled(-d * d),
                    };
                    sum = sum + factor.scaled(*entry);
                }
                if row == column {
                    sum.im = 0.0;
                }
                *all.at_mut(row, column) = sum;
                *all.at_mut(column, row) = sum.conj();
            }
        }
        all
    }
}

/// K and M and their first two derivatives by the phase.
type Symbols = [[Square; 3]; 2];

/// Squares of frequencies, rising, and vectors by columns with Xᴴ M X = 1.
struct Waves {
    squares: Vec<f64>,
    vectors: Square,
    /// The largest Σ|kᵢᵢ|/mᵢᵢ: squares are known to the rounding of this.
    scale: f64,
}

impl Waves {
    /// The error is a family without inertia.
    fn new([[stiffness, ..], [mass, ..]]: &Symbols, rows: &RowsBetween) -> Result<Self, usize> {
        let n = mass.n;
        // A mass that is not a number is no positive one.
        let above = |value: f64, least: f64| value > least;
        if let Some(field) = (0..n).find(|&i| !above(mass.at(i, i).re, 0.0)) {
            return Err(field);
        }
        let weight: Vec<f64> = (0..n).map(|i| 1.0 / mass.at(i, i).re.sqrt()).collect();
        let mut scaled = mass.clone();
        for i in 0..n {
            for j in 0..n {
                *scaled.at_mut(i, j) = mass.at(i, j).scaled(weight[i] * weight[j]);
            }
        }
        let (sizes, axes) = scaled.eigen();
        if let Some(field) = sizes.iter().position(|size| !above(*size, f64::EPSILON)) {
            return Err(field);
        }
        let mut unit = axes;
        for (i, weight) in weight.iter().enumerate() {
            for (k, size) in sizes.iter().enumerate() {
                *unit.at_mut(i, k) = unit.at(i, k).scaled(weight / size.sqrt());
            }
        }
        let reduced = stiffness.between(&unit);
        let (squares, vectors) = reduced.eigen();
        let size = |i: usize| rows.middle(i, i).iter().map(|entry| entry.abs()).sum::<f64>();
        let scale = (0..n).fold(0.0f64, |scale, i| scale.max(size(i) / mass.at(i, i).re));
        Ok(Self { squares, vectors: unit.times(&vectors), scale })
    }

    /// The error is the square of a frequency that is negative.
    fn branches(&self, symbols: &Symbols, phase: f64) -> Result<Vec<FamilyBranch>, f64> {
        let rounding = ROUNDING * self.scale;
        if let Some(square) = self.squares.iter().find(|square| **square < -rounding) {
            return Err(*square);
        }
        let [[_, stiffness_rate, stiffness_second], [_, mass_rate, _]] =
            symbols.each_ref().map(|matrices| matrices.each_ref().map(|m| m.between(&self.vectors)));
        let n = self.squares.len();
        let mut all = Vec::with_capacity(n);
        let mut from = 0;
        while from < n {
            let square = self.squares[from];
            let meets = |other: &f64| *other - square <= MEETING * self.scale;
            let to = from + self.squares[from..].iter().take_while(|other| meets(other)).count();
            let at_rest = square <= if phase == 0.0 { rounding } else { 0.0 };
            let mut block = Square::new(to - from);
            for i in from..to {
                for j in from..to {
                    *block.at_mut(i - from, j - from) = if at_rest {
                        // Second order: the other branches give way.
                        let give = |sum: Complex, k: usize| {
                            let product = stiffness_rate.at(i, k) * stiffness_rate.at(k, j);
                            sum + product.scaled(-2.0 / self.squares[k])
                        };
                        (0..n).filter(|k| !(from..to).contains(k)).fold(stiffness_second.at(i, j), give)
                    } else {
                        stiffness_rate.at(i, j) - mass_rate.at(i, j).scaled(square)
                    };
                }
            }
            for (slope, square) in block.eigen().0.into_iter().zip(&self.squares[from..to]) {
                let frequency = if at_rest { 0.0 } else { square.sqrt() };
                let group_velocity = match (at_rest, phase == 0.0) {
                    (false, _) => slope / (2.0 * frequency),
                    (true, true) if slope.abs() <= ROUNDING * self.scale => 0.0,
                    (true, true) => (0.5 * slope).sqrt(),
                    (true, false) => f64::NAN,
                };
                all.push(FamilyBranch { frequency, group_velocity });
            }
            from = to;
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Masses 1 and 3 in turn, springs 2, thirty cells.
    #[test]
    fn rows_of_a_crystal() {
        let n = 30;
        let nodes = Nodes {
            first: vec![7, n + 7],
            count: vec![16, 16],
            ends: Sizes::from(vec![n, 2 * n]),
            families: vec![0, 1],
            number: vec![7, 7],
        };
        let stiffness = RowsBetween::new(&nodes, &mut |add| {
            let mut spring = |i: usize, j: usize| {
                for (row, column, value) in [(i, i, 2.0), (j, j, 2.0), (i, j, -2.0), (j, i, -2.0)] {
                    add(row, column, value);
                }
            };
            (0..n).for_each(|i| spring(i, n + i));
            (0..n - 1).for_each(|i| spring(n + i, i + 1));
        });
        let mass = RowsBetween::new(&nodes, &mut |add| {
            for i in 0..n {
                add(i, i, 1.0);
                add(n + i, n + i, 3.0);
            }
        });
        assert_eq!(stiffness.middle(0, 1), [-2.0, -2.0, 0.0]);
        assert_eq!(stiffness.middle(1, 0), [0.0, -2.0, -2.0]);
        for phase in [0.0f64, 0.5, 1.7, -3.1] {
            let symbols = [&stiffness, &mass].map(|rows| [0, 1, 2].map(|order| rows.symbol(phase, order)));
            let own = Waves::new(&symbols, &stiffness).expect("masses").squares;
            // ω² = k (1/m + 1/M) ∓ k √((1/m + 1/M)² − 4 sin²(κ/2)/(m M)) (Born, von Kármán 1912).
            let root = (16.0f64 / 9.0 - 4.0 / 3.0 * (0.5 * phase).sin().powi(2)).sqrt();
            for (own, exact) in own.iter().zip([8.0 / 3.0 - 2.0 * root, 8.0 / 3.0 + 2.0 * root]) {
                assert!((own - exact).abs() < 1e-14, "{phase} {own} {exact}");
            }
        }
    }
}
