//! A [`Chart`](crate::Chart) as SVG: text is measured before anything is placed, so that nothing
//! overlaps.

mod layout;
mod measure;
mod paint;

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;

use crate::chart::Chart;
use crate::text::{pixel, xml};
use layout::Plot;

/// Free space around everything, in pixels.
const MARGIN: f64 = 14.0;
/// Height of the title's row in pixels.
const TITLE_HEIGHT: f64 = 30.0;
/// Size of ordinary text in pixels.
const FONT_SIZE: f64 = 12.0;
/// Size of the title in pixels.
const TITLE_FONT_SIZE: f64 = 16.0;

/// The chart as SVG text.
pub(crate) fn render(chart: &Chart) -> String {
    let plots: Vec<Plot<'_>> = layout::plots(chart);
    let top = MARGIN + if chart.title.is_empty() { 0.0 } else { TITLE_HEIGHT };
    let height = top + plots.iter().map(Plot::height).sum::<f64>() + MARGIN;
    let (width, height) = (pixel(chart.width), pixel(height));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 \
         {width} {height}\" role=\"img\" font-family=\"system-ui, 'Segoe UI', 'DejaVu Sans', Arial, \
         sans-serif\" font-size=\"{FONT_SIZE}\" fill=\"#1d2530\">\n"
    );
    if !chart.title.is_empty() {
        let _ = writeln!(svg, "<title>{}</title>", xml(&chart.title));
    }
    let _ = writeln!(svg, "<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>");
    if !chart.title.is_empty() {
        let title = measure::fitted(&chart.title, TITLE_FONT_SIZE * 1.15, chart.width - 2.0 * MARGIN);
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{}\" font-size=\"{TITLE_FONT_SIZE}\" font-weight=\"600\">{}</text>",
            pixel(MARGIN),
            pixel(MARGIN + TITLE_FONT_SIZE),
            xml(&title)
        );
    }
    let mut y = top;
    for plot in &plots {
        paint::plot(&mut svg, plot, y);
        y += plot.height();
    }
    svg.push_str("</svg>\n");
    svg
}

#[cfg(test)]
mod tests;
