//! What rounding leaves, and the units of a model, decide about nothing: what is reached, free, damped,
//! unique, or whirls.

use dynamics::analysis::{Banded, Campbell, LinearizeError, StateSpace, VibrationError, lowest_modes};
use dynamics::prelude::*;
use nalgebra::DMatrix;

use crate::models::Oscillator;
use crate::normal::Chain;

/// A free rod, pushed and sprung at a distance from its end.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y: m, theta: rad)]
#[inputs(push: N)]
#[units(m: kg, length: m, k: N / m, at: m)]
struct Rod {
    m: f64,
    length: f64,
    k: f64,
    at: f64,
}
#[dynamics]
impl Rod {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let middle = q.y + 0.5 * self.length * q.theta;
        0.5 * self.m * middle.dt().powi(2) + self.m * self.length.powi(2) / 24.0 * q.theta.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.y + self.at * q.theta).powi(2)
    }
    #[force]
    fn hand(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.y + self.at * q.theta, q.push)
    }
}

/// At its centre of percussion no push moves the end, whatever rounding says.
#[test]
fn a_push_at_the_centre_of_percussion_does_not_reach_the_end() {
    for (m, length) in [(1.3, 0.7), (0.77, 1.1), (2.1, 0.3), (1.0, 1.7e-3), (1e5, 230.0)] {
        let space = |part: f64| {
            let rod = Rod { m, length, k: 50.0, at: part * length };
            rod.state_space(&rod.state().push(0.0).build().unwrap()).unwrap()
        };
        let at = space(2.0 / 3.0);
        let found = at.controllability(&["push"]).unwrap();
        assert_eq!(found.iter().filter(|reach| !reach.is_reached()).count(), 2, "{length}: {found:?}");
        let lqr = at.lqr().weight("y", 1.0).weight("theta", 1.0).weight("push", 1.0).solve();
        assert!(matches!(lqr, Err(VibrationError::Unstabilisable { .. })), "{lqr:?}");
        // One spring and one push at one place leave one motion of two alone wherever that is.
        assert!(space(0.6).controllability(&["push"]).unwrap().iter().any(|reach| !reach.is_reached()));
    }
}

/// A mass on two inclined rails, which are written in units of their own.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, z: m)]
#[inputs(lift: N)]
#[units(m: kg, k: N / m)]
struct Rails {
    m: f64,
    k: f64,
    large: f64,
    small: f64,
}
#[dynamics]
impl Rails {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec3(q.x, q.y, q.z).dt().norm_squared()
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * q.x.powi(2)
    }
    #[force]
    fn crane(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.z, q.lift)
    }
    #[holonomic]
    fn first(&self, q: &Coordinates<Self>) -> Expr {
        self.large * (q.y - 0.1 * q.x)
    }
    #[holonomic]
    fn second(&self, q: &Coordinates<Self>) -> Expr {
        self.small * (q.z - 0.2 * q.x)
    }
    #[output]
    fn on_first(&self, q: &Coordinates<Self>) -> Expr {
        self.large * q.reaction(Self::first)
    }
    #[output]
    fn on_second(&self, q: &Coordinates<Self>) -> Expr {
        self.small * q.reaction(Self::second)
    }
}

#[test]
fn units_of_constraints_change_no_reaction() {
    for unit in [1.0, 1e3, 1e6, 1e8] {
        let rails = Rails { m: 2.0, k: 8.0, large: unit, small: 1.0 / unit };
        let space = rails.state_space(&rails.state().lift(0.0).build().unwrap()).unwrap();
        let value = |output: &str| space.frequency_response("lift", output, &[0.5]).unwrap().values[0].re;
        // x = 0.2 lift/(k − 1.05 m ω²); m ÿ = force of the first rail, m z̈ − lift that of the second.
        let x = 0.2 / (8.0 - 1.05 * 2.0 * 0.25);
        let (first, second) = (-0.25 * 2.0 * 0.1 * x, -0.25 * 2.0 * 0.2 * x - 1.0);
        assert!((value("on_first") - first).abs() < 1e-14, "{unit:e}: {} {first}", value("on_first"));
        assert!((value("on_second") - second).abs() < 1e-14, "{unit:e}: {} {second}", value("on_second"));
    }
}

