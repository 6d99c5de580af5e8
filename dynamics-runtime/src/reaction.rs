//! Reactions and active set of constraints, as the functions of a model read them: `q.reaction(Self::rod)`,
//! `q.slip(Self::stick)`.
//!
//! A constraint is identified by its function. Every function has its own type, whose [`TypeId`] finds the
//! constraint ([`Constraints::constraint_of`]). The return type of the function gives the shape of the
//! reaction.

use core::any::TypeId;

use crate::error::StateError;
use crate::expr::Expr;
use crate::model::{ActiveSet, Constraint, Constraints, Vector};
use crate::vector::{Vec2, Vec3};

/// What a constraint's function returns: a scalar, a vector, an array of them. Its reaction λ has the same
/// shape.
pub trait Reaction: Sized {
    /// Number of scalars.
    const ROWS: usize;
    /// Puts scalars, which come in order, in this shape.
    fn collect(next: &mut dyn FnMut() -> Expr) -> Self;
}

impl Reaction for Expr {
    const ROWS: usize = 1;
    fn collect(next: &mut dyn FnMut() -> Expr) -> Self {
        next()
    }
}

impl Reaction for Vec2<Expr> {
    const ROWS: usize = 2;
    fn collect(next: &mut dyn FnMut() -> Expr) -> Self {
        // Fields are evaluated in the order in which they are written.
        Self { x: next(), y: next() }
    }
}

impl Reaction for Vec3<Expr> {
    const ROWS: usize = 3;
    fn collect(next: &mut dyn FnMut() -> Expr) -> Self {
        Self { x: next(), y: next(), z: next() }
    }
}

impl<T: Reaction, const N: usize> Reaction for [T; N] {
    const ROWS: usize = N * T::ROWS;
    fn collect(next: &mut dyn FnMut() -> Expr) -> Self {
        core::array::from_fn(|_| T::collect(next))
    }
}

/// Multipliers and active set at one instant, which a model's coordinates contain besides their jets. `R`:
/// one number per row.
#[derive(Clone, Copy, Debug)]
pub struct Reactions<R> {
    multipliers: R,
    active_set: ActiveSet,
}

impl<R: Vector> Reactions<R> {
    /// From multipliers in the order of the rows; those that are left out are NaN.
    #[inline]
    #[must_use]
    pub fn new(multipliers: &[f64], active_set: ActiveSet) -> Self {
        let mut all = R::zeros();
        for (i, to) in all.as_mut_slice().iter_mut().enumerate() {
            *to = multipliers.get(i).copied().unwrap_or(f64::NAN);
        }
        Self { multipliers: all, active_set }
    }

    /// λ of the constraint with this function; its rate is not known. NaN where the function is no
    /// constraint.
    #[must_use]
    pub fn of<M, F, T>(&self, _function: F) -> T
    where
        M: Constraints<Rows = R>,
        F: 'static,
        T: Reaction,
    {
        let all = self.multipliers.as_slice();
        let rows = constraint::<M, F>()
            .filter(|c| c.rows == T::ROWS)
            .and_then(|c| all.get(c.first..c.first + c.rows))
            .unwrap_or(&[]);
        let mut rows = rows.iter();
        T::collect(&mut || Expr::input(rows.next().copied().unwrap_or(f64::NAN)))
    }

    /// 0 while the switched constraint with this function holds, else ±1: the side to which it was left. NaN
    /// where the function is no switched constraint.
    #[must_use]
    pub fn slip<M, F>(&self, _function: F) -> Expr
    where
        M: Constraints<Rows = R>,
        F: 'static,
    {
        let index = constraint::<M, F>().and_then(|c| c.switched);
        Expr::constant(index.map_or(f64::NAN, |index| self.active_set.side(index)))
    }
}

/// The constraint whose function has the type `F`.
fn constraint<M: Constraints, F: 'static>() -> Option<&'static Constraint> {
    M::CONSTRAINTS.get(M::constraint_of(TypeId::of::<F>())?)
}

/// The type of a function, given by its name.
#[inline(always)]
#[must_use]
pub fn type_of<F: 'static>(_function: &F) -> TypeId {
    TypeId::of::<F>()
}

/// Index among the switched constraints of the one with this name.
///
/// # Errors
/// Where no switched constraint has the name.
pub fn switched<M: Constraints>(name: &'static str) -> Result<usize, StateError> {
    let found = M::CONSTRAINTS.iter().find(|c| c.name == name).and_then(|c| c.switched);
    found.ok_or(StateError::NotSwitched { name, constraints: M::CONSTRAINTS })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scalars_come_in_the_order_of_the_rows() {
        let mut k = 0.0;
        let mut next = || {
            k += 1.0;
            Expr::constant(k)
        };
        let [a, b]: [Vec3<Expr>; 2] = Reaction::collect(&mut next);
        assert_eq!([a.x, a.y, a.z, b.x, b.y, b.z].map(Expr::value), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(<[Vec3<Expr>; 2]>::ROWS, 6);
        let plane: Vec2<Expr> = Reaction::collect(&mut next);
        assert_eq!([plane.x, plane.y].map(Expr::value), [7.0, 8.0]);
    }

    #[test]
    fn what_is_not_given_is_not_a_number() {
        let all = Reactions::<nalgebra::SVector<f64, 3>>::new(&[1.0, 2.0], ActiveSet::ALL_HOLD);
        assert_eq!(all.multipliers.as_slice()[..2], [1.0, 2.0]);
        assert!(all.multipliers.as_slice()[2].is_nan());
    }
}
