//! All programs at random states: doubles with the bits of Rust, floats near them.

use dynamics::model::{Kink, ModelState, PrintedInC, SimulationModel, Terms, Vector};
use dynamics::prelude::*;

use crate::compiler::{compilers, folder};
use crate::driver::{Called, Given, called, given, parameters, run};
use crate::functions::Hook;
use crate::random_states::{Numbers, Visit, every_model, random_states};

/// What a function returns in Rust; `None` where only the general solver has it.
type Expected = Option<Vec<f64>>;

/// A state with all that Rust returns there, in the order of the driver's functions.
struct Sample<S> {
    state: S,
    given: Given,
    expected: Vec<Expected>,
}

fn written(count: usize, write: impl FnOnce(&mut [f64])) -> Vec<f64> {
    let mut values = vec![f64::NAN; count];
    write(&mut values);
    values
}

/// What a model without constraints returns, or one with constraints that are solved by generated code.
fn sample<M: SimulationModel + PrintedInC>(
    model: &M,
    state: M::State,
    numbers: &mut Numbers,
) -> Sample<M::State> {
    let (n, r) = (M::COORDINATES.len(), M::ROWS.len());
    let constants = model.constants().unwrap();
    let solved = match r {
        0 => model.accelerations(&state).ok().map(|a| (a.as_slice().to_vec(), Vec::new())),
        _ => model
            .solve_unrolled(&constants, &state)
            .map(|s| (s.accelerations.as_slice().to_vec(), s.multipliers.as_slice().to_vec())),
    };
    let mut right = M::Rows::zeros();
    right.as_mut_slice().iter_mut().for_each(|x| *x = numbers.between(-1.0, 1.0));
    let (a, l) = solved.clone().unwrap_or_else(|| (vec![f64::NAN; n], vec![f64::NAN; r]));
    let given = given::<M>(&state, [&a, &l, right.as_slice()]);
    let is_solved = solved.is_some();
    let of = |function: &Called| -> Expected {
        let count = function.results;
        match function.name {
            "accelerations" => solved.as_ref().map(|(a, l)| [a.as_slice(), l].concat()),
            // What follows are T and V, where there are some.
            "energies" => Some(vec![model.energy_function(&state)]),
            "conserved" => Some(written(count, |values| model.conserved(&state, values))),
            "powers" if is_solved => Some(written(count, |values| model.powers(&state, values))),
            "outputs" if is_solved => Some(written(count, |x| model.outputs(&state, x).unwrap())),
            "events" if is_solved => Some(written(count, |x| model.events(&state, x).unwrap())),
            "kinks" => {
                let mut kinks = vec![Kink::NONE; count];
                model.kinks(&state, &mut kinks);
                Some(kinks.iter().map(|kink| kink.value).collect())
            }
            "residual" => Some(model.residual(&state).as_slice().to_vec()),
            "velocity_residual" => Some(model.velocity_residual(&state).as_slice().to_vec()),
            "correction" => {
                model.correct_unrolled(&constants, &state, &right).map(|delta| delta.as_slice().to_vec())
            }
            "terms" => Some(written(count, |values| {
                let (mass, rest) = values.split_at_mut(n * n);
                let (force, rest) = rest.split_at_mut(n);
                let (jacobian, gamma) = rest.split_at_mut(r * n);
                model.terms(&state, &mut Terms { mass, force, jacobian, gamma });
            })),
            _ => None,
        }
    };
    let expected = called::<M>().iter().map(of).collect();
    Sample { state, given, expected }
}

/// Random states, some of them with released constraints.
fn samples<M: SimulationModel + PrintedInC>(model: &M) -> Vec<Sample<M::State>> {
    let mut numbers = Numbers::new("right sides");
    let switched = M::CONSTRAINTS.iter().filter(|c| c.switched.is_some()).count();
    let states = random_states::<M>().into_iter().enumerate().map(|(i, mut state)| {
        for index in 0..switched {
            let mode = (i >> index) % 3;
            if mode > 0 {
                state.active_set_mut().release(index, if mode == 1 { 1.0 } else { -1.0 });
            }
        }
        state
    });
    states.map(|state| sample(model, state, &mut numbers)).collect()
}

fn is_same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// Compares all programs bit by bit.
struct Bits {
    compiler: String,
    compared: Vec<usize>,
}

