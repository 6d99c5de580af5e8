//! The linear model in state space: ẋ = A x + B w, y = C x + D w.
//!
//! x are the deviations of independent coordinates z and velocities v, as in a
//! [`Linearization`](crate::Linearization). w are the model's inputs and a generalized force along every
//! coordinate. y are the model's outputs, then all coordinates, their rates and their accelerations.
//! `linear_equations.rs` computes the matrices.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::model::names::{self, Column};
use dynamics_runtime::model::{Constraints, ModelState, Outputs, Quantity, Vector};
use dynamics_view::suggest;
use nalgebra::{Complex, DMatrix};

use super::linear_equations::{corners, equations};
use super::varying::varying;
use super::{SignalUnavailable, VibrationError};
use crate::linearize::{LinearizeError, ModelDerivatives, Tangent, linearize, matrix_eigenvalues};

/// A named input, state or output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signal {
    /// `theta`, `theta_rate`, `theta_acceleration` as in tables; a generalized force has the name of its
    /// coordinate.
    pub name: String,
    /// Its unit; empty if it is 1 or not known.
    pub unit: String,
}

impl Signal {
    pub(super) fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }
}

/// Which element of a model's state a state x is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StateEntry {
    Coordinate(usize),
    Rate(usize),
}

/// The value of a state x on the reference motion: value + rate · (t − `since`). On a steady motion the
/// rate of a cyclic coordinate is not 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ReferenceValue {
    pub(super) entry: StateEntry,
    value: f64,
    rate: f64,
    since: f64,
}

impl ReferenceValue {
    /// The deviation of a state from the reference motion at its time; NaN for a state of another model.
    pub(super) fn deviation<S: ModelState>(&self, state: &S) -> f64 {
        let at = match self.entry {
            StateEntry::Coordinate(i) => state.q().as_slice().get(i),
            StateEntry::Rate(i) => state.u().as_slice().get(i),
        };
        at.map_or(f64::NAN, |at| at - self.value - self.rate * (state.t() - self.since))
    }
}

/// ẋ = A x + B w, y = C x + D w: n states, W inputs, Y outputs, all deviations from the reference state.
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace {
    /// A, n×n.
    pub a: DMatrix<f64>,
    /// B, n×W.
    pub b: DMatrix<f64>,
    /// C, Y×n.
    pub c: DMatrix<f64>,
    /// D, Y×W.
    pub d: DMatrix<f64>,
    /// The states: independent coordinates, then independent velocities.
    pub states: Vec<Signal>,
    /// The model's inputs, then generalized forces along all coordinates.
    pub inputs: Vec<Signal>,
    /// The model's outputs, then all coordinates, their rates, and their accelerations.
    pub outputs: Vec<Signal>,
    /// Outputs without a linear equation, and why; their rows are NaN.
    unavailable: Vec<(usize, SignalUnavailable)>,
    /// Inputs whose columns change along the reference motion.
    varying: Vec<usize>,
    /// The states on the reference motion; empty for a state space from matrices.
    pub(super) reference: Vec<ReferenceValue>,
    /// The values of the model's inputs in the reference; empty for a state space from matrices.
    pub(super) input_values: Vec<f64>,
}

impl StateSpace {
    /// From matrices of one's own; signals are called `x[0]`, `w[0]`, `y[0]`.
    ///
    /// # Errors
    /// Shapes that do not fit, and elements that are not finite.
    pub fn from_matrices(
        a: DMatrix<f64>,
        b: DMatrix<f64>,
        c: DMatrix<f64>,
        d: DMatrix<f64>,
    ) -> Result<Self, VibrationError> {
        let (n, w, y) = (a.nrows(), b.ncols(), c.nrows());
        if n == 0 || a.ncols() != n || b.nrows() != n || c.ncols() != n || d.shape() != (y, w) {
            return Err(VibrationError::Shapes {
                shapes: [a.shape(), b.shape(), c.shape(), d.shape()].into(),
            });
        }
        if !a.iter().chain(b.iter()).chain(c.iter()).chain(d.iter()).all(|x| x.is_finite()) {
            return Err(LinearizeError::NotFinite.into());
        }
        let named = |letter: &str, count: usize| {
            (0..count).map(|k| Signal::new(format!("{letter}[{k}]"), "")).collect()
        };
        Ok(Self {
            states: named("x", n),
            inputs: named("w", w),
            outputs: named("y", y),
            unavailable: Vec::new(),
            varying: Vec::new(),
            reference: Vec::new(),
            input_values: Vec::new(),
            a,
            b,
            c,
            d,
        })
    }

    /// The eigenvalues of A, in 1/s, by growing real part.
    ///
    /// # Errors
    /// An iteration that does not settle.
    pub fn eigenvalues(&self) -> Result<Vec<Complex<f64>>, VibrationError> {
        let mut found = matrix_eigenvalues(self.a.clone())?;
        found.sort_by(|x, y| x.re.total_cmp(&y.re).then(x.im.total_cmp(&y.im)));
        Ok(found)
    }

