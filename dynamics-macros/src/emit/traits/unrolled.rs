//! What solves the equations of a model with constraints by straight-line code: methods that return `None` where it does not apply.

use dynamics_symbolic::compile::ConstraintPrograms;
use dynamics_symbolic::graph::NodeId;
use dynamics_symbolic::mechanics::{ConstraintEquations, Guard, Guarded, Solution, Unrolled};
use dynamics_symbolic::schedule::Program;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::local;
use super::super::program::Printed;
use super::Emission;
use super::constraints::Method;

/// Most steps of a program of which a second copy is emitted.
const SHORT: usize = 1000;

impl Emission<'_> {
    /// `fn solve_unrolled`.
    pub(super) fn solve_unrolled(&self, equations: &ConstraintEquations) -> Method {
        let (private, n) = (&self.private, self.degrees());
        let head = self.head(
            "solve_unrolled",
            &TokenStream::new(),
            &quote!(#private::Solved<<Self as Model>::Vector, Self::Rows>),
        );
        let Solution::Unrolled(unrolled) = &equations.solution else { return self.not_unrolled(&head) };
        let program = &self.compiled.programs.accelerations;
        let staged = self.staged();
        let named = Program { name: "solve_unrolled".to_owned(), ..program.clone() };
        let printed = self.body(&staged.constants).print(&named, &program.body, &program.results);
        let (accelerations, rest) = printed.results.split_at(n);
        let (accelerations, multipliers) = (self.vector(accelerations), self.vector(&rest[..self.rows()]));
        let solved = quote!(#private::Solved { accelerations: #accelerations, multipliers: #multipliers });
        self.unrolled(&head, &TokenStream::new(), &unrolled.guards, &printed, &solved)
    }

    /// `fn accelerate_unrolled`: q̈ alone, which is what integrators ask for most: the multipliers, about a fifth of the work, are left out. A
    /// second copy of the code, so only where that is short.
    pub(super) fn accelerate_unrolled(&self, equations: &ConstraintEquations) -> Method {
        let Some((unrolled, program)) = self.short(equations) else { return Method::default() };
        let staged = self.staged();
        let (accelerations, rest) = program.results.split_at(self.degrees());
        let wanted: Vec<NodeId> = [accelerations, &rest[self.rows()..]].concat();
        let printed = self.body(&staged.constants).needed(program, &program.body, &wanted);
        let accelerations = self.vector(&printed.results[..self.degrees()]);
        let head = self.head("accelerate_unrolled", &TokenStream::new(), &quote!(<Self as Model>::Vector));
        self.unrolled(&head, &TokenStream::new(), &unrolled.guards, &printed, &accelerations)
    }

    /// The solution and its program, where there is one that is short.
    fn short<'a>(&'a self, equations: &'a ConstraintEquations) -> Option<(&'a Unrolled, &'a Program)> {
        let Solution::Unrolled(unrolled) = &equations.solution else { return None };
        let program = &self.compiled.programs.accelerations;
        (program.body.len() <= SHORT).then_some((unrolled, program))
    }

    /// `fn correct_unrolled`.
    pub(super) fn correct_unrolled(&self, equations: &ConstraintEquations, programs: &ConstraintPrograms) -> Method {
        let (right, lambda) = (local("right"), local("lambda"));
        let head = self.head("correct_unrolled", &quote!(, #right: &Self::Rows), &quote!(<Self as Model>::Vector));
        let (Solution::Unrolled(unrolled), Some(program)) = (&equations.solution, &programs.correction) else {
            return self.not_unrolled(&head);
        };
        let staged = self.staged();
        let printed = self.body(&staged.constants).print(program, &program.body, &program.results);
        let delta = self.vector(&printed.results[..self.degrees()]);
        let given = quote!(let #lambda = &#right.data.0[0];);
        self.unrolled(&head, &given, &unrolled.correction_guards, &printed, &delta)
    }

    /// `fn name(&self, k: &Self::Constants, state: &Self::State, ..) -> Option<..>`.
    fn head(&self, name: &str, more: &TokenStream, result: &TokenStream) -> TokenStream {
        let (private, name, k, state) = (&self.private, local(name), local("k"), local("state"));
        quote!(fn #name(&self, #k: &Self::Constants, #state: &<Self as Model>::State #more) -> #private::Option<#result>)
    }

    fn not_unrolled(&self, head: &TokenStream) -> Method {
        let none = self.none();
        (TokenStream::new(), quote!(#head { #none }))
    }

    /// A method that computes a value by straight-line code whose last results are guards.
    fn unrolled(
        &self,
        head: &TokenStream,
        given: &TokenStream,
        guards: &[Guard],
        printed: &Printed,
        value: &TokenStream,
    ) -> Method {
        let Printed { functions, statements, results } = printed;
        let (none, some) = (self.none(), self.some());
        let values = &results[results.len() - 2 * guards.len()..];
        let (prologue, all_hold) = (self.prologue(), self.all_hold());
        let check = self.unguarded(guards, values).map(|unguarded| quote!(if #unguarded { return #none; }));
        let method = quote! {
            #[inline]
            #head {
                #all_hold #prologue #given #statements #check
                #some(#value)
            }
        };
        (functions.clone(), method)
    }

    /// Leaves with `None` where a constraint is released.
    fn all_hold(&self) -> TokenStream {
        let (state, none) = (local("state"), self.none());
        let switched = self.switched() > 0;
        if switched { quote!(if !#state.modes.all_hold() { return #none; }) } else { TokenStream::new() }
    }

    /// Whether some guard's pivot is too small against its scale, or not a number.
    fn unguarded(&self, guards: &[Guard], values: &[TokenStream]) -> Option<TokenStream> {
        let tests: Vec<TokenStream> = guards
            .iter()
            .zip(values.chunks(2))
            .filter(|(guard, _)| !self.is_number(guard.pivot))
            .map(|(guard, pair)| {
                let (pivot, scale, tolerance) = (&pair[0], &pair[1], guard.tolerance);
                let f64 = self.float();
                quote!(#f64::abs(#pivot) > #tolerance * #f64::abs(#scale))
            })
            .collect();
        // Without branches: the common case is that all pass.
        (!tests.is_empty()).then(|| quote!(!(#((#tests))&*)))
    }

    /// How many of the last results of a program of derivatives are guards, and the check: derivatives hold where the unrolled solution does.
    pub(super) fn guarded_derivatives(
        &self,
        equations: &ConstraintEquations,
        results: &[TokenStream],
    ) -> (usize, TokenStream) {
        let Solution::Unrolled(unrolled) = &equations.solution else { return (0, TokenStream::new()) };
        let (private, state, count) = (&self.private, local("state"), 2 * unrolled.guards.len());
        let values = &results[results.len() - count..];
        let checks = unrolled.guards.iter().zip(values.chunks(2)).filter_map(|(guard, pair)| {
            let unguarded = self.unguarded(&[*guard], pair)?;
            let (coordinate, index, pivot) = match guard.of {
                Guarded::Coordinate(i) => (true, i, &pair[0]),
                Guarded::Row(i) => (false, i, &pair[0]),
            };
            Some(quote!(if #unguarded { return Err(#private::no_derivatives::<Self>(#coordinate, #index, #pivot)); }))
        });
        let released = (self.switched() > 0).then(|| {
            quote!(if let #private::Option::Some(error) = #private::released::<Self>(#state.modes) { return Err(error); })
        });
        (count, quote!(#released #(#checks)*))
    }

    /// `fn accelerations_with` of a model with constraints: by the generated code, and where that does not apply by the general solver.
    pub(super) fn constrained_accelerations(&self) -> TokenStream {
        let (private, k, state, found) = (&self.private, local("k"), local("state"), local("found"));
        let solved = quote!(Ok(#private::solve_once(self, #k, #state)?.accelerations));
        let (some, none) = (self.some(), self.none());
        let is_short = self.constrained().is_some_and(|(equations, _)| self.short(equations).is_some());
        let body = if is_short {
            quote! {
                match #private::Constraints::accelerate_unrolled(self, #k, #state) {
                    #some(#found) => Ok(#found),
                    #none => #solved,
                }
            }
        } else {
            solved
        };
        quote! {
            #[inline]
            fn accelerations_with(
                &self,
                #k: &Self::Constants,
                #state: &<Self as Model>::State,
            ) -> Result<<Self as Model>::Vector, #private::SolveError> {
                #body
            }
        }
    }
}
