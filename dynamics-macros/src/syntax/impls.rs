//! The annotated impl block: functions with their roles, and constants.

use syn::{FnArg, Ident, ImplItem, ImplItemConst, ImplItemFn, ItemImpl, ReturnType};

use super::conditions;
use super::roles::{self, ConstraintOptions, FunctionAttributes, Role};
use crate::diagnostics::{Diagnostics, Place};
use crate::messages;

/// The impl block.
#[derive(Clone, Debug)]
pub(crate) struct Implementation {
    /// The item with the roles' attributes taken off: what goes back into the program.
    pub(crate) item: ItemImpl,
    /// Its functions, in order.
    pub(crate) functions: Vec<Function>,
    /// Its constants, in order.
    pub(crate) constants: Vec<Constant>,
}

/// A function of the impl block.
#[derive(Clone, Debug)]
pub(crate) struct Function {
    pub(crate) name: Ident,
    pub(crate) role: Role,
    /// The role's attribute.
    pub(crate) role_place: Place,
    /// Options of a constraint, beside its role.
    pub(crate) options: ConstraintOptions,
    /// The function with the role's attribute taken off.
    pub(crate) item: ImplItemFn,
}

impl Function {
    /// Whether it has the form `(&self, q: &Coordinates<Self>)`.
    pub(crate) fn takes_coordinates_only(&self) -> bool {
        let inputs = &self.item.sig.inputs;
        let by_reference = matches!(inputs.first(), Some(FnArg::Receiver(_)));
        let second = match inputs.get(1) {
            Some(FnArg::Typed(argument)) => is_coordinates(&argument.ty),
            _ => false,
        };
        by_reference && second && inputs.len() == 2
    }

    /// Whether it could say where something is: vectors for coordinates.
    pub(crate) fn may_be_place(&self) -> bool {
        self.takes_coordinates_only() && self.returns_vectors()
    }

    /// Whether it could say where the node with an index, or with two, is: `(&self, q, index)` to a vector.
    pub(crate) fn may_be_place_of_index(&self) -> bool {
        let inputs = &self.item.sig.inputs;
        let is_index = |argument: &FnArg| match argument {
            FnArg::Typed(argument) => matches!(&*argument.ty, syn::Type::Path(p) if p.path.is_ident("usize")),
            FnArg::Receiver(_) => false,
        };
        let second = match inputs.get(1) {
            Some(FnArg::Typed(argument)) => is_coordinates(&argument.ty),
            _ => false,
        };
        self.role == Role::Helper
            && second
            && (3..=4).contains(&inputs.len())
            && inputs.iter().skip(2).all(is_index)
            && self.returns_vectors()
    }

    /// Whether it returns a `Vec`.
    pub(crate) fn returns_list(&self) -> bool {
        self.returns().is_some_and(|name| name == "Vec")
    }

    /// Whether it returns vectors: one, or an array of them.
    fn returns_vectors(&self) -> bool {
        let ReturnType::Type(_, returned) = &self.item.sig.output else { return false };
        let mut ty = &**returned;
        while let syn::Type::Array(array) = ty {
            ty = &*array.elem;
        }
        let syn::Type::Path(path) = ty else { return false };
        path.path.segments.last().is_some_and(|s| s.ident == "Vec2" || s.ident == "Vec3")
    }

    /// Last segment of the returned type's path: `Vec2` of `dynamics::Vec2<Expr>`.
    pub(crate) fn returns(&self) -> Option<String> {
        match &self.item.sig.output {
            ReturnType::Type(_, ty) => match &**ty {
                syn::Type::Path(path) => path.path.segments.last().map(|s| s.ident.to_string()),
                _ => None,
            },
            ReturnType::Default => None,
        }
    }
}

/// Whether a type is `&Coordinates<..>`, or a reference to a generated `..Coordinates` struct.
pub(crate) fn is_coordinates(ty: &syn::Type) -> bool {
    let syn::Type::Reference(reference) = ty else { return false };
    match &*reference.elem {
        syn::Type::Path(path) => {
            path.path.segments.last().is_some_and(|s| s.ident.to_string().ends_with("Coordinates"))
        }
        _ => false,
    }
}

/// A constant of the impl block.
#[derive(Clone, Debug)]
pub(crate) struct Constant {
    pub(crate) name: Ident,
    pub(crate) item: ImplItemConst,
}

/// Reads the impl block.
pub(crate) fn implementation(mut item: ItemImpl, d: &mut Diagnostics) -> Option<Implementation> {
    check_inherent(&item, d)?;
    conditions::check(&item, d);
    let mut functions: Vec<Function> = Vec::new();
    let mut constants = Vec::new();
    for inner in &mut item.items {
        match inner {
            ImplItem::Fn(function) => {
                let FunctionAttributes { role, place, options } = roles::take(function, d);
                let (name, item) = (function.sig.ident.clone(), function.clone());
                functions.push(Function { name, role, role_place: place, options, item });
            }
            ImplItem::Const(constant) => {
                constants.push(Constant { name: constant.ident.clone(), item: constant.clone() });
            }
            ImplItem::Macro(call) => d.error(
                Place::of(&call.mac),
                &messages::macro_in_model(path(&call.mac.path), "write its code out"),
            ),
            _ => {}
        }
    }
    check_one_drawing(&functions, d);
    check_lagrangian_alone(&functions, d);
    Some(Implementation { item, functions, constants })
}

/// A model is declared once, in an inherent impl without generics.
fn check_inherent(item: &ItemImpl, d: &mut Diagnostics) -> Option<()> {
    if let Some((path, _)) = &item.trait_ {
        d.error(Place::of(path), &messages::trait_impl());
        return None;
    }
    if !item.generics.params.is_empty() {
        d.error(Place::of(&item.generics), &messages::generic_model());
        return None;
    }
    Some(())
}

/// A picture is drawn by one function; every other role is a sum or a list.
fn check_one_drawing(functions: &[Function], d: &mut Diagnostics) {
    let mut drawings = functions.iter().filter(|f| f.role == Role::Drawing);
    if let Some(first) = drawings.next() {
        for second in drawings {
            d.error(second.role_place, &messages::duplicate_role("drawing", &first.name));
        }
    }
}

/// L is T − V already: energies beside it would be counted twice, or be half of a model. Several functions
/// may add up to L.
fn check_lagrangian_alone(functions: &[Function], d: &mut Diagnostics) {
    let lagrangian = functions.iter().find(|f| f.role == Role::Lagrangian);
    let energy = functions.iter().find(|f| matches!(f.role, Role::Kinetic | Role::Potential));
    if let (Some(lagrangian), Some(energy)) = (lagrangian, energy) {
        d.error(lagrangian.role_place, &messages::lagrangian_beside(energy.role.name(), &energy.name));
    }
}

/// A path as text.
pub(crate) fn path(path: &syn::Path) -> String {
    path.segments.iter().map(|s| s.ident.to_string()).collect::<Vec<_>>().join("::")
}
