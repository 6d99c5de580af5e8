//! The struct's attributes: `#[coordinates(..)]`, `#[speeds(..)]`, `#[inputs(..)]`, `#[units(..)]`,
//! `#[nominal(..)]`, `#[model(..)]`.

use proc_macro2::{Delimiter, Span, TokenStream, TokenTree};
use quote::ToTokens;
use syn::parse::{Parse, ParseStream, Parser};
use syn::punctuated::Punctuated;
use syn::{Attribute, Expr, Ident, Lit, Meta, Path, Token, UnOp};

use super::declaration::{
    Declaration, FamilyLength, Field, FieldKind, MAX_LENGTH, Nominal, Quantity, Shape, Targets, UnitText,
    family_length, length, type_text,
};
use crate::diagnostics::{Diagnostics, Place};
use crate::messages;
use crate::suggest;

/// Everything that the attributes say.
#[derive(Default)]
pub(super) struct Attributes {
    pub(super) crate_path: Option<Path>,
    /// `sin_cos = accurate`.
    pub(super) accurate: bool,
    /// `targets(c)`.
    pub(super) targets: Targets,
    pub(super) coordinates: Vec<Quantity>,
    pub(super) speeds: Vec<Quantity>,
    pub(super) inputs: Vec<Quantity>,
    pub(super) units: Vec<(Ident, UnitText)>,
    pub(super) nominal: Vec<(Ident, Expr)>,
}

/// Our attributes, for did-you-mean.
pub(crate) const ATTRIBUTES: &[&str] = &["coordinates", "speeds", "inputs", "units", "nominal", "model"];

/// Reads all attributes of the struct that belong to this library.
pub(super) fn read(attributes: &[Attribute], d: &mut Diagnostics) -> Attributes {
    let mut all = Attributes::default();
    let mut seen: Vec<String> = Vec::new();
    for attribute in attributes {
        let Some(name) = attribute.path().get_ident().map(ToString::to_string) else { continue };
        if !ATTRIBUTES.contains(&name.as_str()) {
            continue;
        }
        if seen.contains(&name) {
            d.error(Place::of(attribute.path()), &messages::attribute_twice(&name));
            continue;
        }
        seen.push(name.clone());
        let Meta::List(list) = &attribute.meta else {
            d.error(Place::of(&attribute.meta), &messages::attribute_without_list(&name, example(&name)));
            continue;
        };
        let tokens = list.tokens.clone();
        match name.as_str() {
            "coordinates" => all.coordinates = quantities(tokens, "coordinate", d),
            "speeds" => all.speeds = quantities(tokens, "speed", d),
            "inputs" => all.inputs = quantities(tokens, "input", d),
            "units" => all.units = units(tokens, d),
            "nominal" => all.nominal = assignments(tokens, d),
            _ => model(tokens, &mut all, d),
        }
    }
    all
}

/// How an attribute is written.
fn example(attribute: &str) -> &'static str {
    match attribute {
        "coordinates" => "#[coordinates(theta: rad, x: m)]",
        "speeds" => "#[speeds(omega: [rad/s; 3])]",
        "inputs" => "#[inputs(torque: N*m)]",
        "units" => "#[units(mass: kg, g: m/s^2)]",
        "nominal" => "#[nominal(mass = 1.0)]",
        _ => "#[model(crate = path::to::dynamics)]",
    }
}

/// The parts of a stream between commas of the top level; empty parts are left out only at the end.
fn split(tokens: TokenStream) -> Vec<Vec<TokenTree>> {
    let mut parts = vec![Vec::new()];
    for tree in tokens {
        match tree {
            TokenTree::Punct(p) if p.as_char() == ',' => parts.push(Vec::new()),
            tree => parts.last_mut().expect("never empty: it starts with one part and only grows").push(tree),
        }
    }
    if parts.last().is_some_and(Vec::is_empty) {
        parts.pop();
    }
    parts
}

/// `name` or `name: rest`.
fn named(part: &[TokenTree], d: &mut Diagnostics, example: &str) -> Option<(Ident, Vec<TokenTree>)> {
    match part {
        [TokenTree::Ident(name)] => Some((name.clone(), Vec::new())),
        [TokenTree::Ident(name), TokenTree::Punct(colon), rest @ ..]
            if colon.as_char() == ':' && !rest.is_empty() =>
        {
            Some((name.clone(), rest.to_vec()))
        }
        _ => {
            d.error(place(part), &messages::attribute_entry(example));
            None
        }
    }
}

