//! Units as powers of the base units of the standard.

/// Powers of kg, m, s, A, K, mol, cd, rad, and the factor to SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BaseUnit {
    pub(crate) powers: [i32; 8],
    pub(crate) factor: f64,
}

/// Names of the base units, in the order of powers.
pub(crate) const BASES: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

const ONE: BaseUnit = BaseUnit { powers: [0; 8], factor: 1.0 };

/// A foot in m, a slug in kg, a pound-force in N: exact, but for the slug, which is lbf s²/ft.
const FOOT: f64 = 0.3048;
const POUND: f64 = 4.448_221_615_260_5;
const SLUG: f64 = POUND / FOOT;

/// The units that models may be written in. Powers of kg, m, s, A, K, mol, cd, rad.
const KNOWN: &[(&str, [i32; 8], f64)] = &[
    ("1", [0; 8], 1.0),
    ("kg", [1, 0, 0, 0, 0, 0, 0, 0], 1.0),
    ("m", [0, 1, 0, 0, 0, 0, 0, 0], 1.0),
    ("s", [0, 0, 1, 0, 0, 0, 0, 0], 1.0),
    ("A", [0, 0, 0, 1, 0, 0, 0, 0], 1.0),
    ("K", [0, 0, 0, 0, 1, 0, 0, 0], 1.0),
    ("mol", [0, 0, 0, 0, 0, 1, 0, 0], 1.0),
    ("cd", [0, 0, 0, 0, 0, 0, 1, 0], 1.0),
    ("rad", [0, 0, 0, 0, 0, 0, 0, 1], 1.0),
    ("Hz", [0, 0, -1, 0, 0, 0, 0, 0], 1.0),
    ("N", [1, 1, -2, 0, 0, 0, 0, 0], 1.0),
    ("J", [1, 2, -2, 0, 0, 0, 0, 0], 1.0),
    ("W", [1, 2, -3, 0, 0, 0, 0, 0], 1.0),
    ("Pa", [1, -1, -2, 0, 0, 0, 0, 0], 1.0),
    ("C", [0, 0, 1, 1, 0, 0, 0, 0], 1.0),
    ("V", [1, 2, -3, -1, 0, 0, 0, 0], 1.0),
    ("F", [-1, -2, 4, 2, 0, 0, 0, 0], 1.0),
    ("H", [1, 2, -2, -2, 0, 0, 0, 0], 1.0),
    ("Ohm", [1, 2, -3, -2, 0, 0, 0, 0], 1.0),
    ("T", [1, 0, -2, -1, 0, 0, 0, 0], 1.0),
    ("Wb", [1, 2, -2, -1, 0, 0, 0, 0], 1.0),
    ("ft", [0, 1, 0, 0, 0, 0, 0, 0], FOOT),
    ("slug", [1, 0, 0, 0, 0, 0, 0, 0], SLUG),
    ("lb", [1, 1, -2, 0, 0, 0, 0, 0], POUND),
    ("lbf", [1, 1, -2, 0, 0, 0, 0, 0], POUND),
];

/// A unit as powers of base units; `None` for powers that are no integers, and for names that are not known.
/// Importers then have its name alone.
pub(crate) fn base_unit(unit: &str) -> Option<BaseUnit> {
    let mut reader = Reader { rest: unit.trim() };
    let found = reader.product()?;
    reader.rest.is_empty().then_some(found)
}

/// What quantity a unit measures, for the types of variables.
pub(crate) fn quantity(unit: &str) -> Option<&'static str> {
    const QUANTITIES: &[(&str, &str)] = &[
        ("rad", "Angle"),
        ("rad/s", "AngularVelocity"),
        ("rad/s^2", "AngularAcceleration"),
        ("m", "Length"),
        ("ft", "Length"),
        ("m/s", "Velocity"),
        ("ft/s", "Velocity"),
        ("m/s^2", "Acceleration"),
        ("ft/s^2", "Acceleration"),
        ("kg", "Mass"),
        ("slug", "Mass"),
        ("s", "Time"),
        ("N", "Force"),
        ("lb", "Force"),
        ("N*m", "Torque"),
        ("ft*lb", "Energy"),
        ("J", "Energy"),
        ("W", "Power"),
        ("N/m", "Stiffness"),
        ("N*s/m", "Damping"),
        ("kg*m^2", "MomentOfInertia"),
        ("Hz", "Frequency"),
    ];
    let spaceless: String = unit.chars().filter(|c| !c.is_whitespace()).collect();
    QUANTITIES.iter().find(|(known, _)| *known == spaceless).map(|(_, quantity)| *quantity)
}

