//! Models too large to be emitted are refused or served in part, with the numbers that say so.

use crate::common;

use common::mechanisms::n_four_bar;
use common::{Builder, Values, chain, rods};
use dynamics_symbolic::check::Finding;
use dynamics_symbolic::compile::{MOST_OPERATIONS, NoJacobians, compile};
use dynamics_symbolic::graph::{FunctionId, Number, Origin, Symbol};
use dynamics_symbolic::mechanics::{EnergyRole, Function, General, Model, Solution};

#[test]
fn accelerations_beyond_the_limit_are_refused() {
    // Of a Lagrangian that is given as a whole nothing tells which velocities are made of which.
    let mut model = chain(36);
    model.energies[0].role = EnergyRole::Lagrangian;
    let findings = compile(model).map(|c| c.report).expect_err("too large");
    let found = findings.iter().find_map(|f| match f {
        Finding::TooLarge { function, operations, limit } => Some((function.as_str(), *operations, *limit)),
        _ => None,
    });
    let (function, operations, limit) = found.expect("the size is what is wrong");
    assert_eq!((function, limit), ("accelerations", MOST_OPERATIONS));
    assert!(operations > MOST_OPERATIONS);
}

/// The same chain with its cart held: what is left to the general solver at run time is small enough.
#[test]
fn solutions_beyond_the_limit_are_left_to_the_general_solver() {
    let mut b = Builder { model: chain(36) };
    let x = b.g().symbol(Symbol::Coordinate(0));
    b.holonomic("held", &[x]);
    let c = compile(b.model).expect("M, Q, Φ_q and γ are small enough");
    let derived = c.equations.constraints.as_ref().expect("there is one");
    let Solution::General(General::TooLarge(operations)) = derived.solution else {
        panic!("{:?}", derived.solution)
    };
    assert!(operations > MOST_OPERATIONS);
    assert!(matches!(c.programs.jacobians, Err(NoJacobians::General)));
    assert!(c.report.contains(&operations.to_string()), "{}", c.report);
    let programs = c.programs.constraints.as_ref().expect("there is one");
    assert!(programs.terms.cost.total() < MOST_OPERATIONS / 2 && programs.correction.is_none());
}

/// A long chain in angles: no M, accelerations in operations proportional to the links. They satisfy
/// M q̈ = Q for M written down by hand, Mᵢⱼ = lᵢ lⱼ cos(θᵢ − θⱼ) Σ m of all links beyond both, and the
/// product that stands for M is that matrix.
#[test]
fn long_chains_do_without_their_mass_matrix() {
    let [small, large] = [100, 200].map(|n| compile(chain(n)).expect("M is left out, nothing else is"));
    let operations = [&small, &large].map(|c| c.programs.accelerations.cost.total());
    assert!(operations[1] < 2 * operations[0] + 50 && operations[1] < 25 * 200, "{operations:?}");
    let c = small;
    assert!(c.equations.mass_matrix.is_empty() && c.programs.mass_matrix.results.is_empty());
    assert!(matches!(c.programs.jacobians, Err(NoJacobians::NoMassMatrix)) && c.programs.series.is_err());
    assert!(c.report.contains("left out") && c.equations_text.contains("left out"), "{}", c.report);
    let n = 100;
    let varied = |k: f64| (0..=n).map(move |i| (k * i as f64 + 0.3 * k).sin()).collect::<Vec<f64>>();
    let parameters: Vec<f64> = (0..2 * n + 2).map(|i| 0.5 + (i % 7) as f64 / 10.0).collect();
    let mut state =
        Values { q: varied(1.7), u: varied(2.3), a: varied(0.9), p: parameters, ..Values::default() };
    let g = &c.model.graph;
    // Cart, masses, lengths; the cart is a link that turns everything beyond by x.
    let mass = |i: usize| state.p[i];
    let beyond = |i: usize| (i..=n).map(mass).sum::<f64>();
    let [direction, length]: [Vec<f64>; 2] = [
        (0..=n).map(|i| if i == 0 { 0.0 } else { state.q[i] }).collect(),
        (0..=n).map(|i| if i == 0 { 1.0 } else { state.p[n + i] }).collect(),
    ];
    let element =
        |i: usize, j: usize| length[i] * length[j] * (direction[i] - direction[j]).cos() * beyond(i.max(j));
    let times = |a: &[f64]| -> Vec<[f64; 2]> {
        let terms = |i: usize| (0..=n).map(move |j| element(i, j) * a[j]).collect::<Vec<f64>>();
        let sums = |i| terms(i).iter().fold([0.0, 0.0], |[sum, size], x| [sum + x, size + x.abs()]);
        (0..=n).map(sums).collect()
    };
    let values = g.evaluate(&c.equations.mass_product, &state);
    for (node, [expected, size]) in c.equations.mass_product.iter().zip(times(&state.a)) {
        assert!((values[node.index()] - expected).abs() <= 1e-13 * size);
    }
    let found =
        g.evaluate(&[&c.equations.accelerations[..], &c.equations.generalized_force].concat(), &state);
    let accelerations: Vec<f64> = c.equations.accelerations.iter().map(|a| found[a.index()]).collect();
    let expected = times(&accelerations);
    state.a = accelerations;
    for (force, [sum, size]) in c.equations.generalized_force.iter().zip(expected) {
        assert!((found[force.index()] - sum).abs() <= 1e-11 * size, "{sum} of {size}");
    }
}

