//! The page: programs, data and scripts put into the template.

use dynamics_runtime::model::{Portable, SimulationModel};
use dynamics_view::text::fill;
use dynamics_view::text::xml;

use crate::data;
use crate::error::LiveError;
use crate::live::Live;
use crate::scripts::{Parts, motion_script_of, page_script, style};

/// The page as text.
pub(crate) fn page<M: SimulationModel + Portable>(live: &Live<'_, M>) -> Result<String, LiveError> {
    let data = data::data(live);
    let title = data::title(live);
    let parts = Parts {
        constraints: !M::ROWS.is_empty(),
        // As the programs have it: the library follows no more than some kinks of a model.
        kinks: M::JAVASCRIPT.contains("kink_functions"),
        events: !(M::EVENTS.is_empty() && live.contacts.is_empty() && live.stick_slips.is_empty()),
    };
    Ok(fill(
        include_str!("page/page.html"),
        &[
            ("title", &xml(&title)),
            ("about", &xml(first_paragraph(M::DOCUMENTATION))),
            ("style", &style()),
            ("equations", M::MATHML),
            ("motion", &motion_script_of(parts)),
            ("programs", M::JAVASCRIPT),
            ("model", &data),
            ("page", &page_script(true)),
        ],
    ))
}

/// What a page says of a model under its title.
fn first_paragraph(documentation: &str) -> &str {
    documentation.split("\n\n").next().unwrap_or_default()
}
