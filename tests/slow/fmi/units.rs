//! The units of all models, with the motions that Rust computes.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use dynamics::fmi::{FmuFile, FmuMethod};
use dynamics::model::{ModelState, Parameters, PrintedInC, SimulationModel, State, Vector, names};
use dynamics::prelude::*;

use crate::double_pendulum::DoublePendulum;
use crate::models::{Ball, CartPole, Chain, Fmu, Masses, SliderCrank, Twice, Wagon};

/// Tolerance of all units, and of the comparison.
pub(crate) const TOLERANCE: f64 = 1e-7;
/// How far a unit may be from Rust, in tolerances.
pub(crate) const MOST_TOLERANCES: f64 = 10.0;
/// Tolerance of the motions that units are compared with.
const PRECISE: f64 = 1e-12;
/// Size of the motion of the unit `small`, in m.
const SMALL: f64 = 1e-7;
/// When inputs jump.
pub(crate) const JUMP: f64 = 0.5;
/// When motions are compared.
const TIMES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// A motion that a unit has to repeat.
pub(crate) struct Run {
    pub(crate) about: &'static str,
    /// Values by name that differ from those of the unit.
    pub(crate) changed: Vec<(String, f64)>,
    /// What the first input jumps to, at `JUMP`.
    pub(crate) jump: Option<f64>,
    /// How far Rust is from the motion, in tolerances, by the method and the tolerance of the unit.
    pub(crate) own: f64,
    pub(crate) times: Vec<f64>,
    /// At each time the values of `Unit::compared`.
    pub(crate) values: Vec<Vec<f64>>,
    /// When declared events are crossed.
    pub(crate) events: Vec<f64>,
}

/// A model as a unit.
pub(crate) struct Unit {
    pub(crate) name: &'static str,
    /// What its names in C begin with.
    pub(crate) prefix: &'static str,
    pub(crate) files: Vec<FmuFile>,
    /// Names of coordinates, rates, energy and outputs.
    pub(crate) compared: Vec<String>,
    /// How many of `compared` are states.
    pub(crate) states: usize,
    /// Derivatives of the states at the start.
    pub(crate) derivatives: Vec<f64>,
    pub(crate) runs: Vec<Run>,
    pub(crate) rows: usize,
    /// The size of values below which their errors count as parts of it.
    pub(crate) size: f64,
    /// Whether there are derivatives along a direction, and names of the structured convention.
    pub(crate) directional: bool,
    pub(crate) structured: bool,
}

impl Unit {
    pub(crate) fn text(&self, name: &str) -> &str {
        let file = self.files.iter().find(|file| file.name == name);
        let file = file.unwrap_or_else(|| panic!("{} has no {name}", self.name));
        std::str::from_utf8(&file.bytes).unwrap()
    }

    /// Writes the sources to a folder, and returns the names of those in C.
    pub(crate) fn write_sources(&self, folder: &Path) -> Vec<String> {
        let mut in_c = Vec::new();
        for file in &self.files {
            let Some(name) = file.name.strip_prefix("sources/") else { continue };
            fs::write(folder.join(name), &file.bytes).unwrap();
            if name.ends_with(".c") {
                in_c.push(name.to_owned());
            }
        }
        in_c
    }
}

/// An empty folder of a name.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fmi").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The largest of some differences, 0 of none; NaN where one is NaN, which no bound admits.
pub(crate) fn largest(differences: impl Iterator<Item = f64>) -> f64 {
    differences.fold(0.0, |most, next| if next <= most { most } else { next + 0.0 * most })
}

