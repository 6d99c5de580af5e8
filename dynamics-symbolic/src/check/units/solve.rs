//! Units as unknowns: products with unknown factors, and a solver that infers them equation by equation.
//!
//! A unit with unknowns is Πᵢ baseᵢ^eᵢ · Πₖ uₖ^rₖ; its logarithm is linear, so equating two of them is one
//! step of Gaussian elimination.

use crate::graph::Origin;

use super::dimension::write_product;
use super::{Dimension, Exponent, System, Unit};

/// A unit that may contain unknowns: a dimension times rational powers of unknown units.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnitExpr {
    dimension: Dimension,
    /// (unknown, exponent ≠ 0), by unknown.
    unknowns: Vec<(u32, Exponent)>,
    /// Exponents grew beyond what fits: nothing is known about it and nothing is checked.
    lost: bool,
}

impl UnitExpr {
    /// 1: plain numbers and angles.
    pub const ONE: Self = Self::known(Dimension::ONE);
    const LOST: Self = Self { dimension: Dimension::ONE, unknowns: Vec::new(), lost: true };

    /// A known unit.
    #[must_use]
    pub const fn known(dimension: Dimension) -> Self {
        Self { dimension, unknowns: Vec::new(), lost: false }
    }

    /// Product.
    #[must_use]
    pub fn mul(&self, o: &Self) -> Self {
        self.times(o, Exponent::ONE).unwrap_or(Self::LOST)
    }
    /// Quotient.
    #[must_use]
    pub fn div(&self, o: &Self) -> Self {
        self.times(o, Exponent::integer(-1)).unwrap_or(Self::LOST)
    }
    /// Power: ½ for a square root, −1 for a reciprocal.
    #[must_use]
    pub fn pow(&self, e: Exponent) -> Self {
        Self::ONE.times(self, e).unwrap_or(Self::LOST)
    }

    /// `self · oᵉ`; `None` where an exponent does not fit.
    fn times(&self, o: &Self, e: Exponent) -> Option<Self> {
        if self.lost || o.lost {
            return None;
        }
        let dimension = self.dimension.mul(&o.dimension.pow(e)?)?;
        let mut unknowns = Vec::with_capacity(self.unknowns.len() + o.unknowns.len());
        let (mut left, mut right) = (self.unknowns.iter().peekable(), o.unknowns.iter().peekable());
        loop {
            let (k, sum) = match (left.peek(), right.peek()) {
                (None, None) => break,
                (Some((a, x)), Some((b, y))) if a == b => {
                    let sum = x.plus(y.times(e)?)?;
                    left.next();
                    right.next();
                    (*a, sum)
                }
                (Some((a, x)), b) if b.is_none_or(|(b, _)| a < b) => {
                    left.next();
                    (*a, *x)
                }
                (_, Some((b, y))) => {
                    right.next();
                    (*b, y.times(e)?)
                }
                (Some(_), None) => unreachable!("the arm before takes it"),
            };
            if !sum.is_zero() {
                unknowns.push((k, sum));
            }
        }
        Some(Self { dimension, unknowns, lost: false })
    }
}

/// Two units that should be equal and are not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conflict {
    /// Unit of the left side.
    pub left: String,
    /// Unit of the right side.
    pub right: String,
    /// Where the units involved were inferred, so that both sides of a contradiction can be shown.
    pub inferred: Vec<Inference>,
}

/// A unit that was inferred.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Inference {
    /// Label of the unknown.
    pub label: String,
    /// The unit.
    pub unit: String,
    /// The equation that settled it.
    pub origin: Origin,
}

/// Two systems of units in one model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MixedSystems {
    /// The unit that does not fit.
    pub unit: String,
    /// Its system.
    pub system: System,
    /// A unit of the other system that was declared before.
    pub other: String,
    /// The other system.
    pub other_system: System,
    /// Where the other one was declared.
    pub other_origin: Origin,
}

#[derive(Clone, Debug)]
struct Unknown {
    label: String,
    solution: Option<(UnitExpr, Origin)>,
}

/// All unknown units of a model and what is known about them.
#[derive(Clone, Debug, Default)]
pub struct Units {
    unknowns: Vec<Unknown>,
    system: Option<(System, String, Origin)>,
}

impl Units {
    /// No unknowns, no system yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The system of the units declared so far; SI where they do not decide.
    #[must_use]
    pub fn system(&self) -> System {
        self.system.as_ref().map_or(System::Si, |s| s.0)
    }

