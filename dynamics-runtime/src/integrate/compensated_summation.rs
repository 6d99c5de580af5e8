//! What rounding takes of a step when it is added to the state, carried to the next step.
//!
//! Each addition rounds q and u to half a unit in the last place of *them*, though the step is known to one
//! of *itself*: in short steps that is most of what is lost at all. Kahan's sum keeps the rest beside the
//! state. Then errors are those of the steps alone, and where these have no bias energies walk at random, by
//! the root of the number of steps (Brouwer's law).
//!
//! Source: Kahan, Comm. ACM 8 (1965) 40; Møller, BIT 5 (1965) 37; Knuth, *The Art of Computer Programming* 2,
//! §4.2.2; Hairer, Lubich, Wanner, *Geometric Numerical Integration*, 2nd ed., §VIII.5; Hairer, McLachlan,
//! Razakarivony, BIT 48 (2008) 231.

use crate::integrate::Phase;
use crate::integrate::phase::zip;
use crate::model::Vector;

/// y + change, and what that sum has lost by rounding (Knuth).
#[inline(always)]
pub(in crate::integrate) fn sum<V: Vector>(y: &Phase<V>, change: &Phase<V>) -> (Phase<V>, Phase<V>) {
    let end = zip(y, change, |y, x| y + x);
    let added = zip(&end, y, |sum, y| sum - y);
    let of_start = zip(y, &zip(&end, &added, |sum, x| sum - x), |y, kept| y - kept);
    (end, zip(&zip(change, &added, |x, kept| x - kept), &of_start, |x, y| x + y))
}

/// Remembers what states have lost: the start of the last step, which may be made again, and its end.
#[derive(Clone, Copy, Debug)]
pub(in crate::integrate) struct Carry<V>([(Phase<V>, Phase<V>); 2]);

impl<V: Vector> Carry<V> {
    /// Nothing is lost yet.
    pub(in crate::integrate) fn new() -> Self {
        Self([(Phase::zeros(), Phase::zeros()); 2])
    }

    /// The end of a step from y.
    #[inline(always)]
    pub(in crate::integrate) fn add(&mut self, y: &Phase<V>, change: &Phase<V>) -> Phase<V> {
        let [begin, end] = &self.0;
        let lost =
            [end, begin].into_iter().find(|(of, _)| of == y).map_or_else(Phase::zeros, |(_, lost)| *lost);
        let (next, left) = sum(y, &zip(change, &lost, |x, lost| x + lost));
        self.0 = [(*y, lost), (next, left)];
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    type V = SVector<f64, 1>;

    /// Steps of 0.1, ten million of them, of which `f64` would lose 1.6e-4; a step made again starts with
    /// what the first one started with, and another state with nothing.
    #[test]
    fn many_small_steps_lose_nothing() {
        let change = Phase { q: V::new(0.1), u: V::new(-0.1) };
        let (mut carry, mut y, mut plain) = (Carry::new(), Phase::<V>::zeros(), 0.0);
        for k in 0..100_000 {
            if k % 7 == 0 {
                carry.add(&y, &zip(&change, &change, |x, _| 3.3 * x));
            }
            y = carry.add(&y, &change);
            plain += 0.1;
        }
        assert!((y.q[0] - 1e4).abs() < 2e-12 && (y.u[0] + 1e4).abs() < 2e-12, "{y:?}");
        assert!((plain - 1e4f64).abs() > 1e-9);
        let other = Phase { q: V::new(1.0), u: V::new(1.0) };
        assert_eq!(carry.add(&other, &change), Phase { q: V::new(1.1), u: V::new(0.9) });
    }
}