/// Dampers between bodies do not damp what all do together.
#[test]
fn what_is_free_is_not_damped_by_rounding() {
    let mut chain = Chain::between([0.0, 0.0], 0.03, 0.0);
    (1..10).for_each(|i| chain.k[i] = 1.0 + 0.3 * (i as f64).sin());
    let modes = chain.linearize(&chain.rest()).unwrap().normal_modes().unwrap();
    let ratios = modes.damping_ratios().unwrap();
    assert!(modes.rigid() == 1 && ratios[0] == 0.0, "{ratios:?}");
    assert!(
        ratios[1..].iter().zip(&modes.frequencies[1..]).all(|(z, w)| (z / (0.015 * w) - 1.0).abs() < 1e-11)
    );
    for direction in [[("x[0]", 1.0), ("x[0]", 2.0)], [("x[0]", f64::NAN), ("x[1]", 1.0)]] {
        assert!(matches!(modes.effective_masses(&direction), Err(VibrationError::Value { .. })));
    }
}

/// A spring that pushes away is no freedom, however stiff what stands beside it.
#[test]
fn negative_stiffness_is_not_freedom() {
    let ones = Banded::diagonal(&[1.0; 3]);
    for (soft, stiff) in [(-1.0, 1e8), (-1e-3, 1.0), (-1e-7, 1.0), (-1e-12, 1.0)] {
        let found = lowest_modes(&ones, &Banded::diagonal(&[stiff, soft, 2.0 * stiff]), 2);
        assert_eq!(
            found,
            Err(VibrationError::NotDefinite { matrix: "stiffness", row: 1 }),
            "{soft:e} {stiff:e}"
        );
    }
    let free = lowest_modes(&ones, &Banded::diagonal(&[0.0; 3]), 2).unwrap();
    assert!(free.frequencies.iter().all(|frequency| *frequency < 1e-7), "{free:?}");
}

/// What dies away slowly does so beside something stiff, too: no control need reach it, no weight see it.
#[test]
fn what_dies_away_slowly_needs_no_control() {
    let (stiff, slow) = (1e12, 0.01);
    let mut a = DMatrix::zeros(3, 3);
    (a[(0, 1)], a[(1, 0)], a[(1, 1)], a[(2, 2)]) = (1.0, -stiff, -1e3, -slow);
    let b = DMatrix::from_row_slice(3, 1, &[0.0, 1.0, 0.0]);
    let c = DMatrix::from_row_slice(1, 3, &[1.0, 0.0, 0.0]);
    let design = |a: &DMatrix<f64>| {
        let space = StateSpace::from_matrices(a.clone(), b.clone(), c.clone(), DMatrix::zeros(1, 1)).unwrap();
        space.lqr().weight("y[0]", 1.0).weight("w[0]", 1.0).solve()
    };
    let found = design(&a).unwrap();
    assert!((found.closed_loop.last().unwrap().re + slow).abs() < 1e-15, "{found}");
    a[(2, 2)] = slow;
    assert!(matches!(design(&a), Err(VibrationError::Unstabilisable { .. })));
}

/// Jeffcott's rotor with unequal stiffness, and an axial motion.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, z: m)]
#[units(m: kg, kx: N / m, ky: N / m, axial: N / m, external: N * s / m, internal: N * s / m, speed: rad / s)]
struct Shaft {
    m: f64,
    kx: f64,
    ky: f64,
    axial: f64,
    external: f64,
    internal: f64,
    speed: f64,
}
#[dynamics]
impl Shaft {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec3(q.x, q.y, q.z).dt().norm_squared()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.kx * q.x.powi(2) + self.ky * q.y.powi(2) + self.axial * q.z.powi(2))
    }
    #[force]
    fn damping(&self, q: &Coordinates<Self>) -> Force {
        let both = self.internal + self.external;
        Force::along(q.x, -both * q.x.dt() - self.internal * self.speed * q.y)
            + Force::along(q.y, -both * q.y.dt() + self.internal * self.speed * q.x)
    }
}

