//! The right-hand side as the integrators see it: the traits of `integrate/system.rs`, one `impl` each.
//!
//! [`Accelerations`] evaluates q̇ and q̈, [`Stabilized`] projects, [`Switching`] holds branches,
//! [`Canonical`] gives momenta and [`Expandable`] Taylor series. All work is done in `right_hand_side.rs` and
//! [`crate::simulate::stabilization`].

use crate::constrain::rank_margin::gradient_condition;
use crate::integrate::{
    Accelerations, BranchHold, Canonical, Expandable, Phase, ProjectedEnd, Stabilized, Stages, StepNode,
    Switching, Tolerances, by_state, one_by_one, zip,
};
use crate::lanes::Lanes;
use crate::model::{Branches, Constraints, Expansion, ModelState, StaticTraits, Vector};
use crate::simulate::right_hand_side::{EvaluationError, NEARLY_SINGULAR_CONDITION, RightHandSide};

impl<M: Constraints> Accelerations<M::Vector> for RightHandSide<'_, '_, M> {
    type Error = EvaluationError;
    const IS_UNCONSTRAINED: bool = M::IS_UNCONSTRAINED;
    const IS_SMOOTH: bool = M::IS_SMOOTH;

    #[inline(always)]
    fn accelerations(&mut self, t: f64, q: &M::Vector, u: &M::Vector) -> Result<M::Vector, EvaluationError> {
        if M::IS_UNCONSTRAINED {
            let state = self.stage(t, &Phase { q: *q, u: *u })?;
            self.notify_listener(&state);
            self.accelerations_of(&state)
        } else {
            Ok(self.constrained_derivative(t, &Phase { q: *q, u: *u })?.u)
        }
    }

    fn jacobian(
        &mut self,
        at: &StepNode<M::Vector>,
        by_q: &mut [f64],
        by_u: &mut [f64],
    ) -> Result<(), EvaluationError> {
        if self.exact_jacobian(at, by_q, by_u)? {
            return Ok(());
        }
        by_state(at, by_q, by_u, |y| self.accelerations(at.t, &y.q, &y.u))
    }

    /// q̇ is the velocity of the projected stage at which the accelerations are evaluated.
    #[inline(always)]
    fn derivative(&mut self, t: f64, y: &Phase<M::Vector>) -> Result<Phase<M::Vector>, EvaluationError> {
        if M::IS_UNCONSTRAINED {
            let state = self.stage(t, y)?;
            self.notify_listener(&state);
            Ok(Phase { q: *state.u(), u: self.accelerations_of(&state)? })
        } else {
            self.constrained_derivative(t, y)
        }
    }

    #[inline(always)]
    fn derivatives<L: Lanes>(
        &mut self,
        t: L,
        y: &Stages<M::Vector, L>,
        derivatives: &mut Stages<M::Vector, L>,
    ) -> Result<(), EvaluationError> {
        if self.accelerations_in_lanes(t, y, &mut derivatives.u) {
            derivatives.q = y.u;
            return Ok(());
        }
        one_by_one(self, t, y, derivatives)
    }

    #[inline(always)]
    fn begin_attempt(&mut self, start: &mut StepNode<M::Vector>, h: f64) -> Result<(), EvaluationError> {
        if M::IS_UNCONSTRAINED || !self.stabilization.has_tied_gains() {
            return Ok(());
        }
        self.apply_tied_gains(start, h)
    }

    #[inline(always)]
    fn has_velocity_forces(&self) -> bool {
        // An input law may read velocities.
        M::VELOCITY_FORCES || self.law.is_some()
    }

    #[inline(always)]
    fn accept_step(&mut self) {
        if let Some(by) = self.stabilization.latest_move.take() {
            self.stabilization.counts.note_move(by);
        }
    }
}

impl<M: Constraints> Stabilized<M::Vector> for RightHandSide<'_, '_, M> {
    #[inline(always)]
    fn has_constraints(&self) -> bool {
        M::IS_CONSTRAINED
    }

