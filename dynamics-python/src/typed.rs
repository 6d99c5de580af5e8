//! Classes, models and motions with their types: what `module!` instantiates.

use std::sync::Arc;

use dynamics::analysis::Analyze as _;
use dynamics::live::OpenLive as _;
use dynamics::model::{ModelState as _, State, Vector as _};
use dynamics::simulate::{Motion, MotionRecord, Summary};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::argument::{Argument, Given, plain};
use crate::data::{Columns, Evaluation, EventData, GivenState, LinearData, Matrix, StateData, Table, vector};
use crate::erased::{AnyClass, AnyModel, AnyMotion, File, LiveOptions, RunResult, States, Times};
use crate::evaluate;
use crate::info::{Field, Info, Scalars, Slot};
use crate::law::{Function, Interruption, Signals};
use crate::options::{Callbacks, Options};
use crate::python_model::PythonModel;
use crate::run::Run;

/// A field: its name, and its types in stubs as an argument and as an attribute.
#[derive(Clone, Copy, Debug)]
pub struct FieldTypes {
    name: &'static str,
    takes: &'static str,
    gives: &'static str,
}

impl FieldTypes {
    /// Of the field that a function returns.
    #[must_use]
    pub fn of<M, T: Argument>(name: &'static str, _: fn(&M) -> &T) -> Self {
        Self { name: plain(name), takes: T::TAKES, gives: T::GIVES }
    }
}

/// A model with its fields, as `module!` reads them.
#[diagnostic::on_unimplemented(
    message = "the fields of this model are not known; put `#[derive(Dynamics)]` on the struct, or, if it is one \
        of another crate, write its fields: `Model {{ mass, length }}`",
    label = "a struct without `#[derive(Dynamics)]`, or of another crate"
)]
pub trait ModelFields: Send + Sync + 'static {
    /// The model.
    type Model: PythonModel;
    /// Names of the fields, and their types in stubs.
    fn fields() -> Vec<FieldTypes>;
    /// The model's texts: equations, LaTeX, report, listing.
    const TEXTS: [&'static str; 4];
    /// The model of keyword arguments.
    ///
    /// # Errors
    /// Arguments that are missing, unknown or of another kind.
    fn construct(given: &mut Given<'_, '_>) -> PyResult<Self::Model>;
    /// Sets the field with this name; returns what its attribute shows.
    ///
    /// # Errors
    /// A value of another kind.
    fn set<'py>(
        model: &mut Self::Model,
        info: &Info,
        name: &str,
        value: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>>;
}

/// The class of a model.
pub(crate) struct Class<F> {
    info: Arc<Info>,
    fields: core::marker::PhantomData<fn() -> F>,
}

impl<F: ModelFields> Class<F> {
    pub(crate) fn new() -> Self {
        Self { info: Arc::new(info::<F>()), fields: core::marker::PhantomData }
    }
}

fn info<F: ModelFields>() -> Info {
    use dynamics::model::{Constraints, Described, Dynamics, Events, Outputs};
    type Of<F> = <F as ModelFields>::Model;
    let parameters = Slot::of(<Of<F>>::PARAMETERS);
    let documented = <Of<F> as Described>::FIELD_DOCUMENTATION;
    let field = |FieldTypes { name, takes, gives }: FieldTypes| {
        // The components of vectors and matrices have names after a point.
        let same = |slot: &&Slot| slot.name == name || slot.name.split('.').next() == Some(name);
        let unit = parameters.iter().find(same).map_or(String::new(), |slot| slot.unit.clone());
        let documentation = documented.iter().find(|(field, _)| *field == name).map_or("", |(_, text)| text);
        Field { name, unit, documentation, takes, gives }
    };
    let [equations, latex, report, listing] = F::TEXTS;
    Info {
        class: std::sync::OnceLock::new(),
        name: <Of<F> as Described>::NAME,
        documentation: <Of<F> as Described>::DOCUMENTATION,
        fields: F::fields().into_iter().map(field).collect(),
        coordinates: Slot::of(<Of<F>>::COORDINATES),
        inputs: Slot::of(<Of<F>>::INPUTS),
        speeds: Slot::of(<Of<F>>::SPEEDS),
        outputs: <Of<F> as Outputs>::OUTPUTS,
        events: <Of<F> as Events>::EVENTS,
        scalars: Scalars { coordinates: <Of<F>>::COORDINATES, inputs: <Of<F>>::INPUTS },
        rows: <Of<F> as Constraints>::ROWS,
        constraints: <Of<F> as Constraints>::CONSTRAINTS
            .iter()
            .map(|constraint| (constraint.name, constraint.switched.is_some()))
            .collect(),
        conserved: <Of<F>>::CONSERVED.iter().map(|quantity| quantity.name).collect(),
        equations,
        latex,
        report,
        listing,
    }
}

