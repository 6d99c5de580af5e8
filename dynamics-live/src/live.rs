//! What a page is asked to be.

use std::path::Path;

use dynamics_runtime::methods;
use dynamics_runtime::model::{Portable, SimulationModel, State};
use dynamics_runtime::simulate::{Contact, Direction};
use dynamics_view::file::{self, Content};

use crate::data;
use crate::error::LiveError;
use crate::page;
use crate::plan;

/// Opens live pages of models.
pub trait OpenLive: SimulationModel + Portable {
    /// A page that simulates this model from `start`, in any browser:
    /// `model.live(start).write_html("pendulum.html")?`.
    fn live(&self, start: State<Self>) -> Live<'_, Self> {
        Live::new(self, start)
    }
}

impl<M: SimulationModel + Portable> OpenLive for M {}

/// A method that pages have. Those of [`methods`] that pages have, too, convert into it; the compiler refuses
/// the others. The implicit midpoint rule has this name alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PageMethod {
    /// Explicit Euler with a fixed step, to be seen failing.
    ExplicitEuler,
    /// Semi-implicit Euler with a fixed step.
    SemiImplicitEuler,
    /// Heun's method with a fixed step.
    Heun,
    /// The classical Runge–Kutta method with a fixed step.
    Rk4,
    /// Dormand–Prince 5(4), by tolerance.
    DormandPrince,
    /// DOP853, by tolerance.
    Dop853,
    /// The implicit midpoint rule with a fixed step, for stiff models.
    ImplicitMidpoint,
}

impl PageMethod {
    /// Whether it chooses its steps, by a tolerance.
    pub(crate) const fn is_adaptive(self) -> bool {
        matches!(self, Self::DormandPrince | Self::Dop853)
    }

    /// Its name in the scripts.
    pub(crate) const fn key(self) -> &'static str {
        match self {
            Self::ExplicitEuler => "explicit_euler",
            Self::SemiImplicitEuler => "euler",
            Self::Heun => "heun",
            Self::Rk4 => "rk4",
            Self::DormandPrince => "dp5",
            Self::Dop853 => "dop853",
            Self::ImplicitMidpoint => "midpoint",
        }
    }
}

macro_rules! from_methods {
    ($($method:ident => $page:ident),* $(,)?) => {$(
        impl From<methods::$method> for PageMethod {
            fn from(_: methods::$method) -> Self {
                Self::$page
            }
        }
    )*};
}

from_methods! {
    ExplicitEuler => ExplicitEuler,
    Heun => Heun,
    Rk4 => Rk4,
    DormandPrince5 => DormandPrince,
    Dop853 => Dop853,
    SemiImplicitEuler => SemiImplicitEuler,
}

/// A live page that can still be changed.
#[must_use]
pub struct Live<'a, M: SimulationModel + Portable> {
    pub(crate) model: &'a M,
    pub(crate) title: Option<String>,
    pub(crate) starts: Vec<(String, State<M>)>,
    pub(crate) ranges: Vec<(String, [f64; 2])>,
    pub(crate) held: Vec<String>,
    pub(crate) method: Option<PageMethod>,
    pub(crate) tolerance: Option<f64>,
    pub(crate) step: Option<f64>,
    pub(crate) plots: Vec<String>,
    pub(crate) phase: Option<String>,
    pub(crate) until: Option<f64>,
    pub(crate) contacts: Vec<(String, Contact)>,
    pub(crate) stick_slips: Vec<[String; 2]>,
    pub(crate) stops: Vec<(String, Direction)>,
}

