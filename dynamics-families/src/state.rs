//! States on the heap, and how they are given by name.

use crate::constraints::place_on_constraints;
use crate::failure::FamilyErrorKind;
use crate::mass::coordinate_name;
use crate::model::{FamilyModel, FamilyState, SizeError, Sizes};

/// What every state of a model with families holds: the generated type with the model's names wraps it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    /// Time.
    pub t: f64,
    /// Coordinates, one field after the other.
    pub q: Vec<f64>,
    /// Velocities, likewise.
    pub u: Vec<f64>,
    /// Inputs; NaN where not set.
    pub inputs: Vec<f64>,
    /// Where every field ends in q, and how long its rows are.
    pub sizes: Sizes,
}

impl Values {
    /// Where a field lies in q.
    #[must_use]
    pub fn range(&self, field: usize) -> core::ops::Range<usize> {
        self.sizes.range(field)
    }

    /// Where a node of a grid lies in q; `None` where the grid has no such node.
    #[must_use]
    pub fn place(&self, field: usize, row: usize, column: usize) -> Option<usize> {
        let (range, columns) = (self.sizes.range(field), self.sizes.columns(field));
        let place = row.checked_mul(columns)?.checked_add(column)?.checked_add(range.start)?;
        (column < columns && place < range.end).then_some(place)
    }
}

/// Why a state cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FamilyStateError {
    /// A count or the length of a parameter does not suit the model.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// A family was given more or fewer values than it has nodes.
    #[error("`{name}` has {length} nodes, and {given} values are given for it")]
    Length {
        /// The family, or its rate.
        name: String,
        /// Its nodes.
        length: usize,
        /// The values.
        given: usize,
    },
    /// No state on the constraints was found.
    #[error(transparent)]
    NotAssembled(Box<FamilyErrorKind>),
    /// A value is infinite or not a number.
    #[error("`{name}` is {value}; give it a finite value")]
    NotFinite {
        /// The coordinate or input, with its index.
        name: String,
        /// The value.
        value: f64,
    },
}

/// A state in the making: what the generated builder wraps.
#[derive(Clone, Debug)]
pub struct GivenState {
    t: f64,
    q: Vec<Option<Vec<f64>>>,
    u: Vec<Option<Vec<f64>>>,
    inputs: Vec<f64>,
}

impl GivenState {
    /// Nothing is given: at rest at t = 0 with all coordinates 0, and no inputs.
    #[must_use]
    pub fn new(fields: usize, inputs: usize) -> Self {
        Self { t: 0.0, q: vec![None; fields], u: vec![None; fields], inputs: vec![f64::NAN; inputs] }
    }
    /// Gives the time.
    pub fn at_time(&mut self, t: f64) {
        self.t = t;
    }
    /// Gives a field's coordinates.
    pub fn coordinates(&mut self, field: usize, values: impl IntoIterator<Item = f64>) {
        self.q[field] = Some(values.into_iter().collect());
    }
    /// Gives a field's velocities.
    pub fn velocities(&mut self, field: usize, values: impl IntoIterator<Item = f64>) {
        self.u[field] = Some(values.into_iter().collect());
    }
    /// Gives an input.
    pub fn input(&mut self, index: usize, value: f64) {
        self.inputs[index] = value;
    }

    /// The state.
    ///
    /// # Errors
    /// Counts that do not suit the model, families with more or fewer values than nodes, values that are not
    /// finite. Inputs may be left out: a run then needs `.inputs(..)`.
    pub fn build<M: FamilyModel>(self, model: &M) -> Result<M::State, FamilyStateError> {
        let sizes = model.ends()?;
        let q = laid_out::<M>(&sizes, self.q, "")?;
        let u = laid_out::<M>(&sizes, self.u, "_rate")?;
        if !self.t.is_finite() {
            return Err(FamilyStateError::NotFinite { name: "t".to_owned(), value: self.t });
        }
        for (declared, value) in M::INPUTS.iter().zip(&self.inputs) {
            if value.is_infinite() {
                return Err(FamilyStateError::NotFinite { name: declared.name.to_owned(), value: *value });
            }
        }
        Ok(M::State::new(self.t, q, u, self.inputs, sizes))
    }

    /// The state, with positions and then velocities moved onto the constraints by the changes that are
    /// smallest by √Σ mᵢ xᵢ². Inputs that are not given count as 0.
    ///
    /// # Errors
    /// As for [`GivenState::build`]; where no state on the constraints is found near this one.
    pub fn assemble<M: FamilyModel>(self, model: &M) -> Result<M::State, FamilyStateError> {
        let mut state = self.build(model)?;
        let not_assembled = |kind: FamilyErrorKind| FamilyStateError::NotAssembled(Box::new(kind));
        place_on_constraints(model, &mut state).map_err(not_assembled)?;
        Ok(state)
    }
}

/// One field after the other; 0 where nothing is given.
fn laid_out<M: FamilyModel>(
    sizes: &Sizes,
    given: Vec<Option<Vec<f64>>>,
    suffix: &str,
) -> Result<Vec<f64>, FamilyStateError> {
    let mut all = vec![0.0; sizes.unknowns()];
    for (k, (field, values)) in M::FIELDS.iter().zip(given).enumerate() {
        let Some(values) = values else { continue };
        let range = sizes.range(k);
        if values.len() != range.len() {
            let name = format!("{}{suffix}", field.name);
            return Err(FamilyStateError::Length { name, length: range.len(), given: values.len() });
        }
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            let node = coordinate_name::<M>(sizes, range.start + at);
            let name = format!("{}{suffix}{}", field.name, &node[field.name.len()..]);
            return Err(FamilyStateError::NotFinite { name, value: values[at] });
        }
        all[range].copy_from_slice(&values);
    }
    Ok(all)
}
