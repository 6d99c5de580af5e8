//! `main.c`: the classical Runge–Kutta method with a fixed step, and projections where there are
//! constraints; and the `Makefile`.

use dynamics_runtime::model::{ModelState, PrintedInC, SimulationModel, Vector};

use crate::export::CExport;
use crate::plan::Plan;
use crate::source::{elements, suffix};

/// Rows that the example prints, besides the start.
const PRINTED: u64 = 100;

/// The example; `$` stands for the prefix, `%%` for it in capitals, `@` for the suffix of numbers.
const MAIN: &str = include_str!("main.c");
/// What the example has besides where there are constraints.
const PROJECTION: &str = include_str!("projection.c");

/// `main.c`.
pub(crate) fn main<M: SimulationModel + PrintedInC>(export: &CExport<'_, M>, plan: &Plan<M>) -> String {
    let name = M::C.name;
    let state = &plan.start;
    let switched = M::CONSTRAINTS.iter().filter(|c| c.switched.is_some()).count();
    let modes: Vec<f64> = (0..switched).map(|i| state.active_set().side(i)).collect();
    let rows = M::ROWS.len();
    let array = |what: &str, values: &[f64]| match values.len() {
        0 => String::new(),
        count => {
            let elements = elements(values.iter().copied(), export.single);
            format!("static const $_real {what}[{count}] = {{\n{elements}\n}};\n")
        }
    };
    let arrays = [
        array("parameters", &plan.parameters),
        array("start_q", state.q().as_slice()),
        array("start_u", state.u().as_slice()),
        array("inputs", state.inputs().as_slice()),
        array("modes", &modes),
    ]
    .concat();
    // What all programs take behind q and u.
    let mut more = String::new();
    if !M::INPUTS.is_empty() {
        more.push_str(", inputs");
    }
    if switched > 0 {
        more.push_str(", modes");
    }
    let parameters = if plan.parameters.is_empty() { "NULL" } else { "parameters" };
    let suffix = suffix(export.single);
    let number = |value: f64| format!("{value:?}{suffix}");
    let texts = [
        ("ARRAYS", arrays),
        ("PROJECTION", if rows > 0 { PROJECTION.to_owned() } else { String::new() }),
        (
            "PROJECT",
            if rows > 0 {
                "    if (status == %%_OK) {\n      status = project(k, t, &y);\n    }\n"
            } else {
                ""
            }
            .to_owned(),
        ),
        ("MULTIPLIERS", if rows > 0 { "  $_real l[%%_ROWS];\n" } else { "" }.to_owned()),
        ("REACTIONS", if rows > 0 { ", l" } else { "" }.to_owned()),
        ("CONSTANTS", M::C.constants.max(1).to_string()),
        ("PARAMETERS", parameters.to_owned()),
        ("MORE", more),
        ("TIME", number(state.t())),
        ("STEP", number(export.step)),
        ("STEPS", plan.steps.to_string()),
        ("EVERY", plan.steps.div_ceil(PRINTED).max(1).to_string()),
        ("DIGITS", if export.single { "9" } else { "17" }.to_owned()),
    ];
    let mut text = MAIN.to_owned();
    for (key, value) in texts {
        text = text.replace(&format!("<<{key}>>"), &value);
    }
    text.replace("%%", &name.to_uppercase()).replace('$', name).replace('@', suffix)
}

/// The `Makefile`.
pub(crate) fn makefile(name: &str) -> String {
    format!(
        "# Builds and runs the example. Without -ffp-contract=off products and sums may be fused,\n\
         # which rounds differently than the library.\n\
         CFLAGS = -std=c99 -O2 -ffp-contract=off -Wall -Wextra -Wpedantic -Werror\n\n\
         example: main.c {name}.c {name}.h\n\
         \t$(CC) $(CFLAGS) -o example main.c {name}.c -lm\n\n\
         run: example\n\t./example\n\n\
         clean:\n\trm -f example\n\n\
         .PHONY: run clean\n"
    )
}
