//! A model's struct as declared: its parameters, coordinates, speeds and inputs.

use proc_macro2::{Span, TokenStream};
use quote::quote;
use syn::{Expr, Ident, ItemStruct, Lit, Path, Type, Visibility};

use crate::diagnostics::{Diagnostics, Place};
use crate::messages;

/// Languages in which programs are printed on request.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Targets {
    /// C99: where it was asked for.
    pub(crate) c: Option<Span>,
    /// WGSL, the language of kernels for graphics cards of all makers: where it was asked for.
    pub(crate) wgsl: Option<Span>,
}

/// A model's struct, as declared.
#[derive(Clone, Debug)]
pub(crate) struct Declaration {
    /// The item as the user wrote it.
    pub(crate) item: ItemStruct,
    /// Name of the struct.
    pub(crate) name: Ident,
    /// Its visibility.
    pub(crate) visibility: Visibility,
    /// `#[model(crate = path)]`: where `dynamics` is found.
    pub(crate) crate_path: Option<Path>,
    /// `#[model(sin_cos = accurate)]`: sines and cosines are the platform's.
    pub(crate) accurate: bool,
    /// `#[model(targets(c))]`: the languages in which programs are printed besides.
    pub(crate) targets: Targets,
    /// Generalized coordinates in the order of q.
    pub(crate) coordinates: Vec<Quantity>,
    /// Generalized speeds in order.
    pub(crate) speeds: Vec<Quantity>,
    /// Inputs in order.
    pub(crate) inputs: Vec<Quantity>,
    /// Parameters and smooth functions, in the order of the fields.
    pub(crate) fields: Vec<Field>,
    /// Units of what is no field: of outputs.
    pub(crate) output_units: Vec<(Ident, UnitText)>,
}

/// A field: one or more scalar parameters, or a smooth function.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub(crate) name: Ident,
    pub(crate) kind: FieldKind,
    /// From `#[units(..)]`, of every scalar of the field (or of the function's values).
    pub(crate) unit: Option<UnitText>,
    /// From `#[nominal(..)]`, flattened, one per scalar parameter.
    pub(crate) nominal: Option<Nominal>,
}

/// What a field is to the model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum FieldKind {
    /// Scalar parameters from index `first` on.
    Parameter {
        /// Their arrangement.
        shape: Shape,
        /// Index of the first among all scalar parameters.
        first: usize,
    },
    /// The smooth function with this index.
    Function(usize),
    /// `usize`: the length of families.
    Count,
    /// `Vec<f64>` or `Box<[f64]>`: a scalar for every index.
    Numbered,
}

/// Arrangement of scalars in a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// `f64`.
    Scalar,
    /// `[shape; length]`.
    Array(usize, Box<Shape>),
    /// `Vec2<f64>`.
    Vector2,
    /// `Vec3<f64>` or nalgebra's `Vector3<f64>`.
    Vector3,
    /// `Mat3<f64>` or nalgebra's `Matrix3<f64>`.
    Matrix3,
}

/// One scalar of a parameter.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    /// What follows the field's name in reports: `[3]`, `.x`, `[0, 1]`, or nothing.
    pub(crate) suffix: String,
    /// What follows `self.field` in Rust.
    pub(crate) access: TokenStream,
}

