//! The strokes of a panel.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;

use super::layout::{Look, Plot, ROW_HEIGHT, SAMPLE_LENGTH, Sample, StyledSeries, TICK_LENGTH};
use super::{FONT_SIZE, MARGIN};
use crate::chart::Mark;
use crate::reduce;
use crate::text::{pixel, xml};

/// Farthest place of a point in pixels. Beyond, a curve that leaves its axes is as good as at infinity.
const FARTHEST: f64 = 1e5;

/// Mean distance of upright lines in pixels below which they hide the curves. They are drawn at the upper
/// edge alone.
const CROWDED_BELOW: f64 = 24.0;

/// The panel whose upper edge is at `top`.
pub(super) fn plot(svg: &mut String, plot: &Plot<'_>, top: f64) {
    let axes_top = top + plot.above();
    legend(svg, plot, top);
    grid(svg, plot, axes_top);
    let overflow = if plot.x.fixed || plot.y.fixed { "hidden" } else { "visible" };
    let _ = writeln!(
        svg,
        "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" overflow=\"{overflow}\" fill=\"none\" \
         stroke-width=\"1.6\" stroke-linejoin=\"round\">",
        pixel(plot.left),
        pixel(axes_top),
        pixel(plot.width),
        pixel(plot.axes_height)
    );
    for (kind, at) in plot.instants.iter().enumerate() {
        instants(svg, plot, kind, at);
    }
    for curve in &plot.curves {
        draw(svg, plot, curve);
    }
    svg.push_str("</svg>\n");
    titles(svg, plot, axes_top);
}

fn legend(svg: &mut String, plot: &Plot<'_>, top: f64) {
    for (row, entries) in plot.legend.iter().enumerate() {
        let middle = top + (row as f64 + 0.5) * ROW_HEIGHT - 2.0;
        for entry in entries {
            let x = plot.left + entry.x;
            match entry.sample {
                None => {}
                Some(Sample::Curve(look)) => sample(svg, look, [x, middle]),
                Some(Sample::Instant(kind)) => {
                    let path = format!(
                        "M{},{}V{}",
                        pixel(x + 0.5 * SAMPLE_LENGTH),
                        pixel(middle - 7.0),
                        pixel(middle + 7.0)
                    );
                    let _ = writeln!(svg, "<path d=\"{path}\"{}/>", upright(kind));
                }
            }
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{}\">{}</text>",
                pixel(x + SAMPLE_LENGTH + 6.0),
                pixel(middle + 0.35 * FONT_SIZE),
                xml(&entry.name)
            );
        }
    }
}

/// A piece of the curve before its name.
fn sample(svg: &mut String, look: Look, [x, y]: [f64; 2]) {
    if look.mark == Mark::Dots {
        return dots(
            svg,
            look,
            &[
                [x + 0.35 * SAMPLE_LENGTH, y - 2.0],
                [x + 0.5 * SAMPLE_LENGTH, y + 2.0],
                [x + 0.65 * SAMPLE_LENGTH, y - 1.0],
            ],
        );
    }
    if look.mark != Mark::Points {
        let ends = pairs(&[[x, y], [x + SAMPLE_LENGTH, y]]);
        let _ =
            writeln!(svg, "<polyline points=\"{ends}\" fill=\"none\" stroke-width=\"2\"{}/>", stroke(look));
    }
    if look.mark != Mark::Line {
        sign(svg, look, [x + 0.5 * SAMPLE_LENGTH, y], false, None);
    }
}

/// How upright lines look, by their kind.
fn upright(kind: usize) -> String {
    let dashes = ["3 3", "8 3", "1 3"][kind % 3];
    format!(" stroke=\"#8a94a0\" stroke-width=\"1.2\" stroke-dasharray=\"{dashes}\"")
}

/// The upright lines of one kind, as far as they can be distinguished.
fn instants(svg: &mut String, plot: &Plot<'_>, kind: usize, at: &[f64]) {
    let mut places: Vec<f64> = Vec::new();
    for at in at {
        let x = plot.x.range.part(*at) * plot.width;
        if (0.0..=plot.width).contains(&x) && places.last().is_none_or(|last| (x - last).abs() > 1.0) {
            places.push(x);
        }
    }
    // Where lines would stand too close to see a curve behind them, they stay at the upper edge.
    let crowded = places.len() as f64 > plot.width / CROWDED_BELOW;
    let foot = if crowded { 7.0 } else { plot.axes_height };
    let mut path = String::new();
    for x in places {
        let _ = write!(path, "M{},0V{}", pixel(x), pixel(foot));
    }
    if !path.is_empty() {
        let _ = writeln!(svg, "<path d=\"{path}\"{}/>", upright(kind));
    }
}