/// Without M its columns are looked at: a negative mass at the end is found at its nominal value.
#[test]
fn a_long_chain_with_a_negative_mass_is_refused() {
    let n = 100;
    let nominal = |last: f64| (0..2 * n + 2).map(|i| (i as u32, if i == n { last } else { 1.0 })).collect();
    let found = |last: f64| {
        let model = Model { nominal: nominal(last), ..chain(n) };
        compile(model).map(|c| c.equations.mass_matrix.is_empty())
    };
    let findings = found(-10.0).expect_err("negative inertia");
    assert!(
        findings.iter().any(|f| matches!(f, Finding::NegativeInertia { nominal: true, .. })),
        "{findings:?}"
    );
    assert!(matches!(found(1.0), Ok(true)));
}

/// Where nothing solves the equations without M, a large M is refused, and not only after it was factored.
#[test]
fn a_mass_matrix_that_cannot_be_left_out_is_refused() {
    let mut b = Builder { model: chain(100) };
    let (x, t) = (b.g().symbol(Symbol::Coordinate(0)), b.g().symbol(Symbol::Time));
    let (m, sine) = (b.parameter("shaken"), b.sin(t));
    let sum = b.add(x, sine);
    let shaken = b.kinetic(m, &[sum]);
    let total = b.model.energies[0].node;
    b.model.energies[0].node = b.add(total, shaken);
    let findings = compile(b.model).map(|c| c.report).expect_err("too large");
    assert!(
        findings
            .iter()
            .any(|f| matches!(f, Finding::TooLarge { operations, .. } if *operations > MOST_OPERATIONS)),
        "{findings:?}"
    );
}

/// Pinned rods are solved in operations proportional to their number, whatever their number.
#[test]
fn pinned_rods_grow_linearly() {
    let sizes = [30, 60, 120].map(|n| {
        let c = compile(rods(n)).expect("a good model");
        (c.programs.accelerations.cost.total(), c.model.graph.len())
    });
    let grows = |a: usize, b: usize| b < 2 * a + a / 4;
    assert!(grows(sizes[0].0, sizes[1].0) && grows(sizes[1].0, sizes[2].0), "{sizes:?}");
    assert!(grows(sizes[1].1, sizes[2].1), "nodes that deriving leaves behind: {sizes:?}");
}

/// A sparse mechanism in absolute coordinates costs in proportion to its size, and so do its equations before
/// they are solved.
#[test]
fn rows_of_four_bars_grow_linearly() {
    let sizes = [4, 8].map(|loops| {
        let c = compile(n_four_bar(loops).closed()).expect("a good model");
        let programs = c.programs.constraints.as_ref().expect("it has constraints");
        assert!(programs.correction.is_some(), "{loops}: unrolled");
        (c.programs.accelerations.cost.total(), programs.terms.cost.total())
    });
    let [(small, few), (large, many)] = sizes;
    assert!(large < 2 * small + small / 4 && many < 2 * few + few / 4, "{sizes:?}");
}

