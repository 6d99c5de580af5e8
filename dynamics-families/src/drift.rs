//! A drift of the coordinates and the kick behind it, in one pass over memory.
//!
//! A step of leapfrog reads and writes q and u, and reads the inverse masses: 40 bytes for each unknown. Two
//! passes move 56. The kick of some nodes follows the drift of these and of those that their forces reach,
//! while all of them are in the cache. Every number is made of the same operations in the same order as in
//! two passes, so that the bits are the same.

use crate::generated::BLOCK;
use crate::loops::{Pass, in_parts, in_wide_vectors};
use crate::model::FamilyModel;

/// Nodes of one part: all that it reads and writes stays in the second-level cache.
const PART: usize = 16 * BLOCK;
/// How far behind the drift the kick stays: forces reach no further.
const REACH: usize = 32;

struct Drift<'a> {
    q: &'a mut [f64],
    u: &'a [f64],
    h: f64,
}

impl Pass for Drift<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { q, u, h } = self;
        q.iter_mut().zip(u).for_each(|(q, u)| *q += h * u);
    }
}

/// q += h u, by several threads.
pub(crate) fn drift(threads: usize, q: &mut [f64], u: &[f64], h: f64) {
    in_parts(threads, [0, q.len() as isize], [q], &|[begin, end], [q]| {
        in_wide_vectors(Drift { q, u: &u[begin as usize..end as usize], h });
    });
}

/// q += `drift` u, then u += `kick` Q `scale` at the new q. For models whose forces are
/// [local](FamilyModel::LOCAL) and contain no velocities.
#[derive(Clone, Copy, Debug)]
pub struct DriftAndKick<'a> {
    /// The time at which Q is evaluated.
    pub t: f64,
    /// The time by which coordinates move.
    pub drift: f64,
    /// The time by which velocities move.
    pub kick: f64,
    /// The inputs.
    pub inputs: &'a [f64],
    /// The inverse of each mass.
    pub scale: &'a [f64],
}

impl DriftAndKick<'_> {
    /// Moves q and u. `ends` are those of the fields. Several threads make two passes.
    pub fn apply<M: FamilyModel>(
        &self,
        model: &M,
        threads: usize,
        ends: &[usize],
        q: &mut [f64],
        u: &mut [f64],
    ) {
        let Self { t, inputs, scale, .. } = *self;
        if threads > 1 || q.len() <= PART {
            drift(threads, q, u, self.drift);
            return model.kick_by(threads, [0, usize::MAX], t, [q, inputs, scale], self.kick, u);
        }
        let begin = |field: usize| if field == 0 { 0 } else { ends[field - 1] };
        let longest = (0..ends.len()).map(|field| ends[field] - begin(field)).max().unwrap_or(0);
        let (mut from, mut drifted) = (0, 0);
        while from < longest {
            let to = from + PART;
            // Ordinary coordinates, which all nodes may read, drift with the first nodes.
            for (field, &end) in ends.iter().enumerate() {
                let place = |node: usize| end.min(begin(field) + node);
                let range = place(drifted)..place(to + REACH);
                in_wide_vectors(Drift { q: &mut q[range.clone()], u: &u[range], h: self.drift });
            }
            drifted = to + REACH;
            let last = if to < longest { to } else { usize::MAX };
            model.kick_by(1, [from, last], t, [q, inputs, scale], self.kick, u);
            from = to;
        }
    }
}
