//! Linear vibration and control about an equilibrium or a steady motion.
//!
//! ```text
//! let space = model.state_space(&rest)?;     // A, B, C, D by name, all from the graph
//! let response = space.frequency_response("force", "x", &frequencies(1.0, 100.0, 400))?;
//! response.bode().write_svg("bode.svg")?;
//! let control = space.lqr().weight("theta", 10.0).weight("force", 0.1).solve()?;
//! ```
//!
//! [`StateSpace`] holds ẋ = A x + B w, y = C x + D w; `frequency_response`, `time_response` and `control` use
//! it. [`NormalModes`] are the modes of M and K alone. [`Campbell`] follows eigenvalues of rotors over their
//! speed. [`Spectrum`] gives the frequencies in a simulated motion. [`lowest_modes`] is for banded matrices
//! of any size, which [`Linearization::banded`](super::Linearization::banded) makes of a model and
//! [`BandedModel`] of single elements.

mod banded;
mod banded_model;
mod campbell;
mod channel;
mod charts;
mod control;
mod error;
mod film;
mod fourier;
mod frequency_response;
mod linear_equations;
mod lowest;
mod normal_modes;
mod resonance;
mod riccati;
mod state_space;
mod time_response;
mod unreached;
mod varying;

pub use banded::Banded;
pub use banded_model::BandedModel;
pub use campbell::{Campbell, CriticalSpeed, Onset, RotorMode};
pub use channel::Excitation;
pub use control::{Lqr, LqrDesign, Reach};
pub use error::{VibrationError, Withheld};
pub use film::ModeFilm;
pub use fourier::{Spectrum, Window};
pub use frequency_response::{FrequencyResponse, frequencies};
pub use lowest::{LowestModes, lowest_modes};
pub use normal_modes::NormalModes;
pub use resonance::{Gain, Peak};
pub(crate) use state_space::of_model;
pub use state_space::{Signal, StateSpace};
pub use time_response::{Load, TimeResponse};