/// Grid, frame and tick labels.
fn grid(svg: &mut String, plot: &Plot<'_>, top: f64) {
    let (left, right) = (plot.left, plot.left + plot.width);
    let bottom = top + plot.axes_height;
    let at_x = |at: f64| left + plot.x.range.part(at) * plot.width;
    let at_y = |at: f64| bottom - plot.y.range.part(at) * plot.axes_height;
    let mut lines =
        |class: &str, color: &str, xs: &mut dyn Iterator<Item = f64>, ys: &mut dyn Iterator<Item = f64>| {
            let mut path = String::new();
            for x in xs {
                let _ = write!(path, "M{},{}V{}", pixel(x), pixel(top), pixel(bottom));
            }
            for y in ys {
                let _ = write!(path, "M{},{}H{}", pixel(left), pixel(y), pixel(right));
            }
            if !path.is_empty() {
                let _ =
                    writeln!(svg, "<path class=\"{class}\" d=\"{path}\" stroke=\"{color}\" fill=\"none\"/>");
            }
        };
    lines(
        "minor",
        "#f0f2f4",
        &mut plot.x.ticks.minor.iter().map(|at| at_x(*at)),
        &mut plot.y.ticks.minor.iter().map(|at| at_y(*at)),
    );
    lines(
        "major",
        "#dde2e7",
        &mut plot.x.ticks.major.iter().map(|(at, _)| at_x(*at)),
        &mut plot.y.ticks.major.iter().map(|(at, _)| at_y(*at)),
    );
    let _ = writeln!(
        svg,
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#8a94a0\"/>",
        pixel(left),
        pixel(top),
        pixel(plot.width),
        pixel(plot.axes_height)
    );
    svg.push_str("<g text-anchor=\"middle\" fill=\"#48525e\">\n");
    for (at, label) in &plot.x.ticks.major {
        let (x, y) = (pixel(at_x(*at)), pixel(bottom + TICK_LENGTH + FONT_SIZE));
        let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\">{label}</text>");
    }
    svg.push_str("</g>\n<g text-anchor=\"end\" fill=\"#48525e\">\n");
    for (at, label) in &plot.y.ticks.major {
        let (x, y) = (pixel(left - TICK_LENGTH), pixel(at_y(*at) + 0.35 * FONT_SIZE));
        let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\">{label}</text>");
    }
    svg.push_str("</g>\n");
}

fn titles(svg: &mut String, plot: &Plot<'_>, top: f64) {
    let bottom = top + plot.axes_height;
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
        pixel(plot.left + 0.5 * plot.width),
        pixel(bottom + TICK_LENGTH + ROW_HEIGHT + FONT_SIZE),
        xml(&plot.x.title)
    );
    let (x, y) = (pixel(MARGIN + FONT_SIZE - 2.0), pixel(top + 0.5 * plot.axes_height));
    let _ = writeln!(
        svg,
        "<text transform=\"translate({x},{y}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        xml(&plot.y.title)
    );
    for (row, note) in plot.notes.iter().enumerate() {
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{}\" font-size=\"11\" fill=\"#a2542a\">{}</text>",
            pixel(plot.left),
            pixel(bottom + TICK_LENGTH + 2.0 * ROW_HEIGHT + (row as f64) * ROW_HEIGHT + FONT_SIZE),
            xml(note)
        );
    }
}

/// A series: its pieces between gaps, and its signs.
fn draw(svg: &mut String, plot: &Plot<'_>, curve: &StyledSeries<'_>) {
    let placed: Vec<Option<[f64; 2]>> = curve
        .series
        .points
        .iter()
        .map(|point| {
            let x = plot.x.range.part(plot.x.coordinate(point[0])) * plot.width;
            let y = (1.0 - plot.y.range.part(plot.y.coordinate(point[1]))) * plot.axes_height;
            let place = [x, y];
            place.iter().all(|p| p.is_finite()).then(|| place.map(|p| p.clamp(-FARTHEST, FARTHEST)))
        })
        .collect();
    if curve.look.mark == Mark::Dots {
        return dots(svg, curve.look, &placed.into_iter().flatten().collect::<Vec<_>>());
    }
    if curve.look.mark != Mark::Points {
        for piece in placed.split(Option::is_none) {
            let piece: Vec<_> = piece.iter().flatten().copied().collect();
            line(svg, curve, &reduce::visible(&piece));
        }
    }
    if curve.look.mark != Mark::Line {
        let hollow = curve.series.points.iter().map(|point| point[1] <= curve.series.hollow_below);
        let labels =
            curve.series.labels.iter().map(|label| Some(label.as_str())).chain(core::iter::repeat(None));
        let shown = placed.into_iter().zip(hollow).zip(labels);
        let shown: Vec<_> = shown
            .filter_map(|((place, hollow), label)| Some(Sign { place: place?, hollow, label }))
            .collect();
        let says = !curve.series.labels.is_empty();
        if says {
            // Signs are small: an unseen edge takes the pointer beside them, too.
            svg.push_str("<g stroke=\"#fff\" stroke-opacity=\"0\" stroke-width=\"8\">\n");
        }
        for Sign { place, hollow, label } in separate(&shown) {
            sign(svg, curve.look, place, hollow, label);
        }
        if says {
            svg.push_str("</g>\n");
        }
    }
}

