//! Impulses, steps, arbitrary loads, superposition of modes, and spectra of simulated motions.

use dynamics::analysis::{Load, Spectrum, StateSpace, VibrationError, Window};
use dynamics::prelude::*;
use std::f64::consts::{PI, TAU};

use crate::models::Oscillator;
use crate::normal::Chain;

fn times(end: f64, parts: u32) -> Vec<f64> {
    (0..=parts).map(|k| end * f64::from(k) / f64::from(parts)).collect()
}

/// Free motion, step and impulse in every damping regime (Rao, §2.6, §4.5).
#[test]
fn every_damping_regime() {
    let (m, w) = (3.0, 2.0f64);
    for z in [0.0, 0.1, 0.9, 1.0, 1.5, 4.0] {
        let space = Oscillator::damped(z).space();
        // h(t), ∫h and h': sin, t and sinh of one formula.
        let decay = |t: f64| (-z * w * t).exp();
        let root = (1.0f64 - z * z).abs().sqrt() * w;
        let h = |t: f64| match z {
            1.0 => t * decay(t) / m,
            z if z < 1.0 => decay(t) * (root * t).sin() / (m * root),
            _ => (((root - z * w) * t).exp() - ((-root - z * w) * t).exp()) / (2.0 * m * root),
        };
        let rate = |t: f64| match z {
            1.0 => (1.0 - w * t) * decay(t) / m,
            z if z < 1.0 => decay(t) * ((root * t).cos() - z * w / root * (root * t).sin()) / m,
            _ => {
                ((root - z * w) * ((root - z * w) * t).exp() + (root + z * w) * ((-root - z * w) * t).exp())
                    / (2.0 * m * root)
            }
        };
        let at = times(6.0, 37);
        let impulse = space.impulse_response("force", "x", &at).unwrap().of("x").unwrap();
        let step = space.step_response("force", "x", &at).unwrap().of("x").unwrap();
        let free = space.response(&[], &["x", "x_rate"], &[("x", 0.3), ("x_rate", -0.2)], &at).unwrap();
        for (k, t) in at.iter().enumerate() {
            assert!((impulse[k].1 - h(*t)).abs() < 2e-15, "{z} {t}");
            // k ∫h = 1 − m ḣ − c h.
            let c = 2.0 * z * m * w;
            assert!((12.0 * step[k].1 - (1.0 - m * rate(*t) - c * h(*t))).abs() < 1e-13, "{z} {t}");
            let wanted = 0.3 * (m * rate(*t) + c * h(*t)) - 0.2 * m * h(*t);
            assert!((free.values[(k, 0)] - wanted).abs() < 1e-14, "{z} {t}");
        }
    }
}