    /// A declared unit. The first one that belongs to one system alone decides for the model.
    ///
    /// # Errors
    /// Where the unit belongs to another system than those declared before.
    pub fn declare(&mut self, unit: &Unit, origin: Origin) -> Result<UnitExpr, MixedSystems> {
        if let Some(system) = unit.system {
            match &self.system {
                None => self.system = Some((system, unit.text.clone(), origin)),
                Some((other, text, at)) if *other != system => {
                    return Err(MixedSystems {
                        unit: unit.text.clone(),
                        system,
                        other: text.clone(),
                        other_system: *other,
                        other_origin: *at,
                    });
                }
                Some(_) => {}
            }
        }
        Ok(UnitExpr::known(unit.dimension))
    }

    /// A new unknown unit: of an undeclared quantity (label: its name), or of the literal 0, which has any
    /// unit (label: `0`).
    pub fn unknown(&mut self, label: &str) -> UnitExpr {
        let k = u32::try_from(self.unknowns.len()).expect("four billion unknowns do not fit into memory");
        self.unknowns.push(Unknown { label: label.to_owned(), solution: None });
        UnitExpr { dimension: Dimension::ONE, unknowns: vec![(k, Exponent::ONE)], lost: false }
    }

    /// Demands that two units are the same, and infers an unknown from it where one is left.
    ///
    /// # Errors
    /// Where they differ whatever the unknowns are.
    pub fn equate(&mut self, left: &UnitExpr, right: &UnitExpr, origin: Origin) -> Result<(), Conflict> {
        let Some(ratio) = self.resolve(&left.div(right)) else { return Ok(()) };
        // The youngest unknown is the least interesting one: a literal, an intermediate.
        let Some((k, e)) = ratio.unknowns.last().copied() else {
            return if ratio.dimension.is_one() { Ok(()) } else { Err(self.conflict(left, right)) };
        };
        let own = UnitExpr { dimension: Dimension::ONE, unknowns: vec![(k, Exponent::ONE)], lost: false };
        // ratio = rest·uᵉ = 1, so u = rest^(−1/e) = u·ratio^(−1/e).
        let solution = Exponent::integer(-1).over(e).and_then(|x| own.times(&ratio, x));
        let Some(solution) = solution else { return Ok(()) };
        for i in 0..self.unknowns.len() {
            let Some((old, at)) = self.unknowns[i].solution.clone() else { continue };
            if let Some((_, power)) = old.unknowns.iter().find(|(j, _)| *j == k) {
                let swap = solution.times(&own, Exponent::integer(-1));
                let replaced = swap.and_then(|swap| old.times(&swap, *power)).unwrap_or(UnitExpr::LOST);
                self.unknowns[i].solution = Some((replaced, at));
            }
        }
        self.unknowns[k as usize].solution = Some((solution, origin));
        Ok(())
    }

    /// With solved unknowns replaced; `None` where exponents do not fit.
    fn resolve(&self, unit: &UnitExpr) -> Option<UnitExpr> {
        let mut out = UnitExpr { unknowns: Vec::new(), ..unit.clone() };
        for (k, e) in &unit.unknowns {
            let own;
            let value = match self.unknowns.get(*k as usize).and_then(|u| u.solution.as_ref()) {
                Some((solution, _)) => solution,
                None => {
                    own = UnitExpr {
                        dimension: Dimension::ONE,
                        unknowns: vec![(*k, Exponent::ONE)],
                        lost: false,
                    };
                    &own
                }
            };
            out = out.times(value, *e)?;
        }
        (!out.lost).then_some(out)
    }

    /// The dimension of a unit, where nothing in it is unknown any more.
    #[must_use]
    pub fn dimension(&self, unit: &UnitExpr) -> Option<Dimension> {
        self.resolve(unit).filter(|u| u.unknowns.is_empty()).map(|u| u.dimension)
    }

    /// Readable text in the model's system; unknown factors as `[label]`.
    #[must_use]
    pub fn text(&self, unit: &UnitExpr) -> String {
        let Some(unit) = self.resolve(unit) else { return "?".to_owned() };
        let known = unit.dimension.text(self.system());
        if unit.unknowns.is_empty() {
            return known;
        }
        let labels: Vec<(String, Exponent)> = unit
            .unknowns
            .iter()
            .map(|(k, e)| (format!("[{}]", self.unknowns[*k as usize].label), *e))
            .collect();
        let mut factors: Vec<(&str, Exponent)> = labels.iter().map(|(l, e)| (l.as_str(), *e)).collect();
        let grouped = if known.contains(['*', '/']) { format!("({known})") } else { known.clone() };
        if known != "1" {
            factors.insert(0, (&grouped, Exponent::ONE));
        }
        write_product(&factors)
    }

