//! The gradient of one number of a motion by all parameters and the whole start: adjoint equations.
//!
//! The objective is a sum of values at instants, squares of differences from data, and integrals along the
//! motion,
//!
//! ```text
//! J = Σ gₖ(y(tₖ), p) + ∫ ℓ(y, p, t) dt        y = (q, q̇),  ẏ = f(y, p, t)
//! ```
//!
//! and with f_y = A, f_p = b (those of the variational equations, `sensitivity.rs`) the adjoint variable λ,
//! 2N, is integrated backward along the motion, once for all variables:
//!
//! ```text
//! λ̇ = −Aᵀλ − ℓ_yᵀ        λ(T) = 0,  λ jumps by ∂gₖ/∂y at tₖ
//! dJ/dp = λ(0)ᵀ ∂y(0)/∂p + ∫ (λᵀb + ℓ_p) dt + Σ ∂gₖ/∂p
//! ```
//!
//! (Y. Cao, S. Li, L. Petzold & R. Serban, SIAM J. Sci. Comput. 24 (2003) 1076). The variational equations
//! have one column for each variable. The adjoint equations have one column in all, and one product for each
//! parameter at every node. Steps, order and tolerance are those of the variational equations.
//!
//! With constraints, variations are projected onto the tangent space at the ends of the motion's steps, x →
//! P x − c. The adjoint of this is λ → Pᵀλ, and dJ/dp is reduced by λᵀc.
//!
//! If an integrated output has a corner, for example because it saturates, ℓ_y jumps. Corners are located,
//! and steps end there (`corners.rs`).
//!
//! If velocities or accelerations jump, λ jumps too, because the instant of the jump moves with the
//! parameters. Such motions are refused. Integrals of outputs that jump are refused, and also motions that an
//! event ends early, because their ends move with the parameters.

mod adjoint;
mod corners;
mod objective;
mod show;

use alloc::borrow::ToOwned;
use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::model::{Parameters, Vector};
use dynamics_runtime::simulate::{Motion, Simulate, Simulation};

use objective::{ParsedObjective, Term};

use super::sensitivity::{DEFAULT_TOLERANCE, SensitivityRequest, SensitivityRunSetup};
use super::sensitivity_error::SensitivityError;
use super::variable::Variable;

/// One number of a motion (the objective), before it and its gradient are computed.
///
/// ```text
/// let found = model
///     .objective(start)
///     .end("x", 1.0)                    // 1 · x(T)
///     .integral("power", 0.2)           // + 0.2 ∫ power dt
///     .squares("theta", 1.0, measured)  // + Σ (theta(t) − value)²
///     .until(10.0)
///     .run()?;
/// println!("{found}");                  // its value, and the derivative by every parameter and start
/// ```
#[must_use = "an objective is not evaluated until `.run()`"]
pub struct Objective<'m, M: Simulate> {
    model: &'m M,
    start: M::State,
    terms: Vec<Term>,
    names: Vec<String>,
    end: Option<f64>,
    tolerance: f64,
    options: Option<SensitivityRunSetup<'m, M>>,
}

impl<'m, M: Simulate + Parameters + Clone> Objective<'m, M> {
    pub(super) fn new(model: &'m M, start: M::State) -> Self {
        let (terms, names) = (Vec::new(), Vec::new());
        Self { model, start, terms, names, end: None, tolerance: DEFAULT_TOLERANCE, options: None }
    }

    /// Adds `weight` times an output, a coordinate or a velocity at the end.
    pub fn end(mut self, quantity: &str, weight: f64) -> Self {
        self.terms.push(Term::End { quantity: quantity.to_owned(), weight });
        self
    }

    /// Adds `weight` times an output, a coordinate or a velocity at a time.
    pub fn at(mut self, time: f64, quantity: &str, weight: f64) -> Self {
        self.terms.push(Term::At { quantity: quantity.to_owned(), weight, time });
        self
    }

    /// Adds `weight` times the integral of an output, a coordinate or a velocity over the time of the motion.
    /// Outputs with corners are allowed, outputs that jump are refused.
    pub fn integral(mut self, quantity: &str, weight: f64) -> Self {
        self.terms.push(Term::Integral { quantity: quantity.to_owned(), weight });
        self
    }

    /// Adds `weight` Σ (f(t) − value)² over points (t, value) of an output, a coordinate or a velocity: χ²
    /// where the weight is 1/σ².
    pub fn squares(
        mut self,
        quantity: &str,
        weight: f64,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        let points = points.into_iter().collect();
        self.terms.push(Term::Squares { quantity: quantity.to_owned(), weight, points });
        self
    }

