//! NumPy's own format, version 1.0 (names in ASCII) or 3.0: a structured array with a field for each column,
//! and a field `failed`. `numpy.load("runs.npy")["flips_at"]` is a column.

use crate::description::Description;
use crate::rows::Rows;

/// The multiple of which the head is long.
const ALIGNMENT: usize = 64;

/// The field that says whether a run failed.
pub(super) const FAILED: &str = "failed";

pub(super) fn head(description: &Description) -> Vec<u8> {
    let field = |name: &str| format!("'{}'", name.replace('\\', "\\\\").replace('\'', "\\'"));
    let fields: String =
        description.columns.iter().map(|column| format!("({}, '<f8'), ", field(&column.name))).collect();
    let runs = description.runs;
    let text =
        format!("{{'descr': [{fields}('{FAILED}', '|b1')], 'fortran_order': False, 'shape': ({runs},), }}");
    let is_ascii = text.is_ascii();
    let before = if is_ascii { 10 } else { 12 };
    let length = (before + text.len() + 1).next_multiple_of(ALIGNMENT) - before;
    // Version 1.0 has two bytes for the length of the head.
    let is_short = is_ascii && length <= usize::from(u16::MAX);
    let length = if is_short { length } else { (12 + text.len() + 1).next_multiple_of(ALIGNMENT) - 12 };
    let mut head = b"\x93NUMPY".to_vec();
    if is_short {
        head.extend_from_slice(&[1, 0]);
        head.extend_from_slice(&(length as u16).to_le_bytes());
    } else {
        head.extend_from_slice(&[3, 0]);
        head.extend_from_slice(&(length as u32).to_le_bytes());
    }
    head.extend_from_slice(text.as_bytes());
    head.resize(head.len() + length - text.len() - 1, b' ');
    head.push(b'\n');
    head
}

pub(super) fn records(description: &Description, rows: &Rows) -> Vec<u8> {
    let width = description.columns.len();
    let mut records = Vec::with_capacity(rows.runs.len() * (8 * width + 1));
    let mut failed = rows.failed.iter().peekable();
    for (row, run) in rows.values.chunks(width).zip(rows.runs.clone()) {
        row.iter().for_each(|x| records.extend_from_slice(&x.to_le_bytes()));
        records.push(u8::from(failed.next_if(|failure| failure.run == run).is_some()));
    }
    records
}

/// The rows of a whole file; reasons of failures are those of the description.
pub(super) fn read(bytes: &[u8], description: &Description) -> Result<Rows, String> {
    let records = bytes.strip_prefix(&*head(description)).ok_or("its head is not that of its plan")?;
    let length = 8 * description.columns.len() + 1;
    if records.len() != length * description.runs {
        return Err(format!("it has {} bytes of rows, and not {}", records.len(), length * description.runs));
    }
    let row = |record: &[u8]| {
        let (numbers, _) = record.as_chunks::<8>();
        numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect::<Vec<_>>()
    };
    let values = records.chunks(length).flat_map(row).collect();
    Ok(Rows { runs: 0..description.runs, values, failed: description.failed.clone() })
}
