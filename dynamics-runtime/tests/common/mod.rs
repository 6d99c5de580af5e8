//! Models written by hand against the runtime's traits, so that it is checked without the macro and without
//! the engine.
#![allow(dead_code, unreachable_pub, reason = "every test file uses some of the models")]

pub mod constrained;

pub mod by_jets;

use dynamics_runtime::error::{SingularMassMatrix, SolveError};
use dynamics_runtime::model::{
    ActiveSet, ConservedKind, ConservedQuantity, Dynamics, Events, Model, ModelState, Outputs, Powers,
    Quantity,
};
use nalgebra::{SMatrix, SVector};

/// A state without names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlainState<const N: usize, const M: usize> {
    pub t: f64,
    pub q: SVector<f64, N>,
    pub u: SVector<f64, N>,
    pub inputs: SVector<f64, M>,
    pub active_set: ActiveSet,
}

impl<const N: usize, const M: usize> ModelState for PlainState<N, M> {
    type Vector = SVector<f64, N>;
    type Inputs = SVector<f64, M>;
    fn new(t: f64, q: Self::Vector, u: Self::Vector, inputs: Self::Inputs) -> Self {
        Self { t, q, u, inputs, active_set: ActiveSet::default() }
    }
    fn t(&self) -> f64 {
        self.t
    }
    fn q(&self) -> &Self::Vector {
        &self.q
    }
    fn u(&self) -> &Self::Vector {
        &self.u
    }
    fn inputs(&self) -> &Self::Inputs {
        &self.inputs
    }
    fn q_mut(&mut self) -> &mut Self::Vector {
        &mut self.q
    }
    fn u_mut(&mut self) -> &mut Self::Vector {
        &mut self.u
    }
    fn inputs_mut(&mut self) -> &mut Self::Inputs {
        &mut self.inputs
    }
    fn active_set(&self) -> ActiveSet {
        self.active_set
    }
    fn active_set_mut(&mut self) -> &mut ActiveSet {
        &mut self.active_set
    }
}

/// What a model by hand has to say; everything but the first four has a default.
pub trait ByHand<const N: usize, const M: usize> {
    fn q_ddot(&self, s: &PlainState<N, M>) -> Result<SVector<f64, N>, SolveError>;
    fn mass(&self, s: &PlainState<N, M>) -> SMatrix<f64, N, N>;
    fn impulse(&self, s: &PlainState<N, M>) -> SVector<f64, N> {
        self.mass(s) * s.u
    }
    fn energy(&self, s: &PlainState<N, M>) -> f64;
    fn constants_of_motion(&self, s: &PlainState<N, M>, values: &mut [f64]) {
        if let Some(first) = values.first_mut() {
            *first = self.energy(s);
        }
    }
    fn force_powers(&self, _: &PlainState<N, M>, _: &mut [f64]) {}
    fn results(&self, _: &PlainState<N, M>, _: &mut [f64]) {}
    fn event_values(&self, _: &PlainState<N, M>, _: &mut [f64]) {}
}

