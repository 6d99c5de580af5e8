//! Sums over rounds: energies, block by block as in Rust.

use crate::graph::NodeId;

use super::{Axis, Element, Lines, Loops, Round, Rounds, ends};

impl Loops<'_> {
    /// T and V.
    pub(super) fn energies(&self, out: &mut Lines) {
        out.open("energies(p, f, t, q, u, w, out) {");
        out.line("const kinetic = sums[0].begin(), potential = sums[1].begin();");
        for element in self.elements {
            let parts = [(element.kinetic, "kinetic"), (element.potential, "potential")];
            let parts: Vec<(NodeId, &str)> =
                parts.iter().filter_map(|(node, name)| node.map(|node| (node, *name))).collect();
            if !parts.is_empty() {
                self.energies_of(out, element, &parts);
            }
        }
        out.line("out[0] = kinetic.total();");
        out.line("out[1] = potential.total();");
        out.close("},");
    }

    fn energies_of(&self, out: &mut Lines, element: &Element, parts: &[(NodeId, &str)]) {
        let roots: Vec<NodeId> = parts.iter().map(|(node, _)| *node).collect();
        let Round { before, body, values } = self.round(&roots, element.rounds != Rounds::Once);
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
