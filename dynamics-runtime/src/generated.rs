//! Functions and traits that generated code calls.

mod constants;
pub mod table;

#[cfg(feature = "alloc")]
pub use alloc::vec::Vec;

pub use constants::{
    SameType, expect, expect_near, expect_std, expect_type, the_name_vec2_is_the_librarys_choose_another,
    the_name_vec3_is_the_librarys_choose_another,
};
use nalgebra::{ArrayStorage, SMatrix, SVector};

use crate::constrain::{assemble, check_sides, check_start, move_by_speeds, set_sides, solve_once};
use crate::error::{SingularMassMatrix, SolveError, StateError};
use crate::expr::Expr;
use crate::lanes::Lanes;
pub use crate::linalg::PIVOT_TOLERANCE;
use crate::model::{ActiveSet, Constraints, Linearize, Model, Quantity, Solved, StateJacobian, Vector};
use crate::reaction::{self, Reaction, Reactions};

/// Implemented once per `#[dynamics] impl`. A second block for the same struct, in another module, is then a
/// compile error whose text has the name of this trait.
pub trait OnlyOneDynamicsImplPerModel {}

/// The functions of the model's impl block that the types derived from the struct need. They use this trait
/// only, at the struct's name, so that a missing block is one compile error.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no equations of motion; put `#[dynamics]` on the `impl` block with its energies",
    label = "no `#[dynamics] impl` for this"
)]
pub trait Complete: Model {
    /// One number per row: [`Constraints::Rows`].
    type Multipliers: Vector;
    /// λ of the constraint with this function.
    fn reaction<F: 'static, T: Reaction>(reactions: &Reactions<Self::Multipliers>, function: F) -> T;
    /// The side to which the switched constraint with this function was left.
    fn slip<F: 'static>(reactions: &Reactions<Self::Multipliers>, function: F) -> Expr;
    /// Index among the switched constraints of the one with this name.
    ///
    /// # Errors
    /// Where no switched constraint has the name.
    fn switched(name: &'static str) -> Result<usize, StateError>;
    /// Releases to the side of the velocity what was released without a side, and checks the state.
    ///
    /// # Errors
    /// Where the state is not on the constraints or a side contradicts the velocity.
    fn built(&self, state: Self::State, sided: u32) -> Result<Self::State, StateError>;
    /// The state with what was not given solved for.
    ///
    /// # Errors
    /// Where the constraints cannot be fulfilled.
    fn assembled(
        &self,
        state: Self::State,
        given: [&[bool]; 2],
        sided: u32,
    ) -> Result<Self::State, StateError>;
    /// The state with velocities of these generalized speeds, its positions solved for before where it is to
    /// be `assembled`.
    ///
    /// # Errors
    /// Where rates are given beside the speeds, where these do not determine the velocities, and as for the
    /// others.
    fn moved(
        &self,
        state: Self::State,
        given: [&[bool]; 2],
        speeds: &[f64],
        assembled: bool,
        sided: u32,
    ) -> Result<Self::State, StateError>;
}

#[diagnostic::do_not_recommend]
impl<M: Constraints> Complete for M {
    type Multipliers = M::Rows;

    fn reaction<F: 'static, T: Reaction>(reactions: &Reactions<M::Rows>, function: F) -> T {
        reactions.of::<M, F, T>(function)
    }

    fn slip<F: 'static>(reactions: &Reactions<M::Rows>, function: F) -> Expr {
        reactions.slip::<M, F>(function)
    }

    fn switched(name: &'static str) -> Result<usize, StateError> {
        reaction::switched::<M>(name)
    }

    fn built(&self, mut state: M::State, sided: u32) -> Result<M::State, StateError> {
        set_sides(self, &mut state, sided);
        check_start(self, &state)?;
        Ok(state)
    }

    fn assembled(&self, state: M::State, [q, u]: [&[bool]; 2], sided: u32) -> Result<M::State, StateError> {
        let mut state = assemble(self, state, q, u)?;
        set_sides(self, &mut state, sided);
        check_sides(self, &state)?;
        Ok(state)
    }

    fn moved(
        &self,
        state: M::State,
        [q, u]: [&[bool]; 2],
        speeds: &[f64],
        assembled: bool,
        sided: u32,
    ) -> Result<M::State, StateError> {
        if let Some(rate) = M::COORDINATES.iter().zip(u).find(|(_, given)| **given) {
            return Err(StateError::RateBesideSpeeds { coordinate: rate.0.name });
        }
        let mut state = if assembled { assemble(self, state, q, u)? } else { state };
        move_by_speeds(self, &mut state, speeds)?;
        set_sides(self, &mut state, sided);
        check_start(self, &state)?;
        Ok(state)
    }
}

