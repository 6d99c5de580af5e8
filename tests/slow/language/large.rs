//! Models whose functions have thousands of operations, written with arrays and loops: blocks and parts of
//! functions do not change what is computed. A model of 25,000 operations is refused;
//! `ui/models/too_large.rs` holds its message.

use dynamics::constrain::solve_once;
use dynamics::model::{Model, Terms};
use dynamics::prelude::*;

/// What the tests need of every chain below.
trait Hanging: Dynamics {
    /// r̈ᵢ and the arm of link i, from the model's own functions on time jets.
    fn link(&self, q: &Self::Coordinates, i: usize) -> (Vec2<f64>, Vec2<f64>);
    /// Mass of link i.
    fn mass(&self, i: usize) -> f64;
}

macro_rules! chain {
    ($name:ident, $links:literal, $shake:literal) => {
        /// A chain of links. It hangs from a point that moves: then it is solved through its mass matrix; or,
        /// shaken by 0.0, from a fixed one.
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(theta: [rad; $links])]
        #[units(mass: kg, length: m, g: m / s^2)]
        struct $name {
            mass: [f64; $links],
            length: [f64; $links],
            g: f64,
        }

        impl $name {
            fn uneven() -> Self {
                Self {
                    mass: std::array::from_fn(|i| 1.0 + 0.1 * (i % 7) as f64),
                    length: std::array::from_fn(|i| 1.0 - 0.02 * (i % 9) as f64),
                    g: GRAVITY,
                }
            }
        }

        #[dynamics]
        impl $name {
            fn arm(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
                self.length[i] * vec2(q.theta[i].sin(), -q.theta[i].cos())
            }
            fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
                let phase = (self.g / self.length[0]).sqrt() * q.t;
                let mut place = vec2($shake * self.length[0] * phase.sin(), 0.0);
                for k in 0..i + 1 {
                    place += self.arm(q, k);
                }
                place
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..$links {
                    sum += 0.5 * self.mass[i] * self.place(q, i).dt().norm_squared();
                }
                sum
            }
            #[potential]
            fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..$links {
                    sum += self.mass[i] * self.g * self.place(q, i).y;
                }
                sum
            }
        }

        impl Hanging for $name {
            fn link(&self, q: &Self::Coordinates, i: usize) -> (Vec2<f64>, Vec2<f64>) {
                (self.place(q, i).dt().dt().value(), self.arm(q, i).value())
            }
            fn mass(&self, i: usize) -> f64 {
                self.mass[i]
            }
        }
    };
}

chain!(Chain9, 9, 0.3);
chain!(Chain18, 18, 0.3);
chain!(Chain26, 26, 0.3);
chain!(LongChain, 30, 0.0);
chain!(ChainOf100, 100, 0.0);

const GRAVITY: f64 = 9.81;

/// Operations per call of a function, as its listing says.
fn operations(listing: &str, function: &str) -> usize {
    let line = listing.lines().find(|l| l.starts_with(function)).expect("the function is listed");
    line.split_whitespace().nth(1).and_then(|n| n.parse().ok()).expect("a number of operations")
}

/// A state far from anything special.
fn state<M: Model, const N: usize>() -> M::State
where
    M::Vector: From<[f64; N]>,
    M::Inputs: Default,
{
    let q: [f64; N] = std::array::from_fn(|i| 0.4 + 0.8 * (1.7 * i as f64).sin());
    let u: [f64; N] = std::array::from_fn(|i| 0.9 * (2.3 * i as f64).cos());
    M::State::new(0.0, q.into(), u.into(), M::Inputs::default())
}

