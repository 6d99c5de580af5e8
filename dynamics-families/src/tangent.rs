//! c_m M + c_d D + c_k K, assembled from the model's entries, and its solution: LDLᵀ where it is symmetric
//! and positive definite, else LU with partial pivoting.
//!
//! With constraints K contains −∂(Jᵀλ)/∂q and a multiple of JᵀJ, and the matrix is bordered by J: [.. Jᵀ; J
//! 0]. Unknowns are then the coordinates, and behind them −λ; right-hand sides are zero there.

use std::sync::Arc;

use crate::constraints::Rows;
use crate::failure::FamilyErrorKind;
use crate::linalg::bordered::{Bordered, Factors, Kind};
use crate::linalg::order::Layout;
use crate::mass::coordinate_name;
use crate::model::{FamilyModel, Sizes, View};

/// The matrix and its factors.
pub(crate) struct Tangent {
    pub(crate) layout: Arc<Layout>,
    pub(crate) mass: Bordered,
    pub(crate) matrix: Bordered,
    /// Entries of M on the diagonal, in the order of the model; 0 for rows of constraints.
    pub(crate) diagonal: Vec<f64>,
    ldl: Factors,
    lu: Option<Factors>,
    uses_lu: bool,
    /// Rows of constraints.
    pub(crate) rows: usize,
    /// What entries of J are multiplied with, so that they are as large as those of the matrix.
    row_scale: f64,
    memory: Vec<f64>,
    product: Vec<f64>,
}

/// The weights of M, D = −∂Q/∂u and K = −∂Q/∂q.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coefficients {
    pub(crate) mass: f64,
    pub(crate) damping: f64,
    pub(crate) stiffness: f64,
}

impl Tangent {
    /// Memory for the tangents of a model, with the entries that it has at a state.
    pub(crate) fn new<M: FamilyModel>(
        model: &M,
        at: View<'_>,
        ends: &Sizes,
        rows: Option<&Rows>,
    ) -> Result<Self, FamilyErrorKind> {
        let multipliers = rows.map_or(&[][..], |rows| &rows.multipliers);
        let mut pattern = |visit: &mut dyn FnMut(usize, usize)| {
            model.mass(&mut |i, j, _| visit(i, j));
            model.stiffness(at, &mut |i, j, _| visit(i, j));
            model.row_stiffness(at, multipliers, &mut |i, j, _| visit(i, j));
            for row in rows.iter().flat_map(|rows| rows.short_rows()) {
                for &(_, i, _) in row {
                    row.iter().for_each(|&(_, j, _)| visit(i as usize, j as usize));
                }
            }
            if M::VELOCITY_FORCES {
                model.damping(at, &mut |i, j, _| visit(i, j));
            }
        };
        let layout = match rows {
            None => Layout::new(ends, &mut pattern),
            Some(rows) => Layout::with_rows(ends, &rows.ends, &mut pattern, &rows.pairs),
        };
        let layout = layout.map_err(|_| FamilyErrorKind::NotBanded { matrix: "tangent stiffness" })?;
        let layout = Arc::new(layout);
        let mut mass = Bordered::new(&layout);
        model.mass(&mut |i, j, value| {
            mass.add(i, j, value);
        });
        let n = layout.unknown.len();
        let mut diagonal = vec![0.0; n];
        mass.for_each_row(|place, entry, _| diagonal[layout.unknown[place]] = entry);
        Ok(Self {
            matrix: Bordered::new(&layout),
            ldl: Factors::new(&layout, Kind::Symmetric),
            lu: None,
            uses_lu: false,
            rows: rows.map_or(0, |rows| rows.multipliers.len()),
            row_scale: 1.0,
            memory: vec![0.0; n],
            product: vec![0.0; n],
            layout,
            mass,
            diagonal,
        })
    }

    /// Assembles the matrix at a state.
    pub(crate) fn assemble<M: FamilyModel>(
        &mut self,
        model: &M,
        at: View<'_>,
        weights: Coefficients,
        rows: Option<&Rows>,
    ) -> Result<(), FamilyErrorKind> {
        if M::DIAGONAL && self.rows == 0 {
            self.matrix.set_diagonal(&self.diagonal, weights.mass);
        } else {
            self.matrix.clear();
            if weights.mass != 0.0 {
                self.matrix.add_multiple(weights.mass, &self.mass);
            }
        }
        let mut fits = true;
        let matrix = &mut self.matrix;
        model.stiffness_runs(at, &mut |i, j, values| fits &= matrix.add_run(i, j, values, weights.stiffness));
        if M::VELOCITY_FORCES && weights.damping != 0.0 {
            model.damping(at, &mut |i, j, value| fits &= matrix.add(i, j, weights.damping * value));
        }
        if let Some(rows) = rows {
            let n = self.layout.unknown.len() - self.rows;
            model.row_stiffness(at, &rows.multipliers, &mut |i, j, value| {
                fits &= matrix.add(i, j, weights.stiffness * value);
            });
            let mut largest = 0.0f64;
            matrix.for_each_row(|_, entry, _| largest = largest.max(entry.abs()));
            let entry = rows.entries().iter().fold(0.0f64, |most, entry| most.max(entry.abs()));
            self.row_scale = if largest > 0.0 && entry > 0.0 { largest / entry } else { 1.0 };
            for (&(row, unknown), entry) in rows.pairs.iter().zip(rows.entries()) {
                let (row, unknown, entry) = (n + row as usize, unknown as usize, entry * self.row_scale);
                fits &= matrix.add(row, unknown, entry) && matrix.add(unknown, row, entry);
            }
            // JᵀJ changes nothing for motions that the constraints permit, and leaves no pivot at zero where
            // something moves along a rod.
            let factor = if largest > 0.0 { self.row_scale * self.row_scale / largest } else { 1.0 };
            for row in rows.short_rows() {
                for &(_, i, first) in row {
                    for &(_, j, second) in row {
                        let product = rows.entries()[first as usize] * rows.entries()[second as usize];
                        fits &= matrix.add(i as usize, j as usize, factor * product);
                    }
                }
            }
        }
        match fits {
            true => Ok(()),
            false => Err(FamilyErrorKind::NotBanded { matrix: "tangent stiffness" }),
        }
    }