impl<F: ModelFields> AnyClass for Class<F> {
    fn info(&self) -> &Arc<Info> {
        &self.info
    }

    fn construct<'py>(
        &self,
        values: &Bound<'py, PyDict>,
    ) -> PyResult<(Arc<dyn AnyModel>, Bound<'py, PyDict>)> {
        let mut given = Given::new(&self.info, values)?;
        let model = Arc::new(F::construct(&mut given)?);
        Ok((Arc::new(Instance::<F> { info: Arc::clone(&self.info), model }), given.shown))
    }
}

/// A model of a class.
struct Instance<F: ModelFields> {
    info: Arc<Info>,
    model: Arc<F::Model>,
}

impl<F: ModelFields> AnyModel for Instance<F> {
    fn with_field<'py>(
        &self,
        name: &str,
        value: &Bound<'py, PyAny>,
    ) -> PyResult<(Arc<dyn AnyModel>, Bound<'py, PyAny>)> {
        let mut model = (*self.model).clone();
        let shown = F::set(&mut model, &self.info, name, value)?;
        Ok((Arc::new(Self { info: Arc::clone(&self.info), model: Arc::new(model) }), shown))
    }

    fn state(&self, given: &GivenState) -> Result<StateData, String> {
        use dynamics::__private::Complete;
        let (model, state) = (&*self.model, given.state.typed::<F::Model>());
        let flags = [&given.given_q[..], &given.given_u[..]];
        let built = match (&given.speeds, given.assemble) {
            (Some(speeds), assemble) => Complete::moved(model, state, flags, speeds, assemble, given.sided),
            (None, true) => Complete::assembled(model, state, flags, given.sided),
            (None, false) => Complete::built(model, state, given.sided),
        };
        built.map(|state| StateData::of(&state)).map_err(|error| error.to_string())
    }

    fn simulate(
        self: Arc<Self>,
        start: &StateData,
        options: &Options,
        callbacks: Arc<Callbacks>,
        interruption: &Interruption,
        signals: &Signals,
    ) -> RunResult {
        let run = Run { model: &*self.model, info: &self.info, callbacks: &callbacks, interruption, signals };
        let (record, failure) = run.run(start.typed::<F::Model>(), options);
        let motion = |record| -> Arc<dyn AnyMotion> {
            let (info, model) = (Arc::clone(&self.info), Arc::clone(&self.model));
            Arc::new(Recorded { info, model, record, callbacks, options: options.clone() })
        };
        (record.map(motion), failure)
    }

    fn evaluate(&self, what: Evaluation, at: &States) -> Result<(Vec<f64>, Vec<usize>), String> {
        evaluate::evaluate(&*self.model, what, at)
    }

    fn live(&self, start: &StateData, options: &LiveOptions) -> Result<String, String> {
        live_page(&*self.model, start.typed::<F::Model>(), options)
    }

    fn equilibrium(&self, near: &StateData) -> Result<(StateData, String, String), String> {
        let found = self.model.equilibrium(&near.typed::<F::Model>()).map_err(|error| error.to_string())?;
        let verdict = match self.model.stability(&found.state) {
            Ok(stability) => stability.to_string(),
            Err(error) => format!("not known: {error}"),
        };
        Ok((StateData::of(&found.state), found.to_string(), verdict))
    }

    fn linearize(&self, at: &StateData) -> Result<LinearData, String> {
        let linear = self.model.linearize(&at.typed::<F::Model>()).map_err(|error| error.to_string())?;
        let modes = linear.modes().map_err(|error| error.to_string())?;
        let matrix = |rows: usize, columns: usize, at: &dyn Fn(usize, usize) -> f64| Matrix {
            rows,
            columns,
            values: (0..rows).flat_map(|i| (0..columns).map(move |j| at(i, j))).collect(),
        };
        let [mass, damping, stiffness, input] =
            [&linear.mass, &linear.damping, &linear.stiffness, &linear.input]
                .map(|from| matrix(from.nrows(), from.ncols(), &|i, j| from[(i, j)]));
        Ok(LinearData {
            coordinates: linear.coordinates.iter().map(|quantity| quantity.name.to_owned()).collect(),
            mass,
            damping,
            stiffness,
            input,
            modes: modes.iter().map(|mode| (mode.frequency(), mode.damping_ratio())).collect(),
            text: linear.to_string(),
        })
    }
}

