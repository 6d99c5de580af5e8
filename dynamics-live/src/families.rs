//! Live pages of models with families.
//!
//! The builder has the words of [`Live`](crate::Live) as far as such models have what they say: there are no
//! contacts and no events. What a page cannot hold is refused before a file exists, a fixed step beyond the
//! longest one with its bound.

mod data;
mod plan;

use std::path::Path;

use dynamics_families::FamilyMethod;
use dynamics_families::portable::PortableFamily;
use dynamics_view::file::{self, Content};

use crate::error::LiveError;
use crate::live::LivePage;
use crate::page::{Sheet, sheet};
use crate::scripts::Parts;

/// Opens live pages of models with families.
pub trait OpenFamilyLive: PortableFamily {
    /// A page that simulates this model from `start`, in any browser:
    /// `model.live(start).write_html("bar.html")?`.
    fn live(&self, start: Self::State) -> FamilyLive<'_, Self> {
        FamilyLive::new(self, start)
    }
}

impl<M: PortableFamily> OpenFamilyLive for M {}

/// A live page of a model with families that can still be changed.
#[must_use]
pub struct FamilyLive<'a, M: PortableFamily> {
    model: &'a M,
    title: Option<String>,
    starts: Vec<(String, M::State)>,
    ranges: Vec<(String, [f64; 2])>,
    held: Vec<String>,
    method: Option<FamilyMethod>,
    tolerance: Option<f64>,
    step: Option<f64>,
    plots: Vec<String>,
    phase: Option<String>,
    until: Option<f64>,
}

impl<'a, M: PortableFamily> FamilyLive<'a, M> {
    /// A page of the model that begins at `start`.
    pub fn new(model: &'a M, start: M::State) -> Self {
        Self {
            model,
            title: None,
            starts: vec![("as given".to_owned(), start)],
            ranges: Vec::new(),
            held: Vec::new(),
            method: None,
            tolerance: None,
            step: None,
            plots: Vec::new(),
            phase: None,
            until: None,
        }
    }

    /// The page's title instead of the model's name.
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = Some(title.into());
        self
    }

    /// What the button of the first start says, where there are several.
    pub fn first_start(mut self, name: impl Into<String>) -> Self {
        self.starts[0].0 = name.into();
        self
    }

    /// A further start, which the reader takes by a button with this name. Nodes have no sliders: other
    /// starts come by these buttons, or by dragging a node.
    pub fn start(mut self, name: impl Into<String>, state: M::State) -> Self {
        self.starts.push((name.into(), state));
        self
    }

    /// The ends of the slider of a scalar parameter or an input, its value between them. By default a
    /// positive parameter's goes from a tenth to ten times its value. Counts and numbered parameters have no
    /// sliders.
    pub fn range(mut self, name: impl Into<String>, from: f64, to: f64) -> Self {
        self.ranges.push((name.into(), [from, to]));
        self
    }

    /// Scalar parameters or inputs that have no slider.
    pub fn hold<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.held.extend(names.into_iter().map(Into::into));
        self
    }

    /// The method at the beginning; the reader may take another one. Default: Störmer–Verlet where forces
    /// have no velocities, else Dormand–Prince 5(4). Pages have these two, RK4, DOP853, and the implicit
    /// midpoint rule.
    pub fn method(mut self, method: impl Into<FamilyMethod>) -> Self {
        self.method = Some(method.into());
        self
    }

    /// The tolerance at the beginning, of methods that choose their steps. Default 1e-6.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = Some(tolerance);
        self
    }

    /// The step at the beginning, of methods with a fixed step. By default the page takes a hundredth of a
    /// second of playing, and at most half of the longest step.
    pub fn step(mut self, step: f64) -> Self {
        self.step = Some(step);
        self
    }

    /// Quantities that are plotted over time: nodes as `s[3]` or `w[2][3]`, their velocities as `s_rate[3]`,
    /// ordinary coordinates, outputs, numbered outputs as `normal_force[3]`, `power`, `energy`,
    /// `kinetic energy`, `potential energy`.
    pub fn plot<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.plots.extend(names.into_iter().map(Into::into));
        self
    }

    /// The coordinate of the phase plane at the beginning. Default: the node in the middle of the first
    /// family.
    pub fn phase(mut self, coordinate: impl Into<String>) -> Self {
        self.phase = Some(coordinate.into());
        self
    }

    /// The time at which the motion ends; otherwise it goes on.
    pub fn until(mut self, end: f64) -> Self {
        self.until = Some(end);
        self
    }

    /// The programs of the page and its data, as the scripts read them. Public for the tests of the library
    /// alone.
    #[doc(hidden)]
    pub fn to_scripts(&self) -> Result<[String; 2], LiveError> {
        let plan = plan::plan(self)?;
        Ok([data::programs(self.model), data::data(self, &plan)])
    }

    /// The page as text.
    ///
    /// # Errors
    /// What does not fit into a page, by name.
    pub fn to_html(&self) -> Result<String, LiveError> {
        Ok(self.finish()?.html)
    }

    /// The finished page, which does not borrow the model: for [galleries](crate::Gallery), and to be written
    /// later.
    ///
    /// # Errors
    /// What does not fit into a page, by name.
    pub fn finish(&self) -> Result<LivePage, LiveError> {
        let plan = plan::plan(self)?;
        let title = self.title.clone().unwrap_or_else(|| crate::data::words(M::NAME));
        Ok(sheet(&Sheet {
            title: &title,
            documentation: M::DOCUMENTATION,
            equations: M::MATHML,
            programs: &data::programs(self.model),
            data: &data::data(self, &plan),
            parts: Parts { constraints: false, kinks: false, events: false, families: true },
            in_space: M::SPATIAL,
        }))
    }

    /// Writes the page and creates the folders of its path. Nothing is written where the model or a choice
    /// does not fit into a page.
    ///
    /// # Errors
    /// What does not fit into a page, by name; an extension other than `.html` or `.htm`; a file that cannot
    /// be written.
    pub fn write_html(&self, path: impl AsRef<Path>) -> Result<(), LiveError> {
        let path = path.as_ref();
        file::check(path, Content::Page)?;
        self.finish()?.write_html(path)
    }
}
