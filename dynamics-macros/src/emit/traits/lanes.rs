//! Accelerations of several states side by side.

use dynamics_symbolic::graph::{Node, NodeId};
use dynamics_symbolic::mechanics::Solution;
use dynamics_symbolic::schedule::Step;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::local;
use super::super::program::{Access, Body};
use super::Emission;
use super::solves::Staged;
use super::unrolled::MOST_STEPS_TWICE;

impl Emission<'_> {
    /// `const HAS_LANES`, `fn accelerations_in_lanes` and what of the model it reads, where the accelerations
    /// are straight-line code without choices: these would have to be made lane by lane, as would calls of
    /// the user's functions.
    pub(super) fn accelerations_in_lanes(&self, staged: &Staged) -> TokenStream {
        let program = &self.compiled.programs.accelerations;
        let n = self.degrees();
        let guards = match self.constrained() {
            None => None,
            Some((equations, _)) => match &equations.solution {
                Solution::Unrolled(unrolled) => Some(&unrolled.guards),
                Solution::General(_) => return TokenStream::new(),
            },
        };
        if program.results.is_empty()
            || program.body.len() > MOST_STEPS_TWICE
            || self.switched() > 0
            || self.access.chooses()
        {
            return TokenStream::new();
        }
        let (accelerations, rest) = program.results.split_at(n);
        let checked: Vec<NodeId> = match guards {
            Some(guards) => rest[rest.len() - 2 * guards.len()..].to_vec(),
            None => staged.moving.iter().flat_map(|(_, pivot, diagonal)| [*pivot, *diagonal]).collect(),
        };
        let wanted = [accelerations, &checked].concat();
        let access = Access::of_lanes(self.surface, self.compiled);
        let body = Body { access: &access, ..self.fusing(&staged.constants) };
        let steps = body.steps_for(&program.body, &wanted);
        if steps.iter().any(|step| self.chooses_or_calls(step)) {
            return TokenStream::new();
        }
        let printed = body.print(program, &steps, &wanted);
        let (statements, functions) = (printed.statements, printed.functions);
        debug_assert!(functions.is_empty(), "what is short is not cut into functions");
        let (accelerations, values) = printed.results.split_at(n);
        let private = &self.private;
        let fails = match guards {
            Some(guards) => {
                let pairs =
                    guards.iter().zip(values.chunks(2)).filter(|(guard, _)| !self.is_number(guard.pivot));
                let tests = pairs.map(|(guard, pair)| {
                    let (pivot, scale, tolerance) = (&pair[0], &pair[1], guard.tolerance);
                    quote!(!#pivot.exceed(#tolerance, #scale))
                });
                quote!(false #(| #tests)*)
            }
            None => {
                let positive = self.compiled.equations.energies.is_some();
                let pairs = values.chunks(2).map(|pair| (&pair[0], &pair[1])).map(|(a, b)| quote!([#a, #b]));
                quote!(#private::singular_in_lanes::<#positive, _, _>(&[#(#pairs),*]))
            }
        };
        let check = (!values.is_empty()).then(|| quote!(if #fails { return false; }));
        let (model, k, state, w) = (local("model"), local("k"), local("state"), local("w"));
        let (t, q, u, a) = (local("t"), local("q"), local("u"), local("accelerations"));
        let (lanes, own, values, out) = (local("Lanes"), local("Values"), local("values"), local("out"));
        let read = access.lane_values();
        let count = read.len();
        quote! {
            const HAS_LANES: #private::bool = true;
            const LANE_VALUES: #private::usize = #count;
            fn lane_values(
                &self,
                #k: &Self::Constants,
                #state: &<Self as #private::Model>::State,
                #out: &mut [#private::f64],
            ) {
                let (#model, #w) = (self, &#state.inputs.data.0[0]);
                #out[..#count].copy_from_slice(&[#(#read),*]);
            }
            #[inline(always)]
            fn accelerations_in_lanes<#lanes: #private::Lanes, #own: #private::LaneValues<#lanes>>(
                &self,
                #k: &Self::Constants,
                #state: &<Self as #private::Model>::State,
                #values: &#own,
                #t: #lanes,
                [#q, #u]: [&#private::WideOf<Self, #lanes>; 2],
                #a: &mut #private::WideOf<Self, #lanes>,
            ) -> #private::bool {
                let (#model, #w) = (self, &#state.inputs.data.0[0]);
                if !#values.cover(#count) {
                    return false;
                }
                #statements
                #check
                *#a = [#(#accelerations),*];
                true
            }
        }
    }

    /// Whether a step makes a choice, or calls a function of the user's.
    fn chooses_or_calls(&self, step: &Step) -> bool {
        match step {
            Step::Node(id) => {
                matches!(self.access.graph.node(*id), Node::Select { .. } | Node::Smooth { .. })
            }
            Step::SinCos { .. } => false,
            Step::Smooth { .. } => true,
        }
    }
}
