//! A field of numbers as colours, such as a wave over place and time, as SVG text with one bitmap inside.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;

#[cfg(feature = "std")]
use crate::file::{self, Content, FileError};
use crate::text::{pixel, readable, xml};

/// Width of the field in pixels of the page.
const WIDTH: f64 = 640.0;
/// Its height.
const HEIGHT: f64 = 480.0;
/// Free space left of it, for numbers.
const LEFT: f64 = 90.0;
/// Free space above it, for the title.
const TOP: f64 = 44.0;
/// Free space right of it, for the scale of colours.
const RIGHT: f64 = 130.0;
/// Free space below it.
const BOTTOM: f64 = 52.0;
/// Most cells across and down; more are averaged.
const MOST_CELLS: [usize; 2] = [640, 480];
/// Colours of a bitmap. The last is for values that are not finite.
const COLORS: usize = 256;
/// Digits of numbers at the axes.
const DIGITS: usize = 4;

/// A field of numbers as colours: rows from top to bottom.
///
/// Fields of both signs have white for 0, blue below and red above; others go from white to blue. More rows
/// or columns than pixels are averaged.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatMap {
    title: String,
    rows: Vec<Vec<f64>>,
    across: (String, [f64; 2]),
    down: (String, [f64; 2]),
    values: String,
}

impl HeatMap {
    /// A picture of rows of equal length; the first is at the top.
    #[must_use]
    pub fn new(title: impl Into<String>, rows: Vec<Vec<f64>>) -> Self {
        let columns = rows.first().map_or(0, Vec::len);
        let last = |count: usize| count.saturating_sub(1) as f64;
        Self {
            title: title.into(),
            across: (String::from("index"), [0.0, last(columns)]),
            down: (String::from("row"), [0.0, last(rows.len())]),
            values: String::new(),
            rows,
        }
    }

    /// What goes across, and its values at the first and the last column.
    #[must_use]
    pub fn across(mut self, title: impl Into<String>, range: [f64; 2]) -> Self {
        self.across = (title.into(), range);
        self
    }

    /// What goes down, and its values at the first and the last row.
    #[must_use]
    pub fn down(mut self, title: impl Into<String>, range: [f64; 2]) -> Self {
        self.down = (title.into(), range);
        self
    }

    /// What the colours are.
    #[must_use]
    pub fn values(mut self, title: impl Into<String>) -> Self {
        self.values = title.into();
        self
    }

    /// The picture as SVG text.
    #[must_use]
    pub fn to_svg(&self) -> String {
        let cells = averaged(&self.rows);
        let finite = || cells.iter().flatten().copied().filter(|value| value.is_finite());
        let (mut lo, mut hi) = finite().fold((0.0f64, 0.0f64), |(lo, hi), x| (lo.min(x), hi.max(x)));
        let both = lo < 0.0 && hi > 0.0;
        if both {
            hi = hi.max(-lo);
            lo = -hi;
        }
        let palette = palette(lo, hi);
        let (width, height) = (LEFT + WIDTH + RIGHT, TOP + HEIGHT + BOTTOM);
        let (w, h) = (pixel(width), pixel(height));
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             role=\"img\" font-family=\"system-ui, 'Segoe UI', 'DejaVu Sans', Arial, sans-serif\" \
             font-size=\"12\" fill=\"#1d2530\">\n<title>{title}</title>\n<rect width=\"{w}\" height=\"{h}\" \
             fill=\"#ffffff\"/>\n<text x=\"{LEFT}\" y=\"28\" font-size=\"16\" \
             font-weight=\"600\">{title}</text>\n",
            title = xml(&self.title)
        );
        image(&mut svg, [LEFT, TOP, WIDTH, HEIGHT], &indices(&cells, lo, hi), &palette);
        let scale: Vec<Vec<u8>> = (0..COLORS - 1).rev().map(|k| [k as u8].to_vec()).collect();
        let right = LEFT + WIDTH + 18.0;
        image(&mut svg, [right, TOP, 16.0, HEIGHT], &scale, &palette);
        let mut text = |x: f64, y: f64, anchor: &str, words: &str| {
            let (x, y) = (pixel(x), pixel(y));
            let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{}</text>", xml(words));
        };
        let number = |range: &[f64; 2], part: f64| readable(range[0] + part * (range[1] - range[0]), DIGITS);
        for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let (x, y) = (LEFT + part * WIDTH, TOP + part * HEIGHT);
            text(x, TOP + HEIGHT + 18.0, "middle", &number(&self.across.1, part));
            text(LEFT - 8.0, y + 4.0, "end", &number(&self.down.1, part));
            text(right + 22.0, y + 4.0, "start", &number(&[hi, lo], part));
        }
        text(LEFT + 0.5 * WIDTH, TOP + HEIGHT + 40.0, "middle", &self.across.0);
        text(LEFT - 8.0, TOP - 10.0, "end", &self.down.0);
        text(right, TOP - 10.0, "start", &self.values);
        svg.push_str("</svg>\n");
        svg
    }

    /// Writes the picture as `.svg`, making the folders that the path needs.
    #[cfg(feature = "std")]
    pub fn write_svg(&self, path: impl AsRef<std::path::Path>) -> Result<(), FileError> {
        file::write(path.as_ref(), Content::Svg, self.to_svg().as_bytes())
    }
}

