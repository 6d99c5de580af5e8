//! Functions with a role: their signatures, their values, and what the model makes of them.

use dynamics_symbolic::check::units::{Dimension, Unit};
use dynamics_symbolic::families::TermKind;
use dynamics_symbolic::graph::{Dependence, NodeId};
use dynamics_symbolic::mechanics::{Energy, EnergyRole, Event, Force, ForceTerm, Input, Output};
use syn::ext::IdentExt;
use syn::{ImplItem, ReceiverKind, Type};

use super::dimensions::product;
use super::scope::{Flow, Frame};
use super::values::{Scalar, Term, UnitOf, Value, flatten};
use super::{Elaborator, Sums};
use crate::diagnostics::Place;
use crate::messages;
use crate::syntax::{Function, Quantity, Role, UnitText};

/// The generated function of every model: its builder of states.
const GENERATED_FUNCTION: &str = "state";
/// The generated constants of every model: its texts.
const GENERATED_CONSTANTS: &[&str] = &["REPORT", "LISTING", "EQUATIONS", "LATEX"];

/// Whether every model has a function or constant of the name of this one.
pub(crate) fn is_generated(item: &ImplItem) -> bool {
    match item {
        ImplItem::Fn(function) => function.sig.ident.unraw() == GENERATED_FUNCTION,
        ImplItem::Const(constant) => GENERATED_CONSTANTS.iter().any(|name| constant.ident.unraw() == name),
        _ => false,
    }
}

impl<'a> Elaborator<'a> {
    /// All functions with a role: the constraints first, since their rows have to be known where a reaction
    /// is read.
    pub(super) fn roles(&mut self) {
        self.check_something_moves();
        self.check_result_names();
        let implementation = self.implementation;
        for wanted in [
            |role| role == Role::Holonomic,
            |role| role == Role::Nonholonomic,
            |role: Role| {
                !role.is_constraint() && !matches!(role, Role::Helper | Role::Drawing | Role::Kinematic)
            },
            // Last: what they share with the energies is to have the energies' form.
            |role| role == Role::Kinematic,
        ] {
            for (index, function) in implementation.functions.iter().enumerate() {
                if wanted(function.role) {
                    self.role(index, function);
                }
                if self.exhausted {
                    return;
                }
            }
        }
    }

    /// A function with a role.
    fn role(&mut self, index: usize, function: &'a Function) {
        if !self.check_signature(function) {
            return self.lost_constraint(index, function);
        }
        self.role = function.role;
        let (raised, first) = (self.diagnostics.raised(), self.origins.len());
        let value = self.run(index, function);
        if self.exhausted {
            return;
        }
        if value.is_poison() {
            self.check_reported(function);
            self.lost_constraint(index, function);
        } else {
            self.take(index, function, value);
        }
        if self.diagnostics.raised() > raised {
            self.origins.mistaken_from(first);
        }
    }

    /// A model needs an energy that gives its coordinates inertia.
    fn check_something_moves(&mut self) {
        let mut roles = self.implementation.functions.iter().map(|f| f.role);
        if !roles.any(|r| matches!(r, Role::Kinetic | Role::Lagrangian)) && self.diagnostics.len() == 0 {
            let place = Place::of(&self.implementation.item.self_ty);
            self.diagnostics.error(place, &messages::no_kinetic_energy(&self.declaration.name));
        }
    }