/// Half a sine in straight pieces, with jumps in front: the same straight pieces as an input of the nonlinear
/// simulation.
#[test]
fn an_arbitrary_load_against_integration() {
    let model = Oscillator::damped(0.05);
    let mut points = vec![(0.5, 0.0), (0.5, 2.0), (0.8, 1.0)];
    points.extend((0..=30).map(|k| (0.8 + 0.1 * f64::from(k), 1.0 + 3.0 * (PI * f64::from(k) / 30.0).sin())));
    points.push((4.5, 0.0));
    let load = Load::new("force", points.clone());
    let at: Vec<f64> = times(8.0, 80).into_iter().filter(|t| (t - 0.5).abs() > 1e-9).collect();
    let found = model.space().response(&[load], &["x", "felt", "to_ground"], &[], &at).unwrap();
    let value = |t: f64| {
        let next = points.partition_point(|(at, _)| *at <= t);
        if next == 0 || next == points.len() {
            return 0.0;
        }
        let ((a, p), (b, q)) = (points[next - 1], points[next]);
        p + (q - p) * (t - a) / (b - a)
    };
    let mut worst = 0.0f64;
    // Piece by piece, so that no step passes a corner.
    let mut state = model.rest();
    let mut corners: Vec<f64> = points.iter().map(|point| point.0).chain([0.0, 8.0]).collect();
    corners.sort_by(f64::total_cmp);
    corners.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
    for pair in corners.windows(2) {
        let middle = 0.5 * (pair[0] + pair[1]);
        let (base, slope) = (value(middle), (value(middle + 1e-3) - value(middle)) / 1e-3);
        let law = move |t: f64, _: &State<Oscillator>| [base + slope * (t - middle), 0.0, 0.0];
        let start = model
            .state()
            .at_time(pair[0])
            .x(state.x())
            .x_rate(state.x_rate())
            .force(law(pair[0], &state)[0])
            .base(0.0)
            .base_rate(0.0)
            .build()
            .unwrap();
        let motion = model.simulate(start).until(pair[1]).tolerance(1e-12).inputs(law).run().unwrap();
        for (k, t) in at.iter().enumerate().filter(|(_, t)| **t > pair[0] && **t < pair[1]) {
            let there = motion.at(*t);
            worst = worst.max((there.x() - found.values[(k, 0)]).abs());
            worst = worst.max((motion.output("felt", *t).unwrap() - found.values[(k, 1)]).abs());
            worst = worst.max((motion.output("to_ground", *t).unwrap() - found.values[(k, 2)]).abs());
        }
        state = motion.end();
    }
    assert!(worst < 1e-10, "{worst:e}");
}

/// All modes are the whole motion; three of ten nearly, for a slow load.
#[test]
fn superposition_of_modes_against_direct_integration() {
    let chain = Chain::between([1.0, 0.0], 0.05, 0.0);
    let modes = chain.linearize(&chain.rest()).unwrap().normal_modes().unwrap();
    let at = times(30.0, 60);
    let load = |input: &str| [Load::new(input, [(0.0, 0.0), (15.0, 1.0), (40.0, 1.0)])];
    let direct = chain
        .simulate(chain.rest())
        .until(30.0)
        .tolerance(1e-11)
        .inputs(|t, _| [(t / 15.0).min(1.0)])
        .run()
        .unwrap();
    let whole =
        chain.state_space(&chain.rest()).unwrap().response(&load("push"), &["x[9]"], &[], &at).unwrap();
    let error = |count: usize| {
        let found = modes.superposition(count).unwrap().response(&load("x[9]"), &["x[9]"], &[], &at).unwrap();
        at.iter()
            .enumerate()
            .map(|(k, t)| (found.values[(k, 0)] - direct.at(*t).x(9)).abs())
            .fold(0.0, f64::max)
    };
    let of_whole = at
        .iter()
        .enumerate()
        .map(|(k, t)| (whole.values[(k, 0)] - direct.at(*t).x(9)).abs())
        .fold(0.0, f64::max);
    let size = direct.at(30.0).x(9);
    assert!(of_whole < 1e-8 && error(10) < 1e-8, "{of_whole:e} {:e}", error(10));
    let (one, three, six) = (error(1), error(3), error(6));
    assert!(one > 3.0 * three && three > 2.0 * six && three < 0.08 * size, "{one} {three} {six} of {size}");
    assert!(matches!(modes.superposition(11), Err(VibrationError::TooFew { .. })));
}

