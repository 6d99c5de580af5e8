//! The errors of vibration analysis and control.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use nalgebra::Complex;

use crate::LinearizeError;

/// Why an output or an input has no linear equation with constant coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalUnavailable {
    /// It depends on reactions that are not unique, because constraints repeat each other.
    NotUnique,
    /// It has a corner at the reference state, so that its derivatives differ on both sides.
    Corner,
    /// Its derivative is not finite there.
    NotFinite,
    /// Its coefficients change along the steady reference motion. An example is the height of a point on a
    /// turning body.
    Varies,
}

/// Why a vibration analysis or a control design has no result.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VibrationError {
    /// There is no linear model.
    #[error(transparent)]
    Linearize(#[from] LinearizeError),
    /// Shapes of matrices do not fit each other.
    #[error(
        "the shapes {shapes:?} of the matrices do not fit each other; A is n x n, B n x W, C Y x n, D Y x W"
    )]
    Shapes {
        /// Rows and columns of each, in the order in which they were given.
        shapes: Vec<(usize, usize)>,
    },
    /// A name is not known.
    #[error(fmt = unknown_name)]
    UnknownName {
        /// The kind of signal that was sought.
        what: &'static str,
        /// The name that was asked for.
        name: String,
        /// A similar known name.
        nearest: Option<String>,
    },
    /// An output, or an input, has no linear equation with constant coefficients.
    #[error(fmt = no_row)]
    NoRow {
        /// Its name.
        name: String,
        /// Why.
        why: SignalUnavailable,
    },
    /// The derivatives of the outputs are too large to be generated, or take fourth derivatives of a curve.
    #[error(
        "the outputs have no exact derivatives: the model is written by hand, they are too large to be \
         generated, or they take fourth derivatives of a curve; declare fewer outputs"
    )]
    NoOutputDerivatives,
    /// A value is not in its permitted range.
    #[error("{what} is {value:e}; it must be {must_be}")]
    Value {
        /// The name of the value.
        what: &'static str,
        /// The value that was given.
        value: f64,
        /// The permitted range.
        must_be: &'static str,
    },
    /// The response to a steady sine is infinite within rounding: the frequency is that of an undamped mode
    /// that is controllable and observable.
    #[error(
        "at {frequency:.9e} rad/s the response is infinite, or not to be told: it is the frequency of a mode \
         without damping that is reached and seen ({}, condition number {conditioning:.1e}); ask beside it, \
         or give the mode damping",
        EigenvalueText(*.eigenvalue)
    )]
    Resonance {
        /// The frequency of the response, in rad/s.
        frequency: f64,
        /// The nearest eigenvalue, in 1/s.
        eigenvalue: Complex<f64>,
        /// The condition number of iω − A there.
        conditioning: f64,
    },
    /// The response to a constant load is infinite within rounding: the load excites a rigid-body mode.
    #[error(
        "at 0 rad/s the response is infinite, or not to be told: something is free to move, or held too \
         weakly (condition number {conditioning:.1e}); ask above 0 rad/s, or hold it"
    )]
    Free {
        /// The condition number of A.
        conditioning: f64,
    },
    /// A mode does not decay, so there is no steady response and no norm.
    #[error(
        "there is no steady response: a mode with the eigenvalue {} does not die away; give it damping, or \
         control it first",
        EigenvalueText(*.eigenvalue)
    )]
    Unstable {
        /// The eigenvalue with the largest real part, in 1/s.
        eigenvalue: Complex<f64>,
    },
    /// A mode that does not decay by itself is not controllable.
    #[error(
        "no control reaches the mode with the eigenvalue {}, which does not die away ({}; distance \
         {distance:.1e}); add an input that does work along it",
        EigenvalueText(*.eigenvalue),
        List(.states)
    )]
    Unstabilisable {
        /// Its eigenvalue, in 1/s.
        eigenvalue: Complex<f64>,
        /// The states that move most in it.
        states: Vec<String>,
        /// The least singular value of the scaled [σ − A, B], relative to the largest.
        distance: f64,
    },
    /// A mode on the imaginary axis has no weight, so no optimum brings it to rest.
    #[error(
        "the mode with the eigenvalue {}, which does not die away, has no weight ({}; distance \
         {distance:.1e}); give one to what moves in it",
        EigenvalueText(*.eigenvalue),
        List(.states)
    )]
    Undetectable {
        /// Its eigenvalue, in 1/s.
        eigenvalue: Complex<f64>,
        /// The states that move most in it.
        states: Vec<String>,
        /// The least singular value of the scaled [σ − A; C], relative to the largest.
        distance: f64,
    },
    /// The output contains the input directly (D ≠ 0), so it can have no weight and no impulse response.
    #[error(
        "`{output}` contains `{input}` directly, so that a weight would couple both, and an impulse stand in \
         it; choose coordinates or rates"
    )]
    Feedthrough {
        /// The output.
        output: String,
        /// The input.
        input: String,
    },
    /// No control, or no state and output, has a weight.
    #[error("no weight was given to any of the {of}; name one by `.weight(name, value)`")]
    NoWeight {
        /// Of which kind: `controls` or `states and outputs`.
        of: &'static str,
    },
    /// An iteration did not converge.
    #[error(
        "{what} did not settle in {iterations} iterations, {residual:.1e} is left; scale the parameters to \
         similar sizes"
    )]
    NoConvergence {
        /// The result that was sought.
        what: &'static str,
        /// Iterations made.
        iterations: usize,
        /// The last relative residual or change.
        residual: f64,
    },
    /// Damping, gyroscopic or circulatory terms, or rolling, leave no modes of mass and stiffness alone.
    #[error("there are no normal modes: {why}; `modes()` are those of the whole linear model")]
    NoNormalModes {
        /// The reason.
        why: &'static str,
    },
    /// A matrix that must be positive definite is not.
    #[error(fmt = not_definite)]
    NotDefinite {
        /// Which.
        matrix: &'static str,
        /// The row at which it shows.
        row: usize,
    },
    /// Fewer values than needed.
    #[error(fmt = too_few)]
    TooFew {
        /// Of what.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A frequency beyond half the sampling rate, which samples cannot tell from one below.
    #[error(
        "{frequency:.6e} rad/s is beyond half the sampling rate, {nyquist:.6e} rad/s, where samples cannot \
         tell it from a lower one; sample more often"
    )]
    BeyondNyquist {
        /// The frequency that was asked for, in rad/s.
        frequency: f64,
        /// Half the sampling rate, in rad/s.
        nyquist: f64,
    },
    /// A mode without oscillation has no period to animate.
    #[error(
        "the mode with the eigenvalue {} does not swing, so that it has no period to be shown; simulate it",
        EigenvalueText(*.eigenvalue)
    )]
    NoOscillation {
        /// Its eigenvalue, in 1/s.
        eigenvalue: Complex<f64>,
    },
}

