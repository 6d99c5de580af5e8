//! A program as the body of a function, cut into several functions where it is large.

use std::collections::BTreeSet;
use std::ops::Range;

use dynamics_symbolic::graph::NodeId;
use dynamics_symbolic::schedule::{Program, Step};
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::super::{Surface, local};
use super::fused::Fused;
use super::{Access, MOST_UNSPLIT, OPERATIONS_OF_PART, Printer, all_steps, defined, read};

/// A printed program.
pub(in super::super) struct Printed {
    /// Functions that the body calls, to stand beside it.
    pub(in super::super) functions: TokenStream,
    /// Statements that compute the results.
    pub(in super::super) statements: TokenStream,
    /// The results in order, as expressions after the statements.
    pub(in super::super) results: Vec<TokenStream>,
}

/// What a function body can read, by these names: `model`, `t`, `q`, `u`, `w`, where the model has
/// constraints `a`, `lambda` and `modes`, where it chooses `branches`, and, where `staged`, the constants
/// `k`.
pub(in super::super) struct Body<'a> {
    /// Where values come from.
    pub(in super::super) access: &'a Access<'a>,
    /// The types in signatures.
    pub(in super::super) surface: &'a Surface,
    /// Constants computed before, in order; empty where nothing is staged.
    pub(in super::super) constants: &'a [NodeId],
    /// Rows of constraints and switched constraints; `None` without constraints.
    pub(in super::super) constraints: Option<(usize, usize)>,
    /// Whether few programs ask for it: what is long is a table.
    pub(in super::super) seldom: bool,
    /// Whether products may be fused with the sums that read them. They are in what runs ask for at every
    /// step. Elsewhere differences of equal products are exactly zero on every target.
    pub(in super::super) fuses: bool,
}

