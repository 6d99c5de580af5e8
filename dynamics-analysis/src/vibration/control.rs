//! Controllability, observability, and the linear–quadratic regulator.
//!
//! A mode with eigenvalue σ is controllable by the inputs if [σ − A, B] has full rank, and observable in
//! the outputs if [σ − A; C] has (the test of Popov, Belevitch & Hautus; T. Kailath, *Linear Systems*,
//! §6.2). The least singular value is the distance to the nearest matrices without this property. The
//! regulator w = −K x minimises
//!
//! ```text
//! ∫ (Σ weight·output² + Σ weight·control²) dt        K = R⁻¹BᵀX        AᵀX + X A − X B R⁻¹ Bᵀ X + Q = 0
//! ```
//!
//! (B. D. O. Anderson & J. B. Moore, *Optimal Control: Linear Quadratic Methods*, chapter 3); `riccati.rs`
//! solves for X.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use dynamics_runtime::model::{ModelState, Vector};
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix};

use super::riccati::{Riccati, solve};
use super::state_space::{ReferenceValue, Signal, find};
use super::{StateSpace, VibrationError};
use crate::linearize::{drop_rounding, eigenvector, matrix_eigenvalues};

/// Least singular value of the scaled test matrix, relative to the largest, up to which a mode counts as
/// uncontrollable or unobservable. Rounding leaves less than this of a singular value 0. A larger value would
/// call modes uncontrollable that are only weakly controllable.
const RANK_TOLERANCE_OF_PBH_TEST: f64 = 1e-10;
/// Largest residual of the Riccati equation, relative to its terms, with which a regulator is returned.
const MAX_RICCATI_RESIDUAL: f64 = 1e-9;
/// Factor on the first-order bound of an eigenvalue's rounding: the QR iteration rounds several times per
/// element.
pub(super) const EIGENVALUE_ROUNDING_FACTOR: f64 = 64.0;
/// Largest rounding of an eigenvalue relative to the largest eigenvalue: seven times √ε, for defective
/// pairs.
const MAX_EIGENVALUE_ROUNDING: f64 = 1e-7;
/// Most states that are named for a mode.
const NAMED_STATES: usize = 3;
/// Least motion of a named state relative to the state that moves most.
const MIN_NAMED_SHARE: f64 = 0.05;

/// Controllability or observability of a mode.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// σ, in 1/s; of a pair the one with positive imaginary part.
    pub eigenvalue: Complex<f64>,
    /// The least singular value of [σ − A, B], or of [σ − A; C], relative to the largest, with states and
    /// signals scaled. It is 0 for an uncontrollable or unobservable mode, and small for a nearly
    /// uncontrollable or unobservable one.
    pub distance: f64,
    /// The states that move most in the mode.
    pub states: Vec<String>,
}

impl Reach {
    /// Whether the mode is controllable, or observable: its distance is more than rounding.
    #[must_use]
    pub fn is_reached(&self) -> bool {
        self.distance > RANK_TOLERANCE_OF_PBH_TEST
    }
}

/// One line.
impl fmt::Display for Reach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Complex { re, im } = self.eigenvalue;
        let verdict = if self.is_reached() { "reached" } else { "not reached" };
        write!(
            f,
            "{re:>13.6e} {im:>+13.6e}i/s: {verdict}, distance {:.1e} ({})",
            self.distance,
            self.states.join(", ")
        )
    }
}

impl StateSpace {
    /// The controllability of each mode by these inputs, or by forces along coordinates.
    ///
    /// # Errors
    /// A name that is not known; an iteration that does not settle.
    pub fn controllability(&self, inputs: &[&str]) -> Result<Vec<Reach>, VibrationError> {
        let columns = inputs.iter().map(|name| self.input(name)).collect::<Result<Vec<_>, _>>()?;
        pbh_test((&self.a, &self.states), &self.a, &self.b.select_columns(&columns))
    }