/// Two equal oscillators, weakly coupled, beat: cos ω̄t cos Δt and sin ω̄t sin Δt.
#[test]
fn beating() {
    // Only masses 4 and 5 of a chain whose other springs are cut: each on its own spring would need another
    // model; here matrices of one's own.
    let (k, coupling) = (100.0, 2.0);
    let a = nalgebra::DMatrix::from_row_slice(
        4,
        4,
        &[
            0.0,
            0.0,
            1.0,
            0.0, //
            0.0,
            0.0,
            0.0,
            1.0, //
            -k - coupling,
            coupling,
            0.0,
            0.0, //
            coupling,
            -k - coupling,
            0.0,
            0.0,
        ],
    );
    let b = nalgebra::DMatrix::zeros(4, 1);
    let space =
        StateSpace::from_matrices(a, b, nalgebra::DMatrix::identity(4, 4), nalgebra::DMatrix::zeros(4, 1))
            .unwrap();
    let at = times(40.0, 400);
    let found = space.response(&[], &["y[0]", "y[1]"], &[("x[0]", 1.0)], &at).unwrap();
    let (low, high) = (k.sqrt(), (k + 2.0 * coupling).sqrt());
    let (mean, half) = (0.5 * (low + high), 0.5 * (high - low));
    for (row, t) in at.iter().enumerate() {
        assert!((found.values[(row, 0)] - (mean * t).cos() * (half * t).cos()).abs() < 1e-11);
        assert!((found.values[(row, 1)] - (mean * t).sin() * (half * t).sin()).abs() < 1e-11);
    }
}

/// Driven without damping (Rao, §3.3): t sin ωt/(2mω) on its frequency, 2F sin((ω + Ω)t/2) sin((ω − Ω)t/2)/(m
/// (ω² − Ω²)) beside it, which beats; by the motion, and by a matrix that has the force among its states, on
/// the frequency a defective one.
#[test]
fn undamped_resonance_grows_and_beats_beside() {
    let (m, w) = (3.0, 2.0f64);
    let model = Oscillator::damped(0.0);
    let at = times(40.0, 200);
    for drive in [2.0, 2.0 + 1e-6, 1.9, 2.3] {
        let closed = |t: f64| {
            let half = 0.5 * (w - drive) * t;
            let sinc = if half == 0.0 { 1.0 } else { half.sin() / half };
            (0.5 * (w + drive) * t).sin() * sinc * t / (m * (w + drive))
        };
        let start = model.state().force(1.0).base(0.0).base_rate(0.0).build().unwrap();
        let law = move |t: f64, _: &State<Oscillator>| [(drive * t).cos(), 0.0, 0.0];
        let motion = model.simulate(start).until(40.0).tolerance(1e-13).inputs(law).run().unwrap();
        let mut a = nalgebra::DMatrix::zeros(4, 4);
        (a[(0, 1)], a[(1, 0)], a[(1, 2)], a[(2, 3)], a[(3, 2)]) = (1.0, -w * w, 1.0 / m, 1.0, -drive * drive);
        let out = nalgebra::DMatrix::from_row_slice(1, 4, &[1.0, 0.0, 0.0, 0.0]);
        let [into, none] = [nalgebra::DMatrix::zeros(4, 1), nalgebra::DMatrix::zeros(1, 1)];
        let space = StateSpace::from_matrices(a, into, out, none).unwrap();
        let found = space.response(&[], &["y[0]"], &[("x[2]", 1.0)], &at).unwrap();
        for (k, t) in at.iter().enumerate() {
            assert!(
                (found.values[k] - closed(*t)).abs() < 1e-11,
                "{drive} {t}: {:e}",
                found.values[k] - closed(*t)
            );
            let moved = motion.at(*t).x();
            assert!((moved - closed(*t)).abs() < 1e-10, "{drive} {t}: {:e}", moved - closed(*t));
        }
    }
}

