//! The runs of an ensemble: model, start and options of each, and what is kept of it.

use std::ops::Range;

use dynamics_analysis::{RunFailure, Variable};
use dynamics_runtime::model::{ModelState, Parameters, Vector};
use dynamics_runtime::simulate::{Motion, Simulate, Simulation, ends};

use crate::error::EnsembleError;
use crate::inputs::Inputs;
use crate::places::{EndsElsewhere, MakesRows};
use crate::rows::{EnsembleColumn, FailedRun, Rows};

/// Completes the simulation of a run.
pub(crate) type RunOptions<'m, M> =
    Box<dyn for<'a> Fn(&'a M, Simulation<'a, M>) -> Simulation<'a, M> + Sync + 'm>;
/// Writes numbers of the end of a run.
type OfEnd<'m, M> = Box<
    dyn Fn(&M, <M as dynamics_runtime::model::Model>::State, &mut [f64]) -> Result<(), RunFailure>
        + Sync
        + 'm,
>;
/// Writes numbers of a motion.
type OfMotion<'m, M> = Box<dyn Fn(&Motion<'_, M>, &mut [f64]) -> Result<(), RunFailure> + Sync + 'm>;

/// What is kept of a run.
pub(crate) enum Kept<'m, M: Simulate> {
    /// The last state as it is.
    EndState,
    /// Numbers of the last state.
    End(OfEnd<'m, M>),
    /// Numbers of the motion.
    Motion(OfMotion<'m, M>),
    /// What a function makes of model and start.
    Computed(OfEnd<'m, M>),
}

/// All runs of an ensemble.
pub(crate) struct Runs<'m, M: Simulate> {
    pub(crate) model: &'m M,
    pub(crate) start: M::State,
    pub(crate) inputs: Box<dyn Inputs + 'm>,
    pub(crate) variables: Vec<Variable>,
    pub(crate) until: Option<f64>,
    pub(crate) tolerance: Option<f64>,
    pub(crate) options: Option<RunOptions<'m, M>>,
    pub(crate) kept: Kept<'m, M>,
    /// Columns of the table.
    pub(crate) width: usize,
    /// What makes ends in place of the lanes of the processor.
    pub(crate) elsewhere: Option<Box<dyn EndsElsewhere<M> + 'm>>,
}

impl<'m, M: Simulate + Parameters + Clone> Runs<'m, M> {
    /// The simulation of a run.
    pub(crate) fn simulation<'a>(&self, model: &'a M, start: M::State) -> Simulation<'a, M> {
        let mut simulation = model.simulate(start);
        if let Some(until) = self.until {
            simulation = simulation.until(until);
        }
        if let Some(tolerance) = self.tolerance {
            simulation = simulation.tolerance(tolerance);
        }
        match &self.options {
            Some(options) => options(model, simulation),
            None => simulation,
        }
    }

    /// Why runs are made one by one; `None` where they are made side by side.
    pub(crate) fn made_alone_because(&self) -> Option<String> {
        match &self.kept {
            Kept::EndState | Kept::End(_) => {
                let (model, start) = self.point(0).unwrap_or_else(|_| (self.model.clone(), self.start));
                self.simulation(&model, start).made_alone_because()
            }
            Kept::Motion(_) => {
                Some("`.keep(..)` needs whole motions; `.keep_ends(..)` needs the ends only".into())
            }
            Kept::Computed(_) => Some("`.compute(..)` makes them".into()),
        }
    }

    /// The model and the start of a run; the reason if it has none.
    pub(crate) fn point(&self, run: usize) -> Result<(M, M::State), String> {
        let mut values = vec![0.0; self.variables.len()];
        self.inputs.point(run, &mut values);
        self.at(&values)
    }

    fn at(&self, values: &[f64]) -> Result<(M, M::State), String> {
        let (mut model, mut start) = (self.model.clone(), self.start);
        for (variable, value) in self.variables.iter().zip(values) {
            if !value.is_finite() {
                return Err(format!("`{}` cannot be {value}; give finite numbers", variable.name::<M>()));
            }
            variable.set(&mut model, &mut start, *value);
        }
        Ok((model, start))
    }

    /// Keeps numbers of the last state.
    fn keep_end(&self, model: &M, end: M::State, row: &mut [f64]) -> Result<(), RunFailure> {
        match &self.kept {
            Kept::End(of_end) => of_end(model, end, row),
            _ => {
                let numbers = [end.t()];
                let numbers = numbers.iter().chain(end.q().as_slice()).chain(end.u().as_slice());
                row.iter_mut().zip(numbers).for_each(|(to, of)| *to = *of);
                Ok(())
            }
        }
    }

    /// The columns that are kept without a choice.
    pub(crate) fn columns_of_end() -> Vec<EnsembleColumn> {
        let positions = (0..M::Vector::LEN).map(Variable::Position);
        let velocities = (0..M::Vector::LEN).map(Variable::Velocity);
        let column = |variable: Variable| EnsembleColumn {
            name: format!("end_{}", variable.name::<M>()),
            unit: variable.unit::<M>(),
            is_input: false,
        };
        let time = EnsembleColumn { name: "end_t".into(), unit: "s".into(), is_input: false };
        std::iter::once(time).chain(positions.chain(velocities).map(column)).collect()
    }
}

