//! Fits in words.

use core::fmt;

use dynamics_runtime::wording::{Readable, Times};

use super::{Fit, Loss, Outlier};

/// Correlations beyond this one are printed. Below it, each unknown is known nearly as well as if the other
/// were given.
const STRONG_CORRELATION: f64 = 0.9;
/// Data with a smaller weight than this one are counted as outliers.
const LIGHT_WEIGHT: f64 = 0.5;
/// Correlation of neighbouring residuals, in 1/√data, above which it is significant (95 %).
const SIGNIFICANT_NEIGHBOURS: f64 = 2.0;

/// One line for each unknown, then correlations that matter, then one line for each quantity.
impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wide = self.found.iter().map(|fitted| fitted.name.chars().count()).max().unwrap_or(0);
        for fitted in &self.found {
            let error =
                fitted.standard_error.map_or("on its bound".into(), |error| alloc::format!("± {error:.2e}"));
            writeln!(f, "{:<wide$}  {:>14.7e} {error} {}", fitted.name, fitted.value, fitted.unit)?;
        }
        for i in 0..self.found.len() {
            for j in 0..i {
                let correlation = self.correlation[(i, j)];
                if correlation.abs() > STRONG_CORRELATION {
                    let (one, other) = (&self.found[j].name, &self.found[i].name);
                    writeln!(f, "`{one}` and `{other}` go together: correlation {correlation:.4}")?;
                }
            }
        }
        for left in &self.residuals {
            let (count, rms, unit) = (left.points.len(), left.rms, &left.unit);
            write!(f, "{}: {count} data, residuals of {rms:.3e} {unit}", left.name)?;
            if left.explained.is_finite() {
                write!(f, ", {:.4} % of their scatter explained", 100.0 * left.explained)?;
            }
            // Residuals of data without noise are errors of the motions, below 1e-8 of the data, which are
            // correlated, too.
            if left.neighbours > SIGNIFICANT_NEIGHBOURS / (count as f64).sqrt() && left.explained != 1.0 {
                write!(f, "; neighbours are alike ({:.2}), as the model lacks something", left.neighbours)?;
            }
            writeln!(f)?;
        }
        // Residuals of data without noise are errors of the motions.
        let exact = self.residuals.iter().all(|left| left.explained == 1.0);
        if let Some(outlier) = self.outlier().filter(|_| !exact) {
            writeln!(f, "{outlier}: an outlier?")?;
        }
        if self.loss != Loss::Squares {
            let all = self.residuals.iter().flat_map(|left| &left.weights);
            let light = all.filter(|weight| **weight < LIGHT_WEIGHT).count();
            writeln!(f, "{:?}, scale {:.3e}: {light} data count for less than half", self.loss, self.scale)?;
        }
        let noise = if self.absolute { "noise given" } else { "noise from the residuals" };
        write!(f, "χ² = {:.6e} with {} degrees of freedom ({noise}), ", self.chi_squared, self.freedom)?;
        write!(f, "independence {:.1e}, {} iterations", self.independence, self.iterations)
    }
}

impl fmt::Display for Outlier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { quantity, unit, row, time, residual, times, part } = self;
        let (time, part) = (Readable(*time), (100.0 * part).min(99.9));
        write!(
            f,
            "row {row} of `{quantity}` (t = {time}) alone makes {part:.1} % of the squares of its residuals: "
        )?;
        let space = if unit.is_empty() { "" } else { " " };
        write!(f, "{:.3e}{space}{unit} off", residual.abs())?;
        if times.is_finite() {
            write!(f, ", {} times the median of the others", Times(*times))
        } else {
            Ok(())
        }
    }
}
