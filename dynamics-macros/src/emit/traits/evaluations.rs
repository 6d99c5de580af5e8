//! Evaluations without a solve: M, Q, energies, momenta, conserved quantities, powers.

use dynamics_symbolic::compile::Kinks;
use dynamics_symbolic::graph::{Binary, Dependence, FunctionId, Node};
use dynamics_symbolic::mechanics::{ConservedKind, Named};
use dynamics_symbolic::schedule::Program;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::program::Printed;
use super::super::{function, local};
use super::Emission;

impl Emission<'_> {
    /// `fn name(&self, state) -> result { .. value(results) }` and the functions it calls.
    pub(super) fn method(
        &self,
        program: &Program,
        name: &str,
        result: &TokenStream,
        value: impl FnOnce(&[TokenStream]) -> TokenStream,
    ) -> (TokenStream, TokenStream) {
        let Printed { functions, statements, results } = self.print_seldom(program);
        let (name, at_state, prologue, value) =
            (function(name), self.at_state(), self.prologue(), value(&results));
        let solution = self.solution(&program.results, false);
        let inlining = self.inlining(program.body.len() + program.hoisted.len());
        let method = quote! {
            #inlining
            fn #name(#at_state) -> #result { #prologue #solution #statements #value }
        };
        (functions, method)
    }

    /// `fn name(&self, state, values)`, which writes the results to a slice.
    pub(super) fn writing(&self, program: &Program, name: &str) -> (TokenStream, TokenStream) {
        let Printed { functions, statements, results } = self.print_seldom(program);
        let (name, at_state, prologue, values) =
            (function(name), self.at_state(), self.prologue(), local("values"));
        let (f64, solution) = (&self.float(), self.solution(&program.results, false));
        let write = self.write(&quote!(#values), &results);
        let inlining = self.inlining(program.body.len() + program.hoisted.len());
        let method = quote! {
            #inlining
            fn #name(#at_state, #values: &mut [#f64]) {
                #prologue #solution #statements #write
            }
        };
        (functions, method)
    }

    /// `const KINKS` and `fn kinks`, where there are some, and the functions it calls.
    pub(super) fn kinks(&self) -> (TokenStream, TokenStream) {
        let Kinks { program, functions, are_all, .. } = &self.compiled.programs.kinks;
        let private = &self.private;
        let known =
            if *are_all { TokenStream::new() } else { quote!(const KINKS_ARE_ALL: #private::bool = false;) };
        if functions.is_empty() {
            return (TokenStream::new(), known);
        }
        let Printed { functions: parts, statements, results } = self.print(program);
        let (private, at_state, prologue, values) =
            (&self.private, self.at_state(), self.prologue(), local("kinks"));
        let cut =
            |(i, kink): (usize, TokenStream)| if self.is_cut(i) { quote!(#kink.of_a_cut()) } else { kink };
        let kinks: Vec<_> = self.each_kink(&results, functions).into_iter().enumerate().map(cut).collect();
        let (count, usize) = (kinks.len(), quote!(#private::usize));
        let method = quote! {
            #known
            const KINKS: #usize = #count;
            fn kinks(#at_state, #values: &mut [#private::Kink]) {
                #prologue #statements
                #values[..#count].copy_from_slice(&[#(#kinks),*]);
            }
        };
        (parts, method)
    }

    /// Whether a kink decides angles by `atan2`, and nothing else.
    fn is_cut(&self, kink: usize) -> bool {
        let branches = &self.compiled.programs.kinks.branches;
        let angle = |id| matches!(self.access.graph.node(id), Node::Binary(Binary::Atan2, ..));
        let mut decided = branches.iter().filter(|(_, branch)| branch.kink == kink).peekable();
        decided.peek().is_some() && decided.all(|(id, _)| angle(*id))
    }

    /// A `Kink` for every value.
    pub(super) fn each_kink(
        &self,
        values: &[TokenStream],
        functions: &[Option<FunctionId>],
    ) -> Vec<TokenStream> {
        let private = &self.private;
        let one = |(value, function): (&TokenStream, &Option<FunctionId>)| match function {
            None => quote!(#private::Kink::at_zero(#value)),
            Some(function) => {
                let field = &self.surface.functions[function.0 as usize];
                quote!(#private::Kink::of(&self.#field, #value))
            }
        };
        values.iter().zip(functions).map(one).collect()
    }

    pub(super) fn float(&self) -> TokenStream {
        let private = &self.private;
        quote!(#private::f64)
    }

    /// The list of what is conserved.
    pub(super) fn conserved(&self) -> TokenStream {
        let private = &self.private;
        let items = self.compiled.equations.conserved.iter().map(|conserved| {
            let Named { name, unit, .. } = &conserved.quantity;
            let kind = match conserved.kind {
                ConservedKind::Energy => quote!(Energy),
                ConservedKind::EnergyFunction => quote!(EnergyFunction),
                ConservedKind::Momentum => quote!(Momentum),
            };
            let kind = quote!(#private::ConservedKind::#kind);
            quote!(#private::ConservedQuantity { kind: #kind, name: #name, unit: #unit })
        });
        quote!(&[#(#items),*])
    }

    pub(super) fn named(&self, named: &[Named]) -> TokenStream {
        self.quantities(named.iter().map(|n| (n.name.as_str(), n.unit.as_str())))
    }

    /// `impl Energies`, for models that give T and V apart.
    pub(super) fn energies(&self) -> TokenStream {
        let programs = &self.compiled.programs;
        let (Some(kinetic), Some(potential)) = (&programs.kinetic_energy, &programs.potential_energy) else {
            return TokenStream::new();
        };
        let (model, private, f64) = (&self.surface.target, &self.private, self.float());
        let (f1, kinetic) = self.method(kinetic, "kinetic_energy", &f64, |r| r[0].clone());
        let (f2, potential) = self.method(potential, "potential_energy", &f64, |r| r[0].clone());
        quote! {
            #f1 #f2
            impl #private::Energies for #model { #kinetic #potential }
        }
    }

    /// `impl Powers`.
    pub(super) fn powers(&self) -> TokenStream {
        let (model, private) = (&self.surface.target, &self.private);
        let names = self.named(&self.compiled.equations.powers);
        let (functions, method) = self.writing(&self.compiled.programs.powers, "powers");
        let energy = self.access.graph.dependence(self.compiled.equations.energy_function);
        let (bool, driven) = (quote!(#private::bool), energy.on(Dependence::INPUTS));
        quote! {
            #functions
            impl #private::Powers for #model {
                const POWERS: &'static [#private::Quantity] = #names;
                const ENERGY_HAS_INPUTS: #bool = #driven;
                #method
            }
        }
    }
}
