//! Fields of models from Python's values.

use dynamics::{CubicSpline, Mat3, Vec2, Vec3};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};

use crate::arrays;
use crate::info::{Field, Info};
use crate::options;

/// The type of a model's field that Python can give: numbers, arrays of numbers, vectors, matrices, splines.
///
/// Implement it for your own smooth functions. Then `module!` takes models that have them:
///
/// ```
/// use dynamics_python::{Argument, pyo3};
/// use pyo3::prelude::*;
///
/// /// A trapezoidal profile; its `SmoothFunction` is left out here.
/// struct Travel {
///     distance: f64,
///     time: f64,
/// }
///
/// impl Argument for Travel {
///     const TAKES: &'static str = "tuple[float, float]";
///     fn from_python(value: &Bound<'_, PyAny>) -> PyResult<Self> {
///         let (distance, time) = value.extract()?;
///         Ok(Self { distance, time })
///     }
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "a field of type `{Self}` has no form in Python; implement `dynamics_python::Argument` for it",
    label = "no Python value becomes this"
)]
pub trait Argument: Sized {
    /// The type of the argument in stubs.
    const TAKES: &'static str;
    /// The type of the attribute in stubs.
    const GIVES: &'static str = Self::TAKES;
    /// The value of the field.
    ///
    /// # Errors
    /// A value of another kind, with what is needed; the name of the field is put before it.
    fn from_python(value: &Bound<'_, PyAny>) -> PyResult<Self>;
    /// What the attribute shows, and what a pickled model takes with it, for a value that was given:
    /// a deep copy, unless this says otherwise. `from_python` must take it.
    ///
    /// # Errors
    /// Python's own.
    fn shown<'py>(&self, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        // What was given may change later, and the model would not.
        given.py().import("copy")?.call_method1("deepcopy", (given,))
    }
}

impl Argument for f64 {
    const TAKES: &'static str = "float";
    fn from_python(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        arrays::number(value)
    }
    fn shown<'py>(&self, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.into_pyobject(given.py())?.into_any())
    }
}

impl<T: Element, const N: usize> Argument for [T; N] {
    const TAKES: &'static str = "ArrayLike";
    const GIVES: &'static str = "NDArray[np.float64]";
    fn from_python(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let shape = Self::shape();
        let values = of_shape(value, &shape)?;
        Ok(Self::of(&values))
    }
    fn shown<'py>(&self, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let mut values = Vec::new();
        self.flatten_into(&mut values);
        arrays::read_only(arrays::shaped(given.py(), values, &Self::shape())?)
    }
}

/// A number, or an array of numbers of a fixed shape.
#[diagnostic::on_unimplemented(
    message = "an array of `{Self}` has no form in Python; arrays of `f64` have, and arrays of such arrays"
)]
pub trait Element: Sized {
    /// The lengths of its dimensions.
    fn shape() -> Vec<usize>;
    /// The element of as many numbers as the shape says, by rows.
    fn of(values: &[f64]) -> Self;
    /// Appends its numbers.
    fn flatten_into(&self, values: &mut Vec<f64>);
}

impl Element for f64 {
    fn shape() -> Vec<usize> {
        Vec::new()
    }
    fn of(values: &[f64]) -> Self {
        values.first().copied().unwrap_or(f64::NAN)
    }
    fn flatten_into(&self, values: &mut Vec<f64>) {
        values.push(*self);
    }
}

impl<T: Element, const N: usize> Element for [T; N] {
    fn shape() -> Vec<usize> {
        let mut shape = vec![N];
        shape.extend(T::shape());
        shape
    }
    fn of(values: &[f64]) -> Self {
        let width: usize = T::shape().iter().product();
        core::array::from_fn(|i| T::of(&values[i * width..(i + 1) * width]))
    }
    fn flatten_into(&self, values: &mut Vec<f64>) {
        self.iter().for_each(|element| element.flatten_into(values));
    }
}

