//! The model and what was chosen for its page, as JSON.

use std::fmt::Write;

use dynamics_runtime::model::{
    AssumptionKind, ConservedKind, ModelState, Portable, Quantity, SimulationModel, UnitDimension, Vector,
    names,
};
use dynamics_runtime::smooth::{Outside, Pieces};
use dynamics_view::text::{json, json_number, typeset};

use crate::live::{Accuracy, Live, PageMethod};

/// Tolerance of methods that choose their steps, where none is given.
const DEFAULT_TOLERANCE: f64 = 1e-8;
/// Step of methods with a fixed step, where none is given.
const DEFAULT_STEP: f64 = 0.01;

/// `const MODEL`, as the scripts read it.
pub(crate) fn data<M: SimulationModel + Portable>(live: &Live<'_, M>) -> String {
    let symbols = M::SYMBOLS;
    let (n, w) = (M::COORDINATES.len(), M::INPUTS.len());
    let symbol = |i: usize| symbols.get(i).copied().unwrap_or_default();
    let list = |items: Vec<String>| format!("[{}]", items.join(","));
    let coordinates = M::COORDINATES.iter().enumerate().map(|(i, q)| {
        let angle = q.dimension == UnitDimension::Angle;
        format!("{{{},\"symbol\":{},\"angle\":{angle}}}", named(q), json(symbol(i)))
    });
    let inputs = M::INPUTS.iter().enumerate().map(|(i, q)| {
        let value = live.starts.first().map_or(f64::NAN, |(_, s)| s.inputs().as_slice()[i]);
        let value = if value.is_finite() { value } else { 0.0 };
        adjustable(live, q, symbol(n + i), value)
    });
    let parameters = M::PARAMETERS
        .iter()
        .enumerate()
        .map(|(i, q)| adjustable(live, q, symbol(n + w + i), live.model.parameter(i).unwrap_or(f64::NAN)));
    let entries: Vec<(&str, String)> = vec![
        ("name", json(M::NAME)),
        ("title", json(&title(live))),
        ("about", json(M::DOCUMENTATION)),
        ("length_unit", json(names::length_unit::<M>())),
        ("coordinates", list(coordinates.collect())),
        ("inputs", list(inputs.collect())),
        ("parameters", list(parameters.collect())),
        ("outputs", plain(M::OUTPUTS)),
        ("events", plain(M::EVENTS)),
        ("powers", plain(M::POWERS)),
        ("conserved", conserved::<M>()),
        ("rows", rows::<M>()),
        ("assumptions", assumptions::<M>()),
        ("starts", starts(live)),
        ("contacts", contacts(live)),
        ("stick_slip", stick_slips(live)),
        (
            "stops",
            list(live.stops.iter().filter_map(|name| event::<M>(name)).map(|i| i.to_string()).collect()),
        ),
        ("plots", list(live.plots.iter().map(|name| json(name)).collect())),
        ("phase", phase(live).to_string()),
        ("until", live.until.map_or_else(|| "null".to_owned(), json_number)),
        ("not_portable", list(M::NOT_PORTABLE.iter().map(|text| json(text)).collect())),
        ("functions", list(live.model.pieces().iter().map(|p| pieces(p.as_ref())).collect())),
    ];
    let mut out = String::from("{");
    for (key, value) in entries {
        let _ = write!(out, "\"{key}\":{value},\n");
    }
    out.push_str(&method(live));
    out.push('}');
    out
}

/// The title that was given, or the struct's name.
pub(crate) fn title<M: SimulationModel + Portable>(live: &Live<'_, M>) -> String {
    live.title.clone().unwrap_or_else(|| words(M::NAME))
}

/// `DoublePendulum` as `Double pendulum`.
fn words(name: &str) -> String {
    let mut out = String::new();
    for (i, c) in name.chars().enumerate() {
        if i > 0 && c.is_uppercase() {
            out.push(' ');
            out.extend(c.to_lowercase());
        } else {
            out.push(c);
        }
    }
    out
}

