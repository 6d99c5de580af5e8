//! The table of the method, printed as C from the library's own.

use dynamics_runtime::integrate::tables::{Embedded, SparseRow};

/// Entries of rows, each as `{ stage, weight }`.
fn entries<'a>(rows: impl IntoIterator<Item = &'a SparseRow>) -> String {
    let entry = |&(stage, weight): &(usize, f64)| format!("  {{ {stage}, {weight:?} }}");
    rows.into_iter().copied().flatten().map(entry).collect::<Vec<_>>().join(",\n")
}

/// What `c/fmu_steps.c` has of the method: keys and texts.
pub(crate) fn texts(table: &Embedded) -> Vec<(&'static str, String)> {
    let stages = table.rows.len();
    let mut begins = vec![0];
    for row in table.rows {
        begins.push(begins[begins.len() - 1] + row.len());
    }
    let begins: Vec<String> = begins.iter().map(usize::to_string).collect();
    let nodes: Vec<String> = table.nodes[..stages].iter().map(|node| format!("  {node:?}")).collect();
    let control = table.control;
    let alpha = 1.0 / f64::from(table.error_order + 1) - 0.75 * control.beta;
    let third = table.third_order.unwrap_or_default();
    vec![
        ("STAGES", stages.to_string()),
        ("NODES", nodes.join(",\n")),
        ("ROWS", entries(table.rows)),
        ("BEGINS", begins.join(", ")),
        ("REUSES", u8::from(table.first_same_as_last).to_string()),
        ("RESULTS", table.weights.len().to_string()),
        ("RESULT", entries([&table.weights])),
        ("ERRORS", table.error.len().to_string()),
        ("ERROR", entries([&table.error])),
        ("THIRDS", third.len().to_string()),
        ("THIRD", entries([&third])),
        ("SAFETY", format!("{:?}", control.safety)),
        ("BETA", format!("{:?}", control.beta)),
        ("ALPHA", format!("{alpha:?}")),
        ("SHRINK", format!("{:?}", control.shrink)),
        ("GROW", format!("{:?}", control.grow)),
    ]
}
