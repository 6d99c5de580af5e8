//! Programs in JavaScript have the bits of the Rust programs, at random states.

use std::collections::BTreeMap;

use dynamics::live::OpenLive;
use dynamics::model::{Energies, ModelState, Terms, Vector};
use dynamics::smooth::Pieces;

use crate::engine::Engine;
use crate::random_states::random_states;

/// What a Rust program returns at a state.
#[derive(Clone)]
pub(crate) struct Returned {
    /// The name of the program in JavaScript.
    name: &'static str,
    /// q̈ and numbers per row that it is given.
    given: [Vec<f64>; 2],
    values: Vec<f64>,
}

impl Returned {
    fn of(name: &'static str, values: &[f64]) -> Self {
        Self { name, given: [Vec::new(), Vec::new()], values: values.to_vec() }
    }
    fn from(self, a: &[f64], per_row: &[f64]) -> Self {
        Self { given: [a.to_vec(), per_row.to_vec()], ..self }
    }
}

/// Numbers that a function writes.
fn written<T>(count: usize, write: impl FnOnce(&mut [f64]) -> T) -> (T, Vec<f64>) {
    let mut values = vec![f64::NAN; count];
    (write(&mut values), values)
}

/// What the Rust programs return at a state.
fn expected<M: OpenLive>(model: &M, state: &M::State) -> Vec<Returned> {
    let mut all = vec![
        Returned::of("energy_function", &[model.energy_function(state)]),
        Returned::of("conserved", &written(M::CONSERVED.len(), |values| model.conserved(state, values)).1),
        Returned::of("residual", model.residual(state).as_slice()),
        Returned::of("velocity_residual", model.velocity_residual(state).as_slice()),
        Returned::of("velocity_offset", model.velocity_offset(state).as_slice()),
        Returned::of("speeds", &written(M::SPEEDS.len(), |values| model.speeds(state, values)).1),
        Returned::of("assumptions", &assumptions(model, state)),
    ];
    if M::ROWS.is_empty() {
        all.push(Returned::of("powers", &written(M::POWERS.len(), |values| model.powers(state, values)).1));
        if let Ok(accelerations) = model.accelerations(state) {
            all.push(Returned::of("accelerations", accelerations.as_slice()));
            all.extend(followed(model, state, accelerations.as_slice(), &[]));
        }
    } else {
        all.extend(of_constraints(model, state));
    }
    all.retain(|returned| !returned.values.is_empty());
    all
}

fn assumptions<M: OpenLive>(model: &M, state: &M::State) -> Vec<f64> {
    let mut all = Vec::new();
    model.assumptions(state, &mut |values| all.extend(values));
    all
}

/// What depends on accelerations and reactions.
fn followed<M: OpenLive>(model: &M, state: &M::State, a: &[f64], lambda: &[f64]) -> Vec<Returned> {
    let outputs = written(M::OUTPUTS.len(), |values| model.outputs(state, values));
    let events = written(M::EVENTS.len(), |values| model.events(state, values));
    let made = [("outputs", outputs), ("events", events)].into_iter();
    made.filter(|(_, (done, _))| done.is_ok())
        .map(|(name, (_, values))| Returned::of(name, &values).from(a, lambda))
        .collect()
}