fn named(quantity: &Quantity) -> String {
    format!("\"name\":{},\"unit\":{}", json(quantity.name), json(&typeset(quantity.unit)))
}

fn plain(quantities: &[Quantity]) -> String {
    let items: Vec<_> = quantities.iter().map(|q| format!("{{{}}}", named(q))).collect();
    format!("[{}]", items.join(","))
}

/// A parameter or an input, with its slider.
fn adjustable<M: SimulationModel + Portable>(
    live: &Live<'_, M>,
    quantity: &Quantity,
    symbol: &str,
    value: f64,
) -> String {
    let range = live.ranges.iter().rev().find(|(name, _)| name == quantity.name);
    let range = range.map_or_else(
        || "null".to_owned(),
        |(_, [from, to])| format!("[{},{}]", json_number(*from), json_number(*to)),
    );
    let field = quantity.name.split(['[', '.']).next().unwrap_or_default();
    let about = M::FIELD_DOCUMENTATION.iter().find(|(name, _)| *name == field).map_or("", |(_, text)| text);
    format!(
        "{{{},\"symbol\":{},\"value\":{},\"range\":{range},\"held\":{},\"about\":{}}}",
        named(quantity),
        json(symbol),
        json_number(value),
        live.held.iter().any(|name| name == quantity.name),
        json(about),
    )
}

fn conserved<M: SimulationModel>() -> String {
    let items = M::CONSERVED.iter().map(|c| {
        let kind = match c.kind {
            ConservedKind::Energy => "energy",
            ConservedKind::EnergyFunction => "energy function",
            ConservedKind::Momentum => "momentum",
        };
        format!("{{\"kind\":{},\"name\":{},\"unit\":{}}}", json(kind), json(c.name), json(c.unit))
    });
    format!("[{}]", items.collect::<Vec<_>>().join(","))
}

fn rows<M: SimulationModel>() -> String {
    let items = M::ROWS.iter().enumerate().map(|(row, quantity)| {
        let owner = M::CONSTRAINTS.iter().find(|c| (c.first..c.first + c.rows).contains(&row));
        let switched = owner.and_then(|c| c.switched).map_or_else(|| "null".to_owned(), |i| i.to_string());
        let holonomic = row < M::Residual::LEN;
        let redundant = owner.is_some_and(|c| c.redundant);
        let kind = format!("\"holonomic\":{holonomic},\"switched\":{switched},\"redundant\":{redundant}");
        format!("{{{},{kind}}}", named(quantity))
    });
    format!("[{}]", items.collect::<Vec<_>>().join(","))
}

/// What the model takes for granted of values that its program `assumptions` returns, one after the other.
fn assumptions<M: SimulationModel>() -> String {
    let items = M::ASSUMPTIONS.iter().map(|assumption| {
        let kind = match assumption.kind {
            AssumptionKind::Mass => "mass",
            AssumptionKind::Moment => "moment",
            AssumptionKind::Inertia => "inertia",
            AssumptionKind::Rotation => "rotation",
            AssumptionKind::Axis => "axis",
            AssumptionKind::Weld => "weld",
            _ => "other",
        };
        let (of, text) = (assumption.of.join(", "), assumption.to_string());
        let constant = assumption.constant;
        format!(
            "{{\"kind\":{},\"of\":{},\"constant\":{constant},\"text\":{}}}",
            json(kind),
            json(&of),
            json(&text)
        )
    });
    format!("[{}]", items.collect::<Vec<_>>().join(","))
}

fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    let items: Vec<_> = values.into_iter().map(json_number).collect();
    format!("[{}]", items.join(","))
}