/// The axial motion, which nothing couples, changes no whirl by its stiffness.
#[test]
fn whirl_beside_something_stiff() {
    let whirl = |axial: f64| {
        let found = Campbell::new(&[12.0, 18.0, 24.0], &[], &[("x", "y")], |speed| {
            let shaft = Shaft { m: 1.0, kx: 105.0, ky: 100.0, axial, external: 0.1, internal: 0.2, speed };
            shaft.linearize(&shaft.state().build()?)
        });
        let modes = found.unwrap().modes;
        modes
            .iter()
            .flat_map(|modes| modes.iter().take(2).map(|mode| mode.whirl.unwrap()))
            .collect::<Vec<_>>()
    };
    let (soft, stiff) = (whirl(1e3), whirl(1e14));
    assert!(soft.iter().any(|whirl| whirl.abs() > 0.1));
    assert!(soft.iter().zip(&stiff).all(|(a, b)| (a - b).abs() < 1e-6), "{soft:?} {stiff:?}");
}

/// Onsets are where they are without it: Ω = ω (1 + external/internal), coupled to what is stiff or not. What
/// is coupled by p adds p²/axial to the stiffness.
#[test]
fn onsets_beside_something_stiff() {
    for (axial, pull) in [(1e4, 0.0), (1e12, 0.0), (1e16, 0.0), (1e12, 10.0), (1e15, 1e3)] {
        let speeds: Vec<f64> = (0..20).map(|k| 2.0 + 3.0 * f64::from(k)).collect();
        let found = Campbell::new(&speeds, &[1.0], &[("x", "y")], |speed| {
            let shaft = Pulled { m: 1.0, k: 100.0, axial, pull, external: 0.2, internal: 0.1, speed };
            shaft.linearize(&shaft.state().build()?)
        });
        let found = found.unwrap();
        assert_eq!(found.onsets.len(), 1, "{axial:e} {pull}: {found}");
        assert!((found.onsets[0].speed - 30.0).abs() < 2e-9, "{axial:e} {pull}: {found}");
        assert!((found.critical[0].speed - 10.0).abs() < 1e-2, "{axial:e} {pull}: {found}");
    }
}

/// The same with equal stiffnesses, and the axial motion coupled to both of the others.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, z: m)]
#[units(m: kg, k: N / m, axial: N / m, pull: N / m, external: N * s / m, internal: N * s / m, speed: rad / s)]
struct Pulled {
    m: f64,
    k: f64,
    axial: f64,
    pull: f64,
    external: f64,
    internal: f64,
    speed: f64,
}
#[dynamics]
impl Pulled {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec3(q.x, q.y, q.z).dt().norm_squared()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.x.powi(2) + q.y.powi(2))
            + 0.5 * self.axial * q.z.powi(2)
            + self.pull * q.z * (q.x + q.y)
    }
    #[force]
    fn damping(&self, q: &Coordinates<Self>) -> Force {
        let both = self.internal + self.external;
        Force::along(q.x, -both * q.x.dt() - self.internal * self.speed * q.y)
            + Force::along(q.y, -both * q.y.dt() + self.internal * self.speed * q.x)
            + Force::along(q.z, -self.external * q.z.dt())
    }
}

