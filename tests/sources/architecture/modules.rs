//! Which file of a crate names what another one defines.
//!
//! Files are parsed, `use` is followed to the file that defines a name, through what other files hand on, and
//! paths in types, expressions and macros' tokens likewise. Unit tests do not count.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};

/// A module that has a file of its own: the names on the way to it from the crate's root.
pub(crate) type Module = Vec<String>;

/// The files of a crate.
#[derive(Debug, Default)]
pub(crate) struct Crate {
    files: BTreeMap<Module, File>,
}

/// What a file defines, imports and names.
#[derive(Debug, Default)]
struct File {
    defined: BTreeSet<String>,
    /// What `use` brings, by the name that it has here.
    imported: BTreeMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
    named: BTreeSet<Vec<String>>,
}

impl Crate {
    /// Reads all files below the folder of a `lib.rs`.
    pub(crate) fn read(source: &Path) -> Self {
        let mut all = Self::default();
        all.read_folder(source, &Vec::new());
        all
    }

    fn read_folder(&mut self, folder: &Path, module: &Module) {
        let entries =
            fs::read_dir(folder).unwrap_or_else(|e| panic!("cannot list {}: {e}", folder.display()));
        for path in entries.map(|entry| entry.expect("a readable folder entry").path()) {
            let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
            if name == "tests" {
                continue;
            }
            let inner: Module = module.iter().cloned().chain([name.clone()]).collect();
            if path.is_dir() {
                self.read_folder(&path, &inner);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).expect("a source file is UTF-8");
                let parsed = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
                let mut file = File::default();
                file.visit_file(&parsed);
                let at = if module.is_empty() && name == "lib" { Vec::new() } else { inner };
                self.files.insert(at, file);
            }
        }
    }

    /// The file that defines what a path names in a module, if it is this crate's.
    fn definer(&self, module: &Module, path: &[String], depth: usize) -> Option<Module> {
        let (first, mut rest) = path.split_first()?;
        if depth > 20 {
            return None;
        }
        let mut at = match first.as_str() {
            "crate" => Vec::new(),
            "self" => module.clone(),
            "super" => module[..module.len().checked_sub(1)?].to_vec(),
            _ => {
                rest = path;
                module.clone()
            }
        };
        while let Some((next, more)) = rest.split_first() {
            if next == "super" {
                at.pop()?;
                rest = more;
                continue;
            }
            let mut child = at.clone();
            child.push(next.clone());
            if self.files.contains_key(&child) {
                (at, rest) = (child, more);
                continue;
            }
            let file = self.files.get(&at)?;
            if file.defined.contains(next) {
                return Some(at);
            }
            if let Some(target) = file.imported.get(next) {
                let target: Vec<String> = target.iter().chain(more).cloned().collect();
                return if target == path && at == *module {
                    None
                } else {
                    self.definer(&at, &target, depth + 1)
                };
            }
            let through = |glob: &Vec<String>| {
                let target: Vec<String> = glob.iter().chain(rest).cloned().collect();
                self.definer(&at, &target, depth + 1).filter(|found| *found != at)
            };
            return file.globs.iter().find_map(through);
        }
        Some(at)
    }

    /// For each file the others that define what it names.
    pub(crate) fn uses(&self) -> BTreeMap<Module, BTreeSet<Module>> {
        let of = |(module, file): (&Module, &File)| {
            let globs = file.globs.iter();
            let paths = file.named.iter().chain(file.imported.values()).chain(globs);
            let found =
                paths.filter_map(|path| self.definer(module, path, 0)).filter(|found| found != module);
            (module.clone(), found.collect())
        };
        self.files.iter().map(of).collect()
    }

    /// Groups of modules of one folder that use each other in a circle, each with all that is below it; what
    /// stands in the folder's own file may use them, and they it.
    pub(crate) fn circles(&self) -> Vec<Vec<String>> {
        let uses = self.uses();
        let parents: BTreeSet<Module> =
            self.files.keys().filter(|m| !m.is_empty()).map(|m| m[..m.len() - 1].to_vec()).collect();
        let mut circles = Vec::new();
        for parent in parents {
            let child = |module: &Module| {
                (module.len() > parent.len() && module.starts_with(&parent))
                    .then(|| module[parent.len()].clone())
            };
            let mut arrows: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
            for (from, to) in uses.iter().filter_map(|(from, to)| Some((child(from)?, to))) {
                let to = to.iter().filter_map(child).filter(|to| *to != from);
                arrows.entry(from.clone()).or_default().extend(to);
            }
            let name = |child: &String| parent.iter().chain([child]).cloned().collect::<Vec<_>>().join("/");
            circles.extend(knots(&arrows).iter().map(|knot| knot.iter().map(name).collect()));
        }
        circles
    }

    /// Why one module uses another: the files, and the names.
    pub(crate) fn arrows(&self, from: &str, to: &str) -> BTreeSet<String> {
        let below = |module: &Module, place: &str| {
            let text = module.join("/");
            text == place || text.starts_with(&format!("{place}/"))
        };
        let mut found = BTreeSet::new();
        for (module, file) in self.files.iter().filter(|(module, _)| below(module, from)) {
            for path in file.named.iter().chain(file.imported.values()) {
                if let Some(other) = self.definer(module, path, 0).filter(|other| below(other, to)) {
                    let name = path.last().map_or("", String::as_str);
                    found.insert(format!("{} -> {}: {name}", module.join("/"), other.join("/")));
                }
            }
        }
        found
    }
}