impl<'a, M: SimulationModel + Portable> Live<'a, M> {
    /// A page of the model that begins at `start`.
    pub fn new(model: &'a M, start: State<M>) -> Self {
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
            contacts: Vec::new(),
            stick_slips: Vec::new(),
            stops: Vec::new(),
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

    /// A further start, which the reader takes by a button with this name.
    pub fn start(mut self, name: impl Into<String>, state: State<M>) -> Self {
        self.starts.push((name.into(), state));
        self
    }

    /// The ends of the slider of a parameter or an input, its value between them; the name of a field stands
    /// for all its elements. By default a positive parameter's goes from a tenth to ten times its value.
    pub fn range(mut self, name: impl Into<String>, from: f64, to: f64) -> Self {
        self.ranges.push((name.into(), [from, to]));
        self
    }

    /// Parameters or inputs that have no slider; the name of a field stands for all its elements.
    pub fn hold<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.held.extend(names.into_iter().map(Into::into));
        self
    }

    /// The method at the beginning; the reader may take another one. Default: Dormand–Prince 5(4).
    pub fn method(mut self, method: impl Into<PageMethod>) -> Self {
        self.method = Some(method.into());
        self
    }

    /// The tolerance at the beginning, of methods that choose their steps. Default 1e-8.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = Some(tolerance);
        self
    }

    /// The step at the beginning, of methods with a fixed step. By default the page takes a hundredth of a
    /// second of playing.
    pub fn step(mut self, step: f64) -> Self {
        self.step = Some(step);
        self
    }

    /// Quantities that are plotted over time: coordinates, velocities as `theta_rate` or `theta_rate[3]`,
    /// outputs, conserved quantities, powers, `energy`, `kinetic energy`, `potential energy`, reactions as
    /// `lambda[closure.x]`.
    pub fn plot<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.plots.extend(names.into_iter().map(Into::into));
        self
    }

    /// The coordinate of the phase plane at the beginning. Default: the first one.
    pub fn phase(mut self, coordinate: impl Into<String>) -> Self {
        self.phase = Some(coordinate.into());
        self
    }

    /// The time at which the motion ends; otherwise it goes on.
    pub fn until(mut self, end: f64) -> Self {
        self.until = Some(end);
        self
    }

    /// Makes a switched holonomic constraint unilateral, with a law of impact, as
    /// [`Simulation::contact`](dynamics_runtime::simulate::Simulation::contact) does.
    pub fn contact(mut self, constraint: impl Into<String>, law: impl Into<Contact>) -> Self {
        self.contacts.push((constraint.into(), law.into()));
        self
    }

    /// A switched nonholonomic constraint that holds until an event breaks it away, as
    /// [`Simulation::stick_slip`](dynamics_runtime::simulate::Simulation::stick_slip) does.
    pub fn stick_slip(mut self, constraint: impl Into<String>, event: impl Into<String>) -> Self {
        self.stick_slips.push([constraint.into(), event.into()]);
        self
    }

    /// Ends the motion at the first crossing of an event of the model in the given direction, as
    /// [`Simulation::stop_at`](dynamics_runtime::simulate::Simulation::stop_at) does.
    pub fn stop_at(mut self, event: impl Into<String>, direction: Direction) -> Self {
        self.stops.push((event.into(), direction));
        self
    }

    /// The data of the page, as the scripts read them. Public for the tests of the library alone.
    #[doc(hidden)]
    pub fn to_json(&self) -> Result<String, LiveError> {
        Ok(data::data(self, &plan::plan(self)?))
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
        Ok(page::page(self, &plan::plan(self)?))
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

/// A finished live page.
#[derive(Clone, Debug)]
pub struct LivePage {
    pub(crate) title: String,
    pub(crate) about: String,
    pub(crate) html: String,
}

impl LivePage {
    /// Its title.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.title
    }

    /// What it says about its model: the first paragraph of the comment on the struct.
    #[must_use]
    pub fn about(&self) -> &str {
        &self.about
    }

    /// The page as text.
    #[must_use]
    pub fn html(&self) -> &str {
        &self.html
    }

    /// Writes the page and creates the folders of its path.
    ///
    /// # Errors
    /// An extension other than `.html` or `.htm`; a file that cannot be written.
    pub fn write_html(&self, path: impl AsRef<Path>) -> Result<(), LiveError> {
        Ok(file::write(path.as_ref(), Content::Page, self.html.as_bytes())?)
    }
}