macro_rules! like_arrays {
    ($($ty:ty => $array:ty),* $(,)?) => {$(
        impl Argument for $ty {
            const TAKES: &'static str = "ArrayLike";
            const GIVES: &'static str = "NDArray[np.float64]";
            fn from_python(value: &Bound<'_, PyAny>) -> PyResult<Self> {
                Ok(<$array>::from_python(value)?.into())
            }
            fn shown<'py>(&self, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
                <$array as Argument>::shown(&self.to_array(), given)
            }
        }
    )*};
}

like_arrays! { Vec2<f64> => [f64; 2], Vec3<f64> => [f64; 3], Mat3<f64> => [[f64; 3]; 3] }

/// A spline: two arrays, knots and values, with natural ends; or the same with the ends as the third:
/// `"natural"`, `"not-a-knot"`, `"periodic"`, or the slopes at both ends; or a dictionary of `knots`,
/// `values` and `ends`. The attribute shows a tuple with read-only arrays.
impl Argument for CubicSpline {
    const TAKES: &'static str = "Spline";
    const GIVES: &'static str = "tuple[Any, ...]";
    fn from_python(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let Parts { knots, values, ends } = Parts::of(value)?;
        let [knots, values] = [arrays::times("knots", &knots)?, arrays::times("values", &values)?];
        let wrong = || PyValueError::new_err(SPLINE);
        let spline = match ends {
            None => Self::natural(&knots, &values),
            Some(ends) => match (ends.cast::<PyString>(), ends.extract::<[f64; 2]>()) {
                (Ok(name), _) => match name.to_cow()?.as_ref() {
                    "natural" => Self::natural(&knots, &values),
                    "not-a-knot" => Self::not_a_knot(&knots, &values),
                    "periodic" => Self::periodic(&knots, &values),
                    _ => return Err(wrong()),
                },
                (_, Ok([first, last])) => Self::clamped(&knots, &values, first, last),
                _ => return Err(PyTypeError::new_err(SPLINE)),
            },
        };
        spline.map_err(|e| PyValueError::new_err(e.to_string()))
    }
    fn shown<'py>(&self, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (py, Parts { knots, values, ends }) = (given.py(), Parts::of(given)?);
        let copy = |array| arrays::read_only(arrays::vector(py, arrays::times("spline", &array)?));
        let mut parts = vec![copy(knots)?, copy(values)?];
        if let Some(ends) = ends {
            parts.push(match ends.extract::<[f64; 2]>() {
                Ok([first, last]) => (first, last).into_pyobject(py)?.into_any(),
                Err(_) => ends,
            });
        }
        Ok(PyTuple::new(py, parts)?.into_any())
    }
}

/// How a spline is given.
const SPLINE: &str = "give a spline as (knots, values), as (knots, values, ends), or as {\"knots\": .., \
     \"values\": .., \"ends\": ..}; ends are \"natural\", \"not-a-knot\", \"periodic\" or (slope, slope)";

/// What a spline is made of.
struct Parts<'py> {
    knots: Bound<'py, PyAny>,
    values: Bound<'py, PyAny>,
    ends: Option<Bound<'py, PyAny>>,
}

impl<'py> Parts<'py> {
    fn of(value: &Bound<'py, PyAny>) -> PyResult<Self> {
        let Some(options) = options::entries(value) else {
            if let Ok((knots, values, ends)) = value.extract() {
                return Ok(Self { knots, values, ends: Some(ends) });
            }
            let (knots, values) = value.extract().map_err(|_| PyTypeError::new_err(SPLINE))?;
            return Ok(Self { knots, values, ends: None });
        };
        if let Some(key) = options.keys().iter().find(|key| {
            !key.extract::<String>().is_ok_and(|key| ["knots", "values", "ends"].contains(&&*key))
        }) {
            return Err(PyTypeError::new_err(format!("{} is not part of a spline; {SPLINE}", key.repr()?)));
        }
        let part = |name| options.get_item(name)?.ok_or_else(|| PyTypeError::new_err(SPLINE));
        Ok(Self { knots: part("knots")?, values: part("values")?, ends: options.get_item("ends")? })
    }
}

