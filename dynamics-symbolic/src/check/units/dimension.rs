//! Dimensions and their readable names in either system.

use super::Exponent;

/// A coherent system of units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum System {
    /// m, kg, s, A, K, mol, cd and what follows from them.
    Si,
    /// ft, slug, s and lb (pound-force = slug·ft/s²).
    UsCustomary,
}

impl System {
    /// Name for messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Si => "SI",
            Self::UsCustomary => "US customary",
        }
    }
}

/// Length, mass, time, current, temperature, amount, luminous intensity.
pub(super) const BASES: usize = 7;
const SI: [&str; BASES] = ["m", "kg", "s", "A", "K", "mol", "cd"];
const US: [&str; BASES] = ["ft", "slug", "s", "A", "K", "mol", "cd"];
/// Order in which factors are written: mass before length, as in kg·m²/s².
const WRITTEN: [usize; BASES] = [1, 0, 2, 3, 4, 5, 6];

/// Exponents over length, mass, time, current, temperature, amount and luminous intensity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Dimension(pub(super) [Exponent; BASES]);

impl Dimension {
    /// 1: plain numbers and angles.
    pub const ONE: Self = Self::mechanical(0, 0, 0);
    /// Length.
    pub const LENGTH: Self = Self::mechanical(1, 0, 0);
    /// Mass.
    pub const MASS: Self = Self::mechanical(0, 1, 0);
    /// Time.
    pub const TIME: Self = Self::mechanical(0, 0, 1);
    /// Force.
    pub const FORCE: Self = Self::mechanical(1, 1, -2);
    /// Energy, and moment of a force.
    pub const ENERGY: Self = Self::mechanical(2, 1, -2);
    /// Power.
    pub const POWER: Self = Self::mechanical(2, 1, -3);

    /// lengthˡ·massᵐ·timeᵗ.
    #[must_use]
    pub const fn mechanical(length: i32, mass: i32, time: i32) -> Self {
        Self::of([length, mass, time, 0, 0, 0, 0])
    }

    pub(super) const fn of(e: [i32; BASES]) -> Self {
        let x = Exponent::integer;
        Self([x(e[0]), x(e[1]), x(e[2]), x(e[3]), x(e[4]), x(e[5]), x(e[6])])
    }

    /// The exponents of length, mass and time; `None` where one is no integer or does not fit an `i8`, or
    /// where another base has an exponent.
    #[must_use]
    pub fn mechanical_exponents(&self) -> Option<[i8; 3]> {
        let [length, mass, time, others @ ..] = self.0;
        let integer = |e: Exponent| i8::try_from(e.numerator()).ok().filter(|_| e.denominator() == 1);
        let exponents = [integer(length)?, integer(mass)?, integer(time)?];
        others.iter().all(|e| e.is_zero()).then_some(exponents)
    }

    /// Whether it is 1.
    #[must_use]
    pub fn is_one(&self) -> bool {
        self.0.iter().all(|e| e.is_zero())
    }

    /// Product; `None` where an exponent does not fit.
    #[must_use]
    pub fn mul(&self, o: &Self) -> Option<Self> {
        let mut out = *self;
        for (a, b) in out.0.iter_mut().zip(o.0) {
            *a = a.plus(b)?;
        }
        Some(out)
    }

    /// Power; `None` where an exponent does not fit.
    #[must_use]
    pub fn pow(&self, e: Exponent) -> Option<Self> {
        let mut out = *self;
        for a in &mut out.0 {
            *a = a.times(e)?;
        }
        Some(out)
    }

    /// Readable text in a system: `J`, `N/m`, `kg*m^2/s`, `1/s`; `1` where it has none.
    #[must_use]
    pub fn text(&self, system: System) -> String {
        let (named, bases) = match system {
            System::Si => (SI_NAMED, SI),
            System::UsCustomary => (US_NAMED, US),
        };
        if let Some((name, _)) = named.iter().find(|(_, e)| Self::of(*e) == *self) {
            return (*name).to_owned();
        }
        let factors: Vec<(&str, Exponent)> = WRITTEN.iter().map(|i| (bases[*i], self.0[*i])).collect();
        write_product(&factors)
    }
}

