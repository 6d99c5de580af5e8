//! Rotors: Jeffcott's with internal damping, and a gyroscopic disk, against closed forms.

use dynamics::analysis::{Campbell, Linearization, LinearizeError, VibrationError};
use dynamics::prelude::*;
use nalgebra::Complex;

/// m z̈ + (c_e + c_i) ż + (k − i c_i Ω) z = 0, z = x + i y.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, k: N / m, external: N * s / m, internal: N * s / m, speed: rad / s)]
struct Jeffcott {
    m: f64,
    k: f64,
    external: f64,
    internal: f64,
    speed: f64,
}
#[dynamics]
impl Jeffcott {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn shaft(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * vec2(q.x, q.y).norm_squared()
    }
    #[dissipation]
    fn bearings(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.external * vec2(q.x, q.y).dt().norm_squared()
    }
    #[force]
    fn material(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.internal * (q.x.dt() + self.speed * q.y))
            + Force::along(q.y, -self.internal * (q.y.dt() - self.speed * q.x))
    }
}

fn jeffcott(speed: f64) -> Result<Linearization, LinearizeError> {
    let rotor = Jeffcott { m: 1.0, k: 100.0, external: 0.3, internal: 0.2, speed };
    rotor.linearize(&rotor.state().build()?)
}

/// σ of z; conjugate those of backward whirl.
fn closed(speed: f64) -> [Complex<f64>; 2] {
    let root = (Complex::new(0.0625, 0.0) - Complex::new(100.0, -0.2 * speed)).sqrt();
    [1.0, -1.0].map(|sign| -0.25 + root * sign)
}

#[test]
fn jeffcotts_rotor_with_internal_damping() {
    let speeds: Vec<f64> = (0..=40).map(f64::from).collect();
    let found = Campbell::new(&speeds, &[1.0, 2.0], &[("x", "y")], jeffcott).unwrap();
    for (speed, modes) in speeds.iter().zip(&found.modes) {
        assert_eq!(modes.len(), 2);
        for mode in modes {
            let of = closed(*speed);
            let wanted = of.map(|x| Complex::new(x.re, x.im.abs()));
            let near = wanted.iter().map(|x| (x - mode.eigenvalue).norm()).fold(f64::INFINITY, f64::min);
            assert!(near < 1e-12, "{speed}: {mode:?}");
            // The one that internal damping drives goes forward.
            match mode.whirl {
                Some(whirl) => {
                    let forward = of.iter().find(|x| x.im > 0.0).unwrap();
                    let is_forward = (mode.eigenvalue.re - forward.re).abs() < 1e-9;
                    assert!((whirl - if is_forward { 1.0 } else { -1.0 }).abs() < 1e-9, "{speed}: {mode:?}");
                }
                None => assert!(*speed == 0.0),
            }
        }
    }
    // Published: max Re σ, to 30 digits.
    for (speed, wanted) in [
        (20, -0.049_977_505_203_874_63),
        (24, -0.009_994_123_169_245_883),
        (26, 0.009_993_374_731_868_44),
        (40, 0.149_805_453_222_925_35),
    ] {
        let most = found.modes[speed].iter().map(|mode| mode.eigenvalue.re).fold(f64::NEG_INFINITY, f64::max);
        assert!((most - wanted).abs() < 1e-13, "{speed}: {most}");
    }
    // Ω_crit = ω_n (1 + c_e/c_i) = 25, whirling forward with ω_n.
    assert_eq!(found.onsets.len(), 1, "{found}");
    let onset = found.onsets[0];
    assert!(
        (onset.speed - 25.0).abs() < 1e-9 && onset.unstable_above && onset.mode.direction() == "forward",
        "{found}"
    );
    assert!((onset.mode.eigenvalue.im - 10.0).abs() < 1e-9);
    // Both whirls meet the line 1× near ω_n, and 2× near half of it, where the closed form says.
    assert_eq!(found.critical.len(), 4, "{found}");
    assert_eq!(found.critical.iter().filter(|c| c.mode.direction() == "forward").count(), 2);
    for critical in &found.critical {
        let meets = closed(critical.speed).map(|x| (x.im.abs() - critical.order * critical.speed).abs());
        assert!(meets.iter().any(|off| *off < 1e-12), "{critical:?}");
    }
    let svg = found.chart().to_svg();
    assert!(svg.contains("Campbell diagram") && svg.contains("onset"));
}

/// A disk that tilts: I_t θ̈ − i I_p Ω θ̇ + k θ = 0, θ = α + i β.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(alpha: rad, beta: rad)]
#[units(transverse: kg * m^2, polar: kg * m^2, k: N * m, speed: rad / s)]
struct Disk {
    transverse: f64,
    polar: f64,
    k: f64,
    speed: f64,
}
#[dynamics]
impl Disk {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.transverse * (q.alpha.dt().powi(2) + q.beta.dt().powi(2))
    }
    #[potential]
    fn shaft(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.alpha.powi(2) + q.beta.powi(2))
    }
    #[force]
    fn gyroscopic(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.alpha, -self.polar * self.speed * q.beta.dt())
            + Force::along(q.beta, self.polar * self.speed * q.alpha.dt())
    }
}

