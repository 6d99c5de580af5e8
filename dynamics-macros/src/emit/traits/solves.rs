//! Evaluations that solve M q̈ = Q: accelerations, Jacobians, and outputs and events that may use
//! accelerations.

use std::collections::BTreeSet;

use dynamics_symbolic::graph::NodeId;
use dynamics_symbolic::mechanics::Named;
use dynamics_symbolic::schedule::{Program, Step};
use dynamics_symbolic::series::Series;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::program::{Body, Printed, defined, read};
use super::super::{function, local};
use super::{Emission, Names, identity};

/// Accelerations, and corrections where there are constraints, in two stages.
pub(super) struct Staged {
    /// Steps that are computed once per model.
    once: Vec<Step>,
    /// Nodes of the constants array.
    pub(super) constants: Vec<NodeId>,
    /// Pivots that the parameters alone decide: coordinate, Dᵢ, Mᵢᵢ.
    fixed: Vec<(usize, NodeId, NodeId)>,
    /// Pivots to check at every state.
    pub(super) moving: Vec<(usize, NodeId, NodeId)>,
}

/// A printed program that solves for q̈.
pub(super) struct Solved {
    pub(super) functions: TokenStream,
    pub(super) statements: TokenStream,
    /// Returns where a pivot vanishes.
    pub(super) check: TokenStream,
    /// q̈.
    pub(super) vector: TokenStream,
    /// Further results.
    pub(super) more: Vec<TokenStream>,
}

impl Staged {
    /// Makes room for the constants of a further program.
    fn join(&mut self, program: &Program) {
        let known: BTreeSet<NodeId> = self.once.iter().flat_map(defined).collect();
        let is_new = |step: &&Step| defined(step).iter().any(|id| !known.contains(id));
        self.once.extend(program.hoisted.iter().filter(is_new));
        let further: Vec<NodeId> =
            program.constants.iter().copied().filter(|id| !self.constants.contains(id)).collect();
        self.constants.extend(further);
    }
}