    fn conflict(&self, left: &UnitExpr, right: &UnitExpr) -> Conflict {
        let mut inferred: Vec<Inference> = Vec::new();
        let both = left.unknowns.iter().chain(&right.unknowns);
        for (k, _) in both {
            let unknown = &self.unknowns[*k as usize];
            let Some((solution, origin)) = &unknown.solution else { continue };
            let inference =
                Inference { label: unknown.label.clone(), unit: self.text(solution), origin: *origin };
            if !inferred.contains(&inference) {
                inferred.push(inference);
            }
        }
        Conflict { left: self.text(left), right: self.text(right), inferred }
    }
}

#[cfg(test)]
mod tests {
    use super::{Dimension, Exponent, Origin, Unit, UnitExpr, Units};

    fn declared(units: &mut Units, text: &str) -> UnitExpr {
        units.declare(&Unit::parse(text).unwrap().unwrap(), Origin(0)).unwrap()
    }

    #[test]
    fn stiffness_is_inferred_from_the_energy_that_it_makes() {
        let mut units = Units::new();
        let (k, x) = (units.unknown("k"), declared(&mut units, "m"));
        let energy = k.mul(&x.pow(Exponent::integer(2)));
        assert_eq!(units.text(&energy), "m^2*[k]");
        units.equate(&energy, &UnitExpr::known(Dimension::ENERGY), Origin(7)).unwrap();
        assert_eq!(units.text(&k), "N/m");
        let conflict = units.equate(&k, &x, Origin(8)).unwrap_err();
        assert_eq!((conflict.left.as_str(), conflict.right.as_str()), ("N/m", "m"));
        assert_eq!(conflict.inferred[0].label, "k");
        assert_eq!(conflict.inferred[0].origin, Origin(7));
    }

    #[test]
    fn chains_of_unknowns_are_solved_in_any_order() {
        let mut units = Units::new();
        let (a, b, c) = (units.unknown("a"), units.unknown("b"), units.unknown("c"));
        let metre = declared(&mut units, "m");
        units.equate(&a.mul(&a), &b, Origin(1)).unwrap();
        units.equate(&c, &b.mul(&a), Origin(2)).unwrap();
        assert_eq!(units.dimension(&c), None);
        units.equate(&c, &metre.pow(Exponent::integer(6)), Origin(3)).unwrap();
        assert_eq!(units.text(&a), "m^2");
        assert_eq!(units.text(&b), "m^4");
        assert_eq!(units.dimension(&c.pow(Exponent::HALF)), Dimension::LENGTH.pow(Exponent::integer(3)));
    }

    #[test]
    fn zero_has_any_unit_but_only_one_at_a_time() {
        let mut units = Units::new();
        let (metre, second) = (declared(&mut units, "m"), declared(&mut units, "s"));
        let zero = units.unknown("0");
        units.equate(&zero, &metre, Origin(0)).unwrap();
        assert!(units.equate(&zero, &second, Origin(0)).is_err());
        let other = units.unknown("0");
        units.equate(&second, &other, Origin(0)).unwrap();
    }

    #[test]
    fn two_systems_in_one_model_are_refused() {
        let mut units = Units::new();
        declared(&mut units, "rad");
        declared(&mut units, "slug");
        let mixed = units.declare(&Unit::parse("m/s").unwrap().unwrap(), Origin(3)).unwrap_err();
        assert_eq!((mixed.unit.as_str(), mixed.other.as_str()), ("m/s", "slug"));
        assert_eq!(units.text(&UnitExpr::known(Dimension::ENERGY)), "ft*lb");
    }

    #[test]
    fn exponents_beyond_all_reason_are_not_checked_rather_than_wrong() {
        let mut units = Units::new();
        let mut x = declared(&mut units, "m");
        for _ in 0..4 {
            x = x.pow(Exponent::integer(i32::MAX));
        }
        assert_eq!(units.text(&x), "?");
        units.equate(&x, &UnitExpr::ONE, Origin(0)).unwrap();
    }
}
