//! End values against published problems; the values are closed forms or were computed in multiple precision
//! by two formulations, and hold to all digits printed.

use crate::common;

use common::*;
use dynamics_runtime::methods;
use dynamics_runtime::simulate::Simulate;

/// Largest |difference| between a state and (q, u).
fn error<const N: usize>(state: &PlainState<N, 0>, q: [f64; N], u: [f64; N]) -> f64 {
    let pairs = state.q.iter().zip(q).chain(state.u.iter().zip(u));
    pairs.map(|(x, reference)| (x - reference).abs()).fold(0.0, f64::max)
}

/// Planar double pendulum, θ = (2π/3, −π/18) at rest (Levien, Tan, Am. J. Phys. 61 (1993) 1038).
#[test]
fn double_pendulum() {
    let start = at_rest_or_not([2.0 * std::f64::consts::PI / 3.0, -std::f64::consts::PI / 18.0], [0.0, 0.0]);
    let references = [
        (1.0, [-1.517290485027184, 0.2527915797168139], [-1.9844676969329387, -4.087371261679003], 1e-12),
        (2.0, [1.1528460961788194, -0.47307638064164204], [-0.030451144544655827, 5.79953526363157], 1e-12),
        (5.0, [-0.44021974536666475, 7.049578950150241], [-3.52113897832026, -3.9088281777737452], 1e-11),
        (10.0, [-0.7925961165987995, -2.4694945097592718], [-1.9758098813438534, -2.3806311931408177], 1e-9),
        (20.0, [-0.5317385636317109, -5.014305231077322], [4.524457260308953, 1.215802845560709], 1e-5),
    ];
    let motion = DoublePendulum::UNIT.simulate(start).until(20.0).tolerance(1e-14).run().unwrap();
    for (t, q, u, tolerance) in references {
        let found = error(&motion.at(t), q, u);
        println!("double pendulum t = {t}: {found:.2e}");
        assert!(found < tolerance, "error {found:e} at t = {t}");
    }
}

/// Kepler, e = 0.9 (Hairer, Lubich, Wanner, Geometric Numerical Integration, §I.2); Kepler's equation solved
/// to 60 digits.
#[test]
fn kepler() {
    let start = at_rest_or_not([0.1, 0.0], [0.0, 19f64.sqrt()]);
    let references = [
        (1.0, [-1.1871884663458634, 0.41752763873976423], [-0.7611420105214913, -0.09947204787027349], 1e-12),
        (
            10.0,
            [-1.8538537094055791, -0.13088540483992556],
            [0.16156945255843133, -0.2237192767918971],
            1e-11,
        ),
        (20.0, [-1.2952662509875743, 0.4003938963792322], [-0.6775390924707566, -0.12708381542786862], 1e-11),
        (100.0, [-0.7506333330296452, -0.4310000275773213], [1.1423476744354137, 0.07521912809626714], 1e-9),
    ];
    let motion = Kepler.simulate(start).until(100.0).tolerance(1e-14).run().unwrap();
    for (t, q, u, tolerance) in references {
        let found = error(&motion.at(t), q, u);
        println!("Kepler t = {t}: {found:.2e}");
        assert!(found < tolerance, "error {found:e} at t = {t}");
    }
    let summary = motion.verify();
    println!("{summary}");
    assert!(summary.energy_drift < 1e-12);
    assert!(summary.conserved[0].largest < 1e-11);
}

/// Arenstorf's orbit (Hairer, Nørsett, Wanner, Solving ODE I, p. 129): one period amplifies errors about 10⁸
/// times.
#[test]
fn arenstorf() {
    let period = 17.065216560157964;
    let model = Arenstorf { mu: 0.012277471 };
    let start = at_rest_or_not([0.994, 0.0], [0.0, -2.0015851063790825]);
    let references = [
        (1.0, [0.3132845955561022, 0.3480089746751417], [-1.0426165112787884, 0.6733841140965562], 1e-10),
        (5.0, [0.022688783647977124, 0.8665401401712473], [-0.1177364786408644, -0.42178580416287775], 1e-9),
        (10.0, [-0.8398071663389864, 0.4468314170984721], [0.37374253561439386, -0.14966964466689517], 1e-11),
        (
            17.065216560157964,
            [0.994, -2.63957739707259e-29],
            [-3.6775349599317234e-27, -2.0015851063790824],
            1e-8,
        ),
    ];
    let motion = model.simulate(start).until(period).tolerance(1e-14).run().unwrap();
    for (t, q, u, tolerance) in references {
        let found = error(&motion.at(t), q, u);
        println!("Arenstorf t = {t}: {found:.2e}");
        assert!(found < tolerance, "error {found:e} at t = {t}");
    }
}

