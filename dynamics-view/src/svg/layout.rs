//! The layout of a chart.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::{FONT_SIZE, MARGIN, measure};
use crate::chart::{Axis, Chart, Mark, Panel, Scale, Series};
use crate::color::Color;
use crate::text::readable;
use crate::ticks::{self, Range, Ticks};

/// Height of a row of text in pixels.
pub(super) const ROW_HEIGHT: f64 = 18.0;
/// Length in pixels of a tick, and of the space between it and its label.
pub(super) const TICK_LENGTH: f64 = 5.0;
/// Length in pixels of the sample of a line in the legend.
pub(super) const SAMPLE_LENGTH: f64 = 26.0;
/// Space between panels in pixels.
const SPACE_BETWEEN_PANELS: f64 = 12.0;

/// A panel with everything decided but its place on the page.
pub(super) struct Plot<'a> {
    /// Left edge, width and height of the axes.
    pub(super) left: f64,
    pub(super) width: f64,
    pub(super) axes_height: f64,
    pub(super) x: Side,
    pub(super) y: Side,
    pub(super) curves: Vec<StyledSeries<'a>>,
    /// Upright lines: x in axis coordinates.
    pub(super) instants: Vec<Vec<f64>>,
    pub(super) legend: Vec<Vec<Entry>>,
    pub(super) notes: Vec<String>,
}

/// An axis with its ticks and its title.
pub(super) struct Side {
    pub(super) range: Range,
    pub(super) log: bool,
    pub(super) ticks: Ticks,
    pub(super) title: String,
    /// Whether the user set the range, so that curves may leave it.
    pub(super) fixed: bool,
}

/// A series with its looks.
pub(super) struct StyledSeries<'a> {
    pub(super) series: &'a Series,
    pub(super) look: Look,
}

/// What distinguishes one series from the next: colour, dashes and sign.
#[derive(Clone, Copy)]
pub(super) struct Look {
    pub(super) color: Color,
    pub(super) dashes: &'static str,
    pub(super) sign: usize,
    pub(super) mark: Mark,
}

/// A name of the legend at x, counted from the left edge of the axes; one that goes on from the row above has
/// no sample.
pub(super) struct Entry {
    pub(super) x: f64,
    pub(super) name: String,
    pub(super) sample: Option<Sample>,
}

/// What stands before a name in the legend.
#[derive(Clone, Copy)]
pub(super) enum Sample {
    Curve(Look),
    /// The upright line of the k-th kind of instants.
    Instant(usize),
}

const DASHES: [&str; 4] = ["", "8 4", "8 3 2 3", "2 3"];

impl Plot<'_> {
    /// Height of the whole panel.
    pub(super) fn height(&self) -> f64 {
        let below = TICK_LENGTH + ROW_HEIGHT + ROW_HEIGHT + self.notes.len() as f64 * ROW_HEIGHT;
        self.above() + self.axes_height + below + SPACE_BETWEEN_PANELS
    }

    /// Height of what stands above the axes.
    pub(super) fn above(&self) -> f64 {
        // Half a label stands out above the topmost tick.
        0.5 * FONT_SIZE + self.legend.len() as f64 * ROW_HEIGHT
    }
}

impl Side {
    /// The value in axis coordinates: not finite where it has no place on the axis.
    pub(super) fn coordinate(&self, value: f64) -> f64 {
        coordinate(value, self.log)
    }
}

fn coordinate(value: f64, log: bool) -> f64 {
    match log {
        true if value > 0.0 => libm::log10(value),
        true => f64::NAN,
        false => value,
    }
}