/// Implements the runtime's traits by way of [`ByHand`].
macro_rules! by_hand {
    ($model:ident, $n:literal, $m:literal, coordinates $q:expr, inputs $inputs:expr,
        conserved $conserved:expr,
     powers $powers:expr, outputs $outputs:expr, events $events:expr) => {
        impl dynamics_runtime::model::Described for $model {
            type Coordinates = (PlainState<$n, $m>, SVector<f64, $n>);
            const NAME: &'static str = stringify!($model);
        }

        impl Model for $model {
            type Vector = SVector<f64, $n>;
            type Matrix = SMatrix<f64, $n, $n>;
            type Inputs = SVector<f64, $m>;
            type State = PlainState<$n, $m>;
            fn coordinates_with(
                state: &Self::State,
                accelerations: &Self::Vector,
                _: &[f64],
            ) -> Self::Coordinates {
                (*state, *accelerations)
            }
        }
        impl Dynamics for $model {
            type Constants = ();
            type Series = ();
            const COORDINATES: &'static [Quantity] = &names::<$n>($q);
            const INPUTS: &'static [Quantity] = &names::<$m>($inputs);
            const PARAMETERS: &'static [Quantity] = &[];
            const CONSERVED: &'static [dynamics_runtime::model::ConservedQuantity] = &conserved($conserved);
            fn constants(&self) -> Result<(), SingularMassMatrix> {
                Ok(())
            }
            fn accelerations_with(&self, (): &(), state: &Self::State) -> Result<Self::Vector, SolveError> {
                self.q_ddot(state)
            }
            fn mass_matrix(&self, state: &Self::State) -> Self::Matrix {
                self.mass(state)
            }
            fn generalized_force(&self, state: &Self::State) -> Self::Vector {
                self.mass(state) * self.q_ddot(state).expect("regular in tests that ask for Q")
            }
            fn momenta(&self, state: &Self::State) -> Self::Vector {
                self.impulse(state)
            }
            fn energy_function(&self, state: &Self::State) -> f64 {
                self.energy(state)
            }
            fn conserved(&self, state: &Self::State, values: &mut [f64]) {
                self.constants_of_motion(state, values);
            }
        }
        impl Powers for $model {
            const POWERS: &'static [Quantity] = &names($powers);
            fn powers(&self, state: &Self::State, values: &mut [f64]) {
                self.force_powers(state, values);
            }
        }
        impl Outputs for $model {
            const OUTPUTS: &'static [Quantity] = &names($outputs);
            fn outputs(&self, state: &Self::State, values: &mut [f64]) -> Result<(), SolveError> {
                self.results(state, values);
                Ok(())
            }
        }
        dynamics_runtime::unconstrained!($model, $n);
        impl Events for $model {
            const EVENTS: &'static [Quantity] = &names($events);
            fn events(&self, state: &Self::State, values: &mut [f64]) -> Result<(), SolveError> {
                self.event_values(state, values);
                Ok(())
            }
        }
    };
}

#[allow(unused_imports, reason = "for models of one test file")]
pub(crate) use by_hand;

