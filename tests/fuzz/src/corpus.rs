//! The models to start from: all of this repository, good ones and the bad ones of the tests.

use std::fs;
use std::path::{Path, PathBuf};

use quote::ToTokens;
use syn::visit::{self, Visit};
use syn::{ItemImpl, ItemStruct};

use crate::trees::{Tree, trees};

/// A struct and its impl block.
#[derive(Clone, Debug)]
pub struct Seed {
    /// File and name.
    pub name: String,
    pub declaration: Vec<Tree>,
    pub implementation: Vec<Tree>,
}

/// Folders that hold models, from the root of the repository.
const FOLDERS: &[&str] = &["examples", "tests", "benches", "docs", "src", "tests/fuzz/seeds"];

/// Every model that is found; a repository without any is a mistake of the caller.
#[must_use]
pub fn read() -> Vec<Seed> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut files = Vec::new();
    FOLDERS.iter().for_each(|folder| collect(&root.join(folder), &mut files));
    files.push(root.join("README.md"));
    files.sort();
    files.dedup();
    files.iter().flat_map(|file| seeds(file)).collect()
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let text = path.extension().is_some_and(|e| e == "rs" || e == "md");
        if path.is_dir() && !path.ends_with("target") {
            collect(&path, files);
        } else if text {
            files.push(path);
        }
    }
}

fn seeds(file: &Path) -> Vec<Seed> {
    let Ok(text) = fs::read_to_string(file) else { return Vec::new() };
    let markdown = file.extension().is_some_and(|e| e == "md");
    let sources = if markdown { blocks(&text) } else { vec![text] };
    let mut found = Found::default();
    for source in sources {
        if let Ok(parsed) = syn::parse_file(&source) {
            found.visit_file(&parsed);
        }
    }
    let pair = |declaration: &ItemStruct| {
        let name = declaration.ident.to_string();
        let described = |i: &&ItemImpl| i.self_ty.to_token_stream().to_string().ends_with(&name);
        let implementation = found.implementations.iter().find(described)?;
        Some(Seed {
            name: format!("{}: {name}", file.file_name().unwrap_or_default().display()),
            declaration: trees(declaration.to_token_stream()),
            implementation: trees(implementation.to_token_stream()),
        })
    };
    found.declarations.iter().filter_map(pair).collect()
}

/// The Rust blocks of a Markdown text, hidden lines included; each in a function, since some hold statements.
fn blocks(text: &str) -> Vec<String> {
    let mut all = Vec::new();
    let mut block: Option<String> = None;
    for line in text.lines() {
        match (&mut block, line.trim_start().starts_with("```")) {
            (None, true) if line.contains("rust") => block = Some(String::from("fn block() {\n")),
            (Some(_), true) => all.extend(block.take().map(|b| b + "}")),
            (Some(b), false) => {
                let shown = line.strip_prefix("# ").unwrap_or(if line == "#" { "" } else { line });
                *b += shown;
                b.push('\n');
            }
            (None, _) => {}
        }
    }
    all
}

#[derive(Default)]
struct Found {
    declarations: Vec<ItemStruct>,
    implementations: Vec<ItemImpl>,
}

impl<'ast> Visit<'ast> for Found {
    fn visit_item_struct(&mut self, item: &'ast ItemStruct) {
        let derives = |a: &syn::Attribute| {
            a.path().is_ident("derive") && a.to_token_stream().to_string().contains("Dynamics")
        };
        if item.attrs.iter().any(derives) {
            let mut item = item.clone();
            item.attrs.retain(|a| !a.path().is_ident("derive") && !a.path().is_ident("doc"));
            self.declarations.push(item);
        }
    }

    fn visit_item_impl(&mut self, item: &'ast ItemImpl) {
        let own = |a: &syn::Attribute| a.path().segments.last().is_some_and(|s| s.ident == "dynamics");
        if item.attrs.iter().any(own) {
            let mut item = item.clone();
            item.attrs.retain(|a| !own(a));
            self.implementations.push(item);
        }
        visit::visit_item_impl(self, item);
    }
}
