//! A study as tables, charts and files.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt::{self, Write};
use std::path::Path;

use dynamics_runtime::simulate::Simulate;
use dynamics_view::file::{self, FileError};
use dynamics_view::text::readable;
use dynamics_view::{Axis, Chart, Color, Mark, Panel, Series};

use super::errors::ErrorOf;
use super::study::{Cost, Point, RunMeasurement, Study, WorkPrecisionCurve};
use crate::page::{Page, PageSection};
use crate::runs::{PLOT_FLOOR_SHARE, repeats_in_words};
use crate::table::columns;

/// Errors of the table that compares curves.
const COMPARED_ERRORS: [f64; 5] = [1e-3, 1e-6, 1e-8, 1e-9, 1e-12];

const STUDY_LEGEND: &str = "Further to the left is faster, further down is more accurate. Solid curves are \
    this library's, dashed ones were measured with other solvers. The grey line is what the reference itself \
    may be wrong by; hollow signs lie below it and say no more than that. A sign that is pointed at says \
    which run it is.";

impl Page {
    /// Adds a study.
    #[must_use]
    pub fn study<M: Simulate>(self, study: &Study<'_, M>) -> Self {
        let mut section = PageSection::new(study.problem(), &study.heading(), STUDY_LEGEND)
            .list(study.sentences())
            .charts(study.panels());
        for (part, cost) in [
            (ErrorOf::State, Cost::Time),
            (ErrorOf::State, Cost::Evaluations),
            (ErrorOf::Positions, Cost::Time),
        ] {
            let (caption, rows) = study.compared(part, cost, &COMPARED_ERRORS);
            section = section.text(&caption).table(&rows);
        }
        self.section(section.folded_table("all runs", &study.rows()))
    }
}

impl ErrorOf {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::State, Self::Positions, Self::Velocities, Self::Multipliers, Self::Energy];

    fn name(self) -> &'static str {
        match self {
            Self::Positions => "positions",
            Self::Velocities => "velocities",
            Self::State => "positions and velocities",
            Self::Multipliers => "multipliers",
            Self::Energy => "energy",
        }
    }
}

