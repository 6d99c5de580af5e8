//! The variables of a unit, with their names. Value references count them; `c/fmu.h` has the same groups in
//! the same order.

use std::collections::BTreeSet;

use dynamics_runtime::model::names::{self, Column};
use dynamics_runtime::model::{Described, ModelState, PrintedInC, Quantity, SimulationModel, Vector};

/// What a variable is to an importer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Role {
    Time,
    /// A continuous state, with its value at the start and its nominal value.
    State(f64, f64),
    /// The derivative of the state with this value reference.
    Derivative(usize),
    /// With its value.
    Parameter(f64),
    /// With its value at the start.
    Input(f64),
    Output,
    /// A value whose changes of sign matter.
    Indicator,
}

/// A variable. Its value reference is its place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) about: String,
    pub(crate) role: Role,
}

/// All variables.
#[derive(Clone, Debug)]
pub(crate) struct Variables {
    pub(crate) all: Vec<Variable>,
    /// Whether all names follow the structured naming convention of the standard.
    pub(crate) is_structured: bool,
}

impl Variables {
    /// Of a model with these parameters, at a start.
    pub(crate) fn of<M: SimulationModel + PrintedInC>(
        parameters: &[f64],
        start: &M::State,
        nominals: &[f64],
    ) -> Self {
        let n = M::COORDINATES.len();
        let mut list = List::default();
        list.add(names_time::<M>(), Role::Time, "the independent variable");
        let states = start.q().as_slice().iter().chain(start.u().as_slice());
        let states = states.zip(nominals);
        for (column, (&value, &nominal)) in
            names::coordinates::<M>().chain(names::velocities::<M>()).zip(states)
        {
            list.add(column, Role::State(value, nominal), "");
        }
        let derived = names::velocities::<M>().chain(names::accelerations::<M>());
        for (i, Column { unit, .. }) in derived.enumerate() {
            let name = format!("der({})", list.all[1 + i].name);
            list.add(Column { name, unit }, Role::Derivative(1 + i), "");
        }
        debug_assert_eq!(list.all.len(), 1 + 4 * n, "states and derivatives");
        for (quantity, &value) in M::PARAMETERS.iter().zip(parameters) {
            list.quantity::<M>(quantity, Role::Parameter(value), "parameter");
        }
        for (quantity, &value) in M::INPUTS.iter().zip(start.inputs().as_slice()) {
            list.quantity::<M>(quantity, Role::Input(value), "input");
        }
        for (column, row) in names::multipliers::<M>().zip(M::ROWS) {
            let name = format!("lambda.{}", structured(row.name));
            let about = "multiplier of the constraint: its reaction along this row";
            list.add(Column { name, ..column }, Role::Output, about);
        }
        let energies = [
            ("energy", "energy function"),
            ("kinetic_energy", "kinetic energy"),
            ("potential_energy", "potential energy"),
        ];
        for (name, about) in energies.into_iter().take(if M::HAS_ENERGIES { 3 } else { 1 }) {
            let column = Column { name: name.to_owned(), unit: names::energy_unit::<M>().to_owned() };
            list.qualified(column, Role::Output, about, "total");
        }
        for quantity in M::OUTPUTS {
            list.quantity::<M>(quantity, Role::Output, "output");
        }
        for quantity in M::EVENTS {
            list.quantity::<M>(quantity, Role::Indicator, "event");
        }
        for (i, function) in M::C.kink_functions.iter().enumerate() {
            let about = match function.and_then(|function| M::FUNCTIONS.get(function)) {
                Some(name) => format!("where the argument of {name} passes a knot"),
                None => "where the accelerations are not smooth".to_owned(),
            };
            let column = Column { name: format!("kink[{i}]"), unit: String::new() };
            list.qualified(column, Role::Indicator, &about, "event");
        }
        let is_structured = list.all.iter().all(|variable| is_structured(&variable.name));
        Self { all: list.all, is_structured }
    }

    /// Value references of those with a role.
    pub(crate) fn with(&self, wanted: impl Fn(Role) -> bool) -> Vec<usize> {
        (0..self.all.len()).filter(|&i| wanted(self.all[i].role)).collect()
    }
}

fn names_time<M: SimulationModel>() -> Column {
    Column { name: "time".to_owned(), unit: names::time_unit::<M>().to_owned() }
}

/// Variables as they are added, each with a name of its own.
#[derive(Default)]
struct List {
    all: Vec<Variable>,
    taken: BTreeSet<String>,
}

impl List {
    fn add(&mut self, column: Column, role: Role, about: &str) {
        self.qualified(column, role, about, "model");
    }

    /// A variable whose name gets a prefix where another variable has it: a parameter may be called as a
    /// coordinate.
    fn qualified(&mut self, Column { name, unit }: Column, role: Role, about: &str, prefix: &str) {
        let mut name = structured(&name);
        while self.taken.contains(&name) {
            name = format!("{prefix}.{name}");
        }
        self.taken.insert(name.clone());
        self.all.push(Variable { name, unit, about: about.to_owned(), role });
    }

    fn quantity<M: Described>(&mut self, quantity: &Quantity, role: Role, prefix: &str) {
        let field = quantity.name.split(['[', '.']).next().unwrap_or(quantity.name);
        let about =
            M::FIELD_DOCUMENTATION.iter().find(|(name, _)| *name == field).map_or("", |(_, text)| text);
        let column = Column { name: quantity.name.to_owned(), unit: quantity.unit.to_owned() };
        self.qualified(column, role, about, prefix);
    }
}

/// A name with the indices of matrices as the standard has them: `r[0][1]` is `r[0,1]`.
fn structured(name: &str) -> String {
    name.replace("][", ",")
}

/// Whether a name follows the structured naming convention: `a.b[1,2].c`, and `der(a)`.
fn is_structured(name: &str) -> bool {
    let name = name.strip_prefix("der(").and_then(|rest| rest.strip_suffix(')')).unwrap_or(name);
    let is_word = |word: &str| {
        let is_letter = |c: char| c == '_' || c.is_ascii_alphabetic();
        word.starts_with(is_letter) && word.chars().all(|c| is_letter(c) || c.is_ascii_digit())
    };
    let is_number = |text: &str| !text.is_empty() && text.chars().all(|c| c.is_ascii_digit());
    name.split('.').all(|part| match part.split_once('[') {
        None => is_word(part),
        Some((word, indices)) => {
            is_word(word) && indices.strip_suffix(']').is_some_and(|all| all.split(',').all(is_number))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::{is_structured, structured};

    #[test]
    fn names_follow_the_convention_where_they_can() {
        for name in ["theta", "theta_rate[3]", "der(axis.x)", "r[0,1]", "lambda.closure[2].x", "_a1"] {
            assert!(is_structured(name), "{name}");
        }
        for name in ["θ", "lambda[closure.x]", "a b", "1a", "a[", "a[]", "a.", "der(a", ""] {
            assert!(!is_structured(name), "{name}");
        }
        assert_eq!(structured("r[0][1]"), "r[0,1]");
    }
}