fn place(part: &[TokenTree]) -> Place {
    Place::of(part.iter().cloned().collect::<TokenStream>())
}

/// Entries of `#[coordinates(..)]`, `#[speeds(..)]` and `#[inputs(..)]`.
fn quantities(tokens: TokenStream, what: &str, d: &mut Diagnostics) -> Vec<Quantity> {
    let mut all = Vec::new();
    let mut scalars = 0;
    for part in split(tokens) {
        let Some((name, rest)) = named(&part, d, "`name`, `name: unit` or `name: [unit; length]`") else {
            continue;
        };
        if syn::parse2::<Ident>(name.to_token_stream()).is_err() {
            d.error(name.span(), &messages::keyword_as_name(&name, what));
            continue;
        }
        let Some((unit, lengths)) = quantity(&rest, d) else { continue };
        let mut new =
            Quantity { name, length: None, columns: None, family: None, family_columns: None, unit };
        match lengths {
            Lengths::None => {}
            Lengths::Literal(n) => new.length = Some(n),
            Lengths::Family(length, columns) if what == "coordinate" => {
                (new.family, new.family_columns) = (Some(length), columns);
            }
            Lengths::Family(length, _) => {
                d.error(length.count.span(), &messages::family_of(what));
                continue;
            }
        }
        let quantity = new;
        scalars += quantity.scalars();
        if scalars > MAX_LENGTH {
            d.error(place(&part), &messages::too_many_parameters(MAX_LENGTH));
            break;
        }
        all.push(quantity);
    }
    all
}

/// How many there are of a quantity.
enum Lengths {
    None,
    Literal(usize),
    /// Those of a family; of a grid its rows and columns.
    Family(FamilyLength, Option<FamilyLength>),
}

/// `unit`, `_`, `[unit; length]`, or `[[unit; self.columns]; self.rows]`.
fn quantity(rest: &[TokenTree], d: &mut Diagnostics) -> Option<(Option<UnitText>, Lengths)> {
    const EXAMPLE: &str = "`name: [unit; length]`";
    let Some((inside, after, place)) = array(rest) else { return Some((unit(rest), Lengths::None)) };
    let Some(after) = after else {
        d.error(place, &messages::attribute_entry(EXAMPLE));
        return None;
    };
    let Some((columns_inside, columns, inner)) = array(&inside) else {
        let lengths = match family_length(&after) {
            Some(family) => Lengths::Family(family, None),
            None => Lengths::Literal(length(&after, d)?),
        };
        return Some((unit(&inside), lengths));
    };
    let Some(rows) = family_length(&after) else {
        let message = match columns.as_ref().and_then(family_length) {
            Some(_) => messages::grid_of_families(),
            None => messages::attribute_entry("`name: [unit; length]`, a name for each row"),
        };
        d.error(inner, &message);
        return None;
    };
    let Some(columns) = columns.as_ref().and_then(family_length) else {
        d.error(inner, &messages::grid_of_families());
        return None;
    };
    if let Some((.., innermost)) = array(&columns_inside) {
        d.error(innermost, &messages::three_indices());
        return None;
    }
    Some((unit(&columns_inside), Lengths::Family(rows, Some(columns))))
}

/// The tokens of `[inside; after]`, what follows the semicolon, `None` where that is no expression, and where
/// it stands. `None` for other tokens.
fn array(tokens: &[TokenTree]) -> Option<(Vec<TokenTree>, Option<Expr>, Place)> {
    let [TokenTree::Group(group)] = tokens else { return None };
    if group.delimiter() != Delimiter::Bracket {
        return None;
    }
    let mut inside: Vec<TokenTree> = group.stream().into_iter().collect();
    let semicolon = inside.iter().position(|t| matches!(t, TokenTree::Punct(p) if p.as_char() == ';'));
    let after = semicolon.and_then(|at| {
        let after: TokenStream = inside.split_off(at).into_iter().skip(1).collect();
        syn::parse2::<Expr>(after).ok()
    });
    Some((inside, after, Place::of(group)))
}

/// A unit's tokens; `None` for `_` and nothing.
fn unit(tokens: &[TokenTree]) -> Option<UnitText> {
    if tokens.is_empty() || matches!(tokens, [TokenTree::Ident(i)] if *i == "_") {
        return None;
    }
    let mut flat = Vec::new();
    flatten_unit(tokens.iter().cloned().collect(), &mut flat);
    Some(UnitText { tokens: flat })
}

