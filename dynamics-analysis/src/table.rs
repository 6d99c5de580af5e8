//! Rows of text as a table with aligned columns.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;

/// Rows with aligned cells: the first column flush left, the others right. The first row sets the number of
/// columns; cells beyond are not aligned. A row with fewer cells ends with a sentence, which has no part in
/// the width of its column.
pub(super) fn columns(rows: &[Vec<String>]) -> String {
    let count = rows.first().map_or(0, Vec::len);
    let width = |text: &String| text.chars().count();
    let of_column = |i: usize| {
        let cells = rows.iter().filter(|row| row.len() >= count).filter_map(|row| row.get(i));
        cells.map(width).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..count).map(of_column).collect();
    let first = rows.iter().filter_map(|row| row.first()).map(width).max().unwrap_or(0);
    let mut out = String::new();
    for row in rows {
        let mut line = String::new();
        for (i, cell) in row.iter().enumerate() {
            let _ = match widths.get(i) {
                _ if i == 0 => write!(line, "{cell:first$}"),
                Some(width) if row.len() >= count || i < 2 => write!(line, "  {cell:>width$}"),
                _ => write!(line, "  {cell}"),
            };
        }
        out.push_str(line.trim_end());
        out.push('\n');
    }
    out
}
