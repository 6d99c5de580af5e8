//! The plan of an ensemble: what its results depend on, as lines of text. Files of another plan are refused,
//! with the lines that differ.

use std::fmt::Write;

/// The runs of blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Partition {
    /// All runs.
    pub(crate) runs: usize,
    /// The runs of a block; the last one may have fewer.
    pub(crate) block: usize,
}

impl Partition {
    pub(crate) fn blocks(self) -> usize {
        self.runs.div_ceil(self.block)
    }

    pub(crate) fn runs_of(self, block: usize) -> std::ops::Range<usize> {
        block * self.block..((block + 1) * self.block).min(self.runs)
    }
}

/// The lines of a plan with the number of runs and of runs in a block.
const RUNS: &str = "runs";
const BLOCK: &str = "runs of a block";
/// The line of what varies, and what the further lines of the inputs begin with.
const INPUTS: &str = "inputs";

/// Lines of a name and a text, in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Plan(Vec<(String, String)>);

/// A line that two plans do not share.
#[derive(Clone, PartialEq)]
pub struct PlanDifference {
    /// The parameter, option or property of the model: `parameter m1`, `option tolerance`, `equations`.
    pub name: String,
    /// Its text in the files; `None` where they do not have it.
    pub there: Option<String>,
    /// Its text here; `None` where it is not part of the plan here.
    pub here: Option<String>,
}

impl std::fmt::Display for PlanDifference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { name, there, here } = self;
        match (there, here) {
            (Some(there), Some(here)) => write!(f, "`{name}` is {there} there and {here} here"),
            (Some(there), None) => write!(f, "`{name}` is {there} there and not set here"),
            (None, Some(here)) => write!(f, "`{name}` is not set there and {here} here"),
            (None, None) => write!(f, "`{name}`"),
        }
    }
}

dynamics_runtime::sentence_for_debugging!(PlanDifference);

/// A text on one line. Escaped, it reads back as it was.
fn escaped(text: &str) -> String {
    text.replace('\\', "\\\\").replace('\n', "\\n").replace('\r', "\\r")
}

/// A name before ` = `, in a line that is no heading.
fn escaped_name(name: &str) -> String {
    escaped(name).replace('=', "\\=").replace('#', "\\#")
}

/// The text that was escaped.
fn unescaped(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut letters = text.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' => match letters.next() {
                Some('n') => plain.push('\n'),
                Some('r') => plain.push('\r'),
                other => plain.extend(other),
            },
            _ => plain.push(letter),
        }
    }
    plain
}

impl Plan {
    /// Adds a line.
    pub(crate) fn note(&mut self, name: impl Into<String>, text: impl Into<String>) {
        self.0.push((name.into(), text.into()));
    }

    /// Adds a line of the inputs. A generator names its lines itself; they are never taken for others.
    pub(crate) fn note_of_inputs(&mut self, name: &str, text: String) {
        self.note(if name == INPUTS { INPUTS.into() } else { format!("{INPUTS}: {name}") }, text);
    }

    /// The number on a line of the inputs.
    pub(crate) fn number_of_inputs(&self, name: &str) -> Option<usize> {
        self.number(&format!("{INPUTS}: {name}"))
    }

    /// Adds the lines of a partition.
    pub(crate) fn note_partition(&mut self, Partition { runs, block }: Partition) {
        self.note(RUNS, runs.to_string());
        self.note(BLOCK, block.to_string());
    }

    /// The partition, if there is one.
    pub(crate) fn partition(&self) -> Option<Partition> {
        let (runs, block) = (self.number(RUNS)?, self.number(BLOCK)?);
        (block > 0).then_some(Partition { runs, block })
    }

    /// The number on a line.
    pub(crate) fn number(&self, name: &str) -> Option<usize> {
        self.texts(name).next()?.parse().ok()
    }