/// Parentheses become tokens of their own. Nesting is bounded before.
fn flatten_unit(tokens: TokenStream, flat: &mut Vec<(String, Span)>) {
    for tree in tokens {
        match tree {
            TokenTree::Group(group) => {
                let (open, close) = match group.delimiter() {
                    Delimiter::Parenthesis => ("(", ")"),
                    Delimiter::Bracket => ("[", "]"),
                    Delimiter::Brace => ("{", "}"),
                    Delimiter::None => ("", ""),
                };
                if !open.is_empty() {
                    flat.push((open.to_owned(), group.span_open()));
                }
                flatten_unit(group.stream(), flat);
                if !close.is_empty() {
                    flat.push((close.to_owned(), group.span_close()));
                }
            }
            tree => flat.push((tree.to_string(), tree.span())),
        }
    }
}

/// Entries of `#[units(..)]`.
fn units(tokens: TokenStream, d: &mut Diagnostics) -> Vec<(Ident, UnitText)> {
    let mut all = Vec::new();
    for part in split(tokens) {
        match named(&part, d, "`name: unit`") {
            Some((name, rest)) if !rest.is_empty() => {
                if let Some(unit) = unit(&rest) {
                    all.push((name, unit));
                }
            }
            Some((name, _)) => d.error(name.span(), &messages::attribute_entry("`name: unit`")),
            None => {}
        }
    }
    all
}

/// `name = value`.
struct Assignment(Ident, Expr);

impl Parse for Assignment {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let name = input.parse()?;
        input.parse::<Token![=]>()?;
        Ok(Self(name, input.parse()?))
    }
}

/// Entries of `#[nominal(..)]`.
fn assignments(tokens: TokenStream, d: &mut Diagnostics) -> Vec<(Ident, Expr)> {
    match Punctuated::<Assignment, Token![,]>::parse_terminated.parse2(tokens.clone()) {
        Ok(all) => all.into_iter().map(|Assignment(name, value)| (name, value)).collect(),
        Err(_) => {
            d.error(Place::of(tokens), &messages::attribute_entry("`name = value`"));
            Vec::new()
        }
    }
}

/// An entry of `#[model(..)]`.
enum ModelEntry {
    /// `crate = path`.
    Crate(Path),
    /// `sin_cos = accurate` or `sin_cos = fast`: whether the former.
    Accurate(bool),
    /// `targets(c)`.
    Targets(Punctuated<Ident, Token![,]>),
}

impl Parse for ModelEntry {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        if input.peek(Token![crate]) {
            input.parse::<Token![crate]>()?;
            input.parse::<Token![=]>()?;
            return Ok(Self::Crate(input.call(Path::parse_mod_style)?));
        }
        let name: Ident = input.parse()?;
        if name == "targets" {
            let names;
            syn::parenthesized!(names in input);
            return Ok(Self::Targets(Punctuated::parse_terminated(&names)?));
        }
        input.parse::<Token![=]>()?;
        let value: Ident = input.parse()?;
        if name == "sin_cos" && (value == "accurate" || value == "fast") {
            Ok(Self::Accurate(value == "accurate"))
        } else {
            Err(input.error("an unknown entry"))
        }
    }
}

/// Entries of `#[model(..)]`, each once.
fn model(tokens: TokenStream, all: &mut Attributes, d: &mut Diagnostics) {
    let parsed = Punctuated::<ModelEntry, Token![,]>::parse_terminated.parse2(tokens.clone());
    let (mut crates, mut accurate, mut targets) = (Vec::new(), Vec::new(), Vec::new());
    let is_read = parsed.is_ok();
    for entry in parsed.into_iter().flatten() {
        match entry {
            ModelEntry::Crate(path) => crates.push(path),
            ModelEntry::Accurate(is_accurate) => accurate.push(is_accurate),
            ModelEntry::Targets(names) => targets.push(names),
        }
    }
    if !is_read || crates.len() > 1 || accurate.len() > 1 || targets.len() > 1 {
        d.error(Place::of(tokens), &messages::model_argument());
        return;
    }
    all.crate_path = crates.pop();
    all.accurate = accurate.pop() == Some(true);
    for name in targets.into_iter().flatten() {
        let target = match name.to_string().as_str() {
            "c" => &mut all.targets.c,
            "wgsl" => &mut all.targets.wgsl,
            _ => {
                d.error(name.span(), &messages::unknown_target(&name, TARGETS));
                continue;
            }
        };
        if target.replace(name.span()).is_some() {
            d.error(name.span(), &messages::entry_twice("targets", &name));
        }
    }
}

