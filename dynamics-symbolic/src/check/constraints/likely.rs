//! Where motions are likely to begin: with all coordinates 0, as models are commonly declared (upright,
//! straight on, in line), put onto the constraints by the nearest way, which keeps symmetries. Rows that have
//! no direction there, norms of Euler parameters and rods in Cartesian coordinates, are given one by a
//! coordinate of theirs.
//!
//! What rolls runs in any direction: angles that turn rows of velocities and are free to choose are a quarter
//! of a turn on in states beside these.
//!
//! A pivot that vanishes there does so by symmetry, for whatever values of the parameters: random ones serve
//! where none are given.

use core::f64::consts::FRAC_PI_2;

use crate::check::unused::Reads;
use crate::graph::{NodeId, Symbol};
use crate::mechanics::Model;

use super::manifold::{MOST_PROJECTED_ROWS, coordinate_scales, slopes, typical_length};
use super::newton::{ON_MANIFOLD, Projection};
use super::rows::ConstraintRows;
use super::sample::Sample;

/// Most coordinates of a row that are moved in turn to give it a direction: four, as Euler parameters have.
const MOST_COORDINATES_MOVED: usize = 4;
/// Value of a moved coordinate, as a part of its size. Of an angle it is a quarter of a turn; half a turn
/// would give no direction either.
const MOVED_BY: f64 = 0.5;

/// The states, the likeliest first; velocities and inputs are random.
pub(super) fn likely(model: &Model, rows: &ConstraintRows) -> Vec<Sample> {
    if rows.holonomic > MOST_PROJECTED_ROWS {
        return Vec::new();
    }
    let chosen: Vec<usize> = (0..rows.holonomic).collect();
    let parameters: Vec<u32> = (0..model.parameters.len() as u32).collect();
    let scale = coordinate_scales(model, typical_length(model, &parameters));
    let origin = Sample { time: 0.0, q: vec![0.0; scale.len()], ..Sample::anywhere(model) };
    let starts = with_directions(rows, &chosen, origin, &scale);
    let projection = Projection::new(rows, &chosen, scale);
    let onto = |mut state: Sample| {
        let residual = projection.descend(&mut state, &mut Vec::new())?;
        let is_there = residual.iter().all(|x| x.abs() <= ON_MANIFOLD);
        let all: Vec<usize> = (0..rows.len()).collect();
        let is_finite = || slopes(rows, &state, &all).iter().flatten().all(|x| x.is_finite());
        (is_there && is_finite()).then_some(state)
    };
    starts.into_iter().filter_map(onto).collect()
}

/// The state with one angle a quarter of a turn on, for each that rows of velocities read and no other.
pub(super) fn turned(model: &Model, rows: &ConstraintRows, straight: &Sample) -> Vec<Sample> {
    let reads = |rows: &[NodeId], j: usize| Reads::of(model, rows).symbol(Symbol::Coordinate(j as u32));
    let (positions, velocities) = rows.values.split_at(rows.holonomic);
    let is_free =
        |j: &usize| model.coordinates[*j].unit == "rad" && reads(velocities, *j) && !reads(positions, *j);
    let turned = |j: usize| {
        let mut state = straight.clone();
        state.q[j] += FRAC_PI_2;
        state
    };
    (0..straight.q.len()).filter(is_free).map(turned).collect()
}

/// The origin, or where rows have no direction there, states beside it: in the k-th each of these rows has
/// its k-th coordinate moved.
fn with_directions(rows: &ConstraintRows, chosen: &[usize], origin: Sample, scale: &[f64]) -> Vec<Sample> {
    let slopes = slopes(rows, &origin, chosen);
    let blind: Vec<usize> = chosen.iter().copied().filter(|r| slopes[*r].iter().all(|x| *x == 0.0)).collect();
    let longest = blind.iter().map(|r| rows.jacobian[*r].len()).max();
    let Some(longest) = longest else { return vec![origin] };
    let moved = |k: usize| {
        let mut state = origin.clone();
        for (j, _) in blind.iter().filter_map(|r| rows.jacobian[*r].get(k)) {
            state.q[*j] = MOVED_BY * scale[*j];
        }
        state
    };
    (0..longest.min(MOST_COORDINATES_MOVED)).map(moved).collect()
}
