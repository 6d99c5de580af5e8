//! The rows of an ensemble, and what they say.

use std::path::Path;

use dynamics_view::suggest;

use crate::assembly::write_in_order;
use crate::description::Description;
use crate::error::EnsembleError;
use crate::files::FileFormat;
use crate::inputs::RUNS_OF_GROUP;
use crate::plan::Partition;
use crate::report::EnsembleReport;
use crate::rows::{EnsembleColumn, FailedRun, Rows};
use crate::statistics::{Importance, Mean, Quantile};

/// The result of an ensemble: a row for each run, in their order; its columns are the inputs, then what was
/// kept. A run that failed has its inputs and NaN.
#[derive(Clone, Debug)]
pub struct EnsembleTable {
    pub(crate) description: Description,
    /// Rows of consecutive runs; a shard has several stretches.
    pub(crate) parts: Vec<Rows>,
    pub(crate) report: EnsembleReport,
}

impl EnsembleTable {
    pub(crate) fn new(description: Description, parts: Vec<Rows>, mut report: EnsembleReport) -> Self {
        let mut table = Self { description, parts: Vec::new(), report: report.clone() };
        let mut rest: usize = parts.iter().map(|part| part.values.len()).sum();
        for mut part in parts {
            let length = part.values.len();
            match table.parts.last_mut() {
                Some(last) if last.runs.end == part.runs.start => last.append(part),
                before => {
                    if before.is_none() {
                        // Most tables are one stretch.
                        part.values.reserve_exact(rest - length);
                    }
                    table.parts.push(part);
                }
            }
            rest -= length;
        }
        let failed: Vec<FailedRun> =
            table.parts.iter().flat_map(|part| part.failed.iter().cloned()).collect();
        (report.runs, report.failed) = (table.len(), failed.len());
        report.first_failure = failed.first().cloned();
        table.description.failed = failed;
        table.report = report;
        table
    }

