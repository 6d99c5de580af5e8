//! Files of whole tables. The ending of the name says the format.
//!
//! | ending | content | beside it |
//! |---|---|---|
//! | `.csv` | names and units, then a line for each run, the reason of a failure last | `.csv.plan.txt` |
//! | `.npy` | a structured array: a field for each column, and `failed` | `.npy.plan.txt`, with the reasons |
//! | `.parquet` | columns, `failed_because`; plan, units and summary as metadata | nothing |
//!
//! Nothing in a file depends on who computed it, or when.

mod csv;
mod npy;
#[cfg(feature = "parquet")]
mod parquet;

use std::fs;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use dynamics_view::file::FileError;

use crate::description::Description;
use crate::error::EnsembleError;
use crate::plan::Plan;
use crate::rows::{EnsembleColumn, FailedRun, Rows};
use crate::whole_file::{name_whole, part_of, sync_names_beside, write_whole};

/// The format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileFormat {
    Csv,
    Npy,
    #[cfg(feature = "parquet")]
    Parquet,
}

/// Rows on their way into a file.
pub(crate) enum Encoded {
    /// Their bytes, made by the core that has read them, and which runs failed.
    Bytes(Vec<u8>, Vec<FailedRun>),
    /// As they are: the file has columns, not rows.
    #[cfg(feature = "parquet")]
    Rows(Rows),
}

impl FileFormat {
    /// The format of a path.
    pub(crate) fn of(path: &Path) -> Result<Self, EnsembleError> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("csv") => Ok(Self::Csv),
            Some("npy") => Ok(Self::Npy),
            #[cfg(feature = "parquet")]
            Some("parquet") => Ok(Self::Parquet),
            _ => Err(EnsembleError::Extension { path: path.into() }),
        }
    }

    /// Encodes rows. Many cores may do that at the same time.
    pub(crate) fn encode(self, description: &Description, rows: &Rows) -> Encoded {
        match self {
            Self::Csv => Encoded::Bytes(csv::lines(description, rows), rows.failed.clone()),
            Self::Npy => Encoded::Bytes(npy::records(description, rows), rows.failed.clone()),
            #[cfg(feature = "parquet")]
            Self::Parquet => Encoded::Rows(rows.clone()),
        }
    }

    /// Whether the file is there and has the runs of a plan; an error where it is another one, which is never
    /// overwritten.
    pub(crate) fn is_there(self, path: &Path, plan: &Plan) -> Result<bool, EnsembleError> {
        let Some(there) = self.describe(path)? else { return Ok(false) };
        match plan.differences(&there.plan) {
            none if none.is_empty() => Ok(true),
            differences => Err(EnsembleError::OtherPlan { path: path.into(), differences }),
        }
    }

    /// Checks that no column has the name of the one that says which runs failed.
    pub(crate) fn check_names(self, columns: &[EnsembleColumn]) -> Result<(), EnsembleError> {
        let (ending, own) = match self {
            Self::Csv => ("csv", csv::REASON),
            Self::Npy => ("npy", npy::FAILED),
            #[cfg(feature = "parquet")]
            Self::Parquet => ("parquet", parquet::REASON),
        };
        let head = |column: &EnsembleColumn| match self {
            Self::Csv => column.head(),
            _ => column.name.clone(),
        };
        match columns.iter().any(|column| head(column) == own) {
            true => Err(EnsembleError::ColumnReserved { name: own, ending }),
            false => Ok(()),
        }
    }

    /// What is known of the file: `None` if there is none.
    pub(crate) fn describe(self, path: &Path) -> Result<Option<Description>, EnsembleError> {
        let unreadable =
            |path: &Path, problem: String| EnsembleError::Unreadable { path: path.into(), problem };
        if !path.try_exists().map_err(|error| unreadable(path, error.to_string()))? {
            return Ok(None);
        }
        let unknown = || EnsembleError::Unknown { path: path.into() };
        match self {
            Self::Csv | Self::Npy => {
                let plan = beside(path);
                let text = fs::read_to_string(&plan).map_err(|error| match error.kind() {
                    ErrorKind::NotFound => unknown(),
                    _ => unreadable(&plan, error.to_string()),
                })?;
                Description::from_text(&text).ok_or_else(unknown).map(Some)
            }
            #[cfg(feature = "parquet")]
            Self::Parquet => {
                let described = parquet::describe(path).map_err(|problem| unreadable(path, problem))?;
                described.ok_or_else(unknown).map(Some)
            }
        }
    }

    /// Reads the rows of a file.
    pub(crate) fn read(self, path: &Path, description: &Description) -> Result<Rows, EnsembleError> {
        let unreadable = |problem: String| EnsembleError::Unreadable { path: path.into(), problem };
        let read = || fs::read(path).map_err(|error| unreadable(error.to_string()));
        match self {
            Self::Csv => csv::read(&read()?, description).map_err(unreadable),
            Self::Npy => npy::read(&read()?, description).map_err(unreadable),
            #[cfg(feature = "parquet")]
            Self::Parquet => parquet::read(path, description).map_err(unreadable),
        }
    }
}

