//! Names and units of what a motion holds.

use alloc::format;
use alloc::string::String;

use super::text;
use crate::model::{Dynamics, Outputs, Quantity};

/// A named sequence of numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) unit: String,
}

impl Column {
    /// `name in unit`.
    pub(super) fn title(&self) -> String {
        text::with_unit(&self.name, &self.unit)
    }
}

/// The unit of time: seconds in every coherent system; none where the model has no units at all.
pub(super) fn time_unit<M: Outputs>() -> &'static str {
    let any = [M::COORDINATES, M::INPUTS, M::PARAMETERS, M::OUTPUTS]
        .into_iter()
        .flatten()
        .any(|quantity| !quantity.unit.is_empty());
    if any { "s" } else { "" }
}

pub(super) fn time<M: Outputs>() -> Column {
    Column { name: "t".into(), unit: time_unit::<M>().into() }
}

pub(super) fn coordinates<M: Dynamics>() -> impl Iterator<Item = Column> {
    plain(M::COORDINATES)
}

pub(super) fn velocities<M: Outputs>() -> impl Iterator<Item = Column> {
    derivatives::<M>("_rate", "")
}

pub(super) fn accelerations<M: Outputs>() -> impl Iterator<Item = Column> {
    derivatives::<M>("_acceleration", "^2")
}

pub(super) fn plain(quantities: &'static [Quantity]) -> impl Iterator<Item = Column> {
    quantities.iter().map(|quantity| Column { name: quantity.name.into(), unit: quantity.unit.into() })
}

fn derivatives<M: Outputs>(suffix: &str, power: &str) -> impl Iterator<Item = Column> {
    let time = time_unit::<M>();
    M::COORDINATES.iter().map(move |quantity| Column {
        name: suffixed(quantity.name, suffix),
        unit: per_time(quantity.unit, time, power),
    })
}

/// `theta_rate`, `theta_rate[3]`: the accessors' names.
fn suffixed(name: &str, suffix: &str) -> String {
    match name.split_once('[') {
        Some((name, index)) => format!("{name}{suffix}[{index}"),
        None => format!("{name}{suffix}"),
    }
}

/// A unit divided by a power of the unit of time.
fn per_time(unit: &str, time: &str, power: &str) -> String {
    match unit {
        _ if time.is_empty() => String::new(),
        "" => format!("1/{time}{power}"),
        unit if unit.contains(['/', ' ']) => format!("({unit})/{time}{power}"),
        unit => format!("{unit}/{time}{power}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_have_the_accessors_names_and_units_per_time() {
        assert_eq!(suffixed("theta[3]", "_rate"), "theta_rate[3]");
        assert_eq!(suffixed("x", "_acceleration"), "x_acceleration");
        assert_eq!(per_time("rad", "s", "^2"), "rad/s^2");
        assert_eq!(per_time("", "s", ""), "1/s");
        assert_eq!(per_time("m/s", "s", ""), "(m/s)/s");
        assert_eq!(per_time("", "", ""), "");
    }
}