    /// Reads a table that an ensemble has written: `.csv` or `.npy` with the plan beside it, or `.parquet`.
    ///
    /// # Errors
    /// A file that is not there, is cut off, or was not written by an ensemble.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, EnsembleError> {
        let path = path.as_ref();
        let format = FileFormat::of(path)?;
        let missing =
            || EnsembleError::Unreadable { path: path.into(), problem: "there is no such file".into() };
        let description = format.describe(path)?.ok_or_else(missing)?;
        Self::from_file(format, path, description)
    }

    pub(crate) fn from_file(
        format: FileFormat,
        path: &Path,
        description: Description,
    ) -> Result<Self, EnsembleError> {
        let rows = format.read(path, &description)?;
        let report = EnsembleReport { read_from: Some(path.into()), ..EnsembleReport::default() };
        Ok(Self::new(description, vec![rows], report))
    }

    /// The columns: first the inputs, then what was kept.
    #[must_use]
    pub fn columns(&self) -> &[EnsembleColumn] {
        &self.description.columns
    }

    /// How many rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parts.iter().map(|part| part.runs.len()).sum()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The rows with the numbers of their runs. In the table of a shard numbers are missing.
    pub fn rows(&self) -> impl Iterator<Item = (usize, &[f64])> {
        let width = self.columns().len().max(1);
        self.parts.iter().flat_map(move |part| part.runs.clone().zip(part.values.chunks(width)))
    }

    /// A column by name, as many numbers as there are rows; what is kept of a run that failed is NaN.
    ///
    /// # Errors
    /// An unknown name.
    pub fn column(&self, name: &str) -> Result<Vec<f64>, EnsembleError> {
        let place = self.place(name)?;
        Ok(self.rows().map(|(_, row)| row[place]).collect())
    }

    /// The runs that failed, in their order.
    #[must_use]
    pub fn failed(&self) -> &[FailedRun] {
        &self.description.failed
    }

    /// What the ensemble cost and found.
    #[must_use]
    pub fn report(&self) -> &EnsembleReport {
        &self.report
    }

    /// What the results depend on, as lines of `name = text`.
    #[must_use]
    pub fn plan(&self) -> String {
        self.description.plan.to_text()
    }

    /// Mean and standard deviation of a column over the runs that did not fail.
    ///
    /// # Errors
    /// An unknown name, fewer than two runs, values that are not finite.
    pub fn mean(&self, name: &str) -> Result<Mean, EnsembleError> {
        Mean::of(&self.finite(name)?)
    }

    /// The p-quantile of a column over the runs that did not fail, with bounds that enclose the true one with
    /// at least 95 % confidence, whatever the distribution. For another confidence:
    /// [`EnsembleTable::quantile_with`].
    ///
    /// # Errors
    /// An unknown name, a probability that is not between 0 and 1, no runs, values that are not a number.
    pub fn quantile(&self, name: &str, p: f64) -> Result<Quantile, EnsembleError> {
        self.quantile_with(name, p, crate::statistics::CONFIDENCE)
    }

    /// As [`EnsembleTable::quantile`] with this confidence.
    ///
    /// # Errors
    /// As of [`EnsembleTable::quantile`]; a confidence that is not between 0 and 1.
    pub fn quantile_with(&self, name: &str, p: f64, confidence: f64) -> Result<Quantile, EnsembleError> {
        Quantile::of(&self.values_without(name, f64::is_nan)?, p, confidence)
    }

    /// Which part of the variance of a column is due to each input: Sobol indices of first order and total,
    /// with 95 % intervals. The runs must be those of
    /// [`Samples::for_importance`](crate::Samples::for_importance).
    ///
    /// # Errors
    /// An unknown name, other runs, a shard, too few groups without failure, a number that does not vary.
    pub fn importance(&self, name: &str) -> Result<Importance, EnsembleError> {
        let place = self.place(name)?;
        let length =
            self.description.plan.number_of_inputs(RUNS_OF_GROUP).ok_or(EnsembleError::NotForImportance)?;
        let inputs: Vec<String> = self
            .columns()
            .iter()
            .filter(|column| column.is_input)
            .map(|column| column.name.clone())
            .collect();
        if length != inputs.len() + 2 || self.len() != self.description.runs {
            return Err(EnsembleError::NotForImportance);
        }
        // Numbers that are not finite are no failures, here as in means.
        self.finite(name)?;
        let values: Vec<f64> = self.rows().map(|(_, row)| row[place]).collect();
        Importance::of_groups(name, &inputs, &values)
    }

    /// Writes the table to another file: `.csv`, `.npy` or, with the feature `parquet`, `.parquet`.
    ///
    /// # Errors
    /// Another ending, the table of a shard, a file that cannot be written or that is there already with other
    /// runs.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), EnsembleError> {
        if self.len() != self.description.runs {
            return Err(EnsembleError::PartOfTable);
        }
        let [all] = self.parts.as_slice() else { return Err(EnsembleError::PartOfTable) };
        let partition = self.description.plan.partition().unwrap_or(Partition { runs: self.len(), block: 1 });
        let width = self.columns().len();
        let rows_of = |block: usize| {
            let runs = partition.runs_of(block);
            // Failures are in the order of their runs.
            let before = |run: usize| all.failed.partition_point(|failed| failed.run < run);
            Ok(Rows {
                values: all.values[runs.start * width..runs.end * width].to_vec(),
                failed: all.failed[before(runs.start)..before(runs.end)].to_vec(),
                runs,
            })
        };
        let description = Description { failed: Vec::new(), ..self.description.clone() };
        write_in_order(path.as_ref(), None, &description, partition.blocks(), rows_of).map(|_| ())
    }

    fn place(&self, name: &str) -> Result<usize, EnsembleError> {
        self.columns().iter().position(|column| column.name == name).ok_or_else(|| {
            let columns: Vec<String> = self.columns().iter().map(|column| column.name.clone()).collect();
            let nearest = suggest(name, columns.iter().map(String::as_str));
            EnsembleError::NoColumn { name: name.into(), nearest, columns }
        })
    }

    /// The values of a column of the runs that did not fail, all finite.
    fn finite(&self, name: &str) -> Result<Vec<f64>, EnsembleError> {
        self.values_without(name, |x| !x.is_finite())
    }

    /// The values of a column of the runs that did not fail; an error where one is as it must not be.
    fn values_without(&self, name: &str, is_wrong: impl Fn(f64) -> bool) -> Result<Vec<f64>, EnsembleError> {
        let place = self.place(name)?;
        let mut failed = self.failed().iter().peekable();
        let mut values = Vec::with_capacity(self.len());
        for (run, row) in self.rows() {
            if failed.next_if(|failure| failure.run == run).is_some() {
                continue;
            }
            if is_wrong(row[place]) {
                return Err(EnsembleError::NotFinite { column: name.into(), run });
            }
            values.push(row[place]);
        }
        Ok(values)
    }
}
