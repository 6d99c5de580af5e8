//! Modes that a cause does not reach, or an answer does not see: on their frequency the response is finite,
//! whatever their coordinates; what is reached by ever so little is refused.

use dynamics::analysis::{StateSpace, VibrationError};
use dynamics::prelude::*;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::PI;

use crate::normal::Chain;

/// A from M = 1, C and K, b and c of places, in coordinates of the state that hide who is coupled with whom.
fn hidden(k: &DMatrix<f64>, damping: &DMatrix<f64>, b: &[f64], c: &[f64]) -> StateSpace {
    let n = k.nrows();
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    a.view_mut((0, n), (n, n)).fill_with_identity();
    a.view_mut((n, 0), (n, n)).copy_from(&-k);
    a.view_mut((n, n), (n, n)).copy_from(&-damping);
    let turn =
        DMatrix::from_fn(2 * n, 2 * n, |i, j| (1.7 * (i * i) as f64 + 2.3 * (i * j) as f64 + j as f64).sin());
    let turn = turn.qr().q();
    let mut into = DMatrix::zeros(2 * n, 1);
    into.rows_mut(n, n).copy_from_slice(b);
    let mut out = DMatrix::zeros(1, 2 * n);
    (0..n).for_each(|j| out[j] = c[j]);
    StateSpace::from_matrices(
        &turn * a * turn.transpose(),
        &turn * into,
        out * turn.transpose(),
        DMatrix::zeros(1, 1),
    )
    .unwrap()
}

fn chain(n: usize, ends: f64) -> DMatrix<f64> {
    DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 if i == 0 || i + 1 == n => 1.0 + ends,
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    })
}

fn at(space: &StateSpace, frequency: f64) -> Result<(Complex<f64>, f64), VibrationError> {
    let found = space.frequency_response("w[0]", "y[0]", &[frequency])?;
    Ok((found.values[0], found.uncertainty[0]))
}

/// Three masses between walls, pushed in the middle at ω² = 2: the middle stands still, and the sides take
/// half of the push each (K − 2 = tridiagonal of −1 and 0).
#[test]
fn a_push_in_the_node_of_a_mode() {
    let none = DMatrix::zeros(3, 3);
    for (out, wanted) in [([0.0, 1.0, 0.0], 0.0), ([1.0, 0.0, 0.0], -0.5), ([0.0, 0.0, 1.0], -0.5)] {
        let (found, said) =
            at(&hidden(&chain(3, 1.0), &none, &[0.0, 1.0, 0.0], &out), 2.0f64.sqrt()).unwrap();
        assert!(
            (found - wanted).norm() < 1e-13 && (found - wanted).norm() <= said && said < 1e-11,
            "{found} {said:e}"
        );
        // Pushed at the side the mode is seen at the sides, and not in the middle.
        let pushed = at(&hidden(&chain(3, 1.0), &none, &[1.0, 0.0, 0.0], &out), 2.0f64.sqrt());
        match out[1] {
            1.0 => assert!((pushed.unwrap().0 + 0.5).norm() < 1e-13),
            _ => assert!(matches!(pushed, Err(VibrationError::Resonance { .. })), "{pushed:?}"),
        }
    }
}

/// The chain of ten masses, from its Lagrangian, pushed at both ends alike, on each frequency of its
/// antisymmetric modes: what half of the chain does, whose last spring never stretches.
#[test]
fn symmetric_pushes_on_antisymmetric_modes() {
    let chain = Chain::between([1.0, 1.0], 0.0, 0.0);
    let space = chain.state_space(&chain.rest()).unwrap();
    let column = |name: &str| space.inputs.iter().position(|input| input.name == name).unwrap();
    let row = space.outputs.iter().position(|output| output.name == "x[2]").unwrap();
    let b = space.b.column(column("x[0]")) + space.b.column(column("x[9]"));
    let b = DMatrix::from_columns(&[b]);
    let c = DMatrix::from_rows(&[space.c.row(row).into_owned()]);
    let space = StateSpace::from_matrices(space.a.clone(), b, c, DMatrix::zeros(1, 1)).unwrap();
    for j in 1..=10 {
        let frequency = 2.0 * (f64::from(j) * PI / 22.0).sin();
        let found = at(&space, frequency);
        if j % 2 == 1 {
            assert!(matches!(found, Err(VibrationError::Resonance { .. })), "{j}: {found:?}");
            continue;
        }
        let mut half = DMatrix::from_fn(5, 5, |i, j| [2.0, -1.0, 0.0, 0.0, 0.0][i.abs_diff(j)]);
        half[(4, 4)] = 1.0;
        (0..5).for_each(|i| half[(i, i)] -= frequency * frequency);
        let wanted = half.lu().solve(&DVector::from_fn(5, |i, _| if i == 0 { 1.0 } else { 0.0 })).unwrap()[2];
        let (found, said) = found.unwrap();
        assert!(
            (found - wanted).norm() < 1e-12 && (found - wanted).norm() <= said && said < 1e-9,
            "{j}: {found} {wanted} {said:e}"
        );
    }
}

