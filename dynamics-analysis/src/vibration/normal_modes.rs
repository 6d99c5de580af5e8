//! Normal modes: those of mass and stiffness alone, real, orthogonal to each other.
//!
//! ```text
//! K φ = ω² M φ        ΦᵀM Φ = 1        ΦᵀK Φ = diag ω²        ΦᵀC Φ = modal damping
//! Γ_k = φ_kᵀM r       effective mass Γ_k²,        Σ Γ_k² = rᵀM r
//! ```
//!
//! Γ is the participation of a mode if the base accelerates along r (R. W. Clough & J. Penzien, *Dynamics of
//! Structures*, §12, §26). With damping they are modes of the damped system, too, where ΦᵀC Φ is diagonal
//! (proportional damping, T. K. Caughey, J. Appl. Mech. 27 (1960) 269); elsewhere `Linearization::modes` has
//! the complex ones. Modes of equal frequency are rotated within their space so that damping couples them
//! least.

use alloc::vec::Vec;

use dynamics_runtime::model::Quantity;
use dynamics_view::suggest;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::VibrationError;
use super::state_space::{Signal, StateSpace};
use crate::linearize::{Linearization, potential_stiffness, undamped_modes};

/// Relative difference of ω² up to which frequencies count as equal, so that their modes are rotated to
/// uncouple damping. A larger value rotates modes that are distinct, which leaves Kφ = ω²Mφ with an error
/// of its size.
const EQUAL_FREQUENCIES_OF_MODES: f64 = 1e-10;
/// Least ω² as a scale of these differences, relative to the largest ω²: below it rounding of the stiff
/// modes counts.
pub(crate) const MIN_SQUARED_FREQUENCY: f64 = 1e-6;
/// Largest coupling |c_ij|/√(c_ii c_jj) of modes that have damping ratios of their own; rounding lies far
/// below.
const MAX_MODAL_COUPLING: f64 = 1e-9;
/// Gyroscopic terms up to this part of the damping matrix are rounding. Larger ones would make the modes
/// complex.
const MAX_GYROSCOPIC_SHARE: f64 = 1e-14;
/// Elements of the modal damping matrix up to this many roundings of its largest element are no coupling.
const COUPLING_ROUNDINGS: f64 = 16.0;

const WITHOUT_SYMMETRY: &str = "rolling, or forces that have no potential, leave the stiffness without \
    symmetry";

/// The modes of mass and stiffness, C of them, by growing frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalModes {
    /// ω, in rad/s; exactly 0 for rigid-body modes.
    pub frequencies: Vec<f64>,
    /// Φ in the independent coordinates, C×C, a column for each mode, normalised so that ΦᵀM Φ = 1. The
    /// largest element of a column is positive.
    pub shapes: DMatrix<f64>,
    /// The shapes in all coordinates, N×C, dependent ones included.
    pub all: DMatrix<f64>,
    /// ΦᵀC Φ, C×C.
    pub damping: DMatrix<f64>,
    /// The mass matrix, C×C.
    pub mass: DMatrix<f64>,
    /// The independent coordinates.
    pub coordinates: Vec<Quantity>,
    /// All coordinates, N.
    pub all_coordinates: &'static [Quantity],
}

impl Linearization {
    /// K, if there are normal modes.
    pub(super) fn stiffness_of_normal_modes(&self) -> Result<DMatrix<f64>, VibrationError> {
        if let Some(reason) = &self.unsteady {
            return Err(reason.clone().into());
        }
        if self.gyroscopic().amax() > MAX_GYROSCOPIC_SHARE * self.damping.amax() {
            return Err(VibrationError::NoNormalModes { why: "gyroscopic terms couple velocities" });
        }
        potential_stiffness(self).ok_or(VibrationError::NoNormalModes { why: WITHOUT_SYMMETRY })
    }

