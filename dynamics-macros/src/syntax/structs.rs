//! The annotated struct: its parameters, coordinates and inputs.

use syn::{Fields, GenericArgument, Ident, ItemStruct, PathArguments, Type};

use super::attributes;
use super::declaration::{Declaration, Field, FieldKind, MAX_LENGTH, Shape, length, type_text};
use crate::diagnostics::{Diagnostics, Place};
use crate::messages;

/// Reads the struct and its attributes.
pub(crate) fn declaration(item: ItemStruct, d: &mut Diagnostics) -> Declaration {
    check_no_generics(&item, d);
    check_name(&item.ident, d);
    let mut attributes = attributes::read(&item.attrs, d);
    let before = d.len();
    let mut fields = fields(&item, d);
    if d.len() > before {
        // A field that is refused is no field any more; that its unit names none would be a second error.
        attributes.units.retain(|(name, _)| fields.iter().any(|f| f.name == *name));
        attributes.nominal.retain(|(name, _)| fields.iter().any(|f| f.name == *name));
    }
    let output_units = attributes::attach_units(&mut fields, attributes.units, d);
    attributes::attach_nominal(&mut fields, attributes.nominal, d);
    let mut declaration = Declaration {
        name: item.ident.clone(),
        visibility: item.vis.clone(),
        crate_path: attributes.crate_path,
        accurate: attributes.accurate,
        targets: attributes.targets,
        coordinates: attributes.coordinates,
        speeds: attributes.speeds,
        inputs: attributes.inputs,
        fields,
        output_units,
        item,
    };
    attributes::check_names(&mut declaration, d);
    let asked = declaration.targets.c.or(declaration.targets.wgsl);
    if let Some(span) = asked.filter(|_| declaration.has_families()) {
        d.error(span, &messages::target_of_families());
    }
    declaration
}

/// An enum or union: an empty model of its name, so that its `impl` block finds something and reports nothing
/// more.
pub(crate) fn not_a_struct(other: syn::DeriveInput, d: &mut Diagnostics) -> Declaration {
    d.error(other.ident.span(), &messages::not_a_struct(&other.ident));
    let item = ItemStruct {
        attrs: Vec::new(),
        vis: other.vis,
        struct_token: Default::default(),
        ident: other.ident,
        generics: other.generics,
        fields: Fields::Unit,
        semi_token: None,
    };
    declaration(item, d)
}

/// Types without which no model can be written.
const ALWAYS_NAMED: &[&str] = &["Coordinates", "Expr", "f64"];

/// Whether no model may have this name: in its module every function would find the struct in place of the
/// type.
pub(crate) fn is_always_named(name: &Ident) -> bool {
    ALWAYS_NAMED.iter().any(|word| name == word)
}

fn check_name(name: &Ident, d: &mut Diagnostics) {
    if is_always_named(name) {
        d.error(name.span(), &messages::name_of_language(name));
    }
}

/// Parameters are `f64`: the derived program is concrete.
fn check_no_generics(item: &ItemStruct, d: &mut Diagnostics) {
    if !item.generics.params.is_empty() {
        d.error(Place::of(&item.generics), &messages::generic_model());
    }
}

/// The fields, in order; a unit struct has none.
fn fields(item: &ItemStruct, d: &mut Diagnostics) -> Vec<Field> {
    let named = match &item.fields {
        Fields::Named(named) => &named.named,
        Fields::Unit => return Vec::new(),
        Fields::Unnamed(fields) => {
            d.error(Place::of(fields), &messages::unnamed_fields());
            return Vec::new();
        }
    };
    let (mut parameters, mut functions) = (0, 0);
    let mut fields = Vec::new();
    for field in named {
        let Some(name) = field.ident.clone() else { continue };
        let kind = match shape(&field.ty, d) {
            TypeKind::Parameter(shape) => {
                let first = parameters;
                parameters += shape.scalars();
                if parameters > MAX_LENGTH {
                    d.error(Place::of(&field.ty), &messages::too_many_parameters(MAX_LENGTH));
                    return fields;
                }
                FieldKind::Parameter { shape, first }
            }
            TypeKind::Function => {
                functions += 1;
                FieldKind::Function(functions - 1)
            }
            TypeKind::Count => FieldKind::Count,
            TypeKind::Numbered => FieldKind::Numbered,
            TypeKind::Wrong => continue,
        };
        fields.push(Field { name, kind, unit: None, nominal: None });
    }
    fields
}

enum TypeKind {
    Parameter(Shape),
    Function,
    Count,
    Numbered,
    Wrong,
}

/// Names of the language's and the standard library's types that are neither parameters nor functions.
const NOT_PARAMETERS: &[&str] = &[
    "i8",
    "i16",
    "i32",
    "i64",
    "i128",
    "isize",
    "u8",
    "u16",
    "u32",
    "u64",
    "u128",
    "usize",
    "f32",
    "bool",
    "char",
    "str",
    "String",
    "Vec",
    "VecDeque",
    "BTreeMap",
    "BTreeSet",
    "Option",
    "Result",
    "Cell",
    "RefCell",
    "Mutex",
    "RwLock",
    "Cow",
    "PhantomData",
    "Duration",
];

