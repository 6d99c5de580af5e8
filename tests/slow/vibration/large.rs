//! The lowest modes of banded matrices: chains, bars and beams against closed and published values; what is
//! free, repeated or not definite.

use dynamics::analysis::{Banded, BandedModel, LinearizeError, StateSpace, VibrationError, lowest_modes};
use dynamics::prelude::*;
use nalgebra::DMatrix;
use std::f64::consts::PI;

use crate::models::CartPole;
use crate::normal::Chain;

/// A chain of n masses 1 and springs 1, fixed at the left, and at the right if so.
fn chain(n: usize, left: f64, right: f64) -> [Banded; 2] {
    let mut k = Banded::zeros(n, 1);
    k.add(0, 0, left).unwrap();
    k.add(n - 1, n - 1, right).unwrap();
    for i in 1..n {
        k.add(i, i, 1.0).unwrap();
        k.add(i - 1, i - 1, 1.0).unwrap();
        k.add(i, i - 1, -1.0).unwrap();
    }
    [Banded::diagonal(&vec![1.0; n]), k]
}

#[test]
fn twenty_of_a_thousand() {
    let [mass, stiffness] = chain(1000, 1.0, 1.0);
    let found = lowest_modes(&mass, &stiffness, 20).unwrap();
    assert_eq!(found.counted, 20);
    for (k, frequency) in found.frequencies.iter().enumerate() {
        let angle = (k as f64 + 1.0) * PI / 2002.0;
        assert!(
            (frequency / (2.0 * angle.sin()) - 1.0).abs() < 1e-12,
            "{k}: {:e}",
            frequency / (2.0 * angle.sin()) - 1.0
        );
        assert!(found.residuals[k] < 1e-13, "{k}: {:e}", found.residuals[k]);
        let shape = found.shapes.column(k);
        let wanted = |i: usize| (2.0 / 1001.0f64).sqrt() * (2.0 * angle * (i as f64 + 1.0)).sin();
        let sign = (shape[7] * wanted(7)).signum();
        let off = (0..1000).map(|i| (shape[i] - sign * wanted(i)).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{k}: {off:e}");
    }
}

/// Lumped from below, consistent from above, their mean to the fourth order (Hughes, *The Finite Element
/// Method*, §7.3).
#[test]
fn a_bar_with_three_mass_matrices() {
    let of = |n: usize, consistent: f64| {
        let h = 1.0 / n as f64;
        let (mut m, mut k) = (Banded::zeros(n, 1), Banded::zeros(n, 1));
        for e in 0..n {
            // Element between nodes e and e + 1, node 0 fixed.
            let (diagonal, beside) = (h * (0.5 - consistent / 6.0), h * consistent / 6.0);
            k.add(e, e, 1.0 / h).unwrap();
            m.add(e, e, diagonal).unwrap();
            if e > 0 {
                k.add(e - 1, e - 1, 1.0 / h).unwrap();
                m.add(e - 1, e - 1, diagonal).unwrap();
                k.add(e, e - 1, -1.0 / h).unwrap();
                m.add(e, e - 1, beside).unwrap();
            }
        }
        lowest_modes(&m, &k, n).unwrap().frequencies
    };
    let published = [
        (0.0, [1.570_392_630_362_744_3, 4.701_495_898_313_506, 7.803_612_880_645_131, 39.969_161_449_628_92]),
        (1.0, [1.571_200_085_425_905_9, 4.723_297_057_355_152, 7.904_540_094_246_181, 69.122_160_071_824_65]),
        (0.5, [1.570_796_202_244_696_2, 4.712_358_655_593_489, 7.853_590_144_915_464, 48.933_173_550_268_31]),
    ];
    for (consistent, wanted) in published {
        let found = of(20, consistent);
        for (k, wanted) in [0, 1, 2, 19].into_iter().zip(wanted) {
            let off: f64 = found[k] / wanted - 1.0;
            assert!(off.abs() < 1e-13, "{consistent} {k}: {:.16} {wanted}", found[k]);
        }
        let theta = PI / 40.0;
        let closed = 20.0
            * (12.0 * (1.0 - theta.cos()) / (6.0 - 2.0 * consistent + 2.0 * consistent * theta.cos()) * 1.0)
                .sqrt();
        assert!((found[0] / closed - 1.0).abs() < 1e-13, "{consistent}: {} {closed}", found[0]);
        let error = |n: usize| (of(n, consistent)[1] / (1.5 * PI) - 1.0).abs();
        let order = (error(10) / error(20)).log2();
        assert!((order - if consistent == 0.5 { 4.0 } else { 2.0 }).abs() < 0.1, "{consistent}: {order}");
    }
}

/// A bar of n elements with lumped masses, EA = ρA = L = 1, fixed at its left: elements of M and K.
fn bar(n: usize) -> [Vec<(usize, usize, f64)>; 2] {
    let h = 1.0 / n as f64;
    let mass = (0..n).map(|i| (i, i, if i + 1 == n { 0.5 * h } else { h })).collect();
    let own = (0..n).map(|i| (i, i, if i + 1 == n { 1.0 / h } else { 2.0 / h }));
    [mass, own.chain((1..n).map(|i| (i, i - 1, -1.0 / h))).collect()]
}

/// Pulled at its end by F from t = 0 on, the end of the bar goes to 2Fl/EA and back, straight, with the
/// period 4l/c: a wave that the wall turns over (K. F. Graff, *Wave Motion in Elastic Solids*, §2.4).
/// Elements make waves of number k slower by k²h²/24, so that the front is spread over (c t h²/8)^⅓, and the
/// corners rounded by about half of that.
#[test]
fn a_bar_that_is_pulled_answers_with_a_triangular_wave() {
    let times: Vec<f64> = (0..=400).map(|k| 0.02 * f64::from(k)).collect();
    let triangle = |t: f64| if t % 4.0 < 2.0 { t % 4.0 } else { 4.0 - t % 4.0 };
    let mut largest = Vec::new();
    for n in [10, 20, 40, 80] {
        let [mass, stiffness] = bar(n);
        let modes =
            BandedModel::from_elements(n, mass.clone(), stiffness.clone()).unwrap().lowest_modes(n).unwrap();
        let end = modes.shapes.row(n - 1);
        let of_mode = |t: f64, (k, w): (usize, &f64)| (end[k] / w).powi(2) * (1.0 - (w * t).cos());
        let by_modes =
            |t: f64| modes.frequencies.iter().enumerate().map(|mode| of_mode(t, mode)).sum::<f64>();
        let mut worst = 0.0f64;
        for t in &times {
            let off = (by_modes(*t) - triangle(*t)).abs();
            let front = (t / (8.0 * (n * n) as f64)).cbrt();
            assert!(off <= 0.7 * front, "{n} {t}: {off} {front}");
            worst = worst.max(off);
        }
        largest.push(worst);
        if n <= 20 {
            let mut a = DMatrix::zeros(2 * n, 2 * n);
            a.view_mut((0, n), (n, n)).fill_with_identity();
            for (i, j, k) in stiffness {
                (a[(n + i, j)], a[(n + j, i)]) = (-k / mass[i].2, -k / mass[j].2);
            }
            let mut b = DMatrix::zeros(2 * n, 1);
            b[2 * n - 1] = 1.0 / mass[n - 1].2;
            let mut c = DMatrix::zeros(1, 2 * n);
            c[n - 1] = 1.0;
            let space = StateSpace::from_matrices(a, b, c, DMatrix::zeros(1, 1)).unwrap();
            let found = space.step_response("w[0]", "y[0]", &times).unwrap();
            let off = times
                .iter()
                .enumerate()
                .map(|(k, t)| (found.values[k] - by_modes(*t)).abs())
                .fold(0.0, f64::max);
            assert!(off < 1e-10, "{n}: {off:e}");
        }
    }
    let order = (largest[1] / largest[3]).log2() / 2.0;
    assert!((order - 2.0 / 3.0).abs() < 0.05, "{order} {largest:?}");
}

/// However coordinates are numbered: a ring has half-bandwidth 2, a membrane little more than its shorter
/// side, two parts beside each other that of the wider; and the frequencies are theirs.
#[test]
fn an_order_is_found_in_which_the_band_is_narrow() {
    // By multiplication modulo a number: as far apart as can be.
    let ring = |i: usize| i * 377 % 1009;
    let stiffness = (0..1009).flat_map(|i| [(ring(i), ring(i), 2.0), (ring(i), ring((i + 1) % 1009), -1.0)]);
    let model = BandedModel::from_elements(1009, (0..1009).map(|i| (i, i, 1.0)), stiffness).unwrap();
    assert_eq!((model.stiffness.width(), model.mass.width()), (2, 0));
    let found = model.lowest_modes(7).unwrap();
    for (k, frequency) in found.frequencies.iter().enumerate() {
        let wanted = 2.0 * (k.div_ceil(2) as f64 * PI / 1009.0).sin();
        assert!((frequency - wanted).abs() < 1e-9, "{k}: {frequency} {wanted}");
    }

    let (a, b) = (31, 12);
    let at = |i: usize, j: usize| (i * b + j) * 151 % (a * b);
    let mut stiffness = Vec::new();
    for i in 0..a {
        for j in 0..b {
            stiffness.push((at(i, j), at(i, j), 4.0));
            if i > 0 {
                stiffness.push((at(i, j), at(i - 1, j), -1.0));
            }
            if j > 0 {
                stiffness.push((at(i, j), at(i, j - 1), -1.0));
            }
        }
    }
    let model = BandedModel::from_elements(a * b, (0..a * b).map(|i| (i, i, 1.0)), stiffness).unwrap();
    assert!(model.stiffness.width() <= b + 1, "{}", model.stiffness.width());
    let found = model.lowest_modes(10).unwrap();
    let part = |k: usize, n: usize| 4.0 * (k as f64 * PI / (2.0 * (n as f64 + 1.0))).sin().powi(2);
    let mut wanted: Vec<f64> =
        (1..=a).flat_map(|i| (1..=b).map(move |j| (part(i, a) + part(j, b)).sqrt())).collect();
    wanted.sort_by(f64::total_cmp);
    assert!(found.frequencies.iter().zip(&wanted).all(|(x, y)| (x / y - 1.0).abs() < 1e-12), "{found:?}");
    // Rows of the shapes are places as they were given: the lowest has no node.
    let shape = |i: usize, j: usize| found.shapes[(at(i, j), 0)] / found.shapes[(at(15, 5), 0)];
    let sine = |k: usize, n: usize| ((k + 1) as f64 * PI / (n as f64 + 1.0)).sin();
    for (i, j) in [(0, 0), (3, 7), (30, 11), (20, 2)] {
        let wanted = sine(i, a) * sine(j, b) / (sine(15, a) * sine(5, b));
        assert!((shape(i, j) - wanted).abs() < 1e-9, "{i} {j}");
    }
    let two = [(0, 3, -1.0), (3, 6, -1.0), (1, 4, -1.0)].into_iter().chain((0..7).map(|i| (i, i, 3.0)));
    let model = BandedModel::from_elements(7, (0..7).map(|i| (i, i, 1.0)), two).unwrap();
    assert_eq!(model.stiffness.width(), 1);
    let mut order = model.order.clone();
    order.sort_unstable();
    assert_eq!(order, [0, 1, 2, 3, 4, 5, 6]);
}

/// From a Lagrangian to the bands: those of a chain, with its frequencies; what has no normal modes has no
/// bands, and what cannot be is named.
#[test]
fn bands_of_a_model() {
    let chain = Chain::between([1.0, 0.3], 0.0, 0.4);
    let linear = chain.linearize(&chain.rest()).unwrap();
    let (model, all) = (linear.banded().unwrap(), linear.normal_modes().unwrap());
    assert_eq!((model.mass.width(), model.stiffness.width()), (0, 1));
    let found = model.lowest_modes(4).unwrap();
    for k in 0..4 {
        assert!((found.frequencies[k] / all.frequencies[k] - 1.0).abs() < 1e-12);
        let along = found.shapes.column(k).dot(&all.shapes.column(k)).abs();
        assert!((along - 1.0).abs() < 1e-9, "{k}: {along}");
    }
    let pole = CartPole { cart: 1.0, bob: 0.5, length: 1.0, g: 9.81 };
    let state = pole.state().force(0.0).theta(0.3).build().unwrap();
    let refused = pole.linearize(&state).unwrap().banded();
    assert!(
        matches!(refused, Err(VibrationError::Linearize(LinearizeError::Accelerates { .. }))),
        "{refused:?}"
    );
    let upright = pole.linearize(&pole.state().force(0.0).build().unwrap()).unwrap().banded().unwrap();
    assert!(matches!(
        upright.lowest_modes(1),
        Err(VibrationError::NotDefinite { matrix: "stiffness", row: 1 })
    ));
    let none = || [(0, 0, 1.0)].into_iter();
    assert!(matches!(
        BandedModel::from_elements(1, none(), [(0, 1, 1.0)]),
        Err(VibrationError::Shapes { .. })
    ));
    assert!(matches!(
        BandedModel::from_elements(1, none(), [(0, 0, f64::NAN)]),
        Err(VibrationError::Value { .. })
    ));
}

/// Hermite elements of a cantilever, EI = ρA = L = 1, against published values of these elements and of the
/// beam.
#[test]
fn a_cantilever_of_hermite_elements() {
    let of = |n: usize| {
        let h = 1.0 / n as f64;
        let (mut m, mut k) = (Banded::zeros(2 * n, 3), Banded::zeros(2 * n, 3));
        let bend = [
            [12.0, 6.0, -12.0, 6.0],
            [6.0, 4.0, -6.0, 2.0],
            [-12.0, -6.0, 12.0, -6.0],
            [6.0, 2.0, -6.0, 4.0],
        ];
        let move_ = [
            [156.0, 22.0, 54.0, -13.0],
            [22.0, 4.0, 13.0, -3.0],
            [54.0, 13.0, 156.0, -22.0],
            [-13.0, -3.0, -22.0, 4.0],
        ];
        let by = [1.0, h, 1.0, h];
        for e in 0..n {
            for i in 0..4 {
                for j in 0..=i {
                    let (row, column) = (2 * e + i, 2 * e + j);
                    // The first node is clamped.
                    if row >= 2 && column >= 2 {
                        k.add(row - 2, column - 2, bend[i][j] * by[i] * by[j] / h.powi(3)).unwrap();
                        m.add(row - 2, column - 2, move_[i][j] * by[i] * by[j] * h / 420.0).unwrap();
                    }
                }
            }
        }
        lowest_modes(&m, &k, (2 * n).min(4)).unwrap().frequencies
    };
    let published: [(usize, &[f64]); 4] = [
        (1, &[3.532_731_542_836_757, 34.806_893_108_208_41]),
        (2, &[3.517_715_041_626_624, 22.221_474_474_082_64, 75.157_083_058_816_38]),
        (4, &[3.516_130_270_592_935, 22.060_166_307_934_35, 62.174_892_525_868_84]),
        (8, &[3.516_022_592_396_933, 22.036_253_418_328_26, 61.734_741_191_944_17]),
    ];
    for (n, wanted) in published {
        let found = of(n);
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found / wanted - 1.0).abs() < 1e-12, "{n}: {found} {wanted}");
        }
    }
    // The beam itself is approached with order 4; what two meshes say of it together has order 6.
    let (coarse, fine) = (of(16), of(32));
    for (k, exact) in [(1, 22.034_491_564_666_77), (2, 61.697_214_413_549_1), (3, 120.901_916_052_305_72)] {
        let order = ((coarse[k] / exact - 1.0) / (fine[k] / exact - 1.0)).log2();
        assert!((order - 4.0).abs() < 0.05, "{k}: {order}");
        let both = (16.0 * fine[k] - coarse[k]) / 15.0;
        assert!((both / exact - 1.0).abs() < 0.05 * (fine[k] / exact - 1.0), "{k}: {both} {exact}");
    }
}

