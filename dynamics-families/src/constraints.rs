//! Constraints of a run: multipliers λ of M q̈ = Q + Jᵀλ, J q̈ = γ, and corrections back onto the
//! constraints.
//!
//! With a = M⁻¹Q the multipliers fulfil J M⁻¹Jᵀ λ = γ − J a, and q̈ = a + M⁻¹Jᵀλ. Corrections of positions
//! and velocities are the smallest ones by the kinetic energy, M⁻¹Jᵀμ.

mod runs;
mod saddle;
mod schur;

use dynamics_runtime::simulate::OptionError;

use crate::failure::FamilyErrorKind;
use crate::linalg::order::NotBanded;
use crate::mass::Mass;
use crate::model::{FamilyModel, FamilyState, RowValues, Sizes, View};
use runs::Jacobian;
use saddle::Saddle;
use schur::Schur;

/// Entries of a row up to which products of them fit the band of the tangent.
const MOST_OF_SHORT_ROW: usize = 24;
/// Most corrections of positions.
const MOST_CORRECTIONS: u32 = 20;
/// Corrections to this part of the size of the coordinates are rounding.
const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// Corrections below this part are the last ones.
const SMALL: f64 = 1e-11;

/// The rows of a run.
#[derive(Debug)]
pub(crate) struct Rows {
    /// Where every field of rows ends.
    pub(crate) ends: Vec<usize>,
    /// Pairs of a row and a coordinate, in the order of the entries of J.
    pub(crate) pairs: Vec<(u32, u32)>,
    /// The same sorted by rows: row, coordinate, entry.
    by_row: Vec<(u32, u32, u32)>,
    jacobian: Jacobian,
    solver: Solver,
    values: OfRows,
    /// mᵢᵢ, which measure corrections, and 1/mᵢᵢ.
    masses: Vec<f64>,
    inverse: Vec<f64>,
    /// See [`Rows::reach`]; not known before the first projection.
    reach: Option<f64>,
    /// λ of the last evaluation.
    pub(crate) multipliers: Vec<f64>,
    change: Vec<f64>,
}

/// How far a state was off the constraints: the size of the first correction of positions, in parts of their
/// size, that of velocities, and the rows that were violated most.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    pub(crate) off: f64,
    pub(crate) row: usize,
    /// The size of the velocities, and of their correction.
    pub(crate) speed: f64,
    pub(crate) rate_moved: f64,
    pub(crate) rate_row: usize,
}

/// The place of the largest value; of one that is not a number, where there is one.
fn largest(of: &[f64]) -> usize {
    let size = |k: usize| if of[k].is_nan() { f64::INFINITY } else { of[k].abs() };
    (0..of.len()).fold(0, |largest, k| if size(k) > size(largest) { k } else { largest })
}

/// What a run says of its constraints.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstraintSummary {
    /// Rows.
    pub rows: usize,
    /// The structure of the system of the multipliers in words.
    pub system: String,
    /// The largest correction of a step's end back onto the constraints, in parts of the size of the
    /// coordinates, both measured by √Σ mᵢ xᵢ².
    pub correction: f64,
    /// The largest entry of Φ_q q̈ − γ at the end, in parts of the largest sum of the sizes of its terms: how
    /// well the multipliers were solved for. It grows with the square of the length of a chain.
    pub residual: f64,
}

/// What rows have at a state.
#[derive(Debug)]
struct OfRows {
    residual: Vec<f64>,
    velocity_residual: Vec<f64>,
    gamma: Vec<f64>,
    entries: Vec<f64>,
}

/// What is wanted of the rows beside J.
#[derive(Clone, Copy, Debug)]
enum Wanted {
    /// γ.
    Accelerations,
    /// Φ and Φ̇.
    Residuals,
}

#[derive(Debug)]
enum Solver {
    Schur(Schur),
    Saddle(Box<Saddle>),
}

impl Rows {
    /// Of a model; `None` where it has no constraints.
    pub(crate) fn of_model<M: FamilyModel>(
        model: &M,
        mass: &Mass,
        ends: &Sizes,
    ) -> Result<Option<Self>, FamilyErrorKind> {
        Self::new(model, mass, ends)
            .map_err(|_| FamilyErrorKind::NotBanded { matrix: "system of the constraints" })
    }

