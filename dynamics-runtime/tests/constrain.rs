//! The general solver of constrained systems, on models by hand.

mod common;

use common::at_rest_or_not;
use common::constrained::{FourBar, Rod, Sleigh, SliderCrank, SquaredRod, TripleRod};
use dynamics_runtime::constrain::{
    check_gradients, impact, project_positions, project_velocities, solve_baumgarte, solve_general, solve_once,
    with_workspace,
};
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraints, Dynamics};

const ROD: Rod = Rod { m: 2.0, l: 1.5, g: 9.81 };

#[test]
fn a_hanging_bob_is_held_by_its_weight() {
    let outcome = solve_once(&ROD, &(), &at_rest_or_not([0.0, -1.5], [0.0, 0.0])).unwrap();
    assert!(outcome.accelerations.norm() < 1e-15);
    // Φ_qᵀλ = (x, y) λ = m g upward.
    assert!((outcome.multipliers[0] * -1.5 - 2.0 * 9.81).abs() < 1e-14);
    assert!(outcome.unique());
}

#[test]
fn a_swinging_bob_has_the_tension_of_the_textbook() {
    let (theta, rate) = (0.7_f64, 1.3);
    let (s, c) = theta.sin_cos();
    let state = at_rest_or_not([1.5 * s, -1.5 * c], [1.5 * rate * c, 1.5 * rate * s]);
    let outcome = solve_once(&ROD, &(), &state).unwrap();
    let tension = ROD.m * (ROD.l * rate * rate + ROD.g * c);
    assert!((-outcome.multipliers[0] * ROD.l - tension).abs() < 1e-13 * tension);
}

#[test]
fn a_constraint_said_three_times_shares_its_force() {
    let state = at_rest_or_not([0.0, -1.5], [0.4, 0.0]);
    let once = solve_once(&ROD, &(), &state).unwrap();
    let thrice = solve_once(&TripleRod(ROD), &(), &state).unwrap();
    assert!((once.accelerations - thrice.accelerations).norm() < 1e-14);
    let diagnosis = thrice.diagnosis.unwrap();
    assert_eq!((diagnosis.rank, diagnosis.active, thrice.unique()), (1, 3, false));
    for (lambda, factor) in thrice.multipliers.iter().zip([1.0, 2.0, -1e3]) {
        assert!((lambda * factor - once.multipliers[0] / 3.0).abs() < 1e-13, "{:?}", thrice.multipliers);
    }
}

#[test]
fn a_zero_gradient_is_refused_and_a_vanishing_one_is_found() {
    let model = SquaredRod(ROD);
    let state = at_rest_or_not([0.0, -1.5], [0.3, 0.0]);
    let vanishes = Err(SolveError::VanishingGradient { row: "rod" });
    assert_eq!(solve_once(&model, &(), &state).map(|_| ()), vanishes);
    let near = at_rest_or_not([0.0, -1.5 - 1e-7], [0.3, 0.0]);
    with_workspace::<SquaredRod, _>(|workspace| {
        assert_eq!(check_gradients(&model, &near, workspace), vanishes);
        let mut far = at_rest_or_not([0.0, -1.6], [0.3, 0.0]);
        assert_eq!(project_positions(&model, &mut far, workspace).map(|_| ()), vanishes);
    });
    with_workspace::<Rod, _>(|workspace| assert_eq!(check_gradients(&ROD, &near, workspace), Ok(())));
}

#[test]
fn projection_reaches_rounding_level() {
    let model = FourBar { m: [1.0, 0.5, 2.0], l: [1.0, 2.5, -2.0], d: 2.0, g: 9.81 };
    with_workspace::<FourBar, _>(|workspace| {
        let mut state = at_rest_or_not([1.0, 0.4, 1.5], [1.0, -0.3, 0.6]);
        let first = project_positions(&model, &mut state, workspace).unwrap();
        assert!(model.residual(&state).amax() < 1e-15, "{:?} after {first:?}", model.residual(&state));
        let again = project_positions(&model, &mut state, workspace).unwrap();
        assert!(again.change < 1e-15 && again.iterations <= 1, "{again:?}");
        let before = state.u;
        project_velocities(&model, &mut state, workspace).unwrap();
        assert!(model.velocity_residual(&state).amax() < 1e-15);
        // The least change in the metric of M: M δ lies in the range of Φ_qᵀ, so it does no work on admissible velocities.
        let admissible = state.u;
        let work = (model.mass_matrix(&state) * (admissible - before)).dot(&admissible);
        assert!(work.abs() < 1e-14, "{work}");
    });
}

