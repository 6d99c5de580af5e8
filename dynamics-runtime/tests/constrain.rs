//! The general solver of constrained systems, on models by hand.

use crate::common;

use std::sync::atomic::{AtomicU32, Ordering};

use common::at_rest_or_not;
use common::by_jets::{Jets, Mechanism, holonomic};
use common::constrained::{
    FourBar, Held, PainleveRod, Rod, Sleigh, SliderCrank, SquaredRod, TripleRod, TwiceRod,
};
use dynamics_runtime::Expr;
use dynamics_runtime::constrain::{
    Embedding, assemble, check_gradients, check_start, impact, project_positions, project_velocities,
    solve_baumgarte, solve_general, solve_once, with_workspace,
};
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraint, Constraints, Dynamics};

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
        assert_eq!(project_positions(&model, &(), &mut far, workspace).map(|_| ()), vanishes);
    });
    with_workspace::<Rod, _>(|workspace| assert_eq!(check_gradients(&ROD, &near, workspace), Ok(())));
}

#[test]
fn projection_reaches_rounding_level() {
    let model = FourBar { m: [1.0, 0.5, 2.0], l: [1.0, 2.5, -2.0], d: 2.0, g: 9.81 };
    with_workspace::<FourBar, _>(|workspace| {
        let mut state = at_rest_or_not([1.0, 0.4, 1.5], [1.0, -0.3, 0.6]);
        let first = project_positions(&model, &(), &mut state, workspace).unwrap();
        assert!(model.residual(&state).amax() < 1e-15, "{:?} after {first:?}", model.residual(&state));
        let again = project_positions(&model, &(), &mut state, workspace).unwrap();
        assert!(again.change < 1e-15 && again.iterations <= 1, "{again:?}");
        let before = state.u;
        project_velocities(&model, &(), &mut state, workspace).unwrap();
        assert!(model.velocity_residual(&state).amax() < 1e-15);
        // The least change in the metric of M: M δ lies in the range of Φ_qᵀ, so it does no work on
        // admissible velocities.
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
    let result =
        with_workspace::<FourBar, _>(|workspace| project_positions(&model, &(), &mut state, workspace));
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
        let wanted = ROD.gamma(&state)
            - 2.0 * alpha * ROD.velocity_residual(&state)
            - beta * beta * ROD.residual(&state);
        let got = ROD.jacobian(&state) * outcome.accelerations;
        assert!((got - wanted).amax() < 1e-14);
        // M q̈ − Q is a reaction: nothing of it is along the rod's motion.
        let rest = ROD.mass_matrix(&state) * outcome.accelerations - ROD.generalized_force(&state);
        let row = ROD.jacobian(&state);
        assert!((rest[0] * row[1] - rest[1] * row[0]).abs() < 1e-13);
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
        let theta = (model.load * slope - model.slider * slope * bend * 400.0)
            / (model.j + model.slider * slope * slope);
        assert!(
            (outcome.accelerations[0] - theta).abs() < 1e-12 * theta.abs(),
            "{} {theta}",
            outcome.accelerations[0]
        );
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

/// A slider-crank at a crank angle and rate, closed by hand.
fn closed(model: &SliderCrank, theta: f64, rate: f64) -> common::PlainState<3, 0> {
    let beta = -(model.a * theta.sin() / model.b).asin();
    let x = model.a * theta.cos() + model.b * beta.cos();
    let swing = -model.a * theta.cos() * rate / (model.b * beta.cos());
    let slide = -model.a * theta.sin() * rate - model.b * beta.sin() * swing;
    at_rest_or_not([theta, beta, x], [rate, swing, slide])
}

const CRANK: SliderCrank = SliderCrank { a: 0.1, b: 0.3, j: 0.02, rod: 1e-3, slider: 0.5, load: -40.0 };

#[test]
fn dependent_coordinates_follow_the_independent_ones() {
    with_workspace::<SliderCrank, _>(|w| {
        let exact = closed(&CRANK, 0.8, 20.0);
        let mut embedding = Embedding::new(&CRANK, &exact, w).unwrap();
        let dependent: Vec<usize> = embedding.dependent_coordinates().collect();
        assert_eq!(dependent.len(), 2);
        assert!(dependent.contains(&1), "the light rod follows: {dependent:?}");
        let mut state = exact;
        for i in dependent {
            state.q[i] += 0.01;
            state.u[i] = 0.0;
        }
        embedding.restore(&CRANK, &mut state, w).unwrap();
        assert!((state.q - exact.q).amax() < 1e-15 && (state.u - exact.u).amax() < 1e-14, "{state:?}");
        assert_eq!((embedding.projections, embedding.renewals), (0, 0));
    });
}

#[test]
fn partitions_change_where_they_degrade_and_keep_the_branch() {
    with_workspace::<SliderCrank, _>(|w| {
        // A heavy slider leads until the crank comes to a dead centre, where it can lead no more.
        let heavy = SliderCrank { slider: 20.0, ..CRANK };
        let mut state = closed(&heavy, 0.8, 20.0);
        let mut embedding = Embedding::new(&heavy, &state, w).unwrap();
        assert!(!embedding.dependent_coordinates().any(|i| i == 2));
        for k in 0..=2000 {
            let exact = closed(&heavy, 0.8 + 0.005 * f64::from(k), 20.0);
            let dependent: Vec<usize> = embedding.dependent_coordinates().collect();
            for i in 0..3 {
                if !dependent.contains(&i) {
                    (state.q[i], state.u[i]) = (exact.q[i], exact.u[i]);
                }
            }
            embedding.restore(&heavy, &mut state, w).unwrap();
            assert!(
                (state.q - exact.q).amax() < 1e-12 && (state.u - exact.u).amax() < 1e-9,
                "{k}: {state:?} {exact:?}"
            );
            embedding.renew(&heavy, &state, w).unwrap();
        }
        assert!(embedding.renewals >= 2 && embedding.worst > 1e-3, "{embedding:?}");
    });
}

#[test]
fn without_renewal_a_dead_point_is_projected_over_and_counted() {
    with_workspace::<SliderCrank, _>(|w| {
        let heavy = SliderCrank { slider: 20.0, ..CRANK };
        let mut embedding = Embedding::new(&heavy, &closed(&heavy, 0.8, 20.0), w).unwrap();
        let mut state = closed(&heavy, 1e-12, 20.0);
        state.q[2] += 1e-9;
        embedding.restore(&heavy, &mut state, w).unwrap();
        assert_eq!(embedding.projections, 1);
        assert!(heavy.residual(&state).amax() < 1e-15 && heavy.velocity_residual(&state).amax() < 1e-14);
    });
}

#[test]
fn nonholonomic_rows_bind_velocities_alone() {
    let sleigh = Sleigh { m: 2.0, j: 0.7, a: 0.3 };
    with_workspace::<Sleigh, _>(|w| {
        let mut state = at_rest_or_not([1.0, 2.0, 0.4], [1.0, 0.3, 0.8]);
        let mut embedding = Embedding::new(&sleigh, &state, w).unwrap();
        assert_eq!(
            (embedding.dependent_coordinates().count(), embedding.dependent_velocities().count()),
            (0, 1)
        );
        let q = state.q;
        embedding.restore(&sleigh, &mut state, w).unwrap();
        assert!(state.q == q && sleigh.velocity_residual(&state).amax() < 1e-15);
    });
}

/// m (g − l sin θ ω²) = N (1 + 3 cos²θ ∓ 3 μ sin θ cos θ): the textbook's rod, sliding the way in which
/// friction jams it.
fn painleve(mu: f64, theta: f64, omega: f64, linear: bool) -> Result<f64, SolveError> {
    let rod = PainleveRod { m: 2.0, l: 0.5, g: 9.81, mu, linear };
    let outcome = solve_once(&rod, &(), &rod.slipping(theta, omega, -1.0))?;
    let lambda = outcome.multipliers[0];
    let (s, c) = theta.sin_cos();
    let along = 1.0 + 3.0 * c * c - 3.0 * mu * s * c;
    let weight = rod.m * (rod.g - rod.l * s * omega * omega);
    assert!((lambda * along - weight).abs() < 1e-12 * weight.abs(), "{lambda} {along} {weight}");
    let (force, _) = rod.with_reactions(&rod.slipping(theta, omega, -1.0), &outcome.multipliers);
    let newton = rod.mass_matrix(&rod.slipping(theta, omega, -1.0)) * outcome.accelerations
        - force
        - rod.jacobian(&rod.slipping(theta, omega, -1.0)).transpose() * outcome.multipliers;
    assert!(newton.amax() < 1e-12 * (weight.abs() + lambda.abs()));
    Ok(lambda)
}

#[test]
fn friction_is_solved_together_with_the_reaction_up_to_painleves_limit() {
    // The limit is (tan²θ + 4)/(3 tan θ), least at tan θ = 2: 4/3.
    let steepest = 2.0_f64.atan();
    for linear in [false, true] {
        for mu in [0.0, 0.3, 1.0, 1.3, 4.0 / 3.0 - 1e-6] {
            assert!(painleve(mu, steepest, 0.0, linear).unwrap() > 0.0);
        }
        for theta in [0.4_f64, 0.9, 1.3] {
            let limit = (theta.tan() * theta.tan() + 4.0) / (3.0 * theta.tan());
            assert!(painleve(0.999 * limit, theta, 0.0, linear).is_ok());
            assert!(painleve(1.001 * limit, theta, 0.0, linear).is_err());
        }
    }
    // Sliding the other way a contact never jams, but a slot, which can also pull, does.
    let contact = PainleveRod { m: 2.0, l: 0.5, g: 9.81, mu: 5.0, linear: true };
    assert!(solve_once(&contact, &(), &contact.slipping(steepest, 0.0, 1.0)).is_ok());
    let slot = PainleveRod { linear: false, ..contact };
    let two = Err(SolveError::Friction { row: "floor", solutions: 2 });
    assert_eq!(solve_once(&slot, &(), &slot.slipping(steepest, 0.0, 1.0)).map(|_| ()), two);
}

#[test]
fn beyond_the_limit_there_is_none_or_two_and_an_unstable_one_is_not_taken() {
    let steepest = 2.0_f64.atan();
    let friction = |solutions| Err(SolveError::Friction { row: "floor", solutions });
    assert_eq!(painleve(1.5, steepest, 0.0, false), friction(0));
    // Turning fast it would leave the floor: then both the jammed and the pulled state exist.
    assert_eq!(painleve(1.5, steepest, 10.0, false), friction(2));
    assert_eq!(painleve(1.5, steepest, 10.0, true), friction(1));
    assert_eq!(painleve(1.5, steepest, 0.0, true), friction(1));
}

#[test]
fn rows_that_repeat_others_on_the_manifold_are_not_taken_for_independent_beside_it() {
    // Drift of a motion that is not projected, and of the stages of one that is.
    for drift in [0.0, 1e-12, 1e-9, 1e-7, 1e-5] {
        let state = at_rest_or_not([0.9 + drift, -1.2], [0.8, 0.6 - drift]);
        let (once, twice) =
            (solve_once(&ROD, &(), &state).unwrap(), solve_once(&TwiceRod(ROD), &(), &state).unwrap());
        assert_eq!(twice.diagnosis.map(|d| d.rank), Some(1), "{drift:e}");
        let apart = (once.accelerations - twice.accelerations).amax();
        assert!(apart <= 1e-14 + 10.0 * drift, "{drift:e}: {apart:e}");
    }
}

/// A bob on a rod that counts how often its terms are asked for.
#[derive(Default)]
struct Counted(AtomicU32);

impl Mechanism<2, 1> for Counted {
    const COORDINATES: [&'static str; 2] = ["x", "y"];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("rod", 0, 1)];
    const ROWS: [&'static str; 1] = ["rod"];
    fn rows(&self, q: &[Expr; 2], _: Expr) -> [Expr; 1] {
        [q[0] * q[0] + q[1] * q[1] - 1.0]
    }
    fn inertia(&self) -> [f64; 2] {
        self.0.fetch_add(1, Ordering::Relaxed);
        [1.0; 2]
    }
}

#[test]
fn a_general_solve_reads_and_factors_once() {
    let model = Jets(Counted::default());
    let state = at_rest_or_not([0.6, -0.8], [0.8, 0.6]);
    with_workspace::<Jets<Counted, 2, 1>, _>(|w| solve_general(&model, &state, w)).unwrap();
    assert_eq!(model.0.0.load(Ordering::Relaxed), 1);
}

/// (x² + y² − 1)², without derivatives of the constraint, as models have none that are too large for them.
struct Squared;

impl Mechanism<2, 1> for Squared {
    const COORDINATES: [&'static str; 2] = ["x", "y"];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("rod", 0, 1)];
    const ROWS: [&'static str; 1] = ["rod"];
    fn rows(&self, q: &[Expr; 2], _: Expr) -> [Expr; 1] {
        let phi = q[0] * q[0] + q[1] * q[1] - 1.0;
        [phi * phi]
    }
}

#[test]
fn a_vanishing_gradient_is_found_without_second_derivatives() {
    let near = at_rest_or_not([0.6, -0.8 - 1e-8], [0.0, 0.0]);
    with_workspace::<Jets<Squared, 2, 1>, _>(|w| {
        assert_eq!(
            check_gradients(&Jets(Squared), &near, w),
            Err(SolveError::VanishingGradient { row: "rod" })
        );
    });
}

/// z = 0 and x² − z² = 0: the second touches zero only where the first holds.
struct Groove;

impl Mechanism<3, 2> for Groove {
    const COORDINATES: [&'static str; 3] = ["x", "y", "z"];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("plane", 0, 1), holonomic("groove", 1, 1)];
    const ROWS: [&'static str; 2] = ["plane", "groove"];
    fn rows(&self, [x, _, z]: &[Expr; 3], _: Expr) -> [Expr; 2] {
        [*z, *x * *x - *z * *z]
    }
}

/// Links in line: cos a + cos b = 2 cos c touches zero nowhere but here, where it crosses.
struct Flat;

impl Mechanism<3, 1> for Flat {
    const COORDINATES: [&'static str; 3] = ["a", "b", "c"];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("loop", 0, 1)];
    const ROWS: [&'static str; 1] = ["loop"];
    fn rows(&self, [a, b, c]: &[Expr; 3], _: Expr) -> [Expr; 1] {
        [a.cos() + b.cos() - 2.0 * c.cos()]
    }
}

#[test]
fn what_touches_only_within_other_constraints_is_found_and_what_crosses_is_not() {
    let touching = at_rest_or_not([0.0, 0.4, 0.0], [0.0; 3]);
    let error = dynamics_runtime::error::StateError::VanishingGradient { row: "groove" };
    assert_eq!(check_start(&Jets(Groove), &touching), Err(error));
    let crossing = at_rest_or_not([0.0; 3], [0.0; 3]);
    assert_eq!(check_start(&Jets(Flat), &crossing), Ok(()));
}

/// So many links of a chain in polar angles, held together by a belt each: large enough that its matrices do
/// not belong on a stack.
const LINKS: usize = 40;

struct Chain;

impl Mechanism<LINKS, { LINKS - 1 }> for Chain {
    const COORDINATES: [&'static str; LINKS] = ["link"; LINKS];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("belts", 0, LINKS - 1)];
    const ROWS: [&'static str; LINKS - 1] = ["belt"; LINKS - 1];
    fn rows(&self, q: &[Expr; LINKS], _: Expr) -> [Expr; LINKS - 1] {
        core::array::from_fn(|i| q[i + 1].sin() - 0.9 * q[i])
    }
    fn by_value(&self) {
        panic!("matrices of large models are not taken by value");
    }
}

#[test]
fn matrices_of_large_models_stay_off_the_stack() {
    let model = Jets(Chain);
    let guess = at_rest_or_not([0.5; LINKS], [0.0; LINKS]);
    let mut given = [false; LINKS];
    given[0] = true;
    let mut state = assemble(&model, guess, &given, &[false; LINKS]).unwrap();
    check_start(&model, &state).unwrap();
    with_workspace::<Jets<Chain, LINKS, { LINKS - 1 }>, _>(|w| {
        check_gradients(&model, &state, w).unwrap();
        let mut embedding = Embedding::new(&model, &state, w).unwrap();
        state.q[3] += 1e-3;
        embedding.restore(&model, &mut state, w).unwrap();
        embedding.renew(&model, &state, w).unwrap();
        state.q[3] += 1e-3;
        project_positions(&model, &(), &mut state, w).unwrap();
        project_velocities(&model, &(), &mut state, w).unwrap();
        solve_general(&model, &state, w).unwrap();
    });
    assert!(model.residual(&state).amax() < 1e-14, "{:e}", model.residual(&state).amax());
}
