//! Models of the crate `dynamics` as classes of a Python module.
//!
//! One macro makes the module: a class for every model, with keyword arguments by the names of its
//! parameters, simulations that return arrays of NumPy, and type stubs.
//!
//! ```
//! use dynamics::prelude::*;
//!
//! /// A ball on a rod.
//! #[derive(Clone, Debug, Dynamics)]
//! #[coordinates(theta: rad)]
//! #[units(mass: kg, length: m, g: m / s^2)]
//! struct Pendulum {
//!     mass: f64,
//!     length: f64,
//!     g: f64,
//! }
//!
//! #[dynamics]
//! impl Pendulum {
//!     fn ball(&self, q: &Coordinates<Self>) -> Vec2 {
//!         self.length * vec2(q.theta.sin(), -q.theta.cos())
//!     }
//!     #[kinetic]
//!     fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
//!         0.5 * self.mass * self.ball(q).dt().norm_squared()
//!     }
//!     #[potential]
//!     fn gravity(&self, q: &Coordinates<Self>) -> Expr {
//!         self.mass * self.g * self.ball(q).y
//!     }
//! }
//!
//! dynamics_python::module!(pendulums, Pendulum);
//! # fn main() {}
//! ```
//!
//! Then in Python, after `maturin develop`:
//!
//! ```python
//! from pendulums import Pendulum
//!
//! model = Pendulum(mass=1.0, length=0.5, g=9.81)
//! motion = model.simulate(model.state(theta=1.0), until=10.0)
//! motion.t, motion.theta          # arrays of NumPy
//! ```
//!
//! The guide's page `docs/guide/python.md` has the rest.
//!
//! | file | what it does |
//! |---|---|
//! | `argument` | [`Argument`]: fields of models from Python's values |
//! | `info`, `data` | names of a model; states and tables as plain data |
//! | `python_model`, `typed`, `erased` | classes, models and motions with their types, and without |
//! | `run`, `evaluate` | a run with Python's options and functions; values at many states |
//! | `law` | functions of Python in a run, and Ctrl-C, which ends it |
//! | `model`, `state`, `motion`, `summary`, `linear`, `live` | the classes of Python |
//! | `start`, `options` | what `state(..)` and `simulate(..)` are given |
//! | `arrays`, `errors` | arrays of NumPy; exceptions |
//! | `register`, `stub` | the classes as a module; its type stubs |

mod argument;
mod arrays;
mod data;
mod erased;
mod errors;
mod evaluate;
mod info;
mod law;
mod linear;
mod live;
mod model;
mod motion;
mod options;
mod python_model;
mod register;
mod run;
mod start;
mod state;
mod stub;
mod summary;
mod typed;

pub use argument::{Argument, Element, Given};
pub use info::Info;
pub use pyo3;
pub use python_model::PythonModel;
pub use typed::{FieldTypes, ModelFields};

/// What `module!` refers to. Not for use by hand: it changes without notice.
#[doc(hidden)]
pub mod __private {
    pub use crate::argument::{plain, set};
    pub use crate::register::{model, shared, stubs};
}

