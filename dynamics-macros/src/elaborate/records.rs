//! Values of the library's types, and calls of its functions.
//!
//! An error inside of one stands at the user's call, and says inside of what it is.

use std::rc::Rc;

use proc_macro2::Span;
use syn::{ExprStruct, FnArg, GenericArgument, Ident, Member, PathArguments, Type, TypeParamBound};

use super::Elaborator;
use super::calls::Argument;
use super::scope::{Flow, Frame};
use super::values::{Record, Value};
use crate::diagnostics::Place;
use crate::library::type_name;
use crate::messages;

impl<'a> Elaborator<'a> {
    /// `receiver.name(..)` and `Type::name(..)`: a function of a library type, the receiver among the
    /// arguments.
    pub(super) fn library_call(
        &mut self,
        ty: usize,
        name: &Ident,
        arguments: Vec<Argument>,
        place: Place,
    ) -> Value {
        let library = self.library;
        let record = &library.types[ty];
        let Some(function) = record.function(&name.to_string()) else {
            let methods = record.methods();
            if let Some((receiver @ Value::Record(_), _)) = arguments.first() {
                let known: Vec<&str> = methods.iter().map(String::as_str).collect();
                return self.unknown_method(&receiver.clone(), name, &known);
            }
            let all: Vec<String> = record.functions.iter().map(|f| f.sig.ident.to_string()).collect();
            let hint = match crate::suggest::nearest(&name.to_string(), all.iter().map(String::as_str)) {
                Some(best) => format!("did you mean `{best}`?"),
                None => "the manual lists what models can use".into(),
            };
            return self
                .fail(name.span(), &messages::unknown_method(format!("`{}`", record.name), name, hint));
        };
        let inputs = &function.sig.inputs;
        if inputs.len() != arguments.len() {
            let receiver = usize::from(matches!(inputs.first(), Some(FnArg::Receiver(_))));
            let (expected, found) = (inputs.len() - receiver, arguments.len().saturating_sub(receiver));
            return self.fail(name.span(), &messages::argument_count(name, expected, found));
        }
        let noted = (record.name == "RigidBody").then(|| arguments.clone());
        let places: Vec<Place> = arguments.iter().map(|(_, place)| *place).collect();
        let mut variables = Vec::new();
        for (input, (value, at)) in inputs.iter().zip(arguments) {
            match input {
                FnArg::Receiver(_) => variables.push((None, self.record_of(ty, value, at))),
                FnArg::Typed(argument) => {
                    variables.push((Some(&*argument.pat), self.fitted(&argument.ty, value, at)))
                }
            }
        }
        if variables.iter().any(|(_, value)| value.is_poison()) {
            return Value::Poison;
        }
        let given: Vec<Argument> = variables.iter().map(|(_, value)| value.clone()).zip(places).collect();
        let entered = self.diagnostics.enter(place, || format!("{}::{name}", record.name));
        self.frames.push(Frame { of: Some(ty), scopes: vec![Vec::new()], ..Frame::default() });
        for (pattern, value) in variables {
            match pattern {
                Some(pattern) => self.bind(pattern, value),
                None => self.frame().declare("self".into(), value),
            }
        }
        let value = self.statements(&function.block.stmts);
        let flow = self.frames.pop().and_then(|frame| frame.flow);
        self.diagnostics.leave(entered);
        let value = match flow {
            Some(Flow::Return(value)) => value,
            _ => value,
        };
        self.note_assumptions(&record.name, name, &given, &value);
        if let Some(arguments) = noted.filter(|_| name == "kinetic_energy" || name == "potential_energy") {
            self.note_energy(&arguments, name, &value);
        }
        value
    }

    /// The library type that a name means here: `Self` within the library's own functions.
    pub(super) fn library_type(&mut self, name: &Ident) -> Option<usize> {
        let inside = self.frame().of;
        match inside {
            Some(own) if name == "Self" => Some(own),
            None if *name == self.declaration.name => None,
            _ => self.library.find(&name.to_string()),
        }
    }

