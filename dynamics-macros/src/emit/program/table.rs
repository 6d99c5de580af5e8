//! A long program that is seldom asked for as a table, which `dynamics_runtime::generated::table` reads: compiling code takes time in proportion to its
//! operations, a table is one literal.
//!
//! Values stand in one array: what the function is given, then what it computes. Operations of one kind whose operands are known stand together as
//! runs; next comes the kind of which most are ready.

use std::collections::{BTreeMap, BTreeSet};

use dynamics_symbolic::graph::{Comparison, Node, NodeId};
use dynamics_symbolic::schedule::Step;
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::super::local;
use super::operand::{binary_name, unary_name};
use super::{Access, Body, Printed, defined, parsed, read};

/// The table of a program.
struct Table<'a> {
    /// Where every value stands.
    places: BTreeMap<NodeId, u16>,
    /// Places that are taken.
    total: u16,
    /// How what is given is written, in the order of its places.
    given: Vec<String>,
    /// Operations by their names in the runtime, in the order in which they are met first.
    operations: Vec<String>,
    /// For each run: operation, number of entries, operands.
    code: Vec<u16>,
    access: &'a Access<'a>,
}

impl Body<'_> {
    /// The steps as a table; `None` where some of them have no place there: functions that are given by values, choices that a state holds, and
    /// programs with more values than 16 bits count.
    pub(super) fn tabulate(&self, steps: &[Step], results: &[NodeId]) -> Option<Printed> {
        let mut table = Table {
            places: BTreeMap::new(),
            total: 0,
            given: Vec::new(),
            operations: Vec::new(),
            code: Vec::new(),
            access: self.access,
        };
        table.give(steps, self.constants)?;
        table.runs(steps)?;
        let (known, total) = (table.given.len(), usize::from(table.total));
        let private = &self.access.private;
        let given = parsed(&table.given.join(","));
        let operations = table.operations.iter().map(|name| format_ident!("{name}"));
        let code: Vec<u8> = table.code.iter().flat_map(|number| number.to_le_bytes()).collect();
        let (code, x) = (Literal::byte_string(&code), local("x"));
        let statements = quote! {
            let #x = &mut [0.0; #total];
            #x[..#known].copy_from_slice(&[#given]);
            #private::table::evaluate(&[#(#private::table::Operation::#operations),*], #code, #known, #x);
        };
        let results = results.iter().map(|id| table.result(*id)).collect();
        Some(Printed { functions: TokenStream::new(), statements, results })
    }
}

