//! Why a question about vibrations has no answer.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use nalgebra::Complex;

use crate::LinearizeError;

/// Why an output has no linear equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Withheld {
    /// It depends on reactions that are not unique, as constraints repeat each other.
    NotUnique,
    /// It has a corner at the state of reference: each side has a derivative of its own.
    Corner,
    /// Its derivative is not finite there.
    NotFinite,
    /// Its coefficients change along the steady reference motion, as for a point on a turning body seen from
    /// the side.
    Varies,
}

/// Why a question about vibrations has no answer.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub enum VibrationError {
    /// There is no linear model.
    Linearize(LinearizeError),
    /// Shapes of matrices do not fit each other.
    Shapes {
        /// Rows and columns of each, in the order in which they were given.
        shapes: Vec<(usize, usize)>,
    },
    /// A name is not known.
    UnknownName {
        /// What it should be the name of.
        what: &'static str,
        /// What was asked for.
        name: String,
        /// A known one that is similar.
        nearest: Option<String>,
    },
    /// An output, or an input, has no linear equation with constant coefficients.
    NoRow {
        /// Its name.
        name: String,
        /// Why.
        why: Withheld,
    },
    /// The derivatives of the outputs are too large to be generated, or take fourth derivatives of a curve.
    NoOutputDerivatives,
    /// A value is not in its permitted range.
    Value {
        /// What it is.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What it must be.
        must_be: &'static str,
    },
    /// The response to a steady sine is infinite within rounding: the frequency is that of an undamped mode
    /// that is controllable and observable.
    Resonance {
        /// What was asked for, in rad/s.
        frequency: f64,
        /// The nearest eigenvalue, in 1/s.
        eigenvalue: Complex<f64>,
        /// The condition number of iω − A there.
        conditioning: f64,
    },
    /// The response to a constant load is unbounded within rounding: a rigid-body mode is pushed.
    Free {
        /// The condition number of A.
        conditioning: f64,
    },
    /// A mode does not decay, so that there is no steady response, no norm, and no optimum.
    Unstable {
        /// The eigenvalue with the largest real part, in 1/s.
        eigenvalue: Complex<f64>,
    },
    /// A mode that does not decay by itself is not controllable.
    Unstabilisable {
        /// Its eigenvalue, in 1/s.
        eigenvalue: Complex<f64>,
        /// The states that move most in it.
        states: Vec<String>,
        /// The least singular value of [σ − A, B], in parts of the largest.
        distance: f64,
    },
    /// A mode that does not decay has no weight, so that no optimum brings it to rest.
    Undetectable {
        /// Its eigenvalue, in 1/s.
        eigenvalue: Complex<f64>,
        /// The states that move most in it.
        states: Vec<String>,
        /// The least singular value of [σ − A; C], in parts of the largest.
        distance: f64,
    },
    /// An output that is to be weighted, or asked for its response to an impulse, contains the input
    /// directly.
    Feedthrough {
        /// The output.
        output: String,
        /// The input.
        input: String,
    },
    /// Nothing was given a weight.
    NoWeight {
        /// Of which kind: `controls` or `states and outputs`.
        of: &'static str,
    },
    /// An iteration did not settle.
    NoConvergence {
        /// What was sought.
        what: &'static str,
        /// Iterations made.
        iterations: usize,
        /// What was left, in parts of the whole.
        residual: f64,
    },
    /// Damping, gyroscopic or circulatory terms, or rolling, leave no modes of mass and stiffness alone.
    NoNormalModes {
        /// What there is.
        why: &'static str,
    },
    /// A matrix that must be positive definite is not.
    NotDefinite {
        /// Which.
        matrix: &'static str,
        /// The row at which it shows.
        row: usize,
    },
    /// Fewer values than needed.
    TooFew {
        /// Of what.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A frequency beyond half the sampling rate, which samples cannot tell from one below.
    BeyondNyquist {
        /// What was asked for, in rad/s.
        frequency: f64,
        /// Half the sampling rate, in rad/s.
        nyquist: f64,
    },
    /// A mode without oscillation has no film.
    NoOscillation {
        /// Its eigenvalue, in 1/s.
        eigenvalue: Complex<f64>,
    },
}

