//! Functions that no role reaches: they are not elaborated, but what they read is read.
//!
//! A function that looks like a role, that nothing calls, and that alone reads some parameter, is a role that
//! was forgotten: a spring without its `#[potential]` would otherwise be left out of the motion without a
//! word.
//!
//! What they ask constraints for is checked by its tokens: a drawing that reads the reaction of a helper
//! would show nothing.
//!
//! Parameters that only the picture reads count as read: in helpers that are drawn as places, in
//! `#[drawing]`, and in helpers that these call.

use std::collections::BTreeSet;

use proc_macro2::{Ident, TokenStream, TokenTree};
use quote::ToTokens;

use super::Elaborator;
use crate::messages;
use crate::syntax::{Function, Role};

/// Names after `self.` and `Self::` in the body of a function: fields and functions alike.
fn names_used(function: &Function) -> BTreeSet<String> {
    fn collect(tokens: TokenStream, names: &mut BTreeSet<String>) {
        let mut before = [String::new(), String::new(), String::new()];
        for tree in tokens {
            if let TokenTree::Group(group) = &tree {
                collect(group.stream(), names);
            }
            let text = match &tree {
                TokenTree::Group(_) => String::new(),
                tree => tree.to_string(),
            };
            if before[1..] == ["self", "."] || before == ["Self", ":", ":"] {
                names.insert(text.clone());
            }
            before.rotate_left(1);
            before[2] = text;
        }
    }
    let mut names = BTreeSet::new();
    collect(function.item.block.to_token_stream(), &mut names);
    names
}

/// `.reaction(Self::name)` and `.slip(Self::name)` in a function's body: the methods with the names.
fn asked(function: &Function, model: &Ident) -> Vec<(Ident, Ident)> {
    /// The last segment of a path that begins with `Self` or the model's name, alone in parentheses.
    fn named(arguments: TokenStream, model: &Ident) -> Option<Ident> {
        let path: syn::Path = syn::parse2(arguments).ok()?;
        let mut last = path.segments.iter().rev();
        let (name, ty) = (last.next()?, last.next()?);
        (ty.ident == "Self" || ty.ident == *model).then(|| name.ident.clone())
    }
    let (mut found, mut left) = (Vec::new(), vec![function.item.block.to_token_stream()]);
    while let Some(stream) = left.pop() {
        let trees: Vec<TokenTree> = stream.into_iter().collect();
        for three in trees.windows(3) {
            if let [TokenTree::Punct(dot), TokenTree::Ident(method), TokenTree::Group(arguments)] = three
                && dot.as_char() == '.'
                && (method == "reaction" || method == "slip")
            {
                found.extend(named(arguments.stream(), model).map(|name| (method.clone(), name)));
            }
        }
        left.extend(
            trees
                .into_iter()
                .filter_map(|tree| if let TokenTree::Group(g) = tree { Some(g.stream()) } else { None }),
        );
    }
    found
}

/// Whether a function could have a role by its signature.
fn looks_like_a_role(function: &Function) -> bool {
    function.role == Role::Helper
        && function.takes_coordinates_only()
        && matches!(function.returns().as_deref(), Some("Expr" | "Force"))
}

impl Elaborator<'_> {
    /// Functions whose vectors are drawn as places where no function says what is drawn, by their indices.
    fn places_by_themselves(&self) -> Vec<usize> {
        let functions = &self.implementation.functions;
        if functions.iter().any(|function| function.role == Role::Drawing) {
            return Vec::new();
        }
        let is_place = |function: &Function| function.role == Role::Helper && function.may_be_place();
        functions.iter().enumerate().filter(|(_, function)| is_place(function)).map(|(i, _)| i).collect()
    }

    /// Whether helpers that no role reaches would be drawn, so that the units of what they return are wanted.
    pub(super) fn has_unread_places(&self) -> bool {
        let mut places = self.places_by_themselves().into_iter();
        self.dimensions.active && !self.exhausted && places.any(|index| !self.reached.contains(&index))
    }

    /// Elaborates these helpers for the units alone. Mistakes in them are not reported: nothing of the motion
    /// depends on them.
    pub(super) fn note_units_of_unread_places(&mut self) {
        let implementation = self.implementation;
        // The role that may read most: coordinates, inputs and reactions.
        self.role = Role::Output;
        for index in self.places_by_themselves() {
            if !self.reached.contains(&index) {
                self.steps = 0;
                let value = self.run(index, &implementation.functions[index]);
                self.note_returned(index, &value);
            }
        }
    }

    /// Names that the picture reads, in the places themselves or in helpers that they call.
    fn names_in_the_picture(&self, names: impl Fn(usize) -> BTreeSet<String>) -> BTreeSet<String> {
        let functions = &self.implementation.functions;
        let (mut found, mut seen) = (BTreeSet::new(), BTreeSet::new());
        let no_places = self.vectors_that_are_no_places();
        let drawn = |i: &usize| !no_places.contains(&functions[*i].name);
        let mut left: Vec<usize> = self.places_by_themselves().into_iter().filter(drawn).collect();
        left.extend((0..functions.len()).filter(|i| functions[*i].role == Role::Drawing));
        while let Some(index) = left.pop() {
            if seen.insert(index) {
                let read = names(index);
                let helpers = functions.iter().enumerate().filter(|(_, f)| f.role == Role::Helper);
                left.extend(helpers.filter(|(_, f)| read.contains(&f.name.to_string())).map(|(i, _)| i));
                found.extend(read);
            }
        }
        found
    }

    /// Notes which parameters are read by functions that are not elaborated, and reports forgotten roles.
    pub(super) fn readers_outside(&mut self) {
        let implementation = self.implementation;
        let functions: Vec<(bool, &Function, BTreeSet<String>)> = implementation
            .functions
            .iter()
            .enumerate()
            .map(|(i, function)| (self.reached.contains(&i), function, names_used(function)))
            .collect();
        let drawn = self.names_in_the_picture(|i| functions[i].2.clone());
        self.model.read_elsewhere.extend(drawn);
        for (i, (reached, function, names)) in functions.iter().enumerate() {
            if *reached {
                continue;
            }
            self.model.read_elsewhere.extend(names.iter().cloned());
            for (method, name) in asked(function, &self.declaration.name) {
                // A function that does not exist is rustc's to report.
                if implementation.functions.iter().any(|f| f.name == name) {
                    self.constraint_named(&method, &name);
                }
            }
            let name = function.name.to_string();
            let others =
                || functions.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, (_, _, names))| names);
            if !looks_like_a_role(function) || others().any(|names| names.contains(&name)) {
                continue;
            }
            let fields = self.declaration.fields.iter().map(|field| field.name.to_string());
            let own =
                fields.filter(|field| names.contains(field) && !others().any(|names| names.contains(field)));
            if let Some(field) = own.into_iter().next() {
                self.diagnostics.error(function.name.span(), &messages::forgotten_role(&name, field));
            }
        }
    }
}
