//! Methods on slices, one per file. Steps allocate nothing.

pub(crate) mod embedded;
pub(crate) mod explicit;
pub(crate) mod hermite;
pub(crate) mod implicit;
pub(crate) mod splitting;

use crate::equations::Equations;
use crate::failure::FamilyErrorKind;
use crate::model::FamilyModel;

/// Time, coordinates and velocities.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    pub(crate) t: f64,
    pub(crate) q: Vec<f64>,
    pub(crate) u: Vec<f64>,
}

impl Point {
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.t = other.t;
        self.q.copy_from_slice(&other.q);
        self.u.copy_from_slice(&other.u);
    }

    /// The first unknown whose coordinate or velocity is infinite or not a number.
    pub(crate) fn not_finite(&self) -> Option<usize> {
        // 0 · x is not zero where x is not finite; a sum of products stays in vector registers.
        let all_finite = |values: &[f64]| {
            values.chunks(crate::generated::BLOCK).all(|block| {
                let mut lanes = [0.0; 8];
                let mut whole = block.chunks_exact(8);
                for values in &mut whole {
                    lanes.iter_mut().zip(values).for_each(|(lane, value)| *lane += 0.0 * value);
                }
                let rest: f64 = whole.remainder().iter().map(|value| 0.0 * value).sum();
                lanes.iter().sum::<f64>() + rest == 0.0
            })
        };
        if all_finite(&self.q) && all_finite(&self.u) {
            return None;
        }
        // Accelerations reach velocities first.
        let bad = |values: &[f64]| values.iter().position(|value| !value.is_finite());
        bad(&self.u).or_else(|| bad(&self.q))
    }
}

/// A method whose steps have a given size.
pub(crate) trait FixedStep<M: FamilyModel> {
    /// Prepares a first step of size h from a state.
    fn begin(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &mut Point,
        h: f64,
    ) -> Result<(), FamilyErrorKind>;
    /// A step of size h, before one of size `next` (0 where it is the last). Time is up to the caller.
    fn advance(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &mut Point,
        h: f64,
        next: f64,
    ) -> Result<(), FamilyErrorKind>;
    /// The state at y's time, where methods keep something else between steps; a step of size `next` would
    /// follow.
    fn state(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &Point,
        next: f64,
        into: &mut Point,
    ) -> Result<(), FamilyErrorKind>;
    /// Whether a step that fails leaves y as it was.
    fn keeps_state(&self) -> bool {
        true
    }
    /// Forgets what it knows of the last step: the run goes back to an earlier state.
    fn restart(&mut self) {}
    /// Bytes on the heap.
    fn bytes(&self) -> usize;
}
