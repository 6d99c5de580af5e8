//! Rust's types of integers, and what is known of the type of one.

/// One of Rust's types of integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct IntegerType {
    pub(super) name: &'static str,
    pub(super) bits: u32,
    pub(super) signed: bool,
}

pub(super) const fn ty(name: &'static str, bits: u32, signed: bool) -> IntegerType {
    IntegerType { name, bits, signed }
}

/// What indexes and counts. Machines of 32 bits differ only in what no index reaches, and in casts, which
/// look at that.
pub(super) const USIZE: IntegerType = ty("usize", 64, false);
pub(super) const I32: IntegerType = ty("i32", 32, true);
pub(super) const TYPES: [IntegerType; 12] = [
    ty("i8", 8, true),
    ty("i16", 16, true),
    I32,
    ty("i64", 64, true),
    ty("i128", 128, true),
    ty("isize", 64, true),
    ty("u8", 8, false),
    ty("u16", 16, false),
    ty("u32", 32, false),
    ty("u64", 64, false),
    ty("u128", 128, false),
    USIZE,
];

impl IntegerType {
    /// The type of this name.
    pub(super) fn named(name: &str) -> Option<Self> {
        TYPES.into_iter().find(|known| known.name == name)
    }
    pub(super) fn of_machine(self) -> bool {
        matches!(self.name, "usize" | "isize")
    }
    pub(super) fn least(self) -> i128 {
        if self.signed { i128::MIN >> (128 - self.bits) } else { 0 }
    }
    /// The largest value; of `u128` what this macro can count to.
    pub(super) fn largest(self) -> i128 {
        let bits = if self.signed { self.bits - 1 } else { self.bits };
        if bits >= 127 { i128::MAX } else { (1 << bits) - 1 }
    }
    pub(super) fn holds(self, value: i128) -> bool {
        (self.least()..=self.largest()).contains(&value)
    }
    /// `value as Self`.
    pub(super) fn wrapped(self, value: i128) -> i128 {
        let unused = 128 - self.bits;
        let raised = value.wrapping_shl(unused);
        if self.signed {
            raised >> unused
        } else {
            // The sign goes where it came from: the top bits of a narrower type are zero.
            ((raised as u128) >> unused) as i128
        }
    }
}

/// The type of an integer: known, or that of all that it meets.
#[derive(Clone, Copy, Debug)]
pub(super) enum TypeOf {
    Known(IntegerType),
    Inferred(usize),
}

impl TypeOf {
    pub(super) const USIZE: Self = Self::Known(USIZE);
    pub(super) const U32: Self = Self::Known(ty("u32", 32, false));
    pub(super) const I32: Self = Self::Known(I32);
}
