//! What a page of a model with families can hold, and what not.

use dynamics_families::model::{FamilyState, Length, Sizes};
use dynamics_families::portable::PortableFamily;
use dynamics_families::{FamilyMethod, SimulateFamilies as _};
use dynamics_runtime::smooth::Pieces;

use super::FamilyLive;
use crate::error::LiveError;
use crate::plan::{Adjustable, Slider, functions, number_in, sliders};

/// Tolerance of methods that choose their steps, where none is given.
const DEFAULT_TOLERANCE: f64 = 1e-6;

/// What was chosen for a page, by indices.
pub(super) struct FamilyPlan {
    /// Of the scalar parameters, then of the inputs.
    pub(super) sliders: Vec<Slider>,
    /// The method's name in the scripts.
    pub(super) method: &'static str,
    /// Its tolerance or step; without one the page chooses the step.
    pub(super) accuracy: Option<f64>,
    /// The coordinate of the phase plane.
    pub(super) phase: usize,
    pub(super) functions: Vec<Pieces>,
}

/// Checks the model and all that was chosen for it.
pub(super) fn plan<M: PortableFamily>(live: &FamilyLive<'_, M>) -> Result<FamilyPlan, LiveError> {
    if M::JAVASCRIPT.is_empty() {
        let reasons = M::NOT_PORTABLE.iter().map(|&reason| reason.to_owned()).collect();
        return Err(LiveError::NotPortable { model: M::NAME, reasons });
    }
    let functions = functions(M::FUNCTIONS, &live.model.smooth_functions())?;
    let sizes = live.starts[0].1.ends();
    let known = names::<M>(sizes);
    for name in &live.plots {
        check_name("quantity", name, &known, &["", "_rate"])?;
    }
    let phase = match &live.phase {
        Some(name) => {
            check_name("coordinate", name, &known[..M::FIELDS.len()], &[""])?;
            place_of::<M>(sizes, name).unwrap_or(0)
        }
        None => sizes.range(0).start + middle::<M>(sizes),
    };
    let (method, key) = method(live)?;
    let accuracy = accuracy(live, method)?;
    let adjustable = Adjustable {
        parameters: M::PARAMETERS,
        values: live.model.parameters(),
        inputs: M::INPUTS,
        starts: live.starts.iter().map(|(_, start)| start.inputs()).collect(),
        ranges: &live.ranges,
        held: &live.held,
    };
    let sliders = sliders(&adjustable)?;
    for (name, start) in &live.starts {
        can_begin(live, name, start, method)?;
    }
    Ok(FamilyPlan { sliders, method: key, accuracy, phase, functions })
}

/// The node in the middle of the first field.
fn middle<M: PortableFamily>(sizes: &Sizes) -> usize {
    let (nodes, columns) = (sizes.range(0).len(), sizes.columns(0).max(1));
    match M::FIELDS.first().map(|field| field.length) {
        Some(Length::Grid { .. }) => nodes / columns / 2 * columns + columns / 2,
        _ => nodes / 2,
    }
}

/// The method at the beginning, and its name in the scripts.
fn method<M: PortableFamily>(live: &FamilyLive<'_, M>) -> Result<(FamilyMethod, &'static str), LiveError> {
    let usual = match (live.tolerance, M::VELOCITY_FORCES) {
        (Some(_), _) => FamilyMethod::DormandPrince5,
        (None, false) => FamilyMethod::StormerVerlet,
        (None, true) if live.step.is_some() => FamilyMethod::Rk4,
        (None, true) => FamilyMethod::DormandPrince5,
    };
    let method = live.method.unwrap_or(usual);
    let key = match method {
        FamilyMethod::StormerVerlet => Some("verlet"),
        FamilyMethod::Rk4 => Some("rk4"),
        FamilyMethod::DormandPrince5 => Some("dp5"),
        FamilyMethod::Dop853 => Some("dop853"),
        FamilyMethod::ImplicitMidpoint => Some("midpoint"),
        _ => None,
    };
    let refused = || LiveError::FamilyMethod { method: method.to_string() };
    key.map(|key| (method, key)).ok_or_else(refused)
}

/// The tolerance or the step at the beginning.
fn accuracy<M: PortableFamily>(
    live: &FamilyLive<'_, M>,
    method: FamilyMethod,
) -> Result<Option<f64>, LiveError> {
    if let Some(tolerance) = live.tolerance {
        let range = "between 1e-14 and 0.1";
        number_in("the tolerance", tolerance, (1e-14..=0.1).contains(&tolerance), range)?;
    }
    if let Some(step) = live.step {
        number_in("the step", step, step > 0.0 && step.is_finite(), "a positive number")?;
    }
    if let Some(end) = live.until {
        let later = end.is_finite() && live.starts.iter().all(|(_, start)| end > start.t());
        number_in("the end of the motion", end, later, "a time after the start")?;
    }
    let refused = |given, remedy| Err(LiveError::Accuracy { given, remedy });
    match (live.tolerance, live.step) {
        (Some(_), Some(_)) => {
            refused("`.tolerance(..)` and `.step(..)` are given for one motion", "drop one of them")
        }
        (Some(_), None) if !method.is_adaptive() => refused(
            "`.tolerance(..)` is given, and the method has a fixed step",
            "give `.step(..)`, or `.method(..)` one that chooses its steps, as `methods::Dop853`",
        ),
        (None, Some(_)) if method.is_adaptive() => refused(
            "`.step(..)` is given, and the method chooses its steps",
            "give `.tolerance(..)`, or `.method(..)` one with a fixed step, as `methods::Rk4`",
        ),
        (tolerance, step) => Ok(tolerance.or(step).or(method.is_adaptive().then_some(DEFAULT_TOLERANCE))),
    }
}