    #[cold]
    fn is_near_rank_loss(&mut self, start: &StepNode<M::Vector>, end: &StepNode<M::Vector>) -> bool {
        let between = zip(&start.y, &end.y, |a, b| 0.5 * (a + b));
        let places = [(start.t, &start.y), (0.5 * (start.t + end.t), &between), (end.t, &end.y)];
        places.iter().any(|(t, y)| {
            gradient_condition(self.model, &self.state(*t, &y.q, &y.u)) >= NEARLY_SINGULAR_CONDITION
        })
    }

    #[inline(always)]
    fn needs_projection(&self) -> bool {
        M::IS_CONSTRAINED && self.stabilization.projects()
    }

    #[inline(always)]
    fn project_stages(&mut self, on: bool, tolerances: &Tolerances) -> bool {
        M::IS_CONSTRAINED && self.stabilization.switch_stage_projection(on, tolerances)
    }

    fn error_after_projection(
        &mut self,
        t: f64,
        y: &Phase<M::Vector>,
        error: &Phase<M::Vector>,
    ) -> Result<Option<Phase<M::Vector>>, EvaluationError> {
        if M::IS_UNCONSTRAINED || !self.stabilization.projects() {
            return Ok(None);
        }
        let state = self.on_branches(&self.state(t, &y.q, &y.u));
        self.stabilization
            .tangential_part(self.model, &state, error)
            .map(Some)
            .map_err(EvaluationError::Solve)
    }

    #[inline(always)]
    fn project(
        &mut self,
        t: f64,
        y: &mut Phase<M::Vector>,
        tolerances: &Tolerances,
    ) -> Result<Option<ProjectedEnd>, EvaluationError> {
        if M::IS_UNCONSTRAINED || !self.stabilization.projects() {
            return Ok(None);
        }
        self.project_end(t, y, tolerances).map(Some)
    }

    fn project_position(
        &mut self,
        start: &StepNode<M::Vector>,
        h: f64,
        q: &mut M::Vector,
    ) -> Result<(), EvaluationError> {
        if M::IS_UNCONSTRAINED {
            return Ok(());
        }
        let from = self.on_branches(&self.state(start.t, &start.y.q, &start.y.u));
        let mut end = self.state(start.t + h, q, &start.y.u);
        self.move_on_held_branches(&mut end, |stabilization, model, end| {
            stabilization.project_positions_along(model, &from, end)
        })
        .map_err(EvaluationError::Solve)?;
        *q = *end.q();
        Ok(())
    }

    fn inadmissible_component(
        &mut self,
        t: f64,
        y: &Phase<M::Vector>,
        v: &M::Vector,
        holonomic: bool,
    ) -> Result<M::Vector, EvaluationError> {
        if M::IS_UNCONSTRAINED {
            return Ok(M::Vector::zeros());
        }
        let state = self.on_branches(&self.state(t, &y.q, &y.u));
        let rows = if holonomic { M::Residual::LEN } else { M::Rows::LEN };
        self.stabilization.inadmissible_part(self.model, &state, v, rows).map_err(EvaluationError::Solve)
    }

    fn constraint_correction(
        &mut self,
        t: f64,
        y: &Phase<M::Vector>,
        rate: f64,
    ) -> Result<M::Vector, EvaluationError> {
        if M::IS_UNCONSTRAINED {
            return Ok(M::Vector::zeros());
        }
        let state = self.on_branches(&self.state(t, &y.q, &y.u));
        self.stabilization.correction_towards(self.model, &state, rate).map_err(EvaluationError::Solve)
    }
}

impl<M: Constraints> Switching<M::Vector> for RightHandSide<'_, '_, M> {
    #[inline(always)]
    fn locate_kink(
        &mut self,
        step: (f64, f64),
        fails: bool,
        path: impl Fn(f64) -> Phase<M::Vector>,
    ) -> Option<f64> {
        if M::IS_SMOOTH { None } else { self.first_kink(step, fails, &path) }
    }