/// Hénon, Heiles, Astron. J. 69 (1964) 73; q = (0.1, 0), p = (0, 0.5).
#[test]
fn henon_heiles() {
    let start = at_rest_or_not([0.1, 0.0], [0.0, 0.5]);
    let references = [
        (
            10.0,
            [0.03670891970302608, 0.6826922399017149],
            [0.04716396717584516, -0.025305958813863046],
            1e-13,
        ),
        (
            100.0,
            [-0.040194237876068815, 0.6790169217720217],
            [0.038450928951859836, 0.04859483155300364],
            1e-12,
        ),
        (
            500.0,
            [0.04255266468740387, 0.5979491577861642],
            [0.010964791015468331, -0.20220988032870155],
            1e-10,
        ),
        (
            1000.0,
            [-0.020869654947295507, -0.38163084134669734],
            [0.05684673704038535, 0.27197223256780373],
            1e-9,
        ),
    ];
    let motion = HenonHeiles.simulate(start).until(1000.0).tolerance(1e-14).run().unwrap();
    for (t, q, u, tolerance) in references {
        let found = error(&motion.at(t), q, u);
        println!("Hénon–Heiles t = {t}: {found:.2e}");
        assert!(found < tolerance, "error {found:e} at t = {t}");
    }
}

/// Pleiades (Hairer, Nørsett, Wanner, Solving ODE I, §II.10): seven bodies with near collisions, t = 3.
#[test]
fn pleiades() {
    let start = at_rest_or_not(
        [3.0, 3.0, -1.0, -3.0, 2.0, -2.0, 2.0, 3.0, -3.0, 2.0, 0.0, 0.0, -4.0, 4.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 1.75, -1.5, 0.0, 0.0, 0.0, -1.25, 1.0, 0.0, 0.0],
    );
    let q = [
        0.37061391439705127,
        3.237284092057233,
        -3.2225590324183235,
        0.6597091455775308,
        0.342558170715658,
        1.5621721014006311,
        -0.7003092922212495,
        -3.943437585517392,
        -3.27138097397255,
        5.225081843456544,
        -2.5906124349774693,
        1.1982136933922747,
        -0.24296823449358235,
        1.0914492404289797,
    ];
    let u = [
        3.4170038063143147,
        1.3545845016255011,
        -2.5900655978107756,
        2.025053734714241,
        -1.155815100160449,
        -0.8072988170223022,
        0.5952396354208719,
        -3.7412449612340084,
        0.3773459685750629,
        0.9386858869551079,
        0.36679222272005696,
        -0.3474046353808494,
        2.344915448180937,
        -1.947020434263292,
    ];
    let motion = Pleiades.simulate(start).until(3.0).tolerance(1e-13).run().unwrap();
    let found = error(&motion.end(), q, u);
    println!("Pleiades: {found:.2e}\n{}", motion.verify());
    assert!(found < 1e-8, "error {found:e}");
    assert!((motion.energy_at(0.0) + 45.95246949784712).abs() < 1e-13 * 46.0);
}

/// Huygens' tautochrone: s = 4R sin(θ/2) is harmonic whatever the amplitude. At θ₀ = 3 the inertia falls to
/// 1/200.
#[test]
fn cycloid_bead() {
    let references = [
        (0.1, 0.0004748353579161309, -0.09999548310359951, -0.09988709812707776),
        (1.0, 0.004554865460774381, -0.9999506896276801, -0.9987676622550935),
        (3.0, 0.009476901355214052, -2.998732829276405, -2.9711235253565653),
    ];
    let model = CycloidBead { radius: 1.0, g: 9.81 };
    for (amplitude, at_1, at_2, at_10) in references {
        for method in &[methods::Any::from(methods::Dop853), methods::DormandPrince5.into()] {
            let start = at_rest_or_not([amplitude], [0.0]);
            let motion = model.simulate(start).until(10.0).tolerance(1e-12).method(method).run().unwrap();
            for (t, reference) in [(1.0, at_1), (2.0, at_2), (10.0, at_10)] {
                let found = (motion.at(t).q[0] - reference).abs();
                println!("cycloid θ₀ = {amplitude}, {method}, t = {t}: {found:.2e}");
                assert!(found < 1e-8, "error {found:e}");
            }
        }
    }
}