fn starts<M: SimulationModel + Portable>(live: &Live<'_, M>) -> String {
    let switched = M::CONSTRAINTS.iter().filter(|c| c.switched.is_some()).count();
    let items = live.starts.iter().map(|(name, state)| {
        let inputs = state.inputs().as_slice().iter().map(|&x| if x.is_nan() { 0.0 } else { x });
        format!(
            "{{\"name\":{},\"t\":{},\"q\":{},\"u\":{},\"w\":{},\"m\":{}}}",
            json(name),
            json_number(state.t()),
            numbers(state.q().as_slice().iter().copied()),
            numbers(state.u().as_slice().iter().copied()),
            numbers(inputs),
            numbers((0..switched).map(|i| state.active_set().side(i))),
        )
    });
    format!("[{}]", items.collect::<Vec<_>>().join(",\n"))
}

/// First row and mode of a switched constraint, as members of an object.
fn switched<M: SimulationModel>(name: &str) -> Option<String> {
    let constraint = M::CONSTRAINTS.iter().find(|c| c.name == name)?;
    Some(format!("\"row\":{},\"mode\":{}", constraint.first, constraint.switched?))
}

fn event<M: SimulationModel>(name: &str) -> Option<usize> {
    M::EVENTS.iter().position(|event| event.name == name)
}

fn contacts<M: SimulationModel + Portable>(live: &Live<'_, M>) -> String {
    let items = live.contacts.iter().filter_map(|(name, law)| {
        let rest_speed = law.rest_speed.map_or_else(|| "null".to_owned(), json_number);
        let (place, restitution) = (switched::<M>(name)?, json_number(law.restitution));
        Some(format!(
            "{{\"name\":{},{place},\"restitution\":{restitution},\"rest_speed\":{rest_speed}}}",
            json(name)
        ))
    });
    format!("[{}]", items.collect::<Vec<_>>().join(","))
}

fn stick_slips<M: SimulationModel + Portable>(live: &Live<'_, M>) -> String {
    let items = live.stick_slips.iter().filter_map(|[name, breakaway]| {
        let (place, event) = (switched::<M>(name)?, event::<M>(breakaway)?);
        Some(format!("{{\"name\":{},{place},\"event\":{event}}}", json(name)))
    });
    format!("[{}]", items.collect::<Vec<_>>().join(","))
}

fn phase<M: SimulationModel + Portable>(live: &Live<'_, M>) -> usize {
    let chosen = live.phase.as_ref().and_then(|name| M::COORDINATES.iter().position(|q| q.name == name));
    chosen.unwrap_or(0)
}

fn pieces(pieces: Option<&Pieces>) -> String {
    let Some(pieces) = pieces else { return "null".to_owned() };
    let outside = match pieces.outside {
        Outside::Unknown => "unknown",
        Outside::Linear => "linear",
        Outside::Periodic => "periodic",
    };
    let coefficients: Vec<_> =
        pieces.coefficients.iter().map(|piece| numbers(piece.iter().copied())).collect();
    format!(
        "{{\"knots\":{},\"coefficients\":[{}],\"outside\":{}}}",
        numbers(pieces.knots.iter().copied()),
        coefficients.join(","),
        json(outside)
    )
}

/// Method and accuracy at the beginning.
fn method<M: SimulationModel + Portable>(live: &Live<'_, M>) -> String {
    let by_accuracy = match live.accuracy {
        Some(Accuracy::Step(_)) => PageMethod::Rk4,
        _ => PageMethod::DormandPrince,
    };
    let method = live.method.unwrap_or(by_accuracy);
    let adaptive = matches!(method, PageMethod::DormandPrince | PageMethod::Dop853);
    let accuracy = match live.accuracy {
        Some(Accuracy::Tolerance(tolerance)) if adaptive => tolerance,
        Some(Accuracy::Step(step)) if !adaptive => step,
        _ if adaptive => DEFAULT_TOLERANCE,
        _ => DEFAULT_STEP,
    };
    format!("\"method\":{},\"accuracy\":{}", json(method.key()), json_number(accuracy))
}
