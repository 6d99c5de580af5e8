//! Evaluations of a model at many states.

use dynamics::constrain::{set_sides, solve_once};
use dynamics::lanes::{Lanes, Task, Wide as _, in_four_lanes};
use dynamics::model::{LaneEvaluation, Model, ModelState as _, SharedValues, Vector, WideOf};

use crate::arrays::Rows;
use crate::data::{Evaluation, vector};
use crate::erased::States;
use crate::python_model::PythonModel;

/// Values at states, row by row, and the shape of a row.
pub(crate) fn evaluate<M: PythonModel>(
    model: &M,
    what: Evaluation,
    at: &States,
) -> Result<(Vec<f64>, Vec<usize>), String> {
    let shape = shape::<M>(what);
    let constants = model.constants().map_err(|error| error.to_string())?;
    let mut values = Vec::with_capacity(at.count * shape.iter().product::<usize>());
    let together = M::HAS_LANES && what == Evaluation::Accelerations && at.inputs.count.is_none();
    // A constraint may be released to another side in every row.
    let together = together && at.active_set.all_hold();
    if together && at.count > 1 {
        in_four_lanes(Together { model, constants: &constants, at, values: &mut values });
    }
    // The other rows, from where a state is not like those beside it.
    for row in values.len() / shape.iter().product::<usize>().max(1)..at.count {
        let state = state::<M>(model, at, row);
        one(model, &constants, what, &state, &mut values)
            .map_err(|error| if at.q.count.is_some() { format!("row {row}: {error}") } else { error })?;
    }
    Ok((values, shape))
}

/// Accelerations of several states side by side, with the bits of one by one. Ends before states to which
/// this does not apply, and before the last ones that do not fill all lanes.
struct Together<'a, M: PythonModel> {
    model: &'a M,
    constants: &'a M::Constants,
    at: &'a States,
    values: &'a mut Vec<f64>,
}

impl<M: PythonModel> Task for Together<'_, M> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { model, constants, at, values } = self;
        let (n, shared) = (<M as Model>::Vector::LEN, state::<M>(model, at, 0));
        let (mut numbers, mut stored) = (vec![0.0; L::COUNT], vec![0.0; L::COUNT]);
        let mut load = |rows: &Rows, width: usize, first: usize, i: usize| {
            let of = |lane: usize| rows.row(first + lane, width)[i];
            numbers.iter_mut().enumerate().for_each(|(lane, number)| *number = of(lane));
            L::load(&numbers)
        };
        for first in (0..at.count + 1 - L::COUNT.min(at.count + 1)).step_by(L::COUNT) {
            let [mut q, mut u, mut accelerations] = [WideOf::<M, L>::zeros(); 3];
            for i in 0..n {
                q.as_mut_slice()[i] = load(&at.q, n, first, i);
                u.as_mut_slice()[i] = load(&at.u, n, first, i);
            }
            let found = L::call(LaneEvaluation {
                model,
                constants,
                state: &shared,
                values: SharedValues,
                t: load(&at.t, 1, first, 0),
                states: [&q, &u],
                accelerations: &mut accelerations,
            });
            if !found {
                return;
            }
            let from = values.len();
            values.resize(from + n * L::COUNT, 0.0);
            for i in 0..n {
                accelerations.as_slice()[i].store(&mut stored);
                for (lane, value) in stored.iter().enumerate() {
                    values[from + lane * n + i] = *value;
                }
            }
        }
    }
}

fn state<M: PythonModel>(model: &M, at: &States, row: usize) -> M::State {
    let (n, m) = (<M as Model>::Vector::LEN, M::Inputs::LEN);
    let mut state = M::State::new(
        at.t.row(row, 1)[0],
        vector(at.q.row(row, n)),
        vector(at.u.row(row, n)),
        vector(at.inputs.row(row, m)),
    );
    *state.active_set_mut() = at.active_set;
    set_sides(model, &mut state, at.sided);
    state
}

/// The lengths of the dimensions of a value.
fn shape<M: PythonModel>(what: Evaluation) -> Vec<usize> {
    let (n, rows) = (M::COORDINATES.len(), M::ROWS.len());
    match what {
        Evaluation::Energy => Vec::new(),
        Evaluation::Accelerations | Evaluation::GeneralizedForce | Evaluation::Momenta => vec![n],
        Evaluation::MassMatrix => vec![n, n],
        Evaluation::Derivatives => vec![2, n, n],
        Evaluation::Conserved => vec![M::CONSERVED.len()],
        Evaluation::Outputs => vec![M::OUTPUTS.len()],
        Evaluation::Multipliers | Evaluation::VelocityResidual => vec![rows],
        Evaluation::Residual => vec![M::Residual::LEN],
        Evaluation::Jacobian => vec![rows, n],
    }
}

/// Appends the value at one state.
fn one<M: PythonModel>(
    model: &M,
    constants: &M::Constants,
    what: Evaluation,
    state: &M::State,
    values: &mut Vec<f64>,
) -> Result<(), String> {
    let n = M::COORDINATES.len();
    match what {
        Evaluation::Accelerations => {
            let accelerations =
                model.accelerations_with(constants, state).map_err(|error| error.to_string())?;
            values.extend(accelerations.as_slice());
        }
        Evaluation::MassMatrix => {
            let mass = model.mass_matrix(state);
            values.extend((0..n).flat_map(|i| (0..n).map(move |j| mass[(i, j)])));
        }
        Evaluation::GeneralizedForce => values.extend(model.generalized_force(state).as_slice()),
        Evaluation::Momenta => values.extend(model.momenta(state).as_slice()),
        Evaluation::Energy => values.push(model.energy_function(state)),
        Evaluation::Conserved => model.conserved(state, added(values, M::CONSERVED.len())),
        Evaluation::Outputs => {
            model.outputs(state, added(values, M::OUTPUTS.len())).map_err(|error| error.to_string())?;
        }
        Evaluation::Multipliers => {
            let solved = solve_once(model, constants, state).map_err(|error| error.to_string())?;
            values.extend(solved.multipliers.as_slice());
        }
        Evaluation::Residual => values.extend(model.residual(state).as_slice()),
        Evaluation::VelocityResidual => values.extend(model.velocity_residual(state).as_slice()),
        Evaluation::Jacobian => {
            let jacobian = model.jacobian(state);
            let rows = M::ROWS.len();
            values.extend((0..rows).flat_map(|i| (0..n).map(move |j| jacobian[(i, j)])));
        }
        Evaluation::Derivatives => {
            let (by_q, by_u) = added(values, 2 * n * n).split_at_mut(n * n);
            if !model.acceleration_derivatives(state, by_q, by_u) {
                return Err(format!("the exact derivatives of `{}` do not exist, or have no code", M::NAME));
            }
        }
    }
    Ok(())
}

/// So many zeros at the end, to be written.
fn added(values: &mut Vec<f64>, count: usize) -> &mut [f64] {
    let from = values.len();
    values.resize(from + count, 0.0);
    &mut values[from..]
}
