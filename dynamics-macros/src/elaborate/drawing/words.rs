//! The words of drawings: calls, paths and macros that models do not have. Whatever is not a word of drawings
//! means what it means in models.

use std::rc::Rc;

use syn::punctuated::Punctuated;
use syn::{Expr, ExprCall, ExprMethodCall, ExprPath, Ident, Lit, Macro, Token};

use super::super::Elaborator;
use super::super::calls::Argument;
use super::super::values::{Choice, Value};
use crate::diagnostics::Place;
use crate::messages;

/// Named colours; the page has them in lower case.
const COLORS: &[&str] =
    &["Auto", "Ink", "Faint", "Accent", "Blue", "Red", "Green", "Amber", "Purple", "Teal", "Brown", "Pink"];

/// The colours that `Color::cycle` takes in turn.
const CYCLE: [&str; 8] = ["blue", "red", "green", "amber", "purple", "teal", "brown", "pink"];

impl<'a> Elaborator<'a> {
    /// `receiver.method(..)` where a drawing is followed.
    pub(in super::super) fn drawn_method(&mut self, e: &'a ExprMethodCall, receiver: Value) -> Value {
        let name = &e.method;
        if receiver.is_poison() {
            return Value::Poison;
        }
        if matches!(receiver, Value::Coordinates) && (name == "reaction" || name == "slip") {
            return self.of_constraint(e);
        }
        let arguments = self.arguments(&e.args);
        if arguments.iter().any(|(argument, _)| argument.is_poison()) {
            return Value::Poison;
        }
        if let Value::Array(items) = &receiver
            && let Some(grown) = grown(items, name, &arguments)
        {
            let grown = self.bounded(grown, name.span());
            return self.store(&e.receiver, grown);
        }
        self.drawn_method_of(receiver, name, arguments)
    }

    /// The same, whichever way it was called.
    fn drawn_method_of(&mut self, receiver: Value, name: &Ident, arguments: Vec<Argument>) -> Value {
        let drawn = match &receiver {
            // What is found at compile time is no `Option` here.
            Value::Scalar(_) | Value::Vector(_) | Value::Array(_) | Value::Tuple(_) | Value::Integer(_)
                if name == "unwrap" || name == "expect" =>
            {
                Some(receiver.clone())
            }
            Value::Drawing(_) | Value::Closure(_) if name == "clone" => Some(receiver.clone()),
            Value::Drawing(canvas) => return self.figure_method(canvas.clone(), name, &arguments),
            Value::Array(items) => self.drawn_sequence(items, true, name, &arguments),
            Value::Sequence(items) => self.drawn_sequence(items, false, name, &arguments),
            Value::Scalar(x) => self.drawn_scalar(x, name, &arguments),
            Value::Function(f) => self.drawn_function(*f, name, &arguments),
            Value::Vector(_) | Value::Matrix(_) if name == "value" => Some(receiver.clone()),
            Value::Vector(_) if name == "rate" => Some(self.time_derivative(receiver.clone(), name)),
            Value::Text(_) | Value::Integer(_) if name == "to_string" => self.written_out(&receiver),
            Value::Text(_) if name == "as_str" => Some(receiver.clone()),
            _ => None,
        };
        drawn.unwrap_or_else(|| self.method(receiver, name, arguments))
    }

