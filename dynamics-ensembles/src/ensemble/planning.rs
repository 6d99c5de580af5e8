//! From the options of an ensemble to its plan: names are checked, and what results depend on is written
//! down.

use dynamics_analysis::Variable;
use dynamics_runtime::model::{Dynamics, ModelState, Parameters};
use dynamics_runtime::simulate::Simulate;
use dynamics_view::text::exact;

use super::Ensemble;
use crate::description::Description;
use crate::equations;
use crate::error::EnsembleError;
use crate::files::FileFormat;
use crate::places::Cores;
use crate::plan::{Partition, Plan};
use crate::rows::EnsembleColumn;
use crate::runs::{Kept, Runs};

/// An ensemble that can run.
pub(crate) struct Planned<'m, M: Simulate> {
    pub(crate) runs: Runs<'m, M>,
    pub(crate) description: Description,
    pub(crate) partition: Partition,
    /// How the runs are made, and why.
    pub(crate) way: String,
}

impl<'m, M: Simulate + Parameters + Clone> Ensemble<'m, M> {
    /// Takes the options on which results do not depend.
    pub(super) fn rest(&mut self) -> Rest<'m> {
        Rest {
            shard: self.shard,
            path: self.path.take(),
            fail_fast: self.fail_fast,
            progress: self.progress,
            place: std::mem::replace(&mut self.place.place, Box::new(Cores::default())),
        }
    }

    /// Checks what was given, and makes the plan.
    pub(super) fn planned(self, rest: &mut Rest<'m>) -> Result<Planned<'m, M>, EnsembleError> {
        let Self { model, start, inputs, until, tolerance, options, kept, columns, label, .. } = self;
        let elsewhere = self.place.elsewhere;
        rest.check()?;
        if self.block == 0 {
            return Err(EnsembleError::EmptyBlock);
        }
        if matches!(kept, Kept::Computed(_)) {
            let given = [
                ("until", until.is_some()),
                ("tolerance", tolerance.is_some()),
                ("options", options.is_some()),
            ];
            if let Some((option, _)) = given.into_iter().find(|(_, given)| *given) {
                return Err(EnsembleError::OptionOfNothing { option });
            }
        }
        inputs.check()?;
        let partition = Partition { runs: inputs.count(), block: self.block };
        if partition.runs == 0 {
            return Err(crate::InputError::TooFew { least: 1 }.into());
        }
        if partition.runs as u64 > 1 << 52 {
            return Err(crate::InputError::TooMany.into());
        }
        let names = inputs.names();
        let variables = Variable::all_of::<M>(&names)?;
        let mut first = vec![0.0; variables.len()];
        inputs.point(0, &mut first);
        for (variable, value) in variables.iter().zip(&first) {
            variable.check(model, &start, *value)?;
        }
        let mut all: Vec<EnsembleColumn> = variables.iter().map(|variable| column::<M>(*variable)).collect();
        all.extend(columns.unwrap_or_else(Runs::<M>::columns_of_end));
        if let Some(name) = twice(&all) {
            return Err(EnsembleError::ColumnTwice { name });
        }
        if let Some(path) = &rest.path {
            FileFormat::of(path)?.check_names(&all)?;
        }
        let width = all.len();
        let mut runs =
            Runs { model, start, inputs, variables, until, tolerance, options, kept, width, elsewhere };
        let alone = runs.made_alone_because();
        if alone.is_some() && runs.elsewhere.take().is_some() {
            // What a card cannot make the cores make.
            rest.place = Box::new(Cores::default());
        }
        let way = match &alone {
            None if runs.elsewhere.is_some() => "side by side, in the threads of the card".into(),
            None => "side by side, in the vectors of the processor".into(),
            Some(why) => format!("one by one: {why}"),
        };
        let plan = plan_of(&runs, &all, partition, alone.is_none(), label);
        let description = Description { plan, columns: all, runs: partition.runs, failed: Vec::new() };
        Ok(Planned { runs, description, partition, way })
    }
}

