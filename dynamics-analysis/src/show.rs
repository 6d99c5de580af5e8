//! `Display` of results of analyses that have no `show` module of their own. It prints a summary; functions
//! such as `to_csv` write whole tables.

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use alloc::{format, vec};
use core::fmt;

use dynamics_runtime::model::{ModelState, Quantity, Vector as _};
use dynamics_runtime::simulate::Simulate;
use nalgebra::DMatrix;

use crate::continuation::{FoldCurve, HopfCurve};
use crate::linearize::Linearization;
use crate::parameters::{EquilibriumChange, FrequencyChange, Sensitivities, Sweep};
use crate::periodic::Section;
use crate::table::columns;
use crate::vibration::{
    FrequencyResponse, LowestModes, LqrDesign, NormalModes, Signal, Spectrum, StateSpace, TimeResponse,
};

/// Most lines of a list that are printed; the number of the others follows. The list then fits a terminal.
const MAX_LIST_LINES: usize = 20;

/// A table under a heading, cut after [`MAX_LIST_LINES`], without the last end of line.
fn list(f: &mut fmt::Formatter<'_>, heading: Vec<String>, mut rows: Vec<Vec<String>>) -> fmt::Result {
    let more = rows.len().saturating_sub(MAX_LIST_LINES);
    rows.truncate(MAX_LIST_LINES);
    rows.insert(0, heading);
    f.write_str(columns(&rows).trim_end())?;
    if more > 0 { write!(f, "\n… and {more} more") } else { Ok(()) }
}

/// `x [m]`.
fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_string() } else { format!("{name} [{unit}]") }
}

fn signal(signal: &Signal) -> String {
    with_unit(&signal.name, &signal.unit)
}

fn names(quantities: &[Quantity]) -> String {
    let all: Vec<String> = quantities.iter().map(|of| with_unit(of.name, of.unit)).collect();
    all.join(", ")
}

/// A matrix by rows, with its name before the first row; nothing for a matrix without rows.
fn matrix(f: &mut fmt::Formatter<'_>, name: &str, of: &DMatrix<f64>) -> fmt::Result {
    let row = |i: usize| {
        let name = if i == 0 { format!("{name} =") } else { String::new() };
        let values = (0..of.ncols()).map(|j| format!("{:.6e}", of[(i, j)] + 0.0));
        core::iter::once(name).chain(values).collect()
    };
    let rows: Vec<Vec<String>> = (0..of.nrows()).map(row).collect();
    if rows.is_empty() { Ok(()) } else { write!(f, "\n{}", columns(&rows).trim_end()) }
}

/// The values of the two parameters along the curve.
impl<S: ModelState> fmt::Display for FoldCurve<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "folds over two parameters: {} points; {}", self.points.len(), self.end)?;
        let row = |(i, ([first, second], _)): (usize, &([f64; 2], S))| {
            let cusp = if self.cusps.contains(&i) { "cusp" } else { "" };
            vec![i.to_string(), format!("{first:.6e}"), format!("{second:.6e}"), cusp.into()]
        };
        let rows = self.points.iter().enumerate().map(row).collect();
        list(f, ["point", "first", "second", ""].map(String::from).to_vec(), rows)
    }
}

/// The values of the two parameters along the curve, and the frequency of flutter.
impl<S: ModelState> fmt::Display for HopfCurve<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "flutter over two parameters: {} points; {}", self.points.len(), self.end)?;
        let points = self.points.iter().zip(&self.frequencies).enumerate();
        let rows = points
            .map(|(i, (([first, second], _), frequency))| {
                vec![
                    i.to_string(),
                    format!("{first:.6e}"),
                    format!("{second:.6e}"),
                    format!("{frequency:.6e}"),
                ]
            })
            .collect();
        list(f, ["point", "first", "second", "ω in rad/s"].map(String::from).to_vec(), rows)
    }
}

/// The coordinates of the points.
impl<S: ModelState> fmt::Display for Section<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "section: {} points", self.points.len())?;
        let names = self.coordinates.iter().map(|of| with_unit(of.name, of.unit));
        let heading = core::iter::once("t".into()).chain(names).collect();
        let row = |state: &S| {
            let values = state.q().as_slice().iter().map(|x| format!("{x:.6e}"));
            core::iter::once(format!("{:.6}", state.t())).chain(values).collect()
        };
        list(f, heading, self.points.iter().map(row).collect())
    }
}

/// The axes of the grid, the number of runs and of failures, and the first failure.
impl<const K: usize> fmt::Display for Sweep<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axes: Vec<String> = self
            .axes
            .iter()
            .map(|axis| format!("{} ({} values)", with_unit(&axis.name, &axis.unit), axis.values.len()))
            .collect();
        let failed = self.results.iter().filter(|result| result.is_err()).count();
        write!(f, "{} over {}: ", self.names.join(", "), axes.join(" × "))?;
        write!(f, "{} runs, {failed} failed", self.results.len())?;
        let first = self.results.iter().find_map(|result| result.as_ref().err());
        first.map_or(Ok(()), |failure| write!(f, "; the first: {failure}"))
    }
}

