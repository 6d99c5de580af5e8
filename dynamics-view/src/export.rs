//! A [`Chart`] as text, as a picture and as a file.

use alloc::string::String;
#[cfg(feature = "png")]
use alloc::vec::Vec;

use crate::chart::Chart;
#[cfg(feature = "std")]
use crate::file::{self, Content, FileError, Picture};
#[cfg(feature = "png")]
use crate::png;
use crate::svg;

/// The formats that a chart is written in.
impl Chart {
    /// The chart as SVG text.
    #[must_use]
    pub fn to_svg(&self) -> String {
        svg::render(self)
    }

    /// The chart as the bytes of a PNG file, two pixels for each of [`width`](Chart::width). Letters are
    /// those of a sans-serif font of the system; an error where there is no font.
    #[cfg(feature = "png")]
    pub fn to_png(&self) -> std::io::Result<Vec<u8>> {
        png::render(&self.to_svg())
    }

    /// Writes the chart in the format that the path's extension names, making the folders that the path
    /// needs: `.svg`, or `.png` with the feature `png`; SVG where there is no extension. An error for every
    /// other extension.
    #[cfg(feature = "std")]
    pub fn write(&self, path: impl AsRef<std::path::Path>) -> Result<(), FileError> {
        let path = path.as_ref();
        match file::picture(path)? {
            Picture::Svg => file::write(path, Content::Chart, self.to_svg().as_bytes()),
            Picture::Png => {
                let failed = |source| FileError { path: path.to_path_buf(), action: "write", source };
                file::write(path, Content::Chart, &self.png_bytes().map_err(failed)?)
            }
        }
    }

    #[cfg(feature = "png")]
    fn png_bytes(&self) -> std::io::Result<Vec<u8>> {
        self.to_png()
    }

    #[cfg(all(feature = "std", not(feature = "png")))]
    fn png_bytes(&self) -> std::io::Result<Vec<u8>> {
        let missing = "`.png` needs the feature `png` of `dynamics`; `.svg` needs none";
        Err(std::io::Error::new(std::io::ErrorKind::Unsupported, missing))
    }

    /// Writes the chart as an SVG file and creates the folders of its path. It is an error if the path has an
    /// extension other than `.svg`.
    #[cfg(feature = "std")]
    pub fn write_svg(&self, path: impl AsRef<std::path::Path>) -> Result<(), FileError> {
        file::write(path.as_ref(), Content::Svg, self.to_svg().as_bytes())
    }
}
