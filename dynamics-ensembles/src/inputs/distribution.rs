//! Distributions of one input, by the inverse of their distribution function: evenly distributed numbers
//! between 0 and 1 become values.

use std::fmt;
use std::sync::Arc;

use dynamics_view::text::exact;

use super::{InputError, digest};

/// The distribution of one input.
#[derive(Clone)]
pub(super) enum Distribution {
    Uniform { low: f64, high: f64 },
    LogUniform { low: f64, high: f64 },
    Normal { mean: f64, deviation: f64 },
    Quantiles(Arc<dyn Fn(f64) -> f64 + Send + Sync>),
}

impl fmt::Debug for Distribution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.in_words())
    }
}

impl Distribution {
    /// The value below which it lies with probability p.
    pub(super) fn quantile(&self, p: f64) -> f64 {
        match self {
            Self::Uniform { low, high } => low + (high - low) * p,
            Self::LogUniform { low, high } => low * libm::exp(libm::log(high / low) * p),
            Self::Normal { mean, deviation } => mean + deviation * standard_normal(p),
            Self::Quantiles(quantile) => quantile(p),
        }
    }

    /// What identifies it.
    pub(super) fn in_words(&self) -> String {
        match self {
            Self::Uniform { low, high } => format!("uniform from {} to {}", exact(*low), exact(*high)),
            Self::LogUniform { low, high } => {
                format!("uniform in its logarithm from {} to {}", exact(*low), exact(*high))
            }
            Self::Normal { mean, deviation } => {
                format!("normal, mean {}, standard deviation {}", exact(*mean), exact(*deviation))
            }
            Self::Quantiles(quantile) => {
                let samples = (0..64).map(|k| quantile((f64::from(k) + 0.5) / 64.0));
                format!("by its quantiles, digest {}", digest(samples))
            }
        }
    }

    pub(super) fn check(&self, name: &str) -> Result<(), InputError> {
        let name = || name.to_owned();
        match *self {
            Self::Uniform { low, high } | Self::LogUniform { low, high }
                if !(low < high && (high - low).is_finite()) =>
            {
                Err(InputError::Interval { name: name(), low, high })
            }
            Self::LogUniform { low, .. } if low <= 0.0 => Err(InputError::Logarithm { name: name(), low }),
            Self::Normal { deviation, .. } if !(deviation > 0.0 && deviation.is_finite()) => {
                Err(InputError::Deviation { name: name(), deviation })
            }
            Self::Normal { mean, .. } if !mean.is_finite() => {
                Err(InputError::NotFinite { name: name(), value: mean })
            }
            _ => Ok(()),
        }
    }
}

/// Coefficients of the algorithm AS 241, PPND16: numerators and denominators for the middle, for the sides
/// and for the far sides, by growing powers.
#[allow(clippy::excessive_precision, reason = "as they are published")]
const MIDDLE: [[f64; 8]; 2] = [
    [
        3.3871328727963666080e0,
        1.3314166789178437745e2,
        1.9715909503065514427e3,
        1.3731693765509461125e4,
        4.5921953931549871457e4,
        6.7265770927008700853e4,
        3.3430575583588128105e4,
        2.5090809287301226727e3,
    ],
    [
        1.0,
        4.2313330701600911252e1,
        6.8718700749205790830e2,
        5.3941960214247511077e3,
        2.1213794301586595867e4,
        3.9307895800092710610e4,
        2.8729085735721942674e4,
        5.2264952788528545610e3,
    ],
];
#[allow(clippy::excessive_precision, reason = "as they are published")]
const SIDES: [[f64; 8]; 2] = [
    [
        1.42343711074968357734e0,
        4.63033784615654529590e0,
        5.76949722146069140550e0,
        3.64784832476320460504e0,
        1.27045825245236838258e0,
        2.41780725177450611770e-1,
        2.27238449892691845833e-2,
        7.74545014278341407640e-4,
    ],
    [
        1.0,
        2.05319162663775882187e0,
        1.67638483018380384940e0,
        6.89767334985100004550e-1,
        1.48103976427480074590e-1,
        1.51986665636164571966e-2,
        5.47593808499534494600e-4,
        1.05075007164441684324e-9,
    ],
];
#[allow(clippy::excessive_precision, reason = "as they are published")]
const FAR_SIDES: [[f64; 8]; 2] = [
    [
        6.65790464350110377720e0,
        5.46378491116411436990e0,
        1.78482653991729133580e0,
        2.96560571828504891230e-1,
        2.65321895265761230930e-2,
        1.24266094738807843860e-3,
        2.71155556874348757815e-5,
        2.01033439929228813265e-7,
    ],
    [
        1.0,
        5.99832206555887937690e-1,
        1.36929880922735805310e-1,
        1.48753612908506148525e-2,
        7.86869131145613259100e-4,
        1.84631831751005468180e-5,
        1.42151175831644588870e-7,
        2.04426310338993978564e-15,
    ],
];

