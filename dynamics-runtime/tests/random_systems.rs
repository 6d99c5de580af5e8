//! The general solver on random systems whose solutions are known by construction: rank loss, bad scales, no
//! inertia, no numbers.

use crate::common;

use allocation_counter::measure;
use common::constrained::{FourBar, Held, PainleveRod, constraint, held};
use common::{PlainState, at_rest_or_not, conserved, names};
use dynamics_runtime::constrain::{
    self, Embedding, correct, impact, project_positions, project_velocities, solve, solve_general,
    solve_once, with_workspace,
};
use dynamics_runtime::error::{SingularMassMatrix, SolveError};
use dynamics_runtime::mechanism::Mechanism as _;
use dynamics_runtime::model::{
    Constraint, ConstraintKind, Constraints, Dynamics, Events, Model, ModelState, Outputs, Powers, Quantity,
    Solved, SolverKind, Terms,
};
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

/// M q̈ = Q + Φ_qᵀλ, Φ_q q̈ = γ with these numbers; Φ = Φ_q q.
macro_rules! numbers {
    ($name:ident, $n:literal $q:expr, $r:literal $rows:expr, $constraints:expr) => {
        #[derive(Clone, Copy, Debug)]
        struct $name {
            mass: SMatrix<f64, $n, $n>,
            force: SVector<f64, $n>,
            jacobian: SMatrix<f64, $r, $n>,
            gamma: SVector<f64, $r>,
        }
        impl $name {
            /// With this q̈ and λ for its solution.
            #[allow(dead_code, reason = "not for the smallest")]
            fn with_solution(
                mass: SMatrix<f64, $n, $n>,
                jacobian: SMatrix<f64, $r, $n>,
                a: SVector<f64, $n>,
                lambda: SVector<f64, $r>,
            ) -> Self {
                Self { mass, force: mass * a - jacobian.transpose() * lambda, jacobian, gamma: jacobian * a }
            }
        }
        impl Held<$n, $r, $r> for $name {
            fn mass(&self, _: &PlainState<$n, 0>) -> SMatrix<f64, $n, $n> {
                self.mass
            }
            fn force(&self, _: &PlainState<$n, 0>) -> SVector<f64, $n> {
                self.force
            }
            fn energy(&self, s: &PlainState<$n, 0>) -> f64 {
                0.5 * s.u.dot(&(self.mass * s.u))
            }
            fn phi(&self, s: &PlainState<$n, 0>) -> SVector<f64, $r> {
                self.jacobian * s.q
            }
            fn phi_q(&self, _: &PlainState<$n, 0>) -> SMatrix<f64, $r, $n> {
                self.jacobian
            }
            fn right(&self, _: &PlainState<$n, 0>) -> SVector<f64, $r> {
                self.gamma
            }
        }
        held!($name, $n coordinates $q, $r + 0 = $r rows $rows, $constraints, friction false, events []);
    };
}

const fn switched(name: &'static str, row: usize) -> Constraint {
    Constraint { switched: Some(row), ..constraint(name, ConstraintKind::Holonomic, row, 1) }
}

numbers!(Six, 6 ["a", "b", "c", "d", "e", "f"], 4 ["p", "q", "r", "s"],
    [switched("p", 0), switched("q", 1), switched("r", 2), switched("s", 3)]);
numbers!(TwoByFour, 2 ["a", "b"], 4 ["p", "q", "r", "s"],
    [constraint("p", ConstraintKind::Holonomic, 0, 1), constraint("q", ConstraintKind::Holonomic, 1, 3)]);
numbers!(One, 1["a"], 1["p"], [constraint("p", ConstraintKind::Holonomic, 0, 1)]);
numbers!(Free, 2 ["a", "b"], 0 [], []);

fn matrix<const R: usize, const N: usize>() -> impl Strategy<Value = SMatrix<f64, R, N>> {
    proptest::collection::vec(-1.0..1.0_f64, R * N).prop_map(|x| SMatrix::from_row_slice(&x))
}

fn powers<const N: usize>(exponent: f64) -> impl Strategy<Value = SVector<f64, N>> {
    proptest::collection::vec(-exponent..exponent, N).prop_map(|x| SVector::from_fn(|i, _| 10f64.powf(x[i])))
}

/// Positive definite, with a condition of a few tens.
fn mass() -> impl Strategy<Value = SMatrix<f64, 6, 6>> {
    matrix::<6, 6>().prop_map(|b| b * b.transpose() + SMatrix::<f64, 6, 6>::identity() * 0.3)
}

