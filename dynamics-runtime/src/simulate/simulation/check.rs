//! What the options of a simulation say, checked; and the method, where none is given.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::integrate::choice::{Dop853, Rk4, Suits, Tsit5, Verner9};
use crate::integrate::{Direction, StepOptions, Tolerances};
use crate::model::{Constraints, Expansion, Known, ModelState, Route, Vector};
use crate::simulate::erased_method::SharedMethod;
use crate::simulate::events::location::{Action, Rule};
use crate::simulate::events::unilateral::{UnilateralConstraint, UnilateralConstraints};
use crate::simulate::failure::OptionError;
use crate::simulate::options::contact::Contact;
use crate::simulate::options::defaults::DEFAULT_TOLERANCE;
use crate::simulate::options::formulation::Formulation;
use crate::simulate::options::output_times::{every, intervals};
use crate::simulate::simulation::{Output, Simulate, Simulation};
use dynamics_view::suggest;

/// Above this tolerance Tsitouras 5(4) is chosen. Measured by time for the same error on double pendulum and
/// Kepler (e = 0.9), all explicit methods lie within a quarter of each other at errors of 1e-3.
const LOOSE: f64 = 1e-4;
/// Below this tolerance, and without constraints, Verner 9(8) is chosen instead of DOP853, of whose time it
/// takes 0.75 to an error of 1e-6 and 0.65 to 1e-9. Above, it gains little, and where motions are stiff its
/// error estimate, which grows steeply, bounds the steps before stability does and hides that. With
/// constraints it takes 0.8 (Andrews) to 1 (car axis), but near singular positions, where these amplify
/// errors, its one error estimate sees less than the two of DOP853. Taylor series take less where a model has
/// them: to the same error, one run, 0.66, 0.47 and 0.33 of the time of Verner 9(8) at 1e-6, 1e-9 and 1e-12
/// (double pendulum), 1.2, 1.0 and 0.6 at 1e-6, 1e-9 and 1e-11 (Kepler, e = 0.9), 0.6 at 1e-6 and 1e-9
/// (Andrews). They are not chosen by themselves: every program would hold their code, beside that of a method
/// for models and inputs that have no series, and take a sixth (double pendulum) to a third longer (Andrews)
/// to compile.
const MANY_DIGITS: f64 = 1e-6;
/// Number of coordinates above which one step of an implicit method, which factors matrices of that size,
/// costs more than thousands of evaluations.
const LARGE: usize = 100;

