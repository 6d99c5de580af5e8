//! `impl Constraints`.

use dynamics_symbolic::compile::{ConstraintPrograms, Kinks};
use dynamics_symbolic::mechanics::{ConstraintEquations, ConstraintKind, Elimination, General, Solution};
use dynamics_symbolic::schedule::Program;
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::super::program::Printed;
use super::super::{function, local};
use super::Emission;

/// Functions that stand beside an impl, and a method inside it.
pub(super) type Method = (TokenStream, TokenStream);

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
            self.reaction_kinks(),
            self.solve_unrolled(equations),
            self.accelerate_unrolled(equations),
            self.correct_unrolled(equations),
            self.constraint_derivatives(programs),
            self.inverse(),
            self.variations(),
            self.output_variations(),
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
        let (option, state) = (quote!(#private::Option), quote!(&<Self as #private::Model>::State));
        let (at, terms, k, found) = (local("state"), local("terms"), local("k"), local("accelerations"));
        let solved = quote!(#option<#private::Solved<<Self as #private::Model>::Vector, Self::Rows>>);
        let (of_inverse, inverse) = self.inverse();
        let (functions, variations) = self.variations();
        let (of_outputs, output_variations) = self.output_variations();
        let mass = match &self.compiled.programs.mass_product {
            Some(_) => {
                let to_columns = local("mass_matrix_columns");
                quote!(self.#to_columns(#at, &mut *#terms.mass);)
            }
            None => {
                quote!(#terms.mass.copy_from_slice(#private::Dynamics::mass_matrix(self, #at).as_slice());)
            }
        };
        // Not by the macro `unconstrained!`: its impl could not be put where the user's block is.
        quote! {
            #of_inverse #functions #of_outputs
            impl #private::Constraints for #model {
                type Rows = #private::SVector<#f64, 0>;
                type Residual = #private::SVector<#f64, 0>;
                type Jacobian = #private::SMatrix<#f64, 0, #n>;
                type VelocityJacobian = #private::SMatrix<#f64, 0, #n>;
                type VelocityOffset = #private::SVector<#f64, 0>;
                type Workspace = [#f64; #private::workspace_len(#n, 0)];
                const CONSTRAINTS: &'static [#private::Constraint] = &[];
                const ROWS: &'static [#private::Quantity] = &[];
                const SOLVER: #private::SolverKind = #private::SolverKind::Unconstrained;
                fn residual(&self, _: #state) -> Self::Residual { #private::vector([]) }
                fn velocity_residual(&self, _: #state) -> Self::Rows { #private::vector([]) }
                fn jacobian(&self, _: #state) -> Self::Jacobian { #private::matrix([[]; #n]) }
                fn velocity_jacobian(&self, _: #state) -> Self::VelocityJacobian {
                    #private::matrix([[]; #n])
                }
                fn velocity_offset(&self, _: #state) -> Self::VelocityOffset { #private::vector([]) }
                fn gamma(&self, _: #state) -> Self::Rows { #private::vector([]) }
                fn terms(&self, #at: #state, #terms: &mut #private::Terms<'_>) {
                    // M is symmetric: by rows it is as by columns.
                    #mass
                    #terms.force.copy_from_slice(#private::Dynamics::generalized_force(self, #at).as_slice());
                }
                #[inline]
                fn solve_unrolled(&self, #k: &Self::Constants, #at: #state) -> #solved {
                    match #private::Dynamics::accelerations_with(self, #k, #at) {
                        #private::Ok(#found) => {
                            #option::Some(#private::Solved {
                                accelerations: #found, multipliers: #private::vector([])
                            })
                        }
                        #private::Err(_) => #option::None,
                    }
                }
                #[inline]
                fn correct_unrolled(
                    &self,
                    _: &Self::Constants,
                    _: #state,
                    _: &Self::Rows,
                ) -> #option<<Self as #private::Model>::Vector> {
                    #option::Some(#private::vector([0.0; #n]))
                }
                fn constraint_derivatives(&self, _: #state, _: &Self::Rows, _: &mut [#f64]) {}
                #inverse #variations #output_variations
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

    /// `CONSTRAINTS`, `ROWS`, `SOLVER`, `FRICTION`.
    fn listed(&self, equations: &ConstraintEquations) -> TokenStream {
        let (private, none, some) = (&self.private, self.none(), self.some());
        let (mut first, mut modes) = (0usize, 0usize..);
        let listed = self.compiled.model.constraints.iter().map(|constraint| {
            let (name, rows, redundant) =
                (&constraint.name, constraint.components.len(), constraint.redundant);
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
                    name: #name, kind: #private::ConstraintKind::#kind,
                    first: #at, rows: #rows, redundant: #redundant,
                    switched: #switched,
                }
            }
        });
        let listed: Vec<TokenStream> = listed.collect();
        let (rows, route, blocks) =
            (self.named(&equations.rows), self.route(equations), self.blocks(equations));
        let (bool, friction) = (quote!(#private::bool), equations.force_by_multipliers.is_some());
        let kinetic = self.compiled.equations.energies.is_some();
        quote! {
            const CONSTRAINTS: &'static [#private::Constraint] = &[#(#listed),*];
            const ROWS: &'static [#private::Quantity] = #rows;
            const SOLVER: #private::SolverKind = #route;
            #blocks
            const FRICTION: #bool = #friction;
            const KINETIC: #bool = #kinetic;
        }
    }

    pub(super) fn none(&self) -> TokenStream {
        let private = &self.private;
        quote!(#private::Option::None)
    }

    pub(super) fn some(&self) -> TokenStream {
        let private = &self.private;
        quote!(#private::Option::Some)
    }

    /// How q̈ and λ are found, in words.
    fn route(&self, equations: &ConstraintEquations) -> TokenStream {
        let private = &self.private;
        match &equations.solution {
            Solution::Unrolled(unrolled) => {
                let elimination = self.in_words(&unrolled.elimination);
                quote!(#private::SolverKind::Unrolled { elimination: #elimination })
            }
            Solution::General(reason) => {
                let reason = match reason {
                    General::Redundant => "constraints repeat each other".to_owned(),
                    General::Friction => "forces depend on reactions".to_owned(),
                    General::NoPivots => {
                        "every order of elimination meets a pivot that is always zero".to_owned()
                    }
                    General::TooLarge(operations) => {
                        format!("unrolled it would take {operations} operations")
                    }
                };
                quote!(#private::SolverKind::General { reason: #reason })
            }
        }
    }

    /// `const BLOCKS`, where coordinates follow from rows block by block.
    fn blocks(&self, equations: &ConstraintEquations) -> TokenStream {
        let Solution::Unrolled(unrolled) = &equations.solution else { return TokenStream::new() };
        let Elimination::Blocks(blocks) = &unrolled.elimination else { return TokenStream::new() };
        let private = &self.private;
        let each = blocks.iter().map(|(rows, coordinates)| {
            quote!(#private::Block { rows: &[#(#rows),*], coordinates: &[#(#coordinates),*] })
        });
        quote!(const BLOCKS: &'static [#private::Block] = &[#(#each),*];)
    }

    fn in_words(&self, elimination: &Elimination) -> String {
        match elimination {
            Elimination::MinimumDegree => {
                "accelerations and multipliers together, those with the fewest neighbours first".to_owned()
            }
            Elimination::Speeds => "the declared speeds lead".to_owned(),
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
                    true => format!("all coordinates from the constraints, {blocks}"),
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
        let (name, at_state, prologue, value) =
            (function(name), self.at_state(), self.prologue(), value(&results));
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
        let (at_state, prologue, terms, lambda) =
            (self.at_state(), self.prologue(), local("terms"), local("lambda"));
        let (mass, rest) = results.split_at(n * n);
        let (force, rest) = rest.split_at(n);
        let (jacobian, gamma) = rest.split_at(r * n);
        let writes = [("mass", mass), ("force", force), ("jacobian", jacobian), ("gamma", gamma)].map(
            |(name, values)| {
                let name = function(name);
                self.write(&quote!(#terms.#name), values)
            },
        );
        let inlining = self.inlining(programs.terms.body.len() + programs.terms.hoisted.len());
        let method = quote! {
            #inlining
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
        let (at_state, prologue, f64, lambda) =
            (self.at_state(), self.prologue(), self.float(), local("lambda"));
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

    /// `const REACTION_KINKS` and `fn reaction_kinks`, where there are some.
    fn reaction_kinks(&self) -> Method {
        let Kinks { of_reactions, reaction_functions, .. } = &self.compiled.programs.kinks;
        if reaction_functions.is_empty() {
            return Method::default();
        }
        let Printed { functions, statements, results } = self.print(of_reactions);
        let (private, at_state, prologue, lambda) =
            (&self.private, self.at_state(), self.prologue(), local("lambda"));
        let (multipliers, values) = (local("multipliers"), local("kinks"));
        let kinks = self.each_kink(&results, reaction_functions);
        let (count, usize) = (kinks.len(), quote!(#private::usize));
        let method = quote! {
            const REACTION_KINKS: #usize = #count;
            fn reaction_kinks(#at_state, #multipliers: &Self::Rows, #values: &mut [#private::Kink]) {
                #prologue
                let #lambda = &#multipliers.data.0[0];
                #statements
                #values[..#count].copy_from_slice(&[#(#kinks),*]);
            }
        };
        (functions, method)
    }

    /// `fn constraint_derivatives`; not a number where they are too large to be emitted.
    fn constraint_derivatives(&self, programs: &ConstraintPrograms) -> Method {
        let (at_state, prologue, f64, lambda) =
            (self.at_state(), self.prologue(), self.float(), local("lambda"));
        let (multipliers, values) = (local("multipliers"), local("values"));
        let Ok(program) = &programs.derivatives else {
            let method = quote! {
                fn constraint_derivatives(#at_state, _: &Self::Rows, #values: &mut [#f64]) {
                    #values.fill(#f64::NAN);
                }
            };
            return (TokenStream::new(), method);
        };
        let Printed { functions, statements, results } = self.print_seldom(program);
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

    /// `fn inverse_unrolled`, where it is not too large to be emitted.
    fn inverse(&self) -> Method {
        self.written(self.compiled.programs.inverse.as_ref(), "inverse_unrolled")
    }

    /// `fn variations`, likewise.
    fn variations(&self) -> Method {
        self.written(self.compiled.programs.variations.as_ref(), "variations")
    }

    /// `fn output_variations`, likewise.
    fn output_variations(&self) -> Method {
        self.written(self.compiled.programs.output_variations.as_ref(), "output_variations")
    }

    /// A function of state, q̈ and λ that writes what a program computes.
    fn written(&self, program: Option<&Program>, name: &str) -> Method {
        let Some(program) = program else { return Method::default() };
        let name = format_ident!("{name}");
        let Printed { functions, statements, results } = self.solution_reader().whole(program);
        let (private, f64, at_state, prologue) =
            (&self.private, self.float(), self.at_state(), self.prologue());
        let (a, lambda, values) = (local("a"), local("lambda"), local("values"));
        let (accelerations, multipliers) = (local("accelerations"), local("multipliers"));
        let (modes, switched) = (local("modes"), self.switched());
        let constraints = if self.constrained().is_some() {
            quote!(let #lambda = &#multipliers.data.0[0];)
        } else {
            // Without asking for `Self::Rows`: where there are two impls by mistake, that is a further error.
            quote!(let (#lambda, #modes): (&[#f64; 0], &[#f64; #switched]) = (&[], &[]);)
        };
        let write = self.write(&quote!(#values), &results);
        let method = quote! {
            #[inline]
            fn #name(
                #at_state,
                #accelerations: &<Self as #private::Model>::Vector,
                #multipliers: &Self::Rows,
                #values: &mut [#f64],
            ) -> #private::bool {
                #prologue #constraints
                let #a = &#accelerations.data.0[0];
                #statements #write
                true
            }
        };
        (functions, method)
    }

    /// `fn constraint_of`: every function has a type of its own.
    fn constraint_of(&self) -> TokenStream {
        let (private, none, some, function) = (&self.private, self.none(), self.some(), local("function"));
        let model = &self.surface.target;
        let tests = self.surface.constraints.iter().enumerate().map(
            |(i, name)| quote!(if #function == #private::type_of(&<#model>::#name) { return #some(#i); }),
        );
        quote! {
            fn constraint_of(#function: #private::TypeId) -> #private::Option<#private::usize> {
                #(#tests)*
                #none
            }
        }
    }
}
