//! The block triangular form of a square sparse matrix: rows matched with columns, and the strongly connected
//! components of what follows from what (Dulmage and Mendelsohn 1958, Tarjan 1972). Blocks come in the order
//! in which they can be solved.

/// A block: its rows and as many columns, both ascending.
pub(super) type Block = (Vec<usize>, Vec<usize>);

/// The blocks of the matrix whose row r has entries in the columns `rows[r]`, over the given columns only, as
/// many as rows; `None` where no permutation has a diagonal free of zeros.
pub(super) fn blocks(rows: &[Vec<usize>], columns: &[usize]) -> Option<Vec<Block>> {
    let width = columns.iter().max().map_or(0, |c| c + 1);
    let mut counts = vec![false; width];
    columns.iter().for_each(|c| counts[*c] = true);
    let counted = |row: &Vec<usize>| row.iter().copied().filter(|c| counts.get(*c) == Some(&true)).collect();
    let rows: Vec<Vec<usize>> = rows.iter().map(counted).collect();
    let row_of = matching(&rows, width)?;
    let mut tarjan = Tarjan::new(&rows, &row_of);
    for row in 0..rows.len() {
        tarjan.visit(row);
    }
    let mut column_of = vec![0; rows.len()];
    for (column, row) in row_of.iter().enumerate() {
        if let Some(row) = row {
            column_of[*row] = column;
        }
    }
    let block = |mut component: Vec<usize>| {
        component.sort_unstable();
        let mut columns: Vec<usize> = component.iter().map(|r| column_of[*r]).collect();
        columns.sort_unstable();
        (component, columns)
    };
    Some(tarjan.components.into_iter().map(block).collect())
}

/// A row for every column such that all rows are used (augmenting paths, breadth first); `None` where there
/// is no such matching.
fn matching(rows: &[Vec<usize>], width: usize) -> Option<Vec<Option<usize>>> {
    let mut row_of: Vec<Option<usize>> = vec![None; width];
    let mut column_of: Vec<Option<usize>> = vec![None; rows.len()];
    // The row from which each column was reached, and from which start.
    let mut reached: Vec<Option<(usize, usize)>> = vec![None; width];
    for start in 0..rows.len() {
        let mut queue = vec![start];
        let mut end = None;
        let mut at = 0;
        while end.is_none() && at < queue.len() {
            let row = queue[at];
            at += 1;
            for &column in &rows[row] {
                if reached[column].is_some_and(|(of, _)| of == start) {
                    continue;
                }
                reached[column] = Some((start, row));
                match row_of[column] {
                    Some(next) => queue.push(next),
                    None => {
                        end = Some(column);
                        break;
                    }
                }
            }
        }
        let mut column = end?;
        // Back along the path: every row on it takes the column that was reached from it and leaves its own
        // to the row before.
        loop {
            let (_, row) = reached[column].expect("every column on the path was reached from a row");
            row_of[column] = Some(row);
            match column_of[row].replace(column) {
                Some(own) => column = own,
                None => break,
            }
        }
    }
    Some(row_of)
}

/// Strongly connected components of the graph in which a row leads to the rows that are matched with its
/// other columns; a component is complete only after those that it leads to.
struct Tarjan<'a> {
    rows: &'a [Vec<usize>],
    row_of: &'a [Option<usize>],
    index: Vec<Option<usize>>,
    low: Vec<usize>,
    stacked: Vec<bool>,
    stack: Vec<usize>,
    next: usize,
    components: Vec<Vec<usize>>,
}

impl<'a> Tarjan<'a> {
    fn new(rows: &'a [Vec<usize>], row_of: &'a [Option<usize>]) -> Self {
        let n = rows.len();
        Self {
            rows,
            row_of,
            index: vec![None; n],
            low: vec![0; n],
            stacked: vec![false; n],
            stack: Vec::new(),
            next: 0,
            components: Vec::new(),
        }
    }

    /// Finds the components that can be reached from a row; with a stack of its own, as chains are long.
    fn visit(&mut self, start: usize) {
        if self.index[start].is_some() {
            return;
        }
        self.enter(start);
        let mut path = vec![(start, 0)];
        while let Some((row, at)) = path.pop() {
            if let Some(column) = self.rows[row].get(at) {
                path.push((row, at + 1));
                let Some(next) = self.row_of[*column] else { continue };
                match self.index[next] {
                    None => {
                        self.enter(next);
                        path.push((next, 0));
                    }
                    Some(index) if self.stacked[next] => self.low[row] = self.low[row].min(index),
                    Some(_) => {}
                }
                continue;
            }
            if let Some((parent, _)) = path.last() {
                self.low[*parent] = self.low[*parent].min(self.low[row]);
            }
            if Some(self.low[row]) == self.index[row] {
                let from = self
                    .stack
                    .iter()
                    .rposition(|r| *r == row)
                    .expect("a row stays stacked until its component is complete");
                let component = self.stack.split_off(from);
                component.iter().for_each(|r| self.stacked[*r] = false);
                self.components.push(component);
            }
        }
    }

    fn enter(&mut self, row: usize) {
        self.index[row] = Some(self.next);
        self.low[row] = self.next;
        self.next += 1;
        self.stacked[row] = true;
        self.stack.push(row);
    }
}

#[cfg(test)]
mod tests {
    use super::blocks;
    use proptest::prelude::*;

    #[test]
    fn a_triangular_matrix_falls_apart_in_the_order_of_substitution() {
        // Row 0 needs what row 1 gives, row 1 what row 2 gives.
        let rows = [vec![0, 1], vec![1, 2], vec![2]];
        let found = blocks(&rows, &[0, 1, 2]).unwrap();
        assert_eq!(found, [(vec![2], vec![2]), (vec![1], vec![1]), (vec![0], vec![0])]);
    }

    #[test]
    fn a_loop_is_one_block() {
        let rows = [vec![0, 1], vec![1, 2], vec![2, 0], vec![3, 0]];
        let found = blocks(&rows, &[0, 1, 2, 3]).unwrap();
        assert_eq!(found, [(vec![0, 1, 2], vec![0, 1, 2]), (vec![3], vec![3])]);
    }

    #[test]
    fn rows_that_share_too_few_columns_have_no_blocks() {
        assert_eq!(blocks(&[vec![0], vec![0], vec![0, 1, 2]], &[0, 1, 2]), None);
        assert_eq!(blocks(&[vec![0, 1]], &[2]), None);
    }

    proptest! {
        /// A permuted triangular matrix with blocks on its diagonal is found again, whatever columns are left
        /// out.
        #[test]
        fn every_entry_belongs_to_its_block_or_an_earlier_one(
            n in 1usize..9,
            seed in proptest::collection::vec(0u8..4, 100),
            shift in 0usize..9,
        ) {
            let full: Vec<Vec<usize>> = (0..n)
                .map(|r| {
                    let entries = (0..n).filter(|c| *c == (r + shift) % n || seed[(r * n + c) % 100] == 0);
                    entries.map(|c| c + 2).collect()
                })
                .collect();
            let columns: Vec<usize> = (2..n + 2).collect();
            let found = blocks(&full, &columns).expect("the shifted diagonal is a matching");
            let mut known = Vec::new();
            for (rows, columns) in &found {
                prop_assert_eq!(rows.len(), columns.len());
                known.extend(columns.iter().copied());
                for r in rows {
                    prop_assert!(full[*r].iter().all(|c| known.contains(c)), "row {} of {:?}", r, found);
                }
            }
            known.sort_unstable();
            prop_assert_eq!(known, columns);
        }
    }
}
