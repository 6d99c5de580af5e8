//! A long, seldom evaluated program as a table, which `dynamics_runtime::generated::table` reads. Compiling
//! code takes time in proportion to its operations; a table is one literal.
//!
//! Values are in one array: the arguments of the function, then its results. Operations of one kind whose
//! operands are known form a run. The next kind is the one of which most are ready. Products that one sum or
//! difference reads are computed with it, each rounded as if it were computed alone.

use std::collections::{BTreeMap, BTreeSet};

use dynamics_symbolic::graph::{Comparison, Node, NodeId};
use dynamics_symbolic::schedule::Step;
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::super::local;
use super::operand::binary_name;
use super::{Access, Body, Printed, defined, parsed, read};

/// One entry of a table.
struct Entry {
    /// The runtime's name of the operation.
    kind: String,
    operands: Vec<NodeId>,
    /// Its results; one of sine and cosine may be unused.
    values: Vec<Option<NodeId>>,
}

/// The table of a program.
struct Table<'a> {
    access: &'a Access<'a>,
    /// Where every value stands.
    places: BTreeMap<NodeId, u16>,
    /// Places that are taken.
    total: u16,
    /// How what is given is written, in the order of its places.
    given: Vec<String>,
    /// Operations by their names, in the order in which they are met first.
    operations: Vec<String>,
    /// For each run: operation, number of entries, operands.
    code: Vec<u16>,
}

impl Body<'_> {
    /// The steps as a table; `None` where some of them have no place there: functions that are given by
    /// values, choices that a state holds, and programs with more values than 16 bits count.
    pub(super) fn tabulate(&self, steps: &[Step], results: &[NodeId]) -> Option<Printed> {
        let entries = steps.iter().map(|step| entry(self.access, step)).collect::<Option<Vec<_>>>()?;
        let entries = with_products(entries, results);
        let (places, given, operations, code) = (BTreeMap::new(), Vec::new(), Vec::new(), Vec::new());
        let mut table = Table { access: self.access, places, total: 0, given, operations, code };
        table.give(&entries, self.constants)?;
        table.runs(&entries)?;
        let (known, total) = (table.given.len(), usize::from(table.total));
        let (private, x, given) = (&self.access.private, local("x"), parsed(&table.given.join(",")));
        let operations = table.operations.iter().map(|name| format_ident!("{name}"));
        let code: Vec<u8> = table.code.iter().flat_map(|number| number.to_le_bytes()).collect();
        let code = Literal::byte_string(&code);
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
    fn give(&mut self, entries: &[Entry], constants: &[NodeId]) -> Option<()> {
        let computed: BTreeSet<NodeId> =
            entries.iter().flat_map(|entry| &entry.values).flatten().copied().collect();
        let constants: BTreeMap<NodeId, usize> =
            constants.iter().enumerate().map(|(i, id)| (*id, i)).collect();
        for id in entries.iter().flat_map(|entry| &entry.operands) {
            if !computed.contains(id) && !self.places.contains_key(id) {
                let constant = constants.get(id).map(|i| format!("__k[{i}]"));
                self.given.push(constant.unwrap_or_else(|| self.access.leaf(*id)));
                self.place(Some(*id))?;
            }
        }
        Some(())
    }

    /// The next place.
    fn place(&mut self, id: Option<NodeId>) -> Option<()> {
        if let Some(id) = id {
            self.places.insert(id, self.total);
        }
        self.total = self.total.checked_add(1)?;
        Some(())
    }

    /// How a result is read afterwards.
    fn result(&self, id: NodeId) -> TokenStream {
        match self.places.get(&id).copied().map(usize::from) {
            Some(place) if place >= self.given.len() => {
                let (x, place) = (local("x"), Literal::usize_unsuffixed(place));
                quote!(#x[#place])
            }
            Some(place) => parsed(&self.given[place]),
            None => parsed(&self.access.leaf(id)),
        }
    }

    /// Runs until all is computed.
    fn runs(&mut self, entries: &[Entry]) -> Option<()> {
        let values = |(i, entry): (usize, &Entry)| {
            entry.values.iter().flatten().map(move |id| (*id, i)).collect::<Vec<_>>()
        };
        let maker: BTreeMap<NodeId, usize> = entries.iter().enumerate().flat_map(values).collect();
        let (mut missing, mut readers) = (vec![0usize; entries.len()], vec![Vec::new(); entries.len()]);
        for (i, entry) in entries.iter().enumerate() {
            let makers: BTreeSet<usize> =
                entry.operands.iter().filter_map(|id| maker.get(id)).copied().collect();
            missing[i] = makers.len();
            makers.into_iter().for_each(|maker| readers[maker].push(i));
        }
        let mut ready: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for i in (0..entries.len()).filter(|i| missing[*i] == 0) {
            ready.entry(&entries[i].kind).or_default().push(i);
        }
        while let Some(kind) = ready.iter().max_by_key(|(_, waiting)| waiting.len()).map(|(kind, _)| *kind) {
            let run = ready.remove(kind).unwrap_or_default();
            self.run(kind, run.iter().map(|i| &entries[*i]))?;
            for reader in run.iter().flat_map(|i| &readers[*i]) {
                missing[*reader] -= 1;
                if missing[*reader] == 0 {
                    ready.entry(&entries[*reader].kind).or_default().push(*reader);
                }
            }
        }
        Some(())
    }

    fn run<'e>(&mut self, kind: &str, entries: impl ExactSizeIterator<Item = &'e Entry>) -> Option<()> {
        let known = self.operations.iter().position(|name| name == kind);
        let operation = known.unwrap_or_else(|| {
            self.operations.push(kind.to_owned());
            self.operations.len() - 1
        });
        self.code.extend([u16::try_from(operation).ok()?, u16::try_from(entries.len()).ok()?]);
        for entry in entries {
            self.code.extend(entry.operands.iter().map(|operand| self.places[operand]));
            entry.values.iter().try_for_each(|id| self.place(*id))?;
        }
        Some(())
    }
}

