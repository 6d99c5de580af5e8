//! The implementation of [`Constraints`](crate::model::Constraints) for hand-written models without any.

/// Declares that a hand-written model has no constraints: `unconstrained!(Model, N)` for N coordinates.
#[macro_export]
macro_rules! unconstrained {
    ($model:ty, $n:expr) => {
        impl $crate::model::Constraints for $model {
            type Rows = $crate::model::NoRows;
            type Residual = $crate::model::NoRows;
            type Jacobian = $crate::model::NoMatrix<$n>;
            type VelocityJacobian = $crate::model::NoMatrix<$n>;
            type VelocityOffset = $crate::model::NoRows;
            type Workspace = [::core::primitive::f64; $crate::constrain::workspace_len($n, 0)];
            const CONSTRAINTS: &'static [$crate::model::Constraint] = &[];
            const ROWS: &'static [$crate::model::Quantity] = &[];
            const SOLVER: $crate::model::SolverKind = $crate::model::SolverKind::Unconstrained;
            fn residual(&self, _: &Self::State) -> Self::Residual {
                Self::Residual::default()
            }
            fn velocity_residual(&self, _: &Self::State) -> Self::Rows {
                Self::Rows::default()
            }
            fn jacobian(&self, _: &Self::State) -> Self::Jacobian {
                Self::Jacobian::zeros()
            }
            fn velocity_jacobian(&self, _: &Self::State) -> Self::VelocityJacobian {
                Self::VelocityJacobian::zeros()
            }
            fn velocity_offset(&self, _: &Self::State) -> Self::VelocityOffset {
                Self::VelocityOffset::default()
            }
            fn gamma(&self, _: &Self::State) -> Self::Rows {
                Self::Rows::default()
            }
            // Patterns that are named like a static or a constant of the user's would be no bindings.
            fn terms(&self, __state: &Self::State, __terms: &mut $crate::model::Terms<'_>) {
                // M is symmetric: by rows it is as by columns.
                __terms.mass.copy_from_slice($crate::model::Dynamics::mass_matrix(self, __state).as_slice());
                __terms
                    .force
                    .copy_from_slice($crate::model::Dynamics::generalized_force(self, __state).as_slice());
            }
            fn solve_unrolled(
                &self,
                __constants: &Self::Constants,
                __state: &Self::State,
            ) -> ::core::option::Option<$crate::model::Solved<Self::Vector, Self::Rows>> {
                ::core::option::Option::Some($crate::model::Solved {
                    accelerations: $crate::model::Dynamics::accelerations_with(self, __constants, __state)
                        .ok()?,
                    multipliers: Self::Rows::default(),
                })
            }
            fn correct_unrolled(
                &self,
                _: &Self::Constants,
                _: &Self::State,
                _: &Self::Rows,
            ) -> ::core::option::Option<Self::Vector> {
                ::core::option::Option::Some($crate::model::Vector::zeros())
            }
            fn constraint_derivatives(
                &self,
                _: &Self::State,
                _: &Self::Rows,
                _: &mut [::core::primitive::f64],
            ) {
            }
            fn constraint_of(_: ::core::any::TypeId) -> ::core::option::Option<::core::primitive::usize> {
                ::core::option::Option::None
            }
        }
    };
}