#[test]
fn loads_and_times_that_cannot_be_are_refused() {
    let space = Oscillator::damped(0.1).space();
    let at = |times: &[f64]| space.step_response("force", "x", times).unwrap_err();
    assert!(matches!(at(&[-1.0]), VibrationError::Value { .. }));
    assert!(matches!(at(&[1.0, 0.5]), VibrationError::Value { .. }));
    assert!(matches!(at(&[f64::NAN]), VibrationError::Value { .. }));
    let load = |points: Vec<(f64, f64)>| {
        space.response(&[Load::new("force", points)], &["x"], &[], &[1.0]).unwrap_err()
    };
    assert!(matches!(load(vec![(0.0, 1.0), (-1.0, 1.0)]), VibrationError::Value { .. }));
    assert!(matches!(load(vec![(0.0, f64::INFINITY), (1.0, 1.0)]), VibrationError::Value { .. }));
    // A load is zero beyond its points: of one it would be zero always.
    let few = load(vec![(0.0, 5.0)]);
    assert!(matches!(few, VibrationError::TooFew { needed: 2, .. }));
    assert_eq!(few.to_string(), "too few points of a load: 1; at least 2 are needed");
    // An acceleration contains the impulse itself.
    let refused = space.impulse_response("force", "felt", &[0.0]).unwrap_err();
    assert!(matches!(refused, VibrationError::Feedthrough { .. }), "{refused}");
    // What grows beyond all numbers is no result.
    let one = |x: f64| nalgebra::DMatrix::from_element(1, 1, x);
    let growing = StateSpace::from_matrices(one(1.0), one(1.0), one(1.0), one(0.0)).unwrap();
    assert!(growing.impulse_response("w[0]", "y[0]", &[10.0, 1000.0]).is_err());
}

#[test]
fn spectra_show_amplitudes() {
    let (n, interval) = (1000, 0.01);
    let resolution = TAU / 10.0;
    let sine = |bin: f64| -> Vec<f64> {
        (0..n).map(|k| 0.5 + 3.0 * (bin * resolution * interval * f64::from(k) + 0.4).cos()).collect()
    };
    for (window, beside) in [(Window::Rectangular, 0.37), (Window::Hann, 0.16), (Window::FlatTop, 0.002)] {
        let middle = Spectrum::of(&sine(40.0), interval, window).unwrap();
        assert!(
            (middle.amplitudes[40] - 3.0).abs() < 1e-12 && (middle.amplitudes[0] - 0.5).abs() < 1e-12,
            "{window:?}"
        );
        assert!((middle.phases[40] - 0.4).abs() < 1e-12 && (middle.resolution - resolution).abs() < 1e-15);
        assert_eq!(middle.highest(1)[0].0, middle.frequencies[40]);
        assert_eq!(middle.frequencies.len(), 501);
        // Between two bins, at worst.
        let off =
            Spectrum::of(&sine(40.5), interval, window).unwrap().amplitude_near(40.5 * resolution).unwrap();
        assert!(
            (off / 3.0 - 1.0).abs() < beside && (beside < 0.01 || (off / 3.0 - 1.0).abs() > 0.9 * beside),
            "{window:?} {off}"
        );
    }
    let spectrum = Spectrum::of(&sine(40.0), interval, Window::Hann).unwrap();
    // Half the sampling rate is π/0.01.
    assert!(spectrum.amplitude_near(314.0).is_ok());
    let refused = spectrum.amplitude_near(400.0).unwrap_err();
    assert!(
        matches!(refused, VibrationError::BeyondNyquist { .. })
            && refused.to_string().contains("sample more often")
    );
    assert!(matches!(Spectrum::of(&[1.0; 3], 0.1, Window::Hann), Err(VibrationError::TooFew { .. })));
    assert!(matches!(
        Spectrum::of(&[1.0, 2.0, f64::NAN, 1.0], 0.1, Window::Hann),
        Err(VibrationError::Value { .. })
    ));
    assert!(matches!(Spectrum::of(&[1.0; 9], 0.0, Window::Hann), Err(VibrationError::Value { .. })));
}

