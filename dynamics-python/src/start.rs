//! What `state(..)` is given, by name.

use dynamics::model::ActiveSet;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::data::{GivenState, StateData};
use crate::info::{Info, Part};
use crate::options;
use crate::state;

/// What `state(..)` was given.
pub(crate) fn given_state(
    info: &Info,
    t: f64,
    assemble: bool,
    release: Option<&Bound<'_, PyAny>>,
    values: Option<&Bound<'_, PyDict>>,
) -> PyResult<GivenState> {
    let (n, m) = (info.scalars.coordinates.len(), info.scalars.inputs.len());
    let (active_set, sided) = release.map_or(Ok((ActiveSet::ALL_HOLD, 0)), |names| released(info, names))?;
    let state = StateData { t, q: vec![0.0; n], u: vec![0.0; n], inputs: vec![f64::NAN; m], active_set };
    let (given_q, given_u) = (vec![false; n], vec![false; n]);
    let mut given = GivenState { state, given_q, given_u, speeds: None, assemble, sided };
    for (name, value) in values.into_iter().flat_map(|values| values.iter()) {
        let name: String = name.extract()?;
        let given_too = |name: &&str| values.is_some_and(|values| values.contains(name).unwrap_or(false));
        if info.find(&name).is_none()
            && let Some(guessed) = name.strip_suffix("_guess").filter(given_too)
        {
            return Err(PyTypeError::new_err(format!(
                "{name} is a guess for what is not given, and {guessed} is given: leave out one of them"
            )));
        }
        set_given(info, &mut given, &name, &value)?;
    }
    Ok(given)
}

/// Takes over one of them.
fn set_given(info: &Info, given: &mut GivenState, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    if let Some((part, slot)) = info.find(name) {
        let (into, flags) = match part {
            Part::Coordinates => (&mut given.state.q, Some(&mut given.given_q)),
            Part::Velocities => (&mut given.state.u, Some(&mut given.given_u)),
            Part::Inputs => (&mut given.state.inputs, None),
        };
        if let Some(flags) = flags {
            flags[slot.at..slot.at + slot.width()].fill(true);
        }
        return state::set(into, slot, value);
    }
    let guessed = name.strip_suffix("_guess").and_then(|name| info.find(name));
    if let Some((Part::Coordinates, slot)) = guessed {
        if !given.assemble {
            return Err(PyTypeError::new_err(format!("{name} is a guess for assemble=True")));
        }
        return state::set(&mut given.state.q, slot, value);
    }
    if let Some(slot) = info.speeds.iter().find(|slot| slot.name == name) {
        let count = info.speeds.iter().map(|slot| slot.width()).sum();
        return state::set(given.speeds.get_or_insert_with(|| vec![0.0; count]), slot, value);
    }
    Err(PyTypeError::new_err(format!(
        "a state of {} has no `{name}`; give t, assemble, release, {}",
        info.name,
        info.state_names()
    )))
}

/// The switched constraints that are released, and those whose side is given, by bits.
pub(crate) fn released(info: &Info, names: &Bound<'_, PyAny>) -> PyResult<(ActiveSet, u32)> {
    let entries: Vec<(String, Option<f64>)> = if let Ok(name) = names.extract::<String>() {
        vec![(name, None)]
    } else if let Some(sides) = options::entries(names) {
        sides
            .iter()
            .map(|(name, side)| Ok((name.extract()?, Some(side.extract()?))))
            .collect::<PyResult<_>>()?
    } else {
        let names: Vec<String> = names.extract().map_err(|_| {
            PyTypeError::new_err("release: give the name of a switched constraint, a list, or {name: side}")
        })?;
        names.into_iter().map(|name| (name, None)).collect()
    };
    let switched: Vec<&str> =
        info.constraints.iter().filter(|(_, switched)| *switched).map(|(name, _)| *name).collect();
    let (mut active_set, mut sided) = (ActiveSet::ALL_HOLD, 0);
    for (name, side) in entries {
        let Some(index) = switched.iter().position(|known| *known == name) else {
            let known = if switched.is_empty() { "none".to_owned() } else { switched.join(", ") };
            return Err(PyValueError::new_err(format!(
                "release: `{name}` is not a switched constraint of {}; these are {known}",
                info.name
            )));
        };
        active_set.release(index, side.unwrap_or(1.0));
        if side.is_some() {
            sided |= 1 << index;
        }
    }
    Ok((active_set, sided))
}
