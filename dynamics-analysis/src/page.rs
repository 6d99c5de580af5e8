//! Sections of text, charts and tables on one HTML page without network access. The content of a section is
//! written where its study, comparison or branch is.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;
use std::path::Path;

use dynamics_view::file::{self, FileError};
use dynamics_view::text::xml;
use dynamics_view::{Chart, Panel};

/// Width of charts in pixels: where there is room, and on telephones, where a wide one would be shrunk with
/// its letters.
const WIDE: f64 = 560.0;
const NARROW: f64 = 350.0;

/// A page with several studies and comparisons of models. A study has its charts, the costs of its curves for
/// the same errors, and all runs.
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

    /// Adds a section of panels with words to them.
    #[must_use]
    pub fn panels(self, title: &str, words: &str, panels: impl IntoIterator<Item = Panel>) -> Self {
        self.section(PageSection::new(title, words, "").charts(panels))
    }

    /// Adds a section.
    pub(super) fn section(mut self, section: PageSection) -> Self {
        self.sections.push(section.html + "</section>\n");
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

/// A section of a page: its title and words, then what is added, in this order.
pub(super) struct PageSection {
    html: String,
}

impl PageSection {
    /// A section with its title and how to read it (left out if empty).
    pub(super) fn new(title: &str, heading: &str, legend: &str) -> Self {
        let mut html = String::new();
        let _ = writeln!(html, "<section>\n<h2>{}</h2>\n<p>{}</p>", xml(title), xml(heading));
        if !legend.is_empty() {
            let _ = writeln!(html, "<p>{legend}</p>");
        }
        Self { html }
    }

    /// Adds a paragraph.
    pub(super) fn text(mut self, text: &str) -> Self {
        let _ = writeln!(self.html, "<p>{}</p>", xml(text));
        self
    }

    /// Adds sentences, one below the other.
    pub(super) fn list(mut self, sentences: impl IntoIterator<Item = String>) -> Self {
        self.html.push_str("<ul>\n");
        for sentence in sentences {
            let _ = writeln!(self.html, "<li>{}</li>", xml(&sentence));
        }
        self.html.push_str("</ul>\n");
        self
    }

    /// Adds a row of panels, each as a chart of its own.
    pub(super) fn charts(mut self, panels: impl IntoIterator<Item = Panel>) -> Self {
        let chart = |panel, width| Chart::new("").panel_height(340.0).panel(panel).width(width).to_svg();
        self.html.push_str("<div class=\"charts\">\n");
        for panel in panels {
            let (wide, narrow) = (chart(panel.clone(), WIDE), chart(panel.without_labels(), NARROW));
            let _ = writeln!(
                self.html,
                "<figure><div class=\"wide\">{wide}</div><div class=\"narrow\">{narrow}</div></figure>"
            );
        }
        self.html.push_str("</div>\n");
        self
    }

    /// Adds a table: rows of text, the names of the columns first.
    pub(super) fn table(mut self, rows: &[Vec<String>]) -> Self {
        self.html.push_str("<table>\n");
        let columns = rows.first().map_or(0, Vec::len);
        for (i, row) in rows.iter().enumerate() {
            table_row(&mut self.html, row, if i == 0 { "th" } else { "td" }, columns);
        }
        self.html.push_str("</table>\n");
        self
    }

    /// Adds a table that is shown when its title is clicked.
    pub(super) fn folded_table(mut self, title: &str, rows: &[Vec<String>]) -> Self {
        let _ = writeln!(self.html, "<details><summary>{}</summary>", xml(title));
        self = self.table(rows);
        self.html.push_str("</details>\n");
        self
    }
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

const STYLE: &str = "\
    body{font:15px/1.5 system-ui,'Segoe UI','DejaVu Sans',Arial,sans-serif;color:#1d2530;background:#fff;\
    margin:1.5rem auto;max-width:1300px;padding:0 1rem}\
    .charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(440px,100%),1fr));gap:.5rem}\
    figure{margin:0}svg{max-width:100%;height:auto}\
    table{display:block;font-size:13px;overflow-x:auto;border-collapse:collapse}\
    td,th{padding:.1rem .7rem;text-align:right;border-bottom:1px solid #dde2e7}\
    td:first-child,th:first-child{text-align:left;position:sticky;left:0;background:#fff}\
    td,th{white-space:nowrap}td.words{text-align:left;white-space:normal}td.beside{text-align:left}\
    h2{margin-top:2rem}p,li{overflow-wrap:anywhere}.narrow{display:none}\
    @media(max-width:560px){td,th{padding:.1rem .35rem}td:first-child{white-space:normal}\
    .wide{display:none}.narrow{display:block}body{margin-top:.5rem}ul{padding-left:1.2rem}}";