/// Quantities without units.
/// The energy, and momenta behind it.
pub const fn conserved<const K: usize>(names: [&'static str; K]) -> [ConservedQuantity; K] {
    let mut out = [ConservedQuantity { kind: ConservedKind::Energy, name: "", unit: "" }; K];
    let mut i = 0;
    while i < K {
        let kind = if i == 0 { ConservedKind::Energy } else { ConservedKind::Momentum };
        out[i] = ConservedQuantity { kind, name: names[i], unit: "" };
        i += 1;
    }
    out
}

pub const fn names<const K: usize>(names: [&'static str; K]) -> [Quantity; K] {
    let mut out = [Quantity::without_unit(""); K];
    let mut i = 0;
    while i < K {
        out[i] = Quantity::without_unit(names[i]);
        i += 1;
    }
    out
}

/// A state without inputs at t = 0.
pub fn at_rest_or_not<const N: usize>(q: [f64; N], u: [f64; N]) -> PlainState<N, 0> {
    PlainState {
        t: 0.0,
        q: q.into(),
        u: u.into(),
        inputs: SVector::zeros(),
        active_set: ActiveSet::default(),
    }
}

/// q̈ = −ω² q: closed form q = q₀ cos ωt + u₀/ω sin ωt.
pub struct Oscillator {
    pub omega: f64,
}

impl ByHand<1, 0> for Oscillator {
    fn q_ddot(&self, s: &PlainState<1, 0>) -> Result<SVector<f64, 1>, SolveError> {
        Ok(-self.omega * self.omega * s.q)
    }
    fn mass(&self, _: &PlainState<1, 0>) -> SMatrix<f64, 1, 1> {
        SMatrix::identity()
    }
    fn energy(&self, s: &PlainState<1, 0>) -> f64 {
        0.5 * (s.u[0] * s.u[0] + self.omega * self.omega * s.q[0] * s.q[0])
    }
    fn event_values(&self, s: &PlainState<1, 0>, values: &mut [f64]) {
        values[0] = s.q[0];
    }
}
by_hand!(Oscillator, 1, 0, coordinates ["x"], inputs [], conserved ["energy"],
    powers [], outputs [], events ["centre"]);

/// ℓ θ̈ = −g sin θ, with the rod's tension as output.
pub struct Pendulum {
    pub m: f64,
    pub l: f64,
    pub g: f64,
}

impl ByHand<1, 0> for Pendulum {
    fn q_ddot(&self, s: &PlainState<1, 0>) -> Result<SVector<f64, 1>, SolveError> {
        Ok(SVector::<f64, 1>::new(-self.g / self.l * s.q[0].sin()))
    }
    fn mass(&self, _: &PlainState<1, 0>) -> SMatrix<f64, 1, 1> {
        SMatrix::<f64, 1, 1>::new(self.m * self.l * self.l)
    }
    fn energy(&self, s: &PlainState<1, 0>) -> f64 {
        self.m * self.l * (0.5 * self.l * s.u[0] * s.u[0] - self.g * s.q[0].cos())
    }
    fn results(&self, s: &PlainState<1, 0>, values: &mut [f64]) {
        values[0] = self.m * (self.l * s.u[0] * s.u[0] + self.g * s.q[0].cos());
    }
}
by_hand!(Pendulum, 1, 0, coordinates ["theta"], inputs [], conserved ["energy"],
    powers [], outputs ["tension"], events []);

/// L = ½(ẋ² + ẏ²) + 1/r.
pub struct Kepler;

impl ByHand<2, 0> for Kepler {
    fn q_ddot(&self, s: &PlainState<2, 0>) -> Result<SVector<f64, 2>, SolveError> {
        let r2 = s.q.norm_squared();
        Ok(-s.q / (r2 * r2.sqrt()))
    }
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::identity()
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        0.5 * s.u.norm_squared() - 1.0 / s.q.norm()
    }
    fn constants_of_motion(&self, s: &PlainState<2, 0>, values: &mut [f64]) {
        values[0] = self.energy(s);
        values[1] = s.q[0] * s.u[1] - s.q[1] * s.u[0];
    }
    fn event_values(&self, s: &PlainState<2, 0>, values: &mut [f64]) {
        values[0] = s.q.dot(&s.u);
    }
}
by_hand!(Kepler, 2, 0, coordinates ["x", "y"], inputs [], conserved ["energy", "angular momentum"],
    powers [], outputs [],
    events ["apsis"]);

/// Restricted three-body problem in the rotating frame: L = ½[(ẋ − y)² + (ẏ + x)²] + μ'/r₁ + μ/r₂.
pub struct Arenstorf {
    pub mu: f64,
}

impl Arenstorf {
    fn pulls(&self, s: &PlainState<2, 0>) -> (SVector<f64, 2>, SVector<f64, 2>) {
        let rest = 1.0 - self.mu;
        (s.q + SVector::<f64, 2>::new(self.mu, 0.0), s.q - SVector::<f64, 2>::new(rest, 0.0))
    }
}

impl ByHand<2, 0> for Arenstorf {
    fn q_ddot(&self, s: &PlainState<2, 0>) -> Result<SVector<f64, 2>, SolveError> {
        let (r1, r2) = self.pulls(s);
        let pull = (1.0 - self.mu) * r1 / r1.norm().powi(3) + self.mu * r2 / r2.norm().powi(3);
        Ok(SVector::<f64, 2>::new(2.0 * s.u[1] + s.q[0], -2.0 * s.u[0] + s.q[1]) - pull)
    }
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::identity()
    }
    fn impulse(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::<f64, 2>::new(s.u[0] - s.q[1], s.u[1] + s.q[0])
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        let (r1, r2) = self.pulls(s);
        0.5 * (s.u.norm_squared() - s.q.norm_squared()) - (1.0 - self.mu) / r1.norm() - self.mu / r2.norm()
    }
}
by_hand!(Arenstorf, 2, 0, coordinates ["x", "y"], inputs [], conserved ["energy"],
    powers [], outputs [], events []);

