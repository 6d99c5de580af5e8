//! Adds the classes of models to a module of Python.

use std::sync::Arc;

use dynamics::model::Described;
use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyDict, PyList, PyModule, PyTuple, PyType};

use crate::erased::AnyClass;
use crate::errors;
use crate::info::{Field, Info, Slot};
use crate::linear::{Equilibrium, Linearization};
use crate::live::LivePage;
use crate::model::{CLASS, ClassOfModel, Model};
use crate::motion::Motion;
use crate::state::State;
use crate::stub;
use crate::summary::{Event, Summary};
use crate::typed::{Class, ModelFields};

/// Adds what all models share.
///
/// # Errors
/// Python's own.
pub fn shared(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let name = module.name()?;
    let classes = [
        py.get_type::<Model>(),
        py.get_type::<State>(),
        py.get_type::<Motion>(),
        py.get_type::<Summary>(),
        py.get_type::<Event>(),
        py.get_type::<LivePage>(),
        py.get_type::<Equilibrium>(),
        py.get_type::<Linearization>(),
    ];
    let errors = errors::NAMES.map(|name| errors::class(py, name));
    let errors: Vec<_> = errors.into_iter().collect::<PyResult<_>>()?;
    for class in classes.into_iter().chain(errors) {
        // Under this name pickled objects find their class.
        class.setattr("__module__", &name)?;
        module.add(class.name()?.to_cow()?.as_ref(), &class)?;
    }
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}

/// Adds the class of a model.
///
/// # Errors
/// Python's own.
pub fn model<F: ModelFields>(module: &Bound<'_, PyModule>) -> PyResult<()> {
    const {
        assert!(
            !crate::is_class(<F::Model as Described>::NAME),
            "the model has the name of a class that every module has, such as State or Motion; rename it"
        );
    }
    let py = module.py();
    let class: Arc<dyn AnyClass> = Arc::new(Class::<F>::new());
    let info = Arc::clone(class.info());
    let content = PyDict::new(py);
    content.set_item("__module__", module.name()?)?;
    content.set_item("__doc__", documentation(&info))?;
    content.set_item("__slots__", ())?;
    content.set_item(CLASS, Bound::new(py, ClassOfModel { class })?)?;
    for (name, text) in [
        ("EQUATIONS", info.equations),
        ("LATEX", info.latex),
        ("REPORT", info.report),
        ("LISTING", info.listing),
    ] {
        content.set_item(name, text)?;
    }
    let names = |slots: &[Slot]| PyTuple::new(py, slots.iter().map(|slot| slot.name.clone()));
    content.set_item("COORDINATES", names(&info.coordinates)?)?;
    content.set_item("INPUTS", names(&info.inputs)?)?;
    content.set_item("PARAMETERS", PyTuple::new(py, info.fields.iter().map(|field| field.name))?)?;
    content.set_item("OUTPUTS", PyTuple::new(py, info.outputs.iter().map(|output| output.name))?)?;
    content.set_item("EVENTS", PyTuple::new(py, info.events.iter().map(|event| event.name))?)?;
    content.set_item("CONSTRAINTS", PyTuple::new(py, info.constraints.iter().map(|(name, _)| *name))?)?;
    content.set_item("CONSERVED", PyTuple::new(py, info.conserved.iter())?)?;
    content.set_item("UNITS", units(py, &info)?)?;
    let property = py.import("builtins")?.getattr("property")?;
    for field in &info.fields {
        let getter = getter(py, field.name)?;
        content.set_item(field.name, property.call1((getter, py.None(), py.None(), field.about()))?)?;
    }
    content.set_item("__signature__", signature(py, &info)?)?;
    let bases = PyTuple::new(py, [py.get_type::<Model>()])?;
    let made = py.get_type::<PyType>().call1((info.name, bases, content))?.cast_into::<PyType>()?;
    module.add(info.name, &made)?;
    // The class is made once for every module object; the first one stays.
    let _ = info.class.set(made.unbind());
    Ok(())
}

/// Adds the function that writes stubs for the classes that were added.
///
/// # Errors
/// Python's own.
pub fn stubs(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let content = module.clone().unbind();
    let name = c"stub";
    let doc = c"Type stubs of this module: write them to its .pyi file, beside py.typed.";
    let function = PyCFunction::new_closure(py, Some(name), Some(doc), move |args, _| {
        stub::stub(content.bind(args.py()))
    })?;
    module.add("stub", function)
}

/// The getter of a parameter.
fn getter<'py>(py: Python<'py>, field: &'static str) -> PyResult<Bound<'py, PyCFunction>> {
    PyCFunction::new_closure(py, None, None, move |args, _| -> PyResult<Py<PyAny>> {
        let model = args.get_item(0)?;
        let model = model.cast::<Model>()?;
        Ok(model.get().parameter(args.py(), field)?.unbind())
    })
}

/// The documentation of a class: that of the struct, and its parameters with their units.
fn documentation(info: &Info) -> String {
    let mut text = format!("{}\n", info.documentation.trim());
    let list = |title: &str, entries: Vec<String>| match entries.is_empty() {
        true => String::new(),
        false => format!("\n{title}: {}.\n", entries.join(", ")),
    };
    text += &list("Parameters", info.fields.iter().map(|field| field.shown()).collect());
    text += &list("Coordinates", info.coordinates.iter().map(Slot::shown).collect());
    text += &list("Inputs", info.inputs.iter().map(Slot::shown).collect());
    text += &list("Speeds", info.speeds.iter().map(Slot::shown).collect());
    let quantity = |quantity: &dynamics::model::Quantity| match quantity.unit {
        "" => quantity.name.to_owned(),
        unit => format!("{} ({unit})", quantity.name),
    };
    text += &list("Outputs", info.outputs.iter().map(quantity).collect());
    text += &list("Events", info.events.iter().map(|event| event.name.to_owned()).collect());
    text += &list("Constraints", info.constraints.iter().map(|(name, _)| (*name).to_owned()).collect());
    text
}

/// Units of all quantities by name, `""` where there is none.
fn units<'py>(py: Python<'py>, info: &Info) -> PyResult<Bound<'py, PyDict>> {
    let units = PyDict::new(py);
    info.fields.iter().try_for_each(|field| units.set_item(field.name, &field.unit))?;
    for slot in info.coordinates.iter().chain(&info.inputs).chain(&info.speeds) {
        units.set_item(&slot.name, &slot.unit)?;
    }
    info.outputs.iter().try_for_each(|output| units.set_item(output.name, output.unit))?;
    Ok(units)
}

/// What `help` and editors show: keyword arguments by the names of the parameters.
fn signature<'py>(py: Python<'py>, info: &Info) -> PyResult<Bound<'py, PyAny>> {
    let inspect = py.import("inspect")?;
    let (kind, keywords) = (inspect.getattr("Parameter")?, stub::keywords(py)?);
    let parameters = PyList::empty(py);
    let (named, others): (Vec<&Field>, Vec<&Field>) =
        info.fields.iter().partition(|field| !keywords.iter().any(|keyword| keyword == field.name));
    for field in named {
        parameters.append(kind.call1((field.name, kind.getattr("KEYWORD_ONLY")?))?)?;
    }
    if !others.is_empty() {
        parameters.append(kind.call1(("_others", kind.getattr("VAR_KEYWORD")?))?)?;
    }
    inspect.getattr("Signature")?.call1((parameters,))
}
