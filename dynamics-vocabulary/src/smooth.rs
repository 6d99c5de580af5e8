//! Smooth functions of one variable as parameters of a model: tracks, cam profiles, characteristic curves.

use crate::expr::Expr;

/// A function f(x) with its first three derivatives, the kind of parameter that a model calls as
/// `self.track.at(q.s)`.
///
/// Three derivatives are what the equations need: positions contain f, velocities f′, the generalized forces
/// f″, and their Jacobian f‴. If f or a derivative does not exist, return NaN: a run stops there with an
/// error instead of using a wrong number. If a function consists of pieces, like a spline, implement
/// [`piece`](Self::piece). Methods have their order within a piece only, so steps end between two pieces.
///
/// ```
/// # use dynamics_vocabulary as dynamics;
/// use dynamics::{Expr, SmoothFunction};
///
/// /// A track of sinusoidal bumps.
/// struct Bumps {
///     height: f64,
///     wave_number: f64,
/// }
///
/// impl SmoothFunction for Bumps {
///     fn derivatives(&self, x: f64) -> [f64; 4] {
///         let k = self.wave_number;
///         let (sin, cos) = (k * x).sin_cos();
///         [sin, k * cos, -k * k * sin, -k * k * k * cos].map(|d| self.height * d)
///     }
/// }
///
/// let track = Bumps { height: 0.1, wave_number: 2.0 };
/// let height = track.at(Expr::coordinate(0.0, 5.0, 0.0));
/// assert_eq!(height.rate(), 0.1 * 2.0 * 5.0);
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a smooth function; implement `SmoothFunction` for it or take a `CubicSpline`",
    label = "a parameter that is no number, array, vector or matrix has to be a smooth function"
)]
pub trait SmoothFunction {
    /// [f(x), f′(x), f″(x), f‴(x)].
    ///
    /// They must belong to one function: check each against a difference quotient of the one before.
    fn derivatives(&self, x: f64) -> [f64; 4];

    /// The interval around x in which all derivatives are continuous; −∞ to ∞, the default, where they are so
    /// everywhere.
    fn piece(&self, _x: f64) -> [f64; 2] {
        [f64::NEG_INFINITY, f64::INFINITY]
    }

    /// The polynomials that the function is made of, where it is: what other languages compute it from.
    #[cfg(feature = "alloc")]
    fn pieces(&self) -> Option<Pieces> {
        None
    }

    /// f at something that moves.
    fn at(&self, x: impl Into<Expr>) -> Expr
    where
        Self: Sized,
    {
        let x = x.into();
        let [f, f1, f2, _] = self.derivatives(x.value());
        x.chain(f, f1, f2)
    }
}

/// A function made of cubic polynomials, one between each two knots.
#[cfg(feature = "alloc")]
#[derive(Clone, Debug, PartialEq)]
pub struct Pieces {
    /// The knots, increasing.
    pub knots: alloc::vec::Vec<f64>,
    /// For each piece f, f′, f″/2, f‴/6 at its left knot: one less than knots.
    pub coefficients: alloc::vec::Vec<[f64; 4]>,
    /// What the function is beyond its first and last knot.
    pub outside: Outside,
}

/// What a function made of pieces is beyond its first and last knot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// Not known: NaN.
    Unknown,
    /// Straight lines.
    Linear,
    /// It repeats itself.
    Periodic,
}

macro_rules! through {
    ($($(#[$condition:meta])* $Pointer:ty),* $(,)?) => {$(
        $(#[$condition])*
        impl<F: SmoothFunction + ?Sized> SmoothFunction for $Pointer {
            #[inline]
            fn derivatives(&self, x: f64) -> [f64; 4] {
                (**self).derivatives(x)
            }
            #[inline]
            fn piece(&self, x: f64) -> [f64; 2] {
                (**self).piece(x)
            }
            #[cfg(feature = "alloc")]
            fn pieces(&self) -> Option<Pieces> {
                (**self).pieces()
            }
        }
    )*};
}

through! {
    &F,
    #[cfg(feature = "alloc")] alloc::boxed::Box<F>,
    #[cfg(feature = "alloc")] alloc::rc::Rc<F>,
    #[cfg(feature = "alloc")] alloc::sync::Arc<F>,
}