    /// The observability of each mode in these outputs.
    ///
    /// # Errors
    /// A name that is not known; an iteration that does not settle.
    pub fn observability(&self, outputs: &[&str]) -> Result<Vec<Reach>, VibrationError> {
        let rows = outputs.iter().map(|name| self.output(name)).collect::<Result<Vec<_>, _>>()?;
        pbh_test((&self.a, &self.states), &self.a.transpose(), &self.c.select_rows(&rows).transpose())
    }

    /// Begins the design of a regulator. Weights follow; [`LqrDesign::solve`] computes it.
    #[must_use]
    pub fn lqr(&self) -> LqrDesign<'_> {
        LqrDesign { space: self, weights: Vec::new() }
    }
}

/// The test of Popov, Belevitch and Hautus for each mode: [σ − `a`, `b`] with A and B for controllability,
/// Aᵀ and Cᵀ for observability. `own` is A itself, whose eigenvectors name the states.
fn pbh_test(
    (own, states): (&DMatrix<f64>, &[Signal]),
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
) -> Result<Vec<Reach>, VibrationError> {
    let mut balanced = a.clone();
    let scale = balance_parlett_reinsch(&mut balanced);
    // Drop rounding first, because rows are scaled to equal lengths later, which would enlarge rows of
    // rounding.
    drop_rounding(&mut balanced);
    let mut b = b.clone();
    let least = b.nrows() as f64 * f64::EPSILON;
    for mut column in b.column_iter_mut() {
        column.component_div_assign(&scale);
        let size = column.norm();
        if size > 0.0 {
            column.unscale_mut(size);
            column.iter_mut().filter(|x| x.abs() <= least).for_each(|x| *x = 0.0);
        }
    }
    let mut found = Vec::new();
    for (k, eigenvalue) in matrix_eigenvalues(a.clone())?.into_iter().enumerate().filter(|(_, x)| x.im >= 0.0)
    {
        let right = eigenvector(own, eigenvalue, k)?;
        let sizes: Vec<f64> = right.iter().map(|x| x.norm()).collect();
        found.push(Reach {
            eigenvalue,
            distance: distance(&balanced, &b, eigenvalue),
            states: largest(&sizes, states),
        });
    }
    found.sort_by(|x, y| {
        x.eigenvalue.re.total_cmp(&y.eigenvalue.re).then(x.eigenvalue.im.total_cmp(&y.eigenvalue.im))
    });
    Ok(found)
}

/// The least singular value of [σ − A, B] relative to the largest. All rows are scaled to length 1, so
/// that stiff rows do not hide soft ones.
fn distance(a: &DMatrix<f64>, b: &DMatrix<f64>, eigenvalue: Complex<f64>) -> f64 {
    let n = a.nrows();
    let mut joined = DMatrix::from_fn(n, n + b.ncols(), |i, j| {
        let x = if j < n { -a[(i, j)] } else { b[(i, j - n)] };
        Complex::new(x, 0.0)
    });
    (0..n).for_each(|i| joined[(i, i)] += eigenvalue);
    for mut row in joined.row_iter_mut() {
        let size = row.norm();
        if size > 0.0 {
            row.unscale_mut(size);
        }
    }
    let values = joined.singular_values();
    if values.max() > 0.0 { values.min() / values.max() } else { 0.0 }
}

/// The names of the states that move most.
fn largest(sizes: &[f64], states: &[Signal]) -> Vec<String> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|i, j| sizes[*j].total_cmp(&sizes[*i]));
    let most = order.first().map_or(0.0, |i| sizes[*i]);
    order
        .into_iter()
        .take(NAMED_STATES)
        .filter(|i| sizes[*i] > MIN_NAMED_SHARE * most)
        .map(|i| states[i].name.clone())
        .collect()
}

/// The design of a regulator: the weights.
#[derive(Clone, Debug)]
pub struct LqrDesign<'a> {
    space: &'a StateSpace,
    pub(crate) weights: Vec<(String, f64)>,
}

