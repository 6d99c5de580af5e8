//! Checks of a simulation's options, and the choice of the method and the formulation where none is given.
//!
//! [`Simulation::check_options`] runs once before a run and lists all checks in its order. Each check is a
//! function of its own and reports an [`OptionError`], whose text is in `failure/option.rs`. The start is
//! compared with the constraints later, in `stabilization/initial_consistency.rs`.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::integrate::choice::{Dop853, GraggBulirschStoer, Rk4, Suits, Tsit5, Verner9};
use crate::integrate::{Direction, Method, StepOptions, Tolerances};
use crate::model::{Constraints, Expansion, ModelState, SolverKind, StaticTraits, Vector};
use crate::simulate::erased_method::SharedMethod;
use crate::simulate::events::rules::{Action, Rule};
use crate::simulate::events::unilateral::{UnilateralConstraint, UnilateralConstraints};
use crate::simulate::failure::OptionError;
use crate::simulate::options::contact::Contact;
use crate::simulate::options::defaults::DEFAULT_TOLERANCE;
use crate::simulate::options::formulation::Formulation;
use crate::simulate::options::output_times::{every, intervals};
use crate::simulate::simulation::{Output, Simulate, Simulation, ToleranceOption};
use dynamics_view::suggest;

/// Tolerance above which Tsitouras 5(4) is chosen. Speed does not decide there: measured by time for the same
/// error on the double pendulum and Kepler's problem (e = 0.9), all explicit methods lie within a quarter of
/// each other at errors of 1e-3. A low order makes shorter steps at a lower cost each, which sample forces
/// and events more densely. With a smaller value it is also chosen where DOP853 takes less time and detects
/// stiffness sooner; with a larger one long steps are made for few digits.
const LOOSE_TOLERANCE: f64 = 1e-4;
/// Tolerance below which, without constraints and without lanes, Verner 9(8) is chosen instead of DOP853.
///
/// It takes 0.75 of the time of DOP853 to an error of 1e-6 and 0.65 to 1e-9. At larger tolerances it gains
/// little. Models with lanes have it at all tolerances: where extrapolation does not apply to them, a third
/// method would only be compiled.
///
/// In stiff motions its error estimate, which grows steeply, bounds the steps before stability does, and hides
/// the stiffness. With constraints it takes 0.8 (Andrews) to 1 (car axis) of the time. But near singular
/// positions, which amplify errors, its one error estimate shows less than the two of DOP853.
const VERNER_TOLERANCE: f64 = 1e-6;
/// Tolerance down to which models with lanes are extrapolated by default, if they have no constraints. Below
/// it rounding of the weighted columns shortens the steps, and Verner 9(8) runs.
///
/// With constraints extrapolation takes 0.3 to 0.8 of the time of DOP853, too. But its long steps do not go
/// over singular positions, as those of DOP853 do.
/// The benchmark `methods` compares the default with five named methods on nineteen models. Taylor series are
/// not a default: they are faster than extrapolation by more than 15 % only on a few models, and every
/// program would contain their code beside that of a method for models and inputs without series.
const EXTRAPOLATION_TOLERANCE: f64 = 1e-12;
/// Largest number of coordinates with which a stiff motion changes to an implicit method by default: one step
/// factors matrices of this size, which costs more than thousands of evaluations.
pub(super) const MAX_IMPLICIT_COORDINATES: usize = 100;

/// The checked options of a simulation.
pub(crate) struct Checked<'m, M: Simulate> {
    pub(crate) end: f64,
    pub(crate) options: StepOptions,
    /// Whether the absolute tolerance is scaled with the size of the motion, see `pilot_run.rs`.
    pub(crate) scales_with_motion: bool,
    pub(crate) method: (SharedMethod<M>, String),
    /// Whether an implicit method continues where the motion is stiff.
    pub(crate) may_change_method: bool,
    pub(crate) output_times: Option<Vec<f64>>,
    pub(crate) formulation: Option<(Formulation, String)>,
    pub(crate) unilaterals: UnilateralConstraints,
    pub(crate) rules: Vec<Rule<'m, M>>,
}

