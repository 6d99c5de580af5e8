//! A run of a model with Python's options and functions.

use std::sync::Arc;

use dynamics::methods;
use dynamics::model::ModelState as _;
use dynamics::simulate::{
    Flow, MotionRecord, Simulate as _, Simulation, SimulationError, SimulationErrorKind,
};

use crate::data::{Failure, StateData, vector};
use crate::info::Info;
use crate::law::{Function, Interruption, Signals};
use crate::options::{Callbacks, MethodName, Options};
use crate::python_model::PythonModel;

/// What a run works with.
pub(crate) struct Run<'a, M> {
    pub(crate) model: &'a M,
    pub(crate) info: &'a Arc<Info>,
    pub(crate) callbacks: &'a Callbacks,
    pub(crate) interruption: &'a Interruption,
    pub(crate) signals: &'a Signals,
}

impl<'a, M: PythonModel> Run<'a, M> {
    /// Runs a simulation. The record is that of the motion up to where it ended.
    pub(crate) fn run(
        &self,
        start: M::State,
        options: &Options,
    ) -> (Option<MotionRecord<M>>, Option<Failure>) {
        let run = self.model.simulate(start).until(options.until).cancel(&self.interruption.flag);
        let run = self.with_callbacks(with_options(run, options));
        let mut run = run.cancel_when(self.signals.asked(self.interruption));
        // After the actions: a run is stopped where they have acted.
        for (name, direction) in &options.stops {
            run = run.stop_at(name, *direction);
        }
        match run.run() {
            Ok(motion) => (Some(motion.record()), None),
            Err(error) => (error.motion(self.model).map(|motion| motion.record()), Some(failure(&error))),
        }
    }

    fn with_callbacks(&self, mut run: Simulation<'a, M>) -> Simulation<'a, M> {
        let Self { info, callbacks, interruption, .. } = *self;
        if let Some(function) = &callbacks.inputs {
            let law = Function { info, function, interruption };
            run = run
                .inputs(move |t, state: &M::State| vector::<M::Inputs>(&law.inputs(t, StateData::of(state))));
        }
        for (name, function) in &callbacks.events {
            let event = Function { info, function, interruption };
            run = run.event(name, move |state: &M::State| event.number(StateData::of(state)));
        }
        for (name, direction, function) in &callbacks.actions {
            let action = Function { info, function, interruption };
            run = run.on_event(name, *direction, move |state: &mut M::State| -> Flow {
                let (changed, flow) = action.action(StateData::of(state));
                if let Some(changed) = changed {
                    let t = state.t();
                    *state = StateData { t, ..changed }.typed::<M>();
                }
                flow
            });
        }
        run
    }
}

/// The options that are data.
fn with_options<'a, M: PythonModel>(mut run: Simulation<'a, M>, options: &Options) -> Simulation<'a, M> {
    if let Some(tolerance) = options.tolerance {
        run = run.tolerance(tolerance);
    }
    if let Some((absolute, relative)) = options.tolerances {
        run = run.tolerances(absolute, relative);
    }
    if let Some(named) = &options.method {
        run = run.method(method::<M>(named));
    }
    if let Some(h) = options.fixed_step {
        run = run.fixed_step(h);
    }
    if let Some(h) = options.first_step {
        run = run.first_step(h);
    }
    if let Some(h) = options.max_step {
        run = run.max_step(h);
    }
    if let Some(steps) = options.max_steps {
        run = run.max_steps(steps);
    }
    if let Some(times) = &options.times {
        run = run.output_times(times.iter().copied());
    }
    if let Some(interval) = options.every {
        run = run.every(interval);
    }
    for (name, contact) in &options.contacts {
        run = run.contact(name, *contact);
    }
    for (name, event) in &options.stick_slips {
        run = run.stick_slip(name, event);
    }
    if let Some(formulation) = options.formulation {
        run = run.formulation(formulation);
    }
    if let Some(limit) = options.drift_limit {
        run = run.drift_limit(limit);
    }
    if options.consistent_output {
        run = run.consistent_output();
    }
    if options.estimate_error {
        run = run.estimate_error();
    }
    run
}

fn failure<M: PythonModel>(error: &SimulationError<M>) -> Failure {
    let debug = format!("{:?}", error.kind);
    let kind = debug.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
    Failure {
        text: error.to_string(),
        kind: kind.to_owned(),
        time: error.time,
        step: error.step,
        state: StateData::of(&*error.state),
        is_option: matches!(error.kind, SimulationErrorKind::Option(_)),
    }
}

/// The method of this name, which the options have checked.
fn method<M: PythonModel>(named: &MethodName) -> methods::Any<M> {
    match named.name {
        "rk4" => methods::Rk4.into(),
        "dormand_prince5" => methods::DormandPrince5.into(),
        "tsit5" => methods::Tsit5.into(),
        "verner9" => methods::Verner9.into(),
        "gragg_bulirsch_stoer" => methods::GraggBulirschStoer.into(),
        "taylor" => methods::Taylor { order: named.option.map(|order| order as usize) }.into(),
        "radau5" => methods::Radau5.into(),
        #[cfg(feature = "all-methods")]
        "esdirk4" => methods::Esdirk4.into(),
        "generalized_alpha" => {
            let default = methods::GeneralizedAlpha::default();
            methods::GeneralizedAlpha { rho: named.option.unwrap_or(default.rho) }.into()
        }
        #[cfg(feature = "all-methods")]
        "gauss4" => methods::Gauss4.into(),
        "gauss6" => methods::Gauss6.into(),
        #[cfg(feature = "all-methods")]
        "energy_midpoint" => methods::EnergyMidpoint.into(),
        "semi_implicit_euler" => methods::SemiImplicitEuler.into(),
        "stormer_verlet" => methods::StormerVerlet.into(),
        "rattle" => methods::Rattle.into(),
        #[cfg(feature = "all-methods")]
        "composition4" => methods::Composition4.into(),
        #[cfg(feature = "all-methods")]
        "composition6" => methods::Composition6.into(),
        #[cfg(feature = "all-methods")]
        "composition8" => methods::Composition8.into(),
        #[cfg(feature = "all-methods")]
        "explicit_euler" => methods::ExplicitEuler.into(),
        #[cfg(feature = "all-methods")]
        "heun" => methods::Heun.into(),
        #[cfg(feature = "all-methods")]
        "adams_bashforth2" => methods::AdamsBashforth2.into(),
        #[cfg(feature = "all-methods")]
        "adams_bashforth3" => methods::AdamsBashforth3.into(),
        #[cfg(feature = "all-methods")]
        "adams_bashforth4" => methods::AdamsBashforth4.into(),
        _ => methods::Dop853.into(),
    }
}
