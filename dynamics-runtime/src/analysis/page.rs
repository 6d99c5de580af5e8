//! Studies, comparisons and bifurcation diagrams on one HTML page without network access.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;
use std::path::Path;

use super::continuation::Diagram;
use super::ladder::Comparison;
use super::work_precision::{Cost, ErrorOf, Study};
use crate::model::ModelState;
use crate::motion::Simulate;
use crate::output::file::{self, FileError};
use crate::output::text::xml;
use crate::output::{Chart, Panel};

/// Width of charts in pixels: where there is room, and on telephones, where a wide one would be shrunk with
/// its letters.
const WIDE: f64 = 560.0;
const NARROW: f64 = 350.0;
/// Errors of the table that compares curves.
const COMPARED: [f64; 5] = [1e-3, 1e-6, 1e-8, 1e-9, 1e-12];

/// A page of several studies, with charts, what each curve costs for the same errors, and all runs, and of
/// models beside each other.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    sections: Vec<String>,
}

impl Page {
    /// A page without studies.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), sections: Vec::new() }
    }

    /// Adds a paragraph: on which machine it was measured, what to look at.
    #[must_use]
    pub fn text(mut self, text: &str) -> Self {
        let mut html = String::new();
        let _ = writeln!(html, "<p>{}</p>", xml(text));
        self.sections.push(html);
        self
    }

    /// Adds a study.
    #[must_use]
    pub fn study<M: Simulate>(mut self, study: &Study<'_, M>) -> Self {
        let mut html = String::new();
        open_section(&mut html, study.problem(), &study.heading(), STUDY_LEGEND);
        list(&mut html, study.sentences());
        charts(&mut html, study.panels());
        for (part, cost) in [
            (ErrorOf::State, Cost::Time),
            (ErrorOf::State, Cost::Evaluations),
            (ErrorOf::Positions, Cost::Time),
        ] {
            let (caption, rows) = study.compared(part, cost, &COMPARED);
            let _ = writeln!(html, "<p>{}</p>", xml(&caption));
            table(&mut html, &rows);
        }
        html.push_str("<details><summary>all runs</summary>\n");
        table(&mut html, &study.rows());
        html.push_str("</details>\n</section>\n");
        self.sections.push(html);
        self
    }

    /// Adds a section of panels with words to them.
    #[must_use]
    pub fn panels(mut self, title: &str, words: &str, panels: impl IntoIterator<Item = Panel>) -> Self {
        let mut html = String::new();
        open_section(&mut html, title, words, "");
        charts(&mut html, panels);
        html.push_str("</section>\n");
        self.sections.push(html);
        self
    }

    /// Adds branches of equilibria: panels of them (see [`Diagram::panel`]), and their special points as a
    /// table.
    #[must_use]
    pub fn diagram<S: ModelState>(
        mut self,
        title: &str,
        diagram: &Diagram<S>,
        panels: impl IntoIterator<Item = Panel>,
    ) -> Self {
        let mut html = String::new();
        open_section(&mut html, title, &diagram.heading(), DIAGRAM_LEGEND);
        charts(&mut html, panels);
        table(&mut html, &diagram.rows());
        html.push_str("</section>\n");
        self.sections.push(html);
        self
    }

    /// Adds models beside each other.
    #[must_use]
    pub fn comparison(mut self, comparison: &Comparison) -> Self {
        let mut html = String::new();
        open_section(&mut html, comparison.scene(), &comparison.heading(), COMPARISON_LEGEND);
        list(&mut html, comparison.notes().into_iter().chain(comparison.sentences()));
        // Each output begins a row.
        for panels in comparison.outputs().iter().filter_map(|output| comparison.panels(&output.name)) {
            charts(&mut html, panels);
        }
        table(&mut html, &comparison.rows());
        html.push_str("</section>\n");
        self.sections.push(html);
        self
    }

    /// The page as text.
    #[must_use]
    pub fn to_html(&self) -> String {
        let title = xml(&self.title);
        let mut html =
            String::from("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
        html.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
        let _ = writeln!(
            html,
            "<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>"
        );
        for section in &self.sections {
            html.push_str(section);
        }
        html.push_str("</body>\n</html>\n");
        html
    }

    /// Writes the page, making the folders that the path needs.
    pub fn write_html(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        file::write(path.as_ref(), file::Content::Page, self.to_html().as_bytes())
    }
}

