//! The active set: which constraints, and which of their rows, hold at a state.
//!
//! Constraints that are declared `(switched)` hold or are released according to the active set of the state.
//! All others always hold.

use core::ops::Range;

use crate::model::{ActiveSet, Constraint, ConstraintKind, Constraints};

/// Whether a constraint is active.
fn constraint_holds(constraint: &Constraint, active_set: ActiveSet) -> bool {
    constraint.switched.is_none_or(|index| active_set.holds(index))
}

/// The active constraints; only the holonomic ones where `holonomic` is set.
pub(crate) fn active<M: Constraints>(active_set: ActiveSet, holonomic: bool) -> ActiveConstraints {
    ActiveConstraints { rest: M::CONSTRAINTS, active_set, holonomic }
}

/// The rows of the active constraints; only those of the holonomic ones where `holonomic` is set.
// Public for dynamics-analysis alone.
#[doc(hidden)]
pub fn active_rows<M: Constraints>(active_set: ActiveSet, holonomic: bool) -> ActiveRows {
    ActiveRows { constraints: active::<M>(active_set, holonomic), rows: 0..0 }
}

/// Iterator of [`active`]. It is not generic in the model, so that it is compiled once. Adapters of slices
/// would be instantiated for every model and call.
#[derive(Clone)]
pub(crate) struct ActiveConstraints {
    rest: &'static [Constraint],
    active_set: ActiveSet,
    holonomic: bool,
}

impl Iterator for ActiveConstraints {
    type Item = &'static Constraint;

    #[inline]
    fn next(&mut self) -> Option<&'static Constraint> {
        if self.rest.is_empty() { None } else { self.search() }
    }
}

impl ActiveConstraints {
    #[inline(never)]
    fn search(&mut self) -> Option<&'static Constraint> {
        while let [constraint, rest @ ..] = self.rest {
            self.rest = rest;
            let of_kind = !self.holonomic || constraint.kind == ConstraintKind::Holonomic;
            if of_kind && constraint_holds(constraint, self.active_set) {
                return Some(constraint);
            }
        }
        None
    }
}

/// Iterator of [`active_rows`].
// Public for dynamics-analysis alone.
#[doc(hidden)]
#[derive(Clone)]
pub struct ActiveRows {
    constraints: ActiveConstraints,
    rows: Range<usize>,
}

impl Iterator for ActiveRows {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        loop {
            if let Some(row) = self.rows.next() {
                return Some(row);
            }
            let constraint = self.constraints.next()?;
            self.rows = constraint.first..constraint.first + constraint.rows;
        }
    }
}

/// Whether the constraint of a row is active.
pub(crate) fn holds<M: Constraints>(active_set: ActiveSet, row: usize) -> bool {
    if active_set.all_hold() {
        return true;
    }
    // Constraints stand in the order of their rows.
    let after = M::CONSTRAINTS.partition_point(|c| c.first <= row);
    after.checked_sub(1).is_none_or(|index| constraint_holds(&M::CONSTRAINTS[index], active_set))
}
