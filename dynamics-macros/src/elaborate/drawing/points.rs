//! Points: those that figures are drawn at, and those that have names.

use std::rc::Rc;

use dynamics_symbolic::mechanics::{DrawnPoint, NamedPoint};
use syn::ext::IdentExt;

use super::super::Elaborator;
use super::super::calls::Argument;
use super::super::values::Value;
use crate::diagnostics::Place;
use crate::messages;
use crate::syntax::{Declaration, Quantity, Role, UnitText};

impl<'a> Elaborator<'a> {
    /// What converts into a point of a drawing: a vector, or two or three numbers.
    pub(super) fn point(&mut self, (value, at): &Argument) -> Option<DrawnPoint> {
        let vector = match value {
            Value::Array(items) if (2..=3).contains(&items.len()) => {
                self.vector_of(items.iter().map(|item| (item.clone(), *at)).collect())
            }
            other => other.clone(),
        };
        match vector {
            Value::Vector(v) => Some(v.iter().map(|x| x.node).collect()),
            Value::Poison => None,
            other => {
                self.fail(*at, &messages::expected_shape("a point", other.shape()));
                None
            }
        }
    }

    /// Some points.
    pub(super) fn points(&mut self, (value, at): &Argument) -> Option<Vec<DrawnPoint>> {
        match value {
            Value::Array(items) | Value::Sequence(items) => {
                items.iter().map(|item| self.point(&(item.clone(), *at))).collect()
            }
            Value::Poison => None,
            other => {
                self.fail(*at, &messages::not_iterable(other.shape()));
                None
            }
        }
    }

    /// The points that have names: what helpers return that may be places, or coordinates called `x` and `y`.
    /// Whether a helper returns places or other vectors its unit tells.
    pub(super) fn named_points(&mut self) -> Vec<NamedPoint> {
        let functions = &self.implementation.functions;
        let mut found = Vec::new();
        for (index, function) in functions.iter().enumerate() {
            if function.role == Role::Helper && function.may_be_place() {
                let units = self.dimensions.active;
                let mut value = self.followed_result(index);
                if let (Ok(value), true) = (&value, units) {
                    self.note_returned(index, value);
                }
                if value.is_err() && units {
                    // Its units may be what is wrong with it: that is no matter here.
                    self.dimensions.active = false;
                    value = self.followed_result(index);
                    self.dimensions.active = true;
                }
                if let Ok(value) = value {
                    found.push((function.name.clone(), value));
                }
            }
        }
        let vectors = self.vectors_that_are_no_places();
        found.retain(|(name, _)| !vectors.contains(name));
        let mut points = Vec::new();
        for (name, value) in found {
            let mut all = Vec::new();
            places(&value, &mut all);
            let (name, several) = (name.unraw().to_string(), all.len() > 1);
            points.extend(all.into_iter().enumerate().map(|(k, at)| {
                let name = if several { format!("{name}[{k}]") } else { name.clone() };
                NamedPoint { name, at }
            }));
        }
        if points.is_empty() { self.places_by_name() } else { points }
    }

    /// Whether coordinates are places by their names.
    pub(super) fn has_places_by_name(&self) -> bool {
        places_among(self.declaration).next().is_some()
    }

    fn places_by_name(&mut self) -> Vec<NamedPoint> {
        let mut found = Vec::new();
        let declaration = self.declaration;
        for axes in places_among(declaration) {
            let names: Vec<String> = axes.iter().map(|axis| axis.name.unraw().to_string()).collect();
            let values: Vec<Value> = axes.iter().map(|axis| self.coordinate(&axis.name)).collect();
            for k in 0..axes[0].length.unwrap_or(1) {
                let index = axes[0].length.map(|_| format!("[{k}]")).unwrap_or_default();
                let element = |value: &Value| match value {
                    Value::Array(items) => items.get(k).cloned(),
                    value => Some(value.clone()),
                };
                let place = Place::from(axes[0].name.span());
                let parts: Vec<Value> = values.iter().filter_map(element).collect();
                let Some(at) = self.point(&(Value::Array(Rc::new(parts)), place)) else { continue };
                let names: Vec<String> = names.iter().map(|name| format!("{name}{index}")).collect();
                found.push(NamedPoint { name: names.join(", "), at });
            }
        }
        found
    }
}

/// The places in a vector or in an array of them.
fn places(value: &Value, found: &mut Vec<DrawnPoint>) {
    match value {
        Value::Vector(v) => found.push(v.iter().map(|x| x.node).collect()),
        Value::Array(items) => items.iter().for_each(|item| places(item, found)),
        _ => {}
    }
}

/// Groups of coordinates that are the parts of a place by their names, `x` and `y`, `x1`, `y1` and `z1`:
/// lengths, or of no declared unit.
fn places_among(declaration: &Declaration) -> impl Iterator<Item = Vec<&Quantity>> {
    let all = &declaration.coordinates;
    all.iter().filter_map(move |x| {
        let name = x.name.unraw().to_string();
        let rest = name.strip_prefix('x')?;
        let unit = |quantity: &Quantity| quantity.unit.as_ref().map(UnitText::text).unwrap_or_default();
        if !matches!(unit(x).as_str(), "" | "m" | "ft") || x.columns.is_some() {
            return None;
        }
        let beside = |axis: &str| {
            let wanted = format!("{axis}{rest}");
            let like_x = |other: &&Quantity| other.length == x.length && unit(other) == unit(x);
            all.iter().filter(like_x).find(|other| other.name.unraw() == wanted)
        };
        Some([x, beside("y")?].into_iter().chain(beside("z")).collect())
    })
}
