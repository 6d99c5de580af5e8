//! What is compared, and how.

use dynamics::families::model::{EnergyParts, FamilyModel, FamilyState, Length, Multipliers, View};
use dynamics::model::{Energies, Linearize, ModelState, Outputs, Vector};
use nalgebra::DMatrix;

/// A model with a family and the same one with a literal count, from one text. In it the count is
/// `self.n()`.
macro_rules! twice {
    (
        $(#[$attribute:meta])*
        $family:ident: ($($coordinates:tt)*) { $($fields:tt)* }
        $literal:ident: ($($unrolled:tt)*) { $($literal_fields:tt)* } = $n:literal;
        { $($body:tt)* }
    ) => {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates($($coordinates)*)]
        $(#[$attribute])*
        pub struct $family {
            pub nodes: usize,
            $($fields)*
        }

        #[dynamics]
        impl $family {
            fn n(&self) -> usize {
                self.nodes
            }
            $($body)*
        }

        #[derive(Clone, Debug, Dynamics)]
        #[coordinates($($unrolled)*)]
        $(#[$attribute])*
        pub struct $literal {
            $($literal_fields)*
        }

        #[dynamics]
        impl $literal {
            fn n(&self) -> usize {
                $n
            }
            $($body)*
        }
    };
}
pub(crate) use twice;

/// Numbers that look random, the same ones in every run.
pub(crate) struct Numbers(u64);

impl Numbers {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }
    /// Between -1 and 1.
    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
    pub(crate) fn fill(&mut self, values: &mut [f64], size: f64) {
        values.iter_mut().for_each(|value| *value = size * self.next());
    }
    pub(crate) fn vec(&mut self, n: usize, size: f64) -> Vec<f64> {
        let mut values = vec![0.0; n];
        self.fill(&mut values, size);
        values
    }
}

/// A random state of the model.
pub(crate) fn random<M: FamilyModel>(model: &M, numbers: &mut Numbers, size: f64) -> M::State {
    let ends = model.ends().expect("the sizes suit the model");
    let n = *ends.last().expect("a model has coordinates");
    let (q, u) = (numbers.vec(n, size), numbers.vec(n, size));
    let inputs = numbers.vec(M::INPUTS.len(), 1.0);
    M::State::new(numbers.next(), q, u, inputs, ends)
}

pub(crate) fn forces<M: FamilyModel>(model: &M, at: View<'_>) -> Vec<f64> {
    let mut forces = vec![f64::NAN; at.q.len()];
    model.forces(at, &mut forces);
    forces
}

/// The matrix that entries add up to.
pub(crate) fn matrix(n: usize, entries: impl FnOnce(&mut dyn FnMut(usize, usize, f64))) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(n, n);
    entries(&mut |i, j, value| sum[(i, j)] += value);
    sum
}

pub(crate) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

#[track_caller]
pub(crate) fn assert_close(what: &str, a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len(), "{what}: lengths");
    let scale = largest(a).max(largest(b));
    for (k, (x, y)) in a.iter().zip(b).enumerate() {
        assert!((x - y).abs() <= tolerance * scale, "{what}[{k}]: {x:e} and {y:e}, of {scale:e}");
    }
}

/// Everything that both have in common, at random states.
#[track_caller]
pub(crate) fn compare<F: FamilyModel, L: Energies + Linearize + Outputs>(family: &F, literal: &L, size: f64) {
    compare_with(family, literal, size, |state| EnergyParts {
        kinetic: literal.kinetic_energy(state),
        potential: literal.potential_energy(state),
    });
}

