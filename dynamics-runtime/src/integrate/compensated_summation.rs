//! Compensated summation: the rounding of y + Δy is kept and added to the next step.
//!
//! Each addition rounds q and u to half a unit in the last place of *themselves*, although Δy is known to a
//! unit of *its own* last place. In short steps this is most of all rounding. Kahan's summation keeps the
//! rest beside the state. The errors are then those of the steps alone, and where these have no bias the
//! energy error grows with the root of the number of steps (Brouwer's law).
//!
//! Source: Kahan, Comm. ACM 8 (1965) 40; Møller, BIT 5 (1965) 37; Knuth, *The Art of Computer Programming* 2,
//! §4.2.2; Hairer, Lubich, Wanner, *Geometric Numerical Integration*, 2nd ed., §VIII.5; Hairer, McLachlan,
//! Razakarivony, BIT 48 (2008) 231.

use crate::integrate::Phase;
use crate::integrate::phase::zip;
use crate::model::Vector;

/// y + change and the rounding error of that sum: Knuth's TwoSum.
#[inline(always)]
pub(super) fn two_sum<V: Vector>(y: &Phase<V>, change: &Phase<V>) -> (Phase<V>, Phase<V>) {
    let end = zip(y, change, |y, x| y + x);
    let added = zip(&end, y, |sum, y| sum - y);
    let of_start = zip(y, &zip(&end, &added, |sum, x| sum - x), |y, kept| y - kept);
    (end, zip(&zip(change, &added, |x, kept| x - kept), &of_start, |x, y| x + y))
}

/// The rounding errors of two states: the start of the last step, which may be made again, and its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct CompensatedSum<V>([(Phase<V>, Phase<V>); 2]);

impl<V: Vector> CompensatedSum<V> {
    /// Without rounding errors so far.
    pub(super) fn new() -> Self {
        Self([(Phase::zeros(), Phase::zeros()); 2])
    }

    /// The end of a step from y. A state that is neither of the two starts without a rounding error.
    #[inline(always)]
    pub(super) fn add(&mut self, y: &Phase<V>, change: &Phase<V>) -> Phase<V> {
        let [begin, end] = &self.0;
        let lost =
            [end, begin].into_iter().find(|(of, _)| of == y).map_or_else(Phase::zeros, |(_, lost)| *lost);
        let (next, left) = two_sum(y, &zip(change, &lost, |x, lost| x + lost));
        self.0 = [(*y, lost), (next, left)];
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    type V = SVector<f64, 1>;

    /// A hundred thousand steps of 0.1. A step that is made again starts with the rounding error of the first
    /// attempt, and another state with none.
    #[test]
    fn many_small_steps_lose_nothing() {
        let change = Phase { q: V::new(0.1), u: V::new(-0.1) };
        let (mut sum, mut y, mut plain) = (CompensatedSum::new(), Phase::<V>::zeros(), 0.0);
        for k in 0..100_000 {
            if k % 7 == 0 {
                sum.add(&y, &zip(&change, &change, |x, _| 3.3 * x));
            }
            y = sum.add(&y, &change);
            plain += 0.1;
        }
        assert!((y.q[0] - 1e4).abs() < 2e-12 && (y.u[0] + 1e4).abs() < 2e-12, "{y:?}");
        assert!((plain - 1e4f64).abs() > 1e-9);
        let other = Phase { q: V::new(1.0), u: V::new(1.0) };
        assert_eq!(sum.add(&other, &change), Phase { q: V::new(1.1), u: V::new(0.9) });
    }
}
