//! Generalized speeds: what `#[speeds(..)]` names, and the functions with `#[kinematic]` that say what they
//! are.

use dynamics_symbolic::mechanics::{Output, Speed};

use super::Elaborator;
use super::values::{Scalar, UnitOf, Value, flatten};
use crate::diagnostics::Place;
use crate::messages;
use crate::syntax::{Function, Quantity, Role};

/// What a declared speed is: its components and their units, or lost to a mistake.
pub(super) struct Defined {
    /// Its index among the declared ones.
    of: usize,
    components: Vec<(Scalar, UnitOf)>,
}

impl Elaborator<'_> {
    /// Takes the value of a function with `#[kinematic]` for the speed of its name.
    pub(super) fn kinematic(&mut self, function: &Function, value: Value) {
        let declared = &self.declaration.speeds;
        let Some(of) = declared.iter().position(|speed| speed.name == function.name) else {
            let known: Vec<String> = declared.iter().map(|speed| speed.name.to_string()).collect();
            let hint = crate::suggest::did_you_mean_only(
                &function.name.to_string(),
                known.iter().map(String::as_str),
            );
            return self
                .diagnostics
                .error(function.name.span(), &messages::kinematic_without_speed(&function.name, hint));
        };
        // What is lost to a mistake is reported already.
        let lost = |value: &Value| matches!(value, Value::Poison);
        if lost(&value) || matches!(&value, Value::Array(items) if items.iter().any(lost)) {
            return;
        }
        let value = match value {
            Value::Integer(_) => self.scalar(value, function.name.span()).into(),
            value => value,
        };
        let speed = &self.declaration.speeds[of];
        let (mut components, mut units) = (Vec::new(), Vec::new());
        let flat = !matches!(&value, Value::Array(items)
            if items.iter().any(|item| !matches!(item, Value::Scalar(_))))
            && flatten(&value, "", &mut components, &mut units);
        if !flat
            || components.len() != speed.scalars()
            || speed.length.is_some() == matches!(value, Value::Scalar(_))
        {
            let place = Place::of(&function.item.sig.output);
            let message = messages::kinematic_shape(&function.name, shape(speed), value.shape());
            return self.diagnostics.error(place, &message);
        }
        let given = self.declared_unit(speed.unit.as_ref());
        for (unit, place) in units.iter().map(|unit| (unit, Place::from(function.name.span()))) {
            let message = |found, expected| messages::unit_of_speed(&function.name, found, expected);
            if self.equate(unit, &given, place, message).is_none() {
                return;
            }
        }
        let components = components.into_iter().map(|(_, scalar)| scalar).zip(units).collect();
        self.speeds.push(Defined { of, components });
    }

    /// The speeds in the order in which they are declared, each an output as well.
    pub(super) fn add_speeds(&mut self) {
        let declaration = self.declaration;
        self.speeds.sort_by_key(|defined| defined.of);
        for Defined { of, components } in std::mem::take(&mut self.speeds) {
            let quantity: &Quantity = &declaration.speeds[of];
            let origin = self.origins.add(Place::from(quantity.name.span()));
            let units: Vec<UnitOf> = components.iter().map(|(_, unit)| unit.clone()).collect();
            let declared = quantity.unit.as_ref().map(|unit| unit.text());
            let unit = declared.unwrap_or_else(|| self.common_unit(&units));
            let suffix = |i: usize| quantity.length.map_or_else(String::new, |_| format!("[{i}]"));
            let named = components.iter().enumerate().map(|(i, (scalar, _))| (suffix(i), scalar.node));
            let name = quantity.name.to_string();
            let output = Output { name, components: named.collect(), unit: unit.clone(), origin };
            self.model.outputs.push(output);
            let speeds = quantity.names().into_iter().zip(components);
            self.model.speeds.extend(speeds.map(|(name, (scalar, _))| Speed {
                name,
                unit: unit.clone(),
                node: scalar.node,
                origin,
            }));
        }
    }

    /// Every declared speed has its function.
    pub(super) fn check_speeds_are_defined(&mut self) {
        let (declaration, implementation) = (self.declaration, self.implementation);
        for speed in &declaration.speeds {
            let is_its = |f: &Function| f.name == speed.name && f.role == Role::Kinematic;
            if !implementation.functions.iter().any(is_its) {
                self.diagnostics.error(speed.name.span(), &messages::speed_without_kinematic(&speed.name));
            }
        }
    }
}

/// How a speed is returned.
fn shape(speed: &Quantity) -> String {
    match speed.length {
        None => "an `Expr`".to_owned(),
        Some(n @ (2 | 3)) => format!("a `Vec{n}` or `[Expr; {n}]`"),
        Some(n) => format!("`[Expr; {n}]`"),
    }
}