/// All targets, as messages list them.
const TARGETS: &str = "`c` and `wgsl`";

/// Finds the field that an attribute's entry names.
fn field<'a>(
    fields: &'a mut [Field],
    name: &Ident,
    attribute: &str,
    d: &mut Diagnostics,
) -> Option<&'a mut Field> {
    let names: Vec<String> = fields.iter().map(|f| f.name.to_string()).collect();
    let found = fields.iter_mut().find(|f| f.name == *name);
    if found.is_none() {
        let hint = suggest::did_you_mean(&name.to_string(), names.iter().map(String::as_str));
        d.error(name.span(), &messages::attribute_of_unknown_field(attribute, name, hint));
    }
    found
}

/// Gives every field its unit.
///
/// Names of no field may be those of outputs, which the impl block declares: they are returned.
pub(super) fn attach_units(
    fields: &mut [Field],
    units: Vec<(Ident, UnitText)>,
    d: &mut Diagnostics,
) -> Vec<(Ident, UnitText)> {
    let mut others = Vec::new();
    for (name, unit) in units {
        let Some(field) = fields.iter_mut().find(|f| f.name == name) else {
            others.push((name, unit));
            continue;
        };
        if field.unit.is_some() {
            d.error(name.span(), &messages::entry_twice("units", &name));
        }
        field.unit = Some(unit);
    }
    others
}

/// Gives every field its nominal values.
pub(super) fn attach_nominal(fields: &mut [Field], nominal: Vec<(Ident, Expr)>, d: &mut Diagnostics) {
    for (name, value) in nominal {
        let Some(field) = field(fields, &name, "nominal", d) else { continue };
        if field.nominal.is_some() {
            d.error(name.span(), &messages::entry_twice("nominal", &name));
        }
        let shape = match &field.kind {
            FieldKind::Parameter { shape, .. } => shape,
            FieldKind::Count => &Shape::Scalar,
            FieldKind::Function(_) | FieldKind::Numbered => {
                let what = match field.kind {
                    FieldKind::Numbered => "a list of any length",
                    _ => "a smooth function",
                };
                d.error(Place::of(&value), &messages::nominal_of_function(&name, what));
                continue;
            }
        };
        let mut values = Vec::new();
        if flatten(shape, &value, &mut values) {
            field.nominal = Some(Nominal { values });
        } else {
            d.error(Place::of(&value), &messages::nominal_shape(&name, describe(shape)));
        }
    }
}

/// How a nominal value of a shape is written.
fn describe(shape: &Shape) -> String {
    match shape {
        Shape::Scalar => "a number such as `1.0`".into(),
        Shape::Vector2 => "two numbers, `[x, y]`".into(),
        Shape::Vector3 => "three numbers, `[x, y, z]`".into(),
        Shape::Matrix3 => "three rows of three numbers".into(),
        Shape::Array(n, inner) => format!("an array of {n}, each {}", describe(inner)),
    }
}

/// Flattens a nominal value; false where it has another shape.
fn flatten(shape: &Shape, value: &Expr, values: &mut Vec<f64>) -> bool {
    let each = |inner: &Shape, n: usize, values: &mut Vec<f64>| match value {
        Expr::Array(array) => array.elems.len() == n && array.elems.iter().all(|e| flatten(inner, e, values)),
        Expr::Repeat(repeat) => {
            let is_n = |l: &Lit| matches!(l, Lit::Int(i) if i.base10_parse::<usize>().ok() == Some(n));
            matches!(&*repeat.len, Expr::Lit(l) if is_n(&l.lit))
                && (0..n).all(|_| flatten(inner, &repeat.expr, values))
        }
        _ => false,
    };
    match shape {
        Shape::Scalar => number(value).is_some_and(|x| {
            values.push(x);
            true
        }),
        Shape::Vector2 => each(&Shape::Scalar, 2, values),
        Shape::Vector3 => each(&Shape::Scalar, 3, values),
        Shape::Matrix3 => each(&Shape::Array(3, Box::new(Shape::Scalar)), 3, values),
        Shape::Array(n, inner) => each(inner, *n, values),
    }
}

