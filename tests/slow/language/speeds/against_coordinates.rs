//! Accelerations and multipliers by the speeds against the equations in coordinates, M q̈ − Φ_qᵀλ = Q and Φ_q
//! q̈ = γ, solved as they stand; starts against the speeds.

use dynamics::model::{Constraints, Vector as _};
use dynamics::prelude::*;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use super::models::*;

/// q̈ and λ of the equations in coordinates.
fn dense<M: Constraints>(model: &M, state: &M::State) -> DVector<f64> {
    let (n, r) = (M::COORDINATES.len(), M::ROWS.len());
    let (mass, force) = (model.mass_matrix(state), model.generalized_force(state));
    let (jacobian, gamma) = (model.jacobian(state), model.gamma(state));
    let matrix = DMatrix::from_fn(n + r, n + r, |i, j| match (i < n, j < n) {
        (true, true) => mass[(i, j)],
        (true, false) => -jacobian[(j - n, i)],
        (false, true) => jacobian[(i - n, j)],
        (false, false) => 0.0,
    });
    let right = DVector::from_fn(n + r, |i, _| if i < n { force[i] } else { gamma[i - n] });
    matrix.full_piv_lu().solve(&right).expect("regular")
}

/// The speeds of a state.
fn speeds<M: Dynamics>(model: &M, state: &M::State) -> Vec<f64> {
    let mut values = vec![0.0; M::SPEEDS.len()];
    model.speeds(state, &mut values);
    values
}

/// Checks a state that was given these speeds.
fn check<M: Constraints>(model: &M, state: &M::State, given: &[f64]) {
    let largest = |values: &[f64]| values.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
    let close = |found: &[f64], expected: &[f64], what: &str| {
        let (size, apart) = (largest(expected), found.iter().zip(expected).map(|(a, b)| (a - b).abs()));
        let worst = apart.fold(0.0, f64::max);
        assert!(
            found.len() == expected.len() && worst <= 1e-10 * size,
            "{what}: {found:?}, not {expected:?}: {worst:e}"
        );
    };
    close(&speeds(model, state), given, "speeds");
    let rows = model.velocity_residual(state);
    assert!(rows.as_slice().iter().all(|x| x.abs() <= 1e-11 * largest(state.u().as_slice())), "{rows:?}");
    // w = Y q̇ + y.
    let (n, s) = (M::COORDINATES.len(), given.len());
    let mut equations = vec![0.0; s * n + s];
    model.speed_equations(state, &mut equations);
    let linear =
        |i: usize| (0..n).map(|j| equations[i * n + j] * state.u()[j]).sum::<f64>() + equations[s * n + i];
    close(&(0..s).map(linear).collect::<Vec<_>>(), given, "Y q' + y");
    let expected = dense(model, state);
    let constants = model.constants().expect("regular");
    let solved = model.solve_unrolled(&constants, state).expect("no pivot vanishes here");
    close(solved.accelerations.as_slice(), &expected.as_slice()[..n], "accelerations");
    close(solved.multipliers.as_slice(), &expected.as_slice()[n..], "multipliers");
    let accelerations = model.accelerations(state).expect("regular");
    close(accelerations.as_slice(), &expected.as_slice()[..n], "accelerations");
}

fn numbers<const N: usize>(size: f64) -> impl Strategy<Value = [f64; N]> {
    proptest::array::uniform::<_, N>(-size..size)
}

fn inertia(of: [f64; 6]) -> Mat3<f64> {
    // tr(S) − S of second moments S = L Lᵀ, with a diagonal that does not vanish.
    let [a, b, c, d, e, f] = of;
    let l = [[1.0 + a.abs(), 0.0, 0.0], [b, 1.5 + c.abs(), 0.0], [d, e, 2.0 + f.abs()]];
    let product = |i: usize, j: usize| (0..3).map(|k| l[i][k] * l[j][k]).sum::<f64>();
    let trace: f64 = (0..3).map(|i| product(i, i)).sum();
    Mat3::diagonal(trace, trace, trace) - Mat3::from([0, 1, 2].map(|i| [0, 1, 2].map(|j| product(i, j))))
}