impl Shape {
    /// Number of scalars.
    pub(crate) fn scalars(&self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Array(length, inner) => length.saturating_mul(inner.scalars()),
            Self::Vector2 => 2,
            Self::Vector3 => 3,
            Self::Matrix3 => 9,
        }
    }

    /// The scalars in the order of the parameters, matrices by rows.
    pub(crate) fn elements(&self) -> Vec<Element> {
        let components = |names: &[&str]| {
            let element = |name: &&str| {
                let field = Ident::new(name, proc_macro2::Span::call_site());
                Element { suffix: format!(".{name}"), access: quote!(.#field) }
            };
            names.iter().map(element).collect()
        };
        match self {
            Self::Scalar => vec![Element { suffix: String::new(), access: TokenStream::new() }],
            Self::Vector2 => components(&["x", "y"]),
            Self::Vector3 => components(&["x", "y", "z"]),
            Self::Matrix3 => (0..9usize)
                .map(|k| {
                    let (i, j) = (k / 3, k % 3);
                    Element { suffix: format!("[{i}, {j}]"), access: quote!([(#i, #j)]) }
                })
                .collect(),
            Self::Array(length, inner) => {
                let inner = inner.elements();
                let mut all = Vec::new();
                for i in 0..*length {
                    for Element { suffix, access } in &inner {
                        all.push(Element { suffix: format!("[{i}]{suffix}"), access: quote!([#i] #access) });
                    }
                }
                all
            }
        }
    }
}

/// Most parameters of one field, and most coordinates of a model. More are a typing error, not a mechanism.
pub(crate) const MAX_LENGTH: usize = 10_000;

/// A generalized coordinate, a speed or an input, or an array of them.
#[derive(Clone, Debug)]
pub(crate) struct Quantity {
    pub(crate) name: Ident,
    /// `Some(n)` for an array of n, or of n rows.
    pub(crate) length: Option<usize>,
    /// `Some(n)` for rows of n each.
    pub(crate) columns: Option<usize>,
    /// The length of a family, of a grid the number of its rows, which is known when the program runs.
    pub(crate) family: Option<FamilyLength>,
    /// The number of columns of a grid.
    pub(crate) family_columns: Option<FamilyLength>,
    /// `None` where the user leaves it open.
    pub(crate) unit: Option<UnitText>,
}

/// The length of a family: a count, plus a constant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FamilyLength {
    /// The field that is the count.
    pub(crate) count: Ident,
    /// What is added to it.
    pub(crate) plus: i64,
}

impl Quantity {
    /// Number of scalars.
    pub(crate) fn scalars(&self) -> usize {
        self.length.unwrap_or(1) * self.columns.unwrap_or(1)
    }
    /// The scalars' names: `x`, or `theta[0]`, `theta[1]`, …, or `w[0][0]`, `w[0][1]`, …
    pub(crate) fn names(&self) -> Vec<String> {
        let name = &self.name;
        match (self.length, self.columns) {
            (None, _) => vec![name.to_string()],
            (Some(n), None) => (0..n).map(|i| format!("{name}[{i}]")).collect(),
            (Some(n), Some(m)) => {
                (0..n).flat_map(|i| (0..m).map(move |j| format!("{name}[{i}][{j}]"))).collect()
            }
        }
    }
}

/// A unit as written.
#[derive(Clone, Debug)]
pub(crate) struct UnitText {
    /// Names, numbers and single signs, with their spans.
    pub(super) tokens: Vec<(String, Span)>,
}

impl UnitText {
    /// The tokens for the parser of units.
    pub(crate) fn tokens(&self) -> Vec<&str> {
        self.tokens.iter().map(|(text, _)| text.as_str()).collect()
    }
    /// Without blanks: `kg*m/s^2`.
    pub(crate) fn text(&self) -> String {
        self.tokens().concat()
    }
    /// The unit as a whole.
    pub(crate) fn place(&self) -> Place {
        let ends = self.tokens.first().zip(self.tokens.last());
        ends.map_or_else(|| Place::from(Span::call_site()), |(first, last)| Place::between(first.1, last.1))
    }
    /// One token; the last where the unit ends too early.
    pub(crate) fn span(&self, token: usize) -> Span {
        self.tokens.get(token).or(self.tokens.last()).map_or_else(Span::call_site, |(_, span)| *span)
    }
}

/// Values that compile-time checks may use, one per scalar of a field.
#[derive(Clone, Debug)]
pub(crate) struct Nominal {
    pub(crate) values: Vec<f64>,
}

impl Declaration {
    /// Whether coordinates are numbered up to a count that is known when the program runs.
    pub(crate) fn has_families(&self) -> bool {
        self.coordinates.iter().any(|quantity| quantity.family.is_some())
    }

    /// The counts in order.
    pub(crate) fn counts(&self) -> impl Iterator<Item = &Ident> {
        self.fields.iter().filter(|field| field.kind == FieldKind::Count).map(|field| &field.name)
    }

    /// The same model with families as arrays of fixed length: `value` of the count plus the constant.
    pub(crate) fn at_counts(&self, value: impl Fn(&Ident) -> i64) -> Self {
        let mut all = self.clone();
        let at = |family: FamilyLength| usize::try_from(value(&family.count) + family.plus).ok();
        for quantity in &mut all.coordinates {
            if let Some(family) = quantity.family.take() {
                quantity.length = at(family);
                quantity.columns = quantity.family_columns.take().and_then(at);
            }
        }
        all
    }
}

/// Most that may be added to a count, and most by which indices may differ.
pub(crate) const MOST_OFFSET: i64 = 16;

/// `self.count`, `self.count + k` or `self.count - k`: the length of a family. `None` for another expression.
pub(crate) fn family_length(expr: &Expr) -> Option<FamilyLength> {
    let count = |expr: &Expr| match expr {
        Expr::Field(field) => match (&*field.base, &field.member) {
            (Expr::Path(path), syn::Member::Named(name)) if path.path.is_ident("self") => Some(name.clone()),
            _ => None,
        },
        _ => None,
    };
    match expr {
        Expr::Binary(sum) => {
            let count = count(&sum.left)?;
            let Expr::Lit(lit) = &*sum.right else { return None };
            let Lit::Int(k) = &lit.lit else { return None };
            let k = k.base10_parse::<i64>().ok().filter(|k| *k <= MOST_OFFSET)?;
            let plus = match sum.op {
                syn::BinOp::Add(_) => k,
                syn::BinOp::Sub(_) => -k,
                _ => return None,
            };
            Some(FamilyLength { count, plus })
        }
        Expr::Paren(inner) => family_length(&inner.expr),
        Expr::Group(inner) => family_length(&inner.expr),
        other => Some(FamilyLength { count: count(other)?, plus: 0 }),
    }
}

/// An array length: a macro sees tokens, so a named constant has no value here.
pub(crate) fn length(expr: &Expr, d: &mut Diagnostics) -> Option<usize> {
    let literal = match expr {
        Expr::Lit(lit) => match &lit.lit {
            Lit::Int(int) => int.base10_parse::<usize>().ok(),
            _ => None,
        },
        _ => None,
    };
    match literal {
        None if crate::library::any_word(quote!(#expr), &|word| word == "self") => {
            let message = messages::length_of_family(quote!(#expr), MOST_OFFSET);
            d.error(Place::of(expr), &message);
        }
        None => d.error(Place::of(expr), &messages::length_not_literal(quote!(#expr))),
        Some(0) => d.error(Place::of(expr), &messages::length_zero()),
        Some(n) if n > MAX_LENGTH => d.error(Place::of(expr), &messages::too_many_parameters(MAX_LENGTH)),
        Some(n) => return Some(n),
    }
    None
}

/// A type as it is usually written, without the blanks between tokens that do not need them.
pub(super) fn type_text(ty: &Type) -> String {
    let mut text = quote!(#ty).to_string();
    for (spaced, tight) in [
        (" < ", "<"),
        (" >", ">"),
        (" ,", ","),
        (" :: ", "::"),
        ("& ", "&"),
        ("( ", "("),
        (" )", ")"),
        (" ;", ";"),
    ] {
        text = text.replace(spaced, tight);
    }
    text
}
