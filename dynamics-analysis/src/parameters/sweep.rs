//! Runs over a grid of parameters and starts.
//!
//! Each run has its own model and start and is independent of the others. So results do not depend on the
//! number of cores or on their timing. They are in the order of the grid, with the last axis fastest. A run
//! that fails is kept as its failure.

mod error;
mod show;

use alloc::borrow::ToOwned;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Range;

pub use error::{RunFailure, SweepError};

use dynamics_runtime::model::Parameters;
use dynamics_runtime::simulate::{Simulate, Simulation, ends};

use super::parallel::{ordered, ordered_blocks, side_by_side_length};
use super::variable::{Variable, VariableError};

/// Most runs of a sweep: the results of more than 2³² runs fit no memory.
const MAX_RUNS: u64 = 1 << 32;

/// An axis of the grid, checked.
struct GridAxis {
    variable: Variable,
    values: Vec<f64>,
}

/// A grid with checked axes.
struct Grid {
    axes: Vec<GridAxis>,
    lengths: Vec<usize>,
    count: usize,
}

impl Grid {
    /// The axes, as the result of a sweep has them.
    fn named<M: Simulate + Parameters + Clone>(&self) -> Vec<SweepAxis> {
        let named = |axis: &GridAxis| SweepAxis {
            name: axis.variable.name::<M>(),
            unit: axis.variable.unit::<M>(),
            values: axis.values.clone(),
        };
        self.axes.iter().map(named).collect()
    }
}

/// A sweep with its options, before it runs.
///
/// ```text
/// let angles = (0..300).map(|i| -3.0 + 0.02 * f64::from(i));
/// let sweep = model
///     .sweep(start)
///     .over("theta1", angles.clone())
///     .over("theta2", angles)
///     .run(["flips_at"], |model, start| Ok([first_flip(&model.simulate(start).until(30.0).run()?)]))?;
/// sweep.write_csv("flips.csv")?;
/// ```
#[must_use = "a sweep does nothing until `.run(..)`"]
pub struct Sweeping<'m, M: Simulate> {
    model: &'m M,
    start: M::State,
    axes: Vec<(String, Vec<f64>)>,
    threads: Option<usize>,
    progress: bool,
}

impl<'m, M: Simulate + Parameters + Clone> Sweeping<'m, M> {
    pub(super) fn new(model: &'m M, start: M::State) -> Self {
        Self { model, start, axes: Vec::new(), threads: None, progress: false }
    }

    /// Adds an axis to the grid: values of a parameter, of a coordinate or of a velocity at the start.
    pub fn over(mut self, name: &str, values: impl IntoIterator<Item = f64>) -> Self {
        self.axes.push((name.to_owned(), values.into_iter().collect()));
        self
    }

    /// The number of cores, at least one. Without this all cores are used.
    #[cfg(feature = "parallel")]
    pub fn threads(mut self, count: usize) -> Self {
        self.threads = Some(count.max(1));
        self
    }

    /// Shows how many runs are done, on the error stream, where all take longer than a second.
    #[cfg(feature = "progress")]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    /// Makes all runs and keeps numbers of their ends only. `options` gets the model and the simulation of a
    /// run and completes it: `.until(..)`, a tolerance, events. `of_end` gets the model and the last state,
    /// at the end time or where `.stop_at(..)` ended the run. This takes a part of the time of
    /// [`Sweeping::run`] where runs can be made side by side, see [`ends`].
    ///
    /// ```text
    /// let sweep = sweep.ends(["theta1"], |_, run| run.until(30.0), |_, end| [end.theta1()])?;
    /// ```
    ///
    /// # Errors
    /// As of [`Sweeping::run`]. A simulation without an end time is a failure of its run.
    pub fn ends<const K: usize>(
        self,
        names: [&str; K],
        options: impl for<'a> Fn(&'a M, Simulation<'a, M>) -> Simulation<'a, M> + Sync,
        of_end: impl Fn(&M, M::State) -> [f64; K] + Sync,
    ) -> Result<Sweep<K>, SweepError>
    where
        M: Sync,
    {
        let grid = self.grid()?;
        let block = |runs: Range<usize>| {
            let points: Vec<(M, M::State)> = runs.map(|index| self.point(&grid, index)).collect();
            let ends = ends(points.iter().map(|(model, start)| options(model, model.simulate(*start))));
            let kept = |(end, (model, _)): (Result<M::State, _>, &(M, M::State))| Ok(of_end(model, end?));
            ends.into_iter().zip(&points).map(kept).collect()
        };
        // Where there are no lanes each run is made alone.
        let length = if M::HAS_LANES { side_by_side_length(grid.count, self.threads) } else { 1 };
        let results = ordered_blocks(grid.count, length, self.threads, self.progress, block);
        let results = results.map_err(SweepError::Threads)?;
        Ok(Sweep { axes: grid.named::<M>(), names: names.map(str::to_owned), results })
    }