/// The file with the plan beside a table.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".plan.txt");
    path.with_file_name(name)
}

/// What writes the rows of a table.
enum Body {
    Bytes(BufWriter<fs::File>),
    #[cfg(feature = "parquet")]
    Columns(Box<parquet::ParquetWriter<BufWriter<fs::File>>>),
}

/// A table on its way to a file, which is complete or absent whenever the process ends.
pub(crate) struct TableWriter {
    path: PathBuf,
    part: PathBuf,
    description: Description,
    body: Body,
}

impl TableWriter {
    /// Begins a file; folders that it needs are made. A file of another plan is left as it is. What is not
    /// complete lies in `folder`, from which it is removed with the blocks, or, without one, beside the file.
    pub(crate) fn create(
        path: &Path,
        folder: Option<&Path>,
        description: Description,
    ) -> Result<Self, EnsembleError> {
        let format = FileFormat::of(path)?;
        format.check_names(&description.columns)?;
        format.is_there(path, &description.plan)?;
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            fs::create_dir_all(folder).map_err(|source| failed("create the folder", folder, source))?;
        }
        let part = part_of(path, folder.unwrap_or_else(|| path.parent().unwrap_or(Path::new(""))));
        let file = fs::File::create(&part).map_err(|source| failed("create", &part, source))?;
        let mut file = BufWriter::new(file);
        let mut begin =
            |head: Vec<u8>| file.write_all(&head).map_err(|source| failed("write", &part, source));
        match format {
            FileFormat::Csv => begin(csv::head(&description))?,
            FileFormat::Npy => begin(npy::head(&description))?,
            #[cfg(feature = "parquet")]
            FileFormat::Parquet => {
                let writer = parquet::ParquetWriter::create(file, &description);
                let body = Body::Columns(Box::new(writer.map_err(|error| not_written(&part, error))?));
                return Ok(Self { path: path.into(), part, description, body });
            }
        }
        Ok(Self { path: path.into(), part, description, body: Body::Bytes(file) })
    }

    /// Adds the rows that follow.
    pub(crate) fn add(&mut self, rows: Encoded) -> Result<(), EnsembleError> {
        match (rows, &mut self.body) {
            (Encoded::Bytes(bytes, failed_runs), Body::Bytes(file)) => {
                self.description.failed.extend(failed_runs);
                file.write_all(&bytes).map_err(|source| failed("write", &self.part, source))
            }
            #[cfg(feature = "parquet")]
            (Encoded::Rows(rows), Body::Columns(writer)) => {
                self.description.failed.extend(rows.failed.iter().cloned());
                writer.add(rows);
                Ok(())
            }
            // Rows are encoded for the format of the path, by which the writer was chosen, too.
            #[cfg(feature = "parquet")]
            _ => Err(EnsembleError::Extension { path: self.path.clone() }),
        }
    }

    /// Ends a group of rows, in formats that have such.
    pub(crate) fn end_group(&mut self) -> Result<(), EnsembleError> {
        match &mut self.body {
            Body::Bytes(_) => Ok(()),
            #[cfg(feature = "parquet")]
            Body::Columns(writer) => {
                writer.end_group(&self.description).map_err(|error| not_written(&self.part, error))
            }
        }
    }

    /// Ends the file and gives it its name.
    pub(crate) fn finish(self) -> Result<(), EnsembleError> {
        let Self { path, part, description, body } = self;
        let not_named = |source| failed("write", &path, source);
        match body {
            Body::Bytes(file) => {
                let file = file.into_inner().map_err(|error| failed("write", &part, error.into_error()))?;
                // Rows of an earlier call go first: they are never beside the plan of this one.
                match fs::remove_file(&path) {
                    Err(error) if error.kind() != ErrorKind::NotFound => return Err(not_named(error)),
                    _ => {}
                }
                // Then what lies beside it: a table is never without its plan.
                let beside = beside(&path);
                let folder = part.parent().unwrap_or(Path::new(""));
                write_whole(&beside, folder, description.to_text().as_bytes())
                    .map_err(|source| failed("write", &beside, source))?;
                name_whole(&file, &part, &path).map_err(not_named)?;
            }
            #[cfg(feature = "parquet")]
            Body::Columns(writer) => {
                let file = writer.finish(&description).map_err(|error| not_written(&part, error))?;
                let file = file.into_inner().map_err(|error| failed("write", &part, error.into_error()))?;
                name_whole(&file, &part, &path).map_err(not_named)?;
            }
        }
        sync_names_beside(&path).map_err(not_named)
    }
}

fn failed(action: &'static str, path: &Path, source: std::io::Error) -> EnsembleError {
    FileError { path: path.into(), action, source }.into()
}

#[cfg(feature = "parquet")]
fn not_written(path: &Path, error: ::parquet::errors::ParquetError) -> EnsembleError {
    failed("write", path, std::io::Error::other(error))
}