/// What the library's own simulation would refuse is refused with its error.
fn can_begin<M: PortableFamily>(
    live: &FamilyLive<'_, M>,
    name: &str,
    start: &M::State,
    method: FamilyMethod,
) -> Result<(), LiveError> {
    let mut start = start.clone();
    // Inputs that are not set have sliders, which begin at 0.
    start.parts_mut().3.iter_mut().filter(|x| x.is_nan()).for_each(|x| *x = 0.0);
    let end = start.t() + 1.0;
    let mut simulation = live.model.simulate(start).until(end).method(method);
    if !method.is_adaptive() {
        // Any step that is short enough, where the page chooses it.
        simulation = simulation.fixed_step(live.step.unwrap_or(f64::MIN_POSITIVE));
    }
    match simulation.check_beginning() {
        Ok(_) => Ok(()),
        Err(error) => Err(LiveError::FamilyStart { start: name.to_owned(), source: Box::new(error.kind) }),
    }
}

/// A name that can be plotted: the word, how many indices it has, and their ends.
struct Known {
    word: String,
    ends: Vec<usize>,
}

/// The coordinates, then everything else that can be plotted.
fn names<M: PortableFamily>(sizes: &Sizes) -> Vec<Known> {
    let fields = M::FIELDS.iter().enumerate().map(|(k, field)| {
        let (nodes, columns) = (sizes.range(k).len(), sizes.columns(k).max(1));
        let ends = match field.length {
            Length::One => Vec::new(),
            Length::Count { .. } => vec![nodes],
            Length::Grid { .. } => vec![nodes / columns, columns],
        };
        Known { word: field.name.to_owned(), ends }
    });
    // How long a numbered output is its function knows; an index beyond it is plotted as nothing.
    let outputs = M::OUTPUTS.iter().filter(|output| M::SHOWN.contains(&output.name)).map(|output| Known {
        word: output.name.to_owned(),
        ends: if output.numbered { vec![usize::MAX] } else { Vec::new() },
    });
    let energies = ["power", "energy", "kinetic energy", "potential energy"];
    let energies = energies.map(|word| Known { word: word.to_owned(), ends: Vec::new() });
    fields.chain(outputs).chain(energies).collect()
}

/// The word of a name and its indices: `w[2][3]`; components of vectors, `.x`, belong to neither.
fn parts(name: &str) -> Option<(&str, Vec<usize>)> {
    let (word, rest) = name.split_at(name.find(['[', '.']).unwrap_or(name.len()));
    let rest = rest.split_once('.').map_or(rest, |(before, _)| before);
    let indices = rest.split(['[', ']']).filter(|part| !part.is_empty());
    Some((word, indices.map(|part| part.parse().ok()).collect::<Option<_>>()?))
}

fn check_name(what: &'static str, name: &str, known: &[Known], suffixes: &[&str]) -> Result<(), LiveError> {
    let fits = |known: &Known, (word, indices): &(&str, Vec<usize>)| {
        suffixes.iter().any(|suffix| word.strip_suffix(suffix) == Some(known.word.as_str()))
            && indices.len() == known.ends.len()
            && indices.iter().zip(&known.ends).all(|(index, end)| index < end)
    };
    if parts(name).is_some_and(|parts| known.iter().any(|known| fits(known, &parts))) {
        return Ok(());
    }
    // The first and the last of each.
    let written = |known: &Known, last: bool| {
        let index = |end: &usize| match (last, *end) {
            (true, end) if end < usize::MAX => end.saturating_sub(1),
            _ => 0,
        };
        let indices: String = known.ends.iter().map(|end| format!("[{}]", index(end))).collect();
        format!("{}{indices}", known.word)
    };
    let mut all: Vec<String> =
        known.iter().flat_map(|known| [written(known, false), written(known, true)]).collect();
    all.dedup();
    Err(LiveError::UnknownName { what, name: name.to_owned(), known: all })
}

/// Where a coordinate lies in q.
fn place_of<M: PortableFamily>(sizes: &Sizes, name: &str) -> Option<usize> {
    let (word, indices) = parts(name)?;
    let field = M::FIELDS.iter().position(|field| field.name == word)?;
    let columns = sizes.columns(field).max(1);
    let node = match indices[..] {
        [] => 0,
        [node] => node,
        [row, column] => row * columns + column,
        _ => return None,
    };
    Some(sizes.range(field).start + node)
}
