//! Constrained models written by hand against the runtime's traits. The test files that use them say
//! `mod common;` first.

use dynamics_runtime::constrain;
use dynamics_runtime::error::{SingularMassMatrix, SolveError};
use dynamics_runtime::model::{
    Constraint, ConstraintKind, Constraints, Dynamics, Events, Model, Outputs, Powers, Quantity, Solved,
    SolverKind, Terms,
};
use nalgebra::{SMatrix, SVector};

use super::{PlainState, conserved, names};

/// What a constrained model by hand has to say. N coordinates, H holonomic rows, R rows in all.
pub trait Held<const N: usize, const H: usize, const R: usize> {
    fn mass(&self, s: &PlainState<N, 0>) -> SMatrix<f64, N, N>;
    /// Q.
    fn force(&self, s: &PlainState<N, 0>) -> SVector<f64, N>;
    fn energy(&self, s: &PlainState<N, 0>) -> f64;
    /// Φ.
    fn phi(&self, s: &PlainState<N, 0>) -> SVector<f64, H>;
    /// Φ_q joined by A.
    fn phi_q(&self, s: &PlainState<N, 0>) -> SMatrix<f64, R, N>;
    /// Φ_t joined by b.
    fn phi_t(&self, _: &PlainState<N, 0>) -> SVector<f64, R> {
        SVector::zeros()
    }
    /// γ.
    fn right(&self, s: &PlainState<N, 0>) -> SVector<f64, R>;
    /// What generated code would give.
    fn unrolled(&self, _: &PlainState<N, 0>) -> Option<Solved<SVector<f64, N>, SVector<f64, R>>> {
        None
    }
    /// Q with reactions, and ∂Q/∂λ.
    fn with_reactions(
        &self,
        s: &PlainState<N, 0>,
        _: &SVector<f64, R>,
    ) -> (SVector<f64, N>, SMatrix<f64, N, R>) {
        (self.force(s), SMatrix::zeros())
    }
    fn event_values(&self, _: &PlainState<N, 0>, _: &mut [f64]) {}
}

/// A constraint without options.
pub const fn constraint(name: &'static str, kind: ConstraintKind, first: usize, rows: usize) -> Constraint {
    Constraint { name, kind, first, rows, redundant: false, switched: None }
}