    /// Makes all runs. `run` gets the model and the start of a point of the grid, and returns the numbers
    /// that are kept of it under these names.
    ///
    /// # Errors
    /// Names that are unknown or occur twice, values that are not finite, an axis without values, more than
    /// 2³² runs, threads that cannot be started. A run that fails is not an error of the sweep: the failure
    /// is stored in its place.
    pub fn run<const K: usize>(
        self,
        names: [&str; K],
        run: impl Fn(&M, M::State) -> Result<[f64; K], RunFailure> + Sync,
    ) -> Result<Sweep<K>, SweepError>
    where
        M: Sync,
    {
        let grid = self.grid()?;
        let one = |index: usize| {
            let (model, start) = self.point(&grid, index);
            run(&model, start)
        };
        let results = ordered(grid.count, self.threads, self.progress, one).map_err(SweepError::Threads)?;
        Ok(Sweep { axes: grid.named::<M>(), names: names.map(str::to_owned), results })
    }

    /// The grid, checked.
    fn grid(&self) -> Result<Grid, SweepError> {
        let axes = self.check()?;
        let lengths: Vec<usize> = axes.iter().map(|axis| axis.values.len()).collect();
        let count = lengths.iter().try_fold(1_usize, |product, n| product.checked_mul(*n));
        let count = count.filter(|count| *count as u64 <= MAX_RUNS).ok_or(SweepError::TooMany)?;
        Ok(Grid { axes, lengths, count })
    }

    /// The model and the start at a point of the grid.
    fn point(&self, grid: &Grid, index: usize) -> (M, M::State) {
        let (mut model, mut start) = (self.model.clone(), self.start);
        for (axis, i) in grid.axes.iter().zip(grid_indices(&grid.lengths, index)) {
            axis.variable.set(&mut model, &mut start, axis.values[i]);
        }
        (model, start)
    }

    /// The axes, with their names resolved and their values checked.
    fn check(&self) -> Result<Vec<GridAxis>, SweepError> {
        let mut axes: Vec<GridAxis> = Vec::new();
        for (name, values) in &self.axes {
            let variable = Variable::of::<M>(name)?;
            if axes.iter().any(|axis| axis.variable == variable) {
                return Err(VariableError::Twice { name: name.clone() }.into());
            }
            if let Some(value) = values.iter().find(|value| !value.is_finite()) {
                return Err(VariableError::NotFinite { name: name.clone(), value: *value }.into());
            }
            let first = values.first().ok_or_else(|| SweepError::Empty { name: name.clone() })?;
            variable.check(self.model, &self.start, *first)?;
            axes.push(GridAxis { variable, values: values.clone() });
        }
        if axes.is_empty() { Err(SweepError::NoAxis) } else { Ok(axes) }
    }
}

/// The index of a run on each axis; the last axis is fastest.
#[must_use]
pub fn grid_indices(lengths: &[usize], mut index: usize) -> Vec<usize> {
    let mut found = alloc::vec![0; lengths.len()];
    for (at, n) in found.iter_mut().zip(lengths).rev() {
        (*at, index) = (index % n, index / n);
    }
    found
}

/// An axis of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepAxis {
    /// The parameter or element of the start that varies.
    pub name: String,
    /// Its unit, `""` where it is 1 or not known.
    pub unit: String,
    /// The values, in the order in which they were given.
    pub values: Vec<f64>,
}

/// The result of a sweep: K numbers, or the failure, for each run.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep<const K: usize> {
    /// The axes of the grid.
    pub axes: Vec<SweepAxis>,
    /// Names of the numbers.
    pub names: [String; K],
    /// A result for each point of the grid, the last axis running fastest.
    pub results: Vec<Result<[f64; K], RunFailure>>,
}

impl<const K: usize> Sweep<K> {
    /// The values on the axes at the run of this index; NaN where there is no such run.
    #[must_use]
    pub fn at(&self, index: usize) -> Vec<f64> {
        if index >= self.results.len() {
            return alloc::vec![f64::NAN; self.axes.len()];
        }
        let lengths: Vec<usize> = self.axes.iter().map(|axis| axis.values.len()).collect();
        grid_indices(&lengths, index).into_iter().zip(&self.axes).map(|(i, axis)| axis.values[i]).collect()
    }

    /// The runs that failed, with their indices.
    pub fn failures(&self) -> impl Iterator<Item = (usize, &RunFailure)> {
        self.results.iter().enumerate().filter_map(|(i, result)| Some((i, result.as_ref().err()?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_axis_runs_fastest() {
        let places: Vec<_> = (0..6).map(|i| grid_indices(&[2, 3], i)).collect();
        assert_eq!(places, [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]]);
    }
}
