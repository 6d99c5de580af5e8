//! The impls of the runtime's model traits.

mod assumptions;
mod constraints;
mod evaluations;
mod identity;
mod lanes;
mod matrices;
mod portable;
mod series;
mod solves;
mod unrolled;

use dynamics_symbolic::compile::{Compiled, ConstraintPrograms};
use dynamics_symbolic::graph::{Dependence, Node, NodeId};
use dynamics_symbolic::mechanics::{ConstraintEquations, Pivot};
use dynamics_symbolic::schedule::Program;
use proc_macro2::TokenStream;
use quote::quote;

pub(super) use identity::{Names, named, quantities};

use super::program::{Access, Body, Printed};
use super::{Surface, at_block, local, only_one, quiet};

/// Most steps of a function that may be inlined. A longer one takes long to compile in every copy, and its
/// call takes less time than one evaluation differs from the next.
const MOST_INLINED: usize = 600;

/// Everything that a compiled model implements.
pub(crate) fn traits(surface: &Surface, compiled: &Compiled) -> TokenStream {
    let emission =
        Emission { surface, compiled, access: Access::new(surface, compiled), private: surface.private() };
    let texts = identity::texts(surface, compiled);
    let (dynamics, energies) = (emission.dynamics(), emission.energies());
    let (linearize, powers) = (emission.linearize(), emission.powers());
    let (outputs, events) = (emission.outputs(), emission.events());
    let (constraints, parameters) = (emission.constraints(), emission.parameters());
    let (portable, printed_in_c) = (emission.portable(), emission.printed_in_c());
    let printed_in_wgsl = emission.printed_in_wgsl();
    let (draw, only_one, quiet) = (identity::draw(surface), only_one(surface), quiet());
    let impls = quote! {
        #only_one
        #texts
        #quiet
        const _: () = {
            #dynamics
            #energies
            #linearize
            #parameters
            #constraints
            #powers
            #outputs
            #events
            #draw
            #portable
            #printed_in_c
            #printed_in_wgsl
        };
    };
    at_block(surface, impls)
}

/// What all impls of one model share.
struct Emission<'a> {
    surface: &'a Surface,
    compiled: &'a Compiled,
    access: Access<'a>,
    private: TokenStream,
}