    /// Parameters, coordinates and velocities of the start, by which it is differentiated; without this by
    /// all of them.
    pub fn by<S: AsRef<str>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.names.extend(names.into_iter().map(|name| name.as_ref().to_owned()));
        self
    }

    /// End time; may lie before the start.
    pub fn until(mut self, t: f64) -> Self {
        self.end = Some(t);
        self
    }

    /// Permitted local error per step of the motion and of the adjoint equations; for the latter relative to
    /// the largest value so far. Default 1e-9. For the motion it is absolute and relative. If the whole
    /// motion stays below 0.1, the absolute one is multiplied by its size. If only a part of it is that
    /// small, use `.with(|s| s.tolerances(absolute, relative))`.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Options of the simulation, as for [`Sensitivity::with`](super::Sensitivity::with).
    pub fn with(
        mut self,
        options: impl Fn(Simulation<'_, M>) -> Simulation<'_, M> + Send + Sync + 'm,
    ) -> Self {
        self.options = Some(Box::new(options));
        self
    }

    /// Runs the motion, then the adjoint equations back along it.
    ///
    /// # Errors
    /// Names that are none, weights and points that are no numbers or lie outside the motion; a motion that
    /// fails, or that an event ends; forces that depend on reactions; jumps; a model without derivatives.
    pub fn run(self) -> Result<Gradient<'m, M>, SensitivityError> {
        if M::FRICTION {
            return Err(SensitivityError::Friction);
        }
        let variables = self.variables()?;
        let end = self.end.ok_or(SensitivityError::NoEnd)?;
        let plan = ParsedObjective::of::<M>(&self.terms, end)?;
        let request = SensitivityRequest {
            variables: &variables,
            end,
            tolerance: self.tolerance,
            absolute: None,
            times: None,
        };
        let options = self.options.as_deref().map(|options| options as &dyn Fn(_) -> _);
        let motion = request.motion(self.model, self.start, options)?;
        if motion.end_time() != end {
            return Err(SensitivityError::EndsBefore { time: motion.end_time(), end });
        }
        let found = adjoint::integrate_backward(&motion, &variables, &plan, self.tolerance)?;
        let (value, derivatives, steps, exact) = (found.value, found.derivatives, found.steps, found.exact);
        Ok(Gradient { motion, value, variables, derivatives, exact, steps })
    }

    fn variables(&self) -> Result<Vec<Variable>, SensitivityError> {
        if self.names.is_empty() {
            let n = M::Vector::LEN;
            let parameters = (0..M::PARAMETERS.len()).map(Variable::Parameter);
            let starts = (0..n).map(Variable::Position).chain((0..n).map(Variable::Velocity));
            return Ok(parameters.chain(starts).collect());
        }
        Ok(Variable::all_of::<M>(&self.names)?)
    }
}

/// An objective and its derivatives.
pub struct Gradient<'m, M: Simulate> {
    /// The motion.
    pub motion: Motion<'m, M>,
    /// J.
    pub value: f64,
    variables: Vec<Variable>,
    derivatives: Vec<f64>,
    /// Whether no differences entered: those of outputs by parameters are, good to about 10 digits, as are
    /// those of outputs made of reactions; those of equations and laws as for
    /// [`Sensitivities::exact`](super::Sensitivities::exact).
    pub exact: bool,
    /// Steps that the adjoint equations took.
    pub steps: usize,
}

impl<M: Simulate + Parameters + Clone> Gradient<'_, M> {
    /// The variables by which it was differentiated: those of [`Objective::by`], or all parameters, then all
    /// coordinates and velocities of the start.
    #[must_use]
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// dJ/d(variables), in their order, in the unit of J by that of each.
    #[must_use]
    pub fn derivatives(&self) -> &[f64] {
        &self.derivatives
    }

    /// dJ/d`name`. With constraints, other coordinates move with an element of the start, by the smallest
    /// correction measured by M.
    ///
    /// # Errors
    /// Names that are none, or were not asked for.
    pub fn get(&self, name: &str) -> Result<f64, SensitivityError> {
        let variable = Variable::of::<M>(name)?;
        let index = self.variables.iter().position(|v| *v == variable);
        let index = index.ok_or_else(|| SensitivityError::NotAsked { name: name.to_owned() })?;
        Ok(self.derivatives[index])
    }
}
