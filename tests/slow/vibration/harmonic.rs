//! Steady sines: one degree of freedom in full, and where there is no steady response.

use dynamics::analysis::{Excitation, VibrationError, frequencies};
use dynamics::prelude::*;
use nalgebra::Complex;

use crate::models::Oscillator;

/// Receptance, mobility, accelerance, force to the ground and transmissibility of every damping regime (Rao,
/// *Mechanical Vibrations*, §3.4–3.6).
#[test]
fn responses_of_every_damping_regime() {
    for ratio in [0.0, 0.01, 0.3, 1.0, 2.5] {
        let model = Oscillator::damped(ratio);
        let space = model.space();
        for r in [0.0, 0.1, 0.7, 0.999, 1.3, 2.0f64.sqrt(), 10.0] {
            let s = Complex::new(0.0, 2.0 * r);
            let dynamic = s * s * model.m + s * model.c + model.k;
            let (ground, one) = (s * model.c + model.k, Complex::new(1.0, 0.0));
            let of = |input: Excitation, output: &str| {
                space.frequency_response(input, output, &[2.0 * r]).unwrap()
            };
            for (output, wanted) in
                [("x", one), ("x_rate", s), ("x_acceleration", s * s), ("felt", s * s), ("to_ground", ground)]
            {
                let (wanted, found) = (wanted / dynamic, of("force".into(), output));
                let error = (found.values[0] - wanted).norm();
                assert!(
                    error <= 3e-14 * wanted.norm() / (1.0 - r).abs() && error <= found.uncertainty[0],
                    "{ratio} {r} {output}: {error:e}"
                );
            }
            let moved = of(Excitation::moved("base", "base_rate"), "x").values[0];
            assert!((moved - ground / dynamic).norm() <= 3e-14 * moved.norm() / (1.0 - r).abs());
            // Isolation begins at √2, whatever the damping.
            if r == 2.0f64.sqrt() {
                assert!((moved.norm() - 1.0).abs() < 1e-14);
            }
        }
    }
}

/// ω_peak = ω_n √(1 − 2ζ²), |H| = 1/(2 k ζ √(1 − ζ²)), and the half-power points by the closed form.
#[test]
fn peaks_and_bandwidths() {
    for ratio in [1e-6, 0.01, 0.2, 0.6] {
        let model = Oscillator::damped(ratio);
        let peaks = model.space().resonances("force", "x").unwrap();
        assert_eq!(peaks.len(), 1);
        let z = ratio * ratio;
        let wanted = 2.0 * (1.0 - 2.0 * z).sqrt();
        let magnitude = 1.0 / (2.0 * model.k * ratio * (1.0 - z).sqrt());
        // Rounding of s − A, in parts of the damping, moves the peak.
        assert!(
            (peaks[0].frequency - wanted).abs() < 1e-13 * wanted,
            "{ratio} {:e}",
            peaks[0].frequency - wanted
        );
        assert!((peaks[0].magnitude - magnitude).abs() < 1e-15 / ratio * magnitude, "{ratio}");
        let beside = |sign: f64| 2.0 * (1.0 - 2.0 * z + sign * 2.0 * ratio * (1.0 - z).sqrt()).sqrt();
        match peaks[0].half_power {
            Some([below, above]) => {
                assert!((below - beside(-1.0)).abs() < 1e-13 && (above - beside(1.0)).abs() < 1e-13);
                let quality = peaks[0].quality().unwrap();
                assert!((quality * 2.0 * ratio - 1.0).abs() < 3.0 * ratio + 1e-8);
            }
            // 1/(4k²) of the static response remains above half of the peak's.
            None => assert!(beside(-1.0).is_nan() && ratio == 0.6),
        }
        let gain = model.space().largest_response("force", "x").unwrap();
        assert!(
            (gain.magnitude - magnitude).abs() < 1e-14 / ratio * magnitude
                && gain.bound < magnitude * 1.000_002
        );
    }
    // Above ζ = 1/√2 there is no peak: the largest response is the static one.
    let model = Oscillator::damped(0.8);
    assert!(model.space().resonances("force", "x").unwrap().is_empty());
    let gain = model.space().largest_response("force", "x").unwrap();
    assert!(gain.frequency == 0.0 && (gain.magnitude - 1.0 / model.k).abs() < 1e-16);
    // The acceleration answers most at no finite frequency, where damping is large.
    let gain = model.space().largest_response("force", "felt").unwrap();
    assert!(gain.frequency.is_infinite() && (gain.magnitude - 1.0 / 3.0).abs() < 1e-15);
}