/// The numbers of an array of exactly this shape.
fn of_shape(value: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<Vec<f64>> {
    use numpy::PyUntypedArrayMethods as _;
    let array = arrays::numbers("value", value)?;
    if array.shape() != shape {
        let (needed, given) = (tuple(shape), tuple(array.shape()));
        return Err(PyValueError::new_err(format!("an array of the shape {needed} is needed, not {given}")));
    }
    Ok(arrays::elements(&array))
}

/// A shape as Python writes it.
fn tuple(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        several => format!("({})", several.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// Keyword arguments of a class.
#[derive(Debug)]
pub struct Given<'a, 'py> {
    pub(crate) info: &'a Info,
    pub(crate) values: &'a Bound<'py, PyDict>,
    /// What the attributes show.
    pub(crate) shown: Bound<'py, PyDict>,
}

impl<'a, 'py> Given<'a, 'py> {
    /// Arguments whose names are those of the fields.
    pub(crate) fn new(info: &'a Info, values: &'a Bound<'py, PyDict>) -> PyResult<Self> {
        let name_of = |field: &Field| field.name;
        let known: Vec<&str> = info.fields.iter().map(name_of).collect();
        for key in values.keys() {
            let name: String = key.extract()?;
            if !known.contains(&&*name) {
                return Err(PyTypeError::new_err(format!(
                    "{} has no parameter `{name}`; its parameters are {}",
                    info.name,
                    info.field_names()
                )));
            }
        }
        let missing = info.fields.iter().filter(|field| !values.contains(field.name).unwrap_or(false));
        let missing: Vec<String> = missing.map(Field::shown).collect();
        if !missing.is_empty() {
            return Err(PyTypeError::new_err(format!(
                "{} needs {}; its parameters are {}",
                info.name,
                missing.join(", "),
                info.field_names()
            )));
        }
        Ok(Self { info, values, shown: PyDict::new(values.py()) })
    }

    /// The value of the field with this name.
    ///
    /// # Errors
    /// A value of another kind.
    pub fn field<T: Argument>(&mut self, name: &'static str) -> PyResult<T> {
        let name = plain(name);
        let given = self.values.get_item(name)?.ok_or_else(|| PyTypeError::new_err(name))?;
        let (value, shown) = convert::<T>(self.info, name, &given)?;
        self.shown.set_item(name, shown)?;
        Ok(value)
    }
}

/// A field's value, and what its attribute shows.
fn convert<'py, T: Argument>(
    info: &Info,
    name: &str,
    given: &Bound<'py, PyAny>,
) -> PyResult<(T, Bound<'py, PyAny>)> {
    let value = T::from_python(given).map_err(|error| named(given.py(), info, name, &error))?;
    let shown = value.shown(given)?;
    Ok((value, shown))
}

/// The name of a field as a program has it: without `r#`.
#[must_use]
pub fn plain(name: &'static str) -> &'static str {
    name.strip_prefix("r#").unwrap_or(name)
}

/// Sets a field; returns what its attribute shows.
///
/// # Errors
/// A value of another kind.
pub fn set<'py, T: Argument>(
    field: &mut T,
    info: &Info,
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let (value, shown) = convert::<T>(info, name, value)?;
    *field = value;
    Ok(shown)
}

/// The error with the name of the parameter, of the same type.
fn named(py: Python<'_>, info: &Info, name: &str, error: &PyErr) -> PyErr {
    let shown = info.fields.iter().find(|field| field.name == name).map_or(name.to_owned(), Field::shown);
    let text = format!("parameter {shown}: {}", error.value(py));
    match error.is_instance_of::<PyValueError>(py) {
        true => PyValueError::new_err(text),
        false => PyTypeError::new_err(text),
    }
}
