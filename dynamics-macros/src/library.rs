//! Frames, bodies, inertia and joints: the words of models that are written in the language of models.
//!
//! Their text comes from the crate whose compiled code runs on time jets (`dynamics-vocabulary/src/bodies/`).
//! What runs there is elaborated here, so a word cannot mean two things.

use dynamics_vocabulary::sources::SOURCES;
use proc_macro2::{TokenStream, TokenTree};
use syn::{FnArg, ImplItem, ImplItemFn, Item, Type};

/// A type of the library with its functions.
#[derive(Clone, Debug)]
pub(crate) struct RecordType {
    pub(crate) name: String,
    pub(crate) fields: Vec<(String, Type)>,
    pub(crate) functions: Vec<ImplItemFn>,
}

/// The types that a model may use.
#[derive(Clone, Debug, Default)]
pub(crate) struct Library {
    pub(crate) types: Vec<RecordType>,
}

impl Library {
    /// What functions with these tokens may need: nothing is parsed for a model that uses none of it.
    pub(crate) fn needed_by(tokens: impl IntoIterator<Item = TokenStream>) -> Self {
        if tokens.into_iter().any(|stream| any_word(stream, &Self::has)) {
            Self::whole()
        } else {
            Self::default()
        }
    }

    /// Whether one of its types has this name.
    pub(crate) fn has(name: &str) -> bool {
        SOURCES.iter().any(|(names, _)| names.contains(&name))
    }

    /// All of it.
    fn whole() -> Self {
        let mut library = Self::default();
        for (_, source) in SOURCES {
            // That the sources parse is known from the compiler, which has read them, too.
            for item in syn::parse_file(source).map(|file| file.items).unwrap_or_default() {
                match item {
                    Item::Struct(item) => {
                        let fields = item.fields.into_iter();
                        let fields = fields.filter_map(|f| Some((f.ident?.to_string(), f.ty))).collect();
                        library.types.push(RecordType {
                            name: item.ident.to_string(),
                            fields,
                            functions: Vec::new(),
                        });
                    }
                    Item::Impl(item) if item.trait_.is_none() => {
                        let name = type_name(&item.self_ty);
                        let functions = item.items.into_iter().filter_map(|item| match item {
                            ImplItem::Fn(function) => Some(function),
                            _ => None,
                        });
                        if let Some(ty) = library.types.iter_mut().find(|ty| name.as_ref() == Some(&ty.name))
                        {
                            ty.functions.extend(functions);
                        }
                    }
                    _ => {}
                }
            }
        }
        library
    }

    /// The index of a type.
    pub(crate) fn find(&self, name: &str) -> Option<usize> {
        self.types.iter().position(|ty| ty.name == name)
    }
}

impl RecordType {
    /// A function by its name.
    pub(crate) fn function(&self, name: &str) -> Option<&ImplItemFn> {
        self.functions.iter().find(|f| f.sig.ident == name)
    }

    /// The names of its methods, for did-you-mean.
    pub(crate) fn methods(&self) -> Vec<String> {
        let methods =
            self.functions.iter().filter(|f| matches!(f.sig.inputs.first(), Some(FnArg::Receiver(_))));
        methods.map(|f| f.sig.ident.to_string()).collect()
    }
}

/// Whether a word of the tokens is one of those that are looked for.
pub(crate) fn any_word(tokens: TokenStream, wanted: &impl Fn(&str) -> bool) -> bool {
    let mut left = vec![tokens];
    while let Some(stream) = left.pop() {
        for tree in stream {
            match tree {
                TokenTree::Ident(word) if wanted(&word.to_string()) => return true,
                TokenTree::Group(group) => left.push(group.stream()),
                _ => {}
            }
        }
    }
    false
}

/// The last name of a path.
pub(crate) fn type_name(ty: &Type) -> Option<String> {
    match ty {
        Type::Path(path) => path.path.segments.last().map(|s| s.ident.to_string()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names by which the library is found to be needed are those of the types that stand in it.
    #[test]
    fn every_type_is_named() {
        for (names, source) in SOURCES {
            let items = syn::parse_file(source).expect("the compiler has read it").items;
            let types = items.iter().filter_map(|item| match item {
                Item::Struct(item) => Some(item.ident.to_string()),
                _ => None,
            });
            assert_eq!(types.collect::<Vec<_>>(), *names);
        }
        let library = Library::whole();
        assert!(library.types.iter().all(|ty| !ty.functions.is_empty()));
        assert!(Library::needed_by([quote::quote!(a + (b * [c]))]).types.is_empty());
    }
}