/// Two equal oscillators that nothing couples, one pushed, the other watched: both modes swing, and nothing
/// goes from one to the other. Seen itself, the first is at resonance.
#[test]
fn of_a_repeated_mode_what_is_pushed_is_not_what_is_seen() {
    let (k, none) = (DMatrix::from_diagonal_element(2, 2, 4.0), DMatrix::zeros(2, 2));
    let (found, said) = at(&hidden(&k, &none, &[1.0, 1.0], &[1.0, -1.0]), 2.0).unwrap();
    assert!(found.norm() < 1e-13 && said < 1e-12, "{found} {said:e}");
    let both = at(&hidden(&k, &none, &[1.0, 1.0], &[1.0, 0.0]), 2.0);
    assert!(matches!(both, Err(VibrationError::Resonance { .. })), "{both:?}");
    // Beside a third that is softer, whose response remains: 1/(1 − 4).
    let k = DMatrix::from_diagonal(&DVector::from_row_slice(&[4.0, 4.0, 1.0]));
    let (found, said) =
        at(&hidden(&k, &DMatrix::zeros(3, 3), &[1.0, 0.0, 1.0], &[0.0, 1.0, 1.0]), 2.0).unwrap();
    assert!((found + 1.0 / 3.0).norm() < 1e-13 && said < 1e-12, "{found} {said:e}");
}

/// Pushed at 0 rad/s, a free chain goes away with F/n; its springs stretch by what accelerates the masses
/// behind them.
#[test]
fn what_is_free_stretches_by_what_it_accelerates() {
    for n in [2, 5, 9] {
        let mut push = vec![0.0; n];
        push[0] = 1.0;
        for i in 1..n {
            let mut stretch = vec![0.0; n];
            (stretch[i], stretch[i - 1]) = (1.0, -1.0);
            let space = hidden(&chain(n, 0.0), &(0.01 * chain(n, 0.0)), &push, &stretch);
            let (found, said) = at(&space, 0.0).unwrap();
            let wanted = -((n - i) as f64) / n as f64;
            assert!(
                (found - wanted).norm() < 1e-11 && (found - wanted).norm() <= said && said < 1e-8,
                "{n} {i}: {found} {said:e}"
            );
            // The damped springs have their peaks, and a largest stretch, though the chain goes away.
            let gain = space.largest_response("w[0]", "y[0]").unwrap();
            assert!(
                gain.magnitude > wanted.abs() && !space.resonances("w[0]", "y[0]").unwrap().is_empty(),
                "{gain:?}"
            );
        }
        let gone = at(&hidden(&chain(n, 0.0), &DMatrix::zeros(n, n), &push, &push), 0.0);
        assert!(matches!(gone, Err(VibrationError::Free { .. })), "{n}: {gone:?}");
    }
}

/// Two masses damped against each other alone: what they do together is never damped. Pushed apart, 1/(k₂ −
/// ω² + 2cωi)·2 is all, with its peak.
#[test]
fn peaks_beside_a_mode_that_never_dies_away() {
    let (coupling, c) = (1.5, 0.1);
    let k = DMatrix::from_row_slice(2, 2, &[4.0 + coupling, -coupling, -coupling, 4.0 + coupling]);
    let damping = DMatrix::from_row_slice(2, 2, &[c, -c, -c, c]);
    let apart = hidden(&k, &damping, &[1.0, -1.0], &[1.0, -1.0]);
    // ω² = 7, 2ζω = 2c; the height is 2/(2ζ√(1 − ζ²) ω²).
    let (w, z) = (7.0f64.sqrt(), c / 7.0f64.sqrt());
    let peaks = apart.resonances("w[0]", "y[0]").unwrap();
    assert_eq!(peaks.len(), 1);
    assert!((peaks[0].frequency - w * (1.0 - 2.0 * z * z).sqrt()).abs() < 1e-11, "{peaks:?}");
    let height = 2.0 / (2.0 * z * (1.0 - z * z).sqrt() * 7.0);
    assert!((peaks[0].magnitude / height - 1.0).abs() < 1e-12, "{peaks:?} {height}");
    let gain = apart.largest_response("w[0]", "y[0]").unwrap();
    assert!((gain.magnitude / height - 1.0).abs() < 1e-12, "{gain:?}");
    let one = hidden(&k, &damping, &[1.0, 0.0], &[1.0, -1.0]);
    assert!((one.largest_response("w[0]", "y[0]").unwrap().magnitude / (0.5 * height) - 1.0).abs() < 1e-12);
    let seen = hidden(&k, &damping, &[1.0, 0.0], &[1.0, 0.0]).resonances("w[0]", "y[0]");
    assert!(matches!(seen, Err(VibrationError::Unstable { .. })), "{seen:?}");
    // What grows is told, whether it is seen or not.
    let k = DMatrix::from_row_slice(2, 2, &[coupling - 1.0, -coupling, -coupling, coupling - 1.0]);
    let falls = hidden(&k, &damping, &[1.0, -1.0], &[1.0, -1.0]).resonances("w[0]", "y[0]");
    assert!(matches!(falls, Err(VibrationError::Unstable { .. })), "{falls:?}");
}