fn open_section(html: &mut String, title: &str, heading: &str, legend: &str) {
    let _ = writeln!(html, "<section>\n<h2>{}</h2>\n<p>{}</p>", xml(title), xml(heading));
    if !legend.is_empty() {
        let _ = writeln!(html, "<p>{legend}</p>");
    }
}

fn charts(html: &mut String, panels: impl IntoIterator<Item = Panel>) {
    let chart = |panel, width| Chart::new("").panel_height(340.0).panel(panel).width(width).to_svg();
    html.push_str("<div class=\"charts\">\n");
    for panel in panels {
        let (wide, narrow) = (chart(panel.clone(), WIDE), chart(panel.without_labels(), NARROW));
        let _ = writeln!(
            html,
            "<figure><div class=\"wide\">{wide}</div><div class=\"narrow\">{narrow}</div></figure>"
        );
    }
    html.push_str("</div>\n");
}

fn list(html: &mut String, sentences: impl IntoIterator<Item = String>) {
    html.push_str("<ul>\n");
    for sentence in sentences {
        let _ = writeln!(html, "<li>{}</li>", xml(&sentence));
    }
    html.push_str("</ul>\n");
}

/// Rows of text, the names of the columns first.
fn table(html: &mut String, rows: &[Vec<String>]) {
    html.push_str("<table>\n");
    let columns = rows.first().map_or(0, Vec::len);
    for (i, row) in rows.iter().enumerate() {
        table_row(html, row, if i == 0 { "th" } else { "td" }, columns);
    }
    html.push_str("</table>\n");
}

/// A row that ends early says something in words, which does not widen the column where it begins; what goes
/// beyond the columns stands beside them.
fn table_row(html: &mut String, row: &[String], cell: &str, columns: usize) {
    html.push_str("<tr>");
    for (i, text) in row.iter().enumerate() {
        let left = columns.saturating_sub(i);
        let words = i + 1 == row.len() && left > 1;
        let span = match words {
            true => format!(" class=\"words\" colspan=\"{left}\""),
            false if i >= columns => String::from(" class=\"beside\""),
            false => String::new(),
        };
        let _ = write!(html, "<{cell}{span}>{}</{cell}>", xml(text));
    }
    html.push_str("</tr>\n");
}

const DIAGRAM_LEGEND: &str = "Solid curves stay, dashed ones do not: small disturbances grow. Grey is what \
    linear theory leaves undecided. Signs stand where equilibria appear, vanish or change their stability.";

const STUDY_LEGEND: &str = "Further to the left is faster, further down is more accurate. Solid curves are \
    this library's, dashed ones were measured with other solvers. The grey line is what the reference itself \
    may be wrong by; hollow signs lie below it and say no more than that. A sign that is pointed at says \
    which run it is.";

const COMPARISON_LEGEND: &str = "Differences are those from the fullest model; it stands at its own \
    numerical error. Hollow signs lie below the numerical errors of the runs: there the models agree as far \
    as can be told.";

const STYLE: &str = "body{font:15px/1.5 system-ui,'Segoe UI','DejaVu Sans',Arial,sans-serif;color:#1d2530;background:#fff;margin:1.5rem auto;max-width:1300px;padding:0 1rem}.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(440px,100%),1fr));gap:.5rem}figure{margin:0}svg{max-width:100%;height:auto}table{display:block;font-size:13px;overflow-x:auto;border-collapse:collapse}td,th{padding:.1rem .7rem;text-align:right;border-bottom:1px solid #dde2e7}td:first-child,th:first-child{text-align:left;position:sticky;left:0;background:#fff}td,th{white-space:nowrap}td.words{text-align:left;white-space:normal}td.beside{text-align:left}h2{margin-top:2rem}p,li{overflow-wrap:anywhere}.narrow{display:none}@media(max-width:560px){td,th{padding:.1rem .35rem}td:first-child{white-space:normal}.wide{display:none}.narrow{display:block}body{margin-top:.5rem}ul{padding-left:1.2rem}}";
