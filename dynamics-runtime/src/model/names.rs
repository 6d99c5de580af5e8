//! Names and units of the quantities of a motion.

use alloc::format;
use alloc::string::String;

use dynamics_view::text;

use super::{Constraints, Dynamics, Outputs, Quantity, Vector};

/// A named sequence of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its unit, empty where it is not known or 1.
    pub unit: String,
}

impl Column {
    /// `name in unit`.
    pub(crate) fn title(&self) -> String {
        text::with_unit(&self.name, &self.unit)
    }
}

/// The unit of time: seconds in every coherent system; none where the model has no units at all.
#[must_use]
pub fn time_unit<M: Outputs>() -> &'static str {
    let any = [M::COORDINATES, M::INPUTS, M::PARAMETERS, M::OUTPUTS]
        .into_iter()
        .flatten()
        .any(|quantity| !quantity.unit.is_empty());
    if any { "s" } else { "" }
}

pub(crate) fn time<M: Outputs>() -> Column {
    Column { name: "t".into(), unit: time_unit::<M>().into() }
}

/// The unit of lengths; none where the model has no units at all.
#[must_use]
pub fn length_unit<M: Constraints + Outputs>() -> &'static str {
    match (time_unit::<M>().is_empty(), is_english::<M>()) {
        (true, _) => "",
        (false, true) => "ft",
        (false, false) => "m",
    }
}

/// The unit of energies; none where the model has no units at all.
#[must_use]
pub fn energy_unit<M: Constraints + Outputs>() -> &'static str {
    match (time_unit::<M>().is_empty(), is_english::<M>()) {
        (true, _) => "",
        (false, true) => "ft*lb",
        (false, false) => "J",
    }
}

/// The energy function q̇·∂L/∂q̇ − L.
pub(crate) fn energy<M: Constraints + Outputs>() -> Column {
    Column { name: "energy".into(), unit: energy_unit::<M>().into() }
}

/// The coordinates.
pub fn coordinates<M: Dynamics>() -> impl Iterator<Item = Column> {
    plain(M::COORDINATES)
}

/// Their rates.
pub fn velocities<M: Outputs>() -> impl Iterator<Item = Column> {
    derivatives::<M>("_rate", "")
}

/// Their accelerations.
pub fn accelerations<M: Outputs>() -> impl Iterator<Item = Column> {
    derivatives::<M>("_acceleration", "^2")
}

/// Quantities as they are declared.
pub fn plain(quantities: &'static [Quantity]) -> impl Iterator<Item = Column> {
    quantities.iter().map(|quantity| Column { name: quantity.name.into(), unit: quantity.unit.into() })
}

/// `lambda[closure.x]` in the unit of a generalized force for the row: λ·Φ is an energy, λ·(A q̇ + b) a
/// power.
/// Multipliers of the constraints, as `lambda[closure.x]`.
pub fn multipliers<M: Constraints + Outputs>() -> impl Iterator<Item = Column> {
    let (english, known) = (is_english::<M>(), !time_unit::<M>().is_empty());
    M::ROWS.iter().enumerate().map(move |(row, quantity)| {
        let per_time = row >= M::Residual::LEN;
        let unit = if known { force(quantity.unit, per_time, english) } else { String::new() };
        Column { name: format!("lambda[{}]", quantity.name), unit }
    })
}

/// Generalized forces, each called by the coordinate along which it does work.
pub fn forces<M: Constraints + Outputs>() -> impl Iterator<Item = Column> {
    let (english, known) = (is_english::<M>(), !time_unit::<M>().is_empty());
    M::COORDINATES.iter().map(move |quantity| {
        let unit = if known { force(quantity.unit, false, english) } else { String::new() };
        Column { name: quantity.name.into(), unit }
    })
}

/// Whether units are feet and pounds.
fn is_english<M: Constraints>() -> bool {
    let mut units = [M::COORDINATES, M::PARAMETERS, M::ROWS].into_iter().flatten();
    units.any(|quantity| ["ft", "lb", "slug"].iter().any(|unit| quantity.unit.contains(unit)))
}

/// Energy by the unit of Φ, or power by the unit of A q̇ + b.
fn force(unit: &str, per_time: bool, english: bool) -> String {
    let [newton, torque, energy, power, length] =
        if english { ["lb", "ft*lb", "ft*lb", "ft*lb/s", "ft"] } else { ["N", "N*m", "J", "W", "m"] };
    let by = if per_time { unit.strip_suffix("/s").unwrap_or(unit) } else { unit };
    match by {
        by if per_time && by == unit => format!("{power}/({unit})"),
        "" | "1" | "rad" => torque.into(),
        by if by == length => newton.into(),
        by if by.strip_suffix("^2") == Some(length) => format!("{newton}/{length}"),
        by => format!("{energy}/({by})"),
    }
}

fn derivatives<M: Outputs>(suffix: &str, power: &str) -> impl Iterator<Item = Column> {
    let time = time_unit::<M>();
    M::COORDINATES.iter().map(move |quantity| Column {
        name: suffixed(quantity.name, suffix),
        unit: per_time(quantity.unit, time, power),
    })
}

/// `theta_rate`, `theta_rate[3]`: the accessors' names.
#[must_use]
pub fn suffixed(name: &str, suffix: &str) -> String {
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
        assert_eq!(
            [
                force("m", false, false),
                force("m/s", true, false),
                force("rad", false, true),
                force("m^2", false, false)
            ],
            ["N", "N", "ft*lb", "N/m"]
        );
        assert_eq!([force("m^3", false, false), force("1/m", true, false)], ["J/(m^3)", "W/(1/m)"]);
        assert_eq!(suffixed("x", "_acceleration"), "x_acceleration");
        assert_eq!(per_time("rad", "s", "^2"), "rad/s^2");
        assert_eq!(per_time("", "s", ""), "1/s");
        assert_eq!(per_time("m/s", "s", ""), "(m/s)/s");
        assert_eq!(per_time("", "", ""), "");
    }
}