    fn new<M: FamilyModel>(model: &M, mass: &Mass, ends: &Sizes) -> Result<Option<Self>, NotBanded> {
        let row_ends = model.row_ends();
        let rows = row_ends.last().copied().unwrap_or(0);
        if rows == 0 {
            return Ok(None);
        }
        let n = ends.last().copied().unwrap_or(0);
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        // A model has fewer than 2³² coordinates: their states would fill 32 GiB.
        model.row_pattern(&mut |row, unknown| pairs.push((row as u32, unknown as u32)));
        let entries = pairs.iter().enumerate();
        let mut by_row: Vec<(u32, u32, u32)> =
            entries.map(|(entry, &(row, unknown))| (row, unknown, entry as u32)).collect();
        by_row.sort_unstable();
        let mut masses = vec![0.0; n];
        model.mass(&mut |i, j, value| {
            if i == j {
                masses[i] += value;
            }
        });
        let inverse = masses.iter().map(|mass| 1.0 / mass).collect();
        let schur = match mass {
            Mass::Diagonal(_) => Schur::new(&pairs, n, &row_ends),
            Mass::Banded(_) => None,
        };
        let (jacobian, count) = (Jacobian::new(&pairs), pairs.len());
        let solver = match schur {
            Some(schur) => Solver::Schur(schur),
            None => {
                let mut entries = Vec::new();
                model.mass(&mut |i, j, value| entries.push((i as u32, j as u32, value)));
                Solver::Saddle(Box::new(Saddle::new(entries, pairs.clone(), ends, &row_ends)?))
            }
        };
        let values = OfRows {
            residual: vec![0.0; rows],
            velocity_residual: vec![0.0; rows],
            gamma: vec![0.0; rows],
            entries: vec![0.0; count],
        };
        let (multipliers, change) = (vec![0.0; rows], vec![0.0; n]);
        Ok(Some(Self {
            ends: row_ends,
            pairs,
            by_row,
            jacobian,
            solver,
            values,
            masses,
            inverse,
            reach: None,
            multipliers,
            change,
        }))
    }

    /// Entries of J of the last evaluation, row by row, with their coordinates; of rows with few entries.
    pub(crate) fn short_rows(&self) -> impl Iterator<Item = &[(u32, u32, u32)]> {
        let rows = self.by_row.chunk_by(|a, b| a.0 == b.0);
        rows.filter(|row| row.len() <= MOST_OF_SHORT_ROW)
    }

    /// Entries of J of the last evaluation.
    pub(crate) fn entries(&self) -> &[f64] {
        &self.values.entries
    }

    /// Evaluates J and what else is wanted of the rows, and prepares the system of their multipliers.
    fn evaluate<M: FamilyModel>(
        &mut self,
        model: &M,
        at: View<'_>,
        wanted: Wanted,
    ) -> Result<(), FamilyErrorKind> {
        let OfRows { residual, velocity_residual, gamma, entries } = &mut self.values;
        let none = || &mut [][..];
        let (residual, velocity_residual, gamma) = match wanted {
            Wanted::Accelerations => (none(), none(), &mut gamma[..]),
            Wanted::Residuals => (&mut residual[..], &mut velocity_residual[..], none()),
        };
        model.rows(at, RowValues { residual, velocity_residual, gamma, jacobian: entries });
        let factored = match &mut self.solver {
            Solver::Schur(schur) => schur.factor(&self.values.entries, &self.inverse),
            Solver::Saddle(saddle) => {
                saddle.factor(&self.values.entries).map_err(|place| place.saturating_sub(self.change.len()))
            }
        };
        factored.map_err(|row| self.not_solved::<M>(row))
    }

    /// Why the system of the multipliers has no solution at a row.
    fn not_solved<M: FamilyModel>(&self, row: usize) -> FamilyErrorKind {
        let row = row_name::<M>(&self.ends, row);
        match self.values.entries.iter().all(|entry| entry.is_finite()) {
            true => FamilyErrorKind::DependentRows { row },
            false => FamilyErrorKind::RowNotFinite { row },
        }
    }

    /// q̈ at a state, from the model's forces; `multipliers` are λ then.
    pub(crate) fn solve_at<M: FamilyModel>(
        &mut self,
        model: &M,
        mass: &Mass,
        at: View<'_>,
        a: &mut [f64],
    ) -> Result<(), FamilyErrorKind> {
        mass.accelerations(model, 1, at, a, &mut self.change);
        self.constrain(model, at, a)
    }

    /// Turns M⁻¹Q at a state into q̈; `multipliers` are λ then.
    pub(crate) fn constrain<M: FamilyModel>(
        &mut self,
        model: &M,
        at: View<'_>,
        a: &mut [f64],
    ) -> Result<(), FamilyErrorKind> {
        self.evaluate(model, at, Wanted::Accelerations)?;
        self.multipliers.copy_from_slice(&self.values.gamma);
        self.jacobian.multiply_add(&self.values.entries, a, -1.0, &mut self.multipliers);
        self.add_correction::<M>(a)
    }