fn of_constraints<M: OpenLive>(model: &M, state: &M::State) -> Vec<Returned> {
    let (n, rows) = (M::COORDINATES.len(), M::ROWS.len());
    let jacobian = model.jacobian(state);
    let by_rows: Vec<f64> =
        (0..rows).flat_map(|i| (0..n).map(move |j| (i, j))).map(|place| jacobian[place]).collect();
    let mut all = vec![Returned::of("jacobian", &by_rows)];
    let [mut mass, mut force, mut terms_jacobian, mut gamma] =
        [n * n, n, rows * n, rows].map(|count| vec![f64::NAN; count]);
    model.terms(
        state,
        &mut Terms { mass: &mut mass, force: &mut force, jacobian: &mut terms_jacobian, gamma: &mut gamma },
    );
    all.push(Returned::of("terms", &[mass, force, terms_jacobian, gamma].concat()));
    let Ok(constants) = model.constants() else { return all };
    if let Some(solved) = model.solve_unrolled(&constants, state) {
        let (a, lambda) = (solved.accelerations.as_slice(), solved.multipliers.as_slice());
        all.push(Returned::of("accelerations", &[a, lambda].concat()));
        all.extend(followed(model, state, a, lambda));
    }
    let mut right = M::Rows::zeros();
    right.as_mut_slice().iter_mut().enumerate().for_each(|(i, x)| *x = 0.1 + 0.7 * i as f64);
    if let Some(change) = model.correct_unrolled(&constants, state, &right) {
        all.push(Returned::of("correction", change.as_slice()).from(&[], right.as_slice()));
    }
    all
}

/// The energies of a model that has them.
pub(crate) fn energies<M: OpenLive + Energies>(model: &M, state: &M::State) -> Vec<Returned> {
    let [kinetic, potential] = [model.kinetic_energy(state), model.potential_energy(state)];
    vec![Returned::of("kinetic_energy", &[kinetic]), Returned::of("potential_energy", &[potential])]
}

/// Nothing besides what every model has.
pub(crate) fn alone<M: OpenLive>(_: &M, _: &M::State) -> Vec<Returned> {
    Vec::new()
}

/// The smooth functions of a model, as pages have them.
fn functions<M: OpenLive>(model: &M) -> String {
    let pieces = model.pieces().into_iter().map(|pieces| {
        let Pieces { knots, coefficients, outside } = pieces.unwrap();
        let outside = format!("{outside:?}").to_lowercase();
        format!("{{ knots: {knots:?}, coefficients: {coefficients:?}, outside: \"{outside}\" }}")
    });
    format!("{{ functions: [{}] }}", pieces.collect::<Vec<_>>().join(", "))
}

/// What a program is given at each state, and what it returns in Rust.
type Calls = (Vec<[Vec<f64>; 7]>, Vec<Vec<f64>>);

/// Compares all programs of a model at random states; the number of comparisons.
pub(crate) fn compare<M: OpenLive>(model: &M, besides: fn(&M, &M::State) -> Vec<Returned>) -> usize {
    let parameters: Vec<f64> = (0..M::PARAMETERS.len()).map(|i| model.parameter(i).unwrap()).collect();
    // Random states fulfil no constraints: no page would begin there.
    let engine = Engine::with_data::<M>(&functions(model));
    let mut calls: BTreeMap<&str, Calls> = BTreeMap::new();
    for s in random_states::<M>() {
        let modes: Vec<f64> = (0..M::CONSTRAINTS.len()).map(|i| s.active_set().side(i)).collect();
        let [q, u, w] = [s.q().as_slice(), s.u().as_slice(), s.inputs().as_slice()].map(<[f64]>::to_vec);
        for Returned { name, given: [a, l], values } in [expected(model, &s), besides(model, &s)].concat() {
            let (given, returned) = calls.entry(name).or_default();
            given.push([vec![s.t()], q.clone(), u.clone(), w.clone(), modes.clone(), a, l]);
            returned.push(values);
        }
    }
    let mut compared = 0;
    for (name, (given, returned)) in calls {
        let found = engine.evaluate(name, &parameters, &given);
        for ((values, found), given) in returned.iter().zip(&found).zip(&given) {
            for (i, (value, found)) in values.iter().zip(found).enumerate() {
                let same = value.to_bits() == found.to_bits() || value.is_nan() && found.is_nan();
                let model = M::NAME;
                assert!(same, "{model} {name}[{i}]: {value:e} in Rust, {found:e} in JavaScript, {given:?}");
                compared += 1;
            }
            assert!(values.len() <= found.len(), "{} {name}: {found:?} for {values:?}", M::NAME);
        }
        eprintln!("{} {name}: {} states", M::NAME, found.len());
    }
    compared
}
