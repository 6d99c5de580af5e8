//! The page: programs, data and scripts put into the template.
//!
//! Programs and data stand in it as text, to be read. The library's own scripts are packed: they are nine
//! tenths of a page, and the same in all.

use dynamics_runtime::model::{Portable, SimulationModel};
use dynamics_view::text::fill;
use dynamics_view::text::xml;

use crate::data;
use crate::live::{Live, LivePage};
use crate::plan::Plan;
use crate::scripts::{Parts, packed, style};

/// What a page is made of.
pub(crate) struct Sheet<'a> {
    pub(crate) title: &'a str,
    pub(crate) documentation: &'static str,
    /// In MathML.
    pub(crate) equations: &'a str,
    pub(crate) programs: &'a str,
    pub(crate) data: &'a str,
    pub(crate) parts: Parts,
    pub(crate) in_space: bool,
}

/// The finished page.
pub(crate) fn page<M: SimulationModel + Portable>(live: &Live<'_, M>, plan: &Plan) -> LivePage {
    sheet(&Sheet {
        title: &data::title(live),
        documentation: M::DOCUMENTATION,
        equations: M::MATHML,
        programs: M::JAVASCRIPT,
        data: &data::data(live, plan),
        parts: Parts {
            constraints: !M::ROWS.is_empty(),
            kinks: M::HAS_KINKS,
            events: !(M::EVENTS.is_empty() && live.contacts.is_empty() && live.stick_slips.is_empty()),
            families: false,
        },
        in_space: M::SPATIAL,
    })
}

/// The page of a sheet.
pub(crate) fn sheet(of: &Sheet<'_>) -> LivePage {
    let about = first_paragraph(of.documentation).to_owned();
    let html = fill(
        include_str!("page/page.html"),
        &[
            ("title", &xml(of.title)),
            ("about", &xml(&about)),
            ("style", &style()),
            ("equations", of.equations),
            ("programs", of.programs),
            ("model", of.data),
            ("packed", &packed(of.parts, of.in_space)),
        ],
    );
    LivePage { title: of.title.to_owned(), about, html }
}

/// What a page says of a model under its title.
fn first_paragraph(documentation: &str) -> &str {
    documentation.split("\n\n").next().unwrap_or_default()
}
