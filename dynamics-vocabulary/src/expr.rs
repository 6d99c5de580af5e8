//! Time jets: the numbers with which the functions of a model compute when they run.
//!
//! An [`Expr`] is a number with its first and second time derivatives at one instant,
//!
//! ```text
//! x,   ẋ,   ẍ,
//! ```
//!
//! and every operation carries all three along by the rules of calculus (truncated Taylor arithmetic;
//! A. Griewank and A. Walther, *Evaluating Derivatives*, 2nd ed., SIAM 2008, chapter 13). Positions written
//! with coordinates therefore contain their velocities and accelerations, and [`Expr::dt`] merely shifts:
//! x.dt() is (ẋ, ẍ, unknown).
//!
//! **What is not known is NaN, never a wrong number.** The third derivative of a coordinate is not known, so
//! `q.x.dt().dt().dt()` has the value NaN; so has the rate of an input. Known derivatives stay known: those
//! of a constant are 0 however often it is differentiated, and those of time are 1, then 0; this holds for
//! every polynomial in time up to degree 2 that is built from such by sums, products and constant factors.

mod functions;
mod operators;

use core::fmt;

/// A value with its first and second time derivative at one instant.
///
/// Made by a model's coordinates ([`coordinate`](Self::coordinate), [`input`](Self::input),
/// [`time`](Self::time)) or from a constant (`Expr::from(2.0)`); combined with `+ - * /` and the methods of
/// `f64`, freely mixed with `f64`.
///
/// ```
/// # use dynamics_vocabulary as dynamics;
/// use dynamics::Expr;
///
/// // θ = 0.3 rad, θ̇ = 2 rad/s, θ̈ = −1 rad/s²
/// let theta = Expr::coordinate(0.3, 2.0, -1.0);
/// let height = 1.5 * (1.0 - theta.cos());
/// assert_eq!(height.dt().value(), 1.5 * 0.3_f64.sin() * 2.0);
/// ```
///
/// Comparisons look at values only: they choose the branch of an `if`, whose derivative is that of the branch
/// taken.
#[derive(Clone, Copy)]
pub struct Expr {
    value: f64,
    first: f64,
    second: f64,
    /// All derivatives from the third on: 0 where they are known to vanish identically, NaN otherwise.
    beyond: f64,
}

impl Expr {
    /// The constant 0; the start of sums.
    pub const ZERO: Self = Self::constant(0.0);
    /// The constant 1.
    pub const ONE: Self = Self::constant(1.0);
    /// Neither value nor derivatives are known.
    const UNKNOWN: Self = Self { value: f64::NAN, first: f64::NAN, second: f64::NAN, beyond: f64::NAN };

    /// A number that does not change with time: all its derivatives are 0.
    #[inline(always)]
    #[must_use]
    pub const fn constant(value: f64) -> Self {
        Self { value, first: 0.0, second: 0.0, beyond: 0.0 }
    }

    /// A generalized coordinate q with q̇ and q̈; NaN for a derivative that is not known.
    #[inline(always)]
    #[must_use]
    pub const fn coordinate(q: f64, rate: f64, acceleration: f64) -> Self {
        Self { value: q, first: rate, second: acceleration, beyond: f64::NAN }
    }

    /// A quantity of which only the present value is known, as a control input.
    #[inline(always)]
    #[must_use]
    pub const fn input(value: f64) -> Self {
        Self { value, first: f64::NAN, second: f64::NAN, beyond: f64::NAN }
    }

    /// Time itself: its rate is 1.
    #[inline(always)]
    #[must_use]
    pub const fn time(t: f64) -> Self {
        Self { value: t, first: 1.0, second: 0.0, beyond: 0.0 }
    }

    /// The value x.
    #[inline(always)]
    #[must_use]
    pub const fn value(self) -> f64 {
        self.value
    }

    /// The first time derivative ẋ, per second; NaN if it is not known.
    #[inline(always)]
    #[must_use]
    pub const fn rate(self) -> f64 {
        self.first
    }

    /// The second time derivative ẍ, per second squared; NaN if it is not known.
    #[inline(always)]
    #[must_use]
    pub const fn acceleration(self) -> f64 {
        self.second
    }

    /// The total time derivative dx/dt.
    ///
    /// The derivatives shift by one place. The new second derivative is NaN, unless it is known to be 0.
    #[inline(always)]
    #[must_use]
    pub const fn dt(self) -> Self {
        Self { value: self.first, first: self.second, second: self.beyond, beyond: self.beyond }
    }

    /// Whether this is known not to change with time.
    #[inline(always)]
    #[must_use]
    pub const fn is_constant(self) -> bool {
        self.first == 0.0 && self.second == 0.0 && self.beyond == 0.0
    }

    /// f(x) from f, f′ and f″ at the value of x: (f(x))˙ = f′ẋ and (f(x))¨ = f′ẍ + f″ẋ².
    ///
    /// A constant stays one even where f′ is infinite, as that of √x at 0.
    #[inline(always)]
    pub(crate) fn chain(self, f: f64, f1: f64, f2: f64) -> Self {
        if self.is_constant() {
            return Self::constant(f);
        }
        Self {
            value: f,
            first: f1 * self.first,
            second: f1 * self.second + f2 * self.first * self.first,
            beyond: f64::NAN,
        }
    }
}

impl Default for Expr {
    fn default() -> Self {
        Self::ZERO
    }
}

impl From<f64> for Expr {
    #[inline(always)]
    fn from(value: f64) -> Self {
        Self::constant(value)
    }
}

impl From<&Expr> for Expr {
    #[inline(always)]
    fn from(x: &Expr) -> Self {
        *x
    }
}

/// The value alone, with the format options of `f64`.
impl fmt::Display for Expr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.value, f)
    }
}

impl fmt::Debug for Expr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Expr")
            .field("value", &self.value)
            .field("rate", &self.first)
            .field("acceleration", &self.second)
            .finish()
    }
}