impl<'m, M: Simulate> Simulation<'m, M> {
    pub(crate) fn check_options(&mut self) -> Result<Checked<'m, M>, OptionError> {
        OptionError::check_parameters(self.model)?;
        self.check_start()?;
        let end = self.end.ok_or(OptionError::NoEnd)?;
        check_number("until", end, end.is_finite(), "a finite time")?;
        let options = self.check_steps()?;
        let method = self.choose_method(&options.tolerances)?;
        self.check_suits(&method.0)?;
        check_resolution::<M>(method.0.method(), &options)?;
        let output_times = self.checked_output_times()?;
        let formulation = choose_formulation::<M>(self.formulation)?;
        self.check_series(&method.0, formulation.as_ref().map(|(formulation, _)| *formulation))?;
        let may_change_method =
            self.method.is_none() && self.fixed.is_none() && M::Vector::LEN <= MAX_IMPLICIT_COORDINATES;
        check_number("drift_limit", self.drift_limit, self.drift_limit > 0.0, "a limit above 0")?;
        let unilaterals = self.check_unilaterals(end)?;
        let rules = self.check_events(&unilaterals)?;
        let scales_with_motion = self.fixed.is_none()
            && self.tolerances.is_none_or(|(_, option)| option == ToleranceOption::Tolerance);
        Ok(Checked {
            end,
            options,
            scales_with_motion,
            method,
            may_change_method,
            output_times,
            formulation,
            unilaterals,
            rules,
        })
    }

    /// The checks of [`Simulation::check_options`] that matter whatever the method and the end are.
    pub(super) fn check_declared(
        &mut self,
    ) -> Result<(Option<Formulation>, UnilateralConstraints), OptionError> {
        OptionError::check_parameters(self.model)?;
        self.check_start()?;
        let formulation = choose_formulation::<M>(self.formulation)?;
        let unilaterals = self.check_unilaterals(self.start.t())?;
        self.check_events(&unilaterals)?;
        Ok((formulation.map(|(formulation, _)| formulation), unilaterals))
    }

    pub(super) fn check_start(&self) -> Result<(), OptionError> {
        let not_finite = |v: &[f64]| v.iter().position(|x| !x.is_finite());
        if !self.start.t().is_finite() {
            return Err(OptionError::StartNotFinite { name: "t", rate: false });
        }
        if let Some(i) = not_finite(self.start.q().as_slice()) {
            return Err(OptionError::StartNotFinite { name: M::COORDINATES[i].name, rate: false });
        }
        if let Some(i) = not_finite(self.start.u().as_slice()) {
            return Err(OptionError::StartNotFinite { name: M::COORDINATES[i].name, rate: true });
        }
        match not_finite(self.start.inputs().as_slice()) {
            Some(i) if self.law.is_none() => Err(OptionError::InputWithoutValue { input: M::INPUTS[i].name }),
            _ => OptionError::check_bodies(self.model, &self.start),
        }
    }

    pub(super) fn check_steps(&self) -> Result<StepOptions, OptionError> {
        let (tolerances, option) =
            self.tolerances.unwrap_or((Tolerances::both(DEFAULT_TOLERANCE), ToleranceOption::Tolerance));
        let Tolerances { absolute, relative } = tolerances;
        check_tolerances(absolute, relative, option == ToleranceOption::Tolerance)?;
        let length = "a length of time above 0, and above the resolution of `f64` at the times simulated";
        let resolution = 4.0 * f64::EPSILON * self.start.t().abs().max(self.end.map_or(0.0, f64::abs));
        for (option, value) in [("fixed_step", self.fixed), ("first_step", self.first)] {
            let Some(value) = value else { continue };
            check_number(option, value, value > resolution && value.is_finite(), length)?;
        }
        let longest = self.most.unwrap_or(f64::INFINITY);
        check_number("max_step", longest, longest > resolution, length)?;
        check_number("max_steps", self.max_steps as f64, self.max_steps > 0, "at least 1")?;
        if self.fixed.is_some() {
            let given = [("first_step", self.first.is_some()), ("max_step", self.most.is_some())];
            let tolerance = [(option.name(), self.tolerances.is_some())];
            if let Some(&(option, _)) = given.iter().chain(&tolerance).find(|(_, given)| *given) {
                return Err(OptionError::FixedStepExcludes { option });
            }
        }
        Ok(StepOptions { tolerances, fixed: self.fixed, first: self.first, most: longest })
    }

    fn choose_method(&self, tolerances: &Tolerances) -> Result<(SharedMethod<M>, String), OptionError> {
        let loosest = tolerances.absolute.max(tolerances.relative);
        let chosen = |erased_method: SharedMethod<M>, reason: String| (erased_method, reason);
        Ok(match (self.method.clone(), self.fixed) {
            (Some(method), None) if !method.is_adaptive() => {
                return Err(OptionError::NeedsFixedStep { method: method.method() });
            }
            (Some(method), Some(h)) => (method, format!("as asked for, with a fixed step of {h}")),
            (Some(method), None) => (method, format!("as asked for, at tolerance {loosest:e}")),
            (None, Some(h)) => chosen(Arc::new(Rk4), format!("because the step is fixed, {h}")),
            (None, None) if loosest > LOOSE_TOLERANCE => {
                chosen(Arc::new(Tsit5), format!("because tolerance {loosest:e} asks for few digits"))
            }
            // Constants come first, so that models without lanes contain no code of this method.
            (None, None)
                if M::IS_UNCONSTRAINED
                    && M::HAS_LANES
                    && loosest >= EXTRAPOLATION_TOLERANCE
                    && self.law.is_none() =>
            {
                let reason = format!(
                    "because it evaluates four states at once and its long steps win at tolerance {loosest:e}"
                );
                chosen(Arc::new(GraggBulirschStoer), reason)
            }
            // `IS_UNCONSTRAINED` is a constant, so that models with constraints contain no code of this
            // method.
            (None, None) if M::IS_UNCONSTRAINED && (M::HAS_LANES || loosest < VERNER_TOLERANCE) => {
                chosen(Arc::new(Verner9), format!("because its long steps win at tolerance {loosest:e}"))
            }
            (None, None) => {
                chosen(Arc::new(Dop853), format!("because its long steps win at tolerance {loosest:e}"))
            }
        })
    }

    fn check_series(
        &self,
        method: &SharedMethod<M>,
        formulation: Option<Formulation>,
    ) -> Result<(), OptionError> {
        if !method.needs_series() {
            return Ok(());
        }
        let adds =
            |of: &Formulation| matches!(of, Formulation::Baumgarte { .. } | Formulation::BaumgarteTied);
        if let Some(formulation) = formulation.filter(adds) {
            return Err(OptionError::SeriesExcludes { method: method.method(), formulation });
        }
        let reason = match M::SERIES {
            Expansion::None { reason } => reason,
            Expansion::Generated { .. } if self.law.is_some() => {
                "its inputs follow a closure, of which no derivatives are known (hold them and change them \
                 at events, or write what they follow into the model by `q.t`)"
            }
            Expansion::Generated { .. } => return Ok(()),
        };
        Err(OptionError::NoSeries { method: method.method(), reason })
    }

    /// Refuses structure-preserving methods for models whose structure they would not preserve.
    fn check_suits(&self, method: &SharedMethod<M>) -> Result<(), OptionError> {
        let option = method.option(M::IS_CONSTRAINED);
        let (suits, method) = (method.suits(), method.method());
        if let Some((option, value, false, admissible)) = option {
            return Err(OptionError::MethodNumber { method, option, value, admissible });
        }
        if suits == Suits::Any {
            return Ok(());
        }
        let unsuited = |reason, remedy| Err(OptionError::Unsuited { method, reason, remedy });
        let constrained = M::IS_CONSTRAINED;
        let projects = matches!(suits, Suits::SeparableHolonomic | Suits::Projected);
        if constrained && !projects {
            return unsuited(
                "it has constraints",
                "use methods::Rattle, or a method that preserves nothing, as methods::Dop853",
            );
        }
        if M::VELOCITY_FORCES && matches!(suits, Suits::Separable | Suits::SeparableHolonomic) {
            let reason = "its forces, or the Coriolis terms of a mass matrix that moves, contain velocities";
            let remedy = if constrained {
                "use methods::Dop853"
            } else {
                "use methods::Gauss4, methods::Gauss6 or methods::EnergyMidpoint"
            };
            return unsuited(reason, remedy);
        }
        if M::VelocityOffset::LEN > 0 && suits != Suits::Projected {
            return unsuited("it has nonholonomic constraints", "use methods::Dop853");
        }
        if constrained && self.formulation.is_some_and(|formulation| formulation != Formulation::Projected) {
            return unsuited(
                "its steps are projected and `.formulation(..)` asks for something else",
                "leave that out",
            );
        }
        let conserves_energy = M::CONSERVED.iter().any(|quantity| quantity.kind.is_energy());
        if suits == Suits::Conservative && (!conserves_energy || self.law.is_some()) {
            return unsuited("its energy is not conserved", "use methods::Gauss4 or methods::Gauss6");
        }
        Ok(())
    }

    /// The output times in the order of the motion.
    fn checked_output_times(&self) -> Result<Option<Vec<f64>>, OptionError> {
        let (start, end) = (self.start.t(), self.end.ok_or(OptionError::NoEnd)?);
        let direction = if end < start { -1.0 } else { 1.0 };
        match &self.output {
            Output::Steps => Ok(None),
            Output::Times(times) => {
                let outside = |&t: &f64| !((t - start) * direction >= 0.0 && (end - t) * direction >= 0.0);
                if let Some(time) = times.iter().copied().find(outside) {
                    return Err(OptionError::OutputTime { time, start, end });
                }
                match times.windows(2).find(|pair| (pair[1] - pair[0]) * direction < 0.0) {
                    Some(pair) => {
                        Err(OptionError::OutputOrder { pair: [pair[0], pair[1]], backwards: end < start })
                    }
                    None => Ok(Some(times.clone())),
                }
            }
            Output::Every(interval) => {
                check_number(
                    "every",
                    *interval,
                    *interval > 0.0 && interval.is_finite(),
                    "an interval above 0",
                )?;
                let span = (end - start).abs();
                let count = intervals(span, *interval);
                check_number(
                    "every",
                    *interval,
                    count <= MAX_OUTPUT_TIMES,
                    "an interval that gives fewer than 10⁸ times",
                )?;
                Ok(Some(every(start, end, *interval)))
            }
        }
    }

    /// Index of an event of the model or of the simulation.
    fn event_index(&self, name: &str) -> Result<usize, OptionError> {
        event_index_of(name, &self.event_names())
    }

    /// Names of the events of the model and of the simulation.
    pub(super) fn event_names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::with_capacity(M::EVENTS.len() + self.added_events.len());
        for event in M::EVENTS {
            names.push(event.name);
        }
        for event in &self.added_events {
            names.push(&event.name);
        }
        names
    }

    fn check_unilaterals(&self, end: f64) -> Result<UnilateralConstraints, OptionError> {
        check_unilateral_names(&self.contacts, &self.sticking, end < self.start.t())?;
        let mut unilaterals = Vec::with_capacity(self.contacts.len() + self.sticking.len());
        for (name, contact) in &self.contacts {
            unilaterals.push(UnilateralConstraint::contact::<M>(name, *contact)?);
        }
        for (name, breakaway) in &self.sticking {
            unilaterals.push(UnilateralConstraint::stick_slip::<M>(name, || self.event_index(breakaway))?);
        }
        Ok(unilaterals)
    }

    /// The rules of all events. Those of unilateral constraints come before the actions given by the user.
    fn check_events(&mut self, unilaterals: &UnilateralConstraints) -> Result<Vec<Rule<'m, M>>, OptionError> {
        let actions = core::mem::take(&mut self.actions);
        let mut names = self.event_names();
        names.extend(unilaterals.iter().map(|unilateral| unilateral.name.as_str()));
        check_event_names(&names, M::EVENTS.len())?;
        let first = M::EVENTS.len() + self.added_events.len();
        let unilateral = |i| Rule {
            index: first + i,
            direction: Direction::Falling,
            action: Action::UnilateralConstraint(i),
        };
        let mut rules: Vec<Rule<'m, M>> = (0..unilaterals.len()).map(unilateral).collect();
        for (name, direction, action) in actions {
            rules.push(Rule { index: event_index_of(&name, &names)?, direction, action });
        }
        Ok(rules)
    }
}