impl LqrDesign<'_> {
    /// The weight of the square of a control (an input of the model), an output, a coordinate or a rate, each
    /// by its name. Inputs without a weight are held. Other quantities without a weight cost nothing. Weights
    /// in 1/unit² of acceptable deviations are a good first choice (Bryson's rule).
    #[must_use]
    pub fn weight(mut self, name: impl Into<String>, weight: f64) -> Self {
        self.weights.push((name.into(), weight));
        self
    }

    /// The regulator.
    ///
    /// # Errors
    /// Invalid names and weights, a mode that does not decay and is not controllable, modes on the limit of
    /// stability that have no weight, and a Riccati equation that is not solved to 1e-9.
    pub fn solve(self) -> Result<Lqr, VibrationError> {
        let space = self.space;
        // The feedback needs all states of a model, so each must have constant coefficients.
        space
            .reference
            .iter()
            .zip(&space.states)
            .try_for_each(|(_, state)| space.output(&state.name).map(|_| ()))?;
        // R is diagonal, Q = Σ weight · cᵀc of the weighted outputs.
        let (controls, r, outputs) = self.controls_and_outputs()?;
        let b = space.b.select_columns(&controls);
        let q = outputs.iter().fold(DMatrix::zeros(space.a.nrows(), space.a.nrows()), |q, (row, weight)| {
            let c = space.c.row(*row);
            q + c.transpose() * c * *weight
        });
        // Leave out states that nothing depends on and that have no weight.
        let kept = states_in_cost(&space.a, &q);
        let part = |m: &DMatrix<f64>| m.select_rows(&kept).select_columns(&kept);
        let (a, b, q) = (part(&space.a), b.select_rows(&kept), part(&q));
        let of: Vec<Signal> = kept.iter().map(|j| space.states[*j].clone()).collect();
        check_solvable((&a, &of), &b, &q)?;
        // G = B R⁻¹Bᵀ, K = R⁻¹Bᵀ X, then the eigenvalues of A − B K.
        let scaled = DMatrix::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] / r[j]);
        let Riccati { x, residual, refinements } = solve(&a, &(&b * scaled.transpose()), &q)?;
        let gain = scaled.tr_mul(&x);
        let mut closed_loop = matrix_eigenvalues(&a - &b * &gain)?;
        closed_loop.sort_by(|x, y| x.re.total_cmp(&y.re).then(x.im.total_cmp(&y.im)));
        let grows = closed_loop.last().is_none_or(|last| last.re >= 0.0);
        if grows || residual.is_nan() || residual > MAX_RICCATI_RESIDUAL {
            let what = "the regulator's Riccati equation";
            return Err(VibrationError::NoConvergence { what, iterations: refinements, residual });
        }
        // Gain and X in all states, 0 for those that were left out.
        let (n, at) = (space.states.len(), |j: usize| kept.iter().position(|k| *k == j));
        let left_out = (0..n).filter(|j| at(*j).is_none()).map(|j| space.states[j].clone()).collect();
        Ok(Lqr {
            gain: DMatrix::from_fn(gain.nrows(), n, |i, j| at(j).map_or(0.0, |k| gain[(i, k)])),
            riccati: DMatrix::from_fn(n, n, |i, j| at(i).zip(at(j)).map_or(0.0, |k| x[k])),
            left_out,
            closed_loop,
            residual,
            refinements,
            controls: controls.iter().map(|k| space.inputs[*k].clone()).collect(),
            states: space.states.clone(),
            indices: controls,
            reference: space.reference.clone(),
            input_values: space.input_values.clone(),
        })
    }

    /// Columns of B of the controls with their weights, and rows of C of the weighted outputs with theirs.
    #[allow(clippy::type_complexity)]
    fn controls_and_outputs(&self) -> Result<(Vec<usize>, Vec<f64>, Vec<(usize, f64)>), VibrationError> {
        let space = self.space;
        // Controls of a model are its own inputs. Generalized forces are not, because a simulation has no
        // such input.
        let own = if space.reference.is_empty() { space.inputs.len() } else { space.input_values.len() };
        let (mut controls, mut r, mut outputs) = (Vec::new(), Vec::new(), Vec::new());
        for (name, weight) in &self.weights {
            let value = |must_be| VibrationError::Value { what: "a weight", value: *weight, must_be };
            match space.inputs[..own].iter().position(|input| input.name == *name) {
                Some(_) if !(weight.is_finite() && *weight > 0.0) => {
                    return Err(value("a positive number for a control"));
                }
                Some(k) if controls.contains(&k) => return Err(value("given once for each control")),
                Some(k) => {
                    space.input(name)?;
                    controls.push(k);
                    r.push(*weight);
                }
                None => {
                    let what = "control, output, coordinate or rate";
                    let both: Vec<Signal> =
                        space.inputs[..own].iter().chain(&space.outputs).cloned().collect();
                    find(&both, name, what)?;
                    if !(weight.is_finite() && *weight >= 0.0) {
                        return Err(value("0 or a positive number"));
                    }
                    let row = space.output(name)?;
                    if outputs.iter().any(|(other, _)| *other == row) {
                        return Err(value("given once for each output"));
                    }
                    outputs.push((row, *weight));
                }
            }
        }
        if controls.is_empty() {
            return Err(VibrationError::NoWeight { of: "controls" });
        }
        if outputs.iter().all(|(_, weight)| *weight == 0.0) {
            return Err(VibrationError::NoWeight { of: "states and outputs" });
        }
        for (row, _) in &outputs {
            if let Some(k) = controls.iter().find(|k| space.d[(*row, **k)] != 0.0) {
                let (output, input) = (space.outputs[*row].name.clone(), space.inputs[*k].name.clone());
                return Err(VibrationError::Feedthrough { output, input });
            }
        }
        Ok((controls, r, outputs))
    }
}

