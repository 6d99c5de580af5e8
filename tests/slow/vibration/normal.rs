//! Normal modes of derived models: chains, what is free, what is repeated, damping of both kinds; modes on
//! the drawing.

use dynamics::analysis::{Linearization, Mode, VibrationError};
use dynamics::output::{Animation, Film};
use dynamics::prelude::*;
use std::f64::consts::PI;

use crate::models::{CartPole, Oscillator, RodCart};

/// Ten masses on a line, springs between them and to both sides, each of its own stiffness; dampers in
/// proportion, or one to the ground.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 10])]
#[inputs(push: N)]
#[units(m: kg, k: N / m, proportional: s, one: N * s / m)]
pub(crate) struct Chain {
    pub(crate) m: f64,
    pub(crate) k: [f64; 11],
    pub(crate) proportional: f64,
    pub(crate) one: f64,
}
#[dynamics]
impl Chain {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..10 {
            sum += 0.5 * self.m * q.x[i].dt().powi(2);
        }
        sum
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.k[0] * q.x[0].powi(2) + 0.5 * self.k[10] * q.x[9].powi(2);
        for i in 1..10 {
            sum += 0.5 * self.k[i] * (q.x[i] - q.x[i - 1]).powi(2);
        }
        sum
    }
    #[dissipation]
    fn material(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = self.k[0] * q.x[0].dt().powi(2) + self.k[10] * q.x[9].dt().powi(2);
        for i in 1..10 {
            sum += self.k[i] * (q.x[i] - q.x[i - 1]).dt().powi(2);
        }
        0.5 * self.proportional * sum
    }
    #[dissipation]
    fn dashpot(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.one * q.x[2].dt().powi(2)
    }
    #[force]
    fn hand(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x[9], q.push)
    }
}

impl Chain {
    pub(crate) fn between(ends: [f64; 2], proportional: f64, one: f64) -> Self {
        let mut k = [1.0; 11];
        [k[0], k[10]] = ends;
        Self { m: 1.0, k, proportional, one }
    }
    pub(crate) fn rest(&self) -> State<Self> {
        self.state().push(0.0).build().unwrap()
    }
    fn linear(&self) -> Linearization {
        self.linearize(&self.rest()).unwrap()
    }
}

/// 2 √(k/m) sin of the published angles, and shapes that are sines.
#[test]
fn chains_between_walls_and_with_a_free_end() {
    for (ends, angle) in [
        ([1.0, 1.0], &(|j: f64| j * PI / 22.0) as &dyn Fn(f64) -> f64),
        ([1.0, 0.0], &|j| (2.0 * j - 1.0) * PI / 42.0),
    ] {
        let chain = Chain::between(ends, 0.02, 0.0);
        let modes = chain.linear().normal_modes().unwrap();
        for (k, frequency) in modes.frequencies.iter().enumerate() {
            let half = angle(k as f64 + 1.0);
            let wanted = 2.0 * half.sin();
            assert!((frequency - wanted).abs() < 1e-14, "{k}: {frequency} {wanted}");
            let shape = modes.shapes.column(k);
            let of = |i: usize| (2.0 * half * (i as f64 + 1.0)).sin();
            let size = (0..10).map(|i| of(i).powi(2)).sum::<f64>().sqrt();
            let sign = (shape[4] * of(4)).signum();
            assert!((0..10).all(|i| (shape[i] - sign * of(i) / size).abs() < 1e-13), "{k}");
        }
        // ζ = β ω/2, by the damped modes, too.
        let ratios = modes.damping_ratios().unwrap();
        let damped: Vec<Mode> = chain.linear().modes().unwrap();
        for k in 0..10 {
            assert!((ratios[k] - 0.01 * modes.frequencies[k]).abs() < 1e-14);
            assert!(
                (damped[k].damping_ratio() - ratios[k]).abs() < 1e-12
                    && (damped[k].frequency() - modes.frequencies[k]).abs() < 1e-12
            );
        }
        let everywhere: Vec<(String, f64)> = (0..10).map(|i| (format!("x[{i}]"), 1.0)).collect();
        let everywhere: Vec<(&str, f64)> =
            everywhere.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let masses = modes.effective_masses(&everywhere).unwrap();
        assert!((masses.iter().sum::<f64>() - 10.0).abs() < 1e-13);
        if ends[1] == 1.0 {
            // What is antisymmetric takes no part.
            assert!(masses.iter().skip(1).step_by(2).all(|mass| *mass < 1e-28));
        } else {
            // A bar has 8/π²; a chain of ten a little more.
            assert!((masses[0] / 10.0 - 8.0 / (PI * PI)).abs() < 0.05, "{}", masses[0]);
        }
        let modal = modes.modal_masses();
        let largest = modes.shapes.column(0).amax();
        assert!((modal[0] * largest * largest - 1.0).abs() < 1e-14);
    }
}