fn still() -> PlainState<6, 0> {
    at_rest_or_not([0.0; 6], [0.0; 6])
}

/// Smallest over largest singular value, of rows at unit length, from the eigenvalues of Φ̂Φ̂ᵀ.
fn regularity<const R: usize, const N: usize>(jacobian: &SMatrix<f64, R, N>) -> f64 {
    // By inverse iteration's poor relation: the determinant of the Gram matrix of unit rows, which is 1 for
    // orthogonal ones.
    let mut rows: Vec<SVector<f64, N>> = (0..R).map(|i| jacobian.row(i).transpose().normalize()).collect();
    let mut volume = 1.0;
    for i in 0..R {
        let length = rows[i].norm();
        volume *= length;
        let unit = rows[i] / length;
        rows.iter_mut().skip(i + 1).for_each(|row| *row -= unit * unit.dot(row));
    }
    volume
}

fn config(seed: u64) -> ProptestConfig {
    ProptestConfig {
        rng_seed: proptest::test_runner::RngSeed::Fixed(seed),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config(7))]

    #[test]
    fn regular_systems_are_solved_to_rounding_in_any_units(
        mass in mass(), jacobian in matrix::<4, 6>(), a in matrix::<6, 1>(), lambda in matrix::<4, 1>(),
        rows in powers::<4>(6.0), coordinates in powers::<6>(4.0),
    ) {
        prop_assume!(regularity(&jacobian) > 1e-2);
        let plain = Six::with_solution(mass, jacobian, a, lambda);
        let outcome = solve_once(&plain, &(), &still()).unwrap();
        prop_assert!(outcome.unique());
        prop_assert!(
            (outcome.accelerations - a).amax() < 1e-11
            && (outcome.multipliers - lambda).amax() < 1e-11
        );
        // Other units: q = S q', Φ' = W Φ; then a' = S⁻¹ a, λ' = W⁻¹ λ.
        let (s, w) = (SMatrix::from_diagonal(&coordinates), SMatrix::from_diagonal(&rows));
        let other = Six {
            mass: s * mass * s,
            force: s * plain.force,
            jacobian: w * jacobian * s,
            gamma: w * plain.gamma
        };
        let there = solve_once(&other, &(), &still()).unwrap();
        prop_assert!(there.unique());
        prop_assert!(
            (s * there.accelerations - a).amax() < 1e-11,
            "{}",
            (s * there.accelerations - a).amax()
        );
        prop_assert!((w * there.multipliers - lambda).amax() < 1e-11);
    }

    #[test]
    fn repeated_rows_change_nothing_but_the_sharing(
        mass in mass(), base in matrix::<2, 6>(), mixing in matrix::<4, 2>(), a in matrix::<6, 1>(),
        lambda in matrix::<4, 1>(), rows in powers::<4>(3.0),
    ) {
        prop_assume!(regularity(&base) > 0.1 && regularity(&mixing.transpose()) > 0.1);
        let jacobian = SMatrix::from_diagonal(&rows) * mixing * base;
        prop_assume!((0..4).all(|i| (mixing.row(i) * base).norm() > 0.05));
        let system = Six::with_solution(mass, jacobian, a, lambda);
        let outcome = solve_once(&system, &(), &still()).unwrap();
        let diagnosis = outcome.diagnosis.unwrap();
        prop_assert!(diagnosis.rank == 2 && diagnosis.active == 4 && !outcome.unique());
        let size = 1.0 + (jacobian.transpose() * lambda).amax();
        prop_assert!((outcome.accelerations - a).amax() < 1e-10 * size);
        let apart = jacobian.transpose() * (outcome.multipliers - lambda);
        prop_assert!(apart.amax() < 1e-10 * size, "{apart}");
        // Least norm in accelerations: no combination that does nothing would make it less.
        let scale = SVector::<f64, 6>::from_fn(|i, _| 1.0 / mass[(i, i)].sqrt());
        let weights =
            SVector::<f64, 4>::from_fn(
                |i, _|
                jacobian.row(i).transpose().component_mul(&scale).norm_squared());
        let free = lambda - outcome.multipliers;
        let along: f64 = (0..4).map(|i| weights[i] * outcome.multipliers[i] * free[i]).sum();
        let sizes: f64 =
            (0..4).map(|i| weights[i] * (outcome.multipliers[i].powi(2) + free[i].powi(2))).sum();
        prop_assert!(along.abs() < 1e-9 * sizes, "{along} of {sizes}");
    }

    #[test]
    fn contradictions_are_named(
        mass in mass(), base in matrix::<3, 6>(), mixing in matrix::<1, 3>(), a in matrix::<6, 1>(),
            by in 1e-3..1.0_f64,
    ) {
        prop_assume!(regularity(&base) > 0.1 && mixing.norm() > 0.3);
        let mut jacobian = SMatrix::<f64, 4, 6>::zeros();
        jacobian.fixed_rows_mut::<3>(0).copy_from(&base);
        jacobian.fixed_rows_mut::<1>(3).copy_from(&(mixing * base));
        let mut system = Six::with_solution(mass, jacobian, a, SVector::zeros());
        prop_assert!(solve_once(&system, &(), &still()).is_ok());
        system.gamma[3] += by;
        let contradiction = matches!(
            solve_once(&system, &(), &still()),
            Err(SolveError::Contradiction { rank: 3, residual, .. }) if residual != 0.0
        );
        prop_assert!(contradiction);
        // Without one of them it is none.
        let mut state = still();
        state.active_set_mut().release(3, 1.0);
        let released = solve_once(&system, &(), &state).unwrap();
        prop_assert!(released.unique() && released.multipliers[3] == 0.0);
        prop_assert!((base * released.accelerations - system.gamma.fixed_rows::<3>(0)).amax() < 1e-11);
    }

    #[test]
    fn coordinates_without_inertia_are_carried(
        mass in mass(), jacobian in matrix::<4, 6>(), a in matrix::<6, 1>(),
            lambda in matrix::<4, 1>(), light in 0..3_i32,
    ) {
        prop_assume!(
            regularity(&jacobian) > 0.05
            && regularity(&jacobian.fixed_columns::<2>(0).transpose()) > 0.2
        );
        // Two coordinates with none, with next to none, or with a hundred-millionth.
        let share = [0.0, 1e-14, 1e-8][light as usize];
        let s = SMatrix::from_diagonal(
            &SVector::<f64, 6>::from_fn(|i, _| if i < 2 { f64::sqrt(share) } else { 1.0 }));
        let system = Six::with_solution(s * mass * s, jacobian, a, lambda);
        let outcome = solve_once(&system, &(), &still()).unwrap();
        let (da, dl) = ((outcome.accelerations - a).amax(), (outcome.multipliers - lambda).amax());
        prop_assert!(da < 1e-9 && dl < 1e-9, "{da:e} {dl:e} {:?}", outcome.diagnosis);
    }

    #[test]
    fn heavy_and_light_bodies_are_solved_together(
        jacobian in matrix::<4, 6>(), a in matrix::<6, 1>(), masses in powers::<6>(4.0),
    ) {
        prop_assume!(regularity(&jacobian) > 1e-2);
        let system = Six::with_solution(SMatrix::from_diagonal(&masses), jacobian, a, SVector::zeros());
        let outcome = solve_once(&system, &(), &still()).unwrap();
        prop_assert!((outcome.accelerations - a).amax() < 1e-9, "{:e}", (outcome.accelerations - a).amax());
    }

    #[test]
    fn corrections_are_the_least_in_the_metric_of_the_mass(
        mass in mass(), jacobian in matrix::<4, 6>(), right in matrix::<4, 1>(), q in matrix::<6, 1>(),
    ) {
        prop_assume!(regularity(&jacobian) > 1e-2);
        let system = Six::with_solution(mass, jacobian, SVector::zeros(), SVector::zeros());
        with_workspace::<Six, _>(|w| {
            let delta = correct(&system, &(), &still(), &right, w).unwrap();
            prop_assert!((jacobian * delta - right).amax() < 1e-11);
            // M δ = Φ_qᵀμ: what the best μ leaves is rounding.
            let across = jacobian * jacobian.transpose();
            let mu = across.try_inverse().unwrap() * jacobian * (mass * delta);
            prop_assert!((mass * delta - jacobian.transpose() * mu).amax() < 1e-10);
            let mut state = still();
            (state.q, state.u) = (q, q * 2.0);
            project_positions(&system, &(), &mut state, w).unwrap();
            project_velocities(&system, &(), &mut state, w).unwrap();
            prop_assert!((jacobian * state.q).amax() < 1e-14 && (jacobian * state.u).amax() < 1e-14);
            Ok(())
        })?;
    }

    #[test]
    fn several_contacts_push_and_never_pull(
        mass in mass(), jacobian in matrix::<4, 6>(), u in matrix::<6, 1>(),
        restitution in prop_oneof![Just(0.0), Just(1.0), 0.0..1.0_f64],
    ) {
        prop_assume!(regularity(&jacobian) > 0.05);
        let system = Six::with_solution(mass, jacobian, SVector::zeros(), SVector::zeros());
        let mut state = still();
        state.u = u;
        (0..4).for_each(|i| state.active_set_mut().release(i, 1.0));
        let before = system.energy_function(&state);
        let closing = jacobian * u;
        let hits = [0, 1, 2, 3].map(|i| (i, restitution));
        let hit = with_workspace::<Six, _>(|w| impact(&system, &mut state, &hits, w)).unwrap();
        let after = jacobian * state.u;
        for i in 0..4 {
            prop_assert!(hit.impulses[i] >= 0.0 && after[i] > -1e-10, "{hit:?} {closing} {after}");
            // Nothing pushes what neither closed nor was closed by others.
            prop_assert!(hit.impulses.amax() > 0.0 || closing[i] >= 0.0, "{hit:?} {closing} {after}");
        }
        if restitution == 0.0 {
            let plastic = (0..4).all(|i| hit.impulses[i] == 0.0 || after[i].abs() < 1e-10);
            prop_assert!(plastic, "{hit:?} {closing} {after}");
        }
        let lost = before - system.energy_function(&state);
        prop_assert!((hit.energy_lost - lost).abs() < 1e-11 * (1.0 + before), "{} {lost}", hit.energy_lost);
        prop_assert!(lost > -1e-11, "{lost}");
        prop_assert!((mass * (state.u - u) - jacobian.transpose() * hit.impulses).amax() < 1e-10);
    }
}

