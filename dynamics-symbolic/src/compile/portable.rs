//! Which programs other languages get, and under which names.

use super::{Compiled, ConstraintPrograms, MOST_VARIATION_OPERATIONS, Programs, fitting};
use crate::graph::NodeId;
use crate::mechanics::{Model, directions};
use crate::schedule::Program;
use crate::text::{self, ForC, InC, InWgsl, PlainProgram, Portable};

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

impl Compiled {
    /// The accelerations in WGSL. They are printed on request, because few models need them.
    #[must_use]
    pub fn in_wgsl(&self) -> InWgsl {
        text::wgsl(&self.model, &self.equations, &self.programs.accelerations)
    }

    /// The programs in C99. They are printed on request, because few models need them.
    #[must_use]
    pub fn in_c(&self) -> InC {
        let Programs { accelerations, energy_function, constraints, .. } = &self.programs;
        let programs = &self.programs;
        let mut named = vec![
            (PlainProgram::Conserved, &programs.conserved),
            (PlainProgram::Powers, &programs.powers),
            (PlainProgram::Outputs, &programs.outputs),
            (PlainProgram::Events, &programs.events),
            (PlainProgram::Kinks, &programs.kinks.program),
        ];
        named.extend(constraints.iter().flat_map(|of| {
            [
                (PlainProgram::Residual, &of.residual),
                (PlainProgram::VelocityResidual, &of.velocity_residual),
                (PlainProgram::Terms, &of.terms),
            ]
        }));
        let energies =
            [Some(energy_function), programs.kinetic_energy.as_ref(), programs.potential_energy.as_ref()];
        let released = constraints.iter().flat_map(|of| &of.released);
        let energies: Vec<&Program> = energies.into_iter().flatten().collect();
        let mut model = self.model.clone();
        let directional = self.directional(&mut model, &energies);
        let printed = ForC {
            listing: &self.listing,
            accelerations,
            energies,
            named,
            directional: directional.as_ref(),
            kink_functions: &programs.kinks.functions,
            correction: constraints.as_ref().and_then(|of| of.correction.as_ref()),
            released: released.map(|of| (&of.accelerations, &of.correction)).collect(),
        };
        text::c(&model, &self.equations, &printed)
    }

    /// Rates of q̈, λ, energies, outputs, events and kinks along a direction, on a copy of the model whose
    /// graph gets them; `None` where they are too large, or ask smooth functions for more than these give.
    fn directional(&self, model: &mut Model, energies: &[&Program]) -> Option<Program> {
        let Programs { outputs, events, kinks, .. } = &self.programs;
        let values = [
            energies.iter().flat_map(|program| program.results.clone()).collect(),
            // Checks of pivots stand behind outputs and events.
            outputs.results[..self.equations.outputs.len()].to_vec(),
            events.results[..self.equations.events.len()].to_vec(),
            kinks.program.results.clone(),
        ];
        let values: Vec<NodeId> = values.concat();
        let all = directions(model, &self.equations, &values)?;
        fitting(&model.graph, "directional", &all, MOST_VARIATION_OPERATIONS)
    }
}
