//! Models too large to be emitted are refused or served in part, with the numbers that say so.

mod common;

use common::{Builder, chain};
use dynamics_symbolic::check::Finding;
use dynamics_symbolic::compile::{LIMIT, compile};
use dynamics_symbolic::mechanics::EnergyRole;

#[test]
fn accelerations_beyond_the_limit_are_refused() {
    let findings = compile(chain(36)).expect_err("too large");
    let found = findings.iter().find_map(|f| match f {
        Finding::TooLarge { function, operations, limit } => Some((function.as_str(), *operations, *limit)),
        _ => None,
    });
    let (function, operations, limit) = found.expect("the size is what is wrong");
    assert_eq!((function, limit), ("accelerations", LIMIT));
    assert!(operations > LIMIT);
}

#[test]
fn jacobians_beyond_the_limit_are_withheld_and_the_rest_is_served() {
    let c = compile(chain(20)).expect("the accelerations are small enough");
    assert!(c.programs.accelerations.cost.total() < LIMIT);
    let excess = c.programs.jacobians.expect_err("the Jacobians are not");
    assert!(excess.operations > LIMIT);
    assert!(c.report.contains(&excess.function), "{}", c.report);
}

#[test]
fn hundreds_of_decoupled_coordinates_stay_cheap() {
    let mut b = Builder::new("Springs");
    let (m, k) = (b.parameter("m"), b.parameter("k"));
    let half = b.ratio(1, 2);
    let (mut kinetic, mut potential) = (b.g().zero(), b.g().zero());
    for x in b.coordinates("x", 60) {
        let t = b.kinetic(m, &[x]);
        kinetic = b.add(kinetic, t);
        let square = b.mul(x, x);
        let hk = b.mul(half, k);
        let v = b.mul(hk, square);
        potential = b.add(potential, v);
    }
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    b.energy("springs", EnergyRole::Potential, potential);
    let c = compile(b.model).expect("a good model");
    // −(k/m) x: one product and one sign each; the Jacobian is one constant.
    assert!(c.programs.accelerations.cost.total() <= 2 * 60, "{:?}", c.programs.accelerations.cost);
    assert!(c.programs.jacobians.expect("small").state.cost.total() <= 2 * 60 + 1);
}
