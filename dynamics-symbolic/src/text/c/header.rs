//! The header: what the arrays hold, sizes, statuses, and the heads of the functions.

use crate::graph::FunctionId;
use crate::mechanics::{Equations, Model, Named};

use super::PlainProgram;
use super::printer::{Declared, Printer};

/// A hash of a text by Fowler, Noll and Vo (FNV-1a, 64 bits): the same on all machines.
fn hash(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// The header of a model.
pub(super) fn header(name: &str, printer: &Printer<'_>, declared: &[Declared]) -> String {
    let Printer { model, equations, programs, .. } = printer;
    let upper = name.to_uppercase();
    let rows = equations.constraints.as_ref().map_or(0, |c| c.rows.len());
    let holonomic = equations.constraints.as_ref().map_or(0, |c| c.residual.len());
    let switched = model.constraints.iter().filter(|c| c.switched).count();
    let count = |which: PlainProgram| {
        let found = programs.named.iter().find(|(other, _)| *other == which);
        found.map_or(0, |(_, program)| program.results.len())
    };
    let sizes = [
        ("PARAMETERS", model.parameters.len()),
        ("CONSTANTS", printer.constants.len()),
        ("COORDINATES", model.coordinates.len()),
        ("INPUTS", model.inputs.len()),
        ("SWITCHED", switched),
        ("ROWS", rows),
        ("HOLONOMIC", holonomic),
        ("ENERGIES", programs.energies.len()),
        ("CONSERVED", count(PlainProgram::Conserved)),
        ("POWERS", count(PlainProgram::Powers)),
        ("OUTPUTS", equations.outputs.len()),
        ("EVENTS", equations.events.len()),
        ("KINKS", count(PlainProgram::Kinks)),
        ("DIRECTIONAL", programs.directional.map_or(0, |program| program.results.len())),
    ];
    let sizes: String = sizes.map(|(what, size)| format!("#define {upper}_{what} {size}\n")).concat();
    let heads: String = declared
        .iter()
        .filter(|function| !function.about.is_empty())
        .map(|function| format!("{}{};\n\n", comment(&function.about), function.declaration))
        .collect();
    let version = hash(programs.listing);
    format!(
        "/* The equations of motion of {title}, as the macro `dynamics` derived them.\n\
         \x20* Functions allocate nothing, keep nothing and can be called from several threads.\n *\n\
         {arrays} */\n\
         #ifndef {upper}_H\n#define {upper}_H\n\n\
         #ifdef __cplusplus\n\
         #define {upper}_RESTRICT\n\
         extern \"C\" {{\n\
         #else\n\
         #define {upper}_RESTRICT restrict\n\
         #endif\n\n\
         /* Of the listing of the model: another model has another number. */\n\
         #define {upper}_VERSION 0x{version:016x}ULL\n\n\
         /* Functions lack arguments of size 0, but for p, dp and k, which may be NULL then. Functions without\n\
         \x20* results do not exist. */\n\
         {sizes}\n\
         /* What functions with a status return. Unless it is OK, their results mean nothing. */\n\
         {statuses}\n\
         typedef double {name}_real;\n\n\
         {heads}\
         #ifdef __cplusplus\n\
         }}\n\
         #endif\n\n\
         #endif\n",
        title = safe(&model.name),
        arrays = arrays(name, printer, switched),
        statuses = statuses(&upper, declared),
    )
}

/// Statuses: those that some function returns.
fn statuses(upper: &str, declared: &[Declared]) -> String {
    let all = [
        ("OK", ""),
        ("SINGULAR", "/* A pivot of the mass matrix vanishes, or is negative where it must not be. */\n"),
        (
            "GUARDED",
            "/* The order in which the constraints are eliminated does not apply at this state, or its \
             numbers are\n * lost in rounding. Signs of the mass matrix are not checked. */\n",
        ),
        ("RELEASED", "/* There is no program for the constraints that are released. */\n"),
    ];
    let mut text = String::new();
    for (number, (status, about)) in all.into_iter().enumerate() {
        let word = format!("{upper}_{status};");
        let is_returned = declared.iter().any(|function| function.text.contains(&word));
        if number == 0 || is_returned {
            text.push_str(&format!("{about}#define {upper}_{status} {number}\n"));
        }
    }
    text
}

/// A text that ends no comment.
fn safe(text: &str) -> String {
    text.replace("*/", "* /").replace("/*", "/ *")
}

/// A comment of lines of at most so many letters.
fn comment(text: &str) -> String {
    const WIDTH: usize = 96;
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let last = lines.last_mut().expect("there is a line");
        if !last.is_empty() && last.len() + word.len() >= WIDTH {
            lines.push(word.to_owned());
        } else {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(word);
        }
    }
    format!("/* {} */\n", lines.join("\n * "))
}

