//! The model and what was chosen for its page, as JSON.

use std::fmt::Write;

use dynamics_runtime::model::{
    AssumptionKind, ConservedKind, Constraint, Described, ModelState, Portable, Quantity, SimulationModel,
    UnitDimension, Vector, names,
};
use dynamics_runtime::simulate::Direction;
use dynamics_runtime::smooth::{Outside, Pieces};
use dynamics_view::text::{json, json_number, typeset};

use crate::live::Live;
use crate::plan::{Plan, Slider, field};

/// `const MODEL`, as the scripts read it.
pub(crate) fn data<M: SimulationModel + Portable>(live: &Live<'_, M>, plan: &Plan) -> String {
    let (n, w, p) = (M::COORDINATES.len(), M::INPUTS.len(), M::PARAMETERS.len());
    debug_assert_eq!(M::SYMBOLS.len(), n + w + p, "one symbol for each coordinate, input and parameter");
    debug_assert_eq!(plan.sliders.len(), p + w, "parameters, then inputs");
    let list = |items: Vec<String>| format!("[{}]", items.join(","));
    let coordinates = M::COORDINATES.iter().zip(M::SYMBOLS).map(|(q, symbol)| {
        let angle = q.dimension == UnitDimension::Angle;
        format!("{{{},\"symbol\":{},\"angle\":{angle}}}", named(q), json(symbol))
    });
    let adjustable = |quantities: &[Quantity], symbols: &[&str], sliders: &[Slider]| {
        let all = quantities.iter().zip(symbols).zip(sliders);
        list(all.map(|((quantity, symbol), slider)| adjustable::<M>(quantity, symbol, slider)).collect())
    };
    let inputs = adjustable(M::INPUTS, &M::SYMBOLS[n..], &plan.sliders[p..]);
    let parameters = adjustable(M::PARAMETERS, &M::SYMBOLS[n + w..], &plan.sliders);
    let stops = plan.stops.iter().map(|(event, direction)| {
        let direction = match direction {
            Direction::Rising => 1,
            Direction::Falling => -1,
            Direction::Any => 0,
        };
        format!("{{\"event\":{event},\"direction\":{direction}}}")
    });
    let entries: Vec<(&str, String)> = vec![
        ("name", json(M::NAME)),
        ("title", json(&title(live))),
        ("about", json(M::DOCUMENTATION)),
        ("length_unit", json(names::length_unit::<M>())),
        ("coordinates", list(coordinates.collect())),
        ("inputs", inputs),
        ("parameters", parameters),
        ("outputs", plain(M::OUTPUTS)),
        ("events", plain(M::EVENTS)),
        ("powers", plain(M::POWERS)),
        ("conserved", conserved::<M>()),
        ("rows", rows::<M>()),
        ("assumptions", assumptions::<M>()),
        ("starts", starts(live)),
        ("contacts", contacts(plan)),
        ("stick_slip", stick_slips(plan)),
        ("stops", list(stops.collect())),
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
    // Without a number the page takes a step from the motion's own time.
    let accuracy = plan.accuracy.map_or_else(|| "null".to_owned(), json_number);
    let _ = write!(out, "\"method\":{},\"accuracy\":{accuracy}", json(plan.method.key()));
    out.push('}');
    out
}

/// The title that was given, or the struct's name.
pub(crate) fn title<M: SimulationModel + Portable>(live: &Live<'_, M>) -> String {
    live.title.clone().unwrap_or_else(|| words(M::NAME))
}

/// `DoublePendulum` as `Double pendulum`, `MBSModel` as `MBS model`, `Pendulum2D` as `Pendulum 2D`.
pub(crate) fn words(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    let is_lower = |i: usize| letters.get(i).is_some_and(|c| c.is_lowercase());
    let begins = |i: usize| {
        let (before, c) = (letters[i - 1], letters[i]);
        match c {
            c if c.is_uppercase() => before.is_lowercase() || is_lower(i + 1),
            c if c.is_ascii_digit() => before.is_lowercase(),
            _ => false,
        }
    };
    let mut words: Vec<String> = Vec::new();
    for (i, c) in letters.iter().enumerate() {
        match words.last_mut() {
            Some(word) if !begins(i) => word.push(*c),
            _ => words.push(c.to_string()),
        }
    }
    // What has small letters is a word, and not the short form of some.
    for word in words.iter_mut().skip(1).filter(|word| word.chars().any(char::is_lowercase)) {
        *word = word.to_lowercase();
    }
    words.join(" ")
}

fn named(quantity: &Quantity) -> String {
    format!("\"name\":{},\"unit\":{}", json(quantity.name), json(&typeset(quantity.unit)))
}

fn plain(quantities: &[Quantity]) -> String {
    let items: Vec<_> = quantities.iter().map(|q| format!("{{{}}}", named(q))).collect();
    format!("[{}]", items.join(","))
}

/// A parameter or an input, with its slider.
pub(crate) fn adjustable<M: Described>(quantity: &Quantity, symbol: &str, slider: &Slider) -> String {
    let range = slider.range.map_or_else(|| "null".to_owned(), numbers);
    let about = about::<M>(field(quantity.name));
    format!(
        "{{{},\"symbol\":{},\"value\":{},\"range\":{range},\"held\":{},\"about\":{}}}",
        named(quantity),
        json(symbol),
        json_number(slider.value),
        slider.held,
        json(about),
    )
}

/// The documentation of a field of the struct.
pub(crate) fn about<M: Described>(field: &str) -> &'static str {
    M::FIELD_DOCUMENTATION.iter().find(|(name, _)| *name == field).map_or("", |(_, text)| text)
}