impl Emission<'_> {
    /// `impl Dynamics`.
    pub(super) fn dynamics(&self) -> TokenStream {
        let (model, private, programs) = (&self.surface.target, &self.private, &self.compiled.programs);
        let vector = quote!(<Self as #private::Model>::Vector);
        let staged = self.staged();
        let count = staged.constants.len();
        let (f64, names) = (self.float(), self.conserved());
        let quantities = identity::named(self.surface, &Names::of(&self.compiled.model));
        let (f1, constants) = self.constants(&staged);
        let (f2, accelerations) = self.accelerations(&staged);
        let to_vector = |r: &[TokenStream]| self.vector(r);
        let (f3, mass) = self.mass_matrix();
        let (f4, force) = self.method(&programs.generalized_force, "generalized_force", &vector, to_vector);
        let (f5, momenta) = self.method(&programs.momenta, "momenta", &vector, to_vector);
        let (f6, energy) = self.method(&programs.energy_function, "energy_function", &f64, |r| r[0].clone());
        let (f7, conserved) = self.writing(&programs.conserved, "conserved");
        let (f8, rates) = self.momentum_rates();
        let (parameter, derivatives, series) = (self.parameter(), self.derivatives(), self.series(&staged));
        let (operations, angle_sets) = (self.operations(), self.angle_sets());
        let lanes = self.accelerations_in_lanes(&staged);
        let (f9, kinks) = self.kinks();
        let (f10, speeds) = self.speeds();
        let (f11, assumptions) = self.assumptions();
        let velocities = self.compiled.equations.has_velocity_forces(self.access.graph);
        let constant_mass = self.compiled.equations.has_constant_mass(self.access.graph);
        let time = self.compiled.equations.has_explicit_time(self.access.graph);
        quote! {
            #f1 #f2 #f3 #f4 #f5 #f6 #f7 #f8 #f9 #f10 #f11
            impl #private::Dynamics for #model {
                type Constants = [#f64; #count];
                #quantities
                const CONSERVED: &'static [#private::ConservedQuantity] = #names;
                #operations
                #angle_sets
                const VELOCITY_FORCES: #private::bool = #velocities;
                const CONSTANT_MASS: #private::bool = #constant_mass;
                const EXPLICIT_TIME: #private::bool = #time;
                #parameter #constants #accelerations #lanes #derivatives #mass #force #momenta
                #rates #energy #conserved #speeds #assumptions #kinks #series
            }
        }
    }

    /// `fn mass_matrix`: all elements at once, or where that would be too large column by column.
    fn mass_matrix(&self) -> (TokenStream, TokenStream) {
        let (private, programs, n) = (&self.private, &self.compiled.programs, self.degrees());
        let result = quote!(<Self as #private::Model>::Matrix);
        let Some(product) = &programs.mass_product else {
            return self.method(&programs.mass_matrix, "mass_matrix", &result, |r| self.matrix(r, n));
        };
        let Printed { functions, statements, results } = self.solution_reader().whole(product);
        let (model, prologue, f64, state) =
            (&self.surface.target, self.prologue(), self.float(), local("state"));
        let (a, lambda, modes) = (local("a"), local("lambda"), local("modes"));
        let (columns, values, i, j, matrix) =
            (local("columns"), local("values"), local("i"), local("j"), local("matrix"));
        let (write, switched, at_state) =
            (self.write(&quote!(#values), &results), self.switched(), self.at_state());
        let to_columns = local("mass_matrix_columns");
        // Each column from the accelerations that are 1 in one place. A large matrix is not made on the stack
        // where a slice is asked for.
        let function = quote! {
            #functions
            impl #model {
                #[inline(never)]
                fn #to_columns(#at_state, #columns: &mut [#f64]) {
                    #prologue
                    let (#lambda, #modes): (&[#f64; 0], &[#f64; #switched]) = (&[], &[]);
                    for (#j, #values) in #columns.chunks_exact_mut(#n).enumerate() {
                        let mut #a = [0.0; #n];
                        #a[#j] = 1.0;
                        let #a = &#a;
                        #statements #write
                    }
                    // Symmetric to the last bit, which rounding alone does not make it.
                    for #j in 0..#n {
                        for #i in 0..#j {
                            #columns[#j * #n + #i] = #columns[#i * #n + #j];
                        }
                    }
                }
            }
        };
        let method = quote! {
            #[inline(never)]
            fn mass_matrix(#at_state) -> #result {
                let mut #matrix = <#result>::zeros();
                self.#to_columns(#state, #matrix.as_mut_slice());
                #matrix
            }
        };
        (function, method)
    }

    /// `const OPERATIONS`, where the accelerations have a program.
    fn operations(&self) -> TokenStream {
        let (program, private) = (&self.compiled.programs.accelerations, &self.private);
        if program.results.is_empty() {
            return TokenStream::new();
        }
        let count = program.cost.total();
        quote!(const OPERATIONS: #private::Option<#private::usize> = #private::Option::Some(#count);)
    }

    /// `fn speeds` and `fn speed_equations`, where there are some.
    fn speeds(&self) -> (TokenStream, TokenStream) {
        let (program, count) = (&self.compiled.programs.speeds, self.compiled.model.speeds.len());
        if count == 0 {
            return (TokenStream::new(), TokenStream::new());
        }
        let (at_state, prologue, values, f64) =
            (self.at_state(), self.prologue(), local("values"), self.float());
        let part = |name: &str, range| {
            let program = Program { name: name.to_owned(), ..program.clone() };
            let Printed { functions, statements, results } = self.body(&[]).part(&program, range);
            let (name, write) = (function(name), self.write(&quote!(#values), &results));
            let method = quote! {
                #[inline]
                fn #name(#at_state, #values: &mut [#f64]) { #prologue #statements #write }
            };
            (functions, method)
        };
        let (f1, own) = part("speeds", 0..count);
        let (f2, equations) = part("speed_equations", count..program.results.len());
        (quote!(#f1 #f2), quote!(#own #equations))
    }

    /// `const ANGLE_SETS`, where coordinates turn something.
    fn angle_sets(&self) -> TokenStream {
        let private = &self.private;
        let sets = self.compiled.model.angle_sets.iter().map(|set| {
            let (angles, axes) = (set.angles.map(|i| i as usize), set.axes);
            quote!(#private::AngleSet { angles: [#(#angles),*], axes: [#(#axes),*] })
        });
        let sets: Vec<_> = sets.collect();
        if sets.is_empty() {
            return TokenStream::new();
        }
        quote!(const ANGLE_SETS: &'static [#private::AngleSet] = &[#(#sets),*];)
    }

    /// `fn momentum_rates`, where methods in canonical variables have a use for it.
    fn momentum_rates(&self) -> (TokenStream, TokenStream) {
        let Some(program) = &self.compiled.programs.momentum_rates else {
            return (TokenStream::new(), TokenStream::new());
        };
        let private = &self.private;
        self.method(
            program,
            "momentum_rates",
            &quote!(#private::Option<<Self as #private::Model>::Vector>),
            |r| {
                let rates = self.vector(r);
                quote!(#private::Option::Some(#rates))
            },
        )
    }

    /// `fn parameter`: the scalars by index, for what names them.
    fn parameter(&self) -> TokenStream {
        let (private, f64, index) = (&self.private, self.float(), local("index"));
        let usize = quote!(#private::usize);
        let arms = self.surface.parameters.iter().enumerate().map(|(i, place)| quote!(#i => self #place,));
        quote! {
            fn parameter(&self, #index: #usize) -> #private::Option<#f64> {
                #private::Option::Some(match #index {
                    #(#arms)*
                    _ => return #private::Option::None,
                })
            }
        }
    }

    /// `impl Parameters`: the scalars by index, to be changed; their derivatives where there is an
    /// `impl Linearize` to take them from.
    pub(super) fn parameters(&self) -> TokenStream {
        let (model, private, f64) = (&self.surface.target, &self.private, self.float());
        let (index, value, state, values) = (local("index"), local("value"), local("state"), local("values"));
        let (usize, bool) = (quote!(#private::usize), quote!(#private::bool));
        let arms =
            self.surface.parameters.iter().enumerate().map(|(i, place)| quote!(#i => self #place = #value,));
        let derivatives = self.compiled.programs.jacobians.is_ok().then(|| {
            quote! {
                #[inline]
                fn acceleration_by_parameters(
                    &self,
                    #state: &<Self as #private::Model>::State,
                    #values: &mut [#f64],
                ) -> #bool {
                    #private::acceleration_by_parameters(self, #state, #values)
                }
            }
        });
        quote! {
            impl #private::Parameters for #model {
                fn set_parameter(&mut self, #index: #usize, #value: #f64) -> #bool {
                    match #index {
                        #(#arms)*
                        _ => return false,
                    }
                    true
                }
                #derivatives
            }
        }
    }

    /// `fn acceleration_derivatives`, where there is an `impl Linearize` to take them from.
    fn derivatives(&self) -> TokenStream {
        if self.compiled.programs.jacobians.is_err() {
            return TokenStream::new();
        }
        let (private, f64) = (&self.private, self.float());
        let (state, by_q, by_u) = (local("state"), local("by_q"), local("by_u"));
        quote! {
            #[inline]
            fn acceleration_derivatives(
                &self,
                #state: &<Self as #private::Model>::State,
                #by_q: &mut [#f64],
                #by_u: &mut [#f64],
            ) -> #private::bool {
                #private::acceleration_derivatives(self, #state, #by_q, #by_u)
            }
        }
    }

    /// Sorts the pivots and finds which hoisted nodes are read at every state.
    pub(super) fn staged(&self) -> Staged {
        let (program, graph) = (&self.compiled.programs.accelerations, self.access.graph);
        let hoisted: BTreeSet<NodeId> = program.hoisted.iter().flat_map(defined).collect();
        let in_body: BTreeSet<NodeId> = program.body.iter().flat_map(defined).collect();
        let (mut fixed, mut moving) = (Vec::new(), Vec::new());
        // With constraints there are guards instead of pivots, checked at every state: see `constraints.rs`.
        let pivots = if self.constrained().is_some() { &[][..] } else { &self.compiled.equations.pivots };
        for pivot in pivots.iter().filter(|p| !self.is_number(p.pivot)) {
            let entry = (pivot.coordinate, pivot.pivot, pivot.diagonal);
            let computed_per_state = in_body.contains(&pivot.pivot) || in_body.contains(&pivot.diagonal);
            if self.is_constant(pivot) && !computed_per_state {
                fixed.push(entry)
            } else {
                moving.push(entry)
            }
        }
        let mut used: BTreeSet<NodeId> = program.body.iter().flat_map(|step| read(graph, step)).collect();
        let solved = if self.constrained().is_some() { program.results.len() } else { self.degrees() };
        used.extend(program.results.iter().take(solved));
        used.extend(moving.iter().flat_map(|(_, pivot, diagonal)| [*pivot, *diagonal]));
        let constants = program
            .constants
            .iter()
            .copied()
            .filter(|id| used.contains(id) && hoisted.contains(id))
            .collect();
        let mut staged = Staged { once: program.hoisted.clone(), constants, fixed, moving };
        if let Ok(Series { begin: Some(begin), .. }) = &self.compiled.programs.series {
            staged.join(begin);
        }
        if let Some((_, programs)) = self.constrained() {
            let released = programs.released.iter().flat_map(|r| [&r.accelerations, &r.correction]);
            programs.correction.iter().chain(released).for_each(|program| staged.join(program));
        }
        staged
    }

    /// `fn constants`.
    fn constants(&self, staged: &Staged) -> (TokenStream, TokenStream) {
        let program = &self.compiled.programs.accelerations;
        let mut wanted = staged.constants.clone();
        wanted.extend(staged.fixed.iter().flat_map(|(_, pivot, diagonal)| [*pivot, *diagonal]));
        let hoisted = Program { name: "constants".to_owned(), ..program.clone() };
        let body = Body { seldom: true, ..self.body(&[]) };
        let Printed { functions, statements, results } = body.print(&hoisted, &staged.once, &wanted);
        let (constants, fixed) = results.split_at(staged.constants.len());
        let pivots: Vec<_> = staged
            .fixed
            .iter()
            .zip(fixed.chunks(2))
            .map(|(p, v)| (p.0, v[0].clone(), v[1].clone()))
            .collect();
        let (check, private, model) = (self.check(&pivots), &self.private, local("model"));
        // Parts of a large program have one signature; nothing of the state is read here.
        let (t, q, u, w) = (local("t"), local("q"), local("u"), local("w"));
        let (n, m, f64) = (self.degrees(), self.surface.input_count(), self.float());
        let unsolved = self.unsolved(vec![quote!(#f64::NAN); self.switched()]);
        let inlining = self.inlining(staged.once.len());
        let method = quote! {
            #inlining
            fn constants(&self) -> #private::Result<Self::Constants, #private::SingularMassMatrix> {
                let #model = self;
                let (#t, #q, #u, #w) = (#f64::NAN, &[#f64::NAN; #n], &[#f64::NAN; #n], &[#f64::NAN; #m]);
                #unsolved
                #statements
                #check
                #private::Ok([#(#constants),*])
            }
        };
        (functions, method)
    }

    /// `fn accelerations_with`.
    fn accelerations(&self, staged: &Staged) -> (TokenStream, TokenStream) {
        if self.constrained().is_some() {
            return (TokenStream::new(), self.constrained_accelerations());
        }
        let program = &self.compiled.programs.accelerations;
        let Solved { functions, statements, check, vector, .. } = self.solved(staged, program, &[]);
        let private = &self.private;
        let (prologue, k, state) = (self.prologue(), local("k"), local("state"));
        let inlining = self.inlining(program.body.len());
        let method = quote! {
            #inlining
            fn accelerations_with(
                &self,
                #k: &Self::Constants,
                #state: &<Self as #private::Model>::State,
            ) -> #private::Result<<Self as #private::Model>::Vector, #private::SolveError> {
                #prologue #statements #check
                #private::Ok(#vector)
            }
        };
        (functions, method)
    }

    /// A staged program whose first results are q̈, with what is checked; and `more` results.
    pub(super) fn solved(&self, staged: &Staged, program: &Program, more: &[NodeId]) -> Solved {
        let mut wanted: Vec<NodeId> = program.results.iter().copied().take(self.degrees()).collect();
        wanted.extend(staged.moving.iter().flat_map(|(_, pivot, diagonal)| [*pivot, *diagonal]));
        wanted.extend(more);
        let Printed { functions, statements, results } =
            self.fusing(&staged.constants).print(program, &program.body, &wanted);
        let (accelerations, rest) = results.split_at(self.degrees());
        let (moving, more) = rest.split_at(2 * staged.moving.len());
        let pivots: Vec<_> = staged
            .moving
            .iter()
            .zip(moving.chunks(2))
            .map(|(p, v)| (p.0, v[0].clone(), v[1].clone()))
            .collect();
        let (check, vector) = (self.check(&pivots), self.vector(accelerations));
        Solved { functions, statements, check, vector, more: more.to_vec() }
    }

    /// A method that may fail for a singular M: the last results of its program are pivots, or guards where
    /// there are constraints.
    fn solving(
        &self,
        program: &Program,
        name: &str,
        result: &TokenStream,
        value: impl FnOnce(&[TokenStream]) -> TokenStream,
    ) -> (TokenStream, TokenStream) {
        let private = &self.private;
        let result = quote!(#private::Result<#result, #private::SolveError>);
        self.method(program, name, &result, |r| {
            let (checked, check) = match self.constrained() {
                Some((equations, _)) => self.guarded_derivatives(equations, r),
                None => (2 * self.compiled.equations.pivots.len(), self.check(&self.pivots(r))),
            };
            let value = value(&r[..r.len() - checked]);
            quote!(#check #private::Ok(#value))
        })
    }

    /// `impl Linearize`, unless the Jacobians would be too large: the report says so.
    pub(super) fn linearize(&self) -> TokenStream {
        let Ok(programs) = &self.compiled.programs.jacobians else { return TokenStream::new() };
        let (model, private) = (&self.surface.target, &self.private);
        let (n, m, p) = (self.degrees(), self.surface.input_count(), self.compiled.model.parameters.len());
        let (f64, jacobian) = (self.float(), quote!(#private::StateJacobian<Self>));
        let (f1, state) = self.solving(&programs.state, "state_jacobian", &jacobian, |r| {
            let (accelerations, by) = r.split_at(n);
            let (by_q, by_u) = by.split_at(n * n);
            let (a, by_q, by_u) = (self.vector(accelerations), self.matrix(by_q, n), self.matrix(by_u, n));
            quote!(#private::StateJacobian { accelerations: #a, by_q: #by_q, by_u: #by_u })
        });
        let (input, parameter) = (quote!(Self::InputJacobian), quote!(Self::ParameterJacobian));
        let (f2, input) = self.solving(&programs.inputs, "input_jacobian", &input, |r| self.matrix(r, m));
        let (f3, parameter) =
            self.solving(&programs.parameters, "parameter_jacobian", &parameter, |r| self.matrix(r, p));
        quote! {
            #f1 #f2 #f3
            impl #private::Linearize for #model {
                type InputJacobian = #private::SMatrix<#f64, #n, #m>;
                type ParameterJacobian = #private::SMatrix<#f64, #n, #p>;
                #state #input #parameter
            }
        }
    }

    /// `impl Outputs`.
    pub(super) fn outputs(&self) -> TokenStream {
        let (model, private) = (&self.surface.target, &self.private);
        let outputs = &self.compiled.equations.outputs;
        let names = self.named(outputs);
        let (functions, method) = self.results(&self.compiled.programs.outputs, "outputs", outputs);
        quote! {
            #functions
            impl #private::Outputs for #model {
                const OUTPUTS: &'static [#private::Quantity] = #names;
                #method
            }
        }
    }

    /// `impl Events`.
    pub(super) fn events(&self) -> TokenStream {
        let (model, private) = (&self.surface.target, &self.private);
        let events = &self.compiled.equations.events;
        let names = self.named(events);
        let (functions, method) = self.results(&self.compiled.programs.events, "events", events);
        quote! {
            #functions
            impl #private::Events for #model {
                const EVENTS: &'static [#private::Quantity] = #names;
                #method
            }
        }
    }

    /// `fn name(&self, state, values) -> Result<(), _>`; pivots follow the results where accelerations are
    /// used.
    fn results(&self, program: &Program, name: &str, named: &[Named]) -> (TokenStream, TokenStream) {
        let Printed { functions, statements, results } = self.print(program);
        let check =
            if results.len() > named.len() { self.check(&self.pivots(&results)) } else { TokenStream::new() };
        let (name, at_state, prologue, slice) =
            (function(name), self.at_state(), self.prologue(), local("values"));
        let (f64, private) = (self.float(), &self.private);
        let solution = self.solution(&program.results, true);
        let write = self.write(&quote!(#slice), &results[..named.len()]);
        let method = quote! {
            #[inline]
            fn #name(#at_state, #slice: &mut [#f64]) -> #private::Result<(), #private::SolveError> {
                #prologue #solution #statements #check #write
                #private::Ok(())
            }
        };
        (functions, method)
    }
}