    /// Factors the matrix in whatever way is possible.
    pub(crate) fn factor<M: FamilyModel>(&mut self, ends: &Sizes) -> Result<(), FamilyErrorKind> {
        self.uses_lu = self.rows > 0
            || !(M::SYMMETRIC || self.matrix.is_symmetric())
            || self.ldl.factor(&self.matrix, Kind::Positive).is_err();
        if !self.uses_lu {
            return Ok(());
        }
        let layout = &self.layout;
        let lu = self.lu.get_or_insert_with(|| Factors::new(layout, Kind::General));
        let factored = lu.factor(&self.matrix, Kind::General);
        factored.map_err(|unknown| FamilyErrorKind::Singular {
            matrix: "tangent stiffness",
            coordinate: self.name_of::<M>(ends, unknown),
            remedy: "something moves without resistance there; hold it, or begin nearer to the solution",
        })
    }

    /// The user's name of an unknown; of the last coordinate where it is a row.
    fn name_of<M: FamilyModel>(&self, ends: &Sizes, unknown: usize) -> String {
        coordinate_name::<M>(ends, unknown.min(ends.last().map_or(0, |end| end.saturating_sub(1))))
    }

    /// Factors a symmetric matrix for its inertia: eigenvalues below zero, and whether one is zero. With
    /// constraints those of motions that they permit: every independent row adds one below zero to the
    /// matrix.
    pub(crate) fn inertia(&mut self) -> Option<(usize, bool)> {
        if !self.matrix.is_symmetric() {
            return None;
        }
        self.uses_lu = false;
        match self.ldl.factor(&self.matrix, Kind::Symmetric) {
            Ok(()) => Some((self.ldl.negative.checked_sub(self.rows)?, self.ldl.singular)),
            Err(_) => Some((self.ldl.negative.saturating_sub(self.rows), true)),
        }
    }

    /// Replaces x, in the order of the model, by the solution.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        let factors = if self.uses_lu { self.lu.as_ref() } else { None };
        factors.unwrap_or(&self.ldl).solve(x, &mut self.memory);
    }

    /// The same in the order of places.
    pub(crate) fn solve_ordered(&self, x: &mut [f64]) {
        self.ldl.solve_ordered(x);
    }

    /// y = M x in the order of the model.
    pub(crate) fn mass_times(&mut self, x: &[f64], y: &mut [f64]) {
        if self.layout.in_order {
            return self.mass.multiply(x, y);
        }
        let places = self.memory.iter_mut().zip(&self.layout.unknown);
        places.for_each(|(place, &unknown)| *place = x[unknown]);
        self.mass.multiply(&self.memory, &mut self.product);
        self.product.iter().zip(&self.layout.unknown).for_each(|(value, &unknown)| y[unknown] = *value);
    }

    /// √Σ mᵢ xᵢ², which has one unit whatever the units of the coordinates are.
    pub(crate) fn norm(&self, x: &[f64]) -> f64 {
        crate::generated::sum(0..x.len(), |i| self.diagonal[i] * x[i] * x[i]).sqrt()
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        let lu = self.lu.as_ref().map_or(0, Factors::bytes);
        self.mass.bytes() + self.matrix.bytes() + self.ldl.bytes() + lu + 24 * self.diagonal.len()
    }
}

/// A Newton step of an implicit method, by itself: what benchmarks measure.
#[doc(hidden)]
pub struct NewtonStep {
    tangent: Tangent,
    sizes: Sizes,
}

impl NewtonStep {
    /// With memory for a model.
    ///
    /// # Errors
    /// A tangent that is not banded.
    pub fn new<M: FamilyModel>(model: &M, at: View<'_>, sizes: &Sizes) -> Result<Self, FamilyErrorKind> {
        Ok(Self { tangent: Tangent::new(model, at, sizes, None)?, sizes: sizes.clone() })
    }

    /// Assembles `mass` M + K at a state, factors it and replaces x by the solution.
    ///
    /// # Errors
    /// A singular tangent.
    pub fn solve<M: FamilyModel>(
        &mut self,
        model: &M,
        at: View<'_>,
        mass: f64,
        x: &mut [f64],
    ) -> Result<(), FamilyErrorKind> {
        let weights = Coefficients { mass, damping: 0.0, stiffness: 1.0 };
        self.tangent.assemble(model, at, weights, None)?;
        self.tangent.factor::<M>(&self.sizes)?;
        self.tangent.solve(x);
        Ok(())
    }
}
