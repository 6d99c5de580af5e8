//! A comparison as tables, charts and a page.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;
use std::path::Path;

use dynamics_view::file::FileError;
use dynamics_view::text::{readable, with_unit};
use dynamics_view::{Axis, Chart, Color, Mark, Panel, Series};

use super::comparison::{Compared, Comparison, Difference, RungReport};
use super::error::LadderError;
use super::verdict::{Verdict, percent};
use crate::page::{Page, PageSection};
use crate::runs::{PLOT_FLOOR_SHARE, repeats_in_words};
use crate::table::columns;

/// Accuracies for which a page says which rung suffices.
const ASKED_ACCURACIES: [f64; 3] = [0.1, 0.01, 0.001];

const COMPARISON_LEGEND: &str = "Differences are those from the fullest model; it stands at its own \
    numerical error. Hollow signs lie below the numerical errors of the runs: there the models agree as far \
    as can be told.";

impl Page {
    /// Adds a comparison of models.
    #[must_use]
    pub fn comparison(self, comparison: &Comparison) -> Self {
        let mut section = PageSection::new(comparison.scene(), &comparison.heading(), COMPARISON_LEGEND)
            .list(comparison.notes().into_iter().chain(comparison.sentences()));
        // Each output begins a row.
        for panels in comparison.outputs().iter().filter_map(|output| comparison.panels(&output.name)) {
            section = section.charts(panels);
        }
        self.section(section.table(&comparison.rows()))
    }
}

impl Comparison {
    /// The rungs with their cost and differences, as text in columns.
    #[must_use]
    pub fn table(&self) -> String {
        columns(&self.rows())
    }

    /// The plainest rung that suffices for 10 %, 1 % and 0.1 %: one sentence if it is the same for all
    /// outputs, else one for each. If the runs do not decide, the sentence says so.
    #[must_use]
    pub fn sentences(&self) -> Vec<String> {
        let mut sentences = Vec::new();
        for accuracy in ASKED_ACCURACIES {
            let verdicts = self.outputs.iter().map(|output| self.sufficient_for(&output.name, accuracy));
            let mut verdicts: Vec<Result<Verdict, LadderError>> = verdicts.collect();
            let rung = |verdict: &Result<Verdict, LadderError>| {
                verdict.as_ref().ok().map(|verdict| verdict.rung.clone())
            };
            if verdicts.iter().all(|verdict| verdict.is_ok() && rung(verdict) == rung(&verdicts[0])) {
                verdicts = alloc::vec![self.sufficient(accuracy)];
            }
            sentences.extend(verdicts.into_iter().map(|verdict| match verdict {
                Ok(verdict) => verdict.to_string(),
                Err(error) => error.to_string(),
            }));
        }
        sentences.dedup();
        sentences
    }

    /// For an output: its values over time; its differences from the last rung over time; the largest of them
    /// over the time that a rung takes.
    ///
    /// Hollow markers are below the numerical errors of the runs. The last rung is shown with its own
    /// numerical error.
    #[must_use]
    pub fn panels(&self, output: &str) -> Option<[Panel; 3]> {
        let o = self.outputs.iter().position(|known| known.name == output)?;
        Some([self.values(o), self.over_time(o), self.against_cost(o)])
    }

    /// All panels of all outputs, one below the other.
    #[must_use]
    pub fn chart(&self) -> Chart {
        let chart = Chart::new(format!("{}: models beside each other", self.scene)).panel_height(240.0);
        let panels = self.outputs.iter().filter_map(|output| self.panels(&output.name));
        panels.flatten().fold(chart, Chart::panel)
    }

    /// Writes [`Comparison::chart`] as an SVG file, making the folders that the path needs.
    pub fn write_svg(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        self.chart().write_svg(path)
    }

    /// Writes charts, table and sentences as one HTML page without network access, making the folders that
    /// the path needs.
    pub fn write_html(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        Page::new(format!("{}: models beside each other", self.scene)).comparison(self).write_html(path)
    }

    /// What is compared with what, in words.
    fn heading(&self) -> String {
        let (start, end) = self.interval;
        format!(
            "{} from t = {} to {} at tolerance {:e}: differences from `{}`, the fullest of {} models, at {} \
             times; {}",
            self.scene,
            readable(start, 6),
            readable(end, 6),
            self.tolerance,
            self.full().name,
            self.rungs.len(),
            self.times.len(),
            repeats_in_words(self.rungs.iter().map(|rung| rung.repeats))
        )
    }

