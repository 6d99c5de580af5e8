//! Errors of searches for equilibria and steady motions.

use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::error::{SolveError, StateError};

use crate::LinearizeError;

/// Why an equilibrium or a steady motion was not found.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EquilibriumError {
    /// The start is not a state of the model, or no position fulfils the constraints.
    #[error(transparent)]
    State(#[from] StateError),
    /// The constraints cannot be followed, or there are no reactions.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// There are no derivatives.
    #[error(transparent)]
    Derivatives(LinearizeError),
    /// Forces depend on an input that has no value.
    #[error("forces depend on inputs, and `{input}` has no value; set it in the start")]
    InputNotSet {
        /// The input.
        input: &'static str,
    },
    /// A force is infinite or not a number where the search went.
    #[error(
        "the force on `{coordinate}` is not finite where the search for balance went; start nearer to the \
         equilibrium"
    )]
    NotFinite {
        /// The coordinate it acts on.
        coordinate: &'static str,
    },
    /// A constraint moves by itself: nothing is at rest.
    #[error(
        "constraint `{row}` moves by {rate:.3e} per second whatever is at rest, so that there is no \
         equilibrium; hold what drives it, or choose coordinates that move along"
    )]
    Moving {
        /// The row.
        row: &'static str,
        /// Φ̇, or A q̇ + b, of the row at the given velocities.
        rate: f64,
    },
    /// Forces change with time: they balance now, but not later.
    #[error(
        "forces change with time (at another time {force:.3e} are left on `{coordinate}`); ask for the \
         balance of one instant with `.equilibria(..).at(t)`, or take the time out of the model"
    )]
    DependsOnTime {
        /// The coordinate whose balance is lost.
        coordinate: &'static str,
        /// The force on it at another time.
        force: f64,
    },
    /// A branch of the model (`if`, min, max, abs, signum) changes exactly at this state, and forces balance
    /// on one side only.
    #[error(
        "a choice of the model (`if`, min, max, abs, signum) changes at this very position, and a force of \
         {force:.3e} is left on `{coordinate}` on one side of it, so that equilibria are not isolated or \
         there is none; leave dry friction out, or round the corner off"
    )]
    Corner {
        /// The coordinate.
        coordinate: &'static str,
        /// The force that is left on the other side.
        force: f64,
    },
    /// Where the search ended, or where stability is asked for, the mass matrix is singular: a pole of polar
    /// coordinates, or gimbal lock. Generalized forces vanish there, whatever the applied forces are.
    #[error(
        "nothing that moves with `{coordinate}` has inertia in this place, or where the search ended: \
         coordinates have a pole there (gimbal lock, r = 0), and no force on it says anything; start \
         elsewhere, or use coordinates that are regular there"
    )]
    Pole {
        /// The coordinate that has no inertia there.
        coordinate: &'static str,
    },
    /// No position near the start is in balance: the residual forces do not become smaller than this.
    #[error(
        "no equilibrium near the start: a force of {force_left:.6e} on `{coordinate}` is left where it is \
         least, and there nothing resists along `{soft}` (a fold, beyond the limit load, or a coordinate \
         that nothing holds); load it less, or start elsewhere"
    )]
    NoEquilibrium {
        /// The coordinate on which most of it acts.
        coordinate: &'static str,
        /// The generalized force on it.
        force_left: f64,
        /// The coordinate that moves most in the direction in which the stiffness vanishes there.
        soft: &'static str,
        /// All coordinates there.
        at: Vec<f64>,
    },
    /// Forces become smaller without end as coordinates grow.
    #[error(
        "the search for balance ran away: `{coordinate}` reached {value:.3e}, and forces still became \
         smaller; start elsewhere, or bound what nothing holds"
    )]
    Diverged {
        /// The coordinate that grew most.
        coordinate: &'static str,
        /// To what.
        value: f64,
    },
    /// Forces are below rounding where the search ended and far around it, but not farther away: they have
    /// faded, like e^(−x).
    #[error(
        "forces along `{coordinate}` fade away below rounding toward {value:.3e}, which is no balance; start \
         nearer to the equilibrium, or bound what nothing holds there"
    )]
    Faded {
        /// The coordinate along which nothing is left.
        coordinate: &'static str,
        /// Its value.
        value: f64,
    },
    /// The iteration did not settle.
    #[error(
        "no equilibrium after {iterations} iterations: a force of {force_left:.3e} is left on \
         `{coordinate}`; forces that jump have none between, else start elsewhere"
    )]
    NoConvergence {
        /// Iterations made.
        iterations: usize,
        /// The coordinate on which the largest force is left.
        coordinate: &'static str,
        /// That force.
        force_left: f64,
    },
    /// The motion accelerates: the given velocities do not belong to cyclic coordinates.
    #[error(
        "the motion is not steady: a little later `{name}` is off balance by {left:.3e}; give velocities to \
         coordinates on which nothing depends, and choose coordinates that turn along"
    )]
    NotSteady {
        /// The coordinate, or the row of a constraint.
        name: &'static str,
        /// The force that is left on it a little later on the motion, or what the row is missed by.
        left: f64,
    },
    /// A family of models is not defined near a value of its parameter: forces are not finite there, on
    /// either side.
    #[error(
        "the family of models has no forces that are numbers beside {parameter} of its parameter; end its \
         range before that"
    )]
    NotDefined {
        /// The value.
        parameter: f64,
    },
    /// A coordinate of random starts has no range.
    #[error(
        "random starts need a range for `{coordinate}`; give one with `.within(\"{coordinate}\", [from, \
         to])`, or one for all with `.spread(..)`"
    )]
    NoRange {
        /// The coordinate.
        coordinate: &'static str,
    },
    /// A range is empty or not finite.
    #[error(
        "the range of `{name}`, from {from} to {to}, is empty or not finite; give finite ends in \
         order",
        from = .range[0],
        to = .range[1]
    )]
    Range {
        /// The coordinate, as it was given.
        name: String,
        /// From where to where.
        range: [f64; 2],
    },
    /// A name is not that of a coordinate.
    #[error(
        "`{name}` is not a coordinate; give a name of the model, arrays whole (`theta`) or by element \
         (`theta[0]`)"
    )]
    UnknownCoordinate {
        /// The name.
        name: String,
    },
}

impl EquilibriumError {
    /// Whether the reason is that forces or constraints change with time.
    pub(crate) fn is_of_time(&self) -> bool {
        matches!(self, Self::DependsOnTime { .. } | Self::Moving { .. } | Self::NotSteady { .. })
    }
}

dynamics_runtime::sentence_for_debugging!(EquilibriumError);

impl From<LinearizeError> for EquilibriumError {
    fn from(error: LinearizeError) -> Self {
        match error {
            LinearizeError::State(error) => Self::State(error),
            LinearizeError::Solve(error) => Self::Solve(error),
            error => Self::Derivatives(error),
        }
    }
}
