//! Smooth functions of one variable as parameters of a model: tracks, cam profiles, characteristic curves.

#[cfg(feature = "alloc")]
use alloc::borrow::ToOwned as _;
#[cfg(feature = "alloc")]
use alloc::format;
#[cfg(feature = "alloc")]
use alloc::string::String;

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

/// Largest difference of a function's pieces from its derivatives, of the size of their terms.
#[cfg(feature = "alloc")]
const SAME_PIECE: f64 = 1e-9;
/// Where in a piece both are compared: a part of its length that is no place of symmetry.
#[cfg(feature = "alloc")]
const COMPARED_PART: f64 = 0.4;

#[cfg(feature = "alloc")]
impl Pieces {
    /// What is wrong with them as the pieces of a function, in words.
    #[doc(hidden)]
    #[must_use]
    pub fn fault(&self, function: &dyn SmoothFunction) -> Option<String> {
        let Self { knots, coefficients, .. } = self;
        let (ends, count) = (knots.len(), coefficients.len());
        if count == 0 || ends != count + 1 {
            return Some(format!("are {count} between {ends} knots; there is one between each two knots"));
        }
        if !knots.iter().chain(coefficients.as_flattened()).all(|x| x.is_finite()) {
            return Some("have a knot or a coefficient that is not finite".to_owned());
        }
        if let Some(pair) = knots.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Some(format!("have knots that do not increase: {} is followed by {}", pair[0], pair[1]));
        }
        knots.windows(2).zip(coefficients).find_map(|(ends, piece)| {
            let d = COMPARED_PART * (ends[1] - ends[0]);
            let [a, b, c, e] = *piece;
            let terms = [
                [a, b * d, c * d * d, e * d * d * d],
                [b, 2.0 * c * d, 3.0 * e * d * d, 0.0],
                [2.0 * c, 6.0 * e * d, 0.0, 0.0],
                [6.0 * e, 0.0, 0.0, 0.0],
            ];
            let known = function.derivatives(ends[0] + d);
            let order = (0..4).find(|&order| {
                let (value, size) =
                    (terms[order].iter().sum::<f64>(), terms[order].map(f64::abs).iter().sum::<f64>());
                // Not a number is no agreement.
                let agree = (value - known[order]).abs() <= SAME_PIECE * size.max(known[order].abs());
                !agree
            })?;
            let (x, value) = (ends[0] + d, terms[order].iter().sum::<f64>());
            let derivative = ["value", "first derivative", "second derivative", "third derivative"][order];
            let known = known[order];
            Some(format!(
                "do not agree with `derivatives`: at {x} their {derivative} is {value}, not {known}"
            ))
        })
    }
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

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use alloc::vec;
    use alloc::vec::Vec;

    use super::{Outside, Pieces, SmoothFunction};

    /// x³ with the pieces that it is given.
    struct Cube(Vec<f64>, Vec<[f64; 4]>);

    impl SmoothFunction for Cube {
        fn derivatives(&self, x: f64) -> [f64; 4] {
            [x * x * x, 3.0 * x * x, 6.0 * x, 6.0]
        }
        fn pieces(&self) -> Option<Pieces> {
            let Self(knots, coefficients) = self;
            let (knots, coefficients) = (knots.clone(), coefficients.clone());
            Some(Pieces { knots, coefficients, outside: Outside::Unknown })
        }
    }

    #[test]
    fn pieces_are_those_of_their_function() {
        let found = |knots: &[f64], coefficients: &[[f64; 4]]| {
            let cube = Cube(knots.to_vec(), coefficients.to_vec());
            cube.pieces().unwrap().fault(&cube)
        };
        let (first, second) = ([0.0, 0.0, 0.0, 1.0], [1.0, 3.0, 3.0, 1.0]);
        assert_eq!(found(&[0.0, 1.0, 2.0], &[first, second]), None);
        for (knots, coefficients, text) in [
            (vec![], vec![], "are 0 between 0 knots"),
            (vec![0.0, 1.0], vec![first, second], "are 2 between 2 knots"),
            (vec![0.0, f64::NAN], vec![first], "not finite"),
            (vec![1.0, 1.0], vec![second], "do not increase: 1 is followed by 1"),
            (vec![0.0, 1.0, 2.0], vec![first, first], "at 1.4 their value is"),
        ] {
            let fault = found(&knots, &coefficients).unwrap();
            assert!(fault.contains(text), "{fault}");
        }
    }
}
