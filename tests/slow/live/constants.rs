//! Constants that pages and the library have in common are equal: those of pages are copied by hand.

use dynamics::live::Live;
use dynamics::prelude::*;

use crate::double_pendulum::DoublePendulum;
use crate::engine::Engine;

/// A file of the library, and the constants that pages copy from it under the same names.
macro_rules! copied_from {
    ($($file:literal: $($name:ident)+;)+) => {
        [$((
            include_str!(concat!("../../../dynamics-runtime/src/", $file)),
            &[$(stringify!($name)),+] as &[&str],
        )),+]
    };
}

/// The value of a constant in a source: numbers and `f64::EPSILON`, multiplied and divided.
fn value(source: &str, name: &str) -> f64 {
    let line =
        source.lines().find_map(|line| line.split_once(&format!("const {name}: ")).map(|found| found.1));
    let (_, value) = line.unwrap_or_else(|| panic!("no constant {name}")).split_once('=').unwrap();
    let number = |text: &str| match text.trim() {
        "f64::EPSILON" => f64::EPSILON,
        text => text.replace('_', "").parse::<f64>().unwrap_or_else(|_| panic!("{name}: {text}")),
    };
    let product = |text: &str| text.split('*').map(number).product::<f64>();
    let mut parts = value.trim_end_matches(';').split('/');
    let first = product(parts.next().unwrap());
    parts.fold(first, |value, part| value / product(part))
}

#[test]
fn constants_are_those_of_rust() {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let engine = Engine::new(&Live::new(&model, model.state().build().unwrap()));
    let files = copied_from! {
        "constrain/assemble.rs": CONSISTENT;
        "constrain/impact.rs": MAX_SIDE_CHANGES REST_TOLERANCE CLOSING_ROUNDING;
        "integrate/stepper.rs": OFF_CONSTRAINT_ERROR;
        "integrate/stepper/singularity_crossing.rs":
            MAX_RETRIES RETRY_FACTOR UNUSUAL_DISAGREEMENT USUAL_CHANGE ROUNDING_DISAGREEMENT
            PREFERRED_CERTAINTY;
        "simulate/events/action.rs": NEGLIGIBLE_FRICTION JUMP_HALF_WIDTH AT_REST_RATE;
        "simulate/events/location.rs": EVENT_ROUNDING AT_REST_VALUE AT_ZERO;
        "simulate/events/restart.rs": FIRST_THETA LAST_THETA;
        "simulate/events/slip_direction.rs": REVERSAL_BISECTIONS;
        "simulate/events/zeno.rs":
            MAX_EVENTS_AT_ONE_INSTANT MIN_SUMMABLE_POWER MAX_ULPS_OF_ONE_INSTANT MIN_SHRINKING_INTERVALS
            ACCUMULATED_INTERVAL;
        "simulate/right_hand_side.rs": NEARLY_SINGULAR_CONDITION;
        "simulate/stabilization/contacts.rs": TOUCHING_GAP REST_SPEED HIDDEN_HOP_REST_SPEED;
    };
    for (source, names) in files {
        for name in names {
            assert_eq!(engine.run::<f64>(&format!("Number({name})")), value(source, name), "{name}");
        }
    }
}