/// Decides everything for all panels; their axes stand exactly one below the other.
pub(super) fn plots(chart: &Chart) -> Vec<Plot<'_>> {
    let default = if chart.panels.len() > 1 { 190.0 } else { 380.0 };
    let height = chart.panel_height.unwrap_or(default);
    // The labels of y decide the left edge, and the left edge how many labels of x there is room for.
    let rough = chart.width - 2.0 * MARGIN - 70.0;
    let sized: Vec<_> = chart.panels.iter().map(|panel| sized_ranges(panel, rough, height)).collect();
    let sides: Vec<_> = chart
        .panels
        .iter()
        .zip(&sized)
        .map(|(panel, (_, y, height))| vertical(&panel.y, *y, *height))
        .collect();
    let labels = sides
        .iter()
        .flat_map(|side| &side.ticks.major)
        .map(|(_, label)| measure::width(label, FONT_SIZE))
        .fold(0.0, f64::max);
    let left = MARGIN + ROW_HEIGHT + labels + TICK_LENGTH + 3.0;
    // Half the last label of x stands out on the right.
    let width = chart.width - left - MARGIN - 12.0;
    chart
        .panels
        .iter()
        .zip(sized)
        .zip(sides)
        .map(|((panel, (x, _, axes_height)), y)| {
            let x = horizontal(&panel.x, x, width);
            let curves = curves(panel, &x, &y, [width, axes_height]);
            let legend = legend(panel, &curves, width);
            let instants = panel
                .instants
                .iter()
                .map(|(_, at)| at.iter().map(|at| x.coordinate(*at)).collect())
                .collect();
            let notes = notes(panel, &x, &y);
            let notes = notes.iter().flat_map(|note| measure::wrapped(note, FONT_SIZE, width)).collect();
            Plot { left, width, axes_height, x, y, curves, instants, legend, notes }
        })
        .collect()
}

/// Ranges of x and y and the height of the axes.
fn sized_ranges(panel: &Panel, width: f64, height: f64) -> (Range, Range, f64) {
    let (x, y) = (range(panel, 0), range(panel, 1));
    let linear = panel.x.scale == Scale::Linear && panel.y.scale == Scale::Linear;
    if !(panel.equal && linear) {
        return (x, y, height);
    }
    let (dx, dy) = (x.hi - x.lo, y.hi - y.lo);
    if !(dx.is_finite() && dy.is_finite()) {
        return (x, y, height);
    }
    let height = (width * (dy / dx)).clamp(160.0, 560.0);
    let unit = (dx / width).max(dy / height);
    let widened = |range: Range, length: f64| {
        let middle = 0.5 * (range.lo + range.hi);
        Range { lo: middle - 0.5 * unit * length, hi: middle + 0.5 * unit * length }
    };
    (widened(x, width), widened(y, height), height)
}

fn axis_of(panel: &Panel, index: usize) -> &Axis {
    if index == 0 { &panel.x } else { &panel.y }
}

/// The user's range where it is one, in axis coordinates.
fn fixed_range(axis: &Axis) -> Option<Range> {
    let [lo, hi] = axis.range?;
    let log = axis.scale == Scale::Log;
    let (lo, hi) = (coordinate(lo, log), coordinate(hi, log));
    (lo.is_finite() && hi.is_finite() && lo < hi).then_some(Range { lo, hi })
}

fn range(panel: &Panel, index: usize) -> Range {
    let axis = axis_of(panel, index);
    let log = axis.scale == Scale::Log;
    fixed_range(axis).unwrap_or_else(|| {
        let other_log = axis_of(panel, 1 - index).scale == Scale::Log;
        let shown = panel
            .series
            .iter()
            .flat_map(|series| &series.points)
            .filter(|point| coordinate(point[1 - index], other_log).is_finite())
            .map(|point| coordinate(point[index], log));
        let range = Range::around(shown, log);
        // Time histories begin at the very edge: air is for values.
        if index == 0 && !log && !panel.equal && panel.series.iter().all(|s| s.mark == Mark::Line) {
            tight(panel, range)
        } else {
            range
        }
    })
}

/// Without air on the sides, where the data have any width.
fn tight(panel: &Panel, padded: Range) -> Range {
    let values = || {
        panel
            .series
            .iter()
            .flat_map(|series| &series.points)
            .map(|point| point[0])
            .filter(|x| *x >= padded.lo && *x <= padded.hi)
    };
    let in_order = panel.series.iter().all(|s| {
        s.points.windows(2).all(|pair| pair[0][0] <= pair[1][0])
            || s.points.windows(2).all(|pair| pair[0][0] >= pair[1][0])
    });
    let (lo, hi) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
    // Only where the padding is the ordinary one: not for a constant.
    if in_order && hi - lo > 0.9 * (padded.hi - padded.lo) { Range { lo, hi } } else { padded }
}