/// Refuses unilateral constraints in runs backwards in time, and constraints that are named twice.
fn check_unilateral_names(
    contacts: &[(String, Contact)],
    sticking: &[(String, String)],
    backwards: bool,
) -> Result<(), OptionError> {
    let contacts: Vec<&str> = contacts.iter().map(|(name, _)| name.as_str()).collect();
    let sticking: Vec<&str> = sticking.iter().map(|(name, _)| name.as_str()).collect();
    let all = [("contact", contacts), ("stick_slip", sticking)];
    for (option, names) in &all {
        if let Some(name) = names.first().filter(|_| backwards) {
            return Err(OptionError::Backwards { option, constraint: (*name).into() });
        }
    }
    for (option, names) in &all {
        let mut again = names.iter().enumerate().filter(|(i, name)| names[..*i].contains(name));
        if let Some((_, name)) = again.next() {
            return Err(OptionError::UnilateralTwice { option, constraint: (*name).into() });
        }
    }
    Ok(())
}

/// The index of an event by its name.
fn event_index_of(name: &str, names: &[&str]) -> Result<usize, OptionError> {
    names.iter().position(|known| *known == name).ok_or_else(|| {
        let suggestion = suggest(name, names.iter().copied());
        OptionError::UnknownEvent { name: name.into(), suggestion }
    })
}