#[test]
fn the_smallest_systems_are_systems() {
    let one = One::with_solution([[2.0]].into(), [[3.0]].into(), [4.0].into(), [5.0].into());
    let outcome = solve_once(&one, &(), &at_rest_or_not([0.0], [0.0])).unwrap();
    assert!((outcome.accelerations[0] - 4.0).abs() < 1e-15 && (outcome.multipliers[0] - 5.0).abs() < 1e-14);
    let free = Free {
        mass: [[2.0, 0.5], [0.5, 1.0]].into(),
        force: [1.0, 2.0].into(),
        jacobian: SMatrix::zeros(),
        gamma: SVector::zeros(),
    };
    let outcome = solve_once(&free, &(), &at_rest_or_not([0.0; 2], [0.0; 2])).unwrap();
    assert!((free.mass * outcome.accelerations - free.force).amax() < 1e-15 && outcome.unique());
    // More rows than coordinates: no freedom, and most of them repeat.
    let jacobian = SMatrix::<f64, 4, 2>::from_row_slice(&[1.0, 0.0, 0.0, 2.0, 3.0, 1.0, -1.0, 5.0]);
    let over = TwoByFour::with_solution(SMatrix::identity(), jacobian, [0.3, -0.4].into(), SVector::zeros());
    let outcome = solve_once(&over, &(), &at_rest_or_not([0.0; 2], [0.0; 2])).unwrap();
    assert!((outcome.accelerations - over.mass * SVector::<f64, 2>::new(0.3, -0.4)).amax() < 1e-15);
    assert_eq!(outcome.diagnosis.map(|d| d.rank), Some(2));
    assert_eq!(over.degrees_of_freedom(&at_rest_or_not([0.0; 2], [0.0; 2])).unwrap(), 0);
    // Wojtyra: with p left out the others still repeat each other, so none is decided.
    assert!(over.reactions(&at_rest_or_not([0.0; 2], [0.0; 2])).unwrap().iter().all(|r| !r.unique));
}