#[test]
fn what_is_free_and_what_is_repeated() {
    // Free at both ends: a zero, to the root of rounding, then 2 sin(jπ/2n).
    let [mass, stiffness] = chain(200, 0.0, 0.0);
    let found = lowest_modes(&mass, &stiffness, 5).unwrap();
    assert!(found.frequencies[0] < 1e-7 && found.counted == 5, "{found:?}");
    for k in 1..5 {
        assert!((found.frequencies[k] / (2.0 * (k as f64 * PI / 400.0).sin()) - 1.0).abs() < 1e-8, "{k}");
    }
    // Five equal chains side by side: every frequency five times, and none missed; an odd number cuts a
    // cluster.
    let (n, copies) = (60, 5);
    let mut k = Banded::zeros(n * copies, copies);
    for i in 0..n * copies {
        k.add(i, i, 2.0).unwrap();
        if i >= copies {
            k.add(i, i - copies, -1.0).unwrap();
        }
    }
    for count in [5, 12, 20] {
        let found = lowest_modes(&Banded::diagonal(&vec![1.0; n * copies]), &k, count).unwrap();
        assert_eq!(found.counted, count);
        for (i, frequency) in found.frequencies.iter().enumerate() {
            let wanted = 2.0 * ((i / copies + 1) as f64 * PI / 122.0).sin();
            assert!((frequency / wanted - 1.0).abs() < 1e-12, "{count} {i}: {frequency} {wanted}");
        }
        let orthonormal = found.shapes.tr_mul(&found.shapes) - nalgebra::DMatrix::identity(count, count);
        assert!(orthonormal.amax() < 1e-12);
    }
}