/// The value below which a standard normal number lies with probability p, to about 1e-16 (M. J. Wichura,
/// *Algorithm AS 241*, Applied Statistics 37, 1988). By `libm`, so that its bits are the same on every
/// machine.
pub(crate) fn standard_normal(p: f64) -> f64 {
    let ratio = |[above, below]: [[f64; 8]; 2], x: f64| {
        let sum = |terms: [f64; 8]| terms.iter().rev().fold(0.0, |sum, term| sum * x + term);
        sum(above) / sum(below)
    };
    let from_half = p - 0.5;
    if from_half.abs() <= 0.425 {
        return from_half * ratio(MIDDLE, 0.180625 - from_half * from_half);
    }
    let tail = if from_half < 0.0 { p } else { 1.0 - p };
    let r = libm::sqrt(-libm::log(tail));
    let size = if r <= 5.0 { ratio(SIDES, r - 1.6) } else { ratio(FAR_SIDES, r - 5.0) };
    size.copysign(from_half)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the distribution function by `erfc`, from the far tails to the middle.
    #[test]
    fn normal_quantiles_have_their_probability() {
        let probability = |x: f64| 0.5 * libm::erfc(-x / std::f64::consts::SQRT_2);
        for k in 1..2000 {
            let p = f64::from(k) / 2000.0;
            assert!((probability(standard_normal(p)) - p).abs() < 4e-16, "{p}");
        }
        for exponent in 2..300 {
            let p = 10_f64.powi(-exponent);
            let x = standard_normal(p);
            // The relative error of p is |x| times that of x, times |x|.
            assert!((probability(x) / p - 1.0).abs() < 2e-15 * (1.0 + x * x), "{p} {x}");
        }
        assert_eq!(standard_normal(0.5), 0.0);
        assert_eq!(standard_normal(0.975), -standard_normal(1.0 - 0.975));
    }

    #[test]
    fn quantiles_meet_the_bounds() {
        let log = Distribution::LogUniform { low: 0.1, high: 1000.0 };
        assert!((log.quantile(0.25) - 1.0).abs() < 1e-14 && (log.quantile(0.75) - 100.0).abs() < 1e-11);
        let uniform = Distribution::Uniform { low: -1.0, high: 3.0 };
        assert_eq!([0.0, 0.5].map(|p| uniform.quantile(p)), [-1.0, 1.0]);
    }

    #[test]
    fn distributions_that_are_none_are_refused() {
        let refused = [
            Distribution::Uniform { low: 1.0, high: 1.0 },
            Distribution::Uniform { low: f64::NAN, high: 1.0 },
            Distribution::Uniform { low: f64::NEG_INFINITY, high: 1.0 },
            Distribution::LogUniform { low: 0.0, high: 1.0 },
            Distribution::LogUniform { low: -1.0, high: 1.0 },
            Distribution::Normal { mean: 0.0, deviation: 0.0 },
            Distribution::Normal { mean: 0.0, deviation: f64::NAN },
            Distribution::Normal { mean: f64::INFINITY, deviation: 1.0 },
        ];
        for distribution in refused {
            let error = distribution.check("m1").unwrap_err().to_string();
            assert!(error.contains("`m1`"), "{error}");
        }
    }
}