/// Implements the runtime's traits by way of [`Held`].
macro_rules! held {
    ($model:ident, $n:literal coordinates $q:expr, $h:literal + $k:literal = $r:literal rows $rows:expr,
        $constraints:expr,
     friction $friction:literal, events $events:expr) => {
        impl dynamics_runtime::model::Described for $model {
            type Coordinates = (PlainState<$n, 0>, SVector<f64, $n>);
            const NAME: &'static str = stringify!($model);
        }

        impl Model for $model {
            type Vector = SVector<f64, $n>;
            type Matrix = SMatrix<f64, $n, $n>;
            type Inputs = SVector<f64, 0>;
            type State = PlainState<$n, 0>;
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
            const INPUTS: &'static [Quantity] = &[];
            const PARAMETERS: &'static [Quantity] = &[];
            const CONSERVED: &'static [dynamics_runtime::model::ConservedQuantity] = &conserved(["energy"]);
            fn constants(&self) -> Result<(), SingularMassMatrix> {
                Ok(())
            }
            fn accelerations_with(&self, (): &(), state: &Self::State) -> Result<Self::Vector, SolveError> {
                constrain::solve_once(self, &(), state).map(|outcome| outcome.accelerations)
            }
            fn mass_matrix(&self, state: &Self::State) -> Self::Matrix {
                self.mass(state)
            }
            fn generalized_force(&self, state: &Self::State) -> Self::Vector {
                self.force(state)
            }
            fn momenta(&self, state: &Self::State) -> Self::Vector {
                self.mass(state) * state.u
            }
            fn energy_function(&self, state: &Self::State) -> f64 {
                self.energy(state)
            }
            fn conserved(&self, state: &Self::State, values: &mut [f64]) {
                values[0] = self.energy(state);
            }
        }
        impl Powers for $model {
            const POWERS: &'static [Quantity] = &[];
            fn powers(&self, _: &Self::State, _: &mut [f64]) {}
        }
        impl Outputs for $model {
            const OUTPUTS: &'static [Quantity] = &[];
            fn outputs(&self, _: &Self::State, _: &mut [f64]) -> Result<(), SolveError> {
                Ok(())
            }
        }
        impl Events for $model {
            const EVENTS: &'static [Quantity] = &names($events);
            fn events(&self, state: &Self::State, values: &mut [f64]) -> Result<(), SolveError> {
                self.event_values(state, values);
                Ok(())
            }
        }
        impl Constraints for $model {
            type Rows = SVector<f64, $r>;
            type Residual = SVector<f64, $h>;
            type Jacobian = SMatrix<f64, $r, $n>;
            type VelocityJacobian = SMatrix<f64, $k, $n>;
            type VelocityOffset = SVector<f64, $k>;
            type Workspace = [f64; constrain::workspace_len($n, $r)];
            const CONSTRAINTS: &'static [Constraint] = &$constraints;
            const ROWS: &'static [Quantity] = &names::<$r>($rows);
            const SOLVER: SolverKind = SolverKind::General { reason: "written by hand" };
            const FRICTION: bool = $friction;
            fn residual(&self, state: &Self::State) -> Self::Residual {
                self.phi(state)
            }
            fn velocity_residual(&self, state: &Self::State) -> Self::Rows {
                self.phi_q(state) * state.u + self.phi_t(state)
            }
            fn jacobian(&self, state: &Self::State) -> Self::Jacobian {
                self.phi_q(state)
            }
            fn velocity_jacobian(&self, state: &Self::State) -> Self::VelocityJacobian {
                self.phi_q(state).fixed_rows::<$k>($h).into()
            }
            fn velocity_offset(&self, state: &Self::State) -> Self::VelocityOffset {
                self.phi_t(state).fixed_rows::<$k>($h).into()
            }
            fn gamma(&self, state: &Self::State) -> Self::Rows {
                self.right(state)
            }
            fn terms(&self, state: &Self::State, terms: &mut Terms<'_>) {
                // By rows: the transpose's memory.
                terms.mass.copy_from_slice(self.mass(state).transpose().as_slice());
                terms.force.copy_from_slice(self.force(state).as_slice());
                terms.jacobian.copy_from_slice(self.phi_q(state).transpose().as_slice());
                terms.gamma.copy_from_slice(self.right(state).as_slice());
            }
            fn friction(
                &self,
                state: &Self::State,
                multipliers: &Self::Rows,
                force: &mut [f64],
                by: &mut [f64],
            ) {
                let (q, by_multipliers) = self.with_reactions(state, multipliers);
                force.copy_from_slice(q.as_slice());
                by.copy_from_slice(by_multipliers.transpose().as_slice());
            }
            fn solve_unrolled(
                &self,
                (): &(),
                state: &Self::State,
            ) -> Option<Solved<Self::Vector, Self::Rows>> {
                if state.active_set.all_hold() { self.unrolled(state) } else { None }
            }
            fn correct_unrolled(&self, (): &(), _: &Self::State, _: &Self::Rows) -> Option<Self::Vector> {
                None
            }
            fn constraint_derivatives(
                &self,
                state: &Self::State,
                multipliers: &Self::Rows,
                values: &mut [f64],
            ) {
                $crate::common::constrained::derivatives::<$n, $h, $r>(self, state, multipliers, values);
            }
            fn constraint_of(_: core::any::TypeId) -> Option<usize> {
                None
            }
        }
    };
}
#[allow(unused_imports, reason = "for models of one test file")]
pub(crate) use held;

