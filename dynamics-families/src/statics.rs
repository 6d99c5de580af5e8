//! Equilibria: Q(q, 0) = 0 by Newton's method with a line search.
//!
//! K Δq = Q is solved with the banded tangent. A step is halved until √Σ Qᵢ²/mᵢ falls. Whether the
//! equilibrium is stable is counted: the pivots of K = L D Lᵀ have the signs of its eigenvalues (Sylvester).
//!
//! With constraints all positions are moved onto them, and Q contains the reactions that make the
//! accelerations at rest smallest: those of the motion that would begin there.

use dynamics_runtime::simulate::OptionError;

use crate::constraints::Rows;
use crate::error::FamilyError;
use crate::failure::{FamilyErrorKind, check_state};
use crate::mass::{Mass, coordinate_name};
use crate::model::{FamilyModel, FamilyState, Sizes, View};
use crate::tangent::{Coefficients, Tangent};

/// Most corrections.
const MOST_ITERATIONS: u32 = 100;
/// Most halvings of a correction.
const MOST_HALVINGS: u32 = 40;
/// The last correction, in parts of the displacement.
const ACCURACY: f64 = 1e-13;
/// Corrections below this that make Q no smaller are rounding.
const ROUNDING: f64 = 1e-7;

/// An equilibrium.
#[derive(Clone, Debug, PartialEq)]
pub struct FamilyEquilibrium<S> {
    /// The state, at rest.
    pub state: S,
    /// How many independent displacements the stiffness drives away: negative pivots of K. `None` where K is
    /// not symmetric: its pivots then say nothing.
    pub unstable: Option<usize>,
    /// Whether a displacement is neutral to rounding, as at a buckling load.
    pub neutral: bool,
    /// Corrections that were made.
    pub iterations: u32,
}

impl<S> FamilyEquilibrium<S> {
    /// Whether every displacement is driven back; `None` where that is not known.
    #[must_use]
    pub fn is_stable(&self) -> Option<bool> {
        if self.neutral { None } else { self.unstable.map(|unstable| unstable == 0) }
    }
}

/// Forces at rest, with the reactions of constraints.
struct AtRest<'a, M: FamilyModel> {
    model: &'a M,
    t: f64,
    inputs: &'a [f64],
    rest: Vec<f64>,
    constraints: Option<(Mass, Rows)>,
    a: Vec<f64>,
}

impl<'a, M: FamilyModel> AtRest<'a, M> {
    fn new(model: &'a M, guess: &'a M::State, ends: &Sizes) -> Result<Self, FamilyErrorKind> {
        let n = guess.q().len();
        let constraints = if M::ROWS.is_empty() {
            None
        } else {
            let mass =
                Mass::new(model, ends).map_err(|problem| FamilyErrorKind::of_mass::<M>(problem, ends))?;
            Rows::of_model(model, &mass, ends)?.map(|rows| (mass, rows))
        };
        let rest = vec![0.0; n];
        Ok(Self { model, t: guess.t(), inputs: guess.inputs(), a: rest.clone(), rest, constraints })
    }

    fn view<'v>(&'v self, q: &'v [f64]) -> View<'v> {
        View { t: self.t, q, u: &self.rest, inputs: self.inputs }
    }

    fn rows(&self) -> Option<&Rows> {
        self.constraints.as_ref().map(|(_, rows)| rows)
    }

    /// Q at a position, which is moved onto the constraints before.
    fn forces(&mut self, q: &mut [f64], forces: &mut [f64]) -> Result<(), FamilyErrorKind> {
        if let Some((mass, rows)) = &mut self.constraints {
            // Moving constraints give velocities, which are none of an equilibrium's.
            self.a.fill(0.0);
            rows.project(self.model, self.t, q, &mut self.a, self.inputs)?;
            let at = View { t: self.t, q, u: &self.rest, inputs: self.inputs };
            rows.solve_at(self.model, mass, at, &mut self.a)?;
        }
        self.model.forces(View { t: self.t, q, u: &self.rest, inputs: self.inputs }, forces);
        if let Some((_, rows)) = &self.constraints {
            rows.add_reactions(forces);
        }
        Ok(())
    }
}