/// D'Alembert: at the accelerations found, the links below every joint leave no moment about it. And M q̈ = Q
/// by the emitted M and Q.
fn moves_rightly<M: Hanging, const N: usize>(model: &M)
where
    M::Vector: From<[f64; N]>,
    M::Inputs: Default,
{
    let state = state::<M, N>();
    let a = model.accelerations(&state).expect("a regular state");
    let q = M::coordinates_with(&state, &a, &[]);
    let mut pull = Vec2::new(0.0, 0.0);
    let mut scale = 0.0;
    for i in (0..N).rev() {
        let (acceleration, arm) = model.link(&q, i);
        let force = model.mass(i) * (acceleration + Vec2::new(0.0, GRAVITY));
        (pull, scale) = (pull + force, scale + force.norm());
        let moment = arm.cross(pull);
        assert!(moment.abs() <= 1e-12 * scale, "moment {moment} about joint {i}, forces of {scale}");
    }
    let (mass, force) = (model.mass_matrix(&state), model.generalized_force(&state));
    for i in 0..N {
        let terms: Vec<f64> = (0..N).map(|j| mass[(i, j)] * a[j]).collect();
        let scale = terms.iter().fold(force[i].abs(), |s, x| s + x.abs());
        assert!((terms.iter().sum::<f64>() - force[i]).abs() <= 1e-13 * scale, "row {i} of M q̈ = Q");
    }
}

#[test]
fn three_and_a_half_thousand_operations() {
    assert!((3_200..3_800).contains(&operations(Chain18::LISTING, "accelerations")));
    moves_rightly::<Chain18, 18>(&Chain18::uneven());
}

#[test]
fn nine_thousand_operations() {
    assert!((8_500..9_500).contains(&operations(Chain26::LISTING, "accelerations")));
    moves_rightly::<Chain26, 26>(&Chain26::uneven());
}

/// Velocities that are made of one another: no columns of M on the way.
#[test]
fn operations_in_proportion_to_the_links() {
    let operations = operations(LongChain::LISTING, "accelerations");
    assert!(operations < 25 * 30, "{operations}");
    moves_rightly::<LongChain, 30>(&LongChain::uneven());
}

/// Its mass matrix alone would take 30,000 operations: it is left out, and computed column by column when
/// asked for. What needs Jacobians or series says that there are none.
#[test]
fn a_chain_of_a_hundred_links_does_without_its_mass_matrix() {
    let operations = operations(ChainOf100::LISTING, "accelerations");
    assert!(operations < 25 * 100, "{operations}");
    assert!(!ChainOf100::LISTING.contains("mass_matrix:"));
    assert!(ChainOf100::REPORT.contains("left out"), "{}", ChainOf100::REPORT);
    let model = ChainOf100::uneven();
    moves_rightly::<ChainOf100, 100>(&model);
    // Mᵢⱼ = lᵢ lⱼ cos(θᵢ − θⱼ) Σ m of all points beyond both, by both functions that give M.
    let state = state::<ChainOf100, 100>();
    let (mut mass, mut force) = (vec![0.0; 100 * 100], vec![0.0; 100]);
    model.terms(&state, &mut Terms { mass: &mut mass, force: &mut force, jacobian: &mut [], gamma: &mut [] });
    let (m, q) = (model.mass_matrix(&state), model.generalized_force(&state));
    let beyond = |i: usize| model.mass[i..].iter().sum::<f64>();
    for i in 0..100 {
        assert_eq!(force[i], q[i]);
        for j in 0..100 {
            let angle = state.theta(i) - state.theta(j);
            let expected = model.length[i] * model.length[j] * angle.cos() * beyond(i.max(j));
            assert!(
                (m[(i, j)] - expected).abs() < 1e-12 * beyond(i.max(j)),
                "{i}, {j}: {} {expected}",
                m[(i, j)]
            );
            assert_eq!(mass[100 * i + j], m[(i, j)]);
        }
    }
    let still = model.state().theta([0.3; 100]).build().expect("all angles are given");
    let motion = model.simulate(still).until(0.2).run().expect("a chain that falls");
    assert!(motion.summary().energy_drift < 1e-8);
}

/// The tensions of rods divide by masses: without one there is an error, no number.
#[test]
fn a_point_without_mass_in_a_long_chain_is_an_error() {
    let mut model = LongChain::uneven();
    model.mass[7] = 0.0;
    let error = model.accelerations(&state::<LongChain, 30>()).expect_err("1/0");
    assert!(error.to_string().contains("theta[7]"), "{error}");
}

