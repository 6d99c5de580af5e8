//! Mechanisms for Python.
mod double_pendulum;
pub use double_pendulum::DoublePendulum;
dynamics_python::module!(mechanisms, DoublePendulum);
