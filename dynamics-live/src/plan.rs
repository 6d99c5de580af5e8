//! What a page can hold, and what not: everything is refused here, before a file exists.

use dynamics_runtime::model::{Constraint, ModelState, Portable, Quantity, SimulationModel, Vector, names};
use dynamics_runtime::simulate::{Contact, Direction, Simulate as _, SimulationErrorKind};
use dynamics_runtime::smooth::{Pieces, SmoothFunction};

use crate::error::LiveError;
use crate::live::{Live, PageMethod};

/// Tolerance of methods that choose their steps, where none is given.
const DEFAULT_TOLERANCE: f64 = 1e-8;

/// What was chosen for a page, by indices.
pub(crate) struct Plan {
    /// Of the parameters, then of the inputs.
    pub(crate) sliders: Vec<Slider>,
    pub(crate) method: PageMethod,
    /// Its tolerance or step; of a fixed step that was not given the page takes a part of the motion's own
    /// time.
    pub(crate) accuracy: Option<f64>,
    /// The coordinate of the phase plane.
    pub(crate) phase: usize,
    pub(crate) contacts: Vec<(&'static Constraint, Contact)>,
    /// Each with its breakaway event.
    pub(crate) stick_slips: Vec<(&'static Constraint, usize)>,
    pub(crate) stops: Vec<(usize, Direction)>,
    pub(crate) functions: Vec<Pieces>,
}

/// A parameter or an input.
#[derive(Clone, Debug)]
pub(crate) struct Slider {
    /// Its value in the model or in the first start; 0 for an input that is not set.
    pub(crate) value: f64,
    /// The ends that were given.
    pub(crate) range: Option<[f64; 2]>,
    /// Whether there is no slider.
    pub(crate) held: bool,
}

/// Checks the model and all that was chosen for it.
pub(crate) fn plan<M: SimulationModel + Portable>(live: &Live<'_, M>) -> Result<Plan, LiveError> {
    if M::JAVASCRIPT.is_empty() {
        let reasons = M::NOT_PORTABLE.iter().map(|&reason| reason.to_owned()).collect();
        return Err(LiveError::NotPortable { model: M::NAME, reasons });
    }
    let functions = functions(M::FUNCTIONS, &live.model.smooth_functions())?;
    let plottable = plottable::<M>();
    live.plots.iter().try_for_each(|name| index("quantity", name, &plottable).map(|_| ()))?;
    let events = listed(M::EVENTS);
    let switched = || M::CONSTRAINTS.iter().filter(|constraint| constraint.switched.is_some());
    let names: Vec<String> = switched().map(|constraint| constraint.name.to_owned()).collect();
    let constraint = |name: &String| -> Result<&'static Constraint, LiveError> {
        let known = index("switched constraint", name, &names)?;
        Ok(switched().nth(known).expect("the names are those of the switched constraints"))
    };
    let event = |name: &String| index("event", name, &events);
    let contacts = live.contacts.iter().map(|(name, law)| Ok((constraint(name)?, *law)));
    let stick_slips = live.stick_slips.iter().map(|[name, of]| Ok((constraint(name)?, event(of)?)));
    let stops = live.stops.iter().map(|(name, direction)| Ok((event(name)?, *direction)));
    // A value that the model does not tell is refused with the parameter's name by the simulation's checks.
    let adjustable = Adjustable {
        parameters: M::PARAMETERS,
        values: (0..M::PARAMETERS.len()).map(|i| live.model.parameter(i).unwrap_or(f64::NAN)).collect(),
        inputs: M::INPUTS,
        starts: live.starts.iter().map(|(_, start)| start.inputs().as_slice()).collect(),
        fixed: &[],
        ranges: &live.ranges,
        held: &live.held,
    };
    let phase = live.phase.iter().map(|name| index("coordinate", name, &listed(M::COORDINATES))).next();
    let (method, accuracy) = method(live)?;
    let plan = Plan {
        method,
        accuracy,
        phase: phase.transpose()?.unwrap_or(0),
        contacts: contacts.collect::<Result<_, LiveError>>()?,
        stick_slips: stick_slips.collect::<Result<_, LiveError>>()?,
        stops: stops.collect::<Result<_, LiveError>>()?,
        functions,
        sliders: sliders(&adjustable)?,
    };
    live.starts.iter().try_for_each(|(name, start)| can_begin(live, name, start))?;
    Ok(plan)
}

/// What the library's own simulation would refuse is refused with its error.
fn can_begin<M: SimulationModel + Portable>(
    live: &Live<'_, M>,
    name: &str,
    start: &M::State,
) -> Result<(), LiveError> {
    let mut start = *start;
    // Inputs that are not set have sliders, which begin at 0.
    start.inputs_mut().as_mut_slice().iter_mut().filter(|x| x.is_nan()).for_each(|x| *x = 0.0);
    let mut simulation = live.model.simulate(start);
    for (constraint, law) in &live.contacts {
        simulation = simulation.contact(constraint, *law);
    }
    for [constraint, event] in &live.stick_slips {
        simulation = simulation.stick_slip(constraint, event);
    }
    for (event, direction) in &live.stops {
        simulation = simulation.stop_at(event, *direction);
    }
    simulation.check_beginning().map_err(|error| match error.kind {
        SimulationErrorKind::Option(error) => LiveError::Option(Box::new(error)),
        kind => LiveError::Start { start: name.to_owned(), source: Box::new(kind) },
    })
}

/// The pieces of the smooth functions.
pub(crate) fn functions(names: &[&str], functions: &[&dyn SmoothFunction]) -> Result<Vec<Pieces>, LiveError> {
    let of = |(name, function): (&&str, &&dyn SmoothFunction)| {
        let name = (*name).to_owned();
        let Some(pieces) = function.pieces() else { return Err(LiveError::Function { name }) };
        match pieces.fault(*function) {
            Some(fault) => Err(LiveError::Pieces { name, fault }),
            None => Ok(pieces),
        }
    };
    names.iter().zip(functions).map(of).collect()
}

/// What may have a slider.
pub(crate) struct Adjustable<'a> {
    pub(crate) parameters: &'static [Quantity],
    pub(crate) values: Vec<f64>,
    pub(crate) inputs: &'static [Quantity],
    /// The inputs of each start, NaN where they are not set.
    pub(crate) starts: Vec<&'a [f64]>,
    /// Names of what a page holds at its value.
    pub(crate) fixed: &'a [&'static str],
    pub(crate) ranges: &'a [(String, [f64; 2])],
    pub(crate) held: &'a [String],
}

