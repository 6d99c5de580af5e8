//! The page: programs, data and scripts put into the template.

use dynamics_runtime::model::{Portable, SimulationModel};
use dynamics_view::text::fill;
use dynamics_view::text::xml;

use crate::data;
use crate::error::LiveError;
use crate::live::Live;
use crate::scripts::motion_script;

/// The page as text.
pub(crate) fn page<M: SimulationModel + Portable>(live: &Live<'_, M>) -> Result<String, LiveError> {
    let data = data::data(live);
    let title = live.title.clone().unwrap_or_else(|| M::NAME.to_owned());
    Ok(fill(
        include_str!("page/page.html"),
        &[
            ("title", &xml(&title)),
            ("style", include_str!("page/page.css")),
            ("equations", M::MATHML),
            ("programs", M::JAVASCRIPT),
            ("data", &data),
            ("motion", &motion_script()),
        ],
    ))
}
