//! Corners of what holds by a rule: belts and floors whose speed or place jumps. What sticks slips, what
//! rests is hit or falls, and nothing else is refused.

use std::fmt::Debug;

use dynamics::prelude::*;

mod belts;
mod floors;
mod grounds;
mod late;
use crate::parcel;

const NEVER: f64 = 1e300;

const FORMULATIONS: [Formulation; 5] = [
    Formulation::Projected,
    Formulation::Embedded,
    Formulation::Augmented,
    Formulation::BaumgarteTied,
    Formulation::Baumgarte { alpha: 5.0, beta: 5.0 },
];

/// Motions over a contact by adaptive and by fixed steps in every formulation; what they are judged by gets
/// the case and its tolerance.
fn in_all_ways<M: Simulate + Debug>(
    model: &M,
    (start, end): (M::State, f64),
    (name, restitution): (&str, f64),
    check: impl Fn(&str, f64, &Motion<'_, M>),
) {
    for formulation in FORMULATIONS {
        let run = || model.simulate(start).until(end).formulation(formulation).contact(name, restitution);
        let adaptive = [1e-6, 1e-10].map(|tolerance| (run().tolerance(tolerance), tolerance, tolerance));
        let fixed = [0.007, 0.04].map(|h| (run().method(methods::Rk4).fixed_step(h), h, 1e-9));
        for (run, by, tolerance) in adaptive.into_iter().chain(fixed) {
            let case = format!("{model:?} {restitution} {formulation} {by:e}");
            let motion = run.run().unwrap_or_else(|e| panic!("{case}: {e}"));
            check(&case, tolerance, &motion);
        }
    }
}