/// The sliders of the parameters, then of the inputs.
pub(crate) fn sliders(of: &Adjustable<'_>) -> Result<Vec<Slider>, LiveError> {
    let inputs = of.starts[0].iter().map(|x| if x.is_nan() { 0.0 } else { *x });
    let sliders = of.values.iter().copied().chain(inputs);
    let sliders = sliders.map(|value| Slider { value, range: None, held: false });
    let mut sliders: Vec<Slider> = sliders.collect();
    let quantities: Vec<&Quantity> = of.parameters.iter().chain(of.inputs).collect();
    let called = |name: &str| match of.fixed.iter().find(|fixed| **fixed == field(name)) {
        Some(fixed) => Err(LiveError::Fixed { name: fixed }),
        None => called(name, &quantities),
    };
    for (name, range) in of.ranges {
        if !(range[0] < range[1] && range.iter().all(|end| end.is_finite())) {
            return Err(LiveError::Range { name: name.clone(), range: *range });
        }
        for i in called(name)? {
            sliders[i].range = Some(*range);
        }
    }
    for name in of.held {
        called(name)?.into_iter().for_each(|i| sliders[i].held = true);
    }
    for (i, slider) in sliders.iter().enumerate() {
        let name = quantities[i].name;
        let input = i.checked_sub(of.parameters.len());
        for value in of.starts.iter().filter_map(|inputs| inputs.get(input?).copied()) {
            if value.is_infinite() {
                return Err(LiveError::Input { name, value });
            }
            if value.is_nan() && slider.held {
                return Err(LiveError::HeldInput { name });
            }
            contained(name, slider, if value.is_nan() { 0.0 } else { value })?;
        }
        if input.is_none() && slider.value.is_finite() {
            contained(name, slider, slider.value)?;
        }
    }
    Ok(sliders)
}

fn contained(name: &'static str, slider: &Slider, value: f64) -> Result<(), LiveError> {
    match slider.range {
        Some([from, to]) if !(from..=to).contains(&value) => {
            Err(LiveError::OutOfRange { name, range: [from, to], value })
        }
        _ => Ok(()),
    }
}

/// The name of a field in that of its element: `mass` of `mass[2]`, `lean` of `lean.x`.
pub(crate) fn field(name: &str) -> &str {
    name.split(['[', '.']).next().unwrap_or(name)
}

/// The quantities that a name stands for: one, or all elements of a field.
fn called(name: &str, quantities: &[&Quantity]) -> Result<Vec<usize>, LiveError> {
    let of = |i: &usize| quantities[*i].name == name || field(quantities[*i].name) == name;
    let found: Vec<usize> = (0..quantities.len()).filter(of).collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let known: Vec<String> = quantities.iter().map(|quantity| quantity.name.to_owned()).collect();
    Err(LiveError::UnknownName { what: "parameter or input", name: name.to_owned(), known })
}

