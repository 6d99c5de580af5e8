//! Forces of all elements on all nodes, times a factor each.

use crate::graph::NodeId;

use super::super::derive::Gathering;
use super::super::gathering::{Given, buffers, gathered, is_cheap};
use super::super::model::Local;
use super::sums::lane;
use super::{
    Axis, Element, Lines, Loops, NodeIndex, PrintedRound, Range, Rounds, anchor, ends, factor, offset,
};

impl Loops<'_> {
    /// Elements whose forces come to the nodes in this way, with their numbers and ranges.
    fn elements_of(&self, way: Gathering) -> impl Iterator<Item = (usize, &Element, Range, Option<Range>)> {
        let all = self.elements.iter().enumerate();
        all.filter(move |(_, element)| element.gathering(self.family) == Some(way)).filter_map(
            |(e, element)| {
                let outer = element.rounds.range(Axis::First)?;
                Some((e, element, outer, element.rounds.range(Axis::Second)))
            },
        )
    }

    fn lines_of_nodes(&self) -> Vec<usize> {
        let all = self.family.fields.iter().enumerate();
        all.filter(|(_, field)| field.length.is_some() && field.columns.is_none()).map(|(k, _)| k).collect()
    }

    fn grids(&self) -> Vec<usize> {
        let all = self.family.fields.iter().enumerate();
        all.filter(|(_, field)| field.columns.is_some()).map(|(k, _)| k).collect()
    }

    fn given(&self, field: usize, way: Gathering) -> Vec<Given> {
        gathered(self.family, self.elements, field, way)
    }

    /// The buffers, and the nodes that all rounds cover.
    pub(super) fn declare_buffers(&self, out: &mut Lines) {
        for (e, element, range, _) in self.elements_of(Gathering::Line) {
            let [start, end] = ends(range);
            for k in 0..buffers(self.family, element).0.len() {
                out.line(&format!("const b{e}_{k} = room({end} - ({start}));"));
            }
        }
        let (mut firsts, mut lasts) = (vec!["0".to_owned()], vec!["top".to_owned()]);
        let mut tops = vec!["0".to_owned()];
        for field in self.lines_of_nodes() {
            tops.push(format!("l{field}"));
            lasts.push(format!("l{field}"));
            for Given { element, offsets: [k, _], .. } in self.given(field, Gathering::Line) {
                let Some(range) = self.elements[element].rounds.range(Axis::First) else { continue };
                let [start, end] = ends(range.shifted(k));
                firsts.push(start);
                lasts.push(end);
            }
        }
        tops.extend(self.elements_of(Gathering::Line).map(|(.., range, _)| anchor(range.end)));
        out.line(&format!("const top = Math.max({});", tops.join(", ")));
        out.line(&format!(
            "const first = Math.max({}), last = Math.min({});",
            firsts.join(", "),
            lasts.join(", ")
        ));
        let side = |letter: &str| {
            let all: Vec<String> = self.grids().iter().map(|k| format!("{letter}{k}")).collect();
            all.join(", ")
        };
        if !self.grids().is_empty() {
            out.line(&format!("const rows = Math.max({}), columns = Math.max({});", side("l"), side("c")));
        }
        for (e, element, ..) in self.elements_of(Gathering::Grid) {
            let Kept { rows, columns } = self.kept(element);
            let (high, wide) = (rows.1 - rows.0, columns.1 - columns.0);
            out.line(&format!("const w{e} = {};", offset("columns", wide)));
            for k in 0..buffers(self.family, element).0.len() {
                out.line(&format!("const b{e}_{k} = room({}*w{e});", factor(&offset("rows", high))));
            }
        }
    }

    fn kept(&self, element: &Element) -> Kept {
        let [rows, columns] = Axis::ALL.map(|axis| element.reach(self.family, axis).unwrap_or((0, 0)));
        Kept { rows, columns }
    }

    /// The forces.
    pub(super) fn forces(&self, out: &mut Lines) {
        out.open("forces(p, f, t, q, u, w, s, out) {");
        let cheap = is_cheap(self.family, self.elements, self.interior);
        for (e, element, range, _) in self.elements_of(Gathering::Line) {
            self.rounds_of_line(out, e, element, range, cheap);
        }
        if cheap {
            self.nodes_by_themselves(out);
        }
        for field in self.lines_of_nodes() {
            self.gather_line(out, field, cheap);
        }
        for (k, field) in self.family.fields.iter().enumerate() {
            if field.length.is_none() {
                out.line(&format!("out[o{k}] = 0;"));
            }
        }
        for (e, element, range, _) in self.elements_of(Gathering::Line) {
            self.sums_of_line(out, e, element, range);
        }
        for (e, element, outer, inner) in self.elements_of(Gathering::Grid) {
            if let Some(inner) = inner {
                self.rounds_of_grid(out, e, element, [outer, inner]);
            }
        }
        for field in self.grids() {
            self.gather_grid(out, field);
        }
        for (_, element, ..) in self.elements_of(Gathering::Added) {
            self.added(out, element);
        }
        for element in self.elements.iter().filter(|element| element.rounds == Rounds::Once) {
            self.once(out, element);
        }
        out.close("},");
    }

    /// The rounds of an element of one loop, into buffers. Where nodes make them anew, only those are made
    /// that reach the ends.
    fn rounds_of_line(&self, out: &mut Lines, e: usize, element: &Element, range: Range, cheap: bool) {
        let (roots, _) = buffers(self.family, element);
        let PrintedRound { before, body, values } = self.round(&roots, true);
        let [start, end] = ends(range);
        out.open("{");
        out.lines(&before);
        if cheap {
            let (below, above) = element.reach(self.family, Axis::First).unwrap_or((0, 0));
            let (stop, again) = (offset("first", -below), offset("last", -above));
            out.line(&format!("for (const [low, high] of outside({start}, {end}, {stop}, {again}))"));
            out.open("for (let i = low; i < high; i++) {");
        } else {
            out.open(&format!("for (let i = {start}; i < {end}; i++) {{"));
        }
        out.lines(&body);
        for (k, value) in values.iter().enumerate() {
            out.line(&format!("b{e}_{k}[{}] = {value};", from("i", 0, &start)));
        }
        out.close("}");
        out.close("}");
    }

    /// Nodes far from all ends, each by itself.
    fn nodes_by_themselves(&self, out: &mut Lines) {
        let roots: Vec<NodeId> = self.interior.iter().flatten().copied().collect();
        let PrintedRound { before, body, values } = self.round(&roots, false);
        out.open("{");
        out.lines(&before);
        out.open("for (let i = first; i < last; i++) {");
        out.lines(&body);
        for (field, value) in self.lines_of_nodes().into_iter().zip(&values) {
            out.line(&format!("out[o{field} + i] = ({value}) * s[o{field} + i];"));
        }
        out.close("}");
        out.close("}");
    }

    /// The nodes of a field with one index.
    fn gather_line(&self, out: &mut Lines, field: usize, cheap: bool) {
        let given = self.given(field, Gathering::Line);
        let place = |given: &Given| {
            let start = self.elements[given.element].rounds.range(Axis::First).map(ends).unwrap_or_default();
            format!("b{}_{}[{}]", given.element, given.buffer, from("i", -given.offsets[0], &start[0]))
        };
        if !cheap {
            let sum = sum_of(&given, &place);
            out.open("for (let i = first; i < last; i++) {");
            out.line(&format!("out[o{field} + i] = {sum} * s[o{field} + i];"));
            out.close("}");
        }
        out.line(&format!("for (const [low, high] of outside(0, l{field}, first, last))"));
        out.open("for (let i = low; i < high; i++) {");
        out.line("let y = 0;");
        for given in &given {
            let Some(range) = self.elements[given.element].rounds.range(Axis::First) else { continue };
            let [start, end] = ends(range.shifted(given.offsets[0]));
            let sign = if given.opposite { '-' } else { '+' };
            out.line(&format!("if (i >= {start} && i < {end}) y {sign}= {};", place(given)));
        }
        out.line(&format!("out[o{field} + i] = y * s[o{field} + i];"));
        out.close("}");
    }

    /// What an element gives to a node that is the same in every round.
    fn sums_of_line(&self, out: &mut Lines, e: usize, element: &Element, range: Range) {
        let (_, used) = buffers(self.family, element);
        let [start, end] = ends(range);
        for ((a, _), (buffer, opposite)) in element.forces.iter().zip(used) {
            let local = self.family.locals[*a];
            if !matches!(local.index, NodeIndex::Fixed(_)) {
                continue;
            }
            let at = self.node(local);
            let nodes = "first, last, top";
            let sum = format!("sum_of_rounds(b{e}_{buffer}, {start}, {end}, {nodes}, {opposite})");
            out.line(&format!("out[{at}] += {sum} * s[{at}];"));
        }
    }

    /// The rounds of an element of two loops, into buffers with room for rounds that there are not: these are
    /// 0.
    fn rounds_of_grid(&self, out: &mut Lines, e: usize, element: &Element, [outer, inner]: [Range; 2]) {
        let (roots, _) = buffers(self.family, element);
        let PrintedRound { before, body, values } = self.round(&roots, true);
        let Kept { rows, columns } = self.kept(element);
        out.open("{");
        out.lines(&before);
        for (range, i) in [(outer, "i"), (inner, "j")] {
            let [start, end] = ends(range);
            out.open(&format!("for (let {i} = {start}; {i} < {end}; {i}++) {{"));
        }
        out.lines(&body);
        let at = format!("{}*w{e} + {}", factor(&offset("i", rows.1)), offset("j", columns.1));
        for (k, value) in values.iter().enumerate() {
            out.line(&format!("b{e}_{k}[{at}] = {value};"));
        }
        (0..3).for_each(|_| out.close("}"));
    }

    /// The nodes of a grid.
    fn gather_grid(&self, out: &mut Lines, field: usize) {
        let place = |given: &Given| {
            let Given { element: e, offsets: [row, column], buffer, .. } = given;
            let Kept { rows, columns } = self.kept(&self.elements[*e]);
            let (i, j) = (offset("i", rows.1 - row), offset("j", columns.1 - column));
            format!("b{e}_{buffer}[{}*w{e} + {j}]", factor(&i))
        };
        let sum = sum_of(&self.given(field, Gathering::Grid), &place);
        out.open(&format!("for (let i = 0; i < l{field}; i++) {{"));
        out.open(&format!("for (let j = 0; j < c{field}; j++) {{"));
        out.line(&format!("const at = o{field} + i*c{field} + j;"));
        out.line(&format!("out[at] = {sum} * s[at];"));
        out.close("}");
        out.close("}");
    }

    /// The forces of an element with rounds, every round of which adds to its nodes.
    fn added(&self, out: &mut Lines, element: &Element) {
        let (roots, used) = buffers(self.family, element);
        let PrintedRound { before, body, values } = self.round(&roots, true);
        let lane = lane(element.rounds);
        let is_same = |index: NodeIndex| !matches!(index, NodeIndex::Round(axis, _) if axis == lane);
        let same = |local: Local| is_same(local.index) && local.column.is_none_or(is_same);
        out.open("{");
        out.lines(&before);
        let all: Vec<(usize, Local, usize, bool)> = element
            .forces
            .iter()
            .zip(used)
            .enumerate()
            .map(|(s, ((a, _), (buffer, opposite)))| (s, self.family.locals[*a], buffer, opposite))
            .collect();
        // The same node in all rows, or one in every row.
        let whole = |local: Local| {
            let fixed = |index: NodeIndex| index.offset().is_none();
            same(local) && fixed(local.index) && local.column.is_none_or(fixed)
        };
        let totals = |out: &mut Lines, of_all: bool, begin: bool| {
            for (s, local, ..) in all.iter().filter(|(_, local, ..)| same(*local)) {
                if whole(*local) != of_all {
                    continue;
                }
                let at = self.node(*local);
                out.line(&match begin {
                    true => format!("const sum{s} = new BlockSum();"),
                    false => format!("out[{at}] += sum{s}.total() * s[{at}];"),
                });
            }
        };
        totals(out, true, true);
        if let Rounds::Nested(outer, _) = element.rounds {
            let [start, end] = ends(outer);
            out.open(&format!("for (let i = {start}; i < {end}; i++) {{"));
        }
        totals(out, false, true);
        let inner = element.rounds.range(lane).map(Rounds::Over).unwrap_or_default();
        self.block_of_edge(out, inner, lane, (&body, &values), &all, &same);
        totals(out, false, false);
        if matches!(element.rounds, Rounds::Nested(..)) {
            out.close("}");
        }
        totals(out, true, false);
        out.close("}");
    }

    /// The blocks along the innermost index, and what each adds.
    fn block_of_edge(
        &self,
        out: &mut Lines,
        inner: Rounds,
        lane: Axis,
        (body, values): (&Vec<String>, &[String]),
        all: &[(usize, Local, usize, bool)],
        same: &dyn Fn(Local) -> bool,
    ) {
        let [start, end] = inner.range(Axis::First).map(ends).unwrap_or_default();
        let i = lane.name();
        out.open(&format!("for (let low = {start}; low < {end}; low += EDGE) {{"));
        out.line(&format!("const count = Math.min(EDGE, {end} - low);"));
        for k in 0..values.len() {
            out.line(&format!("const e{k} = edge({k});"));
        }
        out.open("for (let k = 0; k < count; k++) {");
        out.line(&format!("const {i} = low + k;"));
        out.lines(body);
        for (k, value) in values.iter().enumerate() {
            out.line(&format!("e{k}[k] = {value};"));
        }
        out.close("}");
        for (s, local, buffer, opposite) in all {
            let (at, sign) = (self.node(*local), if *opposite { "-" } else { "" });
            if same(*local) {
                out.line(&format!("sum{s}.add({sign}block_sum(e{buffer}, 0, count));"));
                continue;
            }
            out.open("for (let k = 0; k < count; k++) {");
            out.line(&format!("const {i} = low + k, at = {at};"));
            out.line(&format!("out[at] += {sign}e{buffer}[k] * s[at];"));
            out.close("}");
        }
        out.close("}");
    }

    /// What has no rounds.
    fn once(&self, out: &mut Lines, element: &Element) {
        let roots: Vec<NodeId> = element.forces.iter().map(|(_, node)| *node).collect();
        let PrintedRound { before, body, values } = self.round(&roots, false);
        out.open("{");
        out.lines(before.iter().chain(&body));
        for ((a, _), value) in element.forces.iter().zip(&values) {
            let at = self.node(self.family.locals[*a]);
            out.line(&format!("out[{at}] += ({value}) * s[{at}];"));
        }
        out.close("}");
    }
}

/// How far the nodes of an element are from its round, along the rows and along the columns.
struct Kept {
    rows: (i64, i64),
    columns: (i64, i64),
}

/// What a node gathers.
fn sum_of(given: &[Given], place: &dyn Fn(&Given) -> String) -> String {
    let mut sum = String::new();
    for (k, given) in given.iter().enumerate() {
        match (k, given.opposite) {
            (0, false) => {}
            (0, true) => sum.push('-'),
            (_, false) => sum.push_str(" + "),
            (_, true) => sum.push_str(" - "),
        }
        sum.push_str(&place(given));
    }
    if sum.is_empty() { "0".to_owned() } else { format!("({sum})") }
}

/// `i + k - start` as an index of a buffer.
fn from(i: &str, k: i64, start: &str) -> String {
    match (offset(i, k), start.parse::<i64>()) {
        (_, Ok(number)) => offset(i, k - number),
        (text, Err(_)) => format!("{text} - {}", factor(start)),
    }
}