/// Sets of nodes each of which reaches all others of its set, of two and more.
fn knots(arrows: &BTreeMap<String, BTreeSet<String>>) -> Vec<Vec<String>> {
    let reached = |from: &String| {
        let (mut seen, mut left) = (BTreeSet::new(), vec![from.clone()]);
        while let Some(at) = left.pop() {
            for next in arrows.get(&at).into_iter().flatten() {
                if seen.insert(next.clone()) {
                    left.push(next.clone());
                }
            }
        }
        seen
    };
    let reach: BTreeMap<&String, BTreeSet<String>> =
        arrows.keys().map(|node| (node, reached(node))).collect();
    let mut found: Vec<Vec<String>> = Vec::new();
    for (node, seen) in &reach {
        if seen.contains(*node) && !found.iter().any(|knot| knot.contains(node)) {
            let both = |other: &&String| reach.get(other).is_some_and(|back| back.contains(*node));
            found.push(seen.iter().filter(both).cloned().collect());
        }
    }
    found
}

pub(crate) fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|a| {
        a.path().is_ident("cfg")
            && matches!(&a.meta, syn::Meta::List(list) if list.tokens.to_string() == "test")
    })
}

impl File {
    fn import(&mut self, tree: &syn::UseTree, mut path: Vec<String>) {
        match tree {
            syn::UseTree::Path(inner) => {
                path.push(inner.ident.to_string());
                self.import(&inner.tree, path);
            }
            syn::UseTree::Name(name) => {
                let name = name.ident.to_string();
                let known =
                    if name == "self" { path.last().cloned().unwrap_or_default() } else { name.clone() };
                if name != "self" {
                    path.push(name);
                }
                self.imported.insert(known, path);
            }
            syn::UseTree::Rename(rename) => {
                path.push(rename.ident.to_string());
                // Several traits may be imported as `_`.
                let known = format!("{} as {}", path.join("::"), rename.rename);
                let known = if rename.rename == "_" { known } else { rename.rename.to_string() };
                self.imported.insert(known, path);
            }
            syn::UseTree::Glob(_) => self.globs.push(path),
            syn::UseTree::Group(group) => group.items.iter().for_each(|tree| self.import(tree, path.clone())),
        }
    }

    /// Paths in what a macro is given.
    fn tokens(&mut self, tokens: TokenStream) {
        let (mut path, mut colons): (Vec<String>, usize) = (Vec::new(), 0);
        let mut end = |path: &mut Vec<String>| {
            if path.len() > 1 {
                self.named.insert(std::mem::take(path));
            }
            path.clear();
        };
        let mut groups = Vec::new();
        for tree in tokens {
            match tree {
                TokenTree::Ident(word) => {
                    if colons != 2 {
                        end(&mut path);
                    }
                    path.push(word.to_string());
                    colons = 0;
                }
                TokenTree::Punct(mark) if mark.as_char() == ':' => colons += 1,
                other => {
                    end(&mut path);
                    colons = 0;
                    if let TokenTree::Group(group) = other {
                        groups.push(group.stream());
                    }
                }
            }
        }
        end(&mut path);
        groups.into_iter().for_each(|stream| self.tokens(stream));
    }
}

impl<'ast> Visit<'ast> for File {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        use syn::Item;
        let (attributes, name) = match item {
            Item::Const(i) => (&i.attrs, Some(&i.ident)),
            Item::Enum(i) => (&i.attrs, Some(&i.ident)),
            Item::Fn(i) => (&i.attrs, Some(&i.sig.ident)),
            Item::Impl(i) => (&i.attrs, None),
            Item::Macro(i) => (&i.attrs, i.ident.as_ref()),
            Item::Mod(i) => (&i.attrs, i.content.as_ref().map(|_| &i.ident)),
            Item::Static(i) => (&i.attrs, Some(&i.ident)),
            Item::Struct(i) => (&i.attrs, Some(&i.ident)),
            Item::Trait(i) => (&i.attrs, Some(&i.ident)),
            Item::Type(i) => (&i.attrs, Some(&i.ident)),
            Item::Use(i) => (&i.attrs, None),
            _ => return visit::visit_item(self, item),
        };
        if is_test(attributes) {
            return;
        }
        if let Some(name) = name {
            self.defined.insert(name.to_string());
        }
        visit::visit_item(self, item);
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.import(&item.tree, Vec::new());
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.leading_colon.is_none() {
            self.named.insert(path.segments.iter().map(|s| s.ident.to_string()).collect());
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        self.visit_path(&call.path);
        self.tokens(call.tokens.clone());
    }
}
