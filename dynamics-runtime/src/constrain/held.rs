//! Which constraints, and which rows, hold at a state.

use core::ops::Range;

use crate::model::{Constraint, ConstraintKind, Constraints, Modes};

fn constraint_holds(constraint: &Constraint, modes: Modes) -> bool {
    constraint.switched.is_none_or(|index| modes.holds(index))
}

/// The constraints that hold; the holonomic ones alone where `holonomic`.
pub(crate) fn active<M: Constraints>(modes: Modes, holonomic: bool) -> Active {
    Active { rest: M::CONSTRAINTS, modes, holonomic }
}

/// The rows of the constraints that hold; those of the holonomic ones alone where `holonomic`.
// Public for dynamics-analysis alone.
#[doc(hidden)]
pub fn active_rows<M: Constraints>(modes: Modes, holonomic: bool) -> ActiveRows {
    ActiveRows { constraints: active::<M>(modes, holonomic), rows: 0..0 }
}

/// See [`active`]. Of no model, so that it is compiled once; adapters of slices would be made again for every
/// model and place.
#[derive(Clone)]
pub(crate) struct Active {
    rest: &'static [Constraint],
    modes: Modes,
    holonomic: bool,
}

impl Iterator for Active {
    type Item = &'static Constraint;

    #[inline]
    fn next(&mut self) -> Option<&'static Constraint> {
        if self.rest.is_empty() { None } else { self.search() }
    }
}

impl Active {
    #[inline(never)]
    fn search(&mut self) -> Option<&'static Constraint> {
        while let [constraint, rest @ ..] = self.rest {
            self.rest = rest;
            let of_kind = !self.holonomic || constraint.kind == ConstraintKind::Holonomic;
            if of_kind && constraint_holds(constraint, self.modes) {
                return Some(constraint);
            }
        }
        None
    }
}

/// See [`active_rows`].
// Public for dynamics-analysis alone.
#[doc(hidden)]
#[derive(Clone)]
pub struct ActiveRows {
    constraints: Active,
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

/// Whether the constraint of a row holds.
pub(crate) fn holds<M: Constraints>(modes: Modes, row: usize) -> bool {
    if modes.all_hold() {
        return true;
    }
    // Constraints stand in the order of their rows.
    let after = M::CONSTRAINTS.partition_point(|c| c.first <= row);
    after.checked_sub(1).is_none_or(|index| constraint_holds(&M::CONSTRAINTS[index], modes))
}
