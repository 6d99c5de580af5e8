//! Sums of two `f64`, of 31 digits: what a state says of an invariant, without the rounding of evaluating it
//! (Dekker, Numer. Math. 18 (1971) 224; Knuth, TAOCP 2, §4.2.2).

/// high + low, |low| at most half a unit in the last place of high.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Double(pub(crate) f64, pub(crate) f64);

impl Double {
    fn two_sum(a: f64, b: f64) -> Self {
        let sum = a + b;
        let of_b = sum - a;
        Self(sum, (a - (sum - of_b)) + (b - of_b))
    }

    pub(crate) fn product(a: f64, b: f64) -> Self {
        let product = a * b;
        Self(product, a.mul_add(b, -product))
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        let (high, low) = (Self::two_sum(self.0, other.0), Self::two_sum(self.1, other.1));
        let sum = Self::two_sum(high.0, high.1 + low.0);
        Self::two_sum(sum.0, sum.1 + low.1)
    }

    pub(crate) fn minus(self, other: Self) -> Self {
        self.plus(Self(-other.0, -other.1))
    }

    pub(crate) fn times(self, other: Self) -> Self {
        let Self(high, low) = Self::product(self.0, other.0);
        Self::two_sum(high, low + self.0 * other.1 + self.1 * other.0)
    }

    /// By Newton's method from the 16 digits of `f64`, which doubles them.
    pub(crate) fn reciprocal(self) -> Self {
        let near = Self(1.0 / self.0, 0.0);
        near.plus(near.times(Self(1.0, 0.0).minus(self.times(near))))
    }

    pub(crate) fn root(self) -> Self {
        let near = Self(self.0.sqrt(), 0.0);
        near.plus(self.minus(near.times(near)).times(Self(0.5 / near.0, 0.0)))
    }
}

#[test]
fn pairs_have_thirty_digits() {
    let within = |x: Double, exact: Double| assert!(x.minus(exact).0.abs() < 1e-30, "{x:?}");
    let three = Double(3.0, 0.0);
    // 1/3 to 33 digits, √3 by its square.
    within(three.reciprocal(), Double(0.333_333_333_333_333_3, 1.850_371_707_708_594e-17));
    let root = three.root();
    within(root.times(root), three);
    within(root.times(three.reciprocal()).times(root), Double(1.0, 0.0));
    within(Double::product(0.1, 0.1).minus(Double(0.1, 0.0).times(Double(0.1, 0.0))), Double(0.0, 0.0));
}
