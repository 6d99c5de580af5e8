//! `impl Constraints`.

use dynamics_symbolic::compile::ConstraintPrograms;
use dynamics_symbolic::mechanics::{
    ConstraintEquations, ConstraintKind, Elimination, General, Guard, Guarded, Solution,
};
use dynamics_symbolic::schedule::Program;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::local;
use super::super::program::Printed;
use super::Emission;

/// Functions that stand beside an impl, and a method inside it.
type Method = (TokenStream, TokenStream);

impl Emission<'_> {
    /// `impl Constraints`; a model without any says so.
    pub(super) fn constraints(&self) -> TokenStream {
        let (model, private, n) = (&self.surface.target, &self.private, self.degrees());
        let Some((equations, programs)) = self.constrained() else { return self.unconstrained() };
        let (types, listed) = (self.constraint_types(equations), self.listed(equations));
        let (h, r) = (equations.holonomic, equations.rows.len());
        let to_vector = |r: &[TokenStream]| self.vector(r);
        let to_matrix = |r: &[TokenStream]| self.matrix(r, n);
        let methods: Vec<Method> = vec![
            self.method(&programs.residual, "residual", &quote!(Self::Residual), to_vector),
            self.method(&programs.velocity_residual, "velocity_residual", &quote!(Self::Rows), to_vector),
            self.method(&programs.jacobian, "jacobian", &quote!(Self::Jacobian), to_matrix),
            self.method_of_part(
                (&programs.jacobian, h * n..r * n),
                "velocity_jacobian",
                &quote!(Self::VelocityJacobian),
                to_matrix,
            ),
            self.method_of_part(
                (&programs.velocity_offset, h..r),
                "velocity_offset",
                &quote!(Self::VelocityOffset),
                to_vector,
            ),
            self.method(&programs.gamma, "gamma", &quote!(Self::Rows), to_vector),
            self.terms(programs),
            self.friction(programs),
            self.solve_unrolled(equations),
            self.correct_unrolled(equations, programs),
            self.constraint_derivatives(programs),
        ];
        let (functions, methods): (Vec<_>, Vec<_>) = methods.into_iter().unzip();
        let constraint_of = self.constraint_of();
        quote! {
            #(#functions)*
            impl #private::Constraints for #model {
                #types #listed
                #(#methods)*
                #constraint_of
            }
        }
    }

    /// No rows.
    fn unconstrained(&self) -> TokenStream {
        let (model, private, n, f64) = (&self.surface.target, &self.private, self.degrees(), self.float());
        let (option, state) = (quote!(#private::Option), quote!(&<Self as Model>::State));
        let solved = quote!(#option<#private::Solved<<Self as Model>::Vector, Self::Rows>>);
        // Not by the macro `unconstrained!`: its impl could not be put where the user's block is.
        quote! {
            impl #private::Constraints for #model {
                type Rows = #private::SVector<#f64, 0>;
                type Residual = #private::SVector<#f64, 0>;
                type Jacobian = #private::SMatrix<#f64, 0, #n>;
                type VelocityJacobian = #private::SMatrix<#f64, 0, #n>;
                type VelocityOffset = #private::SVector<#f64, 0>;
                type Workspace = [#f64; 0];
                const CONSTRAINTS: &'static [#private::Constraint] = &[];
                const ROWS: &'static [#private::Quantity] = &[];
                const ROUTE: #private::Route = #private::Route::Unconstrained;
                fn residual(&self, _: #state) -> Self::Residual { #private::vector([]) }
                fn velocity_residual(&self, _: #state) -> Self::Rows { #private::vector([]) }
                fn jacobian(&self, _: #state) -> Self::Jacobian { #private::matrix([[]; #n]) }
                fn velocity_jacobian(&self, _: #state) -> Self::VelocityJacobian { #private::matrix([[]; #n]) }
                fn velocity_offset(&self, _: #state) -> Self::VelocityOffset { #private::vector([]) }
                fn gamma(&self, _: #state) -> Self::Rows { #private::vector([]) }
                fn terms(&self, state: #state, terms: &mut #private::Terms<'_>) {
                    // M is symmetric: by rows it is as by columns.
                    terms.mass.copy_from_slice(#private::Dynamics::mass_matrix(self, state).as_slice());
                    terms.force.copy_from_slice(#private::Dynamics::generalized_force(self, state).as_slice());
                }
                #[inline]
                fn solve_unrolled(&self, k: &Self::Constants, state: #state) -> #solved {
                    match #private::Dynamics::accelerations_with(self, k, state) {
                        Ok(accelerations) => {
                            #option::Some(#private::Solved { accelerations, multipliers: #private::vector([]) })
                        }
                        Err(_) => #option::None,
                    }
                }
                #[inline]
                fn correct_unrolled(&self, _: #state, _: &Self::Rows) -> #solved {
                    #option::Some(#private::Solved {
                        accelerations: #private::vector([0.0; #n]),
                        multipliers: #private::vector([]),
                    })
                }
                fn constraint_derivatives(&self, _: #state, _: &Self::Rows, _: &mut [#f64]) {}
                fn constraint_of(_: #private::TypeId) -> #option<#private::usize> { #option::None }
            }
        }
    }

    /// The types of results.
    fn constraint_types(&self, equations: &ConstraintEquations) -> TokenStream {
        let (private, f64, n) = (&self.private, self.float(), self.degrees());
        let (r, h) = (equations.rows.len(), equations.holonomic);
        let k = r - h;
        quote! {
            type Rows = #private::SVector<#f64, #r>;
            type Residual = #private::SVector<#f64, #h>;
            type Jacobian = #private::SMatrix<#f64, #r, #n>;
            type VelocityJacobian = #private::SMatrix<#f64, #k, #n>;
            type VelocityOffset = #private::SVector<#f64, #k>;
            type Workspace = [#f64; #private::workspace_len(#n, #r)];
        }
    }

    /// `CONSTRAINTS`, `ROWS`, `ROUTE`, `FRICTION`.
    fn listed(&self, equations: &ConstraintEquations) -> TokenStream {
        let (private, none, some) = (&self.private, self.none(), self.some());
        let (mut first, mut modes) = (0usize, 0usize..);
        let listed = self.compiled.model.constraints.iter().map(|constraint| {
            let (name, rows, redundant) = (&constraint.name, constraint.components.len(), constraint.redundant);
            let kind = match constraint.kind {
                ConstraintKind::Holonomic => quote!(Holonomic),
                ConstraintKind::Nonholonomic { .. } => quote!(Nonholonomic),
            };
            let mode = if constraint.switched { modes.next() } else { None };
            let switched = mode.map_or_else(|| none.clone(), |mode| quote!(#some(#mode)));
            let at = first;
            first += rows;
            quote! {
                #private::Constraint {
                    name: #name, kind: #private::ConstraintKind::#kind, first: #at, rows: #rows, redundant: #redundant,
                    switched: #switched,
                }
            }
        });
        let listed: Vec<TokenStream> = listed.collect();
        let (rows, route) = (self.named(&equations.rows), self.route(equations));
        let (bool, friction) = (quote!(#private::bool), equations.force_by_multipliers.is_some());
        quote! {
            const CONSTRAINTS: &'static [#private::Constraint] = &[#(#listed),*];
            const ROWS: &'static [#private::Quantity] = #rows;
            const ROUTE: #private::Route = #route;
            const FRICTION: #bool = #friction;
        }
    }

    fn none(&self) -> TokenStream {
        let private = &self.private;
        quote!(#private::Option::None)
    }

    fn some(&self) -> TokenStream {
        let private = &self.private;
        quote!(#private::Option::Some)
    }

    /// How q̈ and λ are found, in words.
    fn route(&self, equations: &ConstraintEquations) -> TokenStream {
        let private = &self.private;
        match &equations.solution {
            Solution::Unrolled(unrolled) => {
                let elimination = self.in_words(&unrolled.elimination);
                quote!(#private::Route::Unrolled { elimination: #elimination })
            }
            Solution::General(reason) => {
                let reason = match reason {
                    General::Redundant => "constraints repeat each other".to_owned(),
                    General::Friction => "forces depend on reactions".to_owned(),
                    General::NoPivots => "every order of elimination meets a pivot that is always zero".to_owned(),
                    General::TooLarge(operations) => format!("unrolled it would take {operations} operations"),
                };
                quote!(#private::Route::General { reason: #reason })
            }
        }
    }

    fn in_words(&self, elimination: &Elimination) -> String {
        match elimination {
            Elimination::MinimumDegree => {
                "accelerations and multipliers together, those with the fewest neighbours first".to_owned()
            }
            Elimination::Blocks(blocks) => {
                let dependent = |i: &usize| blocks.iter().any(|(_, dependent)| dependent.contains(i));
                let all = self.compiled.model.coordinates.iter().enumerate();
                let leading: Vec<String> =
                    all.filter(|(i, _)| !dependent(i)).map(|(_, c)| format!("`{}`", c.name)).collect();
                let blocks = match blocks.len() {
                    1 => "in one block".to_owned(),
                    n => format!("in {n} blocks"),
                };
                let lead = if leading.len() == 1 { "leads" } else { "lead" };
                match leading.is_empty() {
                    true => format!("dependent coordinates {blocks}, none is left"),
                    false => format!("dependent coordinates {blocks}, {} {lead}", leading.join(", ")),
                }
            }
        }
    }

    /// A method that returns some of a program's results.
    fn method_of_part(
        &self,
        (program, range): (&Program, std::ops::Range<usize>),
        name: &str,
        result: &TokenStream,
        value: impl FnOnce(&[TokenStream]) -> TokenStream,
    ) -> Method {
        let program = Program { name: name.to_owned(), ..program.clone() };
        let Printed { functions, statements, results } = self.body(&[]).part(&program, range);
        let (name, at_state, prologue, value) = (local(name), self.at_state(), self.prologue(), value(&results));
        let method = quote! {
            #[inline]
            fn #name(#at_state) -> #result { #prologue #statements #value }
        };
        (functions, method)
    }

    /// `fn terms`: M, Q, Φ_q, γ; forces without what depends on reactions.
    fn terms(&self, programs: &ConstraintPrograms) -> Method {
        let Printed { functions, statements, results } = self.print(&programs.terms);
        let (private, f64, n, r) = (&self.private, self.float(), self.degrees(), self.rows());
        let (at_state, prologue, terms, lambda) = (self.at_state(), self.prologue(), local("terms"), local("lambda"));
        let (mass, rest) = results.split_at(n * n);
        let (force, rest) = rest.split_at(n);
        let (jacobian, gamma) = rest.split_at(r * n);
        let writes =
            [("mass", mass), ("force", force), ("jacobian", jacobian), ("gamma", gamma)].map(|(name, values)| {
                let name = local(name);
                self.write(&quote!(#terms.#name), values)
            });
        let method = quote! {
            #[inline]
            fn terms(#at_state, #terms: &mut #private::Terms<'_>) {
                #prologue
                let #lambda = &[0.0 as #f64; #r];
                #statements
                #(#writes)*
            }
        };
        (functions, method)
    }

    /// `fn friction`, where forces depend on reactions.
    fn friction(&self, programs: &ConstraintPrograms) -> Method {
        let Some(program) = &programs.friction else { return Method::default() };
        let Printed { functions, statements, results } = self.print(program);
        let (force, by) = results.split_at(self.degrees());
        let (at_state, prologue, f64, lambda) = (self.at_state(), self.prologue(), self.float(), local("lambda"));
        let (multipliers, to, to_by) = (local("multipliers"), local("force"), local("by_multipliers"));
        let (write, write_by) = (self.write(&quote!(#to), force), self.write(&quote!(#to_by), by));
        let method = quote! {
            #[inline]
            fn friction(#at_state, #multipliers: &Self::Rows, #to: &mut [#f64], #to_by: &mut [#f64]) {
                #prologue
                let #lambda = &#multipliers.data.0[0];
                #statements
                #write #write_by
            }
        };
        (functions, method)
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

    /// `fn solve_unrolled`.
    fn solve_unrolled(&self, equations: &ConstraintEquations) -> Method {
        let (k, state) = (local("k"), local("state"));
        let head = quote!(&self, #k: &Self::Constants, #state: &<Self as Model>::State);
        let Solution::Unrolled(unrolled) = &equations.solution else {
            return (TokenStream::new(), self.not_unrolled("solve_unrolled", &head));
        };
        let program = &self.compiled.programs.accelerations;
        let staged = self.staged();
        let named = Program { name: "solve_unrolled".to_owned(), ..program.clone() };
        let printed = self.body(&staged.constants).print(&named, &program.body, &program.results);
        self.unrolled("solve_unrolled", &head, &TokenStream::new(), &unrolled.guards, printed)
    }

    /// `fn correct_unrolled`.
    fn correct_unrolled(&self, equations: &ConstraintEquations, programs: &ConstraintPrograms) -> Method {
        let (state, right, lambda) = (local("state"), local("right"), local("lambda"));
        let head = quote!(&self, #state: &<Self as Model>::State, #right: &Self::Rows);
        let (Solution::Unrolled(unrolled), Some(program)) = (&equations.solution, &programs.correction) else {
            return (TokenStream::new(), self.not_unrolled("correct_unrolled", &head));
        };
        let given = quote!(let #lambda = &#right.data.0[0];);
        self.unrolled("correct_unrolled", &head, &given, &unrolled.guards, self.print(program))
    }

    fn not_unrolled(&self, name: &str, head: &TokenStream) -> TokenStream {
        let (name, result, none) = (local(name), self.solved(), self.none());
        quote! {
            fn #name(#head) -> #result { #none }
        }
    }

    fn solved(&self) -> TokenStream {
        let private = &self.private;
        quote!(#private::Option<#private::Solved<<Self as Model>::Vector, Self::Rows>>)
    }

    /// A method that solves by straight-line code: N and R results, then guards.
    fn unrolled(
        &self,
        name: &str,
        head: &TokenStream,
        given: &TokenStream,
        guards: &[Guard],
        printed: Printed,
    ) -> Method {
        let Printed { functions, statements, results } = printed;
        let (name, result, none, some) = (local(name), self.solved(), self.none(), self.some());
        let (accelerations, rest) = results.split_at(self.degrees());
        let (multipliers, values) = rest.split_at(self.rows());
        let (private, prologue, all_hold) = (&self.private, self.prologue(), self.all_hold());
        let check = self.unguarded(guards, values).map(|unguarded| quote!(if #unguarded { return #none; }));
        let (accelerations, multipliers) = (self.vector(accelerations), self.vector(multipliers));
        let method = quote! {
            #[inline]
            fn #name(#head) -> #result {
                #all_hold #prologue #given #statements #check
                #some(#private::Solved { accelerations: #accelerations, multipliers: #multipliers })
            }
        };
        (functions, method)
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

    /// `fn constraint_derivatives`; not a number where they are too large to be emitted.
    fn constraint_derivatives(&self, programs: &ConstraintPrograms) -> Method {
        let (at_state, prologue, f64, lambda) = (self.at_state(), self.prologue(), self.float(), local("lambda"));
        let (multipliers, values) = (local("multipliers"), local("values"));
        let Ok(program) = &programs.derivatives else {
            let method = quote! {
                fn constraint_derivatives(#at_state, _: &Self::Rows, #values: &mut [#f64]) { #values.fill(#f64::NAN); }
            };
            return (TokenStream::new(), method);
        };
        let Printed { functions, statements, results } = self.print(program);
        let write = self.write(&quote!(#values), &results);
        let method = quote! {
            #[inline]
            fn constraint_derivatives(#at_state, #multipliers: &Self::Rows, #values: &mut [#f64]) {
                #prologue
                let #lambda = &#multipliers.data.0[0];
                #statements #write
            }
        };
        (functions, method)
    }

    /// `fn constraint_of`: every function has a type of its own.
    fn constraint_of(&self) -> TokenStream {
        let (private, none, some, function) = (&self.private, self.none(), self.some(), local("function"));
        let model = &self.surface.target;
        let tests = self
            .surface
            .constraints
            .iter()
            .enumerate()
            .map(|(i, name)| quote!(if #function == #private::type_of(&<#model>::#name) { return #some(#i); }));
        quote! {
            fn constraint_of(#function: #private::TypeId) -> #private::Option<#private::usize> {
                #(#tests)*
                #none
            }
        }
    }

    /// `fn accelerations_with` of a model with constraints: by the generated code, and where that does not apply by the general solver.
    pub(super) fn constrained_accelerations(&self) -> TokenStream {
        let (private, k, state) = (&self.private, local("k"), local("state"));
        let solved = quote!(Ok(#private::solve_once(self, #k, #state)?.accelerations));
        let body = self.without_multipliers(&solved).unwrap_or(solved);
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

    /// q̈ alone, which is what integrators ask for most: the multipliers, about a fifth of the work, are left out. A second copy of the code,
    /// so only where that is short.
    fn without_multipliers(&self, otherwise: &TokenStream) -> Option<TokenStream> {
        const SHORT: usize = 1000;
        let Solution::Unrolled(unrolled) = &self.constrained()?.0.solution else { return None };
        let program = &self.compiled.programs.accelerations;
        if program.body.len() > SHORT {
            return None;
        }
        let (degrees, staged) = (self.degrees(), self.staged());
        let (accelerations, rest) = program.results.split_at(degrees);
        let wanted = [accelerations, &rest[self.rows()..]].concat();
        let Printed { statements, results, .. } = self.body(&staged.constants).needed(program, &program.body, &wanted);
        let (accelerations, values) = results.split_at(degrees);
        let (private, none, some, prologue) = (&self.private, self.none(), self.some(), self.prologue());
        let (all_hold, vector) = (self.all_hold(), self.vector(accelerations));
        let check = self.unguarded(&unrolled.guards, values).map(|unguarded| quote!(if #unguarded { return #none; }));
        let found = local("found");
        Some(quote! {
            let #found = || -> #private::Option<<Self as Model>::Vector> {
                #all_hold #prologue #statements #check
                #some(#vector)
            };
            match #found() {
                #some(#found) => Ok(#found),
                #none => #otherwise,
            }
        })
    }
}