/// What stands where in the arrays.
fn arrays(name: &str, printer: &Printer<'_>, switched: usize) -> String {
    let Printer { model, equations, programs, .. } = printer;
    let mut out = String::new();
    let mut list = |title: &str, array: &str, entries: Vec<(String, String)>| {
        if !title.is_empty() && !entries.is_empty() {
            out.push_str(&format!(" * {title}\n"));
        }
        for (i, (name, unit)) in entries.into_iter().enumerate() {
            let unit = if unit.is_empty() { String::new() } else { format!("  [{unit}]") };
            out.push_str(&safe(&format!(" *   {array}[{i}]  {name}{unit}")));
            out.push('\n');
        }
    };
    let entry = |name: &String, unit: &String| (name.clone(), unit.clone());
    let named = |all: &[Named]| all.iter().map(|x| entry(&x.name, &x.unit)).collect::<Vec<_>>();
    list("", "p", model.parameters.iter().map(|x| entry(&x.name, &x.unit)).collect());
    list("", "q", model.coordinates.iter().map(|x| entry(&x.name, &x.unit)).collect());
    list("", "w", model.inputs.iter().map(|x| entry(&x.name, &x.unit)).collect());
    let modes = model.constraints.iter().filter(|c| c.switched);
    list("", "m", modes.map(|c| (c.name.clone(), String::new())).collect());
    if let Some(constraints) = &equations.constraints {
        let units = multiplier_units(model, equations);
        let multipliers = constraints.rows.iter().zip(units);
        list("", "l", multipliers.map(|(row, unit)| (row.name.clone(), unit)).collect());
        let title = match constraints.holonomic {
            0 => "Rows of the constraints, all of them of velocities:".to_owned(),
            count => format!(
                "Rows of the constraints, {count} holonomic first; for changes of u they have this unit per \
                 time:"
            ),
        };
        list(&title, "r", named(&constraints.rows));
    }
    let written = |function: &str| format!("{name}_{function} writes");
    let conserved: Vec<Named> = equations.conserved.iter().map(|of| of.quantity.clone()).collect();
    list(&written("conserved"), "out", named(&conserved));
    list(&written("powers"), "out", named(&equations.powers));
    list(&written("outputs"), "out", named(&equations.outputs));
    list(&written("events"), "out", named(&equations.events));
    let kinks = programs.kink_functions.iter().map(|function| match function {
        Some(FunctionId(id)) => {
            format!("an argument of {}: its piece matters", model.functions[*id as usize].name)
        }
        None => "its sign matters".to_owned(),
    });
    list(&written("kinks"), "out", kinks.map(|text| (text, String::new())).collect());
    let mut head = " * p parameters, k constants that are computed from them, t time, q coordinates,\n \
                    * u their rates, a their accelerations"
        .to_owned();
    if !model.inputs.is_empty() {
        head.push_str(", w inputs");
    }
    if equations.constraints.is_some() {
        head.push_str(",\n * l multipliers of the constraints, r changes of their rows");
    }
    if switched > 0 {
        head.push_str(",\n * m modes of switched constraints: 0 while one holds, else 1 or -1, its side");
    }
    format!("{head}.\n{out}")
}

/// Units of the multipliers, as columns of a motion have them: l times a row is an energy, or a power for
/// rows of velocities.
fn multiplier_units(model: &Model, equations: &Equations) -> Vec<String> {
    let Some(constraints) = &equations.constraints else { return Vec::new() };
    let coordinates = || model.coordinates.iter().map(|x| x.unit.as_str());
    let parameters = || model.parameters.iter().map(|x| x.unit.as_str());
    let rows = || constraints.rows.iter().map(|x| x.unit.as_str());
    let inputs = model.inputs.iter().map(|x| x.unit.as_str());
    let outputs = equations.outputs.iter().map(|x| x.unit.as_str());
    let known = coordinates().chain(parameters()).chain(inputs).chain(outputs).any(|unit| !unit.is_empty());
    let is_english = |unit: &str| ["ft", "lb", "slug"].iter().any(|of| unit.contains(of));
    let english = coordinates().chain(parameters()).chain(rows()).any(is_english);
    let unit = |(row, unit)| match known {
        true => multiplier_unit(unit, row >= constraints.holonomic, english),
        false => String::new(),
    };
    rows().enumerate().map(unit).collect()
}

/// Energy by the unit of Φ, or power by the unit of A q̇ + b, as `names.rs` of the runtime's models has it.
fn multiplier_unit(unit: &str, per_time: bool, english: bool) -> String {
    let [newton, torque, energy, power, length] =
        if english { ["lb", "ft*lb", "ft*lb", "ft*lb/s", "ft"] } else { ["N", "N*m", "J", "W", "m"] };
    let by = if per_time { unit.strip_suffix("/s").unwrap_or(unit) } else { unit };
    match by {
        by if per_time && by == unit => format!("{power}/({unit})"),
        "" | "1" | "rad" => torque.to_owned(),
        by if by == length => newton.to_owned(),
        by if by.strip_suffix("^2") == Some(length) => format!("{newton}/{length}"),
        by => format!("{energy}/({by})"),
    }
}
