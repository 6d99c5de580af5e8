//! Programs in JavaScript have the bits of the Rust programs, at random states: those that move a model, its
//! energies and powers, and what its constraints say.

use dynamics::live::OpenLive;
use dynamics::model::{ModelState, Vector};
use dynamics::smooth::Pieces;

use crate::engine::Engine;
use crate::random_states::random_states;

/// What the Rust programs return at a state, by the names that the programs have in JavaScript.
fn expected<M: OpenLive>(model: &M, state: &M::State) -> Vec<(&'static str, Vec<f64>)> {
    let written = |count: usize, write: &dyn Fn(&mut [f64])| {
        let mut values = vec![f64::NAN; count];
        write(&mut values);
        values
    };
    let mut all = vec![
        ("energy_function", vec![model.energy_function(state)]),
        ("conserved", written(M::CONSERVED.len(), &|values| model.conserved(state, values))),
        ("residual", model.residual(state).as_slice().to_vec()),
        ("velocity_residual", model.velocity_residual(state).as_slice().to_vec()),
        ("velocity_offset", model.velocity_offset(state).as_slice().to_vec()),
    ];
    if M::ROWS.is_empty() {
        all.push(("powers", written(M::POWERS.len(), &|values| model.powers(state, values))));
        if let Ok(accelerations) = model.accelerations(state) {
            all.push(("accelerations", accelerations.as_slice().to_vec()));
        }
    } else if let Ok(constants) = model.constants()
        && let Some(solved) = model.solve_unrolled(&constants, state)
    {
        let (a, lambda) = (solved.accelerations.as_slice(), solved.multipliers.as_slice());
        all.push(("accelerations", [a, lambda].concat()));
    }
    all.retain(|(_, values)| !values.is_empty());
    all
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

/// Compares all programs of a model at random states; the number of comparisons.
pub(crate) fn compare<M: OpenLive>(model: &M) -> usize {
    let parameters: Vec<f64> = (0..M::PARAMETERS.len()).map(|i| model.parameter(i).unwrap()).collect();
    let states = random_states::<M>();
    // Random states fulfil no constraints: no page would begin there.
    let engine = Engine::with_data::<M>(&functions(model));
    let mut names: Vec<&str> = Vec::new();
    for state in &states {
        for (name, _) in expected(model, state) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
    }
    let mut compared = 0;
    for name in names {
        let given: Vec<[Vec<f64>; 5]> = states
            .iter()
            .map(|s| {
                let modes = (0..M::CONSTRAINTS.len()).map(|i| s.active_set().side(i)).collect();
                let vectors = [s.q().as_slice(), s.u().as_slice(), s.inputs().as_slice()];
                let [q, u, w] = vectors.map(<[f64]>::to_vec);
                [vec![s.t()], q, u, w, modes]
            })
            .collect();
        let found = engine.evaluate(name, &parameters, &given);
        for (state, found) in states.iter().zip(&found) {
            let all = expected(model, state);
            let Some((_, values)) = all.iter().find(|(other, _)| *other == name) else { continue };
            for (i, (value, found)) in values.iter().zip(found).enumerate() {
                let same = value.to_bits() == found.to_bits() || value.is_nan() && found.is_nan();
                assert!(
                    same,
                    "{} {name}[{i}]: {value:e} in Rust, {found:e} in JavaScript, {state:?}",
                    M::NAME
                );
                compared += 1;
            }
        }
    }
    compared
}
