//! The mass matrix of a model: constant, so factored once for each run.

use std::sync::Arc;

use crate::linalg::bordered::{Bordered, Factors, Kind};
use crate::linalg::order::{Layout, NotBanded};
use crate::model::{FamilyModel, Length, Sizes, View};

/// M, in the form in which it is inverted.
#[derive(Clone, Debug)]
pub(crate) enum Mass {
    /// The inverse of each mass.
    Diagonal(Vec<f64>),
    /// L D Lᵀ of the band, and the border.
    Banded(Box<(Bordered, Factors)>),
}

/// Why M has no inverse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MassProblem {
    /// Not positive definite, found at this unknown.
    NotPositive(usize),
    /// Couples unknowns that are too far apart.
    NotBanded,
}

impl From<NotBanded> for MassProblem {
    fn from(_: NotBanded) -> Self {
        Self::NotBanded
    }
}

impl Mass {
    pub(crate) fn new<M: FamilyModel>(model: &M, ends: &Sizes) -> Result<Self, MassProblem> {
        if M::DIAGONAL {
            let n = ends.unknowns();
            let mut masses = vec![0.0; n];
            model.mass(&mut |i, j, value| {
                if i == j {
                    masses[i] += value;
                }
            });
            let positive = |mass: &f64| *mass > 0.0 && mass.is_finite();
            if let Some(unknown) = masses.iter().position(|mass| !positive(mass)) {
                return Err(MassProblem::NotPositive(unknown));
            }
            masses.iter_mut().for_each(|mass| *mass = 1.0 / *mass);
            return Ok(Self::Diagonal(masses));
        }
        let layout = Layout::new(ends, &mut |visit| model.mass(&mut |i, j, _| visit(i, j)))?;
        let layout = Arc::new(layout);
        let mut matrix = Bordered::new(&layout);
        model.mass(&mut |i, j, value| {
            matrix.add(i, j, value);
        });
        let mut factors = Factors::new(&layout, Kind::Positive);
        factors.factor(&matrix, Kind::Positive).map_err(MassProblem::NotPositive)?;
        Ok(Self::Banded(Box::new((matrix, factors))))
    }

    /// M⁻¹Q at a state, forces by so many threads. `memory` has as many places.
    pub(crate) fn accelerations<M: FamilyModel>(
        &self,
        model: &M,
        threads: usize,
        at: View<'_>,
        a: &mut [f64],
        memory: &mut [f64],
    ) {
        match self {
            Self::Diagonal(inverse) => model.scaled_forces_by(threads, at, inverse, a),
            Self::Banded(parts) => {
                model.forces_by(threads, at, a);
                parts.1.solve(a, memory);
            }
        }
    }

    /// Its structure in words.
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Diagonal(_) => String::from("diagonal"),
            Self::Banded(parts) => parts.0.layout.describe(),
        }
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Diagonal(inverse) => 8 * inverse.len(),
            Self::Banded(parts) => parts.0.bytes() + parts.1.bytes(),
        }
    }
}

/// The user's name of an unknown: `s[7]`, `w[3][4]`, `cart`.
pub(crate) fn coordinate_name<M: FamilyModel>(sizes: &Sizes, unknown: usize) -> String {
    let field = sizes.partition_point(|&end| end <= unknown).min(M::FIELDS.len().saturating_sub(1));
    let Some(declared) = M::FIELDS.get(field) else { return String::new() };
    let node = unknown - sizes.range(field).start;
    match declared.length {
        Length::One => declared.name.to_string(),
        Length::Count { .. } => format!("{}[{node}]", declared.name),
        Length::Grid { .. } => {
            let columns = sizes.columns(field).max(1);
            format!("{}[{}][{}]", declared.name, node / columns, node % columns)
        }
    }
}

/// Accelerations of a model by themselves: what benchmarks measure.
#[doc(hidden)]
pub struct Accelerations {
    mass: Mass,
    memory: Vec<f64>,
}

impl Accelerations {
    /// With the factors of the mass matrix; none where it has no inverse.
    pub fn new<M: FamilyModel>(model: &M, sizes: &Sizes) -> Option<Self> {
        let mass = Mass::new(model, sizes).ok()?;
        Some(Self { mass, memory: vec![0.0; sizes.last().copied().unwrap_or(0)] })
    }

    /// q̈ without constraints, written to `a`.
    pub fn evaluate<M: FamilyModel>(&mut self, model: &M, at: View<'_>, a: &mut [f64]) {
        self.mass.accelerations(model, 1, at, a, &mut self.memory);
    }
}
