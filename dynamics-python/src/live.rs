//! `LivePage`: a page that simulates a model in the browser, and in the cell of a notebook.

use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

/// A live page: one file that simulates the model in any browser. In a notebook its cell shows the model
/// moving. `write(path)` writes the file, `html` is its text.
#[pyclass(frozen, module = "dynamics")]
#[derive(Debug)]
pub struct LivePage {
    html: String,
    height: u32,
}

impl LivePage {
    pub(crate) fn new(html: String, height: u32) -> Self {
        Self { html, height }
    }
}

/// A page inside of another one, without any right to touch it.
pub(crate) fn framed(html: &str, height: u32) -> String {
    let text = html.replace('&', "&amp;").replace('"', "&quot;");
    format!(
        "<iframe sandbox=\"allow-scripts allow-downloads\" style=\"width:100%;height:{height}px;border:0\" \
         srcdoc=\"{text}\"></iframe>"
    )
}

#[pymethods]
impl LivePage {
    /// The page as text.
    #[getter]
    fn html(&self) -> &str {
        &self.html
    }

    /// Writes the page and makes the folders of its path.
    fn write(&self, path: std::path::PathBuf) -> PyResult<()> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        folder.map_or(Ok(()), std::fs::create_dir_all)?;
        std::fs::write(&path, &self.html)
            .map_err(|error| PyOSError::new_err(format!("{}: {error}", path.display())))
    }

    fn _repr_html_(&self) -> String {
        framed(&self.html, self.height)
    }

    fn __repr__(&self) -> String {
        format!(
            "<live page of {} kB; in a notebook it moves, .write(path) makes a file>",
            self.html.len() / 1000
        )
    }
}
