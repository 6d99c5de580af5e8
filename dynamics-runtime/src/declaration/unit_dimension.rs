//! What quantities measure. The macros know it from the units that the model declares, and code that depends
//! on a unit reads it here: units are texts for readers.

/// What a quantity measures: the dimension of its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnitDimension {
    /// Not known, a number, not mechanical (an electric current), or with exponents that are no integers.
    Other,
    /// An angle in rad. Its dimension is that of a number.
    Angle,
    /// lengthˡ · massᵐ · timeᵗ.
    Mechanical {
        /// l.
        length: i8,
        /// m.
        mass: i8,
        /// t.
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
