//! A few names in an error, without allocation.

use core::fmt;

/// The names of the coordinates or constraint rows that take part in something, the most involved first; the first six are kept.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct Involved {
    names: [&'static str; Self::KEPT],
    count: usize,
}

impl Involved {
    /// So many are kept.
    pub const KEPT: usize = 6;
    /// Shares below this part of the largest are left out: rounding noise, or of no help.
    const LEAST: f64 = 1e-3;

    /// Of those with the largest shares, by absolute value.
    pub(crate) fn ranked(shares: impl Iterator<Item = (&'static str, f64)> + Clone) -> Self {
        let mut out = Self::default();
        let largest = shares.clone().fold(0.0, |most: f64, (_, share)| most.max(share.abs()));
        let involved = || shares.clone().enumerate().filter(|(_, (_, share))| share.abs() > Self::LEAST * largest);
        out.count = involved().count();
        // Selection by falling share, earlier names first where equal: there are few.
        let mut last = (f64::INFINITY, 0);
        for slot in out.names.iter_mut().take(out.count) {
            let after =
                |&(i, (_, share)): &(usize, (&str, f64))| share.abs() < last.0 || (share.abs() == last.0 && i > last.1);
            let next = involved().filter(after).reduce(|a, b| if b.1.1.abs() > a.1.1.abs() { b } else { a });
            let Some((i, (name, share))) = next else { break };
            *slot = name;
            last = (share.abs(), i);
        }
        out
    }

    /// The names that are kept.
    #[must_use]
    pub fn as_slice(&self) -> &[&'static str] {
        &self.names[..self.count.min(Self::KEPT)]
    }

    /// How many take part.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether none takes part.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

impl fmt::Display for Involved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, name) in self.as_slice().iter().enumerate() {
            let separator = if i == 0 { "" } else { ", " };
            write!(f, "{separator}`{name}`")?;
        }
        match self.count.saturating_sub(Self::KEPT) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

impl fmt::Debug for Involved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

#[cfg(test)]
mod tests {
    use super::Involved;

    #[test]
    fn the_most_involved_come_first() {
        let shares = [("a", 0.1), ("b", -2.0), ("c", 1e-9), ("d", 0.1)];
        let names = Involved::ranked(shares.into_iter());
        assert_eq!((names.as_slice(), names.count()), (&["b", "a", "d"][..], 3));
        assert_eq!(names.to_string(), "`b`, `a`, `d`");
        let many = Involved::ranked(["a", "b", "c", "d", "e", "f", "g", "h"].into_iter().map(|name| (name, 1.0)));
        assert_eq!(many.to_string(), "`a`, `b`, `c`, `d`, `e`, `f` and 2 more");
        assert!(Involved::ranked([("a", 0.0)].into_iter()).is_empty());
        assert!(Involved::ranked([("a", f64::NAN)].into_iter()).is_empty());
    }
}