/// Lines of no length with round ends, which are shorter to write than circles.
fn dots(svg: &mut String, look: Look, places: &[[f64; 2]]) {
    if places.is_empty() {
        return;
    }
    let mut path = String::with_capacity(12 * places.len());
    for [x, y] in places {
        let _ = write!(path, "M{},{}h0", pixel(*x), pixel(*y));
    }
    let color = look.color.on_light();
    let _ = writeln!(
        svg,
        "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.8\" stroke-linecap=\"round\"/>"
    );
}

fn line(svg: &mut String, curve: &StyledSeries<'_>, points: &[[f64; 2]]) {
    let look = curve.look;
    match points {
        [] => {}
        [[x, y]] => {
            let _ = writeln!(
                svg,
                "<circle cx=\"{}\" cy=\"{}\" r=\"1.6\" fill=\"{}\"/>",
                pixel(*x),
                pixel(*y),
                look.color.on_light()
            );
        }
        points => {
            let (pairs, stroke) = (pairs(points), stroke(look));
            let _ = match curve.series.labels.as_slice() {
                [] => writeln!(svg, "<polyline points=\"{pairs}\"{stroke}/>"),
                // A tooltip shows its name, which distinguishes it from others of the same colour.
                _ => writeln!(
                    svg,
                    "<polyline points=\"{pairs}\"{stroke}><title>{}</title></polyline>",
                    xml(&curve.series.name)
                ),
            };
        }
    }
}

/// A sign to be drawn.
#[derive(Clone, Copy)]
struct Sign<'a> {
    place: [f64; 2],
    hollow: bool,
    label: Option<&'a str>,
}

/// The signs without those that are hidden under the one before.
fn separate<'a>(signs: &[Sign<'a>]) -> Vec<Sign<'a>> {
    let mut kept: Vec<Sign<'_>> = Vec::new();
    for sign in signs {
        let apart =
            |last: &Sign<'_>| libm::hypot(sign.place[0] - last.place[0], sign.place[1] - last.place[1]);
        if kept.last().is_none_or(|last| apart(last) >= 0.5) {
            kept.push(*sign);
        }
    }
    kept
}

/// The sign of a series, disc, square, triangle, diamond in turn, with what it says where it is pointed at.
fn sign(svg: &mut String, look: Look, [x, y]: [f64; 2], hollow: bool, label: Option<&str>) {
    let color = look.color.on_light();
    // White, so that the line does not show through.
    let fill = if hollow {
        format!("#ffffff\" stroke=\"{color}\" stroke-opacity=\"1\" stroke-width=\"1.4")
    } else {
        color
    };
    let ends = |tag: &str| match label {
        Some(label) => format!("><title>{}</title></{tag}>", xml(label)),
        None => String::from("/>"),
    };
    let corners: &[[f64; 2]] = match look.sign % 4 {
        0 => {
            let (x, y) = (pixel(x), pixel(y));
            let _ =
                writeln!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"3.2\" fill=\"{fill}\"{}", ends("circle"));
            return;
        }
        1 => &[[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]],
        2 => &[[0.0, -4.2], [3.8, 2.8], [-3.8, 2.8]],
        _ => &[[0.0, -4.2], [4.2, 0.0], [0.0, 4.2], [-4.2, 0.0]],
    };
    let corners: Vec<_> = corners.iter().map(|[dx, dy]| [x + dx, y + dy]).collect();
    let _ = writeln!(svg, "<polygon points=\"{}\" fill=\"{fill}\"{}", pairs(&corners), ends("polygon"));
}

fn stroke(look: Look) -> String {
    let color = look.color.on_light();
    match look.dashes {
        "" => format!(" stroke=\"{color}\""),
        dashes => format!(" stroke=\"{color}\" stroke-dasharray=\"{dashes}\""),
    }
}

fn pairs(points: &[[f64; 2]]) -> String {
    let mut out = String::with_capacity(12 * points.len());
    for [x, y] in points {
        if !out.is_empty() {
            out.push(' ');
        }
        let _ = write!(out, "{},{}", pixel(*x), pixel(*y));
    }
    out
}