/// The options on which results do not depend.
pub(super) struct Rest<'m> {
    pub(super) shard: Option<(usize, usize)>,
    pub(super) path: Option<std::path::PathBuf>,
    pub(super) fail_fast: bool,
    pub(super) progress: bool,
    pub(super) place: Box<dyn crate::places::Place + 'm>,
}

impl Rest<'_> {
    fn check(&self) -> Result<(), EnsembleError> {
        let is_divided = self.place.is_divided();
        let who = if is_divided { "running on several ranks" } else { "a shard" };
        match self.shard {
            Some((rank, ranks)) if rank >= ranks => Err(EnsembleError::Shard { rank, ranks }),
            Some(_) if is_divided => Err(EnsembleError::ShardTwice { who }),
            shard if self.path.is_none() && (is_divided || shard.is_some()) => {
                Err(EnsembleError::NoFile { who })
            }
            _ => Ok(()),
        }
    }
}

/// The column of an input.
fn column<M: Dynamics>(variable: Variable) -> EnsembleColumn {
    EnsembleColumn { name: variable.name::<M>(), unit: variable.unit::<M>(), is_input: true }
}

/// A name that two columns have.
fn twice(columns: &[EnsembleColumn]) -> Option<String> {
    let is_known = |k: usize| columns[..k].iter().any(|column| column.name == columns[k].name);
    (0..columns.len()).find(|k| is_known(*k)).map(|k| columns[k].name.clone())
}

/// Everything that results depend on.
fn plan_of<M: Simulate + Parameters + Clone>(
    runs: &Runs<'_, M>,
    columns: &[EnsembleColumn],
    partition: Partition,
    is_in_lanes: bool,
    label: Option<String>,
) -> Plan {
    // What varies has the values of the first run, whatever it has in the model and the start.
    let (model, start) = runs.point(0).unwrap_or_else(|_| (runs.model.clone(), runs.start));
    let mut plan = Plan::default();
    plan.note("dynamics", env!("CARGO_PKG_VERSION"));
    plan.note("model", M::NAME);
    plan.note("equations", equations::of_model(&model, &start));
    let fixed = |variable: Variable| !runs.variables.contains(&variable);
    for (i, parameter) in M::PARAMETERS.iter().enumerate().filter(|(i, _)| fixed(Variable::Parameter(*i))) {
        let value = model.parameter(i).map_or("not known".into(), exact);
        plan.note(format!("parameter {}", parameter.name), value);
    }
    plan.note("start t", exact(start.t()));
    for (i, _) in M::COORDINATES.iter().enumerate() {
        let both = [(Variable::Position(i), start.q()[i]), (Variable::Velocity(i), start.u()[i])];
        for (variable, value) in both.into_iter().filter(|(variable, _)| fixed(*variable)) {
            plan.note(format!("start {}", variable.name::<M>()), exact(value));
        }
    }
    for (i, input) in M::INPUTS.iter().enumerate() {
        plan.note(format!("start {}", input.name), exact(start.inputs()[i]));
    }
    plan.note("start constraints", format!("{:?}", start.active_set()));
    if !matches!(runs.kept, Kept::Computed(_)) {
        for (name, value) in runs.simulation(&model, start).described() {
            plan.note(format!("option {name}"), value);
        }
    }
    let way = match (&runs.kept, is_in_lanes, &runs.elsewhere) {
        (Kept::Computed(_), ..) => "computed".into(),
        (Kept::Motion(_), ..) => "motions".into(),
        (_, false, _) => "ends, one by one".into(),
        // The last digits depend on it.
        (_, true, Some(place)) => place.way(),
        (_, true, None) if dynamics_runtime::lanes::has_fused_lanes() => {
            String::from("ends, side by side with fused products")
        }
        (_, true, None) => "ends, side by side without fused products".into(),
    };
    plan.note("way", way);
    if let Some(label) = label {
        plan.note("label", label);
    }
    let kept = columns.iter().filter(|column| !column.is_input).map(EnsembleColumn::head);
    plan.note("keeps", kept.collect::<Vec<_>>().join(", "));
    runs.inputs.plan().into_iter().for_each(|(name, text)| plan.note_of_inputs(&name, text));
    plan.note_partition(partition);
    plan
}
