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

/// Lines of a name and a text, each name once.
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

impl Plan {
    /// Adds a line.
    pub(crate) fn note(&mut self, name: impl Into<String>, text: impl Into<String>) {
        let one_line = |text: String| text.replace(['\n', '\r'], " ");
        self.0.push((one_line(name.into()), one_line(text.into())));
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

    /// The text of a line.
    pub(crate) fn get(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, text)| text.as_str())
    }

    /// The number on a line.
    pub(crate) fn number(&self, name: &str) -> Option<usize> {
        self.get(name)?.parse().ok()
    }

    /// The lines: names and texts.
    pub(crate) fn lines(&self) -> &[(String, String)] {
        &self.0
    }

    /// The lines as text.
    pub(crate) fn to_text(&self) -> String {
        let mut text = String::new();
        for (name, value) in &self.0 {
            let _ = writeln!(text, "{name} = {value}");
        }
        text
    }

    /// The plan of a text; lines that are none are left out.
    pub(crate) fn from_text(text: &str) -> Self {
        let line = |line: &str| line.split_once(" = ").map(|(name, value)| (name.into(), value.into()));
        Self(text.lines().filter_map(line).collect())
    }

    /// A digest by which blocks name their plan.
    pub(crate) fn digest(&self) -> u64 {
        crate::hash::of_bytes(self.to_text().as_bytes())
    }

    /// What differs from the plan of files.
    pub(crate) fn differences(&self, there: &Self) -> Vec<PlanDifference> {
        let of = |name: &str, plan: &Self| plan.get(name).map(str::to_owned);
        let names = self.0.iter().chain(there.0.iter().filter(|(name, _)| self.get(name).is_none()));
        names
            .filter(|(name, _)| self.get(name) != there.get(name))
            .map(|(name, _)| PlanDifference {
                name: name.clone(),
                there: of(name, there),
                here: of(name, self),
            })
            .collect()
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
                "`option until` is not set there and 30 and a line here",
                "`option max_step` is 0.1 there and not set here",
            ]
        );
        assert!(here.differences(&here).is_empty());
        assert_ne!(here.digest(), there.digest());
    }
}