/// A base that shakes (Rao, §3.6): the peak of transmissibility is at r² = (√(1 + 8ζ²) − 1)/(4ζ²), for every
/// ζ, and dies out nowhere.
#[test]
fn peaks_of_what_a_shaking_base_transmits() {
    for ratio in [0.01f64, 0.3, 1.0, 2.0] {
        let peaks = Oscillator::damped(ratio)
            .space()
            .resonances(Excitation::moved("base", "base_rate"), "x")
            .unwrap();
        let z = ratio * ratio;
        let r = (((1.0 + 8.0 * z).sqrt() - 1.0) / (4.0 * z)).sqrt();
        let wanted = ((1.0 + 4.0 * z * r * r) / ((1.0 - r * r).powi(2) + 4.0 * z * r * r)).sqrt();
        assert_eq!(peaks.len(), 1, "{ratio}: {peaks:?}");
        assert!(
            (peaks[0].frequency - 2.0 * r).abs() < 1e-10
                && (peaks[0].magnitude - wanted).abs() < 1e-11 * wanted,
            "{ratio}: {peaks:?} {r}"
        );
    }
}

/// A cause that enters by its place, its rate and its acceleration: s⁰, s¹ and s² of the three responses.
#[test]
fn three_inputs_of_one_cause() {
    let space = Oscillator::damped(0.2).space();
    let of = |input: Excitation| space.frequency_response(input, "to_ground", &[1.7]).unwrap().values[0];
    let s = Complex::new(0.0, 1.7);
    let wanted = of("base".into()) + s * of("base_rate".into()) + s * s * of("force".into());
    let found = of(Excitation::moved("base", "base_rate").with_acceleration("force"));
    assert!((found - wanted).norm() < 1e-14 * wanted.norm(), "{found} {wanted}");
}

#[test]
fn the_phase_passes_half_a_turn_without_a_jump() {
    let space = Oscillator::damped(0.05).space();
    let response =
        space.frequency_response("force", "x_acceleration", &frequencies(0.02, 200.0, 500)).unwrap();
    let phase = response.phase();
    assert!((phase[0].abs() - std::f64::consts::PI).abs() < 1e-2);
    assert!(((phase[0] - phase[499]) - std::f64::consts::PI).abs() < 2e-2);
    assert!(phase.windows(2).all(|pair| pair[1] < pair[0] && pair[0] - pair[1] < 0.6));
    assert_eq!((response.frequencies[0], response.frequencies[499]), (0.02, 200.0));
    for svg in [response.bode().to_svg(), response.nyquist().to_svg()] {
        assert!(svg.contains("Response of x_acceleration to force"));
    }
}

/// Of a resonance between two frequencies the chart goes through the top, 1/(m·2ζω₀²√(1 − ζ²)); what was
/// asked for stays as it was.
#[test]
fn peaks_between_the_frequencies_are_in_the_chart() {
    let damping = 1e-4;
    let space = Oscillator::damped(damping).space();
    let asked = frequencies(0.1, 30.0, 40);
    let response = space.frequency_response("force", "x", &asked).unwrap();
    assert_eq!((&response.frequencies, response.values.len()), (&asked, asked.len()));
    let highest = response.peaks.iter().map(|(_, value)| value.norm()).fold(0.0, f64::max);
    let found = space.resonances("force", "x").unwrap()[0].magnitude;
    assert!((highest / found - 1.0).abs() < 1e-6, "{highest} {found}");
    assert!(response.magnitude().into_iter().fold(0.0, f64::max) < 0.01 * found, "the frequencies miss it");
    // In each panel as many points as were asked for, and more.
    assert!(response.peaks.len() > 20 && response.peaks.is_sorted_by(|a, b| a.0 < b.0));
    // Fine frequencies need no others; of a peak without height the flanks are drawn.
    let fine = space.frequency_response("force", "x", &frequencies(1.999, 2.001, 200)).unwrap();
    assert!(fine.peaks.is_empty());
    let undamped = Oscillator::damped(0.0).space().frequency_response("force", "x", &asked).unwrap();
    assert!(!undamped.peaks.is_empty() && undamped.peaks.iter().all(|(_, value)| value.norm().is_finite()));
}