/// What the options say once they are checked.
pub(crate) struct Checked<'m, M: Simulate> {
    pub(crate) end: f64,
    pub(crate) options: StepOptions,
    /// The absolute tolerance is to be that of a motion of this size.
    pub(crate) by_size: bool,
    pub(crate) method: (SharedMethod<M>, String),
    /// An implicit method is to go on where the motion is stiff.
    pub(crate) hands_over: bool,
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
        number("until", end, end.is_finite(), "a finite time")?;
        let options = self.check_steps()?;
        let method = self.choose_method(&options.tolerances)?;
        self.check_suits(&method.0)?;
        let output_times = self.output_list()?;
        let formulation = formulation::<M>(self.formulation)?;
        self.check_series(&method.0, formulation.as_ref().map(|(formulation, _)| *formulation))?;
        let hands_over = self.method.is_none() && self.fixed.is_none() && M::Vector::LEN <= LARGE;
        number("drift_limit", self.drift_limit, self.drift_limit > 0.0, "a limit above 0")?;
        let unilaterals = self.check_guards(end)?;
        let rules = self.check_events(&unilaterals)?;
        let by_size = self.fixed.is_none() && self.tolerances.is_none_or(|(_, option)| option == "tolerance");
        Ok(Checked {
            end,
            options,
            by_size,
            method,
            hands_over,
            output_times,
            formulation,
            unilaterals,
            rules,
        })
    }

    fn check_start(&self) -> Result<(), OptionError> {
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

    fn check_steps(&self) -> Result<StepOptions, OptionError> {
        let (tolerances, option) =
            self.tolerances.unwrap_or((Tolerances::both(DEFAULT_TOLERANCE), "tolerance"));
        let Tolerances { absolute, relative } = tolerances;
        check_tolerances(absolute, relative, option == "tolerance")?;
        let length = "a length of time above 0, and above the resolution of `f64` at the times simulated";
        let resolution = 4.0 * f64::EPSILON * self.start.t().abs().max(self.end.map_or(0.0, f64::abs));
        for (option, value) in [("fixed_step", self.fixed), ("first_step", self.first)] {
            let Some(value) = value else { continue };
            number(option, value, value > resolution && value.is_finite(), length)?;
        }
        let most = self.most.unwrap_or(f64::INFINITY);
        number("max_step", most, most > resolution, length)?;
        number("max_steps", self.most_steps as f64, self.most_steps > 0, "at least 1")?;
        if self.fixed.is_some() {
            let given = [("first_step", self.first.is_some()), ("max_step", self.most.is_some())];
            let tolerance = [(option, self.tolerances.is_some())];
            if let Some(&(option, _)) = given.iter().chain(&tolerance).find(|(_, given)| *given) {
                return Err(OptionError::FixedStepExcludes { option });
            }
        }
        Ok(StepOptions { tolerances, fixed: self.fixed, first: self.first, most })
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
            (None, None) if loosest > LOOSE => {
                chosen(Arc::new(Tsit5), format!("because tolerance {loosest:e} asks for few digits"))
            }
            // A constant, so that models with constraints have no code of it.
            (None, None) if M::IS_FREE && loosest < MANY_DIGITS => {
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

    /// Methods that preserve something are refused where they would not.
    fn check_suits(&self, method: &SharedMethod<M>) -> Result<(), OptionError> {
        let option = method.option(M::IS_HELD);
        let (suits, method) = (method.suits(), method.method());
        if let Some((option, value, false, admissible)) = option {
            return Err(OptionError::MethodNumber { method, option, value, admissible });
        }
        if suits == Suits::Any {
            return Ok(());
        }
        let unsuited = |reason, remedy| Err(OptionError::Unsuited { method, reason, remedy });
        let constrained = M::IS_HELD;
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
        let conserved =
            M::CONSERVED.iter().any(|quantity| matches!(quantity.name, "energy" | "energy function"));
        if suits == Suits::Conservative && (!conserved || self.law.is_some()) {
            return unsuited("its energy is not conserved", "use methods::Gauss4 or methods::Gauss6");
        }
        Ok(())
    }

    /// The output times, checked and in the order of the motion.
    fn output_list(&self) -> Result<Option<Vec<f64>>, OptionError> {
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
                number("every", *interval, *interval > 0.0 && interval.is_finite(), "an interval above 0")?;
                let span = (end - start).abs();
                let count = intervals(span, *interval);
                number(
                    "every",
                    *interval,
                    count <= 100_000_000,
                    "an interval that gives fewer than 10⁸ times",
                )?;
                Ok(Some(every(start, end, *interval)))
            }
        }
    }

    /// Index of an event of the model or of the simulation.
    fn event_index(&self, name: &str) -> Result<usize, OptionError> {
        place_of(name, &self.event_names())
    }

    /// Names of the events of the model and of the simulation.
    fn event_names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::with_capacity(M::EVENTS.len() + self.added_events.len());
        for event in M::EVENTS {
            names.push(event.name);
        }
        for event in &self.added_events {
            names.push(&event.name);
        }
        names
    }

    fn check_guards(&self, end: f64) -> Result<UnilateralConstraints, OptionError> {
        check_guarded(&self.contacts, &self.sticking, end < self.start.t())?;
        let mut unilaterals = Vec::with_capacity(self.contacts.len() + self.sticking.len());
        for (name, contact) in &self.contacts {
            unilaterals.push(UnilateralConstraint::contact::<M>(name, *contact)?);
        }
        for (name, breakaway) in &self.sticking {
            unilaterals.push(UnilateralConstraint::stick::<M>(name, || self.event_index(breakaway))?);
        }
        Ok(unilaterals)
    }

    /// The rules: what unilateral constraints do comes before what was asked for at their events.
    fn check_events(&mut self, unilaterals: &UnilateralConstraints) -> Result<Vec<Rule<'m, M>>, OptionError> {
        let actions = core::mem::take(&mut self.actions);
        let mut names = self.event_names();
        names.extend(unilaterals.iter().map(|unilateral| unilateral.name.as_str()));
        check_names(&names, M::EVENTS.len())?;
        let first = M::EVENTS.len() + self.added_events.len();
        let unilateral = |i| Rule {
            index: first + i,
            direction: Direction::Falling,
            action: Action::UnilateralConstraint(i),
        };
        let mut rules: Vec<Rule<'m, M>> = (0..unilaterals.len()).map(unilateral).collect();
        for (name, direction, action) in actions {
            rules.push(Rule { index: place_of(&name, &names)?, direction, action });
        }
        Ok(rules)
    }
}

