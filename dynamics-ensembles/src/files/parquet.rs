//! Apache Parquet: columns of doubles, and `failed_because`. What is kept of a run that failed is null. The
//! metadata has the plan, the columns with their units and the summary under `dynamics.plan`,
//! `dynamics.columns` and `dynamics.summary`. A group of rows holds 64 blocks of runs. Not compressed; values
//! that repeat, as those of grids do, are stored by a dictionary.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use ::parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use ::parquet::column::reader::ColumnReader;
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::{Type, TypePtr};

use crate::description::Description;
use crate::rows::{FailedRun, Rows};

/// The column with the reasons of failures.
pub(super) const REASON: &str = "failed_because";
/// What the keys of the metadata begin with.
const KEY: &str = "dynamics.";

/// A file that is being written, and the rows of its current group.
pub(super) struct ParquetWriter<W: Write + Send> {
    file: SerializedFileWriter<W>,
    group: Vec<Rows>,
}

fn schema(description: &Description) -> Result<TypePtr, ParquetError> {
    let mut fields: Vec<TypePtr> = Vec::new();
    for column in &description.columns {
        let repetition = if column.is_input { Repetition::REQUIRED } else { Repetition::OPTIONAL };
        let field = Type::primitive_type_builder(&column.name, PhysicalType::DOUBLE);
        fields.push(Arc::new(field.with_repetition(repetition).build()?));
    }
    let reason = Type::primitive_type_builder(REASON, PhysicalType::BYTE_ARRAY)
        .with_logical_type(Some(LogicalType::String))
        .with_repetition(Repetition::OPTIONAL);
    fields.push(Arc::new(reason.build()?));
    Ok(Arc::new(Type::group_type_builder("runs").with_fields(fields).build()?))
}

impl<W: Write + Send> ParquetWriter<W> {
    pub(super) fn create(file: W, description: &Description) -> Result<Self, ParquetError> {
        let made_by = concat!("dynamics ", env!("CARGO_PKG_VERSION"));
        let properties = WriterProperties::builder().set_created_by(made_by.into()).build();
        let file = SerializedFileWriter::new(file, schema(description)?, Arc::new(properties))?;
        Ok(Self { file, group: Vec::new() })
    }

    pub(super) fn add(&mut self, rows: Rows) {
        self.group.push(rows);
    }

    /// Writes the rows since the last call.
    pub(super) fn end_group(&mut self, description: &Description) -> Result<(), ParquetError> {
        let rows = std::mem::take(&mut self.group);
        let failed: Vec<Option<&FailedRun>> = rows.iter().flat_map(failures_of).collect();
        let is_there: Vec<i16> = failed.iter().map(|failed| i16::from(failed.is_none())).collect();
        let width = description.columns.len();
        let mut group = self.file.next_row_group()?;
        for (k, column) in description.columns.iter().enumerate() {
            let all = rows.iter().flat_map(|rows| rows.values.chunks(width).map(|row| row[k]));
            let values: Vec<f64> = match column.is_input {
                true => all.collect(),
                false => all.zip(&failed).filter(|(_, failed)| failed.is_none()).map(|(x, _)| x).collect(),
            };
            let Some(mut writer) = group.next_column()? else { break };
            let levels = (!column.is_input).then_some(is_there.as_slice());
            writer.typed::<DoubleType>().write_batch(&values, levels, None)?;
            writer.close()?;
        }
        if let Some(mut writer) = group.next_column()? {
            let reasons: Vec<ByteArray> =
                failed.iter().flatten().map(|failed| ByteArray::from(failed.message.as_str())).collect();
            let has_reason: Vec<i16> = is_there.iter().map(|is_there| 1 - is_there).collect();
            writer.typed::<ByteArrayType>().write_batch(&reasons, Some(&has_reason), None)?;
            writer.close()?;
        }
        group.close()?;
        Ok(())
    }

    /// Ends the file, with what is known of it.
    pub(super) fn finish(mut self, description: &Description) -> Result<W, ParquetError> {
        if !self.group.is_empty() {
            self.end_group(description)?;
        }
        for (name, text) in description.parts() {
            let entry = KeyValue::new(format!("{KEY}{name}"), text);
            self.file.append_key_value_metadata(entry);
        }
        self.file.into_inner()
    }
}

/// The failure of each run, if it has one.
fn failures_of(rows: &Rows) -> Vec<Option<&FailedRun>> {
    let mut failed = rows.failed.iter().peekable();
    rows.runs.clone().map(|run| failed.next_if(|failure| failure.run == run)).collect()
}

fn open(path: &Path) -> Result<SerializedFileReader<fs::File>, String> {
    let file = fs::File::open(path).map_err(|error| error.to_string())?;
    SerializedFileReader::new(file).map_err(|error| error.to_string())
}

/// What the metadata of a file say; `None` if it was not written by an ensemble.
pub(super) fn describe(path: &Path) -> Result<Option<Description>, String> {
    let file = open(path)?;
    let Some(entries) = file.metadata().file_metadata().key_value_metadata() else { return Ok(None) };
    let part = |entry: &KeyValue| {
        let name = entry.key.strip_prefix(KEY)?;
        Some((name.to_owned(), entry.value.clone().unwrap_or_default()))
    };
    let parts: Vec<(String, String)> = entries.iter().filter_map(part).collect();
    Ok((!parts.is_empty()).then(|| Description::from_parts(&parts)))
}

/// The rows of a file.
pub(super) fn read(path: &Path, description: &Description) -> Result<Rows, String> {
    let file = open(path)?;
    let width = description.columns.len();
    let mut values = vec![f64::NAN; description.runs * width];
    let (mut first, mut failed) = (0, Vec::new());
    let wrong = |error: ParquetError| error.to_string();
    for k in 0..file.num_row_groups() {
        let group = file.get_row_group(k).map_err(wrong)?;
        let runs = usize::try_from(group.metadata().num_rows()).map_err(|error| error.to_string())?;
        if first + runs > description.runs || group.num_columns() != width + 1 {
            return Err("its columns or its runs are not those of its plan".into());
        }
        for column in 0..=width {
            let mut levels = Vec::new();
            match group.get_column_reader(column).map_err(wrong)? {
                ColumnReader::DoubleColumnReader(mut reader) if column < width => {
                    let mut numbers = Vec::new();
                    let is_input = description.columns[column].is_input;
                    let wanted = (!is_input).then_some(&mut levels);
                    reader.read_records(runs, wanted, None, &mut numbers).map_err(wrong)?;
                    let mut numbers = numbers.into_iter();
                    for run in 0..runs {
                        if is_input || levels.get(run) == Some(&1) {
                            let number = numbers.next().ok_or("a column is too short")?;
                            values[(first + run) * width + column] = number;
                        }
                    }
                }
                ColumnReader::ByteArrayColumnReader(mut reader) if column == width => {
                    let mut reasons = Vec::new();
                    reader.read_records(runs, Some(&mut levels), None, &mut reasons).map_err(wrong)?;
                    let with_reason = (0..runs).filter(|run| levels.get(*run) == Some(&1));
                    failed.extend(with_reason.zip(&reasons).map(|(run, reason)| {
                        let message = String::from_utf8_lossy(reason.data()).into_owned();
                        FailedRun { run: first + run, message }
                    }));
                }
                _ => return Err("its columns are not those of its plan".into()),
            }
        }
        first += runs;
    }
    if first != description.runs {
        return Err(format!("it has {first} of {} runs", description.runs));
    }
    Ok(Rows { runs: 0..first, values, failed })
}