/// Refuses event names of the simulation, which follow the `first` names of the model, that exist already.
pub(super) fn check_event_names(names: &[&str], first: usize) -> Result<(), OptionError> {
    for (i, name) in names.iter().enumerate().skip(first) {
        if names[..i].contains(name) {
            return Err(OptionError::DuplicateEvent { name: name.to_string() });
        }
    }
    Ok(())
}

/// Smallest relative tolerance: 4.5 units in the last place of `f64`.
const MIN_RELATIVE_TOLERANCE: f64 = 1e-15;
/// Most output times, which would take about a gigabyte.
const MAX_OUTPUT_TIMES: u64 = 100_000_000;

/// Checks both tolerances. `is_single`: one tolerance was given for both.
fn check_tolerances(absolute: f64, relative: f64, is_single: bool) -> Result<(), OptionError> {
    let (absolute_ok, relative_ok) =
        (absolute > 0.0 && absolute.is_finite(), relative >= 0.0 && relative.is_finite());
    let (fine, coarse) = (relative == 0.0 || relative >= MIN_RELATIVE_TOLERANCE, relative < 1.0);
    if is_single {
        check_number("tolerance", absolute, absolute_ok, "a tolerance above 0")?;
        check_number("tolerance", absolute, fine, "at least 1e-15: `f64` resolves no less")?;
        return check_number(
            "tolerance",
            absolute,
            coarse,
            "less than 1: from there on no digit is asked for",
        );
    }
    let checks = [
        (absolute_ok, "an absolute tolerance above 0"),
        (relative_ok, "a relative tolerance of 0 or more"),
        (fine, "a relative tolerance of at least 1e-15: `f64` resolves no less"),
        (coarse, "a relative tolerance below 1: from there on no digit is asked for"),
    ];
    match checks.into_iter().find(|(is_admissible, _)| !is_admissible) {
        Some((_, admissible)) => Err(OptionError::Tolerances { absolute, relative, admissible }),
        None => Ok(()),
    }
}