#[test]
fn one_repeated_pair_leaves_the_other_reactions_decided() {
    let jacobian = SMatrix::<f64, 4, 6>::from_fn(|i, j| f64::from(u8::from(j == i.min(2))));
    let system = Six::with_solution(SMatrix::identity(), jacobian, SVector::zeros(), SVector::repeat(1.0));
    let unique: Vec<bool> = system.reactions(&still()).unwrap().iter().map(|r| r.unique).collect();
    assert_eq!(unique, [true, true, false, false]);
    let multipliers = system.multipliers(&still()).unwrap();
    assert!((multipliers - SVector::<f64, 4>::repeat(1.0)).amax() < 1e-15, "{multipliers}");
}

#[test]
fn what_is_not_a_number_is_an_error_or_stays_one_and_never_a_panic() {
    let jacobian = SMatrix::<f64, 4, 6>::from_fn(|i, j| f64::from(u8::from(i == j)) + 0.1);
    let good = Six::with_solution(SMatrix::identity(), jacobian, SVector::zeros(), SVector::zeros());
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut system = good;
        system.jacobian[(2, 4)] = bad;
        let refused = Err(SolveError::ConstraintNotFinite { row: "r" });
        assert_eq!(solve_once(&system, &(), &still()).map(|_| ()), refused);
        // Released, it is not looked at.
        let mut state = still();
        state.active_set_mut().release(2, 1.0);
        assert!(solve_once(&system, &(), &state).is_ok());
        system = good;
        system.gamma[2] = bad;
        assert_eq!(solve_once(&system, &(), &still()).map(|_| ()), refused);
        system = good;
        system.force[3] = bad;
        assert!(solve_once(&system, &(), &still()).unwrap().accelerations.iter().all(|x| x.is_nan()));
        system = good;
        system.mass[(3, 3)] = bad;
        assert!(solve_once(&system, &(), &still()).unwrap().accelerations.iter().all(|x| x.is_nan()));
        let mut state = still();
        state.q[0] = bad;
        with_workspace::<Six, _>(|w| {
            assert!(project_positions(&good, &(), &mut state, w).is_err());
            let mut embedding = Embedding::new(&good, &still(), w).unwrap();
            assert!(embedding.restore(&good, &mut state, w).is_err());
        });
    }
}