fn live_page<M: PythonModel>(model: &M, start: State<M>, options: &LiveOptions) -> Result<String, String> {
    let mut page = model.live(start);
    if let Some(title) = &options.title {
        page = page.title(title);
    }
    for (name, [from, to]) in &options.ranges {
        page = page.range(name, *from, *to);
    }
    page = page.hold(&options.hold).plot(&options.plots);
    if let Some(phase) = &options.phase {
        page = page.phase(phase);
    }
    if let Some(tolerance) = options.tolerance {
        page = page.tolerance(tolerance);
    }
    if let Some(until) = options.until {
        page = page.until(until);
    }
    for (name, contact) in &options.run.contacts {
        page = page.contact(name, *contact);
    }
    for (name, event) in &options.run.stick_slips {
        page = page.stick_slip(name, event);
    }
    for (name, direction) in &options.run.stops {
        page = page.stop_at(name, *direction);
    }
    page.to_html().map_err(|error| error.to_string())
}

/// A motion, with what it was made with.
struct Recorded<M: PythonModel> {
    info: Arc<Info>,
    model: Arc<M>,
    record: MotionRecord<M>,
    callbacks: Arc<Callbacks>,
    options: Options,
}

impl<M: PythonModel> Recorded<M> {
    /// The motion with its law of inputs.
    fn motion<'a>(&'a self, interruption: &'a Interruption) -> Motion<'a, M> {
        let Some(function) = &self.callbacks.inputs else { return self.record.motion(&*self.model) };
        let law = Function { info: &self.info, function, interruption };
        self.record.motion_with_inputs(&*self.model, move |t, state: &M::State| {
            vector::<M::Inputs>(&law.inputs(t, StateData::of(state)))
        })
    }
}

impl<M: PythonModel> AnyMotion for Recorded<M> {
    fn interval(&self) -> (f64, f64) {
        let motion = self.record.motion(&*self.model);
        (motion.start_time(), motion.end_time())
    }

    fn callbacks(&self) -> &Callbacks {
        &self.callbacks
    }

    fn start(&self, interruption: &Interruption) -> StateData {
        StateData::of(&self.motion(interruption).start())
    }

    fn end(&self, interruption: &Interruption) -> StateData {
        StateData::of(&self.motion(interruption).end())
    }

    fn at(&self, t: f64, interruption: &Interruption) -> Result<StateData, String> {
        let state = self.motion(interruption).try_at(t).map_err(|error| error.to_string())?;
        Ok(StateData::of(&state))
    }

