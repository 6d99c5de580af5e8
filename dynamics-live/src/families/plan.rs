//! What a page of a model with families can hold, and what not.

use dynamics_families::model::{FamilyState, Length, Multipliers, Sizes};
use dynamics_families::portable::PortableFamily;
use dynamics_families::{FamilyMethod, SimulateFamilies as _};
use dynamics_runtime::smooth::Pieces;

use super::FamilyLive;
use crate::error::LiveError;
use crate::plan::{Adjustable, Chosen, Slider, accuracy, functions, sliders};

/// Tolerance of methods that choose their steps, where none is given.
const DEFAULT_TOLERANCE: f64 = 1e-6;

/// More would leave no room for the instants that a page keeps.
const MOST_UNKNOWNS: usize = 20_000;

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
    if sizes.unknowns() > MOST_UNKNOWNS {
        let (model, unknowns) = (M::NAME, sizes.unknowns());
        return Err(LiveError::Unknowns { model, unknowns, most: MOST_UNKNOWNS });
    }
    let (method, key) = method(live)?;
    let starts = live.starts.iter().map(|(name, start)| (name.as_str(), start.t())).collect();
    let chosen = Chosen { tolerance: live.tolerance, step: live.step, until: live.until, starts };
    let usual = method.is_adaptive().then_some(DEFAULT_TOLERANCE);
    let accuracy = accuracy(&chosen, method.is_adaptive(), usual)?;
    let adjustable = Adjustable {
        parameters: M::PARAMETERS,
        values: live.model.parameters(),
        inputs: M::INPUTS,
        starts: live.starts.iter().map(|(_, start)| start.inputs()).collect(),
        fixed: &[M::COUNTS, M::NUMBERED].concat(),
        ranges: &live.ranges,
        held: &live.held,
    };
    let sliders = sliders(&adjustable)?;
    for (name, start) in &live.starts {
        can_begin(live, name, start, method)?;
    }
    // Outputs are asked for their lengths, which needs a start that fits.
    let known = names(live, sizes);
    for name in &live.plots {
        check_name("quantity", name, &known)?;
    }
    let phase = match &live.phase {
        Some(name) => {
            check_name("coordinate", name, &known[..M::FIELDS.len()])?;
            place_of::<M>(sizes, name).unwrap_or(0)
        }
        None => sizes.range(0).start + middle::<M>(sizes),
    };
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

/// Names that differ by their indices alone: a word, the ends of its indices, and what follows them, `.x`.
struct Known {
    word: String,
    ends: Vec<usize>,
    suffix: String,
}

impl Known {
    /// Whether a name is one of these, as the page writes them.
    fn has(&self, name: &str) -> bool {
        let own = name.strip_prefix(self.word.as_str()).and_then(|rest| rest.strip_suffix(&self.suffix));
        let Some(mut rest) = own else { return false };
        for end in &self.ends {
            let index = rest.strip_prefix('[').and_then(|rest| rest.split_once(']'));
            match index.map(|(index, after)| (index, index.parse::<usize>(), after)) {
                Some((index, Ok(number), after)) if number < *end && index == number.to_string() => {
                    rest = after;
                }
                _ => return false,
            }
        }
        rest.is_empty()
    }

    /// The first name and the last one.
    fn examples(&self) -> [String; 2] {
        [|_: &usize| 0, |end: &usize| end.saturating_sub(1)].map(|index| {
            let indices: String = self.ends.iter().map(|end| format!("[{}]", index(end))).collect();
            format!("{}{indices}{}", self.word, self.suffix)
        })
    }
}

/// The coordinates, then everything else that the page can plot.
fn names<M: PortableFamily>(live: &FamilyLive<'_, M>, sizes: &Sizes) -> Vec<Known> {
    let plain = |word: String| Known { word, ends: Vec::new(), suffix: String::new() };
    let fields = |ending: &'static str| {
        M::FIELDS.iter().enumerate().map(move |(k, field)| {
            let (nodes, columns) = (sizes.range(k).len(), sizes.columns(k).max(1));
            let ends = match field.length {
                Length::One => Vec::new(),
                Length::Count { .. } => vec![nodes],
                Length::Grid { .. } => vec![nodes / columns, columns],
            };
            Known { word: format!("{}{ending}", field.name), ends, suffix: String::new() }
        })
    };
    let mut known: Vec<Known> = fields("").chain(fields("_rate")).collect();
    let start = &live.starts[0].1;
    let jets = M::coordinates(start, &vec![0.0; sizes.unknowns()], Multipliers::default());
    for (k, output) in M::OUTPUTS.iter().enumerate() {
        let suffixes = M::SHOWN.iter().filter_map(|shown| shown.strip_prefix(output.name));
        let suffixes: Vec<&str> =
            suffixes.filter(|rest| rest.is_empty() || rest.starts_with(['.', '['])).collect();
        let values = live.model.output(k, &jets).len();
        let ends = match output.numbered {
            true => vec![values / suffixes.len().max(1)],
            false => Vec::new(),
        };
        let word = || output.name.to_owned();
        known.extend(suffixes.iter().map(|suffix| Known {
            word: word(),
            ends: ends.clone(),
            suffix: (*suffix).to_owned(),
        }));
    }
    // As the scripts decide whether there is a power.
    if M::JAVASCRIPT.contains("balanced: true,") && M::JAVASCRIPT.contains("conservative: false,") {
        known.push(plain("power".to_owned()));
    }
    let energies = ["energy", "kinetic energy", "potential energy"];
    known.extend(energies.map(|word| plain(word.to_owned())));
    known
}

fn check_name(what: &'static str, name: &str, known: &[Known]) -> Result<(), LiveError> {
    if known.iter().any(|known| known.has(name)) {
        return Ok(());
    }
    let mut all: Vec<String> = known.iter().flat_map(Known::examples).collect();
    all.dedup();
    Err(LiveError::UnknownName { what, name: name.to_owned(), known: all })
}

/// Where a coordinate lies in q.
fn place_of<M: PortableFamily>(sizes: &Sizes, name: &str) -> Option<usize> {
    let (word, rest) = name.split_at(name.find('[').unwrap_or(name.len()));
    let indices = rest.split(['[', ']']).filter(|part| !part.is_empty());
    let indices = indices.map(|part| part.parse().ok()).collect::<Option<Vec<usize>>>()?;
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
