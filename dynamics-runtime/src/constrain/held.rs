//! Which constraints, and which rows, hold at a state.

use crate::model::{Constraint, ConstraintKind, Constraints, Modes};

fn constraint_holds(constraint: &Constraint, modes: Modes) -> bool {
    constraint.switched.is_none_or(|index| modes.holds(index))
}

/// The constraints that hold; the holonomic ones alone where `holonomic`.
pub(crate) fn active<M: Constraints>(
    modes: Modes,
    holonomic: bool,
) -> impl Iterator<Item = &'static Constraint> + Clone {
    let of_kind = move |c: &&Constraint| !holonomic || c.kind == ConstraintKind::Holonomic;
    M::CONSTRAINTS.iter().filter(of_kind).filter(move |c| constraint_holds(c, modes))
}

/// The rows of [`active`].
pub(crate) fn active_rows<M: Constraints>(modes: Modes, holonomic: bool) -> impl Iterator<Item = usize> + Clone {
    active::<M>(modes, holonomic).flat_map(|c| c.first..c.first + c.rows)
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
