//! Warnings judged: random motions beside tight references. `docs/when-methods-fail.md` has the table; a seeded share of it is made here.
//! `JUDGED=4000 cargo test --release -p dynamics-runtime --test judged -- --nocapture` makes as many motions.

#[path = "../common/mod.rs"]
mod common;
mod models;
mod verdict;

use dynamics_runtime::motion::Simulate as _;
use models::*;
use verdict::{Judged, Row, Table, judge};

/// Motions of the test suite, and what may be found among them: beyond ten tolerances, of these not told of, and warnings within ten.
const SEEDED: u64 = 60;
const BEYOND: usize = 4;
const SILENT: usize = 0;
const ALARMS: usize = 0;

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
        assert!(beyond <= BEYOND && silent <= SILENT && alarms <= ALARMS, "{table}");
    }
}

/// A parallelogram passes the positions in which its bars lie in a line: coefficients that are large for a moment are no growth.
#[test]
fn singular_positions_are_no_unstable_rests() {
    for (speed, tolerance) in [(3.0, 1e-6), (9.0, 1e-9), (30.0, 1e-9), (9.0, 5e-13)] {
        let start = common::at_rest_or_not([1.0, 0.0, 1.0], [speed, 0.0, speed]);
        let parallelogram = common::constrained::FourBar::PARALLELOGRAM;
        let motion = parallelogram.simulate(start).until(3.0).tolerance(tolerance).run().expect("it goes through");
        let summary = motion.summary();
        assert!(summary.doubts.outgrown.is_none() && summary.doubts.unseen.is_none(), "{summary}");
    }
}
