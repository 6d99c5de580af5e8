//! Gradients in words.

use core::fmt;

use dynamics_runtime::model::Parameters;
use dynamics_runtime::simulate::Simulate;

use super::Gradient;

/// The value, then one line for each variable.
impl<M: Simulate + Parameters + Clone> fmt::Display for Gradient<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: alloc::vec::Vec<_> = self.variables.iter().map(|variable| variable.name::<M>()).collect();
        let wide = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
        writeln!(f, "J = {:.9e}", self.value)?;
        for (k, name) in names.iter().enumerate() {
            let unit = self.variables[k].unit::<M>();
            let unit = if unit.is_empty() { unit } else { alloc::format!(" per {unit}") };
            writeln!(f, "{name:<wide$}  {:>16.9e}{unit}", self.derivatives[k])?;
        }
        write!(f, "{} steps backward", self.steps)
    }
}
