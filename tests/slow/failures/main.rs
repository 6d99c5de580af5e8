//! Where methods fail: errors that name their cause, or right answers within stated bounds.

mod causes;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
#[path = "../../models/hencky.rs"]
mod hencky;
#[path = "../../models/kepler.rs"]
mod kepler;
#[path = "../../models/neutral.rs"]
mod neutral;
mod outcomes;
#[path = "../../models/top.rs"]
mod top;
#[path = "../../models/truss.rs"]
mod truss;
mod when_methods_fail;
#[path = "../../models/ziegler.rs"]
mod ziegler;