/// Extrapolation with constraints ends in steps of a few units in the last place of the time if its tolerance
/// is below what its columns resolve: 10⁶ steps of Andrews' mechanism at 1e-14.
fn check_resolution<M: Constraints>(method: Method, options: &StepOptions) -> Result<(), OptionError> {
    let (finest, tolerance) = (method.finest_tolerance(), options.tolerances.relative);
    let extrapolates = method == Method::GraggBulirschStoer && options.fixed.is_none();
    if M::IS_CONSTRAINED && extrapolates && 0.0 < tolerance && tolerance < finest {
        return Err(OptionError::ToleranceTooFine { method, tolerance, finest });
    }
    Ok(())
}

fn check_number(
    option: &'static str,
    value: f64,
    is_admissible: bool,
    admissible: &'static str,
) -> Result<(), OptionError> {
    if is_admissible { Ok(()) } else { Err(OptionError::Number { option, value, admissible }) }
}

/// The formulation of a run, with the reason for its choice; `None` for models without constraints.
fn choose_formulation<M: Constraints>(
    requested: Option<Formulation>,
) -> Result<Option<(Formulation, String)>, OptionError> {
    if M::IS_UNCONSTRAINED {
        return match requested {
            Some(_) => Err(OptionError::NothingToHold),
            None => Ok(None),
        };
    }
    if let Some(Formulation::Baumgarte { alpha, beta }) = requested {
        for (option, value) in [("alpha", alpha), ("beta", beta)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(OptionError::Gain { name: option, value });
            }
        }
    }
    let route = match M::SOLVER {
        SolverKind::Unconstrained => String::new(),
        SolverKind::Unrolled { elimination } => format!("; {elimination}"),
        SolverKind::General { reason } => format!("; general solver, as {reason}"),
    };
    Ok(Some(match requested {
        Some(formulation) => (formulation, format!("as asked for{route}")),
        None => (
            Formulation::Projected,
            format!("because it keeps Φ and Φ̇ at rounding level for one correction per step{route}"),
        ),
    }))
}