/// `a^2*b/(c*d)` from factors and their exponents; `1` where all are zero.
pub(super) fn write_product(factors: &[(&str, Exponent)]) -> String {
    let (mut above, mut below) = (Vec::new(), Vec::new());
    for (name, e) in factors.iter().filter(|(_, e)| !e.is_zero()) {
        let (magnitude, side) = match e.negated() {
            Some(m) if e.is_negative() => (m, &mut below),
            _ => (*e, &mut above),
        };
        side.push(if magnitude == Exponent::ONE {
            (*name).to_owned()
        } else {
            format!("{name}^{magnitude}")
        });
    }
    let numerator = if above.is_empty() { "1".to_owned() } else { above.join("*") };
    match below.len() {
        0 => numerator,
        1 => format!("{numerator}/{}", below[0]),
        _ => format!("{numerator}/({})", below.join("*")),
    }
}

type NamedDimensions = &'static [(&'static str, [i32; BASES])];

/// Dimensions with a shorter name. Each has one name: a moment of a force is written `J` too.
const SI_NAMED: NamedDimensions = &[
    ("N", [1, 1, -2, 0, 0, 0, 0]),
    ("J", [2, 1, -2, 0, 0, 0, 0]),
    ("W", [2, 1, -3, 0, 0, 0, 0]),
    ("Pa", [-1, 1, -2, 0, 0, 0, 0]),
    ("N/m", [0, 1, -2, 0, 0, 0, 0]),
    ("C", [0, 0, 1, 1, 0, 0, 0]),
    ("V", [2, 1, -3, -1, 0, 0, 0]),
    ("V/m", [1, 1, -3, -1, 0, 0, 0]),
    ("F", [-2, -1, 4, 2, 0, 0, 0]),
    ("H", [2, 1, -2, -2, 0, 0, 0]),
    ("Ohm", [2, 1, -3, -2, 0, 0, 0]),
    ("T", [0, 1, -2, -1, 0, 0, 0]),
    ("Wb", [2, 1, -2, -1, 0, 0, 0]),
    ("N/A", [1, 1, -2, -1, 0, 0, 0]),
];

const US_NAMED: NamedDimensions = &[
    ("lb", [1, 1, -2, 0, 0, 0, 0]),
    ("ft*lb", [2, 1, -2, 0, 0, 0, 0]),
    ("ft*lb/s", [2, 1, -3, 0, 0, 0, 0]),
    ("lb/ft^2", [-1, 1, -2, 0, 0, 0, 0]),
    ("lb/ft", [0, 1, -2, 0, 0, 0, 0]),
    ("lb*s/ft", [0, 1, -1, 0, 0, 0, 0]),
];

#[cfg(test)]
mod tests {
    use super::super::Unit;
    use super::{Dimension, Exponent, System};

    #[test]
    fn mechanical_dimensions_have_three_exponents() {
        let exponents = |text: &str| {
            let unit = Unit::parse(text).expect("a unit").expect("not to be inferred");
            unit.dimension.mechanical_exponents()
        };
        for (text, expected) in [
            ("1", [0, 0, 0]),
            ("rad", [0, 0, 0]),
            ("ft", [1, 0, 0]),
            ("kg * m ^ 2 / s", [2, 1, -1]),
            ("m^3/(kg*s^2)", [3, -1, -2]),
            ("N*m/(m/s)^2", [0, 1, 0]),
            ("N*s^2/m", [0, 1, 0]),
            ("lb*s^2/ft", [0, 1, 0]),
            ("V*A", [2, 1, -3]),
        ] {
            assert_eq!(exponents(text), Some(expected), "{text}");
        }
        for text in ["V", "m^(1/2)", "m^200", "K"] {
            assert_eq!(exponents(text), None, "{text}");
        }
    }

    #[test]
    fn dimensions_read_as_engineers_write_them() {
        for (dimension, si, us) in [
            (Dimension::ONE, "1", "1"),
            (Dimension::ENERGY, "J", "ft*lb"),
            (Dimension::FORCE, "N", "lb"),
            (Dimension::POWER, "W", "ft*lb/s"),
            (Dimension::mechanical(0, 1, -2), "N/m", "lb/ft"),
            (Dimension::mechanical(2, 1, 0), "kg*m^2", "slug*ft^2"),
            (Dimension::mechanical(2, 1, -1), "kg*m^2/s", "slug*ft^2/s"),
            (Dimension::mechanical(1, 0, -2), "m/s^2", "ft/s^2"),
            (Dimension::mechanical(0, 0, -1), "1/s", "1/s"),
            (Dimension::mechanical(3, -1, -2), "m^3/(kg*s^2)", "ft^3/(slug*s^2)"),
        ] {
            assert_eq!(dimension.text(System::Si), si);
            assert_eq!(dimension.text(System::UsCustomary), us);
        }
        let root = Dimension::LENGTH.pow(Exponent::HALF).unwrap();
        assert_eq!(root.text(System::Si), "m^(1/2)");
    }
}
