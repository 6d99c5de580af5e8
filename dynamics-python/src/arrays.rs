//! Arrays of NumPy from numbers, and back.

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat};

use crate::data::Matrix;

/// A vector.
pub(crate) fn vector<'py>(py: Python<'py>, values: Vec<f64>) -> Bound<'py, PyAny> {
    PyArray1::from_vec(py, values).into_any()
}

/// A matrix.
pub(crate) fn matrix<'py>(py: Python<'py>, matrix: Matrix) -> PyResult<Bound<'py, PyAny>> {
    shaped(py, matrix.values, &[matrix.rows, matrix.columns])
}

/// An array of this shape, by rows; of no dimensions a number.
pub(crate) fn shaped<'py>(py: Python<'py>, values: Vec<f64>, shape: &[usize]) -> PyResult<Bound<'py, PyAny>> {
    match shape {
        [] => Ok(values.first().copied().unwrap_or(f64::NAN).into_pyobject(py)?.into_any()),
        [_] => Ok(vector(py, values)),
        shape => Ok(PyArray1::from_vec(py, values).reshape(shape.to_vec())?.into_any()),
    }
}

/// Some columns of a matrix: one as a vector, several as a matrix, where they belong to an array.
pub(crate) fn columns<'py>(
    py: Python<'py>,
    from: &Matrix,
    at: usize,
    len: Option<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let width = len.unwrap_or(1);
    let rows = from.values.chunks(from.columns.max(1)).take(from.rows);
    let values: Vec<f64> = rows.flat_map(|row| row[at..at + width].iter().copied()).collect();
    match len {
        None => Ok(vector(py, values)),
        Some(len) => matrix(py, Matrix { rows: from.rows, columns: len, values }),
    }
}

/// Makes an array refuse to be written: it is a copy, and a change of it would change nothing.
pub(crate) fn read_only<'py>(array: Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let flags = PyDict::new(array.py());
    flags.set_item("write", false)?;
    array.call_method("setflags", (), Some(&flags))?;
    Ok(array)
}

/// Kinds of NumPy's types that are real numbers: Booleans, integers with and without sign, floating point.
const REAL: &str = "biuf";

/// A real number. What Python would convert with a loss, such as a complex number of NumPy, is refused.
pub(crate) fn number(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    // Most are: laws return them at every stage.
    if let Ok(number) = value.cast::<PyFloat>() {
        return Ok(number.value());
    }
    if let Ok(kind) = value.getattr("dtype").and_then(|dtype| dtype.getattr("kind"))
        && !kind.extract::<String>().is_ok_and(|kind| REAL.contains(&kind))
    {
        let given = value.repr()?;
        return Err(PyTypeError::new_err(format!("must be real number, not {given}")));
    }
    value.extract()
}

/// Real numbers as an array: anything that `numpy.asarray(value)` makes an array of numbers of.
pub(crate) fn numbers<'py>(what: &str, value: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    if let Ok(array) = value.cast::<PyArrayDyn<f64>>()
        && is_readable(array)
    {
        return Ok(array.readonly());
    }
    let py = value.py();
    let numpy = py.import("numpy")?;
    let array = numpy
        .call_method1("asarray", (value,))
        .map_err(|error| PyTypeError::new_err(format!("{what}: numbers are needed, {}", error.value(py))))?;
    let dtype = array.getattr("dtype")?;
    // Not to be converted: None would be NaN, a complex number would lose its imaginary part.
    if !REAL.contains(&dtype.getattr("kind")?.extract::<String>()?) {
        return Err(PyTypeError::new_err(format!(
            "{what}: real numbers are needed, and these are of NumPy's type {dtype}"
        )));
    }
    let array = numpy.call_method1("require", (array, "float64", ["C_CONTIGUOUS", "ALIGNED"]))?;
    Ok(array.cast_into::<PyArrayDyn<f64>>().map_err(PyErr::from)?.readonly())
}

/// Whether an array lies in memory as Rust needs it: columns of packed records may not.
fn is_readable(array: &Bound<'_, PyArrayDyn<f64>>) -> bool {
    const WIDTH: usize = size_of::<f64>();
    let aligned = (array.data() as usize).is_multiple_of(WIDTH);
    aligned && array.strides().iter().all(|stride| stride.unsigned_abs().is_multiple_of(WIDTH))
}

/// The elements by rows, whatever the order in memory.
pub(crate) fn elements(array: &PyReadonlyArrayDyn<'_, f64>) -> Vec<f64> {
    let view = array.as_array();
    match view.as_slice() {
        Some(elements) => elements.to_vec(),
        None => view.iter().copied().collect(),
    }
}

/// Rows of `width` numbers each: one row of a vector, several of a matrix.
pub(crate) struct Rows {
    pub(crate) values: Vec<f64>,
    /// The number of rows of a matrix; `None` of a vector.
    pub(crate) count: Option<usize>,
}

impl Rows {
    /// Reads them.
    pub(crate) fn read(what: &str, width: usize, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let array = numbers(what, value)?;
        let count = match array.shape() {
            [length] if *length == width => None,
            [rows, length] if *length == width => Some(*rows),
            [] if width == 1 => None,
            // A model with one coordinate may be given its values over time without a second dimension.
            [rows] if width == 1 => Some(*rows),
            shape => {
                return Err(PyValueError::new_err(format!(
                    "{what} has the shape {shape:?}; give ({width},) for one state, or (rows, {width}) for \
                     several"
                )));
            }
        };
        Ok(Self { values: elements(&array), count })
    }

    /// The numbers of a row; a vector is the row of all.
    pub(crate) fn row(&self, index: usize, width: usize) -> &[f64] {
        let from = if self.count.is_some() { index * width } else { 0 };
        &self.values[from..from + width]
    }
}

/// A sequence of times.
pub(crate) fn times(what: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = numbers(what, value)?;
    if array.shape().len() > 1 {
        let shape = array.shape();
        return Err(PyValueError::new_err(format!("{what} has the shape {shape:?}; give a list of times")));
    }
    Ok(elements(&array))
}