    /// `RigidBody { mass, .. }`, all fields given.
    pub(super) fn record(&mut self, ty: usize, e: &'a ExprStruct) -> Value {
        let library = self.library;
        let mut fields = Vec::new();
        for (name, field_type) in &library.types[ty].fields {
            let field = e.fields.iter().find(|f| matches!(&f.member, Member::Named(n) if n == name));
            // A missing or doubled field is rustc's to say; it needs a value here only to go on.
            let value = match field {
                Some(field) => {
                    let value = self.expression(&field.expr);
                    self.fitted(field_type, value, Place::of(&field.expr))
                }
                None => Value::Poison,
            };
            fields.push(value);
        }
        if fields.iter().any(Value::is_poison) {
            return Value::Poison;
        }
        Value::Record(Rc::new(Record { ty, name: library.types[ty].name.clone(), fields }))
    }

    /// `record.name`.
    pub(super) fn record_field(&mut self, record: &Rc<Record>, member: &Member, at: Span) -> Value {
        let library = self.library;
        let fields = &library.types[record.ty].fields;
        let index = match member {
            Member::Named(name) => fields.iter().position(|(field, _)| name == field),
            Member::Unnamed(_) => None,
        };
        match index {
            Some(index) => record.fields[index].clone(),
            None => {
                let member = match member {
                    Member::Named(name) => name.to_string(),
                    Member::Unnamed(i) => i.index.to_string(),
                };
                self.fail(at, &messages::no_field(Value::Record(record.clone()).shape(), member))
            }
        }
    }

    fn record_of(&mut self, ty: usize, value: Value, at: Place) -> Value {
        match value {
            Value::Record(record) if record.ty == ty => Value::Record(record),
            Value::Poison => Value::Poison,
            other => {
                let expected = format!("a `{}`", self.library.types[ty].name);
                self.fail(at, &messages::expected_shape(expected, other.shape()))
            }
        }
    }

    /// A value as the type that the library declares for it.
    fn fitted(&mut self, ty: &Type, value: Value, at: Place) -> Value {
        let inner = into_what(ty).unwrap_or(ty);
        if let (Type::Array(array), Value::Array(items)) = (inner, &value) {
            let length = match &array.len {
                syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Int(n), .. }) => n.base10_parse::<usize>().ok(),
                _ => None,
            };
            if length == Some(items.len()) {
                let items =
                    items.iter().map(|item| self.fitted(&array.elem, item.clone(), at)).collect::<Vec<_>>();
                return if items.iter().any(Value::is_poison) { Value::Poison } else { Value::array(items) };
            }
        }
        let name = type_name(inner).unwrap_or_default();
        match (name.as_str(), value) {
            (_, Value::Poison) => Value::Poison,
            ("Expr", value) => self.scalar(value, at).into(),
            ("Vec2", Value::Vector(v)) if v.len() == 2 => Value::Vector(v),
            ("Vec3", Value::Vector(v)) if v.len() == 3 => Value::Vector(v),
            ("Mat3", Value::Matrix(m)) => Value::Matrix(m),
            (_, value) => {
                if let Some(ty) = self.library.find(&name) {
                    return self.record_of(ty, value, at);
                }
                let expected = match inner {
                    Type::Array(array) => {
                        let length = quote::ToTokens::to_token_stream(&array.len);
                        format!("an array of {length} scalars")
                    }
                    _ => format!("a `{name}`"),
                };
                self.fail(at, &messages::expected_shape(expected, value.shape()))
            }
        }
    }
}

/// X of `impl Into<X>`.
fn into_what(ty: &Type) -> Option<&Type> {
    let Type::ImplTrait(bounds) = ty else { return None };
    let Some(TypeParamBound::Trait(bound)) = bounds.bounds.first() else { return None };
    let PathArguments::AngleBracketed(arguments) = &bound.path.segments.last()?.arguments else {
        return None;
    };
    match arguments.args.first() {
        Some(GenericArgument::Type(ty)) => Some(ty),
        _ => None,
    }
}
