//! Units of values while they are elaborated: where an operation demands equal units, and what a conflict is
//! called.

use std::rc::Rc;

use dynamics_symbolic::check::units::{Conflict, Dimension, Exponent, UnitExpr, Units};
use syn::Ident;

use super::Elaborator;
use super::values::{Scalar, UnitOf, Value, flatten};
use crate::diagnostics::Place;
use crate::messages::{self, Message};
use crate::syntax::Role;

/// The solver, and whether anything is declared that it could check.
#[derive(Clone, Debug, Default)]
pub(super) struct Dimensions {
    pub(super) units: Units,
    /// Some quantity has a declared unit other than 1 or rad.
    pub(super) active: bool,
}

impl Elaborator<'_> {
    /// The unit 1, where units are checked.
    pub(super) fn dimensionless(&self) -> UnitOf {
        self.known_unit(Dimension::ONE)
    }

    /// A known unit, where units are checked.
    pub(super) fn known_unit(&self, dimension: Dimension) -> UnitOf {
        self.dimensions.active.then(|| Rc::new(UnitExpr::known(dimension)))
    }

    /// An unknown unit, where units are checked.
    pub(super) fn unknown_unit(&mut self, label: &str) -> UnitOf {
        self.dimensions.active.then(|| Rc::new(self.dimensions.units.unknown(label)))
    }

    /// Notes the units of the vectors that a helper returns: they tell places from directions when a model
    /// without a drawing is drawn.
    pub(super) fn note_returned(&mut self, function: usize, value: &Value) {
        if !self.dimensions.active || self.implementation.functions[function].role != Role::Helper {
            return;
        }
        let (mut components, mut units) = (Vec::new(), Vec::new());
        if matches!(value, Value::Vector(_) | Value::Array(_))
            && flatten(value, "", &mut components, &mut units)
        {
            self.returned.insert(function, units);
        }
    }

    /// Helpers whose vectors have a unit other than a length's. One whose unit is not known may be a place.
    pub(super) fn vectors_that_are_no_places(&self) -> Vec<Ident> {
        let known = |unit: &UnitOf| unit.as_ref().and_then(|unit| self.dimensions.units.dimension(unit));
        let is_no_length =
            |unit: &UnitOf| known(unit).is_some_and(|dimension| dimension != Dimension::LENGTH);
        let returned = self.returned.iter().filter(|(_, units)| units.iter().any(is_no_length));
        returned.map(|(index, _)| self.implementation.functions[*index].name.clone()).collect()
    }

    /// Demands one unit of both; where they conflict, says so at `place` in the words of `message`(left,
    /// right).
    pub(super) fn equate(
        &mut self,
        left: &UnitOf,
        right: &UnitOf,
        place: impl Into<Place>,
        message: impl FnOnce(String, String) -> Message,
    ) -> Option<UnitOf> {
        let (a, b) = match (left, right) {
            _ if !self.dimensions.active => return Some(None),
            (Some(a), Some(b)) => (a, b),
            (Some(known), None) | (None, Some(known)) => return Some(Some(known.clone())),
            (None, None) => return Some(None),
        };
        if a == b {
            return Some(left.clone());
        }
        let place = self.diagnostics.shown_at(place.into());
        let origin = self.origins.add(place);
        match self.dimensions.units.equate(a, b, origin) {
            Ok(()) => Some(left.clone()),
            Err(Conflict { left, right, .. }) => {
                self.diagnostics.error(place, &message(left, right));
                None
            }
        }
    }

    /// Demands that the argument of `function` is a plain number or an angle.
    pub(super) fn require_dimensionless(
        &mut self,
        scalar: &Scalar,
        function: &str,
        place: impl Into<Place>,
    ) -> Option<()> {
        let one = self.dimensionless();
        self.equate(&scalar.unit, &one, place, |unit, _| messages::unit_of_argument(function, unit))
            .map(|_| ())
    }
}

/// The message of two units that one operator cannot combine; the remedy depends on whether one of them is a
/// plain number.
pub(super) fn mismatch(operator: impl std::fmt::Display, left: String, right: String) -> Message {
    let number = left == "1" || right == "1";
    let remedy = if number {
        "plain numbers have no unit, write the value as a parameter or a constant of the `impl`"
    } else {
        "both sides need the same unit"
    };
    messages::unit_mismatch(operator, left, right, remedy)
}

/// Product of units.
pub(super) fn product(a: &UnitOf, b: &UnitOf) -> UnitOf {
    Some(Rc::new(a.as_ref()?.mul(b.as_ref()?)))
}

/// Quotient of units.
pub(super) fn quotient(a: &UnitOf, b: &UnitOf) -> UnitOf {
    Some(Rc::new(a.as_ref()?.div(b.as_ref()?)))
}

/// Power of a unit.
pub(super) fn power(a: &UnitOf, exponent: Exponent) -> UnitOf {
    Some(Rc::new(a.as_ref()?.pow(exponent)))
}
