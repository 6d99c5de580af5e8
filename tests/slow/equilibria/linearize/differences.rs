//! Matrices against differences of the constrained motion, and what is refused.

use dynamics::analysis::Linearization;
use dynamics::model::Constraints;

use super::*;

/// ∂ẋ/∂x for x = (z, v) by central differences of the constrained motion, projected back after each
/// displacement.
fn by_differences<M: Constraints>(model: &M, state: &M::State, linear: &Linearization) -> DMatrix<f64> {
    use dynamics::constrain::{project_positions, project_velocities, solve_once, with_workspace};
    use dynamics::model::Vector;
    let constants = model.constants().unwrap();
    let index = |name: &str| M::COORDINATES.iter().position(|q| q.name == name).unwrap();
    let z: Vec<usize> = linear.coordinates.iter().map(|q| index(q.name)).collect();
    let v: Vec<usize> = linear.velocities.iter().map(|q| index(q.name)).collect();
    let size = z.len() + v.len();
    // (x, ẋ) after a displacement of the unknown k.
    let at = |k: usize, step: f64| {
        let mut moved = *state;
        if k < z.len() {
            let change = linear.shape.column(k) * step;
            moved.q_mut().as_mut_slice().iter_mut().zip(change.iter()).for_each(|(q, d)| *q += d);
        } else {
            moved.u_mut().as_mut_slice()[v[k - z.len()]] += step;
        }
        with_workspace::<M, _>(|memory| {
            project_positions(model, &constants, &mut moved, memory).unwrap();
            project_velocities(model, &constants, &mut moved, memory).unwrap();
        });
        let a = solve_once(model, &constants, &moved).unwrap().accelerations;
        let (q, u, a) = (moved.q().as_slice(), moved.u().as_slice(), a.as_slice());
        let x = z.iter().map(|i| q[*i]).chain(v.iter().map(|i| u[*i]));
        let rate = z.iter().map(|i| u[*i]).chain(v.iter().map(|i| a[*i]));
        (DVector::from_iterator(size, x), DVector::from_iterator(size, rate))
    };
    let (mut places, mut rates) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
    for k in 0..size {
        // Two step sizes against each other take the error of second order away.
        let difference = |step: f64| {
            let ((x, a), (y, b)) = (at(k, step), at(k, -step));
            ((x - y) / (2.0 * step), (a - b) / (2.0 * step))
        };
        let (coarse, fine) = (difference(2e-3), difference(1e-3));
        places.set_column(k, &((4.0 * fine.0 - coarse.0) / 3.0));
        rates.set_column(k, &((4.0 * fine.1 - coarse.1) / 3.0));
    }
    rates * places.try_inverse().expect("the displacements are independent")
}

#[test]
fn a_disk_that_rolls() {
    let model = disk::DISK;
    // Anywhere on a general motion the matrices are those of the motion beside it.
    let (lean, yaw_rate, lean_rate, spin_rate) = (0.5_f64, 0.3, 0.2, 1.5);
    let start = model.state().lean(lean).yaw_rate(yaw_rate).lean_rate(lean_rate).spin_rate(spin_rate);
    let start =
        start.x_rate(yaw_rate * lean.sin() + spin_rate).y_rate(-lean_rate * lean.cos()).build().unwrap();
    for wanted in [&[][..], &["x", "lean", "y"], &["yaw", "lean", "spin"]] {
        let linear = model.linearize_in(&start, wanted).unwrap();
        let (exact, differences) = (linear.state_matrix().unwrap(), by_differences(&model, &start, &linear));
        assert!((&exact - &differences).amax() < 1e-8 * exact.amax(), "{wanted:?}: {exact} {differences}");
        assert!(linear.eigenvalues().is_err());
    }
    // Straight on: lean and yaw are decoupled from the rest; growth below spin² = g/3r, a frequency above.
    let straight = |rate: f64| {
        let start = model.state().x_rate(rate).spin_rate(rate).build().unwrap();
        model.linearize(&start).unwrap().eigenvalues().unwrap()
    };
    let critical = (1.0f64 / 3.0).sqrt();
    let growth = |rate: f64| straight(rate).iter().fold(0.0, |most: f64, x| most.max(x.re));
    let (below, above) = (growth(critical * (1.0 - 1e-6)), growth(critical * (1.0 + 1e-6)));
    assert!(above < 1e-6 && below > 5e-4, "growth {below:.1e} below, {above:.1e} above");
    // In a steady circle the coefficients are constant but for the place on the plane, on which nothing
    // depends.
    let (x_rate, yaw_rate, spin_rate) = (0.759821250373635, -0.07665017533365781, 0.7665017533365781);
    let start =
        model.state().lean(0.08726646259971647).x_rate(x_rate).yaw_rate(yaw_rate).spin_rate(spin_rate);
    let found = model.linearize(&start.build().unwrap()).unwrap().eigenvalues().expect("steady");
    assert_eq!(found.iter().filter(|x| x.norm() > 1e-6).count(), 2, "{found:?}");
}