    /// Tables, plots and analyses find outputs and events by name, beside what the model moves by.
    fn check_result_names(&mut self) {
        let declaration = self.declaration;
        let plain = |name: &dyn ToString| name.to_string().trim_start_matches("r#").to_owned();
        let quantities = |all: &[Quantity], what: &'static str| -> Vec<(String, String)> {
            all.iter().map(|quantity| (plain(&quantity.name), what.to_owned())).collect()
        };
        let mut taken = quantities(&declaration.coordinates, "a coordinate");
        for (suffix, what) in [("_rate", "the rate"), ("_acceleration", "the acceleration")] {
            for (name, _) in quantities(&declaration.coordinates, "") {
                taken.push((format!("{name}{suffix}"), format!("{what} of `{name}`")));
            }
        }
        taken.extend(quantities(&declaration.speeds, "a speed"));
        taken.extend(quantities(&declaration.inputs, "an input"));
        let moving = taken.len();
        taken.extend(declaration.fields.iter().map(|field| (plain(&field.name), "a parameter".to_owned())));
        taken.extend([
            ("t".to_owned(), "the time".to_owned()),
            ("energy".to_owned(), "the energy function".to_owned()),
        ]);
        for constant in &self.implementation.constants {
            if GENERATED_CONSTANTS.contains(&plain(&constant.name).as_str()) {
                self.diagnostics.error(constant.name.span(), &messages::generated_name(&constant.name));
            }
        }
        for function in &self.implementation.functions {
            let name = plain(&function.name);
            if name == GENERATED_FUNCTION {
                self.diagnostics.error(function.name.span(), &messages::generated_name(&name));
            }
            // An event is asked for where nothing else than events is; beside what moves it would be misread.
            let taken = match function.role {
                Role::Output => &taken[..],
                Role::Event => &taken[..moving],
                _ => continue,
            };
            if let Some((_, other)) = taken.iter().find(|(known, _)| *known == name) {
                self.diagnostics
                    .error(function.name.span(), &messages::result_name(name, function.role.name(), other));
            }
        }
    }

    /// Roles are called by the solver: with the model, the coordinates, and nothing else.
    fn check_signature(&mut self, function: &Function) -> bool {
        let signature = &function.item.sig;
        let returned = match function.role {
            Role::Force => "Force",
            _ => "Expr",
        };
        let allowed: &[&str] = match function.role {
            Role::Force => &["Force"],
            Role::Output | Role::Holonomic | Role::Nonholonomic | Role::Kinematic => {
                &["Expr", "Vec2", "Vec3"]
            }
            _ => &["Expr"],
        };
        // A type outside the vocabulary may be the user's alias; arrays have no path. Their value decides.
        const VOCABULARY: &[&str] =
            &["Expr", "Vec2", "Vec3", "Mat3", "Force", "f64", "bool", "usize", "i32", "f32"];
        let fitting = match function.returns() {
            Some(name) => allowed.contains(&name.as_str()) || !VOCABULARY.contains(&name.as_str()),
            None => !matches!(signature.output, syn::ReturnType::Default),
        };
        let by_reference = signature.receiver().is_some_and(|receiver| match &receiver.kind {
            ReceiverKind::Reference(_, _, mutability) => mutability.is_none(),
            ReceiverKind::Typed(_, ty) => {
                matches!(&**ty, Type::Reference(reference) if reference.mutability.is_none())
            }
            _ => false,
        });
        let plain = signature.asyncness.is_none()
            && signature.constness.is_none()
            && matches!(signature.safety, syn::Safety::Default)
            && signature.abi.is_none()
            && signature.generics.params.is_empty();
        let fits = fitting && by_reference && plain && function.takes_coordinates_only();
        if !fits {
            let form = format!("fn {}(&self, q: &Coordinates<Self>) -> {returned}", function.name);
            let place = Place::of(signature);
            self.diagnostics.error(place, &messages::role_signature(function.role.name(), form));
        }
        fits
    }

    /// The value of a function for `(&self, q)`.
    pub(super) fn run(&mut self, index: usize, function: &'a Function) -> Value {
        self.reach(index);
        self.frames.push(Frame { function: Some(index), scopes: vec![Vec::new()], ..Frame::default() });
        for (input, value) in function.item.sig.inputs.iter().zip([Value::Model, Value::Coordinates]) {
            match input {
                syn::FnArg::Receiver(_) => self.frame().declare("self".into(), value),
                syn::FnArg::Typed(argument) => self.bind(&argument.pat, value),
            }
        }
        let value = self.statements(&function.item.block.stmts);
        match self.frames.pop().and_then(|f| f.flow) {
            Some(Flow::Return(value)) => value,
            _ => value,
        }
    }

    /// A value is lost only to a mistake that is reported. Should this ever fail, silence would drop the
    /// function from the model.
    fn check_reported(&mut self, function: &Function) {
        // Outputs of models with families may hold what elements cannot.
        let lost = self.diagnostics.len() == 0 && !(self.families.symbolic && function.role == Role::Output);
        if lost {
            self.diagnostics.error(function.name.span(), &messages::not_followed(&function.name));
        }
    }

    /// Adds a role's value to the model.
    fn take(&mut self, index: usize, function: &'a Function, value: Value) {
        if self.families.symbolic {
            return self.take_of_families(index, function, value);
        }
        let place = Place::from(function.name.span());
        match function.role {
            Role::Kinetic => self.energy(function, value, EnergyRole::Kinetic),
            Role::Potential => self.energy(function, value, EnergyRole::Potential),
            Role::Lagrangian => self.energy(function, value, EnergyRole::Lagrangian),
            Role::Dissipation => self.energy(function, value, EnergyRole::Dissipation),
            Role::Force => self.force(function, value),
            Role::Holonomic | Role::Nonholonomic => self.constraint(index, function, value),
            Role::Kinematic => self.kinematic(function, value),
            Role::Output => self.output(function, value, place),
            Role::Event => {
                let Some(scalar) = self.result_scalar(function, value) else { return };
                let origin = self.origins.add(place);
                self.model.events.push(Event { name: function.name.to_string(), node: scalar.node, origin });
            }
            Role::Drawing | Role::Helper => {}
        }
    }

    /// The same in a model with families. Outputs run as functions; here their indices are checked, and live
    /// pages are told what they compute.
    fn take_of_families(&mut self, index: usize, function: &'a Function, value: Value) {
        let name = function.name.to_string();
        let role = match function.role {
            Role::Kinetic => EnergyRole::Kinetic,
            Role::Potential => EnergyRole::Potential,
            Role::Lagrangian => EnergyRole::Lagrangian,
            Role::Dissipation => EnergyRole::Dissipation,
            Role::Force => {
                let mut kind =
                    |this: &mut Self, value| this.force_terms(function, value).map(TermKind::Force);
                return self.family_terms(&name, returned(function), value, &mut kind);
            }
            Role::Output => return self.note_output(function, value),
            Role::Drawing | Role::Helper => return,
            Role::Holonomic | Role::Nonholonomic => return self.family_constraint(index, function, value),
            Role::Kinematic | Role::Event => {
                let instead = match function.role {
                    Role::Event => "make it an `#[output]`",
                    _ => "use the velocities of coordinates",
                };
                let message = messages::role_beside_families(function.role.name(), instead);
                return self.diagnostics.error(function.role_place, &message);
            }
        };
        let mut kind = |this: &mut Self, value| {
            let node = this.energy_scalar(function, value, role)?.node;
            Some(TermKind::Energy(role, node))
        };
        self.family_terms(&name, returned(function), value, &mut kind);
    }

    /// The value of an energy or a dissipation function; `None` where it is none, which is reported.
    fn energy_scalar(&mut self, function: &'a Function, value: Value, role: EnergyRole) -> Option<Scalar> {
        let scalar = self.result_scalar(function, value)?;
        let (dimension, what) = match role {
            EnergyRole::Dissipation => (Dimension::POWER, "a power"),
            _ => (Dimension::ENERGY, "an energy"),
        };
        let unit = self.known_unit(dimension);
        let message = |found, expected| messages::unit_of_role(&function.name, found, what, expected);
        self.equate(&scalar.unit, &unit, returned(function), message)?;
        Some(scalar)
    }

    fn energy(&mut self, function: &'a Function, value: Value, role: EnergyRole) {
        let Some(scalar) = self.energy_scalar(function, value, role) else { return };
        let apart = if self.sums == Sums::Apart { self.terms_of(function) } else { Vec::new() };
        let terms = if apart.is_empty() { vec![(scalar.node, returned(function))] } else { apart };
        for (node, place) in terms {
            let origin = self.origins.add(place);
            self.model.energies.push(Energy { name: function.name.to_string(), role, node, origin });
        }
    }

    /// The terms of a force; `None` where it is none, or has no power, which is reported.
    fn force_terms(&mut self, function: &Function, value: Value) -> Option<Vec<ForceTerm>> {
        let terms = match value {
            Value::Force(terms) => terms,
            other => {
                self.wrong_result(function, "a `Force`", &other);
                return None;
            }
        };
        let energy = self.known_unit(Dimension::ENERGY);
        let mut made = Vec::new();
        for term in terms.iter() {
            let units: Vec<UnitOf> = match term {
                Term::At { point, vector, .. } => {
                    point.iter().zip(vector).map(|(p, v)| product(&p.unit, &v.unit)).collect()
                }
                Term::Along { expression, magnitude, .. } => vec![product(&expression.unit, &magnitude.unit)],
            };
            for unit in units {
                let message = |found, expected| messages::unit_of_force(&function.name, found, expected);
                let (Term::At { place, .. } | Term::Along { place, .. }) = term;
                self.equate(&unit, &energy, *place, message)?;
            }
            let nodes = |scalars: &[Scalar]| scalars.iter().map(|s| s.node).collect();
            made.push(match term {
                Term::At { point, vector, .. } => {
                    ForceTerm::At { point: nodes(point), vector: nodes(vector) }
                }
                Term::Along { expression, magnitude, .. } => {
                    ForceTerm::Along { expression: expression.node, magnitude: magnitude.node }
                }
            });
        }
        Some(made)
    }

    fn force(&mut self, function: &Function, value: Value) {
        let places: Vec<Place> = match &value {
            Value::Force(terms) => {
                let place = |term: &Term| {
                    let (Term::At { place, .. } | Term::Along { place, .. }) = term;
                    *place
                };
                terms.iter().map(place).collect()
            }
            _ => Vec::new(),
        };
        let Some(made) = self.force_terms(function, value) else { return };
        let name = function.name.to_string();
        if self.sums == Sums::Whole {
            let origin = self.origins.add(returned(function));
            self.model.forces.push(Force { name, terms: made, origin });
            return;
        }
        for (place, made) in places.into_iter().zip(made) {
            let origin = self.origins.add(place);
            self.model.forces.push(Force { name: name.clone(), terms: vec![made], origin });
        }
    }

    fn output(&mut self, function: &Function, value: Value, place: Place) {
        let mut components = Vec::new();
        let mut units = Vec::new();
        if !flatten(&value, "", &mut components, &mut units) {
            return self.wrong_result(function, "a scalar, a vector or an array of them", &value);
        }
        let components: Vec<(String, NodeId)> =
            components.into_iter().map(|(suffix, s)| (suffix, s.node)).collect();
        let declaration = self.declaration;
        let unit = match declaration.output_units.iter().find(|(name, _)| *name == function.name) {
            Some((_, unit)) => match self.declared_of_output(function, unit, &units) {
                Some(text) => text,
                None => return,
            },
            None => self.inferred_of_output(&units, &components),
        };
        let origin = self.origins.add(place);
        self.model.outputs.push(Output { name: function.name.to_string(), components, unit, origin });
    }

    /// The unit that `#[units(..)]` gives an output, as text; `None` where its values have another one.
    fn declared_of_output(
        &mut self,
        function: &Function,
        unit: &UnitText,
        values: &[UnitOf],
    ) -> Option<String> {
        let (declared, text) = self.declared_text(unit);
        for value in values {
            let what = "what `#[units(..)]` says of it";
            let message = |found, expected| messages::unit_of_role(&function.name, found, what, expected);
            self.equate(value, &declared, function.name.span(), message)?;
        }
        Some(text)
    }

    /// The unit that all values of an output have, as text. Moments of forces have the dimension of energies:
    /// what depends on reactions, accelerations or inputs of that dimension is a moment, since no energy does
    /// but by a factor of velocity or displacement.
    fn inferred_of_output(&self, units: &[UnitOf], components: &[(String, NodeId)]) -> String {
        let text = self.common_unit(units);
        if text != "J" {
            return text;
        }
        let moment = |input: &Input| {
            Unit::parse(&input.unit)
                .is_ok_and(|unit| unit.is_some_and(|unit| unit.dimension == Dimension::ENERGY))
        };
        let forces = Dependence::ACCELERATIONS.with(Dependence::MULTIPLIERS);
        let of = if self.model.inputs.iter().any(moment) { forces.with(Dependence::INPUTS) } else { forces };
        let is_moment = components.iter().all(|(_, node)| self.model.graph.dependence(*node).on(of));
        if is_moment { "N*m".to_owned() } else { text }
    }

    /// The unit that all have, as text; empty where they differ, are unknown or 1.
    pub(super) fn common_unit(&self, units: &[UnitOf]) -> String {
        let known = units.iter().filter(|unit| unit.is_some());
        let mut texts: Vec<String> = known.map(|unit| self.unit_text(unit)).collect();
        texts.dedup();
        if texts.len() == 1 { texts.remove(0) } else { String::new() }
    }

    /// A unit as text; empty where it is unknown or 1.
    pub(super) fn unit_text(&self, unit: &UnitOf) -> String {
        let text = unit.as_ref().map(|unit| self.dimensions.units.text(unit)).unwrap_or_default();
        if text.contains('[') || text == "1" { String::new() } else { text }
    }

    fn result_scalar(&mut self, function: &Function, value: Value) -> Option<Scalar> {
        match value {
            Value::Scalar(_) | Value::Integer(_) => self.scalar(value, function.name.span()),
            other => {
                self.wrong_result(function, "a scalar", &other);
                None
            }
        }
    }

    pub(super) fn wrong_result(&mut self, function: &Function, expected: &str, found: &Value) {
        // A mistake within is reported already.
        if found.has_poison() {
            return;
        }
        let place = Place::of(&function.item.sig.output);
        let role = function.role.name();
        self.diagnostics.error(place, &messages::role_result(role, expected, found.shape()));
    }
}

/// Where the value of a function stands; its name where it ends otherwise than with an expression.
fn returned(function: &Function) -> Place {
    super::terms::returned(function).map_or_else(|| function.name.span().into(), Place::of)
}
