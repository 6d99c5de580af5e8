//! Which type names a crate defines, and where.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use syn::visit::{self, Visit};

/// The files that define a type of each name, once per definition.
///
/// Unit tests and associated types do not count. Neither does the second form of an item under
/// `cfg(not(..))`, nor `Sealed`, which every sealed trait has in a module of its own.
pub(crate) fn definitions(source: &Path) -> BTreeMap<String, Vec<String>> {
    let mut found = Definitions::default();
    found.read(source);
    found.names
}

#[derive(Default)]
struct Definitions {
    names: BTreeMap<String, Vec<String>>,
    file: String,
}

impl Definitions {
    fn read(&mut self, folder: &Path) {
        let entries =
            fs::read_dir(folder).unwrap_or_else(|e| panic!("cannot list {}: {e}", folder.display()));
        let mut paths: Vec<_> = entries.map(|entry| entry.expect("a readable folder entry").path()).collect();
        paths.sort();
        for path in paths {
            if path.file_stem().is_some_and(|name| name == "tests") {
                continue;
            }
            if path.is_dir() {
                self.read(&path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).expect("a source file is UTF-8");
                let parsed = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
                self.file = path.display().to_string();
                self.visit_file(&parsed);
            }
        }
    }
}

/// Whether an item stands for another one without a feature.
fn is_second_form(item: &syn::Item) -> bool {
    let (syn::Item::Struct(syn::ItemStruct { attrs, .. })
    | syn::Item::Enum(syn::ItemEnum { attrs, .. })
    | syn::Item::Trait(syn::ItemTrait { attrs, .. })
    | syn::Item::Type(syn::ItemType { attrs, .. })) = item
    else {
        return false;
    };
    attrs.iter().any(|a| {
        a.path().is_ident("cfg")
            && matches!(&a.meta, syn::Meta::List(list) if list.tokens.to_string().starts_with("not"))
    })
}

impl<'ast> Visit<'ast> for Definitions {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        use syn::Item;
        let name = match item {
            Item::Enum(i) => Some(&i.ident),
            Item::Struct(i) => Some(&i.ident),
            Item::Trait(i) => Some(&i.ident),
            Item::Type(i) => Some(&i.ident),
            Item::Union(i) => Some(&i.ident),
            Item::Mod(i) if super::modules::is_test(&i.attrs) => return,
            _ => None,
        };
        let name = name.filter(|name| *name != "Sealed" && !is_second_form(item));
        if let Some(name) = name {
            self.names.entry(name.to_string()).or_default().push(self.file.clone());
        }
        visit::visit_item(self, item);
    }
}
