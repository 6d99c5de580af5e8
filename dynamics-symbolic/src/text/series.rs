//! What the texts say of Taylor series.

use crate::mechanics::Model;
use crate::schedule::Cost;
use crate::series::{Series, Unexpandable};

use super::listing::count;
use super::report::entry;

/// Why a model's motions have no Taylor series, in words: `its forces depend on reactions`.
#[must_use]
pub fn unexpandable(model: &Model, reason: Unexpandable) -> String {
    match reason {
        Unexpandable::Redundant => "its constraints repeat each other, so that λ is not unique".to_owned(),
        Unexpandable::Friction => "its forces depend on reactions".to_owned(),
        Unexpandable::Singular(_) => "its mass matrix is singular".to_owned(),
        Unexpandable::NoMassMatrix => "its mass matrix is left out".to_owned(),
        Unexpandable::TooLarge(operations) => format!("each coefficient takes {operations} operations"),
        Unexpandable::Smooth(function) => {
            let function = model.functions.get(function.0 as usize);
            let name = function.map_or("a function", |f| &f.name);
            format!("`{name}` is known by its value and three derivatives only")
        }
    }
}

/// The line of the report.
#[must_use]
pub fn series_entry(model: &Model, series: &Result<Series, Unexpandable>) -> String {
    let text = match series {
        Err(reason) => format!("none: {}", unexpandable(model, *reason)),
        Ok(series) => {
            let (start, each) =
                (series.begin.as_ref().unwrap_or(&series.start).cost.total(), series.operations());
            let ahead = match series.constrained.as_ref().map_or(0, |c| c.lanes) {
                0 => String::new(),
                lanes => format!(", {lanes} of them two orders ahead, for the constraints"),
            };
            let chooses = if series.chooses { "; of the branch at the start of a step" } else { "" };
            let lanes = series.all_lanes();
            let along = if series.begin.is_some() { ", with the accelerations" } else { "" };
            format!(
                "of any order: {start} operations to begin with{along}, {each} for each order, besides \
                 {lanes} Cauchy sums{ahead}{chooses}"
            )
        }
    };
    let mut out = String::new();
    entry(&mut out, "Taylor series", &text);
    out
}

/// The section of the listing.
#[must_use]
pub fn series_section(model: &Model, series: &Result<Series, Unexpandable>) -> String {
    let Ok(series) = series else {
        let reason = series.as_ref().err().map_or_else(String::new, |reason| unexpandable(model, *reason));
        return format!("\nseries: none, {reason}\n");
    };
    let sums = match series.all_lanes() {
        1 => "1 Cauchy sum".to_owned(),
        lanes => format!("{lanes} Cauchy sums"),
    };
    let mut out = format!("\nseries: {sums}\n");
    let mut line = |what: &str, cost: &Cost| out.push_str(&format!("  {what}: {}\n", count(cost)));
    match &series.begin {
        Some(begin) => line("to begin with, with the accelerations", &begin.cost),
        None => line("to begin with", &series.start.cost),
    }
    if let Some(c) = &series.constrained {
        line("constraints, two orders ahead", &c.ahead.cost);
        line("what they lack", &c.residue.cost);
        line("right-hand sides", &c.right.cost);
        if let Some(solve) = &c.solve {
            line("accelerations and multipliers", &solve.program.cost);
        }
    }
    line("for each order", &series.next.cost);
    out
}
