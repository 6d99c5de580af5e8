//! The one part of the judge that is compiled for every model.

use dynamics::constrain::solve_once;
use dynamics::model::{
    ConstraintKind, Constraints, Coordinates, Events, Linearize, ModelState, Outputs, Parameters, Powers,
    State, Vector,
};

use crate::states::Point;
use crate::{Emitted, Own, Shape, Slopes, Subject};

/// A derived model with its glue.
pub struct Derived<M: dynamics::model::Model> {
    pub model: M,
    pub own: fn(&M, &Coordinates<M>, &mut Own),
    pub slopes: Option<SlopesOf<M>>,
    pub report: &'static str,
    pub interpreted: &'static str,
}

/// Derivatives of the accelerations of a model.
pub type SlopesOf<M> = fn(&M, &Point) -> Option<Slopes>;

/// Finds them, as a method that a model with Jacobians has before it is borrowed once more.
pub struct Find<M>(pub fn() -> M);

/// Models with Jacobians.
pub trait WithJacobians<M> {
    fn slopes(&self) -> Option<SlopesOf<M>>;
}
impl<M: Linearize + Parameters> WithJacobians<M> for Find<M> {
    fn slopes(&self) -> Option<SlopesOf<M>> {
        Some(slopes)
    }
}

/// All models: Jacobians that would be too large, or that friction by reactions does not have, are left out.
pub trait Without<M> {
    fn slopes(&self) -> Option<SlopesOf<M>>;
}
impl<M> Without<M> for &Find<M> {
    fn slopes(&self) -> Option<SlopesOf<M>> {
        None
    }
}

fn slopes<M: Linearize + Parameters>(model: &M, at: &Point) -> Option<Slopes> {
    let s = &state::<M>(at);
    let n = M::COORDINATES.len();
    let by_state = model.state_jacobian(s).ok()?;
    let by_input = model.input_jacobian(s).ok()?;
    let by_parameter = model.parameter_jacobian(s).ok()?;
    Some(Slopes {
        by_q: matrix(n, n, &|ij| by_state.by_q[ij]),
        by_u: matrix(n, n, &|ij| by_state.by_u[ij]),
        by_input: matrix(n, M::INPUTS.len(), &|ij| by_input[ij]),
        by_parameter: matrix(n, M::PARAMETERS.len(), &|ij| by_parameter[ij]),
    })
}

fn vector<V: Vector>(values: &[f64]) -> V {
    let mut v = V::zeros();
    v.as_mut_slice().copy_from_slice(values);
    v
}

fn state<M: dynamics::model::Model>(at: &Point) -> State<M> {
    ModelState::new(at.t, vector(&at.q), vector(&at.u), vector(&at.inputs))
}

fn matrix(rows: usize, columns: usize, entry: &dyn Fn((usize, usize)) -> f64) -> Vec<f64> {
    (0..rows * columns).map(|k| entry((k / columns, k % columns))).collect()
}

impl<M> Subject for Derived<M>
where
    M: Parameters + Constraints + Powers + Outputs + Events + Clone,
{
    fn shape(&self) -> Shape {
        let holonomic =
            M::CONSTRAINTS.iter().filter(|c| c.kind == ConstraintKind::Holonomic).map(|c| c.rows).sum();
        Shape {
            coordinates: M::COORDINATES.len(),
            inputs: M::INPUTS.len(),
            parameters: M::PARAMETERS.len(),
            holonomic,
            rows: M::ROWS.len(),
            outputs: M::OUTPUTS.iter().map(|o| o.name).collect(),
            events: M::EVENTS.len(),
            powers: M::POWERS.iter().map(|p| p.name).collect(),
        }
    }

    fn emitted(&self, at: &Point) -> Emitted {
        let (model, s) = (&self.model, &state::<M>(at));
        let (n, rows) = (M::COORDINATES.len(), M::ROWS.len());
        let mass = model.mass_matrix(s);
        let jacobian = model.jacobian(s);
        let mut emitted = Emitted {
            solved: Err(String::new()),
            mass: matrix(n, n, &|ij| mass[ij]),
            force: model.generalized_force(s).as_slice().to_vec(),
            momenta: model.momenta(s).as_slice().to_vec(),
            energy: model.energy_function(s),
            powers: vec![f64::NAN; M::POWERS.len()],
            outputs: vec![f64::NAN; M::OUTPUTS.len()],
            events: vec![f64::NAN; M::EVENTS.len()],
            residual: model.residual(s).as_slice().to_vec(),
            rates: model.velocity_residual(s).as_slice().to_vec(),
            jacobian: matrix(rows, n, &|ij| jacobian[ij]),
            gamma: model.gamma(s).as_slice().to_vec(),
        };
        emitted.solved = match model.accelerations(s) {
            Err(error) => Err(error.to_string()),
            Ok(a) if rows == 0 => Ok((a.as_slice().to_vec(), Vec::new())),
            Ok(a) => match model.constants().map(|constants| solve_once(model, &constants, s)) {
                Ok(Ok(solved)) => Ok((a.as_slice().to_vec(), solved.multipliers.as_slice().to_vec())),
                Ok(Err(error)) => Err(error.to_string()),
                Err(error) => Err(error.to_string()),
            },
        };
        model.powers(s, &mut emitted.powers);
        if emitted.solved.is_ok() {
            let outputs = model.outputs(s, &mut emitted.outputs).err().map(|e| format!("outputs: {e}"));
            let events = model.events(s, &mut emitted.events).err().map(|e| format!("events: {e}"));
            if let Some(error) = outputs.or(events) {
                emitted.solved = Err(error);
            }
        }
        emitted
    }

    fn slopes(&self, at: &Point) -> Option<Slopes> {
        self.slopes.and_then(|slopes| slopes(&self.model, at))
    }

    fn has_jacobians(&self) -> (bool, bool) {
        (self.slopes.is_some(), !self.report.lines().any(|line| line.starts_with("Jacobians ")))
    }

    fn with_parameter(&self, at: &Point, index: usize, by: f64) -> Option<Vec<f64>> {
        let value = self.model.parameter(index)?;
        let changed = self.model.with_parameter(index, value + by)?;
        changed.accelerations(&state::<M>(at)).ok().map(|a| a.as_slice().to_vec())
    }

    fn interpreted(&self) -> &'static str {
        self.interpreted
    }

    fn own(&self, at: &Point, accelerations: &[f64], multipliers: &[f64]) -> Own {
        let mut own = Own::default();
        let q = M::coordinates_with(&state::<M>(at), &vector(accelerations), multipliers);
        (self.own)(&self.model, &q, &mut own);
        own
    }
}