#[test]
fn a_jacobian_of_thousands_of_operations() {
    // Above 4,000 operations a function is cut into several.
    assert!((4_000..20_000).contains(&operations(Chain9::LISTING, "state_jacobian")));
    let model = Chain9::uneven();
    moves_rightly::<Chain9, 9>(&model);
    let state = state::<Chain9, 9>();
    let jacobian = model.state_jacobian(&state).unwrap();
    let h = 1e-3;
    for j in 0..9 {
        let difference = |shift: &dyn Fn(&mut State<Chain9>, f64)| {
            let at = |k: f64| {
                let mut s = state;
                shift(&mut s, k * h);
                model.accelerations(&s).unwrap()
            };
            let d = |k: f64| at(k) - at(-k);
            (45.0 * d(1.0) - 9.0 * d(2.0) + d(3.0)) / (60.0 * h)
        };
        let (by_q, by_u) = (difference(&|s, x| s.q[j] += x), difference(&|s, x| s.u[j] += x));
        for i in 0..9 {
            let (q, u) = (jacobian.by_q[(i, j)], jacobian.by_u[(i, j)]);
            assert!(
                (q - by_q[i]).abs() <= 1e-7 * (1.0 + by_q.norm()),
                "∂q̈{i}/∂q{j}: {q}, differences {}",
                by_q[i]
            );
            assert!(
                (u - by_u[i]).abs() <= 1e-9 * (1.0 + by_u.norm()),
                "∂q̈{i}/∂q̇{j}: {u}, differences {}",
                by_u[i]
            );
        }
    }
}

/// A chain whose free end is held; outputs of thousands of operations that read accelerations and reactions.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: [rad; 18])]
#[units(mass: kg, length: m, span: m, g: m / s^2)]
struct HeldChain {
    mass: [f64; 18],
    length: [f64; 18],
    span: f64,
    g: f64,
}

#[dynamics]
impl HeldChain {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let mut place = Vec2::ZERO;
        for k in 0..=i {
            place += self.length[k] * vec2(q.theta[k].sin(), -q.theta[k].cos());
        }
        place
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..18 {
            sum += 0.5 * self.mass[i] * self.place(q, i).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..18 {
            sum += self.mass[i] * self.g * self.place(q, i).y;
        }
        sum
    }
    #[holonomic(switched)]
    fn end(&self, q: &Coordinates<Self>) -> Vec2 {
        self.place(q, 17) - vec2(self.span, 0.0)
    }
    #[output]
    fn mixed(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..18 {
            for j in 0..18 {
                let angle = q.theta[i] - 1.1 * q.theta[j];
                let turned = (angle.sin() + 2.0) / (angle * angle + 3.0).sqrt();
                sum += turned * q.theta[i].dt().dt()
                    + q.theta[j].dt().powi(2) * angle * turned.powi(3) * self.slipping(q);
            }
        }
        sum * q.reaction(Self::end).y + q.reaction(Self::end).x * q.theta[0].dt().powi(2)
    }
    fn slipping(&self, q: &Coordinates<Self>) -> Expr {
        1.0 + q.slip(Self::end)
    }
}

#[test]
fn a_constrained_model_of_thousands_of_operations() {
    assert!(
        (4_000..20_000).contains(&operations(HeldChain::LISTING, "outputs")),
        "cut into several functions"
    );
    let chain = Chain18::uneven();
    let model = HeldChain { mass: chain.mass, length: chain.length, span: 9.0, g: GRAVITY };
    let mut state = state::<HeldChain, 18>();
    for released in [false, true] {
        if released {
            state.active_set_mut().release(0, -1.0);
        }
        let solved = solve_once(&model, &model.constants().unwrap(), &state).expect("a regular state");
        let (a, lambda) = (solved.accelerations, solved.multipliers);
        let jacobian = model.jacobian(&state);
        let (left, force) = (model.mass_matrix(&state) * a, model.generalized_force(&state));
        let missed = (left - force - jacobian.transpose() * lambda).norm();
        assert!(missed <= 1e-12 * (left.norm() + force.norm()), "M q̈ = Q + Φ_qᵀλ is missed by {missed}");
        if released {
            assert_eq!(lambda.norm(), 0.0);
            assert!(
                (a - chain.accelerations(&self::state::<Chain18, 18>()).unwrap()).norm() <= 1e-9 * a.norm()
            );
        } else {
            let missed = (jacobian * a - model.gamma(&state)).norm();
            assert!(missed <= 1e-11 * a.norm(), "Φ_q q̈ = γ is missed by {missed}");
        }
        let mut output = [f64::NAN];
        model.outputs(&state, &mut output).unwrap();
        let expected = model.mixed(&HeldChain::coordinates_with(&state, &a, lambda.as_slice())).value();
        assert!(
            (output[0] - expected).abs() <= 1e-11 * (1.0 + a.norm() * (1.0 + lambda.norm())),
            "{output:?} {expected}"
        );
    }
}

