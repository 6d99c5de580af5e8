//! Why there is no fit.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use dynamics_runtime::wording::Readable;

use super::super::sensitivity_error::SensitivityError;
use super::super::variable::VariableError;
use super::{Fit, Fitted, Outlier};

/// Why unknowns were not found.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// A name or a value.
    #[error(transparent)]
    Variable(#[from] VariableError),
    /// Nothing is to be found.
    #[error("nothing is to be found; name parameters or starts with `.find(..)`")]
    NothingToFind,
    /// The model, written by hand, does not give the value of a parameter.
    #[error("the model does not tell the value of `{name}`; implement `Dynamics::parameter`")]
    NoParameterValue {
        /// The parameter.
        name: String,
    },
    /// A name given to `known` is not a parameter.
    #[error("`{name}` is no parameter but of the start; give it to the state of the experiment")]
    NotAParameter {
        /// The name.
        name: String,
    },
    /// Invalid bounds, or bounds that do not contain the first value.
    #[error(
        "`{name}` begins at {first}, which does not lie between {low} and {high}; let model, start \
         and bounds agree",
        low = .bounds[0],
        high = .bounds[1]
    )]
    Bounds {
        /// The unknown.
        name: String,
        /// The bounds.
        bounds: [f64; 2],
        /// Its first value.
        first: f64,
    },
    /// No data were given.
    #[error("there are no data; give some with `.data(..)`")]
    NoSeries,
    /// No data of a quantity were given.
    #[error("there are no data of `{name}`; give some, or leave it out")]
    NoData {
        /// The quantity.
        name: String,
    },
    /// A time or a value of the data is not a finite number.
    #[error("row {row} of `{name}` is ({time}, {value}); leave out what was not measured")]
    NotANumber {
        /// The quantity.
        name: String,
        /// The row, from 0.
        row: usize,
        /// Its time.
        time: f64,
        /// Its value.
        value: f64,
    },
    /// A value of the data is so large that its square is infinite.
    #[error(
        "row {row} of `{name}` is ({time}, {value:e}), too large for a sum of squares; leave it out, or give \
         it in another unit"
    )]
    TooLarge {
        /// The quantity.
        name: String,
        /// The row, from 0.
        row: usize,
        /// Its time.
        time: f64,
        /// Its value.
        value: f64,
    },
    /// The limit of a loss is not a positive number.
    #[error("the limit of the loss is {limit}; it has to be a positive number, in multiples of the scale")]
    Loss {
        /// What was given.
        limit: f64,
    },
    /// The search ended where an unknown diverged or has no certain digit: the data do not determine it.
    #[error(fmt = nothing_found)]
    NothingFound {
        /// The unknown.
        name: String,
        /// What it began with.
        first: f64,
        /// Where the search ended.
        so_far: Box<Fit>,
    },
    /// A time of the data lies before the start.
    #[error(
        "row {row} of `{name}` is of t = {time}, before the start at {start}; start earlier, or leave it out"
    )]
    BeforeStart {
        /// The quantity.
        name: String,
        /// The row, from 0.
        row: usize,
        /// Its time.
        time: f64,
        /// Time of the start.
        start: f64,
    },
    /// All data are at the time of the start.
    #[error("all data are of t = {time}, where the motion starts; give some of later times")]
    OneInstant {
        /// That time.
        time: f64,
    },
    /// The noise is not a positive number.
    #[error("the noise of `{name}` cannot be {sigma}; give a positive standard deviation")]
    Noise {
        /// The quantity.
        name: String,
        /// What was given.
        sigma: f64,
    },
    /// The noise is given for some data only.
    #[error("the noise of `{without}` is not given, that of others is; give it of all, or of none")]
    NoiseOfSome {
        /// A quantity without it.
        without: String,
    },
    /// There are fewer data than unknowns. The noise counts as an unknown if it is not given.
    #[error(fmt = too_few_data)]
    TooFewData {
        /// Data.
        data: usize,
        /// Unknowns.
        unknowns: usize,
        /// Whether the noise is to be found, too.
        noise: bool,
    },
    /// The motion or its sensitivities do not exist.
    #[error(transparent)]
    Motion(#[from] SensitivityError),
    /// The motion or its sensitivities do not exist at the first values of the search.
    #[error(fmt = first_values)]
    FirstValues {
        /// Those values.
        values: Vec<(String, f64)>,
        /// Why.
        cause: Box<SensitivityError>,
    },
    /// Least squares did not converge, and one datum is an outlier.
    #[error(
        "{outlier}; leave it out, or ask for a loss that outliers do not decide, `.loss(Loss::CAUCHY)`. \
         Least squares met: {cause}"
    )]
    Outlier {
        /// The datum: at the end of the search, or at the first values.
        outlier: Box<Outlier>,
        /// What the search met.
        cause: Box<FitError>,
    },
    /// The data cannot identify some unknowns, or one has no influence.
    #[error(fmt = indistinguishable)]
    Indistinguishable {
        /// Groups of unknowns that can compensate each other. A group of one has no influence on the data.
        groups: Vec<Vec<String>>,
        /// Values at which the search ended: some of many that are as good.
        values: Vec<(String, f64)>,
        /// χ² there.
        chi_squared: f64,
    },
    /// The search did not converge: there were too few iterations, or no better point nearby.
    #[error(
        "the search has not settled after {iterations} iterations (χ² = {:.6e}); begin nearer, compute finer \
         with `.tolerance(..)`, or permit more with `.iterations(..)`",
        .so_far.chi_squared
    )]
    NotSettled {
        /// Iterations made.
        iterations: usize,
        /// The best so far.
        so_far: Box<Fit>,
    },
    /// The cores cannot be had.
    #[error("the threads cannot be started ({0})")]
    Threads(String),
}

fn nothing_found(name: &str, first: &f64, so_far: &Fit, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(f, "nothing was found: `{name}`, which began at {first}, ended at ")?;
    match so_far.get(name) {
        Some(Fitted { value, standard_error: Some(error), .. }) => write!(f, "{value:.3e} ± {error:.0e}")?,
        Some(Fitted { value, .. }) => write!(f, "{value:.3e}")?,
        None => f.write_str("no number")?,
    }
    f.write_str("; begin nearer, give bounds by `.find_within(..)`, or measure what depends on it")
}

fn too_few_data(data: &usize, unknowns: &usize, noise: &bool, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let of_noise = if *noise { " and the noise" } else { "" };
    write!(f, "{data} data cannot tell {unknowns} unknowns{of_noise}; measure more, or find fewer")
}

fn first_values(
    values: &[(String, f64)],
    cause: &SensitivityError,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    f.write_str("there is no motion with the first values")?;
    for (k, (name, value)) in values.iter().enumerate() {
        write!(f, "{} `{name}` = {}", if k > 0 { "," } else { "" }, Readable(*value))?;
    }
    // The state stands on further lines.
    let cause = alloc::format!("{cause}");
    let cause = cause.lines().next().unwrap_or_default();
    write!(f, "; begin with values at which the model can be simulated. The simulation met: {cause}")
}

fn indistinguishable(
    groups: &[Vec<String>],
    _values: &[(String, f64)],
    _chi_squared: &f64,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    for (k, group) in groups.iter().enumerate() {
        f.write_str(if k > 0 { "; " } else { "" })?;
        match group.as_slice() {
            [one] => write!(f, "the data say nothing of `{one}`")?,
            several => write!(f, "the data do not tell `{}` apart", several.join("`, `"))?,
        }
    }
    f.write_str("; hold some of them, or measure another quantity")
}

dynamics_runtime::sentence_for_debugging!(FitError);