/// H = ½(p₁² + p₂²) + ½(q₁² + q₂²) + q₁² q₂ − q₂³/3.
pub struct HenonHeiles;

impl ByHand<2, 0> for HenonHeiles {
    fn q_ddot(&self, s: &PlainState<2, 0>) -> Result<SVector<f64, 2>, SolveError> {
        let (x, y) = (s.q[0], s.q[1]);
        Ok(SVector::<f64, 2>::new(-x - 2.0 * x * y, -y - x * x + y * y))
    }
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::identity()
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        let (x, y) = (s.q[0], s.q[1]);
        0.5 * (s.u.norm_squared() + s.q.norm_squared()) + x * x * y - y * y * y / 3.0
    }
}
by_hand!(HenonHeiles, 2, 0, coordinates ["x", "y"], inputs [], conserved ["energy"],
    powers [], outputs [], events []);

/// Seven bodies in a plane, masses 1 to 7, G = 1; q = (x₁ … x₇, y₁ … y₇).
pub struct Pleiades;

impl Pleiades {
    fn pairs(q: &SVector<f64, 14>) -> impl Iterator<Item = (usize, usize, f64, f64)> + '_ {
        (0..7).flat_map(move |i| (0..i).map(move |j| (i, j, q[j] - q[i], q[7 + j] - q[7 + i])))
    }
}

impl ByHand<14, 0> for Pleiades {
    fn q_ddot(&self, s: &PlainState<14, 0>) -> Result<SVector<f64, 14>, SolveError> {
        let mut a = SVector::zeros();
        for (i, j, x, y) in Self::pairs(&s.q) {
            let r3 = (x * x + y * y).powf(1.5);
            let (mi, mj) = (1.0 + i as f64, 1.0 + j as f64);
            a[i] += mj * x / r3;
            a[j] -= mi * x / r3;
            a[7 + i] += mj * y / r3;
            a[7 + j] -= mi * y / r3;
        }
        Ok(a)
    }
    fn mass(&self, _: &PlainState<14, 0>) -> SMatrix<f64, 14, 14> {
        SMatrix::from_diagonal(&SVector::from_fn(|i, _| 1.0 + (i % 7) as f64))
    }
    fn energy(&self, s: &PlainState<14, 0>) -> f64 {
        let kinetic: f64 = (0..14).map(|i| 0.5 * (1 + i % 7) as f64 * s.u[i] * s.u[i]).sum();
        let pull = |(i, j, x, y): (usize, usize, f64, f64)| ((i + 1) * (j + 1)) as f64 / x.hypot(y);
        kinetic - Self::pairs(&s.q).map(pull).sum::<f64>()
    }
}
by_hand!(Pleiades, 14, 0,
    coordinates ["x1", "x2", "x3", "x4", "x5", "x6", "x7", "y1", "y2", "y3", "y4", "y5", "y6", "y7"],
    inputs [], conserved ["energy"], powers [], outputs [], events []);

/// Two point masses on massless rods, absolute angles from the downward vertical.
#[derive(Clone, Copy)]
pub struct DoublePendulum {
    pub m1: f64,
    pub m2: f64,
    pub l1: f64,
    pub l2: f64,
    pub g: f64,
}

impl DoublePendulum {
    pub const UNIT: Self = Self { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.8 };
}