proptest! {
    #[test]
    fn of_a_top(
        a in 0.5..3.0, b in 0.5..3.0, c in 0.5..3.0,
        phi in -3.0..3.0, theta in 0.1..3.0, psi in -3.0..3.0,
        omega in numbers::<3>(4.0)
    ) {
        let top = Top { a, b, c, weight: 3.0, height: 0.7 };
        let state = top.state().phi(phi).theta(theta).psi(psi).omega(omega).build().expect("regular");
        check(&top, &state, &omega);
    }

    #[test]
    fn of_a_body_that_flies(
        of in numbers::<6>(1.0), center in numbers::<3>(0.5),
        yaw in -3.0..3.0, pitch in -1.3..1.3, roll in -3.0..3.0,
        moving in numbers::<6>(3.0)
    ) {
        let center = Vec3::from(center);
        let aircraft = Aircraft {
            mass: 2.0, center, inertia: inertia(of),
            gravity: Vec3::from([0.3, -0.2, -9.81]), drag: 0.8
        };
        let [v, omega] = [0, 3].map(|i| [moving[i], moving[i + 1], moving[i + 2]]);
        let state =
            aircraft.state()
                .r([0.3, 0.1, 2.0]).angles([yaw, pitch, roll]).v(v).omega(omega)
                .build().expect("regular");
        check(&aircraft, &state, &moving);
    }

    #[test]
    fn of_euler_parameters(of in numbers::<6>(1.0), e in numbers::<4>(1.0), omega in numbers::<3>(4.0)) {
        let norm = e.iter().map(|x| x * x).sum::<f64>().sqrt();
        prop_assume!(norm > 0.2);
        let satellite = Satellite { inertia: inertia(of) };
        let state = satellite.state().e(e.map(|x| x / norm)).omega(omega).build().expect("regular");
        check(&satellite, &state, &omega);
    }

    #[test]
    fn of_a_sleigh(phi in -3.0..3.0, moving in numbers::<2>(3.0), a in 0.1..1.0) {
        let sleigh = Sleigh { mass: 1.3, inertia: 0.4, a };
        let state = sleigh.state().x(0.4).phi(phi).v(moving[0]).spin(moving[1]).build().expect("regular");
        check(&sleigh, &state, &moving);
    }

    #[test]
    fn of_a_rolling_disk(yaw in -3.0..3.0, lean in -1.4..1.4, spin in -3.0..3.0, omega in numbers::<3>(3.0)) {
        let disk = Disk { m: 1.2, r: 0.6, g: 9.81 };
        let state = disk.state().yaw(yaw).lean(lean).spin(spin).omega(omega).build().expect("regular");
        check(&disk, &state, &omega);
    }

    #[test]
    fn of_what_is_seen_from_a_turntable(t in 0.0..9.0, x in numbers::<2>(2.0), seen in numbers::<2>(2.0)) {
        let table = Turntable { m: 1.5, turning: 0.7, k: 2.0 };
        let state = table.state().at_time(t).x(x[0]).y(x[1]).seen(seen).build().expect("regular");
        check(&table, &state, &seen);
    }

    #[test]
    fn of_rods_by_their_own_turning(q in numbers::<2>(3.0), moving in numbers::<2>(3.0)) {
        let rods = Rods { m: [1.0, 2.0], l: [0.5, 0.8], g: 9.81, motor: 0.4 };
        let state =
            rods.state()
                .shoulder(q[0]).elbow(q[1]).upper(moving[0]).lower(moving[1])
                .build().expect("regular");
        check(&rods, &state, &moving);
    }
}

/// det M = (det K)² det M̄ with a parameter in K: it may be 0, and nobody is to miss an inertia then.
#[test]
fn speeds_that_a_parameter_takes_away_take_no_motion_away() {
    assert!(Strides::REPORT.contains("as the speeds could be singular where the mass matrix is not"));
    let inertia = Mat3::diagonal(2.0, 3.0, 2.5);
    let motion = |per_metre: f64| {
        let body = Strides { mass: 2.0, center: Vec3::from([0.1, 0.2, 0.3]), inertia, drag: 0.8, per_metre };
        let state = body.state().angles([0.3, 0.4, 0.5]).r_rate([1.0, 2.0, 3.0]).angles_rate([0.3, 0.2, 0.1]);
        let state = state.build().expect("by rates");
        let own = body.accelerations(&state).expect("regular");
        let expected = dense(&body, &state);
        assert!((0..6).all(|i| (own[i] - expected[i]).abs() < 1e-13), "{own}, not {expected}");
        own
    };
    assert_eq!(motion(1.0), motion(0.0));
}
