//! What varies between the runs: grids, lists, random samples.
//!
//! Every kind is a function of the number of the run alone. So a block of runs can be made by any core, on
//! any machine, and again.

mod correlation;
mod distribution;
mod error;
mod grid;
mod importance_design;
mod latin_hypercube;
mod points;
mod samples;
mod sobol;
mod sobol_table;

pub(crate) use distribution::standard_normal;
pub use error::InputError;
pub use grid::Grid;
pub use importance_design::ImportanceDesign;
pub(crate) use importance_design::RUNS_OF_GROUP;
pub use points::Points;
pub use samples::Samples;

use dynamics_view::text::exact;

/// What varies between the runs of an ensemble. Implement it for a generator of your own.
///
/// ```
/// # mod dynamics { pub use dynamics_ensembles as ensembles; }
/// use dynamics::ensembles::Inputs;
///
/// /// Angles that come ever closer to the top.
/// struct TowardsTheTop;
///
/// impl Inputs for TowardsTheTop {
///     fn names(&self) -> Vec<String> {
///         vec!["theta".into()]
///     }
///     fn count(&self) -> usize {
///         50
///     }
///     fn point(&self, run: usize, values: &mut [f64]) {
///         values[0] = std::f64::consts::PI - 0.5_f64.powi(run as i32);
///     }
///     fn plan(&self) -> Vec<(String, String)> {
///         vec![("inputs".into(), "towards the top by halves".into())]
///     }
/// }
/// ```
pub trait Inputs: Sync {
    /// The parameters and elements of the start that vary, by name, each once.
    fn names(&self) -> Vec<String>;

    /// How many runs.
    fn count(&self) -> usize;

    /// Writes the values of a run, from 0 to count − 1, in the order of the names. They must depend on the
    /// number of the run alone: the run may be made by any machine, and again.
    fn point(&self, run: usize, values: &mut [f64]);

    /// What identifies the values: names and texts. Runs of a plan with other texts are not mixed with these.
    fn plan(&self) -> Vec<(String, String)>;

    /// Checks what was given.
    ///
    /// # Errors
    /// What cannot be.
    fn check(&self) -> Result<(), InputError> {
        Ok(())
    }
}

/// A digest of numbers, in hexadecimal: different for different numbers, but for chance.
pub(crate) fn digest(numbers: impl IntoIterator<Item = f64>) -> String {
    let mut hash = crate::hash::Hash::new();
    numbers.into_iter().for_each(|x| hash.add(x.to_bits()));
    format!("{:016x}", hash.value())
}

/// A list as text: all of a short one, of a long one its size, its ends and a digest.
fn list(values: &[f64]) -> String {
    /// Most numbers that are written out.
    const WRITTEN_OUT: usize = 12;
    let all = |values: &[f64]| values.iter().map(|x| exact(*x)).collect::<Vec<_>>().join(" ");
    match values {
        [first, .., last] if values.len() > WRITTEN_OUT => format!(
            "{} values from {} to {}, digest {}",
            values.len(),
            exact(*first),
            exact(*last),
            digest(values.iter().copied())
        ),
        _ => all(values),
    }
}