/// ẋ = v, v̇ = −c (v + x): x goes as e^{−t} nearly, however large c.
#[test]
fn what_is_slow_beside_something_stiff_has_its_response() {
    for c in [1e2, 1e6, 1e10, 1e14] {
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -c, -c]);
        let (b, unit) = (DMatrix::from_row_slice(2, 1, &[0.0, 1.0]), DMatrix::identity(1, 2));
        let space = StateSpace::from_matrices(a, b, unit, DMatrix::zeros(1, 1)).unwrap();
        let times = [0.0, 0.3, 1.0, 2.5];
        let found = space.response(&[], &["y[0]"], &[("x[0]", 1.0)], &times).unwrap();
        let root = (0.25 * c * c - c).sqrt();
        let (fast, slow) = (-0.5 * c - root, -c / (0.5 * c + root));
        for (k, t) in times.iter().enumerate() {
            let wanted = (fast * (slow * t).exp() - slow * (fast * t).exp()) / (fast - slow);
            assert!(
                (found.values[(k, 0)] - wanted).abs() < 1e-11,
                "{c:e} {t}: {}",
                found.values[(k, 0)] - wanted
            );
            assert!(found.uncertainty[(k, 0)] < 1e-11);
        }
    }
}

/// Two masses, a stiff spring between them and a soft one to the ground, both in one element of K: what that
/// loses is said.
#[test]
fn what_elements_have_lost_is_in_the_uncertainty() {
    for stiff in [1e6, 1e10, 1e13] {
        let mut a = DMatrix::zeros(4, 4);
        (a[(0, 2)], a[(1, 3)]) = (1.0, 1.0);
        (a[(2, 0)], a[(2, 1)], a[(3, 0)], a[(3, 1)]) = (-stiff - 2.0, stiff, stiff, -stiff);
        let b = DMatrix::zeros(4, 1);
        let space = StateSpace::from_matrices(a, b, DMatrix::identity(1, 4), DMatrix::zeros(1, 1)).unwrap();
        let found = space.response(&[], &["y[0]"], &[("x[0]", 1.0), ("x[1]", 1.0)], &[1.0, 2.0]).unwrap();
        // Together they have ω = 1, and apart move by 1/stiff.
        for (k, t) in [1.0_f64, 2.0].iter().enumerate() {
            let (off, said) = ((found.values[(k, 0)] - t.cos()).abs(), found.uncertainty[(k, 0)]);
            assert!(
                off <= said + 10.0 / stiff && said < 100.0 * stiff * f64::EPSILON,
                "{stiff:e} {t}: {off:e} {said:e}"
            );
        }
    }
}

/// An input that was not set is named, and no corner of a function looked for.
#[test]
fn inputs_without_a_value_are_named() {
    let rod = Rod { m: 1.0, length: 1.0, k: 1.0, at: 0.3 };
    let said = rod.state_space(&rod.state().y(0.1).build().unwrap()).unwrap_err();
    assert_eq!(said, VibrationError::Linearize(LinearizeError::InputNotSet { input: "push" }));
}

/// What is left of a response that has died away has its digits in one step as in many, and an error that is
/// said.
#[test]
fn what_has_died_away_keeps_its_digits() {
    // x̃ = e^{−1.2 t} sin(1.6 t)/(3 · 1.6) of the oscillator with ω = 2, ζ = 0.6.
    let space = Oscillator::damped(0.6).space();
    for t in [5.0, 25.0, 50.0, 100.0_f64] {
        let found = space.impulse_response("force", "x", &[t]).unwrap();
        let exact = (-1.2 * t).exp() * (1.6 * t).sin() / 4.8;
        let off = (found.values[0] - exact).abs();
        assert!(
            off < 1e-11 * exact.abs() && off <= found.uncertainty[0].max(1e-13 * exact.abs()),
            "{t}: {found:?} {exact:e}"
        );
    }
}

/// At 0 rad/s a free body is named as such, and not by what rounding leaves of its eigenvalue.
#[test]
fn what_is_free_has_no_response_to_what_stays() {
    let mut chain = Chain::between([0.0, 0.0], 0.03, 0.0);
    (1..10).for_each(|i| chain.k[i] = 1.0 + 0.3 * (i as f64).sin());
    let space = chain.state_space(&chain.rest()).unwrap();
    let said = space.frequency_response("x[0]", "x[1]", &[0.0]).unwrap_err();
    assert!(
        matches!(said, VibrationError::Free { .. }) && said.to_string().contains("free to move"),
        "{said}"
    );
    assert!(space.frequency_response("x[0]", "x[1]", &[0.1]).is_ok());
}
