//! What quantities measure. The macros take it from the units that the model declares. Whether a quantity is
//! an angle, a length or an inertia is read here, never from the text of its unit.

/// What a quantity measures: the dimension of its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum UnitDimension {
    /// Not known, a number, not mechanical (an electric current), or with exponents that are no integers.
    Other,
    /// An angle in rad. Its dimension is that of a number.
    Angle,
    /// lengthˡ · massᵐ · timeᵗ.
    Mechanical {
        /// The exponent of length.
        length: i8,
        /// The exponent of mass.
        mass: i8,
        /// The exponent of time.
        time: i8,
    },
}

impl UnitDimension {
    /// A length.
    pub const LENGTH: Self = Self::Mechanical { length: 1, mass: 0, time: 0 };

    /// Whether this is the dimension of an inertia: a mass, a moment of it of any order, as the moment of
    /// inertia, or a mass per length, area or volume.
    #[must_use]
    pub const fn is_inertia(self) -> bool {
        matches!(self, Self::Mechanical { mass: 1, time: 0, .. })
    }
}

#[cfg(test)]
mod tests {
    use super::UnitDimension;

    /// Dampers and forces are not inertia. Densities are.
    #[test]
    fn inertia_has_mass_and_no_time() {
        let is_inertia = |length, mass, time| UnitDimension::Mechanical { length, mass, time }.is_inertia();
        for (unit, length) in [("kg", 0), ("kg*m", 1), ("kg*m^2", 2), ("kg/m^3", -3)] {
            assert!(is_inertia(length, 1, 0), "{unit}");
        }
        for (unit, [length, mass, time]) in
            [("kg/s", [0, 1, -1]), ("lb", [1, 1, -2]), ("m", [1, 0, 0]), ("kg^2", [0, 2, 0])]
        {
            assert!(!is_inertia(length, mass, time), "{unit}");
        }
        assert!(!UnitDimension::Angle.is_inertia() && !UnitDimension::Other.is_inertia());
    }
}
