//! Warnings judged: random motions beside tight references. `docs/warnings-judged.md` has the table; a seeded
//! share of it is made here. `JUDGED=4000 cargo test --release -p dynamics-slow-tests --test runtime judged
//! --
//! --nocapture` makes as many motions.

use crate::common;
mod models;
mod verdict;

use dynamics_runtime::simulate::Simulate as _;
use models::*;
use verdict::{Judged, Row, Table, judge};

/// Motions of the test suite, and how many of them may be beyond ten tolerances.
const SEEDED: u64 = 60;
const BEYOND: usize = 22; // As measured: none more.

/// Motion `seed` of a study.
fn motion(seed: u64) -> Option<Judged> {
    let mut dice = Dice(seed.wrapping_mul(0x2545_f491_4f6c_dd1d));
    let kind = dice.below(20);
    let dice = &mut dice;
    match kind {
        0..=6 => judge(&of_one(dice), dice),
        7..=10 => judge(&of_two(dice), dice),
        11 | 12 => judge(&of_three(dice), dice),
        13 => judge(&of_eight(dice), dice),
        14 => judge(&of_twenty(dice), dice),
        15 | 16 => judge(&of_bodies(dice), dice),
        17 => judge(&of_sleighs(dice), dice),
        18 => judge(&of_rods(dice), dice),
        _ => judge(&of_loops(dice), dice),
    }
}

/// So many of these motions, one after the other.
fn study(first: u64, count: u64) -> Table {
    let mut table = Table::default();
    for seed in first..first + count {
        if let Some(judged) = motion(seed) {
            table.add(seed, judged);
        }
    }
    table
}

#[test]
fn warnings_are_neither_missing_nor_false() {
    let number = |name: &str, or: u64| std::env::var(name).map_or(or, |text| text.parse().expect("a number"));
    let count = number("JUDGED", SEEDED);
    let table = study(number("JUDGED_FROM", 0), count);
    println!("{table}");
    if count == SEEDED {
        let Row { beyond, silent, alarms, .. } = table.rows["all"];
        assert!(beyond <= BEYOND, "{table}");
        assert_eq!((silent, alarms), (0, 0), "errors that nobody told of, and false alarms:\n{table}");
    }
}

/// Works that are missed in the moments in which a relaxation oscillation falls stay in their account, and
/// are no drift of a motion that half steps agree with otherwise.
#[test]
fn work_that_is_missed_in_a_moment_is_no_drift() {
    let judged = motion(3594).expect("a motion that runs");
    assert!(judged.name == "van der Pol" && judged.error < 2.0 && judged.shown > 100.0, "{}", judged.error);
    assert!(judged.warnings.iter().all(|warning| !warning.contains("energy")), "{:?}", judged.warnings);
}

/// A parallelogram passes the positions in which its bars lie in a line: coefficients that are large for a
/// moment are no growth.
#[test]
fn singular_positions_are_no_unstable_rests() {
    for (speed, tolerance) in [(3.0, 1e-6), (9.0, 1e-9), (30.0, 1e-9), (9.0, 5e-13)] {
        let start = common::at_rest_or_not([1.0, 0.0, 1.0], [speed, 0.0, speed]);
        let parallelogram = common::constrained::FourBar::PARALLELOGRAM;
        let motion =
            parallelogram.simulate(start).until(3.0).tolerance(tolerance).run().expect("it goes through");
        let summary = motion.verify();
        assert!(
            summary.accuracy.missed_instability.is_none() && summary.accuracy.undersampled_force.is_none(),
            "{summary}"
        );
    }
}

/// Attitudes in Euler parameters, which are off by 300 to 1,400 tolerances: the heavy top of Brüls and
/// Cardona (J. Comput. Nonlinear Dyn. 5 (2010) 031002), its axis level at first, and free bodies, one beside
/// a turn about its intermediate axis. Summaries say by how many.
#[test]
fn errors_of_attitudes_are_told() {
    let body = |a, b, c, weight| EulerBody { inertia: [a, b, c].into(), weight };
    let top = body(15.234375, 15.234375, 0.46875, 15.0 * 9.81);
    let scenes = [
        ("heavy top", top, top.turning([0.0, 4.61538, 150.0], [1.0, 1.0, 0.0, 0.0]), 2.0),
        ("free body", body(1.0, 2.0, 2.5, 0.0), top.turning([2.0, 0.6, 0.8], [1.0, 0.0, 0.0, 0.0]), 50.0),
        (
            "flipping body",
            body(1.0, 2.0, 3.0, 0.0),
            top.turning([1e-3, 1.0, 1e-3], [1.0, 0.0, 0.0, 0.0]),
            10.0,
        ),
    ];
    for (name, model, start, until) in scenes {
        let exact =
            model.simulate(start).until(until).tolerance(1e-13).run().expect("nothing is singular").end();
        for tolerance in [1e-6, 1e-8, 1e-10] {
            let motion =
                model.simulate(start).until(until).tolerance(tolerance).run().expect("nothing is singular");
            let (error, steps) = (verdict::apart(&motion.end(), &exact, tolerance), motion.counts().steps);
            println!("{name} at {tolerance:e}: {error:.1} tolerances, {steps} steps");
            let summary = motion.verify();
            let (shown, text) = (summary.accuracy.step_doubling.expect("half steps"), summary.to_string());
            assert!(error < 2.0 * shown, "{name} at {tolerance:e}: {error:.1} tolerances\n{text}");
            assert_eq!(text.contains("global error about"), shown > 10.0, "{text}");
            assert_eq!(
                shown > 10.0,
                name != "flipping body",
                "{name} at {tolerance:e}: {error:.1} tolerances"
            );
        }
    }
}