fn unknown_name(what: &str, name: &str, nearest: &Option<String>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match nearest {
        None => write!(f, "no {what} is called `{name}`; array elements are written `theta[0]`"),
        Some(nearest) => write!(f, "no {what} is called `{name}`; did you mean `{nearest}`?"),
    }
}

fn no_row(name: &str, why: &SignalUnavailable, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match why {
        SignalUnavailable::NotUnique => write!(
            f,
            "`{name}` depends on reactions that are not unique, as constraints repeat each other; leave \
             rows out that only repeat others"
        ),
        SignalUnavailable::Corner => write!(
            f,
            "`{name}` has a corner at this very state, so that each side has a derivative of its own; \
             ask for what it is made of, or move the state to one side"
        ),
        SignalUnavailable::NotFinite => {
            write!(f, "the derivative of `{name}` is not finite at this state; ask for what it is made of")
        }
        SignalUnavailable::Varies => write!(
            f,
            "the coefficients of `{name}` change along the steady motion, as of what is seen, or pushed, \
             in a direction that turns, so that it has no constant linear equation; ask for what turns \
             with the motion"
        ),
    }
}

fn not_definite(matrix: &str, row: &usize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match matrix {
        "stiffness" => write!(
            f,
            "the stiffness matrix has a negative eigenvalue, as row {row} shows; the position is \
             unstable, and falls along a mode rather than swings"
        ),
        matrix => write!(
            f,
            "the {matrix} matrix is not positive definite, as row {row} shows; every coordinate needs \
             inertia"
        ),
    }
}

fn too_few(what: &str, count: &usize, needed: &usize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let are = if *needed == 1 { "is" } else { "are" };
    write!(f, "too few {what}: {count}; at least {needed} {are} needed")
}

/// An eigenvalue; a conjugate pair as `re ± im i`.
struct EigenvalueText(Complex<f64>);

impl fmt::Display for EigenvalueText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Complex { re, im } = self.0;
        if im == 0.0 { write!(f, "{re:.6e}/s") } else { write!(f, "{re:.6e} ± {:.6e}i/s", im.abs()) }
    }
}

/// Names in backticks, separated by commas.
struct List<'a>(&'a [String]);

impl fmt::Display for List<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut names = self.0.iter();
        names.next().map_or(Ok(()), |name| write!(f, "`{name}`"))?;
        names.try_for_each(|name| write!(f, ", `{name}`"))
    }
}

dynamics_runtime::sentence_for_debugging!(VibrationError);