impl ByHand<2, 0> for DoublePendulum {
    #[inline]
    fn q_ddot(&self, s: &PlainState<2, 0>) -> Result<SVector<f64, 2>, SolveError> {
        let Self { m1, m2, l1, l2, g } = *self;
        let ((sa, ca), (sb, cb)) = (s.q[0].sin_cos(), s.q[1].sin_cos());
        let (sine, cosine) = (sa * cb - ca * sb, ca * cb + sa * sb);
        let coupling = m2 * l1 * l2;
        let (m11, m12, m22) = ((m1 + m2) * l1 * l1, coupling * cosine, m2 * l2 * l2);
        let f1 = -coupling * sine * s.u[1] * s.u[1] - (m1 + m2) * g * l1 * sa;
        let f2 = coupling * sine * s.u[0] * s.u[0] - m2 * g * l2 * sb;
        let pivot = m22 - m12 * m12 / m11;
        let second = (f2 - m12 / m11 * f1) / pivot;
        Ok(SVector::<f64, 2>::new((f1 - m12 * second) / m11, second))
    }
    fn mass(&self, s: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        let Self { m1, m2, l1, l2, .. } = *self;
        let m12 = m2 * l1 * l2 * (s.q[0] - s.q[1]).cos();
        SMatrix::<f64, 2, 2>::new((m1 + m2) * l1 * l1, m12, m12, m2 * l2 * l2)
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        let Self { m1, m2, l1, l2, g } = *self;
        0.5 * s.u.dot(&(self.mass(s) * s.u)) - (m1 + m2) * g * l1 * s.q[0].cos() - m2 * g * l2 * s.q[1].cos()
    }
}
by_hand!(DoublePendulum, 2, 0, coordinates ["theta1", "theta2"], inputs [], conserved ["energy"],
    powers [], outputs [],
    events []);

/// m ẍ = −k x − c ẋ + F, F an input.
pub struct Driven {
    pub m: f64,
    pub k: f64,
    pub c: f64,
}

impl ByHand<1, 1> for Driven {
    fn q_ddot(&self, s: &PlainState<1, 1>) -> Result<SVector<f64, 1>, SolveError> {
        Ok((s.inputs - self.k * s.q - self.c * s.u) / self.m)
    }
    fn mass(&self, _: &PlainState<1, 1>) -> SMatrix<f64, 1, 1> {
        SMatrix::<f64, 1, 1>::new(self.m)
    }
    fn energy(&self, s: &PlainState<1, 1>) -> f64 {
        0.5 * (self.m * s.u[0] * s.u[0] + self.k * s.q[0] * s.q[0])
    }
    fn force_powers(&self, s: &PlainState<1, 1>, values: &mut [f64]) {
        values[0] = s.inputs[0] * s.u[0];
        values[1] = -self.c * s.u[0] * s.u[0];
    }
    fn results(&self, s: &PlainState<1, 1>, values: &mut [f64]) {
        values[0] = s.inputs[0];
    }
}
by_hand!(Driven, 1, 1, coordinates ["x"], inputs ["force"], conserved [],
    powers ["drive", "damper"], outputs ["force"],
    events []);

/// ẍ = −x on a table that an input lifts, which its energy knows.
pub struct Lifted;

impl ByHand<1, 1> for Lifted {
    fn q_ddot(&self, s: &PlainState<1, 1>) -> Result<SVector<f64, 1>, SolveError> {
        Ok(-s.q)
    }
    fn mass(&self, _: &PlainState<1, 1>) -> SMatrix<f64, 1, 1> {
        SMatrix::identity()
    }
    fn energy(&self, s: &PlainState<1, 1>) -> f64 {
        0.5 * (s.u[0] * s.u[0] + s.q[0] * s.q[0]) + s.inputs[0]
    }
}
by_hand!(Lifted, 1, 1, coordinates ["x"], inputs ["height"], conserved [], powers [], outputs [], events []);

/// A ball above a floor, ÿ = −g; the event `impact` is its height.
pub struct Ball {
    pub g: f64,
}