/// Largest part of a vertical axis above its last or below its first label. Where more of it is bare, finer
/// ticks are tried, as an axis without a label near its ends does not say how far it goes.
const MOST_BARE: f64 = 0.16;

/// Ticks of y, a line of text and more apart.
fn vertical(axis: &Axis, range: Range, height: f64) -> Side {
    let most = height / 20.0;
    let mut ticks = some_ticks(axis, range, height / 42.0, most);
    // Without a label near its ends an axis does not say how far it goes: a finer step, if there is room for
    // one that does.
    if axis.scale == Scale::Linear && ticks.bare(range) > MOST_BARE {
        let counts = ticks.major.len() + 1..=libm::floor(most) as usize;
        let finer = || counts.clone().map(|count| ticks::linear(range, count));
        let enough = finer().find(|finer| finer.bare(range) <= MOST_BARE);
        let best = enough.or_else(|| finer().min_by(|a, b| a.bare(range).total_cmp(&b.bare(range))));
        ticks = best.filter(|best| best.bare(range) < ticks.bare(range)).unwrap_or(ticks);
    }
    side(axis, range, ticks, height + 2.0 * ROW_HEIGHT)
}

/// Ticks of x, farther apart than any label is wide.
fn horizontal(axis: &Axis, range: Range, width: f64) -> Side {
    let mut ticks = some_ticks(axis, range, width / 62.0, width / 56.0);
    // Round values on a logarithmic axis do not keep the mean distance: a label that would come too close
    // leaves its tick bare.
    let mut end = f64::NEG_INFINITY;
    let (labelled, bare): (Vec<_>, Vec<_>) = ticks.major.into_iter().partition(|(at, label)| {
        let (middle, half) = (range.part(*at) * width, 0.5 * measure::width(label, FONT_SIZE));
        let free = middle - half > end + 6.0;
        if free {
            end = middle + half;
        }
        free
    });
    ticks.major = labelled;
    ticks.minor.extend(bare.into_iter().map(|(at, _)| at));
    side(axis, range, ticks, width)
}

/// About `wanted` ticks, up to `most` where so few would be a single label: that says nothing about the
/// scale.
fn some_ticks(axis: &Axis, range: Range, wanted: f64, most: f64) -> Ticks {
    let log = axis.scale == Scale::Log;
    let ticks = |count| if log { ticks::logarithmic(range, count) } else { ticks::linear(range, count) };
    let wanted = libm::floor(wanted).max(2.0) as usize;
    let chosen = (wanted..=libm::floor(most) as usize).map(ticks).find(|ticks| ticks.major.len() > 1);
    chosen.unwrap_or_else(|| ticks(wanted))
}

fn side(axis: &Axis, range: Range, ticks: Ticks, room: f64) -> Side {
    let factor = match ticks.factor.as_str() {
        "" => String::new(),
        factor => format!("  ({factor})"),
    };
    let title = measure::fitted(&axis.title, FONT_SIZE, room - measure::width(&factor, FONT_SIZE));
    Side {
        range,
        log: axis.scale == Scale::Log,
        ticks,
        title: format!("{title}{factor}"),
        fixed: fixed_range(axis).is_some(),
    }
}

/// Length of all ups and downs of a curve, in widths of its axes, above which it is drawn solid. Dashes would
/// make it a blur.
const DENSE_CLIMB: f64 = 6.0;

fn curves<'a>(panel: &'a Panel, x: &Side, y: &Side, [width, height]: [f64; 2]) -> Vec<StyledSeries<'a>> {
    let climb = |series: &Series| -> f64 {
        let part = |point: &[f64; 2]| y.range.part(y.coordinate(point[1])) * height;
        let climbs = series.points.windows(2).map(|pair| (part(&pair[1]) - part(&pair[0])).abs());
        climbs.filter(|climb| climb.is_finite()).sum()
    };
    let forward = |series: &Series| {
        series.points.windows(2).all(|pair| x.coordinate(pair[0][0]) <= x.coordinate(pair[1][0]))
    };
    let dense = |series: &Series| forward(series) && climb(series) > DENSE_CLIMB * width;

    panel
        .series
        .iter()
        .enumerate()
        .map(|(k, series)| StyledSeries {
            series,
            look: Look {
                color: series.color.unwrap_or(Color::cycle(k)),
                // Shifted after each round of colours: 32 series differ.
                dashes: match series.dashed {
                    Some(dashed) => DASHES[usize::from(dashed)],
                    None if dense(series) => "",
                    None => DASHES[(k + k / 8) % DASHES.len()],
                },
                sign: series.sign.unwrap_or(k + k / 8),
                mark: series.mark,
            },
        })
        .collect()
}

