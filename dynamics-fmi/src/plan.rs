//! What can be written, and what not: everything is refused here, before a file exists.

use dynamics_export::ExportC as _;
use dynamics_runtime::model::{ModelState, PrintedInC, SimulationModel, Vector};
use dynamics_runtime::simulate::Simulate as _;

use crate::dependencies::Dependencies;
use crate::error::FmuError;
use crate::fmu::Fmu;
use crate::variables::Variables;

/// What is written.
pub(crate) struct Plan {
    /// `name.h` and `name.c`: names and texts.
    pub(crate) programs: Vec<(String, String)>,
    pub(crate) variables: Variables,
    pub(crate) dependencies: Dependencies,
    pub(crate) parameters: Vec<f64>,
    /// For each state a size below which its errors are absolute.
    pub(crate) nominals: Vec<f64>,
    /// 0 for switched constraints that hold, else the side to which they are released.
    pub(crate) modes: Vec<f64>,
    /// What tells this unit from others: a hash of all that is written.
    pub(crate) identity: u64,
    /// The same as a name.
    pub(crate) token: String,
}

/// Checks the model and all that was chosen for it.
pub(crate) fn plan<M: SimulationModel + PrintedInC>(fmu: &Fmu<'_, M>) -> Result<Plan, FmuError> {
    let range = "between 1e-14 and 0.1";
    number("the tolerance", fmu.tolerance, (1e-14..=0.1).contains(&fmu.tolerance), range)?;
    let is_positive = fmu.duration > 0.0 && fmu.duration.is_finite();
    number("the duration of the default experiment", fmu.duration, is_positive, "a positive number")?;
    let programs = fmu.model.in_c().without_example().files()?;
    begins(fmu)?;
    // A value that the model does not tell was refused with the parameter's name by the simulation's checks.
    let parameter = |i| fmu.model.parameter(i).unwrap_or(f64::NAN);
    let parameters: Vec<f64> = (0..M::PARAMETERS.len()).map(parameter).collect();
    let switched = M::CONSTRAINTS.iter().filter(|c| c.switched.is_some()).count();
    let modes: Vec<f64> = (0..switched).map(|i| fmu.start.active_set().side(i)).collect();
    let nominals = nominals(fmu)?;
    let variables = Variables::of::<M>(&parameters, &fmu.start, &nominals);
    let mut text: String = programs.iter().map(|(_, text)| text.as_str()).collect();
    let chosen = (fmu.method, fmu.tolerance, fmu.start.t(), &modes);
    text.push_str(&format!("{chosen:?}{:?}", variables.all));
    let identity = hash(&text);
    let token = format!("{{{}-{identity:016x}}}", M::C.name);
    let dependencies = Dependencies::of::<M>(&programs, variables.all.len());
    Ok(Plan { programs, variables, dependencies, parameters, nominals, modes, identity, token })
}

/// A hash by Fowler, Noll and Vo (FNV-1a, 64 bits): the same on all machines.
fn hash(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

fn number(option: &'static str, value: f64, admissible: bool, range: &'static str) -> Result<(), FmuError> {
    if admissible { Ok(()) } else { Err(FmuError::Number { option, value, range }) }
}

/// Nominal values of coordinates and rates, one for all of a unit: the absolute tolerances that a simulation
/// finds by its pilot run, in parts of the tolerance. They are at most 1.
fn nominals<M: SimulationModel + PrintedInC>(fmu: &Fmu<'_, M>) -> Result<Vec<f64>, FmuError> {
    let end = fmu.start.t() + fmu.duration;
    let simulation = fmu.model.simulate(fmu.start).until(end).tolerance(fmu.tolerance);
    let found = simulation.tolerances_by_unit();
    let found = found.map_err(|error| FmuError::Start { source: Box::new(error.kind) })?;
    Ok(found.into_iter().map(|absolute| absolute / fmu.tolerance).collect())
}

/// Refuses a start at which no simulation, or no program in C, could begin.
fn begins<M: SimulationModel + PrintedInC>(fmu: &Fmu<'_, M>) -> Result<(), FmuError> {
    let start = &fmu.start;
    for (quantity, &value) in M::INPUTS.iter().zip(start.inputs().as_slice()) {
        if !value.is_finite() {
            return Err(FmuError::Input { name: quantity.name, value });
        }
    }
    let begun = fmu.model.simulate(*start).check_beginning();
    begun.map_err(|error| FmuError::Start { source: Box::new(error.kind) })?;
    if !M::ROWS.is_empty() {
        let constants = fmu.model.constants().ok();
        if constants.and_then(|k| fmu.model.solve_unrolled(&k, start)).is_none() {
            let remedy = match start.active_set().all_hold() {
                true => "begin elsewhere",
                false => "engage its constraints, or begin elsewhere",
            };
            return Err(FmuError::Unsolved { remedy });
        }
    }
    Ok(())
}
