//! The linear model in state space: ẋ = A x + B w, y = C x + D w.
//!
//! x are the deviations of independent coordinates z and velocities v, as in a
//! [`Linearization`](crate::Linearization). w are the model's inputs and, beside them, a generalized force
//! along every coordinate; y the model's outputs and every coordinate, its rate and its acceleration.
//! `linear_equations.rs` has the matrices.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::model::names::{self, Column};
use dynamics_runtime::model::{Constraints, ModelState, Outputs, Quantity, Vector};
use dynamics_view::suggest;
use nalgebra::{Complex, DMatrix};

use super::linear_equations::{corners, equations};
use super::varying::varying;
use super::{VibrationError, Withheld};
use crate::linearize::{LinearizeError, ModelDerivatives, Tangent, linearize, matrix_eigenvalues};

/// A named input, state or output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signal {
    /// As elsewhere: `theta`, `theta_rate`, `theta_acceleration`; a generalized force is called by its
    /// coordinate.
    pub name: String,
    /// Its unit, empty where it is not known or 1.
    pub unit: String,
}

impl Signal {
    pub(super) fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }
}

/// Where the value of a state stands in a model's state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StateEntry {
    Coordinate(usize),
    Rate(usize),
}

/// The value of a state on the motion of reference: value + rate · (t − `since`), as what turns steadily goes
/// on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Held {
    pub(super) place: StateEntry,
    value: f64,
    rate: f64,
    since: f64,
}

impl Held {
    /// How far a state is from the reference at its time.
    pub(super) fn deviation<S: ModelState>(&self, state: &S) -> f64 {
        let at = match self.place {
            StateEntry::Coordinate(i) => state.q().as_slice().get(i),
            StateEntry::Rate(i) => state.u().as_slice().get(i),
        };
        at.map_or(f64::NAN, |at| at - self.value - self.rate * (state.t() - self.since))
    }
}

/// ẋ = A x + B w, y = C x + D w: n states, W inputs, Y outputs, all deviations from the state of reference.
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
    /// Outputs that have no row, and why: theirs is not a number.
    withheld: Vec<(usize, Withheld)>,
    /// Inputs whose columns change along the motion of reference.
    varying: Vec<usize>,
    /// The states, and the values of the model's inputs, in the reference; empty for matrices of one's own.
    pub(super) places: Vec<Held>,
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
            withheld: Vec::new(),
            varying: Vec::new(),
            places: Vec::new(),
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
            return Err(VibrationError::NoRow { name: name.into(), why: Withheld::Varies });
        }
        Ok(index)
    }

    /// Index of the output of this name.
    pub(super) fn output(&self, name: &str) -> Result<usize, VibrationError> {
        let index = find(&self.outputs, name, "output, coordinate, rate or acceleration")?;
        match self.withheld.iter().find(|(row, _)| *row == index) {
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

pub(crate) fn of_model<M: Constraints + Outputs>(
    model: &M,
    state: &M::State,
) -> Result<StateSpace, VibrationError> {
    let linear = linearize(model, state, &[])?;
    if let Some(reason) = &linear.unsteady {
        return Err(reason.clone().into());
    }
    let read = ModelDerivatives::of(model, state)?;
    let indices = |named: &[Quantity]| -> Vec<usize> {
        named.iter().filter_map(|q| M::COORDINATES.iter().position(|c| c.name == q.name)).collect()
    };
    let independent = [indices(&linear.coordinates), indices(&linear.velocities)];
    let tangent = Tangent::new(
        &read.jacobian,
        read.holonomic,
        &read.mass,
        [independent[0].as_slice(), independent[1].as_slice()],
    );
    let (mut now, mut withheld) = equations(model, state, &read, &tangent, &linear)?;
    for (i, why) in corners(model, state, &read) {
        if withheld.iter().all(|(row, _)| *row != i) {
            withheld.push((i, why));
        }
    }
    let (varying_outputs, varying) = varying(model, state, &tangent, &now)?;
    withheld.extend(varying_outputs.into_iter().map(|i| (i, Withheld::Varies)));
    for (i, _) in &withheld {
        now.c.row_mut(*i).fill(f64::NAN);
        now.d.row_mut(*i).fill(f64::NAN);
    }
    let (places, states) = places::<M>(state, &independent);
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
        withheld,
        varying,
        places,
        input_values: state.inputs().as_slice().to_vec(),
    })
}

fn places<M: Constraints + Outputs>(
    state: &M::State,
    independent: &[Vec<usize>; 2],
) -> (Vec<Held>, Vec<Signal>) {
    let (q, u, since) = (state.q().as_slice(), state.u().as_slice(), state.t());
    let of_q = independent[0].iter().map(|i| Held {
        place: StateEntry::Coordinate(*i),
        value: q[*i],
        rate: u[*i],
        since,
    });
    let of_u =
        independent[1].iter().map(|i| Held { place: StateEntry::Rate(*i), value: u[*i], rate: 0.0, since });
    let places: Vec<_> = of_q.chain(of_u).collect();
    let named: [Vec<Signal>; 2] = [signals(names::coordinates::<M>()), signals(names::velocities::<M>())];
    let signal = |held: &Held| match held.place {
        StateEntry::Coordinate(i) => named[0][i].clone(),
        StateEntry::Rate(i) => named[1][i].clone(),
    };
    let states = places.iter().map(signal).collect();
    (places, states)
}

fn signals(columns: impl Iterator<Item = Column>) -> Vec<Signal> {
    columns.map(|Column { name, unit }| Signal { name, unit }).collect()
}