#[test]
fn what_is_free_has_the_frequency_zero_exactly() {
    let chain = Chain::between([0.0, 0.0], 0.0, 0.0);
    let modes = chain.linear().normal_modes().unwrap();
    assert_eq!((modes.rigid(), modes.frequencies[0]), (1, 0.0));
    assert!((modes.frequencies[1] - 2.0 * (PI / 20.0).sin()).abs() < 1e-14);
    assert!(modes.shapes.column(0).iter().all(|x| (x - 0.1f64.sqrt()).abs() < 1e-13));
    // It takes the whole mass along.
    let everywhere: [(&str, f64); 10] =
        ["x[0]", "x[1]", "x[2]", "x[3]", "x[4]", "x[5]", "x[6]", "x[7]", "x[8]", "x[9]"]
            .map(|name| (name, 1.0));
    let masses = modes.effective_masses(&everywhere).unwrap();
    assert!((masses[0] - 10.0).abs() < 1e-13 && masses[1..].iter().all(|mass| *mass < 1e-25));
    assert!(
        modes.participation(&[("x[10]", 1.0)]).unwrap_err().to_string().contains("no independent coordinate")
    );
}

#[test]
fn damping_that_couples_modes_is_no_ratio() {
    let modes = Chain::between([1.0, 1.0], 0.0, 0.4).linear().normal_modes().unwrap();
    assert!(modes.coupling() > 0.9);
    assert!(matches!(modes.damping_ratios(), Err(VibrationError::NoNormalModes { .. })));
    let none = Chain::between([1.0, 1.0], 0.0, 0.0).linear().normal_modes().unwrap();
    assert!(none.coupling() == 0.0 && none.damping_ratios().unwrap().iter().all(|ratio| *ratio == 0.0));
}

/// A mass on four equal springs, damped along one slanting line: two modes of one frequency.
mod repeated {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(m: kg, k: N / m, c: N * s / m, turn: s^-1)]
    pub(super) struct Mass {
        pub(super) m: f64,
        pub(super) k: [f64; 2],
        pub(super) c: f64,
        pub(super) turn: f64,
    }
    #[dynamics]
    impl Mass {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k[0] * q.x.powi(2) + 0.5 * self.k[1] * q.y.powi(2)
        }
        #[dissipation]
        fn slanting(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.c * (0.6 * q.x + 0.8 * q.y).dt().powi(2)
        }
        #[force]
        fn coriolis(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, self.m * self.turn * q.y.dt())
                + Force::along(q.y, -self.m * self.turn * q.x.dt())
        }
    }
}

#[test]
fn repeated_and_nearly_repeated_modes() {
    let modes = |stiffer: f64, turn: f64| {
        let model = repeated::Mass { m: 2.0, k: [8.0, 8.0 * (1.0 + stiffer)], c: 0.3, turn };
        model.linearize(&model.state().build().unwrap()).unwrap().normal_modes()
    };
    // Of one frequency, the vectors are turned to the line of the damper and across: one mode is damped, the
    // other not.
    let same = modes(0.0, 0.0).unwrap();
    let ratios = same.damping_ratios().unwrap();
    assert!(ratios[0].abs() < 1e-16 && (ratios[1] - 0.3 / 2.0 / (2.0 * 2.0)).abs() < 1e-15, "{ratios:?}");
    let along = same.shapes.column(1);
    assert!((along[0] / along[1] - 0.75).abs() < 1e-13);
    // Nearly of one frequency the axes decide, and damping couples them: that is said, not averaged.
    let near = modes(1e-6, 0.0).unwrap();
    assert!(near.coupling() > 0.9 && near.damping_ratios().is_err());
    // Gyroscopic terms leave no normal modes, nor does a position that falls.
    assert!(modes(0.0, 0.1).unwrap_err().to_string().contains("gyroscopic"));
    let model = CartPole { cart: 1.0, bob: 0.2, length: 0.5, g: 9.81 };
    let upright = model.linearize(&model.state().force(0.0).build().unwrap()).unwrap();
    assert!(upright.normal_modes().unwrap_err().to_string().contains("unstable"));
}