/// A vector of its elements.
#[inline(always)]
#[must_use]
pub fn vector<const N: usize>(elements: [f64; N]) -> SVector<f64, N> {
    SVector::from_array_storage(ArrayStorage([elements]))
}

/// A matrix of its columns.
#[inline(always)]
#[must_use]
pub fn matrix<const R: usize, const C: usize>(columns: [[f64; R]; C]) -> SMatrix<f64, R, C> {
    SMatrix::from_array_storage(ArrayStorage(columns))
}

/// Whether a pivot vanishes relative to its diagonal element, or, if `POSITIVE`, is negative.
///
/// A pivot that is NaN is neither: it comes from a state or force that is NaN, which a run reports.
#[inline(always)]
fn fails<const POSITIVE: bool>(&[pivot, diagonal]: &[f64; 2]) -> bool {
    let size = if POSITIVE { pivot } else { pivot.abs() };
    size <= PIVOT_TOLERANCE * diagonal.abs()
}

/// Whether some pivot Dᵢ fails against its diagonal element Mᵢᵢ; `pivots` holds the pairs. `POSITIVE`: M
/// comes from a kinetic energy, so that a negative pivot is negative inertia; a `#[lagrangian]` may be
/// indefinite.
#[inline(always)]
#[must_use]
pub fn singular<const POSITIVE: bool, const N: usize>(pivots: &[[f64; 2]; N]) -> bool {
    // Without branches: the common case is that none fails.
    pivots.iter().fold(false, |any, pair| any | fails::<POSITIVE>(pair))
}

/// Whether some pivot fails in some lane, or is not a number.
#[inline(always)]
#[must_use]
pub fn singular_in_lanes<const POSITIVE: bool, const N: usize, L: Lanes>(pivots: &[[L; 2]; N]) -> bool {
    // A loop: closures would be compiled without the instructions of the lanes.
    let mut any = false;
    for &[pivot, diagonal] in pivots {
        any |= !match POSITIVE {
            true => pivot.exceed_signed(PIVOT_TOLERANCE, diagonal),
            false => pivot.exceed(PIVOT_TOLERANCE, diagonal),
        };
    }
    any
}

/// The error that names the first failing pivot; `coordinates` says whose they are.
#[cold]
#[inline(never)]
#[must_use]
pub fn name_singular<const POSITIVE: bool>(
    pivots: &[[f64; 2]],
    coordinates: &[usize],
    names: &[Quantity],
) -> SingularMassMatrix {
    let at = pivots.iter().position(fails::<POSITIVE>).unwrap_or(0);
    let coordinate = coordinates.get(at).copied().unwrap_or(0);
    SingularMassMatrix {
        coordinate,
        name: names.get(coordinate).map_or("", |quantity| quantity.name),
        pivot: pivots.get(at).map_or(f64::NAN, |[pivot, _]| *pivot),
        negative: POSITIVE
            && pivots.get(at).is_some_and(|[pivot, diagonal]| *pivot < -PIVOT_TOLERANCE * diagonal.abs()),
    }
}

/// q̈ and λ of a model with constraints, all NaN where they do not exist: for functions that cannot fail.
#[must_use]
pub fn solved_or_nan<M: Constraints>(model: &M, state: &M::State) -> Solved<M::Vector, M::Rows> {
    let solved = model
        .constants()
        .map_err(SolveError::from)
        .and_then(|constants| solve_once(model, &constants, state));
    if let Ok(solved) = solved {
        return Solved { accelerations: solved.accelerations, multipliers: solved.multipliers };
    }
    let (mut accelerations, mut multipliers) = (M::Vector::zeros(), M::Rows::zeros());
    accelerations.as_mut_slice().fill(f64::NAN);
    multipliers.as_mut_slice().fill(f64::NAN);
    Solved { accelerations, multipliers }
}

