//! Sentences that name the cheapest methods for an error.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::simulate::Simulate;
use dynamics_view::text::readable;

use super::errors::ErrorOf;
use super::study::{Cost, Study, WorkPrecisionCurve};

/// Errors for which a sentence names the fastest method.
const ASKED_ERRORS: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e-12];
/// Times that differ by less than this factor are alike: repeated measurements on one machine differ by as
/// much.
const SIMILAR_TIME_RATIO: f64 = 1.1;

impl<M: Simulate> Study<'_, M> {
    /// What is fastest here to errors of 1e-3, 1e-6, 1e-9 and 1e-12 in positions and velocities, and what
    /// takes the fewest evaluations, which depend on no machine: a sentence for each error that was reached.
    /// Methods within a tenth of the fastest are named beside it, and the default method is compared with it.
    /// Taylor series are not judged by evaluations, of which they need none.
    #[must_use]
    pub fn sentences(&self) -> Vec<String> {
        ASKED_ERRORS.into_iter().filter_map(|error| self.sentence(error)).collect()
    }

    fn sentence(&self, error: f64) -> Option<String> {
        let fastest = self.cheapest(error, Cost::Time);
        let (first, time) = *fastest.first()?;
        let mut text = format!(
            "to {} in {}: fastest here is {} with {} µs",
            readable(error, 1),
            ErrorOf::State,
            named(first),
            readable(1e6 * time, 3)
        );
        let alike: Vec<String> = fastest[1..]
            .iter()
            .take_while(|(_, other)| *other < SIMILAR_TIME_RATIO * time)
            .map(|(curve, other)| format!("{} with {}", named(curve), readable(1e6 * other, 3)))
            .collect();
        if !alike.is_empty() {
            text += &format!(" (alike: {})", alike.join(", "));
        }
        if let Some((curve, count)) = self.cheapest(error, Cost::Evaluations).first() {
            text += &format!(
                "; fewest evaluations, on any machine: {} with {}",
                named(curve),
                readable(count.round(), 3)
            );
        }
        let default = self.curves.iter().find(|curve| curve.is_default);
        let default = default.and_then(|curve| self.cost_of(curve, ErrorOf::State, error, Cost::Time));
        if let Some(default) = default {
            text += &format!("; the default method takes {} times that time", readable(default / time, 2));
        }
        Some(text)
    }

    /// The curves of named methods that reach this error with their costs, from the cheapest on.
    fn cheapest(&self, error: f64, cost: Cost) -> Vec<(&WorkPrecisionCurve, f64)> {
        let named = self.curves.iter().filter(|curve| !curve.is_default);
        let costs = named.map(|curve| (curve, self.cost_of(curve, ErrorOf::State, error, cost)));
        let mut costs: Vec<_> = costs.filter_map(|(curve, cost)| Some((curve, cost?))).collect();
        costs.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        costs
    }
}

/// The name of a curve, with where it is from if that is not this library.
fn named(curve: &WorkPrecisionCurve) -> String {
    if curve.outside { format!("{} (measured elsewhere)", curve.name) } else { curve.name.clone() }
}