/// The equilibrium that Newton's method finds from a guess.
pub(crate) fn equilibrium<M: FamilyModel>(
    model: &M,
    guess: &M::State,
) -> Result<FamilyEquilibrium<M::State>, FamilyError<M>> {
    let failed = |kind: FamilyErrorKind| FamilyError::before(kind, guess.t());
    let ends = model.ends().map_err(|error| failed(error.into()))?;
    check_state::<M>(guess, &ends).map_err(failed)?;
    if let Some(input) = guess.inputs().iter().position(|input| !input.is_finite()) {
        return Err(failed(OptionError::InputWithoutValue { input: M::INPUTS[input].name }.into()));
    }
    let n = guess.q().len();
    let mut at_rest = AtRest::new(model, guess, &ends).map_err(failed)?;
    let mut q = guess.q().to_vec();
    let (mut forces, mut trial, mut of_trial) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    at_rest.forces(&mut q, &mut forces).map_err(failed)?;
    let mut tangent = Tangent::new(model, at_rest.view(&q), &ends, at_rest.rows()).map_err(failed)?;
    let weights = Coefficients { mass: 0.0, damping: 0.0, stiffness: 1.0 };
    let mut step = vec![0.0; n + tangent.rows];
    let mut iterations = 0;
    let not_solved = |by: &[f64]| {
        let largest = (0..n).fold(0, |best, i| if by[i].abs() > by[best].abs() { i } else { best });
        failed(FamilyErrorKind::NotSolved { coordinate: coordinate_name::<M>(&ends, largest) })
    };
    loop {
        if let Some(unknown) = forces.iter().position(|force| !force.is_finite()) {
            let coordinate = coordinate_name::<M>(&ends, unknown);
            return Err(failed(FamilyErrorKind::AccelerationNotFinite { coordinate }));
        }
        tangent.assemble(model, at_rest.view(&q), weights, at_rest.rows()).map_err(failed)?;
        let size = merit(&forces, &tangent.diagonal);
        if size == 0.0 {
            break;
        }
        step[..n].copy_from_slice(&forces);
        step[n..].fill(0.0);
        tangent.factor::<M>(&ends).map_err(failed)?;
        tangent.solve(&mut step);
        iterations += 1;
        if iterations > MOST_ITERATIONS {
            return Err(not_solved(&step));
        }
        let mut part = 1.0;
        let mut halvings = 0;
        let shrinks = loop {
            trial.iter_mut().zip(q.iter().zip(&step)).for_each(|(new, (q, step))| *new = q + part * step);
            let evaluated = at_rest.forces(&mut trial, &mut of_trial);
            if evaluated.is_ok() && merit(&of_trial, &tangent.diagonal) < size {
                break true;
            }
            if halvings == MOST_HALVINGS {
                break false;
            }
            halvings += 1;
            part *= 0.5;
        };
        let (moved, scale) = (tangent.norm(&step[..n]), tangent.norm(&trial));
        if !shrinks {
            if moved <= ROUNDING * scale {
                // Multipliers belong to the trial.
                at_rest.forces(&mut q, &mut forces).map_err(failed)?;
                break;
            }
            return Err(not_solved(&step));
        }
        core::mem::swap(&mut q, &mut trial);
        core::mem::swap(&mut forces, &mut of_trial);
        if halvings == 0 && moved <= ACCURACY * scale {
            break;
        }
    }
    tangent.assemble(model, at_rest.view(&q), weights, at_rest.rows()).map_err(failed)?;
    let inertia = tangent.inertia();
    let (t, inputs) = (guess.t(), guess.inputs().to_vec());
    Ok(FamilyEquilibrium {
        state: M::State::new(t, q, vec![0.0; n], inputs, ends),
        unstable: inertia.map(|(negative, _)| negative),
        neutral: inertia.is_some_and(|(_, singular)| singular),
        iterations,
    })
}

/// √Σ Qᵢ²/mᵢ; NaN where a force is not finite, which is smaller than nothing.
fn merit(forces: &[f64], masses: &[f64]) -> f64 {
    crate::generated::sum(0..forces.len(), |i| forces[i] * forces[i] / masses[i]).sqrt()
}
