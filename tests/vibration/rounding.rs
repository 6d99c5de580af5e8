//! What rounding leaves, and the units of a model, decide about nothing: what is reached, free, damped, unique, or whirls.

use dynamics::analysis::{Banded, Campbell, VibrationError, lowest_modes};
use dynamics::prelude::*;
use nalgebra::DMatrix;

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
    assert!(ratios[1..].iter().zip(&modes.frequencies[1..]).all(|(z, w)| (z / (0.015 * w) - 1.0).abs() < 1e-11));
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
        assert_eq!(found, Err(VibrationError::NotDefinite { matrix: "stiffness", row: 1 }), "{soft:e} {stiff:e}");
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
        modes.iter().flat_map(|modes| modes.iter().take(2).map(|mode| mode.whirl.unwrap())).collect::<Vec<_>>()
    };
    let (soft, stiff) = (whirl(1e3), whirl(1e14));
    assert!(soft.iter().any(|whirl| whirl.abs() > 0.1));
    assert!(soft.iter().zip(&stiff).all(|(a, b)| (a - b).abs() < 1e-6), "{soft:?} {stiff:?}");
}