/// A motion of Rust, at all times.
fn run<M: SimulationModel + Parameters + Clone>(
    about: &'static str,
    model: &M,
    start: State<M>,
    (changed, jump, method): (Vec<(String, f64)>, Option<f64>, FmuMethod),
) -> Run {
    let mut model = model.clone();
    for (name, value) in &changed {
        let index = M::PARAMETERS.iter().position(|parameter| parameter.name == *name);
        assert!(index.is_some_and(|index| model.set_parameter(index, *value)), "{name}");
    }
    let mut after = start;
    if let (Some(jump), Some(first)) = (jump, after.inputs_mut().as_mut_slice().first_mut()) {
        *first = jump;
    }
    let [before, after] = [*start.inputs(), *after.inputs()];
    let simulate = |tolerance| {
        let simulation = model.simulate(start).until(TIMES[TIMES.len() - 1]).tolerance(tolerance);
        // Steps end where an event is located: at the jump.
        let simulation = simulation.event("jump", |state: &State<M>| state.t() - JUMP);
        simulation.inputs(move |t, _| if t < JUMP { before } else { after })
    };
    let motion = simulate(PRECISE).run().unwrap();
    let at = |&t: &f64| {
        let state = motion.at(t);
        let mut outputs = vec![0.0; M::OUTPUTS.len()];
        model.outputs(&state, &mut outputs).unwrap();
        let energy = [model.energy_function(&state)];
        [state.q().as_slice(), state.u().as_slice(), &energy, &outputs].concat()
    };
    let values = TIMES.iter().map(at).collect();
    let declared = motion.events().iter().filter(|event| event.name != "jump");
    let events = declared.map(|event| event.time()).collect();
    let coarse = match method {
        FmuMethod::Dop853 => simulate(TOLERANCE).method(methods::Dop853),
        _ => simulate(TOLERANCE).method(methods::DormandPrince5),
    };
    let coarse = coarse.run().unwrap();
    let apart = |a: &[f64], b: &[f64]| {
        largest(a.iter().zip(b).map(|(a, b)| (a - b).abs() / (1.0 + b.abs()))) / TOLERANCE
    };
    let (found, end) = (coarse.end(), motion.end());
    let own =
        apart(found.q().as_slice(), end.q().as_slice()).max(apart(found.u().as_slice(), end.u().as_slice()));
    let changed = changed.into_iter().map(|(name, x)| (in_unit(M::NAME, "parameter", &name), x)).collect();
    Run { about, changed, jump, own, times: TIMES.to_vec(), values, events }
}

/// The name of a quantity in a unit: another one where names are used twice, and other indices of matrices.
fn in_unit(unit: &str, role: &str, name: &str) -> String {
    match name {
        "time" | "kinetic_energy" if unit.eq_ignore_ascii_case("twice") => format!("{role}.{name}"),
        name => name.replace("][", ","),
    }
}

/// A model as a unit, with motions as it is, with changed parameters, and where there is an input with one
/// that jumps.
fn unit<M: SimulationModel + Parameters + PrintedInC + Clone>(
    name: &'static str,
    method: impl Into<FmuMethod>,
    (model, start): (&M, State<M>),
    changed: &[(&str, f64)],
) -> Unit {
    let method = method.into();
    let fmu = model.fmu(start).method(method).tolerance(TOLERANCE).duration(2.0);
    fmu.write(folder(name).join(format!("{name}.fmu"))).unwrap();
    let changed: Vec<(String, f64)> = changed.iter().map(|(name, x)| ((*name).to_owned(), *x)).collect();
    let mut runs = vec![
        run("as it is", model, start, (Vec::new(), None, method)),
        run("changed parameters", model, start, (changed, None, method)),
    ];
    if !M::INPUTS.is_empty() {
        runs.push(run("an input that jumps", model, start, (Vec::new(), Some(4.0), method)));
    }
    let names = |columns: &mut dyn Iterator<Item = names::Column>| -> Vec<String> {
        columns.map(|column| column.name).collect()
    };
    let mut compared = names(&mut names::coordinates::<M>());
    compared.extend(names(&mut names::velocities::<M>()));
    let states = compared.len();
    compared.push("energy".to_owned());
    compared.extend(M::OUTPUTS.iter().map(|output| in_unit(name, "output", output.name)));
    let accelerations = model.accelerations(&start);
    let accelerations = match accelerations {
        Ok(found) if M::ROWS.is_empty() => found,
        _ => model.solve_unrolled(&model.constants().unwrap(), &start).unwrap().accelerations,
    };
    Unit {
        name,
        prefix: M::C.name,
        files: fmu.files().unwrap(),
        compared,
        states,
        derivatives: [start.u().as_slice(), accelerations.as_slice()].concat(),
        runs,
        rows: M::ROWS.len(),
        size: if name == "small" { SMALL } else { 1.0 },
        directional: M::CONSTRAINTS.iter().all(|constraint| constraint.switched.is_none()),
        structured: M::COORDINATES.iter().all(|coordinate| coordinate.name.is_ascii()),
    }
}

