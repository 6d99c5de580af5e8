//! What is said about a table: its plan, its columns with their units, which runs failed.

use crate::plan::Plan;
use crate::rows::{EnsembleColumn, FailedRun};

/// The last part of a text, which is empty: without it the text was cut off.
const END: &str = "end";

/// The plan, the columns and the failures of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Description {
    pub(crate) plan: Plan,
    pub(crate) columns: Vec<EnsembleColumn>,
    pub(crate) runs: usize,
    pub(crate) failed: Vec<FailedRun>,
}

impl Description {
    /// How many columns are inputs.
    pub(crate) fn inputs(&self) -> usize {
        self.columns.iter().filter(|column| column.is_input).count()
    }

    /// Its parts but the failures, by name.
    pub(crate) fn parts(&self) -> [(&'static str, String); 3] {
        let mut columns = Plan::default();
        for column in &self.columns {
            let kind = if column.is_input { "input" } else { "kept" };
            columns.note(&*column.name, format!("{kind}, [{}]", column.unit));
        }
        let mut summary = Plan::default();
        summary.note("runs", self.runs.to_string());
        summary.note("failed", self.failed.len().to_string());
        [("plan", self.plan.to_text()), ("columns", columns.to_text()), ("summary", summary.to_text())]
    }

    /// Of such parts; those that are missing are empty.
    pub(crate) fn from_parts(parts: &[(String, String)]) -> Self {
        let part = |name: &str| {
            let text = parts.iter().find(|(known, _)| known == name);
            text.map_or_else(Plan::default, |(_, text)| Plan::from_text(text))
        };
        let column = |(name, text): &(String, String)| {
            let (kind, unit) = text.split_once(", [").unwrap_or((text, ""));
            let unit = unit.strip_suffix(']').unwrap_or(unit).to_owned();
            EnsembleColumn { name: name.clone(), unit, is_input: kind == "input" }
        };
        let failure = |(run, message): &(String, String)| {
            Some(FailedRun { run: run.parse().ok()?, message: message.clone() })
        };
        Self {
            plan: part("plan"),
            columns: part("columns").lines().iter().map(column).collect(),
            runs: part("summary").number("runs").unwrap_or(0),
            failed: part("failed").lines().iter().filter_map(failure).collect(),
        }
    }

    /// As text: its parts, then the failures, each with a line `# name` before it.
    pub(crate) fn to_text(&self) -> String {
        let mut failed = Plan::default();
        self.failed
            .iter()
            .for_each(|FailedRun { run, message }| failed.note(run.to_string(), message.clone()));
        let (failed, end) = (("failed", failed.to_text()), (END, String::new()));
        let parts = self.parts().into_iter().chain([failed, end]);
        parts.map(|(name, part)| format!("# {name}\n{part}")).collect()
    }

    /// Of such a text; `None` if it was cut off.
    pub(crate) fn from_text(text: &str) -> Option<Self> {
        // Other lines do not begin so: plans escape it.
        let text = text.strip_suffix(&format!("# {END}\n"))?;
        let parts =
            text.strip_prefix("# ").unwrap_or("").split("\n# ").filter_map(|part| part.split_once('\n'));
        let parts: Vec<(String, String)> = parts.map(|(name, part)| (name.into(), part.into())).collect();
        Some(Self::from_parts(&parts))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn descriptions_read_back() {
        let mut plan = Plan::default();
        plan.note("model", "A");
        plan.note("parameter m1", "1.5");
        let column = |name: &str, unit: &str, is_input| EnsembleColumn {
            name: name.into(),
            unit: unit.into(),
            is_input,
        };
        let names = ["m1", "flips = at", "E = T+V", "# of flips", "plan", "a \\ b", "two\nlines", "x, [y]"];
        let columns: Vec<EnsembleColumn> =
            names.iter().map(|name| column(name, "kg = x, [m]", *name == "m1")).collect();
        let failed = vec![FailedRun { run: 7, message: "stopped, at t = 3".into() }];
        let whole = Description { plan, columns, runs: 12, failed };
        assert_eq!(Description::from_text(&whole.to_text()), Some(whole.clone()));
        // Without failures the parts at the end are empty.
        let whole = Description { failed: Vec::new(), ..whole };
        assert_eq!(Description::from_text(&whole.to_text()), Some(whole.clone()));
    }

    #[test]
    fn texts_that_were_cut_off_are_none() {
        let text = Description { runs: 3, ..Description::default() }.to_text();
        for length in 0..text.len() {
            assert_eq!(Description::from_text(&text[..length]), None, "{length}");
        }
    }
}
