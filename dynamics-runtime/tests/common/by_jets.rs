//! Constrained models from their constraint functions alone, written on time jets: Φ_q and γ come from the
//! jets, so that no derivative is written by hand. Accelerations come from the dense KKT matrix.

use super::{PlainState, names};
use core::any::TypeId;
use dynamics_runtime::Expr;
use dynamics_runtime::error::{SingularMassMatrix, SolveError};
use dynamics_runtime::model::{
    ConservedQuantity, Constraint, ConstraintKind, Constraints, Described, Dynamics, Events, Model, Outputs,
    Powers, Quantity, Solved, SolverKind, Terms,
};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// What such a model says. N coordinates, R rows.
pub trait Mechanism<const N: usize, const R: usize>: Send + Sync + Sized + 'static {
    const COORDINATES: [&'static str; N];
    const CONSTRAINTS: &'static [Constraint];
    const ROWS: [&'static str; R];
    /// The rows: Φ where holonomic, A q̇ + b where not.
    fn rows(&self, q: &[Expr; N], t: Expr) -> [Expr; R];
    /// The diagonal of the constant mass matrix.
    fn inertia(&self) -> [f64; N] {
        [1.0; N]
    }
    /// Called where Φ_q or M are asked for by value.
    fn by_value(&self) {}
    /// V, and −∂V/∂q as force.
    fn potential(&self, _q: &[f64; N]) -> (f64, [f64; N]) {
        (0.0, [0.0; N])
    }
}

/// A holonomic constraint that is not switched.
pub const fn holonomic(name: &'static str, first: usize, rows: usize) -> Constraint {
    Constraint { name, kind: ConstraintKind::Holonomic, first, rows, redundant: false, switched: None }
}

/// A model of a mechanism.
pub struct Jets<T, const N: usize, const R: usize>(pub T);

pub type JetState<const N: usize> = PlainState<N, 0>;

impl<T: Mechanism<N, R>, const N: usize, const R: usize> Jets<T, N, R> {
    const QUANTITIES: [Quantity; N] = names(T::COORDINATES);
    const QUANTITIES_OF_ROWS: [Quantity; R] = names(T::ROWS);
    const POWER: [Quantity; 1] = names(["drive"]);

    fn jets(&self, s: &JetState<N>, u: &SVector<f64, N>) -> [Expr; R] {
        let q = core::array::from_fn(|i| Expr::coordinate(s.q[i], u[i], 0.0));
        self.0.rows(&q, Expr::time(s.t))
    }

    fn is_holonomic(row: usize) -> bool {
        let of = T::CONSTRAINTS.iter().find(|c| (c.first..c.first + c.rows).contains(&row));
        of.expect("rows belong to constraints").kind == ConstraintKind::Holonomic
    }

    /// Φ̇, or A q̇ + b, at velocities u, and its derivative without accelerations.
    fn rates(&self, s: &JetState<N>, u: &SVector<f64, N>) -> [(f64, f64); R] {
        let rows = self.jets(s, u);
        core::array::from_fn(|r| {
            let row = rows[r];
            if Self::is_holonomic(r) { (row.rate(), row.acceleration()) } else { (row.value(), row.rate()) }
        })
    }

    fn by_q(&self, s: &JetState<N>) -> SMatrix<f64, R, N> {
        let offset = self.rates(s, &SVector::zeros());
        let mut out = SMatrix::zeros();
        for j in 0..N {
            let mut unit = SVector::zeros();
            unit[j] = 1.0;
            let column = self.rates(s, &unit);
            (0..R).for_each(|r| out[(r, j)] = column[r].0 - offset[r].0);
        }
        out
    }

    /// q̈ and λ where they are unique, NaN elsewhere.
    pub fn kkt(&self, s: &JetState<N>) -> (SVector<f64, N>, SVector<f64, R>) {
        let (mass, jacobian, gamma) = (self.0.inertia(), self.by_q(s), self.gamma(s));
        let force = self.generalized_force(s);
        let mut kkt = DMatrix::zeros(N + R, N + R);
        let mut right = DVector::zeros(N + R);
        for i in 0..N {
            kkt[(i, i)] = mass[i];
            right[i] = force[i];
            for r in 0..R {
                kkt[(i, N + r)] = -jacobian[(r, i)];
                kkt[(N + r, i)] = jacobian[(r, i)];
                right[N + r] = gamma[r];
            }
        }
        let solution =
            kkt.full_piv_lu().solve(&right).unwrap_or_else(|| DVector::from_element(N + R, f64::NAN));
        (SVector::from_fn(|i, _| solution[i]), SVector::from_fn(|r, _| solution[N + r]))
    }
}

impl<T: Mechanism<N, R>, const N: usize, const R: usize> Described for Jets<T, N, R> {
    type Coordinates = [Expr; N];
    const NAME: &'static str = "mechanism";
}

impl<T: Mechanism<N, R>, const N: usize, const R: usize> Model for Jets<T, N, R> {
    type Vector = SVector<f64, N>;
    type Matrix = SMatrix<f64, N, N>;
    type Inputs = SVector<f64, 0>;
    type State = JetState<N>;
    fn coordinates_with(s: &Self::State, a: &Self::Vector, _: &[f64]) -> Self::Coordinates {
        core::array::from_fn(|i| Expr::coordinate(s.q[i], s.u[i], a[i]))
    }
}

impl<T: Mechanism<N, R>, const N: usize, const R: usize> Dynamics for Jets<T, N, R> {
    type Constants = ();
    type Series = ();
    const COORDINATES: &'static [Quantity] = &Self::QUANTITIES;
    const INPUTS: &'static [Quantity] = &[];
    const PARAMETERS: &'static [Quantity] = &[];
    const CONSERVED: &'static [ConservedQuantity] = &[];
    fn constants(&self) -> Result<(), SingularMassMatrix> {
        Ok(())
    }
    fn accelerations_with(&self, (): &(), s: &Self::State) -> Result<Self::Vector, SolveError> {
        Ok(self.kkt(s).0)
    }
    fn mass_matrix(&self, _: &Self::State) -> Self::Matrix {
        self.0.by_value();
        SMatrix::from_diagonal(&SVector::from(self.0.inertia()))
    }
    fn generalized_force(&self, s: &Self::State) -> Self::Vector {
        SVector::from(self.0.potential(&s.q.into()).1)
    }
    fn momenta(&self, s: &Self::State) -> Self::Vector {
        self.mass_matrix(s) * s.u
    }
    fn energy_function(&self, s: &Self::State) -> f64 {
        0.5 * self.momenta(s).dot(&s.u) + self.0.potential(&s.q.into()).0
    }
    fn conserved(&self, _: &Self::State, _: &mut [f64]) {}
}

impl<T: Mechanism<N, R>, const N: usize, const R: usize> Constraints for Jets<T, N, R> {
    type Rows = SVector<f64, R>;
    // The rows that are not holonomic are there too, as NaN: nothing may read them.
    type Residual = SVector<f64, R>;
    type Jacobian = SMatrix<f64, R, N>;
    type VelocityJacobian = SMatrix<f64, R, N>;
    type VelocityOffset = SVector<f64, R>;
    type Workspace = [f64; 8192];
    const CONSTRAINTS: &'static [Constraint] = T::CONSTRAINTS;
    const ROWS: &'static [Quantity] = &Self::QUANTITIES_OF_ROWS;
    const SOLVER: SolverKind = SolverKind::General { reason: "written by hand" };
    fn residual(&self, s: &Self::State) -> Self::Residual {
        let rows = self.jets(s, &s.u);
        SVector::from_fn(|r, _| if Self::is_holonomic(r) { rows[r].value() } else { f64::NAN })
    }
    fn velocity_residual(&self, s: &Self::State) -> Self::Rows {
        let rates = self.rates(s, &s.u);
        SVector::from_fn(|r, _| rates[r].0)
    }
    fn jacobian(&self, s: &Self::State) -> Self::Jacobian {
        self.0.by_value();
        self.by_q(s)
    }
    fn velocity_jacobian(&self, _: &Self::State) -> Self::VelocityJacobian {
        unreachable!("not asked for here")
    }
    fn velocity_offset(&self, _: &Self::State) -> Self::VelocityOffset {
        unreachable!("not asked for here")
    }
    fn gamma(&self, s: &Self::State) -> Self::Rows {
        let rates = self.rates(s, &s.u);
        SVector::from_fn(|r, _| -rates[r].1)
    }
    fn terms(&self, s: &Self::State, terms: &mut Terms<'_>) {
        let (jacobian, gamma, force, mass) =
            (self.by_q(s), self.gamma(s), self.generalized_force(s), self.0.inertia());
        terms.force.copy_from_slice(force.as_slice());
        terms.gamma.copy_from_slice(gamma.as_slice());
        for i in 0..N {
            (0..N).for_each(|j| terms.mass[i * N + j] = if i == j { mass[i] } else { 0.0 });
            (0..R).for_each(|r| terms.jacobian[r * N + i] = jacobian[(r, i)]);
        }
    }
    fn solve_unrolled(&self, (): &(), _: &Self::State) -> Option<Solved<Self::Vector, Self::Rows>> {
        None
    }
    fn correct_unrolled(&self, (): &(), _: &Self::State, _: &Self::Rows) -> Option<Self::Vector> {
        None
    }
    /// None, as for models that are too large for them.
    fn constraint_derivatives(&self, _: &Self::State, _: &Self::Rows, values: &mut [f64]) {
        values.fill(f64::NAN);
    }
    fn constraint_of(_: TypeId) -> Option<usize> {
        None
    }
}

impl<T: Mechanism<N, R>, const N: usize, const R: usize> Powers for Jets<T, N, R> {
    const POWERS: &'static [Quantity] = &Self::POWER;
    /// −λᵀΦ_t.
    fn powers(&self, s: &Self::State, values: &mut [f64]) {
        let at_rest = self.rates(s, &SVector::zeros());
        let (_, multipliers) = self.kkt(s);
        values[0] = -(0..R).map(|r| multipliers[r] * at_rest[r].0).sum::<f64>();
    }
}

impl<T: Mechanism<N, R>, const N: usize, const R: usize> Outputs for Jets<T, N, R> {
    const OUTPUTS: &'static [Quantity] = &[];
    fn outputs(&self, _: &Self::State, _: &mut [f64]) -> Result<(), SolveError> {
        Ok(())
    }
}

impl<T: Mechanism<N, R>, const N: usize, const R: usize> Events for Jets<T, N, R> {
    const EVENTS: &'static [Quantity] = &[];
    fn events(&self, _: &Self::State, _: &mut [f64]) -> Result<(), SolveError> {
        Ok(())
    }
}