/// A mean shows in as many bins as its window has cosines: it is no peak, however large, and hides none
/// beyond them.
#[test]
fn a_mean_is_no_peak() {
    let (n, interval) = (1000, 0.01);
    let resolution = TAU / 10.0;
    let of = |mean: f64, bin: f64, phase: f64, window: Window| {
        let sine = |k: i32| mean + 0.1 * (bin * resolution * interval * f64::from(k) + phase).sin();
        Spectrum::of(&(0..n).map(sine).collect::<Vec<_>>(), interval, window).unwrap()
    };
    // Scalloping at most, and the bins of the lobe.
    for (window, least, lobe) in
        [(Window::Rectangular, 0.6, 1), (Window::Hann, 0.84, 2), (Window::FlatTop, 0.9989, 5)]
    {
        for mean in [0.0, 5.0, -5.0, 1e4] {
            let spectrum = of(mean, 7.77 / resolution, 0.0, window);
            let (frequency, amplitude) = spectrum.highest(1)[0];
            assert!((frequency - 7.77).abs() < 0.51 * resolution, "{window:?} {mean}: {frequency}");
            // Leakage of the negative frequency, too, where nothing fades.
            assert!(amplitude > 0.1 * least && amplitude < 0.1004, "{window:?} {mean}: {amplitude}");
            assert!((spectrum.mean - mean).abs() < 0.1 / (PI * 12.0), "{}", spectrum.mean);
            // Only rounding of what was added differs from what is there without it.
            let alone = of(0.0, 7.77 / resolution, 0.0, window).highest(3);
            for ((f, a), (g, b)) in spectrum.highest(3).into_iter().zip(alone) {
                assert!(
                    f == g && (a - b).abs() < 1e-14 * (1.0 + mean.abs()),
                    "{window:?} {mean}: {f} {a}, {g} {b}"
                );
            }
            // Right beside the lobe it is seen, within it nothing is, not even its flank.
            for phase in [0.0, 0.4, 1.0, 1.6, 2.5, 4.0] {
                let seen = of(mean, lobe as f64, phase, window);
                let (frequency, amplitude) = seen.highest(1)[0];
                assert_eq!(frequency, seen.frequencies[lobe], "{window:?} {mean} {phase}");
                assert!((amplitude - 0.1).abs() < 1e-11, "{window:?} {mean} {phase}: {amplitude}");
                let hidden = of(mean, lobe as f64 - 1.0, phase, window);
                let most = hidden.highest(1).first().map_or(0.0, |peak| peak.1);
                assert!(most < 1e-10, "{window:?} {mean} {phase}: {most}");
            }
        }
        // The chart leaves it out as well.
        let drawn = |mean: f64| of(mean, 7.77 / resolution, 0.0, window).chart("x", []).to_svg();
        assert_eq!(drawn(5.0), drawn(0.0), "{window:?}");
    }
}

/// A simulated steady motion beside the analytic response.
#[test]
fn the_spectrum_of_a_motion_is_the_response() {
    let model = Oscillator::damped(0.08);
    let forces = [(1.5, 4.0), (2.5, 1.0)];
    let law =
        move |t: f64, _: &State<Oscillator>| [forces.iter().map(|(w, f)| f * (w * t).cos()).sum(), 0.0, 0.0];
    let start = model.state().force(5.0).base(0.0).base_rate(0.0).build().unwrap();
    // The start has died away after 200 s, by e^{-32}; then 20 periods of the slower difference.
    let end = 200.0 + 20.0 * TAU;
    let motion = model.simulate(start).until(end).tolerance(1e-11).inputs(law).run().unwrap();
    let n = 2000;
    let interval = 20.0 * TAU / f64::from(n);
    let samples: Vec<f64> =
        motion.sample((0..n).map(|k| 200.0 + interval * f64::from(k))).map(|s| s.x()).collect();
    let response = model.space().frequency_response("force", "x", &[1.5, 2.5]).unwrap();
    for window in [Window::Rectangular, Window::Hann, Window::FlatTop] {
        let spectrum = Spectrum::of(&samples, interval, window).unwrap();
        for (k, (frequency, force)) in forces.iter().enumerate() {
            let wanted = force * response.values[k].norm();
            assert!(
                (spectrum.amplitude_near(*frequency).unwrap() / wanted - 1.0).abs() < 1e-8,
                "{window:?} {frequency}"
            );
        }
        assert!(spectrum.chart("x", [(1.5, 1.0)]).to_svg().contains("analytic"));
    }
}
