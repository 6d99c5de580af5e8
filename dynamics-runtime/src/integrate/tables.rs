//! Coefficients of methods as slices: for states whose length is known when the program runs.

use crate::integrate::explicit::{dop853_table as dop853, dormand_prince5 as dp5};
use crate::integrate::geometric::composition;
use crate::integrate::{ControllerSettings, Dop853, DormandPrince5, Scheme};

/// A row of a tableau: (stage, coefficient).
pub type SparseRow = &'static [(usize, f64)];

/// An explicit method with an error estimate.
#[derive(Clone, Copy, Debug)]
pub struct Embedded {
    /// Nodes of the stages.
    pub nodes: &'static [f64],
    /// The rows of all stages, the first empty. Where the method reuses its last stage, that row is the
    /// result's.
    pub rows: &'static [SparseRow],
    /// Weights of the result.
    pub weights: SparseRow,
    /// Weights of the error estimate.
    pub error: SparseRow,
    /// Weights of the embedded result of order 3 that DOP853 has besides.
    pub third_order: Option<SparseRow>,
    /// Whether the last stage is the first of the next step.
    pub first_same_as_last: bool,
    /// Order of the error estimate.
    pub error_order: u32,
    /// Step control suited to the method.
    pub control: ControllerSettings,
}

/// For constants of methods, which do not depend on the size.
type One = nalgebra::SVector<f64, 1>;

const fn control<S: Scheme<One>>() -> ControllerSettings {
    match S::CONTROL {
        Some(settings) => settings,
        None => panic!("the method has an error estimate"),
    }
}

/// Dormand and Prince's method of order 5(4).
pub const DORMAND_PRINCE5: Embedded = Embedded {
    nodes: &dp5::C,
    rows: &[&[], &dp5::A2, &dp5::A3, &dp5::A4, &dp5::A5, &dp5::A6, &dp5::B],
    weights: &dp5::B,
    error: &dp5::E,
    third_order: None,
    first_same_as_last: true,
    error_order: <DormandPrince5<One> as Scheme<One>>::ERROR_ORDER,
    control: control::<DormandPrince5<One>>(),
};

/// Dormand and Prince's method of order 8(5,3).
pub const DOP853: Embedded = Embedded {
    nodes: &dop853::C,
    rows: &[
        &[],
        &dop853::A1,
        &dop853::A2,
        &dop853::A3,
        &dop853::A4,
        &dop853::A5,
        &dop853::A6,
        &dop853::A7,
        &dop853::A8,
        &dop853::A9,
        &dop853::A10,
        &dop853::A11,
    ],
    weights: &dop853::B,
    error: &dop853::E5,
    third_order: Some(&dop853::B3),
    first_same_as_last: false,
    error_order: <Dop853<One> as Scheme<One>>::ERROR_ORDER,
    control: control::<Dop853<One>>(),
};

/// The shares of a step that a composition of 5, 9 or 17 Verlet steps makes: the first half, and the middle
/// one.
#[must_use]
pub const fn composition(steps: usize) -> &'static [f64] {
    composition::half(steps)
}