impl ByHand<1, 0> for Ball {
    fn q_ddot(&self, _: &PlainState<1, 0>) -> Result<SVector<f64, 1>, SolveError> {
        Ok(SVector::<f64, 1>::new(-self.g))
    }
    fn mass(&self, _: &PlainState<1, 0>) -> SMatrix<f64, 1, 1> {
        SMatrix::identity()
    }
    fn energy(&self, s: &PlainState<1, 0>) -> f64 {
        0.5 * s.u[0] * s.u[0] + self.g * s.q[0]
    }
    fn event_values(&self, s: &PlainState<1, 0>, values: &mut [f64]) {
        values[0] = s.q[0];
        values[1] = s.u[0];
    }
}
by_hand!(Ball, 1, 0, coordinates ["y"], inputs [], conserved ["energy"],
    powers [], outputs [], events ["impact", "apex"]);

/// m(q) = 2 R² (1 + cos q): a bead on a cycloid, whose inertia vanishes at the cusps.
pub struct CycloidBead {
    pub radius: f64,
    pub g: f64,
}

impl ByHand<1, 0> for CycloidBead {
    fn q_ddot(&self, s: &PlainState<1, 0>) -> Result<SVector<f64, 1>, SolveError> {
        let inertia = self.mass(s)[0];
        if inertia < 1e-9 {
            return Err(
                SingularMassMatrix { coordinate: 0, name: "theta", pivot: inertia, negative: false }.into()
            );
        }
        let force = self.radius * (self.radius * s.u[0] * s.u[0] - self.g) * s.q[0].sin();
        Ok(SVector::<f64, 1>::new(force / inertia))
    }
    fn mass(&self, s: &PlainState<1, 0>) -> SMatrix<f64, 1, 1> {
        SMatrix::<f64, 1, 1>::new(2.0 * self.radius * self.radius * (1.0 + s.q[0].cos()))
    }
    fn energy(&self, s: &PlainState<1, 0>) -> f64 {
        self.radius * (self.radius * (1.0 + s.q[0].cos()) * s.u[0] * s.u[0] + self.g * (1.0 - s.q[0].cos()))
    }
}
by_hand!(CycloidBead, 1, 0, coordinates ["theta"], inputs [], conserved ["energy"],
    powers [], outputs [], events []);

/// q̈ = f(t, q, u) for a closure, one coordinate, to provoke failures.
pub struct Closure(pub fn(f64, f64, f64) -> f64);

impl ByHand<1, 0> for Closure {
    fn q_ddot(&self, s: &PlainState<1, 0>) -> Result<SVector<f64, 1>, SolveError> {
        Ok(SVector::<f64, 1>::new(self.0(s.t, s.q[0], s.u[0])))
    }
    fn mass(&self, _: &PlainState<1, 0>) -> SMatrix<f64, 1, 1> {
        SMatrix::identity()
    }
    fn energy(&self, s: &PlainState<1, 0>) -> f64 {
        0.5 * s.u[0] * s.u[0]
    }
}
by_hand!(Closure, 1, 0, coordinates ["x"], inputs [], conserved [], powers [], outputs [], events []);

/// Sixty oscillators, whose masses hang together and change: a condition number takes as long as hundreds of
/// evaluations, an implicit step as tens of thousands.
pub struct Sixty;

impl ByHand<60, 0> for Sixty {
    fn q_ddot(&self, s: &PlainState<60, 0>) -> Result<SVector<f64, 60>, SolveError> {
        Ok(-s.q)
    }
    fn mass(&self, s: &PlainState<60, 0>) -> SMatrix<f64, 60, 60> {
        SMatrix::from_fn(|i, j| if i == j { 1.0 } else { 0.01 * (s.q[0] + s.q[i] * s.q[j]) })
    }
    fn energy(&self, s: &PlainState<60, 0>) -> f64 {
        0.5 * (s.u.dot(&s.u) + s.q.dot(&s.q))
    }
}
by_hand!(Sixty, 60, 0, coordinates ["x"; 60], inputs [], conserved ["energy"],
    powers [], outputs [], events []);
