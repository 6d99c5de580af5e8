//! Whipple's bicycle from bodies and rolling, nonlinear; linearised beside straight running against the
//! matrices and eigenvalues of J. P. Meijaard, J. M. Papadopoulos, A. Ruina and A. L. Schwab, Proc. R. Soc. A
//! 463 (2007) 1955.

use crate::bicycle_model as bicycle;

use bicycle::model;
use dynamics::analysis::{Equilibrium, EquilibriumError, Linearization, LinearizeError};
use dynamics::constrain::{solve_general, with_workspace};
use dynamics::prelude::*;
use nalgebra::{Complex, Matrix2};

fn lean_and_steer(speed: f64) -> Linearization {
    let model = model();
    model.linearize_in(&model.running(speed), &["roll", "steer", "rear"]).expect("steady")
}

/// The part of a matrix that belongs to roll and steer.
fn part(matrix: &nalgebra::DMatrix<f64>) -> Matrix2<f64> {
    matrix.fixed_view::<2, 2>(0, 0).into_owned()
}

/// M, C₁, K₀ and K₂ of M q̈ + v C₁ q̇ + (g K₀ + v² K₂) q = 0, by rows, rounded from 28 digits.
#[test]
fn the_published_matrices() {
    let (standing, running) = (lean_and_steer(0.0), lean_and_steer(1.0));
    let close = |name: &str, found: Matrix2<f64>, wanted: [f64; 4]| {
        let error = (found - Matrix2::from_row_slice(&wanted)).amax();
        assert!(error < 1e-13, "{name} is off by {error:.1e}: {found}");
    };
    close("M", part(&standing.mass), [80.81722, 2.319413322087091, 2.319413322087091, 0.2978418819968555]);
    close("C₁", part(&running.damping), [0.0, 33.86641391492494, -0.8503564145697844, 1.6854039739755966]);
    let k0 = part(&standing.stiffness);
    close("K₀", k0 / 9.81, [-80.95, -2.5995168524987164, -2.5995168524987164, -0.8032948845861769]);
    close("K₂", part(&running.stiffness) - k0, [0.0, 76.59734589573222, 0.0, 2.65431523794604]);
    // Speed is decoupled from lean and steer.
    assert!(standing.mass[(0, 2)].abs() < 1e-13 && running.damping[(2, 0)].abs() < 1e-13);
}

/// v; the two real eigenvalues or the first pair, then the second pair. Rounded from 28 digits.
const EIGENVALUES: [(f64, [(f64, f64); 4]); 11] = [
    (
        0.0,
        [
            (-5.530943717653934, 0.0),
            (-3.1316432479065557, 0.0),
            (3.1316432479065557, 0.0),
            (5.530943717653934, 0.0),
        ],
    ),
    (
        1.0,
        [
            (-7.110080146374408, 0.0),
            (-3.1342312506657843, 0.0),
            (3.5269617099006942, -0.80774027519931),
            (3.5269617099006942, 0.80774027519931),
        ],
    ),
    (
        2.0,
        [
            (-8.673879848317371, 0.0),
            (-3.0715864564151425, 0.0),
            (2.6823451751274536, -1.6806629659067578),
            (2.6823451751274536, 1.6806629659067578),
        ],
    ),
    (
        3.0,
        [
            (-10.351014672459229, 0.0),
            (-2.633661372536653, 0.0),
            (1.706756056639735, -2.3158244738432434),
            (1.706756056639735, 2.3158244738432434),
        ],
    ),
    (
        4.0,
        [
            (-12.15861426576444, 0.0),
            (-1.4294442736132575, 0.0),
            (0.4132533152112413, -3.0791081860320535),
            (0.4132533152112413, 3.0791081860320535),
        ],
    ),
    (
        5.0,
        [
            (-14.078389692798247, 0.0),
            (-0.7753418821958419, -4.464867713788225),
            (-0.7753418821958419, 4.464867713788225),
            (-0.3228664290040871, 0.0),
        ],
    ),
    (
        6.0,
        [
            (-16.085371230980282, 0.0),
            (-1.5264448658414171, -5.876730605987084),
            (-1.5264448658414171, 5.876730605987084),
            (-0.004066900769703363, 0.0),
        ],
    ),
    (
        7.0,
        [
            (-18.15788466125202, 0.0),
            (-2.138756442583634, -7.195259133298043),
            (-2.138756442583634, 7.195259133298043),
            (0.10268170574766416, 0.0),
        ],
    ),
    (
        8.0,
        [
            (-20.27940894394566, 0.0),
            (-2.6934868358109476, -8.460379713969337),
            (-2.6934868358109476, 8.460379713969337),
            (0.1432787976571295, 0.0),
        ],
    ),
    (
        9.0,
        [
            (-22.43788559040859, 0.0),
            (-3.2167540225249076, -9.693773515317822),
            (-3.2167540225249076, 9.693773515317822),
            (0.15790184030917298, 0.0),
        ],
    ),
    (
        10.0,
        [
            (-24.624596350174, 0.0),
            (-3.7201684043728758, -10.906811394762881),
            (-3.7201684043728758, 10.906811394762881),
            (0.16105338653171555, 0.0),
        ],
    ),
];

