//! The main contributors to something that an error names, without allocation.

use core::fmt;

use super::Quantity;
#[cfg(feature = "alloc")]
use super::UnitDimension;

/// Receives an index and its share.
type OnShare<'a> = &'a mut dyn FnMut(usize, f64);

/// The coordinates or constraint rows with the largest shares in something, in falling order. The first six
/// are kept, and all are counted.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct TopContributors {
    of: &'static [Quantity],
    kept: [u16; Self::KEPT],
    count: u16,
}

impl TopContributors {
    /// Number of contributors that are kept.
    pub const KEPT: usize = 6;
    /// Shares below this part of the largest are left out: they are rounding, or do not help the reader.
    const MIN_SHARE: f64 = 1e-3;

    /// Of quantities, given by index, those with the largest shares by absolute value.
    pub(crate) fn ranked(
        of: &'static [Quantity],
        shares: impl Iterator<Item = (usize, f64)> + Clone,
    ) -> Self {
        // Of an infinite share no part would be smaller than it is; NaN stays NaN.
        Self::rank(of, &|see| shares.clone().for_each(|(i, share)| see(i, share.abs().clamp(0.0, f64::MAX))))
    }

    /// [`TopContributors::ranked`] without generic parameters, so that it is compiled once.
    fn rank(of: &'static [Quantity], all: &dyn Fn(OnShare<'_>)) -> Self {
        let mut out = Self { of, kept: [0; Self::KEPT], count: 0 };
        let (mut largest, mut count) = (0.0_f64, 0_usize);
        all(&mut |_, share| largest = largest.max(share));
        let least = Self::MIN_SHARE * largest;
        all(&mut |_, share| count += usize::from(share > least));
        out.count = u16::try_from(count).unwrap_or(u16::MAX);
        // Selection by falling share, earlier ones first where equal: there are few.
        let mut last = (usize::MAX, f64::INFINITY);
        for slot in &mut out.kept {
            let mut next: Option<(usize, f64)> = None;
            all(&mut |i, share| {
                let after = share < last.1 || (share == last.1 && i > last.0);
                if share > least && after && next.is_none_or(|(_, largest)| share > largest) {
                    next = Some((i, share));
                }
            });
            let Some(next) = next else { break };
            *slot = u16::try_from(next.0).unwrap_or(u16::MAX);
            last = next;
        }
        out
    }

    /// The names that are kept.
    pub fn names(&self) -> impl ExactSizeIterator<Item = &'static str> + use<> {
        let Self { of, kept, count } = *self;
        kept.into_iter()
            .take(usize::from(count))
            .map(move |i| of.get(usize::from(i)).map_or("", |one| one.name))
    }

    /// What the largest contributor measures.
    #[cfg(feature = "alloc")]
    pub(crate) fn dimension(&self) -> UnitDimension {
        let largest = self.of.get(usize::from(self.kept[0])).filter(|_| self.count > 0);
        largest.map_or(UnitDimension::Other, |one| one.dimension)
    }

    /// Whether one of this name is kept.
    #[must_use]
    pub fn contains(&self, name: &str) -> bool {
        self.names().any(|kept| kept == name)
    }

    /// The text for rows that lose rank.
    pub(crate) fn rank_loss(&self) -> RankLoss<'_> {
        RankLoss(self)
    }

    /// How many take part.
    #[must_use]
    pub fn count(&self) -> usize {
        usize::from(self.count)
    }

    /// Whether none takes part.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

impl fmt::Display for TopContributors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, name) in self.names().enumerate() {
            let separator = if i == 0 { "" } else { ", " };
            write!(f, "{separator}`{name}`")?;
        }
        match self.count().saturating_sub(Self::KEPT) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

/// The text for rows that lose rank.
pub(crate) struct RankLoss<'a>(&'a TopContributors);

impl fmt::Display for RankLoss<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.count() {
            1 => write!(f, "constraint {} loses its gradient", self.0),
            _ => write!(f, "the constraints {} depend on each other", self.0),
        }
    }
}

impl fmt::Debug for TopContributors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

#[cfg(test)]
mod tests {
    use super::{Quantity, TopContributors};

    const fn named(name: &'static str) -> Quantity {
        Quantity::without_unit(name)
    }
    const OF: [Quantity; 8] =
        [named("a"), named("b"), named("c"), named("d"), named("e"), named("f"), named("g"), named("h")];

    #[test]
    fn the_largest_contributors_come_first() {
        let involved = TopContributors::ranked(&OF, [0.1, -2.0, 1e-9, 0.1].into_iter().enumerate());
        assert!(involved.names().eq(["b", "a", "d"]) && involved.count() == 3);
        assert_eq!(involved.to_string(), "`b`, `a`, `d`");
        let many = TopContributors::ranked(&OF, (0..8).map(|i| (i, 1.0)));
        assert_eq!(many.to_string(), "`a`, `b`, `c`, `d`, `e`, `f` and 2 more");
        assert!(TopContributors::ranked(&OF, [(0, 0.0)].into_iter()).is_empty());
        assert!(TopContributors::ranked(&OF, [(0, f64::NAN)].into_iter()).is_empty());
        let infinite = [f64::NAN, 1.0, f64::NEG_INFINITY, f64::INFINITY];
        assert_eq!(TopContributors::ranked(&OF, infinite.into_iter().enumerate()).to_string(), "`c`, `d`");
    }
}