fn conserved<M: SimulationModel>() -> String {
    let items = M::CONSERVED.iter().map(|c| {
        let kind = match c.kind {
            ConservedKind::Energy => "energy",
            ConservedKind::EnergyFunction => "energy function",
            ConservedKind::Momentum => "momentum",
        };
        format!("{{\"kind\":{},\"name\":{},\"unit\":{}}}", json(kind), json(c.name), json(&typeset(c.unit)))
    });
    format!("[{}]", items.collect::<Vec<_>>().join(","))
}

fn rows<M: SimulationModel>() -> String {
    let items = M::ROWS.iter().enumerate().map(|(row, quantity)| {
        let owner = M::CONSTRAINTS.iter().find(|c| (c.first..c.first + c.rows).contains(&row));
        let Constraint { name, switched, redundant, .. } = owner.expect("every row belongs to a constraint");
        let switched = switched.map_or_else(|| "null".to_owned(), |i| i.to_string());
        let holonomic = row < M::Residual::LEN;
        let kind = format!("\"holonomic\":{holonomic},\"switched\":{switched},\"redundant\":{redundant}");
        format!("{{{},\"constraint\":{},{kind}}}", named(quantity), json(name))
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

pub(crate) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
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

/// Name, first row and mode of a switched constraint, as members of an object.
fn switched(constraint: &Constraint) -> String {
    let mode = constraint.switched.expect("rules are those of switched constraints");
    format!("\"name\":{},\"row\":{},\"mode\":{mode}", json(constraint.name), constraint.first)
}

fn contacts(plan: &Plan) -> String {
    let items = plan.contacts.iter().map(|(constraint, law)| {
        let rest_speed = law.rest_speed.map_or_else(|| "null".to_owned(), json_number);
        let restitution = json_number(law.restitution);
        format!("{{{},\"restitution\":{restitution},\"rest_speed\":{rest_speed}}}", switched(constraint))
    });
    format!("[{}]", items.collect::<Vec<_>>().join(","))
}

fn stick_slips(plan: &Plan) -> String {
    let items = plan.stick_slips.iter();
    let items = items.map(|(constraint, event)| format!("{{{},\"event\":{event}}}", switched(constraint)));
    format!("[{}]", items.collect::<Vec<_>>().join(","))
}

pub(crate) fn pieces(pieces: &Pieces) -> String {
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

#[cfg(test)]
mod tests {
    use super::words;

    #[test]
    fn names_of_types_become_words() {
        for (name, text) in [
            ("DoublePendulum", "Double pendulum"),
            ("MBSModel", "MBS model"),
            ("Pendulum2D", "Pendulum 2D"),
            ("Pendulum2DModel", "Pendulum 2D model"),
            ("ArmWithLQR", "Arm with LQR"),
            ("FourBar40", "Four bar 40"),
            ("R2Robot", "R2 robot"),
            ("TShape", "T shape"),
            ("Bead", "Bead"),
        ] {
            assert_eq!(words(name), text);
        }
    }
}