#[test]
fn matrices_that_cannot_be_are_refused() {
    let [mass, stiffness] = chain(10, 1.0, 1.0);
    assert!(matches!(lowest_modes(&mass, &chain(9, 1.0, 1.0)[1], 2), Err(VibrationError::Shapes { .. })));
    assert!(matches!(lowest_modes(&mass, &stiffness, 11), Err(VibrationError::TooFew { .. })));
    assert!(matches!(lowest_modes(&mass, &stiffness, 0), Err(VibrationError::TooFew { .. })));
    let mut massless = vec![1.0; 10];
    massless[4] = 0.0;
    assert!(matches!(
        lowest_modes(&Banded::diagonal(&massless), &stiffness, 2),
        Err(VibrationError::NotDefinite { matrix: "mass", row: 4 })
    ));
    massless[4] = -1.0;
    assert!(matches!(
        lowest_modes(&Banded::diagonal(&massless), &stiffness, 2),
        Err(VibrationError::NotDefinite { matrix: "mass", row: 4 })
    ));
    assert!(matches!(
        lowest_modes(&mass, &chain(10, -0.5, 1.0)[1], 2),
        Err(VibrationError::NotDefinite { matrix: "stiffness", .. })
    ));
    let mut broken = stiffness.clone();
    broken.add(3, 3, f64::NAN).unwrap();
    assert!(matches!(lowest_modes(&mass, &broken, 2), Err(VibrationError::Linearize(_))));
    assert!(broken.add(3, 5, 1.0).is_err());
    assert!(lowest_modes(&mass, &stiffness, 10).unwrap().frequencies[9] < 2.0);
}