    /// Kinks of reactions are located between the ends of a step: a reaction is at least as accurate as q̇,
    /// and the zero is located again as the step ends nearer to it.
    #[inline(always)]
    fn is_hermite_enough_for_kinks(&self) -> bool {
        M::KINKS == 0
    }

    #[inline(always)]
    fn hold_branches(
        &mut self,
        start: &mut StepNode<M::Vector>,
        h: f64,
        on: bool,
    ) -> Result<BranchHold, EvaluationError> {
        match (M::KINKS, M::REACTION_KINKS, on) {
            (0, 0, _) | (0, _, false) => Ok(BranchHold::Free),
            // Kinks of reactions have no branches to hold, but a zero at which a step ends.
            (0, _, true) => Ok(BranchHold::Same),
            _ => self.follow_branches(start, h, on),
        }
    }

    #[inline(always)]
    fn release_branches(&mut self) {
        (self.held_branches, self.acceleration_branches) = (Branches::FREE, Branches::FREE);
    }
}

impl<M: Constraints> Canonical<M::Vector> for RightHandSide<'_, '_, M> {
    fn momenta(
        &mut self,
        t: f64,
        y: &Phase<M::Vector>,
        p: &mut M::Vector,
        rate: &mut M::Vector,
    ) -> Result<bool, EvaluationError> {
        if M::IS_CONSTRAINED {
            return Ok(false);
        }
        let state = self.stage(t, y)?;
        let Some(found) = self.model.momentum_rates(&state) else { return Ok(false) };
        self.evaluations += 1;
        if let Some(index) = state.inputs().as_slice().iter().position(|x| !x.is_finite()) {
            return Err(EvaluationError::Input(index));
        }
        (*p, *rate) = (self.model.momenta(&state), found);
        Ok(true)
    }

    fn mass_matrix(&mut self, t: f64, q: &M::Vector, mass: &mut [f64]) -> Result<(), EvaluationError> {
        let found = self.model.mass_matrix(&self.state(t, q, &M::Vector::zeros()));
        let n = M::Vector::LEN;
        mass.iter_mut().enumerate().for_each(|(i, element)| *element = found[(i / n, i % n)]);
        Ok(())
    }

    fn energy(&mut self, t: f64, y: &Phase<M::Vector>) -> Option<f64> {
        Some(self.model.energy_function(&self.state(t, &y.q, &y.u)))
    }
}

impl<M: Constraints> Expandable<M::Vector> for RightHandSide<'_, '_, M> {
    #[inline(always)]
    fn accelerations_at_next_start(
        &mut self,
        t: f64,
        y: &Phase<M::Vector>,
    ) -> Result<M::Vector, EvaluationError> {
        // A held branch may not exist there: see `accelerations_of`.
        if self.law.is_some() || M::IS_CONSTRAINED || self.held_branches != Branches::FREE {
            return self.accelerations(t, &y.q, &y.u);
        }
        self.evaluations += 1;
        let (state, memory) = (self.state(t, &y.q, &y.u), self.series_memory.get_or_insert_default());
        self.model.begin_series(self.constants, &state, memory).map_err(EvaluationError::Solve)
    }

    #[inline(always)]
    fn series(
        &mut self,
        t: f64,
        y: &Phase<M::Vector>,
        a: &M::Vector,
        scale: f64,
        q: &mut [M::Vector],
        u: &mut [M::Vector],
    ) -> Result<bool, EvaluationError> {
        // Inputs that follow a law have no series.
        if self.law.is_some() || !matches!(M::SERIES, Expansion::Generated { .. }) {
            return Ok(false);
        }
        let state = self.state(t, &y.q, &y.u);
        (q[0], u[0]) = (y.q, y.u);
        let (held, memory) = (self.on_branches(&state), self.series_memory.get_or_insert_default());
        if self.model.series(self.constants, &held, a, scale, [q, u], memory) {
            Ok(true)
        } else {
            Err(self.not_expandable(&state))
        }
    }

    #[inline(always)]
    fn has_choices(&self) -> bool {
        matches!(M::SERIES, Expansion::Generated { chooses: true })
    }
}
