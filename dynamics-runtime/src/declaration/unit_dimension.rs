//! The dimension of a unit, from its text.
//!
//! A model declares its units as texts, [`Quantity::unit`](super::Quantity::unit). Code that depends on a
//! unit compares dimensions, not texts. Declared units are coherent, products of powers of the names in
//! [`UnitDimension::NAMES`], as `kg*m^2/s` or `1/(kg*m)`.

/// Exponents of length, mass and time. Angles are numbers. Other base units are not mechanical.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct UnitDimension {
    length: i16,
    mass: i16,
    time: i16,
}

impl UnitDimension {
    const ONE: Self = Self::new(0, 0, 0);
    /// A length.
    pub(crate) const LENGTH: Self = Self::new(1, 0, 0);
    /// The coherent units of the macros that are mechanical.
    const NAMES: [(&'static str, Self); 14] = [
        ("1", Self::ONE),
        ("rad", Self::ONE),
        ("m", Self::LENGTH),
        ("ft", Self::LENGTH),
        ("kg", Self::new(0, 1, 0)),
        ("slug", Self::new(0, 1, 0)),
        ("s", Self::new(0, 0, 1)),
        ("Hz", Self::new(0, 0, -1)),
        ("N", Self::new(1, 1, -2)),
        ("lb", Self::new(1, 1, -2)),
        ("lbf", Self::new(1, 1, -2)),
        ("J", Self::new(2, 1, -2)),
        ("W", Self::new(2, 1, -3)),
        ("Pa", Self::new(-1, 1, -2)),
    ];

    const fn new(length: i16, mass: i16, time: i16) -> Self {
        Self { length, mass, time }
    }

    /// The dimension of a text; `None` where the unit is unknown (an empty text), is not mechanical, or has
    /// exponents that are no integers.
    pub(crate) fn parse(unit: &str) -> Option<Self> {
        let (dimension, rest) = Self::product(unit.trim())?;
        rest.is_empty().then_some(dimension)
    }

    /// Whether this is the dimension of an inertia: a mass, a moment of it of any order, as the moment of
    /// inertia, or a mass per length, area or volume.
    pub(crate) fn is_inertia(self) -> bool {
        self.mass == 1 && self.time == 0
    }

    /// `self · otherᵉ`.
    fn times(self, other: Self, exponent: i16) -> Option<Self> {
        let part = |own: i16, other: i16| own.checked_add(other.checked_mul(exponent)?);
        Some(Self {
            length: part(self.length, other.length)?,
            mass: part(self.mass, other.mass)?,
            time: part(self.time, other.time)?,
        })
    }

    /// Powers joined by `*` and `/`; returns what follows them.
    fn product(text: &str) -> Option<(Self, &str)> {
        let (mut product, mut rest) = Self::power(text)?;
        loop {
            let (sign, factor) = match rest.as_bytes().first() {
                Some(b'*') => (1, &rest[1..]),
                Some(b'/') => (-1, &rest[1..]),
                _ => return Some((product, rest)),
            };
            let (power, after) = Self::power(factor.trim_start())?;
            (product, rest) = (product.times(power, sign)?, after);
        }
    }

    /// A name or a product in parentheses, with an integer exponent if there is one.
    fn power(text: &str) -> Option<(Self, &str)> {
        let (base, rest) = match text.strip_prefix('(') {
            Some(inner) => {
                let (product, rest) = Self::product(inner.trim_start())?;
                (product, rest.strip_prefix(')')?)
            }
            None => {
                let end = text.find(|c: char| !c.is_alphanumeric()).unwrap_or(text.len());
                let (_, dimension) = Self::NAMES.iter().find(|(name, _)| *name == &text[..end])?;
                (*dimension, &text[end..])
            }
        };
        let Some(exponent) = rest.trim_start().strip_prefix('^') else {
            return Some((base, rest.trim_start()));
        };
        let exponent = exponent.trim_start();
        let end = exponent.find(|c: char| !c.is_ascii_digit() && c != '-').unwrap_or(exponent.len());
        let power = Self::ONE.times(base, exponent[..end].parse().ok()?)?;
        Some((power, exponent[end..].trim_start()))
    }
}

#[cfg(test)]
mod tests {
    use super::UnitDimension;

    #[test]
    fn units_have_their_dimension() {
        let new = UnitDimension::new;
        for (unit, dimension) in [
            ("1", UnitDimension::ONE),
            ("rad", UnitDimension::ONE),
            ("m", UnitDimension::LENGTH),
            ("ft", UnitDimension::LENGTH),
            ("kg*m^2", new(2, 1, 0)),
            ("kg * m ^ 2 / s", new(2, 1, -1)),
            ("m^3/(kg*s^2)", new(3, -1, -2)),
            ("1/s", new(0, 0, -1)),
            ("N*m/(m/s)^2", new(0, 1, 0)),
            ("s^-2", new(0, 0, -2)),
        ] {
            assert_eq!(UnitDimension::parse(unit), Some(dimension), "{unit}");
        }
        for unknown in ["", "_", "apple", "m^(1/2)", "kg*", "kg)", "(kg", "V", "m^99999", "kg m"] {
            assert_eq!(UnitDimension::parse(unknown), None, "{unknown}");
        }
    }

    /// Dampers and forces are not inertia, though `kg/s` and `lbf` begin like a mass. Densities are.
    #[test]
    fn inertia_has_mass_and_no_time() {
        let is_inertia = |unit: &str| UnitDimension::parse(unit).is_some_and(UnitDimension::is_inertia);
        for unit in
            ["kg", "slug", "kg*m", "kg*m^2", "slug*ft^2", "lb*s^2/ft", "N*s^2/m", "m^2*kg", "kg/m", "kg/m^3"]
        {
            assert!(is_inertia(unit), "{unit}");
        }
        for unit in ["kg/s", "kg/s^2", "lb", "lbf", "m", "1", "", "kg^2"] {
            assert!(!is_inertia(unit), "{unit}");
        }
    }
}
