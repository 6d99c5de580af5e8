//! Families of models at many sizes, damped and undamped, as cases.

use crate::cases::{Case, Expectation};

#[allow(dead_code, reason = "shared with the tests of the macro")]
#[path = "../../../dynamics-macros/src/tests/sizes/families.rs"]
mod families;

use families::{FAMILIES, Family, SIZES};

/// Every family at all sizes up to this one.
pub fn families(largest: u64) -> Vec<Case> {
    let sizes = SIZES.into_iter().filter(|n| *n as u64 <= largest);
    let each = sizes.flat_map(|n| FAMILIES.iter().enumerate().map(move |(k, family)| (n, k, family)));
    each.flat_map(|(n, k, family)| [false, true].map(|damped| case(k, family, n, damped))).collect()
}

fn case(k: usize, family: &Family, n: usize, damped: bool) -> Case {
    let [declaration, block] = family.source(n, damped);
    let kind = if damped { "damped" } else { "undamped" };
    // A role stands in a line of its own, for the glue.
    let block = block.replace("#[", "\n#[").replace("] fn ", "]\n fn ");
    let text = format!(
        "// model: Subject {{ {} }}\nuse ::dynamics::prelude::*;\n#[derive(Clone, Debug, \
         Dynamics)]\n{declaration}\n#[dynamics]\n{block}\n",
        values(family, damped)
    );
    Case {
        module: format!("family_{k}_{n}_{kind}"),
        title: format!("{}, {n}, {kind}", family.name),
        text,
        expectation: Expectation::Runs,
        is_large: n > family.usual,
    }
}

/// The parameters with values of their own.
fn values(family: &Family, damped: bool) -> String {
    let fields = family.fields.split(", ").chain(damped.then_some("damping: f64"));
    let one = |(k, field): (usize, &str)| {
        let (name, ty) = field.split_once(": ").unwrap_or((field, "f64"));
        let own = 0.6 + 0.17 * k as f64;
        let value = match ty {
            "f64" => format!("{own:.2}"),
            "[f64; N]" => format!("::core::array::from_fn(|i| {own:.2} + 0.01 * i as f64)"),
            "Vec3<f64>" => format!("::dynamics::Vec3::new({own:.2}, -0.2, 0.7)"),
            "Mat3<f64>" => {
                "::dynamics::Mat3::from([[1.1, 0.1, 0.0], [0.1, 0.9, -0.2], [0.0, -0.2, 0.7]])".to_owned()
            }
            _ => format!(
                "::dynamics::prelude::{ty}::natural(&[-3.0, -1.0, 0.4, 3.0], &[0.3, -0.2, 0.4, \
                 0.1]).expect(\"knots that increase\")"
            ),
        };
        format!("{name}: {value}")
    };
    fields.enumerate().map(one).collect::<Vec<_>>().join(", ")
}
