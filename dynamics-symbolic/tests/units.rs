//! Units: parsing never panics, the algebra obeys its laws, inference finds what was put in.

use dynamics_symbolic::check::units::{Dimension, Exponent, System, Unit, UnitExpr, Units};
use dynamics_symbolic::graph::Origin;
use proptest::prelude::*;

const NAMES: [&str; 12] = ["m", "kg", "s", "N", "J", "W", "Pa", "rad", "A", "V", "K", "Hz"];

fn dimension(text: &str) -> Dimension {
    Unit::parse(text).expect("a unit").expect("not to be inferred").dimension
}

/// A product of powers of named units, as text and as (name, exponent) pairs.
fn product() -> impl Strategy<Value = Vec<(usize, i32)>> {
    prop::collection::vec((0..NAMES.len(), prop_oneof![-3..0, 1..4]), 1..5)
}

fn written(factors: &[(usize, i32)]) -> String {
    let all: Vec<String> = factors.iter().map(|(i, e)| format!("{}^{e}", NAMES[*i])).collect();
    all.join("*")
}

fn exponent() -> impl Strategy<Value = Exponent> {
    (prop_oneof![-4i128..0, 1i128..5], 1i128..4).prop_map(|(n, d)| Exponent::ratio(n, d).expect("small"))
}

proptest! {
    #[test]
    fn any_text_is_a_unit_or_an_error_within_it(text in "[ a-zA-Z0-9*/^()._-]{0,40}") {
        match Unit::parse(&text) {
            Ok(_) => {}
            Err(error) => prop_assert!(error.token() <= text.len()),
        }
    }

    #[test]
    fn any_tokens_are_a_unit_or_an_error(tokens in prop::collection::vec(".{0,6}", 0..12)) {
        let _ = Unit::parse_tokens(&tokens);
    }

    /// What is printed, in SI, reads back as the same dimension.
    #[test]
    fn printed_units_read_back(factors in product()) {
        let d = dimension(&written(&factors));
        prop_assert_eq!(dimension(&d.text(System::Si)), d);
    }

    #[test]
    fn mechanical_units_read_back_in_both_systems(l in -4..5, m in -4..5, t in -4..5) {
        let d = Dimension::mechanical(l, m, t);
        for system in [System::Si, System::UsCustomary] {
            let text = d.text(system);
            prop_assert_eq!(dimension(&text), d, "{}", text);
        }
    }

    /// Unknown units of three quantities are found from three equations that determine them.
    #[test]
    fn unknowns_are_found(
        own in prop::array::uniform3(product()),
        e in prop::array::uniform3(prop::array::uniform3(exponent())),
    ) {
        let mut units = Units::new();
        let truth = own.map(|f| dimension(&written(&f)));
        let unknown = ["a", "b", "c"].map(|n| units.unknown(n));
        for row in &e {
            let left = (0..3).fold(UnitExpr::ONE, |p, k| p.mul(&unknown[k].pow(row[k])));
            let right = (0..3).try_fold(Dimension::ONE, |p, k| p.mul(&truth[k].pow(row[k])?)).expect("small");
            prop_assert!(units.equate(&left, &UnitExpr::known(right), Origin(0)).is_ok(), "true equations do \
                not conflict");
        }
        for k in 0..3 {
            // Where the equations determine it, it is the right one.
            if let Some(found) = units.dimension(&unknown[k]) {
                prop_assert_eq!(found, truth[k]);
            }
            prop_assert!(units.equate(&unknown[k], &UnitExpr::known(truth[k]), Origin(1)).is_ok());
        }
        for k in 0..3 {
            let wrong = truth[k].mul(&Dimension::LENGTH).expect("small");
            prop_assert!(units.equate(&unknown[k], &UnitExpr::known(wrong), Origin(2)).is_err());
        }
    }

    #[test]
    fn powers_and_products_are_a_group(f in product(), g in product(), e in exponent()) {
        let [a, b] = [f, g].map(|x| UnitExpr::known(dimension(&written(&x))));
        prop_assert_eq!(a.mul(&b).pow(e), a.pow(e).mul(&b.pow(e)));
        prop_assert_eq!(a.mul(&b).div(&b), a.clone());
        prop_assert_eq!(a.pow(e).pow(Exponent::ONE.over(e).expect("not zero")), a);
    }
}
