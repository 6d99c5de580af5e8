//! What solves the equations of a model with constraints by straight-line code: methods that return `None`
//! where it does not apply.

use dynamics_symbolic::graph::NodeId;
use dynamics_symbolic::mechanics::{ConstraintEquations, Guard, Guarded, Solution, Unrolled};
use dynamics_symbolic::schedule::Program;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::program::Printed;
use super::super::{function, local};
use super::Emission;
use super::constraints::Method;

/// Most steps of a program of which a second copy is emitted, for another result or for vectors of lanes.
pub(super) const MOST_STEPS_TWICE: usize = 1000;

/// A solution on the graph.
struct Path<'a> {
    /// The switched constraints that are released, by their modes.
    modes: &'a [usize],
    unrolled: &'a Unrolled,
    /// q̈, λ, guards.
    program: &'a Program,
    /// δ, guards; unless it is too large.
    correction: Option<&'a Program>,
}

impl Emission<'_> {
    /// `fn solve_unrolled`.
    pub(super) fn solve_unrolled(&self, equations: &ConstraintEquations) -> Method {
        let (private, n) = (&self.private, self.degrees());
        let result = quote!(#private::Solved<<Self as #private::Model>::Vector, Self::Rows>);
        let head = self.head("solve_unrolled", &TokenStream::new(), &result);
        let staged = self.staged();
        let paths = self.solutions(equations).into_iter().map(|Path { modes, unrolled, program, .. }| {
            let named = Program { name: format!("solve_{}", program.name), ..program.clone() };
            let printed = self.fusing(&staged.constants).print(&named, &program.body, &program.results);
            let (accelerations, rest) = printed.results.split_at(n);
            let (accelerations, multipliers) =
                (self.vector(accelerations), self.vector(&rest[..self.rows()]));
            let solved =
                quote!(#private::Solved { accelerations: #accelerations, multipliers: #multipliers });
            self.path(modes, &unrolled.guards, printed, &solved)
        });
        self.unrolled(&head, self.steps(equations), &TokenStream::new(), paths.collect())
    }

    /// `fn accelerate_unrolled`: q̈ alone, which is what integrators ask for most: the multipliers, about a
    /// fifth of the work, are left out. A second copy of the code, so only where that is short.
    pub(super) fn accelerate_unrolled(&self, equations: &ConstraintEquations) -> Method {
        if !self.is_short(equations) {
            return Method::default();
        }
        let (private, staged, n) = (&self.private, self.staged(), self.degrees());
        let head =
            self.head("accelerate_unrolled", &TokenStream::new(), &quote!(<Self as #private::Model>::Vector));
        let paths = self.solutions(equations).into_iter().map(|Path { modes, unrolled, program, .. }| {
            let (accelerations, rest) = program.results.split_at(n);
            let wanted: Vec<NodeId> = [accelerations, &rest[self.rows()..]].concat();
            let printed = self.fusing(&staged.constants).needed(program, &program.body, &wanted);
            let accelerations = self.vector(&printed.results[..n]);
            self.path(modes, &unrolled.guards, printed, &accelerations)
        });
        self.unrolled(&head, self.steps(equations), &TokenStream::new(), paths.collect())
    }

    /// Steps of the solutions on the graph.
    fn steps(&self, equations: &ConstraintEquations) -> usize {
        self.solutions(equations).iter().map(|path| path.program.body.len()).sum()
    }

    /// Whether there are solutions on the graph, short enough to be emitted twice.
    fn is_short(&self, equations: &ConstraintEquations) -> bool {
        !self.solutions(equations).is_empty() && self.steps(equations) <= MOST_STEPS_TWICE
    }

    /// `fn correct_unrolled`.
    pub(super) fn correct_unrolled(&self, equations: &ConstraintEquations) -> Method {
        let (private, right, lambda) = (&self.private, local("right"), local("lambda"));
        let head = self.head(
            "correct_unrolled",
            &quote!(, #right: &Self::Rows),
            &quote!(<Self as #private::Model>::Vector),
        );
        let given = quote!(let #lambda = &#right.data.0[0];);
        let staged = self.staged();
        let paths = self.solutions(equations).into_iter().filter_map(
            |Path { modes, unrolled, correction, .. }| {
                let program = correction?;
                let printed = self.body(&staged.constants).print(program, &program.body, &program.results);
                let delta = self.vector(&printed.results[..self.degrees()]);
                Some(self.path(modes, &unrolled.correction_guards, printed, &delta))
            },
        );
        self.unrolled(&head, self.steps(equations), &given, paths.collect())
    }

    /// The solutions on the graph: with all constraints, then with those sets of them released for which
    /// there is one.
    fn solutions<'a>(&'a self, equations: &'a ConstraintEquations) -> Vec<Path<'a>> {
        let Some((_, programs)) = self.constrained() else { return Vec::new() };
        let whole = match &equations.solution {
            Solution::Unrolled(unrolled) => {
                let program = &self.compiled.programs.accelerations;
                Some(Path { modes: &[], unrolled, program, correction: programs.correction.as_ref() })
            }
            Solution::General(_) => None,
        };
        let released = equations.released.iter().zip(&programs.released).map(|(released, programs)| Path {
            modes: &released.modes,
            unrolled: &released.unrolled,
            program: &programs.accelerations,
            correction: Some(&programs.correction),
        });
        whole.into_iter().chain(released).collect()
    }

    /// `fn name(&self, k: &Self::Constants, state: &Self::State, ..) -> Option<..>`.
    fn head(&self, name: &str, more: &TokenStream, result: &TokenStream) -> TokenStream {
        let (private, name, k, state) = (&self.private, function(name), local("k"), local("state"));
        quote!(
            fn #name(&self, #k: &Self::Constants, #state: &<Self as #private::Model>::State #more)
                -> #private::Option<#result>
        )
    }

    /// A method of these paths, each of which returns; `None` where none applies.
    fn unrolled(&self, head: &TokenStream, steps: usize, given: &TokenStream, paths: Vec<Method>) -> Method {
        let none = self.none();
        if paths.is_empty() {
            return (TokenStream::new(), quote!(#head { #none }));
        }
        let prologue = self.prologue();
        let (functions, paths): (TokenStream, Vec<TokenStream>) = paths.into_iter().unzip();
        // Without switched constraints the only path leaves in any case.
        let otherwise = (self.switched() > 0).then_some(none);
        let inlining = self.inlining(steps);
        let method = quote! {
            #inlining
            #head {
                #prologue #given
                #(#paths)*
                #otherwise
            }
        };
        (functions, method)
    }

    /// Straight-line code that returns a value where exactly these modes are released, unless one of its last
    /// results, the guards, forbids it.
    fn path(&self, modes: &[usize], guards: &[Guard], printed: Printed, value: &TokenStream) -> Method {
        let Printed { functions, statements, results } = printed;
        let (none, some, state) = (self.none(), self.some(), local("state"));
        let values = &results[results.len() - 2 * guards.len()..];
        let check = self.unguarded(guards, values).map(|unguarded| quote!(if #unguarded { return #none; }));
        if self.switched() == 0 {
            return (functions, quote!(#statements #check #some(#value)));
        }
        let held = (0..self.switched()).map(|mode| (mode, !modes.contains(&mode)));
        let exactly = held.map(|(mode, holds)| quote!(#state.active_set.holds(#mode) == #holds));
        let applies =
            if modes.is_empty() { quote!(#state.active_set.all_hold()) } else { quote!(#(#exactly)&&*) };
        (functions, quote!(if #applies { #statements #check return #some(#value); }))
    }

    /// Whether some guard's pivot is too small against its scale, or not a number.
    pub(super) fn unguarded(&self, guards: &[Guard], values: &[TokenStream]) -> Option<TokenStream> {
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

    /// How many of the last results of a program of derivatives are guards, and the check: derivatives hold
    /// where the unrolled solution does.
    pub(super) fn guarded_derivatives(
        &self,
        equations: &ConstraintEquations,
        results: &[TokenStream],
    ) -> (usize, TokenStream) {
        let Solution::Unrolled(unrolled) = &equations.solution else { return (0, TokenStream::new()) };
        let (private, state, count) = (&self.private, local("state"), 2 * unrolled.guards.len());
        let error = local("error");
        let values = &results[results.len() - count..];
        let checks = unrolled.guards.iter().zip(values.chunks(2)).filter_map(|(guard, pair)| {
            let unguarded = self.unguarded(&[*guard], pair)?;
            let (coordinate, index, pivot) = match guard.of {
                Guarded::Coordinate(i) => (true, i, &pair[0]),
                Guarded::Row(i) => (false, i, &pair[0]),
            };
            Some(quote!(if #unguarded {
                return #private::Err(#private::no_derivatives::<Self>(#coordinate, #index, #pivot));
            }))
        });
        let released = (self.switched() > 0).then(|| {
            quote!(
                if let #private::Option::Some(#error) = #private::released::<Self>(#state.active_set) {
                    return #private::Err(#error);
                }
            )
        });
        (count, quote!(#released #(#checks)*))
    }

    /// `fn accelerations_with` of a model with constraints: by the generated code, and where that does not
    /// apply by the general solver.
    pub(super) fn constrained_accelerations(&self) -> TokenStream {
        let (private, k, state, found) = (&self.private, local("k"), local("state"), local("found"));
        let solved = quote!(#private::Ok(#private::solve_once(self, #k, #state)?.accelerations));
        let (some, none) = (self.some(), self.none());
        let is_short = self.constrained().is_some_and(|(equations, _)| self.is_short(equations));
        let body = if is_short {
            quote! {
                match #private::Constraints::accelerate_unrolled(self, #k, #state) {
                    #some(#found) => #private::Ok(#found),
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
                #state: &<Self as #private::Model>::State,
            ) -> #private::Result<<Self as #private::Model>::Vector, #private::SolveError> {
                #body
            }
        }
    }
}