/// ∂(Φ_qᵀλ)/∂q, ∂γ/∂q and ∂γ/∂q̇ by central differences.
pub fn derivatives<const N: usize, const H: usize, const R: usize>(
    model: &impl Held<N, H, R>,
    state: &PlainState<N, 0>,
    lambda: &SVector<f64, R>,
    values: &mut [f64],
) {
    let h = 1e-5;
    for j in 0..N {
        let moved = |by: f64| {
            let mut s = *state;
            s.q[j] += by;
            s
        };
        let pushed = |by: f64| {
            let mut s = *state;
            s.u[j] += by;
            s
        };
        let (up, down) = (moved(h), moved(-h));
        let reaction = (model.phi_q(&up) - model.phi_q(&down)).transpose() * lambda / (2.0 * h);
        let by_q = (model.right(&up) - model.right(&down)) / (2.0 * h);
        let by_u = (model.right(&pushed(h)) - model.right(&pushed(-h))) / (2.0 * h);
        (0..N).for_each(|i| values[i * N + j] = reaction[i]);
        for i in 0..R {
            values[N * N + i * N + j] = by_q[i];
            values[N * N + R * N + i * N + j] = by_u[i];
        }
    }
}

/// A bob of mass m on a rod of length l in Cartesian coordinates: Φ = ½ (x² + y² − l²); λ < 0 is a pull,
/// tension −λ l.
#[derive(Clone, Copy, Debug)]
pub struct Rod {
    pub m: f64,
    pub l: f64,
    pub g: f64,
}

impl Held<2, 1, 1> for Rod {
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::<f64, 2, 2>::identity() * self.m
    }
    fn force(&self, _: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::<f64, 2>::new(0.0, -self.m * self.g)
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        self.m * (0.5 * s.u.norm_squared() + self.g * s.q[1])
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, 1> {
        SVector::<f64, 1>::new(0.5 * (s.q.norm_squared() - self.l * self.l))
    }
    fn phi_q(&self, s: &PlainState<2, 0>) -> SMatrix<f64, 1, 2> {
        s.q.transpose()
    }
    fn right(&self, s: &PlainState<2, 0>) -> SVector<f64, 1> {
        SVector::<f64, 1>::new(-s.u.norm_squared())
    }
}
held!(Rod, 2 coordinates ["x", "y"], 1 + 0 = 1 rows ["rod"],
    [constraint("rod", ConstraintKind::Holonomic, 0, 1)], friction false, events []);

/// [`Rod`] with its constraint said three times, in three units.
#[derive(Clone, Copy, Debug)]
pub struct TripleRod(pub Rod);