/// The same where T and V of the unrolled model are given.
#[track_caller]
pub(crate) fn compare_with<F: FamilyModel, L: Linearize + Outputs>(
    family: &F,
    literal: &L,
    size: f64,
    energies: impl Fn(&L::State) -> EnergyParts,
) {
    let mut numbers = Numbers::new(7);
    for _ in 0..5 {
        let state = random(family, &mut numbers, size);
        let (n, view) = (state.q().len(), state.view());
        let fill = |values: &[f64]| {
            let mut vector = L::Vector::zeros();
            vector.as_mut_slice().copy_from_slice(values);
            vector
        };
        let mut inputs = L::Inputs::zeros();
        inputs.as_mut_slice().copy_from_slice(view.inputs);
        assert_eq!(n, L::COORDINATES.len(), "the number of coordinates");
        let unrolled = L::State::new(view.t, fill(view.q), fill(view.u), inputs);
        let q = forces(family, view);
        let expected = literal.generalized_force(&unrolled);
        assert_close("forces", &q, expected.as_slice(), 1e-13);
        let (own, other) = (family.energies(view), energies(&unrolled));
        let scale = |a: f64, b: f64| a.abs().max(b.abs()).max(1e-3);
        assert!((own.kinetic - other.kinetic).abs() <= 1e-12 * scale(own.kinetic, other.kinetic), "T");
        assert!(
            (own.potential - other.potential).abs() <= 1e-12 * scale(own.potential, other.potential),
            "V: {own:?}, {other:?}"
        );
        let mass = matrix(n, |add| family.mass(add));
        let known = literal.mass_matrix(&unrolled);
        let known = DMatrix::from_fn(n, n, |i, j| known[(i, j)]);
        assert_close("mass", mass.as_slice(), known.as_slice(), 1e-13);
        if F::DIAGONAL {
            assert!((0..n).all(|i| (0..n).all(|j| i == j || mass[(i, j)] == 0.0)), "M is not diagonal");
        }
        // M ∂q̈/∂q = ∂Q/∂q, and the same of velocities.
        let jacobian = literal.state_jacobian(&unrolled).expect("M has an inverse");
        let (by_q, by_u) = (
            &mass * DMatrix::from_fn(n, n, |i, j| jacobian.by_q[(i, j)]),
            &mass * DMatrix::from_fn(n, n, |i, j| jacobian.by_u[(i, j)]),
        );
        let stiffness = matrix(n, |add| family.stiffness(view, add));
        let damping = matrix(n, |add| family.damping(view, add));
        let scale = largest(stiffness.as_slice()).max(largest(damping.as_slice()));
        let near = |what: &str, a: &DMatrix<f64>, b: &DMatrix<f64>| {
            let off = largest((a + b).as_slice());
            assert!(off <= 1e-11 * scale, "{what} differs by {off:e} of {scale:e}: {a} and {b}");
        };
        near("stiffness", &stiffness, &by_q);
        near("damping", &damping, &by_u);
        if !F::VELOCITY_FORCES {
            assert!(damping.iter().all(|value| *value == 0.0), "damping without forces of velocities");
        }
        let mut all = vec![f64::NAN; L::OUTPUTS.len()];
        literal.outputs(&unrolled, &mut all).expect("outputs of a free model");
        let accelerations = literal.accelerations(&unrolled).expect("M has an inverse");
        let jets = F::coordinates(&state, accelerations.as_slice(), Multipliers::default());
        let own: Vec<f64> = (0..F::OUTPUTS.len()).flat_map(|k| family.output(k, &jets)).collect();
        assert_close("outputs", &own, &all, 1e-12);
        check_passes(family, &state);
    }
}

/// The passes of one model agree with each other: scaled forces and kicks with forces, T with M.
#[track_caller]
pub(crate) fn check_passes<M: FamilyModel>(model: &M, state: &M::State) {
    let (view, n) = (state.view(), state.q().len());
    let mut numbers = Numbers::new(11);
    let scale = numbers.vec(n, 1.0);
    let q = forces(model, view);
    let mut scaled = vec![f64::NAN; n];
    model.scaled_forces(view, &scale, &mut scaled);
    let expected: Vec<f64> = q.iter().zip(&scale).map(|(q, s)| q * s).collect();
    assert_close("scaled forces", &scaled, &expected, 1e-14);
    if !M::VELOCITY_FORCES {
        let (before, h) = (numbers.vec(n, 1.0), 0.25);
        let mut u = before.clone();
        model.kick(view.t, view.q, view.inputs, &scale, h, &mut u);
        let expected: Vec<f64> = before.iter().zip(&expected).map(|(u, a)| u + h * a).collect();
        assert_close("kick", &u, &expected, 1e-14);
    }
    // uᵀM u is what of 2 T has velocities twice.
    let mut twice = 0.0;
    model.mass(&mut |i, j, m| twice += m * view.u[i] * view.u[j]);
    let kinetic = |sign: f64| {
        let u: Vec<f64> = view.u.iter().map(|u| sign * u).collect();
        model.energies(View { u: &u, ..view }).kinetic
    };
    let (ahead, at_rest, back) = (kinetic(1.0), kinetic(0.0), kinetic(-1.0));
    let (by_t, scale) = (ahead - 2.0 * at_rest + back, ahead + at_rest + back + 1e-6);
    assert!((twice - by_t).abs() <= 1e-11 * scale, "T and M: {twice:e}, {by_t:e}");
}

