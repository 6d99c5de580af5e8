//! Symbols of the declared coordinates, inputs and parameters, and their units.

use std::rc::Rc;

use dynamics_symbolic::check::units::{Unit, UnitError};
use dynamics_symbolic::families::{Anchor, Local, NodeIndex};
use dynamics_symbolic::graph::{FunctionId, Symbol};
use dynamics_symbolic::mechanics::{Coordinate, Function, Input, Parameter};
use proc_macro2::Span;

use super::Elaborator;
use super::values::{Numbered, Scalar, UnitOf, Value};
use crate::diagnostics::Place;
use crate::messages;
use crate::syntax::{FieldKind, Quantity, Shape, UnitText};

/// What a declared unit is, once read.
#[derive(Clone, Debug)]
struct DeclaredUnit {
    unit: UnitOf,
    text: String,
}

/// Kind of scalar symbol.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum SymbolKind {
    Coordinate,
    Input,
    Parameter,
}

impl Elaborator<'_> {
    /// Declares everything; units first, because they are checked only where some are given.
    pub(super) fn declare(&mut self) {
        let declaration = self.declaration;
        let quantities = declaration.coordinates.iter().chain(&declaration.speeds).chain(&declaration.inputs);
        let units: Vec<&UnitText> = quantities
            .filter_map(|q| q.unit.as_ref())
            .chain(declaration.fields.iter().filter_map(|f| f.unit.as_ref()))
            .chain(declaration.output_units.iter().map(|(_, unit)| unit))
            .collect();
        let dimensional = |unit: &&UnitText| {
            let parsed = Unit::parse_tokens(&unit.tokens());
            matches!(parsed, Ok(Some(unit)) if !unit.dimension.is_one())
        };
        self.dimensions.active = units.iter().any(dimensional);

        let counts = declaration.counts().map(ToString::to_string).collect::<Vec<_>>();
        self.families.found.least = vec![0; counts.len()];
        self.families.found.counts = counts;
        for quantity in &declaration.coordinates {
            let value = self.coordinate_value(quantity);
            self.coordinates.push((quantity.name.to_string(), value));
        }
        for quantity in &declaration.inputs {
            let value = self.quantity(quantity, SymbolKind::Input);
            self.coordinates.push((quantity.name.to_string(), value));
        }
        let time = Scalar {
            node: self.model.graph.symbol(Symbol::Time),
            unit: self.known_unit(dynamics_symbolic::check::units::Dimension::TIME),
        };
        self.coordinates.push(("t".into(), Value::Scalar(time)));
        for field in &declaration.fields {
            let place = Place::from(field.name.span());
            let declared = self.declared(field.unit.as_ref());
            let name = field.name.to_string();
            let value = match &field.kind {
                FieldKind::Parameter { shape, first } => {
                    let nominal = field.nominal.iter().flat_map(|n| n.values.iter().copied());
                    self.model.nominal.extend((*first as u32..).zip(nominal));
                    let mut names = shape.elements().into_iter().map(|e| format!("{name}{}", e.suffix));
                    self.parameter_value(shape, &declared, place, &mut names)
                }
                FieldKind::Count => self.count(&field.name),
                FieldKind::Numbered => {
                    let unit = declared.unit.clone().or_else(|| self.unknown_unit(&name));
                    let unit_text = declared.text;
                    self.families.parameters.push(Numbered { name: name.clone(), unit, unit_text, place });
                    self.families.found.numbered.push(name.clone());
                    Value::Numbered(self.families.parameters.len() - 1)
                }
                FieldKind::Function(index) => {
                    let origin = self.origins.add(place);
                    let unit = declared.text.clone();
                    self.model.functions.push(Function { name: name.clone(), unit, origin });
                    let argument = self.unknown_unit(&format!("argument of {name}"));
                    let result = declared.unit.clone().or_else(|| self.unknown_unit(&name));
                    self.functions.push((argument, result));
                    Value::Function(FunctionId(*index as u32))
                }
            };
            self.parameters.push((name, value));
        }
    }

    /// A declared coordinate. Where counts have no values, elements have coordinates, and a family has none.
    fn coordinate_value(&mut self, quantity: &Quantity) -> Value {
        if !self.families.symbolic {
            return self.quantity(quantity, SymbolKind::Coordinate);
        }
        let (name, place) = (quantity.name.to_string(), Place::from(quantity.name.span()));
        let declared = self.declared(quantity.unit.as_ref());
        let unit = declared.unit.clone().or_else(|| self.unknown_unit(&name));
        self.note_field(&quantity.name, declared.text.clone());
        let field = self.families.coordinates.len();
        let (node_unit, unit_text) = (unit.clone(), declared.text);
        self.families.coordinates.push(Numbered { name: name.clone(), unit, unit_text, place });
        if quantity.family.is_some() {
            return Value::Family(field);
        }
        if quantity.length.is_some() {
            return self.fail(place, &messages::array_beside_families(&name));
        }
        let index = NodeIndex::Fixed(Anchor::Start(0));
        self.families.found.locals.push(Local::of(field as u32, index));
        let text = self.families.coordinates[field].unit_text.clone();
        self.declare_symbol(SymbolKind::Coordinate, name, text, place);
        let number = self.model.coordinates.len() as u32 - 1;
        Scalar { node: self.model.graph.symbol(Symbol::Coordinate(number)), unit: node_unit }.into()
    }

    fn quantity(&mut self, quantity: &Quantity, kind: SymbolKind) -> Value {
        let declared = self.declared(quantity.unit.as_ref());
        let place = Place::from(quantity.name.span());
        let scalars: Vec<Value> = quantity
            .names()
            .into_iter()
            .map(|n| Value::Scalar(self.declare_scalar(kind, n, &declared, place)))
            .collect();
        match (quantity.length, quantity.columns, scalars.first()) {
            (None, _, Some(scalar)) => scalar.clone(),
            (_, Some(columns), _) if columns > 0 => {
                Value::array(scalars.chunks(columns).map(|row| Value::array(row.to_vec())).collect())
            }
            _ => Value::array(scalars),
        }
    }

    /// One scalar symbol.
    fn declare_scalar(
        &mut self,
        kind: SymbolKind,
        name: String,
        declared: &DeclaredUnit,
        place: Place,
    ) -> Scalar {
        let unit = declared.unit.clone().or_else(|| self.unknown_unit(&name));
        let symbol = self.declare_symbol(kind, name, declared.text.clone(), place);
        Scalar { node: self.model.graph.symbol(symbol), unit }
    }

    /// A symbol with its name, its unit as text, and where it was declared.
    pub(super) fn declare_symbol(
        &mut self,
        kind: SymbolKind,
        name: String,
        text: String,
        place: Place,
    ) -> Symbol {
        let origin = self.origins.add(place);
        let model = &mut self.model;
        match kind {
            SymbolKind::Coordinate => {
                model.coordinates.push(Coordinate { name, unit: text, origin });
                Symbol::Coordinate(model.coordinates.len() as u32 - 1)
            }
            SymbolKind::Input => {
                model.inputs.push(Input { name, unit: text, origin });
                Symbol::Input(model.inputs.len() as u32 - 1)
            }
            SymbolKind::Parameter => {
                model.parameters.push(Parameter { name, unit: text, origin });
                Symbol::Parameter(model.parameters.len() as u32 - 1)
            }
        }
    }

    /// A parameter of any shape, its scalars in the order of `Shape::elements`.
    fn parameter_value(
        &mut self,
        shape: &Shape,
        declared: &DeclaredUnit,
        place: Place,
        names: &mut impl Iterator<Item = String>,
    ) -> Value {
        let mut next = |this: &mut Self| {
            let name = names.next().unwrap_or_default();
            this.declare_scalar(SymbolKind::Parameter, name, declared, place)
        };
        match shape {
            Shape::Scalar => Value::Scalar(next(self)),
            Shape::Vector2 => Value::Vector(vec![next(self), next(self)]),
            Shape::Vector3 => Value::Vector(vec![next(self), next(self), next(self)]),
            Shape::Matrix3 => Value::matrix([(); 3].map(|()| [(); 3].map(|()| next(self)))),
            Shape::Array(length, inner) => Value::array(
                (0..*length).map(|_| self.parameter_value(inner, declared, place, names)).collect(),
            ),
        }
    }

    /// Reads a declared unit; unknown where none is declared or it cannot be read.
    fn declared(&mut self, unit: Option<&UnitText>) -> DeclaredUnit {
        let unknown = DeclaredUnit { unit: None, text: String::new() };
        let Some(text) = unit else { return unknown };
        let unit = match Unit::parse_tokens(&text.tokens()) {
            Ok(Some(unit)) => unit,
            Ok(None) => return unknown,
            Err(error) => {
                self.unit_error(text, &error);
                return unknown;
            }
        };
        let origin = self.origins.add(text.place());
        match self.dimensions.units.declare(&unit, origin) {
            Ok(expr) => DeclaredUnit { unit: self.dimensions.active.then(|| Rc::new(expr)), text: unit.text },
            Err(mixed) => {
                let message = messages::mixed_systems(
                    mixed.unit,
                    mixed.system.name(),
                    mixed.other,
                    mixed.other_system.name(),
                );
                self.diagnostics.error(text.place(), &message);
                unknown
            }
        }
    }

    /// A declared unit with its text.
    pub(super) fn declared_text(&mut self, unit: &UnitText) -> (UnitOf, String) {
        let DeclaredUnit { unit, text } = self.declared(Some(unit));
        (unit, text)
    }

    /// A declared unit by itself.
    pub(super) fn declared_unit(&mut self, unit: Option<&UnitText>) -> UnitOf {
        self.declared(unit).unit
    }

    fn unit_error(&mut self, text: &UnitText, error: &UnitError) {
        let at: Span = text.span(error.token());
        let message = match error {
            UnitError::Unknown { name, suggestion, .. } => {
                let hint = match suggestion {
                    Some(known) => format!("did you mean `{known}`?"),
                    None => {
                        "use coherent units such as `m`, `kg`, `s`, `N` or `ft`, `slug`, `s`, `lb`".into()
                    }
                };
                messages::unknown_unit(name, hint)
            }
            UnitError::Scaled { name, equals, coherent, .. } => messages::scaled_unit(name, equals, coherent),
            UnitError::Mixed { name, system, before, .. } => {
                messages::mixed_unit(name, system.name(), before.name())
            }
            UnitError::Syntax { expected, found, .. } => {
                let found = found.as_ref().map_or_else(|| "the end".into(), |f| format!("`{f}`"));
                messages::unit_syntax(expected, found)
            }
            _ => messages::unit_syntax("a small exponent", "this one"),
        };
        self.diagnostics.error(at, &message);
    }

    /// Units that were inferred, for reports: only where nothing in them is unknown any more.
    pub(super) fn name_inferred_units(&mut self) {
        if !self.dimensions.active {
            return;
        }
        let units = &self.dimensions.units;
        let text = |unit: &UnitOf| {
            let known = unit.as_ref().filter(|u| units.dimension(u).is_some_and(|d| !d.is_one()))?;
            Some(units.text(known))
        };
        let mut scalars = Vec::new();
        for (_, value) in self.coordinates.iter().chain(&self.parameters) {
            super::derivative::collect(value, &mut scalars);
        }
        for scalar in scalars {
            let dynamics_symbolic::graph::Node::Symbol(symbol) = self.model.graph.node(scalar.node) else {
                continue;
            };
            let slot = match symbol {
                Symbol::Coordinate(i) => self.model.coordinates.get_mut(i as usize).map(|c| &mut c.unit),
                Symbol::Input(i) => self.model.inputs.get_mut(i as usize).map(|c| &mut c.unit),
                Symbol::Parameter(i) => self.model.parameters.get_mut(i as usize).map(|c| &mut c.unit),
                _ => None,
            };
            if let Some(slot) = slot.filter(|s| s.is_empty())
                && let Some(text) = text(&scalar.unit)
            {
                *slot = text;
            }
        }
        for (function, (_, unit)) in self.model.functions.iter_mut().zip(&self.functions) {
            if function.unit.is_empty() {
                function.unit = text(unit).unwrap_or_default();
            }
        }
    }
}