/// Makes a Python module with a class for every model: `module!(pendulums, Pendulum, DoublePendulum);`.
///
/// The first name is that of the module, as Python imports it: the name of the library in Cargo.toml, or the
/// last part of `module-name` in pyproject.toml. The models are structs of this crate. Their fields must be
/// visible where the macro stands, and have types that Python can give: [`Argument`]. A model of another
/// crate is written with its fields: `module!(pendulums, other::Pendulum { mass, length });`.
///
/// Documentation before the name is that of the module.
///
/// A field that is called like a method of the classes does not compile, and neither does a model that is
/// called like a class of every module:
///
/// ```compile_fail,E0080
/// use dynamics::prelude::*;
///
/// #[derive(Clone, Debug, Dynamics)]
/// #[coordinates(x)]
/// struct Block {
///     mass: f64,
///     live: f64, // `load` compiles
/// }
///
/// #[dynamics]
/// impl Block {
///     #[kinetic]
///     fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
///         0.5 * (self.mass + self.live) * q.x.dt().powi(2)
///     }
/// }
///
/// dynamics_python::module!(blocks, Block);
/// # fn main() {}
/// ```
///
/// ```compile_fail,E0080
/// use dynamics::prelude::*;
///
/// #[derive(Clone, Debug, Dynamics)]
/// #[coordinates(x)]
/// struct Motion { // `Block` compiles
///     mass: f64,
/// }
///
/// #[dynamics]
/// impl Motion {
///     #[kinetic]
///     fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
///         0.5 * self.mass * q.x.dt().powi(2)
///     }
/// }
///
/// dynamics_python::module!(blocks, Motion);
/// # fn main() {}
/// ```
///
/// Names of fields may be words of Python's grammar: `Block(**{"lambda": 1.0})`, and `r#type` is `type`.
///
/// ```
/// use dynamics::prelude::*;
///
/// #[derive(Clone, Debug, Dynamics)]
/// #[coordinates(x)]
/// struct Block {
///     lambda: f64,
///     r#type: f64,
/// }
///
/// #[dynamics]
/// impl Block {
///     #[kinetic]
///     fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
///         0.5 * (self.lambda + self.r#type) * q.x.dt().powi(2)
///     }
/// }
///
/// dynamics_python::module!(blocks, Block);
/// # fn main() {}
/// ```
#[macro_export]
macro_rules! module {
    (
        $(#[$attribute:meta])* $name:ident,
        $($($model:ident)::+ $({ $($field:ident),* $(,)? })?),+ $(,)?
    ) => {
        $(#[$attribute])*
        #[$crate::pyo3::pymodule]
        #[pyo3(crate = "::dynamics_python::pyo3")]
        fn $name(
            module: &$crate::pyo3::Bound<'_, $crate::pyo3::types::PyModule>,
        ) -> $crate::pyo3::PyResult<()> {
            $crate::__private::shared(module)?;
            $($crate::__class!(module, $($model)::+ $({ $($field),* })?);)+
            $crate::__private::stubs(module)
        }
    };
}

/// Adds the class of one model.
#[doc(hidden)]
#[macro_export]
macro_rules! __class {
    ($module:ident, $($model:ident)::+) => {{
        struct Fields;
        $($model)::+! { @fields $crate::__fields_of_struct { [$($model)::+] Fields } }
        $crate::__private::model::<Fields>($module)?
    }};
    ($module:ident, $($model:ident)::+ { $($field:ident),* }) => {{
        struct Fields;
        $crate::__fields! { [$($field),*] [$($model)::+] Fields }
        $crate::__private::model::<Fields>($module)?
    }};
}

/// Hands the names of the fields over, from the struct's tokens.
#[doc(hidden)]
#[macro_export]
macro_rules! __fields_of_struct {
    (
        {
            $(#[$attribute:meta])*
            $vis:vis struct $name:ident {
                $($(#[$about:meta])* $field_vis:vis $field:ident : $ty:ty),* $(,)?
            }
        }
        $model:tt $fields:ident
    ) => {
        $crate::__fields! { [$($field),*] $model $fields }
    };
    ({ $(#[$attribute:meta])* $vis:vis struct $name:ident; } $model:tt $fields:ident) => {
        $crate::__fields! { [] $model $fields }
    };
}

/// Implements [`ModelFields`].
#[doc(hidden)]
#[macro_export]
macro_rules! __fields {
    ([$($field:ident),*] [$($model:ident)::+] $fields:ident) => {
        $($crate::__name_is_free!($field);)*
        impl $crate::ModelFields for $fields {
            type Model = $($model)::+;
            fn fields() -> ::std::vec::Vec<$crate::FieldTypes> {
                ::std::vec![$({
                    // It has the name of the field, so that the error of a type without a form names it.
                    #[allow(non_snake_case)]
                    fn $field<M, T: $crate::Argument>(of: fn(&M) -> &T) -> $crate::FieldTypes {
                        $crate::FieldTypes::of(stringify!($field), of)
                    }
                    $field(|model: &Self::Model| &model.$field)
                }),*]
            }
            const TEXTS: [&'static str; 4] = [
                <$($model)::+>::EQUATIONS,
                <$($model)::+>::LATEX,
                <$($model)::+>::REPORT,
                <$($model)::+>::LISTING,
            ];
            fn construct(given: &mut $crate::Given<'_, '_>) -> $crate::pyo3::PyResult<Self::Model> {
                Ok($($model)::+ { $($field: given.field(stringify!($field))?),* })
            }
            #[allow(unused_variables)]
            fn set<'py>(
                model: &mut Self::Model,
                info: &$crate::Info,
                name: &str,
                value: &$crate::pyo3::Bound<'py, $crate::pyo3::PyAny>,
            ) -> $crate::pyo3::PyResult<$crate::pyo3::Bound<'py, $crate::pyo3::PyAny>> {
                $(if name == $crate::__private::plain(stringify!($field)) {
                    return $crate::__private::set(&mut model.$field, info, name, value);
                })*
                Ok(value.clone())
            }
        }
    };
}

/// Refuses a field whose name a method of the class has.
#[doc(hidden)]
#[macro_export]
macro_rules! __name_is_free {
    ($field:ident) => {
        const _: () = assert!(
            !$crate::is_taken(stringify!($field)),
            concat!(
                "the field `",
                stringify!($field),
                "` has the name of a method of Python's class; rename it"
            )
        );
    };
}

/// Whether a method of the classes has this name.
#[doc(hidden)]
#[must_use]
pub const fn is_taken(name: &str) -> bool {
    const TAKEN: &[&str] = &[
        "state",
        "simulate",
        "accelerations",
        "mass_matrix",
        "evaluate",
        "equilibrium",
        "linearize",
        "live",
        "replace",
        "to_dict",
    ];
    contains(TAKEN, name)
}

/// Whether every module has a class with this name.
pub(crate) const fn is_class(name: &str) -> bool {
    const CLASSES: &[&str] = &[
        "Model",
        "State",
        "Motion",
        "Summary",
        "Event",
        "LivePage",
        "Equilibrium",
        "Linearization",
        "SimulationError",
        "StateError",
        "EvaluationError",
    ];
    contains(CLASSES, name)
}

/// Whether a name is one of these.
const fn contains(names: &[&str], name: &str) -> bool {
    let (mut i, name) = (0, name.as_bytes());
    while i < names.len() {
        let (taken, mut j) = (names[i].as_bytes(), 0);
        while j < name.len() && j < taken.len() && name[j] == taken[j] {
            j += 1;
        }
        if j == name.len() && j == taken.len() {
            return true;
        }
        i += 1;
    }
    false
}