#[test]
fn an_undamped_resonance_is_named_and_beside_it_the_loss_of_digits() {
    let space = Oscillator::damped(0.0).space();
    let refused = space.frequency_response("force", "x", &[1.0, 2.0]).unwrap_err();
    let VibrationError::Resonance { frequency, eigenvalue, .. } = &refused else { panic!("{refused}") };
    assert!(*frequency == 2.0 && (eigenvalue.im.abs() - 2.0).abs() < 1e-15);
    assert!(refused.to_string().contains("the response is infinite"), "{refused}");
    // 1e-8 beside it half of the digits are left, and the bound says so.
    let found = space.frequency_response("force", "x", &[2.0 + 1e-8]).unwrap();
    let wanted = 1.0 / (3.0 * (4.0 - (2.0f64 + 1e-8).powi(2)));
    let error = (found.values[0].re - wanted).abs();
    assert!(
        error <= found.uncertainty[0]
            && found.uncertainty[0] < 1e-6 * wanted.abs()
            && found.uncertainty[0] > 1e-10 * wanted.abs()
    );
    // No steady response, no peak.
    assert!(matches!(space.resonances("force", "x"), Err(VibrationError::Unstable { .. })));
    assert!(matches!(space.frequency_response("force", "x", &[-1.0]), Err(VibrationError::Value { .. })));
    assert!(matches!(space.frequency_response("force", "x", &[f64::NAN]), Err(VibrationError::Value { .. })));
}

mod absorber {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, z: m)]
    #[inputs(force: N)]
    #[units(m: kg, k: N / m, c: N * s / m)]
    pub(super) struct Absorber {
        pub(super) m: [f64; 2],
        pub(super) k: [f64; 2],
        pub(super) c: f64,
    }
    #[dynamics]
    impl Absorber {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m[0] * q.x.dt().powi(2) + 0.5 * self.m[1] * q.z.dt().powi(2)
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k[0] * q.x.powi(2) + 0.5 * self.k[1] * (q.z - q.x).powi(2)
        }
        #[dissipation]
        fn damper(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.c * (q.z - q.x).dt().powi(2)
        }
        #[force]
        fn shaker(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, q.force)
        }
    }
}

/// Den Hartog's optimum (*Mechanical Vibrations*, §3.3): tuned to 1/(1 + μ), the fixed points are equally
/// high, √(1 + 2/μ) of the static deflection, at r² = (1 ∓ √(μ/(2 + μ)))/(1 + μ) for every damping; with ζ² =
/// 3μ/(8 (1 + μ)³) the peaks stand nearly there.
#[test]
fn den_hartogs_absorber() {
    let mu = 0.05f64;
    let tuning = 1.0 / (1.0 + mu);
    let with =
        |ratio: f64| absorber::Absorber { m: [1.0, mu], k: [1.0, mu * tuning * tuning], c: 2.0 * mu * ratio };
    let space = |ratio: f64| {
        let model = with(ratio);
        model.state_space(&model.state().force(0.0).build().unwrap()).unwrap()
    };
    let high = (1.0 + 2.0 / mu).sqrt();
    for sign in [-1.0, 1.0] {
        let fixed = ((1.0 + sign * (mu / (2.0 + mu)).sqrt()) / (1.0 + mu)).sqrt();
        for ratio in [0.01, 0.1, 0.3, 2.0] {
            let found = space(ratio).frequency_response("force", "x", &[fixed]).unwrap().values[0].norm();
            assert!((found - high).abs() < 1e-12 * high, "{ratio} {found} {high}");
        }
    }
    let optimal = (3.0 * mu / (8.0 * (1.0 + mu).powi(3))).sqrt();
    let peaks = space(optimal).resonances("force", "x").unwrap();
    assert_eq!(peaks.len(), 2);
    assert!(peaks.iter().all(|peak| (peak.magnitude / high - 1.0).abs() < 0.005), "{peaks:?}");
    // Too little damping, and too much: higher.
    for ratio in [0.3 * optimal, 3.0 * optimal] {
        let gain = space(ratio).largest_response("force", "x").unwrap();
        assert!(gain.magnitude > 1.5 * high);
    }
    // Undamped, the absorber's own frequency stops the mass.
    let still = space(0.0).frequency_response("force", "x", &[tuning]).unwrap();
    assert!(still.values[0].norm() < 1e-14);
}