    fn table(&self, times: Times, columns: Columns, interruption: &Interruption) -> Result<Table, String> {
        let motion = self.motion(interruption);
        let mut table = Table::default();
        match times {
            Times::OfRun => motion.states().for_each(|state| add_row(&mut table, &motion, &state, columns)),
            Times::These(times) => {
                let mut sampler = motion.sampler();
                for t in times {
                    let state = sampler.at(t);
                    if state.q().as_slice().iter().any(|q| q.is_nan()) {
                        // Says that the time is outside, where it is.
                        motion.try_at(t).map_err(|error| error.to_string())?;
                    }
                    add_row(&mut table, &motion, &state, columns);
                }
            }
        }
        let rows = table.t.len();
        let counts = [M::COORDINATES.len(), M::INPUTS.len(), M::OUTPUTS.len(), M::ROWS.len()];
        let Table { q, u, inputs, outputs, accelerations, multipliers, .. } = &mut table;
        for (matrix, columns) in [
            (q, counts[0]),
            (u, counts[0]),
            (accelerations, counts[0]),
            (inputs, counts[1]),
            (outputs, counts[2]),
            (multipliers, counts[3]),
        ] {
            (matrix.rows, matrix.columns) = (rows, columns);
        }
        Ok(table)
    }

    fn events(&self, interruption: &Interruption) -> Vec<EventData> {
        let motion = self.motion(interruption);
        let data = |event: &dynamics::simulate::EventRecord<M::State>| EventData {
            name: event.name.clone(),
            rising: matches!(event.direction, dynamics::simulate::Direction::Rising),
            before: StateData::of(&motion.complete(event.before)),
            after: StateData::of(&motion.complete(event.after)),
            energy_lost: event.energy_lost(),
            impacts: event.impacts.len(),
            stopped: event.stopped,
        };
        motion.events().iter().map(data).collect()
    }

    fn summary(&self, verify: bool, interruption: &Interruption) -> Summary {
        let motion = self.motion(interruption);
        if verify { motion.verify() } else { motion.summary() }
    }

    fn page(&self, interruption: &Interruption) -> Result<String, String> {
        self.motion(interruption).animation().to_html().map_err(|error| error.to_string())
    }

    fn write(&self, what: File, path: &std::path::Path, interruption: &Interruption) -> Result<(), String> {
        let motion = self.motion(interruption);
        let written = match what {
            File::Page => motion.animate(path),
            File::Table => motion.write_csv(path),
            File::History => motion.plot(path),
            File::Outputs => motion.plot_outputs(path),
            File::Energy => motion.plot_energy(path),
        };
        written.map_err(|error| error.to_string())
    }

    fn live(&self, interruption: &Interruption) -> Result<String, String> {
        let start = self.motion(interruption).start();
        let mut run = self.options.clone();
        // A page has the model's own events, not those that were functions of Python.
        let of_model = |event: &str| self.callbacks.events.iter().all(|(name, _)| name != event);
        run.stops.retain(|(name, _)| of_model(name));
        run.stick_slips.retain(|(_, event)| of_model(event));
        let options = LiveOptions { run, ..LiveOptions::default() };
        live_page(&*self.model, start, &options)
    }
}

/// Appends a state to a table.
fn add_row<M: PythonModel>(table: &mut Table, motion: &Motion<'_, M>, state: &M::State, columns: Columns) {
    table.t.push(state.t());
    table.q.values.extend(state.q().as_slice());
    table.u.values.extend(state.u().as_slice());
    table.inputs.values.extend(state.inputs().as_slice());
    if columns.outputs {
        table.outputs.values.extend(motion.outputs_of(state));
    }
    if columns.accelerations {
        table.accelerations.values.extend(motion.accelerations_of(state).as_slice());
    }
    if columns.multipliers {
        table.multipliers.values.extend(motion.multipliers_of(state).as_slice());
    }
    if columns.energy {
        table.energy.push(motion.model().energy_function(state));
    }
}
