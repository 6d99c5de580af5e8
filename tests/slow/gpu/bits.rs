//! The kernel on the processor, against its lanes.

use dynamics::gpu::side_by_side_in_c;
use dynamics::lanes::limit_vectors;
use dynamics::model::{ModelState, PrintedInC, SimulationModel, Vector};
use dynamics::prelude::*;
use dynamics::simulate::{Simulation, can_be_on_device, ends, ends_on};

use crate::compiler::{compilers, folder};
use crate::host::Host;
use crate::models::{DoublePendulum, Pendulum};
use crate::random_states::{Visit, every_model, random_states};

/// Runs of each model.
const RUNS: usize = 64;

fn bits<M: SimulationModel>(end: &Result<M::State, dynamics::simulate::SimulationError<M>>) -> Vec<u64> {
    let Ok(state) = end else { return Vec::new() };
    [&[state.t()], state.q().as_slice(), state.u().as_slice()]
        .concat()
        .into_iter()
        .map(f64::to_bits)
        .collect()
}

/// Ends of random runs of a model. Returns how many the device made.
fn compare<'m, M: SimulationModel + PrintedInC>(
    model: &'m M,
    run: impl Fn(usize, M::State) -> Simulation<'m, M>,
    at_once: usize,
    test: &str,
) -> Option<(usize, usize)> {
    let compiler = compilers().into_iter().next()?;
    let simulations = || random_states::<M>().into_iter().take(RUNS).enumerate().map(|(i, s)| run(i, s));
    if !M::ROWS.is_empty() {
        let error = side_by_side_in_c(model).unwrap_err().to_string();
        assert!(error.contains("has constraints, which kernels do not hold"), "{error}");
        assert!(!can_be_on_device::<M>());
        return None;
    }
    // The kernel fuses no products.
    limit_vectors(128);
    let in_lanes = ends(simulations());
    let mut host = Host::new(model, &compiler, folder(&format!("gpu_{test}_{}", M::C.name)));
    let done = ends_on(&mut host, simulations(), at_once).unwrap();
    assert_eq!(done.ends.len(), RUNS);
    for (i, (of_device, of_lanes)) in done.ends.iter().zip(&in_lanes).enumerate() {
        assert_eq!(bits::<M>(of_device), bits::<M>(of_lanes), "{} {i}", M::NAME);
        if let (Err(a), Err(b)) = (of_device, of_lanes) {
            assert_eq!(a.to_string(), b.to_string());
        }
    }
    Some((done.on_device(), host.calls))
}

struct Ends(Vec<(&'static str, usize)>);

impl Visit for Ends {
    fn visit<M: SimulationModel + PrintedInC>(&mut self, model: &M) {
        let run = |i: usize, start: M::State| {
            let until = start.t() + if i.is_multiple_of(3) { -0.7 } else { 1.5 };
            model.simulate(start).until(until).tolerance(if i.is_multiple_of(2) { 1e-6 } else { 1e-10 })
        };
        let Some((on_device, calls)) = compare(model, run, 20, "ends") else { return };
        if M::HAS_LANES {
            assert!(on_device > RUNS / 2, "{} of {}", on_device, M::NAME);
            assert!(calls >= 4, "batches of 20");
        } else {
            assert_eq!((on_device, calls), (0, 0), "{}", M::NAME);
        }
        self.0.push((M::NAME, on_device));
    }
}

/// All models that lanes can make, forwards and backwards, at two tolerances: every end has the bits of the
/// processor's lanes; all others are made by the processor.
#[test]
fn ends_have_the_bits_of_lanes() {
    let mut ends = Ends(Vec::new());
    every_model(&mut ends);
    if !ends.0.is_empty() {
        assert!(ends.0.iter().filter(|(_, on_device)| *on_device > 0).count() >= 8, "{:?}", ends.0);
    }
}

/// Runs of several thousand attempts pause and go on; a motion that becomes stiff leaves the device.
#[test]
fn long_and_stiff_runs_end_as_in_lanes() {
    let model = Pendulum { m: 0.7, l: 1.3, g: 9.81, c: 0.0 };
    let run =
        |_: usize, start: State<Pendulum>| model.simulate(start).until(start.t() + 400.0).tolerance(1e-12);
    if let Some((on_device, calls)) = compare(&model, run, RUNS, "long") {
        assert!(on_device > RUNS / 2 && calls > 2, "{on_device} {calls}");
    }
    let damped = Pendulum { m: 0.7, l: 1.3, g: 9.81, c: 1e5 };
    let run =
        |_: usize, start: State<Pendulum>| damped.simulate(start).until(start.t() + 10.0).tolerance(1e-7);
    if let Some((on_device, _)) = compare(&damped, run, RUNS, "stiff") {
        assert_eq!(on_device, 0);
    }
}

/// Runs that fail have the error that they have alone; runs without length are no runs.
#[test]
fn failures_are_those_of_runs_alone() {
    let model = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let run = |i: usize, start: State<DoublePendulum>| {
        let run = model.simulate(start).until(start.t() + 5.0);
        match i % 4 {
            0 => run.max_steps(3),
            1 => run.tolerance(-1.0),
            2 => run.until(start.t()),
            _ => run,
        }
    };
    if let Some((on_device, _)) = compare(&model, run, RUNS, "failures") {
        assert_eq!(on_device, RUNS / 4);
    }
}