/// nalgebra's types of numbers; of these, `Vector3<f64>` and `Matrix3<f64>` are parameters.
const ALGEBRA: &[&str] = &[
    "Vector1",
    "Vector2",
    "Vector3",
    "Vector4",
    "Vector5",
    "Vector6",
    "Matrix1",
    "Matrix2",
    "Matrix3",
    "Matrix4",
    "Matrix5",
    "Matrix6",
    "SVector",
    "SMatrix",
    "DVector",
    "DMatrix",
    "Point2",
    "Point3",
    "Quaternion",
    "UnitQuaternion",
];

/// Pointers through which a smooth function is one.
const POINTERS: &[&str] = &["Box", "Rc", "Arc"];

/// Whether no type of this form is a smooth function; what the user's own names stand for is not known here.
fn never_smooth(ty: &Type) -> bool {
    match ty {
        Type::Paren(inner) => never_smooth(&inner.elem),
        Type::Group(inner) => never_smooth(&inner.elem),
        Type::Reference(inner) => inner.mutability.is_some() || never_smooth(&inner.elem),
        Type::Path(path) => path.path.segments.last().is_some_and(|last| {
            let name = last.ident.to_string();
            let types: Vec<&Type> = match &last.arguments {
                PathArguments::AngleBracketed(a) => a.args.iter().filter_map(of_type).collect(),
                _ => Vec::new(),
            };
            let own = path.path.segments.len() == 1;
            let foreign = path
                .path
                .segments
                .first()
                .is_some_and(|s| s.ident == "std" || s.ident == "core" || s.ident == "alloc");
            match name.as_str() {
                name if POINTERS.contains(&name) && (own || foreign) => {
                    types.iter().any(|inner| never_smooth(inner))
                }
                name if NOT_PARAMETERS.contains(&name) => own || foreign,
                name if ALGEBRA.contains(&name) => !types.is_empty(),
                "f64" => last.arguments.is_none(),
                "Vec2" | "Vec3" | "Mat3" => true,
                _ => false,
            }
        }),
        Type::TraitObject(_) | Type::Macro(_) | Type::Infer(_) | Type::Verbatim(_) => false,
        _ => true,
    }
}

fn of_type(argument: &GenericArgument) -> Option<&Type> {
    match argument {
        GenericArgument::Type(ty) => Some(ty),
        _ => None,
    }
}

/// What a field's type makes of it.
fn shape(ty: &Type, d: &mut Diagnostics) -> TypeKind {
    match ty {
        Type::Paren(inner) => shape(&inner.elem, d),
        Type::Group(inner) => shape(&inner.elem, d),
        Type::Array(array) => {
            let Some(length) = length(&array.len, d) else { return TypeKind::Wrong };
            match shape(&array.elem, d) {
                TypeKind::Parameter(inner) => TypeKind::Parameter(Shape::Array(length, Box::new(inner))),
                TypeKind::Function => {
                    d.error(Place::of(&array.elem), &messages::array_of_functions());
                    TypeKind::Wrong
                }
                TypeKind::Count | TypeKind::Numbered => {
                    d.error(Place::of(&array.elem), &messages::parameter_type(type_text(&array.elem)));
                    TypeKind::Wrong
                }
                TypeKind::Wrong => TypeKind::Wrong,
            }
        }
        Type::Path(path) => {
            let Some(last) = path.path.segments.last() else { return TypeKind::Function };
            let name = last.ident.to_string();
            let of_f64 = match &last.arguments {
                PathArguments::AngleBracketed(a) => {
                    let first = a.args.first();
                    matches!(first, Some(GenericArgument::Type(Type::Path(t))) if t.path.is_ident("f64"))
                        && a.args.len() == 1
                }
                _ => false,
            };
            match name.as_str() {
                "f64" if last.arguments.is_none() => TypeKind::Parameter(Shape::Scalar),
                "Vec2" if of_f64 => TypeKind::Parameter(Shape::Vector2),
                "Vec3" | "Vector3" if of_f64 => TypeKind::Parameter(Shape::Vector3),
                "Mat3" | "Matrix3" if of_f64 => TypeKind::Parameter(Shape::Matrix3),
                "usize" if last.arguments.is_none() => TypeKind::Count,
                "Vec" if of_f64 => TypeKind::Numbered,
                "Box" if is_boxed_slice(last) => TypeKind::Numbered,
                "Vec2" | "Vec3" | "Mat3" => {
                    d.error(Place::of(ty), &messages::parameter_without_f64(name));
                    TypeKind::Wrong
                }
                _ => function(ty, d),
            }
        }
        _ => function(ty, d),
    }
}

/// Whether a segment is `Box<[f64]>`.
fn is_boxed_slice(segment: &syn::PathSegment) -> bool {
    let PathArguments::AngleBracketed(arguments) = &segment.arguments else { return false };
    let of_f64 = |ty: &Type| matches!(ty, Type::Path(t) if t.path.is_ident("f64"));
    let slice = |ty: &Type| matches!(ty, Type::Slice(slice) if of_f64(&slice.elem));
    arguments.args.len() == 1 && arguments.args.first().and_then(of_type).is_some_and(slice)
}

/// A smooth function, unless the type cannot be one.
fn function(ty: &Type, d: &mut Diagnostics) -> TypeKind {
    if never_smooth(ty) {
        d.error(Place::of(ty), &messages::parameter_type(type_text(ty)));
        return TypeKind::Wrong;
    }
    TypeKind::Function
}
