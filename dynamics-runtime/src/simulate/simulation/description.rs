//! The options of a simulation as texts, by which plans of many runs are compared.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use crate::model::SimulationModel;
use crate::simulate::events::rules::Action;
use crate::simulate::simulation::{Output, Simulation};

impl<M: SimulationModel> Simulation<'_, M> {
    /// The options that were set, each with its value as a text. Numbers are the shortest that read back as
    /// the same value. Of closures only the names and directions of their events are known.
    // Public for dynamics-ensembles alone.
    #[doc(hidden)]
    #[must_use]
    pub fn described(&self) -> Vec<(String, String)> {
        // All options, so that none is forgotten.
        let Self {
            model: _,
            start: _,
            end,
            method,
            tolerances,
            fixed,
            first,
            most,
            max_steps,
            output,
            law,
            added_events,
            actions,
            contacts,
            sticking,
            formulation,
            drift_limit,
            consistent_output,
            estimates_error,
            cancel: _,
            cancel_when: _,
            #[cfg(feature = "progress")]
                progress: _,
        } = self;
        let mut found = Vec::new();
        let mut note = |name: &str, value: String| found.push((name.to_string(), value));
        let numbers = [("until", end), ("fixed_step", fixed), ("first_step", first), ("max_step", most)];
        for (name, value) in numbers {
            if let Some(value) = value {
                note(name, format!("{value:?}"));
            }
        }
        if let Some((tolerances, option)) = tolerances {
            note(option.name(), format!("{:?} {:?}", tolerances.absolute, tolerances.relative));
        }
        if let Some(method) = method {
            let own = method.option(!M::CONSTRAINTS.is_empty());
            let own = own.map_or(String::new(), |(name, value, ..)| format!(", {name} = {value:?}"));
            note("method", format!("{}{own}", method.method()));
        }
        note("max_steps", max_steps.to_string());
        match output {
            Output::Steps => {}
            Output::Times(times) => note("output_times", format!("{times:?}")),
            Output::Every(interval) => note("every", format!("{interval:?}")),
        }
        if law.is_some() {
            note("inputs", "a closure".into());
        }
        for event in added_events {
            note(&format!("event {}", event.name), "a closure".into());
        }
        for (name, direction, action) in actions {
            let what = if matches!(action, Action::Stop) { "stop" } else { "an action" };
            note(&format!("at {name}, {direction:?}"), what.into());
        }
        for (name, contact) in contacts {
            note(&format!("contact {name}"), format!("{contact:?}"));
        }
        for (name, breakaway) in sticking {
            note(&format!("stick_slip {name}"), breakaway.clone());
        }
        if let Some(formulation) = formulation {
            note("formulation", format!("{formulation:?}"));
        }
        note("drift_limit", format!("{drift_limit:?}"));
        for (name, is_set) in [("consistent_output", consistent_output), ("estimate_error", estimates_error)]
        {
            if *is_set {
                note(name, "yes".into());
            }
        }
        found
    }
}
