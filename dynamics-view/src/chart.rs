//! Curves on axes, as SVG without system libraries.

use alloc::string::String;
use alloc::vec::Vec;

use crate::color::Color;

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// In proportion.
    #[default]
    Linear,
    /// By their decimal logarithm. Values that are not positive cannot be shown, and the chart says how many
    /// there are.
    Log,
}

/// An axis: what it shows and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    pub(crate) title: String,
    pub(crate) scale: Scale,
    pub(crate) range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis; the title names quantity and unit, as in `time in s`.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn log(title: impl Into<String>) -> Self {
        Self { title: title.into(), scale: Scale::Log, range: None }
    }

    /// Shows `lo` to `hi` instead of the range of the series; curves are cut at the edges. If this range is
    /// empty, or the scale cannot show it, the chart uses the range of the series and says so.
    #[must_use]
    pub fn range(mut self, lo: f64, hi: f64) -> Self {
        self.range = Some([lo, hi]);
        self
    }
}

/// How a series is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// Its points joined.
    #[default]
    Line,
    /// A sign at every point.
    Points,
    /// A dot at every point: sets of thousands, as sections through a motion.
    Dots,
    /// Both.
    LineAndPoints,
}

/// A named sequence of points. A value that is not finite is a gap, and the chart says how many there are; a
/// point (NaN, NaN) is an intended gap.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub(crate) name: String,
    pub(crate) points: Vec<[f64; 2]>,
    pub(crate) mark: Mark,
    pub(crate) color: Option<Color>,
    pub(crate) dashed: Option<bool>,
    pub(crate) sign: Option<usize>,
    pub(crate) hollow_below: f64,
    pub(crate) labels: Vec<String>,
}

impl Series {
    /// Points (x, y) joined by lines.
    #[must_use]
    pub fn new(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            name: name.into(),
            points: points.into_iter().map(|(x, y)| [x, y]).collect(),
            mark: Mark::Line,
            color: None,
            dashed: None,
            sign: None,
            hollow_below: f64::NEG_INFINITY,
            labels: Vec::new(),
        }
    }

    /// Shows it so.
    #[must_use]
    pub fn mark(mut self, mark: Mark) -> Self {
        self.mark = mark;
        self
    }

    /// In this colour instead of the next of the cycle.
    #[must_use]
    pub fn color(mut self, color: Color) -> Self {
        self.color = Some(color);
        self
    }

    /// With an unbroken line instead of the next pattern of the cycle.
    #[must_use]
    pub fn solid(mut self) -> Self {
        self.dashed = Some(false);
        self
    }

    /// With a dashed line instead of the next pattern of the cycle.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dashed = Some(true);
        self
    }

    /// With the k-th sign (disc, square, triangle, diamond, and again) instead of the next one: for a series
    /// that appears in several panels.
    #[must_use]
    pub fn sign(mut self, k: usize) -> Self {
        self.sign = Some(k);
        self
    }

    /// Draws the signs of points with y at or below this value hollow: values that are not significant.
    #[must_use]
    pub fn hollow_below(mut self, y: f64) -> Self {
        self.hollow_below = y;
        self
    }

    /// The text of each point, in their order, shown when a reader points at its sign. The curve then shows
    /// its name.
    #[must_use]
    pub fn labels(mut self, labels: impl IntoIterator<Item = String>) -> Self {
        self.labels = labels.into_iter().collect();
        self
    }
}

/// One pair of axes with its series.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<Series>,
    pub(crate) instants: Vec<(String, Vec<f64>)>,
    pub(crate) equal: bool,
}

impl Panel {
    /// Empty axes.
    #[must_use]
    pub fn new(x: Axis, y: Axis) -> Self {
        Self { x, y, ..Self::default() }
    }

    /// Adds a series.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds points (x, y) joined by lines.
    #[must_use]
    pub fn line(self, name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.series(Series::new(name, points))
    }

    /// Adds points (x, y), each with a sign.
    #[must_use]
    pub fn points(self, name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.series(Series::new(name, points).mark(Mark::Points))
    }

    /// Adds points (x, y), each as a dot: sets of thousands.
    #[must_use]
    pub fn dots(self, name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.series(Series::new(name, points).mark(Mark::Dots))
    }

    /// Adds points (x, y), each with a sign, joined by lines: measurements such as error against cost.
    #[must_use]
    pub fn curve(self, name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.series(Series::new(name, points).mark(Mark::LineAndPoints))
    }

    /// Marks values of x with upright lines under one name: events, switching times.
    #[must_use]
    pub fn instants(mut self, name: impl Into<String>, at: impl IntoIterator<Item = f64>) -> Self {
        self.instants.push((name.into(), at.into_iter().collect()));
        self
    }

    /// Without the texts of points: for touch screens, which have no pointer.
    #[must_use]
    pub fn without_labels(mut self) -> Self {
        self.series.iter_mut().for_each(|series| series.labels.clear());
        self
    }

    /// One unit of x as long as one unit of y (linear axes only): orbits and shapes.
    #[must_use]
    pub fn equal_axes(mut self) -> Self {
        self.equal = true;
        self
    }
}

/// One or more panels, one below the other, under a title.
///
/// ```
/// # mod dynamics {
/// #     pub use dynamics_view as output;
/// # }
/// use dynamics::output::{Axis, Chart, Panel};
/// let errors = [(1e3, 1e-4), (2e3, 3e-6), (4e3, 1e-7)];
/// let svg = Chart::new("Error against cost")
///     .panel(Panel::new(Axis::log("evaluations"), Axis::log("error")).curve("RK4", errors))
///     .to_svg();
/// assert!(svg.starts_with("<svg"));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    pub(crate) title: String,
    pub(crate) panels: Vec<Panel>,
    pub(crate) width: f64,
    pub(crate) panel_height: Option<f64>,
}

impl Chart {
    /// A chart without panels.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), panels: Vec::new(), width: 760.0, panel_height: None }
    }

    /// Adds a panel below the others.
    #[must_use]
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Width of the picture in pixels, 760 unless set; 320 to 4,000.
    #[must_use]
    pub fn width(mut self, pixels: f64) -> Self {
        self.width = if pixels.is_finite() { pixels.clamp(320.0, 4000.0) } else { 760.0 };
        self
    }

    /// Height of each panel's axes in pixels, 80 to 4,000; 380 for one panel and 190 for several unless set.
    #[must_use]
    pub fn panel_height(mut self, pixels: f64) -> Self {
        self.panel_height = pixels.is_finite().then(|| pixels.clamp(80.0, 4000.0));
        self
    }
}

impl From<Panel> for Chart {
    /// A chart of one panel without a title.
    fn from(panel: Panel) -> Self {
        Self::new("").panel(panel)
    }
}
