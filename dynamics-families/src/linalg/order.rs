//! The order of unknowns in which a matrix is banded: by node, the fields of a node side by side, and last a
//! border of unknowns that couple to others far away.
//!
//! Nodes of equal number are neighbours. Ordinary coordinates belong to the border: a trolley that moves the
//! frame of a whole cable. What couples further than [`FAR_NODES`] nodes apart makes one of the two a border
//! unknown, always the one with the most such couplings: a load at the far end, one node of a ring. Grids go
//! line by line, along the shorter side: the band is as wide as that.

use crate::model::Sizes;

/// Couplings up to this many nodes apart belong to the band: as far as an index may reach.
pub(crate) const FAR_NODES: usize = 33;
/// Couplings that are longer than all others and at most so many go to the border.
const FEW: usize = 16;
/// Sizes from which such couplings are looked for.
const LONG: usize = 256;
/// Most that couplings of grids may be apart: what is wider costs more time and memory than it is worth.
const WIDEST_GRID: usize = 256;
/// Most unknowns of a border.
const MOST_BORDER: usize = 256;

/// Where every unknown is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    /// The place of every unknown; the border has the last ones.
    pub(crate) place: Vec<usize>,
    /// The unknown at every place.
    pub(crate) unknown: Vec<usize>,
    /// Unknowns in the band.
    pub(crate) core: usize,
    /// Half width of the band.
    pub(crate) half: usize,
    /// Whether every unknown stands at its own place.
    pub(crate) in_order: bool,
    /// For every unknown how far the places of those behind it, all in the band, are evenly apart.
    even_until: Vec<usize>,
}

/// The matrix couples too many distant unknowns for a band with a border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NotBanded;

/// Calls back with the row and column of every entry.
pub(crate) type Pattern<'a> = dyn FnMut(&mut dyn FnMut(usize, usize)) + 'a;

impl Layout {
    /// For fields that end at `ends` and a matrix with these entries.
    pub(crate) fn new(sizes: &Sizes, pattern: &mut Pattern<'_>) -> Result<Self, NotBanded> {
        Self::of_order(by_node(sizes), sizes, [sizes.unknowns(), sizes.len()], pattern, &[])
    }

    /// For coordinates and, behind them, rows of constraints: M and J, whose entries are pairs of a row and a
    /// coordinate. A row comes after the last node that it couples.
    pub(crate) fn with_rows(
        sizes: &Sizes,
        row_ends: &[usize],
        mass: &mut Pattern<'_>,
        pairs: &[(u32, u32)],
    ) -> Result<Self, NotBanded> {
        let n = sizes.unknowns();
        let rows = row_ends.last().copied().unwrap_or(0);
        let is_ordinary = ordinary(sizes);
        let mut last = vec![None; rows];
        for &(row, unknown) in pairs {
            let (field, node) = node_of(sizes, unknown as usize);
            if !is_ordinary[field] {
                let last = &mut last[row as usize];
                *last = (*last).max(Some(node));
            }
        }
        // Rows between ordinary coordinates alone belong to the border, as these do.
        let mut keyed: Vec<((usize, usize), usize)> = Vec::with_capacity(n + rows);
        for (k, &unknown) in by_node(sizes).iter().enumerate() {
            keyed.push(((node_of(sizes, unknown).1, k), unknown));
        }
        keyed.extend(last.iter().enumerate().map(|(row, last)| ((last.unwrap_or(0), n + row), n + row)));
        keyed.sort_unstable();
        let order = keyed.into_iter().map(|(_, unknown)| unknown).collect();
        let mut all = |visit: &mut dyn FnMut(usize, usize)| {
            mass(visit);
            pairs.iter().for_each(|&(row, unknown)| visit(n + row as usize, unknown as usize));
        };
        let alone: Vec<usize> = (0..rows).filter(|&row| last[row].is_none()).map(|row| n + row).collect();
        let fields = sizes.len() + row_ends.len();
        Self::of_order(order, sizes, [n + rows, fields], &mut all, &alone)
    }

    /// Its structure in words.
    pub(crate) fn describe(&self) -> String {
        match self.border() {
            0 => format!("banded, half width {}", self.half),
            border => format!("banded, half width {}, border of {border}", self.half),
        }
    }