/// The states with a part in the cost: those with a weight, and those on which a state depends. For example,
/// the angle of a wheel whose speed is held has none. States are removed only once: if a rate has no part
/// after the removal of its coordinate, it is kept. Otherwise a cart could move away for ever to hold its
/// pole.
fn states_in_cost(a: &DMatrix<f64>, q: &DMatrix<f64>) -> Vec<usize> {
    (0..a.nrows()).filter(|j| a.column(*j).amax() > 0.0 || q.column(*j).amax() > 0.0).collect()
}

/// Refuses problems without a stabilising solution: a growing mode that is uncontrollable, or a mode on the
/// imaginary axis without a weight.
fn check_solvable(
    (a, states): (&DMatrix<f64>, &[Signal]),
    b: &DMatrix<f64>,
    q: &DMatrix<f64>,
) -> Result<(), VibrationError> {
    for Reach { eigenvalue, distance, states } in pbh_test((a, states), a, b)? {
        if distance <= RANK_TOLERANCE_OF_PBH_TEST && eigenvalue.re >= -eigenvalue_rounding(a, eigenvalue)? {
            return Err(VibrationError::Unstabilisable { eigenvalue, states, distance });
        }
    }
    for Reach { eigenvalue, distance, states } in pbh_test((a, states), &a.transpose(), q)? {
        if distance <= RANK_TOLERANCE_OF_PBH_TEST
            && eigenvalue.re.abs() <= eigenvalue_rounding(a, eigenvalue)?
        {
            return Err(VibrationError::Undetectable { eigenvalue, states, distance });
        }
    }
    Ok(())
}

/// Bound of the rounding of an eigenvalue, ε |y|ᵀ|A||x|/|yᴴx| with its right and left vectors x and y,
/// and at most that of a defective pair. It is not relative to the largest eigenvalue, so that a slowly
/// decaying mode beside a stiff one counts as decaying.
fn eigenvalue_rounding(a: &DMatrix<f64>, eigenvalue: Complex<f64>) -> Result<f64, VibrationError> {
    let mut a = a.clone();
    balance_parlett_reinsch(&mut a);
    let size = matrix_eigenvalues(a.clone())?.iter().map(|x| x.norm()).fold(0.0, f64::max);
    let (right, left) = (eigenvector(&a, eigenvalue, 0)?, eigenvector(&a.transpose(), eigenvalue.conj(), 0)?);
    let [of_right, of_left] = [&right, &left].map(|x| x.map(|x| x.norm()));
    let conditioning = of_left.dot(&(a.abs() * of_right)) / left.dotc(&right).norm();
    // NaN or infinite if the vectors are orthogonal (a defective pair); `min` then returns the other bound.
    Ok((EIGENVALUE_ROUNDING_FACTOR * f64::EPSILON * conditioning).min(MAX_EIGENVALUE_ROUNDING * size))
}