struct Reader<'a> {
    rest: &'a str,
}

impl Reader<'_> {
    fn eat(&mut self, sign: char) -> bool {
        let rest = self.rest.strip_prefix(sign).map(str::trim_start);
        if let Some(rest) = rest {
            self.rest = rest;
        }
        rest.is_some()
    }

    /// Factors joined by `*`, `/` or nothing but a space.
    fn product(&mut self) -> Option<BaseUnit> {
        let mut all = self.power()?;
        loop {
            let divides = self.eat('/');
            if !divides && !self.eat('*') && (self.rest.is_empty() || self.rest.starts_with(')')) {
                return Some(all);
            }
            let next = self.power()?;
            all = times(all, next, if divides { -1 } else { 1 });
        }
    }

    fn power(&mut self) -> Option<BaseUnit> {
        let base = if self.eat('(') {
            let inner = self.product()?;
            self.eat(')').then_some(inner)?
        } else {
            let end = self.rest.find(|c: char| !c.is_alphanumeric()).unwrap_or(self.rest.len());
            let (name, rest) = self.rest.split_at(end);
            self.rest = rest.trim_start();
            let (_, powers, factor) = KNOWN.iter().find(|(known, ..)| *known == name)?;
            BaseUnit { powers: *powers, factor: *factor }
        };
        if !self.eat('^') {
            return Some(base);
        }
        let is_part = |c: char| c.is_ascii_digit() || c == '-' || c == '.';
        let end = self.rest.find(|c| !is_part(c)).unwrap_or(self.rest.len());
        let (number, rest) = self.rest.split_at(end);
        self.rest = rest.trim_start();
        Some(times(ONE, base, number.parse().ok()?))
    }
}

/// a bᵏ.
fn times(a: BaseUnit, b: BaseUnit, k: i32) -> BaseUnit {
    let mut powers = a.powers;
    powers.iter_mut().zip(b.powers).for_each(|(sum, power)| *sum += k * power);
    BaseUnit { powers, factor: a.factor * b.factor.powi(k) }
}

#[cfg(test)]
mod tests {
    use super::base_unit;

    #[test]
    fn units_become_powers_of_base_units() {
        for (unit, powers) in [
            ("m/s^2", [0, 1, -2, 0, 0, 0, 0, 0]),
            ("(m/s)/s^2", [0, 1, -3, 0, 0, 0, 0, 0]),
            ("kg*m^2", [1, 2, 0, 0, 0, 0, 0, 0]),
            ("kg m^2 / s", [1, 2, -1, 0, 0, 0, 0, 0]),
            ("W/(1/m)", [1, 3, -3, 0, 0, 0, 0, 0]),
            ("N*m/rad", [1, 2, -2, 0, 0, 0, 0, -1]),
            ("s^-1", [0, 0, -1, 0, 0, 0, 0, 0]),
            ("1/s", [0, 0, -1, 0, 0, 0, 0, 0]),
        ] {
            assert_eq!(
                base_unit(unit).map(|found| (found.powers, found.factor)),
                Some((powers, 1.0)),
                "{unit}"
            );
        }
        let pound = base_unit("slug*ft/s^2").unwrap();
        assert!((pound.factor / base_unit("lb").unwrap().factor - 1.0).abs() < 1e-15);
        for unit in ["m^0.5", "furlong", "m/", "(m", "m)", ""] {
            assert_eq!(base_unit(unit), None, "{unit}");
        }
    }
}