    /// The texts of all lines with a name.
    fn texts<'p>(&'p self, name: &str) -> impl Iterator<Item = &'p str> {
        self.0.iter().filter(move |(known, _)| known == name).map(|(_, text)| text.as_str())
    }

    /// The lines: names and texts.
    pub(crate) fn lines(&self) -> &[(String, String)] {
        &self.0
    }

    /// The lines as text. Different plans have different texts.
    pub(crate) fn to_text(&self) -> String {
        let mut text = String::new();
        for (name, value) in &self.0 {
            let _ = writeln!(text, "{} = {}", escaped_name(name), escaped(value));
        }
        text
    }

    /// The plan of a text; lines that are none are left out.
    pub(crate) fn from_text(text: &str) -> Self {
        let line =
            |line: &str| line.split_once(" = ").map(|(name, value)| (unescaped(name), unescaped(value)));
        Self(text.lines().filter_map(line).collect())
    }

    /// A digest by which blocks name their plan.
    pub(crate) fn digest(&self) -> u64 {
        crate::hash::of_bytes(self.to_text().as_bytes())
    }

    /// What differs from the plan of files: nothing only if all lines are the same in the same order, on
    /// which the order of the runs depends.
    pub(crate) fn differences(&self, there: &Self) -> Vec<PlanDifference> {
        if self == there {
            return Vec::new();
        }
        let of = |name: &str, plan: &Self| {
            let texts: Vec<String> = plan.texts(name).map(escaped).collect();
            (!texts.is_empty()).then(|| texts.join(" and "))
        };
        let mut names: Vec<&str> = Vec::new();
        for (name, _) in self.0.iter().chain(&there.0) {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        names.retain(|name| !self.texts(name).eq(there.texts(name)));
        let found: Vec<PlanDifference> = names
            .into_iter()
            .map(|name| PlanDifference { name: name.into(), there: of(name, there), here: of(name, self) })
            .collect();
        if !found.is_empty() {
            return found;
        }
        // The same lines in another order.
        let first = (0..self.0.len()).find(|k| self.0[*k] != there.0[*k]).unwrap_or(0);
        let before =
            |plan: &Self, other: &Self| Some(format!("`{}` before `{}`", plan.0[first].0, other.0[first].0));
        let (here_first, there_first) = (before(self, there), before(there, self));
        vec![PlanDifference { name: "order".into(), there: there_first, here: here_first }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_read_back_and_differences_are_named() {
        let mut here = Plan::default();
        here.note("model", "DoublePendulum");
        here.note("parameter m1", "1.5");
        here.note("option until", "30\nand a line");
        let there = Plan::from_text("model = DoublePendulum\nparameter m1 = 2\noption max_step = 0.1\n");
        assert_eq!(Plan::from_text(&here.to_text()), here);
        let texts: Vec<String> = here.differences(&there).iter().map(ToString::to_string).collect();
        assert_eq!(
            texts,
            [
                "`parameter m1` is 2 there and 1.5 here",
                "`option until` is not set there and 30\\nand a line here",
                "`option max_step` is 0.1 there and not set here",
            ]
        );
        assert!(here.differences(&here).is_empty());
        assert_ne!(here.digest(), there.digest());
    }

    fn plan(lines: &[(&str, &str)]) -> Plan {
        Plan(lines.iter().map(|(name, text)| ((*name).into(), (*text).into())).collect())
    }

    /// Two plans are the same where their digests are: order and repeated lines count.
    #[test]
    fn order_and_repeated_lines_count() {
        let here = plan(&[("model", "A"), ("varies a", "1 2"), ("varies b", "3 4")]);
        let swapped = plan(&[("model", "A"), ("varies b", "3 4"), ("varies a", "1 2")]);
        let found = here.differences(&swapped);
        assert_eq!(
            found.iter().map(ToString::to_string).collect::<Vec<_>>(),
            ["`order` is `varies b` before `varies a` there and `varies a` before `varies b` here"]
        );
        let once = plan(&[("at top", "Rising")]);
        let twice = plan(&[("at top", "Rising"), ("at top", "Rising")]);
        assert_eq!(
            twice.differences(&once).iter().map(ToString::to_string).collect::<Vec<_>>(),
            ["`at top` is Rising there and Rising and Rising here"]
        );
        assert_ne!(once.digest(), twice.digest());
    }

    #[test]
    fn every_name_and_every_text_reads_back() {
        let parts =
            ["", "y = 0", "# of flips", " # x", "a\\", "\\n", "a\nb", "a\r", "E = T+V", " = ", "\\= b", "#"];
        for name in parts {
            for text in parts {
                let whole = plan(&[("before", "1"), (name, text), ("after", "2")]);
                assert_eq!(Plan::from_text(&whole.to_text()), whole, "{name:?} {text:?}");
            }
        }
    }

    /// Lines of a generator are not taken for those of the plan itself.
    #[test]
    fn lines_of_inputs_are_their_own() {
        let mut whole = Plan::default();
        whole.note_of_inputs("runs", "7".into());
        whole.note_of_inputs("inputs", "by halves".into());
        whole.note_partition(Partition { runs: 12, block: 4 });
        assert_eq!(whole.partition(), Some(Partition { runs: 12, block: 4 }));
        assert_eq!(whole.number_of_inputs("runs"), Some(7));
        assert!(whole.to_text().contains("inputs = by halves"));
    }
}