/// Refuses a number that is not admissible.
fn number_in(
    option: &'static str,
    value: f64,
    admissible: bool,
    range: &'static str,
) -> Result<(), LiveError> {
    if admissible { Ok(()) } else { Err(LiveError::Number { option, value, range }) }
}

/// Method and accuracy at the beginning.
fn method<M: SimulationModel + Portable>(live: &Live<'_, M>) -> Result<(PageMethod, Option<f64>), LiveError> {
    let method = live.method.unwrap_or(match live.step {
        Some(_) => PageMethod::Rk4,
        None => PageMethod::DormandPrince,
    });
    let usual = method.is_adaptive().then_some(DEFAULT_TOLERANCE);
    let starts = live.starts.iter().map(|(name, start)| (name.as_str(), start.t())).collect();
    let chosen = Chosen { tolerance: live.tolerance, step: live.step, until: live.until, starts };
    Ok((method, accuracy(&chosen, method.is_adaptive(), usual)?))
}

/// What was chosen for the steps of a motion.
pub(crate) struct Chosen<'a> {
    pub(crate) tolerance: Option<f64>,
    pub(crate) step: Option<f64>,
    pub(crate) until: Option<f64>,
    /// Names and times of the starts.
    pub(crate) starts: Vec<(&'a str, f64)>,
}

/// The tolerance or the step at the beginning, after checks of all that was chosen.
pub(crate) fn accuracy(
    Chosen { tolerance, step, until, starts }: &Chosen<'_>,
    is_adaptive: bool,
    usual: Option<f64>,
) -> Result<Option<f64>, LiveError> {
    for (i, (name, _)) in starts.iter().enumerate() {
        if starts[..i].iter().any(|(other, _)| other == name) {
            return Err(LiveError::TwoStarts { name: (*name).to_owned() });
        }
    }
    if let Some(tolerance) = *tolerance {
        let range = "between 1e-14 and 0.1";
        number_in("the tolerance", tolerance, (1e-14..=0.1).contains(&tolerance), range)?;
    }
    if let Some(step) = *step {
        number_in("the step", step, step > 0.0 && step.is_finite(), "a positive number")?;
    }
    if let Some(end) = *until {
        let later = end.is_finite() && starts.iter().all(|(_, start)| end > *start);
        number_in("the end of the motion", end, later, "a time after the start")?;
    }
    let refused = |given, remedy| Err(LiveError::Accuracy { given, remedy });
    match (tolerance, step) {
        (Some(_), Some(_)) => {
            refused("`.tolerance(..)` and `.step(..)` are given for one motion", "drop one of them")
        }
        (Some(_), None) if !is_adaptive => refused(
            "`.tolerance(..)` is given, and the method has a fixed step",
            "give `.step(..)`, or `.method(..)` one that chooses its steps, as `methods::Dop853`",
        ),
        (None, Some(_)) if is_adaptive => refused(
            "`.step(..)` is given, and the method chooses its steps",
            "give `.tolerance(..)`, or `.method(..)` one with a fixed step, as `methods::Rk4`",
        ),
        (tolerance, step) => Ok(tolerance.or(*step).or(usual)),
    }
}

/// The place of a name among those that there are.
fn index(what: &'static str, name: &str, known: &[String]) -> Result<usize, LiveError> {
    let found = known.iter().position(|other| other == name);
    found.ok_or_else(|| LiveError::UnknownName { what, name: name.to_owned(), known: known.to_vec() })
}

fn listed(list: &[Quantity]) -> Vec<String> {
    list.iter().map(|quantity| quantity.name.to_owned()).collect()
}

/// The names of what can be plotted over time, as tables of motions have them.
fn plottable<M: SimulationModel + Portable>() -> Vec<String> {
    let rates = M::COORDINATES.iter().map(|q| names::suffixed(q.name, "_rate"));
    let energies: &[&str] = if M::HAS_ENERGIES { &["kinetic energy", "potential energy"] } else { &[] };
    let energies = ["energy"].iter().chain(energies).map(|&name| name.to_owned());
    let conserved = M::CONSERVED.iter().map(|quantity| quantity.name.to_owned());
    let mut all = listed(M::COORDINATES);
    all.extend(rates.chain(listed(M::OUTPUTS)).chain(energies).chain(conserved).chain(listed(M::POWERS)));
    all.extend(M::ROWS.iter().map(|row| format!("lambda[{}]", row.name)));
    all
}