/// The names in rows above the axes; none where the y-axis says it already.
fn legend(panel: &Panel, curves: &[StyledSeries<'_>], width: f64) -> Vec<Vec<Entry>> {
    let only_named_by_axis = match panel.series.as_slice() {
        [only] => panel.y.title.starts_with(&only.name),
        _ => false,
    };
    let of_curves = curves.iter().filter(|_| !only_named_by_axis);
    let of_curves = of_curves.map(|curve| (&curve.series.name, Sample::Curve(curve.look)));
    let of_instants = panel.instants.iter().enumerate().filter(|(_, (_, at))| !at.is_empty());
    let of_instants = of_instants.map(|(k, (name, _))| (name, Sample::Instant(k)));
    let mut rows: Vec<Vec<Entry>> = Vec::new();
    let mut x = f64::INFINITY;
    for (name, sample) in of_curves.chain(of_instants).filter(|(name, _)| !name.is_empty()) {
        // The end of a name distinguishes it from others: it continues in the next row.
        for (line, name) in
            measure::wrapped(name, FONT_SIZE, width - SAMPLE_LENGTH - 8.0).into_iter().enumerate()
        {
            let needs = SAMPLE_LENGTH + 6.0 + measure::width(&name, FONT_SIZE);
            if line > 0 || x + needs > width {
                rows.push(Vec::new());
                x = 0.0;
            }
            if let Some(row) = rows.last_mut() {
                row.push(Entry { x, name, sample: (line == 0).then_some(sample) });
            }
            x += needs + 16.0;
        }
    }
    rows
}

/// What the picture cannot show, in words.
fn notes(panel: &Panel, x: &Side, y: &Side) -> Vec<String> {
    let points = || panel.series.iter().flat_map(|series| &series.points);
    let finite = |point: &&[f64; 2]| point[0].is_finite() && point[1].is_finite();
    // Where both are missing a gap is meant.
    let is_gap = |point: &&[f64; 2]| point.iter().all(|x| x.is_nan());
    let not_finite = points().filter(|point| !finite(point) && !is_gap(point)).count();
    let not_positive = points()
        .filter(finite)
        .filter(|point| (x.log && point[0] <= 0.0) || (y.log && point[1] <= 0.0))
        .count();
    let mut notes = Vec::new();
    if points().next().is_none() {
        notes.push(String::from("there are no points"));
    }
    for axis in [&panel.x, &panel.y] {
        if let Some([lo, hi]) = axis.range.filter(|_| fixed_range(axis).is_none()) {
            let (lo, hi) = (readable(lo, 3), readable(hi, 3));
            notes.push(format!("the axis cannot go from {lo} to {hi} and shows what there is"));
        }
    }
    for (count, what) in
        [(not_finite, "not finite"), (not_positive, "not positive: without place on a logarithmic axis")]
    {
        match count {
            0 => {}
            1 => notes.push(format!("1 point is {what}")),
            count => notes.push(format!("{count} points are {what}")),
        }
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of 1, 2 and 5 leave no more of an axis bare than this at these heights; up to half of it was,
    /// with as few labels as would do.
    #[test]
    fn a_vertical_axis_says_how_far_it_goes() {
        let axis = Axis::default();
        for (height, bare) in [(120.0, 0.37), (160.0, 0.29), (200.0, 0.2), (240.0, 0.18), (400.0, 0.165)] {
            for lo in (0..100).map(|k| f64::from(k) * -0.01) {
                for width in (0..40).map(|k| 0.1 * libm::pow(10.0, f64::from(k) / 40.0)) {
                    let range = Range { lo, hi: lo + width };
                    let ticks = vertical(&axis, range, height).ticks;
                    assert!(ticks.bare(range) < bare, "{height} {range:?} {ticks:?}");
                    assert!(ticks.major.len() as f64 <= 1.0 + height / 20.0, "{height} {range:?} {ticks:?}");
                }
            }
        }
    }
}