#[test]
fn gyroscopic_whirl_splits_and_a_flat_disk_has_no_forward_critical_speed() {
    let (transverse, k) = (0.5, 200.0);
    let study = |polar: f64| {
        let speeds: Vec<f64> = (0..=60).map(|k| 2.0 * f64::from(k)).collect();
        Campbell::new(&speeds, &[1.0, 2.0], &[("alpha", "beta")], move |speed| {
            let disk = Disk { transverse, polar, k, speed };
            disk.linearize(&disk.state().build()?)
        })
        .unwrap()
    };
    let long = study(0.3);
    for (speed, modes) in long.speeds.iter().zip(&long.modes).skip(1) {
        let half = 0.3 * speed / (2.0 * transverse);
        for mode in modes {
            let sign = if mode.direction() == "forward" { 1.0 } else { -1.0 };
            let wanted = sign * half + (half * half + k / transverse).sqrt();
            assert!((mode.eigenvalue.im - wanted).abs() < 1e-11 && mode.eigenvalue.re.abs() < 1e-12);
            assert!((mode.whirl.unwrap() - sign).abs() < 1e-9);
        }
    }
    // Ω² = k/(n² I_t ∓ n I_p), backward first.
    let at = |order: f64, sign: f64| (k / (order * order * transverse - sign * order * 0.3)).sqrt();
    let wanted = [(1.0, -1.0), (1.0, 1.0), (2.0, -1.0), (2.0, 1.0)];
    assert_eq!(long.critical.len(), 4, "{long}");
    for (critical, (order, sign)) in long.critical.iter().zip(wanted) {
        assert!((critical.speed - at(order, sign)).abs() < 1e-11 && critical.order == order, "{critical:?}");
        assert_eq!(critical.mode.direction(), if sign > 0.0 { "forward" } else { "backward" });
    }
    assert!(long.onsets.is_empty(), "what is undamped does not grow by rounding: {long}");
    // I_p > I_t: the forward whirl runs away from the line 1×.
    let flat = study(0.9);
    assert!(
        flat.critical.iter().filter(|c| c.order == 1.0).all(|c| c.mode.direction() == "backward"),
        "{flat}"
    );
}

/// Isotropic and without damping both whirls have one frequency at every speed: none is told apart, and both
/// are counted.
#[test]
fn equal_frequencies_leave_the_whirl_open() {
    let at = |speed: f64| {
        let rotor = Jeffcott { m: 1.0, k: 100.0, external: 0.0, internal: 0.0, speed };
        rotor.linearize(&rotor.state().build()?)
    };
    let found = Campbell::new(&[5.0, 9.0, 14.0], &[1.0], &[("x", "y")], at).unwrap();
    assert!(
        found.modes.iter().flatten().all(|mode| mode.whirl.is_none() && mode.direction() == "neither way")
    );
    assert!(
        found.critical.len() == 2 && found.critical.iter().all(|c| (c.speed - 10.0).abs() < 1e-12),
        "{found}"
    );
}

/// Speeds that lie above the onset have none among them, but are told to be unstable.
#[test]
fn what_is_unstable_from_the_first_speed_is_told() {
    let at = |speed: f64| {
        let rotor = Jeffcott { m: 1.0, k: 100.0, external: 0.1, internal: 0.2, speed };
        rotor.linearize(&rotor.state().build()?)
    };
    let found = |speeds: &[f64]| Campbell::new(speeds, &[1.0], &[("x", "y")], at).unwrap().to_string();
    assert!(
        found(&[16.0, 20.0]).starts_with("unstable at the first speed, 16, already"),
        "{}",
        found(&[16.0, 20.0])
    );
    assert!(!found(&[1.0, 20.0]).contains("already"));
}

#[test]
fn diagrams_that_cannot_be_are_refused() {
    let of = |speeds: &[f64], orders: &[f64], plane: (&str, &str)| {
        Campbell::new(speeds, orders, &[plane], jeffcott).unwrap_err()
    };
    assert!(matches!(of(&[1.0], &[1.0], ("x", "y")), VibrationError::TooFew { .. }));
    assert!(matches!(of(&[1.0, 1.0], &[1.0], ("x", "y")), VibrationError::Value { .. }));
    assert!(matches!(of(&[-1.0, 1.0], &[1.0], ("x", "y")), VibrationError::Value { .. }));
    assert!(matches!(of(&[0.0, 1.0], &[0.0], ("x", "y")), VibrationError::Value { .. }));
    assert!(of(&[0.0, 1.0], &[1.0], ("x", "z")).to_string().contains("no coordinate is called `z`"));
}
