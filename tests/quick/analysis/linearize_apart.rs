//! Small motions of parts that are not coupled: no part is judged by the size of another, and what has no one
//! linear model is refused.

use dynamics::analysis::LinearizeError;
use dynamics::prelude::*;

/// Two masses on springs that are not coupled, with a stop that begins at `edge`, and a spring that is
/// shaken.
mod pair {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m, y: m)]
    #[units(m: kg, k: N / m, stop: N / m, drag: N * s^2 / m^2, edge: m, shaken: N / m, speed: rad / s)]
    pub(super) struct Pair {
        pub(super) m: f64,
        pub(super) k: [f64; 2],
        pub(super) stop: f64,
        pub(super) drag: f64,
        pub(super) edge: f64,
        pub(super) shaken: f64,
        pub(super) speed: f64,
    }
    #[dynamics]
    impl Pair {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            let second = self.k[1] + self.shaken * (self.speed * q.t).cos();
            0.5 * self.k[0] * q.x.powi(2) + 0.5 * second * q.y.powi(2)
        }
        #[potential]
        fn stop(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.stop * (q.y - self.edge).max(0.0).powi(2)
        }
        #[force]
        fn drag(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x, -self.drag * q.x.dt().abs() * q.x.dt())
        }
    }
}

#[test]
fn masses_that_are_not_coupled_are_judged_apart() {
    use pair::Pair;
    let still = Pair { m: 1.0, k: [1e6; 2], stop: 0.0, drag: 0.0, edge: 1.0, shaken: 0.0, speed: 0.0 };
    // An equilibrium that was iterated for: one mass stands still, the other nearly.
    let linear = still.linearize(&still.state().x(1e-10).build().unwrap()).unwrap();
    assert_eq!(linear.coordinates, linear.velocities);
    assert_eq!((linear.stiffness[(0, 1)], linear.conservative().unwrap()[(0, 0)]), (0.0, 1e6));
    assert!(linear.eigenvalues().unwrap().iter().all(|x| x.re == 0.0 && x.im.abs() == 1e3));
    let twice = still.linearize_in(&still.state().build().unwrap(), &["y", "y"]).unwrap();
    assert_eq!(twice.coordinates.iter().map(|q| q.name).collect::<Vec<_>>(), ["y", "x"]);
    // The instability of what is soft is not lost beside what is stiff.
    let soft = Pair { k: [1e16, -1.0], ..still.clone() };
    let found = soft.linearize(&soft.state().build().unwrap()).unwrap().eigenvalues().unwrap();
    assert!((found[3].re - 1.0).abs() < 1e-14, "{found:?}");
    // Shaken, in whole turns over a hundredth of a second or beside a stiff spring, there are no constant
    // coefficients.
    for (k, speed) in [([1.0, 1.0], 1e3 * std::f64::consts::TAU), ([1e8, 1.0], 2.0)] {
        let shaken = Pair { k, shaken: 0.5, speed, ..still.clone() };
        let refused = shaken.linearize(&shaken.state().build().unwrap()).unwrap().eigenvalues();
        assert!(matches!(refused, Err(LinearizeError::Varies { .. })), "{refused:?}");
    }
    // At the edge of a stop each side has a stiffness of its own.
    let edge = Pair { stop: 50.0, edge: 0.0, ..still.clone() };
    let refused = edge.linearize(&edge.state().build().unwrap());
    assert!(matches!(refused, Err(LinearizeError::Corner)), "{refused:?}");
    // Drag by |v| v has none: it vanishes on both.
    let slow = Pair { drag: 3.0, ..still };
    assert_eq!(slow.linearize(&slow.state().build().unwrap()).unwrap().damping.amax(), 0.0);
}