/// A model of any size by itself: passes, forces against differences of V, stiffness against differences of
/// forces. Forces have to have a potential at u = 0 and without inputs.
#[track_caller]
pub(crate) fn check_alone<M: FamilyModel>(model: &M, size: f64) {
    let mut numbers = Numbers::new(3);
    let state = random(model, &mut numbers, size);
    check_passes(model, &state);
    let n = state.q().len();
    let none = vec![0.0; n];
    let no_inputs = vec![0.0; M::INPUTS.len()];
    let (t, mut q) = (state.t(), state.q().to_vec());
    let own = forces(model, View { t, q: &q, u: &none, inputs: &no_inputs });
    let scale = largest(&own);
    let stiffness = {
        let mut columns = std::collections::BTreeMap::new();
        model.stiffness(View { t, q: &q, u: &none, inputs: &no_inputs }, &mut |i, j, value| {
            *columns.entry((j, i)).or_insert(0.0) += value;
        });
        columns
    };
    let stiffest = stiffness.values().fold(0.0, |most: f64, value| most.max(value.abs()));
    let h = 1e-5 * size;
    for k in probed(&state) {
        let kept = q[k];
        let mut at = |value: f64| {
            q[k] = value;
            let view = View { t, q: &q, u: &none, inputs: &no_inputs };
            (model.energies(view).potential, forces(model, view))
        };
        let ((v1, f1), (v0, f0)) = (at(kept + h), at(kept - h));
        q[k] = kept;
        let slope = -(v1 - v0) / (2.0 * h);
        let rounding = 1e-15 * (v1.abs() + v0.abs()) / h;
        assert!(
            (slope - own[k]).abs() <= 1e-7 * scale + rounding,
            "force {k} of {n}: {:e}, by V {slope:e}, of {scale:e}",
            own[k]
        );
        for (row, (a, b)) in f1.iter().zip(&f0).enumerate() {
            let by_forces = -(a - b) / (2.0 * h);
            let own = stiffness.get(&(k, row)).copied().unwrap_or(0.0);
            assert!(
                (by_forces - own).abs() <= 1e-6 * stiffest,
                "stiffness ({row}, {k}) of {n}: {own:e}, by forces {by_forces:e}"
            );
        }
    }
}

/// Nodes at the ends of fields, at those of blocks, and some between.
fn probed<S: FamilyState>(state: &S) -> Vec<usize> {
    let (mut all, mut start) = (Vec::new(), 0);
    for &end in state.ends().iter() {
        let places = [0, 1, 2, 100, 254, 255, 256, 257, 258, 511, 512, 513];
        all.extend(places.iter().map(|k| start + k).filter(|k| *k < end));
        all.extend((1..=3).filter(|k| end - start >= *k).map(|k| end - k));
        start = end;
    }
    all.sort_unstable();
    all.dedup();
    all
}

/// Sizes below, at and above those of blocks.
pub(crate) const SIZES: [usize; 8] = [1, 2, 3, 255, 256, 257, 300, 1000];

/// Checks a model at all sizes that are large enough for it.
#[track_caller]
pub(crate) fn check_sizes<M: FamilyModel>(size: f64, of: impl Fn(usize) -> M) {
    let mut checked = 0;
    for n in SIZES {
        let model = of(n);
        if model.ends().is_ok() {
            check_alone(&model, size);
            checked += 1;
        }
    }
    assert!(checked >= 5, "most sizes are too small");
    assert!(M::FIELDS.iter().any(|field| field.length != Length::One), "a family");
}