impl fmt::Display for ErrorOf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl<M: Simulate> Study<'_, M> {
    /// Error against cost as one panel; costs in µs or in evaluations. Hollow markers are below the
    /// uncertainty of the reference. Dashed curves were measured elsewhere. Failed runs are counted beside
    /// the names, also if no run of a curve is left. A marker under the pointer shows its run.
    #[must_use]
    pub fn panel(&self, part: ErrorOf, cost: Cost) -> Panel {
        let (title, unit) = match cost {
            Cost::Time => ("time in µs", 1e6),
            Cost::Evaluations => ("evaluations of the accelerations", 1.0),
        };
        let floor = self.reference.uncertainty.of(part).unwrap_or(f64::NAN);
        let panel = Panel::new(Axis::log(title), Axis::log(format!("error of {part}")));
        let mut ends = (f64::INFINITY, 0.0f64);
        let mut series = Vec::new();
        for (k, curve) in self.curves.iter().enumerate() {
            let (points, labels): (Vec<_>, Vec<_>) = self.points(curve, part, cost, unit).into_iter().unzip();
            // Curves whose part was not measured are left out. Curves whose runs all failed stay in the
            // legend, or they would seem not to have been tried.
            if points.is_empty() && curve.points.iter().any(|point| point.outcome.is_ok()) {
                continue;
            }
            ends = points.iter().fold(ends, |(lo, hi), (x, _)| (lo.min(*x), hi.max(*x)));
            let line =
                Series::new(name_with_failures(curve), points).mark(Mark::LineAndPoints).hollow_below(floor);
            // Each curve has its colour in all panels. After a round of colours, signs change.
            let line = line.color(Color::cycle(k)).sign(k + k / 8).labels(labels);
            series.push(if curve.outside { line.dashed() } else { line.solid() });
        }
        let uncertainty = Series::new("uncertainty of the reference", [(ends.0, floor), (ends.1, floor)]);
        series.into_iter().chain([uncertainty.color(Color::Faint).solid()]).fold(panel, Panel::series)
    }

    /// The parts of the error that this study has.
    #[must_use]
    pub fn parts(&self) -> Vec<ErrorOf> {
        ErrorOf::ALL.into_iter().filter(|part| self.reference.uncertainty.of(*part).is_some()).collect()
    }

    /// All errors against time and against evaluations, one below the other.
    #[must_use]
    pub fn chart(&self) -> Chart {
        let chart = Chart::new(format!("{}: error against cost", self.problem)).panel_height(300.0);
        self.panels().into_iter().fold(chart, Chart::panel)
    }

    /// Each part of the error against time, and beside it against evaluations.
    fn panels(&self) -> Vec<Panel> {
        let both = |part| [Cost::Time, Cost::Evaluations].map(|cost| self.panel(part, cost));
        // Parts whose errors are all 0, such as multipliers of inactive constraints, have no place on a
        // logarithmic axis.
        let shown =
            |part: &ErrorOf| self.runs().any(|run| run.errors.of(*part).is_some_and(|error| error > 0.0));
        self.parts().into_iter().filter(shown).flat_map(both).collect()
    }

    /// Writes [`Study::chart`] as an SVG file, making the folders that the path needs.
    pub fn write_svg(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        self.chart().write_svg(path)
    }

    /// Writes charts and tables as one HTML page without network access, making the folders that the path
    /// needs.
    pub fn write_html(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        Page::new(format!("{}: error against cost", self.problem)).study(self).write_html(path)
    }

    /// Writes [`Study::json_lines`] into a file, making the folders that the path needs.
    pub fn write_json_lines(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        file::write(path.as_ref(), file::Content::JsonLines, self.json_lines().as_bytes())
    }

    /// What every curve costs down to each of the errors, and, where there are curves from elsewhere, the
    /// best own cost over the best of those: below 1 this library is the cheaper. Times are in µs.
    #[must_use]
    pub fn comparison(&self, part: ErrorOf, cost: Cost, errors: &[f64]) -> String {
        let (caption, mut rows) = self.compared(part, cost, errors);
        if let Some(corner) = rows.first_mut().and_then(|header| header.first_mut()) {
            *corner = caption;
        }
        columns(&rows)
    }

    /// [`Study::comparison`] as its caption and rows of text, with the errors in the first row.
    fn compared(&self, part: ErrorOf, cost: Cost, errors: &[f64]) -> (String, Vec<Vec<String>>) {
        let (what, unit) = match cost {
            Cost::Time => ("µs", 1e6),
            Cost::Evaluations => ("evaluations", 1.0),
        };
        let caption = format!("{}: {what} to an error of {part} of", self.problem);
        let row = |name: &str, cells: &dyn Fn(f64) -> String| -> Vec<String> {
            [name.to_string()].into_iter().chain(errors.iter().map(|error| cells(*error))).collect()
        };
        let cell = |value: Option<f64>, digits| {
            value.map_or_else(|| "–".to_string(), |value| readable(value, digits))
        };
        let cost = |curve: &WorkPrecisionCurve, error: f64| {
            let found = unit * self.cost_of(curve, part, error, cost)?;
            // Counts that are interpolated between two runs are rounded.
            Some(if cost == Cost::Evaluations { found.round() } else { found })
        };
        let mut rows = alloc::vec![row("", &|error| readable(error, 2))];
        rows.extend(self.curves.iter().map(|curve| row(&curve.name, &|error| cell(cost(curve, error), 3))));
        if self.curves.iter().any(|curve| curve.outside) {
            let best = |outside: bool, error: f64| {
                let curves = self.curves.iter().filter(|curve| curve.outside == outside);
                curves.filter_map(|curve| cost(curve, error)).min_by(f64::total_cmp)
            };
            let ratio = |error: f64| cell(best(false, error).zip(best(true, error)).map(|(a, b)| a / b), 2);
            rows.push(row("best own over best of the others", &ratio));
        }
        (caption, rows)
    }

    /// The runs as rows of text, the names of the columns first.
    fn rows(&self) -> Vec<Vec<String>> {
        let parts: Vec<ErrorOf> = self.parts().into_iter().filter(|part| *part != ErrorOf::State).collect();
        let names = parts.iter().map(|part| part.to_string());
        let tail = ["time in µs", "evaluations", "steps", "rejected"].map(String::from);
        let mut rows = alloc::vec![
            ["method", "tolerance"]
                .map(String::from)
                .into_iter()
                .chain(names)
                .chain(tail)
                .collect::<Vec<_>>()
        ];
        for curve in &self.curves {
            for point in &curve.points {
                let setting = readable(point.setting, 3);
                let setting = if curve.adaptive { setting } else { format!("h = {setting}") };
                let mut row = alloc::vec![curve.name.clone(), setting];
                match &point.outcome {
                    Ok(run) => {
                        row.extend(parts.iter().map(|part| self.error_text(*part, run.errors.of(*part))));
                        row.push(readable(run.time.as_nanos() as f64 * 1e-3, 4));
                        let counts = [run.evaluations, run.steps, run.rejected];
                        row.extend(
                            counts.map(|count| count.map_or_else(|| "–".into(), |count| count.to_string())),
                        );
                        if let Some(t) = run.stiff_at {
                            row.push(format!("stiff from t = {}", readable(t, 3)));
                        }
                    }
                    Err(reason) => row.push(format!("failed: {reason}")),
                }
                rows.push(row);
            }
        }
        rows
    }

    /// What the errors are measured against, in words.
    fn heading(&self) -> String {
        let (start, end) = self.interval;
        let mut text = format!(
            "{} from t = {} to {}: errors at the end against {}, uncertain by",
            self.problem,
            readable(start, 6),
            readable(end, 6),
            self.reference.how
        );
        for (i, part) in self.parts().into_iter().filter(|part| *part != ErrorOf::State).enumerate() {
            let value = self.reference.uncertainty.of(part).unwrap_or(f64::NAN);
            let _ = write!(text, "{} {} in {part}", if i == 0 { "" } else { "," }, readable(value, 2));
        }
        let _ = write!(text, "; {}", repeats_in_words(self.runs().filter_map(|run| run.repeats)));
        text
    }

    /// (cost, error) of the runs that succeeded and have both, with the label of each.
    fn points(
        &self,
        curve: &WorkPrecisionCurve,
        part: ErrorOf,
        cost: Cost,
        unit: f64,
    ) -> Vec<((f64, f64), String)> {
        let lowest = PLOT_FLOOR_SHARE * self.reference.uncertainty.of(part).unwrap_or(f64::NAN);
        let place = |point: &Point| {
            let run = point.outcome.as_ref().ok()?;
            // `max` would replace NaN by the floor: an error that was not measured is no small error.
            let error = run.errors.of(part).filter(|error| error.is_finite())?;
            Some(((unit * run.cost(cost)?, error.max(lowest)), self.label(curve, point.setting, run, part)))
        };
        curve.points.iter().filter_map(place).collect()
    }

    /// The label of a run, in one line.
    fn label(&self, curve: &WorkPrecisionCurve, setting: f64, run: &RunMeasurement, part: ErrorOf) -> String {
        let setting =
            if curve.adaptive { format!("tolerance {setting:e}") } else { format!("h = {setting:e}") };
        let (error, time) =
            (self.error_text(part, run.errors.of(part)), readable(run.time.as_nanos() as f64 * 1e-3, 3));
        let mut label = format!("{}, {setting}: error {error}, {time} µs", curve.name);
        for (count, what) in [(run.evaluations, "evaluations"), (run.steps, "steps")] {
            if let Some(count) = count {
                let _ = write!(label, ", {count} {what}");
            }
        }
        if let Some(t) = run.stiff_at {
            let _ = write!(label, ", stiff from t = {}", readable(t, 3));
        }
        label
    }

    fn error_text(&self, part: ErrorOf, error: Option<f64>) -> String {
        match (error, self.reference.uncertainty.of(part)) {
            (Some(0.0), Some(0.0)) => "0".into(),
            (Some(error), Some(floor)) if error <= floor => format!("< {}", readable(floor, 2)),
            (Some(error), _) if !error.is_nan() => readable(error, 3),
            _ => "–".into(),
        }
    }
}

impl<M: Simulate> fmt::Display for Study<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.heading())?;
        f.write_str(columns(&self.rows()).trim_end())?;
        self.sentences().iter().try_for_each(|sentence| write!(f, "\n{sentence}"))
    }
}

fn name_with_failures(curve: &WorkPrecisionCurve) -> String {
    match curve.points.iter().filter(|point| point.outcome.is_err()).count() {
        0 => curve.name.clone(),
        count if count == curve.points.len() => format!("{} (all {count} failed)", curve.name),
        count => format!("{} ({count} failed)", curve.name),
    }
}
