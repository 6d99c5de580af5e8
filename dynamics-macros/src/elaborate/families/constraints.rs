//! Constraints of models with families: a row for every index, or rows by themselves.

use dynamics_symbolic::families::{FamilyConstraint, Rounds, RowPart};
use dynamics_symbolic::mechanics::ConstraintKind;

use super::super::Elaborator;
use super::super::values::{Scalar, UnitOf, Value, flatten};
use crate::messages;
use crate::syntax::{Function, Role};

impl Elaborator<'_> {
    /// Adds a constraint to the model: a list of values has rows for every index; of a sum over an index the
    /// rounds add to one row.
    pub(in super::super) fn family_constraint(&mut self, index: usize, function: &Function, value: Value) {
        // Its reaction is read by outputs alone, which run as they are written.
        self.lost_constraint(index, function);
        if function.options.switched || function.options.redundant.is_some() {
            let option = if function.options.switched { "switched" } else { "redundant" };
            let message = messages::constraint_option_beside_families(option);
            return self.diagnostics.error(function.role_place, &message);
        }
        let numbered = matches!(value, Value::Mapped(_));
        let values: Vec<(Rounds, Value)> = match value {
            Value::Mapped(made) => made.to_vec(),
            Value::Total(total) => {
                let once = (Rounds::Once, total.rest.clone());
                total.rounds.iter().cloned().chain([once]).collect()
            }
            other => vec![(Rounds::Once, other)],
        };
        let mut names: Option<Vec<String>> = None;
        let mut parts = Vec::new();
        for (rounds, value) in values {
            let range = match rounds {
                Rounds::Once => None,
                Rounds::Over(range) => Some(range),
                Rounds::Nested(..) => {
                    let message = messages::constraint_of_two_indices();
                    return self.diagnostics.error(function.role_place, &message);
                }
            };
            let value = match value {
                Value::Integer(_) => self.scalar(value, function.name.span()).into(),
                value => value,
            };
            let (mut components, mut units): (Vec<(String, Scalar)>, Vec<UnitOf>) = (Vec::new(), Vec::new());
            if !flatten(&value, "", &mut components, &mut units) || components.is_empty() {
                return self.wrong_result(function, "a scalar, a vector, or a list of them", &value);
            }
            let (own, values): (Vec<String>, Vec<_>) =
                components.into_iter().map(|(suffix, scalar)| (suffix, scalar.node)).unzip();
            if *names.get_or_insert_with(|| own.clone()) != own {
                return self.wrong_result(function, "values of one shape in all rounds", &value);
            }
            parts.push(RowPart { range, values });
        }
        let Some(components) = names else { return };
        let kind = match function.role {
            Role::Holonomic => ConstraintKind::Holonomic,
            _ => ConstraintKind::Nonholonomic { integrable: function.options.integrable.is_some() },
        };
        let origin = self.origins.add_constraint(function);
        self.families.found.constraints.push(FamilyConstraint {
            name: function.name.to_string(),
            kind,
            numbered,
            units: vec![String::new(); components.len()],
            components,
            parts,
            origin,
        });
    }
}