    /// `path(..)` where a drawing is followed; `None` for what models have, too.
    pub(in super::super) fn drawn_call(&mut self, e: &'a ExprCall) -> Option<Value> {
        if let Some(value) = self.call_of_closure(e) {
            return Some(value);
        }
        let Expr::Path(path) = &*e.func else { return None };
        let names: Vec<String> = path.path.segments.iter().map(|s| s.ident.to_string()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let place = Place::of(&e.func);
        match names.as_slice() {
            [.., "Vec", "new"] if e.args.is_empty() => Some(Value::array(Vec::new())),
            [.., "Vec", "with_capacity"] => Some(Value::array(Vec::new())),
            [.., "Drawing", "new" | "default"] if e.args.is_empty() => Some(Value::Drawing(Rc::default())),
            [.., "Drawing", "of_points" | "of_places"] => {
                let arguments = self.arguments(&e.args);
                let points = arguments.first().filter(|_| arguments.len() == 1)?;
                let drawing = self.drawing_of(names.last() == Some(&"of_points"), points);
                Some(drawing.unwrap_or_else(|| self.fail(place, &messages::not_followed("Drawing"))))
            }
            [.., "Color", "Rgb" | "cycle"] => {
                let arguments = self.arguments(&e.args);
                Some(self.color_of_numbers(names.last() == Some(&"cycle"), &arguments, place))
            }
            [.., "Point", "Planar" | "Spatial"] | [.., "String", "from"] if e.args.len() == 1 => {
                Some(self.expression(&e.args[0]))
            }
            [.., "iter", "once"] | ["once"] if e.args.len() == 1 => {
                let item = self.expression(&e.args[0]);
                Some(Value::Sequence(Rc::new(vec![item])))
            }
            [.., "Drawing", _] => {
                let arguments = self.arguments(&e.args);
                let mut last = path.path.segments.iter().rev().map(|s| &s.ident);
                let (name, ty) = (last.next()?, last.next()?);
                Some(self.call_by_path(ty, name, arguments, place))
            }
            _ => None,
        }
    }

    /// A path where a drawing is followed; `None` for what models have, too.
    pub(in super::super) fn drawn_path(&mut self, e: &'a ExprPath) -> Option<Value> {
        let mut last = e.path.segments.iter().rev().map(|s| &s.ident);
        match (last.next()?, last.next()) {
            (name, Some(ty)) if ty == "Color" && COLORS.iter().any(|known| name == known) => {
                Some(Value::Color(Rc::new(Choice::Is(name.to_string().to_lowercase()))))
            }
            // A function of a type as a value: `.map(Vec2::from)`.
            (name, Some(_)) if name.to_string().starts_with(char::is_lowercase) => Some(self.path_value(e)),
            // Imported constants of std are asserted to be std's, but not where only a drawing reads them. A
            // name of one letter is too likely to be the user's own.
            (name, None) if name == "E" && self.frame().find("E").is_none() => {
                Some(self.fail(name.span(), &messages::foreign_constant(name)))
            }
            _ => None,
        }
    }

    /// `Type::function` for these arguments.
    pub(super) fn call_by_path(
        &mut self,
        ty: &Ident,
        name: &Ident,
        mut arguments: Vec<Argument>,
        at: Place,
    ) -> Value {
        let is_own = ty == "Self" || *ty == self.declaration.name;
        let text = ty.to_string();
        match (text.as_str(), arguments.len()) {
            _ if arguments.iter().any(|(argument, _)| argument.is_poison()) => Value::Poison,
            _ if is_own => self.call_function(name, arguments),
            (_, 1) if name == "into" || name == "from" && ty == "Expr" => arguments.remove(0).0,
            ("Drawing", n) if n > 0 => {
                let (receiver, _) = arguments.remove(0);
                self.drawn_method_of(receiver, name, arguments)
            }
            _ => match self.library.find(&text) {
                Some(record) => self.library_call(record, name, arguments, at),
                None => self.associated(ty, name, arguments, at),
            },
        }
    }

    /// `Color::Rgb(r, g, b)` and `Color::cycle(k)`.
    fn color_of_numbers(&mut self, cycle: bool, arguments: &[Argument], at: Place) -> Value {
        let numbers: Vec<i128> = arguments
            .iter()
            .filter_map(|(value, _)| if let Value::Integer(i) = value { Some(i.value) } else { None })
            .collect();
        let name = match (cycle, numbers.as_slice()) {
            (true, [k]) => CYCLE[k.rem_euclid(CYCLE.len() as i128) as usize].to_owned(),
            (false, [r, g, b]) => format!("#{r:02x}{g:02x}{b:02x}"),
            _ => return self.fail(at, &messages::foreign_function("Color", "")),
        };
        Value::Color(Rc::new(Choice::Is(name)))
    }

    /// An integer or a text as a text.
    fn written_out(&self, value: &Value) -> Option<Value> {
        match value {
            Value::Integer(i) => Some(Value::Text(Rc::new(Choice::Is(i.value.to_string())))),
            Value::Text(_) => Some(value.clone()),
            _ => None,
        }
    }

    /// `vec![..]` and `format!(..)` where a drawing is followed; `None` for other macros, and for texts that
    /// contain numbers of the motion.
    pub(in super::super) fn drawn_macro(&mut self, call: &'a Macro) -> Option<Value> {
        let is_list = call.path.is_ident("vec");
        if !is_list && !call.path.is_ident("format") {
            return None;
        }
        let arguments = self.macro_arguments(call, is_list)?;
        if is_list {
            return Some(self.expression(arguments.first()?));
        }
        let Expr::Lit(syn::ExprLit { lit: Lit::Str(form), .. }) = arguments.first()? else { return None };
        let values: Vec<Value> = arguments[1..].iter().map(|argument| self.expression(argument)).collect();
        self.formatted(&form.value(), &values)
    }

    /// The expressions in a macro's tokens, parsed once; of a list the list as an array.
    fn macro_arguments(&mut self, call: &'a Macro, is_list: bool) -> Option<Rc<[&'a Expr]>> {
        let place = std::ptr::from_ref(call);
        if let Some(known) = self.picture.as_ref().and_then(|followed| followed.macros.get(&place)) {
            return Some(known.clone());
        }
        let tokens = &call.tokens;
        let all: Vec<Expr> = if is_list {
            vec![syn::parse2(quote::quote!([#tokens])).ok()?]
        } else {
            let all = call.parse_body_with(Punctuated::<Expr, Token![,]>::parse_terminated).ok()?;
            all.into_iter().collect()
        };
        let parsed = self.parsed;
        let all: Rc<[&'a Expr]> = all.into_iter().map(|expr| parsed.keep(expr)).collect();
        self.picture.get_or_insert_default().macros.insert(place, all.clone());
        Some(all)
    }

    /// A text with `{}` and `{name}` for integers and texts.
    fn formatted(&mut self, form: &str, values: &[Value]) -> Option<Value> {
        let (mut text, mut rest, mut next) = (String::new(), form, values.iter());
        while let Some(at) = rest.find(['{', '}']) {
            text.push_str(&rest[..at]);
            let (brace, behind) = (&rest[at..=at], &rest[at + 1..]);
            if let Some(behind) = behind.strip_prefix(brace) {
                text.push_str(brace);
                rest = behind;
                continue;
            }
            let (inside, behind) = behind.split_once('}').filter(|_| brace == "{")?;
            let value = match inside {
                "" => next.next()?.clone(),
                name => match name.parse::<usize>() {
                    Ok(k) => values.get(k)?.clone(),
                    Err(_) => self.frame().find(name)?.clone(),
                },
            };
            match self.written_out(&value)? {
                Value::Text(choice) => match &*choice {
                    Choice::Is(part) => text.push_str(part),
                    Choice::If(..) => return None,
                },
                _ => return None,
            }
            rest = behind;
        }
        text.push_str(rest);
        Some(Value::Text(Rc::new(Choice::Is(text))))
    }
}

/// A list after `push` and the like; `None` for other methods.
fn grown(items: &Rc<Vec<Value>>, name: &Ident, arguments: &[Argument]) -> Option<Value> {
    let added = match (name.to_string().as_str(), arguments) {
        ("push", [(item, _)]) => std::slice::from_ref(item),
        ("extend" | "extend_from_slice", [(Value::Array(all) | Value::Sequence(all), _)]) => all,
        _ => return None,
    };
    Some(Value::array(items.iter().chain(added).cloned().collect()))
}