impl Table<'_> {
    /// Places of what is read and not computed.
    fn give(&mut self, steps: &[Step], constants: &[NodeId]) -> Option<()> {
        let computed: BTreeSet<NodeId> = steps.iter().flat_map(defined).collect();
        let constants: BTreeMap<NodeId, usize> = constants.iter().enumerate().map(|(i, id)| (*id, i)).collect();
        for id in steps.iter().flat_map(|step| read(self.access.graph, step)) {
            if computed.contains(&id) || self.places.contains_key(&id) {
                continue;
            }
            let value = constants.get(&id).map_or_else(|| self.access.leaf(id), |i| format!("k[{i}]"));
            self.place(Some(id))?;
            self.given.push(value);
        }
        Some(())
    }

    /// The next place, for a value that nobody may want.
    fn place(&mut self, id: Option<NodeId>) -> Option<()> {
        if let Some(id) = id {
            self.places.insert(id, self.total);
        }
        self.total = self.total.checked_add(1)?;
        Some(())
    }

    /// How a result is read afterwards.
    fn result(&self, id: NodeId) -> TokenStream {
        match self.places.get(&id) {
            Some(place) if usize::from(*place) >= self.given.len() => {
                let (x, place) = (local("x"), Literal::u16_unsuffixed(*place));
                quote!(#x[#place])
            }
            Some(place) => parsed(&self.given[usize::from(*place)]),
            None => parsed(&self.access.leaf(id)),
        }
    }

    /// Runs of operations until all are done.
    fn runs(&mut self, steps: &[Step]) -> Option<()> {
        let kinds = steps.iter().map(|step| self.kind(step)).collect::<Option<Vec<_>>>()?;
        let maker: BTreeMap<NodeId, usize> =
            steps.iter().enumerate().flat_map(|(i, step)| defined(step).into_iter().map(move |id| (id, i))).collect();
        let mut missing = vec![0usize; steps.len()];
        let mut readers = vec![Vec::new(); steps.len()];
        for (i, step) in steps.iter().enumerate() {
            let operands: BTreeSet<usize> =
                read(self.access.graph, step).iter().filter_map(|id| maker.get(id)).copied().collect();
            missing[i] = operands.len();
            operands.into_iter().for_each(|operand| readers[operand].push(i));
        }
        let mut ready: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for i in (0..steps.len()).filter(|i| missing[*i] == 0) {
            ready.entry(&kinds[i]).or_default().push(i);
        }
        while let Some(kind) = ready.iter().max_by_key(|(_, waiting)| waiting.len()).map(|(kind, _)| *kind) {
            let run = ready.remove(kind).unwrap_or_default();
            self.run(kind, run.iter().map(|i| &steps[*i]))?;
            for reader in run.iter().flat_map(|i| &readers[*i]) {
                missing[*reader] -= 1;
                if missing[*reader] == 0 {
                    ready.entry(&kinds[*reader]).or_default().push(*reader);
                }
            }
        }
        Some(())
    }

    fn run<'s>(&mut self, kind: &str, steps: impl ExactSizeIterator<Item = &'s Step>) -> Option<()> {
        let known = self.operations.iter().position(|name| name == kind);
        let operation = known.unwrap_or_else(|| {
            self.operations.push(kind.to_owned());
            self.operations.len() - 1
        });
        self.code.extend([u16::try_from(operation).ok()?, u16::try_from(steps.len()).ok()?]);
        for step in steps {
            for operand in read(self.access.graph, step) {
                self.code.push(self.places[&operand]);
            }
            match step {
                Step::SinCos { sin, cos, .. } => [*sin, *cos].into_iter().try_for_each(|id| self.place(id))?,
                _ => defined(step).into_iter().try_for_each(|id| self.place(Some(id)))?,
            }
        }
        Some(())
    }

    /// The runtime's name of a step's operation.
    fn kind(&self, step: &Step) -> Option<String> {
        let id = match step {
            Step::SinCos { .. } if self.access.accurate => return Some("SinCosAccurate".to_owned()),
            Step::SinCos { .. } => return Some("SinCos".to_owned()),
            Step::Smooth { .. } => return None,
            Step::Node(id) => *id,
        };
        if self.access.branches.is_some_and(|branches| branches.contains_key(&id)) {
            return None;
        }
        Some(match self.access.graph.node(id) {
            Node::Number(_) | Node::Symbol(_) | Node::Smooth { .. } => return None,
            Node::Add(..) => "Add".to_owned(),
            Node::Sub(..) => "Sub".to_owned(),
            Node::Mul(..) => "Mul".to_owned(),
            Node::Div(..) => "Div".to_owned(),
            Node::Neg(_) => "Neg".to_owned(),
            Node::Unary(function, _) => capital(unary_name(function)),
            Node::Binary(function, ..) => capital(binary_name(function)),
            Node::Select { comparison: Comparison::Less, .. } => "Less".to_owned(),
            Node::Select { comparison: Comparison::LessEqual, .. } => "LessEqual".to_owned(),
            Node::Select { comparison: Comparison::Equal, .. } => "Equal".to_owned(),
        })
    }
}

/// The name of a function as that of an operation.
fn capital(name: &str) -> String {
    name[..1].to_uppercase() + &name[1..]
}