    /// The modes of mass and stiffness alone, normalised by mass.
    ///
    /// # Errors
    /// Where there are none: gyroscopic or circulatory terms, rolling, a position that is no equilibrium, or
    /// that is unstable.
    pub fn normal_modes(&self) -> Result<NormalModes, VibrationError> {
        self.stiffness_of_normal_modes()?;
        let dissipative = self.dissipative();
        let mut bare = self.clone();
        bare.damping.fill(0.0);
        let (squares, mut shapes) =
            undamped_modes(&bare)?.ok_or(VibrationError::NoNormalModes { why: WITHOUT_SYMMETRY })?;
        if squares.iter().any(|square| *square < 0.0) {
            let why = "the position is unstable, and falls along a mode rather than swings";
            return Err(VibrationError::NoNormalModes { why });
        }
        uncouple_equal_modes(&squares, &mut shapes, &dissipative);
        for mut shape in shapes.column_iter_mut() {
            if shape[shape.iamax()] < 0.0 {
                shape.neg_mut();
            }
        }
        Ok(NormalModes {
            frequencies: squares.iter().map(|square| square.sqrt()).collect(),
            all: &self.shape * &shapes,
            damping: modal(&dissipative, &shapes),
            shapes,
            mass: self.mass.clone(),
            coordinates: self.coordinates.clone(),
            all_coordinates: self.all,
        })
    }
}

/// ΦᵀC Φ. Elements that are only rounding are 0, for example those of a damper between bodies that move
/// together.
fn modal(damping: &DMatrix<f64>, shapes: &DMatrix<f64>) -> DMatrix<f64> {
    let sizes = shapes.abs().tr_mul(&(damping.abs() * shapes.abs()));
    let least = 4.0 * shapes.nrows() as f64 * f64::EPSILON;
    shapes
        .tr_mul(&(damping * shapes))
        .zip_map(&sizes, |x, size| if x.abs() <= least * size { 0.0 } else { x })
}

/// Rotates the modes of each repeated frequency so that damping does not couple them.
fn uncouple_equal_modes(squares: &DVector<f64>, shapes: &mut DMatrix<f64>, damping: &DMatrix<f64>) {
    let n = squares.len();
    let mut first = 0;
    while first < n {
        let size = squares[n - 1].abs();
        // Rigid-body modes have exactly 0. A slow oscillation is never equal to them.
        let same = |k: &usize| match squares[first] {
            0.0 => squares[*k] == 0.0,
            square => {
                squares[*k] - square <= EQUAL_FREQUENCIES_OF_MODES * square.max(MIN_SQUARED_FREQUENCY * size)
            }
        };
        let count = (first..n).take_while(same).count();
        if count > 1 {
            let block = shapes.columns(first, count).into_owned();
            let within = block.tr_mul(&(damping * &block));
            let turned = SymmetricEigen::new(0.5 * (&within + within.transpose()));
            let mut order: Vec<usize> = (0..count).collect();
            order.sort_by(|i, j| turned.eigenvalues[*i].total_cmp(&turned.eigenvalues[*j]));
            if within.amax() > 0.0 {
                shapes
                    .columns_mut(first, count)
                    .copy_from(&(block * turned.eigenvectors.select_columns(&order)));
            }
        }
        first += count;
    }
}

impl NormalModes {
    /// The number of rigid-body modes, with frequency 0.
    #[must_use]
    pub fn rigid(&self) -> usize {
        self.frequencies.iter().filter(|frequency| **frequency == 0.0).count()
    }

    /// The mass of each mode if its largest coordinate moves by 1: 1/φ², in kg, or in kg m² if that is an
    /// angle.
    #[must_use]
    pub fn modal_masses(&self) -> Vec<f64> {
        self.all.column_iter().map(|shape| shape.amax().powi(-2)).collect()
    }

    /// The coupling of modes by damping: the largest |c_ij|/√(c_ii c_jj), 0 for proportional damping.
    #[must_use]
    pub fn coupling(&self) -> f64 {
        let (c, n) = (&self.damping, self.frequencies.len());
        let of = |i: usize, j: usize| {
            let size = (c[(i, i)] * c[(j, j)]).abs().sqrt();
            let whole = f64::EPSILON * c.amax();
            if c[(i, j)].abs() <= COUPLING_ROUNDINGS * whole {
                0.0
            } else {
                c[(i, j)].abs() / size.max(whole)
            }
        };
        (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| of(i, j)).fold(0.0, f64::max)
    }

