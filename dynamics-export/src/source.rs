//! Header and source as they are compiled.

use dynamics_runtime::model::{PrintedInC, SimulationModel};

use crate::export::CExport;
use crate::functions::functions;
use crate::plan::Plan;

/// The suffix of numbers and of functions of `<math.h>`.
pub(crate) fn suffix(single: bool) -> &'static str {
    if single { "f" } else { "" }
}

/// Numbers as elements of an array, several in a line.
pub(crate) fn elements(values: impl IntoIterator<Item = f64>, single: bool) -> String {
    const IN_A_LINE: usize = 4;
    let all: Vec<String> = values.into_iter().map(|x| format!("{x:?}{}", suffix(single))).collect();
    let lines: Vec<String> = all.chunks(IN_A_LINE).map(|line| format!("  {}", line.join(", "))).collect();
    lines.join(",\n")
}

/// `name.h`.
pub(crate) fn header<M: SimulationModel + PrintedInC>(export: &CExport<'_, M>) -> String {
    let name = M::C.name;
    let typed = |ty: &str| format!("typedef {ty} {name}_real;");
    let header = M::C.header.replace('@', suffix(export.single));
    if export.single { header.replace(&typed("double"), &typed("float")) } else { header }
}

/// `name.c`.
pub(crate) fn source<M: SimulationModel + PrintedInC>(export: &CExport<'_, M>, plan: &Plan<M>) -> String {
    let texts = M::C;
    let (name, upper) = (texts.name, texts.name.to_uppercase());
    let filled = |text: &str| text.replace('@', suffix(export.single));
    let sines = match export.library_sines {
        true => format!("#ifndef {upper}_LIBRARY_SINES\n#define {upper}_LIBRARY_SINES\n#endif\n\n"),
        false => String::new(),
    };
    format!(
        "{sines}#include \"{name}.h\"\n\n#include <math.h>\n\n#if {upper}_VERSION != {}\n\
         #error \"{name}.h belongs to another model\"\n#endif\n\n{}{}{}",
        version(texts.header),
        filled(texts.support),
        functions(name, texts.programs, &plan.functions, export.single),
        filled(texts.programs),
    )
}

/// The number of the version in a header.
fn version(header: &str) -> &str {
    let line = header.lines().find_map(|line| line.split_once("_VERSION ").map(|(_, number)| number));
    line.unwrap_or("0")
}