    /// The rungs as rows of text, the names of the columns first.
    fn rows(&self) -> Vec<Vec<String>> {
        let names = ["model", "coordinates", "constraints", "operations", "evaluations", "time in µs"];
        let mut header: Vec<String> = names.map(String::from).into();
        for output in &self.outputs {
            header.extend([with_unit(&output.name, &output.unit), "rms".into(), "part".into()]);
        }
        let mut rows = alloc::vec![header];
        for (k, rung) in self.rungs.iter().enumerate() {
            let operations = rung.operations.map_or_else(|| "–".into(), |count| count.to_string());
            let mut row =
                alloc::vec![rung.name.clone(), rung.coordinates.to_string(), rung.constraints.to_string()];
            row.extend([
                operations,
                rung.evaluations.to_string(),
                readable(rung.time.as_nanos() as f64 * 1e-3, 4),
            ]);
            let is_full = k + 1 == self.rungs.len();
            for (output, difference) in self.outputs.iter().zip(&rung.differences) {
                row.extend(if is_full { own_error(output, difference) } else { cells(output, difference) });
            }
            rows.push(row);
        }
        rows
    }

    /// Notes on differences that exist at the start already.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for rung in &self.rungs {
            for (output, difference) in self.outputs.iter().zip(&rung.differences) {
                if difference.at_start > difference.uncertainty.max(0.5 * difference.largest) {
                    notes.push(format!(
                        "`{}` differs in {} by {} at the start already: it is the models, or the starts do \
                         not correspond",
                        rung.name,
                        output.name,
                        readable(difference.at_start, 2)
                    ));
                }
            }
        }
        notes
    }

    fn series(&self, k: usize, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
        Series::new(self.rungs[k].name.clone(), points).color(Color::cycle(k)).sign(k).solid()
    }

    /// The title of the time axis. Units of outputs are of one coherent system, in which time is in seconds.
    fn time_title(&self) -> String {
        let known = self.outputs.iter().any(|output| !output.unit.is_empty());
        with_unit("time", if known { "s" } else { "" })
    }

    fn values(&self, o: usize) -> Panel {
        let output = &self.outputs[o];
        let panel =
            Panel::new(Axis::new(self.time_title()), Axis::new(with_unit(&output.name, &output.unit)));
        let curve = |(k, rung): (usize, &RungReport)| {
            self.series(k, self.times.iter().copied().zip(rung.values[o].iter().copied()))
        };
        self.rungs.iter().enumerate().map(curve).fold(panel, Panel::series)
    }

    fn over_time(&self, o: usize) -> Panel {
        let output = &self.outputs[o];
        let title = with_unit(&format!("difference of {}", output.name), &output.unit);
        let panel = Panel::new(Axis::new(self.time_title()), Axis::log(title));
        let full = &self.full().values[o];
        let plainer = self.rungs[..self.rungs.len() - 1].iter().enumerate();
        plainer
            .map(|(k, rung)| {
                let lowest = PLOT_FLOOR_SHARE * rung.differences[o].uncertainty;
                let apart = rung.values[o].iter().zip(full).map(|(a, b)| (a - b).abs().max(lowest));
                self.series(k, self.times.iter().copied().zip(apart))
            })
            .fold(panel, Panel::series)
    }

    fn against_cost(&self, o: usize) -> Panel {
        let output = &self.outputs[o];
        let title = format!("largest difference, part of {}", output.name);
        let panel = Panel::new(Axis::log("time in µs"), Axis::log(title));
        let point = |(k, rung): (usize, &RungReport)| {
            let Difference { largest, uncertainty, .. } = rung.differences[o];
            let floor = uncertainty / output.scale;
            let place = (1e6 * rung.time.as_secs_f64(), (largest / output.scale).max(floor));
            self.series(k, [place]).mark(Mark::Points).hollow_below(floor)
        };
        self.rungs.iter().enumerate().map(point).fold(panel, Panel::series)
    }
}

/// Largest difference, root mean square, part of the output.
fn cells(output: &Compared, difference: &Difference) -> [String; 3] {
    let Difference { largest, rms, uncertainty, .. } = *difference;
    if !difference.is_believed() {
        let bound = difference.bound();
        return [
            format!("< {}", readable(bound, 2)),
            "–".into(),
            format!("< {}", percent(bound / output.scale)),
        ];
    }
    let rms = if rms > uncertainty { readable(rms, 3) } else { format!("< {}", readable(uncertainty, 2)) };
    [readable(largest, 3), rms, percent(largest / output.scale)]
}

/// The last rung differs from itself by nothing; what counts is its own error.
fn own_error(output: &Compared, difference: &Difference) -> [String; 3] {
    let error = difference.uncertainty;
    [format!("± {}", readable(error, 2)), "–".into(), format!("± {}", percent(error / output.scale))]
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.heading())?;
        f.write_str(self.table().trim_end())?;
        self.notes().iter().try_for_each(|note| write!(f, "\n{note}"))
    }
}
