//! What a page can hold, and what not: everything is refused here, before a file exists.

use dynamics_runtime::model::{ModelState, Portable, SimulationModel, Vector};

use crate::error::LiveError;
use crate::live::{Accuracy, Live};

/// Checks the model and all that was chosen for it.
pub(crate) fn check<M: SimulationModel + Portable>(live: &Live<'_, M>) -> Result<(), LiveError> {
    portable(live.model)?;
    finite(live)?;
    let names = Names::of::<M>();
    for (name, range) in &live.ranges {
        known("parameter or input", name, &names.adjustable)?;
        if !(range[0] < range[1] && range.iter().all(|end| end.is_finite())) {
            return Err(LiveError::Range { name: name.clone(), range: *range });
        }
    }
    live.held.iter().try_for_each(|name| known("parameter or input", name, &names.adjustable))?;
    live.plots.iter().try_for_each(|name| known("quantity", name, &names.plottable))?;
    live.phase.iter().try_for_each(|name| known("coordinate", name, &names.coordinates))?;
    live.contacts.iter().try_for_each(|(name, _)| known("switched constraint", name, &names.switched))?;
    for [constraint, event] in &live.stick_slips {
        known("switched constraint", constraint, &names.switched)?;
        known("event", event, &names.events)?;
    }
    live.stops.iter().try_for_each(|name| known("event", name, &names.events))?;
    options(live)
}

fn portable<M: SimulationModel + Portable>(model: &M) -> Result<(), LiveError> {
    if M::JAVASCRIPT.is_empty() {
        let reasons = M::NOT_PORTABLE.iter().map(|&reason| reason.to_owned()).collect();
        return Err(LiveError::NotPortable { model: M::NAME, reasons });
    }
    let missing = model.pieces().iter().position(Option::is_none);
    match missing {
        Some(index) => Err(LiveError::Function { name: M::FUNCTIONS[index].to_owned() }),
        None => Ok(()),
    }
}

/// States are finite where they were built; inputs that were not set are NaN and have sliders.
fn finite<M: SimulationModel + Portable>(live: &Live<'_, M>) -> Result<(), LiveError> {
    for (index, quantity) in M::PARAMETERS.iter().enumerate() {
        let value = live.model.parameter(index).unwrap_or(f64::NAN);
        if !value.is_finite() {
            return Err(LiveError::Parameter { name: quantity.name.to_owned(), value });
        }
    }
    for (_, state) in &live.starts {
        let numbers = state.q().as_slice().iter().chain(state.u().as_slice()).copied();
        if let Some(value) = numbers.chain([state.t()]).find(|x| !x.is_finite()) {
            return Err(LiveError::Option { option: "a number of the start", value, range: "finite" });
        }
    }
    Ok(())
}

fn options<M: SimulationModel + Portable>(live: &Live<'_, M>) -> Result<(), LiveError> {
    let refuse = |option, value, range| Err(LiveError::Option { option, value, range });
    match live.accuracy {
        Some(Accuracy::Tolerance(value)) if !(1e-14..=0.1).contains(&value) => {
            return refuse("the tolerance", value, "between 1e-14 and 0.1");
        }
        Some(Accuracy::Step(value)) if !(value > 0.0 && value.is_finite()) => {
            return refuse("the step", value, "a positive number");
        }
        _ => {}
    }
    if let Some(end) = live.until
        && !(end.is_finite() && live.starts.iter().all(|(_, start)| end > start.t()))
    {
        return refuse("the end of the motion", end, "a time after the start");
    }
    for (_, law) in &live.contacts {
        if !(0.0..=1.0).contains(&law.restitution) {
            return refuse("the coefficient of restitution", law.restitution, "between 0 and 1");
        }
    }
    Ok(())
}

fn known(what: &'static str, name: &str, known: &[String]) -> Result<(), LiveError> {
    if known.iter().any(|other| other == name) {
        return Ok(());
    }
    Err(LiveError::UnknownName { what, name: name.to_owned(), known: known.to_vec() })
}

/// Names of a model, as what a page asks for.
struct Names {
    coordinates: Vec<String>,
    adjustable: Vec<String>,
    plottable: Vec<String>,
    switched: Vec<String>,
    events: Vec<String>,
}

impl Names {
    fn of<M: SimulationModel + Portable>() -> Self {
        let names = |list: &[dynamics_runtime::model::Quantity]| {
            list.iter().map(|quantity| quantity.name.to_owned()).collect::<Vec<_>>()
        };
        let coordinates = names(M::COORDINATES);
        let rates = coordinates.iter().map(|name| format!("{name}_rate"));
        let plottable = coordinates.iter().cloned().chain(rates).chain(names(M::OUTPUTS));
        let switched = M::CONSTRAINTS.iter().filter(|c| c.switched.is_some()).map(|c| c.name.to_owned());
        Self {
            plottable: plottable.chain(["energy".to_owned()]).collect(),
            adjustable: names(M::PARAMETERS).into_iter().chain(names(M::INPUTS)).collect(),
            switched: switched.collect(),
            events: names(M::EVENTS),
            coordinates,
        }
    }
}