#[test]
fn what_cannot_be_closed_is_said() {
    // The coupler is too short to reach the rocker.
    let model = FourBar { m: [1.0; 3], l: [1.0, 0.5, -1.0], d: 5.0, g: 0.0 };
    let mut state = at_rest_or_not([0.3, 0.2, 2.5], [0.0; 3]);
    let result = with_workspace::<FourBar, _>(|workspace| project_positions(&model, &mut state, workspace));
    match result {
        Err(SolveError::OffConstraint { what: "positions", row, residual, distance }) => {
            assert!(row == "closure.x" && residual < -2.4 && distance > 1.0, "{row} {residual} {distance}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn baumgarte_adds_its_terms_to_gamma() {
    let state = at_rest_or_not([0.4, -1.6], [0.2, 0.7]);
    let (alpha, beta) = (3.0, 5.0);
    with_workspace::<Rod, _>(|workspace| {
        let outcome = solve_baumgarte(&ROD, &(), &state, (alpha, beta), workspace).unwrap();
        let wanted =
            ROD.gamma(&state) - 2.0 * alpha * ROD.velocity_residual(&state) - beta * beta * ROD.residual(&state);
        let got = ROD.jacobian(&state) * outcome.accelerations;
        assert!((got - wanted).amax() < 1e-14);
        let newton = ROD.mass_matrix(&state) * outcome.accelerations
            - ROD.generalized_force(&state)
            - ROD.jacobian(&state).transpose() * outcome.multipliers;
        assert!(newton.amax() < 1e-13);
    });
}

#[test]
fn a_thread_that_tightens_takes_the_radial_velocity() {
    for restitution in [0.0, 0.5, 1.0] {
        let mut state = at_rest_or_not([0.9, -1.2], [1.0, -0.5]);
        let before = ROD.energy_function(&state);
        let radial = (0.9 * 1.0 + 1.2 * 0.5) / 1.5;
        let hit = with_workspace::<Rod, _>(|w| impact(&ROD, &mut state, &[(0, restitution)], w)).unwrap();
        let lost = 0.5 * ROD.m * radial * radial * (1.0 - restitution * restitution);
        assert!((hit.energy_lost - lost).abs() < 1e-14, "{hit:?}");
        assert!((before - ROD.energy_function(&state) - lost).abs() < 1e-14);
        assert!((ROD.velocity_residual(&state)[0] + restitution * radial * 1.5).abs() < 1e-14);
        assert!((hit.impulses[0] * 1.5 + ROD.m * radial * (1.0 + restitution)).abs() < 1e-14);
    }
}

#[test]
fn a_massless_rod_is_carried_by_the_constraints_and_a_free_massless_coordinate_is_named() {
    let model = SliderCrank { a: 0.1, b: 0.3, j: 0.02, rod: 0.0, slider: 0.5, load: -40.0 };
    let beta = -(0.1 * 0.8_f64.sin() / 0.3).asin();
    let x = 0.1 * 0.8_f64.cos() + 0.3 * beta.cos();
    let mut state = at_rest_or_not([0.8, beta, x], [20.0, 0.0, 0.0]);
    with_workspace::<SliderCrank, _>(|w| {
        // Velocities by hand: the crank's is given.
        state.u[1] = -0.1 * 0.8_f64.cos() * 20.0 / (0.3 * beta.cos());
        state.u[2] = -0.1 * 0.8_f64.sin() * 20.0 - 0.3 * beta.sin() * state.u[1];
        assert!(model.velocity_residual(&state).amax() < 1e-14);
        let outcome = solve_once(&model, &(), &state).unwrap();
        // Lagrange in θ alone: J(θ) θ̈ + ½ J'(θ) θ̇² = F x'(θ), with x' and x'' from the constraint.
        let (slope, bend) = (state.u[2] / 20.0, {
            let g = model.gamma(&state);
            // Accelerations at θ̈ = 0.
            let bdd = g[1] / (0.3 * beta.cos());
            (-0.3 * beta.sin() * bdd - g[0]) / 400.0
        });
        let theta =
            (model.load * slope - model.slider * slope * bend * 400.0) / (model.j + model.slider * slope * slope);
        assert!((outcome.accelerations[0] - theta).abs() < 1e-12 * theta.abs(), "{} {theta}", outcome.accelerations[0]);
        let free = SliderCrank { j: 0.0, slider: 0.0, ..model };
        match solve_general(&free, &state, w) {
            Err(SolveError::SingularMassMatrix(error)) => assert!(!error.negative, "{error}"),
            other => panic!("{other:?}"),
        }
    });
}

#[test]
fn the_sleigh_turns_as_its_closed_form_says() {
    let sleigh = Sleigh { m: 2.0, j: 0.7, a: 0.3 };
    let (phi, v, omega) = (0.4_f64, 1.2, 0.8);
    // Forward speed v of the edge; the centre moves a ω sideways.
    let (s, c) = phi.sin_cos();
    let side = -0.3 * omega;
    let state = at_rest_or_not([0.0, 0.0, phi], [v * c - side * s, v * s + side * c, omega]);
    assert!(sleigh.velocity_residual(&state).amax() < 1e-15);
    let a = solve_once(&sleigh, &(), &state).unwrap().accelerations;
    // v̇ = side-slip of the turning frame, (J + m a²) ω̇ = m a v ω for an edge ahead.
    let turn = sleigh.m * sleigh.a * v * omega / (sleigh.j + sleigh.m * sleigh.a * sleigh.a);
    assert!((a[2] - turn).abs() < 1e-14, "{} {turn}", a[2]);
}
