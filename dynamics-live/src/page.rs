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

/// The finished page.
pub(crate) fn page<M: SimulationModel + Portable>(live: &Live<'_, M>, plan: &Plan) -> LivePage {
    let data = data::data(live, plan);
    let title = data::title(live);
    let about = first_paragraph(M::DOCUMENTATION).to_owned();
    let parts = Parts {
        constraints: !M::ROWS.is_empty(),
        kinks: M::HAS_KINKS,
        events: !(M::EVENTS.is_empty() && live.contacts.is_empty() && live.stick_slips.is_empty()),
    };
    let html = fill(
        include_str!("page/page.html"),
        &[
            ("title", &xml(&title)),
            ("about", &xml(&about)),
            ("style", &style()),
            ("equations", M::MATHML),
            ("programs", M::JAVASCRIPT),
            ("model", &data),
            ("packed", &packed(parts, M::SPATIAL)),
        ],
    );
    LivePage { title, about, html }
}

/// What a page says of a model under its title.
fn first_paragraph(documentation: &str) -> &str {
    documentation.split("\n\n").next().unwrap_or_default()
}
