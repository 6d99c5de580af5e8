//! Names, units and texts of a model, as its Python class shows them.

use dynamics::model::Quantity;
use pyo3::prelude::*;
use pyo3::types::PyType;
use std::sync::OnceLock;

/// A named quantity, scalar or array: `theta`, or `theta[0]` … `theta[9]`.
#[derive(Clone, Debug)]
pub(crate) struct Slot {
    pub(crate) name: String,
    /// Index of its first element.
    pub(crate) at: usize,
    /// Number of elements; `None` for a scalar.
    pub(crate) len: Option<usize>,
    pub(crate) unit: String,
}

impl Slot {
    /// Scalars with indices in their names, put together.
    pub(crate) fn of(quantities: &[Quantity]) -> Vec<Self> {
        let mut slots: Vec<Self> = Vec::new();
        for (at, quantity) in quantities.iter().enumerate() {
            let unit = quantity.unit.to_owned();
            let Some((name, _)) = quantity.name.split_once('[') else {
                slots.push(Self { name: quantity.name.to_owned(), at, len: None, unit });
                continue;
            };
            match slots.last_mut() {
                Some(last) if last.name == name => last.len = last.len.map(|len| len + 1),
                _ => slots.push(Self { name: name.to_owned(), at, len: Some(1), unit }),
            }
        }
        slots
    }

    /// Number of scalars.
    pub(crate) fn width(&self) -> usize {
        self.len.unwrap_or(1)
    }

    /// `theta (rad, 10 elements)`.
    pub(crate) fn shown(&self) -> String {
        let len = self.len.map(|len| format!("{len} elements"));
        let about: Vec<String> = [unit(&self.unit), len].into_iter().flatten().collect();
        if about.is_empty() { self.name.clone() } else { format!("{} ({})", self.name, about.join(", ")) }
    }
}

fn unit(unit: &str) -> Option<String> {
    (!unit.is_empty()).then(|| unit.to_owned())
}

/// A field of the model's struct: a parameter, or a function such as a spline.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub(crate) name: &'static str,
    pub(crate) unit: String,
    /// The first line of its documentation and more; empty where there is none.
    pub(crate) documentation: &'static str,
    /// Its type in stubs, as an argument.
    pub(crate) takes: &'static str,
    /// Its type in stubs, as an attribute.
    pub(crate) gives: &'static str,
}

impl Field {
    /// `m1 (kg)`.
    pub(crate) fn shown(&self) -> String {
        match unit(&self.unit) {
            Some(unit) => format!("{} ({unit})", self.name),
            None => self.name.to_owned(),
        }
    }

    /// The documentation of the attribute.
    pub(crate) fn about(&self) -> String {
        let text = self.documentation.trim();
        let unit = unit(&self.unit).map(|unit| format!("Unit: {unit}."));
        let parts: Vec<String> = [Some(text.to_owned()), unit].into_iter().flatten().collect();
        parts.join(" ").trim().to_owned()
    }
}

/// What is known of a model before it has values.
#[derive(Debug)]
pub struct Info {
    /// The class of Python, from which pickled states are made.
    pub(crate) class: OnceLock<Py<PyType>>,
    pub(crate) name: &'static str,
    pub(crate) documentation: &'static str,
    pub(crate) fields: Vec<Field>,
    pub(crate) coordinates: Vec<Slot>,
    pub(crate) inputs: Vec<Slot>,
    pub(crate) speeds: Vec<Slot>,
    /// Flattened: `x`, `place.y`, `force[2]`.
    pub(crate) outputs: &'static [Quantity],
    pub(crate) events: &'static [Quantity],
    /// Scalars in order, arrays flattened.
    pub(crate) scalars: Scalars,
    /// Rows of the constraints, `closure.x`.
    pub(crate) rows: &'static [Quantity],
    /// Names of the constraints, and whether they can be switched.
    pub(crate) constraints: Vec<(&'static str, bool)>,
    /// Names of the conserved quantities.
    pub(crate) conserved: Vec<&'static str>,
    pub(crate) equations: &'static str,
    pub(crate) latex: &'static str,
    pub(crate) report: &'static str,
    pub(crate) listing: &'static str,
}

/// The scalars of a state, in order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scalars {
    pub(crate) coordinates: &'static [Quantity],
    pub(crate) inputs: &'static [Quantity],
}

/// A part of a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Coordinates,
    Velocities,
    Inputs,
}

impl Info {
    /// The quantity of states with this name: `theta`, `theta_rate`, `torque`.
    pub(crate) fn find(&self, name: &str) -> Option<(Part, &Slot)> {
        let of = |slots: &'_ [Slot], name: &str| slots.iter().position(|slot| slot.name == name);
        if let Some(i) = of(&self.coordinates, name) {
            return Some((Part::Coordinates, &self.coordinates[i]));
        }
        if let Some(i) = of(&self.inputs, name) {
            return Some((Part::Inputs, &self.inputs[i]));
        }
        let i = of(&self.coordinates, name.strip_suffix("_rate")?)?;
        Some((Part::Velocities, &self.coordinates[i]))
    }

    /// Outputs by their common names: `place` of `place.x`.
    pub(crate) fn output_names(&self) -> Vec<String> {
        let common = |name: &str| name.split(['.', '[']).next().unwrap_or_default().to_owned();
        let mut names: Vec<String> = self.outputs.iter().map(|output| common(output.name)).collect();
        names.dedup();
        names
    }

    /// What can be given to `state(..)`, in words.
    pub(crate) fn state_names(&self) -> String {
        let coordinates = self.coordinates.iter().map(Slot::shown);
        let rates = self.coordinates.iter().map(|slot| format!("{}_rate", slot.name));
        let (inputs, speeds) = (self.inputs.iter().map(Slot::shown), self.speeds.iter().map(Slot::shown));
        coordinates.chain(rates).chain(inputs).chain(speeds).collect::<Vec<_>>().join(", ")
    }

    /// The parameters, in words.
    pub(crate) fn field_names(&self) -> String {
        let names: Vec<String> = self.fields.iter().map(Field::shown).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    }
}