#[test]
fn the_published_eigenvalues() {
    for (speed, wanted) in EIGENVALUES {
        let found = lean_and_steer(speed).eigenvalues().expect("straight running is steady");
        assert_eq!(found.len(), 10);
        for (re, im) in wanted {
            let nearest =
                found.iter().map(|x| (x - Complex::new(re, im)).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-13, "v = {speed}: {re} + {im}i is missed by {nearest:.1e}: {found:?}");
        }
        // The other six: place, yaw, the wheels' angles, speed.
        assert_eq!(found.iter().filter(|x| **x == Complex::new(0.0, 0.0)).count(), 6, "{found:?}");
    }
}

#[test]
fn the_published_speeds() {
    let at = |speed: f64| lean_and_steer(speed).eigenvalues().expect("straight running is steady");
    // At the weave speed a pair lies on the axis.
    let weave = at(4.292_382_536_341_104);
    let nearest = weave
        .iter()
        .map(|x| (x - Complex::new(0.0, 3.435_033_848_661_436_3)).norm())
        .fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-12, "{nearest:.1e}: {weave:?}");
    // Where two real ones meet each has the root of rounding, their mean has not; a pair above, two apart
    // below.
    let (double, value) = (0.684_283_078_892_455_8, 3.782_904_051_293_203);
    for part in [1.0 - 1e-9, 1.0, 1.0 + 1e-9] {
        let found = at(double * part);
        let two: Vec<_> = found.iter().filter(|x| (**x - value).norm() < 1e-2).collect();
        assert_eq!(two.len(), 2, "{part}: {found:?}");
        let (mean, half) = (0.5 * (two[0] + two[1]), 0.5 * (two[0] - two[1]));
        // The mean itself moves with the speed, by less than 1e-9 of it.
        assert!((mean / value - 1.0).norm() < if part == 1.0 { 1e-10 } else { 1e-8 }, "{part}: {mean}");
        match part.total_cmp(&1.0) {
            core::cmp::Ordering::Less => assert!(half.im == 0.0 && half.re.abs() > 1e-6, "{half}"),
            core::cmp::Ordering::Equal => assert!(half.norm() < 1e-6, "{half}"),
            core::cmp::Ordering::Greater => assert!(half.re.abs() < 1e-12 && half.im.abs() > 1e-6, "{half}"),
        }
    }
}

/// A state that leans and steers, at rest in both, with the rear wheel turning as at this speed.
fn leaning(speed: f64, [roll, steer]: [f64; 2]) -> State<bicycle::Bicycle> {
    let model = model();
    let start = model.state().roll(roll).steer(steer).pitch_guess(0.0);
    let start = start.rear_rate(-speed / model.radius[0]).roll_rate(0.0).steer_rate(0.0);
    start.assemble().expect("both wheels touch the ground")
}

