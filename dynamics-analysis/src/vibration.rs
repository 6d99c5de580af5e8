//! Linear vibration and control about an equilibrium or a steady motion.
//!
//! ```text
//! let space = model.state_space(&rest)?;  // A, B, C, D by name, exact derivatives
//! let response = space.frequency_response("force", "x", &frequencies(1.0, 100.0, 400))?;
//! response.bode().write_svg("bode.svg")?;
//! let control = space.lqr().weight("theta", 10.0).weight("force", 0.1).solve()?;
//! ```
//!
//! [`StateSpace`] has ẋ = A x + B w, y = C x + D w; `frequency_response`, `resonance`, `time_response` and
//! `control` use it. [`NormalModes`] are the modes of M and K alone. [`Campbell`] has the eigenvalues of
//! rotors over their speed. [`lowest_modes`] is for banded matrices of any size:
//! [`Linearization::banded`](super::Linearization::banded) assembles them from a model, [`BandedModel`] from
//! single elements.
//!
//! Of samples, simulated or measured: [`Spectrum`] gives their frequencies, [`LogarithmicDecrement`] the
//! damping of a decay, [`ResponseEstimate`] a frequency response with its coherence,
//! [`ShockResponseSpectrum`] what a shock does to oscillators.

mod banded;
mod banded_model;
mod campbell;
mod channel;
mod charts;
mod control;
mod error;
mod fourier;
mod frequency_response;
mod linear_equations;
mod logarithmic_decrement;
mod lowest;
mod mode_animation;
mod normal_modes;
mod resonance;
mod response_estimate;
mod riccati;
mod shock_response;
mod state_space;
mod time_response;
mod uncontrollable_modes;
mod varying;

pub use banded::Banded;
pub use banded_model::BandedModel;
pub use campbell::{Campbell, CriticalSpeed, Onset, RotorMode};
pub use channel::Excitation;
pub use control::{Lqr, LqrDesign, Reach};
pub use error::{SignalUnavailable, VibrationError};
pub use fourier::{Spectrum, Window, convolve, fourier_transform, inverse_fourier_transform};
pub use frequency_response::{FrequencyResponse, frequencies};
pub use logarithmic_decrement::LogarithmicDecrement;
pub use lowest::{LowestModes, lowest_modes};
pub use mode_animation::ModeAnimation;
pub(crate) use normal_modes::MIN_SQUARED_FREQUENCY;
pub use normal_modes::NormalModes;
pub use resonance::{Gain, Peak};
pub use response_estimate::ResponseEstimate;
pub use shock_response::ShockResponseSpectrum;
pub(crate) use state_space::of_model;
pub use state_space::{Signal, StateSpace};
pub use time_response::{Load, TimeResponse};