impl Held<2, 3, 3> for TripleRod {
    fn mass(&self, s: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        self.0.mass(s)
    }
    fn force(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        self.0.force(s)
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        self.0.energy(s)
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, 3> {
        SVector::<f64, 3>::new(1.0, 2.0, -1e3) * self.0.phi(s)[0]
    }
    fn phi_q(&self, s: &PlainState<2, 0>) -> SMatrix<f64, 3, 2> {
        SVector::<f64, 3>::new(1.0, 2.0, -1e3) * self.0.phi_q(s)
    }
    fn right(&self, s: &PlainState<2, 0>) -> SVector<f64, 3> {
        SVector::<f64, 3>::new(1.0, 2.0, -1e3) * self.0.right(s)[0]
    }
}
held!(TripleRod, 2 coordinates ["x", "y"], 3 + 0 = 3 rows ["rod[0]", "rod[1]", "rod[2]"],
    [constraint("rod", ConstraintKind::Holonomic, 0, 3)], friction false, events []);

/// Φ = (x² + y² − l²)²: its gradient vanishes wherever it holds.
#[derive(Clone, Copy, Debug)]
pub struct SquaredRod(pub Rod);

impl Held<2, 1, 1> for SquaredRod {
    fn mass(&self, s: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        self.0.mass(s)
    }
    fn force(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        self.0.force(s)
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        self.0.energy(s)
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, 1> {
        let d = 2.0 * self.0.phi(s)[0];
        SVector::<f64, 1>::new(d * d)
    }
    fn phi_q(&self, s: &PlainState<2, 0>) -> SMatrix<f64, 1, 2> {
        s.q.transpose() * (8.0 * self.0.phi(s)[0])
    }
    fn right(&self, s: &PlainState<2, 0>) -> SVector<f64, 1> {
        let rate = s.q.dot(&s.u);
        SVector::<f64, 1>::new(-8.0 * rate * rate - 8.0 * self.0.phi(s)[0] * s.u.norm_squared())
    }
}
held!(SquaredRod, 2 coordinates ["x", "y"], 1 + 0 = 1 rows ["rod"],
    [constraint("rod", ConstraintKind::Holonomic, 0, 1)], friction false, events []);

/// Bars in a plane, each with the angle of its own from the x axis, closed to a loop: Σ lᵢ (cos θᵢ, sin θᵢ) =
/// (d, 0). The inertia of each bar, with the mass that hangs on its end lumped, is mᵢ lᵢ²; gravity acts on Σ
/// mᵢ lᵢ sin θᵢ.
#[derive(Clone, Copy, Debug)]
pub struct FourBar {
    pub m: [f64; 3],
    pub l: [f64; 3],
    pub d: f64,
    pub g: f64,
}

impl FourBar {
    /// Two cranks of length 1, two frames of length 2: it closes at equal angles of the cranks, and flattens
    /// at 0.
    pub const PARALLELOGRAM: Self = Self { m: [1.0, 0.5, 2.0], l: [1.0, 2.0, -1.0], d: 2.0, g: 9.81 };
}

impl Held<3, 2, 2> for FourBar {
    fn mass(&self, _: &PlainState<3, 0>) -> SMatrix<f64, 3, 3> {
        SMatrix::from_diagonal(&SVector::from_fn(|i, _| self.m[i] * self.l[i] * self.l[i]))
    }
    fn force(&self, s: &PlainState<3, 0>) -> SVector<f64, 3> {
        SVector::from_fn(|i, _| -self.g * self.m[i] * self.l[i] * s.q[i].cos())
    }
    fn energy(&self, s: &PlainState<3, 0>) -> f64 {
        let height: f64 = (0..3).map(|i| self.m[i] * self.l[i] * s.q[i].sin()).sum();
        0.5 * s.u.dot(&(self.mass(s) * s.u)) + self.g * height
    }
    fn phi(&self, s: &PlainState<3, 0>) -> SVector<f64, 2> {
        let sum = |f: fn(f64) -> f64| (0..3).map(|i| self.l[i] * f(s.q[i])).sum::<f64>();
        SVector::<f64, 2>::new(sum(f64::cos) - self.d, sum(f64::sin))
    }
    fn phi_q(&self, s: &PlainState<3, 0>) -> SMatrix<f64, 2, 3> {
        SMatrix::from_fn(|i, j| self.l[j] * if i == 0 { -s.q[j].sin() } else { s.q[j].cos() })
    }
    fn right(&self, s: &PlainState<3, 0>) -> SVector<f64, 2> {
        let sum = |f: fn(f64) -> f64| (0..3).map(|i| self.l[i] * f(s.q[i]) * s.u[i] * s.u[i]).sum::<f64>();
        SVector::<f64, 2>::new(sum(f64::cos), sum(f64::sin))
    }
}
held!(FourBar, 3 coordinates ["crank", "coupler", "rocker"], 2 + 0 = 2 rows ["closure.x", "closure.y"],
    [constraint("closure", ConstraintKind::Holonomic, 0, 2)], friction false, events []);

/// Crank of length a, connecting rod of length b, slider at x; angles θ of the crank and β of the rod, both
/// from the x axis: a cos θ + b cos β = x, a sin θ + b sin β = 0. The slider has the mass, the crank the
/// inertia j; the rod has none, if `rod` is 0.
#[derive(Clone, Copy, Debug)]
pub struct SliderCrank {
    pub a: f64,
    pub b: f64,
    pub j: f64,
    pub rod: f64,
    pub slider: f64,
    pub load: f64,
}

impl Held<3, 2, 2> for SliderCrank {
    fn mass(&self, _: &PlainState<3, 0>) -> SMatrix<f64, 3, 3> {
        SMatrix::from_diagonal(&SVector::<f64, 3>::new(self.j, self.rod, self.slider))
    }
    fn force(&self, _: &PlainState<3, 0>) -> SVector<f64, 3> {
        SVector::<f64, 3>::new(0.0, 0.0, self.load)
    }
    fn energy(&self, s: &PlainState<3, 0>) -> f64 {
        0.5 * s.u.dot(&(self.mass(s) * s.u)) - self.load * s.q[2]
    }
    fn phi(&self, s: &PlainState<3, 0>) -> SVector<f64, 2> {
        let Self { a, b, .. } = *self;
        SVector::<f64, 2>::new(
            a * s.q[0].cos() + b * s.q[1].cos() - s.q[2],
            a * s.q[0].sin() + b * s.q[1].sin(),
        )
    }
    fn phi_q(&self, s: &PlainState<3, 0>) -> SMatrix<f64, 2, 3> {
        let ((sa, ca), (sb, cb)) = (s.q[0].sin_cos(), s.q[1].sin_cos());
        let Self { a, b, .. } = *self;
        SMatrix::<f64, 2, 3>::new(-a * sa, -b * sb, -1.0, a * ca, b * cb, 0.0)
    }
    fn right(&self, s: &PlainState<3, 0>) -> SVector<f64, 2> {
        let ((sa, ca), (sb, cb)) = (s.q[0].sin_cos(), s.q[1].sin_cos());
        let (wa, wb) = (self.a * s.u[0] * s.u[0], self.b * s.u[1] * s.u[1]);
        SVector::<f64, 2>::new(wa * ca + wb * cb, wa * sa + wb * sb)
    }
}
held!(SliderCrank, 3 coordinates ["theta", "beta", "x"], 2 + 0 = 2 rows ["closure.x", "closure.y"],
    [constraint("closure", ConstraintKind::Holonomic, 0, 2)], friction false, events []);

/// A sleigh on a knife edge at distance a before its centre of mass (x, y), heading φ: the edge does not slip
/// sideways, −ẋ sin φ + ẏ cos φ + a φ̇ = 0.
#[derive(Clone, Copy, Debug)]
pub struct Sleigh {
    pub m: f64,
    pub j: f64,
    pub a: f64,
}

impl Held<3, 0, 1> for Sleigh {
    fn mass(&self, _: &PlainState<3, 0>) -> SMatrix<f64, 3, 3> {
        SMatrix::from_diagonal(&SVector::<f64, 3>::new(self.m, self.m, self.j))
    }
    fn force(&self, _: &PlainState<3, 0>) -> SVector<f64, 3> {
        SVector::zeros()
    }
    fn energy(&self, s: &PlainState<3, 0>) -> f64 {
        0.5 * s.u.dot(&(self.mass(s) * s.u))
    }
    fn phi(&self, _: &PlainState<3, 0>) -> SVector<f64, 0> {
        SVector::zeros()
    }
    fn phi_q(&self, s: &PlainState<3, 0>) -> SMatrix<f64, 1, 3> {
        SMatrix::<f64, 1, 3>::new(-s.q[2].sin(), s.q[2].cos(), self.a)
    }
    fn right(&self, s: &PlainState<3, 0>) -> SVector<f64, 1> {
        SVector::<f64, 1>::new(s.u[2] * (s.u[0] * s.q[2].cos() + s.u[1] * s.q[2].sin()))
    }
}
held!(Sleigh, 3 coordinates ["x", "y", "phi"], 0 + 1 = 1 rows ["knife"],
    [constraint("knife", ConstraintKind::Nonholonomic, 0, 1)], friction false, events []);

/// A uniform rod of half length l that slides with its lower end on a rough floor, at θ from the horizontal:
/// Φ = y − l sin θ of that end, friction −μ |N| sign(v) on it, or −μ N sign(v) where `linear`.
#[derive(Clone, Copy, Debug)]
pub struct PainleveRod {
    pub m: f64,
    pub l: f64,
    pub g: f64,
    pub mu: f64,
    pub linear: bool,
}

impl PainleveRod {
    /// At an angle and rate, its end on the floor and slipping with speed v.
    pub fn slipping(&self, theta: f64, omega: f64, v: f64) -> PlainState<3, 0> {
        let (s, c) = theta.sin_cos();
        let q = [self.l * c, self.l * s, theta];
        super::at_rest_or_not(q, [v - self.l * s * omega, self.l * c * omega, omega])
    }
    /// Speed of the lower end.
    pub fn slip(&self, s: &PlainState<3, 0>) -> f64 {
        s.u[0] + self.l * s.q[2].sin() * s.u[2]
    }
}

impl Held<3, 1, 1> for PainleveRod {
    fn mass(&self, _: &PlainState<3, 0>) -> SMatrix<f64, 3, 3> {
        SMatrix::from_diagonal(&SVector::<f64, 3>::new(self.m, self.m, self.m * self.l * self.l / 3.0))
    }
    fn force(&self, _: &PlainState<3, 0>) -> SVector<f64, 3> {
        SVector::<f64, 3>::new(0.0, -self.m * self.g, 0.0)
    }
    fn energy(&self, s: &PlainState<3, 0>) -> f64 {
        0.5 * s.u.dot(&(self.mass(s) * s.u)) + self.m * self.g * s.q[1]
    }
    fn phi(&self, s: &PlainState<3, 0>) -> SVector<f64, 1> {
        SVector::<f64, 1>::new(s.q[1] - self.l * s.q[2].sin())
    }
    fn phi_q(&self, s: &PlainState<3, 0>) -> SMatrix<f64, 1, 3> {
        SMatrix::<f64, 1, 3>::new(0.0, 1.0, -self.l * s.q[2].cos())
    }
    fn right(&self, s: &PlainState<3, 0>) -> SVector<f64, 1> {
        SVector::<f64, 1>::new(-self.l * s.q[2].sin() * s.u[2] * s.u[2])
    }
    fn with_reactions(
        &self,
        s: &PlainState<3, 0>,
        lambda: &SVector<f64, 1>,
    ) -> (SVector<f64, 3>, SMatrix<f64, 3, 1>) {
        let direction = -self.mu * self.slip(s).signum();
        let arm = SVector::<f64, 3>::new(1.0, 0.0, self.l * s.q[2].sin());
        let (size, slope) =
            if self.linear { (lambda[0], 1.0) } else { (lambda[0].abs(), lambda[0].signum()) };
        (self.force(s) + arm * (direction * size), arm * (direction * slope))
    }
}
held!(PainleveRod, 3 coordinates ["x", "y", "theta"], 1 + 0 = 1 rows ["floor"],
    [Constraint { switched: Some(0), ..constraint("floor", ConstraintKind::Holonomic, 0, 1) }],
        friction true, events []);

/// [`Rod`] beside ½ (x² + y² − l²)(1 + x) = 0, which repeats it where it holds, and nowhere else.
#[derive(Clone, Copy, Debug)]
pub struct TwiceRod(pub Rod);

impl Held<2, 2, 2> for TwiceRod {
    fn mass(&self, s: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        self.0.mass(s)
    }
    fn force(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        self.0.force(s)
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        self.0.energy(s)
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::<f64, 2>::new(1.0, 1.0 + s.q[0]) * self.0.phi(s)[0]
    }
    fn phi_q(&self, s: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        let ([x, y], phi) = ([s.q[0], s.q[1]], self.0.phi(s)[0]);
        SMatrix::<f64, 2, 2>::new(x, y, (1.0 + x) * x + phi, (1.0 + x) * y)
    }
    fn right(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        let square = s.u.norm_squared();
        SVector::<f64, 2>::new(-square, -(1.0 + s.q[0]) * square - 2.0 * s.u[0] * s.q.dot(&s.u))
    }
}
held!(TwiceRod, 2 coordinates ["x", "y"], 2 + 0 = 2 rows ["rod", "again"],
    [constraint("rod", ConstraintKind::Holonomic, 0, 1),
     Constraint { redundant: true, ..constraint("again", ConstraintKind::Holonomic, 1, 1) }],
    friction false, events []);