/// A literal number with its sign.
fn number(value: &Expr) -> Option<f64> {
    match value {
        Expr::Lit(lit) => match &lit.lit {
            Lit::Float(x) => x.base10_parse::<f64>().ok(),
            Lit::Int(x) => x.base10_parse::<f64>().ok(),
            _ => None,
        }
        .filter(|x| x.is_finite()),
        Expr::Unary(unary) if matches!(unary.op, UnOp::Neg(_)) => number(&unary.expr).map(|x| -x),
        Expr::Paren(paren) => number(&paren.expr),
        Expr::Group(group) => number(&group.expr),
        _ => None,
    }
}

/// Names that the generated state and coordinate types use themselves.
const RESERVED: &[&str] = &[
    "t",
    "q",
    "u",
    "inputs",
    "active_set",
    "new",
    "build",
    "assemble",
    "at_time",
    "release",
    "release_to",
    "engage",
    "is_engaged",
];

/// Something moves; no name is taken twice; none collides with a generated one. What offends is left out, so
/// that nothing is generated from it.
pub(super) fn check_names(declaration: &mut Declaration, d: &mut Diagnostics) {
    if declaration.coordinates.is_empty() && d.len() == 0 {
        d.error(declaration.name.span(), &messages::no_coordinates(&declaration.name));
    }
    let mut taken: Vec<(String, &'static str)> =
        declaration.fields.iter().map(|f| (f.name.to_string(), "a parameter")).collect();
    let named = |suffix: &str| -> Vec<(String, Ident)> {
        declaration.coordinates.iter().map(|c| (format!("{}{suffix}", c.name), c.name.clone())).collect()
    };
    let (rates, guesses) = (named("_rate"), named("_guess"));
    let mut fits = |quantity: &Quantity, what: &'static str| {
        let name = quantity.name.to_string();
        let message = if RESERVED.contains(&name.as_str()) {
            messages::reserved_name(&name, what)
        } else if let Some((_, other)) = taken.iter().find(|(known, _)| *known == name) {
            messages::duplicate_name(&name, other)
        } else if let Some((_, coordinate)) = rates.iter().find(|(rate, _)| *rate == name) {
            messages::rate_name(&name, coordinate)
        } else if let Some((_, coordinate)) = guesses.iter().find(|(guess, _)| *guess == name) {
            messages::guess_name(&name, coordinate)
        } else {
            taken.push((name, what));
            return true;
        };
        d.error(quantity.name.span(), &message);
        false
    };
    declaration.coordinates.retain(|c| fits(c, "a coordinate"));
    declaration.speeds.retain(|s| fits(s, "a speed"));
    declaration.inputs.retain(|i| fits(i, "an input"));
    check_lengths(declaration, d);
}

/// Families have counts as lengths, and only models with families have counts.
fn check_lengths(declaration: &mut Declaration, d: &mut Diagnostics) {
    let (fields, item) = (&declaration.fields, &declaration.item);
    let mut known = |family: &FamilyLength| {
        let is_count = |f: &&Field| f.name == family.count && f.kind == FieldKind::Count;
        let found = fields.iter().any(|f| is_count(&f));
        // What cannot be a parameter is reported already.
        let declared = |f: &syn::Field| f.ident.as_ref() == Some(&family.count);
        let wrong = !fields.iter().any(|f| f.name == family.count) && item.fields.iter().any(declared);
        if !found && !wrong {
            let counts = fields.iter().filter(|f| f.kind == FieldKind::Count).map(|f| f.name.to_string());
            let counts: Vec<String> = counts.collect();
            let name = family.count.to_string();
            let hint = suggest::did_you_mean(&name, counts.iter().map(String::as_str));
            d.error(family.count.span(), &messages::length_of_no_count(&name, hint));
        }
        found
    };
    declaration.coordinates.retain(|c| [&c.family, &c.family_columns].into_iter().flatten().all(&mut known));
    if declaration.has_families() || d.len() > 0 {
        return;
    }
    for field in &declaration.item.fields {
        let kind = declaration.fields.iter().find(|f| Some(&f.name) == field.ident.as_ref()).map(|f| &f.kind);
        if matches!(kind, Some(FieldKind::Count | FieldKind::Numbered)) {
            d.error(Place::of(&field.ty), &messages::parameter_type(type_text(&field.ty)));
        }
    }
}