/// The parameters that were varied, and how.
impl<M: Simulate> fmt::Display for Sensitivities<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let how = if self.exact { "exact derivatives" } else { "some derivatives by differences" };
        let (from, to) = (self.motion.start_time(), self.motion.end_time());
        write!(f, "sensitivities of {} from t = {from} to {to}: {how}, {} steps", M::NAME, self.steps)
    }
}

/// M, C and K with the names of their coordinates.
impl fmt::Display for Linearization {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "small motions in {}", names(&self.coordinates))?;
        matrix(f, "M", &self.mass)?;
        matrix(f, "C", &self.damping)?;
        matrix(f, "K", &self.stiffness)?;
        self.unsteady.as_ref().map_or(Ok(()), |why| write!(f, "\nnot steady: {why}"))
    }
}

/// The signals and the matrices.
impl fmt::Display for StateSpace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = |signals: &[Signal]| signals.iter().map(signal).collect::<Vec<_>>().join(", ");
        write!(f, "states  {}", of(&self.states))?;
        write!(f, "\ninputs  {}\noutputs {}", of(&self.inputs), of(&self.outputs))?;
        matrix(f, "A", &self.a)?;
        matrix(f, "B", &self.b)?;
        matrix(f, "C", &self.c)?;
        matrix(f, "D", &self.d)
    }
}

/// The peaks.
impl fmt::Display for FrequencyResponse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.frequencies.len();
        writeln!(f, "{} by {}: {count} frequencies", signal(&self.output), signal(&self.input))?;
        let row = |(frequency, value): &(f64, nalgebra::Complex<f64>)| {
            vec![
                format!("{frequency:.6e}"),
                format!("{:.6e}", value.norm()),
                format!("{:.1}", value.arg().to_degrees()),
            ]
        };
        let rows = self.peaks.iter().map(row).collect();
        list(f, ["peak at ω in rad/s", "gain", "phase in °"].map(String::from).to_vec(), rows)
    }
}

/// The outputs with their largest values.
impl fmt::Display for TimeResponse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ends = (self.times.first(), self.times.last());
        if let (Some(from), Some(to)) = ends {
            writeln!(f, "response from t = {from} to {to}: {} times", self.times.len())?;
        }
        let row = |(k, of): (usize, &Signal)| {
            let largest = self.values.column(k).iter().fold(0.0f64, |most, x| most.max(x.abs()));
            vec![signal(of), format!("{largest:.6e}")]
        };
        let rows = self.outputs.iter().enumerate().map(row).collect();
        list(f, ["output", "largest"].map(String::from).to_vec(), rows)
    }
}

/// The largest amplitudes.
impl fmt::Display for Spectrum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, resolution) = (self.frequencies.len(), self.resolution);
        writeln!(f, "{count} frequencies, {resolution:.6e} apart; mean {:.6e}", self.mean)?;
        let mut by_size: Vec<usize> = (0..self.amplitudes.len()).collect();
        by_size.sort_by(|a, b| self.amplitudes[*b].total_cmp(&self.amplitudes[*a]));
        let row =
            |k: usize| vec![format!("{:.6e}", self.frequencies[k]), format!("{:.6e}", self.amplitudes[k])];
        let rows = by_size.into_iter().map(row).collect();
        list(f, ["frequency", "amplitude"].map(String::from).to_vec(), rows)
    }
}

/// The frequencies.
impl fmt::Display for NormalModes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "undamped modes in {}", names(&self.coordinates))?;
        let row = |(k, frequency): (usize, &f64)| vec![k.to_string(), format!("{frequency:.9e}")];
        let rows = self.frequencies.iter().enumerate().map(row).collect();
        list(f, ["mode", "ω in rad/s"].map(String::from).to_vec(), rows)
    }
}

/// The frequencies with their residuals.
impl fmt::Display for LowestModes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "lowest modes: {} counted, {} iterations", self.counted, self.iterations)?;
        let pairs = self.frequencies.iter().zip(&self.residuals).enumerate();
        let rows = pairs
            .map(|(k, (frequency, left))| {
                vec![k.to_string(), format!("{frequency:.9e}"), format!("{left:.1e}")]
            })
            .collect();
        list(f, ["mode", "ω in rad/s", "residual"].map(String::from).to_vec(), rows)
    }
}

/// The weights that were given.
impl fmt::Display for LqrDesign<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let weights: Vec<String> = self.weights.iter().map(|(name, w)| format!("{name}: {w}")).collect();
        write!(f, "design of a regulator with the weights {}", weights.join(", "))
    }
}

/// The change of each coordinate per unit of the parameter.
impl fmt::Display for EquilibriumChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row = |(of, by): (&Quantity, &f64)| vec![with_unit(of.name, of.unit), format!("{by:.6e}")];
        let rows = self.coordinates.iter().zip(self.by.iter()).map(row).collect();
        list(f, ["coordinate", "by the parameter"].map(String::from).to_vec(), rows)
    }
}

/// ω and its change per unit of the parameter.
impl fmt::Display for FrequencyChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ω = {:.9e} rad/s, by the parameter {:.6e}", self.frequency, self.frequency_by)?;
        if self.multiplicity > 1 { write!(f, ", {} times", self.multiplicity) } else { Ok(()) }
    }
}