    /// ζ of each mode; infinite for a damped rigid-body mode, 0 without damping.
    ///
    /// # Errors
    /// Damping that couples the modes, so that no mode has a ratio of its own.
    pub fn damping_ratios(&self) -> Result<Vec<f64>, VibrationError> {
        if self.coupling() > MAX_MODAL_COUPLING {
            return Err(VibrationError::NoNormalModes {
                why: "damping couples the modes, so that none has a damping ratio of its own",
            });
        }
        let ratio = |(k, frequency): (usize, &f64)| match self.damping[(k, k)] {
            0.0 => 0.0,
            c => c / (2.0 * frequency),
        };
        Ok(self.frequencies.iter().enumerate().map(ratio).collect())
    }

    /// r, in the independent coordinates.
    fn direction(&self, direction: &[(&str, f64)]) -> Result<DVector<f64>, VibrationError> {
        let mut r = DVector::zeros(self.coordinates.len());
        for (k, (name, value)) in direction.iter().enumerate() {
            let wrong = |must_be| VibrationError::Value { what: "a direction", value: *value, must_be };
            if !value.is_finite() {
                return Err(wrong("a finite number"));
            }
            if direction[..k].iter().any(|(other, _)| other == name) {
                return Err(wrong("given once for each coordinate"));
            }
            let at = self.coordinates.iter().position(|q| q.name == *name);
            let at = at.ok_or_else(|| VibrationError::UnknownName {
                what: "independent coordinate",
                name: (*name).into(),
                nearest: suggest(name, self.coordinates.iter().map(|q| q.name)),
            })?;
            r[at] = *value;
        }
        Ok(r)
    }

    /// Γ, the participation of each mode if the base accelerates along a direction r. Give r as the
    /// displacements of the independent coordinates if the whole system moves with its base by 1; coordinates
    /// that are not named have 0.
    ///
    /// # Errors
    /// Names that are not independent coordinates, or come twice, and values that are not finite.
    pub fn participation(&self, direction: &[(&str, f64)]) -> Result<Vec<f64>, VibrationError> {
        Ok(self.shapes.tr_mul(&(&self.mass * self.direction(direction)?)).as_slice().to_vec())
    }

    /// Γ², the effective mass of each mode. Their sum is the mass of the whole system along the direction,
    /// so partial sums say how many modes suffice.
    ///
    /// # Errors
    /// Names that are not independent coordinates, or come twice, and values that are not finite.
    pub fn effective_masses(&self, direction: &[(&str, f64)]) -> Result<Vec<f64>, VibrationError> {
        Ok(self.participation(direction)?.into_iter().map(|x| x * x).collect())
    }

    /// The linear model in the lowest `count` modes: states are the modal coordinates `mode[0]` .. and their
    /// rates, inputs are generalized forces along all coordinates, outputs all coordinates and their rates,
    /// each by its name. Damping that couples modes is kept.
    ///
    /// # Errors
    /// No mode, or more than there are.
    pub fn superposition(&self, count: usize) -> Result<StateSpace, VibrationError> {
        if count == 0 || count > self.frequencies.len() {
            return Err(VibrationError::TooFew {
                what: "modes",
                count: self.frequencies.len(),
                needed: count.max(1),
            });
        }
        let n = self.all.nrows();
        let mut a = DMatrix::zeros(2 * count, 2 * count);
        let mut b = DMatrix::zeros(2 * count, n);
        let mut c = DMatrix::zeros(2 * n, 2 * count);
        for k in 0..count {
            a[(k, count + k)] = 1.0;
            a[(count + k, k)] = -self.frequencies[k] * self.frequencies[k];
            for j in 0..count {
                a[(count + k, count + j)] = -self.damping[(k, j)];
            }
            for i in 0..n {
                b[(count + k, i)] = self.all[(i, k)];
                c[(i, k)] = self.all[(i, k)];
                c[(n + i, count + k)] = self.all[(i, k)];
            }
        }
        let mut space = StateSpace::from_matrices(a, b, c, DMatrix::zeros(2 * n, n))?;
        let named = |name: &str| {
            self.all_coordinates
                .iter()
                .map(|q| Signal::new(dynamics_runtime::model::names::suffixed(q.name, name), ""))
                .collect::<Vec<_>>()
        };
        space.inputs = named("");
        space.outputs = [named(""), named("_rate")].concat();
        let states =
            |name: &'static str| (0..count).map(move |k| Signal::new(alloc::format!("{name}[{k}]"), ""));
        space.states = states("mode").chain(states("mode_rate")).collect();
        Ok(space)
    }
}
