//! The header: what the arrays hold, sizes, statuses, and the heads of the functions.

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
         /* Of the listing of the model: another model has another number. */\n\
         #define {upper}_VERSION 0x{version:016x}ULL\n\n\
         {sizes}\n\
         /* What functions with a status return. Unless it is OK, their results mean nothing. */\n\
         #define {upper}_OK 0\n\
         /* A pivot of the mass matrix vanishes, or is negative. */\n\
         #define {upper}_SINGULAR 1\n\
         /* The order in which the constraints are eliminated does not apply at this state. */\n\
         #define {upper}_GUARDED 2\n\
         /* There is no program for the constraints that are released. */\n\
         #define {upper}_RELEASED 3\n\n\
         typedef double {name}_real;\n\n\
         {heads}#endif\n",
        title = safe(&model.name),
        arrays = arrays(model, equations, switched),
    )
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
fn arrays(model: &Model, equations: &Equations, switched: usize) -> String {
    let mut out = String::new();
    let mut list = |array: &str, entries: Vec<(String, &str)>| {
        for (i, (name, unit)) in entries.into_iter().enumerate() {
            let unit = if unit.is_empty() { String::new() } else { format!("  [{unit}]") };
            out.push_str(&safe(&format!(" *   {array}[{i}]  {name}{unit}")));
            out.push('\n');
        }
    };
    let own = |name: &String| name.clone();
    list("p", model.parameters.iter().map(|x| (own(&x.name), x.unit.as_str())).collect());
    list("q", model.coordinates.iter().map(|x| (own(&x.name), x.unit.as_str())).collect());
    list("w", model.inputs.iter().map(|x| (own(&x.name), x.unit.as_str())).collect());
    if let Some(constraints) = &equations.constraints {
        list("l", constraints.rows.iter().map(|row| (row.name.clone(), row.unit.as_str())).collect());
    }
    let named = |all: &[Named]| -> Vec<(String, String)> {
        all.iter().map(|x| (x.name.clone(), x.unit.clone())).collect()
    };
    let (outputs, events) = (named(&equations.outputs), named(&equations.events));
    list("outputs", outputs.iter().map(|(name, unit)| (name.clone(), unit.as_str())).collect());
    list("events", events.iter().map(|(name, unit)| (name.clone(), unit.as_str())).collect());
    let modes: Vec<(String, &str)> =
        model.constraints.iter().filter(|c| c.switched).map(|c| (c.name.clone(), "")).collect();
    list("m", modes);
    let mut head = " * p parameters, k constants that are computed from them, t time, q coordinates,\n \
                    * u their rates, a their accelerations"
        .to_owned();
    if !model.inputs.is_empty() {
        head.push_str(", w inputs");
    }
    if equations.constraints.is_some() {
        head.push_str(",\n * l multipliers of the constraints");
    }
    if switched > 0 {
        head.push_str(",\n * m modes of switched constraints: 0 while one holds, else 1 or -1, its side");
    }
    format!("{head}.\n{out}")
}
