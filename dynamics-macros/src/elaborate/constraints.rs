//! Constraints, and what forces, outputs and events ask about them: `q.reaction(Self::rod)`,
//! `q.slip(Self::stick)`.

use std::rc::Rc;

use dynamics_symbolic::check::units::{Dimension, UnitExpr};
use dynamics_symbolic::graph::Symbol;
use dynamics_symbolic::mechanics::{Constraint, ConstraintKind};
use syn::{Expr, ExprMethodCall, Ident};

use super::Elaborator;
use super::derivative::rebuild;
use super::values::{Scalar, UnitOf, Value, flatten};
use crate::diagnostics::Place;
use crate::messages;
use crate::syntax::{Function, Role};

/// Most switched constraints of a model: `ActiveSet::MOST` of the runtime, two bits each in 64.
const MOST_SWITCHED: usize = 32;

/// A constraint that is elaborated.
pub(super) struct DeclaredConstraint {
    /// Index of its function.
    function: usize,
    /// λ in the shape that the function returns; poison where the function has a mistake.
    reaction: Value,
    /// Its index among the switched constraints.
    mode: Option<u32>,
    /// Units of its components.
    units: Vec<UnitOf>,
}

impl<'a> Elaborator<'a> {
    /// Adds a constraint with its rows to the model.
    pub(super) fn constraint(&mut self, index: usize, function: &Function, value: Value) {
        let value = match value {
            Value::Integer(_) => self.scalar(value, function.name.span()).into(),
            value => value,
        };
        let (mut components, mut units) = (Vec::new(), Vec::new());
        if !flatten(&value, "", &mut components, &mut units) || components.is_empty() {
            self.lost_constraint(index, function);
            return self.wrong_result(function, "a scalar, a vector or an array of them", &value);
        }
        let kind = match function.role {
            Role::Holonomic => ConstraintKind::Holonomic,
            _ => ConstraintKind::Nonholonomic { integrable: function.options.integrable.is_some() },
        };
        let reaction = self.multipliers(&value, &components, kind);
        let mode = function.options.switched.then(|| self.next_mode(function));
        let origin = self.origins.add_constraint(function);
        self.constraints.push(DeclaredConstraint { function: index, reaction, mode, units });
        self.model.constraints.push(Constraint {
            name: function.name.to_string(),
            kind,
            components: components.into_iter().map(|(suffix, s)| (suffix, s.node)).collect(),
            units: Vec::new(),
            redundant: function.options.redundant.is_some(),
            switched: function.options.switched,
            origin,
        });
    }

    /// A constraint whose mistake is reported: asking for its reaction is no further one.
    pub(super) fn lost_constraint(&mut self, index: usize, function: &Function) {
        if function.role.is_constraint() {
            let lost = DeclaredConstraint {
                function: index,
                reaction: Value::Poison,
                mode: None,
                units: Vec::new(),
            };
            self.constraints.push(lost);
        }
    }

    /// Units of constraints, for reports: once everything that units follow from has been elaborated.
    pub(super) fn name_constraint_units(&mut self) {
        let whole = self.constraints.iter().filter(|c| !c.reaction.is_poison());
        let units: Vec<Vec<String>> =
            whole.map(|c| c.units.iter().map(|unit| self.unit_text(unit)).collect()).collect();
        for (constraint, units) in self.model.constraints.iter_mut().zip(units) {
            constraint.units = units;
        }
    }

    /// λ of every row in the constraint's shape. Φ_qᵀλ is a generalized force. So λΦ is an energy, and
    /// λ(A q̇ + b) a power.
    fn multipliers(&mut self, value: &Value, components: &[(String, Scalar)], kind: ConstraintKind) -> Value {
        let first = self.model.constraints.iter().map(|c| c.components.len()).sum::<usize>();
        let work = match kind {
            ConstraintKind::Holonomic => Dimension::ENERGY,
            ConstraintKind::Nonholonomic { .. } => Dimension::POWER,
        };
        let graph = &mut self.model.graph;
        let scalars: Vec<Scalar> = (first..)
            .zip(components)
            .map(|(row, (_, component))| Scalar {
                node: graph.symbol(Symbol::Multiplier(row as u32)),
                unit: component.unit.as_ref().map(|unit| Rc::new(UnitExpr::known(work).div(unit))),
            })
            .collect();
        rebuild(value, &mut scalars.into_iter())
    }

    /// The index of a switched constraint among its like.
    fn next_mode(&mut self, function: &Function) -> u32 {
        let before = self.constraints.iter().filter(|c| c.mode.is_some()).count();
        if before == MOST_SWITCHED {
            self.diagnostics.error(function.role_place, &messages::too_many_switched(MOST_SWITCHED));
        }
        before as u32
    }

    /// `q.reaction(Self::name)`, `q.slip(Self::name)`.
    pub(super) fn of_constraint(&mut self, e: &'a ExprMethodCall) -> Value {
        let method = &e.method;
        if !matches!(self.role, Role::Force | Role::Output | Role::Event) {
            return self.fail(method.span(), &messages::reaction_in_role(method, self.role.name()));
        }
        if self.families.symbolic && self.role != Role::Output {
            return self.fail(method.span(), &messages::reaction_in_force_of_families());
        }
        if e.args.len() != 1 {
            return self.fail(method.span(), &messages::argument_count(method, 1, e.args.len()));
        }
        let argument = &e.args[0];
        let Some(name) = self.named_function(argument) else {
            return self.fail(Place::of(argument), &messages::reaction_argument(method));
        };
        self.constraint_named(method, name)
    }

    /// What `method` asks of the constraint with this name.
    pub(super) fn constraint_named(&mut self, method: &Ident, name: &Ident) -> Value {
        let functions = &self.implementation.functions;
        let Some(function) = functions.iter().position(|f| f.name == *name) else {
            let known: Vec<String> =
                functions.iter().filter(|f| f.role.is_constraint()).map(|f| f.name.to_string()).collect();
            let hint = crate::suggest::did_you_mean(&name.to_string(), known.iter().map(String::as_str));
            return self.fail(name.span(), &messages::unknown_constraint(name, hint));
        };
        let Some(declared) = self.constraints.iter().find(|c| c.function == function) else {
            return self.fail(name.span(), &messages::reaction_of_no_constraint(method, name));
        };
        if *method == "reaction" || declared.reaction.is_poison() {
            return declared.reaction.clone();
        }
        match declared.mode {
            Some(mode) => {
                let unit = self.dimensionless();
                Value::Scalar(Scalar { node: self.model.graph.symbol(Symbol::Mode(mode)), unit })
            }
            None => self.fail(name.span(), &messages::slip_of_unswitched(name)),
        }
    }

    /// The function that a path names: `Self::name`, `Model::name`, `path::Model::name`.
    fn named_function<'e>(&self, argument: &'e Expr) -> Option<&'e Ident> {
        let Expr::Path(path) = argument else { return None };
        let mut last = path.path.segments.iter().rev();
        let (name, ty) = (last.next()?, last.next()?);
        (ty.ident == "Self" || ty.ident == self.declaration.name).then_some(&name.ident)
    }
}
