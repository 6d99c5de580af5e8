//! Which switched constraints hold.

use core::fmt::{self, Debug};

/// The active set of the switched constraints of a model, by their order among the switched ones: whether
/// each holds, and, where it does not, to which side it was left. All hold by default. At most 32.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct ActiveSet {
    /// Two bits each: released, left to the negative side.
    bits: u64,
}

impl ActiveSet {
    /// Most switched constraints of a model.
    pub const MAX: usize = 32;
    /// Every constraint holds.
    pub const ALL_HOLD: Self = Self { bits: 0 };

    /// Whether the switched constraint with this index holds.
    #[inline(always)]
    #[must_use]
    pub const fn holds(self, index: usize) -> bool {
        self.bits >> (2 * index) & 1 == 0
    }

    /// Whether every constraint holds.
    #[inline(always)]
    #[must_use]
    pub const fn all_hold(self) -> bool {
        self.bits == 0
    }

    /// 0 while it holds, else ±1: the side to which it was left.
    #[inline(always)]
    #[must_use]
    pub const fn side(self, index: usize) -> f64 {
        match self.bits >> (2 * index) & 3 {
            1 => 1.0,
            3 => -1.0,
            _ => 0.0,
        }
    }

    /// Lets it hold.
    pub const fn engage(&mut self, index: usize) {
        self.bits &= !(3 << (2 * index));
    }

    /// Releases it to a side: that of growing Φ (or A q̇ + b) where `side` is not negative.
    pub const fn release(&mut self, index: usize, side: f64) {
        self.engage(index);
        self.bits |= (if side < 0.0 { 3 } else { 1 }) << (2 * index);
    }
}

impl Debug for ActiveSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.all_hold() {
            return f.write_str("all hold");
        }
        let released = (0..Self::MAX).filter(|i| !self.holds(*i)).map(|i| (i, self.side(i)));
        f.write_str("released ")?;
        f.debug_map().entries(released).finish()
    }
}
