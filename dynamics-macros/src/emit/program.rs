//! Straight-line programs as Rust.
//!
//! One step is one `let` on `f64`. A block of some thousands of `let`s crashes rustc when debug info is on (rust-lang/rust#122357), so steps
//! stand in nested blocks of at most [`BLOCK`] that return what later blocks read; above [`SPLIT`] operations a program is cut into functions
//! of about [`PART`] operations, which halves the compile time of large models for some run time.

mod operand;
mod parts;

use std::collections::{BTreeMap, BTreeSet};

use dynamics_symbolic::graph::{Graph, Node, NodeId};
use dynamics_symbolic::schedule::{Program, Step};
use proc_macro2::{Ident, TokenStream};
use quote::quote;

pub(super) use operand::Access;
pub(super) use parts::{Body, Printed};

use super::local;

/// Most `let`s of one block.
const BLOCK: usize = 256;
/// Operations above which a program is cut into functions.
const SPLIT: usize = 4_000;
/// Operations of one such function.
const PART: usize = 1_024;

/// The nodes that a step defines.
pub(super) fn defined(step: &Step) -> Vec<NodeId> {
    match step {
        Step::Node(id) => vec![*id],
        Step::SinCos { sin, cos, .. } => sin.iter().chain(cos).copied().collect(),
        Step::Smooth { orders } => orders.iter().flatten().copied().collect(),
    }
}

/// The nodes that a step reads.
pub(super) fn read(graph: &Graph, step: &Step) -> Vec<NodeId> {
    match step {
        Step::Node(id) => graph.node(*id).children().collect(),
        Step::SinCos { angle, .. } => vec![*angle],
        Step::Smooth { orders } => {
            orders.iter().flatten().next().map(|id| graph.node(*id).children().collect()).unwrap_or_default()
        }
    }
}

/// Prints the steps of one function: where every value is found, and the `let`s.
struct Printer<'a> {
    access: &'a Access<'a>,
    /// Values at hand and how they are written.
    values: BTreeMap<NodeId, TokenStream>,
    /// Locals used so far, for their numbers.
    locals: usize,
}

impl<'a> Printer<'a> {
    fn new(access: &'a Access<'a>) -> Self {
        Self { access, values: BTreeMap::new(), locals: 0 }
    }

    /// How a value is read here.
    fn value(&self, id: NodeId) -> TokenStream {
        self.values.get(&id).cloned().unwrap_or_else(|| self.access.leaf(id))
    }

    fn fresh(&mut self) -> Ident {
        self.locals += 1;
        local(&format!("v{}", self.locals - 1))
    }

    /// Steps in blocks; `wanted` is what must be at hand afterwards.
    fn steps(&mut self, steps: &[Step], wanted: &BTreeSet<NodeId>) -> TokenStream {
        if steps.len() <= BLOCK {
            return steps.iter().map(|step| self.step(step)).collect();
        }
        let blocks: Vec<&[Step]> = steps.chunks(BLOCK).collect();
        let mut needed = vec![wanted.clone(); blocks.len()];
        for i in (0..blocks.len() - 1).rev() {
            needed[i] = needed[i + 1].clone();
            needed[i].extend(blocks[i + 1].iter().flat_map(|step| read(self.access.graph, step)));
        }
        blocks.iter().zip(&needed).map(|(block, needed)| self.block(block, needed)).collect()
    }

    /// One block that returns those of its values that are needed later.
    fn block(&mut self, steps: &[Step], needed: &BTreeSet<NodeId>) -> TokenStream {
        let body: TokenStream = steps.iter().map(|step| self.step(step)).collect();
        let out: Vec<TokenStream> =
            steps.iter().flat_map(defined).filter(|id| needed.contains(id)).map(|id| self.value(id)).collect();
        quote! {
            let (#(#out,)*) = {
                #body
                (#(#out,)*)
            };
        }
    }

    fn step(&mut self, step: &Step) -> TokenStream {
        match step {
            Step::Node(id) => {
                let value = self.operation(*id);
                let name = self.fresh();
                self.values.insert(*id, quote!(#name));
                quote!(let #name = #value;)
            }
            Step::SinCos { angle, sin, cos } => self.sin_cos(*angle, *sin, *cos),
            Step::Smooth { orders } => self.smooth(orders),
        }
    }

    fn sin_cos(&mut self, angle: NodeId, sin: Option<NodeId>, cos: Option<NodeId>) -> TokenStream {
        let private = &self.access.private;
        let angle = self.value(angle);
        let call = match (sin, cos) {
            (Some(_), Some(_)) => quote!(#private::math::sin_cos(#angle)),
            (Some(_), None) => quote!(#private::math::sin(#angle)),
            _ => quote!(#private::math::cos(#angle)),
        };
        let names: Vec<Ident> = [sin, cos].into_iter().flatten().map(|id| self.define(id)).collect();
        match names.as_slice() {
            [one] => quote!(let #one = #call;),
            names => quote!(let (#(#names),*) = #call;),
        }
    }

    fn define(&mut self, id: NodeId) -> Ident {
        let name = self.fresh();
        self.values.insert(id, quote!(#name));
        name
    }

    fn smooth(&mut self, orders: &[Option<NodeId>; 4]) -> TokenStream {
        let Some((function, argument)) = orders.iter().flatten().find_map(|id| match self.access.graph.node(*id) {
            Node::Smooth { function, argument, .. } => Some((function, argument)),
            _ => None,
        }) else {
            return TokenStream::new();
        };
        let (private, argument) = (&self.access.private, self.value(argument));
        let function = self.access.function(function);
        let call = quote!(#private::SmoothFunction::derivatives(&#function, #argument));
        let names = orders.map(|order| {
            order.map_or_else(
                || quote!(_),
                |id| {
                    let name = self.define(id);
                    quote!(#name)
                },
            )
        });
        quote!(let [#(#names),*] = #call;)
    }
}

/// Steps of `program` that are computed where `hoisted` says: with the body, or apart.
fn all_steps(program: &Program, staged: bool) -> Vec<Step> {
    let hoisted = if staged { &[][..] } else { &program.hoisted[..] };
    hoisted.iter().chain(&program.body).copied().collect()
}