/// Critical damping: a defective pair. The conditioning says so, and responses, which take no eigenvectors,
/// are right all the same.
#[test]
fn a_defective_pair_is_reported_by_its_conditioning() {
    let of = |ratio: f64| {
        let model = Oscillator::damped(ratio);
        let modes = model.linearize(&model.rest()).unwrap().modes().unwrap();
        modes.iter().map(|mode| mode.conditioning).fold(0.0, f64::max)
    };
    assert!(
        of(0.5) < 10.0 && of(0.999_999) > 100.0 && of(1.0) > 1e6,
        "{} {} {}",
        of(0.5),
        of(0.999_999),
        of(1.0)
    );
    let times: Vec<f64> = (0..=20).map(|k| 0.2 * f64::from(k)).collect();
    let found = Oscillator::damped(1.0).space().impulse_response("force", "x", &times).unwrap();
    for (t, x) in found.of("x").unwrap() {
        assert!((x - t * (-2.0 * t).exp() / 3.0).abs() < 1e-16);
    }
}

#[test]
fn modes_move_on_the_drawing_and_stay_on_the_constraints() {
    let model = RodCart { cart: 2.0, bob: 0.7, length: 0.5, g: 9.81 };
    let rest = model.state().bob_y(-0.5).force(0.0).build().unwrap();
    let modes = model.linearize(&rest).unwrap().modes().unwrap();
    let swing = modes.iter().find(|mode| mode.eigenvalue.im > 0.0).unwrap();
    let film = model.mode_animation(&rest, swing, 0.05).unwrap();
    let [start, end] = film.span();
    assert!((end - start - 2.0 * std::f64::consts::TAU / swing.eigenvalue.im).abs() < 1e-12);
    let times: Vec<f64> = (0..=16).map(|k| end * f64::from(k) / 16.0).collect();
    let mut widest = 0.0f64;
    film.play(&times, &mut |_, q| {
        assert!((((q[1] - q[0]).powi(2) + q[2].powi(2)).sqrt() - 0.5).abs() < 1e-9);
        // The centre of mass stays.
        assert!((2.0 * q[0] + 0.7 * q[1]).abs() < 1e-3);
        widest = widest.max(q[1].abs());
    });
    assert!((widest - 0.05).abs() < 1e-3, "{widest}");
    let page = Animation::new().add(film, "").to_html().unwrap();
    assert!(page.contains("without its damping"));
    assert!(matches!(model.mode_animation(&rest, swing, f64::NAN), Err(VibrationError::Value { .. })));
    let still = modes.iter().find(|mode| mode.eigenvalue.im == 0.0).unwrap();
    assert!(matches!(model.mode_animation(&rest, still, 0.2), Err(VibrationError::NoOscillation { .. })));
}

/// What swings slowly beside something stiff is not mixed with what is free, though damping couples both.
#[test]
fn what_swings_slowly_is_not_free() {
    let mut linear = Chain::between([1.0, 1.0], 0.0, 0.0).linear();
    linear.stiffness.fill(0.0);
    linear.stiffness.fill_diagonal(1e12);
    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        linear.stiffness[(i, j)] = if i == j { 5e-7 } else { -5e-7 };
    }
    linear.damping[(0, 0)] = 0.03;
    let modes = linear.normal_modes().unwrap();
    assert!(modes.rigid() == 1 && (modes.frequencies[1] - 1e-3).abs() < 1e-17, "{:?}", modes.frequencies);
    assert!((modes.shapes[(0, 0)] - modes.shapes[(1, 0)]).abs() < 1e-14, "{}", modes.shapes);
}
