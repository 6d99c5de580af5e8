//! No direction of motion has negative inertia. Random states are tried, with the nominal values where all
//! are given that M needs; otherwise with positive parameters of several sizes, and then only a diagonal
//! element that is negative every time is reported.

use crate::graph::{Bindings, FunctionId, Sampler, Symbol};
use crate::mechanics::{EnergyRole, Equations, Model};

use super::Finding;
use super::unused::Reads;

/// Random states at which M is evaluated. With guessed parameters only an element that is negative in all of
/// them is reported, so that more states make false reports rarer.
const STATES: u64 = 8;
/// The same where M is left out: each state takes as many evaluations as there are coordinates, and M is
/// large.
const STATES_WITHOUT_MASS_MATRIX: u64 = 2;

/// Ratio of a pivot of LDLᵀ to its diagonal element of M within which it is zero to rounding.
const VANISHING_PIVOT: f64 = 1e-9;

/// Coordinates whose inertia is negative.
pub(super) fn definite(model: &Model, equations: &Equations, found: &mut Vec<Finding>) {
    // The sign of a Lagrangian given directly is the user's own affair: −L has the same motions.
    if model.energies.iter().any(|e| e.role == EnergyRole::Lagrangian) {
        return;
    }
    // M, or M q̈, whose values for unit vectors q̈ are its columns.
    let left_out = equations.leaves_out_mass_matrix();
    let mass = if left_out { equations.mass_product.clone() } else { equations.mass_matrix.concat() };
    let states = if left_out { STATES_WITHOUT_MASS_MATRIX } else { STATES };
    let reads = Reads::of(model, &mass);
    if reads.any_function() {
        return;
    }
    let n = model.coordinates.len();
    let given = |i: u32| model.nominal.iter().find(|(p, _)| *p == i).map(|(_, value)| *value);
    let nominal =
        (0..model.parameters.len() as u32).all(|i| given(i).is_some() || !reads.symbol(Symbol::Parameter(i)));
    let mut negative = vec![0; n];
    for point in 0..states {
        let at = |accelerated| {
            let state = State { sampler: Sampler::new(&model.graph, &[]), point, given: &given, accelerated };
            let values = model.graph.evaluate(&mass, &state);
            mass.iter().map(|id| values[id.index()]).collect::<Vec<f64>>()
        };
        let rows = if left_out {
            (0..n).map(|j| at(Some(j))).collect()
        } else {
            // A model may have no coordinates.
            at(None).chunks(n.max(1)).map(<[f64]>::to_vec).collect::<Vec<_>>()
        };
        let m = |i: usize, j: usize| rows[i][j];
        let bad = if nominal { negative_pivot(n, m) } else { None };
        for (i, count) in negative.iter_mut().enumerate() {
            *count += u64::from(m(i, i) < 0.0 || bad == Some(i));
        }
    }
    for (i, count) in negative.into_iter().enumerate() {
        if count == states || nominal && count > 0 {
            let c = &model.coordinates[i];
            found.push(Finding::NegativeInertia {
                direction: c.name.clone(),
                nominal,
                origins: vec![c.origin],
            });
            return;
        }
    }
}

/// The first row at which LDLᵀ of a symmetric matrix meets a clearly negative pivot.
fn negative_pivot(n: usize, m: impl Fn(usize, usize) -> f64) -> Option<usize> {
    let mut rest: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| m(i, j)).collect()).collect();
    for k in 0..n {
        let pivot = rest[k][k];
        if pivot < -VANISHING_PIVOT * m(k, k).abs() {
            return Some(k);
        }
        // A vanishing pivot is a singular state, not a wrong sign.
        if pivot.is_nan() || pivot <= VANISHING_PIVOT * m(k, k).abs() {
            return None;
        }
        for i in k + 1..n {
            let l = rest[i][k] / pivot;
            let above = rest[k].clone();
            rest[i].iter_mut().zip(above).skip(k + 1).for_each(|(x, a)| *x -= l * a);
        }
    }
    None
}

struct State<'a> {
    sampler: Sampler<'a>,
    point: u64,
    given: &'a dyn Fn(u32) -> Option<f64>,
    /// q̈ is the unit vector of this coordinate.
    accelerated: Option<usize>,
}

impl Bindings for State<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        // From 0 to 1.
        let random = self.sampler.random(symbol, self.point).residue(0) as f64 / (1u64 << 61) as f64;
        match symbol {
            Symbol::Parameter(i) => (self.given)(i).unwrap_or(0.2 + 3.0 * random * random),
            Symbol::Time => random,
            Symbol::Acceleration(j) => f64::from(u8::from(self.accelerated == Some(j as usize))),
            _ => 2.0 * random - 1.0,
        }
    }
    fn smooth(&self, _: FunctionId, _: u8, _: f64) -> f64 {
        f64::NAN
    }
}
