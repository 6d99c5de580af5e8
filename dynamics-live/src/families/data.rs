//! The model and what was chosen for its page, as JSON; its loops as programs.

use std::fmt::Write;

use dynamics_families::model::{FamilyState, Length};
use dynamics_families::portable::PortableFamily;
use dynamics_view::text::{json, json_number, typeset};

use super::FamilyLive;
use super::plan::FamilyPlan;
use crate::data::{about, adjustable, numbers, pieces, words};

/// `const PROGRAMS`: the loops at the model's counts.
pub(super) fn programs<M: PortableFamily>(model: &M) -> String {
    let counts: Vec<String> = model.counts().iter().map(usize::to_string).collect();
    let numbered: Vec<String> =
        model.numbered().iter().map(|values| numbers(values.iter().copied())).collect();
    let fields = M::FIELDS.iter().zip(M::SYMBOLS).map(|(field, symbol)| {
        let grid = matches!(field.length, Length::Grid { .. });
        format!(
            "{{\"name\":{},\"unit\":{},\"symbol\":{},\"angle\":{},\"grid\":{grid}}}",
            json(field.name),
            json(&typeset(field.unit)),
            json(symbol),
            field.unit == "rad"
        )
    });
    let fields: Vec<String> = fields.collect();
    format!(
        "family(({})({{\"counts\":[{}],\"numbered\":[{}]}}), {{\"fields\":[{}]}})",
        M::JAVASCRIPT,
        counts.join(","),
        numbered.join(","),
        fields.join(",")
    )
}

/// `const MODEL`, as the scripts read it; what depends on the counts the programs bring along.
pub(super) fn data<M: PortableFamily>(live: &FamilyLive<'_, M>, plan: &FamilyPlan) -> String {
    let (n, w, p) = (M::FIELDS.len(), M::INPUTS.len(), M::PARAMETERS.len());
    let list = |items: Vec<String>| format!("[{}]", items.join(","));
    let sliders = |quantities: &[_], symbols: &[&str], sliders: &[_]| {
        let all = quantities.iter().zip(symbols).zip(sliders);
        list(all.map(|((quantity, symbol), slider)| adjustable::<M>(quantity, symbol, slider)).collect())
    };
    let counts = M::COUNTS.iter().zip(live.model.counts()).map(|(name, count)| {
        format!("{{\"name\":{},\"value\":{count},\"about\":{}}}", json(name), json(about::<M>(name)))
    });
    let numbered = M::NUMBERED.iter().zip(live.model.numbered());
    let numbered = numbered.map(|(name, values)| {
        format!("{{\"name\":{},\"values\":{}}}", json(name), numbers(values.iter().copied()))
    });
    let title = live.title.clone().unwrap_or_else(|| words(M::NAME));
    let none = || "[]".to_owned();
    let entries: Vec<(&str, String)> = vec![
        ("name", json(M::NAME)),
        ("title", json(&title)),
        ("about", json(M::DOCUMENTATION)),
        ("length_unit", json(length_unit::<M>())),
        ("counts", list(counts.collect())),
        ("numbered", list(numbered.collect())),
        ("inputs", sliders(M::INPUTS, &M::SYMBOLS[n..], &plan.sliders[p..])),
        ("parameters", sliders(M::PARAMETERS, &M::SYMBOLS[n + w..], &plan.sliders)),
        ("events", none()),
        ("conserved", none()),
        ("rows", none()),
        ("assumptions", none()),
        ("starts", starts(live)),
        ("contacts", none()),
        ("stick_slip", none()),
        ("stops", none()),
        ("plots", list(live.plots.iter().map(|name| json(name)).collect())),
        ("phase", plan.phase.to_string()),
        ("until", live.until.map_or_else(|| "null".to_owned(), json_number)),
        ("not_portable", list(M::NOT_PORTABLE.iter().map(|text| json(text)).collect())),
        ("functions", list(plan.functions.iter().map(pieces).collect())),
    ];
    let mut out = String::from("{");
    for (key, value) in entries {
        let _ = writeln!(out, "\"{key}\":{value},");
    }
    let accuracy = plan.accuracy.map_or_else(|| "null".to_owned(), json_number);
    let _ = write!(out, "\"method\":{},\"accuracy\":{accuracy}", json(plan.method));
    out.push('}');
    out
}

/// The unit of the places of a picture: that of the first coordinate that is a length.
fn length_unit<M: PortableFamily>() -> &'static str {
    let lengths = ["m", "mm", "cm", "km", "um", "nm", "ft", "in"];
    M::FIELDS.iter().map(|field| field.unit).find(|unit| lengths.contains(unit)).unwrap_or("")
}

fn starts<M: PortableFamily>(live: &FamilyLive<'_, M>) -> String {
    let items = live.starts.iter().map(|(name, state)| {
        let inputs = state.inputs().iter().map(|&x| if x.is_nan() { 0.0 } else { x });
        format!(
            "{{\"name\":{},\"t\":{},\"q\":{},\"u\":{},\"w\":{},\"m\":[]}}",
            json(name),
            json_number(state.t()),
            numbers(state.q().iter().copied()),
            numbers(state.u().iter().copied()),
            numbers(inputs),
        )
    });
    format!("[{}]", items.collect::<Vec<_>>().join(",\n"))
}
