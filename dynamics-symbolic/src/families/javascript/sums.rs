//! Sums over rounds: energies and powers, block by block as in Rust.

use crate::graph::NodeId;

use super::{Axis, Element, Lines, Loops, PrintedRound, Rounds, ends};

/// A value of an element that is summed, and the name of the sum.
type Summand = (Option<NodeId>, &'static str);

impl Loops<'_> {
    /// T and V, and the power of forces and of dissipation.
    pub(super) fn energies(&self, out: &mut Lines) {
        self.sums(out, "energies", &|element| {
            vec![(element.kinetic, "kinetic"), (element.potential, "potential")]
        });
        self.sums(out, "powers", &|element| vec![(element.power, "power")]);
    }

    fn sums(&self, out: &mut Lines, name: &str, parts: &dyn Fn(&Element) -> Vec<Summand>) {
        out.open(&format!("{name}(p, f, t, q, u, w, out) {{"));
        let names: Vec<&str> = parts(&Element::default()).into_iter().map(|(_, name)| name).collect();
        for (k, name) in names.iter().enumerate() {
            out.line(&format!("const {name} = sums[{k}].begin();"));
        }
        for element in self.elements {
            let parts = parts(element).into_iter().filter_map(|(node, name)| Some((node?, name)));
            let parts: Vec<(NodeId, &str)> = parts.collect();
            if !parts.is_empty() {
                self.energies_of(out, element, &parts);
            }
        }
        for (k, name) in names.iter().enumerate() {
            out.line(&format!("out[{k}] = {name}.total();"));
        }
        out.close("},");
    }

    fn energies_of(&self, out: &mut Lines, element: &Element, parts: &[(NodeId, &str)]) {
        let roots: Vec<NodeId> = parts.iter().map(|(node, _)| *node).collect();
        let PrintedRound { before, body, values } = self.round(&roots, element.rounds != Rounds::Once);
        out.open("{");
        out.lines(&before);
        if element.rounds == Rounds::Once {
            out.lines(&body);
            for ((_, name), value) in parts.iter().zip(&values) {
                out.line(&format!("{name}.add({value});"));
            }
            return out.close("}");
        }
        let open = self.open_blocks(out, element.rounds, "BLOCK");
        out.lines(&body);
        for (k, value) in values.iter().enumerate() {
            out.line(&format!("blocks[{k}][k] = {value};"));
        }
        out.close("}");
        for (k, (_, name)) in parts.iter().enumerate() {
            out.line(&format!("{name}.add(block_sum(blocks[{k}], 0, count));"));
        }
        (0..open - 1).for_each(|_| out.close("}"));
        out.close("}");
    }

    /// Opens loops over the blocks of the innermost index, and over the rounds `k` of a block; returns how
    /// many blocks of text are open. `count` is the number of rounds.
    pub(super) fn open_blocks(&self, out: &mut Lines, rounds: Rounds, size: &str) -> usize {
        let mut open = 2;
        if let Rounds::Nested(outer, _) = rounds {
            let [start, end] = ends(outer);
            out.open(&format!("for (let i = {start}; i < {end}; i++) {{"));
            open += 1;
        }
        let axis = lane(rounds);
        let ([start, end], i) = (rounds.range(axis).map(ends).unwrap_or_default(), axis.name());
        out.open(&format!("for (let low = {start}; low < {end}; low += {size}) {{"));
        out.line(&format!("const count = Math.min({size}, {end} - low);"));
        out.open("for (let k = 0; k < count; k++) {");
        out.line(&format!("const {i} = low + k;"));
        open
    }
}

/// The innermost index of rounds.
pub(super) fn lane(rounds: Rounds) -> Axis {
    match rounds {
        Rounds::Nested(..) => Axis::Second,
        _ => Axis::First,
    }
}