/// A linear–quadratic regulator: controls = those of the reference − gain · deviations of the states.
#[derive(Clone, Debug, PartialEq)]
pub struct Lqr {
    /// K, controls × states.
    pub gain: DMatrix<f64>,
    /// X, states × states: xᵀX x is the cost of a deviation x.
    pub riccati: DMatrix<f64>,
    /// Cyclic states without a weight, such as the angle of a wheel whose speed is held. Their gain is 0, and
    /// they are not controlled.
    pub left_out: Vec<Signal>,
    /// The eigenvalues of A − B K of the other states, in 1/s, by growing real part.
    pub closed_loop: Vec<Complex<f64>>,
    /// The residual of the Riccati equation, relative to its terms.
    pub residual: f64,
    /// Newton steps that the solution took after the sign function.
    pub refinements: usize,
    /// The controls, in the order of the rows of K.
    pub controls: Vec<Signal>,
    /// The states, in the order of its columns.
    pub states: Vec<Signal>,
    indices: Vec<usize>,
    reference: Vec<ReferenceValue>,
    input_values: Vec<f64>,
}

impl Lqr {
    /// The gain from a state to a control, by their names.
    #[must_use]
    pub fn gain_of(&self, control: &str, state: &str) -> Option<f64> {
        let row = self.controls.iter().position(|signal| signal.name == control)?;
        let column = self.states.iter().position(|signal| signal.name == state)?;
        Some(self.gain[(row, column)])
    }

    /// All inputs of the model at a state: the controls by the regulator, the others as in the reference. A
    /// steady motion continues as the reference. The result is NaN for a state space from matrices, or for a
    /// state of another model. Angles are not folded: one full turn is a large deviation.
    #[must_use]
    pub fn inputs_at<S: ModelState>(&self, state: &S) -> S::Inputs {
        let mut inputs = S::Inputs::zeros();
        let values = inputs.as_mut_slice();
        if values.len() != self.input_values.len() || self.reference.len() != self.states.len() {
            values.fill(f64::NAN);
            return inputs;
        }
        values.copy_from_slice(&self.input_values);
        for (column, reference) in self.reference.iter().enumerate() {
            let deviation = reference.deviation(state);
            for (row, k) in self.indices.iter().enumerate() {
                values[*k] -= self.gain[(row, column)] * deviation;
            }
        }
        inputs
    }

    /// xᵀX x: the cost of returning from these deviations, in the order of the states; `None` for another
    /// number of them.
    #[must_use]
    pub fn cost(&self, deviations: &[f64]) -> Option<f64> {
        let x = nalgebra::DVector::from_column_slice(deviations);
        (x.len() == self.states.len()).then(|| x.dot(&(&self.riccati * &x)))
    }
}

/// A line for each control, then the closed loop.
impl fmt::Display for Lqr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (row, control) in self.controls.iter().enumerate() {
            write!(f, "{} =", control.name)?;
            for (column, state) in self.states.iter().enumerate() {
                write!(f, " {:+.6} {}", -self.gain[(row, column)], state.name)?;
            }
            writeln!(f)?;
        }
        f.write_str("closed loop:")?;
        for Complex { re, im } in self.closed_loop.iter().filter(|x| x.im >= 0.0) {
            if *im == 0.0 { write!(f, " {re:.4}")? } else { write!(f, " {re:.4} ± {im:.4}i")? }
        }
        write!(f, " 1/s; Riccati equation left {:.1e}", self.residual)?;
        for (i, state) in self.left_out.iter().enumerate() {
            write!(f, "{}`{}`", if i == 0 { "; left to itself: " } else { ", " }, state.name)?;
        }
        Ok(())
    }
}
