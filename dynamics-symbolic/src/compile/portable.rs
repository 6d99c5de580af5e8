//! Which programs other languages get, and under which names.

use super::{ConstraintPrograms, Programs};
use crate::schedule::Program;
use crate::text::Portable;

/// All that move a model and show what it does; derivatives of the equations are not among them.
pub(super) fn portable(programs: &Programs) -> Portable<'_> {
    let mut named = vec![
        ("accelerations", &programs.accelerations),
        ("energy_function", &programs.energy_function),
        ("conserved", &programs.conserved),
        ("powers", &programs.powers),
        ("speeds", &programs.speeds),
        ("outputs", &programs.outputs),
        ("events", &programs.events),
        ("assumptions", &programs.assumptions),
        ("kinks", &programs.kinks.program),
    ];
    named.extend(programs.kinetic_energy.iter().map(|p| ("kinetic_energy", p)));
    named.extend(programs.potential_energy.iter().map(|p| ("potential_energy", p)));
    let constraints = programs.constraints.iter();
    named.extend(constraints.clone().flat_map(of_constraints));
    named.retain(|(_, program)| !program.results.is_empty());
    let released = constraints.flat_map(|c| &c.released).map(|r| (&r.accelerations, &r.correction));
    Portable { named, released: released.collect(), kink_functions: &programs.kinks.functions }
}

fn of_constraints(programs: &ConstraintPrograms) -> Vec<(&'static str, &Program)> {
    let mut named = vec![
        ("residual", &programs.residual),
        ("velocity_residual", &programs.velocity_residual),
        ("jacobian", &programs.jacobian),
        ("velocity_offset", &programs.velocity_offset),
        ("terms", &programs.terms),
    ];
    named.extend(programs.friction.iter().map(|p| ("friction", p)));
    named.extend(programs.correction.iter().map(|p| ("correction", p)));
    named
}