/// The first line of what happened: the state follows in further lines, for which a table has no room. In a
/// file a failure without a reason would be none.
fn first_line(failure: &RunFailure) -> String {
    let first = failure.message.lines().map(str::trim).find(|line| !line.is_empty());
    first.unwrap_or("it failed and gave no reason").to_owned()
}

impl<M: Simulate + Parameters + Clone + Sync> MakesRows for Runs<'_, M> {
    fn rows(&self, runs: Range<usize>) -> Result<Rows, EnsembleError> {
        let inputs = self.variables.len();
        let mut values = vec![f64::NAN; runs.len() * self.width];
        let mut points = Vec::with_capacity(runs.len());
        let mut failed = Vec::new();
        for (run, row) in runs.clone().zip(values.chunks_mut(self.width)) {
            self.inputs.point(run, &mut row[..inputs]);
            points.push(self.at(&row[..inputs]));
        }
        // The runs that have a point, in order.
        let mut ends_in_order = match &self.kept {
            Kept::EndState | Kept::End(_) => {
                let with_point: Vec<&(M, M::State)> = points.iter().flatten().collect();
                let run = |i: usize| self.simulation(&with_point[i].0, with_point[i].1);
                match &self.elsewhere {
                    Some(place) => place.ends(with_point.len(), &run)?,
                    None => ends((0..with_point.len()).map(run)),
                }
            }
            _ => Vec::new(),
        }
        .into_iter();
        for ((run, row), point) in runs.clone().zip(values.chunks_mut(self.width)).zip(&points) {
            let row = &mut row[inputs..];
            let kept = match point {
                Err(message) => Err(RunFailure::new(message.clone())),
                Ok((model, start)) => match &self.kept {
                    Kept::Motion(of_motion) => self
                        .simulation(model, *start)
                        .run()
                        .map_err(RunFailure::from)
                        .and_then(|motion| of_motion(&motion, row)),
                    Kept::Computed(of_start) => of_start(model, *start, row),
                    Kept::EndState | Kept::End(_) => match ends_in_order.next() {
                        Some(Ok(end)) => self.keep_end(model, end, row),
                        Some(Err(error)) => Err(error.into()),
                        // There is an end for every run with a point.
                        None => Err(RunFailure::new("it has no end")),
                    },
                },
            };
            if let Err(failure) = kept {
                row.fill(f64::NAN);
                failed.push(FailedRun { run, message: first_line(&failure) });
            }
        }
        Ok(Rows { runs, values, failed })
    }

    fn inputs(&self, run: usize, row: &mut [f64]) {
        self.inputs.point(run, &mut row[..self.variables.len()]);
    }

    fn is_in_lanes(&self) -> bool {
        self.made_alone_because().is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_failure_has_a_reason() {
        for (message, line) in [
            ("stopped at 3\nand more", "stopped at 3"),
            ("\n  stopped ", "stopped"),
            ("", "it failed and gave no reason"),
            (" \n\r\n", "it failed and gave no reason"),
        ] {
            assert_eq!(first_line(&RunFailure::new(message)), line, "{message:?}");
        }
    }
}