/// ∂q̈/∂q and ∂q̈/∂q̇ by rows, from the derivatives that a model has; false where they do not exist at a
/// state.
#[inline]
pub fn acceleration_derivatives<M: Linearize>(
    model: &M,
    state: &M::State,
    by_q: &mut [f64],
    by_u: &mut [f64],
) -> bool {
    let n = M::Vector::LEN;
    let Ok(StateJacobian { by_q: of_q, by_u: of_u, .. }) = model.state_jacobian(state) else { return false };
    for i in 0..n {
        for j in 0..n {
            by_q[i * n + j] = of_q[(i, j)];
            by_u[i * n + j] = of_u[(i, j)];
        }
    }
    true
}

/// ∂q̈/∂parameters by rows, from the derivatives that a model has; false where they do not exist at a state.
#[inline]
pub fn acceleration_by_parameters<M: Linearize>(model: &M, state: &M::State, values: &mut [f64]) -> bool {
    let (n, p) = (M::Vector::LEN, M::PARAMETERS.len());
    let Ok(by) = model.parameter_jacobian(state) else { return false };
    for i in 0..n {
        for j in 0..p {
            values[i * p + j] = by[(i, j)];
        }
    }
    true
}

/// The error of derivatives whose elimination meets a pivot that is too small: that of a coordinate, or of a
/// constraint row.
#[cold]
#[inline(never)]
#[must_use]
pub fn no_derivatives<M: Constraints>(coordinate: bool, index: usize, pivot: f64) -> SolveError {
    let name = |names: &'static [Quantity]| names.get(index).map_or("", |quantity| quantity.name);
    if coordinate {
        let name = name(M::COORDINATES);
        return SingularMassMatrix { coordinate: index, name, pivot, negative: false }.into();
    }
    SolveError::DependentRow { row: name(M::ROWS), pivot }
}

/// The error of derivatives, which are generated for all constraints, while one is released.
#[inline]
#[must_use]
pub fn released<M: Constraints>(active_set: ActiveSet) -> Option<SolveError> {
    let is_released = |index: &usize| !active_set.holds(*index);
    let found = M::CONSTRAINTS.iter().find(|c| c.switched.as_ref().is_some_and(is_released))?;
    Some(SolveError::Released { constraint: found.name })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_inertia_is_an_error_of_a_kinetic_energy_alone() {
        let names = [Quantity::without_unit("x")];
        let pivots = [[-1.0, -1.0]];
        assert!(singular::<true, 1>(&pivots) && !singular::<false, 1>(&pivots));
        let error = name_singular::<true>(&pivots, &[0], &names);
        let message = error.to_string();
        assert!(
            error.negative && message.contains("negative inertia") && message.contains("; give"),
            "{message}"
        );
        assert!(!name_singular::<true>(&[[1e-15, 1.0]], &[0], &names).negative);
        assert!(!singular::<true, 1>(&[[f64::NAN, 1.0]]));
    }

    #[test]
    fn a_vanishing_pivot_is_found_and_named() {
        let names = ["x", "y", "z"].map(Quantity::without_unit);
        assert!(!singular::<true, 2>(&[[1.0, 2.0], [1e-12, 1.0]]));
        let pivots = [[1.0, 2.0], [-1e-14, 1.0]];
        assert!(singular::<false, 2>(&pivots));
        let error = name_singular::<false>(&pivots, &[0, 2], &names);
        assert_eq!((error.coordinate, error.name, error.pivot), (2, "z", -1e-14));
    }

    #[test]
    fn no_inertia_at_all_is_singular_and_nan_is_not() {
        assert!(singular::<true, 1>(&[[0.0, 0.0]]));
        assert!(!singular::<false, 1>(&[[f64::NAN, 1.0]]));
    }

    #[test]
    fn matrices_are_given_by_columns() {
        let m = matrix([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]);
        assert_eq!((m[(0, 0)], m[(1, 0)], m[(0, 2)]), (1.0, 2.0, 5.0));
        assert_eq!(vector([1.0, 2.0])[1], 2.0);
    }
}