    /// Adds Jᵀλ of the last solution.
    pub(crate) fn add_reactions(&self, forces: &mut [f64]) {
        let (entries, multipliers) = (&self.values.entries, &self.multipliers);
        self.jacobian.multiply_transposed_add(entries, multipliers, None, forces);
    }

    /// Adds the smallest change whose product with J is in `multipliers`, which become μ.
    fn add_correction<M: FamilyModel>(&mut self, to: &mut [f64]) -> Result<(), FamilyErrorKind> {
        match &mut self.solver {
            Solver::Schur(schur) => {
                schur.solve(&mut self.multipliers).map_err(|row| self.not_solved::<M>(row))?;
                self.jacobian.multiply_transposed_add(
                    &self.values.entries,
                    &self.multipliers,
                    Some(&self.inverse),
                    to,
                );
            }
            Solver::Saddle(saddle) => {
                saddle.solve(&mut self.multipliers, &mut self.change);
                to.iter_mut().zip(&self.change).for_each(|(to, change)| *to += change);
            }
        }
        Ok(())
    }

    /// Moves positions, then velocities, onto the constraints. Returns how far they were off.
    ///
    /// # Errors
    /// Where rows depend on one another, and where corrections do not shrink.
    pub(crate) fn project<M: FamilyModel>(
        &mut self,
        model: &M,
        t: f64,
        q: &mut [f64],
        u: &mut [f64],
        inputs: &[f64],
    ) -> Result<Projection, FamilyErrorKind> {
        let (mut off, mut row) = (None, 0);
        let mut stays = false;
        let mut corrections = 0;
        if M::ROWS.iter().any(|field| field.holonomic) {
            loop {
                self.evaluate(model, View { t, q, u, inputs }, Wanted::Residuals)?;
                // Nonholonomic rows have no Φ: a change of positions along them is none of theirs.
                self.multipliers.iter_mut().zip(&self.values.residual).for_each(|(to, r)| *to = -r);
                let scale = self.size(q) + self.reach(model, View { t, q, u, inputs });
                self.change_by_correction::<M>(q)?;
                let moved = self.size(&self.change);
                let part = if moved == 0.0 { 0.0 } else { moved / (scale + moved) };
                if off.is_none() {
                    off = Some(part);
                    // Named where it is too much.
                    if part > SMALL {
                        row = largest(&self.values.residual);
                    }
                }
                stays = part <= ROUNDING;
                // What is left is the square of the correction.
                if part <= SMALL {
                    break;
                }
                corrections += 1;
                if corrections == MOST_CORRECTIONS || !part.is_finite() {
                    let row = largest(&self.values.residual);
                    return Err(FamilyErrorKind::NotProjected { row: row_name::<M>(&self.ends, row) });
                }
            }
        }
        if !stays {
            self.evaluate(model, View { t, q, u, inputs }, Wanted::Residuals)?;
        }
        self.multipliers.iter_mut().zip(&self.values.velocity_residual).for_each(|(to, r)| *to = -r);
        let speed = self.size(u);
        self.change_by_correction::<M>(u)?;
        let moved = self.size(&self.change);
        let rate_row = if moved > SMALL * speed { largest(&self.values.velocity_residual) } else { 0 };
        Ok(Projection { off: off.unwrap_or(0.0), row, speed, rate_moved: moved, rate_row })
    }

    /// By how much coordinates may change before rows have other gradients, by the stiffness of rows: the
    /// length of rods. Where coordinates are zero it says what is small. 0 for linear rows.
    fn reach<M: FamilyModel>(&mut self, model: &M, at: View<'_>) -> f64 {
        if let Some(reach) = self.reach {
            return reach;
        }
        let (mut bend, all) = (0.0f64, vec![1.0; self.multipliers.len()]);
        model.row_stiffness(at, &all, &mut |_, _, value| bend = bend.max(value.abs()));
        let slope = self.values.entries.iter().fold(0.0f64, |most, entry| most.max(entry.abs()));
        let whole: f64 = self.masses.iter().sum();
        let reach = if bend > 0.0 && bend.is_finite() { slope / bend * whole.sqrt() } else { 0.0 };
        *self.reach.insert(reach)
    }

    /// A speed that accelerations give within the reach of the rows: what is small beside it is rounding.
    pub(crate) fn natural_speed(&self, a: &[f64]) -> f64 {
        (self.reach.unwrap_or(0.0) * self.size(a)).sqrt()
    }

