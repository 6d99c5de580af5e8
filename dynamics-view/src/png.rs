//! Charts as PNG: the SVG text, rasterised by `resvg`, which is pure Rust.

use alloc::string::{String, ToString};
use alloc::sync::Arc;
use alloc::vec::Vec;
use std::io;
use std::sync::OnceLock;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

/// Pixels for each unit of the SVG. Two keep letters sharp on screens with small pixels and in print.
const SCALE: f32 = 2.0;

/// Fonts whose letters are as wide as the layout takes them to be, the best first.
const PREFERRED: [&str; 9] = [
    "Segoe UI",
    "DejaVu Sans",
    "Noto Sans",
    "Liberation Sans",
    "Arial",
    "Helvetica",
    "Helvetica Neue",
    "Roboto",
    "Open Sans",
];

/// The bytes of a PNG file.
pub(crate) fn render(svg: &str) -> io::Result<Vec<u8>> {
    let Some((fonts, family)) = fonts() else {
        return Err(io::Error::new(
            io::ErrorKind::NotFound,
            "no font was found for the letters of the chart; install a sans-serif font, or write `.svg`",
        ));
    };
    let options = Options { fontdb: Arc::clone(fonts), font_family: family.clone(), ..Options::default() };
    let tree = Tree::from_str(svg, &options).map_err(io::Error::other)?;
    let size = tree.size();
    let pixels = |length: f32| (SCALE * length).ceil() as u32;
    let mut picture = Pixmap::new(pixels(size.width()), pixels(size.height()))
        .ok_or_else(|| io::Error::other("the chart has no size"))?;
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut picture.as_mut());
    picture.encode_png().map_err(|error| io::Error::other(error.to_string()))
}

/// The fonts of the system and the family that charts are written in, looked for once; `None` where there is
/// no font.
fn fonts() -> Option<&'static (Arc<fontdb::Database>, String)> {
    static FONTS: OnceLock<Option<(Arc<fontdb::Database>, String)>> = OnceLock::new();
    let find = || {
        let mut fonts = fontdb::Database::new();
        fonts.load_system_fonts();
        let family = family(&fonts)?;
        // What the chart asks for last, where none of the fonts that it names is there.
        fonts.set_sans_serif_family(family.clone());
        Some((Arc::new(fonts), family))
    };
    FONTS.get_or_init(find).as_ref()
}

fn family(fonts: &fontdb::Database) -> Option<String> {
    let names = || fonts.faces().flat_map(|face| face.families.iter().map(|(name, _)| name.as_str()));
    let preferred = PREFERRED.into_iter().find(|wanted| names().any(|name| name == *wanted));
    let upright = || fonts.faces().find(|face| !face.monospaced && face.style == fontdb::Style::Normal);
    let any = || upright().or_else(|| fonts.faces().next())?.families.first().map(|(name, _)| name.clone());
    preferred.map(String::from).or_else(any)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::{Axis, Chart, Panel};

    /// Machines without fonts have their own answer.
    #[test]
    fn a_chart_becomes_a_picture_or_says_that_there_is_no_font() {
        let chart = Chart::new("x")
            .panel(Panel::new(Axis::new("t in s"), Axis::new("x in m")).line("", [(0.0, 1.0)]));
        match (fonts(), chart.to_png()) {
            (None, Err(error)) => assert!(error.to_string().contains("write `.svg`"), "{error}"),
            (Some(_), Ok(bytes)) => {
                let picture = Pixmap::decode_png(&bytes).unwrap();
                assert_eq!(picture.width(), 1520);
                let dark = picture.pixels().iter().filter(|pixel| pixel.red() < 100).count();
                assert!(dark > 100, "letters: {dark} dark pixels");
                assert!(picture.pixels().iter().all(|pixel| pixel.alpha() == 255));
            }
            (fonts, found) => panic!("{:?} {:?}", fonts.is_some(), found.map(|bytes| bytes.len())),
        }
    }
}