impl Body<'_> {
    /// Prints the steps that `results` need.
    pub(in super::super) fn print(&self, program: &Program, steps: &[Step], results: &[NodeId]) -> Printed {
        let wanted: BTreeSet<NodeId> = results.iter().copied().collect();
        let fused =
            if self.fuses { Fused::of(self.access.graph, program, steps, &wanted) } else { Fused::default() };
        let steps: Vec<Step> = steps.iter().copied().filter(|step| !fused.skips(step)).collect();
        let steps = &steps[..];
        if steps.len() <= MOST_UNSPLIT {
            let mut printer = self.printer();
            printer.fused = fused;
            let statements = printer.statements(steps, &wanted);
            let results = results.iter().map(|id| printer.result(*id)).collect();
            return Printed { functions: TokenStream::new(), statements, results };
        }
        let table = if self.seldom { self.tabulate(steps, results) } else { None };
        table.unwrap_or_else(|| self.print_parts(program, steps, results, &wanted, &fused))
    }

    /// A program without staging.
    pub(in super::super) fn whole(&self, program: &Program) -> Printed {
        self.print(program, &all_steps(program, false), &program.results)
    }

    /// What some of a program's results need, without staging.
    pub(in super::super) fn part(&self, program: &Program, results: Range<usize>) -> Printed {
        self.needed(program, &all_steps(program, false), &program.results[results])
    }

    /// Prints those of the steps that `results` need.
    pub(in super::super) fn needed(&self, program: &Program, steps: &[Step], results: &[NodeId]) -> Printed {
        self.print(program, &self.steps_for(steps, results), results)
    }

    /// Those of the steps that `results` need.
    pub(in super::super) fn steps_for(&self, steps: &[Step], results: &[NodeId]) -> Vec<Step> {
        let mut wanted: BTreeSet<NodeId> = results.iter().copied().collect();
        let mut needed: Vec<Step> = Vec::new();
        for step in steps.iter().rev() {
            if defined(step).iter().any(|id| wanted.contains(id)) {
                wanted.extend(read(self.access.graph, step));
                needed.push(*step);
            }
        }
        needed.reverse();
        needed
    }

    fn printer(&self) -> Printer<'_> {
        let mut printer = Printer::new(self.access);
        for (i, id) in self.constants.iter().enumerate() {
            printer.values.insert(*id, self.access.lane_value(format!("__k[{i}]")));
        }
        printer
    }

    /// Functions that write what later ones read into an array that all of them share.
    fn print_parts(
        &self,
        program: &Program,
        steps: &[Step],
        results: &[NodeId],
        wanted: &BTreeSet<NodeId>,
        fused: &Fused,
    ) -> Printed {
        let graph = self.access.graph;
        let parts: Vec<&[Step]> = steps.chunks(OPERATIONS_OF_PART).collect();
        let mut needed = wanted.clone();
        let mut needs = vec![BTreeSet::new(); parts.len()];
        for i in (0..parts.len()).rev() {
            needs[i] = needed.clone();
            needed.extend(parts[i].iter().flat_map(|step| fused.read(graph, step)));
        }
        let lasting: Vec<Vec<NodeId>> = parts
            .iter()
            .zip(&needs)
            .map(|(part, needed)| part.iter().flat_map(defined).filter(|id| needed.contains(id)).collect())
            .collect();
        let total = lasting.iter().map(Vec::len).sum();
        let signature = self.signature(total);
        let mut available: Vec<NodeId> = Vec::new();
        let (mut functions, mut statements) = (TokenStream::new(), TokenStream::new());
        let (model, t, q, u, w, k, x) =
            (local("model"), local("t"), local("q"), local("u"), local("w"), local("k"), local("x"));
        for (i, (part, lasting)) in parts.iter().zip(lasting).enumerate() {
            let mut printer = self.printer();
            printer.fused = fused.clone();
            place_array(&mut printer, &available);
            let body = printer.statements(part, &needs[i]);
            let writes = lasting.iter().enumerate().map(|(place, id)| {
                let (place, value) = (available.len() + place, printer.result(*id));
                quote!(#x[#place] = #value;)
            });
            let name = format_ident!("{}_part_{}", program.name, i + 1);
            functions.extend(quote! {
                #[inline(never)]
                fn #name #signature { #body #(#writes)* }
            });
            let (a, lambda, modes) = (local("a"), local("lambda"), local("modes"));
            let solved = self.constraints.map(|_| quote!(#a, #lambda, #modes,));
            let branches = local("branches");
            let branches = self.access.chooses().then(|| quote!(#branches,));
            statements.extend(quote!(#name(#model, #t, #q, #u, #w, #branches #solved #k, #x);));
            available.extend(lasting);
        }
        let mut printer = self.printer();
        place_array(&mut printer, &available);
        let results = results.iter().map(|id| printer.result(*id)).collect();
        let k = if self.constants.is_empty() { quote!(let #k = &[];) } else { TokenStream::new() };
        let room = quote!(let #x = &mut [0.0; #total];);
        Printed { functions, statements: quote!(#k #room #statements), results }
    }

    fn signature(&self, live: usize) -> TokenStream {
        let private = &self.access.private;
        let f64 = quote!(#private::f64);
        let (name, n, m) = (&self.surface.target, self.surface.degrees(), self.surface.input_count());
        let constants = self.constants.len();
        let (model, t, q, u, w, k, x) =
            (local("model"), local("t"), local("q"), local("u"), local("w"), local("k"), local("x"));
        let (a, lambda, modes) = (local("a"), local("lambda"), local("modes"));
        let solved = self.constraints.map(
            |(rows, switched)| quote!(#a: &[#f64; #n], #lambda: &[#f64; #rows], #modes: &[#f64; #switched],),
        );
        let branches = local("branches");
        let branches = self.access.chooses().then(|| quote!(#branches: #private::Branches,));
        quote! {
            (
                #model: &#name, #t: #f64, #q: &[#f64; #n], #u: &[#f64; #n], #w: &[#f64; #m],
                #branches #solved #k: &[#f64; #constants],
                #x: &mut [#f64; #live],
            )
        }
    }
}

/// Lets the printer find values in the array `x`.
fn place_array(printer: &mut Printer<'_>, live: &[NodeId]) {
    for (i, id) in live.iter().enumerate() {
        printer.values.insert(*id, format!("__x[{i}]"));
    }
}