    fn of_order(
        order: Vec<usize>,
        sizes: &Sizes,
        [n, fields]: [usize; 2],
        pattern: &mut Pattern<'_>,
        alone: &[usize],
    ) -> Result<Self, NotBanded> {
        let mut place = vec![0; n];
        order.iter().enumerate().for_each(|(k, &unknown)| place[unknown] = k);

        let grids = (0..sizes.len()).any(|field| sizes.columns(field) > 1);
        let far = FAR_NODES * fields;
        let limit = if grids { far.max(WIDEST_GRID) } else { far }.min(n);
        let limit = dominant_width(&place, limit, pattern);
        let border = border(&place, limit, sizes, pattern, alone)?;

        let mut in_border = vec![false; n];
        border.iter().for_each(|&unknown| in_border[unknown] = true);
        let mut unknown: Vec<usize> = order.into_iter().filter(|&k| !in_border[k]).collect();
        let core = unknown.len();
        unknown.extend(&border);
        unknown.iter().enumerate().for_each(|(k, &unknown)| place[unknown] = k);
        let mut half = 0;
        pattern(&mut |i, j| {
            if place[i] < core && place[j] < core {
                half = half.max(place[i].abs_diff(place[j]));
            }
        });
        let in_order = place.iter().enumerate().all(|(k, &place)| k == place);
        let even_until = even_until(&place, core);
        Ok(Self { place, unknown, core, half, in_order, even_until })
    }

    /// How far apart the places of `count` unknowns from `first` on are; none where that differs or some are
    /// in the border.
    #[inline]
    pub(crate) fn stride(&self, first: usize, count: usize) -> Option<usize> {
        match (count, self.even_until[first] >= first + count) {
            (_, false) => None,
            (0 | 1, true) => Some(1),
            _ => self.place[first + 1].checked_sub(self.place[first]),
        }
    }

    /// How many unknowns the border has.
    pub(crate) fn border(&self) -> usize {
        self.unknown.len() - self.core
    }
}

/// For every unknown the first one behind it that breaks an even order of places before `core`.
fn even_until(place: &[usize], core: usize) -> Vec<usize> {
    let n = place.len();
    let mut until = vec![0; n];
    for i in (0..n).rev() {
        until[i] = match (place[i] < core, place.get(i + 1), place.get(i + 2)) {
            (false, ..) => i,
            (true, Some(next), _) if *next >= core => i + 1,
            (true, None, _) => i + 1,
            (true, Some(next), Some(after)) if *after < core && 2 * next == place[i] + after => until[i + 1],
            (true, Some(_), _) => i + 2,
        };
    }
    until
}

/// Which fields are ordinary coordinates beside families.
fn ordinary(ends: &[usize]) -> Vec<bool> {
    let lengths: Vec<usize> =
        (0..ends.len()).map(|field| ends[field] - if field == 0 { 0 } else { ends[field - 1] }).collect();
    let has_families = lengths.iter().any(|&length| length > 1);
    lengths.iter().map(|&length| has_families && length == 1).collect()
}

/// The field of an unknown, and the number of its node: of a grid along the shorter side.
fn node_of(sizes: &Sizes, unknown: usize) -> (usize, usize) {
    let field = sizes.partition_point(|&end| end <= unknown);
    let (range, columns) = (sizes.range(field), sizes.columns(field).max(1));
    let (rows, node) = (range.len() / columns, unknown - range.start);
    (field, if columns > rows { node % columns * rows + node / columns } else { node })
}

/// The unknowns by the numbers of their nodes.
fn by_node(sizes: &Sizes) -> Vec<usize> {
    let fields = || (0..sizes.len()).map(|field| sizes.range(field));
    let longest = fields().map(|range| range.len()).max().unwrap_or(0);
    let mut order = Vec::with_capacity(sizes.unknowns());
    for node in 0..longest {
        for (field, range) in fields().enumerate().filter(|(_, range)| node < range.len()) {
            let columns = sizes.columns(field).max(1);
            let rows = range.len() / columns;
            // Along the shorter side.
            let node = if columns > rows { node % rows * columns + node / rows } else { node };
            order.push(range.start + node);
        }
    }
    order
}

/// The width without the few couplings that are longer than all others.
fn dominant_width(place: &[usize], limit: usize, pattern: &mut Pattern<'_>) -> usize {
    if place.len() < LONG {
        return limit;
    }
    let mut count = vec![0usize; limit + 1];
    pattern(&mut |i, j| {
        let distance = place[i].abs_diff(place[j]);
        if distance <= limit {
            count[distance] += 1;
        }
    });
    let mut beyond = 0;
    let mut width = limit;
    while width > 1 && beyond + count[width] <= FEW {
        beyond += count[width];
        width -= 1;
    }
    width
}