impl fmt::Display for VibrationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Linearize(error) => error.fmt(f),
            Self::Shapes { shapes } => write!(
                f,
                "the shapes {shapes:?} of the matrices do not fit each \
                other; A is n x n, B n x W, C Y x n, D Y x W"
            ),
            Self::UnknownName { what, name, nearest: None } => {
                write!(f, "no {what} is called `{name}`; array elements are written `theta[0]`")
            }
            Self::UnknownName { what, name, nearest: Some(nearest) } => {
                write!(f, "no {what} is called `{name}`; did you mean `{nearest}`?")
            }
            Self::NoRow { name, why: Withheld::NotUnique } => write!(
                f,
                "`{name}` depends on reactions that are not unique, as constraints repeat each other; leave \
                 rows out that only repeat others"
            ),
            Self::NoRow { name, why: Withheld::Corner } => write!(
                f,
                "`{name}` has a corner at this very state, so that each side has a derivative of its own; \
                 ask for what it is made of, or move the state to one side"
            ),
            Self::NoRow { name, why: Withheld::NotFinite } => {
                write!(
                    f,
                    "the derivative of `{name}` is not finite at this state; ask for what it is made of"
                )
            }
            Self::NoRow { name, why: Withheld::Varies } => write!(
                f,
                "the coefficients of `{name}` change along the steady motion, as of what is seen, or pushed, \
                 in a direction that turns, so that it has no constant linear equation; ask for what turns \
                 with the motion"
            ),
            Self::NoOutputDerivatives => f.write_str(
                "the outputs have no exact derivatives: the model is written by hand, they are too large to \
                 be generated, or they take fourth derivatives of a curve; declare fewer outputs",
            ),
            Self::Value { what, value, must_be } => write!(f, "{what} is {value:e}; it must be {must_be}"),
            Self::Resonance { frequency, eigenvalue, conditioning } => write!(
                f,
                "at {frequency:.9e} rad/s the response is infinite, or not to be told: it is the frequency \
                 of a mode without damping that is reached and seen ({}, condition number \
                 {conditioning:.1e}); ask beside it, or give the mode damping",
                EigenvalueText(*eigenvalue)
            ),
            Self::Free { conditioning } => write!(
                f,
                "at 0 rad/s the response is infinite, or not to be told: something is free to move, or held \
                 too weakly (condition number {conditioning:.1e}); ask above 0 rad/s, or hold it"
            ),
            Self::Unstable { eigenvalue } => write!(
                f,
                "there is no steady response: a mode with the eigenvalue {} does not die away; give it \
                 damping, or control it first",
                EigenvalueText(*eigenvalue)
            ),
            Self::Unstabilisable { eigenvalue, states, distance } => write!(
                f,
                "no control reaches the mode with the eigenvalue {}, which does not die away ({}; distance \
                 {distance:.1e}); add an input that does work along it",
                EigenvalueText(*eigenvalue),
                List(states)
            ),
            Self::Undetectable { eigenvalue, states, distance } => write!(
                f,
                "the mode with the eigenvalue {}, which does not die away, has no weight ({}; distance \
                 {distance:.1e}); give one to what moves in it",
                EigenvalueText(*eigenvalue),
                List(states)
            ),
            Self::Feedthrough { output, input } => write!(
                f,
                "`{output}` contains `{input}` directly, so that a weight would couple both, and an impulse \
                 stand in it; choose coordinates or rates"
            ),
            Self::NoWeight { of } => {
                write!(f, "no weight was given to any of the {of}; name one by `.weight(name, value)`")
            }
            Self::NoConvergence { what, iterations, residual } => write!(
                f,
                "{what} did not settle in {iterations} iterations, {residual:.1e} is left; scale the \
                 parameters to similar sizes"
            ),
            Self::NoNormalModes { why } => {
                write!(f, "there are no normal modes: {why}; `modes()` are those of the whole linear model")
            }
            Self::NotDefinite { matrix: "stiffness", row } => write!(
                f,
                "the stiffness matrix has a negative eigenvalue, as row {row} shows; the position is \
                 unstable, and falls along a mode rather than swings"
            ),
            Self::NotDefinite { matrix, row } => write!(
                f,
                "the {matrix} matrix is not positive definite, as row {row} shows; every coordinate needs \
                 inertia"
            ),
            Self::TooFew { what, count, needed } => {
                let are = if *needed == 1 { "is" } else { "are" };
                write!(f, "too few {what}: {count}; at least {needed} {are} needed")
            }
            Self::BeyondNyquist { frequency, nyquist } => write!(
                f,
                "{frequency:.6e} rad/s is beyond half the sampling rate, {nyquist:.6e} rad/s, where samples \
                 cannot tell it from a lower one; sample more often"
            ),
            Self::NoOscillation { eigenvalue } => write!(
                f,
                "the mode with the eigenvalue {} does not swing, so that it has no period to be shown; \
                 simulate it",
                EigenvalueText(*eigenvalue)
            ),
        }
    }
}

/// An eigenvalue, a pair as one.
struct EigenvalueText(Complex<f64>);

impl fmt::Display for EigenvalueText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Complex { re, im } = self.0;
        if im == 0.0 { write!(f, "{re:.6e}/s") } else { write!(f, "{re:.6e} ± {:.6e}i/s", im.abs()) }
    }
}

/// Names, one after the other.
struct List<'a>(&'a [String]);

impl fmt::Display for List<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut names = self.0.iter();
        names.next().map_or(Ok(()), |name| write!(f, "`{name}`"))?;
        names.try_for_each(|name| write!(f, ", `{name}`"))
    }
}

dynamics_runtime::sentence_for_debugging!(VibrationError);
impl core::error::Error for VibrationError {}

impl From<LinearizeError> for VibrationError {
    fn from(error: LinearizeError) -> Self {
        Self::Linearize(error)
    }
}
