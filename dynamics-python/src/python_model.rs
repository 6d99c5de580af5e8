//! What a class of Python needs of a model.

use dynamics::model::{Draw, Parameters, Portable, SimulationModel};

/// What a class of Python needs of a model: every derived model that is `Clone` has it.
pub trait PythonModel:
    SimulationModel + Portable + Draw + Parameters + Clone + Send + Sync + 'static
{
}

impl<M: SimulationModel + Portable + Draw + Parameters + Clone + Send + Sync + 'static> PythonModel for M {}