/// Repeated rows are no singular position, however small the mechanism is.
#[test]
fn small_mechanisms_are_as_regular_as_large_ones() {
    let frequency = |l: f64| {
        let model = double_pendulum::Bobs { m: [1.5, 0.7], l: [0.8 * l, 1.1 * l], g: 9.81 };
        let hanging = model.state().y([-0.8 * l, -1.9 * l]).build().unwrap();
        model.linearize(&hanging).unwrap_or_else(|e| panic!("{l:e}: {e}")).modes().unwrap()[0].frequency()
    };
    for l in [1e-3, 1e-4, 2e-5] {
        let (found, wanted) = (frequency(l), frequency(1.0) / l.sqrt());
        assert!((found - wanted).abs() < 1e-12 * wanted, "{l:e}: {found} instead of {wanted}");
    }
}

#[test]
fn matrices_against_differences_where_rows_repeat_others() {
    let model = double_pendulum::Bobs { m: [1.5, 0.7], l: [0.8, 1.1], g: 9.81 };
    let start = model.state().x([0.48, 0.48 + 1.1 * 0.6]).y([-0.64, -0.64 - 1.1 * 0.8]);
    let start = start.x_rate([0.64, 0.64 - 0.8]).y_rate([0.48, 0.48 - 0.6]).build().unwrap();
    let linear = model.linearize(&start).unwrap();
    let (exact, differences) = (linear.state_matrix().unwrap(), by_differences(&model, &start, &linear));
    assert!((&exact - &differences).amax() < 1e-7 * exact.amax(), "{exact} {differences}");
}

/// A spring that is gone at a time, and that the model has no value for after it.
mod fading {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: m)]
    #[units(mass: kg, k: N / m, end: s)]
    pub(super) struct Fading {
        pub(super) mass: f64,
        pub(super) k: f64,
        pub(super) end: f64,
    }
    #[dynamics]
    impl Fading {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.mass * q.x.dt().powi(2)
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * (1.0 - q.t / self.end).sqrt() * q.x.powi(2)
        }
    }
}

#[test]
fn what_is_refused() {
    let spring = fading::Fading { mass: 1.0, k: 1.0, end: 1.0 };
    let of = |t: f64| {
        spring.linearize(&spring.state().at_time(t).build().unwrap()).unwrap().eigenvalues().unwrap_err()
    };
    assert!(matches!(of(0.5), LinearizeError::Varies { .. }), "{}", of(0.5));
    assert_eq!(of(0.995), LinearizeError::Ends);

    // Circles that touch leave a direction, in which there is no position.
    let pin = TwoBars { mass: 1.0, r: 1.0, base: 2.0, g: 0.0 };
    let error = pin.linearize(&pin.state().x(1.0).build().unwrap()).unwrap_err();
    assert!(matches!(error, LinearizeError::SingularPosition { rank: 1, rank_nearby: None }), "{error}");
    assert!(error.to_string().contains("in which nothing can be assembled"), "{error}");
    let model = Parallelogram { inertia: 1.0, l: 1.0, wide: 2.0, k: 0.0, rest: 0.0 };
    let error = model.linearize(&model.state().build().unwrap()).unwrap_err();
    assert!(matches!(error, LinearizeError::SingularPosition { rank: 1, rank_nearby: Some(2) }), "{error}");
    let beside = model.state().a(0.5).c(0.5).build().unwrap();
    assert_eq!(model.linearize(&beside).unwrap().velocities.len(), 1);
    let error = model.linearize_in(&beside, &["a", "c"]).unwrap_err();
    assert!(matches!(error, LinearizeError::Dependent { name: "a" | "c" }), "{error}");
    let error = model.linearize_in(&beside, &["aa"]).unwrap_err();
    assert_eq!(error.to_string(), "no coordinate is called `aa`; did you mean `a`?");
    let error = model.linearize_in(&beside, &["theta"]).unwrap_err();
    assert_eq!(error.to_string(), "no coordinate is called `theta`; array elements are written `theta[0]`");

    let off = pendulum::Cartesian { mass: 1.0, length: 1.0, g: 9.81 };
    let mut state = off.state().y(-1.0).build().unwrap();
    state.q_mut()[1] = -1.1;
    assert!(matches!(off.linearize(&state), Err(LinearizeError::State(_))));
}