/// A step by itself.
fn entry(access: &Access<'_>, step: &Step) -> Option<Entry> {
    let operands = read(access.graph, step);
    let values = match step {
        Step::SinCos { sin, cos, .. } => vec![*sin, *cos],
        _ => defined(step).into_iter().map(Some).collect(),
    };
    Some(Entry { kind: kind(access, step)?, operands, values })
}

/// The runtime's name of a step's operation.
fn kind(access: &Access<'_>, step: &Step) -> Option<String> {
    let id = match step {
        Step::SinCos { .. } if access.accurate => return Some("SinCosAccurate".to_owned()),
        Step::SinCos { .. } => return Some("SinCos".to_owned()),
        Step::Smooth { .. } => return None,
        Step::Node(id) => *id,
    };
    if access.branches.is_some_and(|branches| branches.contains_key(&id)) {
        return None;
    }
    let name = match access.graph.node(id) {
        Node::Number(_) | Node::Symbol(_) | Node::Smooth { .. } => return None,
        Node::Add(..) => "Add",
        Node::Sub(..) => "Sub",
        Node::Mul(..) => "Mul",
        Node::Div(..) => "Div",
        Node::Neg(_) => "Neg",
        Node::Unary(function, _) => function.name(),
        Node::Binary(function, ..) => binary_name(function),
        Node::Select { comparison: Comparison::Less, .. } => "Less",
        Node::Select { comparison: Comparison::LessEqual, .. } => "LessEqual",
        Node::Select { comparison: Comparison::Equal, .. } => "Equal",
    };
    Some(name[..1].to_uppercase() + &name[1..])
}

/// Joins products to the sum or difference that alone reads them.
fn with_products(mut entries: Vec<Entry>, results: &[NodeId]) -> Vec<Entry> {
    let mut reads: BTreeMap<NodeId, usize> = BTreeMap::new();
    for id in entries.iter().flat_map(|entry| &entry.operands).chain(results) {
        *reads.entry(*id).or_default() += 1;
    }
    let single =
        |entry: &&Entry| entry.kind == "Mul" && entry.values[0].is_some_and(|id| reads.get(&id) == Some(&1));
    let factors: BTreeMap<NodeId, Vec<NodeId>> = entries
        .iter()
        .filter(single)
        .filter_map(|entry| Some((entry.values[0]?, entry.operands.clone())))
        .collect();
    let mut joined = BTreeSet::new();
    for entry in entries.iter_mut().filter(|entry| matches!(entry.kind.as_str(), "Add" | "Sub")) {
        let (a, b) = (entry.operands[0], entry.operands[1]);
        let plus = entry.kind == "Add";
        let (kind, operands) = match (factors.get(&a), factors.get(&b)) {
            (Some(x), Some(y)) => (if plus { "AddProducts" } else { "SubProducts" }, [&x[..], y].concat()),
            (None, Some(y)) => (if plus { "AddProduct" } else { "SubProduct" }, [&[a], &y[..]].concat()),
            // Sums do not depend on the order of their terms.
            (Some(x), None) => (if plus { "AddProduct" } else { "ProductSub" }, [&[b], &x[..]].concat()),
            (None, None) => continue,
        };
        joined.extend([a, b].into_iter().filter(|id| factors.contains_key(id)));
        (entry.kind, entry.operands) = (kind.to_owned(), operands);
    }
    entries.retain(|entry| !entry.values.iter().flatten().any(|id| joined.contains(id)));
    entries
}