/// A chain in Cartesian coordinates: large matrices, nearly all zero.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 12], y: [m; 12])]
#[units(mass: kg, length: m, g: m / s^2)]
struct CartesianChain {
    mass: [f64; 12],
    length: f64,
    g: f64,
}

#[dynamics]
impl CartesianChain {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(q.x[i], q.y[i])
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..12 {
            sum += 0.5 * self.mass[i] * self.place(q, i).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..12 {
            sum += self.mass[i] * self.g * q.y[i];
        }
        sum
    }
    #[holonomic]
    fn rods(&self, q: &Coordinates<Self>) -> [Expr; 12] {
        let mut rows = [q.x[0].powi(2) + q.y[0].powi(2) - self.length.powi(2); 12];
        for i in 1..12 {
            rows[i] = (self.place(q, i) - self.place(q, i - 1)).norm_squared() - self.length.powi(2);
        }
        rows
    }
}

#[test]
fn large_matrices_are_written_whole_though_only_what_is_not_zero_is() {
    const N: usize = 24;
    const R: usize = 12;
    let model =
        CartesianChain { mass: std::array::from_fn(|i| 1.0 + 0.1 * i as f64), length: 0.7, g: GRAVITY };
    let state = state::<CartesianChain, N>();
    let (mass, jacobian) = (model.mass_matrix(&state), model.jacobian(&state));
    // What was in the memory before must not be left in it.
    let (mut m, mut q, mut j, mut gamma) = (vec![7.0; N * N], vec![7.0; N], vec![7.0; R * N], vec![7.0; R]);
    model.terms(&state, &mut Terms { mass: &mut m, force: &mut q, jacobian: &mut j, gamma: &mut gamma });
    for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
        let expected = if i == j { model.mass[i % R] } else { 0.0 };
        assert_eq!((m[N * i + j], mass[(i, j)]), (expected, expected));
    }
    for (row, i) in (0..R).flat_map(|row| (0..N).map(move |i| (row, i))) {
        let (link, x) = (i % R, &state.q.as_slice()[i - i % R..]);
        let before = |k: usize| if k == 0 { 0.0 } else { x[k - 1] };
        let expected = match link {
            _ if link == row => 2.0 * (x[row] - before(row)),
            _ if link + 1 == row => -2.0 * (x[row] - x[link]),
            _ => 0.0,
        };
        assert!((j[N * row + i] - expected).abs() < 1e-14 && (jacobian[(row, i)] - expected).abs() < 1e-14);
    }
    // ∂(Φ_qᵀλ)/∂q is constant here: the stiffness of springs 2λ along the rods.
    let lambda: nalgebra::SVector<f64, R> = nalgebra::SVector::from_fn(|i, _| 1.0 + i as f64);
    let mut derivatives = vec![7.0; N * N + 2 * R * N];
    model.constraint_derivatives(&state, &lambda, &mut derivatives);
    for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
        let (a, b) = (i % R, j % R);
        let next = |k: usize| if k + 1 < R { lambda[k + 1] } else { 0.0 };
        let expected = match (i / R == j / R, a.abs_diff(b)) {
            (true, 0) => 2.0 * (lambda[a] + next(a)),
            (true, 1) => -2.0 * lambda[a.max(b)],
            _ => 0.0,
        };
        assert!((derivatives[N * i + j] - expected).abs() < 1e-13, "{i} {j}");
    }
    assert!(derivatives[N * N..].iter().all(|x| *x != 7.0));
}
