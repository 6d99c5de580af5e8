//! Multipliers by the name of their constraint, in the shape of what its function returns.

use core::any::TypeId;

use dynamics_runtime::{Expr, Vec2, Vec3};

use crate::model::{FamilyModel, Multipliers};

impl Multipliers {
    /// Of rows whose fields end at `ends`.
    #[must_use]
    pub fn new(values: Vec<f64>, ends: Vec<usize>) -> Self {
        Self { values, ends }
    }

    /// λ of the constraint with this name, component by component.
    pub(crate) fn of_name<M: FamilyModel>(&self, name: &str) -> Vec<f64> {
        let fields = M::ROWS.iter().enumerate().filter(|(_, declared)| declared.name == name);
        fields.flat_map(|(field, _)| self.field(field).iter().copied()).collect()
    }

    /// λ of a field of rows; none where no solution is at hand.
    fn field(&self, field: usize) -> &[f64] {
        let start = if field == 0 { 0 } else { self.ends.get(field - 1).copied().unwrap_or(0) };
        let end = self.ends.get(field).copied().unwrap_or(0);
        self.values.get(start..end).unwrap_or(&[])
    }

    /// λ of the constraint with the function of type `F`, in the shape that it returns. NaN where the
    /// function is no constraint or no solution is at hand; a list is empty then.
    #[must_use]
    pub fn of<M: FamilyModel, F: 'static, T: FamilyReaction>(&self) -> T {
        let constraint = M::constraint_of(TypeId::of::<F>());
        let own = M::ROWS.iter().enumerate().filter(|(_, field)| Some(field.constraint) == constraint);
        let fields: Vec<&[f64]> = own.map(|(field, _)| self.field(field)).collect();
        T::of(&fields, 0)
    }
}

/// What a constraint returns: a scalar, a vector, an array or a list of them.
pub trait FamilyReaction: Sized {
    /// How many scalars a round has.
    const COMPONENTS: usize;
    /// The values of a round; `fields` has those of all rounds, component by component.
    fn of(fields: &[&[f64]], round: usize) -> Self;
}

fn scalar(fields: &[&[f64]], component: usize, round: usize) -> Expr {
    let value = fields.get(component).and_then(|values| values.get(round));
    Expr::input(value.copied().unwrap_or(f64::NAN))
}

impl FamilyReaction for Expr {
    const COMPONENTS: usize = 1;
    fn of(fields: &[&[f64]], round: usize) -> Self {
        scalar(fields, 0, round)
    }
}

impl FamilyReaction for Vec2 {
    const COMPONENTS: usize = 2;
    fn of(fields: &[&[f64]], round: usize) -> Self {
        Self { x: scalar(fields, 0, round), y: scalar(fields, 1, round) }
    }
}

impl FamilyReaction for Vec3 {
    const COMPONENTS: usize = 3;
    fn of(fields: &[&[f64]], round: usize) -> Self {
        let [x, y, z] = [0, 1, 2].map(|component| scalar(fields, component, round));
        Self { x, y, z }
    }
}

impl<T: FamilyReaction, const N: usize> FamilyReaction for [T; N] {
    const COMPONENTS: usize = N * T::COMPONENTS;
    fn of(fields: &[&[f64]], round: usize) -> Self {
        core::array::from_fn(|k| T::of(fields.get(k * T::COMPONENTS..).unwrap_or(&[]), round))
    }
}

impl<T: FamilyReaction> FamilyReaction for Vec<T> {
    const COMPONENTS: usize = T::COMPONENTS;
    fn of(fields: &[&[f64]], _: usize) -> Self {
        let rounds = fields.first().map_or(0, |values| values.len());
        (0..rounds).map(|round| T::of(fields, round)).collect()
    }
}
