//! Type stubs: what editors and `mypy` know of a module.

use std::fmt::Write as _;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyModule};

use crate::info::{Field, Info, Slot};
use crate::model::{CLASS, ClassOfModel, EVALUATIONS};
use crate::options::METHODS;

/// The stubs of a module with models.
pub(crate) fn stub(module: &Bound<'_, PyModule>) -> PyResult<String> {
    let quoted = |names: Vec<&str>, indent: &str| {
        names.iter().map(|name| format!("{indent}\"{name}\",\n")).collect::<String>().trim_end().to_owned()
    };
    let evaluations = EVALUATIONS.iter().map(|(name, _)| *name).collect();
    let mut text = include_str!("stub.pyi")
        .replace("    METHODS", &quoted(METHODS.to_vec(), "    "))
        .replace("            EVALUATIONS", &quoted(evaluations, "            "));
    let keywords = keywords(module.py())?;
    let content: Bound<'_, PyDict> = module.dict();
    for (_, value) in content.iter() {
        let Ok(class) = value.getattr(CLASS) else { continue };
        let class = class.cast_into::<ClassOfModel>()?;
        text += &of_class(class.get().class.info(), &keywords);
    }
    Ok(text)
}

/// The stubs of a class. Names that are words of Python's grammar cannot stand in them; they are among the
/// `others`.
fn of_class(info: &Info, keywords: &[String]) -> String {
    let is_name = |name: &str| keywords.iter().all(|keyword| keyword != name);
    let fields: Vec<&Field> = info.fields.iter().filter(|field| is_name(field.name)).collect();
    let others = if fields.len() < info.fields.len() { ", **others: Any" } else { "" };
    let attributes: Vec<(String, &Slot)> = attributes(info).filter(|(name, _)| is_name(name)).collect();
    let name = info.name;
    let mut text = String::new();
    let mut line = |parts: std::fmt::Arguments<'_>| {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{parts}");
    };
    line(format_args!("\nclass _{name}State(State):"));
    let mut any = false;
    for (attribute, slot) in &attributes {
        let ty = if slot.len.is_some() { "Array" } else { "float" };
        line(format_args!("    @property\n    def {attribute}(self) -> {ty}: ..."));
        any = true;
    }
    if !any {
        line(format_args!("    ..."));
    }
    line(format_args!("\nclass _{name}Motion(Motion):"));
    line(format_args!("    @property\n    def model(self) -> {name}: ..."));
    for edge in ["start", "end"] {
        line(format_args!("    @property\n    def {edge}(self) -> _{name}State: ..."));
    }
    for (attribute, _) in &attributes {
        line(format_args!("    @property\n    def {attribute}(self) -> Array: ..."));
    }
    for output in info.output_names().iter().filter(|name| is_name(name)) {
        line(format_args!("    @property\n    def {output}(self) -> Array: ..."));
    }
    line(format_args!("\nclass {name}(Model[_{name}State, _{name}Motion]):"));
    for field in &fields {
        line(format_args!("    @property\n    def {}(self) -> {}: ...", field.name, field.gives));
        line(format_args!(
            "    @{0}.setter\n    def {0}(self, value: {1}) -> None: ...",
            field.name, field.takes
        ));
    }
    let star = if fields.is_empty() { "" } else { ", *" };
    let arguments: String = fields.iter().map(|field| format!(", {}: {}", field.name, field.takes)).collect();
    line(format_args!("    def __init__(self{star}{arguments}{others}) -> None: ..."));
    let changes: String =
        fields.iter().map(|field| format!(", {}: {} = ...", field.name, field.takes)).collect();
    line(format_args!("    def replace(self{star}{changes}{others}) -> {name}: ..."));
    line(format_args!("    def state(\n        self,\n        *,\n        t: float = 0.0,"));
    line(format_args!("        assemble: bool = False,"));
    line(format_args!("        release: str | Sequence[str] | Mapping[str, float] | None = None,"));
    let kind = |slot: &Slot| if slot.len.is_some() { "ArrayLike" } else { "float" };
    for slot in &info.coordinates {
        for suffix in ["", "_rate", "_guess"] {
            if !is_name(&format!("{}{suffix}", slot.name)) {
                continue;
            }
            line(format_args!("        {}{suffix}: {} = ...,", slot.name, kind(slot)));
        }
    }
    for slot in info.inputs.iter().chain(&info.speeds).filter(|slot| is_name(&slot.name)) {
        line(format_args!("        {}: {} = ...,", slot.name, kind(slot)));
    }
    let mut slots = info.coordinates.iter().chain(&info.inputs).chain(&info.speeds);
    if slots.any(|slot| !is_name(&slot.name)) {
        line(format_args!("        **others: Any,"));
    }
    line(format_args!("    ) -> _{name}State: ..."));
    text
}

/// The attributes of states.
fn attributes(info: &Info) -> impl Iterator<Item = (String, &Slot)> {
    let coordinates = info.coordinates.iter();
    let both =
        coordinates.flat_map(|slot| [(slot.name.clone(), slot), (format!("{}_rate", slot.name), slot)]);
    both.chain(info.inputs.iter().map(|slot| (slot.name.clone(), slot)))
}

/// The words that Python takes for no name. A parameter with such a name is given as
/// `Model(**{"lambda": 1.0})`, and read by `getattr`.
pub(crate) fn keywords(py: Python<'_>) -> PyResult<Vec<String>> {
    py.import("keyword")?.getattr("kwlist")?.extract()
}