    /// Index of the input of this name.
    pub(super) fn input(&self, name: &str) -> Result<usize, VibrationError> {
        let index = find(&self.inputs, name, "input or coordinate to push along")?;
        if self.varying.contains(&index) {
            return Err(VibrationError::NoRow { name: name.into(), why: SignalUnavailable::Varies });
        }
        Ok(index)
    }

    /// Index of the output of this name.
    pub(super) fn output(&self, name: &str) -> Result<usize, VibrationError> {
        let index = find(&self.outputs, name, "output, coordinate, rate or acceleration")?;
        match self.unavailable.iter().find(|(row, _)| *row == index) {
            Some((_, why)) => Err(VibrationError::NoRow { name: name.into(), why: *why }),
            None => Ok(index),
        }
    }
}

/// The first signal of this name.
pub(super) fn find(signals: &[Signal], name: &str, what: &'static str) -> Result<usize, VibrationError> {
    let found = signals.iter().position(|signal| signal.name == name);
    found.ok_or_else(|| VibrationError::UnknownName {
        what,
        name: name.into(),
        nearest: suggest(name, signals.iter().map(|signal| signal.name.as_str())),
    })
}

/// The state space of a model at an equilibrium or on a steady motion.
pub(crate) fn of_model<M: Constraints + Outputs>(
    model: &M,
    state: &M::State,
) -> Result<StateSpace, VibrationError> {
    let linear = linearize(model, state, &[])?;
    if let Some(reason) = &linear.unsteady {
        return Err(reason.clone().into());
    }
    let derivatives = ModelDerivatives::of(model, state)?;
    let indices = |named: &[Quantity]| -> Vec<usize> {
        named.iter().filter_map(|q| M::COORDINATES.iter().position(|c| c.name == q.name)).collect()
    };
    let independent = [indices(&linear.coordinates), indices(&linear.velocities)];
    let tangent = Tangent::new(
        &derivatives.jacobian,
        derivatives.holonomic,
        &derivatives.mass,
        [independent[0].as_slice(), independent[1].as_slice()],
    );
    // The matrices, then the signals whose rows or columns are not usable: with a corner, or time-dependent.
    let (mut now, mut unavailable) = equations(model, state, &derivatives, &tangent, &linear)?;
    for (i, why) in corners(model, state, &derivatives) {
        if unavailable.iter().all(|(row, _)| *row != i) {
            unavailable.push((i, why));
        }
    }
    let (varying_outputs, varying) = varying(model, state, &tangent, &now)?;
    unavailable.extend(varying_outputs.into_iter().map(|i| (i, SignalUnavailable::Varies)));
    for (i, _) in &unavailable {
        now.c.row_mut(*i).fill(f64::NAN);
        now.d.row_mut(*i).fill(f64::NAN);
    }
    let (reference, states) = reference::<M>(state, &independent);
    let of_coordinates =
        names::coordinates::<M>().chain(names::velocities::<M>()).chain(names::accelerations::<M>());
    Ok(StateSpace {
        a: now.a,
        b: now.b,
        c: now.c,
        d: now.d,
        states,
        inputs: signals(names::plain(M::INPUTS).chain(names::forces::<M>())),
        outputs: signals(names::plain(M::OUTPUTS).chain(of_coordinates)),
        unavailable,
        varying,
        reference,
        input_values: state.inputs().as_slice().to_vec(),
    })
}

/// The values of the states on the reference motion, and their names.
fn reference<M: Constraints + Outputs>(
    state: &M::State,
    independent: &[Vec<usize>; 2],
) -> (Vec<ReferenceValue>, Vec<Signal>) {
    let (q, u, since) = (state.q().as_slice(), state.u().as_slice(), state.t());
    let of_q = independent[0].iter().map(|i| ReferenceValue {
        entry: StateEntry::Coordinate(*i),
        value: q[*i],
        rate: u[*i],
        since,
    });
    let of_u = independent[1].iter().map(|i| ReferenceValue {
        entry: StateEntry::Rate(*i),
        value: u[*i],
        rate: 0.0,
        since,
    });
    let reference: Vec<_> = of_q.chain(of_u).collect();
    let named: [Vec<Signal>; 2] = [signals(names::coordinates::<M>()), signals(names::velocities::<M>())];
    let signal = |value: &ReferenceValue| match value.entry {
        StateEntry::Coordinate(i) => named[0][i].clone(),
        StateEntry::Rate(i) => named[1][i].clone(),
    };
    let states = reference.iter().map(signal).collect();
    (reference, states)
}

fn signals(columns: impl Iterator<Item = Column>) -> Vec<Signal> {
    columns.map(|Column { name, unit }| Signal { name, unit }).collect()
}
