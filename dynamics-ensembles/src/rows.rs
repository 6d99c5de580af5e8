//! Rows of the table of an ensemble: the inputs of a run, then what is kept of it.

use std::ops::Range;

/// A run that failed.
#[derive(Clone, Debug, PartialEq)]
pub struct FailedRun {
    /// Its number, from 0.
    pub run: usize,
    /// What happened, in one line.
    pub message: String,
}

/// Rows of consecutive runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Rows {
    /// The numbers of the runs.
    pub(crate) runs: Range<usize>,
    /// A row after the other. What is kept of a run that failed is NaN.
    pub(crate) values: Vec<f64>,
    pub(crate) failed: Vec<FailedRun>,
}

impl Rows {
    /// Whether the other rows are the same, bit by bit.
    pub(crate) fn has_bits_of(&self, other: &Self) -> bool {
        let bits = |rows: &Self| rows.values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        self.runs == other.runs && self.failed == other.failed && bits(self) == bits(other)
    }

    /// The rows of some of the runs.
    #[cfg(any(feature = "cuda", feature = "wgpu"))]
    pub(crate) fn part(&self, runs: Range<usize>) -> Self {
        let width = self.values.len() / self.runs.len().max(1);
        let at = |run: usize| (run - self.runs.start) * width;
        let failed = self.failed.iter().filter(|failed| runs.contains(&failed.run)).cloned().collect();
        Self { values: self.values[at(runs.start)..at(runs.end)].to_vec(), failed, runs }
    }

    /// Adds the rows of the runs that follow.
    pub(crate) fn append(&mut self, next: Self) {
        self.runs.end = next.runs.end;
        self.values.extend(next.values);
        self.failed.extend(next.failed);
    }
}

/// A column of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct EnsembleColumn {
    /// Its name.
    pub name: String,
    /// Its unit, `""` where it is 1 or not known.
    pub unit: String,
    /// Whether it was given to the runs, and not kept of them.
    pub is_input: bool,
}

impl EnsembleColumn {
    /// A column of a number that is kept: `flips_at`, or `flips_at [s]` with its unit.
    pub(crate) fn kept(text: &str) -> Self {
        let with_unit = text.strip_suffix(']').and_then(|text| text.split_once(" ["));
        let (name, unit) = with_unit.unwrap_or((text, ""));
        Self { name: name.trim().into(), unit: unit.trim().into(), is_input: false }
    }

    /// The name with the unit, as heads of tables have it.
    pub(crate) fn head(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{} [{}]", self.name, self.unit) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_kept_numbers_stand_in_brackets() {
        let of = |text: &str| {
            let column = EnsembleColumn::kept(text);
            (column.name.clone(), column.unit.clone(), column.head())
        };
        let expected = |name: &str, unit: &str, head: &str| (name.into(), unit.into(), head.into());
        assert_eq!(of("flips_at [s]"), expected("flips_at", "s", "flips_at [s]"));
        assert_eq!(of("count"), expected("count", "", "count"));
        assert_eq!(of("x[3]"), expected("x[3]", "", "x[3]"));
    }
}