/// Unknowns without which no coupling is longer than `limit`.
fn border(
    place: &[usize],
    limit: usize,
    ends: &[usize],
    pattern: &mut Pattern<'_>,
    alone: &[usize],
) -> Result<Vec<usize>, NotBanded> {
    let mut far = Vec::new();
    let most = 8 * place.len() + 64;
    pattern(&mut |i, j| {
        if place[i].abs_diff(place[j]) > limit && far.len() < most {
            far.push((i.min(j), i.max(j)));
        }
    });
    if far.len() == most {
        return Err(NotBanded);
    }
    far.sort_unstable();
    far.dedup();
    // Ordinary coordinates may couple to every node.
    let ordinary = ends.iter().zip(ordinary(ends)).filter(|(_, ordinary)| *ordinary);
    let mut border: Vec<usize> = ordinary.map(|(&end, _)| end - 1).chain(alone.iter().copied()).collect();
    far.retain(|(i, j)| !border.contains(i) && !border.contains(j));
    while !far.is_empty() {
        if border.len() == MOST_BORDER {
            return Err(NotBanded);
        }
        let mut count = std::collections::BTreeMap::<usize, usize>::new();
        far.iter().for_each(|&(i, j)| {
            *count.entry(i).or_default() += 1;
            *count.entry(j).or_default() += 1;
        });
        // Each unknown of the border takes at most as many couplings away as the first.
        let most = count.values().copied().max().unwrap_or(0);
        if far.len() > most * (MOST_BORDER - border.len()) {
            return Err(NotBanded);
        }
        let chosen = count
            .iter()
            .max_by_key(|&(&unknown, &count)| (count, core::cmp::Reverse(unknown)))
            .map_or(0, |(&unknown, _)| unknown);
        border.push(chosen);
        far.retain(|&(i, j)| i != chosen && j != chosen);
    }
    border.sort_unstable();
    Ok(border)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(ends: &[usize], pairs: &[(usize, usize)]) -> Layout {
        Layout::new(&Sizes::from(ends.to_vec()), &mut |visit| pairs.iter().for_each(|&(i, j)| visit(i, j)))
            .expect("banded")
    }

    #[test]
    fn fields_of_a_node_are_side_by_side() {
        // s and w with 4 nodes each; nodes couple to neighbours of both fields.
        let mut pairs = Vec::new();
        for i in 0..3 {
            for (a, b) in [(0, 0), (0, 4), (4, 0), (4, 4)] {
                pairs.push((i + a, i + 1 + b));
            }
        }
        let layout = layout(&[4, 8], &pairs);
        assert_eq!(layout.place, [0, 2, 4, 6, 1, 3, 5, 7]);
        assert_eq!((layout.core, layout.half, layout.border(), layout.in_order), (8, 3, 0, false));
    }

    #[test]
    fn what_couples_to_all_and_the_seam_of_a_ring_are_border() {
        let n = 1000;
        let ring: Vec<_> = (0..n).map(|i| (i, (i + 1) % n)).collect();
        let found = layout(&[n], &ring);
        assert_eq!((found.core, found.half, found.unknown[n - 1]), (n - 1, 1, 0));
        let mut cart: Vec<_> = (1..n).map(|i| (0, i)).collect();
        cart.extend((1..n - 1).map(|i| (i, i + 1)));
        let found = layout(&[1, n], &cart);
        assert_eq!((found.core, found.half, found.unknown[n - 1]), (n - 1, 1, 0));
        // A load at the far end: the ordinary coordinate goes, not the node.
        let mut load: Vec<_> = (1..n - 1).map(|i| (i, i + 1)).collect();
        load.push((0, n - 1));
        assert_eq!(layout(&[1, n], &load).unknown[n - 1], 0);
    }

    #[test]
    fn grids_are_banded_along_their_shorter_side_and_large_ones_refused() {
        let grid = |rows: usize, columns: usize| {
            let down = (0..(rows - 1) * columns).map(|i| (i, i + columns));
            let across = (0..rows * columns).filter(|i| (i + 1) % columns > 0).map(|i| (i, i + 1));
            let pairs: Vec<_> = down.chain(across).collect();
            let mut sizes = Sizes::new();
            sizes.push("w", rows, columns).expect("small");
            Layout::new(&sizes, &mut |visit| pairs.iter().for_each(|&(i, j)| visit(i, j)))
        };
        assert_eq!(grid(30, 20).expect("narrow").half, 20);
        assert_eq!(grid(20, 3000).expect("narrow").half, 20);
        assert_eq!(grid(400, 400), Err(NotBanded));
    }
}