/// Means of as many cells as there are pixels for.
fn averaged(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let columns = rows.first().map_or(0, Vec::len);
    let [across, down] = [columns.min(MOST_CELLS[0]), rows.len().min(MOST_CELLS[1])];
    let part = |k: usize, cells: usize, all: usize| k * all / cells..(k + 1) * all / cells;
    let cell = |i: usize, j: usize| {
        let rows = &rows[part(i, down, rows.len())];
        let values = || rows.iter().flat_map(|row| row.get(part(j, across, columns)).unwrap_or(&[]));
        values().sum::<f64>() / values().count() as f64
    };
    (0..down).map(|i| (0..across).map(|j| cell(i, j)).collect()).collect()
}

/// The colours of the cells.
fn indices(cells: &[Vec<f64>], lo: f64, hi: f64) -> Vec<Vec<u8>> {
    let last = (COLORS - 2) as f64;
    let index = |&value: &f64| match value.is_finite() {
        false => (COLORS - 1) as u8,
        // A field of zeros alone has the lowest colour.
        true if hi <= lo => 0,
        true => ((value - lo) / (hi - lo) * last + 0.5) as u8,
    };
    cells.iter().map(|row| row.iter().map(index).collect()).collect()
}

/// Red, green and blue of every colour.
fn palette(lo: f64, hi: f64) -> Vec<[u8; 3]> {
    const WHITE: [f64; 3] = [255.0; 3];
    const BLUE: [f64; 3] = [31.0, 84.0, 160.0];
    const RED: [f64; 3] = [192.0, 40.0, 58.0];
    let toward = |color: [f64; 3], part: f64| {
        let mix = |k: usize| (WHITE[k] + part * (color[k] - WHITE[k])) as u8;
        [mix(0), mix(1), mix(2)]
    };
    let last = (COLORS - 2) as f64;
    let color = |k: usize| {
        let value = lo + (hi - lo) * k as f64 / last;
        let largest = hi.max(-lo);
        let part = if largest > 0.0 { (value / largest).clamp(-1.0, 1.0) } else { 0.0 };
        match (lo < 0.0, hi > 0.0) {
            (true, true) if value > 0.0 => toward(RED, part),
            (true, _) => toward(BLUE, -part),
            _ => toward(BLUE, part),
        }
    };
    let mut colors: Vec<[u8; 3]> = (0..COLORS - 1).map(color).collect();
    colors.push([128; 3]);
    colors
}

/// A bitmap as an image of the page.
fn image(svg: &mut String, [x, y, width, height]: [f64; 4], rows: &[Vec<u8>], palette: &[[u8; 3]]) {
    if rows.is_empty() || rows[0].is_empty() {
        return;
    }
    let (x, y, width, height) = (pixel(x), pixel(y), pixel(width), pixel(height));
    let _ = writeln!(
        svg,
        "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" \
         style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>",
        base64(&png(rows, palette))
    );
}