/// The start of the slider-crank at an angle of the crank.
pub(crate) fn cranked(model: &SliderCrank, crank: f64) -> State<SliderCrank> {
    let rod = (model.r * crank.sin() / model.l).asin();
    let slide = model.r * crank.cos() + model.l * rod.cos();
    model.state().crank(crank).rod(rod).slide(slide).build().unwrap()
}

/// The models whose accelerations have kinks, and a function of pieces.
pub(crate) fn ball() -> Ball {
    let wind = CubicSpline::natural(&[-1.0, 0.0, 1.0, 2.0, 3.0], &[0.0, 0.1, 0.5, -0.4, 0.0]).unwrap();
    Ball { mass: 0.5, g: 9.81, floor: 2e3, line: 0.2, wind }
}

/// The units of all models, which are made once.
pub(crate) fn units() -> &'static [Unit] {
    static ALL: OnceLock<Vec<Unit>> = OnceLock::new();
    ALL.get_or_init(all)
}

fn all() -> Vec<Unit> {
    let mut all = Vec::new();
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let start = model.state().theta1(2.0).theta2_rate(0.5).build().unwrap();
    all.push(unit("double_pendulum", methods::DormandPrince5, (&model, start), &[("m2", 1.5), ("l1", 0.8)]));
    let model = Masses { mass: [1.0, 2.0], stiffness: [10.0, 20.0, 30.0], damping: 0.3 };
    let start = model.state().x([0.1, -0.2]).build().unwrap();
    let changed = [("stiffness[1]", 5.0), ("damping", 1.0), ("mass[0]", 3.0)];
    all.push(unit("masses", methods::DormandPrince5, (&model, start), &changed));
    let start = model.state().x([SMALL, -SMALL]).build().unwrap();
    all.push(unit("small", methods::DormandPrince5, (&model, start), &[("damping", 1.0)]));
    let model = CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 };
    let start = model.state().theta(0.3).push(0.5).build().unwrap();
    all.push(unit("cart_pole", methods::DormandPrince5, (&model, start), &[("cart", 1.0)]));
    let model = SliderCrank { m: [1.0, 2.0, 3.0], r: 0.5, l: 1.5, g: 9.81, brake: 0.1 };
    let start = cranked(&model, 0.4);
    all.push(unit(
        "slider_crank",
        methods::DormandPrince5,
        (&model, start),
        &[("m[2]", 1.0), ("brake", 2.0)],
    ));
    let model = ball();
    let start = model.state().y(1.4).build().unwrap();
    all.push(unit("ball", methods::DormandPrince5, (&model, start), &[("floor", 1e3), ("line", 0.1)]));
    let model = Chain { cart: 2.0, mass: 0.3, length: 0.25, g: 9.81 };
    let start = model.state().theta([0.2, 0.15, 0.1, 0.05, 0.0, 0.0, -0.05, -0.1]).build().unwrap();
    all.push(unit("chain", methods::Dop853, (&model, start), &[("cart", 0.5), ("length", 0.3)]));
    let model = Wagon { mass: 1.0, stiffness: 4.0, place: 0.5 };
    let start = model.state().x(-1.0).release("hook").build().unwrap();
    all.push(unit("wagon", methods::DormandPrince5, (&model, start), &[("stiffness", 9.0)]));
    let model = Fmu {};
    let start = model.state().größe(1.0).build().unwrap();
    all.push(unit("plain", methods::DormandPrince5, (&model, start), &[]));
    let model = Twice { time: 2.0, turn: [[1.0, 2.0], [3.0, 4.0]] };
    let start = model.state().x(1.0).build().unwrap();
    all.push(unit("twice", methods::Dop853, (&model, start), &[("time", 1.0), ("turn[1][0]", 5.0)]));
    all
}