/// Where it turns, too, stiffness and damping are the derivatives of the accelerations.
#[test]
fn linearised_where_it_turns() {
    let model = model();
    let accelerations = |state: &State<bicycle::Bicycle>| {
        let a = model.accelerations(state).expect("regular");
        nalgebra::Vector3::new(a[3], a[5], a[6])
    };
    for (speed, place) in [(1.0, [0.3, 0.5]), (6.0, [0.1, 0.03]), (5.0, [-0.7, 0.2])] {
        let linear = model.linearize_in(&leaning(speed, place), &["roll", "steer", "rear"]).expect("regular");
        let by = linear.mass.clone().try_inverse().expect("inertia") * &linear.stiffness;
        for k in 0..2 {
            let moved = |h: f64| {
                let mut place = place;
                place[k] += h;
                accelerations(&leaning(speed, place))
            };
            let h = 1e-5;
            let wanted = (moved(h) - moved(-h)) / (2.0 * h);
            let off = (0..3).map(|i| (by[(i, k)] + wanted[i]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-6 * (1.0 + wanted.amax()), "{speed}, {k}: {off:.1e} of {wanted}");
        }
        // Nothing depends on the heading.
        let yaw = linear.coordinates.iter().position(|q| q.name == "yaw").expect("independent");
        assert!(by.column(yaw).amax() < 1e-11, "{speed}: {by}");
    }
}

/// Turns without hands at a speed: two to each side below the capsize speed, one above (P. Basu-Mandal, A.
/// Chatterjee & J. M. Papadopoulos, Proc. R. Soc. A 463 (2007) 1983).
#[test]
fn turns_without_hands() {
    let model = model();
    let at = |speed: f64| {
        let search = model.steady_motions(leaning(speed, [0.0, 0.0])).holding(&["roll", "steer", "rear"]);
        search.random(50).within("roll", [-1.2, 1.2]).within("steer", [-1.2, 1.2]).run().expect("straight on")
    };
    for (speed, count) in [(6.0, 5), (6.3, 3)] {
        let found = at(speed);
        // What hangs below the plane rolls, too.
        let above =
            || found.equilibria.iter().filter(|one| one.state.roll().abs() < std::f64::consts::FRAC_PI_2);
        assert_eq!(above().count(), count, "{speed}: {found}");
        for one in above() {
            let rolling = one.state;
            // What is not looked for stays, and so do the velocities that were given.
            assert!(
                (rolling.rear_rate() + speed / model.radius[0]).abs() < 1e-14 && rolling.yaw().abs() < 1e-12,
                "{one}"
            );
            assert!(rolling.roll_rate() == 0.0 && rolling.steer_rate() == 0.0, "{one}");
            // To the other side as well.
            let mirror = |other: &Equilibrium<State<bicycle::Bicycle>>| {
                (other.state.roll() + rolling.roll()).abs() + (other.state.steer() + rolling.steer()).abs()
                    < 1e-10
            };
            assert!(found.equilibria.iter().any(mirror), "{found}");
            let a = model.accelerations(&rolling).expect("regular");
            assert!([2, 3, 4, 5, 6, 7].into_iter().all(|i| a[i].abs() < 1e-9), "{one}\n{a}");
        }
    }
    // The family that runs forward begins where straight running capsizes: v over lean², carried on to no
    // lean.
    let lean = |speed: f64| {
        let guess = (0.37 * (6.024_262 - speed)).sqrt();
        let one = model
            .steady_in(&leaning(speed, [guess, 0.29 * guess]), &["roll", "steer", "rear"])
            .expect("a turn");
        assert!(one.state.roll() > 1e-3, "{one}");
        one.state.roll().powi(2)
    };
    let points = [6.0215, 6.0228, 6.0238].map(|speed| (lean(speed), speed));
    let weight = |k: usize| {
        (0..3).filter(|j| *j != k).map(|j| points[j].0 / (points[j].0 - points[k].0)).product::<f64>()
    };
    let capsize: f64 = (0..3).map(|k| weight(k) * points[k].1).sum();
    assert!((capsize - 6.024_262_015_388_37).abs() < 1e-7, "{capsize}");
}

/// It goes round as it was found: for twenty seconds, through more than a turn.
#[test]
fn a_turn_goes_on() {
    let model = model();
    let one = model.steady_in(&leaning(5.8, [0.26, 0.08]), &["roll", "steer", "rear"]).expect("a turn");
    let motion = model.simulate(one.state).until(20.0).tolerance(1e-14).run().expect("it rolls");
    let (mut worst, mut fastest): (f64, f64) = (0.0, 0.0);
    for k in 0..=200 {
        let state = motion.at(0.1 * f64::from(k));
        let off = (state.roll() - one.state.roll()).abs().max((state.steer() - one.state.steer()).abs());
        worst = worst.max(off).max((state.yaw_rate() - one.state.yaw_rate()).abs());
        let a = model.accelerations(&state).expect("regular");
        fastest = [2, 3, 4, 5, 6, 7].iter().fold(fastest, |most, i| a[*i].abs().max(most));
    }
    assert!(worst < 1e-9 && fastest < 1e-9, "off by {worst:.1e}, {fastest:.1e} per second squared");
    assert!(motion.end().yaw().abs() > std::f64::consts::TAU, "{}", motion.end().yaw());
    // A name that is not independent of the others, and one that is none.
    let error =
        model.steady_in(&leaning(5.8, [0.26, 0.08]), &["roll", "steer", "rear", "front"]).unwrap_err();
    assert!(matches!(error, EquilibriumError::Derivatives(LinearizeError::Dependent { .. })), "{error}");
    let error = model.steady_in(&leaning(5.8, [0.26, 0.08]), &["lean"]).unwrap_err();
    assert!(
        matches!(error, EquilibriumError::Derivatives(LinearizeError::UnknownCoordinate { .. })),
        "{error}"
    );
}

/// Upright and straight on, whatever the heading, it runs on generated code.
#[test]
fn it_runs_on_generated_code() {
    let model = model();
    let [rear, front] = model.radius.map(|radius| -5.0 / radius);
    for heading in [0.0, 0.7, std::f64::consts::FRAC_PI_2, -2.0, std::f64::consts::PI] {
        let start = model.state().yaw(heading).x_rate(5.0 * heading.cos()).y_rate(5.0 * heading.sin());
        let start = start.rear_rate(rear).front_rate(front);
        for start in [start, start.roll_rate(0.3)] {
            let start = start.build().expect("it rolls");
            let motion = model.simulate(start).until(2.0).tolerance(1e-10).run().expect("it rolls");
            let summary = motion.verify();
            assert_eq!(summary.stabilization.general, 0, "{heading}\n{summary}");
        }
    }
}

/// Leaning, steering and turning, too, and what it gives is what the general solver finds.
#[test]
fn generated_code_agrees_with_the_general_solver() {
    let model = model();
    let constants = model.constants().expect("regular");
    let mut worst: f64 = 0.0;
    for k in 0..200 {
        // Low discrepancies: all but multiples of one another.
        let part = |step: f64| 2.0 * (f64::from(k) * step).fract() - 1.0;
        let place = [0.8 * part(0.618_034), 0.6 * part(0.754_878)];
        let start = model.state().yaw(3.0 * part(0.569_840)).roll(place[0]).steer(place[1]).pitch_guess(0.0);
        let rates = [6.0 * part(0.819_173), part(0.671_044), 2.0 * part(0.549_700)];
        let start = start.rear_rate(rates[0] / 0.3).roll_rate(rates[1]).steer_rate(rates[2]);
        let state = start.assemble().expect("both wheels touch the ground");
        let found = model.solve_unrolled(&constants, &state).expect("no pivot vanishes");
        let wanted = with_workspace::<bicycle::Bicycle, _>(|memory| solve_general(&model, &state, memory))
            .expect("regular");
        let off = |a: &[f64], b: &[f64]| {
            let size = b.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            a.iter().zip(b).fold(0.0, |most: f64, (x, y)| most.max((x - y).abs())) / size
        };
        worst = worst.max(off(found.accelerations.as_slice(), wanted.accelerations.as_slice()));
        worst = worst.max(off(found.multipliers.as_slice(), wanted.multipliers.as_slice()));
    }
    assert!(worst < 1e-11, "{worst:.1e}");
}