#[test]
fn negative_and_missing_inertia_are_told_apart() {
    let jacobian = SMatrix::<f64, 4, 6>::from_fn(|i, j| f64::from(u8::from(i == j)));
    let mut system = Six::with_solution(SMatrix::identity(), jacobian, SVector::zeros(), SVector::zeros());
    for (inertia, negative) in [(0.0, false), (-2.0, true)] {
        system.mass[(5, 5)] = inertia;
        match solve_once(&system, &(), &still()) {
            Err(SolveError::SingularMassMatrix(error)) => {
                assert_eq!((error.name, error.negative), ("f", negative), "{error}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn nothing_allocates() {
    let bar = FourBar { m: [1.0, 0.5, 2.0], l: [1.0, 2.5, -2.0], d: 2.0, g: 9.81 };
    let rod = PainleveRod { m: 2.0, l: 0.5, g: 9.81, mu: 0.8, linear: false };
    with_workspace::<FourBar, _>(|w| {
        let mut state = at_rest_or_not([1.0, 0.4, 1.5], [1.0, -0.3, 0.6]);
        let mut embedding = None;
        let counted = measure(|| {
            project_positions(&bar, &(), &mut state, w).unwrap();
            project_velocities(&bar, &(), &mut state, w).unwrap();
            solve(&bar, &(), &state, w).unwrap();
            solve_general(&bar, &state, w).unwrap();
            solve_once(&bar, &(), &state).unwrap();
            impact(&bar, &mut state, &[(0, 0.0)], w).unwrap();
            let embedding = embedding.insert(Embedding::new(&bar, &state, w).unwrap());
            embedding.restore(&bar, &mut state, w).unwrap();
            embedding.renew(&bar, &state, w).unwrap();
            constrain::solve_baumgarte(&bar, &(), &state, (1.0, 1.0), w).unwrap();
            solve_once(&rod, &(), &rod.slipping(1.0, 0.5, -1.0)).unwrap();
        });
        assert_eq!(counted.count_total, 0);
    });
}

/// A block on a floor, whose drag sets in where the floor pushes with more than its threshold.
#[derive(Clone, Copy, Debug)]
struct Block {
    threshold: f64,
    mu: f64,
}

impl Held<2, 1, 1> for Block {
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::identity() * 20.0
    }
    fn force(&self, _: &PlainState<2, 0>) -> SVector<f64, 2> {
        [50.0, -200.0].into()
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        10.0 * s.u.norm_squared()
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, 1> {
        [s.q[1]].into()
    }
    fn phi_q(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 1, 2> {
        [0.0, 1.0].into()
    }
    fn right(&self, _: &PlainState<2, 0>) -> SVector<f64, 1> {
        SVector::zeros()
    }
    fn with_reactions(
        &self,
        s: &PlainState<2, 0>,
        lambda: &SVector<f64, 1>,
    ) -> (SVector<f64, 2>, SMatrix<f64, 2, 1>) {
        let over = lambda[0] - self.threshold;
        let slope = if over > 0.0 { -self.mu } else { 0.0 };
        (self.force(s) + SVector::<f64, 2>::new(slope * over, 0.0), [slope, 0.0].into())
    }
}
held!(Block, 2 coordinates ["x", "y"], 1 + 0 = 1 rows ["floor"],
    [constraint("floor", ConstraintKind::Holonomic, 0, 1)], friction true, events []);

#[test]
fn a_drag_that_sets_in_at_a_threshold_is_not_overlooked() {
    for threshold in [0.0, 1.0, 150.0, 199.0, 200.0, 5000.0] {
        let block = Block { threshold, mu: 0.1 };
        let outcome = solve_once(&block, &(), &at_rest_or_not([0.0; 2], [0.0; 2])).unwrap();
        let drag = 0.1 * f64::max(200.0 - threshold, 0.0);
        assert!((outcome.multipliers[0] - 200.0).abs() < 1e-12);
        assert!((outcome.accelerations[0] - (50.0 - drag) / 20.0).abs() < 1e-14, "{threshold} {outcome:?}");
    }
}

/// [`Six`] with forces B |λ|.
#[derive(Clone, Copy, Debug)]
struct Rough {
    smooth: Six,
    by: SMatrix<f64, 6, 4>,
}

impl Held<6, 4, 4> for Rough {
    fn mass(&self, s: &PlainState<6, 0>) -> SMatrix<f64, 6, 6> {
        self.smooth.mass(s)
    }
    fn force(&self, s: &PlainState<6, 0>) -> SVector<f64, 6> {
        self.smooth.force(s)
    }
    fn energy(&self, s: &PlainState<6, 0>) -> f64 {
        self.smooth.energy(s)
    }
    fn phi(&self, s: &PlainState<6, 0>) -> SVector<f64, 4> {
        self.smooth.phi(s)
    }
    fn phi_q(&self, s: &PlainState<6, 0>) -> SMatrix<f64, 4, 6> {
        self.smooth.phi_q(s)
    }
    fn right(&self, s: &PlainState<6, 0>) -> SVector<f64, 4> {
        self.smooth.right(s)
    }
    fn with_reactions(
        &self,
        _: &PlainState<6, 0>,
        lambda: &SVector<f64, 4>,
    ) -> (SVector<f64, 6>, SMatrix<f64, 6, 4>) {
        let signs = SMatrix::<f64, 4, 4>::from_diagonal(&lambda.map(f64::signum));
        (self.smooth.force + self.by * lambda.abs(), self.by * signs)
    }
}
held!(Rough, 6 coordinates ["a", "b", "c", "d", "e", "f"], 4 + 0 = 4 rows ["p", "q", "r", "s"],
    [switched("p", 0), switched("q", 1), switched("r", 2), switched("s", 3)], friction true, events []);

proptest! {
    #![proptest_config(config(11))]

    #[test]
    fn several_rough_contacts_are_solved_together(
        mass in mass(), jacobian in matrix::<4, 6>(), a in matrix::<6, 1>(), lambda in matrix::<4, 1>(),
        by in matrix::<6, 4>(), released in 0..5_usize,
    ) {
        prop_assume!(regularity(&jacobian) > 0.1);
        // λ = λ₀ + S B |λ| contracts where ‖S B‖ < 1: then there is one solution, whatever the signs.
        let inverse = mass.try_inverse().unwrap();
        let influence = (jacobian * inverse * jacobian.transpose()).try_inverse().unwrap()
            * jacobian * inverse * by;
        let by = by * (0.7 / influence.norm());
        let rough = Rough { smooth: Six::with_solution(mass, jacobian, a, lambda), by };
        let mut state = still();
        if released < 4 {
            state.active_set_mut().release(released, -1.0);
        }
        let outcome = match solve_once(&rough, &(), &state) {
            Ok(outcome) => outcome,
            // With a row released S is another: it may contract no more.
            Err(SolveError::Friction { .. }) if released < 4 => return Ok(()),
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        let (force, _) = rough.with_reactions(&state, &outcome.multipliers);
        let newton = mass * outcome.accelerations - force - jacobian.transpose() * outcome.multipliers;
        prop_assert!(newton.amax() < 1e-10, "{newton}");
        let mut missed = jacobian * outcome.accelerations - rough.smooth.gamma;
        if released < 4 {
            prop_assert!(outcome.multipliers[released] == 0.0);
            missed[released] = 0.0;
        }
        prop_assert!(missed.amax() < 1e-11, "{missed}");
        let comparison = rough.compare_formulations(&state).unwrap();
        prop_assert!(comparison.applicable() == 4 && comparison.disagreement() < 1e-11, "{comparison}");
    }
}