    /// Adds the correction, and keeps it.
    fn change_by_correction<M: FamilyModel>(&mut self, to: &mut [f64]) -> Result<(), FamilyErrorKind> {
        match &mut self.solver {
            Solver::Schur(schur) => {
                schur.solve(&mut self.multipliers).map_err(|row| self.not_solved::<M>(row))?;
                self.change.fill(0.0);
                self.jacobian.multiply_transposed_add(
                    &self.values.entries,
                    &self.multipliers,
                    Some(&self.inverse),
                    &mut self.change,
                );
            }
            Solver::Saddle(saddle) => saddle.solve(&mut self.multipliers, &mut self.change),
        }
        to.iter_mut().zip(&self.change).for_each(|(to, change)| *to += change);
        Ok(())
    }

    /// √Σ mᵢ xᵢ².
    fn size(&self, x: &[f64]) -> f64 {
        let masses = &self.masses[..x.len()];
        crate::generated::sum(0..x.len(), |i| masses[i] * x[i] * x[i]).sqrt()
    }

    /// The largest entry of J q̈ − γ after an evaluation of q̈, in parts of the largest sum of the sizes of
    /// its terms.
    pub(crate) fn residual_of(&self, a: &[f64]) -> f64 {
        let mut left = self.values.gamma.clone();
        self.jacobian.multiply_add(&self.values.entries, a, -1.0, &mut left);
        let sizes: Vec<f64> = self.values.entries.iter().map(|entry| entry.abs()).collect();
        let accelerations: Vec<f64> = a.iter().map(|a| a.abs()).collect();
        let mut scale: Vec<f64> = self.values.gamma.iter().map(|gamma| gamma.abs()).collect();
        self.jacobian.multiply_add(&sizes, &accelerations, 1.0, &mut scale);
        let most = |values: &[f64]| values.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        let scale = most(&scale);
        if scale > 0.0 { most(&left) / scale } else { 0.0 }
    }

    /// The structure of the system in words.
    pub(crate) fn describe(&self) -> String {
        match &self.solver {
            Solver::Schur(schur) => schur.describe(),
            Solver::Saddle(saddle) => saddle.describe(),
        }
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        let solver = match &self.solver {
            Solver::Schur(schur) => schur.bytes(),
            Solver::Saddle(saddle) => saddle.bytes(),
        };
        solver + 8 * (4 * self.multipliers.len() + self.values.entries.len() + 3 * self.change.len())
    }
}

/// Moves a state onto the constraints.
pub(crate) fn place_on_constraints<M: FamilyModel>(
    model: &M,
    state: &mut M::State,
) -> Result<(), FamilyErrorKind> {
    let ends = state.ends().clone();
    let mass = Mass::new(model, &ends).map_err(|problem| FamilyErrorKind::of_mass::<M>(problem, &ends))?;
    let Some(mut rows) = Rows::of_model(model, &mass, &ends)? else { return Ok(()) };
    let (t, q, u, inputs) = state.parts_mut();
    let inputs: Vec<f64> = inputs.iter().map(|input| if input.is_nan() { 0.0 } else { *input }).collect();
    rows.project(model, *t, q, u, &inputs)?;
    Ok(())
}

/// The rows with their Jacobian and multipliers at a state, with these velocities; `None` where the model has
/// no constraints.
pub(crate) fn rows_at<M: FamilyModel>(
    model: &M,
    state: &M::State,
    u: &[f64],
    ends: &Sizes,
) -> Result<Option<Rows>, FamilyErrorKind> {
    if M::ROWS.is_empty() {
        return Ok(None);
    }
    if let Some(input) = state.inputs().iter().position(|input| !input.is_finite()) {
        return Err(OptionError::InputWithoutValue { input: M::INPUTS[input].name }.into());
    }
    let mass = Mass::new(model, ends).map_err(|problem| FamilyErrorKind::of_mass::<M>(problem, ends))?;
    let mut rows = Rows::of_model(model, &mass, ends)?;
    if let Some(rows) = &mut rows {
        rows.solve_at(model, &mass, View { u, ..state.view() }, &mut vec![0.0; u.len()])?;
    }
    Ok(rows)
}

/// The user's name of a row: `link[7]`, `closure.x`.
pub(crate) fn row_name<M: FamilyModel>(ends: &[usize], row: usize) -> String {
    let field = ends.partition_point(|&end| end <= row).min(M::ROWS.len().saturating_sub(1));
    let Some(declared) = M::ROWS.get(field) else { return String::new() };
    let begin = if field == 0 { 0 } else { ends[field - 1] };
    match declared.numbered {
        false => format!("{}{}", declared.name, declared.component),
        true => format!("{}[{}]{}", declared.name, row - begin, declared.component),
    }
}