/// A PNG file of indexed colours, without compression: blocks of deflate that are stored (RFC 1950, RFC
/// 1951).
fn png(rows: &[Vec<u8>], palette: &[[u8; 3]]) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut header = Vec::new();
    header.extend_from_slice(&(rows[0].len() as u32).to_be_bytes());
    header.extend_from_slice(&(rows.len() as u32).to_be_bytes());
    // Eight bits, indexed, deflate, no choice of filters, not interlaced.
    header.extend_from_slice(&[8, 3, 0, 0, 0]);
    chunk(&mut bytes, b"IHDR", &header);
    chunk(&mut bytes, b"PLTE", palette.as_flattened());
    let mut raw = Vec::new();
    for row in rows {
        raw.push(0);
        raw.extend_from_slice(row);
    }
    let mut data = [0x78, 0x01].to_vec();
    let blocks = raw.chunks(0xffff).count();
    for (k, block) in raw.chunks(0xffff).enumerate() {
        let length = block.len() as u16;
        data.push(u8::from(k + 1 == blocks));
        data.extend_from_slice(&length.to_le_bytes());
        data.extend_from_slice(&(!length).to_le_bytes());
        data.extend_from_slice(block);
    }
    let (a, b) = raw.iter().fold((1u32, 0u32), |(a, b), &byte| {
        let a = (a + u32::from(byte)) % 65521;
        (a, (b + a) % 65521)
    });
    data.extend_from_slice(&(b << 16 | a).to_be_bytes());
    chunk(&mut bytes, b"IDAT", &data);
    chunk(&mut bytes, b"IEND", &[]);
    bytes
}

/// A chunk with its length and its checksum.
fn chunk(bytes: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]) {
    bytes.extend_from_slice(&(data.len() as u32).to_be_bytes());
    let from = bytes.len();
    bytes.extend_from_slice(kind);
    bytes.extend_from_slice(data);
    let mut checksum = !0u32;
    for &byte in &bytes[from..] {
        checksum ^= u32::from(byte);
        for _ in 0..8 {
            checksum = if checksum & 1 == 1 { checksum >> 1 ^ 0xedb8_8320 } else { checksum >> 1 };
        }
    }
    bytes.extend_from_slice(&(!checksum).to_be_bytes());
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0u32, |bits, k| bits << 8 | u32::from(three.get(k).copied().unwrap_or(0)));
        for k in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * k) & 63) as usize];
            text.push(if k <= three.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_become_letters() {
        for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("fooba", "Zm9vYmE=")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    /// The checksum of the empty last chunk of every PNG file, and that of a stored block of one row.
    #[test]
    fn bitmaps_have_their_checksums() {
        let file = png(&[[1, 2].to_vec(), [3, 4].to_vec()], &[[0; 3]; 5]);
        assert!(file.ends_with(b"\0\0\0\0IEND\xae\x42\x60\x82"));
        // Adler-32 of 0 1 2 0 3 4: a = 11, b = 1 + 2 + 4 + 4 + 7 + 11 = 29.
        let place = file.windows(4).position(|four| four == [0, 29, 0, 11]);
        assert!(place.is_some());
    }

    #[test]
    fn large_fields_are_averaged_and_the_picture_is_xml() {
        let rows: Vec<Vec<f64>> =
            (0..1000).map(|i| (0..3000).map(|j| f64::from(i * j % 7)).collect()).collect();
        let cells = averaged(&rows);
        assert_eq!((cells.len(), cells[0].len()), (480, 640));
        for rows in [Vec::new(), [[0.0].to_vec()].to_vec(), [[f64::NAN, -1.0, 2.0].to_vec()].to_vec()] {
            let picture = HeatMap::new("a < b", rows).across("node", [0.0, 2.0]).down("t (s)", [0.0, 1.0]);
            let svg = picture.values("s (m)").to_svg();
            assert!(roxmltree::Document::parse(&svg).is_ok(), "{svg}");
        }
        // Zero is white where both signs occur.
        assert!(palette(-1.0, 1.0)[127].iter().all(|&part| part >= 253));
        assert_eq!(palette(0.0, 1.0)[0], [255; 3]);
    }
}
