//! Methods of integration on derived models: Taylor series, stiff problems, methods that preserve structure.

#[path = "../../common/double.rs"]
mod double;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
#[path = "../../models/kepler.rs"]
mod kepler;
mod stiff;
mod structure;
mod taylor;
mod taylor_constrained;
