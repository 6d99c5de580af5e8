//! What the engine finds of constraints, in the user's words.

use dynamics_symbolic::check::constraints::{Combination, ConstraintFinding};
use dynamics_symbolic::graph::Origin;

use crate::messages::{self, Message};

/// A finding in words, and where it belongs.
pub(super) fn constraint(fault: &ConstraintFinding) -> (Message, Vec<Origin>) {
    use ConstraintFinding as Fault;
    let at = |origin: &Origin| vec![*origin];
    match fault {
        Fault::Contains { name, what, reason, origin } => {
            (messages::constraint_contains(name, what, reason), at(origin))
        }
        Fault::HolonomicWithVelocities { name, origin } => {
            (messages::constraint_with_velocities(name), at(origin))
        }
        Fault::NonholonomicWithoutVelocities { name, origin } => {
            (messages::constraint_without_velocities(name), at(origin))
        }
        Fault::NotLinear { name, origin } => (messages::constraint_not_linear(name), at(origin)),
        Fault::AlwaysZero { name, origin } => (messages::constraint_always_zero(name), at(origin)),
        Fault::WithoutCoordinate { name, origin } => {
            (messages::constraint_without_coordinate(name), at(origin))
        }
        Fault::Repeats { name, of, on_manifold: false, origin } => {
            (messages::constraint_repeats(name, combination(of)), at(origin))
        }
        Fault::Repeats { name, of, on_manifold: true, origin } => {
            (messages::constraint_repeats_where_held(name, combination(of)), at(origin))
        }
        Fault::Tangent { name, to, origin } => {
            (messages::constraint_tangent(name, combination(to)), at(origin))
        }
        Fault::Contradicts { name, with, origin } => {
            (messages::constraint_contradicts(name, combination(with)), at(origin))
        }
        Fault::Unsatisfiable { missed: rows, origin } => {
            (messages::constraint_unsatisfiable(missed(rows)), at(origin))
        }
        Fault::TooMany { rows, coordinates, name, origin } => {
            let coordinates = if *coordinates == 1 {
                "1 coordinate".to_owned()
            } else {
                format!("{coordinates} coordinates")
            };
            (messages::constraint_too_many(rows, coordinates, name), at(origin))
        }
        Fault::RedundantInVain { name, origin } => (messages::constraint_redundant_in_vain(name), at(origin)),
        Fault::Integrable { determined: true, names, origin, .. } if names.len() > 1 => {
            (messages::constraint_without_freedom(quoted(names)), at(origin))
        }
        Fault::Integrable { integrable, of, names, origin, .. } => {
            let which = match (integrable, of) {
                (1, 1) => "a nonholonomic constraint is".to_owned(),
                (n, all) if n == all => format!("all {n} nonholonomic rows are"),
                (1, all) => format!("1 of {all} nonholonomic rows is"),
                (n, all) => format!("{n} of {all} nonholonomic rows are"),
            };
            (messages::constraint_integrable(which, quoted(names)), at(origin))
        }
        Fault::IntegrableInVain { name, origin } => {
            (messages::constraint_integrable_in_vain(name), at(origin))
        }
        Fault::GradientVanishes { name, origin } => {
            (messages::constraint_gradient_vanishes(name), at(origin))
        }
        Fault::FreeWithoutInertia { direction, origins } => {
            (messages::constraint_leaves_without_inertia(direction), origins.clone())
        }
        other => (messages::finding(format!("{other:?}")), Vec::new()),
    }
}

/// Most rows that a message names. Of more it says how many.
const MOST_ROWS_NAMED: usize = 6;

/// Rows that cannot hold together.
fn missed(rows: &[(String, f64)]) -> String {
    let named = rows
        .iter()
        .take(MOST_ROWS_NAMED)
        .map(|(name, by)| format!("`{name}` is missed by {}", two_digits(*by)));
    let named = named.collect::<Vec<_>>().join(", ");
    match rows.len().saturating_sub(MOST_ROWS_NAMED) {
        0 => named,
        more => format!("{named}, and {more} more"),
    }
}

/// A distance to two digits, whatever its size.
fn two_digits(distance: f64) -> String {
    if (1e-3..1e4).contains(&distance) {
        let decimals = (1.0 - distance.log10().floor()).max(0.0) as usize;
        format!("{distance:.decimals$}")
    } else {
        format!("{distance:.1e}")
    }
}

fn combination(of: &Combination) -> String {
    match of {
        Combination::Constant(text) => format!("`{text}`"),
        Combination::Of(names) if names.len() == 1 => quoted(names),
        Combination::Of(names) => format!("a combination of {}", quoted(names)),
    }
}

fn quoted(names: &[String]) -> String {
    names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::two_digits;

    #[test]
    fn distances_have_two_digits_whatever_their_size() {
        for (distance, wanted) in [
            (0.2449, "0.24"),
            (0.0031, "0.0031"),
            (4.7e-6, "4.7e-6"),
            (3.21, "3.2"),
            (47.2, "47"),
            (1234.0, "1234"),
            (1.3e7, "1.3e7"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(two_digits(distance), wanted);
        }
    }
}