impl Emission<'_> {
    fn degrees(&self) -> usize {
        self.surface.degrees()
    }

    /// What follows from the constraints, and their programs.
    fn constrained(&self) -> Option<(&ConstraintEquations, &ConstraintPrograms)> {
        self.compiled.equations.constraints.as_ref().zip(self.compiled.programs.constraints.as_ref())
    }

    /// Number of constraint rows.
    fn rows(&self) -> usize {
        self.constrained().map_or(0, |(equations, _)| equations.rows.len())
    }

    /// Number of switched constraints.
    fn switched(&self) -> usize {
        self.compiled.model.constraints.iter().filter(|c| c.switched).count()
    }

    fn body<'b>(&'b self, constants: &'b [NodeId]) -> Body<'b> {
        let constraints = self.constrained().map(|_| (self.rows(), self.switched()));
        Body {
            access: &self.access,
            surface: self.surface,
            constants,
            constraints,
            seldom: false,
            fuses: false,
        }
    }

    /// Of programs that runs ask for at every step.
    fn fusing<'b>(&'b self, constants: &'b [NodeId]) -> Body<'b> {
        Body { fuses: true, ..self.body(constants) }
    }

    fn print(&self, program: &Program) -> Printed {
        self.body(&[]).whole(program)
    }

    /// A program that runs do not ask for at every step.
    fn print_seldom(&self, program: &Program) -> Printed {
        Body { seldom: true, ..self.body(&[]) }.whole(program)
    }

    /// Of programs that read q̈ and λ and that runs do not ask for at every step. The functions of a large
    /// one take these in a model without constraints, too.
    fn solution_reader(&self) -> Body<'_> {
        let constraints = Some((self.rows(), self.switched()));
        Body {
            access: &self.access,
            surface: self.surface,
            constants: &[],
            constraints,
            seldom: true,
            fuses: false,
        }
    }

    /// Whether a function of so many steps may be inlined. Each part into which the compiler divides a
    /// program has a copy of what may; a long one makes programs slow to compile, and is called in less time
    /// than one evaluation differs from the next.
    fn inlining(&self, steps: usize) -> TokenStream {
        if steps > MOST_INLINED { quote!(#[inline(never)]) } else { quote!(#[inline]) }
    }

    /// Names the parts of the state and the model, as programs read them.
    fn prologue(&self) -> TokenStream {
        let (model, t, q, u, w) = (local("model"), local("t"), local("q"), local("u"), local("w"));
        let state = local("state");
        let modes = (0..self.switched()).map(|i| quote!(#state.active_set.side(#i)));
        let unsolved = self.unsolved(modes.collect());
        let branches = self.access.chooses().then(|| {
            let branches = local("branches");
            quote!(let #branches = #state.branches;)
        });
        quote! {
            let #model = self;
            let (#t, #q, #u, #w) =
                (#state.t, &#state.q.data.0[0], &#state.u.data.0[0], &#state.inputs.data.0[0]);
            #branches #unsolved
        }
    }

    /// The active set as given; accelerations and multipliers are not known.
    fn unsolved(&self, modes: Vec<TokenStream>) -> TokenStream {
        if self.constrained().is_none() {
            return TokenStream::new();
        }
        let (a, lambda, names, f64) = (local("a"), local("lambda"), local("modes"), self.float());
        let (n, r, switched) = (self.degrees(), self.rows(), self.switched());
        quote! {
            let (#a, #lambda) = (&[#f64::NAN; #n], &[#f64::NAN; #r]);
            let #names: &[#f64; #switched] = &[#(#modes),*];
        }
    }

    /// Whether some of these nodes need the solution of a model with constraints.
    fn needs_solution(&self, results: &[NodeId]) -> bool {
        let solution = Dependence::ACCELERATIONS.with(Dependence::MULTIPLIERS);
        self.constrained().is_some()
            && results.iter().any(|id| self.access.graph.dependence(*id).on(solution))
    }

    /// Accelerations and multipliers of a model with constraints, where a program reads them. In a function
    /// that cannot fail they are NaN where there is no solution.
    fn solution(&self, results: &[NodeId], fallible: bool) -> TokenStream {
        if !self.needs_solution(results) {
            return TokenStream::new();
        }
        let (private, state, solved) = (&self.private, local("state"), local("solved"));
        let solution = if fallible {
            quote!(#private::solve_once(self, &#private::Dynamics::constants(self)?, #state)?)
        } else {
            quote!(#private::solved_or_nan(self, #state))
        };
        let (a, lambda) = (local("a"), local("lambda"));
        quote! {
            let #solved = #solution;
            let (#a, #lambda) = (&#solved.accelerations.data.0[0], &#solved.multipliers.data.0[0]);
        }
    }

    /// `(&self, state: &Self::State)`.
    fn at_state(&self) -> TokenStream {
        let (private, state) = (&self.private, local("state"));
        quote!(&self, #state: &<Self as #private::Model>::State)
    }

    /// Refuses pivots that vanish against their diagonal elements, and negative ones of a kinetic energy:
    /// (coordinate, Dᵢ, Mᵢᵢ) as expressions.
    fn check(&self, pivots: &[(usize, TokenStream, TokenStream)]) -> TokenStream {
        if pivots.is_empty() {
            return TokenStream::new();
        }
        let private = &self.private;
        // A Lagrangian may be indefinite, a kinetic energy may not.
        let positive = self.compiled.equations.energies.is_some();
        let coordinates = pivots.iter().map(|(coordinate, ..)| coordinate);
        let values = pivots.iter().map(|(_, pivot, diagonal)| quote!([#pivot, #diagonal]));
        let at = local("pivots");
        quote! {
            let #at = [#(#values),*];
            if #private::singular::<#positive, _>(&#at) {
                return #private::Err(
                    #private::name_singular::<#positive>(
                        &#at, &[#(#coordinates),*], <Self as #private::Dynamics>::COORDINATES
                    ).into()
                );
            }
        }
    }

    /// The last results of a solving program as pivots to check; a pivot that is a number needs none.
    fn pivots(&self, results: &[TokenStream]) -> Vec<(usize, TokenStream, TokenStream)> {
        let pivots = &self.compiled.equations.pivots;
        let values = results[results.len() - 2 * pivots.len()..].chunks(2);
        pivots
            .iter()
            .zip(values)
            .filter(|(pivot, _)| !self.is_number(pivot.pivot))
            .map(|(pivot, value)| (pivot.coordinate, value[0].clone(), value[1].clone()))
            .collect()
    }

    fn is_number(&self, id: NodeId) -> bool {
        matches!(self.access.graph.node(id), Node::Number(_))
    }

    /// Whether the parameters alone decide a pivot.
    fn is_constant(&self, pivot: &Pivot) -> bool {
        self.access.graph.dependence(pivot.pivot).within(Dependence::PARAMETERS)
            && self.access.graph.dependence(pivot.diagonal).within(Dependence::PARAMETERS)
    }

    /// A list of `Quantity`.
    fn quantities<'b>(&self, named: impl Iterator<Item = (&'b str, &'b str)>) -> TokenStream {
        identity::quantities(&self.private, named)
    }
}