#[test]
fn jacobians_beyond_the_limit_are_withheld_and_the_rest_is_served() {
    let c = compile(chain(20)).expect("the accelerations are small enough");
    assert!(c.programs.accelerations.cost.total() < MOST_OPERATIONS);
    let Err(NoJacobians::TooLarge(excess)) = c.programs.jacobians else { panic!("the Jacobians are not") };
    assert!(excess.operations > MOST_OPERATIONS);
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

/// Coordinates are distances between neighbours, so that M is tridiagonal and constant: it is factored once
/// per model, and the solve grows with n, not with n².
#[test]
fn a_constant_banded_mass_matrix_is_factored_once_per_model() {
    let cost = |n: usize| {
        let mut b = Builder::new("Band");
        let m = b.parameter("m");
        let x = b.coordinates("x", n);
        let mut kinetic = b.kinetic(m, &[x[0]]);
        for pair in x.windows(2) {
            let difference = b.sub(pair[1], pair[0]);
            let k = b.kinetic(m, &[difference]);
            kinetic = b.add(kinetic, k);
        }
        let mut potential = b.g().zero();
        for q in &x {
            let c = b.cos(*q);
            potential = b.add(potential, c);
        }
        b.energy("kinetic", EnergyRole::Kinetic, kinetic);
        b.energy("potential", EnergyRole::Potential, potential);
        let c = compile(b.model).expect("a good model");
        let cost = c.programs.accelerations.cost;
        assert_eq!(cost.divisions, 0, "every reciprocal of a pivot is hoisted");
        cost.total()
    };
    let (ten, forty) = (cost(10), cost(40));
    assert!(forty <= 4 * ten + 20 && forty <= 6 * 40, "{ten} {forty}");
}

#[test]
fn a_smooth_function_is_not_differentiated_more_than_three_times() {
    let mut b = Builder::new("Slope");
    let x = b.coordinate("x");
    b.model.functions.push(Function { name: "track".into(), unit: String::new(), origin: Origin(7) });
    // V = f″(x), f″ got at by dividing velocities out: the force takes f‴, its derivative would take a
    // fourth.
    let bend = b.g().smooth(FunctionId(0), 2, x);
    let m = b.parameter("m");
    let kinetic = b.kinetic(m, &[x]);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    b.energy("potential", EnergyRole::Potential, bend);
    let found = compile(b.model).expect_err("a fourth derivative");
    assert_eq!(found, [Finding::TooManyDerivatives { name: "track".into(), origin: Origin(7) }]);
}

#[test]
fn products_of_numbers_beyond_f64_end() {
    // 4·2¹⁰²³ is no f64 and stays a product, which no rule may take apart and put together again for ever.
    let mut b = Builder::new("Huge");
    let (p, x) = (b.parameter("p"), b.coordinate("x"));
    let large = b.g().number(Number::Float(2f64.powi(1023)));
    let four = b.ratio(4, 1);
    let beyond = b.mul(four, large);
    for symbol in [p, x] {
        let (product, inside) = (b.mul(beyond, symbol), b.mul(large, symbol));
        let around = b.mul(four, inside);
        let again = b.mul(around, beyond);
        let sum = b.add(product, again);
        let doubled = b.add(sum, sum);
        assert_eq!(product, around);
        assert!(!b.g().is_zero(doubled));
    }
}

#[test]
fn integers_beyond_the_modulus_of_fingerprints_are_told_apart() {
    let mut b = Builder::new("Modulus");
    let modulus = (1i64 << 61) - 1;
    for n in [modulus, modulus + 1, -modulus, 1 << 60, (1 << 60) - 1] {
        let (large, reduced) = (b.g().integer(n), b.g().integer(n % modulus));
        let (above, below) = (b.g().integer(n / 2 + 1), b.g().integer(n / 2 + 1 - modulus));
        assert!(n.abs() < modulus || large != reduced, "{n}");
        assert_ne!(above, below, "{n}");
        assert!(!b.g().is_zero(large) && !b.g().is_one(large), "{n}");
    }
}

#[test]
fn a_fourth_derivative_that_only_the_energy_shows_is_found() {
    let mut b = Builder::new("Driven");
    let x = b.coordinate("x");
    let t = b.g().symbol(Symbol::Time);
    b.model.functions.push(Function { name: "track".into(), unit: String::new(), origin: Origin(7) });
    let fourth = b.g().smooth(FunctionId(0), 4, t);
    let m = b.parameter("m");
    let kinetic = b.kinetic(m, &[x]);
    let potential = b.add(fourth, x);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    b.energy("potential", EnergyRole::Potential, potential);
    let found = compile(b.model).expect_err("a fourth derivative");
    assert_eq!(found, [Finding::TooManyDerivatives { name: "track".into(), origin: Origin(7) }]);
}

#[test]
fn powers_of_two_are_not_taken_for_one() {
    use dynamics_symbolic::graph::{Graph, Number, Symbol};
    let mut g = Graph::new();
    let p = g.symbol(Symbol::Parameter(0));
    // 2³¹ · (2³⁰ · p), literal by literal: modulo a Mersenne prime this would be p.
    for (high, low) in [(31, 30), (60, 1), (59, 2), (40, 21)] {
        let [high, low] = [high, low].map(|n| g.number(Number::integer(1 << n)));
        let inner = g.mul(low, p);
        let product = g.mul(high, inner);
        assert_ne!(g.fingerprint(product), g.fingerprint(p));
    }
}