impl Visit for Bits {
    fn visit<M: SimulationModel + PrintedInC>(&mut self, model: &M) {
        if !M::C.obstacles.is_empty() {
            return;
        }
        let samples = samples(model);
        let given: Vec<Given> = samples.iter().map(|sample| sample.given.clone()).collect();
        let folder = folder(&format!("bits_{}_{}", self.compiler, M::C.name));
        let export = example(model).library_sines();
        let results = run(&export, &self.compiler, &folder, &parameters(model), &given);
        let mut compared = 0;
        for (sample, found) in samples.iter().zip(&results) {
            let mut rest = found.as_slice();
            for (function, expected) in called::<M>().iter().zip(&sample.expected) {
                let name = function.name;
                if function.status {
                    let solves = name == "accelerations" || name == "correction";
                    assert_eq!(
                        rest[0] == 0.0,
                        expected.is_some() || !solves,
                        "{} {name} {:?}",
                        M::NAME,
                        sample.state
                    );
                    rest = &rest[1..];
                }
                let (own, others) = rest.split_at(function.results);
                rest = others;
                for (i, (found, value)) in own.iter().zip(expected.iter().flatten()).enumerate() {
                    assert!(
                        is_same(*found, *value),
                        "{} {name}[{i}]: {value:e} in Rust, {found:e} in C, {:?}",
                        M::NAME,
                        sample.state
                    );
                    compared += 1;
                }
            }
        }
        self.compared.push(compared);
    }
}

/// A model in C whose example begins where it can.
pub(crate) fn example<M: SimulationModel + PrintedInC>(model: &M) -> dynamics::export::CExport<'_, M> {
    let export = model.in_c();
    match start(model) {
        Some(start) => export.start(start),
        None => export,
    }
}

/// A start that fulfils the constraints: from random guesses, until one is assembled.
pub(crate) fn start<M: SimulationModel>(model: &M) -> Option<M::State> {
    if M::ROWS.is_empty() {
        return random_states::<M>().into_iter().next();
    }
    random_states::<M>().into_iter().find_map(|guess| assembled(model, guess))
}

fn assembled<M: SimulationModel>(model: &M, guess: M::State) -> Option<M::State> {
    let mut state = guess;
    let constants = model.constants().ok()?;
    for _ in 0..50 {
        let mut right = M::Rows::zeros();
        let residual = model.residual(&state);
        right.as_mut_slice()[..M::Residual::LEN].copy_from_slice(residual.as_slice());
        let delta = model.correct_unrolled(&constants, &state, &right)?;
        state.q_mut().as_mut_slice().iter_mut().zip(delta.as_slice()).for_each(|(q, d)| *q -= d);
    }
    for _ in 0..3 {
        let right = model.velocity_residual(&state);
        let delta = model.correct_unrolled(&constants, &state, &right)?;
        state.u_mut().as_mut_slice().iter_mut().zip(delta.as_slice()).for_each(|(u, d)| *u -= d);
    }
    let off = model.residual(&state).as_slice().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    (off < 1e-13).then_some(state)
}

#[test]
fn programs_have_the_bits_of_rust() {
    if dynamics::sin_cos::FUSED {
        eprintln!("skipped: products and sums are fused on this target, which C does not promise");
        return;
    }
    for compiler in compilers() {
        let mut bits = Bits { compiler, compared: Vec::new() };
        every_model(&mut bits);
        bits.visit(&Hook { m: 0.7, l: 1.3, g: 9.81 });
        let Bits { compiler, compared } = bits;
        eprintln!("{compiler}: {} numbers of {} models", compared.iter().sum::<usize>(), compared.len());
        assert!(compared.iter().all(|&numbers| numbers > 1000), "{compared:?}");
    }
}

/// Errors of accelerations in floats, as parts of the largest acceleration of the state.
struct Single {
    compiler: String,
}

impl Visit for Single {
    fn visit<M: SimulationModel + PrintedInC>(&mut self, model: &M) {
        if !M::C.obstacles.is_empty() {
            return;
        }
        let samples = samples(model);
        let given: Vec<Given> = samples.iter().map(|sample| sample.given.clone()).collect();
        let folder = folder(&format!("single_{}_{}", self.compiler, M::C.name));
        let results =
            run(&example(model).single_precision(), &self.compiler, &folder, &parameters(model), &given);
        let mut errors: Vec<f64> = Vec::new();
        for (sample, found) in samples.iter().zip(&results) {
            let Some(expected) = &sample.expected[0] else { continue };
            if found[0] != 0.0 {
                continue;
            }
            let size = expected.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            let off = expected.iter().zip(&found[1..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            errors.push(if size > 0.0 { off / size } else { off });
        }
        errors.sort_by(f64::total_cmp);
        let [median, most_of_all] = [errors.len() / 2, errors.len() * 99 / 100].map(|i| errors[i]);
        eprintln!(
            "{}: {} of {} states, half of them below {median:.1e}, 99 in 100 below {most_of_all:.1e}",
            M::NAME,
            errors.len(),
            samples.len()
        );
        assert!(errors.len() * 10 > samples.len() * 3, "{}: {}", M::NAME, errors.len());
        // Phases such as 40 rad/s at 10 s have two digits less than floats have.
        assert!(median <= 1e-5 && most_of_all <= 1e-2, "{}: {median:e}, {most_of_all:e}", M::NAME);
    }
}

#[test]
fn floats_are_near_doubles() {
    for compiler in compilers() {
        every_model(&mut Single { compiler });
    }
}