/// No unilateral constraint runs backwards, and none is asked for twice.
fn check_guarded(
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
            return Err(OptionError::GuardTwice { option, constraint: (*name).into() });
        }
    }
    Ok(())
}

/// The index of an event by its name.
fn place_of(name: &str, names: &[&str]) -> Result<usize, OptionError> {
    names.iter().position(|known| *known == name).ok_or_else(|| {
        let suggestion = suggest(name, names.iter().copied());
        OptionError::UnknownEvent { name: name.into(), suggestion }
    })
}

/// Names given at a simulation, which come after `first` of the model, are none that there are.
fn check_names(names: &[&str], first: usize) -> Result<(), OptionError> {
    for (i, name) in names.iter().enumerate().skip(first) {
        if names[..i].contains(name) {
            return Err(OptionError::DuplicateEvent { name: name.to_string() });
        }
    }
    Ok(())
}

/// A relative tolerance of 1 asks for no digit, and one below 1e-15 for more than there are.
fn check_tolerances(absolute: f64, relative: f64, one: bool) -> Result<(), OptionError> {
    let (above, none) = (absolute > 0.0 && absolute.is_finite(), relative >= 0.0 && relative.is_finite());
    let (fine, coarse) = (relative == 0.0 || relative >= 1e-15, relative < 1.0);
    if one {
        number("tolerance", absolute, above, "a tolerance above 0")?;
        number("tolerance", absolute, fine, "at least 1e-15: `f64` resolves no less")?;
        return number("tolerance", absolute, coarse, "less than 1: from there on no digit is asked for");
    }
    let checks = [
        (above, "an absolute tolerance above 0"),
        (none, "a relative tolerance of 0 or more"),
        (fine, "a relative tolerance of at least 1e-15: `f64` resolves no less"),
        (coarse, "a relative tolerance below 1: from there on no digit is asked for"),
    ];
    match checks.into_iter().find(|(good, _)| !good) {
        Some((_, admissible)) => Err(OptionError::Tolerances { absolute, relative, admissible }),
        None => Ok(()),
    }
}

fn number(option: &'static str, value: f64, good: bool, admissible: &'static str) -> Result<(), OptionError> {
    if good { Ok(()) } else { Err(OptionError::Number { option, value, admissible }) }
}

/// The formulation of a run and why it was chosen; `None` for models without constraints.
fn formulation<M: Constraints>(
    asked: Option<Formulation>,
) -> Result<Option<(Formulation, String)>, OptionError> {
    if M::IS_FREE {
        return match asked {
            Some(_) => Err(OptionError::NothingToHold),
            None => Ok(None),
        };
    }
    if let Some(Formulation::Baumgarte { alpha, beta }) = asked {
        for (option, value) in [("alpha", alpha), ("beta", beta)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(OptionError::Gain { name: option, value });
            }
        }
    }
    let route = match M::ROUTE {
        Route::Unconstrained => String::new(),
        Route::Unrolled { elimination } => format!("; {elimination}"),
        Route::General { reason } => format!("; general solver, as {reason}"),
    };
    Ok(Some(match asked {
        Some(formulation) => (formulation, format!("as asked for{route}")),
        None => (
            Formulation::Projected,
            format!("because it keeps Φ and Φ̇ at rounding level for one correction per step{route}"),
        ),
    }))
}
