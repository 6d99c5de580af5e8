//! Charts as files of the documentation.

use std::path::PathBuf;

use dynamics::output::Chart;

/// What machines may differ by in their last digits moves no curve by more than this many pixels.
const PIXELS: f64 = 2.0;

pub(crate) fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/charts")
}

/// Compares a chart with its file, or writes it where `UPDATE_CHARTS` is set.
pub(crate) fn is_current(name: &str, chart: &Chart) {
    let path = folder().join(format!("{name}.svg"));
    if std::env::var_os("UPDATE_CHARTS").is_some() {
        return chart.write_svg(&path).unwrap();
    }
    let file = std::fs::read_to_string(&path)
        .unwrap_or_else(|error| panic!("{}: {error}; set UPDATE_CHARTS", path.display()));
    if let Err(difference) = same(&chart.to_svg(), &file) {
        panic!(
            "{} is not what is drawn now: {difference}; look at it and set UPDATE_CHARTS=1",
            path.display()
        );
    }
}

/// Whether two pictures are the same but for a pixel.
fn same(now: &str, file: &str) -> Result<(), String> {
    let (now, file) = (pieces(now), pieces(file));
    if now.len() != file.len() {
        return Err(format!("{} pieces instead of {}", now.len(), file.len()));
    }
    for (a, b) in now.iter().zip(&file) {
        let agree = match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(a), Ok(b)) => (a - b).abs() <= PIXELS,
            _ => a == b,
        };
        if !agree {
            return Err(format!("`{a}` instead of `{b}`"));
        }
    }
    Ok(())
}

/// Numbers and what is between them.
fn pieces(text: &str) -> Vec<&str> {
    let is_number = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    let mut pieces = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let number = is_number(first);
        let end = rest.find(|c| is_number(c) != number).unwrap_or(rest.len());
        let (piece, after) = rest.split_at(end);
        pieces.push(piece);
        rest = after;
    }
    pieces
}

/// At most `count` points of a curve, the largest of each part of the time: what rises and falls in every
/// step is a band of ink.
pub(crate) fn envelope(points: &[(f64, f64)], count: usize) -> Vec<(f64, f64)> {
    let (Some((start, _)), Some((end, _))) = (points.first(), points.last()) else { return Vec::new() };
    let mut parts = vec![0.0f64; count];
    for (t, value) in points {
        let part = ((t - start) / (end - start) * count as f64) as usize;
        let part = &mut parts[part.min(count - 1)];
        *part = part.max(*value);
    }
    let middle = |i: usize| start + (i as f64 + 0.5) * (end - start) / count as f64;
    parts
        .into_iter()
        .enumerate()
        .filter(|(_, value)| *value > 0.0)
        .map(|(i, value)| (middle(i), value))
        .collect()
}

#[test]
fn pictures_differ_by_more_than_a_pixel_or_not() {
    assert_eq!(same("<a x=\"1.0\" y=\"-3\"/>", "<a x=\"2.5\" y=\"-3.1\"/>"), Ok(()));
    assert!(same("<a x=\"1.0\"/>", "<a x=\"4.0\"/>").is_err());
    assert!(same("<a x=\"1.0\"/>", "<b x=\"1.0\"/>").is_err());
    assert!(same("<a x=\"1.0\"/>", "<a x=\"1.0\" y=\"1\"/>").is_err());
    assert_eq!(envelope(&[(0.0, 1.0), (1.0, 3.0), (2.0, 2.0), (4.0, 0.0)], 2), [(1.0, 3.0), (3.0, 2.0)]);
}
