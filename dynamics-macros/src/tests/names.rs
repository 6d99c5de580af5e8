//! Names in emitted code: each is bound where it is read, and none is bound that a user may have given to
//! something else.
//!
//! Compiling what is emitted takes seconds for each model; to follow its names takes next to nothing, so that
//! whole families of models can be asked. [`Names`] walks over blocks as rustc does.

use std::collections::BTreeSet;

use syn::visit::{self, Visit};
use syn::{Expr, Item, ItemConst, Pat, Path, Stmt};

/// What rustc would not find, or find elsewhere, in the items that a model's macro emits; the user's own
/// block is left out.
pub(super) fn mistakes(items: &[Item]) -> Vec<String> {
    let mut names = Names::default();
    for item in items {
        // The user's own functions stand in an inherent impl.
        let own = matches!(item, Item::Impl(item) if item.trait_.is_none() && !is_generated(&item.attrs));
        if !own {
            names.visit_item(item);
        }
    }
    names.mistakes
}

/// Whether lints are switched off for an item: what is generated has that.
fn is_generated(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|a| a.path().is_ident("allow") && quote::quote!(#a).to_string().contains("unused"))
}

/// Scopes of values from the outermost on, and what is wrong.
#[derive(Default)]
struct Names {
    values: Vec<BTreeSet<String>>,
    /// Names that `use` brings, which lead paths.
    imported: Vec<BTreeSet<String>>,
    mistakes: Vec<String>,
}

impl Names {
    fn within(&mut self, walk: impl FnOnce(&mut Self)) {
        self.values.push(BTreeSet::new());
        self.imported.push(BTreeSet::new());
        walk(self);
        self.values.pop();
        self.imported.pop();
    }

    /// Functions, constants and `use` of a block are known in all of it.
    fn declare<'a>(&mut self, items: impl Iterator<Item = &'a Item>) {
        for item in items {
            match item {
                Item::Fn(function) => {
                    self.values.last_mut().expect("a scope").insert(function.sig.ident.to_string());
                }
                Item::Use(item) => self.import(&item.tree),
                _ => {}
            }
        }
    }

    fn import(&mut self, tree: &syn::UseTree) {
        let name = match tree {
            syn::UseTree::Path(path) => return self.import(&path.tree),
            syn::UseTree::Group(group) => return group.items.iter().for_each(|tree| self.import(tree)),
            syn::UseTree::Rename(rename) => rename.rename.to_string(),
            syn::UseTree::Name(name) => name.ident.to_string(),
            syn::UseTree::Glob(_) => return self.mistakes.push("a glob is imported".to_owned()),
        };
        self.must_be_reserved("`use` names", &name);
        self.imported.last_mut().expect("a scope").insert(name);
    }

    /// A user's type, static or constant of the same name would be meant.
    fn must_be_reserved(&mut self, what: &str, name: &str) {
        if !name.starts_with("__") {
            self.mistakes.push(format!("{what} `{name}`"));
        }
    }

    fn bind(&mut self, pattern: &Pat) {
        struct Bound<'a>(&'a mut Names);
        impl<'a> Visit<'a> for Bound<'_> {
            fn visit_pat_ident(&mut self, pattern: &'a syn::PatIdent) {
                let name = pattern.ident.to_string();
                self.0.must_be_reserved("a pattern binds", &name);
                self.0.values.last_mut().expect("a scope").insert(name);
                visit::visit_pat_ident(self, pattern);
            }
            fn visit_path(&mut self, path: &'a Path) {
                self.0.visit_path(path);
            }
        }
        Bound(self).visit_pat(pattern);
    }

    fn is_known(&self, name: &str) -> bool {
        name == "self" || self.values.iter().any(|scope| scope.contains(name))
    }
}

impl<'a> Visit<'a> for Names {
    fn visit_item_const(&mut self, constant: &'a ItemConst) {
        self.within(|names| visit::visit_item_const(names, constant));
    }

    fn visit_block(&mut self, block: &'a syn::Block) {
        self.within(|names| {
            let items =
                block.stmts.iter().filter_map(|s| if let Stmt::Item(item) = s { Some(item) } else { None });
            names.declare(items);
            visit::visit_block(names, block);
        });
    }

    /// A function sees no locals of the block in which it stands.
    fn visit_signature(&mut self, signature: &'a syn::Signature) {
        for input in &signature.inputs {
            if let syn::FnArg::Typed(argument) = input {
                self.bind(&argument.pat);
            }
        }
        // They are known to the whole function, as its imports are.
        for parameter in signature.generics.type_params() {
            let name = parameter.ident.to_string();
            self.must_be_reserved("a generic parameter is", &name);
            self.imported.last_mut().expect("a scope").insert(name);
        }
        visit::visit_signature(self, signature);
    }

    fn visit_item_fn(&mut self, function: &'a syn::ItemFn) {
        self.within(|names| visit::visit_item_fn(names, function));
    }

    fn visit_impl_item_fn(&mut self, function: &'a syn::ImplItemFn) {
        self.within(|names| visit::visit_impl_item_fn(names, function));
    }

    fn visit_local(&mut self, local: &'a syn::Local) {
        if let Some(init) = &local.init {
            visit::visit_local_init(self, init);
        }
        self.bind(&local.pat);
    }

    fn visit_expr_closure(&mut self, closure: &'a syn::ExprClosure) {
        self.within(|names| {
            closure.inputs.iter().for_each(|input| names.bind(input));
            names.visit_expr(&closure.body);
        });
    }

    fn visit_arm(&mut self, arm: &'a syn::Arm) {
        self.within(|names| {
            names.bind(&arm.pat);
            names.visit_expr(&arm.body);
        });
    }

    fn visit_expr_for_loop(&mut self, each: &'a syn::ExprForLoop) {
        self.visit_expr(&each.expr);
        self.within(|names| {
            names.bind(&each.pat);
            names.visit_block(&each.body);
        });
    }

    fn visit_expr_if(&mut self, expression: &'a syn::ExprIf) {
        self.within(|names| {
            if let Expr::Let(condition) = &*expression.cond {
                names.visit_expr(&condition.expr);
                names.bind(&condition.pat);
            } else {
                names.visit_expr(&expression.cond);
            }
            names.visit_block(&expression.then_branch);
        });
        expression.else_branch.iter().for_each(|(_, otherwise)| self.visit_expr(otherwise));
    }

    fn visit_expr_path(&mut self, path: &'a syn::ExprPath) {
        match path.path.get_ident() {
            Some(name) if path.qself.is_none() => {
                let name = name.to_string();
                if !self.is_known(&name) {
                    self.mistakes.push(format!("`{name}` is not bound"));
                }
            }
            _ => visit::visit_expr_path(self, path),
        }
    }

    fn visit_path(&mut self, path: &'a Path) {
        visit::visit_path(self, path);
        let first = path.segments.first().expect("a path has segments").ident.to_string();
        let own = ["Self", "super", "crate"].contains(&first.as_str());
        let imported = self.imported.iter().any(|scope| scope.contains(&first));
        // What is not named from the root on is imported, or the model's own.
        let models = first.starts_with("Subject");
        if path.leading_colon.is_none() && !own && !imported && !models {
            self.mistakes.push(format!("`{first}` is named by no absolute path"));
        }
    }

    fn visit_attribute(&mut self, _: &'a syn::Attribute) {}
}