/// A mode that is reached by 1e-9 of the push, or one wall that is stiffer by that, is a resonance: it has no
/// finite response.
#[test]
fn what_is_hardly_reached_is_reached() {
    let none = DMatrix::zeros(3, 3);
    for little in [1e-3, 1e-6, 1e-9, 1e-11] {
        let found = at(&hidden(&chain(3, 1.0), &none, &[little, 1.0, 0.0], &[1.0, 0.0, 0.0]), 2.0f64.sqrt());
        assert!(matches!(found, Err(VibrationError::Resonance { .. })), "{little:e}: {found:?}");
        let mut k = chain(3, 1.0);
        k[(0, 0)] += little;
        // On the frequency that the mode has then.
        let space = hidden(&k, &none, &[0.0, 1.0, 0.0], &[1.0, 0.0, 0.0]);
        let exact = k.symmetric_eigenvalues().iter().copied().find(|x| (x - 2.0).abs() < 0.1).unwrap().sqrt();
        match at(&space, exact) {
            Err(VibrationError::Resonance { .. }) => {}
            // Where the frequency is off by its rounding the response is finite, and the uncertainty as
            // large.
            Ok((found, said)) => assert!(said > 1e-3 * found.norm(), "{little:e}: {found} {said:e}"),
            Err(other) => panic!("{other}"),
        }
    }
    // Light and stiff beside it hide nothing: the mode at 1 rad/s is reached by a hundredth of what reaches
    // the other, 1e5 times as fast.
    let k = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 1e10]);
    let mut a = DMatrix::zeros(4, 4);
    (a[(0, 2)], a[(1, 3)]) = (1.0, 1.0);
    a.view_mut((2, 0), (2, 2)).copy_from(&-k);
    let b = DMatrix::from_row_slice(4, 1, &[0.0, 0.0, 1.0, 1e2]);
    let c = DMatrix::from_row_slice(1, 4, &[1.0, 1.0, 0.0, 0.0]);
    let space = StateSpace::from_matrices(a, b, c, DMatrix::zeros(1, 1)).unwrap();
    assert!(matches!(at(&space, 1.0), Err(VibrationError::Resonance { .. })));
}

/// Equal to the value beside it: the response passes the frequency without a jump.
#[test]
fn responses_are_continuous_where_nothing_is_reached() {
    let space = hidden(
        &chain(7, 1.0),
        &DMatrix::zeros(7, 7),
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        &[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    );
    for j in [2, 4, 6] {
        let frequency = 2.0 * (f64::from(j) * PI / 16.0).sin();
        let (found, said) = at(&space, frequency).unwrap();
        let beside = [-1e-5, 1e-5].map(|by| at(&space, frequency + by).unwrap().0);
        let off = (found - 0.5 * (beside[0] + beside[1])).norm();
        assert!(off < 1e-8 && said < 1e-9, "{j} {found} {beside:?}");
    }
}

/// States that nothing leads to need no care: an undamped resonance elsewhere is none of this output's.
#[test]
fn parts_that_are_not_between_cause_and_answer() {
    // A swing of 2 rad/s beside a damped one.
    let k = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 3.0]);
    let mut a = DMatrix::zeros(4, 4);
    (a[(0, 2)], a[(1, 3)], a[(3, 3)]) = (1.0, 1.0, -0.2);
    a.view_mut((2, 0), (2, 2)).copy_from(&-k);
    let b = DMatrix::from_row_slice(4, 1, &[0.0, 0.0, 1.0, 1.0]);
    let space = StateSpace::from_matrices(
        a,
        b,
        DMatrix::from_row_slice(1, 4, &[0.0, 1.0, 0.0, 0.0]),
        DMatrix::zeros(1, 1),
    );
    let space = space.unwrap();
    let wanted = Complex::new(3.0 - 4.0, 0.4).inv();
    assert!((at(&space, 2.0).unwrap().0 - wanted).norm() < 1e-15);
    assert_eq!(space.resonances("w[0]", "y[0]").unwrap().len(), 1);
    // An answer that is the cause itself: nothing lies between.
    let one = |x: f64| DMatrix::from_element(1, 1, x);
    let space = StateSpace::from_matrices(one(0.0), one(1.0), one(0.0), one(3.0)).unwrap();
    assert_eq!(at(&space, 0.0).unwrap().0, Complex::new(3.0, 0.0));
    assert!(space.resonances("w[0]", "y[0]").unwrap().is_empty());
    let gain = space.largest_response("w[0]", "y[0]").unwrap();
    assert_eq!(gain.magnitude, 3.0);
}
