//! `documentation/index.html`: the model's live page, or a page of equations and variables.

use std::fmt::Write;

use dynamics_runtime::model::{PrintedInC, SimulationModel};
use dynamics_view::text::{typeset, xml};

use crate::fmu::Fmu;
use crate::plan::Plan;

/// The live page where the model has one.
pub(crate) fn page<M: SimulationModel + PrintedInC>(fmu: &Fmu<'_, M>, plan: &Plan) -> String {
    let live = if fmu.live_page { live(fmu) } else { None };
    live.unwrap_or_else(|| plain::<M>(plan))
}

#[cfg(feature = "live")]
fn live<M: SimulationModel + PrintedInC>(fmu: &Fmu<'_, M>) -> Option<String> {
    dynamics_live::Live::new(fmu.model, fmu.start).to_html().ok()
}

#[cfg(not(feature = "live"))]
fn live<M: SimulationModel + PrintedInC>(_: &Fmu<'_, M>) -> Option<String> {
    None
}

/// Equations and variables.
fn plain<M: SimulationModel + PrintedInC>(plan: &Plan) -> String {
    let mut rows = String::new();
    for variable in &plan.variables.all {
        let [name, unit, about] =
            [&variable.name, &typeset(&variable.unit), &variable.about].map(|text| xml(text));
        let _ = writeln!(rows, "<tr><td><code>{name}</code></td><td>{unit}</td><td>{about}</td></tr>");
    }
    let name = xml(M::NAME);
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>{name}</title>\n<style>\
         body {{ font: 1rem/1.5 sans-serif; max-width: 50rem; margin: 2rem auto; padding: 0 1rem; }}\n\
         td {{ padding: 0 1rem 0 0; }}</style>\n<h1>{name}</h1>\n<p>{}</p>\n<h2>Equations of motion</h2>\n{}\n\
         <h2>Variables</h2>\n<table>\n{rows}</table>\n</html>\n",
        xml(M::DOCUMENTATION),
        M::MATHML,
    )
}
